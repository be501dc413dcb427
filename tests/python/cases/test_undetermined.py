"""What is not determined, or far too large, is a word wherever people read it; numpy warns nobody."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from command import run_command
from jointfrf.identification.result import is_undetermined

BARS = Path(__file__).resolve().parents[3] / "cases" / "hammer-test" / "two_bars.uff"


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (-np.inf, np.inf, True), (0.0, np.inf, True), (np.inf, np.inf, True), (np.nan, np.nan, True),
        (1.0, np.inf, False), (0.0, 1.0, False), (-1.0, 1.0, False),
    ],
)  # fmt: skip
def test_an_interval_without_a_bound_is_undetermined(low, high, expected):
    assert is_undetermined(low, high) == expected


def test_a_table_has_a_word_for_it():
    fit = jf.Fit.of_springs("compliance", ("x",), {"k_x": 2e5, "c_x": 3.0}, np.diag([1e6, 1.0]), 0.01, 0.01, np.ones(3))
    limits = {"k_x": (1e5, np.inf), "c_x": (-np.inf, np.inf)}
    rows = str(replace(fit, intervals=lambda _: limits)).splitlines()
    (k,) = (row.split() for row in rows if row.startswith("k_x"))
    (c,) = (row.split() for row in rows if row.startswith("c_x"))
    assert k[:2] == ["k_x", "~2e+05"]
    assert c == ["c_x", "undetermined", "N", "s/m"]


def test_frfs_of_another_quantity_give_no_warning_of_numpy_and_no_inf():
    """Accelerances called receptances."""
    words = ("--quantity", "receptance", "--force-quantity", "--j", "101,102", "--k", "201,202", "--dofs", "y,rz")
    result = run_command("identify", BARS, *words)
    assert "encountered" not in result.stderr
    for text in (result.stdout, result.stderr):
        assert "inf %" not in text
        assert "inf .. inf" not in text
        assert max(map(len, text.split()), default=0) < 100


def test_points_far_from_the_joint_are_named():
    words = ("--dofs", "y,rz")
    result = run_command("identify", BARS, "--j", "101,102,103", "--k", "201,202,203", *words)
    assert "reference points 255 mm apart" in result.stderr
    assert "use --j 101,102 --k 201,202" in result.stderr
    assert "reference points" not in run_command("identify", BARS, "--j", "101,102", "--k", "201,202", *words).stderr


def test_a_narrow_band_about_a_resonance_warns_of_nothing():
    """|h| goes with a power of w in the hundreds within 1 % of a resonance."""
    freq = np.linspace(231.0, 235.7, 41)
    h = 1e-6 * (freq / 233.0)[:, None, None] ** -400.0 * np.array([[1.0, 0.5], [0.5, 1.0]]) * (1 - 0.5j)
    with np.errstate(all="raise"):
        jf.check_frfs(freq, jf.pollute(h, 0.01, seed=1), ["1:+y", "2:+y"])
