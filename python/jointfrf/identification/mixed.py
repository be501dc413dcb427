"""The mixed model: random effects with a variance, as columns next to the columns of the parameters.

r = J dx + sum over k of B_k u_k + e,   u_k ~ N(0, v_k I),   e ~ N(0, I)

with the whitened residual r and its derivatives J by the coordinates. Each effect k moves the coordinates by
A^-1 J^T B_k u_k, A = J^T J, and so adds v_k A^-1 J^T B_k B_k^T J A^-1 to their covariance. A variance that was
estimated from few errors has few degrees of freedom, and intervals follow Student's t (Satterthwaite).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jointfrf.frf.bands import line_slices
from jointfrf.frf.calibration import CalibrationErrors
from jointfrf.frf.moving_mass import MovingMass
from jointfrf.identification.linearised import Linearised
from jointfrf.identification.scatter import student_squared
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["Added", "Effect", "added_by", "mass_effects", "parameter_ratio", "smooth_effects", "student_factor"]

#: Least number of degrees of freedom of a variance.
_LEAST_DEGREES = 1.0


class Effect(NamedTuple):
    """Independent errors of one variance, and their columns J^T B.

    Attributes
    ----------
    gradient : ndarray, shape (n_errors, n_parts, p)
        Change of the gradient on each part of the band by a unit of each error.
    variance : float
        Variance of the errors.
    degrees : float
        Degrees of freedom of the variance; inf if it was given.
    squares : float
        Squares of the complex residual that unit errors leave, in the mean.
    """

    gradient: FloatArray
    variance: float
    degrees: float = np.inf
    squares: float = 0.0

    def steps(self, covariance: FloatArray) -> FloatArray:
        """Return the change of the coordinates by a unit of each error, shape (n_errors, p)."""
        return np.asarray(self.gradient.sum(axis=1) @ covariance)

    def between(self, inverse: FloatArray, parts: FloatArray, covariance: FloatArray) -> FloatArray:
        """Return the covariance of the difference between parts of the band and all lines, shape (n_chosen, p, p).

        Parameters
        ----------
        inverse : ndarray, shape (n_chosen, p, p)
            Inverse of the information of each part chosen.
        parts : ndarray of bool, shape (n_parts,)
            The parts chosen.
        covariance : ndarray, shape (p, p)
            Covariance for all lines.
        """
        apart = np.einsum("ebp,bpq->ebq", self.gradient[:, parts], inverse) - self.steps(covariance)[:, None]
        return np.asarray(self.variance * np.einsum("ebp,ebq->bpq", apart, apart))


class Added(NamedTuple):
    """Contribution of random effects to the uncertainty.

    Attributes
    ----------
    covariance : ndarray, shape (p, p)
        Covariance of the coordinates.
    degrees : ndarray, shape (p,)
        Degrees of freedom of the part of each variance that was estimated.
    estimated : ndarray, shape (p,)
        This part as a share of the variance.
    squares, squares_error : float
        Squares of the complex residual that the effects leave, in the mean, and their standard deviation.
    """

    covariance: FloatArray
    degrees: FloatArray
    estimated: FloatArray
    squares: float
    squares_error: float


def added_by(effects: Sequence[Effect], at: Linearised) -> Added:
    """Return the sum of independent effects; degrees of freedom belong to the parameters, not to the coordinates."""
    p = len(at.slope)
    covariance, scatter, whole, estimated = np.zeros((p, p)), *np.zeros((3, p))
    total = total_scatter = 0.0
    for one in effects:
        steps, degrees = one.steps(at.covariance), max(one.degrees, _LEAST_DEGREES)
        covariance += one.variance * steps.T @ steps
        own = one.variance * ((steps @ at.slope.T) ** 2).sum(axis=0)
        whole += own
        estimated += own if np.isfinite(degrees) else 0.0
        scatter += own**2 / degrees
        total += one.variance * one.squares
        total_scatter += 2 * (one.variance * one.squares) ** 2 / degrees
    with np.errstate(divide="ignore", invalid="ignore"):
        degrees_of_sum, share = estimated**2 / scatter, estimated / whole
    return Added(
        covariance, np.nan_to_num(degrees_of_sum, nan=np.inf), np.nan_to_num(share), total,
        float(np.sqrt(total_scatter)),
    )  # fmt: skip


def parameter_ratio(added: FloatArray, at: Linearised) -> FloatArray:
    """Return the variance of each parameter by a covariance of the coordinates over the noise variance, shape (p,)."""
    own, noise = (np.einsum("ij,jk,ik->i", at.slope, one, at.slope) for one in (added, at.covariance))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(own / noise))


def student_factor(noise: FloatArray, added: FloatArray, degrees: FloatArray) -> FloatArray:
    """Return the factor by which a variance counts more in an interval because a part of it has few degrees of freedom.

    Parameters
    ----------
    noise, added : ndarray
        Known part and estimated part of the variance.
    degrees : ndarray
        Degrees of freedom of the estimated part.

    Notes
    -----
    The squared ratio of Student's t and the normal quantile, with Satterthwaite degrees of freedom of the sum. An
    interval is no narrower than for the estimated part alone, although noise raises the degrees of the sum.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        whole = np.where(added > 0, degrees * ((noise + added) / added) ** 2, np.inf)
        alone = np.where(added > 0, added / (noise + added), 0.0)
    factor = np.ones_like(noise)
    for count, share in ((whole, np.ones_like(noise)), (degrees, alone)):
        few = np.isfinite(count) & (share > 0)
        factor[few] = np.maximum(factor[few], share[few] * student_squared(np.maximum(count[few], _LEAST_DEGREES)))
    return factor


def mass_effects(
    at: Linearised, mass: MovingMass | None, freq_hz: FloatArray, h: ComplexArray, member: FloatArray
) -> list[Effect]:
    """Return the error of the mass of a sensor that was removed from FRFs h, shape (n_freq, m, m)."""
    if mass is None or not mass.std_error > 0:
        return []
    rows = np.broadcast_to(np.eye(h.shape[1], dtype=bool)[:, :, None], (h.shape[1], *h.shape[1:]))
    masks = rows.swapaxes(1, 2) if mass.with_force else rows
    gradient = np.zeros((1, len(member), len(at.slope)))
    for which in line_slices(len(freq_hz)):
        relative = mass.errors(freq_hz[which], h[which])
        for own, (line, _) in zip(relative.T, at.errors(masks, which), strict=True):
            gradient[0] += member[:, which] @ (line * own[:, None]).real
    return [Effect(gradient, mass.std_error**2)]


def smooth_effects(
    at: Linearised, errors: CalibrationErrors | None, freq_hz: FloatArray, shape: tuple[int, int], member: FloatArray
) -> list[Effect]:
    """Return gains and phases of channels, set-ups and FRFs, as functions of frequency.

    Parameters
    ----------
    at : Linearised
        Likelihood about its minimum.
    errors : CalibrationErrors or None
        Smooth errors of the FRFs.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    shape : (int, int)
        Numbers of responses and forces.
    member : ndarray, shape (n_parts, n_freq)
        Indicator of the lines of each part of the band, 1 and 0.

    Notes
    -----
    h_pq - h_qp shows only the difference of the errors of response and force p. Their sum is assumed to be as large,
    because both are independent.
    """
    if errors is None:
        return []
    functions, found, p = errors.functions(freq_hz), list[Effect](), len(at.slope)
    for kind, variance, degrees in errors.kinds():
        masks = errors.masks(kind, shape)
        gradient = np.zeros((len(masks), *functions.shape[:2], len(member), p))
        squares = np.zeros(functions.shape[:2])
        for which in line_slices(len(freq_hz)):
            own = functions[:, :, None, which] * member[:, which]
            for i, (line, line_squares) in enumerate(at.errors(masks, which)):
                gradient[i, 0] += own[0] @ line.real
                gradient[i, 1] -= own[1] @ line.imag
                squares += functions[:, :, which] ** 2 @ line_squares
        # Functions whose variance was estimated together are one effect.
        pairs = zip(variance[variance > 0].tolist(), degrees[variance > 0].tolist(), strict=True)
        for value, count in dict.fromkeys(pairs):
            same = variance == value
            columns = gradient[:, same].reshape(-1, len(member), p)
            found.append(Effect(columns, value, count, float(squares[same].sum())))
    return found
