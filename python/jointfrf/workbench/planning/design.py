"""Choice of sensors and impacts: greedy by information for the price, then by exchange."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import FloatArray

__all__ = ["Criterion", "Design", "Designer", "Prices", "best_first", "criterion_of", "loss_of"]

#: Criterion that the choice minimises: mean variance of relative errors ("A"), or volume of their ellipsoid ("D").
Criterion = Literal["A", "D"]

#: Difference in the logarithm of the criterion below which designs are equally good (errors differ by 5e-6). Rounding,
#: which differs between processors, is far smaller; differences that matter are far larger. Reciprocity causes ties.
_TIE = 1e-5
#: Largest number of exchanges; each lowers the criterion, so that the limit is never reached.
_EXCHANGES = 200


class Prices(NamedTuple):
    """Prices of a sensor and of an impact, in the same unit."""

    sensor: float
    hit: float


@dataclass(frozen=True)
class Design:
    """Chosen sensors and impacts, by their numbers among the candidates; every sensor is read at every impact."""

    sensors: tuple[int, ...]
    hits: tuple[int, ...]
    loss: float = field(compare=False)


def criterion_of(targets: NDArray[np.intp], kind: Criterion) -> Callable[[FloatArray], FloatArray]:
    """Return the logarithm of the size of an error, per parameter, as a function of information, shape (..., p, p)."""

    def loss(information: FloatArray) -> FloatArray:
        with np.errstate(all="ignore"):
            return loss_of(np.asarray(np.linalg.inv(information)[..., targets[:, None], targets]), kind)

    return loss


def loss_of(covariance: FloatArray, kind: Criterion) -> FloatArray:
    """Return the logarithm of the size of an error, per parameter, by its covariance, shape (..., t, t)."""
    with np.errstate(all="ignore"):
        if kind == "D":
            found = np.linalg.slogdet(covariance)[1] / covariance.shape[-1]
        else:
            found = np.log(np.trace(covariance, axis1=-2, axis2=-1) / covariance.shape[-1])
    return np.asarray(np.where(np.isfinite(found), found, np.inf))


def best_first(designs: Iterable[Design], loss: Callable[[Design], float]) -> Iterator[Design]:
    """Yield designs by rising loss, and equally good designs in the given order."""
    rest = [(loss(one), one) for one in designs]
    while rest:
        least = min(size for size, _ in rest)
        at = next(i for i, (size, _) in enumerate(rest) if not size > least + _TIE)
        yield rest.pop(at)[1]


def _loss(design: Design) -> float:
    return design.loss


@dataclass(frozen=True)
class Designer:
    """Choose sensors and impacts from candidates.

    Attributes
    ----------
    of_frf : ndarray, shape (n_o, n_i, p, p)
        Information of each FRF.
    prior : ndarray, shape (p, p)
        Information of the priors.
    loss : function
        Criterion as a function of information, shape (..., p, p); smaller is better.
    prices : Prices
        Prices of a sensor and of an impact.
    kept : Design
        Sensors and impacts that are part of every design.
    """

    of_frf: FloatArray
    prior: FloatArray
    loss: Callable[[FloatArray], FloatArray]
    prices: Prices
    kept: Design

    def cost(self, design: Design) -> float:
        """Return the cost of a design without the kept sensors and impacts."""
        sensors = len(design.sensors) - len(self.kept.sensors)
        return sensors * self.prices.sensor + (len(design.hits) - len(self.kept.hits)) * self.prices.hit

    def information(self, design: Design) -> FloatArray:
        """Return the information of a design, with the prior, shape (p, p)."""
        found: FloatArray = self.prior + self.of_frf[np.ix_(design.sensors, design.hits)].sum(axis=(0, 1))
        return found

    def designs(self) -> Iterator[Design]:
        """Yield designs of rising size, each with one sensor or impact more than the previous design."""
        design = self._first()
        while True:
            design = self._exchanged(design)
            yield design
            grown = self.ranked(design, self.additions(design))
            if not grown:
                return
            design = grown[0]

    def ranked(self, design: Design, grown: Iterable[Design]) -> list[Design]:
        """Return designs with one more channel than another design, by falling gain for the price."""

        def change(more: Design) -> float:
            price = self.prices.sensor if len(more.sensors) > len(design.sensors) else self.prices.hit
            return (more.loss - design.loss) / price

        return list(best_first(grown, change))

    def _first(self) -> Design:
        """Return the kept design, with the best sensor and impact added if it has none."""
        sensors = [self.kept.sensors] if self.kept.sensors else [(o,) for o in range(self.of_frf.shape[0])]
        hits = [self.kept.hits] if self.kept.hits else [(i,) for i in range(self.of_frf.shape[1])]
        pairs = [(own, other) for own in sensors for other in hits]
        return next(best_first(self._judged(pairs), _loss))

    def _judged(self, pairs: list[tuple[tuple[int, ...], tuple[int, ...]]]) -> list[Design]:
        each = np.array([self.of_frf[np.ix_(*pair)].sum(axis=(0, 1)) for pair in pairs])
        return [Design(*pair, float(loss)) for pair, loss in zip(pairs, self.loss(self.prior + each), strict=True)]

    def additions(self, design: Design) -> Iterator[Design]:
        """Yield the design with each further sensor, and with each further impact."""
        now = self.information(design)
        rows = [o for o in range(self.of_frf.shape[0]) if o not in design.sensors]
        columns = [i for i in range(self.of_frf.shape[1]) if i not in design.hits]
        if rows:
            losses = self.loss(now + self._of_rows(design.hits)[rows])
            for o, loss in zip(rows, losses.tolist(), strict=True):
                yield Design((*design.sensors, o), design.hits, loss)
        if columns:
            losses = self.loss(now + self._of_columns(design.sensors)[columns])
            for i, loss in zip(columns, losses.tolist(), strict=True):
                yield Design(design.sensors, (*design.hits, i), loss)

    def _of_rows(self, hits: tuple[int, ...]) -> FloatArray:
        found: FloatArray = self.of_frf[:, list(hits)].sum(axis=1)
        return found

    def _of_columns(self, sensors: tuple[int, ...]) -> FloatArray:
        found: FloatArray = self.of_frf[list(sensors)].sum(axis=0)
        return found

    def _exchanged(self, design: Design) -> Design:
        """Return a design of the same size that no exchange of one sensor or one impact improves."""
        for _ in range(_EXCHANGES):
            better = next(best_first(self._swaps(design), _loss), design)
            if not better.loss < design.loss - _TIE:
                break
            design = better
        return design

    def _swaps(self, design: Design) -> Iterator[Design]:
        now = self.information(design)
        rows, columns = self._of_rows(design.hits), self._of_columns(design.sensors)
        for out in design.sensors:
            if out in self.kept.sensors:
                continue
            losses = self.loss(now - rows[out] + rows)
            for o in sorted(set(range(len(rows))) - set(design.sensors)):
                yield Design(_replaced(design.sensors, out, o), design.hits, float(losses[o]))
        for out in design.hits:
            if out in self.kept.hits:
                continue
            losses = self.loss(now - columns[out] + columns)
            for i in sorted(set(range(len(columns))) - set(design.hits)):
                yield Design(design.sensors, _replaced(design.hits, out, i), float(losses[i]))


def _replaced(numbers: tuple[int, ...], out: int, by: int) -> tuple[int, ...]:
    return tuple(by if one == out else one for one in numbers)
