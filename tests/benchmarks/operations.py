"""The operations that are timed: their data, their least work, and how numpy and a plain loop do them.

The least work is that of the equation as the kernel's source names it, for general matrices (no symmetry), without
condition numbers; a complex multiplication and addition are eight operations. Bytes are those of arguments that are
needed and of the result, each moved once.
"""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from scipy import linalg

import jointfrf as jf

from .data import (
    Array,
    Data,
    coupled,
    frequencies,
    joint_stiffness,
    modal_receptance,
    noisy,
    random_lines,
    square,
)

_EPS = float(np.finfo(np.float64).eps)
#: A result may be this many times n eps away from the reference, times what the data themselves do to it.
_ROUNDING = 3e3
_SHAKE = 1e-10
#: Noise level of the operations that make noise.
_LEVEL = 0.05
_TINY_LEVEL = 1e-6
_REALISATIONS = 20
_COMPLEX = 16


@dataclass(frozen=True)
class Operation:
    """One operation.

    Attributes
    ----------
    name : str
    counts : str
        What n counts.
    flops, moved : callable
        Least floating-point operations and bytes of a line, by n.
    make : callable
        Data from the kind of data, the number of lines, and n.
    ours, numpy : callable
        Result from the data.
    loop : callable, optional
        Result of a bare loop over LAPACK, from the library and the data.
    routine : callable, optional
        Function of jointfrf that `ours` calls and that may take `out`.
    verify : callable, optional
        Check of a result that has no exact reference: data, result -> what is wrong, or nothing.
    kinds : tuple of str
        Kinds of data that make a difference.
    smallest : int
        Least n.
    copies : float
        Memory that numpy takes, in sizes of the arguments and the result.
    streams : bool
        Whether it is also timed with data that no cache holds.
    per_call : int
        Lines done for one line of the data.
    accuracy : float
        Error that a method may have beside rounding.
    normals : callable
        Complex normal numbers of a line that the kernel's generator makes, by n.
    """

    name: str
    counts: str
    flops: Callable[[int], float]
    moved: Callable[[int], float]
    make: Callable[[str, int, int], Data]
    ours: Callable[..., Array]
    numpy: Callable[[Data], Array]
    loop: Callable[[ctypes.CDLL, Data], Array] | None = None
    routine: Callable[..., object] | None = None
    verify: Callable[[Data, Array], str] | None = None
    kinds: tuple[str, ...] = ("frf", "random")
    smallest: int = 1
    copies: float = 3.0
    streams: bool = True
    per_call: int = 1
    accuracy: float = 0.0
    normals: Callable[[int], float] = lambda n: 0.0

    @property
    def takes_out(self) -> bool:
        """Whether the result can be put into an array that is there."""
        return self.routine is not None and "out" in inspect.signature(self.routine).parameters


class Reference:
    """The result by numpy, and how far from it a good result may be."""

    def __init__(self, operation: Operation, data: Data):
        self.operation, self.data = operation, data
        if operation.verify is None:
            self.result = operation.numpy(data)
            moved = _norm(operation.numpy(data.shaken(_SHAKE)) - self.result)
            # What a relative change of the data by eps does, and not less than eps itself.
            sensitivity = np.maximum(1, moved / _SHAKE / _norm(self.result))
            self.allowed = _ROUNDING * data.n * _EPS * sensitivity + operation.accuracy

    def fault(self, result: Array) -> str:
        """Return what is wrong with a result, whose lines may be those of the reference several times; or nothing."""
        if self.operation.verify is not None:
            return self.operation.verify(self.data, result)
        if np.median(self.allowed) > 1e-3:
            return "the data are too ill-conditioned for a check"
        if len(result) % len(self.result) or result.shape[1:] != self.result.shape[1:]:
            return f"shape {result.shape}"
        for first in range(0, len(result), len(self.result)):
            error = _norm(result[first : first + len(self.result)] - self.result) / _norm(self.result)
            bad = ~(error <= self.allowed)
            if bad.any():
                line = int(np.argmax(bad))
                return f"{bad.sum()} lines differ; line {first + line}: {error[line]:.1e} > {self.allowed[line]:.1e}"
        return ""


def _norm(h: Array) -> Array:
    result: Array = np.sqrt((h.real**2 + h.imag**2).reshape(len(h), -1).sum(axis=1))
    return result


# ---------------------------------------------------------------- data


def _inverse_data(kind: str, lines: int, n: int) -> Data:
    return Data(n, lines, {"a": square(kind, lines, n)})


def _solve_data(n_rhs: Callable[[int], int]) -> Callable[[str, int, int], Data]:
    def make(kind: str, lines: int, n: int) -> Data:
        b = random_lines(np.random.default_rng(1), lines, n, n_rhs(n))
        return Data(n, lines, {"a": square(kind, lines, n), "b": b})

    return make


def _joint_data(kind: str, lines: int, n: int) -> Data:
    """FRFs at the joint DOFs j and k of an assembly, with the first estimate of the joint and with the joint."""
    rng = np.random.default_rng(n)
    if kind == "random":
        alpha, gamma = (random_lines(rng, lines, 2 * n, 2 * n) for _ in range(2))
        return Data(n, lines, {"alpha": alpha, "gamma": gamma, "k": random_lines(rng, lines, n, n)})
    h_a, h_b = (modal_receptance(rng, lines, n) for _ in range(2))
    k = joint_stiffness(rng, h_a, n)
    alpha, gamma = coupled(h_a, h_b, k / 2), noisy(rng, coupled(h_a, h_b, k))
    return Data(n, lines, {"alpha": alpha, "gamma": gamma, "k": k / 2})


def _gamma_data(kind: str, lines: int, n: int) -> Data:
    return Data(n, lines, {"gamma": _joint_data(kind, lines, n)["gamma"]})


def _substructures(kind: str, lines: int, n: int) -> Data:
    """Two substructures, each with n joint DOFs and n internal ones, and the joint."""
    rng = np.random.default_rng(n)
    if kind == "random":
        h_a, h_b = (random_lines(rng, lines, 2 * n, 2 * n) for _ in range(2))
        return Data(n, lines, {"h_a": h_a, "h_b": h_b, "k": random_lines(rng, lines, n, n)})
    h_a, h_b = (noisy(rng, modal_receptance(rng, lines, 2 * n)) for _ in range(2))
    return Data(n, lines, {"h_a": h_a, "h_b": h_b, "k": joint_stiffness(rng, h_a, n)})


def _decouple_data(kind: str, lines: int, n: int) -> Data:
    parts = _substructures(kind, lines, n)
    h_a, h_b, k = parts["h_a"], parts["h_b"], parts["k"]
    z = np.eye(n) + k @ (h_a[:, :n, :n] + h_b[:, :n, :n])
    h_c = h_b[:, n:, n:] - h_b[:, n:, :n] @ np.linalg.solve(z, k @ h_b[:, :n, n:])
    return Data(n, lines, {"h_a": h_a, "h_b": h_b, "h_c": h_c})


def _points_data(kind: str, lines: int, n: int) -> Data:
    """Return FRFs of n triples of points 10 mm apart; displacement and slope at the middle of each are wanted."""
    weights = np.kron(np.eye(n), [[0.0, 1.0, 0.0], [-50.0, 0.0, 50.0]])
    return Data(n, lines, {"h": square(kind, lines, 3 * n)}, {"t": weights})


def _model_data(_kind: str, lines: int, n: int) -> Data:
    rng = np.random.default_rng(n)
    natural = np.sort(rng.uniform(2 * _frequency(0), _frequency(1), n))
    axes = np.linalg.qr(rng.standard_normal((n, n)))[0]
    stiffness = axes * (2 * np.pi * natural) ** 2 @ axes.T
    stiffness = (stiffness + stiffness.T) / 2
    return Data(n, lines, {"freq": frequencies(lines)}, {"k": stiffness, "m": np.eye(n), "c": 1e-6 * stiffness})


def _frequency(end: int) -> float:
    return float(frequencies(2)[end])


def _chain_data(_kind: str, lines: int, n: int) -> Data:
    k = 4e6 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    return Data(n, lines, {"freq": frequencies(lines)}, {"k": k, "m": np.eye(n), "c": 1e-6 * k})


def _long_chain_data(_kind: str, lines: int, n: int) -> Data:
    """Return a chain of 200 DOFs with a dozen modes in the band, whatever n."""
    total = 200
    k = 7e8 * (2 * np.eye(total) - np.eye(total, k=1) - np.eye(total, k=-1))
    return Data(n, lines, {"freq": frequencies(lines)}, {"k": k, "m": np.eye(total), "c": 1e-6 * k})


def _points(data: Data) -> Array:
    return np.linspace(0, len(data["k"]) - 1, data.n).round().astype(int)


def _noise_data(_kind: str, lines: int, n: int) -> Data:
    return Data(n, lines, {"h": square("frf", lines, n)})


# ---------------------------------------------------------------- how numpy does it


def _halves(h: Array) -> tuple[Array, Array, Array, Array]:
    n = h.shape[1] // 2
    return h[:, :n, :n], h[:, :n, n:], h[:, n:, :n], h[:, n:, n:]


def _numpy_ismm(data: Data) -> Array:
    alpha, gamma, n = data["alpha"], data["gamma"], data.n
    columns = np.linalg.solve(gamma, np.eye(2 * n, n, k=-n))
    return data["k"] - np.linalg.solve(alpha, (alpha - gamma) @ columns)[:, :n]


def _numpy_short(data: Data) -> Array:
    n = data.n
    return -np.linalg.solve(data["gamma"], np.eye(2 * n, n, k=-n, dtype=complex))[:, :n]


def _numpy_decouple(data: Data) -> Array:
    jj = data["h_a"][:, : data.n, : data.n]
    kk, ks, sk, ss = _halves(data["h_b"])
    return np.linalg.inv(ks @ np.linalg.solve(ss - data["h_c"], sk) - jj - kk)


def _numpy_compliance(data: Data) -> Array:
    jj, jk, kj, kk = _halves(data["gamma"])
    result: Array = kk @ np.linalg.solve(jk, jj) - kj
    return result


def _dynamic_stiffness(data: Data) -> Array:
    omega = 2 * np.pi * data["freq"][:, None, None]
    result: Array = (1 + 0.01j) * data["k"] + 1j * omega * data["c"] - omega**2 * data["m"]
    return result


def _numpy_banded(data: Data) -> Array:
    ends = np.zeros((data.n, 2))
    ends[0, 0] = ends[-1, 1] = 1
    return np.linalg.solve(_dynamic_stiffness(data), ends)[:, [0, -1]]


def _numpy_modal(data: Data) -> Array:
    squared, shapes = linalg.eigh(data["k"], data["m"])
    damping = np.einsum("ij,ij->j", shapes, data["c"] @ shapes)
    shapes = shapes[_points(data)]
    omega = 2 * np.pi * data["freq"][:, None]
    result: Array = (shapes / (squared * (1 + 0.01j) + 1j * omega * damping - omega**2)[:, None, :]) @ shapes.T
    return result


def _numpy_noise(data: Data) -> Array:
    h = data["h"]
    noise = np.random.default_rng(0).standard_normal((*h.shape, 2)).view(np.complex128)[..., 0]
    result: Array = h * (1 + _LEVEL / np.sqrt(2) * noise)
    return result


def _numpy_monte_carlo(data: Data) -> Array:
    gamma, n = data["gamma"], data.n
    noise = np.random.default_rng(0).standard_normal((_REALISATIONS, *gamma.shape, 2)).view(np.complex128)[..., 0]
    many = gamma * (1 + _TINY_LEVEL / np.sqrt(2) * noise)
    result: Array = -np.linalg.solve(many, np.eye(2 * n, n, k=-n, dtype=complex))[..., :n, :].mean(axis=0)
    return result


# ---------------------------------------------------------------- how jointfrf does it


def _receptance(data: Data, method: Literal["dense", "banded", "modal", "krylov"], **more: Any) -> Array:
    result: Array = jf.receptance(data["freq"], data["k"], data["m"], data["c"], 0.01, method=method, **more)
    return result


def _our_monte_carlo(data: Data) -> Array:
    result: Array = jf.monte_carlo(data["gamma"], _TINY_LEVEL, seed=1, count=_REALISATIONS).mean
    return result


def _our_difference(data: Data, **more: object) -> Array:
    if data.n == 1 and not more:
        return jf.central_difference(data["h"], 0.01)
    return jf.transform(data["h"], data["t"], data["t"], **more)  # type: ignore[arg-type]


def _numpy_difference(data: Data) -> Array:
    """Return what slices give, which is faster than products with weights that are mostly zero."""
    h, t = data["h"], data["t"]
    factor = t[1, 2]
    half = np.empty((len(h), t.shape[0], h.shape[2]), complex)
    half[:, 0::2] = h[:, 1::3]
    half[:, 1::2] = (h[:, 2::3] - h[:, 0::3]) * factor
    found = np.empty((len(h), t.shape[0], t.shape[0]), complex)
    found[..., 0::2] = half[..., 1::3]
    found[..., 1::2] = (half[..., 2::3] - half[..., 0::3]) * factor
    return found


# ---------------------------------------------------------------- the bare loop


def _loop_invert(library: ctypes.CDLL, data: Data) -> Array:
    a = data["a"]
    x = np.empty_like(a)
    assert library.loop_invert(data.n, data.lines, a.ctypes.data, x.ctypes.data) == 0
    return x


def _loop_solve(library: ctypes.CDLL, data: Data) -> Array:
    a, b = data["a"], data["b"]
    x = np.empty_like(b)
    pointers = (a.ctypes.data, b.ctypes.data, x.ctypes.data)
    assert library.loop_solve(data.n, b.shape[2], data.lines, *pointers) == 0
    return x


# ---------------------------------------------------------------- noise cannot be compared number by number


def _verify_noise(data: Data, result: Array) -> str:
    h = data["h"]
    times, n_numbers = len(result) // len(h), result.size
    e = (result.reshape(times, *h.shape) / h - 1) / _LEVEL
    size, mean, circular = (float(abs(number)) for number in ((abs(e) ** 2).mean(), e.mean(), (e**2).mean()))
    limit = 6 / np.sqrt(n_numbers)
    if abs(size - 1) > limit or mean > limit or circular > limit:
        return f"E|e|^2 = {size:.3f}, |E e| = {mean:.3f}, |E e^2| = {circular:.3f}, each within {limit:.3f}"
    return ""


def _verify_monte_carlo(data: Data, result: Array) -> str:
    exact = _numpy_short(data)
    moved = _norm(_numpy_short(data.shaken(_SHAKE)) - exact) / _SHAKE / _norm(exact)
    error = _norm(result - exact) / _norm(exact)
    # To first order the mean over so many realisations is this far from the exact one.
    limit = 20 * _TINY_LEVEL * np.maximum(1, moved) / np.sqrt(_REALISATIONS)
    if not (error <= limit).all():
        line = int(np.argmax(error / limit))
        return f"line {line}: {error[line]:.1e} > {limit[line]:.1e}"
    return ""


def _solve(name: str, counts: str, n_rhs: Callable[[int], int]) -> Operation:
    return Operation(
        name,
        counts,
        lambda n: 8 * (n**3 / 3 + n**2 * n_rhs(n)),
        lambda n: _COMPLEX * (n**2 + 2 * n * n_rhs(n)),
        _solve_data(n_rhs),
        lambda data, **more: jf.solve(data["a"], data["b"], **more),
        lambda data: np.linalg.solve(data["a"], data["b"]),
        _loop_solve,
        jf.solve,
    )


_MATRIX, _JOINT = "order of the matrix", "joint DOFs"
_MODEL = "DOFs of the model"

#: All operations, by name.
OPERATIONS: dict[str, Operation] = {
    operation.name: operation
    for operation in (
        Operation(
            "invert",
            _MATRIX,
            lambda n: 8 * n**3,
            lambda n: 2 * _COMPLEX * n**2,
            _inverse_data,
            lambda data, **more: jf.invert(data["a"], **more),
            lambda data: np.linalg.inv(data["a"]),
            _loop_invert,
            jf.invert,
        ),
        _solve("solve_1", f"{_MATRIX}, one right-hand side", lambda n: 1),
        _solve("solve_n", f"{_MATRIX}, n right-hand sides", lambda n: n),
        # Rows j of alpha^-1, columns k of gamma^-1 (LU of order 2 n, n unit vectors that are sorted last, back
        # substitution), and the two products of (2.47).
        Operation(
            "ismm",
            _JOINT,
            lambda n: 8 * n**3 * (2 * (8 / 3 + 1 / 2 + 2) + 4 + 2),
            lambda n: _COMPLEX * (2 * 4 + 1 + 1) * n**2,
            _joint_data,
            lambda data, **more: jf.ismm(data["alpha"], data["gamma"], data["k"], **more),
            _numpy_ismm,
            routine=jf.ismm,
            copies=4,
        ),
        # The block jk alone: two matrices of order n factored, each with n right-hand sides, and one product.
        Operation(
            "inverse_substructuring",
            _JOINT,
            lambda n: 8 * n**3 * (2 * (1 / 3 + 1) + 1),
            lambda n: _COMPLEX * (4 + 1) * n**2,
            _gamma_data,
            lambda data, **more: jf.inverse_substructuring(data["gamma"], **more),
            _numpy_short,
            routine=jf.inverse_substructuring,
        ),
        # H_jj + H_kk times K*, solved for K*, times n rows and 4 n columns (2.26).
        Operation(
            "couple",
            f"{_JOINT}; n internal ones on either side",
            lambda n: 8 * n**3 * (1 + 4 / 3 + 4 + 16),
            lambda n: _COMPLEX * (4 + 4 + 1 + 16) * n**2,
            _substructures,
            lambda data, **more: jf.couple(
                data["h_a"], data["h_b"], data["k"], np.arange(data.n), np.arange(data.n), **more
            ),
            lambda data: coupled(data["h_a"], data["h_b"], data["k"]),
            routine=jf.couple,
        ),
        # (2.56): solved, multiplied, inverted.
        Operation(
            "decouple",
            f"{_JOINT}; equation ss, n internal ones on either side",
            lambda n: 8 * n**3 * (4 / 3 + 1 + 1),
            lambda n: _COMPLEX * (1 + 4 + 1 + 1) * n**2,
            _decouple_data,
            lambda data, **more: jf.decouple(
                "ss",
                data["h_a"],
                data["h_b"],
                data["h_c"],
                np.arange(data.n),
                np.arange(data.n),
                dofs_s=np.arange(data.n, 2 * data.n),
                **more,
            ),
            _numpy_decouple,
            routine=jf.decouple,
        ),
        Operation(
            "joint_compliance",
            _JOINT,
            lambda n: 8 * n**3 * (4 / 3 + 1),
            lambda n: _COMPLEX * (4 + 1) * n**2,
            _gamma_data,
            lambda data, **more: jf.joint_compliance(data["gamma"], **more),
            _numpy_compliance,
            routine=jf.joint_compliance,
        ),
        # Of the transformation only what is not zero.
        Operation(
            "central_difference",
            "references, three points each",
            lambda n: 4 * (3 + 2) * n**2,
            lambda n: _COMPLEX * (9 + 4) * n**2,
            _points_data,
            _our_difference,
            _numpy_difference,
            routine=jf.transform,
        ),
        Operation(
            "receptance_dense",
            f"{_MODEL}, all n x n FRFs",
            lambda n: 8 * n**3 + 5 * n**2,
            lambda n: _COMPLEX * n**2,
            _model_data,
            lambda data, **more: _receptance(data, "dense", **more),
            lambda data: np.linalg.inv(_dynamic_stiffness(data)),
            routine=jf.receptance,
            kinds=("frf",),
            copies=6,
        ),
        # Tridiagonal, without row exchanges: factors, two right-hand sides, assembly.
        Operation(
            "receptance_banded",
            f"{_MODEL}, a chain; FRFs of its two ends",
            lambda n: n * (24 + 2 * 24 + 10),
            lambda n: _COMPLEX * 4,
            _chain_data,
            lambda data, **more: _receptance(data, "banded", outputs=[0, data.n - 1], inputs=[0, data.n - 1], **more),
            _numpy_banded,
            routine=jf.receptance,
            kinds=("frf",),
            smallest=2,
            streams=False,
        ),
        # Shapes are real: a complex number times a real one and an addition are four operations.
        Operation(
            "receptance_modal",
            f"{_MODEL}, all modes, all n x n FRFs",
            lambda n: 4 * n**3 + 8 * n**2,
            lambda n: _COMPLEX * n**2,
            _model_data,
            lambda data, **more: _receptance(data, "modal", **more),
            _numpy_modal,
            routine=jf.receptance,
            kinds=("frf",),
            copies=4,
        ),
        # The limit of this one and of the next knows the memory only.
        Operation(
            "receptance_krylov",
            "points of a chain of 200 DOFs, n x n FRFs",
            lambda n: 0,
            lambda n: _COMPLEX * n**2,
            _long_chain_data,
            lambda data, **more: _receptance(data, "krylov", outputs=_points(data), inputs=_points(data), **more),
            _numpy_modal,
            routine=jf.receptance,
            kinds=("frf",),
            copies=20,
            streams=False,
            accuracy=1e-6,
        ),
        # A product and a sum for each number.
        Operation(
            "noise",
            "order of the FRF matrix",
            lambda n: 8 * n**2,
            lambda n: 2 * _COMPLEX * n**2,
            _noise_data,
            lambda data, **more: jf.pollute(data["h"], _LEVEL, seed=1, **more),
            _numpy_noise,
            routine=jf.pollute,
            verify=_verify_noise,
            kinds=("frf",),
            normals=lambda n: n**2,
        ),
        Operation(
            "monte_carlo",
            f"{_JOINT}; {_REALISATIONS} realisations of noise, K* of each, their mean",
            lambda n: 8 * n**3 * (2 * (1 / 3 + 1) + 1),
            lambda n: _COMPLEX * 4 * n**2 / _REALISATIONS,
            _gamma_data,
            _our_monte_carlo,
            _numpy_monte_carlo,
            verify=_verify_monte_carlo,
            kinds=("frf",),
            streams=False,
            per_call=_REALISATIONS,
            normals=lambda n: 4 * n**2,
        ),
    )
}
