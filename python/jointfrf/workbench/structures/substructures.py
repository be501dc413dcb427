"""The two structures that a joint connects: chains, beams, bricks, matrices and FRFs, as files declare them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import field
from scipy import sparse

from jointfrf.dofs import DIRECTIONS
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA
from jointfrf.io.units import ModelUnits, UnitSystemName, model_units
from jointfrf.kernel.arguments import FloatArray
from jointfrf.models.beam import BeamElement, End, beam
from jointfrf.models.matrices import is_symmetric
from jointfrf.models.model import Ground, chain, with_modal_damping
from jointfrf.models.plate import Edge, PlateRegion, plate
from jointfrf.models.points import Coupling, PointModel, PointPatch, couple_points
from jointfrf.models.regions import NodeRegion, add_regions
from jointfrf.toml.declared import Keys, NotNegative, Positive, key
from jointfrf.toml.table import TomlTable
from jointfrf.workbench.fe.matrix_format import StoredMatrix
from jointfrf.workbench.fe.matrix_formats import read_matrix
from jointfrf.workbench.fe.nodes import NodeFile, read_dof_names, read_nodes
from jointfrf.workbench.solids.brick_beam import Face, Hole, Preset, beam_divisions, brick_beam
from jointfrf.workbench.structures.keys import MAP, UNIT, MaterialKeys, read_frf_file
from jointfrf.workbench.structures.structure import MeasuredStructure, ModelStructure, Structure, SubstructureKeys

__all__ = [
    "BEAM_ELEMENT",
    "BRICK",
    "PRESET",
    "SUBSTRUCTURES",
    "MatricesKeys",
    "MeasuredStructure",
    "ModelStructure",
    "PointPatchKeys",
    "Structure",
    "SubstructureKeys",
]


class _NodesKeys(Keys):
    """Nodes, named by `nodes`, `set` or `box`."""

    name: Annotated[str, key("Name by which DOFs call it.", example="joint",
                             holds=lambda word: word != "" and ":" not in word)]  # fmt: skip
    nodes: Annotated[tuple[int, ...], key("Nodes of the patch.", takes="list of numbers of nodes")] = ()
    set: Annotated[str, key("A set of nodes in the file of `nodes` of the part (`*NSET`).", absent="none")] = ""
    box: Annotated[
        tuple[float, float, float, float, float, float] | None,
        key("All nodes in a box: smallest x, y, z, largest x, y, z.", "m"),
    ] = None

    def chosen(self, file: NodeFile, places: Mapping[str, FloatArray]) -> tuple[str, ...]:
        """Return the nodes of the patch; raises FileContentError."""
        ways = [name for name in ("nodes", "set", "box") if getattr(self, name)]
        if len(ways) != 1:
            raise self.missing(["nodes, set or box"], "exactly one of them names the patch")
        if self.nodes:
            return tuple(map(str, self.nodes))
        if self.set:
            if self.set.upper() not in file.sets:
                known = ", ".join(list(file.sets)[:12]) or "none"
                raise self.wrong("set", f"the file of nodes has no set {self.set!r}; it has {known}")
            return file.sets[self.set.upper()]
        assert self.box is not None
        low, high = np.array(self.box[:3]), np.array(self.box[3:])
        found = tuple(node for node, at in places.items() if (low <= at).all() and (at <= high).all())
        if not found:
            raise self.wrong("box", "no node lies in it")
        return found


class PointPatchKeys(_NodesKeys):
    """A reference point of a patch of nodes, named by `nodes`, `set` or `box`; six DOFs, `NAME:x` to `NAME:theta_z`."""

    coupling: Annotated[
        Coupling,
        key("`rigid`: the nodes follow the point (RBE2, `*RIGID BODY`); `distributing`: the point shows their mean "
            "motion and spreads forces over them (RBE3), which adds no stiffness."),
    ] = "distributing"  # fmt: skip
    at: Annotated[
        tuple[float, float, float] | None, key("Where the point is.", "m", absent="the mean place of the nodes")
    ] = None


_Degree = Annotated[
    int | tuple[int, int] | None,
    key("Polynomials that describe the motion: total degree, or the degrees along both directions of a face.",
        takes="whole number from 0, or list of two", absent="6 of a line, 4 of a face"),
]  # fmt: skip


class NodeRegionKeys(_NodesKeys):
    """Nodes on a straight line or in a plane, where a joint acts per length or area: its end is `NAME:z`."""

    degree: _Degree = None
    size: Annotated[
        Positive | None,
        key("Length or area.", "m, m^2", absent="between the nodes; of a face their convex hull, holes included"),
    ] = None


class PlateRegionKeys(Keys):
    """An edge, a line or a rectangle of a plate, where a joint acts per length or area: its end is `NAME:z`."""

    name: Annotated[str, key("Name by which DOFs call it.", example="clamp")]
    edge: Annotated[
        Literal["x-", "x+", "y-", "y+"] | None, key("The edge of smallest or largest x or y.", absent="`box`")
    ] = None
    box: Annotated[
        tuple[float, float, float, float] | None,
        key("Smallest x, y, largest x, y, in global coordinates; equal ones make a line.", "m", absent="`edge`"),
    ] = None
    degree: _Degree = None

    def region(self, low: FloatArray, high: FloatArray) -> PlateRegion:
        """Return the region of a plate between two corners; raises FileContentError."""
        if (self.edge is None) == (self.box is None):
            raise self.missing(["edge or box"], "exactly one of them names the region")
        corners = np.array([low, high])
        if self.box is not None:
            corners = np.reshape(self.box, (2, 2))
        elif self.edge is not None:
            corners[:, "xy".index(self.edge[0])] = (low, high)[self.edge[1] == "+"]["xy".index(self.edge[0])]
        first, second = (tuple(corner) for corner in corners.tolist())
        return PlateRegion(first, second, self.degree)


class MatricesKeys(SubstructureKeys, tag="matrices"):
    """Matrices of a finite-element model, or of your own: [formats](files.md#matrices-of-models).

    A matrix in a file of several is named by the key, or as `part.op4#KAA`. Files are relative to the file naming them.
    """

    stiffness: Annotated[str, key("K, symmetric, real.", "N/m", takes="name of a file")]
    mass: Annotated[str, key("M, symmetric, real.", "kg", takes="name of a file")]
    damping: Annotated[str | None, key("Viscous damping C.", "N s/m", takes="name of a file")] = None
    structural_damping: Annotated[
        str | None, key("Structural damping H, i H added to K.", "N/m", takes="name of a file")
    ] = None
    loss_factor: Annotated[NotNegative, key("Loss factor eta of the stiffness, K (1 + i eta).")] = 0.0
    dofs: Annotated[
        tuple[str, ...] | str | None,
        key('Names of the DOFs in the order of the rows: `"12:y"`. In a file, one a line: `12:y`, or node and number '
            "of the DOF (1 to 6): `12 2`; `#` begins a comment; or `.dof` of CalculiX, `.mapping` of Ansys, `EXTRN` "
            "cards of Nastran.", takes="list of texts, or name of a text file",
            absent="required by Matrix Market and NPZ; else as the files say, or a file beside that of K",
            holds=lambda found: found != ()),
    ] = None  # fmt: skip
    nodes: Annotated[
        str | None,
        key("Where the nodes are: a deck of Abaqus or CalculiX, bulk data of Nastran, a `.cdb` of Ansys, a Universal "
            "File, or lines of node, x, y, z.", takes="name of a file", absent="not known"),
    ] = None  # fmt: skip
    units: Annotated[
        UnitSystemName | None,
        key("Units of the files, nodes included; all other numbers here are in SI units.",
            absent="SI of Matrix Market and NPZ; required by files of FE programs, which do not say them"),
    ] = None  # fmt: skip
    point: Annotated[tuple[PointPatchKeys, ...], key("Reference points of patches of nodes.")] = ()
    region: Annotated[tuple[NodeRegionKeys, ...], key("Lines and faces on which joints act per length or area.")] = ()

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        names = ("stiffness", "mass", "damping", "structural_damping")
        paths = {name: self._path(name) for name in names if getattr(self, name) is not None}
        stored = {name: self.build(partial(read_matrix, path, name), name) for name, path in paths.items()}
        self._check_sizes(paths, stored)
        units = self._units(stored)
        file = NodeFile() if self.nodes is None else self.build(partial(read_nodes, self.file_of("nodes")), "nodes")
        dofs = self._dof_names(paths["stiffness"], stored)
        found = {name: self._aligned(name, paths[name], one, dofs) for name, one in stored.items()}
        for name in ("stiffness", "mass"):
            if not is_symmetric(sparse.csc_array(found[name])):
                raise self.wrong(name, _unsymmetric(paths[name], found[name]))
        mass = found["mass"].diagonal()
        if (mass < 0).any() or not mass.any():
            why = "must have a diagonal that is not negative, and not zero as a whole"
            raise self.wrong("mass", f"{paths['mass']} {why}")
        found, dofs, held = _without_empty(found, dofs)
        found = _in_si(found, dofs, units)
        model = PointModel(
            found["stiffness"], found["mass"], file.named(dofs), found.get("damping"),
            found.get("structural_damping"), self.loss_factor, places=_places(dofs, file, units),
        )  # fmt: skip
        nodes = dict(model.places)
        patches = [
            PointPatch(one.name, one.chosen(file, model.places), one.coupling, np.array(one.at) if one.at else None)
            for one in self.point
        ]
        if patches:
            model = self.build(lambda: couple_points(model, patches), "point")
        regions = [NodeRegion(one.name, one.chosen(file, nodes), one.degree, one.size) for one in self.region]
        if regions:
            model = self.build(lambda: add_regions(model, regions), "region")
        about = _about(paths, stored, units, held, len(file.turned))
        return ModelStructure(model, about=about, patches=tuple(patches))

    def _path(self, name: str) -> Path:
        """Return the path of a file of matrices, with the name of one in it where that is said."""
        file, mark, title = str(getattr(self, name)).rpartition("#")
        if mark and not (self.table.folder / f"{file}#{title}").exists():
            found = TomlTable({name: file}, self.table.where, self.table.folder).file(name)
            return found.with_name(f"{found.name}#{title}")
        return self.file_of(name)

    def _units(self, stored: Mapping[str, StoredMatrix]) -> ModelUnits:
        program = next((one.program for one in stored.values() if one.program), "")
        if self.units is None and program:
            raise self.missing(["units"], f"no file of {program} says its units, which are SI, mm-t-s or mm-kg-ms")
        return model_units(self.units or "SI")

    def _check_sizes(self, paths: Mapping[str, Path], stored: Mapping[str, StoredMatrix]) -> None:
        """Raise an error for a matrix of another size than K, where it does not name its DOFs."""
        n = stored["stiffness"].matrix.shape[0]
        for name, one in stored.items():
            if one.dofs is None and one.matrix.shape[0] != n:
                raise self.wrong(
                    name, f"{paths[name]} holds {one.matrix.shape[0]} DOFs, {paths['stiffness']} holds {n}"
                )

    def _dof_names(self, path: Path, stored: Mapping[str, StoredMatrix]) -> tuple[str, ...]:
        """Return the names of all DOFs, each once."""
        own = stored["stiffness"].dofs
        if own is not None:
            if self.dofs is not None:
                raise self.wrong("dofs", f"{path} names its DOFs itself: leave the key out")
            return tuple(dict.fromkeys([*own, *(dof for one in stored.values() for dof in one.dofs or ())]))
        beside = path.with_suffix(stored["stiffness"].dof_suffix or path.suffix)
        if self.dofs is None and (beside == path or not beside.exists()):
            also = "" if beside == path else f", and there is no {beside.name} beside it"
            raise self.missing(["dofs"], f"{path} does not name its DOFs{also}")
        named = self.dofs if isinstance(self.dofs, tuple) else self.file_of("dofs") if self.dofs is not None else beside
        given = named if isinstance(named, tuple) else self.build(partial(read_dof_names, named), "dofs")
        where, n = "" if isinstance(named, tuple) else f"{named} ", stored["stiffness"].matrix.shape[0]
        if len(given) != n:
            raise self.wrong("dofs", f"{where}names {len(given)} DOFs, the matrices hold {n}")
        if not all(name.strip() for name in given):
            raise self.wrong("dofs", f"{where}has an empty name")
        name, count = Counter(given).most_common(1)[0]
        if count > 1:
            raise self.wrong("dofs", f"{where}names {name!r} twice")
        return given

    def _aligned(self, name: str, path: Path, stored: StoredMatrix, dofs: tuple[str, ...]) -> sparse.csr_array:
        """Return a matrix in the order of the DOFs."""
        n = len(dofs)
        if stored.dofs is None or stored.dofs == dofs:
            return stored.matrix
        number = {dof: i for i, dof in enumerate(dofs)}
        at = np.array([number.get(dof, -1) for dof in stored.dofs], np.intp)
        if (at < 0).any():
            raise self.wrong(name, f"{path} holds {stored.dofs[int(np.argmin(at))]}, which the stiffness does not name")
        entries = sparse.coo_array(stored.matrix)
        return sparse.csr_array(sparse.coo_array((entries.data, (at[entries.row], at[entries.col])), shape=(n, n)))


def _without_empty(
    found: Mapping[str, sparse.csr_array], dofs: tuple[str, ...]
) -> tuple[dict[str, sparse.csr_array], tuple[str, ...], int]:
    """Leave out DOFs without any entry, which some programs keep of what is held; return how many."""
    filled = np.zeros(len(dofs), bool)
    for matrix in found.values():
        filled |= abs(matrix).sum(axis=1) > 0
    if filled.all():
        return dict(found), dofs, 0
    kept = np.flatnonzero(filled)
    return {name: one[kept][:, kept] for name, one in found.items()}, tuple(dofs[i] for i in kept), int((~filled).sum())


def _in_si(
    found: Mapping[str, sparse.csr_array], dofs: Sequence[str], units: ModelUnits
) -> dict[str, sparse.csr_array]:
    """Return the matrices in SI units: rotations, and modal coordinates like them, by the unit of length."""
    if units.name == "SI":
        return dict(found)
    scale = np.array([1.0 if dof.rpartition(":")[2] in DIRECTIONS[:3] else units.length for dof in dofs])
    by_dof = sparse.diags_array(scale)
    power = {"stiffness": 2, "structural_damping": 2, "damping": 1, "mass": 0}
    return {name: sparse.csr_array(units.scale(power[name]) * (by_dof @ one @ by_dof)) for name, one in found.items()}


def _places(dofs: Sequence[str], file: NodeFile, units: ModelUnits) -> dict[str, FloatArray]:
    """Return where the nodes of the DOFs are, m."""
    length = 1.0 if file.is_si else units.length
    nodes = dict.fromkeys(dof.rpartition(":")[0] for dof in dofs)
    return {node: length * file.coordinates[node] for node in nodes if node in file.coordinates}


def _about(
    paths: Mapping[str, Path], stored: Mapping[str, StoredMatrix], units: ModelUnits, held: int, turned: int
) -> str:
    """Say which files a model is of, and what was done with them."""
    names = ", ".join(dict.fromkeys(path.name for path in paths.values()))
    program = next((one.program for one in stored.values() if one.program), "")
    text = f"{names} ({program + ', ' if program else ''}{units.name})"
    halves = sorted({one.completed for one in stored.values() if one.completed})
    if halves:
        text += f"; {' and '.join(halves)} is stored, the rest was completed by symmetry"
    text += f"; {held} DOFs without any entry are held and left out" if held else ""
    return text + (f"; {turned} nodes have directions of their own, named local_x" if turned else "")


def _unsymmetric(path: Path, matrix: sparse.csr_array) -> str:
    """Say where a matrix is not symmetric."""
    difference = sparse.coo_array(matrix - matrix.T)
    worst = int(np.argmax(abs(difference.data)))
    i, j = int(difference.row[worst]), int(difference.col[worst])
    text = (
        f"{path} must contain a symmetric matrix: entry ({i + 1}, {j + 1}) is {matrix[i, j]:g}, "
        f"({j + 1}, {i + 1}) is {matrix[j, i]:g}"
    )
    is_triangle = sparse.triu(matrix, 1).count_nonzero() == 0 or sparse.tril(matrix, -1).count_nonzero() == 0
    return text + ("; it contains one triangle only" if is_triangle else "")


#: Bytes of memory of an element of a beam, of a brick and of an element of a plate, names and assembly included.
BEAM_ELEMENT, BRICK, PLATE_ELEMENT = 2_000, 25_000, 200_000
#: A key of all models of bricks.
PRESET = key("Elements: `seed` as in the thesis (C3D8R), `accurate` with incompatible modes (C3D8I).", example="seed")


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
    """Beam elements in a line, bending in one plane; DOFs `"1:y"`, `"1:theta"`, ... without fixed DOFs."""

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
        self.table.check_stated("elements", BEAM_ELEMENT * self.elements)
        model = self.build(lambda: beam(
            self.length, self.elements, youngs_modulus=self.youngs_modulus, density=self.density, width=self.width,
            height=self.height, ends=self.ends, element=self.element, axial=self.axial,
            poisson=(self.poisson or 0.0) if is_flexible else 0.0, loss_factor=self.loss_factor,
        ))  # fmt: skip
        return ModelStructure(model, np.linspace(0, self.length, self.elements + 1))


class PlateKeys(SubstructureKeys, tag="plate"):
    """A rectangular plate in the plane of x and y, bending in z with shear; DOFs `"1:z"`, `"1:theta_x"`, `"1:theta_y"`.

    Nodes count along x, then y; elements of the fourth degree have 5 x 5 of them.
    """

    length: Annotated[Positive, key("Length along x.", "m", example=0.3)]
    width: Annotated[Positive, key("Width along y.", "m", example=0.2)]
    thickness: Annotated[Positive, key("Thickness.", "m", example=0.005)]
    youngs_modulus: Annotated[Positive, key("Young's modulus.", "N/m^2", example=70e9)]
    density: Annotated[Positive, key("Density.", "kg/m^3", example=2700.0)]
    poisson: Annotated[float, key("Poisson's ratio.", example=0.3)]
    elements: Annotated[
        tuple[int | tuple[float, ...], int | tuple[float, ...]],
        key("Equal elements along x and y, or the lines between them from 0 to the length or the width, m.",
            takes="list of 2 whole numbers, or lists of numbers", example=[4, 3]),
    ] = (4, 4)  # fmt: skip
    edges: Annotated[
        tuple[Edge, Edge, Edge, Edge],
        key("How the edges are held: smallest and largest x, smallest and largest y. `supported`: no deflection, no "
            "rotation along the edge."),
    ] = ("free", "free", "free", "free")  # fmt: skip
    origin: Annotated[tuple[float, float, float], key("Corner of the smallest x and y.", "m")] = (0.0, 0.0, 0.0)
    points: Annotated[
        dict[str, tuple[float, float]],
        key('Places x, y between nodes, by names: `{ p1 = [0.1, 0.05] }` gives `"p1:z"`.', "m",
            takes="table of lists of 2 numbers"),
    ] = field(default_factory=dict)  # fmt: skip
    region: Annotated[tuple[PlateRegionKeys, ...], key("Lines and faces on which joints act per length or area.")] = ()
    loss_factor: Annotated[
        NotNegative, key("Loss factor eta of the stiffness, K (1 + i eta): twice the damping ratio of each mode.")
    ] = 0.0
    modal_damping: Annotated[
        tuple[NotNegative, ...],
        key("Viscous damping ratios of its elastic modes alone, the lowest first, beside the loss factor.",
            takes="list of numbers, at least 0"),
    ] = ()  # fmt: skip

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        count = [one if isinstance(one, int) else len(one) for one in self.elements]
        self.table.check_stated("elements", PLATE_ELEMENT * count[0] * count[1])
        low = np.array(self.origin[:2])
        high = low + np.array([self.length, self.width])
        regions = {one.name: one.region(low, high) for one in self.region}
        if len(regions) < len(self.region):
            raise self.wrong("region", "two regions have one name; name each once")
        model = self.build(lambda: plate(
            self.length, self.width, self.thickness, youngs_modulus=self.youngs_modulus, density=self.density,
            poisson=self.poisson, elements=self.elements, edges=self.edges, origin=self.origin, points=self.points,
            regions=regions, loss_factor=self.loss_factor,
        ))  # fmt: skip
        if self.modal_damping:
            model = self.build(lambda: with_modal_damping(model, self.modal_damping), "modal_damping")
        return ModelStructure(model)


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
    divisions: Annotated[
        tuple[int, int, int] | None,
        key("Bricks along x, y and z; along z as many as there were without a hole.",
            takes="list of 3 whole numbers, at least 1", absent="of about half the height"),
    ] = None  # fmt: skip
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
        default = self.build(lambda: beam_divisions(self.length, self.height, holed=self.hole is not None))
        nx, ny, nz = self.divisions or default
        self.table.check_stated("divisions" if self.divisions else "length", BRICK * nx * ny * nz)
        one = self.hole
        hole = None if one is None else Hole(one.position, one.radius, one.patch_radius, one.face)
        material = self.material
        return ModelStructure(self.build(lambda: brick_beam(
            self.length, self.width, self.height, material, ends=self.ends, hole=hole, observed=self.observed,
            preset=self.preset, divisions=self.divisions, origin=self.origin,
        )))  # fmt: skip


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
    force_quantity: Annotated[
        bool, key("`true`: take `quantity` and `unit` also if the file states something else.")
    ] = False
    map: Annotated[dict[str, str], MAP] = field(default_factory=dict)
    unit: Annotated[str, UNIT] = ""

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        if self.force_quantity and self.quantity is None and not self.unit:
            raise self.wrong("force_quantity", "there is no quantity or unit to force")
        found = MeasuredStructure(read_frf_file(
            self, "file", self.quantity, force_quantity=self.force_quantity, mapping=self.map, unit=self.unit
        ))  # fmt: skip
        self.build(lambda: found.lines_at(freq_hz), "file")
        return found


#: The kinds of substructures, which `model` distinguishes.
SUBSTRUCTURES = (ChainKeys, BeamKeys, PlateKeys, BrickBeamKeys, MatricesKeys, ReceptancesKeys)
