"""Write test.uff beside this file: a simulated hammer test of a frame of four plates on four columns.

.venv/bin/python cases/four-floors/make.py [FOLDER]
"""

import sys
import tomllib
from pathlib import Path

import numpy as np

import jointfrf as jf
from jointfrf.io import Channel, FrfSet, write_uff

KEYS = tomllib.loads(Path(__file__).with_name("assembly.toml").read_text())
#: Each of the sixteen joints of a column and a plate: it turns, N m/rad, and does not slide.
STIFFNESS, LOSS_FACTOR = 2e4, 0.04
#: What differs from assembly.toml: Young's modulus of the columns.
YOUNGS_MODULUS = 1.006 * 210e9
FREQ_HZ = np.arange(0.0, 100.1, 0.5)
#: Of each FRF, on each line.
NOISE = 0.045
HIT = "4:+y"


def frame() -> jf.Assembly:
    """Return the assembly as it is."""
    joint = jf.LawJoint({"theta_z": jf.SpringLaw(STIFFNESS, h=LOSS_FACTOR * STIFFNESS)}, ["y"], dofs=["y", "theta_z"])
    parts = {}
    for name, own in KEYS["parts"].items():
        if own["model"] == "beam":
            section = {key: own[key] for key in ("density", "width", "height", "loss_factor")}
            model = jf.beam(own["length"], own["elements"], youngs_modulus=YOUNGS_MODULUS, **section)
        else:
            model = jf.rigid_body(own["mass"], own["inertia"], own["points"], moves=own["moves"])
        parts[name] = jf.Substructure(model, exact=True)
    joints = {name: jf.PlacedJoint(joint, own["j"], own["k"]) for name, own in KEYS["joints"].items()}
    return jf.Assembly.of_parts(parts, joints, [jf.AddedMass(one["dofs"], one["mass"]) for one in KEYS["mass"]])


def measured(seed: int = 1) -> FrfSet:
    """Accelerances with noise of this seed; at 0 Hz none is measured."""
    freq, dofs = FREQ_HZ[1:], KEYS["channels"]
    receptance = frame().receptance(freq, list(dofs.values()), [dofs[HIT]])
    accelerance = receptance * (2j * np.pi * freq[:, None, None]) ** 2
    channels = tuple(map(Channel.parse, dofs))
    return FrfSet(freq, channels, (Channel.parse(HIT),), jf.pollute(accelerance, NOISE, seed=seed), "accelerance")


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    title = "Simulated hammer test of a frame of four floors, 4.5 % noise"
    write_uff(folder / "test.uff", measured(), title=title, single=True)
