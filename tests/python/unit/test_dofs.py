"""Names of DOFs, units, parameters of a joint, rigid motion."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.dofs import (
    DIRECTIONS,
    Parameter,
    compliance_unit,
    direction_names,
    direction_places,
    is_rotation,
    joint_parameters,
)


@pytest.mark.parametrize(
    "dof", ["theta", "Mtheta", "theta_x", "Mtheta_y", "rz", "rot_x", "Mz", "RX", "phi", "rot1", "mtheta"]
)
def test_names_of_rotations(dof):
    assert is_rotation(dof)
    assert Parameter.of_dof("k", dof).unit == "N m/rad"
    assert compliance_unit(dof, dof) == "rad/(N m)"


@pytest.mark.parametrize("dof", ["x", "uy", "u_z", "Fx", "F", "0", "y1", "radial", "m", "r", "main"])
def test_other_names_are_displacements(dof):
    assert not is_rotation(dof)
    assert Parameter.of_dof("c", dof).unit == "N s/m"
    assert compliance_unit(dof, dof) == "m/N"


@pytest.mark.parametrize(
    ("one", "name", "unit"),
    [
        (Parameter.of_dof("k", "bolt1.y"), "bolt1.k_y", "N/m"),
        (Parameter("c", "bolt1.y", "bolt1.rz"), "bolt1.c_y,rz", "N s"),
        (Parameter("h", "left.a.rx", "left.a.ry"), "left.a.h_rx,ry", "N m/rad"),
        (Parameter("k", "a.y", "b.rz"), "k_a.y,b.rz", "N"),
        (Parameter.of_dof("k", "y"), "k_y", "N/m"),
    ],
)
def test_parameters_at_points_are_read_as_they_are_written(one, name, unit):
    assert (one.name, one.unit) == (name, unit)
    assert Parameter.parse(name) == one


def test_units_between_a_displacement_and_a_rotation():
    assert [Parameter(kind, "y", "Mtheta").unit for kind in "khc"] == ["N", "N", "N s"]
    assert (compliance_unit("y", "theta"), compliance_unit("theta", "y")) == ("m/(N m)", "rad/N")


def test_every_spelling_of_a_direction_leads_to_the_same_name():
    spellings = (
        ("x", "ux", "u_x", "X", "Fx"),
        ("theta_x", "thetax", "rx", "rot_x", "rotx", "Mx", "Mtheta_x", "RX"),
    )
    for names, direction in zip(spellings, ("x", "theta_x"), strict=True):
        assert {direction_names([name]) for name in names} == {(direction,)}
        assert all(is_rotation(name) == direction.startswith("theta") for name in names)
    assert direction_places(DIRECTIONS).tolist() == list(range(6))


@pytest.mark.parametrize(("dofs", "says"), [(["q"], "must be among"), (["x", "ux"], "each direction once")])
def test_wrong_directions_are_named(dofs, says):
    with pytest.raises(ValueError, match=says):
        direction_places(dofs)


def test_a_parameter_and_its_name_are_the_same():
    every = joint_parameters(["y", "theta"], ("k", "h", "c"), cross=True)
    assert [p.name for p in every[:3]] == ["k_y", "k_theta", "k_y,theta"]
    assert [Parameter.parse(p.name) for p in every] == list(every)
    assert [p.is_cross for p in every] == [False, False, True] * 3


@pytest.mark.parametrize("name", ["", "k", "k_", "x_y", "ky", "k_,y", "k_y,", "_y"])
def test_a_name_that_is_no_parameter(name):
    with pytest.raises(ValueError, match="a parameter must be named"):
        Parameter.parse(name)


def test_names_of_the_thesis_serve_for_offsets_and_cards():
    joint = jf.Joint([1e6, 1e3], dofs=["Fz", "Mtheta_x"])
    plain = jf.Joint([1e6, 1e3], dofs=["z", "theta_x"])
    offset = [0.0, 0.1, 0.0]
    assert np.array_equal(joint.moved(offset).stiffness, plain.moved(offset).stiffness)
    assert joint.export("nastran", (1, 2)) == plain.export("nastran", (1, 2))
