"""Write two_bars.uff beside this file: a simulated hammer test of two steel bars that overlap in a joint.

And monday.uff and tuesday.uff: the same joint, hits of each day, the hammer of the second one 2 % off.

.venv/bin/python cases/hammer-test/make.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

import jointfrf as jf
from jointfrf.io import Channel, FrfSet, write_uff

JOINT = jf.Joint(stiffness=[1e7, 5e3], damping=[200.0, 1.0], dofs=["y", "theta"])
SECTION = dict(youngs_modulus=210e9, density=7850.0, width=0.04, height=0.015, loss_factor=0.004)
ELEMENT = 0.005  # m
#: Nodes of the file by their places along each bar in m; the joint is in the middle of the overlap.
POINTS_A = {101: 0.48, 102: 0.50, 103: 0.20}
POINTS_B = {201: 0.00, 202: 0.02, 203: 0.25}
AT_A, AT_B = 0.49, 0.01  # m along each bar
FREQ_HZ = np.arange(20.0, 1001.0, 2.0)
NOISE, SEED = 0.01, 1
#: Points that are hit in a set-up, its gain, the seed of its noise.
SETUPS = {"monday": ((101, 102, 103, 201), 1.0, 2), "tuesday": ((201, 202, 203), 1.02, 3)}


def bar(length: float, at: float, points: dict[int, float]) -> np.ndarray:
    """Receptances of a free bar at the joint (y, theta) and the points (y)."""
    model = jf.beam(length, round(length / ELEMENT), **SECTION)

    def node(place: float) -> int:
        return round(place / ELEMENT) + 1

    names = [f"{node(at)}:y", f"{node(at)}:theta", *(f"{node(place)}:y" for place in points.values())]
    return model.receptance(FREQ_HZ, model.index(*names))


def measured(hit: tuple[int, ...] = (*POINTS_A, *POINTS_B), gain: float = 1.0, seed: int = SEED) -> FrfSet:
    """Accelerances of all points by hits of some, with noise."""
    a, b = bar(0.5, AT_A, POINTS_A), bar(0.4, AT_B, POINTS_B)
    assembly = jf.couple(a, b, JOINT.dynamic_stiffness(FREQ_HZ), [0, 1], [0, 1])
    rows = [2, 3, 4, 7, 8, 9]
    receptance = assembly[:, rows][:, :, rows]
    accelerance = receptance * (2j * np.pi * FREQ_HZ[:, None, None]) ** 2
    places = POINTS_A | {node: AT_A - AT_B + place for node, place in POINTS_B.items()}
    channels = tuple(Channel(node, "+y") for node in places)
    coordinates = {node: np.array([x, 0.0, 0.0]) for node, x in places.items()}
    columns = [i for i, channel in enumerate(channels) if channel.node in hit]
    h = gain * jf.pollute(accelerance[:, :, columns], NOISE, seed=seed)
    return FrfSet(FREQ_HZ, channels, tuple(channels[i] for i in columns), h, "accelerance", coordinates)


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    title = "Simulated hammer test: two steel bars and a lap joint, 1 % noise"
    write_uff(folder / "two_bars.uff", measured(), title=title, single=True)
    for name, setup in SETUPS.items():
        write_uff(folder / f"{name}.uff", measured(*setup), title=f"{title}, {name}", single=True)
