"""A part known by its modes: its keys, and its FRFs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated

import msgspec
import numpy as np

from jointfrf.dofs import direction_names, similar_dof
from jointfrf.io.units import UnitSystemName, model_units
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.models.modal import ModalFrfs
from jointfrf.toml.declared import key
from jointfrf.workbench.fe.modes import ModesFile, read_modes
from jointfrf.workbench.fe.nodes import NodeFile, read_dof_names, read_nodes
from jointfrf.workbench.structures.keys import MAP, UNIT, read_frf_file
from jointfrf.workbench.structures.structure import Structure, SubstructureKeys

__all__ = ["ModalStructure", "ModesKeys"]


@dataclass(frozen=True)
class ModalStructure(Structure):
    """A substructure known by its modes, taken as exact.

    Attributes
    ----------
    modes : ModalFrfs
        FRFs between all DOFs by modes.
    about : tuple of str
        Description of the file.
    nodes : dict of str to ndarray, shape (3,)
        Places of nodes, m.
    """

    modes: ModalFrfs
    about: tuple[str, ...] = ()
    nodes: dict[str, FloatArray] = field(default_factory=dict)

    @property
    def places(self) -> dict[str, FloatArray]:
        """Places of nodes, m."""
        return dict(self.nodes)

    def check_points(self, joint: Sequence[str], internal: Sequence[str]) -> None:
        """Raise an error if a DOF is missing."""
        self.index([*joint, *internal])

    def index(self, dofs: Sequence[str]) -> list[int]:
        """Return indices of DOFs, or raise ValueError."""
        number = {dof: i for i, dof in enumerate(self.modes.dofs)}
        missing = [dof for dof in dofs if dof not in number]
        if missing:
            raise ValueError(f"unknown DOF {missing[0]!r}; use a DOF of the modes{similar_dof(missing[0], number)}")
        return [number[dof] for dof in dofs]

    def receptance(self, freq_hz: FloatArray, points: Sequence[str]) -> ComplexArray:
        """Return the receptances of the modes and residuals."""
        return self.modes.receptance(freq_hz, self.index(points))


class ModesKeys(SubstructureKeys, tag="modes"):
    """Modes of the part, measured or computed: datasets 55 and 2414 of Universal Files, or arrays in NPZ files.

    They are taken as exact. Give all modes near the band, and `residuals` for modes beyond it: FRFs at a joint depend
    on them.
    """

    file: Annotated[
        str,
        key("Datasets 55, 2414: normal modes with modal masses, or complex modes with modal A. NPZ: `poles` (rad/s), "
            "or `nat_freq` and `nat_xi`; `A` (residues, DOFs x modes) and `driving_point`, as sdypy-EMA has them, or "
            "`Phi` and `modal_mass`; `LR`, `UR`; `dofs`.", takes="name of a file"),
    ]  # fmt: skip
    dofs: Annotated[
        tuple[str, ...] | str | None,
        key('Names of the rows of NPZ arrays: `"12:y"`; or a file with one a line.', takes="list of texts, or name of "
            "a text file", absent="as the file says", holds=lambda found: found != ()),
    ] = None  # fmt: skip
    nodes: Annotated[
        str | None,
        key(
            "Where the nodes are, as for matrices.",
            takes="name of a file",
            absent="not known, or in the Universal File",
        ),
    ] = None
    units: Annotated[
        UnitSystemName | None,
        key("Units of the file of `nodes`, and of modes and nodes of a Universal File without dataset 164.",
            absent="by dataset 164"),
    ] = None  # fmt: skip
    residuals: Annotated[
        str | None,
        key("FRFs of the part by themselves, from which residuals of modes below and above the band are fitted, pair "
            "by pair.", takes="name of a file of FRFs", absent="those of the file, or none"),
    ] = None  # fmt: skip
    map: Annotated[dict[str, str], MAP] = msgspec.field(default_factory=dict)
    unit: Annotated[str, UNIT] = ""
    damping_ratio: Annotated[
        float, key("Damping ratio of modes for which the file has none, as those of FE programs.", ge=0, le=0.99)
    ] = 0.0

    def structure(self, freq_hz: FloatArray) -> Structure:
        """Return the structure."""
        path = self.file_of("file")
        units = None if self.units is None else model_units(self.units)
        found = self.build(partial(read_modes, path, units=units), "file")
        dofs = self._names(found)
        if found.is_rigid.any() and found.modal_mass is None:
            raise self.wrong("file", "complex modes at 0 Hz have no scale; leave them out and add residuals")
        file = self._node_file(found)
        if self.nodes is not None and not found.has_nodes:  # shapes in the file of the modes are already in its axes
            dofs = file.named(dofs)
        length = 1.0 if file.is_si or self.units is None else model_units(self.units).length
        places = {node: length * at for node, at in file.coordinates.items()}
        modes = _modal_frfs(found, dofs, self.damping_ratio)
        whole = ModalStructure(modes, (), places)
        about = [_about(path.name, found, modes), *(f"warning: {note}" for note in found.notes)]
        if self.residuals is not None:
            modes, said = self._with_residuals(whole)
            about += said
        return replace(whole, modes=modes, about=tuple(about))

    def _names(self, found: ModesFile) -> tuple[str, ...]:
        given: tuple[str, ...] = found.dofs
        if self.dofs is not None:
            if found.dofs:
                raise self.wrong("dofs", "the file names its DOFs; leave out the key")
            own = self.dofs
            given = own if isinstance(own, tuple) else self.build(partial(read_dof_names, self.file_of("dofs")), "dofs")
        if not given:
            raise self.missing(["dofs"], "the file does not name its DOFs; give their names")
        if len(given) != len(found.shapes):
            raise self.wrong("dofs", f"{len(given)} names; give {len(found.shapes)}, one for each DOF of the file")
        names = tuple(_named(dof) for dof in given)
        if len(set(names)) < len(names):
            raise self.wrong("dofs", "a DOF is named twice; name each DOF once")
        return names

    def _node_file(self, found: ModesFile) -> NodeFile:
        """Return the nodes of a separate file, without its turned directions, or of the file of the modes."""
        if self.nodes is None and not found.has_nodes:
            return NodeFile()
        name = "file" if self.nodes is None else "nodes"
        file = self.build(partial(read_nodes, self.file_of(name)), name)
        if self.units is None and not file.is_si and file.coordinates:
            raise self.missing(["units"], f"{self.file_of(name).name} states no unit")
        return file

    def _with_residuals(self, whole: ModalStructure) -> tuple[ModalFrfs, list[str]]:
        """Return the modes with residuals of measured FRFs, and a description of their range."""
        frfs = read_frf_file(self, "residuals", mapping=self.map, unit=self.unit)
        held = [[_named(f"{one.node}:{one.axis}") for one in own] for own in (frfs.responses, frfs.excitations)]
        names = [dof for dof in dict.fromkeys([*held[0], *held[1]]) if dof in whole.modes.dofs]
        h = np.full((frfs.freq_hz.size, len(names), len(names)), np.nan + 0j)
        for i, (row, response) in enumerate(zip(held[0], frfs.responses, strict=True)):
            for j, (column, force) in enumerate(zip(held[1], frfs.excitations, strict=True)):
                if row in names and column in names:
                    h[:, names.index(row), names.index(column)] = response.sign * force.sign * frfs.h[:, i, j]
        if not np.isfinite(h).all(axis=0).any():
            raise self.wrong("residuals", f"{frfs.source} has no FRF between DOFs of the modes; name another file")
        at, known = whole.index(names), np.isfinite(h).all(axis=0)
        modes = whole.modes.with_residuals(frfs.freq_hz, h, at)
        with np.errstate(divide="ignore", invalid="ignore"):
            left = [np.nanmedian((abs(h - one.receptance(frfs.freq_hz, at)) / abs(h))[:, known])
                    for one in (whole.modes, modes)]  # fmt: skip
        return modes, [
            f"residuals of {int(known.sum())} FRFs of {self.residuals}: without them the modes miss these by "
            f"{100 * left[0]:.2g} % (median), with them by {100 * left[1]:.2g} %"
        ]


def _named(dof: str) -> str:
    """Return a DOF with the standard name of its direction."""
    node, mark, direction = dof.rpartition(":")
    try:
        return f"{node}{mark}{direction_names([direction])[0]}" if mark else dof
    except ValueError:
        return dof


def _modal_frfs(found: ModesFile, dofs: tuple[str, ...], damping_ratio: float) -> ModalFrfs:
    """Return FRFs between all DOFs; modes at 0 Hz are rigid motions."""
    poles, rigid = found.poles(damping_ratio), found.is_rigid
    mass = np.ones(poles.size) if found.modal_mass is None else found.modal_mass
    scale = found.scale if found.scale is not None else 2j * poles.imag * mass
    shapes = found.shapes.astype(complex)
    n, free = len(dofs), shapes.real[:, rigid] / np.sqrt(mass[rigid])
    return ModalFrfs(
        dofs, poles[~rigid], shapes[:, ~rigid] / np.sqrt(scale[~rigid].astype(complex)), free,
        np.zeros((n, n)) if found.lower is None else found.lower,
        np.zeros((n, n)) if found.upper is None else found.upper,
    )  # fmt: skip


def _about(name: str, found: ModesFile, modes: ModalFrfs) -> str:
    freq = abs(modes.poles) / (2 * np.pi)
    zeta = -modes.poles.real / abs(modes.poles)
    text = f"{name}: {freq.size} modes of {len(modes.dofs)} DOFs"
    if freq.size:
        text += f", {freq.min():.4g} to {freq.max():.4g} Hz, damping ratios {zeta.min():.2g} to {zeta.max():.2g}"
    return text + (f"; {modes.rigid.shape[1]} rigid motions" if modes.rigid.shape[1] else "")
