"""Whether the two sides of a joint are measured alike: in one quantity, sign and unit, by their virtual points."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from jointfrf.channels.check.channel_ratios import unit_of_factor
from jointfrf.channels.check.driving_points import (
    Sectors,
    mean_exponent,
    quantities,
    quantity_findings,
    sectors,
    sign_findings,
)
from jointfrf.channels.check.finding import FindingLevel, FrfFinding
from jointfrf.channels.check.pair_ratios import are_signals
from jointfrf.channels.check.signals import as_measurement, modulus, smoothness
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["side_findings"]

#: Share of the lines that is looked at: those on which both sides move most like one body.
_BEST = 0.3
#: A factor between the sides is one from this: virtual points of sides that bend differ by less (at most 1.4 in 1000
#: data sets without a fault), and the pairs of DOFs agree on it to this deviation of its logarithm.
_FACTOR, _AGREED = 1.8, 0.5
#: A factor within this share of that of a unit is taken for it: units differ by more than twice that.
_UNIT = 0.25
#: Exponents of w in a ratio may be off by this.
_EXPONENT = 0.35
_SIDES = ("side j", "side k")


def side_findings(
    freq_hz: FloatArray, h: ComplexArray, share: FloatArray, hidden: np.ndarray, read_as: str | None
) -> Iterator[FrfFinding]:
    """Compare the sides by FRFs between joint DOFs j, then k.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
    h : ndarray, shape (n_freq, 2 n, 2 n)
    share : ndarray, shape (n_freq,)
        Share of the motion of the channels that is not rigid.
    hidden : ndarray of bool, shape (2 n, 2 n)
        FRFs that the noise of the channels hides.
    """
    best = np.sort(np.argsort(share, kind="stable")[: max(round(_BEST * share.size), 1)])
    n = h.shape[1] // 2
    power, log_factor, agreed = _ratio(freq_hz[best], h[best], hidden, n)
    driving = np.einsum("faa->fa", h)
    decided = sectors(driving[best])
    both = Sectors(
        np.array([_most(decided.quarter[own]) for own in (slice(0, n), slice(n, None))]),
        np.array([np.median(decided.negative[own]) for own in (slice(0, n), slice(n, None))]),
    )
    # of displacements only: rotations per moment follow the same exponent
    omega = 2 * np.pi * freq_hz
    powers = np.array([0, -power]) - min(0, -power)
    signs = np.array([1, -1 if log_factor.imag != 0 else 1])
    exponent = mean_exponent(omega, driving * omega[:, None] ** -np.repeat(powers, n).astype(float))
    named = as_measurement(freq_hz, h[:, :2, :2], _SIDES, _SIDES, np.zeros((2, 2), bool))
    span = float(freq_hz[-1] / freq_hz[0])
    group = np.zeros(2, np.intp)
    found = quantities(group, powers.astype(np.intp), signs.astype(np.intp), both, exponent, span)
    yield from (one for one in quantity_findings(named, found, both, read_as) if isinstance(one, FrfFinding))
    yield from (
        one for one in sign_findings(named, found, both, 1) if isinstance(one, FrfFinding) and one.kind == "sign"
    )
    factor = math.exp(-log_factor.real)
    if power == 0 and agreed < _AGREED and not 1 / _FACTOR < factor < _FACTOR:
        unit, other = (unit_of_factor(one, is_rotation=False, tolerance=_UNIT) for one in (factor, 1 / factor))
        what = f": {unit} on side k" if unit else f": {other} on side j" if other else ""
        level: FindingLevel = "error"
        yield FrfFinding(
            "units" if what else "gain", level, _SIDES, factor, _FACTOR,
            f"responses over forces are {factor:.4g} times as large on side k as on side j, by h_jk and h_kj{what}",
            "convert all channels to SI units",
        )  # fmt: skip


def _most(quarter: np.ndarray) -> int:
    """Return the half plane in which most driving points lie; -1 where none holds half of those that are decided."""
    known = quarter[quarter >= 0]
    if not known.size:
        return -1
    count = np.bincount(known, minlength=4)
    best = int(np.argmax(count))
    return best if 2 * count[best] > known.size else -1


def _ratio(freq_hz: FloatArray, h: ComplexArray, hidden: np.ndarray, n: int) -> tuple[int, complex, float]:
    """Return the power of i w, the logarithm and the scatter over pairs of h_jk / h_kj: side j over side k."""
    above, below = h[:, :n, n:], h[:, n:, :n].swapaxes(1, 2)
    size = np.median(modulus(h), axis=0)
    seen = (are_signals(size, smoothness(h), len(h)) & ~hidden & ~hidden.T)[:n, n:]
    if not seen.any():
        return 0, 0j, math.inf
    ratio = above[:, seen] / below[:, seen]
    middle = np.median(np.log(modulus(ratio)), axis=1)
    x = np.log(2 * np.pi * freq_hz)
    spread = ((x - x.mean()) ** 2).sum()
    slope = float(((x - x.mean()) * middle).sum() / spread) if spread > 0 else 0.0
    power = round(slope) if abs(slope - round(slope)) < _EXPONENT and abs(round(slope)) <= 2 else 0
    turned = ratio / modulus(ratio) * (-1j) ** power
    sign = 0.0 if turned.sum().real >= 0 else math.pi
    own = np.median(np.log(modulus(ratio)) - power * x[:, None], axis=0)
    return power, complex(np.median(own), sign), float(1.4826 * np.median(abs(own - np.median(own))))
