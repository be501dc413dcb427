"""Arguments that state the noise of FRFs."""

from __future__ import annotations

import argparse
import math
from typing import NamedTuple

from jointfrf.choices import POWER_OF_I_OMEGA
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["Floor", "add_floor_argument", "add_noise_arguments"]


class Floor(NamedTuple):
    """A floor, and the quantity in which it is constant."""

    level: float
    quantity: str


def add_noise_arguments(parser: CommandParser) -> None:
    """Add the options of a fit that state the noise."""
    parser.option(
        "--noise LEVEL",
        "relative noise of the FRFs; 0.01 means 1 %%; with --floor, 0 if no part is relative",
        float,
        otherwise="estimated from the FRFs",
    )
    add_floor_argument(parser, "; needs --noise")


def add_floor_argument(parser: CommandParser, more: str = "") -> None:
    """Add the option of the floors."""
    parser.option(
        "--floor LEVEL[:QUANTITY]",
        "noise floor, independent of the FRF: of the accelerance in m/(s^2 N), as accelerometers have, or of another "
        f"quantity: 2e-9:receptance (m/N), 1e-6:mobility (m/(s N)); may be repeated{more}",
        _floor,
        repeated=True,
    )


def _floor(word: str) -> Floor:
    number, colon, quantity = word.partition(":")
    quantity = quantity if colon else "accelerance"
    if quantity not in POWER_OF_I_OMEGA:
        hint = did_you_mean(quantity, POWER_OF_I_OMEGA)
        raise argparse.ArgumentTypeError(f"unknown quantity {quantity!r}; use {', '.join(POWER_OF_I_OMEGA)}{hint}")
    try:
        level = float(number)
    except ValueError:
        level = -1.0
    if not 0 < level < math.inf:
        raise argparse.ArgumentTypeError(f"{word!r} is no floor above zero; give one, such as 0.01 or 2e-9:receptance")
    return Floor(level, quantity)
