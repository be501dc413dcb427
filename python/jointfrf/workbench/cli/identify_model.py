"""`jointfrf identify --model assembly.toml`: a joint from any FRFs of an assembly whose parts are known."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from jointfrf.channels.check.check import stop_at_errors, wrong_numbers
from jointfrf.errors import FileContentError
from jointfrf.files import write_file
from jointfrf.identification.record import fit_to_dict
from jointfrf.identification.result import UNDETERMINED, Fit, columns_of, is_undetermined
from jointfrf.io import FrfSet, read_frfs
from jointfrf.io.units import model_units
from jointfrf.kernel.arguments import FloatArray
from jointfrf.messages.finding import messages_of
from jointfrf.spelling import some_of
from jointfrf.workbench.assembly_file.measured import MeasuredAssembly, measured_assembly
from jointfrf.workbench.cli.arguments.identify import IdentifyArguments, SideArguments, TermsOfJointArguments
from jointfrf.workbench.cli.arguments.measured_file import PlaceArguments
from jointfrf.workbench.cli.export import CardRequest, card_request
from jointfrf.workbench.cli.fit_results import write_results
from jointfrf.workbench.cli.measured_file import setups_with_gains, stated_noise, without_warnings_of_fits
from jointfrf.workbench.cli.progress import waiting
from jointfrf.workbench.cli.usage import Failures, Interrupt, Output, UsageError, listed
from jointfrf.workbench.report.fit_words import next_sentences

__all__ = ["run_model"]

#: Characters of a line of the table of several tests.
_WIDTH = 100


def run_model(args: IdentifyArguments, model: Path) -> int:
    """Carry out the command with --model; the caller turns exceptions into messages."""
    given = [name for group in (PlaceArguments, SideArguments, TermsOfJointArguments) for name in args.changed(group)]
    if given:
        verb, pronoun = ("is", "it") if len(given) == 1 else ("are", "them")
        raise UsageError(
            f"{listed(given)} {verb} for fits without models; leave {pronoun} out, since {model} defines the joint"
        )
    if args.each and args.export is not None and args.output is None:
        raise UsageError("--export of several tests needs files; add --output")
    out = Output(args)
    if args.each:
        return _run_each(args, out)
    _, content = _one(args, out)
    out.give({"model": str(model), **content, "written": out.written})
    return 0


def _run_each(args: IdentifyArguments, out: Output) -> int:
    """Fit every file as a test of its own: one that fails, or Ctrl-C, leaves the finished ones as they are."""
    failures, interrupt = Failures(args), Interrupt()
    fits: dict[str, Fit] = {}
    contents, total = [], len(args.files)
    with waiting("tests") as count, interrupt.kept_back(fits):
        for done, (path, stem) in enumerate(zip(args.files, _stems(args.files), strict=True)):
            count(done, total)
            with failures.noted(str(path)):
                fits[stem], content = _one(_for_one(args, path, stem), out)
                contents.append(content)
            with waiting(f"intervals of {path.name}"):
                result = _summary(fits[stem]) if stem in fits else "failed"
            out.say(f"{stem} ({done + 1} of {total}): {result}")
    if fits:
        found = [text for stem, fit in fits.items() for text in messages_of(fit.findings, stem)]
        out.say(*_table(fits), *(f"warning: {text}" for text in found))
        out.warn(*found)
        if args.out is not None:
            out.written.append(args.out / "parameters.csv")
            write_file(out.written[-1], _csv(fits))
    content = {"tests": contents, "failed": failures.found, "written": out.written}
    out.give({"model": str(args.model), **content})
    failures.complain()
    interrupt.resume()
    return 1 if failures.found else 0


def _stems(files: Sequence[Path]) -> list[str]:
    """Return a short name for each test."""
    stems = [path.stem for path in files]
    if len(set(stems)) < len(stems):
        stems = [f"{path.parent.name}_{path.stem}" for path in files]
    if len(set(stems)) < len(stems):
        raise UsageError("two files of --each have the same name; rename one")
    return stems


def _for_one(args: IdentifyArguments, path: Path, stem: str) -> IdentifyArguments:
    """Return the options for one test: its file, and names of what is written."""

    def own(target: Path | None) -> Path | None:
        return None if target is None else target.with_name(f"{target.stem}_{stem}{target.suffix}")

    folder = None if args.out is None else args.out / stem
    return replace(
        args, files=[path], save=own(args.save), report=own(args.report), output=own(args.output), out=folder
    )


def _one(args: IdentifyArguments, out: Output) -> tuple[Fit, dict[str, Any]]:
    """Fit one test and write what is wanted; return the fit and its content for JSON."""
    model = args.model
    assert model is not None
    with waiting(f"reading {args.source}"):
        raw, frfs = _read(args)
        wrong = wrong_numbers(raw)
        stop_at_errors([] if wrong is None else [wrong], args.accept)
        measured = measured_assembly(model, frfs, bands=args.band)
        setups = setups_with_gains(args, args.source, measured.setups, measured.h.shape)
        measured = replace(measured, setups=setups)
    is_one = "" in measured.assembly.joints
    if args.export is not None and args.faces is None and is_one:
        args = replace(args, faces=_rigid_faces(measured))
    request = card_request(args, measured.assembly.joint.dofs, damping="none", cross="zero",
                           points=_joint_places(measured) if is_one else None)  # fmt: skip
    if not args.each:
        size = f"{len(measured.responses)} responses x {len(measured.forces)} forces"
        out.say(f"{args.source}: {size}; {model.name}", *measured.describe())
    with waiting(f"fit of {args.source}"), without_warnings_of_fits():
        fit = measured.fit(noise=stated_noise(args), sensor_mass=args.sensor_mass,
                           find_wrong_channels=args.find_wrong_channels, accept=args.accept)  # fmt: skip
    if not args.each:
        out.say("", fit)
        with waiting("what to measure next"):
            following = next_sentences(fit)
        out.say(*([""] if following else []), *following)
        out.warn(*fit.warnings)
    places = [] if request is None else _place_of_joint(measured, request)
    parts = measured.sketched if args.report is not None else ()
    text = write_results(args, [fit], out, request, places, parts=parts)
    content = {
        "sources": args.files,
        "channels": {"responses": measured.channels[0], "forces": measured.channels[1], "unused": measured.unused},
        "fits": [fit_to_dict(fit, lines=False)] if args.json else [],
        "cards": text,
    }
    return fit, content


def _read(args: IdentifyArguments) -> tuple[FrfSet, FrfSet]:
    """Return the FRFs of the files of one test, and their receptances."""
    try:
        raw = read_frfs(*args.files, **args.reading())
        return raw, raw.receptance()
    except FileContentError as error:
        hint = "; use --each if every file is a test of its own" if len(args.files) > 1 else ""
        raise FileContentError(f"{error}{hint}") from error


def _rigid_faces(measured: MeasuredAssembly) -> tuple[list[int], list[int]] | None:
    """Return the nodes that follow the reference points of the joint as rigid bodies, or None if they do not.

    Where a number is that of a node on both sides, the model of the assembly must have other numbers.
    """
    patches = [part.joint_patch for part in measured.parts.values()]
    nodes = [[int(n) for n in one.nodes] for one in patches if one is not None and one.coupling == "rigid"]
    return (nodes[0], nodes[1]) if len(nodes) == 2 and not {*nodes[0]} & {*nodes[1]} else None


def _joint_places(measured: MeasuredAssembly) -> FloatArray | None:
    """Return the place of the joint on both sides, m, or None if it is unknown, or at several nodes of a side."""
    found = []
    for part in measured.parts.values():
        nodes = {dof.rpartition(":")[0] for dof in part.keys.joint}
        found += [part.places[node] for node in nodes if len(nodes) == 1 and node in part.places]
    return np.array(found) if len(found) == 2 else None


def _place_of_joint(measured: MeasuredAssembly, request: CardRequest) -> list[str]:
    """Return lines on the required places of the nodes of the joint, and the nodes that they follow."""
    spread = [f"{name}/{patch.name}" for name, part in measured.parts.items()
              if (patch := part.joint_patch) is not None and patch.coupling == "distributing"]  # fmt: skip
    said = [f"{' and '.join(spread)}: the joint acts on the mean motion of the nodes: connect its node to them by a "
            "distributing coupling (RBE3), which adds no stiffness"] if spread else []  # fmt: skip
    if isinstance(request.nodes, dict):
        grounded = [name for name, one in measured.assembly.joints.items() if not one.k]
        return [*said, *([f"side k of {', '.join(grounded)} is the ground: hold node k"] if grounded else [])]
    places = _joint_places(measured)
    if places is None or "positions" in request.options:
        return said
    own = model_units(request.options["units"])
    words = [", ".join(f"{x:.6g}" for x in at / own.length + 0.0) for at in places]
    j, k = request.nodes
    return [*said, f"node {j} lies at ({words[0]}), node {k} at ({words[1]}) {own.words.partition(',')[0]}"]


def _rows(fit: Fit) -> Iterator[tuple[str, str, float, float, float, float]]:
    """Return name, unit, value, standard error, 95 % interval of all parameters and loss factors, the joint first."""
    intervals, errors = fit.confidence_interval(0.95), fit.std_error
    of_fit = [(one, (one.name, one.unit, fit.value[one.name], errors[one.name], *intervals[one.name]))
              for one in fit.parameters]  # fmt: skip
    yield from (row for one, row in of_fit if one.origin == "joint")
    for name, eta in fit.loss_factors.items():
        yield name, "1", eta.value, eta.std_error, eta.low, eta.high
    yield from (row for one, row in of_fit if one.origin != "joint")


def _summary(fit: Fit) -> str:
    """Return the first parameters of the joint in one line."""
    rows = [f"{name} {_cell(value, low, high)}" for name, _, value, _, low, high in _rows(fit)]
    return some_of(rows[: sum(one.origin == "joint" for one in fit.parameters)], 4)


def _table(fits: dict[str, Fit]) -> Iterator[str]:
    """Write a row for each test, a column for each parameter, its value and the half of its 95 % interval."""
    names = list(dict.fromkeys((name, unit) for fit in fits.values() for name, unit, *_ in _rows(fit)))
    columns = [[f"{name}, {unit}" if unit != "1" else name for name, unit in names]]
    for fit in fits.values():
        cells = {(name, unit): _cell(value, low, high) for name, unit, value, _, low, high in _rows(fit)}
        columns.append([cells.get(one, "") for one in names])
    heads = ["test", *fits]
    widths = [max(map(len, column)) for column in zip(*columns, strict=True)]
    at, first = 0, max(map(len, heads))
    while at < len(names):
        end, used = at, first
        while end < len(names) and (end == at or used + 2 + widths[end] <= _WIDTH):
            used += 2 + widths[end]
            end += 1
        yield ""
        yield from columns_of([(head, *own[at:end]) for head, own in zip(heads, columns, strict=True)])
        at = end
    yield ""
    yield "value +- half of the 95 % interval; noise and residual:"
    rows = [("test", "lines", "noise", "residual", "over noise")]
    for stem, fit in fits.items():
        ratio = fit.residual_level / fit.noise_level
        rows.append((stem, str(fit.freq_hz.size), f"{100 * fit.noise_level:.2g} %", f"{100 * fit.residual_level:.2g} %",
                     f"{ratio:.2f}"))  # fmt: skip
    yield from columns_of(rows)


def _cell(value: float, low: float, high: float) -> str:
    if is_undetermined(low, high):
        return UNDETERMINED
    if not np.isfinite(high):
        return f"above {low:.3g}"
    half = (high - low) / 2
    if not (np.isfinite(half) and half > 0 and np.isfinite(value)):
        return f"{value:.5g}"
    digits = int(np.floor(np.log10(abs(value)))) - int(np.floor(np.log10(half))) + 2 if value else 2
    return f"{value:.{min(max(digits, 4), 9)}g} +- {half:.2g}"


def _csv(fits: dict[str, Fit]) -> str:
    """Write the table for programs."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(("test", "parameter", "unit", "value", "std_error", "low_95", "high_95"))
    for stem, fit in fits.items():
        for name, unit, *numbers in _rows(fit):
            writer.writerow((stem, name, unit, *(repr(float(one)) for one in numbers)))
    return text.getvalue()
