"""The one door: every method, its arguments, what it returns and what it warns of."""

import json
import warnings

import numpy as np
import pytest
from trials import Trial

import jointfrf as jf
from jointfrf.identification.manifold import fit as fit_module

TRUTH = {"k_y": 6e5, "k_theta": 5e3, "c_y": 20, "c_theta": 1.5}
BANDS = {"y": (200, 800), "theta": (650, 800)}


def noisy(s, level=0.01, seed=3):
    return jf.pollute(s.gamma(s.joint), level, seed=seed)


@pytest.mark.parametrize(
    "method",
    [
        "compliance",
        "ismm",
        "ismm-kj",
        "inverse-substructuring",
        "decoupling-rr",
        "decoupling-rs",
        "decoupling-sr",
        "decoupling-ss",
    ],
)
def test_every_method_returns_the_joint_without_noise(beams, method):
    s = beams
    more = {}
    measured = s.gamma(s.joint)
    if method.startswith("ismm"):
        more = dict(alpha=s.gamma(s.first), k_initial=s.first.dynamic_stiffness(s.freq))
    elif method.startswith("decoupling"):
        place = {"r": s.inner, "s": [2 * s.n + i for i in s.inner]}
        measured = s.coupled(s.joint)[:, place[method[-2]]][:, :, place[method[-1]]]
        more = dict(h_a=s.h_a, h_b=s.h_b, dofs_j=s.at, dofs_k=s.at, dofs_r=s.inner, dofs_s=s.inner)
    if method == "compliance":
        fit = jf.identify(s.freq, measured, ["y", "theta"])
    else:
        fit = jf.identify_band_mean(s.freq, measured, method, ["y", "theta"], BANDS, **more)
    assert fit.method == method
    for name, value in TRUTH.items():
        assert fit.value[name] == pytest.approx(value, rel=1e-5)
    np.testing.assert_allclose(fit.stiffness, [6e5, 5e3], rtol=1e-5)
    np.testing.assert_allclose(fit.damping, [20, 1.5], rtol=1e-5)
    exact = s.joint.dynamic_stiffness(fit.freq_hz)
    assert fit.freq_hz.min() == (15 if method == "compliance" else 200)
    np.testing.assert_allclose(fit.k_joint(fit.freq_hz), exact, rtol=1e-5, atol=1e-5)
    assert (abs(fit.k_lines - exact) / abs(exact).max(axis=(0, 2), keepdims=True)).max() < 1e-5


def test_intervals_hold_the_truth_and_the_noise_is_found(beams):
    fit = jf.identify(beams.freq, noisy(beams), ["y", "theta"])
    assert fit.noise_level == pytest.approx(0.01, rel=0.15)
    assert fit.residual_level == pytest.approx(0.01, rel=0.15)
    assert not fit.warnings
    for name, (low, high) in fit.confidence_interval(0.999).items():
        assert low < TRUTH[name] < high
        narrow = fit.confidence_interval(0.5)[name]
        assert low < narrow[0] < narrow[1] < high
    assert list(fit.std_error) == list(fit.value) == ["k_y", "k_theta", "c_y", "c_theta"]


def test_a_given_noise_level_and_given_variances_are_used(beams):
    measured = noisy(beams)
    free = jf.identify(beams.freq, measured, ["y", "theta"])
    level = jf.identify(beams.freq, measured, ["y", "theta"], noise=0.02)
    assert level.noise_level == 0.02
    assert level.std_error["k_y"] == pytest.approx(2 * free.std_error["k_y"], rel=0.15)
    variances = (0.01 * abs(beams.gamma(beams.joint))) ** 2
    given = jf.identify(beams.freq, measured, ["y", "theta"], noise=variances)
    assert given.residual_level == pytest.approx(0.01, rel=0.15)
    assert given.std_error["k_theta"] == pytest.approx(free.std_error["k_theta"], rel=0.3)
    assert given.value["k_theta"] == pytest.approx(free.value["k_theta"], rel=0.02)


def test_noise_of_reciprocal_data_is_found_from_what_smooth_frfs_leave(beams):
    measured = jf.pollute(beams.gamma(beams.joint), 0.01, seed=3, reciprocal=True)
    measured = (measured + measured.swapaxes(1, 2)) / 2
    fit = jf.identify(beams.freq, measured, ["y", "theta"])
    # Mean of two measurements, off the diagonal.
    assert 0.007 < fit.noise_level < 0.011
    low, high = fit.confidence_interval(0.999)["k_theta"]
    assert low < 5e3 < high


def test_damping_terms_that_the_data_support(beams):
    hysteretic = jf.Joint([6e5, 5e3], dofs=["y", "theta"], loss_factor=[0.3, 0.4])
    both = jf.Joint([6e5, 5e3], [40, 3], ["y", "theta"], [0.3, 0.4])
    for joint, expected in ((beams.joint, "viscous"), (hysteretic, "hysteretic"), (both, "both")):
        measured = jf.pollute(beams.gamma(joint), 0.005, seed=1)
        fit = jf.identify(beams.freq, measured, ["y", "theta"])
        for dof in ("y", "theta"):
            assert any(note.startswith(f"damping of {dof}: {expected},") for note in fit.notes), fit.notes
    np.testing.assert_allclose(fit.loss_factor, [0.3, 0.4], atol=0.06)
    assert fit.unit("h_theta") == "N m/rad"


def test_a_coupled_joint(beams):
    coupled = jf.Joint([[6e5, 1e4], [1e4, 5e3]], [20, 1.5], ["y", "theta"])
    measured = jf.pollute(beams.gamma(coupled), 0.005, seed=1)
    with pytest.warns(jf.IdentificationWarning):
        plain = jf.identify(beams.freq, measured, ["y", "theta"])
    assert any("[cross-terms-ignored]" in text for text in plain.warnings)
    fit = jf.identify(beams.freq, measured, ["y", "theta"], cross="fit")
    assert not fit.warnings
    assert fit.value["k_y,theta"] == pytest.approx(1e4, rel=0.05)
    assert fit.unit("k_y,theta") == "N"
    np.testing.assert_allclose(fit.k_joint([100.0])[0, 0, 1], fit.k_joint([100.0])[0, 1, 0])


@pytest.mark.parametrize("kind", ["viscous", "hysteretic", "both"])
def test_damping_of_a_coupled_joint_is_chosen_as_if_all_kinds_were_fitted(beams, monkeypatch, kind):
    """Kinds that quadratic forms exclude on some lines alone are not fitted."""
    viscous = None if kind == "hysteretic" else [[40, 0.5], [0.5, 3.0]]
    loss = 0.0 if kind == "viscous" else 0.3
    joint = jf.Joint([[6e5, 1e4], [1e4, 5e3]], viscous, ["y", "theta"], loss)
    measured = jf.pollute(beams.gamma(joint), 0.005, seed=1)

    def fitted():
        kinds, estimate = [], fit_module._estimate
        monkeypatch.setattr(fit_module, "_estimate", lambda *a, **k: (kinds.append(a[1]), estimate(*a, **k))[1])
        fit = jf.identify(beams.freq, measured, ["y", "theta"], cross="fit")
        monkeypatch.undo()
        return fit, kinds

    fit, some = fitted()
    monkeypatch.setattr(fit_module, "_EXCLUDED", np.inf)
    whole, every = fitted()
    assert every == ["viscous", "both", "hysteretic"]
    assert some == (every if kind == "hysteretic" else every[:2])
    assert fit.value == whole.value
    assert fit.notes == whole.notes
    assert any(note.startswith(f"damping of y: {kind}") for note in fit.notes)


def test_a_joint_too_stiff_to_be_seen_is_said_with_its_bound(beams):
    rigid = jf.Joint([1e12, 5e3], [0, 1.5], ["y", "theta"])
    measured = jf.pollute(beams.gamma(rigid), 0.01, seed=2)
    with pytest.warns(jf.IdentificationWarning, match="cannot be distinguished from rigid: at least"):
        fit = jf.identify(beams.freq, measured, ["y", "theta"])
    low, high = fit.confidence_interval(0.95)["k_y"]
    assert high == np.inf
    assert 1e6 < low < 1e12
    # A best estimate, no standard error.
    assert low < fit.value["k_y"] < 1e12
    (row,) = (line.split() for line in str(fit).splitlines() if line.startswith("k_y "))
    assert row[1] == f"~{fit.value['k_y']:.2g}"
    assert row[3:5] == ["..", "inf"]
    assert jf.fit_to_dict(fit)["parameters"]["k_y"]["std_error"] is None
    assert fit.value["k_theta"] == pytest.approx(5e3, rel=0.05)
    json.dumps(jf.fit_to_dict(fit), allow_nan=False)


@pytest.mark.filterwarnings("ignore::jointfrf.errors.IdentificationWarning")
def test_a_best_estimate_lies_above_its_lower_bound_on_a_few_lines_too():
    """By the error of the compliance from the information alone it lay below it in some draws."""
    rigid = 0
    for seed in range(20):
        freq, measured, joint = Trial("3.3", "complex", 0.05, 300, step=49).draw(seed)
        fit = jf.identify(freq, measured, joint.dofs, damping="viscous")
        low, high = fit.confidence_interval(0.95)["k_theta"]
        if low > 0 and high == np.inf:
            rigid += 1
            assert low < fit.value["k_theta"]
    assert rigid > 5


@pytest.mark.parametrize("seed", range(1, 5))
@pytest.mark.filterwarnings("ignore::jointfrf.errors.IdentificationWarning")
def test_two_lines_give_a_joint_whose_damping_is_chosen(seed):
    """The mean over kinds of damping had negative variances in two of these draws, and no joint was given."""
    freq, measured, joint = Trial("3.3", "complex", 0.02, step=400).draw(seed)
    assert freq.size == 2
    fit = jf.identify(freq, measured, joint.dofs)
    for name, limits in fit.confidence_interval(0.999).items():
        if name[0] == "k":
            assert limits[0] < TRUTH[name] < limits[1]


def test_points_instead_of_dofs(beams):
    mix = np.array([[1.0, 0.01], [1.0, -0.01]])
    points = np.kron(np.eye(2), mix)
    measured = jf.pollute(points @ beams.gamma(beams.joint) @ points.T, 1e-3, seed=4)
    fit = jf.identify(beams.freq, measured, ["y", "theta"], transform=np.linalg.inv(points))
    low, high = fit.confidence_interval(0.999)["k_theta"]
    assert low < 5e3 < high
    same = jf.identify_band_mean(
        beams.freq, measured, "inverse-substructuring", ["y", "theta"], BANDS, transform=np.linalg.inv(points)
    )
    assert np.isfinite(same.stiffness).all()


def test_the_table_and_the_dictionary_say_the_same(beams):
    fit = jf.identify(beams.freq, noisy(beams), ["y", "theta"])
    text = str(fit)
    content = json.loads(json.dumps(jf.fit_to_dict(fit), allow_nan=False))
    for name, entry in content["parameters"].items():
        assert name in text
        assert f"{entry['value']:.5g}" in text
        assert entry["unit"] in text
    assert content["frequency_hz"] == [15.0, 800.0]
    assert "95 % interval" in text


def test_only_lines_in_the_bands_are_used(beams):
    broken = noisy(beams)
    outside = (beams.freq < 200) | (beams.freq > 600)
    broken[outside] *= 3
    fit = jf.identify(beams.freq, broken, ["y", "theta"], bands=(200, 600))
    assert fit.freq_hz.min() == 200
    assert not fit.warnings
    own = jf.identify(beams.freq, noisy(beams), ["y", "theta"], bands={"y": (200, 800), "theta": (15, 400)})
    assert own.bands == (((200.0, 800.0),), ((15.0, 400.0),))
    assert own.value["k_y"] == pytest.approx(6e5, rel=0.02)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(dofs=["y"]), "dofs must name 2 different joint DOFs"),
        (dict(dofs=["y", "y"]), "dofs must name 2 different joint DOFs"),
        (dict(dofs=["y", ""]), "dofs must name 2 different joint DOFs"),
        (dict(dofs=["y", "x,z"]), "without commas"),
        (dict(bands=(2000, 3000)), "contains no frequency line"),
        (dict(damping="friction"), "damping must be one of"),
        (dict(cross="all"), "cross must be one of"),
        (dict(noise=-1.0), "noise must be positive"),
        (dict(noise=np.zeros((158, 4, 4))), "noise must contain positive variances"),
        (dict(transform=np.eye(3)), r"transform must have shape \(n, 4\)"),
        (dict(transform=np.ones((3, 4))), "even number of rows"),
        (dict(freq_hz=np.arange(5.0)), r"freq_hz must have shape \(158\)"),
    ],
)
def test_bad_arguments_get_one_sentence(beams, change, message):
    arguments = dict(freq_hz=beams.freq, gamma=noisy(beams), dofs=["y", "theta"]) | change
    with pytest.raises(ValueError, match=message):
        jf.identify(**arguments)


def test_bad_measurements_get_one_sentence(beams):
    measured = noisy(beams)
    measured[7, 0, 1] = np.nan
    with pytest.raises(ValueError, match=r"gamma: NaN or Inf in line 7 \(50 Hz\)"):
        jf.identify(beams.freq, measured, ["y", "theta"])
    with pytest.raises(ValueError, match="gamma has no frequency lines"):
        jf.identify([], np.zeros((0, 4, 4)))
    with pytest.raises(ValueError, match="even number of rows"):
        jf.identify(beams.freq, noisy(beams)[:, :3, :3])


def test_probability_of_an_interval(beams):
    fit = jf.identify(beams.freq, noisy(beams), ["y", "theta"])
    with pytest.raises(ValueError, match="probability must lie between 0 and 1"):
        fit.confidence_interval(95)


def test_one_line_is_enough_for_one_complex_stiffness(chains):
    fit = jf.identify(chains.freq[50:51], chains.gamma(chains.joint)[50:51], ["x"])
    assert fit.value["k_x"] == pytest.approx(2000, rel=1e-6)
    assert fit.value["c_x"] == pytest.approx(3, rel=1e-6)


@pytest.mark.long
def test_six_dofs_of_a_structure_with_many_modes():
    """Most lines hide the joint in noise, and no line is left out for that."""
    freq = np.arange(20.0, 620.0)
    stiffness = np.array([1e6, 2e6, 5e5, 1e6, 3e6, 8e5])
    damping = np.array([50.0, 20.0, 30.0, 10.0, 40.0, 20.0])
    sides = []
    for seed in (1, 2):
        shapes, _ = np.linalg.qr(np.random.default_rng(seed).standard_normal((30, 30)))
        squared = (2 * np.pi * np.linspace(20, 900, 30)) ** 2
        matrices = (shapes * squared) @ shapes.T, np.eye(30)
        sides.append(jf.receptance(freq, *matrices, loss_factor=0.01, outputs=range(6), inputs=range(6)))
    joint = jf.Joint(stiffness, damping)
    exact = jf.couple(*sides, joint.dynamic_stiffness(freq), range(6), range(6), freq_hz=freq)
    measured = jf.pollute(exact, 0.02, seed=1)
    for cross in ("zero", "ignore", "fit"):
        fit = jf.identify(freq, measured, cross=cross)
        assert not fit.warnings
        assert fit.residual_level == pytest.approx(0.02, rel=0.1)
        errors = np.array([fit.std_error[f"k_{i}"] for i in range(6)])
        assert (abs(fit.stiffness - stiffness) < 4 * errors).all()
        assert (errors < 0.02 * stiffness).all()


def test_two_bands_are_not_taken_for_neighbours(beams):
    """Lines at the edge of a gap are linearised about what lies next to them in frequency."""
    gamma = beams.gamma(beams.joint)
    bands = [(15.0, 120.0), (400.0, 420.0), (700.0, 800.0)]
    pulls = []
    for seed in range(20):
        fit = jf.identify(beams.freq, jf.pollute(gamma, 0.01, seed=seed), ["y", "theta"], bands=bands)
        pulls.append([(fit.value[name] - value) / fit.std_error[name] for name, value in TRUTH.items()])
    spread = np.sqrt(np.square(pulls).mean(axis=0))
    assert (spread < 1.6).all(), spread
    assert (spread > 0.5).all(), spread
    exact = jf.identify(beams.freq, gamma, ["y", "theta"], bands=bands, noise=1e-6)
    for name, value in TRUTH.items():
        assert exact.value[name] == pytest.approx(value, rel=1e-6)


def test_ill_conditioned_lines_are_told_in_the_words_of_the_fit(beams):
    measured = jf.pollute(beams.gamma(beams.joint), 1e-3, seed=1)
    measured[40] = 1e-6 * np.ones((4, 4))  # a line of rank one
    measured[40] += 1e-20 * np.diag([1, 2, 3, 4])
    with warnings.catch_warnings():
        warnings.simplefilter("error", jf.IllConditionedWarning)
        fit = jf.identify(beams.freq, measured, ["y", "theta"])
    assert fit.value["k_theta"] == pytest.approx(5e3, rel=0.01)
