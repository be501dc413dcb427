"""A set of measured FRFs whose rows and columns have names; places of its channels around a joint."""

from __future__ import annotations

import re
import warnings
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.choices import POWER_OF_I_OMEGA
from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.frf.setups import SetUps
from jointfrf.kernel.arguments import as_array, as_integer, as_nodes, as_not_negative, as_real, check_type
from jointfrf.spelling import some_of

__all__ = [
    "POWER_OF_I_OMEGA",
    "ROUND_OFF",
    "Channel",
    "ChannelPlace",
    "ChannelRole",
    "FrfSet",
    "JointSide",
    "check_apart",
    "places_of_nodes",
    "same_frf",
]

#: Quantities with their SI units, in messages.
_PLURALS = {"receptance": "receptances m/N", "mobility": "mobilities (m/s)/N", "accelerance": "accelerances (m/s^2)/N"}
#: Names of directions, and of channels.
_DIRECTION = re.compile(r"([+-]?)(r?[xyz])")
_CHANNEL = re.compile(r"(\d+)\s*(?::\s*)?([+-]?r?[xyz])")
#: Number of missing FRFs that a message names.
_NAMES_SHOWN = 10
#: Excess of a coherence over 1 that single precision may cause.
ROUND_OFF = 1e-5
ChannelRole = Literal["response", "excitation", "both"]
JointSide = Literal["j", "k"]


@dataclass(frozen=True, order=True)
class Channel:
    """A point and a signed direction of a response or an excitation.

    Parameters
    ----------
    node : int
        Number of the point, 1 or more.
    direction : str
        ``+x``, ``-x``, ... ``+z`` for a translation, ``+rx``, ... ``-rz`` for a rotation. A missing sign means plus.

    Examples
    --------
    >>> str(Channel(102, "y")), Channel.parse("102:-y").sign, Channel.parse("102:rx").is_rotation
    ('102:+y', -1, True)
    """

    node: int
    direction: str

    def __post_init__(self) -> None:
        as_integer("node", self.node)
        check_type("direction", self.direction, str)
        match = _DIRECTION.fullmatch(self.direction.strip().lower())
        if match is None:
            raise ValueError(f"direction {self.direction!r} is none of +x -x +y -y +z -z +rx -rx +ry -ry +rz -rz")
        if self.node < 1:
            raise ValueError(f"node {self.node} is not a positive number")
        object.__setattr__(self, "direction", (match[1] or "+") + match[2])

    @classmethod
    def parse(cls, text: str | Channel) -> Channel:
        """Return the channel of a name such as ``102:+y``, ``102:y``, ``102+y``, ``102y`` or ``102:rx``.

        Raises
        ------
        ValueError
            The text is no such name.
        TypeError
            It is no text.
        """
        if isinstance(text, Channel):
            return text
        check_type("channel", text, str)
        match = _CHANNEL.fullmatch(text.strip().lower())
        if match is None:
            raise ValueError(f"{text!r} is no channel; write a node and a direction, such as 102:+y (rotation rx)")
        return cls(int(match[1]), match[2])

    @property
    def sign(self) -> int:
        """Sign of the direction: +1 along the axis, -1 against it."""
        return -1 if self.direction[0] == "-" else 1

    @property
    def axis(self) -> str:
        """Direction without its sign."""
        return self.direction[1:]

    @property
    def is_rotation(self) -> bool:
        """Whether the channel is a rotation or a moment."""
        return self.axis.startswith("r")

    def opposite(self) -> Channel:
        """Return the channel of the same point in the opposite direction."""
        return Channel(self.node, ("+" if self.sign < 0 else "-") + self.axis)

    def __str__(self) -> str:
        return f"{self.node}:{self.direction}"


ChannelLike = str | Channel


@dataclass(frozen=True, eq=False)
class FrfSet:
    """Measured FRFs: any responses by any excitations, not necessarily all of them.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequency lines in Hz, increasing.
    responses, excitations : tuple of Channel
        Names of the rows and columns, each at most once.
    h : ndarray of complex, shape (n_freq, n_responses, n_excitations)
        FRFs in SI units, time convention exp(+i w t); NaN if there is none.
    quantity : {"receptance", "mobility", "accelerance"}
        Displacement (m), velocity (m/s) or acceleration (m/s^2) per force (N); for rotations rad, rad/s, rad/s^2 per
        N m.
    coordinates : mapping of int to ndarray, shape (3,)
        Global cartesian coordinates of the nodes in m; nodes without known coordinates are absent.
    source : str
        Origin of the set, for messages.
    coherence : ndarray, shape (n_freq, n_responses, n_excitations), optional
        Ordinary coherence (gamma^2, 0 to 1) of each FRF; NaN if it is not known.
    averages : number or ndarray, shape (n_responses, n_excitations), optional
        Number of measurements of which each FRF is the average; NaN if it is not known.
    stated : str
        Quantity and unit in the words of the file.
    setups : SetUps, optional
        Set-up of each FRF, for a set that was merged from several.

    Examples
    --------
    A point measured along y and its neighbour measured against y, both excited at the first:

    >>> import numpy as np
    >>> frfs = FrfSet(freq_hz=np.array([10.0, 20.0]),
    ...               responses=(Channel(1, "+y"), Channel(2, "-y")), excitations=(Channel(1, "+y"),),
    ...               h=np.array([[[2.0], [1.0]], [[4.0], [3.0]]]), quantity="accelerance")
    >>> frfs.matrix(["1:y", "2:y"], ["1:y"])[0].real
    array([[ 2.],
           [-1.]])
    >>> frfs.missing(["1:y"], ["1:y", "2:y"])
    [(Channel(node=1, direction='+y'), Channel(node=2, direction='+y'))]
    >>> print(frfs)
    2 accelerances (m/s^2)/N: 2 responses x 1 excitations, none missing
    2 lines, 10 to 20 Hz, spacing 10 Hz
    no coordinates
    responses: 1:+y 2:-y
    excitations: 1:+y
    """

    freq_hz: NDArray[np.float64]
    responses: tuple[Channel, ...]
    excitations: tuple[Channel, ...]
    h: NDArray[np.complex128]
    quantity: str = "receptance"
    coordinates: Mapping[int, NDArray[np.float64]] = field(default_factory=dict)
    source: str = ""
    coherence: NDArray[np.float64] | None = None
    averages: NDArray[np.float64] | None = None
    stated: str = ""
    setups: SetUps | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "freq_hz", _numbers("freq_hz", self.freq_hz, "biuf").astype(np.float64, copy=False))
        object.__setattr__(self, "h", np.ascontiguousarray(_numbers("h", self.h, "biufc"), dtype=np.complex128))
        for name in ("responses", "excitations"):
            named = getattr(self, name)
            if not isinstance(named, tuple | list) or not all(isinstance(each, Channel) for each in named):
                raise TypeError(f"{name} must be a tuple of Channel, not {type(named).__name__}")
        shape = (*self.freq_hz.shape, len(self.responses), len(self.excitations))
        if self.freq_hz.ndim != 1 or self.h.shape != shape:
            raise ValueError(f"h has shape {self.h.shape}, expected (n_freq, n_responses, n_excitations) = {shape}")
        if self.quantity not in POWER_OF_I_OMEGA:
            raise ValueError(f"quantity {self.quantity!r} is none of {', '.join(POWER_OF_I_OMEGA)}")
        for name in ("responses", "excitations"):
            if len(set(getattr(self, name))) < len(getattr(self, name)):
                raise ValueError(f"{name} names a channel twice")
        if not isinstance(self.coordinates, Mapping):
            raise TypeError(f"coordinates must map nodes to places, not {type(self.coordinates).__name__}")
        if self.coherence is not None:
            object.__setattr__(self, "coherence", _checked_coherence(self.coherence, shape))
        if self.averages is not None:
            object.__setattr__(self, "averages", _checked_averages(self.averages, shape[1:]))
        if self.setups is not None:
            check_type("setups", self.setups, SetUps)
            self.setups.check_fits(shape)

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Whether each FRF is present, shape (n_responses, n_excitations)."""
        return np.logical_not(np.isnan(self.h).all(axis=0))

    def check_whole(self) -> None:
        """Check that every FRF that is present is finite on all lines.

        Raises
        ------
        ValueError
            There is no FRF, or one is NaN or infinite on some lines; the message names the first.
        """
        measured = self.measured
        if not measured.any():
            raise ValueError("frfs contains no FRF")
        bad = ~np.isfinite(self.h) & measured
        if bad.any():
            line, i, j = (int(places[0]) for places in np.nonzero(bad))
            name = f"{self.responses[i]} / {self.excitations[j]}"
            raise ValueError(f"FRF {name} contains NaN or Inf, first at {self.freq_hz[line]:g} Hz")

    def receptance(self, window_decay: float = 0.0) -> FrfSet:
        """Return the same set as displacement per force.

        Parameters
        ----------
        window_decay : float
            Decay sigma of an exponential window exp(-sigma t) on the responses, 1/s, default 0. Give `identify` the
            same number.

        Returns
        -------
        FrfSet
            FRFs with quantity "receptance" in m/N; the set itself if it is one already.

        Warns
        -----
        FileContentWarning
            A line at 0 Hz had to be dropped.

        Notes
        -----
        Mobility is divided by s and accelerance by s^2, s = i w + sigma: under an exponential window the FRF of a
        linear structure is the one at s. Without a window 0 Hz does not allow the division.

        Examples
        --------
        >>> import numpy as np
        >>> point = (Channel(1, "+y"),)
        >>> frfs = FrfSet(np.array([1.0 / (2.0 * np.pi)]), point, point, np.array([[[-3.0]]]), "accelerance")
        >>> frfs.receptance().h.real
        array([[[3.]]])
        """
        power, decay = POWER_OF_I_OMEGA[self.quantity], as_not_negative("window_decay", window_decay)
        if power == 0:
            return self
        usable = (self.freq_hz != 0.0) | (decay > 0)
        if not usable.all():
            message = f"{self._name()}the line at 0 Hz is dropped: {self.quantity} gives no receptance there"
            warnings.warn(message, FileContentWarning, stacklevel=2)
        freq_hz = self.freq_hz[usable]
        s = 2j * np.pi * freq_hz + decay
        kept, over = self._lines(usable), s[:, None, None] ** power
        setups = None if kept.setups is None else kept.setups.times(1 / over[:, 0])
        return replace(kept, h=kept.h / over, quantity="receptance", setups=setups)

    def has(self, output: ChannelLike, input: ChannelLike) -> bool:
        """Return whether the FRF is present, possibly measured along the opposite direction."""
        return not self.missing([output], [input])

    def missing(self, outputs: Iterable[ChannelLike], inputs: Iterable[ChannelLike]) -> list[tuple[Channel, Channel]]:
        """Return the entries of a matrix of FRFs that are not in the set.

        Parameters
        ----------
        outputs, inputs : iterable of Channel or str
            Rows and columns of the matrix.

        Returns
        -------
        list of (Channel, Channel)
            Output and input of every missing FRF, row by row; empty if there is none.
        """
        return self._locate(outputs, inputs)[2]

    def measured_between(self, outputs: Sequence[ChannelLike], inputs: Sequence[ChannelLike]) -> NDArray[np.bool_]:
        """Return which FRFs between named channels are present, shape (n_outputs, n_inputs)."""
        rows, columns = list(map(Channel.parse, outputs)), list(map(Channel.parse, inputs))
        there = np.ones((len(rows), len(columns)), bool)
        for output, input_ in self.missing(rows, columns):
            there[rows.index(output), columns.index(input_)] = False
        return there

    def matrix(
        self, outputs: Sequence[ChannelLike], inputs: Sequence[ChannelLike], *, allow_missing: bool = False
    ) -> NDArray[np.complex128]:
        """Return FRFs between named channels, with their signs.

        Parameters
        ----------
        outputs, inputs : sequence of Channel or str
            Rows and columns, for example ``["102:+y", "202:+y"]``. A channel measured along the opposite direction is
            used with the opposite sign.
        allow_missing : bool
            Whether missing FRFs are NaN in the result, instead of an error; default False.

        Returns
        -------
        ndarray of complex, shape (n_freq, n_outputs, n_inputs)
            FRFs in the unit of the set's quantity, C order, a copy.

        Raises
        ------
        FileContentError
            FRFs are missing; the message names them.
        """
        places, signs, missing = self._locate(outputs, inputs)
        if missing and not allow_missing:
            pairs = [f"{output} / {input_}" for output, input_ in missing]
            shown = some_of(pairs, _NAMES_SHOWN)
            raise FileContentError(f"{self._name()}missing FRFs (response / excitation): {shown}")
        h = np.ascontiguousarray(self.h[:, places[0], places[1]] * signs)
        if missing:
            h[:, ~self.measured_between(outputs, inputs)] = np.nan
        return h

    def coherence_matrix(
        self, outputs: Sequence[ChannelLike], inputs: Sequence[ChannelLike]
    ) -> NDArray[np.float64] | None:
        """Return the coherence of the FRFs between named channels, for `identify` and `estimate_noise`.

        Parameters
        ----------
        outputs, inputs : sequence of Channel or str
            Rows and columns; see `matrix`.

        Returns
        -------
        ndarray, shape (n_freq, n_outputs, n_inputs), or None
            Ordinary coherence; None if the coherence of one FRF is not known.

        Raises
        ------
        FileContentError
            FRFs are missing.
        """
        if self.coherence is None:
            return None
        self.matrix(outputs, inputs)  # raises an error if FRFs are missing
        places = self._locate(outputs, inputs)[0]
        found = np.ascontiguousarray(self.coherence[:, places[0], places[1]])
        return None if np.isnan(found).any() else found

    def least_averages(self, outputs: Sequence[ChannelLike], inputs: Sequence[ChannelLike]) -> float | None:
        """Return the smallest number of averages of the FRFs between named channels.

        Parameters
        ----------
        outputs, inputs : sequence of Channel or str
            Rows and columns; see `matrix`.

        Returns
        -------
        float or None
            Number of averages; None if one of them is not known.
        """
        if self.averages is None:
            return None
        places = self._locate(outputs, inputs)[0]
        least = float(self.averages[places].min())
        return None if np.isnan(least) else least

    def setups_between(self, outputs: Sequence[ChannelLike], inputs: Sequence[ChannelLike]) -> SetUps | None:
        """Return the set-ups of the FRFs between named channels, for `identify` and `identify_model`.

        Parameters
        ----------
        outputs, inputs : sequence of Channel or str
            Rows and columns; see `matrix`.

        Returns
        -------
        SetUps or None
            Set-ups; None if the set was not merged from several.
        """
        if self.setups is None:
            return None
        places, signs, _ = self._locate(outputs, inputs)
        return self.setups.between(*places, signs, self.measured_between(outputs, inputs))

    def select(self, band: tuple[float, float]) -> FrfSet:
        """Return the lines in a band.

        Parameters
        ----------
        band : (float, float)
            Lowest and highest frequency in Hz, both included.

        Raises
        ------
        ValueError
            The band is not an increasing pair of numbers.
        FileContentError
            No line is in the band.
        """
        low, high = as_real("band", band, (2,)).tolist()
        if not low <= high:
            raise ValueError(f"band ({low:g}, {high:g}) Hz does not increase; give the lower limit first")
        inside = (self.freq_hz >= low) & (self.freq_hz <= high)
        if not inside.any():
            held = f"the {self.freq_hz.size} lines are {self._range()}" if self.freq_hz.size else "there are none"
            raise FileContentError(f"{self._name()}no frequency line in {low:g} to {high:g} Hz: {held}")
        return self._lines(inside)

    def at_nodes(self, nodes: Collection[int]) -> FrfSet:
        """Return the FRFs between some nodes.

        Parameters
        ----------
        nodes : collection of int
            Numbers of points.

        Raises
        ------
        FileContentError
            There is no FRF between them.
        """
        nodes = as_nodes("nodes", nodes)
        rows, columns = (
            [i for i, channel in enumerate(side) if channel.node in nodes]
            for side in (self.responses, self.excitations)
        )
        if not self.measured[np.ix_(rows, columns)].any():
            raise FileContentError(f"{self._name()}no FRF between nodes {', '.join(map(str, sorted(nodes)))}")
        return replace(
            self,
            responses=tuple(self.responses[i] for i in rows),
            excitations=tuple(self.excitations[j] for j in columns),
            h=self.h[:, rows][:, :, columns],
            coherence=None if self.coherence is None else self.coherence[:, rows][:, :, columns],
            averages=None if self.averages is None else self.averages[np.ix_(rows, columns)],
            coordinates={node: place for node, place in self.coordinates.items() if node in nodes},
            setups=None
            if self.setups is None
            else self.setups.between(
                *np.meshgrid(rows, columns, indexing="ij"),
                np.ones((len(rows), len(columns))),
                self.measured[np.ix_(rows, columns)],
            ),
        )

    def summary(self) -> str:
        """Return a description of the set in a few lines."""
        measured = self.measured
        n_missing = measured.size - int(measured.sum())
        nodes = {channel.node for channel in (*self.responses, *self.excitations)}
        located = len(nodes & set(self.coordinates))
        lines = [
            f"{measured.sum()} {_PLURALS[self.quantity]}: {len(self.responses)} responses x "
            f"{len(self.excitations)} excitations, {n_missing or 'none'} missing",
            f"{self.freq_hz.size} lines, {self._range()}, {self._spacing()}" if self.freq_hz.size else "no lines",
            *self._quality(),
            f"coordinates of {located} of {len(nodes)} nodes" if located else "no coordinates",
            f"responses: {_by_node(self.responses)}",
            f"excitations: {_by_node(self.excitations)}",
        ]
        if self.setups is not None:
            counts = zip(self.setups.names, self.setups.counts, strict=True)
            again = f"; {len(self.setups.repeats)} measured again" if len(self.setups.repeats) else ""
            lines.append(f"set-ups: {', '.join(f'{name} ({count} FRFs)' for name, count in counts)}{again}")
        if self.stated:
            lines[:1] = [f"in the file: {self.stated}", f"used as: {lines[0]}"]
        return "\n".join([self.source, *lines] if self.source else lines)

    def __str__(self) -> str:
        return self.summary()

    def __repr__(self) -> str:
        return f"<FrfSet {self.h.shape} {self.quantity}>"

    def _lines(self, kept: NDArray[np.bool_]) -> FrfSet:
        """Return some of the lines."""
        coherence = None if self.coherence is None else self.coherence[kept]
        setups = None if self.setups is None else self.setups.on_lines(kept)
        return replace(self, freq_hz=self.freq_hz[kept], h=self.h[kept], coherence=coherence, setups=setups)

    def _quality(self) -> list[str]:
        """Return a description of coherence and averages, if known."""
        parts = []
        measured = self.measured
        if self.coherence is not None and measured.any():
            known = np.logical_not(np.isnan(self.coherence).all(axis=0)) & measured
            parts.append(f"coherence of {known.sum()} of {measured.sum()} FRFs")
        if self.averages is not None and np.isfinite(self.averages[measured]).any():
            low, high = np.nanmin(self.averages[measured]), np.nanmax(self.averages[measured])
            parts.append(f"{low:g} averages" if low == high else f"{low:g} to {high:g} averages")
        return [", ".join(parts)] if parts else []

    def _locate(
        self, outputs: Iterable[ChannelLike], inputs: Iterable[ChannelLike]
    ) -> tuple[tuple[NDArray[np.intp], NDArray[np.intp]], NDArray[np.float64], list[tuple[Channel, Channel]]]:
        """Return row, column and sign of every entry of a matrix, and the missing entries."""
        for name, named in (("outputs", outputs), ("inputs", inputs)):
            if not isinstance(named, Iterable):
                raise TypeError(f"{name} must be a sequence of channels, not {type(named).__name__}")
        rows = [Channel.parse(output) for output in outputs]
        columns = [Channel.parse(input_) for input_ in inputs]
        shape = (len(rows), len(columns))
        i_row, i_column, signs = np.zeros(shape, np.intp), np.zeros(shape, np.intp), np.ones(shape)
        measured = self.measured
        row_of = {channel: i for i, channel in enumerate(self.responses)}
        column_of = {channel: i for i, channel in enumerate(self.excitations)}
        missing = []
        for i, row in enumerate(rows):
            for j, column in enumerate(columns):
                for output, input_ in same_frf(row, column):
                    place = row_of.get(output, -1), column_of.get(input_, -1)
                    if min(place) >= 0 and measured[place]:
                        i_row[i, j], i_column[i, j] = place
                        signs[i, j] = row.sign * output.sign * column.sign * input_.sign
                        break
                else:
                    missing.append((row, column))
        return (i_row, i_column), signs, missing

    def _name(self) -> str:
        return f"{self.source}: " if self.source else ""

    def _range(self) -> str:
        return f"{self.freq_hz[0]:.6g} to {self.freq_hz[-1]:.6g} Hz"

    def _spacing(self) -> str:
        steps = np.diff(self.freq_hz)
        if not steps.size:
            return "one line"
        if np.allclose(steps, steps[0], rtol=1e-3, atol=1e-5 * self.freq_hz[-1]):
            return f"spacing {steps.mean():.6g} Hz"
        return f"uneven spacing {steps.min():.4g} to {steps.max():.4g} Hz"


def _numbers(name: str, values: ArrayLike, kinds: str) -> NDArray[Any]:
    found = as_array(name, values)
    if found.dtype.kind not in kinds:
        raise TypeError(f"{name} must contain {'numbers' if 'c' in kinds else 'real numbers'}, not {found.dtype}")
    return found


def _checked_coherence(values: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    coherence = np.ascontiguousarray(_numbers("coherence", values, "biuf"), dtype=np.float64)
    if coherence.shape != shape:
        raise ValueError(f"coherence has shape {coherence.shape}, h has {shape}; make them equal")
    known = coherence[~np.isnan(coherence)]
    if known.size and not (known.min() >= 0 and known.max() <= 1 + ROUND_OFF):
        raise ValueError(f"coherence must be from 0 to 1, not {known.min():g} to {known.max():g}")
    return np.minimum(coherence, 1.0)


def _checked_averages(values: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.float64]:
    averages = np.asarray(_numbers("averages", values, "biuf"), dtype=np.float64)
    if averages.shape not in ((), shape):
        raise ValueError(f"averages has shape {averages.shape}, expected one number or one for each FRF, {shape}")
    known = averages[~np.isnan(averages)]
    if known.size and not (known.min() >= 1 and np.isfinite(known.max())):
        raise ValueError(f"averages must be 1 or more, not {known.min() if known.min() < 1 else known.max():g}")
    return np.ascontiguousarray(np.broadcast_to(averages, shape))


def same_frf(output: Channel, input_: Channel) -> list[tuple[Channel, Channel]]:
    """Return the four pairs of channels that measure the same FRF up to its sign, the exact one first."""
    return [(o, i) for o in (output, output.opposite()) for i in (input_, input_.opposite())]


def _by_node(channels: Iterable[Channel]) -> str:
    """Return channels as text with each node once, as in ``101:+x+y+z 102:+y``."""
    directions: dict[int, str] = {}
    for channel in channels:
        directions[channel.node] = directions.get(channel.node, "") + channel.direction
    return " ".join(f"{node}:{direction}" for node, direction in directions.items())


@dataclass(frozen=True, eq=False)
class ChannelPlace:
    """A translational channel: place, direction, side of the joint, use.

    Attributes
    ----------
    channel : Channel
        Name in the file of FRFs.
    side : {"j", "k"} or None
        Side of the joint; None if it is not known.
    role : {"response", "excitation", "both"}
        Use of the channel; "both": as in the file.
    position : ndarray, shape (3,), or None
        Position, m; None: the position in the file.
    direction : ndarray, shape (3,), or None
        Unit vector of the motion or force of the channel; None: the direction in its name.
    weight : float
        Weight in the virtual point, 0 to omit the channel.
    optional : bool
        Whether the file need not contain it: one of three directions of a sensor.
    where : str
        Origin of the entry, for messages.
    """

    channel: Channel
    side: JointSide | None = None
    role: ChannelRole = "both"
    position: NDArray[np.float64] | None = None
    direction: NDArray[np.float64] | None = None
    weight: float = 1.0
    optional: bool = False
    where: str = ""

    def __post_init__(self) -> None:
        check_type("channel", self.channel, Channel)

    @property
    def unit(self) -> NDArray[np.float64]:
        """Direction of the channel, shape (3,)."""
        if self.direction is not None:
            return self.direction
        return np.asarray(self.channel.sign * np.eye(3)["xyz".index(self.channel.axis)] + 0.0)


def check_apart(nodes_j: Sequence[int], nodes_k: Sequence[int]) -> None:
    """Raise an error if a node is on both sides of a joint."""
    shared = set(nodes_j) & set(nodes_k)
    if shared:
        raise ValueError(f"node {min(shared)} is named on both sides of the joint; name it on one")


def places_of_nodes(frfs: FrfSet, nodes_j: Sequence[int], nodes_k: Sequence[int]) -> tuple[ChannelPlace, ...]:
    """Return the translational channels of a set at nodes on both sides of a joint.

    Parameters
    ----------
    frfs : FrfSet
        FRFs with coordinates of the nodes.
    nodes_j, nodes_k : sequence of int
        Nodes on side j (on A) and on side k (on B).

    Returns
    -------
    tuple of ChannelPlace
        Places in the order of the nodes, with position and direction of the set.

    Raises
    ------
    ValueError
        A node is on both sides, or the set has no translational channel there.

    See Also
    --------
    joint_channels : transform from these channels to joint DOFs.
    jointfrf.io.read_channel_table : places from a table.

    Examples
    --------
    >>> import numpy as np
    >>> from jointfrf.frf.frf_set import places_of_nodes
    >>> from jointfrf.io import Channel, FrfSet
    >>> ends = (Channel(1, "+y"), Channel(2, "-z"))
    >>> frfs = FrfSet(np.array([10.0]), ends, ends, np.ones((1, 2, 2)))
    >>> [(str(place.channel), place.side) for place in places_of_nodes(frfs, [1], [2])]
    [('1:+y', 'j'), ('2:-z', 'k')]
    """
    check_type("frfs", frfs, FrfSet)
    nodes_j, nodes_k = as_nodes("nodes_j", nodes_j), as_nodes("nodes_k", nodes_k)
    check_apart(nodes_j, nodes_k)
    # A sensor along +y and a hammer along -y are the same channel: FRFs are returned with their signs.
    known = {(c.node, c.axis): c for c in (*frfs.excitations, *frfs.responses) if not c.is_rotation}
    found = []
    for side, nodes in (("j", nodes_j), ("k", nodes_k)):
        for node in dict.fromkeys(nodes):
            own = [channel for (at, _), channel in sorted(known.items()) if at == node]
            if not own:
                raise ValueError(f"node {node} has no channel of a translation; name another node")
            found += [ChannelPlace(channel, side) for channel in own]  # type: ignore[arg-type]
    return tuple(found)
