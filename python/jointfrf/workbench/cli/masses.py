"""Masses that the FRFs show, compared with masses that the user states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from jointfrf.errors import FileContentError
from jointfrf.frf.noise_model import estimate_noise
from jointfrf.identification.apparent_mass import KNOWN, ApparentScale, apparent_scale, model_mass
from jointfrf.identification.fit_data import FitData
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.models.model import Model
from jointfrf.workbench.assembly_file.side_part import SidePart
from jointfrf.workbench.cli.arguments.measured_file import MassArguments
from jointfrf.workbench.cli.measured_file import in_some_band
from jointfrf.workbench.cli.measured_joint import MeasuredJoint
from jointfrf.workbench.cli.usage import UsageError

__all__ = ["check_masses", "check_stated", "scale_of_fit", "scale_of_joint"]

#: Lines of a look: those on the mass line are the lowest.
_LINES = 1000


def check_stated(args: MassArguments) -> None:
    """Raise an error for a mass that is none."""
    for name, _, value in _stated(args):
        if not 0 < value < np.inf:
            raise UsageError(f"{name} must be positive, not {value:g}; state it in kg")


def _stated(args: MassArguments) -> list[tuple[str, str, float]]:
    """Return the options of stated masses, the sides that they are of, and their values in kg."""
    options = (("--mass-j", "j", args.mass_j), ("--mass-k", "k", args.mass_k), ("--mass", "j and k", args.mass))
    return [(name, side, value) for name, side, value in options if value is not None]


def scale_of_fit(fit: Fit) -> ApparentScale:
    """Return the masses that the FRFs of a fit at the joint show; nothing for other fits."""
    data = fit.data
    if not isinstance(data, FitData):
        return ApparentScale()
    variance = data.variance * data.variance_scale
    return _scale(fit.freq_hz, data.measured, variance, data.responses, data.forces, fit.dofs)


def scale_of_joint(joint: MeasuredJoint) -> ApparentScale:
    """Return the masses that the FRFs of a joint show, without a fit; nothing if some FRFs are missing."""
    freq, h = in_some_band(joint.freq_hz, joint.h, joint.bands)
    freq, h = freq[:_LINES], np.ascontiguousarray(h[:_LINES])
    if not np.isfinite(h).all():
        return ApparentScale()
    try:
        noise = estimate_noise(freq, h)
    except ValueError:  # too few lines to find it
        return ApparentScale()
    variance = noise.inflation * noise.variance
    scale = _scale(freq, h, variance, joint.responses.transform, joint.forces.transform, joint.dofs)
    # How far sides deform between the channels of virtual points shows in a fit only.
    return scale if joint.channels is None else replace(scale, masses=scale.of_both)


def _scale(
    freq: FloatArray, h: ComplexArray, variance: FloatArray, responses: FloatArray, forces: FloatArray,
    dofs: Sequence[str],
) -> ApparentScale:  # fmt: skip
    used = np.isfinite(variance).all(axis=(1, 2))
    gamma, spread = responses @ h[used] @ forces.T, responses**2 @ variance[used] @ (forces**2).T
    return apparent_scale(freq[used], gamma, spread, dofs)


def check_masses(args: MassArguments, scale: ApparentScale, sides: Sequence[SidePart] = ()) -> list[str]:
    """Raise an error for a mass, stated by an option or by the model of a side, that the FRFs contradict.

    Returns
    -------
    list of str
        A sentence for each option that the FRFs cannot confirm or contradict.

    Raises
    ------
    FileContentError
    """
    stated = _stated(args)
    unknown = [
        f"{name} was not compared: the lowest lines do not show this mass to {100 * KNOWN:g} %"
        for name, side, _ in stated
        if scale.of_side(side) is None
    ]
    for name, side, part in zip(("--side-j", "--side-k"), "jk", sides, strict=False):
        own, seen = part.model.part, scale.of_side(side)
        mass = model_mass(own.source, seen.direction) if seen is not None and isinstance(own.source, Model) else None
        stated += [] if mass is None else [(name, side, mass)]
    for name, side, value in stated:
        wrong = scale.contradiction(side, value)
        if wrong is not None:
            raise FileContentError(f"{wrong}: correct the unit of the FRFs, or {name}")
    return unknown
