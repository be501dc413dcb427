"""Linear tests as an analyser makes them: time records of impacts or of random forces, windows, averages, H1.

The structure is simulated in time, mode by mode, by the exact recursion for a force that is constant over a sample, so
that leakage, windows and noise of the force are those of a measurement.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter


class TimeTest(NamedTuple):
    """A test of a linear structure: lines, Hz; receptances (n_freq, n_responses, n_forces); source of motion."""

    freq_hz: np.ndarray
    h: np.ndarray
    source: str


class _Modes(NamedTuple):
    """Natural frequencies, rad/s, damping ratios, and shapes at responses and forces, shape (n, n_modes)."""

    omega: np.ndarray
    damping: np.ndarray
    responses: np.ndarray
    forces: np.ndarray


def time_test(seed: int) -> TimeTest:
    """Return a test of a random linear structure, by impacts in two of three, else by a random force."""
    rng = np.random.default_rng([seed, 77])
    samples, rate = int(2 ** rng.integers(10, 13)), 1000.0
    n, band = int(rng.integers(3, 7)), (0.04 * rate, 0.36 * rate)
    responses, forces = int(rng.integers(3, 9)), int(rng.integers(1, 4))
    modes = _Modes(
        2 * np.pi * np.sort(rng.uniform(*band, n)), 10 ** rng.uniform(-2.5, -1.5, n),
        rng.standard_normal((responses, n)), rng.standard_normal((forces, n)),
    )  # fmt: skip
    averages, is_impact = int(rng.integers(2, 6)), rng.uniform() < 2 / 3
    noise = 10 ** rng.uniform(-3.3, -2), 10 ** rng.uniform(-3.3, -2)
    columns = [_h1(rng, modes, column, samples, averages, is_impact, noise, rate) for column in range(forces)]
    freq = np.fft.rfftfreq(samples, 1 / rate)
    kept = (freq > 0.02 * rate) & (freq < 0.4 * rate)
    return TimeTest(freq[kept], np.stack(columns, axis=2)[kept], "impact" if is_impact else "random force")


def _h1(
    rng: np.random.Generator,
    modes: _Modes,
    column: int,
    samples: int,
    averages: int,
    is_impact: bool,
    noise: tuple[float, float],
    rate: float,
) -> np.ndarray:
    """Return H1 of all responses to one force, shape (n_freq, n_responses), with a Hann window on both."""
    window = np.hanning(samples)
    cross, auto = 0.0, 0.0
    for _ in range(averages):
        force = _impact(rng, samples) if is_impact else rng.standard_normal(2 * samples)
        motion = _motion(modes, column, force, rate)[-samples:]
        force = force[-samples:]
        force = force + noise[0] * np.abs(force).max() * rng.standard_normal(samples)
        motion = motion + noise[1] * motion.std(axis=0) * rng.standard_normal(motion.shape)
        f, x = np.fft.rfft(window * force), np.fft.rfft(window[:, None] * motion, axis=0)
        cross, auto = cross + x * f.conj()[:, None], auto + np.abs(f) ** 2
    return cross / auto[:, None]


def _impact(rng: np.random.Generator, samples: int) -> np.ndarray:
    """A half sine of a few samples, somewhere in the first half of the record, where the window is not small."""
    force = np.zeros(samples)
    width, start = int(rng.integers(2, 5)), int(rng.uniform(0.15, 0.5) * samples)
    force[start : start + width] = rng.uniform(0.5, 2) * np.sin(np.pi * (np.arange(width) + 0.5) / width)
    return force


def _motion(modes: _Modes, column: int, force: np.ndarray, rate: float) -> np.ndarray:
    """Return displacements, shape (n_samples, n_responses): each mode by its recursion, step-invariant."""
    step, total = 1 / rate, np.zeros((force.size, len(modes.responses)))
    for omega, zeta, out, own in zip(modes.omega, modes.damping, modes.responses.T, modes.forces[column], strict=True):
        pole = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
        z, residue = np.exp(pole * step), 1 / (2j * pole.imag)
        # q[n + 1] = z q[n] + residue (z - 1) / pole f[n]; the displacement is twice its real part
        q = lfilter([0, residue * (z - 1) / pole], [1, -z], force)
        total += own * 2 * q.real[:, None] * out
    return total
