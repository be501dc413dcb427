"""Design of a study: factors, and the case at each point."""

from __future__ import annotations

import copy
import json
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any, get_args

import numpy as np

from jointfrf.choices import Arrangement
from jointfrf.errors import FileContentError
from jointfrf.kernel.arguments import as_names, check_choice, check_type, one_line
from jointfrf.spelling import did_you_mean, some_of
from jointfrf.toml.declared import read_keys
from jointfrf.toml.table import TomlTable, read_toml
from jointfrf.workbench.cases.catalogue import read_case_of
from jointfrf.workbench.cases.keys import Case, StudyKeys
from jointfrf.workbench.cases.kind import CaseKind, Estimator, Pollution, StudyChoice

__all__ = [
    "Arrangement",
    "FactorValue",
    "StudyDesign",
    "StudyPoint",
    "as_text_of",
    "factor_label",
    "in_words",
    "parse_factor",
]

#: Value of a factor: the kinds of a TOML value.
FactorValue = float | int | str | bool
#: A point of a design: factor to value.
StudyPoint = Mapping[str, FactorValue]
#: Factors with special names, and the keys that they set if the case has them. With a * the values are multipliers.
_NAMED = {
    "noise": ("noise.level", "measured.noise"),
    "spacing": ("frequency.step",),
    "lines": ("frequency.step",),
    "stiffness": ("joint.stiffness*", "law.actual.k*", "law.actual.k_m*", "law.actual.k_a*"),
    "damping": ("joint.damping*", "law.actual.c*", "law.actual.h*"),
}
#: Units of factors, for tables and axes.
_UNITS = {"spacing": "Hz", "frequency.step": "Hz", "frequency.first": "Hz", "frequency.last": "Hz"}
#: One step of a key of a case file: a name, and a number in brackets.
_STEP = re.compile(r"([^.\[\]]+)((?:\[\d+\])?)")


@dataclass(frozen=True)
class StudyDesign:
    """Factors, noises and estimators of a study.

    Attributes
    ----------
    factors : mapping of str to sequence
        Values of each factor, by its name. The name is one of:

        - ``"noise"``: level;
        - ``"spacing"``: distance of the lines, Hz;
        - ``"lines"``: number of lines over the same range;
        - ``"stiffness"``, ``"damping"``: multiplier of the values of the joint;
        - a key of `case.toml`, such as ``"frequency.last"``, ``"joint.stiffness"`` (all DOFs), ``"joint[0].stiffness"``
          or ``"noise.kind"``. With a * at its end the values are multipliers of the value in the file.
    arrangement : {"full", "one-at-a-time"}
        Arrangement of the points: every combination of values (default), or one factor at a time, with other factors
        as in the case.
    noises : sequence of str
        Names of noises of the case. The default is all noises, or the first noise if a factor sets the level.
    estimators : sequence of str, or mapping of str to callable
        Names of estimators of the kind of case, default the estimators in the case. A function takes lines in Hz, FRFs
        at the joint DOFs j, then k, in m/N, and names of the joint DOFs, and returns stiffness of all DOFs, then
        damping. A mapping can contain names and functions (``{"ismm": None, "mine": function}``).
    own_noises : mapping of str to callable
        Functions that replace the noises of the case: from exact FRFs, seed and number of the realisation to FRFs with
        noise.

    Raises
    ------
    ValueError
        A factor without values, the same value twice, an unknown arrangement.
    TypeError
        Not a mapping of names to values, invalid names, an estimator or a noise that is not a function.

    Examples
    --------
    >>> import jointfrf as jf
    >>> design = jf.StudyDesign({"noise": [0.01, 0.05], "lines": [50, 200]})
    >>> [dict(point) for point in design.points][1]
    {'noise': 0.01, 'lines': 200}
    """

    factors: Mapping[str, Sequence[FactorValue]] = field(default_factory=dict)
    arrangement: Arrangement = "full"
    noises: Sequence[str] = ()
    estimators: Sequence[str] | Mapping[str, Estimator | None] = ()
    own_noises: Mapping[str, Pollution] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check factors and the types of other fields; names are checked with the case."""
        check_choice("arrangement", self.arrangement, get_args(Arrangement))
        check_type("factors", self.factors, Mapping)
        as_names("factors", self.factors)
        object.__setattr__(self, "factors", {name: _values_of(name, each) for name, each in self.factors.items()})
        as_names("noises", self.noises)
        as_names("estimators", self.estimators)
        if isinstance(self.estimators, Mapping):
            _check_functions("estimators", {key: own for key, own in self.estimators.items() if own is not None})
        check_type("own_noises", self.own_noises, Mapping)
        as_names("own_noises", self.own_noises)
        _check_functions("own_noises", self.own_noises)

    @classmethod
    def of_case(cls, folder: Path) -> StudyDesign:
        """Return the design in the file of a case; without one, a design without factors."""
        keys = read_keys(read_toml(folder / "case.toml").table("study"), StudyKeys)
        return keys.build(lambda: cls(keys.factors, keys.arrangement, keys.noises, keys.estimators))

    @property
    def points(self) -> list[StudyPoint]:
        """Points of the design: value by factor; a single empty point without factors."""
        if self.arrangement == "one-at-a-time" and self.factors:
            return [{name: value} for name, values in self.factors.items() for value in values]
        return [dict(zip(self.factors, values, strict=True)) for values in product(*self.factors.values())]

    @property
    def choice(self) -> StudyChoice:
        """Noises and estimators of the study."""
        own: dict[str, Estimator] = {}
        if isinstance(self.estimators, Mapping):
            own = {name: one for name, one in self.estimators.items() if one is not None}
        words = tuple(name for name in self.estimators if name not in own)
        return StudyChoice(tuple(self.noises), words, own, dict(self.own_noises))

    def cases(self, folder: Path) -> Iterator[tuple[StudyPoint, Case, CaseKind[Any, Any, Any]]]:
        """Read the case of each point.

        Raises
        ------
        FileContentError
            The case does not have a key, or rejects a value.
        """
        content = read_toml(folder / "case.toml").content
        for point in self.points:
            where = str(folder / "case.toml")
            if point:
                where += f" with {in_words(point)}"
            table = TomlTable(_changed(content, point, where, bool(self.noises)), where, folder)
            yield point, *read_case_of(folder, table, TomlTable({}, ""))

    def identity(self, folder: Path) -> dict[str, Any]:
        """Return the fields that identify this study: content of the case file, and the design."""
        choice = self.choice
        return {
            "case": read_toml(folder / "case.toml").content,
            "factors": {name: list(values) for name, values in self.factors.items()},
            "arrangement": self.arrangement,
            "noises": list(choice.noises) + list(choice.own_noises),
            "estimators": list(choice.estimators) + list(choice.own_estimators),
        }


def _values_of(name: str, values: Any) -> list[FactorValue]:
    """Return the values of a factor as values of a case file."""
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise TypeError(f"factor {name!r} is {one_line(values)}; give a list of values")
    found = [value.item() if isinstance(value, np.generic) else value for value in values]
    if not found:
        raise ValueError(f"factor {name!r} has no values; give at least one")
    for value in found:
        if not isinstance(value, FactorValue):
            raise TypeError(f"factor {name!r} has the value {one_line(value)}; give numbers or words")
    if len({repr(value) for value in found}) < len(found):
        raise ValueError(f"factor {name!r} has a value twice: {some_of(found, 12)}; give each value once")
    return found


def _check_functions(name: str, functions: Mapping[str, object]) -> None:
    for key, each in functions.items():
        if not callable(each):
            raise TypeError(f"{name}: {key!r} is {one_line(each)}; give a function")


def in_words(point: StudyPoint) -> str:
    """Return a point as text: `noise = 0.05, lines = 200`."""
    return ", ".join(f"{name} = {value}" for name, value in point.items())


def factor_label(name: str) -> str:
    """Return a factor and its unit, as the label of an axis or a column."""
    if name in ("stiffness", "damping") or name.endswith("*"):
        return f"{name.removesuffix('*')}, times that of the case"
    if name == "noise":
        return "noise level"
    return f"{name}, {_UNITS[name]}" if name in _UNITS else "number of lines" if name == "lines" else name


def parse_factor(word: str) -> tuple[str, list[FactorValue]]:
    """Read a factor of the command line, `noise=0.01,0.05` or `joint.stiffness*=0.1,1,10`.

    Raises
    ------
    ValueError
        The word has no =, or an empty name or value.
    """
    name, equals, values = word.partition("=")
    if not equals or not name.strip() or not values.strip():
        raise ValueError(f"{word!r} is no factor; write NAME=VALUE,VALUE,...")
    return name.strip(), [_value(one.strip()) for one in values.split(",")]


def _value(text: str) -> FactorValue:
    """Return a value read as TOML, or the text if it is no TOML value."""
    try:
        found = tomllib.loads(f"v = {text}")["v"]
    except tomllib.TOMLDecodeError:
        return text
    return found if isinstance(found, FactorValue) else text


def _changed(content: dict[str, Any], point: StudyPoint, where: str, are_noises_named: bool) -> dict[str, Any]:
    """Return the content of a case file with the values of a point."""
    changed = copy.deepcopy(content)
    for name, value in point.items():
        is_level = name in ("noise", "noise.level") and "noise" in changed and not are_noises_named
        if is_level:
            changed["noise"] = changed["noise"][:1]
        keys = _NAMED.get(name, (name,))
        number = _spacing_of(changed, value, where) if name == "lines" else value
        if not sum(_set(changed, key, number, where) for key in keys):
            hint = did_you_mean(name, _NAMED)
            raise FileContentError(f"{where}: unknown factor {name!r}{hint or '; name a key of the case'}")
        if is_level:  # the name in the file states another level
            changed["noise"][0]["name"] = str(changed["noise"][0].get("kind", "noise"))
    return changed


def _spacing_of(content: dict[str, Any], lines: FactorValue, where: str) -> float:
    """Return the spacing for a number of lines between the first and the last line."""
    frequency = content.get("frequency", {})
    if not isinstance(lines, int) or lines < 2:
        raise FileContentError(f"{where}: lines is {one_line(lines)}; give a whole number, at least 2")
    try:
        return float((frequency["last"] - frequency["first"]) / (lines - 1))
    except (KeyError, TypeError) as error:
        raise FileContentError(f"{where}: [frequency] has no first and last for the factor lines; set both") from error


def _set(content: dict[str, Any], key: str, value: FactorValue, where: str) -> int:
    """Set a key in all its tables, and return their number."""
    steps = _STEP.findall(key.removesuffix("*"))
    if ".".join(name + at for name, at in steps) != key.removesuffix("*"):
        raise FileContentError(f"{where}: {key!r} is no key; write one such as joint.stiffness or joint[0].stiffness")
    tables: list[Any] = [content]
    for name, at in steps[:-1]:
        inner = [table[name] for table in tables if isinstance(table, dict) and name in table]
        tables = [one for each in inner for one in (each if isinstance(each, list) else [each])]
        if at:
            tables = tables[int(at[1:-1]) : int(at[1:-1]) + 1]
    last = steps[-1][0]
    change = _scaled if key.endswith("*") else _replaced
    return sum(change(table, last, value, where) for table in tables if isinstance(table, dict))


def _replaced(table: dict[str, Any], name: str, value: FactorValue, where: str) -> bool:
    if name not in table:
        return False
    table[name] = value
    return True


def _scaled(table: dict[str, Any], name: str, value: FactorValue, where: str) -> bool:
    if name not in table:
        return False
    if isinstance(value, str | bool) or not isinstance(table[name], int | float):
        raise FileContentError(
            f"{where}: {name} = {one_line(table[name])} cannot be multiplied by {one_line(value)}; leave out the *"
        )
    table[name] = table[name] * value
    return True


def as_text_of(identity: Mapping[str, Any]) -> str:
    """Return the fields that identify a study as text that does not depend on the order of keys."""
    return json.dumps(identity, sort_keys=True, default=str)
