"""A sensor that points the other way, two exchanged cables: found, named, and never guessed."""

import warnings

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.model.channel_map import ChannelChange

FREQ = np.linspace(20, 900, 100)
SECTION = dict(youngs_modulus=70e9, density=2700.0, width=0.025, height=0.006, loss_factor=0.01)
RESPONSES, FORCES = ["A/3:y", "A/13:y", "B/4:y", "A/8:theta"], ["A/2:y", "B/7:y"]
JOINT = jf.Joint([6e5, 500.0], dofs=["y", "theta"], structural_damping=[1.8e4, 15.0])
BELIEVED = jf.LawJoint({"y": jf.SpringLaw(1e6, h=1e4), "theta": jf.SpringLaw(1e3, h=10.0)})


def assembly(joint, stiffer=1.0, *, exact=True):
    """Two free beams, the first with another Young's modulus."""
    section = SECTION | {"youngs_modulus": stiffer * SECTION["youngs_modulus"]}
    a = jf.Substructure(jf.beam(0.3, 12, **section), ["13:y", "13:theta"], exact=exact)
    return jf.Assembly(a, jf.Substructure(jf.beam(0.225, 9, **SECTION), ["1:y", "1:theta"], exact=True), joint)


def fitted(h, *, find_wrong_channels=True, responses=RESPONSES, forces=FORCES, believed=None, noise=None):
    """Return a fit, and what it says of the channels."""
    model = assembly(BELIEVED) if believed is None else believed
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = jf.identify_model(FREQ, h, model, responses, forces, find_wrong_channels=find_wrong_channels, noise=noise)
    return fit, [one for one in fit.findings if one.code.startswith("channel-")]


@pytest.fixture(scope="module")
def measured():
    return jf.pollute(assembly(JOINT).receptance(FREQ, RESPONSES, FORCES), 0.02, seed=1)


@pytest.fixture(scope="module")
def plain(measured):
    """The fit that looks for no wrong channels."""
    return fitted(measured, find_wrong_channels=False)


def turned(h):
    return h * np.array([1, 1, -1, 1])[:, None]


def test_right_names_change_nothing(measured, plain):
    (with_search, (said,)), (without, none) = fitted(measured), plain
    assert with_search.value == without.value
    assert said.severity == "note"
    assert said.text == "the channel names fit best: 10 signs and exchanges were tried"
    assert none == []


@pytest.mark.parametrize(
    ("fault", "named", "about"),
    [
        (turned, "response B/4:y with the opposite sign", ("B/4:y",)),
        (lambda h: h[:, [1, 0, 2, 3]], "responses A/3:y and A/13:y exchanged", ("A/3:y", "A/13:y")),
        (lambda h: h[:, :, ::-1], "forces A/2:y and B/7:y exchanged", ("A/2:y", "B/7:y")),
    ],
)
def test_one_fault_is_named_and_taken(measured, plain, fault, named, about):
    fit, (said,) = fitted(fault(measured))
    assert said.severity == "warning"
    assert f"the fit takes {named}: " in said.text
    assert said.about == about
    assert fit.value == pytest.approx(plain[0].value, rel=1e-6)
    assert fit.residual_is_noise


def test_noise_of_each_frf_goes_with_its_channel(measured):
    variance = (0.02 * abs(measured)) ** 2 * np.array([1.0, 25.0, 1.0, 1.0])[:, None]
    exchanged, own = [1, 0, 2, 3], fitted(measured, find_wrong_channels=False, noise=variance)[0]
    fit, (said,) = fitted(measured[:, exchanged], noise=variance[:, exchanged])
    assert said.severity == "warning"
    assert fit.value == pytest.approx(own.value, rel=1e-6)
    assert fit.std_error == pytest.approx(own.std_error, rel=1e-6)


@pytest.mark.long
def test_a_wrong_model_is_not_a_wrong_channel(measured):
    """Young's modulus 6 % off and not among the unknowns: no change is made but the true one."""
    wrong = assembly(BELIEVED, 1.06)
    _, (said,) = fitted(measured, believed=wrong)
    assert said.severity == "note"
    _, (said,) = fitted(turned(measured), believed=wrong)
    assert "the fit takes response B/4:y with the opposite sign" in said.text


def test_of_a_symmetric_structure_both_changes_are_named_and_none_is_made():
    beams = [jf.Substructure(jf.beam(length, 8, **SECTION), ["5:y", "5:theta"], exact=True) for length in (0.4, 0.2)]
    joint = jf.Joint([1e9, 500.0], dofs=["y", "theta"], structural_damping=[0.0, 15.0])
    responses, forces = ["A/2:y", "A/8:y"], ["B/5:theta"]
    h = jf.pollute(jf.Assembly(*beams, joint).receptance(FREQ, responses, forces), 0.02, seed=2)
    believed = jf.Assembly(*beams, jf.LawJoint({"theta": jf.SpringLaw(1e3, h=10.0)}, rigid=["y"], dofs=["y", "theta"]))
    options = dict(responses=responses, forces=forces, believed=believed)
    ways = {"force B/5:theta with the opposite sign", "responses A/2:y and A/8:y exchanged"}
    (given, _), (fit, (said,)) = fitted(-h, find_wrong_channels=False, **options), fitted(-h, **options)
    assert said.severity == "warning"
    assert all(way in said.text for way in ways)
    assert fit.value == given.value
    # Of three sensors two at the same place cannot be distinguished, whichever is which.
    responses, forces = ["A/2:y", "A/8:y", "B/5:y"], ["B/5:y"]
    joint = jf.Joint([6e5, 500.0], dofs=["y", "theta"], structural_damping=[1.8e4, 15.0])
    h = jf.pollute(jf.Assembly(*beams, joint).receptance(FREQ, responses, forces), 0.02, seed=3)
    believed = jf.Assembly(*beams, jf.LawJoint({"y": jf.SpringLaw(1e6, h=1e4)}, rigid=["theta"], dofs=["y", "theta"]))
    _, (said,) = fitted(h, responses=responses, forces=forces, believed=believed)
    assert said.severity == "note"
    assert "fit as well with responses A/2:y and A/8:y exchanged" in said.text


def test_set_ups_of_the_frfs_go_with_their_channels():
    setups = jf.SetUps(["a", "b"], [[0, 0], [1, 1], [0, 1]], repeats=[[0, 1, 1], [2, 1, 0]], repeated=[[1.0, 2.0]])
    exchanged = ChannelChange("exchange", "response", (0, 1), ("p", "q")).of_setups(setups)
    assert exchanged.of.tolist() == [[1, 1], [0, 0], [0, 1]]
    assert exchanged.repeats.tolist() == [[1, 1, 1], [2, 1, 0]]
    forces = ChannelChange("exchange", "force", (0, 1), ("p", "q")).of_setups(setups)
    assert forces.of.tolist() == [[0, 0], [1, 1], [1, 0]]
    assert forces.repeats.tolist() == [[0, 0, 1], [2, 0, 0]]
    turned_over = ChannelChange("sign", "response", (2,), ("r",)).of_setups(setups)
    assert turned_over.repeated.tolist() == [[1, -2]]
    assert setups.of.tolist() == [[0, 0], [1, 1], [0, 1]]
