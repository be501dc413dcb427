"""What `identify_model` is given, checked and put into a problem."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.entry_groups import entry_groups
from jointfrf.frf.noise_model import NoiseModel, estimate_noise
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.model.fit import ModelProblem
from jointfrf.identification.model.prediction import Prediction, parameter_vector
from jointfrf.identification.model.substructure import Unknown
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_frequency, as_lines, as_number, as_real
from jointfrf.laws.law_joint import LawJoint

__all__ = ["ChannelNoise", "Channels", "prepare_model_fit"]

#: Noise level that is assumed where FRFs do not show theirs; it is replaced by that of the residual.
_ASSUMED = 0.01
#: Noise below this share of the FRFs is rounding.
_ROUNDING = 1e-7
#: Relative noise is not taken below this share of that of the largest line of an FRF.
_LEAST = 1e-6

#: From joint, lines, FRFs, their variance and the channels at the joint to values of the joint, or None.
ValuesAtJoint = Callable[
    [LawJoint, FloatArray, ComplexArray, FloatArray, tuple[list[int], list[int]]], FloatArray | None
]


@dataclass(frozen=True)
class Channels:
    """Channels of a measurement.

    Attributes
    ----------
    responses, forces : tuple of str
        DOFs ``"A/..."``, ``"B/..."``.
    response_gains, force_gains : mapping of str to Unknown
        Factors of channels that are not exactly known.
    """

    responses: tuple[str, ...]
    forces: tuple[str, ...]
    response_gains: Mapping[str, Unknown] = field(default_factory=dict)
    force_gains: Mapping[str, Unknown] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for names, what in ((self.responses, "responses"), (self.forces, "forces")):
            if not names or len(set(names)) != len(names):
                raise ValueError(f"{what} must name at least one DOF, each once, not {', '.join(names) or 'none'}")
        for gains, names, what in (
            (self.response_gains, self.responses, "response"), (self.force_gains, self.forces, "force"),
        ):  # fmt: skip
            for name, gain in gains.items():
                if name not in names:
                    raise ValueError(f"{what}_gains names {name!r}, which is no {what}: {', '.join(names)}")
                if not isinstance(gain, Unknown) or gain.value == 0:
                    raise ValueError(f"{what}_gains: {name} must be an Unknown about a factor that is not zero")

    def gains(self) -> tuple[dict[int, tuple[str, Unknown]], dict[int, tuple[str, Unknown]]]:
        """Return the factors by the number of the channel."""
        return (
            {self.responses.index(name): (name, gain) for name, gain in self.response_gains.items()},
            {self.forces.index(name): (name, gain) for name, gain in self.force_gains.items()},
        )


@dataclass(frozen=True)
class ChannelNoise:
    """What is told of the noise, as in `identify_model`."""

    noise: float | ArrayLike | None = None
    coherence: ArrayLike | None = None
    averages: float | None = None


def prepare_model_fit(
    freq_hz: ArrayLike,
    h: ArrayLike,
    whole: Assembly,
    channels: Channels,
    noise: ChannelNoise,
    fixed: Sequence[str],
    at_joint: ValuesAtJoint | None = None,
) -> ModelProblem:
    """Check the arguments of a fit, find the noise, reduce the models; as in `identify_model`.

    `at_joint` returns values of the joint from FRFs between all its DOFs, where these are among those measured.
    """
    lines = as_lines("h", h)
    freq = as_frequency(freq_hz, len(lines))
    if freq.size == 0:
        raise ValueError("h has no frequency lines")
    wanted = (len(channels.responses), len(channels.forces))
    if lines.shape[1:] != wanted:
        raise ValueError(f"h must have {wanted[0]} responses and {wanted[1]} forces, not shape {lines.shape}")
    for names, what in ((channels.responses, "response"), (channels.forces, "force")):
        whole.check(names, what)
    shown = _shown(lines, freq)
    found, variance, smooth, inflation, is_assumed = _noise(freq, lines, shown, channels, noise)
    prediction = Prediction(whole, freq, channels.responses, channels.forces)
    vector = parameter_vector(whole, channels.gains(), tuple(fixed), prediction.joint_stiffness())
    if not vector.free.size:
        raise ValueError("there is nothing to fit: all parameters of the joint are fixed, and nothing else is unknown")
    if 2 * np.count_nonzero(np.isfinite(variance)) < vector.free.size:
        count = 2 * int(np.isfinite(variance).sum())
        raise ValueError(f"{count} numbers measured cannot give {vector.free.size} unknowns")
    at = _joint_channels(whole, channels, shown)
    return ModelProblem(
        prediction, vector, freq, np.where(shown, lines, np.nan), variance, smooth, inflation, found, is_assumed, at,
        lambda: None if at is None or at_joint is None else at_joint(whole.joint, freq, lines, variance, at),
    )  # fmt: skip


def _shown(lines: ComplexArray, freq: FloatArray) -> NDArray[np.bool_]:
    """Return which FRFs were measured, shape (n_o, n_i); an FRF is NaN on all lines or on none."""
    missing = np.isnan(lines)
    never: NDArray[np.bool_] = np.asarray(missing.all(axis=0))
    bad = np.argwhere((missing & ~never) | np.isinf(lines))
    if bad.size:
        line, row, column = bad[0].tolist()
        raise ValueError(
            f"h[{line}, {row}, {column}] at {freq[line]:g} Hz is not finite (an FRF that was not measured is NaN on "
            "all lines)"
        )
    if never.all():
        raise ValueError("h holds no FRF: all are NaN")
    return ~never


def _noise(
    freq: FloatArray, lines: ComplexArray, shown: NDArray[np.bool_], channels: Channels, told: ChannelNoise
) -> tuple[NoiseModel | None, FloatArray, ComplexArray, float, bool]:
    """Return noise model, E|e|^2 (inf: nothing measured), smooth FRFs, inflation, whether it is assumed."""
    size = abs(np.where(shown, lines, 0))
    kept = np.zeros(shown.shape, bool)
    for group in entry_groups(np.where(shown, lines, 0), reciprocal=False):
        kept[group.rows, group.columns] = True
    kept &= shown  # without FRFs that are zero, by symmetry
    least = np.maximum(_LEAST * size.max(axis=0), np.finfo(float).tiny)
    if told.noise is not None:
        if told.coherence is not None or told.averages is not None:
            raise ValueError("noise is told: leave coherence and averages out")
        if np.ndim(told.noise) == 0:
            level = as_number("noise", told.noise)
            if level <= 0:
                raise ValueError(f"noise must be positive, not {level:g}")
            variance = (level * np.maximum(size, least)) ** 2
        else:
            variance = as_real("noise", told.noise, lines.shape)
            if not (variance[:, shown] > 0).all():
                raise ValueError("noise must be positive: E|e|^2 of each FRF that was measured")
        return None, _hidden(variance, kept), np.where(shown, lines, 0), 1.0, False
    reciprocal = channels.responses == channels.forces and bool(shown.all())
    # Of a square matrix FRFs that are zero by symmetry may stay: reciprocity says more of the noise.
    given = shown if reciprocal else kept
    rows, columns = np.flatnonzero(given.any(axis=1)), np.flatnonzero(given.any(axis=0))
    coherence = None if told.coherence is None else as_real("coherence", told.coherence, lines.shape)
    is_block = bool(given[np.ix_(rows, columns)].all())
    lines_kept = lines[:, rows][:, :, columns] if is_block else lines[:, given][:, None]
    if coherence is not None:
        coherence = coherence[:, rows][:, :, columns] if is_block else coherence[:, given][:, None]
    found = estimate_noise(
        freq, np.ascontiguousarray(lines_kept), reciprocal=reciprocal and is_block,
        coherence=coherence, averages=told.averages,
    )  # fmt: skip
    variance, smooth = _placed(found.variance, given).real, _placed(found.smooth.h, given)
    relative, floor, of_coherence = (
        _placed(part[None], given)[0].real for part in (found.relative, found.floor, found.coherence_factor)
    )
    model = replace(found, relative=relative, floor=floor, coherence_factor=of_coherence, variance=variance)
    is_assumed = found.source == "none" or found.level < _ROUNDING
    if is_assumed:
        variance = (_ASSUMED * np.maximum(size, least)) ** 2
        smooth = np.where(shown, lines, 0)
    return model, _hidden(variance, kept), smooth, found.inflation, is_assumed


def _placed(values: ComplexArray | FloatArray, kept: NDArray[np.bool_]) -> ComplexArray:
    """Return numbers of the FRFs that were measured at their places, zero elsewhere."""
    found = np.zeros((len(values), *kept.shape), np.complex128)
    found[:, kept] = values.reshape(len(values), -1)
    return found


def _hidden(variance: FloatArray, shown: NDArray[np.bool_]) -> FloatArray:
    found: FloatArray = np.where(shown, variance, np.inf)
    return found


def _joint_channels(
    whole: Assembly, channels: Channels, shown: NDArray[np.bool_]
) -> tuple[list[int], list[int]] | None:
    """Return the channels at the joint DOFs j, then k, where all FRFs between them were measured."""
    names = [*(f"A/{dof}" for dof in whole.a.joint), *(f"B/{dof}" for dof in whole.b.joint)]
    if not all(name in channels.responses and name in channels.forces for name in names):
        return None
    at = [channels.responses.index(name) for name in names], [channels.forces.index(name) for name in names]
    return at if shown[np.ix_(*at)].all() else None
