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
from jointfrf.cli.usage import UsageError
from jointfrf.extras import MissingPackageError
from jointfrf.spelling import did_you_mean, visible

__all__ = ["main"]

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
    if not words:
        top_parser().print_help(sys.stderr)
        return _USAGE_ERROR
    if words[0].startswith("-"):
        top_parser().parse_words(words)  # prints help, version or what is wrong, and ends
    if words[0] not in COMMANDS:
        return _complain(
            f"there is no command {words[0]!r}{did_you_mean(words[0], COMMANDS) or ': jointfrf --help lists them'}",
            _USAGE_ERROR,
        )
    parser = command_parser(words[0])
    given = parser.parse_words(words[1:])
    given.typed = shlex.join(["jointfrf", *words])
    with warnings.catch_warnings(), _limited(given.limit_gb):
        warnings.showwarning = _show_warning
        try:
            options = with_configuration(given, parser, words[0])
            status: int = options.action(options)
            sys.stdout.flush()
            return status
        except UsageError as error:
            return _complain(error, _USAGE_ERROR)
        except BrokenPipeError:
            # The reader went away (`jointfrf cases | head`): nothing more can be said.
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return _FAILURE
        except OSError as error:
            where = f"{error.filename}: " if error.filename else ""
            return _complain(f"{where}{error.strerror or error}", _FAILURE)
        except (ValueError, TypeError, ArithmeticError, MemoryError, RuntimeError, MissingPackageError) as error:
            return _complain(error, _FAILURE)
        except KeyboardInterrupt:
            return _complain("interrupted", _INTERRUPTED)


@contextmanager
def _limited(limit_gb: float | None) -> Iterator[None]:
    """Set the limit of what is read, for this process and those that it starts."""
    if limit_gb is None:
        yield
        return
    from jointfrf.files import LIMIT_VARIABLE

    before = os.environ.pop(LIMIT_VARIABLE, None)
    os.environ[LIMIT_VARIABLE] = repr(limit_gb)
    try:
        yield
    finally:
        del os.environ[LIMIT_VARIABLE]
        if before is not None:
            os.environ[LIMIT_VARIABLE] = before


def _complain(message: object, status: int) -> int:
    print(f"jointfrf: error: {_one_line(message)}", file=sys.stderr)
    return status


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"jointfrf: warning: {_one_line(message)}", file=sys.stderr)


def _one_line(message: object) -> str:
    """Return a message as one line that does nothing to a terminal: the name of a file may hold anything."""
    if isinstance(message, MemoryError) and not str(message):
        return "not enough memory for what was asked for: fewer nodes, a narrower band or fewer realisations need less"
    return visible(str(message))


if __name__ == "__main__":
    sys.exit(main())
