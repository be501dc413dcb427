"""What a part of the attack is: numbered cases, each made by its seed and number alone."""

from __future__ import annotations

from typing import Protocol

import numpy as np

__all__ = ["BrokenError", "Part", "random_of"]


class BrokenError(Exception):
    """What must never happen has happened; the message says what, and to which call."""


class Part(Protocol):
    """One kind of attack."""

    def run(self, random: np.random.Generator) -> str:
        """Make one case and say in a few words what came of it; BrokenError where that must not be."""
        ...


def random_of(seed: int, number: int) -> np.random.Generator:
    """Random numbers of one case: the same, whichever cases ran before."""
    return np.random.Generator(np.random.Philox(key=seed, counter=number << 64))
