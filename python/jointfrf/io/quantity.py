"""What a file says of the quantity of its FRFs beside what its user says."""

from __future__ import annotations

from collections.abc import Iterable

from jointfrf.frf.frf_set import POWER_OF_I_OMEGA

__all__ = ["check_quantity", "contradiction", "state"]

_SHOWN = 3


def check_quantity(quantity: str | None) -> None:
    """Check what a user says.

    Raises
    ------
    ValueError
        It is none of the quantities.
    """
    if quantity is not None and quantity not in POWER_OF_I_OMEGA:
        raise ValueError(f"quantity {quantity!r} is none of {', '.join(POWER_OF_I_OMEGA)}")


def contradiction(said: str, wanted: str, where: str) -> str:
    """Say that a file and its user contradict each other, as the end of a sentence that begins with the file."""
    return f"says that it holds {said} ({where}), not {wanted}: leave the quantity out, or force it"


def state(said: Iterable[str]) -> str:
    """Put together what the FRFs of a file are said to be."""
    different = list(dict.fromkeys(said))
    more = f"; and {len(different) - _SHOWN} more" if len(different) > _SHOWN else ""
    return "; ".join(different[:_SHOWN]) + more
