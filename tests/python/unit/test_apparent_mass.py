"""Apparent masses and static compliances: free, grounded and noisy sides, stated masses, units as an explanation."""

import numpy as np
import pytest

import jointfrf as jf
from command import run_command
from jointfrf.frf.noise_model import estimate_noise
from jointfrf.identification.apparent_mass import apparent_scale, common_factor, model_mass
from jointfrf.io import Channel, FrfSet, write_frfs

FREQ_HZ = np.arange(5.0, 200.0, 0.5)
FREE = jf.chain([8.0, 4.0], [3e6], [50.0], ground="none"), jf.chain([3.0, 2.0], [2e6], [50.0], ground="none")
GROUNDED = (
    jf.chain([8.0, 4.0], [3e6, 2e6], [50.0, 30.0], ground="start"),
    jf.chain([3.0, 2.0], [2e6, 1e6], [50.0, 30.0], ground="end"),
)
SECTION = dict(youngs_modulus=210e9, density=7850.0, width=0.04, height=0.015, loss_factor=0.004)


def coupled(a, b, noise, seed=1, freq=FREQ_HZ):
    joint = jf.Joint([1e5], [20.0]).dynamic_stiffness(freq)
    h = jf.couple(a.receptance(freq), b.receptance(freq), joint, [1], [0])[:, 1:3, 1:3]
    return jf.pollute(h, noise, seed=seed)


def scale_of(freq, gamma, dofs=("x",)):
    noise = estimate_noise(freq, gamma)
    return apparent_scale(freq, gamma, noise.inflation * noise.variance, dofs)


@pytest.mark.parametrize("noise", [0.001, 0.01])
def test_free_sides_have_their_masses(noise):
    inside = []
    for seed in range(5):
        scale = scale_of(FREQ_HZ, coupled(*FREE, noise, seed))
        assert scale.compliance is None
        for side, true in (("j", 12.0), ("k", 5.0), ("j and k", 17.0)):
            own = scale.of_side(side)
            if own is not None:
                assert own.value == pytest.approx(true, abs=0.05 * true + 3 * own.std_error)
                inside.append(abs(own.value - true) < 2.6 * own.std_error)
    assert len(inside) > 12
    assert np.mean(inside) > 0.85


def test_a_grounded_side_has_none():
    scale = scale_of(FREQ_HZ, coupled(GROUNDED[0], FREE[1], 0.001))
    assert [one.side for one in scale.masses] == ["k"]
    assert scale.masses[0].value == pytest.approx(5.0, rel=0.05)


@pytest.mark.parametrize("noise", [0.001, 0.05])
def test_a_grounded_assembly_has_a_static_compliance(noise):
    scale = scale_of(FREQ_HZ, coupled(*GROUNDED, noise))
    k = np.array([[3e6 * 2e6 / 5e6 + 1e5, -1e5], [-1e5, 2e6 * 1e6 / 3e6 + 1e5]])
    # the chain of A: ground, 3e6, mass, 2e6, joint; of B: joint, 2e6, mass, 1e6, ground
    true = np.linalg.inv(k).diagonal()
    assert scale.masses == ()
    assert scale.compliance.side == "jk"[int(true.argmax())]
    assert scale.compliance.value == pytest.approx(true.max(), rel=0.03)


@pytest.mark.parametrize("lowest", [100.0, 120.0, 140.0, 160.0])
def test_nothing_is_said_above_the_mass_line(lowest):
    high = lowest < FREQ_HZ
    assert scale_of(FREQ_HZ[high], coupled(*FREE, 0.01)[high]).masses == ()


def test_noise_alone_has_no_mass():
    h = jf.pollute(np.full((FREQ_HZ.size, 2, 2), 1e-9 + 0j), 1.0, seed=3)
    assert apparent_scale(FREQ_HZ, h, abs(h) ** 2, ["x"]).masses == ()
    assert apparent_scale(FREQ_HZ[:3], h[:3], abs(h[:3]) ** 2, ["x"]).masses == ()


def bars(noise):
    """Two bars with y and theta at their ends: a mass is more than what moves with its end."""
    freq = np.arange(10.0, 300.0, 1.0)
    a, b = (jf.beam(length, 20, **SECTION) for length in (0.5, 0.4))
    h = [one.receptance(freq, one.index(*names)) for one, names in ((a, ("21:y", "21:theta")), (b, ("1:y", "1:theta")))]
    joint = jf.Joint([1e7, 5e3], [200.0, 1.0]).dynamic_stiffness(freq)
    return freq, jf.pollute(jf.couple(*h, joint, [0, 1], [0, 1]), noise, seed=1), (a, b)


def test_rotations_make_the_whole_mass():
    freq, gamma, parts = bars(0.001)
    scale = scale_of(freq, gamma, ("y", "theta"))
    masses = [model_mass(part, "y") for part in parts]
    np.testing.assert_allclose(masses, [0.5 * 0.04 * 0.015 * 7850, 0.4 * 0.04 * 0.015 * 7850])
    both = scale.of_side("j and k")
    assert not both.is_least
    assert both.value == pytest.approx(sum(masses), rel=0.05)
    only = scale_of(freq, gamma[:, ::2, ::2], ("y",)).of_side("j and k")
    assert only.is_least
    assert only.value < 1.05 * sum(masses)


def test_a_clamped_model_has_no_mass():
    assert model_mass(jf.beam(0.3, 10, ends=("clamped", "free"), **SECTION), "y") is None


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (9.80665, "accelerations in g"), (1 / 4.448, "forces in lbf, the other way round"), (1000.0, "lengths in mm"),
        (39.478, "rad/s called Hz"), (386.1, "accelerations in g and lengths in inches"),
    ],
)  # fmt: skip
def test_common_factors_are_named(factor, words):
    assert words in common_factor(factor)
    assert words in common_factor(1.03 * factor)


def test_all_factors_that_would_explain_a_ratio_are_named():
    both = common_factor(39.4)
    assert "lengths in inches" in both
    assert "rad/s called Hz" in both


@pytest.mark.parametrize("factor", [1.0, 2.0, 3.0, 6.5, 60.0])
def test_other_factors_are_not(factor):
    assert common_factor(factor) is None


@pytest.fixture
def files(tmp_path):
    """A file in SI units, and one whose accelerations are in g and called m/s^2."""
    ends = (Channel(1, "+x"), Channel(2, "+x"))
    h = coupled(*FREE, 0.002) * (2j * np.pi * FREQ_HZ[:, None, None]) ** 2
    paths = tmp_path / "si.npz", tmp_path / "g.npz"
    for path, factor in zip(paths, (1.0, 1 / 9.80665), strict=True):
        write_frfs(path, FrfSet(FREQ_HZ, ends, ends, factor * h, "accelerance"))
    return paths


@pytest.mark.parametrize("command", ["identify", "check"])
def test_a_stated_mass_is_compared(files, command):
    joint = ["--j", "1", "--k", "2", "--dofs", "x"]
    for stated in (["--mass-j", "12"], ["--mass-k", "5.2"], ["--mass", "17"], []):
        result = run_command(command, files[0], *joint, *stated)
        assert result.returncode == 0, result.stderr
        assert "apparent mass: at least 12 +-" in result.stdout
    for stated in (["--mass-j", "12"], ["--mass", "17"]):
        result = run_command(command, files[1], *joint, *stated)
        assert result.returncode == 1
        assert "a factor of 9.807 (accelerations in g) would explain it" in result.stderr
        assert "k_x" not in result.stdout
    result = run_command(command, files[0], *joint, "--mass", "0")
    assert (result.returncode, result.stderr) == (
        2,
        "jointfrf: error: --mass must be positive, not 0; state it in kg\n",
    )


def test_a_stated_mass_that_the_lines_do_not_show_is_not_passed_over(files):
    """Above the mass line no mass is found."""
    joint = ["--j", "1", "--k", "2", "--dofs", "x", "--mass", "17"]
    result = run_command("check", files[0], *joint, "--band", f"{FREQ_HZ[-1] / 2:g}:{FREQ_HZ[-1]:g}")
    assert result.returncode == 1
    assert "warning: --mass was not compared: the lowest lines do not show this mass to 20 %" in result.stdout
