"""Undamped modes of the assembly, and their panels: beams as lines, solids as shaded surfaces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from jointfrf.kernel.arguments import FloatArray
from jointfrf.models.model import Model, assemble
from jointfrf.workbench.cases.known_joint.keys import KnownJointCase
from jointfrf.workbench.report.figure import Curve, MovingBody, Panel, deformed_surface
from jointfrf.workbench.solids.solid import SolidModel

__all__ = ["ModeShapes", "find_modes", "mode_panels", "modes_of_case"]

#: Number of modes in figures, unless `expected.toml` contains more.
_SHOWN = 5
#: Modes below this fraction of the highest frequency are rigid-body motions; rounding makes them nonzero.
_RIGID = 1e-3
#: Points of a mode shape on each beam; deflections are cubic between the nodes.
_SHAPE_POINTS = 100
#: Axis limits of deflections with maximum 1.
_DEFLECTIONS = (-1.15, 1.15)


@dataclass(frozen=True)
class ModeShapes:
    """Undamped modes without rigid-body motions.

    Attributes
    ----------
    freq_hz : ndarray, shape (n,)
        Natural frequencies, Hz.
    shapes : ndarray, shape (n_dofs, n)
        Mode shapes, one column for each mode.
    dofs : tuple of str
        Names of the DOFs.
    directions : tuple of str
        Direction of the largest motion of a solid in each mode, "x", "y" or "z"; empty for other models.
    """

    freq_hz: FloatArray
    shapes: FloatArray
    dofs: tuple[str, ...]
    directions: tuple[str, ...] = ()


def modes_of_case(case: KnownJointCase) -> dict[str, ModeShapes]:
    """Return the modes of the assembly with the first estimate ("initial") and with the "actual" joint.

    The number of modes is the number in `expected.toml`, or a small default if that is larger. The result is empty if
    a substructure has receptances but no model.
    """
    if case.models is None:
        return {}
    a, b = case.models
    at = a.dofs(case.points["j"]), b.dofs(case.points["k"])
    wanted = max([_SHOWN, *(len(known.values) for known in case.expected.frequencies)])
    found = {
        name: find_modes(assemble(a.model, b.model, joint, *at), wanted)
        for name, joint in (("initial", case.initial), ("actual", case.joint))
    }
    solids = _solids(case)
    return found if solids is None else {name: _with_directions(modes, *solids) for name, modes in found.items()}


def find_modes(model: Model, count: int) -> ModeShapes:
    """Return the lowest undamped modes without rigid-body motions."""
    freq, shapes = model.modes(min(count + 3, len(model.dofs)))
    kept = np.flatnonzero(freq > _RIGID * freq.max(initial=0))[:count]
    return ModeShapes(freq[kept], shapes[:, kept], model.dofs)


def _solids(case: KnownJointCase) -> tuple[SolidModel, SolidModel] | None:
    if case.models is None:
        return None
    a, b = (one.model for one in case.models)
    return (a, b) if isinstance(a, SolidModel) and isinstance(b, SolidModel) else None


def _with_directions(modes: ModeShapes, a: SolidModel, b: SolidModel) -> ModeShapes:
    """Return modes with the direction of the largest motion of reference points; edges move differently in torsion."""
    names = {*a.references, *b.references}
    at = [[i for i, dof in enumerate(modes.dofs) if dof[2:] in {f"{name}:{axis}" for name in names}] for axis in "xyz"]
    squares = [(modes.shapes[rows] ** 2).sum(axis=0) for rows in at]
    return replace(modes, directions=tuple("xyz"[i] for i in np.argmax(squares, axis=0)))


def mode_panels(case: KnownJointCase, modes: ModeShapes) -> tuple[str, list[Panel]]:
    """Return the panels of mode shapes of solids or beams.

    Returns
    -------
    caption : str
        Caption of the figure.
    panels : list of Panel
        One panel for each mode; empty for models without geometry.
    """
    solids = _solids(case)
    if solids is not None:
        return "Mode shapes of the assembly; shade: displacement", _solid_panels(modes, *solids)
    x_a, x_b = (one.x for one in case.models) if case.models else (None, None)
    if x_a is None or x_b is None:
        return "", []
    return "Mode shapes of the assembly", _beam_panels(modes, x_a, x_b)


def _solid_panels(modes: ModeShapes, a: SolidModel, b: SolidModel) -> list[Panel]:
    outside = [(model, model.mesh.faces()[0]) for model in (a, b)]
    panels = []
    for mode, (freq, direction) in enumerate(zip(modes.freq_hz, modes.directions, strict=True)):
        parts = np.split(modes.shapes[:, mode], [len(a.dofs)])
        bodies = [
            MovingBody(model.mesh.nodes, faces, model.displacements(part))
            for (model, faces), part in zip(outside, parts, strict=True)
        ]
        title = f"mode {mode + 1}: {freq:.1f} Hz, mostly {direction}"
        panels.append(Panel(title, "", "", surface=deformed_surface(bodies)))
    return panels


def _beam_panels(modes: ModeShapes, x_a: FloatArray, x_b: FloatArray) -> list[Panel]:
    """Return panels of both beams in one line; B begins at the end of A."""
    panels = []
    for mode, freq in enumerate(modes.freq_hz):
        shape = dict(zip(modes.dofs, modes.shapes[:, mode], strict=True))
        largest = max((abs(v), v) for dof, v in shape.items() if dof.endswith(":y"))[1]
        curves = []
        for side, x, style in (("A", x_a, "actual"), ("B", x_a[-1] + x_b, "high")):
            # A node without DOFs is clamped.
            y, theta = (
                np.array([shape.get(f"{side}/{node + 1}:{direction}", 0.0) for node in range(x.size)]) / largest
                for direction in ("y", "theta")
            )
            fine = np.linspace(x[0], x[-1], max(_SHAPE_POINTS, x.size))
            curves.append(Curve(f"beam {side}", fine, CubicHermiteSpline(x, y, theta)(fine), style))
        title = f"mode {mode + 1}: {freq:.1f} Hz"
        panels.append(Panel(title, "x, m", "deflection, relative", tuple(curves), y_limits=_DEFLECTIONS))
    return panels
