"""Write the saved fits and tests.csv beside this file: a simulated round robin of one bolted joint.

.venv/bin/python cases/bolted-round-robin/make.py [FOLDER]
"""

import csv
import sys
from pathlib import Path

import numpy as np

import jointfrf as jf

#: Of k_y and k_theta at 15 N m, N/m and N m/rad; viscous damping is the same in all.
MEAN = np.array([4e6, 2.5e3])
DAMPING = np.array([60.0, 0.6])
#: Relative spread between assemblies, and between two tests of one assembly after it was tightened anew.
BETWEEN, REPEAT = 0.12, 0.02
#: k grows with torque to this power.
EXPONENT = 0.3
TORQUES = (10, 15, 20)
ASSEMBLIES = 7
FREQ_HZ = np.arange(20.0, 1001.0, 4.0)
NOISE = 0.02
SECTION = dict(youngs_modulus=210e9, density=7850.0, width=0.02, height=0.01, loss_factor=0.002)


def fitted(stiffness: np.ndarray, seed: int) -> jf.Fit:
    """Identify the joint between two steel bars from simulated FRFs at the joint."""
    a, b = (jf.beam(length, 12, **SECTION) for length in (0.3, 0.22))
    joint = jf.Joint(stiffness, DAMPING, ["y", "theta"])
    h_a, h_b = a.receptance(FREQ_HZ, a.ports("13:y", "13:theta")), b.receptance(FREQ_HZ, b.ports("1:y", "1:theta"))
    gamma = jf.couple(h_a, h_b, joint.dynamic_stiffness(FREQ_HZ), [0, 1], [0, 1])
    return jf.identify(FREQ_HZ, jf.pollute(gamma, NOISE, seed=seed), ["y", "theta"], damping="viscous")


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    random = np.random.default_rng(11)
    rows = []
    for assembly in range(1, ASSEMBLIES + 1):
        own = random.normal(0, BETWEEN, 2)
        for torque in TORQUES:
            level = np.log(MEAN) + own + random.normal(0, REPEAT, 2) + EXPONENT * np.log(torque / 15)
            name = f"assembly_{assembly}_{torque}_Nm.json"
            jf.save(fitted(np.exp(level), seed=100 * assembly + torque), folder / name, lines=False)
            rows.append((name, assembly, torque, "AB"[random.integers(2)]))
    with open(folder / "tests.csv", "w", newline="", encoding="utf-8") as table:
        csv.writer(table, lineterminator="\n").writerows([("file", "assembly", "torque", "operator"), *rows])
