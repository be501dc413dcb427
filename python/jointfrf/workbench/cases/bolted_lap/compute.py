"""What a bolted lap joint yields: preloaded state, measured FRFs, the identified joint, regenerated FRFs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from msgspec import structs
from numpy.typing import NDArray
from scipy.interpolate import interp1d

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cases.bolted_lap.frfs import (
    TIP_DIRECTIONS,
    BeamFrfs,
    Resonance,
    ResonanceErrors,
    SolidFrfs,
    beam_frfs,
    resonance_errors,
    resonances,
    solid_frfs,
)
from jointfrf.workbench.cases.bolted_lap.keys import BoltedLapCase
from jointfrf.workbench.cases.bolted_lap.preload import PreloadedLap
from jointfrf.workbench.cases.bolted_lap.routes import (
    DOFS,
    FivePoints,
    Found,
    band_means,
    by_band_means,
    by_compliance_fit,
    fit_measured,
    joint_stiffness_lines,
    measured_entries,
    route_lines,
)
from jointfrf.workbench.cases.keys import Noise, constant_joint
from jointfrf.workbench.cases.kind import EstimateColumn, EstimateGroup, Estimates, StudyChoice, chosen_noises
from jointfrf.workbench.cases.workers import Workers

__all__ = [
    "LINES",
    "BoltedLapResult",
    "NoisyLap",
    "NoisyParameters",
    "RegeneratedTip",
    "Unmeasured",
    "compute_bolted_lap",
    "estimate_groups",
    "identify_noisy",
]

#: K* of the reference points as it is, without constants for the joint.
LINES = "K* line by line, cross terms"


class RegeneratedTip(NamedTuple):
    """FRFs of the tip with an identified joint, with B and with the other B.

    Attributes
    ----------
    found : Found
    h, transferred : ndarray, shape (n_freq, 2)
        Directions x and y, m/N.
    errors, transferred_errors : ResonanceErrors
        On lines as close as the loss factor asks for.
    """

    found: Found
    h: ComplexArray
    transferred: ComplexArray
    errors: ResonanceErrors
    transferred_errors: ResonanceErrors


class Unmeasured(NamedTuple):
    """What a known joint seems to be when some entries of exact FRFs are set to zero.

    Attributes
    ----------
    name : str
    k_lines : ndarray, shape (n_freq, 6, 6)
    theta, fitted : ndarray, shape (12,)
        Means over bands, and the compliance fit, cross terms ignored.
    shift : ndarray, shape (2,)
        Largest error (4.12) of a resonance of the tip in x and in y, regenerated with theta, percent.
    """

    name: str
    k_lines: ComplexArray
    theta: FloatArray
    fitted: FloatArray
    shift: FloatArray


class NoisyParameters(NamedTuple):
    """Parameters from noisy FRFs: one row of theta, and of errors of the resonances in percent, a realisation.

    Attributes
    ----------
    noise : str
    route, estimator : str
    theta : ndarray, shape (r, 12)
    shift : ndarray, shape (r, n_peaks)
        Error (4.12) of every resonance, x then y.
    found : ndarray of bool, shape (r, n_peaks)
        Where False, the shift is the limit of the search.
    """

    noise: str
    route: str
    estimator: str
    theta: FloatArray
    shift: FloatArray
    found: NDArray[np.bool_]


@dataclass(frozen=True)
class BoltedLapResult:
    """Results of a bolted lap joint.

    Attributes
    ----------
    case : BoltedLapCase
    n_realisations : int
    state : PreloadedLap
    n_dofs : int
        Of the solid model.
    natural_frequencies : ndarray, shape (n_modes,)
        Up to the last line, Hz.
    k_lines : dict
        Route to K* line by line, shape (n_freq, 6, 6).
    regenerated : list of RegeneratedTip
    actual, transferred : ndarray, shape (n_freq, 2)
        FRFs of the tip of the solid model, with B and with the other B, m/N.
    peaks, transferred_peaks : list of Resonance
    unmeasured : list of Unmeasured
    noisy : list of NoisyParameters
    """

    case: BoltedLapCase
    n_realisations: int
    state: PreloadedLap
    n_dofs: int
    natural_frequencies: FloatArray
    k_lines: dict[str, ComplexArray]
    regenerated: list[RegeneratedTip]
    actual: ComplexArray
    transferred: ComplexArray
    peaks: list[Resonance]
    transferred_peaks: list[Resonance]
    unmeasured: list[Unmeasured]
    noisy: list[NoisyParameters]


def compute_bolted_lap(case: BoltedLapCase, n_realisations: int, workers: Workers | None = None) -> BoltedLapResult:
    """Run a case of a bolted lap joint.

    Parameters
    ----------
    case : BoltedLapCase
    n_realisations : int
    workers : Workers, optional
        Processes that share the work; this process by default.

    Returns
    -------
    BoltedLapResult

    Raises
    ------
    ValueError
        A geometry that is not possible, a joint that cannot carry the preload.
    """
    at_work = workers or Workers()
    both = case.beams.lengths[1:]
    solids = at_work.map(solid_frfs, [case] * 2, both, (True, False))
    uncoupled = at_work.map(beam_frfs, [case] * 2, both)
    solid, other = solids
    beams = list(uncoupled)
    peaks, other_peaks = (resonances(one.tip_hz, one.tip) for one in (solid, other))
    # Processes repeat it with noise while the rest is done here.
    repeated = [
        (noise, at_work.map(identify_noisy, _realisations(case, noise, solid, n_realisations))) for noise in case.noises
    ]
    k_lines = route_lines(solid.points, solid.channels, solid.reference)
    regenerated = _regenerated(case, solid, beams, k_lines, (peaks, other_peaks))
    noisy: list[NoisyParameters] = []
    for noise, parts in repeated:
        done = list(at_work.counted(parts, n_realisations))
        noisy += _noise_studies(noise, beams[0], peaks, done)
    return BoltedLapResult(
        case=case,
        n_realisations=n_realisations,
        state=solid.state,
        n_dofs=len(solid.model.dofs),
        natural_frequencies=solid.natural_frequencies[solid.natural_frequencies <= case.freq_hz[-1]],
        k_lines=k_lines,
        regenerated=regenerated,
        actual=_on_case(case, solid),
        transferred=_on_case(case, other),
        peaks=peaks,
        transferred_peaks=other_peaks,
        unmeasured=_unmeasured(case, beams[0]),
        noisy=noisy,
    )


def _on_case(case: BoltedLapCase, solid: SolidFrfs) -> ComplexArray:
    """FRFs of the tip of a solid model on the lines of the case."""
    return solid.tip[np.searchsorted(solid.tip_hz, case.freq_hz)]


def _regenerated(
    case: BoltedLapCase,
    solid: SolidFrfs,
    beams: list[BeamFrfs],
    k_lines: dict[str, ComplexArray],
    peaks: tuple[list[Resonance], list[Resonance]],
) -> list[RegeneratedTip]:
    """FRFs of the tip with every identified joint, with both beams B."""
    found = by_band_means(case, k_lines) + by_compliance_fit(case, solid.points, solid.channels)
    freq = beams[0].freq_hz
    joints = [(one, constant_joint(one.theta, freq)) for one in found]
    # Last, all entries of K* of the reference points, line by line and linear between the lines.
    all_entries = interp1d(case.freq_hz, k_lines["reference points"], axis=0)(freq)
    joints.append((Found("reference points", LINES, np.full(12, np.nan)), all_entries))
    at = np.searchsorted(freq, case.freq_hz)
    regenerated = []
    for one, k_joint in joints:
        tips = [part.tip(k_joint) for part in beams]
        errors, other = (resonance_errors(freq, own, tip) for own, tip in zip(peaks, tips, strict=True))
        regenerated.append(RegeneratedTip(one, tips[0][at], tips[1][at], errors, other))
    return regenerated


def _unmeasured(case: BoltedLapCase, beams: BeamFrfs) -> list[Unmeasured]:
    """Set entries to zero that cannot be measured, in exact FRFs of beams with a known joint (section 4.3.3.1)."""
    h_c = beams.on(case.freq_hz).coupled(case.joint.dynamic_stiffness(case.freq_hz))
    gamma = np.ascontiguousarray(h_c[:, :12, :12])
    no_x, no_z = (np.ones((6, 6), bool) for _ in "xz")
    for mask, a, b in ((no_x, "x", "theta_z"), (no_z, "z", "theta_x")):
        i, j = DOFS.index(a), DOFS.index(b)
        mask[i, j] = mask[j, i] = False
    patterns = {
        "all entries": np.ones((6, 6), bool),
        "without x-theta_z (4.29)": no_x,
        "without z-theta_x (4.30)": no_z,
        "Measurements 1-4 (4.28)": measured_entries(),
    }
    masked = {name: gamma * np.tile(mask, (2, 2)) for name, mask in patterns.items()}
    found = []
    for name, h in masked.items():
        lines = joint_stiffness_lines(h)
        theta = band_means(case, lines)
        # Without some of its entries gamma belongs to no joint whose cross terms are zero.
        fit = fit_measured(case.freq_hz, DOFS, h, np.eye(12))
        fitted = np.concatenate([fit.stiffness, fit.damping])
        found.append(Unmeasured(name, lines, theta, fitted, _shift(case, beams, theta)))
    return found


def _shift(case: BoltedLapCase, beams: BeamFrfs, theta: FloatArray) -> FloatArray:
    """Largest errors of the resonances in x and in y where constants replace the known joint."""
    exact, tip = (beams.tip(constant_joint(one, beams.freq_hz)) for one in (case.actual, theta))
    peaks = resonances(beams.freq_hz, exact)
    errors = resonance_errors(beams.freq_hz, peaks, tip).frequency
    own = [[error for error, one in zip(errors, peaks, strict=True) if one.direction == d] for d in TIP_DIRECTIONS]
    return np.array([max(one, default=0.0) for one in own])


class NoisyLap(NamedTuple):
    """What a process needs for one noisy measurement.

    Attributes
    ----------
    case : BoltedLapCase
    noise : Noise
    points : tuple of FivePoints
    channels : ndarray, shape (n_freq, 30, 30)
        Exact FRFs of the measured points, m/N.
    number : int
        Of the realisation.
    """

    case: BoltedLapCase
    noise: Noise
    points: tuple[FivePoints, FivePoints]
    channels: ComplexArray
    number: int


def _realisations(case: BoltedLapCase, noise: Noise, solid: SolidFrfs, count: int) -> list[NoisyLap]:
    return [NoisyLap(case, noise, solid.points, solid.channels, i) for i in range(count)]


def identify_noisy(task: NoisyLap) -> list[Found]:
    """Identify the joint from one realisation of the noise, by the estimators that the noise asks for."""
    noise = task.noise
    h = noise.pollute(task.channels, task.case.seed, task.number)
    found = []
    if "ismm" in noise.methods:
        found += by_band_means(task.case, route_lines(task.points, h))
    if "compliance" in noise.methods:
        found += by_compliance_fit(task.case, task.points, h)
    return found


def _noise_studies(
    noise: Noise, beams: BeamFrfs, peaks: list[Resonance], parts: list[list[Found]]
) -> list[NoisyParameters]:
    """Put the realisations of every route and estimator together, with the resonances they regenerate."""
    studies = []
    for same in zip(*parts, strict=True):
        theta = np.array([found.theta for found in same])
        tips = (beams.tip(constant_joint(one, beams.freq_hz)) for one in theta)
        errors = [resonance_errors(beams.freq_hz, peaks, tip) for tip in tips]
        shift, inside = (np.array([getattr(one, what) for one in errors]) for what in ("frequency", "found"))
        studies.append(NoisyParameters(noise.name, same[0].route, same[0].estimator, theta, shift, inside))
    return studies


#: What finds K* from the FRFs of a route: the method of the thesis, and the fit.
_ESTIMATORS = ("ismm", "compliance")
#: Half of the central 95 % of a normal distribution, in standard deviations.
_REACH = 1.959963984540054


@dataclass(frozen=True)
class LapSource:
    """Realisations of the measurement at five points a side."""

    measured: NoisyLap

    def __call__(self, first: int, count: int) -> Estimates:
        """Identify the joint from each realisation."""
        numbers = range(first, first + count)
        return Estimates(
            *np.array([_row(identify_noisy(self.measured._replace(number=i))) for i in numbers]).swapaxes(0, 1)
        )


def _row(found: list[Found]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    theta = np.concatenate([one.theta for one in found])
    missing = np.full(len(found[0].theta), np.nan)
    errors = np.concatenate([missing if one.std_error is None else one.std_error for one in found])
    return theta, theta - _REACH * errors, theta + _REACH * errors


def estimate_groups(case: BoltedLapCase, choice: StudyChoice) -> list[EstimateGroup]:
    """Return what a study computes: every noise with every estimator, each by all of its routes.

    The joint that the solid model has is not known: there are no actual values.
    """
    if choice.own_estimators or choice.own_noises:
        raise ValueError("own estimator or noise in a case of kind bolted-lap; use a case of kind known-joint")
    for word in choice.estimators:
        if word not in _ESTIMATORS:
            hint = did_you_mean(word, _ESTIMATORS) or f"; use one of {', '.join(_ESTIMATORS)}"
            raise ValueError(f"unknown estimator {word!r} in a case of kind bolted-lap{hint}")
    solid = solid_frfs(case, case.beams.lengths[1], True)
    groups = []
    for noise in chosen_noises(case.noises, choice):
        for method in choice.estimators or noise.methods:
            own = NoisyLap(case, structs.replace(noise, methods=(method,)), solid.points, solid.channels, 0)
            columns = [
                EstimateColumn(f"{one.estimator}, {one.route}", parameter.name, parameter.unit, np.nan, np.nan)
                for one in identify_noisy(own)
                for parameter in case.parameters
            ]
            groups.append(EstimateGroup(noise.name, tuple(columns), LapSource(own)))
    return groups
