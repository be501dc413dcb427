"""How exact the equations are without noise."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from jointfrf.cases.known_joint.exact import Exact
from jointfrf.cases.known_joint.methods import joint_lines, measured
from jointfrf.errors import IllConditionedWarning
from jointfrf.kernel.arguments import ComplexArray
from jointfrf.substructuring.methods import STIFFNESS_METHODS

__all__ = ["NoiseFree", "noise_free_errors"]


class NoiseFree(NamedTuple):
    """Largest relative error of K* without noise, and how much K* changes when the last bits of the FRFs do."""

    error: float
    rounding: float


def noise_free_errors(exact: Exact, k_actual: ComplexArray) -> dict[str, NoiseFree]:
    """Find the largest relative error of K* of every method without noise.

    "short form" is the difference between (2.47) and -(gamma^-1)_jk; the others are errors against the actual K*.
    """
    with warnings.catch_warnings():
        # What a poor condition does is what is shown.
        warnings.simplefilter("ignore", IllConditionedWarning)
        found, changed = _all_methods(exact), _all_methods(_rounded(exact))
    size = np.sqrt(abs(np.diagonal(k_actual, axis1=1, axis2=2)))
    scale = size[:, :, None] * size[:, None, :]

    def difference(a: ComplexArray, b: ComplexArray) -> float:
        return float((abs(a - b) / scale).max())

    rounding = {method: difference(k, changed[method]) for method, k in found.items()}
    errors = {method: NoiseFree(difference(k, k_actual), rounding[method]) for method, k in found.items()}
    short = NoiseFree(difference(found["ismm"], found["inverse-substructuring"]), rounding["ismm"])
    return {"short form": short, **errors}


def _rounded(exact: Exact) -> Exact:
    """Change every FRF by a rounding, up or down, always the same."""
    rng = np.random.default_rng(1)
    h_a, h_b, h_initial, h_c = (
        h * (1 + np.finfo(float).eps * rng.choice((-1.0, 1.0), h.shape))
        for h in (exact.h_a, exact.h_b, exact.h_initial, exact.h_c)
    )
    return replace(exact, h_a=h_a, h_b=h_b, h_initial=h_initial, h_c=h_c)


def _all_methods(exact: Exact) -> dict[str, ComplexArray]:
    """K* on every line by every method."""
    return {method: joint_lines(exact, method, measured(exact, method)[None])[0] for method in STIFFNESS_METHODS}
