"""A message to a user has a bounded length, whatever a file contains, and its remedy is not lost."""

import numpy as np
import pytest

from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.io import read_frfs
from jointfrf.spelling import LONGEST_MESSAGE, cut, message
from jointfrf.workbench.cli.usage import complain


@pytest.mark.parametrize("kind", [FileContentError, FileContentWarning])
@pytest.mark.parametrize("text", [100_000 * "a", 3000 * "\x1b", 3000 * "\n", 1500 * "\u2028"])
def test_errors_and_warnings_of_files_are_bounded(kind, text):
    found = str(kind(f"a.npz: {text}; give mapping h=..."))
    assert len(found) <= LONGEST_MESSAGE
    assert found.startswith("a.npz: ")
    assert found.endswith("; give mapping h=...")
    assert found.isprintable()


@pytest.mark.parametrize("text", ["", "short", LONGEST_MESSAGE * "a"])
def test_what_is_short_enough_is_not_changed(text):
    assert message(text) == cut(text) == text
    assert len(cut(text + "a", max(len(text), 5))) <= max(len(text), 5)


def test_the_command_line_prints_no_more(capsys):
    complain("error", f"unknown option {100_000 * 'a'}; leave it out")
    printed = capsys.readouterr().err
    assert len(printed) < LONGEST_MESSAGE + 100
    assert printed.endswith("; leave it out\n")


@pytest.mark.parametrize("name", [50_000 * "n", "\x1b]0;" + 50_000 * "n"])
def test_files_with_long_names_inside(tmp_path, name):
    """Fields, units, quantities and channels of a stranger."""
    path = tmp_path / "a.npz"
    fields = {"f": [1.0, 2.0], "h": np.ones((2, 1, 1)), "responses": ["1:x"], "excitations": ["1:x"], "unit": "m/N"}
    for change in ({"unit": name}, {"quantity": name}, {"responses": [name]}, {"f": name}):
        np.savez(path, **(fields | change))
        with pytest.raises(FileContentError) as caught:
            read_frfs(path, mapping={"h": "h"})
        assert len(str(caught.value)) <= LONGEST_MESSAGE
    np.savez(path, **{name.replace("\x1b", "e"): 1, f"{name[1:]}2": 2})
    with pytest.raises(FileContentError, match="no field for the frequencies") as caught:
        read_frfs(path)
    assert len(str(caught.value)) <= LONGEST_MESSAGE
