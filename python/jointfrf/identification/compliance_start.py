"""Where a fit of a model may start: at the springs that the compliance fit finds."""

from __future__ import annotations

import warnings

import numpy as np

from jointfrf.identification.identify import identify
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.springs import SpringLaw

__all__ = ["compliance_start"]


def compliance_start(
    joint: LawJoint, freq_hz: FloatArray, gamma: ComplexArray, variance: FloatArray
) -> FloatArray | None:
    """Return values of a joint of springs from the compliance fit; None for other joints, or where it finds none.

    Parameters
    ----------
    joint : LawJoint
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    gamma, variance : ndarray, shape (n_freq, 2 n, 2 n)
        FRFs between all joint DOFs j, then k, m/N, and E|e|^2.
    """
    if joint.rigid or not all(isinstance(law, SpringLaw) for law in joint.laws.values()):
        return None
    cross = "fit" if any(a != b for a, b in joint.laws) else "zero"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = identify(freq_hz, gamma, joint.dofs, damping="viscous", cross=cross, noise=variance)  # type: ignore[call-overload]
        except (ValueError, np.linalg.LinAlgError):
            return None
    k, c = found.stiffness_matrix, found.damping_matrix
    values: list[float] = []
    for (a, b), law in joint.laws.items():
        i, j = joint.dofs.index(a), joint.dofs.index(b)
        named = {"k": k[i, j], "c": c[i, j], "h": 0.0}
        if not np.isfinite(named["k"]):
            return None
        values += [max(named[one.name], one.lower) for one in law.fields]
    return np.array([*values, *joint.mass.values()])
