"""Rigid-body motions of a model that is not held: where K is singular, rounding hides what little stiffness is left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

from jointfrf.kernel.arguments import FloatArray
from jointfrf.models.receptance.direct import SYMMETRIC

__all__ = ["RigidMotions", "find_rigid_motions", "held"]

#: A mode may be rigid where its w^2 is below this share of the lowest of the others.
_LOW = 1e-5
#: K r counts as zero within this many roundings of its terms.
_ROUNDINGS = 1e3
#: Inverse iterations, and their shift as a share of the lowest w^2 that is not rigid: the others fade as its powers.
_ITERATIONS, _SHIFT = 5, -1e-3


@dataclass(frozen=True)
class RigidMotions:
    """Motions r without strain, unit modal masses, and M r; both of shape (n, k).

    Both methods leave in forces and motions only what strains the structure.
    """

    shapes: FloatArray
    momenta: FloatArray

    def straining_forces(self, forces: FloatArray) -> FloatArray:
        """Return forces that do not accelerate the body as a whole, b - M r r^T b."""
        left: FloatArray = forces - self.momenta @ (self.shapes.T @ forces)
        return left

    def strains(self, motion: NDArray[Any]) -> NDArray[Any]:
        """Return motion without its rigid part, x - r r^T M x."""
        left: NDArray[Any] = motion - self.shapes @ (self.momenta.T @ motion)
        return left


def held(n: int) -> RigidMotions:
    """No rigid motions: a structure of n DOFs that is held."""
    return RigidMotions(np.zeros((n, 0)), np.zeros((n, 0)))


def find_rigid_motions(
    k: sparse.csc_array, m: sparse.csc_array, squared: FloatArray, shapes: FloatArray
) -> RigidMotions:
    """Find rigid motions from modes that may be.

    Parameters
    ----------
    k, m : sparse array, shape (n, n)
        Symmetric.
    squared : ndarray, shape (r,)
        w^2 of some modes, lowest first.
    shapes : ndarray, shape (n, r)
        Their shapes.

    Returns
    -------
    RigidMotions
        None, too, where the candidates have a stiffness beyond rounding.
    """
    n = k.shape[0]
    low = np.flatnonzero(squared[:-1] < _LOW * squared[1:]) + 1
    if low.size == 0 or low[-1] > 6:
        return held(n)
    motion = shapes[:, : low[-1]]
    try:
        factors = sparse_linalg.splu(sparse.csc_matrix(k - (_SHIFT * squared[low[-1]]) * m), **SYMMETRIC)
    except RuntimeError:  # singular: M has no mass in some motion
        return held(n)
    for _ in range(_ITERATIONS):
        motion = factors.solve(m @ motion)
        motion = motion / np.linalg.norm(motion, axis=0)
        try:
            root = linalg.cholesky(motion.T @ (m @ motion))
        except linalg.LinAlgError:
            return held(n)
        motion = linalg.solve_triangular(root, motion.T, trans="T").T
    left = abs(k @ motion)
    terms = abs(k) @ abs(motion)
    if not (left <= _ROUNDINGS * np.finfo(float).eps * terms.max(axis=0)).all():
        return held(n)
    return RigidMotions(motion, m @ motion)
