"""Validation of an identified joint: the assembly regenerated from its parts, compared with the measured one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.bands import Band, amplitude_error, frequency_error, has_peak, in_bands
from jointfrf.identification.result import Fit
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import (
    TINY,
    ComplexArray,
    FloatArray,
    as_dofs,
    as_frequency,
    as_lines,
    as_names,
    as_square,
)
from jointfrf.laws.law_joint import LawJoint
from jointfrf.substructuring.coupling import couple

__all__ = ["Validation", "compare_frfs", "validate"]


@dataclass(frozen=True, eq=False)
class Validation:
    """A regenerated assembly compared with the measured one.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Lines of the band, Hz.
    measured, regenerated : ndarray, shape (n_freq, m_r, m_f)
        FRFs on these lines, m/N; NaN if not measured.
    responses, forces : tuple of str
        Names of rows and columns.
    amplitude_error, frequency_error : ndarray, shape (m_r, m_f)
        Errors of the largest peak in the band, interpolated between the lines, percent (4.11), (4.12). The frequency
        error is NaN if the measured FRF has no peak in the band: it is largest on the first or last line.
    other_mode : ndarray of bool, shape (m_r, m_f)
        Whether the largest peak of the regenerated FRF is another mode: it has a nearer peak, and falls below the
        half-power level between both. The frequency error then compares two modes.
    difference : ndarray, shape (m_r, m_f)
        Root mean square over the band of regenerated minus measured FRF, over the root mean square of the measured FRF,
        percent; 100 means no agreement.
    """

    freq_hz: FloatArray
    measured: ComplexArray
    regenerated: ComplexArray
    responses: tuple[str, ...]
    forces: tuple[str, ...]
    amplitude_error: FloatArray
    frequency_error: FloatArray
    other_mode: NDArray[np.bool_]
    difference: FloatArray

    @property
    def is_measured(self) -> NDArray[np.bool_]:
        """Which FRFs are compared, shape (m_r, m_f)."""
        return np.isfinite(self.difference)

    def _numbers(self) -> dict[str, FloatArray]:
        return {
            "amplitude_error": self.amplitude_error,
            "frequency_error": self.frequency_error,
            "difference": self.difference,
        }

    def __str__(self) -> str:
        return "\n".join(self._text())

    def _text(self) -> Iterator[str]:
        n = int(self.is_measured.sum())
        yield f"regenerated and measured: {n} FRFs, {self.freq_hz[0]:g} to {self.freq_hz[-1]:g} Hz"
        yield "median, and largest, in percent: amplitude (4.11) and frequency (4.12) of the largest peak in the band,"
        yield "root mean square difference over the band"
        wide = max(map(len, (*self.responses, *self.forces, "response")))
        for word, names, axis in (("response", self.responses, 0), ("force", self.forces, 1)):
            yield ""
            yield f"{word:<{wide}}{'amplitude':>20}{'frequency':>20}{'difference':>20}"
            for i, name in enumerate(names):
                cells = [_cell(values.take([i], axis)) for values in self._numbers().values()]
                yield f"{name:<{wide}}" + "".join(f"{cell:>20}" for cell in cells)
        yield ""
        yield f"{'all':<{wide}}" + "".join(f"{_cell(values):>20}" for values in self._numbers().values())
        at = tuple(int(i) for i in np.unravel_index(int(np.nanargmax(self.difference)), self.difference.shape))
        if np.isnan(self.frequency_error[self.is_measured]).any():
            yield "-: no peak, the measured FRF is largest on the first or the last line of the band"
        if self.other_mode.any():
            one = np.argwhere(self.other_mode)[np.argmax(self.frequency_error[self.other_mode])]
            name = f"{self.responses[one[0]]} / {self.forces[one[1]]}"
            yield (
                f"in {int(self.other_mode.sum())} FRFs the largest peak is another mode than measured, first {name}: "
                f"the frequency error of {self.frequency_error[tuple(one)]:.3g} % compares two modes"
            )
        yield f"largest difference: {self.responses[at[0]]} / {self.forces[at[1]]}, {self.difference[at]:.3g} %"

    def to_dict(self) -> dict[str, Any]:
        """Return all except the FRFs, for JSON."""
        return {
            "band_hz": [self.freq_hz[0], self.freq_hz[-1]],
            "lines": self.freq_hz.size,
            "responses": list(self.responses),
            "forces": list(self.forces),
            "unit": "percent",
            **self._numbers(),
            "other_mode": self.other_mode,
            "median": {name: _of_finite(np.median, values) for name, values in self._numbers().items()},
            "largest": {name: _of_finite(np.max, values) for name, values in self._numbers().items()},
        }


def _of_finite(statistic: Callable[[FloatArray], float], values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(statistic(known)) if known.size else np.nan


def _cell(values: FloatArray) -> str:
    known = values[np.isfinite(values)]
    return f"{np.median(known):.3g} ({known.max():.3g})" if known.size else "-"


def validate(
    freq_hz: ArrayLike,
    measured: ArrayLike,
    h_a: ArrayLike,
    h_b: ArrayLike,
    joint: Fit | Joint | LawJoint,
    dofs_a: ArrayLike,
    dofs_b: ArrayLike,
    *,
    outputs: ArrayLike | None = None,
    inputs: ArrayLike | None = None,
    responses: Sequence[str] | None = None,
    forces: Sequence[str] | None = None,
    band: Band | None = None,
) -> Validation:
    """Regenerate an assembly with an identified joint, and compare it with the measured one, FRF by FRF.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz.
    measured : array_like, shape (n_freq, m_r, m_f)
        Measured FRFs of the assembly, m/N; NaN on all lines if one is missing. Use FRFs that did not enter the
        identification, else it is no test: other channels, or another assembly with the same joint.
    h_a, h_b : array_like, shapes (n_freq, n_a, n_a) and (n_freq, n_b, n_b)
        FRFs of the parts from models or measurements, m/N; FRFs of other parts if the joint is transferred to them.
    joint : Fit, Joint or LawJoint
        Result of `identify`, or its joint.
    dofs_a, dofs_b : array_like of int, shape (n_j,)
        Joint DOFs among the DOFs of the parts, counted from 0, see `couple`.
    outputs, inputs : array_like of int, optional
        DOFs of the rows and columns of `measured`, counted from 0 in the assembly (DOFs of A, then DOFs of B); all by
        default.
    responses, forces : sequence of str, optional
        Names of the rows and columns; by default their numbers in the assembly.
    band : (low, high), optional
        Band, Hz; all lines by default.

    Returns
    -------
    Validation
        Errors of each FRF.

    Raises
    ------
    ValueError
        Wrong shapes, DOFs, names or band; nothing measured; a stiffness of the fit is unbounded, which gives no joint.

    See Also
    --------
    couple : FRFs of an assembly with a joint.
    amplitude_error : error (4.11) of one FRF.
    frequency_error : error (4.12) of one FRF.

    Notes
    -----
    The errors (4.11), (4.12) compare the largest peaks in the band, between the lines as `peak` finds them. They do not
    show that another peak is missing: the difference over the band does.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    >>> b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    >>> truth = jf.couple(a, b, jf.Joint([2000.0], [3.0]), [1], [0], freq_hz=freq)
    >>> found = jf.identify(freq, jf.pollute(truth[:, 1:3, 1:3], 0.05, seed=2), dofs=["x"])
    >>> other = jf.validate(freq, truth[:, :1, 3:], a, b, found, [1], [0], outputs=[0], inputs=[3])
    >>> bool(other.difference[0, 0] < 2), bool(other.amplitude_error[0, 0] < 2)
    (True, True)
    """
    freq = as_frequency(freq_hz)
    whole = as_lines("measured", measured, n_freq=freq.size)
    one, other = as_square("h_a", h_a), as_square("h_b", h_b)
    if isinstance(joint, Fit):
        joint = joint.joint
    if not isinstance(joint, Joint | LawJoint):
        raise TypeError(f"joint must be a Fit, Joint or LawJoint, not {type(joint).__name__}")
    n = one.shape[1] + other.shape[1]
    rows, columns = (
        np.arange(n) if own is None else as_dofs(name, own, n) - 1
        for name, own in (("outputs", outputs), ("inputs", inputs))
    )
    names = (list(map(str, side)) if own is None else own for own, side in ((responses, rows), (forces, columns)))
    h = couple(one, other, joint, dofs_a, dofs_b, freq_hz=freq)
    return compare_frfs(freq, whole, h[:, rows][:, :, columns], *names, band=band)


def compare_frfs(
    freq_hz: FloatArray,
    measured: ComplexArray,
    regenerated: ComplexArray,
    responses: Sequence[str],
    forces: Sequence[str],
    *,
    band: Band | None = None,
) -> Validation:
    """Compare regenerated FRFs, shape (n_freq, m_r, m_f), with measured ones; see `validate`."""
    if measured.shape != regenerated.shape:
        raise ValueError(f"measured has shape {measured.shape}, the regenerated FRFs {regenerated.shape}")
    rows, columns = as_names("responses", responses), as_names("forces", forces)
    if (len(rows), len(columns)) != measured.shape[1:]:
        raise ValueError(
            f"responses and forces must name {measured.shape[1]} rows and {measured.shape[2]} columns of measured"
        )
    inside = np.ones(freq_hz.size, bool) if band is None else in_bands(freq_hz, [band])
    freq, own, made = freq_hz[inside], measured[inside], regenerated[inside]
    missing = np.asarray(np.isnan(own).all(axis=0))
    if missing.all() or not freq.size:
        raise ValueError("measured contains no FRF in the band")
    if not np.isfinite(own[:, ~missing]).all():
        raise ValueError("measured contains NaN or Inf on some lines; omit these lines")
    size = np.sqrt((abs(own) ** 2).mean(axis=0))
    difference = 100 * np.sqrt((abs(made - own) ** 2).mean(axis=0)) / np.maximum(size, TINY)
    errors, changed = np.full((2, *missing.shape), np.nan), np.zeros(missing.shape, bool)
    for i, j in zip(*np.nonzero(~missing), strict=True):
        if size[i, j] > 0:
            pair = own[:, i, j], made[:, i, j]
            errors[0, i, j] = amplitude_error(*pair, freq, refine=True)
            if has_peak(pair[0], freq, (freq.min(), freq.max())):
                errors[1, i, j] = frequency_error(*pair, freq, refine=True)
                changed[i, j] = _is_other_mode(*pair, freq)
    return Validation(freq, own, made, tuple(rows), tuple(columns), errors[0], errors[1], changed, difference)


def _is_other_mode(measured: ComplexArray, regenerated: ComplexArray, freq_hz: FloatArray) -> bool:
    """Return whether the largest peak of a regenerated FRF is not its peak nearest to the largest measured one.

    Peaks are of two modes if the FRF between them is below 1/sqrt(2) of the smaller one: the half-power level.
    """
    order = np.argsort(freq_hz, kind="stable")
    size, freq = abs(regenerated[order]), freq_hz[order]
    aim = freq[np.argmax(abs(measured[order]))]
    inner = np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:])) + 1
    largest = int(np.argmax(size))
    for nearest in inner[abs(freq[inner] - aim) < abs(freq[largest] - aim)].tolist():
        between = size[min(nearest, largest) : max(nearest, largest) + 1]
        if between.min() < size[nearest] / np.sqrt(2):
            return True
    return False
