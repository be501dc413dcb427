"""Static state of a bolted lap joint under preload, and the linear model about it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jointfrf.dofs import DIRECTIONS
from jointfrf.kernel.arguments import FloatArray, as_count, as_positive, check_type
from jointfrf.workbench.cases.bolted_lap.contact import ContactLaw, InterfaceState, Iteration, Pairs, solve_contact, tie
from jointfrf.workbench.cases.bolted_lap.lap import INTERFACES, BoltedLap
from jointfrf.workbench.solids.brick import Formulation, assemble_bricks
from jointfrf.workbench.solids.brick_beam import PRESETS
from jointfrf.workbench.solids.mesh import NEAR
from jointfrf.workbench.solids.solid import SolidModel, solid_model

__all__ = ["PreloadedLap", "preload"]


class PressureMap(NamedTuple):
    """Contact pressure of an interface.

    Attributes
    ----------
    points : ndarray, shape (n, 2)
        Coordinates z and x before loading, m.
    quads : ndarray of int, shape (n_quads, 4)
        Corners of the quadrilaterals, as positions in `points`.
    pressure : ndarray, shape (n,)
        Pressure, Pa; 0 at open pairs.
    closed, slipping : ndarray of bool, shape (n,)
        Pairs in contact, and slipping pairs.
    nodes : ndarray of int, shape (n,)
        Nodes of the mesh on the upper body, counted from 0.
    """

    points: FloatArray
    quads: NDArray[np.int32]
    pressure: FloatArray
    closed: NDArray[np.bool_]
    slipping: NDArray[np.bool_]
    nodes: NDArray[np.int32]


@dataclass(frozen=True)
class PreloadedLap:
    """Static state of a bolted lap joint after tightening.

    Attributes
    ----------
    lap : BoltedLap
        Mesh of the lap joint.
    force : float
        Preload, N.
    law : ContactLaw
        Contact law of all interfaces.
    elongation : float
        Overlap of the two halves of the shank at the cut, m. It is the sum of the elongation of the bolt and the
        compression of the clamped parts.
    displacement : ndarray, shape (n_nodes, 3)
        Displacements of the nodes, m. Nodes at the cut have the displacement of the upper half of the shank.
    interfaces : dict of str to InterfaceState
        States of "head", "lap" and "nut", with the pairs in the order of `lap.interfaces`.
    history : tuple of Iteration
        Iterations of the active set; no contact changes in the last iteration.
    """

    lap: BoltedLap
    force: float
    law: ContactLaw
    elongation: float
    displacement: FloatArray
    interfaces: Mapping[str, InterfaceState]
    history: tuple[Iteration, ...]

    @property
    def contact_radius(self) -> float:
        """Distance from the axis of the bolt to the outermost closed pair of the lap, m."""
        nodes = self.lap.interfaces["lap"].upper[self.interfaces["lap"].closed]
        return float(np.linalg.norm((self.lap.mesh.nodes[nodes] - self.lap.axis)[:, [0, 2]], axis=1).max())

    def pressure_maps(self) -> dict[str, PressureMap]:
        """Return the contact pressure of "head" (upper face of A), "lap" and "nut" (lower face of B) in plan view."""
        nodes, (faces, _) = self.lap.mesh.nodes, self.lap.mesh.faces()
        height = nodes[:, 1]
        flat = faces[np.ptp(height[faces], axis=1) < NEAR * np.ptp(height)]
        maps = {}
        for name in INTERFACES:
            upper, state = self.lap.interfaces[name].upper, self.interfaces[name]
            number = np.full(len(nodes), -1)
            number[upper] = np.arange(len(upper))
            quads = number[flat]
            quads = quads[(quads >= 0).all(axis=1)].astype(np.int32)
            points = nodes[upper][:, [2, 0]]
            maps[name] = PressureMap(points, quads, state.pressure, state.closed, state.slipping, upper)
        return maps

    def model(self) -> SolidModel:
        """Return the linear model for small vibrations about this state, with a fixed length of the shank.

        Returns
        -------
        SolidModel
            Model with DOFs ``"1:x"``. `SolidModel.expansion` gives the displacements of all nodes.

        Notes
        -----
        Springs of the contact law connect closed pairs along y, and sticking pairs also along x and z. A rigid law
        eliminates the upper node. Slipping pairs are free along x and z, open pairs in all directions. If all materials
        have the same loss factor, it applies to the whole stiffness, including the springs between faces. Otherwise
        these springs have no loss factor.
        """
        formulation = PRESETS[self.lap.preset]
        bodies = solid_model(
            self.lap.mesh, self.lap.element_materials(), formulation=formulation, clamped=self.lap.clamped
        )
        pairs = Pairs(self.lap.interfaces, 3 * len(self.lap.mesh.nodes))
        closed, slipping = (
            np.concatenate([getattr(self.interfaces[name], key) for name in self.lap.interfaces])
            for key in ("closed", "slipping")
        )
        sticking = closed & ~slipping
        expansion, independent = tie(pairs, pairs.tied(self.law, closed, sticking), self.lap.held())
        springs = pairs.springs(self.law, closed, sticking)
        to_bodies = sparse.csr_array(bodies.expansion.T @ expansion)
        structural = bodies.structural_damping
        return replace(
            bodies,
            stiffness=sparse.csr_array(to_bodies.T @ bodies.stiffness @ to_bodies + expansion.T @ springs @ expansion),
            mass=sparse.csr_array(to_bodies.T @ bodies.mass @ to_bodies),
            structural_damping=None if structural is None else sparse.csr_array(to_bodies.T @ structural @ to_bodies),
            dofs=tuple(f"{dof // 3 + 1}:{DIRECTIONS[dof % 3]}" for dof in independent.tolist()),
            expansion=expansion,
        )


def preload(lap: BoltedLap, force: float, law: ContactLaw | None = None, *, max_iterations: int = 50) -> PreloadedLap:
    """Return the static state of a lap joint under the preload of its bolt.

    Parameters
    ----------
    lap : BoltedLap
        Mesh of the lap joint.
    force : float
        Preload, N; see `preload_force`.
    law : ContactLaw, optional
        Contact law of all three interfaces, default ``ContactLaw()``.
    max_iterations : int
        Largest number of iterations, default 50.

    Returns
    -------
    PreloadedLap

    Raises
    ------
    ValueError
        A force that is not positive; no clamped end; contact that does not converge, opens everywhere, or leaves a body
        free to move.
    TypeError
        A lap or a law of a wrong type.

    See Also
    --------
    jointfrf.workbench.cases.bolted_lap.lap.bolted_lap : Mesh of a lap joint.
    jointfrf.workbench.cases.bolted_lap.lap.preload_force : Preload force of a bolt.
    jointfrf.workbench.cases.bolted_lap.contact.solve_contact : Static equilibrium with contact.

    Notes
    -----
    The shank is cut at the plane between the beams. The overlap of its halves is one unknown length, and the preload is
    the force on it. `PreloadedLap.model` then fixes this length and linearises bodies and contacts about this state.
    The bolt needs no artificial support, because all contacts are initially closed and sticking.

    Results of the case study (3840 bricks, "accurate", 22784 N), with faces of finite stiffness and with rigid faces:

    ================================  ==========  =====  =====  =====  =====  =====  =====  =====
    law                               elongation  natural frequencies, Hz
    --------------------------------  ----------  -----------------------------------------------
    ``ContactLaw()``                  83.8 um     14.66  60.42  86.86  261.4  345.2  485.0  553.6
    ``ContactLaw(0.3, None, None)``   74.1 um     14.68  60.56  87.43  261.4  349.5  488.7  555.5
    ================================  ==========  =====  =====  =====  =====  =====  =====  =====

    Every pair sticks with the first law. With the second, 80 of 400 closed pairs slip, at the edges of head and nut.

    Examples
    --------
    >>> from jointfrf.workbench.cases.bolted_lap.lap import LapDivisions, bolted_lap
    >>> from jointfrf.workbench.cases.bolted_lap.preload import preload
    >>> coarse = LapDivisions(across=4, rings=1, circles=0, head=1, nut=1)
    >>> tight = preload(bolted_lap((0.1, 0.1), divisions=coarse), 20e3)
    >>> {name: round(state.normal_force, 6) for name, state in tight.interfaces.items()}
    {'head': 20000.0, 'lap': 20000.0, 'nut': 20000.0}
    """
    check_type("lap", lap, BoltedLap)
    used = ContactLaw() if law is None else law
    check_type("law", used, ContactLaw)
    as_positive("force", force, "N")
    iterations = as_count("max_iterations", max_iterations)
    if lap.clamped.size == 0:
        raise ValueError("lap is not supported: one of its ends must be clamped")
    formulation = PRESETS[lap.preset]
    k, _ = assemble_bricks(lap.mesh.nodes, lap.mesh.elements, lap.element_materials(), formulation)
    coupling, own = _cut(lap, formulation)
    column = sparse.csr_array(coupling[:, None])
    cut = sparse.csr_array(sparse.block_array([[k, column], [column.T, sparse.csr_array([[own]])]], format="csr"))
    load = np.append(np.zeros(len(coupling)), force)
    solution = solve_contact(cut, load, lap.interfaces, used, fixed=lap.held(), max_iterations=iterations)
    return PreloadedLap(
        lap=lap,
        force=force,
        law=used,
        elongation=float(solution.displacement[-1]),
        displacement=solution.displacement[:-1].reshape(-1, 3),
        interfaces={name: solution.interfaces[name] for name in lap.interfaces},
        history=solution.history,
    )


def _cut(lap: BoltedLap, formulation: Formulation) -> tuple[FloatArray, float]:
    """Return the forces on all DOFs, and on the overlap itself, due to an overlap of 1 m at the cut of the shank."""
    nodes, elements = lap.mesh.nodes, lap.mesh.elements[lap.elements("bolt")]
    height = nodes[:, 1] - lap.axis[1]
    near = NEAR * np.ptp(height)
    below = elements[(height[elements] < near).all(axis=1)]
    drawn = np.zeros(nodes.size)
    drawn[3 * np.unique(below[height[below] > -near]) + 1] = 1
    k, _ = assemble_bricks(nodes, below, lap.materials[2], formulation)
    coupling: FloatArray = k @ drawn
    return coupling, float(drawn @ coupling)
