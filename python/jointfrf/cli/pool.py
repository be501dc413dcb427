"""`jointfrf pool`: saved fits of one joint in several assemblies; whether one joint explains several structures."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from jointfrf.cli.parser import CommandParser
from jointfrf.cli.usage import Output, UsageError, check_folder, warn_of_ignored
from jointfrf.errors import FileContentError
from jointfrf.extras import check_extras
from jointfrf.files import write_file
from jointfrf.identification.record import load
from jointfrf.identification.result import Fit
from jointfrf.io.csv_file import read_text_table
from jointfrf.pooling.pool import PooledFits, pool
from jointfrf.pooling.transfer import Transfer, transfer
from jointfrf.report.pool_page import pool_csv, write_pool
from jointfrf.spelling import did_you_mean

__all__ = ["add_arguments", "run"]

#: The column of a table of tests that names the saved fit; and one that gives it another name than the file's.
_FILE, _LABEL = "file", "label"


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Pool fits of the same joint in several assemblies, at several torques, on several days: mean, spread between "
        "assemblies, which factor matters, who does not belong to the others, and the interval of the next assembly."
    )
    parser.add_argument("files", type=Path, nargs="*", metavar="FIT", help="JSON files of identify --save")
    parser.option(
        "--table FILE",
        "instead of files: a table (CSV) with a column file, perhaps label, and one for each factor; files beside it",
        Path,
    )
    parser.option(
        "--factor NAME=GROUP,...",
        "the group of each file: assembly=1,1,2,2 (files of one assembly are repeats), day=mon,mon,tue,tue",
        _factor,
        repeated=True,
    )
    parser.option(
        "--trend NAME", "a factor whose numbers act by themselves, as a power law: torque", str, repeated=True
    )
    parser.option(
        "--common ERROR", "relative standard error that all files share (0.01), or files of a group (day=0.01)",
        _common, repeated=True,
    )  # fmt: skip
    parser.option("--parameters NAME,...", "parameters to be pooled, loss factors (eta_y) included", _names)
    parser.option("--probability P", "of the intervals", _probability, 0.95)
    parser.option("--transfer", "test instead whether one joint explains all files, each of another structure")
    parser.option(
        "--spread S", "with --transfer: relative spread between assemblies that is no difference", _share, 0.0
    )
    parser.option("--report FILE", "write a page (HTML) with a forest plot of each parameter", Path)
    parser.option("--output FILE", "write the result as a table (CSV)", Path)


def _names(word: str) -> list[str]:
    names = [one.strip() for one in word.split(",")]
    if not all(names):
        raise argparse.ArgumentTypeError(f"must be names between commas, not {word!r}")
    return names


def _factor(word: str) -> tuple[str, list[str]]:
    name, equals, groups = word.partition("=")
    if not (name and equals and groups):
        raise argparse.ArgumentTypeError(f"must be NAME=GROUP,GROUP,..., not {word!r}")
    return name, _names(groups)


def _share(word: str) -> float:
    try:
        found = float(word)
    except ValueError:
        found = -1.0
    if not 0 <= found < float("inf"):
        raise argparse.ArgumentTypeError(f"must be a share such as 0.05, not {word!r}")
    return found


def _common(word: str) -> tuple[str, float]:
    name, equals, share = word.rpartition("=")
    if equals and not name:
        raise argparse.ArgumentTypeError(f"must be ERROR or NAME=ERROR, not {word!r}")
    return name, _share(share)


def _probability(word: str) -> float:
    found = _share(word)
    if not 0 < found < 1:
        raise argparse.ArgumentTypeError(f"must lie between 0 and 1, not {word!r}")
    return found


def run(args: argparse.Namespace) -> int:
    """Carry out the command; the caller turns exceptions into messages."""
    out = Output(args)
    for option, path in (("--report", args.report), ("--output", args.output)):
        check_folder(option, path)
    if args.report is not None:
        check_extras("jinja2")
    files, labels, factors = _tests(args)
    fits = [load(path) for path in files]
    sources = [str(path) for path in files]
    if args.transfer:
        of_pool = ("--factor", "--trend", "--common", "--probability", "--report", "--output")
        warn_of_ignored(args, of_pool, "it is of the pool, and --transfer only tests")
        compared = _transferred(args, fits, labels)
        out.say(compared)
        out.give({"sources": sources, "transfer": asdict(compared)})
        return 0
    warn_of_ignored(args, ("--spread",), "it is of --transfer")
    pooled = _pooled(args, fits, labels, factors)
    written = []
    if args.report is not None:
        written.append(write_pool(pooled, args.report, command=args.typed))
    if args.output is not None:
        write_file(args.output, pool_csv(pooled))
        written.append(args.output)
    out.say(pooled, *([""] if written else []), *(f"wrote {path}" for path in written))
    out.warn(*pooled.warnings)
    out.give({"sources": sources, **asdict(pooled), **pooled.content(), "written": [str(path) for path in written]})
    return 0


def _tests(args: argparse.Namespace) -> tuple[list[Path], list[str], dict[str, Sequence[str]]]:
    """Return files, labels and factors, from the table or from the command line."""
    if args.table is not None and (args.files or args.factor):
        raise UsageError("--table names files and factors: leave out those of the command line")
    if args.table is not None:
        return _of_table(args.table)
    if not args.files:
        raise UsageError("name saved fits, or a table of them by --table")
    labels = [path.stem for path in args.files]
    if len(set(labels)) < len(labels):
        labels = [str(path) for path in args.files]
    return list(args.files), labels, dict(args.factor or ())


def _of_table(path: Path) -> tuple[list[Path], list[str], dict[str, Sequence[str]]]:
    table = read_text_table(path)
    if _FILE not in table.heading:
        raise FileContentError(f"{path}: has no column {_FILE}{did_you_mean(_FILE, table.heading)}")
    if len(set(table.heading)) < len(table.heading):
        raise FileContentError(f"{path}: two columns have the same name")
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
        raise UsageError("--common: an error of all files and errors of groups: name the first as a factor, too")
    return pool(
        fits, labels=labels, factors=factors, trends=args.trend or (), common=common, parameters=args.parameters,
        probability=args.probability,
    )  # fmt: skip


def _transferred(args: argparse.Namespace, fits: Sequence[Fit], labels: Sequence[str]) -> Transfer:
    return transfer(fits, labels=labels, parameters=args.parameters, spread=args.spread)
