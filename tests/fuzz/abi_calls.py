"""Random calls of every routine of the flat interface, as C and Fortran programs make them, each array within guards.

Routines, arguments and shapes are those of api.F90, read as the build reads them. A call must answer with a code;
it must leave guards and inputs alone, fill all lines of a bad one with NaN, and give the same bits when it is made
again.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Callable
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
import scipy_openblas32

from generate.reader import read_api
from generate.routines import Argument, Routine
from generate.source import Source

from .part import BrokenError

__all__ = ["AbiCalls", "kernel_library"]

_ROOT = Path(__file__).resolve().parents[2]
_TYPES = {"integer": np.dtype(np.int32), "real": np.dtype(np.float64), "complex": np.dtype(np.complex128),
          "character": np.dtype("S1")}  # fmt: skip
_GUARD = 8  # numbers before and after each array
_PATTERN = 0x5A
_EDGES = {dtype.itemsize: bytes([_PATTERN]) * (_GUARD * dtype.itemsize) for dtype in _TYPES.values()}
#: An array beyond this is not made; a caller that has no such array makes no such call.
_LARGEST = 20_000
#: Words of letters by argument: all, and what is none of them.
_LETTERS = b"NTntrsjkCcAaUuDdLlGgERE0 \x00\xff"
#: Routines that choose for the whole process, and those of which a text is asked for.
_UNTRIED = frozenset({"jf_set_engine", "jf_version"})
_WORKSPACE = ("work", "iwork")
_FINITE = 0.6


def kernel_library() -> ctypes.CDLL:
    """Load the shared library of the editable installation."""
    ctypes.CDLL(str(next(Path(scipy_openblas32.get_lib_dir()).glob("libscipy_openblas*.so"))), ctypes.RTLD_GLOBAL)
    (path,) = {file.resolve() for file in (_ROOT / "build").glob("cp*/fortran/libjointfrf.so.0*") if file.is_file()}
    return ctypes.CDLL(str(path))


class AbiCalls:
    """Random calls."""

    def __init__(self) -> None:
        self.library = kernel_library()
        api = read_api(Source.read(_ROOT / "fortran" / "api" / "api.F90"),
                       [Source.read(_ROOT / "fortran" / name) for name in ("status.f90", "engine.F90")])  # fmt: skip
        self.routines = [routine for routine in api.routines if routine.name not in _UNTRIED]
        sizes = {size for routine in api.routines for each in routine.arguments for size in each.shape}
        self.shapes = {size: _formula(size) for size in sizes}

    def run(self, random: np.random.Generator) -> str:
        """Call one routine."""
        routine = self.routines[random.integers(len(self.routines))]
        numbers = _scalars(routine, random)
        arrays = {}
        for argument in routine.arguments:
            if argument.declared:
                shape = tuple(self.shapes[size](numbers) for size in argument.shape)
                if argument.name in _WORKSPACE:
                    shape = (max(1, numbers[f"l{argument.name}"]),)
                if prod(max(n, 0) for n in shape) > _LARGEST:
                    return "left out: arrays too large"
                arrays[argument.name] = _array(argument, shape, numbers, random)
        first = self._call(routine, numbers, arrays)
        again = self._call(routine, numbers, arrays)
        if first != again:
            raise BrokenError(f"{routine.name} differs when it is called again: {numbers}")
        info = first[0]
        if info < 0:
            return "refused" if info > -1000 else "a code of its own"
        return "result" if info == 0 else "bad lines"

    def _call(self, routine: Routine, numbers: dict[str, Any], arrays: dict[str, Any]) -> tuple[int, bytes]:
        """Call with copies; return INFO and all that came back."""
        held: list[Any] = []
        guarded: dict[str, np.ndarray] = {}
        for argument in routine.arguments:
            values = arrays.get(argument.name)
            if values is None:
                values = np.array([numbers.get(argument.name, 0)], _TYPES[argument.type])
            array = guarded[argument.name] = _guarded(values)
            held.append(ctypes.c_void_p(array.__array_interface__["data"][0] + _GUARD * array.itemsize))
        before = {each.name: guarded[each.name].tobytes() for each in routine.arguments if each.intent == "in"}
        function = getattr(self.library, routine.name + "_")
        function.restype = None
        function(*held)
        for name, array in guarded.items():
            edge = _EDGES[array.itemsize]
            if array[:_GUARD].tobytes() != edge or array[-_GUARD:].tobytes() != edge:
                raise BrokenError(f"{routine.name} writes beyond {name}: {numbers}")
        for name, content in before.items():
            if guarded[name].tobytes() != content:
                raise BrokenError(f"{routine.name} changes its input {name}: {numbers}")
        answers = any(each.name == "info" and each.intent == "out" for each in routine.arguments)
        info = int(guarded["info"][_GUARD]) if answers else 0
        if info < 0:
            written = [each.name for each in routine.arguments
                       if each.declared and each.intent == "out" and _is_written(guarded[each.name])]  # fmt: skip
            if written and info > -1000:
                raise BrokenError(f"{routine.name} refuses with {info} and writes {written[0]}: {numbers}")
        bad = guarded["line_info"][_GUARD:-_GUARD] if "line_info" in guarded and info >= 0 else np.zeros(0, np.int32)
        if info > 0 and np.count_nonzero(bad) != info and "line_info" in guarded:
            raise BrokenError(f"{routine.name} counts {info} bad lines, line_info {np.count_nonzero(bad)}: {numbers}")
        outputs = [guarded[each.name].tobytes() for each in routine.arguments
                   if each.intent != "in" and each.name not in _WORKSPACE]  # fmt: skip
        return info, b"".join(outputs)


def _is_written(array: np.ndarray) -> bool:
    return bool((array.view(np.uint8) != _PATTERN).any())


def _guarded(values: np.ndarray) -> np.ndarray:
    """Return an array with guards before and after it; an output is all guard."""
    flat = np.empty(values.size + 2 * _GUARD, values.dtype)
    flat.view(np.uint8)[:] = _PATTERN
    if values.flags.writeable:  # outputs are marked by being read-only
        flat[_GUARD : _GUARD + values.size] = values.ravel(order="K")
    return flat


def _formula(text: str) -> Callable[[dict[str, Any]], int]:
    """Return the size that a bound of a declaration states, as Fortran computes it."""
    code = compile(re.sub(r"\b(\d+)_\w+", r"\1", text).replace("/", "//").replace("merge(", "_merge("), text, "eval")
    known = {"max": max, "min": min, "_merge": lambda a, b, c: a if c else b, "__builtins__": {}}

    def size(numbers: dict[str, Any]) -> int:
        return int(eval(code, known, numbers))

    return size


def _scalars(routine: Routine, random: np.random.Generator) -> dict[str, Any]:
    """Return numbers and letters for the arguments that are no arrays; most are such as fit each other."""
    n = int(random.integers(1, 6))
    is_wild = random.random() < 0.25
    found: dict[str, Any] = {}
    for argument in routine.arguments:
        if argument.declared or argument.intent == "out":
            continue
        if argument.type == "character":
            named = "".join(re.findall(r"'(\w)'", argument.text)).encode()
            known = named if named and random.random() < 0.9 else _LETTERS
            found[argument.name] = known[(place := int(random.integers(len(known)))) : place + 1]
        elif argument.type == "integer":
            found[argument.name] = _integer(argument, n, is_wild, random)
        else:
            usual = random.random() < 0.7
            found[argument.name] = (
                0.05 if usual else float(random.choice([0.0, 1.0, -1.0, np.nan, np.inf, 1e300, 1e-300]))
            )
    return found


def _integer(argument: Argument, n: int, is_wild: bool, random: np.random.Generator) -> int:
    name = argument.name
    if is_wild and random.random() < 0.4:
        return int(random.choice([-(2**31), -1, 0, 1, 2, 3, 7, 100]))
    if name == "n_freq":
        return int(random.choice([0, 1, 2, 3, 8, 9, 17]))
    if name in ("lwork", "liwork"):
        return int(random.choice([-1, 0, 1, 10, 200, 2000, 10_000]))
    if name in ("n", "n_a", "n_b"):
        return n
    if argument.text.startswith("1: "):
        return int(random.integers(2))
    if argument.may_be_zero:
        return int(random.choice([0, n])) if name != "n_correlated" else 0
    if name in ("n_par", "n_free"):
        return n * int(random.integers(1, 4))
    if name == "block":
        return 1
    return int(random.integers(0, n + 1))


def _array(argument: Argument, shape: tuple[int, ...], numbers: dict[str, Any], random: np.random.Generator) -> Any:
    """Return what an array holds: numbers of many sizes, some of them none, or DOFs."""
    dtype = _TYPES[argument.type]
    count = prod(max(size, 0) for size in shape)
    if argument.intent == "out" or argument.name in _WORKSPACE:
        values = np.empty(count, dtype)
        values.flags.writeable = False
        return values
    if argument.type == "integer":
        most = max(2, *(value for value in numbers.values() if isinstance(value, int) and value < 50))
        most = numbers.get("n", most) if random.random() < 0.8 else most
        most = max(most, 1)
        one_each = random.random() < 0.8 and count <= most
        return (random.permutation(most)[:count] + 1 if one_each else random.integers(-1, most + 2, count)).astype(
            dtype
        )
    if argument.type == "character":
        return np.array([b"rs"[i : i + 1] for i in random.integers(2, size=count)], dtype)
    values = random.standard_normal(count).astype(dtype)
    if argument.type == "complex":
        values += 1j * random.standard_normal(count)
    kind = random.random()
    if kind > _FINITE and count:
        values[random.integers(count)] = random.choice([np.nan, np.inf, 0.0, 1e308, 1e-308])
    if kind > 0.8:
        with np.errstate(all="ignore"):
            values *= 10.0 ** random.choice([-300, -150, 0, 150, 300])
    if kind > 0.95:
        values[:] = 0
    return values
