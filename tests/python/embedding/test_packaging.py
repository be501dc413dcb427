"""What is installed: the extension's symbols, metadata, data files; on demand (`-m wheel`) a wheel elsewhere."""

import importlib.metadata
import importlib.resources
import os
import pathlib
import shutil
import subprocess
import sys

import pytest

import jointfrf
from jointfrf import _kernel

ROOT = pathlib.Path(__file__).resolve().parents[3]
CASES = sorted(path.parent.name for path in (ROOT / "cases").glob("*/case.toml"))


@pytest.mark.skipif(not sys.platform.startswith("linux") or shutil.which("nm") is None, reason="needs nm and ELF")
def test_extension_exports_nothing_but_its_entry_point():
    command = ["nm", "-D", "--defined-only", _kernel.__file__]
    listing = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert [line.split()[-1] for line in listing.splitlines()] == ["PyInit__kernel"]


def test_metadata():
    about = importlib.metadata.metadata("jointfrf")
    assert about["Version"] == jointfrf.__version__
    assert about["License-Expression"] == "BSD-3-Clause"
    needed = [text for text in about.get_all("Requires-Dist") if "extra ==" not in text]
    assert {text.split(">")[0] for text in needed} == {"msgspec", "numpy", "scipy", "scipy-openblas32", "threadpoolctl"}


def test_kernel_has_the_version_of_the_package():
    assert ".".join(str(int(number)) for number in _kernel.jf_version()) == importlib.metadata.version("jointfrf")


@pytest.mark.parametrize("name", CASES)
def test_cases_travel_with_the_package(name):
    case = importlib.resources.files("jointfrf") / "data" / "cases" / name
    # What nothing is known about beforehand has no expected.toml.
    files = [path.name for path in (ROOT / "cases" / name).iterdir() if path.suffix in (".toml", ".md")]
    assert {"case.toml", "README.md"} <= set(files)
    assert all((case / file).is_file() for file in files)


CHECK = """
import importlib.resources, pathlib, sys
import numpy as np
import jointfrf
a = np.arange(1.0, 6.0)[:, None, None] * np.eye(3) + 0.1j
assert abs(jointfrf.invert(a) @ a - np.eye(3)).max() < 1e-12
cases = importlib.resources.files("jointfrf") / "data" / "cases"
assert sorted(case.name for case in cases.iterdir() if (case / 'case.toml').is_file()) == sys.argv[1:]
maps = [line.split(maxsplit=5)[-1].strip() for line in open("/proc/self/maps")]
fortran = {m for m in maps if any(name in m for name in ("libgfortran", "libgomp", "libquadmath", "openblas"))}
assert fortran
assert all(pathlib.Path(m).is_relative_to(sys.prefix) for m in fortran), fortran
"""


@pytest.mark.builds
@pytest.mark.wheel
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the wheel script is for Linux")
def test_wheel_brings_its_own_fortran_library(tmp_path):
    subprocess.run([ROOT / "python" / "build_wheel.sh", tmp_path], check=True)
    (wheel,) = tmp_path.glob("*.whl")
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    python = tmp_path / "venv" / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "-q", wheel], check=True)
    clean = {key: value for key, value in os.environ.items() if key not in ("LD_LIBRARY_PATH", "PYTHONPATH")}
    subprocess.run([python, "-c", CHECK, *CASES], check=True, cwd=tmp_path, env=clean)
