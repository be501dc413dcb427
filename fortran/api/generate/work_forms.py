"""api_work.F90, the routines jf_*_work: jf_NAME with workspace of the caller before INFO, by LAPACK's habit.

A form has the declarations and statements of jf_NAME; the routine of the kernel that jf_NAME calls with `info` for its
last argument takes the workspace after it.
"""

from __future__ import annotations

import re

from generate.routines import Api, Routine
from generate.source import Source, Statement, split_list, wrap_list

HEAD = """!> Generated from api.F90.
!>
!> The flat API in memory of the caller: jf_NAME_work takes the arguments of jf_NAME and, before INFO, workspace by
!> LAPACK's habit. Nothing is allocated and no thread is started; LAPACK does every line, as the reference engine does,
!> whatever engine is chosen. A program calls them line by line in its own loop, or for many lines at once.
module jointfrf_api_work"""
WORKSPACE = """    complex(c_double_complex), target, intent(inout) :: work(*)
    integer(ip), intent(in) :: lwork, liwork
    integer(ip), target, intent(inout) :: iwork(*)"""


def _call_with_memory(source: Source, routine: Routine, statement: Statement) -> list[str]:
    """Write the call of the kernel's routine with the caller's memory after INFO."""
    match = re.fullmatch(r"call (\w+)\((.*)\)", statement.text)
    if match is None:
        raise source.error(statement.line, f"{routine.name}: write the call of the kernel as a statement of its own")
    indent = re.match(r" *", statement.raw[0])
    start = f"{indent[0] if indent else ''}call {match[1]}("
    place = [a.name for a in routine.arguments].index("lwork") + 1
    return wrap_list(start, [*split_list(match[2]), f"as_memory({place}_ip, work, lwork, iwork, liwork)"], ")")


def _subroutine_statement(routine: Routine) -> list[str]:
    """Write the first statement; BIND takes a line of its own where it does not fit."""
    binding = f"bind(C, name='{routine.name}_')"
    lines = wrap_list(f"  subroutine {routine.name}(", [a.name for a in routine.arguments], ")")
    if len(lines[-1]) + 1 + len(binding) <= 120:
        return [*lines[:-1], f"{lines[-1]} {binding}"]
    return [*lines[:-1], f"{lines[-1]} &", f"    {binding}"]


def _form(source: Source, routine: Routine, plain: Routine) -> list[str]:
    """Write one routine."""
    lines = [f"  !> {routine.prose}", *_subroutine_statement(routine)]
    calls = 0
    for statement in plain.statements[1:-1]:
        if re.fullmatch(r"(if \(.*\) )?call .*, info\)", statement.text):
            calls += 1
            lines += _call_with_memory(source, routine, statement)
            continue
        if re.search(r"intent\(out\) ::.*\binfo$", statement.text):
            lines += WORKSPACE.splitlines()
        lines += statement.raw
    if calls != 1:
        words = f"write one call whose last argument is info, not {calls}: {routine.name} adds the memory to it"
        raise source.error(plain.line, f"{plain.name}: {words}")
    return [*lines, f"  end subroutine {routine.name}"]


def _used(api: Api, code: str) -> list[str]:
    """Write the USE statements for the names that stand in the code."""
    words = set(re.findall(r"[A-Za-z]\w*", code))
    uses = {"use jointfrf_caller_memory": ["as_memory"]}
    for module, names in api.uses.items():
        uses[module] = [name for name in names if re.split(r"\W", name)[0] in words]
    lines = []
    for module in sorted((m for m, names in uses.items() if names), key=lambda m: m.replace(",", " ")):
        lines += wrap_list(f"  {module}, only: ", uses[module], "", indent=4)
    return lines


def write(api: Api) -> str:
    """Write the module."""
    forms = [(routine, routine.plain) for routine in api.routines if routine.plain is not None]
    code = [["", *_form(api.source, routine, plain)] for routine, plain in forms]
    used = _used(api, "\n".join(line for form in code for line in form))
    public = wrap_list("  public :: ", [routine.name for routine, _ in forms], "", indent=4)
    lines = [HEAD, *used, "  implicit none", "  private", *public, "", "contains"]
    return "\n".join([*lines, *(line for form in code for line in form), "end module jointfrf_api_work"]) + "\n"
