"""The lowest minimum of the squares of a joint without cross terms, where damping is not determined."""

from __future__ import annotations

import numpy as np

from jointfrf.identification.compliance_fit.joint_terms import DiagonalJoint, JointCoordinates, terms_of
from jointfrf.identification.compliance_fit.line_forms import LEAST_GAIN, FormMinimum, LineForms, minimise_forms
from jointfrf.kernel.arguments import FloatArray

__all__ = ["lowest_minimum", "within_reach"]

#: Share of the largest rate beyond which a DOF is all damping.
_ALL_DAMPING = 0.1
#: Other starts are followed until a step gains less than this of the squares of one residual.
_COARSE = 1e-2


def within_reach(joint: JointCoordinates) -> FloatArray:
    """Return rates at which damping is as large as stiffness on the highest line, one for each damping parameter."""
    terms = terms_of(joint)
    fastest = max(float(terms.omega.max()), np.finfo(float).tiny)
    reach: FloatArray = np.where(terms.kinds[terms.n :] == 1, 1.0, 1 / fastest)
    return reach


def lowest_minimum(
    forms: LineForms,
    joint: JointCoordinates,
    start: FloatArray,
    held: int | None = None,
    least_gain: float = LEAST_GAIN,
) -> FormMinimum:
    """Minimise; where a DOF ends rigid or all damping, also from no damping and from some.

    Parameters
    ----------
    forms, joint, start, held, least_gain
        As in `minimise_forms`.

    Notes
    -----
    A compliance and its rate are a vector in polar coordinates: at a = 0 nothing moves the rate any more, not even from
    the wrong sign of damping.
    """
    found = minimise_forms(forms, joint, start, held, least_gain)
    if not isinstance(joint, DiagonalJoint) or joint.rates.size == 0:
        return found
    n = joint.terms.n
    of_rate = joint.dofs[joint.rates]
    rate = abs(found.x[joint.rates]) * (1.0 if joint.by_rate else found.x[of_rate])
    reach = within_reach(joint)
    caught = found.x[:n] <= 0
    np.logical_or.at(caught, of_rate, rate > _ALL_DAMPING * joint.largest_rate)
    if not caught.any():
        return found
    size = abs(forms.compliance).mean(axis=0)
    for share in (0.0, 1.0):
        x = found.x.copy()
        x[:n] = np.where(caught, size, x[:n])
        if held is not None:
            x[held] = start[held]
        other = share * reach / (1.0 if joint.by_rate else np.maximum(x[of_rate], np.finfo(float).tiny))
        moved = caught[of_rate] & (joint.rates != held)
        x[joint.rates] = np.where(moved, other, x[joint.rates])
        there = minimise_forms(forms, joint, x, held, max(least_gain, _COARSE))
        if there.cost < found.cost - _COARSE:
            found = minimise_forms(forms, joint, there.x, held, least_gain)
    return found
