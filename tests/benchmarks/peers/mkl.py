"""MKL: the bare loop over LAPACK, and the compact routines, which compute several matrices side by side."""

from __future__ import annotations

import ctypes
import hashlib
import os
from collections.abc import Callable
from ctypes.util import find_library
from functools import partial
from importlib.metadata import PackageNotFoundError, files
from pathlib import Path

import numpy as np

from ..data import Array, Data, random_lines
from ..measure import call_repeatedly
from .peer import NotThereError, Peer, compiled

_LOOP = Path(__file__).parents[1] / "lapack_loop.c"
_COMPACT = Path(__file__).with_name("mkl_compact.c")
#: What the widths of registers are compared with.
_PROBE_LINES, _PROBE_ORDER, _PROBES = 500, 6, 15


def load(build: Path) -> list[Peer]:
    """Compile the loops against the MKL that is installed, and load them."""
    # One thread; what the environment says about its kernels, MKL would believe.
    os.environ["MKL_THREADING_LAYER"] = "SEQUENTIAL"
    for name in ("MKL_ENABLE_INSTRUCTIONS", "MKL_DEBUG_CPU_TYPE", "MKL_CBWR"):
        os.environ.pop(name, None)
    mkl = _library()
    command = ["cc", "-O3", "-shared", "-fPIC", "-DJF_BLAS_SYMBOL_PREFIX=", str(_LOOP), str(_COMPACT), str(mkl)]
    command += [f"-Wl,-rpath,{mkl.parent}"]
    key = hashlib.sha256(" ".join([*command, _LOOP.read_text(), _COMPACT.read_text()]).encode()).hexdigest()[:12]
    try:
        library = ctypes.CDLL(str(compiled(command, build / f"mkl_{key}.so")))
    except OSError as error:
        raise NotThereError(str(error)) from None
    pointer = ctypes.c_void_p
    for kind in ("loop", "compact"):
        getattr(library, f"{kind}_invert").argtypes = [ctypes.c_int, ctypes.c_long, pointer, pointer]
        getattr(library, f"{kind}_solve").argtypes = [ctypes.c_int, ctypes.c_int, ctypes.c_long, *[pointer] * 3]
    library.mkl_name.argtypes = [ctypes.c_char_p, ctypes.c_size_t]
    text = ctypes.create_string_buffer(256)
    library.mkl_name(text, 256)
    version = text.value.decode().replace("(R)", "")
    bits = _fastest_width(library)
    return [
        Peer("MKL loop", version, _operations(library, "loop")),
        Peer("MKL compact", f"{version}, {bits} bits, no row exchanges", _operations(library, "compact")),
    ]


def _fastest_width(library: ctypes.CDLL) -> int:
    """Choose the registers with which the compact inverse is fastest; return their bits."""
    a = random_lines(np.random.default_rng(0), _PROBE_LINES, _PROBE_ORDER, _PROBE_ORDER)
    x = np.empty_like(a)
    seconds = {}
    for bits in (128, 256, 512):
        if library.compact_use(bits) == 0:
            call = partial(library.compact_invert, _PROBE_ORDER, _PROBE_LINES, a.ctypes.data, x.ctypes.data)
            seconds[bits] = min(call_repeatedly(call, 1) for _ in range(_PROBES))
    best = min(seconds, key=lambda bits: seconds[bits])
    library.compact_use(best)
    return best


def _library() -> Path:
    try:
        found = [file for file in files("mkl") or [] if file.name.startswith(("libmkl_rt.so", "libmkl_rt.dylib"))]
    except PackageNotFoundError:
        found = []
    for file in found:
        path = Path(str(file.locate())).resolve()
        if path.exists():
            return path
    named = find_library("mkl_rt")
    if named is None:
        raise NotThereError("no libmkl_rt (.venv/bin/pip install mkl)")
    return Path(named)


def _operations(library: ctypes.CDLL, kind: str) -> dict[str, Callable[[Data], Callable[[], Array]]]:
    inverse, solution = getattr(library, f"{kind}_invert"), getattr(library, f"{kind}_solve")

    def invert(data: Data) -> Callable[[], Array]:
        a = data["a"]

        def call() -> Array:
            x = np.empty_like(a)
            assert inverse(data.n, data.lines, a.ctypes.data, x.ctypes.data) == 0
            return x

        return call

    def solve(data: Data) -> Callable[[], Array]:
        a, b = data["a"], data["b"]

        def call() -> Array:
            x = np.empty_like(b)
            assert solution(data.n, b.shape[2], data.lines, a.ctypes.data, b.ctypes.data, x.ctypes.data) == 0
            return x

        return call

    return {"invert": invert, "solve_1": solve, "solve_n": solve}
