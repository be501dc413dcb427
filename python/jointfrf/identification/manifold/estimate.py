"""Joint parameters from interface FRFs: every group of DOFs fitted on its own, and put together."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import Parameter
from jointfrf.frf.bands import spread_lines
from jointfrf.identification.manifold.coordinates import (
    CoupledJoint,
    CrossTerms,
    DiagonalJoint,
    JointCoordinates,
    JointTerms,
    terms_of,
)
from jointfrf.identification.manifold.group_fit import LITTLE_PATIENCE, GroupFit, GroupProblem, fit_dofs
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs
from jointfrf.identification.manifold.line_forms import FormMinimum
from jointfrf.identification.manifold.on_manifold import LineData, OnManifold
from jointfrf.identification.manifold.starts import first_joints
from jointfrf.identification.manifold.unknown_cross import fit_unknown_cross
from jointfrf.kernel.arguments import FloatArray

__all__ = [
    "FittedGroup",
    "GroupData",
    "GroupStart",
    "JointEstimate",
    "NamedParameter",
    "estimate_joint",
    "grouped",
    "unknown_entries",
]

#: A compliance is not taken below this share of its standard error, nor of the receptances around it.
_RIGID, _ROUNDING = 1e-3, 1e-12
#: A fit that leaves cross terms unknown fits far better from this ratio of the mean squares on.
_FAR_BETTER = 4.0


#: A group of DOFs that is fitted by itself, and its FRFs.
GroupData = tuple[NDArray[np.intp], LineData]


class NamedParameter(Protocol):
    """A parameter of a joint, of springs or of any law."""

    @property
    def name(self) -> str:
        """Its name."""


class FittedGroup(NamedTuple):
    """The fit of one group of DOFs.

    Attributes
    ----------
    dofs : ndarray of int
    which : ndarray of int
        Its parameters among all.
    joint : JointCoordinates
    problem : GroupProblem
    fit : GroupFit
    """

    dofs: NDArray[np.intp]
    which: NDArray[np.intp]
    joint: JointCoordinates
    problem: GroupProblem
    fit: GroupFit


class GroupStart(NamedTuple):
    """Where the fit of a group of DOFs begins: at what another fit has found.

    Attributes
    ----------
    dofs : ndarray of int
    parameters : tuple of Parameter, length p
    x : ndarray, shape (p,)
        Coordinates of the joint.
    on : OnManifold, optional
        FRFs that nearly fit it.
    is_last : bool
        Whether the fit ends there, be its residual noise or not: as where one with more terms fits.
    """

    dofs: NDArray[np.intp]
    parameters: tuple[Parameter, ...]
    x: FloatArray
    on: OnManifold | None
    is_last: bool = False

    @classmethod
    def of(cls, group: FittedGroup, minimum: FormMinimum) -> GroupStart:
        """Return the start at a minimum of the quadratic forms of a fit."""
        return cls(group.dofs, terms_of(minimum.joint).parameters, minimum.x, group.fit.on)


class JointEstimate(NamedTuple):
    """Result of `estimate`.

    Attributes
    ----------
    parameters : sequence of Parameter, or of parameters of laws, length p
        Those that the FRFs depend on: no cross terms between DOFs of different groups.
    theta : ndarray, shape (p,)
        Their values.
    covariance : ndarray, shape (p, p)
        From the noise of the FRFs, as if lines were independent.
    groups : tuple of FittedGroup
    excess : float
        Mean square of the residual in units of the noise.
    scale : float
        The same in the units in which lines were weighted: those of the noise, unless lines were seen to vary.
    equations : float
        Complex equations used.
    """

    parameters: Sequence[NamedParameter]
    theta: FloatArray
    covariance: FloatArray
    groups: tuple[FittedGroup, ...]
    excess: float
    scale: float
    equations: float

    @property
    def converged(self) -> bool:
        """Whether the fits of all groups did."""
        return all(group.fit.converged for group in self.groups)

    @property
    def data(self) -> tuple[GroupData, ...]:
        """Groups of DOFs and their FRFs."""
        return tuple((group.dofs, group.problem.data) for group in self.groups)

    @property
    def starts(self) -> tuple[GroupStart, ...]:
        """Where fits of other FRFs of the same structure begin; groups that did not converge have none."""
        return tuple(GroupStart.of(group, group.fit.minimum) for group in self.groups if group.fit.converged)


def estimate_joint(
    frfs: InterfaceFrfs,
    terms: JointTerms,
    cross: CrossTerms = "zero",
    used: NDArray[np.bool_] | None = None,
    near: Sequence[GroupStart] = (),
    data: Iterable[GroupData] | None = None,
) -> JointEstimate:
    """Fit a joint to FRFs whose noise is known.

    Parameters
    ----------
    frfs : InterfaceFrfs
    terms : JointTerms
        Terms of K* that are sought.
    cross : {"zero", "ignore", "fit"}
        Whether cross terms of C that are not sought are zero, or unknown.
    used : ndarray of bool, shape (n_freq, n), optional
        Lines used for each DOF; all by default.
    near : sequence of GroupStart
        Of other FRFs of the same structure, or of other terms: where the fits start first.
    data : iterable of (dofs, LineData), optional
        What `grouped` returns, where it is known.
    """
    groups = []
    known = {(tuple(start.dofs.tolist()), start.parameters): start for start in near}
    for dofs, lines in grouped(frfs) if data is None else data:
        own, which = terms.of_dofs(dofs)
        joint = coordinates_of(own)
        problem = GroupProblem(lines, joint, unknown_entries(dofs, cross, used, len(lines.measured)))
        fit = _fitted(problem, cross, known.get((tuple(dofs.tolist()), own.parameters)))
        groups.append(FittedGroup(dofs, which, joint, problem, fit))
    return assembled(terms, groups)


def grouped(frfs: InterfaceFrfs) -> Iterator[GroupData]:
    """Return groups of DOFs that are fitted each by itself, and their FRFs."""
    for dofs in frfs.on_lines(spread_lines(len(frfs.measured))).groups():
        yield dofs, frfs.of_dofs(dofs)


def _fitted(problem: GroupProblem, cross: CrossTerms, near: GroupStart | None) -> GroupFit:
    """Fit a group: on the manifold, or to the diagonal of C where its cross terms are unknown or deny every joint."""
    if near is not None and cross != "ignore":
        found = fit_dofs(problem, [near.x], LITTLE_PATIENCE, near.on)
        if found.is_noise or near.is_last:
            return found
    # Some lines, evenly spread, start as well as all.
    some = spread_lines(len(problem.data.measured))
    starts = first_joints(problem.data.on_slice(some), coordinates_of(terms_of(problem.joint).on_lines(some)))
    if not problem.is_diagonal or problem.data.entries.n == 1:
        return fit_dofs(problem, starts)
    diagonal = fit_unknown_cross(problem, starts)
    if cross == "ignore":
        return diagonal
    found = fit_dofs(problem, [diagonal.minimum.x], LITTLE_PATIENCE)
    # Where the diagonal of C fits far better, other starts do not help: cross terms are not zero.
    if not found.is_good and not (found.is_lost and found.excess > _FAR_BETTER * diagonal.excess):
        found = min(found, fit_dofs(problem, starts), key=lambda one: one.squares)
    if not found.is_lost:
        return found
    assert diagonal.beside is not None
    return diagonal._replace(beside=diagonal.beside._replace(noise_squares=found.excess * diagonal.equations))


def coordinates_of(terms: JointTerms) -> JointCoordinates:
    """Return the coordinates in which a joint is fitted."""
    return CoupledJoint(terms) if terms.has_cross_terms else DiagonalJoint(terms)


def assembled(terms: JointTerms, groups: list[FittedGroup]) -> JointEstimate:
    """Put the fits of all groups together."""
    p = len(terms.parameters)
    theta, covariance = np.full(p, np.nan), np.zeros((p, p))
    for group in groups:
        own = group.fit.minimum.covariance
        x = group.fit.minimum.x.copy()
        if isinstance(group.joint, DiagonalJoint):
            # A stiffness beyond what the data can tell stays a number; its interval says that it is open.
            a = slice(0, len(group.dofs))
            error = np.sqrt(np.maximum(np.diagonal(own)[a], 0))
            own = _with_hidden_rates(own, group, error)
            x[a] = np.maximum(x[a], np.maximum(_RIGID * error, _ROUNDING * group.problem.data.own_size))
        theta[group.which] = group.joint.theta(x)
        slope = group.joint.theta_slope(x)
        covariance[group.which[:, None], group.which] = slope @ own @ slope.T
    kept = np.sort(np.concatenate([group.which for group in groups]))
    place = np.full(p, -1)
    place[kept] = np.arange(kept.size)
    equations = sum(group.fit.equations for group in groups)
    degrees = max(equations - kept.size / 2, 1)
    return JointEstimate(
        tuple(terms.parameters[i] for i in kept),
        theta[kept],
        covariance[kept[:, None], kept],
        tuple(group._replace(which=place[group.which]) for group in groups),
        sum(group.fit.noise_squares for group in groups) / degrees,
        sum(group.fit.minimum.cost for group in groups) / degrees,
        equations,
    )


def _with_hidden_rates(covariance: FloatArray, group: FittedGroup, error: FloatArray) -> FloatArray:
    """Return the covariance with that of rates which nothing shows because their DOF was found rigid.

    A pseudo-inverse has zero there. They get the variance that they would have if the compliance were as large as its
    standard error.
    """
    joint, minimum = group.joint, group.fit.minimum
    hidden = np.flatnonzero((minimum.x[terms_of(joint).pairs[:, 0]] == 0) & (terms_of(joint).kinds > 0))
    if hidden.size == 0:
        return covariance
    at = minimum.x.copy()
    at[: error.size] = np.maximum(at[: error.size], error)
    slope = joint.slope(at, joint.compliance(at))[:, :, hidden]
    information = np.einsum("lqh,lqr,lrh->h", slope.conj(), group.fit.forms.weight, slope).real
    known = covariance.copy()
    known[hidden, hidden] = 1 / np.maximum(2 * information, np.finfo(float).tiny)
    return known


def unknown_entries(
    dofs: NDArray[np.intp], cross: CrossTerms, used: NDArray[np.bool_] | None, n_freq: int
) -> NDArray[np.bool_]:
    """Return which entries of C are unknown, shape (n_freq, n * n)."""
    n = len(dofs)
    unknown = np.zeros((n_freq, n, n), bool)
    if cross == "ignore":
        unknown |= ~np.eye(n, dtype=bool)
    if used is not None:
        outside = ~used[:, dofs]
        unknown |= outside[:, :, None] | outside[:, None, :]
    return unknown.reshape(n_freq, n * n)
