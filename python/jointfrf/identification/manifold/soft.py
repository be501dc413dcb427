"""Fits of joints with DOFs that may be free: in their stiffness, where a compliance would have to reach infinity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.bands import spread_lines
from jointfrf.identification.manifold.coordinates import DiagonalJoint, JointTerms
from jointfrf.identification.manifold.group_fit import LITTLE_PATIENCE, GroupFit, GroupProblem, fit_dofs
from jointfrf.identification.manifold.line_forms import FormMinimum, JointCoordinates, LineForms
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import solve

__all__ = ["SoftJoint", "fit_soft", "soft_dofs"]

#: A DOF that passes on less than this share of the force beside it may be free.
_PASSED = 0.1
#: A DOF that is more compliant than the structure by this, and known to no better than this, may be free.
_SOFT, _POORLY = 3.0, 0.1
#: Share of the largest rate beyond which a DOF is all damping.
_ALL_DAMPING = 0.5
#: Where fits begin, in units of the stiffness of the structure, and how near to free they are linearised, in standard
#: errors: FRFs are linear in such a stiffness, and nearer to free their projection hardly converges.
_STARTS, _SIGHT = (1e-2, 1e-4, 1e-6), 10.0
#: Terms of K* of a soft DOF are sought up to this many times the stiffness of the structure: more is rigid to any data.
_STIFFEST = 1e4
#: Share of the lines that a fit must use to be taken where no other joint is near the data.
_MOST_LINES = 0.75
#: A fit in stiffnesses replaces one in compliances unless its squares are higher by more than this.
_AS_GOOD = 1.0


class SoftJoint(DiagonalJoint):
    """A joint without cross terms, of which some DOFs are fitted in k, h and c, all others in 1/k and their rates.

    Parameters
    ----------
    terms : JointTerms
    soft : ndarray of bool, shape (n,)
        DOFs fitted in stiffnesses.
    size : ndarray, shape (n,)
        Stiffness of the structure at each DOF: those of soft DOFs are sought within a multiple of it.
    by_rate : bool
        As in `DiagonalJoint`, of DOFs that are not soft.
    about : ndarray, shape (n_freq, n), optional
        Compliance about which is linearised: that of soft DOFs is then C0 - C0^2 (K* - 1/C0), as the FRFs of a soft
        joint are linear in its stiffness, not in its compliance. Without it, 1/K*.
    """

    in_compliance = False

    def __init__(
        self,
        terms: JointTerms,
        soft: NDArray[np.bool_],
        size: FloatArray,
        about: ComplexArray | None = None,
        *,
        by_rate: bool = True,
    ) -> None:
        super().__init__(terms, by_rate=by_rate)
        self.soft, self.size, self.about = soft, size, about
        self._of_soft = soft[self.dofs]
        stiffest = _STIFFEST * size[self.dofs]
        stiffest[self.rates] *= self.rate_of_one
        self.upper = np.where(self._of_soft, stiffest, self.upper)
        self.lower = np.where(self._of_soft & (terms.kinds > 0), -stiffest, self.lower)

    @property
    def is_compliance(self) -> NDArray[np.bool_]:
        """Which coordinates are compliances, shape (p,)."""
        return self.is_stiffness & ~self._of_soft

    def _soft_stiffness(self, x: FloatArray) -> ComplexArray:
        """Return K* of the soft DOFs, zero for others, shape (n_freq, n)."""
        k: ComplexArray = np.zeros((self.terms.omega.size, self.n), np.complex128)
        for i in np.flatnonzero(self._of_soft):
            k[:, self.dofs[i]] += x[i] * self.terms.factors[self.terms.kinds[i]]
        return k

    def compliance(self, x: FloatArray) -> ComplexArray:
        """Return the diagonal of C, shape (n_freq, n)."""
        found, k = super().compliance(x), self._soft_stiffness(x)
        if self.about is not None:
            return np.where(self.soft, self.about * (2 - self.about * k), found)
        return np.where(self.soft, 1 / np.where(self.soft & (k != 0), k, 1), found)

    def slope(self, x: FloatArray, entries: ComplexArray) -> ComplexArray:
        """Return the derivatives of the diagonal, shape (n_freq, n, p)."""
        slope, about = super().slope(x, entries), entries if self.about is None else self.about
        for i in np.flatnonzero(self._of_soft):
            own = self.dofs[i]
            slope[:, own, i] = -self.terms.factors[self.terms.kinds[i]] * about[:, own] ** 2
        return slope

    def on_lines(self, lines: slice | NDArray[np.intp]) -> SoftJoint:
        """Return the same on some of the lines."""
        about = None if self.about is None else self.about[lines]
        return SoftJoint(self.terms.on_lines(lines), self.soft, self.size, about, by_rate=self.by_rate)

    def theta(self, x: FloatArray) -> FloatArray:
        """Return the parameters."""
        return np.where(self._of_soft, x, super().theta(np.where(self._of_soft & self.is_stiffness, 1.0, x)))

    def coordinates(self, theta: FloatArray) -> FloatArray:
        """Return the coordinates of parameters, inside their limits."""
        own = super().coordinates(np.where(self._of_soft & self.is_stiffness, 1.0, theta))
        inside: FloatArray = np.clip(np.where(self._of_soft, theta, own), self.lower, self.upper)
        return inside

    def theta_slope(self, x: FloatArray) -> FloatArray:
        """Return the derivatives of the parameters by the coordinates, shape (p, p)."""
        slope = super().theta_slope(np.where(self._of_soft & self.is_stiffness, 1.0, x))
        slope[self._of_soft] = np.eye(x.size)[self._of_soft]
        return slope

    def minimise(
        self, forms: LineForms, start: FloatArray, held: int | None = None, least_gain: float = 1e-6
    ) -> FormMinimum:
        """Minimise quadratic forms about the compliance at which these were taken."""
        bound = SoftJoint(self.terms, self.soft, self.size, forms.compliance, by_rate=self.by_rate)
        return JointCoordinates.minimise(bound, forms, start, held, least_gain)

    def lowest(
        self, forms: LineForms, start: FloatArray, held: int | None = None, least_gain: float = 1e-6
    ) -> FormMinimum:
        """Minimise; a soft joint has one minimum."""
        return self.minimise(forms, start, held, least_gain)

    def within_sight(self, minimum: FormMinimum, x: FloatArray) -> FloatArray:
        """Return where to linearise: no soft DOF nearer to free, and no other to rigid, than the data can resolve."""
        error = np.sqrt(np.maximum(np.diagonal(minimum.covariance), TINY))
        at = super().within_sight(minimum, x)
        k = self._of_soft & self.is_stiffness
        at[k] = np.maximum(x[k], _SIGHT * error[k])
        return at

    def has_profile(self, i: int, x: FloatArray, covariance: FloatArray) -> bool:
        """Whether the interval needs a profile: of a stiffness that may be zero, of a DOF that may be rigid."""
        return bool(self._of_soft[i]) or super().has_profile(i, x, covariance)

    def of_profile(self, i: int) -> SoftJoint:
        """Return the coordinates of a profile: damping itself where its own is asked for."""
        if self._of_soft[i] or self.is_stiffness[i] == self.by_rate:
            return self
        return SoftJoint(self.terms, self.soft, self.size, self.about, by_rate=not self.by_rate)

    def end(self, i: int, sign: int) -> float:
        """Return what a parameter runs to: a stiffness is zero where it cannot be distinguished from that."""
        if not self._of_soft[i]:
            return super().end(i, sign)
        return 0.0 if sign < 0 and self.is_stiffness[i] else sign * np.inf


def soft_dofs(found: GroupFit) -> NDArray[np.bool_]:
    """Return the DOFs that may be free, shape (n,).

    Those that are far more compliant than the structure around them and not well known, or all damping; and where no
    joint was found that fits, those that pass on no force: gamma_jk = gamma_jj T, with T the forces at side j for unit
    forces at side k, has no row for a DOF that is free.
    """
    joint, x, n = found.joint, found.x, found.joint.n
    assert isinstance(joint, DiagonalJoint)
    data = found.problem.data
    error = np.sqrt(np.maximum(np.diagonal(found.covariance)[:n], 0))
    poorly = ~(error < _POORLY * x[:n])
    np.logical_or.at(poorly, joint.dofs[joint.rates], abs(x[joint.rates]) > _ALL_DAMPING * joint.largest_rate)
    soft = poorly & (x[:n] > _SOFT * data.own_size)
    if not _is_explained(found):
        gamma = data.entries.matrix(data.smooth[spread_lines(len(data.smooth))])
        for one, other in ((slice(n), slice(n, 2 * n)), (slice(n, 2 * n), slice(n))):
            own = gamma[:, one, one]
            size = np.sqrt(abs(np.einsum("lpp->lp", own)))
            forces = abs(solve(own, gamma[:, one, other], on_singular="nan"))
            passed = (forces * size[:, :, None] / size[:, None, :]).max(axis=2)
            soft |= np.nanmedian(passed, axis=0) < _PASSED
    return np.asarray(soft)


def _is_explained(found: GroupFit) -> bool:
    """Whether a joint was found that fits all lines."""
    return found.is_noise and found.unknown_cross is None and bool(found.used.all())


def fit_soft(
    found: GroupFit,
    problem: GroupProblem,
    terms: JointTerms,
    soft: NDArray[np.bool_],
    rest: Callable[[NDArray[np.bool_]], FloatArray | None],
) -> GroupFit:
    """Fit again with DOFs that may be free in their stiffness; return the better fit.

    Parameters
    ----------
    found : GroupFit
        In compliances.
    problem : GroupProblem
        What it is to solve.
    terms : JointTerms
        Of the group.
    soft : ndarray of bool, shape (n,)
    rest : callable
        Returns first parameters of the other DOFs with the soft ones taken as free, shape (p,), or None.
    """
    size = 1 / np.maximum(found.problem.data.own_size, TINY)
    joint = SoftJoint(terms, soft, size)
    theta = None if _is_explained(found) else rest(~soft)
    if theta is None:
        theta = np.nan_to_num(found.joint.theta(found.x), posinf=0.0, neginf=0.0)
    of_soft = soft[joint.dofs]
    starts = []
    for share in _STARTS if found.unknown_cross else _STARTS[:1]:
        # Far softer than the structure, without damping, and with that of a DOF that was found to be all damping.
        softest = np.where(of_soft, np.where(joint.is_stiffness, share * size[joint.dofs], 0.0), theta)
        damped = np.where(of_soft & ~joint.is_stiffness, np.nan_to_num(found.joint.theta(found.x)), softest)
        starts += [joint.coordinates(one) for one in (softest, damped)]
    other = fit_dofs(problem._replace(joint=joint), starts, LITTLE_PATIENCE)
    if found.unknown_cross:
        # No joint without cross terms was near the data: lines that a free DOF leaves out are fewer.
        is_better = other.squares < found.noise_squares and bool(other.used.mean() > _MOST_LINES)
    else:
        is_better = other.squares < found.squares + _AS_GOOD
    return other if is_better else found
