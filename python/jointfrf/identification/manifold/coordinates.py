"""K*(w) of a joint, and its compliance as a function of coordinates in which a fit is well behaved.

A joint of springs without cross terms is fitted in the compliance a = 1/k and the rates eta = h/k and tau = c/k of each
DOF: regular for a rigid DOF, a = 0, where k runs to infinity. One with cross terms is fitted in the entries of K*, one
of laws in their parameters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import Parameter, ParameterKind, joint_parameters
from jointfrf.identification.parameters import ParameterVector, joint_vector
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert
from jointfrf.laws.law_joint import LawJoint

__all__ = [
    "CoupledJoint",
    "CrossTerms",
    "DampingTerms",
    "DiagonalJoint",
    "JointCoordinates",
    "JointTerms",
    "LawCoordinates",
    "joint_terms",
    "terms_of",
]

#: Terms of K* beside its stiffness.
DampingTerms = Literal["none", "viscous", "hysteretic", "both"]
#: Terms that couple the DOFs of a joint: none, and this is used; perhaps, but not sought; fitted.
CrossTerms = Literal["zero", "ignore", "fit"]

_KINDS: Mapping[DampingTerms, tuple[ParameterKind, ...]] = {
    "none": ("k",),
    "viscous": ("k", "c"),
    "hysteretic": ("k", "h"),
    "both": ("k", "h", "c"),
}
#: Rates eta and w tau are limited: K* is then damping only.
_LARGEST_RATE = 100.0


class JointTerms(NamedTuple):
    """K*(w) as a sum of parameters times a function of frequency times a symmetric pair of DOFs.

    Attributes
    ----------
    parameters : tuple of Parameter, length p
        By kind, k before h before c, and within a kind the diagonal first.
    omega : ndarray, shape (n_freq,)
        rad/s.
    kinds : ndarray of int, shape (p,)
        0, 1, 2 for k, h, c: the functions of frequency 1, i, i w.
    pairs : ndarray of int, shape (p, 2)
        Row and column of each parameter in K*.
    """

    parameters: tuple[Parameter, ...]
    omega: FloatArray
    kinds: NDArray[np.intp]
    pairs: NDArray[np.intp]

    @property
    def n(self) -> int:
        """Number of joint DOFs."""
        return int(self.pairs.max()) + 1

    @property
    def has_cross_terms(self) -> bool:
        """Whether a parameter couples two DOFs."""
        return bool((self.pairs[:, 0] != self.pairs[:, 1]).any())

    @property
    def factors(self) -> ComplexArray:
        """Functions of frequency of the three kinds, shape (3, n_freq)."""
        one = np.ones_like(self.omega)
        return np.array([one, 1j * one, 1j * self.omega])

    def on_lines(self, lines: NDArray[np.intp] | slice) -> JointTerms:
        """Return the same terms on some of the lines."""
        return self._replace(omega=self.omega[lines])

    def of_dofs(self, dofs: NDArray[np.intp]) -> tuple[JointTerms, NDArray[np.intp]]:
        """Return the terms between some of the DOFs, and which of the parameters these are."""
        which = np.flatnonzero(np.isin(self.pairs, dofs).all(axis=1))
        pairs = np.searchsorted(dofs, self.pairs[which])
        own = JointTerms(tuple(self.parameters[i] for i in which), self.omega, self.kinds[which], pairs)
        return own, which

    def stiffness(self, theta: FloatArray) -> ComplexArray:
        """Return K*(w) of parameters, shape (n_freq, n, n), N/m."""
        n, (a, b) = self.n, self.pairs.T
        of_kinds = np.zeros((3, n, n))
        of_kinds[self.kinds, a, b] = of_kinds[self.kinds, b, a] = theta
        k: ComplexArray = np.empty((self.omega.size, n, n), np.complex128)
        k.real, k.imag = of_kinds[0], of_kinds[1] + self.omega[:, None, None] * of_kinds[2]
        return k


def joint_terms(
    omega: FloatArray, dofs: Sequence[str], damping: DampingTerms | Sequence[DampingTerms], cross: CrossTerms
) -> JointTerms:
    """Return the terms of K*(w) = k + i h + i w c asked for.

    Parameters
    ----------
    omega : ndarray, shape (n_freq,)
        rad/s.
    dofs : sequence of str
        Names of the n joint DOFs.
    damping : str, or sequence of str of length n
        Damping terms of all DOFs, or of each. A cross term has those that both its DOFs have.
    cross : {"zero", "ignore", "fit"}
        Symmetric cross terms are parameters where it is "fit".
    """
    of_dof = [damping] * len(dofs) if isinstance(damping, str) else list(damping)
    place = {dof: i for i, dof in enumerate(dofs)}
    kept = [
        one
        for one in joint_parameters(dofs, ("k", "h", "c"), cross=cross == "fit")
        if all(one.kind in _KINDS[of_dof[place[dof]]] for dof in (one.row, one.column))
    ]
    return JointTerms(
        tuple(kept),
        omega,
        np.array(["khc".index(one.kind) for one in kept], np.intp),
        np.array([(place[one.row], place[one.column]) for one in kept], np.intp),
    )


class JointCoordinates(Protocol):
    """The compliance C = K*^-1 of a joint as a function of coordinates x of length p, one for each parameter.

    Attributes
    ----------
    lower, upper : ndarray, shape (p,)
        Smallest and largest value of each coordinate.
    """

    lower: FloatArray
    upper: FloatArray

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""

    def compliance(self, x: FloatArray) -> ComplexArray:
        """Return the entries of C that the coordinates change, shape (n_freq, q)."""

    def slope(self, x: FloatArray, entries: ComplexArray) -> ComplexArray:
        """Return their derivatives by the coordinates, shape (n_freq, q, p)."""

    def on_lines(self, lines: slice) -> JointCoordinates:
        """Return the same on some of the lines."""

    def theta(self, x: FloatArray) -> FloatArray:
        """Return the parameters, shape (p,)."""

    def coordinates(self, theta: FloatArray) -> FloatArray:
        """Return the coordinates of parameters."""

    def theta_slope(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of the parameters by the coordinates, shape (p, p)."""


class DiagonalJoint:
    """A joint without cross terms: C_dd = a_d / (1 + i eta_d + i w tau_d); entries of C are its diagonal.

    With `by_rate` false the coordinates of damping are h and c themselves, C_dd = a_d / (1 + i a_d h_d + i w a_d
    c_d): for the profile of their likelihood.
    """

    def __init__(self, terms: JointTerms, *, by_rate: bool = True) -> None:
        self.terms = terms
        self.by_rate = by_rate
        self.dofs = terms.pairs[:, 0]
        self.rates = np.flatnonzero(terms.kinds > 0)
        p, fastest = len(terms.parameters), max(float(terms.omega.max()), np.finfo(float).tiny)
        self.largest_rate = np.where(terms.kinds[self.rates] == 1, _LARGEST_RATE, _LARGEST_RATE / fastest)
        self.upper = np.full(p, np.inf)
        if by_rate:
            self.upper[self.rates] = self.largest_rate
        self.lower = np.where(terms.kinds > 0, -self.upper, 0.0)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(one.name for one in self.terms.parameters)

    def _turn(self, x: FloatArray) -> ComplexArray:
        """Return 1/(1 + i eta + i w tau) of each DOF, shape (n_freq, n)."""
        whole, factors = np.ones((self.terms.omega.size, self.terms.n), np.complex128), self.terms.factors
        for i in self.rates:
            rate = x[i] if self.by_rate else x[i] * x[self.dofs[i]]
            whole[:, self.dofs[i]] += rate * factors[self.terms.kinds[i]]
        return 1 / whole

    def compliance(self, x: FloatArray) -> ComplexArray:
        """Return the diagonal of C, shape (n_freq, n)."""
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

    def on_lines(self, lines: slice) -> DiagonalJoint:
        """Return the same on some of the lines."""
        return DiagonalJoint(self.terms.on_lines(lines), by_rate=self.by_rate)

    def theta(self, x: FloatArray) -> FloatArray:
        """Return k = 1/a, h = eta/a, c = tau/a; infinite for a rigid DOF."""
        with np.errstate(divide="ignore", invalid="ignore"):
            theta: FloatArray = np.where(self.terms.kinds > 0, x, 1.0) / x[self.dofs]
        if not self.by_rate:
            theta[self.rates] = x[self.rates]
        return theta

    def coordinates(self, theta: FloatArray) -> FloatArray:
        """Return a, eta and tau, inside their limits."""
        k = theta[self.dofs]
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


class CoupledJoint:
    """A joint with cross terms: its coordinates are the parameters themselves; entries are the upper triangle of C."""

    def __init__(self, terms: JointTerms) -> None:
        self.terms = terms
        self.rows, self.columns = np.triu_indices(terms.n)
        self.pairs, place = np.unique(terms.pairs, axis=0, return_inverse=True)
        self.pair_of = place.ravel()
        # Places of C in (C E C)_rc = C_ra C_cb + C_rb C_ca of the upper triangle by pairs a, b; once where a = b.
        n, r, c = terms.n, self.rows[:, None], self.columns[:, None]
        a, b = self.pairs.T
        self._left, self._right = r * n + a, c * n + b
        self._crossed = np.flatnonzero(a != b)
        a, b = self.pairs[self._crossed].T
        self._other_left, self._other_right = r * n + b, c * n + a
        self.lower = np.full(len(terms.parameters), -np.inf)
        self.upper = -self.lower

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(one.name for one in self.terms.parameters)

    def compliance(self, x: FloatArray) -> ComplexArray:
        """Return the upper triangle of C, shape (n_freq, n (n + 1)/2); NaN where K* is singular."""
        return invert(self.terms.stiffness(x), on_singular="nan")[:, self.rows, self.columns]

    def _by_pair(self, entries: ComplexArray) -> ComplexArray:
        """Return C E C of each pair of DOFs, upper triangle, shape (n_freq, n (n + 1)/2, m)."""
        n = self.terms.n
        c = np.empty((len(entries), n, n), np.complex128)
        c[:, self.rows, self.columns] = c[:, self.columns, self.rows] = entries
        flat = c.reshape(len(c), n * n)
        by_pair: ComplexArray = flat.take(self._left, axis=1)
        by_pair *= flat.take(self._right, axis=1)
        other = flat.take(self._other_left, axis=1)
        other *= flat.take(self._other_right, axis=1)
        by_pair[:, :, self._crossed] += other
        return by_pair

    def slope(self, x: FloatArray, entries: ComplexArray) -> ComplexArray:
        """Return the derivatives of the upper triangle, -C E C, shape (n_freq, n (n + 1)/2, p)."""
        slope: ComplexArray = self._by_pair(entries)[:, :, self.pair_of]
        slope *= -self.terms.factors[self.terms.kinds].T[:, None, :]
        return slope

    def on_lines(self, lines: slice) -> CoupledJoint:
        """Return the same on some of the lines."""
        return CoupledJoint(self.terms.on_lines(lines))

    def normal_equations(
        self, x: FloatArray, entries: ComplexArray, weight: ComplexArray, residual: ComplexArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return Re(J^H W J), shape (p, p), and Re(J^H r), shape (p,), of all lines; J is the slope.

        Terms of the same pair differ by a function of frequency only: products are of pairs.
        """
        factors, by_pair = self.terms.factors, self._by_pair(entries)
        adjoint = by_pair.conj().swapaxes(1, 2)
        products = (adjoint @ (weight @ by_pair)).reshape(len(entries), -1)
        m = len(self.pairs)
        of_kinds = (factors.conj()[:, None] * factors).reshape(9, -1) @ products
        i, kinds = self.pair_of, self.terms.kinds
        information = of_kinds.real.reshape(3, 3, m, m)[kinds[:, None], kinds, i[:, None], i]
        gradient = -(factors.conj() @ (adjoint @ residual[..., None])[..., 0]).real[kinds, i]
        return information, gradient

    def theta(self, x: FloatArray) -> FloatArray:
        """Return the parameters."""
        return x

    def coordinates(self, theta: FloatArray) -> FloatArray:
        """Return the parameters."""
        return theta

    def theta_slope(self, x: FloatArray) -> FloatArray:
        """Return the unit matrix."""
        return np.eye(x.size)


def terms_of(joint: JointCoordinates) -> JointTerms:
    """Return the terms of a joint of springs and dampers."""
    assert isinstance(joint, DiagonalJoint | CoupledJoint)
    return joint.terms


class LawCoordinates:
    """The compliance of a joint of laws as a function of the coordinates of its parameters.

    Parameters
    ----------
    joint : LawJoint
        Without masses; rigid DOFs have no compliance. Its values are where a fit may start.
    omega : ndarray, shape (n_freq,)
        rad/s.
    size : ndarray, shape (n,)
        Dynamic stiffness of the structure at the joint DOFs: stiffnesses are sought around it.

    Notes
    -----
    Entries are the upper triangle of C. Stiffnesses and times that cannot be negative are sought as logarithms.
    """

    def __init__(self, joint: LawJoint, omega: FloatArray, size: FloatArray) -> None:
        self.joint, self.omega, self.size = joint, omega, size
        self.vector: ParameterVector = joint_vector(joint, (), size)
        self.lower, self.upper = self.vector.bounds
        self.rows, self.columns = np.triu_indices(len(joint.dofs))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.joint.names

    def _at(self, x: FloatArray) -> LawJoint:
        return self.joint.with_values(self.vector.to_values(x))

    def compliance(self, x: FloatArray) -> ComplexArray:
        """Return the upper triangle of C, shape (n_freq, n (n + 1)/2); NaN where K* is singular."""
        c = self._at(x).compliance(self.omega / (2 * np.pi), on_singular="nan")
        return np.ascontiguousarray(c[:, self.rows, self.columns])

    def slope(self, x: FloatArray, entries: ComplexArray) -> ComplexArray:
        """Return its derivatives by the coordinates, -C dK C, shape (n_freq, n (n + 1)/2, p)."""
        n = len(self.joint.dofs)
        c = np.empty((len(entries), n, n), np.complex128)
        c[:, self.rows, self.columns] = c[:, self.columns, self.rows] = entries
        slope = np.zeros((*entries.shape, x.size), np.complex128)
        for i, (places, by_value) in enumerate(self._at(x).connection_slopes(self.omega)):
            for a, b in places:
                slope[:, :, i] -= c[:, self.rows, a] * c[:, b, self.columns] * by_value[:, None]
        slope *= self.vector.slope(x)
        return slope

    def on_lines(self, lines: slice) -> LawCoordinates:
        """Return the same on some of the lines."""
        return LawCoordinates(self.joint, self.omega[lines], self.size)

    def theta(self, x: FloatArray) -> FloatArray:
        """Return the parameters."""
        return self.vector.to_values(x)

    def coordinates(self, theta: FloatArray) -> FloatArray:
        """Return the coordinates of parameters."""
        return self.vector.to_coordinates(theta)

    def theta_slope(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of the parameters by the coordinates, shape (p, p)."""
        return np.diag(self.vector.slope(x))
