"""Frequency bands, means over them, and peaks and errors of FRFs in them (4.11), (4.12)."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.kernel.arguments import FloatArray, as_frequency, as_names, as_square, as_values, one_line

__all__ = [
    "Band",
    "amplitude_error",
    "as_bands",
    "band_mean",
    "frequency_error",
    "has_peak",
    "in_bands",
    "in_pieces",
    "is_long",
    "line_slices",
    "peak",
    "spread_lines",
]

Band = tuple[float, float]
#: Largest number of lines in a chunk of a long sweep: memory for intermediate results does not grow with the lines.
PIECE = 8192


def is_long(n_freq: int) -> bool:
    """Return whether a sweep is processed in chunks, without keeping intermediate results."""
    return n_freq > PIECE


def spread_lines(n_freq: int) -> slice:
    """Return no more lines than one chunk has, evenly spread.

    Examples
    --------
    >>> from jointfrf.frf.bands import spread_lines
    >>> spread_lines(20000)
    slice(None, None, 3)
    """
    return slice(None, None, max(1, -(-n_freq // PIECE)))


def line_slices(n_freq: int, most: int | None = None) -> list[slice]:
    """Return chunks of lines of about equal length, at most `most` lines each, by default `PIECE`.

    Examples
    --------
    >>> from jointfrf.frf.bands import line_slices
    >>> line_slices(10000)
    [slice(0, 5000, None), slice(5000, 10000, None)]
    """
    most = PIECE if most is None else most
    if n_freq <= most:
        return [slice(0, n_freq)]
    ends = np.linspace(0, n_freq, -(-n_freq // most) + 1).astype(int).tolist()
    return [slice(first, end) for first, end in pairwise(ends)]


def in_pieces(
    n_freq: int, of_lines: Callable[[slice], Sequence[NDArray[Any]]], most: int | None = None
) -> list[NDArray[Any]]:
    """Return arrays of all lines, computed in chunks: additional memory is needed for one chunk only.

    Parameters
    ----------
    n_freq : int
        Number of lines.
    of_lines : callable
        Function from a slice of the lines to arrays whose first axis is the lines.
    most : int, optional
        Largest number of lines in a chunk, default `PIECE`.

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf.frf.bands import in_pieces
    >>> h = np.arange(20000.0)
    >>> (squares,) = in_pieces(len(h), lambda own: [h[own] ** 2])
    >>> bool((squares == h**2).all())
    True
    """
    first, *others = line_slices(n_freq, most)
    parts = of_lines(first)
    if not others:
        return list(parts)
    whole = [np.empty((n_freq, *part.shape[1:]), part.dtype) for part in parts]
    for own in (first, *others):
        for array, part in zip(whole, parts if own is first else of_lines(own), strict=True):
            array[own] = part
    return whole


def in_bands(freq_hz: ArrayLike, bands: Sequence[Band]) -> NDArray[np.bool_]:
    """Return which lines are in any of the bands, limits included.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz.
    bands : sequence of (low, high)
        Bands, Hz.

    Returns
    -------
    ndarray of bool, shape (n_freq,)
        Whether each line is in a band.

    Raises
    ------
    ValueError
        A band is not (low, high), or contains no line.

    See Also
    --------
    as_bands : bands of each DOF.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.in_bands([1, 2, 3, 4], [(2, 3)]).tolist()
    [False, True, True, False]
    """
    freq = as_frequency(freq_hz)
    inside = np.zeros(freq.size, bool)
    for low, high in _pairs(bands):
        here = (freq >= low) & (freq <= high)
        if not here.any():
            extent = f"they run from {freq.min():g} to {freq.max():g} Hz" if freq.size else "there are none"
            raise ValueError(f"the band {low:g} to {high:g} Hz contains no frequency line; {extent}")
        inside |= here
    return inside


def _pairs(bands: object) -> list[Band]:
    """Return bands as pairs of numbers."""
    try:
        pairs = [(float(low), float(high)) for low, high in bands]  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        pairs = [(np.nan, np.nan)]
    if not all(0 <= low <= high < np.inf for low, high in pairs):
        raise ValueError(f"a band must be (low, high) in Hz with 0 <= low <= high, not {one_line(bands)}")
    return pairs


def as_bands(
    bands: Band | Sequence[Band] | Mapping[str, Band | Sequence[Band]] | None, dofs: Sequence[str], freq_hz: FloatArray
) -> list[list[Band]]:
    """Return the bands of each DOF from an argument: nothing (all lines), one band, several, or these by DOF.

    Parameters
    ----------
    bands : None, (low, high), sequence of (low, high), or mapping of DOF name to these
        Bands, Hz. A sequence contains bands that all DOFs share.
    dofs : sequence of str
        Names of the DOFs.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.

    Returns
    -------
    list of list of (low, high)
        One list for each DOF.

    Raises
    ------
    ValueError
        A name that is not a DOF, a DOF without a band, a band without lines.

    See Also
    --------
    in_bands : lines in bands.
    propose_bands : bands of high sensitivity.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> jf.as_bands({"y": (1, 2), "theta": [(1, 2), (3, 4)]}, ["y", "theta"], np.arange(5.0))
    [[(1.0, 2.0)], [(1.0, 2.0), (3.0, 4.0)]]
    """
    freq_hz = as_frequency(freq_hz)
    dofs = as_names("dofs", dofs)

    def several(entry: Band | Sequence[Band] | None) -> list[Band]:
        if entry is None:
            return [(float(freq_hz.min(initial=np.inf)), float(freq_hz.max(initial=0)))]
        single = isinstance(entry, Sequence | np.ndarray) and len(entry) == 2 and all(np.ndim(x) == 0 for x in entry)
        pairs = _pairs([entry] if single else entry)
        in_bands(freq_hz, pairs)
        return pairs

    if not isinstance(bands, Mapping):
        return [several(bands)] * len(dofs)
    unknown = [name for name in bands if name not in dofs]
    missing = [name for name in dofs if name not in bands]
    if unknown or missing:
        what = f"names {unknown[0]!r}, which is no DOF" if unknown else f"has no band for DOF {missing[0]!r}"
        raise ValueError(f"bands {what}; the DOFs are {', '.join(dofs)}")
    return [several(bands[name]) for name in dofs]


class BandMean(NamedTuple):
    """Means over a band.

    Attributes
    ----------
    stiffness, damping : ndarray, shape (n,)
        Mean of Re K* and of Im K*/w of each DOF: N/m and N s/m, rotational N m/rad and N m s/rad.
    """

    stiffness: FloatArray
    damping: FloatArray


def band_mean(
    freq_hz: ArrayLike,
    k_joint: ArrayLike,
    bands: Band | Sequence[Band] | Mapping[str, Band | Sequence[Band]] | None = None,
    dofs: Sequence[str] | None = None,
) -> BandMean:
    """Return the mean of Re K* and Im K*/w of each DOF over its sensitive band, as in the thesis.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz; a line at 0 Hz cannot give a damping.
    k_joint : array_like, shape (n_freq, n, n)
        Identified K*, N/m.
    bands : None, (low, high), sequence of (low, high), or mapping of DOF name to these
        Bands, Hz, see `as_bands`.
    dofs : sequence of str, optional
        Names of the DOFs, default ``"0"``, ``"1"``, ...

    Returns
    -------
    BandMean
        Stiffness and damping of each DOF.

    Raises
    ------
    ValueError
        Wrong shapes, bands without lines, 0 Hz inside a band.

    See Also
    --------
    identify_band_mean : the same from FRFs.
    identify : maximum likelihood, without this bias.

    Notes
    -----
    The mean of an inverse of noise is biased: if the noise exceeds the joint's compliance, k and c shrink to zero.

    Examples
    --------
    >>> import jointfrf as jf
    >>> joint = jf.Joint([2000.0], [3.0])
    >>> mean = jf.band_mean([3.0, 6.0, 9.0], joint.dynamic_stiffness([3.0, 6.0, 9.0]), (3, 9))
    >>> mean.stiffness.tolist(), mean.damping.round(12).tolist()
    ([2000.0], [3.0])
    """
    lines = as_square("k_joint", k_joint)
    n_freq, n, _ = lines.shape
    freq = as_frequency(freq_hz, n_freq)
    names = [str(i) for i in range(n)] if dofs is None else list(as_names("dofs", dofs))
    if len(names) != n:
        raise ValueError(f"dofs must name {n} DOFs, not {len(names)}")
    stiffness, damping = np.empty(n), np.empty(n)
    for d, own in enumerate(as_bands(bands, names, freq)):
        inside = in_bands(freq, own)
        if (freq[inside] == 0).any():
            raise ValueError(f"the band of {names[d]} contains 0 Hz, where Im K*/w is not defined; start above 0 Hz")
        k = lines[inside, d, d]
        stiffness[d] = k.real.mean()
        damping[d] = (k.imag / (2 * np.pi * freq[inside])).mean()
    return BandMean(stiffness, damping)


def peak(h: ArrayLike, freq_hz: ArrayLike, band: Band | None = None, *, refine: bool = False) -> tuple[float, float]:
    """Return the largest modulus of an FRF in a band and its frequency.

    Parameters
    ----------
    h : array_like, shape (n_freq,)
        One FRF.
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz.
    band : (low, high), optional
        Band, Hz; all lines by default.
    refine : bool
        Whether to interpolate between the lines, by a parabola through the logarithms of the three highest; default
        False.

    Returns
    -------
    amplitude, frequency : float
        Modulus in the unit of `h`, and frequency, Hz.

    Raises
    ------
    ValueError
        Shapes that do not agree, a band without lines, NaN; with `refine`, neighbours at the same frequency.

    See Also
    --------
    has_peak : whether a band contains a peak.
    amplitude_error, frequency_error : errors of a peak.

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
    # In parts of the larger step, because squares of steps of any size could make LAPACK iterate without end.
    steps = freq[at - 1 : at + 2] - freq[at]
    width = abs(steps).max()
    parabola = np.polyfit(steps / width, np.log(amplitude[at - 1 : at + 2]), 2)
    offset = -parabola[1] / (2 * parabola[0])
    return float(np.exp(np.polyval(parabola, offset))), float(freq[at] + offset * width)


def has_peak(h: ArrayLike, freq_hz: ArrayLike, band: Band) -> bool:
    """Return whether an FRF has a peak in a band: its largest modulus is not on the first or the last line.

    Parameters
    ----------
    h : array_like, shape (n_freq,)
        One FRF.
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz.
    band : (low, high)
        Band, Hz.

    Returns
    -------
    bool
        Whether there is a peak.

    Raises
    ------
    ValueError
        An error of `peak`.

    See Also
    --------
    peak : the peak itself.

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
    """Return the modulus of an FRF, the lines inside the band, and the line of its largest value there."""
    amplitude: FloatArray = np.abs(as_values("h", h, freq.size))
    if not np.isfinite(amplitude).all():
        raise ValueError(f"h contains NaN or Inf in line {int(np.argmin(np.isfinite(amplitude)))}")
    inside = np.arange(freq.size) if band is None else np.flatnonzero(in_bands(freq, [band]))
    if inside.size == 0:
        raise ValueError("h has no lines")
    return amplitude, inside, inside[np.argmax(amplitude[inside])]


def amplitude_error(
    h_exact: ArrayLike, h: ArrayLike, freq_hz: ArrayLike, band: Band | None = None, *, refine: bool = False
) -> float:
    """Return the relative difference of the largest amplitudes in a band, percent (4.11).

    Parameters
    ----------
    h_exact, h : array_like, shape (n_freq,)
        Exact and regenerated FRF.
    freq_hz, band, refine
        Frequencies and band, Hz, and interpolation; see `peak`.

    Returns
    -------
    float
        Error, percent.

    Raises
    ------
    ValueError
        An error of `peak`; the exact FRF is zero.

    See Also
    --------
    frequency_error : error of the frequency.
    validate : errors of all FRFs of an assembly.

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
    """Return the relative difference of the frequencies of the largest amplitudes in a band, percent (4.12).

    Parameters
    ----------
    h_exact, h : array_like, shape (n_freq,)
        Exact and regenerated FRF.
    freq_hz, band, refine
        Frequencies and band, Hz, and interpolation; see `peak`. Without `refine` the error is a multiple of the spacing
        of the lines.

    Returns
    -------
    float
        Error, percent.

    Raises
    ------
    ValueError
        An error of `peak`; the exact FRF is largest at 0 Hz.

    See Also
    --------
    amplitude_error : error of the amplitude.
    validate : errors of all FRFs of an assembly.

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
