"""FRFs of files as the options state them: noise, gains of set-ups, bands."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from jointfrf.errors import ConvergenceWarning, FrfCheckWarning, IdentificationWarning
from jointfrf.frf.bands import in_bands
from jointfrf.frf.setups import SetUps
from jointfrf.frf.stated_noise import StatedNoise
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.workbench.cli.arguments.identify import GainArguments
from jointfrf.workbench.cli.arguments.measured_file import Floor, NoiseArguments
from jointfrf.workbench.cli.usage import UsageError

__all__ = ["in_some_band", "noise_of", "setups_with_gains", "stated_noise", "without_warnings_of_fits"]


def stated_noise(args: NoiseArguments) -> StatedNoise | float | None:
    """Return the noise in the options of a fit, or None if they state none.

    Raises
    ------
    UsageError
        A floor without the relative part, or two of one quantity.
    """
    if args.floor is None:
        return args.noise
    if args.noise is None:
        raise UsageError("--floor states only a part of the noise; add --noise LEVEL, 0 if no part is relative")
    return noise_of(args.noise, args.floor)


def noise_of(relative: float, floors: Sequence[Floor] | None) -> StatedNoise:
    """Return noise of a relative part and floors."""
    found: dict[str, float] = {}
    for one in floors or ():
        if one.quantity in found:
            raise UsageError(f"--floor states {one.quantity} twice; give one")
        found[one.quantity] = one.level
    return StatedNoise(relative, **found)


def setups_with_gains(args: GainArguments, source: str, setups: SetUps | None, shape: tuple[int, ...]) -> SetUps | None:
    """Return the set-ups of FRFs of this shape, with the gains that the options state."""
    stated = {name: value for name, value in args.keywords(GainArguments).items() if value is not None}
    if not stated:
        return setups
    return replace(SetUps([source], np.zeros(shape[1:], int)) if setups is None else setups, **stated)


def in_some_band(
    freq_hz: FloatArray, h: ComplexArray, bands: list[tuple[float, float]] | None
) -> tuple[FloatArray, ComplexArray]:
    """Return the lines in the bands, or all lines without bands."""
    kept = in_bands(freq_hz, bands) if bands else np.ones(freq_hz.size, bool)
    return freq_hz[kept], np.ascontiguousarray(h[kept])


@contextmanager
def without_warnings_of_fits() -> Iterator[None]:
    """Drop warnings that are printed with the result: findings of the fit and of the data."""
    with warnings.catch_warnings():
        for category in (IdentificationWarning, ConvergenceWarning, FrfCheckWarning):
            warnings.simplefilter("ignore", category)
        yield
