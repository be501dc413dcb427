"""What is a row of the table: what runs, in which environment, with which variables."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal, get_args

from .environments import OLDEST, VERSIONS, find_python
from .machines import MACHINES, Machine

Runner = Literal["pytest", "programs"]
Versions = Literal["checked-in", "lowest", "newest"]
#: Kinds of processor for which OpenBLAS has kernels of its own.
CORES = ("Prescott", "Nehalem", "Sandybridge", "Haswell", "SkylakeX", "Zen")
ENGINES = ("lapack", "plain", "x86-64-v2", "x86-64-v3", "x86-64-v4")
#: Whether the kernels run on this processor, and which they are.
_CORE = """
import ctypes, pathlib, numpy, scipy.linalg, scipy_openblas32
a = numpy.eye(300) + 0.1j
assert abs(scipy.linalg.lu_solve(scipy.linalg.lu_factor(a), a @ a) - a).max() < 1e-9
(library,) = pathlib.Path(scipy_openblas32.get_lib_dir()).glob("libscipy_openblas.*")
name = ctypes.CDLL(str(library)).scipy_openblas_get_corename
name.restype = ctypes.c_char_p
print(name().decode())
"""
#: A library that was built without the kernels of some older processors calls those of Prescott by the first of them.
_SAME_KERNELS = {"Katmai": "Prescott"}
_ENGINE = "import jointfrf; print(jointfrf.get_engine())"
_FEATURES = """
import json
import os
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
print(json.dumps([name for name in __cpu_dispatch__ if __cpu_features__[name]]))
"""


@dataclass(frozen=True)
class Configuration:
    """A row: tests of the package (pytest) or the test programs of the kernel, and the variables that they run with.

    `python` is None for the environment of tests/run, `machine` for the one that this runs on.
    """

    name: str
    runner: Runner = "pytest"
    python: str | None = None
    versions: Versions = "checked-in"
    variables: dict[str, str] = field(default_factory=dict)
    is_here: bool = True
    machine: Machine | None = None


def _said(script: str, **variables: str) -> str:
    """What a script prints; nothing where it fails."""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, env=os.environ | variables, check=False
    )
    return done.stdout.strip() if done.returncode == 0 else ""


def configurations() -> Iterator[Configuration]:
    """All rows, with whether this machine has what they need."""
    for runner in get_args(Runner):
        prefix = "" if runner == "pytest" else "programs, "
        for core in CORES:
            variables = {"OPENBLAS_CORETYPE": core}
            said = _said(_CORE, **variables)
            kernels = _SAME_KERNELS.get(said, said)
            which = core if kernels in (core, "") else f"{core} (kernels of {kernels})"
            yield Configuration(f"{prefix}OpenBLAS for {which}", runner, variables=variables, is_here=bool(said))
        for engine in ENGINES:
            variables = {"JOINTFRF_ENGINE": engine}
            is_here = _said(_ENGINE, **variables) == engine
            yield Configuration(f"{prefix}engine {engine}", runner, variables=variables, is_here=is_here)
    features = json.loads(_said(_FEATURES) or "[]")
    yield Configuration(
        "numpy without dispatch",
        variables={"NPY_DISABLE_CPU_FEATURES": " ".join(features)},
        is_here=bool(features),
    )
    yield Configuration(
        f"Python {OLDEST}, lowest versions", python=OLDEST, versions="lowest", is_here=bool(find_python(OLDEST))
    )
    for python in VERSIONS:
        for versions in ("checked-in", "newest"):
            name = f"Python {python}, {versions} versions"
            yield Configuration(name, python=python, versions=versions, is_here=bool(find_python(python)))
    for machine in MACHINES:
        for runner in get_args(Runner):
            name = f"{machine.name}, {'programs' if runner == 'programs' else 'package'}"
            yield Configuration(name, runner, is_here=machine.is_here, machine=machine)
