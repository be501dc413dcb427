"""`jointfrf pool`: saved fits of one joint in several assemblies; whether one joint explains several structures."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from jointfrf.errors import FileContentError
from jointfrf.extras import check_extras
from jointfrf.files import write_file
from jointfrf.identification.record import load
from jointfrf.identification.result import Fit
from jointfrf.io.csv_file import read_text_table
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cli.usage import Failures, Output, UsageError, check_folder, warn_of_ignored
from jointfrf.workbench.pooling.pool import PooledFits, pool
from jointfrf.workbench.pooling.transfer import Transfer, transfer
from jointfrf.workbench.report.pool_page import pool_csv, write_pool

__all__ = ["run"]

#: The column of a table of tests that names the saved fit; and one that gives it another name than the file's.
_FILE, _LABEL = "file", "label"
#: Fits that can be pooled or compared.
_FEWEST = 2


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    for option, path in (("--report", args.report), ("--output", args.output)):
        check_folder(option, path)
    if args.report is not None:
        check_extras("jinja2")
    failures = Failures(args)
    files, fits, labels, factors = _loaded(_tests(args), failures)
    sources = [str(path) for path in files]
    if args.transfer:
        of_pool = ("--factor", "--trend", "--common", "--probability", "--report", "--output")
        warn_of_ignored(args, of_pool, "--transfer only tests")
        compared = _transferred(args, fits, labels)
        out.say(compared)
        out.give({"sources": sources, "transfer": asdict(compared), "failed": failures.found})
        failures.complain()
        return 1 if failures.found else 0
    warn_of_ignored(args, ("--spread",), "it is for --transfer")
    pooled = _pooled(args, fits, labels, factors)
    written = []
    if args.report is not None:
        written.append(write_pool(pooled, args.report, command=args.typed))
    if args.output is not None:
        write_file(args.output, pool_csv(pooled))
        written.append(args.output)
    out.say(pooled, *([""] if written else []), *(f"wrote {path}" for path in written))
    out.warn(*pooled.warnings)
    content = {"failed": failures.found, "written": [str(path) for path in written]}
    out.give({"sources": sources, **asdict(pooled), **pooled.content(), **content})
    failures.complain()
    return 1 if failures.found else 0


def _loaded(
    tests: tuple[list[Path], list[str], dict[str, Sequence[str]]], failures: Failures
) -> tuple[list[Path], list[Fit], list[str], dict[str, Sequence[str]]]:
    """Return files that are saved fits, their fits, labels and factors."""
    files, labels, factors = tests
    for name, groups in factors.items():
        if len(groups) != len(files):
            raise UsageError(f"--factor {name} has {len(groups)} groups; give {len(files)}, one for each file")
    fits = dict[int, Fit]()
    for i, path in enumerate(files):
        with failures.noted(str(path)):
            fits[i] = load(path)
    if len(fits) < _FEWEST and failures.found:
        raise FileContentError("; ".join(failures.found.values()))
    own: dict[str, Sequence[str]] = {name: [groups[i] for i in fits] for name, groups in factors.items()}
    return [files[i] for i in fits], list(fits.values()), [labels[i] for i in fits], own


def _tests(args: argparse.Namespace) -> tuple[list[Path], list[str], dict[str, Sequence[str]]]:
    """Return files, labels and factors, from the table or from the command line."""
    if args.table is not None and (args.files or args.factor):
        raise UsageError("--table names files and factors; leave out FIT and --factor")
    if args.table is not None:
        return _of_table(args.table)
    if not args.files:
        raise UsageError("no fits are given; name files of identify --save, or a table by --table")
    labels = [path.stem for path in args.files]
    if len(set(labels)) < len(labels):
        labels = [str(path) for path in args.files]
    return list(args.files), labels, dict(args.factor or ())


def _of_table(path: Path) -> tuple[list[Path], list[str], dict[str, Sequence[str]]]:
    table = read_text_table(path)
    if _FILE not in table.heading:
        raise FileContentError(f"{path}: column {_FILE} is missing; add it{did_you_mean(_FILE, table.heading)}")
    if len(set(table.heading)) < len(table.heading):
        raise FileContentError(f"{path}: two columns have the same name; rename one")
    rows = [cells for _, cells in table.rows]
    columns = dict(zip(table.heading, map(list, zip(*rows, strict=True)), strict=True))
    files = [path.parent / name for name in columns.pop(_FILE, [])]
    labels = columns.pop(_LABEL, [one.stem for one in files])
    return files, labels, dict(columns)


def _pooled(
    args: argparse.Namespace, fits: Sequence[Fit], labels: Sequence[str], factors: Mapping[str, Sequence[str]]
) -> PooledFits:
    shared = dict(args.common or ())
    common: Any = shared.get("", 0.0) if set(shared) <= {""} else shared
    if isinstance(common, dict) and "" in common:
        raise UsageError("--common gives errors of all files and of groups; name a factor for the first, too")
    return pool(
        fits, labels=labels, factors=factors, trends=args.trend or (), common=common, parameters=args.parameters,
        probability=args.probability,
    )  # fmt: skip


def _transferred(args: argparse.Namespace, fits: Sequence[Fit], labels: Sequence[str]) -> Transfer:
    return transfer(fits, labels=labels, parameters=args.parameters, spread=args.spread)
