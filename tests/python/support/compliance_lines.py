"""A fit without FRFs: every line shows the compliance of a joint, with white noise of a known standard deviation."""

from types import SimpleNamespace

import numpy as np

from jointfrf.identification.manifold.coordinates import coordinates_of
from jointfrf.identification.manifold.estimate import JointEstimate, assembled
from jointfrf.identification.manifold.group_fit import GroupFit, GroupProblem
from jointfrf.identification.manifold.line_forms import LineForms


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
    found = joint.minimise(forms, joint.coordinates(start))
    # There are no FRFs; their size, below which a compliance is rounding, is taken as zero.
    data = SimpleNamespace(own_size=np.zeros(terms.n), reference=np.zeros(terms.n), springs=None)
    problem = GroupProblem(np.arange(terms.n), np.arange(len(terms.parameters)), data, joint, None)
    return GroupFit.of(
        found,
        problem=problem,
        used=np.ones(len(measured), bool),
        equations=float(measured.size),
        possible=float(measured.size),
        iterations=1,
        converged=True,
    )


def fitted(terms, measured, std, start) -> JointEstimate:
    """Return the same as an estimate of one group."""
    return assembled(terms.parameters, [fitted_group(terms, measured, std, start)])
