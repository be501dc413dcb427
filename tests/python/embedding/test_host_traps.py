"""FORTRAN 77 programs that stop at floating-point exceptions, or tell of them when they end, call the library."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from installed_library import InstalledLibrary, run

pytestmark = pytest.mark.builds

FOLDER = Path(__file__).resolve().parents[2] / "f77"
TRAPS = "-ffpe-trap=invalid,zero,overflow"
CODES = [0, 0, 2, -2, -1, 2, 0, -2, 2, -1, 0, 2]
#: Of 24 lines: those whose number is a multiple of 3, 4 or 5.
BAD = 14


def ended(program: Path, threads: int = 2) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"OMP_NUM_THREADS": str(threads)}
    return subprocess.run([program], capture_output=True, text=True, timeout=900, env=environment)


@pytest.mark.parametrize("engine", ["lapack", "auto"])
def test_a_program_with_traps_prints_the_same(installed_library: InstalledLibrary, tmp_path, engine):
    plain = installed_library.compile(FOLDER / "case.f", tmp_path / "plain")
    trapping = installed_library.compile(FOLDER / "case.f", tmp_path / "trapping", TRAPS)
    environment = {"JOINTFRF_ENGINE": engine}
    text = run([trapping], env=environment)
    assert len(text) > 10_000
    assert text == run([plain], env=environment)


@pytest.mark.parametrize("flags", [(), (TRAPS,)], ids=["no traps", "traps"])
def test_bad_lines_stop_nothing_and_leave_no_note(installed_library: InstalledLibrary, tmp_path, flags):
    done = ended(installed_library.compile(FOLDER / "badlines.f", tmp_path / "badlines", *flags))
    assert (done.returncode, done.stderr) == (0, "")
    rows = [[int(word) for word in line.split()] for line in done.stdout.splitlines()]
    assert len(rows) >= 5
    for engine, info, *codes in rows:
        assert info == BAD, engine
        assert codes == CODES, engine


def test_exceptions_of_the_program_itself_are_seen(installed_library: InstalledLibrary, tmp_path):
    """The two tests above could not fail otherwise: the same program with a division by zero of its own."""
    source = tmp_path / "divide.f"
    source.write_text((FOLDER / "badlines.f").read_text().replace("C     DIVIDE", "      WRITE (*, *) 1.0D0/RCOND(3)"))
    noted = ended(installed_library.compile(source, tmp_path / "noted"))
    assert noted.returncode == 0
    assert "IEEE_DIVIDE_BY_ZERO" in noted.stderr
    assert ended(installed_library.compile(source, tmp_path / "stopped", TRAPS)).returncode < 0
