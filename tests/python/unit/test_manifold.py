"""The manifold of FRFs that fit a joint: the kernel against plain linear algebra, and what its results must satisfy."""

import numpy as np
import pytest

import manifold_numpy as plain
from jointfrf.identification.manifold.on_manifold import (
    FrfEntries,
    LineData,
    OnManifold,
    frfs_of_joint,
    normal_forms,
    project,
    starts_on_manifold,
)  # fmt: skip
from jointfrf.kernel.call import call

NOISE = 1e-2
N_FREQ = 11


class Problem:
    """FRFs that fit a joint but for noise, and a start nearby.

    `joint` is "soft", "rigid" (R = 0), "hidden" (gamma_jk singular), "springs" (with reference springs), or "free"
    (with springs and one DOF that is nearly free, R = 1/Z).
    """

    def __init__(self, n, reciprocal, joint="soft", n_freq=N_FREQ):
        rng = np.random.default_rng(n + 10 * reciprocal)

        def random(*shape):
            return rng.standard_normal(shape) + 1j * rng.standard_normal(shape)

        def square():
            a = random(n_freq, n, n)
            return (a + a.swapaxes(1, 2)) / 2 if reciprocal else a

        self.entries = FrfEntries.of(n, reciprocal=reciprocal)
        h, q, self.r = square(), square() / n, square() / n
        springs = rng.uniform(0.5, 2, n) if joint in ("springs", "free") else None
        if joint == "rigid":
            self.r = 0 * self.r
        if joint == "free":
            self.r[:, 0], self.r[:, :, 0] = 0, 0
            self.r[:, 0, 0] = 0.97 / springs[0]
        if joint == "hidden":
            vectors = random(n_freq, n, n - 1)
            hidden = vectors @ vectors.swapaxes(1, 2)
            self.r = np.linalg.inv(q) - hidden
            self.r = (self.r + self.r.swapaxes(1, 2)) / 2
        exact = self.entries.take(frfs_of_joint(h, q, self.r, np.zeros(n) if springs is None else springs))
        weights = rng.uniform(0.5, 2, exact.shape) / NOISE
        weights[rng.random(exact.shape) < 0.06] = 0
        measured, smooth = (exact + level * random(*exact.shape) for level in (NOISE, NOISE / 5))
        self.data = LineData(self.entries, measured, smooth, weights, springs=springs)
        self.start = OnManifold(h + 0.05 * square(), q + 0.05 * square(), np.full(n_freq, np.inf))
        count = exact.shape[1]
        self.factor = np.eye(count) + 0.3 * np.tril(rng.standard_normal((n_freq, count, count)), -1) / np.sqrt(count)

    def on_lines(self, lines):
        """Return another problem of some of the lines."""
        part = object.__new__(Problem)
        part.entries, part.data = self.entries, self.data.on_lines(lines)
        part.r, part.factor = self.r[lines], self.factor[lines]
        part.start = OnManifold(*(x[lines] for x in self.start))
        return part

    def project(self, steps=15):
        return project(self.data.measured, self.data, self.r, self.start, steps)

    def weighted(self, on):
        return self.data.inverse_std * self.entries.take(frfs_of_joint(on.h, on.q, self.r, self.data.reference))

    def forms(self, on):
        return normal_forms(self.data, self.r, on, (self.data.measured, self.data.smooth))


def close(actual, expected, tolerance=1e-9):
    assert abs(actual - expected).max() <= tolerance * max(abs(expected).max(), 1)


SHAPES = [(n, reciprocal, "soft") for n in (1, 2, 3, 6) for reciprocal in (True, False)]
SHAPES += [(2, True, "rigid"), (3, False, "rigid"), (2, True, "hidden"), (3, True, "hidden"), (3, False, "hidden")]
SHAPES += [(n, reciprocal, joint) for n in (1, 2, 3) for reciprocal in (True, False) for joint in ("springs", "free")]


@pytest.mark.parametrize(("n", "reciprocal", "joint"), SHAPES)
def test_projection_is_that_of_plain_linear_algebra(n, reciprocal, joint):
    p = Problem(n, reciprocal, joint)
    found, expected = p.project(), plain.project(p.data.measured, p.data, p.r, p.start, 15)
    close(found.squares, expected.squares)
    close(p.weighted(found), p.weighted(expected))


@pytest.mark.parametrize(("n", "reciprocal", "joint"), SHAPES)
def test_forms_are_those_of_plain_linear_algebra(n, reciprocal, joint):
    p = Problem(n, reciprocal, joint)
    on = p.project()
    expected = plain.normal_forms(p.data, p.r, on, (p.data.measured, p.data.smooth))
    whole = (
        abs(plain.columns(p.data, on.h, on.q, p.r, "r") ** 2).sum(axis=1).max(axis=1)
    )  # before H and Q are eliminated
    pattern = np.ones((n, n))
    a, b = np.nonzero(np.triu(pattern) if reciprocal else pattern)
    for form, (weight, gradient, squares) in zip(p.forms(on), expected, strict=True):
        size = abs(weight).max(axis=(1, 2))
        assert (abs(form.weight - weight).max(axis=(1, 2)) <= 1e-9 * size + 1e-15 * whole).all()
        assert (
            abs(form.gradient - gradient).max(axis=1) <= 1e-9 * np.sqrt(size * (1 + squares)) + 1e-13 * np.sqrt(whole)
        ).all()
        close(form.squares, squares)
        assert np.array_equal(form.compliance, p.r[:, a, b])


@pytest.mark.parametrize(("n", "reciprocal"), [(1, True), (2, True), (2, False), (3, True)])
def test_correlated_noise(n, reciprocal):
    p = Problem(n, reciprocal)
    q, u = p.data.measured.shape[1], len(p.entries.units)
    gamma, weights = p.entries.matrix(p.data.measured), p.entries.matrix(p.data.inverse_std)
    h, free, squares, info = p.start.h.copy(), p.start.q.copy(), np.empty(N_FREQ), np.empty(N_FREQ, np.int32)
    lines = [gamma, weights, p.factor, p.r]
    call("project_on_joint", [int(reciprocal), n, q, N_FREQ, 15, 1e-5, *lines, h, free, squares, info])
    found = OnManifold(h, free, squares)
    expected = plain.project(p.data.measured, p.data, p.r, p.start, 15, p.factor)
    assert not info.any()
    close(found.squares, expected.squares)
    close(p.weighted(found), p.weighted(expected))

    weight, gradient = np.empty((N_FREQ, u, u), complex), np.empty((1, N_FREQ, u), complex)
    left = np.empty((1, N_FREQ))
    lines[0] = gamma[None]
    call("joint_forms", [int(reciprocal), n, u, q, N_FREQ, 1, *lines, h, free, weight, gradient, left, info])
    (expected_form,) = plain.normal_forms(p.data, p.r, found, (p.data.measured,), p.factor)
    for actual, other in zip((weight, gradient[0], left[0]), expected_form, strict=True):
        close(actual, other, 1e-9)


@pytest.mark.parametrize(
    ("n", "reciprocal", "joint"), [(1, True, "soft"), (2, True, "soft"), (3, False, "soft"), (2, True, "springs")]
)
def test_form_is_what_another_joint_costs(n, reciprocal, joint):
    """Exact FRFs, projected for an R that is a little different: the squares are those of W."""
    p = Problem(n, reciprocal, joint)
    exact = p.entries.take(frfs_of_joint(p.start.h, p.start.q, p.r, p.data.reference))
    data = p.data._replace(measured=exact, smooth=exact, inverse_std=1e5 * p.data.inverse_std)
    (form,) = normal_forms(data, p.r, p.start, (exact,))
    rng = np.random.default_rng(3)
    d = 1e-6 * (rng.standard_normal(form.gradient.shape) + 1j * rng.standard_normal(form.gradient.shape))
    there = project(exact, data, p.r + np.tensordot(d, p.entries.units, 1), p.start, 30)
    expected = np.einsum("lp,lpq,lq->l", d.conj(), form.weight, d).real
    assert abs(form.squares).max() < 1e-6
    np.testing.assert_allclose(there.squares, expected, rtol=1e-3, atol=1e-4)


def test_a_line_alone_is_as_in_a_sweep():
    p = Problem(2, True)
    on = p.project()
    forms = p.forms(on)
    for i in range(N_FREQ):
        one = p.on_lines(np.array([i]))
        alone = one.project()
        for sweep, single in zip(on, alone, strict=True):
            assert np.array_equal(sweep[i], single[0])
        for sweep, single in zip(forms, one.forms(alone), strict=True):
            assert all(np.array_equal(a[i], b[0]) for a, b in zip(sweep, single, strict=True))


def test_bad_lines_keep_the_start_and_disturb_nobody():
    p = Problem(2, True)
    good = p.project()
    p.data.measured[3, np.flatnonzero(p.data.inverse_std[3])[0]] = np.nan
    p.data.measured[4, p.data.inverse_std[4] == 0] = np.nan  # not used, not read
    p.start.q[6] *= 1e200
    found = p.project()
    bad = np.isin(np.arange(N_FREQ), [3, 6])
    assert np.array_equal(np.isinf(found.squares), bad)
    assert np.array_equal(found.h[bad], p.start.h[bad])
    assert np.array_equal(found.h[~bad], good.h[~bad])
    assert np.isnan(p.forms(p.start)[0].weight[3]).all()


def test_no_steps_give_the_squares_of_the_start():
    p = Problem(2, False)
    found = p.project(steps=0)
    r = plain.whitened(
        p.data, p.data.measured - p.entries.take(frfs_of_joint(p.start.h, p.start.q, p.r, p.data.reference)), None
    )
    close(found.squares, (abs(r) ** 2).sum(axis=1), 1e-12)
    assert np.array_equal(found.q, p.start.q)


def test_no_lines():
    p = Problem(2, True).on_lines(np.array([], np.intp))
    found = p.project()
    assert found.h.shape == (0, 2, 2)
    assert p.forms(found)[0].weight.shape == (0, 3, 3)


@pytest.mark.filterwarnings("ignore::jointfrf.IllConditionedWarning")
@pytest.mark.parametrize("stiffness", [0.0, 1e-8, 1e-2, 1.0, 1e2, 1e8, np.inf])
@pytest.mark.parametrize("other", [0.0, 1.0, np.inf])
def test_every_joint_fits_the_form_with_springs(stiffness, other):
    """FRFs of two random substructures with a joint from free to rigid, coupled by the forces between the sides."""
    rng, n, count = np.random.default_rng(5), 2, 7

    def passive():
        a = rng.standard_normal((count, n, n)) + 1j * rng.standard_normal((count, n, n))
        return (a + a.swapaxes(1, 2)) / 2 - 3j * np.eye(n)

    h_a, h_b, springs = passive(), passive(), np.array([0.7, 0.4])
    k = np.array([stiffness, other])
    held = np.flatnonzero(k > 0)
    force = np.zeros_like(h_a)  # between the sides, for unit displacements of one against the other
    if held.size:
        between = np.ix_(range(count), held, held)
        force[between] = np.linalg.inv((h_a + h_b)[between] + np.diag(1 / k[held]))
    gamma = np.block([[h_a - h_a @ force @ h_a, h_a @ force @ h_b], [h_b @ force @ h_a, h_b - h_b @ force @ h_b]])
    entries = FrfEntries.of(n, reciprocal=True)
    exact = entries.take(gamma)
    data = LineData(entries, exact, exact, np.ones(exact.shape), springs=springs)
    r = np.broadcast_to(np.diag(1 / (k + springs)).astype(complex), h_a.shape)
    assert starts_on_manifold(data, r, 60).squares.max() < 1e-9
