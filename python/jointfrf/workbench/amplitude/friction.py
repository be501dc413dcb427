"""First harmonic of friction elements under x = a cos(w t): K(a) = k (1 + i eta), complex, by amplitude.

The real part is 1/(pi a) times the integral of force times cos over a cycle, the imaginary part the energy lost in a
cycle divided by pi a^2. It does not depend on frequency.
"""

from __future__ import annotations

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["bouc_wen", "iwan", "jenkins"]

#: Angles of half a cycle: the force has a jump in its second derivative, the sum is exact to 1e-6.
_ANGLES = (np.arange(400) + 0.5) * np.pi / 400
#: Steps of Newton's method; it converges from one side, and quadratically.
_NEWTON_STEPS = 40


def jenkins(amplitude: FloatArray, stiffness: float, slip: float) -> ComplexArray:
    """Return K(a) of a spring in series with a slider that slips at the displacement `slip`."""
    share = np.minimum(slip / amplitude, 1.0)
    angle = np.arccos(1 - 2 * share)
    real = (angle - np.sin(angle) * np.cos(angle)) / np.pi
    found: ComplexArray = stiffness * (real + 4j / np.pi * share * (1 - share))
    return found


def iwan(amplitude: FloatArray, slip_force: float, stiffness: float, chi: float, beta: float) -> ComplexArray:
    """Return K(a) of Segalman's four-parameter Iwan element.

    Sliders have the density R phi^chi up to phi_max and S at phi_max; F_S, K_T, chi and beta as in D. J. Segalman,
    A four-parameter Iwan model for lap-type joints, J. Appl. Mech. 72 (2005) 752-760. In microslip the energy lost in
    a cycle goes with a^(3 + chi).
    """
    from scipy.special import beta as complete_beta
    from scipy.special import betainc

    most = slip_force * (1 + beta) / (stiffness * (beta + (chi + 1) / (chi + 2)))
    base = stiffness / (1 + beta)
    share = np.minimum(most / amplitude, 1.0)  # of the amplitude, up to which sliders slip
    end = jenkins(amplitude, 1.0, most)
    tail = 8 / np.pi * complete_beta(chi + 2.5, 1.5) * betainc(chi + 2.5, 1.5, share)
    real = share ** (chi + 1) * np.where(share < 1, end.real, 1.0) - tail
    lost = 4 / np.pi * (chi + 1) * (share ** (chi + 2) / (chi + 2) - share ** (chi + 3) / (chi + 3))
    slipping = (amplitude / most) ** (chi + 1) * (real + 1j * lost)
    sticking = np.maximum(1 - (amplitude / most) ** (chi + 1), 0.0)
    found: ComplexArray = base * (slipping + sticking + beta * end)
    return found


def bouc_wen(amplitude: FloatArray, stiffness: float, yield_displacement: float) -> ComplexArray:
    """Return K(a) of a Bouc-Wen element with n = 1 and beta = gamma, which unloads along its initial stiffness.

    dz/dx = 1 - z/z_y where z and dx have one sign, else 1; the force is stiffness times z.
    """
    peak = np.full(amplitude.shape, yield_displacement)
    for _ in range(_NEWTON_STEPS):  # peak = z_y (1 - exp(-(2 a - peak)/z_y))
        decay = np.exp(-(2 * amplitude - peak) / yield_displacement)
        peak = peak - (peak - yield_displacement * (1 - decay)) / (1 + decay)
    way = amplitude[:, None] * (1 - np.cos(_ANGLES)) - peak[:, None]  # since z passed zero
    force = np.where(way < 0, way, -yield_displacement * np.expm1(-np.maximum(way, 0.0) / yield_displacement))
    real = -2 / amplitude * np.mean(force * np.cos(_ANGLES), axis=1)
    lost = 2 * (yield_displacement * (2 * amplitude - 2 * peak) - peak**2 / 2)
    found: ComplexArray = stiffness * (real + 1j * lost / (np.pi * amplitude**2))
    return found
