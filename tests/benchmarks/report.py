"""What is printed, and the tables of docs/benchmarks.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .operations import OPERATIONS
from .peers.client import PEER_NAMES
from .results import LOOP, NUMPY, OURS, OUT, REFERENCE, Record, Run, faster, slower

#: Tables of the document, each between a line `<!-- NAME: begin -->` and one `<!-- NAME: end -->`.
TABLES = ("speed", "peers")
_DOCUMENT_ORDERS = (1, 2, 6, 12, 24, 48)
_PEER_ORDERS = (1, 2, 3, 4, 6, 8, 12, 24, 48)
_PEER_WORDS = {NUMPY: "numpy", LOOP: "OpenBLAS loop"}
_KINDS = {"frf": "FRFs", "random": "random matrices"}


def machine_text(machine: dict[str, Any], limits: list[dict[str, Any]]) -> str:
    """Return the machine and its limits in words."""
    text = [
        f"{machine['processor']}, {machine['cores']} cores, {machine['system']}, load {machine['load']}",
        f"{machine['fortran']}; Python {machine['python']}, numpy {machine['numpy']}, OpenBLAS "
        f"{machine['scipy-openblas32']}, jointfrf {machine['jointfrf']} ({machine['commit']}), "
        f"engine {machine['engine']}",
        *(f"BLAS of {owner}: {kernels}" for owner, kernels in machine.get("blas", {}).items()),
        *(f"peer {name}: {version}" for name, version in machine.get("peers", {}).items()),
        *(f"BLAS of {owner} there: {kernels}" for owner, kernels in machine.get("blas_of_peers", {}).items()),
        *(f"left out: {name}: {why}" for name, why in machine.get("left_out", {}).items()),
    ]
    return "\n".join(
        text + limits_text(limits) + _warning(machine, "other programs are running: the numbers are rough")
    )


def _warning(machine: dict[str, Any], text: str) -> list[str]:
    return [text] if machine["load"] and machine["load"][0] > 0.5 else []


def limits_text(limits: list[dict[str, Any]]) -> list[str]:
    """Return the limits of the machine, one line for each number of threads."""
    text = []
    for limit in limits:
        peaks = ", ".join(f"{rate / 1e9:.1f} ({bits} bits)" for bits, rate in limit["peak"].items())
        sizes = limit["bandwidth"]
        rates = ", ".join(f"{rate / 1e9:.0f} ({_size(size)})" for size, rate in sizes[:: max(1, len(sizes) // 5)])
        text.append(
            f"{_threads(limit['threads'])}: FMA {peaks} GFlop/s; read + write {rates}, memory "
            f"{sizes[-1][1] / 1e9:.1f} GB/s; {limit.get('normals', 0) / 1e6:.0f} million complex normal numbers/s"
        )
    return text


def _threads(count: int) -> str:
    return f"{count} thread{'s' if count > 1 else ''}"


def _size(size: int) -> str:
    return f"{size // 2**20} MiB" if size >= 2**20 else f"{size // 2**10} KiB"


def heading(
    operation: str, kind: str, streaming: bool, threads: tuple[int, ...], with_out: bool, peers: tuple[str, ...] = ()
) -> str:
    """Return what stands above the rows of one operation."""
    counts = OPERATIONS[operation].counts
    more = threads[1:]
    columns = ["   n", "  lines", "limit", "jointfrf", "spread", "% limit"]
    columns += ["    out="] if with_out else []
    for count in more:
        columns += [f"{count} threads", "% limit"]
    columns += ["x numpy", "x engine lapack", "x LAPACK loop", *(f"x {name}" for name in peers)]
    memory = "streaming from memory" if streaming else "repeated on the same lines"
    title = f"{operation}: ns a line ({_KINDS[kind]}, {memory}, {_threads(threads[0])}); n = {counts}"
    return f"\n{title}\n" + "  ".join(columns)


def row(
    run: Run,
    case: tuple[str, str, bool, int],
    threads: tuple[int, ...],
    with_out: bool,
    peers: tuple[str, ...] = (),
) -> str:
    """Return the measured numbers of one case."""
    first = run.find(case, OURS, threads[0])
    assert first is not None
    cells = [f"{first.n:4d}", f"{first.lines:7d}", f"{_ns(first.limit):>5}", f"{_ns(first.median):>8}",
             f"{100 * first.spread:5.0f}%", f"{first.percent:7.0f}"]  # fmt: skip
    if with_out:
        out = run.find(case, OUT, threads[0])
        cells.append(f"{_ns(out.median) if out else '-':>8}")
    for count in threads[1:]:
        other = run.find(case, OURS, count)
        cells += [f"{_ns(other.median):>9}", f"{other.percent:7.0f}"] if other else ["-", "-"]
    for candidate in (NUMPY, REFERENCE, LOOP, *peers):
        cells.append(f"{_ratio(run.ratio(first, candidate)):>{len(candidate) + 2}}")
    return "  ".join(cells)


def _ns(value: float) -> str:
    return f"{value:.1f}" if value < 9.95 else f"{value:.0f}"


def _time(value: float) -> str:
    """Return ns in words, three digits at most."""
    return f"{_ns(value)} ns" if value < 999.5 else f"{_ns(value / 1e3)} µs"


def _percent(value: float) -> str:
    return f"{value:.0f}" if value >= 0.95 else f"{value:.1f}"


def _ratio(value: float | None) -> str:
    return "-" if value is None else _ns(value)


def comparison(old: Run, new: Run) -> tuple[str, bool]:
    """Return what became slower and faster since an older run, and whether anything became slower."""
    text = [f"\nagainst the run of {old.date} ({old.machine['commit']}, engine {old.machine['engine']})"]
    if old.machine["processor"] != new.machine["processor"]:
        text.append(f"another processor: {old.machine['processor']}")
    for a, b in zip(old.limits, new.limits, strict=False):
        change = b["best_peak"] / a["best_peak"] - 1
        if a["threads"] == b["threads"] and abs(change) > 0.05:
            text.append(f"the machine itself: peak of {_threads(a['threads'])} {100 * change:+.0f} %")
    worse = slower(old, new)
    for word, pairs in (("slower", worse), ("faster", faster(old, new))):
        text += [f"{word}: {len(pairs)}", *(_change(a, b) for a, b in pairs)]
    return "\n".join(text), bool(worse)


def _change(old: Record, new: Record) -> str:
    where = "streaming" if new.streaming else "repeated"
    return (f"  {new.operation}, n = {new.n}, {_KINDS[new.data]}, {where}, {new.candidate}, {_threads(new.threads)}: "
            f"{_ns(old.median)} -> {_ns(new.median)} ns ({100 * (new.median / old.median - 1):+.0f} %)")  # fmt: skip


def document_table(run: Run) -> str:
    """Return the table of operations of docs/benchmarks.md."""
    machine, one = run.machine, run.limits[0]
    compiler = f"{machine['fortran'].partition(' (')[0]} {machine['fortran'].split()[-1]}"
    found = {r.n for r in run.records if not r.streaming and r.data == "frf" and r.candidate == OURS}
    orders = [n for n in _DOCUMENT_ORDERS if n in found]
    text = [
        f"{machine['processor']}, one thread, {compiler}, engine {machine['engine']}; {one['best_peak'] / 1e9:.0f} "
        f"GFlop/s peak, memory {one['bandwidth'][-1][1] / 1e9:.0f} GB/s.",
        "Time of a frequency line, percent of the machine's limit, and how many times longer numpy's batched calls",
        "and the reference engine (LAPACK line by line) take, on FRFs with noise; medians of interleaved repetitions.",
        *_warning(machine, "Other programs were running: the numbers are rough."),
        "",
        "| | " + " | ".join(f"n = {n}" if i == 0 else str(n) for i, n in enumerate(orders)) + " |",
        "|---" * (len(orders) + 1) + "|",
    ]
    for name in dict.fromkeys(r.operation for r in run.records):
        cells = []
        for n in orders:
            ours = run.find((name, "frf", False, n), OURS)
            if ours is None:
                cells.append("")
                continue
            numpy, reference = (_ratio(run.ratio(ours, c)) for c in (NUMPY, REFERENCE))
            cells.append(f"{_time(ours.median)}<br>{_percent(ours.percent)} %<br>{numpy}×, {reference}×")
        text.append(f"| `{name}` | " + " | ".join(cells) + " |")
    counts: dict[str, list[str]] = {}
    for name in dict.fromkeys(r.operation for r in run.records):
        counts.setdefault(OPERATIONS[name].counts, []).append(f"`{name}`")
    return "\n".join([*text, *_items("Meaning of n:", {", ".join(names): what for what, names in counts.items()})])


def peer_table(run: Run) -> str:
    """Return the table of the peers: the time of jointfrf, and how many times longer each of the others takes."""
    machine = run.machine
    there = [name for name in PEER_NAMES if any(r.candidate == name for r in run.records)]
    lines = max(r.lines for r in run.records if r.candidate in there and not r.streaming)
    clock = "processor time, " if machine.get("clock") == "processor" else ""
    text = [
        f"{machine['processor']}, one thread, {run.date[:10]}, engine {machine['engine']}; {lines} lines of FRFs with "
        f"noise at most, in C order; {clock}least of repetitions in turn.",
        "Time of a frequency line by jointfrf, and how many times longer the other libraries take. A library with a "
        "number below 1 is faster.",
        *_warning(machine, "Other programs were running."),
        "",
    ]
    operations = [name for name in dict.fromkeys(r.operation for r in run.records)
                  if any(r.operation == name and r.candidate in there for r in run.records)]  # fmt: skip
    orders = [n for n in _PEER_ORDERS if any(run.find((name, "frf", False, n), OURS) for name in operations)]
    text += [
        "| | | " + " | ".join(f"n = {n}" if i == 0 else str(n) for i, n in enumerate(orders)) + " |",
        "|---" * (len(orders) + 2) + "|",
    ]
    for name in operations:
        ours = [run.find((name, "frf", False, n), OURS) for n in orders]
        cells = [_time(one.least) if one else "" for one in ours]
        text.append(f"| `{name}` | jointfrf | " + " | ".join(cells) + " |")
        for candidate in (NUMPY, LOOP, *there):
            ratios = [run.least_ratio(one, candidate) if one else None for one in ours]
            if any(ratio is not None for ratio in ratios):
                shown = ["" if ratio is None else f"{_ns(ratio)}×" for ratio in ratios]
                text.append(f"| | {_PEER_WORDS.get(candidate, candidate)} | " + " | ".join(shown) + " |")
    text += _items("Meaning of n:", {f"`{name}`": OPERATIONS[name].counts for name in operations})
    text += ["", "Empty: not timed, or the result was wrong."]
    versions = {name: machine["peers"][name] for name in there}
    text += _items("Versions:", versions | {f"BLAS of {owner}": words for owner, words in machine["blas"].items()})
    return "\n".join(text)


def _items(heading: str, items: dict[str, str]) -> list[str]:
    """Return the lines of a list under a heading."""
    return ["", heading, "", *(f"- {name}: {words.replace('; ', ', ')}" for name, words in items.items())]


def write_document(run: Run, path: Path, table: str) -> str:
    """Put a table between its two markers of a document; return a sentence on what was done."""
    if table == "peers" and not any(r.candidate in PEER_NAMES for r in run.records):
        return f"{path.name}: no peers were timed, and their table stays as it is"
    begin, end = f"<!-- {table}: begin -->", f"<!-- {table}: end -->"
    before, found, rest = path.read_text().partition(begin)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise ValueError(f"{path} has no markers {begin} and {end}")
    content = document_table(run) if table == "speed" else peer_table(run)
    path.write_text(f"{before}{begin}\n{content}\n{end}{after}")
    return f"wrote the table {table!r} of {path.name}"
