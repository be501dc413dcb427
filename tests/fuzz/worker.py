"""A process that runs cases of a part one after the other; `watch` starts it and sees where it stops."""

from __future__ import annotations

import faulthandler
import json
import mmap
import os
import signal
import sys
import time
from collections import Counter
from pathlib import Path

from .part import BrokenError, random_of
from .parts import make_part

__all__ = ["COUNTS", "PRINTED", "PROGRESS", "run_cases"]

#: Files of a worker: the number of its case, what came out so far, and what was printed.
PROGRESS, COUNTS, PRINTED = "progress", "counts.json", "printed"
_KEPT = 2.0  # seconds between two savings of the counts


def run_cases(name: str, seed: int, first: int, last: int, folder: Path, deadline: float) -> None:
    """Run cases first to last - 1 or until the deadline; what came out is in the folder."""
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR1, all_threads=True)
    own = folder / "files"
    own.mkdir(exist_ok=True)
    os.chdir(own)  # a random path is a file there
    with (folder / PROGRESS).open("r+b") as file:
        progress = mmap.mmap(file.fileno(), 8)
    counts: Counter[str] = Counter()
    broken: list[str] = []
    saved = time.monotonic()
    part = make_part(name, own)
    done = first
    _save(folder, counts, broken, done, ended=False)
    for number in range(first, last):
        if time.time() > deadline:
            break
        progress[:8] = number.to_bytes(8, "little")
        printed = os.fstat(2).st_size
        try:
            counts[part.run(random_of(seed, number))] += 1
        except BrokenError as error:
            counts["BROKEN"] += 1
            broken.append(f"{name} --seed {seed} --first {number}: {error}")
        if os.fstat(2).st_size != printed:
            counts["printed to stderr"] += 1
            broken.append(f"{name} --seed {seed} --first {number}: printed to stderr")
        done = number + 1
        if time.monotonic() - saved > _KEPT:
            saved = time.monotonic()
            _save(folder, counts, broken, done, ended=False)
    _save(folder, counts, broken, done, ended=True)


def _save(folder: Path, counts: Counter[str], broken: list[str], done: int, *, ended: bool) -> None:
    text = json.dumps({"counts": counts, "broken": broken, "done": done, "ended": ended})
    new = folder / f"{COUNTS}.new"
    new.write_text(text)
    new.replace(folder / COUNTS)


if __name__ == "__main__":
    _name, _seed, _first, _last, _folder, _deadline = sys.argv[1:]
    run_cases(_name, int(_seed), int(_first), int(_last), Path(_folder), float(_deadline))
