"""A joint at several levels: stiffness and loss factor over amplitude, from one fit each."""

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

#: Chance below which K* is taken to change over the lines of a test, and to do so in a way that no power of ln a
#: follows: then there is a warning, which must not befall one linear test in a hundred.
_CHANGES, _BENT = 0.05, 1e-4
#: Powers of ln a that are fitted at most.
_MOST = 3
#: Amplitudes of the fit that differ from those of the one before by less than this, e-fold, are found.
_SETTLED, _ROUNDS = 0.02, 4


@dataclass(frozen=True)
class JointLevel:
    """A DOF of a joint at one level.

    Attributes
    ----------
    label : str
        Name of the test.
    amplitude : float
        Of the relative motion, peak, m or rad, at which the stiffness was found; the geometric mean over the lines by
        their weight in the fit.
    lowest, highest : float
        Between which 95 % of that weight lie.
    order : int
        Up to which power of ln a K* was found to change over the lines; stiffness and loss factor are those at
        `amplitude`.
    force : float
        In the joint, peak, N or N m: |K*| times the amplitude.
    stiffness, loss_factor : Derived
        With standard error and interval; N/m or N m/rad, and 1.
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
        By DOF, lowest amplitude first.
    laws : dict of str to AmplitudeLawFits
        Of the DOFs that have levels enough.
    left_out : dict of str to str
        Tests that the command could not read or fit, by their files, and why.
    findings : tuple of Finding
    probability : float
        Of the intervals.
    joints : dict of str to LawJoint
        The joint at each level, by the labels of tests: springs of the secant stiffness in place of what was found,
        the rest as it was fitted. `write_joint` keeps it, `LawJoint.export` writes cards. None where a stiffness is
        not positive.
    """

    levels: dict[str, tuple[JointLevel, ...]]
    laws: dict[str, AmplitudeLawFits]
    left_out: dict[str, str]
    findings: tuple[Finding, ...]
    probability: float = 0.95
    joints: dict[str, LawJoint] = field(default_factory=dict)

    def __str__(self) -> str:
        """Return a table of each DOF, that of its laws, and the findings."""
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
    """Put fits of one joint at several levels together: k(a) and eta(a) over amplitude and force in the joint.

    Parameters
    ----------
    fits : sequence of Fit
        One for each level, of `identify` or `identify_model`, as they were made (not loaded); with `accept` if
        the amplitude changes over the lines, under a force held.
    drives : sequence of Drive
        What was held in each test.
    labels : sequence of str, optional
        Names of the tests; by default their numbers.
    laws : iterable of str
        Laws over amplitude that are fitted, as in `fit_amplitude_laws`; none where it is empty.
    probability : float
        Of the intervals.

    Returns
    -------
    JointLevels

    Raises
    ------
    ValueError
        Numbers of fits, drives and labels that differ; a fit without FRFs; a drive that does not belong to its fit; a
        joint without springs.

    Notes
    -----
    The relative motion on each line is that of the fit, times the force of that line. A fit of a constant K* to a joint
    whose K* goes with ln a gives its value at the mean of ln a, weighted by what each line adds to the parameter: this
    is the amplitude of the level, free of an error of first order.

    Where the amplitude changes over the lines by more than 1 %, fits with models are made again with K* linear in
    ln a, of the second and third power where these show (chance below 5 %, by the residual projected on dH/dK* times
    the next power beside all parameters); values are those at the amplitude of the level. What the powers miss, or all
    of it where there are no models, is a random departure of K* on each of some classes of amplitude. Its variance is
    estimated from the residual (moments), and belongs to the intervals, which then cover K* over the amplitudes of the
    test. A chance of the departures below 1e-4 is a warning.

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
    """Return levels in the order of their amplitude, with laws fitted to them where there are any to fit.

    `around` is the joint of each test beside the springs that were found.
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
    """Return the joint of a test with springs of its secant stiffness; None where one is not positive."""
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
    """A fit whose K* follows the amplitude: its lines and orders in ln a by DOF; where K* departs from them."""

    fit: Fit
    lines: dict[str, DofLines]
    orders: dict[str, int]
    doubts: list[Finding]


def _followed(fit: Fit, drive: Drive) -> _Followed:
    """Let K* follow the amplitude over the lines: linear in ln a where it changes, of higher powers where they show."""
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
    """Fit with K* of these orders in ln a, until the amplitudes are those of the fit."""
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
    """Return what is in doubt of a fit, but for how K* goes with amplitude, which is followed and no result."""
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
    else:  # the fit has no damping of this DOF: that of its residual
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
    """Return K* on the classes of amplitude: by the powers of ln a of the fit, and by what they miss."""
    order = one.orders[dof]
    x, value = one.lines[dof].departures(order).x, one.fit.value
    powers = (
        (value[f"k{i}_{dof}"] + 1j * value[f"h{i}_{dof}"]) * x**i / math.factorial(i) for i in range(1, order + 1)
    )
    return np.asarray(k * (1 + 1j * eta) + sum(powers, expected))


def _with_range(one: Derived, values: FloatArray) -> Derived:
    """Return a value whose interval contains others."""
    return one._replace(low=min(one.low, float(values.min())), high=max(one.high, float(values.max())))


def _normal(value: float, error: float, share: float) -> Derived:
    reach = float(ndtri((1 + share) / 2)) * error
    return Derived(value, error, value - reach, value + reach)


def _wider(one: Derived, error: float, degrees: float, share: float) -> Derived:
    """Return a value with another error, independent, whose variance was estimated."""
    if not error > 0:
        return one
    reach = float(stdtrit(degrees, (1 + share) / 2)) * error
    low, high = (one.value + sign * math.hypot(one.value - end, reach) for sign, end in ((-1, one.low), (1, one.high)))
    return Derived(one.value, math.hypot(one.std_error, error), low, high)


def _usable(own: Sequence[JointLevel]) -> tuple[list[JointLevel], str]:
    """Return the levels to which laws can be fitted, and what the others are."""
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
