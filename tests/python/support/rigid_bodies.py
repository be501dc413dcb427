"""Receptances of free bodies at any points, by Newton and Euler, with modes that deform them on top."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

DOFS = ("x", "y", "z", "theta_x", "theta_y", "theta_z")


@dataclass(frozen=True)
class Channel:
    """A displacement and a force at a place, or a rotation and a moment."""

    place: np.ndarray
    axis: np.ndarray
    rotation: bool = False


def six(point) -> list[Channel]:
    """Three translations and three rotations of a point."""
    return [Channel(np.array(point, float), axis, rotation) for rotation in (False, True) for axis in np.eye(3)]


def along(places, directions) -> list[Channel]:
    return [Channel(place, direction) for place, direction in zip(places, directions, strict=True)]


def motion(channel: Channel, point, translation, rotation) -> float:
    """What a channel shows of a rigid motion that is given at a point."""
    if channel.rotation:
        return float(channel.axis @ rotation)
    return float(channel.axis @ (translation + np.cross(rotation, channel.place - point)))


@dataclass(frozen=True)
class Body:
    mass: float
    inertia: np.ndarray
    centre: np.ndarray

    def receptance(self, freq, outputs, inputs, flexible=(), loss_factor=0.01) -> np.ndarray:
        """Rigid receptance by Newton and Euler; `flexible`: (frequency in Hz, shape at outputs, at inputs)."""
        h = np.zeros((len(outputs), len(inputs)))
        for column, load in enumerate(inputs):
            force = 0 * load.axis if load.rotation else load.axis
            moment = load.axis if load.rotation else np.cross(load.place - self.centre, force)
            acceleration, spin = force / self.mass, np.linalg.solve(self.inertia, moment)
            h[:, column] = [motion(channel, self.centre, acceleration, spin) for channel in outputs]
        omega = 2 * np.pi * np.asarray(freq, float)[:, None, None]
        total = -h / omega**2 + 0j
        for natural, out, inp in flexible:
            total += np.outer(out, inp) / ((2 * np.pi * natural) ** 2 * (1 + 1j * loss_factor) - omega**2)
        return total


def rigid_shapes(channels, point, n_modes, seed, frequencies, rotation=3.0):
    """Modes that move a patch of channels as a rigid body about a point, by different amounts."""
    rng = np.random.default_rng(seed)
    modes = []
    for natural in rng.uniform(*frequencies, n_modes):
        t, theta = 0.7 * rng.standard_normal(3), rotation * rng.standard_normal(3)
        shape = np.array([motion(channel, point, t, theta) for channel in channels])
        modes.append((natural, shape, shape))
    return modes


def triaxial(places):
    """Positions and directions of triaxial accelerometers."""
    return np.repeat(np.asarray(places, float), 3, axis=0), np.tile(np.eye(3), (len(places), 1))


INERTIA = np.array([[0.010, 0.001, 0.0], [0.001, 0.012, 0.002], [0.0, 0.002, 0.006]])
POINT = np.array([0.0, 0.0, 0.1])
#: Four triaxial accelerometers around the point.
AROUND = np.array([[0.03, 0, -0.02], [-0.015, 0.024, -0.02], [-0.015, -0.024, -0.02], [0, 0, 0.01]])
BODY_A = Body(2.0, INERTIA, np.array([0.0, 0.01, 0.0]))
BODY_B = Body(1.5, 0.7 * INERTIA, np.array([0.0, 0.0, 0.25]))
#: Translation and rotation of a point for a unit of each of its six DOFs.
UNIT_MOTIONS = [(axis, np.zeros(3)) for axis in np.eye(3)] + [(np.zeros(3), axis) for axis in np.eye(3)]


def scattered(m, seed, spread=0.05):
    """Channels at random places around the point, in random directions."""
    rng = np.random.default_rng(seed)
    direction = rng.standard_normal((m, 3))
    return POINT + spread * rng.standard_normal((m, 3)), direction / np.linalg.norm(direction, axis=1, keepdims=True)
