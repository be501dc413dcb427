"""A joint of laws as text for finite-element programs: springs as of any joint, equations, point masses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from jointfrf.dofs import DIRECTIONS, direction_places
from jointfrf.io.cards import CardFormat, CardOptions
from jointfrf.joint import Joint

__all__ = ["joint_cards"]

#: Ansys' names of `DIRECTIONS`.
_ANSYS = ("UX", "UY", "UZ", "ROTX", "ROTY", "ROTZ")


def joint_cards(
    program: CardFormat,
    springs: Joint | None,
    rigid: Sequence[str],
    mass: Mapping[str, float],
    nodes: Sequence[int],
    *,
    note: str,
    options: CardOptions,
) -> str:
    """Write springs, equations of rigid DOFs and point masses; `LawJoint.export` describes arguments and errors."""
    comment = {"abaqus": "**", "calculix": "**", "nastran": "$", "ansys": "!"}.get(program, "")
    number = options.get("number", 1)
    if (rigid or mass) and options.get("positions") is not None:
        raise ValueError("equations of rigid DOFs and point masses are written at the nodes: leave positions out")
    parts = [f"{comment} {note}: stiffness and hysteretic damping of that frequency hold there only\n"] if note else []
    last = options.get("element", 1)
    if springs is not None:
        text = springs.export(program, nodes, **options)
        parts.append(text)
        last += len(text.splitlines())  # beyond every element that these lines name
    if rigid:
        parts.append(_equations(program, comment, rigid, nodes, number))
    if mass:
        parts.append(_masses(program, comment, mass, nodes, (last, number)))
    return "".join(parts)


def _equations(program: CardFormat, comment: str, rigid: Sequence[str], nodes: Sequence[int], number: int) -> str:
    """Return u_j - u_k = 0 of each rigid DOF."""
    places = [int(place) for place in direction_places(rigid)]
    if program == "calculix" and max(places) > 2:
        raise ValueError("calculix has no rotations at nodes: rigid rotations cannot be written")
    j, k = nodes
    names = ", ".join(DIRECTIONS[place] for place in places)
    lines = [f"{comment} rigid DOFs {names}: one equation each, written by jointfrf"]
    if program == "nastran":
        lines.append(f"$ case control: MPC = {number}")
    for place in places:
        if program in ("abaqus", "calculix"):
            lines += ["*EQUATION", "2", f"{j}, {place + 1}, 1., {k}, {place + 1}, -1."]
        elif program == "nastran":
            lines.append(f"MPC     {number:8d}{k:8d}{place + 1:8d}{-1.0:8.1f}{j:8d}{place + 1:8d}{1.0:8.1f}")
        else:
            lines.append(f"CE,NEXT,0,{j},{_ANSYS[place]},1,{k},{_ANSYS[place]},-1")
    return "\n".join(lines) + "\n"


def _masses(
    program: CardFormat, comment: str, mass: Mapping[str, float], nodes: Sequence[int], numbers: tuple[int, int]
) -> str:
    """Return half of the mass of the joint on either node, alike in all directions."""
    if any(int(place) > 2 for place in direction_places(list(mass))):
        raise ValueError("rotary inertia of a joint cannot be written: a point mass has none")
    values = set(mass.values())
    if len(values) > 1:
        raise ValueError(f"a point mass is the same in all directions: those of {', '.join(mass)} differ")
    half = values.pop() / 2
    element, number = numbers
    lines = [f"{comment} half of the mass of the joint on each node, in all directions, written by jointfrf"]
    for i, node in enumerate(nodes):
        own = element + i
        if program in ("abaqus", "calculix"):
            name = f"JOINT{number}_M{i + 1}"
            lines += [f"*ELEMENT, TYPE=MASS, ELSET={name}", f"{own}, {node}", f"*MASS, ELSET={name}", f"{half:.13E}"]
        elif program == "nastran":
            lines += [f"CONM2*  {own:16d}{node:16d}{0:16d}{half:16.9E}", "*"]
        else:
            lines += [f"ET,{number + 50 + i},MASS21,,,2", f"R,{number + 50 + i},{half:.13E}",
                      f"TYPE,{number + 50 + i}", f"REAL,{number + 50 + i}", f"E,{node}"]  # fmt: skip
    return "\n".join(lines) + "\n"
