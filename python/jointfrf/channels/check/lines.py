"""Frequency lines that cannot be used: NaN, 0 Hz, frequencies that do not increase."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.finding import FrfFinding
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["find_bad_lines"]


def find_bad_lines(
    freq_hz: FloatArray, h: ComplexArray, responses: tuple[str, ...], forces: tuple[str, ...]
) -> tuple[list[FrfFinding], NDArray[np.bool_]]:
    """Return what is wrong with lines, and which lines are good."""
    findings = []
    finite = np.isfinite(h)
    good = np.asarray(finite.all(axis=(1, 2)))
    if not good.all():
        findings.append(_not_finite(freq_hz, finite, good, responses, forces))
    zero = freq_hz == 0
    if zero.any():
        findings.append(
            FrfFinding(
                "zero-frequency", "warning", (), int(zero.sum()), 0,
                f"line {int(np.argmax(zero))} is at 0 Hz, where sensors of acceleration measure nothing and viscous "
                "damping does not act",
                "leave it out",
            )
        )  # fmt: skip
    ascending = np.ones(freq_hz.size, bool)
    ascending[1:] = freq_hz[1:] > np.maximum.accumulate(freq_hz)[:-1]
    if not ascending.all():
        first = int(np.argmin(ascending))
        findings.append(
            FrfFinding(
                "lines", "error", (), int((~ascending).sum()), 0,
                f"frequencies do not increase at line {first}: {freq_hz[first - 1]:g} Hz, then {freq_hz[first]:g} Hz",
                "sort the lines and keep each frequency once",
            )
        )  # fmt: skip
    return findings, good & ~zero & ascending


def _not_finite(
    freq_hz: FloatArray,
    finite: NDArray[np.bool_],
    good: NDArray[np.bool_],
    responses: tuple[str, ...],
    forces: tuple[str, ...],
) -> FrfFinding:
    """Name the channels that hold NaN, or the lines where all do."""
    bad = ~finite
    rows, columns = np.asarray(bad.any(axis=(0, 2))), np.asarray(bad.any(axis=(0, 1)))
    some: tuple[str, ...] = ()
    if not rows.all() and rows.sum() <= columns.sum():
        some = tuple(f"response {name}" for name, is_bad in zip(responses, rows, strict=True) if is_bad)
    elif not columns.all():
        some = tuple(f"force {name}" for name, is_bad in zip(forces, columns, strict=True) if is_bad)
    where = " of " + ", ".join(some) if some else ""
    first = int(np.argmin(good))
    return FrfFinding(
        "lines", "error", some, int((~good).sum()), 0,
        f"NaN or Inf{where} in {(~good).sum()} of {good.size} lines, the first is line {first} ({freq_hz[first]:g} Hz)",
        "leave these lines out, or these channels",
    )  # fmt: skip
