"""Channels of virtual points beside one another: simulated hammer tests with one fault, and without."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.channels.joint_channels import joint_channels_of_all
from jointfrf.errors import FileContentError, FileContentWarning
from simulated_tests import FAULTS, check_with_fault, simulated_test

#: Faults that only a part of the tests shows: two channels of one direction move nearly alike.
RARELY_SEEN = {"two responses exchanged", "two impacts exchanged", "sensor at another place"}
#: Another number in the place of that of a fault that is kept.
ALIKE = {
    "sensor / 9.81", "sensor x 1000", "acceleration among displacements", "receptance read as accelerance",
    "accelerance read as mobility",
}  # fmt: skip


# 2015: a resonance narrower than lines are apart. Of the last, most channels move in some columns by rounding only.
@pytest.mark.parametrize("seed", [*range(4), 2015, 2187, 2395])
def test_nothing_is_found_where_nothing_is_wrong(seed):
    assert simulated_test(seed).check().ok


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.long if name in ALIKE else ()) for name in sorted(set(FAULTS) - RARELY_SEEN)],
)
def test_one_fault_is_one_finding(name):
    found = check_with_fault(name, 0)
    assert (found.named, found.findings) == (True, 1), str(found.check)


@pytest.mark.parametrize(("name", "seed"), [("two responses exchanged", 7), ("two impacts exchanged", 1)])
def test_an_exchange_that_is_seen_names_both(name, seed):
    found = check_with_fault(name, seed)
    assert (found.named, found.findings) == (True, 1), str(found.check)


def a_joint(test):
    joint = joint_channels_of_all(test.frfs, jf.places_of_nodes(test.frfs, *test.nodes), test.at)
    return joint, test.frfs.matrix(joint.responses.channels, joint.forces.channels)


def test_two_bad_channels_are_two_findings():
    test = simulated_test(0)
    joint, h = a_joint(test)
    h[:, 2] *= -1
    h[:, :, -3] *= 9.80665
    found = jf.check_frfs(test.frfs.freq_hz, h, joint=joint).findings
    names = [f"response {joint.responses.channels[2]}", f"force {joint.forces.channels[-3]}"]
    assert sorted((one.code, *one.about) for one in found) == sorted(
        zip(("channel-sign", "channel-unit"), names, strict=True)
    )


def test_the_least_needed_channel_of_a_missing_frf_is_left_out():
    test = simulated_test(0)
    joint, _ = a_joint(test)
    measured = np.ones((len(joint.responses.channels), len(joint.forces.channels)), bool)
    measured[3, 5] = measured[3, 9] = False
    left, (missing,) = joint.without_missing(measured)
    assert (missing.kind, missing.channel) == ("response", joint.responses.channels[3])
    assert len(missing.pairs) == 2
    assert joint.responses.channels[3] not in left.responses.channels
    assert left.forces.channels == joint.forces.channels
    # what the others show of the motion is not changed
    motion = np.einsum("ma,a->m", joint.points["response", "j"].motion, np.arange(1.0, 7))
    kept = np.delete(motion, 3)
    np.testing.assert_allclose(left.points["response", "j"].transform @ kept, np.arange(1.0, 7), rtol=1e-9)


def test_joint_channels_says_what_it_leaves_out():
    test = simulated_test(0)
    h = test.frfs.h.copy()
    h[:, 0, 0] = np.nan
    frfs = jf.io.FrfSet(test.frfs.freq_hz, test.frfs.responses, test.frfs.excitations, h, "receptance",
                        test.frfs.coordinates)  # fmt: skip
    with pytest.warns(FileContentWarning, match="is missing: .* is left out, the virtual point"):
        joint = jf.joint_channels(frfs, jf.places_of_nodes(frfs, *test.nodes), test.at)
    assert np.isfinite(joint.gamma(frfs)).all()


def test_too_many_missing_frfs_are_an_error():
    joint, _ = a_joint(simulated_test(0))
    measured = np.ones((len(joint.responses.channels), len(joint.forces.channels)), bool)
    measured[: len(joint.positions["response", "j"])] = False
    with pytest.raises(FileContentError, match="missing FRFs"):
        joint.without_missing(measured)


@pytest.mark.parametrize(
    ("argument", "error"),
    [({"names": ["a"]}, "joint goes without names"), ({"read_as": "force"}, "read_as")],
)
def test_wrong_arguments(argument, error):
    test = simulated_test(0)
    joint, h = a_joint(test)
    with pytest.raises(ValueError, match=error):
        jf.check_frfs(test.frfs.freq_hz, h, joint=joint, **argument)
