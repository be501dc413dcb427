"""A case as data: reading and checking `case.toml` and `expected.toml`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar, cast, get_args

import numpy as np
from scipy import sparse

from jointfrf.cases.known_joint.expected import METHODS, Expected, Known, read_expected
from jointfrf.cases.toml_table import Table, read_toml
from jointfrf.errors import FileContentError
from jointfrf.frf.bands import Band, in_bands
from jointfrf.frf.noise import NoiseKind, NoiseReference
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.models.beam import BeamElement, End, beam
from jointfrf.models.chain import Ground, chain
from jointfrf.models.model import Model
from jointfrf.solids.brick import Material
from jointfrf.solids.brick_beam import Face, Hole, Preset, brick_beam

__all__ = [
    "METHODS",
    "BandSet",
    "Case",
    "Noise",
    "Observed",
    "Substructure",
    "built",
    "read_bands",
    "read_case",
    "read_frequency",
    "read_joint",
    "read_noise",
    "unit_of",
]

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
class Observed:
    """An FRF of the assembly that is looked at: response and force at one DOF of an internal point.

    Attributes
    ----------
    key : str
        "r" or "s", and the direction where a case names some: "s-Fx".
    point : str
        "r" or "s".
    dof : int
        DOF of the point, in the order of the joint's.
    bands : tuple of (low, high)
        Where errors of regenerated FRFs are counted, Hz; all lines if empty.
    """

    key: str
    point: str
    dof: int
    bands: tuple[Band, ...] = ()


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
    dofs_j, dofs_k : list of int
        Joint DOFs in A and B, counted from 0.
    ports_a, ports_b : list of int, or sparse array of weights
        Joint DOFs, then internal ones, in A (j, r) and B (k, s), as `jointfrf.receptance` takes them.
    joint, initial : Joint
        The actual joint and its first estimate.
    rotational : tuple of bool
        Which joint DOFs are rotations.
    observed : tuple of Observed
        FRFs of the assembly that are looked at.
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
    ports_a: list[int] | sparse.csr_array
    ports_b: list[int] | sparse.csr_array
    joint: Joint
    initial: Joint
    rotational: tuple[bool, ...]
    observed: tuple[Observed, ...]
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
    freq = read_frequency(table.table("frequency"))
    a, b = (_substructure(table.table(f"substructure_{side}")) for side in "ab")
    joint, initial, rotational = read_joint(table.tables("joint"))
    points = table.table("points")
    j, r, k, s = (_points(points, point, len(rotational)) for point in "jrks")
    points.close()
    observed = _observed(table, joint.dofs, freq)
    parameters = [f"{letter}_{dof}" for letter in "kc" for dof in joint.dofs]
    band_sets = tuple(read_bands(entry, parameters, freq) for entry in table.tables("bands"))
    noises = tuple(read_noise(entry, len(rotational)) for entry in table.tables("noise"))
    study = table.table("study")
    number, seed = study.whole("realisations", 1), study.whole("seed")
    study.close()
    table.close()
    for what, names in (("bands", [x.name for x in band_sets]), ("noise", [x.name for x in noises])):
        if len(set(names)) < len(names):
            raise FileContentError(f"{path}: two tables [[{what}]] have the same name")
    expected = Expected()
    if (folder / "expected.toml").is_file():
        known = Known(
            tuple(parameters),
            tuple(band_set.name for band_set in band_sets),
            {noise.name: noise.methods for noise in noises},
            {one.key: one.bands for one in observed},
        )
        expected = read_expected(folder / "expected.toml", known)
    return Case(
        folder.resolve(), title, section, freq, a, b, _dofs(points, a.model, j), _dofs(points, b.model, k),
        _ports(points, a.model, j + r), _ports(points, b.model, k + s), joint, initial, rotational, observed,
        band_sets, noises, number, seed, expected,
    )  # fmt: skip


def read_frequency(table: Table) -> FloatArray:
    """Read the frequency lines, Hz."""
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
    kind = table.text("model", ("beam", "brick-beam", "chain"))
    if kind == "brick-beam":
        return _brick_beam(table)
    loss_factor = table.number("loss_factor", 0)
    if kind == "chain":
        numbers = [table.numbers(key) for key in ("masses", "stiffness", "damping")]
        ground = table.text("ground", get_args(Ground))
        table.close()
        return built(
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

    return built(table, build)


def _brick_beam(table: Table) -> Substructure:
    numbers = ("youngs_modulus", "poisson", "density", "loss_factor")
    properties = [table.number(key, -0.99 if key == "poisson" else 0) for key in numbers]
    length, width, height = (table.number(key) for key in ("length", "width", "height"))
    ends = table.texts("ends", get_args(End))
    preset = cast(Preset, table.text("preset", get_args(Preset)))
    origin = table.numbers("origin")
    if len(origin) != 3:
        raise table.error("origin", "x, y, z in m")
    hole = None
    if "hole" in table:
        inner = table.table("hole")
        position, radius, patch_radius = (inner.number(key, 0) for key in ("position", "radius", "patch_radius"))
        hole = Hole(position, radius, patch_radius, cast(Face, inner.text("face", get_args(Face))))
        inner.close()
    observed = {}
    if "observed" in table:
        inner = table.table("observed")
        observed = {name: inner.number(name, 0) for name in inner.keys()}  # noqa: SIM118
    table.close()

    def build() -> Substructure:
        model = brick_beam(
            length, width, height, Material(*properties), ends=cast(tuple[End, End], ends), hole=hole,
            observed=observed, preset=preset, origin=cast(tuple[float, float, float], tuple(origin)),
        )  # fmt: skip
        return Substructure(model, None)

    return built(table, build)


def built(table: Table, build: Callable[[], _T]) -> _T:
    """Call a builder; its complaints name the table."""
    try:
        return build()
    except (ValueError, TypeError) as error:
        raise FileContentError(f"{table.where}: {error}") from error


def read_joint(tables: list[Table]) -> tuple[Joint, Joint, tuple[bool, ...]]:
    """Read the joint and its first estimate, and which DOFs are rotations."""
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
    actual = built(tables[-1], lambda: Joint(values["stiffness"], values["damping"], dofs))
    initial = Joint(values["initial_stiffness"], values["initial_damping"], dofs)
    return actual, initial, tuple(rotational)


def _points(table: Table, point: str, n: int) -> tuple[str, ...]:
    names = table.texts(point)
    if len(names) != n:
        raise table.error(point, f"a list of {n} DOFs, as many as the joint has")
    return names


def _ports(table: Table, model: Model, names: tuple[str, ...]) -> list[int] | sparse.csr_array:
    """Return what `jointfrf.receptance` takes for these names."""
    return built(table, lambda: model.ports(*names))


def _dofs(table: Table, model: Model, names: tuple[str, ...]) -> list[int]:
    """Return DOFs, counted from 0: a joint cannot act on a mean."""
    return built(table, lambda: [int(model.index(name)) for name in names])  # type: ignore[arg-type]


def _observed(table: Table, dofs: tuple[str, ...], freq: FloatArray) -> tuple[Observed, ...]:
    if "observed" not in table:
        return (Observed("r", "r", 0), Observed("s", "s", 0))
    found = []
    for entry in table.tables("observed"):
        point, dof = entry.text("point", ("r", "s")), entry.text("dof", dofs)
        bands = tuple(entry.bands("bands")) if "bands" in entry else ()
        entry.close()
        _check_lines(entry, "bands", bands, freq)
        found.append(Observed(f"{point}-{dof}", point, dofs.index(dof), bands))
    if len({one.key for one in found}) < len(found):
        raise FileContentError(f"{table.where}: two tables [[observed]] name the same FRF")
    return tuple(found)


def _check_lines(table: Table, key: str, bands: Sequence[Band], freq: FloatArray) -> None:
    """Complain of bands without frequency lines."""
    try:
        if bands:
            in_bands(freq, bands)
    except ValueError as error:
        raise FileContentError(f"{table.where}: {key}: {error}") from error


def read_bands(table: Table, parameters: list[str], freq: FloatArray) -> BandSet:
    """Read the bands of all parameters."""
    name = table.text("name")
    bands = {parameter: table.bands(parameter) for parameter in parameters}
    table.close()
    for parameter, own in bands.items():
        _check_lines(table, parameter, own, freq)
    return BandSet(name, bands)


def read_noise(table: Table, n: int) -> Noise:
    """Read a noise level for n joint DOFs."""
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
