"""The process of the peers: it loads them, and times one of them when it is asked to.

Requests and answers are lines of JSON. The benchmark's own candidates and the peers are timed in turn, so that a
disturbance meets all of them.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..data import Array
from ..machine import blas_kernels
from ..measure import call_repeatedly
from ..operations import OPERATIONS, Reference
from . import eigen, jax_cpu, mkl, torch_cpu
from .peer import NotThereError, Peer

#: Processor time over time of a call on one thread is 1; other programs make it less.
_MOST_CORES = 1.3
#: A call that shows on how many cores a peer works: lines, order, and how long it is repeated, s.
_PROBE_LINES, _PROBE_ORDER, _PROBE_SECONDS = 2000, 6, 0.1


def main(arguments: list[str]) -> None:
    """Answer requests until there are none."""
    # What libraries print must not stand among the answers.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", buffering=1)
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    settings = json.loads(arguments[0])
    clock = settings["clock"]
    peers, left_out = _load(settings)
    answers.write(json.dumps({"peers": peers and {name: peer.version for name, peer in peers.items()},
                              "left_out": left_out, "blas": blas_kernels()}) + "\n")  # fmt: skip
    calls: dict[str, Callable[[], Array]] = {}
    for line in sys.stdin:
        request = json.loads(line)
        if "sample" in request:
            answers.write(json.dumps(call_repeatedly(calls[request["sample"]], request["calls"], clock)) + "\n")
        else:
            calls.clear()
            answers.write(json.dumps(_prepare(peers, calls, **request)) + "\n")


def _load(settings: dict[str, Any]) -> tuple[dict[str, Peer], dict[str, str]]:
    """Return the peers that are there, and why others are not."""
    build, folder = Path(settings["build"]), settings["eigen"]
    loaders: dict[str, Callable[[], list[Peer]]] = {
        "eigen": lambda: eigen.load(build, settings["orders"], Path(folder) if folder else None),
        "mkl": lambda: mkl.load(build),
        "torch": torch_cpu.load,
        "jax": jax_cpu.load,
    }
    peers: dict[str, Peer] = {}
    left_out: dict[str, str] = {}
    for name in settings["names"]:
        try:
            loaded = loaders[name]()
        except NotThereError as error:
            left_out[name] = str(error)
            continue
        for peer in loaded:
            cores = _cores(peer) if peer.name != "Eigen" else 1.0
            if cores > _MOST_CORES:
                left_out[peer.name] = f"works on {cores:.1f} cores, not on one"
            else:
                peers[peer.name] = peer
    return peers, left_out


def _cores(peer: Peer) -> float:
    """Return the processor time of this process over the time that a call takes."""
    call = peer.operations["invert"](OPERATIONS["invert"].make("frf", _PROBE_LINES, _PROBE_ORDER))
    call()
    start, used = time.perf_counter(), time.process_time()
    while time.perf_counter() < start + _PROBE_SECONDS:
        call()
    return (time.process_time() - used) / (time.perf_counter() - start)


def _prepare(
    peers: dict[str, Peer], calls: dict[str, Callable[[], Array]], *, case: list[Any], lines: int, times: int
) -> dict[str, Any]:
    """Make the data of a case and check every peer; return the seconds of their first calls, or what is wrong."""
    name, kind, _, n = case
    able = [peer for peer in peers.values() if name in peer.operations]
    if not able:
        return {}
    operation = OPERATIONS[name]
    base = operation.make(kind, lines, n)
    reference = Reference(operation, base)
    data = base.repeated(times) if times > 1 else base
    found: dict[str, Any] = {}
    for peer in able:
        try:
            call = peer.operations[name](data)
            call()  # compiles, where that is done when it is first called
            start = time.perf_counter()
            result = call()
            seconds = time.perf_counter() - start
        except NotThereError as error:
            found[peer.name] = str(error)
            continue
        fault = reference.fault(result)
        found[peer.name] = f"is wrong: {fault}" if fault else seconds
        if not fault:
            calls[peer.name] = call
    return found


if __name__ == "__main__":
    main(sys.argv[1:])
