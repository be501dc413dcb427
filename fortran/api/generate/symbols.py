"""symbols.c, each routine under the symbols that FORTRAN 77 programs refer to which other options spell.

`jf_name_` is the name in BIND(C). `jf_name` is how gfortran spells an external routine with -fno-underscoring, and
`jf_name__` with -fsecond-underscore, as g77 and f2c did. C ignores the lengths of texts that Fortran adds.
"""

from __future__ import annotations

from generate.c_header import prototype
from generate.routines import Api

#: What follows the name of a routine in its other symbols.
ENDS = ("", "__")
HEAD = "/* Other symbols of each routine: -fno-underscoring, -fsecond-underscore. */\n#define JF_NO_LINK_CHECK\n"


def write(api: Api) -> str:
    """Return the file."""
    lines = [f'{HEAD}#include "jointfrf.h"']
    for routine in api.routines:
        call = f"{routine.name}_({', '.join(argument.name for argument in routine.arguments)});"
        lines.append(f"\n#undef {routine.name}")
        for end in ENDS:
            declared = prototype(routine, end)
            lines.append(f"{declared}\n{declared.removesuffix(';')} {{ {call} }}")
    return "\n".join(lines) + "\n"
