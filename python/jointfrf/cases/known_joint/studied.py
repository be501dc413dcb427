"""A known joint in a study: the estimates of single realisations, and their Cramer-Rao bound."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from jointfrf.cases.definitions import BandSet, Noise
from jointfrf.cases.fitting import FITTED, METHODS, fit_decoupling
from jointfrf.cases.known_joint.exact import Exact, exact_frfs
from jointfrf.cases.known_joint.methods import SHORT_FORM, joint_lines, measured, needed_frfs, noise_stream
from jointfrf.cases.known_joint.read import KnownJointCase
from jointfrf.cases.known_joint.study import chunk_size, means_over_bands
from jointfrf.cases.studied import (
    Estimates,
    Estimator,
    Pollution,
    RealisationSource,
    StudiedColumn,
    StudiedGroup,
    StudyChoice,
    chosen_noises,
)
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.noise import NOISE_KINDS
from jointfrf.identification.information_bound import least_std_errors
from jointfrf.identification.realisations import FitStart, viscous_estimate
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.spelling import did_you_mean

__all__ = ["known_joint_studied"]

#: Starts of fits that a process keeps.
_STARTS = 32


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
class ComplianceSource:
    """Compliance fits, each begun where that of realisation 0 ends: a result depends on no other."""

    freq_hz: FloatArray
    dofs: tuple[str, ...]
    frfs: NoisyFrfs

    @cached_property
    def key(self) -> str:
        """What the start depends on."""
        content = hashlib.sha256(self.frfs.h.tobytes() + self.freq_hz.tobytes())
        return content.hexdigest() + repr((self.dofs, self.frfs.noise, self.frfs.seed))

    def __hash__(self) -> int:
        return hash(self.key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ComplianceSource) and self.key == other.key

    def __call__(self, first: int, count: int) -> Estimates:
        """Fit each realisation."""
        found = np.full((3, count, 2 * len(self.dofs)), np.nan)
        for i, gamma in enumerate(self.frfs(first, count)):
            try:
                values, intervals = viscous_estimate(self.freq_hz, gamma, self.dofs, _start_of(self))
            except (ValueError, ArithmeticError):
                continue  # no joint fits this realisation: it counts as failed
            found[:, i] = values, *intervals
        return Estimates(*found)


@lru_cache(_STARTS)
def _start_of(source: ComplianceSource) -> FitStart | None:
    """Fit realisation 0; None where no joint fits it."""
    try:
        return FitStart.of(source.freq_hz, source.frfs(0, 1)[0], source.dofs, damping="viscous")
    except (ValueError, ArithmeticError):
        return None


@dataclass(frozen=True)
class DecouplingFitSource:
    """Fits to the FRFs between internal points, given those of the substructures."""

    exact: Exact
    frfs: NoisyFrfs

    def __call__(self, first: int, count: int) -> Estimates:
        """Fit each realisation."""
        exact = self.exact
        known = (exact.h_a, exact.h_b)
        return Estimates.without_intervals(
            fit_decoupling(exact.freq_hz, exact.dofs, known, exact.k_initial, self.frfs(first, count))
        )


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
                f"an estimator must return {2 * len(self.dofs)} numbers: stiffness of {', '.join(self.dofs)}, then "
                f"damping, not an array of shape {found.shape[1:]}"
            )
        return Estimates.without_intervals(found)


def known_joint_studied(case: KnownJointCase, choice: StudyChoice) -> list[StudiedGroup]:
    """Return what a study computes: every noise with every method."""
    for word in choice.estimators:
        if word not in METHODS and word not in choice.own_estimators:
            raise ValueError(
                f"there is no estimator {word!r}{did_you_mean(word, METHODS) or ': ' + ', '.join(METHODS)}"
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
) -> StudiedGroup:
    at_joint = not method.startswith("decoupling")
    name, drawn = (noise.name, noise) if isinstance(noise, Noise) else noise
    h = measured(exact, "ismm" if method in choice.own_estimators else method)
    frfs = NoisyFrfs(h, drawn, case.seed + noise_stream(method))
    source: RealisationSource
    side_by_side, labels = 1, [method]
    if method in choice.own_estimators:
        source = OwnEstimatorSource(exact.freq_hz, exact.dofs, frfs, choice.own_estimators[method])
    elif method == "compliance":
        source = ComplianceSource(exact.freq_hz, exact.dofs, frfs)
    elif method in FITTED:
        source = DecouplingFitSource(needed_frfs(exact, method), frfs)
    else:
        short = SHORT_FORM.get(method, method)
        source = BandMeanSource(needed_frfs(exact, short), short, frfs, case.band_sets)
        side_by_side = source.side_by_side
        labels = [f"{method}, {one.name}" if len(case.band_sets) > 1 else method for one in case.band_sets]
    bound = _bound(exact, drawn) if at_joint else np.full(len(case.parameters), np.nan)
    columns = [
        StudiedColumn(label, parameter.name, parameter.unit, float(actual), float(least))
        for label in labels
        for parameter, actual, least in zip(case.parameters, case.actual, bound, strict=True)
    ]
    return StudiedGroup(name, tuple(columns), source, side_by_side)


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
