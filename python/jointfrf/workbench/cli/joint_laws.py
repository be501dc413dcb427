"""Laws of a joint on the command line: by DOF, or a file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jointfrf.identification.joint_file import read_joint_file
from jointfrf.joint import Joint
from jointfrf.laws.joint_toml import read_joint_table, start_values
from jointfrf.laws.law_joint import LawJoint
from jointfrf.toml.table import TomlTable
from jointfrf.workbench.cli.arguments.identify import IdentifyArguments
from jointfrf.workbench.cli.usage import UsageError

__all__ = ["joint_of_laws"]

#: Damping of springs that --damping names, by what is zero in their first values.
_SPRINGS = {
    "viscous": {"c": 10.0}, "hysteretic": {"h": 1e4}, "both": {"c": 10.0, "h": 1e4}, "auto": {"c": 10.0},
}  # fmt: skip


def joint_of_laws(args: IdentifyArguments, dofs: Sequence[str]) -> LawJoint | None:
    """Return the joint of laws in the options, with its DOFs in this order, or None if they name none.

    Raises
    ------
    UsageError
        A DOF has two laws or none, or options contradict each other.
    """
    if args.law is None and args.joint is None:
        return None
    if args.law is not None and args.joint is not None:
        raise UsageError("--law and --joint both give the laws; leave out one")
    if args.cross != "zero":
        raise UsageError(f"--cross {args.cross} is for springs; give cross terms of laws in the file of --joint")
    if args.method != ["compliance"]:
        raise UsageError("laws need method compliance; leave out --method")
    if args.joint is not None and args.damping != "auto":
        raise UsageError("--damping is for springs, and --joint gives the laws; leave out --damping")
    joint = _of_file(args.joint) if args.joint is not None else _of_words(args.law or (), args.damping)
    if args.export is not None and any(law.constant_terms is None for law in joint.laws.values()):
        raise UsageError("--export takes no frequency-dependent law; use --save, then jointfrf export --frequency HZ")
    if not joint.laws:
        raise UsageError("all joint DOFs are rigid; give at least one DOF another law")
    if sorted(joint.dofs) != sorted(dofs):
        given = f"{args.joint} has the DOFs" if args.law is None else "--law names the DOFs"
        raise UsageError(f"{given} {', '.join(joint.dofs)}, and --dofs {', '.join(dofs)}; give each DOF one law")
    return joint


def _of_file(path: Path) -> LawJoint:
    joint = read_joint_file(path).joint
    return LawJoint.of_joint(joint) if isinstance(joint, Joint) else joint


def _of_words(laws: Sequence[tuple[str, str]], damping: str) -> LawJoint:
    named = [dof for dof, _ in laws]
    twice = [dof for dof in named if named.count(dof) > 1]
    if twice:
        raise UsageError(f"--law: {twice[0]} has two laws; give each DOF one")
    tables: list[dict[str, Any]] = []
    for dof, word in laws:
        values = start_values(word)
        if word == "spring":
            if damping == "none":
                raise UsageError("--damping none leaves --law spring without damping; leave out --law")
            values = {"k": values["k"], **_SPRINGS[damping]}
        tables.append({"dof": dof, "law": word} | ({} if word == "rigid" else {"values": values}))
    joint = read_joint_table(TomlTable({"law": tables}, "--law"))
    assert isinstance(joint, LawJoint)
    return joint
