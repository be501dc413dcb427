"""`jointfrf.toml`: the channels and defaults of a project, over which every word of the command line wins."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointfrf.cli.parser import COMMANDS, CommandParser, options_of
from jointfrf.cli.usage import UsageError

if TYPE_CHECKING:
    from jointfrf.toml.table import TomlTable

__all__ = ["CONFIGURATION", "with_configuration"]

#: Looked for in the working directory.
CONFIGURATION = "jointfrf.toml"
#: Options that are not defaults of anything.
_NO_DEFAULTS = ("--help", "-h", "--config", "--no-config")
#: Keys of a table of channels, which may stand in the same file.
_CHANNELS = ("unit", "channel")
#: What a file that nobody has named says, beside which joint is in the file: defaults of the fit. It may be anybody's.
_OF_THE_FIT = ("--method", "--damping", "--cross", "--noise", "--bending-stiffness")


def with_configuration(given: argparse.Namespace, parser: CommandParser, command: str) -> argparse.Namespace:
    """Fill in what the command line does not say from the configuration; `options.configuration` is its path.

    A file that was found, not named, is told on standard error where it says something. It gives channels and defaults
    of the fit: nothing that is written, no executor, no file outside its folder.

    Parameters
    ----------
    given : Namespace
        What the command line says, absent options at their defaults.
    parser : CommandParser
        Of the command.
    command : str
        Its name.

    Raises
    ------
    FileContentError
        The file cannot be read, or a key or value in it is wrong, or such as only a file may say that was named.
    UsageError
        There is no file of the name given.
    """
    given.configuration = _path(given)
    if given.configuration is None:
        return given
    from jointfrf.errors import FileContentError
    from jointfrf.toml.table import read_toml

    table, is_found = read_toml(given.configuration), given.config is None
    shared = _shared()
    _check_keys(table, shared)
    own = table.table(command) if command in table else None
    options = _options(parser)
    if own is not None:
        for key in own.keys():  # noqa: SIM118
            if _option(key) not in options:
                raise own.unknown(key, [name.removeprefix("--") for name in options])
    is_used = "channel" in table and "--channels" in options
    for source, not_options in ((table, (*COMMANDS, *_CHANNELS)), (own, ())):
        for key in [] if source is None else source.keys():
            if source is None or key in not_options:
                continue
            if is_found and _option(key) not in (*shared, *_OF_THE_FIT):
                raise source.wrong(
                    key, f"say it on the command line, or name the file by --config: a {CONFIGURATION} that is found "
                    "gives channels and defaults of the fit"
                )  # fmt: skip
            action = options.get(_option(key))
            if action is None:
                continue
            try:
                value = _value(parser, action, source.value(key), given.configuration.parent)
            except (argparse.ArgumentError, argparse.ArgumentTypeError, ValueError, TypeError) as error:
                why = error.message if isinstance(error, argparse.ArgumentError) else error
                raise FileContentError(f"{source.where}: {key}: {why}") from error
            if is_found and isinstance(value, Path) and not _is_inside(value, given.configuration.parent):
                raise source.wrong(key, f"{value} is not in the folder of this file, which was found and not named")
            if not parser.was_given(action.dest):
                setattr(given, action.dest, value)
                is_used = True
    if is_found and is_used:
        print(f"jointfrf: using {CONFIGURATION} of this folder (--no-config: without it)", file=sys.stderr)
    return given


def _is_inside(path: Path, folder: Path) -> bool:
    return path.resolve().is_relative_to(folder.resolve())


def _path(given: argparse.Namespace) -> Path | None:
    if given.config is not None:
        path = Path(given.config)
        if not path.is_file():
            raise UsageError(f"--config: there is no file {path}")
        return path
    path = Path(CONFIGURATION)
    return path if not given.no_config and path.is_file() else None


def _option(key: str) -> str:
    return "--" + key.replace("_", "-")


def _options(parser: argparse.ArgumentParser) -> dict[str, argparse.Action]:
    return {
        name: action
        for name, action in options_of(parser).items()
        if name.startswith("--") and name not in _NO_DEFAULTS
    }


def _shared() -> dict[str, argparse.Action]:
    """Return the options that say which joint is in a file, which several commands have."""
    from jointfrf.cli.measured_file import add_joint_arguments

    shared = CommandParser(add_help=False)
    add_joint_arguments(shared)
    return _options(shared)


def _check_keys(table: TomlTable, shared: dict[str, argparse.Action]) -> None:
    """Refuse what is neither the table of a command nor an option that several commands share."""
    names = [name.removeprefix("--") for name in (*shared, "--json", "--quiet")]
    for key in table.keys():  # noqa: SIM118
        if key in COMMANDS:
            table.table(key)
        elif key not in _CHANNELS and _option(key).removeprefix("--") not in names:
            raise table.unknown(key, [*names, *_CHANNELS, *COMMANDS])


def _value(parser: CommandParser, action: argparse.Action, value: Any, folder: Path) -> Any:
    """Return a value of the file as the option takes it."""
    if action.nargs == 0:
        if not isinstance(value, bool):
            raise ValueError(f"must be true or false, not {value!r}")
        return value
    if isinstance(action, argparse._AppendAction):
        each = value if isinstance(value, list) and not _is_pair(value) else [value]
        return [_one(parser, action, _text(one, ":"), folder) for one in each]
    return _one(parser, action, _text(value, ","), folder)


def _is_pair(value: list[Any]) -> bool:
    return len(value) == 2 and all(isinstance(one, int | float) for one in value)


def _text(value: Any, between: str) -> str:
    if isinstance(value, list):
        return between.join(_text(one, ":") for one in value)
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise ValueError(f"must be a text, a number or a list of these, not {value!r}")
    return str(value)


def _one(parser: CommandParser, action: argparse.Action, text: str, folder: Path) -> Any:
    found = parser.converted(action, text)
    return folder / found if isinstance(found, Path) else found
