"""K* as a sum of terms: its compliance, slopes and coordinates by other routes."""

import numpy as np
import pytest

from jointfrf.identification.manifold.coordinates import CoupledJoint, DiagonalJoint, joint_terms

OMEGA = 2 * np.pi * np.array([10.0, 80.0, 300.0])
DOFS = ["x", "y", "theta"]
MIXED = ["both", "viscous", "none"]


def names(terms):
    return [one.name for one in terms.parameters]


def values(terms, seed=0):
    """Parameters of the size of a joint."""
    size = np.array([5e5, 5e4, 50.0])[terms.kinds] * np.where(terms.pairs[:, 0] == terms.pairs[:, 1], 1, 0.2)
    return size * np.random.default_rng(seed).uniform(0.5, 2, size.size)


def differences(function, x):
    """Return central differences by each coordinate, last axis."""
    steps = 1e-6 * np.maximum(abs(x), 1e-12)
    columns = [
        (function(x + step * unit) - function(x - step * unit)) / (2 * step)
        for step, unit in zip(steps, np.eye(x.size), strict=True)
    ]
    return np.stack(columns, axis=-1)


def close(actual, expected, tolerance):
    """Relative to the largest of each column: coordinates differ in size."""
    columns = tuple(range(actual.ndim - 1))
    assert (abs(actual - expected).max(axis=columns) <= tolerance * abs(expected).max(axis=columns)).all()


def test_every_dof_has_the_damping_asked_for_and_a_cross_term_what_both_have():
    assert names(joint_terms(OMEGA, DOFS, MIXED, "zero")) == ["k_x", "k_y", "k_theta", "h_x", "c_x", "c_y"]
    fitted = joint_terms(OMEGA, DOFS, MIXED, "fit")
    assert set(names(fitted)) - set(names(joint_terms(OMEGA, DOFS, MIXED, "zero"))) == {
        "k_x,y",
        "k_x,theta",
        "k_y,theta",
        "c_x,y",
    }
    assert fitted.has_cross_terms
    assert not joint_terms(OMEGA, DOFS, "both", "ignore").has_cross_terms


def test_equal_points_change_together():
    dofs = ["a.x", "a.y", "b.x", "b.y", "c.x"]
    terms = joint_terms(OMEGA, dofs, "viscous", "points", [["a", "b"]])
    assert names(terms) == ["a.k_x", "a.k_y", "c.k_x", "a.k_x,y", "a.c_x", "a.c_y", "c.c_x", "a.c_x,y"]
    free = joint_terms(OMEGA, dofs, "viscous", "points")
    shared, apart = CoupledJoint(terms), CoupledJoint(free)
    x = np.array([5e5, 7e5, 3e5, 1e5, 50.0, 70.0, 30.0, 10.0])
    at = x[terms.shared]
    entries = shared.compliance(x)
    np.testing.assert_array_equal(entries, apart.compliance(at))
    close(shared.slope(x, entries), differences(shared.compliance, x), 1e-7)
    random = np.random.default_rng(3)
    half = random.normal(size=(3, 15, 15)) + 1j * random.normal(size=(3, 15, 15))
    weight, residual = half @ half.conj().swapaxes(1, 2), half[:, 0]
    gradient, information = (part.sum(axis=0) for part in shared.line_parts(x, entries, weight, residual))
    by_kernel = shared.normal_equations(x, entries, weight, residual)
    np.testing.assert_allclose(by_kernel[0], information, rtol=1e-9, atol=1e-12 * abs(information).max())
    np.testing.assert_allclose(by_kernel[1], gradient, rtol=1e-9, atol=1e-12 * abs(gradient).max())


def test_stiffness_is_the_sum_of_matrices():
    terms = joint_terms(OMEGA, DOFS, "both", "fit")
    theta = values(terms)
    k, h, c = np.zeros((3, 3, 3))
    for one, value in zip(terms.parameters, theta, strict=True):
        a, b = DOFS.index(one.row), DOFS.index(one.column)
        {"k": k, "h": h, "c": c}[one.kind][[a, b], [b, a]] = value
    expected = np.array([k + 1j * h + 1j * omega * c for omega in OMEGA])
    np.testing.assert_allclose(terms.stiffness(theta), expected, rtol=1e-14)


def test_terms_of_some_dofs_and_lines_are_a_block_of_the_whole():
    terms = joint_terms(OMEGA, DOFS, MIXED, "fit")
    theta, dofs = values(terms), np.array([0, 2])
    own, which = terms.of_dofs(dofs)
    np.testing.assert_array_equal(own.stiffness(theta[which]), terms.stiffness(theta)[:, dofs[:, None], dofs])
    assert names(own) == ["k_x", "k_theta", "k_x,theta", "h_x", "c_x"]
    np.testing.assert_array_equal(terms.on_lines(slice(1, 2)).stiffness(theta), terms.stiffness(theta)[1:2])


@pytest.mark.parametrize("damping", ["none", "viscous", "hysteretic", "both", MIXED])
@pytest.mark.parametrize("by_rate", [True, False])
def test_diagonal_compliance_is_the_inverse_of_the_stiffness(damping, by_rate):
    terms = joint_terms(OMEGA, DOFS, damping, "zero")
    joint, theta = DiagonalJoint(terms, by_rate=by_rate), values(terms)
    expected = np.einsum("ldd->ld", np.linalg.inv(terms.stiffness(theta)))
    np.testing.assert_allclose(joint.compliance(joint.coordinates(theta)), expected, rtol=1e-12)


@pytest.mark.parametrize("damping", ["viscous", "both", MIXED])
def test_coupled_compliance_is_the_inverse_of_the_stiffness(damping):
    terms = joint_terms(OMEGA, DOFS, damping, "fit")
    joint, theta = CoupledJoint(terms), values(terms)
    expected = np.linalg.inv(terms.stiffness(theta))[:, *np.triu_indices(3)]
    np.testing.assert_allclose(joint.compliance(joint.coordinates(theta)), expected, rtol=1e-11)


JOINTS = [
    DiagonalJoint(joint_terms(OMEGA, DOFS, "both", "zero")),
    DiagonalJoint(joint_terms(OMEGA, DOFS, "both", "zero"), by_rate=False),
    DiagonalJoint(joint_terms(OMEGA, DOFS, MIXED, "zero")),
    CoupledJoint(joint_terms(OMEGA, DOFS, "both", "fit")),
    CoupledJoint(joint_terms(OMEGA, DOFS, MIXED, "fit")),
]


@pytest.mark.parametrize("joint", JOINTS)
def test_slopes_are_those_of_differences(joint):
    x = joint.coordinates(values(joint.terms))
    close(joint.slope(x, joint.compliance(x)), differences(joint.compliance, x), 1e-7)
    close(joint.theta_slope(x), differences(joint.theta, x), 1e-7)


@pytest.mark.parametrize("joint", JOINTS)
def test_coordinates_and_back(joint):
    theta = values(joint.terms)
    x = joint.coordinates(theta)
    assert ((x >= joint.lower) & (x <= joint.upper)).all()
    np.testing.assert_allclose(joint.theta(x), theta, rtol=1e-14)


@pytest.mark.parametrize("by_rate", [True, False])
def test_a_rigid_dof_is_a_regular_point(by_rate):
    """k_x infinite: its compliance is zero, that of the others is what it was, and the slope by a is finite."""
    terms = joint_terms(OMEGA, DOFS, "viscous", "zero")
    joint, theta = DiagonalJoint(terms, by_rate=by_rate), values(terms)
    soft = joint.coordinates(theta)
    theta[0] = np.inf
    x = joint.coordinates(theta)
    assert x[0] == 0
    np.testing.assert_array_equal(joint.compliance(x)[:, 0], 0)
    np.testing.assert_array_equal(joint.compliance(x)[:, 1:], joint.compliance(soft)[:, 1:])
    assert joint.theta(x)[0] == np.inf
    np.testing.assert_allclose(joint.theta(x)[1:3], theta[1:3], rtol=1e-14)
    slope = joint.slope(x, joint.compliance(x))
    assert np.isfinite(slope).all()
    step = 1e-9 * soft[0]
    there = joint.compliance(x + step * np.eye(x.size)[0])[:, 0]
    np.testing.assert_allclose(slope[:, 0, 0], there / step, rtol=1e-6)


def test_rates_are_kept_within_their_limits():
    """Damping a million times the stiffness is taken as the largest rate, at the highest frequency for c."""
    joint = DiagonalJoint(joint_terms(OMEGA, ["x"], "both", "zero"))
    x = joint.coordinates(np.array([1.0, 1e6, -1e6]))
    np.testing.assert_allclose(x, [1, 100, -100 / OMEGA.max()])


def test_a_singular_stiffness_is_nan_on_its_lines():
    terms = joint_terms(np.array([0.0, 1.0]), ["x", "y"], "viscous", "fit")
    # k = [[1, 1], [1, 1]] is singular; damping makes it regular but on the line at rest.
    theta = np.array([1.0, 1.0, 1.0, 1.0, 2.0, 0.0])
    c = CoupledJoint(terms).compliance(theta)
    assert np.isnan(c[0]).all()
    assert np.isfinite(c[1]).all()
