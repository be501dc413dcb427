"""To and from pyFBS: arrays with tables of channels, virtual points, and files of its users."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, check_file
from jointfrf.frf.frf_set import ChannelPlace, FrfSet, JointSide
from jointfrf.io.arrays import as_frf_set
from jointfrf.io.csv_file import TextTable, read_text_table
from jointfrf.io.file_format import FrfArrays, Reading
from jointfrf.io.npy_file import npy_values
from jointfrf.io.pyfbs_tables import POSITION, PyfbsChannels, PyfbsRow, channels_of_tables, rows_of_table
from jointfrf.io.units import parse_unit, si_label
from jointfrf.io.xlsx_file import is_sheet, read_sheet, sheet_names
from jointfrf.kernel.arguments import check_type

__all__ = ["PyfbsTest", "from_pyfbs", "is_pyfbs_heading", "places_of_sheets", "with_named_files"]

#: Names of rows and columns of FRFs in messages and mappings.
_SIDES = ("responses", "excitations")
#: A mapping entry that names a table of channels, and one that names a file of frequencies.
_TABLE = re.compile(r".+\.(?:xlsx(?:#.+)?|csv)", re.IGNORECASE)
_FREQUENCIES = re.compile(r".+\.npy", re.IGNORECASE)


class PyfbsTest(NamedTuple):
    """A test of pyFBS.

    Attributes
    ----------
    frfs : FrfSet
        FRFs, with coordinates if all channels point along axes; otherwise `places` has the positions.
    places : tuple of ChannelPlace
        Position, direction and, for the named groupings, side of each translation, as argument of `joint_channels`.
    """

    frfs: FrfSet
    places: tuple[ChannelPlace, ...]


def from_pyfbs(
    test: Any,
    frf: ArrayLike | None = None,
    df_chn: Any = None,
    df_imp: Any = None,
    *,
    unit: str,
    position_unit: str,
    sides: Mapping[Any, JointSide] | None = None,
    axes: str = "freq,out,in",
    coherence: ArrayLike | None = None,
    quantity: str | None = None,
    source: str = "pyFBS",
) -> PyfbsTest:
    """Return the FRFs of pyFBS with the places of their channels.

    Parameters
    ----------
    test : array_like, shape (n_freq,), or VPT
        Frequency lines in Hz; or a virtual point transformation of pyFBS 1.0 after `apply_vpt`, with its FRFs.
    frf : array_like of complex, three axes in the order of `axes`
        FRFs in `unit`; not with a `VPT`, which contains them.
    df_chn, df_imp : DataFrame, mapping of columns, or sequence of mappings
        Tables of channels and impacts: ``Position_1`` to ``Position_3``, ``Direction_1`` to ``Direction_3``, and if
        there are any ``Grouping``, ``Quantity``, ``Description``. Descriptions ``ux`` to ``rz`` and ``fx`` to ``mz``
        are DOFs of a virtual point. Not with a `VPT`, which contains them.
    unit : str
        Unit of the FRFs of translations, such as ``m/s^2/N``.
    position_unit : str
        Unit of the positions, such as ``mm``. Tables do not state it.
    sides : mapping of grouping to {"j", "k"}, optional
        Side of the joint of the groupings around it, ``{1: "j", 2: "k"}``. By default `places` have no side.
    axes : str
        Order of the axes, default ``freq,out,in``.
    coherence : array_like, shape of `frf`, optional
        Ordinary coherence.
    quantity : {"receptance", "mobility", "accelerance"}, optional
        Quantity of the FRFs; by default the one of `unit`.
    source : str
        Name in messages.

    Returns
    -------
    PyfbsTest
        FRFs in SI units. Channels at one place and of one grouping share a node, counted from 1 in table order;
        a virtual point has the number of its grouping. A direction along an axis has its name and sign, an oblique one
        the next name that is free at its node.

    Raises
    ------
    FileContentError
        Sizes, names or units do not match; the message states which.
    ValueError, TypeError
        An argument is missing or wrong.

    See Also
    --------
    frfs_of_arrays : FRFs of other arrays.
    jointfrf.joint_channels : transform from the places to joint DOFs.

    Notes
    -----
    Virtual points of pyFBS have rotations per unit of position: with positions in mm, 1e-3 rad/s^2 and N mm. Their FRFs
    are converted to rad/s^2 and N m.

    Examples
    --------
    >>> import numpy as np
    >>> import jointfrf as jf
    >>> chn = [{"Grouping": 1, "Position_1": 10.0, "Position_2": 0.0, "Position_3": 0.0,
    ...         "Direction_1": 0.6, "Direction_2": 0.8, "Direction_3": 0.0}]
    >>> test = jf.io.from_pyfbs([10.0], np.ones((1, 1, 1)), chn, chn, unit="m/s^2/N", position_unit="mm",
    ...                         sides={1: "j"})
    >>> place = test.places[0]
    >>> str(place.channel), place.side, place.position.tolist(), place.unit.tolist()
    ('1:+x', 'j', [0.01, 0.0, 0.0], [0.6, 0.8, 0.0])
    """
    freq, h, tables = _parts(test, frf, df_chn, df_imp)
    length = _length(position_unit)
    check_type("unit", unit, str)
    reading = Reading.checked(quantity)
    rows = [rows_of_table(what, table, length) for what, table in zip(_SIDES, tables, strict=True)]
    channels = channels_of_tables(rows[0], rows[1], sides)
    turns = [np.array([row.is_virtual and row.is_rotation for row in own], dtype=int) for own in rows]
    found = parse_unit(unit)
    scale = 1.0
    if found is not None and any(
        own.any() for own in turns
    ):  # a linear unit of virtual points is also a unit of rotations
        unit, scale = si_label(found.exponents), found.to_si
    content = FrfArrays(
        freq, h, axes, channels.responses, channels.excitations, "", unit, coherence,
        coordinates={} if channels.oblique else channels.coordinates,
    )  # fmt: skip
    frfs = as_frf_set(content, source, reading)
    reading.warn()
    factor = scale * length ** -(turns[0][:, None] + turns[1]).astype(float)
    return PyfbsTest(replace(frfs, h=frfs.h * factor), channels.places)


def _parts(test: Any, frf: Any, df_chn: Any, df_imp: Any) -> tuple[Any, Any, tuple[Any, Any]]:
    """Return lines, FRFs and tables; a `VPT` contains its own."""
    if not hasattr(test, "apply_vpt"):
        missing = [name for name, one in (("frf", frf), ("df_chn", df_chn), ("df_imp", df_imp)) if one is None]
        if missing:
            raise ValueError(f"{missing[0]} is missing; give frf, df_chn and df_imp after the frequencies, or a VPT")
        return test, frf, (df_chn, df_imp)
    if any(one is not None for one in (frf, df_chn, df_imp)):
        raise ValueError("a VPT has its own FRFs and tables; leave frf, df_chn and df_imp out")
    if not hasattr(test, "frf") or not hasattr(test, "df_chn") or not hasattr(test, "df_imp"):
        raise ValueError("the VPT has no FRFs; call its apply_vpt(freq, frf) first (pyFBS 1.0 or later)")
    return test.freq, test.frf, (test.df_chn, test.df_imp)


def _length(unit: str) -> float:
    """Return a unit of length in m."""
    check_type("position_unit", unit, str)
    found = parse_unit(unit)
    if found is None or found.exponents != (1, 0, 0):
        raise ValueError(f"position_unit {unit!r} is no unit of length; use m, mm or in")
    return found.to_si


def is_pyfbs_heading(heading: list[str]) -> bool:
    """Return whether the columns of a table are columns of pyFBS."""
    return POSITION[0] in heading


def _rows_of_file(what: str, path: Path, sheet: str | None, to_m: float) -> list[PyfbsRow]:
    """Return the rows of a sheet, or of a text table."""
    table = read_sheet(path, sheet) if is_sheet(path) else read_text_table(path)
    return rows_of_text_table(what, path, table, to_m)


def rows_of_text_table(what: str, path: Path, table: TextTable, to_m: float) -> list[PyfbsRow]:
    """Return the rows of a table that was read.

    Raises
    ------
    FileContentError
        A column is named twice or missing, or a row is wrong.
    """
    heading = [word for word in table.heading if word]
    if len(set(heading)) < len(heading):
        raise FileContentError(f"{path} names a column twice ({', '.join(heading)}); leave one out")
    cells = [cells for _, cells in table.rows]
    numbers = (*POSITION, *(name.replace("Position", "Direction") for name in POSITION))
    try:
        columns: dict[str, list[Any]] = {
            name: [table.number(row[i]) if name in numbers else row[i] for row in cells]
            for i, name in enumerate(table.heading) if name
        }  # fmt: skip
        return rows_of_table(what, columns, to_m)
    except ValueError as error:
        raise FileContentError(f"{path}: {error}") from error


def places_of_sheets(path: Path, position_unit: str) -> tuple[ChannelPlace, ...]:
    """Return the places of the channels in two sheets of a workbook, ``test.xlsx#Channels_AB,Impacts_AB``.

    Parameters
    ----------
    path : Path
        Workbook and names of the sheets of channels and of impacts.
    position_unit : str
        Unit of the positions.

    Raises
    ------
    FileContentError
        The name does not have two sheets, a unit is missing, or a sheet is wrong.
    """
    file, sheets = sheet_names(path)
    if len(sheets) != 2:
        raise FileContentError(
            f"{path} names {len(sheets)} sheets; name channels and impacts, {file.name}#Channels_AB,Impacts_AB"
        )
    if not position_unit:
        raise FileContentError(f"{path} has no unit of positions; give unit= with coordinates=mm")
    length = _length(position_unit)
    one, other = (_rows_of_file(what, file, sheet, length) for what, sheet in zip(_SIDES, sheets, strict=True))
    return channels_of_tables(one, other).places


def with_named_files(path: Path, reading: Reading, limit_gb: float | None) -> tuple[Reading, PyfbsChannels | None]:
    """Read files that a mapping names, in the folder of the FRFs: tables of channels, and an array of frequencies.

    Parameters
    ----------
    path : Path
        Name of the file of FRFs.
    reading : Reading
        Statements of the user.
    limit_gb : float or None
        Largest size in memory, GB; see `read_frfs`.

    Returns
    -------
    Reading
        Statements with channels and frequencies in place of the names of files.
    PyfbsChannels or None
        Channels of the tables, if there are any.

    Raises
    ------
    FileContentError
        Only one side is a table, the unit of positions is not stated, or a file is wrong.
    """
    mapping, folder = reading.mapping, path.parent
    lines = mapping.freq_hz
    for name in (lines, mapping.responses, mapping.excitations):
        is_file = isinstance(name, str) and (_TABLE.fullmatch(name) or _FREQUENCIES.fullmatch(name))
        if is_file and Path(name).name != name:
            raise FileContentError(
                f"{path}: {name} is not in the folder of the FRFs; name a file there, without a folder"
            )
    if isinstance(lines, str) and _FREQUENCIES.fullmatch(lines):
        check_file(folder / lines, limit_gb)
        mapping = replace(mapping, freq_hz=npy_values(folder / lines, ReadLimit(folder / lines, limit_gb)))
    named = [one for one in (mapping.responses, mapping.excitations) if isinstance(one, str) and _TABLE.fullmatch(one)]
    if not named:
        return replace(reading, mapping=mapping), None
    if len(named) == 1:
        raise FileContentError(
            f"{path}: {named[0]} is a table; name one for each of mapping responses= and excitations="
        )
    if not reading.units.coordinates:
        raise FileContentError(f"{path}: {named[0]} has no unit of positions; give unit= with coordinates=mm")
    length = _length(reading.units.coordinates)
    rows = []
    for what, name in zip(_SIDES, named, strict=True):
        file, sheets = sheet_names(folder / name)
        if len(sheets) > 1:
            raise FileContentError(f"{path}: {name} names several sheets for mapping {what}=; name one")
        rows.append(_rows_of_file(what, file, sheets[0] if sheets else None, length))
    channels = channels_of_tables(rows[0], rows[1])
    if any(row.is_virtual and row.is_rotation for own in rows for row in own) and length != 1.0:
        raise FileContentError(
            f"{path}: rotations of virtual points with positions in {reading.units.coordinates} are not in SI units; "
            "use jointfrf.io.from_pyfbs, which converts them"
        )
    if channels.note:
        reading.notes.append(f"{path}: {channels.note}")
    mapping = replace(mapping, responses=channels.responses, excitations=channels.excitations)
    return replace(reading, mapping=mapping), channels
