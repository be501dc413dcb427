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
    call : callable
        What is timed; returns the result.
    """

    name: str
    threads: int
    prepare: Callable[[], None]
    call: Callable[[], np.ndarray]


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


def _sample(candidate: Candidate, calls: int) -> float:
    candidate.prepare()
    candidate.call()  # not timed: each begins with its own numbers in the caches, not with its neighbour's
    start = time.perf_counter()
    for _ in range(calls):
        candidate.call()
    return (time.perf_counter() - start) / calls


def time_interleaved(
    candidates: Sequence[Candidate], first: Sequence[float], budget: float, fewest: int, most: int = 51
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

    Returns
    -------
    list of Timing
        In the order of the candidates.
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
            samples[i].append(_sample(ways[i], calls[i]))
    return [Timing(tuple(some)) for some in samples]
