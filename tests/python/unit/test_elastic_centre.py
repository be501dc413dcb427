"""The elastic centre: offsets put in are found back, exactly and with noise."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.dofs import DIRECTIONS
from jointfrf.identification.result import Fit

STIFFNESS = np.array([2e7, 5e7, 1e8, 4e3, 9e3, 2e3])


@pytest.mark.parametrize("seed", range(6))
def test_a_diagonal_joint_that_was_moved_is_found_back(seed):
    rng = np.random.default_rng(seed)
    stiffness = np.r_[10 ** rng.uniform(6, 9, 3), 10 ** rng.uniform(2, 5, 3)]
    away = rng.uniform(-1, 1, 3) * 10 ** rng.uniform(-3, -0.5)
    order = rng.permutation(6)
    moved = jf.Joint(stiffness, dofs=DIRECTIONS).moved(away).reordered([DIRECTIONS[i] for i in order])
    found = jf.elastic_centre(moved)
    np.testing.assert_allclose(found.offset, -away, rtol=1e-6, atol=1e-9 * abs(away).max())
    assert found.coupling < 1e-6 < found.coupling_before
    np.testing.assert_allclose(np.diagonal(found.joint.stiffness), stiffness[order], rtol=1e-6)
    assert not found.std_error.any()


def test_what_nothing_depends_on_stays():
    """In the plane of z and y, an offset along x moves nothing, and one along z neither where y is missing."""
    found = jf.elastic_centre(jf.Joint([1e6, 1e3], dofs=["z", "theta_x"]).moved([0.0, 0.006, 0.0]))
    np.testing.assert_allclose(found.offset, [0, -0.006, 0], atol=1e-9)
    np.testing.assert_array_equal(found.std_error, [np.inf, 0, np.inf])
    plane = jf.Joint([1e6, 2e6, 1e3], dofs=["x", "y", "theta_z"]).moved([0.01, 0.006, 0.0])
    np.testing.assert_allclose(jf.elastic_centre(plane).offset, [-0.01, -0.006, 0], atol=1e-9)


def test_coupling_that_no_offset_removes_stays():
    """x with y: the offset is that of the rest."""
    stiffness = np.diag(STIFFNESS)
    stiffness[0, 1] = stiffness[1, 0] = 0.3 * np.sqrt(stiffness[0, 0] * stiffness[1, 1])
    found = jf.elastic_centre(jf.Joint(stiffness, dofs=DIRECTIONS).moved([0.004, 0.0, -0.003]))
    np.testing.assert_allclose(found.offset, [-0.004, 0, 0.003], atol=1e-6)
    assert found.coupling == pytest.approx(0.3, rel=1e-3)


def fit_of(stiffness, error):
    """A fit of a full joint, with the same relative error of all entries of the stiffness."""
    pairs = [(a, a) for a in range(6)] + [(a, b) for a in range(6) for b in range(a + 1, 6)]
    names = ["k_" + (DIRECTIONS[a] if a == b else f"{DIRECTIONS[a]},{DIRECTIONS[b]}") for a, b in pairs]
    size = np.sqrt(np.diagonal(stiffness))
    return Fit.of_springs(
        "compliance", DIRECTIONS, {name: stiffness[a, b] for name, (a, b) in zip(names, pairs, strict=True)},
        np.diag([(error * size[a] * size[b]) ** 2 for a, b in pairs]), 0.01, 0.01, np.array([1.0, 2.0]),
        k_lines=np.zeros((2, 6, 6), complex), bands=(((1.0, 2.0),),) * 6,
    )  # fmt: skip


@pytest.mark.long
def test_the_standard_error_is_the_scatter_over_draws():
    away, error = np.array([0.003, -0.002, 0.004]), 0.02
    exact = jf.Joint(STIFFNESS, dofs=DIRECTIONS).moved(away).stiffness
    size = np.sqrt(np.diagonal(exact))
    rng = np.random.default_rng(4)
    offsets, errors = [], []
    for _ in range(60):
        noise = np.triu(rng.standard_normal((6, 6)))
        noise = noise + np.triu(noise, 1).T
        found = jf.elastic_centre(fit_of(exact + error * noise * np.outer(size, size), error))
        offsets.append(found.offset)
        errors.append(found.std_error)
    off = (np.array(offsets) + away) / np.array(errors)
    # Of 180 values the root mean square of normal ones is 1 +- 0.05.
    assert 0.8 < np.sqrt((off**2).mean()) < 1.25


@pytest.mark.parametrize(
    ("joint", "message"),
    [
        (jf.Joint([1.0, 2.0], dofs=["x", "y"]), "translations and rotations"),
        (jf.Joint([1.0, -2.0], dofs=["x", "theta_z"]), "the stiffness of theta_z must be positive, not -2"),
        (jf.Joint([1.0, 2.0], dofs=["x", "phi"]), "dofs must be among"),
    ],
)
def test_what_has_no_elastic_centre_is_said(joint, message):
    with pytest.raises(ValueError, match=message):
        jf.elastic_centre(joint)
