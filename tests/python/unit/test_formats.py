"""A format of files is one module and one line of the table: reading, writing, help and docs find it there."""

import shutil
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest

import jointfrf.io
from command import run_command
from format_table import filled
from jointfrf.choices import FRF_FORMATS, MAPPING_FIELDS, format_names
from jointfrf.io.formats import FORMATS
from new_kinds import FORMAT

ROOT = Path(__file__).resolve().parents[3]
#: Runs code with a copy of the room of files in the place of the installed one.
PROGRAM = """
import sys
from importlib.machinery import PathFinder

class Copy:
    @staticmethod
    def find_spec(name, path, target=None):
        return PathFinder.find_spec(name, path or [sys.argv[1]]) if name.startswith("jointfrf.io.") else (
            PathFinder.find_spec(name, [sys.argv[1]]) if name in ("jointfrf.io", "jointfrf.choices") else None)

sys.meta_path.insert(0, Copy)
sys.path.insert(0, sys.argv[2])
"""
USE = """
from pathlib import Path
import numpy as np
import jointfrf as jf
from jointfrf.workbench.cli.main import main
from format_table import format_table
assert jf.io.__file__.startswith(sys.argv[1])
point = (jf.io.Channel(1, "x"),)
given = jf.io.FrfSet(np.array([1.0, 2.0]), point, point, np.array([1e-3, 2e-3], complex)[:, None, None])
jf.io.write_frfs("a.pairs", given)
Path("a.pairs").rename("a.dat")
assert (jf.io.read_frfs("a.dat").h == given.h).all()
assert main(["convert", "a.dat", "b.npz"]) == 0 and main(["convert", "b.npz", "b.pairs"]) == 0
assert (jf.io.read_frfs("b.pairs").h == given.h).all()
print(format_table())
try:
    jf.io.read_frfs(sys.argv[0])
except jf.FileContentError as error:
    print(error)
try:
    main(["convert", "--help"])
except SystemExit:
    pass
"""


def test_a_format_that_is_added_is_found_everywhere(tmp_path):
    room = tmp_path / "rooms" / "io"
    shutil.copytree(Path(jointfrf.io.__file__).parent, room, ignore=shutil.ignore_patterns("__pycache__"))
    (room / "pairs_file.py").write_text(FORMAT)
    words = (Path(jointfrf.__file__).parent / "choices.py").read_text()
    line = "FRF_FORMATS = {\n"
    assert line in words
    added = '    "pairs_file": _FormatName("Pairs", (".pairs",)),\n}\n'
    table, rest = words.partition(line)[2].split("}\n", 1)
    (room.parent / "choices.py").write_text(words.partition(line)[0] + line + table + added + rest)
    script = tmp_path / "use.py"
    script.write_text(PROGRAM + USE)
    words = [sys.executable, script, room.parent, ROOT / "tests" / "python" / "support"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "| Pairs (.pairs): real FRFs of one point | `write` | `jointfrf[pairs]` |" in done.stdout
    said, help_ = " ".join(done.stdout.split()).split("usage:")
    assert "is of an unknown format; use one of Universal File (.uff .unv)" in said
    assert said.count("and Pairs (.pairs)") == 1
    assert "and Pairs (.pairs)" in help_
    assert "or Pairs (.pairs)" in help_


def test_the_page_has_the_table_of_the_formats():
    page = (ROOT / "docs" / "files.md").read_text(encoding="utf-8")
    assert "<!-- formats -->" in page
    assert filled(page) == page


def test_words_of_the_command_line_are_those_of_the_formats():
    stated = [(each.name, each.suffixes, each.write is not None) for each in FORMATS]
    assert stated == list(FRF_FORMATS.values())
    assert tuple(field.name for field in fields(jointfrf.io.FrfMapping)) == MAPPING_FIELDS


def test_every_suffix_belongs_to_one_format():
    suffixes = [suffix for each in FORMATS for suffix in each.suffixes]
    assert len(set(suffixes)) == len(suffixes)


@pytest.mark.parametrize("command", ["convert", "frf", "couple"])
def test_the_help_lists_the_formats_that_are_written(command):
    done = run_command(command, "--help")
    assert format_names(written=True) in " ".join(done.stdout.split())


def test_a_name_without_a_known_suffix_is_not_written(tmp_path):
    frfs = jointfrf.io.read_frfs(ROOT / "cases" / "hammer-test" / "two_bars.uff")
    for name in ("a", "a.tdms", "a.xlsx"):
        with pytest.raises(
            ValueError, match=r"has no suffix of a format that is written; use one of \.uff, \.unv, \.mat"
        ):
            jointfrf.io.write_frfs(tmp_path / name, frfs)
    jointfrf.io.write_frfs(tmp_path / "A.CSV", frfs)
    assert jointfrf.io.read_frfs(tmp_path / "A.CSV").responses == frfs.responses
