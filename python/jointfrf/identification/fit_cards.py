"""Input of a finite-element program for the identified joint, with the uncertainty of each number."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Unpack

import numpy as np

from jointfrf.identification.result import Fit, FittedParameter, joint_of
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import check_type

if TYPE_CHECKING:
    from jointfrf.io.card_link import CardFormat
    from jointfrf.io.cards import CardOptions

__all__ = ["cards"]

#: Rounding of an eigenvalue of a matrix with a unit diagonal.
_ROUNDING = 1e-9


def cards(
    fit: Fit,
    program: CardFormat,
    nodes: Sequence[int] | Mapping[str, Sequence[int]],
    *,
    about: Sequence[str] = (),
    all_damping: bool = False,
    bounds: bool = False,
    freq_hz: float | None = None,
    **options: Unpack[CardOptions],
) -> str:
    """Return the identified joint as input of a finite-element program, with comments on each uncertainty.

    Parameters
    ----------
    fit : Fit
        Fit of springs and dampers, or of laws.
    program : str
        Name of the program; see `Joint.export`.
    nodes : sequence of int, or mapping of str to these
        Nodes of the joint; see `Joint.export`. For a fit of several joint points, a mapping from each point to its
        nodes, in CalculiX followed by its two rotation nodes. Numbers of elements and properties continue from point
        to point.
    about : sequence of str
        Origin of the fit, written as the first lines of comment; none by default.
    all_damping : bool
        Whether to write damping of springs and dampers that is negative or not significantly above zero (95 %). By
        default it is omitted, together with the cross terms of its DOF.
    bounds : bool
        Whether to write the best estimate of a stiffness that has only a bound. By default this is an error.
    freq_hz : float, optional
        Frequency at which laws are evaluated, Hz; see `LawJoint.export`.
    **options
        Further options of `Joint.export`.

    Returns
    -------
    str
        Lines of input.

    Raises
    ------
    ValueError
        An error of `Joint.export` or `LawJoint.export`; a stiffness is infinite, or has only a bound.

    See Also
    --------
    Joint.export : the same without a fit.
    write_joint : a joint as a TOML file.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> h = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)[:, 1:, 1:]
    >>> gamma = jf.couple(h, h, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [0], [0])
    >>> fit = jf.identify(freq, jf.pollute(gamma, 0.01, seed=1), dofs=["x"])
    >>> "CBUSH" in jf.cards(fit, "nastran", (101, 102))
    True
    """
    check_type("fit", fit, Fit)
    if fit.points or isinstance(nodes, Mapping):
        return "".join(_cards_of_points(fit, program, nodes, about, options, all_damping, bounds, freq_hz))
    intervals = fit.confidence_interval(0.95)
    dropped = _insignificant(fit, intervals) if fit.laws is None and not all_damping else set()
    _check_finite(fit)
    if not bounds:
        _check_known(fit, intervals)
    comments = [
        *about,
        f"method {fit.method}, {fit.freq_hz.min():g} to {fit.freq_hz.max():g} Hz, {fit.freq_hz.size} lines; value, "
        "95 % interval, unit:",
        *(
            _uncertainty(fit, one, intervals[one.name], one in dropped)
            for one in fit.parameters
            if one.origin == "joint"
        ),
        *(f"warning: {warning}" for warning in fit.warnings),
    ]
    if fit.laws is not None:
        options["comments"] = [*options.get("comments", ()), *comments]
        return fit.laws.export(program, nodes, freq_hz=freq_hz, **options)
    if freq_hz is not None:
        raise ValueError("freq_hz is for laws that depend on frequency, and this joint has springs and dampers")
    kept = np.array([0.0 if one in dropped else value for one, value in zip(fit.parameters, fit.estimate, strict=True)])
    joint = joint_of(fit.dofs, fit.parameters, kept)
    if options.get("damping", True):
        comments += _active(joint)
    options["comments"] = [*options.get("comments", ()), *comments]
    return joint.export(program, nodes, **options)


def _cards_of_points(
    fit: Fit,
    program: CardFormat,
    nodes: Sequence[int] | Mapping[str, Sequence[int]],
    about: Sequence[str],
    options: CardOptions,
    all_damping: bool,
    bounds: bool,
    freq_hz: float | None,
) -> Iterator[str]:
    """Yield the cards of each joint point."""
    if not isinstance(nodes, Mapping) or sorted(nodes) != sorted(fit.points):
        raise ValueError(f"nodes must map each joint point, {', '.join(fit.points) or 'here none'}, to its nodes")
    given = [name for name in ("positions", "points", "faces", "rotation_nodes") if options.get(name) is not None]
    if given:
        raise ValueError(f"{given[0]} is of one joint point: write the cards of each, fit.at_point")
    element, number = options.get("element", 1), options.get("number", 1)
    auxiliary = options.get("damping_nodes")
    sets: list[int] = []
    for point in fit.points:
        ends = nodes[point]
        own: CardOptions = {**options, "element": element, "number": number, "rotation_nodes": ends[2:] or None}
        if auxiliary is not None:
            own["damping_nodes"] = auxiliary
        text = cards(
            fit.at_point(point), program, ends[:2], about=[*about, f"joint point {point}"], all_damping=all_damping,
            bounds=bounds, freq_hz=freq_hz, **own,
        )  # fmt: skip
        # Numbers above all elements and properties in these lines.
        element, number = element + len(text.splitlines()), number + len(text.splitlines())
        auxiliary = None if auxiliary is None else auxiliary + len(text.splitlines())
        sets += [own["number"]] if "\nMPC*" in text else []
        yield text
    if len(sets) > 1:  # a run of Nastran takes one set of equations
        fields = [f"{one:8d}" for one in (number, *sets)]
        rows = [fields[:8], *(fields[i : i + 8] for i in range(8, len(fields), 8))]
        yield f"$ all joints together; case control: MPC = {number}\n"
        yield "\n".join(("MPCADD  " if i == 0 else " " * 8) + "".join(row) for i, row in enumerate(rows)) + "\n"


def _insignificant(fit: Fit, intervals: dict[str, tuple[float, float]]) -> set[FittedParameter]:
    """Return the damping of DOFs that is not significantly above zero, with the cross terms of these DOFs."""
    bad = {
        term
        for term in fit.parameters
        if term.kind != "k" and not term.is_cross and not (intervals[term.name][0] > 0 and fit.value[term.name] > 0)
    }
    lost = {(term.kind, term.row) for term in bad}
    return {term for term in fit.parameters if {(term.kind, term.row), (term.kind, term.column)} & lost}


def _check_finite(fit: Fit) -> None:
    for name, value in fit.value.items():
        if not np.isfinite(value):
            raise ValueError(
                f"{name} cannot be distinguished from a rigid connection; connect this DOF rigidly, and fit the joint "
                "without it"
            )


def _check_known(fit: Fit, intervals: dict[str, tuple[float, float]]) -> None:
    """Raise an error if a stiffness has only a bound."""
    names = [
        one.name
        for one in fit.parameters
        if one.origin == "joint" and one.kind == "k" and not one.is_cross and not np.isfinite(intervals[one.name][1])
    ]
    if names:
        raise ValueError(
            f"only a lower bound is known of {', '.join(names)}; connect these DOFs rigidly, or use their best "
            "estimates (bounds)"
        )


def _uncertainty(fit: Fit, term: FittedParameter, interval: tuple[float, float], is_dropped: bool) -> str:
    """Return one line on the uncertainty of a parameter."""
    low, high = interval
    text = f"{term.name} = {fit.value[term.name]:.5g}, {low:.4g} .. {high:.4g} {term.unit}"
    if term.kind == "k" and not term.is_cross and not np.isfinite(high):
        text += ": best estimate, only the lower end is known, a rigid connection fits the data as well"
    elif is_dropped and term.is_cross:
        text += ": left out with the damping of its DOFs"
    elif is_dropped:
        negative = fit.value[term.name] < 0
        text += f": {'negative' if negative else 'not significantly above zero'}, left out"
    elif not low > 0 and not (term.is_cross or low < high < 0):
        text += ": not significantly different from zero"
    return text


def _active(joint: Joint) -> list[str]:
    """Return a warning about damping that puts power into the model in some motion."""
    found = []
    for what, matrix in (("viscous", joint.damping), ("hysteretic", joint.structural_damping)):
        root = np.sqrt(abs(matrix.diagonal()))
        scale = np.where(root > 0, root, 1)
        if np.linalg.eigvalsh(matrix / np.outer(scale, scale)).min(initial=0) < -_ROUNDING:
            found.append(f"warning: the {what} damping puts power into the model in some motion")
    return found
