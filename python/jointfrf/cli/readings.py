"""`jointfrf readings`: which reading of the noise explains printed values best."""

from __future__ import annotations

import argparse
import math
from dataclasses import replace
from pathlib import Path

from jointfrf.cases.catalogue import UnknownCaseError, find_case, list_cases, read_case
from jointfrf.cases.known_joint.read import KnownJointCase
from jointfrf.cases.known_joint.readings.ranking import totals
from jointfrf.cases.known_joint.readings.study import (
    Explained,
    ReadingsPlan,
    SameStructure,
    group_cases,
    study_readings,
)
from jointfrf.cases.known_joint.readings.tables import altogether_table, choices_table, source_tables, values_table
from jointfrf.cases.workers import started_workers
from jointfrf.cli.output import Output
from jointfrf.cli.usage import UsageError, positive, progress
from jointfrf.files import below, write_file
from jointfrf.parallel.cores import available_cores
from jointfrf.report.table import Table, as_text, plain_rows, table_csv

__all__ = ["add_arguments", "run"]

_SPACINGS, _REALISATIONS, _SEED, _TOP = (0.15, 1.0, 2.0, 3.0, 5.0), 300, 1, 8


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Compare the printed values of cases of a known joint with realisations of every reading of the noise level; "
        "without a case, those of all cases that come with jointfrf."
    )
    parser.add_argument("cases", nargs="*", metavar="CASE", help="name, number, or folder with a case.toml")
    parser.add_argument("--spacing", type=_numbers, default=_SPACINGS, metavar="HZ,...",
                        help="spacings of the lines (0.15,1,2,3,5); a finer one of a case stays")  # fmt: skip
    parser.add_argument(
        "--level", type=_numbers, default=(1.0,), metavar="X,...", help="shares of the printed level (1)"
    )
    parser.add_argument(
        "--realisations", type=positive, default=_REALISATIONS, metavar="N", help="of each reading (300)"
    )
    parser.add_argument("--seed", type=int, default=_SEED, metavar="N", help="seed of the noise (1)")
    parser.add_argument("--top", type=positive, default=_TOP, metavar="N", help="readings shown of each table (8)")
    parser.add_argument("--jobs", type=positive, metavar="N", default=available_cores(), help="processes (all cores)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="write all readings as CSV files into this folder")


def _numbers(words: str) -> tuple[float, ...]:
    """Return positive numbers separated by commas."""
    try:
        found = tuple(float(word) for word in words.split(","))
    except ValueError:
        found = ()
    if not found or not all(0 < one < math.inf for one in found):
        raise argparse.ArgumentTypeError(f"must be positive numbers, separated by commas, not {words!r}")
    return found


def run(options: argparse.Namespace) -> int:
    """Carry out the command."""
    groups = _groups(options.cases)
    plan = ReadingsPlan(options.spacing, options.level, options.realisations, options.seed)
    explained: list[Explained] = []
    with started_workers(options.jobs) as workers:
        for group in groups:
            at_work = replace(workers, progress=progress(group.cases[0].name))
            explained += study_readings(group, plan, at_work)
    every = totals(explained, options.spacing)
    out = Output(options)
    out.say(f"{options.realisations} realisations of each reading, seed {options.seed}\n")
    for table in (*source_tables(explained, options.top), choices_table(every), altogether_table(every, options.top)):
        out.say(as_text(table) + "\n")
    whole = [*source_tables(explained), choices_table(every), altogether_table(every), values_table(explained)]
    if options.out is not None:
        _write(options.out, whole)
        out.say(f"written: {options.out}")
    out.give({"realisations": options.realisations, "seed": options.seed, "tables": {
        table.key: {"title": table.title, "columns": table.columns, "rows": plain_rows(table)} for table in whole
    }})  # fmt: skip
    return 0


def _groups(words: list[str]) -> list[SameStructure]:
    """Read the cases: those that are named, or all that come with jointfrf and have printed values."""
    try:
        folders = [find_case(word) for word in words] or list_cases()
    except UnknownCaseError as error:
        raise UsageError(error) from error
    cases = [read_case(folder) for folder in folders]
    known = [case for case in cases if isinstance(case, KnownJointCase)]
    if words and len(known) < len(cases):
        other = next(case for case in cases if not isinstance(case, KnownJointCase))
        raise UsageError(f"{other.name} is not a case of a known joint")
    groups = group_cases(known)
    if not groups:
        raise UsageError("expected.toml of these cases names no values of a method with band means")
    return groups


def _write(folder: Path, tables: list[Table]) -> None:
    """Write tables as CSV files."""
    folder.mkdir(parents=True, exist_ok=True)
    for table in tables:
        write_file(below(folder, table.key, ".csv"), table_csv(table))
