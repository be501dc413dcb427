"""Random command lines: an answer or one sentence, a status that says which, never a traceback."""

from __future__ import annotations

import argparse
import contextlib
import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import mmwrite
from scipy.sparse import coo_array

from frf_files import frf_set
from jointfrf import Joint, write_joint
from jointfrf.io import write_csv, write_npz, write_uff
from jointfrf.workbench.cli.main import main
from jointfrf.workbench.cli.parser import COMMANDS, CommandParser, command_parser

from .part import BrokenError

__all__ = ["Commands"]

_WORDS = ["", "x", "y,rz", "101", "101,102", "101:116", "-1", "0", "1e999", "nan", "nowhere.uff", ",", "jk", "auto",
          "--", "10,50", "50,10", "nastran:1,2", "compliance", "a=b", "ü", "101:+x"]  # fmt: skip
#: Commands that compute for minutes, write many files, or ask a terminal.
_UNTRIED = {"run"}
#: Commands that take tenths of a second, and how many of their cases are theirs.
_SLOW = {"study": 0.3, "cases": 0.1}
#: What a line ends with in any case, so that it starts no processes and takes no minutes.
_LAST = {"study": ("--jobs", "1", "--realisations", "2", "--executor", "processes")}


def _sound_lines(folder: Path) -> dict[str, list[str]]:
    """Return a line for each command that answers, and make the files it names."""
    spring = np.array([[2e6, -1e6, 0], [-1e6, 3e6, -1e6], [0, -1e6, 1e6]])
    mmwrite(folder / "k.mtx", coo_array(spring))
    mmwrite(folder / "m.mtx", coo_array(np.diag([1.0, 2.0, 1.0])))
    (folder / "dofs.txt").write_text("1:x\n2:x\n3:x\n")
    write_joint(folder / "joint.toml", Joint([1e6], [10.0], dofs=["x"]))
    at = str(folder) + "/"
    matrices = ["--stiffness", at + "k.mtx", "--mass", at + "m.mtx", "--dof-names", at + "dofs.txt"]
    sound = {
        "check": [at + "a.uff"],
        "cases": [],
        "completion": ["bash"],
        "convert": [at + "a.uff", at + "b.npz"],
        "frf": [*matrices, "--band", "5:300", "--step", "5", "--loss-factor", "0.01", "--output", at + "side.uff"],
        "couple": [at + "side.uff", at + "side.uff", "--joint", at + "joint.toml", "--j", "3", "--k", "1",
                   "--renumber-b", "100", "--output", at + "whole.uff"],
        "decouple": [at + "side.uff", at + "side.uff", at + "whole.uff", "--equation", "rs", "--j", "3", "--k", "1",
                     "--dofs", "x", "--r", "1:x", "--s", "2:x", "--renumber-b", "100"],
        "validate": [at + "side.uff", at + "side.uff", at + "whole.uff", "--joint", at + "joint.toml", "--j", "3",
                     "--k", "1", "--renumber-b", "100", "--output", at + "made.uff"],
        "identify": [at + "whole.uff", "--j", "3", "--k", "101", "--dofs", "x", "--save", at + "fit.json"],
        "export": [at + "joint.toml", "nastran:1,2"],
        "study": ["3.1", "--estimator", "ismm", "--factor", "noise=0.01,0.05", "--out", at + "study"],
    }  # fmt: skip
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, words in sound.items():
            try:
                status: Any = main([name, *words, *_LAST.get(name, ())])
            except SystemExit as end:
                status = end.code
            if status:
                raise RuntimeError(f"{name}: {said.getvalue()[-500:]}")
    return sound


class Commands:
    """Random commands."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        given = frf_set()
        write_uff(folder / "a.uff", given)
        write_npz(folder / "a.npz", given)
        write_csv(folder / "a.csv", given)
        (folder / "broken.uff").write_bytes((folder / "a.uff").read_bytes()[:999])
        (folder / "broken.toml").write_text("[joint")
        self.sound = _sound_lines(folder)
        self.files = [str(path) for path in sorted(folder.iterdir())] + [str(folder / "none.uff")]
        self.commands = {name: command_parser(name) for name in COMMANDS if name not in _UNTRIED}

    def run(self, random: np.random.Generator) -> str:
        """Run one command line in this process."""
        name = sorted(self.commands)[random.integers(len(self.commands))]
        if name in _SLOW and random.random() > _SLOW[name]:
            name = "check"
        if name in self.sound and random.random() < 0.7:
            words = [name, *self._spoiled(name, random)]
        else:
            words = [name, *self._words(self.commands[name], random)]
        said, reported = io.StringIO(), io.StringIO()
        status: Any = 0
        quiet = warnings.catch_warnings()
        with (
            quiet,
            contextlib.redirect_stdout(said),
            contextlib.redirect_stderr(reported),
            contextlib.chdir(self.folder),
        ):
            warnings.simplefilter("ignore")
            try:
                status = main(words)
            except SystemExit as end:
                status = end.code
            except BaseException as error:
                raise BrokenError(f"{words}: {type(error).__name__}: {error}") from None
        if status not in (0, 1, 2, None) or "Traceback" in reported.getvalue():
            raise BrokenError(f"{words}: status {status}: {reported.getvalue()[:300]!r}")
        if status and not reported.getvalue().strip() and not said.getvalue().strip():
            raise BrokenError(f"{words}: status {status} without a word")
        return f"status {status or 0}"

    def _spoiled(self, name: str, random: np.random.Generator) -> list[str]:
        """Return a line that answers, with words exchanged or left out and options added."""
        bad = random.choice([0.0, 0.1, 0.4])
        words = []
        for word in self.sound[name]:
            if random.random() >= bad:
                words.append(word)
            elif random.random() < 0.7:
                words.append(_WORDS[random.integers(len(_WORDS))] if random.random() < 0.7 else
                             self.files[random.integers(len(self.files))])  # fmt: skip
        if random.random() < 0.3:
            options = [each for each in self.commands[name].arguments
                       if each.option_strings and not isinstance(each, argparse._HelpAction)]  # fmt: skip
            action = options[random.integers(len(options))]
            words += [action.option_strings[-1], *([self._word(action, random)] if action.nargs != 0 else [])]
        return [*words, *_LAST.get(name, ())]

    def _words(self, parser: CommandParser, random: np.random.Generator) -> list[str]:
        words = []
        for action in parser.arguments:
            if isinstance(action, argparse._HelpAction) or (action.option_strings and random.random() > 0.25):
                continue
            if action.option_strings:
                words.append(action.option_strings[-1])
            if action.nargs != 0:
                words.append(self._word(action, random))
        if random.random() < 0.1:
            words.append(_WORDS[random.integers(len(_WORDS))])
        return [*words, *_LAST.get(parser.prog.split()[-1], ())]

    def _word(self, action: argparse.Action, random: np.random.Generator) -> str:
        if action.choices and random.random() < 0.8:
            return str(list(action.choices)[random.integers(len(list(action.choices)))])
        if not action.option_strings and random.random() < 0.8:
            return self.files[random.integers(len(self.files))]
        if action.dest in ("output", "out", "save", "report") and random.random() < 0.8:
            return str(self.folder / "out" / str(random.integers(4)))
        return _WORDS[random.integers(len(_WORDS))]
