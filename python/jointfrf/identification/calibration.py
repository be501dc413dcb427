"""What errors of channels, set-ups and FRFs that are smooth over frequency add to the uncertainty of parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from scipy import special

from jointfrf.frf.calibration import CalibrationErrors, ErrorKind
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
        Of the coordinates.
    degrees : ndarray, shape (p,)
        Degrees of freedom of the variance of each parameter, as far as it was found.
    found : ndarray, shape (p,)
        Share of that variance that was found, and not said.
    squares : float
        Of the residual over the noise, that they leave in the mean.
    squares_error : float
        Standard deviation of these.
    """

    covariance: FloatArray
    degrees: FloatArray
    found: FloatArray
    squares: float
    squares_error: float

    @classmethod
    def of(
        cls, errors: CalibrationErrors, slope: FloatArray, effects_of: Callable[[ErrorKind], Effects]
    ) -> CalibrationSpread:
        """Return what errors of these variances do.

        Parameters
        ----------
        errors : CalibrationErrors
        slope : ndarray, shape (p, p)
            Derivatives of the parameters by the coordinates: degrees of freedom are those of the parameters.
        effects_of : callable
            Returns what unit errors of a kind do to the coordinates.
        """
        p = len(slope)
        to_parameters = np.where(np.isfinite(slope).all(axis=1, keepdims=True), slope, np.eye(p))
        covariance, scatter, whole, of_found = np.zeros((p, p)), *np.zeros((3, p))
        total = total_scatter = 0.0
        for kind, variance, degrees in errors.kinds():
            effects = effects_of(kind)
            # Functions of one variance share its error.
            for value, count in {*zip(variance[variance > 0].tolist(), degrees[variance > 0].tolist(), strict=True)}:
                own = variance == value
                steps = effects.steps[:, own].reshape(-1, p)
                added, squares = value * steps.T @ steps, value * float(effects.squares[own].sum())
                covariance += added
                own_parts = value * ((steps @ to_parameters.T) ** 2).sum(axis=0)
                whole += own_parts
                of_found += own_parts if np.isfinite(count) else 0.0
                scatter += own_parts**2 / max(count, _LEAST_DEGREES)
                total += squares
                total_scatter += 2 * squares**2 / max(count, _LEAST_DEGREES)
        with np.errstate(divide="ignore", invalid="ignore"):
            degrees_of_sum, share = of_found**2 / scatter, of_found / whole
        return cls(
            covariance, np.nan_to_num(degrees_of_sum, nan=np.inf), np.nan_to_num(share), total,
            float(np.sqrt(total_scatter)),
        )  # fmt: skip


def student_factor(noise: FloatArray, added: FloatArray, degrees: FloatArray) -> FloatArray:
    """Return by how much variances of noise and of what is added, of few degrees of freedom, count more in an interval.

    Of the sum, degrees of freedom by Satterthwaite; the square of Student's t over that of the normal distribution.
    Noise raises these degrees: an interval is no narrower than that of what is added alone, or noise would narrow it.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        whole = np.where(added > 0, degrees * ((noise + added) / added) ** 2, np.inf)
        alone = np.where(added > 0, added / (noise + added), 0.0)
    factor = np.ones_like(noise)
    for count, share in ((whole, np.ones_like(noise)), (degrees, alone)):
        few = np.isfinite(count) & (count < 1e6) & (share > 0)
        of_few = (special.stdtrit(np.maximum(count[few], _LEAST_DEGREES), 0.975) / special.ndtri(0.975)) ** 2
        factor[few] = np.maximum(factor[few], share[few] * of_few)
    return factor
