"""Noise of every kind has the distribution it says, and comes back with its seed."""

from itertools import product

import numpy as np
import pytest
from scipy.special import ndtr

import jointfrf as jf

H = np.exp(1j * np.linspace(0, 3, 3000))[:, None, None] * np.array([[1.0, 10.0], [10.0, 0.1]])


def relative(polluted, h=H):
    return (polluted - h) / h


@pytest.mark.parametrize(
    ("kind", "total", "is_real"),
    [
        ("complex", 0.05, False),
        ("complex-per-part", 0.05 * np.sqrt(2), False),
        ("real-normal", 0.05, True),
        ("real-uniform", 0.05 / np.sqrt(3), True),
        ("real-uniform-std", 0.05, True),
    ],
)
def test_level_relative_to_each_entry(kind, total, is_real):
    e = relative(jf.pollute(H, 0.05, kind, seed=4))
    spread = np.sqrt((abs(e) ** 2).mean(axis=0))
    np.testing.assert_allclose(spread, total, rtol=0.05)
    assert abs(e.mean()) < 4 * total / np.sqrt(e.size)
    if is_real:
        assert abs(e.imag).max() < 1e-12
    else:
        assert abs((e**2).mean()) < 0.05 * total**2  # circular
    if kind == "real-uniform":
        assert abs(e.real).max() <= 0.05 * (1 + 1e-9)
        assert abs(e.real).max() > 0.049


@pytest.mark.parametrize("relative_to", ["line", "spectrum"])
def test_level_relative_to_a_maximum(relative_to):
    h = H * np.linspace(1, 3, 3000)[:, None, None]
    e = jf.pollute(h, 0.02, "real-normal", seed=1, relative_to=relative_to) - h
    size = abs(h).max(axis=(1, 2), keepdims=True) if relative_to == "line" else abs(h).max()
    np.testing.assert_allclose((e / size).std(axis=0), 0.02, rtol=0.06)
    assert not e.imag.any()


def test_same_seed_same_noise_other_seed_other_noise():
    one = jf.pollute(H, 0.05, seed=7)
    np.testing.assert_array_equal(one, jf.pollute(H, 0.05, seed=7))
    assert (one != jf.pollute(H, 0.05, seed=8)).all()
    assert (one != jf.pollute(H, 0.05, seed=7, realisation=1)).all()


def test_realisations_do_not_depend_on_how_they_are_grouped():
    whole = jf.realisations(H[:50], 0.05, seed=3, count=7)
    parts = np.concatenate([jf.realisations(H[:50], 0.05, seed=3, first=f, count=c) for f, c in ((0, 3), (3, 4))])
    np.testing.assert_array_equal(whole, parts)
    for i, j in product(range(7), range(7)):
        if i < j:
            e, f = relative(whole[i], H[:50]).ravel(), relative(whole[j], H[:50]).ravel()
            assert abs((e * f.conj()).mean()) < 5 * 0.05**2 / np.sqrt(e.size)


def test_reciprocal_noise_is_the_same_on_both_sides():
    e = relative(jf.pollute(H, 0.05, seed=2, reciprocal=True))
    np.testing.assert_allclose(e, e.swapaxes(1, 2), atol=1e-14)
    free = relative(jf.pollute(H, 0.05, seed=2))
    assert abs(free[:, 0, 1] - free[:, 1, 0]).max() > 0.05


def test_a_block_shares_its_noise():
    h = np.ones((10, 4, 4), complex)
    e = relative(jf.pollute(h, 0.05, seed=2, block=2), h)
    blocks = e.reshape(10, 2, 2, 2, 2)
    np.testing.assert_allclose(blocks, np.broadcast_to(blocks[:, :, :1, :, :1], blocks.shape), atol=1e-15)
    assert np.unique(e[0].round(12)).size == 4


def numbers(kind, n_freq=50000, **options):
    h = np.ones((n_freq, 2, 2), complex)
    return jf.pollute(h, 1.0, kind, **options) - h


def distance(x, cumulative):
    """Kolmogorov's distance times the root of the number of values: above 2 with probability 0.0007."""
    x = np.sort(x)
    steps = np.arange(x.size + 1) / x.size
    return max(abs(cumulative(x) - steps[1:]).max(), abs(cumulative(x) - steps[:-1]).max()) * np.sqrt(x.size)


@pytest.mark.parametrize(
    ("kind", "spread"), [("complex", np.sqrt(0.5)), ("complex-per-part", 1.0), ("real-normal", 1.0)]
)
def test_normal_numbers_are_normal(kind, spread):
    e = numbers(kind, seed=11) / spread
    parts = [e.real, e.imag] if kind != "real-normal" else [e.real]
    for part in parts:
        assert distance(part.ravel(), ndtr) < 2
    if kind != "real-normal":
        assert distance(((np.angle(e) / np.pi + 1) / 2).ravel(), lambda t: t) < 2
        assert distance(abs(e).ravel(), lambda r: 1 - np.exp(-(r**2) / 2)) < 2


@pytest.mark.parametrize(("kind", "width"), [("real-uniform", 1.0), ("real-uniform-std", np.sqrt(3))])
def test_uniform_numbers_are_uniform(kind, width):
    e = numbers(kind, seed=12).real
    assert distance(e.ravel(), lambda x: (x / width + 1) / 2) < 2


def test_tails_have_their_share():
    """Of 8 million pairs, as many lie beyond r as exp(-r^2/2) says, out to where a few are left."""
    h = np.ones((1000000, 1, 8), complex)
    r = abs(jf.pollute(h, 1.0, "complex-per-part", seed=5) - h)
    for limit in (3.0, 4.0, 5.0):
        expected = r.size * np.exp(-(limit**2) / 2)
        assert abs((r > limit).sum() - expected) < 5 * np.sqrt(expected)


def test_entries_lines_and_realisations_are_independent():
    e = np.stack([numbers("complex", seed=s, realisation=r) for s in (0, 1) for r in (0, 1)])
    limit = 5 / np.sqrt(e[0, :, 0, 0].size)
    flat = e.reshape(4, -1, 4).transpose(0, 2, 1).reshape(16, -1)
    flat = np.concatenate([flat[:, 1:], flat[:, :-1]])  # and the line before
    correlation = abs(flat @ flat.conj().T) / flat.shape[1] - np.eye(32)
    assert abs(correlation).max() < limit
    power = abs(flat) ** 2 - 1
    assert abs(power @ power.T / flat.shape[1] - np.eye(32)).max() < 2 * limit


def test_a_generator_gives_seeds_and_a_number_is_one():
    np.testing.assert_array_equal(jf.pollute(H, 0.05, rng=2**63 + 7), jf.pollute(H, 0.05, seed=2**63 + 7))
    calls = [jf.pollute, lambda h, level, rng: jf.realisations(h, level, rng=rng, count=2)]
    rng, seeds = np.random.default_rng(5), np.random.default_rng(5).integers(2**64, size=2, dtype=np.uint64)
    for call, seed in zip(calls, seeds.tolist(), strict=True):
        np.testing.assert_array_equal(call(H, 0.05, rng=rng), call(H, 0.05, rng=seed))
    gamma = H[:, :2, :2] + 4 * np.eye(2)
    drawn, by_seed = (jf.monte_carlo(gamma, 0.01, count=3, **own).mean for own in (
        dict(rng=np.random.default_rng(5)), dict(seed=int(seeds[0])))
    )  # fmt: skip
    np.testing.assert_array_equal(drawn, by_seed)
    with pytest.raises(TypeError, match=r"rng must be a whole number or a numpy\.random\.Generator, not 'x'"):
        jf.pollute(H, 0.05, rng="x")


def test_no_level_no_noise():
    np.testing.assert_array_equal(jf.pollute(H, 0.0), H)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(kind="white"), "kind must be one of"),
        (dict(relative_to="peak"), "relative_to must be one of"),
        (dict(level=-0.1), "level must be 0 or positive"),
        (dict(level=np.nan), "level must be finite"),
        (dict(block=3), "block 3 does not divide"),
        (dict(seed=2**64), "seed must lie between"),
        (dict(rng=-1), "rng must lie between"),
        (dict(seed=1, rng=np.random.default_rng(1)), "seed and rng are both given"),
        (dict(realisation=-1), "realisations are counted from 0"),
        (dict(realisation=2**31 - 1), "realisations are counted from 0"),
        (dict(h=H[:, :1], reciprocal=True), "reciprocal noise needs square matrices"),
    ],
)
def test_bad_arguments_get_one_sentence(change, message):
    with pytest.raises(ValueError, match=message):
        jf.pollute(**(dict(h=H, level=0.05) | change))


def test_more_realisations_than_memory_are_refused(random_lines):
    with pytest.raises(MemoryError, match=r"count: 1000000000 realisations of h take .* GiB; draw them in parts"):
        jf.realisations(random_lines(200, 4), 0.05, seed=1, count=10**9)
