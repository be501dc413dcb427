"""From ratios of pairs of FRFs to channels: which sensor or impact differs from the others, and by what."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.pair_ratios import PairRatios
from jointfrf.kernel.arguments import FloatArray

__all__ = ["ChannelRatios", "Offsets", "channel_ratios"]


@dataclass(frozen=True, eq=False)
class Offsets:
    """A property of channels, relative to most of those that they are connected to.

    Attributes
    ----------
    value, error : ndarray, shape (n,)
        NaN for a channel that is compared to no other.
    undecided : ndarray of bool, shape (n,)
        As many channels say the opposite: which ones are wrong cannot be told.
    """

    value: FloatArray
    error: FloatArray
    undecided: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ChannelRatios:
    """Response over force of each DOF that they share: r_p of h_pq / h_qp = r_p / r_q.

    Attributes
    ----------
    group : ndarray of int, shape (n,)
        Channels of one number are compared to each other.
    power : ndarray of int, shape (n,)
        Exponent of i w, relative to the lowest of the group.
    sign : ndarray of int, shape (n,)
        1 or -1, relative to the first of the group.
    gain, delay : Offsets
        Natural logarithm; s.
    """

    group: NDArray[np.intp]
    power: NDArray[np.intp]
    sign: NDArray[np.intp]
    gain: Offsets
    delay: Offsets


@dataclass(frozen=True, eq=False)
class _Trees:
    """A path of pairs from the first channel of each group to every other one.

    Attributes
    ----------
    group : ndarray of int, shape (n,)
    steps : list of (int, int, int, int)
        Channel, the one before it, the pair between them, and 1 where the channel is the first of the pair, else -1.
    """

    group: NDArray[np.intp]
    steps: list[tuple[int, int, int, int]]

    def summed(self, difference: FloatArray) -> FloatArray:
        """Values of channels from the differences of pairs along the paths, zero at the first of each group."""
        value = np.zeros(self.group.size)
        for channel, before, pair, turn in self.steps:
            value[channel] = value[before] + turn * difference[pair]
        return value


def _trees(n: int, p: NDArray[np.intp], q: NDArray[np.intp]) -> _Trees:
    group = np.full(n, -1)
    steps: list[tuple[int, int, int, int]] = []
    for first in range(n):
        if group[first] >= 0:
            continue
        group[first] = first
        front = [first]
        while front:
            at = front.pop(0)
            for ends, others, turn in ((p, q, -1), (q, p, 1)):
                for pair in np.flatnonzero(ends == at):
                    other = int(others[pair])
                    if group[other] < 0:
                        group[other] = first
                        steps.append((other, at, int(pair), turn))
                        front.append(other)
    return _Trees(group, steps)


def channel_ratios(pairs: PairRatios, n: int, *, least_gain: float, least_delay: float) -> ChannelRatios:
    """Assign the ratios of pairs to channels; differences below `least_gain`, `least_delay` count as none."""
    use = pairs.usable
    p, q = pairs.p[use], pairs.q[use]
    trees = _trees(n, p, q)
    group = trees.group
    gain = _solved(group, p, q, pairs.log_gain[use], pairs.gain_error[use] ** -2)
    delay = _solved(group, p, q, pairs.delay[use], pairs.delay_error[use] ** -2)
    power = np.rint(trees.summed(pairs.power[use].astype(float))).astype(np.intp)
    for number in np.unique(group):
        power[group == number] -= power[group == number].min()
    phase = pairs.phase[use] - np.pi / 2 * (power[p] - power[q])
    turned = np.rint(trees.summed((np.cos(phase) < 0).astype(float))).astype(np.intp)
    sign = np.where(turned % 2 == 1, -1, 1)
    return ChannelRatios(group, power, sign, _offsets(group, *gain, least_gain), _offsets(group, *delay, least_delay))


def _solved(
    group: NDArray[np.intp], p: NDArray[np.intp], q: NDArray[np.intp], difference: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Values of channels by least squares from differences of pairs, mean zero in each group, and their covariance."""
    n = group.size
    laplacian = np.zeros((n, n))
    np.add.at(laplacian, (p, p), weight)
    np.add.at(laplacian, (q, q), weight)
    np.add.at(laplacian, (p, q), -weight)
    np.add.at(laplacian, (q, p), -weight)
    right = np.zeros(n)
    np.add.at(right, p, weight * difference)
    np.add.at(right, q, -weight * difference)
    scale = weight.max(initial=0.0) or 1.0
    # The constant of each group is not determined: projected out.
    same = group[:, None] == group
    constants = same / same.sum(axis=1)
    covariance = (np.linalg.inv(laplacian / scale + constants) - constants) / scale
    return covariance @ right, covariance


def _offsets(group: NDArray[np.intp], value: FloatArray, covariance: FloatArray, least: float) -> Offsets:
    """Refer the values of each group to the largest set of channels that agree."""
    result, error = np.full(value.size, np.nan), np.full(value.size, np.nan)
    undecided = np.zeros(value.size, bool)
    for number in np.unique(group):
        some = np.flatnonzero(group == number)
        if some.size < 2:
            continue
        own = covariance[np.ix_(some, some)]
        variance = own.diagonal()[:, None] + own.diagonal() - 2 * own
        agree = abs(value[some, None] - value[some]) < np.maximum(least, 4 * np.sqrt(np.maximum(variance, 0)))
        count = agree.sum(axis=1)
        best = int(np.argmax(count))
        reference = agree[best]
        contrast = np.eye(some.size) - reference / reference.sum()
        result[some] = contrast @ value[some]
        error[some] = np.sqrt(np.maximum(np.einsum("ab,bc,ac->a", contrast, own, contrast), 0))
        others = ~reference
        undecided[some] = others.any() and count[others].max(initial=0) >= count[best]
    return Offsets(result, error, undecided)
