"""What is computed with: FRFs of modal models with noise, and random matrices."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

Array = np.ndarray

#: Noise of the FRFs; a matrix of exact ones is nearly singular between its resonances.
_NOISE = 0.01
_FIRST, _LAST = 10.0, 800.0  # Hz


@dataclass(frozen=True)
class Data:
    """Arguments of one operation.

    Attributes
    ----------
    n : int
        Order, as the operation counts it.
    lines : int
        Frequency lines.
    sweeps : dict of str to ndarray
        Arrays with one matrix or number a line.
    fixed : dict of str to ndarray
        Arrays without lines.
    """

    n: int
    lines: int
    sweeps: dict[str, Array]
    fixed: dict[str, Array] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        return self.sweeps[name] if name in self.sweeps else self.fixed[name]

    def repeated(self, times: int) -> Data:
        """Return the same lines several times in a row."""
        sweeps = {name: np.tile(array, (times, *[1] * (array.ndim - 1))) for name, array in self.sweeps.items()}
        return replace(self, lines=self.lines * times, sweeps=sweeps)

    def shaken(self, size: float) -> Data:
        """Return the arguments with every number changed by this share of itself, at random."""
        rng = np.random.default_rng(7)

        def shake(array: Array) -> Array:
            return array * (1 + size * rng.standard_normal(array.shape))

        return replace(
            self,
            sweeps={name: shake(array) for name, array in self.sweeps.items()},
            fixed={name: shake(array) for name, array in self.fixed.items()},
        )


def random_lines(rng: np.random.Generator, lines: int, rows: int, columns: int) -> Array:
    """Return complex normal matrices."""
    return rng.standard_normal((lines, rows, 2 * columns)).view(np.complex128)


def frequencies(lines: int) -> Array:
    """Return the frequency lines, Hz."""
    return np.linspace(_FIRST, _LAST, lines)


def modal_receptance(rng: np.random.Generator, lines: int, n: int) -> Array:
    """Return the receptance of a structure with a few more modes than the points need, some above the band."""
    modes = 2 * n + 4
    natural = np.sort(rng.uniform(2 * _FIRST, 1.3 * _LAST, modes))
    loss = rng.uniform(0.005, 0.02, modes)
    shapes = rng.standard_normal((modes, n))
    squared = (2 * np.pi * natural) ** 2
    factors = 1 / (squared * (1 + 1j * loss) - (2 * np.pi * frequencies(lines)[:, None]) ** 2)
    pairs = (shapes[:, :, None] * shapes[:, None, :]).reshape(modes, n * n)
    return (factors @ pairs).reshape(lines, n, n)


def noisy(rng: np.random.Generator, h: Array, level: float = _NOISE) -> Array:
    """Return FRFs with circular noise relative to each entry."""
    result: Array = h * (1 + level / np.sqrt(2) * random_lines(rng, *h.shape))
    return result


def coupled(h_a: Array, h_b: Array, k_joint: Array) -> Array:
    """Couple A and B at the first DOFs of both (2.26), all blocks."""
    n, n_a, n_b = k_joint.shape[1], h_a.shape[1], h_b.shape[1]
    z = np.eye(n) + k_joint @ (h_a[:, :n, :n] + h_b[:, :n, :n])
    to = np.concatenate([h_a[:, :, :n], -h_b[:, :, :n]], axis=1)
    into = np.concatenate([h_a[:, :n, :], -h_b[:, :n, :]], axis=2)
    h = -to @ (np.linalg.solve(z, k_joint) @ into)
    h[:, :n_a, :n_a] += h_a
    h[:, n_a:, n_a:] += h_b
    assert h.shape[1] == n_a + n_b
    result: Array = h
    return result


def joint_stiffness(rng: np.random.Generator, h: Array, n: int) -> Array:
    """Return a joint about as stiff as the structure, with some damping, shape (lines, n, n)."""
    scale = 1 / np.median(abs(np.diagonal(h, axis1=1, axis2=2)))
    cross = rng.uniform(-0.1, 0.1, (n, n))
    damping = 1 + 0.1j * np.linspace(0.1, 1, len(h))[:, None, None]
    result: Array = scale * (np.eye(n) + (cross + cross.T) / 2) * damping
    return result


def square(kind: str, lines: int, n: int) -> Array:
    """Return matrices to invert."""
    rng = np.random.default_rng(n)
    return random_lines(rng, lines, n, n) if kind == "random" else noisy(rng, modal_receptance(rng, lines, n))
