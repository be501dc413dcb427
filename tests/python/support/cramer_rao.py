"""The Cramer-Rao bound of a joint between unknown structures, by differences: nothing shared with the fit."""

import numpy as np


def symmetric(values, n):
    """Symmetric matrices from their upper triangles."""
    matrix = np.zeros((*values.shape[:-1], n, n), complex)
    for position, (a, b) in enumerate(zip(*np.triu_indices(n), strict=True)):
        matrix[..., a, b] = matrix[..., b, a] = values[..., position]
    return matrix


def term_matrices(basis):
    """Matrix of each parameter on each line, shape (n_parameters, n_freq, n, n); of a `Basis` or of `JointTerms`."""
    units = np.zeros((len(basis.pairs), basis.n, basis.n))
    for unit, (a, b) in zip(units, basis.pairs, strict=True):
        unit[a, b] = unit[b, a] = 1
    if hasattr(basis, "kinds"):
        return basis.factors[basis.kinds][:, :, None, None] * units[:, None]
    return (basis.factors[:, None, :, None, None] * units[:, None]).reshape(
        -1, basis.factors.shape[1], *units.shape[1:]
    )


def cramer_rao(gamma, k_joint, basis, *, unknown_cross=False, std=None):
    """Covariance for independent noise of gamma, of unit relative size or of this std, nothing known around the joint.

    Unknown on every line: the symmetric dynamic stiffnesses Z_A and Z_B of both sides, and where `unknown_cross` the
    cross terms of the joint's compliance; measured: all entries of gamma.
    """
    n = k_joint.shape[-1]
    inverse = np.linalg.inv(gamma)
    z_a, z_b = inverse[:, :n, :n] - k_joint, inverse[:, n:, n:] - k_joint
    upper = np.triu_indices(n)
    p, q = len(basis.parameters), n * (n + 1)
    information = np.zeros((p, p))
    for i, k in enumerate(k_joint):

        def model(joint, sides):
            a, b = symmetric(sides[..., : q // 2], n), symmetric(sides[..., q // 2 :], n)
            joint, a, b = np.broadcast_arrays(joint, a, b)
            whole = np.concatenate(
                [np.concatenate([a + joint, -joint], axis=-1), np.concatenate([-joint, b + joint], axis=-1)], axis=-2
            )
            return np.linalg.inv(whole).reshape(*whole.shape[:-2], -1)

        sides = np.concatenate([z_a[i][upper], z_b[i][upper]])
        # A DOF that is free has no stiffness to take a share of for a step.
        own = np.maximum(abs(np.diagonal(k)), 1e-3 * abs(np.diagonal(z_b[i])))
        size = np.sqrt(np.outer(own, own))
        matrices = term_matrices(basis)[:, i]
        steps = np.array([1e-6 * (size / np.where(m != 0, abs(m), np.inf)).max() for m in matrices])
        moved = steps[:, None, None] * matrices
        slopes = ((model(k + moved, sides) - model(k - moved, sides)) / (2 * steps[:, None])).T
        roots = [np.sqrt(abs(np.diagonal(z[i]))) for z in (z_a, z_b)]
        steps = 1e-5 * np.concatenate([np.outer(root, root)[upper] for root in roots])
        moved = np.diag(steps).astype(complex)
        free = ((model(k, sides + moved) - model(k, sides - moved)) / (2 * steps[:, None])).T
        if unknown_cross:
            small = 1e-6 * symmetric(np.eye(q // 2), n)[[a != b for a, b in zip(*upper, strict=True)]] / size
            by_cross = (model(k + k @ small @ k, sides) - model(k - k @ small @ k, sides)).T
            free = np.concatenate([free, by_cross], axis=1)
        weight = 1 / (abs(gamma[i]) if std is None else std[i]).ravel()[:, None]
        slopes, free = slopes * weight, free * weight
        free = free / np.linalg.norm(free, axis=0)
        # gamma is analytic in the unknowns of a line: they take a complex subspace out of the data.
        rest = slopes - free @ np.linalg.lstsq(free, slopes, rcond=None)[0]
        information += 2 * (rest.conj().T @ rest).real
    size = np.sqrt(np.diag(information))
    return np.linalg.inv(information / np.outer(size, size)) / np.outer(size, size)
