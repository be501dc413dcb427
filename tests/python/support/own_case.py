"""Cases of one's own: a case that comes with the package, with other tables in its file."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import scipy.io
from scipy import sparse

from jointfrf.io import Channel, FrfSet, write_uff
from jointfrf.workbench.cases.catalogue import find_case, read_case

BEAMS = read_case(find_case("3.2"))
MATRICES = """
[substructure_a]
model = "matrices"
stiffness = "a_k.mtx"
mass = "a_m.npz"
loss_factor = 0.01
dofs = "a_dofs.txt"
[substructure_b]
model = "matrices"
stiffness = "b.npz"
mass = "b.npz"
structural_damping = "b_h.mtx"
damping = "b_c.npz"
dofs = ["1:y", "1:theta", "2:y", "2:theta"]
"""
RECEPTANCES = """
[substructure_a]
model = "receptances"
file = "a.uff"
[substructure_b]
model = "receptances"
file = "b.uff"
[points]
j = ["3:y", "3:rz"]
k = ["1:y", "1:rz"]
r = ["2:-y", "2:rz"]
s = ["2:y", "2:rz"]
"""


def replace_tables(text: str, tables: str) -> str:
    """Replace tables of a TOML text by those of another one, ``[name]`` by ``[name]``."""
    for name, body in re.findall(r"^\[(\w+)\](.*?)(?=^\[|\Z)", tables, re.MULTILINE | re.DOTALL):
        old = re.compile(rf"^\[{name}\].*?(?=^\[|\Z)", re.MULTILINE | re.DOTALL)
        assert len(old.findall(text)) == 1, name
        start, end = old.search(text).span()
        text = f"{text[:start]}[{name}]{body.rstrip()}\n\n{text[end:]}"
    return text


def write_case(folder: Path, tables: str, case: str = "3.2") -> Path:
    """Write the file of a case with some of its tables replaced."""
    folder.mkdir(exist_ok=True)
    text = (find_case(case) / "case.toml").read_text(encoding="utf-8")
    (folder / "case.toml").write_text(replace_tables(text, tables), encoding="utf-8")
    return folder


def as_channels(names: Iterable[str]) -> tuple[Channel, ...]:
    return tuple(Channel.parse(name.replace("theta", "rz")) for name in names)


def write_by_matrices(folder: Path) -> Path:
    """Write case 3.2 with matrices in every format: Matrix Market, sparse NPZ, NPZ of one dense array, of several."""
    write_case(folder, MATRICES)
    a, b = BEAMS.a.model, BEAMS.b.model
    scipy.io.mmwrite(folder / "a_k.mtx", sparse.coo_array(a.stiffness))
    sparse.save_npz(folder / "a_m.npz", sparse.csc_array(a.mass))
    (folder / "a_dofs.txt").write_text("# node, DOF\n2 y\n2 theta\n\n3:y  # tip\n3:theta\n")
    dense = [sparse.csr_array(matrix).toarray() for matrix in (b.stiffness, b.mass)]
    np.savez(folder / "b.npz", stiffness=dense[0], mass=dense[1])
    scipy.io.mmwrite(folder / "b_h.mtx", 0.01 * dense[0])
    np.savez(folder / "b_c.npz", np.zeros((4, 4)))
    return folder


def write_by_receptances(folder: Path) -> Path:
    """Write the same with FRFs: A as accelerances on lines that begin at 0 Hz, B measured against y at its tip."""
    write_case(folder, RECEPTANCES)
    freq = np.arange(0.0, 901.0, 5.0)
    h = np.concatenate([np.zeros((1, 4, 4)), BEAMS.a.model.receptance(freq[1:])])
    acceleration = (2j * np.pi * freq[:, None, None]) ** 2 * h
    channels = as_channels(BEAMS.a.model.dofs)
    write_uff(folder / "a.uff", FrfSet(freq, channels, channels, acceleration, "accelerance"))
    channels = as_channels(("1:y", "1:theta", "2:-y", "2:theta"))
    signs = np.array([1, 1, -1, 1])
    turned = BEAMS.b.model.receptance(freq[1:]) * signs[:, None] * signs
    write_uff(folder / "b.uff", FrfSet(freq[1:], channels, channels, turned))
    return folder
