"""Keys of several kinds of cases: frequency lines, a joint, bands, noise, and observed FRFs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from msgspec import field

from jointfrf.dofs import Parameter, is_rotation, joint_parameters
from jointfrf.frf.bands import Band, in_bands
from jointfrf.frf.noise import NOISE_KINDS, NoiseKind, NoiseReference, pollute, realisations
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.substructuring.methods import STIFFNESS_METHODS
from jointfrf.toml.declared import Bands, Keys, NotNegative, key
from jointfrf.workbench.structures.keys import MAP, UNIT, read_frf_file

__all__ = [
    "FITTED",
    "LIKE_DOFS",
    "METHODS",
    "MOST_LINES",
    "BandKeys",
    "BandSet",
    "Case",
    "CaseKeys",
    "ExpectedFrequencies",
    "ExpectedKeys",
    "FrequencyKeys",
    "JointDofKeys",
    "Noise",
    "Observed",
    "StudyKeys",
    "WithActualJoint",
    "check_bands",
    "check_different",
    "check_noises",
    "constant_joint",
    "joints_of",
]

#: All methods of cases.
METHODS: tuple[str, ...] = ("compliance", *STIFFNESS_METHODS, "decoupling-fit")
#: Methods that fit all lines in place of means over bands.
FITTED = ("compliance", "decoupling-fit")
#: Largest number of lines; more lines are probably a wrong step.
MOST_LINES = 1_000_000
#: Values of lists of points.
LIKE_DOFS = "list of texts, as many as joint DOFs"
#: Noise levels above this limit need a confirmation, because 5 % is often written as 5.
_HIGH_LEVEL = 0.5


class FrequencyKeys(Keys):
    """Frequency lines: evenly spaced, or from a file of FRFs."""

    first: Annotated[
        NotNegative | None,
        key("First line. With `from_file`: lines below are left out.", "Hz", takes="number, above 0",
            absent="required without `from_file`", example=1.0),
    ] = None  # fmt: skip
    last: Annotated[
        NotNegative | None,
        key("Last line. With `from_file`: lines above are left out.", "Hz", absent="required without `from_file`",
            example=200.0),
    ] = None  # fmt: skip
    step: Annotated[
        NotNegative | None,
        key("Spacing of the lines; not with `from_file`.", "Hz", takes="number, above 0",
            absent="required without `from_file`", example=1.0),
    ] = None  # fmt: skip
    from_file: Annotated[
        str | None, key("Take the lines of the FRFs in this file.", takes="name of a file of FRFs", absent="not used")
    ] = None
    map: Annotated[dict[str, str], MAP] = field(default_factory=dict)
    unit: Annotated[str, UNIT] = ""

    def lines(self) -> FloatArray:
        """Return the frequency lines, Hz; raise FileContentError if they are invalid."""
        if self.from_file is not None:
            return self._lines_of_file()
        if lacking := [name for name in ("first", "last", "step") if getattr(self, name) is None]:
            raise self.missing(lacking)
        first, last, step = (float(one or 0) for one in (self.first, self.last, self.step))
        if step == 0:
            raise self.error("step", "positive, in Hz")
        if first == 0:
            raise self.error("first", "above 0 Hz, where Im K*/w is defined")
        if last < first:
            raise self.error("last", f"at least {first:g} Hz")
        if (last - first) / step > MOST_LINES:
            raise self.error("step", f"larger: there would be more than {MOST_LINES} lines")
        count = int((last - first) / step + 1 + 1e-9)
        return np.round(first + step * np.arange(count), 9)

    def _lines_of_file(self) -> FloatArray:
        if self.step is not None:
            raise self.wrong("step", "the lines are those of the file that from_file names")
        held = read_frf_file(self, "from_file", mapping=self.map, unit=self.unit).freq_hz
        low, high = self.first or 0.0, np.inf if self.last is None else self.last
        lines = held[(held >= low) & (held <= high)]
        if not lines.size:
            raise self.wrong("from_file", f"no line of the file lies in {low:g} to {high:g} Hz")
        if lines[0] == 0:
            raise self.wrong(
                "from_file", "the file has a line at 0 Hz, where Im K*/w is not defined: name the first line"
            )
        return lines


class StudyKeys(Keys):
    """How many noisy measurements are simulated; a design, which options of `jointfrf study` replace."""

    realisations: Annotated[
        int, key("Realisations of each noise; `--realisations` replaces it.", ge=1, le=2**31 - 1, example=100,
                 takes="whole number, at least 1")
    ]  # fmt: skip
    # Methods that take FRFs at other points add to the seed, which has 64 bits.
    seed: Annotated[
        int, key("The same seed gives the same noise on every machine.", ge=0, le=2**63 - 1, example=1,
                 takes="whole number, at least 0")
    ]  # fmt: skip
    factors: Annotated[
        dict[str, tuple[int | float | str | bool, ...]],
        key("Values of each factor of a design: `noise`, `spacing`, `lines`, `stiffness`, `damping` or a key.",
            takes="table of lists", absent="nothing is varied"),
    ] = field(default_factory=dict)  # fmt: skip
    arrangement: Annotated[
        Literal["full", "one-at-a-time"], key("Every combination of values, or one factor at a time.")
    ] = "full"
    noises: Annotated[tuple[str, ...], key("Names of the noises that a study takes.", absent="all")] = ()
    estimators: Annotated[tuple[str, ...], key("Methods that a study takes.", absent="those of each noise")] = ()


class CaseKeys(Keys, tag_field="kind"):
    """Keys of every case."""

    title: Annotated[str, key("Title of the report.", example="A case of my own")]
    section: Annotated[str, key("Where the source treats the case.", example="none")] = "none"
    frequency: Annotated[FrequencyKeys, key("Frequency lines.")]
    study: Annotated[StudyKeys, key("Realisations of the noise.")]


class ExpectedKeys(Keys):
    """Numbers of figures in a source; the file may be missing."""

    figures: Annotated[
        dict[str, str], key("Number in the source of each figure, by the name of its file.", absent="none")
    ] = field(default_factory=dict)


class ExpectedFrequencies(Keys):
    """Natural frequencies of the assembly."""

    source: Annotated[str, key("Where the numbers come from.")]
    values: Annotated[tuple[float, ...], key("Natural frequencies of the assembly, lowest first.", "Hz")]
    within_percent: Annotated[NotNegative, key("Largest difference of the computed frequencies.", "%")]


@dataclass(frozen=True, kw_only=True)
class Case:
    """Case with the content that all kinds share.

    Attributes
    ----------
    folder : Path
        Folder of the case.
    title, section : str
        Title of the case, and its section in the source.
    freq_hz : ndarray, shape (n_freq,)
        Frequency lines, Hz.
    realisations, seed : int
        Number of realisations of each noise, and their seed.
    figure_numbers : mapping of str to str
        Number in the source of each figure.
    """

    folder: Path
    title: str
    section: str
    freq_hz: FloatArray
    realisations: int
    seed: int
    figure_numbers: Mapping[str, str]

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.name


@dataclass(frozen=True)
class Observed:
    """Observed FRF of the assembly, with response and force at one DOF of an internal point.

    Attributes
    ----------
    key : str
        Name of the FRF: "r" or "s", with the direction if the case has directions, such as "s-Fx".
    point : str
        Internal point, "r" or "s".
    dof : int
        DOF of the point, in the order of the joint DOFs.
    bands : tuple of (low, high)
        Bands in which errors of regenerated FRFs are counted, Hz; all lines if empty.
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

    def means(self, freq_hz: FloatArray, k_joint: ComplexArray) -> FloatArray:
        """Return the means of Re K* (stiffness) and of Im K*/w (damping), each parameter over its own bands.

        Parameters
        ----------
        freq_hz : ndarray, shape (n_freq,)
            Frequency lines, Hz.
        k_joint : ndarray, shape (..., n_freq, n, n)
            Dynamic stiffness K*(w) of any number of realisations, N/m.

        Returns
        -------
        ndarray, shape (..., 2 n)
            Stiffness of all DOFs, then damping.
        """
        n = k_joint.shape[-1]
        found = []
        for p, bands in enumerate(self.bands.values()):
            inside = in_bands(freq_hz, bands)
            lines = k_joint[..., inside, p % n, p % n]
            found.append((lines.real if p < n else lines.imag / (2 * np.pi * freq_hz[inside])).mean(axis=-1))
        return np.stack(found, axis=-1)


class BandKeys(Keys):
    """Sensitive bands over which the estimates of K* are averaged."""

    name: Annotated[str, key("Name of the set in tables and figures.", example="all lines")]
    by_parameter: Annotated[
        dict[str, Bands],
        key("Bands of the stiffness and of the damping of a joint DOF: two such keys for each.", "Hz",
            pattern="k_DOF, c_DOF", absent="required for every DOF"),
    ] = field(default_factory=dict)  # fmt: skip

    def band_set(self, dofs: Sequence[str], freq_hz: FloatArray) -> BandSet:
        """Return the bands of all parameters of a joint; raise FileContentError if they are invalid."""
        names = [parameter.name for parameter in joint_parameters(dofs)]
        for name in self.by_parameter:
            if name not in names:
                raise self.table.unknown(name, ["name", *names])
        if lacking := [name for name in names if name not in self.by_parameter]:
            raise self.missing(lacking)
        for name, bands in self.by_parameter.items():
            check_bands(self, name, bands, freq_hz)
        return BandSet(self.name, {one: list(self.by_parameter[one.name]) for one in joint_parameters(dofs)})


class Noise(Keys):
    """Noise of the simulated measurement, and the methods applied to it; one or several tables."""

    name: Annotated[str, key("Name in tables and figures; each once.", example="1 %")]
    level: Annotated[NotNegative, key("0.05 for 5 %; above 0.5 `confirm_level` is needed.", example=0.01)]
    confirm_level: Annotated[bool, key("`true`: a level above 0.5 is meant.")] = False
    kind: Annotated[NoiseKind, key("Distribution, see `jointfrf.pollute`.")] = "complex"
    relative_to: Annotated[
        NoiseReference,
        key("The level refers to the FRF itself, to the largest of its line, or to the largest of all lines."),
    ] = "entry"
    reciprocal: Annotated[bool, key("Whether entries (p, q) and (q, p) get the same noise.")] = False
    block: Annotated[
        int, key("Size of square blocks of FRFs that share one noise number; divides the number of joint DOFs.", ge=1)
    ] = 1
    methods: Annotated[
        tuple[str, ...],
        key("Methods that identify the joint; a bolted lap joint takes `ismm` and `compliance`.", choice=METHODS,
            min_length=1, example=["compliance"]),
    ]  # fmt: skip

    def pollute(self, h: ComplexArray, seed: int, realisation: int = 0) -> ComplexArray:
        """Return FRFs with one realisation of the noise, shape (n_freq, n, n)."""
        return pollute(
            h, self.level, self.kind, seed, relative_to=self.relative_to, reciprocal=self.reciprocal,
            block=self.block, realisation=realisation,
        )  # fmt: skip

    def realisations(self, h: ComplexArray, seed: int, first: int, count: int) -> ComplexArray:
        """Return FRFs with several realisations of the noise, shape (count, n_freq, n, n)."""
        return realisations(
            h, self.level, self.kind, seed, relative_to=self.relative_to, reciprocal=self.reciprocal,
            block=self.block, first=first, count=count,
        )  # fmt: skip

    def variance(self, h: ComplexArray) -> FloatArray:
        """Return the variance E|e|^2 of the noise of FRFs, shape (n_freq, n, n)."""
        size: FloatArray = np.abs(h)
        if self.relative_to != "entry":
            own = (1, 2) if self.relative_to == "line" else (0, 1, 2)
            size = np.broadcast_to(size.max(axis=own, keepdims=True), h.shape)
        return np.asarray(NOISE_KINDS[self.kind].power * (self.level * size) ** 2)


class JointDofKeys(Keys):
    """One table for each joint DOF: its actual stiffness and damping, and the first estimate."""

    dof: Annotated[str, key("Name of the DOF: `x`, `theta_z`, `Fy`, `Mtheta`, ...", example="x")]
    motion: Annotated[
        Literal["translation", "rotation"] | None,
        key("What the name of the DOF says: it sets the units, and is checked.", absent="by the name"),
    ] = None
    stiffness: Annotated[NotNegative, key("Actual stiffness.", "N/m, N m/rad", example=2000.0)]
    damping: Annotated[NotNegative, key("Actual viscous damping.", "N s/m, N m s/rad", example=3.0)]
    initial_stiffness: Annotated[
        NotNegative | None,
        key("First estimate of the stiffness, of methods that begin with one.", "N/m, N m/rad",
            absent="required by `ismm`, `ismm-kj` and `decoupling-fit`, else as the actual"),
    ] = None  # fmt: skip
    initial_damping: Annotated[
        NotNegative | None,
        key("First estimate of the damping.", "N s/m, N m s/rad", absent="as `initial_stiffness`"),
    ] = None


class WithActualJoint:
    """Case with a known actual joint without cross terms."""

    joint: Joint

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of the joint: stiffness of every DOF, then damping."""
        return joint_parameters(self.joint.dofs)

    @property
    def actual(self) -> FloatArray:
        """Values of the parameters of the actual joint."""
        return np.concatenate([np.diagonal(self.joint.stiffness), np.diagonal(self.joint.damping)])


def constant_joint(theta: FloatArray, freq_hz: FloatArray) -> ComplexArray:
    """Return K*(w) = k + i w c of uncoupled joint DOFs, for any number of sets of constants.

    Parameters
    ----------
    theta : ndarray, shape (..., 2 n)
        Stiffness of all DOFs, then damping.
    freq_hz : ndarray, shape (n_freq,)
        Frequency lines, Hz.

    Returns
    -------
    ndarray, shape (..., n_freq, n, n)
        Dynamic stiffness, N/m, rotational N m/rad.
    """
    n = theta.shape[-1] // 2
    diagonal: ComplexArray = theta[..., None, :n] + 2j * np.pi * freq_hz[:, None] * theta[..., None, n:]
    return diagonal[..., None] * np.eye(n)


def joints_of(dofs: Sequence[JointDofKeys], needed_by: str = "") -> tuple[Joint, Joint]:
    """Return a joint and its first estimate; values without a first estimate are the actual values.

    Parameters
    ----------
    dofs : sequence of JointDofKeys
        Keys of all joint DOFs.
    needed_by : str
        Name of the method that needs the first estimate, default "" for none. It makes first estimates required.

    Returns
    -------
    actual, initial : Joint
    """
    for one in dofs:
        named = "rotation" if is_rotation(one.dof) else "translation"
        if one.motion not in (None, named):
            raise one.error("motion", f"{named!r}, as the name {one.dof!r} states")
        lacking = [name for name in ("initial_stiffness", "initial_damping") if getattr(one, name) is None]
        if needed_by and lacking:
            raise one.missing(lacking, f"{needed_by} begins with a first estimate")
    names = [one.dof for one in dofs]
    actual = dofs[-1].build(lambda: Joint([one.stiffness for one in dofs], [one.damping for one in dofs], names))
    stiffness, damping = (
        [getattr(one, what) if first is None else first for one in dofs for first in [getattr(one, f"initial_{what}")]]
        for what in ("stiffness", "damping")
    )
    return actual, Joint(stiffness, damping, names)


def check_bands(keys: Keys, name: str, bands: Sequence[Band], freq_hz: FloatArray) -> None:
    """Raise an error if a band contains no frequency line."""
    if bands:
        keys.build(lambda: in_bands(freq_hz, bands), name)


def check_different(keys: Keys, name: str, words: Collection[str], what: str = "have the same name") -> None:
    """Raise an error if two tables of an array are equal in a key."""
    if len(set(words)) < len(words):
        raise keys.wrong(name, f"two tables [[{name}]] {what}")


def check_noises(keys: Keys, noises: Sequence[Noise], n: int) -> None:
    """Raise an error if the tables [[noise]] of a case with n joint DOFs are invalid."""
    check_different(keys, "noise", [noise.name for noise in noises])
    for noise in noises:
        if noise.level > _HIGH_LEVEL and not noise.confirm_level:
            percent = f"{noise.level:g} is noise of {100 * noise.level:g} % (5 % is 0.05)"
            raise noise.wrong("level", f"{percent}; correct it, or set confirm_level = true")
        if n % noise.block:
            raise noise.error("block", f"a divisor of {n}, the number of joint DOFs")
