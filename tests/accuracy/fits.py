"""Study of the compliance fit: RMSE against the Cramer-Rao bound, and coverage of its 95 % intervals.

    tests/accuracy/run                          all trials, 300 draws each
    tests/accuracy/run bound stiff --draws 50   some of them
    tests/accuracy/run bound --known            with the variance of the noise given: what its estimate costs
    tests/accuracy/run damping --only both      trials whose name holds this

Draw number i of a trial has the seed i, so that a longer run continues a shorter one.
Damping is stated to be viscous, except in the parts damping, free and points. Case 3.1 is a chain of 951 lines, 3.2 and
3.3 are beams of 443 and 786 lines, six DOFs are a diagonal joint at 600 lines, and the full joint has 300 lines. A free
DOF is k_theta = 0, with c_theta = 0.1 N m s/rad or undamped; a pin also has k_y = 1e11 N/m.

Causes of ratios above 1 in the tables:

- bound, full joint: the worst of 42 ratios, each known to 7 % from 100 draws; other seeds have another worst term. All
  terms together are within 2 % of the bound, and `--known` removes 1 % of it.
- kinds, rising noise: smooth FRFs miss the lowest lines, which contain most information, by more than their noise, so
  that these count less. With `--known` the ratio is near 1.
- kinds, real noise: the bound is another, with `--known`, too: noise in phase with each FRF has no part across it.
- few, 3 lines: a few realisations leave k_theta undetermined; the median of its errors is at the bound.
- damping, hysteretic at 5 %: one draw of 60 averages over the wrong single term.
- damping, both at 5 %: h_theta is 4.4 standard errors large, and a second term needs 4.0 (BIC and a margin of 6).
- points: single lines show little of such stiff bolts. A fit that does not end at the noise starts again from the joint
  without cross terms; without this, 3 fits of 100 ended at 13 to 47 times the noise.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "support"))

from trials import SIZES, TRIALS, Trial

import jointfrf as jf
from cramer_rao import cramer_rao
from jointfrf.dofs import Parameter, parameters_shared
from jointfrf.identification.manifold.coordinates import JointTerms, joint_terms

#: Terms of a truth that is not named by them.
_TERMS = {"free": "viscous", "free, undamped": "none", "pin": "viscous", "pin, undamped": "none"}
#: A parameter so many times away from the truth, while its interval says otherwise, has run off.
_RUN_OFF = 3.0
#: Half, and nine of ten, of normal errors are below this number of their standard deviations.
_MEDIAN, _NINE_OF_TEN = 0.6745, 1.6449


@dataclass(frozen=True)
class Draw:
    """One fit: parameters by name, limits of the intervals, seconds."""

    value: dict[str, float]
    interval: dict[str, tuple[float, float]]
    seconds: float


@dataclass(frozen=True)
class Row:
    """One trial: what the table shows; `usual_to_bound` is 1 and 1 of normal errors at the bound: half, nine of ten."""

    name: str
    draws: int
    rmse_to_bound: dict[str, float]
    usual_to_bound: dict[str, tuple[float, float]]
    coverage: dict[str, float]
    run_off: int
    refused: int
    seconds: float


def one_draw(trial: Trial, seed: int, known: bool = False) -> Draw:
    """Fit one draw, its noise unknown, or known by its variance on each line."""
    freq, gamma, joint = trial.draw(seed)
    variance = None
    if known:
        exact = trial.exact.gamma[np.isin(trial.exact.freq_hz, freq)]
        variance = trial.level**2 * sizes_of(trial, exact, freq) ** 2
        # FRFs that are zero have no relative noise, and a fit no variance of zero
        variance = np.maximum(variance, variance[variance > 0].min())
    start = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            fit = jf.identify(
                freq, gamma, joint.dofs, damping=trial.damping, cross=trial.cross, same=trial.same, noise=variance
            )
        except ValueError:
            # No joint was found, and that is said.
            return Draw({}, {}, time.process_time() - start)
        intervals = fit.confidence_interval(0.95)
    return Draw(fit.value, intervals, time.process_time() - start)


def sizes_of(trial: Trial, gamma: np.ndarray, freq: np.ndarray) -> np.ndarray:
    """Standard deviation of the noise of each FRF at level 1; of noise that is not independent, its size."""
    return abs(SIZES[trial.noise](gamma, freq) if trial.noise in SIZES else gamma)


def true_values(trial: Trial) -> dict[str, float]:
    """Return the parameters of the joint."""
    joint, terms = trial.exact.joint, _terms_of(trial, trial.exact.freq_hz)
    matrices = {0: joint.stiffness, 1: joint.structural_damping, 2: joint.damping}
    values = [matrices[kind][a, b] for kind, (a, b) in zip(terms.kinds, terms.pairs, strict=True)]
    return dict(zip([one.name for one in terms.parameters], values, strict=True))


def _terms_of(trial: Trial, freq: np.ndarray) -> JointTerms:
    return joint_terms(2 * np.pi * freq, trial.exact.joint.dofs, _TERMS.get(trial.kind, trial.kind), trial.cross)


def bound_of(trial: Trial) -> dict[str, float]:
    """Return the Cramer-Rao bound of the parameters of the joint.

    For the noise as it is, where it is independent and circular; else as if it were that, and relative to each entry.
    """
    freq, gamma, joint = trial.exact.freq_hz, trial.exact.gamma, trial.exact.joint
    if "missing" in trial.noise:
        # The same share of the lines, evenly spread.
        freq, gamma = (np.delete(one, np.s_[::5], axis=0) for one in (freq, gamma))
    terms = _terms_of(trial, freq)
    names = [one.name for one in terms.parameters]
    std = sizes_of(trial, gamma, freq)
    bound = np.full(len(names), np.nan)
    for group in _groups(gamma):
        own_terms, which = terms.of_dofs(group)
        at = np.concatenate([group, group + len(joint.dofs)])
        k, own = joint.dynamic_stiffness(freq)[:, group[:, None], group], np.ix_(range(freq.size), at, at)
        covariance = cramer_rao(gamma[own], k, own_terms, std=std[own])
        if trial.same is not None:
            shared = parameters_shared([one.name for one in own_terms.parameters], [trial.same])
            fold = np.eye(shared.max() + 1)[shared]
            covariance = fold @ np.linalg.inv(fold.T @ np.linalg.inv(covariance) @ fold) @ fold.T
        bound[which] = trial.level * np.sqrt(np.diag(covariance))
    return dict(zip(names, bound.tolist(), strict=True))


def _groups(gamma: np.ndarray) -> list[np.ndarray]:
    n = gamma.shape[1] // 2
    size = np.sqrt(abs(np.einsum("lpp->lp", gamma)))
    # By symmetry these are zero, but for rounding, which reaches 2e-8.
    coupled = (abs(gamma) > 1e-6 * size[:, :, None] * size[:, None, :]).any(axis=0)
    both = coupled[:n, :n] | coupled[:n, n:] | coupled[n:, n:]
    left, groups = set(range(n)), []
    while left:
        group, reached = set(), {min(left)}
        while reached - group:
            group |= reached
            reached = {int(j) for i in group for j in np.flatnonzero(both[i])}
        groups.append(np.array(sorted(group)))
        left -= group
    return groups


def row_of(trial: Trial, draws: Sequence[Draw]) -> Row:
    """Compare draws with the truth.

    A stiffness is compared by its compliance, in which the noise is nearly normal: 1/k exists where k does not.
    """
    truth, bound = true_values(trial), bound_of(trial)
    refused = sum(not draw.value for draw in draws)
    draws = [draw for draw in draws if draw.value]
    ratio, usual, coverage, run_off = {}, {}, {}, np.zeros(len(draws), bool)
    for name, true in truth.items():
        if np.isnan(bound[name]):
            # A cross term between DOFs that no FRF connects is not fitted.
            continue
        one = Parameter.parse(name)
        value = np.array([draw.value.get(name, 0.0) for draw in draws])
        low, high = np.array([draw.interval.get(name, (0.0, 0.0)) for draw in draws]).T
        inside = (low <= true) & (true <= high)
        coverage[name] = float(inside.mean())
        error, scale = value - true, bound[name]
        if one.kind == "k" and trial.cross not in ("points", "fit") and true > 0:
            with np.errstate(divide="ignore"):
                error, scale = 1 / value - 1 / true, bound[name] / true**2
        ratio[name] = float(np.sqrt((error**2).mean()) / scale)
        median, most = np.quantile(abs(error) / scale, [0.5, 0.9])
        usual[name] = float(median / _MEDIAN), float(most / _NINE_OF_TEN)
        with np.errstate(invalid="ignore"):
            far = (
                (value > _RUN_OFF * true) | (value < true / _RUN_OFF)
                if one.kind == "k" and not one.is_cross and true > 0
                else np.zeros_like(run_off)
            )
        run_off |= far & ~inside
    seconds = float(np.median([draw.seconds for draw in draws]))
    return Row(trial.name, len(draws) + refused, ratio, usual, coverage, int(run_off.sum()), refused, seconds)


def table(rows: Sequence[Row]) -> str:
    """Markdown table: the worst and the mean over the parameters of each trial."""
    head = (
        "| trial | draws | RMSE / bound, worst | coverage of 95 %, lowest .. highest, mean | false by 3 | refused | "
        "s a fit |"
    )
    lines = [head, "|---|---|---|---|---|---|---|"]
    for row in rows:
        coverage = np.array(list(row.coverage.values())) * 100
        worst = max(row.rmse_to_bound.values())
        lines.append(
            f"| {row.name} | {row.draws} | {worst:.2f} | {coverage.min():.0f} .. {coverage.max():.0f}, "
            f"{coverage.mean():.1f} | {row.run_off} | {row.refused} | {row.seconds:.2g} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Run the trials asked for and print their table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[*TRIALS, []], help=f"out of {', '.join(TRIALS)}; all by default")
    parser.add_argument("--draws", type=int, default=300)
    parser.add_argument("--only", default="", help="trials whose name holds this")
    parser.add_argument("--known", action="store_true", help="the variance of the noise is given")
    parser.add_argument("--workers", type=int, default=None, help="processes; one a core by default")
    args = parser.parse_args()
    rows = []
    fit = partial(one_draw, known=args.known)
    with ProcessPoolExecutor(args.workers) as pool:
        for part in args.parts or TRIALS:
            for trial in TRIALS[part]:
                if args.only not in trial.name:
                    continue
                rows.append(row_of(trial, list(pool.map(partial(fit, trial), range(args.draws)))))
                print(table(rows[-1:]).splitlines()[-1], flush=True)
    print(f"\n{table(rows)}\n")
    for row in rows:
        ratios = np.array(list(row.rmse_to_bound.values()))
        worst = max(row.rmse_to_bound, key=row.rmse_to_bound.__getitem__)
        median, most = row.usual_to_bound[worst]
        print(
            f"{row.name}: RMSE / bound, all {ratios.size} parameters together {np.sqrt((ratios**2).mean()):.2f}; "
            f"{worst} {row.rmse_to_bound[worst]:.2f}, by the median {median:.2f}, by 90 % {most:.2f}"
        )


if __name__ == "__main__":
    main()
