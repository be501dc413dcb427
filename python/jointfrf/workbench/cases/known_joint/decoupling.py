"""The fit to all FRFs between internal points, given those of the substructures, and its Cramer-Rao bound."""

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
    """Return fits of stiffness and viscous damping to FRFs between internal points, given those of the substructures.

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
    first : iterable of ndarray, shape (n_freq, 2 n, 2 n)
        Sets of receptances of the assembly at r, then s, m/N, fitted without initial values until one fits: there all
        others start.

    Notes
    -----
    What (2.53)-(2.56) take one block each is one maximum-likelihood fit of all four.
    """
    whole, channels = _decoupled(freq_hz, dofs, substructures, k_initial)
    return RealisationFits(freq_hz, whole, channels, first)


def fit_decoupling(fits: RealisationFits, measured: Iterable[ComplexArray]) -> FloatArray:
    """Return stiffness of all DOFs, then damping, of several sets of such receptances, shape (r, 2 n)."""
    found = [fits.joint(h).constant_joint() for h in measured]
    return np.array([[*joint.stiffness.diagonal(), *joint.damping.diagonal()] for joint in found])


def _decoupled(
    freq_hz: FloatArray, dofs: tuple[str, ...], substructures: tuple[ComplexArray, ComplexArray], k_joint: ComplexArray
) -> tuple[Assembly, Channels]:
    """Return substructures by their FRFs, with springs and dashpots near to K*, and the channels at r, then s."""
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
    freq_hz, dofs, substructures
        As of `decoupling_fits`.
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


def decoupling_bounds(case: KnownJointCase, exact: Exact) -> dict[str, FloatArray]:
    """Return relative standard deviations of all parameters, shape (2 n,), by the name of the noise.

    Noise of which FRFs share numbers, in blocks or by reciprocity, has another bound, and is left out. FRFs that are
    zero by symmetry say nothing.
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
