"""No result from nothing: one sentence where no joint can be found, an open interval where only a bound can."""

import warnings

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.manifold.prepare import check_channels, check_transform

DOFS = ["y", "theta"]
#: Two points 20 mm apart on each side, to y and theta; and the same point twice.
APART = np.kron(np.eye(2), [[1.0, 0.01], [1.0, -0.01]])
TWICE = np.kron(np.eye(2), [[1.0, 0.01], [1.0, 0.01]])


def circular(shape, seed=0):
    rng = np.random.default_rng(seed)
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def identified(freq, gamma, dofs=DOFS, **options):
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        for reported in (jf.FrfCheckWarning, jf.IdentificationWarning, jf.ConvergenceWarning):
            warnings.simplefilter("ignore", reported)
        return jf.identify(freq, gamma, dofs, **options)


def with_joint(s, stiffness):
    """FRFs with another stiffness of y and theta, and without damping."""
    return s.gamma(jf.Joint(stiffness, [0.0, 0.0], DOFS))


def same(h, first, second, *, force=True):
    """Channel `second` shows what `first` shows."""
    h = h.copy()
    h[:, second] = h[:, first]
    if force:
        h[:, :, second] = h[:, :, first]
    return h


def put(h, value, *where):
    h = h.copy()
    h[:, *where] = value
    return h


def floor(h, level, seed=1):
    """Noise that is the same for all FRFs of a pair of DOFs, in the units of their driving points."""
    size = np.sqrt(np.median(abs(np.einsum("lpp->lp", h)), axis=0))
    return h + level * np.outer(size, size) * circular(h.shape, seed)


#: What is measured of `beams`: from exact FRFs h, those with 1 % noise x, and the frequencies f; and what is said.
NOTHING = {
    "no lines": (lambda s, h, x: (s.freq[:0], x[:0]), {}, "gamma has no frequency lines"),
    "a band without lines": (lambda s, h, x: (s.freq, x), {"bands": (2e3, 3e3)}, "contains no frequency line"),
    "a line of NaN": (lambda s, h, x: (s.freq, put(x, np.nan, 0, 1)), {}, "gamma: NaN or Inf in line 0"),
    "zeros": (lambda s, h, x: (s.freq, 0 * x), {}, "the responses j:y, j:theta, k:y, k:theta are zero"),
    "a dead response": (lambda s, h, x: (s.freq, put(x, 0, 1)), {}, "the responses j:theta are zero"),
    "a dead force": (lambda s, h, x: (s.freq, put(x, 0, slice(None), 2)), {}, "the forces k:y are zero"),
    "ones": (lambda s, h, x: (s.freq, 1 + 0 * x), {}, "the responses j:y, j:theta are not independent"),
    "one channel for both DOFs": (lambda s, h, x: (s.freq, same(x, 0, 1)), {}, "j:y, j:theta are not independent"),
    "exact FRFs of the same": (lambda s, h, x: (s.freq, same(h, 0, 1)), {}, "j:y, j:theta are not independent"),
    "one response for both DOFs": (
        lambda s, h, x: (s.freq, same(x, 3, 2, force=False)), {}, "the responses k:y, k:theta are not independent"
    ),
    "one channel for both sides": (
        lambda s, h, x: (s.freq, same(x, 0, 2)), {}, "the responses j:y and k:y are the same numbers, noise included"
    ),
    "a transform of one DOF twice": (
        lambda s, h, x: (s.freq, x), {"transform": np.eye(4)[[0, 0, 2, 3]]}, "channels show 3 of 4"
    ),
    "a transform of one side twice": (
        lambda s, h, x: (s.freq, x), {"transform": np.eye(4)[[0, 1, 0, 1]]}, "channels show 2 of"
    ),
    "one of two transforms": (
        lambda s, h, x: (s.freq, x), {"transform": (np.eye(4), np.eye(4)[[0, 1, 2, 2]])}, "channels show 3"
    ),
    "virtual points of one sensor twice": (
        lambda s, h, x: (s.freq, jf.pollute(TWICE @ h @ TWICE.T, 0.01, seed=3)),
        {"transform": np.linalg.pinv(TWICE)}, "channels show 2 of",
    ),
    "noise": (lambda s, h, x: (s.freq, circular(x.shape)), {}, "gamma consists of noise"),
    "noise made reciprocal": (
        lambda s, h, x: (s.freq, circular(x.shape) + circular(x.shape).swapaxes(1, 2)), {}, "gamma consists of noise"
    ),
    "noise said to be small": (
        lambda s, h, x: (s.freq, circular(x.shape)), {"noise": 0.01}, r"no joint was found .* of the FRFs is left"
    ),
    "noise said to be all": (lambda s, h, x: (s.freq, x), {"noise": 1.0}, "gamma consists of noise"),
    "nothing across": (
        lambda s, h, x: (s.freq, x * np.kron(np.eye(2), np.ones((2, 2)))), {}, "gamma is zero between sides j and k"
    ),
    "noise across": (
        lambda s, h, x: (s.freq, floor(with_joint(s, [1e-3, 1e-5]), 0.01)), {}, "j and k of the joint consists of noise"
    ),
    "noise on one line": (lambda s, h, x: (s.freq[:1], circular(x[:1].shape)), {}, "gamma|no joint was found"),
}  # fmt: skip


@pytest.mark.parametrize("what", NOTHING)
def test_no_result_from_nothing(beams, what):
    change, options, reported = NOTHING[what]
    h = beams.gamma(beams.joint)
    with pytest.raises(ValueError, match=reported) as raised:
        identified(*change(beams, h, jf.pollute(h, 0.01, seed=1)), **options)
    assert "\n" not in str(raised.value)


def test_fewer_equations_than_parameters(chains):
    """A line of one DOF gives one complex equation: three FRFs less two that are free."""
    h = jf.pollute(chains.gamma(chains.joint), 0.01, seed=1)
    with pytest.raises(ValueError, match=r"2 real equations \(one line, 4 Hz\) for 3 parameters"):
        identified(chains.freq[70:71], h[70:71], ["x"], damping="both")
    assert identified(chains.freq[70:90:4], h[70:90:4], ["x"], damping="both").parameters


#: FRFs that give a bound or a wide interval: stiffness of y and theta, lines, noise.
BARELY = {
    "one line": ([6e5, 5e3], slice(90, 91), 0.01),
    "two lines": ([6e5, 5e3], slice(80, 120, 20), 0.01),
    "three lines": ([6e5, 5e3], slice(40, 160, 50), 0.01),
    "a joint of nearly zero stiffness": ([1e-3, 1e-5], slice(None), 0.01),
    "a rigid joint": ([1e13, 1e11], slice(None), 0.01),
}


@pytest.mark.parametrize("what", BARELY)
def test_intervals_where_there_is_little(beams, what):
    stiffness, lines, level = BARELY[what]
    h = jf.pollute(with_joint(beams, stiffness), level, seed=2)
    fit = identified(beams.freq[lines], h[lines], damping="none" if max(stiffness) > 1e10 else "viscous")
    for name, true in zip(("k_y", "k_theta"), stiffness, strict=True):
        low, high = fit.confidence_interval(0.99)[name]
        assert low < true < high, name
    variance = np.diagonal(fit.covariance)
    assert (variance > 0).all()
    assert all(np.isfinite(value) for value in fit.value.values())


def test_both_sides_of_a_rigid_joint_are_the_same_where_frfs_are_calculated(beams):
    h = with_joint(beams, [1e30, 1e30])
    check_channels((h + h.swapaxes(1, 2)) / 2, ["j:y", "j:theta", "k:y", "k:theta"])


def test_points_near_each_other_are_independent():
    check_transform("transform", np.linalg.inv(APART), ["j:y", "j:theta", "k:y", "k:theta"])
    near = np.kron(np.eye(2), [[1.0, 1e-6], [1.0, -1e-6]])
    check_transform("transform", np.linalg.inv(near), ["j:y", "j:theta", "k:y", "k:theta"])


def test_a_sensor_in_a_sum_with_others_is_told():
    h = circular((30, 6, 6))
    h[:, 2] = h[:, 0] - 2 * h[:, 1]
    with pytest.raises(ValueError, match="the responses j:x, j:y, j:z are not independent"):
        check_channels(h, [f"{side}:{dof}" for side in "jk" for dof in "xyz"])
