"""How a sweep scales over the processes of MPI: `tests/benchmarks/run-mpi --help`."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from .machine import ROOT, build_kernel, usable_cores
from .options import numbers

_SOURCE = ROOT / "tests" / "mpi" / "sweep.f90"
#: Memory that the FRFs of a case may take, bytes: all processes hold them together about twice.
_MEMORY = 2e8
_TIMEOUT = 300


def main() -> int:
    parser = argparse.ArgumentParser(prog="run-mpi", description=__doc__)
    parser.add_argument("--processes", type=numbers, default=(1, 2), metavar="N,...", help="default: 1,2")
    parser.add_argument("--orders", type=numbers, default=(2, 6, 12, 24), metavar="N,...", help="joint DOFs")
    parser.add_argument("--lines", type=int, help="frequency lines (default: what 200 MB hold, 65536 at most)")
    parser.add_argument("--repeats", type=int, default=7, help="the least time counts (default: 7)")
    parser.add_argument("--kernel", type=Path, metavar="FOLDER", help="folder with a library that is built already")
    parser.add_argument("--output", type=Path, metavar="FILE", help="the results as JSON")
    options = parser.parse_args()
    for tool in ("mpif90", "mpirun"):
        if shutil.which(tool) is None:
            parser.error(f"{tool} is not there (Debian: apt-get install libopenmpi-dev openmpi-bin)")
    if max(options.processes) > usable_cores():
        print(f"this process may run on {usable_cores()} of {os.cpu_count()} cores: more processes share them")
    records = []
    print("order  lines   processes  lines/s     speed-up  of which jf_couple")
    with tempfile.TemporaryDirectory() as folder:
        program = _compile(options.kernel or build_kernel(), Path(folder) / "sweep")
        for order in options.orders:
            lines = options.lines or min(65536, int(_MEMORY / (16 * 7 * order**2)))
            cases = [_run(program, count, (lines, order, options.repeats)) for count in options.processes]
            for case in cases:
                print(_row(case, cases[0]), flush=True)
            records += cases
    if options.output is not None:
        options.output.write_text(json.dumps({"cores": usable_cores(), "records": records}, indent=1) + "\n")
    return 0


def _compile(kernel: Path, program: Path) -> Path:
    """Compile the example against the shared library and its Fortran module."""
    modules = sorted({str(path.parent) for path in kernel.rglob("jointfrf.mod")})
    command = ["mpif90", "-O2", *(f"-I{folder}" for folder in modules), str(_SOURCE), "-o", str(program)]
    command += [f"-L{kernel}", "-ljointfrf", f"-Wl,-rpath,{kernel.resolve()}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=_TIMEOUT)
    if done.returncode:
        raise RuntimeError(f"mpif90 failed:\n{done.stderr[-2000:]}")
    return program


def _launcher() -> str:
    """Return the mpirun of the compiler: one of another MPI starts processes that do not know of each other."""
    compiler = shutil.which("mpif90")
    beside = compiler and shutil.which("mpirun", path=str(Path(compiler).parent))
    return beside or "mpirun"


def _run(program: Path, processes: int, words: tuple[int, ...]) -> dict[str, Any]:
    """Run the example, one thread a process; return what it prints as names and numbers."""
    command = [_launcher(), "-n", str(processes)]
    if "Open MPI" in subprocess.run([command[0], "--version"], capture_output=True, text=True).stdout:
        command[1:1] = ["--allow-run-as-root", "--oversubscribe"]
    done = subprocess.run(
        [*command, str(program), *map(str, words)],
        capture_output=True,
        text=True,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
        timeout=_TIMEOUT,
    )
    if done.returncode:
        raise RuntimeError(f"mpirun failed:\n{done.stdout[-1000:]}{done.stderr[-2000:]}")
    words_out = done.stdout.split()
    return {name: float(value) for name, value in zip(words_out[::2], words_out[1::2], strict=True)}


def _row(case: dict[str, Any], first: dict[str, Any]) -> str:
    rate = case["lines"] / case["seconds"]
    faster, couple_faster = (first[name] / case[name] for name in ("seconds", "seconds_couple"))
    return (
        f"{case['order']:5.0f}  {case['lines']:6.0f}  {case['processes']:9.0f}  {rate:9.3e}  {faster:8.2f}  "
        f"{case['seconds_couple'] / case['seconds']:6.0%}, by itself {couple_faster:.2f} times faster"
    )


if __name__ == "__main__":
    sys.exit(main())
