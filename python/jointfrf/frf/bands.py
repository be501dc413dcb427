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
#: Most lines of a chunk of a long sweep: memory for intermediate results does not grow with the lines.
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
    """Cut lines into chunks of about equal length, `most` at most, `PIECE` by default.

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
    """Compute arrays of all lines in chunks: the memory beside them is that of one chunk.

    Parameters
    ----------
    n_freq : int
    of_lines : callable
        From a slice of the lines to arrays whose first axis is theirs.
    most : int, optional
        Most lines of a chunk, `PIECE` by default.

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
    """Which lines lie in any of the bands, limits included.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Hz.
    bands : sequence of (low, high)
        Hz.

    Returns
    -------
    ndarray of bool, shape (n_freq,)

    Raises
    ------
    ValueError
        A band is not (low, high), or holds no line.

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
    """Bands of each DOF from an argument: nothing (all lines), one band, several, or one of these for each DOF.

    Parameters
    ----------
    bands : None, (low, high), sequence of (low, high), or mapping of DOF name to these
        Hz. A sequence holds bands that serve all DOFs together.
    dofs : sequence of str
        Names of the DOFs.
    freq_hz : ndarray, shape (n_freq,)
        Hz.

    Returns
    -------
    list of list of (low, high)
        One list for each DOF.

    Raises
    ------
    ValueError
        A name that is not a DOF, a DOF without a band, a band without lines.

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
    """Mean of Re K* and Im K*/w of each DOF over its sensitive band, as the thesis does.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Hz; a line at 0 Hz cannot give a damping.
    k_joint : array_like, shape (n_freq, n, n)
        Identified K*.
    bands, dofs
        As in `as_bands`; names ``"0"``, ``"1"``, ... by default.

    Returns
    -------
    BandMean

    Raises
    ------
    ValueError
        Wrong shapes, bands without lines, 0 Hz inside a band.

    Notes
    -----
    The mean of an inverse of noise: where the noise exceeds the joint's compliance, k and c shrink to zero.

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
