"""Keys of `case.toml` that several kinds of cases take."""

from __future__ import annotations

from typing import get_args

from jointfrf.cases.fitting import METHODS
from jointfrf.frf.noise import NoiseKind, NoiseReference
from jointfrf.solids.brick_beam import Preset
from jointfrf.toml.keys import Key, KeyTable

__all__ = [
    "COMMON_KEYS",
    "DOF_BANDS",
    "EXPECTED_FREQUENCIES",
    "FIGURES",
    "JOINT",
    "MATERIAL_KEYS",
    "NOISE",
    "PRESET",
    "one_of",
]


def one_of(words: object) -> str:
    """Say which words a key takes: those of a Literal, or of a sequence."""
    choice = get_args(words) or words
    return "one of " + ", ".join(f"`{word}`" for word in choice)  # type: ignore[attr-defined]


_FREQUENCY = KeyTable(
    "[frequency]",
    "Frequency lines: evenly spaced, or those of a file of FRFs.",
    (
        Key("first", "number, above 0", "First line. With `from_file`: lines below are left out.", "Hz",
            "required without `from_file`"),
        Key("last", "number", "Last line. With `from_file`: lines above are left out.", "Hz",
            "required without `from_file`"),
        Key("step", "number, above 0", "Spacing of the lines; not with `from_file`.", "Hz",
            "required without `from_file`"),
        Key("from_file", "name of a file of FRFs", "Take the lines of the FRFs in this file.", "", "evenly spaced"),
    ),
)  # fmt: skip
_STUDY = KeyTable(
    "[study]",
    "How many noisy measurements are simulated.",
    (
        Key("realisations", "whole number, at least 1", "Realisations of each noise; `--realisations` replaces it."),
        Key("seed", "whole number", "The same seed gives the same noise on every machine."),
    ),
)
COMMON_KEYS = (
    Key("kind", one_of(("known-joint", "bolted-lap", "modelled-joint")), "Kind of the case.", "", "`known-joint`"),
    Key("title", "text", "Title of the report."),
    Key("section", "text", "Where the source treats the case."),
    Key("frequency", "table", "Frequency lines.", inner=_FREQUENCY),
    Key("study", "table", "Realisations of the noise.", inner=_STUDY),
)
JOINT = KeyTable(
    "[[joint]]",
    "One table for each joint DOF: its actual stiffness and damping, and the first estimate.",
    (
        Key("dof", "text", "Name of the DOF: `x`, `theta_z`, `Fy`, `Mtheta`, ..."),
        Key("motion", one_of(("translation", "rotation")), "What the name must say, too; it sets the units."),
        Key("stiffness", "number, at least 0", "Actual stiffness.", "N/m, N m/rad"),
        Key("damping", "number, at least 0", "Actual viscous damping.", "N s/m, N m s/rad"),
        Key("initial_stiffness", "number, at least 0", "First estimate of the stiffness.", "N/m, N m/rad"),
        Key("initial_damping", "number, at least 0", "First estimate of the damping.", "N s/m, N m s/rad"),
    ),
)
#: Bands of every parameter.
DOF_BANDS = (
    Key("name", "text", "Name of the set in tables and figures."),
    Key("k_DOF", "list of `[low, high]`", "Bands of the stiffness of a joint DOF: one such key for each.", "Hz"),
    Key("c_DOF", "list of `[low, high]`", "Bands of its damping.", "Hz"),
)
NOISE = KeyTable(
    "[[noise]]",
    "Noise of the simulated measurement, and the methods applied to it; one or several tables.",
    (
        Key("name", "text", "Name in tables and figures; each once."),
        Key("level", "number, at least 0", "0.05 for 5 %; above 0.5 `confirm_level` is needed."),
        Key("confirm_level", "true or false", "`true`: a level above 0.5 is meant.", "", "`false`"),
        Key("kind", one_of(NoiseKind), "Distribution, see `jointfrf.pollute`."),
        Key("relative_to", one_of(NoiseReference), "The level refers to the FRF itself, to the largest of its line, or "
            "to the largest of all lines."),
        Key("reciprocal", "true or false", "Whether entries (p, q) and (q, p) get the same noise."),
        Key("block", "whole number, at least 1", "Size of square blocks of FRFs that share one noise number; divides "
            "the number of joint DOFs."),
        Key("methods", f"list of {one_of(METHODS).removeprefix('one of ')}", "Methods that identify the joint; a "
            "bolted lap joint takes `ismm` and `compliance`."),
    ),
)  # fmt: skip
MATERIAL_KEYS = (
    Key("youngs_modulus", "number, above 0", "Young's modulus.", "N/m^2"),
    Key("poisson", "number", "Poisson's ratio."),
    Key("density", "number, above 0", "Density.", "kg/m^3"),
    Key("loss_factor", "number, at least 0", "Loss factor eta of the stiffness, K (1 + i eta)."),
)
PRESET = Key(
    "preset", one_of(Preset), "Elements: `seed` as in the thesis (C3D8R), `accurate` with incompatible modes (C3D8I)."
)
EXPECTED_FREQUENCIES = (
    Key("source", "text", "Where the numbers come from."),
    Key("values", "list of numbers", "Natural frequencies of the assembly, lowest first.", "Hz"),
    Key("within_percent", "number, at least 0", "How far the computed ones may lie from them.", "%"),
)
FIGURES = Key("figures", "table of texts", "Number in the source of each figure, by the name of its file.", "", "none")
