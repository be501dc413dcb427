"""Coupling many bodies at once, beside the best forms in numpy; and what it costs for more bodies. Prints two tables.

Bodies are random matrices of stiffness and mass with 20 DOFs; each is connected by six DOFs with the next in a ring,
some across it. Times are the least of many, all forms in turn, on as many threads as each takes by itself; with
--processor-time, for a machine that does other work, too, those of the processor, on one thread (OMP_NUM_THREADS=1,
OPENBLAS_NUM_THREADS=1).
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import jointfrf as jf

_DOFS, _LINK, _LINES = 20, 6, 200


@dataclass
class Sample:
    """Bodies in a ring, with links across it; for numpy the DOFs of all rows, and those of each body."""

    freq: np.ndarray
    bodies: dict[str, jf.FreeBody]
    links: list[jf.BodyLink]
    plus: np.ndarray
    minus: np.ndarray


def sample(n_bodies: int, across: int) -> Sample:
    """Bodies connected in a ring and, `across` times, with the body half round it."""
    rng = np.random.default_rng(n_bodies)
    freq = np.linspace(10.0, 500.0, _LINES)
    omega = 2 * np.pi * freq[:, None, None]
    bodies = {}
    for i in range(n_bodies):
        root = rng.standard_normal((_DOFS, _DOFS))
        stiffness = 1e5 * root @ root.T + 1e6 * np.eye(_DOFS)
        mass = np.diag(rng.uniform(1, 3, _DOFS))
        bodies[f"b{i}"] = jf.FreeBody(
            np.linalg.inv(stiffness * (1 + 0.02j) - omega**2 * mass), list(map(str, range(_DOFS)))
        )
    pairs = [(i, (i + 1) % n_bodies) for i in range(n_bodies if n_bodies > 2 else n_bodies - 1)]
    pairs += [(i, i + n_bodies // 2) for i in range(across)]
    links, used = [], dict.fromkeys(range(n_bodies), 0)
    for pair in pairs:
        root = rng.standard_normal((_LINK, _LINK))
        ends = []
        for body in pair:
            ends.append([f"b{body}/{used[body] + k}" for k in range(_LINK)])
            used[body] += _LINK
        links.append(jf.BodyLink(jf.Joint(1e5 * root @ root.T, 10.0 * np.eye(_LINK)), *ends))
    place = {f"b{i}/{k}": i * _DOFS + k for i in range(n_bodies) for k in range(_DOFS)}
    plus, minus = (np.array([place[dof] for link in links for dof in side(link)])
                   for side in (lambda one: one.first, lambda one: one.second))  # fmt: skip
    return Sample(freq, bodies, links, plus, minus)


def numpy_dense(one: Sample) -> Callable[[], np.ndarray]:
    """One block-diagonal matrix of all bodies."""
    n = _DOFS * len(one.bodies)
    h = np.zeros((_LINES, n, n), complex)
    for i, body in enumerate(one.bodies.values()):
        own = slice(i * _DOFS, (i + 1) * _DOFS)
        h[:, own, own] = body.h
    stiffness, eye = _stiffness(one), np.eye(one.plus.size)

    def compute() -> np.ndarray:
        rows = h[:, one.plus] - h[:, one.minus]
        between = rows[:, :, one.plus] - rows[:, :, one.minus]
        force = np.linalg.solve(eye + stiffness @ between, stiffness) @ rows
        return h - (h[:, :, one.plus] - h[:, :, one.minus]) @ force

    return compute


def numpy_blocks(one: Sample) -> Callable[[], np.ndarray]:
    """Products of each body with the rows it has a part in only."""
    h = [np.ascontiguousarray(body.h) for body in one.bodies.values()]
    q, n = one.plus.size, _DOFS * len(h)
    stiffness = _stiffness(one)
    each = []
    for i in range(len(h)):
        rows = np.flatnonzero((one.plus // _DOFS == i) | (one.minus // _DOFS == i))
        is_plus = one.plus[rows] // _DOFS == i
        each.append(
            (rows, np.where(is_plus, one.plus[rows], one.minus[rows]) - i * _DOFS, np.where(is_plus, 1.0, -1.0))
        )

    def compute() -> np.ndarray:
        between, force = np.zeros((_LINES, q, q), complex), np.empty((_LINES, q, n), complex)
        taken = []
        for own, (rows, dofs, sign) in zip(h, each, strict=True):
            across = own[:, dofs] * sign[:, None]
            taken.append((across, own[:, :, dofs] * sign))
            between[:, rows[:, None], rows] += across[:, :, dofs] * sign
        left = np.empty_like(between)
        for first in range(0, q, _LINK):
            own_rows = slice(first, first + _LINK)
            left[:, own_rows] = stiffness[:, own_rows, own_rows] @ between[:, own_rows]
        left[:, range(q), range(q)] += 1
        w = np.linalg.solve(left, stiffness)
        for i, (rows, _, _) in enumerate(each):
            np.matmul(w[:, :, rows], taken[i][0], out=force[:, :, i * _DOFS : (i + 1) * _DOFS])
        found = np.empty((_LINES, n, n), complex)
        for i, (rows, _, _) in enumerate(each):
            np.matmul(taken[i][1], force[:, rows], out=found[:, i * _DOFS : (i + 1) * _DOFS])
        np.negative(found, out=found)
        for i, own in enumerate(h):
            at = slice(i * _DOFS, (i + 1) * _DOFS)
            found[:, at, at] += own
        return found

    return compute


def _stiffness(one: Sample) -> np.ndarray:
    whole = np.zeros((_LINES, one.plus.size, one.plus.size), complex)
    for i, link in enumerate(one.links):
        own = slice(i * _LINK, (i + 1) * _LINK)
        whole[:, own, own] = link.joint.dynamic_stiffness(one.freq)
    return whole


def least(forms: dict[str, Callable[[], np.ndarray]], rounds: int, clock: Callable[[], float]) -> dict[str, float]:
    """Least time of each form in turn, microseconds a line."""
    found = dict.fromkeys(forms, np.inf)
    for _ in range(rounds):
        for name, form in forms.items():
            start = clock()
            form()
            found[name] = min(found[name], 1e6 * (clock() - start) / _LINES)
    return found


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--processor-time", action="store_true")
    options = parser.parse_args()
    rounds, clock = options.rounds, time.process_time if options.processor_time else time.perf_counter
    ten = sample(10, 2)
    forms = {
        "jointfrf": lambda: jf.couple_bodies(ten.freq, ten.bodies, ten.links),
        "numpy, one block-diagonal matrix": numpy_dense(ten),
        "numpy, products body by body": numpy_blocks(ten),
    }
    results = {name: form() for name, form in forms.items()}
    for name, own in results.items():
        assert np.allclose(own, results["jointfrf"], rtol=0, atol=1e-10 * abs(own).max()), name
    times = least(forms, rounds, clock)
    print("10 bodies of 20 DOFs, 12 connections of 6 DOFs, all 200 x 200 FRFs\n")
    print("| form | µs a line | times jointfrf |\n|---|---|---|")
    for name, own in times.items():
        print(f"| {name} | {own:.0f} | {own / times['jointfrf']:.1f} |")
    print("\n| bodies | connections | all FRFs, µs a line | 6 x 6 FRFs, µs a line |\n|---|---|---|---|")
    for count in (2, 5, 10, 20, 40):
        one = sample(count, 0)
        some = [f"b0/{k}" for k in range(6)]
        timed = least(
            {
                "all": lambda one=one: jf.couple_bodies(one.freq, one.bodies, one.links),
                "some": lambda one=one, some=some: jf.couple_bodies(one.freq, one.bodies, one.links, some, some),
            },
            max(3, rounds // 4),
            clock,
        )
        print(f"| {count} | {len(one.links)} | {timed['all']:.0f} | {timed['some']:.0f} |")


if __name__ == "__main__":
    main()
