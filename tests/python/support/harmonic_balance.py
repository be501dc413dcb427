"""Steady vibration of a beam with an Iwan joint, by harmonic balance and by time integration: the truth of tests.

Nothing here comes from jointfrf but the matrices of the halves: the joint is an array of sliders that are moved through
time, so that higher harmonics of its force move the beam, too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

import jointfrf as jf

#: Odd harmonics that are balanced: the joint is symmetric, so that there are no even ones.
HARMONICS = np.array([1, 3, 5, 7])
#: Instants of a period; an even number.
INSTANTS = 96
#: Steps of the balance, first simple ones, then Newton's, and what is left, as a share of the first harmonic.
FIXED, NEWTON, BALANCED = 12, 8, 1e-7
#: Secant steps of the search for an amplitude; then steps of a factor upwards, and halvings of the factor.
STEPS, FACTOR, HALVINGS = 20, 1.5, 20
SECTION = dict(density=7850.0, width=0.0254, height=0.0254)


@dataclass(frozen=True)
class Sliders:
    """Springs in series with sliders, side by side.

    Attributes
    ----------
    k, limit : ndarray, shape (n,)
        Stiffness of each, and the displacement at which it slips.
    """

    k: np.ndarray
    limit: np.ndarray

    @classmethod
    def iwan(cls, slip_force: float, k: float, chi: float, beta: float, count: int = 60) -> Sliders:
        """Segalman's distribution: R phi^chi up to phi_max, cut geometrically, and S at phi_max."""
        most = slip_force * (1 + beta) / (k * (beta + (chi + 1) / (chi + 2)))
        r = k * (chi + 1) / (most ** (chi + 1) * (1 + beta))
        ends = np.concatenate([[0.0], most * np.geomspace(1e-4, 1.0, count)])
        own = r * np.diff(ends ** (chi + 1)) / (chi + 1)
        moment = r * np.diff(ends ** (chi + 2)) / (chi + 2)
        return cls(np.append(own, k * beta / (1 + beta)), np.append(moment / own, most))

    def moved(self, force: np.ndarray, step: np.ndarray) -> np.ndarray:
        """Forces of all sliders after a step of their common motion."""
        top = self.k * self.limit
        return np.clip(force + self.k * step[..., None], -top, top)

    def periodic(self, motion: np.ndarray) -> np.ndarray:
        """Force over a period, shape (..., n), of a motion that is its own negative half a period later.

        The first half settles the sliders, the second one is found, and the rest is its negative.
        """
        half = motion.shape[-1] // 2
        force = self.moved(np.zeros((*motion.shape[:-1], self.k.size)), motion[..., 0])
        found = np.empty((*motion.shape[:-1], half))
        for i in range(1, motion.shape[-1]):
            force = self.moved(force, motion[..., i] - motion[..., i - 1])
            if i >= half:
                found[..., i - half] = force.sum(axis=-1)
        return np.concatenate([-found, found], axis=-1)

    def first_harmonic(self, amplitude: np.ndarray) -> np.ndarray:
        """K(a), complex, of a motion that is a sine."""
        angle = 2 * np.pi * np.arange(INSTANTS) / INSTANTS
        force = self.periodic(np.asarray(amplitude)[..., None] * np.cos(angle))
        return 2 * np.mean(force * np.exp(-1j * angle), axis=-1) / amplitude


class Steady(NamedTuple):
    """What stepped sines show: receptances (n_freq, n_out), force and relative motion in the joint (n_freq,), peaks."""

    freq_hz: np.ndarray
    h: np.ndarray
    force: np.ndarray
    joint: np.ndarray


@dataclass(frozen=True)
class IwanBeam:
    """Two halves whose ends move together in y and turn against each other through an Iwan joint.

    Attributes
    ----------
    mass, stiffness : ndarray, shape (n, n)
        Of both halves, tied in y, without the joint's rotation; `stiffness` complex where it loses energy.
    damping : ndarray, shape (n, n)
        Viscous.
    across : ndarray, shape (n,)
        From motions to the relative rotation.
    outputs : ndarray of int
        DOFs of the channels; the force acts at the first one.
    joint : Sliders
    """

    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    across: np.ndarray
    outputs: np.ndarray
    joint: Sliders

    def receptances(self, omega: np.ndarray) -> np.ndarray:
        """Rows: channels and the relative rotation; columns: force and relative moment; (n_freq, n_out + 1, 2)."""
        n = len(self.mass)
        rows = np.zeros((self.outputs.size + 1, n))
        rows[np.arange(self.outputs.size), self.outputs], rows[-1] = 1, self.across
        found = np.empty((omega.size, len(rows), 2), complex)
        for i, w in enumerate(omega):
            z = self.stiffness + 1j * w * self.damping - w**2 * self.mass
            found[i] = rows @ np.linalg.solve(z, np.column_stack([rows[0], self.across]).astype(complex))
        return found

    def at_joint_amplitude(
        self, freq_hz: np.ndarray, amplitude: np.ndarray, linear: np.ndarray | None = None
    ) -> Steady:
        """Steady states in which the first harmonic of the relative rotation is known, rad.

        The others follow from the balance: Delta_n = -Y_n f_n, about the joint at rest, whose force is linear.
        """
        own = self._linear(freq_hz) if linear is None else linear
        first, delta = own[:, 0], np.zeros((freq_hz.size, HARMONICS.size), complex)
        delta[:, 0] = amplitude
        off = self._off(delta, own)
        for _ in range(FIXED):
            delta[:, 1:] -= off
            off = self._off(delta, own)
            if (left := abs(off).max(axis=1) > BALANCED * delta[:, 0].real).sum() == 0:
                break
        delta[left, 1:] = 0  # a harmonic of the force is at a resonance there
        off[left] = self._off(delta[left], own[left])
        for _ in range(NEWTON):
            at = np.flatnonzero(left)
            if not at.size:
                break
            delta[at] = self._newton(delta[at], off[at], own[at])
            off[at] = self._off(delta[at], own[at])
            left = abs(off).max(axis=1) > BALANCED * delta[:, 0].real
        force = self._force(delta)[:, 0]
        drive = (delta[:, 0] + first[:, -1, 1] * force) / first[:, -1, 0]
        out = first[:, :-1, 0] * drive[:, None] - first[:, :-1, 1] * force[:, None]
        return Steady(freq_hz, out / drive[:, None], abs(drive), np.asarray(amplitude, float))

    def _force(self, delta: np.ndarray) -> np.ndarray:
        """Harmonics of the moment of the joint, by those of its motion."""
        shapes = np.exp(2j * np.pi * HARMONICS[:, None] * np.arange(INSTANTS) / INSTANTS)
        return 2 * self.joint.periodic((delta @ shapes).real) @ shapes.conj().T / INSTANTS

    def _off(self, delta: np.ndarray, linear: np.ndarray) -> np.ndarray:
        """By how much harmonics 3, 5, ... of the motion are out of balance, about the joint at rest."""
        k, y = self.joint.k.sum(), linear[:, 1:, -1, 1]
        return delta[:, 1:] + y / (1 + k * y) * (self._force(delta) - k * delta)[:, 1:]

    def _newton(self, delta: np.ndarray, off: np.ndarray, linear: np.ndarray) -> np.ndarray:
        n = HARMONICS.size - 1
        step = 1e-4 * abs(delta[:, :1])
        slopes = np.empty((len(delta), 2 * n, 2 * n))
        for i in range(2 * n):
            moved = delta.copy()
            moved[:, 1 + i % n] += step[:, 0] * (1.0 if i < n else 1j)
            change = (self._off(moved, linear) - off) / step
            slopes[:, :, i] = np.concatenate([change.real, change.imag], axis=1)
        found = np.linalg.solve(slopes, np.concatenate([off.real, off.imag], axis=1)[..., None])[..., 0]
        new = delta.copy()
        new[:, 1:] -= found[:, :n] + 1j * found[:, n:]
        return new

    def _linear(self, freq_hz: np.ndarray) -> np.ndarray:
        omega = 2 * np.pi * freq_hz
        return np.stack([self.receptances(n * omega) for n in HARMONICS], axis=1)

    def controlled(self, freq_hz: np.ndarray, level: float, what: Callable[[Steady], np.ndarray]) -> Steady:
        """Steady states in which what(state) has a level on all lines: the force, the motion of a channel.

        Where secants do not find one, it is the lowest amplitude at which the level is passed.
        """
        linear, small = self._linear(freq_hz), np.log(self.joint.limit[0])

        def off(x: np.ndarray, own: np.ndarray) -> np.ndarray:
            return np.log(what(self.at_joint_amplitude(freq_hz[own], np.exp(x), linear[own])) / level)

        every = np.arange(freq_hz.size)
        x, slope = np.full(freq_hz.size, small), np.ones(freq_hz.size)
        now = off(x, every)
        for _ in range(STEPS):
            step = -np.clip(now / slope, -1.0, 1.0)
            step[abs(now) < 1e-6] = 0.0
            after = off(x + step, every)
            with np.errstate(all="ignore"):
                secant = (after - now) / step
            slope = np.where(np.isfinite(secant), np.clip(secant, 0.3, 5.0), slope)
            x, now = x + step, after
            if abs(now).max() < 1e-6:
                break
        own = np.flatnonzero(abs(now) >= 1e-6)
        if own.size:
            low = np.full(own.size, small)
            width = np.log(FACTOR)
            while (below := off(low + width, own) < 0).any():
                low += np.where(below, width, 0.0)
            for _ in range(HALVINGS):
                width /= 2
                low += np.where(off(low + width, own) < 0, width, 0.0)
            x[own] = low
        return self.at_joint_amplitude(freq_hz, np.exp(x), linear)

    def at_force(self, freq_hz: np.ndarray, force: float) -> Steady:
        """Steady states under a force of this amplitude, N."""
        return self.controlled(freq_hz, force, lambda one: one.force)

    def at_response(self, freq_hz: np.ndarray, channel: int, level: float, power: int = 0) -> Steady:
        """Steady states in which a channel moves by this amplitude: m, m/s (power 1) or m/s^2 (power 2)."""
        return self.controlled(
            freq_hz, level, lambda one: abs(one.h[:, channel]) * one.force * (2 * np.pi * one.freq_hz) ** power
        )

    def integrated(self, freq_hz: float, force: float, periods: int, steps: int) -> tuple[np.ndarray, complex]:
        """First harmonic of channels and relative rotation in the last period, by Newmark's method from rest.

        The stiffness must be real. The joint is one equation a step, solved by Newton's method.
        """
        h, n = 1 / (freq_hz * steps), len(self.mass)
        s = np.linalg.inv(self.mass * 4 / h**2 + self.damping * 2 / h + self.stiffness.real)
        soft, gain = self.across @ s @ self.across, s @ self.across
        u, v, a = np.zeros((3, n))
        sliders, delta, load = np.zeros(self.joint.k.size), 0.0, np.zeros(n)
        kept = np.empty((steps, n))
        for i in range(1, periods * steps + 1):
            load[self.outputs[0]] = force * np.cos(2 * np.pi * i / steps)
            free = s @ (load + self.mass @ (u * 4 / h**2 + v * 4 / h + a) + self.damping @ (u * 2 / h + v))
            aim, new = self.across @ free, delta
            for _ in range(50):
                moved = self.joint.moved(sliders, np.array(new - delta))
                sticks = abs(moved) < self.joint.k * self.joint.limit
                off = new - aim + soft * moved.sum()
                if abs(off) < 1e-14 * max(abs(aim), 1e-12):
                    break
                new -= off / (1 + soft * self.joint.k[sticks].sum())
            sliders, delta = moved, new
            found = free - gain * moved.sum()
            v_new = 2 / h * (found - u) - v
            a, u, v = 2 / h * (v_new - v) - a, found, v_new
            kept[i % steps] = u
        first = 2 * np.exp(-2j * np.pi * np.arange(steps) / steps) @ kept / steps
        return first[self.outputs], complex(first @ self.across)


def iwan_beam(
    joint: Sliders,
    *,
    elements: int = 24,
    youngs_modulus: tuple[float, float] = (210e9, 210e9),
    loss_factor: float | tuple[float, float] = 0.001,
    viscous: float = 0.0,
    sensor: float = 0.0,
) -> IwanBeam:
    """Return two free halves of 360 mm as in cases/lap-beam; channels at nodes 1 and 15 of A, 9 and 25 of B (of 24).

    `viscous` times the stiffness at rest is the damping matrix; `sensor` kg are at each channel.
    """
    halves = [jf.beam(0.36, elements, youngs_modulus=e, **SECTION) for e in youngs_modulus]
    k, m = ([np.asarray(matrix(one)) for one in halves] for matrix in (_stiffness, _mass))
    n = len(k[0])
    tie = np.eye(2 * n)  # y of the first node of B is y of the last one of A
    tie[n, n - 2] = 1
    tie = np.delete(tie, n, axis=1)
    zero = np.zeros((n, n))
    lossy = [one * (1 + 1j * loss) for one, loss in zip(k, np.broadcast_to(loss_factor, 2), strict=True)]
    stiffness, mass = (tie.T @ np.block([[a, zero], [zero, b]]) @ tie for a, b in (lossy, m))
    across = np.zeros(2 * n)
    across[n - 1], across[n + 1] = 1, -1
    across = across @ tie
    at = [0, 14 * elements // 24, elements + 1 + 8 * elements // 24, 2 * elements + 1]
    outputs = np.array([int(np.flatnonzero(tie[2 * node])[0]) for node in at])
    np.add.at(mass, (outputs, outputs), sensor)
    at_rest = stiffness.real + joint.k.sum() * np.outer(across, across)
    return IwanBeam(mass, stiffness, viscous * at_rest, across, outputs, joint)


def _stiffness(model: jf.Model) -> np.ndarray:
    return model.stiffness.toarray()


def _mass(model: jf.Model) -> np.ndarray:
    return model.mass.toarray()


def believed() -> jf.Assembly:
    """Return what is believed of the beam: its halves to 1 %, their loss factors to 50 %, a first joint."""
    halves = [
        jf.Substructure(
            jf.beam(0.36, 24, youngs_modulus=210e9, loss_factor=0.001, **SECTION), joint,
            {"youngs_modulus": jf.Unknown(1.0, 0.01), "loss_factor": jf.Unknown(0.001, 0.0005, lower=0)}, exact=True,
        )
        for joint in (["25:y", "25:theta"], ["1:y", "1:theta"])
    ]  # fmt: skip
    joint = jf.LawJoint({"theta_z": jf.SpringLaw(1e5, h=1e3)}, ["y"], dofs=["y", "theta_z"])
    return jf.Assembly(*halves, joint)
