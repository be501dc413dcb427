"""`out=` that overlaps its inputs, arrays in files, views of all kinds: the same bits as fresh arrays, or a refusal."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import jointfrf as jf

from .part import BrokenError

__all__ = ["Overlaps"]

_Calls = dict[str, tuple[Callable[..., Any], dict[str, Any], tuple[int, int]]]


class Overlaps:
    """Random memory for what goes in and what comes out."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def run(self, random: np.random.Generator) -> str:
        """Call one function twice: with fresh arrays, and with arrays that lie in files, on each other, or oddly."""
        n_freq = int(random.choice([1, 2, 9, 65, 600]))
        name, (function, inputs, shape) = _pick(_calls(n_freq, random), random)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            expected = function(**inputs)
            moved = {key: self._moved(key, value, random) for key, value in inputs.items()}
            out, is_apart = self._out((n_freq, *shape), moved, random)
            kept = {key: np.array(value) for key, value in moved.items() if isinstance(value, np.ndarray)}
            try:
                found = function(**moved, out=out)
            except (ValueError, TypeError) as error:
                if is_apart:
                    raise BrokenError(f"{name} refuses a sound out: {error}") from None
                if any(not np.array_equal(moved[key], value, equal_nan=True) for key, value in kept.items()):
                    raise BrokenError(f"{name} refuses and has changed its inputs") from None
                return "refused"
        if not is_apart:
            raise BrokenError(f"{name} takes an out that shares memory or does not fit")
        if found is not out:
            raise BrokenError(f"{name} returns another array than out")
        if not np.array_equal(np.asarray(found), expected, equal_nan=True):
            raise BrokenError(f"{name} differs: {n_freq} lines, out {type(out).__name__}")
        if any(not np.array_equal(moved[key], value, equal_nan=True) for key, value in kept.items()):
            raise BrokenError(f"{name} has changed its inputs")
        return "the same bits"

    def _moved(self, name: str, value: Any, random: np.random.Generator) -> Any:
        """Return the same numbers elsewhere: in a file, in another order, read-only, as a view."""
        if not isinstance(value, np.ndarray):
            return value
        kind = int(random.integers(7))
        if kind == 0:
            path = self.folder / f"{name}.bin"
            value.tofile(path)
            return np.memmap(path, value.dtype, "r", shape=value.shape)
        if kind == 1:
            return np.asfortranarray(value)
        if kind == 2:
            return np.repeat(value, 2, axis=0)[::2]
        if kind == 3:
            copied = value.copy()
            copied.flags.writeable = False
            return copied
        if kind == 4:
            return np.ascontiguousarray(value[..., ::-1])[..., ::-1]
        if kind == 5:
            return value.astype(value.dtype.newbyteorder(">"))
        return value.copy()

    def _out(
        self, shape: tuple[int, ...], moved: dict[str, Any], random: np.random.Generator
    ) -> tuple[np.ndarray, bool]:
        """Return an array for the result, and whether it is a sound one."""
        kind = int(random.integers(8))
        arrays = [value for value in moved.values() if isinstance(value, np.ndarray) and value.dtype == complex]
        if kind == 0 and arrays:
            whole = arrays[random.integers(len(arrays))]
            if whole.shape == shape and whole.flags.c_contiguous:
                return whole, False
        if kind == 1:
            # The result half upon an input.
            key = next((key for key, value in moved.items() if isinstance(value, np.ndarray) and value.ndim == 3), "")
            value = moved[key]
            size = int(np.prod(shape))
            both = np.zeros(max(value.size, size) + size // 2 + 1, complex)
            both[: value.size] = value.ravel()
            moved[key] = both[: value.size].reshape(value.shape)
            start = int(random.integers(0, max(1, min(value.size, size // 2 + 1))))
            return both[start : start + size].reshape(shape), False
        if kind == 2:
            return np.zeros(shape, complex, order="F") if min(shape) > 1 else np.zeros(shape, "c8"), False
        if kind == 3:
            return np.zeros((shape[0] + 1, *shape[1:]), complex), False
        if kind == 4:
            return np.memmap(self.folder / "out.bin", complex, "w+", shape=shape), True
        if kind == 5:
            raw = np.zeros(16 * int(np.prod(shape)) + 16, np.uint8)
            return raw[1 : 1 + 16 * int(np.prod(shape))].view(complex).reshape(shape), False  # between two numbers
        return np.full(shape, np.nan + 0j), True


def _calls(n_freq: int, random: np.random.Generator) -> _Calls:
    """Return functions, their inputs and the shape of a line of their results."""
    n = int(random.integers(1, 7))
    m = 2 * n

    def lines(rows: int, columns: int) -> np.ndarray:
        h = random.standard_normal((n_freq, rows, columns)) + 1j * random.standard_normal((n_freq, rows, columns))
        return h + 3 * np.eye(rows, columns)

    return {
        "invert": (jf.invert, {"a": lines(m, m)}, (m, m)),
        "solve": (jf.solve, {"a": lines(m, m), "b": lines(m, n)}, (m, n)),
        "couple": (
            jf.couple,
            {"h_a": lines(m, m), "h_b": lines(n, n), "k_joint": lines(n, n), "dofs_a": list(range(n)),
             "dofs_b": list(range(n))}, (m + n, m + n),
        ),
        "modify": (jf.modify, {"alpha": lines(m, m), "d": lines(n, n), "dofs": list(range(n))}, (m, m)),
        "find_modification": (jf.find_modification, {"alpha": lines(m, m), "gamma": lines(m, m)}, (m, m)),
        "ismm": (jf.ismm, {"alpha": lines(m, m), "gamma": lines(m, m), "k_initial": lines(n, n)}, (n, n)),
        "inverse_substructuring": (jf.inverse_substructuring, {"gamma": lines(m, m)}, (n, n)),
        "joint_compliance": (jf.joint_compliance, {"gamma": lines(m, m)}, (n, n)),
        "transform": (
            jf.transform,
            {"h": lines(m, m), "t_out": random.standard_normal((n, m)), "t_in": random.standard_normal((n + 1, m))},
            (n, n + 1),
        ),
    }  # fmt: skip


def _pick(calls: _Calls, random: np.random.Generator) -> tuple[str, tuple[Callable[..., Any], dict[str, Any], Any]]:
    name = sorted(calls)[random.integers(len(calls))]
    return name, calls[name]
