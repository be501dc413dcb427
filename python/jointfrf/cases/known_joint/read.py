"""A case of a known joint as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

from jointfrf.cases.definitions import (
    BandSet,
    Noise,
    Observed,
    actual_values,
    check_bands,
    read_bands,
    read_case_joint,
    read_noises,
)
from jointfrf.cases.kind import Case
from jointfrf.cases.known_joint.expected import Expected, Known, read_expected
from jointfrf.cases.known_joint.structure import ModelStructure, Structure
from jointfrf.cases.known_joint.substructures import read_substructure
from jointfrf.dofs import Parameter, joint_parameters
from jointfrf.errors import FileContentError
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.toml.table import TomlTable

__all__ = ["KnownJointCase", "read_known_joint"]


@dataclass(frozen=True, kw_only=True)
class KnownJointCase(Case):
    """A simulated identification.

    Attributes
    ----------
    a, b : Structure
    points : mapping of str to tuple of str
        Names of the joint DOFs, "j" in A and "k" in B, and of internal ones, "r" in A and "s" in B.
    joint, initial : Joint
        The actual joint and its first estimate.
    observed : tuple of Observed
        FRFs of the assembly that are looked at.
    band_sets : tuple of BandSet
        The first is that of the tables.
    noises : tuple of Noise
    expected : Expected
    """

    a: Structure
    b: Structure
    points: Mapping[str, tuple[str, ...]]
    joint: Joint
    initial: Joint
    observed: tuple[Observed, ...]
    band_sets: tuple[BandSet, ...]
    noises: tuple[Noise, ...]
    expected: Expected

    @property
    def models(self) -> tuple[ModelStructure, ModelStructure] | None:
        """Both substructures where both are known by their models, else None."""
        a, b = self.a, self.b
        return (a, b) if isinstance(a, ModelStructure) and isinstance(b, ModelStructure) else None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Stiffness of every DOF, then damping."""
        return joint_parameters(self.joint.dofs)

    @property
    def actual(self) -> FloatArray:
        """Values of the parameters of the actual joint."""
        return actual_values(self.joint)


def read_known_joint(common: Case, table: TomlTable, expected: TomlTable) -> KnownJointCase:
    """Read the keys of this kind, see `jointfrf.cases.kind.CaseKind`.

    Raises
    ------
    FileContentError
        One sentence that names the file and the key.
    """
    a, b = (read_substructure(table.table(f"substructure_{side}"), common.freq_hz) for side in "ab")
    joint, initial = read_case_joint(table.tables("joint"))
    points = _points(table.table("points"), a, b, len(joint.dofs))
    observed = _observed(table, joint.dofs, common.freq_hz)
    band_sets = tuple(read_bands(entry, joint.dofs, common.freq_hz) for entry in table.tables("bands"))
    table.check_different("bands", [band_set.name for band_set in band_sets])
    noises = read_noises(table, len(joint.dofs))
    known = Known(
        joint_parameters(joint.dofs),
        tuple(band_set.name for band_set in band_sets),
        {noise.name: noise.methods for noise in noises},
        {one.key: one.bands for one in observed},
        common.freq_hz,
    )
    case = KnownJointCase(
        **vars(common),
        a=a,
        b=b,
        points=points,
        joint=joint,
        initial=initial,
        observed=observed,
        band_sets=band_sets,
        noises=noises,
        expected=read_expected(expected, known),
    )
    for key in ("frequencies", "printed"):
        if case.models is None and key in expected:
            raise FileContentError(f"{expected.where}: {key} needs models, not receptances, of both substructures")
    return case


def _points(table: TomlTable, a: Structure, b: Structure, n: int) -> dict[str, tuple[str, ...]]:
    points = {point: table.texts(point) for point in "jrks"}
    table.close()
    for point, names in points.items():
        if len(names) != n:
            raise table.error(point, f"a list of {n} DOFs, as many as the joint has")
    for structure, joint, internal in ((a, "j", "r"), (b, "k", "s")):
        table.build(partial(structure.check_points, points[joint], points[internal]))
    return points


def _observed(table: TomlTable, dofs: tuple[str, ...], freq_hz: FloatArray) -> tuple[Observed, ...]:
    if "observed" not in table:
        return (Observed("r", "r", 0), Observed("s", "s", 0))
    found = []
    for entry in table.tables("observed"):
        point, dof = entry.text("point", ("r", "s")), entry.text("dof", dofs)
        bands = tuple(entry.bands("bands")) if "bands" in entry else ()
        entry.close()
        check_bands(entry, "bands", bands, freq_hz)
        found.append(Observed(f"{point}-{dof}", point, dofs.index(dof), bands))
    table.check_different("observed", [one.key for one in found], "name the same FRF")
    return tuple(found)
