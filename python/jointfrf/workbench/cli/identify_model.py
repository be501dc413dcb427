"""`jointfrf identify --model assembly.toml`: a joint from any FRFs of an assembly whose parts are known."""

from __future__ import annotations

import argparse
import csv
import io
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from jointfrf.channels.check.check import stop_at_errors, wrong_numbers
from jointfrf.errors import ConvergenceWarning, FileContentError, FrfCheckWarning, IdentificationWarning
from jointfrf.files import write_file
from jointfrf.identification.record import fit_to_dict, write_record
from jointfrf.identification.result import UNDETERMINED, Fit, columns_of, is_undetermined
from jointfrf.io import FrfSet
from jointfrf.io.units import model_units
from jointfrf.kernel.arguments import FloatArray
from jointfrf.messages.finding import messages_of
from jointfrf.spelling import some_of
from jointfrf.workbench.assembly_file.measured import MeasuredAssembly, measured_assembly
from jointfrf.workbench.cli.export import CardRequest, card_request, page_nodes, written_cards
from jointfrf.workbench.cli.measured_file import file_names, read_measured, setups_with_gains
from jointfrf.workbench.cli.noise import stated_noise
from jointfrf.workbench.cli.usage import Failures, Interrupt, Output, UsageError, listed, waiting
from jointfrf.workbench.report.fit_page import write_report
from jointfrf.workbench.report.fit_words import next_sentences

__all__ = ["run_model"]

#: What belongs to FRFs between all DOFs of the joint, and means nothing where there are models: option, attribute.
_OF_THE_JOINT = (
    ("--j", "j"), ("--k", "k"), ("--dofs", "dofs"), ("--at", "at"), ("--at-k", "at_k"), ("--channels", "channels"),
    ("--spacing", "spacing"), ("--axis", "axis"), ("--law", "law"), ("--joint", "joint"),
    ("--position-error", "position_error"), ("--bending-stiffness", "bending_stiffness"),
    ("--side-j", "side_j"), ("--side-k", "side_k"),
    ("--window-decay", "window_decay"), ("--mass-j", "mass_j"), ("--mass-k", "mass_k"), ("--mass", "mass"),
)  # fmt: skip
#: Characters of a line of the table of several tests.
_WIDTH = 100


def run_model(args: argparse.Namespace) -> int:
    """Carry out the command with --model; the caller turns exceptions into messages."""
    _check_options(args)
    return _run_each(args) if args.each else _run_one(args)


def _run_one(args: argparse.Namespace) -> int:
    """Fit one test."""
    out = Output(args)
    _, content, written = _one(args, out)
    out.say(*([""] if written else []), *(f"wrote {path}" for path in written))
    out.give({"model": str(args.model), **content, "written": [str(path) for path in written]})
    return 0


def _run_each(args: argparse.Namespace) -> int:
    """Fit every file as a test of its own: one that fails, or Ctrl-C, leaves the finished ones as they are."""
    out, failures, interrupt = Output(args), Failures(args), Interrupt()
    fits: dict[str, Fit] = {}
    contents, written, total = [], [], len(args.files)
    with waiting("tests") as count, interrupt.kept_back(fits):
        for done, (path, stem) in enumerate(zip(args.files, _stems(args.files), strict=True)):
            count(done, total)
            with failures.noted(str(path)):
                fits[stem], content, paths = _one(_for_one(args, path, stem), out)
                contents.append(content)
                written += paths
            with waiting(f"intervals of {path.name}"):
                result = _summary(fits[stem]) if stem in fits else "failed"
            out.say(f"{stem} ({done + 1} of {total}): {result}")
    if fits:
        found = [text for stem, fit in fits.items() for text in messages_of(fit.findings, stem)]
        out.say(*_table(fits), *(f"warning: {text}" for text in found))
        out.warn(*found)
        if args.out is not None:
            path = args.out / "parameters.csv"
            write_file(path, _csv(fits))
            written.append(path)
    out.say(*([""] if written else []), *(f"wrote {path}" for path in written))
    content = {"tests": contents, "failed": failures.found, "written": [str(path) for path in written]}
    out.give({"model": str(args.model), **content})
    failures.complain()
    interrupt.resume()
    return 1 if failures.found else 0


def _check_options(args: argparse.Namespace) -> None:
    given = [name for name, attribute in _OF_THE_JOINT if getattr(args, attribute) is not None]
    given += ["--method"] if args.method != ["compliance"] else []
    given += ["--damping"] if args.damping != "auto" else []
    given += ["--cross"] if args.cross != "zero" else []
    if given:
        verb, pronoun = ("is", "it") if len(given) == 1 else ("are", "them")
        raise UsageError(
            f"{listed(given)} {verb} for fits without models; leave {pronoun} out, since {args.model} defines the joint"
        )
    if args.each and args.export is not None and args.output is None:
        raise UsageError("--export of several tests needs files; add --output")


def _stems(files: Sequence[Path]) -> list[str]:
    """Return a short name for each test."""
    stems = [path.stem for path in files]
    if len(set(stems)) < len(stems):
        stems = [f"{path.parent.name}_{path.stem}" for path in files]
    if len(set(stems)) < len(stems):
        raise UsageError("two files of --each have the same name; rename one")
    return stems


def _for_one(args: argparse.Namespace, path: Path, stem: str) -> argparse.Namespace:
    """Return the options for one test: its file, and names of what is written."""
    own = argparse.Namespace(**vars(args))
    own.files = [path]
    for name in ("save", "report", "output"):
        target = getattr(args, name)
        setattr(own, name, None if target is None else target.with_name(f"{target.stem}_{stem}{target.suffix}"))
    own.out = None if args.out is None else args.out / stem
    return own


def _one(args: argparse.Namespace, out: Output) -> tuple[Fit, dict[str, Any], list[Path]]:
    """Fit one test, write what is wanted; return the fit, its content for JSON, and what was written."""
    with waiting(f"reading {file_names(args)}"):
        raw, frfs = _read(args)
        wrong = wrong_numbers(raw)
        stop_at_errors([] if wrong is None else [wrong], args.accept or ())
        measured = measured_assembly(args.model, frfs, bands=args.band)
        measured = replace(measured, setups=setups_with_gains(args, measured.setups, measured.h.shape))
    request = _request(args, measured)
    if not args.each:
        out.say(*_heading(args, measured))
    with waiting(f"fit of {file_names(args)}"), warnings.catch_warnings():
        warnings.simplefilter("ignore", IdentificationWarning)  # they stand in the table
        warnings.simplefilter("ignore", ConvergenceWarning)
        warnings.simplefilter("ignore", FrfCheckWarning)
        fit = measured.fit(noise=stated_noise(args), sensor_mass=args.sensor_mass,
                           find_wrong_channels=args.find_wrong_channels, accept=args.accept or ())  # fmt: skip
    source, written, text = file_names(args), list[Path](), ""
    if not args.each:
        out.say("", fit)
        with waiting("what to measure next"):
            following = next_sentences(fit)
        out.say(*([""] if following else []), *following)
        out.warn(*fit.warnings)
    if request is not None:
        text = written_cards(fit, request, [f"from {source}", *_place_of_joint(measured, request)])
        if args.output is None:
            out.say("", text.rstrip("\n"))
        else:
            written.append(args.output)
    if args.save is not None:
        write_record(args.save, fit_to_dict(fit, lines=args.save_lines) | {"source": source})
        written.append(args.save)
    if args.report is not None:
        args.report.parent.mkdir(parents=True, exist_ok=True)
        written.append(write_report(fit, args.report, source=source, command=args.typed, nodes=page_nodes(args),
                                    parts=measured.sketched))  # fmt: skip
    if args.out is not None:
        from jointfrf.workbench.report.fit import write_fit

        written += write_fit([fit], args.out, source)
    content = {
        "sources": [str(path) for path in args.files],
        "channels": {"responses": measured.channels[0], "forces": measured.channels[1], "unused": measured.unused},
        "fits": [fit_to_dict(fit, lines=False)] if args.json else [],
        "cards": text or None,
    }
    return fit, content, written


def _read(args: argparse.Namespace) -> tuple[FrfSet, FrfSet]:
    """Return the FRFs of the files of one test, and their receptances."""
    try:
        raw = read_measured(args)
        return raw, raw.receptance()
    except FileContentError as error:
        hint = "; use --each if every file is a test of its own" if len(args.files) > 1 else ""
        raise FileContentError(f"{error}{hint}") from error


def _request(args: argparse.Namespace, measured: MeasuredAssembly) -> CardRequest | None:
    joint = measured.assembly.joint
    is_one = "" in measured.assembly.joints
    if args.export is not None and args.faces is None and is_one:
        args.faces = _rigid_faces(measured)
    return card_request(args, joint.dofs, damping="none", cross="zero",
                        points=_joint_places(measured) if is_one else None)  # fmt: skip


def _rigid_faces(measured: MeasuredAssembly) -> tuple[list[int], list[int]] | None:
    """Return the nodes that follow the reference points of the joint as rigid bodies; None where they do not on a side.

    Where a number is that of a node on both sides, the model of the assembly must have other numbers.
    """
    patches = [part.joint_patch for part in measured.parts.values()]
    nodes = [[int(n) for n in one.nodes] for one in patches if one is not None and one.coupling == "rigid"]
    return (nodes[0], nodes[1]) if len(nodes) == 2 and not {*nodes[0]} & {*nodes[1]} else None


def _joint_places(measured: MeasuredAssembly) -> FloatArray | None:
    """Return where the joint is on both sides, m; None where it is not known, or at several nodes of a side."""
    found = []
    for part in measured.parts.values():
        nodes = {dof.rpartition(":")[0] for dof in part.keys.joint}
        found += [part.places[node] for node in nodes if len(nodes) == 1 and node in part.places]
    return np.array(found) if len(found) == 2 else None


def _place_of_joint(measured: MeasuredAssembly, request: CardRequest) -> list[str]:
    """Say where the nodes of the joint must be, unless that was given, and what they follow."""
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


def _heading(args: argparse.Namespace, measured: MeasuredAssembly) -> Iterator[str]:
    """Say what is identified from what."""
    yield f"{file_names(args)}: {len(measured.responses)} responses x {len(measured.forces)} forces; {args.model.name}"
    yield from measured.describe()


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
