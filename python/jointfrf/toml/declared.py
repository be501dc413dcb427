"""Keys of a TOML table declared as a typed class: a missing, unknown or wrong key is one sentence."""

from __future__ import annotations

import sys
import types
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import (
    Annotated,
    Any,
    ClassVar,
    Literal,
    TypeVar,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

import msgspec

from jointfrf.errors import FileContentError
from jointfrf.spelling import did_you_mean
from jointfrf.toml.table import TomlTable, missing_in_words

__all__ = ["Bands", "Declared", "DeclaredKey", "Keys", "NotNegative", "Positive", "key", "keys_of", "read_keys"]

_T = TypeVar("_T")
_K = TypeVar("_K", bound="Keys")

#: Continuations of a sentence about a value: "must be three numbers", "must be a number".
_NO_ARTICLE = ("one", "true", "the", "three")
Positive = Annotated[float, msgspec.Meta(gt=0)]
NotNegative = Annotated[float, msgspec.Meta(ge=0)]


def key(
    meaning: str,
    unit: str = "",
    *,
    takes: str = "",
    absent: str = "",
    choice: Collection[str] = (),
    pattern: str = "",
    holds: Callable[[Any], bool] | None = None,
    example: Any = None,
    **limits: Any,
) -> msgspec.Meta:
    """Declare the meaning and form of a key.

    Parameters
    ----------
    meaning : str
        Meaning in a few words.
    unit : str
        Unit; empty for pure numbers and texts.
    takes : str
        Form of the value, if the type does not determine it.
    absent : str
        Consequence of an absent key, if the default does not show it.
    choice : collection of str
        Texts that it accepts, or that a list of it accepts, if the type does not list them.
    pattern : str
        Form of the names of a mapping, which contains all keys of the table that no other key names. ``DOF`` is any
        text.
    holds : callable, optional
        Condition on the value beyond its type; `takes` describes it.
    example : object
        Value for templates, or a mapping from inner keys to values.
    **limits
        Limits of `msgspec.Meta`: ``gt``, ``ge``, ``le``, ``min_length``.
    """
    facts = {"unit": unit, "takes": takes, "absent": absent, "choice": choice, "pattern": pattern,
            "holds": holds, "example": example}  # fmt: skip
    text = f"{meaning} Unit: {unit}." if unit else meaning
    return msgspec.Meta(description=text, extra={"meaning": meaning, **facts}, **limits)


def _rises(bands: Any) -> bool:
    return all(low <= high for low, high in bands)


#: Bands [[low, high], ...], Hz.
Bands = Annotated[
    tuple[tuple[NotNegative, NotNegative], ...],
    msgspec.Meta(min_length=1, extra={"takes": "list of bands `[low, high]` in Hz", "holds": _rises}),
]


class _KeysType(msgspec.StructMeta):
    """The type of declared tables: required keys may follow optional ones in subclasses, too."""

    def __new__(mcs, *parts: Any, **options: Any) -> Any:
        return super().__new__(mcs, *parts, **{"kw_only": True, **options})


# The same declaration for type checkers.
@dataclass_transform(kw_only_default=True, frozen_default=True, field_specifiers=(msgspec.field,))
class Keys(msgspec.Struct, metaclass=_KeysType, frozen=True, forbid_unknown_fields=True, dict=True):
    """Keys of a table; the docstring of a subclass describes the table."""

    #: Heading in the reference, if it differs from its name.
    header: ClassVar[str] = ""
    #: Consequence of an absent key that distinguishes tables; empty if it is required.
    tag_absent: ClassVar[str] = ""
    #: Values of inner tables for templates, by their names.
    examples: ClassVar[Mapping[str, Any]] = {}

    @property
    def table(self) -> TomlTable:
        """Table from which the keys were read; empty for keys that another process has sent."""
        return self.__dict__.get("table_read") or TomlTable({}, type(self).__name__)

    def error(self, name: str, must: str) -> FileContentError:
        """Return the exception for a value of the wrong form."""
        return self.table.error(name, must)

    def wrong(self, name: str, why: str) -> FileContentError:
        """Return the exception for a wrong object that a key names."""
        return self.table.wrong(name, why)

    def missing(self, names: Collection[str], why: str = "") -> FileContentError:
        """Return the exception for missing keys, with the reason why they are needed."""
        return self.table.missing(list(names), why)

    def build(self, builder: Callable[[], _T], name: str = "") -> _T:
        """Call a builder; if it raises an error, the message names the table and, if given, the key."""
        return self.table.build(builder, name)

    def file_of(self, name: str) -> Path:
        """Return the path of the file that a key names."""
        return self.table.file(name)


@dataclass(frozen=True)
class DeclaredKey:
    """A key of a table.

    Attributes
    ----------
    name, attribute : str
        Names in the file and of the attribute.
    kind : type
        Type of the value, or of the elements of an array of tables.
    tables : tuple of type
        Subclasses of `Keys`: the named table, several that a tag distinguishes, or none.
    is_array : bool
        Whether it names an array of tables.
    meaning, unit : str
        Meaning and unit.
    takes : str
        Form of the value.
    absent : str
        Consequence of an absent key; empty if it is required.
    choice : collection of str
        Accepted texts.
    pattern : str
        Form of the names of a mapping.
    holds : callable or None
        Condition on the value.
    example, default : object
        Value for templates, and default value.
    """

    name: str
    attribute: str
    kind: Any
    tables: tuple[type[Keys], ...]
    is_array: bool
    meaning: str
    unit: str
    takes: str
    absent: str
    choice: Collection[str]
    pattern: str
    holds: Callable[[Any], bool] | None
    example: Any
    default: Any

    @property
    def is_required(self) -> bool:
        """Whether the table must have it."""
        return self.default is msgspec.NODEFAULT

    @property
    def shown(self) -> str:
        """Name in messages and documents."""
        return self.pattern or self.name


@dataclass(frozen=True)
class Declared:
    """Keys of a table, and the key that distinguishes it from other tables in its place."""

    kind: type[Keys]
    tag_name: str
    tag: str
    keys: tuple[DeclaredKey, ...]

    @property
    def names(self) -> list[str]:
        """Names of all keys, the distinguishing one first."""
        return ([self.tag_name] if self.tag_name else []) + [one.shown for one in self.keys]

    @property
    def rest(self) -> DeclaredKey | None:
        """Key for all keys that no other one names."""
        return next((one for one in self.keys if one.pattern), None)


@lru_cache(None)
def keys_of(kind: type[Keys]) -> Declared:
    """Return the keys that a class declares."""
    hints = get_type_hints(kind, include_extras=True)
    config = kind.__struct_config__
    fields = msgspec.structs.fields(kind)
    found = tuple(_declared(one.encode_name, one.name, hints[one.name], _default(one)) for one in fields)
    return Declared(kind, config.tag_field or "", str(config.tag or ""), found)


def _default(one: msgspec.structs.FieldInfo) -> Any:
    return one.default_factory() if one.default_factory is not msgspec.NODEFAULT else one.default


def _declared(name: str, attribute: str, hint: Any, default: Any) -> DeclaredKey:
    facts: dict[str, Any] = {}
    limits: dict[str, float] = {}
    inner = _plain(hint, facts, limits)
    if facts.get("pattern"):  # the facts are valid for each value
        facts = {**facts, **{k: v for k, v in _facts(get_args(inner)[1]).items() if not facts.get(k)}}
    is_array = get_origin(inner) is tuple and get_args(inner)[-1] is Ellipsis and bool(_tables(get_args(inner)[0]))
    tables = _tables(get_args(inner)[0] if is_array else inner)
    takes = facts.get("takes") or ("tables" if is_array else "table" if tables else _takes(inner, facts, limits))
    absent = facts.get("absent") or ("" if default is msgspec.NODEFAULT else _shown(default))
    return DeclaredKey(
        name, attribute, hint, tables, is_array, facts.get("meaning", ""), facts.get("unit", ""), takes, absent,
        facts.get("choice", ()), facts.get("pattern", ""), facts.get("holds"), facts.get("example"), default,
    )  # fmt: skip


def _plain(hint: Any, facts: dict[str, Any], limits: dict[str, float]) -> Any:
    """Return a type without None and without its annotations, which go into `facts` and `limits`."""
    while True:
        if get_origin(hint) is Annotated:
            for meta in hint.__metadata__:
                facts.update({k: v for k, v in (meta.extra or {}).items() if v or k not in facts})
                limits.update({k: v for k in ("gt", "ge", "le") if (v := getattr(meta, k)) is not None})
            hint = hint.__origin__
        elif get_origin(hint) in (Union, types.UnionType) and type(None) in get_args(hint):
            rest = tuple(one for one in get_args(hint) if one is not type(None))
            hint = rest[0] if len(rest) == 1 else Union[rest]  # noqa: UP007
        else:
            return hint


def _facts(hint: Any) -> dict[str, Any]:
    found: dict[str, Any] = {}
    _plain(hint, found, {})
    return found


def _tables(hint: Any) -> tuple[type[Keys], ...]:
    each = get_args(hint) if get_origin(hint) in (Union, types.UnionType) else (hint,)
    return each if all(isinstance(one, type) and issubclass(one, Keys) for one in each) else ()


def _takes(hint: Any, facts: dict[str, Any], limits: dict[str, float]) -> str:
    """Return the form of a value of a type in words."""
    if get_origin(hint) is Literal or (hint is str and facts.get("choice")):
        return "one of " + ", ".join(f"`{word}`" for word in get_args(hint) or facts["choice"])
    if get_origin(hint) is tuple:
        first, *others = get_args(hint)
        words = facts.get("choice") or get_args(_plain(first, {}, {}))
        many = "s" if others == [Ellipsis] else ""
        count = "list of " if many else f"list of {1 + len(others)} "
        if words:
            return count + ("" if many else "of ") + ", ".join(f"`{word}`" for word in words)
        return count + {float: "numbers", str: "texts"}[_plain(first, {}, {})]
    if get_origin(hint) is dict:
        return "table of " + {float: "numbers", str: "texts"}.get(_plain(get_args(hint)[1], {}, {}), "lists")
    if get_origin(hint) in (Union, types.UnionType):
        return ", or ".join(_takes(one, facts, limits) for one in get_args(hint))
    word = {float: "number", int: "whole number", str: "text", bool: "true or false"}[hint]
    bounds = {"gt": "above", "ge": "at least", "le": "at most"}
    return word + "".join(f", {bounds[name]} {value:g}" for name, value in limits.items())


def _shown(default: Any) -> str:
    if isinstance(default, bool):
        return f"`{str(default).lower()}`"
    if isinstance(default, tuple):
        return f"`[{', '.join(map(repr, default))}]`".replace("'", '"') if default else "none"
    return "none" if default is None or default == {} else f"`{default}`"


@dataclass
class _Findings:
    """Errors in a file: unknown keys, missing ones by table, values."""

    unknown: list[FileContentError] = field(default_factory=list)
    missing: dict[str, list[str]] = field(default_factory=dict)
    wrong: list[FileContentError] = field(default_factory=list)

    def check(self, where: str) -> None:
        """Raise an error if there are findings: all missing keys at once, else the first finding."""
        if self.unknown:
            raise self.unknown[0]
        if self.missing:
            parts = [f"{place.removeprefix(where)}: {missing_in_words(names)}" for place, names in self.missing.items()]
            raise FileContentError(where + "; ".join(part.removeprefix(": ") if i else part
                                                     for i, part in enumerate(parts)))  # fmt: skip
        if self.wrong:
            raise self.wrong[0]


def read_keys(table: TomlTable, *kinds: type[_K]) -> _K:
    """Return the keys of a table, of one kind, or of one of several kinds that a tag distinguishes.

    Raises
    ------
    FileContentError
        There is an unknown key, keys are missing (the message names all), or a value has the wrong form.
    """
    findings = _Findings()
    found = _read(table, kinds, findings)
    findings.check(table.where)
    assert found is not None
    return found


def _read(table: TomlTable, kinds: tuple[type[_K], ...], findings: _Findings) -> _K | None:
    declared = _chosen(table, kinds, findings)
    if declared is None:
        return None
    known, rest = {one.name: one for one in declared.keys if not one.pattern}, declared.rest
    values: dict[str, Any] = {}
    others: dict[str, Any] = {}
    for name in table.content:
        if name in known:
            values[known[name].attribute] = _value(table, known[name], name, findings)
        elif rest is not None and _matches(rest.pattern, name):
            others[name] = _leaf(table, rest, get_args(_plain(rest.kind, {}, {}))[1], name, findings)
        elif name != declared.tag_name:
            findings.unknown.append(table.unknown(name, declared.names))
    for one in known.values():
        if one.is_required and one.name not in table.content:
            findings.missing.setdefault(table.where, []).append(repr(one.name) + _inside(one))
    if findings.unknown or findings.missing or findings.wrong:
        return None
    if rest is not None:
        values[rest.attribute] = others
    made = declared.kind(**values)
    made.__dict__["table_read"] = table
    return made  # type: ignore[return-value]


def _chosen(table: TomlTable, kinds: tuple[type[Keys], ...], findings: _Findings) -> Declared | None:
    """Return the keys that a table must have, by its tag if there are several."""
    declared = [keys_of(kind) for kind in kinds]
    if len(declared) == 1:
        return declared[0]
    name, tags = declared[0].tag_name, [one.tag for one in declared]
    if name not in table.content:
        findings.missing.setdefault(table.where, []).append(repr(name))
        return None
    if table.content[name] not in tags:
        findings.wrong.append(table.error(name, f"one of {', '.join(tags)}"))
        return None
    return declared[tags.index(table.content[name])]


def _inside(one: DeclaredKey) -> str:
    """Return a text on the keys that a missing table needs."""
    if not one.tables:
        return ""
    declared = keys_of(one.tables[0])
    several = len(one.tables) > 1
    needed = [declared.tag_name] if several else [inner.name for inner in declared.keys if inner.is_required]
    form = f"[[{one.name}]]" if one.is_array else f"[{one.name}]"
    return f" (a table {form} with {', '.join(needed)})" if needed else f" (a table {form})"


def _matches(pattern: str, name: str) -> bool:
    """Return whether a key has one of several forms: ``k_DOF, c_DOF``."""
    return any(name.startswith(form.removesuffix("DOF")) and len(name) >= len(form) - 2 for form in pattern.split(", "))


def _value(table: TomlTable, one: DeclaredKey, name: str, findings: _Findings) -> Any:
    value = table.content[name]
    if one.is_array:
        try:
            inners = table.tables(name)
        except FileContentError as error:
            findings.wrong.append(error)
            return None
        return tuple(_read(inner, one.tables, findings) for inner in inners)
    if one.tables or get_origin(_plain(one.kind, {}, {})) is dict:
        try:
            inner = table.table(name)
        except FileContentError as error:
            findings.wrong.append(error)
            return None
        if one.tables:
            return _read(inner, one.tables, findings)
        hint = get_args(_plain(one.kind, {}, {}))[1]
        return {
            each: _leaf(inner, _declared(each, each, hint, msgspec.NODEFAULT), hint, each, findings) for each in value
        }
    return _leaf(table, one, one.kind, name, findings)


def _leaf(table: TomlTable, one: DeclaredKey, hint: Any, name: str, findings: _Findings) -> Any:
    """Return a value that is no table."""
    value = table.content[name]
    try:
        if not _is_finite(value):
            raise ValueError
        found = msgspec.convert(value, hint)
        chosen = found if isinstance(found, tuple) else (found,)
        if (one.choice and any(word not in one.choice for word in chosen)) or not (
            one.holds is None or one.holds(found)
        ):
            raise ValueError
        return found
    except ValueError:  # including errors of msgspec
        article = {"name": "the "}.get(first := one.takes.partition(" ")[0], "" if first in _NO_ARTICLE else "a ")
        words = one.choice or tuple(word for word in get_args(_plain(hint, {}, {})) if isinstance(word, str))
        similar = did_you_mean(value, words) if isinstance(value, str) else ""
        findings.wrong.append(table.error(name, article + one.takes.replace("`", ""), similar))
        return None


def _is_finite(value: Any) -> bool:
    """Return whether all numbers of a value are finite; a whole number in TOML may have any number of digits."""
    if isinstance(value, list):
        return all(map(_is_finite, value))
    return not isinstance(value, int | float) or abs(value) <= sys.float_info.max
