"""A fit as plain numbers and text, to be kept in a file and read again: every number exactly as it was."""

from __future__ import annotations

import json
import reprlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.errors import FileContentError
from jointfrf.files import check_file
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.call import VERSION

if TYPE_CHECKING:
    from jointfrf.identification.joint_fit import JointFit

__all__ = ["KnownIntervals", "fields_of_record", "read_record", "record_of"]

#: What the first keys of a file say.
_FORMAT, _VERSION = "jointfrf joint", 1
#: Probabilities of the intervals that are kept: the quartiles, one standard deviation, and what is usually quoted.
_PROBABILITIES = (0.5, 0.6827, 0.9, 0.95, 0.99)
_INFINITE = {"inf": np.inf, "-inf": -np.inf}


class KnownIntervals:
    """Intervals of the parameters at some probabilities, as they were found; others cannot be found again.

    Parameters
    ----------
    by_probability : dict of float to dict of str to (low, high)
    """

    def __init__(self, by_probability: dict[float, dict[str, tuple[float, float]]]) -> None:
        self.by_probability = by_probability

    def __call__(self, probability: float) -> dict[str, tuple[float, float]]:
        """Return the intervals of this probability."""
        for known, intervals in self.by_probability.items():
            if np.isclose(known, probability, rtol=0, atol=1e-9):
                return intervals
        levels = ", ".join(f"{known:g}" for known in sorted(self.by_probability))
        raise ValueError(
            f"probability {probability:g}: this fit was read from a file or a dictionary, which keeps its intervals at "
            f"{levels} only, as they follow from the FRFs; name it in `probabilities` where the fit is saved"
        )


def record_of(fit: JointFit, probabilities: Sequence[float] | None, *, lines: bool) -> dict[str, Any]:
    """Write a fit as plain numbers and text; as `JointFit.to_dict`."""
    intervals, errors = fit.confidence_interval(0.95), fit.std_error
    content = {
        "format": _FORMAT,
        "format_version": _VERSION,
        "written_by": f"jointfrf {VERSION}",
        "method": fit.method,
        "dofs": list(fit.dofs),
        "parameters": {
            term.name: {
                "value": _plain(fit.parameters[term.name]),
                "unit": term.unit,
                "std_error": _finite(errors[term.name]),
                "confidence_interval_95": [_finite(limit) for limit in intervals[term.name]],
            }
            for term in fit.terms
        },
        "covariance": [[_plain(value) for value in row] for row in fit.covariance.tolist()],
        "intervals": _plain_intervals(fit, probabilities),
        "loss_factor": {dof: _finite(eta) for dof, eta in zip(fit.dofs, fit.loss_factor, strict=True)},
        "noise_level": _plain(fit.noise_level),
        "residual_level": _plain(fit.residual_level),
        "frequency_hz": [float(fit.freq_hz.min()), float(fit.freq_hz.max())],
        "n_lines": int(fit.freq_hz.size),
        "lines_hz": _plain_lines(fit.freq_hz),
        "bands_hz": {d: [list(b) for b in own] for d, own in zip(fit.dofs, fit.bands, strict=True)},
        "warnings": list(fit.warnings),
        "notes": list(fit.notes),
    }
    if lines:
        content["k_lines"] = {
            part: [_plain(value) for value in values.ravel().tolist()]
            for part, values in (("real", fit.k_lines.real), ("imag", fit.k_lines.imag))
        }
    return content


def _finite(number: float) -> float | None:
    return float(number) if np.isfinite(number) else None


def _plain(number: float) -> float | str | None:
    """Write a number for JSON, which has neither NaN (null) nor infinity (a text)."""
    if np.isinf(number):
        return "inf" if number > 0 else "-inf"
    return _finite(number)


def _number(value: object) -> float:
    """Read what `_plain` wrote."""
    if value is None:
        return float("nan")
    if isinstance(value, str):
        return _INFINITE[value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError
    return float(value)


def _plain_intervals(fit: JointFit, probabilities: Sequence[float] | None) -> dict[str, Any] | None:
    """Write the intervals of a method that has its own: those of others follow from the covariance."""
    if fit.intervals is None:
        return None
    if isinstance(fit.intervals, KnownIntervals) and probabilities is None:
        levels = list(fit.intervals.by_probability)
    else:
        levels = sorted({*_PROBABILITIES, *(probabilities or ())})
    return {
        repr(float(level)): {
            name: [_plain(limit) for limit in limits] for name, limits in fit.confidence_interval(level).items()
        }
        for level in levels
    }


def _plain_lines(freq_hz: FloatArray) -> list[float] | dict[str, float]:
    """Write frequency lines by their ends and number where that gives the same numbers."""
    first, last, number = float(freq_hz[0]), float(freq_hz[-1]), freq_hz.size
    if number > 2 and np.array_equal(np.linspace(first, last, number), freq_hz):
        return {"first": first, "last": last, "number": number}
    return [float(value) for value in freq_hz.tolist()]


def fields_of_record(content: object, source: str = "the dictionary") -> dict[str, Any]:
    """Read what `record_of` wrote, as arguments of `JointFit`.

    Parameters
    ----------
    content : object
    source : str
        What holds it, for messages.

    Raises
    ------
    FileContentError
        It is no fit, of a later version, or damaged; the message names the key.
    """
    if not isinstance(content, dict) or content.get("format") != _FORMAT:
        raise FileContentError(f'{source} holds no fit of a joint: its "format" is not "{_FORMAT}"')
    version = content.get("format_version")
    if isinstance(version, bool) or not isinstance(version, int):
        raise FileContentError(f'{source}: "format_version" must be a whole number, not {reprlib.repr(version)}')
    if version > _VERSION:
        writer = content.get("written_by", "a later jointfrf")
        raise FileContentError(
            f"{source} is of format version {version}, written by {writer}; this is jointfrf {VERSION}, which reads "
            f"versions up to {_VERSION}: install a newer one"
        )
    fields: dict[str, Any] = {}
    for name, (key, read) in _READERS.items():
        if key not in content and key != "k_lines":
            raise FileContentError(f'{source}: "{key}" is missing')
        try:
            fields[name] = read(content.get(key), fields)
        except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError):
            raise FileContentError(f'{source}: "{key}" is damaged') from None
    return fields


def _parameters_of(told: Any, fields: dict[str, Any]) -> dict[str, float]:
    found = {str(name): _number(entry["value"]) for name, entry in told.items()}
    terms = [Parameter.parse(name) for name in found]
    if not found or not all({term.row, term.column} <= set(fields["dofs"]) for term in terms):
        raise ValueError
    return found


def _text_of(told: Any, _: dict[str, Any]) -> str:
    if not isinstance(told, str):
        raise TypeError
    return told


def _texts_of(told: Any, _: dict[str, Any]) -> tuple[str, ...]:
    if not isinstance(told, list) or not all(isinstance(text, str) for text in told):
        raise TypeError
    return tuple(told)


def _dofs_of(told: Any, fields: dict[str, Any]) -> tuple[str, ...]:
    dofs = _texts_of(told, fields)
    if not dofs or len(set(dofs)) != len(dofs):
        raise ValueError
    return dofs


def _number_of(told: Any, _: dict[str, Any]) -> float:
    return _number(told)


def _covariance_of(told: Any, fields: dict[str, Any]) -> FloatArray:
    p = len(fields["parameters"])
    return np.array([[_number(value) for value in row] for row in told], np.float64).reshape(p, p)


def _freq_hz_of(told: Any, _: dict[str, Any]) -> FloatArray:
    if isinstance(told, dict):
        freq = np.linspace(_number(told["first"]), _number(told["last"]), int(told["number"]))
    else:
        freq = np.array([_number(value) for value in told], np.float64)
    if freq.size == 0 or not np.isfinite(freq).all():
        raise ValueError
    return freq


def _k_lines_of(told: Any, fields: dict[str, Any]) -> ComplexArray:
    shape = (fields["freq_hz"].size, len(fields["dofs"]), len(fields["dofs"]))
    if told is None:
        return np.full(shape, np.nan + 1j * np.nan)
    k_lines = np.empty(shape, np.complex128)
    for part in ("real", "imag"):
        setattr(k_lines, part, np.array([_number(value) for value in told[part]], np.float64).reshape(shape))
    return k_lines


def _bands_of(told: Any, fields: dict[str, Any]) -> tuple[tuple[tuple[float, float], ...], ...]:
    return tuple(tuple((_number(low), _number(high)) for low, high in told[dof]) for dof in fields["dofs"])


def _intervals_of(told: Any, fields: dict[str, Any]) -> KnownIntervals | None:
    if told is None:
        return None
    known = {}
    for level, own in told.items():
        pairs = {name: tuple(map(_number, own[name])) for name in fields["parameters"]}
        known[float(level)] = {name: (low, high) for name, (low, high) in pairs.items()}
    if not any(np.isclose(level, 0.95, rtol=0, atol=1e-9) for level in known):
        raise ValueError
    return KnownIntervals(known)


#: Arguments of `JointFit` with the key of each, in the order in which they are read: later ones need earlier ones.
_READERS: dict[str, tuple[str, Callable[[Any, dict[str, Any]], Any]]] = {
    "method": ("method", _text_of),
    "dofs": ("dofs", _dofs_of),
    "parameters": ("parameters", _parameters_of),
    "covariance": ("covariance", _covariance_of),
    "noise_level": ("noise_level", _number_of),
    "residual_level": ("residual_level", _number_of),
    "freq_hz": ("lines_hz", _freq_hz_of),
    "k_lines": ("k_lines", _k_lines_of),
    "bands": ("bands_hz", _bands_of),
    "warnings": ("warnings", _texts_of),
    "notes": ("notes", _texts_of),
    "intervals": ("intervals", _intervals_of),
}


def read_record(path: Path) -> dict[str, Any]:
    """Read a file that `JointFit.save` wrote, as arguments of `JointFit`.

    Raises
    ------
    FileContentError
        The file is no such file, of a later version, or damaged.
    OSError
        It cannot be read.
    """
    if path.exists():
        check_file(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError):
        raise FileContentError(f"{path} is no file of a joint: it is not JSON, which `JointFit.save` writes") from None
    return fields_of_record(content, str(path))
