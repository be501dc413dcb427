"""Residues of the resonances that one column of FRFs shows: a smooth background is not in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.messages.finding import Finding

__all__ = ["LEAST_MODES", "Resonances", "driving_point_findings", "resonances", "signs_at", "strength_exponent"]

#: A peak is the largest line among so many on either side, and rises by this factor above the median of more of them.
_NEAR, _AROUND, _RISE = 8, 60, 4.0
#: Half the lines of a fit, in half-power bandwidths of the peak and at least in lines.
_WIDTH, _LEAST_LINES = 3.0, 7
#: A resonance counts whose fit leaves less than this share of what varies over its lines.
_LEFT = 0.2
#: Widest loss factor of a resonance.
_WIDEST = 0.2
#: Damping of a peak at least, in distances of lines.
_NARROWEST = 0.25
#: A sign is clear of a residue that exceeds so many deviations of the imaginary parts that the phase of its mode
#: leaves, and this share of the root mean square of the mode.
_CLEAR, _LEAST = 3.0, 0.1
#: Modes whose common phase is closer to the real axis than this belong to receptances or accelerances, rad.
_REAL = np.pi / 4
#: Least number of modes from which signs, or the growth of residues with frequency, are judged; how far they spread.
LEAST_MODES, _SPAN = 3, 3.0
#: Peaks that are fitted at most, and sensors that a finding proposes.
_MOST, _PROPOSED = 30, 3


class Resonances(NamedTuple):
    """Resonances of the FRFs of one force.

    Attributes
    ----------
    freq_hz : ndarray, shape (n,)
    loss_factor : ndarray, shape (n,)
    residues : ndarray, shape (n, n_responses)
        A of h = A / (w_r^2 (1 + i eta) - w^2), m/N per s^2, as the fit of each FRF gives it.
    error : ndarray, shape (n,)
        Deviation of a residue of the mode from one phase.
    """

    freq_hz: FloatArray
    loss_factor: FloatArray
    residues: ComplexArray
    error: FloatArray

    @property
    def phase(self) -> FloatArray:
        """Phase that the residues of a mode have in common up to their signs, -pi/2 to pi/2, shape (n,)."""
        return np.asarray(np.angle((self.residues**2).sum(axis=1)) / 2)

    @property
    def real(self) -> FloatArray:
        """Residues without this phase, shape (n, n_responses)."""
        return np.asarray((self.residues * np.exp(-1j * self.phase[:, None])).real)

    @property
    def strength(self) -> FloatArray:
        """Root mean square of the residues of a mode over the responses, shape (n,)."""
        return np.asarray(np.sqrt((abs(self.residues) ** 2).mean(axis=1)))


def resonances(freq_hz: FloatArray, h: ComplexArray) -> Resonances:
    """Find resonances of receptances, shape (n_freq, n_responses), of one force, on rising lines.

    Notes
    -----
    Around each peak of the sum of squares, least squares fit one mode with a common pole and a parabola for each FRF.
    The parabola covers the other modes and any background that changes over more than the peak.
    """
    modes = list(_modes(freq_hz, h))
    n = h.shape[1]
    freq, eta, residues = (np.array([one[i] for one in modes]) for i in range(3))
    residues = residues.reshape(len(modes), n).astype(complex)
    found = Resonances(freq.astype(float), eta.astype(float), residues, np.zeros(len(modes)))
    error = np.sqrt(((residues * np.exp(-1j * found.phase[:, None])).imag ** 2).mean(axis=1))
    return found._replace(error=error)


def strength_exponent(found: Resonances) -> float | None:
    """Return the exponent of w in the residues, by least squares; None of too few modes.

    Notes
    -----
    The residues of a receptance, phi_o phi_i, have no trend over frequency. Residues of FRFs that are (i w)^p times a
    receptance go with w^p. A smooth background changes |h| between resonances, not the residues.
    """
    if found.freq_hz.size < LEAST_MODES or found.freq_hz.max() < _SPAN * found.freq_hz.min():
        return None
    x = np.log(found.freq_hz)
    x = x - x.mean()
    return float(x @ np.log(np.maximum(found.strength, TINY)) / (x @ x))


def signs_at(found: Resonances) -> NDArray[np.intp]:
    """Return the sign of each residue, 0 where it is not clear, shape (n, n_responses)."""
    least = np.maximum(_CLEAR * found.error, _LEAST * found.strength)
    clear = (abs(found.real) > least[:, None]) & (abs(found.phase) < _REAL)[:, None]
    return np.asarray(np.where(clear, np.sign(found.real), 0), np.intp)


def driving_point_findings(found: Resonances, place: int, names: Sequence[str]) -> Iterator[Finding]:
    """Name a driving point whose residues have both signs, and responses whose residues have one.

    Parameters
    ----------
    found : Resonances
    place : int
        The response at the force.
    names : sequence of str
        Names of all responses.

    Notes
    -----
    A residue at the driving point is phi_i^2, which has one sign in all modes. If sensors spread over the structure,
    the mean square of a shape hardly changes between modes. The residue at the driving point over the mean square of
    all residues is then nearly constant: the responses with the steadiest ratio come first.
    """
    signs = signs_at(found)
    used = signs.any(axis=1)
    own = signs[:, place]
    if not ((own > 0).any() and (own < 0).any()) or np.count_nonzero(used) < LEAST_MODES:
        return
    ratio = found.real[used] / np.maximum(found.strength[used, None] ** 2, TINY)
    scatter = ratio.std(axis=0) / np.maximum(abs(ratio.mean(axis=0)), TINY)
    is_one_sided = abs(signs[used].sum(axis=0)) == np.count_nonzero(used)
    others = [int(i) for i in np.argsort(scatter, kind="stable") if is_one_sided[i]][:_PROPOSED]
    numbers = {
        "positive": tuple(f"{freq:.4g}" for freq in found.freq_hz[own > 0]),
        "negative": tuple(f"{freq:.4g}" for freq in found.freq_hz[own < 0]),
        "modes": int(np.count_nonzero(used)),
        "others": tuple(names[i] for i in others),
    }
    yield Finding("driving-point-residues", numbers, (names[place],), variant="proposed" if others else "")


def _modes(freq_hz: FloatArray, h: ComplexArray) -> Iterator[tuple[float, float, ComplexArray]]:
    size = (abs(h) ** 2).sum(axis=1) * freq_hz**4  # of accelerances: about as large at all resonances
    peaks = _peaks(size)
    for peak in sorted(sorted(peaks, key=lambda i: -size[i])[:_MOST]):
        half = _half_width(size, peak)
        step = float(np.median(np.diff(freq_hz)))
        reach = max(int(_WIDTH * half), _LEAST_LINES)
        own = slice(max(peak - reach, 0), peak + reach + 1)
        found = _fitted(freq_hz[own], h[own], float(freq_hz[peak]), max(2 * half * step, _NARROWEST * step))
        if found is not None:
            yield found


def _peaks(size: FloatArray) -> list[int]:
    """Return lines that are the largest among their neighbours, and far above the median of more of these."""
    found = []
    for i in range(1, size.size - 1):
        near = size[max(i - _NEAR, 0) : i + _NEAR + 1]
        if size[i] < near.max() or size[i] <= 0:
            continue
        if size[i] > _RISE**2 * np.median(size[max(i - _AROUND, 0) : i + _AROUND + 1]):
            found.append(i)
    return found


def _half_width(size: FloatArray, peak: int) -> float:
    """Return half the half-power bandwidth in lines."""
    below = size < size[peak] / 2
    left = np.flatnonzero(below[:peak])
    right = np.flatnonzero(below[peak:])
    sides = [peak - left[-1]] if left.size else []
    return float(min([*sides, *([right[0]] if right.size else [])], default=size.size))


def _fitted(
    freq_hz: FloatArray, h: ComplexArray, peak: float, width: float
) -> tuple[float, float, ComplexArray] | None:
    """Return frequency, loss factor and residues of one mode with a parabola beside it; None where that fits badly."""
    omega = 2 * np.pi * freq_hz
    x = (freq_hz - peak) / max(np.ptp(freq_hz), TINY)
    rest = np.stack([np.ones_like(x), x, x**2], axis=1)
    if len(x) < 2 * _LEAST_LINES - 2 or width > _WIDEST * peak:
        return None

    def parts(p: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        pole = (2 * np.pi * (peak + p[0] * width)) ** 2 * (1 + 1j * np.exp(p[1]))
        basis = np.column_stack([1 / (pole - omega**2), rest])
        scale = np.linalg.norm(basis, axis=0)
        weights = np.linalg.lstsq(basis / scale, h, rcond=None)[0] / scale[:, None]
        return h - basis @ weights, weights[0]

    def residual(p: FloatArray) -> FloatArray:
        left = (parts(p)[0] / size).ravel()
        return np.concatenate([left.real, left.imag])

    size = float(np.linalg.norm(h - h.mean(axis=0)))
    if not size > 0:
        return None
    start = np.array([0.0, np.log(width / peak)])
    from scipy import optimize  # only here: it takes long to import

    found = optimize.least_squares(residual, start, bounds=([-2, start[1] - 4], [2, start[1] + 2]), max_nfev=40)
    left, weights = parts(found.x)
    if np.linalg.norm(left) > _LEFT * size:
        return None
    return peak + float(found.x[0]) * width, float(np.exp(found.x[1])), weights
