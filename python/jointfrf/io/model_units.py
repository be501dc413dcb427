"""Systems of units of finite-element models: what one unit of length, mass and time is in SI units."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from jointfrf.kernel.arguments import check_choice

__all__ = ["ModelUnits", "UnitSystemName", "model_units"]

UnitSystemName = Literal["SI", "mm-t-s", "mm-kg-ms"]


@dataclass(frozen=True)
class ModelUnits:
    """A consistent system of units.

    Attributes
    ----------
    name : str
    length, mass, time : float
        What one unit is in m, kg, s.
    words : str
        Its units of length, force and time, for comments.
    """

    name: str
    length: float
    mass: float
    time: float
    words: str

    def scale(self, seconds: int, rotations: int = 0) -> float:
        """Return what one unit of a matrix entry is in SI units.

        Parameters
        ----------
        seconds : int
            0 of a mass, 1 of viscous damping, 2 of a stiffness.
        rotations : int
            How many of its two DOFs are rotations: N/m, N, N m/rad.

        Examples
        --------
        1 N/mm, 1 N mm/rad and 1 t:

        >>> from jointfrf.io.model_units import model_units
        >>> mm = model_units("mm-t-s")
        >>> [float(f"{mm.scale(*one):.3g}") for one in ((2,), (2, 2), (0,))]
        [1000.0, 0.001, 1000.0]
        """
        return self.mass * self.time**-seconds * self.length**rotations


_SYSTEMS = {
    "SI": ModelUnits("SI", 1.0, 1.0, 1.0, "m, N, s"),
    "mm-t-s": ModelUnits("mm-t-s", 1e-3, 1e3, 1.0, "mm, N, s"),  # t mm/s^2 = N
    "mm-kg-ms": ModelUnits("mm-kg-ms", 1e-3, 1.0, 1e-3, "mm, kN, ms"),  # kg mm/ms^2 = kN
}


def model_units(name: str) -> ModelUnits:
    """Return a system of units by its name.

    Raises
    ------
    ValueError
        There is none of this name.
    """
    check_choice("units", name, get_args(UnitSystemName))
    return _SYSTEMS[name]
