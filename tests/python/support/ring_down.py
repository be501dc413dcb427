"""Free decays of the beam with an Iwan joint, by time integration: the truth of tests of decays.

Nothing here comes from jointfrf but the matrices of the halves. The low modes of the beam at rest move by recurrences
that are exact for linear oscillators; the force that the sliders leave of the linear joint acts on them at each step,
and bends the high modes at once. The scheme is symmetric in time, so that it adds no damping. All beams of a study move
together.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh

from harmonic_balance import IwanBeam

#: Steps of a sample of 2048 Hz; the modes that move take at least a full turn in six steps.
STEPS = 20
#: Steps of Newton's method for the rotation of the joint: its force is piecewise linear.
NEWTON = 4


class RingDown(NamedTuple):
    """Acceleration of the channels, shape (n_beams, n, n_out), and the relative rotation, (n_beams, n); time (n,)."""

    time: np.ndarray
    acceleration: np.ndarray
    joint: np.ndarray


def mode_of(beam: IwanBeam, k: complex, freq_hz: float = 235.0) -> tuple[float, float, np.ndarray]:
    """Return frequency in Hz, damping ratio, and channels per relative rotation, of the mode next to a frequency."""
    across = np.outer(beam.across, beam.across)
    squares, shapes = eigh(beam.stiffness.real + k.real * across, beam.mass)
    i = np.argmin(abs(squares - (2 * np.pi * freq_hz) ** 2))
    own, omega = shapes[:, i], np.sqrt(squares[i])
    lost = own @ (beam.stiffness.imag + omega * beam.damping + k.imag * across) @ own
    return omega / (2 * np.pi), lost / (2 * squares[i]), own[beam.outputs] / (beam.across @ own)


def ring_down(
    beams: Sequence[IwanBeam],
    rate: float,
    seconds: float,
    *,
    hit: float | None = None,
    pulse: float = 3e-3,
    joint: float | None = None,
) -> RingDown:
    """Move beams freely after a hit of `hit` N (half a sine, first channel), or in a mode that would reach `joint` rad.

    Their stiffness must be real, their damping viscous.
    """
    h, n = 1 / (rate * STEPS), int(rate * seconds)
    omega, decay, gain, out, across, soft = (
        np.array(one) for one in zip(*(_modes(b, 1 / h) for b in beams), strict=True)
    )
    shrink = np.exp(-decay * h)
    first, second = 2 * shrink * np.cos(np.sqrt(omega**2 - decay**2) * h), shrink**2
    load = np.where(omega > 0, (1 - first + second) / np.maximum(omega, 1) ** 2, h**2)  # exact at rest
    k, limit = (np.array([getattr(one.joint, name) for one in beams]) for name in ("k", "limit"))
    sliders, total, top = np.zeros(k.shape), k.sum(axis=1), k * limit
    q, before, delta = np.zeros(omega.shape), np.zeros(omega.shape), np.zeros(len(beams))
    if joint is not None:  # with the velocity that brings the linear joint there
        i, every = np.argmin(abs(omega - 2 * np.pi * 235), axis=1), np.arange(len(beams))
        before[every, i] = -joint / across[every, i] * np.sin(omega[every, i] * h)
    found, moved = np.empty((len(beams), n, out.shape[1])), np.empty((len(beams), n))
    for step in range(n * STEPS):
        aim, new = np.einsum("ij,ij->i", across, q), delta
        for _ in range(NEWTON):
            force = np.clip(sliders + k * (new - delta)[:, None], -top, top)
            slope = np.sum(k * (abs(force) >= top), axis=1)
            new = new - (new - aim - soft * (total * new - force.sum(axis=1))) / (1 - soft * slope)
        sliders = np.clip(sliders + k * (new - delta)[:, None], -top, top)
        delta = new
        loads = (total * delta - sliders.sum(axis=1))[:, None] * across
        if hit is not None and step * h < pulse:
            loads = loads + hit * np.sin(np.pi * step * h / pulse) * gain
        after = first * q - second * before + load * loads
        if step % STEPS == 0:
            motion = loads - omega**2 * q - decay * (after - before) / h
            found[:, step // STEPS] = np.einsum("ikj,ij->ik", out, motion)
            moved[:, step // STEPS] = delta
        before, q = q, after
    return RingDown(np.arange(n) / rate, found, moved)


def _modes(beam: IwanBeam, limit: float) -> tuple[np.ndarray, ...]:
    """Low modes: frequencies (rad/s), decay rates (1/s), force, channels, joint; flexibility of the rest."""
    at_rest = beam.stiffness.real + beam.joint.k.sum() * np.outer(beam.across, beam.across)
    squares, shapes = eigh(at_rest, beam.mass)
    low = squares < limit**2
    omega, own = np.sqrt(np.where(squares > 100, squares, 0.0)), beam.across @ shapes
    decay = np.where(omega > 0, np.einsum("ij,ik,kj->j", shapes, beam.damping, shapes) / 2, 0.0)
    soft = float(np.sum(own[~low] ** 2 / squares[~low]))
    return omega[low], decay[low], shapes[beam.outputs[0], low], shapes[beam.outputs][:, low], own[low], soft
