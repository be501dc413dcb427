"""What a look at measured FRFs finds, how it says so, and what it corrects."""

import json
import warnings

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.channels.check.amplitude import amplitude_of_channels
from jointfrf.channels.check.check import warn_of_frfs
from jointfrf.channels.check.pair_ratios import ratio_line
from measurement_errors import ERRORS, KINDS_OF_NOISE, check_with_error, measured, names, structure
from time_records import time_test

S = structure("3.3")
NAMES = names(S)


def noisy(seed=1, level=0.02):
    return measured(S, "complex", level, seed)[1]


@pytest.mark.parametrize("kind", KINDS_OF_NOISE)
@pytest.mark.parametrize("name", ["3.1", "3.2", "3.3", "six"])
def test_noise_alone_is_no_finding(name, kind):
    s = structure(name)
    for level in (0.005, 0.1):
        freq, h = measured(s, kind, level, 5)
        assert jf.check_frfs(freq, h, names(s)).findings == ()


def _marks(name, error, seed):
    """What is wrong is drawn by the seed: of six DOFs another one shows another way to exchanged and doubled ones."""
    is_other_way = name == "six" and error.endswith(("exchanged", "doubled"))
    return () if seed == 0 or is_other_way else pytest.mark.long


@pytest.mark.parametrize(
    ("name", "error", "seed"),
    [
        pytest.param(name, error, seed, marks=_marks(name, error, seed))
        for name in ("3.3", "six")
        for error in ERRORS
        for seed in (0, 3)
    ],
)
def test_errors_are_found_with_their_channel_and_nothing_else(name, error, seed):
    reported = check_with_error(structure(name), ERRORS[error], "complex", 0.02, seed)
    assert reported.found, reported.check
    assert reported.alone, reported.check


def test_without_noise_nothing_is_found():
    for name in ("3.1", "3.2", "3.3", "six"):
        s = structure(name)
        assert jf.check_frfs(s.freq, s.gamma, names(s)).findings == ()


def test_numbers_of_gain_and_delay_have_true_errors():
    gains, delays = [], []
    for seed in range(10):
        h = noisy(seed)
        h[:, 2] *= 1.07 * np.exp(-2j * np.pi * S.freq * 30e-6)[:, None]
        found = {finding.code: finding for finding in jf.check_frfs(S.freq, h, NAMES).findings}
        assert found["channel-gain"].about == found["channel-delay"].about == ("k:Fy",)
        gains.append(found["channel-gain"].numbers["factor"])
        delays.append(found["channel-delay"].numbers["delay"])
    # 2 % noise: 0.02 of the logarithm of a ratio on each line, on 786 lines, against the mean of three channels.
    expected = 0.02 / np.sqrt(786) * np.sqrt(2 / 3)
    assert np.mean(gains) == pytest.approx(1.07, abs=4 * expected / np.sqrt(10))
    assert 0.4 * expected < np.std(np.log(gains)) < 2 * expected
    assert np.mean(delays) == pytest.approx(30, abs=1)


@pytest.mark.parametrize("name", ["3.3", "six"])
def test_a_delay_is_found_in_noise_that_is_correlated_over_lines(name):
    for error in ("delay of a sensor, 20 us", "delay of a force, 20 us"):
        for seed in range(4):
            reported = check_with_error(structure(name), ERRORS[error], "correlated 25", 0.05, seed)
            assert reported.found, reported.check
            assert reported.alone, reported.check


@pytest.mark.parametrize("kind", ["complex", "correlated 25"])
def test_the_error_of_a_delay_is_that_of_its_scatter(kind):
    """Where the phase is known at 0 Hz, and on 786 lines that say as much as 31."""
    omega = 2 * np.pi * S.freq
    z = []
    for seed in range(40):
        h = measured(S, kind, 0.05, seed)[1]
        line = ratio_line(omega, np.log(h[:, :1, 3] / h[:, 3, :1]), np.zeros(1), np.ones(1, bool))
        z.append(line.slope[0] / line.slope_error[0])
        assert abs(line.phase_at_zero()[0]) < 1e-12
    assert 0.75 < np.sqrt(np.mean(np.square(z))) < 1.6
    if kind == "complex":
        expected = 0.05 / np.sqrt((omega**2).sum())  # var Im log(h_pq/h_qp) = 2 * 0.05^2 / 2
        assert line.slope_error[0] == pytest.approx(expected, rel=0.1)


def test_a_phase_that_is_no_sign_is_fitted_beside_the_delay():
    omega = 2 * np.pi * S.freq
    rng = np.random.default_rng(1)
    noise = 0.01 * (rng.standard_normal((omega.size, 1)) + 1j * rng.standard_normal((omega.size, 1)))
    turn = np.array([0.3])
    line = ratio_line(omega, noise + 1j * 1e-6 * (omega - omega.mean())[:, None], turn, np.ones(1, bool))
    assert line.phase_at_zero()[0] == pytest.approx(0.3 - 1e-6 * omega.mean(), abs=0.005)
    assert line.slope[0] == pytest.approx(1e-6, rel=0.8)
    quarter = ratio_line(omega, noise, turn * 0 + np.pi / 2, np.ones(1, bool))
    assert quarter.phase_at_zero()[0] == pytest.approx(np.pi / 2, abs=1e-12)


def test_of_two_channels_the_copy_is_the_one_that_is_no_driving_point():
    for error in ("response doubled", "force doubled"):
        for seed in range(6):
            for kind in ("complex", "floor", "correlated 25"):
                reported = check_with_error(structure("3.1"), ERRORS[error], kind, 0.05, seed)
                assert reported.found, reported.check
                assert reported.alone, reported.check
                (finding,) = reported.check.findings
                assert names(structure("3.1"))[seed % 2] in finding.about[1]


def test_a_copy_is_not_taken_for_the_other_side_of_a_stiff_joint():
    """Both sides of the joint of case 3.2 move alike, except on a few lines of some FRFs."""
    for error, word in (("response doubled", "response"), ("force doubled", "force")):
        (finding,) = check_with_error(structure("3.2"), ERRORS[error], "complex", 0.005, 1).check.findings
        assert finding.about == (f"{word} k:Fy", f"{word} j:Mtheta")


def test_an_exchange_is_found_together_with_a_gain():
    """A gain adds the same misfit to pairs as measured and under any hypothesis."""
    s = structure("six")
    freq, h = measured(s, "complex", 0.02, 5)
    h = h[:, [3, 1, 2, 0, *range(4, 12)]]
    h[:, 5] *= 3
    found = jf.check_frfs(freq, h, names(s)).findings
    assert {(one.code, frozenset(one.about)) for one in found} == {
        ("exchanged-channels", frozenset({names(s)[0], names(s)[3]})), ("channel-gain", frozenset({names(s)[5]})),
    }  # fmt: skip


def test_two_exchanges_are_both_found():
    s = structure("six")
    freq, h = measured(s, "complex", 0.02, 4)
    h = h[:, [1, 0, 2, 3, 4, 8, 6, 7, 5, 9, 10, 11]]
    found = jf.check_frfs(freq, h, names(s), fix=["exchanged"])
    codes = [finding.code for finding in found.findings]
    pairs = {frozenset(finding.about) for finding in found.findings}
    assert codes == ["exchanged-channels"] * 2
    assert pairs == {frozenset(names(s)[i] for i in pair) for pair in ((0, 1), (5, 8))}
    assert jf.check_frfs(freq, found.h, names(s)).ok


@pytest.mark.parametrize(
    ("fix", "code", "change"),
    [
        ("gain", "channel-gain", lambda h: h[:, 1].__imul__(1.1)),
        ("sign", "driving-point-sign", lambda h: h[:, 1].__imul__(-1)),
        ("units", "channel-unit", lambda h: h[:, 1].__imul__(180 / np.pi)),
        ("delay", "channel-delay", lambda h: h[:, 1].__imul__(np.exp(-2j * np.pi * S.freq * 50e-6)[:, None])),
        ("quantity", "quantity", lambda h: h.__imul__((2j * np.pi * S.freq)[:, None, None] ** 2)),
        ("time-convention", "time-convention", lambda h: np.conj(h, out=h)),
        ("exchanged", "exchanged-channels", lambda h: h.__setitem__((slice(None), [1, 3]), h[:, [3, 1]])),
    ],
)
def test_a_correction_gives_the_data_back(fix, code, change):
    exact = noisy()
    wrong = exact.copy()
    change(wrong)
    kept = wrong.copy()
    check = jf.check_frfs(S.freq, wrong, NAMES, fix=[fix])
    assert [finding.code for finding in check.findings] == [code]
    assert len(check.changes) == 1
    np.testing.assert_array_equal(wrong, kept)
    assert (abs(check.h - exact) / abs(exact)).max() < 0.02
    assert jf.check_frfs(S.freq, check.h, NAMES).ok
    untouched = jf.check_frfs(S.freq, wrong, NAMES)
    assert untouched.changes == ()
    np.testing.assert_array_equal(untouched.h, wrong)


def test_a_force_may_be_blamed_instead():
    exact = noisy()
    wrong = exact.copy()
    wrong[:, :, 1] *= 0.8
    check = jf.check_frfs(S.freq, wrong, NAMES, fix=["gain"], blame="forces")
    np.testing.assert_allclose(check.h, exact, rtol=0.01)
    (finding,) = check.findings
    assert finding.numbers["factor"] == pytest.approx(1 / 0.8, rel=0.01)
    assert "does not show which" in finding.text


def test_bad_lines_can_be_left_out():
    h = noisy()
    h[7, 2, 1] = np.nan
    h[9, 2, 3] = np.inf
    freq = S.freq.copy()
    freq[0] = 0
    check = jf.check_frfs(freq, h, NAMES, fix=["lines"])
    assert [finding.code for finding in check.findings] == ["not-finite", "zero-frequency"]
    assert check.findings[0].about == ("response k:Fy",)
    assert "2 of 786 lines, first at line 7 (22 Hz)" in check.findings[0].text
    assert check.h.shape[0] == check.freq_hz.size == 783
    assert np.isfinite(check.h).all()


def test_frequencies_that_do_not_increase():
    freq = S.freq.copy()
    freq[100] = freq[99]
    (finding,) = jf.check_frfs(freq, noisy(), NAMES).findings
    assert finding.code == "frequency-order"
    assert "line 100" in finding.text


def test_responses_and_forces_of_different_sets():
    """Driving points are known by their names, and by the direction in which they point."""
    h = noisy()[:, :, [2, 0, 1]]
    h[:, :, 1] *= -1
    labels = ["1:+y", "1:+rz", "2:+y", "2:+rz"]
    assert jf.check_frfs(S.freq, h, responses=labels, forces=["2:y", "1:-y", "1:rz"]).ok
    (finding,) = jf.check_frfs(S.freq, h, responses=labels, forces=["2:y", "1:y", "1:rz"]).findings
    assert (finding.code, finding.about) == ("driving-point-sign", ("1:+y",))
    apart = jf.check_frfs(S.freq, h, responses=labels, forces=["7:y", "8:y", "9:y"])
    assert apart.ok
    assert "fewer than two DOFs" in apart.unseen
    assert [
        f.code for f in jf.check_frfs(S.freq, h.conj(), responses=labels, forces=["7:y", "8:y", "9:y"]).findings
    ] == ["time-convention"]


def test_virtual_points_from_different_sensors_and_impacts():
    """No driving point among the channels: the joint DOFs show a wrong sign, and units."""
    rng = np.random.default_rng(4)
    sensors, impacts = (
        np.kron(np.eye(2), np.array([[1.0, a], [1.0, b], [1.0, c]])) for a, b, c in rng.uniform(-0.03, 0.03, (2, 3))
    )
    h = jf.pollute(sensors @ S.gamma @ impacts.T, 0.01, seed=2)
    channels = dict(responses=[f"{i}:y" for i in range(1, 7)], forces=[f"{i}:y" for i in range(11, 17)])
    transform = np.linalg.pinv(sensors), np.linalg.pinv(impacts)
    assert jf.check_frfs(S.freq, h, **channels, transform=transform, dofs=["y", "theta"]).ok
    (finding,) = jf.check_frfs(S.freq, -h, **channels, transform=transform).findings
    assert finding.code == "driving-point-sign"
    assert {name.partition(":")[2] for name in finding.about} <= {"0", "1"}
    wrong = jf.check_frfs(S.freq, -h, **channels, transform=transform, dofs=["y", "theta"])
    assert [finding.code for finding in wrong.findings] == ["driving-point-sign"]
    degrees = np.diag([1, 180 / np.pi, 1, 1]) @ transform[0]
    (finding,) = jf.check_frfs(S.freq, h, **channels, transform=(degrees, transform[1]), dofs=["y", "theta"]).findings
    assert (finding.code, finding.about) == ("channel-unit", ("j:theta",))
    with pytest.raises(ValueError, match="dofs must name 2 joint DOFs"):
        jf.check_frfs(S.freq, h, **channels, transform=transform, dofs=["y"])


def test_two_sides_that_cannot_be_told_apart_are_both_named():
    s = structure("3.1")
    freq, h = measured(s, "complex", 0.02, 1)
    h[:, 0] *= 1.1
    (finding,) = jf.check_frfs(freq, h, ["j:x", "k:x"]).findings
    assert finding.code == "channel-gain"
    assert "j:x" in finding.text
    assert "k:x" in finding.text


def test_a_structure_that_gives_out_energy():
    a = jf.chain([4, 2, 3], [2000, 2500, 900], [6, 4, 4], ground="start")
    freq = np.linspace(0.5, 8, 600)
    h = a.receptance(freq)
    near = abs(freq - freq[np.argmax(abs(h[:, 0, 0]))]) < 1
    h[near] = h[near].conj()
    assert "passivity" in {finding.code for finding in jf.check_frfs(freq, jf.pollute(h, 0.02)).findings}


def test_data_made_reciprocal_and_stiff_joints_are_no_finding(beams):
    h = noisy()
    assert jf.check_frfs(S.freq, (h + h.swapaxes(1, 2)) / 2, NAMES).ok
    for factor in (1, 30, 1000):
        joint = jf.Joint([6e5 * factor, 5e3 * factor], [20, 1.5], ["y", "theta"])
        for level in (0.005, 0.05):
            assert jf.check_frfs(beams.freq, jf.pollute(beams.gamma(joint), level, seed=1)).ok


def test_one_driving_point_alone():
    h = noisy()[:, :1, :1]
    assert jf.check_frfs(S.freq, h, ["y"]).ok
    assert [finding.code for finding in jf.check_frfs(S.freq, -h, ["y"]).findings] == ["driving-point-sign"]
    assert [finding.code for finding in jf.check_frfs(S.freq, h.conj(), ["y"]).findings] == ["time-convention"]
    assert [finding.code for finding in jf.check_frfs(S.freq, 0 * h, ["y"]).findings] == [
        "dead-channel",
        "dead-channel",
    ]


def test_all_channels_dead():
    assert {finding.code for finding in jf.check_frfs(S.freq, 0 * noisy(), NAMES).findings} == {"dead-channel"}


def test_few_lines_are_not_judged():
    assert jf.check_frfs(S.freq[:5], -noisy()[:5]).ok


def test_warnings_text_and_dictionary_say_the_same():
    h = noisy()
    h[:, 0] *= -1
    check = jf.check_frfs(S.freq, h, NAMES)
    (finding,) = check.findings
    with pytest.warns(jf.FrfCheckWarning, match=r"the response j:Fy points against its force.*\[driving-point-sign\]$"):
        warn_of_frfs(check.findings)
    assert not check.ok
    assert str(finding) in str(check)
    content = json.loads(json.dumps(check.to_dict(), allow_nan=False))
    assert content["findings"][0]["text"] == finding.text
    assert content["findings"][0]["code"] == "driving-point-sign"
    assert content["findings"][0]["about"] == ["j:Fy"]


def test_identify_looks_first(beams):
    h = jf.pollute(beams.gamma(beams.joint), 0.01, seed=3)
    with pytest.raises(jf.FrfCheckError, match=r"exp\(-i w t\).*\[time-convention\]$"):
        jf.identify(beams.freq, h.conj(), ["y", "theta"])
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        fit = jf.identify(beams.freq, h.conj(), ["y", "theta"], accept=["time-convention"])
    said = [str(w.message) for w in caught if w.category is jf.FrfCheckWarning]
    assert said == [one.message for one in fit.findings if one.code == "time-convention"]
    assert len(said) == 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(names=["a", "b"]), "names must name 4 different channels"),
        (dict(names=["a", "a", "b", "c"]), "names must name 4 different channels"),
        (dict(responses=["a", "b", "c", "d"]), "responses or forces are missing"),
        (dict(names=list("abcd"), forces=list("abcd")), "names are of responses and forces alike"),
        (dict(fix=["all"]), "fix must be one of lines, time-convention"),
        (dict(blame="me"), "blame must be one of responses, forces"),
        (dict(h=np.ones((786, 4, 3))), "4 responses and 3 forces; name them"),
        (dict(freq_hz=[1.0]), r"freq_hz must have shape \(786\)"),
    ],
)
def test_bad_arguments_get_one_sentence(change, message):
    with pytest.raises(ValueError, match=message):
        jf.check_frfs(**(dict(freq_hz=S.freq, h=noisy()) | change))


def wrongly_read(what):
    """FRFs whose magnitudes or phases a file states in another way than it was read."""
    h = noisy()
    omega = 2 * np.pi * S.freq[:, None, None]
    if what == "radians as degrees":
        return abs(h) * np.exp(1j * np.radians(np.angle(h))), "receptance"
    if what == "radians as degrees, accelerance":
        wrong = -(omega**2) * h
        return abs(wrong) * np.exp(1j * np.radians(np.angle(wrong))) / -(omega**2), "accelerance"
    if what == "no sign":
        return abs(h) * np.exp(1j * abs(np.angle(h))), "receptance"
    if what == "no sign, mobility":
        wrong = 1j * omega * h
        return abs(wrong) * np.exp(1j * abs(np.angle(wrong))) / (1j * omega), "mobility"
    return 20 * np.log10(abs(h)) * np.exp(1j * np.angle(h)), "receptance"


@pytest.mark.parametrize(
    ("what", "code"),
    [
        ("radians as degrees", "phase-unit"),
        ("radians as degrees, accelerance", "phase-unit"),
        ("no sign", "unsigned-phase"),
        ("no sign, mobility", "unsigned-phase"),
        ("decibels", "decibel"),
    ],
)
def test_numbers_that_were_read_wrongly_are_the_only_finding(what, code):
    h, quantity = wrongly_read(what)
    assert [one.code for one in jf.check_frfs(S.freq, h, NAMES, read_as=quantity).findings] == [code]
    with pytest.raises(jf.FrfCheckError, match=rf"\[{code}\]$"):
        jf.identify(S.freq, wrongly_read(what.split(",")[0])[0], S.dofs)


def test_quiet_or_undamped_frfs_are_not_read_wrongly():
    """Below the first resonance, of one driving point alone, and without any damping."""
    some = S.freq < 40
    assert jf.check_frfs(S.freq[some], noisy()[some], NAMES).ok
    assert jf.check_frfs(S.freq, noisy()[:, :1, :1], ["y"]).ok
    a = jf.chain([4, 2, 3], [2000, 2500, 900], [0, 0, 0], ground="start")
    freq = np.linspace(0.5, 8, 600)
    codes = {one.code for one in jf.check_frfs(freq, a.receptance(freq)).findings}
    assert not codes & {"phase-unit", "unsigned-phase", "decibel"}


@pytest.mark.parametrize("seed", range(12))
def test_linear_tests_with_leakage_are_not_amplitude_dependent(seed):
    one = time_test(seed)
    assert amplitude_of_channels(one.freq_hz, one.h, *(list(map(str, range(n))) for n in one.h.shape[1:])) == []


@pytest.mark.parametrize("step", [40, 26, 20])
def test_coarse_lines_are_not_dead_but_noise_on_them_is(step):
    """Between 20 to 40 lines over nine resonances the phase turns at random, as that of noise."""
    freq, h = S.freq[::step], noisy()[::step]
    assert jf.check_frfs(freq, h, NAMES).findings == ()
    rng = np.random.default_rng(4)
    for is_row in (True, False):
        bad = h.copy()
        own = bad[:, 1] if is_row else bad[:, :, 1]
        own[:] = np.median(abs(own)) * (rng.standard_normal(own.shape) + 1j * rng.standard_normal(own.shape))
        (finding,) = jf.check_frfs(freq, bad, NAMES).findings
        assert (finding.code, finding.about) == ("dead-channel", (f"{'response' if is_row else 'force'} {NAMES[1]}",))
        assert finding.numbers["agreement"] < finding.numbers["least"]


def test_an_average_from_another_point_is_named(beams):
    """One record of five in one column: that channel is named, and none where all are right or one is only noisy."""
    gamma = beams.gamma(beams.joint)
    names = ["j:y", "j:theta", "k:y", "k:theta"]
    for seed in range(10):
        wrong, weak = gamma.copy(), jf.pollute(gamma, 0.002, seed=seed)
        wrong[:, :, 2] = 0.9 * gamma[:, :, 2] + 0.1 * gamma[:, :, 0]
        weak[:, 3] = jf.pollute(gamma, 0.2, seed=seed)[:, 3]
        for h, expected in ((jf.pollute(wrong, 0.002, seed=seed), [("k:y",)]), (weak, [])):
            found = jf.check_frfs(beams.freq, h, names).findings
            assert [one.about for one in found if one.code == "channel-inconsistent"] == expected


def test_a_rotor_is_gyroscopic_and_reversed_sensors_are_not():
    """Four shaft nodes in two directions, with skew gyroscopic terms: h_xy = -h_yx."""
    freq, n = np.linspace(20, 600, 400), 4
    omega = 2 * np.pi * freq
    chain = 1e6 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    gyroscopic = np.kron([[0, 1], [-1, 0]], 300 * np.diag(np.linspace(0.5, 1, n)))
    z = np.kron(np.eye(2), chain) * (1 + 0.01j) + 1j * omega[:, None, None] * gyroscopic
    h = np.linalg.inv(z - omega[:, None, None] ** 2 * np.eye(2 * n))
    rows = [1, 2, n + 1, n + 2]
    h, names = jf.pollute(h[:, rows][:, :, rows], 0.01, seed=1), ["a:x", "b:x", "a:y", "b:y"]
    (found,) = jf.check_frfs(freq, h, names).findings
    assert (found.code, found.severity) == ("gyroscopic", "error")
    symmetric = (h + h.swapaxes(1, 2) * np.outer([1, 1, -1, -1], [1, 1, -1, -1])) / 2
    reversed_x = jf.pollute(abs(symmetric) * 0 + symmetric * np.outer([1, 1, -1, -1], [1, 1, 1, 1]), 0.01, seed=2)
    assert "gyroscopic" not in [one.code for one in jf.check_frfs(freq, reversed_x, names).findings]
    order = [0, 2, 1, 3]
    fit = jf.identify(freq, h[:, order][:, :, order], ["x", "y"], reciprocal=False, damping="hysteretic")
    np.testing.assert_allclose(fit.stiffness, 1e6, rtol=0.01)
    with pytest.raises(jf.FrfCheckError, match="gyroscopic"):
        jf.identify(freq, h[:, order][:, :, order], ["x", "y"])
