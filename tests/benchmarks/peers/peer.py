"""What a peer is."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..data import Array, Data

#: From the data of a case to the call that is timed: whatever a program does once is done before.
Preparation = Callable[[Data], Callable[[], Array]]


class NotThereError(Exception):
    """A library is not installed, or cannot be used here; the text says why."""


@dataclass(frozen=True)
class Peer:
    """One way of one library.

    Attributes
    ----------
    name : str
        As records, tables and figures call it.
    version : str
        What it is and what it runs on.
    operations : mapping of str to callable
        By the name of the operation.
    """

    name: str
    version: str
    operations: Mapping[str, Preparation]


def compiled(command: list[str], library: Path) -> Path:
    """Compile a library from a source where it is not there yet; its name says from what and how."""
    tool = shutil.which(command[0])
    if tool is None:
        raise NotThereError(f"{command[0]} is not installed")
    if not library.exists():
        library.parent.mkdir(parents=True, exist_ok=True)
        unfinished = library.with_suffix(f".{os.getpid()}.part")
        done = subprocess.run([tool, *command[1:], "-o", str(unfinished)], capture_output=True, text=True)
        if done.returncode:
            raise NotThereError(f"{command[0]} failed: {done.stderr.strip()[-500:]}")
        unfinished.replace(library)
    return library
