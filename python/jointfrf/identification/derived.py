"""Functions of the parameters of a fit, with their uncertainty."""

from __future__ import annotations

import ast
import contextlib
import math
import operator
import re
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from jointfrf.kernel.arguments import FloatArray, one_line

__all__ = ["Derived", "DerivedFunction", "derived_quantity"]

#: Function that maps values by name to a number.
DerivedFunction = Callable[[Mapping[str, float]], float]

_OPERATORS: Mapping[type[ast.AST], Callable[..., float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.USub: operator.neg, ast.UAdd: operator.pos,
}  # fmt: skip
_FUNCTIONS: Mapping[str, Callable[[float], float]] = {"sqrt": math.sqrt, "exp": math.exp, "log": math.log, "abs": abs}
#: Step of a central difference, in standard errors: its error is of the second order.
_STEP = 1e-3


class Derived(NamedTuple):
    """Function of the parameters with its uncertainty.

    Attributes
    ----------
    value : float
        Value at the estimate.
    std_error : float
        Standard error, to first order.
    low, high : float
        Limits of the interval; inf if the data give no limit.
    """

    value: float
    std_error: float
    low: float
    high: float


def derived_quantity(
    function: str | DerivedFunction,
    names: Sequence[str],
    values: FloatArray,
    covariance: FloatArray,
    intervals: Callable[[float], dict[str, tuple[float, float]]],
    probability: float,
) -> Derived:
    """Return a function of the parameters of a fit with its uncertainty; see `Fit.derived`.

    Parameters
    ----------
    function : callable or str
        Function of the parameters by name, or an arithmetic expression of their names.
    probability : float
        Coverage probability of the interval.
    names : sequence of str, length p
        Names of the parameters.
    values : ndarray, shape (p,)
        Estimates.
    covariance : ndarray, shape (p, p)
        Covariance of the estimates.
    intervals : callable
        Intervals of all parameters at a probability; its method `of_function`, if present, profiles the likelihood.
    """
    of_values = _parsed(function, names) if isinstance(function, str) else function
    if not callable(of_values):
        raise ValueError(f"function must be an arithmetic expression or a callable, not {one_line(function)}")

    def at(values: FloatArray) -> float:
        try:
            return float(of_values(dict(zip(names, values.tolist(), strict=True))))
        except (ZeroDivisionError, OverflowError):
            return math.inf
        except ValueError:  # a root or a logarithm of a negative number
            return math.nan

    value, slope = at(values), _gradient(at, values, np.sqrt(np.maximum(np.diagonal(covariance), 0)))
    used = np.flatnonzero(slope)
    own = slope[used] @ covariance[used[:, None], used] @ slope[used]
    std_error = float(np.sqrt(own)) if own > 0 else (math.nan if math.isnan(own) else 0.0)
    limits = intervals(probability)
    if used.size == 1:
        carried = []
        for limit in limits[names[used[0]]]:
            there = values.copy()
            there[used] = limit
            carried.append(at(there))
        return Derived(value, std_error, min(carried), max(carried))
    profile = getattr(intervals, "of_function", None)
    ends = profile(at, used, probability) if profile is not None and used.size else None
    if ends is not None:
        return Derived(value, std_error, *ends)
    reach = float(ndtri((1 + probability) / 2)) * std_error
    return Derived(value, std_error, value - reach, value + reach)


def _gradient(at: Callable[[FloatArray], float], best: FloatArray, errors: FloatArray) -> FloatArray:
    """Return the derivatives of a function at the estimate; 0 for parameters that do not enter."""
    slope = np.zeros(best.size)
    for i, error in enumerate(errors):
        step = _STEP * error if np.isfinite(error) and error > 0 else 1e-6 * max(abs(best[i]), 1e-300)
        ends = []
        for sign in (-1, 1):
            there = best.copy()
            there[i] += sign * step
            ends.append(at(there))
        slope[i] = (ends[1] - ends[0]) / (2 * step)
    return slope


def _parsed(text: str, names: Sequence[str]) -> DerivedFunction:
    """Return an arithmetic expression of parameters as a function of their values."""
    places: dict[str, str] = {}

    def named(match: re.Match[str]) -> str:
        name = match[1].strip()
        if name not in names:
            raise ValueError(f"unknown parameter {name!r} in {text!r}; use one of {', '.join(names)}")
        places[f"p{len(places)}_"] = name
        return f" p{len(places) - 1}_ "

    plain = re.sub(r"\{([^{}]*)\}", named, text)
    try:
        tree = ast.parse(plain.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"{text!r} is no arithmetic of parameters, such as 'h_y / k_y'") from None
    known = {name: name for name in names} | places
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and node.id not in {*known, *_FUNCTIONS, "pi"}:
            raise ValueError(f"unknown parameter {node.id!r} in {text!r}; use one of {', '.join(names)}")
    with contextlib.suppress(ZeroDivisionError, OverflowError):
        _evaluated(tree, dict.fromkeys(known, math.nan), text)
    return lambda values: _evaluated(tree, {word: values[name] for word, name in known.items()}, text)


def _evaluated(node: ast.AST, values: Mapping[str, float], text: str) -> float:
    """Return the value of an expression made of numbers, names, operators and a few functions; nothing else runs."""
    match node:
        case ast.Constant(value=float() | int() as number) if not isinstance(number, bool):
            return float(number)
        case ast.Name(id=name) if name in values or name == "pi":
            return values.get(name, math.pi)
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_evaluated(operand, values, text))
        case ast.BinOp(op=op, left=left, right=right) if type(op) in _OPERATORS:
            found = _OPERATORS[type(op)](_evaluated(left, values, text), _evaluated(right, values, text))
            if isinstance(found, complex):
                raise ValueError(f"{text!r} takes a root of a negative number")
            return found
        case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in _FUNCTIONS:
            return _FUNCTIONS[name](_evaluated(argument, values, text))
    raise ValueError(f"{text!r} is no arithmetic of parameters, such as 'h_y / k_y'")
