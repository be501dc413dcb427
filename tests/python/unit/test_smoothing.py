"""Smooth FRFs by common-pole rational fits."""

import numpy as np
import pytest

import jointfrf as jf
import six_dof_beams
from jointfrf.frf.entry_groups import connected, entry_groups
from jointfrf.kernel.call import call_for_number

FREQ = np.linspace(10, 400, 500)


def modal_sum(freq, poles_hz, shapes, feed_through):
    """Receptance of modes whose shapes are complex: rational, symmetric, without mirror images of the poles."""
    s = 1j * freq[:, None]
    weights = 1 / (s - poles_hz)
    return np.einsum("lk,pk,qk->lpq", weights, shapes, shapes) + feed_through


@pytest.fixture(scope="module")
def rational():
    """Three entries a side, five modes, constant terms."""
    rng = np.random.default_rng(4)
    poles = np.array([-0.5 + 60j, -1 + 130j, -2 + 210j, -1 + 300j, -3 + 380j])
    shapes = rng.standard_normal((3, 5)) + 0.3j * rng.standard_normal((3, 5))
    constant = rng.standard_normal((3, 3)) * 0.02
    return poles, modal_sum(FREQ, poles, shapes, constant + constant.T)


def median_error(found, h, noise):
    return np.median(abs(found - h)) / np.median(abs(noise))


def relocated(s, h, weight, poles, iterations):
    """Return the least sum of squares and its poles; FRFs (n_entries, n_freq)."""
    better = poles.astype(complex)
    squares, _ = call_for_number("relocate_poles", (len(poles), *h.shape, iterations, 0.0, s, h, weight, better))
    return squares, better


def fitted(s, h, weight, poles):
    """Return smooth FRFs, their sum of squares and the loss of each pole."""
    smooth, loss = np.empty_like(h), np.empty(len(poles))
    squares, _ = call_for_number("rational_fit", (len(poles), *h.shape, s, h, weight, poles, smooth, loss))
    return smooth, squares, loss


def test_poles_of_a_rational_function_are_found(rational):
    """From poles far from the right ones, without noise."""
    poles_hz, h = rational
    p, q = np.triu_indices(3)
    s, entries = 1j * FREQ / 400, h[:, p, q].T.copy()
    squares, poles = relocated(s, entries, 1 / abs(entries), np.array([-0.01 + 1j]) * np.linspace(0.1, 0.9, 5), 10)
    assert squares < 1e-8
    np.testing.assert_allclose(np.sort(poles.imag) * 400, poles_hz.imag, rtol=1e-6)
    np.testing.assert_allclose(poles.real[poles.imag.argsort()] * 400, poles_hz.real, rtol=1e-4)
    np.testing.assert_allclose(fitted(s, entries, 1 / abs(entries), poles)[0], entries, rtol=1e-5)


def test_a_relocation_tells_the_squares_of_the_fit_and_a_loss_is_that_of_the_fit_without_the_pole(rational):
    _, h = rational
    entries = jf.pollute(h, 0.05, seed=1).reshape(len(FREQ), 9).T.copy()
    s, weight = 1j * FREQ / 400, np.random.default_rng(1).uniform(0.5, 2, (9, len(FREQ)))
    poles = np.array([-0.02 + 1j]) * np.array([0.16, 0.33, 0.52, 0.74])
    smooth, squares, loss = fitted(s, entries, weight, poles)
    assert squares == pytest.approx(relocated(s, entries, weight, poles, 0)[0], rel=1e-9)
    # another route: one dense least-squares problem an entry
    basis = np.c_[np.ones(len(FREQ)), 1 / (s[:, None] - poles)]
    for e in (0, 5):
        c = np.linalg.lstsq(weight[e][:, None] * basis, weight[e] * entries[e], rcond=None)[0]
        np.testing.assert_allclose(smooth[e], basis @ c, rtol=1e-9)
    without = fitted(s, entries, weight, np.delete(poles, 2))[1]
    assert loss[2] == pytest.approx(without - squares, rel=1e-9)


@pytest.mark.parametrize("level", [0.001, 0.02, 0.2])
def test_most_of_the_noise_goes(rational, level):
    _, h = rational
    x = jf.pollute(h, level, seed=2)
    smooth = jf.smooth_frfs(FREQ, x)
    assert smooth.is_smooth
    assert smooth.level == pytest.approx(level, rel=0.1)
    assert median_error(smooth.h, h, x - h) < 0.15
    assert 5 <= smooth.order <= 9
    np.testing.assert_array_equal(smooth.h, smooth.h.swapaxes(1, 2))
    found = np.concatenate([p for p in smooth.poles]) / (2 * np.pi)
    for pole in rational[0]:
        assert abs(found - pole).min() < 20 * level * abs(pole.real)


def test_structural_damping_and_groups_of_entries():
    """Six DOFs in two groups: each has its poles, and zero entries stay zero."""
    h = six_dof_beams.assembly()[:, :12, :12]
    groups = entry_groups(h, reciprocal=True)
    assert sorted(len(g.rows) for g in groups) == [21, 21]
    x = jf.pollute(h, 0.03, seed=5)
    smooth = jf.smooth_frfs(six_dof_beams.FREQ, x)
    assert len(smooth.poles) == 2
    counts = abs(h).max(axis=0) > 1e-12 * abs(h).max()
    zero = np.ones((12, 12), bool)
    for g in groups:
        zero[g.rows, g.columns] = zero[g.columns, g.rows] = False
    assert not smooth.h[:, zero].any()
    assert (counts | zero).all()
    error = abs(smooth.h - h)[:, ~zero] / (0.03 * abs(h)[:, ~zero])
    assert np.median(error) < 0.15


def test_rectangular_frfs_and_one_entry(rational):
    _, h = rational
    x = jf.pollute(h, 0.02, seed=3)
    for part in (np.s_[:, :2, :], np.s_[:, :1, :1], np.s_[:, 2:, :2]):
        smooth = jf.smooth_frfs(FREQ, x[part])
        assert smooth.h.shape == x[part].shape
        assert median_error(smooth.h, h[part], (x - h)[part]) < 0.25


def test_lines_in_any_order_and_spacing(rational):
    _, h = rational
    x = jf.pollute(h, 0.02, seed=3)
    rng = np.random.default_rng(2)
    some = rng.permutation(500)[:300]
    smooth = jf.smooth_frfs(FREQ[some], x[some])
    assert median_error(smooth.h, h[some], (x - h)[some]) < 0.2
    ordered = jf.smooth_frfs(FREQ[np.sort(some)], x[np.sort(some)])
    np.testing.assert_allclose(smooth.h[np.argsort(some)], ordered.h, rtol=1e-6)


def test_exact_frfs_and_few_lines_come_back_as_they_are(rational):
    _, h = rational
    exact = jf.smooth_frfs(FREQ, h)
    assert not exact.is_smooth
    np.testing.assert_array_equal(exact.h, h)
    for n in (1, 3, 15):
        few = jf.smooth_frfs(FREQ[:n], jf.pollute(h[:n], 0.1))
        assert not few.is_smooth
        np.testing.assert_array_equal(few.h, jf.pollute(h[:n], 0.1))


def test_the_variance_decides_what_counts(rational):
    """One entry wrong beyond recognition, and said to be so, leaves the others alone."""
    _, h = rational
    x = jf.pollute(h, 0.02, seed=3)
    variance = (0.02 * abs(h)) ** 2
    rng = np.random.default_rng(1)
    x[:, 0, 1] = 10 * abs(h).max() * rng.standard_normal(len(FREQ))
    variance[:, 0, 1] = (10 * abs(h).max()) ** 2
    smooth = jf.smooth_frfs(FREQ, x, variance)
    assert smooth.level == pytest.approx(1, rel=0.1)
    error = abs(smooth.h - h)[:, 0, 1] / (0.02 * abs(h[:, 0, 1]))
    assert np.median(error) < 0.3


def test_unstable_poles_never_come_out(rational):
    _, h = rational
    smooth = jf.smooth_frfs(FREQ, jf.pollute(h, 0.2, seed=7))
    assert all((p.real < 0).all() for p in smooth.poles)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"freq_hz": np.r_[FREQ[:-1], FREQ[0]]}, r"lines 0 and 499 are both 10 Hz"),
        ({"variance": np.zeros((500, 3, 3))}, "variance must be positive"),
        ({"variance": np.ones((500, 3, 2))}, "variance must have shape"),
        ({"inflation": 0.5}, "inflation must be 1 or more"),
        ({"max_poles": 0}, "max_poles must be 1 or more"),
    ],
)
def test_bad_arguments(rational, change, message):
    _, h = rational
    with pytest.raises(ValueError, match=message):
        jf.smooth_frfs(**({"freq_hz": FREQ, "h": h} | change))


def test_connected_nodes_are_those_that_powers_of_the_links_reach():
    rng = np.random.default_rng(3)
    for _ in range(50):
        links = rng.random((9, 9)) < 0.08
        both = (links | links.T | np.eye(9, dtype=bool)).astype(int)
        reached = np.linalg.matrix_power(both, 9) > 0
        label = connected(links)
        np.testing.assert_array_equal(label[:, None] == label, reached)
        # Numbered in the order of their first nodes.
        assert [int(label[:i].max(initial=-1)) + 1 >= label[i] for i in range(9)] == [True] * 9
