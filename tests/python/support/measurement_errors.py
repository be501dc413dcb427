"""FRFs as measurements give them: structures, noise of many kinds, and errors of channels, each by its name."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

import jointfrf as jf
import six_dof_beams
from jointfrf.cases.catalogue import find_case, read_case
from jointfrf.cases.known_joint.exact import exact_frfs


class Structure(NamedTuple):
    """FRFs at the joint without noise: DOFs j, then k."""

    freq: np.ndarray
    gamma: np.ndarray
    dofs: tuple[str, ...]


@cache
def structure(name: str) -> Structure:
    """One of the cases "3.1", "3.2", "3.3", or "six": the beams of `six_dof_beams`."""
    if name == "six":
        return Structure(six_dof_beams.FREQ, six_dof_beams.assembly(), six_dof_beams.DOFS)
    exact = exact_frfs(read_case(find_case(name)))
    gamma = exact.interface(exact.h_c)
    return Structure(exact.freq_hz, gamma, exact.dofs)


def circular(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Complex normal numbers, E|e|^2 = 1."""
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def correlated(rng: np.random.Generator, shape: tuple[int, ...], over: int) -> np.ndarray:
    """The same, each the mean of as many neighbouring lines, scaled to E|e|^2 = 1."""
    white = circular(rng, (shape[0] + over - 1, *shape[1:]))
    summed = np.cumsum(np.concatenate([np.zeros((1, *shape[1:]), complex), white]), axis=0)
    return (summed[over:] - summed[:-over]) / np.sqrt(over)


def hum(freq: np.ndarray) -> np.ndarray:
    """100 on the line nearest to each multiple of a sixteenth of the highest frequency (50 Hz below 800 Hz), else 1."""
    base = 50.0 if freq[-1] > 100 else freq[-1] / 16
    factor = np.ones(freq.size)
    for multiple in np.arange(base, freq[-1], base):
        factor[np.argmin(abs(freq - multiple))] = 100.0
    return factor


def floor(h: np.ndarray) -> np.ndarray:
    """Median modulus of each entry over frequency, shape (1, n, n)."""
    return np.median(abs(h), axis=0, keepdims=True)


Noise = Callable[[np.random.Generator, np.ndarray, np.ndarray, float], np.ndarray]
#: Noise by its name: from a generator, frequencies, FRFs and a level, what is added to the FRFs.
NOISE: dict[str, Noise] = {
    "complex": lambda rng, f, h, level: level * h * circular(rng, h.shape),
    "real": lambda rng, f, h, level: level * h * rng.standard_normal(h.shape),
    "uniform": lambda rng, f, h, level: level * h * rng.uniform(-1, 1, h.shape),
    "floor": lambda rng, f, h, level: level * floor(h) * circular(rng, h.shape),
    "mixed": lambda rng, f, h, level: level * (abs(h) + floor(h)) * circular(rng, h.shape),
    "by entry": lambda rng, f, h, level: level * h * rng.uniform(0.1, 2, h.shape[1:]) * circular(rng, h.shape),
    "correlated 5": lambda rng, f, h, level: level * h * correlated(rng, h.shape, 5),
    "correlated 25": lambda rng, f, h, level: level * h * correlated(rng, h.shape, 25),
    "hum": lambda rng, f, h, level: level * hum(f)[:, None, None] * h * circular(rng, h.shape),
}


def measured(s: Structure, kind: str, level: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and noisy FRFs; "missing": complex noise, and a fifth of the lines is not there."""
    rng = np.random.default_rng([seed, sum(map(ord, kind))])
    if kind == "missing":
        kept = rng.random(s.freq.size) > 0.2
        h = s.gamma[kept]
        return s.freq[kept], h + NOISE["complex"](rng, s.freq[kept], h, level)
    return s.freq, s.gamma + NOISE[kind](rng, s.freq, s.gamma, level)
