"""The command `jointfrf`."""

from __future__ import annotations

import argparse
import importlib
import os
import shlex
import sys
import warnings
from collections.abc import Sequence
from typing import Any

from jointfrf.cli.usage import UsageError
from jointfrf.extras import MissingPackageError

__all__ = ["main"]

_USAGE_ERROR, _FAILURE, _INTERRUPTED = 2, 1, 130
#: The commands, each the module of its name, and what they do.
_COMMANDS = {
    "run": "run cases: tables, figures and a report each",
    "cases": "list the cases that come with jointfrf",
    "check": "look at measured FRFs: what is wrong, in which channel, what to do",
    "convert": "measured FRFs of one file or several into another format",
    "readings": "compare printed values with every reading of the noise",
    "identify": "identify a joint from a file of measured FRFs",
}


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
    options = _parser(words).parse_args(words, argparse.Namespace(typed=shlex.join(["jointfrf", *words])))
    with warnings.catch_warnings():
        warnings.showwarning = _show_warning
        try:
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


def _complain(message: object, status: int) -> int:
    print(f"jointfrf: error: {message}", file=sys.stderr)
    return status


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"jointfrf: warning: {message}", file=sys.stderr)


class _Version(argparse.Action):
    """Prints the version, which takes time to find."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        from importlib.metadata import version

        print(f"jointfrf {version('jointfrf')}")
        parser.exit()


def _parser(words: list[str]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="jointfrf", description="Stiffness and damping of joints from FRFs.")
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    for name, what in _COMMANDS.items():
        command = commands.add_parser(name, help=what)
        # Only the command that is asked for is imported: the others need time, and packages that may be missing.
        if words[:1] == [name]:
            module = importlib.import_module(f"jointfrf.cli.{name}")
            module.add_arguments(command)
            command.set_defaults(action=module.run)
    return parser


if __name__ == "__main__":
    sys.exit(main())
