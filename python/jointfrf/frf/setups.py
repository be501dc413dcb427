"""Set-up of each FRF of a test, FRFs that were measured in several set-ups, and calibration of their gains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_array,
    as_names,
    as_not_negative,
)

__all__ = ["SetUps"]


@dataclass(frozen=True, eq=False)
class SetUps:
    """Set-ups of one test: FRFs that were measured with the same sensors at the same places, on the same day.

    FRFs of one set-up share its errors: gain and delay of sensors and hammer. `merge_frfs` keeps the set-ups, and
    `FrfSet.setups_between` returns them for `identify` and `identify_model`.

    Parameters
    ----------
    names : sequence of str
        Names of the set-ups, such as their files.
    of : array_like of int, shape (n_responses, n_excitations)
        Number of the set-up of each FRF, counted from 0; -1 if there is no FRF.
    gain : float, optional
        Relative standard deviation of the gain of one set-up, by its calibration: 0.01 for 1 %. By default it is
        estimated from the differences of set-ups.
    common_gain : float
        Relative standard deviation of a gain which all set-ups share: the same hammer, the same calibrator; default 0.
        No FRF shows it.
    repeats : array_like of int, shape (n_repeats, 3)
        Response, excitation and set-up of FRFs that were measured in another set-up, too; none by default.
    repeated : array_like of complex, shape (n_freq, n_repeats)
        Values of the repeated FRFs, in the quantity of the FRFs.

    Raises
    ------
    ValueError, TypeError
        Numbers of set-ups or of FRFs that do not exist, wrong shapes, a gain that is negative.

    Examples
    --------
    A roving hammer, two columns in each set-up:

    >>> import jointfrf as jf
    >>> setups = jf.SetUps(["monday.uff", "tuesday.uff"], [[0, 0, 1, 1]] * 4, common_gain=0.01)
    >>> setups.names[setups.of[2, 3]]
    'tuesday.uff'
    """

    names: Sequence[str]
    of: NDArray[np.intp]
    gain: float | None = None
    common_gain: float = 0.0
    repeats: NDArray[np.intp] = field(default_factory=lambda: np.zeros((0, 3), np.intp))
    repeated: ComplexArray | None = None

    def __post_init__(self) -> None:
        names, of = as_names("names", self.names), _whole_numbers("of", self.of, 2)
        repeats = _whole_numbers("repeats", self.repeats, 2)
        if not names:
            raise ValueError("names must name at least one set-up")
        if of.size and not (of.min() >= -1 and of.max() < len(names)):
            raise ValueError(f"of must contain numbers of {len(names)} set-ups from 0, or -1 where there is no FRF")
        if repeats.shape[1] != 3:
            raise ValueError(
                f"repeats must have three columns, response, excitation and set-up, not {repeats.shape[1]}"
            )
        limits = np.array([*of.shape, len(names)])
        if (repeats < 0).any() or (repeats >= limits).any():
            raise ValueError("repeats must contain numbers of responses, excitations and set-ups that there are")
        if (self.repeated is None) != (len(repeats) == 0):
            raise ValueError("repeats and repeated go together: places and values of FRFs measured again")
        repeated = None
        if self.repeated is not None:
            repeated = as_array("repeated", self.repeated)
            if repeated.dtype.kind not in "biufc" or repeated.ndim != 2 or repeated.shape[1] != len(repeats):
                raise ValueError(f"repeated must contain numbers in {len(repeats)} columns, one for each repeat")
            repeated = np.ascontiguousarray(repeated, np.complex128)
        object.__setattr__(self, "names", names)
        object.__setattr__(self, "of", of)
        object.__setattr__(self, "repeats", repeats)
        object.__setattr__(self, "repeated", repeated)
        if self.gain is not None:
            object.__setattr__(self, "gain", as_not_negative("gain", self.gain))
        object.__setattr__(self, "common_gain", as_not_negative("common_gain", self.common_gain))

    def check_fits(self, shape: tuple[int, ...], name: str = "setups") -> None:
        """Raise a ValueError if they do not match FRFs of shape (n_freq, n_responses, n_excitations)."""
        if self.of.shape != tuple(shape[1:]):
            raise ValueError(f"{name} is of {_by(self.of.shape)} FRFs, not {_by(shape[1:])}")
        if self.repeated is not None and len(self.repeated) != shape[0]:
            raise ValueError(f"{name}: repeated has {len(self.repeated)} lines, not {shape[0]}")

    def on_lines(self, kept: NDArray[np.bool_] | NDArray[np.intp]) -> SetUps:
        """Return the same for some of the lines."""
        return self if self.repeated is None else replace(self, repeated=self.repeated[kept])

    def times(self, factor: ComplexArray | FloatArray | float) -> SetUps:
        """Return the same with repeated FRFs multiplied by a factor of each line, shape (n_freq, 1), or of all."""
        return self if self.repeated is None else replace(self, repeated=self.repeated * factor)

    def between(
        self, rows: NDArray[np.intp], columns: NDArray[np.intp], signs: FloatArray, known: NDArray[np.bool_]
    ) -> SetUps:
        """Return the same for FRFs at these places, shape (n_out, n_in) each, with their signs, if in `known`."""
        found, values = [], []
        for number, (row, column, setup) in enumerate(self.repeats.tolist()):
            for i, j in np.argwhere((rows == row) & (columns == column) & known).tolist():
                assert self.repeated is not None
                found.append((i, j, setup))
                values.append(signs[i, j] * self.repeated[:, number])
        return replace(
            self,
            of=np.where(known, self.of[rows, columns], -1),
            repeats=np.array(found, np.intp).reshape(-1, 3),
            repeated=np.stack(values, axis=1) if values else None,
        )

    @property
    def counts(self) -> NDArray[np.intp]:
        """Number of FRFs of each set-up."""
        return np.bincount(self.of[self.of >= 0], minlength=len(self.names)).astype(np.intp)

    def __repr__(self) -> str:
        return f"<SetUps {', '.join(f'{name}: {count}' for name, count in zip(self.names, self.counts, strict=True))}>"


def _whole_numbers(name: str, values: object, axes: int) -> NDArray[np.intp]:
    found = as_array(name, values)  # type: ignore[arg-type]
    if found.ndim != axes or found.dtype.kind not in "iuf":
        raise ValueError(f"{name} must contain whole numbers in rows and columns")
    if not np.isfinite(found).all() or (found != np.round(found)).any() or abs(found).max(initial=0) > 2**31:
        raise ValueError(f"{name} must contain whole numbers")
    return found.astype(np.intp)


def _by(shape: tuple[int, ...]) -> str:
    return " x ".join(map(str, shape))
