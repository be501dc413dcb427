"""Tests whose intervals were several times wider than the errors: rotors, impacts off axis, coupled joints.

    tests/accuracy/run widths                        all trials, 40 draws each
    tests/accuracy/run widths "off axis" --draws 10  trials whose name has this word

Timoshenko beams in two planes, with masses, gyroscopic moments and joint written here, without the package. Draw i of
trial t, counted from 0 in the order of the table, has the seed [t, i, 51].
"""

from __future__ import annotations

import argparse
import itertools
import time
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import lru_cache, partial
from typing import Any

import impacts
import numpy as np
from hammer import Draw, result_row
from scipy import linalg

import jointfrf as jf

STEEL = 210e9, 0.3, 7850.0


def _element(length: float, area: float, inertia: float, material: tuple[float, float, float]) -> tuple[Any, Any]:
    """Stiffness and mass of an element with axial motion: x, y and slope at both ends."""
    e, _, rho = material
    bending = impacts.timoshenko(length, area, inertia, material)
    k, m = np.zeros((2, 6, 6))
    along, across = [0, 3], [1, 2, 4, 5]
    k[np.ix_(along, along)] = e * area / length * np.array([[1, -1], [-1, 1]])
    m[np.ix_(along, along)] = rho * area * length / 6 * np.array([[2, 1], [1, 2]])
    k[np.ix_(across, across)], m[np.ix_(across, across)] = bending
    return k, m


def _line(points: np.ndarray, area: float, inertia: float, stiff: np.ndarray, material=STEEL) -> tuple[Any, Any]:
    """Stiffness and mass of a frame through points of a plane, elements marked as 1e4 times as stiff are blocks."""
    n = 3 * len(points)
    k, m = np.zeros((2, n, n))
    for i, (a, b) in enumerate(itertools.pairwise(points)):
        length = float(np.linalg.norm(b - a))
        c, s = (b - a) / length
        turn = linalg.block_diag(*[np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])] * 2)
        own = _element(length, area, inertia, material)
        at = slice(3 * i, 3 * i + 6)
        k[at, at] += turn.T @ own[0] @ turn * (1e4 if stiff[i] else 1.0)
        m[at, at] += turn.T @ own[1] @ turn
    return k, m


def _receptance(freq: np.ndarray, k, c, m, joint: tuple[Any, Any, Any], rows: np.ndarray) -> np.ndarray:
    """FRFs between rows of DOFs; the joint (pairs, stiffness, damping) by the static pairs it connects."""
    pairs, of_k, of_c = joint
    k, c = k + pairs.T @ of_k @ pairs, c + pairs.T @ of_c @ pairs
    w = 2 * np.pi * freq
    found = np.empty((freq.size, len(rows), len(rows)), complex)
    for i, one in enumerate(w):
        found[i] = rows @ np.linalg.solve(k + 1j * one * c - one**2 * m, rows.T)
    return found


@lru_cache(maxsize=8)
def spindle(rpm: float, damping: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return lines and FRFs of a shaft in two bearings with a tool holder on its nose: x, y and slopes at the joint."""
    spin, parts = rpm * np.pi / 30, []
    for length, diameter, count in ((0.4, 0.06, 16), (0.15, 0.045, 6)):
        area, inertia = np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
        k = np.zeros((2 * count + 2,) * 2)
        m, polar = np.zeros_like(k), np.zeros(count + 1)
        for i in range(count):
            own, at = impacts.timoshenko(length / count, area, inertia, STEEL), slice(2 * i, 2 * i + 4)
            k[at, at] += own[0]
            m[at, at] += own[1]
            polar[i : i + 2] += STEEL[2] * 2 * inertia * length / count / 2
        parts.append((k, m, polar))
    k, m, polar = (
        linalg.block_diag(*one) if one[0].ndim == 2 else np.concatenate(one) for one in zip(*parts, strict=True)
    )
    n, c = len(k), 2e-6 * damping * k
    nose = 2 * 16
    disc = nose + 2 + 4  # a flange on the tool holder, and the rotor of the motor
    for at, kg, radius in ((disc, 1.2, 0.05), (14, 2.5, 0.05)):
        m[at, at] += kg
        m[at + 1, at + 1] += kg * radius**2 / 4
        polar[at // 2] += kg * radius**2 / 2
    both_k, both_c, both_m = (linalg.block_diag(one, one) for one in (k, c, m))
    slopes = np.arange(1, n, 2)
    both_c[slopes, n + slopes] += spin * polar
    both_c[n + slopes, slopes] -= spin * polar
    for at, stiffness in ((6, 1.2e8), (26, 2e8)):
        for plane in (0, n):
            both_k[plane + at, plane + at] += stiffness
            both_c[plane + at, plane + at] += 1200.0 * damping
    ends = [nose, n + nose, nose + 1, n + nose + 1]
    rows = np.eye(2 * n)[ends + [one + 2 for one in ends]]
    pairs = rows[:4] - rows[4:]
    joint = pairs, np.diag(SPINDLE_K), np.diag(SPINDLE_C)
    freq = np.arange(60.0, 1500.0, 2.0)
    return freq, _receptance(freq, both_k, both_c, both_m, joint, rows)


SPINDLE_K, SPINDLE_C = (8e7, 8e7, 3e5, 3e5), (1500.0, 1500.0, 8.0, 8.0)
FRAME_K, FRAME_C = (3e7, 1.5e7, 2e4), (300.0, 200.0, 0.6)
#: Points of each side, m from the joint, on a block; x and y at each.
POINTS = (0.0, 0.04)


def _stiffness(cross: float) -> np.ndarray:
    """Return K with cross terms of a share of the geometric means of its diagonal."""
    size = np.sqrt(np.outer(FRAME_K, FRAME_K))
    return np.diag(FRAME_K) + cross * size * np.array([[0, 1, -0.7], [1, 0, 0.85], [-0.7, 0.85, 0]])


@lru_cache(maxsize=8)
def frame(cross: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return lines and FRFs of a bent frame and a beam: x, y, rotation at the joint, and x, y of two points a side.

    With `cross` the joint has terms between all DOFs, this share of the geometric means of the diagonal.
    """
    width, height = 0.03, 0.015
    area, inertia = width * height, width * height**3 / 12
    # The first frame stands on the ground, and goes round a corner of 70 degrees to the joint.
    a = np.array([np.linspace(0, 0.2, 11), np.zeros(11)]).T
    way = np.array([np.cos(1.2), np.sin(1.2)])
    first = np.vstack([a, a[-1] + np.linspace(0, 0.18, 10)[1:, None] * way])
    second = first[-1] + np.linspace(0, 0.22, 12)[:, None] * np.array([np.cos(0.4), np.sin(0.4)])
    ka, ma = _line(first, area, inertia, np.arange(len(first) - 1) >= len(first) - 3)
    kb, mb = _line(second, area, inertia, np.arange(len(second) - 1) < 2)
    ka[:3, :3] += np.diag([1e10, 1e10, 1e7])
    k, m = linalg.block_diag(ka, kb), linalg.block_diag(ma, mb)
    end, n = len(ka), len(k)
    every = np.eye(n)
    # Blocks: two elements of 20 mm next to the joint.
    joint_rows = every[[end - 3, end - 2, end - 1, end, end + 1, end + 2]]
    points = every[[end - 3, end - 2, end - 9, end - 8, end, end + 1, end + 6, end + 7]]
    freq = np.arange(40.0, 1600.0, 2.0)
    joint = joint_rows[:3] - joint_rows[3:], _stiffness(cross), np.diag(FRAME_C)
    return freq, _receptance(freq, k, 2e-6 * k + 12 * m, m, joint, np.vstack([joint_rows, points]))


def _transform() -> np.ndarray:
    """Return the least-squares inverse of the rigid motion of the eight channels of the frame."""
    ways = -np.array([np.cos(1.2), np.sin(1.2)]), np.array([np.cos(0.4), np.sin(0.4)])
    blocks = []
    for way in ways:
        rows = []
        for distance in POINTS:
            x, y = distance * way
            rows += [[1, 0, -y], [0, 1, x]]
        blocks.append(np.linalg.pinv(np.array(rows)))
    return linalg.block_diag(*blocks)


def _noisy(h: np.ndarray, rng: np.random.Generator, level: float, floor: float = 0.0) -> np.ndarray:
    noise = (rng.standard_normal((2, *h.shape, 2)) @ [1, 1j]) / np.sqrt(2)
    return h * (1 + level * noise[0]) + floor * np.median(abs(h), axis=0) * noise[1]


def _of_spindle(
    rng: np.random.Generator, rpm: float, level: float, floor: float, damping: float = 1.0
) -> tuple[Any, ...]:
    freq, h = spindle(rpm, damping)
    truth = dict(zip(SPINDLE_NAMES, (*SPINDLE_K, *SPINDLE_C), strict=True))
    return freq, _noisy(h, rng, level, floor), ("x", "y", "theta_y", "theta_x"), truth, {"reciprocal": False}


def _off_axis(rng: np.random.Generator, low: float, high: float, level: float) -> tuple[Any, ...]:
    freq, h = frame()
    angle = np.deg2rad(rng.uniform(low, high, 8)) * rng.choice([-1, 1], 8)
    # An impact along x has a part along y of the same point, and the other way round.
    turned = np.array([1, 0, 3, 2, 5, 4, 7, 6])
    own = h[:, 6:, 6:]
    own = own * np.cos(angle) + own[:, :, turned] * np.sin(angle)
    return freq, _noisy(own, rng, level), ("x", "y", "theta"), _of_frame(), {"transform": _transform()}


def _coupled(rng: np.random.Generator, cross: float, level: float, *, fitted: bool = False) -> tuple[Any, ...]:
    freq, h = frame(cross)
    # Of a joint whose cross terms are not sought, k is 1/C_dd of the compliance.
    truth = _of_frame()
    if not fitted:
        omega = 2 * np.pi * freq[:, None]
        inverse = np.linalg.inv(_stiffness(cross) + 1j * omega[..., None] * np.diag(FRAME_C))
        found = 1 / np.einsum("ldd->ld", inverse)
        k, c = found.real.mean(axis=0), (found.imag / omega).mean(axis=0)
        truth = dict(zip(truth, (*k, *c), strict=True))
    return freq, _noisy(h[:, :6, :6], rng, level), ("x", "y", "theta"), truth, {"cross": "fit"} if fitted else {}


SPINDLE_NAMES = ("k_x", "k_y", "k_theta_y", "k_theta_x", "c_x", "c_y", "c_theta_y", "c_theta_x")


def _of_frame() -> dict[str, float]:
    return dict(zip(("k_x", "k_y", "k_theta", "c_x", "c_y", "c_theta"), (*FRAME_K, *FRAME_C), strict=True))


@dataclass(frozen=True)
class Trial:
    """A kind of test: a function of a generator to lines, FRFs, DOFs, true parameters, options of `identify`."""

    name: str
    test: Callable[[np.random.Generator], tuple[Any, ...]]
    options: dict[str, Any] = field(default_factory=dict)


TRIALS = (
    Trial("spindle, 18 000 rpm, relative noise of 1 %", partial(_of_spindle, rpm=18e3, level=0.01, floor=0.0)),
    Trial("spindle, 18 000 rpm, floor of 1 %", partial(_of_spindle, rpm=18e3, level=0.0, floor=0.01)),
    Trial("spindle, little damping, floor of 1 %",
          partial(_of_spindle, rpm=18e3, level=0.0, floor=0.01, damping=0.1)),
    Trial("frame, relative noise of 1 %", partial(_coupled, cross=0.0, level=0.01)),
    Trial("frame, relative noise of 0.2 %", partial(_coupled, cross=0.0, level=0.002)),
    Trial("frame, relative noise of 1 %, reciprocal=False", partial(_coupled, cross=0.0, level=0.01),
          {"reciprocal": False}),
    Trial("frame, impacts 2 to 4 degrees off axis", partial(_off_axis, low=2, high=4, level=0.005)),
    Trial("frame, impacts 0.3 to 1 degrees off axis", partial(_off_axis, low=0.3, high=1, level=0.005)),
    Trial("frame, impacts on axis", partial(_off_axis, low=0, high=0, level=0.005)),
    Trial("frame, cross terms of 1.5 %", partial(_coupled, cross=0.015, level=0.005)),
    Trial("frame, cross terms of 3 %", partial(_coupled, cross=0.03, level=0.005)),
    Trial("frame, cross terms of 3 %, cross fitted", partial(_coupled, cross=0.03, level=0.005, fitted=True)),
)  # fmt: skip


def one_draw(trial: Trial, place: int, number: int) -> Draw:
    """Return a draw, or the sentence of the error that ended it."""
    freq, h, dofs, truth, options = trial.test(np.random.default_rng([place, number, 51]))
    begin = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            fit = jf.identify(freq, h, dofs, **{"damping": "viscous"} | options | trial.options)
        except ValueError as error:
            return Draw((), (), (), (), time.process_time() - begin, str(error))
    return Draw.of(fit, truth, time.process_time() - begin)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("words", nargs="*")
    parser.add_argument("--draws", type=int, default=40)
    parser.add_argument("--workers", type=int, default=None, help="processes; one a core by default")
    options = parser.parse_args()
    print("| test | fits | RMSE, % | inside their 95 % intervals, % | half width / 1.96 RMSE, largest, median | "
          "announced | silent misses | warnings | s a fit |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|")
    with ProcessPoolExecutor(options.workers) as pool:
        for place, trial in enumerate(TRIALS):
            if not options.words or any(word in trial.name for word in options.words):
                draws = list(pool.map(partial(one_draw, trial, place), range(options.draws)))
                print(result_row(trial.name, draws, largest=True), flush=True)


if __name__ == "__main__":
    main()
