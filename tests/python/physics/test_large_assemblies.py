"""Assemblies of many DOFs against the equations of the joint, solved as they stand with 64-bit mantissas."""

from typing import get_args

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.kernel.call import Engine

EPS = np.finfo(float).eps


def solved(a, b):
    """Return A^-1 B of every line by elimination with row pivoting in extended precision."""
    a, b = a.astype(np.clongdouble), b.astype(np.clongdouble)
    lines, n = np.arange(a.shape[0]), a.shape[1]
    for k in range(n):
        pivot = k + np.argmax(abs(a[:, k:, k]), axis=1)
        for m in (a, b):
            m[lines, pivot], m[:, k] = m[:, k].copy(), m[lines, pivot].copy()
        factor = a[:, k + 1 :, k] / a[:, k, k, None]
        a[:, k + 1 :] -= factor[:, :, None] * a[:, None, k]
        b[:, k + 1 :] -= factor[:, :, None] * b[:, None, k]
    for k in reversed(range(n)):
        b[:, k] = (b[:, k] - np.einsum("fj,fjm->fm", a[:, k, k + 1 :], b[:, k + 1 :])) / a[:, k, k, None]
    return b


def from_joint_forces(h_a, h_b, k, dofs_a, dofs_b):
    """Forces g = K (x_j - x_k) of the joint, from x_j - x_k = rows f - (H_jj + H_kk) g; then x = H f - columns g."""
    n_a, n = h_a.shape[1], h_a.shape[1] + h_b.shape[1]
    h = np.zeros((h_a.shape[0], n, n), np.clongdouble)
    h[:, :n_a, :n_a], h[:, n_a:, n_a:] = h_a, h_b
    pick = np.zeros((len(dofs_a), n))
    pick[np.arange(len(dofs_a)), dofs_a] = 1
    pick[np.arange(len(dofs_a)), n_a + np.asarray(dofs_b)] = -1
    rows, columns, wide = pick @ h, h @ pick.T, k.astype(np.clongdouble)
    return h - columns @ solved(np.eye(len(dofs_a)) + wide @ (rows @ pick.T), wide @ rows)


def structure(rng, n_freq, n, rank=None):
    """Receptances of `rank` modes (n by default), m/N, of a structure with 2 % damping."""
    rank = n if rank is None else rank
    omega = np.linspace(0.3, 3.0, n_freq)[:, None]
    stiffness = rng.uniform(0.1, 12.0, rank)
    shapes = rng.standard_normal((n, rank))
    return np.einsum("ir,fr,jr->fij", shapes, 1e-6 / (stiffness * (1 + 0.02j) - omega**2), shapes)


#: DOFs of A and of B, joint DOFs, and how many modes there are: all, or few, so that H_jj + H_kk is nearly singular.
SIZES = [(26, 25, 6, None), (48, 48, 24, None), (40, 11, 3, None), (60, 50, 9, 5), (130, 120, 2, None)]


@pytest.mark.parametrize("stiffness", [1e3, 1e6, 1e9])
@pytest.mark.parametrize(("n_a", "n_b", "n_j", "rank"), SIZES)
def test_couplings_of_many_dofs_reach_the_reference(n_a, n_b, n_j, rank, stiffness):
    """Against extended precision no engine has ten times the error of LAPACK line by line, nor beyond its condition."""
    rng = np.random.default_rng([n_a, n_j])
    n_freq = 11
    h_a, h_b = structure(rng, n_freq, n_a, rank), structure(rng, n_freq, n_b, rank)
    root = rng.standard_normal((n_j, n_j))
    k = np.broadcast_to(stiffness * (root @ root.T + np.eye(n_j)) * (1 + 0.05j), (n_freq, n_j, n_j)).copy()
    dofs = rng.permutation(n_a)[:n_j], rng.permutation(n_b)[:n_j]
    expected = from_joint_forces(h_a, h_b, k, *dofs)
    system = np.eye(n_j) + k @ (h_a[:, dofs[0]][:, :, dofs[0]] + h_b[:, dofs[1]][:, :, dofs[1]])
    condition = np.linalg.cond(system)

    def error(engine):
        with jf.use_engine(engine):
            found = jf.couple(h_a, h_b, k, *dofs)
        return (abs(found - expected).max(axis=(1, 2)) / abs(expected).max(axis=(1, 2))).astype(float)

    reference = error("lapack")
    for engine in get_args(Engine)[2:]:
        try:
            found = error(engine)
        except ValueError:  # not on this processor
            continue
        assert (found <= 100 * EPS * condition).all(), engine
        assert found.max() <= 10 * max(reference.max(), EPS), engine
