"""From channels to joint DOFs: the covariance that is whitened, against noise that is drawn."""

import numpy as np
import pytest

from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs, between, direction_share
from jointfrf.identification.manifold.on_manifold import FrfEntries

N_FREQ = 3


def complex_normal(rng, *shape):
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def mixed(n, m, seed=1):
    """A transform from m channels, those of side j and of side k apart."""
    rng = np.random.default_rng(seed)
    t = np.zeros((2 * n, 2 * m))
    t[:n, :m], t[n:, m:] = rng.standard_normal((2, n, m))
    return t


def frfs(responses, forces, *, reciprocal=True, symmetrised=False, seed=0):
    """FRFs of channels with a variance of its own for every entry and line."""
    rng = np.random.default_rng(seed)
    m_r, m_f = responses.shape[1], forces.shape[1]
    h = 10 * complex_normal(rng, N_FREQ, m_r, m_f)
    variance = rng.uniform(0.2, 2, (N_FREQ, m_r, m_f))
    if symmetrised:
        h, variance = ((x + x.swapaxes(1, 2)) / 2 for x in (h, variance))
    smooth = responses @ h @ forces.T
    return InterfaceFrfs.of(h, smooth, variance, responses, forces, reciprocal, symmetrised)


def drawn(f, count, seed=5):
    """Noise of the channels, shape (count, n_freq, m_r, m_f): one draw for both directions where they are one."""
    e = complex_normal(np.random.default_rng(seed), count, *f.variance.shape) * np.sqrt(f.variance)
    if f.symmetrised:
        e = np.triu(e) + np.triu(e, 1).swapaxes(-1, -2)
    return e


def of_both_directions(f, h):
    """FRFs of the same channels with h_pq and h_qp in the share of each; others as they are."""
    if not f.reciprocal or f.symmetrised or not np.array_equal(f.responses, f.forces):
        return h
    share = direction_share(f.variance)
    return share * h + (1 - share) * h.swapaxes(-1, -2)


def whitened(f, count=20000, dofs=None):
    """Return many draws of the weighted noise of one line, shape (count, n_freq, q)."""
    dofs = np.arange(f.n) if dofs is None else dofs
    data = f.of_dofs(dofs)
    at = np.concatenate([dofs, dofs + f.n])
    gamma = f.responses[at] @ of_both_directions(f, drawn(f, count)) @ f.forces[at].T
    if f.reciprocal:
        gamma = (gamma + gamma.swapaxes(-1, -2)) / 2
    weighted = data.inverse_std * data.entries.take(gamma)
    return weighted if data.correlation is None else (data.correlation @ weighted[..., None])[..., 0]


SQUARE = mixed(2, 3)
CASES = {
    "channels": (np.eye(4), np.eye(4), False),
    "permuted and scaled": (np.eye(4)[[1, 0, 3, 2]] * 2.5, np.eye(4)[[1, 0, 3, 2]] * 2.5, False),
    "channels made reciprocal": (np.eye(4), np.eye(4), True),
    "transformed": (SQUARE, SQUARE, False),
    "transformed, made reciprocal": (SQUARE, SQUARE, True),
    "rectangular": (mixed(2, 3), mixed(2, 2, seed=2), False),
    "responses transformed only": (mixed(2, 3), np.eye(4), False),
    "channels shared by both sides": (np.ones((4, 5)) + np.eye(4, 5), np.eye(4, 5) + 1, False),
}


@pytest.mark.parametrize(
    ("case", "reciprocal"),
    # FRFs made reciprocal are those of a reciprocal structure.
    [(case, reciprocal) for case in CASES for reciprocal in (True, False) if reciprocal or not CASES[case][2]],
)
def test_weighted_noise_is_white(case, reciprocal):
    responses, forces, symmetrised = CASES[case]
    e = whitened(frfs(responses, forces, reciprocal=reciprocal, symmetrised=symmetrised))
    covariance = np.einsum("rla,rlb->lab", e, e.conj()) / len(e)
    # Of 20000 draws the standard deviation is 0.007.
    assert abs(covariance - np.eye(e.shape[-1])).max() < 0.04


def test_the_variance_of_channels_is_that_of_a_mean_of_two_directions():
    f = frfs(np.eye(2), np.eye(2))
    v = f.variance
    share = direction_share(v)[0, 1]
    mean = share**2 * v[:, 0, 1] + (1 - share) ** 2 * v[:, 1, 0]
    expected = np.stack([v[:, 0, 0], mean, v[:, 1, 1]], axis=1)
    np.testing.assert_allclose(1 / f.of_dofs(np.array([0])).inverse_std ** 2, expected, rtol=1e-12)
    one = f._replace(symmetrised=True, variance=(v + v.swapaxes(1, 2)) / 2)
    expected[:, 1] = (v[:, 0, 1] + v[:, 1, 0]) / 2
    np.testing.assert_allclose(1 / one.of_dofs(np.array([0])).inverse_std ** 2, expected, rtol=1e-12)


@pytest.mark.parametrize("ratio", [1.0, 3.0, 700.0])
def test_two_directions_are_weighted_by_their_variances(ratio):
    """The best mean of two measurements of variances v and v' has v v'/(v + v'), whatever its level on each line."""
    f = frfs(np.eye(2), np.eye(2))
    v = np.linspace(1.0, 2.0, N_FREQ)[:, None, None] * np.where(np.tri(2, dtype=bool), ratio, 1.0)
    data = f._replace(variance=v).of_dofs(np.array([0]))
    v = v[:, 1, 0] * v[:, 0, 1] / (v[:, 1, 0] + v[:, 0, 1])
    np.testing.assert_allclose(1 / data.inverse_std[:, 1] ** 2, v, rtol=1e-12)
    h = f.measured
    np.testing.assert_allclose(data.measured[:, 1], (ratio * h[:, 0, 1] + h[:, 1, 0]) / (1 + ratio), rtol=1e-12)


def test_the_covariance_of_a_transform_is_that_of_a_kronecker_product():
    """vec(T_r E T_f^T) = (T_r x T_f) vec(E): W^T W is the inverse of its covariance."""
    responses, forces = mixed(2, 3), mixed(2, 2, seed=2)
    f = frfs(responses, forces, reciprocal=False)
    data = f.of_dofs(np.arange(2))
    whole = np.kron(responses, forces)
    for line in range(N_FREQ):
        covariance = (whole * f.variance[line].ravel()) @ whole.T
        w = data.correlation[line] * data.inverse_std[line]
        np.testing.assert_allclose(w.T @ w @ covariance, np.eye(16), atol=1e-6)


def test_some_dofs_are_a_part_of_the_whole():
    f = frfs(SQUARE, SQUARE)
    own = f.of_dofs(np.array([1]))
    gamma = f.gamma(of_both_directions(f, f.measured))
    np.testing.assert_allclose(own.measured[:, 1], gamma[:, 1, 3])
    np.testing.assert_allclose(gamma[:, 1, 3], gamma[:, 3, 1])
    e = whitened(f, dofs=np.array([1]))
    assert abs(np.einsum("rla,rlb->lab", e, e.conj()) / len(e) - np.eye(3)).max() < 0.04


@pytest.mark.parametrize("reciprocal", [True, False])
@pytest.mark.parametrize("transform", [np.eye(4), SQUARE])
def test_entries_made_of_an_unused_frf_weigh_nothing(transform, reciprocal):
    """The others keep the weights that they have without these entries."""
    f = frfs(transform, transform, reciprocal=reciprocal)
    # Of one ratio on all lines: the mean of both directions does not change with a line that is not used.
    f = f._replace(variance=f.variance[:1] * np.array([1.0, 2.0, 3.0])[:, None, None])
    variance = f.variance.copy()
    variance[1, 0, 2] = np.inf
    data = f._replace(variance=variance).of_dofs(np.arange(2))
    whole = f.of_dofs(np.arange(2))
    made = np.outer(transform[:, 0] != 0, transform[:, 2] != 0)
    if reciprocal:
        made |= made.T
    made = made[data.entries.rows, data.entries.columns]
    assert made.any()
    assert not made.all()
    np.testing.assert_array_equal(data.used[1], ~made)
    np.testing.assert_allclose(data.inverse_std[[0, 2]], whole.inverse_std[[0, 2]], rtol=1e-14)
    np.testing.assert_allclose(data.inverse_std[1, ~made], whole.inverse_std[1, ~made], rtol=1e-12)
    if data.correlation is not None:
        keep = np.ix_(~made, ~made)
        expected = [np.linalg.inv(np.linalg.inv(w.T @ w)[keep]) for w in (data.correlation[1], whole.correlation[1])]
        np.testing.assert_allclose(*expected, rtol=1e-5, atol=1e-5)


def test_lines_keep_all_but_their_number():
    f = frfs(SQUARE, SQUARE)
    part = f.on_lines(np.array([2, 0]))
    np.testing.assert_array_equal(part.smooth_gamma, f.smooth_gamma[[2, 0]])
    np.testing.assert_array_equal(part.variance, f.variance[[2, 0]])


def apart(level, seed=3):
    """Three DOFs, the second not coupled with the others but for an FRF of the level given."""
    rng = np.random.default_rng(seed)
    smooth = complex_normal(rng, 50, 6, 6)
    smooth += 3 * np.eye(6)
    second = np.tile([False, True, False], 2)
    smooth[:, second[:, None] != second[None, :]] *= level
    return InterfaceFrfs.of(smooth, smooth, np.full(smooth.shape, 1e-4), np.eye(6), np.eye(6), True)


@pytest.mark.parametrize(
    ("level", "groups"),
    [(0, [[0, 2], [1]]), (1e-9, [[0, 2], [1]]), (1e-4, [[0, 2], [1]]), (0.1, [[0, 1, 2]])],
)
def test_dofs_between_which_frfs_are_zero_or_noise_are_apart(level, groups):
    """The noise is 0.01."""
    assert [one.tolist() for one in apart(level).groups()] == groups


def test_frfs_seen_on_a_few_lines_join_their_dofs():
    f = apart(1e-4)
    smooth = f.smooth.copy()
    smooth[:3, FrfEntries.of(3, reciprocal=True).places[0, 1]] = 1.0
    assert len(f._replace(smooth=smooth).groups()) == 1


@pytest.mark.parametrize("rows", [[0, 1, 2], [2, 0, 1], [1, 1, 2], [2]])
def test_rows_of_unit_matrices_take_frfs_as_products_do(rows):
    rng = np.random.default_rng(4)
    h = rng.standard_normal((5, 3, 3)) + 1j * rng.standard_normal((5, 3, 3))
    t = np.eye(3)[rows]
    for left, right in ((t, np.eye(3)), (np.eye(3), t), (t, t), (2 * t, t), (t, t - 0.5), (t[:, ::-1] + t, t)):
        np.testing.assert_allclose(between(left, h, right), left @ h @ right.T, rtol=1e-14)
