"""The example of a sweep over the processes of MPI, and the command that measures how it scales."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[2]
BUILT = Path(os.environ.get("JOINTFRF_TEST_PROGRAMS", TESTS.parent / "build" / "tests" / "tests")).parent / "fortran"

pytestmark = [
    pytest.mark.builds,
    pytest.mark.skipif(
        shutil.which("mpif90") is None or shutil.which("mpirun") is None,
        reason="MPI (mpif90, mpirun) is not on PATH",
    ),
    pytest.mark.skipif(
        not (BUILT / "libjointfrf.so").exists(),
        reason="the library is not built: ./tests/run builds it, or set JOINTFRF_TEST_PROGRAMS",
    ),
]


def command(*words):
    path = os.pathsep.join([str(TESTS), *filter(None, [os.environ.get("PYTHONPATH")])])
    return subprocess.run(
        [sys.executable, "-m", "benchmarks.mpi", "--kernel", str(BUILT), *words],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
        timeout=900,
        check=False,
    )


def test_two_processes_give_the_bits_of_one(tmp_path):
    results = tmp_path / "mpi.json"
    words = ("--processes", "1,2,3", "--orders", "1,6", "--lines", "1501", "--repeats", "1", "--output", str(results))
    done = command(*words)
    assert done.returncode == 0, done.stdout + done.stderr
    records = json.loads(results.read_text())["records"]
    assert [(r["order"], r["processes"]) for r in records] == [(n, p) for n in (1, 6) for p in (1, 2, 3)]
    for r in records:
        assert r["lines"] == 1501
        assert r["different"] == 0
        assert 0 < r["seconds_couple"] < r["seconds"]


def test_more_processes_than_blocks_of_lines():
    done = command("--processes", "2", "--orders", "2", "--lines", "5", "--repeats", "1")
    assert done.returncode == 0, done.stdout + done.stderr


def test_command_can_be_started():
    assert os.access(TESTS / "benchmarks" / "run-mpi", os.X_OK)
