"""Write level_1.uff to level_8.uff, backbone.csv (by harmonic balance) and decay.csv (through time) beside this file.

PYTHONPATH=tests/python/support .venv/bin/python cases/iwan-beam/make.py [FOLDER]
"""

import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import jointfrf as jf
from harmonic_balance import Sliders, iwan_beam
from jointfrf.io import Channel, FrfSet, write_uff
from ring_down import ring_down

#: Slip moment in N m, stiffness at rest in N m/rad, chi, beta.
IWAN = (20.0, 1.2e5, -0.4, 0.8)
#: Peak displacement at which the free end of B is held, m.
LEVELS = [6e-07, 1.13e-06, 2.12e-06, 4e-06, 7.5e-06, 1.41e-05, 2.66e-05, 5e-05]
FREQ_HZ = np.arange(180.0, 400.5, 2.0)
NOISE = 0.01
#: Nodes of the channels in the file: A/1, driven, A/15, B/9, B/25, held.
NODES = (11, 12, 21, 22)


def measured(level: int) -> FrfSet:
    """Receptances of one level, counted from 0, with noise."""
    beam = iwan_beam(Sliders.iwan(*IWAN), youngs_modulus=(1.004 * 210e9, 0.998 * 210e9), loss_factor=0.0012)
    steady = beam.at_response(FREQ_HZ, 3, LEVELS[level])
    channels = tuple(Channel(node, "+y") for node in NODES)
    return FrfSet(FREQ_HZ, channels, channels[:1], jf.pollute(steady.h[:, :, None], NOISE, seed=level))


def backbone() -> str:
    """Phase resonances of the first bending mode: the free end of A lags the force there by 90 degrees; with errors."""
    beam = iwan_beam(Sliders.iwan(*IWAN), youngs_modulus=(1.004 * 210e9, 0.998 * 210e9), loss_factor=0.0012)
    rng, rows = np.random.default_rng(0), ["frequency,amplitude,force"]
    for joint in np.geomspace(2e-6, 2e-4, 8):
        at = partial(beam.at_joint_amplitude, amplitude=np.array([joint]))
        freq = brentq(lambda freq, at=at: at(np.array([freq])).h[0, 0].real, 222, 240)
        steady = at(np.array([freq]))
        force, amplitude = steady.force[0], abs(steady.h[0, 0]) * steady.force[0]
        off = 1 + np.array([0.001, 0.05]) * rng.normal(size=2)
        rows.append(f"{freq * off[0]:.3f},{amplitude * off[1]:.4g},{force:.4g}")
    return "\n".join(rows) + "\n"


def decay() -> str:
    """Return a ring-down after a hit at the free end of A: three accelerometers with offset, drift and noise."""
    beam = iwan_beam(Sliders.iwan(*IWAN), youngs_modulus=(1.004 * 210e9, 0.998 * 210e9), loss_factor=0.0012)
    viscous = beam.stiffness.imag / (2 * np.pi * 235)  # as much at the mode
    own = ring_down([replace(beam, stiffness=beam.stiffness.real, damping=viscous)], 2048.0, 1.2, hit=60.0, pulse=4e-3)
    motion = np.vstack([np.zeros((100, 3)), own.acceleration[0][:, [0, 1, 3]] * [1, 1, -1]])
    rng, time = np.random.default_rng(0), np.arange(len(motion)) / 2048
    motion += 0.03 * rng.normal(size=motion.shape) + [0.4, -0.2, 0.3] + time[:, None] * [0.1, 0.3, -0.2]
    rows = ["time [s],11:+y [m/s^2],12:+y [m/s^2],22:-y [m/s^2]"]
    rows += [f"{t:.6f},{','.join(f'{one:.3f}' for one in own)}" for t, own in zip(time, motion, strict=True)]
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for level, held in enumerate(LEVELS):
        title = f"Simulated stepped sine, free end of B held at {held:g} m"
        write_uff(folder / f"level_{level + 1}.uff", measured(level), title=title, single=True)
    (folder / "backbone.csv").write_text(backbone())
    (folder / "decay.csv").write_text(decay())
