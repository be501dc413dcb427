"""The study of the readings as a command; see the package."""

import argparse
import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from jointfrf.workbench.cases.catalogue import UnknownCaseError, find_case, list_cases, read_case
from jointfrf.workbench.cases.known_joint.keys import KnownJointCase
from jointfrf.workbench.cli.arguments.words import whole
from jointfrf.workbench.report.table import as_text, table_csv

from . import __doc__ as description
from .ranking import altogether_table, choices_table, source_tables, totals, values_table
from .study import ReadingsPlan, group_cases, study_readings


def numbers(words: str) -> tuple[float, ...]:
    """Return positive numbers separated by commas."""
    try:
        found = tuple(float(word) for word in words.split(","))
    except ValueError:
        found = ()
    if not all(0 < one < math.inf for one in found or [0.0]):
        raise argparse.ArgumentTypeError(f"must be positive numbers, separated by commas, not {words!r}")
    return found


def main(words: Sequence[str] | None = None) -> None:
    """Compare the printed values of cases with every reading, and print and write the tables."""
    parser = argparse.ArgumentParser(
        "tests/accuracy/run readings", description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("cases", nargs="*", help="name, number, or folder with a case.toml; all by default")
    parser.add_argument("--spacing", type=numbers, default=(0.15, 1.0, 2.0, 3.0, 5.0), metavar="HZ,...",
                        help="spacings of the lines; a finer one of a case stays")  # fmt: skip
    parser.add_argument("--level", type=numbers, default=(1.0,), metavar="X,...", help="shares of the printed level")
    parser.add_argument("--realisations", type=whole, default=300, help="of each reading")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--top", type=whole, default=8, help="readings shown of each table")
    parser.add_argument("--workers", type=whole, default=None, help="processes; one a core by default")
    parser.add_argument("--out", type=Path, help="write all readings as CSV files into this folder")
    args = parser.parse_args(words)
    try:
        cases = [read_case(folder) for folder in [find_case(word) for word in args.cases] or list_cases()]
    except UnknownCaseError as error:
        parser.error(str(error))
    known = [case for case in cases if isinstance(case, KnownJointCase)]
    if args.cases and len(known) < len(cases):
        other = next(case.name for case in cases if not isinstance(case, KnownJointCase))
        parser.error(f"{other} is not a case of a known joint")
    groups = group_cases(known)
    if not groups:
        parser.error("expected.toml of these cases names no values of a method with band means")
    plan = ReadingsPlan(args.spacing, args.level, args.realisations, args.seed)
    with ProcessPoolExecutor(args.workers, get_context("spawn")) as pool:
        mapped = map if args.workers == 1 else pool.map
        explained = [one for group in groups for one in study_readings(group, plan, mapped)]
    every = totals(explained, args.spacing)
    print(f"{args.realisations} realisations of each reading, seed {args.seed}\n")
    shown = *source_tables(explained, args.top), choices_table(every), altogether_table(every, args.top)
    print(*map(as_text, shown), sep="\n\n")
    if args.out is not None:
        args.out.mkdir(parents=True, exist_ok=True)
        shown = *source_tables(explained), choices_table(every), altogether_table(every), values_table(explained)
        for table in shown:
            (args.out / f"{table.key}.csv").write_text(table_csv(table), encoding="utf-8")


if __name__ == "__main__":
    main()
