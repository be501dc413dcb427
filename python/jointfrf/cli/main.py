"""The command `jointfrf`."""

from __future__ import annotations

import os
import shlex
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from jointfrf.cli.configuration import with_configuration
from jointfrf.cli.parser import COMMANDS, command_parser, top_parser
from jointfrf.cli.surroundings import interrupts, read_or_not
from jointfrf.cli.usage import UsageError, complain
from jointfrf.extras import MissingPackageError
from jointfrf.spelling import did_you_mean

__all__ = ["main"]

#: Exit statuses: as argparse has it, any other error, and as shells have it after Ctrl-C.
_USAGE_ERROR, _FAILURE, _INTERRUPTED = 2, 1, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after `jointfrf`; those of the process by default.

    Returns
    -------
    int
        0 good, 1 something in the data or the files is wrong, 2 wrong usage, 130 interrupted.
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    with read_or_not():
        return _answer(words)


def _answer(words: list[str]) -> int:
    """Run a command; what goes wrong is one sentence."""
    try:
        if not words:
            top_parser()[0].print_help(sys.stderr)
            return _USAGE_ERROR
        if words[0].startswith("-"):
            top_parser()[0].parse_words(words)  # prints help, version or what is wrong, and ends
        with interrupts():
            status = _run(words)
        sys.stdout.flush()
        return status
    except UsageError as error:
        complain("error", error)
        return _USAGE_ERROR
    except OSError as error:
        complain("error", f"{f'{error.filename}: ' if error.filename else ''}{error.strerror or error}")
    except (ValueError, TypeError, ArithmeticError, MemoryError, RuntimeError, MissingPackageError) as error:
        few = "not enough memory for what was asked for: fewer nodes, a narrower band or fewer realisations need less"
        complain("error", few if isinstance(error, MemoryError) and not str(error) else error)
    except KeyboardInterrupt:
        complain("error", "interrupted")
        return _INTERRUPTED
    return _FAILURE


def _run(words: list[str]) -> int:
    """Run one command."""
    name = words[0]
    if name not in COMMANDS:
        hint = did_you_mean(name, COMMANDS) or ": jointfrf --help lists them"
        raise UsageError(f"there is no command {name!r}{hint}")
    parser = command_parser(name)
    args = parser.parse_words(words[1:])
    args.typed = shlex.join(["jointfrf", *words])
    with warnings.catch_warnings(), _limited(args.limit_gb):
        warnings.showwarning = _show_warning
        status: int = args.action(with_configuration(args, parser, name))
        return status


@contextmanager
def _limited(limit_gb: float | None) -> Iterator[None]:
    """Set the limit of what is read, for this process and those that it starts."""
    if limit_gb is None:
        yield
        return
    from jointfrf.files import LIMIT_VARIABLE

    before = os.environ.get(LIMIT_VARIABLE)
    os.environ[LIMIT_VARIABLE] = repr(limit_gb)
    try:
        yield
    finally:
        del os.environ[LIMIT_VARIABLE]
        if before is not None:
            os.environ[LIMIT_VARIABLE] = before


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    complain("warning", message)


if __name__ == "__main__":
    sys.exit(main())
