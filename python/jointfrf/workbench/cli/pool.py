"""`jointfrf pool`: saved fits of one joint in several assemblies; whether one joint explains several structures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from jointfrf.errors import FileContentError
from jointfrf.files import write_file
from jointfrf.identification.record import load
from jointfrf.identification.result import Fit
from jointfrf.workbench.cli.arguments.pool import PoolArguments, PoolOnlyArguments
from jointfrf.workbench.cli.table_of_tests import labels_of, read_rows
from jointfrf.workbench.cli.usage import Failures, Output, UsageError, warn_of_ignored
from jointfrf.workbench.pooling.pool import PooledFits, pool
from jointfrf.workbench.pooling.transfer import transfer
from jointfrf.workbench.report.pool_page import pool_csv, write_pool

__all__ = ["run"]

#: Fits that can be pooled or compared.
_FEWEST = 2


def run(args: PoolArguments) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out, failures = Output(args), Failures(args)
    files, fits, labels, factors = _loaded(_tests(args), failures)
    sources = [str(path) for path in files]
    if args.transfer:
        warn_of_ignored(args, PoolOnlyArguments.names(), "--transfer only tests")
        compared = transfer(fits, labels=labels, parameters=args.parameters, spread=args.spread)
        out.say(compared)
        out.give({"sources": sources, "transfer": asdict(compared), "failed": failures.found})
    else:
        warn_of_ignored(args, ("--spread",), "it is for --transfer")
        pooled = _pooled(args, fits, labels, factors)
        if args.report is not None:
            out.written.append(write_pool(pooled, args.report, command=args.typed))
        if args.output is not None:
            write_file(args.output, pool_csv(pooled))
            out.written.append(args.output)
        out.say(pooled)
        out.warn(*pooled.warnings)
        content = {"failed": failures.found, "written": out.written}
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


def _tests(args: PoolArguments) -> tuple[list[Path], list[str], dict[str, Sequence[str]]]:
    """Return files, labels and factors, from the table or from the command line."""
    if args.table is not None and (args.files or args.factor):
        raise UsageError("--table names files and factors; leave out FIT and --factor")
    if args.table is not None:
        rows = read_rows(args.table, ("file",))
        columns = {name: [row[name] for row in rows] for name in rows[0]}
        files = [args.table.parent / name for name in columns.pop("file")]
        return files, columns.pop("label", [one.stem for one in files]), {**columns}
    if not args.files:
        raise UsageError("no fits are given; name files of identify --save, or a table by --table")
    return list(args.files), labels_of(args.files), dict(args.factor)


def _pooled(
    args: PoolArguments, fits: Sequence[Fit], labels: Sequence[str], factors: Mapping[str, Sequence[str]]
) -> PooledFits:
    shared = dict(args.common)
    common: Any = shared.get("", 0.0) if set(shared) <= {""} else shared
    if isinstance(common, dict) and "" in common:
        raise UsageError("--common gives errors of all files and of groups; name a factor for the first, too")
    return pool(
        fits, labels=labels, factors=factors, trends=args.trend, common=common, parameters=args.parameters,
        probability=args.probability,
    )  # fmt: skip
