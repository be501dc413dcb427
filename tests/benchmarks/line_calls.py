"""What one line costs in a program's own frequency loop: `tests/benchmarks/run-line-calls --help`."""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import scipy_openblas32

from .machine import ROOT, build_kernel
from .options import numbers

_SOURCE = ROOT / "tests" / "benchmarks" / "line_calls.F90"
_ROUTINES = {"couple": "jf_couple", "compliance": "jf_joint_compliance", "solve": "jf_solve"}
#: What a row counts, and how many times the joint DOFs that is: as many right-hand sides as the order.
_COUNTED = {"couple": ("joint DOFs", 1), "compliance": ("joint DOFs", 1), "solve": ("order", 2)}


def main() -> int:
    parser = argparse.ArgumentParser(prog="run-line-calls", description=__doc__)
    parser.add_argument("--orders", type=numbers, default=(1, 2, 3, 6, 12), metavar="N,...", help="joint DOFs")
    parser.add_argument("--output", type=Path, metavar="FILE", help="the results as JSON")
    options = parser.parse_args()
    if shutil.which("gfortran") is None:
        parser.error("gfortran is not there")
    with tempfile.TemporaryDirectory() as folder:
        program = _compile(Path(folder) / "line_calls")
        records = [_run(program, order) for order in options.orders]
    print("Nanoseconds a line, one thread.")
    for name, routine in _ROUTINES.items():
        counted, times_dofs = _COUNTED[name]
        heads = [counted, f"`{routine}_work`", f"`{routine}`, one line", f"`{routine}`, 1000 lines"]
        heads += ["`zgesv`"] if name == "solve" else []
        print(f"\n| {' | '.join(heads)} |\n{'|---' * len(heads)}|")
        for record in records:
            times = [record[f"{name}_{way}"] for way in ("work", "line", "sweep")]
            times += [record["solve_zgesv"]] if name == "solve" else []
            print(f"| {times_dofs * record['order']:.0f} | {' | '.join(f'{one:.0f}' for one in times)} |")
    if options.output is not None:
        options.output.write_text(json.dumps(records, indent=1) + "\n")
    return 0


def _compile(program: Path) -> Path:
    """Compile the program against the shared library, its Fortran module and the same LAPACK."""
    kernel, lapack = build_kernel(), scipy_openblas32.get_lib_dir()
    modules = sorted({str(path.parent) for path in kernel.rglob("jointfrf.mod")})
    command = ["gfortran", "-O2", '-DJF_BLAS_PREFIX="scipy_"', *(f"-I{folder}" for folder in modules), str(_SOURCE)]
    command += ["-o", str(program), f"-L{kernel}", "-ljointfrf", f"-L{lapack}", "-lscipy_openblas"]
    command += [f"-Wl,-rpath,{kernel.resolve()}", f"-Wl,-rpath,{lapack}"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"gfortran failed:\n{done.stderr[-2000:]}")
    return program


def _run(program: Path, order: int) -> dict[str, float]:
    """Run the program on one thread; return what it prints as names and numbers."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([str(program), str(order)], capture_output=True, text=True, env=environment)
    if done.returncode:
        raise RuntimeError(f"line_calls failed:\n{done.stdout[-1000:]}{done.stderr[-2000:]}")
    words = done.stdout.split()
    return {name: float(value) for name, value in zip(words[::2], words[1::2], strict=True)}


if __name__ == "__main__":
    sys.exit(main())
