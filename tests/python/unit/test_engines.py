"""Every engine gives what the reference gives: results, codes, condition numbers, exceptions, for every operation.

How far two results may be apart is measured, not assumed: the reference is run again on inputs changed in their last
bit.
"""

import functools
import os
import re
import subprocess
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.kernel import call
from jointfrf.kernel.call import Engine

EPS = np.finfo(float).eps
#: As many times the change by the last bit of the inputs may two engines be apart.
TOLERANCE = 300
ORDERS = [*range(1, 14), 24, 33, 48, 64, 65]
COUNTS = [1, 2, 3, 7, 8, 9, 63, 64, 65, 200]
#: Of these the short run leaves out those between two that take the same ways.
BETWEEN = {"order": {7, 10, 11, 12, 48}, "lines": {2, 3, 63}}


@dataclass
class Call:
    """A call of a kernel routine: arguments up to the result, and those of them that have a line axis."""

    routine: str
    args: list[Any]
    shape: tuple[int, ...]
    sweeps: dict[str, np.ndarray]

    def run(self, on_singular: str = "nan"):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", jf.IllConditionedWarning)
            return call.run(self.routine, self.args, self.shape, self.sweeps, None, on_singular)

    def failure(self) -> tuple[type, str] | None:
        """What the public functions would raise."""
        try:
            self.run("raise")
        except (ValueError, OverflowError, np.linalg.LinAlgError) as error:
            return type(error), str(error)
        return None

    def disturbed(self, rng) -> "Call":
        """Return the same call with every number changed by its last bit or so."""

        def change(a):
            if not isinstance(a, np.ndarray) or a.dtype.kind not in "fc":
                return a
            with np.errstate(invalid="ignore"):
                return a * (1 + EPS * rng.uniform(-1, 1, a.shape))

        return Call(self.routine, [change(a) for a in self.args], self.shape, {})


class Maker:
    """Random matrices of moderate condition, receptances times `scale`, stiffnesses divided by it."""

    def __init__(self, n: int, n_freq: int, scale: float = 1.0, seed: int = 0):
        self.n, self.n_freq, self.scale = n, n_freq, scale
        self.rng = np.random.default_rng([seed, n, n_freq])

    def h(self, rows: int, columns: int | None = None) -> np.ndarray:
        return self.scale * self._lines(rows, rows if columns is None else columns)

    def k(self, n: int) -> np.ndarray:
        return self._lines(n, n) / self.scale

    def _lines(self, rows: int, columns: int) -> np.ndarray:
        shape = (self.n_freq, rows, columns)
        return self.rng.standard_normal(shape) + 1j * self.rng.standard_normal(shape)

    def real(self, *shape: int) -> np.ndarray:
        return self.rng.standard_normal(shape)

    def dofs(self, count: int, among: int) -> np.ndarray:
        return (self.rng.permutation(among)[:count] + 1).astype(np.int32)


def invert(m: Maker) -> Call:
    a = m.h(m.n)
    return Call("invert", [m.n, m.n_freq, a], a.shape, {"a": a})


def solve(m: Maker) -> Call:
    a, b = m.h(m.n), m.h(m.n, 3)
    return Call("solve", [m.n, 3, m.n_freq, a, b], b.shape, {"a": a, "b": b})


def solve_one(m: Maker) -> Call:
    a, b = m.h(m.n), m.h(m.n, 1)
    return Call("solve", [m.n, 1, m.n_freq, a, b], b.shape, {"a": a, "b": b})


def receptance(m: Maker) -> Call:
    n = m.n
    omega = m.rng.uniform(0.5, 1.5, m.n_freq)
    k, mass, c, s = (m.real(n, n) / m.scale for _ in range(4))
    out, into = m.dofs((n + 1) // 2, n), m.dofs((n + 2) // 2, n)
    args = [n, m.n_freq, out.size, into.size, omega, k, mass, n, c, n, s, 0.1, out, into]
    return Call("receptance", args, (m.n_freq, out.size, into.size), {"omega": omega})


def receptance_plain(m: Maker) -> Call:
    n = m.n
    omega = m.rng.uniform(0.5, 1.5, m.n_freq)
    k, mass = (m.real(n, n) / m.scale for _ in range(2))
    every = np.arange(1, n + 1, dtype=np.int32)
    none = np.zeros((1, n))
    args = [n, m.n_freq, n, n, omega, k, mass, 0, none, 0, none, 0.1, every, every]
    return Call("receptance", args, (m.n_freq, n, n), {"omega": omega})


def receptance_banded(m: Maker) -> Call:
    n = m.n
    kl, ku = min(2, n - 1), min(1, n - 1)
    omega = m.rng.uniform(0.5, 1.5, m.n_freq)
    k, mass, c, s = (m.real(n, kl + ku + 1) / m.scale for _ in range(4))
    out, into = m.dofs((n + 1) // 2, n), m.dofs((n + 2) // 2, n)
    args = [n, kl, ku, m.n_freq, out.size, into.size, omega, k, mass, n, c, n, s, 0.1, out, into]
    return Call("receptance_banded", args, (m.n_freq, out.size, into.size), {"omega": omega})


def receptance_modal(m: Maker) -> Call:
    n = m.n
    omega = m.rng.uniform(0.5, 1.5, m.n_freq)
    squared, damping, eta = (abs(m.real(n)) for _ in range(3))
    args = [n, m.n_freq, 3, 2, omega, squared, damping, eta, m.real(3, n) * np.sqrt(m.scale), m.real(2, n)]
    return Call("receptance_modal", args, (m.n_freq, 3, 2), {"omega": omega})


def couple(m: Maker) -> Call:
    n_a, n_b, n_j = m.n, m.n + 1, (m.n + 1) // 2
    a, b, k = m.h(n_a), m.h(n_b), m.k(n_j)
    args = [n_a, n_b, n_j, m.n_freq, a, b, k, m.dofs(n_j, n_a), m.dofs(n_j, n_b)]
    return Call("couple", args, (m.n_freq, n_a + n_b, n_a + n_b), {"h_a": a, "h_b": b, "k_joint": k})


def couple_large(m: Maker) -> Call:
    """As many DOFs as are coupled by products line by line, and somewhat fewer and more."""
    n_a, n_b, n_j = m.n + 24, 26, min(m.n, 26)
    a, b, k = m.h(n_a), m.h(n_b), m.k(n_j)
    args = [n_a, n_b, n_j, m.n_freq, a, b, k, m.dofs(n_j, n_a), m.dofs(n_j, n_b)]
    return Call("couple", args, (m.n_freq, n_a + n_b, n_a + n_b), {"h_a": a, "h_b": b, "k_joint": k})


def couple_bodies(m: Maker) -> Call:
    """Two bodies by a connection of all DOFs of the first but the last, which is rigid."""
    n_a, n_b, n = m.n, m.n + 1, m.n
    h = np.concatenate([m.h(size).reshape(m.n_freq, -1) for size in (n_a, n_b)], axis=1)
    t = np.concatenate([m.k(n - 1).reshape(m.n_freq, -1), np.ones((m.n_freq, 1))], axis=1)
    ends = np.stack([m.dofs(n, n_a), n_a + m.dofs(n, n_b)], axis=1).astype(np.int32)
    connection, rigid = np.ones((2, n), np.int32)
    connection[-1], rigid[:-1] = 1 + (n > 1), 0
    every = np.arange(1, n_a + n_b + 1, dtype=np.int32)
    args = [
        2, n, h.shape[1], t.shape[1], every.size, every.size, m.n_freq, np.array([n_a, n_b], np.int32), ends,
        connection, rigid, h, t, every, every,
    ]  # fmt: skip
    return Call("couple_bodies", args, (m.n_freq, every.size, every.size), {"h": h, "t": t})


def modify(m: Maker) -> Call:
    n_m = (m.n + 1) // 2
    alpha, d = m.h(m.n), m.k(n_m)
    args = [m.n, n_m, m.n_freq, alpha, d, m.dofs(n_m, m.n)]
    return Call("modify", args, alpha.shape, {"alpha": alpha, "d": d})


def find_modification(m: Maker) -> Call:
    alpha, gamma = m.h(m.n), m.h(m.n)
    return Call("find_modification", [m.n, m.n_freq, alpha, gamma], alpha.shape, {"alpha": alpha, "gamma": gamma})


def ismm(m: Maker) -> Call:
    alpha, gamma, k = m.h(2 * m.n), m.h(2 * m.n), m.k(m.n)
    sweeps = {"alpha": alpha, "gamma": gamma, "k_initial": k}
    return Call("ismm", [m.n, m.n_freq, alpha, gamma, k], k.shape, sweeps)


def inverse_substructuring(m: Maker) -> Call:
    gamma = m.h(2 * m.n)
    return Call("inverse_substructuring", [m.n, m.n_freq, gamma], (m.n_freq, m.n, m.n), {"gamma": gamma})


def decouple(equation: str) -> Callable[[Maker], Call]:
    def make(m: Maker) -> Call:
        n_a, n_b, n = 2 * m.n, 2 * m.n + 1, m.n
        a, b, c = m.h(n_a), m.h(n_b), m.h(n)
        on_a, on_b = m.dofs(2 * n, n_a), m.dofs(2 * n, n_b)
        args = [equation, n_a, n_b, n, m.n_freq, a, b, c, on_a[:n], on_b[:n], on_a[n:], on_b[n:]]
        return Call("decouple", args, c.shape, {"h_a": a, "h_b": b, "h_c": c})

    return make


def joint_compliance(m: Maker) -> Call:
    gamma = m.h(2 * m.n)
    return Call("joint_compliance", [m.n, m.n_freq, gamma], (m.n_freq, m.n, m.n), {"gamma": gamma})


def compliance_factors(m: Maker) -> Call:
    gamma, t = m.h(2 * m.n), m.real(2 * m.n, 2 * m.n + 1)
    args = [m.n, 2 * m.n + 1, m.n_freq, gamma, t]
    return Call("compliance_factors", args, (m.n_freq, 2 * m.n, 2 * m.n + 1), {"gamma": gamma})


def compliance_covariance(m: Maker) -> Call:
    gamma, t = m.h(2 * m.n), m.real(2 * m.n, 2 * m.n + 1)
    variance = m.rng.uniform(0.5, 1.5, (m.n_freq, 2 * m.n + 1, 2 * m.n + 1))
    args = [m.n % 2, m.n, 2 * m.n + 1, m.n_freq, gamma, t, variance]
    sweeps = {"gamma": gamma, "variance": variance}
    return Call("compliance_covariance", args, (m.n_freq, m.n**2, m.n**2), sweeps)


def central_difference(m: Maker) -> Call:
    points = m.n + 1
    h, offset = m.h(points), np.linspace(-1, 1, points)
    return Call("central_difference", [points, m.n_freq, offset, h], (m.n_freq, 2, 2), {"h": h})


def transform(m: Maker) -> Call:
    h, left, right = m.h(m.n, m.n + 1), m.real(m.n + 2, m.n), m.real(3, m.n + 1)
    args = [m.n + 2, 3, m.n, m.n + 1, m.n_freq, h, left, right]
    return Call("transform", args, (m.n_freq, m.n + 2, 3), {"h": h})


OPERATIONS = {
    f.__name__: f
    for f in (
        invert, solve, solve_one, receptance, receptance_plain, receptance_banded, receptance_modal, couple,
        couple_bodies, modify, find_modification, ismm, inverse_substructuring, joint_compliance, compliance_factors,
        compliance_covariance, central_difference, transform,
    )
} | {f"decouple_{equation}": decouple(equation) for equation in ("rr", "rs", "sr", "ss")}  # fmt: skip
#: The covariance of n^2 entries grows with n^4, a band matrix and a joint's matrices of these orders take long.
LARGEST = {"compliance_covariance": 9} | dict.fromkeys(
    ["ismm", *(f"decouple_{e}" for e in ("rr", "rs", "sr", "ss"))], 33
)


def engines() -> list[str]:
    """Return the fast engines of this machine."""
    there = []
    before = jf.get_engine()
    for engine in get_args(Engine)[2:]:
        try:
            jf.set_engine(engine)
        except ValueError:
            continue
        there.append(engine)
    jf.set_engine(before)
    return there


ENGINES = engines()


@pytest.fixture(params=ENGINES)
def engine(request) -> str:
    return request.param


@pytest.fixture(params=OPERATIONS)
def operation(request) -> str:
    return request.param


@pytest.fixture(autouse=True)
def one_thread(threads):
    """Lines are compared among the same neighbours."""


def on(engine: str, call: Call):
    with jf.use_engine(engine):
        return call.run()


def largest(lines: np.ndarray) -> np.ndarray:
    return abs(lines).max(axis=(1, 2), initial=0)


def allowed(call: Call, expected: np.ndarray) -> np.ndarray:
    """Return how far each line of two results may be apart."""
    rng = np.random.default_rng(99)
    moved = [largest(on("lapack", call.disturbed(rng))[0] - expected) for _ in range(3)]
    return TOLERANCE * (np.max(moved, axis=0) + EPS * largest(expected))


def check_parity(call: Call, leave_out: tuple[int, ...] = ()) -> None:
    """Compare every engine with the reference; the numbers of the lines left out may differ."""
    expected, info, rcond = on("lapack", call)
    limit = allowed(call, expected)
    reported = (info == 0) & (rcond > 1e-10)
    within = 1 + TOLERANCE * EPS / rcond[reported] if call.routine == "invert" else 30
    for engine in ENGINES:
        what = f"{call.routine} {call.shape} {engine}"
        result, info_fast, rcond_fast = on(engine, call)
        np.testing.assert_array_equal(info_fast, info, err_msg=what)
        good = info == 0
        assert np.isnan(result[~good].real).all(), what
        assert np.isnan(result[~good].imag).all(), what
        assert not rcond_fast[~good].any(), what
        assert np.isfinite(result[good]).all(), f"{what}: good lines hold NaN or Inf"
        good[list(leave_out)] = False
        apart = largest(result - expected)[good]
        assert (apart <= limit[good]).all(), f"{what}: {(apart / limit[good]).max():.1e} times as far apart as allowed"
        ratio = rcond_fast[reported] / rcond[reported]
        assert (ratio <= within).all(), f"{what}: rcond {ratio.max()} times that of the reference"
        assert (ratio >= 1 / within).all(), f"{what}: rcond {ratio.min()} times that of the reference"
        assert (rcond_fast <= 1).all(), what


@pytest.mark.parametrize(
    ("operation", "n"),
    [
        pytest.param(o, n, marks=pytest.mark.long if n in BETWEEN["order"] else ())
        for o in OPERATIONS
        for n in ORDERS
        if n <= LARGEST.get(o, 65)
    ],
)
def test_every_order(operation, n):
    check_parity(OPERATIONS[operation](Maker(n, 19 if n < 24 else 9)))


@pytest.mark.parametrize(
    "n_freq", [pytest.param(n, marks=pytest.mark.long if n in BETWEEN["lines"] else ()) for n in COUNTS]
)
@pytest.mark.parametrize("orders", [(1, 2, 5, 8), pytest.param((3, 4, 6), marks=pytest.mark.long)])
def test_every_number_of_lines(operation, orders, n_freq):
    for n in orders:
        if n <= LARGEST.get(operation, 65):
            check_parity(OPERATIONS[operation](Maker(n, n_freq)))


@pytest.mark.parametrize(
    "scale", [1e-150, 1e150, *(pytest.param(scale, marks=pytest.mark.long) for scale in (1e-75, 1e75))]
)
@pytest.mark.parametrize("orders", [(1, 3, 5, 9), pytest.param((2, 4, 6), marks=pytest.mark.long)])
def test_every_scale(operation, orders, scale):
    for n in orders:
        if n <= LARGEST.get(operation, 65):
            check_parity(OPERATIONS[operation](Maker(n, 11, scale)))


#: The numbers of these lines lose digits below the smallest normal number.
DENORMAL = ("tiny", "denormal column")
BAD = {
    "NaN": lambda line: line.fill(np.nan),
    "one NaN": lambda line: line.put(line.size - 1, np.nan),
    "Inf": lambda line: line.put(0, np.inf),
    "-Inf": lambda line: line.put(line.size // 2, -np.inf),
    "zero": lambda line: line.fill(0),
    "ones": lambda line: line.fill(1),
    "zero row": lambda line: line[..., -1:].fill(0),
    "tiny": lambda line: line.__imul__(1e-320),
    "huge": lambda line: line.__imul__(1e307),
    "denormal column": lambda line: line[..., :1].__imul__(1e-310),
}


@pytest.mark.filterwarnings("ignore:(overflow|invalid value) encountered")
@pytest.mark.parametrize("bad", BAD)
@pytest.mark.parametrize("orders", [(1, 3, 5), pytest.param((2, 4, 6), marks=pytest.mark.long)])
def test_a_bad_line_anywhere_in_a_block(operation, orders, bad):
    """Its code, its NaN and the message are those of the reference; its neighbours stay accurate."""
    for n in orders:
        if n > LARGEST.get(operation, 65):
            continue
        for where in range(8) if n == 5 and bad in ("NaN", "zero", "ones") else (n,):
            call = OPERATIONS[operation](Maker(n, 13, seed=where))
            for name, sweep in call.sweeps.items():
                kept = sweep[where].copy()
                BAD[bad](sweep[where : where + 1])
                check_parity(call, (where,) if bad in DENORMAL else ())
                with jf.use_engine("lapack"):
                    expected = call.failure()
                for engine in ENGINES:
                    with jf.use_engine(engine):
                        assert call.failure() == expected, (name, engine)
                sweep[where] = kept


@pytest.mark.parametrize("n", [1, 2, 3, 6, 17, 24, 60, 160, 280])
def test_couplings_of_many_dofs(n):
    for n_freq in (3, 8, 19) if n < 60 else (9,):
        check_parity(couple_large(Maker(n, n_freq)))


@pytest.mark.parametrize("scale", [1e-150, 1e150])
def test_couplings_of_many_dofs_at_every_scale(scale):
    check_parity(couple_large(Maker(5, 11, scale)))


@pytest.mark.filterwarnings("ignore:(overflow|invalid value) encountered")
@pytest.mark.parametrize("bad", BAD)
def test_a_bad_line_in_a_coupling_of_many_dofs(bad):
    for where in (0, 7, 12):
        call = couple_large(Maker(6, 13, seed=where))
        for sweep in call.sweeps.values():
            kept = sweep[where].copy()
            BAD[bad](sweep[where : where + 1])
            check_parity(call, (where,) if bad in DENORMAL else ())
            sweep[where] = kept


def test_the_number_of_threads_changes_no_bit_of_a_coupling_of_many_dofs(engine, threads):
    if threads is None:
        pytest.skip("needs OpenMP and /proc")
    call = couple_large(Maker(6, 150))
    threads(1)
    one = on(engine, call)
    threads(2)
    for a, b in zip(one, on(engine, call), strict=True):
        assert a.tobytes() == b.tobytes()


def test_many_bad_lines(operation):
    call = OPERATIONS[operation](Maker(5, 200))
    rng = np.random.default_rng(7)
    sweep = next(iter(call.sweeps.values()))
    for where in rng.permutation(200)[:60]:
        sweep[where] = rng.choice([0, np.nan, np.inf])
    sweep[120:136] = np.nan
    check_parity(call)


def test_the_number_of_threads_changes_no_bit(operation, engine, threads):
    if threads is None:
        pytest.skip("needs OpenMP and /proc")
    for n, n_freq in ((1, 9000), (2, 4000), (4, 3001), (5, 1500), (12, 200)):
        if n > LARGEST.get(operation, 65):
            continue
        call = OPERATIONS[operation](Maker(n, n_freq))
        next(iter(call.sweeps.values()))[n_freq // 2] = np.nan
        threads(1)
        one = on(engine, call)
        threads(2)
        two = on(engine, call)
        for a, b in zip(one, two, strict=True):
            assert a.tobytes() == b.tobytes()


def residuals(a: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return |A X - I| and |X A - I| over eps |A| |X|, products in extended precision, 1-norm."""
    a, x = (z.astype(np.clongdouble) for z in (a, x))
    eye = np.eye(a.shape[1])

    def norm(z):
        return abs(z).sum(axis=1).max(axis=1)

    scale = EPS * norm(a) * norm(x)
    return tuple((norm(np.einsum("fij,fjk->fik", *pair) - eye) / scale).astype(float) for pair in ((a, x), (x, a)))


def of_condition(rng, n_freq: int, n: int, condition: float) -> np.ndarray:
    def unitary():
        return np.linalg.qr(rng.standard_normal((n_freq, n, n)) + 1j * rng.standard_normal((n_freq, n, n)))[0]

    return unitary() * np.geomspace(1, 1 / condition, n) @ unitary()


def frf_like(rng, n_freq: int, n: int) -> np.ndarray:
    """Three modes and a small residual term of full rank."""
    shapes = rng.standard_normal((n, 3))
    omega = np.linspace(0.5, 3.5, n_freq)[:, None]
    modal = 1 / (np.array([1.0, 4.0, 9.0]) * (1 + 0.01j) - omega**2)
    rest = rng.standard_normal((n_freq, n, n)) + 1j * rng.standard_normal((n_freq, n, n))
    return np.einsum("im,fm,jm->fij", shapes, modal, shapes) + 1e-5 * rest


def wilkinson(rng, n_freq: int, n: int) -> np.ndarray:
    """Growth 2^(n - 1) for who does not exchange rows: 1 on the diagonal and in the last column, -1 below."""
    a = np.eye(n) - np.tril(np.ones((n, n)), -1)
    a[:, -1] = 1
    return a * np.exp(1j * rng.uniform(0, 6, (n_freq, 1, 1)))


FAMILIES = {
    "random": lambda rng, f, n: rng.standard_normal((f, n, n)) + 1j * rng.standard_normal((f, n, n)),
    "condition 1e6": lambda rng, f, n: of_condition(rng, f, n, 1e6),
    "condition 1e12": lambda rng, f, n: of_condition(rng, f, n, 1e12),
    "rows scaled": lambda rng, f, n: FAMILIES["random"](rng, f, n) * 10.0 ** rng.uniform(-8, 8, (f, n, 1)),
    "columns scaled": lambda rng, f, n: FAMILIES["random"](rng, f, n) * 10.0 ** rng.uniform(-8, 8, (f, 1, n)),
    "rank 3": frf_like,
    "Wilkinson": wilkinson,
}


@functools.cache
def inverted(family: str, n: int, engine: str) -> np.ndarray:
    """Both residuals of every matrix of a family, inverted by an engine."""
    a = np.ascontiguousarray(FAMILIES[family](np.random.default_rng(n), 500 if n <= 13 else 60, n))
    call = Call("invert", [n, len(a), a], a.shape, {"a": a})
    return np.array(residuals(a, on(engine, call)[0]))


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize(
    "n", [2, 3, 6, 8, 13, *(pytest.param(n, marks=pytest.mark.long) for n in (4, 5, 7, 12, 24, 48))]
)
def test_an_inverse_is_as_accurate_as_that_of_lapack(engine, family, n):
    """Both residuals over many matrices: no more than a few times those of zgetrf and zgetri.

    The one residual of zgetri is smaller than the other by its order of substitution, those of Gauss-Jordan are alike:
    the larger one counts. Its tail is long where rows are scaled, and which matrix makes the largest of 500 is chance:
    the second largest counts.
    """
    reference, fast = (inverted(family, n, name) for name in ("lapack", engine))
    for share, factor in ((0.5, 3), (0.98, 3), (0.998, 6)):
        bar = np.quantile(reference, share, axis=1).max()
        assert np.quantile(fast, share, axis=1).max() <= factor * bar, f"of {share:.0%}"


def fail_inside(engine: str) -> None:
    with jf.use_engine(engine):
        assert jf.get_engine() == engine
        raise ZeroDivisionError


def test_the_choice_is_kept_and_returned_to():
    before = jf.get_engine()
    with jf.use_engine("plain"):
        assert jf.get_engine() == "plain"
        with pytest.raises(ZeroDivisionError):
            fail_inside("lapack")
        assert jf.get_engine() == "plain"
        with pytest.raises(ValueError, match=r"engine must be one of auto, lapack, plain, .* not 'fast'"):
            jf.set_engine("fast")
        assert jf.get_engine() == "plain"
        jf.set_engine("auto")
        assert jf.get_engine() == ENGINES[-1]
    assert jf.get_engine() == before


def test_an_engine_of_another_machine_is_refused(monkeypatch):
    monkeypatch.setattr(call._kernel, "jf_set_engine", lambda code: -1)
    with pytest.raises(ValueError, match="engine 'x86-64-v4' is not available on this machine"):
        jf.set_engine("x86-64-v4")


def python(code: str, word: str) -> subprocess.CompletedProcess:
    environment = os.environ | {"JOINTFRF_ENGINE": word}
    return subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=900)


@pytest.mark.parametrize("word", ["lapack", "plain"])
def test_the_environment_chooses(word):
    assert python("import jointfrf; print(jointfrf.get_engine())", word).stdout.strip() == word


def test_a_wrong_word_in_the_environment_is_told_in_one_sentence():
    done = python("import jointfrf; jointfrf.invert([[[2.0]]])", "quick")
    last = done.stderr.strip().splitlines()[-1]
    expected = (
        r"ValueError: the environment variable JOINTFRF_ENGINE is 'quick': it must be one of auto, lapack, plain, "
        r"x86-64-v2, x86-64-v3, x86-64-v4 that this machine has"
    )
    assert re.fullmatch(expected, last), done.stderr
    again = "import jointfrf\ntry: jointfrf.invert([[[2.0]]])\nexcept ValueError: pass\n"
    again += "jointfrf.set_engine('auto'); print(jointfrf.invert([[[2.0]]]).real)"
    assert python(again, "quick").stdout.strip() == "[[[0.5]]]"


def test_a_wrong_word_in_the_environment_on_the_command_line(tmp_path):
    code = "import sys; from jointfrf.workbench.cli.main import main; sys.exit(main({!r}))"
    run = ["run", "3.1-discrete", "--jobs", "1", "--realisations", "1", "--out", str(tmp_path)]
    assert python(code.format(["--help"]), "quick").returncode == 0
    assert python(code.format(["cases"]), "quick").returncode == 0
    done = python(code.format(run), "quick")
    assert done.returncode == 1
    assert done.stderr.count("\n") == 1, done.stderr
    assert done.stderr.startswith("jointfrf: error: the environment variable JOINTFRF_ENGINE is 'quick'")
