"""The tables of a bolted lap joint."""

from __future__ import annotations

from typing import Any

import numpy as np

from jointfrf.cases.bolted_lap.compute import BoltedResult, Found, peak_errors
from jointfrf.cases.known_joint.read import unit_of
from jointfrf.cases.known_joint.tables import Cell, Table, case_json, number

__all__ = ["bolted_json", "bolted_summary", "bolted_tables", "parameters"]


def parameters(result: BoltedResult) -> list[tuple[str, str]]:
    """Names and units of the twelve parameters."""
    return [(f"{letter}_{dof}", unit_of(letter, "theta" in dof)) for letter in "kc" for dof in result.case.joint.dofs]


def bolted_tables(result: BoltedResult) -> list[Table]:
    """Build all tables."""
    return [
        _contact(result),
        _convergence(result),
        _frequencies(result),
        _identified(result),
        _resonances(result, "resonances", "Resonances of the tip, regenerated with the identified joint"),
        _resonances(result, "transfer", f"Transfer to a beam B of {result.case.lengths[2]:g} m", transferred=True),
        _noise(result),
        _unmeasured(result),
    ]


def _contact(result: BoltedResult) -> Table:
    state = result.state
    cells: list[tuple[Cell, ...]] = []
    for name, one in state.interfaces.items():
        slip = one.slip_ratio[one.closed]
        cells.append(
            (
                name, float(one.normal_force), state.force, float(one.pressure.max()) / 1e6,
                f"{np.count_nonzero(one.closed)} of {one.closed.size}", str(np.count_nonzero(one.slipping)),
                float(slip.max(initial=0)),
            )
        )  # fmt: skip
    columns = ("interface", "force, N", "preload, N", "largest pressure, MPa", "closed", "slipping", "slip ratio")
    note = (
        f"Elongation of the bolt {1e6 * state.elongation:.1f} um; the lap is closed up to "
        f"{1e3 * state.contact_radius:.1f} mm from the axis. "
        "The slip ratio is tangential force over friction times normal force, at most 1."
    )
    return Table("contact", "Preloaded contact", columns, tuple(cells), (), note)


def _convergence(result: BoltedResult) -> Table:
    cells = tuple(
        (str(i + 1), str(one.closed), str(one.slipping), str(one.changed), float(one.residual))
        for i, one in enumerate(result.state.history)
    )
    columns = ("iteration", "pairs closed", "slipping", "changed", "residual")
    note = "The iteration ends where no pair opens, closes, sticks or slips any more."
    return Table("convergence", "Convergence of the contact", columns, cells, (), note)


def _frequencies(result: BoltedResult) -> Table:
    expected = result.case.expected
    cells: list[tuple[Cell, ...]] = []
    failing = []
    for i, freq in enumerate(result.natural_frequencies.tolist()):
        known = expected.values[i] if expected and i < len(expected.values) else None
        difference = None if known is None else (freq / known - 1) * 100
        fits = difference is None or expected is None or abs(difference) <= expected.within
        if not fits:
            failing.append(i)
        cells.append((str(i + 1), freq, known, difference, "" if known is None else "fits" if fits else "does not fit"))
    columns = ("mode", "Hz", "expected Hz", "difference %", "")
    note = expected.source if expected else ""
    title = "Natural frequencies of the preloaded assembly"
    return Table("natural-frequencies", title, columns, tuple(cells), tuple(failing), note)


def _named(found: Found) -> tuple[str, str]:
    return found.route, found.estimator


def _identified(result: BoltedResult) -> Table:
    shown = [one.found for one in result.regenerated if np.isfinite(one.found.theta).all()]
    cells: list[tuple[Cell, ...]] = []
    for p, (name, unit) in enumerate(parameters(result)):
        cells.append((name, unit, *(float(found.theta[p]) for found in shown)))
    columns = ("parameter", "unit", *(f"{found.route}, {found.estimator}" for found in shown))
    note = (
        "Without noise. Band means are those of -(gamma^-1)_jk, which ISMM reduces to, over the bands of table 4-2; "
        "the multi-point connection is condensed to six DOFs. No true values exist: the reference points take the mean "
        "rigid motion of the faces under head and nut, with all their entries."
    )
    return Table("identified", "Identified joint parameters", columns, tuple(cells), (), note)


def _resonances(result: BoltedResult, key: str, title: str, *, transferred: bool = False) -> Table:
    peaks = result.transferred_peaks if transferred else result.peaks
    actual = result.transferred if transferred else result.actual
    cells: list[tuple[Cell, ...]] = []
    for one in result.regenerated:
        h = one.transferred if transferred else one.h
        amplitude, frequency = peak_errors(result.case.freq_hz, peaks, actual, h)
        cells.append((*_named(one.found), *(float(x) for pair in zip(frequency, amplitude, strict=True) for x in pair)))
    columns = ["joint DOFs by", "estimator"]
    for peak in peaks:
        columns += [f"{peak.direction} {peak.freq_hz:g} Hz: frequency %", "amplitude %"]
    note = (
        "Errors (4.12) and (4.11) in percent, sought within 15 % of the actual resonance, between the lines. The last "
        "row couples the beams by the full 6 x 6 K*(w) of the reference points. What remains is no matter of noise or "
        "of rotations: a joint between two points has no mass, and leaves out that the beams press on each other, too."
    )
    return Table(key, title, tuple(columns), tuple(cells), (), note)


def _noise(result: BoltedResult) -> Table:
    cells: list[tuple[Cell, ...]] = []
    free = {_named(one.found): one.found.theta for one in result.regenerated}
    for study in result.noisy:
        reference = free[study.route, study.estimator]
        for p, (name, unit) in enumerate(parameters(result)):
            low, middle, high = (float(x) for x in np.percentile(study.theta[:, p], [2.5, 50, 97.5]))
            named = (study.noise, study.route, study.estimator, name, unit)
            cells.append((*named, float(reference[p]), middle, low, high))
    columns = ("noise", "joint DOFs by", "estimator", "parameter", "unit", "without noise", "median", "2.5 %", "97.5 %")
    title = f"Identified joint parameters with noise, {result.n_realisations} realisations"
    return Table("noise", title, columns, tuple(cells))


def _unmeasured(result: BoltedResult) -> Table:
    joint = result.case.joint
    actual = np.concatenate([np.diagonal(joint.stiffness), np.diagonal(joint.damping)])
    cells: list[tuple[Cell, ...]] = []
    for p, (name, unit) in enumerate(parameters(result)):
        ratios = (float(one.theta[p] / actual[p]) for one in result.unmeasured)
        cells.append((name, unit, float(actual[p]), *ratios))
    columns = ("parameter", "unit", "actual", *(f"{one.name}: found / actual" for one in result.unmeasured))
    note = "Exact FRFs of the beams with the joint of table 4-1; the entries named are set to zero."
    return Table("unmeasured", "Effect of entries that cannot be measured (4.3.3.1)", columns, tuple(cells), (), note)


def _worst(result: BoltedResult, route: str, estimator: str, direction: str, *, transferred: bool = False) -> float:
    peaks = result.transferred_peaks if transferred else result.peaks
    actual = result.transferred if transferred else result.actual
    one = next(r for r in result.regenerated if (r.found.route, r.found.estimator) == (route, estimator))
    _, errors = peak_errors(result.case.freq_hz, peaks, actual, one.transferred if transferred else one.h)
    own = [float(e) for e, peak in zip(errors, peaks, strict=True) if peak.direction == direction]
    return max(own, default=0.0)


def bolted_summary(result: BoltedResult) -> list[str]:
    """Say in a few sentences what came out."""
    state = result.state
    slipping = sum(int(np.count_nonzero(one.slipping)) for one in state.interfaces.values())
    sentences = [
        f"A preload of {number(state.force)} N stretches the bolt by {1e6 * state.elongation:.1f} um; the contact "
        f"converged in {len(state.history)} iterations, {slipping} pairs slip, the lap is closed up to "
        f"{1e3 * state.contact_radius:.1f} mm from the axis.",
    ]
    frequencies = _frequencies(result)
    known = sum(row[2] is not None for row in frequencies.rows)
    if known:
        sentences.append(f"{known - len(frequencies.failing)} of {known} natural frequencies agree with the expected.")
    routes = dict.fromkeys((one.found.route, one.found.estimator) for one in result.regenerated)
    for transferred, what in ((False, "Regenerated"), (True, "Transferred to the other beam B")):
        each = "; ".join(
            f"{route} ({estimator}) "
            + " / ".join(number(_worst(result, route, estimator, d, transferred=transferred), 2) for d in "yx")
            for route, estimator in routes
        )
        sentences.append(f"{what}: largest error of a resonance in y / x, percent: {each}.")
    return sentences


def bolted_json(result: BoltedResult, tables: list[Table]) -> dict[str, Any]:
    """Return all numbers of a case as a structure for JSON."""
    return {
        **case_json(result.case, result.n_realisations, tables),
        "n_dofs": result.n_dofs,
        "preload_newton": result.state.force,
        "elongation_m": result.state.elongation,
        "natural_frequencies_hz": result.natural_frequencies.tolist(),
    }
