"""Timing: all candidates in turn, again and again, so that a disturbance meets all of them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

#: A sample lasts at least this long, s: a call that is shorter is repeated within it.
_SAMPLE = 2e-3


@dataclass(frozen=True)
class Candidate:
    """One way to do an operation.

    Attributes
    ----------
    name : str
    threads : int
    prepare : callable
        Called before every sample, not timed: engine, number of threads.
    call : callable, optional
        What is timed; returns the result.
    sample : callable, optional
        Instead of `call`: times so many calls somewhere else and returns the seconds of one, NaN where it cannot.
    """

    name: str
    threads: int
    prepare: Callable[[], None]
    call: Callable[[], np.ndarray] | None = None
    sample: Callable[[int], float] | None = None


@dataclass(frozen=True)
class Timing:
    """Seconds of one call, one number a sample."""

    samples: tuple[float, ...]

    @property
    def median(self) -> float:
        """Median of the samples."""
        return float(np.median(self.samples))

    @property
    def spread(self) -> float:
        """Distance of the quartiles over the median."""
        low, high = np.percentile(self.samples, [25, 75])
        return float((high - low) / self.median)


#: Seconds that pass, or that this process computes on any of its threads: those that other programs take do not count.
CLOCKS: dict[str, Callable[[], float]] = {"wall": time.perf_counter, "processor": time.process_time}


def call_repeatedly(call: Callable[[], object], calls: int, clock: str = "wall") -> float:
    """Return the seconds of a call by a clock, the mean of so many."""
    now = CLOCKS[clock]
    call()  # not timed: each begins with its own numbers in the caches, not with its neighbour's
    start = now()
    for _ in range(calls):
        call()
    return (now() - start) / calls


def _sample(candidate: Candidate, calls: int, clock: str) -> float:
    candidate.prepare()
    if candidate.sample is not None:
        return candidate.sample(calls)
    assert candidate.call is not None
    return call_repeatedly(candidate.call, calls, clock)


def time_interleaved(
    candidates: Sequence[Candidate],
    first: Sequence[float],
    budget: float,
    fewest: int,
    most: int = 51,
    clock: str = "wall",
) -> list[Timing]:
    """Time candidates in turn.

    Parameters
    ----------
    candidates : sequence of Candidate
    first : sequence of float
        Seconds that a call of each took: says how often a short one is repeated in a sample.
    budget : float
        After so many seconds no new round begins, once there were `fewest`.
    fewest, most : int
        Number of rounds.
    clock : str
        One of `CLOCKS`.

    Returns
    -------
    list of Timing
        In the order of the candidates; without samples where one could not be timed to the end.
    """
    ways = list(candidates)
    calls = [max(1, math.ceil(_SAMPLE / max(seconds, 1e-7))) for seconds in first]
    samples: list[list[float]] = [[] for _ in ways]
    end = time.perf_counter() + budget
    for turn in range(most):
        if turn >= fewest and time.perf_counter() > end:
            break
        # Each round begins with another one: none always follows the same.
        for k in range(len(ways)):
            i = (turn + k) % len(ways)
            samples[i].append(_sample(ways[i], calls[i], clock))
    return [Timing(() if any(map(math.isnan, some)) else tuple(some)) for some in samples]
