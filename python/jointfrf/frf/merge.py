"""Several sets of measured FRFs as one: files of one test."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, Channel, FrfSet
from jointfrf.frf.setups import SetUps

__all__ = ["merge_frfs", "same_lines"]

#: Largest relative difference of lines of the same frequency: files have five to seven digits.
_SAME_LINES = 1e-5
#: Largest difference of two copies of an FRF, relative to its largest value: single precision.
_SAME_VALUES = 1e-6
#: Largest relative difference (median over the lines) of an FRF that was measured again: gains, delays and moved
#: resonances of set-ups are below; another sign, another unit, another FRF are above.
_SAME_FRF = 0.3
#: Largest distance of equal positions, m.
_SAME_PLACE = 1e-6

_Values = NDArray[np.complex128] | NDArray[np.float64]


def same_lines(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Return whether two sets of frequency lines are equal up to the digits of their files."""
    return one.shape == other.shape and bool(np.allclose(one, other, rtol=_SAME_LINES, atol=0.0))


def merge_frfs(sets: Sequence[FrfSet]) -> FrfSet:
    """Return one set made of several sets of measured FRFs.

    Parameters
    ----------
    sets : sequence of FrfSet
        Sets at the same frequency lines. If quantities differ, all are converted to the one that is differentiated most
        often.

    Returns
    -------
    FrfSet
        Merged set, channels in the order of the sets. `FrfSet.setups` states the set of each FRF. If several sets have
        an FRF, the first one is used, and `setups` keeps the further ones.

    Raises
    ------
    FileContentError
        Sets differ in their frequency lines, grossly in an FRF, in its coherence or number of averages, or in the
        coordinates of a node; or all FRFs of one set were measured before. The message names both sources.
    ValueError
        There is no set.

    See Also
    --------
    read_frfs : merged FRFs of several files.

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
        raise ValueError("there is no set of FRFs to merge; give at least one")
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
    merged.fill(h, lambda each: _as_quantity(each, quantity, each.h), "the FRF")
    coherence = averages = None
    if any(each.coherence is not None for each in sets):
        coherence = np.full((n_freq, *shape), np.nan)
        merged.fill(coherence, lambda each: each.coherence, "the coherence of")
    if any(each.averages is not None for each in sets):
        averages = np.full((1, *shape), np.nan)
        merged.fill(averages, lambda each: None if each.averages is None else each.averages[None], "the averages of")
    found = FrfSet(
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
    return replace(found, setups=merged.setups(quantity))


class _Merged:
    """Places of the FRFs of several sets in the merged set."""

    def __init__(self, responses: Sequence[Channel], excitations: Sequence[Channel], sets: Sequence[FrfSet]) -> None:
        self.responses, self.excitations, self.sets = responses, excitations, sets
        self.row_of = {channel: i for i, channel in enumerate(responses)}
        self.column_of = {channel: j for j, channel in enumerate(excitations)}
        self.origin: NDArray[np.intp] = np.full((len(responses), len(excitations)), -1)
        self.again: dict[tuple[int, int, int], tuple[int, int]] = {}

    def setups(self, quantity: str) -> SetUps | None:
        """Return the set-up of each FRF, after the FRFs are in place; None if all came from one."""
        names: list[str] = []
        of, found, values = np.full(self.origin.shape, -1), list[tuple[int, int, int]](), list[NDArray[np.complex128]]()
        for number, each in enumerate(self.sets):
            held = each.setups
            own = np.zeros(each.h.shape[1:], np.intp) if held is None else held.of
            rows, columns = (
                [self.row_of[one] for one in each.responses],
                [self.column_of[one] for one in each.excitations],
            )
            at = np.ix_(rows, columns)
            here = self.origin[at] == number
            again = [(i, j) for (_, _, which), (i, j) in self.again.items() if which == number]
            if not here.any() and not again:
                continue
            of[at] = np.where(here, len(names) + own, of[at])
            h = _as_quantity(each, quantity, each.h) if again else each.h
            found += [(rows[i], columns[j], len(names) + int(own[i, j])) for i, j in again]
            values += [h[:, i, j] for i, j in again]
            if held is not None and held.repeated is not None:
                found += [(rows[i], columns[j], len(names) + setup) for i, j, setup in held.repeats.tolist()]
                values += list(_as_quantity(each, quantity, held.repeated).T)
            names += [_name(each, self.sets)] if held is None else held.names
        if len(names) < 2:
            return None
        stated = [each.setups for each in self.sets if each.setups is not None]
        return SetUps(
            names,
            of,
            max((one.gain for one in stated if one.gain is not None), default=None),
            max((one.common_gain for one in stated), default=0.0),
            np.array(found, np.intp).reshape(-1, 3),
            np.stack(values, axis=1) if values else None,
        )

    def fill(self, target: _Values, values_of: Callable[[FrfSet], _Values | None], what: str) -> None:
        """Copy the values of each set into place; compare them with values that are there already."""
        origin: NDArray[np.intp] = np.full(target.shape[1:], -1)
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
                    if (*place, number) in self.again:  # data of a repeated FRF, which is not the one in place
                        continue
                    kept = target[:, *place]
                    if origin[place] < 0:
                        target[:, *place] = value
                        origin[place] = number
                    elif target.dtype.kind == "c" and _is_measured_again(kept, value):
                        self.again[(*place, number)] = i, j
                    elif not _is_copy(kept, value):
                        one, two = _name(self.sets[origin[place]], self.sets), _name(each, self.sets)
                        raise FileContentError(
                            f"{what} {response} / {excitation} in {one} and in {two} contradict each other: leave one "
                            "out"
                        )
        if target.dtype.kind == "c":
            self.origin = origin
            self._check_own()

    def _check_own(self) -> None:
        """Raise an error for a set of which every FRF was measured before: it is another test, not a set-up."""
        for row, column, number in self.again:
            if not (self.origin == number).any():
                one, two = _name(self.sets[self.origin[row, column]], self.sets), _name(self.sets[number], self.sets)
                raise FileContentError(
                    f"the FRF {self.responses[row]} / {self.excitations[column]} in {one} and in {two} contradict each "
                    f"other, and {two} adds none: these are two tests, or leave one out"
                )


def _is_copy(kept: _Values, value: _Values) -> bool:
    """Return whether two values are equal up to the digits of their files."""
    scale = np.nanmax(abs(kept)) if np.isfinite(kept).any() else 0.0
    return np.allclose(kept, value, rtol=0.0, atol=_SAME_VALUES * float(scale), equal_nan=True)


def _is_measured_again(kept: _Values, value: _Values) -> bool:
    """Return whether two FRFs may be one FRF measured twice."""
    if _is_copy(kept, value) or not (np.isfinite(kept).all() and np.isfinite(value).all()):
        return False
    size = np.maximum(abs(kept), abs(value))
    return float(np.median(abs(kept - value)[size > 0] / size[size > 0])) < _SAME_FRF


def _as_quantity(frfs: FrfSet, quantity: str, values: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return FRFs of a set, frequency first, differentiated in time as often as needed."""
    power = POWER_OF_I_OMEGA[quantity] - POWER_OF_I_OMEGA[frfs.quantity]
    if power <= 0:  # negative for a set without an FRF
        return values
    i_omega = 2j * np.pi * frfs.freq_hz.reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(values * i_omega**power)


def _coordinates(sets: Sequence[FrfSet]) -> dict[int, NDArray[np.float64]]:
    """Return coordinates of all nodes, which must be equal in all sets."""
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
