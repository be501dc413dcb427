"""The bound of the decoupling fit of a case: what no unbiased estimate from the same FRFs undercuts."""

from __future__ import annotations

import numpy as np

from jointfrf.cases.fitting import decoupling_bound
from jointfrf.cases.known_joint.exact import Exact
from jointfrf.cases.known_joint.methods import measured
from jointfrf.cases.known_joint.read import KnownJointCase
from jointfrf.frf.entry_groups import entry_groups
from jointfrf.kernel.arguments import FloatArray

__all__ = ["decoupling_bounds"]


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
