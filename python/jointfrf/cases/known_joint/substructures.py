"""The two structures that a joint connects, read from `case.toml`: chains, beams, bricks, matrices, receptances."""

from __future__ import annotations

from collections.abc import Callable
from typing import cast, get_args

import numpy as np

from jointfrf.cases.definitions import read_material
from jointfrf.cases.known_joint.from_files import read_matrices, read_receptances
from jointfrf.cases.known_joint.structure import ModelStructure, Structure
from jointfrf.kernel.arguments import FloatArray
from jointfrf.models.beam import BeamElement, End, beam
from jointfrf.models.model import Ground, chain
from jointfrf.solids.brick_beam import Face, Hole, Preset, brick_beam
from jointfrf.toml.table import TomlTable

__all__ = ["read_substructure"]


def read_substructure(table: TomlTable, freq_hz: FloatArray) -> Structure:
    """Read a substructure: `model` says which; receptances must be there on all lines, Hz."""
    readers: dict[str, Callable[[TomlTable], Structure]] = {
        "chain": _chain,
        "beam": _beam,
        "brick-beam": _brick_beam,
        "matrices": read_matrices,
        "receptances": lambda own: read_receptances(own, freq_hz),
    }
    return readers[table.text("model", tuple(readers))](table)


def _chain(table: TomlTable) -> Structure:
    loss_factor = table.number("loss_factor", 0)
    numbers = [table.numbers(key) for key in ("masses", "stiffness", "damping")]
    ground = cast(Ground, table.text("ground", get_args(Ground)))
    table.close()
    return table.build(lambda: ModelStructure(chain(*numbers, ground=ground, loss_factor=loss_factor)))


def _beam(table: TomlTable) -> Structure:
    loss_factor = table.number("loss_factor", 0)
    length, youngs_modulus, density, width, height = (
        table.number(key) for key in ("length", "youngs_modulus", "density", "width", "height")
    )
    elements = table.whole("elements", 1)
    ends = cast(tuple[End, End], table.texts("ends", get_args(End)))
    element = cast(BeamElement, table.text("element", get_args(BeamElement)))
    # Without shear there is no Poisson's ratio.
    poisson = table.number("poisson", -0.99) if element == "shear-flexible" else 0.0
    axial = table.truth("axial")
    table.close()

    def build() -> Structure:
        model = beam(
            length, elements, youngs_modulus=youngs_modulus, density=density, width=width, height=height,
            ends=ends, element=element, axial=axial, poisson=poisson, loss_factor=loss_factor,
        )  # fmt: skip
        return ModelStructure(model, np.linspace(0, length, elements + 1))

    return table.build(build)


def _brick_beam(table: TomlTable) -> Structure:
    material = read_material(table)
    length, width, height = (table.number(key) for key in ("length", "width", "height"))
    ends = cast(tuple[End, End], table.texts("ends", get_args(End)))
    preset = cast(Preset, table.text("preset", get_args(Preset)))
    origin = table.numbers("origin")
    if len(origin) != 3:
        raise table.error("origin", "x, y, z in m")
    hole = _hole(table.table("hole")) if "hole" in table else None
    observed = {}
    if "observed" in table:
        inner = table.table("observed")
        observed = {name: inner.number(name, 0) for name in inner.keys()}  # noqa: SIM118
    table.close()

    def build() -> Structure:
        model = brick_beam(
            length, width, height, material, ends=ends, hole=hole, observed=observed, preset=preset,
            origin=cast(tuple[float, float, float], tuple(origin)),
        )  # fmt: skip
        return ModelStructure(model)

    return table.build(build)


def _hole(table: TomlTable) -> Hole:
    position, radius, patch_radius = (table.number(key, 0) for key in ("position", "radius", "patch_radius"))
    hole = Hole(position, radius, patch_radius, cast(Face, table.text("face", get_args(Face))))
    table.close()
    return hole
