"""K*(w) of a joint, and its compliance as a function of coordinates in which a fit is well behaved.

Everything is a function of R = (K* + Z)^-1, the compliance of the joint in parallel with reference springs Z. A joint
without cross terms is fitted in a = 1/(k + z) and the rates eta = h a and tau = c a of each DOF, which are regular for
a rigid DOF, a = 0, and for a free one, a = 1/z. The coordinates of a joint with cross terms are the entries of K*, and
the coordinates of laws are their parameters.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from jointfrf.choices import CrossTerms, DampingTerms
from jointfrf.dofs import Parameter, ParameterKind, joint_parameters, parameters_shared, point_and_direction
from jointfrf.identification.manifold.line_forms import LEAST_GAIN, STEPS, FormMinimum, JointCoordinates, LineForms
from jointfrf.identification.minimise import inverse_information
from jointfrf.identification.parameters import ParameterVector, joint_vector
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.kernel.call import call, call_for_number
from jointfrf.kernel.linear_algebra import invert
from jointfrf.laws.law_joint import LawJoint

__all__ = [
    "CoupledJoint",
    "CrossTerms",
    "DampingTerms",
    "DiagonalJoint",
    "JointTerms",
    "LawCoordinates",
    "SpringJoint",
    "coordinates_of",
    "joint_terms",
    "summed_terms",
]

NumbersT = TypeVar("NumbersT", ComplexArray, FloatArray)

_KINDS: Mapping[DampingTerms, tuple[ParameterKind, ...]] = {
    "none": ("k",),
    "viscous": ("k", "c"),
    "hysteretic": ("k", "h"),
    "both": ("k", "h", "c"),
}
#: Rates eta and w tau are limited: K* is then damping only.
_LARGEST_RATE = 100.0
#: Relative standard error of a compliance above which intervals come from the profile of the likelihood.
_CURVED = 0.1
#: Relative error of a compliance above which its damping is unknown: its rate is limited to 1 in the linearisation.
_HARDLY = 0.3


class JointTerms(NamedTuple):
    """K*(w) as a sum of parameters times a function of frequency times a symmetric pair of DOFs.

    Attributes
    ----------
    parameters : tuple of Parameter, length p
        Parameters by kind, k before h before c, and within a kind the diagonal first.
    omega : ndarray, shape (n_freq,)
        Angular frequencies, rad/s.
    kinds : ndarray of int, shape (q,)
        Kind of each term, 0, 1, 2 for k, h, c: the functions of frequency 1, i, i w.
    pairs : ndarray of int, shape (q, 2)
        Row and column of each term in K*.
    shared : ndarray of int, shape (q,)
        Parameter of each term: q = p in one order, unless points have equal joints.
    """

    parameters: tuple[Parameter, ...]
    omega: FloatArray
    kinds: NDArray[np.intp]
    pairs: NDArray[np.intp]
    shared: NDArray[np.intp]

    @property
    def n(self) -> int:
        """Number of joint DOFs."""
        return int(self.pairs.max()) + 1

    @property
    def has_cross_terms(self) -> bool:
        """Whether a parameter couples two DOFs."""
        return bool((self.pairs[:, 0] != self.pairs[:, 1]).any())

    @property
    def is_shared(self) -> bool:
        """Whether a parameter belongs to several points."""
        return self.shared.size > len(self.parameters)

    @property
    def first(self) -> NDArray[np.intp]:
        """The first term of each parameter, shape (p,)."""
        return np.unique(self.shared, return_index=True)[1]

    @property
    def factors(self) -> ComplexArray:
        """Functions of frequency of the three kinds, shape (3, n_freq)."""
        one = np.ones_like(self.omega)
        return np.array([one, 1j * one, 1j * self.omega])

    def on_lines(self, lines: NDArray[np.intp] | slice) -> JointTerms:
        """Return the same terms on some of the lines."""
        return self._replace(omega=self.omega[lines])

    def of_dofs(self, dofs: NDArray[np.intp]) -> tuple[JointTerms, NDArray[np.intp]]:
        """Return the terms between some of the DOFs, and the numbers of their parameters."""
        place = np.full(self.n, -1)
        place[dofs] = np.arange(dofs.size)
        terms = np.flatnonzero((place[self.pairs] >= 0).all(axis=1))
        which, shared = np.unique(self.shared[terms], return_inverse=True)
        parameters = tuple(self.parameters[i] for i in which)
        return JointTerms(parameters, self.omega, self.kinds[terms], place[self.pairs[terms]], shared.ravel()), which

    def without_cross_terms(self) -> tuple[JointTerms, NDArray[np.intp]]:
        """Return the terms of single DOFs with separate parameters, and the number of the parameter of each."""
        own = np.flatnonzero(self.pairs[:, 0] == self.pairs[:, 1])
        common = self.shared[own]
        parameters = tuple(self.parameters[i] for i in common)
        return JointTerms(parameters, self.omega, self.kinds[own], self.pairs[own], np.arange(own.size)), common

    def stiffness(self, theta: FloatArray) -> ComplexArray:
        """Return K*(w) of parameters, shape (n_freq, n, n), N/m."""
        n, (a, b) = self.n, self.pairs.T
        of_kinds = np.zeros((3, n, n))
        of_kinds[self.kinds, a, b] = of_kinds[self.kinds, b, a] = theta[self.shared]
        k: ComplexArray = np.empty((self.omega.size, n, n), np.complex128)
        k.real, k.imag = of_kinds[0], of_kinds[1] + self.omega[:, None, None] * of_kinds[2]
        return k


def joint_terms(
    omega: FloatArray,
    dofs: Sequence[str],
    damping: DampingTerms | Sequence[DampingTerms],
    cross: CrossTerms,
    same: Sequence[Sequence[str]] = (),
) -> JointTerms:
    """Return the chosen terms of K*(w) = k + i h + i w c.

    Parameters
    ----------
    omega : ndarray, shape (n_freq,)
        Angular frequencies, rad/s.
    dofs : sequence of str
        Names of the n joint DOFs.
    damping : str, or sequence of str of length n
        Damping terms of all DOFs, or of each. A cross term has the terms that both its DOFs have.
    cross : {"zero", "ignore", "points", "fit"}
        Choice of symmetric cross terms: "fit" makes all of them parameters, "points" only those within a point.
    same : sequence of sequence of str
        Points with equal joints.
    """
    of_dof = [damping] * len(dofs) if isinstance(damping, str) else list(damping)
    place = {dof: i for i, dof in enumerate(dofs)}
    kept = [
        one
        for one in joint_parameters(dofs, ("k", "h", "c"), cross=cross in ("points", "fit"))
        if all(one.kind in _KINDS[of_dof[place[dof]]] for dof in (one.row, one.column))
        and (cross == "fit" or point_and_direction(one.row)[0] == point_and_direction(one.column)[0])
    ]
    shared = parameters_shared([one.name for one in kept], same)
    terms = JointTerms(
        tuple(kept),
        omega,
        np.array(["khc".index(one.kind) for one in kept], np.intp),
        np.array([(place[one.row], place[one.column]) for one in kept], np.intp),
        shared,
    )
    return terms._replace(parameters=tuple(kept[i] for i in terms.first))


class SpringJoint(JointCoordinates):
    """A joint of springs and dampers.

    Parameters
    ----------
    terms : JointTerms
        Terms of K*.
    springs : ndarray, shape (n,), optional
        Reference springs Z, N/m or N m/rad; none by default.
    """

    def __init__(self, terms: JointTerms, springs: FloatArray | None = None) -> None:
        self.terms, self.parameters, self.omega, self.n = terms, terms.parameters, terms.omega, terms.n
        self.springs = np.zeros(terms.n) if springs is None else springs
        first = terms.first
        self.dofs = terms.pairs[first, 0]
        self.is_stiffness = (terms.kinds[first] == 0) & (terms.pairs[first, 0] == terms.pairs[first, 1])

    def on_lines(self, lines: slice | NDArray[np.intp]) -> SpringJoint:
        """Return the same on some of the lines."""
        return type(self)(self.terms.on_lines(lines), self.springs)


class DiagonalJoint(SpringJoint):
    """A joint without cross terms: R_dd = a_d / (1 + i eta_d + i w tau_d); entries of R are its diagonal.

    With `by_rate` false the coordinates of damping are h and c, R_dd = a_d / (1 + i a_d h_d + i w a_d c_d), for the
    profile of their likelihood.
    """

    in_compliance = True

    def __init__(self, terms: JointTerms, springs: FloatArray | None = None, *, by_rate: bool = True) -> None:
        super().__init__(terms, springs)
        self.by_rate = by_rate
        self.rows, self.columns = np.diag_indices(terms.n)
        self.rates = np.flatnonzero(terms.kinds > 0)
        p, fastest = len(terms.parameters), max(float(terms.omega.max()), TINY)
        self.rate_of_one = np.where(terms.kinds[self.rates] == 1, 1.0, 1 / fastest)
        self.largest_rate = np.where(terms.kinds[self.rates] == 1, _LARGEST_RATE, _LARGEST_RATE / fastest)
        self.upper = np.full(p, np.inf)
        if by_rate:
            self.upper[self.rates] = self.largest_rate
        self.lower = np.where(terms.kinds > 0, -self.upper, 0.0)

    def _turn(self, x: FloatArray) -> ComplexArray:
        """Return 1/(1 + i eta + i w tau) of each DOF, shape (n_freq, n)."""
        whole = np.ones((self.terms.omega.size, self.terms.n), np.complex128)
        for i in self.rates:
            rate = x[i] if self.by_rate else x[i] * x[self.dofs[i]]
            whole.imag[:, self.dofs[i]] += rate if self.terms.kinds[i] == 1 else rate * self.terms.omega
        return 1 / whole

    def compliance(self, x: FloatArray) -> ComplexArray:
        """Return the diagonal of R, shape (n_freq, n)."""
        diagonal: ComplexArray = x[: self.terms.n] * self._turn(x)
        return diagonal

    def slope(self, x: FloatArray, entries: ComplexArray) -> ComplexArray:
        """Return the derivatives of the diagonal, shape (n_freq, n, p)."""
        turn, factors = self._turn(x), self.terms.factors
        slope = np.zeros((*entries.shape, x.size), np.complex128)
        d = np.arange(self.terms.n)
        slope[:, d, d] = turn if self.by_rate else turn**2
        for i in self.rates:
            own = self.dofs[i]
            last = turn[:, own] if self.by_rate else entries[:, own]
            slope[:, own, i] = -factors[self.terms.kinds[i]] * entries[:, own] * last
        return slope

    def on_lines(self, lines: slice | NDArray[np.intp]) -> DiagonalJoint:
        """Return the same on some of the lines."""
        return DiagonalJoint(self.terms.on_lines(lines), self.springs, by_rate=self.by_rate)

    def theta(self, x: FloatArray) -> FloatArray:
        """Return k = 1/a - z, h = eta/a, c = tau/a; infinite for a rigid DOF."""
        with np.errstate(divide="ignore", invalid="ignore"):
            theta: FloatArray = np.where(self.terms.kinds > 0, x, 1.0) / x[self.dofs]
        theta[self.is_stiffness] -= self.springs
        if not self.by_rate:
            theta[self.rates] = x[self.rates]
        return theta

    def coordinates(self, theta: FloatArray) -> FloatArray:
        """Return a, eta and tau, inside their limits."""
        k = theta[self.dofs] + self.springs[self.dofs]
        x = np.divide(np.where(self.terms.kinds > 0, theta, 1.0), k, out=np.zeros_like(k), where=np.isfinite(k))
        if not self.by_rate:
            x = np.where(self.terms.kinds > 0, theta, x)
        inside: FloatArray = np.clip(np.nan_to_num(x), self.lower, self.upper)
        return inside

    def theta_slope(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of the parameters by a, eta, tau, shape (p, p)."""
        p = x.size
        slope, a = np.zeros((p, p)), x[self.dofs]
        with np.errstate(divide="ignore", invalid="ignore"):
            slope[np.arange(p), self.dofs] = -np.where(self.terms.kinds > 0, x, 1.0) / a**2
            slope[self.rates, self.rates] = 1 / a[self.rates]
        if not self.by_rate:
            slope[self.rates] = np.eye(p)[self.rates]
        return slope

    def line_parts(
        self, x: FloatArray, entries: ComplexArray, weight: ComplexArray, residual: ComplexArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return Re(J^H r) and Re(J^H W J) of each line: each coordinate moves one entry."""
        own = self.slope(x, entries)[:, self.dofs, np.arange(self.dofs.size)]
        adjoint = own.conj()
        weighted = adjoint[:, :, None] * weight[:, self.dofs[:, None], self.dofs] * own[:, None, :]
        return (adjoint * residual[:, self.dofs]).real, weighted.real

    @property
    def kernel_terms(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """DOF of each coordinate, counted from 1, and its kind, as arguments of the kernel."""
        return (self.dofs + 1).astype(np.int32), self.terms.kinds.astype(np.int32)

    def minimise(
        self, forms: LineForms, start: FloatArray, held: int | None = None, least_gain: float = LEAST_GAIN
    ) -> FormMinimum:
        """Minimise quadratic forms in the kernel."""
        return self._minimised("fit_diagonal_joint", forms, start, held, least_gain)

    def lowest(
        self, forms: LineForms, start: FloatArray, held: int | None = None, least_gain: float = LEAST_GAIN
    ) -> FormMinimum:
        """Minimise; if a DOF ends rigid or with damping only, also from no damping and from some."""
        return self._minimised("lowest_diagonal_joint", forms, start, held, least_gain)

    def _minimised(
        self, routine: str, forms: LineForms, start: FloatArray, held: int | None, least_gain: float
    ) -> FormMinimum:
        p, n_freq = start.size, len(forms.squares)
        sizes = (int(self.by_rate), self.n, p, n_freq, STEPS, 0 if held is None else held + 1)
        x, information, gradient = np.array(start, np.float64), np.empty((p, p)), np.empty(p)
        lines = (self.omega, *map(np.ascontiguousarray, forms))
        args = (*sizes, least_gain, *self.kernel_terms, self.lower, self.upper, *lines, x, information, gradient)
        cost, _ = call_for_number(routine, args)
        return FormMinimum(x, cost, information, gradient, forms, self)

    def linearisation_point(self, minimum: FormMinimum, x: FloatArray) -> FloatArray:
        """Return coordinates for a linearisation: rigidity and rates are limited to the resolution of the data."""
        n, own = self.n, self.is_compliance[: self.n]
        error = np.sqrt(np.maximum(np.diagonal(minimum.covariance), TINY))
        hardly = own & ~(error[:n] <= _HARDLY * x[:n])
        of_rate = hardly[self.dofs[n:]]
        at = x.copy()
        if hardly.any():
            # Size of C itself: if a DOF is mostly damping, the compliance alone may be arbitrary.
            size = abs(self.compliance(x)).mean(axis=0)
            at[n:][of_rate] = 0.0
            slope = self.slope(at, self.compliance(at))
            known = np.r_[np.ones(n, bool), ~of_rate]
            information = (slope.conj().swapaxes(1, 2) @ minimum.forms.weight @ slope).real.sum(axis=0)
            error = np.sqrt(np.maximum(np.diagonal(inverse_information(2 * information[np.ix_(known, known)])), 0))
            at[:n] = np.where(hardly, np.maximum(size, error[:n]), x[:n])
        at[:n] = np.maximum(at[:n], np.where(own & np.isfinite(error[:n]), error[:n], 0))
        at[n:] = np.where(of_rate, np.clip(x[n:], -self.rate_of_one, self.rate_of_one), x[n:])
        return at

    def may_be_rigid(self, i: int) -> bool:
        """Return whether the coordinate of a parameter's DOF is its compliance."""
        return bool(self.is_compliance[self.dofs[i]])

    def has_profile(self, i: int, x: FloatArray, covariance: FloatArray) -> bool:
        """Return whether the compliance of a parameter's DOF has a large error."""
        a = self.dofs[i]
        return bool(np.sqrt(max(covariance[a, a], 0)) > _CURVED * x[a])

    def of_profile(self, i: int) -> DiagonalJoint:
        """Return the coordinates of a profile: h or c instead of the rate for a damping parameter."""
        if self.is_stiffness[i] == self.by_rate:
            return self
        return DiagonalJoint(self.terms, self.springs, by_rate=not self.by_rate)

    def end(self, i: int, sign: int) -> float:
        """Return the limit of a parameter: a stiffness is infinite if its compliance may be zero."""
        return sign * np.inf if not self.is_stiffness[i] else (np.inf if sign < 0 else 0.0)


class CoupledJoint(SpringJoint):
    """A joint with cross terms or equal points: coordinates are the parameters, entries the upper triangle of R."""

    def __init__(self, terms: JointTerms, springs: FloatArray | None = None) -> None:
        super().__init__(terms, springs)
        self.rows, self.columns = np.triu_indices(terms.n)
        self.pairs, place = np.unique(terms.pairs, axis=0, return_inverse=True)
        self.pair_of = place.ravel()
        # Places of R in (R E R)_rc = R_ra R_cb + R_rb R_ca of the upper triangle by pairs a, b; once where a = b.
        n, r, c = terms.n, self.rows[:, None], self.columns[:, None]
        a, b = self.pairs.T
        self._left, self._right = r * n + a, c * n + b
        self._crossed = np.flatnonzero(a != b)
        a, b = self.pairs[self._crossed].T
        self._other_left, self._other_right = r * n + b, c * n + a
        self.lower = np.full(len(terms.parameters), -np.inf)
        self.upper = -self.lower

    def compliance(self, x: FloatArray) -> ComplexArray:
        """Return the upper triangle of R, shape (n_freq, n (n + 1)/2); NaN where K* + Z is singular."""
        return invert(self.terms.stiffness(x) + np.diag(self.springs), on_singular="nan")[:, self.rows, self.columns]

    def _by_pair(self, entries: ComplexArray) -> ComplexArray:
        """Return R E R of each pair of DOFs, upper triangle, shape (n_freq, n (n + 1)/2, m)."""
        flat = self.matrix(entries).reshape(len(entries), -1)
        by_pair: ComplexArray = flat.take(self._left, axis=1)
        by_pair *= flat.take(self._right, axis=1)
        other = flat.take(self._other_left, axis=1)
        other *= flat.take(self._other_right, axis=1)
        by_pair[:, :, self._crossed] += other
        return by_pair

    def slope(self, x: FloatArray, entries: ComplexArray) -> ComplexArray:
        """Return the derivatives of the upper triangle, -R E R, shape (n_freq, n (n + 1)/2, p)."""
        slope: ComplexArray = self._by_pair(entries)[:, :, self.pair_of]
        slope *= -self.terms.factors[self.terms.kinds].T[:, None, :]
        return summed_terms(slope, self.terms.shared)

    def normal_equations(
        self, x: FloatArray, entries: ComplexArray, weight: ComplexArray, residual: ComplexArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return Re(J^H W J) and Re(J^H r) of all lines."""
        terms = self.terms
        return _of_triangle(terms.pairs, terms.factors[terms.kinds], entries, weight, residual, terms.shared)

    def theta(self, x: FloatArray) -> FloatArray:
        """Return the parameters."""
        return x

    def coordinates(self, theta: FloatArray) -> FloatArray:
        """Return the parameters."""
        return theta

    def theta_slope(self, x: FloatArray) -> FloatArray:
        """Return the unit matrix."""
        return np.eye(x.size)


def summed_terms(terms: NumbersT, shared: NDArray[np.intp]) -> NumbersT:
    """Return sums along the last axis over the terms that are one parameter."""
    count = int(shared.max(initial=-1)) + 1
    return terms if count == shared.size else terms @ np.eye(count)[shared]


def _of_triangle(
    pairs: NDArray[np.intp],
    slopes: ComplexArray,
    entries: ComplexArray,
    weight: ComplexArray,
    residual: ComplexArray,
    shared: NDArray[np.intp],
) -> tuple[FloatArray, FloatArray]:
    """Return Re(J^H W J) and Re(J^H r) of all lines, J = -f R E R of the upper triangle of R.

    Parameters
    ----------
    pairs : ndarray of int, shape (q, 2)
        Entry of K* that each term changes, with its mirror image.
    slopes : ndarray, shape (q, n_freq)
        Factor f of each term.
    entries, weight, residual
        Upper triangle of R, weights and residuals of all lines.
    shared : ndarray of int, shape (q,)
        Coordinate of each term.
    """
    p, (n_freq, u) = len(pairs), entries.shape
    normal, descent = np.empty((p, p)), np.empty(p)
    rows, columns = np.ascontiguousarray(pairs.T + 1, np.int32)
    lines = map(np.ascontiguousarray, (slopes.T, entries, weight, residual))
    call("joint_normal_equations", (math.isqrt(2 * u), p, u, n_freq, rows, columns, *lines, normal, descent))
    return summed_terms(summed_terms(normal, shared).T, shared), summed_terms(descent, shared)


def coordinates_of(terms: JointTerms, springs: FloatArray | None = None) -> SpringJoint:
    """Return the coordinates in which a joint of springs is fitted, with reference springs."""
    return (CoupledJoint if terms.has_cross_terms or terms.is_shared else DiagonalJoint)(terms, springs)


class LawCoordinates(JointCoordinates):
    """The compliance of a joint of laws as a function of the coordinates of its parameters.

    Parameters
    ----------
    joint : LawJoint
        Joint without masses; rigid DOFs have no compliance. Its values are initial values.
    omega : ndarray, shape (n_freq,)
        Angular frequencies, rad/s.
    size : ndarray, shape (n,)
        Dynamic stiffness of the structure at the joint DOFs, N/m: the scale of the stiffnesses sought.
    shared : ndarray of int, shape (q,), optional
        Parameter of each value of `joint`, for points with equal joints; by default all are separate.

    Notes
    -----
    Entries are the upper triangle of C. The coordinate of a positive stiffness or time is its logarithm.
    """

    def __init__(
        self,
        joint: LawJoint,
        omega: FloatArray,
        size: FloatArray,
        shared: NDArray[np.intp] | None = None,
    ) -> None:
        self.joint, self.omega, self.size, self.n = joint, omega, size, len(joint.dofs)
        self.springs = np.zeros(self.n)
        self.shared = np.arange(len(joint.quantities)) if shared is None else shared
        first = np.unique(self.shared, return_index=True)[1].tolist()
        self.parameters = tuple(joint.quantities[i] for i in first)
        every = joint_vector(joint, (), size).all
        self.vector = ParameterVector(tuple(every[i] for i in first))
        self.lower, self.upper = self.vector.bounds
        self.rows, self.columns = np.triu_indices(self.n)
        self.dofs, self.is_stiffness = np.zeros(self.lower.size, np.intp), np.zeros(self.lower.size, bool)

    def _at(self, x: FloatArray) -> LawJoint:
        return self.joint.with_values(self.vector.to_values(x)[self.shared])

    def common(self, values: FloatArray) -> FloatArray:
        """Return values of the parameters from values of all points: means over equal points."""
        return np.asarray(np.bincount(self.shared, values) / np.bincount(self.shared))

    def compliance(self, x: FloatArray) -> ComplexArray:
        """Return the upper triangle of C, shape (n_freq, n (n + 1)/2); NaN where K* is singular."""
        c = self._at(x).compliance(self.omega / (2 * np.pi), on_singular="nan")
        return np.ascontiguousarray(c[:, self.rows, self.columns])

    def slope(self, x: FloatArray, entries: ComplexArray) -> ComplexArray:
        """Return its derivatives by the coordinates, -C dK C, shape (n_freq, n (n + 1)/2, p)."""
        c = self.matrix(entries)
        slope = np.zeros((*entries.shape, x.size), np.complex128)
        for i, (places, by_value) in zip(self.shared, self._at(x).connection_slopes(self.omega), strict=True):
            for a, b in places:
                slope[:, :, i] -= c[:, self.rows, a] * c[:, b, self.columns] * by_value[:, None]
        slope *= self.vector.slope(x)
        return slope

    def normal_equations(
        self, x: FloatArray, entries: ComplexArray, weight: ComplexArray, residual: ComplexArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return Re(J^H W J) and Re(J^H r) of all lines."""
        slopes = self._at(x).connection_slopes(self.omega)
        pairs = np.array([places[0] for places, _ in slopes], np.intp)
        by_coordinate = np.array([by_value for _, by_value in slopes], np.complex128)
        by_coordinate *= self.vector.slope(x)[self.shared, None]
        return _of_triangle(pairs, by_coordinate, entries, weight, residual, self.shared)

    def on_lines(self, lines: slice | NDArray[np.intp]) -> LawCoordinates:
        """Return the same on some of the lines."""
        return LawCoordinates(self.joint, self.omega[lines], self.size, self.shared)

    def theta(self, x: FloatArray) -> FloatArray:
        """Return the parameters."""
        return self.vector.to_values(x)

    def coordinates(self, theta: FloatArray) -> FloatArray:
        """Return the coordinates of parameters."""
        return self.vector.to_coordinates(theta)

    def theta_slope(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of the parameters by the coordinates, shape (p, p)."""
        return np.diag(self.vector.slope(x))

    def has_profile(self, i: int, x: FloatArray, covariance: FloatArray) -> bool:
        """Return whether its interval needs a profile, as the interval of every parameter of a law does."""
        return True

    def value(self, i: int, x: FloatArray) -> float:
        """Return one of the parameters."""
        return self.vector.value(i, x)

    def end(self, i: int, sign: int) -> float:
        """Return the limit of a parameter whose coordinate is unbounded below (-1) or above (1)."""
        return self.vector.end(i, sign)

    def longest_reach(self, i: int) -> float:
        """Return the largest distance from a minimum for the first search of a limit."""
        return self.vector.longest_reach(i)
