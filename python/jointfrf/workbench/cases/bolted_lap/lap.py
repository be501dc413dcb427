"""Mesh of two beams and a bolt of solid elements in a lap joint, with its interfaces and the preload force."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from jointfrf.kernel.arguments import FloatArray, as_count, as_positive, check_choice, check_type, one_line
from jointfrf.models.beam import End, check_ends
from jointfrf.workbench.cases.bolted_lap.contact import ContactInterface
from jointfrf.workbench.solids.brick import Material, brick_quality
from jointfrf.workbench.solids.brick_beam import Preset, holed_plan
from jointfrf.workbench.solids.mesh import NEAR, Mesh, Plan, disc, extrude, join_plans, rectangle

__all__ = [
    "ALUMINIUM",
    "BODIES",
    "INTERFACES",
    "PROOF_STRENGTH",
    "STRESS_AREA",
    "Bolt",
    "BoltedLap",
    "LapDivisions",
    "bolted_lap",
    "lap_bricks",
    "preload_force",
]

#: Typical values of steel.
STEEL: Final = Material(youngs_modulus=210e9, poisson=0.3, density=7850.0, loss_factor=0.01)

#: Proof strength of a property class, Pa: ISO 898-1, Table 3, diameters up to 16 mm.
PROOF_STRENGTH: Final[dict[str, float]] = {
    "4.6": 225e6,
    "4.8": 310e6,
    "5.6": 280e6,
    "5.8": 380e6,
    "6.8": 440e6,
    "8.8": 580e6,
    "9.8": 650e6,
    "10.9": 830e6,
    "12.9": 970e6,
}
#: Tensile stress area of coarse metric threads, m^2: ISO 898-1, Table 4.
STRESS_AREA: Final[dict[str, float]] = {"M5": 14.2e-6, "M6": 20.1e-6, "M8": 36.6e-6, "M10": 58.0e-6, "M12": 84.3e-6}
#: Material of the beams of case study 2.
ALUMINIUM: Final = Material(youngs_modulus=70e9, poisson=0.33, density=2700.0, loss_factor=0.01)
Body = Literal["A", "B", "bolt"]
#: The bodies in the order of their elements.
BODIES: Final[tuple[Body, ...]] = get_args(Body)
#: Lower and upper body of each interface.
INTERFACES: Final[dict[str, tuple[Body, Body]]] = {"head": ("A", "bolt"), "lap": ("B", "A"), "nut": ("bolt", "B")}
#: Number of bricks along a beam outside the overlap, for a length equal to the height.
_PER_HEIGHT: Final = 1.14
#: Extent of the circles around the head, as a fraction of the distance to the nearest edge.
_CIRCLES_REACH: Final = 0.6
#: Least accepted scaled Jacobian.
_POOR: Final = 0.2


@dataclass(frozen=True)
class Bolt:
    """Shank, head and nut as one body without thread.

    Parameters
    ----------
    shank_radius, head_radius, nut_radius : float
        Radii of the shank, the round head and the round nut, m.
    head_height, nut_height : float
        Heights of head and nut, m.
    material : Material
        Material of the bolt, default steel.

    Raises
    ------
    ValueError
        A dimension that is not positive; a head or nut that is not wider than the shank.

    See Also
    --------
    bolted_lap : Lap joint with a bolt.

    Examples
    --------
    The default is an M8 bolt:

    >>> from jointfrf.workbench.cases.bolted_lap.lap import Bolt
    >>> Bolt().shank_radius, Bolt().head_height
    (0.004, 0.0053)
    """

    shank_radius: float = 0.004
    head_radius: float = 0.0065
    head_height: float = 0.0053
    nut_radius: float = 0.0065
    nut_height: float = 0.0068
    material: Material = STEEL

    def __post_init__(self) -> None:
        for name in ("shank_radius", "head_radius", "head_height", "nut_radius", "nut_height"):
            as_positive(name, getattr(self, name), "m")
        for name in ("head_radius", "nut_radius"):
            if getattr(self, name) <= self.shank_radius:
                radius, shank = 1e3 * getattr(self, name), 1e3 * self.shank_radius
                raise ValueError(f"{name} ({radius:g} mm) must exceed shank_radius ({shank:g} mm)")


def preload_force(tensile_area: float, proof_strength: float, share: float = 0.75) -> float:
    """Return the preload of a bolt, F_i = share A_t S_p (4.3)-(4.4).

    Parameters
    ----------
    tensile_area : float
        Tensile stress area A_t of the thread, m^2; see `STRESS_AREA`.
    proof_strength : float
        Proof strength S_p, Pa; see `PROOF_STRENGTH`.
    share : float
        Fraction of the proof load, default 0.75. Usual values are 0.75 for connections that are taken apart again, and
        0.9 for permanent connections.

    Returns
    -------
    float
        Preload force, N.

    Raises
    ------
    ValueError
        A value that is not positive; a share above 1.

    See Also
    --------
    jointfrf.workbench.cases.bolted_lap.preload.preload : Static state under this force.

    Examples
    --------
    An M8 bolt of class 10.9:

    >>> from jointfrf.workbench.cases.bolted_lap.lap import PROOF_STRENGTH, STRESS_AREA, preload_force
    >>> round(preload_force(STRESS_AREA["M8"], PROOF_STRENGTH["10.9"]), 1)
    22783.5
    """
    for name, value in (("tensile_area", tensile_area), ("proof_strength", proof_strength), ("share", share)):
        as_positive(name, value)
    if share > 1:
        raise ValueError(f"share must not exceed 1, the proof load itself, not {share:g}")
    return share * tensile_area * proof_strength  # (4.3), (4.4)


@dataclass(frozen=True)
class LapDivisions:
    """Numbers of bricks of a lap joint.

    Parameters
    ----------
    across : int
        Number of bricks along x, and along a quarter of the hole.
    layers : int
        Number of bricks over the height of each beam, and of the shank within the beam.
    rings : int
        Number of rings around the hole, under the head and the nut.
    circles : int
        Number of circles around the head, before two layers from the last circle to the edges.
    head, nut : int
        Numbers of bricks over the heights of head and nut.
    along : int, optional
        Number of bricks along each beam outside the overlap; by default, bricks are slightly shorter than the beam is
        high.

    Raises
    ------
    ValueError
        A number that is not whole or below 1 (`circles`: 0).
    """

    across: int = 8
    layers: int = 2
    rings: int = 2
    circles: int = 4
    head: int = 2
    nut: int = 2
    along: int | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None:
                as_count(field.name, value, 0 if field.name == "circles" else 1)


@dataclass(frozen=True)
class BoltedLap:
    """Mesh of two beams along z, A on top of B, and the bolt through their overlap; the three bodies share no node.

    Attributes
    ----------
    mesh : Mesh
        Elements of A, then of B, then of the bolt.
    body : ndarray of str, shape (n_elements,)
        Body of each element: "A", "B" or "bolt".
    materials : tuple of Material
        Materials of A, B and the bolt.
    interfaces : dict of str to ContactInterface
        Pairs of nodes at the same place: "head" (bolt on A), "lap" (A on B) and "nut" (B on the bolt).
    clamped : ndarray of int
        Fixed nodes, counted from 0.
    axis : ndarray, shape (3,)
        Intersection of the axis of the bolt with the plane between the beams, m. The preload acts at this cut of the
        shank.
    preset : {"seed", "accurate"}
        Elements; see `brick_beam`.

    See Also
    --------
    bolted_lap : Mesh from dimensions.
    """

    mesh: Mesh
    body: NDArray[np.str_]
    materials: tuple[Material, Material, Material]
    interfaces: dict[str, ContactInterface]
    clamped: NDArray[np.int32]
    axis: FloatArray
    preset: Preset

    def elements(self, body: Body) -> NDArray[np.intp]:
        """Return the elements of a body, counted from 0."""
        check_choice("body", body, BODIES)
        return np.flatnonzero(self.body == body)

    def held(self) -> NDArray[np.int64]:
        """Return the DOFs x, y, z of the clamped nodes."""
        return (3 * self.clamped[:, None].astype(np.int64) + np.arange(3)).ravel()

    def element_materials(self) -> list[Material]:
        """Return the material of every element."""
        named = dict(zip(BODIES, self.materials, strict=True))
        return [named[name] for name in self.body.tolist()]


def bolted_lap(
    lengths: tuple[float, float] = (0.3, 0.3),
    heights: tuple[float, float] = (0.006, 0.006),
    width: float = 0.025,
    overlap: float = 0.025,
    hole_radius: float = 0.0045,
    bolt: Bolt | None = None,
    *,
    materials: tuple[Material, Material] = (ALUMINIUM, ALUMINIUM),
    ends: tuple[End, End] = ("clamped", "free"),
    preset: Preset = "accurate",
    divisions: LapDivisions | None = None,
) -> BoltedLap:
    """Return the mesh of a lap joint with a bolt of solid elements, case study 2 by default.

    A extends from z = 0 and upwards from y = 0. B begins at z = length of A minus overlap, and extends downwards from
    y = 0. The axis of the bolt is parallel to y through the middle of the overlap.

    Parameters
    ----------
    lengths, heights : tuple of float
        Lengths and heights of A and of B, m.
    width, overlap, hole_radius : float
        Width of the beams, length of the overlap, and radius of the hole, m.
    bolt : Bolt, optional
        Bolt, default M8.
    materials : tuple of Material
        Materials of A and of B, default aluminium.
    ends : tuple of {"clamped", "free"}
        Supports of the first face of A and of the last face of B, default ("clamped", "free").
    preset : {"seed", "accurate"}
        Elements, default "accurate"; see `brick_beam`.
    divisions : LapDivisions, optional
        Numbers of bricks.

    Returns
    -------
    BoltedLap

    Raises
    ------
    ValueError
        A dimension is not positive, the hole is not wider than the shank, the head or nut does not cover the hole or
        reaches beyond the overlap, or bricks are badly shaped.
    TypeError
        A value that is not a pair; a bolt, material or divisions of a wrong type.

    See Also
    --------
    jointfrf.workbench.cases.bolted_lap.preload.preload : Static state under preload.
    jointfrf.workbench.solids.brick_beam.brick_beam : Model of a single beam.

    Examples
    --------
    >>> from jointfrf.workbench.cases.bolted_lap.lap import bolted_lap
    >>> lap = bolted_lap()
    >>> len(lap.mesh.elements), {name: len(pairs.area) for name, pairs in lap.interfaces.items()}
    (3840, {'head': 96, 'lap': 288, 'nut': 96})
    """
    fastener = Bolt() if bolt is None else bolt
    bricks = LapDivisions() if divisions is None else divisions
    check_type("bolt", fastener, Bolt)
    check_type("divisions", bricks, LapDivisions)
    for name, pair in (("lengths", lengths), ("heights", heights), ("materials", materials), ("ends", ends)):
        if not isinstance(pair, list | tuple | np.ndarray) or len(pair) != 2:
            raise TypeError(f"{name} must be a pair, of A and of B, not {one_line(pair)}")
    for material in materials:
        check_type("materials", material, Material)
    _check_dimensions(lengths, heights, width, overlap, hole_radius, fastener)
    check_choice("preset", preset, get_args(Preset))
    check_ends(ends)
    start = lengths[0] - overlap
    radii = _radii(hole_radius, fastener, min(width, overlap) / 2, bricks)
    shared = _shared_plan(overlap, width, heights, radii, bricks, start)
    a = _beam(shared, (0.0, start), width, heights[0], bricks)
    b = _beam(shared, (lengths[0], start + lengths[1]), width, heights[1], bricks)
    solids = {
        "A": extrude((a, np.linspace(0, heights[0], bricks.layers + 1))),
        "B": extrude((b, np.linspace(-heights[1], 0, bricks.layers + 1))),
        "bolt": _bolt_mesh(fastener, radii, heights, bricks, start + overlap / 2),
    }
    for name, solid in solids.items():
        _check_quality(name, solid)
    mesh, body = _joined(solids)
    faces = [(0.0, ends[0]), (start + lengths[1], ends[1])]
    held = [abs(mesh.nodes[:, 2] - z) < NEAR * min(heights) for z, end in faces if end == "clamped"]
    return BoltedLap(
        mesh=mesh,
        body=body,
        materials=(*materials, fastener.material),
        interfaces=_interfaces(mesh, body, heights),
        clamped=np.flatnonzero(np.any(held, axis=0) if held else np.zeros(len(mesh.nodes))).astype(np.int32),
        axis=np.array([0.0, 0.0, start + overlap / 2]),
        preset=preset,
    )


def lap_bricks(lengths: Sequence[float], height: float) -> float:
    """Return the approximate number of bricks of beams with the default divisions."""
    bricks = LapDivisions()
    return bricks.across * bricks.layers * _PER_HEIGHT * sum(lengths) / height


def _check_dimensions(
    lengths: tuple[float, float],
    heights: tuple[float, float],
    width: float,
    overlap: float,
    hole_radius: float,
    bolt: Bolt,
) -> None:
    named = {"lengths": lengths, "heights": heights, "width": (width,), "overlap": (overlap,)}
    for name, values in {**named, "hole_radius": (hole_radius,)}.items():
        for value in values:
            as_positive(name, value, "m")
    if overlap > min(lengths):
        raise ValueError(f"overlap ({1e3 * overlap:g} mm) must not exceed the lengths of the beams")
    if hole_radius <= bolt.shank_radius:
        raise ValueError(
            f"hole_radius ({1e3 * hole_radius:g} mm) must exceed the shank_radius of the bolt "
            f"({1e3 * bolt.shank_radius:g} mm)"
        )
    for name in ("head_radius", "nut_radius"):
        radius = getattr(bolt, name)
        if radius <= hole_radius:
            raise ValueError(f"{name} ({1e3 * radius:g} mm) must exceed hole_radius ({1e3 * hole_radius:g} mm)")
        if radius >= min(width, overlap) / 2:
            raise ValueError(
                f"{name} ({1e3 * radius:g} mm) must stay within the overlap of {1e3 * overlap:g} x {1e3 * width:g} mm "
                "around the bolt"
            )


def _radii(hole: float, bolt: Bolt, reach: float, bricks: LapDivisions) -> list[float]:
    """Return the radii of the circles around the bolt in ascending order, the hole first."""
    small, large = sorted((bolt.head_radius, bolt.nut_radius))
    radii: list[float] = np.linspace(hole, small, bricks.rings + 1).tolist()
    radii += [large] if large > small else []
    return radii + [large + _CIRCLES_REACH * (reach - large) * (i + 1) / bricks.circles for i in range(bricks.circles)]


def _shared_plan(
    overlap: float, width: float, heights: tuple[float, float], radii: list[float], bricks: LapDivisions, start: float
) -> Plan:
    """Return the plan of the overlap, equal for both beams so that their nodes coincide."""
    along = max(1, round(overlap / min(heights) * _PER_HEIGHT))
    plan = holed_plan(overlap, width, overlap / 2, radii, (bricks.across, along))
    return Plan(plan.points + np.array([start, 0.0]), plan.quads)


def _beam(shared: Plan, span: tuple[float, float], width: float, height: float, bricks: LapDivisions) -> Plan:
    """Return the plan of a beam: the overlap, and the rectangle outside the overlap."""
    length = span[1] - span[0]
    if length < NEAR * height:
        return shared
    along = max(1, round(length / height * _PER_HEIGHT)) if bricks.along is None else bricks.along
    across = np.linspace(-width / 2, width / 2, bricks.across + 1)
    return join_plans(shared, rectangle(np.linspace(*span, along + 1), across))


def _bolt_mesh(bolt: Bolt, radii: list[float], heights: tuple[float, float], bricks: LapDivisions, z: float) -> Mesh:
    """Return shank, head and nut; nodes under head and nut lie on the circles of the beams."""
    centre, layers = (z, 0.0), bricks.layers + 1
    shank = disc(centre, [bolt.shank_radius], bricks.across)
    head, nut = (
        disc(centre, [bolt.shank_radius, *(r for r in radii if r <= radius)], bricks.across)
        for radius in (bolt.head_radius, bolt.nut_radius)
    )
    above, below = heights
    return extrude(
        (shank, np.linspace(-below, 0, layers)),
        (shank, np.linspace(0, above, layers)),
        (head, np.linspace(above, above + bolt.head_height, bricks.head + 1)),
        (nut, np.linspace(-below - bolt.nut_height, -below, bricks.nut + 1)),
    )


def _check_quality(name: str, mesh: Mesh) -> None:
    quality, _ = brick_quality(mesh.nodes, mesh.elements)
    worst = int(quality.argmin())
    if quality[worst] < _POOR:
        x, y, z = 1e3 * mesh.nodes[mesh.elements[worst]].mean(axis=0)
        raise ValueError(
            f"divisions: a brick of {name} near x, y, z = {x:.3g}, {y:.3g}, {z:.3g} mm has a scaled Jacobian of "
            f"{quality[worst]:.2g}; change divisions to reach {_POOR}"
        )


def _joined(solids: dict[str, Mesh]) -> tuple[Mesh, NDArray[np.str_]]:
    """Return one mesh of bodies that share no nodes, and the body of every element."""
    starts = np.cumsum([0, *(len(solid.nodes) for solid in solids.values())])
    elements = [solid.elements + start for solid, start in zip(solids.values(), starts, strict=False)]
    body = np.repeat(list(solids), [len(solid.elements) for solid in solids.values()])
    nodes = np.concatenate([solid.nodes for solid in solids.values()])
    return Mesh(nodes, np.concatenate(elements).astype(np.int32)), body


def _interfaces(mesh: Mesh, body: NDArray[np.str_], heights: tuple[float, float]) -> dict[str, ContactInterface]:
    """Return the interfaces, identified by their planes."""
    faces, elements = mesh.faces()
    near = NEAR * min(heights)
    planes: dict[str, float] = {"head": heights[0], "lap": 0.0, "nut": -heights[1]}
    found: dict[str, ContactInterface] = {}
    for name, (lower, upper) in INTERFACES.items():
        flat = (abs(mesh.nodes[faces, 1] - planes[name]) < near).all(axis=1)
        below, above = (faces[flat & (body[elements] == side)] for side in (lower, upper))
        nodes, partner = np.unique(below), np.unique(above)
        distance, nearest = cKDTree(mesh.nodes[nodes]).query(mesh.nodes[partner])
        touching = distance < near
        quads = above[np.isin(above, partner[touching]).all(axis=1)]
        # A node without a quadrilateral in contact belongs to no pair.
        kept = touching & np.isin(partner, quads)
        found[name] = ContactInterface(
            lower=nodes[nearest[kept]], upper=partner[kept], area=_node_areas(mesh.nodes, quads, partner[kept])
        )
    return found


def _node_areas(nodes: FloatArray, quads: NDArray[np.int32], of: NDArray[np.int32]) -> FloatArray:
    """Return the share of each node in the area of flat quadrilaterals, the integral of its shape function, m^2."""
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    areas = np.zeros(len(nodes))
    for point in signs / np.sqrt(3):
        factors = 1 + signs * point
        along = [signs[:, i] * factors[:, 1 - i] / 4 @ nodes[quads] for i in range(2)]
        density = np.linalg.norm(np.cross(along[0], along[1]), axis=1)
        np.add.at(areas, quads, density[:, None] * factors.prod(axis=1) / 4)
    return areas[of]
