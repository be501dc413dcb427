"""FRFs over frequency: modulus and phase below each other, and their estimated noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from jointfrf.dofs import compliance_unit
from jointfrf.frf.noise_model import NoiseModel
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.workbench.report.axes import FREQUENCY
from jointfrf.workbench.report.figure import Curve, Figure, NamedBands, Panel, Ribbon

__all__ = [
    "PHASE",
    "ReceptanceCurve",
    "noise_figure",
    "noise_panel",
    "phase_degrees",
    "receptance_panels",
    "side_by_side",
]

#: Label of the axis.
PHASE = "phase, deg"
#: Range of the phases of a passive structure with response and force at the same DOF, and range of other phases.
_DRIVING, _ALL = (-200.0, 20.0), (-280.0, 100.0)
#: Distance of the numbers along the axis of a phase.
_QUARTER = 90.0
#: Heights of modulus and phase; their scale if there are many rows, and the number of rows above which it applies.
_HEIGHTS, _SHRUNK, _MOST = (0.85, 0.5), 0.8, 2


class ReceptanceCurve(NamedTuple):
    """A receptance `h` over frequency, shape (n_freq,), drawn in one of `draw.STYLES`."""

    label: str
    freq_hz: FloatArray
    h: ComplexArray
    style: str


def phase_degrees(h: ComplexArray) -> FloatArray:
    """Return the phase between -270 and 90 degrees, without jumps by noise about -180 beyond a resonance.

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf.workbench.report.receptance import phase_degrees
    >>> phase_degrees(np.array([1, -1j, -1 - 0.001j, -1 + 0.001j])).round().tolist()
    [0.0, -90.0, -180.0, -180.0]
    """
    return np.asarray(np.degrees(np.angle(h * 1j)) - 90, np.float64)


def receptance_panels(
    title: str, label: str, curves: Sequence[ReceptanceCurve], ribbons: tuple[Ribbon, ...] = (), shades: NamedBands = ()
) -> tuple[Panel, Panel]:
    """Return panels of the modulus of receptances and of their phase below it.

    Parameters
    ----------
    title, label : str
        Title and label of the axis of the modulus.
    curves : sequence of ReceptanceCurve
        Receptances.
    ribbons : tuple of Ribbon
        Areas of the modulus.
    shades : tuple of (label, bands)
        Shaded bands, Hz.

    Returns
    -------
    modulus, phase : Panel
        Panels with the same lines.
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
    """Return panels in rows: a row of moduli, and a row of their phases below."""
    arranged: list[Panel] = []
    shrink = _SHRUNK if len(pairs) > _MOST * columns else 1.0
    for first in range(0, len(pairs), columns):
        row = list(pairs[first : first + columns])
        row += [(Panel("", "", ""),) * 2] * (columns - len(row))
        arranged += [replace(panel, height=shrink * panel.height) for part in zip(*row, strict=True) for panel in part]
    return tuple(arranged)


#: Largest number of FRFs on a page.
_MOST_PANELS = 6
#: Share of the noise below which a part is not drawn.
_LEAST = 0.02
#: Correlation of the noise of neighbouring lines above which it is reported.
_CORRELATED = 1.2
#: Decades of a panel below the first quartile of the noise.
_BELOW = 1.0


def noise_figure(
    freq_hz: FloatArray,
    h: ComplexArray,
    noise: NoiseModel,
    responses: Sequence[str],
    forces: Sequence[str],
    *,
    entries: Sequence[tuple[int, int]] = (),
) -> Figure:
    """Return a figure of FRFs, smooth FRFs, the parts of their estimated noise, and outlying lines.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Lines, Hz.
    h : ndarray, shape (n_freq, n_out, n_in)
        Measured receptances.
    noise : NoiseModel
        Noise of the FRFs from `estimate_noise`.
    responses, forces : sequence of str
        Names of the channels; their directions give the units.
    entries : sequence of (int, int)
        Rows and columns of the FRFs to draw, default the first FRF in each row whose noise is known, at most six.

    Returns
    -------
    Figure
        Figure with the key ``"noise_found"``.
    """
    known = (noise.relative > 0) | (noise.floor > 0) | (noise.coherence_factor > 0)
    if not entries:
        first = [(p, p if p < len(forces) and known[p, p] else int(known[p].argmax())) for p in range(len(responses))]
        entries = [(p, q) for p, q in first if known[p, q]][:_MOST_PANELS]
    panels = [
        noise_panel(freq_hz, h[:, p, q], noise, (p, q), (responses[p], forces[q]))
        for p, q in entries
    ]  # fmt: skip
    return Figure("noise_found", _caption(noise), tuple(panels), 2 if len(panels) > 1 else 1, heading=_caption(noise))


def _caption(noise: NoiseModel) -> str:
    level = f"{100 * noise.level:.2g} % of the FRFs" if noise.level < 1 else "as large as the FRFs"
    words = f"Noise found in the FRFs: {level} (median)"
    if noise.inflation > _CORRELATED:
        words += f", correlated over {noise.inflation:.2g} lines"
    if noise.outlying.size:
        count = noise.outlying.size
        words += f", {count} outlying {'line' if count == 1 else 'lines'}"
    return words


def noise_panel(
    freq_hz: FloatArray, h: ComplexArray, noise: NoiseModel, entry: tuple[int, int], names: tuple[str, str]
) -> Panel:
    """Return a panel of one FRF: measured and smooth modulus, standard deviation of the noise and of its parts.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Lines, Hz, in any order.
    h : ndarray, shape (n_freq,)
        Measured receptance.
    noise : NoiseModel
        Noise of all FRFs.
    entry : (int, int)
        Row and column of the FRF.
    names : (str, str)
        Names of response and force.
    """
    up = np.argsort(freq_hz)
    at = (slice(None), *entry)
    freq: FloatArray = freq_hz[up]
    smooth = np.asarray(abs(noise.smooth.h[at])[up], np.float64)
    found = np.asarray(np.sqrt(noise.variance[at])[up], np.float64)
    usual = np.asarray(np.sqrt(noise.line_level)[up], np.float64)
    outlying = (noise.line_factor > 1)[up]
    level = np.asarray(np.sqrt((noise.variance[at] / noise.line_factor)[up]), np.float64)
    parts: list[tuple[str, FloatArray, str]] = [
        ("relative part", noise.relative[entry] * smooth * usual, "low"),
        (
            "part constant in acceleration" if noise.floor_of_acceleration else "constant part",
            np.asarray(noise.floor[entry] * np.sqrt(noise.floor_shape(freq_hz)[up]) * usual),
            "damping",
        ),
    ]
    if noise.coherence_factor[entry] > 0:
        rest = level**2 - sum(part**2 for _, part, _ in parts)
        parts.append(("part from coherence", np.asarray(np.sqrt(np.maximum(rest, 0))), "stiffness-initial"))
    curves = [Curve("measured", freq, np.asarray(abs(h)[up], np.float64), "dots")]
    if noise.smooth.is_smooth:
        curves.append(Curve("smooth", freq, smooth, "actual"))
    curves += [
        Curve(label, freq, part, style) for label, part, style in parts if (part > _LEAST * level).mean() > _LEAST
    ]
    curves.append(Curve("noise, standard deviation", freq, level, "mean"))
    if outlying.any():
        curves.append(Curve("noise of outlying lines", freq[outlying], found[outlying], "outlying"))
    low, high = float(np.quantile(level, 0.25)), float(max(abs(h).max(), found.max()))
    title = f"response {names[0]}, force {names[1]}"
    dofs = [name.rpartition(":")[2].lstrip("+-") for name in names]
    label = f"modulus, {compliance_unit(dofs[0], dofs[1])}"
    limits = (10.0 ** (np.log10(low) - _BELOW), 1.5 * high) if low > 0 else None
    return Panel(title, FREQUENCY, label, tuple(curves), log_y=True, y_limits=limits)
