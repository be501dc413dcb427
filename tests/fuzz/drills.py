"""Drills: what processes leave behind that are killed or run out of disk, and set-ups at odd places.

Each returns what it counted; the long form runs them as they are, the test suite a few rounds of the quick ones.
"""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import jointfrf as jf
from jointfrf.io import read_frfs

from .watch import Found

__all__ = ["DRILLS", "ROOT", "disk_full", "kills", "run_drill", "run_kills", "set_up", "set_ups", "small_clone"]

ROOT = Path(__file__).resolve().parents[2]
_SUFFIXES = ("uff", "npz", "h5", "csv")
#: Writes files of FRFs of growing content, and one into a folder of results, over and over.
_WRITER = """
import sys
from pathlib import Path
import numpy as np
from jointfrf.files import OwnFolder
from jointfrf.io import Channel, FrfSet, write_csv, write_hdf5, write_npz, write_uff
folder, n = Path(sys.argv[1]), int(sys.argv[2])
at = tuple(Channel(i, "+y") for i in (1, 2, 3))
write = {"uff": write_uff, "npz": write_npz, "h5": write_hdf5, "csv": write_csv}
for k in range(1, n):
    frfs = FrfSet(np.arange(1.0, 301.0), at, at, np.full((300, 3, 3), k + 1j))
    for suffix, function in write.items():
        function(folder / f"a.{suffix}", frfs)
    (OwnFolder(folder) / "results").make().write("a.txt", f"{k:07d}" * 10_000)
    if k == 1:
        print("begun", flush=True)
"""
#: Starts cases in two processes, as `jointfrf run --jobs 2` does, and says which they are.
_RUNNER = """
import sys
from jointfrf.workbench.cli.main import main
if __name__ == "__main__":
    sys.exit(main(["run", "3.1-discrete", "--jobs", "2", "--out", sys.argv[1], "--realisations", "100000"]))
"""


@dataclass(frozen=True)
class Drill:
    """What is done, how often in the long form, and the function that does it."""

    what: str
    count: int
    run: Callable[[int, Found], None]


def kills(count: int, found: Found) -> None:
    """Kill a process that writes files: each file is the old one or the new one, whole."""
    random = np.random.default_rng(7)
    for _ in range(count):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-c", _WRITER, folder, "100000"]
            with subprocess.Popen(command, stdout=subprocess.PIPE) as writer:
                assert writer.stdout is not None
                writer.stdout.readline()
                time.sleep(float(random.uniform(0.0, 0.3)))
                writer.kill()
            for suffix in _SUFFIXES:
                path = Path(folder) / f"a.{suffix}"
                try:
                    h = read_frfs(path, quantity="receptance").h
                except (jf.FileContentError, FileNotFoundError) as error:
                    found.broken.append(f"killed while it wrote: {error}")
                    continue
                if len(set(h.ravel().tolist())) != 1:
                    found.broken.append(f"killed while it wrote: {path.name} is of two writes")
                found.counts["killed, the file is whole"] += 1
            text = (Path(folder) / "results" / "a.txt").read_text()
            if text != text[:7] * 10_000:
                found.broken.append("killed while it wrote: a.txt is of two writes")


def run_kills(count: int, found: Found) -> None:
    """Kill `jointfrf run --jobs 2`: its workers end, too."""
    for _ in range(count):
        with tempfile.TemporaryDirectory() as folder:
            script = Path(folder) / "runner.py"
            script.write_text(_RUNNER)
            command = [sys.executable, str(script), str(Path(folder) / "out")]
            with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as runner:
                workers = _wait_for_children(runner.pid)
                runner.kill()
            left = _alive(workers, 30.0)
            if left:
                found.broken.append(f"processes {left} outlive the one that started them")
                for pid in left:
                    os.kill(pid, signal.SIGKILL)
            found.counts["killed, no process is left" if workers else "ended before it had workers"] += not left


def _wait_for_children(pid: int) -> list[int]:
    for _ in range(200):
        listed = Path(f"/proc/{pid}/task/{pid}/children")
        children = [int(word) for word in listed.read_text().split()] if listed.exists() else []
        if len(children) >= 2 or not listed.exists():
            return children
        time.sleep(0.05)
    return []


def _alive(pids: list[int], seconds: float) -> list[int]:
    until = time.monotonic() + seconds
    left = pids
    while left and time.monotonic() < until:
        left = [pid for pid in left if Path(f"/proc/{pid}").exists() and not _is_zombie(pid)]
        time.sleep(0.1)
    return left


def _is_zombie(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def disk_full(count: int, found: Found) -> None:
    """Write on a disk that is full after some bytes: an error, the old file as it was, nothing beside it."""
    random = np.random.default_rng(8)
    for _ in range(count):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            subprocess.run([sys.executable, "-c", _WRITER, name, "2"], check=True, stdout=subprocess.DEVNULL)
            before = _files(folder)
            most = int(random.integers(1, min(len(content) for content in before.values())))
            command = [sys.executable, "-c", _WRITER.replace("range(1, n)", "range(2, n)"), name, "4"]
            done = subprocess.run(
                command, capture_output=True, text=True, check=False, preexec_fn=lambda most=most: _limit_files(most)
            )
            last = (done.stderr.strip().splitlines() or [""])[-1]
            if done.returncode == 0 or "OSError" not in last:
                found.broken.append(f"no room after {most} bytes: status {done.returncode}, {last!r}")
            after = _files(folder)
            if after != before:
                found.broken.append(f"no room after {most} bytes: {sorted(after)} differ from before")
            found.counts["no room, the old files are as they were"] += 1
    with open("/dev/full", "w") as full:
        command = [sys.executable, "-m", "jointfrf", "cases"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode != 1 or len(done.stderr.strip().splitlines()) != 1:
        found.broken.append(f"cases > /dev/full: status {done.returncode}, {done.stderr!r}")
    found.counts["no room for what is printed, one sentence"] += 1


def _files(folder: Path) -> dict[str, bytes]:
    """Return the content of all files in a folder and in those below it."""
    paths = (path for path in folder.rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): path.read_bytes() for path in paths}


def _limit_files(most: int) -> None:
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (most, most))


def small_clone(folder: Path) -> Path:
    """Copy what a set-up reads, and no more; the set-up then fails when it builds."""
    names = ["python/bootstrap.sh", "python/constraints.txt", "pyproject.toml", "meson.options"]
    names += [str(path.relative_to(ROOT)) for place in ("", "fortran", "fortran/api", "fortran/api/generate", "python")
              for path in (ROOT / place).glob("meson.build")]  # fmt: skip
    names += [str(path.relative_to(ROOT)) for path in (ROOT / "fortran" / "api").glob("*/meson.build")]
    for name in dict.fromkeys(names):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes((ROOT / name).read_bytes())
    return folder


def whole_clone(folder: Path) -> Path:
    """Clone the checkout as it was committed last."""
    subprocess.run(["git", "clone", "--quiet", "--no-hardlinks", str(ROOT), str(folder)], check=True)
    return folder


def set_up(clone: Path, *, user: int | None = None, **variables: str) -> subprocess.Popen[str]:
    """Start a set-up."""
    return subprocess.Popen(
        ["sh", str(clone / "python" / "bootstrap.sh"), "run"],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={key: value for key, value in os.environ.items() if key != "PYTHONPATH"} | variables,
        user=user,
    )


#: No package can be fetched with these.
OFFLINE = {"PIP_NO_INDEX": "1", "PIP_INDEX_URL": "http://127.0.0.1:9/", "http_proxy": "http://127.0.0.1:9",
           "https_proxy": "http://127.0.0.1:9"}  # fmt: skip
_ODD = ("with blanks", "größe-测试", "a$b;c&d", "-dash")


def set_ups(count: int, found: Found) -> None:
    """Set up whole clones at odd places, two at once in each, then again without a network: minutes each."""
    for name in _ODD[:count]:
        with tempfile.TemporaryDirectory() as folder:
            clone = whole_clone(Path(folder) / name)
            both = [set_up(clone), set_up(clone)]
            said = [each.communicate()[0] for each in both]
            for each, text in zip(both, said, strict=True):
                if each.returncode:
                    found.broken.append(f"set-up at {name!r}: status {each.returncode}\n{text[-1500:]}")
            found.counts["two set-ups at once at an odd place"] += 1
            if any(each.returncode for each in both):
                continue
            again = set_up(clone, **OFFLINE)
            text = again.communicate()[0]
            if again.returncode or text:
                found.broken.append(f"second set-up at {name!r} without a network: {again.returncode} {text[-500:]}")
            answer = subprocess.run(
                [clone / ".venv" / "bin" / "jointfrf", "--version"], capture_output=True, text=True, check=False
            )
            if answer.returncode or jf.__version__ not in answer.stdout:
                found.broken.append(f"jointfrf at {name!r}: {answer.stdout} {answer.stderr[-500:]}")
            found.counts["second set-up without a network"] += 1


def unwritable(count: int, found: Found) -> None:
    """Set up a checkout that may not be written: one sentence, and a status that is not 0."""
    nobody = 65534 if os.getuid() == 0 else None
    for _ in range(count):
        with tempfile.TemporaryDirectory() as folder:
            Path(folder).chmod(0o755)
            clone = small_clone(Path(folder) / "clone")
            for path in (clone, *clone.rglob("*")):
                path.chmod(0o555 if path.is_dir() else 0o444)
            process = set_up(clone, user=nobody, HOME=folder)
            text = process.communicate()[0]
            for path in (clone, clone / "python"):
                path.chmod(0o755)
            if process.returncode != 1 or len(text.splitlines()) != 1 or "cannot be written" not in text:
                found.broken.append(f"a checkout that may not be written: status {process.returncode}, {text!r}")
            found.counts["a checkout that may not be written is refused"] += 1


DRILLS = {
    "kills": Drill("processes killed while they write files", 100, kills),
    "run-kills": Drill("`jointfrf run --jobs 2` killed", 20, run_kills),
    "disk-full": Drill("files written where there is no room", 100, disk_full),
    "unwritable": Drill("a set-up of a checkout that may not be written", 3, unwritable),
    "set-ups": Drill("clones at odd places: two set-ups at once, then one without a network", len(_ODD), set_ups),
}


def run_drill(name: str, count: int | None = None) -> Found:
    """Run one drill."""
    found = Found()
    started = time.monotonic()
    drill = DRILLS[name]
    drill.run(drill.count if count is None else min(count, drill.count), found)
    found.seconds = time.monotonic() - started
    return found
