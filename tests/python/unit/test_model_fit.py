"""The fit of a model: its FRFs, their derivatives, what it finds from which FRFs, intervals, residual, messages."""

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

import jointfrf as jf
from jointfrf.identification.line_starts import from_lines
from jointfrf.identification.model import realisations
from jointfrf.identification.model.fit import fit_assembly
from jointfrf.identification.model.prediction import Prediction, parameter_vector
from jointfrf.identification.model.prepare import Channels, prepare_model_fit
from jointfrf.identification.model.reduced import MatrixPolynomial
from jointfrf.identification.noise import NoiseOptions
from jointfrf.workbench.cases.known_joint.decoupling import decoupling_bound, decoupling_fits, fit_decoupling
from model_bound import model_bound

FREQ = np.linspace(12, 620, 77)
SECTION = {"density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}


def arm(length=0.3, youngs_modulus=67e9):
    return jf.beam(length, 6, ends=("clamped", "free"), youngs_modulus=youngs_modulus, **SECTION)


def free_beam(length=0.225, youngs_modulus=67e9):
    return jf.beam(length, 5, youngs_modulus=youngs_modulus, **SECTION)


MOUNT = jf.LawJoint({"y": jf.FractionalZener(2e5, 6e5, 3e-4, 0.7), "theta": jf.SpringLaw(5e3, c=1.5)}, mass={"y": 0.03})
PLAIN = jf.Joint([6e5, 5e3], [20, 1.5], ["y", "theta"])
CHANNELS = ("A/4:y", "A/7:y", "B/6:y")


def assembly(joint=PLAIN, attachments=(), *, unknown_a=None, unknown_b=None, built=False):
    a, b = (arm, free_beam) if built else (arm(), free_beam())
    return jf.Assembly(
        jf.Substructure(a, ["7:y", "7:theta"], unknown_a or {}, exact=True),
        jf.Substructure(b, ["1:y", "1:theta"], unknown_b or {}, exact=True),
        joint,
        attachments,
    )


def fit_of(*args, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jf.identify_model(*args, **options)


def real_blocks(z):
    """[[Re, -Im], [Im, Re]] of Re + i Im where both may carry a complex step."""
    re, im = z
    return np.block([[re, -im], [im, re]])


def euler_bernoulli(length, count, clamped, modulus=67e9, density=2700.0):
    """K and M of a beam whose length may be complex."""
    a, inertia, area = length / count, 0.025 * 0.006**3 / 12, 0.025 * 0.006
    k = (
        np.array(
            [
                [12, 6 * a, -12, 6 * a],
                [6 * a, 4 * a**2, -6 * a, 2 * a**2],
                [-12, -6 * a, 12, -6 * a],
                [6 * a, 2 * a**2, -6 * a, 4 * a**2],
            ]
        )
        * modulus
        * inertia
        / a**3
    )
    m = (
        np.array(
            [
                [156, 22 * a, 54, -13 * a],
                [22 * a, 4 * a**2, 13 * a, -3 * a**2],
                [54, 13 * a, 156, -22 * a],
                [-13 * a, -3 * a**2, -22 * a, 4 * a**2],
            ]
        )
        * density
        * area
        * a
        / 420
    )
    n = 2 * count + 2
    whole = np.zeros((2, n, n), complex)
    for e in range(count):
        own = slice(2 * e, 2 * e + 4)
        whole[0, own, own] += k
        whole[1, own, own] += m
    return whole[:, 2:, 2:] if clamped else whole


def frfs_by_real_blocks(values, omega):
    """FRFs of the assembly of the test of derivatives, real and imaginary part, for values of which one is complex."""
    v = values
    k_a, m_a = euler_bernoulli(v["A/length"], 6, True, v["A/youngs_modulus"])
    k_b, m_b = euler_bernoulli(0.225, 5, False, 67e9 * v["B/youngs_modulus"] / 67e9, v["B/density"])
    n_a, n = len(k_a), len(k_a) + len(k_b)
    re, im = np.zeros((2, n, n), complex)
    re[:n_a, :n_a] = k_a - omega**2 * m_a
    re[n_a:, n_a:] = k_b - omega**2 * m_b
    im[:n_a, :n_a], im[n_a:, n_a:] = 0.01 * k_a, v["B/loss_factor"] * k_b
    # (i w tau)^alpha in real numbers, so that a parameter may carry a complex step.
    size, turn = (omega * v["tau_y"]) ** v["alpha_y"], v["alpha_y"] * np.pi / 2
    x, y = size * np.cos(turn), size * np.sin(turn)
    below = (1 + x) ** 2 + y**2
    joint = {
        "y": (v["k_y"] + v["k_m_y"] * (x * (1 + x) + y**2) / below, v["k_m_y"] * y / below),
        "theta": (v["k_theta"], omega * v["c_theta"]),
    }
    for offset, (k_re, k_im) in zip((0, 1), joint.values(), strict=True):
        j, other = 10 + offset, n_a + offset
        for part, value in ((re, k_re), (im, k_im)):
            part[j, j] += value
            part[other, other] += value
            part[j, other] -= value
            part[other, j] -= value
    re[10, 10] -= omega**2 * v["m_y"] / 2
    re[n_a, n_a] -= omega**2 * v["m_y"] / 2
    re[4, 4] -= omega**2 * v["mass A/4:y"]
    re[n - 2, n - 2] += v["ground stiffness B/6:y"]
    im[n - 2, n - 2] += omega * v["ground damping B/6:y"]
    h = np.linalg.inv(real_blocks((re, im)))
    at = np.array([4, 10, n - 2])
    gains = np.array([v["gain of response A/4:y"], 1, 1])[:, None] * np.array([1, v["gain of force A/7:y"], 1])
    return h[np.ix_(at, at)] * gains, h[np.ix_(n + at, at)] * gains


def test_derivatives_are_those_of_complex_steps():
    attached = (
        jf.AddedMass("A/4:y", jf.Unknown(0.02, 0.01)), jf.GroundSpring("B/6:y", jf.Unknown(3e4), jf.Unknown(2.0)),
    )  # fmt: skip
    whole = jf.Assembly(
        jf.Substructure(
            arm,
            ["7:y", "7:theta"],
            {"length": jf.Unknown(0.3, 0.006), "youngs_modulus": jf.Unknown(67e9, 1e9)},
            exact=True,
        ),
        jf.Substructure(
            free_beam(),
            ["1:y", "1:theta"],
            {
                "youngs_modulus": jf.Unknown(67e9, 1e9),
                "density": jf.Unknown(2700.0, 50),
                "loss_factor": jf.Unknown(0.01, 0.002),
            },
            exact=True,
        ),
        MOUNT,
        attached,
    )
    channels = Channels(CHANNELS, CHANNELS, {"A/4:y": jf.Unknown(1.0, 0.01)}, {"A/7:y": jf.Unknown(1.0, 0.01)})
    prediction = Prediction(whole, FREQ, CHANNELS, CHANNELS)
    vector = parameter_vector(whole, channels.gains(), (), prediction.joint_stiffness())
    values = vector.values.copy()
    names = [one.name for one in vector.all]
    values[names.index("A/length")] = 0.302
    values[names.index("gain of response A/4:y")] = 1.01
    y, slopes = prediction.linearised(vector, values)
    assert len(slopes) == len(names) == 17
    assert np.allclose(y, prediction.frfs(vector, values), rtol=1e-9, atol=0)
    named = dict(zip(names, values.tolist(), strict=True))
    for line in (3, 40, 70):
        omega = 2 * np.pi * FREQ[line]
        re, im = frfs_by_real_blocks(named, omega)
        assert np.allclose(y[line], re.real + 1j * im.real, rtol=1e-4, atol=1e-5 * abs(y[line]).max())
        for i, name in enumerate(names):
            step = 1e-30 * named[name]
            re, im = frfs_by_real_blocks(named | {name: named[name] + 1j * step}, omega)
            exact = (re.imag + 1j * im.imag) / step
            assert np.allclose(slopes[i, line], exact, rtol=1e-3, atol=2e-4 * abs(exact).max()), name


@pytest.mark.parametrize("seed", [2, 4, 8])  # what scatters along what no FRF shows would widen intervals of 2 and 4
def test_what_no_frf_shows_is_as_it_was_believed_and_open_on_both_sides(tmp_path, seed):
    """A mass on a spring beside each beam, in x: no channel sees it, and y and theta are found as ever."""

    def beside(model, k):
        both = [
            sparse.block_diag([matrix, [[value]]]).tocsr() for matrix, value in ((model.stiffness, k), (model.mass, 1))
        ]
        return replace(model, stiffness=both[0], mass=both[1], dofs=(*model.dofs, "9:x"))

    parts = beside(arm(), 1e6), beside(free_beam(), 1e5)
    guess = jf.Joint([1e5, 1e3, 2e5], [5, 0.5, 7.0], ["y", "theta", "x"])
    sides = [
        jf.Substructure(one, [f"{n}:y", f"{n}:theta", "9:x"], exact=True) for one, n in zip(parts, (7, 1), strict=True)
    ]
    measured = jf.pollute(assembly().receptance(FREQ, CHANNELS, CHANNELS), 0.01, seed=seed)
    fit = fit_of(FREQ, measured, jf.Assembly(*sides, guess), CHANNELS, CHANNELS, noise=0.01)
    assert any(one.code == "stiffness-unbounded" and one.variant == "no-bound" for one in fit.findings)
    assert fit.is_converged
    assert fit.intervals.of("k_x", 0.95) == (0.0, np.inf)
    assert fit.intervals.of("c_x", 0.95) == (0.0, np.inf)
    assert fit.value["c_x"] == pytest.approx(7.0, rel=1e-3)
    assert fit.std_error["c_x"] == np.inf
    jf.save(fit, tmp_path / "fit.json")
    assert jf.load(tmp_path / "fit.json").std_error == fit.std_error
    plain = jf.Joint([1e5, 1e3], [5, 0.5], ["y", "theta"])
    other = fit_of(FREQ, measured, assembly(plain), CHANNELS, CHANNELS, noise=0.01)
    for name in PLAIN_NAMES:
        low, high = other.intervals.of(name, 0.95)  # as near as limits are sought
        np.testing.assert_allclose(fit.intervals.of(name, 0.95), (low, high), rtol=0, atol=0.05 * (high - low))


def test_a_joint_of_which_no_frf_says_anything_is_as_it_was_believed():
    """Both parts stand on springs beside the joint, whose only DOF no channel sees."""

    def standing(k):
        chain = jf.chain([2.0], [k], [3.0], ground="start")
        both = [sparse.block_diag([matrix, [[value]]]).tocsr() for matrix, value in
                ((chain.stiffness, 1e4), (chain.mass, 1.0), (chain.damping, 1.0))]  # fmt: skip
        return replace(chain, stiffness=both[0], mass=both[1], damping=both[2], dofs=("1:x", "9:y"))

    sides = [jf.Substructure(standing(k), ["9:y"], exact=True) for k in (2e3, 5e3)]
    whole = jf.Assembly(*sides, jf.Joint([1e4], [2.0], ["y"]))
    freq, channels = np.linspace(1, 12, 60), ["A/1:x"]
    measured = jf.pollute(whole.receptance(freq, channels, channels), 0.01, seed=1)
    fit = fit_of(freq, measured, whole, channels, channels)
    assert fit.residual_is_noise
    assert (fit.value["c_y"], fit.std_error["c_y"]) == (pytest.approx(2.0), np.inf)
    assert fit.intervals.of("k_y", 0.95) == (0.0, np.inf)


def test_frfs_of_the_assembly_are_those_of_its_matrices():
    whole = assembly()
    model = jf.assemble(arm(), free_beam(), PLAIN, arm().index("7:y", "7:theta"), free_beam().index("1:y", "1:theta"))
    exact = model.receptance(FREQ, model.index(*CHANNELS))
    assert np.allclose(whole.receptance(FREQ, CHANNELS, CHANNELS), exact, rtol=1e-8, atol=0)


def test_exact_frfs_of_remote_points_give_the_joint_and_the_models():
    """One response, one force, both on B; Young's modulus and length of A are off by two standard deviations."""
    unknown = {"length": jf.Unknown(0.3, 0.003), "youngs_modulus": jf.Unknown(67e9, 1e9)}
    truth = jf.Assembly(
        jf.Substructure(arm(0.303, 65.5e9), ["7:y", "7:theta"], exact=True),
        jf.Substructure(free_beam(), ["1:y", "1:theta"], exact=True),
        PLAIN,
    )
    h = truth.receptance(FREQ, ["B/6:y"], ["B/5:y"])
    guess = jf.Joint([1e5, 1e3], [5, 0.5], ["y", "theta"])
    fit = fit_of(FREQ, h, assembly(guess, unknown_a=unknown, built=True), ["B/6:y"], ["B/5:y"], noise=1e-4)
    found = fit.value
    assert found["A/length"] == pytest.approx(0.303, rel=1e-4)
    assert found["A/youngs_modulus"] == pytest.approx(65.5e9, rel=1e-3)
    assert [found[name] for name in PLAIN_NAMES] == pytest.approx([6e5, 20, 5e3, 1.5], rel=2e-3)


PLAIN_NAMES = ("k_y", "c_y", "k_theta", "c_theta")


def test_substructures_may_be_given_by_frfs():
    a, b = arm(), free_beam()
    names_a, names_b = ("7:y", "7:theta", "4:y"), ("1:y", "1:theta", "6:y")
    whole = jf.Assembly(
        jf.Substructure.of_frfs(FREQ, a.receptance(FREQ, a.index(*names_a)), names_a, names_a[:2]),
        jf.Substructure.of_frfs(FREQ, b.receptance(FREQ, b.index(*names_b)), names_b, names_b[:2]),
        jf.Joint([1e5, 1e3], [5, 0.5], ["y", "theta"]),
    )
    channels = ("A/4:y", "B/6:y")
    h = jf.pollute(assembly().receptance(FREQ, channels, channels), 0.01, seed=4)
    fit = fit_of(FREQ, h, whole, channels, channels)
    same = fit_of(FREQ, h, assembly(jf.Joint([1e5, 1e3], [5, 0.5], ["y", "theta"])), channels, channels)
    assert [fit.value[n] for n in PLAIN_NAMES] == pytest.approx([same.value[n] for n in PLAIN_NAMES], rel=1e-3)
    for name, true in zip(PLAIN_NAMES, (6e5, 20, 5e3, 1.5), strict=True):
        assert abs(fit.value[name] - true) < 4 * fit.std_error[name]


NAMES_A, NAMES_B = ("7:y", "7:theta", "4:y"), ("1:y", "1:theta", "6:y")


def measured_parts(noise, level=0.01, joint=PLAIN):
    """The assembly with both parts by FRFs of this noise, drawn once."""
    a, b = arm(), free_beam()
    h_a, h_b = a.receptance(FREQ, a.index(*NAMES_A)), b.receptance(FREQ, b.index(*NAMES_B))
    return jf.Assembly(
        jf.Substructure.of_frfs(FREQ, jf.pollute(h_a, level, seed=1), NAMES_A, NAMES_A[:2], noise=noise),
        jf.Substructure.of_frfs(FREQ, jf.pollute(h_b, level, seed=2), NAMES_B, NAMES_B[:2], noise=noise),
        joint,
    )


def test_noise_of_parts_does_to_the_assembly_what_differences_say():
    """Each FRF of a part changed by itself, and the assembly coupled again."""
    whole, channels = measured_parts(0.01), ("A/4:y", "B/6:y", "B/1:y")
    prediction = Prediction(whole, FREQ, channels, channels)
    vector = parameter_vector(whole, ({}, {}), (), prediction.joint_stiffness())
    shared = prediction.part_noise(vector, vector.values)
    assert shared.shape == (FREQ.size, 3, 3, 18)
    before = whole.receptance(FREQ, channels, channels)
    for source, part in ((5, "a"), (9, "b")):
        own = getattr(whole, part)
        step = np.zeros_like(own.source.h)
        row, column = divmod(source % 9, 3)
        step[:, row, column] = 1e-6 * abs(own.source.h[:, row, column])
        moved = jf.Substructure.of_frfs(FREQ, own.source.h + step, own.source.dofs, own.joint)
        sides = {"a": whole.a, "b": whole.b, part: moved}
        change = jf.Assembly(sides["a"], sides["b"], whole.joint).receptance(FREQ, channels, channels) - before
        size = abs(shared[..., source]).max()
        np.testing.assert_allclose(shared[..., source], change / 1e-4, atol=1e-3 * size)


def test_the_likelihood_with_noise_of_parts_is_that_of_the_normal_distribution():
    """r^H C^-1 r with the whole covariance of a line, twice: real and imaginary part have half of E|e|^2."""
    whole, channels = measured_parts(0.01), ("A/4:y", "B/6:y")
    h = jf.pollute(assembly().receptance(FREQ, channels, channels), 0.02, seed=4)
    problem = prepare_model_fit(FREQ, h, whole, Channels(channels, channels), NoiseOptions(0.02), ())
    x = problem.vector.to_coordinates(problem.vector.values)
    shared = problem.prediction.part_noise(problem.vector, problem.vector.values)
    likelihood = replace(problem, shared=shared).likelihood
    left = (h - whole.receptance(FREQ, channels, channels)).reshape(FREQ.size, -1, 1)
    flat = shared.reshape(FREQ.size, 4, -1)
    covariance = flat @ flat.conj().swapaxes(1, 2)
    covariance[:, range(4), range(4)] += problem.variance.reshape(FREQ.size, 4)
    expected = 2 * (left.conj().swapaxes(1, 2) @ np.linalg.solve(covariance, left)).real.sum()
    assert likelihood.cost(x) == pytest.approx(expected, rel=1e-9)
    at = likelihood.linearised(x)
    assert at.cost == pytest.approx(expected, rel=1e-9)
    step = 1e-6 * np.eye(x.size)
    slope = [(likelihood.cost(x + one) - likelihood.cost(x - one)) / 4e-6 for one in step]
    np.testing.assert_allclose(at.gradient, -np.array(slope), rtol=1e-4)


def test_noise_of_parts_is_in_weights_and_intervals():
    channels = ("A/4:y", "A/7:y", "B/1:y", "B/6:y")
    h = jf.pollute(assembly().receptance(FREQ, channels, channels), 0.01, seed=4)
    guess = jf.Joint([3e5, 3e3], [10.0, 1.0], ["y", "theta"])
    said, found = (fit_of(FREQ, h, measured_parts(noise, 0.003, guess), channels, channels) for noise in (0.003, None))
    alone = fit_of(FREQ, h, assembly(guess), channels, channels)
    assert said.test.is_noise
    for name, true in zip(PLAIN_NAMES, (6e5, 20, 5e3, 1.5), strict=True):
        low, high = said.confidence_interval(0.99)[name]
        assert low < true < high
        assert said.std_error[name] > alone.std_error[name]
        assert found.std_error[name] == pytest.approx(said.std_error[name], rel=0.4)
    exact = jf.Substructure.of_frfs(FREQ, np.ones((FREQ.size, 1, 1)), ["1:y"], ["1:y"], noise=0.0)
    assert exact.source.variance is None
    for wrong in (-0.1, -np.ones((FREQ.size, 1, 1)), np.ones((3, 1, 1))):
        with pytest.raises(ValueError, match="noise must"):
            jf.Substructure.of_frfs(FREQ, np.ones((FREQ.size, 1, 1)), ["1:y"], ["1:y"], noise=wrong)


def test_noisy_parts_taken_as_exact_give_no_interval():
    """A part without a model has no errors that the fit could allow for."""
    channels = ("A/4:y", "A/7:y", "B/1:y", "B/6:y")
    h = jf.pollute(assembly().receptance(FREQ, channels, channels), 0.01, seed=4)
    fit = fit_of(FREQ, h, measured_parts(0.0, 0.2), channels, channels)
    assert "residual-large" in [one.code for one in fit.findings if one.severity == "warning"]
    assert fit.confidence_interval()["k_y"] == (0.0, np.inf)


def test_a_mount_with_mass_and_a_rigid_rotation_is_found():
    mount = jf.LawJoint({"y": jf.StandardLinearSolid(2e5, 6e5, 5e-4)}, rigid=["theta"], mass={"y": 0.06})
    guess = jf.LawJoint({"y": jf.StandardLinearSolid(1e5, 1e5, 1e-3)}, rigid=["theta"], mass={"y": 0.01})
    h = jf.pollute(assembly(mount).receptance(FREQ, CHANNELS, CHANNELS), 0.01, seed=3)
    fit = fit_of(FREQ, h, assembly(guess), CHANNELS, CHANNELS)
    assert fit.test.is_noise, fit.warnings
    for one in mount.quantities:
        assert abs(fit.value[one.name] - one.value) < 4 * fit.std_error[one.name]
        assert fit.std_error[one.name] < 0.2 * one.value
    assert fit.joint.rigid == ("theta",)


def test_an_frf_that_was_not_measured_is_left_out():
    channels = ("A/4:y", "A/7:y", "B/6:y")
    h = jf.pollute(assembly().receptance(FREQ, channels, channels), 0.02, seed=5)
    h[:, 0, 2] = h[:, 2, 0] = np.nan
    fit = fit_of(FREQ, h, assembly(jf.Joint([1e5, 1e3], [5, 0.5], ["y", "theta"])), channels, channels)
    assert np.isnan(fit.data.residual[:, 0, 2]).all()
    assert np.isfinite(fit.data.predicted).all()
    assert abs(fit.value["k_y"] - 6e5) < 4 * fit.std_error["k_y"]


@pytest.fixture(scope="module")
def good():
    """The fit of right models to FRFs with noise."""
    h = jf.pollute(assembly().receptance(FREQ, CHANNELS, CHANNELS), 0.05, seed=6)
    return fit_of(FREQ, h, assembly(jf.Joint([1e5, 1e3], [5, 0.5], ["y", "theta"])), CHANNELS, CHANNELS)


@pytest.mark.parametrize("wrong", [pytest.param("length", marks=pytest.mark.long), "mass", "rigid"])
def test_a_wrong_model_is_found_in_the_residual(wrong, good):
    """5 % of a length, 20 g that the model has not, a DOF left out; nothing is said where nothing is wrong."""
    joint, guess = PLAIN, jf.Joint([1e5, 1e3], [5, 0.5], ["y", "theta"])
    truth = assembly()
    if wrong == "length":
        truth = jf.Assembly(jf.Substructure(arm(0.315), ["7:y", "7:theta"], exact=True), truth.b, joint)
    if wrong == "mass":
        truth = assembly(attachments=(jf.AddedMass("A/4:y", 0.02),))
    if wrong == "rigid":
        guess = jf.LawJoint({"y": jf.SpringLaw(1e5, c=5.0)}, rigid=["theta"])
    h = jf.pollute(truth.receptance(FREQ, CHANNELS, CHANNELS), 0.05, seed=6)
    with pytest.warns(jf.IdentificationWarning) as caught:
        fit = jf.identify_model(FREQ, h, assembly(guess), CHANNELS, CHANNELS)
    assert any(re.search(r"do not fit the FRFs: residual .* at .* Hz", str(one.message)) for one in caught)
    assert not fit.test.is_noise
    assert good.test.is_noise, good.warnings


def test_a_prior_that_the_frfs_deny_is_told():
    unknown = {"density": jf.Unknown(2700.0, 27.0)}
    truth = jf.Assembly(
        jf.Substructure(arm(), ["7:y", "7:theta"], exact=True),
        jf.Substructure(
            jf.beam(0.225, 5, youngs_modulus=67e9, **(SECTION | {"density": 2900.0})), ["1:y", "1:theta"], exact=True
        ),
        PLAIN,
    )
    h = jf.pollute(truth.receptance(FREQ, CHANNELS, CHANNELS), 0.02, seed=1)
    fit = fit_of(FREQ, h, assembly(unknown_b=unknown), CHANNELS, CHANNELS)
    assert any("[prior-contradicted]" in text and "B/density" in text for text in fit.warnings)


def test_what_frfs_do_not_hold_is_named_by_its_direction():
    """Below the first resonance a chain shows one number: joint and right spring in series."""
    freq = np.linspace(0.5, 1.5, 40)
    a = jf.Substructure(jf.chain([5.0], [4000.0], [3.0], ground="start"), ["1:x"], exact=True)
    b = jf.Substructure(
        jf.chain([0.01], [2000.0], [2.0], ground="end"),
        ["1:x"],
        {"youngs_modulus": jf.Unknown(1.0, 0.5, lower=0.1)},
        exact=True,
    )
    joint = jf.LawJoint({"x": jf.SpringLaw(1500.0, damping="none")})
    whole = jf.Assembly(a, b, joint)
    h = jf.pollute(whole.receptance(freq, ["A/1:x"], ["A/1:x"]), 0.02, seed=1)
    fit = fit_of(freq, h, whole, ["A/1:x"], ["A/1:x"], noise=0.02)
    (open_,) = fit.data.open_directions
    assert {name for name, _ in open_.parts} == {"k_x", "B/youngs_modulus"}
    assert abs(fit.correlation[0, 1]) > 0.9
    text = str(fit)
    assert "k_x" in text
    assert "B/youngs_modulus" in text


def error_by_differences(cost, k, c):
    """Standard error of k by second differences of -2 log likelihood."""
    at, steps = np.array([k, c]), np.diag([1e-3 * k, 1e-3 * c])
    both = np.array([
        [cost(*(at + a + b)) - cost(*(at + a - b)) - cost(*(at - a + b)) + cost(*(at - a - b)) for b in steps]
        for a in steps
    ])  # fmt: skip
    information = both / (4 * np.outer(np.diag(steps), np.diag(steps))) / 2
    return float(np.sqrt(np.linalg.inv(information)[0, 0]))


def test_intervals_are_profiles_of_the_likelihood():
    """Brute force: the other parameter minimised on a grid."""
    freq = np.linspace(0.5, 10, 60)
    a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"], exact=True)
    b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"], exact=True)
    whole = jf.Assembly(a, b, jf.Joint([2000.0], [3.0], dofs=["x"]))
    h = jf.pollute(whole.receptance(freq, ["A/1:x"], ["B/2:x"]), 0.1, seed=8)
    fit = fit_of(freq, h, whole, ["A/1:x"], ["B/2:x"], noise=0.1)
    variance = (0.1 * abs(fit.data.predicted)) ** 2

    def cost(k, c):
        other = jf.Assembly(a, b, jf.Joint([k], [c], dofs=["x"]))
        return 2 * (abs(other.receptance(freq, ["A/1:x"], ["B/2:x"]) - h) ** 2 / variance).sum()

    k, c = fit.value["k_x"], fit.value["c_x"]
    least, widened = cost(k, c), (fit.std_error["k_x"] / error_by_differences(cost, k, c)) ** 2
    assert widened < 3
    for limit in fit.confidence_interval(0.95)["k_x"]:
        profile = min(cost(limit, one) for one in c + fit.std_error["c_x"] * np.linspace(-2, 2, 81))
        assert profile - least == pytest.approx(3.84 * widened, rel=0.12)
    with pytest.raises(ValueError, match="probability must lie between 0 and 1"):
        fit.confidence_interval(1.0)


def test_gains_of_channels_are_found_beside_the_joint():
    h = assembly().receptance(FREQ, CHANNELS, CHANNELS)
    h[:, 1] *= 1.07
    h = jf.pollute(h, 0.02, seed=2)
    gains = {"A/7:y": jf.Unknown(1.0, 0.05)}
    fit = fit_of(FREQ, h, assembly(), CHANNELS, CHANNELS, response_gains=gains, fixed=["c_theta"])
    assert fit.value["gain of response A/7:y"] == pytest.approx(1.07, abs=5 * fit.std_error["gain of response A/7:y"])
    assert "c_theta" not in fit.value
    assert fit.unit("gain of response A/7:y") == "1"
    assert jf.fit_to_dict(fit)["parameters"]["gain of response A/7:y"]["prior"] == [1.0, 0.05]
    assert fit.k_joint([100.0]).shape == (1, 2, 2)
    assert {one.name for one in fit.parameters if one.origin == "joint"} == {"k_y", "c_y", "k_theta"}


def test_interface_frfs_without_a_noise_level_take_it_from_the_residual():
    freq = np.linspace(0.5, 10, 9)
    a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"], exact=True)
    b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"], exact=True)
    whole = jf.Assembly(a, b, jf.Joint([2000.0], [3.0], dofs=["x"]))
    h = jf.pollute(whole.receptance(freq, ["A/1:x"], ["B/2:x"]), 0.05, seed=8)
    fit = fit_of(freq, h, whole, ["A/1:x"], ["B/2:x"])
    assert any("[noise-from-residual]" in note for note in fit.notes)
    assert 0.02 < fit.noise_level < 0.1


def test_polynomials_of_matrices_and_their_derivatives():
    def build(v):
        return [np.array([[v[0] ** -3, v[1]], [v[1] / v[0], 1.0]]), np.array([v[0] * v[1] ** 2])]

    polynomial = MatrixPolynomial(build, np.array([0.3, 2.0]), np.array([0.015, 0.1]))
    at = np.array([0.306, 2.05])
    for found, exact in zip(polynomial.at(at), build(at), strict=True):
        assert np.allclose(found, exact, rtol=1e-7)
    slopes = polynomial.slope(at, 0)
    assert np.allclose(slopes[0], [[-3 * at[0] ** -4, 0], [-at[1] / at[0] ** 2, 0]], rtol=1e-5, atol=1e-4)
    assert np.allclose(slopes[1], at[1] ** 2, rtol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"responses": ["A/99:y"]}, "response 'A/99:y': neither A nor B has such a DOF"),
        ({"responses": ["4:y"]}, "names begin with 'A/' or 'B/'"),
        ({"responses": ["A/4:y", "B/6:y"]}, "h must have 2 responses and 1 forces"),
        ({"responses": []}, "responses must name at least one DOF"),
        ({"fixed": ["k_x"]}, "unknown parameter 'k_x' in fixed; use one of"),
        ({"fixed": list(PLAIN_NAMES)}, "nothing to fit"),
        ({"noise": -1.0}, "noise must be positive"),
        ({"noise": 0.1, "averages": 4}, "coherence and averages are used where noise is not given"),
        ({"force_gains": {"A/4:y": jf.Unknown(1.0)}}, "unknown force 'A/4:y' in force_gains; use one of"),
        ({"bad": np.nan}, r"h\[3, 0, 0\] at 36 Hz is not finite"),
    ],
)
def test_what_is_wrong_is_one_sentence(change, message):
    h = assembly().receptance(FREQ, ["A/4:y"], ["B/6:y"])
    change = dict(change)
    if "bad" in change:
        h[3] = change.pop("bad")
    responses = change.pop("responses", ["A/4:y"])
    with pytest.raises(ValueError, match=message):
        jf.identify_model(FREQ, h, assembly(), responses, ["B/6:y"], **change)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: jf.Unknown(1.0, -1.0), "std must be positive"),
        (lambda: jf.Unknown(1.0, lower=2.0), "value must lie in 2 to inf"),
        (
            lambda: jf.Substructure(arm(), ["7:y"], {"length": jf.Unknown(1.0)}, exact=True),
            "unknown name 'length'; use one of .* or a function that builds the model",
        ),
        (
            lambda: jf.Assembly(
                jf.Substructure(arm(), ["7:y"], exact=True), jf.Substructure(free_beam(), ["1:y"], exact=True), PLAIN
            ),
            "has 1 joint",
        ),
        (lambda: assembly(attachments=(jf.AddedMass("A/9:y", 1.0),)), "attachment 'A/9:y'"),
        (lambda: jf.Substructure.of_frfs([1.0], np.ones((1, 2, 2)), ["a"], ["a"]), "dofs must name 2 different"),
    ],
)
def test_what_is_wrong_with_an_assembly_is_one_sentence(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_frfs_of_a_substructure_must_be_on_the_lines_of_the_measurement():
    a = arm()
    part = jf.Substructure.of_frfs(FREQ[1:], a.receptance(FREQ[1:], a.index("7:y", "7:theta")), ["y", "t"], ["y", "t"])
    whole = jf.Assembly(part, jf.Substructure(free_beam(), ["1:y", "1:theta"], exact=True), PLAIN)
    with pytest.raises(ValueError, match="the FRFs of A must be on the lines of the measurement"):
        prepare_model_fit(FREQ, np.ones((77, 1, 1)), whole, Channels(("A/y",), ("A/y",)), NoiseOptions(), ())


def decoupling_data(level, count):
    """FRFs between internal points, of the substructures and of many measurements, and the variance of the latter."""
    freq = np.linspace(0.5, 10, 300)
    a, b = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), jf.chain([4, 2], [2000, 2500], [2, 1], ground="end")
    h_a, h_b = a.receptance(freq)[:, ::-1, ::-1], b.receptance(freq)
    k_joint = jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq)
    exact = jf.couple(a.receptance(freq), b.receptance(freq), k_joint, [1], [0])[:, [0, 3]][:, :, [0, 3]]
    return freq, (h_a, h_b), k_joint, exact, jf.realisations(np.ascontiguousarray(exact), level, seed=3, count=count)


def test_realisations_of_a_decoupling_fit_are_those_of_single_fits():
    freq, sides, k_joint, _, measured = decoupling_data(0.05, 4)
    many = fit_decoupling(decoupling_fits(freq, ("x",), sides, 0.2 * k_joint, measured), measured)
    for found, h in zip(many, measured, strict=True):
        parts = [jf.Substructure.of_frfs(freq, own, ["j", "i"], ["j"]) for own in sides]
        fit = fit_of(freq, h, jf.Assembly(*parts, jf.Joint([500.0], [1.0], ["x"])), ["A/i", "B/i"], ["A/i", "B/i"])
        for value, name in zip(found, ("k_x", "c_x"), strict=True):
            assert abs(value - fit.value[name]) < 0.2 * fit.std_error[name]


def test_realisations_of_noise_of_two_parts_are_those_of_single_fits():
    """A share of each FRF, and the same at all lines, which is larger between resonances."""
    freq, sides, k_joint, exact, measured = decoupling_data(0.03, 4)
    measured = measured + (
        jf.realisations(np.ascontiguousarray(exact), 0.01, seed=7, count=4, relative_to="spectrum") - exact
    )
    many = fit_decoupling(decoupling_fits(freq, ("x",), sides, 0.2 * k_joint, measured), measured)
    for found, h in zip(many, measured, strict=True):
        parts = [jf.Substructure.of_frfs(freq, own, ["j", "i"], ["j"]) for own in sides]
        fit = fit_of(freq, h, jf.Assembly(*parts, jf.Joint([500.0], [1.0], ["x"])), ["A/i", "B/i"], ["A/i", "B/i"])
        for value, name in zip(found, ("k_x", "c_x"), strict=True):
            assert abs(value - fit.value[name]) < 0.03 * fit.std_error[name]


def test_a_realisation_unlike_the_first_is_fitted_by_itself(monkeypatch):
    """Noise three times that of the first set, then the first once more."""
    freq, sides, k_joint, exact, measured = decoupling_data(0.02, 2)
    loud = jf.pollute(np.ascontiguousarray(exact), 0.06, seed=9)
    searched = []
    monkeypatch.setattr(realisations, "fit_assembly", lambda problem: searched.append(problem) or fit_assembly(problem))
    fits = decoupling_fits(freq, ("x",), sides, k_joint, measured)
    first, other, last = fit_decoupling(fits, [measured[0], loud, measured[0]])
    assert all(np.array_equal(problem.measured, h) for problem, h in zip(searched, [measured[0], loud], strict=True))
    assert abs(other[0] / 2000 - 1) < 0.02
    np.testing.assert_array_equal(first, last)


def test_the_bound_of_a_decoupling_fit_is_that_of_differences():
    freq, sides, k_joint, exact, _ = decoupling_data(0.05, 1)
    bound = decoupling_bound(freq, ("x",), sides, k_joint, (0.05 * abs(exact)) ** 2)
    parts = [jf.Substructure.of_frfs(freq, own, ["j", "i"], ["j"]) for own in sides]
    whole = jf.Assembly(*parts, jf.Joint([2000.0], [3.0], ["x"]))
    other = model_bound(whole, freq, ["A/i", "B/i"], ["A/i", "B/i"], 0.05)
    assert np.allclose(bound, [other["k_x"] / 2000, other["c_x"] / 3], rtol=1e-4)


def test_channels_that_span_the_joint_give_it_line_by_line():
    """Attachments and masses of the joint are part of the models; exact FRFs give the exact compliance."""
    joint = jf.LawJoint({"y": jf.SpringLaw(6e5, c=20.0), "theta": jf.SpringLaw(5e3, c=1.5)}, mass={"y": 0.05})
    whole = assembly(joint, (jf.AddedMass("B/6:y", 0.01),))
    channels = ("A/4:y", "A/7:y", "B/6:y")
    prediction = Prediction(whole, FREQ, channels, channels)
    vector = parameter_vector(whole, ({}, {}), (), prediction.joint_stiffness())
    h = whole.receptance(FREQ, channels, channels)
    found = prediction.joint_compliance(vector, h, np.full(h.shape, 1e-20))
    exact = joint.compliance(FREQ)
    assert np.median(abs(found.c - exact) / abs(exact).max()) < 1e-6
    assert from_lines(joint, 2 * np.pi * FREQ, found)[:4] == pytest.approx(joint.values[:4], rel=1e-3)
    assert Prediction(whole, FREQ, channels[:1], channels).joint_compliance(vector, h[:, :1], abs(h[:, :1])) is None


def test_a_model_is_never_built_beyond_the_limits_of_its_unknowns():
    """A loss factor known to a half: three standard deviations below it is negative, which no model takes."""
    asked = []

    def lossy(loss_factor):
        asked.append(loss_factor)
        return jf.beam(0.3, 6, ends=("clamped", "free"), youngs_modulus=67e9, **SECTION | {"loss_factor": loss_factor})

    def whole(unknown):
        part = jf.Substructure(lossy, ["7:y", "7:theta"], {"loss_factor": unknown}, exact=True)
        return jf.Assembly(part, jf.Substructure(free_beam(), ["1:y", "1:theta"], exact=True), PLAIN)

    h = jf.pollute(assembly().receptance(FREQ, CHANNELS, CHANNELS), 0.02, seed=4)
    fit = fit_of(FREQ, h, whole(jf.Unknown(0.008, 0.004, lower=0.002, upper=0.011)), CHANNELS, CHANNELS)
    low, high = fit.confidence_interval(0.95)["A/loss_factor"]
    assert low < 0.01 < high
    assert 0.002 <= min(asked) < max(asked) <= 0.011


@pytest.mark.parametrize(
    ("of_part", "of_joint", "message"),
    [
        (["4:y", "4:theta"], ["theta", "y"], "a: 4:y is at the place of theta of the joint"),
        (["4:theta", "4:y"], ["y", "theta_z"], "a: 4:theta is at the place of y of the joint"),
        (["4:theta", "4:y"], ["Fy", "Mz"], "a: 4:theta is at the place of Fy of the joint"),
        (["4:y", "4:theta"], ["y", "theta_z"], ""),
        (["4:y", "4:theta"], ["Fy", "Mtheta_z"], ""),
        (["4:y", "4:theta"], ["x", "theta_z"], ""),  # axes of its own
        (["4:y", "4:theta"], ["0", "1"], ""),
    ],
)
def test_a_joint_in_another_order_than_its_substructure_is_refused(of_part, of_joint, message):
    """It gave 29848 +- 36 N m/rad for 2121, without a word."""
    arm = jf.beam(0.3, 3, youngs_modulus=70e9, density=2700.0, width=0.02, height=0.01)
    joint = jf.Joint([1e6, 2e3], dofs=of_joint)
    a, b = jf.Substructure(arm, of_part), jf.Substructure(arm, [dof.replace("4", "1") for dof in of_part])
    if not message:
        jf.Assembly(a, b, joint)
        return
    with pytest.raises(ValueError, match=message):
        jf.Assembly(a, b, joint)


@pytest.mark.parametrize("way", ["x", "y"])
def test_directions_that_are_exchanged_are_refused(way):
    other = {"x": "y", "y": "x"}[way]
    arm = jf.beam(0.3, 3, youngs_modulus=70e9, density=2700.0, width=0.02, height=0.01, axial=True)
    one, swapped = [f"1:{way}", f"1:{other}"], [f"1:{other}", f"1:{way}"]
    joint = jf.LawJoint({way: jf.SpringLaw(1e6), other: jf.SpringLaw(2e6)})
    jf.Assembly(jf.Substructure(arm, one), jf.Substructure(arm, one), joint)
    with pytest.raises(ValueError, match=f"b: 1:{other} is at the place of {way} of the joint"):
        jf.Assembly(jf.Substructure(arm, one), jf.Substructure(arm, swapped), joint)
