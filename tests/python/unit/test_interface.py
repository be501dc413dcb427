"""Joint DOFs from points: signs and places of rotations, and what cannot be built."""

import warnings

import numpy as np
import pytest

import jointfrf as jf


def rigid(place, translation, rotation):
    return translation + np.cross(rotation, place)


@pytest.mark.parametrize("along", ["x", "y", "z"])
@pytest.mark.parametrize("seed", [0, 1])
def test_rigid_motion_is_recovered(along, seed):
    """Displacements of a rigid body at three points of a line give back its motion at their middle."""
    rng = np.random.default_rng(seed)
    translation, rotation = rng.standard_normal(3), rng.standard_normal(3)
    axis = "xyz".index(along)
    base = rng.standard_normal(3)
    coordinates = {node: base + step * np.eye(3)[axis] for node, step in ((1, -0.02), (2, 0.01), (3, 0.02))}
    coordinates |= {node + 10: place for node, place in coordinates.items()}
    dofs = ["x", "y", "z", *(f"theta_{a}" for a in "xyz" if a != along)]
    sides = jf.interface([1, 2, 3], [11, 12, 13], dofs, coordinates)
    motion = [rigid(coordinates[c.node] - base, translation, rotation)["xyz".index(c.axis)] for c in sides.channels]
    found = sides.transform @ np.array(motion)
    expected = [*translation, *(rotation["xyz".index(a)] for a in "xyz" if a != along)]
    np.testing.assert_allclose(found, [*expected, *expected], atol=1e-12)
    np.testing.assert_allclose(sides.references[0], base)


def test_signs_of_the_rotations():
    places = {1: (0, 0, 0), 2: (0, 0, 0.02), 3: (0, 0, 0), 4: (0, 0, 0.02)}
    assert jf.interface([1, 2], [3, 4], ["theta_x"], places).transform[0, :2].tolist() == [50.0, -50.0]  # -du_y/dz
    places = {1: (0, 0, 0), 2: (0.02, 0, 0), 3: (0, 0, 0), 4: (0.02, 0, 0)}
    theta_z = jf.interface([1, 2], [3, 4], ["theta_z"], places)
    assert theta_z.transform[0, :2].tolist() == [-50.0, 50.0]  # du_y/dx
    assert [c.axis for c in theta_z.channels] == ["y"] * 4
    theta_y = jf.interface([1, 2], [3, 4], ["theta_y"], places)
    assert theta_y.transform[0, :2].tolist() == [50.0, -50.0]  # -du_z/dx


def test_one_point_a_side_for_displacements():
    sides = jf.interface([5], [6], ["y"], {5: (0, 0, 0), 6: (0, 1, 0)})
    np.testing.assert_array_equal(sides.transform, np.eye(2))


LINE = {1: (0, 0, 0), 2: (0, 0, 0.02), 3: (0, 0, 0), 4: (0, 0, 0.02), 5: (0.01, 0, 0.01)}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([1, 2], [3, 4], ["y", "phi"], LINE), "dofs must be among x, y, z, theta_x, theta_y, theta_z, not 'phi'"),
        (([1, 2], [3, 4], ["y", "y"], LINE), "dofs must name each direction once, not y, y"),
        (([1, 2], [3, 4], [], LINE), "dofs must name at least one joint DOF"),
        (([1, 2], [2, 4], ["y"], LINE), "node 2 is named on both sides"),
        (([1, 1], [3, 4], ["y"], LINE), "different nodes, not 1, 1"),
        (([1, 9], [3, 4], ["y"], LINE), "node 9 has no coordinates"),
        (([1, 2, 5], [3, 4], ["y"], LINE), "do not lie on one line"),
        (([1], [3], ["theta_x"], LINE), "theta_x needs at least two nodes"),
        (([1, 2], [3, 4], ["theta_z"], LINE), "along its axis z; name nodes off that axis"),
    ],
)
def test_what_cannot_be_built_is_said(arguments, message):
    with pytest.raises(ValueError, match=message):
        jf.interface(*arguments)


def test_directions_may_be_spelt_in_any_way():
    plain, other = (jf.interface([1, 2], [3, 4], dofs, LINE) for dofs in (["y", "theta_x"], ["Fy", "rx"]))
    assert plain.channels == other.channels
    assert np.array_equal(plain.transform, other.transform)


@pytest.mark.parametrize(("length", "highest_hz", "warned"), [(2.9, 1e3, False), (3.1, None, True), (2.9, 5e4, True)])
def test_points_too_far_apart_for_a_joint_are_named(length, highest_hz, warned):
    places = {1: (0, 0, 0), 2: (0, 0, 0.02), 3: (0, 0, 0), 4: (0, 0, length)}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        jf.interface([1, 2], [3, 4], ["theta_x"], places, highest_hz=highest_hz)
    assert bool(caught) == warned
    if warned:
        assert f"the points of side k are {length:.3g} m apart" in str(caught[0].message)
        assert caught[0].filename == __file__
