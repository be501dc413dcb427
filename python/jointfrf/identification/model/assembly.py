"""An assembly of substructures, joints between them or to the ground, attached masses and springs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.dofs import direction_names, is_rotation
from jointfrf.identification.model.substructure import FrfSource, Substructure, Unknown, check_same_lines
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_frequency,
    as_names,
    as_positive,
    check_type,
    one_line,
)
from jointfrf.laws.law_joint import Connection, LawJoint, joined
from jointfrf.models.points import Region
from jointfrf.spelling import did_you_mean
from jointfrf.substructuring.coupling import connect

__all__ = [
    "AddedMass",
    "Alike",
    "Assembly",
    "Attachment",
    "GroundSpring",
    "PlacedJoint",
    "Places",
    "assembly_connection",
    "check_joint_order",
    "connection_entries",
    "joint_connection",
    "places_of",
]

#: Words that name the owner of a parameter in addition to parts.
_WORDS = ("joint", "mean", "attachment", "response", "force")


@dataclass(frozen=True)
class Places:
    """DOFs of the substructures at joints, attachments and channels, part by part.

    Attributes
    ----------
    of : dict of str to tuple of str
        Names of the DOFs by part, without the name of the part.
    """

    of: dict[str, tuple[str, ...]]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """All DOFs, ``"A/7:y"``."""
        return tuple(f"{part}/{dof}" for part, dofs in self.of.items() for dof in dofs)

    @cached_property
    def _number(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(self.names)}

    def at(self, names: Sequence[str]) -> list[int]:
        """Return the numbers of DOFs ``"A/..."`` among all."""
        return [self._number[name] for name in names]


@dataclass(frozen=True)
class JointPorts:
    """Ports of the joints of an assembly.

    Attributes
    ----------
    dof : ndarray of int, shape (n,)
        Number of the joint DOF of each port.
    term : ndarray of int, shape (n,)
        Number of the port among the ports of this DOF.
    weight : ndarray, shape (n,)
        Factor of the values of the joint.
    ends : pair of tuple of str, length n
        Names on sides j and k; ``""`` is the ground.
    """

    dof: NDArray[np.intp]
    term: NDArray[np.intp]
    weight: FloatArray
    ends: tuple[tuple[str, ...], tuple[str, ...]]

    @cached_property
    def is_plain(self) -> bool:
        """Whether every port is a DOF, of weight 1."""
        return not self.term.any() and bool((self.weight == 1).all())

    def columns(self, pattern: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return, for each column of a connection of ports, the column of the DOFs and the term."""
        n = len(pattern) // 2
        rows = abs(pattern).argmax(axis=0) % n  # both sides of a law, one side of a mass
        terms = [np.arange((self.dof == row).sum()) for row in rows]
        return np.repeat(np.arange(rows.size), [own.size for own in terms]), np.concatenate(terms)


@dataclass(frozen=True)
class PlacedJoint:
    """A joint between DOFs of two substructures, or between one and the ground.

    Parameters
    ----------
    joint : LawJoint or Joint
        Laws of the joint with initial values; a `Joint` becomes springs and dampers.
    j, k : sequence of str
        DOFs on either side, ``"frame/3:y"``, in the order of the joint; no `k` is the ground, the default. With a
        region, ``"plate/edge:z"``, the values of the joint are per length or area.
    weight : float
        Factor of all its stiffness, damping and mass, such as the length that belongs to a node; default 1. Joints that
        are the `same` have equal values and any weights.

    Raises
    ------
    ValueError
        Another number or order of DOFs than the joint has; a weight that is not positive.

    See Also
    --------
    Assembly.of_parts : assembly with placed joints.

    Examples
    --------
    >>> import jointfrf as jf
    >>> mount = jf.PlacedJoint(jf.Joint([2e5], [30.0], ["z"]), ["machine/foot:z"])
    >>> mount.k, mount.joint.names
    ((), ('k_z', 'c_z'))
    """

    joint: LawJoint
    j: tuple[str, ...]
    k: tuple[str, ...] = ()
    weight: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "weight", as_positive("weight", self.weight))
        if isinstance(self.joint, Joint):
            object.__setattr__(self, "joint", LawJoint.of_joint(self.joint))
        check_type("joint", self.joint, LawJoint)
        for side in "jk":
            dofs = as_names(side, getattr(self, side))
            object.__setattr__(self, side, dofs)
            if side == "k" and not dofs:
                continue
            if len(dofs) != len(self.joint.dofs):
                raise ValueError(f"{side} names {len(dofs)} DOFs, the joint has {len(self.joint.dofs)}")
            check_joint_order(f"{side}: ", [dof.partition("/")[2] for dof in dofs], self.joint.dofs)


@dataclass(frozen=True)
class Alike:
    """Joints whose parameters scatter about common means.

    Parameters
    ----------
    joints : sequence of str
        Names of the joints.
    spread : float, optional
        Standard deviation of each parameter relative to its mean; by default it is estimated from the FRFs.

    Raises
    ------
    ValueError
        Fewer than two joints, or fewer than three without a spread; a spread that is not positive.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.Alike(["left", "right"], spread=0.1).joints
    ('left', 'right')
    """

    joints: tuple[str, ...]
    spread: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "joints", as_names("joints", self.joints))
        if self.spread is not None:
            object.__setattr__(self, "spread", as_positive("spread", self.spread))
        if len(self.joints) < (3 if self.spread is None else 2):
            why = "two do not show how they scatter: give a spread" if len(self.joints) == 2 else "there are too few"
            raise ValueError(f"joints must name joints that are alike, not {one_line(self.joints)}: {why}")


@dataclass(frozen=True, init=False)
class Assembly:
    """Substructures, joints between them or to the ground, attached masses and springs.

    Names of DOFs begin with their part: ``"A/7:y"`` and ``"B/1:y"`` for two parts. `of_parts` takes more parts.

    Parameters
    ----------
    a, b : Substructure
        Two parts, with the joint between their joint DOFs.
    joint : LawJoint or Joint
        Laws of the joint with initial values; a `Joint` becomes springs and dampers.
    attachments : sequence of AddedMass or GroundSpring
        Attached masses and springs to the ground; none by default.

    Attributes
    ----------
    parts : dict of str to Substructure
        Parts by name.
    joints : dict of str to PlacedJoint
        Joints by name; the joint of two parts has the name ``""``.
    attachments : tuple of AddedMass or GroundSpring
        Attached masses and springs.
    same : tuple of tuple of str
        Groups of joints with equal parameters, or of parts with equal unknowns.
    alike : dict of str to Alike
        Joints with common means.

    Raises
    ------
    ValueError
        A part with another number of joint DOFs than the joint; a DOF that does not exist.

    See Also
    --------
    identify_model : fit of the joints and unknowns to measured FRFs.
    Substructure : a part with its unknowns.
    couple : FRFs of two parts and a joint, without unknowns.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"])
    >>> b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"])
    >>> whole = jf.Assembly(a, b, jf.Joint([2000.0], [3.0], dofs=["x"]))
    >>> whole.receptance([2.0, 3.0], ["A/1:x"], ["B/2:x"]).shape
    (2, 1, 1)
    """

    parts: dict[str, Substructure]
    joints: dict[str, PlacedJoint]
    attachments: tuple[Attachment, ...]
    same: tuple[tuple[str, ...], ...]
    alike: dict[str, Alike]

    def __init__(
        self, a: Substructure, b: Substructure, joint: LawJoint | Joint, attachments: Sequence[Attachment] = ()
    ) -> None:
        if isinstance(joint, Joint):
            joint = LawJoint.of_joint(joint)
        for name, value, kind in (("a", a, Substructure), ("b", b, Substructure), ("joint", joint, LawJoint)):
            check_type(name, value, kind)
        for side, part in (("a", a), ("b", b)):
            if len(part.joint) != len(joint.dofs):
                raise ValueError(
                    f"{side}: the substructure has {len(part.joint)} joint DOFs, the joint {len(joint.dofs)}"
                )
            for dof in part.joint:
                if not part.has(dof):
                    raise ValueError(f"joint DOF {one_line(dof)}: {side.upper()} has no such DOF")
            check_joint_order(f"{side}: ", part.joint, joint.dofs)
        j, k = ([f"{name}/{dof}" for dof in part.joint] for name, part in (("A", a), ("B", b)))
        self._set({"A": a, "B": b}, {"": PlacedJoint(joint, tuple(j), tuple(k))}, attachments, (), {})

    @classmethod
    def of_parts(
        cls,
        parts: Mapping[str, Substructure],
        joints: Mapping[str, PlacedJoint],
        attachments: Sequence[Attachment] = (),
        *,
        same: Iterable[Sequence[str]] = (),
        alike: Mapping[str, Alike] | None = None,
    ) -> Assembly:
        """Return an assembly of any number of parts and joints.

        Parameters
        ----------
        parts : mapping of str to Substructure
            Parts by name; their joint DOFs are not used.
        joints : mapping of str to PlacedJoint
            Joints by name, which precedes the names of their parameters: ``"mount.k_z"``.
        attachments : sequence of AddedMass or GroundSpring
            Attached masses and springs to the ground; none by default.
        same : sequence of sequence of str
            Groups of equal joints, or of parts with equal unknowns: they have the parameters of the first one.
        alike : mapping of str to Alike
            Joints with common means, which are named like parameters of a joint of this name.

        Raises
        ------
        ValueError
            A name that does not exist, or comes twice; joints of a group with other laws; a DOF that does not exist.

        Examples
        --------
        A machine of 10 kg on two equal mounts:

        >>> import jointfrf as jf
        >>> mass = jf.Substructure(jf.chain([10.0], [], ground="none"), exact=True)
        >>> mount = jf.Joint([2e5], [30.0], ["x"])
        >>> joints = {name: jf.PlacedJoint(mount, ["machine/1:x"]) for name in ("left", "right")}
        >>> whole = jf.Assembly.of_parts({"machine": mass}, joints, same=[["left", "right"]])
        >>> h, w = whole.receptance([5.0], ["machine/1:x"], ["machine/1:x"])[0, 0, 0], 2 * 3.141592653589793 * 5.0
        >>> bool(abs(h * (2 * 2e5 + 2 * 30j * w - 10 * w**2) - 1) < 1e-9)
        True
        """
        for what, given, kind in (("parts", parts, Substructure), ("joints", joints, PlacedJoint)):
            if not isinstance(given, Mapping) or not given:
                raise TypeError(f"{what} must be a mapping of names to {kind.__name__}, not {one_line(given)}")
            for name, one in given.items():
                check_type(f"{what}: {one_line(name)}", one, kind)
                if not isinstance(name, str) or not name or any(sign in name for sign in "./, ") or name in _WORDS:
                    raise ValueError(
                        f"{what}: a name must be a word without . / and commas, none of {', '.join(_WORDS)}, not "
                        f"{one_line(name)}"
                    )
        if not isinstance(alike, Mapping | None):
            raise TypeError(f"alike must be a mapping of names to Alike, not {one_line(alike)}")
        for name, group in (alike or {}).items():
            check_type(f"alike: {one_line(name)}", group, Alike)
        if isinstance(same, str) or not isinstance(same, Iterable):
            raise TypeError(f"same must be a list of lists of names, not {one_line(same)}")
        found = cls.__new__(cls)
        found._set(
            dict(parts), dict(joints), attachments, tuple(as_names("same", one) for one in same), dict(alike or {})
        )
        for name, one in found.joints.items():
            found.joints[name] = replace(one, joint=found._per_size(name, one))
        held = {dof.partition("/")[0] for own in found.ends for dof in own}
        for name in found.parts:
            if name not in held:
                raise ValueError(f"no joint has the part {name}; add a joint or remove it")
        found._check_groups()
        return found

    def _per_size(self, name: str, one: PlacedJoint) -> LawJoint:
        """Return a joint with the units of its ends; raise an error if these do not match."""
        units: dict[str, str] = {}
        for place, dof in enumerate(one.joint.dofs):
            regions = []
            for side, end in (("j", one.j), ("k", one.k)):
                if end and self.region(end[place]) is None:
                    self.check(end[place : place + 1], f"{side} of {name}:")
                regions += [self.region(end[place])] if end else []
            first, *second = regions
            if second and (first is None) != (second[0] is None):
                raise ValueError(f"{name}: {dof} connects a region with a point; use a region on both sides")
            if first is not None and not all(own is not None and first.matches(own) for own in second):
                sizes = " and ".join(map(str, regions))
                raise ValueError(f"{name}: {dof} connects {sizes}; give both regions the same size and degree")
            if first is not None:
                units[dof] = first.per
        for a, b in one.joint.laws:
            if len({self._ports_of(one.j[one.joint.dofs.index(dof)])[0].partition("~")[0] for dof in (a, b)}) > 1 and (
                a in units or b in units
            ):
                raise ValueError(f"{name}: the cross term {a},{b} must be between DOFs of one region")
        stated = {dof: unit for dof, unit in one.joint.per.items() if units.get(dof) != unit}
        if stated:
            dof, unit = next(iter(stated.items()))
            raise ValueError(f"{name}: the values of {dof} are per {unit}, which its ends are not")
        return one.joint.with_units_per(units) if units else one.joint

    def region(self, name: str) -> Region | None:
        """Return the region whose motion a DOF ``"plate/edge:z"`` is; None for other DOFs."""
        part, _, dof = name.partition("/")
        return self.parts[part].region(dof) if part in self.parts else None

    def _set(self, parts: Any, joints: Any, attachments: Any, same: Any, alike: Any) -> None:
        if not isinstance(attachments, tuple | list):
            raise TypeError(f"attachments must be a tuple of attachments, not {one_line(attachments)}")
        for name, value in (("parts", parts), ("joints", joints), ("attachments", tuple(attachments)), ("same", same),
                            ("alike", alike)):  # fmt: skip
            object.__setattr__(self, name, value)
        for one in self.attachments:
            if not isinstance(one, get_args(Attachment)):
                raise TypeError(f"attachments must be AddedMass or GroundSpring, not {type(one).__name__}")
            self.check(one.places, "attachment")

    def _check_groups(self) -> None:
        """Raise an error for groups with unknown names, or of joints with other laws."""
        grouped: list[str] = []
        for what, names in (
            *(("same", one) for one in self.same),
            *((name, one.joints) for name, one in self.alike.items()),
        ):
            known = self.parts if what == "same" and names and names[0] in self.parts else self.joints
            for name in names:
                if name not in known:
                    raise ValueError(
                        f"{what} names {one_line(name)}: there are {', '.join(known)}{did_you_mean(name, known)}"
                    )
                if name in grouped:
                    raise ValueError(f"{what} names {name}, which is already in a group")
                grouped.append(name)
                own, first = known[name], known[names[0]]
                is_other = (
                    own.joint.names != first.joint.names or own.joint.dofs != first.joint.dofs
                    if isinstance(own, PlacedJoint) and isinstance(first, PlacedJoint)
                    else list(own.fitted) != list(first.fitted)  # type: ignore[union-attr]
                )
                if is_other:
                    raise ValueError(f"{what}: {name} has other parameters than {names[0]}")
        for name in self.alike:
            if not isinstance(name, str) or not name or name in self.joints or any(sign in name for sign in "./, "):
                raise ValueError(f"alike: a group needs a new name, not {one_line(name)}")

    @property
    def a(self) -> Substructure:
        """First of two parts; a ValueError for another number of parts."""
        return self._of_two("A")

    @property
    def b(self) -> Substructure:
        """Second of two parts; a ValueError for another number of parts."""
        return self._of_two("B")

    def _of_two(self, name: str) -> Substructure:
        if "" not in self.joints:
            raise ValueError(f"the parts are {', '.join(self.parts)}; a, b and with_joint need exactly two parts")
        return self.parts[name]

    @cached_property
    def joint(self) -> LawJoint:
        """The joint, or all joints as one with DOFs named ``"mount.y"``."""
        own = {name: one.joint for name, one in self.joints.items()}
        return own[""] if "" in own else joined(own)

    @cached_property
    def ends(self) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """DOFs of `joint` on either side; ``""`` for the ground."""
        j = tuple(dof for one in self.joints.values() for dof in one.j)
        return j, tuple(dof for one in self.joints.values() for dof in one.k or ("",) * len(one.j))

    @cached_property
    def ports(self) -> JointPorts:
        """Ports of the joints: DOFs, and coefficients of the motion of regions."""
        dofs, terms, weights, sides = list[int](), list[int](), list[float](), (list[str](), list[str]())
        number = 0
        for one in self.joints.values():
            for place in range(len(one.j)):
                ends = [self._ports_of(end[place]) if end else () for end in (one.j, one.k)]
                count = len(ends[0])
                dofs += [number] * count
                terms += range(count)
                weights += [one.weight] * count
                for own, end in zip(sides, ends, strict=True):
                    own.extend(end or [""] * count)
                number += 1
        return JointPorts(np.array(dofs), np.array(terms), np.array(weights), (tuple(sides[0]), tuple(sides[1])))

    def _ports_of(self, name: str) -> tuple[str, ...]:
        part, _, dof = name.partition("/")
        return tuple(f"{part}/{own}" for own in self.parts[part].region_ports(dof)) or (name,)

    def with_joint(self, joint: LawJoint) -> Assembly:
        """Return the same assembly of two parts with another joint."""
        return Assembly(self.a, self.b, joint, self.attachments)

    def with_attachments(self, *more: Attachment) -> Assembly:
        """Return the same assembly with additional attachments."""
        found = copy(self)
        object.__setattr__(found, "attachments", (*self.attachments, *more))
        return found

    def has(self, name: str) -> bool:
        """Whether there is a DOF ``"A/7:y"``."""
        check_type("name", name, str)
        part, slash, dof = name.partition("/")
        return bool(slash) and part in self.parts and self.parts[part].has(dof)

    def check(self, names: Sequence[str], what: str) -> None:
        """Raise an error for a DOF that no substructure has."""
        check_type("what", what, str)
        for name in as_names("names", names):
            if not self.has(name):
                whose = "neither A nor B" if list(self.parts) == ["A", "B"] else f"none of {', '.join(self.parts)}"
                first, *others = self.parts
                begin = " or ".join(f"'{part}/'" for part in (first, *others[:1]))
                raise ValueError(f"{what} {one_line(name)}: {whose} has such a DOF (names begin with {begin})")

    def receptance(self, freq_hz: ArrayLike, responses: Sequence[str], forces: Sequence[str]) -> ComplexArray:
        """Return the FRFs of the nominal assembly, shape (n_freq, n_responses, n_forces), m/N.

        Raises
        ------
        ValueError
            A DOF that does not exist; FRFs of a substructure on other lines.
        SingularLineError
            An undamped assembly resonates at a line.
        """
        freq = as_frequency(freq_hz)
        responses, forces = as_names("responses", responses), as_names("forces", forces)
        for names, what in ((responses, "response"), (forces, "force")):
            self.check(names, what)
        places = places_of(self, responses, forces)
        n = len(places.names)
        h, first = np.zeros((freq.size, n, n), np.complex128), 0
        for name, dofs in places.of.items():
            part, own = self.parts[name], slice(first, first + len(dofs))
            first = own.stop
            if isinstance(part.source, FrfSource):
                check_same_lines(name, part.source, freq)
            if dofs:
                h[:, own, own] = part.receptance(freq, dofs)
        numbers = [
            [number.value if isinstance(number, Unknown) else number for number in one.numbers]
            for one in self.attachments
        ]
        link = assembly_connection(self, places, 2 * np.pi * freq, self.joint, numbers)
        connected = connect(h, link, freq)
        return np.ascontiguousarray(connected[:, places.at(responses)][:, :, places.at(forces)])


def check_joint_order(where: str, dofs: Sequence[str], joint: Sequence[str]) -> None:
    """Raise a ValueError if DOFs of a substructure are in another order than the DOFs of the joint.

    Parameters
    ----------
    where : str
        Beginning of the message.
    dofs : sequence of str
        Joint DOFs of the substructure, ``"601:theta"``; a name without a direction is not checked.
    joint : sequence of str
        DOFs of the joint, of any names.

    Notes
    -----
    A rotation must be a rotation. A direction must not be the direction of another DOF of the joint; a direction that
    the joint does not have may be the same motion in other axes.
    """
    known = [_direction(dof) for dof in joint]
    for dof, own, name in zip(dofs, (_direction(dof.rpartition(":")[2]) for dof in dofs), joint, strict=True):
        if ":" not in dof or not own:
            continue
        meant = _direction(name)
        is_other = own != meant and own in known and not _is_open(own, meant)
        if is_other or (meant and is_rotation(own) != is_rotation(meant)):
            raise ValueError(
                f"{where}{dof} is at the place of {name} of the joint; its DOFs are, in this order, {', '.join(joint)}"
            )


def _direction(name: str) -> str:
    """Return the name of a direction among `DIRECTIONS` if it is known, ``theta`` for a rotation without axis."""
    bare = name.lstrip("+-")
    try:
        return direction_names([bare])[0]
    except ValueError:
        return "theta" if is_rotation(bare) else ""


def _is_open(own: str, meant: str) -> bool:
    """Return whether one of two names is a rotation without axis, and the other any rotation."""
    return "theta" in (own, meant) and is_rotation(own) and is_rotation(meant)


def places_of(whole: Assembly, responses: Sequence[str], forces: Sequence[str]) -> Places:
    """Return the DOFs of joints, attachments and channels, joints first, each once."""
    named = [dof for own in whole.ports.ends for dof in own if dof]
    named += [*responses, *forces, *(dof for one in whole.attachments for dof in one.places)]
    of_part: dict[str, list[str]] = {name: [] for name in whole.parts}
    for name in named:
        part, _, dof = name.partition("/")
        of_part[part].append(dof)
    return Places({part: tuple(dict.fromkeys(dofs)) for part, dofs in of_part.items()})


def assembly_connection(
    whole: Assembly, places: Places, omega: FloatArray, joint: LawJoint, numbers: Sequence[Sequence[float]]
) -> Connection:
    """Return the connections of the substructures, with each other and to the ground: joints first, then attachments.

    Parameters
    ----------
    whole : Assembly
        Assembly.
    places : Places
        Its DOFs.
    omega : ndarray, shape (n_freq,)
        Angular frequencies, rad/s.
    joint : LawJoint
        Joint of the assembly with the values to use.
    numbers : sequence of sequence of float
        Numbers of each attachment.

    Returns
    -------
    Connection
        Connection with a pattern of shape (m, q).
    """
    own = joint_connection(whole, joint, omega)
    q = own.pattern.shape[1]
    attached = [dof for one in whole.attachments for dof in one.places]
    total = q + len(attached)
    pattern = np.zeros((len(places.names), total))
    ends = [*whole.ports.ends[0], *whole.ports.ends[1]]
    held = [i for i, dof in enumerate(ends) if dof]  # the ground does not move
    np.add.at(pattern[:, :q], places.at([ends[i] for i in held]), own.pattern[held])
    s, t = np.zeros((2, omega.size, total, total), np.complex128)
    s[:, :q, :q], t[:, :q, :q] = own.s, own.t
    rest = np.arange(q, total)
    pattern[places.at(attached), rest] = 1
    s[:, rest, rest] = 1
    place = q
    for one, values in zip(whole.attachments, numbers, strict=True):
        for _ in one.places:
            t[:, place, place] = attachment_factors(one, omega).T @ np.asarray(values)
            place += 1
    return Connection(pattern, s, t)


def joint_connection(whole: Assembly, joint: LawJoint, omega: FloatArray) -> Connection:
    """Return the connection of the ports of an assembly by its joints: pattern of shape (2 n_ports, q), j, then k."""
    own, ports = joint.connection(omega), whole.ports
    if ports.is_plain:
        return own
    column, term, dofs = *ports.columns(own.pattern), np.r_[ports.dof, len(joint.dofs) + ports.dof]
    is_one = term[:, None] == term
    of_port = own.pattern[dofs][:, column] * (np.tile(ports.term, 2)[:, None] == term)
    of_port *= np.sqrt(np.tile(ports.weight, 2))[:, None]
    s, t = (matrix[:, column[:, None], column] * is_one for matrix in (own.s, own.t))
    return Connection(of_port, s, t)


def connection_entries(
    whole: Assembly, joint: LawJoint, omega: FloatArray
) -> list[tuple[list[tuple[int, int]], ComplexArray]]:
    """Return `LawJoint.connection_slopes` with the entries of T of `joint_connection`."""
    found = joint.connection_slopes(omega)
    if whole.ports.is_plain:
        return found
    column, term = whole.ports.columns(joint.connection(omega[:1]).pattern)
    at: dict[int, list[int]] = {}
    for i, own in enumerate(column.tolist()):
        at.setdefault(own, []).append(i)
    return [
        ([(i, j) for row, other in entries for i in at[row] for j in at[other] if term[i] == term[j]], slope)
        for entries, slope in found
    ]


def attachment_factors(one: Attachment, omega: FloatArray) -> ComplexArray:
    """Return the factor of each number of an attachment in its dynamic stiffness, shape (n_numbers, n_freq)."""
    if isinstance(one, AddedMass):
        return np.asarray([-(omega**2)], np.complex128)
    return np.asarray([np.ones_like(omega), 1j * omega], np.complex128)


@dataclass(frozen=True)
class AddedMass:
    """Mass of a sensor or a shaker that is not in the models.

    Parameters
    ----------
    dofs : str or tuple of str
        DOF of the mass, ``"A/151:y"``, or all its DOFs if it moves in several directions.
    mass : Unknown or float
        Mass, kg, or moment of inertia, kg m^2, for a rotation.

    See Also
    --------
    GroundSpring : spring and dashpot to the ground.
    Assembly : assembly with attachments.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.AddedMass("A/151:y", jf.Unknown(0.01, 0.005, lower=0)).names
    ('mass A/151:y',)
    """

    dofs: str | tuple[str, ...]
    mass: Unknown | float

    def __post_init__(self) -> None:
        if not isinstance(self.dofs, str) and not as_names("dofs", self.dofs):
            raise ValueError("dofs must name at least one DOF")

    @property
    def places(self) -> tuple[str, ...]:
        """The DOFs."""
        return (self.dofs,) if isinstance(self.dofs, str) else tuple(self.dofs)

    @property
    def names(self) -> tuple[str, ...]:
        """Name of the mass."""
        return (f"mass {self.places[0]}",)

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of the mass."""
        return ("kg m^2" if is_rotation(self.places[0].rpartition(":")[2]) else "kg",)

    @property
    def numbers(self) -> tuple[Unknown | float, ...]:
        """Value of the mass."""
        return (self.mass,)


@dataclass(frozen=True)
class GroundSpring:
    """Spring and dashpot to the ground: a suspension, a flexible clamp, the stinger of a shaker.

    Parameters
    ----------
    dof : str
        DOF of the spring, ``"A/1:theta"``.
    stiffness : Unknown or float
        Stiffness, N/m, or N m/rad for a rotation.
    damping : Unknown or float
        Viscous damping, N s/m, or N m s/rad for a rotation; default 0.

    See Also
    --------
    AddedMass : mass of a sensor or a shaker.
    Assembly : assembly with attachments.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.GroundSpring("A/1:theta", jf.Unknown(1e5, 5e4, lower=0)).names
    ('ground stiffness A/1:theta', 'ground damping A/1:theta')
    """

    dof: str
    stiffness: Unknown | float
    damping: Unknown | float = 0.0

    def __post_init__(self) -> None:
        check_type("dof", self.dof, str)

    @property
    def places(self) -> tuple[str, ...]:
        """The DOF."""
        return (self.dof,)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of stiffness and damping."""
        return f"ground stiffness {self.dof}", f"ground damping {self.dof}"

    @property
    def units(self) -> tuple[str, ...]:
        """Units of stiffness and damping."""
        turns = is_rotation(self.dof.rpartition(":")[2])
        return ("N m/rad", "N m s/rad") if turns else ("N/m", "N s/m")

    @property
    def numbers(self) -> tuple[Unknown | float, ...]:
        """Values of stiffness and damping."""
        return self.stiffness, self.damping


Attachment = AddedMass | GroundSpring
