"""Options that state the noise of FRFs: a part relative to them, and floors."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from jointfrf.frf.stated_noise import StatedNoise
from jointfrf.workbench.cli.arguments.noise import Floor
from jointfrf.workbench.cli.usage import UsageError

__all__ = ["noise_of", "stated_noise"]


def stated_noise(args: argparse.Namespace) -> StatedNoise | float | None:
    """Return the noise that the options of a fit state; None where they state none.

    Raises
    ------
    UsageError
        A floor without the relative part, or two of one quantity.
    """
    if args.floor is None:
        return args.noise if args.noise is None else float(args.noise)
    if args.noise is None:
        raise UsageError("--floor states only a part of the noise; add --noise LEVEL, 0 if no part is relative")
    return noise_of(args.noise, args.floor)


def noise_of(relative: float, floors: Sequence[Floor] | None) -> StatedNoise:
    """Return noise of a relative part and floors."""
    found: dict[str, float] = {}
    for one in floors or ():
        if one.quantity in found:
            raise UsageError(f"--floor states {one.quantity} twice; give one")
        found[one.quantity] = one.level
    return StatedNoise(relative, **found)
