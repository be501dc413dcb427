"""Documents from declared keys: a reference in Markdown, a template with comments, a JSON Schema for editors."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

import msgspec

from jointfrf.toml.declared import DeclaredKey, Keys, keys_of

__all__ = ["key_reference", "key_template", "schema_of"]

#: Column of the comments in a template.
_COMMENT = 34
#: Size above which numbers have an exponent.
_LARGE = 1e6


def key_reference(tops: Mapping[str, type[Keys]]) -> str:
    """Return the reference of the keys of several files, by their headings, as Markdown; a shared table once."""
    parts: list[str] = []
    shown: list[type[Keys]] = []
    for heading, top in tops.items():
        parts.append(f"## {heading}\n\n{_filled(_about(top))}\n\n{_rows(top)}")
        as_above = []
        for header, table in _inner_tables(top):
            if table in shown:
                as_above.append(f"`{header}`")
                continue
            shown.append(table)
            parts.append(f"### {header}\n\n{_filled(_about(table))}\n\n{_rows(table)}")
        if as_above:
            parts.append(_filled(f"As above: {', '.join(as_above)}.") + "\n")
    return "\n".join(parts)


def _inner_tables(top: type[Keys], inside: str = "") -> Iterator[tuple[str, type[Keys]]]:
    """Yield all tables inside another, each once, with their names in a file."""
    found: dict[type[Keys], list[str]] = {}
    for one in keys_of(top).keys:
        name = one.name if inside else f"[[{one.name}]]" if one.is_array else f"[{one.name}]"
        for table in one.tables:
            found.setdefault(table, []).append(name)
    for table, names in found.items():
        declared = keys_of(table)
        tagged = f' with {declared.tag_name} = "{declared.tag}"' if declared.tag_name else ""
        yield table.header or ", ".join(names) + (f", in {inside}" if inside else "") + tagged, table
        yield from _inner_tables(table, names[0] + tagged)


def _about(table: type[Keys]) -> str:
    return " ".join((table.__doc__ or "").split())


def _filled(text: str) -> str:
    """Return a paragraph filled to the line width of other documents."""
    return textwrap.fill(text, 120, break_long_words=False, break_on_hyphens=False)


def _rows(table: type[Keys]) -> str:
    declared = keys_of(table)
    rows: list[tuple[str, ...]] = [("key", "value", "unit", "if absent", "meaning"), ("---",) * 5]
    if declared.tag_name:
        rows.append(
            (f"`{declared.tag_name}`", f'`"{declared.tag}"`', "", table.tag_absent or "required", "Kind of the table.")
        )
    for one in declared.keys:
        names = ", ".join(f"`{name}`" for name in one.shown.split(", "))
        rows.append((names, one.takes, one.unit, one.absent or "required", one.meaning))
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def key_template(top: type[Keys], first_line: str = "", examples: Mapping[str, Any] | None = None) -> str:
    """Return a file with the examples of all required keys, and optional ones as comments, each with its meaning.

    Parameters
    ----------
    top : type
        Keys of the file.
    first_line : str
        First line of the file.
    examples : mapping, optional
        Values of inner tables, by their names; by default the examples of `top`.
    """
    given = top.examples if examples is None else examples
    declared = keys_of(top)
    lines = [first_line] if first_line else []
    lines += [f"# {_about(top)}", ""]
    if declared.tag_name:
        lines.append(f'{declared.tag_name} = "{declared.tag}"')
    lines += [_line(*each) for each in _values(top, {})]
    for one in declared.keys:
        if one.tables:
            lines += ["" if each is None else _line(*each) for each in _tables(one, given.get(one.name))]
    return "\n".join(lines) + "\n"


def _tables(one: DeclaredKey, given: Any) -> Iterator[tuple[str, str] | None]:
    """Yield the lines of a table, or of an array of tables, each code and comment; an optional one is all comment."""
    example = one.example if given is None else given
    mark = "" if one.is_required or example is not None else "# "
    for number, own in enumerate(example if isinstance(example, list) else [example or {}]):
        table = next((each for each in one.tables if keys_of(each).tag == own.get("model")), one.tables[0])
        declared, header = keys_of(table), f"[[{one.name}]]" if one.is_array else f"[{one.name}]"
        yield None
        yield mark + header, "" if number else _first_sentence(_about(table))
        if declared.tag_name:
            others = ", ".join(keys_of(each).tag for each in one.tables if each is not table)
            yield f'{mark}{declared.tag_name} = "{declared.tag}"', f"or {others}"
        for code, comment in _values(table, own, not number):
            yield (mark + code.removeprefix("# ") if mark else code), comment


def _values(table: type[Keys], example: Mapping[str, Any], with_meaning: bool = True) -> Iterator[tuple[str, str]]:
    """Yield code and comment for each value of a table."""
    declared = keys_of(table)
    for one in declared.keys:
        if one.tables:
            continue
        if one.pattern:
            given = {name: value for name, value in example.items() if name not in declared.names}
            lines = [f"{name} = {_written(value)}" for name, value in given.items()]
            lines = lines or [f"# {form} = ..." for form in one.pattern.split(", ")]
            yield from ((line, "" if at else _meaning(one)) for at, line in enumerate(lines))
            continue
        value = example.get(one.name, one.example)
        if value is not None:
            yield f"{one.name} = {_written(value)}", _meaning(one) if with_meaning else ""
        elif with_meaning:
            yield f"# {one.name} = {_default(one)}", _meaning(one)


def _default(one: DeclaredKey) -> str:
    return _written(one.default) if isinstance(one.default, bool | int | float | str) else "..."


def _first_sentence(text: str) -> str:
    return text.split(". ")[0].removesuffix(".").replace("`", "")


def _meaning(one: DeclaredKey) -> str:
    parts = [one.meaning if one.meaning.endswith("...") else one.meaning.removesuffix(".")]
    parts += [one.unit] if one.unit else []
    parts += [one.takes] if one.takes.startswith(("one of", "list of `")) and "low" not in one.takes else []
    if one.absent and one.default in (None, (), {}, ""):
        parts.append(one.absent if one.absent.startswith("required") else f"if absent: {one.absent}")
    return "; ".join(parts).replace("`", "")


def _line(code: str, comment: str) -> str:
    return f"{code.ljust(_COMMENT)}  # {comment}" if comment else code


def _written(value: Any) -> str:
    """Return a value in TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{_key(name)} = {_written(each)}" for name, each in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_written, value)) + "]"
    if isinstance(value, float):
        return f"{value:g}" if abs(value) >= _LARGE and float(f"{value:g}") == value else repr(value)
    return json.dumps(value, ensure_ascii=False)


def _key(name: str) -> str:
    return name if name.replace("_", "").replace("-", "").isalnum() else json.dumps(name)


def schema_of(top: type[Keys]) -> dict[str, Any]:
    """Return the JSON Schema of a file, with which editors complete and check it."""
    schema: dict[str, Any] = msgspec.json.schema(top)
    defined = {one.__name__: one for one in (top, *(table for _, table in _inner_tables(top)))}
    for name, content in schema["$defs"].items():
        if name in defined:
            _complete(content, defined[name])
    # TOML has no null.
    found: dict[str, Any] = _without_null(schema)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **found}


def _complete(content: dict[str, Any], table: type[Keys]) -> None:
    """Add rules beyond the types: choices of texts, keys of a free form, a kind that need not be named."""
    if table.tag_absent:
        content["required"].remove(keys_of(table).tag_name)
    for one in keys_of(table).keys:
        own = content["properties"][one.name]
        if one.choice:
            (own.get("items") or next(iter(own.get("anyOf", [])), own))["enum"] = list(one.choice)
        if one.pattern:
            forms = "|".join(form.removesuffix("DOF") for form in one.pattern.split(", "))
            content["patternProperties"] = {f"^({forms}).+$": own["additionalProperties"]}
            del content["properties"][one.name]


def _without_null(content: Any) -> Any:
    if isinstance(content, list):
        return [_without_null(one) for one in content]
    if not isinstance(content, dict):
        return content
    kept = {name: _without_null(one) for name, one in content.items() if not (name == "default" and one is None)}
    choices = kept.get("anyOf")
    if isinstance(choices, list) and {"type": "null"} in choices:
        others = [one for one in choices if one != {"type": "null"}]
        del kept["anyOf"]
        kept |= others[0] if len(others) == 1 else {"anyOf": others}
    return kept
