"""Joints as TOML: constant matrices, or laws by DOF."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib import import_module
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import field

from jointfrf.dofs import UNITS
from jointfrf.extras import load_plugin
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.laws.law import JointLaw, LawField
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.words import LAW_WORDS, LAWS, law_of_plugin
from jointfrf.spelling import did_you_mean
from jointfrf.toml.declared import Keys, NotNegative, key, read_keys
from jointfrf.toml.table import TomlTable

__all__ = [
    "ConstantsKeys",
    "LawJointKeys",
    "joint_text",
    "parameters_in_words",
    "read_joint_table",
    "read_law",
    "start_values",
    "takes_in_words",
]

#: Laws by their words.
_BY_WORD: dict[str, type[JointLaw]] = {
    word: getattr(import_module(f"jointfrf.laws.{module}"), name) for word, (module, name) in LAWS.items()
}


def _law_of(word: str) -> type[JointLaw]:
    """Return the law of a word; raise FileContentError if a plugin cannot be used."""
    if word in _BY_WORD:
        return _BY_WORD[word]
    entry = law_of_plugin(word)
    assert entry is not None  # the word was checked when it was read

    def is_law(found: type[JointLaw]) -> bool:
        declared = all(isinstance(number, LawField) for number in _numbers(found))
        return declared and issubclass(found, JointLaw) and found.word == word

    law: type[JointLaw] = load_plugin(entry, is_law, f"a subclass of jointfrf.JointLaw whose word is {word!r}")
    return law


def _numbers(law: type[JointLaw]) -> tuple[LawField, ...]:
    return (*law.parameters, *law.settings)


def takes_in_words() -> str:
    """Return the parameters of each law, for the reference of keys."""
    return "; ".join(f"`{law.word}` {', '.join(f'`{one.name}`' for one in _numbers(law))}" for law in _BY_WORD.values())


def parameters_in_words() -> str:
    """Return the meaning of the parameters of all laws, each from the first law that has it."""
    by_name: dict[str, LawField] = {}
    for law in _BY_WORD.values():
        for number in _numbers(law):
            by_name.setdefault(number.name, number)
    return "; ".join(map(_in_words, by_name.values()))


def _in_words(number: LawField) -> str:
    limits = f", {number.lower:.1g} to {number.upper:g}" if np.isfinite(number.upper) else ""
    if not limits and np.isfinite(number.lower):
        limits = ", above 0" if number.lower > 0 else ", at least 0"
    units = UNITS[number.kind][::2] if number.kind != "number" else ()
    about = ", ".join(dict.fromkeys((f"number{limits}", *units)))
    return f"`{number.name}` {number.meaning[0].lower()}{number.meaning[1:].rstrip('.')} ({about})"


_At = Annotated[tuple[float, float, float] | None, key("Reference point.", "m", takes="three numbers")]
_ByDof = "list of numbers, or of lists"


class ConstantsKeys(Keys):
    """A joint by its constants; matrices are lists of lists."""

    dofs: Annotated[tuple[str, ...], key("Names of the joint DOFs: `y`, `theta_z`.", min_length=1)]
    stiffness: Annotated[Any, key("Stiffness of each DOF, or the matrix.", "N/m, N m/rad", takes=_ByDof)]
    damping: Annotated[Any, key("Viscous damping.", "N s/m, N m s/rad", takes=_ByDof)] = None
    loss_factor: Annotated[Any, key("Hysteretic loss factor of each DOF.", takes="list of numbers")] = None
    structural_damping: Annotated[
        Any, key("Hysteretic damping, added to the damping by loss factors.", "N/m, N m/rad", takes=_ByDof)
    ] = None
    at: _At = None


class DofLawKeys(Keys):
    """The law of a joint DOF, or of a pair of DOFs."""

    dof: Annotated[str | None, key("Name of the DOF.", absent="required except for a cross term")] = None
    between: Annotated[
        tuple[str, str] | None, key("Two DOFs: a symmetric cross term.", takes="the names of two DOFs")
    ] = None
    law: Annotated[str, key("The law; `rigid`: both sides move alike.", choice=LAW_WORDS)]
    values: Annotated[
        dict[str, float],
        key(f"Its parameters, those that it takes: {takes_in_words()}; {parameters_in_words()}.",
            absent="required except for `rigid`"),
    ] = field(default_factory=dict)  # fmt: skip
    mass: Annotated[
        NotNegative | None, key("Mass of the joint in this direction, half of it on either side.", "kg, kg m^2")
    ] = None
    per: Annotated[
        Literal["m", "m^2"] | None,
        key("Values are per length or area of a line or face.", absent="as the ends of the joint are"),
    ] = None


class LawJointKeys(Keys):
    """A joint by a law for each DOF, in the order of its DOFs."""

    law: Annotated[tuple[DofLawKeys, ...], key("The laws.")]
    at: _At = None


def read_joint_table(table: TomlTable) -> Joint | LawJoint:
    """Return the joint in a TOML file: laws if it has tables [[law]], else constants; the caller reads "at".

    Raises
    ------
    FileContentError
        One sentence that names the file and the key.
    """
    return _laws(table) if "law" in table.content else _constants(table)


def _constants(table: TomlTable) -> Joint:
    keys = read_keys(table, ConstantsKeys)
    given = {name: getattr(keys, name) for name in ("damping", "loss_factor", "structural_damping")}
    values = {name: value for name, value in given.items() if value is not None}
    return table.build(lambda: Joint(keys.stiffness, dofs=keys.dofs, **values))


def _laws(table: TomlTable) -> LawJoint:
    laws: dict[str | tuple[str, str], JointLaw] = {}
    rigid, dofs, mass, per = [], [], {}, {}
    for own in read_keys(table, LawJointKeys).law:
        _check_law(own)
        about: str | tuple[str, str] = own.between or own.dof or ""
        if about in laws or about in rigid:
            raise own.wrong("dof", f"{about} has two laws")
        if own.dof is not None:
            dofs.append(own.dof)
            if own.mass is not None:
                mass[own.dof] = own.mass
            if own.per is not None:
                per[own.dof] = own.per
        if own.law == "rigid":
            rigid.append(str(about))
        else:
            laws[about] = read_law(own.table.table("values"), own.law, is_cross=own.between is not None)
    return table.build(lambda: LawJoint(laws, rigid, mass, dofs, per), "law")


def _check_law(own: DofLawKeys) -> None:
    """Raise a FileContentError unless the keys of a law go together."""
    if own.between is None and own.dof is None:
        raise own.missing(["dof"])
    if own.between is not None and (own.law == "rigid" or own.dof or own.mass is not None or own.per):
        raise own.wrong("between", "a cross term has a law that is not rigid, no dof, no mass and no per")
    if own.law == "rigid" and own.values:
        raise own.wrong("values", "a rigid DOF takes none")


def joint_text(joint: Joint | LawJoint) -> str:
    """Return a joint as TOML for `read_joint_table`, with all digits.

    Raises
    ------
    ValueError
        A user-defined law: a file cannot contain a function.
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
        text += f"mass = {masses[dof]!r}  # kg, kg m^2\n" if dof in masses else ""
        parts.append(text + (f"per = {json.dumps(joint.per[dof])}\n" if dof in joint.per else ""))
    for (a, b), law in joint.laws.items():
        if a != b:
            parts.append(f"[[law]]\nbetween = {json.dumps([a, b])}\n{_law_line(law)}")
    return "\n".join(parts)


def read_law(table: TomlTable, word: str, *, is_cross: bool = False) -> JointLaw:
    """Return a law from a table that contains only its parameters.

    Parameters
    ----------
    table : TomlTable
        Table of numbers.
    word : str
        Name of the law in `LAW_WORDS`, not "rigid".
    is_cross : bool
        Whether it couples two DOFs, so that a stiffness may be negative; default False.

    Raises
    ------
    FileContentError
        A parameter that the law does not take, one that is missing, a value outside its bounds, or a plugin that
        cannot be used.
    """
    law, given = table.build(lambda: _law_of(word)), table.content
    takes = [number.name for number in _numbers(law)]
    for name in given:
        if name not in takes:
            raise table.wrong(name, f"the law {word!r} takes {', '.join(takes)}{did_you_mean(name, takes)}")
    if lacking := [name for name in takes if name not in given and name not in law.optional]:
        raise table.missing(lacking)
    numbers = {name: float(given[name]) for name in takes if name in given}
    return table.build(lambda: law.from_numbers(numbers, is_cross=is_cross))


#: Numbers for any initial value of a fit, which determines its own.
_STARTS = {"stiffness": 1e6, "damping": 10.0, "time": 1e-3, "number": 0.5, "frequency": 100.0}


def start_values(word: object) -> dict[str, float]:
    """Return initial values of a law without known numbers; empty if there is no such law."""
    law = _law_of(word) if isinstance(word, str) and word in LAW_WORDS and word != "rigid" else None
    return {} if law is None else {one.name: _STARTS[one.kind] for one in _numbers(law) if one.name != "h"}


def _law_line(law: JointLaw) -> str:
    """Return word and values of a law as lines of TOML."""
    if type(law) not in _BY_WORD.values() and not (law_of_plugin(law.word) and type(law) is _law_of(law.word)):
        raise ValueError(f"a {type(law).__name__} cannot be written to a file")
    values = ", ".join(f"{name} = {value!r}" for name, value in law.numbers().items())
    return f"law = {json.dumps(law.word)}\nvalues = {{ {values} }}\n"
