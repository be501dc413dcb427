"""Search for wrong channel names: signs and exchanges that FRFs and models of the parts show."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Literal, NamedTuple, TypeVar

import numpy as np

from jointfrf.dofs import is_rotation
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.setups import SetUps
from jointfrf.identification.line_starts import from_lines
from jointfrf.identification.minimise import Minimum, minimise
from jointfrf.identification.model.fit import ModelProblem, lowest_minimum
from jointfrf.identification.model.prepare import Channels
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.messages.finding import Finding

__all__ = ["ChannelChange", "ChannelSearch", "find_channel_change"]

NumbersT = TypeVar("NumbersT", ComplexArray, FloatArray)
#: Decrease of -2 log likelihood for a change, to which 2 ln of the number of trials is added: odds of 1 to e^10 for
#: each rejected change.
_CLEAR = 20.0
#: Least share of the excess of the residual over the noise that a change must remove: a change that only compensates
#: for wrong models removes less.
_EXPLAINED = 0.8
#: Number of linearisations with each change, and number of the best changes that are followed to their minimum.
_GLANCE, _FOLLOWED = 6, 6


@dataclass(frozen=True)
class ChannelChange:
    """One change of the channels.

    Attributes
    ----------
    kind : {"sign", "exchange"}
        Kind of the change.
    side : {"response", "force"}
        Side of the channels.
    channels : tuple of int
        One channel, or two that measure the same quantity.
    names : tuple of str
        Names of the channels.
    """

    kind: Literal["sign", "exchange"]
    side: Literal["response", "force"]
    channels: tuple[int, ...]
    names: tuple[str, ...]

    def of(self, frfs: NumbersT, *, signed: bool = True) -> NumbersT:
        """Return FRFs with the change, shape (n_freq, n_o, n_i); their variances if `signed` is false."""
        found = frfs.copy()
        across = found if self.side == "response" else found.swapaxes(1, 2)
        if self.kind == "exchange":
            across[:, list(self.channels)] = across[:, list(self.channels[::-1])]
        elif signed:
            across[:, self.channels[0]] *= -1
        return found

    def of_setups(self, setups: SetUps) -> SetUps:
        """Return set-ups with the change."""
        of, repeats, repeated = setups.of.copy(), setups.repeats.copy(), setups.repeated
        across, own = (of, repeats[:, 0]) if self.side == "response" else (of.T, repeats[:, 1])
        if self.kind == "exchange":
            i, j = self.channels
            across[[i, j]] = across[[j, i]]
            own[:] = np.where(own == i, j, np.where(own == j, i, own))
        elif repeated is not None:
            repeated = repeated * np.where(own == self.channels[0], -1.0, 1.0)
        return replace(setups, of=of, repeats=repeats, repeated=repeated)

    def __str__(self) -> str:
        if self.kind == "exchange":
            return f"{self.side}s {self.names[0]} and {self.names[1]} exchanged"
        return f"{self.side} {self.names[0]} with the opposite sign"


class ChannelSearch(NamedTuple):
    """Result of a search for a change of the channels.

    Attributes
    ----------
    change : ChannelChange or None
        The only change that the FRFs show.
    finding : Finding
        Result as a finding.
    """

    change: ChannelChange | None
    finding: Finding


def _changes(channels: Channels) -> Iterator[ChannelChange]:
    """Yield the sign of each channel, and exchanges of two that measure the same quantity."""
    sides: tuple[tuple[Literal["response", "force"], tuple[str, ...]], ...] = (
        ("response", channels.responses), ("force", channels.forces),
    )  # fmt: skip
    for side, names in sides:
        # With one response and one force, a sign of one is a sign of the other.
        if side == "response" or max(len(channels.responses), len(channels.forces)) > 1:
            for i, name in enumerate(names):
                yield ChannelChange("sign", side, (i,), (name,))
        turns = [is_rotation(name.rpartition(":")[2]) for name in names]
        for i, j in combinations(range(len(names)), 2):
            if turns[i] == turns[j]:
                yield ChannelChange("exchange", side, (i, j), (names[i], names[j]))


def find_channel_change(problem: ModelProblem, channels: Channels) -> ChannelSearch:
    """Search for one sign or one exchange of channels with which the models and a joint fit the FRFs far better.

    Parameters
    ----------
    problem : ModelProblem
        Problem with the channels as named.
    channels : Channels
        Names of the channels.

    Notes
    -----
    The joint and all unknowns are fitted again with each change, in a few steps, and completely with the best ones.
    The unit of -2 log likelihood is the residual of the best one, so that wrong models do not count as evidence. If two
    changes fit equally, as in a symmetric structure, both are named, and none is made.
    """
    changes = tuple(_changes(channels))
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore", IllConditionedWarning)
        given = _least(problem, [problem.vector.to_coordinates(problem.vector.values)])
        found = [_least(_changed(problem, one), [given.x], _GLANCE) for one in changes]
        best = sorted(range(len(changes)), key=lambda i: found[i].cost)[:_FOLLOWED]
        for i in best:
            found[i] = minimise(_changed(problem, changes[i]).likelihood, found[i].x)
        first = min(best, key=lambda i: found[i].cost)
        # The initial values of a complete fit, if these have not led to the noise.
        nearest = found[first] = min(
            found[first], lowest_minimum(_changed(problem, changes[first]), found[first])[0], key=lambda one: one.cost
        )
        # Initial values from which the channels as named do not reach their minimum are no evidence against them.
        given = min(given, minimise(problem.likelihood, nearest.x), key=lambda one: one.cost)
    return _significant_change(problem, changes, given.cost, np.array([one.cost for one in found]))


def _significant_change(
    problem: ModelProblem, changes: Sequence[ChannelChange], given: float, squares: FloatArray
) -> ChannelSearch:
    """Return the change that the least squares with each change show, and a sentence."""
    count = max(2.0 * np.count_nonzero(problem.likelihood.used) / problem.noise.inflation - problem.vector.free.size, 1)
    noise = 0.0 if problem.noise.is_assumed else 1.0
    best = float(squares.min())
    least = min(best, given)
    margin = (_CLEAR + 2 * np.log(len(changes))) * max(least / count, noise)
    alike = [changes[i] for i in np.argsort(squares) if squares[i] < least + margin]
    tried = len(changes)
    if given < best + margin or given - best < _EXPLAINED * (given - noise * count):
        if given < least + margin and alike:
            numbers = {"changes": _either(alike), "tried": tried}
            own = Finding("channel-change-ambiguous", numbers, _named(alike), severity="note", variant="equal")
            return ChannelSearch(None, own)
        return ChannelSearch(None, Finding("channel-names-confirmed", {"tried": tried}))
    ratios = [float(np.sqrt(one / count)) for one in (given, best)]
    falls = {"before": ratios[0], "after": ratios[1], "tried": tried}
    if len(alike) > 1:
        own = Finding("channel-change-ambiguous", falls | {"changes": _either(alike)}, _named(alike))
        return ChannelSearch(None, own)
    return ChannelSearch(alike[0], Finding("channel-changed", falls | {"change": str(alike[0])}, alike[0].names))


def _either(changes: Sequence[ChannelChange]) -> str:
    return " or ".join(map(str, changes))


def _named(changes: Sequence[ChannelChange]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for one in changes for name in one.names))


def _changed(problem: ModelProblem, change: ChannelChange) -> ModelProblem:
    """Return the problem with the change, including the variances of an exchanged channel."""
    return replace(
        problem,
        measured=change.of(problem.measured),
        smooth=change.of(problem.smooth),
        variance=change.of(problem.variance, signed=False),
    )


def _least(problem: ModelProblem, starts: Sequence[FloatArray], steps: int = 40) -> Minimum:
    """Return the lowest minimum from the initial values of single lines, if possible, and from other initial values."""
    vector, prediction = problem.vector, problem.prediction
    found = list(starts)
    values = None
    if np.isfinite(problem.measured).all():
        lines = prediction.joint_compliance(vector, problem.smooth, problem.variance)
        values = None if lines is None else from_lines(prediction.whole.joint, prediction.omega, lines)
    if values is not None:
        own = vector.places_of("joint")
        whole = vector.values.copy()
        whole[own] = np.where([vector.all[i].is_free for i in own], values, whole[own])
        found.append(vector.to_coordinates(whole))
    return min((minimise(problem.likelihood, x, steps=steps) for x in found), key=lambda one: one.cost)
