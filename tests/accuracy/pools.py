"""Simulated round robins: how often the intervals of a pool hold. Prints the table of docs/accuracy.md.

Each draw has truths that scatter by the spread in logarithms, and fits with relative errors around the error stated
(log-normally spread by a half, as fits of different tests are). Draw i of row r, from 0, has the seed [r, i].
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from jointfrf.workbench.pooling.random_effects import RandomEffects


@dataclass(frozen=True)
class RoundRobin:
    """Assemblies, tests of each, spread between and within assemblies, error of a fit; all relative."""

    assemblies: int
    tests: int
    between: float
    within: float
    error: float


def round_robins() -> Iterator[RoundRobin]:
    """What is simulated."""
    for assemblies in (3, 5, 10, 30):
        for between in (0.0, 0.03, 0.1, 0.3):
            yield RoundRobin(assemblies, 1, between, 0.0, 0.02)
    for assemblies, tests in ((3, 2), (5, 3), (10, 3)):
        for between, within in ((0.1, 0.03), (0.1, 0.1), (0.3, 0.03)):
            yield RoundRobin(assemblies, tests, between, within, 0.02)


def coverage(one: RoundRobin, row: int, draws: int) -> tuple[list[float], list[float]]:
    """Return coverage of mean, spread between, and next assembly in percent; median widths of the first and last."""
    inside, widths = np.zeros(3), []
    for draw in range(draws):
        rng = np.random.default_rng([row, draw])
        codes = np.repeat(np.arange(one.assemblies), one.tests)
        errors = one.error * np.exp(rng.normal(0, 0.5, codes.size))
        values = rng.normal(0, one.between, one.assemblies)[codes] + rng.normal(0, one.within, codes.size)
        values += rng.normal(0, errors)
        factors = [codes] if one.tests > 1 else []
        effects = RandomEffects(values, np.diag(errors**2), np.ones((codes.size, 1)), factors)
        between = effects.variances[:, -1]
        mean = effects.combination(np.ones(1)).interval(0.95)
        ahead = effects.combination(np.ones(1), between).interval(0.95)
        spread = np.sqrt([np.quantile(between, 0.025), effects.upper_limit(len(factors), 0.025)])
        truth = rng.normal(0, one.between)
        inside += [mean[0] <= 0 <= mean[1], spread[0] <= one.between <= spread[1], ahead[0] <= truth <= ahead[1]]
        widths.append((mean[1] - mean[0], ahead[1] - ahead[0]))
    return (100 * inside / draws).tolist(), (50 * np.median(widths, axis=0)).tolist()


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=1000)
    draws = parser.parse_args().draws
    columns = "assemblies x tests | spread between, within, % | mean | spread | next assembly"
    print(f"| {columns} | half widths of mean, next, % |")
    print("|---|---|---|---|---|---|")
    for row, one in enumerate(round_robins()):
        (mean, spread, ahead), (of_mean, of_next) = coverage(one, row, draws)
        print(f"| {one.assemblies} x {one.tests} | {100 * one.between:g}, {100 * one.within:g} | {mean:.1f} | "
              f"{spread:.1f} | {ahead:.1f} | {of_mean:.2g}, {float(f'{of_next:.2g}'):g} |", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
