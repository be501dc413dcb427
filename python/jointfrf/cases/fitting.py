"""Methods of identification as cases call them: their names, and the fit in the compliance domain."""

from __future__ import annotations

import warnings
from typing import get_args

import numpy as np

from jointfrf.errors import ConvergenceWarning, FrfCheckWarning, IdentificationWarning, IllConditionedWarning
from jointfrf.identification.identify import IdentificationMethod, identify
from jointfrf.identification.joint_fit import JointFit
from jointfrf.identification.realisations import identify_realisations
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["METHODS", "fit_measured", "fit_viscous"]

METHODS: tuple[str, ...] = get_args(IdentificationMethod)
#: Relative noise for the weights of a fit to data whose noise is not asked for.
_ASSUMED = 0.01
#: Least variance of an FRF as a share of that of its driving points: entries that are zero have no noise of their own.
_ROUNDING = 1e-20


def fit_viscous(freq_hz: FloatArray, dofs: tuple[str, ...], gammas: ComplexArray) -> FloatArray:
    """Fit stiffness and viscous damping without cross terms to each of several sets of FRFs.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    dofs : tuple of str
        Names of the n joint DOFs.
    gammas : ndarray, shape (r, n_freq, 2 n, 2 n)
        Receptances of the assembly at joint DOFs j, then k, m/N.

    Returns
    -------
    ndarray, shape (r, 2 n)
        Stiffness of all DOFs, then damping.
    """
    fits = identify_realisations(freq_hz, gammas, dofs, damping="viscous")
    return np.array([[*fit.stiffness, *fit.damping] for fit in fits])


def fit_measured(freq_hz: FloatArray, dofs: tuple[str, ...], h: ComplexArray, transform: FloatArray) -> JointFit:
    """Fit a joint to FRFs between measured channels; its warnings stand in the result.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    dofs : tuple of str
        Names of the n joint DOFs.
    h : ndarray, shape (n_freq, m, m)
        Receptances between the channels, m/N.
    transform : ndarray, shape (2 n, m)
        From the channels to joint DOFs j, then k.

    Returns
    -------
    JointFit
    """
    gamma = transform @ h @ transform.T
    # Of each FRF between joint DOFs by itself: the covariance of all of many channels takes ten times as long.
    variance = transform**2 @ (_ASSUMED * abs(h)) ** 2 @ (transform**2).T
    largest = np.sqrt(np.diagonal(variance.max(axis=0)))
    variance = np.maximum(variance, _ROUNDING * np.outer(largest, largest))
    with warnings.catch_warnings():
        for category in (IdentificationWarning, IllConditionedWarning, ConvergenceWarning, FrfCheckWarning):
            warnings.simplefilter("ignore", category)
        return identify(freq_hz, gamma, dofs, damping="viscous", cross="ignore", noise=variance)
