"""Results of a bolted lap joint: preloaded state, measured FRFs, identified joint, and regenerated FRFs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import interp1d

from jointfrf.kernel.arguments import ComplexArray, FloatArray
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
    ESTIMATORS,
    FivePoints,
    Found,
    by_band_means,
    by_compliance_fit,
    fit_measured,
    joint_stiffness_lines,
    measured_entries,
    route_lines,
)
from jointfrf.workbench.cases.keys import Noise, constant_joint
from jointfrf.workbench.cases.kind import (
    Computed,
    EstimateColumn,
    EstimateGroup,
    Estimates,
    GroupEstimates,
    StudyChoice,
    chosen_noises,
)

__all__ = [
    "LINES",
    "BoltedLapResult",
    "NoisyParameters",
    "RegeneratedTip",
    "Unmeasured",
    "bolted_lap_result",
    "estimate_groups",
    "preloaded_frfs",
]

#: Name of the estimator that keeps K* of the reference points line by line.
LINES = "K* line by line, cross terms"


class RegeneratedTip(NamedTuple):
    """FRFs of the tip with an identified joint, with beam B and with the other beam B.

    Attributes
    ----------
    found : Found
        Identified joint.
    h, transferred : ndarray, shape (n_freq, 2)
        FRFs with B and with the other B in the directions x and y, m/N.
    errors, transferred_errors : ResonanceErrors
        Errors with B and with the other B, on lines that resolve the damping of the peaks.
    """

    found: Found
    h: ComplexArray
    transferred: ComplexArray
    errors: ResonanceErrors
    transferred_errors: ResonanceErrors


class Unmeasured(NamedTuple):
    """Apparent parameters of a known joint when some entries of exact FRFs are set to zero.

    Attributes
    ----------
    name : str
        Name of the remaining entries.
    k_lines : ndarray, shape (n_freq, 6, 6)
        K*(w) line by line, N/m.
    theta, fitted : ndarray, shape (12,)
        Parameters as means over bands, and by the compliance fit without cross terms.
    shift : ndarray, shape (2,)
        Largest error (4.12) of a resonance of the tip in x and in y, regenerated with `theta`, percent.
    """

    name: str
    k_lines: ComplexArray
    theta: FloatArray
    fitted: FloatArray
    shift: FloatArray


class NoisyParameters(NamedTuple):
    """Parameters from noisy FRFs and errors of the resonances, one row for each realisation.

    Attributes
    ----------
    noise : str
        Name of the noise.
    route, estimator : str
        Names of the route and of the estimator.
    theta : ndarray, shape (r, 12)
        Stiffness of the six DOFs, then damping.
    shift : ndarray, shape (r, n_peaks)
        Error (4.12) of every resonance, x then y, percent.
    found : ndarray of bool, shape (r, n_peaks)
        Whether a resonance was found; if False, `shift` is the limit of the search.
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
        Case with its keys.
    n_realisations : int
        Number of realisations of each noise.
    state : PreloadedLap
        Static state under preload.
    n_dofs : int
        Number of DOFs of the solid model.
    natural_frequencies : ndarray, shape (n_modes,)
        Natural frequencies up to the last line, Hz.
    k_lines : dict
        K* line by line, shape (n_freq, 6, 6), by route.
    regenerated : list of RegeneratedTip
        FRFs with every identified joint.
    actual, transferred : ndarray, shape (n_freq, 2)
        FRFs of the tip of the solid model, with B and with the other B, m/N.
    peaks, transferred_peaks : list of Resonance
        Resonances of these FRFs.
    unmeasured : list of Unmeasured
        Parameters without the entries that cannot be measured.
    noisy : list of NoisyParameters
        Parameters from noisy FRFs.
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


def preloaded_frfs(case: BoltedLapCase) -> SolidFrfs:
    """Return the FRFs of the preloaded solid model."""
    return solid_frfs(case, case.beams.length_b, True)


def bolted_lap_result(computed: Computed[BoltedLapCase, SolidFrfs]) -> BoltedLapResult:
    """Return the result of a case from its realisations."""
    case, solid, workers = computed.case, computed.frfs, computed.workers
    both = case.beams.lengths[1:]
    transferred = workers.begin(solid_frfs, case, both[1], False)
    uncoupled = workers.map(beam_frfs, [case] * 2, both)
    other, beams = transferred(), list(uncoupled)
    peaks, other_peaks = (resonances(one.tip_hz, one.tip) for one in (solid, other))
    k_lines = route_lines(solid.points, solid.channels, solid.reference)
    regenerated = _regenerated(case, solid, beams, k_lines, (peaks, other_peaks))
    return BoltedLapResult(
        case=case,
        n_realisations=computed.n_realisations,
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
        noisy=[one for group in computed.estimates() for one in _noisy(group, beams[0], peaks)],
    )


def _on_case(case: BoltedLapCase, solid: SolidFrfs) -> ComplexArray:
    """Return FRFs of the tip of a solid model on the lines of the case."""
    return solid.tip[np.searchsorted(solid.tip_hz, case.freq_hz)]


def _regenerated(
    case: BoltedLapCase,
    solid: SolidFrfs,
    beams: list[BeamFrfs],
    k_lines: dict[str, ComplexArray],
    peaks: tuple[list[Resonance], list[Resonance]],
) -> list[RegeneratedTip]:
    """Return FRFs of the tip with every identified joint, with both beams B."""
    found = by_band_means(case, k_lines) + by_compliance_fit(case, solid.points, solid.channels)
    freq = beams[0].freq_hz
    joints = [(one, constant_joint(one.theta, freq)) for one in found]
    # The last joint is K* of the reference points with all entries, interpolated linearly between the lines.
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
    """Return parameters of a known joint from exact FRFs without entries that cannot be measured (section 4.3.3.1)."""
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
        theta = case.bands.means(case.freq_hz, lines)
        # A matrix gamma with missing entries fits no joint without cross terms.
        fit = fit_measured(case.freq_hz, DOFS, h, np.eye(12))
        fitted = np.concatenate([fit.stiffness, fit.damping])
        found.append(Unmeasured(name, lines, theta, fitted, _shift(case, beams, theta)))
    return found


def _shift(case: BoltedLapCase, beams: BeamFrfs, theta: FloatArray) -> FloatArray:
    """Return the largest errors of the resonances in x and in y if constants replace the known joint."""
    exact, tip = (beams.tip(constant_joint(one, beams.freq_hz)) for one in (case.actual, theta))
    peaks = resonances(beams.freq_hz, exact)
    errors = resonance_errors(beams.freq_hz, peaks, tip).frequency
    own = [[error for error, one in zip(errors, peaks, strict=True) if one.direction == d] for d in TIP_DIRECTIONS]
    return np.array([max(one, default=0.0) for one in own])


def _noisy(found: GroupEstimates, beams: BeamFrfs, peaks: list[Resonance]) -> list[NoisyParameters]:
    """Return parameters of all realisations for every route of an estimator, with errors of the resonances."""
    estimator, routes = ESTIMATORS[found.group.method]
    studies = []
    for route, theta in zip(routes, np.split(found.estimates.values, len(routes), axis=1), strict=True):
        tips = (beams.tip(constant_joint(one, beams.freq_hz)) for one in theta)
        errors = [resonance_errors(beams.freq_hz, peaks, tip) for tip in tips]
        shift, inside = (np.array([getattr(one, name) for one in errors]) for name in ("frequency", "found"))
        studies.append(NoisyParameters(found.group.noise, route, estimator, theta, shift, inside))
    return studies


#: Half-width of the central 95 % interval of a normal distribution, in standard deviations.
_REACH = 1.959963984540054


@dataclass(frozen=True)
class LapSource:
    """Estimates of one estimator with all of its routes, from realisations of the measurement at five points per side.

    Attributes
    ----------
    case : BoltedLapCase
        Case with its keys.
    noise : Noise
        Noise of the realisations.
    method : str
        Key of `ESTIMATORS`.
    points : tuple of FivePoints
        Measured points on sides j and k.
    channels : ndarray, shape (n_freq, 30, 30)
        Exact FRFs of the measured points, m/N.
    """

    case: BoltedLapCase
    noise: Noise
    method: str
    points: tuple[FivePoints, FivePoints]
    channels: ComplexArray

    def __call__(self, first: int, count: int) -> Estimates:
        """Return the parameters of the joint from each realisation."""
        return Estimates(*np.array([self._identified(number) for number in range(first, first + count)]).swapaxes(0, 1))

    def _identified(self, number: int) -> FloatArray:
        h = self.noise.pollute(self.channels, self.case.seed, number)
        if self.method == "ismm":
            found = by_band_means(self.case, route_lines(self.points, h))
        else:
            found = by_compliance_fit(self.case, self.points, h)
        theta = np.concatenate([one.theta for one in found])
        errors = np.concatenate([np.full(12, np.nan) if one.std_error is None else one.std_error for one in found])
        return np.array([theta, theta - _REACH * errors, theta + _REACH * errors])


def estimate_groups(case: BoltedLapCase, solid: SolidFrfs, choice: StudyChoice | None) -> list[EstimateGroup]:
    """Return a group for every noise and estimator, each with all routes of the estimator.

    Columns have no actual values because the parameters of the joint of the solid model are unknown.
    """
    choice = choice or StudyChoice()
    groups = []
    for noise in chosen_noises(case.noises, choice):
        for method in choice.estimators or noise.methods:
            estimator, routes = ESTIMATORS[method]
            columns = tuple(
                EstimateColumn(f"{estimator}, {route}", parameter.name, parameter.unit, np.nan, np.nan)
                for route in routes
                for parameter in case.parameters
            )
            source = LapSource(case, noise, method, solid.points, solid.channels)
            groups.append(EstimateGroup(noise.name, method, columns, source))
    return groups
