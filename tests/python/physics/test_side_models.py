"""Sides that bend: the exact relation between C seen and C, and FRFs corrected by models of the sides."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

import jointfrf as jf
from deforming_blocks import ALUMINIUM, STIFFNESS, block, measured
from jointfrf.dofs import DIRECTIONS
from jointfrf.identification.manifold.prepare import FitOptions, prepare_compliance
from jointfrf.identification.noise import NoiseOptions
from jointfrf.identification.prepare import as_measured
from jointfrf.identification.side_models import corrected_frfs

SECTION = {"density": 2700.0, "width": 0.025, "height": 0.012, "loss_factor": 0.01}
FREQ = np.linspace(20.0, 3000.0, 60)
#: Nodes of sensors and of impacts, every 10 mm along beams of 0.3 and 0.2 m: the joint is at the end of A, start of B.
SENSORS, IMPACTS = ((22, 25, 28), (3, 6, 9)), ((24, 26, 29, 30), (2, 4, 7, 8))
DOFS = ("y", "theta_z")
JOINT = jf.Joint([4e6, 6e3], [60.0, 0.5], DOFS)


def beams(youngs_modulus=70e9):
    return [jf.beam(length, round(length / 0.01), youngs_modulus=youngs_modulus, **SECTION) for length in (0.3, 0.2)]


def at(side):
    """Joint DOFs of a beam."""
    return ["31:y", "31:theta"] if side == 0 else ["1:y", "1:theta"]


def points(side, nodes):
    places = [[0.01 * (node - 1) - (0.3 if side == 0 else 0.0), 0, 0] for node in nodes]
    return jf.virtual_point(places, [[0, 1, 0]] * len(nodes), [0, 0, 0], DOFS)


def whole(joint, rows, columns, youngs_modulus=70e9):
    """FRFs of the assembly from its matrices: no substructuring."""
    a, b = beams(youngs_modulus)
    assembly = jf.assemble(a, b, joint, a.index(*at(0)), b.index(*at(1)))
    n = len(a.dofs)
    out, into = (
        [a.index(f"{i}:y") for i in own[0]] + [n + b.index(f"{i}:y") for i in own[1]] for own in (rows, columns)
    )
    eta = SECTION["loss_factor"]
    k, m, c = (np.asarray(x.todense() if hasattr(x, "todense") else x) for x in
               (assembly.stiffness, assembly.mass, assembly.damping))  # fmt: skip
    # Structural damping of the beams alone: the joint has a dashpot.
    h = eta * np.block([[np.asarray(a.stiffness.todense()), np.zeros((n, len(b.dofs)))],
                        [np.zeros((len(b.dofs), n)), np.asarray(b.stiffness.todense())]])  # fmt: skip
    found = []
    for omega in 2 * np.pi * FREQ:
        z = k + 1j * h + 1j * omega * c - omega**2 * m
        found.append(np.linalg.solve(z, np.eye(len(k))[:, into])[out])
    return np.array(found)


def interfaces():
    return [jf.virtual_interface(*(points(side, own[side]) for side in (0, 1))) for own in (SENSORS, IMPACTS)]


def free(side, rows, columns):
    model = beams()[side]
    return model.receptance(FREQ, model.index(*rows), model.index(*columns))


@pytest.mark.parametrize("factor", [0.01, 1.0, 100.0])
def test_the_compliance_seen_is_that_of_joint_and_sides_between_factors_of_inertia(factor):
    """C_seen = Q (C + D_A + D_B) P, with P, Q, D of the free sides alone: the FRFs come from the whole assembly."""
    joint = jf.Joint(factor * JOINT.stiffness.diagonal(), JOINT.damping.diagonal(), DOFS)
    one, other = interfaces()
    gamma = one.transform @ whole(joint, SENSORS, IMPACTS) @ other.transform.T
    jj, jk, kj, kk = gamma[:, :2, :2], gamma[:, :2, 2:], gamma[:, 2:, :2], gamma[:, 2:, 2:]
    seen = kk @ np.linalg.inv(jk) @ jj - kj
    middle, factors = np.linalg.inv(joint.dynamic_stiffness(FREQ)), []
    for side in (0, 1):
        u, f = ([f"{i}:y" for i in own[side]] for own in (SENSORS, IMPACTS))
        t_u, t_f = points(side, SENSORS[side]).transform, points(side, IMPACTS[side]).transform
        q = at(side)
        cc, cq, qc = t_u @ free(side, u, f) @ t_f.T, t_u @ free(side, u, q), free(side, q, f) @ t_f.T
        middle = middle + free(side, q, q) - qc @ np.linalg.inv(cc) @ cq
        factors.append(np.linalg.inv(cq) @ cc if side == 0 else cc @ np.linalg.inv(qc))
    expected = factors[1] @ middle @ factors[0]
    np.testing.assert_allclose(seen, expected, rtol=0, atol=1e-6 * abs(expected).max(axis=(1, 2), keepdims=True).max())
    # It is far from the joint's.
    assert abs(seen[0] - np.linalg.inv(joint.dynamic_stiffness(FREQ[:1]))[0]).max() > 1e-9


def side_models(youngs_modulus=70e9, **more):
    found = []
    for side, model in enumerate(beams(youngs_modulus)):
        u, f = ([f"{i}:y" for i in own[side]] for own in (SENSORS, IMPACTS))
        found.append(jf.SideModel(jf.Substructure(model, at(side)), u, f, **more))
    return tuple(found)


def corrected(h, sides):
    one, other = interfaces()
    modes = [x.modes for x in (one, other)]
    return corrected_frfs(FREQ, h, h, 1e-30 * np.ones(h.shape), (one.transform, other.transform), tuple(modes), sides)


def test_corrected_frfs_are_those_of_a_joint_between_rigid_sides():
    h = whole(JOINT, SENSORS, IMPACTS)
    found = corrected(h, side_models())
    one, other = interfaces()
    gamma = one.transform @ found.h @ other.transform.T
    np.testing.assert_allclose(gamma, found.smooth_gamma, rtol=0, atol=1e-9 * abs(gamma).max())
    k = np.linalg.inv(jf.joint_compliance(gamma))
    np.testing.assert_allclose(k, JOINT.dynamic_stiffness(FREQ), rtol=0, atol=2e-3 * 4e6)
    relative = np.einsum("ldd->ld", k) / np.einsum("ldd->ld", JOINT.dynamic_stiffness(FREQ)) - 1
    assert np.median(abs(relative)) < 1e-4
    # What is not rigid in the channels stays as measured.
    rest = [np.eye(len(x.modes)) - x.modes @ x.transform for x in (one, other)]
    np.testing.assert_allclose(rest[0] @ (found.h - h), 0, atol=1e-12 * abs(h).max())
    np.testing.assert_allclose((found.h - h) @ rest[1].T, 0, atol=1e-12 * abs(h).max())


def test_noise_and_errors_of_models_go_the_way_that_is_said():
    """A change of the measured FRFs moves those at the joint by N_r e N_f^T; a model that is off moves them as said."""
    rng = np.random.default_rng(1)
    h = whole(JOINT, SENSORS, IMPACTS)
    e = 1e-3 * abs(h) * (rng.standard_normal(h.shape) + 1j * rng.standard_normal(h.shape))
    base, moved = (corrected(own, side_models()) for own in (h, h + e))
    expected = base.noise_paths[0] @ e @ base.noise_paths[1].swapaxes(1, 2)
    np.testing.assert_allclose(
        moved.smooth_gamma - base.smooth_gamma, expected, rtol=0, atol=1e-9 * abs(expected).max()
    )
    names = list(base.error_names)
    stiffer = side_models()
    source = stiffer[0].part.source
    softer = replace(stiffer[0], part=jf.Substructure(replace(source, stiffness=1.03 * source.stiffness), at(0)))
    other = corrected(h, (softer, stiffer[1]))
    difference = other.smooth_gamma - base.smooth_gamma
    own = base.errors[:, names.index("j: youngs_modulus")]
    np.testing.assert_allclose(own, difference, rtol=0, atol=1e-4 * abs(difference).max())
    # One mode with an eigenvalue that is 3 % higher: K + 0.03 w^2 M phi phi^T M.
    a = beams()[0]
    k, m = (np.asarray(x.todense()) for x in (a.stiffness, a.mass))
    squared, shapes = eigh(k, m)
    mode = 4
    moment = m @ shapes[:, mode]
    higher = replace(a, stiffness=k + 0.03 * squared[mode] * np.outer(moment, moment))
    other = corrected(h, (replace(stiffer[0], part=jf.Substructure(higher, at(0))), stiffer[1]))
    (own,) = (base.errors[:, i] for i, name in enumerate(names)
              if name == f"j: mode at {np.sqrt(squared[mode]) / (2 * np.pi):.4g} Hz")  # fmt: skip
    difference = other.smooth_gamma - base.smooth_gamma
    np.testing.assert_allclose(own, difference, rtol=0, atol=1e-4 * abs(difference).max())


@pytest.mark.parametrize("wrong", [1.0, 0.98])
def test_a_joint_between_beams_is_found_by_models_of_them(wrong):
    """Without models the rotational stiffness is far off; a model that is 2 % wrong is in the interval."""
    h = jf.pollute(whole(JOINT, SENSORS, IMPACTS), 0.01, seed=3)
    options = {"damping": "viscous", "noise": 0.01}  # which 60 lines do not show by themselves
    fit = jf.identify(FREQ, h, transform=tuple(interfaces()), sides=side_models(wrong * 70e9), **options)
    limits = fit.confidence_interval(0.95)
    for dof, k in zip(DOFS, JOINT.stiffness.diagonal(), strict=True):
        low, high = limits[f"k_{dof}"]
        assert low < k < high
        assert fit.value[f"k_{dof}"] == pytest.approx(k, rel=0.1)
    assert any("[sides-corrected]" in text for text in fit.notes)
    assert not fit.seen


def test_noise_carried_by_models_has_the_covariance_that_is_used():
    """Sensors at the impacts, more noise in h_pq than in h_qp: whitened entries have mean square 1 on each line."""
    h = whole(JOINT, SENSORS, SENSORS)
    more = np.where(np.tri(h.shape[1], dtype=bool), 1.0, 0.3)
    variance = (1e-4 * more * abs(h)) ** 2
    point = jf.virtual_interface(*(points(side, SENSORS[side]) for side in (0, 1)))
    sides = tuple(
        jf.SideModel(
            jf.Substructure(model, at(side), {name: jf.Unknown(1.0, 1e-9) for name in ("youngs_modulus", "density")}),
            [f"{i}:y" for i in SENSORS[side]], modes=0.0,
        )
        for side, model in enumerate(beams())
    )  # fmt: skip
    squares = []
    for seed in range(8):
        real, imaginary = np.random.default_rng(seed).standard_normal((2, *h.shape))
        noisy = h + np.sqrt(variance / 2) * (real + 1j * imaginary)
        problem = prepare_compliance(
            as_measured(FREQ, noisy, square=False), DOFS, None, point, NoiseOptions(variance),
            FitOptions("viscous", "zero", True), sides,
        )  # fmt: skip
        lines = problem.frfs.of_dofs(np.arange(2))
        true = problem.frfs.entries_of(np.arange(2), corrected_frfs(
            FREQ, h, h, variance, (point.transform, point.transform), (point.modes, point.modes), sides
        ).smooth_gamma)  # fmt: skip
        residual = (lines.measured - true) * lines.inverse_std
        squares.append((abs(np.einsum("lij,lj->li", lines.correlation, residual)) ** 2).mean(axis=1))
    np.testing.assert_allclose(np.mean(squares, axis=0), 1, atol=5 / np.sqrt(8 * 10))


def block_models(softer=1.0):
    found = []
    for start, end, sign in ((-0.12, 0.0, -1), (0.0, 0.1, 1)):
        model, z = block(start, end), 0.02 * sign
        model = replace(model, stiffness=model.stiffness / softer)
        places = np.array([[0.04, 0, z], [-0.04, 0, z], [0, 0.03, z], [0, -0.03, z]])
        names = [f"{model.mesh.near(place) + 1}:{axis}" for place in places for axis in "xyz"]
        found.append(jf.SideModel(jf.Substructure(model, [f"joint:{d}" for d in DIRECTIONS]), names))
    return tuple(found)


@pytest.mark.parametrize(("softer", "seed"), [(1.0, 1), (1.03, 2), pytest.param(0.97, 3, marks=pytest.mark.long)])
def test_a_hammer_test_of_two_blocks_holds_by_models(softer, seed):
    """24 x 24 channels, 1 % noise: all stiffnesses inside, errors of at most 0.8 %."""
    freq = tuple(np.arange(10.0, 601.0, 10))
    h, points_of, _ = measured(freq, 0.02)
    assert ALUMINIUM.loss_factor == 0.005
    fit = jf.identify(
        freq, jf.pollute(h, 0.01, seed=seed), transform=jf.virtual_interface(*points_of), sides=block_models(softer)
    )
    limits = fit.confidence_interval(0.95)
    assert abs(fit.stiffness / STIFFNESS - 1).max() < 0.008
    held = [low < k < high for k, (low, high) in zip(STIFFNESS, (limits[f"k_{d}"] for d in DIRECTIONS), strict=True)]
    assert sum(held) >= 5


def test_wrong_models_are_named():
    sides, (one, other) = side_models(), interfaces()
    h = whole(JOINT, SENSORS, IMPACTS)
    with pytest.raises(ValueError, match="side j has 2 responses in its model, and 3 in the FRFs"):
        corrected(h, (replace(sides[0], responses=sides[0].responses[:2]), sides[1]))
    part = jf.Substructure(beams()[0], ["31:y"])
    with pytest.raises(ValueError, match="side j has 1 joint DOFs in its model, not 2"):
        corrected(h, (replace(sides[0], part=part), sides[1]))
    with pytest.raises(ValueError, match="responses: channel 1: the part has no DOF '99:y'"):
        jf.SideModel(part, ["99:y"])
    with pytest.raises(ValueError, match="no standard deviation"):
        jf.SideModel(jf.Substructure(beams()[0], ["31:y"], {"density": jf.Unknown(2700.0)}), ["3:y"])
    with pytest.raises(ValueError, match="models of both sides"):
        jf.identify(FREQ, h, transform=(one, other), sides=sides[:1])


def test_weighted_channels_are_sums_of_dofs():
    h = whole(JOINT, SENSORS, IMPACTS)
    sides = side_models()
    turned = [{name: -1.0} for name in sides[0].responses[:1]] + list(sides[0].responses[1:])
    flipped = h.copy()
    flipped[:, 0] *= -1
    one, other = interfaces()
    signs = np.diag([-1.0, 1, 1, 1, 1, 1])
    pair = (one.transform @ signs, other.transform), (signs @ one.modes, other.modes)
    models = replace(sides[0], responses=turned, forces=sides[0].forces), sides[1]
    found = corrected_frfs(FREQ, flipped, flipped, 1e-30 * np.ones(h.shape), *pair, models)
    np.testing.assert_allclose(found.smooth_gamma, corrected(h, sides).smooth_gamma, rtol=1e-9)
