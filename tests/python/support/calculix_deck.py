"""Input of CalculiX for natural frequencies and static displacements, and what comes back."""

import subprocess
from pathlib import Path

import numpy as np

_A_LINE = 8


def _numbers(values):
    values = [str(int(v) + 1) for v in values]
    return ",\n".join(", ".join(values[i : i + _A_LINE]) for i in range(0, len(values), _A_LINE))


def deck(mesh, bodies, clamped, step, ties=(), springs=()):
    """Return the deck of a mesh of C3D8I.

    Parameters
    ----------
    mesh : Mesh
    bodies : dict of str to (elements, Material)
    clamped : nodes, counted from 0
    step : lines of the step
    ties : (follower, leader, axis) of nodes, counted from 0, that move alike along an axis 0, 1, 2
    springs : (node, node, axis, N/m)
    """
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{i}, " + ", ".join(f"{c:.17g}" for c in xyz) for i, xyz in enumerate(mesh.nodes, 1)]
    for name, (elements, material) in bodies.items():
        lines.append(f"*ELEMENT, TYPE=C3D8I, ELSET=E{name}")
        lines += [f"{e + 1}, " + ", ".join(str(n + 1) for n in mesh.elements[e]) for e in elements]
        lines += [f"*MATERIAL, NAME=M{name}", "*ELASTIC", f"{material.youngs_modulus:.17g}, {material.poisson:.17g}"]
        lines += ["*DENSITY", f"{material.density:.13g}", f"*SOLID SECTION, ELSET=E{name}, MATERIAL=M{name}"]
    for i, (a, b, axis, stiffness) in enumerate(springs):
        number = len(mesh.elements) + i + 1
        lines += [f"*ELEMENT, TYPE=SPRING2, ELSET=S{i}", f"{number}, {a + 1}, {b + 1}"]
        lines += [f"*SPRING, ELSET=S{i}", f"{axis + 1}, {axis + 1}", f"{stiffness:.17g}"]
    for follower, leader, axis in ties:
        lines += ["*EQUATION", "2", f"{follower + 1}, {axis + 1}, 1., {leader + 1}, {axis + 1}, -1."]
    if len(clamped):
        lines += ["*NSET, NSET=CLAMPED", _numbers(clamped), "*BOUNDARY", "CLAMPED, 1, 3"]
    return "\n".join([*lines, "*STEP", *step, "*END STEP", ""])


def frequency_step(count):
    return ["*FREQUENCY", str(count)]


def static_step(node, force):
    """Return the step of a force, N along x, y, z, at a node counted from 0."""
    loads = [f"{node + 1}, {axis}, {value:.17g}" for axis, value in enumerate(force, 1)]
    return ["*STATIC", "*CLOAD", *loads, "*NODE PRINT, NSET=ALL", "U"]


def run(ccx: str, text: str, folder: Path) -> str:
    """Run CalculiX in a folder on ``model.inp``; return what it prints."""
    folder.mkdir(exist_ok=True)
    (folder / "model.inp").write_text(text)
    done = subprocess.run([ccx, "model"], cwd=folder, capture_output=True, text=True, timeout=900, check=False)
    assert "Job finished" in done.stdout, done.stdout[-2000:]
    return done.stdout


def stored_matrices(ccx: str, text: str, folder: Path, units: str = "SI", more: str = 'joint = ["1:x"]\n') -> Path:
    """Let CalculiX store its matrices; return `part.toml` of them."""
    run(ccx, text, folder)
    keys = 'model = "matrices"\nstiffness = "model.sti"\nmass = "model.mas"\nnodes = "model.inp"\n'
    (folder / "part.toml").write_text(f'{keys}units = "{units}"\n{more}')
    return folder / "part.toml"


def rows(ccx: str, text: str, folder: Path):
    """Run CalculiX and return the rows of numbers of its output."""
    run(ccx, text, folder)
    lines = [line.split() for line in (folder / "model.dat").read_text().splitlines()]
    return [line for line in lines if len(line) > 3 and line[0].isdigit()]


def natural_frequencies(ccx, text, folder):
    """Return frequencies in Hz."""
    # mode, omega^2, omega in rad/s, Hz, imaginary part
    return np.array([float(row[3]) for row in rows(ccx, text, folder) if len(row) == 5])


def displacements(ccx, text, folder):
    """Return the displacements of all nodes, m."""
    found = np.array([[float(value) for value in row] for row in rows(ccx, text, folder)])
    return found[np.argsort(found[:, 0]), 1:]
