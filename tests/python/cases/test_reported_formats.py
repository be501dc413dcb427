"""Files of situations that users of neighbouring tools reported: read rightly with what the command line states."""

import json

import pytest

from command import run_command
from shared_data import shared_data

MASSES = ["--j", "101", "--k", "201", "--dofs", "z"]
ARM = ["--j", "1", "--k", "1001", "--dofs", "z"]
BARS = ["--j", "101,102", "--k", "201,202", "--dofs", "y,rz", "--bending-stiffness", "2362.5"]
LINE = ["--spacing", "0.02", "--axis", "x", "--quantity", "accelerance"]
NAMES = "101:y,102:y,103:y,201:y,202:y,203:y"
PAIRS = ["--map", "responses=101:z,101:z,201:z,201:z", "--map", "excitations=101:z,201:z,101:z,201:z"]
READ = [
    ("07-*/give-frfs-and-spectrum.mat", MASSES, {"k_z": 8e4, "c_z": 12}, "1 of type FrequencySpectrum"),
    ("08-*/give-four-functions.mat", [*MASSES, "--map", "direction=z"], {"k_z": 8e4, "c_z": 12}, ""),
    ("08-*/give-four-functions.mat", [*MASSES, *PAIRS], {"k_z": 8e4, "c_z": 12}, ""),
    ("09-*/give-400-lines.uff", MASSES, {"k_z": 8e4, "c_z": 12}, ""),
    ("10-*/give.uff", [*ARM, "--map", "components=frame:0,arm:1000"], {"k_z": 8e4, "c_z": 12}, ""),
    ("11-*/give.uff", [*MASSES, "--map", "direction=z"], {"k_z": 8e4, "c_z": 12}, ""),
    ("14-*/give-three-blanks-after.unv", MASSES, {"k_z": 8e4, "c_z": 12}, ""),
    ("15-*/give.uff", MASSES, {"k_z": 8e4, "c_z": 12}, ""),
    ("u09-*/18_duplicate_differs.uff", BARS, {"k_y": 1e7, "k_theta_z": 5e3}, "differ by up to 20 % (101:+y / 201:+y"),
    (
        "u12-*/52_plain.mat",
        [*BARS, *LINE, "--unit", "(m/s^2)/N", "--map", f"responses={NAMES}", "--map", f"excitations={NAMES}"],
        {"k_y": 1e7, "k_theta_z": 5e3},
        "",
    ),
]
REJECTED = [
    ("07-*/give-spectrum-alone.mat", MASSES, "no FRF, but functions (1 of type FrequencySpectrum); export FRFs"),
    ("08-*/give-four-functions.mat", MASSES, "has no direction of node 101 in its responses; give --map direction=z"),
    ("10-*/give.uff", ARM, "number them apart by --map components=frame:0,arm:1000"),
    ("11-*/give.uff", MASSES, "it names no response direction (code 0); give --map direction=z"),
    ("16-*/give.uff", MASSES, "FRF 201:+z / 201:+z is left out: NaN or Inf on 1 of 400 lines, first at 10 Hz"),
    ("u12-*/52_plain.mat", BARS, "give --map responses=... and --map excitations=..., such as 1:x,2:x"),
]


def found(pattern):
    return next(shared_data("reports").glob(pattern))


@pytest.mark.parametrize(("pattern", "words", "expected", "warning"), READ)
def test_the_joint_of_a_report_is_found(pattern, words, expected, warning):
    result = run_command("identify", found(pattern), *words, "--json")
    assert result.returncode == 0, result.stderr
    assert warning in result.stderr
    (fit,) = json.loads(result.stdout)["fits"]
    for name, value in expected.items():
        assert fit["parameters"][name]["value"] == pytest.approx(value, rel=0.03)


@pytest.mark.parametrize(("pattern", "words", "message"), REJECTED)
def test_what_a_report_lacks_is_asked_for(pattern, words, message):
    result = run_command("identify", found(pattern), *words)
    assert result.returncode == 1
    assert message in result.stderr


def test_a_check_continues_without_the_frf_that_is_not_finite():
    """Its exit status is that of a finding: an FRF is missing."""
    result = run_command("check", found("16-*/give.uff"), *MASSES)
    assert "201:+z / 201:+z is left out" in result.stderr
    assert "1 of 4 FRFs missing" in result.stdout
