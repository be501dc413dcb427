"""Sketches: the channels around a joint and what it acts between; the parts of an assembly, its sensors and hits."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from html import escape
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.point_lines import Interface
from jointfrf.dofs import DIRECTIONS, direction_names, rigid_motion
from jointfrf.kernel.arguments import FloatArray
from jointfrf.report.document import Sketch
from jointfrf.report.table import Cell, Table

__all__ = ["InterfacePoint", "SketchedPart", "assembly_sketch", "interface_points", "interface_sketch", "point_table"]

#: Directions on the page, to the right and up, of x, y and z.
_VIEW = np.array([[0.87, -0.32], [0.0, 0.95], [0.5, 0.42]]).T
#: Size of the drawing, its margin, and of arrows.
_WIDTH, _HEIGHT, _MARGIN, _ARROW = 520.0, 260.0, 62.0, 34.0
#: Where the axes of space begin.
_CORNER = (30.0, _HEIGHT - 32.0)
#: A spring from (0, 0) to (1, 0), six turns high.
_SPRING = "M0 0H.25L.29 6 .38-6 .46 6 .54-6 .63 6 .71-6 .75 0H1"
#: Heads of arrows, in the colours of the sides and of the axes.
_HEADS = "".join(
    f'<marker id="head-{style}" orient="auto" markerUnits="userSpaceOnUse" markerWidth="8" markerHeight="8" refX="7" '
    f'refY="3.2" stroke="none"><path class="{style}" stroke="none" d="M0 0L8 3.2 0 6.4z"/></marker>'
    for style in ("j", "k", "axis")
)
#: Points nearer than this share of the extent count as one place.
_SAME = 1e-6
#: Directions whose triple product is above this determine a place.
_INDEPENDENT = 0.1
#: Sides whose points are nearer on the page are drawn so far apart, each way.
_APART = 30.0


_OnPage = Callable[[FloatArray, int], FloatArray]


class InterfacePoint(NamedTuple):
    """A measured point: its name, side 0 (j) or 1 (k), place in m, and the directions of its channels."""

    name: str
    side: int
    place: FloatArray
    directions: tuple[FloatArray, ...]


def interface_points(interface: Interface) -> list[InterfacePoint]:
    """Return the points of an interface, with places from the rigid motion of their channels.

    Notes
    -----
    A channel along d at r from the reference point moves by r x d for a unit rotation: one direction determines all
    of r but its part along d, which is taken as zero. Channels without names are points of their own, by their
    numbers; three in a row that can be at one place, as those of a sensor of three axes, are one.
    """
    points = []
    for name, own in _grouped(interface):
        motion = interface.motion[own]
        side = int(motion[0, 6:].any())
        motion = motion[:, 6 * side : 6 * side + 6]
        r, _ = _place(motion)
        points.append(InterfacePoint(name, side, interface.references[side] + r, tuple(motion[:, :3])))
    return points


def _place(motion: FloatArray) -> tuple[FloatArray, float]:
    """Return where channels are that move so with their reference point, and by how much that does not hold."""
    # r x d is linear in r: the sum of r_a times e_a x d.
    crosses = np.vstack([rigid_motion(d[None], np.zeros(3))[0][:, 3:] for d in motion[:, :3]])
    turned = motion[:, 3:].ravel()
    r = np.linalg.lstsq(crosses, turned, rcond=None)[0]
    return r, float(abs(crosses @ r - turned).max())


def _grouped(interface: Interface) -> list[tuple[str, list[int]]]:
    """Return names of points, and the numbers of their channels."""
    if interface.channels:
        by_node: dict[int, list[int]] = {}
        for i, channel in enumerate(interface.channels):
            by_node.setdefault(channel.node, []).append(i)
        return [(str(node), own) for node, own in by_node.items()]
    found: list[tuple[str, list[int]]] = []
    first, count = 0, len(interface.motion)
    while first < count:
        own = [first]
        if first + 2 < count:
            motion = interface.motion[first : first + 3]
            for side in (motion[:, :6], motion[:, 6:]):
                if abs(np.linalg.det(side[:, :3])) > _INDEPENDENT and _place(side)[1] <= _SAME * abs(side).max():
                    own = [first, first + 1, first + 2]
        found.append((f"{own[0]}-{own[-1]}" if len(own) > 1 else str(first), own))
        first = own[-1] + 1
    return found


def point_table(points: list[InterfacePoint]) -> Table:
    """Return the points with their places and directions."""
    rows: tuple[tuple[Cell, ...], ...] = tuple(
        (
            p.name,
            "jk"[p.side],
            *(float(1e3 * x) for x in np.round(p.place, 9)),
            ", ".join(map(_axis, p.directions)),
        )
        for p in points
    )
    columns = ("point", "side", "x, mm", "y, mm", "z, mm", "directions")
    return Table("points", "Points and directions", columns, rows)


def _axis(direction: FloatArray) -> str:
    at = int(np.argmax(abs(direction)))
    if abs(direction[at]) > 0.999:
        return f"{'-' if direction[at] < 0 else '+'}{'xyz'[at]}"
    return "(" + " ".join(f"{x:.2g}" for x in direction) + ")"


def _fitted(flat: FloatArray) -> tuple[FloatArray, float]:
    """Return the middle of points of a drawing, and the scale at which they fill it."""
    extent = np.ptp(flat, axis=0)
    scale = min((size - 2 * _MARGIN) / max(e, _SAME) for size, e in zip((_WIDTH, _HEIGHT), extent, strict=True))
    return (flat.min(axis=0) + flat.max(axis=0)) / 2, scale


def interface_sketch(interface: Interface, points: list[InterfacePoint], dofs: tuple[str, ...]) -> Sketch:
    """Draw the points of both sides with their directions, and the joint between the reference points."""
    places = np.array([p.place for p in points] + list(interface.references))
    flat = places @ _VIEW.T
    middle, scale = _fitted(flat)
    scale = 1.0 if np.ptp(flat, axis=0).max() <= _SAME else scale

    # Sides that lie on each other are drawn apart.
    near = _nearest(flat[: len(points)] * scale, np.array([p.side for p in points]))
    shift = _APART if near < _APART else 0.0

    def at(place: FloatArray, side: int) -> FloatArray:
        right, up = (place @ _VIEW.T - middle) * scale
        return np.array([_WIDTH / 2 + right, _HEIGHT / 2 - up + (side - 0.5) * 2 * shift])

    ends = [at(reference, side) for side, reference in enumerate(interface.references)]
    parts = [_links(points, at, side, ends[side]) for side in (0, 1)]
    parts += [_point(p, at) for p in points]
    parts.append(_spring(*ends))
    parts.append(_axes())
    drawn = f"<defs>{_HEADS}</defs>" + "".join(parts)
    # Arrows of sides that are drawn apart reach a little above the margin.
    svg = f'<svg viewBox="0 -6 {_WIDTH:g} {_HEIGHT + 6:g}" aria-hidden="true">{drawn}</svg>'
    sides = [", ".join(p.name for p in points if p.side == side) for side in (0, 1)]
    apart = 1e3 * float(np.linalg.norm(interface.references[1] - interface.references[0]))
    where = "at one place" if apart < 1e-6 else f"{apart:.3g} mm apart"
    caption = (
        f"Side j (filled): points {sides[0]}; side k (open): points {sides[1]}; arrows: measured directions; spring: "
        f"the joint in {', '.join(dofs)} between the reference points, which are {where}"
        + ("; the sides are drawn apart" if shift else "")
    )
    return Sketch("sketch", svg, caption, f"Sketch of the joint. {caption}.")


def _nearest(flat: FloatArray, side: NDArray[np.intp]) -> float:
    """Return the smallest distance on the page between points of both sides."""
    between = flat[side == 0][:, None] - flat[side == 1][None]
    return float(np.linalg.norm(between, axis=2).min(initial=np.inf))


def _links(points: list[InterfacePoint], at: _OnPage, side: int, end: FloatArray) -> str:
    own = [at(p.place, side) for p in points if p.side == side]
    path = "".join(f"M{end[0]:.1f} {end[1]:.1f}L{x:.1f} {y:.1f}" for x, y in own)
    return f'<path class="{"jk"[side]} link" stroke-width="1.2" stroke-dasharray="{("none", "5 3")[side]}" d="{path}"/>'


def _point(point: InterfacePoint, at: _OnPage) -> str:
    x, y = at(point.place, point.side)
    side = "jk"[point.side]
    drawn = [
        f'<circle class="{side}{" open" if point.side else ""}" cx="{x:.1f}" cy="{y:.1f}" r="4.5" stroke-width="2"/>'
    ]
    for direction in point.directions:
        step = (_VIEW @ direction) * (1, -1) * _ARROW
        drawn.append(_arrow(side, x, y, step))
    # Names of both sides do not collide where the points do.
    up = -12 if point.side == 0 else 20
    anchor = "end" if point.side == 0 else "start"
    beside = x + (-8 if point.side == 0 else 8)
    drawn.append(f'<text x="{beside:.1f}" y="{y + up:.1f}" text-anchor="{anchor}">{point.name}</text>')
    return "".join(drawn)


def _arrow(style: str, x: float, y: float, step: FloatArray) -> str:
    shaft = f"M{x:.1f} {y:.1f}l{step[0]:.1f} {step[1]:.1f}"
    return f'<path class="{style} link" stroke-width="1.6" marker-end="url(#head-{style})" d="{shaft}"/>'


def _spring(first: FloatArray, last: FloatArray) -> str:
    """Draw a spring between two places."""
    step = last - first
    length = max(float(np.hypot(*step)), 1.0)
    place = ", ".join(f"{x:.3f}" for x in (*step, -step[1] / length, step[0] / length, *first))
    look = 'stroke-width="1.6" stroke-linejoin="round" vector-effect="non-scaling-stroke"'
    return f'<path class="joint open" {look} transform="matrix({place})" d="{_SPRING}"/>'


def _axes(view: FloatArray = _VIEW) -> str:
    """Draw the axes of space in the corner."""
    drawn = []
    for letter, direction in zip("xyz", view.T, strict=True):
        step = direction * (1, -1) * 26
        a, b = np.array(_CORNER) + 1.38 * step
        drawn.append(_arrow("axis", *_CORNER, step))
        drawn.append(f'<text x="{a:.1f}" y="{b + 4:.1f}" text-anchor="middle" font-style="italic">{letter}</text>')
    return "".join(drawn)


class SketchedPart(NamedTuple):
    """A part of an assembly: its letter, where its nodes are, m, in axes of its own, and its nodes at the joint."""

    letter: str
    places: Mapping[str, FloatArray]
    joint: Sequence[str]


#: Nodes of a part that are drawn at most: more are a grey body.
_MOST_NODES = 400


def assembly_sketch(
    parts: Sequence[SketchedPart], sensors: Sequence[str], hits: Sequence[str], names: Mapping[str, str] | None = None
) -> Sketch | None:
    """Draw both parts of an assembly, sensors and hits; None where places of nodes are not known.

    Parameters
    ----------
    parts : sequence of SketchedPart
        The second is moved to where its nodes at the joint lie on those of the first.
    sensors, hits : sequence of str
        DOFs ``"A/7:y"``.
    names : mapping of str to str, optional
        What is written beside DOFs.
    """
    ends = [[part.places[node] for node in part.joint if node in part.places] for part in parts]
    if not all(ends):
        return None
    reference = np.mean(ends[0], axis=0)
    moved = [
        {node: at - np.mean(end, axis=0) + reference for node, at in part.places.items()}
        for part, end in zip(parts, ends, strict=True)
    ]
    every = np.array([at for own in moved for at in own.values()])
    view = _view_along(int(np.argmax(np.ptp(every, axis=0))))
    flat = every @ view.T
    middle, scale = _fitted(flat)

    def at(place: FloatArray, side: int) -> FloatArray:
        right, up = (place @ view.T - middle) * scale
        return np.array([_WIDTH / 2 + right, _HEIGHT / 2 - up + (2 * side - 1) * _LIFT])

    drawn = [f"<defs>{_HEADS}</defs>"]
    for side, own in enumerate(moved):
        step = max(1, len(own) // _MOST_NODES)
        spots = (at(place, side) for place in list(own.values())[::step])
        drawn += [f'<circle class="{"jk"[side]} node" cx="{x:.1f}" cy="{y:.1f}" r="1.6"/>' for x, y in spots]
    letters = [part.letter for part in parts]
    labels: dict[str, tuple[float, float]] = {}
    for dofs, draw in ((hits, _hit), (sensors, _sensor)):
        for dof in dofs:
            letter, _, rest = dof.partition("/")
            node, _, direction = rest.rpartition(":")
            side = letters.index(letter)
            if node in moved[side]:
                spot = at(moved[side][node], side)
                drawn.append(draw("jk"[side], spot, _on_page(direction, view)))
                if names and dof in names:
                    labels.setdefault(names[dof], (float(spot[0]) + 9, float(spot[1]) + (20 if side else -12)))
    drawn += [f'<text x="{x:.1f}" y="{y:.1f}">{escape(name)}</text>' for name, (x, y) in labels.items()]
    drawn += [_spring(at(reference, 0), at(reference, 1)), _axes(view)]
    svg = f'<svg viewBox="0 -6 {_WIDTH:g} {_HEIGHT + 6:g}" aria-hidden="true">{"".join(drawn)}</svg>'
    caption = (
        f"Nodes of {letters[0]} and of {letters[1]} (drawn below it, where they meet); squares: sensors; arrows: hits; "
        "spring: the joint"
    )
    words = f"Sensors at {', '.join(sensors)}; hits at {', '.join(hits)}."
    return Sketch("assembly", svg, caption, f"Sketch of the assembly. {words}")


#: How far parts are drawn apart where they meet, each way.
_LIFT = 9.0


def _view_along(axis: int) -> FloatArray:
    """Return directions on the page of x, y and z, with one of them to the right: never a mirror image."""
    right, up, away = _VIEW.T
    return np.array([[right, up, away], [away, right, up], [-away, up, right]][axis]).T


def _on_page(direction: str, view: FloatArray) -> FloatArray:
    """Return the step on the page of a direction such as ``y``; up where it is none in space."""
    try:
        name = direction_names([direction.lstrip("+-")])[0]
        unit = np.eye(6)[DIRECTIONS.index(name)][:3]
    except ValueError:
        unit = np.zeros(3)
    step = (view @ unit) * (1, -1)
    return np.asarray(step if unit.any() else np.array([0.0, -1.0]))


def _sensor(style: str, spot: FloatArray, step: FloatArray) -> str:
    x, y = spot + 5 * step
    return f'<rect class="{style}" x="{x - 4.5:.1f}" y="{y - 4.5:.1f}" width="9" height="9"/>'


def _hit(style: str, spot: FloatArray, step: FloatArray) -> str:
    """Draw an arrow that ends at a place, from the side away from the sensors."""
    x, y = spot - 4 * step
    return _arrow(style, float(x - step[0] * _ARROW), float(y - step[1] * _ARROW), step * _ARROW)
