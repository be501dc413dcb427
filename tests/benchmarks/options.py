"""What the benchmark commands read from their command lines."""

from __future__ import annotations

import argparse


def numbers(text: str) -> tuple[int, ...]:
    """Whole numbers from 1 on, with commas between them."""
    found = tuple(int(word) for word in text.split(","))
    if min(found) < 1:
        raise argparse.ArgumentTypeError("numbers from 1 on")
    return found
