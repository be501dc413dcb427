"""Substructures of one's own: matrices, or FRFs, in files that `case.toml` names."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from scipy import sparse

from jointfrf.cases.definitions import read_frf_file
from jointfrf.cases.known_joint.structure import MeasuredStructure, ModelStructure, lines_at
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA
from jointfrf.io.matrix_file import read_dof_names, read_matrix
from jointfrf.kernel.arguments import FloatArray
from jointfrf.models.matrices import is_symmetric
from jointfrf.models.model import Model
from jointfrf.toml.table import TomlTable

__all__ = ["read_matrices", "read_receptances"]

_OPTIONAL = ("damping", "structural_damping")


def read_matrices(table: TomlTable) -> ModelStructure:
    """Read a substructure by its matrices.

    Raises
    ------
    FileContentError
        One sentence that names the key and the file.
    """
    loss_factor = table.number("loss_factor", 0) if "loss_factor" in table else 0.0
    paths = {key: table.file(key) for key in ("stiffness", "mass")}
    paths |= {key: table.file(key) for key in _OPTIONAL if key in table}
    named = table.texts_or_file("dofs")
    table.close()
    found = {key: table.build(partial(read_matrix, path, key), key) for key, path in paths.items()}
    c, h = (found.get(key) for key in _OPTIONAL)
    n = found["stiffness"].shape[0]
    for key, matrix in found.items():
        if matrix.shape != (n, n):
            raise table.wrong(key, f"{paths[key]} holds {matrix.shape[0]} DOFs, {paths['stiffness']} holds {n}")
    for key in ("stiffness", "mass"):
        if not is_symmetric(sparse.csc_array(found[key])):
            raise table.wrong(key, _unsymmetric(paths[key], found[key]))
    if (found["mass"].diagonal() < 0).any() or not found["mass"].diagonal().any():
        raise table.wrong("mass", f"{paths['mass']} must have a diagonal that is not negative, and not zero as a whole")
    dofs = _dof_names(table, named, n)
    return ModelStructure(Model(found["stiffness"], found["mass"], dofs, c, h, loss_factor))


def _unsymmetric(path: Path, matrix: sparse.csr_array) -> str:
    """Say where a matrix is not symmetric."""
    difference = sparse.coo_array(matrix - matrix.T)
    worst = int(np.argmax(abs(difference.data)))
    i, j = int(difference.row[worst]), int(difference.col[worst])
    text = (
        f"{path} must hold a symmetric matrix: entry ({i + 1}, {j + 1}) is {matrix[i, j]:g}, "
        f"({j + 1}, {i + 1}) is {matrix[j, i]:g}"
    )
    is_triangle = sparse.triu(matrix, 1).count_nonzero() == 0 or sparse.tril(matrix, -1).count_nonzero() == 0
    return text + ("; it holds one triangle only" if is_triangle else "")


def _dof_names(table: TomlTable, named: tuple[str, ...] | Path, n: int) -> tuple[str, ...]:
    """Return the names of n DOFs, each once."""
    given = named if isinstance(named, tuple) else table.build(partial(read_dof_names, named), "dofs")
    where = "" if isinstance(named, tuple) else f"{named} "
    if len(given) != n:
        raise table.wrong("dofs", f"{where}names {len(given)} DOFs, the matrices hold {n}")
    if not all(name.strip() for name in given):
        raise table.wrong("dofs", f"{where}has an empty name")
    if len(set(given)) < n:
        seen: set[str] = set()
        twice = next(name for name in given if name in seen or seen.add(name))  # type: ignore[func-returns-value]
        raise table.wrong("dofs", f"{where}names {twice!r} twice")
    return given


def read_receptances(table: TomlTable, freq_hz: FloatArray) -> MeasuredStructure:
    """Read a substructure by its FRFs, on lines that the file must hold, Hz.

    Raises
    ------
    FileContentError
        One sentence that names the key and the file.
    """
    quantity = table.text("quantity", tuple(POWER_OF_I_OMEGA)) if "quantity" in table else None
    forced = table.truth("force_quantity") if "force_quantity" in table else False
    if forced and quantity is None:
        raise table.wrong("force_quantity", "there is no quantity to force")
    frfs = read_frf_file(table, "file", quantity, force_quantity=forced)
    table.close()
    table.build(lambda: lines_at(frfs, freq_hz), "file")
    return MeasuredStructure(frfs)
