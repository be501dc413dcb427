"""Eigen with matrices of fixed size, compiled for this processor: what a C++ program would do."""

from __future__ import annotations

import ctypes
import hashlib
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from ..data import Array, Data
from .peer import NotThereError, Peer, compiled

_SOURCE = Path(__file__).with_name("eigen_fixed.cpp")
_PLACES = (Path("/usr/include/eigen3"), Path("/usr/local/include/eigen3"), Path("/opt/homebrew/include/eigen3"))
#: Above this order Eigen's code for a fixed size is no other than that for any size, but takes minutes to compile.
_LARGEST = 64
_OPTIONS = ("-O3", "-march=native")


def load(build: Path, orders: Sequence[int], folder: Path | None) -> list[Peer]:
    """Compile and load it.

    Parameters
    ----------
    build : Path
        Folder for what is compiled.
    orders : sequence of int
    folder : Path, optional
        Where `Eigen/Dense` lies, if not in the usual place.
    """
    places = [folder] if folder else list(_PLACES)
    include = next((place for place in places if (place / "Eigen" / "Dense").exists()), None)
    if include is None:
        raise NotThereError(f"no Eigen/Dense in {', '.join(map(str, places))} (Debian: apt-get install libeigen3-dev)")
    compiler = _first_line("g++", "--version")
    macro = "-DORDERS=" + " ".join(f"X({n})" for n in sorted(set(orders)) if n <= _LARGEST)
    command = ["g++", *_OPTIONS, "-DNDEBUG", "-DEIGEN_STACK_ALLOCATION_LIMIT=0", "-shared", "-fPIC", macro]
    command += [f"-I{include}", str(_SOURCE)]
    key = hashlib.sha256(" ".join([*command, compiler, _SOURCE.read_text()]).encode()).hexdigest()[:12]
    library = ctypes.CDLL(str(compiled(command, build / f"eigen_{key}.so")))
    pointer = ctypes.c_void_p
    library.eigen_invert.argtypes = [ctypes.c_int, ctypes.c_long, pointer, pointer]
    library.eigen_solve.argtypes = [ctypes.c_int, ctypes.c_int, ctypes.c_long, pointer, pointer, pointer]
    library.eigen_ismm.argtypes = [ctypes.c_int, ctypes.c_long, pointer, pointer, pointer, pointer]
    number = library.eigen_version()
    version = f"{number // 10000}.{number // 100 % 100}.{number % 100}"

    def invert(data: Data) -> Callable[[], Array]:
        a = data["a"]

        def call() -> Array:
            x = np.empty_like(a)
            _good(library.eigen_invert(data.n, data.lines, a.ctypes.data, x.ctypes.data))
            return x

        return call

    def solve(data: Data) -> Callable[[], Array]:
        a, b = data["a"], data["b"]

        def call() -> Array:
            x = np.empty_like(b)
            pointers = (a.ctypes.data, b.ctypes.data, x.ctypes.data)
            _good(library.eigen_solve(data.n, b.shape[2], data.lines, *pointers))
            return x

        return call

    def ismm(data: Data) -> Callable[[], Array]:
        arrays = [np.ascontiguousarray(data[name]) for name in ("alpha", "gamma", "k")]

        def call() -> Array:
            x = np.empty_like(arrays[2])
            _good(library.eigen_ismm(data.n, data.lines, *(array.ctypes.data for array in arrays), x.ctypes.data))
            return x

        return call

    operations = {"invert": invert, "solve_1": solve, "solve_n": solve, "ismm": ismm}
    return [Peer("Eigen", f"Eigen {version}, fixed size, g++ {compiler.split()[-1]} {' '.join(_OPTIONS)}", operations)]


def _first_line(*command: str) -> str:
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.partition("\n")[0]
    except (OSError, subprocess.CalledProcessError):
        raise NotThereError(f"{command[0]} is not installed") from None


def _good(code: int) -> None:
    if code:
        raise NotThereError("not compiled for this order")
