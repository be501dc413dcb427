"""jointfrf.inc, the constants for INCLUDE in fixed or free form."""

from __future__ import annotations

import textwrap

from generate.routines import Api

#: By the bytes of an integer: the library, the other one, and what divides by zero where default integers are others.
VARIANTS = {4: ("jointfrf", "jointfrf64", "32/BIT_SIZE(0)"), 8: ("jointfrf64", "jointfrf", "BIT_SIZE(0)/64")}


def values(api: Api, integer_bytes: int) -> dict[str, str]:
    """Return what fills the template of the include file."""
    lines = []
    for group in api.constants:
        lines += textwrap.wrap(group.text, 72, initial_indent="! ", subsequent_indent="! ")
        for name, value in group.values.items():
            lines += [f"      INTEGER {name}", f"      PARAMETER ({name} = {value})"]
    name, other, share = VARIANTS[integer_bytes]
    return {"constants": "\n".join(lines), "name": name, "other": other, "bytes": str(integer_bytes), "share": share}
