"""Channels without a signal, and channels that hold the same signal twice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.channels.check.finding import FrfFinding
from jointfrf.channels.check.measurement import Measurement
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["SMOOTH", "BadSignals", "check_signals", "smoothness"]

#: Below this agreement of the phase from line to line an FRF is noise.
SMOOTH = 0.3
#: FRFs that agree to this share are copies: two measurements differ by their noise.
_SAME = 1e-6
#: Rows that are less alike than this are not compared entry by entry.
_ALIKE = 0.999


@dataclass(frozen=True)
class BadSignals:
    """Findings, and responses and forces that nothing else can be said of."""

    findings: list[FrfFinding]
    rows: list[int]
    columns: list[int]


def smoothness(h: ComplexArray) -> FloatArray:
    """Agreement of the phase of each FRF from line to line: 1 for a smooth one, about 1/sqrt(n_freq) for noise, 0 for 0."""
    with np.errstate(invalid="ignore", divide="ignore"):
        phasor = np.where(h != 0, h / abs(h), 0)
    together: FloatArray = abs((phasor[:-1].conj() * phasor[1:]).mean(axis=0))
    return together


def check_signals(measurement: Measurement) -> BadSignals:
    """Find responses and forces that are dead or doubled."""
    findings: list[FrfFinding] = []
    bad: list[list[int]] = []
    across = measurement.h.swapaxes(1, 2)
    for word, names, h in (("response", measurement.responses, measurement.h), ("force", measurement.forces, across)):
        dead, values = _dead(h)
        findings += [_dead_finding(word, names[i], values[i]) for i in dead]
        copies = _copies(h, dead)
        findings += [_copy_finding(word, names[i], names[j], value) for i, j, value in copies]
        bad.append([*dead, *(j for _, j, _ in copies)])
    return BadSignals(findings, *bad)


def _dead(h: ComplexArray) -> tuple[list[int], FloatArray]:
    """Rows that are zero or noise in all columns, unless all rows are; the smoothness of the smoothest entry."""
    smooth = smoothness(h).max(axis=1, initial=0.0)
    dead = np.flatnonzero(smooth < max(SMOOTH, 4 / np.sqrt(max(h.shape[0], 1))))
    return ([] if dead.size == h.shape[1] and h.shape[1] > 1 and smooth.max() > 0 else dead.tolist()), smooth


def _dead_finding(word: str, name: str, value: float) -> FrfFinding:
    what = "is zero" if value == 0 else f"is noise: its phase agrees by {value:.2f} from line to line"
    remedy = "connect or replace the sensor" if word == "response" else "repeat the impacts"
    return FrfFinding(
        "dead", "error", (f"{word} {name}",), float(value), SMOOTH, f"{word} {name} {what}", f"{remedy}, or leave it out"
    )


def _copies(h: ComplexArray, dead: list[int]) -> list[tuple[int, int, float]]:
    """Pairs of rows that are equal to rounding up to a real factor, and by how much they differ."""
    with np.errstate(invalid="ignore", divide="ignore"):
        size = np.sqrt((abs(h) ** 2).mean(axis=(0, 1), keepdims=True))
        flat = np.where(size > 0, h / size, 0).swapaxes(0, 1).reshape(h.shape[1], -1)
    flat = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), np.finfo(float).tiny)
    product = (flat.conj() @ flat.T).real
    found: list[tuple[int, int, float]] = []
    for i, j in zip(*np.nonzero(np.triu(abs(product) > _ALIKE, 1)), strict=True):
        if i in dead or j in dead or any(j == other for _, other, _ in found):
            continue
        differs = float(np.median(abs(flat[j] - product[i, j] * flat[i])) / np.median(abs(flat[j])))
        if differs < _SAME:
            found.append((int(i), int(j), differs))
    return found


def _copy_finding(word: str, first: str, second: str, value: float) -> FrfFinding:
    names = (f"{word} {first}", f"{word} {second}")
    return FrfFinding(
        "doubled", "error", names, value, _SAME,
        f"{word}s {first} and {second} hold the same numbers, noise included (difference {value:.1e})",
        "measure one of them again: two DOFs need two measurements",
    )  # fmt: skip
