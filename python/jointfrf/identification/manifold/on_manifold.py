"""FRFs that fit a joint: the manifold on which a fit is linearised.

Whatever the substructures are, the receptances at the two sides of a joint K* can be written on every line with two
free matrices H and Q (symmetric if the structure is reciprocal), and with the compliance R = (K* + Z)^-1 of the joint
in parallel with reference springs Z, a diagonal matrix:

    gamma_jj = H,   gamma_jk = H F,   gamma_kj = F' H,   gamma_kk = F' H F + R A,
    A = 1 - Q R,   A' = 1 - R Q,   F = (1 - Z R) A,   F' = A' (1 - R Z).

No inverse is needed. The form is regular for rigid DOFs, R = 0, and for free ones, R = 1/Z. Without springs R is the
compliance C of the joint, and Q = M = (Y_B + C)^-1 with Y_B the receptance of side k alone; in general
M = Z (1 - R Z) + (1 - Z R) Q (1 - R Z).
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
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
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
#: Ratio of squares to their median above which a line starts again.
_FAR_OFF = 4
#: Decrease of the squares, in units of the noise, below which the projection of a line has converged.
_GAIN = 1e-5


class FrfEntries(NamedTuple):
    """Entries of the FRFs of one line that are used, and the unit matrices of its free unknowns.

    Attributes
    ----------
    n : int
        Number of joint DOFs.
    rows, columns : ndarray of int, shape (q,)
        Entries of gamma, shape (2 n, 2 n): its upper triangle if the structure is reciprocal, else all.
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
        Entries used.
    measured, smooth : ndarray, shape (n_freq, q)
        Entries of measured and smooth gamma, m/N.
    inverse_std : ndarray, shape (n_freq, q)
        Inverse standard deviations 1/sqrt(E|e|^2) of the measured entries; 0 if an entry is not used.
    correlation : ndarray, shape (n_freq, q, q), optional
        Lower triangles L that make entries of unit variance uncorrelated, if their noise is correlated.
    springs : ndarray, shape (n,), optional
        Reference springs Z of the form, N/m or N m/rad; none by default.
    """

    entries: FrfEntries
    measured: ComplexArray
    smooth: ComplexArray
    inverse_std: FloatArray
    correlation: FloatArray | None = None
    springs: FloatArray | None = None

    @property
    def reference(self) -> FloatArray:
        """Reference springs Z of the form, shape (n,), N/m; zero without any."""
        return np.zeros(self.entries.n) if self.springs is None else self.springs

    def with_springs(self) -> LineData:
        """Return the same with reference springs as stiff as the structure at each DOF."""
        return self._replace(springs=1 / np.maximum(self.own_size, TINY))

    @property
    def used(self) -> NDArray[np.bool_]:
        """Which entries are used, shape (n_freq, q)."""
        return np.asarray(self.inverse_std > 0)

    @property
    def arrays(self) -> tuple[NDArray[Any], ...]:
        """Arrays by line: FRFs, noise, and its correlation if there is one."""
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
        own = [array[lines] for array in self.arrays]
        return LineData(self.entries, *own)._replace(springs=self.springs)

    @property
    def whitening_order(self) -> int:
        """Order of the whitening matrices, 0 if there are none."""
        return 0 if self.correlation is None else self.correlation.shape[1]

    @property
    def whitening(self) -> FloatArray:
        """Whitening matrices as argument of the kernel; unused numbers if there are none."""
        return (
            np.zeros((len(self.smooth), 1, 1)) if self.correlation is None else np.ascontiguousarray(self.correlation)
        )


class OnManifold(NamedTuple):
    """FRFs that fit a joint.

    Attributes
    ----------
    h, q : ndarray, shape (n_freq, n, n)
        The free matrices H, m/N, and Q, N/m.
    squares : ndarray, shape (n_freq,)
        Weighted squares of the distance to the FRFs that were projected.
    """

    h: ComplexArray
    q: ComplexArray
    squares: FloatArray


def frfs_of_joint(h: ComplexArray, q: ComplexArray, r: ComplexArray, springs: FloatArray) -> ComplexArray:
    """Return the receptances gamma of H, Q and R, shape (n_freq, 2 n, 2 n)."""
    one = np.eye(h.shape[-1])
    a, t = one - q @ r, one - springs[:, None] * r
    right = t @ a
    left = (one - r @ q) @ (one - r * springs)
    h_right = h @ right
    return np.block([[h, h_right], [left @ h, left @ h_right + r @ a]])


def project(target: ComplexArray, data: LineData, r: ComplexArray, start: OnManifold, steps: int) -> OnManifold:
    """Find the FRFs nearest to `target` that fit a joint, by Levenberg-Marquardt steps on each line.

    Parameters
    ----------
    target : ndarray, shape (n_freq, q)
        Entries of FRFs, m/N.
    data : LineData
        Weights of the entries.
    r : ndarray, shape (n_freq, n, n)
        Compliance R of the joint with the reference springs of the data, m/N.
    start : OnManifold
        Initial H and Q; its squares are not used.
    steps : int
        Maximum number of steps.

    Returns
    -------
    OnManifold
        Nearest FRFs. If a line contains NaN or Inf, or the start overflows, squares are infinite, and H and Q are the
        initial ones.
    """
    n_freq = len(target)
    h, q = (np.array(x, np.complex128, order="C") for x in (start.h, start.q))
    squares, line_info = np.empty(n_freq), np.empty(n_freq, np.int32)
    for own in line_slices(n_freq) if n_freq else []:
        part = data.on_lines(own)
        sizes = (int(data.entries.reciprocal), data.entries.n, data.whitening_order, len(part.measured))
        lines = _lines(part, data.entries.matrix(target[own]), r[own])
        call("project_with_springs", [*sizes, steps, _GAIN, *lines, h[own], q[own], squares[own], line_info[own]])
    bad = line_info != 0
    if bad.any():
        h[bad], q[bad], squares[bad] = start.h[bad], start.q[bad], np.inf
    return OnManifold(h, q, squares)


def normal_forms(data: LineData, r: ComplexArray, on: OnManifold, targets: tuple[ComplexArray, ...]) -> list[LineForms]:
    """Return the quadratic forms of R that FRFs give about a point of the manifold; H and Q are eliminated.

    Parameters
    ----------
    data : LineData
        Weights of the entries.
    r : ndarray, shape (n_freq, n, n)
        Compliance R of the joint with the reference springs of the data, m/N.
    on : OnManifold
        Point of the linearisation.
    targets : tuple of ndarray, shape (n_freq, q)
        Entries of FRFs, m/N.

    Returns
    -------
    list of LineForms
        One for each of `targets`; entries of R are by the unit matrices of `FrfEntries`. NaN if a line contains NaN or
        Inf.
    """
    entries, n_freq = data.entries, len(r)
    u = len(entries.units)
    weight = np.empty((n_freq, u, u), np.complex128)
    gradient = np.empty((len(targets), n_freq, u), np.complex128)
    squares = np.empty((len(targets), n_freq))
    for own in line_slices(n_freq) if n_freq else []:
        part = data.on_lines(own)
        n_own = len(part.measured)
        sizes = (int(entries.reciprocal), entries.n, u, data.whitening_order, n_own, len(targets))
        lines = _lines(part, np.array([entries.matrix(target[own]) for target in targets]), r[own])
        point = [np.ascontiguousarray(x[own]) for x in (on.h, on.q)]
        found = np.empty((len(targets), n_own, u), np.complex128), np.empty((len(targets), n_own))
        call("forms_with_springs", [*sizes, *lines, *point, weight[own], *found, np.empty(n_own, np.int32)])
        gradient[:, own], squares[:, own] = found
    a, b = entries.free
    return [LineForms(r[:, a, b], weight, p, s) for p, s in zip(gradient, squares, strict=True)]


def _lines(data: LineData, gamma: ComplexArray, r: ComplexArray) -> tuple[NDArray[Any], ...]:
    """Return springs, FRFs, weights, whitening and R as arguments of the kernel."""
    weights = data.entries.matrix(data.inverse_std)
    return data.reference, gamma, weights, data.whitening, np.ascontiguousarray(r, np.complex128)


def starts_on_manifold(data: LineData, r: ComplexArray, steps: int) -> OnManifold:
    """Find the FRFs nearest to the smooth ones that fit a joint; the best of several initial values of a line.

    Parameters
    ----------
    data : LineData
        FRFs with their weights.
    r : ndarray, shape (n_freq, n, n)
        Compliance R of the joint with the reference springs of the data, m/N.
    steps : int
        Maximum number of steps of the projection.
    """
    gamma, n = data.entries.matrix(data.smooth), data.entries.n
    # A view: the result replaces gamma_jj before the next initial values are computed.
    h = gamma[:, :n, :n]
    best = OnManifold(h, np.zeros_like(h), np.full(len(r), np.inf))
    for first_q in _FIRST_WITH_SPRINGS if data.reference.any() else _FIRST:
        far = np.flatnonzero(~(best.squares <= _FAR_OFF * np.median(best.squares)) | ~np.isfinite(best.squares))
        if far.size == 0:
            break
        own = data.on_lines(far)
        with np.errstate(all="ignore"):
            q = first_q(gamma[far], r[far], data.reference)
        if data.entries.reciprocal:
            q = (q + q.swapaxes(1, 2)) / 2
        q = np.where(np.isfinite(q).all(axis=(1, 2), keepdims=True), q, 0)
        found = project(own.smooth, own, r[far], OnManifold(h[far], q, best.squares[far]), steps)
        nearer = ~(found.squares >= best.squares[far])
        for whole, part in zip(best, found, strict=True):
            whole[far[nearer]] = part[nearer]
    return best


def _from_jk(gamma: ComplexArray, r: ComplexArray, springs: FloatArray) -> ComplexArray:
    """Return Q = (1 - A) R^-1 with A of gamma_jk = gamma_jj A; without springs."""
    n = r.shape[-1]
    return (np.eye(n) - solve(gamma[:, :n, :n], gamma[:, :n, n:], on_singular="nan")) @ _inverse(r)


def _from_kj(gamma: ComplexArray, r: ComplexArray, springs: FloatArray) -> ComplexArray:
    """Return Q = (1 - A) R^-1 with A of gamma_kk = (gamma_kj (1 - Z R) + R) A."""
    n = r.shape[-1]
    left = gamma[:, n:, :n] @ (np.eye(n) - springs[:, None] * r) + r
    return (np.eye(n) - solve(left, gamma[:, n:, n:], on_singular="nan")) @ _inverse(r)


def _from_inverse(gamma: ComplexArray, r: ComplexArray, springs: FloatArray) -> ComplexArray:
    """Return Q = M = (C + Y_B)^-1 with Y_B of the inverse of gamma; without springs."""
    n = r.shape[-1]
    return _inverse(r + _inverse(_inverse(gamma)[:, n:, n:] - _inverse(r)))


def _from_kk(gamma: ComplexArray, r: ComplexArray, springs: FloatArray) -> ComplexArray:
    """Return Q by least squares, by entry, of gamma_jk = H F and gamma_kk - gamma_kj H^-1 gamma_jk = R - R Q R."""
    n = r.shape[-1]
    d = np.einsum("lpp->lp", r)
    t, one = 1 - springs * d, np.eye(n)
    ratio = solve(gamma[:, :n, :n], gamma[:, :n, n:], on_singular="nan")
    own = gamma[:, n:, n:] - gamma[:, n:, :n] @ ratio
    # The first equation is divided by the springs, so that both are compliances.
    of_jk, left = (t / springs)[:, :, None] * d[:, None, :], (t[:, :, None] * one - ratio) / springs[:, None]
    of_kk, right = d[:, :, None] * d[:, None, :], d[:, :, None] * one - own
    found: ComplexArray = (of_jk.conj() * left + of_kk.conj() * right) / (abs(of_jk) ** 2 + abs(of_kk) ** 2)
    return found


def _inverse(a: ComplexArray) -> ComplexArray:
    return invert(a, on_singular="nan")


#: Algebraic initial values of Q, exact without noise; none last.
_FIRST: tuple[Callable[[ComplexArray, ComplexArray, FloatArray], ComplexArray], ...] = (
    _from_jk,
    _from_kj,
    _from_inverse,
    lambda gamma, r, springs: np.zeros_like(r),
)
#: The same for a joint without cross terms and with reference springs.
_FIRST_WITH_SPRINGS = (_from_kk, _from_kj, _FIRST[-1])


def smooth_compliance(data: LineData) -> ComplexArray:
    """Return R of the smooth FRFs, shape (n_freq, n, n), m/N; zero if they do not determine it.

    With F0 = gamma_jj^-1 gamma_jk and P = gamma_kk - gamma_kj F0, R = P (F0 + Z P)^-1.
    """
    gamma = data.entries.matrix(data.smooth)
    if data.springs is None:
        compliance = joint_compliance(gamma, on_singular="nan")
    else:
        n = data.entries.n
        ratio = solve(gamma[:, :n, :n], gamma[:, :n, n:], on_singular="nan")
        own = gamma[:, n:, n:] - gamma[:, n:, :n] @ ratio
        compliance = own @ _inverse(ratio + data.reference[:, None] * own)
    if data.entries.reciprocal:
        compliance = (compliance + compliance.swapaxes(1, 2)) / 2
    good = np.isfinite(compliance).all(axis=(1, 2), keepdims=True)
    found: ComplexArray = np.where(good, compliance, 0)
    return found


#: Least error of smooth FRFs, as a share of the noise.
_LEAST_SHARE = 0.2


class PriorOfM(NamedTuple):
    """Prior of M, and the precision with which FRFs show it.

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
    """Return the prior: entries of M are as large as entries of gamma_jj^-1 on the line and elsewhere in the band."""
    n = data.entries.n

    def of_lines(own: slice) -> tuple[FloatArray, FloatArray]:
        part = data.on_lines(own)
        size = np.abs(invert(part.entries.matrix(part.smooth)[:, :n, :n], on_singular="nan"))
        squares = abs((part.measured - part.smooth) * part.inverse_std) ** 2
        return np.where(np.isfinite(size), size, 0), squares.sum(axis=1)

    size, squares = in_pieces(len(data.smooth), of_lines)
    np.hypot(size, medians(size.T).T, out=size)
    size[size == 0] = np.finfo(float).tiny
    # Without smoothing nothing is left: the error of the FRFs is the noise.
    left = squares.sum() / max(np.count_nonzero(data.inverse_std), 1)
    return PriorOfM(size, float(np.sqrt(np.clip(1 - left, _LEAST_SHARE**2, 1))))


def expected_m(data: LineData, r: ComplexArray, on: OnManifold, prior: PriorOfM) -> OnManifold:
    """Return the FRFs of the expected M and the corresponding H, from the FRFs nearest to the smooth ones.

    Parameters
    ----------
    data : LineData
        FRFs with their weights.
    r : ndarray, shape (n_freq, n, n)
        Compliance R of the joint with the reference springs of the data, m/N.
    on : OnManifold
        Nearest FRFs; their squares are kept.
    prior : PriorOfM
        Prior of M.

    Notes
    -----
    The expectation of M for a normal prior about 0 and a normal error of the smooth FRFs. Both together are a least
    squares problem, solved by one Gauss-Newton step for H and Q. If the FRFs show M well, it stays nearly unchanged.
    """
    h, q = (np.array(x, np.complex128, order="C") for x in (on.h, on.q))
    line_info = np.empty(len(r), np.int32)
    sizes = (int(data.entries.reciprocal), data.entries.n, data.whitening_order, len(r))
    spread = np.ascontiguousarray(prior.size)
    weights = data.entries.matrix(data.inverse_std)
    known = prior.share, spread, data.reference, weights, data.whitening, np.ascontiguousarray(r)
    call("expect_with_springs", [*sizes, *known, h, q, line_info])
    bad = line_info != 0
    h[bad], q[bad] = on.h[bad], on.q[bad]
    return on._replace(h=h, q=q)
