"""Several sets of measured FRFs as one: files of one test."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, Channel, FrfSet

__all__ = ["merge_frfs", "same_lines"]

#: How far lines of the same frequency differ at most, relative to it: files give five to seven digits.
_SAME_LINES = 1e-5
#: How far two copies of the same FRF differ at most, relative to its largest value: single precision.
_SAME_VALUES = 1e-6
#: In metres.
_SAME_PLACE = 1e-6

_Values = NDArray[np.complex128] | NDArray[np.float64]


def same_lines(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether two sets of frequency lines are the same but for the digits of their files."""
    return one.shape == other.shape and bool(np.allclose(one, other, rtol=_SAME_LINES, atol=0.0))


def merge_frfs(sets: Sequence[FrfSet]) -> FrfSet:
    """Put sets of measured FRFs together.

    Parameters
    ----------
    sets : sequence of FrfSet
        At the same frequency lines. Where quantities differ, all are given as the one that is differentiated most
        often.

    Returns
    -------
    FrfSet
        Channels in the order of the sets.

    Raises
    ------
    FileContentError
        Sets differ in their frequency lines, in an FRF, in its coherence or number of averages, or in the coordinates
        of a node; both sources are named.
    ValueError
        There is no set.

    Examples
    --------
    >>> import numpy as np
    >>> points = [Channel(1, "+y"), Channel(2, "+y")]
    >>> freq = np.array([10.0, 20.0])
    >>> one, two = (FrfSet(freq, (point,), (points[0],), np.ones((2, 1, 1))) for point in points)
    >>> merge_frfs([one, two]).h.shape
    (2, 2, 1)
    """
    if not isinstance(sets, Sequence) or not all(isinstance(each, FrfSet) for each in sets):
        raise TypeError("sets must be a list of FrfSet")
    if not sets:
        raise ValueError("there is no set of FRFs to merge")
    if len(sets) == 1:
        return sets[0]
    first = sets[0]
    for each in sets[1:]:
        if not same_lines(first.freq_hz, each.freq_hz):
            held = [f"{_lines(one)} in {_name(one, sets)}" for one in (first, each)]
            raise FileContentError(f"files of one test need the same frequency lines: {held[0]}, {held[1]}")
    quantity = max((each.quantity for each in sets if each.measured.any()), key=POWER_OF_I_OMEGA.__getitem__,
                   default=first.quantity)  # fmt: skip
    responses = tuple(dict.fromkeys(channel for each in sets for channel in each.responses))
    excitations = tuple(dict.fromkeys(channel for each in sets for channel in each.excitations))
    merged = _Merged(responses, excitations, sets)
    n_freq, shape = first.freq_hz.size, (len(responses), len(excitations))
    h = np.full((n_freq, *shape), np.nan + 0j)
    merged.fill(h, lambda each: _as_quantity(each, quantity), "the FRF")
    coherence = averages = None
    if any(each.coherence is not None for each in sets):
        coherence = np.full((n_freq, *shape), np.nan)
        merged.fill(coherence, lambda each: each.coherence, "the coherence of")
    if any(each.averages is not None for each in sets):
        averages = np.full((1, *shape), np.nan)
        merged.fill(averages, lambda each: None if each.averages is None else each.averages[None], "the averages of")
    return FrfSet(
        first.freq_hz,
        responses,
        excitations,
        h,
        quantity,
        _coordinates(sets),
        ", ".join(dict.fromkeys(each.source for each in sets if each.source)),
        coherence,
        None if averages is None else averages[0],
        "; ".join(dict.fromkeys(each.stated for each in sets if each.stated)),
    )


class _Merged:
    """Places of the FRFs of several sets in the merged one."""

    def __init__(self, responses: Sequence[Channel], excitations: Sequence[Channel], sets: Sequence[FrfSet]) -> None:
        self.responses, self.excitations, self.sets = responses, excitations, sets
        self.row_of = {channel: i for i, channel in enumerate(responses)}
        self.column_of = {channel: j for j, channel in enumerate(excitations)}

    def fill(self, target: _Values, values_of: Callable[[FrfSet], _Values | None], what: str) -> None:
        """Copy what each set holds into place; where something is there already, compare the two."""
        origin = np.full(target.shape[1:], -1)
        for number, each in enumerate(self.sets):
            values = values_of(each)
            if values is None:
                continue
            for i, response in enumerate(each.responses):
                for j, excitation in enumerate(each.excitations):
                    value = values[:, i, j]
                    if np.isnan(value).all():
                        continue
                    place = self.row_of[response], self.column_of[excitation]
                    if origin[place] >= 0:
                        self._compare(
                            target[:, *place], value, f"{what} {response} / {excitation}", origin[place], each
                        )
                        continue
                    target[:, *place] = value
                    origin[place] = number

    def _compare(self, kept: _Values, value: _Values, what: str, number: int, each: FrfSet) -> None:
        """Raise an error if a second copy differs from the first."""
        scale = np.nanmax(abs(kept)) if np.isfinite(kept).any() else 0.0
        if not np.allclose(kept, value, rtol=0.0, atol=_SAME_VALUES * float(scale), equal_nan=True):
            one, two = _name(self.sets[number], self.sets), _name(each, self.sets)
            raise FileContentError(f"{what} in {one} and in {two} contradict each other: leave one out")


def _as_quantity(frfs: FrfSet, quantity: str) -> NDArray[np.complex128]:
    """FRFs differentiated in time as often as needed."""
    power = POWER_OF_I_OMEGA[quantity] - POWER_OF_I_OMEGA[frfs.quantity]
    if power <= 0:  # negative for a set that holds no FRF
        return frfs.h
    return np.asarray(frfs.h * ((2j * np.pi * frfs.freq_hz) ** power)[:, None, None])


def _coordinates(sets: Sequence[FrfSet]) -> dict[int, NDArray[np.float64]]:
    """Coordinates of all nodes, which must be the same wherever they are given."""
    found: dict[int, NDArray[np.float64]] = {}
    origin: dict[int, FrfSet] = {}
    for each in sets:
        for node, place in each.coordinates.items():
            kept = found.setdefault(node, place)
            one = origin.setdefault(node, each)
            if abs(kept - place).max() > _SAME_PLACE:
                raise FileContentError(
                    f"the coordinates of node {node} in {_name(one, sets)} and in {_name(each, sets)} "
                    "contradict each other"
                )
    return found


def _name(frfs: FrfSet, sets: Sequence[FrfSet]) -> str:
    return frfs.source or f"set {next(i for i, each in enumerate(sets, start=1) if each is frfs)}"


def _lines(frfs: FrfSet) -> str:
    if not frfs.freq_hz.size:
        return "no lines"
    return f"{frfs.freq_hz.size} lines {frfs.freq_hz[0]:.6g} to {frfs.freq_hz[-1]:.6g} Hz"
