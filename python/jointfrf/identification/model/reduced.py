"""A substructure reduced once: its FRFs for any values of its unknowns, and their derivatives -H dZ H."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from scipy import linalg

from jointfrf.identification.model.model_error import ModalErrors
from jointfrf.identification.model.substructure import FrfSource, Substructure, Unknown, check_same_lines
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import solve
from jointfrf.models.factors import SparseSolver
from jointfrf.models.krylov import reduce_model
from jointfrf.models.matrices import ModelMatrices, as_ports
from jointfrf.models.model import Model

__all__ = ["MatrixPolynomial", "ReducedSlope", "ReducedSubstructure", "SubstructureState", "range_of"]

#: Share of the band beyond its end up to which the basis is accurate, for models that are stiffer or lighter.
_MARGIN = 0.15
#: Tolerance of a reduction, and tolerance of its FRFs for other values of the unknowns.
_TOLERANCE, _ALLOWED = 1e-8, 1e-4
#: Relative size of a direction below which it is not new.
_NEW = 1e-9
#: Range of unknowns of a function for the basis and for the polynomials of the matrices, in standard deviations, or as
#: a share of their value without a prior; the last value is the range of the search.
_REACH, _SHARE, _RANGE = 2.5, 0.06, 2.0
#: A modal damping matrix is diagonal if no other entry exceeds this share of it.
_DIAGONAL = 1e-10
#: Number of lines at which a reduced model is compared with the model.
_SPOTS = 2
#: Number of DOFs of a model for which a direct solution costs as much as an iteration: one line.
_LARGE = 3000


class _Matrices(NamedTuple):
    """Matrices in the basis, shape (r, r), and motion of the ports in it, shape (m, r)."""

    k: FloatArray
    m: FloatArray
    c: FloatArray | None
    h: FloatArray | None
    eta: float
    ports: FloatArray


class ReducedSlope(NamedTuple):
    """Derivatives by one unknown, in modal coordinates; None if zero, shape (r,) for a diagonal.

    Attributes
    ----------
    k, m, c, h : ndarray or None
        Derivatives of the matrices.
    eta : ndarray, shape (r,), or None
        Stiffness that the loss factor multiplies, if the loss factor is the unknown.
    ports : ndarray, shape (m, r), or None
        Derivatives of the motion of the ports.
    """

    k: FloatArray | None = None
    m: FloatArray | None = None
    c: FloatArray | None = None
    h: FloatArray | None = None
    eta: FloatArray | None = None
    ports: FloatArray | None = None


class SubstructureState(NamedTuple):
    """FRFs of a substructure at some values of its unknowns.

    Attributes
    ----------
    h : ndarray, shape (n_freq, m, m)
        Receptances, m/N; 0 for those that are not requested.
    x : ndarray, shape (n_freq, m, r)
        Product P Z^-1: modal coordinates by forces at the ports; r = 0 for FRFs.
    matrices : _Matrices or None
        Matrices from which its derivatives follow.
    squared : ndarray, shape (r,)
        Squared natural frequencies w_r^2, rad^2/s^2.
    shapes : ndarray, shape (r, r)
        Modes in the basis.
    """

    h: ComplexArray
    x: ComplexArray
    matrices: _Matrices | None
    squared: FloatArray
    shapes: FloatArray


def reach_of(unknown: Unknown) -> float:
    """Return the range of an argument of a function that builds a model about its nominal value."""
    return _REACH * unknown.std if unknown.std is not None else _SHARE * max(abs(unknown.value), 1e-9)


def _box(unknown: Unknown, centre: float, share: float = 1.0) -> tuple[float, float]:
    """Return limits of an argument about a value, within its bounds: a function may raise an error beyond them."""
    reach = share * reach_of(unknown)
    return max(unknown.lower, centre - reach), min(unknown.upper, centre + reach)


def range_of(part: Substructure, name: str, unknown: Unknown) -> tuple[float, float]:
    """Return the limits of the search for an unknown of a substructure."""
    if name in part.scaled:
        return unknown.lower, unknown.upper
    widest = _RANGE * reach_of(unknown)
    return max(unknown.lower, unknown.value - widest), min(unknown.upper, unknown.value + widest)


class ReducedSubstructure:
    """A substructure between some of its DOFs.

    Parameters
    ----------
    name : str
        Name for messages, "A" or "B".
    part : Substructure
        Substructure to reduce.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    dofs : sequence of str, length m
        DOFs of its FRFs.
    between : sequence of str, optional
        DOFs of which each requested FRF has at least one: the model is reduced for forces there. All by default.
    """

    def __init__(
        self, name: str, part: Substructure, freq_hz: FloatArray, dofs: Sequence[str],
        between: Collection[str] | None = None,
    ) -> None:  # fmt: skip
        self.name, self.part, self.freq_hz, self.dofs = name, part, freq_hz, tuple(dofs)
        self._between = [i for i, dof in enumerate(dofs) if between is None or dof in between]
        self.omega = 2 * np.pi * freq_hz
        self.basis = np.zeros((0, 0))
        self.errors: ModalErrors | None = None
        self._nominal: _Matrices | None = None
        self._last: tuple[tuple[float, ...], SubstructureState] | None = None
        self._polynomial: MatrixPolynomial | None = None
        self._narrowed = 1.0
        self.noise: FloatArray | None = None
        self.is_symmetrised = False
        if isinstance(part.source, FrfSource):
            check_same_lines(name, part.source, freq_hz)
            none = np.zeros(0)
            h = part.receptance(freq_hz, self.dofs)
            if part.source.variance is not None:
                at = [part.source.dofs.index(dof) for dof in self.dofs]
                self.noise, self.is_symmetrised = part.source.variance[:, at][:, :, at], part.source.is_symmetrised
            self._last = ((), SubstructureState(h, np.zeros((*h.shape[:2], 0), complex), None, none, none[:, None]))
        else:
            self.basis = self._space(self._trials())

    @property
    def _arguments(self) -> list[str]:
        """Unknowns that are arguments of a function which builds the model."""
        return [name for name in self.part.fitted if name not in self.part.scaled]

    def _trials(self) -> list[dict[str, float]]:
        """Values for which the basis must be accurate: nominal ones, and if geometry changes, others around."""
        trials: list[dict[str, float]] = [{}]
        if not isinstance(self.part.source, Model):
            for name, unknown in self.part.unknowns.items():
                trials += [{name: limit} for limit in _box(unknown, unknown.value) if limit != unknown.value]
        return trials

    def _space(self, trials: Sequence[Mapping[str, float]]) -> FloatArray:
        """Return a basis of the motions of the models for some values, orthonormal up to the scale of each DOF."""
        n = len(self.part.nominal_model.dofs)
        if n <= len(self.dofs):  # nothing is left to reduce
            return np.eye(n)
        found = [self.basis] if self.basis.size else []
        low, high = self.freq_hz.min() * (1 - _MARGIN), self.freq_hz.max() * (1 + _MARGIN)
        band = np.linspace(low, high, min(max(self.freq_hz.size, 2), 400))
        for values in trials:
            model = self.part.model(values)
            ports = as_ports("dofs", model.ports(*(self.dofs[i] for i in self._between)), len(model.dofs))
            matrices = ModelMatrices(model.stiffness, model.mass, None, None, max(model.loss_factor, 1e-3))
            found.append(reduce_model(band, matrices, ports, ports, _TOLERANCE).shapes)
        scale = np.sqrt(np.maximum(_diagonal(self.part.nominal_model.mass), 1e-30))
        scale = np.maximum(scale, 1e-6 * scale.max())[:, None]
        if len(found) == 1:
            return found[0]
        vectors = np.hstack(found) * scale
        vectors = vectors / np.linalg.norm(vectors, axis=0)
        q, r, _ = linalg.qr(vectors, mode="economic", pivoting=True)
        kept: FloatArray = q[:, abs(np.diagonal(r)) > _NEW] / scale
        return kept

    def _reduced(self, model: Model) -> _Matrices:
        v = self.basis

        def projected(matrix: Any) -> FloatArray | None:
            if matrix is None:
                return None
            found: FloatArray = v.T @ (matrix @ v)
            return (found + found.T) / 2

        k, m = projected(model.stiffness), projected(model.mass)
        assert k is not None
        assert m is not None
        ports = as_ports("dofs", model.ports(*self.dofs), len(model.dofs)).of(v)
        return _Matrices(
            k, m, projected(model.damping), projected(model.structural_damping), model.loss_factor, np.asarray(ports)
        )

    def _unscaled(self, values: Mapping[str, float]) -> _Matrices:
        """Return the reduced matrices for unknowns that are arguments of a function."""
        arguments = [values[name] for name in self._arguments]
        if arguments:
            if self._polynomial is None:
                self._polynomial = self._polynomial_about(values)
            return self._of_arrays(self._polynomial.at(np.array(arguments)))
        if self._nominal is None:
            self._nominal = self._reduced(self.part.nominal_model)
        return self._nominal

    def _scaled(self, own: _Matrices, values: Mapping[str, float]) -> _Matrices:
        """Return the matrices with unknowns that are factors of them."""
        for name, unknown in self.part.scaled.items():
            factor = values.get(name, unknown.value) / unknown.value
            if name == "youngs_modulus":
                own = own._replace(k=own.k * factor, h=None if own.h is None else own.h * factor)
            elif name == "density":
                own = own._replace(m=own.m * factor)
            elif name in values:
                own = own._replace(eta=values[name])
        return own

    def allow_errors(self, most: int, at: Sequence[int] = ()) -> None:
        """Add errors of modal matrices, and of mode shapes at some DOFs, with at most so many terms each."""
        if not isinstance(self.part.source, FrfSource):
            own = self._unscaled(self.part.nominal)
            self.errors = ModalErrors(own.k, own.m, float(self.omega.max()), most, own.ports, at)

    def at(
        self, values: Mapping[str, float], errors: FloatArray | None = None, of_shapes: FloatArray | None = None
    ) -> SubstructureState:
        """Return the FRFs for values of all unknowns, and of the terms of `errors` if there are any."""
        given = [one if one is not None and self.errors is not None else np.zeros(0) for one in (errors, of_shapes)]
        key = (*values.values(), *given[0].tolist())
        if given[1].size:
            key = (*key, np.inf, *given[1].tolist())
        if self._last is None or self._last[0] != key:
            own = self._unscaled(values)
            if self.errors is not None and given[0].size:
                of_k, of_m = self.errors.changes(given[0])
                own = own._replace(k=own.k + of_k, m=own.m + of_m)
            if self.errors is not None and given[1].size:
                own = own._replace(ports=own.ports + self.errors.of_ports(given[1]))
            self._last = (key, self._state(self._scaled(own, values)))
        return self._last[1]

    def scales(self, values: Mapping[str, float]) -> tuple[float, float]:
        """Return the factors of stiffness and mass."""
        found = [values[name] / self.part.scaled[name].value if name in self.part.scaled else 1.0
                 for name in ("youngs_modulus", "density")]  # fmt: skip
        return found[0], found[1]

    def _state(self, matrices: _Matrices) -> SubstructureState:
        squared, shapes = linalg.eigh(matrices.k, matrices.m)
        seen = matrices.ports @ shapes
        diagonal = (1 + 1j * matrices.eta) * squared - self.omega[:, None] ** 2
        full: list[tuple[Any, Any]] = []
        for matrix, factor in ((matrices.c, 1j * self.omega), (matrices.h, 1j + 0 * self.omega)):
            if matrix is None:
                continue
            modal = shapes.T @ matrix @ shapes
            other = abs(modal - np.diag(np.diagonal(modal))).max(initial=0)
            if other <= _DIAGONAL * abs(np.diagonal(modal)).max(initial=0):
                diagonal = diagonal + factor[:, None] * np.diagonal(modal)
            else:
                full.append((factor, modal))
        if full:
            z = np.zeros((self.omega.size, squared.size, squared.size), np.complex128)
            z[:, np.arange(squared.size), np.arange(squared.size)] = diagonal
            for factor, modal in full:
                z += factor[:, None, None] * modal
            force = np.broadcast_to(seen.T.astype(complex), (self.omega.size, *seen.T.shape))
            x = solve(z, np.ascontiguousarray(force), freq_hz=self.freq_hz).swapaxes(1, 2)
            h = x @ seen.T
        else:
            of_modes = 1 / diagonal
            x = of_modes[:, None, :] * seen
            # Residues are real: two real products of all lines.
            own = seen[self._between]
            residues = (seen[:, None] * own).reshape(-1, squared.size).T
            columns = np.empty((self.omega.size, len(seen), len(own)), np.complex128)
            for into, part in ((columns.real, of_modes.real), (columns.imag, of_modes.imag)):
                into[:] = (part @ residues).reshape(into.shape)
            h = columns
            if len(own) < len(seen):
                h = np.zeros((self.omega.size, len(seen), len(seen)), np.complex128)
                h[:, self._between], h[:, :, self._between] = columns.swapaxes(1, 2), columns
        return SubstructureState(np.asarray(h), np.asarray(x), matrices, squared, shapes)

    def slopes(self, values: Mapping[str, float], names: Sequence[str], state: SubstructureState) -> list[ReducedSlope]:
        """Return the derivatives by some of the unknowns, in the modal coordinates of the state at these values."""
        return [self._slope(values, name, state) for name in names]

    def _slope(self, values: Mapping[str, float], name: str, state: SubstructureState) -> ReducedSlope:
        shapes, own = state.shapes, state.matrices
        assert own is not None
        if name in self.part.scaled:
            if name == "loss_factor":
                return ReducedSlope(eta=state.squared)
            if name == "density":
                return ReducedSlope(m=np.full(state.squared.size, 1 / values[name]))
            h = None if own.h is None else shapes.T @ own.h @ shapes / values[name]
            return ReducedSlope(k=state.squared / values[name], h=h)
        assert self._polynomial is not None
        arguments = self._arguments
        arrays = self._polynomial.slope(np.array([values[one] for one in arguments]), arguments.index(name))
        by = self._scaled(self._of_arrays(arrays), {key: one for key, one in values.items() if key != "loss_factor"})
        k, m, c, h = (
            shapes.T @ one @ shapes if one is not None and one.any() else None for one in (by.k, by.m, by.c, by.h)
        )
        eta = by.eta * state.squared if by.eta else None
        return ReducedSlope(k, m, c, h, eta, by.ports @ shapes if by.ports.any() else None)

    def _polynomial_about(self, values: Mapping[str, float], share: float = 1.0) -> MatrixPolynomial:
        """Return the reduced matrices as polynomials of the unknowns around some values."""
        names = self._arguments
        box = np.array([_box(self.part.unknowns[name], values[name], share) for name in names])

        def build(numbers: FloatArray) -> list[FloatArray]:
            own = self._reduced(self.part.model(dict(zip(names, numbers.tolist(), strict=True))))
            return [np.asarray(one, float) for one in own if one is not None]

        reach = np.maximum(np.ptp(box, axis=1) / 2, np.finfo(float).tiny)
        return MatrixPolynomial(build, box.mean(axis=1), reach)

    def _of_arrays(self, arrays: Sequence[FloatArray]) -> _Matrices:
        """Return matrices from the arrays of the model."""
        left = list(arrays)
        model = self.part.nominal_model
        k, m = left.pop(0), left.pop(0)
        c = None if model.damping is None else left.pop(0)
        h = None if model.structural_damping is None else left.pop(0)
        return _Matrices(k, m, c, h, float(left[0]), left[1])

    def refine(self, values: Mapping[str, float]) -> bool:
        """Compare with the model at a few lines; return whether the basis had to be extended."""
        if isinstance(self.part.source, FrfSource) or self._error(values) <= _ALLOWED:
            return False
        self.basis = self._space([values])
        self._nominal = self._last = None
        if self._polynomial is not None:
            self._narrowed /= 3
            self._polynomial = self._polynomial_about(values, self._narrowed)
        return True

    def _error(self, values: Mapping[str, float]) -> float:
        """Largest difference to the model at a few lines, relative to the largest entry of the line."""
        model = self.part.model(values)
        ports = as_ports("dofs", model.ports(*self.dofs), len(model.dofs))
        matrices = ModelMatrices(
            model.stiffness, model.mass, model.damping, model.structural_damping, model.loss_factor
        )
        found, worst, spots = self.at(values).h, 0.0, 1 if matrices.n > _LARGE else _SPOTS
        solver = SparseSolver()
        for line in np.unique(np.linspace(0, self.freq_hz.size - 1, spots + 2).astype(int)[1:-1]):
            factors = solver.factor(matrices.dynamic_stiffness(self.omega[line]), matrices.are_symmetric)
            exact = ports.of(factors.solve(ports.forces().astype(complex)))
            asked = found[line] != 0
            worst = max(worst, float(abs(found[line] - exact)[asked].max(initial=0) / abs(exact).max()))
        return worst


def _diagonal(matrix: Any) -> FloatArray:
    found: FloatArray = matrix.diagonal() if hasattr(matrix, "diagonal") else np.diagonal(matrix)
    return np.asarray(found, float)


#: Total degree of polynomials of one, two or three numbers, and of more.
_DEGREE, _DEGREE_OF_MANY = 5, 3
#: Number of points for each coefficient.
_POINTS = 1.6


class MatrixPolynomial:
    """Arrays as polynomials, by least squares at Chebyshev-distributed points.

    Parameters
    ----------
    build : callable
        Function ``build(values)`` that returns arrays of constant shapes; `values` has shape (u,).
    centre, reach : ndarray, shape (u,)
        Middle of the box in which the polynomials are made, and half of its sides, positive.

    Notes
    -----
    If a matrix is proportional to the third power of a length, the error is about 1e-8 for a reach of 5 %.
    """

    def __init__(
        self, build: Callable[[FloatArray], Sequence[FloatArray]], centre: FloatArray, reach: FloatArray
    ) -> None:
        self.centre, self.reach = centre, reach
        u = centre.size
        degree = _DEGREE if u <= 3 else _DEGREE_OF_MANY
        self.powers = np.array([p for p in itertools.product(range(degree + 1), repeat=u) if sum(p) <= degree])
        count = len(self.powers) + 2 if u == 1 else int(_POINTS * len(self.powers)) + u
        even = (np.arange(count) + 0.5) / count
        generator = np.random.default_rng(0)
        spread = np.stack([even if i == 0 else generator.permutation(even) for i in range(u)], axis=1)
        points = np.cos(np.pi * spread)
        built = [build(centre + reach * point) for point in points]
        self.shapes = [np.shape(one) for one in built[0]]
        flat = np.array([np.concatenate([np.ravel(one) for one in arrays]) for arrays in built])
        self.coefficients = np.linalg.lstsq(np.array([self._terms(point) for point in points]), flat, rcond=None)[0]

    def _terms(self, point: FloatArray, slope_of: int | None = None) -> FloatArray:
        """Return the terms at a point of the unit box, or their derivative by one of its coordinates."""
        terms = np.ones(len(self.powers))
        for i, x in enumerate(point):
            unit = np.eye(int(self.powers.max()) + 1)
            if i == slope_of:
                own = np.array([chebyshev.chebval(x, chebyshev.chebder(row)) for row in unit])
            else:
                own = chebyshev.chebval(x, unit)
            terms *= own[self.powers[:, i]]
        return terms

    def _arrays(self, flat: FloatArray) -> list[FloatArray]:
        found, at = [], 0
        for shape in self.shapes:
            size = int(np.prod(shape))
            found.append(flat[at : at + size].reshape(shape))
            at += size
        return found

    def at(self, values: FloatArray) -> list[FloatArray]:
        """Return the arrays."""
        return self._arrays(self._terms((values - self.centre) / self.reach) @ self.coefficients)

    def slope(self, values: FloatArray, i: int) -> list[FloatArray]:
        """Return the derivatives of the arrays by one of the numbers."""
        terms = self._terms((values - self.centre) / self.reach, i) / self.reach[i]
        return self._arrays(terms @ self.coefficients)
