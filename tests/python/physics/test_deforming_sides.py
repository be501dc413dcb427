"""Virtual points on bodies that deform: intervals hold the joint that is known, and say what they are due to."""

import os
import warnings
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from deforming_blocks import measured
from jointfrf.io import read_uff

DATA = Path(os.environ.get("JOINTFRF_TEST_DATA", Path(__file__).resolve().parents[4] / "shared" / "data"))
LAP = DATA / "lap_joint" / "lap_joint.uff"
DOFS = ("x", "y", "z", "theta_x", "theta_y", "theta_z")


def identified(freq, h, **more):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        warnings.simplefilter("ignore", jf.ConvergenceWarning)
        return jf.identify(freq, h, DOFS, **more)


def held(fit, stiffness):
    intervals = fit.confidence_interval(0.95)
    return [low <= k <= high for k, (low, high) in zip(stiffness, (intervals[f"k_{d}"] for d in DOFS), strict=True)]


def test_intervals_hold_the_joint_between_blocks():
    """1 % noise: the virtual points alone put some percent of error into the stiffnesses."""
    freq = tuple(np.arange(10.0, 601.0, 10))
    h, sides, joint = measured(freq, 0.02)
    fit = identified(freq, jf.pollute(h, 0.01, seed=1), transform=jf.virtual_points(*sides))
    stiffness = np.diagonal(joint.stiffness)
    assert all(held(fit, stiffness))
    errors = np.array([fit.std_error[f"k_{d}"] for d in DOFS]) / stiffness
    assert (abs(fit.stiffness / stiffness - 1) < 0.05).all()
    assert (errors < 0.1).all()
    assert fit.noise_level == pytest.approx(0.01, rel=0.1)
    assert any("[sides-removed]" in note for note in fit.notes)
    # Softer as seen, by some percent, and most of the width is that of the sides.
    for name, k in zip((f"k_{d}" for d in DOFS), stiffness, strict=True):
        seen = fit.seen[name]
        assert 0.9 * k < seen.value < fit.value[name]
        assert seen.sides + seen.inertia + seen.noise == pytest.approx(1)
    assert np.median([one.sides for one in fit.seen.values()]) > 0.5
    assert any("[interval-cause]" in note and "--side-j" in note for note in fit.notes)
    assert "between virtual points  as seen" in str(fit)
    same = jf.fit_from_dict(jf.fit_to_dict(fit))
    assert same.seen == fit.seen
    assert str(same) == str(fit)


@pytest.mark.parametrize(
    ("low", "high", "distance"),
    [
        (10, 1000, 0.04),
        *(pytest.param(*each, marks=pytest.mark.long) for each in ((10, 600, 0.02), (100, 1500, 0.02))),
    ],
)
def test_bands_and_distances_of_channels_do_not_narrow_intervals_onto_a_false_value(low, high, distance):
    freq = tuple(np.arange(float(low), high + 1, 5))
    h, sides, joint = measured(freq, distance)
    fit = identified(freq, jf.pollute(h, 0.01, seed=5), transform=jf.virtual_interface(*sides))
    assert all(held(fit, np.diagonal(joint.stiffness)))
    assert (abs(fit.stiffness / np.diagonal(joint.stiffness) - 1) < 0.06).all()


@pytest.mark.parametrize("seed", [3, pytest.param(4, marks=pytest.mark.long)])
def test_gains_of_hits_are_in_what_is_seen(seed):
    """Every hit has a gain of its own, 1 %: what is seen without them is inside; scatter of lines misses it."""
    freq = tuple(np.arange(10.0, 601.0, 10))
    h, sides, joint = measured(freq, 0.02)
    transform = jf.virtual_points(*sides)
    gains = 1 + 0.01 * np.random.default_rng(seed).standard_normal(h.shape[2])
    exact = identified(freq, jf.pollute(h, 1e-4, seed=9), transform=transform)
    with pytest.warns(jf.FrfCheckWarning, match=r"\[channel-gain\]"):
        fit = identified(freq, jf.pollute(h, 0.002, seed=seed) * gains, transform=transform)
    assert all(held(fit, np.diagonal(joint.stiffness)))
    for name, seen in fit.seen.items():
        assert seen.low < exact.seen[name].value < seen.high


def test_geometry_and_its_matrix_give_the_same_fit():
    """Virtual points of equal weights are the least-squares inverse of their modes; the same sensors as a pair, too."""
    freq = tuple(np.arange(10.0, 601.0, 10))
    h, sides, _ = measured(freq, 0.02)
    noisy = jf.pollute(h, 0.01, seed=2)
    fits = [identified(freq, noisy, transform=t) for t in (jf.virtual_points(*sides), jf.virtual_interface(*sides))]
    for name, value in fits[0].value.items():
        assert fits[1].value[name] == pytest.approx(value, rel=1e-6)
        assert fits[1].std_error[name] == pytest.approx(fits[0].std_error[name], rel=1e-6)


def test_other_impacts_than_sensors():
    """Impacts at nine of the channels: forces and responses have transforms of their own."""
    freq = tuple(np.arange(10.0, 601.0, 10))
    h, sides, joint = measured(freq, 0.02)
    kept = np.array([0, 1, 2, 3, 5, 6, 7, 8, 9, 10])
    struck = [jf.virtual_point(*_some(kept, sign), np.zeros(3)) for sign in (-1, 1)]
    h = jf.pollute(h, 0.01, seed=3)[:, :, np.r_[kept, kept + 12]]
    fit = identified(freq, h, transform=(jf.virtual_interface(*sides), jf.virtual_interface(*struck)))
    assert sum(held(fit, np.diagonal(joint.stiffness))) == 6


def _some(kept, sign):
    places = np.array(
        [[0.04, 0, 0.02 * sign], [-0.04, 0, 0.02 * sign], [0, 0.03, 0.02 * sign], [0, -0.03, 0.02 * sign]]
    )
    return np.repeat(places, 3, axis=0)[kept], np.tile(np.eye(3), (4, 1))[kept]


def test_exactly_as_many_channels_as_dofs_are_said_not_to_be_checked():
    freq = tuple(np.arange(10.0, 601.0, 10))
    h, _, _ = measured(freq, 0.02)
    places = {1: (0.04, 0, -0.02), 2: (-0.04, 0, -0.02), 3: (0.04, 0, 0.02), 4: (-0.04, 0, 0.02)}
    sides = jf.interface([1, 2], [3, 4], ["y", "theta_z"], places)
    own = [1, 4, 13, 16]
    noisy = jf.pollute(h[:, own][:, :, own], 0.01, seed=1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        fit = jf.identify(freq, noisy, transform=sides)
    assert fit.dofs == ("y", "theta_z")
    assert any("[sides-unchecked]" in note for note in fit.notes)
    # The points lie 20 mm beside the reference of the joint along z: theta_x enters y, and they do not show it.
    off = sides._replace(
        motion=sides.motion + 0.02 * np.eye(12)[3] * (abs(sides.motion[:, [1, 7]]).sum(axis=1)[:, None])
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        warned = jf.identify(freq, noisy, transform=off).warnings
    assert any("of theta_x, which is left out, enters y of side j" in warning for warning in warned)
    # Where the bending between the points is said, rotations have it in their intervals.
    known = jf.interface([1, 2], [3, 4], ["y", "theta_z"], places, bending_stiffness=2e5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        wide = jf.identify(freq, noisy, transform=known)
    grown = {
        d: np.sqrt(wide.std_error[f"k_{d}"] ** 2 - fit.std_error[f"k_{d}"] ** 2) / fit.value[f"k_{d}"] ** 2
        for d in fit.dofs
    }
    assert grown["theta_z"] == pytest.approx(known.compliance[1], rel=0.05)
    # Far below the standard error along y.
    assert grown["y"] <= known.compliance[0] < 1e-4 * fit.std_error["k_y"] / fit.value["k_y"] ** 2


@pytest.mark.long
@pytest.mark.skipif(not LAP.exists(), reason="the measured files are not beside the project (JOINTFRF_TEST_DATA)")
def test_intervals_of_a_bolted_lap_joint():
    """Ten channels a side, the reference on the lap interface: its flexibility is as large as that of the joint."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.FileContentWarning)
        frfs = read_uff(LAP).receptance()
    axes = {2: "y", 3: "y", 4: "y", 5: "y", 6: "x", 7: "x", 8: "x", 9: "z", 10: "z", 11: "z"}
    names = [[f"{side}{node:02d}:+{axis}" for node, axis in axes.items()] for side in (1, 2)]
    sides = [jf.virtual_point(*jf.channel_geometry(own, frfs.coordinates), [0, 0, 0.2875]) for own in names]
    h = frfs.matrix(names[0] + names[1], names[0] + names[1])
    fit = identified(frfs.freq_hz, h, bands=(20, 550), transform=jf.virtual_interface(*sides))
    known = [1.55e8, 1.35e8, 1.44e8, 6.96e3, 1.94e4, 6.98e3]
    assert all(held(fit, known))
    # All may be rigid, and still have a best estimate.
    assert (abs(np.log(fit.stiffness / known)) < np.log(3.5)).all()
    assert np.median(abs(np.log(fit.stiffness / known))) < np.log(1.7)
    assert fit.noise_level == pytest.approx(0.01, rel=0.05)
    # Entries that are zero by symmetry part the DOFs, and do not set the noise.
    assert any("(x, theta_y, theta_z) and (y, z, theta_x) are zero" in note for note in fit.notes)
    assert any("best estimate" in warning for warning in fit.warnings)
