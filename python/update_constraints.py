"""Write python/constraints.txt: the newest versions of all that the build, the package and the tests need.

    .venv/bin/python python/update_constraints.py

The versions are those that pip finds for the oldest Python that the package takes. They hold up to the newest Python
for which each of them has a wheel; on a newer one none of them is asked for, and pip takes what it finds.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
CONSTRAINTS = ROOT / "python" / "constraints.txt"
HEAD = """\
# What tests/run, cases/run and build_wheel.sh install. Written by python/update_constraints.py.
# On Python {after} and later, for which some of these have no wheel, they do not apply.
"""
#: Built from source with a library of the system: no wheel to lock.
FROM_SOURCE = ("python-mumps",)


def requirements(project: dict) -> list[str]:
    """Everything that pyproject.toml asks for, build and extras included."""
    groups = project["project"]["optional-dependencies"].values()
    extras = [each for group in groups for each in group if not each.startswith(FROM_SOURCE)]
    return [*project["build-system"]["requires"], *project["project"]["dependencies"], *extras]


def resolve(python: str, wanted: list[str], *options: str) -> dict[str, str] | None:
    """Versions that pip would install for a Python, wheels only; None where it finds none."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [sys.executable, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--dry-run"]
        command += ["--ignore-installed", "--report", str(report), "--target", folder, "--only-binary", ":all:"]
        command += ["--python-version", python, *options, *wanted]
        done = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
        if done.returncode:
            print(f"Python {python}: {done.stderr.strip().splitlines()[-1]}", file=sys.stderr)
            return None
        found = [each["metadata"] for each in json.loads(report.read_text())["install"]]
    return {each["name"].lower().replace("_", "-"): each["version"] for each in found}


def main() -> int:
    """Resolve, find the newest Python, write the file."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    minor = int(project["project"]["requires-python"].removeprefix(">=3."))
    versions = resolve(f"3.{minor}", requirements(project))
    if versions is None:
        return 1
    pins = [f"{name}=={version}" for name, version in sorted(versions.items())]
    after = minor + 1
    while resolve(f"3.{after}", pins, "--no-deps"):
        after += 1
    lines = [f'{pin} ; python_version < "3.{after}"\n' for pin in pins]
    CONSTRAINTS.write_text(HEAD.format(after=f"3.{after}") + "".join(lines))
    print(f"{CONSTRAINTS.relative_to(ROOT)}: {len(pins)} versions, up to Python 3.{after - 1}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
