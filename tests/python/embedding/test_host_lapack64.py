"""Programs whose integers have eight bytes, and whose LAPACK has such integers under the ordinary names."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import case
import jointfrf as jf
from host_lapacks import find_lapacks
from host_library import TESTS, HostLibrary, parameters

pytestmark = [
    pytest.mark.builds,
    pytest.mark.skipif(not sys.platform.startswith("linux"), reason="shared libraries of Linux"),
]
each_lapack = pytest.mark.parametrize("lapack", parameters(find_lapacks(ilp64=True)))


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> HostLibrary:
    return HostLibrary(tmp_path_factory.mktemp("host_lapack64"), ilp64=True)


@pytest.fixture(scope="module")
def programs(library: HostLibrary) -> dict[str, list[Path]]:
    return library.compile_programs()


@each_lapack
def test_programs_of_the_kernel_pass(lapack, library, programs, tmp_path):
    assert library.failures(lapack, programs, tmp_path) == {}


@each_lapack
def test_joint_is_found(lapack, library, tmp_path):
    source = library.compile(TESTS / "f77" / "case.f", "-fdefault-integer-8")
    done = library.start(library.link(lapack, tmp_path / "case", source), lapack, "lapack")
    assert done.returncode == 0, done.stdout + done.stderr
    rows = [line for line in done.stdout.splitlines() if line.startswith("k_short(")]
    found = np.array([row.split(")")[1].split()[1:] for row in rows], float).view(complex).reshape(-1, 2, 2)
    expected = jf.Joint([6e6, 5e3], [50, 15]).dynamic_stiffness(case.FREQ_HZ)
    assert abs(found - expected).max() < 1e-9 * abs(expected).max()
