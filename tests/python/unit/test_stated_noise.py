"""Noise that a user states: relative part and floors, in Python and on the command line."""

import json
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import jointfrf as jf
from jointfrf.workbench.cli.main import main

FREQ = np.linspace(0.5, 10, 300)
FILE = Path(__file__).resolve().parents[3] / "cases/hammer-test/two_bars.uff"
JOINT = ["--j", "101,102", "--k", "201,202", "--dofs", "y,rz"]


@pytest.mark.parametrize(("quantity", "power"), [("receptance", 0), ("mobility", 1), ("accelerance", 2)])
def test_a_floor_is_constant_in_its_quantity(quantity, power):
    h = np.random.default_rng(1).standard_normal((300, 2, 3)) + 0j
    of_quantity = h * ((2j * np.pi * FREQ) ** power)[:, None, None]
    variance = (0.02 * abs(of_quantity)) ** 2 + 0.3**2
    stated = jf.StatedNoise(0.02, **{quantity: 0.3})
    assert_allclose(stated.variance(FREQ, h), variance / abs(2 * np.pi * FREQ[:, None, None]) ** (2 * power))


def chains(floor: float = 0.02) -> tuple[jf.Assembly, np.ndarray, jf.StatedNoise, np.ndarray]:
    a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"], exact=True)
    b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"], exact=True)
    whole = jf.Assembly(a, b, jf.Joint([2000.0], [3.0], dofs=["x"]))
    exact = whole.receptance(FREQ, ["A/2:x", "B/1:x"], ["A/2:x", "B/1:x"])
    stated = jf.StatedNoise(0.03, accelerance=floor)
    noise = np.random.default_rng(5).standard_normal((2, *exact.shape)) * np.sqrt(stated.variance(FREQ, exact) / 2)
    return whole, exact, stated, exact + noise[0] + 1j * noise[1]


@pytest.mark.parametrize("floor", [0.0, 0.02])
def test_fits_use_the_noise_that_is_stated(floor):
    """As with the variance of the exact FRFs."""
    whole, exact, stated, h = chains(floor)
    names = ["A/2:x", "B/1:x"]
    own, other = (
        [
            jf.identify_model(FREQ, h, whole, names, names, noise=one),
            jf.identify(FREQ, h, ["x"], damping="viscous", noise=one),
        ]
        for one in (stated, stated.variance(FREQ, exact))
    )
    for fit, known in zip(own, other, strict=True):
        for name in ("k_x", "c_x"):
            assert abs(fit.value[name] - known.value[name]) < 0.3 * known.std_error[name]
            assert fit.std_error[name] == pytest.approx(known.std_error[name], rel=0.1)
        assert fit.noise_level == pytest.approx(known.noise_level, rel=0.05)


def test_a_plan_takes_it_too():
    whole, *_ = chains()
    names = ["A/2:x", "B/1:x"]
    one, other = (
        jf.plan(whole, FREQ, names, names, averages=3, budget=2, **noise).proposed.std_error
        for noise in ({"noise": jf.StatedNoise(0.03, accelerance=0.02)}, {"noise": 0.03, "floor": 0.02})
    )
    assert one == pytest.approx(other)
    with pytest.raises(ValueError, match=r"floor 0\.1 and floors of noise are both given; leave out floor"):
        jf.plan(whole, FREQ, names, names, noise=jf.StatedNoise(0.03), floor=0.1)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({}, "relative part and floors of the noise are all zero; give one of them"),
        ({"relative": -1.0}, "relative must not be negative, not -1"),
        ({"accelerance": np.nan}, "accelerance"),
    ],
)
def test_noise_that_there_is_not(parts, message):
    with pytest.raises(ValueError, match=message):
        jf.StatedNoise(**parts)


def test_a_floor_of_accelerance_has_no_size_at_0_hz():
    whole, _, stated, h = chains()
    with pytest.raises(ValueError, match="a floor of mobility or accelerance has no size at 0 Hz; leave out lines"):
        jf.identify_model(np.append(0.0, FREQ[1:]), h, whole, ["A/2:x", "B/1:x"], ["A/2:x", "B/1:x"], noise=stated)


def test_the_command_takes_floors(tmp_path, capsys):
    """For a file with coherence, which stated noise replaces."""
    frfs = jf.io.read_frfs(FILE)
    path = tmp_path / "test.npz"
    jf.io.write_frfs(path, replace(frfs, coherence=np.full(frfs.h.shape, 0.99), averages=np.full(frfs.h.shape[1:], 5)))
    words = ["--noise", "0.01", "--floor", "0.002", "--floor", "1e-10:receptance"]
    assert main(["identify", str(path), *JOINT, *words, "--save", str(tmp_path / "joint.json")]) == 0
    capsys.readouterr()
    found = json.loads((tmp_path / "joint.json").read_text())
    receptances = frfs.receptance()
    sides = jf.interface([101, 102], [201, 202], ["y", "rz"], receptances.coordinates)
    h = receptances.matrix(sides.channels, sides.channels)
    stated = jf.StatedNoise(0.01, receptance=1e-10, accelerance=0.002)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = jf.identify(receptances.freq_hz, h, sides.dofs, transform=sides, noise=stated)
    assert found["noise_level"] == pytest.approx(fit.noise_level)
    values = {name: one["value"] for name, one in found["parameters"].items()}
    assert values == pytest.approx(fit.value, rel=1e-6)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--floor", "0.1"], "--floor states only a part of the noise; add --noise LEVEL, 0 if no part is relative"),
        (["--noise", "0.1", "--floor", "1:accel"], "unknown quantity 'accel'; use receptance, mobility, accelerance"),
        (["--noise", "0.1", "--floor", "-1"], "'-1' is no floor above zero; give one, such as 0.01"),
        (["--noise", "0.1", "--floor", "1", "--floor", "2:accelerance"], "--floor states accelerance twice; give one"),
        (["--noise", "-1", "--floor", "1"], "relative must not be negative, not -1"),
    ],
)
def test_wrong_floors_are_refused(words, message, capsys):
    try:
        status = main(["identify", str(FILE), *JOINT, *words])
    except SystemExit as error:
        status = error.code
    assert status in (1, 2)
    assert message in capsys.readouterr().err
