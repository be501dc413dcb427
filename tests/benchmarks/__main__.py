"""The benchmark command: `tests/benchmarks/run --help`."""

from __future__ import annotations

import argparse
import ctypes
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np

import jointfrf as jf
from jointfrf.kernel.call import Engine

from . import report
from .data import Data
from .machine import (
    BUILD,
    QUICK_SIZES,
    ROOT,
    SIZES,
    Limits,
    as_dict,
    best_of,
    build_library,
    describe,
    measure_limits,
    usable_cores,
)
from .measure import CLOCKS, Candidate, time_interleaved
from .operations import OPERATIONS, Operation, Reference
from .options import numbers
from .peers.client import LIBRARIES, PeerProcess
from .results import LOOP, NUMPY, OURS, OUT, REFERENCE, Run, load, record, save, with_limits

_ORDERS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)
_QUICK_ORDERS = (2, 6, 12, 24)
#: FRFs and random matrices again and again on the same lines; FRFs that no cache holds.
_DATA = ("frf", "random", "streaming")
#: Memory that a case may take, bytes; operations of one call on one candidate.
_MEMORY, _WORK, _QUICK_WORK = 2e9, 2e9, 4e8
_FEWEST_LINES = 200
_PEERS = """\
Other libraries are timed where they are there, on one thread; a line says which are left out, and why:
  Eigen                apt-get install libeigen3-dev      (compiled for the orders when first timed: minutes)
  MKL loop, compact    .venv/bin/pip install mkl          (315 MB to download)
  JAX                  .venv/bin/pip install jax          (89 MB to download)
  torch                .venv/bin/pip install torch --index-url https://download.pytorch.org/whl/cpu
                       (from PyPI, on Linux, it brings gigabytes of libraries for graphics processors)
"""
#: A case streams where its data are this many times those of the repeated one.
_STREAMING_FACTOR = 4


def _names(text: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    for name in names:
        if name not in OPERATIONS:
            raise argparse.ArgumentTypeError(f"{name!r} is none of {', '.join(OPERATIONS)}")
    return names


def _peers(text: str) -> tuple[str, ...]:
    names = () if text == "none" else tuple(text.split(","))
    for name in names:
        if name not in LIBRARIES:
            raise argparse.ArgumentTypeError(f"{name!r} is none of {', '.join(LIBRARIES)}, none")
    return names


def _tables(text: str) -> tuple[str, ...]:
    names = tuple(text.split(","))
    for name in names:
        if name not in report.TABLES:
            raise argparse.ArgumentTypeError(f"{name!r} is none of {', '.join(report.TABLES)}")
    return names


def _data(text: str) -> tuple[str, ...]:
    kinds = tuple(text.split(","))
    for kind in kinds:
        if kind not in _DATA:
            raise argparse.ArgumentTypeError(f"{kind!r} is none of {', '.join(_DATA)}")
    return kinds


def _parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="tests/benchmarks/run",
        description="Times the operations of jointfrf against the limits of this machine, numpy, LAPACK line by line,"
        " and other libraries that are installed. Prints a table; writes speed.json, speed.png and peers.png.",
        epilog=_PEERS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--output", type=Path, default=ROOT / "results" / "benchmarks", metavar="FOLDER")
    parser.add_argument("--operations", type=_names, default=tuple(OPERATIONS), metavar="NAME,...",
                        help=f"out of {', '.join(OPERATIONS)}")  # fmt: skip
    parser.add_argument("--orders", type=numbers, metavar="N,...", help="n; default 1 to 64")
    parser.add_argument("--lines", type=int, help="frequency lines; default 2000")
    parser.add_argument("--data", type=_data, metavar="KIND,...", help=f"out of {', '.join(_DATA)}; default all")
    parser.add_argument("--threads", type=numbers, default=(1, 2), metavar="N,...", help="default 1,2; 1 comes first")
    parser.add_argument("--engine", default="auto", help="the engine that is timed as jointfrf")
    parser.add_argument(
        "--budget", type=float, help="seconds a case may take, once it was repeated five times; default 0.6"
    )
    parser.add_argument(
        "--clock", choices=tuple(CLOCKS), default="wall",
        help="processor: only time in which this process computes counts, for a machine that others use; one thread",
    )  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="four orders, 500 lines, FRFs only, no streaming")
    parser.add_argument(
        "--compare", type=Path, metavar="OLD.json", help="print what became slower; status 1 if anything did"
    )
    parser.add_argument(
        "--peers", type=_peers, default=LIBRARIES, metavar="NAME,...",
        help=f"out of {', '.join(LIBRARIES)}, or none; default all that are installed",
    )  # fmt: skip
    parser.add_argument(
        "--eigen", type=Path, metavar="FOLDER", help="that holds Eigen/Dense, if not /usr/include/eigen3"
    )
    parser.add_argument(
        "--document", type=_tables, nargs="?", const=report.TABLES, default=(), metavar="TABLE,...",
        help=f"put tables into docs/benchmarks.md: {', '.join(report.TABLES)}; both if none is named",
    )  # fmt: skip
    parser.add_argument(
        "--from", type=Path, dest="source", metavar="FILE.json", help="use these results, measure nothing"
    )
    options = parser.parse_args(arguments)
    options.orders = options.orders or (_QUICK_ORDERS if options.quick else _ORDERS)
    options.data = options.data or (_DATA[:1] if options.quick else _DATA)
    options.lines = options.lines or (500 if options.quick else 2000)
    options.budget = options.budget if options.budget is not None else (0.1 if options.quick else 0.6)
    options.threads = (1,) if options.clock == "processor" else tuple(sorted({1, *options.threads}))
    return options


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    options = _parse(arguments)
    warnings.simplefilter("ignore", jf.IllConditionedWarning)
    # Another method would be timed.
    warnings.simplefilter("error", jf.ConvergenceWarning)
    # Read first: it may be the file that is written.
    old = load(options.compare) if options.compare else None
    options.output.mkdir(parents=True, exist_ok=True)
    if options.source:
        run = load(options.source)
    else:
        run = _measure(options)
        save(run, options.output / "speed.json")
        print(f"\nwrote {options.output / 'speed.json'}")
    from .plot import draw, draw_peers

    draw(run, options.output / "speed.png")
    print(f"wrote {options.output / 'speed.png'}")
    if draw_peers(run, options.output / "peers.png"):
        print(f"wrote {options.output / 'peers.png'}")
    for table in options.document:
        print(report.write_document(run, ROOT / "docs" / "benchmarks.md", table))
    if old is None:
        return 0
    text, worse = report.comparison(old, run)
    print(text)
    return int(worse)


def _measure(options: argparse.Namespace) -> Run:
    jf.set_engine(options.engine)
    library = build_library()
    possible = [count for count in options.threads if count <= usable_cores()]
    threads = tuple(count for count in possible if library.machine_set_threads(count) == count)
    peers = PeerProcess(options.peers, options.orders, BUILD / "peers", options.eigen, options.clock)
    with peers:
        return _measure_all(options, library, threads, peers)


def _measure_all(
    options: argparse.Namespace, library: ctypes.CDLL, threads: tuple[int, ...], peers: PeerProcess
) -> Run:
    machine = {**describe(), "engine": jf.get_engine(), "clock": options.clock}
    machine |= {"peers": peers.versions, "left_out": peers.left_out, "blas_of_peers": peers.blas}
    machine["left_out"] |= {
        f"{count} threads": f"this process may run on {usable_cores()} of {machine['cores']} cores"
        for count in options.threads if count not in threads
    }  # fmt: skip

    def measured() -> dict[int, Limits]:
        sizes = QUICK_SIZES if options.quick else SIZES
        return {count: measure_limits(library, count, sizes, options.engine) for count in threads}

    limits = measured()
    run = Run(datetime.now().astimezone().isoformat(timespec="seconds"), machine, [], [])
    run.limits.extend(as_dict(limit) for limit in limits.values())
    print(report.machine_text(machine, run.limits), flush=True)
    known = set(peers.left_out)
    start = time.perf_counter()
    for name in options.operations:
        operation = OPERATIONS[name]
        for kind in options.data:
            if kind == "streaming" and operation.streams:
                _time_operation(operation, "frf", True, options, library, limits, run, peers)
            elif kind in operation.kinds:
                _time_operation(operation, kind, False, options, library, limits, run, peers)
        # What an interrupted run has measured is not lost.
        save(run, options.output / "speed.json")
    for name, why in peers.left_out.items():
        if name not in known:
            print(f"left out from here on: {name}: {why}")
    # Once more, since something may have disturbed it at the beginning.
    limits = {count: best_of(limits[count], limit) for count, limit in measured().items()}
    final = replace(
        run,
        limits=[as_dict(limit) for limit in limits.values()],
        records=[with_limits(one, limits) for one in run.records],
    )
    print(f"\n{len(run.records)} numbers in {time.perf_counter() - start:.0f} s")
    print(*report.limits_text(final.limits), sep="\n")
    return final


def _time_operation(
    operation: Operation,
    kind: str,
    streaming: bool,
    options: argparse.Namespace,
    library: ctypes.CDLL,
    limits: dict[int, Limits],
    run: Run,
    peers: PeerProcess,
) -> None:
    """Time all orders with one kind of data."""
    threads = tuple(limits)
    titled = False
    for n in options.orders:
        times, lines = _sizes(operation, kind, n, options, streaming)
        if times == 0:
            continue
        if not titled:
            print(report.heading(operation.name, kind, streaming, threads, operation.takes_out, tuple(peers.versions)))
            titled = True
        case = (operation.name, kind, streaming, n)
        try:
            _time_case(operation, case, (lines, times), options, library, limits, run, peers)
        except jf.ConvergenceWarning as warning:
            print(f"{n:4d}  left out: {warning}")
            continue
        print(report.row(run, case, threads, operation.takes_out, tuple(peers.versions)), flush=True)


def _sizes(operation: Operation, kind: str, n: int, options: argparse.Namespace, streaming: bool) -> tuple[int, int]:
    """Return how often the lines are repeated, 0 where that is not worth while, and the number of lines."""
    if n < operation.smallest:
        return 0, 0
    few = operation.make(kind, 2, n)
    room = sum(array.nbytes for array in few.sweeps.values()) / 2 * operation.per_call
    room += operation.numpy(few).nbytes / 2
    work = max(operation.flops(n) * operation.per_call, 1)
    fits = int(_MEMORY / (operation.copies * room))
    enough = max(_FEWEST_LINES, int((_QUICK_WORK if options.quick else _WORK) / work))
    lines = max(2, min(max(2, options.lines // operation.per_call), fits, enough))
    if not streaming:
        return 1, lines
    times = min(100_000, fits, enough) // lines
    return (times if times >= _STREAMING_FACTOR else 0), lines


def _time_case(
    operation: Operation,
    case: tuple[str, str, bool, int],
    sizes: tuple[int, int],
    options: argparse.Namespace,
    library: ctypes.CDLL,
    limits: dict[int, Limits],
    run: Run,
    peers: PeerProcess,
) -> None:
    """Check all candidates, then time them in turn."""
    _, kind, _, n = case
    lines, times = sizes
    base = operation.make(kind, lines, n)
    reference = Reference(operation, base)
    data = base.repeated(times) if times > 1 else base
    candidates = list(_candidates(operation, data, options.engine, library, tuple(limits)))
    first = []
    for candidate in candidates:
        assert candidate.call is not None
        candidate.prepare()
        start = time.perf_counter()
        result = candidate.call()
        first.append(time.perf_counter() - start)
        fault = reference.fault(result)
        del result
        if fault:
            raise SystemExit(f"{operation.name}, n = {n}, {kind}: {candidate.name} is wrong: {fault}")
    others, seconds, faults = peers.candidates(case, lines, times)
    candidates += others
    first += seconds
    for name, fault in faults.items():
        print(f"{n:4d}  {name} left out: {fault}")
    timings = time_interleaved(candidates, first, options.budget, fewest=3 if options.quick else 5, clock=options.clock)
    done = data.lines * operation.per_call
    for candidate, timing in zip(candidates, timings, strict=True):
        if timing.samples:
            least = (operation.flops(n), operation.moved(n), operation.normals(n))
            run.records.append(record(case, done, candidate.name, limits[candidate.threads], timing, *least))
    jf.set_engine(options.engine)


def _candidates(
    operation: Operation, data: Data, engine: Engine, library: ctypes.CDLL, threads: tuple[int, ...]
) -> Iterator[Candidate]:
    def prepare(chosen: Engine, count: int) -> Callable[[], None]:
        def set_up() -> None:
            jf.set_engine(chosen)
            library.machine_set_threads(count)

        return set_up

    ours, loop = operation.ours, operation.loop
    for count in threads:
        yield Candidate(OURS, count, prepare(engine, count), lambda: ours(data))
        if operation.takes_out:
            out = np.empty_like(ours(data))
            yield Candidate(OUT, count, prepare(engine, count), lambda out=out: ours(data, out=out))  # type: ignore[misc]
        yield Candidate(REFERENCE, count, prepare("lapack", count), lambda: ours(data))
    yield Candidate(NUMPY, 1, prepare(engine, 1), lambda: operation.numpy(data))
    if loop is not None:
        yield Candidate(LOOP, 1, prepare(engine, 1), lambda: loop(library, data))


if __name__ == "__main__":
    sys.exit(main())
