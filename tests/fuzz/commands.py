"""Random command lines: an answer or one sentence, a status that says which, never a traceback."""

from __future__ import annotations

import argparse
import contextlib
import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from frf_files import frf_set
from jointfrf.cli.main import main
from jointfrf.cli.parser import COMMANDS, command_parser
from jointfrf.io import write_csv, write_npz, write_uff

from .part import BrokenError

__all__ = ["Commands"]

_WORDS = ["", "x", "y,rz", "101", "101,102", "101:116", "-1", "0", "1e999", "nan", "nowhere.uff", ",", "jk", "auto",
          "--", "10,50", "50,10", "nastran:1,2", "compliance", "a=b", "ü", "101:+x"]  # fmt: skip
#: Commands that compute for minutes, write many files, or ask a terminal.
_UNTRIED = {"run", "readings"}


class Commands:
    """Random commands."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        given = frf_set()
        write_uff(folder / "a.uff", given)
        write_npz(folder / "a.npz", given)
        write_csv(folder / "a.csv", given)
        (folder / "broken.uff").write_bytes((folder / "a.uff").read_bytes()[:999])
        self.files = [str(folder / name) for name in ("a.uff", "a.npz", "a.csv", "broken.uff", "none.uff")]
        self.commands = {name: command_parser(name) for name in COMMANDS if name not in _UNTRIED}

    def run(self, random: np.random.Generator) -> str:
        """Run one command line in this process."""
        name = sorted(self.commands)[random.integers(len(self.commands))]
        words = [name, *self._words(self.commands[name], random)]
        said, told = io.StringIO(), io.StringIO()
        status: Any = 0
        quiet = warnings.catch_warnings()
        with quiet, contextlib.redirect_stdout(said), contextlib.redirect_stderr(told), contextlib.chdir(self.folder):
            warnings.simplefilter("ignore")
            try:
                status = main(words)
            except SystemExit as end:
                status = end.code
            except BaseException as error:
                raise BrokenError(f"{words}: {type(error).__name__}: {error}") from None
        if status not in (0, 1, 2, None) or "Traceback" in told.getvalue():
            raise BrokenError(f"{words}: status {status}: {told.getvalue()[:300]!r}")
        if status and not told.getvalue().strip() and not said.getvalue().strip():
            raise BrokenError(f"{words}: status {status} without a word")
        return f"status {status or 0}"

    def _words(self, parser: argparse.ArgumentParser, random: np.random.Generator) -> list[str]:
        words = []
        for action in parser._actions:
            if isinstance(action, argparse._HelpAction) or (action.option_strings and random.random() > 0.25):
                continue
            if action.option_strings:
                words.append(action.option_strings[-1])
            if action.nargs != 0:
                words.append(self._word(action, random))
        if random.random() < 0.1:
            words.append(_WORDS[random.integers(len(_WORDS))])
        return words

    def _word(self, action: argparse.Action, random: np.random.Generator) -> str:
        if action.choices and random.random() < 0.8:
            return str(list(action.choices)[random.integers(len(list(action.choices)))])
        if not action.option_strings and random.random() < 0.8:
            return self.files[random.integers(len(self.files))]
        if action.dest in ("output", "out", "save", "report") and random.random() < 0.8:
            return str(self.folder / "out" / str(random.integers(4)))
        return _WORDS[random.integers(len(_WORDS))]
