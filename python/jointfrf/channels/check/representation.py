"""Complex numbers from wrong parts: phases in radians or without sign, magnitudes in decibels.

This check precedes all other ones, which would report its consequences in every channel.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.signals import modulus
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
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
    """Report wrong magnitudes or phases of all FRFs; None if they are right.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Positive, Hz.
    h : ndarray, shape (n_freq, n_responses, n_forces)
        Receptances, m/N, finite unless they are missing.
    missing : ndarray of bool, shape (n_responses, n_forces)
        FRFs that are not used.
    read_as : str, optional
        Quantity that the FRFs were read as before they became receptances.

    Notes
    -----
    The FRFs of one force are summarised together: all of them at once would take the memory of the FRFs many times.
    """
    factor = ((2j * np.pi * freq_hz) ** POWER_OF_I_OMEGA.get(read_as or "receptance", 0))[:, None]
    found = []
    for force in range(h.shape[2]):
        own = h[:, ~missing[:, force], force] * factor
        own = own[:, (own != 0).all(axis=0)]
        if own.size:
            found.append(_summary(own))
    if not found:
        return None
    every = _Summary(*(np.array(values) for values in zip(*found, strict=True)))
    largest = float(every.largest_degrees.max())
    if largest <= np.pi * (1 + 1e-6) and every.has_peak.any():
        return Finding("phase-unit", {"largest": largest})
    if every.is_flat.all() and every.half_turns.max() >= _HALF_TURNS:
        return Finding("decibel", {"low": float(every.low.min()), "high": float(every.high.max())})
    has_both_signs = every.has_negative.any() and every.has_positive.any()
    turns = float(every.forward.sum()), float(every.back.sum())
    if has_both_signs or every.n_frfs.sum() < _LEAST_FRFS or min(turns) <= _EITHER_WAY * sum(turns):
        return None
    return Finding("unsigned-phase", {"share": min(turns) / sum(turns)})


class _Summary(NamedTuple):
    """Statistics of the FRFs of one force, or arrays of them for all forces.

    Attributes
    ----------
    n_frfs : int
        Number of FRFs.
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

    n_frfs: NDArray[np.intp]
    largest_degrees: FloatArray
    has_peak: NDArray[np.bool_]
    is_flat: NDArray[np.bool_]
    has_positive: NDArray[np.bool_]
    has_negative: NDArray[np.bool_]
    low: FloatArray
    high: FloatArray
    half_turns: FloatArray
    forward: FloatArray
    back: FloatArray


def _summary(h: ComplexArray) -> tuple[Any, ...]:
    """Return the fields of `_Summary` for FRFs, shape (n_freq, n)."""
    size, angle = modulus(h), np.angle(h)
    low, high = np.quantile(size, _MOST, axis=0)
    before = np.minimum.accumulate(size, axis=0)
    after = np.minimum.accumulate(size[::-1], axis=0)[::-1]
    return (
        h.shape[1],
        np.degrees(abs(angle).max()),
        (size > _RISE * np.maximum(before, after)).any(),
        ((np.median(size, axis=0) > _LEAST_DECIBEL) & (high < _FLAT * low)).all(),
        (h.imag > 0).any(),
        (h.imag < 0).any(),
        low.min(),
        high.max(),
        (np.ptp(np.unwrap(angle, axis=0), axis=0) / np.pi).max(),
        *_turns(h),
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
    total = total / np.maximum(abs(total).sum(axis=0), TINY)
    return float(np.maximum(total, 0).sum()), float(np.maximum(-total, 0).sum())
