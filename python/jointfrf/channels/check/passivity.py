"""Bands where a driving point gives out power."""

from __future__ import annotations

import numpy as np

from jointfrf.channels.check.finding import FrfFinding
from jointfrf.channels.check.measurement import Measurement, modulus
from jointfrf.channels.check.ratio_line import block_medians
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["passivity_findings"]

#: Lines taken together.
_BLOCK = 30
#: Standard errors by which Im h / |h| of a block must exceed zero, and its least value.
_SIGNIFICANT, _LEAST = 8.0, 0.05


def passivity_findings(
    measurement: Measurement, driving: ComplexArray, noise: FloatArray, inflation: float
) -> list[FrfFinding]:
    """Find driving points, shape (n_freq, n), whose Im is positive over a band.

    `noise` is the standard deviation of Im h / |h| on a line, shape (n,); NaN where it is not known.
    """
    length = min(_BLOCK, driving.shape[0])
    size = modulus(driving)
    part = np.where(size > 0, driving.imag / np.where(size > 0, size, 1), 0)
    real = np.where(size > 0, driving.real / np.where(size > 0, size, 1), 0)
    middle = block_medians(part, length)
    # Scatter within a block: of noise, or of the resonances that it holds.
    own = middle[np.minimum(np.arange(part.shape[0]) // length, middle.shape[0] - 1)]
    spread = 1.4826 * block_medians(abs(part - own), length)
    spread = np.fmax(spread, noise)
    error = 1.2533 * spread * np.sqrt(min(inflation, length) / length)
    active = middle > np.maximum(_LEAST, _SIGNIFICANT * error)
    freq = block_medians(measurement.freq_hz[:, None], length)[:, 0]
    findings = []
    for i in np.flatnonzero(active.any(axis=0)):
        where = np.flatnonzero(active[:, i])
        worst = int(where[np.argmax(middle[where, i])])
        side = block_medians(real[:, i : i + 1], length)[where, 0]
        cause = (
            "between resonances where the mass governs (Re < 0): a delay of this FRF or of all"
            if (side < -0.5).all()
            else "where the stiffness governs (Re > 0): this FRF, or all, are too early in time"
            if (side > 0.5).all()
            else "at resonances: damping that gives out energy, or another sign of this FRF there"
        )
        findings.append(
            FrfFinding(
                "passivity", "warning", (measurement.dofs[i],), float(middle[worst, i]), _LEAST,
                f"power comes out of the structure at {measurement.dofs[i]} near {freq[worst]:.4g} Hz: Im h / |h| is "
                f"{middle[worst, i]:.2g} +- {error[worst, i]:.1g} in {where.size} of {middle.shape[0]} bands, {cause}",
                "look at the phase of sensor and hammer; leave these bands out",
            )
        )  # fmt: skip
    return findings
