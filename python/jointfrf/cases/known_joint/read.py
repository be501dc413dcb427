"""A case of a known joint as data."""

from __future__ import annotations

from dataclasses import dataclass

from scipy import sparse

from jointfrf.cases.definitions import (
    BandSet,
    Noise,
    Observed,
    actual_values,
    check_bands,
    read_bands,
    read_joint,
    read_noises,
)
from jointfrf.cases.kind import Case
from jointfrf.cases.known_joint.expected import Expected, Known, read_expected
from jointfrf.cases.known_joint.substructures import Substructure, read_substructure
from jointfrf.cases.toml_table import TomlTable
from jointfrf.dofs import Parameter, joint_parameters
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.models.model import Model

__all__ = ["KnownJointCase", "read_known_joint"]


@dataclass(frozen=True, kw_only=True)
class KnownJointCase(Case):
    """A simulated identification.

    Attributes
    ----------
    a, b : Substructure
    dofs_j, dofs_k : list of int
        Joint DOFs in A and B, counted from 0.
    ports_a, ports_b : list of int, or sparse array of weights
        Joint DOFs, then internal ones, in A (j, r) and B (k, s), as `jointfrf.receptance` takes them.
    joint, initial : Joint
        The actual joint and its first estimate.
    observed : tuple of Observed
        FRFs of the assembly that are looked at.
    band_sets : tuple of BandSet
        The first is that of the tables.
    noises : tuple of Noise
    expected : Expected
    """

    a: Substructure
    b: Substructure
    dofs_j: list[int]
    dofs_k: list[int]
    ports_a: list[int] | sparse.csr_array
    ports_b: list[int] | sparse.csr_array
    joint: Joint
    initial: Joint
    observed: tuple[Observed, ...]
    band_sets: tuple[BandSet, ...]
    noises: tuple[Noise, ...]
    expected: Expected

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
    a, b = (read_substructure(table.table(f"substructure_{side}")) for side in "ab")
    joint, initial = read_joint(table.tables("joint"))
    points = table.table("points")
    j, r, k, s = (_points(points, point, len(joint.dofs)) for point in "jrks")
    points.close()
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
    return KnownJointCase(
        **vars(common),
        a=a,
        b=b,
        dofs_j=_dofs(points, a.model, j),
        dofs_k=_dofs(points, b.model, k),
        ports_a=_ports(points, a.model, j + r),
        ports_b=_ports(points, b.model, k + s),
        joint=joint,
        initial=initial,
        observed=observed,
        band_sets=band_sets,
        noises=noises,
        expected=read_expected(expected, known),
    )


def _points(table: TomlTable, point: str, n: int) -> tuple[str, ...]:
    names = table.texts(point)
    if len(names) != n:
        raise table.error(point, f"a list of {n} DOFs, as many as the joint has")
    return names


def _ports(table: TomlTable, model: Model, names: tuple[str, ...]) -> list[int] | sparse.csr_array:
    """Return what `jointfrf.receptance` takes for these names."""
    return table.build(lambda: model.ports(*names))


def _dofs(table: TomlTable, model: Model, names: tuple[str, ...]) -> list[int]:
    """Return DOFs, counted from 0: a joint cannot act on a mean."""
    return table.build(lambda: [int(model.index(name)) for name in names])  # type: ignore[arg-type]


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
