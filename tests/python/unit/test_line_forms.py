"""FormMinimum of quadratic forms of the compliance: against plain sums and a general minimiser."""

import numpy as np
import pytest
from scipy import optimize

from jointfrf.identification.manifold.coordinates import CoupledJoint, DiagonalJoint, joint_terms
from jointfrf.identification.manifold.line_forms import LineForms
from jointfrf.identification.minimise import inverse_information

OMEGA = 2 * np.pi * np.linspace(20, 400, 12)


def random(rng, *shape):
    return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)


class Problem:
    """Noisy compliances of a joint, seen on every line through a matrix A: residual r = A (C_measured - C)."""

    def __init__(self, joint, theta, noise=0.1, seed=0):
        rng = np.random.default_rng(seed)
        self.joint = joint
        self.true = joint.coordinates(theta)
        exact = joint.compliance(self.true)
        size = abs(exact).mean(axis=0)
        self.a = (np.eye(exact.shape[1]) + 0.2 * random(rng, len(exact), exact.shape[1], exact.shape[1])) / (
            noise * size
        )
        self.measured = exact + noise * size * random(rng, *exact.shape) / np.sqrt(2)
        # NormalEquations anywhere: here at a compliance a little off.
        self.about = 1.1 * exact
        residual = (self.a @ (self.measured - self.about)[..., None])[..., 0]
        adjoint = self.a.conj().swapaxes(1, 2)
        self.forms = LineForms(
            self.about, adjoint @ self.a, (adjoint @ residual[..., None])[..., 0], (abs(residual) ** 2).sum(axis=1)
        )

    def residual(self, x):
        return (self.a @ (self.measured - self.joint.compliance(x))[..., None])[..., 0]

    def cost(self, x):
        return (abs(self.residual(x)) ** 2).sum()

    def reference(self, start, free=None, **bounds):
        """FormMinimum by scipy, real and imaginary parts stacked, coordinates in units of the true ones."""
        free = np.arange(start.size) if free is None else free
        size = np.abs(self.true[free])

        def stacked(z):
            x = start.copy()
            x[free] = z * size
            r = self.residual(x).ravel()
            return np.concatenate([r.real, r.imag])

        tight = dict(xtol=1e-13, ftol=1e-13, gtol=1e-13)
        found = optimize.least_squares(stacked, start[free] / size, x_scale="jac", **tight, **bounds)
        x = start.copy()
        x[free] = found.x * size
        return x, 2 * found.cost


def diagonal(damping="viscous", **options):
    return DiagonalJoint(joint_terms(OMEGA, ["x", "y"], damping, "zero"), **options)


THETA = np.array([6e5, 2e5, 150.0, 40.0])


def coupled():
    terms = joint_terms(OMEGA, ["x", "y"], "viscous", "fit")
    return CoupledJoint(terms), np.array([6e5, 2e5, 1e5, 150.0, 40.0, 10.0])


@pytest.fixture
def problem():
    return Problem(diagonal(), THETA)


def test_forms_are_the_squares_of_the_residual(problem):
    x = problem.joint.coordinates(1.3 * THETA)
    squares, gradient = problem.forms.at(problem.joint.compliance(x))
    np.testing.assert_allclose(squares, (abs(problem.residual(x)) ** 2).sum(axis=1), rtol=1e-10)
    expected = np.einsum("lab,la->lb", problem.a.conj(), problem.residual(x))
    np.testing.assert_allclose(gradient, expected, rtol=1e-9)


def test_a_line_of_weight_two_counts_twice(problem):
    weight = np.ones(OMEGA.size)
    weight[3], weight[5] = 2, 0
    entries = problem.joint.compliance(problem.true)
    plain, scaled = problem.forms.at(entries)[0], problem.forms.scaled(weight).at(entries)[0]
    np.testing.assert_allclose(scaled, plain * weight, rtol=1e-12)


@pytest.mark.parametrize("factor", [1.0, 0.3, 5.0])
@pytest.mark.parametrize("kind", ["rates", "damping", "coupled"])
def test_the_minimum_is_that_of_a_general_minimiser(kind, factor):
    joint, theta = coupled() if kind == "coupled" else (diagonal(by_rate=kind == "rates"), THETA)
    p = Problem(joint, theta)
    found = joint.minimise(p.forms, joint.coordinates(factor * theta))
    x, cost = p.reference(p.true)
    error = np.sqrt(np.diagonal(np.linalg.inv(2 * found.information)))
    assert found.cost == pytest.approx(cost, abs=1e-5)
    assert found.cost == pytest.approx(p.cost(found.x), rel=1e-10)
    assert (abs(found.x - x) < 0.01 * error).all()


def test_information_and_gradient_are_sums_of_the_lines(problem):
    found = problem.joint.minimise(problem.forms, problem.true)
    parts = found.of_lines()
    np.testing.assert_allclose(found.information, parts.information.sum(axis=0), rtol=1e-12)
    # At a minimum the parts of the lines cancel: what is left differs by rounding of the parts.
    rounding = 1e-13 * abs(parts.gradient).sum(axis=0)
    assert (abs(found.gradient - parts.gradient.sum(axis=0)) <= rounding).all()
    slope = np.einsum("lab,lbp->lap", problem.a, problem.joint.slope(found.x, problem.joint.compliance(found.x)))
    np.testing.assert_allclose(parts.information, np.einsum("lap,laq->lpq", slope.conj(), slope).real, rtol=1e-9)
    assert (abs(found.gradient) < 1e-2 * np.sqrt(np.diagonal(found.information))).all()


def test_a_compliance_does_not_fall_below_zero():
    """Measured compliances of x have the wrong sign: the best joint is rigid there."""
    p = Problem(diagonal("none"), THETA[:2], noise=0.01)
    p.measured[:, 0] *= -1
    residual = np.einsum("lab,lb->la", p.a, p.measured - p.about)
    gradient = np.einsum("lab,la->lb", p.a.conj(), residual)
    forms = p.forms._replace(gradient=gradient, squares=(abs(residual) ** 2).sum(axis=1))
    found = p.joint.minimise(forms, p.true)
    assert found.x[0] == 0
    assert found.gradient[0] < 0
    x, cost = p.reference(p.true, bounds=(0, np.inf))
    assert found.cost == pytest.approx(cost, rel=1e-8)
    assert found.x[1] == pytest.approx(x[1], rel=1e-6)


def test_a_rate_does_not_pass_its_limit():
    """A dashpot without a spring: eta runs to its upper limit, 100."""
    joint = DiagonalJoint(joint_terms(OMEGA, ["x"], "hysteretic", "zero"))
    p = Problem(joint, np.array([1e3, 1e5]), noise=1e-3)
    residual = np.einsum("lab,lb->la", p.a, -1j * abs(p.measured) - p.about)
    gradient = np.einsum("lab,la->lb", p.a.conj(), residual)
    forms = p.forms._replace(gradient=gradient, squares=(abs(residual) ** 2).sum(axis=1))
    found = joint.minimise(forms, joint.coordinates(np.array([1e3, 5e4])))
    assert found.x[1] == joint.upper[1] == 100
    assert found.gradient[1] > 0


@pytest.mark.parametrize("held", range(4))
def test_a_held_coordinate_keeps_its_value_and_the_others_are_best_for_it(problem, held):
    start = problem.true.copy()
    start[held] *= 1.2
    found = problem.joint.minimise(problem.forms, start, held)
    assert found.x[held] == start[held]
    x, cost = problem.reference(start, np.flatnonzero(np.arange(4) != held))
    assert found.cost == pytest.approx(cost, abs=1e-5)
    np.testing.assert_allclose(found.x, x, rtol=1e-3)


def test_a_coordinate_that_may_not_be_there_is_held_beyond_its_bound(problem):
    """The profile of a likelihood may ask for it: held means held."""
    start = problem.true.copy()
    start[0] = -start[0]
    assert problem.joint.minimise(problem.forms, start, 0).x[0] == start[0]


def test_a_joint_of_no_finite_cost_has_an_infinite_one(problem):
    bad = problem.forms._replace(squares=np.full(OMEGA.size, np.nan))
    assert problem.joint.minimise(bad, problem.true).cost == np.inf


def test_inverse_of_an_information_of_very_different_sizes():
    rng = np.random.default_rng(1)
    a = rng.standard_normal((6, 3))
    size = np.array([1e-9, 1.0, 1e8])
    plain = np.linalg.inv(a.T @ a)
    found = inverse_information((a.T @ a) * np.outer(size, size))
    np.testing.assert_allclose(found, plain / np.outer(size, size), rtol=1e-9)


def test_what_is_not_seen_does_not_disturb_what_is():
    """A parameter of no information, and two that are seen as a sum only."""
    information = np.zeros((4, 4))
    information[0, 0] = 4.0
    information[2:, 2:] = 2.0
    found = inverse_information(information)
    assert found[0, 0] == pytest.approx(0.25)
    np.testing.assert_allclose(found[2:, 2:], 0.125, rtol=1e-12)
    np.testing.assert_array_equal(found[0, 1:], 0)
