"""`jointfrf run`: cases, with their tables, figures and reports."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue
from threading import Lock

from jointfrf.extras import check_extras
from jointfrf.parallel.pool import available_cores
from jointfrf.workbench.cases.catalogue import UnknownCaseError, find_case, list_cases
from jointfrf.workbench.cases.keys import Case
from jointfrf.workbench.cases.run import run_case
from jointfrf.workbench.cases.workers import Workers, started_workers
from jointfrf.workbench.cli.arguments.run import RunArguments, RunOneArguments
from jointfrf.workbench.cli.progress import waiting
from jointfrf.workbench.cli.usage import Output, UsageError
from jointfrf.workbench.report.table import Table, as_text

__all__ = ["run"]

#: Cases under way at the same time, where processes share the work.
_TOGETHER = 3


def run(options: RunArguments) -> int:
    """Carry out the command."""
    check_extras("matplotlib", "jinja2")
    try:
        folders = [find_case(word).resolve() for word in options.cases] or list_cases()
    except UnknownCaseError as error:
        raise UsageError(error) from error
    folders = list(dict.fromkeys(folders))
    if not folders:
        raise UsageError("this installation contains no cases; name a folder with a case.toml")
    twice = {folder.name for folder in folders if [f.name for f in folders].count(folder.name) > 1}
    if twice:
        raise UsageError(f"two cases are called {min(twice)}; run each with its own --out")
    out = Output(options)

    def say(text: str) -> None:
        out.say(text)
        sys.stdout.flush()

    with ThreadPoolExecutor(_TOGETHER) as threads, started_workers(options.jobs or available_cores()) as workers:
        reports = _run_all(folders, options, workers, threads, say)
    if len(reports) > 1:
        out.say("Reports:", *(f"  {report}" for report in reports))
    out.give({"cases": [json.loads((path.parent / "results.json").read_text("utf-8")) for path in reports],
              "reports": [str(path) for path in reports]})  # fmt: skip
    return 0


def _run_all(
    folders: list[Path],
    options: RunArguments,
    workers: Workers,
    threads: ThreadPoolExecutor,
    say: Callable[[str], None],
) -> list[Path]:
    """Run cases and print their results, in their order; the next ones begin where processes would have nothing to do.

    Returns
    -------
    list of Path
        Their reports.
    """
    if workers.pool is None:
        found = []
        for folder in folders:
            with waiting(folder.name) as count:
                found.append(_run_one(folder, options, replace(workers, progress=count), say))
        return found
    turn, begun, reports = Lock(), [], []
    for rank, folder in enumerate(folders):
        case = _Begun(folder.name)
        at_work = replace(workers, rank=rank, turn=turn, progress=case.show)
        begun.append((case, threads.submit(case.run, folder, options, at_work)))
    try:
        for case, done in begun:
            with waiting(case.name) as case.count:
                for text in case.read():
                    say(text)
                reports.append(done.result())
    finally:
        threads.shutdown(wait=False, cancel_futures=True)
    return reports


class _Begun:
    """A case that is computed while an earlier one may still be read."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.said: SimpleQueue[str | None] = SimpleQueue()
        self.count: Callable[[int, int], None] = lambda done, total: None

    def show(self, done: int, total: int) -> None:
        """Show the progress, once the case is the one that is read."""
        self.count(done, total)

    def read(self) -> Iterator[str]:
        """Yield the text of the case until it ends."""
        while (text := self.said.get()) is not None:
            yield text

    def run(self, folder: Path, options: RunArguments, workers: Workers) -> Path:
        """Run it in its turn."""
        assert workers.turn is not None
        try:
            with workers.turn:
                return _run_one(folder, options, workers, self.said.put)
        finally:
            self.said.put(None)


def _run_one(folder: Path, options: RunArguments, workers: Workers, say: Callable[[str], None]) -> Path:
    """Run a case: its tables are printed before its figures are drawn."""
    start = time.perf_counter()
    output = run_case(
        folder, options.out, **options.keywords(RunOneArguments), workers=workers,
        show=lambda case, tables: say("\n".join(_shown(case, tables))),
    )  # fmt: skip
    say(f"{time.perf_counter() - start:.1f} s, report: {output.report}\n")
    return output.report


def _shown(case: Case, tables: list[Table]) -> Iterator[str]:
    """Yield the summary and the tables of a case."""
    heading = f"{case.name}: {case.title}"
    yield f"{heading}\n{'=' * len(heading)}\n"
    for table in tables:
        yield as_text(table) + "\n"
