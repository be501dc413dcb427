"""Write level_1.uff to level_8.uff beside this file: a simulated shaker test of a beam with a lap joint.

.venv/bin/python cases/lap-beam/make.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np

import jointfrf as jf
from jointfrf.io import Channel, FrfSet, write_uff

#: The joint at each level of the shaker: rotational stiffness in N m/rad falls, its loss factor rises.
STIFFNESS = np.array([1.200e5, 1.196e5, 1.189e5, 1.178e5, 1.163e5, 1.142e5, 1.115e5, 1.080e5])
LOSS_FACTOR = np.array([0.006, 0.008, 0.011, 0.015, 0.020, 0.027, 0.036, 0.048])
#: What differs from assembly.toml, where it is believed to be 1, 1, 0.001, 3 g and 1.
YOUNGS_MODULUS = {"A": 1.006, "B": 0.997}
STEEL = 0.0012
SENSOR, GAIN = 0.0033, 0.99
SECTION = dict(density=7850.0, width=0.0254, height=0.0254)
#: DOFs of the channels: the shaker at the first one.
CHANNELS = {11: "A/1:y", 12: "A/15:y", 21: "B/9:y", 22: "B/25:y"}
FREQ_HZ = np.arange(180.0, 1501.0, 1.0)
NOISE = 0.05


def beam_with_joint(stiffness: float, loss_factor: float) -> jf.Assembly:
    """Return the beam: two halves of 360 mm; the lap turns, and does not slide."""
    halves = [
        jf.beam(0.36, 24, youngs_modulus=YOUNGS_MODULUS[side] * 210e9, loss_factor=STEEL, **SECTION) for side in "AB"
    ]
    joint = jf.LawJoint({"theta_z": jf.SpringLaw(stiffness, h=loss_factor * stiffness)}, ["y"], dofs=["y", "theta_z"])
    return jf.Assembly(
        jf.Substructure(halves[0], ["25:y", "25:theta"]),
        jf.Substructure(halves[1], ["1:y", "1:theta"]),
        joint,
        [jf.AddedMass(dof, SENSOR) for dof in CHANNELS.values()],
    )


def measured(level: int) -> FrfSet:
    """Accelerances of one level, counted from 0, with noise."""
    whole, dofs = beam_with_joint(STIFFNESS[level], LOSS_FACTOR[level]), list(CHANNELS.values())
    receptance = GAIN * whole.receptance(FREQ_HZ, dofs, dofs[:1])
    accelerance = receptance * (2j * np.pi * FREQ_HZ[:, None, None]) ** 2
    channels = tuple(Channel(node, "+y") for node in CHANNELS)
    h = jf.pollute(accelerance, NOISE, seed=100 + level)
    return FrfSet(FREQ_HZ, channels, channels[:1], h, "accelerance")


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for level in range(len(STIFFNESS)):
        title = f"Simulated shaker test of a beam with a lap joint, level {level + 1}, 5 % noise"
        write_uff(folder / f"level_{level + 1}.uff", measured(level), title=title, single=True)
