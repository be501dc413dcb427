"""Channels that are exchanged or doubled: hypotheses about the FRFs that a channel shows, judged by one score."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

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
from jointfrf.kernel.arguments import FloatArray
from jointfrf.messages.finding import Finding

__all__ = ["Cause", "cause_findings", "find_cause"]

#: Most lines of the search, evenly spread.
_MOST_LINES = 200
#: Factor by which a hypothesis must lower the misfit of its pairs, and round-off.
_LESS, _ROUND_OFF = 1.4, 1e-6
#: Share of the broken pairs of its channels that a hypothesis may leave broken.
_LEFT = 0.25
#: Scores within this distance are equal.
_EQUAL = 0.1
#: Pairs that a finding names, the worst first.
_SHOWN = 4


class Cause(NamedTuple):
    """Cause of a misfit of reciprocity.

    Attributes
    ----------
    kind : {"exchanged", "response", "force", "channel", "pairs"}
        An exchange of two channels, a response or force that is a copy of another one, one channel that all broken
        pairs contain, or an unknown cause.
    channels : tuple of int
        DOFs. The second one is the copy.
    before, after : float
        Geometric mean of the misfits of the pairs with these channels, as measured and under the hypothesis. A copy is
        judged by its largest misfit.
    alternatives : tuple of tuple of int
        Other exchanges with about the same score.
    """

    kind: Literal["exchanged", "response", "force", "channel", "pairs"]
    channels: tuple[int, ...]
    before: float
    after: float
    alternatives: tuple[tuple[int, ...], ...] = ()


class _Hypothesis(NamedTuple):
    """FRFs of some channels, and the FRFs that equal them under a hypothesis, both of shape (n_freq, k, n)."""

    kind: Literal["exchanged", "response", "force"]
    channels: tuple[int, int]
    shown: Polar
    expected: Polar
    judged: NDArray[np.bool_]


def _exchanges(
    h: Polar, size: FloatArray, smooth: FloatArray, n_freq: int | None, pairs: NDArray[np.intp]
) -> Iterator[_Hypothesis]:
    """Yield exchanges of two responses, for reciprocity the same as exchanges of two forces."""
    for pair in pairs:
        order = np.arange(size.shape[0])
        order[pair] = pair[::-1]
        judged = _judged(size[order], smooth[order], n_freq)[pair]
        channels = int(pair[0]), int(pair[1])
        yield _Hypothesis("exchanged", channels, h.at(pair[::-1]), h.at(order, pair[:, None]), judged)


def _copies(h: Polar, size: FloatArray, pairs: NDArray[np.intp]) -> Iterator[_Hypothesis]:
    """Yield the second channel of each pair as a copy of the first, of responses and of forces."""
    for first, copy in pairs.tolist():
        yield _Hypothesis("response", (first, copy), h.at([copy]), h.at([first]), size[[copy]] > 0)
        across = h.transposed
        yield _Hypothesis("force", (first, copy), across.at([copy]), across.at([first]), size.T[[copy]] > 0)


def _judged(size: FloatArray, smooth: FloatArray, n_freq: int | None) -> NDArray[np.bool_]:
    """Return the pairs, shape (n, n), whose reciprocity the FRFs can show; without `n_freq`, all pairs with FRFs."""
    found = size > 0 if n_freq is None else are_signals(size, smooth, n_freq) | are_one_sided(size, smooth)
    np.fill_diagonal(found, False)
    return found


def _misfit(shown: Polar, expected: Polar) -> tuple[FloatArray, FloatArray]:
    """Return the scatter of log(shown / expected) over lines, and the same with a mean of more than a factor of 2."""
    scatter, gain = scatter_of(shown, expected)
    return scatter, np.hypot(scatter, np.where((abs(gain) > np.log(2)) & (scatter < ONE_SIDED), gain, 0.0))


def find_cause(m: Measurement, pairs: PairRatios) -> Cause | None:
    """Find the exchange or copy that explains a misfit of reciprocity; None if the FRFs are reciprocal.

    Notes
    -----
    Under an exchange of channels a and b, h_aq equals h_qb, and h_bq equals h_qa. Under a copy, h_aq equals h_bq
    (response), or h_qa equals h_qb (force). The misfit of these ratios replaces the misfit of h_aq / h_qa. The score is
    the sum of the logarithms of all misfits: minus the log likelihood of a line, with unknown noise of each pair. A
    hypothesis has no parameter, so the scores compare as BIC does.

    Both sides of a stiff joint move alike. An exchange of these two changes reciprocity by some percent, and equal
    responses there are no evidence of a copy, unless pairs are broken. If no pair is broken, FRFs that consist of noise
    count as well: a lower misfit of a single pair is no evidence.
    """
    some = m.square[:: -(-len(m.freq_hz) // _MOST_LINES)]
    polar, n = Polar.of(some), m.rows.size
    size, smooth = np.asarray(np.median(abs(m.square), axis=0), float), m.square_smoothness
    signals = _judged(size, smooth, len(m.freq_hz))
    misfits = _misfit(polar, polar.transposed)[1]
    mean = np.where(signals, misfits, 0.0).sum(axis=1) / np.maximum(signals.sum(axis=1), 1)
    broken = np.zeros((n, n), bool)
    broken[pairs.p, pairs.q] = broken[pairs.q, pairs.p] = pairs.broken
    n_broken = int(pairs.broken.sum())
    n_freq = len(m.freq_hz) if n_broken else None
    judged = _judged(size, smooth, n_freq)
    logs = np.where(judged, np.log(misfits + _ROUND_OFF), 0.0)
    directions = np.array([name.rpartition(":")[2] for name in m.dofs])
    alike, off = directions[:, None] == directions, mean >= BROKEN
    swaps = np.argwhere(np.triu(alike | (off[:, None] & off) | (n_broken > 0), 1))
    copies = np.argwhere(off & (~alike | (n_broken > 0)) & ~np.eye(n, dtype=bool))
    found: list[tuple[int, float, Cause]] = []
    for one in (*_exchanges(polar, size, smooth, n_freq, swaps), *_copies(polar, size, copies)):
        at = list(one.channels if one.kind == "exchanged" else one.channels[1:])
        scatter, misfit = (values[one.judged] for values in _misfit(one.shown, one.expected))
        # A copy agrees in all FRFs; both sides of a stiff joint agree in most.
        own = np.log(misfit + _ROUND_OFF)
        after = float(np.exp(own.mean() if one.kind == "exchanged" else own.max())) if own.size else np.inf
        if one.kind != "exchanged" and after > BROKEN / 2:
            continue
        before = float(np.exp(logs[at].sum() / max(judged[at].sum(), 1)))
        others, left = int(np.delete(np.delete(broken, at, 0), at, 1).sum() // 2), int((scatter >= BROKEN).sum())
        if before < _LESS * after or left > _LEFT * (n_broken - others):
            continue
        score = float(np.delete(np.delete(logs, at, 0), at, 1).sum() / 2 + own.size * np.log(after))
        found.append((others + left, score, Cause(one.kind, one.channels, before, after)))
    if found:
        return _best(found, one_sidedness(m.driving), _LEFT * n_broken)
    if not n_broken:
        return None
    before = float(pairs.scatter[pairs.broken].mean())
    always = np.flatnonzero((broken.sum(axis=1) == n_broken) & (broken.sum(axis=1) > 1))
    return Cause("channel" if always.size == 1 else "pairs", tuple(always) if always.size == 1 else (), before, before)


def _best(found: list[tuple[int, float, Cause]], driving: FloatArray, most: float) -> Cause:
    """Return the hypothesis with the lowest score; of equal copies, the one that is least like a driving point.

    Exchanges are alternatives if each leaves at most so many broken pairs: otherwise several channels are wrong.
    """
    found = sorted(found, key=lambda one: one[:2])
    equal = [cause for left, score, cause in found if left == found[0][0] and score <= found[0][1] + _EQUAL]
    best = min(equal, key=lambda one: 0.0 if one.kind == "exchanged" else driving[one.channels[1]])
    if best.kind != "exchanged" or found[0][0] > most:
        return best
    alike = [
        cause.channels
        for left, _, cause in found
        if left == found[0][0] and cause.kind == "exchanged" and cause is not best and cause.after < 2 * best.after
    ]
    return best._replace(alternatives=tuple(alike))


def cause_findings(
    measurement: Measurement, pairs: PairRatios, cause: Cause, side: int
) -> Iterator[Finding | Correction]:
    """Report the cause of a misfit of reciprocity, and the correction of an exchange."""
    names = [measurement.dofs[i] for i in cause.channels]
    if cause.kind == "exchanged":
        others = tuple(f"{measurement.dofs[i]} and {measurement.dofs[j]}" for i, j in cause.alternatives)
        numbers = {"before": cause.before, "after": cause.after, "others": others}
        yield Finding("exchanged-channels", numbers, tuple(names), variant="alternatives" if others else "")
        _, own = measurement.of_side(side, cause.channels)
        text = f"{'responses' if side == 1 else 'forces'} {names[0]} and {names[1]} exchanged"
        yield Correction("exchanged", text, side, own, exchange=True)
        return
    if cause.kind in ("response", "force"):
        first, second = (f"{cause.kind} {name}" for name in names)
        numbers = {"first": first, "second": second, "difference": cause.after, "scatter": cause.before}
        yield Finding("doubled-channel", numbers, (first, second), variant="moves-alike")
        return
    worst = np.argsort(-np.where(pairs.broken, pairs.scatter, -1))[: int(pairs.broken.sum())].tolist()
    count = {"broken": len(worst), "pairs": int(pairs.p.size), "scatter": cause.before}
    if cause.kind == "channel":
        yield Finding("reciprocity", count, tuple(names), variant="channel")
        return
    shown = tuple(f"{measurement.dofs[pairs.p[i]]} / {measurement.dofs[pairs.q[i]]}" for i in worst)
    about = dict.fromkeys(measurement.dofs[x] for i in worst[:_SHOWN] for x in (pairs.p[i], pairs.q[i]))
    yield Finding("reciprocity", count | {"worst": shown}, tuple(about))
