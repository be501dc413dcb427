"""Properties of the algebra that hold whatever the structures: found by hypothesis, the same examples in each run.

Bounds are the condition of each step times rounding, computed from the numbers of the example.
"""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import jointfrf as jf

PROFILE = settings(derandomize=True, max_examples=25, deadline=None, database=None)
EPS = np.finfo(float).eps
#: Rounding errors of a few operations of small matrices, in units of eps times the condition number.
SLACK = 200.0


@st.composite
def structures(draw, extra=1):
    """Two structures, H = (K (1 + i eta) - w^2 M)^-1, at n joint DOFs and `extra` more each (n if None); two joints."""
    n = draw(st.integers(1, 4))
    seed = draw(st.integers(0, 2**32 - 1))
    stiff, light = draw(st.integers(-6, 9)), draw(st.integers(-4, 4))
    rng = np.random.default_rng(seed)
    omega = np.sort(rng.uniform(0.3, 3.0, 5))

    def receptance(size):
        k, m = (a @ a.T + 0.1 * np.eye(size) for a in rng.standard_normal((2, size, size)))
        z = k * (1 + 0.05j) - omega[:, None, None] ** 2 * m
        h = np.linalg.inv(z) * 10.0**-stiff
        return (h + h.swapaxes(1, 2)) / 2

    size = 2 * n if extra is None else n + extra
    h_a, h_b = receptance(size), receptance(size)
    joints = []
    for _ in range(2):
        root = rng.standard_normal((n, n))
        k = root @ root.T + 0.2 * np.eye(n)
        joints.append((k * (1 + 0.1j) + 1j * omega[:, None, None] * 0.05 * k) * 10.0 ** (stiff + light / 4))
    return n, h_a, h_b, joints[0], joints[1]


def joint_dofs(n, n_a):
    return [*range(n), *range(n_a, n_a + n)]


def assembled(n, h_a, h_b, k):
    """FRFs of the assembly, and those at its joint DOFs."""
    whole = jf.couple(h_a, h_b, k, list(range(n)), list(range(n)))
    at = joint_dofs(n, h_a.shape[1])
    return whole, whole[:, at][:, :, at]


def condition(*sweeps):
    return max(np.linalg.cond(lines).max() for lines in sweeps)


def assert_close(found, expected, bound):
    """Within a bound relative to the largest number of each line."""
    size = abs(expected).max(axis=(1, 2), keepdims=True)
    assert (abs(found - expected) <= bound * size).all(), float((abs(found - expected) / size).max())


@PROFILE
@given(structures(extra=None))
def test_decoupling_undoes_coupling(case):
    """K* from points away from the joint, all four equations (2.53)-(2.56)."""
    n, h_a, h_b, k, _ = case
    whole, _ = assembled(n, h_a, h_b, k)
    j, inner = list(range(n)), list(range(n, 2 * n))
    rows = {"r": inner, "s": [2 * n + i for i in inner]}
    for equation in ("rr", "rs", "sr", "ss"):
        out, into = rows[equation[0]], rows[equation[1]]
        h_c = whole[:, out][:, :, into]
        found = jf.decouple(equation, h_a, h_b, h_c, j, j, inner, inner)
        # What is found from h_c is amplified by the way from the joint to the points, there and back.
        far = [h[:, j][:, :, inner] for h in (h_a, h_b)]
        y = np.linalg.inv(k) + h_a[:, :n, :n] + h_b[:, :n, :n]
        size = abs(np.concatenate([h_c, h_a[:, inner][:, :, inner]], axis=0)).max()
        gain = np.linalg.norm(np.linalg.inv(far[0]), 2, axis=(1, 2)).max() * np.linalg.norm(
            np.linalg.inv(far[1]), 2, axis=(1, 2)
        ).max() + max(np.linalg.norm(np.linalg.inv(h), 2, axis=(1, 2)).max() ** 2 for h in far)
        change = condition(y) * condition(k) * condition(*far) ** 2 * (1 + gain * size * abs(y).max())
        bound = SLACK * EPS * change * max(1.0, abs(y).max() * abs(k).max())
        assume(bound < 1e-3)
        assert_close(found, k, bound)


@PROFILE
@given(structures())
def test_ismm_finds_the_joint_from_any_first_estimate(case):
    n, h_a, h_b, k, first = case
    alpha, gamma = (assembled(n, h_a, h_b, each)[1] for each in (first, k))
    found = jf.ismm(alpha, gamma, first)
    size = max(abs(k).max(), abs(first).max()) / abs(k).max(axis=(1, 2)).min()
    bound = SLACK * EPS * condition(alpha, gamma) * condition(k, first) * size
    assume(bound < 1e-3)
    assert_close(found, k, bound)
    assert_close(jf.inverse_substructuring(gamma), k, bound)


@PROFILE
@given(structures())
def test_reciprocity_is_kept(case):
    """Symmetric structures and a symmetric joint give symmetric FRFs; modification does, too."""
    n, h_a, h_b, k, _ = case
    whole, _ = assembled(n, h_a, h_b, k)
    bound = SLACK * EPS * condition(np.linalg.inv(k) + h_a[:, :n, :n] + h_b[:, :n, :n])
    assert_close(whole.swapaxes(1, 2), whole, bound)
    changed = jf.modify(h_a, k, list(range(n)))
    middle = np.eye(n) + k @ h_a[:, :n, :n]
    assert_close(changed.swapaxes(1, 2), changed, bound + SLACK * EPS * condition(middle) * condition(k))


@PROFILE
@given(structures(), st.integers(-60, 60))
def test_scaling_by_a_power_of_two_is_exact(case, power):
    """FRFs in units of 2^p are the same numbers times 2^p: no digit depends on the unit.

    Lines whose numbers lie beyond 2^+-120 or so leave the closed forms of small orders for LAPACK: within rounding
    then.
    """
    n, h_a, h_b, k, first = case
    unit = 2.0**power
    whole, gamma = assembled(n, h_a, h_b, k)
    scaled, gamma_scaled = assembled(n, h_a * unit, h_b * unit, k / unit)
    np.testing.assert_array_equal(scaled, whole * unit)
    alpha = assembled(n, h_a, h_b, first)[1]
    found = jf.ismm(alpha * unit, gamma * unit, first / unit)
    np.testing.assert_array_equal(found, jf.ismm(alpha, gamma, first) / unit)
    np.testing.assert_array_equal(jf.inverse_substructuring(gamma_scaled), jf.inverse_substructuring(gamma) / unit)
    np.testing.assert_array_equal(jf.joint_compliance(gamma_scaled), jf.joint_compliance(gamma) * unit)
    np.testing.assert_array_equal(jf.invert(h_a * unit), jf.invert(h_a) / unit)


@PROFILE
@given(structures(), st.integers(-300, 300))
def test_any_power_of_two_changes_no_more_than_rounding(case, power):
    n, h_a, h_b, k, first = case
    alpha, gamma = (assembled(n, h_a, h_b, each)[1] for each in (first, k))
    found = jf.ismm(alpha * 2.0**power, gamma * 2.0**power, first / 2.0**power) * 2.0**power
    size = max(abs(k).max(), abs(first).max()) / abs(k).max(axis=(1, 2)).min()
    assert_close(found, k, min(1.0, SLACK * EPS * condition(alpha, gamma) * condition(k, first) * size))


@PROFILE
@given(structures(), st.randoms(use_true_random=False))
def test_the_order_of_dofs_changes_the_order_of_results_only(case, order):
    n, h_a, h_b, k, _ = case
    whole, _ = assembled(n, h_a, h_b, k)
    at = list(range(n))
    order.shuffle(at)
    turned = jf.couple(h_a, h_b, k[:, at][:, :, at], at, at)
    bound = SLACK * EPS * condition(np.linalg.inv(k) + h_a[:, :n, :n] + h_b[:, :n, :n], k)
    assert_close(turned, whole, bound)
    # DOFs of A themselves in another order.
    places = list(range(h_a.shape[1]))
    order.shuffle(places)
    moved = jf.couple(h_a[:, places][:, :, places], h_b, k, [places.index(i) for i in range(n)], list(range(n)))
    all_places = [*places, *range(len(places), whole.shape[1])]
    assert_close(moved, whole[:, all_places][:, :, all_places], bound)


@PROFILE
@given(structures())
def test_conjugation_goes_through(case):
    """exp(-i w t) in place of exp(+i w t) conjugates what goes in and what comes out, to the last bit."""
    n, h_a, h_b, k, first = case
    whole, gamma = assembled(n, h_a, h_b, k)
    other, gamma_other = assembled(n, h_a.conj(), h_b.conj(), k.conj())
    np.testing.assert_array_equal(other, whole.conj())
    alpha = assembled(n, h_a, h_b, first)[1]
    expected = jf.ismm(alpha, gamma, first).conj()
    np.testing.assert_array_equal(jf.ismm(alpha.conj(), gamma_other, first.conj()), expected)


@PROFILE
@given(structures(), st.floats(0.1, 10.0))
def test_units_of_rotations_follow_the_lengths(case, length):
    """A rotation times a length is a displacement: K* transforms by S K* S where FRFs do by S^-1 H S^-1."""
    n, h_a, h_b, k, _ = case
    assume(n >= 2)
    s = np.ones(n)
    s[1::2] = length
    _, gamma = assembled(n, h_a, h_b, k)
    twice = np.concatenate([s, s])
    scaled = gamma / np.outer(twice, twice)
    worst = max(condition(gamma), condition(scaled)) * condition(k)
    bound = SLACK * EPS * worst * max(length, 1 / length) ** 2
    assume(bound < 1e-3)
    assert_close(jf.inverse_substructuring(scaled), jf.inverse_substructuring(gamma) * np.outer(s, s), bound)


@PROFILE
@given(st.integers(0, 2**32 - 1), st.integers(1, 5))
def test_coupling_with_a_stiff_joint_is_coupling_without_one(seed, n):
    """K* -> infinity: gamma at both sides of the joint becomes one receptance, H_a (H_a + H_b)^-1 H_b."""
    rng = np.random.default_rng(seed)
    h_a, h_b = (a @ a.swapaxes(1, 2) + 0.5j * np.eye(n) for a in rng.standard_normal((2, 3, n, n)))
    k = 1e12 * np.eye(n) + 0j
    gamma = assembled(n, h_a, h_b, np.broadcast_to(k, (3, n, n)).copy())[1]
    rigid = h_a @ np.linalg.inv(h_a + h_b) @ h_b
    bound = (
        SLACK * EPS * condition(h_a + h_b)
        + 1e-12
        * condition(h_a + h_b)
        * np.linalg.norm(np.linalg.inv(h_a + h_b), 2, axis=(1, 2)).max()
        * max(abs(h_a).max(), abs(h_b).max())
        / abs(rigid).max(axis=(1, 2)).min()
        * SLACK
    )
    assume(bound < 1e-3)
    for rows in (slice(0, n), slice(n, 2 * n)):
        for columns in (slice(0, n), slice(n, 2 * n)):
            assert_close(gamma[:, rows, columns], rigid, bound)


def test_the_examples_are_the_same_in_each_run():
    assert PROFILE.derandomize
    assert PROFILE.database is None


def scaled_operations(n, lines):
    """Each operation on receptances times s and stiffnesses divided by it, and the power of s in its result."""
    a, b, c, k = lines(9, 2 * n), lines(9, 2 * n), lines(9, n), lines(9, n)
    at, far = list(range(n)), list(range(n, 2 * n))
    on = {"on_singular": "nan"}
    return {
        "invert": (lambda s: jf.invert(a * s, **on), -1),
        "solve": (lambda s: jf.solve(a * s, b, **on), -1),
        "couple": (lambda s: jf.couple(a * s, b * s, k / s, at, at, **on), 1),
        "modify": (lambda s: jf.modify(a * s, k / s, at, **on), 1),
        "decouple": (lambda s: jf.decouple("rs", a * s, b * s, c * s, at, at, far, far, **on), -1),
        "ismm": (lambda s: jf.ismm(a * s, b * s, k / s, **on), -1),
        "inverse_substructuring": (lambda s: jf.inverse_substructuring(b * s, **on), -1),
        "joint_compliance": (lambda s: jf.joint_compliance(b * s, **on), 1),
    }


@pytest.mark.parametrize("n", [1, 2, 5])
@pytest.mark.parametrize("engine", ["auto", "plain", "lapack"])
def test_powers_of_two_with_every_engine(engine, n, random_lines):
    """Exact to 2^+-500, to 2^+-240 where a matrix of order two is inverted, by LAPACK line by line wherever numbers go.

    Beyond, squares of moduli leave the range of doubles within lanes, which give such a line to LAPACK: it then has the
    bits that LAPACK gives the line that is not scaled, and differs from those of the lanes by rounding.
    """
    for name, (operation, power) in scaled_operations(n, random_lines).items():
        with jf.use_engine("lapack"):
            by_lapack = operation(1.0)
        with jf.use_engine(engine):
            plain = operation(1.0)
            for exponent in (60, 240, 300, 500, 900):
                for s in (2.0**exponent, 2.0**-exponent):
                    found = operation(s) / s**power
                    same = (found == plain).all(axis=(1, 2))
                    if exponent <= (500 if n > 2 else 240) or engine == "lapack":
                        assert same.all(), (name, s)
                    else:
                        assert (same | (found == by_lapack).all(axis=(1, 2))).all(), (name, s)
