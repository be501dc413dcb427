"""The two structures that a joint connects: chains, beams, bricks, matrices and FRFs, as files declare them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import field
from scipy import sparse

from jointfrf.cases.keys import MaterialKeys, read_frf_file
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, Channel, FrfSet
from jointfrf.io.matrix_file import read_dof_names, read_matrix
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.models.beam import BeamElement, End, beam
from jointfrf.models.matrices import is_symmetric
from jointfrf.models.model import Ground, Model, chain
from jointfrf.solids.brick_beam import Face, Hole, Preset, brick_beam
from jointfrf.toml.declared import Keys, NotNegative, Positive, key, read_keys
from jointfrf.toml.table import TomlTable

__all__ = [
    "PRESET",
    "SUBSTRUCTURES",
    "MeasuredStructure",
    "ModelStructure",
    "Structure",
    "SubstructureKeys",
    "read_model",
]

#: Two frequencies are the same line if they differ by less than this share: Universal Files hold six digits.
_SAME_LINE = 1e-5
#: A key of all models of bricks.
PRESET = key("Elements: `seed` as in the thesis (C3D8R), `accurate` with incompatible modes (C3D8I).", example="seed")


class Structure(ABC):
    """One of the two structures that the joint connects."""

    @abstractmethod
    def check_points(self, joint: Sequence[str], internal: Sequence[str]) -> None:
        """Raise a ValueError if a joint DOF or an internal one is missing, or a joint DOF is named twice."""

    @abstractmethod
    def receptance(self, freq_hz: FloatArray, points: Sequence[str]) -> ComplexArray:
        """Return the receptance between DOFs, shape (n_freq, m, m), m/N."""


def _check_once(names: Sequence[str]) -> None:
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise ValueError(f"the joint DOF {twice[0]!r} is named twice")


@dataclass(frozen=True)
class ModelStructure(Structure):
    """A substructure known by its model.

    Attributes
    ----------
    model : Model
    x : ndarray, shape (n_nodes,), or None
        Positions of the nodes along a beam, m.
    """

    model: Model
    x: FloatArray | None = None

    def check_points(self, joint: Sequence[str], internal: Sequence[str]) -> None:
        """Raise an error if a DOF is missing; a joint cannot act on a mean motion."""
        self.dofs(joint)
        _check_once(joint)
        self.model.ports(*joint, *internal)

    def dofs(self, names: Sequence[str]) -> list[int]:
        """Return DOFs, counted from 0."""
        found = self.model.index(*names)
        return [found] if isinstance(found, int) else found

    def receptance(self, freq_hz: FloatArray, points: Sequence[str]) -> ComplexArray:
        """Return the receptance of the model."""
        return self.model.receptance(freq_hz, self.model.ports(*points))


@dataclass(frozen=True)
class MeasuredStructure(Structure):
    """A substructure known by its FRFs.

    Attributes
    ----------
    frfs : FrfSet
        Receptances.
    """

    frfs: FrfSet

    def check_points(self, joint: Sequence[str], internal: Sequence[str]) -> None:
        """Raise an error if an FRF is missing, or a point does not move where it is driven."""
        channels = [Channel.parse(name) for name in (*joint, *internal)]
        _check_once([f"{channel.node}:{channel.axis}" for channel in channels[: len(joint)]])
        h = self.frfs.matrix(channels, channels)
        for i, channel in enumerate(channels):
            if not h[:, i, i].any():
                raise ValueError(f"{self.frfs.source}: the FRF {channel} / {channel} is zero on all lines")

    def receptance(self, freq_hz: FloatArray, points: Sequence[str]) -> ComplexArray:
        """Return the receptances on lines that the set holds."""
        h: ComplexArray = self.frfs.matrix(points, points)[self.lines_at(freq_hz)]
        return h

    def lines_at(self, freq_hz: FloatArray) -> list[int]:
        """Return the lines of the set at given frequencies; raises a ValueError where it has none there."""
        held = self.frfs.freq_hz
        above = np.clip(np.searchsorted(held, freq_hz), 1, max(held.size - 1, 1))
        below = above - 1
        above = np.minimum(above, held.size - 1)
        nearest = np.where(abs(held[above] - freq_hz) < abs(held[below] - freq_hz), above, below)
        missing = abs(held[nearest] - freq_hz) > _SAME_LINE * freq_hz
        if missing.any():
            first = int(np.argmax(missing))
            raise ValueError(
                f"{self.frfs.source} has no line at {freq_hz[first]:g} Hz, the nearest is {held[nearest[first]]:g} Hz "
                f"({int(missing.sum())} of {freq_hz.size} lines are missing); [frequency] can take the lines of a file "
                "by from_file"
            )
        return [int(line) for line in nearest]


class SubstructureKeys(Keys, tag_field="model"):
    """One of the two structures that the joint connects."""

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure; FRFs must be available on all lines, Hz. Raises FileContentError."""
        raise NotImplementedError


class ChainKeys(SubstructureKeys, tag="chain"):
    """Lumped masses in a line; DOFs `"1:x"`, `"2:x"`, ..."""

    masses: Annotated[tuple[float, ...], key("Masses, from one end to the other.", "kg", example=[5.0, 3.0])]
    stiffness: Annotated[
        tuple[float, ...],
        key("Springs in their order, that to the ground included.", "N/m", example=[2500.0, 3500.0]),
    ]
    damping: Annotated[tuple[float, ...], key("Dashpots beside the springs.", "N s/m", example=[3.0, 4.0])]
    ground: Annotated[Ground, key("Which ends are held by a spring.")] = "start"
    loss_factor: Annotated[NotNegative, key("Loss factor eta of the stiffness, K (1 + i eta).")] = 0.0

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        own = [list(numbers) for numbers in (self.masses, self.stiffness, self.damping)]
        return ModelStructure(self.build(lambda: chain(*own, ground=self.ground, loss_factor=self.loss_factor)))


class BeamKeys(SubstructureKeys, tag="beam"):
    """Beam elements in a line, bending in one plane; DOFs `"1:y"`, `"1:theta"`, ... without those that are held."""

    length: Annotated[Positive, key("Length.", "m", example=0.3)]
    elements: Annotated[int, key("Number of elements.", ge=1, example=6)]
    element: Annotated[BeamElement, key("Theory of the elements.")] = "euler-bernoulli"
    axial: Annotated[bool, key("Whether nodes move along the beam, too (`x`).")] = False
    ends: Annotated[tuple[End, End], key("How the ends are held.", example=["clamped", "free"])] = ("free", "free")
    youngs_modulus: Annotated[Positive, key("Young's modulus.", "N/m^2", example=67e9)]
    density: Annotated[Positive, key("Density.", "kg/m^3", example=2700.0)]
    width: Annotated[Positive, key("Width of the section.", "m", example=0.025)]
    height: Annotated[Positive, key("Height of the section, in the plane of bending.", "m", example=0.006)]
    poisson: Annotated[
        float | None, key("Poisson's ratio, of `shear-flexible` elements.", absent="required by these")
    ] = None
    loss_factor: Annotated[NotNegative, key("Loss factor eta of the stiffness, K (1 + i eta).", example=0.01)] = 0.0

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        is_flexible = self.element == "shear-flexible"
        if is_flexible and self.poisson is None:
            raise self.missing(["poisson"], "shear-flexible elements have one")
        model = self.build(lambda: beam(
            self.length, self.elements, youngs_modulus=self.youngs_modulus, density=self.density, width=self.width,
            height=self.height, ends=self.ends, element=self.element, axial=self.axial,
            poisson=(self.poisson or 0.0) if is_flexible else 0.0, loss_factor=self.loss_factor,
        ))  # fmt: skip
        return ModelStructure(model, np.linspace(0, self.length, self.elements + 1))


class HoleKeys(Keys):
    """A bolt hole whose ring follows a reference point with six DOFs, `hole:x` to `hole:theta_z`."""

    position: Annotated[NotNegative, key("Distance from the first end.", "m")]
    radius: Annotated[NotNegative, key("Radius of the hole.", "m")]
    patch_radius: Annotated[NotNegative, key("Outer radius of the ring.", "m")]
    face: Annotated[Face, key("Side of the beam where the ring lies.")]


class BrickBeamKeys(SubstructureKeys, MaterialKeys, tag="brick-beam"):
    """A beam of brick elements along z; DOFs `"hole:x"`, and six of each section that is observed."""

    length: Annotated[Positive, key("Length along z.", "m")]
    width: Annotated[Positive, key("Width along x.", "m")]
    height: Annotated[Positive, key("Height along y.", "m")]
    ends: Annotated[tuple[End, End], key("How the ends are held.")] = ("free", "free")
    preset: Annotated[Preset, PRESET]
    origin: Annotated[
        tuple[float, float, float],
        key("Middle of the lower edge of the first end; the beam lies above it.", "m"),
    ] = (0.0, 0.0, 0.0)
    hole: Annotated[HoleKeys | None, key("A bolt hole.")] = None
    observed: Annotated[
        dict[str, NotNegative],
        key('Sections whose mean motion is observed: name, and distance from the first end; `r` gives `"r:x"` to '
            '`"r:theta_z"`.', "m"),
    ] = field(default_factory=dict)  # fmt: skip

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        one = self.hole
        hole = None if one is None else Hole(one.position, one.radius, one.patch_radius, one.face)
        material = self.material
        return ModelStructure(self.build(lambda: brick_beam(
            self.length, self.width, self.height, material, ends=self.ends, hole=hole, observed=self.observed,
            preset=self.preset, origin=self.origin,
        )))  # fmt: skip


class MatricesKeys(SubstructureKeys, tag="matrices"):
    """Matrices of your own: Matrix Market (`.mtx`), or NPZ of `scipy.sparse.save_npz` or `numpy.savez`.

    An NPZ file holds one array, or arrays named like the keys here. Files are relative to `case.toml`.
    """

    stiffness: Annotated[str, key("K, symmetric, real.", "N/m", takes="name of a file")]
    mass: Annotated[str, key("M, symmetric, real.", "kg", takes="name of a file")]
    damping: Annotated[str | None, key("Viscous damping C.", "N s/m", takes="name of a file")] = None
    structural_damping: Annotated[
        str | None, key("Structural damping H, i H added to K.", "N/m", takes="name of a file")
    ] = None
    loss_factor: Annotated[NotNegative, key("Loss factor eta of the stiffness, K (1 + i eta).")] = 0.0
    dofs: Annotated[
        tuple[str, ...] | str,
        key('Names of the DOFs in the order of the rows: `"12:y"`. In a file, one a line: `12:y`, or node and number '
            "of the DOF (1 to 6): `12 2`; `#` begins a comment.", takes="list of texts, or name of a text file",
            holds=lambda found: found != ()),
    ]  # fmt: skip

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        names = ("stiffness", "mass", "damping", "structural_damping")
        paths = {name: self.file_of(name) for name in names if getattr(self, name) is not None}
        named = self.file_of("dofs") if isinstance(self.dofs, str) else self.dofs
        found = {name: self.build(partial(read_matrix, path, name), name) for name, path in paths.items()}
        n = found["stiffness"].shape[0]
        for name, matrix in found.items():
            if matrix.shape != (n, n):
                raise self.wrong(name, f"{paths[name]} holds {matrix.shape[0]} DOFs, {paths['stiffness']} holds {n}")
        for name in ("stiffness", "mass"):
            if not is_symmetric(sparse.csc_array(found[name])):
                raise self.wrong(name, _unsymmetric(paths[name], found[name]))
        mass = found["mass"].diagonal()
        if (mass < 0).any() or not mass.any():
            why = "must have a diagonal that is not negative, and not zero as a whole"
            raise self.wrong("mass", f"{paths['mass']} {why}")
        dofs = self._dof_names(named, n)
        c, h = (found.get(name) for name in names[2:])
        return ModelStructure(Model(found["stiffness"], found["mass"], dofs, c, h, self.loss_factor))

    def _dof_names(self, named: tuple[str, ...] | Path, n: int) -> tuple[str, ...]:
        """Return the names of n DOFs, each once."""
        given = named if isinstance(named, tuple) else self.build(partial(read_dof_names, named), "dofs")
        where = "" if isinstance(named, tuple) else f"{named} "
        if len(given) != n:
            raise self.wrong("dofs", f"{where}names {len(given)} DOFs, the matrices hold {n}")
        if not all(name.strip() for name in given):
            raise self.wrong("dofs", f"{where}has an empty name")
        name, count = Counter(given).most_common(1)[0]
        if count > 1:
            raise self.wrong("dofs", f"{where}names {name!r} twice")
        return given


def _unsymmetric(path: Path, matrix: sparse.csr_array) -> str:
    """Say where a matrix is not symmetric."""
    difference = sparse.coo_array(matrix - matrix.T)
    worst = int(np.argmax(abs(difference.data)))
    i, j = int(difference.row[worst]), int(difference.col[worst])
    text = (
        f"{path} must hold a symmetric matrix: entry ({i + 1}, {j + 1}) is {matrix[i, j]:g}, "
        f"({j + 1}, {i + 1}) is {matrix[j, i]:g}"
    )
    is_triangle = sparse.triu(matrix, 1).count_nonzero() == 0 or sparse.tril(matrix, -1).count_nonzero() == 0
    return text + ("; it holds one triangle only" if is_triangle else "")


class ReceptancesKeys(SubstructureKeys, tag="receptances"):
    """FRFs of the substructure, measured or computed elsewhere, in any format that `jointfrf.io.read_frfs` reads.

    All FRFs between the DOFs of `[points]` on this side must be available on the lines of `[frequency]`. The report
    then has no natural frequencies and mode shapes.
    """

    file: Annotated[str, key("Mobilities and accelerances become receptances.", takes="name of a file of FRFs")]
    quantity: Annotated[
        str | None,
        key("What the FRFs are, where the file does not say.", choice=POWER_OF_I_OMEGA, absent="by the file"),
    ] = None
    force_quantity: Annotated[bool, key("`true`: `quantity` holds also where the file says something else.")] = False

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        if self.force_quantity and self.quantity is None:
            raise self.wrong("force_quantity", "there is no quantity to force")
        found = MeasuredStructure(read_frf_file(self, "file", self.quantity, force_quantity=self.force_quantity))
        self.build(lambda: found.lines_at(freq_hz), "file")
        return found


#: The kinds of substructures, which `model` distinguishes.
SUBSTRUCTURES = (ChainKeys, BeamKeys, BrickBeamKeys, MatricesKeys, ReceptancesKeys)


def read_model(table: TomlTable) -> ModelStructure:
    """Read a model from a table that is not part of a case.

    Raises
    ------
    FileContentError
        A key is missing or wrong; FRFs are named instead of a model.
    """
    models: tuple[Any, ...] = SUBSTRUCTURES
    if table.content.get("model") == "receptances":
        raise table.wrong("model", "a file of FRFs is named by itself, not by a TOML file")
    found = read_keys(table, *models).structure(np.ones(1))
    assert isinstance(found, ModelStructure)
    return found
