"""Options declared as fields: what parser, configuration and calls make of them."""

from pathlib import Path
from typing import Annotated, Literal

import pytest

from jointfrf.workbench.cli.arguments.declaration import Arguments, Form, declared, option, positional
from jointfrf.workbench.cli.arguments.words import Band, Count, NewFile
from jointfrf.workbench.cli.configuration import with_configuration
from jointfrf.workbench.cli.parser import CommandParser
from jointfrf.workbench.cli.usage import UsageError


class Solver(Arguments):
    heading = "the solver"

    tolerance: float = option("largest error", "SHARE", 0.5, keyword="rtol")
    damping: Literal["none", "some"] = option("damping terms", default="none")
    verbose: bool = option("print steps", default=False)


class Spring(Solver):
    description = "Fit a spring."
    ways = (("--band",),)
    examples = ("spring a.txt",)

    files: list[Path] = positional("files of springs", "FILE")
    band: list[Band] = option("bands")
    steps: Count | None = option("number of steps", otherwise="all")
    names: Annotated[list[str], Form("A;B", lambda word: word.split(";"))] = option("names", default=["x"])
    save: NewFile | None = option("file for the spring")


@pytest.fixture
def parser():
    found = CommandParser(prog="spring")
    found.declare(Spring)
    return found


def arguments(parser, *words):
    return parser.arguments_of(with_configuration(parser.parse_words(words), parser, "check"))


def test_a_field_is_an_option(parser, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    args = arguments(parser, "a.txt", "b.txt", "--band", "1:2", "--band", "3:4", "--names", "y;z", "--verbose")
    assert isinstance(args, Spring)
    assert (args.files, args.band, args.names) == ([Path("a.txt"), Path("b.txt")], [(1.0, 2.0), (3.0, 4.0)], ["y", "z"])
    assert (args.tolerance, args.damping, args.verbose, args.steps, args.save) == (0.5, "none", True, None, None)
    assert args.given == {"band", "names", "verbose"}
    assert args.keywords(Solver) == {"rtol": 0.5, "damping": "none", "verbose": True}
    assert args.changed(Solver) == ["--verbose"]
    assert Solver.names() == ["--tolerance", "--damping", "--verbose"]
    assert arguments(parser, "a.txt", "--band", "1:2").names == ["x"]


def test_help_has_the_groups_in_their_order(parser):
    text = parser.format_help()
    assert text.startswith("usage: spring FILE [FILE ...] --band LOW:HIGH [options]\n\nFit a spring.\n")
    places = [text.index(part) for part in ("--band", "--names A;B", "the solver:", "--tolerance SHARE", "--json")]
    assert places == sorted(places)
    assert "number of steps (default: all)" in text
    assert "largest error (default: 0.5)" in text
    assert "--damping {none,some}" in text
    assert text.endswith("\nexamples:\n  spring a.txt\n")
    assert [one.name for one in declared(Spring)][:2] == ["files", "band"]


def test_a_configuration_has_the_fields_as_keys(parser, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("own.toml").write_text('[check]\nband = [[1, 2], "3:4"]\nsteps = 5\nverbose = true\nsave = "s.json"\n')
    args = arguments(parser, "a.txt", "--config", "own.toml", "--steps", "7")
    assert (args.band, args.steps, args.verbose) == ([(1.0, 2.0), (3.0, 4.0)], 7, True)
    assert args.save == Path("s.json")
    assert args.given == {"config", "band", "steps", "verbose", "save"}


def test_a_required_option_and_a_file_that_cannot_be_written_are_errors(parser, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UsageError, match="--band is missing: spring FILE"):
        arguments(parser, "a.txt")
    with pytest.raises(UsageError, match="--save: folder none does not exist"):
        arguments(parser, "a.txt", "--band", "1:2", "--save", "none/a.json").check_files()


def test_a_word_that_is_no_number_is_an_error_with_a_remedy(parser, capsys):
    with pytest.raises(SystemExit, match="2"):
        parser.parse_words(["a.txt", "--tolerance", "5%"])
    assert "argument --tolerance: '5%' is not a number; use a number such as 0.05" in capsys.readouterr().err
