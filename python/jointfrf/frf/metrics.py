"""How far a regenerated FRF is from the exact one: amplitude error (4.11) and frequency error (4.12)."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.bands import Band, in_bands
from jointfrf.kernel.arguments import FloatArray, as_frequency, as_values

__all__ = ["amplitude_error", "frequency_error", "has_peak", "peak"]


def peak(h: ArrayLike, freq_hz: ArrayLike, band: Band | None = None, *, refine: bool = False) -> tuple[float, float]:
    """Largest modulus of an FRF in a band and its frequency.

    Parameters
    ----------
    h : array_like, shape (n_freq,)
        One FRF.
    freq_hz : array_like, shape (n_freq,)
        Hz.
    band : (low, high), optional
        Hz; all lines by default.
    refine : bool
        Whether the peak is sought between the lines, by a parabola through the logarithms of the three highest.

    Returns
    -------
    amplitude, frequency : float
        In the unit of `h`, and Hz.

    Raises
    ------
    ValueError
        Shapes that do not agree, a band without lines, NaN; with `refine`, neighbours at the same frequency.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.peak([1.0, 4.0, 2.0], [10.0, 11.0, 12.0])
    (4.0, 11.0)
    """
    freq = as_frequency(freq_hz)
    amplitude, inside, at = _largest(h, freq, band)
    if not refine or at in (inside[0], inside[-1]) or amplitude[at - 1 : at + 2].min() <= 0:
        return float(amplitude[at]), float(freq[at])
    if np.unique(freq[at - 1 : at + 2]).size < 3:
        raise ValueError(f"freq_hz: lines {at - 1} to {at + 1} are not at three frequencies, as refine needs them")
    # In parts of the larger step: squares of steps of any size, where LAPACK would search for ever, have no place here.
    steps = freq[at - 1 : at + 2] - freq[at]
    width = abs(steps).max()
    parabola = np.polyfit(steps / width, np.log(amplitude[at - 1 : at + 2]), 2)
    offset = -parabola[1] / (2 * parabola[0])
    return float(np.exp(np.polyval(parabola, offset))), float(freq[at] + offset * width)


def has_peak(h: ArrayLike, freq_hz: ArrayLike, band: Band) -> bool:
    """Whether an FRF has a peak in a band: its largest modulus there does not lie on the first or the last line.

    Parameters
    ----------
    h : array_like, shape (n_freq,)
        One FRF.
    freq_hz : array_like, shape (n_freq,)
        Hz.
    band : (low, high)
        Hz.

    Returns
    -------
    bool

    Raises
    ------
    ValueError
        As in `peak`.

    Examples
    --------
    >>> import jointfrf as jf
    >>> h, freq = [1.0, 4.0, 2.0, 1.0], [10.0, 11.0, 12.0, 13.0]
    >>> jf.has_peak(h, freq, (10, 13)), jf.has_peak(h, freq, (11, 13))
    (True, False)
    """
    _, inside, at = _largest(h, as_frequency(freq_hz), band)
    return at not in (inside[0], inside[-1])


def _largest(h: ArrayLike, freq: FloatArray, band: Band | None) -> tuple[FloatArray, NDArray[np.intp], np.intp]:
    """Return the modulus of an FRF, the lines inside the band, and the one where it is largest there."""
    amplitude: FloatArray = np.abs(as_values("h", h, freq.size))
    if not np.isfinite(amplitude).all():
        raise ValueError(f"h holds NaN or Inf in line {int(np.argmin(np.isfinite(amplitude)))}")
    inside = np.arange(freq.size) if band is None else np.flatnonzero(in_bands(freq, [band]))
    if inside.size == 0:
        raise ValueError("h has no lines")
    return amplitude, inside, inside[np.argmax(amplitude[inside])]


def amplitude_error(
    h_exact: ArrayLike, h: ArrayLike, freq_hz: ArrayLike, band: Band | None = None, *, refine: bool = False
) -> float:
    """Relative difference of the largest amplitudes in a band, percent (4.11).

    Parameters
    ----------
    h_exact, h : array_like, shape (n_freq,)
        Exact and regenerated FRF.
    freq_hz, band, refine
        As in `peak`.

    Returns
    -------
    float
        Percent.

    Raises
    ------
    ValueError
        As in `peak`; the exact FRF is zero.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.amplitude_error([1.0, 4.0, 2.0], [1.0, 3.0, 2.0], [10.0, 11.0, 12.0])
    25.0
    """
    exact, obtained = (peak(x, freq_hz, band, refine=refine)[0] for x in (h_exact, h))
    if exact == 0:
        raise ValueError("h_exact is zero on all lines: no error relative to it")
    return abs((exact - obtained) / exact) * 100


def frequency_error(
    h_exact: ArrayLike, h: ArrayLike, freq_hz: ArrayLike, band: Band | None = None, *, refine: bool = False
) -> float:
    """Relative difference of the frequencies of the largest amplitudes in a band, percent (4.12).

    Parameters
    ----------
    h_exact, h : array_like, shape (n_freq,)
        Exact and regenerated FRF.
    freq_hz, band, refine
        As in `peak`. Without `refine` the error is a multiple of the spacing of the lines.

    Returns
    -------
    float
        Percent.

    Raises
    ------
    ValueError
        As in `peak`; the exact FRF is largest at 0 Hz.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.frequency_error([1.0, 4.0, 2.0], [1.0, 2.0, 4.0], [10.0, 11.0, 12.0])
    9.090909090909092
    """
    exact, obtained = (peak(x, freq_hz, band, refine=refine)[1] for x in (h_exact, h))
    if exact == 0:
        raise ValueError("h_exact is largest at 0 Hz: no error relative to that frequency; give a band above it")
    return abs((exact - obtained) / exact) * 100
