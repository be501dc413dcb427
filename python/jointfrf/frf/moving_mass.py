"""Mass of a sensor or an impedance head that moves from point to point: estimated from reciprocity, and removed.

If the sensor of mass m is at point p, the measured receptance is h'_pq = h_pq / (1 - w^2 m h_pp), with h of the
structure alone, so that h_pq = h'_pq / (1 + w^2 m h'_pp) (mass cancellation [1]_). From h_pq = h_qp,

    h'_pq - h'_qp  =  m w^2 (h'_qp h'_pp - h'_pq h'_qq) + noise

is linear in m. A mass that moves with the force, in an impedance head, does the same to the transpose of h.

.. [1] D. J. Ewins, Modal Testing, 2nd ed., Research Studies Press (2000), section 3.9.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from jointfrf.frf.bands import spread_lines
from jointfrf.frf.entry_groups import entry_groups
from jointfrf.frf.noise_parts import ReciprocityDifferences, reciprocity_differences
from jointfrf.frf.quantiles import medians
from jointfrf.frf.smoothing import near_squares
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray

__all__ = [
    "MovingMass",
    "calibration_columns",
    "found_mass",
    "given_mass",
    "huber_fit",
    "mass_pattern",
    "real_equations",
    "steps_without_a_line",
]

#: Least mass in standard errors: other errors of the FRFs resemble a small mass. A first estimate without gains of
#: channels needs fewer.
_SIGNIFICANT, _LOOK = 8.0, 3.0
#: The lightest accelerometers weigh 0.2 g: less is no sensor, kg.
_LIGHTEST = 1e-4
#: Number of updates of the weights, which follow from the differences without the mass, and least number of lines.
_TURNS, _LEAST_LINES = 3, 50
#: Number of standard deviations at which a residual is clipped.
_CUT = 3.0


@dataclass(frozen=True)
class MovingMass:
    """A mass that moves with each response, or with each force if it is negative.

    Attributes
    ----------
    mass : float
        Mass, kg.
    std_error : float
        Standard error, kg; 0 if the mass was given.
    shown : float, optional
        Mass that the FRFs show, kg, if they contradict a mass that was given.
    """

    mass: float
    std_error: float = 0.0
    shown: float | None = None

    @property
    def with_force(self) -> bool:
        """Whether it moves with the force."""
        return self.mass < 0

    def factor(self, freq_hz: FloatArray, h: ComplexArray) -> ComplexArray:
        """Return 1 + w^2 m h_pp of each point, shape (n_freq, m), from measured receptances."""
        return np.asarray(1 + (2 * np.pi * freq_hz[:, None]) ** 2 * abs(self.mass) * np.einsum("lpp->lp", h))

    def removed(self, freq_hz: FloatArray, h: ComplexArray) -> ComplexArray:
        """Return the receptances of the structure alone, shape (n_freq, m, m), m/N."""
        factor = self.factor(freq_hz, h)
        return np.asarray(h / (factor[:, None, :] if self.with_force else factor[:, :, None]))

    def errors(self, freq_hz: FloatArray, h: ComplexArray) -> ComplexArray:
        """Return the relative error of each row, or column, by an error of 1 kg, of FRFs without it, (n_freq, m)."""
        return np.asarray(-((2 * np.pi * freq_hz[:, None]) ** 2) * np.einsum("lpp->lp", h))


def given_mass(freq_hz: FloatArray, h: ComplexArray, mass: float) -> MovingMass:
    """Return a mass that was given; FRFs contradict it if a mass shows after its removal. Shapes as `found_mass`."""
    given = MovingMass(mass)
    if found_mass(freq_hz, given.removed(freq_hz, h)) is None:
        return given
    own = found_mass(freq_hz, h)
    return replace(given, shown=0.0 if own is None else own.mass)


def found_mass(freq_hz: FloatArray, h: ComplexArray) -> MovingMass | None:
    """Return the mass that moves from point to point, from h_pq - h_qp; None if these show none.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    h : ndarray, shape (n_freq, m, m)
        Receptances, m/N, responses and forces at the same points, as translations.

    Notes
    -----
    Weighted least squares, with gains and delays of the channels as further unknowns, and weights by the noise of the
    differences without the mass. The standard error is robust: by the scatter of the lines.
    """
    lines = np.argsort(freq_hz)[spread_lines(freq_hz.size)]
    freq, h = freq_hz[lines], h[lines]
    differences = reciprocity_differences(h, entry_groups(h, reciprocal=True))
    if freq.size < _LEAST_LINES or differences is None:
        return None
    pattern = mass_pattern(freq, h, differences)
    p, q = differences.rows, differences.columns
    weight = 1 / np.maximum(np.square(abs(h[:, p, q])) + np.square(abs(h[:, q, p])), TINY).T
    along = ((pattern.conj() * differences.values).real * weight).sum(axis=0)
    if abs(along.sum()) < _LOOK * np.sqrt(np.square(along).sum()):
        return None
    if along.sum() > 0:
        return _fitted(freq, h, differences, pattern)
    turned = replace(differences, values=-differences.values)
    found = _fitted(freq, h.swapaxes(1, 2), turned, mass_pattern(freq, h.swapaxes(1, 2), turned))
    return None if found is None else MovingMass(-found.mass, found.std_error)


def mass_pattern(freq: FloatArray, h: ComplexArray, differences: ReciprocityDifferences) -> ComplexArray:
    """Return the differences by a mass of 1 kg, shape (n_pairs, n_freq)."""
    p, q = differences.rows, differences.columns
    driving = np.einsum("lpp->pl", h) * (2 * np.pi * freq) ** 2
    return np.asarray(h[:, q, p].T * driving[p] - h[:, p, q].T * driving[q])


def _fitted(
    freq: FloatArray, h: ComplexArray, differences: ReciprocityDifferences, pattern: ComplexArray
) -> MovingMass | None:
    """Return the mass by least squares, if it is significant."""
    near, values, mass = near_squares(h), differences.values, 0.0
    design: ComplexArray = np.concatenate([pattern[..., None], calibration_columns(freq, h, differences)], axis=-1)
    equations, usual = real_equations(design, values), medians(near.T).T
    for _ in range(_TURNS):
        left = replace(differences, values=values - mass * pattern)
        fit = huber_fit(*equations, 1 / np.sqrt(left.pair_variance(left.variance_of_parts(near, usual, freq))))
        mass = float(fit.solution[0] / fit.size[0])
    steps = steps_without_a_line(fit, freq.size)
    error = float(np.sqrt(np.square(steps[:, 0]).sum()) / fit.size[0])
    return MovingMass(mass, error) if mass > max(_SIGNIFICANT * error, _LIGHTEST) and error > 0 else None


def calibration_columns(freq: FloatArray, h: ComplexArray, differences: ReciprocityDifferences) -> ComplexArray:
    """Return differences by gains and delays, (n_pairs, n_freq, k); the first channel is the reference."""
    p, q = differences.rows, differences.columns
    mean, columns = (h[:, p, q] + h[:, q, p]).T / 2, list[ComplexArray]()
    for i in range(1, h.shape[1]):
        own = ((p == i).astype(float) - (q == i))[:, None] * mean
        columns += [own, 1j * own * freq / freq[-1]]
    return np.stack(columns, axis=-1)


def real_equations(design: ComplexArray, values: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return real and imaginary parts of complex equations, shapes (n_pairs * n_freq, 2, k) and (..., 2)."""
    k = design.shape[-1]
    parts = np.ascontiguousarray(design).view(np.float64).reshape(-1, k, 2).swapaxes(1, 2)
    return np.ascontiguousarray(parts), np.ascontiguousarray(values).view(np.float64).reshape(-1, 2)


class HuberFit(NamedTuple):
    """Huber's estimate of weighted real equations, and the terms of its covariance.

    Attributes
    ----------
    solution : ndarray, shape (k,)
        Solution in units of 1 / size.
    size : ndarray, shape (k,)
        Norms of the weighted columns.
    columns : ndarray, shape (n, 2, k)
        Weighted columns of norm 1.
    inverse : ndarray, shape (k, k)
        Inverse of their normal equations.
    residual : ndarray, shape (n, 2)
        Weighted residual, clipped at `_CUT` standard deviations.
    """

    solution: FloatArray
    size: FloatArray
    columns: FloatArray
    inverse: FloatArray
    residual: FloatArray


def huber_fit(design: FloatArray, values: FloatArray, weight: FloatArray) -> HuberFit:
    """Return Huber's estimate by pseudo-values, of equations as `real_equations` gives them, with a weight for each."""
    each = weight.reshape(-1)
    size = np.sqrt(np.maximum(np.square(each) @ np.square(design).sum(axis=1), TINY))
    columns = design * (each[:, None] / size)[:, None]
    flat, right = columns.reshape(-1, size.size), (values * each[:, None]).reshape(-1)
    inverse, cut = np.linalg.pinv(flat.T @ flat, hermitian=True), right
    for _ in range(_TURNS):
        solution = inverse @ (cut @ flat)
        fitted = flat @ solution
        apart = right - fitted
        length = abs(apart.view(np.complex128))
        reach = _CUT * max(float(medians(length)), TINY)
        cut = fitted + (apart.reshape(-1, 2) * np.minimum(1, reach / np.maximum(length, TINY))[:, None]).reshape(-1)
    return HuberFit(solution, size, columns, inverse, (cut - flat @ solution).reshape(-1, 2))


def steps_without_a_line(fit: HuberFit, n_freq: int) -> FloatArray:
    """Return the jackknife steps of the unknowns, (n_freq, k): lines are clusters, as their pairs share their noise."""
    inverse = fit.inverse
    by_line = fit.columns.reshape(-1, n_freq, 2, inverse.shape[0])
    gradient = np.einsum("plrk,plr->lk", by_line, fit.residual.reshape(-1, n_freq, 2))
    taken = np.einsum("plrk,plrm->lkm", by_line, by_line) @ inverse
    left_out = (np.linalg.pinv(np.eye(len(inverse)) - taken) @ gradient[..., None])[..., 0]
    return np.asarray(left_out @ inverse)
