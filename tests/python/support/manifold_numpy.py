"""Projection on the manifold of FRFs that fit a joint, and quadratic forms of the joint, by plain linear algebra.

The formulas of `jointfrf.identification.manifold.on_manifold` with matrices of derivatives written out in full,
line by line, numpy's solver, and a basis by singular values.
"""

import numpy as np

from jointfrf.identification.manifold.on_manifold import OnManifold, frfs_of_joint

FIRST, SMALLEST, LARGEST = 1e-2, 1e-10, 1e8
GAIN = 1e-5


def columns(data, h, m, c, which, factor=None):
    """Return whitened derivatives of the entries by the unit matrices of H, M or C, shape (n_freq, q, u)."""
    one, unit = np.eye(data.entries.n), data.entries.units
    right, left = (one - m @ c)[:, None], (one - c @ m)[:, None]
    h, m, c = h[:, None], m[:, None], c[:, None]
    if which == "h":
        jj, jk, kj, kk = np.broadcast_to(unit, (len(h), *unit.shape)), unit @ right, left @ unit, left @ unit @ right
    elif which == "m":
        uc, cu = unit @ c, c @ unit
        jk, kj = -h @ uc, -cu @ h
        jj, kk = np.zeros_like(jk), -cu @ h @ right - left @ h @ uc - c @ uc
    else:
        mu, um = m @ unit, unit @ m
        jk, kj = -h @ mu, -um @ h
        jj, kk = np.zeros_like(jk), -um @ h @ right - left @ h @ mu + unit @ right - c @ mu
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


def free_columns(data, h, m, c, factor=None):
    return np.concatenate([columns(data, h, m, c, which, factor) for which in "hm"], axis=2)


def project(target, data, c, start, steps, factor=None):
    """Levenberg-Marquardt, each line by itself."""
    found = [_project_line(*line, steps) for line in _line_by_line(target, data, c, start, factor)]
    return OnManifold(*(np.concatenate(x) for x in zip(*found, strict=True)))


def _line_by_line(target, data, c, start, factor):
    for i in range(len(c)):
        one = slice(i, i + 1)
        own = None if factor is None else factor[one]
        yield target[one], data.on_lines(np.array([i])), c[one], start.h[one], start.m[one], own


def _project_line(target, data, c, h, m, factor, steps):
    unit = data.entries.units
    u = len(unit)

    def residual(h, m):
        r = whitened(data, target - data.entries.take(frfs_of_joint(h, m, c)), factor)
        return r[0], (abs(r) ** 2).sum(axis=1)

    r, squares = residual(h, m)
    damping = FIRST
    for _ in range(steps):
        j = free_columns(data, h, m, c, factor)[0]
        size = np.linalg.norm(j, axis=0)
        size = np.where(size > 0, size, 1)
        j = j / size
        normal = j.conj().T @ j + (damping + 1e-12) * np.eye(2 * u)
        step = np.linalg.solve(normal, j.conj().T @ r) / size
        there_h, there_m = h + np.tensordot(step[:u], unit, 1), m + np.tensordot(step[u:], unit, 1)
        there_r, there_squares = residual(there_h, there_m)
        good, gain = bool(there_squares <= squares), float(squares[0] - there_squares[0])
        if good:
            h, m, r, squares = there_h, there_m, there_r, there_squares
        damping = float(np.clip(damping / 6 if good else damping * 8, SMALLEST, LARGEST))
        if good and gain <= GAIN:
            break
    return OnManifold(h, m, squares)


def normal_forms(data, c, on, targets, factor=None):
    """Return W, p and the squares for each target, shapes (n_freq, u, u), (n_freq, u) and (n_freq,)."""
    gamma = data.entries.take(frfs_of_joint(on.h, on.m, c))
    own = columns(data, on.h, on.m, c, "c", factor)
    free = free_columns(data, on.h, on.m, c, factor)
    size = np.linalg.norm(free, axis=1, keepdims=True)
    vectors, values, _ = np.linalg.svd(free / np.where(size > 0, size, 1), full_matrices=False)
    basis = vectors * (values > 1e-12 * values[:, :1])[:, None]
    adjoint = basis.conj().swapaxes(1, 2)
    own = own - basis @ (adjoint @ own)
    own_adjoint = own.conj().swapaxes(1, 2)
    forms = []
    for target in targets:
        r = whitened(data, target - gamma, factor)[..., None]
        r = r - basis @ (adjoint @ r)
        forms.append((own_adjoint @ own, (own_adjoint @ r)[..., 0], (abs(r[..., 0]) ** 2).sum(axis=1)))
    return forms
