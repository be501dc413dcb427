"""Initial values of a joint from its compliance on single lines."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np

from jointfrf.errors import IllConditionedWarning
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert
from jointfrf.laws.law import JointLaw
from jointfrf.laws.law_joint import LawJoint
from jointfrf.substructuring.compliance import joint_compliance

__all__ = ["LineCompliance", "from_lines", "interface_compliance"]

#: Number of linearisations of a stiffness in its compliance, and its largest ratio to the previous value.
_COMPLIANCE_STEPS, _LARGEST_RATIO = 4, 1.5


def interface_compliance(smooth: ComplexArray, variance: FloatArray, at: tuple[list[int], list[int]]) -> LineCompliance:
    """Return the compliance of the joint from FRFs between all joint DOFs, which needs no model.

    Parameters
    ----------
    smooth, variance : ndarray, shape (n_freq, n_o, n_i)
        Smooth FRFs, m/N, and noise variance E|e|^2 of the measured ones, (m/N)^2.
    at : pair of list of int
        Channels of the joint DOFs j, then k, among responses and forces.
    """
    rows, columns = at
    n = len(rows) // 2
    gamma = smooth[:, rows][:, :, columns]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IllConditionedWarning)
        c = joint_compliance(gamma, on_singular="nan")
    # The noise of C is roughly the noise of gamma_kk + gamma_jj and of its transmission.
    level = np.median(variance[:, rows][:, :, columns] / np.maximum(abs(gamma) ** 2, 1e-300))
    size = abs(np.einsum("lpp->lp", gamma))
    return LineCompliance(c, level * (size[:, :n] + size[:, n:]) ** 2)


def from_lines(joint: LawJoint, omega: FloatArray, lines: LineCompliance) -> FloatArray | None:
    """Return initial values of the parameters of the joint from its compliance on each line.

    Parameters
    ----------
    joint : LawJoint
        Joint of the fit.
    omega : ndarray, shape (n_freq,)
        Angular frequencies, rad/s.
    lines : LineCompliance
        Compliance on each line.

    Returns
    -------
    ndarray, shape (p,), or None
        Values of the parameters of the joint, None if the lines do not determine them.
    """
    values, laws = [], dict(joint.laws)
    coupled = {dof for pair in joint.laws if pair[0] != pair[1] for dof in pair}
    known = np.asarray(np.isfinite(lines.c).all(axis=(1, 2)))
    moving = [i for i, dof in enumerate(joint.dofs) if dof not in joint.rigid]
    c = np.where(known[:, None, None], lines.c, np.eye(len(joint.dofs)))[:, moving][:, :, moving]
    with np.errstate(all="ignore"):
        k = invert(c, on_singular="nan")
    for pair, law in joint.laws.items():
        a, b = (moving.index(joint.dofs.index(dof)) for dof in pair)
        of_a, of_b = (np.where(known, lines.variance[:, moving[i]], np.nan) for i in (a, b))
        with np.errstate(all="ignore"):
            if a == b and pair[0] not in coupled:
                found = _of_compliance(law, omega, c[:, a, a], of_a)
            else:
                found = _started(law, omega, k[:, a, b], abs(k[:, a, a] * k[:, b, b]) ** 2 * np.sqrt(of_a * of_b))
        if found is None:
            return None
        laws[pair] = found
    for law in laws.values():
        values += law.values.tolist()
    return np.array([*values, *joint.mass.values()])


def _started(law: JointLaw, omega: FloatArray, k: ComplexArray, variance: FloatArray) -> JointLaw | None:
    """Return a law near to K* of the lines; None if these do not determine one."""
    usable = np.isfinite(variance) & (variance > 0) & np.isfinite(k)
    if not usable.any():
        return None
    weight = np.where(usable, 1 / np.where(usable, variance, 1), 0)
    # On a line where noise exceeds the joint, the stiffness is meaningless.
    weight = np.minimum(weight, 20 * np.median(weight[usable]))
    return law.started(omega, np.where(usable, k, np.nan), np.maximum(weight, 1e-300))


def _of_compliance(law: JointLaw, omega: FloatArray, c: ComplexArray, variance: FloatArray) -> JointLaw | None:
    """Return a law with a compliance near to the lines, on which noise is additive; K* would be biased."""
    found = _started(law, omega, 1 / c, variance / abs(c) ** 4)
    for _ in range(_COMPLIANCE_STEPS):
        if found is None:
            return None
        # K* of c, linearised at the current K*, between half and twice of it.
        k = found.stiffness(omega)
        ratio = c * k
        ratio = ratio * np.minimum(1, _LARGEST_RATIO / np.maximum(abs(ratio), 1e-300))
        found = _started(found, omega, k * (2 - ratio), variance * abs(k) ** 4)
    return found


class LineCompliance(NamedTuple):
    """Compliance of the joint on each line alone.

    Attributes
    ----------
    c : ndarray, shape (n_freq, n, n)
        Compliance K*^-1, m/N; NaN on lines that do not determine it.
    variance : ndarray, shape (n_freq, n)
        Noise variance of the diagonal of `c`, up to a common factor.
    """

    c: ComplexArray
    variance: FloatArray
