"""docs/command-line.md names every command, and its tables of options are those of the parsers."""

import re
import shlex

import pytest

from command import run_command
from documents import DOCUMENTS, ROOT
from jointfrf.io.channel_table import places_of_table, read_channel_table
from jointfrf.toml.table import read_toml
from jointfrf.workbench.cli.configuration import with_configuration
from jointfrf.workbench.cli.parser import COMMANDS, command_parser
from option_tables import commands_with_a_table, filled

PAGE = DOCUMENTS["docs/command-line.md"]


def test_every_command_has_its_table():
    assert commands_with_a_table(PAGE) == set(COMMANDS)
    for name in COMMANDS:
        assert f"\n## {name}\n" in PAGE
        assert f"| [`{name}`](#{name}) |" in PAGE


def test_tables_are_those_of_the_parsers():
    assert filled(PAGE) == PAGE, "python tests/python/support/option_tables.py docs/command-line.md"


@pytest.mark.parametrize("command", COMMANDS)
def test_help_states_usage_defaults_and_examples(command):
    """Required options have no brackets, the parser writes the defaults, and each command has an example."""
    parser = command_parser(command)
    text = parser.format_help()
    usage = text.partition("\n\n")[0]
    assert "[--" not in usage
    assert all(name in usage for names in parser.kind.ways for name in names)
    for action in parser.arguments:
        stated = re.findall(r"\(default[^)]*\)", action.help)
        value = action.default
        if action.option_strings and action.dest != "help" and value not in (None, [], False):
            assert len(stated) == 1
        assert action.help.endswith("".join(stated)), "option(otherwise=...) states a default in words"
        assert len(stated) <= 1
        shown = f" {action.metavar} " if action.metavar else f"{{{','.join(map(str, action.choices or ()))}}}"
        if action.nargs != 0 and action.option_strings:
            assert shown.strip() in text
    assert parser.kind.examples
    for example in parser.kind.examples:
        assert example in text
        parser.parse_words(shlex.split(example.partition(" > ")[0])[2:])


def test_examples_of_the_help_run(tmp_path, monkeypatch):
    """One after another in one folder, next to the files that come with the project."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    for command in COMMANDS:
        if command in ("run", "study"):  # of cases whose tests run elsewhere
            continue
        for example in command_parser(command).kind.examples:
            words = shlex.split(example.partition(" > ")[0])[1:]
            if words[:2] == ["levels", "--table"]:  # of docs/levels.md, which is a test
                continue
            result = run_command(*words)
            assert result.returncode == 0, (example, result.stderr)
    made = {path.name for path in tmp_path.iterdir()}
    assert made >= {"joint.json", "bars.npz", "joint.bdf", "joint.inp", "assembly.uff", "a.uff", "my-case"}


def test_options_that_the_only_way_to_call_a_command_requires(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run_command("couple", "a.toml", "b.toml", "--joint", "j.toml", "--j", "1")
    wanted = "jointfrf couple A B --joint FILE --j NODES --k NODES --output FILE"
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == f"jointfrf: error: --k and --output are missing: {wanted}\n"
    (tmp_path / "own.toml").write_text("[couple]\nk = 1\noutput = 'c.npz'\n")  # whoever gives them
    result = run_command("couple", "a.toml", "b.toml", "--joint", "j.toml", "--j", "1", "--config", "own.toml")
    assert "are missing" not in result.stderr
    assert (result.returncode, "j.toml" in result.stderr) == (1, True)


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
