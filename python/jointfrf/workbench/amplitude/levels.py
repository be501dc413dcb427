"""Stiffness and loss factor of a joint over amplitude, from a fit at each level."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri, stdtrit

from jointfrf.dofs import is_rotation
from jointfrf.identification.derived import Derived
from jointfrf.identification.result import Fit, columns_of
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_names, as_probability, check_choice
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.springs import SpringLaw
from jointfrf.messages.finding import Finding, WithFindings, worst_first
from jointfrf.workbench.amplitude.amplitude_laws import AMPLITUDE_LAWS, AmplitudeLawFits, fit_amplitude_laws
from jointfrf.workbench.amplitude.lines import DofLines, Drive, lines_of_fit, with_amplitude

__all__ = ["JointLevel", "JointLevels", "check_laws", "levels", "of_levels"]

#: p-values below which K* changes over the lines of a test, and below which it departs from every power of ln a. The
#: second one causes a warning, so it is far below 1 in 100 linear tests.
_CHANGES, _BENT = 0.05, 1e-4
#: Highest power of ln a that is fitted.
_MOST = 3
#: Change of the logarithm of the amplitudes between fits below which the iteration has converged.
_SETTLED, _ROUNDS = 0.02, 4


@dataclass(frozen=True)
class JointLevel:
    """A DOF of a joint at one level.

    Attributes
    ----------
    label : str
        Name of the test.
    amplitude : float
        Peak relative motion to which the stiffness belongs, m or rad: the geometric mean over the lines with their
        weight in the fit.
    lowest, highest : float
        Limits of the amplitudes with 95 % of the weight, m or rad.
    order : int
        Highest power of ln a by which K* changes over the lines; stiffness and loss factor are values at `amplitude`.
    force : float
        Peak force in the joint, N or N m: |K*| times the amplitude.
    stiffness, loss_factor : Derived
        Values at `amplitude` with standard error and interval; N/m or N m/rad, and 1.
    common : dict of str to (float, float)
        Parts of both standard errors that all levels share, with their signs, by the unknown of the models.
    """

    label: str
    amplitude: float
    lowest: float
    highest: float
    order: int
    force: float
    stiffness: Derived
    loss_factor: Derived
    common: dict[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class JointLevels(WithFindings):
    """A joint over amplitude; `print` shows it, `write_levels` makes a page.

    Attributes
    ----------
    levels : dict of str to tuple of JointLevel
        Levels by DOF, lowest amplitude first.
    laws : dict of str to AmplitudeLawFits
        Fitted laws by DOF, for DOFs with enough levels.
    left_out : dict of str to str
        Reason for each test that the command could not read or fit, by file.
    findings : tuple of Finding
        Warnings about fits and levels.
    probability : float
        Coverage probability of the intervals.
    joints : dict of str to LawJoint
        Joint at each level, by the labels of tests: the fitted joint with springs of the secant stiffness. Levels whose
        stiffness is not positive are left out. `write_joint` writes it to a file, `LawJoint.export` writes cards.
    """

    levels: dict[str, tuple[JointLevel, ...]]
    laws: dict[str, AmplitudeLawFits]
    left_out: dict[str, str]
    findings: tuple[Finding, ...]
    probability: float = 0.95
    joints: dict[str, LawJoint] = field(default_factory=dict)

    def __str__(self) -> str:
        """Return a table of each DOF, a table of its laws, and the findings."""
        parts = []
        for dof, own in self.levels.items():
            parts.append("\n".join(columns_of(level_rows(dof, own, self.probability))))
            if dof in self.laws:
                parts.append(str(self.laws[dof]))
        said = [str(one) for one in self.findings]
        return "\n\n".join([*parts, "\n".join(said)] if said else parts)


def level_rows(dof: str, own: Sequence[JointLevel], probability: float) -> list[tuple[str, ...]]:
    """Return the table of a DOF as text, its heading first."""
    motion, moment = ("rad", "N m") if is_rotation(dof) else ("m", "N")
    percent = f"{100 * probability:g} %"
    rows: list[tuple[str, ...]] = [
        (dof, f"amplitude, {motion}", "over the lines", f"force, {moment}", f"k, {moment}/{motion}", percent,
         "loss factor", percent)
    ]  # fmt: skip
    for one in own:
        k, eta = one.stiffness, one.loss_factor
        rows.append((
            one.label, f"{one.amplitude:.4g}", f"{one.lowest:.3g} .. {one.highest:.3g}", f"{one.force:.4g}",
            f"{k.value:.5g}", f"{k.low:.5g} .. {k.high:.5g}", f"{eta.value:.4g}", f"{eta.low:.3g} .. {eta.high:.3g}",
        ))  # fmt: skip
    return rows


def levels(
    fits: Sequence[Fit],
    drives: Sequence[Drive],
    *,
    labels: Sequence[str] | None = None,
    laws: Iterable[str] = AMPLITUDE_LAWS,
    probability: float = 0.95,
) -> JointLevels:
    """Return k(a) and eta(a) of a joint from its fits at several levels, over amplitude and force in the joint.

    Parameters
    ----------
    fits : sequence of Fit
        Fits by `identify` or `identify_model`, one for each level (not loaded from files). With a constant force, use
        `accept` if the amplitude changes over the lines.
    drives : sequence of Drive
        Controlled quantity of each test.
    labels : sequence of str, optional
        Names of the tests, default their numbers.
    laws : iterable of str
        Names of the laws to fit (see `fit_amplitude_laws`), default all; empty for no fit.
    probability : float
        Coverage probability of the intervals, default 0.95.

    Returns
    -------
    JointLevels
        Stiffness and loss factor at each level, and the laws.

    Raises
    ------
    ValueError
        Numbers of fits, drives and labels that differ; a fit without FRFs, a drive that does not belong to its fit, or
        a joint without springs.

    See Also
    --------
    fit_amplitude_laws : laws from stiffness and loss factor.
    decay_levels : stiffness and loss factor from free decays.
    write_levels : page of the levels.

    Notes
    -----
    The relative motion on each line is the motion that the fit predicts, times the force on the line. If K* is linear
    in ln a, a fit of a constant K* gives the value of K* at the weighted mean of ln a. The weight of a line is its
    contribution to the parameter. This mean is the amplitude of the level, without an error of first order.

    If the amplitude changes over the lines by more than 1 %, fits with models are repeated with K* linear in ln a. The
    second and third power are added if they are significant (5 %, score test with all parameters). Values are taken at
    the amplitude of the level. The departure of K* from the powers (without models, from a constant) is a random effect
    on classes of amplitude. Its variance is estimated from the residual by moments. The intervals include it, so that
    they cover K* over the amplitudes of the test. A p-value of the departures below 1e-4 causes a warning.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"], exact=True)
    >>> b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"], exact=True)
    >>> fits = []
    >>> for seed, k in enumerate([2000.0, 1900.0], start=1):
    ...     truth = jf.Assembly(a, b, jf.LawJoint({"x": jf.SpringLaw(k, h=0.05 * k)}))
    ...     h = jf.pollute(truth.receptance(freq, ["A/1:x"], ["A/1:x"]), 0.05, seed=seed)
    ...     fits.append(jf.identify_model(freq, h, truth, ["A/1:x"], ["A/1:x"]))
    >>> found = jf.levels(fits, [jf.Drive("joint", 1e-3, "x"), jf.Drive("joint", 4e-3, "x")], laws=["power"])
    >>> [(round(one.amplitude, 6), bool(one.stiffness.low < k < one.stiffness.high))
    ...  for one, k in zip(found.levels["x"], [2000, 1900])]
    [(0.001, True), (0.004, True)]
    """
    share, named = as_probability("probability", probability), _labels(fits, drives, labels)
    chosen = check_laws(laws)
    found: dict[str, list[JointLevel]] = {}
    findings, around = list[Finding](), dict[str, LawJoint | None]()
    for fit, drive, label in zip(fits, drives, named, strict=True):
        try:
            one = _followed(fit, drive)
        except ValueError as error:
            raise ValueError(f"{label}: {error}") from error
        if not one.lines:
            raise ValueError(f"{label}: no joint DOF is a spring with a stiffness; use a law spring for one DOF")
        findings += [*(replace(each, test=label) for each in one.doubts), *_of_fit(one, label)]
        around[label] = one.fit.laws
        for dof in one.lines:
            found.setdefault(dof, []).append(_level(one, dof, label, share))
    return of_levels(found, findings, chosen, share, around)


def check_laws(laws: Iterable[str]) -> tuple[str, ...]:
    """Return the names of laws over amplitude."""
    chosen = as_names("laws", laws)
    for law in chosen:
        check_choice("laws", law, AMPLITUDE_LAWS)
    return chosen


def of_levels(
    found: Mapping[str, Sequence[JointLevel]],
    findings: list[Finding],
    laws: Sequence[str],
    share: float,
    around: Mapping[str, LawJoint | None],
) -> JointLevels:
    """Return levels in the order of their amplitude, with the laws fitted to them.

    `around` is the joint of each test without the identified springs.
    """
    ordered = {dof: tuple(sorted(own, key=lambda one: one.amplitude)) for dof, own in found.items()}
    of_laws: dict[str, AmplitudeLawFits] = {}
    for dof, own in ordered.items():
        usable, why = _usable(own)
        try:
            of_laws |= {dof: _laws(usable, laws, share)} if laws and usable else {}
        except ValueError as error:
            findings.append(Finding("law-not-fitted", {"reason": str(error)}, (dof,)))
        if dof in of_laws and (best := of_laws[dof].fits[0]).widened > 1:
            numbers = {
                "law": best.law, "chi_square": best.chi_square, "degrees": best.degrees, "widened": best.widened
            }  # fmt: skip
            findings.append(Finding("law-misfit", numbers, (dof,)))
        if why:
            findings.append(Finding("law-not-fitted", {"reason": why}, (dof,)))
    joints = {label: joint for label, one in around.items() if (joint := _secant(found, label, one)) is not None}
    return JointLevels(ordered, of_laws, {}, worst_first(findings), share, joints)


def _secant(found: Mapping[str, Sequence[JointLevel]], label: str, around: LawJoint | None) -> LawJoint | None:
    """Return the joint of a test with springs of its secant stiffness, or None if one is not positive."""
    own = {dof: one for dof, levels in found.items() for one in levels if one.label == label}
    if min(one.stiffness.value for one in own.values()) <= 0:
        return None
    springs = {(dof, dof): SpringLaw(k := one.stiffness.value, h=k * one.loss_factor.value) for dof, one in own.items()}
    if around is None:
        return LawJoint(springs)
    return LawJoint({**around.laws, **springs}, around.rigid, around.mass, around.dofs)


def _labels(fits: Sequence[Fit], drives: Sequence[Drive], labels: Sequence[str] | None) -> tuple[str, ...]:
    for name, own, kind in (("fits", fits, Fit), ("drives", drives, Drive)):
        if not isinstance(own, Sequence) or not all(isinstance(one, kind) for one in own):
            raise TypeError(f"{name} has a wrong type; give a sequence of {kind.__name__}")
    if not fits or len(fits) != len(drives):
        raise ValueError(
            f"{len(fits)} fits and {len(drives)} drives; give one drive for each fit, and at least one fit"
        )
    named = tuple(f"level {i}" for i in range(1, len(fits) + 1)) if labels is None else as_names("labels", labels)
    if len(named) != len(fits) or len(set(named)) < len(named):
        raise ValueError(f"wrong labels; give {len(fits)} different names, one for each fit")
    return named


class _Followed(NamedTuple):
    """A fit whose K* depends on amplitude: lines and orders in ln a by DOF, and departures of K* from them."""

    fit: Fit
    lines: dict[str, DofLines]
    orders: dict[str, int]
    doubts: list[Finding]


def _followed(fit: Fit, drive: Drive) -> _Followed:
    """Return the fit with K* linear in ln a if the amplitude changes, or of higher order if it is significant."""
    lines = lines_of_fit(fit, drive)
    orders = dict.fromkeys(lines, 0)
    for dof in lines:
        while orders[dof] < _MOST and not lines[dof].is_held:
            if orders[dof] and lines[dof].bend(orders[dof] + 1).p_value > _CHANGES:
                break
            more = orders | {dof: orders[dof] + 1}
            changed = _refitted(fit, lines, drive, more)
            if changed is None:
                break
            (fit, lines), orders = changed, more
    chances = {
        dof: min(own.excess(orders[dof]).p_value, own.bend(orders[dof] + 1).p_value) for dof, own in lines.items()
    }
    doubts = [_not_smooth(dof, lines[dof], chance) for dof, chance in chances.items() if chance < _BENT]
    return _Followed(fit, lines, orders, doubts)


def _refitted(
    fit: Fit, lines: dict[str, DofLines], drive: Drive, orders: dict[str, int]
) -> tuple[Fit, dict[str, DofLines]] | None:
    """Fit K* with these orders in ln a, and repeat until the amplitudes no longer change."""
    for _ in range(_ROUNDS):
        found = with_amplitude(fit, lines, {dof: order for dof, order in orders.items() if order})
        if found is None:
            return None
        before, fit = lines, found
        lines = lines_of_fit(fit, drive)
        if set(lines) != set(before):
            return None
        change = [np.ptp(np.log(own.amplitude / before[dof].amplitude)) for dof, own in lines.items()]
        if max(change) < _SETTLED:
            break
    return fit, lines


def _of_fit(one: _Followed, label: str) -> list[Finding]:
    """Return the findings of a fit, except findings about the change of K* with amplitude, which the fit includes."""
    own = {each.name for each in one.fit.parameters if each.origin == "joint" and each.kind not in ("k", "h", "c", "m")}
    found = (each for each in one.fit.findings if each.severity != "note" and each.code != "amplitude-dependent")
    return [replace(each, test=label) for each in found if not own & set(each.about)]


def _not_smooth(dof: str, own: DofLines, chance: float) -> Finding:
    low, high = own.range()
    return Finding("amplitude-not-smooth", {"low": low, "high": high, "chance": chance}, (dof,))


def _level(one: _Followed, dof: str, label: str, share: float) -> JointLevel:
    fit, own, order = one.fit, one.lines[dof], one.orders[dof]
    k = fit.derived(f"{{k_{dof}}}", share)
    names = {each.name for each in fit.parameters}
    terms = {f"h_{dof}": "", f"c_{dof}": f"{own.omega!r} * "}
    lossy = " + ".join(f"{factor}{{{name}}}" for name, factor in terms.items() if name in names)
    if lossy:
        eta = fit.derived(f"({lossy}) / {{k_{dof}}}", share)
    else:  # the fit has no damping of this DOF: use the damping in its residual
        mean, error = own.departures(order).mean
        eta = _normal(mean.imag / k.value, error / abs(k.value), share)
    excess = own.excess(order)
    of_k, of_damping = np.sqrt(excess.variance).tolist()
    k, eta = (
        _wider(k, of_k, excess.degrees, share),
        _wider(eta, math.hypot(of_damping, eta.value * of_k) / abs(k.value), excess.degrees, share),
    )
    if any(dof in each.about for each in one.doubts):
        over = _over_classes(one, dof, k.value, eta.value, excess.expected)
        k, eta = _with_range(k, over.real), _with_range(eta, over.imag / over.real)
    a = own.mean_amplitude
    force = a * k.value * float(abs(1 + 1j * eta.value))
    return JointLevel(label, a, *own.range(), order, force, k, eta, _common(fit, dof, own.omega, eta.value))


def _common(fit: Fit, dof: str, omega: float, eta: float) -> dict[str, tuple[float, float]]:
    """Return the errors of stiffness and loss factor by one standard deviation of each prior of the models.

    With C the covariance, s the standard deviation of a prior: C[k, p] / s. Levels of one assembly share the prior.
    """
    names = [one.name for one in fit.parameters]
    k = names.index(f"k_{dof}")
    lossy = {names.index(name): factor for name, factor in ((f"h_{dof}", 1.0), (f"c_{dof}", omega)) if name in names}
    found = {}
    for i, one in enumerate(fit.parameters):
        if one.prior is not None and one.origin != "joint" and np.isfinite(fit.covariance[[k, *lossy], i]).all():
            of_k, of_h = fit.covariance[k, i], sum(factor * fit.covariance[j, i] for j, factor in lossy.items())
            size = one.prior[1] * fit.estimate[k]
            of_eta = (of_h - eta * of_k) / size if lossy else 0.0
            found[one.name] = (float(of_k / one.prior[1]), float(of_eta))
    return found


def _over_classes(one: _Followed, dof: str, k: float, eta: float, expected: ComplexArray) -> ComplexArray:
    """Return K* on the classes of amplitude: the polynomial in ln a of the fit, plus the expected departures."""
    order = one.orders[dof]
    x, value = one.lines[dof].departures(order).x, one.fit.value
    powers = (
        (value[f"k{i}_{dof}"] + 1j * value[f"h{i}_{dof}"]) * x**i / math.factorial(i) for i in range(1, order + 1)
    )
    return np.asarray(k * (1 + 1j * eta) + sum(powers, expected))


def _with_range(one: Derived, values: FloatArray) -> Derived:
    """Return a value whose interval contains further values."""
    return one._replace(low=min(one.low, float(values.min())), high=max(one.high, float(values.max())))


def _normal(value: float, error: float, share: float) -> Derived:
    reach = float(ndtri((1 + share) / 2)) * error
    return Derived(value, error, value - reach, value + reach)


def _wider(one: Derived, error: float, degrees: float, share: float) -> Derived:
    """Return a value whose interval includes a further independent error with estimated variance."""
    if not error > 0:
        return one
    reach = float(stdtrit(degrees, (1 + share) / 2)) * error
    low, high = (one.value + sign * math.hypot(one.value - end, reach) for sign, end in ((-1, one.low), (1, one.high)))
    return Derived(one.value, math.hypot(one.std_error, error), low, high)


def _usable(own: Sequence[JointLevel]) -> tuple[list[JointLevel], str]:
    """Return the levels to which laws can be fitted, and a description of the excluded levels."""
    good = [one for one in own if one.stiffness.std_error > 0 and one.loss_factor.std_error > 0]
    left = [one.label for one in own if one not in good]
    return good, f"{', '.join(left)}: stiffness or damping has no standard error" if left else ""


def _laws(own: Sequence[JointLevel], laws: Iterable[str], share: float) -> AmplitudeLawFits:
    k, eta = [one.stiffness for one in own], [one.loss_factor for one in own]
    return fit_amplitude_laws(
        [one.amplitude for one in own], [one.value for one in k], [one.value for one in eta],
        [one.std_error for one in k], [one.std_error for one in eta], common=_shared(own), laws=laws,
        probability=share,
    )  # fmt: skip


def _shared(own: Sequence[JointLevel]) -> FloatArray:
    """Return the errors that levels share, shape (n_errors, 2, n_levels)."""
    names = dict.fromkeys(name for one in own for name in one.common)
    found = [[one.common.get(name, (0.0, 0.0)) for one in own] for name in names]
    return np.array(found, float).reshape(len(names), len(own), 2).swapaxes(1, 2)
