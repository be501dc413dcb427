"""The command `jointfrf`."""

from __future__ import annotations

import argparse
import importlib
import os
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointfrf.cli.extras import check_installed

if TYPE_CHECKING:
    from jointfrf.cases.catalogue import CaseOutput

__all__ = ["main"]

_USAGE_ERROR, _FAILURE, _INTERRUPTED = 2, 1, 130


class _UsageError(Exception):
    """A wrong word on the command line."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after `jointfrf`; those of the process by default.

    Returns
    -------
    int
        0 good, 1 something in the data or the files is wrong, 2 wrong usage, 130 interrupted.
    """
    options = _parser(list(sys.argv[1:] if arguments is None else arguments)).parse_args(arguments)
    with warnings.catch_warnings():
        warnings.showwarning = _show_warning
        try:
            status: int = options.action(options)
            sys.stdout.flush()
            return status
        except _UsageError as error:
            return _complain(error, _USAGE_ERROR)
        except BrokenPipeError:
            # The reader went away (`jointfrf cases | head`): nothing more can be said.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return _FAILURE
        except OSError as error:
            where = f"{error.filename}: " if error.filename else ""
            return _complain(f"{where}{error.strerror or error}", _FAILURE)
        except (ValueError, TypeError, ArithmeticError, MemoryError, RuntimeError) as error:
            return _complain(error, _FAILURE)
        except KeyboardInterrupt:
            return _complain("interrupted", _INTERRUPTED)


def _complain(message: object, status: int) -> int:
    print(f"jointfrf: error: {message}", file=sys.stderr)
    return status


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"jointfrf: warning: {message}", file=sys.stderr)


def _parser(words: list[str]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="jointfrf", description="Stiffness and damping of joints from FRFs.")
    parser.add_argument("--version", action="version", version=f"jointfrf {version('jointfrf')}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)

    run = commands.add_parser(
        "run", help="run cases: tables, figures and a report each",
        description="Run cases by name, number or folder; without any, all that come with jointfrf.",
    )  # fmt: skip
    run.add_argument("cases", nargs="*", metavar="CASE", help="name, number, or folder with a case.toml")
    run.add_argument("--out", type=Path, default=Path("results"), metavar="DIR", help="where results go (results)")
    run.add_argument("--realisations", type=_positive, metavar="N", help="instead of the number the case names")
    run.add_argument("--jobs", type=_positive, metavar="N", default=_cores(), help="processes (all cores)")
    run.set_defaults(action=_run)

    cases = commands.add_parser("cases", help="list the cases that come with jointfrf")
    cases.set_defaults(action=_cases)

    identify = commands.add_parser("identify", help="identify a joint from a file of measured FRFs")
    # Readers of files are imported only where they are wanted.
    if words[:1] == ["identify"]:
        module = importlib.import_module("jointfrf.cli.identify")
        module.add_arguments(identify)
        identify.set_defaults(action=module.run)
    return parser


def _positive(word: str) -> int:
    if not word.isdecimal() or int(word) < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number, at least 1, not {word!r}")
    return int(word)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _cases(options: argparse.Namespace) -> int:
    from jointfrf.cases.catalogue import list_cases, read_case

    found = [read_case(folder) for folder in list_cases()]
    width = max((len(case.name) for case in found), default=0)
    for case in found:
        print(f"{case.name.ljust(width)}  {case.title}")
    return 0


def _run(options: argparse.Namespace) -> int:
    check_installed("matplotlib", "jinja2")
    from jointfrf.cases.catalogue import UnknownCaseError, find_case, list_cases, run_case
    from jointfrf.cases.workers import started_workers

    try:
        folders = [find_case(word).resolve() for word in options.cases] or list_cases()
    except UnknownCaseError as error:
        raise _UsageError(error) from error
    folders = list(dict.fromkeys(folders))
    if not folders:
        raise _UsageError("no cases come with this installation: name a folder with a case.toml")
    twice = {folder.name for folder in folders if [f.name for f in folders].count(folder.name) > 1}
    if twice:
        raise _UsageError(f"two cases are called {min(twice)}: their results would overwrite each other")
    reports = []
    with started_workers(options.jobs) as workers:
        for folder in folders:
            start = time.perf_counter()
            at_work = replace(workers, progress=_progress(folder.name))
            output = run_case(folder, options.out, realisations=options.realisations, workers=at_work)
            _show_output(output)
            print(f"{time.perf_counter() - start:.1f} s, report: {output.report}\n", flush=True)
            reports.append(output.report)
            del output  # before the next case needs the memory
    if len(reports) > 1:
        print("Reports:", *(f"  {report}" for report in reports), sep="\n")
    return 0


def _show_output(output: CaseOutput) -> None:
    """Print the summary and the tables of a case."""
    from jointfrf.report.table import as_text

    heading = f"{output.case.name}: {output.case.title}"
    print(f"{heading}\n{'=' * len(heading)}\n")
    print(*(f"- {sentence}" for sentence in output.summary), "", sep="\n")
    for table in output.printed:
        print(as_text(table), end="\n\n")


def _progress(name: str) -> Callable[[int, int], None]:
    """Return a counter in one line of a terminal; silent elsewhere."""
    if not sys.stderr.isatty():
        return lambda done, total: None

    def show(done: int, total: int) -> None:
        end = "\r\x1b[K" if done == total else ""
        print(f"\r{name}: {100 * done // total} %{end}", end="", file=sys.stderr, flush=True)

    return show


if __name__ == "__main__":
    sys.exit(main())
