"""What several kinds of cases say: frequency lines, a joint, bands, noise, observed FRFs."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast, get_args

import numpy as np

from jointfrf.cases.fitting import METHODS
from jointfrf.dofs import Parameter, is_rotation, joint_parameters
from jointfrf.errors import FileContentWarning
from jointfrf.frf.bands import Band, in_bands
from jointfrf.frf.frf_set import FrfSet
from jointfrf.frf.noise import NOISE_KINDS, NoiseKind, NoiseReference, pollute, realisations
from jointfrf.io.formats import read_frfs
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.solids.brick import Material
from jointfrf.toml.table import TomlTable

__all__ = [
    "BandSet",
    "Noise",
    "Observed",
    "actual_values",
    "check_bands",
    "constant_joint",
    "read_bands",
    "read_case_joint",
    "read_frequency",
    "read_frf_file",
    "read_material",
    "read_noises",
]

_MOTIONS = ("translation", "rotation")
_MOST_LINES = 1_000_000
#: A higher level of noise is more often 5 % written as 5 than meant.
_HIGH_LEVEL = 0.5


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
    """Sensitive bands of every parameter, (low, high) in Hz."""

    name: str
    bands: dict[Parameter, list[Band]]


@dataclass(frozen=True)
class Noise:
    """A level of noise, as `jointfrf.pollute` takes it, and the methods applied to the noisy FRFs."""

    name: str
    level: float
    kind: NoiseKind
    relative_to: NoiseReference
    reciprocal: bool
    block: int
    methods: tuple[str, ...]

    def pollute(self, h: ComplexArray, seed: int, realisation: int = 0) -> ComplexArray:
        """Add one realisation of the noise to FRFs, shape (n_freq, n, n)."""
        return pollute(
            h, self.level, self.kind, seed, relative_to=self.relative_to, reciprocal=self.reciprocal,
            block=self.block, realisation=realisation,
        )  # fmt: skip

    def realisations(self, h: ComplexArray, seed: int, first: int, count: int) -> ComplexArray:
        """Add several realisations of the noise to FRFs, shape (count, n_freq, n, n)."""
        return realisations(
            h, self.level, self.kind, seed, relative_to=self.relative_to, reciprocal=self.reciprocal,
            block=self.block, first=first, count=count,
        )  # fmt: skip

    def variance(self, h: ComplexArray) -> FloatArray:
        """Return E|e|^2 of FRFs, shape (n_freq, n, n)."""
        size: FloatArray = np.abs(h)
        if self.relative_to != "entry":
            own = (1, 2) if self.relative_to == "line" else (0, 1, 2)
            size = np.broadcast_to(size.max(axis=own, keepdims=True), h.shape)
        return np.asarray(NOISE_KINDS[self.kind].power * (self.level * size) ** 2)


def actual_values(joint: Joint) -> FloatArray:
    """Values of the parameters of a joint without cross terms, in the order of `jointfrf.dofs.joint_parameters`."""
    return np.concatenate([np.diagonal(joint.stiffness), np.diagonal(joint.damping)])


def constant_joint(theta: FloatArray, freq_hz: FloatArray) -> ComplexArray:
    """K*(w) = k + i w c of uncoupled joint DOFs, for any number of sets of constants.

    Parameters
    ----------
    theta : ndarray, shape (..., 2 n)
        Stiffness of all DOFs, then damping.
    freq_hz : ndarray, shape (n_freq,)
        Hz.

    Returns
    -------
    ndarray, shape (..., n_freq, n, n)
        N/m, rotational N m/rad.
    """
    n = theta.shape[-1] // 2
    diagonal: ComplexArray = theta[..., None, :n] + 2j * np.pi * freq_hz[:, None] * theta[..., None, n:]
    return diagonal[..., None] * np.eye(n)


def read_frequency(table: TomlTable) -> FloatArray:
    """Read the frequency lines, Hz: evenly spaced, or those of a file of FRFs."""
    if "from_file" in table:
        return _lines_of_file(table)
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


def _lines_of_file(table: TomlTable) -> FloatArray:
    """Return the lines of a file of FRFs between `first` and `last`, where they are given."""
    held = read_frf_file(table, "from_file").freq_hz
    low = table.number("first", 0) if "first" in table else 0.0
    high = table.number("last", 0) if "last" in table else np.inf
    table.close()
    lines = held[(held >= low) & (held <= high)]
    if not lines.size:
        raise table.wrong("from_file", f"no line of the file lies in {low:g} to {high:g} Hz")
    if lines[0] == 0:
        raise table.wrong("from_file", "the file has a line at 0 Hz, where Im K*/w is not defined: name the first line")
    return lines


def read_frf_file(table: TomlTable, key: str, quantity: str | None = None, *, force_quantity: bool = False) -> FrfSet:
    """Read the receptances of a file that a key names; a line at 0 Hz that they do not have is left out."""
    path = table.file(key)
    frfs = table.build(lambda: read_frfs(path, quantity=quantity, force_quantity=force_quantity), key)
    with warnings.catch_warnings():
        # No case has a line at 0 Hz.
        warnings.simplefilter("ignore", FileContentWarning)
        return frfs.receptance()


def read_material(table: TomlTable) -> Material:
    """Read the keys of a material among others of a table."""
    numbers = ("youngs_modulus", "poisson", "density", "loss_factor")
    values = [table.number(key, -0.99 if key == "poisson" else 0) for key in numbers]
    return table.build(lambda: Material(*values))


def read_case_joint(tables: list[TomlTable]) -> tuple[Joint, Joint]:
    """Read a joint and its first estimate, one table a DOF."""
    dofs = []
    values: dict[str, list[float]] = {
        key: [] for key in ("stiffness", "damping", "initial_stiffness", "initial_damping")
    }
    for table in tables:
        dofs.append(_read_dof(table))
        for key, column in values.items():
            column.append(table.number(key, 0))
        table.close()
    actual = tables[-1].build(lambda: Joint(values["stiffness"], values["damping"], dofs))
    return actual, Joint(values["initial_stiffness"], values["initial_damping"], dofs)


def _read_dof(table: TomlTable) -> str:
    """Read the name of a joint DOF; what it says of translation and rotation must agree with `motion`."""
    dof, motion = table.text("dof"), table.text("motion", _MOTIONS)
    named = _MOTIONS[is_rotation(dof)]
    if motion != named:
        raise table.error(
            "motion",
            f"{named!r}, which is what the name {dof!r} of the DOF says (name a rotation like theta, theta_x, rx or "
            "Mtheta_x, a translation like x, ux or Fx)",
        )
    return dof


def check_bands(table: TomlTable, key: str, bands: Sequence[Band], freq_hz: FloatArray) -> None:
    """Raise an error if a band holds no frequency line."""
    if bands:
        table.build(lambda: in_bands(freq_hz, bands), key)


def read_bands(table: TomlTable, dofs: Sequence[str], freq_hz: FloatArray) -> BandSet:
    """Read the bands of all parameters of a joint."""
    name = table.text("name")
    bands = {parameter: table.bands(parameter.name) for parameter in joint_parameters(dofs)}
    table.close()
    for parameter, own in bands.items():
        check_bands(table, parameter.name, own, freq_hz)
    return BandSet(name, bands)


def read_noises(table: TomlTable, n: int, methods: Sequence[str] = METHODS) -> tuple[Noise, ...]:
    """Read all tables [[noise]] of a case with n joint DOFs and the methods that its kind knows."""
    noises = tuple(_read_noise(entry, n, methods) for entry in table.tables("noise"))
    table.check_different("noise", [noise.name for noise in noises])
    return noises


def _read_noise(table: TomlTable, n: int, methods: Sequence[str]) -> Noise:
    noise = Noise(
        table.text("name"),
        table.number("level", 0),
        cast(NoiseKind, table.text("kind", get_args(NoiseKind))),
        cast(NoiseReference, table.text("relative_to", get_args(NoiseReference))),
        table.truth("reciprocal"),
        table.whole("block", 1),
        table.texts("methods", methods),
    )
    confirmed = "confirm_level" in table and table.truth("confirm_level")
    table.close()
    if noise.level > _HIGH_LEVEL and not confirmed:
        percent = f"{noise.level:g} is noise of {100 * noise.level:g} % (5 % is 0.05)"
        raise table.wrong("level", f"{percent}; if that is meant, say confirm_level = true")
    if n % noise.block:
        raise table.error("block", f"a divisor of {n}, the number of joint DOFs")
    return noise
