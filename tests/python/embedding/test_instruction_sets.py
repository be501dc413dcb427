"""A build for the machine that builds: the kernels of its level of x86-64 and the plain ones, and no others."""

import ctypes
import os
import platform
import subprocess
import sys
from pathlib import Path

import pytest

import jointfrf as jf

ROOT = Path(__file__).resolve().parents[3]
#: By their numbers in the kernel.
WORDS = ("auto", "lapack", "plain", "x86-64-v2", "x86-64-v3", "x86-64-v4")

pytestmark = [
    pytest.mark.builds,
    pytest.mark.skipif(platform.machine() != "x86_64" or sys.platform != "linux", reason="levels of x86-64"),
]


def test_the_lanes_of_one_level_and_the_plain_ones(tmp_path):
    folder = tmp_path / "build"
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    options = ["-Dinstruction_sets=own", "-Dbuildtype=plain", "-Dtests=false", "-Dlapack=scipy-openblas32"]
    for command in (
        ["meson", "setup", *options, folder, ROOT, f"-Dlapack_python={sys.executable}"],
        ["ninja", "-C", folder],
    ):
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment)
        assert done.returncode == 0, done.stdout
    library = ctypes.CDLL(str(folder / "fortran" / "libjointfrf.so"))
    info, chosen = ctypes.c_int(), ctypes.c_int()
    there = []
    for number, word in enumerate(WORDS):
        library.jf_set_engine_(ctypes.byref(ctypes.c_int(number)), ctypes.byref(info))
        there += [word] * (info.value == 0)
    library.jf_set_engine_(ctypes.byref(ctypes.c_int(0)), ctypes.byref(info))
    library.jf_get_engine_(ctypes.byref(chosen), ctypes.byref(info))
    with jf.use_engine("auto"):
        best = jf.get_engine()  # of a build for all levels
    assert WORDS[chosen.value] == best
    assert there == list(dict.fromkeys(["auto", "lapack", "plain", best]))
