"""`jointfrf plan`: which sensors and hits show a joint best, before anything is measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, replace

import numpy as np

from jointfrf.dofs import is_rotation
from jointfrf.errors import FileContentError
from jointfrf.kernel.arguments import FloatArray
from jointfrf.workbench.assembly_file.keys import ReceptancesPart
from jointfrf.workbench.assembly_file.measured import joint_words
from jointfrf.workbench.assembly_file.read import AssemblyPart, check_dofs, named_dof, read_assembly_file
from jointfrf.workbench.cases.catalogue import read_case_and_kind
from jointfrf.workbench.cases.known_joint.exact import exact_frfs, frfs_by_differences
from jointfrf.workbench.cases.known_joint.keys import KnownJointCase
from jointfrf.workbench.cli.arguments.plan import GoalArguments, PartsArguments, PlanArguments
from jointfrf.workbench.cli.frf import lines_of
from jointfrf.workbench.cli.measured_file import noise_of
from jointfrf.workbench.cli.progress import waiting
from jointfrf.workbench.cli.usage import Output, UsageError, check_both, listed, warn_of_ignored
from jointfrf.workbench.planning.assemblies import assemblies_needed
from jointfrf.workbench.planning.joint_frfs import plan_joint_frfs
from jointfrf.workbench.planning.plan import plan
from jointfrf.workbench.report.plan_page import write_plan
from jointfrf.workbench.structures.substructures import MeasuredStructure, ModelStructure

__all__ = ["run"]

#: Distances that differ by less, relative to their size, are the same.
_ALIKE = 1e-9
#: A file of this name is a case: FRFs between all joint DOFs.
_CASE = "case.toml"


def run(args: PlanArguments) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    check_both(args, "spread", "next", ", such as --spread 0.1 --next 0.3")
    freq = lines_of(args)
    assert freq is not None  # --step is required
    if args.model.is_dir() or args.model.name == _CASE:
        return _of_case(args, freq, out)
    warn_of_ignored(args, ("--spacings",), "it is for case.toml")
    file = read_assembly_file(args.model)
    file.check_values()
    parts = file.parts(freq)
    file, _ = file.located(parts)
    given = (args.sensors, args.hits, args.keep_sensors or [], args.keep_hits or [])
    named = [None if one is None else _located(parts, one) for one in given]
    chosen = [_candidates(parts, args.candidates) if one is None else one for one in named[:2]]
    kept = [one or [] for one in named[2:]]
    for name, dofs in (("--sensors", chosen[0] + kept[0]), ("--hits", chosen[1] + kept[1])):
        check_dofs(parts, file.keys, name, dofs)
    if args.sensors is not None and args.hits is not None:
        warn_of_ignored(args, ("--candidates",), "--sensors and --hits name the candidates")
    used = list(dict.fromkeys(dof for own in (*chosen, *kept) for dof in own))
    with waiting(f"plan of {args.model.name}"):
        assembly = file.assembly(freq, parts, used)
        found = plan(
            assembly, freq, *chosen, noise=noise_of(args.noise, args.floor), averages=args.averages, sensors=kept[0],
            hits=kept[1], sensor_mass=args.sensor_mass or 0.0, fixed=file.keys.fixed, **args.keywords(GoalArguments),
        )  # fmt: skip
    if args.report is not None:
        sketched = [part.sketched(letter, assembly.joints) for letter, part in parts.items()]
        out.written.append(write_plan(found, args.report, parts=sketched, command=args.typed))
    if len(assembly.joints) > 1:
        out.say(*joint_words(assembly.joints, parts), "")
    out.say(found)
    needed = None
    if args.spread is not None and args.next is not None:
        needed = assemblies_needed(args.next, args.spread, found.proposed.error)
        out.say("", _assemblies(needed, args.next, args.spread))
    out.warn(*found.warnings)
    content = {"assemblies": needed, "written": out.written}
    out.give({"model": str(args.model), **asdict(found), **found.content(), **content})
    return 0


def _of_case(args: PlanArguments, freq: FloatArray, out: Output) -> int:
    """Print how well FRFs between all joint DOFs of a case determine the joint."""
    of_parts = args.gave(PartsArguments.names())
    if of_parts:
        raise UsageError(f"a case has all FRFs between its joint DOFs; leave out {listed(of_parts)}")
    case, _ = read_case_and_kind(args.model if args.model.is_dir() else args.model.parent)
    if not isinstance(case, KnownJointCase):
        raise FileContentError(f"{args.model}: wrong kind of case; use a case of kind known-joint")
    case = replace(case, freq_hz=freq)
    exact = exact_frfs(case)
    biased = {f"{1e3 * spacing:g} mm": frfs_by_differences(case, spacing) for spacing in args.spacings or ()}
    found = plan_joint_frfs(
        freq, exact.interface(exact.h_c), case.joint, noise=noise_of(args.noise, args.floor),
        averages=args.averages, biased=biased or None,
    )  # fmt: skip
    if args.report is not None:
        out.written.append(write_plan(found, args.report, command=args.typed))
    out.say(found)
    out.give({"model": str(args.model), **asdict(found), "written": out.written})
    return 0


def _assemblies(needed: int | None, wanted: float, spread: float) -> str:
    if needed is None:
        return (
            f"no number of assemblies gives an interval of the next one within {100 * wanted:.3g} %: they differ by "
            f"more themselves, with a spread of {100 * spread:.3g} %"
        )
    shown = f"{100 * wanted:.3g} % (spread {100 * spread:.3g} %)"
    return f"{needed} assemblies give an interval of the next one within {shown}"


def _located(parts: Mapping[str, AssemblyPart], dofs: list[str]) -> list[str]:
    """Return DOFs by nodes instead of positions."""
    try:
        return [
            f"{name}/{named_dof(parts[name], own).dof}" if name in parts and own.startswith("@") else dof
            for dof, (name, _, own) in ((dof, dof.partition("/")) for dof in dofs)
        ]
    except ValueError as error:
        raise UsageError(error) from error


def _candidates(parts: Mapping[str, AssemblyPart], most: int) -> list[str]:
    """Return translations of nodes of all parts, far from each other."""
    if most < 1:
        raise UsageError(f"--candidates is {most}; give at least 1")
    found: list[str] = []
    for letter, part in parts.items():
        if isinstance(part.keys, ReceptancesPart):
            assert isinstance(part.structure, MeasuredStructure)
            channels = [one for one in part.structure.frfs.responses if one in part.structure.frfs.excitations]
            found += [f"{letter}/{one.node}:{one.axis}" for one in channels if not one.is_rotation]
            continue
        assert isinstance(part.structure, ModelStructure)
        by_node: dict[str, list[str]] = {}
        for dof in part.structure.model.dofs:
            node, _, direction = dof.rpartition(":")
            if direction and not is_rotation(direction):
                by_node.setdefault(node, []).append(dof)
        nodes = (
            _far_apart({node: part.places[node] for node in by_node if node in part.places}, most)
            or list(by_node)[:most]
        )
        found += [f"{letter}/{dof}" for node in nodes for dof in by_node[node]]
    return found


def _far_apart(places: dict[str, FloatArray], most: int) -> list[str]:
    """Return nodes, each as far as can be from those before it, in the order of the model."""
    if not places:
        return []
    names, at = list(places), np.array(list(places.values()))
    chosen = [0]
    away = np.linalg.norm(at - at[0], axis=1)
    while len(chosen) < min(most, len(names)):
        # Of places that are equally far, but for rounding, the first.
        chosen.append(int(np.argmax(away >= (1 - _ALIKE) * away.max())))
        away = np.minimum(away, np.linalg.norm(at - at[chosen[-1]], axis=1))
    return [names[i] for i in sorted(chosen)]
