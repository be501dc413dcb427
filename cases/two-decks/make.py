"""Write the decks a.inp and b.inp, and test.uff, a simulated hammer test of both bars with their lap joint.

.venv/bin/python cases/two-decks/make.py [FOLDER]     needs CalculiX (ccx)

The bars tested are not quite those of the decks: E and density differ, sensors weigh more, the hammer is off.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import jointfrf as jf
from jointfrf.io import Channel, FrfSet, write_uff

#: Where each bar lies, mm: along z, across x, up y. They overlap by 30 mm.
SPAN = {"a": ((0.0, 240.0), (0.0, 30.0), (0.0, 12.0)), "b": ((210.0, 390.0), (0.0, 30.0), (12.0, 24.0))}
LAP = (210.0, 240.0, 12.0)  # z, z, y
#: First node and element of each deck, so that one deck can hold both.
FIRST = {"a": 1, "b": 5001}
#: Believed: aluminium. N/mm^2, t/mm^3.
E, NU, RHO = 70e3, 0.33, 2.7e-9
#: What is true instead.
TRUE_E, TRUE_RHO, LOSS_FACTOR = {"a": 0.985 * E, "b": 1.01 * E}, {"a": 1.004 * RHO, "b": 0.997 * RHO}, 0.002
STIFFNESS = {"theta_x": 5e3, "theta_z": 2.5e3}  # N m/rad; rigid in all else
JOINT_LOSS = {"theta_x": 0.03, "theta_z": 0.02}
SENSOR = 0.0022  # kg
GAIN = 0.992  # of the hammer: measured over true FRFs
#: Places of the test points, mm: on top of the bars.
POINTS = {1: ("a", (0, 12, 0)), 2: ("a", (30, 12, 120)), 3: ("b", (30, 24, 270)), 4: ("b", (0, 24, 390))}
HAMMER = (1, 4)
FREQ_HZ = np.arange(100.0, 2301.0, 2.0)
NOISE, SEED = 0.02, 12
#: Bricks along z, x, y.
SIZE = (10.0, 10.0, 6.0)


def planes(bar: str) -> list[np.ndarray]:
    """Return where the planes of nodes are along z, x, y."""
    return [np.linspace(low, high, round((high - low) / size) + 1)
            for (low, high), size in zip(SPAN[bar], SIZE, strict=True)]  # fmt: skip


def deck(bar: str, modulus: float = E, density: float = RHO) -> str:
    """Return mesh, material and the set of nodes under the lap; mm, t, s."""
    z, x, y = planes(bar)
    count = [len(axis) for axis in (z, x, y)]
    number = FIRST[bar] + np.arange(np.prod(count)).reshape(count)
    lines = [f"** bar {bar}: mm, t, s, N", f"*NODE, NSET=N{bar.upper()}"]
    lines += [f"{number[i, j, k]}, {x[j]:g}, {y[k]:g}, {z[i]:g}" for i, j, k in np.ndindex(*count)]
    lines.append(f"*ELEMENT, TYPE=C3D8I, ELSET=E{bar.upper()}")
    for e, (i, j, k) in enumerate(np.ndindex(*(n - 1 for n in count))):
        corners = [number[i + a, j + b, k + c] for a in (0, 1) for b, c in ((0, 0), (1, 0), (1, 1), (0, 1))]
        lines.append(", ".join(map(str, (FIRST[bar] + e, *corners))))
    at = [np.flatnonzero((LAP[0] <= z) & (z <= LAP[1])), range(len(x)), np.flatnonzero(y == LAP[2])]
    lap = number[np.ix_(*at)].ravel()
    lines.append(f"*NSET, NSET=LAP{bar.upper()}")
    lines += [", ".join(map(str, lap[i : i + 8])) + "," for i in range(0, lap.size, 8)]
    lines += [f"*MATERIAL, NAME=M{bar.upper()}", "*ELASTIC", f"{modulus:.8g}, {NU}", "*DENSITY", f"{density:.8g}"]
    return "\n".join([*lines, f"*SOLID SECTION, ELSET=E{bar.upper()}, MATERIAL=M{bar.upper()}", ""])


def tested(bar: str, folder: Path) -> jf.AssemblyPart:
    """Return the bar that is tested, by way of CalculiX."""
    (folder / f"{bar}.inp").write_text(deck(bar, TRUE_E[bar], TRUE_RHO[bar]))
    (folder / f"store_{bar}.inp").write_text(STORE.format(bar=bar))
    subprocess.run(["ccx", f"store_{bar}"], cwd=folder, check=True, capture_output=True)
    (folder / f"{bar}.toml").write_text(
        f'model = "matrices"\nstiffness = "store_{bar}.sti"\nmass = "store_{bar}.mas"\nnodes = "{bar}.inp"\n'
        f'units = "mm-t-s"\nloss_factor = {LOSS_FACTOR}\njoint = ["lap:y"]\n'
        f'[[point]]\nname = "lap"\nset = "LAP{bar.upper()}"\ncoupling = "rigid"\n'
    )
    return jf.read_part(folder / f"{bar}.toml")


#: A deck that stores the matrices of a bar.
STORE = "*INCLUDE, INPUT={bar}.inp\n*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n1\n*END STEP\n"


def measured() -> FrfSet:
    """Accelerances of the test, with noise."""
    with TemporaryDirectory() as folder:
        parts = {bar: tested(bar, Path(folder)) for bar in "ab"}
    laws = {dof: jf.SpringLaw(k, h=JOINT_LOSS[dof] * k) for dof, k in STIFFNESS.items()}
    names = ("x", "y", "z", "theta_x", "theta_y", "theta_z")
    joint = jf.LawJoint(laws, [name for name in names if name not in laws], dofs=names)
    sides = [jf.Substructure(parts[bar].structure.model, [f"lap:{name}" for name in names], exact=True) for bar in "ab"]
    nodes = {}
    for number, (bar, at) in POINTS.items():
        away = {node: np.linalg.norm(1e3 * place - at) for node, place in parts[bar].places.items()}
        nodes[number] = f"{bar.upper()}/{min(away, key=away.__getitem__)}"
    masses = [jf.AddedMass(tuple(f"{node}:{way}" for way in "xyz"), SENSOR) for node in nodes.values()]
    dofs = [f"{node}:y" for node in nodes.values()]
    driven = [f"{nodes[number]}:y" for number in HAMMER]
    h = jf.Assembly(*sides, joint, masses).receptance(FREQ_HZ, dofs, driven)
    h = jf.pollute(GAIN * h * (2j * np.pi * FREQ_HZ[:, None, None]) ** 2, NOISE, seed=SEED)
    channels = [Channel(number, "+y") for number in POINTS]
    places = {number: 1e-3 * np.array(at, float) for number, (_, at) in POINTS.items()}
    return FrfSet(FREQ_HZ, channels, [Channel(number, "+y") for number in HAMMER], h, "accelerance", coordinates=places)


if __name__ == "__main__":
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for name in "ab":
        (target / f"{name}.inp").write_text(deck(name))
        (target / f"store_{name}.inp").write_text(STORE.format(bar=name))
    write_uff(target / "test.uff", measured(), title="Simulated hammer test of two bars with a lap joint", single=True)
