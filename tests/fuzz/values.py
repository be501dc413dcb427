"""Random values: what a caller may hand over by mistake, beside or in place of a sound argument."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, get_args

import numpy as np
from scipy import sparse

__all__ = ["choices_of", "odd_value", "spoiled"]

_WORDS = ["", "x", "y", "theta", "rr", "jk", "auto", "dense", "nan", "1:x", "ü", "a\nb", "complex", "entry", "\0"]
_NUMBERS = [0, 1, -1, 2, 3, 7, 0.5, -1.5, math.nan, math.inf, -math.inf, 1e300, 1e-300, 5e-324, 2**31, -(2**63), 2**70]
#: Parameters that say how much work there is: larger numbers are asked for on purpose, and take their time.
_WORK = frozenset({
    "count", "n_elements", "divisions", "max_poles", "max_iterations", "across", "layers", "rings", "circles", "head",
    "nut", "along", "first", "realisation", "preset", "tolerance",
})  # fmt: skip


def odd_value(random: np.random.Generator) -> Any:
    """Make something that has nothing to do with the parameter."""
    choice = int(random.integers(16))
    if choice == 0:
        return None
    if choice == 1:
        return _WORDS[random.integers(len(_WORDS))]
    if choice == 2:
        return _NUMBERS[random.integers(len(_NUMBERS))]
    if choice == 3:
        return {}
    if choice == 4:
        return [1.0, 2.0, 3.0]
    if choice == 5:
        return [(1, 2)]
    if choice == 6:
        return object()
    if choice == 7:
        return random.integers(-1, 4, random.integers(0, 4)).tolist()
    if choice == 8:
        return [_WORDS[i] for i in random.integers(len(_WORDS), size=random.integers(0, 3))]
    if choice == 9:
        return bool(random.integers(2))
    if choice == 10:
        return sparse.random_array((3, 3), density=0.5, rng=random)
    if choice == 11:
        return {"x": (1.0, 2.0), 3: None}
    if choice == 12:
        return b"bytes"
    if choice == 13:
        return Path("/nowhere/at/all")
    if choice == 14:
        return print
    return _array(random)


def _array(random: np.random.Generator) -> Any:
    shape = tuple(random.integers(0, 5, random.integers(0, 5)))
    values = random.standard_normal(shape) * 10.0 ** random.choice([0, 0, 0, -300, 300])
    return _changed(values + 1j * random.standard_normal(shape) if random.random() < 0.5 else values, random)


def spoiled(name: str, value: Any, choices: tuple[str, ...], random: np.random.Generator) -> Any:
    """Make something near a sound argument.

    Parameters
    ----------
    name : str
        Of the parameter.
    value
        A sound argument; None where there is none.
    choices : tuple of str
        The words that the parameter takes, where it takes words.
    """
    if choices and random.random() < 0.7:
        return choices[random.integers(len(choices))]
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float) and random.random() < 0.8:
        return _number(name, value, random)
    if isinstance(value, str) and random.random() < 0.8:
        return _WORDS[random.integers(len(_WORDS))] if random.random() < 0.5 else value + value
    if isinstance(value, list | tuple) and value and random.random() < 0.6:
        return _sequence(name, value, random)
    if isinstance(value, dict) and value and random.random() < 0.8:
        key = list(value)[random.integers(len(value))]
        rest = {k: v for k, v in value.items() if k != key}
        return rest if random.random() < 0.5 else {**rest, key: odd_value(random)}
    if isinstance(value, list | tuple | np.ndarray) and random.random() < 0.9:
        try:
            return _changed(np.asarray(value), random)
        except ValueError:
            return odd_value(random)
    if name in _WORK:
        return random.choice([-1, 0, 1, 2])
    return odd_value(random)


def _number(name: str, value: float, random: np.random.Generator) -> Any:
    if name in _WORK:
        return [-1, 0, 1, 2, math.nan, 1.5, None, "3", value][random.integers(9)]
    if random.random() < 0.3:
        return type(value)(value * random.uniform(-2, 2))
    return _NUMBERS[random.integers(len(_NUMBERS))]


def _sequence(name: str, value: Any, random: np.random.Generator) -> Any:
    items = list(value)
    place = int(random.integers(len(items)))
    choice = random.integers(5)
    if choice == 0:
        items.pop(place)
    elif choice == 1:
        items.append(items[place])
    elif choice == 2:
        items[place] = spoiled(name, items[place], (), random) if not isinstance(items[place], list | tuple) else None
    elif choice == 3:
        items.reverse()
    else:
        items[place] = odd_value(random) if name not in _WORK else 1
    return type(value)(items) if type(value) in (list, tuple) else items


def _changed(values: Any, random: np.random.Generator) -> Any:
    """Make an array of another kind, shape, size or order, or with other numbers in it."""
    a = np.array(values)
    choice = int(random.integers(20))
    if choice < 6 and a.size and a.dtype.kind in "fc":
        a.flat[random.integers(a.size)] = random.choice([np.nan, np.inf, 0.0, 1e308, -1e-320, 1e200])
        return a
    with np.errstate(all="ignore"):
        if choice == 6:
            return a * 1e300 if a.dtype.kind in "fc" else a
        if choice == 7:
            return a * 1e-300 if a.dtype.kind in "fc" else a
        if choice == 8:
            return np.zeros_like(a)
        if choice == 9 and a.dtype.kind in "fciu":
            return a.astype(random.choice(["f4", "c8", "c16", ">c16", "f2", "O", "U8", "i4", "?"])) if (
                a.dtype.kind != "c") else a.astype(random.choice(["c8", ">c16", "O", "U8", "G"]))  # fmt: skip
    if choice == 10:
        return a[..., :-1] if a.ndim else a
    if choice == 11:
        return a[1:] if a.ndim else a
    if choice == 12:
        return a[None]
    if choice == 13:
        return a[:0] if a.ndim else a
    if choice == 14:
        return np.asfortranarray(a)
    if choice == 15 and a.dtype.kind in "fc":
        return np.ma.masked_array(a, mask=random.random(a.shape) < 0.2)
    if choice == 16:
        a.flags.writeable = False
        return a
    if choice == 17:
        return a[..., ::-1] if a.ndim else a
    if choice == 18:
        return a.tolist()
    if choice == 19 and a.ndim > 1:
        return np.swapaxes(a, 0, -1)
    return a


def choices_of(annotation: Any) -> tuple[str, ...]:
    """Return the words of a Literal, wherever it stands in an annotation."""
    words = [each for each in get_args(annotation) if isinstance(each, str)]
    for each in get_args(annotation):
        words += choices_of(each)
    return tuple(words)
