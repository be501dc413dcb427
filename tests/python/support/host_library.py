"""The kernel built for the LAPACK of the program, and programs linked to it with one."""

from __future__ import annotations

import os
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

import jointfrf as jf
from host_lapacks import Lapack
from installed_library import PATH, ROOT, run

#: Kept, and brought up to date by each run. Not optimised: they prove how the library is linked, and compile four times
#: as fast.
BUILDS = {False: ROOT / "build" / "host_lapack", True: ROOT / "build" / "host_lapack64"}
TESTS = ROOT / "tests"
#: The test programs of the kernel, without some that call no LAPACK: long ones, and one that must see two threads.
WITHOUT = {"test_lanes", "test_brick", "test_noise", "test_sweep"}
PROGRAMS = [path for path in sorted((TESTS / "fortran").glob("test_*.[fF]90")) if path.stem not in WITHOUT]
SKIPPED = 77


def parameters(lapacks: dict[str, list[Lapack]]) -> list[Any]:
    """Each LAPACK as a parameter of a test; a kind of which there is none as one that is skipped."""
    found = [pytest.param(lapack, id=lapack.name) for kind in lapacks.values() for lapack in kind]
    for kind in (kind for kind, of_kind in lapacks.items() if not of_kind):
        reason = f"no {kind} found, see host_lapacks.py"
        found.append(pytest.param(None, id=kind, marks=pytest.mark.skip(reason=reason)))
    return found


class HostLibrary:
    """The kernel installed without a LAPACK, and objects of programs that use it.

    Where `ilp64`, integers have eight bytes, those of the program and those of its LAPACK.
    """

    def __init__(self, folder: Path, *, ilp64: bool = False) -> None:
        missing = [n for n in ("meson", "pkg-config", "gfortran", "gcc", "nm") if shutil.which(n, path=PATH) is None]
        if missing:
            pytest.skip(f"{', '.join(missing)} not found")
        build, self.name = BUILDS[ilp64], "jointfrf64" if ilp64 else "jointfrf"
        build.parent.mkdir(exist_ok=True)
        with FileLock(build.with_suffix(".lock")):  # processes that test at once take turns
            self._build(build, folder, ilp64=ilp64)
        self.objects = folder / "objects"
        self.objects.mkdir()
        (self.pc,) = (folder / "prefix").rglob(f"{self.name}.pc")
        self.folder = self.pc.parents[1]
        self.flags = run(
            ["pkg-config", "--static", "--cflags", "--libs", self.name], env={"PKG_CONFIG_PATH": str(self.pc.parent)}
        ).split()
        (self.module,) = self.folder.parent.glob(f"include/{self.name}/*/jointfrf.mod")
        # Module files as they are now: another process may bring the build up to date later.
        self.modules = [f"-I{path}" for path in sorted(build.glob("fortran/*.p"))]

    def _build(self, build: Path, folder: Path, *, ilp64: bool) -> None:
        """Bring the build up to date and install it below a folder."""
        if not (build / "build.ninja").exists():
            options = ["-Dilp64=true", "-Dlapack_ilp64=true"] if ilp64 else []
            options += [
                "-Dlapack=host",
                "-Dbuildtype=plain",
                "-Dinstruction_sets=plain",
                "-Dprefix=/prefix",
                "-Dlibdir=lib",
            ]
            run(["meson", "setup", build, ROOT, *options])
        run(["meson", "compile", "-C", build])
        run(["meson", "install", "-C", build, "--no-rebuild", "--destdir", folder])

    def compile(self, source: Path, *flags: str | Path) -> Path:
        compiler = "gcc" if source.suffix == ".c" else "gfortran"
        target = self.objects / f"{source.name}.o"
        standard = ["-std=legacy"] if source.suffix == ".f" else []
        run([compiler, "-c", "-O2", "-ffp-contract=off", *standard, *self.flags, *flags, source, "-o", target])
        return target

    def link(self, lapack: Lapack, target: Path, *objects: Path, shared: bool = False) -> Path:
        """Statically by default; the flags of the LAPACK follow those of the library."""
        flags = self.flags if shared else [f.replace(f"-l{self.name}", f"-l:lib{self.name}.a") for f in self.flags]
        run(["gfortran", "-o", target, *objects, *flags, *lapack.link, "-lgfortran", "-lm", "-lpthread"])
        return target

    def start(self, program: Path, lapack: Lapack, engine: str, threads: int = 1) -> subprocess.CompletedProcess[str]:
        variables = lapack.environment | {"JOINTFRF_ENGINE": engine, "OMP_NUM_THREADS": str(threads)}
        variables["LD_LIBRARY_PATH"] += f"{os.pathsep}{self.folder}"
        environment = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"} | variables
        return subprocess.run([program], capture_output=True, text=True, timeout=900, check=False, env=environment)

    def compile_programs(self) -> dict[str, list[Path]]:
        """Objects of the test programs of the kernel; two of them are compiled at once."""
        common = ["-O0", "-frecursive", "-std=f2018", '-DJF_BLAS_PREFIX=""', *self.modules]
        common.append(f'-DJF_VERSION="{jf.__version__}"')
        testing = self.compile(TESTS / "fortran" / "testing.f90", *common, f"-J{self.objects}")

        def compile_program(source: Path) -> list[Path]:
            modules = self.objects / source.stem
            modules.mkdir()
            return [self.compile(source, *common, f"-I{self.objects}", f"-J{modules}"), testing]

        with ThreadPoolExecutor(2) as pool:
            return dict(zip((path.stem for path in PROGRAMS), pool.map(compile_program, PROGRAMS), strict=True))

    def failures(self, lapack: Lapack, programs: dict[str, list[Path]], folder: Path) -> dict[tuple[str, str], str]:
        """What the programs print that do not pass, by name and engine: on two threads, with lanes and without."""
        failed = {}
        for name, objects in programs.items():
            program = self.link(lapack, folder / name, *objects)
            for engine in ("auto", "lapack"):
                done = self.start(program, lapack, engine, threads=2)
                if done.returncode not in (0, SKIPPED):
                    failed[name, engine] = done.stdout + done.stderr
        return failed
