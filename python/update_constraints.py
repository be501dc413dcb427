"""Write python/constraints.txt: the newest versions of all that the build, the package and the tests need.

    .venv/bin/python python/update_constraints.py           newest versions, and their hashes
    .venv/bin/python python/update_constraints.py hashes    hashes of the versions that are there

The versions are those that pip finds for the oldest Python that the package takes. They hold up to the newest Python
for which each of them has a wheel; on a newer one none of them is asked for, and pip takes what it finds.

Hashes of all files of a version, for every system, are those that `uv pip compile` lists: `pip install uv` first. They
stand in comments, because pip takes constraints with hashes only where every requirement is pinned;
python/check_hashes.py compares them with what was installed.
"""

from __future__ import annotations

import json
import re
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
# Below each: SHA-256 of its files, with which python/check_hashes.py compares what was installed.
"""
#: Hashes in a line.
A_LINE = 2
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


def hashes(pins: list[str]) -> dict[str, list[str]]:
    """SHA-256 of all files of each version."""
    command = ["uv", "pip", "compile", "--quiet", "--no-deps", "--generate-hashes", "--no-header", "--no-annotate"]
    text = subprocess.run([*command, "--universal", "-"], input="\n".join(pins), stdout=subprocess.PIPE, text=True,
                          check=True).stdout  # fmt: skip
    found: dict[str, list[str]] = {}
    for line in text.splitlines():
        if pin := re.match(r"([\w.-]+==[^\s;\\]+)", line):
            own = found.setdefault(pin[1], [])
        own += re.findall(r"sha256:([0-9a-f]{64})", line)
    return found


def write(pins: list[str], after: str) -> None:
    """Write the file."""
    text, known = HEAD.format(after=after), hashes(pins)
    for pin in pins:
        text += f'{pin} ; python_version < "{after}"\n'
        for at in range(0, len(known[pin]), A_LINE):
            text += f"#   {' '.join(known[pin][at : at + A_LINE])}\n"
    CONSTRAINTS.write_text(text)


def main() -> int:
    """Resolve, find the newest Python, write the file."""
    if sys.argv[1:] == ["hashes"]:
        held = re.findall(r'^(\S+==\S+) ; python_version < "(.*)"$', CONSTRAINTS.read_text(), re.MULTILINE)
        write([pin for pin, _ in held], held[0][1])
        return 0
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    minor = int(project["project"]["requires-python"].removeprefix(">=3."))
    versions = resolve(f"3.{minor}", requirements(project))
    if versions is None:
        return 1
    pins = [f"{name}=={version}" for name, version in sorted(versions.items())]
    after = minor + 1
    while resolve(f"3.{after}", pins, "--no-deps"):
        after += 1
    write(pins, f"3.{after}")
    print(f"{CONSTRAINTS.relative_to(ROOT)}: {len(pins)} versions, up to Python 3.{after - 1}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
