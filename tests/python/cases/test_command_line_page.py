"""docs/command-line.md names every command, and its tables of options are those of the parsers."""

import re
import shlex

from command import run_command
from documents import DOCUMENTS, ROOT
from jointfrf.cli.configuration import with_configuration
from jointfrf.cli.parser import COMMANDS, command_parser
from jointfrf.io.channel_table import places_of_table, read_channel_table
from jointfrf.toml.table import read_toml
from option_tables import commands_with_a_table, filled

PAGE = DOCUMENTS["docs/command-line.md"]


def test_every_command_has_its_table():
    assert commands_with_a_table(PAGE) == set(COMMANDS)
    for name in COMMANDS:
        assert f"\n## {name}\n" in PAGE
        assert f"| [`{name}`](#{name}) |" in PAGE


def test_tables_are_those_of_the_parsers():
    assert filled(PAGE) == PAGE, "python tests/python/support/option_tables.py docs/command-line.md"


def test_a_page_that_is_old_is_seen():
    assert filled(PAGE.replace("| `--band", "| `--bnad")) == PAGE


def commands_shown():
    """Commands of all blocks of all documents, fragments among them, as words."""
    for page in DOCUMENTS.values():
        for block in re.findall(r"```(?:sh|text|console)(?: fragment)?\n(.*?)```", page, re.DOTALL):
            for line in block.replace("\\\n", " ").splitlines():
                if not line.removeprefix("$ ").startswith("jointfrf "):
                    continue
                line = re.sub(r"\$\(\(.*?\)\)|\$\w+", "4", line.removeprefix("$ "))
                words = shlex.split(line, comments=True)
                if len(words) > 1 and words[1] in COMMANDS:
                    yield words[1 : words.index(">")] if ">" in words else words[1:]


def test_commands_shown_are_understood():
    shown = list(commands_shown())
    assert {words[0] for words in shown} >= {"identify", "check", "convert", "export", "couple", "decouple", "frf"}
    for words in shown:
        command_parser(words[0]).parse_words(words[1:])  # ends the test where it is wrong


def test_check_prints_what_is_shown(monkeypatch):
    monkeypatch.chdir(ROOT)
    (shown,) = (text for text in re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL) if "$ jointfrf check" in text)
    command, expected = shown.removeprefix("$ ").split("\n", 1)
    result = run_command(*shlex.split(command)[1:])
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout == expected


def test_the_files_shown_are_read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (project,) = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    (tmp_path / "jointfrf.toml").write_text(project)
    parser = command_parser("identify")
    options = with_configuration(parser.parse_words(["test.uff"]), parser, "identify")
    assert options.dofs == ["x", "y", "z", "theta_x", "theta_y", "theta_z"]
    assert (options.at, options.band, options.damping) == ((0.0625, 0.0, 0.0), [(20.0, 1000.0)], "viscous")
    assert len(places_of_table(read_toml(options.configuration))) == 3
    (table,) = (text for text in re.findall(r"```text\n(.*?)```", PAGE, re.DOTALL) if text.startswith("channel,"))
    (tmp_path / "channels.csv").write_text(table)
    places = read_channel_table(tmp_path / "channels.csv")
    assert [str(place.channel) for place in places] == ["101:+x", "111:-z"]
