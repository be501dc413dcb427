"""Cases of one's own: a case that comes with the package, with other tables in its file."""

from __future__ import annotations

import re
from pathlib import Path

from jointfrf.cases.catalogue import find_case


def replace_tables(text: str, tables: str) -> str:
    """Replace tables of a TOML text by those of another one, ``[name]`` by ``[name]``."""
    for name, body in re.findall(r"^\[(\w+)\](.*?)(?=^\[|\Z)", tables, re.MULTILINE | re.DOTALL):
        old = re.compile(rf"^\[{name}\].*?(?=^\[|\Z)", re.MULTILINE | re.DOTALL)
        assert len(old.findall(text)) == 1, name
        start, end = old.search(text).span()
        text = f"{text[:start]}[{name}]{body.rstrip()}\n\n{text[end:]}"
    return text


def write_case(folder: Path, tables: str, case: str = "3.2") -> Path:
    """Write the file of a case with some of its tables replaced."""
    folder.mkdir(exist_ok=True)
    text = (find_case(case) / "case.toml").read_text(encoding="utf-8")
    (folder / "case.toml").write_text(replace_tables(text, tables), encoding="utf-8")
    return folder
