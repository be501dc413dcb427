"""Units of files: labels of test systems (``m/s^2``, ``g``, ``(1/N)*(m/s²)``, ``lbf``), systems of FE models."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal, get_args

from jointfrf.kernel.arguments import check_choice

__all__ = ["Exponents", "ModelUnits", "Unit", "UnitSystem", "UnitSystemName", "model_units", "parse_unit"]

Exponents = tuple[int, int, int]


@dataclass(frozen=True)
class Unit:
    """A unit as a factor to SI and exponents of length, force and time (a radian is a pure number)."""

    to_si: float
    exponents: Exponents = (0, 0, 0)

    def times(self, other: Unit, power: int = 1) -> Unit:
        """Return the product of this unit and a power of another."""
        length, force, time = (a + power * b for a, b in zip(self.exponents, other.exponents, strict=True))
        return Unit(self.to_si * other.to_si**power, (length, force, time))


@dataclass(frozen=True)
class UnitSystem:
    """What values in a file's units are divided by to give m and N (dataset 164 of Universal Files)."""

    length: float
    force: float

    def to_si(self, exponents: Exponents) -> float:
        """Factor to SI of a quantity with these exponents of length, force and time."""
        return self.length ** -exponents[0] * self.force ** -exponents[1]


#: Pound-force in N, gravity in m/s^2, inch in m: exact by definition.
_POUND, _GRAVITY, _INCH = 4.4482216152605, 9.80665, 0.0254
#: By their exponents, what one is in SI units.
_UNITS: dict[Exponents, dict[str, float]] = {
    (1, 0, 0): {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "mil": 1e-3 * _INCH, "in": _INCH,
                "inch": _INCH, "ft": 12 * _INCH},
    (0, 0, 1): {"s": 1.0, "sec": 1.0},
    (1, 0, -1): {"ips": _INCH},
    (1, 0, -2): {"g": _GRAVITY, "gn": _GRAVITY},
    (0, 1, 0): {"N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6, "dyn": 1e-5, "kgf": _GRAVITY, "kp": _GRAVITY,
                "lbf": _POUND, "lb": _POUND, "lbs": _POUND},
    (1, 1, 0): {"Nm": 1.0, "kNm": 1e3, "Nmm": 1e-3},
    (-1, 1, 2): {"kg": 1.0},
    (0, 0, 0): {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0},
}  # fmt: skip
#: All units by their names.
_SYMBOLS = {name: Unit(to_si, exponents) for exponents, units in _UNITS.items() for name, to_si in units.items()}
# U+FFFD is what is left of a superscript 2 in Latin-1.
_SPELLINGS = {"²": "^2", "\ufffd": "^2", "**": "^", "·": "*", ".": "*", "µ": "u", "μ": "u", "°": "deg"}
#: A name, a number or a sign of a unit.
_TOKEN = re.compile(r"[A-Za-z]+|\d+|[-^*/()]")


def parse_unit(label: str) -> Unit | None:
    """Read a unit label.

    Parameters
    ----------
    label : str
        Products, quotients and whole powers of the usual symbols; capitals are forgiven where only one symbol fits.

    Returns
    -------
    Unit or None
        None where the label is empty, NONE or not understood.

    Examples
    --------
    >>> parse_unit("mm/s^2")
    Unit(to_si=0.001, exponents=(1, 0, -2))
    >>> parse_unit("(1/N)*(m/s2)").exponents
    (1, -1, -2)
    >>> parse_unit("Volt") is None
    True
    """
    for spelling, meaning in _SPELLINGS.items():
        label = label.replace(spelling, meaning)
    label = label.strip()
    tokens = _TOKEN.findall(label)
    if label.upper() in ("", "NONE") or "".join(tokens) != "".join(label.split()):
        return None
    try:
        unit = _product(tokens)
    except (LookupError, ValueError, OverflowError, ZeroDivisionError, RecursionError):
        return None
    return unit if not tokens and 0.0 < unit.to_si < math.inf else None


def _product(tokens: list[str]) -> Unit:
    """Read factors up to the end or a closing bracket; ``a/b/c`` is a/(b c), a space or hyphen multiplies."""
    unit = _power(tokens)
    while tokens and tokens[0] != ")":
        power = -1 if tokens[0] == "/" else 1
        if tokens[0] in "/*-":
            tokens.pop(0)
        unit = unit.times(_power(tokens), power)
    return unit


def _power(tokens: list[str]) -> Unit:
    """Read a symbol, a number or a bracket, and the exponent after it if there is one."""
    token = tokens.pop(0)
    if token == "(":
        unit = _product(tokens)
        if tokens.pop(0) != ")":
            raise ValueError("unbalanced bracket")
    else:
        unit = Unit(float(token)) if token.isdigit() else _symbol(token)
    raised = tokens[:1] == ["^"]
    if raised:
        tokens.pop(0)
    negative = len(tokens) > 1 and tokens[0] == "-" and tokens[1].isdigit()
    if negative:
        tokens.pop(0)
    if tokens and tokens[0].isdigit():
        return Unit(1.0).times(unit, int(tokens.pop(0)) * (-1 if negative else 1))
    if raised:
        raise ValueError("no exponent")
    return unit


def _symbol(name: str) -> Unit:
    if name in _SYMBOLS:
        return _SYMBOLS[name]
    alike = [symbol for symbol in _SYMBOLS if symbol.lower() == name.lower()]
    if len(alike) != 1:
        raise LookupError(name)
    return _SYMBOLS[alike[0]]


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

        >>> from jointfrf.io.units import model_units
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
