"""FRFs of a test with the assembly of a file: DOFs of the channels, and the fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from jointfrf.dofs import direction_names
from jointfrf.errors import FileContentError
from jointfrf.frf.bands import in_bands
from jointfrf.frf.frf_set import Channel, FrfSet
from jointfrf.frf.setups import SetUps
from jointfrf.frf.stated_noise import StatedNoise
from jointfrf.identification.identify_model import identify_model
from jointfrf.identification.model.assembly import AddedMass, Assembly, PlacedJoint
from jointfrf.identification.model.substructure import Unknown
from jointfrf.identification.result import Fit, columns_of
from jointfrf.kernel.arguments import ComplexArray, FloatArray, check_type
from jointfrf.spelling import did_you_mean, some_of
from jointfrf.workbench.assembly_file.keys import without_sign
from jointfrf.workbench.assembly_file.read import AssemblyFile, AssemblyPart, check_dofs, read_assembly_file, unknown_of

if TYPE_CHECKING:
    from jointfrf.workbench.report.sketch import SketchedPart

__all__ = ["MeasuredAssembly", "joint_words", "measured_assembly"]


@dataclass(frozen=True)
class MeasuredAssembly:
    """FRFs of a test, and the measured assembly.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Lines, Hz.
    h : ndarray, shape (n_freq, n_o, n_i)
        Receptances, m/N; NaN for an FRF that was not measured.
    assembly : Assembly
        Assembly with its unknowns.
    responses, forces : tuple of str
        DOFs ``"A/7:y"`` of the rows and columns of `h`.
    response_gains, force_gains : dict of str to Unknown
        Unknown gains by DOF.
    fixed : tuple of str
        Parameters of the joint that keep their value.
    channels : tuple of two dicts of str to str
        Channels of the file by DOF, of responses and of forces.
    unused : tuple of str
        Channels of the file that are not used.
    coherence : ndarray, shape (n_freq, n_o, n_i), or None
        Coherence if it is known for all FRFs.
    averages : float or None
        Number of averages if it is known for all FRFs.
    parts : dict of str to AssemblyPart
        Parts by name.
    located : tuple of str
        Descriptions of the node at each position of the file.
    setups : SetUps, optional
        Set-ups of the test to which the FRFs belong.
    """

    freq_hz: FloatArray
    h: ComplexArray
    assembly: Assembly
    responses: tuple[str, ...]
    forces: tuple[str, ...]
    response_gains: dict[str, Unknown]
    force_gains: dict[str, Unknown]
    fixed: tuple[str, ...]
    channels: tuple[dict[str, str], dict[str, str]]
    unused: tuple[str, ...]
    coherence: FloatArray | None
    averages: float | None
    parts: dict[str, AssemblyPart]
    located: tuple[str, ...]
    setups: SetUps | None = None

    @property
    def sketched(self) -> tuple[SketchedPart, ...]:
        """Parts for the drawing of `write_report`."""
        return tuple(part.sketched(name, self.assembly.joints) for name, part in self.parts.items())

    def describe(self) -> list[str]:
        """Return a description of the assembly and the files of its parts, line by line.

        The description lists places of joints, nodes with responses, forces and attachments, and nodes of positions.
        For parts from files it lists mass, centre of gravity, rigid motions, natural frequencies and possible errors.
        """
        parts = self.parts
        lines = [*joint_words(self.assembly.joints, parts), *columns_of(_node_rows(self, parts)), *self.located]
        lines += [f"{name}: {line}" for name, part in parts.items() for line in part.describe()]
        return lines + ([f"not used: {', '.join(self.unused)}"] if self.unused else [])

    def fit(
        self,
        *,
        noise: float | StatedNoise | None = None,
        sensor_mass: float | None = None,
        find_wrong_channels: bool = False,
        accept: Sequence[str] = (),
    ) -> Fit:
        """Identify the joint by `identify_model`, and return the fit.

        Parameters
        ----------
        noise : float or StatedNoise, optional
            Relative noise of the FRFs, or relative part and floors; default an estimate from the FRFs.
        sensor_mass : float, optional
            Mass of the accelerometer that moves from point to point, kg; default an estimate from the FRFs.
        find_wrong_channels : bool
            Whether to search for a channel of the opposite sign, or two exchanged channels; default False.
        accept : sequence of str
            Codes of errors of the data at which the fit does not stop, default none.
        """
        coherence, averages = (None, None) if noise is not None else (self.coherence, self.averages)
        return identify_model(
            self.freq_hz, self.h, self.assembly, self.responses, self.forces, response_gains=self.response_gains,
            force_gains=self.force_gains, fixed=self.fixed, noise=noise, sensor_mass=sensor_mass,
            coherence=coherence, averages=averages, setups=self.setups,
            find_wrong_channels=find_wrong_channels, accept=accept,
        )  # fmt: skip


def joint_words(joints: Mapping[str, PlacedJoint], parts: Mapping[str, AssemblyPart]) -> list[str]:
    """Return a line for each joint with its nodes, their places and its directions."""
    return [_joint_words(name, one, parts) for name, one in joints.items()]


def _joint_words(name: str, one: PlacedJoint, parts: Mapping[str, AssemblyPart]) -> str:
    """Return a line with the nodes of a joint, their places and its directions."""
    ends = []
    for dofs in (one.j, one.k):
        nodes = dict.fromkeys(dof.rpartition(":")[0] for dof in dofs)
        ends.append(", ".join(f"{node}{_place_of(node, parts)}" for node in nodes) or "the ground")
    kinds = [f"rigid {', '.join(one.joint.rigid)}"] if one.joint.rigid else []
    kinds += [f"{law.word} {', '.join(dict.fromkeys(pair))}" for pair, law in one.joint.laws.items()]
    return f"joint {name} between {ends[0]} and {ends[1]}: {'; '.join(kinds)}".replace("  ", " ")


def _place_of(node: str, parts: Mapping[str, AssemblyPart]) -> str:
    name, _, own = node.partition("/")
    return _at(parts[name], own)


def _at(part: AssemblyPart, node: str) -> str:
    at = part.places.get(node)
    return "" if at is None else f" at ({_numbers(at)}) m"


def _numbers(at: FloatArray) -> str:
    return ", ".join(f"{x:.5g}" for x in np.round(at, 9) + 0.0)


def _node_rows(own: MeasuredAssembly, parts: Mapping[str, AssemblyPart]) -> list[tuple[str, ...]]:
    """Return a row for each node with a response, a force or an attachment."""
    what: dict[str, list[str]] = {}
    for kind, channels in zip(("response", "force"), own.channels, strict=True):
        for dof, channel in channels.items():
            node, _, direction = dof.rpartition(":")
            what.setdefault(node, []).append(f"{kind} {direction} ({channel})")
    for one in own.assembly.attachments:
        for node in dict.fromkeys(dof.rpartition(":")[0] for dof in one.places):
            what.setdefault(node, []).append("mass" if isinstance(one, AddedMass) else "spring to the ground")
    is_one = len(own.assembly.joints) == 1
    which = "from the joint, m" if is_one else "from the nearest joint, m"
    rows: list[tuple[str, ...]] = [("node", "place, m", which, "what")]
    for name, words in what.items():
        of, _, node = name.partition("/")
        part = parts[of]
        ends = [part.places[end] for dof in part.keys.joint if (end := dof.rpartition(":")[0]) in part.places]
        at = part.places.get(node)
        ends = [np.mean(ends, axis=0)] if is_one and ends else ends
        away = "" if at is None or not ends else f"{min(np.linalg.norm(at - end) for end in ends):.4g}"
        rows.append((name, "" if at is None else _numbers(at), away, ", ".join(words)))
    return rows


def measured_assembly(
    path: Path | str, frfs: FrfSet, *, bands: list[tuple[float, float]] | None = None
) -> MeasuredAssembly:
    """Return the assembly of `assembly.toml` with the FRFs of a test.

    Parameters
    ----------
    path : Path or str
        Path of the file with parts, joint, unknowns and channels.
    frfs : FrfSet
        FRFs from `jointfrf.io.read_frfs`; mobilities and accelerances become receptances.
    bands : list of (low, high), optional
        Bands of the lines that are used, Hz; default all lines.

    Returns
    -------
    MeasuredAssembly
        Assembly and FRFs. `MeasuredAssembly.fit` identifies the joint.

    Raises
    ------
    FileContentError
        The file has missing keys (all are listed) or wrong values, or does not fit the FRFs.

    See Also
    --------
    identify_model : fit of FRFs with models of the parts.
    read_part : one part from a file.

    Examples
    --------
    >>> import jointfrf as jf
    >>> frfs = jf.io.read_frfs("test.uff")  # doctest: +SKIP
    >>> print(jf.measured_assembly("assembly.toml", frfs).fit())  # doctest: +SKIP
    """
    check_type("frfs", frfs, FrfSet)
    file, frfs = read_assembly_file(Path(path)), frfs.receptance()
    kept = in_bands(frfs.freq_hz, bands) if bands else np.ones(frfs.freq_hz.size, bool)
    kept = kept & (frfs.freq_hz > 0)
    if not kept.any():
        raise FileContentError(f"{frfs.source} has no line above 0 Hz in the bands; give other bands")
    freq = frfs.freq_hz[kept]
    parts = file.parts(freq)
    file, located = file.located(parts)
    rows, columns = (_dofs(file, parts, frfs, side) for side in (0, 1))
    _check_named(file, frfs)
    for own, what in ((rows, "response"), (columns, "excitation")):
        if not own:
            whose = "A or B" if "A" in parts else ", ".join(parts)
            first, channel = next(iter(parts)), (frfs.responses if what == "response" else frfs.excitations)[0]
            raise FileContentError(
                f"{file.path}: no {what} of {frfs.source} is a DOF of {whose}; name them under [channels], such as "
                f'"{channel}" = "{first}/{parts[first].keys.joint[0]}"'
            )
    names = tuple(dict.fromkeys([*rows, *columns]))
    signs = np.array([[a[1] * b[1] for b in columns.values()] for a in rows.values()])
    at = np.ix_(np.flatnonzero(kept), *(np.array([i for i, _ in own.values()]) for own in (rows, columns)))
    gains = [_gains(file, name, own) for name, own in (("response_gains", rows), ("force_gains", columns))]
    named = tuple({dof: str(all_[i]) for dof, (i, _) in own.items()}
                  for all_, own in ((frfs.responses, rows), (frfs.excitations, columns)))  # fmt: skip
    coherence, averages = _quality(frfs, at)
    return MeasuredAssembly(
        freq, np.ascontiguousarray(frfs.h[at] * signs), file.assembly(freq, parts, names), tuple(rows), tuple(columns),
        gains[0], gains[1], file.keys.fixed, (named[0], named[1]), _unused(frfs, named), coherence, averages,
        parts, located, _setups(frfs, at, signs, kept),
    )  # fmt: skip


def _setups(frfs: FrfSet, at: tuple[np.ndarray, ...], signs: np.ndarray, kept: np.ndarray) -> SetUps | None:
    """Return the set-ups of the FRFs used."""
    if frfs.setups is None:
        return None
    rows, columns = np.broadcast_arrays(at[1][0], at[2][0])
    return frfs.setups.between(rows, columns, signs, frfs.measured[rows, columns]).on_lines(kept)


def _quality(frfs: FrfSet, at: tuple[np.ndarray, ...]) -> tuple[FloatArray | None, float | None]:
    """Return coherence and number of averages, or None for each that is not known for all FRFs used."""
    if frfs.coherence is None:
        return None, None
    coherence = np.ascontiguousarray(frfs.coherence[at])
    if np.isnan(coherence).any():
        return None, None
    averages = None if frfs.averages is None else float(np.min(frfs.averages[np.ix_(at[1].ravel(), at[2].ravel())]))
    return coherence, averages if averages is not None and np.isfinite(averages) else None


def _unused(frfs: FrfSet, named: tuple[dict[str, str], ...]) -> tuple[str, ...]:
    pairs = zip((frfs.responses, frfs.excitations), named, strict=True)
    return tuple(dict.fromkeys(str(one) for all_, own in pairs for one in all_ if str(one) not in own.values()))


def _dofs(file: AssemblyFile, parts: Mapping[str, AssemblyPart], frfs: FrfSet, side: int) -> dict[str, tuple[int, int]]:
    """Return number and sign of the channel of each DOF, in the order of the file of FRFs.

    Responses are side 0, forces are side 1.
    """
    given = file.keys.channels
    channels = (frfs.responses, frfs.excitations)[side]
    found: dict[str, tuple[int, int]] = {}
    mapping = _stated(file, parts, side) if given else {}
    for i, channel in enumerate(channels):
        dof, sign = mapping.get(channel, ("", 1)) if given else _named_alike(parts, file, channel)
        if dof and dof in found:
            both = f"{channels[found[dof][0]]} and {channel}"
            raise FileContentError(f"{file.path}: {both} of {frfs.source} are one DOF, {dof}; give each its own DOF")
        if dof:
            found[dof] = (i, sign)
    return found


def _stated(file: AssemblyFile, parts: Mapping[str, AssemblyPart], side: int) -> dict[Channel, tuple[str, int]]:
    """Return DOF and sign of the channels under [channels], and of the opposite channels."""
    table = file.keys.table.table("channels")
    mapping: dict[Channel, tuple[str, int]] = {}
    seen: dict[Channel, str] = {}
    for name, dofs in file.keys.channels.items():
        channel = table.build(lambda name=name: Channel.parse(name))  # type: ignore[misc]
        if channel in seen:
            raise table.wrong(
                name,
                f"{seen[channel]} names this direction, too; name it once, as "
                f'"{name}" = {{ response = "A/1:-z", force = "A/1:z" }} if sensor and force differ in sign',
            )
        seen |= {channel: name, channel.opposite(): name}
        own = dofs if isinstance(dofs, str) else dofs.dofs[side]
        if own is not None:
            dof, sign = without_sign(own)
            check_dofs(parts, file.keys, "channels", [dof])
            mapping[channel], mapping[channel.opposite()] = (dof, sign), (dof, -sign)
    return mapping


def _named_alike(parts: Mapping[str, AssemblyPart], file: AssemblyFile, channel: Channel) -> tuple[str, int]:
    """Return the DOF of a part with the name of a channel, or an empty text."""
    words = [f"{channel.node}:{channel.axis}", f"{channel.node}:{direction_names([channel.axis])[0]}"]
    words += [f"{channel.node}:theta"] if channel.is_rotation else []
    found = []
    for side, part in parts.items():
        found += [f"{side}/{word}" for word in words if part.has(word)][:1]
    if len(found) > 1:
        raise FileContentError(
            f"{file.path}: channel {channel} may be {' or '.join(found)}; name it under [channels], such as "
            f'"{channel}" = "{found[0]}"'
        )
    return (found[0], channel.sign) if found else ("", 1)


def _check_named(file: AssemblyFile, frfs: FrfSet) -> None:
    """Raise an error for a channel that the FRFs do not have."""
    known = {one for own in (frfs.responses, frfs.excitations) for each in own for one in (each, each.opposite())}
    for name in file.keys.channels:
        if Channel.parse(name) not in known:
            shown = [str(one) for one in dict.fromkeys((*frfs.responses, *frfs.excitations))]
            raise file.keys.table.table("channels").wrong(
                name, f"unknown channel of {frfs.source}; use one of {some_of(shown, 12)}{did_you_mean(name, shown)}"
            )


def _gains(file: AssemblyFile, name: str, dofs: dict[str, tuple[int, int]]) -> dict[str, Unknown]:
    found = {}
    for dof, prior in getattr(file.keys, name).items():
        table = file.keys.table.table(name)
        if dof not in dofs:
            raise table.wrong(dof, f"unknown channel; use one of {', '.join(dofs)}{did_you_mean(dof, dofs)}")
        found[dof] = unknown_of(prior, 1.0, table, dof, -np.inf)
    return found
