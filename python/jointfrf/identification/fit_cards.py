"""The joint found as input of a finite-element program, with what each number is worth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Unpack

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.io.cards import CardFormat, CardOptions
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray

if TYPE_CHECKING:
    from jointfrf.identification.joint_fit import JointFit

__all__ = ["fit_cards"]

#: Rounding of an eigenvalue of a matrix with a unit diagonal.
_ROUNDING = 1e-9


def fit_cards(
    fit: JointFit,
    program: CardFormat,
    nodes: Sequence[int],
    about: Sequence[str],
    *,
    all_damping: bool,
    **options: Unpack[CardOptions],
) -> str:
    """Write a fit as input of a finite-element program; `JointFit.export` describes arguments and errors."""
    intervals = fit.confidence_interval(0.95)
    dropped = set() if all_damping else _worthless(fit, intervals)
    _check_finite(fit)
    comments = [
        *about,
        f"method {fit.method}, {fit.freq_hz.min():g} to {fit.freq_hz.max():g} Hz, {fit.freq_hz.size} lines; value, "
        "95 % interval, unit:",
        *(_worth(fit, term, intervals[term.name], term in dropped) for term in fit.terms),
        *(f"warning: {warning}" for warning in fit.warnings),
    ]
    joint = _without(fit, dropped)
    if options.get("damping", True):
        comments += _active(joint)
    options["comments"] = [*options.get("comments", ()), *comments]
    return joint.export(program, nodes, **options)


def _worthless(fit: JointFit, intervals: dict[str, tuple[float, float]]) -> set[Parameter]:
    """Return the damping of DOFs that is not significantly above zero, with the cross terms of these DOFs."""
    bad = {
        term
        for term in fit.terms
        if term.kind != "k"
        and not term.is_cross
        and not (intervals[term.name][0] > 0 and fit.parameters[term.name] > 0)
    }
    lost = {(term.kind, term.row) for term in bad}
    return {term for term in fit.terms if {(term.kind, term.row), (term.kind, term.column)} & lost}


def _check_finite(fit: JointFit) -> None:
    for name, value in fit.parameters.items():
        if not np.isfinite(value):
            raise ValueError(
                f"{name} cannot be distinguished from a rigid connection and has no value: connect this DOF rigidly, "
                "and fit the others without it"
            )


def _worth(fit: JointFit, term: Parameter, interval: tuple[float, float], is_dropped: bool) -> str:
    """Say in one line what a parameter is worth."""
    low, high = interval
    text = f"{term.name} = {fit.parameters[term.name]:.5g}, {low:.4g} .. {high:.4g} {term.unit}"
    if term.kind == "k" and not term.is_cross and not np.isfinite(high):
        text += ": only the lower end is known, a rigid connection fits the data as well"
    elif is_dropped and term.is_cross:
        text += ": left out with the damping of its DOFs"
    elif is_dropped:
        negative = fit.parameters[term.name] < 0
        text += f": {'negative' if negative else 'not significantly above zero'}, left out"
    elif not low > 0 and not (term.is_cross or low < high < 0):
        text += ": not significantly different from zero"
    return text


def _without(fit: JointFit, dropped: set[Parameter]) -> Joint:
    """Return the joint without some parameters."""
    matrices: dict[str, FloatArray] = {kind: np.zeros((len(fit.dofs),) * 2) for kind in "khc"}
    for term in fit.terms:
        if term not in dropped:
            a, b = fit.dofs.index(term.row), fit.dofs.index(term.column)
            matrices[term.kind][a, b] = matrices[term.kind][b, a] = fit.parameters[term.name]
    return Joint(matrices["k"], matrices["c"], fit.dofs, structural_damping=matrices["h"])


def _active(joint: Joint) -> list[str]:
    """Warn of damping that puts power into the model in some motion."""
    told = []
    for what, matrix in (("viscous", joint.damping), ("hysteretic", joint.structural_damping)):
        root = np.sqrt(abs(matrix.diagonal()))
        scale = np.where(root > 0, root, 1)
        if np.linalg.eigvalsh(matrix / np.outer(scale, scale)).min(initial=0) < -_ROUNDING:
            told.append(f"warning: the {what} damping puts power into the model in some motion")
    return told
