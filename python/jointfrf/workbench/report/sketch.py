"""Sketches of the channels around a joint, and of the parts of an assembly with sensors and impacts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from jointfrf.channels.point_lines import Interface
from jointfrf.dofs import DIRECTIONS, direction_names, rigid_motion
from jointfrf.kernel.arguments import FloatArray
from jointfrf.workbench.report.document import Sketch
from jointfrf.workbench.report.table import Cell, Table

__all__ = [
    "InterfacePoint",
    "SketchedPart",
    "assembly_sketch",
    "interface_points",
    "interface_sketch",
    "point_table",
]

#: Directions on the page, to the right and up, of x, y and z.
_VIEW = np.array([[0.87, -0.32], [0.0, 0.95], [0.5, 0.42]]).T
#: Width of the drawing, least and largest height, margin, and size of arrows.
_WIDTH, _LOW, _HIGH, _MARGIN, _ARROW = 760.0, 170.0, 340.0, 62.0, 34.0
#: Origin of the axes of space, from the left and from below, and their length.
_CORNER, _AXIS = (34.0, 34.0), 26.0
#: Size of letters on a phone, and their width in heights: names that do not overlap there do not overlap elsewhere.
_FONT, _LETTER = 17.0, 0.58
#: Possible directions of a name from its place, and distances.
_AROUND = ((1, -1), (-1, -1), (1, 1), (-1, 1), (0, 1), (0, -1), (1, 0), (-1, 0))
_DISTANCES = (8.0, 22.0, 40.0, 60.0)
#: A spring from (0, 0) to (1, 0), six turns high.
_SPRING = "M0 0H.25L.29 6 .38-6 .46 6 .54-6 .63 6 .71-6 .75 0H1"
#: Heads of arrows, in the colours of the sides and of the axes.
_HEADS = "".join(
    f'<marker id="head-{style}" orient="auto" markerUnits="userSpaceOnUse" markerWidth="8" markerHeight="8" refX="7" '
    f'refY="3.2" stroke="none"><path class="{style}" stroke="none" d="M0 0L8 3.2 0 6.4z"/></marker>'
    for style in ("j", "k", "axis")
)
#: Distance by which each part is drawn away from its joints.
_LIFT = 9.0
#: Largest number of nodes of a part that are drawn; more become a grey body.
_MOST_NODES = 400
#: Share of the extent below which points are one place.
_SAME = 1e-6
#: Difference below which directions are equal.
_PARALLEL = 1e-6
#: Triple product above which directions determine a place.
_INDEPENDENT = 0.1
#: Distance of points on the page below which sides are drawn apart by this distance, each way.
_APART = 30.0


#: Left, top, right and bottom of a box on the page.
_Box = tuple[float, float, float, float]


class InterfacePoint(NamedTuple):
    """A measured point: name, side 0 (j) or 1 (k), place in m, directions of channels, and whether x, y, z are known.

    The direction of a channel that measures a rotation is zero; `axes` has its axis.
    """

    name: str
    side: int
    place: FloatArray
    directions: tuple[FloatArray, ...]
    axes: tuple[FloatArray, ...]
    known: tuple[bool, bool, bool] = (True, True, True)


def interface_points(interface: Interface) -> list[InterfacePoint]:
    """Return the points of an interface, with places from the rigid motion of their channels.

    Notes
    -----
    A channel along d at r from the reference point moves by r x d for a unit rotation: one direction determines r
    except its component along d, which is taken as zero. Each channel without a name is a separate point with its
    number as a name. Three successive ones that can be at one place, such as a sensor of three axes, are one point.
    """
    points = []
    for name, own in _rows_of_points(interface):
        motion = interface.motion[own]
        side = int(motion[0, 6:].any())
        motion = motion[:, 6 * side : 6 * side + 6]
        r, free, _ = _place(motion)
        x, y, z = (interface.placed and bool((abs(free[:, i]) <= _PARALLEL).all()) for i in range(3))
        ways, axes = tuple(motion[:, :3]), tuple(motion[:, 3:])
        points.append(InterfacePoint(name, side, interface.references[side] + r, ways, axes, (x, y, z)))
    return points


def _place(motion: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return the place of channels from their motion with the reference point.

    Then the directions along which the place is unknown, shape (n, 3), and the residual of the motion.
    """
    # r x d is linear in r: the sum of r_a times e_a x d.
    moves = motion[:, :3].any(axis=1)
    if not moves.any():
        return np.zeros(3), np.eye(3), 0.0
    crosses = np.vstack([rigid_motion(d[None], np.zeros(3))[0][:, 3:] for d in motion[moves, :3]])
    turned = motion[moves, 3:].ravel()
    r = np.linalg.lstsq(crosses, turned, rcond=None)[0]
    _, size, rows = np.linalg.svd(crosses)
    return r, rows[size <= _PARALLEL * size[0]], float(abs(crosses @ r - turned).max())


def _rows_of_points(interface: Interface) -> list[tuple[str, list[int]]]:
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
                if abs(np.linalg.det(side[:, :3])) > _INDEPENDENT and _place(side)[2] <= _SAME * abs(side).max():
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
            *(float(1e3 * x) if known else None for x, known in zip(np.round(p.place, 9), p.known, strict=True)),
            ", ".join(map(_axis, p.directions, p.axes)),
        )
        for p in points
    )
    columns = ("point", "side", "x, mm", "y, mm", "z, mm", "directions")
    note = "Empty or left out: the file does not state this coordinate, nor do the directions of the channels."
    return Table(
        "points", "Points and directions", columns, rows, note="" if all(all(p.known) for p in points) else note
    )


def _axis(direction: FloatArray, axis: FloatArray) -> str:
    """Return the direction of a channel, or the axis of the rotation that it measures: "+y", "-rz", or components."""
    direction, kind = (direction, "") if direction.any() else (axis, "r")
    at = int(np.argmax(abs(direction)))
    if abs(direction[at]) > 0.999:
        return f"{'-' if direction[at] < 0 else '+'}{kind}{'xyz'[at]}"
    return kind + "(" + " ".join(f"{x:.2g}" for x in direction) + ")"


class _Scene:
    """Unfinished sketch: drawn elements, occupied places, and names that are not yet written."""

    def __init__(self, places: FloatArray, view: FloatArray = _VIEW) -> None:
        flat = places @ view.T
        extent = np.ptp(flat, axis=0)
        sizes = [(size - 2 * _MARGIN) / max(e, _SAME) for size, e in zip((_WIDTH, _HIGH), extent, strict=True)]
        self.view, self.middle = view, (flat.min(axis=0) + flat.max(axis=0)) / 2
        self.scale = min(sizes) if extent.max() > _SAME else 1.0
        self.height = float(np.clip(extent[1] * self.scale + 2 * _MARGIN, _LOW, _HIGH))
        self.corner = np.array([_CORNER[0], self.height - _CORNER[1]])
        self.drawn: list[str] = []
        self.names: dict[str, FloatArray] = {}
        self.taken: list[_Box] = [(0.0, self.corner[1] - 1.6 * _AXIS, self.corner[0] + 1.6 * _AXIS, self.height)]

    def at(self, place: FloatArray, down: float = 0.0) -> FloatArray:
        """Return the spot on the page of a place in space, moved down by a distance."""
        right, up = (place @ self.view.T - self.middle) * self.scale
        return np.array([_WIDTH / 2 + right, self.height / 2 - up + down])

    def step(self, direction: FloatArray) -> FloatArray:
        """Return a direction in space on the page."""
        return np.asarray((self.view @ direction) * (1, -1), np.float64)

    def cover(self, spot: FloatArray, half: float) -> None:
        """Keep names away from a spot."""
        x, y = spot.tolist()
        self.taken.append((x - half, y - half, x + half, y + half))

    def arrow(self, style: str, spot: FloatArray, step: FloatArray) -> None:
        shaft = f"M{spot[0]:.1f} {spot[1]:.1f}l{step[0]:.1f} {step[1]:.1f}"
        self.drawn.append(
            f'<path class="{style} link" stroke-width="1.6" marker-end="url(#head-{style})" d="{shaft}"/>'
        )
        for part in np.linspace(0, 1, 6):
            self.cover(spot + part * step, 4.0)

    def spring(self, first: FloatArray, last: FloatArray) -> None:
        step = last - first
        length = max(float(np.hypot(*step)), 1.0)
        place = ", ".join(f"{x:.3f}" for x in (*step, -step[1] / length, step[0] / length, *first))
        look = 'stroke-width="1.6" stroke-linejoin="round" vector-effect="non-scaling-stroke"'
        self.drawn.append(f'<path class="joint open" {look} transform="matrix({place})" d="{_SPRING}"/>')

    def finished(self, key: str, caption: str, alt: str) -> Sketch:
        """Write the names and draw the axes of space in the corner."""
        left = sum(not self._write(name, spot) for name, spot in self.names.items())
        for letter, direction in zip("xyz", self.view.T, strict=True):
            step = direction * (1, -1) * _AXIS
            x, y = self.corner + 1.38 * step
            self.arrow("axis", self.corner, step)
            self.drawn.append(
                f'<text x="{x:.1f}" y="{y + 4:.1f}" text-anchor="middle" font-style="italic">{letter}</text>'
            )
        if left:
            caption += (
                f"; {left} name{'s' if left > 1 else ''} without room for {'them' if left > 1 else 'it'} left out"
            )
        # Arrows of sides that are drawn apart reach a little above the margin.
        box = f'viewBox="0 -6 {_WIDTH:g} {self.height + 6:g}"'
        svg = f'<svg {box} aria-hidden="true"><defs>{_HEADS}</defs>{"".join(self.drawn)}</svg>'
        return Sketch(key, svg, caption, alt)

    def _write(self, name: str, spot: FloatArray) -> bool:
        """Write a name next to its spot without overlap, and return whether there is such a place."""
        x, y = spot.tolist()
        half_width, half_height = _FONT * _LETTER * len(name) / 2, _FONT / 2
        for distance, (right, down) in ((d, way) for d in _DISTANCES for way in _AROUND):
            a, b = x + right * (distance + half_width), y + down * (distance + half_height)
            box = (a - half_width, b - half_height, a + half_width, b + half_height)
            is_inside = box[0] >= 0 and box[1] >= 0 and box[2] <= _WIDTH and box[3] <= self.height
            if is_inside and not any(_overlap(box, one) for one in self.taken):
                break
        else:
            return False
        self.taken.append(box)
        start = a - right * half_width
        if distance > _DISTANCES[0]:
            leader = f"M{x:.1f} {y:.1f}L{start:.1f} {b - down * half_height:.1f}"
            self.drawn.append(f'<path class="leader" d="{leader}"/>')
        # Smaller letters, on a wide screen, stay near their place.
        anchor, base = ("middle", "start", "end")[right], y - distance if down < 0 else b + 0.35 * _FONT
        self.drawn.append(f'<text x="{start:.1f}" y="{base:.1f}" text-anchor="{anchor}">{escape(name)}</text>')
        return True


def _overlap(one: _Box, other: _Box) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]


def interface_sketch(interface: Interface, points: list[InterfacePoint], dofs: tuple[str, ...]) -> Sketch:
    """Draw the points of both sides with their directions, and the joint between the reference points."""
    scene, side_of = _Scene(np.array([p.place for p in points] + list(interface.references))), [p.side for p in points]
    flat, side = np.array([scene.at(p.place) for p in points]), np.array(side_of)
    # Sides on top of each other are drawn apart.
    between = np.linalg.norm(flat[side == 0][:, None] - flat[side == 1][None], axis=2)
    shift = _APART if between.min(initial=np.inf) < _APART else 0.0
    spots = flat + np.stack([np.zeros(side.size), shift * (2 * side - 1)], axis=1)
    ends = [scene.at(reference, shift * (2 * i - 1)) for i, reference in enumerate(interface.references)]
    for spot in (*ends, (ends[0] + ends[1]) / 2):
        scene.cover(spot, 10.0)
    for i, end in enumerate(ends):
        path = "".join(f"M{end[0]:.1f} {end[1]:.1f}L{x:.1f} {y:.1f}" for x, y in spots[side == i])
        look = f'stroke-width="1.2" stroke-dasharray="{("none", "5 3")[i]}"'
        scene.drawn.append(f'<path class="{"jk"[i]} link" {look} d="{path}"/>')
    for p, spot in zip(points, spots, strict=True):
        style, place = "jk"[p.side], f'cx="{spot[0]:.1f}" cy="{spot[1]:.1f}"'
        scene.drawn.append(f'<circle class="{style}{" open" if p.side else ""}" {place} r="4.5" stroke-width="2"/>')
        scene.cover(spot, 6.0)
        for direction in p.directions:
            scene.arrow(style, spot, scene.step(direction) * _ARROW)
        scene.names[p.name] = spot
    scene.spring(*ends)
    sides = [", ".join(p.name for p in points if p.side == i) for i in (0, 1)]
    apart = 1e3 * float(np.linalg.norm(interface.references[1] - interface.references[0]))
    where = "at one place" if apart < 1e-6 else f"{apart:.3g} mm apart"
    caption = (
        f"Side j (filled): points {sides[0]}; side k (open): points {sides[1]}; arrows: measured directions; spring: "
        f"the joint in {', '.join(dofs)} between the reference points, which are {where}"
        + ("; the sides are drawn apart" if shift else "")
    )
    return scene.finished("sketch", caption, f"Sketch of the joint. {caption}.")


class SketchedPart(NamedTuple):
    """A part of an assembly: its name, places of its nodes in its own axes, m, and its nodes by joint."""

    letter: str
    places: Mapping[str, FloatArray]
    joints: Mapping[str, Sequence[str]]

    def ends(self) -> dict[str, FloatArray]:
        """Return the place of each joint on the part, m, if it is known."""
        known = {
            name: [self.places[node] for node in nodes if node in self.places] for name, nodes in self.joints.items()
        }
        return {name: np.mean(own, axis=0) for name, own in known.items() if own}


def _moved_parts(
    parts: Sequence[SketchedPart],
) -> tuple[list[dict[str, FloatArray]], dict[str, dict[int, FloatArray]]] | None:
    """Return places of nodes of assembled parts, and the ends of joints, m, or None if a part has no joint.

    The first part is fixed. Each further part is moved so that its joints with earlier parts coincide in the mean.
    """
    ends = [part.ends() for part in parts]
    shift: dict[int, FloatArray] = {0: np.zeros(3)}
    while len(shift) < len(parts):
        for i, own in enumerate(ends):
            met = [ends[k][name] + by - own[name] for k, by in shift.items() for name in own.keys() & ends[k].keys()]
            if i not in shift and met:
                shift[i] = np.mean(met, axis=0)
                break
        else:
            return None
    if not all(ends):
        return None
    moved = [{node: at + shift[i] for node, at in part.places.items()} for i, part in enumerate(parts)]
    joints: dict[str, dict[int, FloatArray]] = {}
    for i, own in enumerate(ends):
        for name, at in own.items():
            joints.setdefault(name, {})[i] = at + shift[i]
    return moved, joints


def _levels(count: int, joints: Mapping[str, Mapping[int, FloatArray]]) -> list[int]:
    """Return the number of joints from the first part to each: neighbours are drawn apart, and in other colours."""
    levels = {0: 0}
    while len(levels) < count:
        level = max(levels.values()) + 1
        next_to = {i for own in joints.values() if own.keys() & levels.keys() for i in own} - levels.keys()
        levels.update(dict.fromkeys(next_to, level))
    return [levels[i] for i in range(count)]


def assembly_sketch(parts: Sequence[SketchedPart], sensors: Sequence[str], hits: Sequence[str]) -> Sketch | None:
    """Return a sketch of an assembly with joints, sensors and impacts, or None if places of nodes are unknown.

    Parameters
    ----------
    parts : sequence of SketchedPart
        Parts of the assembly. All except the first are moved so that nodes at joints coincide.
    sensors, hits : sequence of str
        DOFs ``"A/7:y"`` of sensors and impacts.
    """
    placed = _moved_parts(parts)
    if placed is None:
        return None
    moved, joints = placed
    levels = _levels(len(parts), joints)
    every = np.array([at for own in moved for at in own.values()])
    scene = _Scene(every, _view_along(int(np.argmax(np.ptp(every, axis=0)))))

    def at(place: FloatArray, side: int) -> FloatArray:
        return scene.at(place, (2 * levels[side] - 1) * _LIFT)

    styles = ["jk"[level % 2] for level in levels]
    for side, own in enumerate(moved):
        for place in list(own.values())[:: max(1, len(own) // _MOST_NODES)]:
            x, y = at(place, side)
            scene.drawn.append(f'<circle class="{styles[side]} node" cx="{x:.1f}" cy="{y:.1f}" r="1.6"/>')
    for name, ends in joints.items():
        first, last = ([at(place, side) for side, place in ends.items()] * 2)[:2]
        if len(ends) == 1:  # the ground
            last = first + np.array([0.0, 2 * _LIFT])
            scene.drawn.append(f'<path class="joint open" d="M{last[0] - 7:.1f} {last[1]:.1f}h14"/>')
        scene.spring(first, last)
        scene.cover((first + last) / 2, 12.0)
        if name:
            scene.names[name] = (first + last) / 2
    letters = [part.letter for part in parts]
    if len(parts) > 2:
        for side, own in enumerate(moved):
            scene.names.setdefault(letters[side], at(np.mean(list(own.values()), axis=0), side))
    for dof, is_hit in [*((dof, True) for dof in hits), *((dof, False) for dof in sensors)]:
        letter, _, rest = dof.partition("/")
        node, _, direction = rest.rpartition(":")
        side = letters.index(letter)
        if node in moved[side]:
            spot, step = at(moved[side][node], side), scene.step(_unit(direction))
            step = step if step.any() else np.array([0.0, -1.0])
            if is_hit:  # an arrow that ends at the place, from the side away from the sensors
                scene.arrow(styles[side], spot - (4 + _ARROW) * step, step * _ARROW)
            else:
                x, y = spot + 5 * step - 4.5
                scene.drawn.append(f'<rect class="{styles[side]}" x="{x:.1f}" y="{y:.1f}" width="9" height="9"/>')
            scene.names[dof] = spot
            scene.cover(spot, 7.0)
    named = [name for name in joints if name]
    if len(parts) == 2:
        nodes = f"{letters[0]} and of {letters[1]} (drawn below it, where they meet)"
    else:
        nodes = f"{', '.join(letters)}, where they meet (drawn apart)"
    springs = f"springs: the joints {', '.join(named)}" if named else "spring: the joint"
    caption = f"Nodes of {nodes}; squares: sensors; arrows: hits; {springs}"
    words = f"Sensors at {', '.join(sensors)}; hits at {', '.join(hits)}."
    return scene.finished("assembly", caption, f"Sketch of the assembly. {words}")


def _view_along(axis: int) -> FloatArray:
    """Return directions on the page of x, y and z, with one of them to the right, without a mirror image."""
    right, up, away = _VIEW.T
    return np.array([[right, up, away], [away, right, up], [-away, up, right]][axis]).T


def _unit(direction: str) -> FloatArray:
    """Return the unit vector of a direction such as ``y``, or zeros if it is none in space."""
    try:
        name = direction_names([direction.lstrip("+-")])[0]
    except ValueError:
        return np.zeros(3)
    return np.eye(6)[DIRECTIONS.index(name)][:3] if name in DIRECTIONS else np.zeros(3)
