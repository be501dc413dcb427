"""The checked-in list of what leaves the shared library, and the C prototypes of a text."""

from __future__ import annotations

import re
from pathlib import Path

ABI = (Path(__file__).resolve().parents[2] / "abi" / "libjointfrf.so.0.txt").read_text()
#: Symbols in the order of the list.
LISTED = re.findall(r"^(?:void|const char) (jf_\w+)", ABI, re.MULTILINE)
#: With those that programs compiled by other options refer to, which the list states once for all routines.
(_ENDS,) = re.findall(r"^/\* every void jf_NAME_ also as (.+) \*/$", ABI, re.MULTILINE)
SPELT = [f"{name[:-1]}{end.removeprefix('jf_NAME')}" for end in _ENDS.split(", ")
         for name in LISTED if name != "jf_integers_have_4_bytes_"]  # fmt: skip
EXPORTED = sorted([*LISTED, *SPELT])


def prototypes(text: str = ABI) -> dict[str, list[str]]:
    """Return the arguments of each symbol that a text declares in C."""
    found = re.findall(r"^void (jf_\w+_)\(([^)]*)\);", text, re.MULTILINE)
    return {name: [" ".join(argument.split()) for argument in arguments.split(",")] for name, arguments in found}
