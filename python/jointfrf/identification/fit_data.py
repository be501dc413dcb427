"""Data behind a fit, kept by reference for figures: FRFs, noise, and the contribution of each line."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.point_lines import Interface
from jointfrf.frf.noise_model import NoiseModel
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.model.fit import OpenDirection
from jointfrf.identification.model.joint_motion import FoundMotion
from jointfrf.identification.model.next_channels import NextChannel
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["FitData", "ModelData"]


@dataclass(frozen=True, eq=False)
class FitData:
    """Measured FRFs behind a fit to FRFs between all joint DOFs, on its lines and in their order; nothing is copied.

    Attributes
    ----------
    measured : ndarray, shape (n_freq, m_r, m_f)
        FRFs of the channels, m/N.
    response_names, force_names : tuple of str
        Names of the channels.
    responses, forces : ndarray, shapes (2 n, m_r), (2 n, m_f)
        Matrices from channels to joint DOFs j, then k.
    modes : tuple of ndarray, shapes (m_r, 2 n) and (m_f, 2 n), or None
        Motion of the channels for a unit of each joint DOF if the sides are rigid; None if it is not known.
    interface : Interface or None
        Geometry of the channels, if known.
    reciprocal : bool
        Whether h_pq and h_qp are the same FRF.
    variance : ndarray, shape (n_freq, m_r, m_f)
        Noise variance E|e|^2 that defines the weights of the fit, (m/N)^2. The estimated noise variance is
        `variance_scale` times this.
    variance_scale : float
        Ratio of estimated noise variance to `variance`.
    deformation : ndarray, shape (n_freq, m_r, m_f), or None
        Part of the variance that is not noise but non-rigid motion of the channels, (m/N)^2.
    noise : NoiseModel or None
        Noise model, if it was estimated from the FRFs and is not too large to keep.
    fitted : ndarray of bool, shape (n_freq, n)
        Lines used for each DOF: inside its bands, and fitting a joint within their noise.
    regenerated : callable
        Function from a slice of the lines to FRFs between the joint DOFs, m/N, shape (lines, 2 n, 2 n). They fit the
        identified joint and are nearest to the measured FRFs. NaN if there are none.
    line_compliance : callable
        Function that returns the diagonal of the joint compliance C by line, shape (n_freq, n), m/N. It is linearised
        at FRFs that fit the joint, so it lacks the bias of an inverse of noise. NaN if a line does not determine it.
    information : callable
        Function that returns the share of each line in the information on each parameter, shape (n_freq, p).
    hidden_errors : callable
        Function that returns the change of each parameter, by its name, for errors that no FRF shows:

        - ``"delay"``: a delay of 1 us of all forces
        - ``"resonance"``: a resonance of all sensors at ten times the highest line
        - ``"force-noise"``: 1 % of noise in the power of the force, with H1
        - ``"position"``: channel positions with a standard deviation of 1 mm, if an `Interface` states them
    """

    measured: ComplexArray
    response_names: tuple[str, ...]
    force_names: tuple[str, ...]
    responses: FloatArray
    forces: FloatArray
    modes: tuple[FloatArray, FloatArray] | None
    interface: Interface | None
    reciprocal: bool
    variance: FloatArray
    variance_scale: float
    deformation: FloatArray | None
    noise: NoiseModel | None
    fitted: NDArray[np.bool_]
    regenerated: Callable[[slice], ComplexArray]
    line_compliance: Callable[[], ComplexArray]
    information: Callable[[], FloatArray]
    hidden_errors: Callable[[], Mapping[str, Mapping[str, float]]]

    def noise_variance(self, lines: slice) -> FloatArray:
        """Return the estimated E|e|^2 on some lines, shape (lines, m_r, m_f); inf if an FRF is not used."""
        own: FloatArray = self.variance[lines]
        if self.deformation is not None:
            with np.errstate(invalid="ignore"):
                own = np.where(np.isfinite(own), own - self.deformation[lines], np.inf)
        return own * self.variance_scale


@dataclass(frozen=True, eq=False)
class ModelData:
    """Measured FRFs behind a fit of an assembly, and the FRFs of the models; nothing is copied.

    Attributes
    ----------
    assembly : Assembly
        Fitted assembly.
    measured : ndarray, shape (n_freq, n_o, n_i)
        Measured FRFs, m/N; NaN if not measured.
    variance : ndarray, shape (n_freq, n_o, n_i)
        Noise variance E|e|^2, (m/N)^2; inf if not measured.
    predicted : ndarray, shape (n_freq, n_o, n_i)
        FRFs of the fitted assembly, m/N.
    residual : ndarray, shape (n_freq, n_o, n_i)
        Measured minus predicted FRFs over the standard deviation of the noise; NaN if not measured.
    open_directions : tuple of OpenDirection
        Combinations of parameters that the FRFs do not determine.
    next_channels : callable
        Function that returns the channels, not measured yet, that would narrow the widest interval of the joint most,
        best first. It reduces the models again for these channels.
    joint_motion : FoundMotion
        Function that returns the motion of the joint and the contribution to the fit on each line; fits another joint.
    """

    assembly: Assembly
    measured: ComplexArray
    variance: FloatArray
    predicted: ComplexArray
    residual: ComplexArray
    open_directions: tuple[OpenDirection, ...]
    next_channels: Callable[[], tuple[NextChannel, ...]]
    joint_motion: FoundMotion
