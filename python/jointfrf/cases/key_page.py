"""The reference of all keys of case files, as Markdown."""

from __future__ import annotations

from jointfrf.cases.kinds import KINDS
from jointfrf.toml.keys import Key, KeyTable

__all__ = ["key_page"]

_TOP = """# Keys of case files

<!-- jointfrf cases --keys > docs/case-keys.md -->

A case is a folder with a `case.toml` and, where something is known about it beforehand, an `expected.toml`;
[cases](cases.md) says how one is run. SI units. Files that a key names stand relative to the folder. A key that is not
in this list is an error that lists those that are. `DOF` in a key stands for the name of a joint DOF (`k_theta_z`).
"""


def key_page() -> str:
    """Return the reference of all keys of all kinds of cases that come with the package, as Markdown."""
    parts = [_TOP]
    shown: list[KeyTable] = []
    for kind in KINDS.values():
        for top in (kind.keys, kind.expected_keys):
            if top is not None:
                parts += _part(top, shown)
    return "\n".join(parts)


def _part(top: KeyTable, shown: list[KeyTable]) -> list[str]:
    """Return the sections of a file; of tables that another kind takes, too, only the name."""
    parts = [f"## {top.header}\n\n{top.about}\n\n{_rows(top)}"]
    as_above = []
    for table in list(top.all_tables())[1:]:
        if any(table is other for other in shown):
            as_above.append(f"`{table.header}`")
            continue
        shown.append(table)
        parts.append(f"### {table.header}\n\n{table.about}\n\n{_rows(table)}")
    if as_above:
        parts.append(f"As above: {', '.join(as_above)}.\n")
    return parts


def _rows(table: KeyTable) -> str:
    rows = [("key", "value", "unit", "if absent", "meaning"), ("---",) * 5, *(_row(key) for key in table.keys)]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


def _row(key: Key) -> tuple[str, ...]:
    absent = "required" if key.default is None else key.default
    return f"`{key.name}`", key.takes, key.unit, absent, key.meaning
