"""Channels beside the rigid motion that the others around their virtual point show: which one is wrong, and how."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.virtual_point import ROUND_OFF, UNSEEN
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray

__all__ = ["ChannelGroup", "Suspects", "column_size", "expected_motion", "find_suspects", "not_rigid"]

#: A band is judged in this many parts, and by the share of them in which the other channels move most like one body:
#: there the deformation of the sides, which grows with frequency and at antiresonances, says least.
_PARTS, _BEST = 20, 0.2
#: Lines of a part at least, so that chance does not choose it.
_LEAST_LINES = 5
#: A channel is compared where this share of an error of it stays in its residual: below, the others hardly say it.
_LEAST_REDUNDANCY = 0.05
#: Power of the motion expected of a channel, in those of the others, that its weight is limited to.
_LEAST_POWER = 0.05
#: Each channel more must explain this much more, a factor of 1.6 in the mean square: where sides bend, any leaves less.
_PRICE = 0.5
#: Power of a channel in that expected of it, to which its weight lets it come: beyond, sums lose their digits.
_MOST_POWER = 1e4
#: Residuals that the others must have beside the channels left out: fewer agree by chance.
_LEAST_REST = 2


@dataclass(frozen=True, eq=False)
class ChannelGroup:
    """Responses, or forces, of one side of a joint.

    Attributes
    ----------
    word : {"response", "force"}
    places : ndarray of int, shape (m,)
        Rows, or columns, of the FRFs.
    nodes : tuple of int, length m
        Nodes of the channels.
    positions, directions : ndarray, shape (m, 3)
        m; unit vectors.
    h : ndarray, shape (n_freq, m, n)
        FRFs of these channels: n forces for responses, n responses for forces.
    """

    word: Literal["response", "force"]
    places: NDArray[np.intp]
    nodes: tuple[int, ...]
    positions: FloatArray
    directions: FloatArray
    h: ComplexArray

    @property
    def size(self) -> int:
        """Number of channels."""
        return int(self.h.shape[1])

    @cached_property
    def motion(self) -> FloatArray:
        """Response of the channels to unit motions of their middle, shape (m, 6); rotations times their reach."""
        return np.stack([one @ self.at(place) for place, one in zip(self.positions, self.directions, strict=True)])

    def at(self, position: FloatArray) -> FloatArray:
        """Return the displacement of a place for the same unit motions, shape (3, 6)."""
        middle = self.positions.mean(axis=0)
        reach = np.sqrt(((self.positions - middle) ** 2).sum(axis=1).mean()) or 1.0
        return np.hstack([np.eye(3), np.cross((position - middle) / reach, np.eye(3))])

    def filled(self, missing: NDArray[np.bool_]) -> ChannelGroup:
        """Return the same with FRFs that are missing, shape (m, n), as the other channels expect them: neutral."""
        h = self.h
        for column in np.flatnonzero(missing.any(axis=0)):
            gone = missing[:, column]
            if h is self.h:
                h = h.copy()
            inverse = np.linalg.pinv(self.motion[~gone], rcond=UNSEEN)
            h[:, gone, column] = h[:, ~gone, column] @ (self.motion[gone] @ inverse).T
        return self if h is self.h else replace(self, h=h)

    def only(self, kept: NDArray[np.intp]) -> ChannelGroup:
        """Return the same with some of the channels."""
        nodes, h = tuple(self.nodes[i] for i in kept), np.ascontiguousarray(self.h[:, kept])
        positions, directions = self.positions[kept], self.directions[kept]
        return replace(self, places=self.places[kept], nodes=nodes, positions=positions, directions=directions, h=h)


@dataclass(frozen=True, eq=False)
class Suspects:
    """Channels without which the remaining channels move as one body.

    Attributes
    ----------
    kind : {"channel", "sensor", "exchanged"}
        One channel; all channels of a node; two channels that have each other's places.
    channels : tuple of int
        Places in the group.
    gain : float
        Mean logarithm, over the band, of the factor by which the mean square of the residual falls without them.
    ratio : float
        Mean square of the residual that they cause, relative to the mean square of the remaining residual, on the most
        rigid lines.
    rest : float
        Root mean square of the remaining residual, relative to the motion.
    lines : ndarray of int, shape (n_lines,)
        Lines by which they were judged.
    """

    kind: Literal["channel", "sensor", "exchanged"]
    channels: tuple[int, ...]
    gain: float
    ratio: float
    rest: float
    lines: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class _Residuals:
    """Squares of a group by parts of the band.

    Attributes
    ----------
    lines : list of ndarray of int
        Lines of each part.
    root : ndarray, shape (m,)
        Roots of the weights of the channels.
    q : ndarray, shape (m, m)
        Projection on what is no rigid motion, of weighted channels.
    power : ndarray, shape (n_parts, m, m)
        Sums of x x^H of the weighted channels x over lines and columns.
    """

    lines: list[NDArray[np.intp]]
    root: FloatArray
    q: FloatArray
    power: ComplexArray

    @property
    def rank(self) -> int:
        """Number of rigid motions shown."""
        return round(len(self.root) - float(np.trace(self.q)))

    @cached_property
    def size(self) -> FloatArray:
        """Squares of the motion, which one channel that is far too large does not change, shape (n_parts,)."""
        own = np.einsum("bii->bi", self.power).real
        return np.asarray(np.maximum(own.shape[1] * np.median(own, axis=1), TINY))

    @cached_property
    def whole(self) -> FloatArray:
        """Squares of all channels, shape (n_parts,)."""
        return np.asarray(np.einsum("ij,bji->b", self.q, self.power).real)

    @cached_property
    def left(self) -> ComplexArray:
        """Products of residuals, shape (n_parts, m, m)."""
        return np.asarray(self.q @ self.power @ self.q)

    def without(self, channels: Sequence[int]) -> FloatArray | None:
        """Return squares of the residual of the other channels, shape (n_parts,); None if they do not predict these."""
        own = np.ix_(channels, channels)
        q = self.q[own]
        if np.linalg.eigvalsh(q)[0] < _LEAST_REDUNDANCY:
            return None
        inside = self.left[:, np.array(channels)[:, None], np.array(channels)]
        gone = np.einsum("ij,bji->b", np.linalg.inv(q), inside).real
        return np.asarray(np.maximum(self.whole - gone, 0.0))

    def exchanged(self, i: int, j: int) -> FloatArray:
        """Return squares of the residual with two channels exchanged, shape (n_parts,)."""
        turn = np.eye(self.root.size)
        turn[[i, j]] = 0
        turn[i, j], turn[j, i] = self.root[i] / self.root[j], self.root[j] / self.root[i]
        return np.asarray(np.maximum(np.einsum("ij,bji->b", turn.T @ self.q @ turn, self.power).real, 0.0))


def _residuals(group: ChannelGroup) -> _Residuals:
    """Weigh channels by the motion that the others expect of them, and split the squares by parts of the band."""
    u = group.h / column_size(group.h)[:, None, :]
    power = (u.real**2 + u.imag**2).mean(axis=(0, 2))
    # A channel that is far too large must not say what is expected of the others.
    root = np.maximum(power, np.median(power)) ** -0.5
    q = _projection(group.motion, root)
    free = np.maximum(np.diagonal(q), _LEAST_REDUNDANCY)
    expected = u - (q @ (root[:, None] * u)) / free[:, None] / root[:, None]
    power = (expected.real**2 + expected.imag**2).mean(axis=(0, 2))
    own = (u.real**2 + u.imag**2).mean(axis=(0, 2))
    root = np.maximum(np.maximum(power, _LEAST_POWER * np.median(power)), own / _MOST_POWER) ** -0.5
    x = root[:, None] * u
    n = max(min(_PARTS, group.h.shape[0] // _LEAST_LINES), 1)
    lines = np.array_split(np.arange(group.h.shape[0]), n)
    products = np.stack([np.einsum("fic,fjc->ij", x[part], x[part].conj(), optimize=True) for part in lines])
    return _Residuals(lines, root, _projection(group.motion, root), products)


def _projection(motion: FloatArray, root: FloatArray) -> FloatArray:
    """Return the projection of weighted channels on what is no rigid motion, shape (m, m)."""
    weighted = root[:, None] * motion
    size = np.linalg.norm(weighted, axis=0)
    left, values, _ = np.linalg.svd(weighted / np.where(size > 0, size, 1), full_matrices=False)
    left = left[:, values > UNSEEN * values[0]]
    return np.asarray(np.eye(len(motion)) - left @ left.T)


def find_suspects(group: ChannelGroup) -> Suspects | None:
    """Find the channels without which the remaining ones move most like one body; None if too few remain."""
    found = list(_suspects(group))
    if not found:
        return None
    return max(found, key=lambda one: one.gain - _PRICE * len(one.channels))


def _suspects(group: ChannelGroup) -> Iterator[Suspects]:
    residuals = _residuals(group)
    free = group.size - residuals.rank
    sensors = [[i for i, other in enumerate(group.nodes) if other == node] for node in dict.fromkeys(group.nodes)]
    choices: list[tuple[Literal["channel", "sensor"], list[int]]] = [("channel", [i]) for i in range(group.size)]
    choices += [("sensor", own) for own in sensors if len(own) > 1]
    for kind, own in choices:
        rest = free - len(own)
        squares = residuals.without(own) if rest >= _LEAST_REST else None
        if squares is not None:
            yield _judged(residuals, kind, own, squares, len(own), free)
    if free >= _LEAST_REST:
        for i, j in combinations(range(group.size), 2):
            yield _judged(residuals, "exchanged", [i, j], residuals.exchanged(i, j), 2, free)


def _judged(
    residuals: _Residuals,
    kind: Literal["channel", "sensor", "exchanged"],
    own: list[int],
    squares: FloatArray,
    taken: int,
    free: int,
) -> Suspects:
    """Say how much better the others agree without some channels, or with two of them exchanged."""
    rest = free if kind == "exchanged" else free - taken
    size = residuals.size
    left = np.maximum(squares, ROUND_OFF**2 * size) / rest
    gain = float(np.log(np.maximum(residuals.whole, ROUND_OFF**2 * size) / free / left).mean())
    best = np.argsort(squares / size)[: max(round(_BEST * size.size), 1)]
    ratio = float(np.median((residuals.whole - squares)[best] / taken / left[best]))
    relative = float(np.sqrt(np.median(squares[best] / size[best])))
    return Suspects(kind, tuple(own), gain, ratio, relative, np.concatenate([residuals.lines[b] for b in sorted(best)]))


def column_size(h: ComplexArray) -> FloatArray:
    """Return the median size of the channels that move, by lines and columns, shape (n_freq, n); 1 where none does.

    In a plane of symmetry the motion of most channels is round-off.
    """
    power = np.sort(h.real**2 + h.imag**2, axis=1)
    most = power.shape[1]
    still = (power <= ROUND_OFF**2 * power[:, -1:]).sum(axis=1, keepdims=True)
    middle = [np.minimum((still + most - back) // 2, most - 1) for back in (1, 0)]
    found = np.sqrt(sum(np.take_along_axis(power, at, axis=1) for at in middle) / 2)[:, 0]
    return np.asarray(np.where(found > 0, found, 1.0))


def expected_motion(group: ChannelGroup, others: NDArray[np.intp]) -> ComplexArray:
    """Return the rigid motion that some channels show, as `ChannelGroup.motion` counts it, shape (n_freq, 6, n)."""
    root = _residuals(group).root[others]
    inverse = np.linalg.pinv(root[:, None] * group.motion[others], rcond=UNSEEN)
    return np.asarray(inverse @ (root[:, None] * group.h[:, others]))


def not_rigid(group: ChannelGroup) -> FloatArray:
    """Return the share of the motion of a group that is not rigid, root mean square by parts of the band, (n_freq,)."""
    residuals = _residuals(group)
    share = np.sqrt(np.maximum(residuals.whole, 0) / residuals.size)
    return np.concatenate([np.full(len(part), share[b]) for b, part in enumerate(residuals.lines)])
