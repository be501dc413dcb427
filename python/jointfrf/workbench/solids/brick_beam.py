"""Straight beams of brick elements, with or without a bolt hole."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from jointfrf.kernel.arguments import FloatArray, as_count, as_number, as_positive, as_real, check_choice
from jointfrf.models.beam import End, check_ends
from jointfrf.workbench.solids.brick import Formulation, Material
from jointfrf.workbench.solids.mesh import NEAR, Mesh, Plan, extrude, holed_rectangle, join_plans, rectangle
from jointfrf.workbench.solids.solid import Patch, SolidModel, solid_model

__all__ = ["PRESETS", "Face", "Hole", "Preset", "beam_divisions", "brick_beam", "holed_plan"]

Preset = Literal["seed", "accurate"]
Face = Literal["top", "bottom"]

#: Elements of a preset. Their mass is consistent: lumped ones would lower torsion by 2.5 % (seed).
PRESETS: dict[Preset, Formulation] = {"seed": "reduced", "accurate": "incompatible"}
#: Bricks across the width and over the height, and along the beam for each height of length: 5 x 2 x 103 in a plain
#: beam of 0.3 x 0.025 x 0.006 m; 1024 in one with a hole, which takes more across for the circle to be round.
_PLAIN, _HOLED = (5, 2, 2.06), (8, 2, 1.14)
#: Layers of bricks from the circle under the head to the square around the hole.
_OUTER_LAYERS = 2


@dataclass(frozen=True)
class Hole:
    """Bolt hole through the height of a beam, and the ring under the bolt head that moves with a reference point.

    Attributes
    ----------
    position : float
        Distance from the start of the beam to the axis of the hole, m.
    radius : float
        Radius of the hole, m.
    patch_radius : float
        Outer radius of the ring around the hole, m.
    face : {"top", "bottom"}
        Face with the ring, default "top".
    name : str
        Name of the reference point at the centre of the hole on this face, default "hole".

    Raises
    ------
    ValueError
        NaN or Inf; a face that is not known.

    See Also
    --------
    brick_beam : Beam with a hole.
    """

    position: float
    radius: float
    patch_radius: float
    face: Face = "top"
    name: str = "hole"

    def __post_init__(self) -> None:
        for name in ("position", "radius", "patch_radius"):
            as_number(name, getattr(self, name))
        check_choice("face", self.face, get_args(Face))


def brick_beam(
    length: float,
    width: float,
    height: float,
    material: Material,
    *,
    ends: tuple[End, End] = ("free", "free"),
    hole: Hole | None = None,
    sections: Mapping[str, float] | None = None,
    observed: Mapping[str, float] | None = None,
    preset: Preset = "accurate",
    divisions: tuple[int, int, int] | None = None,
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> SolidModel:
    """Return the model of a straight beam of bricks, with its length along z, width along x and height along y.

    Parameters
    ----------
    length, width, height : float
        Dimensions of the beam, m.
    material : Material
        Material of all bricks, and loss factor of the model.
    ends : tuple of {"free", "clamped"}
        Supports of the first and the last face, default both "free".
    hole : Hole, optional
        Bolt hole; the mesh around it is an O-grid in a square as wide as the beam. No hole by default.
    sections : mapping of str to float, optional
        Rigid cross-sections: name to distance from the start, m. The nearest plane of nodes moves with a reference
        point at the centre of the section.
    observed : mapping of str to float, optional
        Flexible cross-sections: name to distance from the start, m. Their mean motion can be observed, and forces are
        spread over them; see `SolidModel.ports`.
    preset : {"seed", "accurate"}
        Elements, default "accurate".

        - "seed": reduced integration with hourglass control, the counterpart of C3D8R. With n bricks over the height,
          the bending stiffness is 1 - 1/n^2 of the exact stiffness.
        - "accurate": incompatible modes, the counterpart of C3D8I.
    divisions : tuple of int, optional
        Numbers of bricks along x, y and z. In a beam with a hole, the number along z sets the spacing away from the
        hole. By default, bricks are about half as long as the beam is high.
    origin : tuple of float
        Coordinates x, y, z of the middle of the lower edge of the first face, m, default (0, 0, 0). The beam extends
        from y = `origin[1]` upwards.

    Returns
    -------
    SolidModel
        Model with the DOFs of the nodes, such as ``"1:x"``, then of the reference points, such as ``"hole:theta_y"``.

    Raises
    ------
    ValueError
        A dimension that is not positive; a hole that leaves the beam; patches that overlap.

    See Also
    --------
    jointfrf.workbench.solids.solid.solid_model : Model of any mesh.
    jointfrf.workbench.solids.brick.element_matrices : Formulations of the elements.

    Examples
    --------
    >>> import jointfrf as jf
    >>> aluminium = jf.Material(70e9, 0.33, 2700.0)
    >>> beam = jf.brick_beam(0.3, 0.025, 0.006, aluminium, ends=("clamped", "free"), sections={"tip": 0.3})
    >>> len(beam.mesh.elements), beam.dofs[-1]
    (1030, 'tip:theta_z')
    """
    for name, value in (("length", length), ("width", width), ("height", height)):
        as_positive(name, value, "m")
    check_choice("preset", preset, get_args(Preset))
    check_ends(ends)
    if not isinstance(hole, Hole | None):
        raise TypeError(f"hole must be a Hole, not {type(hole).__name__}")
    for what, places in (("sections", sections), ("observed", observed)):
        if not isinstance(places, Mapping | None):
            raise TypeError(f"{what} must map names to places, not {type(places).__name__}")
    nx, ny, nz = beam_divisions(length, height, holed=hole is not None)
    if divisions is not None:
        if np.shape(divisions) != (3,):
            raise ValueError(f"divisions must be three numbers, along x, y and z, not {reprlib.repr(divisions)}")
        nx, ny, nz = (as_count(f"divisions along {name}", n) for name, n in zip("xyz", divisions, strict=True))
    start = as_real("origin", origin, (3,))
    mesh = _mesh(length, width, height, hole, (nx, ny, nz))
    local, mesh = mesh.nodes, Mesh(mesh.nodes + start, mesh.elements)
    near = NEAR * height
    clamped = [np.flatnonzero(abs(local[:, 2] - at) < near) for at, e in zip((0, length), ends, strict=True)
               if e == "clamped"]  # fmt: skip
    patches: dict[str, Patch] = {}
    if hole is not None:
        patches[hole.name] = _ring(local, hole, height, near)
    for name, at in (sections or {}).items():
        if name in patches:
            raise ValueError(f"two reference points have the name {name!r}")
        patches[name] = _section(local, name, at, length, height, near)
    shown = {name: _section(local, name, at, length, height, near) for name, at in (observed or {}).items()}
    placed, seen = ({name: Patch(p.point + start, p.nodes) for name, p in group.items()} for group in (patches, shown))
    return solid_model(
        mesh,
        material,
        formulation=PRESETS[preset],
        patches=placed,
        observed=seen,
        clamped=np.concatenate([np.zeros(0, int), *clamped]),
    )


def beam_divisions(length: float, height: float, *, holed: bool) -> tuple[int, int, int]:
    """Return the default numbers of bricks along x, y and z."""
    nx, ny, per_height = _HOLED if holed else _PLAIN
    return nx, ny, max(1, round(length / height * per_height))


def _mesh(length: float, width: float, height: float, hole: Hole | None, divisions: tuple[int, int, int]) -> Mesh:
    nx, ny, nz = divisions
    across = np.linspace(-width / 2, width / 2, nx + 1)
    layers = np.linspace(0, height, ny + 1)
    if hole is None:
        return extrude((rectangle(np.linspace(0, length, nz + 1), across), layers))
    radii = (hole.radius, hole.patch_radius)
    return extrude((holed_plan(length, width, hole.position, radii, (nx, nz)), layers))


def holed_plan(
    length: float, width: float, position: float, radii: Sequence[float], divisions: tuple[int, int]
) -> Plan:
    """Return the plan of a beam with a hole: an O-grid as wide as the beam, or up to its end, and rectangles.

    Parameters
    ----------
    length, width : float
        Dimensions of the beam, m.
    position : float
        Distance from the start of the beam to the axis of the hole, m.
    radii : sequence of float
        Radius of the hole, then radii of the circles around it, m.
    divisions : tuple of int
        Numbers of bricks along x and z; the number along z applies to a beam without a hole.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        The hole or a circle around it leaves the beam.

    See Also
    --------
    brick_beam : Model of a beam.
    jointfrf.workbench.solids.mesh.holed_rectangle : O-grid around a hole.
    """
    nx, nz = divisions
    reach = (min(width / 2, position), min(width / 2, length - position), width / 2)
    if not max(radii) < min(reach):
        raise ValueError(
            f"the hole at {1e3 * position:g} mm with its ring of radius {1e3 * max(radii):g} mm leaves the beam of "
            f"{1e3 * length:g} x {1e3 * width:g} mm; move or shrink it"
        )
    plans = [holed_rectangle((position, 0.0), reach, radii, nx, _OUTER_LAYERS)]
    across = np.linspace(-width / 2, width / 2, nx + 1)
    for start, stop in ((0.0, position - reach[0]), (position + reach[1], length)):
        if stop - start > NEAR * length:
            count = max(1, round((stop - start) / length * nz))
            plans.append(rectangle(np.linspace(start, stop, count + 1), across))
    return join_plans(*plans)


def _ring(nodes: FloatArray, hole: Hole, height: float, near: float) -> Patch:
    """Return the nodes under the bolt head."""
    y = height if hole.face == "top" else 0.0
    point = np.array([0.0, y, hole.position])
    radius = np.hypot(nodes[:, 0], nodes[:, 2] - hole.position)
    inside = (abs(nodes[:, 1] - y) < near) & (radius < hole.patch_radius + near)
    return Patch(point, np.flatnonzero(inside).astype(np.int32))


def _section(nodes: FloatArray, name: str, at: float, length: float, height: float, near: float) -> Patch:
    """Return the nodes of the cross-section nearest to a place."""
    if not -near <= as_number(f"section {name!r}", at) <= length + near:
        raise ValueError(f"section {name!r} at {1e3 * at:g} mm lies outside the beam of {1e3 * length:g} mm")
    z = nodes[:, 2]
    plane = z[np.argmin(abs(z - at))]
    inside = np.flatnonzero(abs(z - plane) < near)
    if inside.size < np.count_nonzero(abs(z - z.min()) < near):
        raise ValueError(f"section {name!r} at {1e3 * at:g} mm cuts the mesh around the hole, which has no plane there")
    return Patch(np.array([0.0, height / 2, plane]), inside.astype(np.int32))
