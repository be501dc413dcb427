"""FRFs that fit a joint: the manifold on which a fit is linearised.

Whatever the substructures are, the receptances at the two sides of a joint of compliance C can be written on every line
with two matrices H and M that are free (symmetric where the structure is reciprocal):

    gamma_jj = H,   gamma_jk = H T,   gamma_kj = T' H,   gamma_kk = T' H T + C T,   T = 1 - M C,   T' = 1 - C M.

M is (Y_B + C)^-1 with Y_B the receptance of side k alone. No inverse is needed: the form is regular where gamma_jk
is singular and for a rigid joint, C = 0.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.bands import in_pieces, line_slices
from jointfrf.frf.quantiles import medians
from jointfrf.identification.manifold.line_forms import LineForms
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.call import call
from jointfrf.kernel.linear_algebra import invert, solve
from jointfrf.substructuring.compliance import joint_compliance

__all__ = [
    "FrfEntries",
    "LineData",
    "OnManifold",
    "PriorOfM",
    "expected_m",
    "frfs_of_joint",
    "normal_forms",
    "prior_of_m",
    "project",
    "smooth_compliance",
    "starts_on_manifold",
]

_Numbers = TypeVar("_Numbers", ComplexArray, FloatArray)
#: Lines whose squares exceed the median by this factor are started again.
_FAR_OFF = 4
#: A line has arrived when a step gains less than this of the squares, in units of the noise.
_GAIN = 1e-5


class FrfEntries(NamedTuple):
    """Which entries of the FRFs of one line are used, and the unit matrices of what is free on it.

    Attributes
    ----------
    n : int
        Joint DOFs.
    rows, columns : ndarray of int, shape (q,)
        Entries of gamma, shape (2 n, 2 n): its upper triangle where the structure is reciprocal, else all.
    units : ndarray, shape (u, n, n)
        Symmetric unit matrices, or all unit matrices.
    """

    n: int
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    units: FloatArray

    @classmethod
    def of(cls, n: int, *, reciprocal: bool) -> FrfEntries:
        """Return the entries of n joint DOFs."""
        return _entries_of(n, reciprocal)

    def take(self, gamma: ComplexArray) -> ComplexArray:
        """Return the entries of gamma, shape (..., q)."""
        return gamma[..., self.rows, self.columns]

    @property
    def reciprocal(self) -> bool:
        """Whether the structure is reciprocal."""
        return self.rows.size == self.n * (2 * self.n + 1)

    @property
    def free(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Rows and columns of the free entries of H, M and C, shape (u,)."""
        return _free(self.n, self.reciprocal)

    def matrix(self, values: _Numbers) -> _Numbers:
        """Return gamma, or weights, of its entries, shape (n_freq, 2 n, 2 n)."""
        m = 2 * self.n
        return values.take(self.places.ravel(), axis=1).reshape(-1, m, m)

    @property
    def places(self) -> NDArray[np.intp]:
        """Number of the entry at each place of gamma, shape (2 n, 2 n)."""
        return _places(self.n, self.reciprocal)


@lru_cache(maxsize=64)
def _free(n: int, reciprocal: bool) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of the upper triangle, or of all entries, shape (u,)."""
    rows, columns = np.triu_indices(n) if reciprocal else (x.ravel() for x in np.indices((n, n)))
    for shared in (rows, columns):
        shared.flags.writeable = False
    return rows, columns


@lru_cache(maxsize=64)
def _entries_of(n: int, reciprocal: bool) -> FrfEntries:
    rows, columns = _free(2 * n, reciprocal)
    a, b = _free(n, reciprocal)
    units = np.zeros((a.size, n, n))
    k = np.arange(a.size)
    units[k, a, b] = 1
    if reciprocal:
        units[k, b, a] = 1
    units.flags.writeable = False
    return FrfEntries(n, rows, columns, units)


@lru_cache(maxsize=64)
def _places(n: int, reciprocal: bool) -> NDArray[np.intp]:
    """Return the number of the entry at each place of gamma."""
    entries, place = _entries_of(n, reciprocal), np.empty((2 * n, 2 * n), np.intp)
    place[entries.columns, entries.rows] = place[entries.rows, entries.columns] = np.arange(entries.rows.size)
    place.flags.writeable = False
    return place


class LineData(NamedTuple):
    """Measured and smooth FRFs of one group of DOFs, with their noise.

    Attributes
    ----------
    entries : FrfEntries
    measured, smooth : ndarray, shape (n_freq, q)
        Entries of gamma, m/N.
    inverse_std : ndarray, shape (n_freq, q)
        1/sqrt(E|e|^2) of the measured entries; 0 where an entry is not used.
    correlation : ndarray, shape (n_freq, q, q), optional
        Where noise of entries is correlated, lower triangles L that make entries of unit variance uncorrelated.
    """

    entries: FrfEntries
    measured: ComplexArray
    smooth: ComplexArray
    inverse_std: FloatArray
    correlation: FloatArray | None = None

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which entries are used, shape (n_freq, q)."""
        return np.asarray(self.inverse_std > 0)

    @property
    def arrays(self) -> tuple[NDArray[Any], ...]:
        """The arrays by line: FRFs, noise, and its correlation where there is one."""
        arrays = self.measured, self.smooth, self.inverse_std
        return arrays if self.correlation is None else (*arrays, self.correlation)

    @property
    def own_size(self) -> FloatArray:
        """Median size of the receptances of each DOF, the larger of both sides, shape (n,), m/N."""
        own: FloatArray = np.abs(self.smooth[:, self.entries.rows == self.entries.columns])
        size: FloatArray = medians(own.T).reshape(2, self.entries.n).max(axis=0)
        return size

    def on_lines(self, lines: NDArray[np.intp] | slice) -> LineData:
        """Return some of the lines; neighbouring ones without a copy."""
        return LineData(self.entries, *(array[lines] for array in self.arrays))

    @property
    def whitening_order(self) -> int:
        """Order of the whitening matrices, 0 where there are none."""
        return 0 if self.correlation is None else self.correlation.shape[1]

    @property
    def weighing(self) -> tuple[FloatArray, FloatArray]:
        """Weights and whitening as the kernel takes them."""
        weights = self.entries.matrix(self.inverse_std)
        if self.correlation is None:
            return weights, np.zeros((len(weights), 1, 1))
        return weights, np.ascontiguousarray(self.correlation)


class OnManifold(NamedTuple):
    """FRFs that fit a joint.

    Attributes
    ----------
    h, m : ndarray, shape (n_freq, n, n)
        The free matrices H, m/N, and M, N/m.
    squares : ndarray, shape (n_freq,)
        Weighted squares of the distance to the FRFs that were projected.
    """

    h: ComplexArray
    m: ComplexArray
    squares: FloatArray


def frfs_of_joint(h: ComplexArray, m: ComplexArray, c: ComplexArray) -> ComplexArray:
    """Return the receptances gamma of H, M and C, shape (n_freq, 2 n, 2 n)."""
    one = np.eye(h.shape[-1])
    right, left = one - m @ c, one - c @ m
    h_right = h @ right
    return np.block([[h, h_right], [left @ h, left @ h_right + c @ right]])


def project(target: ComplexArray, data: LineData, c: ComplexArray, start: OnManifold, steps: int) -> OnManifold:
    """Find the FRFs nearest to `target` that fit a joint, by Levenberg-Marquardt steps on each line.

    Parameters
    ----------
    target : ndarray, shape (n_freq, q)
        Entries of FRFs, m/N.
    data : LineData
        Their weights.
    c : ndarray, shape (n_freq, n, n)
        Compliance of the joint, m/N.
    start : OnManifold
        Its squares are not used.
    steps : int
        At most.

    Returns
    -------
    OnManifold
        Squares are infinite, and H and M those of the start, where the line holds NaN or Inf or the start overflows.
    """
    n_freq = len(target)
    h, m = (np.array(x, np.complex128, order="C") for x in (start.h, start.m))
    squares, line_info = np.empty(n_freq), np.empty(n_freq, np.int32)
    for own in line_slices(n_freq) if n_freq else []:
        part = data.on_lines(own)
        sizes = (int(data.entries.reciprocal), data.entries.n, data.whitening_order, len(part.measured))
        lines = _lines(part, data.entries.matrix(target[own]), c[own])
        call("project_on_joint", [*sizes, steps, _GAIN, *lines, h[own], m[own], squares[own], line_info[own]])
    bad = line_info != 0
    if bad.any():
        h[bad], m[bad], squares[bad] = start.h[bad], start.m[bad], np.inf
    return OnManifold(h, m, squares)


def normal_forms(data: LineData, c: ComplexArray, on: OnManifold, targets: tuple[ComplexArray, ...]) -> list[LineForms]:
    """Return the quadratic forms of C that FRFs give about a point of the manifold; H and M are eliminated.

    Parameters
    ----------
    data : LineData
    c : ndarray, shape (n_freq, n, n)
    on : OnManifold
        Point about which is linearised.
    targets : tuple of ndarray, shape (n_freq, q)
        Entries of FRFs.

    Returns
    -------
    list of LineForms
        One for each of `targets`; entries of C are by the unit matrices of `FrfEntries`. NaN where a line holds NaN or
        Inf.
    """
    entries, n_freq = data.entries, len(c)
    u = len(entries.units)
    weight = np.empty((n_freq, u, u), np.complex128)
    gradient = np.empty((len(targets), n_freq, u), np.complex128)
    squares = np.empty((len(targets), n_freq))
    for own in line_slices(n_freq) if n_freq else []:
        part = data.on_lines(own)
        n_own = len(part.measured)
        sizes = (int(entries.reciprocal), entries.n, u, data.whitening_order, n_own, len(targets))
        lines = _lines(part, np.array([entries.matrix(target[own]) for target in targets]), c[own])
        point = [np.ascontiguousarray(x[own]) for x in (on.h, on.m)]
        found = np.empty((len(targets), n_own, u), np.complex128), np.empty((len(targets), n_own))
        call("joint_forms", [*sizes, *lines, *point, weight[own], *found, np.empty(n_own, np.int32)])
        gradient[:, own], squares[:, own] = found
    a, b = entries.free
    return [LineForms(c[:, a, b], weight, p, s) for p, s in zip(gradient, squares, strict=True)]


def _lines(data: LineData, gamma: ComplexArray, c: ComplexArray) -> tuple[NDArray[Any], ...]:
    """Return FRFs, weights, whitening and C as the kernel takes them."""
    return gamma, *data.weighing, np.ascontiguousarray(c, np.complex128)


def starts_on_manifold(data: LineData, c: ComplexArray, steps: int) -> OnManifold:
    """Find the FRFs nearest to the smooth ones that fit a joint of compliance c; the best of several starts of a line.

    Parameters
    ----------
    data : LineData
    c : ndarray, shape (n_freq, n, n)
        Compliance of the joint, m/N.
    steps : int
        Steps of the projection at most.
    """
    gamma, n = data.entries.matrix(data.smooth), data.entries.n
    # A view: what was found replaces gamma_jj where the next starts are sought.
    h = gamma[:, :n, :n]
    best = OnManifold(h, np.zeros_like(h), np.full(len(c), np.inf))
    for first_m in _FIRST_M:
        far = np.flatnonzero(~(best.squares <= _FAR_OFF * np.median(best.squares)) | ~np.isfinite(best.squares))
        if far.size == 0:
            break
        own = data.on_lines(far)
        with np.errstate(all="ignore"):
            m = first_m(gamma[far], c[far])
        if data.entries.reciprocal:
            m = (m + m.swapaxes(1, 2)) / 2
        m = np.where(np.isfinite(m).all(axis=(1, 2), keepdims=True), m, 0)
        found = project(own.smooth, own, c[far], OnManifold(h[far], m, best.squares[far]), steps)
        nearer = ~(found.squares >= best.squares[far])
        for whole, part in zip(best, found, strict=True):
            whole[far[nearer]] = part[nearer]
    return best


def _from_jj(gamma: ComplexArray, c: ComplexArray) -> ComplexArray:
    """Return M = (1 - T) K* with T of gamma_jk = gamma_jj T."""
    n = c.shape[-1]
    return (np.eye(n) - solve(gamma[:, :n, :n], gamma[:, :n, n:], on_singular="nan")) @ _inverse(c)


def _from_kj(gamma: ComplexArray, c: ComplexArray) -> ComplexArray:
    """Return M = (1 - T) K* with T of gamma_kk = (gamma_kj + C) T."""
    n = c.shape[-1]
    return (np.eye(n) - solve(gamma[:, n:, :n] + c, gamma[:, n:, n:], on_singular="nan")) @ _inverse(c)


def _from_inverse(gamma: ComplexArray, c: ComplexArray) -> ComplexArray:
    """Return M = (C + Y_B)^-1 with Y_B of the inverse of gamma."""
    n = c.shape[-1]
    return _inverse(c + _inverse(_inverse(gamma)[:, n:, n:] - _inverse(c)))


def _inverse(a: ComplexArray) -> ComplexArray:
    return invert(a, on_singular="nan")


#: Algebraic first values of M, exact without noise; none last.
_FIRST_M: tuple[Callable[[ComplexArray, ComplexArray], ComplexArray], ...] = (
    _from_jj,
    _from_kj,
    _from_inverse,
    lambda gamma, c: np.zeros_like(c),
)


def smooth_compliance(data: LineData) -> ComplexArray:
    """Return C of the smooth FRFs, shape (n_freq, n, n); zero where they do not give it."""
    compliance = joint_compliance(data.entries.matrix(data.smooth), on_singular="nan")
    if data.entries.reciprocal:
        compliance = (compliance + compliance.swapaxes(1, 2)) / 2
    good = np.isfinite(compliance).all(axis=(1, 2), keepdims=True)
    found: ComplexArray = np.where(good, compliance, 0)
    return found


#: Smooth FRFs have at least this share of the noise.
_LEAST_SHARE = 0.2


class PriorOfM(NamedTuple):
    """What is known of M before the FRFs are looked at, and how well they show it.

    Attributes
    ----------
    size : ndarray, shape (n_freq, n, n)
        Standard deviation of the entries of M about 0, N/m.
    share : float
        Error of the smooth FRFs relative to the noise.
    """

    size: FloatArray
    share: float

    def on_lines(self, lines: slice) -> PriorOfM:
        """Return some of the lines."""
        return self._replace(size=self.size[lines])


def prior_of_m(data: LineData) -> PriorOfM:
    """Return the prior: entries of M are as large as those of gamma_jj^-1, there and elsewhere in the band."""
    n = data.entries.n

    def of_lines(own: slice) -> tuple[FloatArray, FloatArray]:
        part = data.on_lines(own)
        size = np.abs(invert(part.entries.matrix(part.smooth)[:, :n, :n], on_singular="nan"))
        squares = abs((part.measured - part.smooth) * part.inverse_std) ** 2
        return np.where(np.isfinite(size), size, 0), squares.sum(axis=1)

    size, squares = in_pieces(len(data.smooth), of_lines)
    np.hypot(size, medians(size.T).T, out=size)
    size[size == 0] = np.finfo(float).tiny
    # Of FRFs that were not smoothed, nothing is left: their error is the noise.
    left = squares.sum() / max(np.count_nonzero(data.inverse_std), 1)
    return PriorOfM(size, float(np.sqrt(np.clip(1 - left, _LEAST_SHARE**2, 1))))


def expected_m(data: LineData, c: ComplexArray, on: OnManifold, prior: PriorOfM) -> OnManifold:
    """Move from the FRFs nearest to the smooth ones to those of the expected M, and of the H that belongs to it.

    Parameters
    ----------
    data : LineData
    c : ndarray, shape (n_freq, n, n)
        Compliance of the joint, m/N.
    on : OnManifold
        The nearest FRFs; their squares are kept.
    prior : PriorOfM

    Notes
    -----
    The mean of M where it is normal about 0 and the error of the smooth FRFs is normal: the least squares of both
    together, by one Gauss-Newton step for H and M. Where FRFs show M well, it stays as it is.
    """
    h, m = (np.array(x, np.complex128, order="C") for x in (on.h, on.m))
    line_info = np.empty(len(c), np.int32)
    sizes = (int(data.entries.reciprocal), data.entries.n, data.whitening_order, len(c))
    spread = np.ascontiguousarray(prior.size)
    call("expect_on_joint", [*sizes, prior.share, spread, *data.weighing, np.ascontiguousarray(c), h, m, line_info])
    bad = line_info != 0
    h[bad], m[bad] = on.h[bad], on.m[bad]
    return on._replace(h=h, m=m)
