"""Joints as TOML: constant matrices, or laws by DOF."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from jointfrf.dofs import UNITS
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.laws.law import JointLaw, LawField
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.springs import SpringLaw
from jointfrf.laws.viscoelastic import FractionalZener, PowerLaw, StandardLinearSolid
from jointfrf.toml.table import Key, KeyTable, TomlTable

__all__ = [
    "LAW_VALUES",
    "LAW_WORDS",
    "joint_text",
    "parameters_in_words",
    "read_joint_table",
    "read_law",
    "start_values",
    "takes_in_words",
]

#: The laws that files can hold: a new law is a file with its class, and its name here.
LAWS: tuple[type[JointLaw], ...] = (SpringLaw, StandardLinearSolid, FractionalZener, PowerLaw)
_BY_WORD = {law.word: law for law in LAWS}
#: Words of laws; a rigid DOF has none.
LAW_WORDS = (*_BY_WORD, "rigid")
#: Reference point, which `read_joint_table` leaves to its caller.
_AT = Key("at", "list of three numbers", "Reference point.", "m", "not known")
#: Keys of a joint by constants.
JOINT_KEYS = KeyTable(
    "joint.toml",
    "A joint by its constants; matrices are lists of lists.",
    (
        Key("dofs", "list of texts", "Names of the joint DOFs: `y`, `theta_z`."),
        Key("stiffness", "list of numbers, or of lists", "Stiffness of each DOF, or the matrix.", "N/m, N m/rad"),
        Key("damping", "list of numbers, or of lists", "Viscous damping.", "N s/m, N m s/rad", "none"),
        Key("loss_factor", "list of numbers", "Hysteretic loss factor of each DOF.", "", "0"),
        Key("structural_damping", "list of numbers, or of lists", "Hysteretic damping, beside that of loss factors.",
            "N/m, N m/rad", "none"),
        _AT,
    ),
)  # fmt: skip


def _numbers(law: type[JointLaw]) -> tuple[LawField, ...]:
    return (*law.parameters, *law.settings)


def _as_key(number: LawField) -> Key:
    """Describe a number of a law as a key of files."""
    limits = f", {number.lower:.1g} to {number.upper:g}" if np.isfinite(number.upper) else ""
    if not limits and np.isfinite(number.lower):
        limits = ", above 0" if number.lower > 0 else ", at least 0"
    units = UNITS[number.kind] if number.kind != "number" else ("",)
    return Key(number.name, f"number{limits}", number.meaning, ", ".join(dict.fromkeys(units[::2])), "0")


#: Keys of the numbers of all laws; the first law that has a number describes it.
LAW_VALUES = tuple(
    {number.name: _as_key(number) for law in LAWS[::-1] for number in _numbers(law)}[name]
    for name in dict.fromkeys(number.name for law in LAWS for number in _numbers(law))
)


def takes_in_words() -> str:
    """Return which parameters each law takes, for the reference of keys."""
    return "; ".join(f"`{law.word}` {', '.join(f'`{one.name}`' for one in _numbers(law))}" for law in LAWS)


def parameters_in_words() -> str:
    """Return what the parameters of all laws are, for the reference of keys."""
    return "; ".join(
        f"`{one.name}` {one.meaning[0].lower()}{one.meaning[1:].rstrip('.')} "
        f"({', '.join(part for part in (one.takes, one.unit) if part)})"
        for one in LAW_VALUES
    )


#: Keys of one law.
_LAW = KeyTable(
    "[[law]], in joint.toml",
    "The law of a joint DOF, or of a pair of DOFs.",
    (
        Key("dof", "text", "Name of the DOF.", "", "required but for a cross term"),
        Key("between", "list of two texts", "Names of two DOFs: a symmetric cross term.", "", "none"),
        Key("law", f"one of {', '.join(f'`{word}`' for word in LAW_WORDS)}",
            "The law; `rigid`: both sides move alike."),
        Key("values", "table", "Its parameters.", "", "required but for `rigid`",
            KeyTable("values, in [[law]]", f"Parameters of the law, those that it takes: {takes_in_words()}.",
                     LAW_VALUES)),
        Key("mass", "number, at least 0", "Mass of the joint in this direction, half of it on either side.",
            "kg, kg m^2", "0"),
    ),
)  # fmt: skip
#: Keys of a joint of laws.
LAW_JOINT_KEYS = KeyTable(
    "joint.toml of laws",
    "A joint by a law for each DOF, in the order of its DOFs.",
    (Key("law", "tables", "The laws.", inner=_LAW), _AT),
)


def read_joint_table(table: TomlTable) -> Joint | LawJoint:
    """Read a joint from a TOML file: laws where it has tables [[law]], else constants; the key "at" stays.

    Raises
    ------
    FileContentError
        One sentence that names the file and the key.
    """
    return _laws(table) if "law" in table else _constants(table)


def _constants(table: TomlTable) -> Joint:
    table.expect(JOINT_KEYS)
    dofs = table.texts("dofs")
    names = ("damping", "loss_factor", "structural_damping")
    values = {key: table.value(key) for key in names if key in table}
    stiffness = table.value("stiffness")
    return table.build(lambda: Joint(stiffness, dofs=dofs, **values))


def _laws(table: TomlTable) -> LawJoint:
    table.expect(LAW_JOINT_KEYS)
    laws: dict[str | tuple[str, str], JointLaw] = {}
    rigid, dofs, mass = [], [], {}
    for own in table.tables("law"):
        word = own.text("law", LAW_WORDS)
        if "between" in own:
            pair = own.texts("between")
            if len(pair) != 2 or word == "rigid":
                raise own.error("between", "the names of two DOFs with a law that is not rigid")
            key: str | tuple[str, str] = (pair[0], pair[1])
        else:
            key = own.text("dof")
            dofs.append(key)
            if "mass" in own:
                mass[key] = own.number("mass", 0)
        if key in laws or key in rigid:
            raise own.wrong("dof", f"{key} has two laws")
        if word == "rigid":
            rigid.append(str(key))
        else:
            laws[key] = read_law(own.table("values"), word, is_cross="between" in own)
        own.close()
    return table.build(lambda: LawJoint(laws, rigid, mass, dofs), "law")


def joint_text(joint: Joint | LawJoint) -> str:
    """Return a joint as TOML that `read_joint_table` reads, no digit lost.

    Raises
    ------
    ValueError
        A user-defined law: a file cannot hold a function.
    """
    return _text_of_laws(joint) if isinstance(joint, LawJoint) else _text_of_constants(joint)


def _text_of_constants(joint: Joint) -> str:
    def shown(matrix: FloatArray) -> str:
        diagonal = matrix.diagonal()
        return repr((matrix if (matrix != np.diag(diagonal)).any() else diagonal).tolist())

    lines = [f"dofs = {json.dumps(list(joint.dofs))}", f"stiffness = {shown(joint.stiffness)}  # N/m, N m/rad"]
    if joint.damping.any():
        lines.append(f"damping = {shown(joint.damping)}  # viscous, N s/m, N m s/rad")
    if joint.loss_factor.any():
        lines.append(f"loss_factor = {joint.loss_factor.tolist()!r}")
    if joint.structural_damping.any():
        lines.append(f"structural_damping = {shown(joint.structural_damping)}  # hysteretic, N/m, N m/rad")
    return "\n".join(lines) + "\n"


def _text_of_laws(joint: LawJoint) -> str:
    masses: Mapping[str, float] = joint.mass
    parts = []
    for dof in joint.dofs:
        text = f"[[law]]\ndof = {json.dumps(dof)}\n"
        text += 'law = "rigid"\n' if dof in joint.rigid else _law_line(joint.laws[dof, dof])
        parts.append(text + (f"mass = {masses[dof]!r}  # kg, kg m^2\n" if dof in masses else ""))
    for (a, b), law in joint.laws.items():
        if a != b:
            parts.append(f"[[law]]\nbetween = {json.dumps([a, b])}\n{_law_line(law)}")
    return "\n".join(parts)


def read_law(table: TomlTable, word: str, *, is_cross: bool = False) -> JointLaw:
    """Read the parameters of a law from a table that holds them alone.

    Parameters
    ----------
    table : TomlTable
    word : str
        Out of `LAW_WORDS`, not "rigid".
    is_cross : bool
        Whether it couples two DOFs, so that a stiffness may be negative.

    Raises
    ------
    FileContentError
        A parameter that the law does not take, one that is missing, or a value outside its bounds.
    """
    law = _BY_WORD[word]
    takes = [number.name for number in _numbers(law)]
    for key in LAW_VALUES:
        if key.name in table and key.name not in takes:
            raise table.wrong(key.name, f"the law {word!r} takes {', '.join(takes)}")
    numbers = {name: table.number(name) for name in takes if name in table or name not in law.optional}
    table.close()
    return table.build(lambda: law.from_numbers(numbers, is_cross=is_cross))


#: Numbers from which a fit may start anywhere: it finds its own first values.
_STARTS = {"stiffness": 1e6, "damping": 10.0, "time": 1e-3, "number": 0.5, "frequency": 100.0}


def start_values(word: object) -> dict[str, float]:
    """Return numbers for a law of which none are known, where a fit may start; empty for no such law."""
    law = _BY_WORD.get(word) if isinstance(word, str) else None
    return {} if law is None else {one.name: _STARTS[one.kind] for one in _numbers(law) if one.name != "h"}


def _law_line(law: JointLaw) -> str:
    """Return word and values of a law as lines of TOML."""
    if type(law) not in LAWS:
        raise ValueError(f"a {type(law).__name__} cannot be written to a file")
    values = ", ".join(f"{name} = {value!r}" for name, value in law.numbers().items())
    return f"law = {json.dumps(law.word)}\nvalues = {{ {values} }}\n"
