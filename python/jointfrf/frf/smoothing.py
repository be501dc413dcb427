"""Smooth FRFs: rational functions with common poles, fitted to measured FRFs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.bands import line_slices
from jointfrf.frf.entry_groups import EntryGroup, entry_groups
from jointfrf.frf.quantiles import medians
from jointfrf.kernel.arguments import (
    TINY,
    ComplexArray,
    FloatArray,
    as_frequency,
    as_integer,
    as_lines,
    as_number,
    as_real,
    check_finite_lines,
)
from jointfrf.kernel.call import call_for_number

__all__ = [
    "OrderSearch",
    "SmoothFrfs",
    "checked_frfs",
    "first_variance",
    "joined",
    "near_squares",
    "pieces",
    "smooth_frfs",
    "smoothed",
    "smoothed_in_pieces",
]

#: Number of lines below which FRFs are returned as measured: a pole and its residues take three of them.
_FEWEST_LINES = 16
#: Residual, as a share of the FRFs, below which it is an error of the rational functions rather than noise.
_EXACT = 1e-4
#: Largest ratio of the residual about smooth FRFs with the poles of others to their noise.
_LIKE = 1.2
#: Share of the median of |h|^2 that is added to |h|^2 in first weights: a floor of 30 % of the median of |h|.
_FIRST_FLOOR = 0.09


@dataclass(frozen=True)
class OrderSearch:
    """Options of the search for the number of poles.

    Attributes
    ----------
    inflation : float, optional
        Number of lines that carry the noise of one independent line; by default estimated from the residual.
    max_poles : int
        Largest number of poles.
    patience : int
        Number of orders in a row without gain after which the search ends; 0 for no further poles.
    """

    inflation: float | None = 1.0
    max_poles: int = 60
    patience: int = 2


@dataclass(frozen=True)
class SmoothFrfs:
    """FRFs without most of their noise.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    h : ndarray, shape (n_freq, n_out, n_in)
        Smooth FRFs in the unit of the measured ones; reciprocal if the structure is.
    is_smooth : bool
        Whether `h` is smooth. It contains the measured FRFs if there are too few lines, or no noise to remove.
    poles : tuple of ndarray
        Poles of positive frequencies, rad/s, of each group of coupled entries, one piece of the lines after the other.
    level : float
        Root mean square of measured minus smooth FRFs relative to sqrt(variance), corrected for the parameters.
    share : ndarray, shape (n_out, n_in)
        Parameters over data: the part of the noise power of an entry that its smooth FRF has absorbed, if the noise of
        neighbouring lines is independent.
    """

    freq_hz: FloatArray
    h: ComplexArray
    is_smooth: bool
    poles: tuple[ComplexArray, ...]
    level: float
    share: FloatArray

    @property
    def order(self) -> int:
        """Number of poles of the group with most poles."""
        return max((len(poles) for poles in self.poles), default=0)

    def is_like(self, level: float) -> bool:
        """Return whether these FRFs, with the poles of others, leave no more than their noise level."""
        return self.is_smooth and self.level < _LIKE * level


def smooth_frfs(
    freq_hz: ArrayLike,
    h: ArrayLike,
    variance: ArrayLike | None = None,
    *,
    inflation: float = 1.0,
    reciprocal: bool = True,
    max_poles: int = 60,
) -> SmoothFrfs:
    """Return smooth FRFs: rational functions of frequency with common poles, fitted to measured FRFs.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Lines in Hz, all different, in any spacing.
    h : array_like, shape (n_freq, n_out, n_in)
        Measured FRFs, in any unit.
    variance : array_like, shape (n_freq, n_out, n_in), optional
        Noise variance E|e|^2 of each FRF up to one factor, > 0; default |h|^2 (equal relative noise everywhere).
    inflation : float
        Number of neighbouring lines that carry the noise of one independent line, >= 1, default 1.
    reciprocal : bool
        Whether h_pq and h_qp of square matrices are the same FRF.
    max_poles : int
        Largest number of poles of a group of coupled entries.

    Returns
    -------
    SmoothFrfs
        Smooth FRFs, with poles and level of the residual.

    Raises
    ------
    ValueError
        Wrong shapes, NaN or Inf in a line, two lines of the same frequency, a variance that is not positive, an
        inflation below 1.

    See Also
    --------
    estimate_noise : smooth FRFs together with their unknown noise.

    Notes
    -----
    Poles by relaxed vector fitting with weights 1/variance; their number by generalised cross-validation. The search
    starts at the peaks of the FRFs and adds poles at the largest residual. Only poles of positive frequencies are used,
    with complex residues. A receptance with structural damping is fitted exactly by as many poles as there are modes
    near the lines, and a few more for all further modes. Entries that are zero (by symmetry) are omitted, and groups of
    uncoupled entries have separate poles. Work is proportional to n_freq n_entries n_poles^2. More than 8192 lines are
    cut into pieces of equal length, each smoothed separately.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> h = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    >>> smooth = jf.smooth_frfs(freq, jf.pollute(h, 0.05, seed=1))
    >>> bool(np.median(abs(smooth.h - h) / abs(h)) < 0.01)
    True
    """
    freq, lines = checked_frfs(freq_hz, h)
    spread = None if variance is None else as_real("variance", variance, lines.shape)
    if spread is not None and not (spread > 0).all():
        raise ValueError("variance must be positive")
    if as_number("inflation", inflation) < 1:
        raise ValueError(f"inflation must be 1 or more, not {inflation}")
    if as_integer("max_poles", max_poles) < 1:
        raise ValueError(f"max_poles must be 1 or more, not {max_poles}")
    search = OrderSearch(inflation=inflation, max_poles=max_poles)
    return smoothed_in_pieces(freq, lines, spread, search, reciprocal=reciprocal)


def smoothed_in_pieces(
    freq: FloatArray,
    h: ComplexArray,
    variance: FloatArray | None,
    search: OrderSearch,
    *,
    reciprocal: bool,
    start: tuple[ComplexArray, ...] = (),
) -> SmoothFrfs:
    """Smooth checked FRFs, lines in any order, as `smooth_frfs` does; from poles `start` if there is one piece."""
    places = pieces(np.argsort(freq))
    parts = (
        smoothed(
            freq[own],
            h[own],
            None if variance is None else variance[own],
            search,
            entry_groups(h[own], reciprocal=reciprocal),
            start if len(places) == 1 else (),
        )
        for own in places
    )
    return joined(places, parts, h.shape)


def pieces(order: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Return chunks of lines in rising order, which are smoothed separately: memory does not grow with the lines."""
    return [order[own] for own in line_slices(len(order))]


def joined(places: Sequence[NDArray[np.intp]], parts: Iterable[SmoothFrfs], shape: tuple[int, ...]) -> SmoothFrfs:
    """Return smooth FRFs of this shape from pieces, with the poles of each piece and the means of level and share."""
    freq, h, share = np.empty(shape[0]), np.empty(shape, np.complex128), np.zeros(shape[1:])
    is_smooth, power = False, 0.0
    poles: list[ComplexArray] = []
    for own, one in zip(places, parts, strict=True):
        freq[own], h[own] = one.freq_hz, one.h
        is_smooth |= one.is_smooth
        poles += one.poles
        power += one.level**2 * len(own) / shape[0]
        share += one.share * len(own) / shape[0]
    return SmoothFrfs(freq, h, is_smooth, tuple(poles), float(np.sqrt(power)), share)


def checked_frfs(freq_hz: ArrayLike, h: ArrayLike) -> tuple[FloatArray, ComplexArray]:
    """Return lines, all different, and finite FRFs, at least one."""
    lines = as_lines("h", h)
    if not lines.size:
        shape = " x ".join(map(str, lines.shape))
        raise ValueError(f"h has no FRFs, its shape is {shape}: give at least one frequency line, output and input")
    freq = as_frequency(freq_hz, len(lines))
    check_finite_lines("h", lines, freq)
    order = np.argsort(freq)
    same = np.flatnonzero(np.diff(freq[order]) == 0)
    if same.size:
        one, two = sorted(order[same[0] : same[0] + 2])
        raise ValueError(f"freq_hz: lines {one} and {two} are both {freq[one]:g} Hz")
    return freq, lines


def smoothed(
    freq: FloatArray,
    h: ComplexArray,
    variance: FloatArray | None,
    search: OrderSearch,
    groups: Sequence[EntryGroup],
    start: tuple[ComplexArray, ...] = (),
) -> SmoothFrfs:
    """Smooth checked FRFs, lines in rising order, as `smooth_frfs` does; poles `start` of each group are in rad/s."""
    n_freq, n_out, n_in = h.shape
    measured = SmoothFrfs(freq, h, False, (), 1.0, np.zeros((n_out, n_in)))
    if n_freq < _FEWEST_LINES or not h.any():
        return measured
    values, share, poles = np.zeros_like(h), np.zeros((1, n_out, n_in)), []
    squares, freedom, is_exact = 0.0, 0.0, True
    for number, group in enumerate(groups):
        before = start[number] if len(start) == len(groups) else np.zeros(0, np.complex128)
        fit = _smooth_group(freq, h, variance, group, search, before)
        n_data, n_entries, n_poles = fit.smooth.size, len(fit.smooth), len(fit.poles)
        parameters = n_entries * (n_poles + 1) + n_poles
        squares, freedom, is_exact = squares + fit.squares, freedom + n_data - parameters, is_exact and fit.is_exact
        group.put(fit.smooth, values)
        group.put((parameters / n_data / np.where(group.repeated, 2, 1))[:, None], share)
        poles.append(fit.poles)
    level = float(np.sqrt(squares / max(freedom, 1)))
    if is_exact:
        return replace(measured, poles=tuple(poles), level=level)
    return SmoothFrfs(freq, values, True, tuple(poles), level, share[0])


class _FittedPoles(NamedTuple):
    """Rational functions through the FRFs of a group, one a row.

    Attributes
    ----------
    poles : ndarray, shape (n_poles,)
        Poles, rad/s.
    smooth : ndarray, shape (n_entries, n_freq)
        Smooth FRFs.
    squares : float
        Sum of |h - smooth|^2 over the variance.
    is_exact : bool
        Whether most residuals are errors of the rational functions rather than noise.
    """

    poles: ComplexArray
    smooth: ComplexArray
    squares: float
    is_exact: bool


def _smooth_group(
    freq: FloatArray,
    h: ComplexArray,
    variance: FloatArray | None,
    group: EntryGroup,
    search: OrderSearch,
    start: ComplexArray,
) -> _FittedPoles:
    """Return the fit of one group."""
    if variance is not None:
        return _fitted(freq, *group.means(h, variance), search, start)
    near = near_squares(h)
    mean, spread = group.means(h, first_variance(near, medians(near.T).T))
    fit = _fitted(freq, mean, spread, search, start)
    count = np.where(group.repeated, 2, 1)[:, None]
    return _fitted(freq, mean, (3 * abs(fit.smooth) ** 2 / count + spread) / 4, search, fit.poles)


def _fitted(
    freq: FloatArray, h: ComplexArray, variance: FloatArray, search: OrderSearch, start: ComplexArray
) -> _FittedPoles:
    """Return the fit of FRFs, one a row, from poles `start`, or from poles at their peaks."""
    poles, smooth = np.zeros(search.max_poles, np.complex128), np.empty_like(h)
    poles[: len(start)] = start[: search.max_poles]
    sizes = (*h.shape, search.max_poles, min(len(start), search.max_poles), search.patience, search.inflation or 0.0)
    n_poles, squares, _ = call_for_number("smooth_frfs", (*sizes, freq, h, variance, poles, smooth))
    left = h - smooth
    small = left.real**2 + left.imag**2 < _EXACT**2 * np.maximum(smooth.real**2 + smooth.imag**2, TINY)
    return _FittedPoles(poles[: int(n_poles)].copy(), smooth, squares, bool(2 * np.count_nonzero(small) > small.size))


def first_variance(near: FloatArray, usual: FloatArray) -> FloatArray:
    """Return a variance without information on the noise: |h|^2 over neighbouring lines, and a part of its median."""
    return np.maximum(near + _FIRST_FLOOR * usual, TINY)


def near_squares(h: ComplexArray) -> FloatArray:
    """Return the mean of |h|^2 over each line and its neighbours; lines at the ends count twice."""
    squares: FloatArray = h.real**2 + h.imag**2
    near = squares.copy()
    near[1:] += squares[:-1]
    near[:1] *= 2
    near[:-1] += squares[1:]
    near[-1:] += squares[-1:]
    near /= 3
    return near
