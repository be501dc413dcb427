"""Set-ups of one test: kept by merging and files, found in what was measured twice, carried into intervals."""

import warnings

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.frf.calibration import calibration_errors
from jointfrf.identification.minimise import minimise
from jointfrf.identification.model.prepare import Channels, prepare_model_fit
from jointfrf.identification.noise import NoiseOptions
from jointfrf.io import Channel, FrfSet, merge_frfs, read_frfs, write_frfs

FREQ = np.arange(15.0, 801.0, 2.0)
SECTION = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
TRUE = jf.Joint([6e5, 5e3], [20.0, 1.5], ["y", "theta"])
ENDS = ("A/13:y", "A/13:theta", "B/1:y", "B/1:theta")
#: Forces of side j and k in a set-up each.
SIDES = [[0, 0, 1, 1]] * 4


@pytest.fixture(scope="module")
def assembly():
    a = jf.Substructure(jf.beam(0.3, 12, ends=("clamped", "free"), **SECTION), ("13:y", "13:theta"), exact=True)
    b = jf.Substructure(jf.beam(0.225, 9, **SECTION), ("1:y", "1:theta"), exact=True)
    return jf.Assembly(a, b, TRUE)


@pytest.fixture(scope="module")
def h(assembly):
    return assembly.receptance(FREQ, ENDS, ENDS)


def noisy(h, seed, level=0.002):
    return jf.pollute(h, level, seed=seed)


def factors(setups, gains):
    """Factor of each FRF, by its set-up."""
    return np.asarray(gains)[setups.of]


def channels(*names):
    return tuple(map(Channel.parse, names))


def one_set(name, excitations, h, quantity="receptance", **more):
    rows = channels("1:y", "2:y", "3:y")
    return FrfSet(np.arange(1.0, 1.0 + len(h)), rows, channels(*excitations), h, quantity, source=name, **more)


def test_merging_keeps_which_frf_came_from_which_setup(tmp_path):
    rng = np.random.default_rng(0)
    h = rng.normal(size=(5, 3, 3)) + 1j * rng.normal(size=(5, 3, 3))
    again = 1.02 * h[:, :, :1]
    first = one_set("first", ["1:y", "2:y"], h[:, :, :2], coherence=np.full((5, 3, 2), 0.9))
    second = one_set("second", ["3:y", "1:y"], np.concatenate([h[:, :, 2:], again], axis=2))
    merged = merge_frfs([first, second])
    np.testing.assert_array_equal(merged.setups.of, [[0, 0, 1]] * 3)
    np.testing.assert_array_equal(merged.h, h)
    assert merged.setups.repeats.tolist() == [[0, 0, 1], [1, 0, 1], [2, 0, 1]]
    np.testing.assert_array_equal(merged.setups.repeated, again[:, :, 0])
    assert "set-ups: first (6 FRFs), second (3 FRFs); 3 measured again" in str(merged)

    # A channel turned round, in another order.
    turned = merged.setups_between(["3:y", "1:-y"], ["3:y", "1:y"])
    assert turned.of.tolist() == [[1, 0], [1, 0]]
    np.testing.assert_array_equal(turned.repeated, np.stack([-again[:, 0, 0], again[:, 2, 0]], axis=1))
    assert turned.repeats.tolist() == [[1, 1, 1], [0, 1, 1]]
    assert merged.at_nodes([2, 3]).setups.of.tolist() == [[0, 1], [0, 1]]
    assert merged.select((2, 3)).setups.repeated.shape == (2, 3)

    for suffix in ("npz", "h5"):
        path = tmp_path / f"merged.{suffix}"
        write_frfs(path, merged)
        read = read_frfs(path).setups
        assert read.names == merged.setups.names
        np.testing.assert_array_equal(read.of, merged.setups.of)
        np.testing.assert_array_equal(read.repeats, merged.setups.repeats)
        np.testing.assert_array_equal(read.repeated, merged.setups.repeated)
        assert (read.gain, read.common_gain) == (None, 0.0)
    with pytest.warns(FileContentWarning, match="does not contain the set-up of each FRF"):
        write_frfs(tmp_path / "merged.csv", merged)


def test_merging_a_merged_set_and_other_quantities():
    h = np.random.default_rng(1).normal(size=(4, 3, 3)) + 1j
    parts = [one_set(name, [f"{i + 1}:y"], h[:, :, i : i + 1]) for i, name in enumerate("abc")]
    i_omega = 2j * np.pi * np.arange(1.0, 5.0)[:, None, None]
    twice = one_set("again", ["1:y", "4:y"], 1.01 * h[:, :, :2] * i_omega, "mobility")
    whole = merge_frfs([merge_frfs([*parts[:2], twice]), parts[2]])
    assert (whole.quantity, whole.setups.names) == ("mobility", ("a", "b", "again", "c"))
    assert [str(channel) for channel in whole.excitations] == ["1:+y", "2:+y", "4:+y", "3:+y"]
    assert whole.setups.of.tolist() == [[0, 1, 2, 3]] * 3
    receptance = whole.receptance()
    np.testing.assert_allclose(receptance.matrix(["1:y", "2:y", "3:y"], ["1:y", "2:y", "3:y"]), h, rtol=1e-12)
    np.testing.assert_allclose(receptance.setups.repeated, 1.01 * h[:, :, 0], rtol=1e-12)


def test_a_set_that_only_repeats_is_another_test():
    h = np.random.default_rng(3).normal(size=(5, 3, 2)) + 1j
    with pytest.raises(FileContentError, match="in a and in b contradict each other, and b adds none"):
        merge_frfs([one_set("a", ["1:y", "2:y"], h), one_set("b", ["1:y"], 1.01 * h[:, :, :1])])


def test_other_frfs_are_no_repetition():
    h = np.random.default_rng(2).normal(size=(5, 3, 1)) + 1j
    for factor in (-1.0, 1000.0, np.exp(0.5j)):
        with pytest.raises(FileContentError, match="FRF 1:\\+y / 1:\\+y in a and in b contradict each other"):
            merge_frfs([one_set("a", ["1:y"], h), one_set("b", ["1:y"], factor * h)])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"of": [[0, 2]]}, "of must contain numbers of 2 set-ups"),
        ({"of": [0, 1]}, "of must contain whole numbers in rows and columns"),
        ({"of": [[0.5, 1]]}, "of must contain whole numbers"),
        ({"gain": -0.1}, "gain must not be negative"),
        ({"common_gain": -0.1}, "common_gain must not be negative"),
        ({"repeats": [[0, 0, 0]]}, "repeats and repeated go together"),
        ({"repeats": [[0, 3, 0]], "repeated": np.ones((4, 1))}, "repeats must contain numbers of responses"),
        ({"repeats": [[0, 0, 0]], "repeated": np.ones((4, 2))}, "repeated must contain numbers in 1 columns"),
        ({"names": []}, "names must name at least one"),
    ],
)
def test_wrong_setups_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        jf.SetUps(**{"names": ["a", "b"], "of": [[0, 1]], **change})


def test_setups_of_other_frfs_are_refused(h):
    with pytest.raises(ValueError, match="setups is of 2 x 2 FRFs, not 4 x 4"):
        jf.identify(FREQ, h, ["y", "theta"], setups=jf.SetUps(["a"], [[0, 0], [0, 0]]))
    short = jf.SetUps(["a", "b"], SIDES, repeats=[[0, 0, 1]], repeated=np.ones((3, 1)))
    with pytest.raises(ValueError, match=f"repeated has 3 lines, not {FREQ.size}"):
        jf.identify(FREQ, h, ["y", "theta"], setups=short)


def test_gains_of_setups_have_their_variance_and_their_names(h):
    """A contrast of n set-ups has n - 1 degrees of freedom: the mean of many variances is the true one."""
    setups = jf.SetUps(["a", "b", "c"], [[0, 0, 1, 2]] * 4)
    found = []
    for seed in range(40):
        gains = 1 + 0.01 * np.random.default_rng(seed).standard_normal(3)
        errors = calibration_errors(FREQ, noisy(h * factors(setups, gains), seed), setups).setups
        found.append(errors.variance[0, 0])
        assert errors.degrees[0, 0] == 2
        for one in errors.deviations:
            apart = gains[setups.names.index(one.name)] - gains.mean()
            assert one.part == "gain"
            assert one.size == pytest.approx(apart, abs=5 * one.error + 1e-4)
    # A mean of 40 variances of two degrees of freedom is known to 16 %.
    assert np.mean(found) == pytest.approx(0.01**2, rel=0.5)


def test_a_late_setup_is_named_with_its_delay(h):
    setups, late = jf.SetUps(["early", "late"], SIDES), 3e-6
    shift = np.exp(-2j * np.pi * FREQ[:, None, None] * factors(setups, [0.0, late]))
    errors = calibration_errors(FREQ, noisy(h * shift, 3), setups).setups
    delays = {one.name: one.delay for one in errors.deviations}
    assert delays == {
        "early": pytest.approx(-late / 2, rel=0.05), "late": pytest.approx(late / 2, rel=0.05),
    }  # fmt: skip


def test_a_setup_whose_resonances_are_lower_is_named(assembly, h):
    """As on a warmer day: h(f) becomes h(f / (1 + d)); another gain alone moves no resonance."""
    setups, lower = jf.SetUps(["cold", "warm"], SIDES), -0.001
    warm = assembly.receptance(FREQ / (1 + lower), ENDS, ENDS)
    errors = calibration_errors(FREQ, noisy(np.where(setups.of == 0, h, warm), 10), setups).setups
    found = {one.name: one for one in errors.deviations if one.part == "resonances"}
    assert {name: one.size for name, one in found.items()} == {
        "cold": pytest.approx(-lower / 2, rel=0.1), "warm": pytest.approx(lower / 2, rel=0.1),
    }  # fmt: skip
    # Resonances at 17.5 to 590 Hz, a few lines wide.
    assert FREQ[0] <= found["warm"].band[0] < found["warm"].band[1] < FREQ[-1]
    apart = noisy(h * factors(setups, [1.0, 1.02]), 10)
    assert {one.part for one in calibration_errors(FREQ, apart, setups).setups.deviations} == {"gain"}


def test_resonances_that_differ_little_are_said_to_cost_coverage(assembly, h):
    warm = assembly.receptance(FREQ / 0.9999, ENDS, ENDS)
    setups = jf.SetUps(["cold", "warm"], SIDES)
    fit = jf.identify(FREQ, noisy(np.where(setups.of == 0, h, warm), 10), ["y", "theta"], setups=setups)
    (one,) = [one for one in fit.findings if one.about == ("warm",) and "resonances" in one.text]
    assert one.severity == "note"
    assert one.variant == "resonances"


def test_repeats_alone_show_what_setups_differ_by(h):
    """FRFs that are not square: only what was measured in both set-ups compares them."""
    rows = noisy(h * np.array([1.0, 1.0, 1.02, 1.02]), 4)[:, :2]
    again = noisy(1.02 * h[:, :2, :1], 5)[:, :, 0]
    setups = jf.SetUps(["a", "b"], SIDES[:2], repeats=[[0, 0, 1], [1, 0, 1]], repeated=again)
    errors = calibration_errors(FREQ, rows, setups, reciprocal=False).setups
    assert {one.name: round(one.size, 3) for one in errors.deviations} == {"a": -0.01, "b": 0.01}
    assert errors.variance[0, 0] == pytest.approx(0.02**2 / 2, rel=0.05)
    none = calibration_errors(FREQ, rows, jf.SetUps(["a", "b"], SIDES[:2]), reciprocal=False)
    assert none is None


def test_intervals_hold_what_all_setups_share(h):
    """Stiffness and damping are in proportion to 1/gain: the variance that a common gain adds is known exactly."""
    measured = noisy(h, 6)
    fits = [
        jf.identify(
            FREQ, measured, ["y", "theta"], damping="viscous", setups=jf.SetUps(["a", "b"], SIDES, common_gain=g)
        )
        for g in (0.0, 0.01)
    ]
    for name in ("k_y", "k_theta"):
        added = fits[1].std_error[name] ** 2 - fits[0].std_error[name] ** 2
        assert np.sqrt(added) / fits[1].value[name] == pytest.approx(0.01, rel=0.01)
    low, high = fits[1].confidence_interval(0.95)["k_y"]
    assert (high - low) / 2 / fits[1].value["k_y"] > 1.9 * 0.01


@pytest.mark.filterwarnings("ignore::jointfrf.errors.FrfCheckWarning", "ignore::jointfrf.errors.IdentificationWarning")
def test_a_stated_gain_counts_unless_setups_exceed_it(h):
    """Gains g of the forces of side j and of side k change C, and 1/k with it, by the root of their product."""
    setups = jf.SetUps(["a", "b"], SIDES, gain=0.002)
    fit = jf.identify(FREQ, noisy(h, 7), ["y", "theta"], damping="viscous", setups=setups)
    assert fit.std_error["k_y"] / fit.value["k_y"] == pytest.approx(0.002 / np.sqrt(2), rel=0.05)
    apart = noisy(h * factors(setups, [1.01, 0.99]), 7)
    found = jf.identify(FREQ, apart, ["y", "theta"], damping="viscous", setups=setups)
    named = next(one for one in found.findings if one.about == ("a",))
    assert named.text.startswith("set-up a: the gain is +1 %")
    assert named.bands == ((FREQ[0], FREQ[-1]),)
    assert any(one.code == "set-up-scatter" and one.variant == "exceeds" for one in found.findings)
    assert found.std_error["k_y"] / found.value["k_y"] == pytest.approx(0.02 / np.sqrt(2) / np.sqrt(2), rel=0.1)


def test_setups_enter_fits_of_models(assembly, h):
    """One set-up of all FRFs between two points, its gain stated: as a gain that all share."""
    start = jf.Assembly(assembly.a, assembly.b, jf.Joint([5e5, 6e3], [15.0, 1.0], ["y", "theta"]))
    measured, errors = noisy(h, 8, 0.01), {}
    for name, setups in {
        "none": None,
        "setup": jf.SetUps(["a"], np.zeros((4, 4)), gain=0.003),
        "common": jf.SetUps(["a"], np.zeros((4, 4)), common_gain=0.003),
    }.items():
        errors[name] = jf.identify_model(FREQ, measured, start, ENDS, ENDS, setups=setups).std_error["k_y"]
    assert errors["setup"] == pytest.approx(errors["common"], rel=1e-9)
    # What 0.3 % of all FRFs do: the minimum of FRFs that are so much larger, before a fit finds their gain.
    moved = []
    for gain in (1 - 2e-4, 1 + 2e-4):
        channels = Channels(ENDS, ENDS)
        problem = prepare_model_fit(FREQ, measured * gain, start, channels, NoiseOptions(sensor_mass=0.0), ())
        x = minimise(problem.likelihood, problem.vector.to_coordinates(problem.vector.values), least=1e-9).x
        moved.append(dict(zip(start.joint.names, problem.vector.to_values(x), strict=True))["k_y"])
    expected = abs(moved[1] - moved[0]) / 4e-4 * 0.003
    assert np.sqrt(errors["common"] ** 2 - errors["none"] ** 2) == pytest.approx(expected, rel=0.1)


def test_the_same_numbers_merged_and_given_at_once(h):
    """FRFs of agreeing set-ups give the joint of one set-up, and no narrower interval."""
    measured = noisy(h, 9)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one = jf.identify(FREQ, measured, ["y", "theta"], damping="viscous")
        two = jf.identify(FREQ, measured, ["y", "theta"], damping="viscous", setups=jf.SetUps(["a", "b"], SIDES))
    assert one.value == two.value
    for name, (low, high) in one.confidence_interval().items():
        assert two.confidence_interval()[name][0] <= low
        assert two.confidence_interval()[name][1] >= high
