"""`./tests/portability/run`: the table, and exit status 1 where a test fails."""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from .configurations import Configuration, configurations
from .environments import FOLDER, ROOT, NotMadeError, make_environment, make_programs
from .machines import MACHINES

ABOUT = """\
Runs the numerical tests in many configurations, each a row of a table: kinds of processor for which OpenBLAS has
kernels of its own, engines, numpy without its dispatched instructions, the lowest and the newest versions that
pyproject.toml takes, and every Python. Numerical tests are all of tests/run but those that compile (marker `builds`)
and those of files in which no number depends on how it is computed (packaging, warnings, plots, texts of cases, files,
cards). Rows called `programs` are the test programs of the kernel. Environments and logs are kept in build/portability.
What a machine does not have is `not here`; PORTABILITY_PYTHONS names further interpreters, as PATH names folders.

Rows of other machines compile with a cross compiler and run in an emulator: the test programs, and the tests named in
tests/portability/numerical.py on a wheel. They need packages of Debian; the last ones also need Maven, or
PORTABILITY_WINDOWS_PYTHON, the folder of a Python for Windows with its headers:
{packages}
""".format(packages="\n".join(f"  {each.name}: {' '.join(each.packages)}" for each in MACHINES))
NUMERICAL = Path(__file__).with_name("numerical.py")
WITHOUT = ("packaging", "warnings", "plots", "cases_output", "cases_file", "files", "cards")


@dataclass(frozen=True)
class Count:
    """What came out of a row."""

    passed: int
    failed: int
    skipped: int
    seconds: float


def count(junit: Path, status: int, seconds: float) -> Count:
    """Count the cases of a JUnit file; one that is not there, or a status it does not explain, is a failure."""
    total = dict.fromkeys(("tests", "failures", "errors", "skipped"), 0)
    if junit.exists():
        for suite in ET.parse(junit).iter("testsuite"):
            for key in total:
                total[key] += int(suite.get(key) or 0)
    failed = total["failures"] + total["errors"]
    passed = total["tests"] - failed - total["skipped"]
    if (status and not failed) or passed == 0:
        failed += 1
    return Count(passed, failed, total["skipped"], seconds)


def run(row: Configuration, jobs: int) -> Count:
    """Run a row; its output goes to a log."""
    log = FOLDER / f"{row.name.replace(' ', '-').replace(',', '')}.log"
    junit = log.with_suffix(".xml")
    junit.unlink(missing_ok=True)
    started = time.monotonic()
    try:
        if row.runner == "programs":
            build = row.machine.make_programs() if row.machine else make_programs()
            junit = build / "meson-logs" / "testlog.junit.xml"
            junit.unlink(missing_ok=True)
            command = ["meson", "test", "-C", str(build), "--no-rebuild", "--num-processes", str(jobs)]
            # An emulator takes its time.
            command += ["--suite", "two threads", "--timeout-multiplier", "5"] if row.machine else []
        elif row.machine:
            command = [*map(str, row.machine.make_package()), row.machine.foreign(NUMERICAL)]
            command.append(f"--junitxml={row.machine.foreign(junit)}")
        else:
            programs = make_environment(row.python, row.versions) if row.python else Path(sys.executable).parent
            # The editable installation brings itself up to date here, and not in several processes at once.
            subprocess.run([programs / "python", "-c", "import jointfrf"], check=True, capture_output=True)
            command = [str(programs / "python"), "-m", "pytest", "-q", "-m", "not builds", f"--junitxml={junit}"]
            command += [f"--ignore-glob=*/test_{name}.py" for name in WITHOUT]
            command += ["-p", "no:cacheprovider", "-n", str(jobs), "--dist", "loadfile"]
    except (NotMadeError, subprocess.CalledProcessError) as error:
        log.write_text(f"{error}\n{getattr(error, 'stderr', '')}\n")
        return Count(0, 1, 0, time.monotonic() - started)
    started = time.monotonic()
    environment = os.environ | row.variables | (row.machine.variables() if row.machine else {})
    through = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    # By a pipe: a program in wine takes no file for its output.
    with log.open("wb") as output, subprocess.Popen(command, cwd=ROOT, env=environment, **through) as done:
        shutil.copyfileobj(done.stdout, output)
    return count(junit, done.returncode, time.monotonic() - started)


def main() -> int:
    """Read the command line, run the rows, print the table."""
    parser = argparse.ArgumentParser("tests/portability/run", description=ABOUT)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(
        "--only", action="append", metavar="WORD", help="rows whose name has this in it; may be repeated"
    )
    parser.add_argument("--list", action="store_true", help="name the rows and run none")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="processes (default: all)")
    options = parser.parse_args()
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    FOLDER.mkdir(parents=True, exist_ok=True)
    words = [word.lower() for word in options.only or [""]]
    rows = [row for row in configurations() if any(word in row.name.lower() for word in words)]
    if not rows:
        parser.error("no row has such a name; --list names them")
    width = max(len(row.name) for row in rows)
    if not options.list:
        print(f"{'configuration':{width}}  passed  failed  skipped  seconds", flush=True)
    failed = 0
    for row in rows:
        if options.list or not row.is_here:
            print(f"{row.name:{width}}{'' if row.is_here else '  not here'}", flush=True)
            continue
        found = run(row, options.jobs)
        print(
            f"{row.name:{width}}  {found.passed:6d}  {found.failed:6d}  {found.skipped:7d}  {found.seconds:7.0f}",
            flush=True,
        )
        failed += found.failed
    if failed:
        print(f"{failed} failed; logs are in {FOLDER.relative_to(ROOT)}", file=sys.stderr)
    return failed > 0


if __name__ == "__main__":
    sys.exit(main())
