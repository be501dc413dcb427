"""The Cramer-Rao bound of a joint without cross terms between unknown structures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert

__all__ = ["information_rows", "least_std_errors"]


def least_std_errors(freq_hz: FloatArray, gamma: ComplexArray, variance: FloatArray) -> FloatArray:
    """Return least standard deviations of unbiased estimates of stiffness and viscous damping.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    gamma : ndarray, shape (n_freq, 2 n, 2 n)
        Exact receptance of the assembly at joint DOFs j, then k, m/N; symmetric.
    variance : ndarray, shape (n_freq, 2 n, 2 n)
        Noise variance E|e|^2 of each entry, (m/N)^2: independent, circular and normal, above 0.

    Returns
    -------
    ndarray, shape (2 n,)
        Least standard deviations of the stiffness of all DOFs, then of the damping, in SI units.

    Notes
    -----
    The unknowns of each line are the symmetric dynamic stiffnesses Z_A and Z_B of the sides. From
    gamma^-1 = [[Z_A + K*, -K*], [-K*, Z_B + K*]] all derivatives are -gamma dZ gamma. gamma is analytic in the unknowns
    of a line. They therefore remove a complex subspace from the information of the line on the parameters.
    """
    rows = information_rows(freq_hz, gamma, variance)
    information = 2 * np.einsum("lfp,lfq->pq", rows.conj(), rows, optimize=True).real
    # Stiffness and damping differ by many orders of magnitude.
    size = 1 / np.sqrt(np.diagonal(information))
    scaled = information * np.outer(size, size)
    errors: FloatArray = size * np.sqrt(np.diagonal(invert(scaled[None])[0].real))
    return errors


def information_rows(
    freq_hz: FloatArray, gamma: ComplexArray, variance: FloatArray, kinds: Sequence[str] = ("k", "c")
) -> ComplexArray:
    """Return the information of each FRF of each line on the parameters, shape (n_freq, 4 n^2, n_parameters).

    Twice the real part of the products of these rows, summed over FRFs and lines, is the information. The parameters
    are stiffness k, viscous c and hysteretic h of all DOFs, one kind after another. The sides are eliminated by least
    squares, so the products of one row are also the derivative of the information by the weight of its FRF.
    """
    n = gamma.shape[1] // 2
    weight = 1 / np.sqrt(variance)
    joint, sides = _units(n)
    slopes = _weighted(gamma, joint, weight)
    free = np.linalg.qr(_weighted(gamma, sides, weight))[0]
    left = slopes - free @ (free.conj().swapaxes(1, 2) @ slopes)
    omega = 2 * np.pi * freq_hz[:, None, None]
    factors = {"k": np.ones_like(omega) + 0j, "c": 1j * omega, "h": np.full_like(omega, 1j, dtype=complex)}
    rows: ComplexArray = np.concatenate([left * factors[kind] for kind in kinds], axis=2)
    return rows


def _units(n: int) -> tuple[FloatArray, FloatArray]:
    """Return derivatives of the dynamic stiffness by K* of each DOF, and by entries of Z_A and Z_B."""
    joint = np.zeros((n, 2 * n, 2 * n))
    for d in range(n):
        joint[d][np.ix_([d, n + d], [d, n + d])] = [[1, -1], [-1, 1]]
    sides = []
    for start in (0, n):
        for a, b in zip(*np.triu_indices(n), strict=True):
            unit = np.zeros((2 * n, 2 * n))
            unit[start + a, start + b] = unit[start + b, start + a] = 1
            sides.append(unit)
    return joint, np.array(sides)


def _weighted(gamma: ComplexArray, units: FloatArray, weight: FloatArray) -> ComplexArray:
    """Return derivatives of gamma over the standard deviation of its entries, shape (n_freq, 4 n^2, n_units)."""
    moved = gamma[:, None] @ units @ gamma[:, None] * weight[:, None]
    found = moved.reshape(*moved.shape[:2], -1).swapaxes(1, 2)
    scaled: ComplexArray = found
    return scaled
