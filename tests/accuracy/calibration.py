"""Study of intervals where FRFs differ by more than noise: channels a little off, hits and lines that share noise.

    tests/accuracy/run calibration                       all trials, 100 draws each
    tests/accuracy/run calibration joint --draws 20      of fits at the joint; "quiet": with less noise;
                                                         "models": of fits of models

Draw number i of trial number t, counted from 0 in the order of its table, has the seed [1000 t + i, 30].

Variances from four channels have three degrees of freedom, so that half widths are 2 to 3 times the RMSE. If half of
the sensors are resonant, one draw of 16 has four resonant sensors by chance, and no difference between channels shows
it. In such draws of fits with models, errors of the models may explain the FRFs: draws 35 and 57 have a k_y that is
25 % too high, with warnings of the residual and of the models.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "support"))

import models
from fits import bound_of, true_values
from trials import Trial, running_mean, system

import jointfrf as jf
from model_bound import model_bound

#: Noise beside the disturbance, complex, of each FRF by itself, and less of it.
LEVEL, QUIET = 0.01, 0.002
#: From a generator, frequencies and shape to the factor of each FRF.
Factor = Callable[[np.random.Generator, np.ndarray, tuple[int, ...]], np.ndarray]


def _normal(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def _gains_of_hits(size: float) -> Factor:
    return lambda rng, freq, shape: np.broadcast_to(1 + size * rng.standard_normal((1, 1, shape[2])), shape)


def _late_hits(delay: float) -> Factor:
    def factor(rng: np.random.Generator, freq: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        late = delay * rng.standard_normal((1, 1, shape[2]))
        return np.broadcast_to(np.exp(-2j * np.pi * freq[:, None, None] * late), shape)

    return factor


def _drift(size: float, length: float) -> Factor:
    def factor(rng: np.random.Generator, freq: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        apart = freq[:, None] - freq
        value, vector = np.linalg.eigh(np.exp(-((apart / length) ** 2) / 2))
        root = vector * np.sqrt(np.maximum(value, 0))
        return np.broadcast_to(1 + size * (root @ rng.standard_normal((freq.size, shape[2])))[:, None], shape)

    return factor


def _own_factors(size: float) -> Factor:
    return lambda rng, freq, shape: np.broadcast_to(1 + size * rng.standard_normal((1, *shape[1:])), shape)


def _resonant(resonance: float, quality: float, *, some: bool) -> Factor:
    """Sensors whose own resonance raises what they show: each with a probability of a half, or all."""

    def factor(rng: np.random.Generator, freq: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        x = (freq / resonance)[:, None, None]
        which = rng.random((1, shape[1], 1)) < 0.5 if some else np.ones((1, shape[1], 1), bool)
        return np.broadcast_to(np.where(which, 1 / (1 - x**2 + 1j * x / quality), 1), shape)

    return factor


def _none(rng: np.random.Generator, freq: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    return np.ones(shape)


def _common(axes: tuple[int, ...], level: float) -> Factor:
    """Noise of each line that FRFs share: along these axes it is one."""

    def factor(rng: np.random.Generator, freq: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
        own = tuple(1 if axis in axes else count for axis, count in enumerate(shape))
        return np.broadcast_to(1 + level * _normal(rng, own), shape)

    return factor


def _correlated(lines: int, level: float) -> Factor:
    noise = running_mean(lines)
    return lambda rng, freq, shape: 1 + noise(rng, np.ones(shape), level)


#: Calibration that reciprocity shows.
SEEN: dict[str, Factor] = {
    "nothing": _none,
    "gain of each hit, 0.3 %": _gains_of_hits(0.003),
    "gain of each hit, 0.5 %": _gains_of_hits(0.005),
    "gain of each hit, 0.7 %": _gains_of_hits(0.007),
    "trigger of each hit, 1 us": _late_hits(1e-6),
    "drift of each hit, 1 % over 250 Hz": _drift(0.01, 250.0),
    "own factor of each FRF, 1 %": _own_factors(0.01),
    "half of the sensors resonant at 8 kHz": _resonant(8e3, 30.0, some=True),
}
#: Calibration that it cannot show.
UNSEEN: dict[str, Factor] = {
    "all hits 1 us late": lambda rng, freq, shape: np.broadcast_to(
        np.exp(-2j * np.pi * freq[:, None, None] * 1e-6), shape
    ),
    "all sensors resonant at 8 kHz": _resonant(8e3, 30.0, some=False),
}
#: Noise that FRFs share.
SHARED: dict[str, Factor] = {
    "3 % common to a hit": _common((1,), 0.03),
    "3 % common to a line": _common((1, 2), 0.03),
    "3 % correlated over 50 lines": _correlated(50, 0.03),
}


@dataclass(frozen=True)
class CalibrationTrial:
    """One row: what is fitted, what disturbs it, the noise of each FRF by itself."""

    fit: str
    disturbance: str
    level: float = LEVEL

    @property
    def name(self) -> str:
        """How the table calls it."""
        return f"{self.fit}, {100 * self.level:g} %, {self.disturbance}"

    @property
    def factor(self) -> Factor:
        """The disturbance."""
        return (SEEN | UNSEEN | SHARED)[self.disturbance]


@dataclass(frozen=True)
class Draw:
    """One fit: values, intervals, whether its residual is noise, what it says of calibration, seconds."""

    value: dict[str, float]
    interval: dict[str, tuple[float, float]]
    is_noise: bool
    kinds: tuple[str, ...]
    seconds: float


TABLES = {
    "joint": [CalibrationTrial("joint", one) for one in (*SEEN, *UNSEEN, *SHARED)],
    "quiet": [CalibrationTrial("joint", one, QUIET) for one in (*SEEN, *UNSEEN)],
    "models": [
        *(CalibrationTrial("remote", one) for one in (*SEEN, *SHARED)),
        *(CalibrationTrial("translations", one, QUIET) for one in SHARED),
        CalibrationTrial("one drive point", "3 % correlated over 50 lines", QUIET),
    ],
}  # fmt: skip


@cache
def exact(trial: CalibrationTrial) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and FRFs without any error."""
    if trial.fit == "joint":
        own = system("3.3")
        return own.freq_hz, own.gamma
    return models.FREQ, models.exact(models.ModelTrial(trial.fit))


def measured(trial: CalibrationTrial, place: int, number: int) -> np.ndarray:
    """Return the FRFs of one draw."""
    freq, h = exact(trial)
    rng = np.random.default_rng([1000 * place + number, 30])
    noisy = h * trial.factor(rng, freq, h.shape)
    return noisy + trial.level * h * _normal(rng, h.shape)


def fitted(trial: CalibrationTrial, place: int, number: int) -> jf.Fit:
    """Return the fit of one draw, with noise and calibration unknown."""
    freq, noisy = exact(trial)[0], measured(trial, place, number)
    if trial.fit == "joint":
        return jf.identify(freq, noisy, ["y", "theta"], damping="viscous")
    channels = models.CHANNELS[trial.fit]
    return jf.identify_model(freq, noisy, models.whole(models.GUESS), channels, channels)


def one_draw(trial: CalibrationTrial, place: int, number: int) -> Draw | None:
    """Fit one draw, and time it."""
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            fit = fitted(trial, place, number)
        except ValueError:
            # No joint was found, and that is said.
            return None
        interval = fit.confidence_interval(0.95)
    kinds = tuple(one.code for one in fit.findings if one.severity == "warning")
    return Draw(fit.value, interval, bool(fit.residual_is_noise), kinds, time.process_time() - start)


def truth(trial: CalibrationTrial) -> tuple[dict[str, float], dict[str, float]]:
    """Parameters, and their Cramer-Rao bound for the noise of each FRF by itself."""
    if trial.fit == "joint":
        own = Trial("3.3", "complex", trial.level)
        return true_values(own), bound_of(own)
    channels = models.CHANNELS[trial.fit]
    bound = model_bound(models.whole(models.TRUE), models.FREQ, channels, channels, trial.level, {})
    return dict(zip(("k_y", "c_y", "k_theta", "c_theta"), (6e5, 20.0, 5e3, 1.5), strict=True)), bound


HEAD = (
    "| trial | draws | RMSE of k_y / c_y / k_theta / c_theta, % | RMSE / bound, worst | "
    "coverage of 95 %, lowest .. highest, mean | half width / RMSE, median | not noise | warned of the residual | "
    "refused | s a fit |\n|---|---|---|---|---|---|---|---|---|---|"
)


def row(trial: CalibrationTrial, all_draws: Sequence[Draw | None]) -> str:
    """Line of the table."""
    draws = [draw for draw in all_draws if draw is not None]
    values, bound = truth(trial)
    errors, ratios, coverage, widths = [], [], [], []
    for name, true in values.items():
        value = np.array([draw.value[name] for draw in draws])
        low, high = np.array([draw.interval[name] for draw in draws]).T
        rmse = float(np.sqrt(((value - true) ** 2).mean()))
        errors.append(100 * rmse / true)
        ratios.append(rmse / bound[name])
        coverage.append(100 * float(((low <= true) & (true <= high)).mean()))
        widths.append(float(np.median(high - low)) / 2 / rmse)
    shown = " / ".join(f"{error:.2g}" for error in errors)
    seconds = float(np.median([draw.seconds for draw in draws]))
    alarms, warned = sum(not draw.is_noise for draw in draws), sum("residual-large" in draw.kinds for draw in draws)
    return (
        f"| {trial.name} | {len(all_draws)} | {shown} | {max(ratios):.2f} | "
        f"{min(coverage):.0f} .. {max(coverage):.0f}, {np.mean(coverage):.1f} | {np.median(widths):.1f} | {alarms} | "
        f"{warned} | {len(all_draws) - len(draws)} | {seconds:.2g} |"
    )


def main() -> None:
    """Run the trials asked for and print their tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*TABLES, []], help=f"out of {', '.join(TABLES)}; all by default")
    parser.add_argument("--only", default="", help="trials whose name holds this")
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--workers", type=int, default=None, help="processes; one a core by default")
    args = parser.parse_args()
    with ProcessPoolExecutor(args.workers) as pool:
        for part in args.parts or TABLES:
            print(HEAD, flush=True)
            for place, trial in enumerate(TABLES[part]):
                if args.only in trial.name:
                    draws = list(pool.map(partial(one_draw, trial, place), range(args.draws)))
                    print(row(trial, draws), flush=True)
            print()


if __name__ == "__main__":
    main()
