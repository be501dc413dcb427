"""FRFs with the names of their channels; lines and channels without a usable signal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import is_rotation
from jointfrf.frf.frf_set import Channel
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray, one_line
from jointfrf.messages.finding import Finding

__all__ = [
    "LEAST_LINES",
    "LEAST_SMOOTHNESS",
    "Measurement",
    "as_channel_names",
    "as_measurement",
    "check_signals",
    "find_bad_lines",
    "modulus",
]

#: From fewer lines the noise cannot be estimated.
LEAST_LINES = 20
#: Below this agreement of the phase from line to line an FRF is noise.
LEAST_SMOOTHNESS = 0.3
#: Of few lines the phases of noise agree by more: by less than this over the root of their number.
_SMOOTHEST = 4.0
#: There the mean of n |agreement|^2 over the FRFs of a channel is below this for 99 % of dead ones, even where these
#: share their noise: it is exponential then, of mean 1.
_OF_NOISE = 4.6
#: And the phases of h_pq and h_qp agree by less than this over the lines: noise on 20 lines by more once in 18 000.
_RECIPROCAL = 0.7
#: FRFs that agree to this share are copies: two measurements differ by their noise.
_SAME = 1e-6
#: FRFs that are reciprocal to this share hold no noise, or were made so.
_EXACT = 1e-9
#: Rows that are less alike than this on some lines are not compared on all; how many lines.
_ALIKE, _SOME = 0.999, 60


@dataclass(frozen=True, eq=False)
class Measurement:
    """FRFs on the usable lines.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Positive, increasing.
    h : ndarray, shape (n_freq, n_responses, n_forces)
        Finite.
    responses, forces : tuple of str
    rows, columns : ndarray of int, shape (n,)
        Responses and forces that share a DOF.
    signs : ndarray, shape (n,)
        -1 where they point in opposite directions.
    hidden : ndarray of bool, shape (n_responses, n_forces)
        FRFs that are missing, or that noise of the channels they come from may hide: they are not used.
    """

    freq_hz: FloatArray
    h: ComplexArray
    responses: tuple[str, ...]
    forces: tuple[str, ...]
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    signs: FloatArray
    hidden: NDArray[np.bool_]

    @property
    def omega(self) -> FloatArray:
        """Angular frequencies, rad/s."""
        return 2 * np.pi * self.freq_hz

    @cached_property
    def smoothness(self) -> FloatArray:
        """As `smoothness` of `h`, shape (n_responses, n_forces); 0 where it is hidden."""
        return np.where(self.hidden, 0.0, smoothness(self.h))

    @cached_property
    def square(self) -> ComplexArray:
        """FRFs between the DOFs that responses and forces share, shape (n_freq, n, n)."""
        return self.h[:, self.rows[:, None], self.columns] * self.signs

    @cached_property
    def driving(self) -> ComplexArray:
        """Driving-point FRFs, shape (n_freq, n)."""
        return np.asarray(np.einsum("faa->fa", self.square))

    @property
    def square_smoothness(self) -> FloatArray:
        """Smoothness of `square`, shape (n, n)."""
        return self.smoothness[self.rows[:, None], self.columns]

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the DOFs that responses and forces share."""
        return tuple(self.responses[row] for row in self.rows)

    @property
    def rotations(self) -> NDArray[np.bool_]:
        """Which of these are rotations."""
        return np.array([is_rotation(name.rpartition(":")[2].lstrip("+-")) for name in self.dofs], bool)

    def of_side(self, side: int, places: Iterable[int]) -> tuple[str, tuple[int, ...]]:
        """Return the name and the numbers of the responses (1) or forces (2) of some of these DOFs."""
        word, names, every = ("response", self.responses, self.rows)
        if side == 2:
            word, names, every = ("force", self.forces, self.columns)
        own = tuple(int(every[i]) for i in places)
        return f"{word} {', '.join(names[i] for i in own)}", own

    def without(self, rows: Sequence[int], columns: Sequence[int]) -> Measurement:
        """Return the same without the pairs of these responses and forces."""
        if not rows and not columns:
            return self
        kept = ~(np.isin(self.rows, rows) | np.isin(self.columns, columns))
        return replace(self, rows=self.rows[kept], columns=self.columns[kept], signs=self.signs[kept])


def modulus(h: ComplexArray) -> FloatArray:
    """Return |h| of numbers whose squares do not overflow, faster than abs."""
    return np.sqrt(h.real**2 + h.imag**2)


def smoothness(h: ComplexArray) -> FloatArray:
    """Agreement of the phase of each FRF from line to line: 1 for a smooth one, 1/sqrt(n_freq) for noise, 0 for 0."""
    turned = h[:-1].conj() * h[1:]
    size = modulus(turned)
    return abs((turned / np.where(size > 0, size, 1)).mean(axis=0))


def as_measurement(
    freq_hz: FloatArray,
    h: ComplexArray,
    responses: Sequence[str | Channel],
    forces: Sequence[str | Channel],
    hidden: NDArray[np.bool_],
) -> Measurement:
    """Pair responses with forces by name. The direction 102:-y is opposite to 102:+y."""
    of_responses = tuple(_both_ways(name)[0] for name in responses)
    of_forces, opposite = zip(*map(_both_ways, forces), strict=True) if forces else ((), ())
    place = {name: (i, 1) for i, name in enumerate(of_forces)}
    for i, name in enumerate(opposite):
        place.setdefault(name, (i, -1))
    pairs = np.array([(row, *place[name]) for row, name in enumerate(of_responses) if name in place], np.intp)
    rows, columns, signs = pairs.reshape(-1, 3).T
    if hidden.any():
        h = _filled(h, rows, columns, signs)
    return Measurement(freq_hz, h, of_responses, of_forces, rows, columns, signs.astype(float), hidden)


def _filled(
    h: ComplexArray, rows: NDArray[np.intp], columns: NDArray[np.intp], signs: NDArray[np.intp]
) -> ComplexArray:
    """Return FRFs with those that are missing taken from h_qp, where there is one, else 0: neutral for every check."""
    gone = np.asarray(np.isnan(h).all(axis=0))
    filled = np.where(gone, 0, h)
    for a, b in zip(*np.nonzero(gone[rows[:, None], columns]), strict=True):
        if not gone[rows[b], columns[a]]:
            filled[:, rows[a], columns[b]] = h[:, rows[b], columns[a]] * signs[a] * signs[b]
    return filled


def as_channel_names(
    shape: tuple[int, ...],
    names: Sequence[str | Channel] | None,
    responses: Sequence[str | Channel] | None,
    forces: Sequence[str | Channel] | None,
) -> tuple[Sequence[str | Channel], Sequence[str | Channel]]:
    """Return the names of responses and forces, each different, by default their numbers."""
    words = ("responses", "forces")
    if names is not None:
        if responses is not None or forces is not None:
            raise ValueError("names are of responses and forces alike; give names, or responses and forces")
        responses = forces = names
        words = ("names", "names")
    elif (responses is None) != (forces is None):
        raise ValueError("responses or forces are missing; give both")
    elif responses is None and shape[0] != shape[1]:
        raise ValueError(f"h has {shape[0]} responses and {shape[1]} forces; name them with responses= and forces=")
    found = []
    for word, own, n in zip(words, (responses, forces), shape, strict=True):
        if own is not None and (isinstance(own, str) or not isinstance(own, Iterable)):
            raise TypeError(f"{word} must be a sequence of names, not {one_line(own)}")
        labels = [str(i) for i in range(n)] if own is None else list(own)
        if len(labels) != n or len(set(map(str, labels))) != n:
            raise ValueError(f"{word} must name {n} different channels")
        found.append(labels)
    return found[0], found[1]


def _both_ways(name: str | Channel) -> tuple[str, str]:
    """Return the name of a channel, and that of the channel that points the other way."""
    try:
        channel = Channel.parse(name)
    except ValueError:
        return str(name), str(name)
    return str(channel), str(channel.opposite())


def check_signals(measurement: Measurement) -> tuple[list[Finding], list[int], list[int]]:
    """Find dead and doubled channels.

    Returns
    -------
    tuple of list
        Findings, and the responses and forces that no other check can use, which include hidden ones.
    """
    findings: list[Finding] = []
    bad: list[list[int]] = []
    least, square = _least_smoothness(len(measurement.h)), measurement.square
    # Reciprocal to rounding: calculated, or made so; equal channels are then no copies of noise.
    is_exact = bool(square.size and abs(square - square.swapaxes(1, 2)).max() <= _EXACT * abs(square).max())
    across, paired = measurement.h.swapaxes(1, 2), _reciprocal(measurement)
    unknown = measurement.hidden.all(axis=1), measurement.hidden.all(axis=0)
    for word, names, h, smooth, is_reciprocal, is_hidden in (
        ("response", measurement.responses, measurement.h, measurement.smoothness, paired[0], unknown[0]),
        ("force", measurement.forces, across, measurement.smoothness.T, paired[1], unknown[1]),
    ):
        best = smooth.max(axis=1)
        # FRFs on few, coarse lines are not smooth, but no noise.
        like_noise = (len(h) * (smooth**2).mean(axis=1) < _OF_NOISE) & ~is_reciprocal
        is_dead = (best < LEAST_SMOOTHNESS) | ((best < least) & like_noise)
        dead = np.flatnonzero(is_dead | is_hidden).tolist()
        for i in np.flatnonzero(is_dead & ~is_hidden).tolist():
            numbers = {"agreement": float(best[i]), "least": least}
            findings.append(
                Finding("dead-channel", numbers, (f"{word} {names[i]}",), variant="" if best[i] else "zero")
            )
        copies = [] if is_exact else _copies(h, dead)
        for i, j, value in copies:
            about = (f"{word} {names[i]}", f"{word} {names[j]}")
            findings.append(Finding("doubled-channel", {"difference": value}, about))
        bad.append([*dead, *(place for i, j, _ in copies for place in (i, j))])
    return findings, bad[0], bad[1]


def _least_smoothness(n_freq: int) -> float:
    """Return the agreement of the phase that noise on so many lines does not reach."""
    return float(max(LEAST_SMOOTHNESS, _SMOOTHEST / np.sqrt(n_freq)))


def _reciprocal(m: Measurement) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return the responses and the forces of which some FRF has the phases of its reciprocal one; of few lines."""
    rows, columns = (np.zeros(n, np.bool_) for n in m.h.shape[1:])
    if _least_smoothness(len(m.h)) == LEAST_SMOOTHNESS:
        return rows, columns
    turned = m.square * m.square.swapaxes(1, 2).conj()
    size = modulus(turned)
    agreement = abs((turned / np.where(size > 0, size, 1)).mean(axis=0))
    np.fill_diagonal(agreement, 0.0)
    found = agreement.max(axis=0, initial=0.0) > _RECIPROCAL
    rows[m.rows], columns[m.columns] = found, found
    return rows, columns


def _copies(h: ComplexArray, dead: list[int]) -> list[tuple[int, int, float]]:
    """Pairs of rows that are equal to rounding up to a real factor, and by how much they differ."""
    some = h[:: -(-h.shape[0] // _SOME)]
    size = np.sqrt((abs(some) ** 2).mean(axis=(0, 1), keepdims=True))
    # products of rows over lines and columns, every column with the same weight
    flat = (some / np.where(size > 0, size, 1)).swapaxes(0, 1).reshape(h.shape[1], -1)
    flat = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), TINY)
    product = (flat.conj() @ flat.T).real
    found: list[tuple[int, int, float]] = []
    for i, j in zip(*np.nonzero(np.triu(abs(product) > _ALIKE, 1)), strict=True):
        if i in dead or j in dead or any(j == other for _, other, _ in found):
            continue
        size = np.maximum(np.sqrt((abs(h[:, [i, j]]) ** 2).mean(axis=(0, 1))), TINY)
        first, second = (h[:, k] / size for k in (i, j))
        factor = np.vdot(first, second).real / np.vdot(first, first).real
        differs = float(np.linalg.norm(second - factor * first) / np.linalg.norm(second))
        if differs < _SAME:
            found.append((int(i), int(j), differs))
    return found


def find_bad_lines(
    freq_hz: FloatArray, h: ComplexArray, responses: tuple[str, ...], forces: tuple[str, ...]
) -> tuple[list[Finding], NDArray[np.bool_]]:
    """Return findings about lines, and which lines are good."""
    findings = []
    finite = np.isfinite(h)
    good = np.asarray(finite.all(axis=(1, 2)))
    if not good.all():
        rows, columns = (
            tuple(f"{word} {names[i]}" for i in np.flatnonzero(~finite.all(axis=axes)))
            for word, names, axes in (("response", responses, (0, 2)), ("force", forces, (0, 1)))
        )
        some = rows if len(rows) < len(responses) and len(rows) <= len(columns) else columns
        is_some = len(some) < len(responses if some is rows else forces)
        first = int(np.argmin(good))
        numbers = {"count": int((~good).sum()), "total": good.size, "line": first, "freq": float(freq_hz[first])}
        about, variant = (some, "channels") if is_some else ((), "")
        findings.append(Finding("not-finite", numbers, about, variant=variant))
    zero = freq_hz == 0
    if zero.any():
        findings.append(Finding("zero-frequency", {"line": int(np.argmax(zero))}))
    ascending = np.ones(freq_hz.size, bool)
    ascending[1:] = freq_hz[1:] > np.maximum.accumulate(freq_hz)[:-1]
    if not ascending.all():
        first = int(np.argmin(ascending))
        numbers = {"line": first, "before": float(freq_hz[first - 1]), "after": float(freq_hz[first])}
        findings.append(Finding("frequency-order", numbers))
    return findings, good & ~zero & ascending
