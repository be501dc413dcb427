"""Write test.uff beside this file: simulated FRFs of two plates at their two bolts, six DOFs on each side of each.

.venv/bin/python cases/two-bolts/make.py [FOLDER]
"""

import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np

import jointfrf as jf
from jointfrf.io import Channel, FrfSet, write_uff
from jointfrf.workbench.solids.solid import Patch, SolidModel, solid_model

DOFS = ("x", "y", "z", "theta_x", "theta_y", "theta_z")
#: Where the bolts are along z, m; the plates lie on each other at y = 3 mm, plate A below.
BOLTS = {"bolt1": 0.24, "bolt2": 0.36}
THICKNESS, WIDTH = 0.003, 0.06  # m
#: Start and length of the plates along z, m.
SPANS = {"A": (0.0, 0.405), "B": (0.195, 0.33)}
ALUMINIUM = jf.Material(70e9, 0.33, 2700.0, loss_factor=0.01)
#: Each bolt holds a square of this half width.
HALF = 0.0151
#: Stiffness of bolt1 (N/m, N m/rad) and its cross terms relative to the roots of both; bolt2 has less of all.
STIFFNESS = (4e6, 2e6, 4e6, 300.0, 500.0, 300.0)
CROSS = {("x", "theta_y"): 0.2, ("z", "theta_x"): -0.3, ("x", "theta_z"): 0.1}
SHARE = {"bolt1": 1.0, "bolt2": 0.7}
LOSS_FACTOR = 0.05
FREQ_HZ = np.arange(200.0, 1501.0, 10.0)
NOISE, SEED = 0.01, 1
#: Nodes of the file.
NODES = {"bolt1": (101, 201), "bolt2": (102, 202)}


def plate(name: str) -> SolidModel:
    """Return a plate of bricks with the reference points of both bolts on the face between the plates."""
    start, length = SPANS[name]
    low = 0.0 if name == "A" else THICKNESS
    size = (4, 1, round(length / 0.015))
    mesh = jf.brick_beam(length, WIDTH, THICKNESS, ALUMINIUM, divisions=size, origin=(0, low, start)).mesh
    patches = {}
    for bolt, z in BOLTS.items():
        point = np.array([0.0, THICKNESS, z])
        away = abs(mesh.nodes - point)
        patches[bolt] = Patch(point, np.flatnonzero((away[:, 1] < 1e-6) & (away[:, [0, 2]] < HALF).all(axis=1)))
    return solid_model(mesh, ALUMINIUM, patches=patches)


def stiffness(share: float) -> np.ndarray:
    """Return the stiffness of a bolt that has this share of that of bolt1, shape (6, 6)."""
    k = np.diag(STIFFNESS)
    for (row, column), relative in CROSS.items():
        a, b = DOFS.index(row), DOFS.index(column)
        k[a, b] = k[b, a] = relative * np.sqrt(k[a, a] * k[b, b])
    return share * k


def joint(shares: Mapping[str, float] = SHARE) -> jf.Joint:
    """Return the joint of both bolts, which are not coupled with each other, DOFs bolt1.x to bolt2.theta_z."""
    k = np.zeros((12, 12))
    for i, bolt in enumerate(BOLTS):
        k[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = stiffness(shares[bolt])
    dofs = [f"{bolt}.{dof}" for bolt in BOLTS for dof in DOFS]
    return jf.Joint(k, dofs=dofs, structural_damping=LOSS_FACTOR * k)


def exact(bolts: jf.Joint) -> np.ndarray:
    """Return receptances of the assembly: bolt1, bolt2 of A, then of B, shape (n_freq, 24, 24), m/N."""
    dofs = [f"{bolt}:{dof}" for bolt in BOLTS for dof in DOFS]
    h_a, h_b = (model.receptance(FREQ_HZ, model.ports(*dofs)) for model in map(plate, SPANS))
    return jf.couple(h_a, h_b, bolts.dynamic_stiffness(FREQ_HZ), range(12), range(12))


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    names = ("+x", "+y", "+z", "+rx", "+ry", "+rz")
    channels = tuple(Channel(NODES[bolt][side], way) for side in (0, 1) for bolt in BOLTS for way in names)
    h = jf.pollute(exact(joint()), NOISE, seed=SEED)
    places = {node: np.array([0.0, THICKNESS, z]) for bolt, z in BOLTS.items() for node in NODES[bolt]}
    frfs = FrfSet(FREQ_HZ, channels, channels, h, "receptance", places)
    write_uff(folder / "test.uff", frfs, title="Simulated FRFs of two plates at both bolts, 1 % noise", single=True)
