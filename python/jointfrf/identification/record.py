"""A fit in a file: plain numbers and text that reproduce every number exactly."""

from __future__ import annotations

import json
import re
import reprlib
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np
from msgspec import UNSET, Struct, UnsetType

from jointfrf.dofs import Parameter
from jointfrf.errors import FileContentError
from jointfrf.files import check_file, check_stated, write_file
from jointfrf.identification.derived import Derived
from jointfrf.identification.result import Fit, FittedParameter, SeenStiffness
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_real, check_type
from jointfrf.kernel.call import VERSION
from jointfrf.laws.joint_toml import joint_text, read_joint_table
from jointfrf.laws.law_joint import LawJoint
from jointfrf.messages.finding import Finding, saved_finding
from jointfrf.toml.table import TomlTable

__all__ = ["fit_from_dict", "fit_to_dict", "load", "read_record", "save"]

#: Format and version in the first keys of a file. Version 1 contains only springs.
_FORMAT, _VERSION = "jointfrf joint", 2
#: Probabilities of the stored intervals: the quartiles, one standard deviation, and the usual ones.
_PROBABILITIES = (0.5, 0.6827, 0.9, 0.95, 0.99)
#: Bytes of memory of a frequency line.
_LINE = 32
#: Keys that a file of version 1 does not have.
_OF_VERSION_2 = ("joint", "derived", "responses", "forces", "residual_is_noise", "is_converged", "findings")

#: JSON has no NaN (null) and no infinity (a text).
Number = float | Literal["inf", "-inf"] | None
Pair = tuple[Number, Number]


class _ParameterRecord(Struct):
    value: Number
    unit: str = ""
    std_error: Number = None
    confidence_interval_95: Pair = (None, None)
    kind: str = ""
    between: tuple[str, str] = ("", "")
    origin: str = ""
    prior: Pair | None = None


class _DerivedRecord(Struct):
    value: Number
    unit: str
    std_error: Number
    confidence_interval_95: Pair


class _SeenRecord(Struct):
    value: Number
    low: Number
    high: Number
    sides: Number
    inertia: Number
    noise: Number


class _Grid(Struct):
    first: float
    last: float
    number: int


class _Complex(Struct):
    real: list[Number]
    imag: list[Number]


class _Record(Struct, kw_only=True):
    """The file, key by key."""

    format: str
    format_version: int
    written_by: str = ""
    method: str
    dofs: tuple[str, ...]
    parameters: dict[str, _ParameterRecord]
    joint: dict[str, Any] | None
    same: tuple[tuple[str, ...], ...] | None = ()
    covariance: list[list[Number]]
    intervals: dict[str, dict[str, Pair]] | None
    derived: dict[str, _DerivedRecord] | None
    seen: dict[str, _SeenRecord] | None = msgspec.field(default_factory=dict)
    noise_level: Number
    residual_level: Number
    residual_is_noise: bool | None
    responses: tuple[str, ...] | None
    forces: tuple[str, ...] | None
    is_converged: bool | None
    frequency_hz: tuple[float, float] | UnsetType = UNSET
    n_lines: int | UnsetType = UNSET
    lines_hz: list[float] | _Grid
    bands_hz: dict[str, tuple[tuple[float, float], ...]]
    findings: list[dict[str, Any]] | None
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    k_lines: _Complex | UnsetType | None = UNSET


class _KnownIntervals:
    """Intervals of the parameters at stored probabilities; no further interval can be computed.

    Parameters
    ----------
    by_probability : dict of float to dict of str to (low, high)
        Intervals by probability and name.
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
            f"probability {probability:g}: this fit was loaded and has its intervals at {levels} only; save it with "
            "`probabilities`"
        )


def fit_to_dict(fit: Fit, *, probabilities: Sequence[float] | None = None, lines: bool = True) -> dict[str, Any]:
    """Return a fit as plain numbers and text, ready for JSON; `fit_from_dict` gives the same fit again.

    Parameters
    ----------
    fit : Fit
        Fit to store.
    probabilities : sequence of float, optional
        Probabilities of stored intervals in addition to 0.5, 0.6827, 0.9, 0.95 and 0.99. Intervals from the profile of
        the likelihood cannot be computed again without the FRFs.
    lines : bool
        Whether K*(w) of each line is stored, two numbers for each of the n n entries; default True.

    Returns
    -------
    dict
        Keys ``"format"`` and ``"format_version"``; ``"parameters"`` with value, unit, standard error and 95 % interval
        of each; ``"derived"`` with loss factors. ``"seen"`` has stiffnesses between virtual points. None in an interval
        is an unbounded end. Elsewhere None is NaN, and ``"inf"`` is infinity.

    Raises
    ------
    ValueError
        A probability is not between 0 and 1, or not known to a fit that was loaded; a user-defined law, which a file
        cannot contain.

    See Also
    --------
    fit_from_dict : the fit of such a dict.
    save : the same in a JSON file.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 100)
    >>> h = jf.chain([5], [2500], [3], ground="start").receptance(freq)
    >>> gamma = jf.couple(h, h, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [0], [0])
    >>> content = jf.fit_to_dict(jf.identify(freq, jf.pollute(gamma, 0.02, seed=1), ["x"], damping="viscous"))
    >>> list(content["parameters"])
    ['k_x', 'c_x']
    """
    check_type("fit", fit, Fit)
    intervals, errors = fit.confidence_interval(0.95), fit.std_error
    record = _Record(
        format=_FORMAT,
        format_version=_VERSION,
        written_by=f"jointfrf {VERSION}",
        method=fit.method,
        dofs=fit.dofs,
        parameters={
            one.name: _ParameterRecord(
                _plain(fit.value[one.name]),
                one.unit,
                _finite(errors[one.name]) if np.isfinite(intervals[one.name]).all() else None,
                (_finite(intervals[one.name][0]), _finite(intervals[one.name][1])),
                one.kind,
                (one.row, one.column),
                one.origin,
                one.prior,
            )
            for one in fit.parameters
        },
        joint=None if fit.laws is None else tomllib.loads(joint_text(fit.laws)),
        same=fit.same,
        covariance=[[_plain(value) for value in row] for row in fit.covariance.tolist()],
        intervals=_plain_intervals(fit, probabilities),
        derived={
            name: _DerivedRecord(_plain(one.value), "1", _plain(one.std_error), (_plain(one.low), _plain(one.high)))
            for name, one in fit.loss_factors.items()
        },
        seen={
            name: _SeenRecord(*(_plain(getattr(one, key)) for key in _SeenRecord.__struct_fields__))
            for name, one in fit.seen.items()
        },
        noise_level=_plain(fit.noise_level),
        residual_level=_plain(fit.residual_level),
        residual_is_noise=fit.residual_is_noise,
        responses=fit.responses,
        forces=fit.forces,
        is_converged=fit.is_converged,
        frequency_hz=(float(fit.freq_hz.min()), float(fit.freq_hz.max())),
        n_lines=int(fit.freq_hz.size),
        lines_hz=_plain_lines(fit.freq_hz),
        bands_hz=dict(zip(fit.dofs, fit.bands, strict=False)),
        warnings=fit.warnings,
        notes=fit.notes,
        k_lines=_plain_complex(fit.k_lines) if lines and fit.k_lines is not None else UNSET,
        **fit.content(),
    )
    found: dict[str, Any] = msgspec.json.decode(msgspec.json.encode(record))
    return found


def _finite(number: float) -> float | None:
    return float(number) if np.isfinite(number) else None


def _plain(number: float) -> Number:
    """Return a number for JSON."""
    if np.isinf(number):
        return "inf" if number > 0 else "-inf"
    return _finite(number)


def _plain_complex(values: ComplexArray) -> _Complex:
    real, imag = ([_plain(one) for one in part.ravel().tolist()] for part in (values.real, values.imag))
    return _Complex(real, imag)


def _number(value: Number) -> float:
    """Return the number that `_plain` wrote."""
    return float("nan" if value is None else value)


def _plain_intervals(fit: Fit, probabilities: Sequence[float] | None) -> dict[str, dict[str, Pair]] | None:
    """Return the intervals if the method computes them; without these they follow from the covariance."""
    if fit.intervals is None:
        return None
    if isinstance(fit.intervals, _KnownIntervals) and probabilities is None:
        levels = list(fit.intervals.by_probability)
    else:
        levels = sorted({*_PROBABILITIES, *as_real("probabilities", probabilities or (), (None,)).tolist()})
    return {
        repr(float(level)): {
            name: (_plain(low), _plain(high)) for name, (low, high) in fit.confidence_interval(level).items()
        }
        for level in levels
    }


def _plain_lines(freq_hz: FloatArray) -> list[float] | _Grid:
    """Return frequency lines as first, last and number if that reproduces them exactly."""
    first, last, number = float(freq_hz[0]), float(freq_hz[-1]), freq_hz.size
    if number > 2 and np.array_equal(np.linspace(first, last, number), freq_hz):
        return _Grid(first, last, number)
    return [float(value) for value in freq_hz.tolist()]


def fit_from_dict(content: dict[str, Any]) -> Fit:
    """Return the fit of a dict from `fit_to_dict`.

    Parameters
    ----------
    content : dict
        Result of `fit_to_dict`.

    Returns
    -------
    Fit
        Fit with the same numbers and intervals at the stored probabilities. It has no FRFs, so that no page can be made
        of it.

    Raises
    ------
    FileContentError
        It is no fit, of a later version of jointfrf, or something is missing or damaged.

    See Also
    --------
    fit_to_dict : the dict of a fit.
    load : read a fit from a JSON file.

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
    """Write a fit to a JSON file, whole or not at all, and return the path.

    Parameters
    ----------
    fit : Fit
        Fit to store.
    path : Path or str
        Name of the file, in a folder that exists.
    probabilities : sequence of float, optional
        Probabilities of additional intervals; see `fit_to_dict`.
    lines : bool
        Whether K*(w) of each line is stored, default True; the file is then many times as long.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ValueError
        An error of `fit_to_dict`.
    OSError
        The file cannot be written.

    See Also
    --------
    load : read the fit again.
    write_joint : write only the joint.
    write_report : write a page with figures.

    Examples
    --------
    >>> import tempfile, numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 100)
    >>> h = jf.chain([5], [2500], [3], ground="start").receptance(freq)
    >>> gamma = jf.couple(h, h, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [0], [0])
    >>> fit = jf.identify(freq, jf.pollute(gamma, 0.02, seed=1), ["x"])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     same = jf.load(jf.save(fit, f"{folder}/fit.json"))
    >>> same.value == fit.value
    True
    """
    write_record(Path(path), fit_to_dict(fit, probabilities=probabilities, lines=lines))
    return Path(path)


def write_record(path: Path, content: Mapping[str, Any]) -> None:
    """Write the result of `fit_to_dict`, and additional keys, to a file."""
    write_file(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def load(path: Path | str) -> Fit:
    """Read a fit that `save` wrote, and return it.

    Parameters
    ----------
    path : Path or str
        Name of the file.

    Returns
    -------
    Fit
        Fit with the same numbers, see `fit_from_dict`.

    Raises
    ------
    FileContentError
        The file is no such file, of a later version of jointfrf, or damaged.
    OSError
        It cannot be read.

    See Also
    --------
    save : write a fit.
    read_joint : read only the joint.

    Examples
    --------
    >>> import tempfile, numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 100)
    >>> h = jf.chain([5], [2500], [3], ground="start").receptance(freq)
    >>> gamma = jf.couple(h, h, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [0], [0])
    >>> fit = jf.identify(freq, jf.pollute(gamma, 0.02, seed=1), ["x"], damping="viscous")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     same = jf.load(jf.save(fit, f"{folder}/fit.json"))
    >>> list(same.value)
    ['k_x', 'c_x']
    """
    return read_record(Path(path))[0]


def read_record(path: Path) -> tuple[Fit, dict[str, Any]]:
    """Read a file that `save` wrote; return the fit and the whole content.

    Raises
    ------
    FileContentError, OSError
        An error of `load`.
    """
    if path.exists():
        check_file(path)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):  # ValueError: no JSON, no UTF-8, or a number of thousands of digits
        raise FileContentError(f"{path} is no file of a joint: it is not JSON, as `save` writes it") from None
    return _fit_of(content, str(path)), content


def _fit_of(content: object, source: str) -> Fit:
    """Return the fit in a file's content; messages name `source` and the key that is missing or damaged."""
    if not isinstance(content, dict) or content.get("format") != _FORMAT:
        raise FileContentError(f'{source} contains no fit of a joint: its "format" is not "{_FORMAT}"')
    version = content.get("format_version")
    if isinstance(version, bool) or not isinstance(version, int):
        raise FileContentError(f'{source}: "format_version" must be a whole number, not {reprlib.repr(version)}')
    if version > _VERSION:
        writer = content.get("written_by", "a later jointfrf")
        raise FileContentError(
            f"{source} is of format version {version}, written by {writer}; this is jointfrf {VERSION}, which reads "
            f"versions up to {_VERSION}: install a newer one"
        )
    older = dict.fromkeys(_OF_VERSION_2) if version < _VERSION else {}
    try:
        record = msgspec.convert({**older, **content}, _Record)
    except msgspec.ValidationError as error:
        raise FileContentError(f"{source}: {_faulty_key(str(error))}") from None
    with _named_key(source) as at:
        return _fit_of_record(record, at)


def _faulty_key(error: str) -> str:
    """Return which key is missing or damaged."""
    if missing := re.fullmatch(r"Object missing required field `(\w+)`", error):
        return f'"{missing[1]}" is missing'
    path = re.search(r"`\$\.(\w+)", error)
    return f'"{path[1] if path else "format"}" is damaged'


@contextmanager
def _named_key(source: str) -> Iterator[list[str]]:
    """Turn errors of the block into an error that names the last key of the list, which the block fills."""
    at = ["format"]
    try:
        yield at
    except FileContentError as error:
        raise FileContentError(f"{source}: {error}") from None
    except (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError):
        raise FileContentError(f'{source}: "{at[-1]}" is damaged') from None


def _fit_of_record(record: _Record, at: list[str]) -> Fit:
    """Return the fit; each key is noted in `at` before it is read."""
    made: dict[str, Any] = {}
    for key, name, reader in _READERS:
        at.append(key)
        made[name] = reader(record, made)
    loss_factors = made.pop("loss_factors")
    fit = Fit(
        method=record.method,
        noise_level=_number(record.noise_level),
        residual_level=_number(record.residual_level),
        responses=record.responses or (),
        forces=record.forces or (),
        residual_is_noise=record.residual_is_noise,
        is_converged=record.is_converged is not False,
        **made,
    )
    if record.format_version > 1:
        # The profile of the likelihood cannot be computed again.
        vars(fit)["loss_factors"] = loss_factors
    return fit


def _dofs_of(record: _Record, _: dict[str, Any]) -> tuple[str, ...]:
    if not record.dofs or len(set(record.dofs)) != len(record.dofs):
        raise ValueError
    return record.dofs


def _parameters_of(record: _Record, _: dict[str, Any]) -> tuple[FittedParameter, ...]:
    own = record.parameters
    if all(not one.origin for one in own.values()):  # springs of version 1
        terms = [Parameter.parse(name) for name in own]
        parameters = tuple(FittedParameter(one.name, one.unit, one.kind, one.row, one.column) for one in terms)
    else:
        parameters = tuple(
            FittedParameter(name, one.unit, one.kind, *one.between, one.origin, one.prior and _pair(one.prior))
            for name, one in own.items()
        )
    ends = {dof for one in parameters if one.origin == "joint" for dof in (one.row, one.column)}
    if not parameters or not ends <= set(record.dofs):
        raise ValueError
    return parameters


def _pair(pair: Pair) -> tuple[float, float]:
    return _number(pair[0]), _number(pair[1])


def _values_of(record: _Record, _: dict[str, Any]) -> FloatArray:
    return np.array([_number(one.value) for one in record.parameters.values()])


def _covariance_of(record: _Record, _: dict[str, Any]) -> FloatArray:
    p = len(record.parameters)
    return np.array([[_number(value) for value in row] for row in record.covariance], np.float64).reshape(p, p)


def _joint_of(record: _Record, _: dict[str, Any]) -> LawJoint | None:
    if record.joint is None:
        return None
    found = read_joint_table(TomlTable(record.joint, "joint"))
    if not isinstance(found, LawJoint):
        raise TypeError
    return found


def _lines_of(record: _Record, _: dict[str, Any]) -> FloatArray:
    own = record.lines_hz
    if isinstance(own, _Grid):
        check_stated(f'"lines_hz" of {own.number} lines', _LINE * own.number)
        freq = np.linspace(own.first, own.last, own.number)
    else:
        freq = np.array(own, np.float64)
    if freq.size == 0 or not np.isfinite(freq).all():
        raise ValueError
    return freq


def _k_lines_of(record: _Record, made: dict[str, Any]) -> ComplexArray | None:
    if not isinstance(record.k_lines, _Complex):
        return None
    k_lines = np.empty((made["freq_hz"].size, len(record.dofs), len(record.dofs)), np.complex128)
    for part in ("real", "imag"):
        values = [_number(value) for value in getattr(record.k_lines, part)]
        setattr(k_lines, part, np.array(values, np.float64).reshape(k_lines.shape))
    return k_lines


def _bands_of(record: _Record, _: dict[str, Any]) -> tuple[tuple[tuple[float, float], ...], ...]:
    return tuple(record.bands_hz[dof] for dof in record.dofs) if record.bands_hz else ()


def _intervals_of(record: _Record, _: dict[str, Any]) -> _KnownIntervals | None:
    if record.intervals is None:
        return None
    known = {
        float(level): {name: _pair(own[name]) for name in record.parameters} for level, own in record.intervals.items()
    }
    if not any(np.isclose(level, 0.95, rtol=0, atol=1e-9) for level in known):
        raise ValueError
    return _KnownIntervals(known)


def _loss_factors_of(record: _Record, _: dict[str, Any]) -> dict[str, Derived]:
    return {
        name: Derived(_number(own.value), _number(own.std_error), *_pair(own.confidence_interval_95))
        for name, own in (record.derived or {}).items()
    }


def _same_of(record: _Record, _: dict[str, Any]) -> tuple[tuple[str, ...], ...]:
    groups, known = record.same or (), {dof.rpartition(".")[0] for dof in record.dofs}
    if not all(len(one) > 1 and known.issuperset(one) for one in groups):
        raise ValueError
    return groups


def _seen_of(record: _Record, _: dict[str, Any]) -> dict[str, SeenStiffness]:
    return {
        name: SeenStiffness(*(_number(getattr(own, key)) for key in _SeenRecord.__struct_fields__))
        for name, own in (record.seen or {}).items()
    }


def _findings_of(record: _Record, _: dict[str, Any]) -> tuple[Finding, ...]:
    if record.format_version > 1:
        return tuple(saved_finding(own, _text) for own in record.findings or ())
    # Version 0.1 wrote sentences without codes.
    severities = {"warning": record.warnings, "note": record.notes}
    own = ({"text": text, "severity": severity, "about": (), "bands": ()}
           for severity, texts in severities.items() for text in texts)  # fmt: skip
    return tuple(map(saved_finding, own))


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


#: Key of the file, name in `Fit`, and reader; later ones may need earlier ones.
_READERS = (
    ("dofs", "dofs", _dofs_of),
    ("parameters", "parameters", _parameters_of),
    ("parameters", "estimate", _values_of),
    ("covariance", "covariance", _covariance_of),
    ("joint", "laws", _joint_of),
    ("lines_hz", "freq_hz", _lines_of),
    ("k_lines", "k_lines", _k_lines_of),
    ("bands_hz", "bands", _bands_of),
    ("derived", "loss_factors", _loss_factors_of),
    ("seen", "seen", _seen_of),
    ("same", "same", _same_of),
    ("findings", "findings", _findings_of),
    ("intervals", "intervals", _intervals_of),
)
