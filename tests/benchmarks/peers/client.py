"""The benchmark's side of the process of the peers."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

from ..measure import Candidate

#: By the names that `--peers` takes.
LIBRARIES = ("eigen", "mkl", "torch", "jax")
#: What one peer is called in records, in the order of tables.
PEER_NAMES = ("Eigen", "MKL loop", "MKL compact", "torch", "JAX")
_TESTS = Path(__file__).resolve().parents[2]


class PeerProcess:
    """Peers in their process.

    Parameters
    ----------
    names : sequence of str
        Out of `LIBRARIES`.
    orders : sequence of int
        Orders that are compiled for.
    build : Path
        Folder for what is compiled.
    eigen : Path, optional
        Folder of `Eigen/Dense`.
    clock : str
        By which they are timed, one of `measure.CLOCKS`.

    Attributes
    ----------
    versions : dict of str to str
        What each peer is that is there.
    left_out : dict of str to str
        Why others are not.
    blas : dict of str to str
        Kernels of the BLAS libraries in that process.
    """

    def __init__(
        self, names: Sequence[str], orders: Sequence[int], build: Path, eigen: Path | None = None, clock: str = "wall"
    ) -> None:
        settings = {
            "names": names,
            "orders": orders,
            "build": str(build),
            "eigen": str(eigen) if eigen else None,
            "clock": clock,
        }
        path = os.pathsep.join([str(_TESTS), *filter(None, [os.environ.get("PYTHONPATH")])])
        self.versions: dict[str, str] = {}
        self.left_out: dict[str, str] = {}
        self.blas: dict[str, str] = {}
        self._process: subprocess.Popen[str] | None = None
        if not names:
            return
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.peers.process", json.dumps(settings)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            bufsize=1,
            env={**os.environ, "PYTHONPATH": path},
        )
        found = self._answer()
        if found is not None:
            self.versions, self.left_out, self.blas = found["peers"], found["left_out"], found["blas"]

    def __enter__(self) -> PeerProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()

    def candidates(
        self, case: tuple[str, str, bool, int], lines: int, times: int
    ) -> tuple[list[Candidate], list[float], dict[str, str]]:
        """Return the peers that do an operation, the seconds of a call of each, and what is wrong with others."""
        found = self._ask({"case": case, "lines": lines, "times": times}) if self.versions else None
        good = {name: value for name, value in (found or {}).items() if not isinstance(value, str)}
        faults = {name: value for name, value in (found or {}).items() if isinstance(value, str)}
        ways = [Candidate(name, 1, lambda: None, sample=lambda calls, name=name: self._sample(name, calls))
                for name in good]  # fmt: skip
        return ways, list(good.values()), faults

    def _sample(self, name: str, calls: int) -> float:
        if not self.versions:
            return float("nan")
        seconds = self._ask({"sample": name, "calls": calls})
        return float("nan") if seconds is None else float(seconds)

    def _ask(self, request: dict[str, Any]) -> Any:
        assert self._process is not None
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
        except BrokenPipeError:
            self._end()
            return None
        return self._answer()

    def _answer(self) -> Any:
        """Return the next answer; None, and no peers from now on, where the process has ended."""
        assert self._process is not None
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            self._end()
            return None
        return json.loads(line)

    def _end(self) -> None:
        assert self._process is not None
        why = f"their process ended with status {self._process.wait()}"
        self.left_out.update(dict.fromkeys(self.versions or ("all peers",), why))
        self.versions = {}
