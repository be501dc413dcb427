"""Errors of usage, messages in the words of the command line, printed results, files to be written, failed tests."""

from __future__ import annotations

import json
import math
import re
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Sized
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointfrf.extras import MissingPackageError, check_extras
from jointfrf.spelling import cut, message, visible
from jointfrf.workbench.cli.progress import clear_line

if TYPE_CHECKING:
    from jointfrf.workbench.cli.arguments.declaration import Arguments

__all__ = [
    "EXPECTED",
    "Failures",
    "Interrupt",
    "OptionWarning",
    "Output",
    "UsageError",
    "check_both",
    "check_file_in_folder",
    "check_folder",
    "check_frf_file",
    "check_out",
    "complain",
    "listed",
    "plain",
    "sentence",
    "shown_warnings",
    "warn_of_ignored",
]


class UsageError(Exception):
    """A wrong word on the command line."""


#: Errors with a message for users.
EXPECTED = (
    UsageError, ValueError, TypeError, ArithmeticError, MemoryError, RuntimeError, OSError, MissingPackageError
)  # fmt: skip


class OptionWarning(UserWarning):
    """A word on the command line without effect."""


#: What messages of the library call its arguments, and what stands for it on the command line.
_WORDS = tuple(
    (re.compile(python), option)
    for python, option in (
        (r"\bsay (\w+)= by mapping", r"say --map \1=..."),
        (r"\bor (\w+)= by mapping", r"or --map \1=..."),
        (r"\bmapping (\w+=)", r"--map \1"),
        (r"\b(by|of|in) mapping\b", r"\1 --map"),
        (r"\bgive axes=", "give --map axes="),
        (r"\bgive unit=(?=')", "give --unit "),
        (r"\bgive unit=", "give --unit"),
        (r"\bwrite (.+) or give unit=", r"write \1 or give --unit"),
        (r"\bunit (\w+)=", r"--unit \1="),
        (r"\bof unit=", "of --unit"),
        (r"\bleave unit out, or force it", "leave --unit out, or give --force-quantity"),
        (r"\bgive skip_lines=(?=\d)", "give --skip-lines "),
        (r"\bskip_lines=", "--skip-lines"),
        (r"^unit (?=\S+ of |\S+ is one of |states )", "--unit "),
        (r"\bgive quantity=", "give --quantity"),
        (r"\bleave quantity and unit out, or give unit and", "leave --quantity and --unit out, or give --unit and"),
        (r"\bforce_quantity\b", "--force-quantity"),
        (r"\blimit_gb=, --limit-gb", "--limit-gb"),
        (r"\bwindow_decay\b", "--window-decay"),
        (r"^position_error needs (.*): give .*", r"--position-error needs \1; add --at, or leave --position-error out"),
        (r"\bposition_error\b", "--position-error"),
        (r"^gamma ", "gamma, the FRFs between all joint DOFs, "),
        (r"\bgive models of these to identify_model\b", "name models of these by --model"),
        (r"\bset accept=\['([\w-]+)'\]", r"say --accept \1"),
        (r"\bset accept=\['([\w-]+)', '([\w-]+)'\]", r"say --accept \1 --accept \2"),
        (r"\(check_frfs\), at transform,", "(jointfrf check), at --at and --channels,"),
    )
)


def complain(kind: str, about: object) -> None:
    """Print a warning or an error as one line that does nothing to a terminal: a file may have any name."""
    clear_line()
    print(f"jointfrf: {kind}: {message(_in_options(cut(str(about))))}", file=sys.stderr)


def _in_options(message: object) -> str:
    """Return a message of the library without its level, with options of the command line for arguments."""
    text = re.sub(r"^(?:warning|error): ", "", str(message))
    for python, option in _WORDS:
        text = python.sub(option, text)
    return text


@contextmanager
def shown_warnings(noted: list[str]) -> Iterator[None]:
    """Show warnings as sentences, and note them; floating-point warnings of numpy mean nothing to a user."""

    def show(message: Warning | str, *_: Any, **__: Any) -> None:
        noted.append(str(message))
        complain("warning", message)

    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", r".* encountered in ", RuntimeWarning)
        warnings.simplefilter("always", OptionWarning)
        warnings.showwarning = show
        yield


def listed(names: Sequence[str]) -> str:
    """Return names as a sentence lists them: a, b and c."""
    return ", ".join([*names[:-2], " and ".join(names[-2:])])


def warn_of_ignored(args: Arguments, names: Iterable[str], why: str) -> None:
    """Warn of options that were given and have no effect."""
    found = args.gave(names)
    if found:
        verb = "have" if found[1:] else "has"
        warnings.warn(f"{listed(found)} {verb} no effect: {why}", OptionWarning, stacklevel=2)


def check_both(args: Arguments, one: str, other: str, example: str = "") -> None:
    """Raise an error if only one of two options is given."""
    if (getattr(args, one) is None) != (getattr(args, other) is None):
        raise UsageError(f"only one of --{one} and --{other} is given; give both{example}")


class Output:
    """The text and the numbers of a command, printed as its options `--json` and `--quiet` state.

    Attributes
    ----------
    written : list of Path
        Files that the command wrote.
    """

    def __init__(self, args: Arguments) -> None:
        self._is_json, self._is_quiet, self._warned = args.json, args.quiet, args.warned
        self.written: list[Path] = []

    def say(self, *lines: object) -> None:
        """Print lines of text, unless JSON or nothing is wanted."""
        if lines and not (self._is_json or self._is_quiet):
            clear_line()
            print(*(visible(str(line), "\n\t") for line in lines), sep="\n", flush=True)

    def warn(self, *texts: object) -> None:
        """Note warnings that are part of the text: for the JSON, or to be printed where nothing else is."""
        self._warned += map(str, texts)
        for text in texts if self._is_quiet and not self._is_json else ():
            complain("warning", text)

    def give(self, content: Mapping[str, Any]) -> None:
        """Print the files written and, where that is wanted, the result as JSON with all warnings at its top level."""
        self.say(*([""] if self.written else []), *(f"wrote {path}" for path in self.written))
        if self._is_json:
            warned = [_in_options(cut(str(text))) for text in (*content.get("warnings", ()), *self._warned)]
            whole = {**content, "written": self.written, "warnings": list(dict.fromkeys(warned))}
            clear_line()
            print(json.dumps(plain(whole), indent=2, allow_nan=False))


def plain(value: Any) -> Any:
    """Return a value as JSON contains it: a number that is not finite becomes null, a complex number a pair."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if hasattr(value, "tolist"):  # arrays and numbers of numpy
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, complex):
        return [plain(value.real), plain(value.imag)]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, str | int | None) else str(value)


def check_folder(option: str, path: Path | None) -> None:
    """Check, before anything is computed, that a file can be written there.

    Raises
    ------
    UsageError
        There is no such folder, or the path is a folder.
    """
    if path is not None and not path.parent.is_dir():
        raise UsageError(f"{option}: folder {path.parent} does not exist; create it, or name another file")
    if path is not None and path.is_dir():
        raise UsageError(f"{option}: {path} is a folder; name a file")


def check_out(option: str, path: Path | None) -> None:
    """Check, before anything is computed, that a folder can be made there.

    Raises
    ------
    UsageError
        It, or a folder above it, is a file.
    """
    above = [] if path is None else [path, *path.parents]
    there = next((one for one in above if one.exists() or one.is_symlink()), None)
    if there is not None and not there.is_dir():
        raise UsageError(f"{option}: {there} is a file; name a folder")


def check_file_in_folder(option: str, path: Path) -> None:
    """Check that a file can be written there, whose folder need not exist."""
    check_out(option, path.parent)
    if path.is_dir():
        raise UsageError(f"{option}: {path} is a folder; name a file")


def check_frf_file(option: str, path: Path) -> None:
    """Check that FRFs can be written to a path.

    Raises
    ------
    UsageError
        No format has its suffix, there is no such folder, or it is one.
    MissingPackageError
        A package for the format is not installed.
    """
    from jointfrf.io.formats import check_suffix

    try:
        needed = check_suffix(path).package
    except ValueError as error:
        raise UsageError(error) from error
    check_folder(option, path)
    if needed:
        check_extras(needed)


class Failures:
    """Tests that failed, of several: none ends the other ones, and all are named at the end.

    Attributes
    ----------
    found : dict of str to str
        Sentences by the names of the tests.
    """

    def __init__(self, args: Arguments) -> None:
        self._stop_if_interrupted: Callable[[], None] = args.stop_if_interrupted
        self._is_first = True
        self.found: dict[str, str] = {}

    @contextmanager
    def noted(self, name: str) -> Iterator[None]:
        """Note that a test failed, and why; wrong usage ends the command at the first test."""
        is_first, self._is_first = self._is_first, False
        try:
            yield
        except Exception as error:
            self._stop_if_interrupted()  # which may have ended in any error
            if is_first and isinstance(error, UsageError):
                raise
            text = sentence(error)
            self.found[name] = text if text.startswith(name) else f"{name}: {text}"

    def complain(self) -> None:
        """Print all failures."""
        for text in self.found.values():
            complain("error", text)


def sentence(error: Exception) -> str:
    """Return an error as a message shows it; one that is no fault of the input with its name."""
    if isinstance(error, OSError):
        return f"{f'{error.filename}: ' if error.filename else ''}{error.strerror or error}"
    if isinstance(error, MemoryError) and not str(error):
        return "not enough memory; use fewer nodes, a narrower band or fewer realisations"
    return str(error) if isinstance(error, EXPECTED) else f"{type(error).__name__}: {error}"


class Interrupt:
    """Ctrl-C while several tests are computed: results of the finished ones are written before the command ends."""

    def __init__(self) -> None:
        self._has_come = False

    @contextmanager
    def kept_back(self, finished: Sized) -> Iterator[None]:
        """Keep an interrupt back if something is finished."""
        try:
            yield
        except KeyboardInterrupt:
            if not len(finished):
                raise
            self._has_come = True

    def resume(self) -> None:
        """Raise the interrupt that was kept back."""
        if self._has_come:
            raise KeyboardInterrupt
