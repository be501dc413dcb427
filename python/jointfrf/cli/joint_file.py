"""A joint in a file: saved by `identify --save`, or written by hand as TOML."""

from __future__ import annotations

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np

from jointfrf.errors import FileContentError
from jointfrf.identification.joint_fit import JointFit
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray, as_real
from jointfrf.toml.keys import Key, KeyTable
from jointfrf.toml.table import TomlTable, read_toml

__all__ = ["JOINT_KEYS", "JointFile", "read_joint_file"]

JOINT_KEYS = KeyTable(
    "joint.toml",
    "A joint by its constants; matrices are lists of lists.",
    (
        Key("dofs", "list of texts", "Names of the joint DOFs: `y`, `theta_z`."),
        Key("stiffness", "list of numbers, or of lists", "Stiffness of each DOF, or the matrix.", "N/m, N m/rad"),
        Key("damping", "list of numbers, or of lists", "Viscous damping.", "N s/m, N m s/rad", "none"),
        Key("loss_factor", "list of numbers", "Hysteretic loss factor of each DOF.", "", "0"),
        Key("at", "list of three numbers", "Reference point.", "m", "not known"),
    ),
)


class JointFile(NamedTuple):
    """What a file says of a joint.

    Attributes
    ----------
    joint : Joint
    fit : JointFit or None
        Where the file was saved by an identification.
    points : ndarray, shape (2, 3), or None
        Reference points of both sides, m.
    about : tuple of str
        Where the joint comes from.
    """

    joint: Joint
    fit: JointFit | None
    points: FloatArray | None
    about: tuple[str, ...]

    @property
    def damping(self) -> str:
        """Kinds of damping that the joint has, in the words of `identify`."""
        viscous, hysteretic = self.joint.damping.any(), self.joint.hysteretic_stiffness.any()
        return {(True, True): "both", (True, False): "viscous", (False, True): "hysteretic"}.get(
            (bool(viscous), bool(hysteretic)), "none"
        )

    @property
    def cross(self) -> str:
        """Whether DOFs are coupled, in the words of `identify`."""
        k = self.joint.stiffness
        return "fit" if (k != np.diag(k.diagonal())).any() else "zero"


def read_joint_file(path: Path) -> JointFile:
    """Read a joint from a file.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        It is no joint, or something in it is wrong.
    """
    if not path.is_file():
        raise FileNotFoundError(f"there is no file {path}")
    return _constants(read_toml(path)) if path.suffix.lower() == ".toml" else _saved(path)


def _saved(path: Path) -> JointFile:
    fit = JointFit.load(path)
    content = json.loads(path.read_text(encoding="utf-8"))
    source, given = content.get("source"), content.get("reference_points_m")
    points = None
    if given is not None:
        try:
            points = as_real("reference_points_m", [given["j"], given["k"]], (2, 3))
        except (ValueError, TypeError, KeyError):
            raise FileContentError(f'{path}: "reference_points_m" is damaged') from None
    about = (f"from {source}",) if isinstance(source, str) else (f"from {path.name}",)
    return JointFile(fit.joint, fit, points, about)


def _constants(table: TomlTable) -> JointFile:
    table.expect(JOINT_KEYS)
    dofs = table.texts("dofs")
    values = {key: table.value(key) for key in ("stiffness", "damping", "loss_factor") if key in table}
    if "stiffness" not in values:
        table.value("stiffness")  # says that it is missing
    points = np.tile(as_real("at", table.numbers("at"), (3,)), (2, 1)) if "at" in table else None
    joint = table.build(
        lambda: Joint(values["stiffness"], values.get("damping"), dofs, values.get("loss_factor", 0.0))
    )  # fmt: skip
    return JointFile(joint, None, points, (f"from {Path(table.where).name}",))
