"""Write test.uff beside this file: a simulated hammer test of a machine on four rubber mounts on two rails.

.venv/bin/python cases/four-mounts/make.py [FOLDER]
"""

import sys
import tomllib
from pathlib import Path

import numpy as np

import jointfrf as jf
from jointfrf.io import Channel, FrfSet, write_uff

KEYS = tomllib.loads(Path(__file__).with_name("assembly.toml").read_text())
#: Stiffness along x, y, z of mounts of the mean size, N/m, and their loss factor.
STIFFNESS = np.array([1.4e5, 2.6e5, 1.5e5])
LOSS_FACTOR = 0.12
#: The mounts are of one batch: normally distributed, 8 %, by direction.
SPREAD = 0.08
#: What differs from assembly.toml: mass of the machine, moduli of the rails.
MASS = 60.4
YOUNGS_MODULUS = {"left": 1.006 * 210e9, "right": 0.995 * 210e9}
FREQ_HZ = np.arange(5.0, 200.5, 1.0)
NOISE = 0.02
#: Hits.
HITS = ("1:+x", "2:+y", "3:+z", "12:+y")
DIRECTIONS = ("x", "y", "z")


def mounts(seed: int) -> dict[str, np.ndarray]:
    """Stiffnesses of the four mounts along x, y, z, N/m."""
    of_batch = np.random.default_rng(seed).standard_normal((4, 3))
    return dict(zip(KEYS["joints"], STIFFNESS * (1 + SPREAD * of_batch), strict=True))


def machine_on_mounts(seed: int) -> jf.Assembly:
    """Return the assembly as it is, with the mounts of this seed."""
    own = KEYS["parts"]["machine"]
    size = MASS / own["mass"]
    parts = {
        "machine": jf.Substructure(jf.rigid_body(MASS, size * np.array(own["inertia"]), own["points"]), exact=True)
    }
    for name, modulus in YOUNGS_MODULUS.items():
        own = KEYS["parts"][name]
        steel = jf.Material(modulus, own["poisson"], own["density"], own["loss_factor"])
        rail = jf.brick_beam(
            own["length"], own["width"], own["height"], steel, ends=("clamped", "clamped"), observed=own["observed"],
            divisions=tuple(own["divisions"]),
        )  # fmt: skip
        parts[name] = jf.Substructure(rail, exact=True)
    joints = {
        name: jf.PlacedJoint(
            jf.Joint(k, dofs=DIRECTIONS, loss_factor=LOSS_FACTOR), KEYS["joints"][name]["j"], KEYS["joints"][name]["k"]
        )
        for name, k in mounts(seed).items()
    }
    return jf.Assembly.of_parts(parts, joints)


def measured(seed: int = 1) -> FrfSet:
    """Accelerances with noise; mounts and noise of this seed."""
    channels, hits = (tuple(map(Channel.parse, names)) for names in (KEYS["channels"], HITS))
    dofs = KEYS["channels"]
    receptance = machine_on_mounts(seed).receptance(FREQ_HZ, list(dofs.values()), [dofs[hit] for hit in HITS])
    accelerance = receptance * (2j * np.pi * FREQ_HZ[:, None, None]) ** 2
    return FrfSet(FREQ_HZ, channels, hits, jf.pollute(accelerance, NOISE, seed=seed), "accelerance")


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    title = "Simulated hammer test of a machine on four rubber mounts, 2 % noise"
    write_uff(folder / "test.uff", measured(), title=title, single=True)
