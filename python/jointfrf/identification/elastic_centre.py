"""Elastic centre: the reference point at which the stiffness of a joint is most nearly diagonal."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jointfrf.dofs import is_rotation, rigid_offset
from jointfrf.identification.result import Fit
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray, check_type
from jointfrf.laws.law_joint import LawJoint

__all__ = ["ElasticCentre", "elastic_centre"]

#: Change of the coupling, relative to the largest for an offset of this length, below which a direction is ignored.
_UNSEEN = 1e-6
#: Lower bound of the standard error of a coupling: a joint is hardly ever diagonal to more.
_FLOOR = 0.01


class ElasticCentre(NamedTuple):
    """Reference point at which a joint is most nearly diagonal.

    Attributes
    ----------
    offset : ndarray, shape (3,)
        Vector from the present reference points along x, y, z, m; 0 along directions without effect.
    std_error : ndarray, shape (3,)
        Standard error from the covariance of the stiffness, m; 0 without a covariance, inf along directions without
        effect.
    covariance : ndarray, shape (3, 3)
        Covariance of the offset, m^2, along directions that have an effect.
    coupling_before, coupling : float
        Largest |K_ab| / sqrt(K_aa K_bb) between two DOFs at the present point and at the new point.
    joint : Joint
        Joint at the new point, see `Joint.moved`.
    """

    offset: FloatArray
    std_error: FloatArray
    covariance: FloatArray
    coupling_before: float
    coupling: float
    joint: Joint


def elastic_centre(joint: Joint | Fit) -> ElasticCentre:
    """Find the reference point at which the stiffness of a joint is most nearly diagonal.

    Parameters
    ----------
    joint : Joint or Fit
        Joint with its full stiffness, or a fit with ``cross="fit"``. A fit gives the offset a standard error, and
        imprecise cross terms get less weight.

    Returns
    -------
    ElasticCentre
        Offset with its standard error, coupling before and after, and the joint at the new point.

    Raises
    ------
    ValueError
        No translation and rotation together, names of DOFs without a direction, a stiffness that is not
        positive on the diagonal.

    See Also
    --------
    Joint.moved : the joint at another reference point.
    identify : fit of a joint with its cross terms.

    Notes
    -----
    The function minimises the sum of K_ab^2 / (K_aa K_bb) over pairs of DOFs. Moving the reference point by r gives
    the stiffness T^-T K T^-1. Only coupling of translations with rotations and between rotations depends on r. If the
    joint is diagonal at some point, this point is the centre of stiffness and of compliance; otherwise it is the best
    compromise. The covariance of r follows from the covariance of K by the implicit derivative of the minimum.

    References
    ----------
    J. Loncaric, Normal forms of stiffness and compliance matrices, IEEE Journal of Robotics and Automation 3 (1987).

    Examples
    --------
    >>> import jointfrf as jf
    >>> joint = jf.Joint([1e6, 2e6, 3e6, 1e3, 2e3, 3e3], dofs=["x", "y", "z", "theta_x", "theta_y", "theta_z"])
    >>> (-jf.elastic_centre(joint.moved([0, 0.006, 0])).offset).round(9).tolist()
    [-0.0, 0.006, -0.0]
    """
    covariance = _stiffness_covariance(joint) if isinstance(joint, Fit) else None
    if isinstance(joint, Fit):
        found = joint.joint
        joint = found.constant_joint() if isinstance(found, LawJoint) else found
    check_type("joint", joint, Joint)
    turns = [is_rotation(dof) for dof in joint.dofs]
    if all(turns) or not any(turns):
        raise ValueError(
            f"joint needs translations and rotations to have an elastic centre, not {', '.join(joint.dofs)}"
        )
    diagonal = np.diagonal(joint.stiffness)
    if not (diagonal > 0).all():
        bad = int(np.argmin(diagonal))
        raise ValueError(f"joint: the stiffness of {joint.dofs[bad]} must be positive, not {diagonal[bad]:g}")
    return _minimised(_Coupling(joint, covariance))


def _stiffness_covariance(fit: Fit) -> FloatArray:
    """Return the covariance of the entries of the stiffness, shape (n, n, n, n)."""
    n = len(fit.dofs)
    place = np.zeros((n, n, len(fit.parameters)))
    for i, term in enumerate(fit.parameters):
        if term.kind == "k" and term.origin == "joint":
            a, b = fit.dofs.index(term.row), fit.dofs.index(term.column)
            place[a, b, i] = place[b, a, i] = 1
    covariance: FloatArray = np.einsum("abi,ij,cdj->abcd", place, fit.covariance, place)
    return covariance


class _Coupling:
    """Normalised, weighted coupling as a function of offset and stiffness."""

    def __init__(self, joint: Joint, covariance: FloatArray | None) -> None:
        self.joint, self.covariance = joint, covariance
        self.rows, self.columns = np.triu_indices(len(joint.dofs), 1)
        # Units of rotations in which their stiffness equals the stiffness of a translation.
        turns = np.array([is_rotation(dof) for dof in joint.dofs])
        k = np.diagonal(joint.stiffness)
        self.length = float(np.sqrt(np.median(k[turns]) / np.median(k[~turns])))
        # A rigid offset is the unit matrix and a linear function of the offset.
        self.turned = np.array([rigid_offset(joint.dofs, unit) for unit in np.eye(3)]) - np.eye(len(joint.dofs))
        self.weight = np.ones(self.rows.size)
        if covariance is not None:
            slope = self._by_stiffness(np.zeros(3))
            variance = np.einsum("iab,abcd,icd->i", slope, covariance, slope)
            self.weight = 1 / np.sqrt(np.maximum(variance, 0) + _FLOOR**2)

    def at(self, offset: FloatArray, stiffness: FloatArray | None = None) -> FloatArray:
        """Return the coupling of all pairs, not weighted."""
        k = self.joint.stiffness if stiffness is None else stiffness
        back = np.eye(len(k)) - np.tensordot(offset, self.turned, 1)
        moved = back.T @ k @ back
        root = np.sqrt(abs(np.diagonal(moved)))
        coupling: FloatArray = (moved / np.outer(root, root))[self.rows, self.columns]
        return coupling

    def weighted(self, scaled: FloatArray) -> FloatArray:
        """Return the weighted coupling at an offset in units of the length."""
        return self.weight * self.at(scaled * self.length)

    def linear(self) -> FloatArray:
        """Return the scaled offset at which translations and rotations are least coupled, by linear least squares."""
        joint, turns = self.joint, np.array([is_rotation(dof) for dof in self.joint.dofs])
        root = np.sqrt(np.diagonal(joint.stiffness)[~turns])[:, None]

        def coupled(offset: FloatArray) -> FloatArray:
            block: FloatArray = (joint.moved(offset).stiffness[~turns][:, turns] / root).ravel()
            return block

        base = coupled(np.zeros(3))
        slope = np.stack([coupled(self.length * unit) - base for unit in np.eye(3)], axis=1)
        found: FloatArray = -np.linalg.pinv(slope, rcond=_UNSEEN) @ base
        return found

    def _by_stiffness(self, offset: FloatArray) -> FloatArray:
        """Return the derivatives by the entries of the stiffness, shape (pairs, n, n), by central differences."""
        k = self.joint.stiffness
        root = np.sqrt(np.diagonal(k))
        slope = np.zeros((self.rows.size, *k.shape))
        for a in range(len(k)):
            for b in range(len(k)):
                step = np.zeros_like(k)
                step[a, b] = 1e-6 * root[a] * root[b]
                slope[:, a, b] = (self.at(offset, k + step) - self.at(offset, k - step)) / (2 * step[a, b])
        return slope

    def offset_covariance(self, offset: FloatArray, jacobian: FloatArray, seen: FloatArray) -> FloatArray:
        """Return the covariance of the offset, from the covariance of the stiffness."""
        if self.covariance is None:
            return np.zeros((3, 3))
        to_offset = -self.length * seen @ np.linalg.pinv(jacobian @ seen) * self.weight
        by_stiffness = np.tensordot(to_offset, self._by_stiffness(offset), 1)
        found: FloatArray = np.einsum("iab,abcd,jcd->ij", by_stiffness, self.covariance, by_stiffness)
        return found


def _minimised(coupling: _Coupling) -> ElasticCentre:
    """Minimise the coupling from the present point, and from the zero of its linear part."""
    from scipy import optimize

    start = optimize.least_squares(coupling.weighted, np.zeros(3), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    linear = optimize.least_squares(coupling.weighted, coupling.linear(), xtol=1e-14, ftol=1e-14, gtol=1e-14)
    best = min((start, linear), key=lambda one: one.cost)
    jacobian = _jacobian(coupling, best.x)
    _, size, right = np.linalg.svd(jacobian, full_matrices=True)
    size = np.pad(size, (0, 3 - size.size))
    is_seen = size > _UNSEEN * max(size[0], np.finfo(float).tiny)
    seen = right[is_seen].T
    offset: FloatArray = coupling.length * (seen @ (seen.T @ best.x))
    covariance = coupling.offset_covariance(offset, jacobian, seen)
    blind = (right[~is_seen] ** 2).sum(axis=0) > _UNSEEN
    error = np.where(blind, np.inf, np.sqrt(np.maximum(np.diagonal(covariance), 0)))
    before, after = (float(abs(coupling.at(at)).max()) for at in (np.zeros(3), offset))
    return ElasticCentre(offset, error, covariance, before, after, coupling.joint.moved(offset))


def _jacobian(coupling: _Coupling, at: FloatArray) -> FloatArray:
    """Return the derivatives of the weighted coupling by the scaled offset, shape (pairs, 3)."""
    steps = 1e-6 * np.eye(3)
    slope: FloatArray = np.stack(
        [(coupling.weighted(at + step) - coupling.weighted(at - step)) / 2e-6 for step in steps], axis=1
    )
    return slope
