"""Compare what pip has installed with the hashes of python/constraints.txt, before any of it is run.

    python -I -S python/check_hashes.py REPORT      the file that `pip install --report REPORT` has written

Exit status 1 where a package is not the one whose hashes are checked in. Versions that are not among the constraints,
as on a Python for which these are not made, have no hashes to compare with.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

CONSTRAINTS = Path(__file__).resolve().with_name("constraints.txt")


def known_hashes(text: str) -> dict[tuple[str, str], set[str]]:
    """Return the hashes of each name and version: lines of comment below it."""
    found: dict[tuple[str, str], set[str]] = {}
    for line in text.splitlines():
        if pin := re.match(r"([\w.-]+)==(\S+)", line):
            own = found.setdefault((_plain(pin[1]), pin[2]), set())
        elif line.startswith("#   "):
            own |= set(re.findall(r"\b[0-9a-f]{64}\b", line))
    return found


def _plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def unknown(report: dict, known: dict[tuple[str, str], set[str]]) -> list[str]:
    """Return packages of a report whose file is none of those that are known."""
    wrong = []
    for each in report["install"]:
        name, version = each["metadata"]["name"], each["metadata"]["version"]
        own = known.get((_plain(name), version))
        archive = each["download_info"].get("archive_info", {})
        found = archive.get("hashes", {}).get("sha256") or archive.get("hash", "").removeprefix("sha256=")
        if own and found not in own:
            wrong.append(f"{name} {version}: sha256 {found or 'unknown'}, from {each['download_info'].get('url')}")
    return wrong


def main() -> int:
    """Say what is wrong."""
    report = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    wrong = unknown(report, known_hashes(CONSTRAINTS.read_text(encoding="utf-8")))
    print(*wrong, sep="\n", end="\n" if wrong else "")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
