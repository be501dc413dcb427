"""Joint parameters from noisy interface FRFs by maximum likelihood in the compliance domain.

The unknowns are the parameters of the joint and, on every line, the true FRFs. The joint is what ties the FRFs of a
line together: C(h) = K*(w)^-1, n^2 complex equations. Linearised about an estimate of the true FRFs this is a
generalised least-squares problem with the full covariance of C; its residual corrects the FRFs, and so on until
nothing moves. Without noise the fixed point is exact; with noise it reaches the Cramer-Rao bound of an unknown
structure around the joint (tests/python/test_estimator.py). Groups of DOFs between which all FRFs are zero are fitted
each by itself.

Everything has a leading axis over realisations, so that a Monte Carlo study is one call.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.compliance_fit.frf_noise import (
    LOST,
    gamma_noise,
    neighbour_mean,
    reciprocity_noise,
    uncoupled_groups,
)
from jointfrf.identification.compliance_fit.group_fit import GroupEstimate, fit_group
from jointfrf.identification.compliance_fit.joint_terms import Basis, Cross, Damping, joint_basis
from jointfrf.identification.compliance_fit.least_squares import inverse_information
from jointfrf.identification.compliance_fit.linearised import Data
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = [
    "Basis",
    "ComplianceEstimate",
    "Cross",
    "Damping",
    "estimate",
    "jackknife_covariance",
    "joint_basis",
    "neighbour_mean",
    "reciprocity_noise",
]


class ComplianceEstimate(NamedTuple):
    """Result of `estimate`, with a leading axis over realisations r.

    Attributes
    ----------
    theta : ndarray, shape (r, p)
        Parameters in the order of the basis.
    covariance : ndarray, shape (r, p, p)
        Their covariance for unit noise level: times level^2.
    seen : ndarray of bool, shape (p,)
        Which parameters the FRFs tell of: not cross terms between DOFs of different groups. These are 0.
    groups : tuple of ndarray of int
        DOFs of each group; between groups the FRFs are zero.
    residual_level : ndarray, shape (r,)
        Noise level that the residual shows.
    off_diagonal : ndarray, shape (r,)
        Noise level that the entries of C beside the diagonal show, or NaN where they are not used.
    equations : ndarray, shape (r,)
        Complex equations used: entries of C on lines that are not left out.
    lost : ndarray of bool, shape (n_freq, n)
        Lines on which gamma_jk, which has to be inverted, is lost in noise, for each DOF.
    left_out : ndarray of bool, shape (r, n_freq, n)
        Lines left out: those lost, unless too few would remain, and those on which the fit does not settle.
    iterations : ndarray of int, shape (r,)
        Linearisations done.
    converged : ndarray of bool, shape (r,)
        Whether the parameters stopped moving.
    line_gradient : ndarray, shape (r, n_freq, p)
        What each line pulls at the parameters, at unit noise level; sums to zero; zero where the line is left out.
    line_information : ndarray, shape (r, n_freq, p, p)
        What each of them knows of the parameters.
    """

    theta: FloatArray
    covariance: FloatArray
    seen: NDArray[np.bool_]
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

    def of_seen(self) -> ComplianceEstimate:
        """Return the same for the parameters that are seen."""
        which = np.flatnonzero(self.seen)
        return self._replace(
            theta=self.theta[:, which],
            covariance=self.covariance[:, which[:, None], which],
            seen=self.seen[which],
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
    cross: Cross = "zero",
    used: NDArray[np.bool_] | None = None,
    near: ComplexArray | None = None,
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
        Make h reciprocal first.
    cross : {"zero", "ignore", "fit"}
        What the entries of C beside its diagonal say: they are zero; nothing; they belong to the terms of the basis.
    used : ndarray of bool, shape (n_freq, n), optional
        Lines used for each DOF; all by default.
    near : ndarray, shape (r, n_freq, m, m), optional
        FRFs about which is linearised first; by default the mean of the neighbouring lines of `h`, which must then be
        neighbours in frequency.
    level : ndarray, shape (r,), optional
        Noise level, to judge convergence and lost lines; by default from the residual and from reciprocity.
    tolerance : float
        Share of its standard error by which a parameter may still move when the iteration stops.

    Returns
    -------
    ComplianceEstimate
    """
    n = transform.shape[0] // 2
    near = neighbour_mean(h) if near is None else near
    noise = np.ones(len(h)) if level is None else level
    if level is None and variance is None:
        noise = reciprocity_noise(h)
    used = np.ones((h.shape[1], n), bool) if used is None else used
    parts = []
    for dofs, points in uncoupled_groups(h, transform):
        own, which = basis.of_dofs(dofs)
        data = Data(
            measured=_between(h, points),
            near=_between(near, points),
            transform=np.ascontiguousarray(transform[np.r_[dofs, n + dofs][:, None], points]),
            variance=None if variance is None else _between(variance, points),
            reciprocal=reciprocal,
            cross=cross,
            basis=own,
            used=used[:, dofs],
        )
        parts.append(_Part(dofs, which, *_fit_part(data, noise, level, tolerance)))
    return _joined(parts, n, len(basis.names))


class _Part(NamedTuple):
    """The fit of one group: its DOFs, its parameters, lines lost and left out, lines kept, and what these gave."""

    dofs: NDArray[np.intp]
    which: NDArray[np.intp]
    lost: NDArray[np.bool_]
    left_out: NDArray[np.bool_]
    lines: NDArray[np.intp]
    found: GroupEstimate


def _fit_part(
    data: Data, noise: FloatArray, level: FloatArray | None, tolerance: float
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.intp], GroupEstimate]:
    """Leave out the lines that are lost, unless too few remain, and fit; see `_Part`."""
    if data.reciprocal:
        data = data.made_reciprocal()
    ratio = gamma_noise(data.measured, data.transform, noise, data.variance, whole=False)
    lost = ~(np.median(ratio, axis=0) <= LOST)
    inside = data.used.any(axis=1)
    enough = np.count_nonzero(inside & ~lost) >= max(2, len(data.basis.names))
    lines = np.flatnonzero(inside & ~lost if enough else inside)
    found = fit_group(data if lines.size == inside.size else data.on_lines(lines), noise, level, tolerance)
    left_out = np.tile(inside, (len(found.theta), 1))
    left_out[:, lines] = found.trust == 0
    return lost, left_out, lines, found


def _between(h: NDArray[Any], points: NDArray[np.intp]) -> NDArray[Any]:
    """Return the FRFs between some of the points."""
    return h if points.size == h.shape[-1] else np.ascontiguousarray(h[..., points[:, None], points])


def _joined(parts: list[_Part], n: int, p: int) -> ComplianceEstimate:
    """Put the fits of all groups together."""
    r, n_freq = len(parts[0].found.theta), parts[0].lost.size
    theta, covariance = np.zeros((r, p)), np.zeros((r, p, p))
    gradient, information = np.zeros((r, n_freq, p)), np.zeros((r, n_freq, p, p))
    seen, lost, left_out = np.zeros(p, bool), np.zeros((n_freq, n), bool), np.zeros((r, n_freq, n), bool)
    for dofs, which, own_lost, own_left_out, lines, found in parts:
        theta[:, which], seen[which] = found.theta, True
        covariance[:, which[:, None], which] = found.covariance
        lost[:, dofs] = own_lost[:, None]
        left_out[..., dofs] = own_left_out[..., None]
        gradient[:, lines[:, None], which] = found.line_gradient
        information[:, lines[:, None, None], which[:, None], which] = found.line_information
    total = {
        name: np.sum([getattr(part.found, name) for part in parts], axis=0)
        for name in ("squares", "squares_beside", "equations", "equations_beside")
    }
    beside = total["equations_beside"]
    return ComplianceEstimate(
        theta=theta,
        covariance=covariance,
        seen=seen,
        groups=tuple(part.dofs for part in parts),
        residual_level=np.sqrt(total["squares"] / np.maximum(total["equations"] - np.count_nonzero(seen) / 2, 1)),
        off_diagonal=np.sqrt(np.divide(total["squares_beside"], beside, out=np.full(r, np.nan), where=beside > 0)),
        equations=total["equations"],
        lost=lost,
        left_out=left_out,
        iterations=np.max([part.found.iterations for part in parts], axis=0),
        converged=np.all([part.found.converged for part in parts], axis=0),
        line_gradient=gradient,
        line_information=information,
    )


def jackknife_covariance(found: ComplianceEstimate, blocks: int = 10) -> FloatArray:
    """Covariance of the parameters from leaving out one block of neighbouring lines after the other.

    It needs no noise level and also sees what the model of the joint cannot follow over frequency. To first order, by
    one Gauss-Newton step without the block.

    Returns
    -------
    ndarray, shape (r, p, p)
    """
    r, _, p = found.line_gradient.shape
    used = np.flatnonzero(found.line_information.any(axis=(0, 2, 3)))
    blocks = min(blocks, used.size)
    whole = found.line_information.sum(axis=1)
    total = found.line_gradient.sum(axis=1)
    moved = np.empty((blocks, r, p))
    for b, lines in enumerate(np.array_split(used, blocks)):
        rest = whole - found.line_information[:, lines].sum(axis=1)
        pull = total - found.line_gradient[:, lines].sum(axis=1)
        moved[b] = (inverse_information(rest) @ pull[..., None])[..., 0]
    moved -= moved.mean(axis=0)
    covariance: FloatArray = (blocks - 1) / blocks * np.einsum("bra,brc->rac", moved, moved)
    return covariance
