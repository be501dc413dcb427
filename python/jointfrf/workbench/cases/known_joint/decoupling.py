"""Fit to all FRFs between internal points with known FRFs of the substructures, and its Cramer-Rao bound."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from jointfrf.frf.entry_groups import entry_groups
from jointfrf.identification.minimise import inverse_information
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.model.likelihood import Likelihood
from jointfrf.identification.model.prediction import Prediction, parameter_vector
from jointfrf.identification.model.prepare import Channels
from jointfrf.identification.model.realisations import RealisationFits
from jointfrf.identification.model.substructure import Substructure
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.springs import SpringLaw
from jointfrf.workbench.cases.known_joint.exact import Exact, measured
from jointfrf.workbench.cases.known_joint.keys import KnownJointCase

__all__ = ["decoupling_bound", "decoupling_bounds", "decoupling_fits", "fit_decoupling"]


def decoupling_fits(
    freq_hz: FloatArray,
    dofs: tuple[str, ...],
    substructures: tuple[ComplexArray, ComplexArray],
    k_initial: ComplexArray,
    first: Iterable[ComplexArray],
) -> RealisationFits:
    """Return fits of stiffness and viscous damping to FRFs between internal points.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequency lines, Hz.
    dofs : tuple of str
        Names of the n joint DOFs.
    substructures : pair of ndarray, shape (n_freq, 2 n, 2 n)
        Receptances of A at j, then r, and of B at k, then s, m/N.
    k_initial : ndarray, shape (n_freq, n, n)
        First estimate of K*, N/m.
    first : iterable of ndarray, shape (n_freq, 2 n, 2 n)
        Sets of receptances of the assembly at r, then s, m/N. They are fitted one after another until a fit
        succeeds; its parameters are the initial values of all later fits.

    Returns
    -------
    RealisationFits

    See Also
    --------
    fit_decoupling : Parameters from several sets of receptances.
    decoupling_bound : Cramer-Rao bound of the fit.

    Notes
    -----
    Each of the equations (2.53)-(2.56) uses one block of the receptances. The maximum-likelihood fit uses all four.
    """
    whole, channels = _decoupled(freq_hz, dofs, substructures, k_initial)
    return RealisationFits(freq_hz, whole, channels, first)


def fit_decoupling(fits: RealisationFits, measured: Iterable[ComplexArray]) -> FloatArray:
    """Return the parameters of several sets of receptances.

    Parameters
    ----------
    fits : RealisationFits
        Fits of `decoupling_fits`.
    measured : iterable of ndarray, shape (n_freq, 2 n, 2 n)
        Sets of receptances of the assembly at r, then s, m/N.

    Returns
    -------
    ndarray, shape (r, 2 n)
        Stiffness of all DOFs, then damping, one row for each set.

    See Also
    --------
    decoupling_fits : Fits with the initial values.
    """
    found = [fits.joint(h).constant_joint() for h in measured]
    return np.array([[*joint.stiffness.diagonal(), *joint.damping.diagonal()] for joint in found])


def _decoupled(
    freq_hz: FloatArray, dofs: tuple[str, ...], substructures: tuple[ComplexArray, ComplexArray], k_joint: ComplexArray
) -> tuple[Assembly, Channels]:
    """Return the assembly of measured substructures and a joint close to K*, and the channels at r, then s."""
    joint, inner = [f"joint {dof}" for dof in dofs], [f"inner {dof}" for dof in dofs]
    a, b = (Substructure.of_frfs(freq_hz, h, [*joint, *inner], joint, noise=0.0) for h in substructures)
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
    """Return the Cramer-Rao bound of `decoupling_fits`: relative standard deviations, shape (2 n,).

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequency lines, Hz.
    dofs : tuple of str
        Names of the n joint DOFs.
    substructures : pair of ndarray, shape (n_freq, 2 n, 2 n)
        Receptances of A at j, then r, and of B at k, then s, m/N.
    k_joint : ndarray, shape (n_freq, n, n)
        Actual K* of springs and dashpots, N/m.
    variance : ndarray, shape (n_freq, 2 n, 2 n)
        Variance E|e|^2 of circular noise that is independent between the FRFs, (m/N)^2; 0 for FRFs that are zero.

    Returns
    -------
    ndarray, shape (2 n,)
        Relative standard deviations of the stiffness of all DOFs, then of the damping.

    See Also
    --------
    decoupling_bounds : Bounds of all noises of a case.
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


def decoupling_bounds(case: KnownJointCase, exact: Exact) -> dict[str, FloatArray]:
    """Return the Cramer-Rao bound of the decoupling fit for each noise of a case.

    The bound assumes independent noise of the FRFs, so noise that is equal within blocks or reciprocal is left out.
    FRFs that are zero by symmetry contain no information.

    Parameters
    ----------
    case : KnownJointCase
        Case with its noises.
    exact : Exact
        FRFs without noise.

    Returns
    -------
    dict of str to ndarray, shape (2 n,)
        Relative standard deviations of all parameters by the name of the noise.

    See Also
    --------
    decoupling_bound : Bound for given variances.
    """
    h = measured(exact, "decoupling-fit")
    shown = np.zeros(h.shape[1:], bool)
    for group in entry_groups(h, reciprocal=False):
        shown[group.rows, group.columns] = True
    k_joint = case.joint.dynamic_stiffness(case.freq_hz)
    return {
        noise.name: decoupling_bound(
            exact.freq_hz, exact.dofs, (exact.h_a, exact.h_b), k_joint, np.where(shown, noise.variance(h), 0)
        )
        for noise in case.noises
        if "decoupling-fit" in noise.methods and noise.block == 1 and not noise.reciprocal
    }  # fmt: skip
