"""What each mechanism of the fit is worth: the same draws with it and without it.

    tests/accuracy/run ablation                           all mechanisms, 8 draws of each problem
    tests/accuracy/run ablation "step length" --draws 25  mechanisms whose name contains a word
    tests/accuracy/run ablation --list                    names of mechanisms and problems

A mechanism is switched off by replacing one function in all modules of the package. Each row compares with the fit as
it is, draw by draw: fits that end with an error or do not converge (errors), false intervals without a warning,
errors of values, widths, seconds.

Mechanisms without an effect in most problems stay, because one kind of test needs each of them:

- noise of differences, and measured FRFs where smoothing misses: few lines, and stated noise ten times too small
  (standard errors of six DOFs would be 3 to 11 times larger);
- slow variation of noise: noise that changes over frequency;
- turns of noise and smoothing: lines that are noise only (seven tests of the noise fail without);
- averages over kinds of damping: few lines with both kinds (case 3.1 with 119 lines would have 65 % for c and 74 % for
  h, not 95 %);
- step length: a joint that is stiffer than its flexible sides, and a coupled joint of a hammer test with 42 terms and
  123 lines, which do not converge without;
- softer point of linearisation: rigid joints (5 of 100 fits of a joint 1000 times stiffer do not converge without);
- further initial values: coupled joints of few lines (1 of 12 fits of 42 terms to 30 lines does not converge without);
- chance of a scatter, residual in the factor: widths change by up to 9 %.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple
from unittest import mock

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "support"))

import assemblies
import bodies
import calibration
import fits
import hammer
import models
import setups
import wrong_models
from trials import Trial

import jointfrf as jf
from deforming_blocks import DAMPING, STIFFNESS, measured
from jointfrf.dofs import DIRECTIONS, Parameter
from jointfrf.frf import calibration as calibration_of_frfs
from jointfrf.frf import moving_mass, noise_model, noise_parts
from jointfrf.identification import mixed, noise, scatter
from jointfrf.identification.manifold import estimate, fit, group_fit, on_manifold
from jointfrf.identification.manifold.coordinates import DiagonalJoint
from jointfrf.identification.model import evidence, starts
from jointfrf.identification.model import fit as model_fit

#: The change of a mean is no chance from so many of its standard errors on, and worth a word from this ratio on.
CERTAIN, NOTICEABLE = 3.0, 1.1
#: Errors count up to so many half widths.
FARTHEST = 1e3


@dataclass(frozen=True)
class Problem:
    """Draws of one kind of test: the fit of a draw, and its true values."""

    name: str
    fit: Callable[[int], jf.Fit]
    truth: Callable[[int], dict[str, float]]


def _of_trial(trial: Trial, **more: Any) -> Problem:
    words = [trial.name, *(f"{key} {value}" for key, value in more.items())]

    def fitted(number: int) -> jf.Fit:
        freq, gamma, joint = trial.draw(number)
        options = {"damping": trial.damping, "cross": trial.cross, "same": trial.same} | more
        return jf.identify(freq, gamma, joint.dofs, **options)

    truth = fits.true_values(trial)
    return Problem(", ".join(words), fitted, lambda _: truth)


def _of_calibration(disturbance: str, channels: str = "joint") -> Problem:
    trial = calibration.CalibrationTrial(channels, disturbance)
    return Problem(trial.name, partial(calibration.fitted, trial, 0), lambda _: wrong_models.TRUE)


def _of_models(trial: models.ModelTrial) -> Problem:
    return Problem(f"models, {trial.name}", partial(models.fitted, trial), lambda _: wrong_models.TRUE | trial.truth)


def _of_wrong_models(points: str, wrong: str) -> Problem:
    pair = wrong_models.Pair(points, wrong)
    return Problem(f"{points}, {wrong}", partial(wrong_models.fitted, pair, None), lambda _: wrong_models.TRUE)


def _of_setups(row: int) -> Problem:
    one = list(setups.tests())[row]
    truth = {f"{kind}_{dof}": value for kind, of in (("k", setups.TRUE.stiffness), ("c", setups.TRUE.damping))
             for dof, value in zip(setups.DOFS, np.diagonal(of), strict=True)}  # fmt: skip
    return Problem(f"{one.setups} set-ups of {one.roving}", partial(setups.fitted, one, row), lambda _: truth)


def _of_hammer(name: str) -> Problem:
    ((place, trial),) = ((i, one) for i, one in enumerate(hammer.TRIALS) if one.name == name)

    def fitted(number: int) -> jf.Fit:
        freq, h = hammer.frfs(trial, np.random.default_rng([place, number, 50]))
        return jf.identify(freq, h, hammer.DOFS, transform=hammer.TRANSFORM, **trial.options)

    return Problem(f"hammer, {name}", fitted, lambda _: hammer.TRUTH)


def _virtual_points(distance: float) -> Problem:
    freq = np.linspace(20, 1500, 120)

    def fitted(number: int) -> jf.Fit:
        h, points, _ = measured(tuple(freq), distance)
        interface = jf.virtual_interface(*points)
        return jf.identify(freq, jf.pollute(h, 0.01, seed=number), DIRECTIONS, transform=(interface, interface))

    truth = {f"{kind}_{dof}": value for kind, of in (("k", STIFFNESS), ("c", DAMPING))
             for dof, value in zip(DIRECTIONS, of, strict=True)}  # fmt: skip
    return Problem(f"virtual points, {1e3 * distance:g} mm", fitted, lambda _: truth)


def _flexible_sides() -> Problem:
    """Six pairs of bodies in turn."""

    def fitted(number: int) -> jf.Fit:
        pair = bodies.pair(number % 6, lines=100)
        return jf.identify(pair.freq_hz, pair.noisy, DIRECTIONS, transform=pair.transform, damping="hysteretic")

    def truth(number: int) -> dict[str, float]:
        compliance = bodies.pair(number % 6, lines=100).compliance
        return {f"k_{dof}": 1 / float(own) for dof, own in zip(DIRECTIONS, compliance, strict=True)}

    return Problem("flexible sides", fitted, cache(truth))


def _stiff_joint_of_flexible_sides() -> Problem:
    pair = bodies.pair(4, lines=100)
    truth = {f"k_{dof}": 1 / float(own) for dof, own in zip(DIRECTIONS, pair.compliance, strict=True)}

    def fitted(number: int) -> jf.Fit:
        h = jf.pollute(pair.exact, bodies.NOISE, seed=number)
        return jf.identify(pair.freq_hz, h, DIRECTIONS, transform=pair.transform, damping="hysteretic")

    return Problem("flexible sides, stiffer", fitted, lambda _: truth)


REMOTE, DRIVE, *_ = wrong_models.POINTS


@cache
def problems() -> list[Problem]:
    """Return all problems: usual joints, stiff ones, pins, coupled joints, virtual points, models, hammer tests."""
    return [
        *(_of_trial(trial) for trial in (
            Trial("3.3", "complex", 0.05),
            Trial("3.3", "by entry", 0.02),
            Trial("3.3", "hum at multiples of 50 Hz", 0.02),
            Trial("3.3", "constant in accelerance", 0.02),
            Trial("3.3", "mixed", 0.02),
            Trial("3.3", "real", 0.02),
            Trial("3.3", "correlated over 25 lines", 0.02),
            Trial("3.3", "0.3 % in one direction", 0.08),
            Trial("3.3", "complex", 0.01, 300),
            Trial("3.3", "complex", 0.05, 1e3),
            Trial("3.3", "complex", 0.05, step=160),
            Trial("3.3", "complex", 0.05, step=40),
            Trial("3.3", "complex", 0.05, damping="auto", kind="hysteretic"),
            Trial("3.3", "complex", 0.05, damping="auto", kind="both"),
            Trial("3.3", "complex", 0.01, damping="viscous", kind="free"),
            Trial("3.3", "complex", 0.05, damping="auto", kind="pin"),
            Trial("3.3", "complex", 0.01, damping="none", kind="pin, undamped"),
            Trial("six DOFs", "complex", 0.05),
            Trial("two bolts", "complex", 0.01, cross="points", damping="hysteretic", kind="hysteretic"),
        )),
        _of_trial(Trial("full 6 x 6", "complex", 0.03, step=2, cross="fit")),
        _of_trial(Trial("full 6 x 6", "complex", 0.03, step=2, cross="fit"), cross="zero"),
        _of_trial(Trial("six DOFs", "complex", 0.01, step=2), cross="ignore"),
        _of_trial(Trial("six DOFs", "complex", 0.01), noise=0.001),
        replace(_of_trial(Trial("full 6 x 6", "complex", 0.05, step=10, cross="fit")), name="full 6 x 6, few lines"),
        _of_trial(Trial("3.3", "complex", 0.01, 1e4)),
        _of_trial(Trial("3.1", "complex", 0.05, step=8, damping="auto", kind="both")),
        _of_calibration("gain of each hit, 0.7 %"),
        _of_calibration("half of the sensors resonant at 8 kHz"),
        _of_calibration("3 % common to a line"),
        _of_calibration("3 % common to a hit"),
        _of_calibration("3 % common to a hit", "remote"),
        _of_setups(10),
        _virtual_points(0.02),
        _flexible_sides(),
        _stiff_joint_of_flexible_sides(),
        _of_hammer("3 averages, H1"),
        _of_hammer("Hann window, H1"),
        _of_hammer("roving sensor, mass 1 g"),
        _of_models(models.ModelTrial("interface")),
        _of_models(models.ModelTrial("one drive point")),
        _of_models(models.ModelTrial("remote", unknown=True)),
        _of_wrong_models(REMOTE, "E of A +0.3 %"),
        _of_wrong_models(DRIVE, "clamp of A that turns"),
        Problem("several joints, floors", partial(assemblies.fitted, "four-floors"),
                cache(partial(assemblies.truth_of, "four-floors"))),
        Problem("several joints, mounts", partial(assemblies.fitted, "four-mounts"),
                cache(partial(assemblies.truth_of, "four-mounts"))),
    ]  # fmt: skip


class Change(NamedTuple):
    """A replacement of a function, which other modules may have imported by name, or of an attribute of a class."""

    owner: Any
    name: str
    by: Callable[[Any], Any]


def _nothing(*_: Any, **__: Any) -> None:
    return None


def _constant(value: Any) -> Callable[[Any], Any]:
    return lambda _: lambda *_, **__: value


def _flat_levels(model: Callable[..., Any]) -> Callable[..., Any]:
    def flat(*args: Any, **options: Any) -> Any:
        found = model(*args, **options)
        level = found.line_level
        return replace(found, variance=found.variance / level[:, None, None], line_level=np.ones_like(level))

    return flat


def _no_outliers(model: Callable[..., Any]) -> Callable[..., Any]:
    def usual(*args: Any, **options: Any) -> Any:
        found = model(*args, **options)
        factor = found.line_factor
        return replace(found, variance=found.variance / factor[:, None, None], line_factor=np.ones_like(factor))

    return usual


def _of_all_entries(model: Callable[..., Any]) -> Callable[..., Any]:
    """One ratio of the noise to the size of the FRFs for all entries."""

    def common(*args: Any, **options: Any) -> Any:
        found = model(*args, **options)
        return _relative(found, np.where(found.relative > 0, np.median(found.relative[found.relative > 0]), 0))

    return common


def _without_floor(model: Callable[..., Any]) -> Callable[..., Any]:
    """The median of the noise relative to the FRFs for each entry."""

    def relative(*args: Any, **options: Any) -> Any:
        found = model(*args, **options)
        size = np.maximum(abs(found.smooth.h), 1e-300)
        return _relative(found, np.median(np.sqrt(found.variance) / size, axis=0))

    return relative


def _relative(found: Any, relative: Any) -> Any:
    of_lines = (found.line_level * found.line_factor)[:, None, None]
    none = np.zeros_like(relative)
    variance = of_lines * np.square(relative * abs(found.smooth.h))
    return replace(found, relative=relative, floor=none, coherence_factor=none, variance=variance)


def _first_only(fitted: Callable[..., Any]) -> Callable[..., Any]:
    return lambda problem, begins, *more, **options: fitted(problem, itertools.islice(begins, 1), *more, **options)


def _first_rung(ladder: Callable[..., Any]) -> Callable[..., Any]:
    return lambda self: itertools.islice(ladder(self), 1)


def _by_noise_alone(spread: Callable[..., Any]) -> Callable[..., Any]:
    return lambda at, by_noise, inflation=1.0, *more, **options: spread(at, inflation, inflation, *more, **options)


def _all_lines(_: Any) -> Callable[..., Any]:
    return lambda self, on, step: np.ones(len(on.squares), bool)


def _of_measured(project: Callable[..., Any]) -> Callable[..., Any]:
    return lambda target, data, *more, **options: project(data.measured, data, *more, **options)


def _both_terms(_: Any) -> Any:
    return classmethod(lambda cls, dof, scores: cls(dof, "both", "viscous", 0.0))


def _best_kind(by_scores: Callable[..., Any]) -> Any:
    return classmethod(lambda _, dof, scores: by_scores(dof, scores)._replace(others=()))


def _as_given(_: Any) -> Callable[..., Any]:
    return lambda likelihood, minimum: (likelihood, minimum)


def _plain_maximum(_: Any) -> Callable[..., Any]:
    return lambda factor, other: np.fmax(factor, other.factor)


def _ones(_: Any) -> Callable[..., Any]:
    return lambda x, *_, **__: np.ones_like(x)


#: The kernel fits joints without cross terms by itself. For what is replaced in Python, Python fits them.
_IN_PYTHON = Change(group_fit._KernelFit, "of", lambda _: classmethod(lambda cls, problem: None))

#: What is switched off, by what is replaced.
MECHANISMS: dict[str, list[Change]] = {
    "scatter between lines": [
        Change(scatter, "line_scatter", lambda _: lambda at, inflation=1.0: scatter.Scatter.unknown(at.determined.size))
    ],
    "scatter between blocks": [
        Change(scatter, "block_scatter", lambda _: lambda at, order=None: scatter.Scatter.unknown(at.determined.size))
    ],
    "scatter between channels": [
        Change(model_fit.ModelLinearised, "channels", _constant(())),
    ],
    "chance of a scatter": [Change(scatter, "with_excess", _plain_maximum)],
    "Student's t of a scatter": [Change(scatter, "student_squared", _ones)],
    "Student's t of effects": [Change(mixed, "student_factor", _ones)],
    "residual in the factor": [Change(scatter, "spread_of", _by_noise_alone)],
    "correlation of lines": [
        Change(noise_parts, "line_correlation", _constant(1.0)),
        Change(noise_parts.ReciprocityDifferences, "inflation", _constant(1.0)),
    ],
    "noise by entry": [Change(noise_model, "_model", _of_all_entries)],
    "floor of noise": [Change(noise_model, "_model", _without_floor)],
    "floor of acceleration": [Change(noise_model, "acceleration_floor", lambda _: lambda freq: np.ones(freq.size))],
    "slow variation of noise": [Change(noise_model, "_model", _flat_levels)],
    "outlying lines": [Change(noise_model, "_model", _no_outliers)],
    "turns of noise and smoothing": [Change(noise_model, "_MOST_TURNS", lambda _: 1)],
    "noise of differences on few lines": [Change(noise_model, "_noise_of_differences", _constant(None))],
    "measured FRFs where smoothing misses": [Change(noise, "_near", lambda _: lambda smooth, h, variance: smooth)],
    "calibration": [Change(calibration_of_frfs, "calibration_errors", _constant(None))],
    "effects of calibration": [Change(mixed, "smooth_effects", lambda _: lambda *_: [])],
    "mass of a sensor": [Change(moving_mass, "found_mass", _constant(None))],
    "choice of damping": [Change(fit.DofDamping, "by_scores", _both_terms)],
    "averages over kinds of damping": [Change(fit.DofDamping, "by_scores", _best_kind)],
    "M as expected": [Change(on_manifold, "prior_of_m", _constant(None)), _IN_PYTHON],
    "lines left out": [Change(group_fit._LinesUsed, "near", _all_lines), _IN_PYTHON],
    "other starts of far lines": [Change(group_fit, "_restarted", lambda _: lambda data, c, on: on), _IN_PYTHON],
    "smooth point of linearisation": [Change(on_manifold, "project", _of_measured), _IN_PYTHON],
    "step length": [
        Change(group_fit._StepLength, "of", lambda _: lambda self, step, information, *, is_lost: 1.0), _IN_PYTHON,
    ],
    "softer point of linearisation": [
        Change(DiagonalJoint, "linearisation_point", lambda _: lambda self, minimum, x: x), _IN_PYTHON,
    ],
    "reference springs": [Change(on_manifold.LineData, "with_springs", lambda _: lambda self: self)],
    "further initial values": [Change(group_fit, "fit_dofs", _first_only)],
    "ladder of initial values": [Change(estimate._Search, "ladder", _first_rung)],
    "unknown cross terms where none fits": [Change(estimate._Search, "needs_cross_terms", _constant(False))],
    "rates of rigid DOFs": [Change(estimate, "_reported", lambda _: lambda group: (group.x.copy(), group.covariance))],
    "parts of the band": [Change(fit, "_band_parts", _constant(None))],
    "level of the residual": [Change(fit, "_MOST_LEVELS", lambda _: 0)],
    "noise about fitted models": [Change(model_fit, "_with_noise_of_model", _constant(None))],
    "errors of models": [Change(evidence, "_model_groups", _constant([]))],
    "gains of channels": [Change(evidence, "_gain_groups", _constant([]))],
    "spreads of joints": [Change(evidence, "with_spreads", _as_given)],
    "models: values of lines": [Change(model_fit, "_values_of_lines", lambda _: lambda problem: iter(()))],
    "models: equal joints": [Change(model_fit, "_values_of_equal", lambda _: lambda problem: iter(()))],
    "models: further initial values": [Change(starts, "ranked_trials", lambda _: lambda likelihood, given: iter(()))],
}  # fmt: skip


@contextmanager
def without(mechanism: str | None) -> Iterator[None]:
    """Switch a mechanism off; None switches nothing off."""
    with ExitStack() as stack:
        for change in MECHANISMS.get(mechanism or "", []):
            before = getattr(change.owner, change.name)
            after = change.by(before)
            owners = [change.owner]
            if not isinstance(change.owner, type):
                package = [one for name, one in sys.modules.items() if name.startswith("jointfrf")]
                owners += [one for one in package if vars(one).get(change.name) is before and callable(before)]
            for owner in owners:
                stack.enter_context(mock.patch.object(owner, change.name, after))
        yield


class Draw(NamedTuple):
    """A fit: value and limits by parameter, warnings, CPU seconds, the sentence of the error that ended it."""

    values: dict[str, tuple[float, float, float]]
    codes: frozenset[str]
    seconds: float
    error: str = ""

    @property
    def fails(self) -> bool:
        """Whether the fit ended with an error or did not converge."""
        return bool(self.error) or "not-converged" in self.codes

    @property
    def is_announced(self) -> bool:
        """Whether a warning questions the joint or the FRFs as a whole."""
        return bool(self.codes - hammer.OF_NUMBERS)


def drawn(mechanism: str | None, place: int, number: int) -> Draw:
    """Return a draw of the problem at a place, without the mechanism."""
    problem, begin = problems()[place], time.process_time()
    with warnings.catch_warnings(), without(mechanism):
        warnings.simplefilter("ignore")
        try:
            found = problem.fit(number)
            limits = found.confidence_interval(0.95)
        except (ValueError, np.linalg.LinAlgError) as error:
            return Draw({}, frozenset(), time.process_time() - begin, str(error))
    values = {name: (found.value[name], *limits[name]) for name in limits}
    codes = frozenset(one.code for one in found.findings if one.severity != "note")
    return Draw(values, codes, time.process_time() - begin)


class Compared(NamedTuple):
    """One problem without a mechanism and with it."""

    errors: tuple[int, int]
    silent: tuple[int, int]
    rmse: float
    is_certain: bool
    width: float
    seconds: tuple[float, float]


def compared(problem: Problem, now: Sequence[Draw], before: Sequence[Draw]) -> Compared:
    """Compare draws without a mechanism with the same draws with it."""
    both = [(i, a, b) for i, (a, b) in enumerate(zip(now, before, strict=True)) if a.values and b.values]
    squares, ratios = np.zeros((2, len(both))), list[float]()
    for name in problem.truth(0):
        kept = [one for one in both if name in one[1].values and name in one[2].values]
        if len(kept) < len(both) or not both:
            continue
        true = np.array([problem.truth(i)[name] for i, *_ in kept])
        values = np.array([[one.values[name] for one in pair] for _, *pair in kept])  # draw, (without, with), 3
        values, true = regular(name, values, true)
        width = abs(values[:, :, 2] - values[:, :, 1])
        unit = float(np.median(width[:, 1])) / 2
        if np.isfinite(unit) and unit > 0:
            squares += np.minimum(abs(values[:, :, 0] - true[:, None]) / unit, FARTHEST).T ** 2
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.log(width[:, 0] / width[:, 1])
        ratios += ratio[np.isfinite(ratio)].tolist()
    change = squares[0] - squares[1]
    error = float(change.std(ddof=1) / np.sqrt(change.size)) if change.size > 1 else np.inf
    return Compared(
        (sum(one.fails for one in now), sum(one.fails for one in before)),
        (silent_misses(problem, now), silent_misses(problem, before)),
        float(np.sqrt(squares[0].sum() / squares[1].sum())) if squares[1].sum() > 0 else 1.0,
        bool(abs(change.mean()) > CERTAIN * error) if change.size else False,
        float(np.exp(np.median(ratios))) if ratios else 1.0,
        (sum(one.seconds for one in now), sum(one.seconds for one in before)),
    )


def regular(name: str, values: np.ndarray, true: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return values with limits, and true values; a stiffness as s/(s + k), regular from free to rigid."""
    one = Parameter.parse(name.rpartition(".")[2]) if "/" not in name else None
    if one is None or one.kind != "k" or one.is_cross:
        return values, true
    limits = abs(values[:, 1, 1:])
    scale = float(np.median(limits[np.isfinite(limits) & (limits > 0)]))
    return scale / (scale + np.maximum(values, -scale / 2)), scale / (scale + true)


def silent_misses(problem: Problem, draws: Sequence[Draw]) -> int:
    """Return how many intervals do not contain the truth without a warning."""
    return sum(
        not low <= problem.truth(i)[name] <= high
        for i, one in enumerate(draws) if not one.is_announced
        for name, (_, low, high) in one.values.items() if name in problem.truth(i)
    )  # fmt: skip


HEAD = (
    "| without | errors | silent misses | RMSE, worst | width, narrowest / widest | seconds | problems that change |\n"
    "|---|---|---|---|---|---|---|"
)


def row(mechanism: str, own: dict[str, Compared]) -> str:
    """Return the line of a mechanism."""
    sums = {
        field: np.sum([getattr(one, field) for one in own.values()], axis=0)
        for field in ("errors", "silent", "seconds")
    }
    certain = {
        name: one.rmse for name, one in own.items() if one.is_certain and abs(np.log(one.rmse)) > np.log(NOTICEABLE)
    }
    worst = max(certain, key=certain.__getitem__, default="")
    rmse = f"{certain[worst]:.2f} ({worst})" if worst else "-"
    widths = {name: one.width for name, one in own.items()}
    low, high = (choice(widths, key=widths.__getitem__) for choice in (min, max))
    changed = [
        name for name, one in own.items()
        if name in certain or one.errors[0] != one.errors[1] or one.silent[0] != one.silent[1]
        or abs(np.log(one.width)) > np.log(NOTICEABLE)
    ]  # fmt: skip
    return (
        f"| {mechanism} | {sums['errors'][1]} -> {sums['errors'][0]} | {sums['silent'][1]} -> {sums['silent'][0]} | "
        f"{rmse} | {widths[low]:.2f} ({low}) / {widths[high]:.2f} ({high}) | "
        f"{sums['seconds'][0] / sums['seconds'][1]:.2f} | {len(changed)} of {len(own)} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*", help="mechanisms whose name contains one of these; all by default")
    parser.add_argument("--problems", nargs="*", default=[""], help="problems whose name contains one of these")
    parser.add_argument("--draws", type=int, default=8)
    parser.add_argument("--workers", type=int, default=None, help="processes; one for each core by default")
    parser.add_argument("--list", action="store_true", help="print the names and end")
    args = parser.parse_args()
    every = problems()
    if args.list:
        print("\n".join([*MECHANISMS, "", *(one.name for one in every)]))
        return
    places = [place for place, one in enumerate(every) if any(word in one.name for word in args.problems)]
    chosen = [name for name in MECHANISMS if not args.words or any(word in name for word in args.words)]
    tasks = [(place, number) for place in places for number in range(args.draws)]
    with ProcessPoolExecutor(args.workers) as pool:

        def draws_of(mechanism: str | None) -> dict[int, list[Draw]]:
            found = list(pool.map(partial(drawn, mechanism), *zip(*tasks, strict=True)))
            return {place: found[i * args.draws : (i + 1) * args.draws] for i, place in enumerate(places)}

        before = draws_of(None)
        for i, own in before.items():
            seconds, errors = sum(one.seconds for one in own), sum(one.fails for one in own)
            print(f"{every[i].name}: {silent_misses(every[i], own)} silent misses, {errors} errors, {seconds:.1f} s")
        print(f"\n{HEAD}", flush=True)
        for mechanism in chosen:
            now = draws_of(mechanism)
            print(row(mechanism, {every[i].name: compared(every[i], now[i], before[i]) for i in places}), flush=True)


if __name__ == "__main__":
    main()
