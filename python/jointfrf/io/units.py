"""Units of files: labels of test systems (``m/s^2``, ``g``, ``(1/N)*(m/s²)``, ``lbf``), systems of FE models."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import get_args

from jointfrf.choices import UnitSystemName
from jointfrf.kernel.arguments import check_choice, one_line

__all__ = [
    "QUANTITIES",
    "SAME_FACTOR",
    "Exponents",
    "ModelUnits",
    "StatedUnits",
    "Unit",
    "UnitSystem",
    "UnitSystemName",
    "model_units",
    "parse_frequency_unit",
    "parse_level",
    "parse_phase_unit",
    "parse_unit",
    "si_label",
]

Exponents = tuple[int, int, int]


@dataclass(frozen=True)
class Unit:
    """A unit as a factor to SI, exponents of length, force and time, and the exponent of an angle or a cycle."""

    to_si: float
    exponents: Exponents = (0, 0, 0)
    angle: int = 0

    def times(self, other: Unit, power: int = 1) -> Unit:
        """Return the product of this unit and a power of another."""
        length, force, time = (a + power * b for a, b in zip(self.exponents, other.exponents, strict=True))
        return Unit(self.to_si * other.to_si**power, (length, force, time), self.angle + power * other.angle)


@dataclass(frozen=True)
class UnitSystem:
    """Divisors of values in a file's units that give m and N (dataset 164 of Universal Files)."""

    length: float
    force: float

    def to_si(self, exponents: Exponents) -> float:
        """Return the factor to SI of a quantity with these exponents of length, force and time."""
        return self.length ** -exponents[0] * self.force ** -exponents[1]


#: Pound-force in N, gravity in m/s^2, inch in m: exact by definition; a cycle in rad.
_POUND, _GRAVITY, _INCH, _CYCLE = 4.4482216152605, 9.80665, 0.0254, 2 * math.pi
#: Quantities of FRFs by exponents of length, force and time.
QUANTITIES = {(1, -1, 0): "receptance", (1, -1, -1): "mobility", (1, -1, -2): "accelerance"}
_LENGTH, _FORCE, _TIME, _MOMENT = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)
#: Symbols with their prefixes, and words, of which some begin with the name of a prefix.
_UNITS: tuple[tuple[str, str, str, Unit], ...] = (
    ("m", "numck", "meter metre meters metres", Unit(1.0, _LENGTH)),
    ("", "", "micron microns", Unit(1e-6, _LENGTH)),
    ("mil mils thou", "", "", Unit(1e-3 * _INCH, _LENGTH)),
    ("in", "u", "inch inches", Unit(_INCH, _LENGTH)),
    ("ft", "", "foot feet", Unit(12 * _INCH, _LENGTH)),
    ("s sec", "num", "second seconds", Unit(1.0, _TIME)),
    ("min", "", "minute minutes", Unit(60.0, _TIME)),
    ("ips", "", "", Unit(_INCH, (1, 0, -1))),
    ("g gn gs", "um", "", Unit(_GRAVITY, (1, 0, -2))),
    ("N", "numckM", "newton newtons", Unit(1.0, _FORCE)),
    ("dyn", "", "dyne dynes", Unit(1e-5, _FORCE)),
    ("kgf kp", "", "kilopond", Unit(_GRAVITY, _FORCE)),
    ("lbf lbsf lb lbs", "k", "pound pounds", Unit(_POUND, _FORCE)),
    ("kip kips", "", "", Unit(1e3 * _POUND, _FORCE)),
    ("Nm", "mk", "", Unit(1.0, _MOMENT)),
    ("Nmm", "", "", Unit(1e-3, _MOMENT)),
    ("kg", "", "", Unit(1.0, (-1, 1, 2))),
    ("rad", "um", "radian radians", Unit(1.0, angle=1)),
    ("deg", "m", "degree degrees", Unit(math.pi / 180.0, angle=1)),
    ("rev cyc", "", "cycle cycles revolution revolutions", Unit(_CYCLE, angle=1)),
    ("Hz", "mkM", "hertz", Unit(_CYCLE, (0, 0, -1), 1)),
    ("cps", "", "", Unit(_CYCLE, (0, 0, -1), 1)),
    ("rpm cpm", "", "", Unit(_CYCLE / 60.0, (0, 0, -1), 1)),
)
_PREFIXES = {"n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "k": 1e3, "M": 1e6}
_PREFIX_WORDS = {"nano": 1e-9, "micro": 1e-6, "milli": 1e-3, "centi": 1e-2, "kilo": 1e3, "mega": 1e6}
#: Words that take the name of a prefix; all further words are no units of SI.
_PREFIXED = ("meter", "metre", "inch", "newton", "second", "hertz", "radian")


def _names() -> Iterator[tuple[str, Unit]]:
    """Yield every spelling of every unit, with and without prefixes."""
    for symbols, prefixes, words, unit in _UNITS:
        for name in (*symbols.split(), *words.split()):
            yield name, unit
        for symbol in symbols.split():
            for prefix in prefixes:
                yield prefix + symbol, Unit(_PREFIXES[prefix]).times(unit)
        for word in words.split():
            for prefix, factor in _PREFIX_WORDS.items() if word.rstrip("s") in _PREFIXED else ():
                yield prefix + word, Unit(factor).times(unit)


def _without_capitals(symbols: dict[str, Unit]) -> dict[str, Unit]:
    """Return the symbols in small letters, without those that then mean two things (mN and MN, nm and Nm)."""
    found: dict[str, set[Unit]] = {}
    for name, unit in symbols.items():
        found.setdefault(name.lower(), set()).add(unit)
    return {name: units.pop() for name, units in found.items() if len(units) == 1}


_SYMBOLS = dict(_names())
_SMALL = _without_capitals(_SYMBOLS)
#: Signs and their form in the grammar. Latin-1 readers of UTF-8 leave Â before signs.
_SIGNS = str.maketrans(
    {"×": "*", "·": "*", "⋅": "*", "∙": "*", "•": "*", "−": "-", "–": "-", "μ": "u", "µ": "u", "º": "°",
     "[": "(", "]": ")", "{": "(", "}": ")", "<": "(", ">": ")", "'": None, "’": None, "`": None, '"': None}
)  # fmt: skip
_STRAY, _RAISED = re.compile("Â(?=[°²³µ·])"), re.compile("[⁺⁻⁰¹²³⁴-⁹]+")
#: A pound or a kilogram of force; a point that abbreviates or multiplies.
_OF_FORCE = re.compile(r"\b(lb|pound|kg|kilogram)s?[\s_-]*(?:\(\s*f(?:orce)?\s*\)|f(?:orce)?)(?![a-z])", re.IGNORECASE)
_ABBREVIATION, _POINT = re.compile(r"(?<=[A-Za-z])\.(?=\s|$|[/*)^])"), re.compile(r"(?<!\d)\.|\.(?!\d)")
#: A number, a name or a sign of a unit.
_TOKEN = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?|[a-z]+|[-^*/()]", re.IGNORECASE)
#: A level and its reference: ``dB re 1 m/N``, ``dB (ref 1 (m/s^2)/N)``.
_LEVEL = re.compile(r"[(\[{ ]*db ?[(\[{,]? ?(?:re|rel|ref|reference)\b ?[.:=]? ?(?:to\b)?(.+)", re.IGNORECASE)
#: Number of letters of the longest label that is read.
_LONGEST = 200
#: Largest relative difference of a factor in a file from the factor of its unit: files have four digits or more.
SAME_FACTOR = 1e-3


def parse_unit(label: str) -> Unit | None:
    """Return the unit of a label.

    Parameters
    ----------
    label : str
        Products, quotients and whole powers of symbols or words, in any brackets. If the label has an unknown name, all
        its names are read without capitals, except names that then mean two things.

    Returns
    -------
    Unit or None
        Unit; None if the label is empty, NONE or not understood.

    Examples
    --------
    >>> parse_unit("mm/s^2")
    Unit(to_si=0.001, exponents=(1, 0, -2), angle=0)
    >>> parse_unit("(1/N)*(m/s2)").exponents
    (1, -1, -2)
    >>> parse_unit("Volt") is None
    True
    """
    plain = _plain(label) if len(label) <= _LONGEST else ""
    tokens = _TOKEN.findall(plain)
    if not tokens or "".join(tokens) != "".join(plain.split()):
        return None
    for symbols in (_SYMBOLS, _SMALL):
        words = tokens if symbols is _SYMBOLS else [token.lower() for token in tokens]
        try:
            unit = _Expression(words, symbols).unit()
        except (LookupError, ValueError, OverflowError, ZeroDivisionError, RecursionError):
            continue
        return unit if 0.0 < unit.to_si < math.inf else None
    return None


def _plain(label: str) -> str:
    """Return a label with the signs of the grammar."""
    text = " ".join(_STRAY.sub("", label.replace("\0", " ")).split())
    text = _RAISED.sub(lambda found: "^" + unicodedata.normalize("NFKC", found[0]), text)
    text = unicodedata.normalize("NFKC", text.translate(_SIGNS)).translate(_SIGNS).replace("°", "deg")
    text = _OF_FORCE.sub(lambda found: "lbf" if found[1].lower() in ("lb", "pound") else "kgf", text)
    text = re.sub(r"\bper\b", "/", text, flags=re.IGNORECASE).replace("**", "^").replace("^+", "^")
    return _POINT.sub("*", _ABBREVIATION.sub("", text.strip()))


class _Expression:
    """The words of a unit, read from the first to the last."""

    def __init__(self, tokens: list[str], symbols: dict[str, Unit]) -> None:
        self.tokens, self.symbols, self.before = list(tokens), symbols, ""

    def _next(self) -> str:
        self.before = self.tokens.pop(0)
        return self.before

    def unit(self) -> Unit:
        """Return the unit of all words."""
        unit = self._product()
        if self.tokens:
            raise ValueError("unbalanced bracket")
        return unit

    def _product(self) -> Unit:
        """Read factors up to the end or a closing bracket; ``a/b/c`` is a/(b c), a space or hyphen multiplies."""
        unit = self._power()
        while self.tokens and self.tokens[0] != ")":
            power = -1 if self.tokens[0] == "/" else 1
            if self.tokens[0] in "/*-":
                self._next()
            unit = unit.times(self._power(), power)
        return unit

    def _power(self) -> Unit:
        """Read a symbol, a number or a bracket, and the exponent after it if there is one."""
        may_scale = self.before in ("", "(")  # a number further on may be one for the reader of the label
        token = self._next()
        is_number = token[0].isdigit()
        if is_number and token != "1" and not may_scale:
            raise ValueError("a number among units")
        if token == "(":
            unit = self._product()
            if self._next() != ")":
                raise ValueError("unbalanced bracket")
        else:
            unit = Unit(float(token)) if is_number else self.symbols[token]
        exponent = self._exponent(after_number=is_number)
        return unit if exponent is None else Unit(1.0).times(unit, exponent)

    def _exponent(self, *, after_number: bool) -> int | None:
        """Read an exponent: ``^-2``, ``-2``, and after a symbol ``2``."""
        words = self.tokens
        is_raised = words[:1] == ["^"]
        sign = words[is_raised : is_raised + 1] == ["-"]
        place = is_raised + sign
        if place < len(words) and words[place].isdigit() and (place or not after_number):
            exponent = int(words[place])
            del words[: place + 1]
            return -exponent if sign else exponent
        if is_raised:
            raise ValueError("no exponent")
        return None


def parse_frequency_unit(label: str) -> float | None:
    """Return the factor to Hz of a unit of frequency.

    Parameters
    ----------
    label : str
        Name of the unit, such as Hz, kHz, rad/s, rpm. ``1/s`` is not understood, because it may be Hz or rad/s.

    Returns
    -------
    float or None
        Factor to Hz; None if the label is no unit of frequency.

    Examples
    --------
    >>> parse_frequency_unit("kHz"), parse_frequency_unit("1/s")
    (1000.0, None)
    """
    unit = parse_unit(label)
    if unit is None or unit.exponents != (0, 0, -1) or unit.angle != 1:
        return None
    return float(f"{unit.to_si / _CYCLE:.15g}")  # 1000, not 999.9999999999999


def parse_phase_unit(label: str) -> float | None:
    """Return the factor to rad of a unit of phase; None if the label is none."""
    unit = parse_unit(label)
    return unit.to_si if unit is not None and (unit.exponents, unit.angle) == ((0, 0, 0), 1) else None


def parse_level(label: str) -> str | None:
    """Return the reference of a label of levels; None if it states no level or no reference.

    Examples
    --------
    >>> parse_level("dB (re 1 m/N)"), parse_level("dB")
    ('1 m/N', None)
    """
    match = _LEVEL.fullmatch(" ".join(label.replace("\0", " ").split())) if len(label) <= _LONGEST else None
    if match is None:
        return None
    reference = match[1].strip()
    while reference.endswith((")", "]", "}")) and parse_unit(reference) is None:
        reference = reference[:-1].strip()
    return reference if parse_unit(reference) is not None else None


def si_label(exponents: Exponents) -> str:
    """Return the label of the SI unit with these exponents of length, force and time.

    Examples
    --------
    >>> si_label((1, -1, -2))
    'm N^-1 s^-2'
    """
    words = [f"{name}^{power}" for name, power in zip(("m", "N", "s"), exponents, strict=True) if power]
    return " ".join(word.removesuffix("^1") for word in words) or "1"


@dataclass(frozen=True)
class StatedUnits:
    """Units that the user states for files.

    Attributes
    ----------
    frf, frequency, phase, coordinates : str
        Units of the FRFs (``g/N``, ``dB re 1 m/N``), of the frequency axis, of phases and of coordinates; empty: by
        the file.
    """

    frf: str = ""
    frequency: str = ""
    phase: str = ""
    coordinates: str = ""

    @classmethod
    def parsed(cls, text: str) -> StatedUnits:
        """Read ``g/N``, ``frequency=kHz``, or several of these with commas between.

        Raises
        ------
        ValueError
            One is not understood, or is stated twice.

        Examples
        --------
        >>> StatedUnits.parsed("g/N, phase=rad")
        StatedUnits(frf='g/N', frequency='', phase='rad', coordinates='')
        """
        found: dict[str, str] = {}
        for part in filter(None, (each.strip() for each in text.split(","))):
            name, equals, label = part.partition("=")
            name, label = (name.strip().lower(), label.strip()) if equals else ("frf", part)
            if name not in (known := [each.name for each in fields(cls)]):
                raise ValueError(f"unknown quantity {one_line(name)} in unit; use one of {', '.join(known)}")
            if name in found:
                raise ValueError(f"unit states {name} twice: {found[name]}, {label}; leave one out")
            if not _UNDERSTOOD[name](label):
                raise ValueError(f"unit {one_line(label)} of {name} is not understood; use {_EXAMPLES[name]}")
            found[name] = label
        return cls(**found)

    @property
    def level(self) -> str:
        """Unit of the FRFs if it is a unit of levels, else empty."""
        return self.frf if parse_level(self.frf) else ""

    @property
    def ratio(self) -> str:
        """Unit of the FRFs, or the reference of levels."""
        return parse_level(self.frf) or self.frf

    @property
    def frf_to_si(self) -> float | None:
        """Factor to SI of the FRFs; None if no unit is stated."""
        unit = parse_unit(self.ratio)
        return None if unit is None else unit.to_si

    @property
    def coordinates_to_m(self) -> float | None:
        """Factor of coordinates to m; None if no unit is stated."""
        unit = parse_unit(self.coordinates)
        return None if unit is None else unit.to_si

    @property
    def quantity(self) -> str:
        """Quantity of FRFs in this unit; empty if none is stated."""
        return _quantity_of(self.ratio)


def _quantity_of(label: str) -> str:
    unit = parse_unit(parse_level(label) or label)
    return "" if unit is None else QUANTITIES.get(unit.exponents, "")


#: Check whether the unit of a quantity that a user states is understood, and a remedy.
_UNDERSTOOD = {
    "frf": lambda label: bool(_quantity_of(label)),
    "frequency": lambda label: parse_frequency_unit(label) is not None,
    "phase": lambda label: parse_phase_unit(label) is not None,
    "coordinates": lambda label: (unit := parse_unit(label)) is not None and unit.exponents == _LENGTH,
}
_EXAMPLES = {
    "frf": "motion per force, such as g/N, (m/s^2)/N, mm/kN or dB re 1 m/N",
    "frequency": "Hz, kHz, rad/s or rpm",
    "phase": "deg or rad",
    "coordinates": "m, mm or in",
}


@dataclass(frozen=True)
class ModelUnits:
    """A consistent system of units.

    Attributes
    ----------
    name : str
        Name of the system.
    length, mass, time : float
        Units in m, kg, s.
    words : str
        Units of length, force and time, for comments.
    """

    name: str
    length: float
    mass: float
    time: float
    words: str

    @property
    def system(self) -> UnitSystem:
        """The system in the form of dataset 164 of Universal Files."""
        return UnitSystem(1.0 / self.length, self.time**2 / (self.mass * self.length))

    def scale(self, seconds: int, rotations: int = 0) -> float:
        """Return the unit of a matrix entry in SI units.

        Parameters
        ----------
        seconds : int
            Kind of the matrix: 0 for a mass, 1 for viscous damping, 2 for a stiffness.
        rotations : int
            Number of rotations among its two DOFs: N/m, N, N m/rad.

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
