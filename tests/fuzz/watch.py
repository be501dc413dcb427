"""Cases in processes that are watched: one that crashes or hangs is counted, and the next case goes on."""

from __future__ import annotations

import itertools
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from .worker import COUNTS, PRINTED, PROGRESS

__all__ = ["Found", "attack"]

_LOOK = 0.2
_TAIL = 2000


@dataclass
class Found:
    """What came of an attack: cases by what they ended with, and a line for each that must not be."""

    counts: Counter[str] = field(default_factory=Counter)
    broken: list[str] = field(default_factory=list)
    crashes: int = 0
    hangs: int = 0
    seconds: float = 0.0

    @property
    def cases(self) -> int:
        return self.counts.total() + self.crashes + self.hangs - self.counts["printed to stderr"]

    def add(self, other: Found) -> None:
        """Take in what another process found."""
        self.counts += other.counts
        self.broken += other.broken
        self.crashes += other.crashes
        self.hangs += other.hangs


def attack(name: str, count: int, seed: int = 1, *, first: int = 0, jobs: int = 1, seconds: float = 1e9,
           longest: float = 120.0) -> Found:  # fmt: skip
    """Run cases of a part.

    Parameters
    ----------
    name : str
        A part.
    count, seed, first : int
        How many cases, the seed they are made from, the number of the first.
    jobs : int
        Processes at once.
    seconds : float
        No case begins later than this.
    longest : float
        A case that takes more seconds hangs.

    Returns
    -------
    Found
    """
    started = time.time()
    edges = [first + count * i // jobs for i in range(jobs + 1)]
    with ThreadPoolExecutor(jobs) as pool:
        ranges = itertools.pairwise(edges)
        parts = [pool.submit(_share, name, seed, a, b, started + seconds, longest) for a, b in ranges]
        total = Found()
        for each in parts:
            total.add(each.result())
    total.seconds = time.time() - started
    return total


def _share(name: str, seed: int, first: int, last: int, deadline: float, longest: float) -> Found:
    """Run cases of one process after the other: where one ends early, the next begins after the case that ended it."""
    found = Found()
    while first < last and time.time() < deadline:
        with tempfile.TemporaryDirectory(prefix="fuzz") as folder:
            first = _process(Path(folder), name, seed, first, last, deadline, longest, found)
    return found


def _process(
    folder: Path, name: str, seed: int, first: int, last: int, deadline: float, longest: float, found: Found
) -> int:
    """Run one process; return the case after the last that it began."""
    progress = folder / PROGRESS
    progress.write_bytes(first.to_bytes(8, "little"))
    words = [name, seed, first, last, folder, deadline]
    command = [sys.executable, "-m", "fuzz.worker", *map(str, words)]
    with (folder / PRINTED).open("wb") as printed, subprocess.Popen(command, stderr=printed, stdout=printed) as worker:
        hangs = _wait(worker, progress, longest)
    content = {"counts": {}, "broken": [], "done": first, "ended": False}
    if (folder / COUNTS).exists():
        content = json.loads((folder / COUNTS).read_text())
    found.counts += Counter(content["counts"])
    found.broken += content["broken"]
    if content["ended"] and worker.returncode == 0:
        return last
    if not (folder / COUNTS).exists():
        raise RuntimeError(
            f"the part {name} cannot be made:\n{(folder / PRINTED).read_text(errors='replace')[-_TAIL:]}"
        )
    at = int.from_bytes(progress.read_bytes()[:8], "little")
    # Cases that ended well after the counts were saved last.
    found.counts["ended before a crash or hang"] += max(0, at - content["done"])
    said = (folder / PRINTED).read_text(errors="replace")[-_TAIL:]
    if hangs:
        found.hangs += 1
        found.broken.append(f"{name} --seed {seed} --first {at}: hangs\n{said}")
    else:
        found.crashes += 1
        found.broken.append(f"{name} --seed {seed} --first {at}: ended with status {worker.returncode}\n{said}")
    return at + 1


def _wait(worker: subprocess.Popen[bytes], progress: Path, longest: float) -> bool:
    """Wait for the end of a process; True where it had to be stopped."""
    at, since = b"", time.monotonic()
    while True:
        try:
            worker.wait(_LOOK)
            return False
        except subprocess.TimeoutExpired:
            pass
        now = progress.read_bytes()[:8]
        if now != at:
            at, since = now, time.monotonic()
        elif time.monotonic() - since > longest:
            os.kill(worker.pid, signal.SIGUSR1)  # says where it is
            time.sleep(1.0)
            worker.kill()
            return True
