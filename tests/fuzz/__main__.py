"""`./tests/fuzz/run`: the attack in its long form, counted; exit status 1 where something broke."""

from __future__ import annotations

import argparse
import os
import re
import sys

from .drills import DRILLS, run_drill
from .parts import PARTS
from .watch import Found, attack

ABOUT = """\
Attacks the package with random calls and damaged files, each case made from a seed and its number, in processes that
are watched: what crashes, hangs, answers with a foreign exception, prints, or differs from itself is counted and named
with the words that repeat it (`tests/fuzz/run calls --seed 1 --first 4711 --count 1`). Then drills: processes killed
and disks filled while files are written, clones at odd places, without rights, two set-ups at once, no network.
"""


def place(line: str) -> str:
    """Return where something broke, which is what lines of one kind share."""
    found = re.search(r"\w+\.py:\d+", line)
    return found[0] if found else re.sub(r"\d+", "", line)[:80]


def report(name: str, found: Found, shown: int) -> bool:
    """Print what a part found; whether nothing broke."""
    print(f"{name}: {found.cases} cases in {found.seconds:.0f} s; {found.crashes} crashes, {found.hangs} hangs")
    for kind, count in found.counts.most_common():
        print(f"  {count:9d}  {kind}")
    alike: dict[str, list[str]] = {}
    for line in found.broken:
        alike.setdefault(place(line), []).append(line)
    for lines in list(alike.values())[:shown]:
        print(f"  ! {lines[0]}" + (f" (and {len(lines) - 1} like it)" if len(lines) > 1 else ""))
    if len(alike) > shown:
        print(f"  ! and {len(alike) - shown} other kinds")
    sys.stdout.flush()
    return not found.broken


def main() -> int:
    """Read the command line, attack, print."""
    parser = argparse.ArgumentParser("tests/fuzz/run", description=ABOUT)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    names = [*PARTS, *DRILLS]
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(names)}; all by default")
    parser.add_argument("--count", type=int, metavar="N", help="cases of each part (default: those of the long form)")
    parser.add_argument("--seed", type=int, default=1, metavar="N")
    parser.add_argument("--first", type=int, default=0, metavar="N", help="number of the first case")
    parser.add_argument("--seconds", type=float, default=7200.0, metavar="N", help="most for a part (default: 7200)")
    parser.add_argument("--longest", type=float, default=300.0, metavar="N", help="a case that takes more s hangs")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="processes (default: all)")
    parser.add_argument("--shown", type=int, default=40, metavar="N", help="lines of what broke (default: 40)")
    parser.add_argument("--list", action="store_true", help="name the parts and run none")
    options = parser.parse_args()
    unknown = [name for name in options.parts if name not in names]
    if unknown:
        parser.error(f"no part {unknown[0]}: there are {', '.join(names)}")
    if options.list:
        for name, (what, count) in PARTS.items():
            print(f"{name:12}{count:9d}  {what}")
        for name, drill in DRILLS.items():
            print(f"{name:21}  {drill.what}")
        return 0
    os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"
    is_good = True
    for name in options.parts or names:
        if name in PARTS:
            found = attack(
                name,
                PARTS[name][1] if options.count is None else options.count,
                options.seed,
                first=options.first,
                jobs=options.jobs,
                seconds=options.seconds,
                longest=options.longest,
            )
        else:
            found = run_drill(name, options.count)
        is_good = report(name, found, options.shown) and is_good
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())
