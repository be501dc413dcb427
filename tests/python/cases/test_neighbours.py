"""Pages of neighbours: blocks of MATLAB in GNU Octave, its calls of Python, calls of Julia by their types."""

import ctypes
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf

ROOT = Path(__file__).resolve().parents[3]
OCTAVE = shutil.which("octave-cli") or shutil.which("octave")
HEADERS = sorted((ROOT / "build").glob("*/fortran/api/include/jointfrf.h"))


def blocks(page, language):
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


@pytest.mark.skipif(OCTAVE is None, reason="GNU Octave is not on PATH")
def test_the_blocks_of_matlab_run_in_octave(tmp_path):
    """All but the last one, which calls Python from MATLAB; they print what the page shows."""
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    *code, python = blocks("matlab.md", "matlab")
    assert "pyenv(" in python
    (tmp_path / "page.m").write_text("".join(code))
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    command = [OCTAVE, "--no-gui", "--quiet", "--no-init-file", "page.m"]
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == "".join(blocks("matlab.md", "text")).split()


def test_the_calls_of_python_from_matlab():
    """In their order, with the arguments of the page."""
    code = blocks("matlab.md", "matlab")[-1]
    for name in re.findall(r"py\.jointfrf\.([\w.]+)\(", code):
        assert callable(eval(f"jf.{name}"))
    held = jf.io.read_frfs(ROOT / "cases" / "hammer-test" / "two_bars.uff")
    freq, frf = held.freq_hz, np.moveaxis(held.h, 0, -1)
    h = np.add(np.array(frf.real), np.multiply(complex(0, 1), np.array(frf.imag)))
    lists = {
        name: re.findall(r"'([^']+)'", words) for name, words in re.findall(r"(\w+) = py\.list\(\{(.*?)\}\)", code)
    }
    names, ends = lists["names"], lists["ends"]
    frfs = jf.io.frfs_of_arrays(freq, h, names, names, unit="m/s^2/N", axes="out,in,freq")
    gamma = frfs.receptance().matrix(ends, ends)
    rows = re.search(r"weights = \[(.*?)\]", code)[1].split(";")
    weights = np.array([[float(word) for word in row.split()] for row in rows])
    fit = jf.identify(frfs.freq_hz, gamma, transform=weights, dofs=["y", "rz"])
    low, high = fit.confidence_interval(0.95)["k_y"]
    assert low < 1e7 < high
    assert fit.k_joint(freq).shape == (freq.size, 2, 2)


TYPES = {
    "const char *": "Cstring",
    "const jf_int *": "Int32",
    "jf_int *": "Int32",
    "const jf_complex *": "ComplexF64",
    "jf_complex *": "ComplexF64",
    "const double *": "Float64",
    "double *": "Float64",
}


@pytest.mark.skipif(not HEADERS, reason="the header is not built")
def test_the_calls_of_julia_have_the_types_of_the_header():
    """Also one argument for each type, and a scalar or an array as the page has it."""
    (code,) = blocks("julia.md", "julia")
    header = HEADERS[0].read_text(encoding="utf-8")
    calls = re.findall(r"ccall\(\(:(\w+), jointfrf\), Cvoid,\s*\(([^()]*)\),\s*(.*?)\)\n", code, re.DOTALL)
    assert [name for name, *_ in calls] == ["jf_couple_", "jf_inverse_substructuring_"]
    for name, types, given in calls:
        declared = re.search(rf"void {name}\((.*?)\);", header, re.DOTALL)[1]
        kinds = [re.match(r"((?:const )?\w+ \*)", " ".join(one.split()))[1] for one in declared.split(",")]
        wanted = [re.sub(r"(?:Ref|Ptr)\{(\w+)\}", r"\1", one.strip()) for one in types.split(",")]
        assert wanted == [TYPES[kind] for kind in kinds]
        assert len(re.split(r",\s*(?![^()]*\))", given)) == len(kinds)


def test_the_numbers_of_the_page_of_julia():
    """The same calls through the library by address, arrays in the order of Fortran."""
    libraries = sorted((ROOT / "build").glob("*/fortran/libjointfrf.so"))
    if not libraries:
        pytest.skip("the shared library is not built")
    library = ctypes.CDLL(str(libraries[0]))
    omega = 2 * np.pi * np.arange(10.0, 401.0, 10.0)
    n = omega.size

    def call(name, *arguments):
        held = [np.asfortranarray(one) if isinstance(one, np.ndarray) else ctypes.c_int32(one) for one in arguments]
        line_info, rcond, info = np.zeros(n, np.int32), np.zeros(n), ctypes.c_int32(-1)
        places = [one.ctypes.data_as(ctypes.c_void_p) if isinstance(one, np.ndarray) else ctypes.byref(one)
                  for one in (*held, line_info, rcond, info)]  # fmt: skip
        getattr(library, name)(b"N", *places)
        assert info.value == 0
        return held[-1]

    h_a, h_b = ((-1 / (m * omega**2)).reshape(1, 1, n).astype(complex) for m in (3.0, 1.872))
    k = (2e6 * (1 + 0.05j) + 40j * omega).reshape(1, 1, n)
    one = np.ones(1, np.int32)
    h_c = call("jf_couple_", 1, 1, 1, n, h_a, h_b, k, one, one, np.zeros((2, 2, n), complex))
    found = call("jf_inverse_substructuring_", 1, n, h_c, np.zeros((1, 1, n), complex))
    np.testing.assert_allclose(found, k, rtol=1e-10)
