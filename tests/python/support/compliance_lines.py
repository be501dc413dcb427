"""A fit without FRFs: every line shows the compliance of a joint, with white noise of a known standard deviation."""

from types import SimpleNamespace

import numpy as np

from jointfrf.identification.manifold.estimate import FittedGroup, JointEstimate, assembled, coordinates_of
from jointfrf.identification.manifold.group_fit import GroupFit
from jointfrf.identification.manifold.line_forms import LineForms, minimise_forms


def white(shape, seed):
    """Circular noise with E|e|^2 = 1."""
    rng = np.random.default_rng(seed)
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def exact_compliance(terms, theta):
    """Entries of the compliance that a fit uses, shape (n_freq, q)."""
    joint = coordinates_of(terms)
    return joint.compliance(joint.coordinates(theta))


def fitted_group(terms, measured, std, start):
    """Fit of measured entries of the compliance, shape (n_freq, q), of a known standard deviation of that shape."""
    joint = coordinates_of(terms)
    weight = 1 / np.broadcast_to(std, measured.shape) ** 2
    about = np.zeros_like(measured)
    forms = LineForms(
        about, weight[:, :, None] * np.eye(measured.shape[1]), weight * measured, (weight * abs(measured) ** 2).sum(1)
    )
    found = minimise_forms(forms, joint, joint.coordinates(start))
    trusted = np.ones(len(measured), bool)
    fit = GroupFit(found, forms, trusted, float(measured.size), float(measured.size), 1, True)
    # There are no FRFs; their size, below which a compliance is rounding, is taken as zero.
    problem = SimpleNamespace(data=SimpleNamespace(own_size=np.zeros(terms.n)))
    return FittedGroup(np.arange(terms.n), np.arange(len(terms.parameters)), joint, problem, fit)


def fitted(terms, measured, std, start) -> JointEstimate:
    """Return the same as an estimate of one group."""
    return assembled(terms, [fitted_group(terms, measured, std, start)])
