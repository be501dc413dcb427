"""Trials of the compliance fit: assemblies with a known joint, and noise as measurements have it."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import jointfrf as jf
from six_dof_beams import FREQ, FULL, JOINT, assembly

__all__ = ["NOISES", "SIZES", "TRIALS", "System", "Trial", "running_mean", "system"]


@dataclass(frozen=True)
class System:
    """FRFs of an assembly at its joint, and the joint."""

    freq_hz: np.ndarray
    gamma: np.ndarray
    joint: jf.Joint


#: Share of a stiffness that hysteretic damping has.
_LOSS = 0.05


def _damped(joint: jf.Joint, kind: str) -> jf.Joint:
    """The same stiffness with damping of another kind."""
    viscous = joint.damping if kind in ("viscous", "both") else None
    hysteretic = _LOSS * joint.stiffness if kind in ("hysteretic", "both") else None
    return jf.Joint(joint.stiffness, viscous, joint.dofs, structural_damping=hysteretic)


def _chains(_: float, kind: str) -> System:
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start")
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end")
    freq = np.linspace(0.5, 10, 951)
    joint = _damped(jf.Joint([2000.0], [3.0], ["x"]), kind)
    h_a, h_b = a.receptance(freq, [1]), b.receptance(freq, [0])
    return System(freq, jf.couple(h_a, h_b, joint.dynamic_stiffness(freq), [0], [0]), joint)


def _beams(freq: np.ndarray, elements: tuple[int, int], factor: float, kind: str) -> System:
    section = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
    a = jf.beam(0.3, elements[0], ends=("clamped", "free"), **section)
    b = jf.beam(0.225, elements[1], **section)
    joint = jf.Joint(np.array([6e5, 5e3]) * factor, np.array([20, 1.5]) * factor, ["y", "theta"])
    if kind.startswith(("free", "pin")):
        # theta has no stiffness, and y of a pin is rigid; no DOF has damping where it is "undamped".
        k, c = (1e11, 0.0) if kind.startswith("pin") else (6e5, 20.0)
        joint = jf.Joint([k, 0.0], [0.0, 0.0] if "undamped" in kind else [c, 0.1], ["y", "theta"])
    else:
        joint = _damped(joint, kind)
    tip = str(elements[0] + 1)
    h_a = a.receptance(freq, a.index(f"{tip}:y", f"{tip}:theta"))
    h_b = b.receptance(freq, b.index("1:y", "1:theta"))
    return System(freq, jf.couple(h_a, h_b, joint.dynamic_stiffness(freq), [0, 1], [0, 1]), joint)


def _six(_: float, kind: str) -> System:
    joint = _damped(JOINT, kind)
    return System(FREQ, assembly(joint), joint)


def _full(_: float, kind: str) -> System:
    freq = FREQ[::2]
    return System(freq, assembly(FULL, freq), FULL)


@cache
def _two_bolts() -> dict[str, Any]:
    return runpy.run_path(str(Path(__file__).resolve().parents[2] / "cases" / "two-bolts" / "make.py"))


def _bolts(share: float) -> System:
    case = _two_bolts()
    joint = case["joint"]({"bolt1": 1.0, "bolt2": share})
    return System(case["FREQ_HZ"], case["exact"](joint), joint)


_SYSTEMS: dict[str, Callable[[float, str], System]] = {
    "3.1": _chains,
    "3.2": lambda factor, kind: _beams(np.arange(15.0, 900.5, 2.0), (2, 1), factor, kind),
    "3.3": lambda factor, kind: _beams(np.arange(15.0, 801.0), (12, 9), factor, kind),
    "six DOFs": _six,
    "full 6 x 6": _full,
    "two bolts": lambda factor, kind: _bolts(0.7),
    "two equal bolts": lambda factor, kind: _bolts(1.0),
}


@cache
def system(name: str, factor: float = 1.0, kind: str = "viscous") -> System:
    """One of the assemblies; the joint `factor` times as stiff, its damping of this kind."""
    return _SYSTEMS[name](factor, kind)


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


def _by_entry(gamma: np.ndarray, _: np.ndarray) -> np.ndarray:
    n = gamma.shape[1]
    of_entry: np.ndarray = 4.0 ** (((3 * np.arange(n)[:, None] + 5 * np.arange(n)) % 7) / 3 - 1)
    return of_entry * gamma


def _hum(gamma: np.ndarray, freq_hz: np.ndarray) -> np.ndarray:
    spacing = np.diff(freq_hz).min()
    near = abs(freq_hz - 50 * np.round(freq_hz / 50)) < spacing / 2
    size = np.where(near & (freq_hz > 25), 100.0, 1.0)[:, None, None]
    return size * gamma


def _one_direction(gamma: np.ndarray, _: np.ndarray) -> np.ndarray:
    """Noise of FRFs below the diagonal that is 8/0.3 times that of those above: other sensors, other hammers."""
    return np.where(np.tri(gamma.shape[1], dtype=bool), 1.0, 0.3 / 8) * gamma


def _rising(gamma: np.ndarray, freq_hz: np.ndarray) -> np.ndarray:
    share = (freq_hz - freq_hz[0]) / (freq_hz[-1] - freq_hz[0])
    return 100.0 ** (share[:, None, None] - 1) * gamma


def _in_accelerance(gamma: np.ndarray, freq_hz: np.ndarray) -> np.ndarray:
    squared = (freq_hz**2)[:, None, None]
    return np.median(abs(gamma) * squared, axis=0) / squared


#: Independent circular noise: its size in each FRF for a level of 1, up to a phase, by exact FRFs and frequencies.
SIZES: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "complex": lambda g, f: g,
    "floor": lambda g, f: np.broadcast_to(_floor(g), g.shape),
    "mixed": lambda g, f: np.hypot(abs(g), _floor(g)),
    "by entry": _by_entry,
    "hum at multiples of 50 Hz": _hum,
    "a fifth of the lines missing": lambda g, f: g,
    "0.3 % in one direction": _one_direction,
    "rising 100-fold": _rising,
    "constant in accelerance": _in_accelerance,
}
_OTHERS: dict[str, Callable[[np.random.Generator, np.ndarray, float, np.ndarray], np.ndarray]] = {
    "real": lambda rng, g, level, f: level * g * rng.standard_normal(g.shape),
    "uniform": lambda rng, g, level, f: level * g * rng.uniform(-np.sqrt(3), np.sqrt(3), g.shape),
    "correlated over 5 lines": lambda rng, g, level, f: running_mean(5)(rng, g, level),
    "correlated over 25 lines": lambda rng, g, level, f: running_mean(25)(rng, g, level),
}
NOISES = (*SIZES, *_OTHERS)


@dataclass(frozen=True)
class Trial:
    """One row of the table; `damping` is what `identify` is given, `kind` the truth."""

    system: str
    noise: str
    level: float
    factor: float = 1.0
    step: int = 1
    cross: str = "zero"
    damping: str = "viscous"
    kind: str = "viscous"
    same: tuple[str, ...] | None = None

    @property
    def name(self) -> str:
        """How the table calls it."""
        words = [self.system, f"{100 * self.level:g} %", self.noise]
        if self.factor != 1:
            words.append(f"joint x{self.factor:g}")
        if self.step != 1:
            words.append(f"{self.exact.freq_hz.size} lines")
        if self.system.startswith("two"):
            words.append("equal" if self.same else "each its own")
        elif self.damping != "viscous" or self.kind != "viscous":
            words.append(f"damping {self.damping}, truth {self.kind}")
        return ", ".join(words)

    @property
    def exact(self) -> System:
        """What is polluted."""
        own = system(self.system, self.factor, self.kind)
        return System(own.freq_hz[:: self.step], own.gamma[:: self.step], own.joint)

    def draw(self, seed: int) -> tuple[np.ndarray, np.ndarray, jf.Joint]:
        """Frequencies, polluted FRFs and the joint of one draw."""
        freq, gamma, joint = self.exact.freq_hz, self.exact.gamma, self.exact.joint
        rng = np.random.default_rng([seed, len(self.name)])
        if self.noise in SIZES:
            polluted = gamma + self.level * SIZES[self.noise](gamma, freq) * _circular(rng, gamma.shape)
        else:
            polluted = gamma + _OTHERS[self.noise](rng, gamma, self.level, freq)
        if "missing" in self.noise:
            kept = np.sort(rng.permutation(freq.size)[: int(0.8 * freq.size)])
            freq, polluted = freq[kept], polluted[kept]
        return freq, polluted, joint


def _trials() -> dict[str, list[Trial]]:
    levels_of = {"0.3 % in one direction": 0.08, "rising 100-fold": 0.1}
    kinds = [Trial("3.3", noise, levels_of.get(noise, 0.02)) for noise in NOISES]
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
    few = [Trial("3.3", "complex", 0.05, step=step) for step in (400, 300, 160, 80, 49, 40, 26, 20)]
    few += [Trial("3.3", noise, 0.02, step=26) for noise in ("by entry", "floor", "0.3 % in one direction")]
    damping = [
        Trial(name, "complex", level, damping="auto", kind=kind)
        for name, level in (("3.1", 0.05), ("3.3", 0.01), ("3.3", 0.05))
        for kind in ("none", "viscous", "hysteretic", "both")
    ]
    free = [
        Trial("3.3", "complex", level, damping=damping, kind=kind)
        for level in (0.01, 0.05)
        for damping, kind in (
            ("viscous", "free"),
            ("none", "free, undamped"),
            ("auto", "free"),
            ("auto", "pin"),
            ("none", "pin, undamped"),
        )
    ]
    return {
        "bound": [
            *[Trial(name, "complex", 0.05) for name in ("3.1", "3.2", "3.3")],
            *[Trial("six DOFs", "complex", level) for level in (0.01, 0.03, 0.05)],
            *[Trial("full 6 x 6", "complex", level, cross="fit") for level in (0.01, 0.03, 0.05)],
        ],
        "levels": levels,
        "kinds": [*kinds, Trial("six DOFs", "0.3 % in one direction", 0.08), Trial("six DOFs", "floor", 0.02)],
        "stiff": stiff,
        "few": few,
        "damping": damping,
        "free": free,
        "points": [
            Trial(name, "complex", 0.01, cross="points", damping="hysteretic", kind="hysteretic", same=same)
            for name, same in (("two bolts", None), ("two equal bolts", ("bolt1", "bolt2")))
        ],
    }


#: All trials, by the part of the table.
TRIALS = _trials()
