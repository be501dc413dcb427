"""Trials of the compliance fit: assemblies with a known joint, and noise as measurements have it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

import jointfrf as jf
from six_dof_beams import DOFS, FREQ, JOINT, assembly

__all__ = ["NOISES", "TRIALS", "System", "Trial", "running_mean", "system"]


@dataclass(frozen=True)
class System:
    """FRFs of an assembly at its joint, and the joint."""

    freq_hz: np.ndarray
    gamma: np.ndarray
    joint: jf.Joint


def _chains(_: float) -> System:
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start")
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end")
    freq = np.linspace(0.5, 10, 951)
    joint = jf.Joint([2000.0], [3.0], ["x"])
    h_a, h_b = a.receptance(freq, [1]), b.receptance(freq, [0])
    return System(freq, jf.couple(h_a, h_b, joint.dynamic_stiffness(freq), [0], [0]), joint)


def _beams(freq: np.ndarray, elements: tuple[int, int], factor: float) -> System:
    section = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
    a = jf.beam(0.3, elements[0], ends=("clamped", "free"), **section)
    b = jf.beam(0.225, elements[1], **section)
    joint = jf.Joint(np.array([6e5, 5e3]) * factor, np.array([20, 1.5]) * factor, ["y", "theta"])
    tip = str(elements[0] + 1)
    h_a = a.receptance(freq, a.index(f"{tip}:y", f"{tip}:theta"))
    h_b = b.receptance(freq, b.index("1:y", "1:theta"))
    return System(freq, jf.couple(h_a, h_b, joint.dynamic_stiffness(freq), [0, 1], [0, 1]), joint)


def _six(_: float) -> System:
    return System(FREQ, assembly(), JOINT)


def _full(_: float) -> System:
    def whole(diagonal: np.ndarray, seed: int) -> np.ndarray:
        mixed = np.random.default_rng(seed).standard_normal((6, 24))
        product = mixed @ mixed.T
        size = np.sqrt(np.outer(diagonal, diagonal) / np.outer(product.diagonal(), product.diagonal()))
        return product * size

    joint = jf.Joint(whole(JOINT.stiffness.diagonal(), 1), whole(JOINT.damping.diagonal(), 2), DOFS)
    freq = FREQ[::2]
    return System(freq, assembly(joint, freq), joint)


_SYSTEMS: dict[str, Callable[[float], System]] = {
    "3.1": _chains,
    "3.2": lambda factor: _beams(np.arange(15.0, 900.5, 2.0), (2, 1), factor),
    "3.3": lambda factor: _beams(np.arange(15.0, 801.0), (12, 9), factor),
    "six DOFs": _six,
    "full 6 x 6": _full,
}


@cache
def system(name: str, factor: float = 1.0) -> System:
    """One of the assemblies; the joint `factor` times as stiff."""
    return _SYSTEMS[name](factor)


def _circular(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def running_mean(lines: int) -> Callable[[np.random.Generator, np.ndarray, float], np.ndarray]:
    """Noise that is the running mean of independent noise over so many lines."""

    def noise(rng: np.random.Generator, gamma: np.ndarray, level: float) -> np.ndarray:
        drawn = _circular(rng, (len(gamma) + lines - 1, *gamma.shape[1:]))
        sums = np.cumsum(np.concatenate([np.zeros((1, *gamma.shape[1:])), drawn]), axis=0)
        return level * gamma * (sums[lines:] - sums[:-lines]) / np.sqrt(lines)

    return noise


def _floor(gamma: np.ndarray) -> np.ndarray:
    return np.median(abs(gamma), axis=0)


def _by_entry(rng: np.random.Generator, gamma: np.ndarray, level: float) -> np.ndarray:
    n = gamma.shape[1]
    of_entry = 4.0 ** (((3 * np.arange(n)[:, None] + 5 * np.arange(n)) % 7) / 3 - 1)
    return level * of_entry * gamma * _circular(rng, gamma.shape)


def _hum(rng: np.random.Generator, gamma: np.ndarray, level: float, freq_hz: np.ndarray) -> np.ndarray:
    spacing = np.diff(freq_hz).min()
    near = abs(freq_hz - 50 * np.round(freq_hz / 50)) < spacing / 2
    size = np.where(near & (freq_hz > 25), 100.0, 1.0)[:, None, None]
    return level * size * gamma * _circular(rng, gamma.shape)


#: Noise of FRFs by its kind: a function of a generator, the exact FRFs, the level and the frequencies.
NOISES: dict[str, Callable[[np.random.Generator, np.ndarray, float, np.ndarray], np.ndarray]] = {
    "complex": lambda rng, g, level, f: level * g * _circular(rng, g.shape),
    "real": lambda rng, g, level, f: level * g * rng.standard_normal(g.shape),
    "uniform": lambda rng, g, level, f: level * g * rng.uniform(-np.sqrt(3), np.sqrt(3), g.shape),
    "floor": lambda rng, g, level, f: level * _floor(g) * _circular(rng, g.shape),
    "mixed": lambda rng, g, level, f: level * (g * _circular(rng, g.shape) + _floor(g) * _circular(rng, g.shape)),
    "by entry": lambda rng, g, level, f: _by_entry(rng, g, level),
    "correlated over 5 lines": lambda rng, g, level, f: running_mean(5)(rng, g, level),
    "correlated over 25 lines": lambda rng, g, level, f: running_mean(25)(rng, g, level),
    "hum at multiples of 50 Hz": _hum,
    "a fifth of the lines missing": lambda rng, g, level, f: level * g * _circular(rng, g.shape),
}


@dataclass(frozen=True)
class Trial:
    """One row of the table."""

    system: str
    noise: str
    level: float
    factor: float = 1.0
    step: int = 1
    cross: str = "zero"

    @property
    def name(self) -> str:
        """How the table calls it."""
        words = [self.system, f"{100 * self.level:g} %", self.noise]
        if self.factor != 1:
            words.append(f"joint x{self.factor:g}")
        if self.step != 1:
            words.append(f"{system(self.system).freq_hz[:: self.step].size} lines")
        return ", ".join(words)

    def draw(self, seed: int) -> tuple[np.ndarray, np.ndarray, jf.Joint]:
        """Frequencies, polluted FRFs and the joint of one draw."""
        own = system(self.system, self.factor)
        rng = np.random.default_rng([seed, len(self.name)])
        freq, gamma = own.freq_hz[:: self.step], own.gamma[:: self.step]
        polluted = gamma + NOISES[self.noise](rng, gamma, self.level, freq)
        if "missing" in self.noise:
            kept = np.sort(rng.permutation(freq.size)[: int(0.8 * freq.size)])
            freq, polluted = freq[kept], polluted[kept]
        return freq, polluted, own.joint


def _trials() -> dict[str, list[Trial]]:
    kinds = [Trial("3.3", noise, 0.02) for noise in NOISES]
    levels = [Trial("3.3", "complex", level) for level in (0.005, 0.01, 0.05, 0.1)]
    stiff = [
        Trial("3.3", "complex", level, factor)
        for factor, level in [
            (10, 0.05),
            (100, 0.05),
            (300, 0.01),
            (300, 0.05),
            (1e3, 0.01),
            (1e3, 0.05),
            (1e4, 0.01),
            (1e5, 0.01),
        ]
    ]
    few = [Trial("3.3", "complex", 0.05, step=step) for step in (300, 160, 80, 40)]
    return {
        "bound": [
            *[Trial(name, "complex", 0.05) for name in ("3.1", "3.2", "3.3")],
            *[Trial("six DOFs", "complex", level) for level in (0.01, 0.03, 0.05)],
            *[Trial("full 6 x 6", "complex", level, cross="fit") for level in (0.01, 0.03, 0.05)],
        ],
        "levels": levels,
        "kinds": kinds,
        "stiff": stiff,
        "few": few,
    }


#: All trials, by the part of the table.
TRIALS = _trials()
