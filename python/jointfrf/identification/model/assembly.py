"""An assembly of two substructures, a joint and what is attached to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.dofs import direction_names, is_rotation
from jointfrf.identification.model.substructure import FrfSource, Substructure, Unknown, check_same_lines
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_frequency, as_names, check_type, one_line
from jointfrf.laws.law_joint import Connection, LawJoint
from jointfrf.substructuring.coupling import connect

__all__ = [
    "AddedMass",
    "Assembly",
    "Attachment",
    "GroundSpring",
    "Places",
    "assembly_connection",
    "check_joint_order",
    "places_of",
]


@dataclass(frozen=True)
class Places:
    """DOFs of both substructures that matter: joint, attachments, channels; those of A first.

    Attributes
    ----------
    a, b : tuple of str
        Names in A and B, without ``"A/"`` and ``"B/"``.
    """

    a: tuple[str, ...]
    b: tuple[str, ...]

    def at(self, names: Sequence[str]) -> list[int]:
        """Return the numbers of DOFs ``"A/..."``, ``"B/..."`` among all."""
        return [
            self.a.index(name[2:]) if name.startswith("A/") else len(self.a) + self.b.index(name[2:]) for name in names
        ]


@dataclass(frozen=True)
class Assembly:
    """Two substructures, a joint between them, and what is attached.

    DOFs of the assembly are named ``"A/..."`` and ``"B/..."``, as by `assemble`.

    Parameters
    ----------
    a, b : Substructure
    joint : LawJoint or Joint
        Its laws; a `Joint` becomes springs and dampers. Its values are where a fit may start.
    attachments : sequence of AddedMass or GroundSpring

    Raises
    ------
    ValueError
        A number of joint DOFs that is not that of the joint; a DOF that does not exist.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"])
    >>> b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"])
    >>> whole = jf.Assembly(a, b, jf.Joint([2000.0], [3.0], dofs=["x"]))
    >>> whole.receptance([2.0, 3.0], ["A/1:x"], ["B/2:x"]).shape
    (2, 1, 1)
    """

    a: Substructure
    b: Substructure
    joint: LawJoint
    attachments: tuple[Attachment, ...] = ()

    def __post_init__(self) -> None:
        if isinstance(self.joint, Joint):
            object.__setattr__(self, "joint", LawJoint.of_joint(self.joint))
        for name, value, kind in (
            ("a", self.a, Substructure),
            ("b", self.b, Substructure),
            ("joint", self.joint, LawJoint),
        ):
            check_type(name, value, kind)
        if not isinstance(self.attachments, tuple | list):
            raise TypeError(f"attachments must be a tuple of attachments, not {one_line(self.attachments)}")
        object.__setattr__(self, "attachments", tuple(self.attachments))
        for one in self.attachments:
            if not isinstance(one, get_args(Attachment)):
                raise TypeError(f"attachments must hold AddedMass and GroundSpring, not {type(one).__name__}")
        for side, part in (("a", self.a), ("b", self.b)):
            if len(part.joint) != len(self.joint.dofs):
                raise ValueError(
                    f"{side}: the substructure has {len(part.joint)} joint DOFs, the joint {len(self.joint.dofs)}"
                )
            self.check([f"{side.upper()}/{dof}" for dof in part.joint], "joint DOF")
            check_joint_order(f"{side}: ", part.joint, self.joint.dofs)
        for one in self.attachments:
            self.check(one.places, "attachment")

    def check(self, names: Sequence[str], what: str) -> None:
        """Raise an error for a DOF that neither substructure has."""
        check_type("what", what, str)
        for name in as_names("names", names):
            side = {"A/": self.a, "B/": self.b}.get(str(name)[:2])
            if side is None or not side.has(name[2:]):
                raise ValueError(
                    f"{what} {one_line(name)}: neither A nor B has such a DOF (names begin with 'A/' or 'B/')"
                )

    def receptance(self, freq_hz: ArrayLike, responses: Sequence[str], forces: Sequence[str]) -> ComplexArray:
        """Return the FRFs of the assembly as believed, shape (n_freq, n_responses, n_forces), m/N.

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
        n_a, n = len(places.a), len(places.a) + len(places.b)
        h = np.zeros((freq.size, n, n), np.complex128)
        for name, part, own in (("A", self.a, slice(0, n_a)), ("B", self.b, slice(n_a, n))):
            if isinstance(part.source, FrfSource):
                check_same_lines(name, part.source, freq)
            h[:, own, own] = part.receptance(freq, places.a if name == "A" else places.b)
        numbers = [
            [number.value if isinstance(number, Unknown) else number for number in one.numbers]
            for one in self.attachments
        ]
        link = assembly_connection(self, places, 2 * np.pi * freq, self.joint, numbers)
        connected = connect(h, link, freq)
        return np.ascontiguousarray(connected[:, places.at(responses)][:, :, places.at(forces)])


def check_joint_order(where: str, dofs: Sequence[str], joint: Sequence[str]) -> None:
    """Raise a ValueError where DOFs of a substructure stand in another order than those of the joint.

    Parameters
    ----------
    where : str
        Beginning of the message.
    dofs : sequence of str
        Joint DOFs of the substructure, ``"601:theta"``; without a direction the name says nothing.
    joint : sequence of str
        DOFs of the joint, of any names.

    Notes
    -----
    A rotation must be a rotation. A direction must not be that of another DOF of the joint; one that the joint does not
    have may be the same motion in other axes.
    """
    known = [_direction(dof) for dof in joint]
    for dof, own, name in zip(dofs, (_direction(dof.rpartition(":")[2]) for dof in dofs), joint, strict=True):
        if ":" not in dof or not own:
            continue
        meant = _direction(name)
        is_other = own != meant and own in known and not _is_open(own, meant)
        if is_other or (meant and is_rotation(own) != is_rotation(meant)):
            raise ValueError(
                f"{where}{dof} stands where the joint has {name}: its DOFs are, in this order, {', '.join(joint)}"
            )


def _direction(name: str) -> str:
    """Return the name of a direction among `DIRECTIONS` where it is known, ``theta`` of a rotation without axis."""
    bare = name.lstrip("+-")
    try:
        return direction_names([bare])[0]
    except ValueError:
        return "theta" if is_rotation(bare) else ""


def _is_open(own: str, meant: str) -> bool:
    """Whether one of two names is a rotation without axis, and the other any rotation."""
    return "theta" in (own, meant) and is_rotation(own) and is_rotation(meant)


def places_of(whole: Assembly, responses: Sequence[str], forces: Sequence[str]) -> Places:
    """Return the DOFs that matter: those of the joint first, each once."""
    named = [*responses, *forces, *(dof for one in whole.attachments for dof in one.places)]
    of_side = {"A/": list(whole.a.joint), "B/": list(whole.b.joint)}
    for name in named:
        of_side[name[:2]].append(name[2:])
    return Places(tuple(dict.fromkeys(of_side["A/"])), tuple(dict.fromkeys(of_side["B/"])))


def assembly_connection(
    whole: Assembly, places: Places, omega: FloatArray, joint: LawJoint, numbers: Sequence[Sequence[float]]
) -> Connection:
    """Return all that connects the substructures and holds or loads them: the joint first, then attachments.

    Parameters
    ----------
    whole : Assembly
    places : Places
    omega : ndarray, shape (n_freq,)
        rad/s.
    joint : LawJoint
        With the values wanted.
    numbers : sequence of sequence of float
        Those of each attachment.

    Returns
    -------
    Connection
        Pattern of shape (m, q).
    """
    own = joint.connection(omega)
    q = own.pattern.shape[1]
    attached = [dof for one in whole.attachments for dof in one.places]
    total = q + len(attached)
    pattern = np.zeros((len(places.a) + len(places.b), total))
    at_joint = [*places.at([f"A/{dof}" for dof in whole.a.joint]), *places.at([f"B/{dof}" for dof in whole.b.joint])]
    pattern[at_joint, :q] = own.pattern
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


def attachment_factors(one: Attachment, omega: FloatArray) -> ComplexArray:
    """Return by what each number of an attachment enters its dynamic stiffness, shape (n_numbers, n_freq)."""
    if isinstance(one, AddedMass):
        return np.asarray([-(omega**2)], np.complex128)
    return np.asarray([np.ones_like(omega), 1j * omega], np.complex128)


@dataclass(frozen=True)
class AddedMass:
    """Mass of a sensor or a shaker that the models do not have.

    Parameters
    ----------
    dofs : str or tuple of str
        Where it moves, ``"A/151:y"``; all directions in which it does.
    mass : Unknown or float
        kg (of a rotation kg m^2).

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
        """Names of its numbers."""
        return (f"mass {self.places[0]}",)

    @property
    def units(self) -> tuple[str, ...]:
        """Their units."""
        return ("kg m^2" if is_rotation(self.places[0].rpartition(":")[2]) else "kg",)

    @property
    def numbers(self) -> tuple[Unknown | float, ...]:
        """Its numbers: the mass."""
        return (self.mass,)


@dataclass(frozen=True)
class GroundSpring:
    """Spring and dashpot to the ground: a suspension, a clamp that gives way, the stinger of a shaker.

    Parameters
    ----------
    dof : str
        Where it holds, ``"A/1:theta"``.
    stiffness : Unknown or float
        N/m, of a rotation N m/rad.
    damping : Unknown or float
        Viscous, N s/m, N m s/rad.

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
        """Names of its numbers."""
        return f"ground stiffness {self.dof}", f"ground damping {self.dof}"

    @property
    def units(self) -> tuple[str, ...]:
        """Their units."""
        turns = is_rotation(self.dof.rpartition(":")[2])
        return ("N m/rad", "N m s/rad") if turns else ("N/m", "N s/m")

    @property
    def numbers(self) -> tuple[Unknown | float, ...]:
        """Its numbers: stiffness and damping."""
        return self.stiffness, self.damping


Attachment = AddedMass | GroundSpring
