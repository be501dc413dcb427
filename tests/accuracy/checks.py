"""How often `jf.check_frfs` finds errors of channels, and how often it finds some where there are none.

checks [--seeds N] [--false-seeds N] [--jobs N] [--only channels | points]

Prints the tables of docs/checks.md in Markdown: of channels that are joint DOFs, seeds 0 to N - 1 of numpy's generator,
together with the kind of noise; and of virtual points (`simulated_tests`), seeds from 1000 for faults, from 2000 for
tests without.
"""

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "support"))

import jointfrf as jf
from measurement_errors import ERRORS, KINDS_OF_NOISE, check_with_error, measured, names, structure
from simulated_tests import BODIES, FAULTS, check_with_fault, simulated_test

STRUCTURES = ("3.1", "3.2", "3.3", "six")
LEVELS = (0.005, 0.02, 0.05, 0.1)
#: Noise of the table of detection.
NOISES = (
    ("complex", 0.005),
    ("complex", 0.05),
    ("complex", 0.1),
    ("floor", 0.05),
    ("hum", 0.02),
    ("correlated 25", 0.05),
)


def false_alarms(task: tuple[str, str, float, int]) -> int:
    """Number of data sets without an error in which something is found."""
    name, kind, level, seeds = task
    s = structure(name)
    found = 0
    for seed in range(seeds):
        freq, h = measured(s, kind, level, seed)
        found += not jf.check_frfs(freq, h, names(s)).ok
    return found


def detections(task: tuple[str, str, str, float, int]) -> tuple[int, int, int]:
    """Numbers of data sets, of those where the error is found with its channel, and where nothing else is."""
    error, name, kind, level, seeds = task
    results = [check_with_error(structure(name), ERRORS[error], kind, level, seed) for seed in range(seeds)]
    reported = [result for result in results if result is not None]
    return (
        len(reported),
        sum(result.found for result in reported),
        sum(result.found and result.alone for result in reported),
    )


def points_with_fault(task: tuple[str, int]) -> tuple[str, int, bool, bool]:
    """Whether a fault on virtual points is named, and whether nothing else is said."""
    name, seed = task
    found = check_with_fault(name, seed)
    return name, seed, found.named, found.findings == 1


def points_alarm(seed: int) -> bool:
    """Whether something is found on virtual points without a fault."""
    return not simulated_test(seed).check().ok


def points_tables(pool: ProcessPoolExecutor) -> None:
    """Print what is found on virtual points: 17 tests of each fault, 500 without one."""
    tasks = [(name, 1000 + 17 * i + draw) for i, name in enumerate(FAULTS) for draw in range(17)]
    rows = list(pool.map(points_with_fault, tasks, chunksize=8))
    print("| fault | tests | named | nothing else |\n|---|---|---|---|")
    for name in FAULTS:
        own = [row for row in rows if row[0] == name]
        named = [row for row in own if row[2]]
        print(f"| {name} | {len(own)} | {len(named)} | {sum(row[3] for row in named)} |")
    named = [row for row in rows if row[2]]
    print(
        f"| all | {len(rows)} | {len(named)} ({100 * len(named) / len(rows):.1f} %) | {sum(row[3] for row in named)} |"
    )
    bodies = [f"{body} {np.mean([row[2] for row in rows if row[1] % 4 == i]):.3f}" for i, body in enumerate(BODIES)]
    print(f"\nnamed, by kind of bodies: {', '.join(bodies)}\n", flush=True)
    alarms = list(pool.map(points_alarm, range(2000, 2500), chunksize=8))
    print(f"{sum(alarms)} false alarms in {len(alarms)} tests on virtual points", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10, help="of each cell of the table of detection")
    parser.add_argument("--false-seeds", type=int, default=20, help="of each kind of noise, level and structure")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--only", choices=("channels", "points"))
    options = parser.parse_args()
    with ProcessPoolExecutor(options.jobs) as pool:
        if options.only != "channels":
            points_tables(pool)
        if options.only == "points":
            return
        tasks = [(*task, options.false_seeds) for task in product(STRUCTURES, KINDS_OF_NOISE, LEVELS)]
        found = dict(zip([task[:3] for task in tasks], pool.map(false_alarms, tasks), strict=True))
        print("| noise |", " | ".join(STRUCTURES), "| data sets |\n|" + "---|" * (len(STRUCTURES) + 2))
        for kind in KINDS_OF_NOISE:
            row = [sum(found[name, kind, level] for level in LEVELS) for name in STRUCTURES]
            print(f"| {kind} |", " | ".join(map(str, row)), f"| {len(row) * len(LEVELS) * options.false_seeds} |")
        total = sum(found.values())
        print(f"\n{total} false alarms in {len(tasks) * options.false_seeds} data sets\n", flush=True)

        rows = [(error, some) for error in ERRORS for some in NOISES]
        cells = [(error, name, *some, options.seeds) for error, some in rows for name in STRUCTURES]
        numbers = dict(zip([cell[:4] for cell in cells], pool.map(detections, cells), strict=True))
        heads = [f"{kind} {100 * level:g} %" for kind, level in NOISES]
        print("| error |", " | ".join(heads), "| nothing else |\n|" + "---|" * (len(NOISES) + 2))
        for error in ERRORS:
            parts = [[numbers[error, name, *some] for name in STRUCTURES] for some in NOISES]
            sums = np.array([np.sum(part, axis=0) for part in parts])
            shares = [f"{100 * found / n:.0f}" for n, found, _ in sums]
            print(f"| {error} |", " | ".join(shares), f"| {100 * sums[:, 2].sum() / max(sums[:, 1].sum(), 1):.0f} |")


if __name__ == "__main__":
    main()
