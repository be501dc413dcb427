"""The lowest minimum of squares in a compliance and its rate, which are polar coordinates."""

import numpy as np
import pytest

from jointfrf.identification.manifold.coordinates import DiagonalJoint, joint_terms
from jointfrf.identification.manifold.line_forms import LineForms

OMEGA = 2 * np.pi * np.linspace(10, 500, 40)


def forms_of(compliance, error):
    n = compliance.shape[1]
    weight = np.broadcast_to(np.eye(n, dtype=complex) / error**2, (OMEGA.size, n, n))
    return LineForms(compliance, weight, np.zeros_like(compliance), np.zeros(OMEGA.size))


@pytest.mark.parametrize("damping", ["viscous", "hysteretic"])
def test_a_wrong_sign_of_damping_is_left(damping):
    joint = DiagonalJoint(joint_terms(OMEGA, ["x"], damping, "zero"))
    truth = np.array([1e-6, 3 * joint.rate_of_one[0]])
    forms = forms_of(joint.compliance(truth), 1e-7)
    caught = np.array([0.0, joint.lower[1]])
    assert joint.minimise(forms, caught).cost > 100
    np.testing.assert_allclose(joint.lowest(forms, caught).x, truth, rtol=1e-4)


def test_a_held_coordinate_is_kept_and_other_dofs_do_not_move():
    joint = DiagonalJoint(joint_terms(OMEGA, ["x", "y"], "viscous", "zero"))
    truth = np.array([1e-6, 2e-6, 1e-4, 3e-4])
    forms = forms_of(joint.compliance(truth), 1e-7)
    found = joint.lowest(forms, np.array([0.0, 2e-6, 0.0, 3e-4]), held=0)
    np.testing.assert_allclose(found.x[[0, 1, 3]], [0, 2e-6, 3e-4], rtol=1e-6)


def test_damping_itself_as_coordinate():
    terms = joint_terms(OMEGA, ["x"], "viscous", "zero")
    truth = np.array([1e-6, 400.0])
    joint = DiagonalJoint(terms, by_rate=False)
    forms = forms_of(joint.compliance(truth), 1e-7)
    np.testing.assert_allclose(joint.lowest(forms, np.array([0.0, -1e9])).x, truth, rtol=1e-3)
