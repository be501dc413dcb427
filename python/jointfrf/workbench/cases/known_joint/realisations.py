"""Many realisations of the noise, identified by several methods: for a case at once, for a study one by one."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from jointfrf.dofs import joint_parameters
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import in_bands
from jointfrf.frf.noise import NOISE_KINDS
from jointfrf.identification.information_bound import least_std_errors
from jointfrf.identification.model.realisations import RealisationFits
from jointfrf.identification.realisations import FitStart, viscous_estimate, viscous_joints
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cases.keys import FITTED, METHODS, BandSet, Noise
from jointfrf.workbench.cases.kind import (
    EstimateColumn,
    EstimateGroup,
    Estimates,
    Estimator,
    Pollution,
    RealisationSource,
    StudyChoice,
    chosen_noises,
)
from jointfrf.workbench.cases.known_joint.decoupling import decoupling_fits, fit_decoupling
from jointfrf.workbench.cases.known_joint.exact import (
    SHORT_FORM,
    Exact,
    exact_frfs,
    joint_lines,
    measured,
    needed_frfs,
    noise_stream,
)
from jointfrf.workbench.cases.known_joint.keys import KnownJointCase
from jointfrf.workbench.cases.workers import Workers

__all__ = ["ALL_LINES", "Identified", "chunk_size", "estimate_groups", "estimate_realisations", "means_over_bands"]

#: Lines, and entries of their FRF matrices, treated at once, over realisations: bound the memory to some tens of MB.
_CHUNK, _CHUNK_ENTRIES = 20_000, 1_500_000
#: Realisations whose K*(w) is kept line by line, for figures.
_KEPT = 200
#: The bands of a fit that takes every line.
ALL_LINES = "all lines"


@dataclass(frozen=True)
class Identified:
    """What one method finds at one noise level, with one set of bands.

    Attributes
    ----------
    noise, method, bands : str
        Names.
    theta : ndarray, shape (n_realisations, n_parameters)
        Parameters: stiffness of all DOFs, then damping.
    k_lines : ndarray, shape (n_kept, n_freq, n)
        Diagonal of K* line by line for the first realisations; empty for a fit over all lines.
    theta_kj : ndarray, shape (n_realisations, n_parameters) or (0, n_parameters)
        For "ismm", which takes K* from D_jk: the parameters from D_kj of the same FRFs.
    """

    noise: str
    method: str
    bands: str
    theta: FloatArray
    k_lines: ComplexArray
    theta_kj: FloatArray


@dataclass(frozen=True)
class _Chunk:
    """One method on some realisations of one noise; `exact` without the FRFs that the method does not take."""

    exact: Exact
    measured: ComplexArray
    noise: Noise
    method: str
    band_sets: tuple[BandSet, ...]
    seed: int
    first: int
    count: int


def chunk_size(n_freq: int, entries: int) -> int:
    """Return how many realisations of `n_freq` lines, with so many entries each, are treated at once."""
    return max(1, min(_CHUNK, _CHUNK_ENTRIES // entries) // n_freq)


class _ChunkResult(NamedTuple):
    """What comes out of a chunk: arrays as in `Identified`, the parameters for each set of bands."""

    theta: FloatArray
    k_lines: ComplexArray
    theta_kj: FloatArray


def _identify(chunk: _Chunk) -> _ChunkResult:
    exact, method = chunk.exact, chunk.method
    seed = chunk.seed + noise_stream(method)
    frfs = NoisyFrfs(chunk.measured, chunk.noise, seed)
    with warnings.catch_warnings():
        # Noise makes any line ill-conditioned now and then.
        warnings.simplefilter("ignore", IllConditionedWarning)
        if method in FITTED:
            theta = _fit_source(exact, method, frfs).joints(chunk.first, chunk.count)
            no_lines = np.empty((0, exact.freq_hz.size, exact.n), np.complex128)
            return _ChunkResult(theta[None], no_lines, np.empty((1, 0, theta.shape[1])))
        h = frfs(chunk.first, chunk.count)
        k_joint = joint_lines(exact, method, h, "nan")
        of_kj = joint_lines(exact, "ismm-kj", h, "nan") if method == "ismm" else k_joint[:0]
    kept = max(0, min(chunk.count, _KEPT - chunk.first))
    k_lines = np.diagonal(k_joint[:kept], axis1=2, axis2=3).copy()
    theta, theta_kj = (
        np.array([means_over_bands(exact, k, band_set) for band_set in chunk.band_sets]) for k in (k_joint, of_kj)
    )
    return _ChunkResult(theta, k_lines, theta_kj)


def means_over_bands(exact: Exact, k_joint: ComplexArray, band_set: BandSet) -> FloatArray:
    """Mean of Re K* and Im K*/w of several realisations, each parameter over its own bands.

    Parameters
    ----------
    exact : Exact
        Names the lines and the n DOFs.
    k_joint : ndarray, shape (r, n_freq, n, n)
        N/m.
    band_set : BandSet

    Returns
    -------
    ndarray, shape (r, 2 n)
        Stiffness of all DOFs, then damping.
    """
    found = np.empty((len(k_joint), 2 * exact.n))
    for p, parameter in enumerate(joint_parameters(exact.dofs)):
        inside, d = in_bands(exact.freq_hz, band_set.bands[parameter]), p % exact.n
        lines = k_joint[:, inside, d, d]
        values = lines.real if p < exact.n else lines.imag / (2 * np.pi * exact.freq_hz[inside])
        found[:, p] = values.mean(axis=1)
    return found


def estimate_realisations(
    case: KnownJointCase, exact: Exact, n_realisations: int, workers: Workers | None = None
) -> list[Identified]:
    """Identify the joint of a case from many realisations of every noise by every method.

    Parameters
    ----------
    case : KnownJointCase
    exact : Exact
        Its noise-free FRFs.
    n_realisations : int
    workers : Workers, optional
        Where chunks are computed; in this process by default.

    Returns
    -------
    list of Identified
        One for each noise, method and set of bands (`ALL_LINES` for fits). A realisation depends on the
        seed and its own number only: neither on `workers` nor on how many there are.
    """
    at_work = workers or Workers()
    groups = [(noise, method) for noise in case.noises for method in noise.methods]
    taken = {method: (needed_frfs(exact, method), measured(exact, method)) for _, method in groups}
    size = chunk_size(case.freq_hz.size, (2 * exact.n) ** 2)
    spans = [(first, min(size, n_realisations - first)) for first in range(0, n_realisations, size)]
    chunks = [
        _Chunk(*taken[method], noise, method, case.band_sets, case.seed, first, count)
        for noise, method in groups
        for first, count in spans
    ]
    parts = list(at_work.counted(at_work.map(_identify, chunks), len(chunks)))
    found = []
    for i, (noise, method) in enumerate(groups):
        own = parts[i * len(spans) : (i + 1) * len(spans)]
        theta, theta_kj = (np.concatenate([getattr(p, x) for p in own], axis=1) for x in ("theta", "theta_kj"))
        k_lines = np.concatenate([part.k_lines for part in own])
        names = [ALL_LINES] if method in FITTED else [band_set.name for band_set in case.band_sets]
        found += [Identified(noise.name, method, name, theta[b], k_lines, theta_kj[b]) for b, name in enumerate(names)]
    return found


#: Starts of fits that a process keeps; those of decoupling hold derivatives of all FRFs.
_STARTS, _DECOUPLING_STARTS = 32, 2
#: Realisations that a decoupling fit may begin with: of one in some hundred the residual does not look like noise.
_TRIES = 3


@dataclass(frozen=True)
class NoisyFrfs:
    """Realisations of the FRFs that a method takes.

    Attributes
    ----------
    h : ndarray, shape (n_freq, m, m)
        Exact FRFs, m/N.
    noise : Noise or callable
    seed : int
    """

    h: ComplexArray
    noise: Noise | Pollution
    seed: int

    def __call__(self, first: int, count: int) -> ComplexArray:
        """Return realisations first to first + count - 1, shape (count, n_freq, m, m)."""
        if isinstance(self.noise, Noise):
            return self.noise.realisations(self.h, self.seed, first, count)
        return np.array([self.noise(self.h, self.seed, number) for number in range(first, first + count)])


@dataclass(frozen=True)
class BandMeanSource:
    """Means of K* over bands, of many realisations side by side.

    Attributes
    ----------
    exact : Exact
        Without the FRFs that the method does not take.
    method : str
    frfs : NoisyFrfs
    band_sets : tuple of BandSet
    """

    exact: Exact
    method: str
    frfs: NoisyFrfs
    band_sets: tuple[BandSet, ...]

    def __call__(self, first: int, count: int) -> Estimates:
        """Compute as many realisations in one call as lie in the cache, always the same ones together.

        Lines are computed side by side, and one among different neighbours differs by rounding.
        """
        size = self.side_by_side
        start = first - first % size
        parts = [self._means(at, size) for at in range(start, first + count, size)]
        return Estimates.without_intervals(np.concatenate(parts)[first - start : first - start + count])

    @property
    def side_by_side(self) -> int:
        """Realisations computed in one call."""
        return chunk_size(self.exact.freq_hz.size, self.frfs.h[0].size)

    def _means(self, first: int, count: int) -> FloatArray:
        with warnings.catch_warnings():
            # Noise makes any line ill-conditioned now and then.
            warnings.simplefilter("ignore", IllConditionedWarning)
            k_joint = joint_lines(self.exact, self.method, self.frfs(first, count), "nan")
        return np.concatenate([means_over_bands(self.exact, k_joint, one) for one in self.band_sets], axis=1)


@dataclass(frozen=True)
class FitSource:
    """Fits, each begun where that of an early realisation ends: a result depends on no other.

    Attributes
    ----------
    exact : Exact
        Without the FRFs that the method does not take.
    frfs : NoisyFrfs
    """

    exact: Exact
    frfs: NoisyFrfs

    @cached_property
    def key(self) -> str:
        """What the start depends on."""
        exact, content = self.exact, hashlib.sha256()
        for array in (exact.freq_hz, exact.h_a, exact.h_b, exact.k_initial, self.frfs.h):
            content.update(array.tobytes())
        return content.hexdigest() + repr((exact.dofs, self.frfs.noise, self.frfs.seed))

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, FitSource) and self.key == other.key


class ComplianceSource(FitSource):
    """Compliance fits."""

    def __call__(self, first: int, count: int) -> Estimates:
        """Fit each realisation."""
        found = np.full((3, count, 2 * self.exact.n), np.nan)
        for i, gamma in enumerate(self.frfs(first, count)):
            try:
                values, intervals = viscous_estimate(self.exact.freq_hz, gamma, self.exact.dofs, _start_of(self))
            except (ValueError, ArithmeticError):
                continue  # no joint fits this realisation: it counts as failed
            found[:, i] = values, *intervals
        return Estimates(*found)

    def joints(self, first: int, count: int) -> FloatArray:
        """Return stiffness of all DOFs, then damping, of each realisation, shape (count, 2 n)."""
        return viscous_joints(self.exact.freq_hz, self.frfs(first, count), self.exact.dofs, _start_of(self))


@lru_cache(_STARTS)
def _start_of(source: ComplianceSource) -> FitStart | None:
    """Fit realisation 0; None where no joint fits it."""
    try:
        return FitStart.of(source.exact.freq_hz, source.frfs(0, 1)[0], source.exact.dofs, damping="viscous")
    except (ValueError, ArithmeticError):
        return None


class DecouplingFitSource(FitSource):
    """Fits to the FRFs between internal points, given those of the substructures."""

    def __call__(self, first: int, count: int) -> Estimates:
        """Fit each realisation."""
        return Estimates.without_intervals(self.joints(first, count))

    def joints(self, first: int, count: int) -> FloatArray:
        """Return stiffness of all DOFs, then damping, of each realisation, shape (count, 2 n)."""
        return fit_decoupling(_decoupling_fits_of(self), self.frfs(first, count))


@lru_cache(_DECOUPLING_STARTS)
def _decoupling_fits_of(source: DecouplingFitSource) -> RealisationFits:
    exact = source.exact
    first = (source.frfs(number, 1)[0] for number in range(_TRIES))
    return decoupling_fits(exact.freq_hz, exact.dofs, (exact.h_a, exact.h_b), exact.k_initial, first)


def _fit_source(exact: Exact, method: str, frfs: NoisyFrfs) -> ComplianceSource | DecouplingFitSource:
    return (ComplianceSource if method == "compliance" else DecouplingFitSource)(needed_frfs(exact, method), frfs)


@dataclass(frozen=True)
class OwnEstimatorSource:
    """An estimator of the caller."""

    freq_hz: FloatArray
    dofs: tuple[str, ...]
    frfs: NoisyFrfs
    estimator: Estimator

    def __call__(self, first: int, count: int) -> Estimates:
        """Call it for each realisation."""
        drawn = self.frfs(first, count)
        found = np.array([self.estimator(self.freq_hz, gamma, self.dofs) for gamma in drawn], float)
        if found.shape != (count, 2 * len(self.dofs)):
            raise ValueError(
                f"an estimator returned an array of shape {found.shape[1:]}; return {2 * len(self.dofs)} numbers, "
                f"stiffness of {', '.join(self.dofs)}, then damping"
            )
        return Estimates.without_intervals(found)


def estimate_groups(case: KnownJointCase, choice: StudyChoice) -> list[EstimateGroup]:
    """Return what a study computes: every noise with every method."""
    for word in choice.estimators:
        if word not in METHODS and word not in choice.own_estimators:
            raise ValueError(
                f"unknown estimator {word!r}{did_you_mean(word, METHODS) or '; use one of ' + ', '.join(METHODS)}"
            )
    exact = exact_frfs(case)
    return [
        _group(case, exact, noise, method, choice)
        for noise, methods in _noises(case, choice)
        for method in dict.fromkeys((*(choice.estimators or methods), *choice.own_estimators))
    ]


def _noises(
    case: KnownJointCase, choice: StudyChoice
) -> Iterator[tuple[Noise | tuple[str, Pollution], tuple[str, ...]]]:
    """Give noises and the methods that the case names for each."""
    if choice.own_noises:
        methods = case.noises[0].methods
        yield from ((own, methods) for own in choice.own_noises.items())
    else:
        yield from ((noise, noise.methods) for noise in chosen_noises(case.noises, choice))


def _group(
    case: KnownJointCase, exact: Exact, noise: Noise | tuple[str, Pollution], method: str, choice: StudyChoice
) -> EstimateGroup:
    at_joint = not method.startswith("decoupling")
    name, drawn = (noise.name, noise) if isinstance(noise, Noise) else noise
    h = measured(exact, "ismm" if method in choice.own_estimators else method)
    frfs = NoisyFrfs(h, drawn, case.seed + noise_stream(method))
    source: RealisationSource
    side_by_side, labels = 1, [method]
    if method in choice.own_estimators:
        source = OwnEstimatorSource(exact.freq_hz, exact.dofs, frfs, choice.own_estimators[method])
    elif method in FITTED:
        source = _fit_source(exact, method, frfs)
    else:
        short = SHORT_FORM.get(method, method)
        source = BandMeanSource(needed_frfs(exact, short), short, frfs, case.band_sets)
        side_by_side = source.side_by_side
        labels = [f"{method}, {one.name}" if len(case.band_sets) > 1 else method for one in case.band_sets]
    bound = _bound(exact, drawn) if at_joint else np.full(len(case.parameters), np.nan)
    columns = [
        EstimateColumn(label, parameter.name, parameter.unit, float(actual), float(least))
        for label in labels
        for parameter, actual, least in zip(case.parameters, case.actual, bound, strict=True)
    ]
    return EstimateGroup(name, tuple(columns), source, side_by_side)


def _bound(exact: Exact, noise: Noise | Pollution) -> FloatArray:
    """Return least standard deviations without a model of the sides; NaN where noise is shared, or not circular."""
    missing = np.full(2 * exact.n, np.nan)
    if not isinstance(noise, Noise) or not NOISE_KINDS[noise.kind].is_circular or noise.reciprocal or noise.block > 1:
        return missing
    gamma = exact.interface(exact.h_c)
    size: FloatArray = np.abs(gamma)
    if noise.relative_to == "line":
        size = np.broadcast_to(size.max(axis=(1, 2), keepdims=True), size.shape)
    elif noise.relative_to == "spectrum":
        size = np.full(size.shape, size.max())
    variance: FloatArray = NOISE_KINDS[noise.kind].power * (noise.level * size) ** 2
    if not variance.all():
        return missing
    return least_std_errors(exact.freq_hz, gamma, variance)
