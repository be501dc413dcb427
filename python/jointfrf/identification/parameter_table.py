"""Parameters of a fit as lines of text, and what is told of those that the data hardly hold."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from typing import Protocol

from jointfrf.kernel.arguments import FloatArray, one_line

__all__ = [
    "ListedParameter",
    "ShownParameter",
    "columns_of",
    "correlation_notes",
    "parameter_warnings",
    "unit_of",
    "wrapped",
]

#: Columns of a printed fit.
_WIDTH = 80
#: Correlations beyond this are told.
_CORRELATED = 0.95
#: A parameter is called poorly determined when its interval is wider than this share of it.
_UNCERTAIN = 0.5
#: One whose standard error is below this share is not.
_WELL = 0.1
#: Pairs shown.
_SHOWN = 4


class ListedParameter(Protocol):
    """A parameter as tables show it."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def unit(self) -> str:
        """Its unit."""


class ShownParameter(ListedParameter, Protocol):
    """A parameter of a joint that was fitted."""

    @property
    def is_log(self) -> bool:
        """Whether it was sought as its logarithm."""


def unit_of(name: str, listed: Sequence[ListedParameter]) -> str:
    """Return the unit of the parameter of this name; ValueError where there is none."""
    for one in listed:
        if one.name == name:
            return one.unit
    raise ValueError(f"there is no parameter {one_line(name)}, only {', '.join(one.name for one in listed)}")


def wrapped(text: str) -> str:
    """Return a note in lines of a printed fit."""
    return textwrap.fill(text, _WIDTH, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)


def columns_of(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return rows in columns, the first one above a rule."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows]
    lines.insert(1, "-" * max(map(len, lines)))
    return lines


def parameter_warnings(
    shown: Sequence[tuple[ShownParameter, float, float]], limits: Callable[[str], tuple[float, float]]
) -> list[str]:
    """Name parameters of a joint that the data determine poorly or not at all.

    Parameters
    ----------
    shown : sequence of (parameter, value, standard error)
    limits : callable
        Returns the 95 % interval of a parameter by its name.
    """
    told = []
    for one, value, error in shown:
        if not one.is_log or one.unit == "s" or error < _WELL * value:
            continue
        low, high = limits(one.name)
        if not high < float("inf") and low > 0:
            told.append(f"{one.name}: cannot be distinguished from rigid; at least {low:.3g} {one.unit} (95 %)")
        elif not low > 0:
            told.append(f"{one.name}: cannot be distinguished from zero; at most {high:.3g} {one.unit} (95 %)")
        elif high - low > 2 * _UNCERTAIN * abs(value):
            told.append(f"{one.name}: poorly determined by the data, 95 % interval {low:.3g} .. {high:.3g} {one.unit}")
    return told


def correlation_notes(names: Sequence[str], rho: FloatArray) -> list[str]:
    """Name pairs of parameters that the data hardly part."""
    pairs = [
        (abs(rho[i, j]), f"{names[i]} and {names[j]} ({rho[i, j]:+.3f})")
        for i in range(len(names))
        for j in range(i + 1, len(names))
        if abs(rho[i, j]) > _CORRELATED
    ]
    return (
        [f"correlated errors: {', '.join(text for _, text in sorted(pairs, reverse=True)[:_SHOWN])}"] if pairs else []
    )
