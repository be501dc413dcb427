"""Uncertainty of a fit of an assembly beyond independent noise: scatter of its gradient, channels a little off."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.calibration import CalibrationErrors, ErrorKind
from jointfrf.identification.calibration import CalibrationSpread, Effects, effects_by_function
from jointfrf.identification.minimise import Minimum, inverse_information
from jointfrf.identification.model.likelihood import Likelihood
from jointfrf.identification.scatter import (
    BLOCKS,
    LineParts,
    Scatter,
    Spread,
    block_members,
    scatter_of,
    spread_of_scatters,
)
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ModelGradient"]

#: The FRFs do not hold a logarithm, or a multiple of a value, with a standard deviation above this.
_HELD = 100.0


@dataclass(frozen=True)
class ModelGradient:
    """What each FRF adds to the normal equations on each line, at a minimum.

    Attributes
    ----------
    information : ndarray, shape (p, p)
        Of the coordinates, priors included.
    inflation : float
        Lines that carry the noise of one independent line: 1 over it is the mean square of a real residual.
    slopes : ndarray, shape (p, n_freq, n_o, n_i)
        Derivatives of the weighted FRFs by the coordinates.
    residual : ndarray, shape (n_freq, n_o, n_i)
        Weighted.
    of_errors : ndarray, shape (p, n_freq, n_o, n_i)
        Change of the gradient (its real part) by a relative error of 1 of each FRF.
    squares : ndarray, shape (n_freq, n_o, n_i)
        Of the weighted residual that such an error leaves.
    priors : LineParts
        Of each prior.
    held : ndarray of bool, shape (p,)
        Coordinates that the FRFs hold: what scatters along others is rounding.
    """

    information: FloatArray
    inflation: float
    slopes: ComplexArray
    residual: ComplexArray
    of_errors: ComplexArray
    squares: FloatArray
    priors: LineParts
    held: NDArray[np.bool_]

    @classmethod
    def of(cls, likelihood: Likelihood, minimum: Minimum, inflation: float) -> ModelGradient:
        """Return the parts at a minimum of a likelihood, of the parameters that are shown; others are eliminated."""
        vector, x, n = likelihood.vector, minimum.x, likelihood.vector.n_shown
        y, slopes = likelihood.prediction.linearised(vector, vector.to_values(x))
        whole = minimum.information
        kept = np.eye(n, x.size)
        if n < x.size:
            kept[:, n:] = -whole[:n, n:] @ inverse_information(whole[n:, n:])
        # A prediction may lend its derivatives.
        slopes = np.tensordot(kept * vector.slope(x), slopes, 1)
        slopes = likelihood.weighted(slopes)
        pulled = kept @ vector.pull_slopes(x).T
        priors = LineParts(-(pulled * vector.pulls(x)).T, pulled.T[:, :, None] * pulled.T[:, None])
        residual = likelihood.weighted(likelihood.difference(y))
        of_errors = likelihood.carried_back(slopes).conj() * y
        squares = np.asarray(abs(y) ** 2 * likelihood.precision, np.float64)
        information = kept @ whole @ kept.T
        size = np.where(vector.is_log, 1, np.maximum(abs(x), 1))[:n]
        held = np.diagonal(information) * size**2 > _HELD**-2
        return cls(information, inflation, slopes, residual, of_errors, squares, priors, held)

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the coordinates, from noise as known, shape (p, p)."""
        return inverse_information(self.information, open_ends=True)

    @cached_property
    def _of_held(self) -> FloatArray:
        """The information on what is held."""
        return self.information[np.ix_(self.held, self.held)]

    def _parts(self, axis: int) -> LineParts:
        """Return the parts of each line (axis 1), response (2) or force (3), and of each prior, in what is held."""
        slopes = np.ascontiguousarray(np.moveaxis(self.slopes, axis, 0))
        flat = slopes.reshape(*slopes.shape[:2], -1).view(np.float64)
        residual = np.ascontiguousarray(np.moveaxis(self.residual, axis - 1, 0)).reshape(len(flat), -1)
        gradient = (flat @ residual.view(np.float64)[:, :, None])[..., 0]
        gradient = np.concatenate([gradient, self.priors.gradient])
        information = np.concatenate([flat @ flat.swapaxes(1, 2), self.priors.information])
        return LineParts(gradient[:, self.held], information[:, self.held][:, :, self.held])

    def spread(self, by_noise: float, beside: FloatArray | float = 0.0, motion: FloatArray | None = None) -> Spread:
        """Return variance factors by the scatter between lines, blocks, responses and forces.

        Parameters
        ----------
        by_noise : float
            Variance factor by the residual.
        beside : ndarray, shape (p,)
            Variance that smooth errors of channels add, likewise.
        motion : ndarray, shape (n_freq,), optional
            Size of the motion on each line, if the FRFs depend on amplitude.
        """
        _, n_freq, n_o, n_i = self.slopes.shape
        lines = self._parts(1)
        of_lines, of_blocks, between = self._scatter(lines, self.inflation), *(Scatter.none(len(self.slopes)),) * 2
        share = np.einsum("lpp->lp", lines.information[:n_freq]) / np.diagonal(self._of_held)
        seen = np.flatnonzero(share.any(axis=1))
        if seen.size >= 2 * BLOCKS:
            of_blocks = self._scatter(self._grouped(lines, block_members(share, seen)))
            if motion is not None:
                by_motion = seen[np.argsort(motion[seen], kind="stable")]
                between = self._scatter(self._grouped(lines, block_members(share, by_motion)))
        hits = [self._scatter(self._parts(axis)) for axis, count in ((2, n_o), (3, n_i)) if count > 1]
        spread = spread_of_scatters(np.full(self.held.size, by_noise), of_lines, of_blocks, hits, beside)
        return spread if motion is None else spread.between_amplitudes(between)

    def _grouped(self, lines: LineParts, member: FloatArray) -> LineParts:
        """Return groups of lines, by which lines are in which, shape (n_groups, n_freq), with priors as they are."""
        n_priors = len(self.priors.gradient)
        whole = np.zeros((len(member) + n_priors, member.shape[1] + n_priors))
        whole[: len(member), : member.shape[1]], whole[len(member) :, member.shape[1] :] = member, np.eye(n_priors)
        return LineParts(whole @ lines.gradient, np.tensordot(whole, lines.information, 1))

    def _scatter(self, parts: LineParts, correlated: float = 1.0) -> Scatter:
        found = Scatter.none(self.held.size)
        if self.held.any():
            variance, degrees = scatter_of(self._of_held, [parts])
            with np.errstate(divide="ignore", invalid="ignore"):
                known = np.diagonal(inverse_information(self._of_held, open_ends=True))
                found.factor[self.held] = correlated * variance / known
            found.degrees[self.held] = degrees / correlated
        return found

    def calibration(self, errors: CalibrationErrors, freq_hz: FloatArray) -> CalibrationSpread:
        """Return what errors of FRFs that are smooth over frequency add to the coordinates."""
        functions = errors.functions(freq_hz)
        gradient, squares = self.of_errors, self.squares * (self.inflation / 2)

        def effects(kind: ErrorKind) -> Effects:
            masks = errors.masks(kind, squares.shape[1:])
            each = [
                (gradient[:, :, mask].sum(axis=2).T, np.asarray(squares[:, mask].sum(axis=1), np.float64))
                for mask in masks
            ]
            return effects_by_function(each, functions, self.covariance)

        return CalibrationSpread.of(errors, np.eye(len(gradient)), effects)
