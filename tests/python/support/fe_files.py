"""Files of matrices and nodes as finite-element programs write them, of one small model, in any units."""

from pathlib import Path

import numpy as np
import scipy.io
from scipy import sparse

import jointfrf as jf

CODES = {"x": 1, "y": 2, "z": 3, "theta_x": 4, "theta_y": 5, "theta_z": 6, "q": 0}
#: m, kg and s in units of a system.
IN_UNITS = {"SI": (1.0, 1.0, 1.0), "mm-t-s": (1e3, 1e-3, 1.0), "mm-kg-ms": (1e3, 1.0, 1e3)}


def block(ends=("free", "free"), length=0.12):
    """A small block of bricks, with the places of its nodes."""
    return jf.brick_beam(length, 0.03, 0.02, jf.Material(70e9, 0.33, 2700.0), ends=ends, preset="accurate")


def in_units(model, units):
    """K, M and coordinates in other units."""
    metre, kilogram, second = IN_UNITS[units]
    turns = np.array([not dof.endswith((":x", ":y", ":z")) for dof in model.dofs])
    scale = sparse.diags_array(np.where(turns, metre, 1.0))
    k = scale @ sparse.csr_array(model.stiffness) @ scale * (kilogram / second**2)
    m = scale @ sparse.csr_array(model.mass) @ scale * kilogram
    places = {name: metre * np.asarray(at) for name, at in model.places.items() if name.isdigit()}
    return sparse.csr_array(k), sparse.csr_array(m), places


def _upper(matrix):
    entries = sparse.coo_array(sparse.triu(matrix))
    return entries.row.tolist(), entries.col.tolist(), entries.data.tolist()


def _pairs(dofs):
    return [(int(node), CODES[way]) for node, _, way in (dof.partition(":") for dof in dofs)]


def calculix(folder: Path, k, m, dofs):
    for suffix, matrix in (("sti", k), ("mas", m)):
        rows = zip(*_upper(matrix), strict=True)
        (folder / f"part.{suffix}").write_text("".join(f"{i + 1} {j + 1} {x:21.13e}\n" for i, j, x in rows))
    (folder / "part.dof").write_text("".join(f"{node}.{code}\n" for node, code in _pairs(dofs)))
    return 'stiffness = "part.sti"\nmass = "part.mas"\n'


def abaqus(folder: Path, k, m, dofs, form="input"):
    pairs = _pairs(dofs)
    for name, matrix in (("STIF1", k), ("MASS1", m)):
        lines = ["** ASSEMBLED MATRIX"]
        for j, i, x in zip(*_upper(matrix), strict=True):  # the lower triangle
            (a, p), (b, q) = pairs[i], pairs[j]
            if form == "input":
                lines.append(f"{a},{p}, {b},{q},  {x:.16e}")
            elif form == "labels":
                lines.append(f"{a} {p} {b} {q} {x:.16e}")
            else:
                lines.append(f"{i + 1} {j + 1} {x:.16e}")
        (folder / f"part_{name}.mtx").write_text("\n".join(lines) + "\n")
    text = 'stiffness = "part_STIF1.mtx"\nmass = "part_MASS1.mtx"\n'
    return text + (f"dofs = {list(dofs)!r}\n".replace("'", '"') if form == "coordinate" else "")


def _nastran_real(value):
    mantissa, exponent = f"{value:.8E}".split("E")
    return f"{mantissa}D{int(exponent):+03d}"


def dmig(folder: Path, k, m, dofs, form="large"):
    pairs, lines = _pairs(dofs), ["$ made for a test"]
    for name, matrix in (("KAAX", k), ("MAAX", m)):
        lower = sparse.csc_array(sparse.tril(matrix))
        head = ["DMIG", name, 0, 6, 2, 0, "", "", len(dofs)]
        lines.append(",".join(map(str, head)) if form == "free" else
                     f"{head[0]:<8}{name:<8}{0:8d}{6:8d}{2:8d}{0:8d}{'':16}{len(dofs):8d}")  # fmt: skip
        for j in range(len(dofs)):
            node, code = pairs[j]
            rows = lower.indices[lower.indptr[j] : lower.indptr[j + 1]]
            values = lower.data[lower.indptr[j] : lower.indptr[j + 1]]
            if form == "free":
                for i, x in zip(rows, values, strict=True):
                    a, p = pairs[i]
                    lines.append(f"DMIG,{name},{node},{code},,{a},{p},{x:.15E}")
                continue
            lines.append(f"DMIG*   {name:<16}{node:16d}{code:16d}{'':16}")
            for i, x in zip(rows, values, strict=True):
                a, p = pairs[i]
                lines.append(f"*       {a:16d}{p:16d}{_nastran_real(x):>16}")
    (folder / "part.pch").write_text("\n".join(lines) + "\n")
    return 'stiffness = "part.pch"\nmass = "part.pch"\n'


def harwell_boeing(folder: Path, k, m, dofs):
    """As HBMAT of Ansys: one number a line."""
    for name, matrix in (("k", k), ("m", m)):
        lower = sparse.csc_array(sparse.tril(matrix))
        lower.sort_indices()
        n, count = lower.shape[0], lower.nnz
        sizes = n + 1 + 2 * count, n + 1, count, count, 0
        lines = [f"{'Stiffness of a test':<72}{'PART':<8}", "".join(f"{one:14d}" for one in sizes)]
        lines += ["RSA".ljust(14) + "".join(f"{one:14d}" for one in (n, n, count, 0))]
        lines += ["(1I14)".ljust(16) * 2 + "(1D25.15)".ljust(20) * 2]
        lines += [f"{one + 1:14d}" for one in lower.indptr]
        lines += [f"{one + 1:14d}" for one in lower.indices]
        lines += [f"{one:25.15E}".replace("E", "D") for one in lower.data]
        (folder / f"{name}.matrix").write_text("\n".join(lines) + "\n")
    words = {1: "UX", 2: "UY", 3: "UZ", 4: "ROTX", 5: "ROTY", 6: "ROTZ"}
    rows = [f"{i:10d}{node:10d} {words[code]:>5}" for i, (node, code) in enumerate(_pairs(dofs), 1)]
    (folder / "k.mapping").write_text("\n".join(["  Matrix Eqn     Node  DOF", *rows]) + "\n")
    return 'stiffness = "k.matrix"\nmass = "m.matrix"\n'


def market(folder: Path, k, m, dofs):
    for name, matrix in (("k", k), ("m", m)):
        scipy.io.mmwrite(folder / f"{name}.mtx", sparse.coo_array(matrix), symmetry="symmetric", precision=16)
    return 'stiffness = "k.mtx"\nmass = "m.mtx"\n' + f"dofs = {list(dofs)!r}\n".replace("'", '"')


def npz(folder: Path, k, m, dofs):
    np.savez(folder / "part.npz", stiffness=k.toarray(), mass=m.toarray())
    (folder / "dofs.txt").write_text("\n".join(dofs))
    return 'stiffness = "part.npz"\nmass = "part.npz"\ndofs = "dofs.txt"\n'


#: What writes each format into a folder, and returns the keys of the part.
WRITERS = {
    "calculix": calculix,
    "abaqus": abaqus,
    "abaqus labels": lambda *given: abaqus(*given, form="labels"),
    "abaqus coordinate": lambda *given: abaqus(*given, form="coordinate"),
    "dmig": dmig,
    "dmig free": lambda *given: dmig(*given, form="free"),
    "harwell-boeing": harwell_boeing,
    "market": market,
    "npz": npz,
}


def deck(places):
    lines = ["*HEADING", " a part", "*NODE, NSET=ALL"]
    lines += [f"{name}, " + ", ".join(f"{c:.12g}" for c in at) for name, at in places.items()]
    return "\n".join([*lines, "*NSET, NSET=ENDS", "1, 2", "*NSET, NSET=LINE, GENERATE", "1, 4, 1",
                      "*NSET, NSET=FIRST", "LINE, 79,", ""])  # fmt: skip


def bulk(places):
    # Half in free fields, half in large ones.
    lines = ["BEGIN BULK"]
    for i, (name, at) in enumerate(places.items()):
        if i % 2:
            lines.append(f"GRID,{name},,{at[0]:.9g},{at[1]:.9g},{at[2]:.9g}")
        else:
            cells = "".join(f"{c:16.9E}" for c in at)
            lines += [f"GRID*   {name:>16}{'':16}{cells[:32]}", f"*       {cells[32:]}"]
    return "\n".join([*lines, ""])


def cdb(places):
    rows = [f"{int(name):9d}{0:9d}{0:9d}" + "".join(f"{c:21.13E}" for c in at) for name, at in places.items()]
    return "\n".join(["/PREP7", f"NBLOCK,6,SOLID,{len(rows):9d},{len(rows):9d}", "(3i9,6e21.13)", *rows,
                      "N,R5.3,LOC,       -1,", ""])  # fmt: skip


def table(places):
    return "node, x, y, z\n" + "".join(f"{name}, {a:.12g}, {b:.12g}, {c:.12g}\n" for name, (a, b, c) in places.items())


NODE_FILES = {"part.inp": deck, "grids.bdf": bulk, "part.cdb": cdb, "nodes.csv": table}


def part_toml(folder: Path, model, form="calculix", nodes="part.inp", units="mm-t-s", more=""):
    """Write all files of a part and `part.toml`; return its path."""
    k, m, places = in_units(model, units)
    keys = WRITERS[form](folder, k, m, model.dofs)
    (folder / nodes).write_text(NODE_FILES[nodes](places))
    path = folder / "part.toml"
    path.write_text(f'model = "matrices"\n{keys}nodes = "{nodes}"\nunits = "{units}"\nloss_factor = 0.01\n{more}')
    return path
