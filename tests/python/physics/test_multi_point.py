"""Equivalent multi-point connection: springs between deforming patches, rigid patches, noise, regeneration."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.channels.virtual_point import append_virtual_point, virtual_point, virtual_points
from jointfrf.substructuring.compliance import multi_point_compliance, multi_point_stiffness
from rigid_bodies import AROUND, BODY_A, BODY_B, DOFS, POINT, along, rigid_shapes, six, triaxial


@pytest.fixture(scope="module")
def riveted():
    """Two lapped beams joined by four springs in y: FRFs at the springs, and at a remote point of each behind them."""
    freq = np.arange(20.0, 800, 26)
    section = dict(youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, loss_factor=0.01)
    a = jf.beam(0.3, 12, ends=("clamped", "free"), **section)
    b = jf.beam(0.225, 9, **section)
    h_a = a.receptance(freq, a.index("10:y", "11:y", "12:y", "13:y", "7:y"))
    h_b = b.receptance(freq, b.index("1:y", "2:y", "3:y", "4:y", "10:y"))
    k = np.array([2e5, 4e5, 3e5, 5e5])
    joint = jf.Joint(k, 1e-4 * k)
    places = 0.025 * np.stack([np.arange(4) - 1.5, np.zeros(4), np.zeros(4)], axis=1)
    side = virtual_point(places, [[0, 1, 0]] * 4, [0, 0, 0], ["y", "theta_z"])
    whole = jf.couple(h_a, h_b, joint.dynamic_stiffness(freq), range(4), range(4))
    return freq, joint, h_a, h_b, whole, side


AT_SPRINGS = [0, 1, 2, 3, 5, 6, 7, 8]


def test_springs_between_deforming_patches(riveted):
    """Every spring, and the resultants sum k, sum k x, sum k x^2, although the beams bend between the springs."""
    freq, joint, _, _, whole, side = riveted
    gamma = whole[:, AT_SPRINGS][:, :, AT_SPRINGS]
    exact = joint.dynamic_stiffness(freq)
    found = multi_point_stiffness(gamma, side, side)
    np.testing.assert_allclose(found.lines, exact, rtol=1e-6, atol=1e-6 * abs(exact).max())
    k, x = np.einsum("faa->fa", exact), side.modes[:, 1]
    np.testing.assert_allclose(x, 0.025 * np.array([-1.5, -0.5, 0.5, 1.5]))
    resultants = np.array([[k.sum(axis=1), k @ x], [k @ x, k @ x**2]]).transpose(2, 0, 1)
    np.testing.assert_allclose(found.equivalent, resultants, rtol=1e-6)
    assert (found.rank == 8).all()
    compliance = multi_point_compliance(gamma, side, side)
    np.testing.assert_allclose(compliance.lines, np.linalg.inv(exact), rtol=1e-6, atol=1e-6 / k.real.max())
    # a rigid virtual point counts the bending of the beams as part of the joint
    t = virtual_points(side, side)
    as_rigid = jf.inverse_substructuring(jf.transform(gamma, t, t))
    assert np.median(abs(as_rigid / resultants - 1)) > 0.02


def test_the_assembly_is_regenerated_from_translations(riveted):
    freq, _, h_a, h_b, whole, side = riveted
    found = multi_point_stiffness(whole[:, AT_SPRINGS][:, :, AT_SPRINGS], side, side)
    again = jf.couple(h_a, h_b, found.lines, range(4), range(4), freq_hz=freq)
    np.testing.assert_allclose(again, whole, rtol=1e-6, atol=1e-8 * abs(whole).max())


def rigid_patches(freq, stiffness, places_b, seed=1):
    """Bodies whose patches are rigid, joined at the point: FRFs at channels of A and B, bodies at point + channels."""
    patches = [triaxial(POINT + AROUND), triaxial(POINT + places_b)]
    bodies, sides = [], []
    for body, patch, first in zip((BODY_A, BODY_B), patches, (seed, seed + 50), strict=True):
        channels = six(POINT) + along(*patch)
        modes = rigid_shapes(channels, POINT, 4, first, (250, 900))
        bodies.append(body.receptance(freq, channels, channels, modes))
        sides.append(virtual_point(*patch, POINT))
    whole = jf.couple(*bodies, stiffness, range(6), range(6))
    n_a, n_b = (h.shape[1] for h in bodies)
    measured = [*range(6, n_a), *range(n_a + 6, n_a + n_b)]
    return bodies, sides, whole[:, measured][:, :, measured]


def full_stiffness(freq, seed=3, size=(1e7, 1e7, 1e7, 1e4, 1e4, 1e4)):
    coupling = np.random.default_rng(seed).uniform(-0.3, 0.3, (6, 6))
    coupling = (coupling + coupling.T) / 2
    np.fill_diagonal(coupling, 1)
    root = np.sqrt(size)
    return jf.Joint(root[:, None] * coupling * root, np.sqrt(size) / 10, DOFS).dynamic_stiffness(freq)


@pytest.mark.parametrize("places_b", [AROUND, -0.8 * AROUND, np.vstack([AROUND, 0.5 * AROUND[:1] + 0.004])])
def test_rigid_patches_give_the_six_dof_joint(places_b):
    """Rank 12 of 24 or 27 channels: stiffness, compliance, and the matrix between channels of minimum norm."""
    freq = np.arange(20.0, 220, 9)
    k = full_stiffness(freq)
    _, (j, side_k), gamma = rigid_patches(freq, k, places_b)
    stiff = multi_point_stiffness(gamma, j, side_k, rank=12)
    np.testing.assert_allclose(stiff.equivalent, k, rtol=1e-7, atol=1e-8 * abs(k).max())
    expected = j.transform.T @ k @ side_k.transform
    np.testing.assert_allclose(stiff.lines, expected, rtol=1e-6, atol=1e-7 * abs(expected).max())
    soft = multi_point_compliance(gamma, j, side_k, rank=6)
    np.testing.assert_allclose(np.linalg.inv(soft.equivalent), k, rtol=1e-6, atol=1e-7 * abs(k).max())
    assert (stiff.singular_values[:, 12] < 1e-12 * stiff.singular_values[:, 0]).all()
    assert (soft.singular_values[:, 6] < 1e-12 * soft.singular_values[:, 0]).all()
    assert (stiff.rank == 12).all()
    assert (soft.rank == 6).all()
    with pytest.raises(jf.SingularLineError, match="gamma is singular in line 0: rigid patches") as caught:
        multi_point_stiffness(gamma, j, side_k)
    assert caught.value.lines.size == freq.size


def test_opposite_channels_couple_by_the_matrix_between_them():
    """Six rotations never appear: substructures at their channels only, joined by K between channels."""
    freq = np.arange(20.0, 220, 9)
    bodies, sides, gamma = rigid_patches(freq, full_stiffness(freq), AROUND)
    found = multi_point_stiffness(gamma, *sides, rank=12)
    a, b = (h[:, 6:, 6:] for h in bodies)
    again = jf.couple(a, b, found.lines, range(12), range(12))
    np.testing.assert_allclose(again, gamma, rtol=1e-5, atol=1e-7 * abs(gamma).max())


def test_channels_that_do_not_face_each_other_couple_at_the_points():
    freq = np.arange(20.0, 220, 9)
    bodies, sides, gamma = rigid_patches(freq, full_stiffness(freq), -0.8 * AROUND)
    found = multi_point_stiffness(gamma, *sides, rank=12)
    at = np.arange(12)
    a, b = (append_virtual_point(h[:, 6:, 6:], at, side) for h, side in zip(bodies, sides, strict=True))
    again = jf.couple(a, b, found.equivalent, range(12, 18), range(12, 18))
    own = [*range(12), *range(18, 30)]
    np.testing.assert_allclose(again[:, own][:, :, own], gamma, rtol=1e-5, atol=1e-7 * abs(gamma).max())


def test_a_joint_of_virtual_points_on_deforming_patches(random_lines):
    """gamma_jk passes six forces whatever the patches do; the equivalents are exact in both domains."""
    sides = [virtual_point(*triaxial(POINT + places), POINT) for places in (AROUND, -0.8 * AROUND)]
    k = 0.02 * random_lines(4, 6, seed=9)
    bodies = [random_lines(4, 12, seed=s) for s in (1, 2)]
    a, b = (append_virtual_point(h, np.arange(12), side) for h, side in zip(bodies, sides, strict=True))
    own = [*range(12), *range(18, 30)]
    gamma = jf.couple(a, b, k, range(12, 18), range(12, 18))[:, own][:, :, own]
    stiff = multi_point_stiffness(gamma, *sides)
    soft = multi_point_compliance(gamma, *sides, rank=6)
    assert (stiff.rank == 24).all()
    np.testing.assert_allclose(stiff.equivalent, k, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(np.linalg.inv(soft.equivalent), k, rtol=1e-5, atol=1e-7)
    assert (soft.singular_values[:, 6] < 1e-9 * soft.singular_values[:, 5]).all()


def test_the_threshold_is_what_noise_can_make():
    """Over many lines the largest singular value of pure noise stays below, and not far below."""
    side = virtual_point(*triaxial(POINT + AROUND), POINT)
    rng = np.random.default_rng(4)
    variance = np.full((400, 24, 24), 2.0)
    noise = rng.standard_normal((400, 24, 24)) + 1j * rng.standard_normal((400, 24, 24))
    with pytest.warns(jf.IdentificationWarning, match="400 of 400 lines use .* of the 12"):
        found = multi_point_stiffness(noise, side, side, noise=variance)
    ratio = found.singular_values[:, 0] / found.threshold
    assert np.mean(ratio < 1) > 0.95
    assert ratio.min() > 0.8
    assert not found.lines[found.rank == 0].any()
    np.testing.assert_allclose(found.threshold, 2 * np.sqrt(24 * 2.0))
    variance[:, 12:, :12] = 5.0
    with pytest.warns(jf.IdentificationWarning, match="of the 6 singular"):
        across = multi_point_compliance(noise, side, side, noise=variance)
    np.testing.assert_allclose(across.threshold, 2 * np.sqrt(12 * 2.0))


def test_noise_leaves_the_rigid_motions_and_their_joint():
    """1 permille of noise on 24 channels: rank 12 is found, the joint within some percent, and lost lines are named."""
    freq = np.arange(60.0, 160, 2)
    k = full_stiffness(freq)
    _, sides, gamma = rigid_patches(freq, k, -0.8 * AROUND)
    measured = jf.pollute(gamma, 0.001, seed=6)
    with pytest.warns(jf.IdentificationWarning, match="of the 12 singular values"):
        stiff = multi_point_stiffness(measured, *sides, noise=0.001)
    good = stiff.rank == 12
    assert (stiff.rank <= 12).all()
    assert good.mean() > 0.7
    scale = np.sqrt(abs(np.einsum("fa,fb->fab", np.einsum("faa->fa", k), np.einsum("faa->fa", k))))
    assert np.median(abs(stiff.equivalent - k)[good] / scale[good]) < 0.01
    soft = multi_point_compliance(measured, *sides, rank=6)
    assert np.median(abs(np.linalg.inv(soft.equivalent) - k) / scale) < 0.01
    same = multi_point_stiffness(measured[good], *sides, noise=(0.001 * abs(measured[good])) ** 2)
    np.testing.assert_array_equal(same.equivalent, stiff.equivalent[good])


def test_bad_arguments(riveted):
    _, _, _, _, whole, side = riveted
    gamma = whole[:2, AT_SPRINGS][:, :, AT_SPRINGS]
    turned = virtual_point(side.modes * [[0, 1]] @ [[0, 0, 0], [1, 0, 0]], [[0, 1, 0]] * 4, [0, 0, 0], ["theta_z", "y"])
    for function, most in ((multi_point_stiffness, 8), (multi_point_compliance, 4)):
        for arguments, more, message in (
            ((gamma, side, turned), {}, "the same DOFs in the same order, not y, theta_z and theta_z, y"),
            ((gamma[:, :7, :7], side, side), {}, "the 4 channels of side_j, then the 4 of side_k, not 7"),
            ((np.full_like(gamma, np.nan), side, side), {}, "gamma: NaN or Inf in line 0"),
            ((gamma, side, side), {"rank": 0}, f"rank must lie between 1 and {most}"),
            ((gamma, side, side), {"rank": most + 1}, f"rank must lie between 1 and {most}"),
            ((gamma, side, side), {"rank": 4, "noise": 0.1}, "rank and noise exclude one another"),
            ((gamma, side, side), {"noise": 0.0}, "noise must be positive"),
            ((gamma, side, side), {"noise": -abs(gamma)}, "noise must not contain negative variances"),
            ((gamma, side, side), {"noise": [0.1]}, "noise must have shape"),
        ):
            with pytest.raises(ValueError, match=message):
                function(*arguments, **more)
    with pytest.warns(jf.IdentificationWarning, match="2 of 2 lines use .* of the 4 singular values"):
        multi_point_stiffness(gamma, side, side, rank=3)
