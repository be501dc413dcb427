"""What a fit was made from, kept by reference for those who want to look at it: FRFs, noise, what each line says."""

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
        From channels to joint DOFs j, then k.
    modes : tuple of ndarray, shapes (m_r, 2 n) and (m_f, 2 n), or None
        Motion of the channels for a unit of each joint DOF where the sides are rigid; None where it is not known.
    interface : Interface or None
        Geometry of the channels, where it is known.
    reciprocal : bool
        Whether h_pq and h_qp are the same FRF.
    variance : ndarray, shape (n_freq, m_r, m_f)
        E|e|^2 of the noise as it weighs in the fit, (m/N)^2: `variance_scale` times this is that of the noise found.
    variance_scale : float
    deformation : ndarray, shape (n_freq, m_r, m_f), or None
        Part of the variance that is not noise: squares of what is not rigid in the channels, (m/N)^2.
    noise : NoiseModel or None
        Where the noise was found from the FRFs, and these are not too many.
    fitted : ndarray of bool, shape (n_freq, n)
        Lines used for each DOF: inside its bands, and fitting a joint within their noise.
    regenerated : callable
        From a slice of the lines to the FRFs between the joint DOFs, shape (lines, 2 n, 2 n), m/N: nearest to the
        measured ones among all that fit the joint found. NaN where there are none.
    line_compliance : callable
        Returns the diagonal of the joint's compliance C by line, shape (n_freq, n), m/N, as the fit sees it: linearised
        at FRFs that fit the joint, so without the bias of an inverse of noise. NaN where a line does not give it.
    information : callable
        Returns the share of each line in what is known of each parameter, shape (n_freq, p).
    hidden_errors : callable
        Returns the change of each parameter, by its name, by errors that no FRF shows: ``"delay"``, 1 us of all forces;
        ``"resonance"``, sensors that all resonate at ten times the highest line; ``"force-noise"``, 1 % of noise in the
        power of the force, with H1; ``"position"``, positions of channels of standard deviation 1 mm, if an `Interface`
        states them.
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
        """Return E|e|^2 of the noise found on some lines, shape (lines, m_r, m_f); inf where an FRF is not used."""
        own: FloatArray = self.variance[lines]
        if self.deformation is not None:
            with np.errstate(invalid="ignore"):
                own = np.where(np.isfinite(own), own - self.deformation[lines], np.inf)
        return own * self.variance_scale


@dataclass(frozen=True, eq=False)
class ModelData:
    """Measured FRFs behind a fit of an assembly, and what the models make of them; nothing is copied.

    Attributes
    ----------
    assembly : Assembly
        What was fitted.
    measured : ndarray, shape (n_freq, n_o, n_i)
        m/N; NaN where nothing was measured.
    variance : ndarray, shape (n_freq, n_o, n_i)
        E|e|^2 of the noise, (m/N)^2; inf where nothing was measured.
    predicted : ndarray, shape (n_freq, n_o, n_i)
        FRFs of the assembly found, m/N.
    residual : ndarray, shape (n_freq, n_o, n_i)
        Measured minus predicted over the standard deviation of the noise; NaN where nothing was measured.
    open_directions : tuple of OpenDirection
        Combinations of parameters that the FRFs do not determine.
    next_channels : callable
        Returns the channels, not measured yet, that would narrow the widest interval of the joint most, best first; the
        models are reduced again for them.
    joint_motion : FoundMotion
        Returns how the joint moves on each line, and what each line adds to the fit; fits another joint.
    """

    assembly: Assembly
    measured: ComplexArray
    variance: FloatArray
    predicted: ComplexArray
    residual: ComplexArray
    open_directions: tuple[OpenDirection, ...]
    next_channels: Callable[[], tuple[NextChannel, ...]]
    joint_motion: FoundMotion
