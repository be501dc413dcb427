"""The tutorial from two decks to the corrected model, run as it stands, and the files that it starts from."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from documents import DOCUMENTS, ROOT, agree, blocks
from jointfrf.io import read_frfs

DECKS = ROOT / "cases" / "two-decks"
TUTORIAL = DOCUMENTS["docs/tutorial.md"]
needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not on PATH")


@pytest.fixture(scope="module")
def make():
    spec = importlib.util.spec_from_file_location("make_two_decks", DECKS / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_decks_are_what_make_writes(make):
    for bar in "ab":
        assert (DECKS / f"{bar}.inp").read_text() == make.deck(bar)
        assert (DECKS / f"store_{bar}.inp").read_text() == make.STORE.format(bar=bar)
    assert sum(path.stat().st_size for path in DECKS.iterdir() if path.is_file()) < 130_000


@needs_ccx
@pytest.mark.long
def test_the_test_is_what_make_writes(make):
    held, made = read_frfs(DECKS / "test.uff"), make.measured()
    np.testing.assert_allclose(held.h, made.h, rtol=1e-5)
    np.testing.assert_allclose(held.coordinates[4], [0, 0.024, 0.39])


def test_the_part_that_the_page_shows_is_the_shipped_one():
    (shown,) = blocks("toml", TUTORIAL)
    plain = [re.sub(r" *#.*", "", text) for text in (shown, (DECKS / "assembly.toml").read_text())]
    assert all(line in plain[1].splitlines() for line in plain[0].splitlines())


@needs_ccx
@pytest.mark.long
def test_the_commands_give_what_is_shown(tmp_path, make):
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    copy, store, identify, correct = blocks("sh", TUTORIAL)
    printed = []
    for commands, folder in ((copy, tmp_path), *((one, tmp_path / "my-lap") for one in (store, identify, correct))):
        done = subprocess.run(["sh", "-e"], input=commands, cwd=folder, env=environment, capture_output=True, text=True,
                              check=False)  # fmt: skip
        assert done.returncode == 0, done.stderr
        printed.append(done.stdout)
    fit, frequencies = blocks("text", TUTORIAL)
    found = printed[2][printed[2].index("method model") : printed[2].index("wrote joint.inp")]
    agree(found.split("note:")[0], fit.split("note:")[0])  # which correlation is the largest, rounding decides
    intervals = {row.split()[0]: row.split() for row in found.splitlines() if " .. " in row}
    for name, true in make.STIFFNESS.items():
        low, high = (float(intervals[f"k_{name}"][i]) for i in (3, 5))
        assert low < true < high
        low, high = (float(intervals[f"eta_{name}"][i]) for i in (3, 5))
        assert low < make.JOINT_LOSS[name] < high
    agree(printed[3].split("\n", 1)[0], frequencies.split("\n", 1)[0])
    rows, said = (np.array([[float(x) for x in re.findall(r"[-+]?\d+\.\d+", row)] for row in text.splitlines()[1:]])
                  for text in (printed[3], frequencies))  # fmt: skip
    np.testing.assert_allclose(rows[:, [0, 1, 3]], said[:, [0, 1, 3]], rtol=0, atol=0.11)  # the last digit
    assert (abs(rows[:, 4]) <= 0.05).all()  # the corrected model, %
    assert abs(rows[:, 2]).max() > 20  # the rigid lap
