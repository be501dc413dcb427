"""Impacts and sensors off axis: FRFs of a channel with a share of another joint DOF, estimated from reciprocity.

If impact q acts along its axis and with a share a_qd along joint DOF d of its side, its column is measured as
h_pq + a_qd g_pd, with g_pd from a load at the DOF to response p; a sensor off axis does the same to its row. Then

    h'_pq - h'_qp  =  sum over d of (a_qd - b_qd) g_pd - (a_pd - b_pd) g_qd + noise

is linear in the differences a - b of the shares of impact and sensor at one place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.frf.entry_groups import entry_groups
from jointfrf.frf.moving_mass import (
    calibration_columns,
    huber_fit,
    mass_pattern,
    real_equations,
    steps_without_a_line,
)
from jointfrf.frf.noise_parts import ReciprocityDifferences, line_correlation, reciprocity_differences
from jointfrf.frf.quantiles import medians
from jointfrf.frf.smoothing import near_squares
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray

__all__ = ["CrossAxis", "found_cross_axis"]

#: Probability below which shares of other DOFs explain differences better than noise does.
_CHANCE = 1e-6
#: Lines for each unknown at least, largest size of the least-squares problem, and number of updates of its weights.
_LINES_EACH, _MOST_NUMBERS, _TURNS = 4, 1_000_000, 3


@dataclass(frozen=True, eq=False)
class CrossAxis:
    """Shares of other joint DOFs in channels, impact minus sensor.

    Attributes
    ----------
    channels, dofs : ndarray of int, shape (k,)
        Channel and joint DOF, of sides j, then k, of each share.
    share, std_error : ndarray, shape (k,)
        Difference a - b, relative to a unit load at the DOF, and its standard error.
    variance : ndarray, shape (k,)
        Variance of a - b: one of translations and one of rotations, if FRFs are in units of their root mean squares.
    alike : tuple of ndarray of int
        Numbers of the shares whose variance was estimated together.
    size : ndarray, shape (k,)
        Root mean square of the FRFs that the share adds, relative to the FRFs of the channel.
    transform : ndarray, shape (2 n, m)
        Matrix from channels to joint DOFs.
    """

    channels: NDArray[np.intp]
    dofs: NDArray[np.intp]
    share: FloatArray
    std_error: FloatArray
    variance: FloatArray
    alike: tuple[NDArray[np.intp], ...]
    size: FloatArray
    transform: FloatArray

    def removed(self, h: ComplexArray, smooth: ComplexArray) -> ComplexArray:
        """Return FRFs without these differences, half of each in the row and half in the column of a channel."""
        of_dofs, change = smooth @ self.transform.T, np.zeros_like(h)
        for q, d, share in zip(self.channels, self.dofs, self.share, strict=True):
            change[:, :, q] += share / 2 * of_dofs[:, :, d]
        return np.asarray(h - change + change.swapaxes(1, 2))


def found_cross_axis(
    freq_hz: FloatArray,
    h: ComplexArray,
    smooth: ComplexArray,
    transform: FloatArray,
    rotations: NDArray[np.bool_],
    *,
    is_translation: bool = False,
) -> CrossAxis | None:
    """Return shares of other joint DOFs in the channels, by h_pq - h_qp; None if these show none.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    h, smooth : ndarray, shape (n_freq, m, m)
        Measured and smooth receptances, m/N, responses and forces at the same points. Smooth ones avoid that noise of
        the FRFs that a share adds, which the differences contain as well, looks like a share.
    transform : ndarray, shape (2 n, m)
        Matrix from channels to joint DOFs j, then k.
    rotations : ndarray of bool, shape (n,)
        Joint DOFs that are rotations.
    is_translation : bool
        Whether all channels are translations: a mass that moves may then explain differences, too.

    Notes
    -----
    Weighted least squares with gains, delays and a moving mass as further unknowns. The covariance is robust: lines
    are clusters, as many as the correlation between lines leaves, because pairs of a line share the noise of a force.
    """
    n, modes = len(transform) // 2, np.asarray(np.linalg.pinv(transform), np.float64)
    if n < 2:
        return None
    whole = reciprocity_differences(h[:1], entry_groups(h, reciprocal=True))
    if whole is None:
        return None
    unknowns = h.shape[1] * (n + 1)
    least, most = _LINES_EACH * unknowns, _MOST_NUMBERS // (2 * whole.rows.size * unknowns)
    if min(most, freq_hz.size) < least:
        return None
    lines = np.argsort(freq_hz)[:: -(-freq_hz.size // most)]
    freq, h, smooth = freq_hz[lines], h[lines], smooth[lines]
    values = np.ascontiguousarray((h[:, whole.rows, whole.columns] - h[:, whole.columns, whole.rows]).T)
    differences = ReciprocityDifferences(whole.rows, whole.columns, values)
    size_of_channel = np.sqrt(np.square(abs(h)).mean(axis=(0, 1)))
    of_dofs = smooth @ transform.T
    size_of_dof = np.sqrt(np.square(abs(of_dofs)).mean(axis=(0, 1)))
    channels, dofs = _shares(modes, size_of_dof, n)
    nuisance = list(np.moveaxis(calibration_columns(freq, h, differences), -1, 0))
    if is_translation:
        nuisance.append(mass_pattern(freq, h, differences))
    p, q = differences.rows, differences.columns
    own = [
        (q == i)[:, None] * of_dofs[:, p, d].T - (p == i)[:, None] * of_dofs[:, q, d].T
        for i, d in zip(channels, dofs, strict=True)
    ]
    found = _estimated(freq, h, differences, np.stack([*own, *nuisance], axis=-1), len(own))
    if found is None:
        return None
    share, error = found
    size = size_of_dof[dofs] / np.maximum(size_of_channel[channels], TINY)
    variance, alike = np.zeros(len(own)), list[NDArray[np.intp]]()
    for kind in (False, True):
        same = np.flatnonzero(rotations[dofs % n] == kind)
        excess = np.square(share[same] * size[same]).sum() - np.square(error[same] * size[same]).sum()
        if excess > 0:
            variance[same] = float(excess) / same.size / np.square(size[same])
            alike.append(same)
    if not alike:
        return None
    return CrossAxis(channels, dofs, share, error, variance, tuple(alike), size, transform)


def _shares(modes: FloatArray, size: FloatArray, n: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return channels and DOFs of their side that they may contain, except the one that each mostly measures."""
    moved = abs(modes) * size
    main = moved.argmax(axis=1)
    pairs = [(i, d) for i, own in enumerate(main) for d in range(own // n * n, own // n * n + n) if d != own]
    channels, dofs = np.array(pairs, np.intp).T
    return channels, dofs


def _estimated(
    freq: FloatArray, h: ComplexArray, differences: ReciprocityDifferences, design: ComplexArray, k: int
) -> tuple[FloatArray, FloatArray] | None:
    """Return the first k unknowns and their standard errors, if they are more than chance."""
    near, values, found = near_squares(h), differences.values, np.zeros(design.shape[-1])
    equations, usual = real_equations(design, values), medians(near.T).T
    for _ in range(_TURNS):
        left = replace(differences, values=values - design @ found)
        fit = huber_fit(*equations, 1 / np.sqrt(left.pair_variance(left.variance_of_parts(near, usual, freq))))
        found = fit.solution / fit.size
    solution, size, _, inverse, residual = fit
    inflation = line_correlation(residual.view(np.complex128).reshape(values.shape))
    # Decrease of the squares by the first k unknowns, if pairs of a line were independent.
    fallen = float(solution[:k] @ np.linalg.pinv(inverse[:k, :k], hermitian=True) @ solution[:k])
    mean = float(np.square(residual).mean())
    if not mean > 0 or not special.chdtrc(k, fallen / (mean * inflation)) < _CHANCE:
        return None
    steps = steps_without_a_line(fit, len(h))[:, :k]
    covariance, degrees = inflation * steps.T @ steps, len(h) / inflation - len(size)
    known = np.diagonal(covariance) > 0
    if degrees < 1 or not known.any():
        return None
    distance = solution[:k] @ np.linalg.pinv(covariance, hermitian=True) @ solution[:k]
    # Hotelling's T^2, as the covariance is estimated from as many lines.
    ratio = distance / known.sum() * degrees / (degrees + known.sum())
    if not special.fdtrc(known.sum(), degrees, ratio) < _CHANCE:
        return None
    return solution[:k] / size[:k], np.sqrt(np.diagonal(covariance)) / size[:k]
