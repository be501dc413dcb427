"""jointfrf.inc, the constants for INCLUDE in fixed or free form."""

from __future__ import annotations

import textwrap

from generate.routines import Api

#: By the bytes of an integer: the library, the other one with its bytes, and digits that integers of these bytes have.
VARIANTS = {4: ("jointfrf", "jointfrf64", "8", "18"), 8: ("jointfrf64", "jointfrf", "4", "9")}


def values(api: Api, integer_bytes: int) -> dict[str, str]:
    """Return what fills the template of the include file."""
    lines = []
    for group in api.constants:
        lines += textwrap.wrap(group.text, 72, initial_indent="! ", subsequent_indent="! ")
        for name, value in group.values.items():
            lines += [f"      INTEGER {name}", f"      PARAMETER ({name} = {value})"]
    name, other, other_bytes, digits = VARIANTS[integer_bytes]
    return {
        "constants": "\n".join(lines),
        "name": name,
        "bytes": str(integer_bytes),
        "other": other,
        "link_other": other.upper(),
        "other_bytes": other_bytes,
        "digits": digits,
    }
