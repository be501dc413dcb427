"""The library as `meson install` leaves it, and programs linked to it by pkg-config."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from filelock import FileLock

ROOT = Path(__file__).resolve().parents[3]


@dataclass(frozen=True)
class Build:
    """A folder below build/ that is kept and brought up to date by each run, and how it is set up."""

    folder: str
    options: tuple[str, ...]
    name: str = "jointfrf"


#: As a user builds it.
OPTIMISED = Build("installed", ("-Dtests=false",))
#: Those whose test programs `tests/run` runs: alike but for the length of integers, in bytes.
_CHECKED = ("-Dbuildtype=debug", "-Doptimization=1", "-Dchecks=true", "-Dinstruction_sets=plain")
CHECKED = {4: Build("tests", _CHECKED), 8: Build("tests64", (*_CHECKED, "-Dilp64=true"), "jointfrf64")}
#: Where meson and ninja lie, too, if the environment of this Python is not activated.
PATH = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
#: Nothing may be contracted: the last bit is compared.
COMPILERS = {
    ".f": ["gfortran", "-std=legacy"],
    ".f90": ["gfortran", "-std=f2018"],
    ".c": ["gcc", "-std=c11"],
}
FLAGS = ["-Wall", "-Wextra", "-Werror", "-O2", "-ffp-contract=off"]


def run(command: list[str | Path], **options: Any) -> str:
    """Run a command; where it fails, the test shows all that it printed."""
    environment = os.environ | {"PATH": PATH} | options.pop("env", {})
    done = subprocess.run(command, capture_output=True, text=True, timeout=900, env=environment, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@dataclass(frozen=True)
class InstalledLibrary:
    """An installation prefix, and which of the libraries below it."""

    prefix: Path
    name: str = "jointfrf"

    def pkg_config(self, *arguments: str) -> list[str]:
        (file,) = self.prefix.rglob(f"{self.name}.pc")
        return run(["pkg-config", *arguments, self.name], env={"PKG_CONFIG_PATH": str(file.parent)}).split()

    def compile(self, source: Path, program: Path, *flags: str) -> Path:
        """Compile one source file as a user would, against nothing but what is installed."""
        (module_dir,) = self.pkg_config("--variable=moduledir")
        (lib_dir,) = self.pkg_config("--variable=libdir")
        modules = [f"-I{module_dir}"] if source.suffix == ".f90" else []
        libraries = [*self.pkg_config("--cflags", "--libs"), "-lm", f"-Wl,-rpath,{lib_dir}"]
        run([*COMPILERS[source.suffix], *FLAGS, *flags, *modules, "-o", program, source, *libraries])
        return program


def install(build: Build, destination: Path) -> InstalledLibrary:
    """Build, and install below a folder. Tests that run at once take turns."""
    tools = ("meson", "pkg-config", "gfortran", "gcc")
    missing = [name for name in tools if shutil.which(name, path=PATH) is None]
    if missing:
        pytest.skip(f"{', '.join(missing)} not found")
    folder = ROOT / "build" / build.folder
    folder.parent.mkdir(exist_ok=True)
    with FileLock(folder.with_suffix(".lock")):
        if not (folder / "build.ninja").exists():
            lapack = ("-Dlapack=scipy-openblas32", f"-Dlapack_python={sys.executable}")
            run(["meson", "setup", folder, ROOT, *lapack, *build.options])
        run(["meson", "compile", "-C", folder])
        run(["meson", "install", "-C", folder, "--no-rebuild", "--destdir", destination])
    (file,) = destination.rglob(f"{build.name}.pc")
    (prefix,) = (folder for folder in file.parents if (folder / "include").is_dir())
    return InstalledLibrary(prefix, build.name)


@pytest.fixture(scope="session")
def installed_library(tmp_path_factory: pytest.TempPathFactory) -> InstalledLibrary:
    """Install to a folder of this run."""
    return install(OPTIMISED, tmp_path_factory.mktemp("installed"))
