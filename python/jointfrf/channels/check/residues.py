"""Residues of the resonances that one column of FRFs shows: a smooth background is not in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.pair_ratios import exponents
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.messages.finding import Finding

__all__ = [
    "LEAST_MODES",
    "Resonances",
    "driving_point_findings",
    "fit_poles",
    "resonances",
    "signs_at",
    "strength_exponent",
]

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
#: Steps of the search for a pole, and change, in halves of the band of the peak, at which it is found: it is of third
#: order in the residual of the further powers.
_STEPS, _FOUND = 15, 1e-4
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
    return float(exponents(found.freq_hz, np.log(np.maximum(found.strength, TINY))))


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
    """Return frequency, loss factor and residues of one mode with a parabola; None if they do not fit."""
    half, middle = np.ptp(freq_hz) / 2, (freq_hz[0] + freq_hz[-1]) / 2
    varied = h - h.mean(axis=0)
    size = float(np.linalg.norm(varied))
    if len(freq_hz) < 2 * _LEAST_LINES - 2 or width > _WIDEST * peak or not size > 0:
        return None
    x = (freq_hz - middle) / half
    found = fit_poles(x, varied / size, np.array([(peak - middle + 0.5j * width) / half]))
    if found is None or found[2] > _LEFT:
        return None
    pole = middle + half * complex(found[0][0])
    # 1 / (p^2 - w^2) is 1 / (2 p (p - w)) and a smooth function
    residues = -2 * pole * (2 * np.pi) ** 2 * half * size * found[1][0]
    square = pole**2
    return float(np.sqrt(square.real)), square.imag / square.real, residues


def fit_poles(x: FloatArray, h: ComplexArray, poles: ComplexArray) -> tuple[ComplexArray, ComplexArray, float] | None:
    """Fit poles that all FRFs share, and a parabola for each FRF, by Gauss-Newton steps.

    Parameters
    ----------
    x : ndarray, shape (n_freq,)
        Frequency, -1 to 1.
    h : ndarray, shape (n_freq, n)
        FRFs.
    poles : ndarray, shape (n_poles,)
        Initial values.

    Returns
    -------
    tuple or None
        Poles z, residues of 1 / (x - z), shape (n_poles, n), and norm of the residual. None if the poles are not
        causal, or the first one is outside the band.
    """
    n = len(poles)
    residues: ComplexArray = np.zeros((n, h.shape[1]), np.complex128)
    parabola: FloatArray = np.linalg.qr(x[:, None] ** np.arange(3))[0]
    h = h - parabola @ (parabola.T @ h)
    for _ in range(_STEPS):
        near = 1 / (x[:, None] - poles)
        q, r = _orthonormal(near - parabola @ (parabola.T @ near))
        if not abs(np.diagonal(r)).min() > TINY:
            return None
        inside = q.conj().T @ h
        residues = np.asarray(np.linalg.solve(r, inside), np.complex128)
        # The slope of h by a pole is its residues times 1 / (x - z)^2, less what parabola and poles explain of that.
        slopes = near**2
        left = h - q @ inside
        descent = np.sum(slopes.conj() * (left @ residues.conj().T), axis=0)
        slopes -= parabola @ (parabola.T @ slopes)
        slopes -= q @ (q.conj().T @ slopes)
        normal = (slopes.conj().T @ slopes) * (residues.conj() @ residues.T)
        step = np.linalg.solve(normal + TINY * np.eye(n), descent)
        step *= min(1.0, 0.5 * float(np.min(poles.imag / np.maximum(abs(step), TINY))))
        poles = poles + step
        if abs(step).max() < _FOUND:
            break
    is_valid = (poles.imag > 0).all() and abs(poles[0].real) < 1
    return (poles, residues, float(np.linalg.norm(left))) if is_valid else None


def _orthonormal(columns: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return an orthonormal basis of columns and their triangle: `numpy.linalg.qr`, which is slow for one column."""
    if columns.shape[1] > 1:
        q, r = np.linalg.qr(columns)
        return q, r
    size = max(float(np.linalg.norm(columns)), TINY)
    return columns / size, np.full((1, 1), size + 0j)
