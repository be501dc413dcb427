"""The case of a bolted lap joint as data: reading and checking its `case.toml`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast, get_args

from jointfrf.cases.bolted_lap.measurement import DOFS
from jointfrf.cases.known_joint.read import BandSet, Noise, built, read_bands, read_frequency, read_joint, read_noise
from jointfrf.cases.toml_table import Table, read_toml
from jointfrf.errors import FileContentError
from jointfrf.frf.bands import Band
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.solids.bolt import PROOF_STRENGTH, STRESS_AREA, Bolt, preload_force
from jointfrf.solids.brick import Material
from jointfrf.solids.brick_beam import Preset

__all__ = ["KIND", "BoltedCase", "ExpectedFrequencies", "read_bolted_case"]

KIND = "bolted-lap"
#: Band means, and the fit.
_METHODS = ("ismm", "compliance")


@dataclass(frozen=True)
class ExpectedFrequencies:
    """Known natural frequencies of the preloaded assembly, Hz, and how far ours may lie from them, percent."""

    source: str
    values: tuple[float, ...]
    within: float


@dataclass(frozen=True)
class BoltedCase:
    """A lap joint with a preloaded bolt of solid elements, and what is measured on it.

    Attributes
    ----------
    folder : Path
    title, section : str
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    lengths : tuple of float
        Of A, of B, and of the other B that the joint is transferred to, m.
    width, height, overlap, hole_radius : float
        m.
    material : Material
        Of the beams.
    bolt : Bolt
    preload : float
        N.
    friction : float
    preset : {"seed", "accurate"}
    spacing : tuple of float
        s_x and s_z of the measured points, m.
    joint, initial : Joint
        Known joint of the error analysis, and first estimate of the identification; in the order of (4.5).
    bands : BandSet
    noises : tuple of Noise
    realisations, seed : int
    expected : ExpectedFrequencies or None
    figures : dict
        Figure to its number in the source.
    """

    folder: Path
    title: str
    section: str
    freq_hz: FloatArray
    lengths: tuple[float, float, float]
    width: float
    height: float
    overlap: float
    hole_radius: float
    material: Material
    bolt: Bolt
    preload: float
    friction: float
    preset: Preset
    spacing: tuple[float, float]
    joint: Joint
    initial: Joint
    bands: BandSet
    noises: tuple[Noise, ...]
    realisations: int
    seed: int
    expected: ExpectedFrequencies | None
    figures: dict[str, str]

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.name

    def bands_of(self, dof: str) -> list[Band]:
        """Bands of the stiffness and damping of a DOF, Hz."""
        return self.bands.bands[f"k_{dof}"]


def read_bolted_case(folder: Path) -> BoltedCase:
    """Read `case.toml` of a folder, and `expected.toml` where there is one.

    Raises
    ------
    FileContentError
        One sentence that names the file and the key.
    """
    table = read_toml(folder / "case.toml")
    table.text("kind", (KIND,))
    title, section = table.text("title"), table.text("section")
    freq = read_frequency(table.table("frequency"))
    beams = table.table("beams")
    lengths = (*(beams.number(key, 0) for key in ("length_a", "length_b", "transfer_length_b")),)
    width, height, overlap, hole_radius = (beams.number(x, 0) for x in ("width", "height", "overlap", "hole_radius"))
    preset = cast(Preset, beams.text("preset", get_args(Preset)))
    material = _material(beams)
    beams.close()
    bolt, force = _bolt(table.table("bolt"))
    contact = table.table("contact")
    friction = contact.number("friction", 0)
    contact.close()
    spacing = _spacing(table.table("measurement"))
    joint, initial = _joint(table.tables("joint"))
    parameters = [f"{letter}_{dof}" for letter in "kc" for dof in joint.dofs]
    bands = read_bands(table.table("bands"), parameters, freq)
    noises = tuple(_noise(entry, len(joint.dofs)) for entry in table.tables("noise"))
    if len({noise.name for noise in noises}) < len(noises):
        raise FileContentError(f"{table.where}: two tables [[noise]] have the same name")
    study = table.table("study")
    realisations, seed = study.whole("realisations", 1), study.whole("seed")
    study.close()
    table.close()
    expected, figures = _expected(folder / "expected.toml")
    return BoltedCase(
        folder.resolve(), title, section, freq, cast(tuple[float, float, float], lengths), width, height, overlap,
        hole_radius, material, bolt, force, friction, preset, spacing, joint, initial, bands, noises, realisations,
        seed, expected, figures,
    )  # fmt: skip


def _spacing(table: Table) -> tuple[float, float]:
    found = (table.number("spacing_x", 0), table.number("spacing_z", 0))
    table.close()
    for key, value in zip(("spacing_x", "spacing_z"), found, strict=True):
        if value == 0:
            raise table.error(key, "positive, in m")
    return found


def _joint(tables: list[Table]) -> tuple[Joint, Joint]:
    """Read the joint and its first estimate: six DOFs in the order of (4.5)."""
    joint, initial, rotational = read_joint(tables)
    if len(tables) != len(DOFS):
        raise tables[0].error("dof", f"the first of six: {', '.join(DOFS)}")
    for table, dof, name, turns in zip(tables, DOFS, joint.dofs, rotational, strict=True):
        if name != dof:
            raise table.error("dof", f"{dof!r}, in the order {', '.join(DOFS)}")
        if turns != dof.startswith("theta"):
            raise table.error("motion", "'translation'" if turns else "'rotation'")
    return joint, initial


def _noise(table: Table, n: int) -> Noise:
    noise = read_noise(table, n)
    unknown = [method for method in noise.methods if method not in _METHODS]
    if unknown:
        raise table.error("methods", f"a list of {', '.join(_METHODS)}")
    return noise


def _material(table: Table) -> Material:
    numbers = ("youngs_modulus", "poisson", "density", "loss_factor")
    values = [table.number(key, -0.99 if key == "poisson" else 0) for key in numbers]
    return built(table, lambda: Material(*values))


def _bolt(table: Table) -> tuple[Bolt, float]:
    size = table.text("size", tuple(STRESS_AREA))
    strength = table.text("strength_class", tuple(PROOF_STRENGTH))
    share = table.number("preload_share", 0)
    shape = [
        table.number(f"{key}", 0) for key in ("shank_radius", "head_radius", "head_height", "nut_radius", "nut_height")
    ]
    material = _material(table)
    table.close()
    bolt = built(table, lambda: Bolt(shape[0], shape[1], shape[2], shape[3], shape[4], material))
    return bolt, built(table, lambda: preload_force(STRESS_AREA[size], PROOF_STRENGTH[strength], share))


def _expected(path: Path) -> tuple[ExpectedFrequencies | None, dict[str, str]]:
    if not path.is_file():
        return None, {}
    table = read_toml(path)
    found = None
    if "frequencies" in table:
        inner = table.table("frequencies")
        found = ExpectedFrequencies(
            inner.text("source"), tuple(inner.numbers("values")), inner.number("within_percent", 0)
        )
        inner.close()
    figures = {}
    if "figures" in table:
        inner = table.table("figures")
        figures = {key: inner.text(key) for key in inner.keys()}  # noqa: SIM118
    table.close()
    return found, figures
