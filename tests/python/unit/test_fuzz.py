"""The attack of tests/fuzz in its short form: a few seconds of each part."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

pytest.importorskip("h5py")

from fuzz import drills
from fuzz.part import BrokenError, random_of
from fuzz.parts import PARTS, make_part
from fuzz.python_calls import public_callables
from fuzz.watch import Found, attack

SHORT = {"calls": 150, "files": 150, "abi": 1500, "overlaps": 50, "commands": 20}
linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="processes and limits of Linux")


@pytest.mark.parametrize("name", PARTS)
def test_nothing_breaks(tmp_path, name, monkeypatch):
    monkeypatch.chdir(tmp_path)  # a random path is a file there
    part = make_part(name, tmp_path)
    found = {part.run(random_of(11, number)) for number in range(SHORT[name])}
    assert len(found) > 1, found


def test_every_public_function_is_called(tmp_path, monkeypatch):
    """With sound arguments each function answers, so that what is spoiled later would be a result."""
    monkeypatch.chdir(tmp_path)
    part = make_part("calls", tmp_path)
    functions = {name for name, each in public_callables().items() if not isinstance(each, type)}
    assert functions <= {each.name for each in part.callables}
    assert functions <= part.sound.keys() | {"get_engine"}
    assert {part.with_sound_arguments(each) for each in part.callables} == {"result"}


def test_what_breaks_is_said(tmp_path, monkeypatch):
    """An error of a foreign kind, arguments that are changed, results that differ: none would pass."""
    monkeypatch.chdir(tmp_path)
    part = make_part("calls", tmp_path)
    broken = {
        "invert": lambda a, **_: {}["x"],
        "solve": lambda a, b, **_: a.__setitem__(0, 1) if isinstance(a, np.ndarray) and a.flags.writeable else None,
        "reciprocal_condition": lambda a: np.random.default_rng().random(),
    }
    for each in part.callables:
        monkeypatch.setattr(each, "call", broken.get(each.name, each.call))
    seen = set()
    for number in range(500):
        try:
            part.call(
                part.callables[[each.name for each in part.callables].index([*broken][number % 3])],
                random_of(1, number),
            )
        except BrokenError as error:
            seen.add(str(error).split(":")[0].split()[0])
    assert seen == broken.keys()


@pytest.mark.long
def test_a_crash_and_a_hang_are_counted(monkeypatch, tmp_path):
    """The processes are watched from outside; the part stands in a module of its own."""
    (tmp_path / "sitecustomize.py").write_text(
        "import os, time\nimport fuzz.parts\n"
        "class Bad:\n"
        "    def run(self, random):\n"
        "        number = int(random.bit_generator.state['state']['counter'][1])\n"
        "        if number == 3: os.abort()\n"
        "        if number == 5: time.sleep(600)\n"
        "        return 'result'\n"
        "fuzz.parts.make_part = lambda name, folder: Bad()\n"
    )
    tests = str(Path(__file__).resolve().parents[2])
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{tests}")
    found = attack("calls", 8, longest=3.0)
    assert (found.crashes, found.hangs, found.cases) == (1, 1, 8)
    assert ["--first 3" in found.broken[0], "--first 5" in found.broken[1]] == [True, True]


@pytest.mark.long
@linux
@pytest.mark.parametrize(("name", "count"), [("kills", 1), ("disk-full", 1), ("unwritable", 1)])
def test_drills(name, count):
    found = drills.run_drill(name, count)
    assert found.broken == []
    assert found.counts.total() >= 1


@linux
def test_a_second_set_up_needs_no_network():
    """That of this checkout, where it was set up by the script at all."""
    stamp = drills.ROOT / ".venv" / "set-up.run"
    read = [
        path for place in ("", "fortran", "fortran/api", "python") for path in (drills.ROOT / place).glob("meson.*")
    ]
    read += [drills.ROOT / "pyproject.toml", drills.ROOT / "python" / "constraints.txt"]
    if not stamp.exists() or any(path.stat().st_mtime > stamp.stat().st_mtime for path in read):
        pytest.skip("this checkout is not as python/bootstrap.sh has set it up")
    process = drills.set_up(drills.ROOT, **drills.OFFLINE)
    text = process.communicate(timeout=900)[0]
    assert (process.returncode, text) == (0, "")


@linux
@pytest.mark.parametrize("name", ["größe-测试", "a $b; c&d"])
def test_two_set_ups_at_an_odd_place_take_turns(tmp_path, name):
    """Both fail, since no interpreter is given: each in a sentence, one after the other, and no lock is left."""
    clone = drills.small_clone(tmp_path / name)
    both = [drills.set_up(clone, PYTHON="/nowhere/python") for _ in range(2)]
    for process in both:
        text = process.communicate(timeout=900)[0]
        assert process.returncode == 1
        assert "PYTHON=/nowhere/python is not Python 3.11 or newer" in text
    assert [path.name for path in (clone / "build").iterdir()] == ["set-up.log"]


def lock_functions() -> str:
    """What the script says of its lock."""
    script = (drills.ROOT / "python" / "bootstrap.sh").read_text()
    start = script.index("# A process of another user")
    return "set -eu\nsay() { :; }\n" + script[start : script.index("# -----", start)]


@linux
@pytest.mark.long  # they wait
def test_of_several_that_wait_for_a_dead_one_one_goes_on(tmp_path):
    """All have seen that the holder is dead before the first of them takes the lock away."""
    gone = subprocess.Popen(["true"])
    gone.wait()
    slow = tmp_path / "bin" / "readlink"
    slow.parent.mkdir()
    slow.write_text(f'#!/bin/sh\n{shutil.which("readlink")} "$@"; status=$?; sleep 0.3; exit $status\n')
    slow.chmod(0o755)
    lock = tmp_path / "lock"
    work = f"""{lock_functions()}
lock={lock}
take_lock
mkdir {tmp_path}/busy || echo "two at a time"
sleep 0.5
rmdir {tmp_path}/busy
"""
    environment = os.environ | {"PATH": f"{slow.parent}:{os.environ['PATH']}"}
    for left in ([], [tmp_path / f"lock.{gone.pid}"]):  # another waiter died when it was about to take it away
        for link in [lock, *left]:
            link.symlink_to(str(gone.pid))
        waiters = []
        for _ in range(3):
            waiters.append(subprocess.Popen(["sh", "-c", work], stdout=subprocess.PIPE, text=True, env=environment))
            time.sleep(0.1)
        for process in waiters:
            assert (process.communicate(timeout=60)[0], process.returncode) == ("", 0)
        assert not [path.name for path in tmp_path.iterdir() if path.name.startswith("lock")]


@linux
def test_a_set_up_of_another_user_is_alive():
    """No signal may be sent to it: process 1 is that of root, for root of nobody else."""
    gone = subprocess.Popen(["true"])
    gone.wait()
    work = f"{lock_functions()}\nif is_alive 1; then echo alive; fi\nif is_alive {gone.pid}; then echo undead; fi\n"
    other = {"user": 65534, "group": 65534, "extra_groups": []} if os.getuid() == 0 else {}
    done = subprocess.run(["sh", "-c", work], capture_output=True, text=True, timeout=60, check=True, cwd="/", **other)
    assert done.stdout.split() == ["alive"]


@linux
@pytest.mark.parametrize("name", ["it's", '"quoted"', "back\\slash"])
def test_a_place_where_nothing_can_be_built_is_refused(tmp_path, name):
    """It was found after minutes, in forty lines of the build."""
    process = drills.set_up(drills.small_clone(tmp_path / name))
    text = process.communicate(timeout=900)[0]
    assert process.returncode == 1
    said = "a path with a quotation mark or a backslash cannot be built in, move the checkout"
    assert text.splitlines() == [f"jointfrf: {said}: {tmp_path / name}"]


def test_counts_add_up():
    one, other = Found(), Found()
    one.counts["result"], other.counts["result"], other.crashes = 3, 2, 1
    one.add(other)
    assert (one.cases, one.crashes) == (6, 1)
