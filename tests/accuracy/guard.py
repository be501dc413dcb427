"""Recorded fits of some fifty problems: what a change of the fit must not move.

    tests/accuracy/run guard                     compare all problems with guard.json
    tests/accuracy/run guard --only pin          compare problems whose name contains a word
    tests/accuracy/run guard --write             record them again, in the commit that explains why they moved

A record contains the estimates, the 95 % intervals and the codes of all warnings. Estimates and limits are compared in
standard errors of the record. A stiffness k is compared by s / (s + k), where s is its recorded estimate: this function
is regular from a free to a rigid joint.
"""

from __future__ import annotations

import argparse
import functools
import json
import sys
import time
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "support"))

import assemblies
import bodies
import calibration
import models
import parts
import setups
import sides
import wrong_models
from trials import Trial

import jointfrf as jf
from deforming_blocks import measured
from jointfrf.dofs import DIRECTIONS

RECORD = Path(__file__).with_name("guard.json")
#: Largest change in standard errors that passes; on one processor a change that moves no number passes 1e-6.
TOLERANCE = 0.4
#: Problems with several ends of the search for the noise: rounding decides between them.
TOLERANCES = {"3.3, 2 %, constant in accelerance": 0.8, "virtual points, near": 0.8}
#: Standard errors between the limits of a 95 % interval of a normal distribution.
WIDTH = 3.92

Record = dict[str, Any]


def _trial(trial: Trial, seed: int = 0, **more: Any) -> Callable[[], jf.Fit]:
    def fit() -> jf.Fit:
        freq, gamma, joint = trial.draw(seed)
        options = {"damping": trial.damping, "cross": trial.cross, "same": trial.same} | more
        return jf.identify(freq, gamma, joint.dofs, **options)

    return fit


def _virtual_points(distance: float) -> jf.Fit:
    """Blocks of bricks with 12 channels on each side of the joint."""
    freq = np.linspace(20, 1500, 120)
    h, points, _ = measured(tuple(freq), distance)
    interface = jf.virtual_interface(*points)
    return jf.identify(freq, jf.pollute(h, 0.01, seed=5), DIRECTIONS, transform=(interface, interface))


def _sides(index: int, wrong: str | None) -> jf.Fit:
    """Member of the family of bodies with flexible sides, alone or with models of its sides that are wrong."""
    pair = bodies.pair(index, lines=100)
    more: dict[str, Any] = {}
    if wrong is not None:
        more = {"sides": sides.side_models(pair, wrong, np.random.default_rng([index, 1]))}
    return jf.identify(pair.freq_hz, pair.noisy, DIRECTIONS, transform=pair.transform, damping="hysteretic", **more)


def _setups(row: int) -> jf.Fit:
    return setups.fitted(list(setups.tests())[row], row, 0)


def _calibration(disturbance: str, fit: str = "joint", level: float = calibration.LEVEL) -> jf.Fit:
    return calibration.fitted(calibration.CalibrationTrial(fit, disturbance, level), 0, 0)


def _models(trial: models.ModelTrial) -> jf.Fit:
    return models.fitted(trial, 0)


def _wrong_models(points: str, wrong: str, model_error: float | None = None) -> jf.Fit:
    pair = wrong_models.Pair(points, wrong)
    return wrong_models.fitted(pair, model_error, 0)


def _laws() -> jf.Fit:
    """A spring with hysteretic and one with viscous damping as laws, at the joint DOFs."""
    freq, gamma, _ = Trial("3.3", "complex", 0.02).draw(0)
    joint = jf.LawJoint({"y": jf.SpringLaw(1e5, c=5.0), "theta": jf.SpringLaw(1e3, c=0.5)})
    return jf.identify(freq, gamma, joint=joint)


def _given_noise() -> jf.Fit:
    freq, gamma, joint = Trial("3.3", "complex", 0.02).draw(0)
    return jf.identify(freq, gamma, joint.dofs, noise=0.02)


REMOTE, DRIVE, *_ = wrong_models.POINTS
PROBLEMS: dict[str, Callable[[], jf.Fit]] = {
    **{trial.name: _trial(trial) for trial in (
        *(Trial(name, "complex", 0.05) for name in ("3.1", "3.2", "3.3")),
        Trial("six DOFs", "complex", 0.03),
        Trial("full 6 x 6", "complex", 0.03, cross="fit"),
        *(Trial("3.3", noise, 0.02) for noise in (
            "floor", "by entry", "hum at multiples of 50 Hz", "constant in accelerance", "correlated over 5 lines",
        )),
        Trial("3.3", "0.3 % in one direction", 0.08),
        Trial("3.3", "complex", 0.05, 100),
        *(Trial("3.3", "complex", 0.01, factor) for factor in (300, 1e3, 1e5)),
        *(Trial("3.3", "complex", 0.05, step=step) for step in (400, 300, 160, 49, 20)),
        *(Trial("3.3", "complex", 0.01, damping="auto", kind=kind)
          for kind in ("none", "viscous", "hysteretic", "both")),
        Trial("3.3", "complex", 0.01, damping="viscous", kind="free"),
        Trial("3.3", "complex", 0.01, damping="none", kind="free, undamped"),
        Trial("3.3", "complex", 0.01, damping="auto", kind="pin"),
        Trial("3.3", "complex", 0.01, damping="none", kind="pin, undamped"),
        Trial("two bolts", "complex", 0.01, cross="points", damping="hysteretic", kind="hysteretic"),
        Trial("two equal bolts", "complex", 0.01, cross="points", damping="hysteretic", kind="hysteretic",
              same=("bolt1", "bolt2")),
    )},
    "six DOFs, cross terms unknown": _trial(Trial("six DOFs", "complex", 0.01), cross="ignore"),
    "3.3, laws": _laws,
    "3.3, noise given": _given_noise,
    "virtual points, near": functools.partial(_virtual_points, 0.02),
    "virtual points, far": functools.partial(_virtual_points, 0.06),
    "flexible sides": functools.partial(_sides, 0, None),
    "flexible sides, stiffer": functools.partial(_sides, 4, None),
    "flexible sides with models": functools.partial(_sides, 0, "E"),
    "set-ups, 3 of hits": functools.partial(_setups, 10),
    "set-ups, gains given": functools.partial(_setups, 13),
    "gains of hits": functools.partial(_calibration, "gain of each hit, 0.7 %"),
    "late hits": functools.partial(_calibration, "trigger of each hit, 1 us"),
    "resonant sensors": functools.partial(_calibration, "half of the sensors resonant at 8 kHz"),
    "noise common to a line": functools.partial(_calibration, "3 % common to a line"),
    "noise common to a hit, models": functools.partial(_calibration, "3 % common to a hit", "remote"),
    **{f"models, {trial.name}": functools.partial(_models, trial) for trial in (
        models.ModelTrial("interface"),
        models.ModelTrial("one drive point"),
        models.ModelTrial("remote", unknown=True),
        models.ModelTrial("remote", wrong="20 g missing"),
    )},
    "models, errors by default": functools.partial(_wrong_models, REMOTE, "E of A +0.3 %"),
    "models, one drive point, clamp": functools.partial(_wrong_models, DRIVE, "clamp of A that turns"),
    "models, no errors expected": functools.partial(_wrong_models, REMOTE, "E of A +0.3 %", 0.0),
    "parts by FRFs": functools.partial(parts.fitted, next(parts.rows()), 0, 0),
    "several joints, floors": functools.partial(assemblies.fitted, "four-floors", 1),
    "several joints, mounts": functools.partial(assemblies.fitted, "four-mounts", 1),
}  # fmt: skip


def record_of(name: str) -> Record:
    """Return the record of a problem: parameters with limits and standard errors, codes of warnings, seconds."""
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            fit = PROBLEMS[name]()
            limits = fit.confidence_interval(0.95)
        except ValueError as error:
            return {"error": type(error).__name__}
    parameters = {
        one: dict(zip(("value", "low", "high"), map(float, (fit.value[one], *limits[one])), strict=True))
        for one in fit.value
    }
    codes = sorted({one.code for one in fit.findings if one.severity != "note"})
    return {"parameters": parameters, "warnings": codes, "seconds": round(time.process_time() - start, 2)}


def moved(name: str, now: dict[str, float], before: dict[str, float]) -> float:
    """Return by how many standard errors an estimate or a limit has moved; both records have value, low, high."""
    scale = abs(before["value"])

    def regular(value: float) -> float:
        if not is_stiffness(name):
            return value
        return 0.0 if value == np.inf else scale / (scale + value) if value > -scale / 2 else 2.0

    recorded = {key: regular(before[key]) for key in ("value", "low", "high")}
    width = abs(recorded["high"] - recorded["low"])
    found = [regular(now[key]) for key in recorded]
    if not np.isfinite(width):  # no scale: only which limits are finite is compared
        return 0.0 if np.isfinite(found).tolist() == np.isfinite(list(recorded.values())).tolist() else np.inf
    return max(abs(one - other) for one, other in zip(found, recorded.values(), strict=True)) / (width / WIDTH)


def is_stiffness(name: str) -> bool:
    """Return whether a parameter is a stiffness on the diagonal, which may be infinite or zero."""
    own = name.rpartition(".")[2]
    return own.startswith("k") and "," not in own


def changes(name: str, tolerance: float | None = None) -> list[str]:
    """Return in words what of a problem has moved; by default by more than its own tolerance."""
    own = TOLERANCES.get(name, TOLERANCE) if tolerance is None else tolerance
    return differences(record_of(name), recorded()[name], own)


def differences(now: Record, before: Record, tolerance: float = TOLERANCE) -> list[str]:
    """Return in words what has moved by more than the tolerance, in standard errors; empty if nothing has."""
    if "error" in now or "error" in before:
        return [] if now.get("error") == before.get("error") else [f"{before.get('error')} -> {now.get('error')}"]
    found = []
    if now["warnings"] != before["warnings"]:
        found.append(f"warnings {before['warnings']} -> {now['warnings']}")
    if now["parameters"].keys() != before["parameters"].keys():
        return [*found, f"parameters {list(before['parameters'])} -> {list(now['parameters'])}"]
    for name, own in now["parameters"].items():
        change = moved(name, own, before["parameters"][name])
        if not change <= tolerance:
            found.append(f"{name} by {change:.3g} standard errors: {before['parameters'][name]} -> {own}")
    return found


def recorded() -> dict[str, Record]:
    """Return the records of the file."""
    found: dict[str, Record] = json.loads(RECORD.read_text(encoding="utf-8"))
    return found


def main() -> None:
    """Compare or write records."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="problems whose name contains this")
    parser.add_argument("--write", action="store_true", help="record the results")
    parser.add_argument("--tolerance", type=float, help="in standard errors (default: of the problem)")
    parser.add_argument("--workers", type=int, default=None, help="processes (default: one for each core)")
    args = parser.parse_args()
    names = [name for name in PROBLEMS if args.only in name]
    records = recorded() if RECORD.exists() else {}
    bad = 0
    with ProcessPoolExecutor(args.workers) as pool:
        for name, now in zip(names, pool.map(record_of, names), strict=True):
            own = TOLERANCES.get(name, TOLERANCE) if args.tolerance is None else args.tolerance
            moved_words = differences(now, records[name], own) if name in records else ["not recorded yet"]
            bad += bool(moved_words)
            print(f"{name} ({now.get('seconds', 0)} s): {'; '.join(moved_words) or 'unchanged'}", flush=True)
            if args.write:
                records[name] = now
    if args.write:
        records = {name: records[name] for name in PROBLEMS if name in records}
        RECORD.write_text(json.dumps(records, indent=1) + "\n", encoding="utf-8")
    sys.exit(bad > 0 and not args.write)


if __name__ == "__main__":
    main()
