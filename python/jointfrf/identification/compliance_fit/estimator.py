"""Joint parameters from noisy interface FRFs by maximum likelihood in the compliance domain.

The unknowns are the parameters of the joint and, on every line, the true FRFs. The joint constrains the FRFs of a line:
C(h) = K*(w)^-1, n^2 complex equations. Linearised about an estimate of the true FRFs this is a generalised
least-squares problem with the full covariance of C; its residual corrects the FRFs, and this is repeated until the
parameters converge. Without noise the fixed point is exact; with noise it reaches the Cramer-Rao bound of an unknown
structure around the joint (tests/python/physics/test_estimator.py). Groups of DOFs between which all FRFs are zero are
fitted separately.

Everything has a leading axis over realisations, so that a Monte Carlo study is one call.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import Parameter
from jointfrf.frf.noise_estimate import gamma_noise, neighbour_mean, reciprocity_noise
from jointfrf.identification.compliance_fit.group_fit import GroupEstimate, fit_group
from jointfrf.identification.compliance_fit.groups import uncoupled_groups
from jointfrf.identification.compliance_fit.joint_terms import Basis, CrossTerms, joint_basis
from jointfrf.identification.compliance_fit.line_selection import NOISE_LIMIT
from jointfrf.identification.compliance_fit.linearised import GroupData
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ComplianceEstimate", "estimate", "joint_basis"]


class ComplianceEstimate(NamedTuple):
    """Result of `estimate`, with a leading axis over realisations r.

    Attributes
    ----------
    parameters : tuple of Parameter, length p
        Those of the basis.
    theta : ndarray, shape (r, p)
        Their values.
    covariance : ndarray, shape (r, p, p)
        Covariance for unit noise level: times level^2.
    identifiable : ndarray of bool, shape (p,)
        Which parameters the FRFs depend on: not cross terms between DOFs of different groups. These are 0.
    groups : tuple of ndarray of int
        DOFs of each group; between groups the FRFs are zero.
    residual_level : ndarray, shape (r,)
        Noise level that the residual shows.
    off_diagonal : ndarray, shape (r,)
        Noise level that the entries of C off the diagonal show, or NaN where they are not used.
    equations : ndarray, shape (r,)
        Complex equations used: entries of C on lines that are not left out.
    lost : ndarray of bool, shape (n_freq, n)
        Lines on which gamma_jk, the block that is inverted, is lost in noise, for each DOF.
    left_out : ndarray of bool, shape (r, n_freq, n)
        Lines left out: those lost, unless too few would remain, and those on which the corrected FRFs do not settle.
    iterations : ndarray of int, shape (r,)
        Linearisations done.
    converged : ndarray of bool, shape (r,)
        Whether the parameters converged.
    line_gradient : ndarray, shape (r, n_freq, p)
        Contribution of each line to the gradient, at unit noise level; sums to zero; zero where the line is left out.
    line_information : ndarray, shape (r, n_freq, p, p)
        Contribution of each line to the information.
    """

    parameters: tuple[Parameter, ...]
    theta: FloatArray
    covariance: FloatArray
    identifiable: NDArray[np.bool_]
    groups: tuple[NDArray[np.intp], ...]
    residual_level: FloatArray
    off_diagonal: FloatArray
    equations: FloatArray
    lost: NDArray[np.bool_]
    left_out: NDArray[np.bool_]
    iterations: NDArray[np.intp]
    converged: NDArray[np.bool_]
    line_gradient: FloatArray
    line_information: FloatArray

    def of_identifiable(self) -> ComplianceEstimate:
        """Return the same for the parameters that are identifiable."""
        which = np.flatnonzero(self.identifiable)
        return self._replace(
            parameters=tuple(self.parameters[i] for i in which),
            theta=self.theta[:, which],
            covariance=self.covariance[:, which[:, None], which],
            identifiable=self.identifiable[which],
            line_gradient=self.line_gradient[..., which],
            line_information=self.line_information[..., which[:, None], which],
        )


def estimate(
    h: ComplexArray,
    transform: FloatArray,
    basis: Basis,
    *,
    variance: FloatArray | None = None,
    reciprocal: bool = True,
    cross: CrossTerms = "zero",
    used: NDArray[np.bool_] | None = None,
    initial: ComplexArray | None = None,
    level: FloatArray | None = None,
    tolerance: float = 0.05,
) -> ComplianceEstimate:
    """Maximum-likelihood parameters of a joint.

    Parameters
    ----------
    h : ndarray, shape (r, n_freq, m, m)
        Measured FRFs, m/N.
    transform : ndarray, shape (2 n, m)
        From measured points to joint DOFs j, then k.
    basis : Basis
        Terms of K*(w).
    variance : ndarray, shape (n_freq, m, m), optional
        E|e|^2 of the measured FRFs for unit level, (m/N)^2; by default noise relative to each entry, |h|^2.
    reciprocal : bool
        Symmetrise h first.
    cross : {"zero", "ignore", "fit"}
        How the entries of C off its diagonal are used: as zero; not at all; by the cross terms of the basis.
    used : ndarray of bool, shape (n_freq, n), optional
        Lines used for each DOF; all by default.
    initial : ndarray, shape (r, n_freq, m, m), optional
        FRFs about which is linearised first; by default the mean of the neighbouring lines of `h`, which must then be
        neighbours in frequency.
    level : ndarray, shape (r,), optional
        Noise level, to judge convergence and lost lines; by default from the residual and from reciprocity.
    tolerance : float
        Share of its standard error by which a parameter may still change when the iteration ends.

    Returns
    -------
    ComplianceEstimate
    """
    n = transform.shape[0] // 2
    initial = neighbour_mean(h) if initial is None else initial
    noise = np.ones(len(h)) if level is None else level
    if level is None and variance is None:
        noise = reciprocity_noise(h)
    used = np.ones((h.shape[1], n), bool) if used is None else used
    parts = []
    for dofs, points in uncoupled_groups(h, transform):
        own, which = basis.of_dofs(dofs)
        data = GroupData(
            measured=_between(h, points),
            initial=_between(initial, points),
            transform=np.ascontiguousarray(transform[np.r_[dofs, n + dofs][:, None], points]),
            variance=None if variance is None else _between(variance, points),
            reciprocal=reciprocal,
            cross=cross,
            basis=own,
            used=used[:, dofs],
        )
        parts.append(_Part(dofs, which, *_fit_part(data, noise, level, tolerance)))
    return _joined(parts, n, basis.parameters)


class _Part(NamedTuple):
    """The fit of one group: its DOFs and parameters, lines lost and left out, lines kept, and the result from these."""

    dofs: NDArray[np.intp]
    which: NDArray[np.intp]
    lost: NDArray[np.bool_]
    left_out: NDArray[np.bool_]
    lines: NDArray[np.intp]
    found: GroupEstimate


def _fit_part(
    data: GroupData, noise: FloatArray, level: FloatArray | None, tolerance: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.intp], GroupEstimate]:
    """Leave out the lines that are lost, unless too few remain, and fit; see `_Part`."""
    if data.reciprocal:
        data = data.symmetrised()
    ratio = gamma_noise(data.measured, data.transform, noise, data.variance, whole=False)
    lost = ~(np.median(ratio, axis=0) <= NOISE_LIMIT)
    inside = data.used.any(axis=1)
    enough = np.count_nonzero(inside & ~lost) >= max(2, len(data.basis.parameters))
    lines = np.flatnonzero(inside & ~lost if enough else inside)
    found = fit_group(data if lines.size == inside.size else data.on_lines(lines), noise, level, tolerance)
    left_out = np.tile(inside, (len(found.theta), 1))
    left_out[:, lines] = found.line_weight == 0
    return lost, left_out, lines, found


def _between(h: NDArray[Any], points: NDArray[np.intp]) -> NDArray[Any]:
    """Return the FRFs between some of the points."""
    return h if points.size == h.shape[-1] else np.ascontiguousarray(h[..., points[:, None], points])


def _joined(parts: list[_Part], n: int, parameters: tuple[Parameter, ...]) -> ComplianceEstimate:
    """Put the fits of all groups together."""
    r, n_freq, p = len(parts[0].found.theta), parts[0].lost.size, len(parameters)
    theta, covariance = np.zeros((r, p)), np.zeros((r, p, p))
    gradient, information = np.zeros((r, n_freq, p)), np.zeros((r, n_freq, p, p))
    identifiable, lost, left_out = np.zeros(p, bool), np.zeros((n_freq, n), bool), np.zeros((r, n_freq, n), bool)
    for dofs, which, own_lost, own_left_out, lines, found in parts:
        theta[:, which], identifiable[which] = found.theta, True
        covariance[:, which[:, None], which] = found.covariance
        lost[:, dofs] = own_lost[:, None]
        left_out[..., dofs] = own_left_out[..., None]
        gradient[:, lines[:, None], which] = found.line_gradient
        information[:, lines[:, None, None], which[:, None], which] = found.line_information
    total = {
        name: np.sum([getattr(part.found, name) for part in parts], axis=0)
        for name in ("squares", "off_diagonal_squares", "equations", "off_diagonal_equations")
    }
    number = total["off_diagonal_equations"]
    off_diagonal = np.divide(total["off_diagonal_squares"], number, out=np.full(r, np.nan), where=number > 0)
    freedom = total["equations"] - np.count_nonzero(identifiable) / 2
    return ComplianceEstimate(
        parameters=parameters,
        theta=theta,
        covariance=covariance,
        identifiable=identifiable,
        groups=tuple(part.dofs for part in parts),
        residual_level=np.sqrt(total["squares"] / np.maximum(freedom, 1)),
        off_diagonal=np.sqrt(off_diagonal),
        equations=total["equations"],
        lost=lost,
        left_out=left_out,
        iterations=np.max([part.found.iterations for part in parts], axis=0),
        converged=np.all([part.found.converged for part in parts], axis=0),
        line_gradient=gradient,
        line_information=information,
    )
