"""The search for LAPACKs of the machine: what it takes for the reference one."""

import re
import sys
from pathlib import Path

import pytest

import host_lapacks

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="shared libraries of Linux")

#: A word that each kind of library holds, and the name that Debian gives it.
KINDS = {
    "blas/libblas.so.3": b"xerbla_ zgemm_",
    "lapack/liblapack.so.3": b"xerbla_ zgesv_",
    "blis-openmp/libblas.so.3": b"zgemm_ frame/0/bli_l0_check.c",
    "blis-openmp/libblis.so.4": b"zgemm_ bli_init",
    "openblas-pthread/libopenblas.so.0": b"openblas_get_parallel exec_blas_async",
    "openblas-pthread/libblas.so.3": b"libopenblas.so.0",
    "openblas-pthread/liblapack.so.3": b"libopenblas.so.0",
}


def found(tmp_path, monkeypatch, *without):
    for name, words in KINDS.items():
        if name not in without:
            (tmp_path / name).parent.mkdir(exist_ok=True)
            (tmp_path / name).write_bytes(words)
    monkeypatch.setattr(host_lapacks, "places", lambda: [tmp_path, *sorted(tmp_path.rglob("*/"))])
    lapacks = host_lapacks.find_lapacks()
    return {
        kind: [[str(file.relative_to(tmp_path)) for file in each.files] for each in lapacks[kind]] for kind in lapacks
    }


def test_all_kinds(tmp_path, monkeypatch):
    lapacks = found(tmp_path, monkeypatch)
    netlib = ["lapack/liblapack.so.3", "blas/libblas.so.3"]
    assert lapacks["reference LAPACK"] == [netlib]
    assert lapacks["OpenBLAS"] == [["openblas-pthread/libopenblas.so.0"]]
    assert lapacks["BLIS"] == [["blis-openmp/libblis.so.4", *netlib]]


def test_the_blas_of_blis_is_not_the_reference_one(tmp_path, monkeypatch):
    """Without libblas3 beside liblapack3: there is no reference BLAS, and BLIS is tested below the LAPACK."""
    lapacks = found(tmp_path, monkeypatch, "blas/libblas.so.3")
    assert lapacks["reference LAPACK"] == []
    assert lapacks["BLIS"] == [["blis-openmp/libblis.so.4", "lapack/liblapack.so.3"]]


def test_what_builds_in_a_folder_that_is_kept_takes_turns():
    """Two processes that test at once would configure and compile the same folder."""
    tests = Path(__file__).resolve().parents[1]
    builders = [
        path
        for path in [*tests.glob("embedding/*.py"), *tests.glob("support/*.py")]
        if re.search(r'"meson", "setup", (BUILD|build|folder), ', path.read_text())
    ]
    assert {path.name for path in builders} == {"host_library.py", "installed_library.py", "test_benchmarks.py"}
    assert [path.name for path in builders if "with FileLock(" not in path.read_text()] == []
