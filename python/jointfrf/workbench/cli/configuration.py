"""`jointfrf.toml`: the channels and defaults of a project, over which every word of the command line wins."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointfrf.workbench.cli.parser import COMMANDS, CommandParser
from jointfrf.workbench.cli.usage import UsageError

if TYPE_CHECKING:
    from jointfrf.toml.table import TomlTable

__all__ = ["CONFIGURATION", "with_configuration"]

#: Looked for in the working directory.
CONFIGURATION = "jointfrf.toml"
#: Options that are not defaults of anything.
_NO_DEFAULTS = ("--help", "-h", "--config", "--no-config")
#: Keys of a table of channels, which may be in the same file; without channels `unit` is the one of the FRFs.
_CHANNELS = ("unit", "channel")
#: What a file that was found, not named, may set beside which joint is in the FRFs: it may be a stranger's.
_OF_THE_FIT = ("--method", "--damping", "--cross", "--noise", "--floor", "--bending-stiffness")


def with_configuration(args: argparse.Namespace, parser: CommandParser, command: str) -> argparse.Namespace:
    """Fill in what the command line does not say from the configuration; `args.configuration` is its path.

    A file that was found, not named, is mentioned on standard error where it sets something. It gives channels and
    defaults of the fit: nothing that is written, no executor, no file outside its folder.

    Parameters
    ----------
    args : Namespace
        What the command line says, absent options at their defaults.
    parser : CommandParser
        Of the command.
    command : str
        Its name.

    Raises
    ------
    FileContentError
        The file cannot be read, or a key or value in it is wrong, or only a file that is named may hold it.
    UsageError
        There is no file of the name given.
    """
    args.configuration = path = _path(args)
    if path is None:
        return args
    from jointfrf.toml.table import read_toml

    table, is_found = read_toml(path), args.config is None
    options, shared = _options(parser), _shared()
    own = table.table(command) if command in table.content else None
    _check_keys(table, own, shared, options)
    typed, is_used = set(args.given), "channel" in table.content and "--channels" in options
    of_channels = _CHANNELS if "channel" in table.content else ()
    everywhere = [(table, key) for key in table.content if key not in (*COMMANDS, *of_channels)]
    for source, key in everywhere + ([(own, key) for key in own.content] if own else []):
        if is_found and _option(key) not in (*shared, *_OF_THE_FIT):
            raise source.wrong(
                key, f"not taken from a {CONFIGURATION} in the working directory; give it on the command line, or "
                "name the file by --config"
            )  # fmt: skip
        action = options.get(_option(key))
        if action is None:
            continue
        value = _value(source, key, action, path.parent, is_list=action.dest in parser.repeated)
        if is_found and isinstance(value, Path) and not value.resolve().is_relative_to(path.parent.resolve()):
            raise source.wrong(key, f"{value} is not in the folder of this file; name the file by --config")
        if action.dest not in typed:
            setattr(args, action.dest, value)
            args.given.add(action.dest)
            is_used = True
    if is_found and is_used:
        print(f"jointfrf: using {CONFIGURATION} of this folder (--no-config: without it)", file=sys.stderr)
    return args


def _path(args: argparse.Namespace) -> Path | None:
    if args.config is not None:
        path = Path(args.config)
        if not path.is_file():
            raise UsageError(f"--config: file {path} does not exist; give the name of a file")
        return path
    path = Path(CONFIGURATION)
    return path if not args.no_config and path.is_file() else None


def _option(key: str) -> str:
    return "--" + key.replace("_", "-")


def _options(parser: CommandParser) -> dict[str, argparse.Action]:
    return {name: action for name, action in parser.options.items() if name not in _NO_DEFAULTS}


def _shared() -> dict[str, argparse.Action]:
    """Return the options that say which joint is in a file, which several commands have."""
    from jointfrf.workbench.cli.arguments.measured_file import add_joint_arguments

    shared = CommandParser(add_help=False)
    add_joint_arguments(shared)
    return _options(shared)


def _check_keys(
    table: TomlTable, own: TomlTable | None, shared: dict[str, argparse.Action], options: dict[str, argparse.Action]
) -> None:
    """Raise for a key that is no table of a command, no shared option, and in the table of this command no option."""
    names = [name.removeprefix("--") for name in (*shared, "--json", "--quiet")]
    for key in table.content:
        if key in COMMANDS:
            table.table(key)
        elif key not in _CHANNELS and _option(key).removeprefix("--") not in names:
            raise table.unknown(key, [*names, *_CHANNELS, *COMMANDS])
    for key in own.content if own else ():
        if own and _option(key) not in options:
            raise own.unknown(key, [name.removeprefix("--") for name in options])


def _value(source: TomlTable, key: str, action: argparse.Action, folder: Path, *, is_list: bool) -> Any:
    """Return a value of the file as the option takes it."""
    from jointfrf.errors import FileContentError

    value = source.content[key]
    try:
        if action.nargs == 0:
            if not isinstance(value, bool):
                raise ValueError(f"{value!r} is no switch; write true or false")
            return value
        if not is_list:
            return _one(action, _text(value, ","), folder)
        is_pair = isinstance(value, list) and len(value) == 2 and all(isinstance(one, int | float) for one in value)
        each = value if isinstance(value, list) and not is_pair else [value]
        return [_one(action, _text(one, ":"), folder) for one in each]
    except (argparse.ArgumentTypeError, ValueError, TypeError) as error:
        raise FileContentError(f"{source.where}: {key}: {error}") from error


def _text(value: Any, between: str) -> str:
    if isinstance(value, list):
        return between.join(_text(one, ":") for one in value)
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise ValueError(f"{value!r} is no option value; write a text, a number or a list")
    return str(value)


def _one(action: argparse.Action, text: str, folder: Path) -> Any:
    kind: Any = action.type or str
    found = kind(text)
    return folder / found if isinstance(found, Path) else found
