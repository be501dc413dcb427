"""What the ordinate of a dataset 58 means: which quantity, and its factor to SI."""

from __future__ import annotations

import math
from collections.abc import Callable

from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, Channel
from jointfrf.io.uff_function import Axis
from jointfrf.io.units import Exponents, Unit, UnitSystem

__all__ = ["kind_of_frf", "ordinate_factor", "ordinate_quantity"]

_UNSAID = (0, 1)
_FORCES = (9, 13)
_QUANTITY = {8: "receptance", 11: "mobility", 12: "accelerance"}
_TOLERANCE = 1e-3


def kind_of_frf(numerator: Axis, denominator: Axis) -> str | None:
    """None for motion per force as far as the data types say, else what it is instead."""
    is_motion = numerator.data_type in (*_QUANTITY, *_UNSAID)
    is_force = denominator.data_type in (*_FORCES, *_UNSAID)
    return None if is_motion and is_force else f"{numerator.name} per {denominator.name}"


def ordinate_quantity(numerator: Axis, denominator: Axis, channels: tuple[Channel, Channel]) -> str | None:
    """Quantity by the data types, by the unit labels where these say nothing; None where neither does."""
    said = numerator.unit.exponents if numerator.unit else None
    said_below = denominator.unit.exponents if denominator.unit else None
    for name, power in POWER_OF_I_OMEGA.items():
        motion, force, ratio = _exponents(*channels, power)
        is_silent = numerator.data_type in _UNSAID
        is_named = _QUANTITY.get(numerator.data_type) == name
        is_force = denominator.data_type in _FORCES or said_below == force
        if (is_named or is_silent) and said == ratio:
            return name
        if (is_named or (is_silent and said == motion)) and is_force:
            return name
    return None


def ordinate_factor(
    numerator: Axis,
    denominator: Axis,
    channels: tuple[Channel, Channel],
    quantity: str,
    system: UnitSystem | None,
    trust_labels: bool,
    note: Callable[[str], None],
) -> float:
    """Factor that turns the ordinate into SI units: by the labels, else by dataset 164, else 1 with a note.

    Raises
    ------
    ValueError
        A label contradicts the quantity and `trust_labels` is set.
    """
    motion, force, ratio = _exponents(*channels, POWER_OF_I_OMEGA[quantity])
    if numerator.unit is not None and numerator.unit.exponents == ratio:
        return _checked(numerator, numerator.unit, system, note)
    factors = []
    for axis, exponents, what in ((numerator, motion, "response"), (denominator, force, "excitation")):
        if axis.unit is not None and axis.unit.exponents == exponents:
            factors.append(_checked(axis, axis.unit, system, note))
            continue
        if axis.unit is not None and trust_labels:
            raise ValueError(
                f"the unit '{axis.label}' does not fit the {what} of {quantity} {channels[0]} / {channels[1]}"
            )
        why = f"the unit '{axis.label}' of the {what} is not used" if axis.label else f"the {what} has no unit"
        if system is None:
            note(f"{why} and there is no dataset 164: SI units are assumed")
        elif axis.label:
            note(f"{why}: dataset 164 gives the units")
        factors.append(1.0 if system is None else system.to_si(exponents))
    return factors[0] / factors[1]


def _exponents(response: Channel, excitation: Channel, power: int) -> tuple[Exponents, Exponents, Exponents]:
    """Exponents of length, force, time of the motion, of the force or moment, and of their ratio."""
    motion = (0 if response.is_rotation else 1, 0, -power)
    force = (1 if excitation.is_rotation else 0, 1, 0)
    return motion, force, (motion[0] - force[0], -1, -power)


def _checked(axis: Axis, unit: Unit, system: UnitSystem | None, note: Callable[[str], None]) -> float:
    """Factor of a label; a note where dataset 164 contradicts it (no system of 164 has g, so g is none)."""
    by_system = unit.to_si if system is None else system.to_si(unit.exponents)
    if not math.isclose(unit.to_si, by_system, rel_tol=_TOLERANCE) and not axis.label.lower().startswith("g"):
        note(f"the unit '{axis.label}' contradicts dataset 164: the unit is used")
    return unit.to_si
