"""A joint of laws: one for each DOF, cross terms, masses, DOFs that are rigid; as input of finite-element programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Self, Unpack

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.dofs import direction_places, is_rotation, parameter_name
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_frequency,
    as_names,
    as_number,
    as_real,
    check_choice,
    check_type,
)
from jointfrf.kernel.call import OnSingular
from jointfrf.kernel.linear_algebra import invert
from jointfrf.laws.law import JointLaw, LawField
from jointfrf.laws.springs import SpringLaw

if TYPE_CHECKING:
    from jointfrf.io.card_link import CardFormat
    from jointfrf.io.cards import CardOptions

__all__ = ["Connection", "JointQuantity", "LawJoint", "joined"]

#: Share of the mass of a joint DOF on either side.
_MASS = LawField("m", "number", 0.0)


class JointQuantity(NamedTuple):
    """A number of a joint.

    Attributes
    ----------
    name : str
        Field and DOF, ``"k_y"``; for a cross term ``"k_y,theta"``; at one of several points ``"bolt1.k_y"``.
    field : LawField
        Field of the law.
    unit : str
        Unit.
    value : float
        Value.
    """

    name: str
    field: LawField
    unit: str
    value: float


class Connection(NamedTuple):
    """Connection of DOFs of structures, without an inverse: forces f with S f = T u, u = E^T x.

    A stiffness has S = 1 and T = K*, a rigid connection S = 0 and T = 1.

    Attributes
    ----------
    pattern : ndarray, shape (m, q)
        Matrix E: E^T maps motions of the m DOFs to motions u of the connection; forces on the DOFs are -E f.
    s, t : ndarray, shape (n_freq, q, q)
        Matrices S and T, 1 and N/m.
    """

    pattern: FloatArray
    s: ComplexArray
    t: ComplexArray


@dataclass(frozen=True, init=False)
class LawJoint:
    """Joint with a law for each DOF, cross terms, masses, and DOFs that are rigid.

    Parameters
    ----------
    laws : mapping of str or (str, str) to JointLaw
        Law of each DOF that moves; for a pair of DOFs, its symmetric cross term K*_ab.
    rigid : sequence of str
        DOFs that do not move: constraints between both sides, not stiff springs; none by default.
    mass : mapping of str to float
        Mass of the joint by DOF, kg (rotations kg m^2); half of it moves with either side. None by default.
    dofs : sequence of str, optional
        Order of the DOFs; by default the DOFs of `laws`, then the rigid ones.
    per : mapping of str to {"m", "m^2"}, optional
        DOFs with stiffness, damping and mass per length or area, for a joint along a line or over a face.

    Raises
    ------
    ValueError
        A DOF with two laws or none, a cross term with a rigid DOF or between a DOF per length and another, a mass that
        is not positive.

    See Also
    --------
    Joint : joint of constant matrices.
    SpringLaw, StandardLinearSolid : laws of a DOF.

    Examples
    --------
    A rubber mount that is rigid in rotation:

    >>> import jointfrf as jf
    >>> mount = jf.LawJoint({"y": jf.StandardLinearSolid(1e5, 2e5, 1e-3)}, rigid=["theta"])
    >>> mount.dofs, mount.names
    (('y', 'theta'), ('k_y', 'k_m_y', 'tau_y'))
    >>> mount.compliance([0.0])[0].real.tolist()
    [[1e-05, 0.0], [0.0, 0.0]]
    """

    laws: Mapping[tuple[str, str], JointLaw]
    rigid: tuple[str, ...]
    mass: Mapping[str, float]
    dofs: tuple[str, ...]
    per: Mapping[str, str]

    def __init__(
        self,
        laws: Mapping[Any, JointLaw],
        rigid: Sequence[str] = (),
        mass: Mapping[str, float] | None = None,
        dofs: Sequence[str] | None = None,
        per: Mapping[str, str] | None = None,
    ) -> None:
        if not isinstance(laws, Mapping) or not isinstance(mass, Mapping | None):
            what = "mass" if isinstance(laws, Mapping) else "laws"
            raise TypeError(f"{what} must be a mapping by the names of DOFs")
        rigid = as_names("rigid", rigid)
        by_pair: dict[tuple[str, str], JointLaw] = {}
        for key, law in laws.items():
            if not isinstance(law, JointLaw):
                raise TypeError(f"laws: the law of {key!r} must be a JointLaw, not {type(law).__name__}")
            by_pair[(key, key) if isinstance(key, str) else key] = law
        moving = [a for a, b in by_pair if a == b]
        names = (*moving, *rigid) if dofs is None else as_names("dofs", dofs)
        if sorted(names) != sorted([*moving, *rigid]) or len(set(names)) != len(names) or not names:
            raise ValueError(
                f"every DOF must have one law or be rigid: laws of {', '.join(moving) or 'none'}, rigid "
                f"{', '.join(rigid) or 'none'}, dofs {', '.join(names) or 'none'}"
            )
        for a, b in by_pair:
            if a not in moving or b not in moving:
                raise ValueError(f"the cross term {a},{b} must be between two DOFs that have laws")
            if a != b and (b, a) in by_pair:
                raise ValueError(f"the cross term {a},{b} is there twice; name it once")
        masses = {dof: as_number(f"mass of {dof}", value) for dof, value in (mass or {}).items()}
        for dof, value in masses.items():
            if dof not in names:
                raise ValueError(f"mass names {dof!r}, which is no DOF of the joint ({', '.join(names)})")
            if value < 0:
                raise ValueError(f"the mass of {dof} must not be negative, not {value:g}")
        own = {dof: unit for dof in names if (unit := (per or {}).get(dof)) is not None}
        for dof, unit in own.items():
            check_choice(f"per of {dof}", unit, ("m", "m^2"))
        for a, b in by_pair:
            if own.get(a) != own.get(b):
                raise ValueError(f"the cross term {a},{b} must be between two DOFs per the same length or area")
        object.__setattr__(self, "laws", by_pair)
        object.__setattr__(self, "rigid", tuple(rigid))
        object.__setattr__(self, "mass", masses)
        object.__setattr__(self, "dofs", names)
        object.__setattr__(self, "per", own)

    @classmethod
    def of_joint(cls, joint: Joint) -> LawJoint:
        """Return a joint of springs and dampers that equals a joint of matrices.

        Raises
        ------
        ValueError
            Matrices that are not symmetric, a negative stiffness of a DOF.
        """
        check_type("joint", joint, Joint)
        k, c, h = joint.stiffness, joint.damping, joint.hysteretic_stiffness
        for name, matrix in (("stiffness", k), ("damping", c), ("hysteretic damping", h)):
            if not np.allclose(matrix, matrix.T, rtol=1e-10, atol=0):
                raise ValueError(f"the {name} of the joint must be symmetric")
        laws: dict[str | tuple[str, str], JointLaw] = {}
        n = len(joint.dofs)
        for a in range(n):
            laws[joint.dofs[a]] = SpringLaw(k[a, a], c[a, a], h[a, a])
        for a in range(n):
            for b in range(a + 1, n):
                if k[a, b] or c[a, b] or h[a, b]:
                    laws[joint.dofs[a], joint.dofs[b]] = SpringLaw(k[a, b], c[a, b], h[a, b], is_cross=True)
        return cls(laws)

    @property
    def quantities(self) -> tuple[JointQuantity, ...]:
        """All parameters, law by law, then masses."""
        found = []
        for (a, b), law in self.laws.items():
            rotations = is_rotation(a) + is_rotation(b)
            per = f" per {self.per[a]}" if a in self.per else ""
            for field, value in zip(law.fields, law.values.tolist(), strict=True):
                unit = field.unit(rotations) + (per if field.is_factor else "")
                found.append(JointQuantity(parameter_name(field.name, a, b), field, unit, value))
        for dof, mass in self.mass.items():
            unit = ("kg m^2" if is_rotation(dof) else "kg") + (f" per {self.per[dof]}" if dof in self.per else "")
            found.append(JointQuantity(parameter_name("m", dof, dof), _MASS, unit, mass))
        return tuple(found)

    def with_units_per(self, per: Mapping[str, str]) -> LawJoint:
        """Return the same joint with DOFs whose values are per ``"m"`` or ``"m^2"``."""
        return LawJoint(self.laws, self.rigid, self.mass, self.dofs, per)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters."""
        return tuple(one.name for one in self.quantities)

    @property
    def values(self) -> FloatArray:
        """Values of all parameters, shape (p,)."""
        return np.array([one.value for one in self.quantities])

    def with_values(self, values: ArrayLike) -> Self:
        """Return the same joint with other values of its parameters, shape (p,)."""
        found = as_real("values", values, (sum(len(law.fields) for law in self.laws.values()) + len(self.mass),))
        laws, at = {}, 0
        for pair, law in self.laws.items():
            laws[pair] = law.with_values(found[at : at + len(law.fields)])
            at += len(law.fields)
        if (found[at:] < 0).any():
            raise ValueError(f"the mass of the joint must not be negative, not {found[at:].min():g}")
        other = copy(self)
        object.__setattr__(other, "laws", laws)
        object.__setattr__(other, "mass", dict(zip(self.mass, found[at:].tolist(), strict=True)))
        return other

    def _place(self, pair: tuple[str, str]) -> tuple[int, int]:
        return self.dofs.index(pair[0]), self.dofs.index(pair[1])

    def _moving_stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return K*(w) with zeros for rigid DOFs, shape (n_freq, n, n)."""
        k = np.zeros((omega.size, len(self.dofs), len(self.dofs)), np.complex128)
        for pair, law in self.laws.items():
            a, b = self._place(pair)
            k[:, a, b] = k[:, b, a] = law.stiffness(omega)
        return k

    def dynamic_stiffness(self, freq_hz: ArrayLike) -> ComplexArray:
        """Return the complex stiffness K*(w), without masses, shape (n_freq, n, n), N/m, rotational N m/rad.

        Raises
        ------
        ValueError
            A DOF is rigid: it has no stiffness; `compliance` is zero for it.
        """
        if self.rigid:
            raise ValueError(f"{', '.join(self.rigid)}: a rigid DOF has no finite stiffness; its compliance is zero")
        return self._moving_stiffness(2 * np.pi * as_frequency(freq_hz))

    def compliance(self, freq_hz: ArrayLike, *, on_singular: OnSingular = "raise") -> ComplexArray:
        """Return the complex compliance K*^-1(w), zero for rigid DOFs, shape (n_freq, n, n), m/N, rotational rad/(N m).

        Raises
        ------
        SingularLineError
            A line with singular K*, unless `on_singular` is "nan".
        """
        freq = as_frequency(freq_hz)
        moving = [i for i, dof in enumerate(self.dofs) if dof not in self.rigid]
        c = np.zeros((freq.size, len(self.dofs), len(self.dofs)), np.complex128)
        k = self._moving_stiffness(2 * np.pi * freq)[:, moving][:, :, moving]
        if moving:
            c[:, np.array(moving)[:, None], moving] = invert(k, freq_hz=freq, on_singular=on_singular)
        return c

    def connection(self, omega: FloatArray) -> Connection:
        """Return the connection of the joint DOFs j of A, then k of B; its masses come last, on j, then on k."""
        n, masses = len(self.dofs), list(self.mass)
        q = n + 2 * len(masses)
        pattern = np.zeros((2 * n, q))
        pattern[np.arange(n), np.arange(n)] = 1
        pattern[n + np.arange(n), np.arange(n)] = -1
        s, t = np.zeros((2, omega.size, q, q), np.complex128)
        s[:, np.arange(q), np.arange(q)] = 1
        t[:, :n, :n] = self._moving_stiffness(omega)
        for dof in self.rigid:
            i = self.dofs.index(dof)
            s[:, i, i], t[:, i, i] = 0, 1
        for i, dof in enumerate(masses):
            for place, row in ((n + i, 0), (n + len(masses) + i, n)):
                pattern[row + self.dofs.index(dof), place] = 1
                t[:, place, place] = -(omega**2) * self.mass[dof] / 2
        return Connection(pattern, s, t)

    def connection_slopes(self, omega: FloatArray) -> list[tuple[list[tuple[int, int]], ComplexArray]]:
        """Return, for each parameter, the entries of T that it changes, and its derivative there, shape (n_freq,)."""
        found: list[tuple[list[tuple[int, int]], ComplexArray]] = []
        for pair, law in self.laws.items():
            a, b = self._place(pair)
            entries = [(a, a)] if a == b else [(a, b), (b, a)]
            found += [(entries, slope) for slope in law.slopes(omega)]
        n, count = len(self.dofs), len(self.mass)
        for i in range(count):
            places = [(n + i, n + i), (n + count + i, n + count + i)]
            found.append((places, np.asarray(-(omega**2) / 2, np.complex128)))
        return found

    def check_at_points(self, why: str) -> None:
        """Raise a ValueError for a joint along a line or over a face."""
        if self.per:
            dof, unit = next(iter(self.per.items()))
            raise ValueError(
                f"the values of {dof} are per {unit}, and {why}: give each node its share of the length or area by "
                "LawJoint with multiplied values"
            )

    def constant_joint(self, freq_hz: float | None = None) -> Joint:
        """Return the joint as constant matrices, if necessary at one frequency.

        Parameters
        ----------
        freq_hz : float, optional
            Frequency, Hz, at which laws that depend on frequency are evaluated: k = Re K*, h = Im K*.

        Raises
        ------
        ValueError
            A rigid DOF, a mass, or, without `freq_hz`, a law that depends on frequency.
        """
        self.check_at_points("it has the constants of two points")
        if self.rigid or self.mass:
            what = f"{', '.join(self.rigid)} rigid" if self.rigid else f"a mass in {', '.join(self.mass)}"
            raise ValueError(f"a joint with {what} is not one of stiffness and damping alone")
        n = len(self.dofs)
        k, c, h = np.zeros((3, n, n))
        for pair, law in self.laws.items():
            a, b = self._place(pair)
            terms = law.constant_terms
            if terms is None and freq_hz is None:
                raise ValueError(
                    f"{type(law).__name__} of {','.join(dict.fromkeys(pair))} depends on frequency; state one "
                    "frequency by freq_hz"
                )
            if terms is None:
                at = law.stiffness(2 * np.pi * as_frequency([float(freq_hz or 0)]))[0]
                terms = float(at.real), 0.0, float(at.imag)
            for matrix, value in zip((k, c, h), terms, strict=True):
                matrix[a, b] = matrix[b, a] = value
        return Joint(k, c, self.dofs, structural_damping=h)

    def export(
        self, program: CardFormat, nodes: Sequence[int], *, freq_hz: float | None = None, **options: Unpack[CardOptions]
    ) -> str:
        """Return the joint as input of a finite-element program.

        Parameters
        ----------
        program : {"abaqus", "calculix", "nastran", "ansys", "code_aster", "lsdyna", "subdyn"}
            Name of the program.
        nodes : sequence of two int
            Nodes j on A and k on B.
        freq_hz : float, optional
            Frequency, Hz, at which laws that depend on frequency are evaluated, if there are no tables. The result is
            stiffness and hysteretic damping at this frequency, with a comment.
        element, number, rotation_nodes, damping, full_matrix, positions, points, units, faces, comments, connector
            Options of the program; see `Joint.export`. A joint with masses takes no `positions`.
        damping_nodes
            First number of the auxiliary nodes of dashpots; see `Joint.export`.
        table_hz : array_like, optional
            Frequencies, Hz, of tables of the laws, in place of `freq_hz`; see `Joint.export`.

        Returns
        -------
        str
            Lines of input:

            - springs and dashpots as in `Joint.export`
            - rigid DOFs as equations between the nodes, rotations in CalculiX between the `rotation_nodes`
            - masses as point masses on both nodes

        Raises
        ------
        ValueError
            The program cannot represent the joint: a law depends on frequency without `freq_hz` or `table_hz`, masses
            differ by direction, or there is rotary inertia. An error of `Joint.export`.

        Examples
        --------
        >>> import jointfrf as jf
        >>> print(jf.LawJoint({}, rigid=["y"]).export("abaqus", (102, 202)))
        ** rigid DOFs y: one equation each, written by jointfrf
        *EQUATION
        2
        102, 2, 1., 202, 2, -1.
        <BLANKLINE>
        """
        self.check_at_points("cards connect two nodes")
        table_hz = options.get("table_hz")
        if table_hz is not None and freq_hz is not None:
            raise ValueError("freq_hz takes laws at one frequency, table_hz over many; name one of them")
        springs = None
        if self.laws:
            springs = LawJoint(self.laws) if table_hz is not None else LawJoint(self.laws).constant_joint(freq_hz)
        varying = (
            []
            if table_hz is not None
            else [
                f"{type(law).__name__} of {','.join(dict.fromkeys(pair))}"
                for pair, law in self.laws.items()
                if law.constant_terms is None
            ]
        )
        from jointfrf.io.card_link import COMMENT_MARKS  # importing readers of files is slow

        comment = COMMENT_MARKS.get(program, "")
        if self.mass and options.get("positions") is not None:
            raise ValueError("point masses are written at the nodes; leave positions out")
        note = f"{comment} {', '.join(varying)} at {freq_hz:g} Hz" if varying else ""
        text = f"{note}: stiffness and hysteretic damping are valid at this frequency only\n" if note else ""
        number, element = options.get("number", 1), options.get("element", 1)
        if springs is not None:
            cards = _springs(springs, program, nodes, table_hz, options)
            text += cards
            element += len(cards.splitlines())  # above all elements in these lines
        if self.rigid:
            from jointfrf.io.cards import rigid_cards  # importing readers of files is slow

            text += rigid_cards(program, self.rigid, nodes, options, alone=springs is None)
        if self.mass:
            from jointfrf.io.units import model_units

            own = model_units(options.get("units", "SI"))
            scaled = {dof: mass / own.mass for dof, mass in self.mass.items()}
            text += _masses(program, comment, scaled, nodes, (element, number))
        return text


def _springs(
    springs: Joint | LawJoint,
    program: CardFormat,
    nodes: Sequence[int],
    table_hz: ArrayLike | None,
    options: CardOptions,
) -> str:
    """Return the cards of springs and dampers, or of laws as tables over frequency."""
    if isinstance(springs, Joint) or table_hz is None:
        return springs.export(program, nodes, **options)
    from jointfrf.io.cards import table_cards  # importing readers of files is slow

    freq = as_real("table_hz", table_hz, (None,))
    return table_cards(program, springs.dofs, freq, springs.dynamic_stiffness(freq), nodes, **options)


def joined(joints: Mapping[str, LawJoint]) -> LawJoint:
    """Return several joints as one without coupling between them; DOFs are named ``"mount.y"``."""
    laws, rigid, mass, dofs, per = {}, list[str](), dict[str, float](), list[str](), dict[str, str]()
    for name, joint in joints.items():
        laws.update({(f"{name}.{a}", f"{name}.{b}"): law for (a, b), law in joint.laws.items()})
        rigid += [f"{name}.{dof}" for dof in joint.rigid]
        mass.update({f"{name}.{dof}": value for dof, value in joint.mass.items()})
        dofs += [f"{name}.{dof}" for dof in joint.dofs]
        per.update({f"{name}.{dof}": unit for dof, unit in joint.per.items()})
    return LawJoint(laws, rigid, mass, dofs, per)


def _masses(
    program: CardFormat, comment: str, mass: Mapping[str, float], nodes: Sequence[int], numbers: tuple[int, int]
) -> str:
    """Return half of the mass of the joint on either node, equal in all directions."""
    if any(int(place) > 2 for place in direction_places(list(mass))):
        raise ValueError("rotary inertia of a joint cannot be written, as a point mass has none; leave it out")
    values = set(mass.values())
    if len(values) > 1:
        raise ValueError(f"a point mass is the same in all directions; the masses of {', '.join(mass)} differ")
    if program not in ("abaqus", "calculix", "nastran", "ansys"):
        raise ValueError(f"point masses are not written for {program}; leave the mass out and add it there")
    from jointfrf.io.card_link import card_integer, card_real  # importing readers of files is slow

    half = values.pop() / 2
    element, number = numbers
    lines = [f"{comment} half of the mass of the joint on each node, in all directions, written by jointfrf"]
    for i, node in enumerate(nodes):
        own = card_integer("element", element + i)
        if program in ("abaqus", "calculix"):
            name = f"JOINT{number}_M{i + 1}"
            lines += [f"*ELEMENT, TYPE=MASS, ELSET={name}", f"{own}, {node}", f"*MASS, ELSET={name}", card_real(half)]
        elif program == "nastran":
            lines += [f"CONM2*  {own:16d}{node:16d}{0:16d}{card_real(half, 16, ''):>16}", "*"]
        else:
            kind = card_integer("number", number + 50 + i)
            lines += [
                f"ET,{kind},MASS21,,,2",
                f"R,{kind},{card_real(half)}",
                f"TYPE,{kind}",
                f"REAL,{kind}",
                f"E,{node}",
            ]
    return "\n".join(lines) + "\n"
