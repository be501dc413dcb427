"""A case as data: reading and checking `case.toml` and `expected.toml`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar, cast, get_args

import numpy as np

from jointfrf._sweep import FloatArray
from jointfrf.bands import Band, in_bands
from jointfrf.beam import BeamElement, End, beam
from jointfrf.discrete import Ground, chain
from jointfrf.errors import FileContentError
from jointfrf.identify import Method
from jointfrf.joint import Joint
from jointfrf.model import Model
from jointfrf.noise import NoiseKind, NoiseReference
from jointfrf.toml_table import Table, read_toml

__all__ = ["METHODS", "BandSet", "Case", "Expected", "ExpectedTable", "Noise", "Substructure", "read_case", "unit_of"]

METHODS: tuple[str, ...] = get_args(Method)
_MOTIONS = ("translation", "rotation")
_MOST_LINES = 1_000_000
_T = TypeVar("_T")


@dataclass(frozen=True)
class Substructure:
    """One of the two structures that the joint connects.

    Attributes
    ----------
    model : Model
    x : ndarray, shape (n_nodes,), or None
        Positions of the nodes along a beam, m.
    """

    model: Model
    x: FloatArray | None


@dataclass(frozen=True)
class BandSet:
    """Sensitive bands of every parameter: name to list of (low, high), Hz."""

    name: str
    bands: dict[str, list[Band]]


@dataclass(frozen=True)
class Noise:
    """A level of pollution, as `jointfrf.pollute` takes it, and the methods applied to it."""

    name: str
    level: float
    kind: NoiseKind
    relative_to: NoiseReference
    reciprocal: bool
    block: int
    methods: tuple[str, ...]


@dataclass(frozen=True)
class ExpectedTable:
    """Published numbers of one identification: parameter to value, and the largest errors allowed, percent."""

    source: str
    noise: str
    method: str
    bands: str
    values: dict[str, float]
    rmse_below: dict[str, float]


@dataclass(frozen=True)
class Expected:
    """What is known about a case: natural frequencies in Hz, tables, and the numbers of the source's figures."""

    frequencies: tuple[tuple[str, str, tuple[float, ...], float], ...] = ()
    tables: tuple[ExpectedTable, ...] = ()
    figures: tuple[tuple[str, str], ...] = ()

    def figure(self, key: str) -> str:
        """Return the number of a figure in the source, or an empty text."""
        return dict(self.figures).get(key, "")


@dataclass(frozen=True)
class Case:
    """A simulated identification.

    Attributes
    ----------
    folder : Path
        Where the case stands.
    title, section : str
        What it is, and where the source treats it.
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    a, b : Substructure
    dofs_j, dofs_k, dofs_r, dofs_s : list of int
        Joint DOFs and internal DOFs, in A (j, r) and B (k, s), counted from 0.
    joint, initial : Joint
        The actual joint and its first estimate.
    rotational : tuple of bool
        Which joint DOFs are rotations.
    band_sets : tuple of BandSet
        The first is that of the tables.
    noises : tuple of Noise
    realisations, seed : int
    expected : Expected
    """

    folder: Path
    title: str
    section: str
    freq_hz: FloatArray
    a: Substructure
    b: Substructure
    dofs_j: list[int]
    dofs_k: list[int]
    dofs_r: list[int]
    dofs_s: list[int]
    joint: Joint
    initial: Joint
    rotational: tuple[bool, ...]
    band_sets: tuple[BandSet, ...]
    noises: tuple[Noise, ...]
    realisations: int
    seed: int
    expected: Expected

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.name

    @property
    def parameters(self) -> tuple[str, ...]:
        """``k_<dof>`` of every DOF, then ``c_<dof>``."""
        return tuple(f"{letter}_{dof}" for letter in "kc" for dof in self.joint.dofs)

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of every parameter."""
        return tuple(unit_of(letter, turns) for letter in "kc" for turns in self.rotational)

    @property
    def actual(self) -> FloatArray:
        """Values of the parameters of the actual joint."""
        return np.concatenate([np.diagonal(self.joint.stiffness), np.diagonal(self.joint.damping)])


def unit_of(letter: str, rotational: bool) -> str:
    """Return the unit of a stiffness ("k") or a damping ("c")."""
    return {"k": ("N/m", "N m/rad"), "c": ("N s/m", "N m s/rad")}[letter][rotational]


def read_case(folder: Path) -> Case:
    """Read `case.toml` of a folder, and `expected.toml` where there is one.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    Case

    Raises
    ------
    FileContentError
        One sentence that names the file and the key.
    """
    path = folder / "case.toml"
    table = read_toml(path)
    title, section = table.text("title"), table.text("section")
    freq = _frequency(table.table("frequency"))
    a, b = (_substructure(table.table(f"substructure_{side}")) for side in "ab")
    joint, initial, rotational = _joint(table.tables("joint"))
    points = table.table("points")
    j, r = (_points(points, point, a.model, len(rotational)) for point in "jr")
    k, s = (_points(points, point, b.model, len(rotational)) for point in "ks")
    points.close()
    parameters = [f"{letter}_{dof}" for letter in "kc" for dof in joint.dofs]
    band_sets = tuple(_band_set(entry, parameters, freq) for entry in table.tables("bands"))
    noises = tuple(_noise(entry, len(rotational)) for entry in table.tables("noise"))
    study = table.table("study")
    number, seed = study.whole("realisations", 1), study.whole("seed")
    study.close()
    table.close()
    for what, names in (("bands", [x.name for x in band_sets]), ("noise", [x.name for x in noises])):
        if len(set(names)) < len(names):
            raise FileContentError(f"{path}: two tables [[{what}]] have the same name")
    expected = Expected()
    if (folder / "expected.toml").is_file():
        expected = _expected(read_toml(folder / "expected.toml"), parameters, band_sets, noises)
    return Case(
        folder.resolve(), title, section, freq, a, b, j, k, r, s, joint, initial, rotational, band_sets, noises,
        number, seed, expected,
    )  # fmt: skip


def _frequency(table: Table) -> FloatArray:
    first, last, step = table.number("first", 0), table.number("last", 0), table.number("step", 0)
    table.close()
    if step <= 0:
        raise table.error("step", "positive, in Hz")
    if first <= 0:
        raise table.error("first", "above 0 Hz, where Im K*/w is defined")
    if last < first:
        raise table.error("last", f"at least {first:g} Hz")
    if (last - first) / step > _MOST_LINES:
        raise table.error("step", f"larger: there would be more than {_MOST_LINES} lines")
    count = int((last - first) / step + 1 + 1e-9)
    return np.round(first + step * np.arange(count), 9)


def _substructure(table: Table) -> Substructure:
    kind = table.text("model", ("beam", "chain"))
    loss_factor = table.number("loss_factor", 0)
    if kind == "chain":
        numbers = [table.numbers(key) for key in ("masses", "stiffness", "damping")]
        ground = table.text("ground", get_args(Ground))
        table.close()
        return _built(
            table, lambda: Substructure(chain(*numbers, ground=cast(Ground, ground), loss_factor=loss_factor), None)
        )
    length, youngs_modulus, density, width, height = (
        table.number(key) for key in ("length", "youngs_modulus", "density", "width", "height")
    )
    elements = table.whole("elements", 1)
    ends = table.texts("ends", get_args(End))
    element = cast(BeamElement, table.text("element", get_args(BeamElement)))
    # Without shear there is no Poisson's ratio.
    poisson = table.number("poisson", -0.99) if element == "shear-flexible" else 0.0
    axial = table.truth("axial")
    table.close()

    def build() -> Substructure:
        model = beam(
            length, elements, youngs_modulus=youngs_modulus, density=density, width=width, height=height,
            ends=cast(tuple[End, End], ends), element=element, axial=axial, poisson=poisson, loss_factor=loss_factor,
        )  # fmt: skip
        return Substructure(model, np.linspace(0, length, elements + 1))

    return _built(table, build)


def _built(table: Table, build: Callable[[], _T]) -> _T:
    """Call a builder; its complaints name the table."""
    try:
        return build()
    except (ValueError, TypeError) as error:
        raise FileContentError(f"{table.where}: {error}") from error


def _joint(tables: list[Table]) -> tuple[Joint, Joint, tuple[bool, ...]]:
    dofs, rotational = [], []
    values: dict[str, list[float]] = {
        key: [] for key in ("stiffness", "damping", "initial_stiffness", "initial_damping")
    }
    for table in tables:
        dofs.append(table.text("dof"))
        rotational.append(table.text("motion", _MOTIONS) == "rotation")
        for key, column in values.items():
            column.append(table.number(key, 0))
        table.close()
    actual = _built(tables[-1], lambda: Joint(values["stiffness"], values["damping"], dofs))
    initial = Joint(values["initial_stiffness"], values["initial_damping"], dofs)
    return actual, initial, tuple(rotational)


def _points(table: Table, point: str, model: Model, n: int) -> list[int]:
    names = table.texts(point)
    if len(names) != n:
        raise table.error(point, f"a list of {n} DOFs, as many as the joint has")

    def found() -> list[int]:
        return [int(model.index(name)) for name in names]  # type: ignore[arg-type]

    return _built(table, found)


def _band_set(table: Table, parameters: list[str], freq: FloatArray) -> BandSet:
    name = table.text("name")
    bands = {parameter: table.bands(parameter) for parameter in parameters}
    table.close()
    for parameter, own in bands.items():
        try:
            in_bands(freq, own)
        except ValueError as error:
            raise FileContentError(f"{table.where}: {parameter}: {error}") from error
    return BandSet(name, bands)


def _noise(table: Table, n: int) -> Noise:
    noise = Noise(
        table.text("name"),
        table.number("level", 0),
        table.text("kind", get_args(NoiseKind)),  # type: ignore[arg-type]
        table.text("relative_to", get_args(NoiseReference)),  # type: ignore[arg-type]
        table.truth("reciprocal"),
        table.whole("block", 1),
        table.texts("methods", METHODS),
    )
    table.close()
    if n % noise.block:
        raise table.error("block", f"a divisor of {n}, the number of joint DOFs")
    return noise


def _expected(
    table: Table, parameters: list[str], band_sets: tuple[BandSet, ...], noises: tuple[Noise, ...]
) -> Expected:
    frequencies = []
    for entry in table.tables("frequencies") if "frequencies" in table else []:
        joint = entry.text("joint", ("actual", "initial"))
        frequencies.append(
            (joint, entry.text("source"), tuple(entry.numbers("values")), entry.number("within_percent", 0))
        )
        entry.close()
    tables = []
    for entry in table.tables("identified") if "identified" in table else []:
        source, noise = entry.text("source"), entry.text("noise", [x.name for x in noises])
        method = entry.text("method", METHODS)
        if method not in next(x for x in noises if x.name == noise).methods:
            raise entry.error("method", f"one of the methods that case.toml applies to {noise!r}")
        bands = "" if method == "compliance" else entry.text("bands", [x.name for x in band_sets])
        columns = []
        for key in ("values", "rmse_below"):
            column = {}
            if key in entry:
                inner = entry.table(key)
                column = {parameter: inner.number(parameter) for parameter in parameters if parameter in inner}
                inner.close()
            columns.append(column)
        tables.append(ExpectedTable(source, noise, method, bands, *columns))
        entry.close()
    figures: tuple[tuple[str, str], ...] = ()
    if "figures" in table:
        inner = table.table("figures")
        figures = tuple((key, inner.text(key)) for key in inner.keys())  # noqa: SIM118
    table.close()
    return Expected(tuple(frequencies), tuple(tables), figures)
