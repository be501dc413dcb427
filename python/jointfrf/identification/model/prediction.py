"""FRFs of an assembly between its channels, and their derivatives by every parameter."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.line_starts import LineCompliance
from jointfrf.identification.model.assembly import (
    Assembly,
    Attachment,
    assembly_connection,
    attachment_factors,
    connection_entries,
    joint_connection,
    places_of,
)
from jointfrf.identification.model.reduced import ReducedSlope, ReducedSubstructure, SubstructureState, range_of
from jointfrf.identification.model.substructure import Unknown
from jointfrf.identification.parameters import (
    CommonMean,
    FitParameter,
    ParameterOrigin,
    ParameterVector,
    joint_vector,
    with_dampers,
)
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert
from jointfrf.laws.law_joint import Connection
from jointfrf.substructuring.coupling import connect, connection_forces, motions_across

__all__ = ["Prediction", "parameter_vector"]


class _Open(NamedTuple):
    """FRFs before the substructures are connected, which change with the models only.

    Attributes
    ----------
    h : ndarray, shape (n_freq, m, m)
        Receptances of all DOFs of the problem, m/N.
    free : ndarray, shape (n_freq, n_o, n_i)
        Receptances of the channels, m/N.
    to_out, to_in : ndarray, shapes (n_freq, n_o, q), (n_freq, q, n_i)
        Receptances from connections to responses, and from forces to connections, m/N.
    between : ndarray, shape (n_freq, q, q)
        Receptances across the connections, m/N.
    """

    h: ComplexArray
    free: ComplexArray
    to_out: ComplexArray
    to_in: ComplexArray
    between: ComplexArray


class _Coupled(NamedTuple):
    """FRFs, and factors of their derivatives.

    Attributes
    ----------
    y : ndarray, shape (n_freq, n_o, n_i)
        Receptances without gains, m/N.
    w : ndarray, shape (n_freq, q, q)
        Forces of the connections by the motions across them, N/m.
    across_out, across_in : ndarray, shapes (n_freq, n_o, q), (n_freq, q, n_i)
        Factors of dY = -across_out dT across_in.
    """

    y: ComplexArray
    w: ComplexArray
    across_out: ComplexArray
    across_in: ComplexArray


#: Errors of a part: modal matrices, mode shapes.
_MODEL_ERRORS: tuple[ParameterOrigin, ParameterOrigin] = ("error", "shape-error")
#: Gains among the parameters: their origin, the gain without an error, and whether each belongs to a response or to a
#: force; None for a gain of all FRFs.
_GAINS: tuple[tuple[ParameterOrigin, float, bool | None], ...] = (
    ("response", 0.0, True), ("force", 0.0, False), ("response-error", 1.0, True), ("force-error", 1.0, False),
    ("common-error", 1.0, None),
)  # fmt: skip


def _of_channel(number: int, of_responses: bool | None) -> tuple[slice | int, ...]:
    """Return the index of the FRFs of a gain, frequency first."""
    return () if of_responses is None else (slice(None), number) if of_responses else (slice(None), slice(None), number)


class Prediction:
    """The FRFs of an assembly as a function of all its parameters.

    Parameters
    ----------
    whole : Assembly
        Assembly.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    responses, forces : sequence of str
        DOFs ``"A/..."`` of the channels.
    """

    def __init__(self, whole: Assembly, freq_hz: FloatArray, responses: Sequence[str], forces: Sequence[str]) -> None:
        self.whole, self.freq_hz, self.omega = whole, freq_hz, 2 * np.pi * freq_hz
        self.places = places_of(whole, responses, forces)
        self.responses, self.forces = self.places.at(responses), self.places.at(forces)
        self._last: tuple[tuple[SubstructureState, ...], _Open] | None = None
        # Every requested FRF has a joint or an attachment, or both a response and a force, at its ends.
        between = {*itertools.chain(*whole.ports.ends), *itertools.chain(*(one.places for one in whole.attachments))}
        between |= {*(forces if len(forces) < len(responses) else responses)}
        self.sides = tuple(
            ReducedSubstructure(
                name,
                part,
                freq_hz,
                self.places.of[name],
                {dof for dof in self.places.of[name] if f"{name}/{dof}" in between},
            )
            for name, part in whole.parts.items()
        )

    def joint_stiffness(self) -> FloatArray:
        """Return the median over the lines of |(H_jj + H_kk)_dd|^-1, the scale of stiffness that FRFs can show."""
        size = np.concatenate([abs(np.einsum("lpp->lp", side.at(side.part.nominal).h)) for side in self.sides], axis=1)
        ports, total = self.whole.ports, np.zeros((self.omega.size, len(self.whole.joint.dofs)))
        for own in ports.ends:
            held = [i for i, dof in enumerate(own) if dof and not ports.term[i]]  # for a region its mean motion
            total[:, ports.dof[held]] += size[:, self.places.at([own[i] for i in held])] * ports.weight[held]
        found: FloatArray = np.median(1 / np.maximum(total, np.finfo(float).tiny), axis=0)
        return found

    def joint_compliance(
        self, vector: ParameterVector, smooth: ComplexArray, variance: FloatArray
    ) -> LineCompliance | None:
        """Return the compliance of the joint on each line alone, with nominal values for all further parameters.

        Parameters
        ----------
        vector : ParameterVector
            Parameters.
        smooth, variance : ndarray, shape (n_freq, n_o, n_i)
            Smooth FRFs, m/N, and noise variance of the measured ones; inf for FRFs that are zero by symmetry.

        Returns
        -------
        LineCompliance or None
            Compliance of the joint; None with fewer responses or forces than joint DOFs, or with a joint on a region.

        Notes
        -----
        Y = H_oi - H_oj W H_ji with W = (C + H_jj)^-1, where j are the motions across the joint: by least squares, rows
        and columns weighted by their noise.
        """
        n = len(self.whole.joint.dofs)
        if min(smooth.shape[1:]) < n or not self.whole.ports.is_plain:
            return None
        link, states = self._parts(vector, vector.values)
        h, e, rest = self._open(link, states).h, link.pattern[:, :n], slice(n, None)
        if link.pattern.shape[1] > n:  # masses and attachments
            h = connect(h, Connection(link.pattern[:, rest], link.s[:, rest, rest], link.t[:, rest, rest]), None, "nan")
        gains, noise = self._gains(vector, vector.values), np.where(np.isfinite(variance), variance, 0)
        taken = (h[:, self.responses][:, :, self.forces] - smooth / gains) * np.isfinite(variance)
        row, column = (_weights(noise, axis) for axis in (2, 1))
        with np.errstate(all="ignore"):
            good = np.asarray(np.isfinite(h).all(axis=(1, 2)))[:, None, None]
            left = np.linalg.pinv(np.where(good, h[:, self.responses] @ e * row, 0)) * row.swapaxes(1, 2)
            right = column.swapaxes(1, 2) * np.linalg.pinv(np.where(good, e.T @ h[:, :, self.forces] * column, 0))
            back = invert(left @ taken @ right, on_singular="nan")
            of_rows, of_columns = back @ left, right @ back
            spread = np.einsum("ldp,lpq,lqd->ld", abs(of_rows) ** 2, noise, abs(of_columns) ** 2, optimize=True)
        return LineCompliance(back - e.T @ h @ e, np.asarray(spread, float))

    def of_joint(
        self, vector: ParameterVector, values: FloatArray, lines: NDArray[np.intp]
    ) -> Callable[[FloatArray], ComplexArray]:
        """Return the FRFs of some lines as a function of values, of which only values of the joint change."""
        link, states = self._parts(vector, values)
        free, to_out, to_in, between = (part[lines] for part in self._open(link, states)[1:])
        omega, own, gains = self.omega[lines], vector.places_of("joint"), self._gains(vector, values)
        s, t = link.s[lines], link.t[lines]
        q = joint_connection(self.whole, self.whole.joint, omega[:1]).pattern.shape[1]

        def frfs(changed: FloatArray) -> ComplexArray:
            joint = joint_connection(self.whole, self.whole.joint.with_values(changed[own]), omega)
            t[:, :q, :q] = joint.t
            with np.errstate(all="ignore"):
                w = np.linalg.solve(s + t @ between, t)
            return (free - to_out @ w @ to_in) * gains

        return frfs

    def frfs(self, vector: ParameterVector, values: FloatArray) -> ComplexArray:
        """Return the FRFs for values of all parameters, shape (n_freq, n_o, n_i), m/N."""
        link, states = self._parts(vector, values)
        opened = self._open(link, states)
        w = connection_forces(opened.between, link, self.freq_hz, "nan")
        return (opened.free - opened.to_out @ (w @ opened.to_in)) * self._gains(vector, values)

    def linearised(self, vector: ParameterVector, values: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return the FRFs and their derivatives by the free values, shape (p, n_freq, n_o, n_i)."""
        link, states = self._parts(vector, values)
        coupled = self._coupled(link, states)
        gains = self._gains(vector, values)
        slopes = np.zeros((len(vector.all), *coupled.y.shape), np.complex128)
        self._joint_slopes(vector, values, coupled, slopes)
        self._model_slopes(vector, values, coupled, (link, states), slopes)
        if (gains != 1).any():
            slopes *= gains
        for origin, base, of_responses in _GAINS:
            for i in vector.places_of(origin):
                which = _of_channel(int(vector.all[i].place[0]), of_responses)
                slopes[i][which] = (coupled.y * gains)[which] / (base + values[i])
        return coupled.y * gains, slopes if len(slopes) == vector.free.size else slopes[vector.free]

    @property
    def has_noisy_parts(self) -> bool:
        """Whether FRFs that are not exact define a substructure."""
        return any(side.noise is not None for side in self.sides)

    def part_noise(self, vector: ParameterVector, values: FloatArray) -> ComplexArray | None:
        """Return the effect of noise of FRFs of the substructures on FRFs of the assembly; None if they are exact.

        Returns
        -------
        ndarray, shape (n_freq, n_o, n_i, n_sources)
            Effect of each independent error of one standard deviation; to first order, m/N.
        """
        link, states = self._parts(vector, values)
        opened, gains, found, first = self._open(link, states), self._gains(vector, values), [], 0
        w = connection_forces(opened.between, link, self.freq_hz, "nan")
        for side in self.sides:
            own = slice(first, first + len(side.dofs))
            first = own.stop
            if side.noise is None:
                continue
            out, into = self._paths(opened, link, w, own)
            found.append(_of_entries(out, into, np.sqrt(side.noise), both=side.is_symmetrised) * gains[..., None])
        return np.concatenate(found, axis=-1) if found else None

    def _paths(self, opened: _Open, link: Connection, w: ComplexArray, own: slice) -> tuple[ComplexArray, ComplexArray]:
        """Return out, into of dY = out dH into for the FRFs H between some DOFs, all of one substructure."""
        unit, e = np.eye(opened.h.shape[1])[own], link.pattern[own]
        return (
            unit[:, self.responses].T - (opened.to_out @ w) @ e.T,
            unit[:, self.forces] - e @ (w @ opened.to_in),
        )

    def _through(
        self, opened: _Open, link: Connection, w: ComplexArray, own: slice, x: ComplexArray
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return out x and x^T into for motions x of the DOFs of one substructure, shape (n_freq, m, r)."""
        across = np.ascontiguousarray(motions_across(x.swapaxes(1, 2), link.pattern[own]).swapaxes(1, 2))
        left, right = -((opened.to_out @ w) @ across), -(across.swapaxes(1, 2) @ (w @ opened.to_in))
        number = range(own.start, own.stop)
        for i, at in enumerate(self.responses):
            if at in number:
                left[:, i] += x[:, at - own.start]
        for i, at in enumerate(self.forces):
            if at in number:
                right[:, :, i] += x[:, at - own.start]
        return left, right

    def joint_motion(self, vector: ParameterVector, values: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return motions across the joint per unit force, j less k, of forces at responses and at forces.

        Returns
        -------
        tuple of ndarray, shapes (n_freq, n_o, n) and (n_freq, n, n_i)
            Motions without gains; the derivative of the FRFs by K*_dd is minus the product of both for DOF d. For
            joints on regions n counts the coefficients of the motion of the region.
        """
        n = len(self.whole.ports.dof)
        coupled = self._coupled(*self._parts(vector, values))
        return coupled.across_out[:, :, :n], coupled.across_in[:, :n]

    def refine(self, vector: ParameterVector, values: FloatArray) -> bool:
        """Return whether a basis had to be extended for these values."""
        done = [side.refine(self._of_side(vector, values, side.name)) for side in self.sides]
        return any(done)

    def _of_side(self, vector: ParameterVector, values: FloatArray, name: str) -> dict[str, float]:
        return {str(vector.all[i].place[1]): float(values[i]) for i in vector.places_of_part(name)}

    def away_from_joints(self, name: str) -> list[int]:
        """Return the numbers of DOFs of a substructure without a joint and an attachment."""
        attached = itertools.chain(*(one.places for one in self.whole.attachments))
        taken = {*itertools.chain(*self.whole.ports.ends), *attached}
        return [i for i, dof in enumerate(self.places.of[name]) if f"{name}/{dof}" not in taken]

    def _parts(self, vector: ParameterVector, values: FloatArray) -> tuple[Connection, tuple[SubstructureState, ...]]:
        """Return connections and substructures for values of all parameters."""
        joint = self.whole.joint.with_values(values[vector.places_of("joint")])
        numbers: list[list[float]] = [[] for _ in self.whole.attachments]
        for i in vector.places_of("attachment"):
            numbers[int(vector.all[i].place[0])].append(float(values[i]))
        link = assembly_connection(self.whole, self.places, self.omega, joint, numbers)
        states = [
            side.at(
                self._of_side(vector, values, side.name),
                *(values[vector.places_of_part(side.name, origin)] for origin in _MODEL_ERRORS),
            )
            for side in self.sides
        ]
        return link, tuple(states)

    def _open(self, link: Connection, states: tuple[SubstructureState, ...]) -> _Open:
        """Return the FRFs before the substructures are connected; the last result is cached."""
        if self._last is None or any(one is not other for one, other in zip(self._last[0], states, strict=True)):
            h, e = _together(states), link.pattern
            across = motions_across(h, e)
            to_out = np.ascontiguousarray(across[:, self.responses])
            to_in, between = (
                np.ascontiguousarray(motions_across(own.swapaxes(1, 2), e).swapaxes(1, 2))
                for own in (h[:, :, self.forces], across)
            )
            free = np.ascontiguousarray(h[:, self.responses][:, :, self.forces])
            self._last = states, _Open(h, free, to_out, to_in, between)
        return self._last[1]

    def _coupled(self, link: Connection, states: tuple[SubstructureState, ...]) -> _Coupled:
        opened = self._open(link, states)
        w = connection_forces(opened.between, link, self.freq_hz, "nan")
        out_w, w_in = opened.to_out @ w, w @ opened.to_in
        across_out, across_in = opened.to_out - out_w @ opened.between, opened.to_in - opened.between @ w_in
        return _Coupled(opened.free - opened.to_out @ w_in, w, across_out, across_in)

    def _gains(self, vector: ParameterVector, values: FloatArray) -> FloatArray:
        return np.outer(*self.channel_gains(vector, values))

    def channel_gains(self, vector: ParameterVector, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return measured over true FRFs by the calibration of responses, shape (n_o,), and of forces, (n_i,)."""
        gains = np.ones(len(self.responses)), np.ones(len(self.forces))
        for origin, base, of_responses in _GAINS:
            for i in vector.places_of(origin):
                channel = slice(None) if of_responses is None else int(vector.all[i].place[0])
                gains[not of_responses][channel] *= base + values[i]
        return gains

    def _joint_slopes(
        self, vector: ParameterVector, values: FloatArray, coupled: _Coupled, slopes: ComplexArray
    ) -> None:
        """Write the derivatives by joint and attachments into their places."""
        own = vector.places_of("joint")
        joint = self.whole.joint.with_values(values[own])
        changes = dict(zip(own, connection_entries(self.whole, joint, self.omega), strict=True))
        first = joint_connection(self.whole, joint, self.omega[:1]).pattern.shape[1]
        starts = first + np.concatenate([[0], np.cumsum([len(one.places) for one in self.whole.attachments])])
        for i in vector.places_of("attachment"):
            at, number = (int(place) for place in vector.all[i].place)
            one = self.whole.attachments[at]
            entries = [(int(starts[at]) + n, int(starts[at]) + n) for n in range(len(one.places))]
            changes[i] = (entries, attachment_factors(one, self.omega)[number])
        last: list[tuple[int, int]] = []
        for i, (entries, slope) in changes.items():
            to = i if vector.all[i].like is None else vector.all[i].like
            assert to is not None
            if not vector.all[to].is_free:
                continue
            if entries != last:  # parameters of one law change the same entries
                last = entries
                moved = sum(
                    coupled.across_out[:, :, row, None] * coupled.across_in[:, column, None, :]
                    for row, column in entries
                )
            if to == i:
                np.multiply(moved, -slope[:, None, None], out=slopes[i])
            else:
                slopes[to] -= moved * slope[:, None, None]

    def _model_slopes(
        self,
        vector: ParameterVector,
        values: FloatArray,
        coupled: _Coupled,
        parts: tuple[Connection, tuple[SubstructureState, ...]],
        slopes: ComplexArray,
    ) -> None:
        """Write the derivatives by unknowns of the models into their places."""
        link, states = parts
        first, opened = 0, self._open(link, states)
        for side, state in zip(self.sides, states, strict=True):
            own = slice(first, first + len(side.dofs))
            first = own.stop
            of_part = vector.places_of_part(side.name)
            places = [i if vector.all[i].like is None else vector.all[i].like for i in of_part]
            errors, of_shapes = (vector.places_of_part(side.name, origin) for origin in _MODEL_ERRORS)
            if not places and not errors and not of_shapes:
                continue
            numbers = self._of_side(vector, values, side.name)
            of_side = side.slopes(numbers, [str(vector.all[i].place[1]) for i in of_part], state)
            left, right = self._through(opened, link, coupled.w, own, state.x)
            assert state.matrices is not None
            for i, slope in zip(places, of_side, strict=True):
                slopes[i] += _by_slope(slope, state.matrices.eta, self.omega, left, right)
                if slope.ports is not None:
                    out, into = self._paths(opened, link, coupled.w, own)
                    slopes[i] += out @ (slope.ports @ right)
                    slopes[i] += (left @ slope.ports.T) @ into
            if errors and side.errors is not None:
                # Errors are changes of the matrices before scaling.
                of_k, of_m = side.scales(numbers)
                slopes[errors] = side.errors.slopes(
                    state.shapes, (1 + 1j * state.matrices.eta) * of_k, of_m * self.omega**2, left, right
                )
            if of_shapes and side.errors is not None:
                paths = self._paths(opened, link, coupled.w, own)
                slopes[of_shapes] = side.errors.shape_slopes(state.shapes, left, right, *paths)


def _of_entries(out: ComplexArray, into: ComplexArray, std: FloatArray, *, both: bool) -> ComplexArray:
    """Return out e into for an error in each entry of a matrix, or in each pair of entries that are one measurement."""
    m = std.shape[1]
    found = (out[:, :, None, :, None] * into.swapaxes(1, 2)[:, None, :, None, :]) * std[:, None, None]
    if both:
        rows, columns = np.triu_indices(m)
        apart = rows != columns
        found[..., rows[apart], columns[apart]] += found[..., columns[apart], rows[apart]]
        return np.ascontiguousarray(found[..., rows, columns])
    return np.asarray(found.reshape(*found.shape[:3], m * m))


def _together(states: tuple[SubstructureState, ...]) -> ComplexArray:
    n = sum(state.h.shape[1] for state in states)
    h, first = np.zeros((len(states[0].h), n, n), np.complex128), 0
    for state in states:
        own = slice(first, first + state.h.shape[1])
        h[:, own, own], first = state.h, own.stop
    return h


def _weights(variance: FloatArray, axis: int) -> FloatArray:
    """Return 1 over the standard deviation of rows or columns, 0 if all entries are zero; the axis is kept."""
    mean = variance.mean(axis=axis, keepdims=True)
    found: FloatArray = np.where(mean > 0, 1 / np.sqrt(np.where(mean > 0, mean, 1)), 0)
    return found


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


#: Initial value of the search for a spread: the typical difference of mounts of one kind.
_FIRST_SPREAD = 0.3
#: Units of unknowns of models by their usual names.
_UNITS = {
    "youngs_modulus": "N/m^2", "density": "kg/m^3", "loss_factor": "1", "length": "m", "width": "m", "height": "m",
    "thickness": "m", "poisson": "1",
}  # fmt: skip


def parameter_vector(
    whole: Assembly,
    gains: tuple[Mapping[int, tuple[str, Unknown]], Mapping[int, tuple[str, Unknown]]],
    fixed: Sequence[str],
    joint_stiffness: FloatArray,
) -> ParameterVector:
    """Return all parameters of an assembly and its channels as a vector.

    Parameters
    ----------
    whole : Assembly
        Assembly.
    gains : pair of mappings of int to (str, Unknown)
        Factors of responses and of forces, by the number of the channel: its name and factor.
    fixed : sequence of str
        Parameters of the joint that keep their value.
    joint_stiffness : ndarray, shape (n,)
        Dynamic stiffness of the substructures at the joint DOFs, N/m: the scale of the stiffnesses of the joint.

    Raises
    ------
    ValueError
        `fixed` names a parameter that the joint does not have.
    """
    found = with_dampers(joint_vector(whole.joint, fixed, joint_stiffness).all, whole.joint)
    means = _with_means(whole, found)
    for side, part in whole.parts.items():
        for name, unknown in part.fitted.items():
            lower, upper = range_of(part, name, unknown)
            unit = "1" if name in part.scaled and unknown.value == 1 else _UNITS.get(name, "")
            own = _of_unknown(f"{side}/{name}", unit, "part", (side, name), unknown)
            # A structure without stiffness or mass does not exist.
            is_factor = name in part.scaled and name != "loss_factor"
            found.append(own._replace(lower=max(lower, 0.0) if is_factor else lower, upper=upper, is_log=is_factor))
    _with_same(whole, found)
    for i, one in enumerate(whole.attachments):
        found += _of_attachment(one, i)
    words: tuple[ParameterOrigin, ParameterOrigin] = ("response", "force")
    for origin, of_channels in zip(words, gains, strict=True):
        for place, (channel, unknown) in of_channels.items():
            found.append(_of_unknown(f"gain of {origin} {channel}", "1", origin, (place,), unknown))
    return ParameterVector(tuple(found), means)


def _with_same(whole: Assembly, parameters: list[FitParameter]) -> None:
    """Make parameters of joints and parts that are the same equal to the parameters of the first one."""
    at = {one.name: i for i, one in enumerate(parameters)}
    for first, *others in whole.same:
        sign = "." if first in whole.joints else "/"
        own = [name for name in at if name.startswith(first + sign)]
        for other, name in itertools.product(others, own):
            i, like = at[other + name[len(first) :]], at[name]
            parameters[i] = parameters[like]._replace(
                name=parameters[i].name, place=parameters[i].place, is_free=False, std=None, like=like
            )


def _with_means(whole: Assembly, parameters: list[FitParameter]) -> tuple[CommonMean, ...]:
    """Add the common means of parameters of similar joints; return these means."""
    at = {one.name: i for i, one in enumerate(parameters)}
    found = []
    for group, alike in whole.alike.items():
        first = alike.joints[0]
        for name in [name for name in at if name.startswith(f"{first}.")]:
            own = name[len(first) :]
            members = tuple(at[joint + own] for joint in alike.joints)
            if not all(parameters[i].is_free for i in members):
                continue
            one = parameters[members[0]]
            place = (group, own[1:])
            parameters.append(one._replace(name=group + own, origin="mean", place=place))
            spread = _FIRST_SPREAD if alike.spread is None else alike.spread
            std = spread if one.is_log else spread * (abs(one.value) or 1.0)
            found.append(CommonMean(len(parameters) - 1, members, std, alike.spread))
    return tuple(found)


def _of_unknown(
    name: str, unit: str, origin: ParameterOrigin, place: tuple[int | str, ...], unknown: Unknown
) -> FitParameter:
    return FitParameter(
        name, unit, origin, place, unknown.value, unknown.std, unknown.lower, unknown.upper, False, True
    )


def _of_attachment(one: Attachment, place: int) -> list[FitParameter]:
    found = []
    for i, (name, unit, number) in enumerate(zip(one.names, one.units, one.numbers, strict=True)):
        if isinstance(number, Unknown):
            found.append(_of_unknown(name, unit, "attachment", (place, i), number))
        else:
            fixed = FitParameter(name, unit, "attachment", (place, i), number, None, -np.inf, np.inf, False, False)
            found.append(fixed)
    return found
