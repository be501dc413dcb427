"""Environments of Python in build/portability: an interpreter, and versions of all that the package asks for."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import subprocess
import tomllib
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "build" / "portability"
CONSTRAINTS = ROOT / "python" / "constraints.txt"
_PYPROJECT = ROOT / "pyproject.toml"
_PROJECT = tomllib.loads(_PYPROJECT.read_text())
OLDEST = _PROJECT["project"]["requires-python"].removeprefix(">=")
#: From the oldest that the package takes to the newest that the checked-in versions are for.
VERSIONS = tuple(
    f"3.{minor}"
    for minor in range(
        int(OLDEST.split(".")[1]), int(re.search(r'python_version < "3\.(\d+)"', CONSTRAINTS.read_text())[1])
    )
)


class NotMadeError(Exception):
    """Why an environment could not be made."""


@cache
def find_python(version: str) -> str | None:
    """Find an interpreter: PORTABILITY_PYTHONS (a list of paths), PATH, then the versions of pyenv."""
    named = os.environ.get("PORTABILITY_PYTHONS", "").split(os.pathsep)
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    found = [*named, shutil.which(f"python{version}"), *sorted(map(str, pyenv.glob(f"{version}.*/bin/python")))]
    question = 'import ensurepip, sys, sysconfig, pathlib; print("%d.%d" % sys.version_info[:2])\n'
    question += 'assert pathlib.Path(sysconfig.get_path("include"), "Python.h").exists()'
    for python in filter(None, found):
        try:
            done = subprocess.run([python, "-c", question], capture_output=True, text=True, check=False)
        except OSError:
            continue
        if done.returncode == 0 and done.stdout.strip() == version:
            return python
    return None


def requirements(versions: str) -> list[str]:
    """What is installed before the package: for its build, its run, and its tests."""
    extras = _PROJECT["project"]["optional-dependencies"]
    wanted = [*_PROJECT["build-system"]["requires"], *_PROJECT["project"]["dependencies"], *extras["all"]]
    wanted += [each for each in extras["test"] if not each.startswith(("ruff", "mypy", "gcovr", "playwright"))]
    return [each.replace(">=", "==") for each in wanted] if versions == "lowest" else wanted


def make_environment(python: str, versions: str) -> Path:
    """Make or update an environment with the package in it, editable; return its folder of programs.

    Raises
    ------
    NotMadeError
        Something cannot be installed; the message is the end of what pip printed.
    """
    folder = FOLDER / f"python{python}-{versions}"
    programs, stamp = folder / "bin", folder / "made-of"
    wanted = requirements(versions)
    options = ["-c", str(CONSTRAINTS)] if versions == "checked-in" else []
    made_of = hashlib.sha256(
        repr((wanted, options, _PYPROJECT.read_bytes(), CONSTRAINTS.read_bytes(), ROOT)).encode()
    ).hexdigest()
    if stamp.exists() and stamp.read_text() == made_of:
        return programs
    shutil.rmtree(folder, ignore_errors=True)
    _run([find_python(python), "-m", "venv", folder])
    pip = [programs / "python", "-m", "pip", "--disable-pip-version-check", "install", *options]
    environment = os.environ | {"PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}
    _run([*pip, *wanted], env=environment)
    _run([*pip, "--no-build-isolation", "--no-deps", f"-Cbuild-dir={folder / 'meson'}", "-e", ROOT], env=environment)
    stamp.write_text(made_of)
    return programs


def make_programs() -> Path:
    """Build the test programs of the kernel; return the folder of the build."""
    build = FOLDER / "programs"
    if not (build / "build.ninja").exists():
        _run(["meson", "setup", build, ROOT, "-Dlapack=scipy-openblas32", "-Dbuildtype=debug", "-Dchecks=true"])
    _run(["meson", "compile", "-C", build])
    return build


def _run(command: list[str | Path | None], **options: dict[str, str]) -> None:
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **options)
    if done.returncode:
        raise NotMadeError(done.stdout[-3000:])
