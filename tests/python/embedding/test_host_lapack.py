"""The kernel built without a LAPACK, linked to each LAPACK of this machine: the same results, codes and threads."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import case
import jointfrf as jf
from host_lapacks import Lapack, find_lapacks
from host_library import SKIPPED, TESTS, HostLibrary, parameters
from installed_library import PATH, ROOT, run

CASES = ("f77/case.f", "fortran/case.f90", "c/case.c")
LAPACKS = find_lapacks()
ENTRY = re.compile(r"(\w+)\((\d),(\d)\) *(\d+) +(\S+) +(\S+)")

pytestmark = [
    pytest.mark.builds,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="shared libraries of Linux"),
]
each_lapack = pytest.mark.parametrize("lapack", parameters(LAPACKS))


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> HostLibrary:
    return HostLibrary(tmp_path_factory.mktemp("host_lapack"))


@pytest.fixture(scope="module")
def cases(library: HostLibrary) -> dict[str, Path]:
    return {name: library.compile(TESTS / name, f"-I{library.module.parent}") for name in CASES}


@pytest.fixture(scope="module")
def programs(library: HostLibrary) -> dict[str, list[Path]]:
    return library.compile_programs()


@pytest.fixture(scope="module")
def printed(library: HostLibrary, cases: dict[str, Path]) -> Callable[[Lapack, str, str], str]:
    """What a case prints with a LAPACK and an engine."""
    linked: dict[tuple[str, str], Path] = {}

    def text(lapack: Lapack, name: str, engine: str) -> str:
        key = (lapack.name, name)
        if key not in linked:
            linked[key] = library.link(lapack, library.objects / f"case_{len(linked)}", cases[name])
        done = library.start(linked[key], lapack, engine)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return text


def read(text: str) -> dict[str, np.ndarray]:
    shapes = {"gamma": 4, "k_ismm": 2, "k_short": 2}
    matrices = {name: np.full((case.N_FREQ, n, n), np.nan, complex) for name, n in shapes.items()}
    for match in ENTRY.finditer(text):
        at = int(match[4]) - 1, int(match[2]) - 1, int(match[3]) - 1
        matrices[match[1]][at] = complex(float(match[5]), float(match[6]))
    return matrices


def identified(change: Callable[[np.ndarray], np.ndarray]) -> dict[str, np.ndarray]:
    """The case by numpy, with the matrix of each solution changed before it is used."""

    def inverse(matrix: np.ndarray) -> np.ndarray:
        return np.linalg.inv(change(matrix))

    h = []
    for model in (case.beam(0.300, 2, 2), case.beam(0.225, 1, 0)):
        h.append(inverse(model[0] * (1 + 1j * case.LOSS) - case.OMEGA[:, None, None] ** 2 * model[1]))
    h_jj, h_kk = h[0][:, 2:, 2:], h[1][:, :2, :2]

    def coupled(k: np.ndarray) -> np.ndarray:
        z = inverse(inverse(k) + h_jj + h_kk)
        return np.block([[h_jj - h_jj @ z @ h_jj, h_jj @ z @ h_kk], [h_kk @ z @ h_jj, h_kk - h_kk @ z @ h_kk]])

    k_joint = jf.Joint([6e6, 5e3], [50, 15]).dynamic_stiffness(case.FREQ_HZ)
    k_initial = jf.Joint([1e6, 1e3], [25, 5]).dynamic_stiffness(case.FREQ_HZ)
    gamma, alpha = coupled(k_joint), coupled(k_initial)
    k_short = -inverse(gamma)[:, :2, 2:]
    return {"gamma": gamma, "k_short": k_short, "k_ismm": k_initial + k_short + inverse(alpha)[:, :2, 2:]}


@pytest.fixture(scope="module")
def rounding() -> dict[str, np.ndarray]:
    """How far rounding may take each matrix, line by line.

    A solution of order n with pivoting is the exact one of a matrix that is changed by a few n eps. What such changes
    do (the condition number of the whole way) is seen from random ones of 1e-9; 16 n eps are allowed.
    """
    size, n = 1e-9, 4
    random = np.random.default_rng(1)
    exact = identified(lambda matrix: matrix)
    condition = dict.fromkeys(exact, np.zeros(case.N_FREQ))
    for _ in range(20):
        changed = identified(lambda matrix: matrix * (1 + size * random.uniform(-1, 1, matrix.shape)))
        for key, matrix in changed.items():
            condition[key] = np.maximum(condition[key], abs(matrix - exact[key]).max(axis=(1, 2)) / size)
    return {key: 16 * n * np.finfo(float).eps * condition[key] for key in condition}


@each_lapack
@pytest.mark.parametrize("name", CASES)
def test_lapack_engine_agrees_within_rounding(lapack, name, printed, rounding):
    """With the lanes, which are another computation."""
    reference = next(lapacks[0] for lapacks in LAPACKS.values() if lapacks)
    expected, actual = read(printed(reference, CASES[0], "plain")), read(printed(lapack, name, "lapack"))
    for key, bar in rounding.items():
        difference = abs(actual[key] - expected[key]).max(axis=(1, 2))
        assert (difference <= bar).all(), key


@each_lapack
@pytest.mark.parametrize("engine", ["plain", "auto"])
def test_lanes_have_the_same_bits_with_every_lapack(lapack, engine, printed, rounding):
    """But for lines in doubt, which go to LAPACK; in this case they are two, where a receptance is large."""
    reference = next(lapacks[0] for lapacks in LAPACKS.values() if lapacks)
    expected, actual = read(printed(reference, CASES[2], engine)), read(printed(lapack, CASES[0], engine))
    for key, bar in rounding.items():
        difference = abs(actual[key] - expected[key]).max(axis=(1, 2))
        assert np.count_nonzero(difference) <= 2, key
        assert (difference <= bar).all(), key


@each_lapack
def test_shared_library_takes_the_lapack_of_the_program(lapack, library, cases, printed, tmp_path):
    program = library.link(lapack, tmp_path / "case", cases[CASES[2]], shared=True)
    done = library.start(program, lapack, "lapack")
    assert (done.returncode, done.stdout) == (0, printed(lapack, CASES[2], "lapack")), done.stderr


@each_lapack
def test_programs_of_the_kernel_pass(lapack, library, programs, tmp_path):
    """Bad lines, codes, condition numbers, threads, all operations."""
    assert library.failures(lapack, programs, tmp_path) == {}


@each_lapack
def test_threads_are_held(lapack, library, programs, tmp_path):
    """Skipped by the program itself where there is nothing to hold; it looks into the symbols that it exports."""
    if lapack.holds and len(os.sched_getaffinity(0)) < 2:
        pytest.skip("one processor")
    program = library.link(lapack, tmp_path / "held", *programs["test_blas_threads"], Path("-Wl,--export-dynamic"))
    done = library.start(program, lapack, "auto", threads=2)
    assert done.returncode in ((0,) if lapack.holds else (0, SKIPPED)), done.stdout + done.stderr


def test_installed_files_name_no_lapack(library):
    undefined = run(["nm", "-D", "--undefined-only", library.folder / "libjointfrf.so"])
    assert {"zgesv_", "zgetrf_", "zgemm_"} <= {line.split()[-1] for line in undefined.splitlines()}
    needed = run(["readelf", "-d", library.folder / "libjointfrf.so"])
    assert not re.search("lapack|blas|mkl", library.pc.read_text() + needed, re.IGNORECASE)


def test_python_package_needs_a_lapack(library, tmp_path):
    command = ["meson", "setup", tmp_path, ROOT, "-Dlapack=host", "-Dpython=true"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | {"PATH": PATH})
    assert done.returncode != 0
    assert "-Dlapack=host is no choice for the Python package" in done.stdout
