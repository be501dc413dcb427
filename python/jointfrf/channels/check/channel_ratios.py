"""From ratios of pairs of FRFs to channels: which sensor or impact differs from the others, and by what."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.pair_ratios import PairRatios
from jointfrf.kernel.arguments import FloatArray

__all__ = ["ChannelRatios", "Offsets", "channel_ratios", "groups_of"]


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


def groups_of(n: int, p: NDArray[np.intp], q: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the number of the group of each of n channels, connected by pairs."""
    group = np.arange(n)
    for a, b in zip(p, q, strict=True):
        group[group == group[b]] = group[a]
    return group


def channel_ratios(pairs: PairRatios, n: int, *, least_gain: float, least_delay: float) -> ChannelRatios:
    """Assign the ratios of pairs to channels; differences below `least_gain`, `least_delay` count as none."""
    use = pairs.usable
    p, q = pairs.p[use], pairs.q[use]
    group = groups_of(n, p, q)
    weight = pairs.gain_error[use] ** -2
    gain = _solved(n, p, q, pairs.log_gain[use], weight)
    delay = _solved(n, p, q, pairs.delay[use], pairs.delay_error[use] ** -2)
    power = np.zeros(n, np.intp)
    for number in np.unique(group):
        some = group == number
        first = np.flatnonzero(some)[0]
        relative = _relative(p, q, pairs.power[use].astype(float), first, n)
        power[some] = np.rint(relative[some] - np.nanmin(relative[some]))
    sign = _signs(pairs, use, group, power, n)
    return ChannelRatios(
        group, power, sign, _offsets(group, *gain, least_gain), _offsets(group, *delay, least_delay)
    )


def _relative(p: NDArray[np.intp], q: NDArray[np.intp], difference: FloatArray, first: np.intp, n: int) -> FloatArray:
    """Values of channels from differences of pairs, one path each, zero at the first; NaN outside its group."""
    value = np.full(n, np.nan)
    value[first] = 0
    for _ in range(n):
        for a, b, d in zip(p, q, difference, strict=True):
            if np.isnan(value[a]) and not np.isnan(value[b]):
                value[a] = value[b] + d
            elif np.isnan(value[b]) and not np.isnan(value[a]):
                value[b] = value[a] - d
    return value


def _solved(
    n: int, p: NDArray[np.intp], q: NDArray[np.intp], difference: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Values of channels by least squares from differences of pairs, mean zero in each group, and their covariance."""
    laplacian = np.zeros((n, n))
    np.add.at(laplacian, (p, p), weight)
    np.add.at(laplacian, (q, q), weight)
    np.add.at(laplacian, (p, q), -weight)
    np.add.at(laplacian, (q, p), -weight)
    right = np.zeros(n)
    np.add.at(right, p, weight * difference)
    np.add.at(right, q, -weight * difference)
    scale = weight.max(initial=0.0) or 1.0
    covariance = np.linalg.pinv(laplacian / scale, hermitian=True) / scale
    return covariance @ right, covariance


def _signs(
    pairs: PairRatios, use: NDArray[np.bool_], group: NDArray[np.intp], power: NDArray[np.intp], n: int
) -> NDArray[np.intp]:
    """Signs relative to the first channel of each group, from the phases less those of i^power."""
    p, q = pairs.p[use], pairs.q[use]
    phase = pairs.phase[use] - np.pi / 2 * (power[p] - power[q])
    turned = (np.cos(phase) < 0).astype(float)
    sign = np.ones(n, np.intp)
    for number in np.unique(group):
        some = group == number
        relative = _relative(p, q, turned, np.flatnonzero(some)[0], n)
        sign[some] = np.where(np.rint(relative[some]) % 2 == 1, -1, 1)
    return sign


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
