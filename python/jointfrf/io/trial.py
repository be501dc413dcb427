"""Reading in another process first, where a damaged file can bring down the library that reads it."""

from __future__ import annotations

import subprocess
import sys

__all__ = ["survives"]

#: In seconds.
_LONGEST = 30


def survives(program: str, *words: str) -> bool:
    """Whether a short Python program ends without a crash, an exception or being stopped after half a minute.

    Parameters
    ----------
    program : str
        Source, which finds the words in ``sys.argv[1:]``.
    *words : str
        Its arguments.
    """
    command = [sys.executable, "-c", program, *words]
    try:
        return subprocess.run(command, capture_output=True, timeout=_LONGEST, check=False).returncode == 0
    except subprocess.TimeoutExpired:
        return False
