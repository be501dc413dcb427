"""FRFs that stand in a file one by one, made a matrix."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit
from jointfrf.frf.frf_set import Channel
from jointfrf.frf.merge import same_lines
from jointfrf.io.arrays import FrfArrays

__all__ = ["LooseFunction", "arrays_of_functions"]


class LooseFunction(NamedTuple):
    """One FRF, or with real values the coherence of one."""

    response: Channel
    excitation: Channel
    freq_hz: NDArray[np.float64]
    values: NDArray[Any]
    is_coherence: bool = False
    unit: str = ""
    quantity: str = ""

    def __str__(self) -> str:
        return f"{'coherence' if self.is_coherence else 'FRF'} {self.response} / {self.excitation}"


def arrays_of_functions(functions: Sequence[LooseFunction], where: str, limit: ReadLimit) -> FrfArrays:
    """Put functions into matrices.

    Raises
    ------
    FileContentError
        There is no FRF; functions differ in frequency lines, units or quantities; one is there twice; the matrix of
        all channels is beyond the limit.
    """
    frfs = [each for each in functions if not each.is_coherence]
    if not frfs:
        raise FileContentError(f"{where} holds no FRF")
    first = frfs[0]
    responses = tuple(dict.fromkeys(each.response for each in frfs))
    excitations = tuple(dict.fromkeys(each.excitation for each in frfs))
    row_of = {channel: i for i, channel in enumerate(responses)}
    column_of = {channel: j for j, channel in enumerate(excitations)}
    shape = (first.freq_hz.size, len(responses), len(excitations))
    limit.take(3 * 8 * shape[0] * shape[1] * shape[2])
    h, coherence = np.full(shape, np.nan + 0j), np.full(shape, np.nan)
    seen: set[tuple[Channel, Channel, bool]] = set()
    for each in functions:
        if each.values.shape != each.freq_hz.shape:
            raise FileContentError(f"{where}: {each} has {each.values.size} values at {each.freq_hz.size} lines")
        if not same_lines(each.freq_hz, first.freq_hz):
            raise FileContentError(f"{where}: {first} and {each} have different frequency lines")
        if (*each[:2], each.is_coherence) in seen:
            raise FileContentError(f"{where} holds {each} twice")
        seen.add((*each[:2], each.is_coherence))
        if each.is_coherence:
            if each.response in row_of and each.excitation in column_of:
                coherence[:, row_of[each.response], column_of[each.excitation]] = each.values
            continue
        if (each.unit, each.quantity) != (first.unit, first.quantity):
            said = [" ".join(filter(None, (one.quantity, f"[{one.unit or 'no unit'}]"))) for one in (first, each)]
            raise FileContentError(f"{where}: {first} is {said[0]}, {each} is {said[1]}: they must be alike")
        h[:, row_of[each.response], column_of[each.excitation]] = each.values
    known = None if np.isnan(coherence).all() else coherence
    return FrfArrays(first.freq_hz, h, "freq,out,in", responses, excitations, first.quantity, first.unit, known)
