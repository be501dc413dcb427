"""A fit in a file: plain numbers and text, to be read again with every number exactly as it was."""

from __future__ import annotations

import json
import reprlib
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.errors import FileContentError
from jointfrf.files import check_file, write_file
from jointfrf.identification.derived import Derived
from jointfrf.identification.result import Fit, FittedParameter, SeenStiffness
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_real, check_type
from jointfrf.kernel.call import VERSION
from jointfrf.laws.joint_toml import joint_text, read_joint_table
from jointfrf.laws.law_joint import LawJoint
from jointfrf.messages.finding import Finding, saved_finding
from jointfrf.messages.message import Severity
from jointfrf.toml.table import TomlTable

__all__ = ["fit_from_dict", "fit_to_dict", "load", "read_record", "save"]

#: What the first keys of a file say. Version 1 had springs alone.
_FORMAT, _VERSION = "jointfrf joint", 2
#: Probabilities of the intervals that are kept: the quartiles, one standard deviation, and what is usually quoted.
_PROBABILITIES = (0.5, 0.6827, 0.9, 0.95, 0.99)
_INFINITE = {"inf": np.inf, "-inf": -np.inf}


class _KnownIntervals:
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


def fit_to_dict(fit: Fit, *, probabilities: Sequence[float] | None = None, lines: bool = True) -> dict[str, Any]:
    """Everything that a fit says as plain numbers and text, ready for JSON; `fit_from_dict` gives the same fit again.

    Parameters
    ----------
    fit : Fit
    probabilities : sequence of float, optional
        Probabilities of the intervals that are kept beside 0.5, 0.6827, 0.9, 0.95 and 0.99: where intervals follow from
        the profile of the likelihood they cannot be found again without the FRFs.
    lines : bool
        Whether K*(w) of each line is kept, two numbers for each of the n n entries.

    Returns
    -------
    dict
        ``"format"``, ``"format_version"``, and under ``"parameters"`` value, unit, standard error and 95 % interval of
        each, under ``"derived"`` loss factors, under ``"seen"`` what virtual points see; in an interval there, None is
        an open end. Elsewhere None is NaN, ``"inf"`` infinity.

    Raises
    ------
    ValueError
        A probability is not between 0 and 1, or not known to a fit that was loaded; a user-defined law, which a file
        cannot hold.
    """
    check_type("fit", fit, Fit)
    intervals, errors = fit.confidence_interval(0.95), fit.std_error
    content = {
        "format": _FORMAT,
        "format_version": _VERSION,
        "written_by": f"jointfrf {VERSION}",
        "method": fit.method,
        "dofs": list(fit.dofs),
        "parameters": {
            one.name: {
                "value": _plain(fit.value[one.name]),
                "unit": one.unit,
                "std_error": _finite(errors[one.name]) if np.isfinite(intervals[one.name]).all() else None,
                "confidence_interval_95": [_finite(limit) for limit in intervals[one.name]],
                "kind": one.kind,
                "between": [one.row, one.column],
                "origin": one.origin,
                "prior": None if one.prior is None else list(one.prior),
            }
            for one in fit.parameters
        },
        "joint": None if fit.laws is None else tomllib.loads(joint_text(fit.laws)),
        "same": [list(one) for one in fit.same],
        "covariance": [[_plain(value) for value in row] for row in fit.covariance.tolist()],
        "intervals": _plain_intervals(fit, probabilities),
        "derived": {
            name: {
                "value": _plain(one.value),
                "unit": "1",
                "std_error": _plain(one.std_error),
                "confidence_interval_95": [_plain(one.low), _plain(one.high)],
            }
            for name, one in fit.loss_factors.items()
        },
        "seen": {name: {key: _plain(value) for key, value in asdict(one).items()} for name, one in fit.seen.items()},
        "noise_level": _plain(fit.noise_level),
        "residual_level": _plain(fit.residual_level),
        "residual_is_noise": fit.residual_is_noise,
        "responses": list(fit.responses),
        "forces": list(fit.forces),
        "is_converged": fit.is_converged,
        "frequency_hz": [float(fit.freq_hz.min()), float(fit.freq_hz.max())],
        "n_lines": int(fit.freq_hz.size),
        "lines_hz": _plain_lines(fit.freq_hz),
        "bands_hz": {d: [list(b) for b in own] for d, own in zip(fit.dofs, fit.bands, strict=False)},
        **fit.content(),
        "warnings": list(fit.warnings),
        "notes": list(fit.notes),
    }
    if lines and fit.k_lines is not None:
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


def _plain_intervals(fit: Fit, probabilities: Sequence[float] | None) -> dict[str, Any] | None:
    """Write the intervals of a method that has its own: those of others follow from the covariance."""
    if fit.intervals is None:
        return None
    if isinstance(fit.intervals, _KnownIntervals) and probabilities is None:
        levels = list(fit.intervals.by_probability)
    else:
        levels = sorted({*_PROBABILITIES, *as_real("probabilities", probabilities or (), (None,)).tolist()})
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


def fit_from_dict(content: dict[str, Any]) -> Fit:
    """Make a fit of what `fit_to_dict` wrote.

    Parameters
    ----------
    content : dict

    Returns
    -------
    Fit
        The same numbers; intervals at the probabilities kept, and no FRFs: no page can be made of it.

    Raises
    ------
    FileContentError
        It is no fit, of a later version of jointfrf, or something is missing or damaged.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 100)
    >>> a = jf.chain([5], [2500], [3], ground="start").receptance(freq)
    >>> b = jf.chain([4], [2000], [2], ground="end").receptance(freq)
    >>> gamma = jf.couple(a, b, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [0], [0])
    >>> fit = jf.identify(freq, jf.pollute(gamma, 0.02, seed=1), ["x"])
    >>> same = jf.fit_from_dict(jf.fit_to_dict(fit))
    >>> same.confidence_interval(0.95) == fit.confidence_interval(0.95), str(same) == str(fit)
    (True, True)
    """
    return _fit_of(content, "the dictionary")


def save(fit: Fit, path: Path | str, *, probabilities: Sequence[float] | None = None, lines: bool = False) -> Path:
    """Write a fit to a JSON file, whole or not at all.

    Parameters
    ----------
    fit : Fit
    path : Path or str
        In a folder that exists.
    probabilities : sequence of float, optional
        As in `fit_to_dict`.
    lines : bool
        Whether K*(w) of each line is kept, which makes the file many times as long.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ValueError
        As `fit_to_dict`.
    OSError
        The file cannot be written.
    """
    write_record(Path(path), fit_to_dict(fit, probabilities=probabilities, lines=lines))
    return Path(path)


def write_record(path: Path, content: Mapping[str, Any]) -> None:
    """Write what `fit_to_dict` returned, and what else is to be known, to a file."""
    write_file(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def load(path: Path | str) -> Fit:
    """Read a fit that `save` wrote.

    Parameters
    ----------
    path : Path or str

    Returns
    -------
    Fit
        As `fit_from_dict` makes it.

    Raises
    ------
    FileContentError
        The file is no such file, of a later version of jointfrf, or damaged.
    OSError
        It cannot be read.
    """
    return read_record(Path(path))[0]


def read_record(path: Path) -> tuple[Fit, dict[str, Any]]:
    """Read a file that `save` wrote: the fit, and all that stands there.

    Raises
    ------
    FileContentError, OSError
        As `load`.
    """
    if path.exists():
        check_file(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, json.JSONDecodeError, RecursionError):
        raise FileContentError(f"{path} is no file of a joint: it is not JSON, as `save` writes it") from None
    return _fit_of(content, str(path)), content


def _fit_of(content: object, source: str) -> Fit:
    """Read a fit; `source` is what holds it, for messages, which name the key that is missing or damaged."""
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
    read: dict[str, Any] = {}
    for key, (reader, is_new) in _READERS.items():
        if key not in content and key not in ("k_lines", "seen", "same") and not (is_new and version == 1):
            raise FileContentError(f'{source}: "{key}" is missing')
        try:
            read[key] = reader(content.get(key), read)
        except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError):
            raise FileContentError(f'{source}: "{key}" is damaged') from None
    parameters, values = read["parameters"]
    fit = Fit(
        method=read["method"],
        dofs=read["dofs"],
        parameters=parameters,
        estimate=values,
        covariance=read["covariance"],
        noise_level=read["noise_level"],
        residual_level=read["residual_level"],
        freq_hz=read["lines_hz"],
        laws=read["joint"],
        same=read["same"],
        findings=read["findings"] if version > 1 else (*read["warnings"], *read["notes"]),
        k_lines=read["k_lines"],
        bands=read["bands_hz"],
        responses=read["responses"],
        forces=read["forces"],
        residual_is_noise=read["residual_is_noise"],
        is_converged=read["is_converged"] is not False,
        seen=read["seen"],
        intervals=read["intervals"],
    )
    if version > 1:
        # A profile of the likelihood cannot be found again.
        vars(fit)["loss_factors"] = read["derived"]
    return fit


def _parameters_of(content: Any, read: dict[str, Any]) -> tuple[tuple[FittedParameter, ...], FloatArray]:
    values = np.array([_number(entry["value"]) for entry in content.values()])
    if all("kind" not in entry for entry in content.values()):
        terms = [Parameter.parse(name) for name in content]
        parameters = tuple(FittedParameter(one.name, one.unit, one.kind, one.row, one.column) for one in terms)
    else:
        parameters = tuple(_parameter_of(name, own, read) for name, own in content.items())
    ends = {dof for one in parameters if one.origin == "joint" for dof in (one.row, one.column)}
    if not parameters or not ends <= set(read["dofs"]):
        raise ValueError
    return parameters, values


def _parameter_of(name: str, content: Any, read: dict[str, Any]) -> FittedParameter:
    row, column = _texts_of(content["between"], read)
    unit, kind, origin = (_text_of(content[key], read) for key in ("unit", "kind", "origin"))
    prior = None if content["prior"] is None else _pair_of(content["prior"])
    return FittedParameter(name, unit, kind, row, column, origin, prior)


def _pair_of(content: Any) -> tuple[float, float]:
    first, second = (_number(value) for value in content)
    return first, second


def _joint_of(content: Any, _: dict[str, Any]) -> LawJoint | None:
    if content is None:
        return None
    found = read_joint_table(TomlTable(content, "joint"))
    if not isinstance(found, LawJoint):
        raise TypeError
    return found


def _text_of(content: Any, _: dict[str, Any]) -> str:
    if not isinstance(content, str):
        raise TypeError
    return content


def _texts_of(content: Any, _: dict[str, Any]) -> tuple[str, ...]:
    if not isinstance(content, list) or not all(isinstance(text, str) for text in content):
        raise TypeError
    return tuple(content)


def _channels_of(content: Any, read: dict[str, Any]) -> tuple[str, ...]:
    return () if content is None else _texts_of(content, read)


def _dofs_of(content: Any, read: dict[str, Any]) -> tuple[str, ...]:
    dofs = _texts_of(content, read)
    if not dofs or len(set(dofs)) != len(dofs):
        raise ValueError
    return dofs


def _number_of(content: Any, _: dict[str, Any]) -> float:
    return _number(content)


def _truth_of(content: Any, _: dict[str, Any]) -> bool | None:
    if not isinstance(content, bool | None):
        raise TypeError
    return content


def _covariance_of(content: Any, read: dict[str, Any]) -> FloatArray:
    p = len(read["parameters"][0])
    return np.array([[_number(value) for value in row] for row in content], np.float64).reshape(p, p)


def _lines_of(content: Any, _: dict[str, Any]) -> FloatArray:
    if isinstance(content, dict):
        freq = np.linspace(_number(content["first"]), _number(content["last"]), int(content["number"]))
    else:
        freq = np.array([_number(value) for value in content], np.float64)
    if freq.size == 0 or not np.isfinite(freq).all():
        raise ValueError
    return freq


def _k_lines_of(content: Any, read: dict[str, Any]) -> ComplexArray | None:
    if content is None:
        return None
    shape = (read["lines_hz"].size, len(read["dofs"]), len(read["dofs"]))
    k_lines = np.empty(shape, np.complex128)
    for part in ("real", "imag"):
        setattr(k_lines, part, np.array([_number(value) for value in content[part]], np.float64).reshape(shape))
    return k_lines


def _bands_of(content: Any, read: dict[str, Any]) -> tuple[tuple[tuple[float, float], ...], ...]:
    if content == {}:
        return ()
    return tuple(tuple((_number(low), _number(high)) for low, high in content[dof]) for dof in read["dofs"])


def _intervals_of(content: Any, read: dict[str, Any]) -> _KnownIntervals | None:
    if content is None:
        return None
    known = {}
    for level, own in content.items():
        known[float(level)] = {one.name: _pair_of(own[one.name]) for one in read["parameters"][0]}
    if not any(np.isclose(level, 0.95, rtol=0, atol=1e-9) for level in known):
        raise ValueError
    return _KnownIntervals(known)


def _derived_of(content: Any, _: dict[str, Any]) -> dict[str, Derived]:
    if content is None:
        return {}
    return {
        name: Derived(_number(own["value"]), _number(own["std_error"]), *_pair_of(own["confidence_interval_95"]))
        for name, own in content.items()
    }


def _same_of(content: Any, read: dict[str, Any]) -> tuple[tuple[str, ...], ...]:
    """Read groups of equal joints; files of before have none."""
    if content is None:
        return ()
    if not isinstance(content, list):
        raise TypeError
    groups = tuple(_texts_of(one, read) for one in content)
    known = {dof.rpartition(".")[0] for dof in read["dofs"]}
    if not all(len(one) > 1 and known.issuperset(one) for one in groups):
        raise ValueError
    return groups


def _seen_of(content: Any, _: dict[str, Any]) -> dict[str, SeenStiffness]:
    """Read what virtual points see; files of before have none."""
    return {
        name: SeenStiffness(**{one.name: _number(own[one.name]) for one in fields(SeenStiffness)})
        for name, own in ({} if content is None else content).items()
    }


def _findings_of(content: Any, read: dict[str, Any]) -> tuple[Finding, ...]:
    return tuple(saved_finding(own, lambda text: _text_of(text, read)) for own in content or ())


def _warnings_of(content: Any, read: dict[str, Any]) -> tuple[Finding, ...]:
    return _without_numbers(content, "warning", read)


def _notes_of(content: Any, read: dict[str, Any]) -> tuple[Finding, ...]:
    return _without_numbers(content, "note", read)


def _without_numbers(content: Any, severity: Severity, read: dict[str, Any]) -> tuple[Finding, ...]:
    """Return sentences of a file of version 0.1, which has no findings."""
    own = ({"text": text, "severity": severity, "about": (), "bands": ()} for text in _texts_of(content, read))
    return tuple(map(saved_finding, own))


#: Keys in the order in which they are read, later ones need earlier ones: reader, and whether version 1 lacks the key.
_READERS: dict[str, tuple[Callable[[Any, dict[str, Any]], Any], bool]] = {
    "method": (_text_of, False),
    "dofs": (_dofs_of, False),
    "parameters": (_parameters_of, False),
    "joint": (_joint_of, True),
    "covariance": (_covariance_of, False),
    "noise_level": (_number_of, False),
    "residual_level": (_number_of, False),
    "responses": (_channels_of, True),
    "forces": (_channels_of, True),
    "residual_is_noise": (_truth_of, True),
    "is_converged": (_truth_of, True),
    "lines_hz": (_lines_of, False),
    "k_lines": (_k_lines_of, False),
    "bands_hz": (_bands_of, False),
    "derived": (_derived_of, True),
    "seen": (_seen_of, True),
    "same": (_same_of, True),
    "findings": (_findings_of, True),
    "warnings": (_warnings_of, False),
    "notes": (_notes_of, False),
    "intervals": (_intervals_of, False),
}
