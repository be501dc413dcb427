"""Errors of the positions of channels: slopes of the rigid motion, and their effect, by moving the points."""

import numpy as np
import pytest

import jointfrf as jf

pytestmark = pytest.mark.filterwarnings("ignore::jointfrf.IdentificationWarning")

#: Points of sides j and k, m.
PLACES = (-0.02, 0.0), (0.0, 0.02)


def sides(places):
    points = [
        jf.virtual_point([[x, 0, 0] for x in own], [[0, 1, 0]] * len(own), [0, 0, 0], ["y", "theta_z"])
        for own in places
    ]
    return jf.virtual_interface(*points)


def fit_of(beams, h, transform, **options):
    return jf.identify(beams.freq, h, transform=transform, damping="viscous", noise=0.002, **options)


def test_slopes_of_the_motion_are_differences():
    rng = np.random.default_rng(5)
    at, along, dofs = rng.normal(size=(5, 3)), rng.normal(size=(5, 3)), ["x", "z", "theta_x", "theta_y", "theta_z"]
    along /= np.linalg.norm(along, axis=1)[:, None]
    one = jf.virtual_point(at, along, [0.1, 0.2, 0.3], dofs)
    found = jf.virtual_interface(one, one)
    for axis, unit in enumerate(np.eye(3)):
        moved = jf.virtual_point(at + unit, along, [0.1, 0.2, 0.3], dofs)
        np.testing.assert_allclose(
            found.mode_slopes[axis], jf.virtual_interface(moved, moved).modes - found.modes, atol=1e-12
        )


@pytest.mark.parametrize("same", [True, False])
def test_effect_is_that_of_moved_points(beams, same):
    """Sensors and impacts are at the same points, or each at their own."""
    stated, other = sides(PLACES), sides(PLACES)
    h = jf.pollute(stated.modes @ beams.gamma(beams.joint) @ stated.modes.T, 0.002, seed=1)
    transform = stated if same else (stated, other)
    fit, step, squares = fit_of(beams, h, transform), 1e-5, {name: 0.0 for name in ("k_theta_z", "c_theta_z")}
    for place in ((side, i) for side in range(2) for i in range(2)):
        rows = sides([[x + step * ((s, i) == place) for i, x in enumerate(own)] for s, own in enumerate(PLACES)])
        # FRFs of the moved points, to first order: the channel's motion changes.
        change = (rows.modes - stated.modes) @ stated.transform
        for moved in [h + change @ h + h @ change.T] if same else [h + change @ h, h + h @ change.T]:
            found = fit_of(beams, moved, transform)
            for name in squares:
                squares[name] += ((found.value[name] - fit.value[name]) / step * 1e-3) ** 2
    for name, square in squares.items():
        effect = fit.data.hidden_errors()["position"][name]
        assert effect == pytest.approx(np.sqrt(square), rel=0.1)
        wider = fit_of(beams, h, transform, position_error=1e-3)
        more = np.sqrt(wider.std_error[name] ** 2 - fit.std_error[name] ** 2)
        assert more == pytest.approx(effect, rel=0.05)
        assert wider.value[name] == pytest.approx(fit.value[name])


def test_intervals_cover_points_that_are_off(beams):
    stated, z = sides(PLACES), []
    for seed in range(16):
        off = np.random.default_rng(seed).normal(size=(2, 2)) * 5e-4
        moved = sides([[x + d for x, d in zip(own, away, strict=True)] for own, away in zip(PLACES, off, strict=True)])
        h = jf.pollute(moved.modes @ beams.gamma(beams.joint) @ moved.modes.T, 0.002, seed=seed)
        fit = fit_of(beams, h, stated, position_error=5e-4)
        z.append((fit.value["k_theta_z"] - beams.joint.stiffness[1, 1]) / fit.std_error["k_theta_z"])
        low, high = fit.confidence_interval()["k_theta_z"]
        assert (low + high) / 2 == pytest.approx(fit.value["k_theta_z"], rel=0.05)
    assert 0.5 < np.sqrt(np.mean(np.square(z))) < 1.5


def test_positions_must_be_known_and_matter(beams):
    stated = sides(PLACES)
    h = stated.modes @ beams.gamma(beams.joint) @ stated.modes.T
    for transform, dofs in ((None, ["y", "theta"]), (stated.transform, ["y", "theta"])):
        with pytest.raises(ValueError, match="position_error needs rotations among the joint DOFs and the positions"):
            jf.identify(beams.freq, h, dofs, transform=transform, position_error=1e-3)
    line = jf.interface([1], [2], ["y"], {1: (0, 0, 0), 2: (0, 0, 0)})
    with pytest.raises(ValueError, match="position_error needs rotations"):
        jf.identify(beams.freq, h[:, 1:3, 1:3], transform=line, position_error=1e-3)
    with pytest.raises(ValueError, match="position_error must not be negative, not -1"):
        jf.identify(beams.freq, h, transform=stated, position_error=-1)
