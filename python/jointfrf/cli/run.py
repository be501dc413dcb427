"""`jointfrf run`: cases, with their tables, figures and reports."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from jointfrf.cases.catalogue import CaseOutput, UnknownCaseError, find_case, list_cases, run_case
from jointfrf.cases.workers import started_workers
from jointfrf.cli.output import Output
from jointfrf.cli.usage import UsageError, positive, progress
from jointfrf.extras import check_extras
from jointfrf.parallel.cores import available_cores
from jointfrf.report.table import as_text

__all__ = ["add_arguments", "run"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the arguments of the command."""
    parser.description = "Run cases by name, number or folder; without any, all that come with jointfrf."
    parser.add_argument("cases", nargs="*", metavar="CASE", help="name, number, or folder with a case.toml")
    parser.add_argument("--out", type=Path, default=Path("results"), metavar="DIR", help="where results go (results)")
    parser.add_argument("--realisations", type=positive, metavar="N", help="instead of the number the case names")
    parser.add_argument("--jobs", type=positive, metavar="N", default=available_cores(), help="processes (all cores)")


def run(options: argparse.Namespace) -> int:
    """Carry out the command."""
    check_extras("matplotlib", "jinja2")
    try:
        folders = [find_case(word).resolve() for word in options.cases] or list_cases()
    except UnknownCaseError as error:
        raise UsageError(error) from error
    folders = list(dict.fromkeys(folders))
    if not folders:
        raise UsageError("no cases come with this installation: name a folder with a case.toml")
    twice = {folder.name for folder in folders if [f.name for f in folders].count(folder.name) > 1}
    if twice:
        raise UsageError(f"two cases are called {min(twice)}: their results would overwrite each other")
    out, reports = Output(options), []
    with started_workers(options.jobs) as workers:
        for folder in folders:
            start = time.perf_counter()
            at_work = replace(workers, progress=progress(folder.name))
            output = run_case(folder, options.out, realisations=options.realisations, workers=at_work)
            out.say(*_shown(output), f"{time.perf_counter() - start:.1f} s, report: {output.report}\n")
            sys.stdout.flush()
            reports.append(output.report)
            del output  # before the next case needs the memory
    if len(reports) > 1:
        out.say("Reports:", *(f"  {report}" for report in reports))
    out.give({"cases": [json.loads((path.parent / "results.json").read_text("utf-8")) for path in reports],
              "reports": [str(path) for path in reports]})  # fmt: skip
    return 0


def _shown(output: CaseOutput) -> Iterator[str]:
    """Give the summary and the tables of a case."""
    heading = f"{output.case.name}: {output.case.title}"
    yield f"{heading}\n{'=' * len(heading)}\n"
    for table in (*output.summary, *output.printed):
        yield as_text(table) + "\n"
