"""Rational functions with common poles through several FRFs: weighted least squares, how many poles, and where."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.noise_parts import line_correlation
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.call import call_for_number

__all__ = ["Entries", "OrderSearch", "RationalFit", "rational_fit", "relocated", "search_order"]

#: Most relocations after new poles, and at the end; they end where the sum of squares no longer changes.
_RELOCATIONS = 3
_LAST_RELOCATIONS = 8
#: Relocation ends when it gains less than this share of the price of a pole.
_STILL = 0.1
#: A fit that leaves this share of the data is exact but for rounding of the normal equations.
_EXACT = 3e-5
#: Peaks are the largest lines within this share of all lines on either side, twice what lies between them.
_PEAK_WINDOW = 0.02
_PEAK_RISE = 2.0
#: Poles with less damping than this part of the distance of lines may follow one line only: the fit is repeated
#: without it.
_NARROW = 0.5
_LEFT_OUT = 1e-4
#: Rounds of finding such lines.
_ROUNDS = 6
#: An inflation found from a residual counts up to this while poles may be missing.
_MOST_INFLATION = 4.0
#: Damping of new poles relative to their frequency, usual in structures; relocation changes it.
_DAMPING = 0.01


@dataclass(frozen=True)
class Entries:
    """FRFs that have their poles in common, one a row, and their weights.

    Attributes
    ----------
    s : ndarray, shape (n_freq,)
        i f / max f.
    h : ndarray, shape (n_entries, n_freq)
        In C order.
    weight : ndarray, shape (n_entries, n_freq)
        1 / sqrt(E|e|^2) up to one factor, in C order.
    """

    s: ComplexArray
    h: ComplexArray
    weight: FloatArray

    @property
    def n_data(self) -> int:
        """Number of complex data."""
        return self.h.size

    def n_parameters(self, n_poles: int) -> int:
        """Return the number of complex parameters of a fit with this number of poles."""
        return len(self.h) * (n_poles + 1) + n_poles


@dataclass(frozen=True)
class RationalFit:
    """Rational functions with the same poles.

    Attributes
    ----------
    poles : ndarray, shape (n_poles,)
    smooth : ndarray, shape (n_entries, n_freq)
    squares : float
        Weighted sum of squares of h - smooth.
    loss : ndarray, shape (n_poles,)
        By how much `squares` would grow without the pole, the others staying where they are.
    """

    poles: ComplexArray
    smooth: ComplexArray
    squares: float
    loss: FloatArray


def relocated(entries: Entries, poles: ComplexArray, iterations: int, still: float) -> tuple[float, ComplexArray]:
    """Relocate poles until the sum of squares of the fit stays.

    Parameters
    ----------
    entries : Entries
    poles : ndarray, shape (n_poles,)
    iterations : int
        Most relocations.
    still : float
        Relative change of the sum of squares at which they end.

    Returns
    -------
    squares : float
        The least sum of squares.
    better : ndarray, shape (n_poles,)
        Its poles, all stable.

    Notes
    -----
    Relaxed vector fitting: sigma and numerators q_e of the form c_0 + sum c_k/(s - p_k) minimise
    sum_e |w_e (q_e - sigma h_e)|^2 with the mean of sigma held; the zeros of sigma are the new poles. The numerators
    are eliminated entry by entry. The poles are those of positive frequencies; their mirror images, far from the
    lines, are left to poles of their own: so structural damping, which has no mirror image, is met exactly, too.
    As noise adds its Gram matrix to the quadratic form of sigma, holding the weighted mean of sigma leaves the poles
    where they are once they are right.

    References
    ----------
    B. Gustavsen, A. Semlyen, Rational approximation of frequency domain responses by vector fitting. IEEE Trans.
    Power Delivery 14 (1999); B. Gustavsen, Improving the pole relocating properties of vector fitting. 21 (2006).
    """
    better = np.array(poles, np.complex128)
    sizes = (len(poles), *entries.h.shape)
    fitted = (entries.s, entries.h, entries.weight)
    squares, _ = call_for_number("relocate_poles", (*sizes, iterations, still, *fitted, better))
    return squares, better


def rational_fit(entries: Entries, poles: ComplexArray) -> RationalFit:
    """Least-squares fit with these poles.

    Parameters
    ----------
    entries : Entries
    poles : ndarray, shape (n_poles,)

    Returns
    -------
    RationalFit

    Notes
    -----
    Normal equations in a basis that is orthonormal under the mean weight, corrected once by their residual.
    """
    smooth, loss = np.empty_like(entries.h), np.empty(len(poles))
    sizes = (len(poles), *entries.h.shape)
    fitted = (entries.s, entries.h, entries.weight)
    squares, _ = call_for_number("rational_fit", (*sizes, *fitted, poles, smooth, loss))
    return RationalFit(poles, smooth, squares, loss)


@dataclass(frozen=True)
class OrderSearch:
    """Options of a search.

    Attributes
    ----------
    inflation : float, optional
        Lines that carry the noise of one independent line; found from the residual if it is None.
    max_poles : int
    patience : int
        Orders in a row that may gain nothing before the search ends; 0 for no further poles.
    """

    inflation: float | None = 1.0
    max_poles: int = 60
    patience: int = 2

    def most_poles(self, n_freq: int) -> int:
        """Most poles that this number of lines bears."""
        return max(1, min(self.max_poles, int(n_freq / (self.inflation or 1) / 3) - 1))

    def found_inflation(self, entries: Entries, fit: RationalFit) -> float:
        """Return the given inflation, or that of the residual, which missing poles increase."""
        if self.inflation is not None:
            return self.inflation
        share = entries.n_parameters(len(fit.poles)) / entries.n_data
        return min(line_correlation(entries.weight * (entries.h - fit.smooth), share), _MOST_INFLATION)


def _price(entries: Entries, inflation: float) -> float:
    """Return by how much a pole must reduce the sum of squares of noise of variance 1 to be worth its parameters.

    Twice its parameters, as in generalised cross-validation, and the logarithm of the number of lines among which its
    place was chosen.
    """
    return inflation * float(2 * (len(entries.h) + 1) + np.log(len(entries.s)))


def _score(entries: Entries, inflation: float, fit: RationalFit) -> float:
    """Generalised cross-validation: the least is the best."""
    used = inflation * len(entries.h) + _price(entries, inflation) * len(fit.poles) / 2
    free = 1 - used / entries.n_data
    return fit.squares / free**2 if free > 0 else np.inf


def search_order(entries: Entries, search: OrderSearch, start: ComplexArray | None = None) -> RationalFit:
    """Fit with the number of poles that describes the data best.

    Parameters
    ----------
    entries : Entries
        Lines in rising order.
    search : OrderSearch
    start : ndarray, optional
        Poles to begin with; default the peaks of the entries.

    Returns
    -------
    RationalFit
    """
    poles = first_poles(entries) if start is None else start
    for _ in range(_ROUNDS):
        if search.patience == 0 and search.inflation is not None:
            inflation, poles = search.inflation, poles[: search.most_poles(len(entries.s))]
        else:
            fit = _grown(entries, search, poles)
            inflation, poles = search.found_inflation(entries, fit), fit.poles
        fit = _pruned(entries, inflation, poles)
        alone, followed = _single_lines(entries, inflation, fit)
        if not followed.size:
            break
        entries = _left_out(entries, followed)
        poles = fit.poles[~alone] if not alone.all() else first_poles(entries)
    return fit


def _grown(entries: Entries, search: OrderSearch, poles: ComplexArray) -> RationalFit:
    """Fit with poles added where the residual is largest, as long as they are worth their parameters."""
    most = search.most_poles(len(entries.s))
    total = float((abs(entries.weight * entries.h) ** 2).sum())
    poles = poles[:most]
    best: RationalFit | None = None
    failures = 0
    while True:
        fit = _converged(entries, poles, _RELOCATIONS)
        inflation = search.found_inflation(entries, fit)
        if best is None or _score(entries, inflation, fit) < _score(entries, inflation, best):
            best, failures = fit, 0
        else:
            failures += 1
        if failures >= search.patience or len(fit.poles) >= most or fit.squares < _EXACT**2 * total:
            return best
        count = min(max(1, len(fit.poles) // 5), most - len(fit.poles))
        more = _poles_for_residual(entries, fit, inflation, count)
        if not more.size:
            return best
        poles = np.concatenate([fit.poles, more])


def _converged(entries: Entries, poles: ComplexArray, most: int) -> RationalFit:
    """Fit with poles relocated until the sum of squares stays."""
    still = _STILL * _price(entries, 1.0) / entries.n_data
    return rational_fit(entries, relocated(entries, poles, most, still)[1])


def _single_lines(entries: Entries, inflation: float, fit: RationalFit) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
    """Whether a pole follows one outlying line, and these lines: without that line it is not worth its parameters."""
    f = entries.s.imag
    narrow = -fit.poles.real < _NARROW * (f[-1] - f[0]) / len(f)
    narrow &= (fit.poles.imag > f[0]) & (fit.poles.imag < f[-1])
    if not narrow.any():
        return narrow, np.zeros(0, np.intp)
    nearest = abs(f[:, None] - fit.poles.imag).argmin(axis=0)
    again = rational_fit(_left_out(entries, nearest[narrow]), fit.poles)
    variance = again.squares / max(entries.n_data - entries.n_parameters(len(fit.poles)), 1)
    alone = narrow & (again.loss < _price(entries, inflation) * variance)
    return alone, nearest[alone]


def _left_out(entries: Entries, lines: NDArray[np.intp]) -> Entries:
    weight = entries.weight.copy()
    weight[:, lines] *= _LEFT_OUT
    return replace(entries, weight=weight)


def _pruned(entries: Entries, inflation: float, poles: ComplexArray) -> RationalFit:
    """Fit without the poles that are not worth their parameters."""
    least = np.inf
    best: RationalFit | None = None
    while True:
        fit = _converged(entries, poles, _LAST_RELOCATIONS)
        score = _score(entries, inflation, fit)
        if best is not None and score > least:
            return best
        best, least = fit, score
        variance = fit.squares / max(entries.n_data - entries.n_parameters(len(fit.poles)), 1)
        worthless = np.flatnonzero(fit.loss < _price(entries, inflation) * variance)
        if not worthless.size or len(fit.poles) == 1:
            return best
        # Half of them at a time: what one describes another may describe as well.
        drop = worthless[fit.loss[worthless].argsort()][: (worthless.size + 1) // 2]
        poles = np.delete(fit.poles, drop[: len(fit.poles) - 1])


def first_poles(entries: Entries) -> ComplexArray:
    """Poles at the peaks of the entries, at the mirror image of the lowest, and two above the lines."""
    f = entries.s.imag
    size = abs(entries.h) ** 2
    indicator = _median_of_three((size / size.mean(axis=1, keepdims=True)).sum(axis=0))
    peaks = f[_peaks(indicator)]
    lowest = peaks[0] if peaks.size else f[0]
    places = np.concatenate([[-lowest], peaks, [1.2, 1.5]])
    return _at(places)


def _at(places: FloatArray) -> ComplexArray:
    return np.asarray(1j * places - _DAMPING * abs(places), np.complex128)


def _median_of_three(values: FloatArray) -> FloatArray:
    """Median of each line and its neighbours: a single outlying line is not a mode."""
    before, after = np.r_[values[:1], values[:-1]], np.r_[values[1:], values[-1:]]
    least, most = np.minimum(before, after), np.maximum(before, after)
    return np.asarray(np.clip(values, least, most), float)


def _peaks(values: FloatArray) -> np.ndarray:
    """Lines that are larger than those on both sides."""
    n = len(values)
    reach = max(2, round(_PEAK_WINDOW * n))
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(values, reach, mode="edge"), 2 * reach + 1)
    low = np.maximum(windows[:, :reach].min(axis=1), windows[:, reach + 1 :].min(axis=1))
    peaks = (values == windows.max(axis=1)) & (values > _PEAK_RISE * low)
    return np.flatnonzero(peaks)


def _poles_for_residual(entries: Entries, fit: RationalFit, inflation: float, count: int) -> ComplexArray:
    """Poles where the residual does not vanish in the mean over neighbouring lines, at most `count`.

    For windows of some widths the sum over the entries of |sum of residuals|^2 / width is about the reduction of the
    sum of squares by a pole there; a window counts if that is the price of a pole. The pole takes its middle for
    frequency and its half-width for damping. Lines far above their neighbours are cut down to these: they are no modes.
    """
    f = entries.s.imag
    residual = entries.weight * (entries.h - fit.smooth)
    power = (residual.real**2 + residual.imag**2).sum(axis=0)
    usual = _median_of_three(power)
    residual = residual * np.sqrt(np.where(power > usual, usual / np.where(power > usual, power, 1), 1))
    sums = np.pad(np.cumsum(residual, axis=1), ((0, 0), (1, 0)))
    widths = [w for w in 3 ** np.arange(1, 12) if w <= len(f)]
    gains = [(abs(sums[:, w:] - sums[:, :-w]) ** 2).sum(axis=0) / w for w in widths]
    variance = fit.squares / max(entries.n_data - entries.n_parameters(len(fit.poles)), 1)
    poles: list[complex] = []
    while len(poles) < count:
        at = [int(gain.argmax()) for gain in gains]
        best = int(np.argmax([gain[k] for gain, k in zip(gains, at, strict=True)]))
        first, width = at[best], widths[best]
        if gains[best][first] < _price(entries, inflation) * variance:
            break
        last = first + width - 1
        middle, half = (f[first] + f[last]) / 2, (f[last] - f[first]) / 2
        poles.append(complex(-half, middle))
        for w, gain in zip(widths, gains, strict=True):
            gain[max(0, first - w + 1) : last + 1] = 0
    return np.array(poles, np.complex128)
