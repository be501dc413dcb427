"""Hammer tests in the time domain: how often intervals of joints hold at default settings, by tests of other kinds.

    tests/accuracy/run hammer                        all trials, 40 draws each
    tests/accuracy/run hammer "mass" --draws 10      trials whose name has this word

Two Timoshenko beams of 0.63 kg, computed by `impacts`, without the package. Draw i of trial t, counted from 0 in the
order of the table, has the seed [t, i, 50]. A draw is *announced* if a warning names an error of the FRFs or a misfit.
"""

from __future__ import annotations

import argparse
import time
import warnings
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import impacts
import numpy as np
from impacts import Analyser

import jointfrf as jf

DOFS = ("y", "theta")
TRUTH = {"k_y": impacts.K_TRUE[0], "k_theta": impacts.K_TRUE[1], "c_y": impacts.C_TRUE[0], "c_theta": impacts.C_TRUE[1]}
#: Two points 20 mm apart on either side, on blocks.
APART = 0.02
PLACES = (impacts.node(0, APART), impacts.node(0, 0.0), impacts.node(1, 0.0), impacts.node(1, APART))
TRANSFORM = jf.virtual_interface(
    *(jf.virtual_point([[x, 0, 0] for x in own], [[0, 1, 0]] * 2, [0, 0, 0], ["y", "theta_z"])
      for own in ((-APART, 0.0), (0.0, APART)))
)  # fmt: skip
BAND = 20.0, 1000.0
#: Warnings about single numbers, which announce nothing.
OF_NUMBERS = {"poorly-determined", "stiffness-unbounded", "stiffness-zero", "damping-insignificant"}


@dataclass(frozen=True)
class Trial:
    """A kind of test.

    Attributes
    ----------
    name : str
    analyser : Analyser
    mass : float
        Of the accelerometer that moves from point to point, kg.
    wrong : tuple of (column, record, column struck), optional
    stray, spread : float
        Error of the position of one point, and standard deviation of the positions of all points, m.
    relative : float
        Relative noise of exact FRFs, which take the place of the analyser.
    every : int
        Only every so manieth line is used.
    options : dict
        Of `identify`.
    """

    name: str
    analyser: Analyser = field(default_factory=Analyser)
    mass: float = 0.0
    wrong: tuple[int, int, int] | None = None
    stray: float = 0.0
    spread: float = 0.0
    relative: float = 0.0
    every: int = 1
    options: dict[str, Any] = field(default_factory=dict)


HANN = Analyser(window="hann", before=0.5)
TRIALS = (
    Trial("3 averages, H1"),
    Trial("1 average", Analyser(averages=1)),
    Trial("Hann window, H1", HANN),
    Trial("exponential window, decay stated", Analyser(seconds=0.5, window="exponential", decay=12.0),
          options={"window_decay": 12.0}),
    Trial("hammer noise 0.1 N, H1", Analyser(force_noise=0.1)),
    Trial("sensor noise 0.1 m/s^2, H1", Analyser(floor=0.1)),
    Trial("sensor noise 0.1 m/s^2, H2", Analyser(floor=0.1, estimator="H2")),
    Trial("sensor noise 0.1 m/s^2, Hv", Analyser(floor=0.1, estimator="Hv")),
    Trial("Hann window, H1, hammer noise 0.1 N", replace(HANN, force_noise=0.1)),
    Trial("12 bit", Analyser(bits=12)),
    Trial("records of 0.5 s", Analyser(seconds=0.5)),
    Trial("jitter 3 us", Analyser(jitter=3e-6)),
    Trial("roving sensor, mass 0.5 g", mass=0.5e-3),
    Trial("roving sensor, mass 1 g", mass=1e-3),
    Trial("roving sensor, mass 5 g", mass=5e-3),
    Trial("one of five records at another point", Analyser(averages=5), wrong=(2, 1, 0)),
    Trial("one point 1 mm off", stray=1e-3),
    Trial("25 lines, relative noise of 1 %, stated", relative=0.01, every=80, options={"noise": 0.01}),
    Trial("25 lines, relative noise of 1 %", relative=0.01, every=80),
    Trial("points off by 0.5 mm, stated", spread=5e-4, options={"position_error": 5e-4}),
)  # fmt: skip


def frfs(trial: Trial, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return lines inside the band and receptances of the four points."""
    rows = np.eye(len(impacts.structure().shapes))[list(PLACES)]
    columns = rows.copy()
    if trial.stray or trial.spread:
        off = trial.spread * rng.standard_normal(4) if trial.spread else np.array([trial.stray, 0, 0, 0])
        # Along the line from point 0 to 1, and from 2 to 3.
        columns = rows = rows + off[:, None] / APART * (rows[[1, 1, 3, 3]] - rows[[0, 0, 2, 2]])
    if trial.relative:
        freq = np.arange(BAND[0], BAND[1], 0.5 * trial.every)
        h = impacts.structure().receptance(freq, rows, columns)
        noise = (rng.standard_normal((*h.shape, 2)) @ [1, 1j]) / np.sqrt(2)
        return freq, h * (1 + trial.relative * noise)
    each = tuple(impacts.structure(((place, trial.mass),)) for place in PLACES) if trial.mass else ()
    wrong = None if trial.wrong is None else {trial.wrong[0]: trial.wrong[1:]}
    freq, h = impacts.measured(impacts.structure(), rows, columns, trial.analyser, rng, wrong, each)
    inside = np.flatnonzero((freq >= BAND[0]) & (freq <= BAND[1]))[:: trial.every]
    return freq[inside], h[inside]


@dataclass(frozen=True)
class Draw:
    """One fit: errors relative to the truth, limits likewise, warnings by code, CPU seconds."""

    errors: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    codes: tuple[str, ...]
    seconds: float
    said: str = ""

    @classmethod
    def of(cls, fit: jf.Fit, truth: Mapping[str, float], seconds: float) -> Draw:
        """Compare a fit with the true parameters."""
        limits = fit.confidence_interval()
        names = [name for name in truth if name in limits]
        low, high = ([limits[name][side] / truth[name] - 1 for name in names] for side in (0, 1))
        codes = tuple(one.code for one in fit.findings if one.severity != "note")
        errors = tuple(fit.value[name] / truth[name] - 1 for name in names)
        return cls(errors, tuple(low), tuple(high), codes, seconds)


def one_draw(trial: Trial, place: int, number: int) -> Draw:
    """Return a draw, or the sentence of the error that ended it."""
    freq, h = frfs(trial, np.random.default_rng([place, number, 50]))
    begin = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            fit = jf.identify(freq, h, DOFS, transform=TRANSFORM, **trial.options)
        except ValueError as error:
            return Draw((), (), (), (), time.process_time() - begin, str(error))
    return Draw.of(fit, TRUTH, time.process_time() - begin)


def result_row(name: str, draws: Sequence[Draw], *, largest: bool = False) -> str:
    """Return the line of a trial, with the largest of the median widths of all parameters or without."""
    most = max(len(one.errors) for one in draws)
    good = [one for one in draws if len(one.errors) == most > 0]
    if not good:
        return f"| {name} | {len(draws)} | no fit: {draws[0].said[:60]} |"
    errors, low, high = (np.array([getattr(one, name) for one in good]) for name in ("errors", "low", "high"))
    inside = (low <= 0) & (high >= 0)
    rmse = np.sqrt((errors**2).mean(axis=0))
    width = np.median((high - low) / 2, axis=0) / (1.96 * rmse)
    announced = [bool(set(one.codes) - OF_NUMBERS) for one in good]
    silent = [not held and not said for held, said in zip(inside.all(axis=1), announced, strict=True)]
    codes = sorted({code for one in good for code in one.codes}, key=lambda code: -sum(code in d.codes for d in good))
    counts = ", ".join(f"{code} {sum(code in one.codes for one in good)}" for code in codes[:3])
    percent = " / ".join(f"{100 * one:.2g}" for one in rmse)
    held = 100 * inside.mean(axis=0)
    widest = f"{width.max():.2g}, " if largest else ""
    return (
        f"| {name} | {len(good)} of {len(draws)} | {percent} | {' / '.join(f'{one:.0f}' for one in held)} | "
        f"{widest}{np.nanmedian(width):.2g} | {sum(announced)} | {sum(silent)} | {counts} | "
        f"{np.median([one.seconds for one in good]):.2g} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("words", nargs="*")
    parser.add_argument("--draws", type=int, default=40)
    options = parser.parse_args()
    print("| test | fits | RMSE of k_y / k_theta / c_y / c_theta, % | inside their 95 % intervals, % | "
          "half width / 1.96 RMSE, median | announced | silent misses | warnings | s a fit |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|")
    with ProcessPoolExecutor() as pool:
        for place, trial in enumerate(TRIALS):
            if not options.words or any(word in trial.name for word in options.words):
                call: Callable[[int], Draw] = partial(one_draw, trial, place)
                print(result_row(trial.name, list(pool.map(call, range(options.draws)))), flush=True)


if __name__ == "__main__":
    main()
