"""Steady vibration of a beam with a Jenkins joint under a constant force: the truth of tests.

An independent route: Hermite elements, and one equation for the amplitude of the first harmonic on each line. Nothing
here comes from jointfrf.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import brentq

#: Trial amplitudes of the search for balances, from the least to the largest linear one, and a factor beyond both.
TRIALS, BEYOND = 1600, 50.0


class States(NamedTuple):
    """What stepped sines show: receptances (n_freq, 4), and the peak relative rotation (n_freq,)."""

    h: np.ndarray
    rotation: np.ndarray


@dataclass(frozen=True)
class Jenkins:
    """A spring next to a spring in series with a slider; stiffness in N m/rad, slip in rad."""

    parallel: float
    slider: float
    slip: float

    def secant(self, amplitude: np.ndarray) -> np.ndarray:
        """Return the first harmonic of the moment over the amplitude of a sine, in closed form."""
        a = np.maximum(amplitude, self.slip)
        turn = np.arccos(1 - 2 * self.slip / a)
        real = self.parallel + self.slider / np.pi * (turn - np.sin(2 * turn) / 2)
        return real + 4j * self.slider * self.slip * (a - self.slip) / (np.pi * a**2)


class JenkinsBeam:
    """Two free halves of 360 mm and 24 elements, steel, 25.4 mm square, tied in y; they turn through the joint."""

    def __init__(self, joint: Jenkins, moduli: tuple[float, float] = (210e9, 210e9), loss: float = 0.001) -> None:
        side, n, a = 0.0254, 24, 0.36 / 24
        self.joint = joint
        bending = np.array([[12, 6 * a, -12, 6 * a], [6 * a, 4 * a**2, -6 * a, 2 * a**2],
                            [-12, -6 * a, 12, -6 * a], [6 * a, 2 * a**2, -6 * a, 4 * a**2]]) / a**3  # fmt: skip
        inertia = np.array([[156, 22 * a, 54, -13 * a], [22 * a, 4 * a**2, 13 * a, -3 * a**2],
                            [54, 13 * a, 156, -22 * a], [-13 * a, -3 * a**2, -22 * a, 4 * a**2]]) * a / 420  # fmt: skip
        whole = np.zeros((2, 2 * (n + 1), 2 * (n + 1)))
        for e in range(n):
            own = slice(2 * e, 2 * e + 4)
            whole[:, own, own] += bending, inertia
        of_bending, of_inertia = side**4 / 12 * whole[0], 7850.0 * side**2 * whole[1]
        half = len(of_bending)
        tie = np.eye(2 * half)
        tie[half, half - 2] = 1.0  # y of the first node of B is y of the last one of A
        tie = np.delete(tie, half, axis=1)
        self.k = tie.T @ block_diag(*(e * of_bending for e in moduli)) @ tie * (1 + 1j * loss)
        self.m = tie.T @ block_diag(of_inertia, of_inertia) @ tie
        at = np.eye(2 * half) @ tie
        self.across = at[half - 1] - at[half + 1]
        self.channels = at[[0, 28, half + 16, 2 * half - 2]]

    def at_force(self, freq_hz: np.ndarray, force: float) -> States:
        """Return the states of a rising sweep under a force of this peak value, N."""
        columns = np.column_stack([self.channels[0], self.across]).astype(complex)
        rows = np.vstack([self.channels, self.across])
        h, rotation, last = [], [], None
        for omega in 2 * np.pi * freq_hz:
            y = rows @ np.linalg.solve(self.k - omega**2 * self.m, columns)
            a = self._rotation(abs(y[-1, 0]) * force, y[-1, 1], last)
            k = self.joint.secant(a)
            h.append(y[:-1, 0] - y[:-1, 1] * k * y[-1, 0] / (1 + k * y[-1, 1]))
            rotation.append(a)
            last = a
        return States(np.array(h), np.array(rotation))

    def _rotation(self, free: float, across: complex, last: float | None) -> float:
        """Return the amplitude a with a |1 + K(a) Y| = |free motion|; of several, the nearest to the last line."""

        def off(x: float) -> float:
            return float(np.log(abs(1 + self.joint.secant(np.exp(x)) * across)) + x - np.log(free))

        ends = [free / abs(1 + k * across) for k in (self.joint.parallel, self.joint.parallel + self.joint.slider)]
        x = np.linspace(np.log(min(ends) / BEYOND), np.log(max(ends) * BEYOND), TRIALS)
        value = np.log(abs(1 + self.joint.secant(np.exp(x)) * across)) + x - np.log(free)
        found = [brentq(off, x[i], x[i + 1], xtol=1e-13) for i in np.flatnonzero(np.diff(np.sign(value)))]
        start = np.log(ends[1] if last is None else last)
        return float(np.exp(min(found, key=lambda one: abs(one - start))))
