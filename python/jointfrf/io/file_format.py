"""Parts of a format of files of FRFs, and statements of a user about the files."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.files import ReadLimit
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, Channel, FrfSet
from jointfrf.frf.setups import SetUps
from jointfrf.io.labels import ChannelNamer
from jointfrf.io.units import SAME_FACTOR, StatedUnits
from jointfrf.kernel.arguments import as_nodes, check_type, one_line
from jointfrf.spelling import did_you_mean

__all__ = ["TIME_DATA", "FileFormat", "FrfArrays", "FrfMapping", "Reading"]

#: Remedy for time data, at the end of a sentence.
TIME_DATA = "estimate FRFs from the time data first, for example with pyFRF"


@dataclass(frozen=True)
class FrfMapping:
    """Fields of a file by their meaning; None: fields with the usual names.

    Parameters
    ----------
    freq_hz : str or array_like, optional
        Field of the frequencies in Hz, or the frequencies, or an NPY file in the folder of the FRFs, ``freq.npy``. Or
        first frequency and spacing, ``5:0.5``, each a number or the name of a field.
    h, coherence, averages, quantity, unit : str, optional
        Names of fields; inside structures or groups with points between, ``test.frf``; of structure arrays with an
        index from 1, or all by a colon, ``test(3).frf``, ``test(:).frf``.
    real, imag, magnitude, phase_deg, phase_rad : str, optional
        Names of fields with the parts of the FRFs, in place of `h`.
    responses, excitations : str or sequence of str, optional
        Field with the names of the channels, or these names. Functions stored one by one take a name for each, in their
        order, or one for all. Or a table of pyFBS in the folder of the FRFs, ``test.xlsx#Channels_AB``.
    response_nodes, response_directions, excitation_nodes, excitation_directions : str, optional
        Fields of nodes, or nodes such as ``1,2`` or ``1:81``; and fields of directions as names or codes 1 to 6, or one
        direction. One value is used for all channels. They replace `responses` and `excitations`.
    direction : str, optional
        Direction of the channels that have none in the file.
    components : str or mapping of str to int, optional
        Number to add to the nodes of each component, ``frame:0,arm:1000``.
    axes : str, optional
        Order of the axes: ``freq,out,in``, ``out,in,freq``, ...; by default from the sizes.
    """

    freq_hz: Any = None
    h: str | None = None
    responses: Any = None
    excitations: Any = None
    response_nodes: str | None = None
    response_directions: str | None = None
    excitation_nodes: str | None = None
    excitation_directions: str | None = None
    direction: str | None = None
    components: Any = None
    axes: str | None = None
    quantity: str | None = None
    unit: str | None = None
    coherence: str | None = None
    averages: str | None = None
    real: str | None = None
    imag: str | None = None
    magnitude: str | None = None
    phase_deg: str | None = None
    phase_rad: str | None = None

    @property
    def names_frfs(self) -> bool:
        """Whether the user names the field of the FRFs, or fields of their parts."""
        own = (self.h, self.real, self.imag, self.magnitude, self.phase_deg, self.phase_rad)
        return any(each is not None for each in own)

    @property
    def namer(self) -> ChannelNamer:
        """Maker of channels from the names in one file."""
        return ChannelNamer(self.direction, self.components)

    def names_of(self, side: str, count: int, where: str) -> list[Any] | None:
        """Return the names that the user lists for a side of functions one by one; None if there are none.

        Raises
        ------
        FileContentError
            The number of names is not one, and not the number of functions.
        """
        given = getattr(self, side)
        if given is None or not count:
            return None
        names = [each.strip() for each in given.split(",")] if isinstance(given, str) else list(given)
        if len(names) not in (1, count):
            raise FileContentError(
                f"{where} contains {count} functions of a kind, and mapping {side}= has {len(names)} names; give one "
                "for each, in their order, or one for all"
            )
        return names * count if len(names) == 1 else names


@dataclass(frozen=True)
class Reading:
    """Statements of the user about files, and warnings for the user.

    Attributes
    ----------
    quantity : str or None
        Quantity of the FRFs.
    forced : bool
        Whether a file may contradict the quantity.
    nodes : frozenset of int or None
        Nodes between which FRFs are read; all by default.
    mapping : FrfMapping
        Fields by their meaning.
    is_part : bool
        Whether a file is one of several: coherence without FRFs is then sufficient.
    units : StatedUnits
        Units that the user states.
    skip_lines : int
        Number of lines of a text table before its heading.
    notes : list of str
        Assumptions and omissions of readers, one sentence each.
    """

    quantity: str | None = None
    forced: bool = False
    nodes: frozenset[int] | None = None
    mapping: FrfMapping = FrfMapping()
    is_part: bool = False
    notes: list[str] = field(default_factory=list)
    units: StatedUnits = field(default_factory=StatedUnits)
    skip_lines: int = 0

    @classmethod
    def checked(
        cls,
        quantity: str | None,
        forced: bool = False,
        nodes: Collection[int] | None = None,
        mapping: Mapping[str, Any] | FrfMapping | None = None,
        is_part: bool = False,
        *,
        unit: str = "",
        skip_lines: int = 0,
    ) -> Reading:
        """Check the arguments of a reader.

        Raises
        ------
        ValueError, TypeError
            One is wrong.
        """
        if quantity is not None and quantity not in POWER_OF_I_OMEGA:
            raise ValueError(f"unknown quantity {one_line(quantity)}; use one of {', '.join(POWER_OF_I_OMEGA)}")
        wanted = None if nodes is None else frozenset(as_nodes("nodes", nodes))
        check_type("unit", unit, str)
        check_type("skip_lines", skip_lines, int)
        if skip_lines < 0:
            raise ValueError(f"skip_lines must be 0 or more, not {skip_lines}")
        units = StatedUnits.parsed(unit)
        if quantity and units.quantity not in ("", quantity):
            raise ValueError(f"unit {units.frf} is one of {units.quantity}, not {quantity}; correct one of them")
        quantity = quantity or units.quantity or None
        return cls(quantity, forced, wanted, _as_mapping(mapping), is_part, units=units, skip_lines=skip_lines)

    @property
    def options(self) -> dict[str, str]:
        """Statements of the user in addition to the quantity, by their name in messages."""
        named = {each.name: f"mapping {each.name}=" for each in fields(self.mapping)
                 if getattr(self.mapping, each.name) is not None}  # fmt: skip
        units = {each.name: f"unit {each.name}=" for each in fields(self.units)
                 if each.name != "frf" and getattr(self.units, each.name)}  # fmt: skip
        level = {"level": f"unit {self.units.frf}"} if self.units.level else {}
        return named | units | level | ({"skip_lines": "skip_lines="} if self.skip_lines else {})

    def check_options(self, taken: Collection[str] | None, names: str) -> None:
        """Raise ValueError for an option without effect on any file."""
        idle = [text for name, text in self.options.items() if taken is not None and name not in taken]
        if idle:
            have = "has" if len(idle) == 1 else "have"
            raise ValueError(f"{' and '.join(idle)} {have} no effect on {names}; leave it out")

    def agreed(self, what: str, stated: float | None, found: float | None, label: str) -> float | None:
        """Return the factor to SI of a unit, stated by the user or by the file.

        Parameters
        ----------
        what : str
            Quantity with this unit, for the message.
        stated, found : float or None
            Factors that the user and the file state.
        label : str
            Unit in the file.

        Raises
        ------
        ValueError
            Both differ, and nothing is forced.
        """
        if stated is None or found is None:
            return found if stated is None else stated
        if abs(stated / found - 1.0) > SAME_FACTOR and not self.forced:
            raise ValueError(f"the unit of the {what} is '{label}', not the one of unit=; leave unit out, or force it")
        return stated

    def warn(self) -> None:
        """Issue a warning for every note; to be called by a public function."""
        for note in self.notes:
            warnings.warn(note, FileContentWarning, stacklevel=3)


def _as_mapping(given: Mapping[str, Any] | FrfMapping | None) -> FrfMapping:
    if not isinstance(given, Mapping | FrfMapping | None):
        raise TypeError(f"mapping must be a mapping or an FrfMapping, not {type(given).__name__}")
    if not isinstance(given, FrfMapping):
        names = [each.name for each in fields(FrfMapping)]
        for name in given or {}:
            if name not in names:
                hint = did_you_mean(str(name), names)
                raise ValueError(f"unknown field {one_line(name)} in mapping; use one of {', '.join(names)}{hint}")
        given = FrfMapping(**(given or {}))
    direction = None if given.direction is None else _direction(given.direction)
    return replace(given, direction=direction, components=_components(given.components))


def _direction(given: Any) -> str:
    try:
        return Channel(1, given).direction
    except (ValueError, TypeError) as error:
        raise ValueError(f"{error}; correct mapping direction=") from error


def _components(given: Any) -> dict[str, int] | None:
    """Return the number that is added to the nodes of each component."""
    if given is None:
        return None
    pairs = given.items() if isinstance(given, Mapping) else [each.rpartition(":")[::2] for each in given.split(",")]
    try:
        found = {str(name).strip(): int(number) for name, number in pairs}
    except (ValueError, TypeError):
        found = {}
    if not found or min(found.values()) < 0 or "" in found:
        raise ValueError(f"mapping components={one_line(given)} is not like components=frame:0,arm:1000")
    return found


@dataclass
class FrfArrays:
    """Content of a file, in its own units and order, with notes on fields that are not read or used."""

    freq_hz: Any
    h: Any
    axes: str = ""
    responses: Any = None
    excitations: Any = None
    quantity: str = ""
    unit: str = ""
    coherence: Any = None
    averages: Any = None
    coordinates: Mapping[int, NDArray[np.float64]] = field(default_factory=dict)
    setups: SetUps | None = None
    notes: list[str] = field(default_factory=list)
    frequency_unit: str = ""  #: Hz by default
    takes: Collection[str] | None = None  #: as of `FileFormat`


def _never(*_: object) -> bool:
    return False


@dataclass(frozen=True, kw_only=True)
class FileFormat:
    """A format of files of FRFs.

    Attributes
    ----------
    name : str
        Name of the format.
    suffixes : tuple of str
        Usual suffixes; the first is the recommended one.
    content : str
        Content that is read, for the documentation.
    read : callable
        Function of the path, the limit of memory and the `Reading`; returns the arrays as they are in the file, or a
        set in SI units.
    has_mark : callable
        Function of the first bytes of a file: whether they belong to no other format.
    looks_alike : callable
        Function of a path and the first bytes: whether they suggest the format, if no format has its mark there.
    write : callable, optional
        Function of the path and a set.
    needs : str
        Packages to install, for the documentation.
    package : str
        Package that writing needs in addition to the requirements of the installation, a name of `extras`.
    keeps_setups : bool
        Whether such a file contains the set-up of each FRF.
    takes : collection of str, optional
        Names of `Reading.options` that have an effect on such a file; None: all. `FrfArrays.takes` narrows it.
    """

    name: str
    suffixes: tuple[str, ...]
    content: str
    read: Callable[[Path, ReadLimit, Reading], FrfArrays | FrfSet]
    has_mark: Callable[[bytes], bool] = _never
    looks_alike: Callable[[Path, bytes], bool] = _never
    write: Callable[[Path, FrfSet], None] | None = None
    needs: str = ""
    package: str = ""
    keeps_setups: bool = False
    takes: Collection[str] | None = None
