"""Parts by measured FRFs with noise of their own: standard errors and intervals. Prints the table of docs/accuracy.md.

Beams of case 3.3; FRFs of the assembly between four translations, of each part between its joint DOFs and one more
point. Draw i of row r, from 0, has the seed [r, i, 32].
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

FREQ = np.arange(15.0, 801.0, 2.0)
SECTION = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
DOFS = {"A": ("13:y", "13:theta", "7:y"), "B": ("1:y", "1:theta", "10:y")}
CHANNELS = ("A/7:y", "A/13:y", "B/1:y", "B/10:y")
TRUTH = {"k_y": 6e5, "c_y": 20.0, "k_theta": 5e3, "c_theta": 1.5}
TRUE = jf.Joint([6e5, 5e3], [20.0, 1.5], ["y", "theta"])
GUESS = jf.Joint([3e5, 8e3], [10.0, 1.0], ["y", "theta"])


@dataclass(frozen=True)
class Row:
    """Relative noise of FRFs of the parts and of the assembly; what is said of the former; which parts are measured."""

    parts: float
    assembly: float
    said: str = "found"
    which: str = "AB"


def rows() -> Iterator[Row]:
    """What is simulated."""
    yield Row(0.005, 0.01, "said")
    yield Row(0.005, 0.01)
    yield Row(0.01, 0.01, "said", "A")
    yield Row(0.002, 0.002)
    yield Row(0.02, 0.01, "said")
    yield Row(0.005, 0.01, "taken as exact")


@cache
def exact() -> tuple[dict[str, jf.Model], dict[str, np.ndarray], np.ndarray]:
    """Models, FRFs of the parts, FRFs of the assembly."""
    models = {"A": jf.beam(0.3, 12, ends=("clamped", "free"), **SECTION), "B": jf.beam(0.225, 9, **SECTION)}
    h = {name: models[name].receptance(FREQ, models[name].index(*DOFS[name])) for name in "AB"}
    parts = [jf.Substructure(models[name], DOFS[name][:2], exact=True) for name in "AB"]
    return models, h, jf.Assembly(*parts, TRUE).receptance(FREQ, CHANNELS, CHANNELS)


def fitted(one: Row, row: int, number: int) -> jf.Fit:
    """Return the fit of one draw."""
    rng = np.random.default_rng([row, number, 32])
    models, of_parts, of_assembly = exact()

    def noisy(h: np.ndarray, level: float) -> np.ndarray:
        return h + level * abs(h) * (rng.standard_normal(h.shape) + 1j * rng.standard_normal(h.shape)) / np.sqrt(2)

    noise = {"said": one.parts, "found": None, "taken as exact": 0.0}[one.said]
    sides = [
        jf.Substructure.of_frfs(FREQ, noisy(of_parts[name], one.parts), DOFS[name], DOFS[name][:2], noise=noise)
        if name in one.which
        else jf.Substructure(models[name], DOFS[name][:2], exact=True)
        for name in "AB"
    ]
    h = noisy(of_assembly, one.assembly)
    return jf.identify_model(FREQ, h, jf.Assembly(*sides, GUESS), CHANNELS, CHANNELS)


def one_draw(one: Row, row: int, number: int) -> tuple[dict[str, float], dict[str, float], list[bool], bool, float]:
    """Return values, standard errors, which intervals hold, whether the residual is noise, and seconds of one draw."""
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = fitted(one, row, number)
        interval = fit.confidence_interval(0.95)
    inside = [interval[name][0] <= true <= interval[name][1] for name, true in TRUTH.items()]
    return fit.value, fit.std_error, inside, bool(fit.residual_is_noise), time.process_time() - start


HEAD = (
    "| parts by FRFs | their noise | of the assembly | RMSE of k_y / c_y / k_theta / c_theta, % | bias / scatter | "
    "standard error / scatter | coverage of 95 % | not noise | s a fit |\n|---|---|---|---|---|---|---|---|---|"
)


def line(one: Row, draws: list[tuple[dict[str, float], dict[str, float], list[bool], bool, float]]) -> str:
    """Return a line of the table."""
    values, errors = (np.array([[draw[i][name] for name in TRUTH] for draw in draws]) for i in (0, 1))
    true = np.array(list(TRUTH.values()))
    scatter = values.std(axis=0, ddof=1)
    rmse = 100 * np.sqrt(((values / true - 1) ** 2).mean(axis=0))
    cells = [
        " / ".join(f"{value:.2g}" for value in rmse),
        " / ".join(f"{value:.2f}" for value in (values.mean(axis=0) - true) / scatter),
        " / ".join(f"{value:.2f}" for value in np.sqrt((errors**2).mean(axis=0)) / scatter),
        " / ".join(f"{100 * value:.0f}" for value in np.array([draw[2] for draw in draws]).mean(axis=0)),
    ]
    return (
        f"| {' and '.join(one.which)} | {100 * one.parts:g} %, {one.said} | {100 * one.assembly:g} % | "
        f"{' | '.join(cells)} | {sum(not draw[3] for draw in draws)} | {np.median([draw[4] for draw in draws]):.2g} |"
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
        for row, one in enumerate(rows()):
            if not wanted or row in wanted:
                print(line(one, list(pool.map(partial(one_draw, one, row), range(args.draws)))), flush=True)


if __name__ == "__main__":
    main()
