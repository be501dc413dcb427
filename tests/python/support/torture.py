"""Matrices that torture elimination, and the operations of the kernel in long double as a reference.

A reference solves with complete pivoting in the long double of the machine (64 bits of mantissa and exponents to
1e4932 on x86), so that nothing of it overflows and its rounding is 2000 times smaller.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

import numpy as np

__all__ = ["KINDS", "LONG", "OMEGA", "OPERATIONS", "REFERENCES", "is_longer", "matrices", "rounded", "solved"]

Lines = np.ndarray
#: Angular frequency of receptances, rad/s; mass and damping times it are of the size of the stiffness.
OMEGA = 0.75
LONG = np.clongdouble


def is_longer() -> bool:
    """Whether the long double of this machine has more digits and a wider range than a double."""
    return bool(np.finfo(np.longdouble).eps < 1e-18 and np.finfo(np.longdouble).max > np.longdouble(10) ** 400)


def _normal(random: np.random.Generator, lines: int, n: int) -> Lines:
    return random.standard_normal((lines, n, n)) + 1j * random.standard_normal((lines, n, n))


def _unitary(random: np.random.Generator, lines: int, n: int) -> Lines:
    return np.linalg.qr(_normal(random, lines, n))[0]


def _of_singular_values(random: np.random.Generator, lines: int, values: np.ndarray) -> Lines:
    n = values.size
    return _unitary(random, lines, n) @ (values[:, None] * _unitary(random, lines, n))


def _tridiagonal(random: np.random.Generator, lines: int, n: int) -> Lines:
    k = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    return k * (1 + 0.01j) - random.uniform(0.1, 3.0, (lines, 1, 1)) * np.eye(n)


def _permutation(random: np.random.Generator, lines: int, n: int) -> Lines:
    return np.stack([np.eye(n)[random.permutation(n)] for _ in range(lines)]) * (1 + 1j)


def _growth(_: np.random.Generator, lines: int, n: int) -> Lines:
    """Wilkinson's: the last column doubles at each step of partial pivoting."""
    a = np.eye(n) - np.tril(np.ones((n, n)), -1)
    a[:, -1] = 1
    return np.repeat(a[None] + 0j, lines, axis=0)


def _kahan(_: np.random.Generator, lines: int, n: int) -> Lines:
    c, s = 0.6, 0.8
    a = np.diag(s ** np.arange(n)) @ (np.eye(n) - c * np.triu(np.ones((n, n)), 1))
    return np.repeat(a[None] + 0j, lines, axis=0)


def _arrow(random: np.random.Generator, lines: int, n: int) -> Lines:
    a = np.zeros((lines, n, n), complex)
    a[:, np.arange(n), np.arange(n)] = 1 + random.random((lines, n))
    a[:, 0, :] = a[:, :, 0] = random.standard_normal((lines, n))
    return a


def _nearly_equal_rows(random: np.random.Generator, lines: int, n: int) -> Lines:
    a = _normal(random, lines, n)
    a[:, -1] = a[:, 0] * (1 + 1e-9 * random.standard_normal((lines, n)))
    return a


def _units(n: int) -> np.ndarray:
    """Displacements and rotations by turns: a thousand and more between their numbers."""
    return np.where(np.arange(n) % 2, 3e3, 1.0)


_Maker = Callable[[np.random.Generator, int, int], Lines]
#: 26 kinds; each makes lines of matrices of order n.
KINDS: dict[str, _Maker] = {
    "random": _normal,
    "real": lambda r, m, n: r.standard_normal((m, n, n)) + 0j,
    "imaginary": lambda r, m, n: 1j * r.standard_normal((m, n, n)),
    "symmetric": lambda r, m, n: (a := _normal(r, m, n)) + a.swapaxes(1, 2),
    "Hermitian positive": lambda r, m, n: (a := _normal(r, m, n)) @ a.conj().swapaxes(1, 2) + 0.1 * np.eye(n),
    "skew and damped": lambda r, m, n: (a := r.standard_normal((m, n, n))) - a.swapaxes(1, 2) + 0.1j * np.eye(n),
    "diagonal": lambda r, m, n: np.eye(n) * (r.standard_normal((m, 1, n)) + 0.3j),
    "nearly diagonal": lambda r, m, n: np.eye(n) + 1e-12 * _normal(r, m, n),
    "upper triangular": lambda r, m, n: np.triu(_normal(r, m, n)) + 3 * np.eye(n),
    "lower triangular": lambda r, m, n: np.tril(_normal(r, m, n)) + 3 * np.eye(n),
    "triangular, rows exchanged": lambda r, m, n: (np.triu(_normal(r, m, n)) + 3 * np.eye(n))[:, r.permutation(n)],
    "permutation": _permutation,
    "unitary": _unitary,
    "tridiagonal near resonance": _tridiagonal,
    "arrow": _arrow,
    "Hilbert": lambda r, m, n: np.repeat(1 / (np.add.outer(np.arange(n), np.arange(n)) + 1.0 + 0j)[None], m, axis=0),
    "Vandermonde": lambda r, m, n: r.uniform(0.5, 1.5, (m, n, 1)) ** np.arange(n) + 0j,
    "Kahan": _kahan,
    "growth": _growth,
    "zero diagonal": lambda r, m, n: _normal(r, m, n) * (1 - (np.eye(n) if n > 1 else 0)),
    "graded rows": lambda r, m, n: _normal(r, m, n) * (10.0 ** -np.linspace(0, 12, n))[:, None],
    "graded columns": lambda r, m, n: _normal(r, m, n) * 10.0 ** -np.linspace(0, 12, n),
    "displacements and rotations": lambda r, m, n: _normal(r, m, n) * np.outer(_units(n), _units(n)),
    "nearly singular": lambda r, m, n: _of_singular_values(r, m, np.r_[np.ones(n - 1), 1e-10 if n > 1 else 1.0]),
    "nearly equal rows": lambda r, m, n: _nearly_equal_rows(r, m, n) if n > 1 else _normal(r, m, n),
    "spread singular values": lambda r, m, n: _of_singular_values(r, m, 10.0 ** -np.linspace(0, 8, n)),
}  # fmt: skip


def matrices(kind: str, random: np.random.Generator, lines: int, n: int) -> Lines:
    """Return matrices of a kind, complex."""
    return np.ascontiguousarray(KINDS[kind](random, lines, n), complex)


_steps: list[np.random.Generator] = []


@contextmanager
def rounded(random: np.random.Generator) -> Iterator[None]:
    """Let each step of a reference change its inputs by rounding, relative to the largest number of the line."""
    _steps.append(random)
    try:
        yield
    finally:
        _steps.pop()


def _noise(a: Lines) -> Lines | float:
    if not _steps:
        return 0.0
    parts = _steps[-1].uniform(-1, 1, (2, *a.shape))
    return np.finfo(float).eps * abs(a).max(axis=(1, 2), keepdims=True) * (parts[0] + 1j * parts[1])


def solved(a: Lines, b: Lines) -> Lines:
    """Return A^-1 B of every line in long double, by Gauss-Jordan with complete pivoting.

    Within `rounded`, of A and B that are changed as a backward stable elimination in double precision changes them.
    """
    a, b = (each + _noise(each) for each in (np.array(a, LONG), np.array(b, LONG)))
    m, n = a.shape[:2]
    line, columns = np.arange(m), np.tile(np.arange(n), (m, 1))
    for step in range(n):
        rest = abs(a[:, step:, step:]).reshape(m, -1)
        row, column = np.unravel_index(rest.argmax(axis=1), (n - step, n - step))
        for array in (a, b):
            array[line, step], array[line, row + step] = array[line, row + step].copy(), array[line, step].copy()
        a[line, :, step], a[line, :, column + step] = a[line, :, column + step].copy(), a[line, :, step].copy()
        columns[line, step], columns[line, column + step] = (
            columns[line, column + step].copy(),
            columns[line, step].copy(),
        )
        with np.errstate(all="ignore"):
            factor = a[:, :, step] / a[:, step, step][:, None]
            factor[:, step] = 0
            b -= factor[:, :, None] * b[:, step][:, None, :]
            a -= factor[:, :, None] * a[:, step][:, None, :]
    with np.errstate(all="ignore"):
        b /= a[:, np.arange(n), np.arange(n)][:, :, None]
    x = np.empty_like(b)
    for i in range(n):
        x[line, columns[:, i]] = b[:, i]
    return x


def _identity(like: Lines) -> Lines:
    return np.broadcast_to(np.eye(like.shape[1], dtype=LONG), like.shape).copy()


def _inverse(a: Lines) -> Lines:
    return solved(a, _identity(a))


def _couple(a: Lines, b: Lines, k: Lines) -> Lines:
    """(2.26) with Y = K (1 + (H_a + H_b) K)^-1, which needs no inverse of K."""
    n = k.shape[1]
    h = a[:, :n, :n] + b[:, :n, :n]
    y = solved((_identity(k) + h @ k).swapaxes(1, 2), k.swapaxes(1, 2)).swapaxes(1, 2)
    left = np.concatenate([a[:, :, :n], -b[:, :, :n]], axis=1)
    right = np.concatenate([a[:, :n], -b[:, :n]], axis=2)
    whole = np.zeros((a.shape[0], left.shape[1], left.shape[1]), LONG)
    whole[:, : a.shape[1], : a.shape[1]] = a
    whole[:, a.shape[1] :, a.shape[1] :] = b
    return whole - left @ y @ right


def _modify(a: Lines, d: Lines) -> Lines:
    m = d.shape[1]
    middle = solved(_identity(d) + d @ a[:, :m, :m], d @ a[:, :m])
    return a - a[:, :, :m] @ middle


def _find_modification(a: Lines, g: Lines) -> Lines:
    return _inverse(g) - _inverse(a)


def _jk(a: Lines) -> Lines:
    n = a.shape[1] // 2
    return a[:, :n, n:]


#: Each operation in long double; arguments are lines of matrices, in the order in which `OPERATIONS` makes them.
REFERENCES: dict[str, Callable[..., Lines]] = {
    "invert": _inverse,
    "solve": solved,
    "couple": _couple,
    "modify": _modify,
    "find_modification": _find_modification,
    "ismm": lambda a, g, k: k - _jk(_find_modification(a, g)),
    "inverse_substructuring": lambda g: -_jk(_inverse(g)),
    "joint_compliance": lambda g: _inverse(-_jk(_inverse(g))),
    "decouple rr": lambda a, b, c: _decouple("rr", a, b, c),
    "decouple rs": lambda a, b, c: _decouple("rs", a, b, c),
    "decouple sr": lambda a, b, c: _decouple("sr", a, b, c),
    "decouple ss": lambda a, b, c: _decouple("ss", a, b, c),
    "transform": lambda h, t, u: t @ h @ u.swapaxes(1, 2),
    "receptance": lambda k, m: _inverse(k - OMEGA**2 * m.real + 1j * OMEGA * m.imag),
    "reciprocal_condition": lambda a: _reciprocal_condition(a),
    "compliance_factors u": lambda g, t: _factors(g, t)[0],
    "compliance_factors v": lambda g, t: _factors(g, t)[1],
    "compliance_covariance": lambda g, t, v: _covariance(*_factors(g, t), v),
    "compliance_covariance reciprocal": lambda g, t, v: _reciprocal_covariance(*_factors(g, t), v),
}
#: The sizes of the arguments of each, in units of the number of joint DOFs.
OPERATIONS: Mapping[str, tuple[int, ...]] = {
    "invert": (2,), "solve": (2, 2), "couple": (2, 2, 1), "modify": (2, 1), "find_modification": (2, 2),
    "ismm": (2, 2, 1), "inverse_substructuring": (2,), "joint_compliance": (2,), "decouple rr": (2, 2, 1),
    "decouple rs": (2, 2, 1), "decouple sr": (2, 2, 1), "decouple ss": (2, 2, 1), "transform": (2, 2, 2),
    "receptance": (2, 2), "reciprocal_condition": (2,), "compliance_factors u": (2, 2), "compliance_factors v": (2, 2),
    "compliance_covariance": (2, 2, 2), "compliance_covariance reciprocal": (2, 2, 2),
}  # fmt: skip


def _decouple(equation: str, a: Lines, b: Lines, c: Lines) -> Lines:
    """(2.53)-(2.56): C = H - L Y R, Y = (K^-1 + H_a + H_b)^-1; joint DOFs first, then those away from it."""
    n = c.shape[1]
    own = {"r": a, "s": b}
    left, right = (own[side] for side in equation)
    sign = 1 if equation[0] == equation[1] else -1
    difference = (own[equation[0]][:, n:, n:] if sign == 1 else 0) - c
    # L Y R = difference * sign, with L = left_ij and R = right_ji.
    y = solved(left[:, n:, :n], sign * difference)
    y = solved(right[:, :n, n:].swapaxes(1, 2), y.swapaxes(1, 2)).swapaxes(1, 2)
    # K = (Y^-1 - H_a - H_b)^-1 = Y (1 - (H_a + H_b) Y)^-1
    h = a[:, :n, :n] + b[:, :n, :n]
    return solved((_identity(y) - h @ y).swapaxes(1, 2), y.swapaxes(1, 2)).swapaxes(1, 2)


def _moduli(a: Lines) -> Lines:
    """The largest sum of |re| + |im| in a row of each line."""
    return (abs(a.real) + abs(a.imag)).sum(axis=2).max(axis=1)[:, None, None]


def _reciprocal_condition(a: Lines) -> Lines:
    with np.errstate(all="ignore"):
        return np.minimum(1, 1 / (_moduli(a) * _moduli(_inverse(a))))


def _factors(gamma: Lines, t: Lines) -> tuple[Lines, Lines]:
    """U = [g_kk g_jk^-1, -1] T and V = T^T [1; -g_jk^-1 g_jj], of dC = U dh V."""
    n = gamma.shape[1] // 2
    jj, jk, kk = gamma[:, :n, :n], gamma[:, :n, n:], gamma[:, n:, n:]
    one = _identity(jk)
    left = solved(jk.swapaxes(1, 2), kk.swapaxes(1, 2)).swapaxes(1, 2)
    right = solved(jk, jj)
    u = np.concatenate([left, -one], axis=2) @ t
    return u, t.swapaxes(1, 2) @ np.concatenate([one, -right], axis=1)


def _of_changes(change: Lines, variance: Lines) -> Lines:
    """The covariance of sum_pq W_ab,pq e_pq with E|e_pq|^2 = variance."""
    m, n = change.shape[:2]
    rows = change.reshape(m, n * n, -1)
    return (rows * variance.reshape(m, 1, -1)) @ rows.conj().swapaxes(1, 2)


def _covariance(u: Lines, v: Lines, variance: Lines) -> Lines:
    return _of_changes(np.einsum("lap,lqb->labpq", u, v), variance)


def _reciprocal_covariance(u: Lines, v: Lines, variance: Lines) -> Lines:
    w = np.einsum("lap,lqb->labpq", u, v)
    return _of_changes((w + w.swapaxes(3, 4)) / 2, variance)
