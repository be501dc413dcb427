"""M that FRFs hardly show, against the least squares that define it."""

import numpy as np
import pytest

import manifold_numpy as plain
from jointfrf.identification.manifold.on_manifold import (
    FrfEntries,
    LineData,
    OnManifold,
    PriorOfM,
    expected_m,
    frfs_of_joint,
    prior_of_m,
)

N_FREQ, NOISE = 9, 1e-2


class Problem:
    """FRFs that fit a joint, on the manifold."""

    def __init__(self, n, reciprocal, stiff=1.0, springs=None):
        rng = np.random.default_rng(n + 10 * reciprocal)

        def square():
            a = rng.standard_normal((N_FREQ, n, n)) + 1j * rng.standard_normal((N_FREQ, n, n))
            return (a + a.swapaxes(1, 2)) / 2 if reciprocal else a

        entries = FrfEntries.of(n, reciprocal=reciprocal)
        h, q = square(), square()
        self.r = 0.3 * square() / stiff
        if springs is not None:
            self.r = self.r * np.eye(n)
        exact = entries.take(frfs_of_joint(h, q, self.r, np.zeros(n) if springs is None else springs))
        self.factor = np.eye(exact.shape[1]) + 0.2 * np.tril(rng.standard_normal((N_FREQ, *2 * exact.shape[1:])), -1)
        self.data = LineData(entries, exact, exact, rng.uniform(0.5, 2, exact.shape) / NOISE, springs=springs)
        self.on = OnManifold(h, q, np.zeros(N_FREQ))
        self.size = rng.uniform(0.5, 2, (N_FREQ, n, n))
        self.size += self.size.swapaxes(1, 2)


@pytest.mark.parametrize("springs", [False, True])
@pytest.mark.parametrize("correlated", [False, True])
@pytest.mark.parametrize("reciprocal", [True, False])
@pytest.mark.parametrize("n", [1, 2, 3])
def test_least_squares_of_the_error_and_of_m(n, reciprocal, correlated, springs):
    """M = Z (1 - R Z) + (1 - Z R) Q (1 - R Z) of a joint without cross terms."""
    z = np.arange(1.0, n + 1) / 2 if springs else np.zeros(n)
    p = Problem(n, reciprocal, stiff=100.0, springs=z if springs else None)
    data = p.data._replace(correlation=p.factor) if correlated else p.data
    found = expected_m(data, p.r, p.on, PriorOfM(p.size, 0.3))
    slope = plain.free_columns(data, p.on.h, p.on.q, p.r, p.factor if correlated else None)
    a, b = data.entries.free
    u = a.size
    for line in range(N_FREQ):
        ridge = np.zeros((u, 2 * u), complex)
        t = np.eye(n) - z[:, None] * p.r[line]
        m = (np.diag(z) @ t.T + t @ p.on.q[line] @ t.T)[a, b]
        of_m = np.diag(t)[a] * np.diag(t)[b] if springs else 1.0
        ridge[:, u:] = np.diag(0.3 / p.size[line, a, b] * of_m)
        right = np.r_[np.zeros(slope.shape[1]), -0.3 / p.size[line, a, b] * m]
        step = np.linalg.lstsq(np.r_[slope[line], ridge], right, rcond=None)[0]
        np.testing.assert_allclose(found.h[line, a, b], p.on.h[line, a, b] + step[:u], rtol=1e-6, atol=1e-8)
        np.testing.assert_allclose(found.q[line, a, b], p.on.q[line, a, b] + step[u:], rtol=1e-6, atol=1e-8)


def test_m_that_frfs_show_stays():
    p = Problem(2, reciprocal=True)
    found = expected_m(p.data, p.r, p.on, PriorOfM(1e6 * p.size, 0.2))
    np.testing.assert_allclose(found.q, p.on.q, rtol=1e-9)
    np.testing.assert_allclose(found.h, p.on.h, rtol=1e-9)


def test_m_that_frfs_do_not_show_vanishes_and_frfs_stay():
    p = Problem(2, reciprocal=True)
    rigid = np.zeros_like(p.r)
    found = expected_m(p.data, rigid, p.on, PriorOfM(p.size, 0.2))
    np.testing.assert_allclose(found.q, 0, atol=1e-9)
    np.testing.assert_allclose(
        frfs_of_joint(*found[:2], rigid, np.zeros(2)), frfs_of_joint(*p.on[:2], rigid, np.zeros(2)), rtol=1e-6
    )


def test_prior_of_m(beams):
    """Of a stiff joint, M is hardly larger; FRFs that were not smoothed have the noise as their error."""
    entries = FrfEntries.of(2, reciprocal=True)
    stiff = 1e6 * beams.joint.stiffness
    gamma = entries.take(beams.gamma(type(beams.joint)(stiff, None, beams.joint.dofs)))
    rng = np.random.default_rng(1)
    error = (rng.standard_normal(gamma.shape) + 1j * rng.standard_normal(gamma.shape)) / np.sqrt(2)
    measured = gamma * (1 + 0.05 * error)
    smooth = LineData(entries, measured, gamma, 20 / abs(gamma))
    m = np.linalg.inv(beams.h_b[:, :2, :2])
    ratio = abs(m) / prior_of_m(smooth).size
    assert np.median(ratio) > 0.1
    assert np.quantile(ratio, 0.9) < 3
    assert prior_of_m(smooth).share == pytest.approx(0.2, abs=0.1)
    assert prior_of_m(smooth._replace(smooth=measured)).share == pytest.approx(1)
