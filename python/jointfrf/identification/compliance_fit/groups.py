"""Groups of joint DOFs between which all FRFs are zero: each is a problem of its own."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jointfrf.frf.noise_estimate import ZERO, own_size
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["uncoupled_groups"]


def uncoupled_groups(h: ComplexArray, transform: FloatArray) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Joint DOFs, and the measured points they are made of, between which h is zero on all lines.

    Where a structure is symmetric, the FRFs between some DOFs vanish; their weight would be infinite, and the problem
    separates.

    Parameters
    ----------
    h : ndarray, shape (r, n_freq, m, m)
    transform : ndarray, shape (2 n, m)

    Returns
    -------
    list of (dofs, points)
        In the order of their first DOF; each in ascending order. Points that no DOF is made of are left out.
    """
    n, m = transform.shape[0] // 2, transform.shape[1]
    made_of = (transform[:n] != 0) | (transform[n:] != 0)
    coupled = np.zeros((n + m, n + m), bool)
    coupled[:n, n:] = made_of
    coupled[n:, n:] = (abs(h) ** 2 > ZERO**2 * own_size(h)).any(axis=(0, 1))
    _, label = sparse.csgraph.connected_components(sparse.csr_array(coupled), directed=False)
    groups = [
        (np.flatnonzero(label[:n] == own), np.flatnonzero(label[n:] == own))
        for own in dict.fromkeys(label[:n].tolist())
    ]
    if all(points.size for _, points in groups):
        return groups
    return [(np.arange(n), np.arange(m))]
