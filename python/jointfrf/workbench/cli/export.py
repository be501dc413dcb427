"""`jointfrf export`: a saved joint as input of a finite-element program; and the cards of `jointfrf identify`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import cast

import numpy as np

from jointfrf.dofs import point_and_direction
from jointfrf.files import write_file
from jointfrf.identification.fit_cards import cards
from jointfrf.identification.joint_file import JointFile, read_joint_file
from jointfrf.identification.result import Fit
from jointfrf.io.card_link import CardFormat
from jointfrf.io.cards import CardOptions
from jointfrf.io.units import model_units
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.laws.law_joint import LawJoint
from jointfrf.workbench.cli.arguments.cards import CardArguments, CardNodes, CardOptionArguments, TermArguments
from jointfrf.workbench.cli.arguments.export import ExportArguments
from jointfrf.workbench.cli.usage import Output, UsageError, warn_of_ignored

__all__ = ["CardRequest", "card_request", "page_nodes", "run"]


#: Arguments of `export` in its messages, and the options that stand for them.
_OPTIONS = (
    ("full_matrix", "--full-matrix"),
    ("name the first of them by damping_nodes", "name the first of them by --damping-nodes N"),
    ("damping_nodes", "--damping-nodes"),
    ("(bounds)", "(--bounds)"),
    ("state one frequency by freq_hz", "state one frequency by --frequency HZ"),
    ("name one frequency by freq_hz", "name one frequency by --frequency HZ"),
    ("leave connector out", "leave --connector out"),
    ("and connector exclude", "and --connector exclude"),
    ("by table_hz=", "by --frequency LOW:HIGH"),
    ("with damping=False", "with --no-damping"),
    ("name one in points", "name one by --joint-at"),
)
#: Lines of a table between which K* differs from a straight line by less than this share; it doubles so often at most.
_STRAIGHT, _MOST_HALVINGS = 1e-3, 9


def _table_lines(joint: Joint | LawJoint, low: float, high: float) -> FloatArray:
    """Return lines between which Re K* and Im K*/w are nearly straight, Hz: as many as that takes."""
    springs = joint if isinstance(joint, Joint) else LawJoint(joint.laws, per=joint.per)
    for power in range(_MOST_HALVINGS + 1):
        freq = np.geomspace(low, high, 2**power + 1)
        between = (freq[1:] + freq[:-1]) / 2
        known, exact = (springs.dynamic_stiffness(lines) for lines in (freq, between))
        ends = known.real + 1j * known.imag / freq[:, None, None]
        straight = (ends[1:] + ends[:-1]) / 2
        error = abs(straight.real + 1j * straight.imag * between[:, None, None] - exact).max(axis=(1, 2))
        if (error <= _STRAIGHT * abs(exact).max(axis=(1, 2))).all():
            break
    return freq


def run(args: ExportArguments) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    found = read_joint_file(args.joint)
    if args.point is not None or not isinstance(args.export[1], dict):
        found = _at_point(found, args.point)
    at = args.frequency if isinstance(args.frequency, float) else None
    if isinstance(found.joint, Joint) and at is not None:
        warn_of_ignored(args, ("--frequency",), "no law of this joint depends on frequency")
    if args.nodes_at is None:
        warn_of_ignored(args, ("--joint-at",), "without --nodes-at the nodes are at the joint")
    points = found.points
    if args.joint_at is not None:
        points = np.tile(args.joint_at, (2, 1)) * model_units(args.units).length
    damping, cross = ("none", "zero") if isinstance(args.frequency, tuple) else _terms(_springs(found.joint, at))
    request = card_request(args, found.joint.dofs, damping=damping, cross=cross, points=points)
    assert request is not None
    if isinstance(args.frequency, tuple) and (isinstance(found.joint, Joint) or found.joint.laws):
        request.options["table_hz"] = _table_lines(found.joint, *args.frequency)
    if found.fit is not None:
        text = request.cards(found.fit, found.about, at if found.fit.laws is not None else None)
    else:
        text = _by_hand(found, request, at)
    if args.output is None:
        out.say(text.rstrip("\n"))
    else:
        write_file(args.output, text)
        out.say(f"wrote {args.output}")
    written = [] if args.output is None else [args.output]
    out.give({"source": str(args.joint), "program": request.program, "cards": text, "written": written})
    return 0


def _by_hand(found: JointFile, request: CardRequest, freq_hz: float | None) -> str:
    """Return the cards of a joint that was written by hand."""
    options: CardOptions = {**request.options, "comments": found.about}
    if isinstance(request.nodes, dict):
        raise UsageError("the file has one joint without a name; give its nodes as PROGRAM:J,K")
    with _in_words_of_options():
        if isinstance(found.joint, LawJoint):
            return found.joint.export(request.program, request.nodes, freq_hz=freq_hz, **options)
        joint, left_out = (found.joint, ()) if request.terms["all_damping"] else _without_negative(found.joint)
        options["comments"] = [*found.about, *left_out]
        return joint.export(request.program, request.nodes, **options)


def _at_point(found: JointFile, point: str | None) -> JointFile:
    """Return the named one of several joint points, or the joint itself if it has no points."""
    if found.fit is None or not found.fit.points:
        if point is not None:
            raise UsageError("the file has no joint points; leave out --point")
        return found
    known = ", ".join(found.fit.points)
    if point is None:
        raise UsageError(f"the file has joint points {known}, so name one by --point, or all by PROGRAM:NAME=J,K")
    if point not in found.fit.points:
        raise UsageError(f"--point is {point!r}; use one of {known}")
    fit = found.fit.at_point(point)
    return found._replace(fit=fit, joint=fit.joint, about=(*found.about, f"joint point {point}"))


def _without_negative(joint: Joint) -> tuple[Joint, list[str]]:
    """Return a joint without the dashpots that are negative, with their cross terms, and a sentence for each."""
    left_out, kept = [], (joint.damping.copy(), joint.structural_damping.copy())
    for letter, matrix in zip("ch", kept, strict=True):
        for i in np.flatnonzero(matrix.diagonal() < 0):
            left_out.append(f"{letter}_{joint.dofs[i]} = {matrix[i, i]:.5g}: negative, left out with its cross terms")
            matrix[i], matrix[:, i] = 0, 0
    return Joint(joint.stiffness, kept[0], joint.dofs, joint.loss_factor, kept[1]), left_out


def _springs(joint: Joint | LawJoint, freq_hz: float | None) -> Joint | None:
    """Return the springs and dampers of a joint, or None if it has none.

    Raises
    ------
    UsageError
        A law depends on frequency, and none was named.
    """
    if isinstance(joint, Joint):
        return joint
    with _in_words_of_options():
        return LawJoint(joint.laws, per=joint.per).constant_joint(freq_hz) if joint.laws else None


def _terms(joint: Joint | None) -> tuple[str, str]:
    """Return kinds of damping, and whether DOFs are coupled, in the words of `identify`."""
    if joint is None:
        return "none", "zero"
    kinds = {(True, True): "both", (True, False): "viscous", (False, True): "hysteretic", (False, False): "none"}
    k = joint.stiffness
    coupled = bool((k != np.diag(k.diagonal())).any())
    return kinds[bool(joint.damping.any()), bool(joint.hysteretic_stiffness.any())], "fit" if coupled else "zero"


@dataclass(frozen=True)
class CardRequest:
    """The cards that are wanted.

    Attributes
    ----------
    program : str
    nodes : list of int, or dict of these
        j and k; of several joints by their names, with ROT NODEs of CalculiX.
    options : CardOptions
    terms : dict of str to bool
        Keywords of `cards`: which terms of a fit they contain.
    """

    program: CardFormat
    nodes: CardNodes
    options: CardOptions
    terms: dict[str, bool]

    def cards(self, fit: Fit, about: Sequence[str], freq_hz: float | None = None) -> str:
        """Return the cards of a fit, laws at a frequency."""
        with _in_words_of_options():
            return cards(fit, self.program, self.nodes, about=about, freq_hz=freq_hz, **self.terms, **self.options)


def page_nodes(args: CardArguments) -> Sequence[int]:
    """Return the nodes in the cards that a page shows: the nodes of one joint, if they are named."""
    return (1, 2) if args.export is None or isinstance(args.export[1], dict) else args.export[1]


def card_request(
    args: CardArguments, dofs: Sequence[str], *, damping: str, cross: str, points: FloatArray | None
) -> CardRequest | None:
    """Return the cards that are wanted, after a check whether the program can contain such a joint.

    Parameters
    ----------
    args : CardArguments
    dofs : sequence of str
        Joint DOFs.
    damping, cross : str
        Terms that the joint may have.
    points : ndarray, shape (2, 3), or None
        Reference points of the sides, m.

    Raises
    ------
    UsageError
        The program cannot contain it, or a number is out of range.
    """
    needing = ("--output", "--nodes-at", "--units", "--faces")
    if args.export is None:
        for name in args.gave(needing):
            raise UsageError(f"{name} is for cards; add --export PROGRAM:J,K")
        others = [name for name in CardArguments.names() if name not in needing]
        warn_of_ignored(args, others, "no cards are written without --export PROGRAM:J,K")
        return None
    program, ends = args.export
    of_joints = ends if isinstance(ends, dict) else {}
    pair = ends if isinstance(ends, list) else []
    _check_joints(args, program, dofs, of_joints)
    options = cast(CardOptions, args.keywords(CardOptionArguments))
    options["rotation_nodes"] = pair[2:] or None
    options["damping"] = not args.no_damping and (program != "calculix" or args.damping_nodes is not None)
    if args.nodes_at is not None:
        options["positions"] = np.array(args.nodes_at)
        if points is not None:
            options["points"] = points / model_units(args.units).length
    with _in_words_of_options(damping):
        for name, own in (of_joints or {"": pair}).items():
            held = [dof for point, dof in map(point_and_direction, dofs) if point == name]
            # A joint with every term that the one to be found may have.
            matrix = np.eye(len(held)) + (0.1 if cross in ("fit", "points") else 0.0) * (1 - np.eye(len(held)))
            viscous = matrix if damping in ("viscous", "both", "auto") else None
            hysteretic = matrix if damping in ("hysteretic", "both", "auto") else None
            probe = Joint(matrix, viscous, held, structural_damping=hysteretic)
            probe.export(program, own[:2], **cast(CardOptions, {**options, "rotation_nodes": own[2:] or None}))
    return CardRequest(program, of_joints or pair[:2], options, args.keywords(TermArguments))


def _check_joints(args: CardArguments, program: str, dofs: Sequence[str], of_joints: Mapping[str, list[int]]) -> None:
    """Raise an error unless each joint has its nodes, and only these."""
    known = list(dict.fromkeys(point for point, _ in map(point_and_direction, dofs)))
    if sorted(of_joints) != sorted(known) and (of_joints or len(known) > 1):
        example = ":".join(f"{name}={9001 + 2 * i},{9002 + 2 * i}" for i, name in enumerate(known) if name)
        raise UsageError(
            f"--export does not name the nodes of each joint ({', '.join(filter(None, known)) or 'unnamed'}); use "
            f"{program}:{example or '9001,9002'}"
        )
    for name, given in (("--nodes-at", args.nodes_at), ("--faces", args.faces)):
        if of_joints and given is not None:
            raise UsageError(f"{name} takes one joint; use --save, then jointfrf export FILE PROGRAM:J,K --point NAME")


@contextmanager
def _in_words_of_options(damping: str = "") -> Iterator[None]:
    """Turn errors of an export into errors of usage in the words of the command line."""
    try:
        yield
    except ValueError as error:
        why = str(error)
        if "MATRIX27" in why and damping:
            may = f"--damping {damping} may find" if damping == "auto" else f"--damping {damping} fits"
            why = f"MATRIX27 of ansys has no hysteretic damping, which {may}; use --damping viscous, or --no-damping"
        elif "in rotation_nodes" in why:
            why = "calculix has rotations at ROT NODEs of rigid bodies only; name both, calculix:J,K,ROTJ,ROTK"
        else:
            for argument, option in _OPTIONS:
                why = why.replace(argument, option)
        raise UsageError(why) from error
