"""Receptances over frequency: modulus and phase below each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.report.axes import FREQUENCY
from jointfrf.report.figure import Curve, NamedBands, Panel, Ribbon

__all__ = ["PHASE", "ReceptanceCurve", "phase_degrees", "receptance_panels", "side_by_side"]

PHASE = "phase, deg"
#: Between these lie the phases of a passive structure where response and force are at the same DOF; else the others.
_DRIVING, _ALL = (-200.0, 20.0), (-280.0, 100.0)
_QUARTER = 90.0
#: Heights of modulus and phase, and how far they shrink where more than so many stand below each other.
_HEIGHTS, _SHRUNK, _MOST = (0.85, 0.5), 0.8, 2


class ReceptanceCurve(NamedTuple):
    """A receptance `h` over frequency, shape (n_freq,), drawn in one of `jointfrf.report.draw.STYLES`."""

    label: str
    freq_hz: FloatArray
    h: ComplexArray
    style: str


def phase_degrees(h: ComplexArray) -> FloatArray:
    """Phase between -270 and 90 degrees: noise about -180, beyond a resonance, makes no jumps.

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf.report.receptance import phase_degrees
    >>> phase_degrees(np.array([1, -1j, -1 - 0.001j, -1 + 0.001j])).round().tolist()
    [0.0, -90.0, -180.0, -180.0]
    """
    return np.asarray(np.degrees(np.angle(h * 1j)) - 90, np.float64)


def receptance_panels(
    title: str, label: str, curves: Sequence[ReceptanceCurve], ribbons: tuple[Ribbon, ...] = (), shades: NamedBands = ()
) -> tuple[Panel, Panel]:
    """Draw the modulus of receptances and, below it on the same lines, their phase.

    Parameters
    ----------
    title, label : str
        Of the modulus.
    curves : sequence of ReceptanceCurve
    ribbons : tuple of Ribbon
        Areas of the modulus.
    shades : tuple of (label, bands)

    Returns
    -------
    modulus, phase : Panel
    """
    moduli = tuple(Curve(one.label, one.freq_hz, np.abs(one.h), one.style) for one in curves)
    phases = tuple(Curve(one.label, one.freq_hz, phase_degrees(one.h), one.style) for one in curves)
    driving = all(_DRIVING[0] <= one.y.min() and one.y.max() <= _DRIVING[1] for one in phases)
    return (
        Panel(title, "", label, moduli, ribbons, shades=shades, log_y=True, height=_HEIGHTS[0]),
        Panel(
            "", FREQUENCY, PHASE, phases, shades=shades, y_limits=_DRIVING if driving else _ALL, y_step=_QUARTER,
            height=_HEIGHTS[1],
        ),
    )  # fmt: skip


def side_by_side(pairs: Sequence[tuple[Panel, Panel]], columns: int) -> tuple[Panel, ...]:
    """Arrange moduli in rows, each with a row of its phases below."""
    arranged: list[Panel] = []
    shrink = _SHRUNK if len(pairs) > _MOST * columns else 1.0
    for first in range(0, len(pairs), columns):
        row = list(pairs[first : first + columns])
        row += [(Panel("", "", ""),) * 2] * (columns - len(row))
        arranged += [replace(panel, height=shrink * panel.height) for part in zip(*row, strict=True) for panel in part]
    return tuple(arranged)
