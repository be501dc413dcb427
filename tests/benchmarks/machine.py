"""The machine: what it is called, what it can do at best, and the library that measures this."""

from __future__ import annotations

import ctypes
import math
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any, get_args

import numpy as np
from threadpoolctl import threadpool_info

from jointfrf.kernel.call import Engine

ROOT = Path(__file__).resolve().parents[2]
#: JOINTFRF_BENCHMARK_BUILD names another folder, in which meson was set up with other options.
BUILD = Path(os.environ.get("JOINTFRF_BENCHMARK_BUILD") or ROOT / "build" / "benchmarks")
_TARGET = "jointfrf_benchmark"
#: Whose BLAS it is that lies in a folder of this name.
_BLAS_OWNERS = {"numpy.libs": "numpy", "scipy.libs": "scipy", "scipy_openblas32": "jointfrf and the loop"}
#: Memory gone through when the bandwidth is measured, bytes; a few sizes, or all.
QUICK_SIZES = tuple(2**k for k in range(14, 27, 4))
SIZES = tuple(2**k for k in range(14, 29))


def build_kernel() -> Path:
    """Build the kernel as a shared library where it is not up to date; return the folder it lies in."""
    _build("jointfrf:shared_library")
    return BUILD / "fortran"


def _build(target: str) -> None:
    if not (BUILD / "build.ninja").exists():
        _meson("setup", str(BUILD), str(ROOT), "-Dlapack=scipy-openblas32")
    _meson("compile", "-C", str(BUILD), target)


def build_library() -> ctypes.CDLL:
    """Build the library with meson where it is not up to date, and load it."""
    _build(_TARGET)
    found = [path for path in BUILD.rglob(f"*{_TARGET}*") if path.suffix in (".so", ".dylib")]
    if len(found) != 1:
        raise RuntimeError(f"{BUILD}: the library {_TARGET} is not there")
    library = ctypes.CDLL(str(found[0]))
    library.machine_peak.restype = library.machine_bandwidth.restype = ctypes.c_double
    library.machine_bandwidth.argtypes = [ctypes.c_size_t, ctypes.c_int]
    library.generator_rate.restype = ctypes.c_double
    library.generator_rate.argtypes = [ctypes.c_int, ctypes.c_int]
    library.loop_invert.argtypes = [ctypes.c_int, ctypes.c_long, ctypes.c_void_p, ctypes.c_void_p]
    library.loop_solve.argtypes = [ctypes.c_int, ctypes.c_int, ctypes.c_long, *[ctypes.c_void_p] * 3]
    return library


def _meson(*arguments: str) -> None:
    meson = shutil.which("meson", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}")
    if meson is None:
        raise RuntimeError("meson is not there: start tests/benchmarks/run, which installs it")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    done = subprocess.run([meson, *arguments], capture_output=True, text=True, env={**os.environ, "PATH": path})
    if done.returncode:
        raise RuntimeError(f"meson {arguments[0]} failed:\n{done.stdout[-3000:]}{done.stderr[-1000:]}")


@dataclass
class Limits:
    """What so many threads can do at best.

    Attributes
    ----------
    threads : int
    peak : dict of str to float
        Floating-point operations a second by width of the registers in bits.
    bandwidth : list of (int, float)
        Memory gone through in bytes, and bytes read and written a second.
    normals : float
        Complex normal numbers a second that the kernel's random generator makes.
    """

    threads: int
    peak: dict[str, float] = field(default_factory=dict)
    bandwidth: list[tuple[int, float]] = field(default_factory=list)
    normals: float = math.inf

    @property
    def best_peak(self) -> float:
        """Operations a second with the best registers."""
        return max(self.peak.values())

    def seconds(self, flops: float, moved: float, memory: float, normals: float = 0.0) -> float:
        """Return the least time for so many operations, bytes and random numbers, where the data take so much memory.

        The bandwidth is that of the cache which holds the data, or of the memory.
        """
        sizes, rates = np.array(self.bandwidth).T
        # A smaller size is never slower by nature: what was measured so was disturbed.
        rates = np.maximum.accumulate(rates[::-1])[::-1]
        rate = np.exp(np.interp(np.log(memory), np.log(sizes), np.log(rates)))
        return float(max(flops / self.best_peak, moved / rate, normals / self.normals))


def measure_limits(library: ctypes.CDLL, threads: int, sizes: Sequence[int] = SIZES, engine: Engine = "auto") -> Limits:
    """Measure the peak for every width of registers, the bandwidth for so much memory, and an engine's generator."""
    limits = Limits(threads)
    for width in (16, 32, 64):
        rate = library.machine_peak(width, threads)
        if rate > 0:
            limits.peak[str(8 * width)] = rate
    limits.bandwidth = [(size, library.machine_bandwidth(size, threads)) for size in sizes]
    limits.normals = library.generator_rate(get_args(Engine).index(engine), threads)
    return limits


def best_of(one: Limits, other: Limits) -> Limits:
    """Return the better of two measurements: whatever disturbs makes them worse."""
    peak = {bits: max(rate, other.peak[bits]) for bits, rate in one.peak.items()}
    rates = [(size, max(rate, b)) for (size, rate), (_, b) in zip(one.bandwidth, other.bandwidth, strict=True)]
    return Limits(one.threads, peak, rates, max(one.normals, other.normals))


def as_dict(limits: Limits) -> dict[str, Any]:
    """Return limits as JSON knows them."""
    return {**asdict(limits), "best_peak": limits.best_peak}


def _first_line(*command: str) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return done.stdout.partition("\n")[0].strip()


def processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def blas_kernels() -> dict[str, str]:
    """Return which kernels each BLAS of this process runs on, as threadpoolctl finds it, by whose it is."""
    found = {}
    for one in threadpool_info():
        if one["user_api"] == "blas":
            path = Path(one["filepath"])
            owner = next((name for folder, name in _BLAS_OWNERS.items() if folder in path.parts), path.name)
            words = (one["internal_api"], one.get("version"), one.get("architecture"))
            found[owner] = " ".join(str(word) for word in words if word)
    return found


def usable_cores() -> int:
    """Return how many cores this process may run on: fewer than there are where it is pinned."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def describe() -> dict[str, Any]:
    """Return what the machine and the programs on it are called."""
    return {
        "processor": processor(),
        "cores": os.cpu_count(),
        "usable_cores": usable_cores(),
        "system": f"{platform.system()} {platform.machine()}",
        "load": [round(load, 2) for load in os.getloadavg()] if hasattr(os, "getloadavg") else [],
        "fortran": _first_line(os.environ.get("FC", "gfortran"), "--version"),
        "python": platform.python_version(),
        **{name: version(name) for name in ("jointfrf", "numpy", "scipy", "scipy-openblas32")},
        "blas": blas_kernels(),
        "commit": _first_line("git", "--no-optional-locks", "-C", str(ROOT), "describe", "--always", "--dirty"),
    }
