"""Random calls of every public function, with the parameters that its signature names, and of methods of its results.

Functions and classes must answer with a result or with one sentence of their own kind. Methods may refuse in the words
of Python, too; those that take arrays of the package's own kind (annotated FloatArray, ...) serve its classes among
themselves and get what these hand over.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import inspect
import opcode
import traceback
import types
import typing
import warnings
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

import jointfrf as jf

from .part import BrokenError
from .sound import sound_arguments
from .values import choices_of, spoiled

__all__ = ["PythonCalls", "public_callables"]

#: Errors that a caller has to expect. IndexError, KeyError, AttributeError, ZeroDivisionError ... are foreign.
_EXPECTED = (ValueError, TypeError, OverflowError, np.linalg.LinAlgError, OSError, jf.MissingPackageError)
#: Words of messages that were not written for the caller of this package.
_FOREIGN = (
    "ufunc", "ambiguous", "broadcast", "did not converge", "object has no attribute", "object is not", "'NoneType'",
    "unsupported operand", "not subscriptable", "setting an array element", "_kernel",
)  # fmt: skip
#: One in so many calls is of these: they take their time.
_SLOW = {
    "preload": 3000, "bolted_lap": 2000, "identify_model": 400, "identify": 60, "identify_realisations": 80,
    "estimate_noise": 15, "smooth_frfs": 15, "brick_beam": 10, "solid_model": 10, "check_frfs": 10, "write_hdf5": 4,
    "read_channel_table": 4, "write_uff": 2, "merge_frfs": 4, "receptance": 2, "joint_channels": 10,
    "BoltedLap": 4, "element_matrices": 4, "assemble_bricks": 4, "elastic_centre": 4, "multi_point_stiffness": 4,
    "multi_point_compliance": 4, "study": 3000, "merge_studies": 100, "read_study": 10, "sweep": 20, "plan_sweep": 100,
}  # fmt: skip
#: What starts processes stays as it is.
_WORKERS = ("executor", "jobs")
_LONGEST_MESSAGE = 600
#: Methods that write, draw or are slow are called, but seldom.
_SELDOM = {"report": 0.002, "plot": 0.002, "save": 0.2, "modes": 0.3, "receptance": 0.3}


def public_callables() -> dict[str, Callable[..., Any]]:
    """Return all that is public and can be called, by name."""
    found: dict[str, Callable[..., Any]] = {}
    for module in (jf, jf.io, jf.solids, jf.report):
        for name in getattr(module, "__all__", ()):
            value = getattr(module, name)
            is_exception = inspect.isclass(value) and issubclass(value, BaseException)
            if callable(value) and not inspect.ismodule(value) and not is_exception:
                found[name] = value
    return found


@dataclasses.dataclass
class _Callable:
    name: str
    call: Callable[..., Any]
    signature: inspect.Signature
    choices: dict[str, tuple[str, ...]]

    @classmethod
    def of(cls, name: str, call: Callable[..., Any]) -> _Callable:
        try:
            hints = typing.get_type_hints(call.__init__ if inspect.isclass(call) else call)
        except (NameError, TypeError, AttributeError):  # names for type checkers only
            hints = {}
        signature = inspect.signature(call)
        choices = {each: choices_of(hints.get(each)) for each in signature.parameters}
        return cls(name, call, signature, choices)


class PythonCalls:
    """Random calls."""

    def __init__(self, folder: Path) -> None:
        self.sound = sound_arguments(folder)
        # Classes without sound arguments are records, which the package makes and its users read.
        every = sorted(public_callables().items())
        made = [(name, call) for name, call in every if not inspect.isclass(call) or name in self.sound]
        self.callables = [_Callable.of(name, call) for name, call in made]
        weights = np.array([1.0 / _SLOW.get(each.name, 1) for each in self.callables])
        self.edges = np.cumsum(weights / weights.sum())
        self.folder = folder
        self.answered: set[str] = set()

    def run(self, random: np.random.Generator) -> str:
        """Call a function, and perhaps a method of what it returns."""
        place = min(int(np.searchsorted(self.edges, random.random())), len(self.callables) - 1)
        return self.call(self.callables[place], random)

    def call(self, function: _Callable, random: np.random.Generator) -> str:
        """Call one function with random arguments."""
        positional, named = self._arguments(function, random)
        repeat = random.random() < 0.2
        before = _fingerprint((positional, {k: v for k, v in named.items() if k != "out"})) if repeat else 0
        kind, result = _guarded(function.name, function.call, positional, named)
        if kind != "result":
            return kind
        self.answered.add(function.name)
        if repeat:
            if _fingerprint((positional, {k: v for k, v in named.items() if k != "out"})) != before:
                raise BrokenError(f"{function.name} changed its arguments: {_shown(positional, named)}")
            again = _guarded(function.name, function.call, positional, named)
            if again[0] != "result" or _fingerprint(result) != _fingerprint(again[1]):
                raise BrokenError(f"{function.name} differs when it is called again: {_shown(positional, named)}")
        if random.random() < 0.3 and type(result).__module__.startswith("jointfrf"):
            return self._method(result, random)
        return kind

    def _arguments(self, function: _Callable, random: np.random.Generator) -> tuple[list[Any], dict[str, Any]]:
        """Make sound arguments, none to all of which are spoiled."""
        sound = self.sound.get(function.name, {})
        bad = random.choice([0.0, 0.15, 0.4, 1.0], p=[0.15, 0.45, 0.3, 0.1])
        positional, named = [], {}
        for name, parameter in function.signature.parameters.items():
            value = sound.get(name)
            is_needed = parameter.default is parameter.empty or name in sound
            if parameter.kind is parameter.VAR_KEYWORD or (not is_needed and random.random() > 0.25):
                continue
            if name in _WORKERS:
                named |= {name: value} if name in sound else {}
                continue
            if not is_needed and parameter.default is not None and value is None:
                value = parameter.default
            if name == "out":
                value = np.zeros((int(random.integers(1, 7)), 4, 4), complex)
            if random.random() < bad or (value is None and is_needed):
                value = spoiled(name, value, function.choices.get(name, ()), random)
            elif not is_needed and function.choices.get(name):
                value = spoiled(name, value, function.choices[name], random)
            if parameter.kind in (parameter.POSITIONAL_ONLY, parameter.VAR_POSITIONAL):
                positional.append(value)
            else:
                named[name] = value
        return positional, named

    def _method(self, result: Any, random: np.random.Generator) -> str:
        """Call a public method of a result, or read a property."""
        names = _own_methods(type(result))
        if not names:
            return "result"
        name = names[random.integers(len(names))]
        if random.random() > _SELDOM.get(name, 1.0):
            return "result"
        label = f"{type(result).__name__}.{name}"
        if isinstance(inspect.getattr_static(type(result), name), property | functools.cached_property):
            return _guarded(label, getattr, [result, name], {})[0]
        function = _Callable.of(label, getattr(result, name))
        if any(_is_typed(parameter) for parameter in function.signature.parameters.values()):
            return "result"
        sound = {
            "path": self.folder / "saved.json",
            "freq_hz": np.linspace(1.0, 5.0, 4),
            "h": np.ones((4, 2, 2), complex),
        }
        self.sound.setdefault(
            label, {key: value for key, value in sound.items() if key in function.signature.parameters}
        )
        positional, named = self._arguments(function, random)
        return _guarded(label, function.call, positional, named)[0]


def _own_methods(kind: type) -> list[str]:
    """Return the public methods and properties that the package gives a class."""
    found = {}
    for each in kind.__mro__:
        if each.__module__.startswith("jointfrf"):
            found |= {name: 1 for name, value in vars(each).items() if _is_method(value) and not name.startswith("_")}
    return sorted(found)


def _is_method(value: Any) -> bool:
    return isinstance(value, types.FunctionType | property | functools.cached_property | classmethod | staticmethod)


def _is_typed(parameter: inspect.Parameter) -> bool:
    return any(word in str(parameter.annotation) for word in ("FloatArray", "ComplexArray", "NDArray", "Places"))


def _guarded(name: str, call: Callable[..., Any], positional: list[Any], named: dict[str, Any]) -> tuple[str, Any]:
    """Call, and say what came of it: a result, or whose words refuse it."""
    with warnings.catch_warnings(record=True) as told, contextlib.redirect_stdout(None):
        warnings.simplefilter("always")
        try:
            result = call(*positional, **named)
            if isinstance(result, contextlib._GeneratorContextManager):
                with result:
                    result = None
            elif isinstance(result, Iterator):
                result = [each for each, _ in zip(result, range(3), strict=False)]
        except Exception as error:
            return _judged(name, error, positional, named), None
        finally:
            jf.set_engine("auto")
    for each in told:
        if not each.category.__module__.startswith("jointfrf") and issubclass(each.category, DeprecationWarning):
            raise BrokenError(f"{name}: {each.category.__name__}: {each.message}")
    return "result", result


def _judged(name: str, error: Exception, positional: list[Any], named: dict[str, Any]) -> str:
    """Say whose refusal an error is; BrokenError where it is none that a caller has to expect."""
    message = str(error)
    where = traceback.extract_tb(error.__traceback__)[-1]
    told = f"{name}: {type(error).__name__}: {message[:200]!r} ({Path(where.filename).name}:{where.lineno})"
    told += f" from {_shown(positional, named)}"
    if not isinstance(error, _EXPECTED) and not (isinstance(error, MemoryError) and message):
        raise BrokenError(told)
    if not message.strip() or "\n" in message or len(message) > _LONGEST_MESSAGE:
        raise BrokenError(told)
    if _is_own(error):
        return f"refused: {type(error).__name__}"
    is_method = "." in name
    if not is_method and any(word in message for word in _FOREIGN):
        raise BrokenError(told)
    return f"refused in the words of Python or a library: {type(error).__name__}"


def _is_own(error: Exception) -> bool:
    """Whether a `raise` of this package raised it."""
    last = error.__traceback__
    while last is not None and last.tb_next is not None:
        last = last.tb_next
    if last is None:
        return False
    code = last.tb_frame.f_code
    is_raise = opcode.opname[code.co_code[last.tb_lasti]] in ("RAISE_VARARGS", "RERAISE")
    return is_raise and "jointfrf" in Path(code.co_filename).parts


def _shown(positional: list[Any], named: dict[str, Any]) -> str:
    with np.printoptions(threshold=4, precision=3):
        words = [*map(repr, positional), *(f"{key}={value!r}" for key, value in named.items())]
    return ", ".join(" ".join(word.split())[:120] for word in words)


def _fingerprint(value: Any, depth: int = 0) -> int:
    """Return a checksum of content: equal where nothing differs by a bit."""
    if depth > 6:
        return 0
    if isinstance(value, np.ma.MaskedArray):
        return _fingerprint([np.asarray(value.data), np.ma.getmaskarray(value)], depth)
    if isinstance(value, np.ndarray) and value.dtype != object:
        return zlib.crc32(value.tobytes(), zlib.crc32(str((value.shape, value.dtype)).encode()))
    if sparse.issparse(value):
        return _fingerprint(value.toarray(), depth)
    if isinstance(value, dict):
        return _fingerprint([*value.keys(), *value.values()], depth + 1)
    if isinstance(value, list | tuple | np.ndarray):
        found = 1
        for each in value.ravel() if isinstance(value, np.ndarray) else value:
            found = zlib.crc32(str(_fingerprint(each, depth + 1)).encode(), found)
        return found
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return _fingerprint([getattr(value, each.name) for each in dataclasses.fields(value)], depth + 1)
    if isinstance(value, types.NoneType | bool | int | float | complex | str | bytes):
        return zlib.crc32(repr(value).encode())
    return 0
