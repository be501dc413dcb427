"""Joints as TOML: constant matrices, or laws by DOF."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np

from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.laws.law import JointLaw
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.law_table import LAW_VALUES, LAW_WORDS, law_line, read_law, takes_in_words
from jointfrf.toml.table import Key, KeyTable, TomlTable

__all__ = ["JOINT_KEYS", "LAW_JOINT_KEYS", "joint_text", "read_joint_table"]

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
        text += 'law = "rigid"\n' if dof in joint.rigid else law_line(joint.laws[dof, dof])
        parts.append(text + (f"mass = {masses[dof]!r}  # kg, kg m^2\n" if dof in masses else ""))
    for (a, b), law in joint.laws.items():
        if a != b:
            parts.append(f"[[law]]\nbetween = {json.dumps([a, b])}\n{law_line(law)}")
    return "\n".join(parts)
