"""A joint at several levels against an independent solver: an Iwan joint in a beam, balanced with its harmonics."""

import csv
import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eig
from scipy.optimize import brentq

import jointfrf as jf
from harmonic_balance import SECTION, Sliders, believed, iwan_beam
from jenkins_balance import Jenkins, JenkinsBeam
from jointfrf.identification.derived import Derived
from jointfrf.io import write_frfs
from jointfrf.workbench.amplitude.friction import iwan
from jointfrf.workbench.amplitude.levels import JointLevel, of_levels
from jointfrf.workbench.cli.main import main

IWAN = (20.0, 1.2e5, -0.4, 0.8)
FREQ_HZ = np.arange(180.0, 400.5, 2.0)
CHANNELS = ["A/1:y", "A/15:y", "B/9:y", "B/25:y"]
#: Of fits whose parameters are not all well determined, which is not looked at here.
pytestmark = pytest.mark.filterwarnings("ignore::jointfrf.IdentificationWarning", "ignore::jointfrf.FrfCheckWarning")
CASE = Path(__file__).resolve().parents[3] / "cases" / "iwan-beam"


@pytest.fixture(scope="module")
def beam():
    return iwan_beam(Sliders.iwan(*IWAN), youngs_modulus=(1.004 * 210e9, 0.998 * 210e9), loss_factor=0.0012)


def fitted(h, noise=0.01, seed=1, **options):
    measured = jf.pollute(h[:, :, None], noise, seed=seed)
    return jf.identify_model(FREQ_HZ, measured, believed(), CHANNELS, CHANNELS[:1], **options)


def test_sliders_have_the_first_harmonic_of_the_formula():
    sliders = Sliders.iwan(*IWAN)
    a = sliders.limit[-1] * np.geomspace(0.01, 3, 7)
    assert_allclose(sliders.first_harmonic(a), iwan(a, *IWAN), rtol=1e-3)


@pytest.mark.parametrize("freq_hz", [240.0, pytest.param(262.0, marks=pytest.mark.long)])
def test_harmonic_balance_agrees_with_time_integration(freq_hz):
    small = iwan_beam(Sliders.iwan(*IWAN), elements=4, loss_factor=0.0, viscous=4e-5)
    steady = small.at_force(np.array([freq_hz]), 30.0)
    channels, joint = small.integrated(freq_hz, 30.0, 60, 300)
    assert_allclose(abs(joint), steady.joint[0], rtol=1e-3)
    # far from its rest: the joint is half slipping
    assert 0.3 < steady.joint[0] / small.joint.limit[-1] < 1.2
    assert_allclose(channels / 30, steady.h[0], rtol=0, atol=5e-3 * abs(steady.h).max())


@pytest.mark.parametrize(
    ("control", "level"),
    [
        ("joint", 5e-5),
        ("response", 5e-5),
        *(pytest.param(*each, marks=pytest.mark.long) for each in (("response", 4e-6), ("force", 3.0))),
    ],
)
def test_stiffness_and_loss_factor_are_those_at_the_amplitude_found(beam, control, level):
    if control == "joint":
        steady, drive = (
            beam.at_joint_amplitude(FREQ_HZ, np.full(FREQ_HZ.size, level)),
            jf.Drive("joint", level, "theta_z"),
        )
    elif control == "response":
        steady, drive = beam.at_response(FREQ_HZ, 3, level), jf.Drive("response", level, "B/25:y")
    else:
        steady, drive = beam.at_force(FREQ_HZ, level), jf.Drive("force", level)
    # under a force held the resonance moves
    fit = fitted(steady.h)
    assert control == "force" or "amplitude-dependent" not in [each.code for each in fit.findings]
    found = jf.levels([fit], [drive], laws=())
    assert "amplitude-dependent" not in [each.code for each in found.findings]
    (one,) = found.levels["theta_z"]
    true = beam.joint.first_harmonic(np.array([one.amplitude]))[0]
    assert steady.joint.min() < one.amplitude * 1.01
    assert one.amplitude < steady.joint.max() * 1.01
    assert abs(one.stiffness.value - true.real) < 3 * one.stiffness.std_error < 0.2 * true.real
    assert abs(one.loss_factor.value - true.imag / true.real) < 3 * one.loss_factor.std_error
    assert_allclose(one.force, one.amplitude * abs(true), rtol=0.1)
    assert (one.order == 0) == (control == "joint")


def test_motion_held_as_velocity_and_acceleration_is_the_same_test(beam):
    freq = np.array([250.0])
    found = [
        beam.at_response(freq, 3, 1e-5 * (2 * np.pi * freq[0]) ** power, power).joint[0] for power in range(3)
    ]  # fmt: skip
    assert_allclose(found, found[0], rtol=1e-5)
    fit = fitted(beam.at_joint_amplitude(FREQ_HZ, np.full(FREQ_HZ.size, 2e-6)).h)
    shown = [
        jf.levels([fit], [jf.Drive("response", 1.0, "B/25:y", quantity)], laws=()).levels["theta_z"][0].amplitude
        for quantity in ("displacement", "velocity", "acceleration")
    ]
    omega = 2 * np.pi * np.array([FREQ_HZ[0], FREQ_HZ[-1]])
    for slower, faster in zip(shown[1:], shown, strict=False):
        assert omega[0] < faster / slower < omega[1]


def chains(k_of_line):
    """FRFs between both DOFs of a joint that has another stiffness on each line."""
    freq = np.linspace(0.5, 10, 300)
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq, [1])
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq, [0])
    return freq, jf.couple(a, b, k_of_line(freq, a, b)[:, None, None], [0], [0])


def softening(freq, a, b):
    """K* that falls with the relative motion under a force of 1 N, found by iteration."""
    k = np.full(freq.size, 2000.0 + 100j)
    for _ in range(200):
        motion = abs(a / (1 + k[:, None, None] * (a + b)))[:, 0, 0]
        k = 0.9 * k + 0.1 * 2000 * (1 + 0.05j) / (1 + motion / 1e-3)
    return k


def test_frfs_at_the_joint_whose_stiffness_is_no_smooth_function_of_amplitude_have_wide_intervals():
    freq, h = chains(softening)
    fit = jf.identify(freq, jf.pollute(h, 0.01, seed=2), ["x"], damping="hysteretic")
    freq, h = chains(lambda freq, a, b: np.full(freq.size, 2000 + 100j))
    good = jf.identify(freq, jf.pollute(h, 0.01, seed=2), ["x"], damping="hysteretic")
    found = jf.levels([fit, good], [jf.Drive("force", 1.0)] * 2, labels=["high", "low"], laws=())
    assert [one.test for one in found.findings if one.code == "amplitude-not-smooth"] == ["high"]
    own = {one.label: one.stiffness for one in found.levels["x"]}
    parts = [jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq, [1])]
    parts.append(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq, [0]))
    true = np.sort(softening(freq, *parts).real)
    low, high = true[[len(true) // 40, -len(true) // 40]]
    assert own["high"].low < own["high"].value < own["high"].high
    assert own["high"].high - own["high"].low > 0.5 * (high - low)
    assert own["low"].high - own["low"].low < 0.02 * 2000


@pytest.mark.parametrize(
    ("joint", "force", "lines", "seed"),
    [((9e4, 3e4, 2e-5), 2.4737, FREQ_HZ, 6),
     *(pytest.param((4e4, 8e4, 1e-5), 0.2 * 100 ** (i / 11), np.arange(215.0, 255.0, 0.5), i, marks=pytest.mark.long)
       for i in (2, 3, 6))],
)  # fmt: skip
@pytest.mark.filterwarnings("ignore::jointfrf.ConvergenceWarning")
def test_a_slider_under_a_force_is_announced_and_its_interval_covers_the_joint(joint, force, lines, seed):
    """K* has a kink where the slider begins to slip, which no cubic in ln a follows."""
    moduli = tuple(210e9 * (1 + 0.01 * np.random.default_rng([11, seed]).normal(size=2)))
    beam = JenkinsBeam(Jenkins(*joint), moduli)
    steady = beam.at_force(lines, force)
    h = jf.pollute(steady.h[:, :, None], 0.01, seed=seed)
    fit = jf.identify_model(lines, h, believed(), CHANNELS, CHANNELS[:1])
    found = jf.levels([fit], [jf.Drive("force", force)], laws=())
    assert "amplitude-not-smooth" in [one.code for one in found.findings]
    (one,) = found.levels["theta_z"]
    true = beam.joint.secant(one.amplitude)
    assert one.stiffness.low < true.real < one.stiffness.high


def test_models_that_are_wrong_leave_no_level_out():
    """Response control of a linear joint: what the models miss is not read as amplitude, but widens the interval."""
    k, loss = 1.1e5, 0.03
    beam = JenkinsBeam(Jenkins(k * (1 + 1j * loss), 0.0, 1.0))
    beam.m += 0.06 * np.outer(beam.channels[2], beam.channels[2])  # a mass that no model has
    h = beam.at_force(FREQ_HZ, 1.0).h[:, :, None]
    fit = jf.identify_model(FREQ_HZ, jf.pollute(h, 0.01, seed=1), believed(), CHANNELS, CHANNELS[:1])
    found = jf.levels([fit], [jf.Drive("response", 1e-5, "B/25:y")], laws=())
    (one,) = found.levels["theta_z"]
    (own,) = (each for each in fit.parameters if each.name == "k_theta_z")
    assert one.stiffness.low < k < one.stiffness.high
    assert one.stiffness.high - one.stiffness.low > np.ptp(fit.confidence_interval(0.95)[own.name])


def test_a_fit_without_damping_has_a_loss_factor_with_an_interval():
    freq, h = chains(lambda freq, a, b: np.full(freq.size, 2000 + 20j))
    fit = jf.identify(freq, jf.pollute(h, 0.01, seed=3), ["x"], damping="none")
    (one,) = jf.levels([fit], [jf.Drive("joint", 1e-3, "x")], laws=()).levels["x"]
    assert one.loss_factor.low < 0.01 < one.loss_factor.high
    assert 0 < one.loss_factor.std_error < 0.01


@pytest.fixture(scope="module")
def of_two_springs():
    """FRFs at both ends of two springs whose stiffness falls with their motion under 1 N, and of two linear ones."""
    freq, k = np.linspace(0.5, 5, 400), 2000 * (1 + 0.02j)
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    linear = jf.couple(a, b, np.broadcast_to(k * np.eye(2), (freq.size, 2, 2)), [0, 1], [0, 1])
    h = linear.copy()
    for column in range(4):
        for _ in range(100):
            motion = abs(h[:, :2, column] - h[:, 2:, column])
            moved = k / (1 + motion / 0.02)
            h[:, :, column] = jf.couple(a, b, moved[:, :, None] * np.eye(2), [0, 1], [0, 1])[:, :, column]
    return freq, jf.pollute(h, 0.01, seed=2), jf.pollute(linear, 0.01, seed=2)


@pytest.mark.parametrize("named", [False, True])
@pytest.mark.parametrize("reciprocal", [False, True])
def test_amplitude_dependent_frfs_at_the_joint_are_named_and_widen_intervals(of_two_springs, named, reciprocal):
    freq, h, linear = of_two_springs
    options = {"transform": (np.eye(4), np.eye(4) + 1e-12)} if named else {}
    with pytest.warns(jf.FrfCheckWarning, match=r"are amplitude-dependent: the resonance.*\[amplitude-dependent\]$"):
        fit = jf.identify(freq, h, ["x", "y"], reciprocal=reciprocal, **options)
    assert fit.findings[0].code == "amplitude-dependent"
    assert fit.findings[0].severity == "warning"
    assert fit.findings[0].about == ("force force 0" if named else "force j:x",)
    whole = jf.identify(freq, linear, ["x", "y"], reciprocal=reciprocal, **options)
    assert "amplitude-dependent" not in [each.code for each in whole.findings]
    assert "off-axis" not in [each.code for each in fit.findings]  # what breaks reciprocity here
    # stiffness over the lines: from 1561 to 2000 N/m, 1978 in the median
    limits = fit.confidence_interval(0.95)
    for name, interval in whole.confidence_interval(0.95).items():
        low, high = limits.pop(name)
        assert high - low > 2 * np.ptp(interval)
        assert name[0] == "h" or low < 1978 < high + 10
    # So wide intervals may not exclude a second kind of damping, which is then told.
    averaged = [dof for one in fit.findings if one.code == "damping-averaged" for dof in one.about]
    assert {name[2:] for name in limits} <= set(averaged)


def test_amplitude_dependent_frfs_of_channels_are_named_and_widen_intervals(believed_beam):
    freq = np.arange(215.0, 255.0, 0.5)
    steady = believed_beam[0].at_force(freq, 1.0)
    h = jf.pollute(steady.h[:, :, None], 0.01, seed=3)
    with pytest.warns(jf.FrfCheckWarning, match=r"FRFs of force A/1:y are amplitude-dependent: the resonance at 23"):
        fit = jf.identify_model(freq, h, believed(), CHANNELS, CHANNELS[:1])
    assert fit.findings[0].code == "amplitude-dependent"
    assert fit.findings[0].about == ("force A/1:y",)
    true = believed_beam[0].joint.first_harmonic(steady.joint).real
    low, high = fit.confidence_interval(0.95)["k_theta_z"]
    assert low < np.median(true) < high, (low, high, true.min(), np.median(true), true.max())


def test_errors_of_all_data_stop_a_fit_unless_they_are_accepted(of_two_springs, believed_beam):
    freq, _, linear = of_two_springs
    wrong = linear * (2j * np.pi * freq[:, None, None]) ** 2
    with pytest.raises(jf.FrfCheckError, match=r"look like accelerances.*set accept=\['quantity'\] \[quantity\]$"):
        jf.identify(freq, wrong, ["x", "y"])
    for own, code in ((linear.conj(), "time-convention"), (-linear, "driving-point-sign")):
        with pytest.raises(jf.FrfCheckError, match=rf"\[{code}\]$"):
            jf.identify(freq, own, ["x", "y"])
    with pytest.raises(ValueError, match="unknown code 'bent' in accept; use one of quantity, driving-point-sign"):
        jf.identify(freq, linear, ["x", "y"], accept=["bent"])
    h = believed_beam[0].at_joint_amplitude(FREQ_HZ, np.full(FREQ_HZ.size, 1e-9)).h[:, :, None]
    with pytest.raises(jf.FrfCheckError, match=r"\[time-convention\]$"):
        jf.identify_model(FREQ_HZ, jf.pollute(h, 0.01, seed=1).conj(), believed(), CHANNELS, CHANNELS[:1])


def test_the_check_names_resonances_that_move_with_their_motion(believed_beam):
    own = believed_beam[0]
    freq = np.arange(215.0, 255.0, 0.5)
    steady = own.at_force(freq, 1.0)
    found = jf.check_frfs(freq, jf.pollute(steady.h[:, :, None], 0.01, seed=3), responses=CHANNELS, forces=CHANNELS[:1])
    (one,) = [each for each in found.findings if each.code == "amplitude-dependent"]
    assert one.about == ("force A/1:y",)
    moved, times = one.numbers["shift"], one.numbers["growth"]
    ends = steady.joint.max() / np.array([times, 1.0])
    shift = np.diff([of_mode(own, 1.0, k)[0] for k in own.joint.first_harmonic(ends)])[0]
    assert 0.5 < moved / shift < 1.5
    # the same beam with its joint at rest
    rest = own.at_joint_amplitude(freq, np.full(freq.size, 1e-9)).h[:, :, None]
    linear = jf.check_frfs(freq, jf.pollute(rest, 0.01, seed=3), responses=CHANNELS, forces=CHANNELS[:1])
    assert "amplitude-dependent" not in [each.code for each in linear.findings]


def test_two_modes_in_one_peak_are_not_called_amplitude_dependent():
    freq = np.linspace(0.5, 12, 400)
    for split in (0.01, 0.02, 0.04, 0.08):
        h = [
            sum(size / ((2 * np.pi * f) ** 2 * (1 + 0.03j) - (2 * np.pi * freq) ** 2) for f, size in modes)
            for modes in (((6, 1), (6 * (1 + split), other)) for other in (1, -0.4, 0.3))
        ]
        polluted = jf.pollute(np.stack(h, axis=1)[:, :, None], 0.005, seed=1)
        assert not jf.check_frfs(freq, polluted, responses=["1:x", "2:x", "3:x"], forces=["1:x"]).findings


def test_linear_frfs_at_the_joint_are_not_called_amplitude_dependent():
    freq, h = chains(lambda freq, a, b: np.full(freq.size, 2000 + 100j))
    for seed in range(5):
        fit = jf.identify(freq, jf.pollute(h, 0.03, seed=seed), ["x"], damping="hysteretic")
        found = jf.levels([fit], [jf.Drive("force", 1.0)], laws=())
        assert "amplitude-not-smooth" not in [one.code for one in found.findings]


def test_the_loss_factor_is_that_of_both_dampings():
    freq, h = chains(lambda freq, a, b: 2000 + 100j + 2j * np.pi * freq * 8)
    fit = jf.identify(freq, jf.pollute(h, 0.003, seed=1), ["x"], damping="both")
    (one,) = jf.levels([fit], [jf.Drive("joint", 1e-3, "x")], laws=()).levels["x"]
    at = (one.loss_factor.value * one.stiffness.value - 100) / (2 * np.pi * 8)
    assert 1 < at < 10  # Hz: the dampers count where they were seen
    assert one.loss_factor.std_error < 0.02 * one.loss_factor.value


@pytest.fixture(scope="module")
def believed_beam():
    """A beam whose models are as they are believed, its mode at three amplitudes, and K* there."""
    own = iwan_beam(Sliders.iwan(*IWAN))
    return own, np.array([2e-6, 2e-5, 2e-4]), own.joint.first_harmonic(np.array([2e-6, 2e-5, 2e-4]))


def check_backbone(backbone, amplitude, k, rtol):
    found = jf.backbone_levels(believed(), backbone, laws=()).levels["theta_z"]
    assert_allclose([one.amplitude for one in found], amplitude, rtol=rtol)
    assert_allclose([one.stiffness.value for one in found], k.real, rtol=rtol)
    assert_allclose([one.loss_factor.value for one in found], k.imag / k.real, rtol=rtol)
    return found


def of_mode(own, amplitude, k):
    """Eigenvalue near 235 Hz of the beam with K*, and the motion of the driven channel there."""
    squares, shapes = eig(own.stiffness + k * np.outer(own.across, own.across), own.mass)
    i = np.argmin(abs(squares - (2 * np.pi * 235) ** 2))
    motion = amplitude * abs(shapes[own.outputs[0], i] / (own.across @ shapes[:, i]))
    return np.sqrt(squares[i].real) / (2 * np.pi), squares[i].imag / squares[i].real / 2, motion


def test_a_backbone_of_a_mode_gives_the_joint_that_it_was_made_of(believed_beam):
    own, amplitude, k = believed_beam
    freq, damping, motion = np.transpose([of_mode(own, *one) for one in zip(amplitude, k, strict=True)])
    found = check_backbone(jf.Backbone("A/1:y", freq, motion, damping=damping), amplitude, k, 1e-5)
    # a frequency that is off by its error moves k by no more than its interval says, and by a good part of that
    off = jf.backbone_levels(believed(), jf.Backbone("A/1:y", 0.999 * freq, motion, damping=damping), laws=())
    for one, wrong in zip(found, off.levels["theta_z"], strict=True):
        assert 0.3 < (one.stiffness.value - wrong.stiffness.value) / one.stiffness.std_error < 1.05


def test_phase_resonance_with_harmonics_gives_the_joint_within_what_they_change(believed_beam):
    own, amplitude, k = believed_beam
    freq = []
    for one in amplitude:
        lag = partial(own.at_joint_amplitude, amplitude=np.array([one]))
        freq.append(brentq(lambda f, lag=lag: lag(np.array([f])).h[0, 0].real, 222, 240))
    steady = own.at_joint_amplitude(np.array(freq), amplitude)
    motion = abs(steady.h[:, 0]) * steady.force
    check_backbone(jf.Backbone("A/1:y", freq, motion, force=steady.force), amplitude, k, 0.02)


def test_errors_of_models_widen_the_intervals_of_a_backbone(believed_beam):
    own, amplitude, k = believed_beam
    freq, damping, motion = of_mode(own, amplitude[0], k[0])
    whole, point = believed(), jf.Backbone("A/1:y", [freq], [motion], damping=[damping])
    known, stiffer = (
        jf.Substructure(whole.a.model({"youngs_modulus": e}), whole.a.joint, exact=True) for e in (1, 1.01)
    )
    other = jf.Substructure(whole.b.nominal_model, whole.b.joint, exact=True)
    exact, changed, believed_one = (
        jf.backbone_levels(one, point, laws=()).levels["theta_z"][0].stiffness
        for one in (jf.Assembly(known, other, whole.joint), jf.Assembly(stiffer, other, whole.joint), whole)
    )
    errors, change = (exact.std_error, believed_one.std_error), (exact.value, changed.value)
    assert_allclose(np.sqrt(errors[1] ** 2 - errors[0] ** 2), np.sqrt(2) * abs(change[1] - change[0]), rtol=0.1)


def test_a_backbone_that_does_not_fit_its_assembly_is_an_error(believed_beam):
    whole, points = believed(), {"freq_hz": [235.0], "amplitude": [1e-5]}
    good = jf.Backbone("A/1:y", **points, damping=[0.001])
    for backbone, options, text in (
        (jf.Backbone("A/99:y", **points, damping=[0.001]), {}, "channel 'A/99:y'"),
        (good, {"dof": "theta_y"}, "dof is 'theta_y'; use one of theta_z"),
        (good, {"laws": ["voigt"]}, "laws"),
    ):
        with pytest.raises(ValueError, match=text):
            jf.backbone_levels(whole, backbone, **options)
    for wrong, text in (
        ({}, "give one of them"),
        ({"damping": [0.0]}, "damping has no numbers or one that is not positive"),
        ({"damping": [0.1, 0.2]}, "shape"),
        ({"force": [1.0], "labels": ["a", "b"]}, "labels"),
    ):
        with pytest.raises(ValueError, match=text):
            jf.Backbone("A/1:y", **points, **wrong)
    # a mode that is stiffer than with a rigid joint
    stiff = jf.backbone_levels(whole, jf.Backbone("A/1:y", [330.0], [1e-5], damping=[0.001]), laws=())
    assert "not positive" in stiff.warnings[0]


@pytest.mark.long
@pytest.mark.filterwarnings("always::jointfrf.FrfCheckWarning")
def test_the_command_names_amplitude_dependent_frfs_and_fits_them(believed_beam, of_two_springs, capsys, tmp_path):
    freq = np.arange(215.0, 255.0, 0.5)
    h = jf.pollute(believed_beam[0].at_force(freq, 1.0).h[:, :, None], 0.01, seed=3)
    channels = tuple(jf.io.Channel(node, "+y") for node in (11, 12, 21, 22))
    write_frfs(tmp_path / "beam.npz", jf.io.FrfSet(freq, channels, channels[:1], h, "receptance"))
    channels = tuple(jf.io.Channel(node, axis) for node in (1, 2) for axis in ("+x", "+y"))
    write_frfs(tmp_path / "joint.npz", jf.io.FrfSet(of_two_springs[0], channels, channels, of_two_springs[1]))
    for file, words, name in (
        ("beam.npz", ["--model", str(CASE / "assembly.toml")], "A/1:y"),
        ("joint.npz", ["--j", "1", "--k", "2", "--dofs", "x,y"], "1:+x"),
        ("joint.npz", ["--j", "1", "--k", "2", "--dofs", "x,y", "--method", "inverse-substructuring"], "1:+x"),
    ):
        words = ["identify", str(tmp_path / file), *words, "--json"]
        assert main(words) == 0
        shown = json.loads(capsys.readouterr().out)["warnings"]
        assert f"FRFs of force {name} are amplitude-dependent" in shown[0]
        with pytest.raises(SystemExit):
            main([*words, "--accept-bent"])
        assert "--accept CODE" in capsys.readouterr().err
    # levels follows the amplitude
    h = jf.pollute(believed_beam[0].at_force(FREQ_HZ, 0.5).h[:, :, None], 0.01, seed=3)
    channels = tuple(jf.io.Channel(node, "+y") for node in (11, 12, 21, 22))
    write_frfs(tmp_path / "beam.npz", jf.io.FrfSet(FREQ_HZ, channels, channels[:1], h, "receptance"))
    words = ["levels", str(tmp_path / "beam.npz"), "--level", "0.5", "--model", str(CASE / "assembly.toml"), "--json"]
    assert main([*words, "--laws", "power"]) == 0
    assert not any("amplitude-dependent" in one for one in json.loads(capsys.readouterr().out)["warnings"])


def test_the_command_reads_a_backbone(capsys, tmp_path):
    words = ["levels", "--backbone", str(CASE / "backbone.csv"), "--model", str(CASE / "assembly.toml"), "--channel"]
    assert main([*words, "A/1:y", "--laws", "iwan", "--output", str(tmp_path / "out.csv")]) == 0
    assert "loss factor" in capsys.readouterr().out
    true = Sliders.iwan(*IWAN)
    with (tmp_path / "out.csv").open() as file:
        for row in csv.DictReader(file):
            k = true.first_harmonic(np.array([float(row["amplitude"])]))[0]
            assert float(row["k_low"]) < k.real < float(row["k_high"])
            assert float(row["loss_factor_low"]) < k.imag / k.real < float(row["loss_factor_high"])
    assert main([*words, "A/1:y", "--laws", "power", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert any(
        "no law explains the levels of theta_z: chi^2 of the best, power, is" in one for one in printed["warnings"]
    )
    lowest = printed["levels"]["theta_z"][0]
    assert lowest["stiffness"]["low"] < true.first_harmonic(np.array([lowest["amplitude"]]))[0].real
    assert main([*words, "A/1:y", "a.uff"]) == 2
    assert "leave out files" in capsys.readouterr().err


def test_what_does_not_belong_together_is_an_error():
    freq, h = chains(lambda freq, a, b: np.full(freq.size, 2000 + 100j))
    fit = jf.identify(freq, jf.pollute(h, 0.03, seed=1), ["x"])
    force = jf.Drive("force", 1.0)
    for fits, drives, options, text in (
        ([fit], [force, force], {}, "give one drive for each fit"),
        ([fit, fit], [force, force], {"labels": ["a", "a"]}, "wrong labels; give 2 different names"),
        (
            [fit],
            [jf.Drive("response", 1.0, "j:y")],
            {},
            "the fit has no 'j:y', which was controlled; use one of j:x, k:x",
        ),
        ([fit], [jf.Drive("joint", 1.0, "y")], {}, "the fit has no 'y'"),
        ([fit], [force], {"laws": ["voigt"]}, "laws"),
        ([jf.fit_from_dict(jf.fit_to_dict(fit))], [force], {}, "loaded without its FRFs"),
    ):
        with pytest.raises(ValueError, match=text):
            jf.levels(fits, drives, **options)
    with pytest.raises(ValueError, match="a force has no channel"):
        jf.Drive("force", 1.0, "x")
    with pytest.raises(ValueError, match="channel is empty"):
        jf.Drive("joint", 1.0)


def test_the_command_writes_table_page_and_csv(capsys, tmp_path):
    lines = (CASE / "tests.csv").read_text().splitlines()
    table = tmp_path / "tests.csv"
    table.write_text("\n".join([lines[0], *(f"{CASE}/{line}" for line in (lines[5], lines[1]))]) + "\n")
    words = ["levels", "--table", str(table), "--model", str(CASE / "assembly.toml"), "--held", "B/25:y"]
    words += ["--report", str(tmp_path / "page.html"), "--output", str(tmp_path / "out.csv"), "--laws", "power"]
    words += ["--joints", str(tmp_path / "joints")]
    assert main(words) == 0
    shown = capsys.readouterr().out
    assert shown.index("level_1") < shown.index("level_5")
    page = (tmp_path / "page.html").read_text()
    assert "theta_z over amplitude" in page
    assert "power" in page
    header, *rows = (tmp_path / "out.csv").read_text().splitlines()
    assert header.startswith("dof,test,amplitude")
    assert [row.split(",")[1] for row in rows] == ["level_1", "level_5"]
    for row in csv.DictReader((tmp_path / "out.csv").read_text().splitlines()):
        file = tmp_path / "joints" / f"{row['test']}.toml"
        joint, k = jf.read_joint(file), float(row["k"])
        assert joint.rigid == ("y",)
        secant = joint.laws["theta_z", "theta_z"].stiffness(np.ones(1))
        assert_allclose(secant, k * (1 + 1j * float(row["loss_factor"])))
        assert main(["export", str(file), "nastran:1,2", "--quiet"]) == 0


def test_the_command_needs_no_models_of_frfs_at_the_joint(capsys, tmp_path):
    for level, k in (("1", 2000 + 100j), ("4", 1800 + 180j)):
        freq, h = chains(lambda freq, a, b, k=k: np.full(freq.size, k))
        channels = tuple(jf.io.Channel(node, "+x") for node in (1, 2))
        measured = jf.pollute(h, 0.01, seed=int(level))
        write_frfs(tmp_path / f"test_{level}.npz", jf.io.FrfSet(freq, channels, channels, measured, "receptance"))
    files = [str(tmp_path / f"test_{level}.npz") for level in "14"]
    joint = ["--j", "1", "--k", "2", "--dofs", "x", "--laws", "power"]
    assert main(["levels", *files, "--level", "1e-4,4e-4", "--held", "joint:x", "--json", *joint]) == 0
    low, high = json.loads(capsys.readouterr().out)["levels"]["x"]
    for one, level, k in ((low, 1e-4, 2000 + 100j), (high, 4e-4, 1800 + 180j)):
        assert_allclose(one["amplitude"], level)
        assert one["stiffness"]["low"] < k.real < one["stiffness"]["high"]
        assert one["loss_factor"]["low"] < k.imag / k.real < one["loss_factor"]["high"]
        assert one["loss_factor"]["std_error"] < 0.1 * k.imag / k.real
    # a channel by its name in the file; the joint moves by its difference from the other one
    assert main(["levels", files[0], "--level", "1e-4", "--held", "2:+x", "--json", *joint]) == 0
    (one,) = json.loads(capsys.readouterr().out)["levels"]["x"]
    h = chains(lambda freq, a, b: np.full(freq.size, 2000 + 100j))[1]
    across = abs((h[:, 0] - h[:, 1]) / h[:, 1]) * 1e-4
    assert across.min() < one["lowest"] <= one["amplitude"] <= one["highest"] < across.max()
    assert main(["levels", files[0], "--level", "1e-4", "--held", "3:+x", *joint]) == 2
    assert "test_1.npz has no channel 3:+x to control; use one of 1:+x, 2:+x" in capsys.readouterr().err


def test_levels_of_one_assembly_share_the_errors_of_its_models(beam):
    """By brute force: with another prior mean of E, all stiffnesses move by what they share."""
    h = beam.at_joint_amplitude(FREQ_HZ, np.full(FREQ_HZ.size, 2e-6)).h[:, :1, None]
    h, level = jf.pollute(h, 0.01, seed=1), [jf.Drive("joint", 2e-6, "theta_z")]

    def found(mean: float) -> jf.JointLevel:
        whole = believed()
        half = jf.beam(0.36, 24, youngs_modulus=mean * 210e9, loss_factor=0.001, **SECTION)
        other = jf.Assembly(jf.Substructure(half, whole.a.joint, whole.a.unknowns, exact=True), whole.b, whole.joint)
        fit = jf.identify_model(FREQ_HZ, h, other, CHANNELS[:1], CHANNELS[:1])
        return jf.levels([fit], level, laws=()).levels["theta_z"][0]

    low, middle, high = (found(mean) for mean in (0.998, 1.0, 1.002))
    assert_allclose((high.stiffness.value - low.stiffness.value) / 0.4, middle.common["A/youngs_modulus"][0], rtol=0.1)
    assert sum(part[0] ** 2 for part in middle.common.values()) < middle.stiffness.std_error**2


def test_what_was_held_may_be_a_position_and_is_checked_before_the_fit(capsys, monkeypatch):
    calls = []

    def fit(self, **_):
        calls.append(self)
        raise ValueError("no fit in this test")

    monkeypatch.setattr("jointfrf.workbench.assembly_file.measured.MeasuredAssembly.fit", fit)
    words = ["levels", str(CASE / "level_1.uff"), "--model", str(CASE / "assembly.toml"), "--level", "1e-6", "--held"]
    for held in ("B/10:y", "B/@0.135,0,0:y", "joint:theta_x"):
        assert main([*words, held]) != 0
        assert not calls
        assert "was not measured; use one of" in capsys.readouterr().err
    assert main([*words, "B/@0.36,0,0:y"]) != 0
    assert len(calls) == 1


def test_the_page_names_tests_without_levels_and_laws_that_do_not_fit(tmp_path):
    def level(label, a, k):
        return JointLevel(
            label, a, a, a, 0, a * k, Derived(k, 10.0, k - 20, k + 20), Derived(0.01, 1e-4, 0.0098, 0.0102)
        )

    stiffness = [5e4, 3e4, 6e4, 2e4, 7e4, 4e4, 5e4]
    own = [level(str(i), float(i + 1), k) for i, k in enumerate(stiffness)]
    found = of_levels({"x": own}, [], ["constant"], 0.95, {})
    page = jf.write_levels(replace(found, left_out={"high.uff": "the file is damaged"}), tmp_path / "levels.html")
    text = page.read_text()
    assert "Left out: high.uff. the file is damaged" in text
    assert "no law explains the levels within their errors" in text
    assert "the law with the lowest AICc" not in text


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        (["a.uff"], 2, "--model is missing"),
        (["--backbone", "b.csv", "--j", "1"], 2, "add it for a backbone"),
        (["a.uff", "--model", "m.toml"], 2, "give 1, one for each file"),
        (["--model", "m.toml"], 2, "no files are given"),
        (["a.uff", "--model", "m.toml", "--table", "t.csv"], 2, "leave out FILE and --level"),
        (["--model", "m.toml", "--table", "t.csv"], 1, "line 2: level 'high' is no number"),
        (["a.uff", "--model", "m.toml", "--level", "-1"], 1, "a: level must be positive"),
    ],
)
def test_wrong_words_of_the_command(words, status, text, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("t.csv").write_text("file,level\na.uff,high\n")
    assert main(["levels", *words]) == status
    assert text in capsys.readouterr().err
