"""Reads api.F90 by its conventions.

- Above a routine stand `!>` lines: prose, then each argument, `name, name   text`, the text after at least two blanks
  and continued on lines that begin with two. `as above` is the text common to all, in the module's head; `as in
  jf_NAME` that of another routine. An argument of the module's head may be left out.
- The text of an array says `shape (n, m)`, or `shape (n, m), or (m, n) with trans 'T'`, or `same shape` as the argument
  before it. Of an array declared `(*)` that is all there is; any other must be declared with this shape.
- A size that may be absent says `n, or 0 for no ...`, the room for a text how many characters `suffice`.
- A returned INFO is the last argument, the name in BIND(C) that of the routine with an underscore.
- `public :: jf_NAME_work` asks for the form in memory of the caller. jf_NAME has `line_info` and `rcond`, and one call
  whose last argument is `info`: the called routine takes `memory` after it.
- A constant `jf_NAME` takes the value of another one, which a further source declares with a number. A comment begins
  a group of constants.
- Preprocessor lines stand outside of declarations and within no statement.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

from generate.comments import Comments, Texts, split_comment
from generate.routines import Api, Argument, ConstantGroup, Routine
from generate.source import Source, Statement, split_list

TYPES = {
    "integer(ip)": "integer",
    "real(c_double)": "real",
    "complex(c_double_complex)": "complex",
    "character(kind=c_char)": "character",
}
#: What only keeps a shape's arithmetic from overflowing.
WIDE = re.compile(r"0_long \+ |1_long\*|\b(\d)_long|min\((\w+), \w+\)|max\(0_ip, (\w+)\)")
PARENTHESES = r"\(((?:[^()]|\([^()]*\))*)\)"
SHAPE_TEXT = re.compile(rf"\bshape {PARENTHESES}(?:, or {PARENTHESES} with trans 'T')?")
#: Arguments of a form in memory of the caller, before INFO: type, intent, shape. Their texts are in the module's head.
WORKSPACE: dict[str, tuple[str, str, tuple[str, ...]]] = {
    "work": ("complex", "inout", ("*",)),
    "lwork": ("integer", "in", ()),
    "iwork": ("integer", "inout", ("*",)),
    "liwork": ("integer", "in", ()),
}


def read_api(source: Source, others: Iterable[Source] = ()) -> Api:
    """Read the API as api.F90 declares and explains it; `others` declare the values of its constants."""
    statements = source.statements()
    start = next((s.line for s in statements if s.text.startswith("module ")), None)
    if start is None:
        raise source.error(1, "there is no module: write 'module jointfrf'")
    prose, head = split_comment(source.comment_above(start))
    comments = Comments(source, {name: text for name, (_, text) in head.items()})
    routines: dict[str, Routine] = {}
    for block in _routine_blocks(source, statements):
        routine, texts = _read_routine(source, block)
        if routine.name in routines:
            raise source.error(routine.line, f"{routine.name} stands twice")
        routines[routine.name], comments.routines[routine.name] = routine, texts
    for routine in routines.values():
        for argument in routine.arguments:
            argument.text = comments.text(routine.name, argument.name, routine.line)
            argument.line = comments.line(routine.name, argument.name, argument.line)
        _find_shapes(source, routine)
    public = []
    for line, name in _public_names(statements):
        public.append(routines.get(name) or _work_form(comments, routines.get(name.removesuffix("_work")), name, line))
    constants = _read_constants(source, statements, others)
    return Api(source, prose, comments.common, constants, public, _read_uses(source, statements))


def _routine_blocks(source: Source, statements: list[Statement]) -> list[list[Statement]]:
    """Return the statements of each routine jf_*."""
    blocks = []
    for first, statement in enumerate(statements):
        match = re.match(r"subroutine (jf_\w+)", statement.text)
        if match:
            last = first
            while statements[last].text != f"end subroutine {match[1]}":
                last += 1
                if last == len(statements):
                    raise source.error(statement.line, f"{match[1]} has no end: write 'end subroutine {match[1]}'")
            blocks.append(statements[first : last + 1])
    return blocks


def _read_routine(source: Source, block: list[Statement]) -> tuple[Routine, Texts]:
    """Read what is said of one routine, and its declarations."""
    line, text = block[0].line, block[0].text
    match = re.fullmatch(r"subroutine (jf_\w+)\(([\w, ]*)\) bind\(C, name='(\w+)'\)", text)
    if not match or match[3] != f"{match[1]}_":
        name = text.split("(")[0].split()[-1]
        raise source.error(line, f"{name} is no name in C: write \"bind(C, name='{name}_')\" after its arguments")
    name, names = match[1], split_list(match[2])
    declared = _read_declarations(source, name, block[1:])
    for missing in (n for n in names if n not in declared):
        raise source.error(line, f"{name}: argument {missing} is not declared: write its type and intent")
    if any(n == "info" and declared[n].intent == "out" for n in names[:-1]):
        raise source.error(line, f"{name}: info must be the last argument")
    prose, texts = split_comment(source.comment_above(line))
    if not prose:
        raise source.error(line, f"{name}: nothing says what it does: write a sentence after '!>' above it")
    for unknown in (n for n in texts if n not in names):
        raise source.error(texts[unknown][0], f"{name} has no argument {unknown}: take it out of the comment")
    return Routine(name, " ".join(prose), [declared[n] for n in names], block), texts


def _read_declarations(source: Source, routine: str, block: list[Statement]) -> dict[str, Argument]:
    """Read the declarations of dummy arguments."""
    found = {}
    for statement in block:
        if statement.raw[0].startswith("#"):
            raise source.error(statement.line, f"{routine}: no preprocessor line may stand among declarations")
        if statement.text and "::" not in statement.text:
            break
        attributes, _, entities = statement.text.partition("::")
        intent = re.search(r"intent\((in|out|inout)\)", attributes)
        if not intent:
            continue
        kind = TYPES.get(split_list(attributes)[0])
        if kind is None:
            raise source.error(statement.line, f"{routine}: the type of an argument must be one of {', '.join(TYPES)}")
        for entity in split_list(entities):
            name, bracket, rest = entity.partition("(")
            shape = tuple(split_list(WIDE.sub(r"\1\2\3", rest.removesuffix(")")))) if bracket else ()
            found[name] = Argument(name, kind, intent[1], statement.line, shape)
    return found


def _find_shapes(source: Source, routine: Routine) -> None:
    """Find the shapes of all arrays of a routine, and check that comment and declaration agree."""
    sizes = {a.name for a in routine.arguments if a.type == "integer" and not a.declared}
    before: Argument | None = None
    for a in routine.arguments:
        match = SHAPE_TEXT.search(a.text)
        where = f"{routine.name}: the comment of {a.name}"
        suggestion = "(n, m)" if a.declared == ("*",) else f"({', '.join(a.declared)})"
        if match and not a.declared:
            raise source.error(a.line, f"{where} gives a shape, but no array is declared: declare {a.name}({match[1]})")
        if match:
            a.shape = _dimensions(match[1])
            a.transposed = _dimensions(match[2]) if match[2] else a.shape
        elif a.declared and before is not None and re.search(r"\bsame shape\b", a.text):
            a.shape, a.transposed = before.shape, before.transposed
        elif a.declared:
            raise source.error(a.line, f"{where} does not give its shape: write 'shape {suggestion}'")
        if a.declared and a.declared != ("*",):
            if [_terms(d) for d in a.declared] != [_terms(d) for d in a.shape]:
                raise source.error(a.line, f"{where} says shape ({', '.join(a.shape)}), its declaration {suggestion}")
            if a.transposed != a.shape:
                raise source.error(a.line, f"{where} has another shape with trans 'T': declare {a.name}(*)")
        unknown = set(re.findall(r"[a-z]\w*", " ".join(a.shape + a.transposed))) - sizes - {"max", "min"}
        if unknown:
            raise source.error(a.line, f"{where} gives a shape with {min(unknown)}, which is no integer argument")
        before = a


def _dimensions(text: str) -> tuple[str, ...]:
    """Return the dimensions of a shape as in a comment, written as Fortran and C do: `2 n` is 2*n, `n^2` is n*n."""
    return tuple(split_list(re.sub(r"\b(\w+)\^2", r"\1*\1", re.sub(r"\b(\d+) (?=[a-z])", r"\1*", text))))


def _terms(dimension: str) -> list[str]:
    """Return the terms of a sum in an order that does not depend on how it is written."""
    return sorted(dimension.replace(" ", "").split("+"))


def _public_names(statements: list[Statement]) -> list[tuple[int, str]]:
    """Return the names of public routines, each with the line of its statement."""
    found = []
    for statement in statements:
        match = re.fullmatch(r"public :: (.*)", statement.text)
        if match:
            found += [(statement.line, name) for name in split_list(match[1])]
    return found


def _work_form(comments: Comments, plain: Routine | None, name: str, line: int) -> Routine:
    """Return the form in memory of the caller that is public under this name."""
    error = comments.source.error
    if plain is None:
        raise error(line, f"{name} is public, but there is no such routine: write it, or take the name out")
    if not {"line_info", "rcond", "info"} <= {a.name for a in plain.arguments}:
        raise error(line, f"{name}: take the name out, for {plain.name} has no line_info, rcond and info")
    work = []
    for word, (kind, intent, declared) in WORKSPACE.items():
        if word not in comments.common:
            raise error(1, f"the head does not explain argument {word} of {name}: write '!> {word}   what it is'")
        work.append(Argument(word, kind, intent, plain.line, declared, text=comments.common[word]))
    prose = f"{plain.name} in memory of the caller. Nothing is allocated, no thread started; LAPACK does every line."
    return Routine(name, prose, [*plain.arguments[:-1], *work, plain.arguments[-1]], plain.statements, plain)


def _read_constants(source: Source, statements: list[Statement], others: Iterable[Source]) -> list[ConstantGroup]:
    """Read public constants with the values that other sources declare."""
    known = {}
    for other in others:
        for statement in other.statements():
            match = re.fullmatch(r"integer\(ip\), parameter, public :: (.*)", statement.text)
            if match:
                known.update(dict(re.findall(r"(\w+) = (-?\d+)", match[1])))
    groups: list[ConstantGroup] = []
    for statement in statements:
        match = re.fullmatch(r"integer\(ip\), parameter, public :: (\w+) = (\w+)", statement.text)
        if not match:
            continue
        comment = " ".join(content for _, content in source.comment_above(statement.line))
        if comment:
            groups.append(ConstantGroup(comment, {}))
        if not groups:
            raise source.error(statement.line, f"nothing says what {match[1]} is: write a sentence after '!>' above it")
        if match[2] not in known:
            raise source.error(statement.line, f"{match[1]}: no source declares the value of {match[2]}")
        groups[-1].values[match[1].upper()] = int(known[match[2]])
    return groups


def _read_uses(source: Source, statements: list[Statement]) -> dict[str, list[str]]:
    """Read the USE statements that say what they take."""
    uses = {}
    for statement in statements:
        match = re.fullmatch(r"(use(?:, intrinsic ::)? \w+), only: (.*)", statement.text)
        if match:
            uses[match[1]] = split_list(match[2])
        elif statement.text.startswith("use ") and statement.text != "use jointfrf_api_work":
            raise source.error(statement.line, f"write what is taken: '{statement.text}, only: ...'")
    return uses
