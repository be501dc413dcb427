"""The LAPACKs of this machine, and what a program needs to be linked to each and run with it.

They are looked for in the folders of the environment variable JOINTFRF_LAPACK_DIRS and all below them, then in
LD_LIBRARY_PATH and where Debian, Fedora, oneAPI and the wheels of MKL put them.
"""

from __future__ import annotations

import os
import sys
import sysconfig
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

#: What a static OpenBLAS must be asked for, so that its threads are held (fortran/runtime/blas_threads.c).
THREAD_CONTROL = "-Wl,-u,openblas_get_parallel"
#: Words that tell other libraries from the reference one, which may have the same name: Debian's BLIS is a
#: libblas.so.3, too, which hides its own functions but names its source files.
OTHERS = (b"openblas", b"flexiblas", b"bli_", b"mkl_", b"ATL_")


@dataclass(frozen=True)
class Lapack:
    """One LAPACK with its BLAS: files to link to, more arguments for the linker, folders and variables for the run."""

    name: str
    files: tuple[Path, ...]
    arguments: tuple[str, ...] = ()
    variables: dict[str, str] = field(default_factory=dict)
    folders: tuple[Path, ...] = ()
    holds: bool = False  #: it is known to have threads that the kernel holds

    @property
    def link(self) -> list[str | Path]:
        return [*self.arguments, *self.files]

    @property
    def environment(self) -> dict[str, str]:
        folders = [str(folder) for folder in (*(file.parent for file in self.files), *self.folders)]
        return {"LD_LIBRARY_PATH": os.pathsep.join(folders), **self.variables}


def split(variable: str) -> list[Path]:
    return [Path(folder) for folder in os.environ.get(variable, "").split(os.pathsep) if folder]


def places() -> list[Path]:
    """Every folder to look into, in order."""
    found = [folder for top in split("JOINTFRF_LAPACK_DIRS") for folder in [top, *sorted(top.rglob("*/"))]]
    found += split("LD_LIBRARY_PATH")
    multiarch = sysconfig.get_config_var("MULTIARCH") or ""
    for top in (Path("/usr/local/lib"), Path("/usr/lib") / multiarch, Path("/usr/lib64"), Path("/usr/lib")):
        kinds = ("pthread", "openmp", "serial")
        names = ["", "lapack", "blas", "lapack64", "blas64"]
        names += [f"{blas}-{kind}" for blas in ("openblas", "openblas64", "blis") for kind in kinds]
        found += [top / name for name in names]
    found += [Path("/opt/intel/oneapi/mkl/latest/lib"), Path("/opt/intel/oneapi/compiler/latest/lib")]
    found += [Path(sys.prefix) / "lib"]
    return [folder for folder in dict.fromkeys(found) if folder.is_dir()]


def find(folders: list[Path], *patterns: str) -> Iterator[Path]:
    """In each folder the first file that fits, but no file twice under different names."""
    seen = set()
    for folder in folders:
        files = (file for pattern in patterns for file in sorted(folder.glob(pattern), reverse=True))
        first = next((file for file in files if file.is_file()), None)
        if first is not None and first.resolve() not in seen:
            seen.add(first.resolve())
            yield first


def of_netlib(folders: list[Path], name: str) -> Path | None:
    """The first library of a name that is the reference one."""
    files = (file for file in find(folders, name) if not any(word in file.read_bytes() for word in OTHERS))
    return next(files, None)


def reference(folders: list[Path], suffix: str, bits: str = "") -> Lapack | None:
    lapack, blas = (of_netlib(folders, name + bits + suffix) for name in ("liblapack", "libblas"))
    if lapack is None or blas is None:
        return None
    return Lapack(f"reference{bits}{suffix}", (lapack, blas))


def openblas(folders: list[Path], bits: str = "") -> Iterator[Lapack]:
    """How one was built shows in the functions that it has: with threads of its own, those of OpenMP, or none.

    Built for one thread, it must not be called from several: their results are wrong now and then.
    """
    name = "libopenblas" + bits
    for pattern, arguments in ((f"{name}*.so.0", ()), (f"{name}.so", ()), (f"{name}.a", (THREAD_CONTROL,))):
        for file in (file for file in find(folders, pattern) if bits or "64" not in file.name):
            name = f"OpenBLAS {file.parent.name} {file.name}"
            yield Lapack(name, (file,), arguments, holds=b"exec_blas_async" in file.read_bytes())


def mkl(folders: list[Path], interface: str = "LP64") -> Iterator[Lapack]:
    file = next(find(folders, "libmkl_rt.so*"), None)
    if file is None:
        return
    intel = next(find(folders, "libiomp5.so"), None)
    for layer in ("SEQUENTIAL", "GNU", "INTEL"):
        if layer != "INTEL" or intel is not None:
            more = (intel.parent,) if intel is not None else ()
            variables = {"MKL_THREADING_LAYER": layer, "MKL_INTERFACE_LAYER": interface}
            yield Lapack(f"MKL {interface} {layer}", (file,), (), variables, more, holds=layer != "SEQUENTIAL")


def blis(folders: list[Path]) -> Iterator[Lapack]:
    """BLIS brings a BLAS only; the LAPACK above it is the reference one, of which the BLAS, if it is there, comes last.

    Where its threads have to share processors, each product of small matrices waits for them. The kernel holds them
    where it finds the functions for it: a libblis exports them, the libblas.so.3 of Debian's BLIS does not.
    """
    lapack, blas = of_netlib(folders, "liblapack.so.3"), of_netlib(folders, "libblas.so.3")
    for file in find(folders, "libblis*.so.*", "libblis.so"):
        if lapack is not None:
            files = (file, lapack) if blas is None else (file, lapack, blas)
            threaded = file.parent.name in ("blis-pthread", "blis-openmp")
            name = f"BLIS {file.parent.name} {file.name}"
            yield Lapack(name, files, (), {"BLIS_NUM_THREADS": "1"}, holds=threaded)


def find_lapacks(*, ilp64: bool = False) -> dict[str, list[Lapack]]:
    """What there is of each kind, with integers of four bytes or of eight."""
    folders = places()
    bits = "64" if ilp64 else ""
    references = [reference(folders, suffix, bits) for suffix in (".so.3", ".a")]
    if ilp64:
        return {
            "reference LAPACK of eight-byte integers": [lapack for lapack in references if lapack is not None],
            "OpenBLAS of eight-byte integers": list(openblas(folders, bits)),
            "MKL of eight-byte integers": list(mkl(folders, "ILP64")),
        }
    return {
        "reference LAPACK": [lapack for lapack in references if lapack is not None],
        "OpenBLAS": list(openblas(folders)),
        "MKL": list(mkl(folders)),
        "BLIS": list(blis(folders)),
    }
