"""Joint parameters from interface FRFs: every group of DOFs fitted separately, and combined."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.dofs import Parameter, ParameterKind, parameters_shared
from jointfrf.frf.bands import spread_lines
from jointfrf.identification.line_starts import from_lines, interface_compliance
from jointfrf.identification.manifold.coordinates import (
    CoupledJoint,
    CrossTerms,
    DiagonalJoint,
    JointTerms,
    LawCoordinates,
    coordinates_of,
)
from jointfrf.identification.manifold.group_fit import LITTLE_PATIENCE, GroupFit, GroupProblem, fit_dofs
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs
from jointfrf.identification.manifold.line_forms import FormMinimum, NamedParameter
from jointfrf.identification.manifold.on_manifold import LineData, OnManifold
from jointfrf.identification.manifold.starts import first_joints
from jointfrf.identification.manifold.unknown_cross import fit_unknown_cross
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint

__all__ = ["GroupData", "GroupStart", "JointEstimate", "assembled", "estimate_joint", "estimate_laws"]

#: Least compliance, relative to its standard error and to the receptances around it.
_RIGID, _ROUNDING = 1e-3, 1e-12
#: Probability at which a fit that leaves cross terms unknown has smaller mean squares by chance; lines may correlate.
_BY_CHANCE = 1e-6

#: A group of DOFs that is fitted separately, and its FRFs.
GroupData = tuple[NDArray[np.intp], LineData]


class GroupStart(NamedTuple):
    """Initial values of the fit of a group, from the result of another fit.

    Attributes
    ----------
    dofs : ndarray of int
        DOFs of the group.
    parameters : tuple of parameters, length p
        Parameters of the group.
    x : ndarray, shape (p,)
        Coordinates of the joint.
    on : OnManifold, optional
        FRFs that nearly fit it.
    springs : ndarray, shape (n,), optional
        Reference springs of x and Q.
    """

    dofs: NDArray[np.intp]
    parameters: tuple[NamedParameter, ...]
    x: FloatArray
    on: OnManifold | None
    springs: FloatArray | None

    @classmethod
    def of(cls, group: GroupFit, minimum: FormMinimum) -> GroupStart:
        """Return the start at a minimum of the quadratic forms of a fit."""
        springs = group.problem.data.springs
        return cls(group.dofs, tuple(minimum.joint.parameters), minimum.x, group.on, springs)


class JointEstimate(NamedTuple):
    """Result of `estimate_joint`.

    Attributes
    ----------
    parameters : sequence of Parameter, or of parameters of laws, length p
        Parameters on which the FRFs depend: no cross terms between DOFs of different groups.
    theta : ndarray, shape (p,)
        Values of the parameters.
    covariance : ndarray, shape (p, p)
        Covariance by the noise of the FRFs, as if lines were independent.
    groups : tuple of GroupFit
        Fits of the groups.
    excess : float
        Mean square of the residual in units of the noise.
    scale : float
        Mean square of the residual by the weights of the lines, which differ from the noise if lines vary.
    equations : float
        Number of complex equations used.
    kinds : tuple of tuple of FormMinimum
        Minima of each group with fewer damping terms that the data do not exclude: values are means over these.
    """

    parameters: Sequence[NamedParameter]
    theta: FloatArray
    covariance: FloatArray
    groups: tuple[GroupFit, ...]
    excess: float
    scale: float
    equations: float
    kinds: tuple[tuple[FormMinimum, ...], ...] = ()

    @property
    def converged(self) -> bool:
        """Whether the fits of all groups converged."""
        return all(group.converged for group in self.groups)

    @property
    def data(self) -> tuple[GroupData, ...]:
        """Groups of DOFs and their FRFs."""
        return tuple((group.dofs, group.problem.data) for group in self.groups)

    @property
    def starts(self) -> tuple[GroupStart, ...]:
        """Initial values for fits of other FRFs of the same structure, from groups that converged."""
        return tuple(GroupStart.of(group, group) for group in self.groups if group.converged)


def estimate_joint(
    frfs: InterfaceFrfs,
    terms: JointTerms,
    cross: CrossTerms = "zero",
    used: NDArray[np.bool_] | None = None,
    near: Sequence[GroupStart] = (),
    data: Iterable[GroupData] | None = None,
    *,
    is_explained: bool = False,
    sides_bend: bool = False,
) -> JointEstimate:
    """Fit a joint of springs to FRFs with known noise.

    Parameters
    ----------
    frfs : InterfaceFrfs
        FRFs with their noise.
    terms : JointTerms
        Terms of K* to fit.
    cross : {"zero", "ignore", "points", "fit"}
        Whether cross terms of C that are not fitted are zero, or unknown.
    used : ndarray of bool, shape (n_freq, n), optional
        Lines used for each DOF; all by default.
    near : sequence of GroupStart
        First initial values, from other FRFs of the same structure, or from other terms.
    data : iterable of (dofs, LineData), optional
        Groups of DOFs and their FRFs, if known.
    is_explained : bool
        Whether a joint with more terms explains the FRFs: then `near` alone suffices to show that this one does not.
    sides_bend : bool
        Whether the sides may be flexible between channels and joint.
    """
    groups = []
    known = {(tuple(start.dofs.tolist()), start.parameters): start for start in near}
    names, fitted = [one.name for one in terms.parameters], np.zeros(len(terms.parameters), bool)
    for dofs, lines in _grouped(frfs) if data is None else data:
        own, which = terms.of_dofs(dofs)
        _count_fitted(fitted, which, names)
        unknown = _unknown_entries(dofs, cross, used, len(lines.measured))
        start = known.get((tuple(dofs.tolist()), own.parameters))
        plain = lines._replace(springs=None)
        # Unknown entries are entries of C, which is R without springs. Cross terms of T = 1 - Z R would make the
        # columns by Q nearly dependent, and projections slow.
        has_springs = not (own.has_cross_terms or unknown.any())
        lines = plain.with_springs() if has_springs else plain
        if start is not None:
            lines = plain._replace(springs=start.springs)
        problem = GroupProblem(dofs, which, lines, coordinates_of(own, lines.springs), unknown, sides_bend=sides_bend)
        groups.append(_fitted(_Search(problem, own, cross, start, is_explained)))
    return assembled(terms.parameters, groups)


def estimate_laws(
    frfs: InterfaceFrfs,
    joint: LawJoint,
    omega: FloatArray,
    used: NDArray[np.bool_] | None = None,
    same: Sequence[Sequence[str]] = (),
) -> JointEstimate:
    """Fit a joint of laws to FRFs with known noise.

    Parameters
    ----------
    frfs : InterfaceFrfs
        FRFs with their noise.
    joint : LawJoint
        Joint with its DOFs in the order of the FRFs, without masses; its values are tried as initial values.
    omega : ndarray, shape (n_freq,)
        Angular frequencies, rad/s.
    used : ndarray of bool, shape (n_freq, n), optional
        Lines used for each DOF; all by default.
    same : sequence of sequence of str
        Points with equal joints.
    """
    groups, shared = [], parameters_shared(joint.names, same)
    quantities = tuple(joint.quantities[i] for i in np.unique(shared, return_index=True)[1])
    names, left, fitted = list(joint.names), set(joint.laws), np.zeros(len(quantities), bool)
    for dofs, lines in _grouped(frfs):
        inside = [joint.dofs[d] for d in dofs]
        laws = {pair: law for pair, law in joint.laws.items() if set(pair) <= set(inside)}
        if not laws:
            continue
        left -= set(laws)
        own = LawJoint(laws, [dof for dof in joint.rigid if dof in inside], None, inside)
        gamma, variance = _between(frfs, dofs)
        driving = abs(np.einsum("lpp->lp", gamma))
        # 1/(|gamma_jj| + |gamma_kk|) is a size of stiffness that FRFs can show.
        size = np.median(1 / np.maximum(driving[:, : dofs.size] + driving[:, dofs.size :], 1e-300), axis=0)
        which, of_own = np.unique(shared[[names.index(name) for name in own.names]], return_inverse=True)
        _count_fitted(fitted, which, [one.name for one in quantities])
        coordinates = LawCoordinates(own, omega, size, of_own.ravel())
        rigid = len(own.rigid)
        problem = GroupProblem(
            dofs, which, lines, coordinates,
            _unknown_entries(dofs, "zero", used, len(lines.measured)),
            rigid * (rigid + 1) // 2 if frfs.reciprocal else rigid**2,
        )  # fmt: skip
        both = list(range(2 * dofs.size))
        values = from_lines(own, omega, interface_compliance(gamma, variance, (both, both)))
        given = [*_near_springs(own, lines, omega), *([] if values is None else [values]), own.values]
        starts = tuple(coordinates.coordinates(coordinates.common(one)) for one in given)
        groups.append(_fitted(_Search(problem, None, "zero", given=starts)))
    if left:
        a, b = next(iter(left))
        raise ValueError(f"the FRFs between {a} and {b} are zero and do not determine {a},{b}; remove this term")
    return assembled(quantities, groups)


def _near_springs(joint: LawJoint, lines: LineData, omega: FloatArray) -> list[FloatArray]:
    """Return values of laws near to springs and dampers with the same cross terms, if any.

    K* of single lines is an inverse of their noisy C, and cross terms increase its noise; springs are fitted to C.
    """
    place = {dof: i for i, dof in enumerate(joint.dofs)}
    pairs = [(place[a], place[b]) for a, b in joint.laws]
    if joint.rigid or all(a == b for a, b in pairs):
        return []
    parameters = tuple(Parameter(kind, a, b) for kind in get_args(ParameterKind) for a, b in joint.laws)
    kinds, number = np.repeat(np.arange(3), len(pairs)), np.arange(3 * len(pairs))
    terms = JointTerms(parameters, omega, kinds, np.array(pairs * 3, np.intp), number)
    found = []
    for x in _starts_of_lines(lines, terms):
        k = terms.stiffness(x)
        laws = [law.started(omega, k[:, a, b]) for law, (a, b) in zip(joint.laws.values(), pairs, strict=True)]
        found.append(np.concatenate([law.values for law in laws]))
    return found


def _grouped(frfs: InterfaceFrfs) -> Iterator[GroupData]:
    """Return groups of DOFs that are fitted separately, and their FRFs."""
    for dofs in frfs.on_lines(spread_lines(len(frfs.measured))).groups():
        yield dofs, frfs.of_dofs(dofs)


def _count_fitted(fitted: NDArray[np.bool_], which: NDArray[np.intp], names: Sequence[str]) -> None:
    """Mark the parameters of a group as fitted; raise an error if another group has one of them."""
    if twice := [names[i] for i in which if fitted[i]]:
        raise ValueError(
            f"same: the FRFs between equal points are zero, so that {', '.join(twice)} would belong to separate "
            "problems: identify each point by itself, and pool the fits"
        )
    fitted[which] = True


def _between(frfs: InterfaceFrfs, dofs: NDArray[np.intp]) -> tuple[ComplexArray, FloatArray]:
    """Return smooth FRFs between some joint DOFs j, then k, and E|e|^2 of the measured ones."""
    at = np.concatenate([dofs, dofs + frfs.n])
    variance = np.where(np.isfinite(frfs.variance), frfs.variance, 0)
    return frfs.smooth_gamma[:, at[:, None], at], frfs.responses[at] ** 2 @ variance @ (frfs.forces[at] ** 2).T


@dataclass(frozen=True)
class _Search:
    """The search for the joint of a group.

    Attributes
    ----------
    problem : GroupProblem
        Fit of the group.
    terms : JointTerms or None
        Terms of springs; None for laws, whose initial values are given.
    cross : {"zero", "ignore", "points", "fit"}
        Treatment of cross terms.
    near : GroupStart, optional
        Result of a fit to other FRFs of the same structure, or with other terms.
    is_explained : bool
        Whether a joint with more terms explains the FRFs.
    given : tuple of ndarray, shape (p,)
        Initial values of laws.
    """

    problem: GroupProblem
    terms: JointTerms | None
    cross: CrossTerms
    near: GroupStart | None = None
    is_explained: bool = False
    given: tuple[FloatArray, ...] = ()

    def ladder(self) -> Iterator[Sequence[FloatArray]]:
        """Yield sets of initial values, the most probable first; a later set costs additional fits.

        1. The compliance of single lines, or the given values. It is poor if noise exceeds gamma_jk, and poorer in its
           weakest direction the more entries it has.
        2. For fitted cross terms: the joint without them, which is stable, and near enough.
        3. For cross terms of zero: the diagonal of C, whatever its cross terms are.
        """
        joint = self.problem.joint
        yield self.given if self.terms is None else _starts_of_lines(self.problem.data, self.terms)
        if isinstance(joint, CoupledJoint) and joint.terms.has_cross_terms:
            yield from ([start] for start in _simpler_joints(self.problem, joint))
        elif joint.in_compliance and not self.problem.sides_bend:
            yield [joint.coordinates(self.diagonal.joint.theta(self.diagonal.x))]

    @cached_property
    def diagonal(self) -> GroupFit:
        """The fit to the diagonal of C, whatever its cross terms are."""
        assert self.terms is not None
        data = self.problem.data._replace(springs=None)
        plain = self.problem._replace(data=data, joint=coordinates_of(self.terms))
        return fit_unknown_cross(plain, _starts_of_lines(data, self.terms))

    def needs_cross_terms(self, found: GroupFit) -> bool:
        """Return whether no joint without cross terms fits, or the diagonal of C alone fits better (F-test)."""
        is_simple = found.joint.in_compliance and found.joint.n > 1
        if not is_simple or found.is_good or self.problem.sides_bend:
            return False
        if found.is_lost:
            return True
        degrees = (2 * one.equations - one.x.size for one in (found, self.diagonal))
        ratio = found.excess / max(self.diagonal.excess, TINY)
        return bool(special.fdtrc(*(max(one, 1.0) for one in degrees), ratio) < _BY_CHANCE)


def _fitted(search: _Search) -> GroupFit:
    """Fit a group: near another fit if that explains the FRFs, else from all sets of initial values."""
    if search.cross == "ignore" and search.problem.joint.in_compliance:
        return search.diagonal
    if search.near is not None:
        found = fit_dofs(search.problem, [search.near.x], LITTLE_PATIENCE, search.near.on)
        if found.is_noise or search.is_explained:
            return found
    found = _lowest(search)
    if not search.needs_cross_terms(found):
        return found
    statistics = search.diagonal.unknown_cross
    assert statistics is not None
    squares = found.excess * search.diagonal.equations
    return replace(search.diagonal, unknown_cross=statistics._replace(noise_squares=squares))


def _lowest(search: _Search) -> GroupFit:
    """Try the sets of initial values until the residual is noise, and return the fit of least squares.

    A fit that comes near the data without converging may have omitted lines on its way: it starts again from its end.
    """
    best: GroupFit | None = None

    def lower(starts: Sequence[FloatArray]) -> GroupFit | None:
        with suppress(np.linalg.LinAlgError):
            found = fit_dofs(search.problem, starts)
            return found if best is None or found.squares < best.squares else best
        return best

    for starts in search.ladder():
        best = lower(starts)
        if best is not None and (best.is_good or (search.problem.sides_bend and not best.is_lost)):
            break
    if best is not None and not best.converged and not best.is_lost:
        best = lower([best.x])
    if best is None:
        raise np.linalg.LinAlgError("no start of the fit stays finite")
    return best


def _starts_of_lines(data: LineData, terms: JointTerms) -> list[FloatArray]:
    """Return coordinates of the joint from the compliance of some evenly spaced lines, which suffice."""
    some = spread_lines(len(data.measured))
    return first_joints(data.on_lines(some), coordinates_of(terms.on_lines(some), data.springs))


def _simpler_joints(problem: GroupProblem, joint: CoupledJoint) -> Iterator[FloatArray]:
    """Yield initial values from the fit without cross terms, and the initial values of that fit."""
    terms, common = joint.terms.without_cross_terms()
    simple = DiagonalJoint(terms, problem.data.springs)
    some = spread_lines(len(problem.data.measured))
    starts = first_joints(problem.data.on_lines(some), simple.on_lines(some))
    ends = starts[:1]
    with suppress(np.linalg.LinAlgError):
        ends.insert(0, fit_dofs(problem._replace(joint=simple), starts).x)
    # Equal points start from their mean; cross terms, for which there is no term here, from 0.
    p = joint.lower.size
    points = np.maximum(np.bincount(common, minlength=p), 1)
    for theta in map(simple.theta, ends):
        if np.isfinite(theta).all():
            yield np.bincount(common, theta, p) / points


def assembled(parameters: Sequence[NamedParameter], groups: Sequence[GroupFit]) -> JointEstimate:
    """Combine the fits of all groups."""
    p = len(parameters)
    theta, covariance = np.full(p, np.nan), np.zeros((p, p))
    for group in groups:
        x, own = _reported(group)
        theta[group.which] = group.joint.theta(x)
        slope = group.joint.theta_slope(x)
        covariance[group.which[:, None], group.which] = slope @ own @ slope.T
    kept = np.sort(np.concatenate([group.which for group in groups]))
    place = np.full(p, -1)
    place[kept] = np.arange(kept.size)
    # A group with other numbers is another object, for which everything would be computed again.
    if kept.size < p:
        groups = [replace(group, problem=group.problem._replace(which=place[group.which])) for group in groups]
    equations = sum(group.equations for group in groups)
    degrees = max(equations - kept.size / 2, 1)
    return JointEstimate(
        tuple(parameters[i] for i in kept),
        theta[kept],
        covariance[kept[:, None], kept],
        tuple(groups),
        # Exact FRFs leave rounding of either sign.
        max(sum(group.noise_squares for group in groups) / degrees, 0.0),
        sum(group.cost for group in groups) / degrees,
        equations,
    )


def _reported(group: GroupFit) -> tuple[FloatArray, FloatArray]:
    """Return coordinates with finite parameters, and a covariance that includes rates of rigid DOFs.

    A stiffness beyond the resolution of the data stays a number; its interval is unbounded. Rates of a rigid DOF have
    no finite variance. They get the variance for a compliance as large as its standard error.
    """
    joint, x, covariance = group.joint, group.x.copy(), group.covariance
    a = joint.is_compliance
    if not a.any():
        return x, covariance
    error = np.sqrt(np.maximum(np.diagonal(covariance)[a], 0))
    least = np.zeros(joint.n)
    least[a[: joint.n]] = _ROUNDING * group.problem.data.own_size[a[: joint.n]]
    hidden = np.flatnonzero((x[joint.dofs] < least[joint.dofs]) & ~a)
    if hidden.size:
        at = x.copy()
        at[a] = np.maximum(at[a], error)
        slope = joint.slope(at, joint.compliance(at))[:, :, hidden]
        information = np.einsum("lqh,lqr,lrh->h", slope.conj(), group.forms.weight, slope).real
        covariance = covariance.copy()
        covariance[hidden], covariance[:, hidden] = 0, 0
        covariance[hidden, hidden] = 1 / np.maximum(2 * information, TINY)
    x[a] = np.maximum(x[a], np.maximum(_RIGID * error, least[joint.dofs[a]]))
    return x, covariance


def _unknown_entries(
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
