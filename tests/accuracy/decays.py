"""k(a) and eta(a) of a beam with an Iwan joint from free decays, moved through time: how often their intervals hold.

Prints the table of docs/accuracy.md. Draw i is a beam of its own, with the seed [11, i]: Young's moduli of both halves
are believed to 1 %, their loss factors, 0.001, to 50 %. A hit of 60 N (half a sine of 3 ms) at the free end of A; four
accelerometers, 2048 Hz, 1.75 s, noise of 0.05 m/s^2, offset, drift and 150 samples before the hit: seed [12, i].

decays [--draws N]
"""

import argparse
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

import jointfrf as jf

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "support"))

from harmonic_balance import IwanBeam, Sliders, believed, iwan_beam
from ring_down import ring_down

CHANNELS = ["A/1:y", "A/15:y", "B/9:y", "B/25:y"]
RATE, NOISE, BEFORE = 2048.0, 0.05, 150
#: Slip moment in N m, stiffness at rest in N m/rad, chi, beta.
IWAN = {"slip_force": 20.0, "k": 1.2e5, "chi": -0.4, "beta": 0.8}
#: Rows of the table.
CLASSES = 6


def truth(number: int) -> IwanBeam:
    """Return the beam of a draw, with as much viscous damping of its halves at the mode."""
    rng = np.random.default_rng([11, number])
    moduli, losses = 210e9 * (1 + 0.01 * rng.normal(size=2)), 0.001 + 0.0005 * rng.normal(size=2)
    own = iwan_beam(
        Sliders.iwan(*IWAN.values()), youngs_modulus=tuple(moduli), loss_factor=tuple(np.maximum(losses, 1e-5))
    )
    return replace(own, stiffness=own.stiffness.real, damping=own.stiffness.imag / (2 * np.pi * 235))


def measured(acceleration: np.ndarray, number: int) -> jf.DecayRecord:
    """Return what the accelerometers show."""
    rng = np.random.default_rng([12, number])
    x = np.vstack([np.zeros((BEFORE, 4)), acceleration])
    x = x + NOISE * rng.normal(size=x.shape) + rng.normal(size=4)
    x += np.linspace(0, 1, len(x))[:, None] * rng.normal(size=4)
    return jf.DecayRecord(np.arange(len(x)) / RATE, x, CHANNELS)


def main() -> None:
    """Print the table, and how often the intervals of the Iwan law hold."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=50)
    args = parser.parse_args()
    warnings.simplefilter("ignore")
    beams = [truth(i) for i in range(args.draws)]
    moved = ring_down(beams, RATE, 1.75, hit=60.0)
    rows, laws = list[list[float]](), list[list[bool]]()
    for i, acceleration in enumerate(moved.acceleration):
        mode = jf.decay_of_mode(measured(acceleration, i), 236)
        found = jf.decay_levels(believed(), mode, laws=["iwan"])
        if found.laws:
            own = found.laws["theta_z"].fits[0].intervals
            laws.append([own[name][0] <= value <= own[name][1] for name, value in IWAN.items()])
        for one in found.levels["theta_z"]:
            k = beams[i].joint.first_harmonic(np.array([one.amplitude]))[0]
            pairs = (one.stiffness, k.real), (one.loss_factor, k.imag / k.real)
            inside = [each.low <= true <= each.high for each, true in pairs]
            off = [(each.value - true) / each.std_error for each, true in pairs]
            width = [196 * each.std_error / true for each, true in pairs]
            rows.append([one.amplitude, k.real, k.imag / k.real, *width, *inside, *off])
    table = np.array(sorted(rows))
    print("| a, rad | levels | k, N m/rad | eta | +- k, % | +- eta, % | k inside, % | eta inside, % | scatter/error |"
          "\n|---|---|---|---|---|---|---|---|---|")  # fmt: skip
    for part in np.array_split(table, CLASSES):
        a, k, eta, of_k, of_eta = np.median(part[:, :5], axis=0)
        share, spread = 100 * part[:, 5:7].mean(axis=0), part[:, 7:].std(axis=0)
        print(f"| {a:.2e} | {len(part)} | {k:.4g} | {eta:.3g} | {of_k:.2g} | {of_eta:.2g} | {share[0]:.0f} | "
              f"{share[1]:.0f} | {spread[0]:.2f}/{spread[1]:.2f} |")  # fmt: skip
    share = 100 * table[:, 5:7].mean(axis=0)
    print(f"| all | {len(table)} | | | | | {share[0]:.1f} | {share[1]:.1f} | |")
    print()
    shown = ", ".join(f"{name} {100 * one:.0f} %" for name, one in zip(IWAN, np.mean(laws, axis=0), strict=True))
    print(f"Parameters of the Iwan law inside, of {len(laws)} draws: {shown}")


if __name__ == "__main__":
    main()
