"""Joints with six DOFs: groups of DOFs, any order, full matrices, other reference points."""

import warnings

import numpy as np
import pytest

import jointfrf as jf
from cramer_rao import cramer_rao
from jointfrf.dofs import Parameter
from jointfrf.frf.entry_groups import reciprocity_noise
from jointfrf.identification.manifold.coordinates import joint_terms
from jointfrf.identification.manifold.estimate import estimate_joint
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs
from six_dof_beams import DOFS, FREQ, FULL, GROUPS, JOINT, assembly, side, sides

TRUTH = np.concatenate([JOINT.stiffness.diagonal(), JOINT.damping.diagonal()])
TERMS = joint_terms(2 * np.pi * FREQ, DOFS, "viscous", "zero")
#: The joint of Table 4-1 between other points.
MOVED = JOINT.moved([0.010, 0.004, -0.007])
SHORT = np.arange(10.0, 600.0, 12.0)
KINDS = {"complex": 1.0, "real-uniform": 1 / np.sqrt(3)}
each_kind = pytest.mark.parametrize("kind", ["complex", pytest.param("real-uniform", marks=pytest.mark.long)])


@pytest.fixture(scope="module")
def gamma():
    return assembly()


@pytest.fixture(scope="module")
def bound(gamma):
    """Cramer-Rao bound for unit noise, group by group."""
    found = np.zeros(12)
    for group in GROUPS:
        dofs = np.array(group)
        at = np.concatenate([dofs, dofs + 6])
        terms = joint_terms(2 * np.pi * FREQ, [DOFS[d] for d in group], "viscous", "zero")
        k_joint = JOINT.dynamic_stiffness(FREQ)[:, dofs[:, None], dofs]
        found[np.concatenate([dofs, dofs + 6])] = np.sqrt(
            np.diag(cramer_rao(gamma[:, at[:, None], at], k_joint, terms))
        )
    return found


def fitted(h):
    """Values, standard errors and 95 % intervals of each realisation."""
    fits = list(jf.identify_realisations(FREQ, h, DOFS, damping="viscous"))
    value, error, interval = (
        np.array([list(values.values()) for values in of_fits])
        for of_fits in (
            [fit.value for fit in fits],
            [fit.std_error for fit in fits],
            [fit.confidence_interval(0.95) for fit in fits],
        )
    )
    return value, error, interval


def with_noise(h, transform, level=0.01):
    """FRFs of known relative noise, smooth ones taken for the measured."""
    variance = level**2 * abs(h) ** 2 + 1e-60
    return InterfaceFrfs.of(h, transform @ h @ transform.T, variance, transform, transform, reciprocal=True)


def uncoupled_groups(h, transform):
    return [tuple(dofs.tolist()) for dofs in with_noise(h, transform).groups()]


def test_groups_are_found_also_behind_points_and_round_off(gamma):
    assert uncoupled_groups(gamma, np.eye(12)) == list(GROUPS)
    size = np.sqrt(abs(np.einsum("fp,fq->fpq", *[np.diagonal(gamma, axis1=1, axis2=2)] * 2)))
    rounded = gamma + 1e-12 * size * np.random.default_rng(1).standard_normal(size.shape)
    assert uncoupled_groups(rounded, np.eye(12)) == list(GROUPS)
    assert uncoupled_groups(gamma + 1e-6 * size, np.eye(12)) == [tuple(range(6))]
    for first in (range(6), [0, 2, 4, 1, 3, 5]):
        # Points that show the sum and the difference of two DOFs, of the same direction on both sides or of two groups.
        dofs = np.array([*first, *np.add(first, 6)])
        pairs = dofs.reshape(2, 6).T if first == range(6) else dofs.reshape(6, 2)
        mix = np.zeros((12, 12))
        for i, (p, q) in enumerate(pairs):
            mix[2 * i, [p, q]], mix[2 * i + 1, [p, q]] = [1, 1], [1, -1]
        assert uncoupled_groups(mix @ gamma @ mix.T, np.linalg.inv(mix)) == list(GROUPS)


def test_exact_without_noise_and_at_the_bound(gamma, bound):
    found = estimate_joint(with_noise(gamma, np.eye(12)), TERMS)
    np.testing.assert_allclose(found.theta, TRUTH, rtol=1e-9)
    assert found.converged
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), 0.01 * bound, rtol=1e-3)
    between = found.covariance[np.ix_([0, 1, 5], [2, 3, 4])]
    assert (between == 0).all()


@each_kind
def test_as_good_as_the_bound_with_intervals_that_hold(gamma, bound, kind):
    """25 realisations at 5 %."""
    h = jf.realisations(gamma, 0.05, kind, seed=11, count=25)
    theta, error, interval = fitted(h)
    ratio = np.sqrt(((theta - TRUTH) ** 2).mean(axis=0)) / (0.05 * KINDS[kind] * bound)
    # Real noise is not circular: up to sqrt(2) above the bound of circular noise of its size.
    assert (ratio < (1.4 if kind == "complex" else 1.7)).all(), ratio
    assert (abs(theta.mean(axis=0) - TRUTH) < 0.6 * error.mean(axis=0)).all()
    inside = ((interval[..., 0] < TRUTH) & (interval[..., 1] > TRUTH)).mean(axis=0)
    assert (inside >= 0.8).all(), inside
    assert 0.91 < inside.mean() < 0.99
    # where the mean over the source's band finds nothing
    assert (abs(theta[:, 5] / 1e3 - 1) < 0.3).all()
    band = (FREQ >= 475) & (FREQ <= 525)
    lines = jf.inverse_substructuring(h[:, band].reshape(-1, 12, 12)).reshape(25, -1, 6, 6)
    assert abs(np.median(lines[..., 5, 5].real.mean(axis=1))) < 0.5e3


def test_round_off_between_groups_does_not_matter(gamma):
    h = jf.realisations(gamma, 0.05, seed=3, count=1)
    noise = np.random.default_rng(2).standard_normal(h.shape) * 1e-12 * abs(h).max(axis=(2, 3), keepdims=True)
    size = np.sqrt(abs(np.einsum("rfp,rfq->rfpq", *[np.diagonal(h, axis1=2, axis2=3)] * 2)))
    polluted = np.where(h == 0, np.minimum(abs(noise), 1e-11 * size), h)
    np.testing.assert_allclose(reciprocity_noise(polluted), 0.05, rtol=0.1)
    np.testing.assert_allclose(fitted(polluted)[0], fitted(h)[0], rtol=1e-6)


@each_kind
def test_all_dofs_coupled(kind):
    """Points off the plane of symmetry couple all DOFs: noisy lines must not lead the fit astray."""
    h = jf.realisations(assembly(across=0.003), 0.05, kind, seed=1, count=2)
    assert len(uncoupled_groups(h[0], np.eye(12))) == 1
    theta, error, _ = fitted(h)
    pull = (theta - TRUTH) / error
    assert (abs(pull) < 4).all(), pull
    assert 0.5 < np.sqrt((pull**2).mean()) < 1.5


def test_any_order_by_name():
    order = [4, 1, 5, 0, 3, 2]
    names = [DOFS[i] for i in order]
    shuffled = JOINT.reordered(names)
    h = jf.pollute(assembly(), 0.01, seed=4)
    place = np.concatenate([order, np.add(order, 6)])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        fit = jf.identify(FREQ, h, DOFS)
        other = jf.identify(FREQ, h[:, place[:, None], place], names)
    assert other.dofs == tuple(names)
    for name, value in fit.value.items():
        assert other.value[name] == pytest.approx(value, rel=1e-6)
        assert other.std_error[name] == pytest.approx(fit.std_error[name], rel=1e-6)
        assert other.unit(name) == fit.unit(name)
    assert [fit.unit(f"k_{d}") for d in DOFS] == ["N/m", "N m/rad"] * 2 + ["N/m", "N m/rad"]
    np.testing.assert_allclose(other.joint.reordered(DOFS).stiffness, fit.joint.stiffness, rtol=1e-6, atol=1e-3)
    np.testing.assert_allclose(
        assembly(shuffled, SHORT, order=order), assembly(freq=SHORT)[:, place[:, None], place], rtol=1e-9, atol=1e-30
    )
    with pytest.raises(ValueError, match="dofs must name x, theta_y, y, theta_x, z, theta_z in some order"):
        JOINT.reordered(["x", "y"])


def test_units_know_every_way_to_write_a_rotation():
    fit = jf.identify_band_mean(
        SHORT, assembly(freq=SHORT), "inverse-substructuring", ["ux", "ry", "uy", "rx", "uz", "rot_z"], (10, 600)
    )
    assert [fit.unit(f"c_{d}") for d in fit.dofs] == ["N s/m", "N m s/rad"] * 3
    names = ("k_ux,ry", "k_Mtheta_x", "h_Fx,Mtheta_x")
    assert [Parameter.parse(name).unit for name in names] == ["N", "N m/rad", "N"]
    assert [term.name for term in fit.parameters] == list(fit.value)
    assert [term.unit for term in fit.parameters] == [
        entry["unit"] for entry in jf.fit_to_dict(fit)["parameters"].values()
    ]
    with pytest.raises(ValueError, match="there is no parameter 'stiffness', only k_"):
        fit.unit("stiffness")


@pytest.mark.parametrize(
    "joint",
    [*(pytest.param(joint, marks=pytest.mark.long) for joint in (JOINT, MOVED)), FULL],
    ids=["diagonal", "moved", "full"],
)
def test_every_method_is_exact(joint):
    k_joint = joint.dynamic_stiffness(SHORT)
    gamma = assembly(joint, SHORT, across=0.003)
    a, b = sides(SHORT, across=0.003)
    first = jf.Joint(0.5 * joint.stiffness, 0.3 * joint.damping, DOFS)
    k_initial = first.dynamic_stiffness(SHORT)
    size = np.sqrt(np.einsum("fp,fq->fpq", *[abs(np.diagonal(k_joint, axis1=1, axis2=2))] * 2))

    def error(found):
        return (abs(found - k_joint) / size).max()

    assert error(jf.inverse_substructuring(gamma)) < 1e-9
    assert error(jf.ismm(assembly(first, SHORT, across=0.003), gamma, k_initial)) < 1e-9
    soft = np.linalg.inv(k_joint)
    scale = np.sqrt(np.einsum("fp,fq->fpq", *[abs(np.diagonal(soft, axis1=1, axis2=2))] * 2))
    assert (abs(jf.joint_compliance(gamma) - soft) / scale).max() < 1e-9
    found = jf.identify(SHORT, gamma, DOFS, cross="fit", noise=1e-6)
    np.testing.assert_allclose(found.stiffness_matrix, joint.stiffness, rtol=1e-8, atol=1e-3)
    np.testing.assert_allclose(found.damping_matrix, joint.damping, rtol=1e-6, atol=1e-6)
    again = jf.couple(a, b, found.joint.dynamic_stiffness(SHORT), range(6), range(6))
    np.testing.assert_allclose(again, gamma, rtol=1e-7, atol=1e-9 * abs(gamma).max())


@pytest.mark.parametrize("equation", ["rr", "rs", "sr", "ss"])
def test_decoupling_of_a_full_joint(equation):
    """Internal points: random substructures, well conditioned in all DOFs."""
    rng = np.random.default_rng(3)
    lines = rng.standard_normal((2, 40, 12, 12)) + 1j * rng.standard_normal((2, 40, 12, 12))
    a, b = (1e-6 * (h + h.swapaxes(1, 2)) for h in lines)
    k_joint = FULL.dynamic_stiffness(np.linspace(10, 500, 40))
    whole = jf.couple(a, b, k_joint, range(6), range(6))
    place = {"r": np.arange(6, 12), "s": np.arange(18, 24)}
    h_c = whole[:, place[equation[0]][:, None], place[equation[1]]]
    found = jf.decouple(equation, a, b, h_c, range(6), range(6), range(6, 12), range(6, 12))
    size = abs(k_joint).max(axis=0)
    assert (abs(found - k_joint) / size).max() < 1e-6


@pytest.mark.long
def test_a_full_joint_with_noise(bound):
    """21 stiffnesses and 21 dampings at 1 %, within their error bars."""
    h = jf.pollute(assembly(FULL, across=0.003), 0.01, seed=6)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        fit = jf.identify(FREQ, h, DOFS, cross="fit")
    truth = np.array(
        [
            (FULL.stiffness if name[0] == "k" else FULL.damping)[
                tuple(DOFS.index(d) for d in (2 * name[2:].split(","))[:2])
            ]
            for name in fit.value
        ]
    )
    off = np.array([*fit.value.values()]) - truth
    assert off.size == 42
    pull = off / np.array([*fit.std_error.values()])
    assert (abs(pull) < 4).all(), pull
    scale = np.sqrt(np.diag(fit.covariance))
    correlation = fit.covariance / np.outer(scale, scale)
    assert 15 < off @ np.linalg.solve(fit.covariance, off) < 85  # chi squared, 42 degrees of freedom
    assert (np.linalg.eigvalsh(correlation) > 0).all()
    assert fit.unit("k_x,theta_y") == "N"


@pytest.mark.long
def test_cross_terms_between_groups_are_not_seen_and_this_is_said(gamma):
    h = jf.pollute(gamma, 0.01, seed=7)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        fit = jf.identify(FREQ, h, DOFS, cross="fit")
        plain = jf.identify(FREQ, h, DOFS)
        chosen = jf.identify(FREQ[::3], h[::3], DOFS, damping="auto", cross="fit")
    assert len(fit.parameters) == 2 * (6 + 3 + 3)
    assert "k_x,y" not in fit.value
    assert "k_x,theta_y" in fit.value
    sentence = "the FRFs between (x, theta_y, theta_z) and (y, theta_x, z) are zero: each group is fitted separately"
    assert any(note == f"{sentence}, without cross terms between them [separate-groups]" for note in fit.notes)
    assert f"{sentence} [separate-groups]" in plain.notes
    assert fit.stiffness_matrix[0, 2] == 0
    assert np.isfinite(list(fit.std_error.values())).all()
    assert plain.noise_level == pytest.approx(0.01, rel=0.1)
    assert "k_x,y" not in chosen.value


def test_bands_of_some_dofs(gamma):
    """A group may have no lines where the other has them."""
    h = jf.pollute(gamma, 0.01, seed=8)
    bands = {"x": (100, 500), "theta_y": (100, 500), "theta_z": (200, 500)}
    bands |= {"y": (20, 300), "theta_x": (20, 300), "z": (20, 300)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        fit = jf.identify(FREQ, h, DOFS, bands=bands, damping="viscous")
    for name, value in zip(fit.value, TRUTH, strict=True):
        assert abs(fit.value[name] - value) < 4 * fit.std_error[name]


def test_a_moved_joint_is_the_same_joint():
    """FRFs of the assembly away from the joint do not depend on the points between which the joint is written."""
    offset = [0.004, -0.02, 0.013]
    turn = jf.rigid_offset(DOFS, offset)
    both = np.block([[turn, np.zeros((6, 6))], [np.zeros((6, 6)), np.eye(6)]])  # joint DOFs, then others
    joint = jf.Joint(JOINT.stiffness, JOINT.damping, DOFS, loss_factor=np.linspace(0, 0.5, 6))
    a, b = (np.tile(h, (1, 2, 2)) + np.kron(np.diag([0, 1]), 1e-3 * np.eye(6)) for h in sides(SHORT))
    before = jf.couple(a, b, joint.dynamic_stiffness(SHORT), range(6), range(6))
    moved = joint.moved(offset)
    after = jf.couple(both @ a @ both.T, both @ b @ both.T, moved.dynamic_stiffness(SHORT), range(6), range(6))
    others = [*range(6, 12), *range(18, 24)]
    size = abs(before[:, others][:, :, others]).max(axis=(1, 2), keepdims=True)
    assert (abs((after - before)[:, others][:, :, others]) / size).max() < 1e-9
    back = moved.moved(np.negative(offset))
    np.testing.assert_allclose(back.stiffness, joint.stiffness, atol=1e-6)
    np.testing.assert_allclose(back.hysteretic_stiffness, joint.hysteretic_stiffness, atol=1e-6)
    assert (np.linalg.eigvalsh(moved.stiffness) > 0).all()


def test_rigid_offset_is_the_kinematics_of_a_body():
    rng = np.random.default_rng(4)
    offset, motion, angle = rng.standard_normal((3, 3))
    names = ["ry", "ux", "rz", "y", "theta_x", "uz"]
    values = dict(zip(["ux", "y", "uz", "theta_x", "ry", "rz"], [*motion, *angle], strict=True))
    moved = jf.rigid_offset(names, offset) @ [values[n] for n in names]
    expected = dict(zip(["ux", "y", "uz"], motion + np.cross(angle, offset), strict=True))
    for name, value in zip(names, moved, strict=True):
        assert value == pytest.approx(expected.get(name, values[name]))
    np.testing.assert_allclose(side(SHORT, True, offset), *_moved_side(offset))


def _moved_side(offset):
    turn = jf.rigid_offset(DOFS, offset)
    return (turn @ side(SHORT, True, (0, 0, 0)) @ turn.T,)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: jf.rigid_offset(["x", "phi"], [0, 0, 1]), "dofs must be among x, y, z, theta_x, theta_y, theta_z"),
        (lambda: jf.rigid_offset(["x", "ux"], [0, 0, 1]), "dofs must name each direction once"),
        (lambda: jf.rigid_offset(["x"], [0, 1]), r"offset must have shape \(3\)"),
        (lambda: jf.Joint([1.0], dofs=["q"]).moved([0, 0, 1]), "dofs must be among"),
        (lambda: jf.Joint([1.0], loss_factor=-0.1), "loss_factor must not be negative"),
        (lambda: jf.Joint([1.0], structural_damping=[[1.0, 2.0]]), "structural_damping must have shape"),
    ],
)
def test_bad_arguments_get_one_sentence(call, message):
    with pytest.raises(ValueError, match=message):
        call()
