"""A joint in a file: saved with its fit as JSON, or as TOML."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from jointfrf.errors import FileContentError
from jointfrf.files import check_file, write_file
from jointfrf.identification.record import read_record
from jointfrf.identification.result import Fit
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray, as_real
from jointfrf.laws.joint_toml import joint_text, read_joint_table
from jointfrf.laws.law_joint import LawJoint
from jointfrf.toml.table import TomlTable, read_toml

__all__ = ["JointFile", "read_joint", "read_joint_file", "write_joint"]


class JointFile(NamedTuple):
    """Content of a joint file.

    Attributes
    ----------
    joint : Joint or LawJoint
        The joint.
    fit : Fit or None
        Fit of the joint, if an identification saved the file.
    points : ndarray, shape (2, 3), or None
        Reference points of both sides, m.
    about : tuple of str
        Origin of the joint.
    """

    joint: Joint | LawJoint
    fit: Fit | None
    points: FloatArray | None
    about: tuple[str, ...]


def read_joint_file(path: Path) -> JointFile:
    """Read a joint from a file.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        It is no joint, or something in it is wrong.
    """
    check_file(path)
    return _written(read_toml(path)) if path.suffix.lower() == ".toml" else _saved(path)


def _saved(path: Path) -> JointFile:
    fit, content = read_record(path)
    source, given = content.get("source"), content.get("reference_points_m")
    points = None
    if given is not None:
        try:
            points = as_real("reference_points_m", [given["j"], given["k"]], (2, 3))
        except (ValueError, TypeError, KeyError):
            raise FileContentError(f'{path}: "reference_points_m" is damaged') from None
    about = (f"from {source}",) if isinstance(source, str) else (f"from {path.name}",)
    return JointFile(fit.joint, fit, points, about)


def _written(table: TomlTable) -> JointFile:
    joint = read_joint_table(table)
    points = np.tile(np.array(table.content["at"], np.float64), (2, 1)) if "at" in table.content else None
    return JointFile(joint, None, points, (f"from {Path(table.where).name}",))


def read_joint(path: Path | str) -> Joint | LawJoint:
    """Read a joint from a file and return it.

    Parameters
    ----------
    path : Path or str
        Name of a TOML file of constants (`dofs`, `stiffness`, ...) or of laws (tables `[[law]]`), as `write_joint`
        writes; or of a JSON file of `save`.

    Returns
    -------
    Joint or LawJoint
        The joint in the file.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        It is no joint, or something in it is wrong.

    See Also
    --------
    write_joint : write a joint to a TOML file.
    load : read a fit from a JSON file.

    Examples
    --------
    >>> import tempfile, jointfrf as jf
    >>> mount = jf.LawJoint({"y": jf.StandardLinearSolid(1e5, 2e5, 1e-3)}, rigid=["theta"])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     same = jf.read_joint(jf.write_joint(f"{folder}/mount.toml", mount))
    >>> same == mount
    True
    """
    return read_joint_file(Path(path)).joint


def write_joint(path: Path | str, joint: Joint | LawJoint) -> Path:
    """Write a joint to a TOML file, whole or not at all, and return the path; `read_joint` reads it.

    Parameters
    ----------
    path : Path or str
        Name of the file, which ends in .toml, in a folder that exists.
    joint : Joint or LawJoint
        Joint to write.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ValueError
        Another ending; a `FunctionLaw`, which a file cannot contain.
    TypeError
        It is no joint.
    OSError
        The file cannot be written.

    See Also
    --------
    read_joint : read the joint again.
    save : write a fit with its uncertainty.

    Examples
    --------
    >>> import tempfile, jointfrf as jf
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     print(jf.write_joint(f"{folder}/bolt.toml", jf.Joint([2000.0], [3.0], dofs=["x"])).name)
    bolt.toml
    """
    if not isinstance(joint, Joint | LawJoint):
        raise TypeError(f"joint must be a Joint or a LawJoint, not {type(joint).__name__}")
    target = Path(path)
    if target.suffix.lower() != ".toml":
        raise ValueError(f"a joint is written as TOML: name a file that ends in .toml, not {target.name!r}")
    write_file(target, joint_text(joint))
    return target
