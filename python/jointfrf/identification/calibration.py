"""What errors of channels and FRFs that are smooth over frequency add to the uncertainty of parameters."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from scipy import special

from jointfrf.frf.calibration import CalibrationErrors
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["CalibrationSpread", "Effects", "effects_by_function", "student_factor"]

#: Variances of fewer degrees of freedom than one are taken to have one.
_LEAST_DEGREES = 1.0


class Effects(NamedTuple):
    """What unit errors do, of `number` FRFs or channels alike in size.

    Attributes
    ----------
    steps : ndarray, shape (number, 2, n_functions, p)
        Change of the parameters by each function of gain and of phase.
    squares : ndarray, shape (2, n_functions)
        Of the residual, over the noise, that unit variances of all leave, in the mean.
    """

    steps: FloatArray
    squares: FloatArray


def effects_by_function(
    gradients: Iterable[tuple[ComplexArray, FloatArray]], functions: FloatArray, to_steps: FloatArray
) -> Effects:
    """Return effects from those of each line.

    Parameters
    ----------
    gradients : iterable of (ndarray, ndarray), shapes (n_freq, p) and (n_freq,)
        Of a relative error of 1 on each line: change of the gradient (its real part; minus the imaginary part for an
        error of 1j), and squares of the residual.
    functions : ndarray, shape (2, n_functions, n_freq)
        Of gain and phase.
    to_steps : ndarray, shape (p, p)
        From gradients to changes of parameters: the transpose of the inverse information.
    """
    steps, total = [], np.zeros(functions.shape[:2])
    for gradient, squares in gradients:
        by_function = np.stack([functions[0] @ gradient.real, functions[1] @ -gradient.imag])
        steps.append(by_function @ to_steps)
        total += functions**2 @ squares
    return Effects(np.array(steps).reshape(len(steps), *functions.shape[:2], len(to_steps)), total)


class CalibrationSpread(NamedTuple):
    """What smooth errors add to the uncertainty.

    Attributes
    ----------
    covariance : ndarray, shape (p, p)
    degrees : ndarray, shape (p,)
        Degrees of freedom of each variance.
    squares : float
        Of the residual over the noise, that they leave in the mean.
    squares_error : float
        Standard deviation of these.
    """

    covariance: FloatArray
    degrees: FloatArray
    squares: float
    squares_error: float

    @classmethod
    def of(cls, errors: CalibrationErrors, of_channels: Effects, of_own: Effects | None) -> CalibrationSpread:
        """Return what errors of these variances do.

        Parameters
        ----------
        errors : CalibrationErrors
        of_channels : Effects
            Of responses, and of forces, each with half the variance of their difference.
        of_own : Effects or None
            Of single FRFs; None where they have no errors of their own.
        """
        kinds = [(errors.channel / 2, errors.channel_degrees, of_channels)]
        if of_own is not None:
            kinds.append((errors.own, errors.own_degrees, of_own))
        p = of_channels.steps.shape[-1]
        covariance, scatter = np.zeros((p, p)), np.zeros(p)
        total = total_scatter = 0.0
        for variance, degrees, effects in kinds:
            # Functions of one variance share its error.
            for value, count in {*zip(variance[variance > 0].tolist(), degrees[variance > 0].tolist(), strict=True)}:
                own = variance == value
                steps = effects.steps[:, own].reshape(-1, p)
                added, squares = value * steps.T @ steps, value * float(effects.squares[own].sum())
                covariance += added
                scatter += np.diagonal(added) ** 2 / max(count, _LEAST_DEGREES)
                total += squares
                total_scatter += 2 * squares**2 / max(count, _LEAST_DEGREES)
        with np.errstate(divide="ignore", invalid="ignore"):
            found = np.diagonal(covariance) ** 2 / scatter
        return cls(covariance, np.nan_to_num(found, nan=np.inf), total, float(np.sqrt(total_scatter)))


def student_factor(noise: FloatArray, added: FloatArray, degrees: FloatArray) -> FloatArray:
    """Return by how much variances of noise and of what is added, of few degrees of freedom, count more in an interval.

    Of the sum, degrees of freedom by Satterthwaite; the square of Student's t over that of the normal distribution.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        whole = np.where(added > 0, degrees * ((noise + added) / added) ** 2, np.inf)
    few = np.isfinite(whole) & (whole < 1e6)
    factor = np.ones_like(noise)
    factor[few] = (special.stdtrit(np.maximum(whole[few], _LEAST_DEGREES), 0.975) / special.ndtri(0.975)) ** 2
    return factor
