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
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

import jointfrf as jf
from jointfrf.io.card_link import CardFormat
from jointfrf.io.cards import CardOptions

from .part import BrokenError
from .sound import sound_arguments
from .values import choices_of, spoiled

__all__ = ["PythonCalls", "public_callables"]

#: Types of arguments that their modules import for type checkers only.
_FOR_TYPE_CHECKERS = {"CardFormat": CardFormat, "CardOptions": CardOptions}
#: Errors that a caller has to expect. IndexError, KeyError, AttributeError, ZeroDivisionError ... are foreign.
_EXPECTED = (ValueError, TypeError, OverflowError, np.linalg.LinAlgError, OSError, jf.MissingPackageError)
#: Words of messages that were not written for the caller of this package.
_FOREIGN = (
    "ufunc", "ambiguous", "broadcast", "did not converge", "object has no attribute", "object is not", "'NoneType'",
    "unsupported operand", "not subscriptable", "setting an array element", "_kernel",
)  # fmt: skip
#: One in so many calls is of these, so that none takes more than a few hundredths of the time.
_SLOW = {
    "preload": 80, "identify_model": 40, "elastic_centre": 35, "identify_realisations": 25, "estimate_noise": 20,
    "identify": 10, "plan": 10, "study": 6, "sweep": 4, "plan_sweep": 3, "receptance": 2, "merge_frfs": 3,
    "write_hdf5": 3, "bolted_lap": 3, "joint_channels": 2, "smooth_frfs": 2, "merge_studies": 2, "read_uff": 2,
    "assemble": 2,
}  # fmt: skip
#: What starts processes is made from these alone, of which none starts one.
_WORKERS: dict[str, tuple[Any, ...]] = {
    "executor": (None, "processes", 2, object, print, [1]),
    "workers": (1, 2, 0, -1, 1.5, float("nan"), "2", None, [2], -(2**70)),
    "jobs": (1, 0, -1, 1.0, 2.5, float("nan"), "2", [2], np.int64(1), -(2**70)),
}
_LONGEST_MESSAGE = 600
#: Answers with times that were measured, which differ from call to call.
_MEASURED = frozenset({"plan_sweep", "sweep"})
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


def _base(use: str) -> str:
    """Return the function of a use of it."""
    return use.partition(" ")[0]


@dataclasses.dataclass
class _Callable:
    """A function, or a use of it that needs sound arguments of its own: `identify (laws)`."""

    name: str
    call: Callable[..., Any]
    signature: inspect.Signature
    choices: dict[str, tuple[str, ...]]

    @classmethod
    def of(cls, name: str, call: Callable[..., Any]) -> _Callable:
        try:
            hints = typing.get_type_hints(call.__init__ if inspect.isclass(call) else call, localns=_FOR_TYPE_CHECKERS)
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
        every = public_callables()
        made = {name for name, call in every.items() if not inspect.isclass(call)} | self.sound.keys()
        self.callables = [_Callable.of(use, every[_base(use)]) for use in sorted(made)]
        weights = np.array([1.0 / _SLOW.get(_base(each.name), 1) for each in self.callables])
        self.edges = np.cumsum(weights / weights.sum())
        self.folder = folder
        self.shapes: dict[str, tuple[int, ...]] = {}
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
            is_same = function.name in _MEASURED or _fingerprint(result) == _fingerprint(again[1])
            if again[0] != "result" or not is_same:
                raise BrokenError(f"{function.name} differs when it is called again: {_shown(positional, named)}")
        if random.random() < 0.3 and type(result).__module__.startswith("jointfrf"):
            return self._method(result, random)
        return kind

    def with_sound_arguments(self, function: _Callable) -> str:
        """Call one function with its sound arguments."""
        sound = dict(self.sound.get(function.name, {}))
        unnamed = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.VAR_POSITIONAL)
        positional = [sound.pop(name) for name, each in function.signature.parameters.items()
                      if each.kind in unnamed and name in sound]  # fmt: skip
        return _guarded(function.name, function.call, positional, sound)[0]

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
                if random.random() < bad:
                    named[name] = _WORKERS[name][random.integers(len(_WORKERS[name]))]
                elif name in sound:
                    named[name] = value
                continue
            if not is_needed and parameter.default is not None and value is None:
                value = parameter.default
            if name == "out" and not isinstance(value, Path):
                value = self._out(function, random)
            if random.random() < bad or (value is None and is_needed):
                value = spoiled(name, value, function.choices.get(name, ()), random)
            elif not is_needed and function.choices.get(name):
                value = spoiled(name, value, function.choices[name], random)
            if parameter.kind in (parameter.POSITIONAL_ONLY, parameter.VAR_POSITIONAL):
                positional.append(value)
            else:
                named[name] = value
        return positional, named

    def _out(self, function: _Callable, random: np.random.Generator) -> np.ndarray:
        """Return an array for the result, most often one that fits the result of the sound arguments."""
        if function.name not in self.shapes:
            sound = {key: value for key, value in self.sound[function.name].items() if key != "out"}
            answer = None if function.name in _MEASURED else public_callables()[_base(function.name)](**sound)
            self.shapes[function.name] = getattr(answer, "shape", (6, 4, 4))
        return np.zeros(self.shapes[function.name] if random.random() < 0.7 else random.integers(1, 7, 3), complex)

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
    with warnings.catch_warnings(record=True) as reported, contextlib.redirect_stdout(None):
        warnings.simplefilter("always")
        try:
            result = call(*positional, **named)
            if isinstance(result, contextlib._GeneratorContextManager):
                with result:
                    result = None
            elif isinstance(result, Executor):
                result.shutdown()
                result = None
            elif isinstance(result, Iterator):
                result = [each for each, _ in zip(result, range(3), strict=False)]
        except Exception as error:
            return _judged(name, error, positional, named), None
        finally:
            jf.set_engine("auto")
    for each in reported:
        if not each.category.__module__.startswith("jointfrf") and issubclass(each.category, DeprecationWarning):
            raise BrokenError(f"{name}: {each.category.__name__}: {each.message}")
    return "result", result


def _judged(name: str, error: Exception, positional: list[Any], named: dict[str, Any]) -> str:
    """Say whose refusal an error is; BrokenError where it is none that a caller has to expect."""
    message = str(error)
    is_expected = isinstance(error, _EXPECTED) or (isinstance(error, MemoryError) and bool(message))
    is_sentence = bool(message.strip()) and "\n" not in message and len(message) <= _LONGEST_MESSAGE
    is_own = _is_own(error)
    is_foreign = not is_own and "." not in name and any(word in message for word in _FOREIGN)
    if not is_expected or not is_sentence or is_foreign:
        where = traceback.extract_tb(error.__traceback__)[-1]
        reported = f"{name}: {type(error).__name__}: {message[:200]!r} ({Path(where.filename).name}:{where.lineno})"
        raise BrokenError(f"{reported} from {_shown(positional, named)}")
    if is_own:
        return f"refused: {type(error).__name__}"
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
    if isinstance(value, types.NoneType | bool | int | float | complex | str | bytes | np.generic | Path):
        return zlib.crc32(repr(value).encode())
    if type(value).__module__.startswith("jointfrf") and hasattr(value, "__dict__"):
        found = {name: each for name, each in vars(value).items() if not _is_cached(type(value), name)}
        return _fingerprint(found, depth + 1)
    return 0


def _is_cached(kind: type, name: str) -> bool:
    """Whether an attribute is kept there by a property when it is first read."""
    return isinstance(inspect.getattr_static(kind, name, None), functools.cached_property)
