"""FRFs that are not reciprocal: exchanged channels, one channel twice, or one that measures something else."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.driving_points import one_sidedness
from jointfrf.channels.check.pair_ratios import (
    BROKEN,
    ONE_SIDED,
    PairRatios,
    Polar,
    are_one_sided,
    are_signals,
    scatter_of,
)
from jointfrf.channels.check.result import Correction
from jointfrf.channels.check.signals import Measurement
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.messages.finding import Finding

__all__ = ["Cause", "broken_findings", "cause_of_broken_pairs", "cause_of_gains", "hidden_exchange"]

#: A search takes no more lines than these, evenly spread.
_MOST_LINES = 200
#: Gains above this factor may come from exchanged channels; logarithms of the two then cancel to within this.
_MUCH, _ALIKE = 2.0, 0.1
#: Two channels of one direction count as exchanged if that divides the scatter of their ratios by this; rounding.
_LESS, _ROUND_OFF = 1.4, 1e-6
#: A copy whose scatter is not larger than the least by more than this is as good.
_AS_GOOD = 1.01
#: A cause explains if it leaves at most this share of the broken pairs.
_LEFT = 0.25
#: Pairs that a finding names, the worst first.
_SHOWN = 4


@dataclass(frozen=True)
class Cause:
    """What explains broken pairs.

    Attributes
    ----------
    kind : {"exchanged", "doubled response", "doubled force", "channel", "pairs"}
        "doubled": the second channel shows what the first one does. "channel": all broken pairs hold this one.
    channels : tuple of int
        Places among the DOFs that responses and forces share; none for "pairs".
    before, after : float
        Mean scatter of the pairs that were broken, and with the cause removed.
    alternatives : tuple of (int, int)
        Other exchanges that explain as much.
    """

    kind: Literal["exchanged", "doubled response", "doubled force", "channel", "pairs"]
    channels: tuple[int, ...]
    before: float
    after: float
    alternatives: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True, eq=False)
class _Evidence:
    """FRFs on some lines, their sizes and smoothness on all, and the pairs that are broken."""

    h: ComplexArray
    size: FloatArray
    smooth: FloatArray
    n_freq: int
    broken: NDArray[np.bool_]


def cause_of_broken_pairs(h: ComplexArray, smooth: FloatArray, broken: NDArray[np.bool_]) -> Cause:
    """Find what explains that pairs of FRFs are not reciprocal.

    Parameters
    ----------
    h : ndarray, shape (n_freq, n, n)
    smooth : ndarray, shape (n, n)
        `smoothness` of h.
    broken : ndarray of bool, shape (n, n)
        Symmetric.
    """
    some = h[:: -(-h.shape[0] // _MOST_LINES)]
    evidence = _Evidence(some, np.median(abs(h), axis=0), smooth, h.shape[0], broken)
    before = float(_scatter(some)[broken].mean())
    for cause in (_doubled(evidence, before), _exchanged(evidence, before)):
        if cause is not None:
            return cause
    always = np.flatnonzero((broken.sum(axis=1) == np.triu(broken).sum()) & (broken.sum(axis=1) > 1))
    if always.size == 1:
        return Cause("channel", (int(always[0]),), before, before)
    return Cause("pairs", (), before, before)


def cause_of_gains(h: ComplexArray, log_gain: FloatArray, directions: Sequence[str]) -> Cause | None:
    """Find whether gains of channels come from an exchange, or from a channel that shows what another one does.

    Channels that a body moves together, one by a constant factor more than the other, stay reciprocal up to a gain
    when they are exchanged.

    Parameters
    ----------
    h : ndarray, shape (n_freq, n, n)
    log_gain : ndarray, shape (n,)
        Natural logarithm of the gains found; 0 where there is none.
    directions : sequence of str
        Of the DOFs. Those of one direction on both sides of a stiff joint move alike, which is no sign of a copy.
    """
    some = h[:: -(-h.shape[0] // _MOST_LINES)]
    places = np.flatnonzero(abs(log_gain) > np.log(_MUCH))
    before = float(abs(log_gain).max(initial=0))
    if places.size == 2 and abs(log_gain[places].sum()) < _ALIKE:
        order = np.arange(log_gain.size)
        order[places] = places[::-1]
        after = float(np.median(_from_one(some[:, order][:, places[0]], some[:, :, places[0]])))
        if after < BROKEN / 2:
            return Cause("exchanged", (int(places[0]), int(places[1])), before, after)
    across = np.ascontiguousarray(some.swapaxes(1, 2))
    for copy in places.tolist():
        for own, kind in ((some, "doubled response"), (across, "doubled force")):
            differ = np.array([_from_one(own[:, copy], own[:, other]).max() for other in range(log_gain.size)])
            differ[[direction == directions[copy] for direction in directions]] = np.inf
            other = int(np.argmin(differ))
            if differ[other] < BROKEN / 2:
                return Cause(kind, (other, int(copy)), before, float(differ[other]))  # type: ignore[arg-type]
    return None


def hidden_exchange(h: ComplexArray, directions: Sequence[str]) -> Cause | None:
    """Find an exchange of two channels of one direction, which a stiff joint nearly hides.

    Both sides of a stiff joint move alike: exchanged, they remain reciprocal to within some percent.

    Parameters
    ----------
    h : ndarray, shape (n_freq, n, n)
    directions : sequence of str
        Of the DOFs.
    """
    polar, every = Polar.of(h), np.arange(len(directions))
    best: Cause | None = None
    for i, j in combinations(range(len(directions)), 2):
        if directions[i] != directions[j]:
            continue
        # Rows of the two responses beside the columns of their forces, as they are and exchanged.
        others = np.delete(every, (i, j))
        columns = polar.at(others[:, None], [i, j])
        scatters = (scatter_of(polar.at(rows, others[:, None]), columns) for rows in ([i, j], [j, i]))
        both = [scatter[scatter > 0] for scatter in scatters]
        # h_ij against h_ji, or, exchanged, h_jj against h_ii, is in neither.
        before, after = (float(np.mean(scatter)) if scatter.size else 0.0 for scatter in both)
        own = scatter_of(polar.at([i, j], [j, j]), polar.at([j, i], [i, i])).tolist()
        before, after = (before * both[0].size + 2 * own[0], after * both[0].size + 2 * own[1])
        if before > _LESS * after + _ROUND_OFF and (best is None or after / before < best.after / best.before):
            best = Cause("exchanged", (i, j), before / (both[0].size + 2), after / (both[0].size + 2))
    return best


def _from_one(first: ComplexArray, second: ComplexArray) -> FloatArray:
    """Median over lines of |log(first / second)|: small only for equal numbers; 0 where both are zero."""
    known = (first != 0) & (second != 0)
    with np.errstate(invalid="ignore"):
        distance = abs(np.log(np.where(known, first, 1) / np.where(known, second, 1)))
    distance = np.where((first != 0) != (second != 0), ONE_SIDED, distance)
    return np.asarray(np.median(distance, axis=0))


def _scatter(h: ComplexArray) -> FloatArray:
    polar = Polar.of(h)
    return scatter_of(polar, polar.transposed)


def _exchanged(evidence: _Evidence, before: float) -> Cause | None:
    """Return the exchange of two responses (for reciprocity the same as of two forces) that leaves least broken."""
    n = evidence.size.shape[0]
    left: dict[tuple[int, int], tuple[int, float]] = {}
    for i, j in combinations(range(n), 2):
        order = np.arange(n)
        order[[i, j]] = j, i
        scatter = _scatter(evidence.h[:, order])
        size, smooth = evidence.size[order], evidence.smooth[order]
        signals = are_signals(size, smooth, evidence.n_freq) | are_one_sided(size, smooth)
        np.fill_diagonal(signals, False)
        after = float(scatter[signals].mean()) if signals.any() else np.inf
        left[i, j] = int((signals & (scatter >= BROKEN)).sum()), after
    fewest = min(number for number, _ in left.values())
    if fewest > _LEFT * evidence.broken.sum():
        return None
    best = sorted((after, pair) for pair, (number, after) in left.items() if number == fewest)
    alike = tuple(pair for after, pair in best[1:] if after < 2 * best[0][0])
    return Cause("exchanged", best[0][1], before, best[0][0], alike)


def _doubled(evidence: _Evidence, before: float) -> Cause | None:
    """Return a channel that holds all broken pairs and shows the same as another one.

    Of two that both do, the copy is the one whose driving point is less like one.
    """
    n = evidence.size.shape[0]
    holds = np.flatnonzero(evidence.broken.sum(axis=1) == np.triu(evidence.broken).sum())
    across = np.ascontiguousarray(evidence.h.swapaxes(1, 2))
    driving = one_sidedness(np.einsum("faa->fa", evidence.h))
    found: list[Cause] = []
    for copy in holds[np.argsort(driving[holds])]:
        for h, size, kind in (
            (evidence.h, evidence.size, "doubled response"), (across, evidence.size.T, "doubled force")
        ):  # fmt: skip
            polar = Polar.of(h)
            scatter = np.stack([scatter_of(polar.at(copy), polar.at(other)) for other in range(n)])
            worst = scatter[:, size[copy] > 0].max(axis=1, initial=0)
            worst[copy] = np.inf
            other = int(np.argmin(worst))
            if worst[other] < BROKEN / 2:
                found.append(Cause(kind, (other, int(copy)), before, float(worst[other])))  # type: ignore[arg-type]
    least = min((cause.after for cause in found), default=0.0)
    return next((cause for cause in found if cause.after <= _AS_GOOD * least), None)


def broken_findings(
    measurement: Measurement, pairs: PairRatios, cause: Cause, side: int
) -> Iterator[Finding | Correction]:
    """Report what explains that FRFs are not reciprocal, and how to correct it where that is possible."""
    names = measurement.dofs
    count = {"broken": int(pairs.broken.sum()), "pairs": int(pairs.p.size), "scatter": cause.before}
    if cause.kind == "exchanged":
        a, b = (names[i] for i in cause.channels)
        others = tuple(f"{names[i]} and {names[j]}" for i, j in cause.alternatives)
        numbers = {"before": cause.before, "after": cause.after, "others": others}
        yield Finding("exchanged-channels", numbers, (a, b), variant="alternatives" if others else "")
        _, own = measurement.of_side(side, cause.channels)
        text = f"{'responses' if side == 1 else 'forces'} {a} and {b} exchanged"
        yield Correction("exchanged", text, side, own, exchange=True)
    elif cause.kind in ("doubled response", "doubled force"):
        word = cause.kind.removeprefix("doubled ")
        first, second = (f"{word} {names[i]}" for i in cause.channels)
        numbers = {"first": first, "second": second, "difference": cause.after, "scatter": cause.before}
        yield Finding("doubled-channel", numbers, (first, second), variant="moves-alike")
    elif cause.kind == "channel":
        yield Finding("reciprocity", count, (names[cause.channels[0]],), variant="channel")
    else:
        worst = np.argsort(-np.where(pairs.broken, pairs.scatter, -1))[: count["broken"]].tolist()
        shown = tuple(f"{names[pairs.p[i]]} / {names[pairs.q[i]]}" for i in worst)
        about = dict.fromkeys(names[x] for i in worst[:_SHOWN] for x in (pairs.p[i], pairs.q[i]))
        yield Finding("reciprocity", count | {"worst": shown}, tuple(about))
