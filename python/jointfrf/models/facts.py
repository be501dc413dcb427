"""Checks of matrices: mass, definiteness, rigid-body motions, natural frequencies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from jointfrf.dofs import DIRECTIONS, rigid_motion
from jointfrf.kernel.arguments import FloatArray, check_type
from jointfrf.models.factors import SingularMatrixError, SparseSolver
from jointfrf.models.model import Model, shift_of
from jointfrf.models.points import PointModel

__all__ = ["ModelFacts", "model_facts"]

#: Energy of a rigid motion, relative to the energy of its entries, below which it is free: files have 7 digits or more.
_FREE = 1e-6
#: Relative difference of masses along x, y and z above which a direction of nodes is fixed or rotated.
_SAME = 1e-3
#: Number of DOFs up to which natural frequencies are computed: a second.
_FEW = 20_000
#: Number of frequencies printed.
_SHOWN = 10
#: Share of the shift about zero within which rigid motions are found.
_ROUNDING = 1e-3
#: Relative size, over the largest computed eigenvalue, above which a negative eigenvalue is not rounding.
_NEGATIVE = 1e-6


@dataclass(frozen=True)
class ModelFacts:
    """Properties of a model that follow from its matrices.

    Attributes
    ----------
    n_dofs, n_nodes, n_inner : int
        Numbers of DOFs, of nodes, and of DOFs without a node: modal coordinates, inner DOFs of elements, local
        directions.
    mass : ndarray, shape (3,)
        Mass that takes part in motions along x, y, z, kg; without fixed DOFs.
    centre : ndarray, shape (3,), or None
        Centre of gravity, m; None if places of nodes are not known.
    rigid_motions : int
        Number of rigid-body motions without stiffness.
    natural_frequencies : ndarray
        Lowest frequencies above the rigid motions, Hz; none for large models.
    findings : tuple of str
        Possible errors, one sentence each.
    """

    n_dofs: int
    n_nodes: int
    n_inner: int
    mass: FloatArray
    centre: FloatArray | None
    rigid_motions: int
    natural_frequencies: FloatArray
    findings: tuple[str, ...]

    def lines(self) -> list[str]:
        """Return the properties as lines of text."""
        same = np.ptp(self.mass) <= _SAME * self.mass.max(initial=0)
        mass = f"{self.mass.max():.5g} kg" if same else ", ".join(f"{m:.5g}" for m in self.mass) + " kg along x, y, z"
        inner = f" ({self.n_inner} of no node)" if self.n_inner else ""
        text = f"{self.n_dofs} DOFs of {self.n_nodes} nodes{inner}, mass {mass}"
        if self.centre is not None:
            text += f", centre of gravity ({', '.join(f'{c:.4g}' for c in self.centre)}) m"
        free = "no rigid motion is free" if not self.rigid_motions else f"{self.rigid_motions} rigid motions are free"
        found = [text, f"symmetric; {free}"]
        if self.natural_frequencies.size:
            found.append("natural frequencies " + ", ".join(f"{f:.4g}" for f in self.natural_frequencies) + " Hz")
        return found


def model_facts(model: Model) -> ModelFacts:
    """Return the properties of a model that follow from its matrices.

    Parameters
    ----------
    model : Model
        Model with symmetric K and M; the places of a `PointModel` give the centre of gravity and rotations.

    Examples
    --------
    >>> import jointfrf as jf
    >>> for line in model_facts(jf.chain([1.0, 2.0], [5.0], ground="none")).lines():
    ...     print(line)
    2 DOFs of 2 nodes, mass 3, 0, 0 kg along x, y, z
    symmetric; 1 rigid motions are free
    natural frequencies 0.4359 Hz
    """
    check_type("model", model, Model)
    k, m = sparse.csr_array(model.stiffness), sparse.csr_array(model.mass)
    places = model.places if isinstance(model, PointModel) else {}
    motion, nodes, inner = _rigid_motions(model.dofs, places)
    inertia = motion.T @ (m @ motion)
    mass = np.maximum(np.diag(inertia)[:3], 0.0)
    centre = _centre(inertia) if places and mass.max(initial=0) > 0 else None
    used = np.flatnonzero(abs(motion[:, : 6 if places else 3]).sum(axis=0))  # no rotation without places
    free = _free_motions(k, motion[:, used])
    freq, negative = _frequencies(k, m) if len(model.dofs) <= _FEW else (np.zeros(0), False)
    return ModelFacts(
        len(model.dofs), nodes, inner, mass, centre, free, freq[free:][:_SHOWN], tuple(_findings(k, m, mass, negative))
    )


def _rigid_motions(dofs: tuple[str, ...], places: Mapping[str, FloatArray]) -> tuple[FloatArray, int, int]:
    """Return motions of the DOFs for unit rigid motions about the origin, shape (n, 6); numbers of nodes and others.

    If places of nodes are known, DOFs without a place are inner ones, as of incompatible modes, which do not move.
    """
    motion = np.zeros((len(dofs), 6))
    of_node: dict[str, FloatArray] = {}
    inner = 0
    for i, dof in enumerate(dofs):
        node, _, direction = dof.partition(":")
        if direction not in DIRECTIONS or (places and node not in places):
            inner += 1
            continue
        if node not in of_node:
            whole = np.eye(6)
            if places:
                whole[:3] = rigid_motion(np.asarray(places[node])[None], np.zeros(3))[0]
            of_node[node] = whole
        motion[i] = of_node[node][DIRECTIONS.index(direction)]
    return motion, len(of_node), inner


def _centre(inertia: FloatArray) -> FloatArray | None:
    """Return the centre of gravity from the first moments, m (c x e_i) for unit motions."""
    m = np.diag(inertia)[:3]
    # theta_z moves the centre by (-y, x, 0), theta_x by (0, -z, y), theta_y by (z, 0, -x).
    found = [
        (inertia[1, 5], m[1], inertia[2, 4], m[2], -1),
        (inertia[2, 3], m[2], inertia[0, 5], m[0], -1),
        (inertia[0, 4], m[0], inertia[1, 3], m[1], -1),
    ]
    return np.array([first / m1 if m1 > 0 else sign * second / m2 if m2 > 0 else 0.0
                     for first, m1, second, m2, sign in found])  # fmt: skip


def _free_motions(k: sparse.csr_array, motion: FloatArray) -> int:
    """Return the number of combinations of rigid motions without strain energy, except for rounding."""
    if not motion.shape[1]:
        return 0
    size = abs(motion).T @ (abs(k) @ abs(motion))
    scale = 1 / np.sqrt(np.maximum(np.diag(size), 1e-300))
    energy = scale[:, None] * (motion.T @ (k @ motion)) * scale
    return int((np.linalg.eigvalsh((energy + energy.T) / 2) < _FREE).sum())


def _frequencies(k: sparse.csr_array, m: sparse.csr_array) -> tuple[FloatArray, bool]:
    """Return the lowest natural frequencies, rigid motions as 0 Hz, and whether one has a negative stiffness."""
    n = k.shape[0]
    count = min(_SHOWN + 6, n)
    shift = shift_of(k, m)
    try:
        if n <= 4 * count:
            squared = np.linalg.eigvals(np.linalg.solve((k - shift * m).toarray(), m.toarray())).real
            squared = 1 / squared[squared > n * np.finfo(float).eps * squared.max()] + shift
        else:
            factors = SparseSolver().factor(sparse.csc_array(k - shift * m))
            inverse = sparse_linalg.LinearOperator((n, n), factors.solve, dtype=np.float64)
            squared = sparse_linalg.eigsh(k, count, m, sigma=shift, OPinv=inverse, v0=np.ones(n))[0]
    except (SingularMatrixError, RuntimeError, np.linalg.LinAlgError, ValueError):
        return np.zeros(0), False
    squared = np.sort(squared)[:count]
    negative = bool(squared[0] < _ROUNDING * shift)
    return np.sqrt(np.maximum(squared, 0)) / (2 * np.pi), negative


def _findings(k: sparse.csr_array, m: sparse.csr_array, mass: FloatArray, negative: bool) -> list[str]:
    found = []
    for name, matrix in (("stiffness", k), ("mass", m)):
        worst = matrix.diagonal().min()
        if worst < 0:
            found.append(f"the {name} has a negative diagonal entry, {worst:.3g}")
    if negative:
        found.append("the stiffness is not positive semidefinite: a motion has a negative stiffness")
    lowest = _lowest(m)
    if lowest < -_NEGATIVE * m.diagonal().max():
        found.append(f"the mass is not positive semidefinite: its smallest eigenvalue is {lowest:.3g} kg")
    if mass.max(initial=0) <= 0:
        found.append("no mass takes part in a motion along x, y or z")
    elif np.ptp(mass[mass > 0]) > _SAME * mass.max():
        found.append("masses along x, y and z differ: directions of nodes are fixed, or turned from the basic axes")
    return found


def _lowest(m: sparse.csr_array) -> float:
    """Return an estimate of the smallest eigenvalue of the mass matrix."""
    if m.shape[0] <= 64:
        return float(np.linalg.eigvalsh(m.toarray())[0])
    try:
        return float(
            sparse_linalg.eigsh(m, 1, which="SA", v0=np.ones(m.shape[0]), tol=1e-2, return_eigenvectors=False)[0]
        )
    except sparse_linalg.ArpackNoConvergence:
        return 0.0  # the diagonal is checked separately
