"""`jointfrf check` on the simulated hammer test, as it is and with errors."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from command import run_command
from jointfrf.io import read_uff, write_uff

BARS = Path(__file__).resolve().parents[3] / "cases" / "hammer-test" / "two_bars.uff"
JOINT_OF_BARS = ["--j", "101,102", "--k", "201,202", "--dofs", "y,theta_z"]


@pytest.fixture
def wrong(tmp_path):
    """The sign of the sensor at point 102 turned."""
    frfs = read_uff(BARS)
    h = frfs.h.copy()
    h[:, [str(channel) for channel in frfs.responses].index("102:+y")] *= -1
    file = tmp_path / "wrong.uff"
    write_uff(file, replace(frfs, h=h))
    return file


@pytest.mark.parametrize("words", [[], JOINT_OF_BARS, [*JOINT_OF_BARS, "--band", "100:800"]])
def test_good_data(words):
    result = run_command("check", BARS, *words)
    assert (result.returncode, result.stderr) == (0, "")
    assert "nothing found" in result.stdout


@pytest.mark.parametrize("words", [[], JOINT_OF_BARS])
def test_an_error_is_named_with_its_channel(wrong, words):
    result = run_command("check", wrong, *words)
    assert result.returncode == 1
    (line,) = [line for line in result.stdout.splitlines() if line.startswith("error")]
    assert "sign: the response of 102:+y points against the force" in line


def test_identify_says_it_too(wrong):
    result = run_command("identify", wrong, *JOINT_OF_BARS)
    said = [line for line in result.stderr.splitlines() if "sign: the response of 102:+y" in line]
    assert len(said) == 1
    assert said[0].startswith("jointfrf: warning:")


def test_frfs_that_are_missing(tmp_path):
    frfs = read_uff(BARS)
    h = frfs.h.copy()
    h[:, 0, 1] = np.nan
    file = tmp_path / "part.uff"
    write_uff(file, replace(frfs, h=h))
    result = run_command("check", file)
    assert result.returncode == 1
    assert "1 FRFs are missing" in result.stderr
    assert "--j" in result.stderr
