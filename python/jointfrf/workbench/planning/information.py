"""Fisher information of FRFs before the test, from models of the parts and an expected joint."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from jointfrf.frf.bands import Band
from jointfrf.frf.stated_noise import StatedNoise
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.model.evidence import GAIN, ErrorGroup, error_terms, expected_covariance
from jointfrf.identification.model.prediction import Prediction, parameter_vector
from jointfrf.identification.model.prepare import Channels
from jointfrf.identification.parameters import FitParameter, ParameterVector
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_not_negative, as_positive

__all__ = ["ErrorInformation", "FrfInformation", "PlannedTest", "expected_noise", "narrowest_band"]

#: Bytes of derivatives that are in memory at once.
_BYTES = 256 * 2**20
#: Relative standard deviation of the widest prior. It keeps the information of a single FRF, which may not determine
#: all parameters, invertible.
_WIDEST = 1e3
#: FRFs below this share of the largest FRF are rounding: they are zero by symmetry and carry no information.
_ROUNDING = 1e-10
#: Share of the information that the band to be measured contains.
_BAND = 0.9


def expected_noise(noise: float | StatedNoise, floor: float, averages: float) -> StatedNoise:
    """Return the noise of the mean of averages, or raise ValueError if the numbers are no noise."""
    constant, count = as_not_negative("floor", floor), as_positive("averages", averages)
    if isinstance(noise, StatedNoise):
        if constant:
            raise ValueError(f"floor {constant:g} and floors of noise are both given; leave out floor")
        return noise.of_mean(count)
    level = as_not_negative("noise", noise)
    if not level + constant:
        raise ValueError("noise and floor are both zero; give one of them")
    return StatedNoise(level, accelerance=constant).of_mean(count)


def narrowest_band(freq_hz: FloatArray, share: FloatArray) -> Band:
    """Return the narrowest band that contains 90 % of the information of all lines."""
    known = np.concatenate([[0.0], np.cumsum(share)])
    wanted = _BAND * known[-1] * (1 - 1e-12)  # rounding must not make the whole band too small
    ends = np.searchsorted(known, known[:-1] + wanted)
    starts = np.flatnonzero(ends < len(known))
    at = starts[np.argmin(freq_hz[ends[starts] - 1] - freq_hz[starts])]
    return float(freq_hz[at]), float(freq_hz[ends[at] - 1])


@dataclass(frozen=True)
class FrfInformation:
    """Fisher information of relative changes of the parameters.

    Attributes
    ----------
    parameters : tuple of FitParameter
        Unknown parameters, those in the joint first.
    of_frf : ndarray, shape (n_o, n_i, p, p)
        Information of each FRF over all lines.
    of_line : ndarray, shape (n_freq, p, p)
        Information of all FRFs on each line.
    prior : ndarray, shape (p, p)
        Information of the priors.
    pull : ndarray, shape (n_o, n_i, p), or None
        Score of the difference of FRFs between the measured and the modelled assembly.
    """

    parameters: tuple[FitParameter, ...]
    of_frf: FloatArray
    of_line: FloatArray
    prior: FloatArray
    pull: FloatArray | None = None

    @cached_property
    def scale(self) -> FloatArray:
        """Values of the parameters, the unit of the relative changes."""
        return _scale(self.parameters)

    def covariance(self) -> FloatArray:
        """Return the covariance of relative errors if all FRFs are measured."""
        found: FloatArray = np.linalg.inv(self.prior + self.of_frf.sum(axis=(0, 1)))
        return found

    def shares(self, each: FloatArray) -> FloatArray:
        """Return the share of the information on each parameter that each part contributes, shape (..., p).

        With the covariance V and the information J of a part, the share is (V J V)_ii / V_ii. Shares of all parts and
        of the prior add up to 1. An increase of J by 1 % lowers the variance by a hundredth of the share.
        """
        covariance = self.covariance()
        found: FloatArray = np.einsum("ia,...ab,bi->...i", covariance, each, covariance) / np.diagonal(covariance)
        return found


def _scale(parameters: tuple[FitParameter, ...]) -> FloatArray:
    return np.array([abs(one.value) or one.std or 1.0 for one in parameters])


@dataclass(frozen=True)
class ErrorInformation:
    """Fisher information of relative changes of the parameters, and of errors of the models.

    Attributes
    ----------
    of_frf : ndarray, shape (n_o, n_i, p + e, p + e)
        Information of each FRF over all lines, error terms in units of their deviations at a level of 1.
    prior : ndarray, shape (p, p)
        Information of the priors.
    groups : list of ErrorGroup
        Errors of the models and of the gain, in the order of the error terms.
    """

    of_frf: FloatArray
    prior: FloatArray
    groups: list[ErrorGroup]

    def covariance(self, responses: Sequence[int], forces: Sequence[int]) -> FloatArray:
        """Return the covariance of relative errors that a fit of these FRFs is expected to state."""
        own = self.of_frf[np.ix_(responses, forces)].sum(axis=(0, 1))
        return expected_covariance(own, self.prior, self.groups)


@dataclass(frozen=True)
class PlannedTest:
    """Store the expected assembly, and lines and noise of a test.

    Attributes
    ----------
    assembly : Assembly
        Expected assembly.
    freq_hz : ndarray, shape (n_freq,)
        Lines above 0 Hz.
    noise : StatedNoise
        Noise of the mean of averages.
    fixed : tuple of str
        Names of known parameters of the joint.
    """

    assembly: Assembly
    freq_hz: FloatArray
    noise: StatedNoise
    fixed: tuple[str, ...]

    def information(self, channels: Channels, measured: Assembly | None = None) -> FrfInformation:
        """Return the information of all FRFs between these channels.

        Parameters
        ----------
        channels : Channels
            Responses and forces of the FRFs.
        measured : Assembly, optional
            Assembly that the test measures, such as one with the masses of the sensors; default `assembly`.

        Raises
        ------
        SingularLineError
            An undamped assembly resonates at a line.
        """
        vector = self.vector(channels)
        p, per_line = vector.free.size, len(channels.responses) * len(channels.forces)
        n = max(1, _BYTES // (16 * max(p, 1) * per_line))
        parts = [
            self._part(vector, channels, self.freq_hz[i : i + n], measured) for i in range(0, len(self.freq_hz), n)
        ]
        total = parts[0]
        for one in parts[1:]:
            pull = None if total.pull is None or one.pull is None else total.pull + one.pull
            of_line = np.concatenate([total.of_line, one.of_line])
            total = replace(total, of_frf=total.of_frf + one.of_frf, of_line=of_line, pull=pull)
        return total

    @property
    def has_errors(self) -> bool:
        """Whether a fit allows for errors without a parameter: errors of models, or of a gain of all FRFs."""
        return any(part.is_uncertain for part in self.assembly.parts.values())

    def error_information(self, channels: Channels) -> ErrorInformation:
        """Return the information of all FRFs between these channels on parameters and errors of models and gain."""
        vector, shape = self.vector(channels), (len(channels.responses), len(channels.forces))
        prediction = Prediction(self.assembly, self.freq_hz, channels.responses, channels.forces)
        longer, groups = error_terms(prediction, vector, shape, GAIN if self.has_errors else 0.0)
        weight = np.concatenate([np.zeros(0), *(one.weight for one in groups)])
        y, slopes = prediction.linearised(longer, longer.values)
        slopes *= np.concatenate([_scale(vector.fitted), weight])[:, None, None, None] * self._weight(self.freq_hz, y)
        real = np.ascontiguousarray(slopes.transpose(2, 3, 0, 1)).view(np.float64)  # o, i, terms, re and im of lines
        return ErrorInformation(real @ real.swapaxes(2, 3), self._prior(vector), groups)

    def _weight(self, freq_hz: FloatArray, y: ComplexArray) -> FloatArray:
        """Return 1 over the standard deviation of real and imaginary part of each FRF, or 0 if the FRF is zero."""
        deviation = np.sqrt(self.noise.variance(freq_hz, y) / 2)
        shown = abs(y).max(axis=0) > _ROUNDING * abs(y).max()
        found: FloatArray = 1 / np.where(shown & (deviation > 0), deviation, np.inf)
        return found

    @staticmethod
    def _prior(vector: ParameterVector) -> FloatArray:
        """Return the information of the priors on relative changes of the parameters."""
        x, scale = vector.to_coordinates(vector.values), _scale(vector.fitted)
        to_scale = scale / vector.slope(x)
        found: FloatArray = vector.prior_information(x) * np.outer(to_scale, to_scale)
        return found + np.eye(len(scale)) / _WIDEST**2

    def vector(self, channels: Channels) -> ParameterVector:
        """Return all parameters, gains of the channels included."""
        prediction = Prediction(self.assembly, self.freq_hz[:1], channels.responses[:1], channels.forces[:1])
        found = parameter_vector(self.assembly, channels.gains(), self.fixed, prediction.joint_stiffness())
        # If the spread of joints is unknown, each joint has its own parameters.
        known = tuple(one for one in found.means if one.relative is not None)
        unknown = {one.mean for one in found.means} - {one.mean for one in known}
        values = found.with_means(found.values)
        return ParameterVector(
            tuple(
                one._replace(is_free=one.is_free and i not in unknown, value=float(values[i]))
                for i, one in enumerate(found.all)
            ),
            known,
        )

    def _part(
        self, vector: ParameterVector, channels: Channels, freq_hz: FloatArray, measured: Assembly | None
    ) -> FrfInformation:
        prediction = Prediction(self.assembly, freq_hz, channels.responses, channels.forces)
        y, slopes = prediction.linearised(vector, vector.values)
        weight = self._weight(freq_hz, y)
        slopes *= _scale(vector.fitted)[:, None, None, None] * weight
        real = np.moveaxis(slopes, 0, -1).copy().view(np.float64).reshape(*y.shape, -1, 2)  # lines, o, i, p, re and im
        of_frf = np.einsum("loipr,loiqr->oipq", real, real, optimize=True)
        of_line = np.einsum("loipr,loiqr->lpq", real, real, optimize=True)
        pull = None
        if measured is not None:
            change = (measured.receptance(freq_hz, channels.responses, channels.forces) - y) * weight
            parts = np.stack([change.real, change.imag], axis=-1)
            pull = np.einsum("loipr,loir->oip", real, parts, optimize=True)
        return FrfInformation(vector.fitted, of_frf, of_line, self._prior(vector), pull)
