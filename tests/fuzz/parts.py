"""The parts by name, made in the process that runs their cases."""

from __future__ import annotations

from pathlib import Path

from .part import Part

__all__ = ["PARTS", "make_part"]

#: What each attacks, and how many cases the long form runs.
PARTS = {
    "calls": ("every public function and the methods of what it returns, random arguments", 1_000_000),
    "files": ("files of FRFs of every format, damaged", 100_000),
    "abi": ("every routine of the C and Fortran interface, random arguments", 1_000_000),
    "overlaps": ("out= that overlaps its inputs, arrays in files", 20_000),
    "commands": ("random command lines", 3_000),
}


def make_part(name: str, folder: Path) -> Part:
    """Make a part; `folder` is its own, for files."""
    if name == "calls":
        from .python_calls import PythonCalls

        return PythonCalls(folder)
    if name == "files":
        from .damaged_files import DamagedFiles

        return DamagedFiles(folder)
    if name == "abi":
        from .abi_calls import AbiCalls

        return AbiCalls()
    if name == "overlaps":
        from .overlaps import Overlaps

        return Overlaps(folder)
    from .commands import Commands

    return Commands(folder)
