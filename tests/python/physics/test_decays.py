"""Free decays against closed forms and against a beam with an Iwan joint that was moved through time."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

import jointfrf as jf
from harmonic_balance import Sliders, believed, iwan_beam
from jointfrf.workbench.amplitude.decay import pooled, scatter_over_levels
from jointfrf.workbench.cli.main import main
from ring_down import mode_of, ring_down

RATE = 2000.0
CHANNELS = ["A/1:y", "A/15:y", "B/9:y", "B/25:y"]
SHAPE = np.array([1.0, -0.5, 0.3])


def softening(time, a0=1.0, c0=1.0, c1=6.0, freq=100.0, b=0.02):
    """Amplitude and phase of da/dt = -(c0 + c1 a) a, omega = 2 pi freq (1 - b a), in closed form."""
    left = np.exp(-c0 * time)
    grown = 1 + c1 * a0 * (1 - left) / c0
    return a0 * left / grown, 2 * np.pi * freq * (time - b * np.log(grown) / c1)


def recorded(seed, noise=1e-3, before=300, seconds=4.0, **options):
    """Three sensors, one reversed: pretrigger samples, offset, drift, noise."""
    a, phase = softening(np.arange(int(RATE * seconds)) / RATE, **options)
    rng = np.random.default_rng(seed)
    x = np.vstack([np.zeros((before, 3)), (a * np.cos(phase + 0.3))[:, None] * SHAPE])
    time = np.arange(len(x)) / RATE
    x += noise * rng.normal(size=x.shape) + [0.5, 0.1, -2.0] + time[:, None] * [1.0, 0.2, -0.1]
    return jf.DecayRecord(time, x, ["a", "b", "c"], "displacement")


@pytest.mark.parametrize("noise", [1e-3, 1e-2])
def test_frequency_and_damping_are_those_of_the_closed_form(noise):
    inside = []
    for seed in range(10):
        found = jf.decay_of_mode(recorded(seed, noise), 100)
        a = softening(found.time - 300 / RATE)[0]
        rate, omega = 1 + 6 * a, 2 * np.pi * 100 * (1 - 0.02 * a)
        freq = np.hypot(rate, omega) / (2 * np.pi)
        of_freq, of_damping = found.errors
        inside.append(
            [abs(found.freq_hz - freq) < 1.96 * of_freq * freq,
             abs(found.damping * 2 * np.pi * found.freq_hz - rate) < 1.96 * of_damping * rate]
        )  # fmt: skip
        assert_allclose(found.freq_hz[0], freq[0], rtol=0.2 * noise)
        assert_allclose(found.damping[0] * 2 * np.pi * freq[0], rate[0], rtol=15 * noise)
        assert_allclose(found.amplitude[0], a[0] * abs(SHAPE), rtol=10 * noise)
        assert (np.sign((found.shape[0] / found.shape[0, 0]).real) == np.sign(SHAPE)).all()
    share = np.mean(np.concatenate(inside, axis=1), axis=1)
    assert share.min() > 0.9, share


@pytest.mark.parametrize("power", [1, 2])
def test_velocity_and_acceleration_give_the_amplitude_of_displacement(power):
    time = np.arange(8000) / RATE
    s = -3.0 + 2j * np.pi * 100
    x = (0.01 * s**power * np.exp(s * time)).real[:, None] + 1e-3 * np.random.default_rng(1).normal(size=(8000, 1))
    found = jf.decay_of_mode(jf.DecayRecord(time, x, ["a"], ("displacement", "velocity", "acceleration")[power]), 100)
    assert_allclose(found.amplitude[:5, 0], 0.01 * np.exp(-3 * found.time[:5]), rtol=3e-3)
    assert_allclose(found.freq_hz[0], abs(s) / (2 * np.pi), rtol=1e-5)


def test_a_shaker_that_stops_does_not_count_as_free_decay():
    time = np.arange(int(4 * RATE)) / RATE
    a = np.exp(-4 * np.maximum(time - 1, 0))  # held for a second
    x = (a * np.cos(2 * np.pi * 100 * time))[:, None] + 1e-4 * np.random.default_rng(1).normal(size=(time.size, 1))
    record = jf.DecayRecord(time, x, ["a"], "displacement")
    for found in (jf.decay_of_mode(record, 100), jf.decay_of_mode(record, 100, start=1.0)):
        assert found.time[0] > 1
        assert_allclose(found.damping * 2 * np.pi * found.freq_hz, 4, atol=4 * (4 * found.errors[1]).max())
        assert_allclose(found.damping[0] * 2 * np.pi * 100, 4, rtol=2e-3)


def close_modes(apart, share, sensors, rate=RATE):
    """Two modes, with other shapes at each of two sensors."""
    time, rng, signals = np.arange(int(4 * rate)) / rate, np.random.default_rng(3), []
    for i in range(sensors):
        other = share * (-1) ** i * np.exp(-2.4 * time) * np.cos(2 * np.pi * (100 + apart) * time + 0.3)
        signals.append(np.exp(-2 * time) * np.cos(2 * np.pi * 100 * time) + other)
    x = np.array(signals).T + 1e-4 * rng.normal(size=(time.size, sensors))
    return jf.DecayRecord(time, x, [f"s{i}" for i in range(sensors)], "displacement")


@pytest.mark.parametrize("sensors", [1, 2])
@pytest.mark.parametrize("apart", [1.0, 3.0, 6.0, 15.0])
@pytest.mark.parametrize("share", [0.3, 0.05])
def test_close_modes_are_filtered_named_or_in_the_interval(sensors, apart, share):
    try:
        found = jf.decay_of_mode(close_modes(apart, share, sensors), 100)
    except ValueError as error:
        assert "usable" in str(error) or "no stretch" in str(error)  # noqa: PT017
        return
    off = abs(found.damping * 2 * np.pi * found.freq_hz - 2) / (2 * found.errors[1])
    assert off.max() < 4, (off, found.findings)
    if apart == 15:
        assert found.bandwidth < 15
        assert_allclose(found.damping * 2 * np.pi * found.freq_hz, 2, rtol=0.02)


def test_levels_end_where_noise_begins():
    quiet, loud = (jf.decay_of_mode(recorded(1, noise), 100).amplitude[:, 0] for noise in (1e-4, 1e-2))
    assert np.nanmin(loud) > 0.01
    assert np.nanmin(quiet) < 0.004
    # a record that is all noise after the decay
    time = np.arange(int(4 * RATE)) / RATE
    x = np.exp(-20 * time) * np.cos(2 * np.pi * 100 * time) + 1e-3 * np.random.default_rng(1).normal(size=time.size)
    found = jf.decay_of_mode(jf.DecayRecord(time, x[:, None], ["a"], "displacement"), 100)
    assert found.time[-1] < 0.4
    assert_allclose(found.damping, 20 / (2 * np.pi * found.freq_hz), rtol=4 * found.errors[1].max())


def test_sensors_that_disagree_widen_the_error():
    values, errors = np.array([[1.0, 1.0, 1.0], [0.9, 1.0, 1.1]]), np.full((2, 3), 0.01)
    mean, error, chi = pooled(values, errors)
    assert_allclose(mean, 1)
    assert_allclose(chi, [0, 200])
    assert error[1] >= 0.1 / np.sqrt(3) * 0.99
    x = np.linspace(0, 1, 20)
    rng = np.random.default_rng(1)
    spread = [scatter_over_levels(x, x**2 + 0.1 * rng.normal(size=20), np.full(20, 0.01))[0] for _ in range(50)]
    assert 0.08 < np.sqrt(np.mean(np.square(spread))) < 0.12
    assert scatter_over_levels(x, x**2, np.full(20, 0.01)) == (0.0, 1.0)


def good(**changes):
    time = np.arange(4000) / RATE
    x = np.exp(-2 * time) * np.cos(2 * np.pi * 100 * time)
    return {"time": time, "signals": x[:, None], "sensors": ["a"], "motion": "displacement"} | changes


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"time": np.arange(4000.0) ** 1.1}, "times are not uniform"),
        ({"time": np.zeros(4000)}, "times do not increase"),
        ({"signals": np.zeros((4000, 1))}, "sensor a does not move; leave it out"),
        ({"signals": np.full((4000, 1), np.nan)}, "signals"),
        ({"signals": np.clip(good()["signals"], -0.5, 0.5)}, "sensor a is clipped at -0.5"),
        ({"motion": "force"}, "motion"),
        ({"motion": ["velocity", "velocity"]}, "motion has 2 quantities for 1 sensors"),
        ({"sensors": ["a", "a"], "signals": np.ones((4000, 2))}, "same name"),
        ({"time": np.arange(9.0), "signals": np.ones((9, 1))}, "the record has 9 samples; give at least 64"),
    ],
)
def test_a_record_that_is_wrong_is_one_sentence(changes, text):
    with pytest.raises(ValueError, match=text):
        jf.DecayRecord(**good(**changes))


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"freq_hz": 130.0}, "no resonance within 10 % of 130 Hz; the strongest are at 100"),
        ({"freq_hz": 950.0}, "a mode at 950 Hz needs a sampling rate above 2111 Hz; the record has 2000 Hz"),
        ({"freq_hz": -1.0}, "freq_hz is -1; give a positive number"),
        ({"bandwidth": 95.0}, "bandwidth is 95 Hz; give a positive number up to 90"),
        ({"bandwidth": 0.5}, "widen bandwidth, or measure longer"),
        ({"start": 9.0}, "start is 9 s; give a time between 0 and"),
        ({"start": 1.99}, "the record ends 0.0095 s after the free decay begins"),
        ({"ratio": 1.0}, "ratio is 1; give a number above 1.05"),
        ({"ratio": 1e6}, "no stretch at 100.* is above the noise"),
    ],
)
def test_an_analysis_that_cannot_be_made_is_one_sentence(options, text):
    with pytest.raises(ValueError, match=text):
        jf.decay_of_mode(jf.DecayRecord(**good()), **({"freq_hz": 100.0} | options))


IWAN = (20.0, 1.2e5, -0.4, 0.8)
CASE = Path(__file__).resolve().parents[3] / "cases" / "iwan-beam"


def beam(modulus=(1.0, 1.0), loss=(0.001, 0.001)):
    """The beam of `harmonic_balance`, with as much viscous damping of its parts at the mode."""
    own = iwan_beam(Sliders.iwan(*IWAN), youngs_modulus=tuple(210e9 * np.array(modulus)), loss_factor=loss)
    return replace(own, stiffness=own.stiffness.real, damping=own.stiffness.imag / (2 * np.pi * 235))


def measured(acceleration, seed, noise=0.05):
    """What accelerometers show: noise, offsets, drift, pretrigger samples; the last one is reversed."""
    rng = np.random.default_rng(seed)
    x = np.vstack([np.zeros((100, 4)), acceleration * [1, 1, 1, -1]])
    x += noise * rng.normal(size=x.shape) + rng.normal(size=4) + np.linspace(0, 1, len(x))[:, None] * rng.normal(size=4)
    return jf.DecayRecord(np.arange(len(x)) / 2048, x, CHANNELS)


NAMES = dict(zip(CHANNELS, [*CHANNELS[:3], "-B/25:y"], strict=True))


@pytest.fixture(scope="module")
def rung():
    """Ring-downs of six beams after a hit: Young's moduli and loss factors drawn from what is believed."""
    rng = np.random.default_rng(11)
    beams = [
        beam(1 + 0.01 * rng.normal(size=2), tuple(np.maximum(0.001 + 0.0005 * rng.normal(size=2), 1e-5)))
        for _ in range(6)
    ]
    return beams, ring_down(beams, 2048.0, 0.8, hit=60.0)


@pytest.mark.long
def test_the_integrated_beam_has_the_linear_mode_where_it_hardly_slips():
    small = ring_down([beam()], 2048.0, 0.5, joint=1e-9)
    freq, damping, _ = mode_of(beam(), complex(beam().joint.k.sum()))
    found = jf.decay_of_mode(jf.DecayRecord(small.time, small.acceleration[0][:, :1], ["a"]), 236, ratio=1.1)
    assert_allclose(found.freq_hz[0], freq, rtol=1e-5)
    assert_allclose(found.damping[0], damping, rtol=5e-3)


@pytest.mark.long
def test_a_free_decay_gives_the_joint_within_its_intervals(rung):
    beams, moved = rung
    inside, width = [], []
    for seed, own in enumerate(moved.acceleration):
        mode = jf.decay_of_mode(measured(own, seed), 235)
        found = jf.decay_levels(believed(), mode, channels=NAMES, laws=())
        assert not [one for one in found.findings if one.code == "decay-shape"]
        for one in found.levels["theta_z"]:
            k = beams[0].joint.first_harmonic(np.array([one.amplitude]))[0]
            inside.append([one.stiffness.low < k.real < one.stiffness.high,
                           one.loss_factor.low < k.imag / k.real < one.loss_factor.high])  # fmt: skip
            width.append([one.stiffness.std_error / k.real, one.loss_factor.std_error * k.real / k.imag])
    assert len(inside) > 25
    assert np.mean(inside, axis=0).min() > 0.8  # beams share the errors of their models at all levels
    assert np.median(width, axis=0)[0] < 0.05
    assert np.median(width, axis=0)[1] < 0.3


@pytest.mark.long
def test_models_without_error_give_the_joint_to_a_percent():
    exact = ring_down([beam()], 2048.0, 1.0, hit=60.0)
    mode = jf.decay_of_mode(measured(exact.acceleration[0], 1, 0.01), 235)
    found = jf.decay_levels(believed(), mode, channels=NAMES, laws=["iwan", "constant"])
    for one in found.levels["theta_z"]:
        k = beam().joint.first_harmonic(np.array([one.amplitude]))[0]
        assert_allclose(one.stiffness.value, k.real, rtol=5e-3)
        assert_allclose(one.loss_factor.value, k.imag / k.real, rtol=0.06)
    # errors that all levels share do not hide that the stiffness changes
    laws = found.laws["theta_z"].fits
    assert laws[0].law == "iwan"
    assert laws[1].chi_square > 50 + laws[0].chi_square
    low, high = laws[0].intervals["chi"]
    assert low < -0.4 < high


def test_a_shape_that_is_not_that_of_the_mode_is_named():
    mode = jf.decay_of_mode(jf.DecayRecord(*jf.io.read_time_record(CASE / "decay.csv")), 235)
    right = {"11:+y": "A/1:y", "12:+y": "A/15:y", "22:-y": "-B/25:y"}
    good = jf.decay_levels(believed(), mode, channels=right, laws=())
    assert "decay-shape" not in [one.code for one in good.findings]
    wrong = {"11:+y": "A/15:y", "12:+y": "A/1:y", "22:-y": "B/25:y"}
    found = jf.decay_levels(believed(), mode, channels=wrong, laws=())
    assert "decay-shape" in [one.code for one in found.findings]
    some = jf.decay_levels(believed(), mode, channels={"11:+y": "A/1:y"}, laws=())
    assert "decay-sensor-unnamed" in [one.code for one in some.findings]
    for channels, text in (({}, "no sensor of"), ({"11:+y": "A/77:y"}, "A/77:y")):
        with pytest.raises(ValueError, match=text):
            jf.decay_levels(believed(), mode, channels=channels)
    with pytest.raises(ValueError, match="no decays are given"):
        jf.decay_levels(believed(), [])


def test_modes_together_are_named():
    """Another mode that moves the sensors as much leaves no single amplitude of the joint."""
    time = np.arange(8000) / RATE
    x = [np.exp(-2 * time) * np.cos(2 * np.pi * 100 * time) + a * np.exp(-9 * time) * np.cos(2 * np.pi * 300 * time)
         for a in (3.0, -2.5)]  # fmt: skip
    x = np.array(x).T + 1e-4 * np.random.default_rng(1).normal(size=(8000, 2))
    found = jf.decay_of_mode(jf.DecayRecord(time, x, ["a", "b"], "displacement"), 100)
    (one,) = [each for each in found.findings if each.code == "decay-of-several-modes"]
    assert_allclose(one.numbers["other"], 300, rtol=0.01)
    assert_allclose(found.damping[:8], 2 / (2 * np.pi * found.freq_hz[:8]), rtol=0.02)


def test_drift_of_a_high_pass_does_not_matter():
    plain = recorded(1, 1e-3)
    ringing = lfilter([1, -1], [1, -0.999], plain.signals, axis=0)  # an amplifier for dynamic signals
    found, filtered = (jf.decay_of_mode(one, 100) for one in (plain, replace(plain, signals=ringing)))
    assert_allclose(filtered.freq_hz[:6], found.freq_hz[:6], rtol=1e-4)
    assert_allclose(filtered.damping[:6], found.damping[:6], rtol=0.02)


def test_the_command_turns_a_file_into_a_joint(capsys, tmp_path):
    decay, assembly = CASE / "decay.csv", CASE / "assembly.toml"
    out = tmp_path / "modes.csv"
    assert main(["levels", "--decay", str(decay), "--modes", "235", "--output", str(out), "--json"]) == 0
    (mode,) = json.loads(capsys.readouterr().out)["modes"]
    assert len(out.read_text().splitlines()) == 1 + len(mode["frequency"])
    page = tmp_path / "page.html"
    words = [
        "levels",
        "--decay",
        str(decay),
        "--modes",
        "235",
        "--model",
        str(assembly),
        "--report",
        str(page),
        "--laws",
        "iwan",
    ]
    assert main([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert "frequency and damping over the peak displacement" in page.read_text(encoding="utf-8")
    for one in found["levels"]["theta_z"]:
        k = beam().joint.first_harmonic(np.array([one["amplitude"]]))[0]
        assert one["stiffness"]["low"] < k.real < one["stiffness"]["high"]
        assert one["loss_factor"]["low"] < k.imag / k.real < one["loss_factor"]["high"]
    for more, text in (
        ([], "--modes is missing; name the mode in Hz (resonances, the strongest first: 234.8"),
        (["--modes", "235", "--backbone", "x.csv"], "--decay contains the levels"),
        (["--modes", "235", "--report", str(page)], "--model is missing"),
        (["--modes", "235", "--model", str(assembly), "--sensors", "acc=A/1:y"], "has no column acc"),
        (["--modes", "500"], "no resonance within 10 % of 500 Hz"),
    ):
        assert main(["levels", "--decay", str(decay), *more]) != 0
        said = capsys.readouterr().err
        assert text in said, said
