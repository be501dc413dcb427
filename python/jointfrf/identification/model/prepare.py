"""Checked arguments of `identify_model`, as a problem."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.dofs import is_rotation
from jointfrf.frf.setups import SetUps
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.model.fit import ModelProblem
from jointfrf.identification.model.prediction import Prediction, parameter_vector
from jointfrf.identification.model.substructure import Unknown
from jointfrf.identification.noise import NoiseOptions, noise_of_channels, without_mass
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_frequency, as_lines, check_type
from jointfrf.laws.law_joint import LawJoint

__all__ = ["Channels", "JointStart", "prepare_model_fit"]

#: Function that returns values of a joint from frequencies, FRFs between all its DOFs and their variance, or None.
JointStart = Callable[[LawJoint, FloatArray, ComplexArray, FloatArray], FloatArray | None]


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
                    raise ValueError(f"unknown {what} {name!r} in {what}_gains; use one of {', '.join(names)}")
                if not isinstance(gain, Unknown) or gain.value == 0:
                    raise ValueError(f"{what}_gains: {name} must be an Unknown about a factor that is not zero")

    def gains(self) -> tuple[dict[int, tuple[str, Unknown]], dict[int, tuple[str, Unknown]]]:
        """Return the factors by the number of the channel."""
        return (
            {self.responses.index(name): (name, gain) for name, gain in self.response_gains.items()},
            {self.forces.index(name): (name, gain) for name, gain in self.force_gains.items()},
        )


def prepare_model_fit(
    freq_hz: ArrayLike,
    h: ArrayLike,
    whole: Assembly,
    channels: Channels,
    noise: NoiseOptions,
    fixed: Sequence[str],
    start: JointStart | None = None,
) -> ModelProblem:
    """Check the arguments of a fit, estimate the noise, reduce the models; see `identify_model`.

    `start` returns values of a joint from FRFs between all its DOFs with their variance; None if it finds none.
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
    reciprocal = channels.responses == channels.forces and bool(shown.all())
    if noise.setups is not None:
        check_type("setups", noise.setups, SetUps)
        noise.setups.check_fits(lines.shape)
    is_translation = not any(is_rotation(name.rpartition(":")[2]) for name in channels.responses)
    lines, mass = without_mass(freq, lines, noise.sensor_mass, is_square=reciprocal, is_translation=is_translation)
    found = noise_of_channels(freq, lines, shown, noise, reciprocal=reciprocal)
    variance = found.variance
    prediction = Prediction(whole, freq, channels.responses, channels.forces)
    vector = parameter_vector(whole, channels.gains(), tuple(fixed), prediction.joint_stiffness())
    if not vector.free.size:
        raise ValueError("nothing to fit: all parameters of the joint are fixed; leave some out of fixed")
    if 2 * np.count_nonzero(np.isfinite(variance)) < vector.free.size:
        count = 2 * int(np.isfinite(variance).sum())
        raise ValueError(f"{count} measured numbers for {vector.free.size} unknowns; measure more, or fix some")
    at = _joint_channels(whole, channels, shown)

    def joint_start() -> FloatArray | None:
        if at is None or start is None:
            return None
        gamma = np.ascontiguousarray(lines[:, at[0]][:, :, at[1]])
        return start(whole.joint, freq, gamma, variance[:, at[0]][:, :, at[1]])

    return ModelProblem(
        prediction,
        vector,
        freq,
        np.where(shown, lines, np.nan),
        variance,
        found.smooth,
        replace(found.noise, mass=mass),
        at,
        joint_start,
    )


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
        raise ValueError("h contains no FRF: all are NaN")
    return ~never


def _joint_channels(
    whole: Assembly, channels: Channels, shown: NDArray[np.bool_]
) -> tuple[list[int], list[int]] | None:
    """Return the channels at the DOFs j, then k, of the only joint with all FRFs between them measured."""
    names = [*whole.ends[0], *whole.ends[1]]
    if len(whole.joints) > 1 or not all(name in channels.responses and name in channels.forces for name in names):
        return None
    at = [channels.responses.index(name) for name in names], [channels.forces.index(name) for name in names]
    return at if shown[np.ix_(*at)].all() else None
