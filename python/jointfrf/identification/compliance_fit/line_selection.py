"""Which lines a fit uses, with which weights, and how it continues from one linearisation to the next."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.noise_estimate import gamma_noise
from jointfrf.identification.compliance_fit.linearised import DofGroup
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["NOISE_LIMIT", "EveryLine", "LineSelection", "Progress", "ReliableLines"]

#: A line is left out where the relative noise of gamma_jk, the block that is inverted, exceeds this: first-order
#: propagation ends there.
NOISE_LIMIT = 0.35
#: From this linearisation on, `EveryLine` corrects the FRFs by half: lines with little more signal than noise would
#: oscillate for long.
_FULL_STEPS = 4
#: A fit oscillates that then still changes by more standard errors than this, and by more than this share of the change
#: before.
_OSCILLATION, _DECREASE = 5.0, 0.25
#: For so many linearisations `ReliableLines` reduces the weight of lines where the relative noise of gamma_jk exceeds
#: this ...
_REDUCED_STEPS = 4
_LOW_NOISE = 0.1
#: ... and then leaves out those whose FRFs still change by more than this share of their noise.
_UNSETTLED = 0.2


class Progress(NamedTuple):
    """What one linearisation led to; over realisations r.

    Attributes
    ----------
    step : int
        Number of the linearisation, from 1.
    before, corrected : ndarray, shape (r, n_freq, m, m)
        FRFs about which was linearised, and as the residual corrects them.
    spread : ndarray, shape (r or 1, n_freq, m, m)
        Variance of the measured FRFs for unit level.
    squares, equations : ndarray, shape (r,)
        Weighted squares of the residual, and the number of complex equations.
    change : ndarray, shape (r,)
        Largest change of a parameter, in its standard errors for unit level.
    change_in_errors : ndarray, shape (r,)
        The same in standard errors.
    converged : ndarray of bool, shape (r,)
        Whether that is within the tolerance.
    """

    step: int
    before: ComplexArray
    corrected: ComplexArray
    spread: FloatArray
    squares: FloatArray
    equations: FloatArray
    change: FloatArray
    change_in_errors: FloatArray
    converged: NDArray[np.bool_]


class LineSelection(Protocol):
    """How the iteration treats the lines."""

    def weight(self, step: int) -> FloatArray | None:
        """Return the weights of the lines, shape (r, n_freq), 0 to 1; None where all are 1."""
        ...

    def may_restart(self, step: int) -> bool:
        """Whether parameters that diverged are estimated anew."""
        ...

    def next_frfs(self, progress: Progress) -> ComplexArray:
        """Return the FRFs about which is linearised next."""
        ...

    def is_finished(self, progress: Progress) -> bool:
        """Whether no realisation needs another linearisation."""
        ...


class EveryLine:
    """All lines with their full weight; it notes which realisations oscillate.

    Attributes
    ----------
    oscillating : ndarray of bool, shape (r,)
    """

    def __init__(self, group: DofGroup) -> None:
        self.oscillating = np.zeros(group.r, bool)
        self._last = np.full(group.r, np.inf)

    def weight(self, step: int) -> FloatArray | None:
        """All lines count."""
        return None

    def may_restart(self, step: int) -> bool:
        """Never."""
        return False

    def next_frfs(self, progress: Progress) -> ComplexArray:
        """Take the corrected FRFs, later the mean with those before."""
        if progress.step == _FULL_STEPS:
            much, slowly = progress.change_in_errors > _OSCILLATION, progress.change > _DECREASE * self._last
            self.oscillating = much & slowly & ~progress.converged
        self._last = progress.change
        return progress.corrected if progress.step < _FULL_STEPS else (progress.corrected + progress.before) / 2

    def is_finished(self, progress: Progress) -> bool:
        """Whether each realisation has converged or oscillates."""
        return progress.step > 1 and bool((progress.converged | self.oscillating).all())


class ReliableLines:
    """Reduced weight for noisy lines until the parameters are known, then without those that do not settle.

    A line on which noise hides the joint contradicts the others with a small variance, as long as it is linearised
    about FRFs that do not fit the joint.
    """

    def __init__(self, group: DofGroup, noise: FloatArray) -> None:
        ratio = gamma_noise(group.data.measured, group.data.transform, noise, group.data.variance)
        self._noise, self._p = noise, len(group.model.basis.parameters)
        self._reduced: FloatArray = 1 / (1 + (ratio / _LOW_NOISE) ** 8)
        self._settled = ratio <= NOISE_LIMIT

    def weight(self, step: int) -> FloatArray | None:
        """Little for noisy lines first, then 1 on the lines kept and 0 on the others."""
        return self._reduced if step <= _REDUCED_STEPS else self._settled.astype(float)

    def may_restart(self, step: int) -> bool:
        """As long as weights are reduced."""
        return step <= _REDUCED_STEPS

    def next_frfs(self, progress: Progress) -> ComplexArray:
        """Take the corrected FRFs, and leave out lines on which they do not settle, unless too few would remain."""
        if progress.step >= _REDUCED_STEPS:
            by_residual = np.sqrt(progress.squares / np.maximum(progress.equations - self._p / 2, 1))
            level = np.maximum(self._noise, by_residual)
            change = np.sqrt((abs(progress.corrected - progress.before) ** 2 / progress.spread).mean(axis=(2, 3)))
            settled = self._settled & (change <= _UNSETTLED * level[:, None])
            enough = np.count_nonzero(settled, axis=1) >= max(2, self._p)
            self._settled = np.where(enough[:, None], settled, self._settled)
        return progress.corrected

    def is_finished(self, progress: Progress) -> bool:
        """Whether each realisation has converged on the lines kept."""
        return progress.step > _REDUCED_STEPS + 1 and bool(progress.converged.all())
