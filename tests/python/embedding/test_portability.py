"""The command that runs the numerical tests elsewhere: how it counts, and what it installs."""

import configparser
import os
import re
import runpy
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

TESTS = Path(__file__).resolve().parents[2]
ROOT = TESTS.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
ASKED = [
    Requirement(text)
    for group in (
        PROJECT["build-system"]["requires"],
        PROJECT["project"]["dependencies"],
        *PROJECT["project"]["optional-dependencies"].values(),
    )
    for text in group
]
FROM_SOURCE = runpy.run_path(str(ROOT / "python" / "update_constraints.py"))["FROM_SOURCE"]


@pytest.fixture
def portability(monkeypatch):
    monkeypatch.syspath_prepend(str(TESTS))
    import portability.__main__

    return portability


SUITE = '<testsuites><testsuite tests="{}" failures="{}" errors="{}" skipped="{}"/></testsuites>'


@pytest.mark.parametrize(
    ("suite", "status", "expected"),
    [
        ((9, 0, 0, 2), 0, (7, 0, 2)),
        ((9, 1, 2, 2), 1, (4, 3, 2)),
        ((9, 0, 0, 2), 1, (7, 1, 2)),  # something else went wrong
        ((2, 0, 0, 2), 0, (0, 1, 2)),  # nothing was tested
        (None, 0, (0, 1, 0)),
    ],
)
def test_what_went_wrong_is_counted(portability, tmp_path, suite, status, expected):
    if suite:
        (tmp_path / "junit.xml").write_text(SUITE.format(*suite))
    found = portability.__main__.count(tmp_path / "junit.xml", status, 3.0)
    assert (found.passed, found.failed, found.skipped, found.seconds) == (*expected, 3.0)


def test_lowest_versions_are_those_of_pyproject(portability):
    lowest = [Requirement(text) for text in portability.environments.requirements("lowest")]
    assert {"numpy", "scipy", "pyuff", "meson-python", "pytest"} < {each.name for each in lowest}
    bounds = {each.name: str(each.specifier).replace(">=", "==") for each in ASKED if each.specifier}
    assert {each.name: str(each.specifier) for each in lowest if each.name != "ninja"} == {
        each.name: bounds[each.name] for each in lowest if each.name != "ninja"
    }


def test_pythons(portability):
    assert portability.environments.VERSIONS[0] == portability.environments.OLDEST == "3.11"
    assert portability.environments.find_python("3.99") is None
    assert os.access(TESTS / "portability" / "run", os.X_OK)


def test_other_machines_are_rows_where_their_tools_are(portability, monkeypatch):
    monkeypatch.setenv("PATH", "")
    rows = [row for row in portability.configurations.configurations() if row.machine]
    assert [row.name for row in rows] == [
        *("Linux on arm64, package", "Linux on arm64, programs", "Windows, package", "Windows, programs")
    ]
    assert not any(row.is_here for row in rows)
    for machine in portability.machines.MACHINES:
        assert len(machine.tools) == len(machine.packages)
        for package in machine.packages:
            assert package in portability.__main__.ABOUT
        file = configparser.ConfigParser()
        file.read(TESTS / "portability" / "machine-files" / machine.file)
        named = {file["binaries"][key].strip("'") for key in ("c", "cpp", "fortran", "exe_wrapper")}
        assert named == set(machine.tools)


def test_checked_in_versions_are_those_that_are_asked_for():
    lines = [line for line in (ROOT / "python" / "constraints.txt").read_text().splitlines() if line[:1] != "#"]
    pinned = {each.name: each for each in map(Requirement, lines)}
    for each in ASKED:
        if each.name in FROM_SOURCE:
            continue
        (pin,) = pinned[each.name].specifier
        assert pin.operator == "=="
        assert each.specifier.contains(pin.version), each
    assert len({str(each.marker) for each in pinned.values()}) == 1
    assert re.fullmatch(r'python_version < "3\.\d+"', str(pinned["numpy"].marker))
