"""From `assembly.toml` to an assembly with its unknowns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, get_args

import msgspec
import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from jointfrf.dofs import is_rotation, similar_dof
from jointfrf.frf.frf_set import Channel
from jointfrf.identification.joint_file import read_joint
from jointfrf.identification.model.assembly import (
    AddedMass,
    Alike,
    Assembly,
    Attachment,
    GroundSpring,
    PlacedJoint,
    check_joint_order,
)
from jointfrf.identification.model.substructure import SCALES, Substructure, Unknown
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_frequency
from jointfrf.laws.joint_toml import read_joint_table, start_values
from jointfrf.laws.law_joint import LawJoint
from jointfrf.models.facts import model_facts
from jointfrf.models.model import Model
from jointfrf.models.points import PointModel, PointPatch
from jointfrf.spelling import did_you_mean
from jointfrf.toml.declared import Keys, read_keys
from jointfrf.toml.table import TomlTable, read_toml
from jointfrf.workbench.assembly_file.keys import (
    AlikeKeys,
    AssemblyKeys,
    ChannelDofs,
    MatricesPart,
    ModesPart,
    PartKeys,
    PartsKeys,
    PlacedJointKeys,
    Prior,
    PriorKeys,
    ReceptancesPart,
    Unknowns,
    without_sign,
)
from jointfrf.workbench.assembly_file.modes import ModalStructure, ModesKeys
from jointfrf.workbench.structures.substructures import SUBSTRUCTURES, MeasuredStructure, ModelStructure, Structure

if TYPE_CHECKING:
    from jointfrf.workbench.report.sketch import SketchedPart

__all__ = [
    "AssemblyFile",
    "AssemblyPart",
    "check_dofs",
    "named_dof",
    "read_assembly_file",
    "read_part",
    "read_structure",
    "unknown_of",
]

#: Relative standard deviation that a word stands for: coefficients of variation of structural steel (JCSS
#: Probabilistic Model Code, parts 2.1 and 3.2); damping is guessed; sections are rolled or milled to 1 %, lengths cut
#: to 1 mm in 0.3 m; a spring to the ground is known by its order of magnitude.
_USUAL = {
    "youngs_modulus": 0.03, "density": 0.01, "poisson": 0.03, "loss_factor": 0.5, "height": 0.01, "width": 0.01,
    "thickness": 0.01, "length": 0.003, "length_scale": 0.003, "stiffness": 0.5, "damping": 1.0,
}  # fmt: skip
#: What words mean.
_MEANT = {"E": "youngs_modulus", "rho": "density", "eta": "loss_factor", "thickness": "height", "nu": "poisson"}


class NamedDof(NamedTuple):
    """A DOF by the name of its node.

    Attributes
    ----------
    dof : str
        Name of the DOF.
    away : float or None
        Distance of the node from the given position, m.
    """

    dof: str
    away: float | None = None


def _changed(keys: Any, **values: Any) -> Any:
    """Return keys with other values, of the same table."""
    found = msgspec.structs.replace(keys, **values)
    found.__dict__["table_read"] = keys.table
    return found


@dataclass(frozen=True)
class AssemblyPart:
    """A substructure of a file.

    Attributes
    ----------
    keys : PartKeys
        Keys of the part.
    structure : Structure
        Model, modes or FRFs of the part.
    """

    keys: PartKeys
    structure: Structure

    @classmethod
    def of_keys(cls, keys: PartKeys, freq_hz: FloatArray) -> AssemblyPart:
        """Return a part from its keys, with joint DOFs by nodes; FRFs must be available on these lines, Hz."""
        part = cls(keys, keys.structure(freq_hz))
        joint = tuple(keys.build(lambda dof=dof: named_dof(part, dof).dof, "joint") for dof in keys.joint)  # type: ignore[misc]
        return part if joint == keys.joint else cls(_changed(keys, joint=joint), part.structure)

    def has(self, dof: str) -> bool:
        """Return whether the part has this DOF."""
        try:
            if isinstance(self.structure, ModelStructure):
                self.structure.model.ports(dof)
                return True
            if isinstance(self.structure, ModalStructure):
                return dof in self.structure.modes.dofs
            assert isinstance(self.structure, MeasuredStructure)
            channel = Channel.parse(dof)
            return self.structure.frfs.has(channel, channel)
        except ValueError:
            return False

    def has_region(self, dof: str) -> bool:
        """Return whether the DOF is the motion of a region, on which a joint acts per length or area."""
        model = self.structure.model if isinstance(self.structure, ModelStructure) else None
        return isinstance(model, PointModel) and bool(model.region_ports(dof))

    def similar(self, dof: str) -> str:
        """Return the end of a sentence that proposes a DOF of the part."""
        own = self.structure
        if isinstance(own, ModelStructure):
            return similar_dof(dof, own.model.dofs)
        return similar_dof(dof, own.modes.dofs) if isinstance(own, ModalStructure) else ""

    @property
    def places(self) -> dict[str, FloatArray]:
        """Known places of nodes and reference points, m."""
        return self.structure.places

    @property
    def joint_patch(self) -> PointPatch | None:
        """Patch of nodes whose reference point has all joint DOFs, or None."""
        nodes = {dof.rpartition(":")[0] for dof in self.keys.joint}
        patches = self.structure.patches if isinstance(self.structure, ModelStructure) else ()
        return next((one for one in patches if nodes == {one.name}), None)

    def sketched(self, letter: str, joints: Mapping[str, PlacedJoint]) -> SketchedPart:
        """Return the part for a sketch."""
        from jointfrf.workbench.report.sketch import SketchedPart  # reports take their time to import

        at: dict[str, list[str]] = {}
        for name, joint in joints.items():
            ends = (dof.rpartition(":")[0].partition("/") for dof in (*joint.j, *joint.k))
            if nodes := list(dict.fromkeys(node for part, _, node in ends if part == letter)):
                at[name] = nodes
        return SketchedPart(letter, self.places, at)

    def describe(self) -> list[str]:
        """Return properties that help to check the files of a part, line by line; empty for built models and FRFs."""
        if isinstance(self.structure, ModalStructure):
            return list(self.structure.about)
        if not isinstance(self.structure, ModelStructure) or not self.structure.about:
            return []
        facts = model_facts(self.structure.model)
        return [self.structure.about, *facts.lines(), *(f"warning: {text}" for text in facts.findings)]

    def receptance(self, freq_hz: ArrayLike, dofs: Sequence[str]) -> ComplexArray:
        """Return the nominal receptances between DOFs, shape (n_freq, m, m), m/N."""
        return self.structure.receptance(as_frequency(freq_hz), dofs)

    def substructure(self, freq_hz: FloatArray, dofs: Sequence[str]) -> Substructure:
        """Return the substructure with its unknowns; measured FRFs are restricted to its joint and these DOFs."""
        keys = self.keys
        if isinstance(keys, ReceptancesPart | ModesPart):
            named = list(dict.fromkeys([*keys.joint, *dofs]))
            h = keys.build(lambda: self.structure.receptance(freq_hz, named), "file")
            noise = keys.noise if isinstance(keys, ReceptancesPart) else 0.0
            return keys.build(lambda: Substructure.of_frfs(freq_hz, h, named, keys.joint, noise=noise))
        assert isinstance(self.structure, ModelStructure)
        unknowns = {name: self._unknown(name, prior) for name, prior in self._priors().items()}
        known = keys.joint, unknowns, keys.exact, keys.model_error
        if set(unknowns) <= set(SCALES):
            # Factors of the matrices are faster than models built again.
            means = {name: one.value for name, one in unknowns.items() if hasattr(keys, name)}
            model = self._model(means) if means != self._numbers(means) else self.structure.model
            return keys.build(lambda: Substructure(model, *known))
        if isinstance(keys, MatricesPart):
            model = self.structure.model
            return keys.build(lambda: Substructure(partial(scaled_model, model), *known))
        return keys.build(lambda: Substructure(lambda **values: self._model(values), *known))

    def _priors(self) -> Mapping[str, Prior]:
        """Return the priors by the names of the numbers of this part."""
        keys = self.keys
        assert not isinstance(keys, ReceptancesPart | ModesPart)
        takes = ["length_scale"] if isinstance(keys, MatricesPart) else []
        takes += _numbers_of(keys)
        meant = dict(_MEANT)
        if "length" in takes:
            meant["length_scale"] = "length"
        if "thickness" in takes:
            del meant["thickness"]
        elif "height" not in takes:
            if "thickness" in keys.unknown:
                text = "K and M contain no thickness; name E, to which bending is proportional"
                raise keys.wrong("unknown", text)
            del meant["thickness"]
        return _by_name(keys.unknown, list(dict.fromkeys([*takes, *SCALES])), meant, keys.table)

    def _numbers(self, names: Mapping[str, Any]) -> dict[str, float]:
        return {name: getattr(self.keys, name) for name in names}

    def _model(self, values: Mapping[str, float]) -> Model:
        """Return the model for other numbers of the table."""
        changed = _changed(self.keys, **values)
        structure = changed.structure(np.ones(1))
        assert isinstance(structure, ModelStructure)
        return structure.model

    def _unknown(self, name: str, prior: Prior) -> Unknown:
        keys, numbers = self.keys, _numbers_of(self.keys)
        table = keys.table if isinstance(keys.table.content.get("unknown"), list) else keys.table.table("unknown")
        if name not in numbers and isinstance(prior, PriorKeys) and prior.mean is not None:
            raise table.wrong(name, "a factor of the matrices has mean 1; leave out mean")
        return unknown_of(prior, numbers.get(name, 1.0), table, name, -np.inf if name == "poisson" else 0.0)


def _numbers_of(keys: PartKeys) -> dict[str, float]:
    """Return the numbers of the model by their keys."""
    values = {one.name: getattr(keys, one.name) for one in msgspec.structs.fields(keys) if one.name != "model_error"}
    return {name: value for name, value in values.items() if isinstance(value, float)}


def named_dof(part: AssemblyPart, dof: str) -> NamedDof:
    """Return a DOF by the name of its node: ``@0.3,0.006,0:y`` is the DOF of the nearest node which has it.

    Raises
    ------
    ValueError
        The position is invalid, places of nodes are unknown, or the nearest node is far away.
    """
    if not dof.startswith("@"):
        return NamedDof(dof)
    where, _, direction = dof[1:].rpartition(":")
    try:
        at = np.array([float(word) for word in where.strip("() ").split(",")])
    except ValueError:
        at = np.zeros(0)
    if at.shape != (3,) or not np.isfinite(at).all():
        raise ValueError(f"{dof} is no position with a direction; use the form @x,y,z:y, in m")
    held = None
    if isinstance(part.structure, ModelStructure):
        held = {*part.structure.model.dofs, *getattr(part.structure.model, "shown", ())}
    nodes = {
        node: place
        for node, place in part.places.items()
        if (f"{node}:{direction}" in held if held is not None else part.has(f"{node}:{direction}"))
    }
    if not nodes:
        raise ValueError(f"{dof}: no node with coordinates has a DOF {direction}; use another direction")
    places = np.array(list(nodes.values()))
    away = np.linalg.norm(places - at, axis=1)
    nearest, size = int(np.argmin(away)), float(np.linalg.norm(np.ptp(places, axis=0)))
    if away[nearest] > size / 2:
        raise ValueError(
            f"{dof}: the nearest node is {away[nearest]:.3g} m away, more than half the part; give the position in m"
        )
    return NamedDof(f"{list(nodes)[nearest]}:{direction}", float(away[nearest]))


def read_part(path: Path | str) -> AssemblyPart:
    r"""Return a single part from `part.toml`, whose keys are the keys of `[A]` in `assembly.toml`.

    Parameters
    ----------
    path : path-like
        Path of a TOML file with the keys of one part. Paths in it are relative to its folder.

    Returns
    -------
    AssemblyPart
        Part with DOFs (`has`), places of nodes and points (`places`), FRFs (`receptance`), and for fits `substructure`.

    Raises
    ------
    FileContentError
        A key is missing or wrong; the message names the file and all missing keys.

    See Also
    --------
    measured_assembly : an assembly from a file, with FRFs of a test.
    Substructure : a part of an assembly for fits.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> import jointfrf as jf
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "part.toml"
    ...     _ = path.write_text(
    ...         'model = "beam"\nlength = 0.3\nelements = 3\nyoungs_modulus = 70e9\ndensity = 2700.0\n'
    ...         'width = 0.02\nheight = 0.01\nloss_factor = 0.01\njoint = ["4:y", "4:theta"]\n')
    ...     part = jf.read_part(path)
    >>> part.places["4"].tolist(), part.receptance([50.0, 60.0], ["4:y", "1:y"]).shape
    ([0.3, 0.0, 0.0], (2, 2, 2))
    """
    keys = read_keys(read_toml(Path(path)), *get_args(PartKeys))
    return AssemblyPart.of_keys(keys, np.ones(1))


def read_structure(table: TomlTable) -> ModelStructure | ModalStructure:
    """Return a model, or modes, from a table with the keys of a substructure of a case or of a part of an assembly.

    Parameters
    ----------
    table : TomlTable
        Table of a substructure, or with ``joint`` of a part, whose joint and unknowns are not used.

    Raises
    ------
    FileContentError
        A key is missing or wrong; FRFs are named instead of a model.
    """
    if table.content.get("model") == "receptances":
        raise table.wrong("model", "a file of FRFs is named by itself, not by a TOML file")
    kinds: tuple[Any, ...] = get_args(PartKeys) if "joint" in table.content else (*SUBSTRUCTURES, ModesKeys)
    found = read_keys(table, *kinds).structure(np.ones(1))
    assert isinstance(found, ModelStructure | ModalStructure)
    return found


def _by_name(own: Unknowns, takes: Sequence[str], meant: Mapping[str, str], table: TomlTable) -> dict[str, Prior]:
    """Return priors by the name of the number; words give the usual priors."""
    found: dict[str, Prior] = {}
    for word in own:
        name = meant.get(word, word)
        if name not in takes:
            named = [*takes, *(short for short, long in meant.items() if long in takes)]
            text = f"unknown number {word}; use one of {', '.join(named)}{did_you_mean(word, named)}"
            raise table.wrong("unknown", text)
        if name in found:
            raise table.wrong("unknown", f"{word}: {name} is named twice; name it once")
        if isinstance(own, tuple) and name not in _USUAL:
            raise table.wrong("unknown", f"{word} has no default prior; write unknown = {{ {word} = 0.01 }}")
        found[name] = own[word] if isinstance(own, Mapping) else _USUAL[name]
    return found


def scaled_model(model: Model, *, length_scale: float, **factors: float) -> Model:
    """Return a model with all its lengths multiplied by a factor, and of other material.

    Parameters
    ----------
    model : Model
        Nominal model.
    length_scale : float
        Factor s of all lengths. Stiffnesses of a solid body, or of a beam with its section, are proportional to s and
        masses to s^3; rotations are displacements over a length.
    factors : float
        Factors ``youngs_modulus`` and ``density``, and the value ``loss_factor``.
    """
    turns = np.array([is_rotation(dof.rpartition(":")[2]) for dof in model.dofs])
    of_dof = sp.diags_array(np.where(turns, length_scale, 1.0))

    def scaled(matrix: Any, factor: float) -> Any:
        if matrix is None:
            return None
        found = of_dof @ sp.csr_array(matrix) @ of_dof * factor
        return found if sp.issparse(matrix) else found.toarray()

    if isinstance(model, PointModel):  # shown motions follow the DOFs; rotations are per length
        of_turn = {name: 1 / length_scale if is_rotation(name.rpartition(":")[2]) else 1.0 for name in model.shown}
        model = replace(
            model,
            shown={name: sp.csr_array(row @ of_dof * of_turn[name]) for name, row in model.shown.items()},
            places={name: length_scale * np.asarray(at) for name, at in model.places.items()},
        )
    of_k = length_scale * factors.get("youngs_modulus", 1.0)
    return replace(
        model,
        stiffness=scaled(model.stiffness, of_k),
        mass=scaled(model.mass, length_scale**3 * factors.get("density", 1.0)),
        damping=scaled(model.damping, length_scale),
        structural_damping=scaled(model.structural_damping, of_k),
        loss_factor=factors.get("loss_factor", model.loss_factor),
    )


def unknown_of(prior: Prior, value: float, table: TomlTable, name: str, lower: float = 0.0) -> Unknown:
    """Return an unknown with its prior, or raise FileContentError."""
    if not isinstance(prior, PriorKeys):
        if value == 0:
            raise table.wrong(name, "the value is 0 and has no relative standard deviation; give { mean, std }")
        return table.build(lambda: Unknown(value, prior * abs(value), lower), name)
    own = prior
    low, high = (lower if own.lower is None else own.lower), (np.inf if own.upper is None else own.upper)
    return table.build(lambda: Unknown(value if own.mean is None else own.mean, own.std, low, high), name)


@dataclass(frozen=True)
class AssemblyFile:
    """Content of `assembly.toml`.

    Attributes
    ----------
    keys : AssemblyKeys or PartsKeys
        Keys of the file.
    part_keys : dict of str to PartKeys
        Keys of A and B, or of parts by name.
    joint : LawJoint or None
        Joint of two parts.
    joints : dict of str to PlacedJoint
        Joints of several parts.
    path : Path
        Path of the file.
    """

    keys: AssemblyKeys | PartsKeys
    part_keys: dict[str, PartKeys]
    joint: LawJoint | None
    joints: dict[str, PlacedJoint]
    path: Path

    def parts(self, freq_hz: FloatArray) -> dict[str, AssemblyPart]:
        """Return the substructures by name; FRFs must be available on these lines, Hz."""
        return {name: AssemblyPart.of_keys(keys, freq_hz) for name, keys in self.part_keys.items()}

    def located(self, parts: Mapping[str, AssemblyPart]) -> tuple[AssemblyFile, tuple[str, ...]]:
        """Return the content with DOFs by nodes instead of positions, and a description of the node of each position.

        Raises
        ------
        FileContentError
            A position has no node.
        """
        said: dict[str, None] = {}

        def named(keys: Any, key: str, dof: str) -> str:
            name, _, own = dof.partition("/")
            if name not in parts or not own.startswith("@"):
                return dof
            found: NamedDof = keys.build(lambda: named_dof(parts[name], own), key)
            at, node = (one.rpartition(":")[0] for one in (dof, found.dof))
            said[f"{at} is {name}/{node}, {1e3 * (found.away or 0.0):.3g} mm away"] = None
            return f"{name}/{found.dof}"

        def placed(dofs: str | ChannelDofs) -> str | ChannelDofs:
            if isinstance(dofs, ChannelDofs):
                one, other = (None if dof is None else placed(dof) for dof in dofs.dofs)
                both: ChannelDofs = _changed(dofs, response=one, force=other)
                return both
            dof, sign = without_sign(dofs)
            found = named(own, "channels", dof)
            return found if sign > 0 else ":-".join(found.rsplit(":", 1))

        own = self.keys
        changed = _changed(
            own,
            channels={name: placed(dofs) for name, dofs in own.channels.items()},
            mass=tuple(_changed(one, dofs=tuple(named(one, "dofs", dof) for dof in one.dofs)) for one in own.mass),
            ground=tuple(_changed(one, dof=named(one, "dof", one.dof)) for one in own.ground),
            response_gains={named(own, "response_gains", dof): prior for dof, prior in own.response_gains.items()},
            force_gains={named(own, "force_gains", dof): prior for dof, prior in own.force_gains.items()},
        )
        node = {
            f"{name}/{old}": f"{name}/{new}"
            for name, part in parts.items()
            for old, new in zip(self.part_keys[name].joint, part.keys.joint, strict=True)
        }
        joints = {
            name: replace(one, j=tuple(node[dof] for dof in one.j), k=tuple(node[dof] for dof in one.k))
            for name, one in self.joints.items()
        }
        keys = {name: part.keys for name, part in parts.items()}
        return replace(self, keys=changed, part_keys=keys, joints=joints), tuple(said)

    def check_values(self) -> None:
        """Raise FileContentError if a law has no values, which a plan needs and a fit does not."""
        if isinstance(self.keys, PartsKeys):
            tables = [(name, _inside(self.keys.table, "joints", name)) for name in self.joints]
        else:
            tables = [] if isinstance(self.keys.joint, str) else [("joint", self.keys.table.table("joint"))]
        for name, table in tables:
            laws = table.content.get("law")
            for law in laws if isinstance(laws, list) else ():
                if _is_bare(law):
                    usual = ", ".join(f"{name} = ..." for name in start_values(law.get("law")))
                    text = f"the law of {law.get('dof')} has no expected values; add values = {{ {usual} }}"
                    raise self.keys.wrong(name, text)

    def attachments(self) -> tuple[Attachment, ...]:
        """Return masses and springs to the ground."""
        found: list[Attachment] = []
        for mass in self.keys.mass:
            known = mass.mass if mass.unknown is None else unknown_of(mass.unknown, mass.mass, mass.table, "unknown")
            found.append(mass.build(lambda own=mass, known=known: AddedMass(own.dofs, known)))  # type: ignore[misc]
        for spring in self.keys.ground:
            numbers: dict[str, float | Unknown] = {"stiffness": spring.stiffness, "damping": spring.damping}
            for name, prior in _by_name(spring.unknown, list(numbers), {}, spring.table).items():
                table = spring.table if isinstance(spring.unknown, tuple) else spring.table.table("unknown")
                numbers[name] = unknown_of(prior, getattr(spring, name), table, name)
            found.append(spring.build(lambda own=spring, n=numbers: GroundSpring(own.dof, **n)))  # type: ignore[misc]
        return tuple(found)

    def assembly(self, freq_hz: FloatArray, parts: Mapping[str, AssemblyPart], channels: Sequence[str]) -> Assembly:
        """Return the assembly for FRFs between some DOFs, or raise FileContentError."""
        attachments = self.attachments()
        used = [*channels, *(dof for one in attachments for dof in one.places)]
        keys, joint, sides = self.keys, self.joint, {}
        for name, part in parts.items():
            own = part.keys
            for dof in own.joint:
                if not (part.has(dof) or (joint is None and part.has_region(dof))):
                    raise own.wrong("joint", f"{name} has no DOF {dof!r}{part.similar(dof)}")
            if joint is not None and len(own.joint) == len(joint.dofs):  # otherwise the error states the number
                own.build(lambda own=own: check_joint_order("", own.joint, joint.dofs), "joint")  # type: ignore[misc]
            begin = f"{name}/"
            here = [dof.removeprefix(begin) for dof in used if dof.startswith(begin)]
            sides[name] = part.substructure(freq_hz, [dof for dof in here if part.has(dof)])
        if joint is not None:
            return keys.build(lambda: Assembly(sides["A"], sides["B"], joint, attachments))
        assert isinstance(keys, PartsKeys)
        return keys.build(
            lambda: Assembly.of_parts(sides, self.joints, attachments, same=_groups(keys), alike=_alike(keys))
        )


def _groups(keys: PartsKeys) -> list[tuple[str, ...]]:
    """Return groups of equal things; a list of names is one group."""
    names = [one for one in keys.same if isinstance(one, str)]
    groups = [one for one in keys.same if not isinstance(one, str)]
    if names and groups:
        raise keys.error("same", "a list of names, or of lists of names")
    return [tuple(names)] if names else groups


def _alike(keys: PartsKeys) -> dict[str, Alike]:
    found = {}
    for name in keys.alike:
        own = read_keys(_inside(keys.table, "alike", name), AlikeKeys)
        found[name] = own.build(lambda own=own: Alike(own.joints, own.spread))  # type: ignore[misc]
    return found


def _inside(table: TomlTable, key: str, name: str) -> TomlTable:
    """Return the table ``[key.name]``."""
    return TomlTable(table.content[key][name], f"{table.where}: [{key}.{name}]", table.folder)


def read_assembly_file(path: Path) -> AssemblyFile:
    """Return the content of `assembly.toml`.

    Raises
    ------
    FileContentError
        A key is missing or wrong; the message names the file, the table and all missing keys.
    """
    table = read_toml(path)
    if "parts" not in table.content and "joints" not in table.content:
        pair = read_keys(table, AssemblyKeys)
        is_file = isinstance(pair.joint, str)
        joint = _joint_of(pair, "joint") if is_file else _joint_of_table(pair.table.table("joint"))
        return AssemblyFile(pair, {"A": pair.A, "B": pair.B}, joint, {}, path)
    keys = read_keys(table, PartsKeys)
    joints = {name: _placed(read_keys(_inside(table, "joints", name), PlacedJointKeys)) for name in keys.joints}
    for name, one in joints.items():
        for dof in (*one.j, *one.k):
            if dof.partition("/")[0] not in keys.parts:
                begin = " or ".join(f"'{part}/'" for part in list(keys.parts)[:2])
                raise keys.wrong("joints", f"{name}: no part has a DOF {dof!r}; use a name that begins with {begin}")
    parts = {name: _part_of(_inside(table, "parts", name), name, joints) for name in keys.parts}
    return AssemblyFile(keys, parts, None, joints, path)


def _placed(keys: PlacedJointKeys) -> PlacedJoint:
    if (keys.law is None) == (keys.file is None):
        raise keys.missing(["law"], "law or file defines the joint")
    table = keys.table
    if keys.file is None:
        joint = _joint_of_table(TomlTable({"law": table.content["law"]}, table.where, table.folder))
    else:
        joint = _joint_of(keys, "file")
    return keys.build(lambda: PlacedJoint(joint, keys.j, keys.k, keys.weight))


def _part_of(table: TomlTable, name: str, joints: Mapping[str, PlacedJoint]) -> PartKeys:
    """Return the keys of one of several parts, with its DOFs at all joints."""
    if "joint" in table.content:
        raise table.wrong("joint", "the DOFs of the joints are under [joints]; leave out the key")
    dofs = [dof.removeprefix(f"{name}/") for one in joints.values() for dof in (*one.j, *one.k)
            if dof.startswith(f"{name}/")]  # fmt: skip
    if not dofs:
        raise table.wrong("joint", f"no joint names a DOF of {name}; connect the part by a joint, or leave it out")
    content = {**table.content, "joint": list(dict.fromkeys(dofs))}
    keys: PartKeys = read_keys(TomlTable(content, table.where, table.folder), *get_args(PartKeys))
    return keys


def _joint_of(keys: Keys, key: str) -> LawJoint:
    """Return the joint in the file that a key names."""
    named = keys.file_of(key)
    joint = keys.build(lambda: read_joint(named), key)
    return LawJoint.of_joint(joint) if isinstance(joint, Joint) else joint


def _joint_of_table(table: TomlTable) -> LawJoint:
    joint = read_joint_table(_with_values(table))
    return LawJoint.of_joint(joint) if isinstance(joint, Joint) else joint


def _with_values(table: TomlTable) -> TomlTable:
    """Return a table of a joint with values for every law, because a fit does not need them."""
    laws = table.content.get("law")
    if not isinstance(laws, list) or not all(isinstance(one, dict) for one in laws):
        return table
    filled = [{"values": start_values(one.get("law")), **one} if _is_bare(one) else one for one in laws]
    return TomlTable({**table.content, "law": filled}, table.where, table.folder)


def _is_bare(law: Mapping[str, Any]) -> bool:
    return "values" not in law and start_values(law.get("law")) != {}


def check_dofs(
    parts: Mapping[str, AssemblyPart], keys: AssemblyKeys | PartsKeys, name: str, dofs: Sequence[str]
) -> None:
    """Raise FileContentError for a DOF that no part has."""
    whose = "neither A nor B has" if list(parts) == ["A", "B"] else f"none of {', '.join(parts)} has"
    for dof in dofs:
        part, _, own = dof.partition("/")
        if part not in parts or not parts[part].has(own):
            begin = " or ".join(f"'{one}/'" for one in list(parts)[:2])
            raise keys.wrong(name, f"{whose} a DOF {dof!r}; use a name that begins with {begin}")
