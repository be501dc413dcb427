"""`jointfrf.toml`: the channels and defaults of a project, over which every word of the command line wins."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jointfrf.workbench.cli.arguments.declaration import Arguments, DeclaredArgument, declared
from jointfrf.workbench.cli.arguments.measured_file import JointArguments
from jointfrf.workbench.cli.parser import COMMANDS, CommandParser
from jointfrf.workbench.cli.usage import UsageError

if TYPE_CHECKING:
    from jointfrf.toml.table import TomlTable

__all__ = ["CONFIGURATION", "with_configuration"]

#: Looked for in the working directory.
CONFIGURATION = "jointfrf.toml"
#: Options that are not defaults of anything.
_NO_DEFAULTS = ("config", "no_config")
#: Keys of a table of channels, which may be in the same file; without channels `unit` is the one of the FRFs.
_CHANNELS = ("unit", "channel")
#: What a file that was found, not named, may set beside which joint is in the FRFs: it may be a stranger's.
_OF_THE_FIT = ("method", "damping", "cross", "noise", "floor", "bending_stiffness")


def with_configuration(args: argparse.Namespace, parser: CommandParser, command: str) -> argparse.Namespace:
    """Fill in options that the command line lacks from the configuration; `args.configuration` is its path.

    A file that was found, not named, is mentioned on standard error where it sets something. It gives channels and
    defaults of the fit: nothing that is written, no executor, no file outside its folder.

    Parameters
    ----------
    args : Namespace
        Values of the command line, absent options at their defaults.
    parser : CommandParser
        Parser of the command.
    command : str
        Its name.

    Raises
    ------
    FileContentError
        The file cannot be read, or a key or value in it is wrong, or only a file that is named may contain it.
    UsageError
        There is no file of the name given.
    """
    args.configuration = path = _path(args)
    typed = set(args.given)
    if path is None:
        return args
    from jointfrf.toml.table import read_toml

    table, is_found = read_toml(path), args.config is None
    options = {one.name: one for one in declared(parser.kind) if not one.is_positional and one.name not in _NO_DEFAULTS}
    shared = [one.name for one in declared(JointArguments) if one.group is not Arguments]
    own = table.table(command) if command in table.content else None
    _check_keys(table, own, shared, options)
    is_used = "channel" in table.content and "channels" in options
    of_channels = _CHANNELS if "channel" in table.content else ()
    everywhere = [(table, key) for key in table.content if key not in (*COMMANDS, *of_channels)]
    for source, key in everywhere + ([(own, key) for key in own.content] if own else []):
        name = key.replace("-", "_")
        if is_found and name not in (*shared, *_OF_THE_FIT):
            raise source.wrong(
                key, f"not taken from a {CONFIGURATION} in the working directory; give it on the command line, or "
                "name the file by --config"
            )  # fmt: skip
        if name not in options:
            continue
        value = _value(source, key, options[name], path.parent)
        if is_found and isinstance(value, Path) and not value.resolve().is_relative_to(path.parent.resolve()):
            raise source.wrong(key, f"{value} is not in the folder of this file; name the file by --config")
        if name not in typed:
            setattr(args, name, value)
            args.given.add(name)
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


def _check_keys(table: TomlTable, own: TomlTable | None, shared: Collection[str], options: Collection[str]) -> None:
    """Raise for a key that is no table of a command, no shared option, and in the table of this command no option."""
    names = [name.replace("_", "-") for name in (*shared, "json", "quiet")]
    for key in table.content:
        if key in COMMANDS:
            table.table(key)
        elif key not in _CHANNELS and key.replace("_", "-") not in names:
            raise table.unknown(key, [*names, *_CHANNELS, *COMMANDS])
    for key in own.content if own else ():
        if own and key.replace("-", "_") not in options:
            raise own.unknown(key, [name.replace("_", "-") for name in options])


def _value(source: TomlTable, key: str, option: DeclaredArgument, folder: Path) -> Any:
    """Return a value of the file as the option takes it."""
    from jointfrf.errors import FileContentError

    value = source.content[key]
    try:
        if option.is_flag:
            if not isinstance(value, bool):
                raise ValueError(f"{value!r} is no switch; write true or false")
            return value
        if not option.is_list:
            return _one(option, _text(value, ","), folder)
        is_pair = isinstance(value, list) and len(value) == 2 and all(isinstance(one, int | float) for one in value)
        each = value if isinstance(value, list) and not is_pair else [value]
        return [_one(option, _text(one, ":"), folder) for one in each]
    except (argparse.ArgumentTypeError, ValueError, TypeError) as error:
        raise FileContentError(f"{source.where}: {key}: {error}") from error


def _text(value: Any, between: str) -> str:
    if isinstance(value, list):
        return between.join(_text(one, ":") for one in value)
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise ValueError(f"{value!r} is no option value; write a text, a number or a list")
    return str(value)


def _one(option: DeclaredArgument, text: str, folder: Path) -> Any:
    found = option.form.parse(text)
    return folder / found if isinstance(found, Path) else found
