"""Drawings of solid models, as data."""

from __future__ import annotations

import numpy as np

from jointfrf.cases.known_joint.compute import Modes
from jointfrf.report.plots import Panel, Surface
from jointfrf.solids.solid import SolidModel

__all__ = ["solid_modes"]

#: Largest displacement drawn, as a share of the length of the structure.
_DEFLECTION = 0.12


def solid_modes(modes: Modes, a: SolidModel, b: SolidModel) -> list[Panel]:
    """Draw the mode shapes of an assembly of two solids: deformed surfaces, darker where they move more.

    Parameters
    ----------
    modes : Modes
        DOFs of A, then of B.
    a, b : SolidModel

    Returns
    -------
    list of Panel
        One a mode.
    """
    everything = np.concatenate([a.mesh.nodes, b.mesh.nodes])
    reach = _DEFLECTION * np.ptp(everything, axis=0).max()
    panels = []
    for mode, freq in enumerate(modes.freq_hz):
        shape = modes.shapes[:, mode]
        faces, moved = [], []
        for model, own in ((a, shape[: len(a.dofs)]), (b, shape[len(a.dofs) :])):
            outer, _ = model.mesh.faces()
            motion = model.displacements(own)
            faces.append((model.mesh.nodes, motion, outer))
            moved.append(np.linalg.norm(motion, axis=1))
        largest = max(float(m.max()) for m in moved)
        drawn = np.concatenate([(nodes + reach / largest * motion)[outer] for nodes, motion, outer in faces])
        values = np.concatenate(
            [(m / largest)[outer].mean(axis=1) for m, (_, _, outer) in zip(moved, faces, strict=True)]
        )
        most = f", mostly {modes.directions[mode]}" if modes.directions else ""
        rest = np.concatenate([nodes[outer] for nodes, _, outer in faces])
        surface = Surface(drawn, values, edges=rest)
        panels.append(Panel(f"mode {mode + 1}: {freq:.1f} Hz{most}", "", "", surface=surface))
    return panels
