"""All regular expressions of the package, found in its sources, and texts that take them longest."""

from __future__ import annotations

import ast
import importlib
import itertools
import re
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from re import _constants as codes  # type: ignore[attr-defined]
from re import _parser as parser  # type: ignore[attr-defined]
from types import ModuleType
from typing import Any

import jointfrf

__all__ = ["Expression", "expressions", "seconds", "slowest"]

_ROOT = Path(jointfrf.__file__).parent
_FUNCTIONS = ("compile", "match", "search", "fullmatch", "sub", "subn", "findall", "finditer", "split")
_METHODS = ("match", "search", "fullmatch")
#: A character of each category.
_CATEGORIES = {
    codes.CATEGORY_DIGIT: "1", codes.CATEGORY_SPACE: " ", codes.CATEGORY_WORD: "a", codes.CATEGORY_NOT_DIGIT: "a",
    codes.CATEGORY_NOT_SPACE: "a", codes.CATEGORY_NOT_WORD: "/",
}  # fmt: skip
#: Repeated of every expression, whatever it mentions.
_USUAL = " \t1aA[](){}/.-,:_\"'<=*"


@dataclass(frozen=True)
class Expression:
    """A regular expression, where it stands, and the methods by which it is used."""

    where: str
    pattern: re.Pattern[Any]
    methods: tuple[str, ...]


def expressions() -> list[Expression]:
    """Return all; an expression that is not constant in its module is an error."""
    found: dict[tuple[str, Any, int], Expression] = {}
    for path in sorted(_ROOT.rglob("*.py")):
        name = ".".join(path.relative_to(_ROOT.parent).with_suffix("").parts).removesuffix(".__init__")
        tree = ast.parse(path.read_text(encoding="utf-8"))
        calls = [node for node in ast.walk(tree) if _is_call(node)]
        if not calls:
            continue
        module = importlib.import_module(name)
        held = list(_patterns(vars(module)))
        methods = _methods_by_name(tree)
        for call in calls:
            own = _evaluated(call, module)
            assert own is not None or held, f"{name}, line {call.lineno}: the expression is not constant"
            how = call.func.attr  # type: ignore[attr-defined]
            for each in [own] if own is not None else held:
                names = [key for key, value in vars(module).items() if isinstance(value, re.Pattern) and value == each]
                used = {how} if how != "compile" else {one for key in names for one in methods.get(key, ())}
                where = f"{name}, line {call.lineno}"
                found[name, each.pattern, each.flags] = Expression(where, each, tuple(used or {"search", "fullmatch"}))
    return list(found.values())


def _methods_by_name(tree: ast.AST) -> dict[str, set[str]]:
    """Return how the expressions of a module are used, by the names that they have."""
    found: dict[str, set[str]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.attr in _FUNCTIONS:
            found.setdefault(node.value.id, set()).add(node.attr)
    return found


def _is_call(node: ast.AST) -> bool:
    called = node.func if isinstance(node, ast.Call) else None
    is_own = isinstance(called, ast.Attribute) and isinstance(called.value, ast.Name) and called.value.id == "re"
    return is_own and called.attr in _FUNCTIONS  # type: ignore[union-attr]


def _evaluated(call: ast.AST, module: ModuleType) -> re.Pattern[Any] | None:
    """Return the expression of a call, as its module makes it; None where it comes from a loop."""
    assert isinstance(call, ast.Call)
    of_flags = {
        "compile": 1,
        "match": 2,
        "search": 2,
        "fullmatch": 2,
        "findall": 2,
        "finditer": 2,
        "split": 3,
        "sub": 4,
    }
    place = of_flags.get(call.func.attr, 9)  # type: ignore[attr-defined]
    flags = [one.value for one in call.keywords if one.arg == "flags"] + call.args[place : place + 1]
    try:
        pattern, *given = (
            eval(compile(ast.Expression(one), "", "eval"), vars(module)) for one in [call.args[0], *flags]
        )
    except NameError:
        return None
    return re.compile(pattern, *given)


def _patterns(value: Any) -> Iterator[re.Pattern[Any]]:
    if isinstance(value, re.Pattern):
        yield value
    elif isinstance(value, dict):
        for each in value.values():
            yield from _patterns(each)
    elif isinstance(value, tuple | list):
        for each in value:
            yield from _patterns(each)


def slowest(one: Expression, count: int) -> list[tuple[str, str, str]]:
    """Return texts (beginning, what is repeated, end), last those that take an expression longest at this length."""
    tree = parser.parse(one.pattern.pattern, one.pattern.flags)
    sample = "".join(_sample(tree))
    letters = "".join(dict.fromkeys([*_letters(tree), *_USUAL]))
    mentioned = "".join(dict.fromkeys(_letters(tree)))
    units = [*letters, *map("".join, itertools.permutations(mentioned[:6], 2)), sample]
    beginnings = dict.fromkeys(sample[:i] for i in range(min(len(sample), 12) + 1))
    texts = [
        (begin, unit, end) for begin in beginnings for unit in units if unit for end in ("", "\0", "!" + sample[-1:])
    ]
    return sorted(texts, key=lambda text: seconds(one, text, count))


def seconds(one: Expression, text: tuple[str, str, str], count: int) -> float:
    """Return the processor time, s, that an expression takes with a text of about so many characters."""
    begin, unit, end = text
    whole: Any = begin + unit * (count // len(unit)) + end
    if isinstance(one.pattern.pattern, bytes):
        whole = whole.encode("latin-1", "replace")
    start = time.process_time()
    for method in one.methods:
        if method in _METHODS:
            getattr(one.pattern, method)(whole)
        elif method in ("findall", "finditer", "sub", "subn", "split"):
            for _ in one.pattern.finditer(whole):
                pass
    return time.process_time() - start


def _letters(tree: Any) -> Iterator[str]:
    """Return a character of each literal, range and category of an expression."""
    for code, value in tree:
        if code in (codes.LITERAL, codes.NOT_LITERAL):
            yield chr(value)
        elif code is codes.RANGE:
            yield chr(value[0])
        elif code is codes.CATEGORY:
            yield _CATEGORIES[value]
        elif code is codes.IN:
            yield from _letters(value)
        else:
            for inside in _inside(value):
                yield from _letters(inside)


def _inside(value: Any) -> Iterator[Any]:
    if isinstance(value, parser.SubPattern):
        yield value
    elif isinstance(value, tuple | list):
        for each in value:
            yield from _inside(each)


def _sample(tree: Any) -> Iterator[str]:
    """Return the parts of a text that an expression is likely to match, each repeated as seldom as may be, but once."""
    for code, value in tree:
        if code is codes.LITERAL:
            yield chr(value)
        elif code is codes.NOT_LITERAL:
            yield "a" if chr(value) != "a" else "b"
        elif code is codes.ANY:
            yield "a"
        elif code is codes.IN:
            excluded = set(_letters(value)) if value[0][0] is codes.NEGATE else set()
            yield next(
                iter("".join(_letters(value)) if not excluded else [x for x in "a1 /" if x not in excluded]), "b"
            )
        elif code in (codes.MAX_REPEAT, codes.MIN_REPEAT, codes.POSSESSIVE_REPEAT):
            yield from list(_sample(value[2])) * max(value[0], 1)
        elif code is codes.BRANCH:
            yield from _sample(value[1][0])
        elif code in (codes.SUBPATTERN, codes.ATOMIC_GROUP):
            yield from _sample(value[-1] if code is codes.SUBPATTERN else value)
