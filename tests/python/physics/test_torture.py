"""26 kinds of matrices, scaled from 1e-300 to 1e300, through every operation, against long double.

Allowed is what a backward stable elimination may do: the change of the exact result when the inputs change by rounding,
measured on the reference itself, times a few times the order.
"""

import warnings

import mpmath
import numpy as np
import pytest

import jointfrf as jf
from torture import KINDS, LONG, OMEGA, OPERATIONS, REFERENCES, is_longer, matrices, rounded, solved

pytestmark = pytest.mark.skipif(not is_longer(), reason="long double is double on this machine")

EPS = np.finfo(float).eps
LINES = 4
#: Rounding changes of the inputs, tried on the reference, and how many of the largest of them are allowed.
TRIED, ALLOWED = 3, 60.0
SCALES = {"1e-300": 1e-300, "1e300": 1e300, "1e-150": 1e-150, "1e150": 1e150}
#: An inverse of small numbers is one of large numbers: the short run has one far and one half the way.
SHORT_SCALES = {"1e-300", "1e150"}


def kernel(operation, *m):
    name, _, equation = operation.partition(" ")
    n = m[-1].shape[1]
    at, far = list(range(n)), list(range(n, 2 * n))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IllConditionedWarning)
        if name == "couple":
            return jf.couple(*m, at, at, on_singular="nan")
        if name == "modify":
            return jf.modify(*m, at, on_singular="nan")
        if name == "decouple":
            return jf.decouple(equation, *m, at, at, far, far, on_singular="nan")
        if name == "receptance":
            return np.concatenate([_receptance(*each) for each in zip(*m, strict=True)])
        if name == "reciprocal_condition":
            rcond = jf.reciprocal_condition(*m)[:, None, None]
            return np.where(rcond == 0, np.nan, rcond)
        if name == "compliance_factors":
            return jf.compliance_factors(m[0], m[1][0].real, on_singular="nan")["uv".index(equation)]
        if name == "compliance_covariance":
            is_reciprocal = equation == "reciprocal"
            return jf.compliance_covariance(m[0], m[2].real, m[1][0].real, reciprocal=is_reciprocal, on_singular="nan")
        if name == "transform":
            return jf.transform(m[0], m[1][0].real, m[2][0].real, on_singular="nan")
        return getattr(jf, name)(*m, on_singular="nan")


def _receptance(k, m):
    own = {"damping": m.imag, "structural_damping": k.imag, "method": "dense", "on_singular": "nan"}
    return jf.receptance([OMEGA / (2 * np.pi)], k.real, m.real, **own)


def arguments(operation, kind, random, n, scale):
    """Matrices of the kind; stiffnesses scale as the inverse of receptances."""
    sizes = OPERATIONS[operation]
    found = [matrices(kind, random, LINES, size * n) for size in sizes]
    if operation == "transform":
        found[1:] = [np.broadcast_to((each.real + each.imag)[0], each.shape) for each in found[1:]]
        return [found[0] * scale, *found[1:]]
    if operation.startswith("compliance_"):
        found[1] = np.broadcast_to((found[1].real + found[1].imag)[0], found[1].shape)
        return [found[0] * scale, found[1], *(abs(each) for each in found[2:])]
    if operation == "receptance" and not all(np.tril(each, -1).any() and np.triu(each, 1).any() for each in found):
        found = [each + each.swapaxes(1, 2) for each in found]  # half of a matrix is refused
    if operation in ("solve", "receptance"):
        return [each * scale for each in found]
    inverse = 1.0 if operation.startswith("decouple") else 1 / scale
    return [each * (scale if size == 2 else 1 / scale if inverse != 1.0 else scale) for each, size in
            zip(found, sizes, strict=True)]  # fmt: skip


def norms(a):
    return abs(a).max(axis=(1, 2), keepdims=True)


def changed(random, m, operation):
    """The same to rounding: by eps of the largest number of the line; a transform by eps of each."""
    noise = random.uniform(-1, 1, m.shape) + 1j * random.uniform(-1, 1, m.shape)
    if operation == "transform" or (operation.startswith("compliance_") and not np.iscomplexobj(m)):
        return m.astype(LONG) * (1 + EPS * noise.real)
    return m.astype(LONG) + EPS * norms(m.astype(LONG)) * noise


def inverted_difference(operation, m):
    """Condition of what decoupling inverts on its way, L^-1 (H - C) R^-1: K* may be regular where that is not.

    Infinite where an exact zero stands in the way; its line is then left to the code of the kernel.
    """
    equation, (a, b, c) = operation.split()[1], m
    n = c.shape[1]
    own = {"r": a, "s": b}
    left, right = (own[side] for side in equation)
    same = own[equation[0]][:, n:, n:] if equation[0] == equation[1] else 0
    conditions = [np.linalg.cond(each) for each in (left[:, n:, :n], same - c, right[:, :n, n:])]
    return np.prod(conditions, axis=0)[:, None, None]


def compared(operation, kind, n, scale, seed=0):
    """Number of lines compared, bad by their code, and beyond the bound."""
    random = np.random.default_rng([seed, n, *map(ord, kind + operation)])
    m = arguments(operation, kind, random, n, scale)
    reference = REFERENCES[operation]
    with np.errstate(all="ignore"):
        exact = reference(*(each.astype(LONG) for each in m))
        change = np.zeros_like(norms(exact))
        for _ in range(TRIED):
            with rounded(random):
                moved = reference(*(changed(random, each, operation) for each in m))
            change = np.fmax(change, norms(moved - exact))
        found = kernel(operation, *m)
        error = norms(found - exact)
        if operation.startswith("decouple"):
            change = change + EPS * inverted_difference(operation, m) * norms(exact)
        bound = ALLOWED * found.shape[1] * change + 8 * EPS * norms(exact)
        # What a double cannot hold, or holds with few digits.
        inside = (norms(exact) < 1e307) & (norms(exact) > 1e-303) & (change < 1e-3 * norms(exact))
        is_bad = ~np.isfinite(found).all(axis=(1, 2), keepdims=True)
        wrong = inside & ~is_bad & ~(error <= bound)
        lost = inside & is_bad
    return int(inside.sum()), int(lost.sum()), int(wrong.sum()), float((error / bound)[inside & ~is_bad].max(initial=0))


def test_there_are_26_kinds():
    assert len(KINDS) == 26
    assert REFERENCES.keys() == OPERATIONS.keys()


@pytest.mark.parametrize("operation", OPERATIONS)
def test_every_operation_on_every_kind(operation):
    for number, kind in enumerate(KINDS):
        for n in (1, 3) if number % 5 == 0 else (3,):  # of order 1 most kinds are one number
            _, lost, wrong, worst = compared(operation, kind, n, 1.0)
            assert (lost, wrong) == (0, 0), (kind, n, worst)


@pytest.mark.parametrize("operation", ["invert", "solve", "inverse_substructuring", "joint_compliance", "transform",
                                       "couple", "ismm", "receptance", "reciprocal_condition", "compliance_factors u",
                                       "compliance_covariance"])  # fmt: skip
@pytest.mark.parametrize(
    "scale", [pytest.param(scale, marks=() if scale in SHORT_SCALES else pytest.mark.long) for scale in SCALES]
)
def test_every_scale(operation, scale):
    """Products of two sizes may overflow where the result does not: such lines have a code, never wrong numbers."""
    held = tried = 0
    for number, kind in enumerate(KINDS):
        for n in (1, 3) if number % 5 == 0 else (3,):  # of order 1 most kinds are one number
            inside, lost, wrong, worst = compared(operation, kind, n, SCALES[scale])
            assert wrong == 0, (kind, n, worst)
            held, tried = held + inside - lost, tried + LINES
    if operation in ("invert", "transform"):
        assert held > tried / 2


@pytest.mark.parametrize("engine", ["lapack", "plain"])
def test_other_engines(engine):
    with jf.use_engine(engine):
        for operation in ("invert", "solve", "ismm", "couple"):
            for kind in KINDS:
                _, lost, wrong, worst = compared(operation, kind, 3, 1.0, seed=1)
                assert (lost, wrong) == (0, 0), (operation, kind, worst)


@pytest.mark.parametrize("n", [1, 2, 4])
def test_denormal_numbers(n):
    """Their inverses are beyond all doubles, or nearly: each line is right or has a code."""
    random = np.random.default_rng(n)
    for size in (1e-306, 1e-307, 1e-308, 1e-310, 1e-320):
        a = matrices("random", random, 40, n) * size
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", jf.IllConditionedWarning)
            found = jf.invert(a, on_singular="nan")
        exact = solved(a, np.broadcast_to(np.eye(n), a.shape))
        good = np.isfinite(found).all(axis=(1, 2))
        largest = np.maximum(abs(exact.real), abs(exact.imag)).max(axis=(1, 2))
        assert not (good & (largest > np.finfo(float).max)).any()
        assert (good | (largest > 0.5 * np.finfo(float).max)).all()
        condition = np.linalg.cond(a * 2.0**1000)
        error = norms(found - exact)[:, 0, 0] / norms(exact)[:, 0, 0]
        assert (error[good] <= ALLOWED * n * condition[good] * EPS).all(), error[good]


@pytest.mark.parametrize("n_points", [2, 3, 5])
@pytest.mark.parametrize("spacing", [0.3, 1e-3])
def test_central_differences_against_mpmath(n_points, spacing):
    """Rotations from displacements lose digits by cancellation: rounding of each product, no more."""
    random = np.random.default_rng(n_points)
    x = np.arange(n_points) * spacing - (n_points - 1) / 2 * spacing
    smooth = 1 / (1 + np.add.outer(x, x) ** 2)
    h = smooth * (1 + 0.1j * random.standard_normal((LINES, 1, 1)))
    found = jf.central_difference(h, x)
    with mpmath.workdps(50):
        points = [mpmath.mpf(float(each)) for each in x]
        t = [[mpmath.mpf(float(each)) for each in row] for row in jf.difference_weights(x)]
        # Exact for a rigid body: the mean of a constant, the slope of a line.
        for row, (constant, line) in zip(t, ((1, 0), (0, 1)), strict=True):
            size = mpmath.fsum([abs(each) for each in row])
            assert abs(mpmath.fsum(row) - constant) <= 4 * EPS * size
            moment = mpmath.fsum([each * place for each, place in zip(row, points, strict=True)])
            assert abs(moment - line) <= 4 * EPS * size * abs(points[0])
        for line in range(LINES):
            for p in range(2):
                for q in range(2):
                    terms = [t[p][i] * mpmath.mpmathify(complex(h[line, i, j])) * t[q][j] for i in range(n_points)
                             for j in range(n_points)]  # fmt: skip
                    error = abs(mpmath.mpmathify(complex(found[line, p, q])) - mpmath.fsum(terms))
                    size = mpmath.fsum([abs(each) for each in terms])
                    assert error <= 8 * n_points * EPS * size


@pytest.mark.parametrize("operation", ["invert", "couple", "ismm", "inverse_substructuring"])
def test_entries_that_are_zero_in_theory(operation):
    """Two directions that nothing couples: the cross terms are zero but for n eps of the largest entry of the line.

    No relative accuracy can be stated of them; this absolute one is.
    """
    random = np.random.default_rng(9)
    turn = np.linalg.qr(random.standard_normal((2, 2)))[0]

    def apart(blocks):
        """Blocks of 2 x 2 that are diagonal in turned axes."""
        lines = np.zeros((LINES, 2 * blocks, 2 * blocks), complex)
        for direction in range(2):
            own = random.standard_normal((LINES, blocks, blocks)) + 1j * random.standard_normal((LINES, blocks, blocks))
            lines[:, direction::2, direction::2] = own + 3 * np.eye(blocks)
        whole = np.kron(np.eye(blocks), turn)
        return whole @ lines @ whole.T

    a, b, k = apart(2), apart(2), apart(1)
    arguments_of = {"invert": [a], "couple": [a, b, k], "ismm": [a, b, k], "inverse_substructuring": [a]}[operation]
    found = kernel(operation, *arguments_of)
    back = np.kron(np.eye(found.shape[1] // 2), turn)
    found = back.T @ found @ back
    condition = max(np.linalg.cond(each).max() for each in arguments_of)
    cross = max(abs(found[:, 0::2, 1::2]).max(), abs(found[:, 1::2, 0::2]).max())
    assert 0 < cross <= 20 * found.shape[1] * EPS * condition**2 * abs(found).max()
