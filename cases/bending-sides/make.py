"""Write test.uff beside this file: a simulated hammer test of two steel bars that a stiff joint holds end to end.

.venv/bin/python cases/bending-sides/make.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

import jointfrf as jf
from jointfrf.io import Channel, FrfSet, write_uff

JOINT = jf.Joint(stiffness=[2e8, 1.5e5], damping=[1000.0, 1.0], dofs=["y", "theta"])
#: What differs from the part files, where it is believed to be 210e9 N/m^2 on both sides.
YOUNGS_MODULUS = {"j": 214e9, "k": 205e9}
SECTION = dict(density=7850.0, width=0.04, height=0.02, loss_factor=0.003)
LENGTH = {"j": 0.3, "k": 0.2}
ELEMENT = 0.01  # m
#: Nodes of the file by their places along x in m, 0 at the joint: sensors and impacts along y.
POINTS = {101: -0.02, 102: -0.04, 103: -0.07, 104: -0.10, 201: 0.02, 202: 0.05, 203: 0.08, 204: 0.11}
FREQ_HZ = np.arange(20.0, 2001.0, 10.0)
NOISE, SEED = 0.01, 5


def bar(side: str) -> np.ndarray:
    """Receptances of a free bar at the joint (y, theta) and its points (y)."""
    model = jf.beam(LENGTH[side], round(LENGTH[side] / ELEMENT), youngs_modulus=YOUNGS_MODULUS[side], **SECTION)
    start = -LENGTH[side] if side == "j" else 0.0

    def node(place: float) -> int:
        return round((place - start) / ELEMENT) + 1

    places = [place for name, place in POINTS.items() if (name < 200) == (side == "j")]
    names = [f"{node(0.0)}:y", f"{node(0.0)}:theta", *(f"{node(place)}:y" for place in places)]
    return model.receptance(FREQ_HZ, model.index(*names))


def measured() -> FrfSet:
    """Accelerances between all points, with noise."""
    a, b = bar("j"), bar("k")
    assembly = jf.couple(a, b, JOINT.dynamic_stiffness(FREQ_HZ), [0, 1], [0, 1])
    rows = [*range(2, a.shape[1]), *range(a.shape[1] + 2, assembly.shape[1])]
    accelerance = assembly[:, rows][:, :, rows] * (2j * np.pi * FREQ_HZ[:, None, None]) ** 2
    channels = tuple(Channel(node, "+y") for node in POINTS)
    coordinates = {node: np.array([x, 0.0, 0.0]) for node, x in POINTS.items()}
    return FrfSet(FREQ_HZ, channels, channels, jf.pollute(accelerance, NOISE, seed=SEED), "accelerance", coordinates)


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    title = "Simulated hammer test: two steel bars end to end and a stiff joint, 1 % noise"
    write_uff(folder / "test.uff", measured(), title=title, single=True)
