"""Two blocks of bricks with a known joint, measured by triaxial sensors around it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

import jointfrf as jf
from jointfrf.dofs import DIRECTIONS
from jointfrf.workbench.solids.brick import Material
from jointfrf.workbench.solids.mesh import extrude, rectangle
from jointfrf.workbench.solids.solid import Patch, solid_model

ALUMINIUM = Material(youngs_modulus=70e9, poisson=0.33, density=2700.0, loss_factor=0.005)
STIFFNESS = np.array([2.4e7, 1.8e7, 4.5e7, 9e3, 1.2e4, 7.5e3])
DAMPING = np.array([150.0, 120, 200, 0.06, 0.08, 0.05])


def block(start: float, end: float):
    """A block along z; the middle of its face at z = 0 follows a point as a rigid body."""
    count = round(abs(end - start) / 0.02)
    plan = rectangle(np.linspace(start, end, count + 1), np.linspace(-0.04, 0.04, 5))
    mesh = extrude((plan, np.linspace(-0.03, 0.03, 5)))
    x, y, z = mesh.nodes.T
    face = np.flatnonzero((abs(z) < 1e-9) & (abs(x) < 0.0201) & (abs(y) < 0.0151))
    return solid_model(mesh, ALUMINIUM, patches={"joint": Patch(np.zeros(3), face)})


@lru_cache(maxsize=4)
def measured(freq: tuple[float, ...], distance: float, softer: float = 1.0):
    """FRFs of 12 channels a side at a distance from the joint, and their virtual points."""
    parts, sides = [], []
    for start, end, sign in ((-0.12, 0.0, -1), (0.0, 0.1, 1)):
        model, z = block(start, end), sign * distance
        places = np.array([[0.04, 0, z], [-0.04, 0, z], [0, 0.03, z], [0, -0.03, z]])
        names = [f"{model.mesh.near(place) + 1}:{axis}" for place in places for axis in "xyz"]
        parts.append(model.receptance(freq, model.ports(*(f"joint:{d}" for d in DIRECTIONS), *names)))
        sides.append(jf.virtual_point(np.repeat(places, 3, axis=0), np.tile(np.eye(3), (4, 1)), np.zeros(3)))
    joint = jf.Joint(softer * STIFFNESS, DAMPING, DIRECTIONS)
    h = jf.couple(*parts, joint.dynamic_stiffness(np.array(freq)), range(6), range(6))
    own = [*range(6, 18), *range(24, 36)]
    return h[:, own][:, :, own], sides, joint
