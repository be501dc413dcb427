"""Channels to measure next: those that would narrow the intervals of the joint most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from jointfrf.dofs import is_rotation
from jointfrf.identification.minimise import inverse_information
from jointfrf.identification.model.fit import FoundModel
from jointfrf.identification.model.prediction import Prediction
from jointfrf.identification.model.substructure import FrfSource, Substructure
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["NextChannel", "NextChannels", "next_channels", "without_start"]

#: Number of DOFs of a part that are tried, spread over it, and number of lines.
_TRIED, _LINES = 10, 100
#: Share of a standard error that remains above which a channel is not proposed.
_WORTH = 0.9


class NextChannel(NamedTuple):
    """A channel that was not measured.

    Attributes
    ----------
    kind : {"response", "force"}
        Kind of the channel.
    dof : str
        DOF, ``"A/..."`` or ``"B/..."``.
    widest : str
        Parameter of the joint with the widest interval.
    shares : dict of str to float
        Ratio of the standard error with the channel to the present one, by parameter of the joint.
    """

    kind: str
    dof: str
    widest: str
    shares: dict[str, float]


class NextChannels:
    """Channels to measure next, computed once on demand; can be pickled, without the start of the fit."""

    def __init__(self, found: FoundModel) -> None:
        self._found = without_start(found)
        self._known: tuple[NextChannel, ...] | None = None

    def __call__(self) -> tuple[NextChannel, ...]:
        """Return the channels, best first."""
        if self._known is None:
            self._known = next_channels(self._found)
        return self._known


def without_start(found: FoundModel) -> FoundModel:
    """Return the same without the start of the fit, which cannot be pickled."""
    return found._replace(problem=replace(found.problem, compliance_start=_no_start))


def _no_start() -> None:
    return None


def next_channels(found: FoundModel) -> tuple[NextChannel, ...]:
    """Return channels that would reduce the standard errors of the joint most, best first.

    Notes
    -----
    The information is computed at the estimate for FRFs with the same relative noise and the same lines. Candidates are
    translations of parts with models, spread over them, and of the joint. The ranking is by the standard error of the
    widest parameter. New FRFs follow the models, whose errors widen the intervals before and after.
    """
    problem = found.problem
    prediction, vector = problem.prediction, problem.vector
    whole, places = prediction.whole, prediction.places
    names = places.names
    responses, forces = ([names[i] for i in own] for own in (prediction.responses, prediction.forces))
    tried = [f"{name}/{dof}" for name, part in whole.parts.items() for dof in _candidates(part, whole.ends, name)]
    more = [[dof for dof in tried if dof not in own] for own in (responses, forces)]
    every = np.unique(np.linspace(0, problem.freq_hz.size - 1, min(_LINES, problem.freq_hz.size)).astype(np.intp))
    other = Prediction(whole, problem.freq_hz[every], [*responses, *more[0]], [*forces, *more[1]])
    values = found.values[: len(vector.all)]
    y, slopes = other.linearised(vector, values)
    n, x = vector.free.size, found.minimum.x[: vector.free.size]
    slopes *= vector.slope(x)[:, None, None, None]
    shown = np.isfinite(problem.variance)
    level = np.sqrt(np.where(shown, problem.variance, 0)) / np.maximum(abs(found.predicted), np.finfo(float).tiny)
    weight = 2 * problem.freq_hz.size / every.size / (problem.noise.inflation * float(np.median(level[shown])) ** 2)
    known = _without_errors(found.minimum.information, n)
    n_o, n_i = len(responses), len(forces)
    options = [("response", dof, slice(n_o + i, n_o + i + 1), slice(0, n_i)) for i, dof in enumerate(more[0])]
    options += [("force", dof, slice(0, n_o), slice(n_i + i, n_i + i + 1)) for i, dof in enumerate(more[1])]
    joint = [i for i, one in enumerate(vector.fitted) if one.origin == "joint"]
    before = np.sqrt(np.diagonal(inverse_information(known)))[joint]
    share = before * vector.slope(x)[joint] / np.maximum(abs(values[vector.free][joint]), np.finfo(float).tiny)
    widest = vector.fitted[joint[int(np.argmax(share))]].name
    channels = []
    for kind, dof, rows, columns in options:
        added = _information(slopes[:, :, rows, columns], y[:, rows, columns]) * weight
        left = np.sqrt(np.maximum(np.diagonal(inverse_information(known + added)), 0))[joint] / before
        shares = dict(zip((vector.fitted[i].name for i in joint), left.tolist(), strict=True))
        channels.append(NextChannel(kind, dof, widest, shares))
    useful = [one for one in channels if one.shares[widest] < _WORTH]
    return tuple(sorted(useful, key=lambda one: one.shares[widest]))


def _without_errors(information: FloatArray, n: int) -> FloatArray:
    """Return the information on the first n coordinates, with the rest unknown: a Schur complement."""
    if len(information) == n:
        return information
    cross = information[:n, n:]
    return np.asarray(information[:n, :n] - cross @ inverse_information(information[n:, n:]) @ cross.T)


def _candidates(part: Substructure, ends: Sequence[Sequence[str]], name: str) -> list[str]:
    """Return translations of a model: at its joints, and spread over it."""
    dofs = part.source.dofs if isinstance(part.source, FrfSource) else part.nominal_model.dofs
    moving = [dof for dof in dofs if not is_rotation(dof.rpartition(":")[2])]
    at = np.unique(np.linspace(0, len(moving) - 1, _TRIED).astype(np.intp)).tolist() if moving else []
    joint = [dof.partition("/")[2] for end in ends for dof in end if dof.startswith(f"{name}/")]
    own = [dof for dof in joint if part.has(dof) and not is_rotation(dof.rpartition(":")[2])]
    return list(dict.fromkeys([*own, *(moving[i] for i in at)]))


def _information(slopes: ComplexArray, y: ComplexArray) -> FloatArray:
    """Return the information of FRFs whose noise has the size of the FRFs, shape (p, p)."""
    size = np.maximum(abs(y), 1e-6 * abs(y).max(initial=np.finfo(float).tiny))
    own = (slopes / size).reshape(len(slopes), -1)
    found: FloatArray = (own @ own.conj().T).real
    return found
