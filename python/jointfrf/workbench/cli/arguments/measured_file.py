"""Arguments of a file of FRFs: how it is read, which joint is in it, masses and noise that the user states."""

import argparse
import math
from dataclasses import field
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from jointfrf.choices import MAPPING_FIELDS, POWER_OF_I_OMEGA, format_names
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cli.arguments.declaration import Arguments, Form, flag, option, positional
from jointfrf.workbench.cli.arguments.words import Band, Dofs, NodeList, Point, Words, whole
from jointfrf.workbench.cli.usage import UsageError

__all__ = [
    "BandArguments",
    "FileArguments",
    "Floor",
    "FloorArguments",
    "JointArguments",
    "MassArguments",
    "NoiseArguments",
    "PlaceArguments",
    "PointArguments",
    "ReadingArguments",
]


def _unit(text: str) -> str:
    from jointfrf.io.units import StatedUnits  # only if a unit is stated

    try:
        StatedUnits.parsed(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def _field(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or name not in MAPPING_FIELDS or not value:
        hint = did_you_mean(name, MAPPING_FIELDS) if equals else ""
        raise argparse.ArgumentTypeError(
            f"{text!r} is not FIELD=NAME; use a field of {', '.join(MAPPING_FIELDS)}{hint}"
        )
    return name, value


class ReadingArguments(Arguments):
    """Quantity of the FRFs and their place in files."""

    quantity: Literal["receptance", "mobility", "accelerance"] | None = option(
        "quantity of the FRFs, if the file does not state it"
    )
    force_quantity: bool = flag("use --quantity and --unit even if the file states another quantity or unit")
    unit: Annotated[str, Form("UNIT", _unit)] | None = option(
        "unit of the FRFs, if the file does not state one that is understood: g/N, mm/kN, 'dB re 1 m/N'; other units "
        "by name: frequency=kHz, phase=rad, coordinates=mm; several between commas"
    )
    skip_lines: Annotated[int, Form("N", partial(whole, least=0))] = option(
        "lines before the heading of a text table", default=0
    )
    map: list[Annotated[tuple[str, str], Form("FIELD=NAME", _field)]] = option(
        f"name of a field in a MATLAB, NPZ or HDF5 file: {', '.join(MAPPING_FIELDS)}; responses and excitations also "
        "as names (responses=1:x,2:x), axes as freq,out,in in their order; may be repeated",
        default=[],
        keyword="mapping",
    )

    def reading(self) -> dict[str, Any]:
        """Return the keyword arguments of `jointfrf.io.read_frfs`."""
        if self.force_quantity and self.quantity is None and self.unit is None:
            raise UsageError("--force-quantity has no effect without --quantity or --unit; leave it out")
        mapping = dict(self.map)
        if len(mapping) < len(self.map):
            raise UsageError("--map names a field twice; name each field once")
        return self.keywords(ReadingArguments) | {"mapping": mapping, "unit": self.unit or ""}


class PlaceArguments(Arguments):
    """The points on both sides, and the DOFs."""

    heading = "the joint in the file"

    j: NodeList | None = option("nodes on side j: 102,104 or 101:116")
    k: NodeList | None = option("nodes on side k; without --at in the order of --j")
    dofs: Dofs | None = option("joint DOFs out of x,y,z,theta_x,theta_y,theta_z (or rx,ry,rz), such as y,theta_x")
    at: Point | None = option(
        "reference point of the joint in m: its DOFs are the DOFs of virtual points there, from all channels of the "
        "nodes; without it, the nodes of each side lie along a line"
    )
    at_k: Point | None = option("reference point of side k in m", otherwise="the point of --at")
    channels: Path | None = option(
        "TOML or CSV table of sensors and impacts (side, position, direction), if the file of FRFs lacks them; needs "
        "--at",
        "TABLE",
    )
    spacing: float | None = option(
        "distance between neighbouring nodes along a line, if the file has no coordinates; needs --axis", "METRES"
    )
    axis: Literal["x", "y", "z"] | None = option("direction of the line of nodes; needs --spacing")


class BandArguments(Arguments):
    """Bands of the lines that are used."""

    band: list[Band] | None = option("frequency band in Hz; may be repeated")


class JointArguments(PlaceArguments, BandArguments, ReadingArguments):
    """The joint in files, and how these are read: properties of a project."""

    files: list[Path] = field(default_factory=list)

    @property
    def source(self) -> str:
        """Names of the files without their folders."""
        return ", ".join(path.name for path in self.files)


class PointArguments(Arguments):
    """Several joint points."""

    points: Words | None = option(
        "names of several joint points, bolt1,bolt2: one node of --j and of --k for each, with all of --dofs in the "
        "file; the DOFs are named bolt1.x, ..."
    )


class FileArguments(JointArguments, PointArguments):
    """The files of one test, and the joint in them."""

    heading = "the joint in the file"

    files: list[Path] = positional(
        f"FRFs of the points around the joint: {format_names()}; several files of one test are merged", "FILE"
    )


class MassArguments(Arguments):
    """Masses that the user states."""

    mass_j: float | None = option(
        "mass of side j, kg: an error if the FRFs show another one (their unit is wrong)", "KG"
    )
    mass_k: float | None = option("mass of side k, kg", "KG")
    mass: float | None = option("mass of both sides together, kg", "KG")


class Floor(NamedTuple):
    """A floor, and the quantity in which it is constant."""

    level: float
    quantity: str


def _floor(word: str) -> Floor:
    level, colon, quantity = word.partition(":")
    quantity = quantity if colon else "accelerance"
    if quantity not in POWER_OF_I_OMEGA:
        hint = did_you_mean(quantity, POWER_OF_I_OMEGA)
        raise argparse.ArgumentTypeError(f"unknown quantity {quantity!r}; use {', '.join(POWER_OF_I_OMEGA)}{hint}")
    try:
        found = float(level)
    except ValueError:
        found = -1.0
    if not 0 < found < math.inf:
        raise argparse.ArgumentTypeError(f"{word!r} is no floor above zero; give one, such as 0.01 or 2e-9:receptance")
    return Floor(found, quantity)


class FloorArguments(Arguments):
    """Floors of the noise."""

    floor: list[Annotated[Floor, Form("LEVEL[:QUANTITY]", _floor)]] | None = option(
        "noise floor, independent of the FRF: of the accelerance in m/(s^2 N), as accelerometers have, or of another "
        "quantity: 2e-9:receptance (m/N), 1e-6:mobility (m/(s N)); may be repeated"
    )


class NoiseArguments(FloorArguments):
    """Noise of a fit, and its floors."""

    noise: float | None = option(
        "relative noise of the FRFs; 0.01 means 1 %; --floor needs it, 0 if no part is relative",
        "LEVEL",
        otherwise="estimated from the FRFs",
    )
