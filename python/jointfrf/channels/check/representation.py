"""Complex numbers that were put together wrongly: phases in radians or without sign, magnitudes in decibels.

They come before all other checks, which see consequences of them in every channel.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.signals import modulus
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
#: A driving point alone has phases of one sign.
_LEAST_FRFS = 2


def representation_finding(
    freq_hz: FloatArray, h: ComplexArray, missing: NDArray[np.bool_], read_as: str | None
) -> Finding | None:
    """Return what is wrong with magnitudes or phases of all FRFs; None if nothing is.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Positive, Hz.
    h : ndarray, shape (n_freq, n_responses, n_forces)
        Receptances, m/N; finite but for those that are missing.
    missing : ndarray of bool, shape (n_responses, n_forces)
        FRFs that are not used.
    read_as : str, optional
        Quantity that the FRFs were read as before they became receptances.

    Notes
    -----
    The FRFs of one force are looked at together: all of them at once would take the memory of the FRFs many times.
    """
    factor = ((2j * np.pi * freq_hz) ** POWER_OF_I_OMEGA.get(read_as or "receptance", 0))[:, None]
    found = [
        _Summary.of(own[:, (own != 0).all(axis=0)])
        for force in range(h.shape[2])
        if (own := np.asarray(h[:, ~missing[:, force], force] * factor)).size
    ]
    found = [one for one in found if one.n_frfs]
    return _phase_unit(found) or _decibel(found) or _unsigned(found)


class _Summary(NamedTuple):
    """Statistics of some FRFs.

    Attributes
    ----------
    n_frfs : int
        FRFs.
    largest_degrees : float
        Largest modulus of a phase.
    has_peak, is_flat, has_positive, has_negative : bool
        Whether an FRF rises and falls as at a resonance; whether all magnitudes are large and change little; whether a
        line has a positive, or a negative, imaginary part.
    low, high, half_turns : float
        Lowest and highest quantile of the magnitudes; half turns of the phase.
    forward, back : float
        Turn of the FRFs in the complex plane either way, in units of the whole turn of each FRF.
    """

    n_frfs: int
    largest_degrees: float = 0.0
    has_peak: bool = False
    is_flat: bool = False
    has_positive: bool = False
    has_negative: bool = False
    low: float = 0.0
    high: float = 0.0
    half_turns: float = 0.0
    forward: float = 0.0
    back: float = 0.0

    @classmethod
    def of(cls, h: ComplexArray) -> _Summary:
        """Summarise FRFs, shape (n_freq, n)."""
        if not h.size:
            return cls(0)
        size, angle = modulus(h), np.angle(h)
        low, high = np.quantile(size, _MOST, axis=0)
        forward, back = _turns(h)
        return cls(
            h.shape[1],
            float(np.degrees(abs(angle).max())),
            bool(_has_peak(size).any()),
            bool(((np.median(size, axis=0) > _LEAST_DECIBEL) & (high < _FLAT * low)).all()),
            bool((h.imag > 0).any()),
            bool((h.imag < 0).any()),
            float(low.min()),
            float(high.max()),
            float((np.ptp(np.unwrap(angle, axis=0), axis=0) / np.pi).max()),
            forward,
            back,
        )


def _turns(h: ComplexArray) -> tuple[float, float]:
    """Return how much FRFs turn forward and back in the complex plane, by blocks of lines whose turn is significant."""
    turn = (h[:-1].conj() * h[1:]).imag
    count = max(len(turn) // _BLOCK, 1)
    whole = turn[: count * _BLOCK].reshape(count, -1, h.shape[1])
    total = whole.sum(axis=1)
    # standard error by successive differences, which a smooth turn hardly enters
    error = np.sqrt((np.diff(whole, axis=1) ** 2).sum(axis=1) / 2)
    total = np.where(abs(total) > _SIGNIFICANT * error, total, 0.0)
    total = total / np.maximum(abs(total).sum(axis=0), np.finfo(float).tiny)
    return float(np.maximum(total, 0).sum()), float(np.maximum(-total, 0).sum())


def _has_peak(size: FloatArray) -> NDArray[np.bool_]:
    """Return which FRFs, shape (n_freq, n), rise and fall again, as at a resonance."""
    before = np.minimum.accumulate(size, axis=0)
    after = np.minimum.accumulate(size[::-1], axis=0)[::-1]
    return np.asarray((size > _RISE * np.maximum(before, after)).any(axis=0))


def _phase_unit(found: Sequence[_Summary]) -> Finding | None:
    """Find phases in radians that were read as degrees: within +-pi degrees, across resonances."""
    largest = max((one.largest_degrees for one in found), default=np.inf)
    is_wrong = largest <= np.pi * (1 + 1e-6) and any(one.has_peak for one in found)
    return Finding("phase-unit", {"largest": largest}) if is_wrong else None


def _decibel(found: Sequence[_Summary]) -> Finding | None:
    """Find magnitudes in decibels that were read as linear: large and flat, while the phase turns."""
    if not found or not all(one.is_flat for one in found) or max(one.half_turns for one in found) < _HALF_TURNS:
        return None
    return Finding("decibel", {"low": min(one.low for one in found), "high": max(one.high for one in found)})


def _unsigned(found: Sequence[_Summary]) -> Finding | None:
    """Find phases without their sign: no line of any FRF has the other sign, yet FRFs turn both ways."""
    both = any(one.has_negative for one in found) and any(one.has_positive for one in found)
    if both or sum(one.n_frfs for one in found) < _LEAST_FRFS:
        return None
    forward, back = sum(one.forward for one in found), sum(one.back for one in found)
    if min(forward, back) <= _EITHER_WAY * (forward + back):
        return None
    return Finding("unsigned-phase", {"share": min(forward, back) / (forward + back)})
