"""Methods of identification as cases call them: their names, and the fit in the compliance domain."""

from __future__ import annotations

import warnings

import numpy as np

from jointfrf.errors import ConvergenceWarning, FrfCheckWarning, IdentificationWarning, IllConditionedWarning
from jointfrf.identification.identify import identify
from jointfrf.identification.minimise import inverse_information
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.model.likelihood import Likelihood
from jointfrf.identification.model.prediction import Prediction, parameter_vector
from jointfrf.identification.model.prepare import Channels
from jointfrf.identification.model.realisations import joints_of_realisations
from jointfrf.identification.model.substructure import Substructure
from jointfrf.identification.realisations import viscous_joints
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.springs import SpringLaw
from jointfrf.substructuring.methods import STIFFNESS_METHODS

__all__ = ["FITTED", "METHODS", "decoupling_bound", "fit_decoupling", "fit_measured", "fit_viscous"]

METHODS: tuple[str, ...] = ("compliance", *STIFFNESS_METHODS, "decoupling-fit")
#: Methods that take all lines, not means over bands.
FITTED = ("compliance", "decoupling-fit")
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
    return viscous_joints(freq_hz, gammas, dofs)


def fit_decoupling(
    freq_hz: FloatArray,
    dofs: tuple[str, ...],
    substructures: tuple[ComplexArray, ComplexArray],
    k_initial: ComplexArray,
    measured: ComplexArray,
) -> FloatArray:
    """Fit stiffness and viscous damping to all FRFs between internal points, given those of the substructures.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    dofs : tuple of str
        Names of the n joint DOFs.
    substructures : pair of ndarray, shape (n_freq, 2 n, 2 n)
        Receptances of A at j, then r, and of B at k, then s, m/N.
    k_initial : ndarray, shape (n_freq, n, n)
        First estimate of K*, N/m.
    measured : ndarray, shape (r, n_freq, 2 n, 2 n)
        Several sets of receptances of the assembly at r, then s, m/N.

    Returns
    -------
    ndarray, shape (r, 2 n)
        Stiffness of all DOFs, then damping.

    Notes
    -----
    What (2.53)-(2.56) take one block each is one maximum-likelihood fit of all four. The first set is fitted with
    nothing told, the others start there.
    """
    whole, channels = _decoupled(freq_hz, dofs, substructures, k_initial)
    found = [one.constant_joint() for one in joints_of_realisations(freq_hz, measured, whole, channels)]
    return np.array([[*joint.stiffness.diagonal(), *joint.damping.diagonal()] for joint in found])


def _decoupled(
    freq_hz: FloatArray, dofs: tuple[str, ...], substructures: tuple[ComplexArray, ComplexArray], k_joint: ComplexArray
) -> tuple[Assembly, Channels]:
    """Return substructures by their FRFs, with springs and dashpots near to K*, and the channels at r, then s."""
    joint, inner = [f"joint {dof}" for dof in dofs], [f"inner {dof}" for dof in dofs]
    a, b = (Substructure.of_frfs(freq_hz, h, [*joint, *inner], joint) for h in substructures)
    diagonal = np.einsum("laa->la", k_joint)
    k, c = np.median(diagonal.real, axis=0), np.median(diagonal.imag / (2 * np.pi * freq_hz)[:, None], axis=0)
    names = (*(f"A/{name}" for name in inner), *(f"B/{name}" for name in inner))
    laws = {dof: SpringLaw(k[i], c=c[i], damping="viscous") for i, dof in enumerate(dofs)}
    return Assembly(a, b, LawJoint(laws)), Channels(names, names)


def decoupling_bound(
    freq_hz: FloatArray,
    dofs: tuple[str, ...],
    substructures: tuple[ComplexArray, ComplexArray],
    k_joint: ComplexArray,
    variance: FloatArray,
) -> FloatArray:
    """Return the Cramer-Rao bound of `fit_decoupling`: relative standard deviations, shape (2 n,).

    Parameters
    ----------
    freq_hz, dofs, substructures
        As of `fit_decoupling`.
    k_joint : ndarray, shape (n_freq, n, n)
        The actual K* of springs and dashpots, N/m.
    variance : ndarray, shape (n_freq, 2 n, 2 n)
        E|e|^2 of circular noise, (m/N)^2, independent between the FRFs; 0 for FRFs that are zero.
    """
    whole, channels = _decoupled(freq_hz, dofs, substructures, k_joint)
    prediction = Prediction(whole, freq_hz, channels.responses, channels.forces)
    vector = parameter_vector(whole, ({}, {}), (), prediction.joint_stiffness())
    exact = prediction.frfs(vector, vector.values)
    at_truth = Likelihood.of_variance(prediction, vector, exact, variance, 1.0)
    x = vector.to_coordinates(vector.values)
    covariance = inverse_information(at_truth.linearised(x).information)
    relative = np.sqrt(np.diagonal(covariance)) * vector.slope(x) / abs(vector.values)
    return np.concatenate([relative[::2], relative[1::2]])


def fit_measured(freq_hz: FloatArray, dofs: tuple[str, ...], h: ComplexArray, transform: FloatArray) -> Fit:
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
    Fit
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
