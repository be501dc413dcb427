"""Complex numbers that were put together wrongly: phases in radians or without sign, magnitudes in decibels.

They come before all other checks, which see consequences of them in every channel.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.signals import Measurement, modulus
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.messages.finding import Finding

__all__ = ["representation_finding"]

#: A resonance rises by this factor above the lowest lines on both sides; its phase turns by about half a circle.
_RISE = 3.0
#: Lines over which the turn of an FRF in the complex plane is added up, and standard errors from which it has a sign.
_BLOCK, _SIGNIFICANT = 8, 5.0
#: Share of the turn of all FRFs that goes either way if the sign of phases is lost: of measured FRFs less than 0.003.
_EITHER_WAY = 0.02
#: Receptances below this, m/N, are none in decibels: -20 dB is the largest magnitude that is found.
_LEAST_DECIBEL = 20.0
#: Magnitudes in decibels change over frequency by less than this factor, while the phase turns by half circles.
_FLAT = 4.0
#: Quantiles of the magnitudes over the lines: antiresonances are left out.
_MOST = (0.05, 0.95)
#: Half turns of the phase that a flat magnitude must have.
_HALF_TURNS = 2


def representation_finding(m: Measurement, read_as: str | None) -> Finding | None:
    """Return what is wrong with magnitudes or phases of all FRFs; None if nothing is, or there are too few to tell.

    `read_as` is the quantity that the FRFs were read as before they became receptances.
    """
    used = np.flatnonzero(~m.hidden.ravel())
    receptance = m.h.reshape(len(m.h), -1)[:, used]
    power = POWER_OF_I_OMEGA.get(read_as or "receptance", 0)
    h: ComplexArray = np.asarray(receptance * ((1j * m.omega) ** power)[:, None])
    size = modulus(h)
    kept = (size > 0).all(axis=0)
    if not kept.any():
        return None
    h, size = h[:, kept], size[:, kept]
    return _phase_unit(h, size) or _decibel(h, size) or _unsigned(h, len(m.responses) * len(m.forces) > 1)


def _phase_unit(h: ComplexArray, size: FloatArray) -> Finding | None:
    """Find phases in radians that were read as degrees: within +-pi degrees, across resonances."""
    largest = float(np.degrees(abs(np.angle(h)).max()))
    if largest <= np.pi * (1 + 1e-6) and _has_peak(size).any():
        return Finding("phase-unit", {"largest": largest})
    return None


def _has_peak(size: FloatArray) -> NDArray[np.bool_]:
    """Return which FRFs, shape (n_freq, n), rise and fall again, as at a resonance."""
    before = np.minimum.accumulate(size, axis=0)
    after = np.minimum.accumulate(size[::-1], axis=0)[::-1]
    return np.asarray((size > _RISE * np.maximum(before, after)).any(axis=0))


def _decibel(h: ComplexArray, size: FloatArray) -> Finding | None:
    """Find magnitudes in decibels that were read as linear: large and flat, while the phase turns."""
    low, high = np.quantile(size, _MOST, axis=0)
    if not ((np.median(size, axis=0) > _LEAST_DECIBEL) & (high < _FLAT * low)).all():
        return None
    turns = np.ptp(np.unwrap(np.angle(h), axis=0), axis=0) / np.pi
    if turns.max() < _HALF_TURNS:
        return None
    return Finding("decibel", {"low": float(low.min()), "high": float(high.max())})


def _unsigned(h: ComplexArray, has_transfer: bool) -> Finding | None:
    """Find phases without their sign: no line of any FRF has the other sign, yet FRFs turn both ways."""
    if not has_transfer or ((h.imag < 0).any() and (h.imag > 0).any()):
        return None
    turn = (h[:-1].conj() * h[1:]).imag
    count = max(len(turn) // _BLOCK, 1)
    whole = turn[: count * _BLOCK].reshape(count, -1, h.shape[1])
    total = whole.sum(axis=1)
    # standard error by successive differences, which a smooth turn hardly enters
    error = np.sqrt((np.diff(whole, axis=1) ** 2).sum(axis=1) / 2)
    total = np.where(abs(total) > _SIGNIFICANT * error, total, 0.0)
    total = total / np.maximum(abs(total).sum(axis=0), np.finfo(float).tiny)
    forward, back = float(np.maximum(total, 0).sum()), float(np.maximum(-total, 0).sum())
    if min(forward, back) <= _EITHER_WAY * (forward + back):
        return None
    return Finding("unsigned-phase", {"share": min(forward, back) / (forward + back)})
