"""Declaration of options as fields of typed classes, from which parser, configuration and documents are made."""

import argparse
import inspect
import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import MISSING, Field, dataclass, field, fields
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, dataclass_transform, get_args, get_origin

from jointfrf.extras import check_extras
from jointfrf.spelling import did_you_mean

__all__ = ["Arguments", "DeclaredArgument", "Form", "declared", "flag", "number", "one_of", "option", "positional"]


class Form(NamedTuple):
    """Conversion of a word to a value, as metadata of `Annotated`.

    Attributes
    ----------
    metavar : str
        Stands for the word in help and usage.
    parse : callable
        Returns the value of a word, or raises ArgumentTypeError.
    check : callable or None
        Checks a file to be written before the command starts; takes the name of the option and the value.
    choices : tuple of str or None
        The words there are.
    packages : tuple of str
        Packages that write the file.
    """

    metavar: str
    parse: Callable[[str], Any]
    check: Callable[[str, Any], None] | None = None
    choices: tuple[str, ...] | None = None
    packages: tuple[str, ...] = ()


def one_of(known: Collection[str]) -> Callable[[str], str]:
    """Return the parser of a word that must be a known one."""

    def parse(word: str) -> str:
        if word not in known:
            hint = did_you_mean(word, known)
            raise argparse.ArgumentTypeError(f"unknown value {word!r}; use one of {', '.join(known)}{hint}")
        return word

    return parse


def number(holds: Callable[[float], bool], fault: str) -> Callable[[str], float]:
    """Return the parser of a finite number that meets a condition; the fault ends the message of any other word."""

    def parse(word: str) -> float:
        try:
            found = float(word)
        except ValueError:
            found = math.inf
        if not (math.isfinite(found) and holds(found)):
            raise argparse.ArgumentTypeError(f"{word!r} {fault}")
        return found

    return parse


def _number_of(kind: type, fault: str) -> Callable[[str], Any]:
    def parse(word: str) -> Any:
        try:
            return kind(word)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{word!r} {fault}") from None

    return parse


#: Parsers of numbers without a condition: the library checks the value.
_NUMBERS: dict[type, Callable[[str], Any]] = {
    float: _number_of(float, "is not a number; use a number such as 0.05"),
    int: _number_of(int, "is not a whole number; use a number such as 3"),
}


def option(text: str, metavar: str = "", default: Any = None, *, otherwise: str = "", keyword: str = "") -> Any:
    """Declare a field as an option, whose name is the name of the field.

    The annotation gives the kind: `bool` a flag, `Literal` its choices, `list[...]` an option that may be repeated,
    `Annotated[..., Form(...)]` or a type the parser of a word.

    Parameters
    ----------
    text : str
        Its help, to which the default is appended.
    metavar : str
        Stands for the value; the metavar of the `Form` by default.
    default : optional
        Value without the option.
    otherwise : str
        The default in words, if it is no value: "all cores".
    keyword : str
        Name in calls of Python; the name of the field by default.
    """
    about = {"help": text, "metavar": metavar, "otherwise": otherwise, "keyword": keyword}
    if isinstance(default, list):
        return field(default_factory=default.copy, metadata=about)
    return field(default=default, metadata=about)


def flag(text: str) -> Any:
    """Declare a field as an option without a value."""
    return option(text, default=False)


def positional(text: str, metavar: str, *, optional: bool = False) -> Any:
    """Declare a field as a positional argument: a list takes several words."""
    about = {"help": text, "metavar": metavar, "is_positional": True}
    return field(default=None, metadata=about) if optional else field(metadata=about)


_GIGABYTES = Form("GB", number(lambda found: found > 0, "is not a number above 0; use a size in GB"))


@dataclass_transform(kw_only_default=True, field_specifiers=(option, flag, positional, field))
class Arguments:
    """The arguments of a command; groups of them are bases, whose options follow in the help.

    Attributes
    ----------
    description, usage : str
        In the help; the usage follows from `ways` unless stated.
    heading : str
        Heading of the help above the options of this class; empty: they continue the section before.
    ways : tuple of tuple of str
        Ways to call the command: the options that each one requires.
    examples : tuple of str
        Command lines that run next to the files that they name.
    given : frozenset of str
        Names of the options that the command line or the configuration gave.
    configuration : Path or None
        The file `jointfrf.toml`.
    typed : str
        The command line.
    warned : list of str
        Warnings so far.
    stop_if_interrupted : callable
        Raises KeyboardInterrupt after Ctrl-C.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]

    description: ClassVar[str] = ""
    usage: ClassVar[str] = ""
    heading: ClassVar[str] = "output and defaults"
    ways: ClassVar[tuple[tuple[str, ...], ...]] = ()
    examples: ClassVar[tuple[str, ...]] = ()

    given: frozenset[str] = frozenset()
    configuration: Path | None = None
    typed: str = ""
    warned: list[str] = field(default_factory=list)
    stop_if_interrupted: Callable[[], None] = lambda: None

    json: bool = flag("print the result as JSON")
    quiet: bool = flag("print only warnings and errors, no progress")
    config: str | None = option(
        "channels and default options of a project",
        "FILE",
        otherwise="jointfrf.toml in the working directory, if it exists",
    )
    no_config: bool = flag("ignore jointfrf.toml")
    limit_gb: Annotated[float, _GIGABYTES] | None = option(
        "largest size of one file, and largest memory to read it",
        otherwise="16 GB; the larger of 1 GB and 10 times the file",
    )

    def __init_subclass__(cls) -> None:
        dataclass(kw_only=True, eq=False, repr=False)(cls)

    def keywords(self, group: "type[Arguments]") -> dict[str, Any]:
        """Return the options of a group as keyword arguments."""
        return {one.keyword: getattr(self, one.name) for one in declared(group) if one.group is not Arguments}

    def changed(self, group: "type[Arguments]") -> list[str]:
        """Return the names of the options of a group whose values are not the defaults."""
        own = [one for one in declared(group) if one.group is not Arguments]
        return [one.flag for one in own if getattr(self, one.name) != one.default]

    def gave(self, names: Iterable[str]) -> list[str]:
        """Return the options among these names that were given."""
        return [name for name in names if name.removeprefix("--").replace("-", "_") in self.given]

    @classmethod
    def names(cls) -> list[str]:
        """Return the names of the options, without the common options."""
        return [one.flag for one in declared(cls) if one.group is not Arguments and not one.is_positional]

    def check_files(self) -> None:
        """Check that the files that the options name can be written.

        Raises
        ------
        UsageError, MissingPackageError
        """
        for one in declared(type(self)):
            value = getattr(self, one.name)
            if value is not None and one.form.check is not None:
                one.form.check(one.flag, value)
                check_extras(*one.form.packages)


dataclass(kw_only=True, eq=False, repr=False)(Arguments)


class DeclaredArgument(NamedTuple):
    """An option or positional argument as it was declared, with the form of its word."""

    name: str
    help: str
    metavar: str
    default: Any
    otherwise: str
    keyword: str
    is_positional: bool
    is_optional: bool
    is_list: bool
    is_flag: bool
    form: Form
    group: type[Arguments]
    heading: str

    @property
    def flag(self) -> str:
        """Name on the command line: ``--at-k``."""
        return f"--{self.name.replace('_', '-')}"


def declared(kind: type[Arguments]) -> tuple[DeclaredArgument, ...]:
    """Return positional arguments, bases first, then options, the class first; each is returned once."""
    known, found, heading = {one.name: one for one in fields(kind) if one.metadata}, dict[str, DeclaredArgument](), ""
    for group in kind.__mro__[:-1]:
        heading = vars(group).get("heading", heading)
        for name, hint in inspect.get_annotations(group).items():
            if name in known and name not in found:
                found[name] = _declared(known[name], hint, group, heading)
    words = [one for one in found.values() if one.is_positional]
    words.sort(key=lambda one: -kind.__mro__.index(one.group))
    return (*words, *(one for one in found.values() if not one.is_positional))


def _declared(one: Any, hint: Any, group: type[Arguments], heading: str) -> DeclaredArgument:
    """Return a field with the kind of value that its annotation states."""
    about: dict[str, Any] = {"otherwise": "", "keyword": "", "is_positional": False} | dict(one.metadata)
    required = one.default is MISSING and one.default_factory is MISSING
    default = None if required else one.default if one.default_factory is MISSING else one.default_factory()
    inner = _without_none(hint)
    is_list = get_origin(inner) is list
    inner = _without_none(get_args(inner)[0]) if is_list else inner
    form = Form("FILE" if inner is Path else "", _NUMBERS.get(inner, inner))
    if get_origin(inner) is Literal:
        form = Form("", one_of(get_args(inner)), choices=get_args(inner))
    elif get_origin(inner) is Annotated:
        form = next(one for one in inner.__metadata__ if isinstance(one, Form))
    about["metavar"] = about["metavar"] or form.metavar
    about["keyword"] = about["keyword"] or one.name
    return DeclaredArgument(
        name=one.name, default=default, is_optional=not required, is_list=is_list, is_flag=inner is bool,
        form=form, group=group, heading=heading, **about,
    )  # fmt: skip


def _without_none(hint: Any) -> Any:
    inner = [one for one in get_args(hint) if one is not NoneType]
    return inner[0] if NoneType in get_args(hint) else hint
