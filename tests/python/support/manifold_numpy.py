"""Projection on the manifold of FRFs that fit a joint, and quadratic forms of the joint, by plain linear algebra.

The formulas of `jointfrf.identification.manifold.on_manifold` with matrices of derivatives written out in full,
line by line, numpy's solver, and a basis by singular values.
"""

import numpy as np

from jointfrf.identification.manifold.on_manifold import OnManifold, frfs_of_joint

FIRST, SMALLEST, LARGEST = 1e-2, 1e-10, 1e8
GAIN = 1e-5


def columns(data, h, q, r, which, factor=None):
    """Return whitened derivatives of the entries by the unit matrices of H, Q or R, shape (n_freq, q, u)."""
    one, unit, z = np.eye(data.entries.n), data.entries.units, np.diag(data.reference)
    h, q, r = h[:, None], q[:, None], r[:, None]
    t, t_left, a, a_left = one - z @ r, one - r @ z, one - q @ r, one - r @ q
    right, left = t @ a, a_left @ t_left
    if which == "h":
        jj, jk, kj, kk = np.broadcast_to(unit, (len(h), *unit.shape)), unit @ right, left @ unit, left @ unit @ right
    else:
        if which == "q":
            d_right, d_left, own = -t @ unit @ r, -r @ unit @ t_left, -r @ unit @ r
        else:
            d_right, d_left = -z @ unit @ a - t @ q @ unit, -unit @ q @ t_left - a_left @ unit @ z
            own = unit @ a - r @ q @ unit
        jk, kj = h @ d_right, d_left @ h
        jj, kk = np.zeros_like(jk), d_left @ h @ right + left @ h @ d_right + own
    whole = np.concatenate([np.concatenate([jj, jk], -1), np.concatenate([kj, kk], -1)], -2)
    return whitened(data, data.entries.take(whole), factor).swapaxes(1, 2)


def whitened(data, values, factor):
    """Return entries (n_freq, ..., q) divided by their deviations, then multiplied by a triangular factor."""
    w = data.inverse_std
    w = w.reshape(len(w), *[1] * (values.ndim - 2), -1)
    weighted = np.where(w == 0, 0, values * w)
    if factor is None:
        return weighted
    return np.einsum("lpq,l...q->l...p", factor, weighted)


def free_columns(data, h, q, r, factor=None):
    return np.concatenate([columns(data, h, q, r, which, factor) for which in "hq"], axis=2)


def project(target, data, r, start, steps, factor=None):
    """Levenberg-Marquardt, each line by itself."""
    found = [_project_line(*line, steps) for line in _line_by_line(target, data, r, start, factor)]
    return OnManifold(*(np.concatenate(x) for x in zip(*found, strict=True)))


def _line_by_line(target, data, r, start, factor):
    for i in range(len(r)):
        one = slice(i, i + 1)
        own = None if factor is None else factor[one]
        yield target[one], data.on_lines(np.array([i])), r[one], start.h[one], start.q[one], own


def _project_line(target, data, r, h, q, factor, steps):
    unit = data.entries.units
    u = len(unit)

    def residual(h, q):
        left = whitened(data, target - data.entries.take(frfs_of_joint(h, q, r, data.reference)), factor)
        return left[0], (abs(left) ** 2).sum(axis=1)

    left, squares = residual(h, q)
    damping = FIRST
    for _ in range(steps):
        j = free_columns(data, h, q, r, factor)[0]
        size = np.linalg.norm(j, axis=0)
        size = np.where(size > 0, size, 1)
        j = j / size
        normal = j.conj().T @ j + (damping + 1e-12) * np.eye(2 * u)
        step = np.linalg.solve(normal, j.conj().T @ left) / size
        there_h, there_q = h + np.tensordot(step[:u], unit, 1), q + np.tensordot(step[u:], unit, 1)
        there_left, there_squares = residual(there_h, there_q)
        good, gain = bool(there_squares <= squares), float(squares[0] - there_squares[0])
        if good:
            h, q, left, squares = there_h, there_q, there_left, there_squares
        damping = float(np.clip(damping / 6 if good else damping * 8, SMALLEST, LARGEST))
        if good and gain <= GAIN:
            break
    return OnManifold(h, q, squares)


def normal_forms(data, r, on, targets, factor=None):
    """Return W, p and the squares for each target, shapes (n_freq, u, u), (n_freq, u) and (n_freq,)."""
    gamma = data.entries.take(frfs_of_joint(on.h, on.q, r, data.reference))
    own = columns(data, on.h, on.q, r, "r", factor)
    free = free_columns(data, on.h, on.q, r, factor)
    size = np.linalg.norm(free, axis=1, keepdims=True)
    vectors, values, _ = np.linalg.svd(free / np.where(size > 0, size, 1), full_matrices=False)
    basis = vectors * (values > 1e-12 * values[:, :1])[:, None]
    adjoint = basis.conj().swapaxes(1, 2)
    own = own - basis @ (adjoint @ own)
    own_adjoint = own.conj().swapaxes(1, 2)
    forms = []
    for target in targets:
        left = whitened(data, target - gamma, factor)[..., None]
        left = left - basis @ (adjoint @ left)
        forms.append((own_adjoint @ own, (own_adjoint @ left)[..., 0], (abs(left[..., 0]) ** 2).sum(axis=1)))
    return forms
