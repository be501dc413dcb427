"""FRFs with the names of their channels, and which responses and forces share a DOF."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import is_rotation
from jointfrf.frf.frf_set import Channel
from jointfrf.kernel.arguments import ComplexArray, FloatArray, one_line

__all__ = ["LEAST_SMOOTHNESS", "Measurement", "as_channel_names", "as_measurement", "modulus", "smoothness"]

#: Below this agreement of the phase from line to line an FRF is noise.
LEAST_SMOOTHNESS = 0.3


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
    hidden : ndarray of bool, shape (n_responses, n_forces), or None
        FRFs that noise of the channels they come from may hide: they are not used.
    """

    freq_hz: FloatArray
    h: ComplexArray
    responses: tuple[str, ...]
    forces: tuple[str, ...]
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    signs: FloatArray
    hidden: NDArray[np.bool_] | None = None

    @property
    def omega(self) -> FloatArray:
        """Angular frequencies, rad/s."""
        return 2 * np.pi * self.freq_hz

    @cached_property
    def smoothness(self) -> FloatArray:
        """As `smoothness` of `h`, shape (n_responses, n_forces); 0 where it is hidden."""
        found = smoothness(self.h)
        return found if self.hidden is None else np.where(self.hidden, 0.0, found)

    @cached_property
    def square(self) -> ComplexArray:
        """FRFs between the DOFs that responses and forces share, shape (n_freq, n, n)."""
        at: ComplexArray = self.h[:, self.rows[:, None], self.columns] * self.signs
        return at

    @property
    def square_smoothness(self) -> FloatArray:
        """Smoothness of `square`, shape (n, n)."""
        at: FloatArray = self.smoothness[self.rows[:, None], self.columns]
        return at

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the DOFs that responses and forces share."""
        return tuple(self.responses[row] for row in self.rows)

    @property
    def rotations(self) -> NDArray[np.bool_]:
        """Which of these are rotations."""
        return np.array([is_rotation(name.rpartition(":")[2].lstrip("+-")) for name in self.dofs], bool)

    def with_frfs(self, h: ComplexArray) -> Measurement:
        """Return the same channels with other FRFs."""
        return replace(self, h=h)

    def without(self, rows: Sequence[int], columns: Sequence[int]) -> Measurement:
        """Return the same without the pairs of these responses and forces."""
        if not rows and not columns:
            return self
        kept = ~(np.isin(self.rows, rows) | np.isin(self.columns, columns))
        return replace(self, rows=self.rows[kept], columns=self.columns[kept], signs=self.signs[kept])


def modulus(h: ComplexArray) -> FloatArray:
    """Return |h| of numbers whose squares do not overflow, faster than abs."""
    size: FloatArray = np.sqrt(h.real**2 + h.imag**2)
    return size


def smoothness(h: ComplexArray) -> FloatArray:
    """Agreement of the phase of each FRF from line to line: 1 for a smooth one, 1/sqrt(n_freq) for noise, 0 for 0."""
    turned = h[:-1].conj() * h[1:]
    size = modulus(turned)
    together: FloatArray = abs((turned / np.where(size > 0, size, 1)).mean(axis=0))
    return together


def as_measurement(
    freq_hz: FloatArray, h: ComplexArray, responses: Sequence[str | Channel], forces: Sequence[str | Channel]
) -> Measurement:
    """Pair responses with forces by name; a name like 102:-y is the opposite of 102:+y."""
    of_responses, of_forces = (tuple(_unified(name) for name in some) for some in (responses, forces))
    place = {name: (i, 1) for i, name in enumerate(of_forces)}
    for i, name in enumerate(of_forces):
        place.setdefault(_opposite(name), (i, -1))
    pairs = np.array([(row, *place[name]) for row, name in enumerate(of_responses) if name in place], np.intp)
    rows, columns, signs = pairs.reshape(-1, 3).T
    return Measurement(freq_hz, h, of_responses, of_forces, rows, columns, signs.astype(float))


def as_channel_names(
    shape: tuple[int, ...],
    names: Sequence[str | Channel] | None,
    responses: Sequence[str | Channel] | None,
    forces: Sequence[str | Channel] | None,
) -> tuple[Sequence[str | Channel], Sequence[str | Channel]]:
    """Return the names of responses and forces, each different, by default their numbers."""
    if names is not None and (responses is not None or forces is not None):
        raise ValueError("names goes without responses and forces")
    if names is None and responses is None and forces is None and shape[0] != shape[1]:
        raise ValueError(f"h holds {shape[0]} responses and {shape[1]} forces: name them by responses and forces")
    found = []
    for word, own, n in (("responses", responses, shape[0]), ("forces", forces, shape[1])):
        if own is None:
            own = names if names is not None else None
        if own is None and (responses is not None or forces is not None):
            raise ValueError("responses and forces go together")
        asked = word if names is None else "names"
        if own is not None and (isinstance(own, str) or not isinstance(own, Iterable)):
            raise TypeError(f"{asked} must be a sequence of names, not {one_line(own)}")
        labels = [str(i) for i in range(n)] if own is None else list(own)
        if len(labels) != n or len(set(map(str, labels))) != n:
            raise ValueError(f"{asked} must name {n} different channels")
        found.append(labels)
    return found[0], found[1]


def _unified(name: str | Channel) -> str:
    try:
        return str(Channel.parse(name))
    except ValueError:
        return str(name)


def _opposite(name: str) -> str:
    try:
        return str(Channel.parse(name).opposite())
    except ValueError:
        return name
