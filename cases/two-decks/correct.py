"""Natural frequencies of the model of both bars, with a rigid lap and corrected by the fit, beside the measured ones.

python correct.py     in a folder with the decks, test.uff, joint.inp and joint.json; needs CalculiX (ccx)
"""

import re
import subprocess
from pathlib import Path

import numpy as np

import jointfrf as jf
from jointfrf.workbench.fe.nodes import read_nodes

#: A pole of a mode has less damping than this; those of noise and of modes beyond the band more.
MODE = 0.01


def scaled(text: str, keyword: str, factor: float) -> str:
    """Return a deck with the first number after a keyword multiplied."""
    return re.sub(rf"(\*{keyword}.*\n)([^,\s]+)", lambda own: f"{own[1]}{factor * float(own[2]):.8g}", text)


def frequencies(folder: Path, joint: str, factors: dict[str, float], sensors: str) -> np.ndarray:
    """Run CalculiX; return the natural frequencies above the rigid motions, Hz."""
    folder.mkdir(exist_ok=True)
    for side in "AB":
        deck = Path(f"{side.lower()}.inp").read_text()
        deck = scaled(deck, "ELASTIC", factors[f"{side}/youngs_modulus"])
        (folder / f"{side.lower()}.inp").write_text(scaled(deck, "DENSITY", factors[f"{side}/density"]))
    (folder / "joint.inp").write_text(joint)
    (folder / "whole.inp").write_text(Path("whole.inp").read_text().replace("*MASS, ELSET=SENSORS\n2.0E-6", sensors))
    subprocess.run(["ccx", "whole"], cwd=folder, check=True, capture_output=True)
    rows = [line.split() for line in (folder / "whole.dat").read_text().splitlines()]
    found = np.array([float(row[3]) for row in rows if len(row) == 5 and row[0].isdigit()])
    return found[found > 1]


fit = jf.load("joint.json")
faces = [read_nodes(Path(f"{side}.inp")).sets[f"LAP{side.upper()}"] for side in "ab"]
rigid = jf.LawJoint({}, rigid=["x", "y", "z", "theta_x", "theta_y", "theta_z"]).export(
    "calculix", (9001, 9002), rotation_nodes=(9003, 9004), faces=[[int(node) for node in face] for face in faces]
)
mass = np.mean([value for name, value in fit.value.items() if name.startswith("mass")])
believed = frequencies(Path("believed"), rigid, dict.fromkeys(fit.value, 1.0), "*MASS, ELSET=SENSORS\n2.0E-6")
corrected = frequencies(
    Path("corrected"), Path("joint.inp").read_text(), fit.value, f"*MASS, ELSET=SENSORS\n{1e-3 * mass:.6g}"
)
frfs = jf.io.read_frfs("test.uff").receptance()
poles = np.concatenate(jf.smooth_frfs(frfs.freq_hz, frfs.h, reciprocal=False).poles)
size = abs(poles)
inside = (-poles.real < MODE * size) & (size > 2 * np.pi * frfs.freq_hz[0]) & (size < 2 * np.pi * frfs.freq_hz[-1])
measured = np.sort(size[inside]) / (2 * np.pi)

print("measured, Hz  rigid lap, Hz         corrected, Hz")
for i, hz in enumerate(measured):
    row = [f"{own[i]:8.1f} ({100 * (own[i] / hz - 1):+.2f} %)" for own in (believed, corrected)]
    print(f"{hz:12.1f}  {row[0]:20}  {row[1]}")
