"""Which damping terms the data support, for each DOF."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jointfrf.identification.compliance_fit.estimator import FittedGroup, GroupStart, coordinates_of
from jointfrf.identification.compliance_fit.joint_terms import (
    DampingTerms,
    JointTerms,
    joint_terms,
    terms_of,
)
from jointfrf.identification.compliance_fit.line_forms import FormMinimum, minimise_forms

__all__ = ["DofDamping", "choose_damping", "with_terms"]

_KINDS: tuple[DampingTerms, ...] = ("none", "viscous", "hysteretic", "both")


class DofDamping(NamedTuple):
    """Damping terms of one DOF, chosen by the Bayesian information criterion (BIC).

    Attributes
    ----------
    dof : str
    best, second : str
    margin : float
        Difference of their BIC: above 10 the choice is clear, below 2 the data hardly prefer one.
    """

    dof: str
    best: DampingTerms
    second: DampingTerms
    margin: float


def choose_damping(group: FittedGroup, dofs: tuple[str, ...], factor: float) -> list[DofDamping]:
    """Choose the damping terms of each DOF of a group that was fitted with both.

    Parameters
    ----------
    group : FittedGroup
        A joint without cross terms; its quadratic forms are minimised again with fewer terms of one DOF at a time.
    dofs : tuple of str
        Names of the DOFs of the group.
    factor : float
        By how much the variance of parameters exceeds that from independent noise: squares count so much less.

    Notes
    -----
    BIC = 2 squares / factor + p ln(2 equations / factor). A joint supplies no energy: terms of opposite sign that
    nearly cancel each other are noise, so "both" needs two terms that are positive.
    """
    fit, own = group.fit, terms_of(group.joint)
    price = np.log(max(2 * fit.equations / factor, 2.0))
    choices = []
    for d, dof in enumerate(dofs):
        scores: dict[DampingTerms, float] = {}
        for kind in _KINDS:
            kinds: list[DampingTerms] = ["both"] * len(dofs)
            kinds[d] = kind
            terms = joint_terms(own.omega, dofs, kinds, "zero")
            found = _minimum(group, terms)
            damping = found.x[(terms.pairs[:, 0] == d) & (terms.kinds > 0)]
            scores[kind] = 2 * found.cost / factor + len(terms.parameters) * price
            if kind == "both" and (damping <= 0).any():
                scores[kind] = np.inf
        best, second = sorted(scores, key=lambda kind: scores[kind])[:2]
        choices.append(DofDamping(dof, best, second, scores[second] - scores[best]))
    return choices


def with_terms(group: FittedGroup, terms: JointTerms) -> GroupStart:
    """Return where a fit with other terms may begin: at the minimum of the quadratic forms with these."""
    return GroupStart.of(group, _minimum(group, terms))


def _minimum(group: FittedGroup, terms: JointTerms) -> FormMinimum:
    """Minimise the forms of a group with other terms, from the joint found; terms that it has not begin at zero."""
    joint = coordinates_of(terms)
    found = dict(zip(terms_of(group.joint).parameters, group.joint.theta(group.fit.minimum.x).tolist(), strict=True))
    theta = np.array([found.get(one, 0.0) for one in terms.parameters])
    return minimise_forms(group.fit.forms, joint, joint.coordinates(theta))
