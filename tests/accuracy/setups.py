"""Simulated tests in several set-ups: how often the intervals of the joint hold. Prints the table of docs/accuracy.md.

Two beams, joined at three points by springs and dampers, FRFs between all six joint DOFs, 1 % noise of each FRF by
itself. Set-ups are hits (a roving hammer) or sensors (which are moved, with their mass), shared out at random; each has
a gain of its own, and all have one that no FRF shows and that is known to its standard deviation. Draw i of row r, from
0, has the seed [r, i, 33].
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial

import numpy as np

import jointfrf as jf

FREQ = np.arange(15.0, 801.0)
DOFS = ("y1", "y2", "y3")
TRUE = jf.Joint([6e5, 3e5, 1e5], [20.0, 15.0, 10.0], DOFS)
LEVEL = 0.01


@dataclass(frozen=True)
class Test:
    """A row: number of set-ups, what moves, gains of each and of all, mass of a sensor, kg, whether gains are said."""

    setups: int
    roving: str = "hits"
    own: float = 0.01
    common: float = 0.0
    mass: float = 0.0
    said: bool = False


def tests() -> Iterator[Test]:
    """What is simulated."""
    for setups in (2, 3, 6):
        for own in (0.0, 0.003, 0.01, 0.02):
            yield Test(setups, own=own)
        yield Test(setups, "sensors")
        yield Test(setups, own=0.01, said=True)
        yield Test(setups, own=0.01, common=0.01)
        for mass in (1e-4, 3e-4):
            yield Test(setups, "sensors", mass=mass)


@cache
def exact() -> np.ndarray:
    """FRFs between the joint DOFs."""
    section = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
    a, b = jf.beam(0.4, 16, ends=("clamped", "free"), **section), jf.beam(0.3, 12, **section)
    h_a = a.receptance(FREQ, a.index("5:y", "11:y", "17:y"))
    h_b = b.receptance(FREQ, b.index("1:y", "7:y", "13:y"))
    return jf.couple(h_a, h_b, TRUE.dynamic_stiffness(FREQ), [0, 1, 2], [0, 1, 2])


def loaded(h: np.ndarray, at: np.ndarray, mass: float) -> np.ndarray:
    """FRFs of the structure with a mass at each of some channels."""
    added = -((2 * np.pi * FREQ[:, None, None]) ** 2) * mass * np.eye(at.size)
    return h - h[:, :, at] @ np.linalg.solve(np.eye(at.size) + added @ h[:, at][:, :, at], added @ h[:, at])


def drawn(one: Test, row: int, number: int) -> tuple[np.ndarray, jf.SetUps]:
    """Return the FRFs of one draw and their set-ups."""
    rng = np.random.default_rng([row, number, 33])
    h, of = np.empty_like(exact()), np.empty((6, 6), int)
    for setup, own in enumerate(np.array_split(rng.permutation(6), one.setups)):
        of[own] = setup
        base = loaded(exact(), own, one.mass) if one.mass else exact()
        h[:, own] = base[:, own] * (1 + one.own * rng.standard_normal())
    if one.roving == "hits":  # of a reciprocal structure
        of, h = of.T, np.ascontiguousarray(h.swapaxes(1, 2))
    h *= 1 + one.common * rng.standard_normal()
    h = jf.pollute(h, LEVEL, seed=int(rng.integers(2**31)))
    names = [f"set-up {number + 1}" for number in range(one.setups)]
    return h, jf.SetUps(names, of, gain=one.own if one.said else None, common_gain=one.common)


def fitted(one: Test, row: int, number: int) -> jf.Fit:
    """Return the fit of one draw."""
    h, setups = drawn(one, row, number)
    return jf.identify(FREQ, h, DOFS, damping="viscous", setups=setups)


def one_draw(one: Test, row: int, number: int) -> tuple[dict[str, float], dict[str, tuple[float, float]], bool, float]:
    """Return values, intervals, whether the residual is noise, and seconds of one draw."""
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = fitted(one, row, number)
        interval = fit.confidence_interval(0.95)
    return fit.value, interval, bool(fit.residual_is_noise), time.process_time() - start


HEAD = (
    "| set-ups | of | gains of each | gain of all | sensor | coverage of 95 %: k, lowest .. highest, mean | c | half "
    "width / RMSE of k, c, median | RMSE of k, median, % | not noise | s a fit |\n"
    "|---|---|---|---|---|---|---|---|---|---|---|"
)


def line(one: Test, draws: list[tuple[dict[str, float], dict[str, tuple[float, float]], bool, float]]) -> str:
    """Return a line of the table."""
    inside, ratio, errors = [], [], []
    truth = {f"{kind}_{dof}": value for kind, of in (("k", TRUE.stiffness), ("c", TRUE.damping))
             for dof, value in zip(DOFS, np.diagonal(of), strict=True)}  # fmt: skip
    for name, true in truth.items():
        low, high = np.array([interval[name] for _, interval, *_ in draws]).T
        rmse = float(np.sqrt(np.mean([(value[name] - true) ** 2 for value, *_ in draws])))
        inside.append(100 * float(((low <= true) & (true <= high)).mean()))
        ratio.append(float(np.median(high - low)) / 2 / rmse)
        errors.append(100 * rmse / true)
    held = [f"{min(own):.0f} .. {max(own):.0f}, {np.mean(own):.1f}" for own in (inside[:3], inside[3:])]
    said = ", said" if one.said else ""
    return (
        f"| {one.setups} | {one.roving} | {100 * one.own:g} %{said} | {100 * one.common:g} % | {1e3 * one.mass:g} g | "
        f"{held[0]} | {held[1]} | {np.median(ratio[:3]):.1f}, {np.median(ratio[3:]):.1f} | "
        f"{np.median(errors[:3]):.2g} | "
        f"{sum(not is_noise for _, _, is_noise, _ in draws)} | {np.median([draw[3] for draw in draws]):.2g} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--rows", default="", help="numbers of rows from 0, with commas; all by default")
    parser.add_argument("--workers", type=int, default=1)
    args = parser.parse_args()
    wanted = {int(row) for row in args.rows.split(",") if row}
    print(HEAD, flush=True)
    with ProcessPoolExecutor(args.workers) as pool:
        for row, one in enumerate(tests()):
            if not wanted or row in wanted:
                print(line(one, list(pool.map(partial(one_draw, one, row), range(args.draws)))), flush=True)


if __name__ == "__main__":
    main()
