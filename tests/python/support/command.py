"""The command line in this process: what it prints and returns, without the start of an interpreter."""

from __future__ import annotations

import contextlib
import io
import math
import warnings
from typing import NamedTuple
from unittest import mock

from jointfrf.workbench.cli import progress
from jointfrf.workbench.cli.main import main


class Finished(NamedTuple):
    """What a command gave."""

    returncode: int
    stdout: str
    stderr: str


def run_command(*words: object) -> Finished:
    """Run `jointfrf` with these words; warnings are shown as they are where a program is started."""
    said, complained = io.StringIO(), io.StringIO()
    with (
        contextlib.redirect_stdout(said),
        contextlib.redirect_stderr(complained),
        warnings.catch_warnings(),
        mock.patch.object(progress, "FIRST_LINE", math.inf),  # a slow machine prints no progress
    ):
        warnings.resetwarnings()
        for category in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
            warnings.simplefilter("ignore", category)
        try:
            status = main([str(word) for word in words])
        except SystemExit as stop:  # how argparse ends
            status = int(stop.code or 0)
    return Finished(status, said.getvalue(), complained.getvalue())
