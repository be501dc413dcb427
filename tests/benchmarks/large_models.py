"""Receptances of a large solid by each library of sparse factors: `tests/benchmarks/run-large-models --help`."""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time

import numpy as np

import jointfrf as jf

from .options import numbers

#: What each way leaves out of what is installed.
_WITHOUT = {
    "SuperLU, own order": ("pypardiso", "mumps", "pymetis"),
    "SuperLU, METIS": ("pypardiso", "mumps"),
    "MUMPS": ("pypardiso",),
    "PARDISO": (),
}
_NEEDS = {"SuperLU, METIS": "pymetis", "MUMPS": "mumps", "PARDISO": "pypardiso"}


def main() -> int:
    parser = argparse.ArgumentParser(prog="run-large-models", description=__doc__)
    parser.add_argument(
        "--divisions", type=numbers, default=(20, 14, 104), metavar="X,Y,Z", help="bricks of a free bar"
    )
    parser.add_argument("--lines", type=int, default=800, metavar="N", help="frequency lines, 5 to 4000 Hz")
    parser.add_argument("--way", choices=tuple(_WITHOUT), help="one way only, in this process, as JSON")
    options = parser.parse_args()
    if options.way is not None:
        print(json.dumps(_measured(options.way, options.divisions, options.lines)))
        return 0
    print(f"{options.lines} lines, 6 x 6 FRFs, one thread\n")
    print("| sparse factors by | DOFs | CPU s | peak memory, GiB | error estimate |\n|---|---|---|---|---|")
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    for way in _WITHOUT:
        given = ["--way", way, "--lines", str(options.lines), "--divisions", ",".join(map(str, options.divisions))]
        command = [sys.executable, "-m", "benchmarks.large_models", *given]
        done = subprocess.run(command, env=os.environ | threads, capture_output=True, text=True, check=False)
        if done.returncode:
            print(f"{way}: {(done.stderr.strip().splitlines() or ['failed'])[-1]}", file=sys.stderr)
            continue
        r = json.loads(done.stdout)
        figures = f"{r['dofs']} | {r['cpu']:.0f} | {r['gib']:.1f} | {r['error']:.1e}"
        print(f"| {way} ({r['solver']}) | {figures} |", flush=True)
    return 0


def _measured(way: str, divisions: tuple[int, ...], n_lines: int) -> dict[str, float | int | str]:
    """Time one way; the peak of memory is that of the process."""
    if way in _NEEDS:
        __import__(_NEEDS[way])
    for package in _WITHOUT[way]:
        sys.modules[package] = None  # type: ignore[assignment]
    material = jf.Material(70e9, 0.33, 2700.0, 0.01)
    bar = jf.brick_beam(0.4, 0.1, 0.06, material, divisions=divisions, sections={"tip": 0.4})  # type: ignore[arg-type]
    ports = bar.ports(*(f"tip:{dof}" for dof in ("x", "y", "z", "theta_x", "theta_y", "theta_z")))
    start, cpu = time.perf_counter(), time.process_time()
    _, info = jf.receptance(
        np.linspace(5, 4000, n_lines),
        bar.stiffness,
        bar.mass,
        loss_factor=bar.loss_factor,
        outputs=ports,
        inputs=ports,
        full_output=True,
    )
    return {
        "dofs": len(bar.dofs),
        "seconds": time.perf_counter() - start,
        "cpu": time.process_time() - cpu,
        "gib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20,
        "error": info.error_estimate or 0.0,
        "solver": info.solver or info.method,
    }


if __name__ == "__main__":
    raise SystemExit(main())
