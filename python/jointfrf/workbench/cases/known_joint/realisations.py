"""Estimates by several methods from realisations of the noise, for cases and for studies."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.noise import NOISE_KINDS
from jointfrf.identification.information_bound import least_std_errors
from jointfrf.identification.model.realisations import RealisationFits
from jointfrf.identification.realisations import FitStart, viscous_estimate, viscous_joints
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.workbench.cases.keys import FITTED, BandSet, Noise
from jointfrf.workbench.cases.kind import (
    EstimateColumn,
    EstimateGroup,
    Estimates,
    Estimator,
    GroupEstimates,
    Pollution,
    RealisationSource,
    StudyChoice,
    chosen_noises,
)
from jointfrf.workbench.cases.known_joint.decoupling import decoupling_fits, fit_decoupling
from jointfrf.workbench.cases.known_joint.exact import (
    SHORT_FORM,
    Exact,
    joint_lines,
    measured,
    needed_frfs,
    noise_stream,
)
from jointfrf.workbench.cases.known_joint.keys import KnownJointCase

__all__ = ["ALL_LINES", "Identified", "chunk_size", "estimate_groups", "identified_joints"]

#: Most lines, and entries of their FRF matrices, in one chunk of realisations; limits memory to some tens of MB.
_CHUNK, _CHUNK_ENTRIES = 20_000, 1_500_000
#: Number of realisations whose K*(w) is kept line by line for figures.
_KEPT = 200
#: Name of the bands of a fit that uses every line.
ALL_LINES = "all lines"


@dataclass(frozen=True)
class Identified:
    """Parameters identified by one method at one noise level with one set of bands.

    Attributes
    ----------
    noise, method, bands : str
        Names of the noise, the method and the set of bands.
    theta : ndarray, shape (n_realisations, n_parameters)
        Stiffness of all DOFs, then damping.
    k_lines : ndarray, shape (n_kept, n_freq, n)
        Diagonal of K* line by line for the first realisations; empty for a fit over all lines.
    theta_kj : ndarray, shape (n_realisations, n_parameters) or (0, n_parameters)
        Parameters of "ismm" from the block D_kj, in addition to the block D_jk; empty for other methods.
    """

    noise: str
    method: str
    bands: str
    theta: FloatArray
    k_lines: ComplexArray
    theta_kj: FloatArray


def chunk_size(n_freq: int, entries: int) -> int:
    """Return the number of realisations in one chunk, with `n_freq` lines and so many entries for each line."""
    return max(1, min(_CHUNK, _CHUNK_ENTRIES // entries) // n_freq)


def identified_joints(case: KnownJointCase, found: Sequence[GroupEstimates]) -> list[Identified]:
    """Return the joints that the methods of a case identify.

    Parameters
    ----------
    case : KnownJointCase
        Case with noises, methods and bands.
    found : sequence of GroupEstimates
        Estimates of the groups that `estimate_groups` returns without a choice.

    Returns
    -------
    list of Identified
        One object for each noise, method and set of bands (`ALL_LINES` for fits).

    See Also
    --------
    estimate_groups : Groups of estimates.
    """
    joints = []
    n = len(case.joint.dofs)
    by_name = {(one.group.noise, one.group.method): one for one in found}
    for noise in case.noises:
        for method in dict.fromkeys(noise.methods):
            one = by_name[noise.name, method]
            theta, theta_kj = one.estimates.values, one.estimates.values[:0]
            if method == "ismm":
                theta_kj = by_name[noise.name, "ismm-kj"].estimates.values
            k_lines = np.array(one.details, complex).reshape(-1, case.freq_hz.size, n)
            names = [ALL_LINES] if method in FITTED else [band_set.name for band_set in case.band_sets]
            for b, name in enumerate(names):
                own = slice(2 * n * b, 2 * n * (b + 1))
                joints.append(Identified(noise.name, method, name, theta[:, own], k_lines, theta_kj[:, own]))
    return joints


#: Numbers of initial fits in the cache of a process; decoupling fits are large because they contain derivatives.
_STARTS, _DECOUPLING_STARTS = 32, 2
#: Number of realisations tried as the initial fit of decoupling; about one in some hundred has no noise-like residual.
_TRIES = 3


@dataclass(frozen=True)
class NoisyFrfs:
    """Realisations of the FRFs that a method uses.

    Attributes
    ----------
    h : ndarray, shape (n_freq, m, m)
        Exact FRFs, m/N.
    noise : Noise or callable
        Noise of the case, or `Pollution` of the user.
    seed : int
        Seed of the noise.
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
    """Means of K* over bands, for many realisations in one call.

    Attributes
    ----------
    exact : Exact
        FRFs that the method uses from a model.
    method : str
        Name of the method.
    frfs : NoisyFrfs
        Realisations of the measured FRFs.
    band_sets : tuple of BandSet
        Sets of bands.
    """

    exact: Exact
    method: str
    frfs: NoisyFrfs
    band_sets: tuple[BandSet, ...]

    def __call__(self, first: int, count: int) -> Estimates:
        """Return estimates of realisations, computed in fixed chunks that fit into the cache.

        The rounding of a line depends on the other lines of its chunk, so chunks do not depend on the call.
        """
        size = self.side_by_side
        start = first - first % size
        parts = [self._means(self._lines(at, size)) for at in range(start, first + count, size)]
        return Estimates.without_intervals(np.concatenate(parts)[first - start : first - start + count])

    @property
    def side_by_side(self) -> int:
        """Number of realisations computed in one call."""
        return chunk_size(self.exact.freq_hz.size, self.frfs.h[0].size)

    def details(self, first: int, count: int) -> tuple[Estimates, list[ComplexArray]]:
        """Return estimates of realisations, and the diagonal of K* line by line of the realisations in figures."""
        k_joint = self._lines(first, count)
        kept = max(0, min(count, _KEPT - first))
        drawn = np.diagonal(k_joint[:kept], axis1=2, axis2=3).copy()
        return Estimates.without_intervals(self._means(k_joint)), list(drawn)

    def _lines(self, first: int, count: int) -> ComplexArray:
        with warnings.catch_warnings():
            # Noise can make any line ill-conditioned.
            warnings.simplefilter("ignore", IllConditionedWarning)
            return joint_lines(self.exact, self.method, self.frfs(first, count), "nan")

    def _means(self, k_joint: ComplexArray) -> FloatArray:
        return np.concatenate([one.means(self.exact.freq_hz, k_joint) for one in self.band_sets], axis=1)


@dataclass(frozen=True)
class FitSource:
    """Fits of realisations with initial values from an early realisation, so that results are independent of the call.

    Attributes
    ----------
    exact : Exact
        FRFs that the method uses from a model.
    frfs : NoisyFrfs
        Realisations of the measured FRFs.
    """

    exact: Exact
    frfs: NoisyFrfs

    @cached_property
    def key(self) -> str:
        """Hash of all data that determine the initial values."""
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
        """Return the fit of each realisation; NaN in the row of a realisation that cannot be fitted."""
        found = np.full((3, count, 2 * self.exact.n), np.nan)
        for i, gamma in enumerate(self.frfs(first, count)):
            try:
                values, intervals = viscous_estimate(self.exact.freq_hz, gamma, self.exact.dofs, _start_of(self))
            except (ValueError, ArithmeticError):
                continue
            found[:, i] = values, *intervals
        return Estimates(*found)

    def details(self, first: int, count: int) -> tuple[Estimates, list[Any]]:
        """Return the fit of each realisation without intervals; raise ValueError if one cannot be fitted."""
        theta = viscous_joints(self.exact.freq_hz, self.frfs(first, count), self.exact.dofs, _start_of(self))
        return Estimates.without_intervals(theta), []


@lru_cache(_STARTS)
def _start_of(source: ComplianceSource) -> FitStart | None:
    """Return the fit of realisation 0; None if it cannot be fitted."""
    try:
        return FitStart.of(source.exact.freq_hz, source.frfs(0, 1)[0], source.exact.dofs, damping="viscous")
    except (ValueError, ArithmeticError):
        return None


class DecouplingFitSource(FitSource):
    """Fits to the FRFs between internal points, with known FRFs of the substructures."""

    def __call__(self, first: int, count: int) -> Estimates:
        """Return the fit of each realisation."""
        return Estimates.without_intervals(fit_decoupling(_decoupling_fits_of(self), self.frfs(first, count)))


@lru_cache(_DECOUPLING_STARTS)
def _decoupling_fits_of(source: DecouplingFitSource) -> RealisationFits:
    exact = source.exact
    first = (source.frfs(number, 1)[0] for number in range(_TRIES))
    return decoupling_fits(exact.freq_hz, exact.dofs, (exact.h_a, exact.h_b), exact.k_initial, first)


@dataclass(frozen=True)
class OwnEstimatorSource:
    """Estimates by an estimator of the user."""

    freq_hz: FloatArray
    dofs: tuple[str, ...]
    frfs: NoisyFrfs
    estimator: Estimator

    def __call__(self, first: int, count: int) -> Estimates:
        """Return the result of the estimator for each realisation."""
        drawn = self.frfs(first, count)
        found = np.array([self.estimator(self.freq_hz, gamma, self.dofs) for gamma in drawn], float)
        if found.shape != (count, 2 * len(self.dofs)):
            raise ValueError(
                f"an estimator returned an array of shape {found.shape[1:]}; return {2 * len(self.dofs)} numbers, "
                f"stiffness of {', '.join(self.dofs)}, then damping"
            )
        return Estimates.without_intervals(found)


def estimate_groups(case: KnownJointCase, exact: Exact, choice: StudyChoice | None) -> list[EstimateGroup]:
    """Return a group for every noise and method of a study, or of the report of the case if `choice` is None."""
    if choice is None:
        # The report compares both blocks of the modification.
        return [
            _group(case, exact, noise.name, noise, method, None)
            for noise in case.noises
            for method in dict.fromkeys((*noise.methods, *(["ismm-kj"] if "ismm" in noise.methods else [])))
        ]
    noises: list[tuple[str, Noise | Pollution, tuple[str, ...]]] = [
        (name, own, case.noises[0].methods) for name, own in choice.own_noises.items()
    ] or [(noise.name, noise, noise.methods) for noise in chosen_noises(case.noises, choice)]
    return [
        _group(case, exact, name, noise, method, choice)
        for name, noise, methods in noises
        for method in dict.fromkeys((*(choice.estimators or methods), *choice.own_estimators))
    ]


def _group(
    case: KnownJointCase,
    exact: Exact,
    name: str,
    noise: Noise | Pollution,
    method: str,
    choice: StudyChoice | None,
) -> EstimateGroup:
    own = {} if choice is None else choice.own_estimators
    frfs = NoisyFrfs(measured(exact, "ismm" if method in own else method), noise, case.seed + noise_stream(method))
    source: RealisationSource
    side_by_side, labels, details = 1, [method], None
    if method in own:
        source = OwnEstimatorSource(exact.freq_hz, exact.dofs, frfs, own[method])
    elif method == "compliance":
        source = fits = ComplianceSource(needed_frfs(exact, method), frfs)
        details = fits.details
    elif method == "decoupling-fit":
        source = DecouplingFitSource(needed_frfs(exact, method), frfs)
    else:
        used = method if choice is None else SHORT_FORM.get(method, method)
        source = means = BandMeanSource(needed_frfs(exact, used), used, frfs, case.band_sets)
        side_by_side, details = means.side_by_side, means.details
        labels = [f"{method}, {one.name}" if len(case.band_sets) > 1 else method for one in case.band_sets]
    bound = np.full(len(case.parameters), np.nan)
    if choice is not None and not method.startswith("decoupling"):
        bound = _bound(exact, noise)
    columns = tuple(
        EstimateColumn(label, parameter.name, parameter.unit, float(actual), float(least))
        for label in labels
        for parameter, actual, least in zip(case.parameters, case.actual, bound, strict=True)
    )
    return EstimateGroup(name, method, columns, source, side_by_side, details if choice is None else None)


def _bound(exact: Exact, noise: Noise | Pollution) -> FloatArray:
    """Return least standard deviations without models of the sides; NaN if noise is correlated or not circular."""
    missing = np.full(2 * exact.n, np.nan)
    if not isinstance(noise, Noise) or not NOISE_KINDS[noise.kind].is_circular or noise.reciprocal or noise.block > 1:
        return missing
    gamma = exact.interface(exact.h_c)
    variance = noise.variance(gamma)
    return least_std_errors(exact.freq_hz, gamma, variance) if variance.all() else missing
