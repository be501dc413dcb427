"""A sensor that moves from point to point: its mass found from reciprocity and removed, by structures with the mass."""

from dataclasses import replace

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.frf.moving_mass import MovingMass, found_mass
from jointfrf.identification.manifold.fit import fit_springs
from jointfrf.identification.manifold.prepare import FitOptions, prepare_compliance
from jointfrf.identification.noise import NoiseOptions
from jointfrf.identification.prepare import as_measured

FREQ = np.arange(15.0, 800.0, 2.0)
SECTION = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
POINTS = ("A/9:y", "A/13:y", "B/1:y", "B/5:y")
JOINT = jf.Joint([6e5, 5e3], [20.0, 1.5], ["y", "theta"])


def assembly(**more):
    a = jf.Substructure(jf.beam(0.3, 12, ends=("clamped", "free"), **SECTION), ("13:y", "13:theta"), **more)
    b = jf.Substructure(jf.beam(0.225, 9, **SECTION), ("1:y", "1:theta"), **more)
    return jf.Assembly(a, b, JOINT)


@pytest.fixture(scope="module")
def bare():
    return assembly().receptance(FREQ, POINTS, POINTS)


def loaded(mass):
    """Each row with the mass at its response: a structure of its own."""
    rows = [assembly().with_attachments(jf.AddedMass(p, mass)).receptance(FREQ, [p], POINTS)[:, 0] for p in POINTS]
    return np.stack(rows, axis=1)


def test_removal_is_exact(bare):
    np.testing.assert_allclose(MovingMass(5e-3).removed(FREQ, loaded(5e-3)), bare, rtol=1e-8)
    of_force = loaded(5e-3).swapaxes(1, 2)
    np.testing.assert_allclose(MovingMass(-5e-3).removed(FREQ, of_force), bare, rtol=1e-8)


@pytest.mark.parametrize("with_force", [False, True])
@pytest.mark.parametrize("mass", [0.5e-3, 5e-3])
def test_mass_is_found_within_its_standard_error(mass, with_force):
    h = loaded(mass)
    h = h.swapaxes(1, 2) if with_force else h
    found = [found_mass(FREQ, jf.pollute(h, 0.005, seed=seed)) for seed in range(60)]
    assert all(one is not None and one.with_force == with_force for one in found)
    z = [(abs(one.mass) - mass) / one.std_error for one in found]
    assert 0.7 < np.sqrt(np.mean(np.square(z))) < 1.6


def test_gains_delays_and_noise_are_no_mass(bare):
    late = np.exp(-2j * np.pi * FREQ[:, None, None] * np.array([0, 2e-6, -1e-6, 3e-6]))
    for seed in range(20):
        gains = 1 + 0.01 * np.random.default_rng(seed).standard_normal(4)
        assert found_mass(FREQ, jf.pollute(bare, 0.01, seed=seed)) is None
        assert found_mass(FREQ, jf.pollute(bare * gains * late, 0.01, seed=seed)) is None
    assert found_mass(FREQ, (bare + bare.swapaxes(1, 2)) / 2) is None
    assert found_mass(FREQ[:20], loaded(5e-3)[:20]) is None


def fit_of(h, **options):
    return jf.identify_model(FREQ, h, assembly(exact=True), POINTS, POINTS, **options)


@pytest.mark.filterwarnings("ignore::jointfrf.errors.IdentificationWarning")
def test_a_fit_removes_the_mass_and_says_so():
    truth = {"k_y": 6e5, "k_theta": 5e3, "c_y": 20.0, "c_theta": 1.5}
    inside = []
    for seed in range(10):
        fit = fit_of(jf.pollute(loaded(5e-3), 0.005, seed=seed))
        (said,) = (one for one in fit.findings if one.code == "moving-mass")
        assert said.severity == "warning"
        assert said.numbers["mass"] == pytest.approx(5e-3, rel=0.02)
        limits = fit.confidence_interval()
        inside += [limits[name][0] < true < limits[name][1] for name, true in truth.items()]
    # 95 % of 40 is 38, with a standard deviation of 1.4.
    assert sum(inside) >= 34


@pytest.mark.filterwarnings("ignore::jointfrf.errors.IdentificationWarning")
@pytest.mark.filterwarnings("ignore::jointfrf.errors.FrfCheckWarning")
def test_a_mass_that_is_stated_is_removed_and_zero_leaves_all():
    h = jf.pollute(loaded(5e-3), 0.005, seed=1)
    stated, found, left = fit_of(h, sensor_mass=5e-3), fit_of(h), fit_of(h, sensor_mass=0.0)
    assert [one.severity for one in stated.findings if one.code == "moving-mass"] == ["note"]
    assert not any(one.code == "moving-mass" for one in left.findings)
    error = stated.std_error["c_y"]
    assert abs(stated.value["c_y"] - found.value["c_y"]) < error
    assert abs(stated.value["c_y"] - left.value["c_y"]) > 3 * error


@pytest.mark.filterwarnings("ignore::jointfrf.errors.IdentificationWarning")
@pytest.mark.filterwarnings("ignore::jointfrf.errors.FrfCheckWarning")
@pytest.mark.parametrize(("true", "stated"), [(0.0, 5e-3), (5e-3, 2e-3), (5e-3, 10e-3)])
def test_a_wrong_mass_that_is_stated_is_contradicted(true, stated):
    (said,) = (
        one
        for one in fit_of(jf.pollute(loaded(true), 0.005, seed=2), sensor_mass=stated).findings
        if one.code == "moving-mass"
    )
    assert (said.severity, said.variant) == ("warning", "contradicted")
    assert said.numbers["shown"] == pytest.approx(true, rel=0.1)


def chains(mass_j=0.0, mass_k=0.0):
    """Two chains with a spring between them: FRFs of both its ends."""
    freq = np.linspace(0.5, 10, 300)
    a = jf.chain([5, 3 + mass_j], [2500, 3500], [3, 4], ground="start").receptance(freq)
    b = jf.chain([4 + mass_k, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    return freq, jf.couple(a, b, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [1], [0])[:, 1:3, 1:3]


def test_the_error_of_the_mass_is_in_the_covariance():
    """Against refits with another mass."""
    (freq, j), (_, k) = chains(mass_j=0.3), chains(mass_k=0.3)
    h = jf.pollute(np.stack([j[:, 0], k[:, 1]], axis=1), 0.01, seed=1)

    def fitted(mass, error=0.0):
        options = FitOptions("viscous", "zero", True)
        measured = as_measured(freq, h, square=False)
        problem = prepare_compliance(measured, ["x"], None, None, NoiseOptions(sensor_mass=mass), options)
        return fit_springs(replace(problem, noise=replace(problem.noise, mass=MovingMass(mass, error))))

    error, step = 0.05, 0.01
    moved = fitted(0.3 + step).estimate.theta - fitted(0.3 - step).estimate.theta
    added = fitted(0.3, error).known.covariance - fitted(0.3).known.covariance
    np.testing.assert_allclose(added, error**2 * np.outer(moved, moved) / (2 * step) ** 2, rtol=0.1)


def test_what_cannot_be_removed_is_said(bare):
    with pytest.raises(ValueError, match=r"sensor_mass 0\.005 kg can be removed only .* Measure these"):
        jf.identify_model(FREQ, bare[:, :, :2], assembly(exact=True), POINTS, POINTS[:2], sensor_mass=5e-3)
    with pytest.raises(ValueError, match="sensor_mass must not be negative"):
        fit_of(bare, sensor_mass=-1.0)


@pytest.mark.parametrize("fault", ["exchanged", "reversed", "factor", "mixed", "drift", "resonant"])
def test_other_faults_are_no_mass(bare, fault):
    one = np.array([0.0, 1.0, 0.0, 1.0])[:, None]
    h = {
        "exchanged": bare[:, [1, 0, 2, 3]],
        "reversed": bare * (1 - 2 * one),
        "factor": bare * (1 + 8.81 * one),
        "mixed": np.concatenate([bare[:, :, :3], 0.8 * bare[:, :, 3:] + 0.2 * bare[:, :, :1]], axis=2),
        "drift": bare * (1 + 0.02 * np.cos(FREQ / 100)[:, None, None] * one),
        "resonant": bare * (1 + (FREQ / 4000)[:, None, None] ** 2 * one),
    }[fault]
    assert [found_mass(FREQ, jf.pollute(h, 0.005, seed=seed)) for seed in range(5)] == [None] * 5
