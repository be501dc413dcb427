"""What the phases of driving-point FRFs show: time convention, quantity, sign, power that leaves the structure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.finding import FrfFinding
from jointfrf.channels.check.measurement import Measurement, modulus
from jointfrf.channels.check.ratio_line import block_medians
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["Circles", "Sectors", "circles", "mean_exponent", "one_sidedness", "passivity_findings", "sectors"]

#: Im (or Re) of a driving-point FRF has one sign to this share, (sum of values) / (sum of their sizes).
_ONE_SIDED = 0.3
#: FRFs whose phase agrees better than this from line to line show circles.
_CIRCLES_SEEN = 0.5
#: Lines taken together.
_BLOCK = 30
#: Standard errors by which Im h / |h| of a block must exceed zero, and its least value.
_SIGNIFICANT, _LEAST = 8.0, 0.05


@dataclass(frozen=True)
class Circles:
    """The direction in which FRFs run through the complex plane.

    Attributes
    ----------
    value : float
        Median over FRFs of Im sum conj(h_k) h_k+1 / sum |h_k|^2: below zero for exp(+i w t); it is the time at which
        the impulse response has its energy, in radians of the longest time that the lines resolve.
    share : float
        Share of FRFs that run backwards.
    seen : int
        Number of FRFs that are smooth enough.
    """

    value: float
    share: float
    seen: int


@dataclass(frozen=True, eq=False)
class Sectors:
    """The half plane in which each driving-point FRF lies.

    Attributes
    ----------
    quarter : ndarray of int, shape (n,)
        0: Im < 0, a receptance; 1: Re > 0, a mobility; 2: Im > 0, an accelerance or a receptance of the wrong sign;
        3: Re < 0, a mobility of the wrong sign; -1: undecided.
    negative : ndarray, shape (n,)
        Share of the lines with Im < 0.
    """

    quarter: NDArray[np.intp]
    negative: FloatArray


def circles(omega: FloatArray, h: ComplexArray, smooth: FloatArray) -> Circles:
    """Find the direction of all FRFs, shape (n_freq, rows, columns), as the mean arrival time of their energy."""
    use = smooth > max(_CIRCLES_SEEN, 6 / np.sqrt(h.shape[0]))
    if not use.any():
        return Circles(0.0, 0.0, 0)
    # Flattened, so that a rigid-body line at the lowest frequencies does not outweigh the resonances.
    own = h[:, use]
    own = own * omega[:, None] ** -mean_exponent(omega, own)
    size = (own.real**2 + own.imag**2).sum(axis=0)
    turned = (own.real[:-1] * own.imag[1:] - own.imag[:-1] * own.real[1:]).sum(axis=0) / size
    return Circles(float(np.median(turned)), float((turned > 0).mean()), int(use.sum()))


def mean_exponent(omega: FloatArray, h: ComplexArray) -> float:
    """Median over FRFs, shape (n_freq, m), of the exponent of w in |h|, by least squares."""
    x = np.log(omega)
    x = x - x.mean()
    y = np.log(np.maximum(modulus(h), np.finfo(float).tiny))
    spread = (x**2).sum()
    return float(np.median(x @ y) / spread) if spread > 0 else 0.0


def sectors(driving: ComplexArray) -> Sectors:
    """Find the half plane of driving-point FRFs, shape (n_freq, n)."""
    u, real, imaginary = _balances(driving)
    quarter = np.where(
        _on_real_axis(u),
        np.where(imaginary < -_ONE_SIDED, 0, np.where(imaginary > _ONE_SIDED, 2, -1)),
        np.where(real > _ONE_SIDED, 1, np.where(real < -_ONE_SIDED, 3, -1)),
    )
    # Much damped: not near either axis, and on one side of the real one.
    damped = (abs((u**2).real.mean(axis=0)) < 0.2) & (abs(imaginary) > 0.9)
    quarter = np.where(damped, np.where(imaginary < 0, 0, 2), quarter)
    return Sectors(quarter.astype(np.intp), (driving.imag < 0).mean(axis=0))


def one_sidedness(driving: ComplexArray) -> FloatArray:
    """Measure how far each driving-point FRF, shape (n_freq, n), lies in one half plane: 1 on all lines, 0 on half."""
    u, real, imaginary = _balances(driving)
    share: FloatArray = np.where(_on_real_axis(u), abs(imaginary), abs(real))
    return share


def _balances(driving: ComplexArray) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Return h / |h|, and sums of its real and imaginary parts over the sums of their sizes."""
    size = modulus(driving)
    u: ComplexArray = np.where(size > 0, driving / np.where(size > 0, size, 1), 0)
    imaginary = u.imag.sum(axis=0) / np.maximum(abs(u.imag).sum(axis=0), np.finfo(float).tiny)
    real = u.real.sum(axis=0) / np.maximum(abs(u.real).sum(axis=0), np.finfo(float).tiny)
    return u, real, imaginary


def _on_real_axis(u: ComplexArray) -> NDArray[np.bool_]:
    """Between resonances a receptance is nearly real and a mobility nearly imaginary."""
    on: NDArray[np.bool_] = (u**2).real.mean(axis=0) > 0
    return on


def passivity_findings(
    measurement: Measurement, driving: ComplexArray, noise: FloatArray, inflation: float
) -> list[FrfFinding]:
    """Find driving points, shape (n_freq, n), whose Im is positive over a band.

    `noise` is the standard deviation of Im h / |h| on a line, shape (n,); NaN where it is not known.
    """
    length = min(_BLOCK, driving.shape[0])
    size = modulus(driving)
    part = np.where(size > 0, driving.imag / np.where(size > 0, size, 1), 0)
    real = np.where(size > 0, driving.real / np.where(size > 0, size, 1), 0)
    middle = block_medians(part, length)
    # Scatter within a block: of noise, or of the resonances that it holds.
    own = middle[np.minimum(np.arange(part.shape[0]) // length, middle.shape[0] - 1)]
    spread = 1.4826 * block_medians(abs(part - own), length)
    spread = np.fmax(spread, noise)
    error = 1.2533 * spread * np.sqrt(min(inflation, length) / length)
    active = middle > np.maximum(_LEAST, _SIGNIFICANT * error)
    freq = block_medians(measurement.freq_hz[:, None], length)[:, 0]
    findings = []
    for i in np.flatnonzero(active.any(axis=0)):
        where = np.flatnonzero(active[:, i])
        worst = int(where[np.argmax(middle[where, i])])
        side = block_medians(real[:, i : i + 1], length)[where, 0]
        cause = (
            "between resonances where the mass governs (Re < 0): a delay of this FRF or of all"
            if (side < -0.5).all()
            else "where the stiffness governs (Re > 0): this FRF, or all, are too early in time"
            if (side > 0.5).all()
            else "at resonances: negative damping, or the wrong sign of this FRF there"
        )
        findings.append(
            FrfFinding(
                "passivity", "warning", (measurement.dofs[i],), float(middle[worst, i]), _LEAST,
                f"power comes out of the structure at {measurement.dofs[i]} near {freq[worst]:.4g} Hz: Im h / |h| is "
                f"{middle[worst, i]:.2g} +- {error[worst, i]:.1g} in {where.size} of {middle.shape[0]} bands, {cause}",
                "look at the phase of sensor and hammer; leave these bands out",
            )
        )  # fmt: skip
    return findings
