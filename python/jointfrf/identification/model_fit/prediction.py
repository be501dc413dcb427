"""FRFs of an assembly between its channels, and their derivatives by every parameter."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.model_fit.assembly import Assembly, assembly_connection, attachment_factors, places_of
from jointfrf.identification.model_fit.reduced import ReducedSlope, ReducedSubstructure, SubstructureState
from jointfrf.identification.model_fit.unknowns import ParameterVector
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law_joint import Connection
from jointfrf.substructuring.connection import connection_matrix

__all__ = ["Prediction"]


class _Coupled(NamedTuple):
    """FRFs, and what their derivatives are made of.

    Attributes
    ----------
    y : ndarray, shape (n_freq, n_o, n_i)
        Without gains, m/N.
    out, into : ndarray, shapes (n_freq, n_o, m), (n_freq, m, n_i)
        dY = out dH into.
    link : Connection
    across_out, across_in : ndarray, shapes (n_freq, n_o, q), (n_freq, q, n_i)
        dY = -across_out dT across_in.
    """

    y: ComplexArray
    out: ComplexArray
    into: ComplexArray
    link: Connection
    across_out: ComplexArray
    across_in: ComplexArray


class Prediction:
    """The FRFs of an assembly as a function of all its parameters.

    Parameters
    ----------
    whole : Assembly
    freq_hz : ndarray, shape (n_freq,)
    responses, forces : sequence of str
        DOFs ``"A/..."``, ``"B/..."`` of the channels.
    """

    def __init__(self, whole: Assembly, freq_hz: FloatArray, responses: Sequence[str], forces: Sequence[str]) -> None:
        self.whole, self.freq_hz, self.omega = whole, freq_hz, 2 * np.pi * freq_hz
        self.places = places_of(whole, responses, forces)
        self.responses, self.forces = self.places.at(responses), self.places.at(forces)
        self.sides = (
            ReducedSubstructure("A", whole.a, freq_hz, self.places.a),
            ReducedSubstructure("B", whole.b, freq_hz, self.places.b),
        )

    def joint_stiffness(self) -> FloatArray:
        """Return the median over the lines of |(H_jj + H_kk)_dd|^-1, the size of stiffness that FRFs can show."""
        n = len(self.whole.joint.dofs)
        size = [abs(side.at(side.part.nominal).h[:, range(n), range(n)]) for side in self.sides]
        found: FloatArray = np.median(1 / (size[0] + size[1]), axis=0)
        return found

    def of_joint(
        self, vector: ParameterVector, values: FloatArray, lines: NDArray[np.intp]
    ) -> Callable[[FloatArray], ComplexArray]:
        """Return the FRFs of some lines as a function of values of which only those of the joint change."""
        link, states = self._parts(vector, values)
        h, omega, own = _together(states)[lines], self.omega[lines], vector.places_of("joint")
        gains, e = self._gains(vector, values), link.pattern
        to_out, to_in = h[:, self.responses] @ e, e.T @ h[:, :, self.forces]
        free, between = h[:, self.responses][:, :, self.forces], e.T @ h @ e
        s, t = link.s[lines], link.t[lines]
        q = self.whole.joint.connection(omega[:1]).pattern.shape[1]

        def frfs(changed: FloatArray) -> ComplexArray:
            joint = self.whole.joint.with_values(changed[own]).connection(omega)
            t[:, :q, :q] = joint.t
            with np.errstate(all="ignore"):
                w = np.linalg.solve(s + t @ between, t)
            return (free - to_out @ w @ to_in) * gains

        return frfs

    def frfs(self, vector: ParameterVector, values: FloatArray) -> ComplexArray:
        """Return the FRFs for values of all parameters, shape (n_freq, n_o, n_i), m/N."""
        link, states = self._parts(vector, values)
        h = _together(states)
        w = connection_matrix(h, link, self.freq_hz, "nan")
        across_out = h[:, self.responses] @ link.pattern
        across_in = link.pattern.T @ h[:, :, self.forces]
        y = h[:, self.responses][:, :, self.forces] - across_out @ w @ across_in
        return y * self._gains(vector, values)

    def linearised(self, vector: ParameterVector, values: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return the FRFs and their derivatives by the free values, shape (p, n_freq, n_o, n_i)."""
        link, states = self._parts(vector, values)
        coupled = self._coupled(link, states)
        gains = self._gains(vector, values)
        slopes = np.zeros((len(vector.all), *coupled.y.shape), np.complex128)
        self._joint_slopes(vector, values, coupled, slopes)
        self._model_slopes(vector, values, coupled, states, slopes)
        slopes *= gains
        for i in vector.places_of("response"):
            row = int(vector.all[i].place[0])
            slopes[i, :, row] = (coupled.y * gains)[:, row] / values[i]
        for i in vector.places_of("force"):
            column = int(vector.all[i].place[0])
            slopes[i, :, :, column] = (coupled.y * gains)[:, :, column] / values[i]
        return coupled.y * gains, slopes[vector.free]

    def refine(self, vector: ParameterVector, values: FloatArray) -> bool:
        """Return whether a basis had to be extended to be good for these values."""
        done = [side.refine(self._of_side(vector, values, name)) for side, name in zip(self.sides, "AB", strict=True)]
        return any(done)

    def _of_side(self, vector: ParameterVector, values: FloatArray, name: str) -> dict[str, float]:
        origin = "A" if name == "A" else "B"
        return {str(vector.all[i].place[0]): float(values[i]) for i in vector.places_of(origin)}  # type: ignore[arg-type]

    def _parts(self, vector: ParameterVector, values: FloatArray) -> tuple[Connection, tuple[SubstructureState, ...]]:
        """Return connections and substructures for values of all parameters."""
        joint = self.whole.joint.with_values(values[vector.places_of("joint")])
        numbers: list[list[float]] = [[] for _ in self.whole.attachments]
        for i in vector.places_of("attachment"):
            numbers[int(vector.all[i].place[0])].append(float(values[i]))
        link = assembly_connection(self.whole, self.places, self.omega, joint, numbers)
        states = [side.at(self._of_side(vector, values, name)) for side, name in zip(self.sides, "AB", strict=True)]
        return link, tuple(states)

    def _coupled(self, link: Connection, states: tuple[SubstructureState, ...]) -> _Coupled:
        h, e = _together(states), link.pattern
        w = connection_matrix(h, link, self.freq_hz, "nan")
        to_out, to_in = h[:, self.responses] @ e, e.T @ h[:, :, self.forces]
        unit = np.eye(h.shape[1])
        out = unit[self.responses] - (to_out @ w) @ e.T
        into = unit[:, self.forces] - e @ (w @ to_in)
        y = h[:, self.responses][:, :, self.forces] - to_out @ w @ to_in
        return _Coupled(y, out, into, link, out @ (h @ e), (e.T @ h) @ into)

    def _gains(self, vector: ParameterVector, values: FloatArray) -> FloatArray:
        rows, columns = np.ones(len(self.responses)), np.ones(len(self.forces))
        for i in vector.places_of("response"):
            rows[int(vector.all[i].place[0])] = values[i]
        for i in vector.places_of("force"):
            columns[int(vector.all[i].place[0])] = values[i]
        return np.outer(rows, columns)

    def _joint_slopes(
        self, vector: ParameterVector, values: FloatArray, coupled: _Coupled, slopes: ComplexArray
    ) -> None:
        """Put the derivatives by joint and attachments into their places."""
        own = vector.places_of("joint")
        joint = self.whole.joint.with_values(values[own])
        changes = dict(zip(own, joint.connection_slopes(self.omega), strict=True))
        first = joint.connection(self.omega[:1]).pattern.shape[1]
        starts = first + np.concatenate([[0], np.cumsum([len(one.places) for one in self.whole.attachments])])
        for i in vector.places_of("attachment"):
            at, number = (int(place) for place in vector.all[i].place)
            one = self.whole.attachments[at]
            entries = [(int(starts[at]) + n, int(starts[at]) + n) for n in range(len(one.places))]
            changes[i] = (entries, attachment_factors(one, self.omega)[number])
        for i, (entries, slope) in changes.items():
            if vector.all[i].is_free:
                for row, column in entries:
                    left = coupled.across_out[:, :, row] * slope[:, None]
                    slopes[i] -= left[:, :, None] * coupled.across_in[:, column, None, :]

    def _model_slopes(
        self,
        vector: ParameterVector,
        values: FloatArray,
        coupled: _Coupled,
        states: tuple[SubstructureState, ...],
        slopes: ComplexArray,
    ) -> None:
        """Put the derivatives by unknowns of the models into their places."""
        first = 0
        for side, state, name in zip(self.sides, states, "AB", strict=True):
            own = slice(first, first + len(side.dofs))
            first = own.stop
            places = [i for i in vector.places_of("A" if name == "A" else "B") if vector.all[i].is_free]
            if not places:
                continue
            names = [str(vector.all[i].place[0]) for i in places]
            of_side = side.slopes(self._of_side(vector, values, name), names)
            left = coupled.out[:, :, own] @ state.x
            right = state.x.swapaxes(1, 2) @ coupled.into[:, own]
            assert state.matrices is not None
            for i, slope in zip(places, of_side, strict=True):
                slopes[i] = _by_slope(slope, state.matrices.eta, self.omega, left, right)
                if slope.ports is not None:
                    slopes[i] += coupled.out[:, :, own] @ (slope.ports @ right)
                    slopes[i] += (left @ slope.ports.T) @ coupled.into[:, own]


def _together(states: tuple[SubstructureState, ...]) -> ComplexArray:
    a, b = (state.h for state in states)
    n_a, n = a.shape[1], a.shape[1] + b.shape[1]
    h = np.zeros((len(a), n, n), np.complex128)
    h[:, :n_a, :n_a], h[:, n_a:, n_a:] = a, b
    return h


def _by_slope(
    slope: ReducedSlope, eta: float, omega: FloatArray, left: ComplexArray, right: ComplexArray
) -> ComplexArray:
    """Return -left dZ right, dZ = (1 + i eta) dK + i K d(eta) - w^2 dM + i w dC + i dH, shape (n_freq, n_o, n_i)."""
    parts = (
        (slope.k, np.full(omega.size, 1 + 1j * eta)),
        (slope.eta, np.full(omega.size, 1j)),
        (slope.m, -(omega**2) + 0j),
        (slope.c, 1j * omega),
        (slope.h, np.full(omega.size, 1j)),
    )
    total = np.zeros((omega.size, left.shape[1], right.shape[2]), np.complex128)
    for matrix, factor in parts:
        if matrix is not None:
            middle = left * matrix if matrix.ndim == 1 else _times(left, matrix)
            total -= factor[:, None, None] * (middle @ right)
    return total


def _times(left: ComplexArray, matrix: FloatArray) -> ComplexArray:
    """Return left @ matrix as one product of all lines."""
    found: ComplexArray = left.reshape(-1, left.shape[2]) @ matrix.astype(complex)
    return found.reshape(left.shape)
