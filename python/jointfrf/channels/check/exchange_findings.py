"""FRFs that are not reciprocal, in words."""

from __future__ import annotations

import math

import numpy as np

from jointfrf.channels.check.correction import Correction
from jointfrf.channels.check.exchange import Cause
from jointfrf.channels.check.finding import FrfFinding
from jointfrf.channels.check.measurement import Measurement
from jointfrf.channels.check.pair_ratios import BROKEN, PairRatios

__all__ = ["broken_findings"]

_SHOWN = 4


def broken_findings(
    measurement: Measurement, pairs: PairRatios, cause: Cause, side: int
) -> tuple[list[FrfFinding], list[Correction]]:
    """Say what explains that FRFs are not reciprocal, and how to correct it where that is possible."""
    names = measurement.dofs
    number = f"{pairs.broken.sum()} of {pairs.p.size} pairs h_pq, h_qp are not the same FRF (scatter of their ratio "
    if not pairs.broken.any():
        number = (
            "h_pq and h_qp differ by large factors (logarithm "
            if cause.before > math.log(2)
            else "with these two h_pq / h_qp varies over frequency by more than noise does (scatter "
        )
    if cause.kind == "exchanged":
        a, b = (names[i] for i in cause.channels)
        others = "".join(f", or {names[i]} and {names[j]}" for i, j in cause.alternatives)
        finding = FrfFinding(
            "exchanged", "error", (a, b), cause.before, BROKEN,
            f"the responses {a} and {b} are exchanged, or the forces there{others}: {number}{cause.before:.2g}), with "
            f"{a} and {b} exchanged all are (scatter {cause.after:.2g})",
            "exchange the two responses, or the two forces: both make the FRFs reciprocal, look at the test set-up",
        )  # fmt: skip
        dofs = measurement.rows if side == 1 else measurement.columns
        own = tuple(int(dofs[i]) for i in cause.channels)
        text = f"{'responses' if side == 1 else 'forces'} {a} and {b} exchanged"
        return [finding], [Correction("exchanged", text, side, own, exchange=True)]
    if cause.kind in ("doubled response", "doubled force"):
        first, second = (names[i] for i in cause.channels)
        word = cause.kind.removeprefix("doubled ")
        finding = FrfFinding(
            "doubled", "error", (f"{word} {first}", f"{word} {second}"), cause.after, BROKEN / 2,
            f"{word} {second} shows what {word} {first} shows (scatter of their ratio {cause.after:.2g}), and "
            f"{number}{cause.before:.2g}), all with {second}",
            f"measure {second} again: its channel was connected to, or struck at, {first}",
        )  # fmt: skip
        return [finding], []
    if cause.kind == "channel":
        name = names[cause.channels[0]]
        finding = FrfFinding(
            "reciprocity", "error", (name,), cause.before, BROKEN,
            f"{number}{cause.before:.2g}), all with {name}: its response or force was measured elsewhere, or is noise",
            "look at place, direction and name of sensor and impacts of this DOF, or leave it out",
        )  # fmt: skip
        return [finding], []
    worst = np.argsort(-np.where(pairs.broken, pairs.scatter, -1))[: min(_SHOWN, int(pairs.broken.sum()))]
    some = ", ".join(f"{names[pairs.p[i]]} / {names[pairs.q[i]]}" for i in worst)
    finding = FrfFinding(
        "reciprocity", "error", tuple(dict.fromkeys(names[x] for i in worst for x in (pairs.p[i], pairs.q[i]))),
        cause.before, BROKEN,
        f"{number}{cause.before:.2g}): {some}{' and more' if pairs.broken.sum() > _SHOWN else ''}",
        "look at the order of rows and columns, and at places and directions of sensors and impacts",
    )  # fmt: skip
    return [finding], []
