"""Memory and processor time of a part of 1e5 DOFs by the matrices that CalculiX stores: reading, facts, reduction.

python tests/accuracy/large_part.py FOLDER    with ccx on PATH; prints a table
"""

import resource
import shutil
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "support"))

import jointfrf as jf
from calculix_deck import stored_matrices
from jointfrf.identification.model.reduced import ReducedSubstructure
from jointfrf.identification.model.substructure import Substructure

#: Bricks along x, y, z of a block of 0.4 x 0.2 x 0.2 m: 105 903 DOFs, compact, so that its factor is large.
CELLS = (40, 20, 40)


def deck() -> str:
    x, y, z = (np.linspace(0, size, n + 1) for size, n in zip((400.0, 200.0, 200.0), CELLS, strict=True))
    places = np.stack(np.meshgrid(x, y, z, indexing="ij"), -1).reshape(-1, 3)
    number = np.arange(1, len(places) + 1).reshape(len(x), len(y), len(z))
    corner = []
    for i, j, k in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)):
        cut = tuple(slice(a, a + n) for a, n in zip((i, j, k), CELLS, strict=True))
        corner.append(number[cut].ravel())
    lines = ["*NODE", *(f"{i}, {a:.9g}, {b:.9g}, {c:.9g}" for i, (a, b, c) in enumerate(places, 1))]
    lines += ["*ELEMENT, TYPE=C3D8, ELSET=E"]
    lines += [f"{i}, " + ", ".join(map(str, row)) for i, row in enumerate(np.array(corner).T, 1)]
    lines += [
        "*MATERIAL, NAME=M",
        "*ELASTIC",
        "70000., 0.33",
        "*DENSITY",
        "2.7e-9",
        "*SOLID SECTION, ELSET=E, MATERIAL=M",
    ]
    return "\n".join([*lines, "*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "1", "*END STEP", ""])


def report(what: str, since: float) -> float:
    now = time.process_time()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"| {what} | {now - since:.1f} | {peak:.2f} |", flush=True)
    return time.process_time()


def main(folder: Path) -> None:
    more = 'joint = ["1:x", "1:y"]\nloss_factor = 0.01\n'
    path = folder / "part.toml"
    if not path.exists():
        stored_matrices(shutil.which("ccx") or "ccx", deck(), folder, "mm-t-s", more)
    print("| step | processor time, s | peak memory, GB |\n|---|---|---|")
    at = time.process_time()
    part = jf.read_part(path)
    at = report(f"read {len(part.structure.model.dofs)} DOFs", at)
    lines = part.describe()
    at = report("facts", at)
    freq = np.linspace(50, 5000, 800)
    last = list(part.places)[-1]
    dofs = ["1:x", "1:y", "1:z", f"{last}:x", f"{last}:y", f"{last}:z"]
    reduced = ReducedSubstructure("A", Substructure(part.structure.model, ["1:x", "1:y"]), freq, dofs)
    reduced.at({})
    report(f"reduction to {reduced.basis.shape[1]} vectors, FRFs of {len(dofs)} DOFs at 800 lines", at)
    print("\n".join(lines))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
