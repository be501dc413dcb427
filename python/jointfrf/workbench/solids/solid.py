"""Models of brick elements, with supports and faces that are coupled to six-DOF reference points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from jointfrf.dofs import DIRECTIONS, rigid_motion
from jointfrf.kernel.arguments import FloatArray, as_array, as_real
from jointfrf.models.points import PointModel
from jointfrf.workbench.solids.brick import Formulation, Mass, Material, assemble_bricks
from jointfrf.workbench.solids.mesh import Mesh

__all__ = ["Patch", "SolidModel", "mean_motion", "solid_model"]

#: A patch cannot fix a rotation if its nodes deviate from a line by less than this fraction of its extent.
_HELD = 1e-6


@dataclass(frozen=True)
class Patch:
    """Nodes that are coupled to a reference point: kinematic or distributing coupling.

    Attributes
    ----------
    point : ndarray, shape (3,)
        Coordinates x, y, z of the reference point, m. The point need not be a node.
    nodes : ndarray of int
        Numbers of the nodes, counted from 0.

    See Also
    --------
    solid_model : Model of a mesh with patches.
    mean_motion : Mean rigid motion of a patch.
    """

    point: FloatArray
    nodes: NDArray[np.int32]


@dataclass(frozen=True, kw_only=True)
class SolidModel(PointModel):
    """Model of bricks, with DOFs ``"1:x"`` of nodes, counted from 1, and ``"name:theta_x"`` of reference points.

    Attributes
    ----------
    mesh : Mesh
        Mesh of the model.
    expansion : sparse array, shape (3 n_nodes, n)
        Matrix that maps the DOFs to displacements x, y, z of all nodes. Rows of clamped nodes are zero.
    references : mapping of str to ndarray, shape (3,)
        Coordinates of the reference points, m, including points of mean motions.

    See Also
    --------
    solid_model : Model of a mesh.
    jointfrf.workbench.solids.brick_beam.brick_beam : Model of a straight beam.
    """

    mesh: Mesh
    expansion: sparse.csr_array
    references: Mapping[str, FloatArray]

    def displacements(self, shape: ArrayLike) -> FloatArray:
        """Return the displacements of all nodes.

        Parameters
        ----------
        shape : array_like, shape (n,)
            Displacements of the DOFs.

        Returns
        -------
        ndarray, shape (n_nodes, 3)
        """
        return np.asarray((self.expansion @ np.asarray(shape)).reshape(-1, 3))


def solid_model(
    mesh: Mesh,
    materials: Material | Sequence[Material],
    *,
    formulation: Formulation = "incompatible",
    mass: Mass = "consistent",
    patches: Mapping[str, Patch] | None = None,
    observed: Mapping[str, Patch] | None = None,
    clamped: ArrayLike = (),
) -> SolidModel:
    """Return the model of a mesh.

    Parameters
    ----------
    mesh : Mesh
        Mesh of bricks.
    materials : Material, or a sequence with one for each element
        Materials of the elements. If all loss factors are equal, the model has this loss factor; otherwise it has a
        structural damping matrix.
    formulation : {"incompatible", "reduced", "full"}
        Formulation of the elements, default "incompatible"; see `element_matrices`.
    mass : {"consistent", "lumped"}
        Mass matrix of the elements, default "consistent".
    patches : mapping of str to Patch, optional
        Kinematic coupling: reference points by name. The nodes of a patch move with its point as a rigid body.
    observed : mapping of str to Patch, optional
        Distributing coupling: reference points with the mean rigid motion of their nodes. Forces at the point are
        spread over the nodes, which stay flexible. The points are no DOFs; see `SolidModel.ports`.
    clamped : array_like of int
        Nodes that are fixed in all directions, counted from 0; none by default.

    Returns
    -------
    SolidModel
        Model with the free DOFs of the nodes in their order, then x, y, z, theta_x, theta_y, theta_z of every
        reference point.

    Raises
    ------
    ValueError
        Bad elements; a node that does not exist; a patch that is empty, overlaps another or a clamped node, or does
        not fix all rotations of its reference point.

    See Also
    --------
    jointfrf.workbench.solids.brick_beam.brick_beam : Model of a straight beam.
    jointfrf.workbench.solids.brick.assemble_bricks : Matrices of a mesh.
    jointfrf.workbench.solids.mesh.interpolation : Displacements of points between nodes.
    """
    if not isinstance(mesh, Mesh):
        raise TypeError(f"mesh must be a Mesh, not {type(mesh).__name__}")
    groups, shown = _as_patches(mesh, patches), _as_patches(mesh, observed)
    twice = set(groups) & set(shown)
    if twice:
        raise ValueError(f"patches and observed both name {min(twice)!r}")
    held = np.unique(_as_nodes("clamped", clamped, mesh))
    _check_patches(mesh, groups, held)
    for name, patch in shown.items():
        _check_shape(mesh, name, patch.nodes)
    expansion, dofs = _expansion(mesh, groups, held)
    k, m = assemble_bricks(mesh.nodes, mesh.elements, materials, formulation, mass=mass)
    each = [materials] if isinstance(materials, Material) else materials
    same = len({one.loss_factor for one in each}) == 1
    structural = None
    if not same:
        lossy = [i for i, one in enumerate(each) if one.loss_factor > 0]
        damped = [replace(each[i], youngs_modulus=each[i].youngs_modulus * each[i].loss_factor) for i in lossy]
        structural, _ = assemble_bricks(mesh.nodes, mesh.elements[lossy], damped, formulation, mass=mass)
    return SolidModel(
        stiffness=sparse.csr_array(expansion.T @ k @ expansion),
        mass=sparse.csr_array(expansion.T @ m @ expansion),
        structural_damping=None if structural is None else sparse.csr_array(expansion.T @ structural @ expansion),
        dofs=dofs,
        loss_factor=each[0].loss_factor if same else 0.0,
        mesh=mesh,
        expansion=expansion,
        references={name: patch.point for name, patch in (groups | shown).items()},
        places={
            **{str(i): place for i, place in enumerate(mesh.nodes, 1)},
            **{name: patch.point for name, patch in (groups | shown).items()},
        },
        shown={
            f"{name}:{direction}": rows[[i]]
            for name, patch in shown.items()
            for rows in [sparse.csr_array(mean_motion(mesh, patch) @ expansion)]
            for i, direction in enumerate(DIRECTIONS)
        },
    )


def mean_motion(mesh: Mesh, patch: Patch) -> sparse.csr_array:
    """Return the weights of the mean rigid motion of nodes about a point, by least squares.

    Parameters
    ----------
    mesh : Mesh
        Mesh of bricks.
    patch : Patch
        Nodes and reference point.

    Returns
    -------
    sparse array, shape (6, 3 n_nodes)
        Weights that map displacements of all nodes to x, y, z, theta_x, theta_y, theta_z of the point. The transpose
        spreads forces and moments at the point over the nodes of the patch.

    See Also
    --------
    jointfrf.workbench.solids.mesh.interpolation : Weights of points between nodes.
    """
    motion = rigid_motion(mesh.nodes[patch.nodes], patch.point).reshape(-1, 6)
    rows, columns = np.arange(6)[:, None], (3 * patch.nodes[:, None].astype(np.int64) + np.arange(3)).ravel()
    rows, columns = np.broadcast_arrays(rows, columns)
    entries = (np.linalg.pinv(motion).ravel(), (rows.ravel(), columns.ravel()))
    return sparse.csr_array(entries, shape=(6, 3 * len(mesh.nodes)))


def _as_nodes(name: str, value: ArrayLike, mesh: Mesh) -> NDArray[np.int32]:
    """Return numbers of nodes if all nodes exist."""
    nodes = as_array(name, value)
    if nodes.ndim != 1 or (nodes.size and nodes.dtype.kind not in "iu"):
        raise TypeError(f"{name} must be a list of node numbers, not {nodes.dtype} of shape {nodes.shape}")
    if not nodes.size:
        return np.zeros(0, np.int32)
    strange = (nodes < 0) | (nodes >= len(mesh.nodes))
    if strange.any():
        raise ValueError(f"{name} names node {nodes[strange][0]}; there are nodes 0 to {len(mesh.nodes) - 1}")
    return nodes.astype(np.int32)


def _as_patches(mesh: Mesh, patches: Mapping[str, Patch] | None) -> dict[str, Patch]:
    """Return patches with valid names of DOFs, each with sorted nodes and no duplicates."""
    if not isinstance(patches, Mapping | None):
        raise TypeError(f"patches must map names to patches, not {type(patches).__name__}")
    found = {}
    for name, patch in (patches or {}).items():
        if not isinstance(name, str) or ":" in name or name.isdigit() or not name:
            raise ValueError(f"a patch cannot be named {name!r}: a name without colon that is not a number is needed")
        if not isinstance(patch, Patch):
            raise TypeError(f"patch {name!r} must be a Patch, not {type(patch).__name__}")
        nodes = np.unique(_as_nodes(f"patch {name!r}", patch.nodes, mesh))
        found[name] = Patch(as_real(f"point of patch {name!r}", patch.point, (3,)), nodes)
    return found


def _check_patches(mesh: Mesh, patches: Mapping[str, Patch], clamped: NDArray[np.int32]) -> None:
    owner: dict[int, str] = dict.fromkeys(clamped.tolist(), "the clamped nodes")
    for name, patch in patches.items():
        nodes = patch.nodes
        for node in nodes.tolist():
            if node in owner:
                at = ", ".join(f"{1e3 * x:g}" for x in mesh.nodes[node])
                raise ValueError(f"patch {name!r} overlaps {owner[node]} at x, y, z = {at} mm")
            owner[node] = f"patch {name!r}"
        _check_shape(mesh, name, nodes)


def _check_shape(mesh: Mesh, name: str, nodes: NDArray[np.int32]) -> None:
    if nodes.size == 0:
        raise ValueError(f"patch {name!r} has no nodes; refine the mesh there, or move the patch inside")
    places = mesh.nodes[nodes] - mesh.nodes[nodes].mean(axis=0)
    size = np.linalg.svd(places, compute_uv=False)
    if nodes.size < 3 or size[1] <= _HELD * size[0]:
        raise ValueError(f"patch {name!r} needs at least three nodes that are not on one line, to fix rotations")


def _expansion(
    mesh: Mesh, patches: Mapping[str, Patch], clamped: NDArray[np.int32]
) -> tuple[sparse.csr_array, tuple[str, ...]]:
    """Return the matrix T of u = T q, and the names of q."""
    count = len(mesh.nodes)
    free = np.ones(count, bool)
    free[clamped] = False
    for patch in patches.values():
        free[patch.nodes] = False
    nodes = np.flatnonzero(free)
    rows = [(3 * nodes[:, None] + np.arange(3)).ravel()]
    columns = [np.arange(3 * nodes.size)]
    values = [np.ones(3 * nodes.size)]
    dofs = [f"{node + 1}:{direction}" for node in nodes.tolist() for direction in DIRECTIONS[:3]]
    for name, patch in patches.items():
        motion = rigid_motion(mesh.nodes[patch.nodes], patch.point)
        at = np.argwhere(motion)
        rows.append(3 * patch.nodes[at[:, 0]].astype(np.int64) + at[:, 1])
        columns.append(len(dofs) + at[:, 2])
        values.append(motion[tuple(at.T)])
        dofs += [f"{name}:{direction}" for direction in DIRECTIONS]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_array(entries, shape=(3 * count, len(dofs))), tuple(dofs)
