"""What a bolted lap joint yields: preloaded state, measured FRFs, the identified joint, regenerated FRFs."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.signal import find_peaks

from jointfrf.cases.bolted_lap.measurement import DOFS, Cross, both_sides, measured_entries
from jointfrf.cases.bolted_lap.read import BoltedCase
from jointfrf.cases.known_joint.read import Noise
from jointfrf.errors import ConvergenceWarning, IdentificationWarning, IllConditionedWarning
from jointfrf.frf.bands import Band, band_mean
from jointfrf.frf.metrics import amplitude_error, frequency_error
from jointfrf.frf.noise import pollute
from jointfrf.identification.identify import identify
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert
from jointfrf.solids.bolted_lap import bolted_lap
from jointfrf.solids.brick_beam import Hole, brick_beam
from jointfrf.solids.contact_pairs import ContactLaw
from jointfrf.solids.interpolation import interpolation
from jointfrf.solids.mesh import Mesh
from jointfrf.solids.preload import PreloadedLap, preload
from jointfrf.solids.solid import DIRECTIONS as SIX
from jointfrf.solids.solid import Patch, SolidModel, mean_motion
from jointfrf.substructuring.coupling import couple
from jointfrf.substructuring.ismm import inverse_substructuring
from jointfrf.substructuring.multi_point import multi_point_compliance

__all__ = ["BoltedResult", "Found", "NoiseStudy", "Regenerated", "Unmeasured", "compute_bolted"]

#: K* of the reference points as it is, without constants for the joint.
LINES = "K* line by line, cross terms"
#: Directions in which FRFs of the tip are compared.
DIRECTIONS = ("x", "y")
#: A regenerated resonance is sought within this share of the actual one.
_REACH = 0.15
#: Peaks count when they stand out from their surroundings by this factor.
_PROMINENCE = 1.5
_MODES = 7
_JOINT = list(range(6))


class Found(NamedTuple):
    """A joint as one route and one estimator see it.

    Attributes
    ----------
    route : str
        How the FRFs of the joint DOFs were won.
    estimator : {"band mean", "compliance fit"}
    theta : ndarray, shape (12,)
        Stiffness of the six DOFs, then damping.
    std_error : ndarray, shape (12,), or None
    """

    route: str
    estimator: str
    theta: FloatArray
    std_error: FloatArray | None = None


class Regenerated(NamedTuple):
    """FRFs of the tip with an identified joint, shape (n_freq, 2), directions x and y, m/N."""

    found: Found
    h: ComplexArray
    transferred: ComplexArray


class Unmeasured(NamedTuple):
    """What a known joint seems to be when some entries of exact FRFs are set to zero.

    Attributes
    ----------
    name : str
    k_lines : ndarray, shape (n_freq, 6, 6)
    theta : ndarray, shape (12,)
    """

    name: str
    k_lines: ComplexArray
    theta: FloatArray


class NoiseStudy(NamedTuple):
    """Parameters from noisy FRFs: one row of theta, and of errors of the resonances in percent, a realisation.

    Attributes
    ----------
    noise : str
    route, estimator : str
    theta : ndarray, shape (r, 12)
    shift : ndarray, shape (r, n_peaks)
        Error (4.12) of every resonance, x then y.
    """

    noise: str
    route: str
    estimator: str
    theta: FloatArray
    shift: FloatArray


@dataclass(frozen=True)
class Peak:
    """A resonance of the actual FRF: direction, frequency in Hz, and the band in which it is sought again."""

    direction: str
    freq_hz: float
    band: Band


@dataclass(frozen=True)
class BoltedResult:
    """Results of a bolted lap joint.

    Attributes
    ----------
    case : BoltedCase
    n_realisations : int
    state : PreloadedLap
    n_dofs : int
        Of the solid model.
    natural_frequencies : ndarray, shape (7,)
        Hz.
    k_lines : dict
        Route to K* line by line, shape (n_freq, 6, 6).
    regenerated : list of Regenerated
    actual, transferred : ndarray, shape (n_freq, 2)
        FRFs of the tip of the solid model, with B and with the other B, m/N.
    peaks, transferred_peaks : list of Peak
    unmeasured : list of Unmeasured
    noisy : list of NoiseStudy
    """

    case: BoltedCase
    n_realisations: int
    state: PreloadedLap
    n_dofs: int
    natural_frequencies: FloatArray
    k_lines: dict[str, ComplexArray]
    regenerated: list[Regenerated]
    actual: ComplexArray
    transferred: ComplexArray
    peaks: list[Peak]
    transferred_peaks: list[Peak]
    unmeasured: list[Unmeasured]
    noisy: list[NoiseStudy]


@dataclass(frozen=True)
class _Solid:
    """The preloaded solid model and its FRFs: at the measured channels, at six-DOF reference points, at the tip."""

    state: PreloadedLap
    model: SolidModel
    crosses: tuple[Cross, Cross]
    channels: ComplexArray
    reference: ComplexArray
    tip: ComplexArray


@dataclass(frozen=True)
class _Beams:
    """FRFs of the substructures: A at the joint; B at the joint, and at its tip in x and y."""

    h_a: ComplexArray
    h_b: ComplexArray

    def assembled(self, k_joint: ComplexArray) -> ComplexArray:
        """FRFs of the tip of the assembly in x and y, shape (n_freq, 2)."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", IllConditionedWarning)  # identified joints may be absurd
            h_c = couple(self.h_a, self.h_b, k_joint, _JOINT, _JOINT)
        return np.stack([h_c[:, at, at] for at in (12, 13)], axis=1)


def compute_bolted(
    case: BoltedCase,
    n_realisations: int | None = None,
    pool: Executor | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> BoltedResult:
    """Run a case of a bolted lap joint.

    Parameters
    ----------
    case : BoltedCase
    n_realisations : int, optional
        Instead of the number that the case names.
    pool : Executor, optional
        Processes that share the work.
    progress : callable
        Called with the numbers of parts done and in all.

    Returns
    -------
    BoltedResult

    Raises
    ------
    ValueError
        A geometry that is not possible, a joint that cannot carry the preload.
    """
    each = map if pool is None else pool.map
    count = case.realisations if n_realisations is None else n_realisations
    freq = case.freq_hz
    solids = each(partial(_solid, case), case.lengths[1:], (True, False))
    uncoupled = each(partial(_beams, case), case.lengths[1:])
    solid, other = solids
    beams = list(uncoupled)
    # Processes repeat it with noise while the rest is done here.
    repeated = [(noise, each(_identified, _realisations(case, noise, solid, count))) for noise in case.noises]
    gammas = _routes(solid.crosses, solid.channels) | {"reference points": solid.reference}
    k_lines = {route: _joint_lines(gamma) for route, gamma in gammas.items()}
    k_lines["multi-point"] = _multi_point(solid.crosses, solid.channels)
    found = [Found(route, "band mean", _band_means(case, k)) for route, k in k_lines.items()]
    found += _fits(case, solid.crosses, solid.channels)
    regenerated = [Regenerated(one, *(part.assembled(_as_lines(one.theta, freq)) for part in beams)) for one in found]
    whole = k_lines["reference points"]
    every = Found("reference points", LINES, np.full(12, np.nan))
    regenerated.append(Regenerated(every, *(part.assembled(whole) for part in beams)))
    peaks = _peaks(freq, solid.tip)
    natural_frequencies = solid.model.natural_frequencies(_MODES)
    noisy = []
    for noise, parts in repeated:
        done = []
        for part in parts:
            done.append(part)
            progress(len(done), count)
        noisy += _noisy(case, noise, solid, beams[0], peaks, done)
    return BoltedResult(
        case=case,
        n_realisations=count,
        state=solid.state,
        n_dofs=len(solid.model.dofs),
        natural_frequencies=natural_frequencies,
        k_lines=k_lines,
        regenerated=regenerated,
        actual=solid.tip,
        transferred=other.tip,
        peaks=peaks,
        transferred_peaks=_peaks(freq, other.tip),
        unmeasured=_unmeasured(case, beams[0]),
        noisy=noisy,
    )


def _solid(case: BoltedCase, length_b: float, measured: bool) -> _Solid:
    """Preload, linearise, and take the FRFs: all, or at the tip only."""
    lap = bolted_lap(
        (case.lengths[0], length_b), (case.height, case.height), case.width, case.overlap, case.hole_radius, case.bolt,
        materials=(case.material, case.material), preset=case.preset,
    )  # fmt: skip
    state = preload(lap, case.preload, ContactLaw(friction=case.friction))
    model = state.model()
    nodes = model.mesh.nodes
    on_j, on_k = (lap.axis + np.array([0, y, 0]) for y in (case.height, -case.height))
    crosses = (Cross(on_j, case.spacing), Cross(on_k, case.spacing))
    end = np.flatnonzero(nodes[:, 2] > nodes[:, 2].max() - 1e-9).astype(np.int32)
    weights = [_mean(model.mesh, end, nodes[end].mean(axis=0), DIRECTIONS)]
    if measured:
        weights += [interpolation(model.mesh, *cross.channels) for cross in crosses]
        rings = (lap.interfaces["head"].lower, lap.interfaces["nut"].upper)
        weights += [_mean(model.mesh, ring, at, DOFS) for ring, at in zip(rings, (on_j, on_k), strict=True)]
    ports = sparse.vstack(weights) @ model.expansion
    h = model.receptance(case.freq_hz, ports)
    return _Solid(
        state, model, crosses, np.ascontiguousarray(h[:, 2:32, 2:32]), np.ascontiguousarray(h[:, 32:, 32:]),
        np.stack([h[:, 0, 0], h[:, 1, 1]], axis=1),
    )  # fmt: skip


def _mean(mesh: Mesh, nodes: NDArray[np.int32], point: FloatArray, dofs: tuple[str, ...]) -> sparse.csr_array:
    """Weights of all nodes for the mean rigid motion of some about a point, DOFs in the order asked for."""
    return mean_motion(mesh, Patch(point, nodes))[[SIX.index(dof) for dof in dofs]]


def _beams(case: BoltedCase, length_b: float) -> _Beams:
    """FRFs of the beams by themselves, with reference points where the bolt presses."""
    size = (case.width, case.height, case.material)
    start = case.overlap / 2
    hole_a = Hole(case.lengths[0] - start, case.hole_radius, case.bolt.head_radius, "top", "joint")
    hole_b = Hole(start, case.hole_radius, case.bolt.nut_radius, "bottom", "joint")
    a = brick_beam(case.lengths[0], *size, ends=("clamped", "free"), hole=hole_a, preset=case.preset)
    b = brick_beam(length_b, *size, hole=hole_b, observed={"tip": length_b}, preset=case.preset)
    joint = [f"joint:{dof}" for dof in DOFS]
    tip = [f"tip:{axis}" for axis in DIRECTIONS]
    h_a, h_b = (model.receptance(case.freq_hz, model.ports(*names)) for model, names in ((a, joint), (b, joint + tip)))
    return _Beams(h_a, h_b)


def _routes(crosses: tuple[Cross, Cross], h: ComplexArray) -> dict[str, ComplexArray]:
    """FRFs of the joint DOFs j, then k, from those of the channels, shape (n_freq, 12, 12)."""
    by_differences, by_virtual_points = both_sides(*crosses)
    differences = by_differences @ h @ by_differences.T
    return {
        "Measurements 1-4": differences * np.tile(measured_entries(), (2, 2)),
        "central differences": differences,
        "virtual points": by_virtual_points @ h @ by_virtual_points.T,
    }


def _joint_lines(gamma: ComplexArray) -> ComplexArray:
    """K* = -(gamma^-1)_jk, which ISMM reduces to whatever the first estimate."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IllConditionedWarning)
        return inverse_substructuring(gamma, on_singular="nan")


def _multi_point(crosses: tuple[Cross, Cross], h: ComplexArray) -> ComplexArray:
    """K* of the equivalent multi-point connection: six forces pass the joint."""
    j, k = (cross.virtual_point for cross in crosses)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IdentificationWarning)
        return invert(multi_point_compliance(h, j, k, rank=6).equivalent)


def _band_means(case: BoltedCase, k_lines: ComplexArray) -> FloatArray:
    dofs = case.joint.dofs
    mean = band_mean(case.freq_hz, k_lines, {dof: case.bands_of(dof) for dof in dofs}, dofs)
    return np.concatenate([mean.stiffness, mean.damping])


def _fits(case: BoltedCase, crosses: tuple[Cross, Cross], h: ComplexArray) -> list[Found]:
    """Fits in the compliance domain over all lines, by differences and by virtual points."""
    found = []
    for route, transform in zip(("central differences", "virtual points"), both_sides(*crosses), strict=True):
        with warnings.catch_warnings():
            for category in (IdentificationWarning, IllConditionedWarning, ConvergenceWarning):
                warnings.simplefilter("ignore", category)
            fit = identify(
                case.freq_hz, h, case.joint.dofs, transform=transform, cross="ignore", noise=_ASSUMED,
            )  # fmt: skip
        names = [f"{letter}_{dof}" for letter in "kc" for dof in case.joint.dofs]
        errors = np.array([fit.std_error[name] for name in names])
        found.append(Found(route, "compliance fit", np.array([fit.parameters[name] for name in names]), errors))
    return found


#: Relative noise for the weights of a fit to data without any.
_ASSUMED = 0.01


def _as_lines(theta: FloatArray, freq: FloatArray) -> ComplexArray:
    diagonal: ComplexArray = theta[:6] + 2j * np.pi * freq[:, None] * theta[6:]
    return diagonal[:, :, None] * np.eye(6)


def _peaks(freq: FloatArray, tip: ComplexArray) -> list[Peak]:
    """Resonances of the FRFs of the tip, sought between the valleys on either side."""
    found = []
    for d, direction in enumerate(DIRECTIONS):
        size = np.log(abs(tip[:, d]))
        tops = find_peaks(size, prominence=np.log(_PROMINENCE))[0]
        parts = np.split(np.arange(freq.size), tops)
        valleys = [part[np.argmin(size[part])] for part in parts]
        for at, left, right in zip(tops, valleys, valleys[1:], strict=False):
            low, high = max(freq[left], freq[at] * (1 - _REACH)), min(freq[right], freq[at] * (1 + _REACH))
            found.append(Peak(direction, float(freq[at]), (float(low), float(high))))
    return found


def peak_errors(
    freq: FloatArray, peaks: list[Peak], actual: ComplexArray, h: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Errors (4.11) and (4.12) at every resonance, percent, shape (n_peaks,) each."""
    pairs = [(actual[:, d], h[:, d]) for p in peaks for d in [DIRECTIONS.index(p.direction)]]
    amplitude, frequency = (
        np.array([error(*pair, freq, p.band, refine=True) for p, pair in zip(peaks, pairs, strict=True)])
        for error in (amplitude_error, frequency_error)
    )
    return amplitude, frequency


def _unmeasured(case: BoltedCase, beams: _Beams) -> list[Unmeasured]:
    """Set entries to zero that cannot be measured, in exact FRFs of beams with a known joint (section 4.3.3.1)."""
    h_c = couple(beams.h_a, beams.h_b, case.joint.dynamic_stiffness(case.freq_hz), _JOINT, _JOINT)
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
    lines = {name: _joint_lines(gamma * np.tile(mask, (2, 2))) for name, mask in patterns.items()}
    return [Unmeasured(name, k, _band_means(case, k)) for name, k in lines.items()]


class _Realisation(NamedTuple):
    """What a process needs for one noisy measurement."""

    case: BoltedCase
    noise: Noise
    crosses: tuple[Cross, Cross]
    channels: ComplexArray
    number: int


def _realisations(case: BoltedCase, noise: Noise, solid: _Solid, count: int) -> list[_Realisation]:
    return [_Realisation(case, noise, solid.crosses, solid.channels, i) for i in range(count)]


def _noisy(
    case: BoltedCase, noise: Noise, solid: _Solid, beams: _Beams, peaks: list[Peak], parts: list[list[Found]]
) -> list[NoiseStudy]:
    """Put the realisations of every route and estimator together, with the resonances they regenerate."""
    studies = []
    for one in parts[0]:
        same = [f for part in parts for f in part if (f.route, f.estimator) == (one.route, one.estimator)]
        lines = [_as_lines(f.theta, case.freq_hz) for f in same]
        shift = [peak_errors(case.freq_hz, peaks, solid.tip, beams.assembled(k))[1] for k in lines]
        theta = np.array([f.theta for f in same])
        studies.append(NoiseStudy(noise.name, one.route, one.estimator, theta, np.array(shift)))
    return studies


def _identified(task: _Realisation) -> list[Found]:
    noise = task.noise
    h = pollute(
        task.channels, noise.level, noise.kind, task.case.seed, relative_to=noise.relative_to,
        reciprocal=noise.reciprocal, realisation=task.number,
    )  # fmt: skip
    gammas = _routes(task.crosses, h)
    k_lines = {route: _joint_lines(gamma) for route, gamma in gammas.items()}
    k_lines["multi-point"] = _multi_point(task.crosses, h)
    found = []
    if "ismm" in noise.methods:
        found += [Found(route, "band mean", _band_means(task.case, k)) for route, k in k_lines.items()]
    if "compliance" in noise.methods:
        found += _fits(task.case, task.crosses, h)
    return found
