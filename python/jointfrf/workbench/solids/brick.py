"""Eight-node bricks: stiffness and mass of the elements, their assembly, and the quality of their shape."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from jointfrf.kernel.arguments import FloatArray, as_number, as_positive, as_real, check_choice, one_line
from jointfrf.kernel.call import call

__all__ = ["Formulation", "Mass", "Material", "assemble_bricks", "brick_quality", "element_matrices"]

Formulation = Literal["reduced", "incompatible", "full"]
Mass = Literal["consistent", "lumped"]

#: Letters by which the kernel knows the formulations.
_LETTERS: Final[dict[Formulation, str]] = {"reduced": "R", "incompatible": "I", "full": "F"}
#: Status of the kernel for an element whose matrices overflow.
_OVERFLOW = -2
#: Nodes and DOFs of a brick.
_NODES, _DOFS = 8, 24


@dataclass(frozen=True)
class Material:
    """Isotropic elastic material.

    Parameters
    ----------
    youngs_modulus : float
        N/m^2.
    poisson : float
        Poisson's ratio, between -1 and 0.5.
    density : float
        kg/m^3.
    loss_factor : float
        Structural damping, K (1 + i eta). The real matrices of this module leave it out.

    Raises
    ------
    ValueError
        A value that is out of range.

    Examples
    --------
    >>> from jointfrf.workbench.solids.brick import Material
    >>> Material(youngs_modulus=70e9, poisson=0.33, density=2700.0, loss_factor=0.01).density
    2700.0
    """

    youngs_modulus: float
    poisson: float
    density: float
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        for name in ("youngs_modulus", "density"):
            as_positive(name, getattr(self, name))
        if not -1 < as_number("poisson", self.poisson) < 0.5:
            raise ValueError(f"poisson must lie between -1 and 0.5, not {self.poisson}")
        if as_number("loss_factor", self.loss_factor) < 0:
            raise ValueError(f"loss_factor must not be negative, not {self.loss_factor}")


def element_matrices(
    coordinates: ArrayLike,
    materials: Material | Sequence[Material],
    formulation: Formulation = "incompatible",
    *,
    hourglass: float = 0.005,
    mass: Mass = "consistent",
) -> tuple[FloatArray, FloatArray]:
    """Stiffness and mass of eight-node bricks.

    Parameters
    ----------
    coordinates : array_like, shape (n_elements, 8, 3)
        Nodes of each element, m. Nodes 1 to 4 go round one face, counter-clockwise as seen from the opposite face; 5 to
        8 lie there, 5 over 1: the order of C3D8 of Abaqus and CalculiX and of the hexahedron of VTK.
    materials : Material, or a sequence with one for each element
    formulation : {"incompatible", "reduced", "full"}
        - "incompatible": 2 x 2 x 2 integration points and three quadratic displacements 1 - xi^2 in each direction,
          condensed; their gradients take the Jacobian of the centre [2]_. Exact in bending as a rectangular brick. The
          counterpart of C3D8I.
        - "reduced": one strain, the mean over the element, and a stiffness against hourglass patterns [1]_. The bending
          stiffness of n layers is 1 - 1/n^2 of the exact one; one layer has that of the hourglass control alone. The
          counterpart of C3D8R.
        - "full": 2 x 2 x 2 integration points. Far too stiff in bending.
    hourglass : float
        Stiffness of the hourglass patterns as a share of the shear modulus, for "reduced"; see Notes.
    mass : {"consistent", "lumped"}
        From the shape functions, at 2 x 2 x 2 points; or its rows summed into the diagonal.

    Returns
    -------
    stiffness : ndarray, shape (n_elements, 24, 24)
        N/m, exactly symmetric. DOFs x, y, z of node 1, then of node 2, ...
    mass : ndarray, shape (n_elements, 24, 24)
        kg, exactly symmetric.

    Raises
    ------
    ValueError
        An element that is turned inside out or flat at an integration point: the first one is named, counted from 1,
        with its centre in m. NaN or Inf among the coordinates.
    OverflowError
        The matrices of an element overflow.

    Notes
    -----
    Hourglass stiffness of "reduced": ``hourglass`` G V (b : b) / 8 sum gamma gamma^T in each direction, with the volume
    V, the mean gradients b of the shape functions, and the four patterns gamma = Gamma - b x^T Gamma: Gamma of 1 and
    -1, made orthogonal to linear displacements. First bending frequency of a cantilever of 0.3 x 0.025 x 0.006 m
    (70 GPa, 0.33, 2700 kg/m^3; 54.84 Hz by Euler-Bernoulli) with consistent mass, elements over width, height, length:

    ============  ==========================  ======
    formulation   elements                    Hz
    ============  ==========================  ======
    reduced       10 x 1 x 100                6.75
    reduced       10 x 2 x 100                47.89
    reduced       10 x 3 x 50                 52.25
    reduced       10 x 4 x 50                 53.59
    incompatible  5 x 2 x 103                 55.16
    full          5 x 2 x 103                 59.30
    ============  ==========================  ======

    References
    ----------
    .. [1] D. P. Flanagan, T. Belytschko, A uniform strain hexahedron and quadrilateral with orthogonal hourglass
       control, Int. J. Numer. Methods Eng. 17 (1981) 679-706.
    .. [2] R. L. Taylor, P. J. Beresford, E. L. Wilson, A non-conforming element for stress analysis, Int. J. Numer.
       Methods Eng. 10 (1976) 1211-1219.

    Examples
    --------
    Pulled along z by a force F, a bar of length l stretches by F l/(E A):

    >>> import numpy as np
    >>> from jointfrf.workbench.solids.brick import Material, element_matrices
    >>> bar = np.array([[x, y, z] for z in (0, 0.2) for x, y in ((0, 0), (0.01, 0), (0.01, 0.01), (0, 0.01))])
    >>> k, m = element_matrices([bar], Material(70e9, 0.0, 2700.0))
    >>> stretch = np.where(bar[:, 2] > 0, 1.0, 0.0)
    >>> float(stretch @ k[0, 2::3, 2::3] @ stretch).__round__(3), 70e9 * 1e-4 / 0.2
    (35000000.0, 35000000.0)
    >>> float(m[0, 2::3, 2::3].sum()).__round__(6)
    0.054
    """
    places = as_real("coordinates", coordinates, (None, _NODES, 3))
    return _element_matrices(places, materials, formulation, hourglass, mass)


def assemble_bricks(
    nodes: ArrayLike,
    elements: ArrayLike,
    materials: Material | Sequence[Material],
    formulation: Formulation = "incompatible",
    *,
    hourglass: float = 0.005,
    mass: Mass = "consistent",
) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Stiffness and mass of a mesh of eight-node bricks.

    Parameters
    ----------
    nodes : array_like, shape (n_nodes, 3)
        m.
    elements : array_like of int, shape (n_elements, 8)
        Nodes of each element, counted from 0, in the order of `element_matrices`.
    materials, formulation, hourglass, mass
        As in `element_matrices`.

    Returns
    -------
    stiffness, mass : csr_array, shape (3 n_nodes, 3 n_nodes)
        N/m and kg, exactly symmetric; DOFs x, y, z of node 0, then of node 1, ... Damping, where an element has a loss
        factor, is the caller's.

    Raises
    ------
    ValueError, OverflowError
        As in `element_matrices`; a node that does not exist, or is named twice by an element.

    Notes
    -----
    Entries between nodes that share no element are not stored.

    Examples
    --------
    >>> from jointfrf.workbench.solids.brick import Material, assemble_bricks
    >>> nodes = [[x, y, z] for z in (0, 1, 2) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    >>> k, m = assemble_bricks(nodes, [[0, 1, 2, 3, 4, 5, 6, 7], [4, 5, 6, 7, 8, 9, 10, 11]], Material(1.0, 0.3, 1.0))
    >>> k.shape, float(m.sum()).__round__(12)
    ((36, 36), 6.0)
    """
    places, mesh = _checked_mesh(nodes, elements)
    k_elements, m_elements = _element_matrices(places[mesh], materials, formulation, hourglass, mass)
    pairs = _Pairs(mesh, len(places))
    blocks = k_elements.reshape(-1, _NODES, 3, _NODES, 3).swapaxes(2, 3).reshape(-1, 3, 3)
    directions = sparse.eye_array(3, format="csr")
    masses = pairs.summed(m_elements[:, ::3, ::3].reshape(-1, 1, 1))
    masses.eliminate_zeros()
    return pairs.summed(blocks), sparse.csr_array(sparse.kron(masses, directions, format="csr"))


def brick_quality(nodes: ArrayLike, elements: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """How far the bricks of a mesh are from rectangular ones.

    Parameters
    ----------
    nodes, elements
        As in `assemble_bricks`.

    Returns
    -------
    scaled_jacobian : ndarray, shape (n_elements,)
        Volume that the three edges of a corner span over the product of their lengths, the smallest of the eight: 1
        where all angles are right, not positive where a corner is turned inside out.
    aspect_ratio : ndarray, shape (n_elements,)
        Longest edge over shortest.

    Raises
    ------
    ValueError
        NaN or Inf among the nodes; a node that does not exist, or is named twice by an element.

    Examples
    --------
    >>> from jointfrf.workbench.solids.brick import brick_quality
    >>> nodes = [[x, y, z] for z in (0, 2) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))]
    >>> brick_quality(nodes, [range(8)])
    (array([1.]), array([2.]))
    """
    places, mesh = _checked_mesh(nodes, elements)
    scaled_jacobian, aspect_ratio = np.empty(len(mesh)), np.empty(len(mesh))
    call("brick_quality", [len(mesh), places[mesh], scaled_jacobian, aspect_ratio])
    return scaled_jacobian, aspect_ratio


def _element_matrices(
    coordinates: FloatArray,
    materials: Material | Sequence[Material],
    formulation: Formulation,
    hourglass: float,
    mass: Mass,
) -> tuple[FloatArray, FloatArray]:
    """Return the matrices of elements whose coordinates are checked."""
    check_choice("formulation", formulation, get_args(Formulation))
    check_choice("mass", mass, get_args(Mass))
    n = len(coordinates)
    if n == 0:
        raise ValueError("coordinates must contain at least one element")
    if as_number("hourglass", hourglass) < 0:
        raise ValueError(f"hourglass must not be negative, not {hourglass}")
    stiffness, inertia, info = np.empty((n, _DOFS, _DOFS)), np.empty((n, _DOFS, _DOFS)), np.empty(n, np.int32)
    properties = _properties(materials, n)
    args = [_LETTERS[formulation], n, coordinates, *properties, hourglass, int(mass == "lumped")]
    call("brick_matrices", [*args, stiffness, inertia, info])
    if info.any():
        bad = int(np.argmax(info != 0))
        where = _element_name(bad, coordinates[bad])
        if info[bad] == _OVERFLOW:
            raise OverflowError(f"the matrices of {where} overflow")
        raise ValueError(
            f"{where} is turned inside out or flat near its node {info[bad]}; number nodes 1 to 4 counter-clockwise as "
            "seen from nodes 5 to 8"
        )
    return stiffness, inertia


def _properties(materials: Material | Sequence[Material], n: int) -> FloatArray:
    """Return Young's modulus, Poisson's ratio and density of every element, shape (3, n)."""
    each = [materials] * n if isinstance(materials, Material) else materials
    if isinstance(each, str) or not isinstance(each, Sequence) or not all(isinstance(m, Material) for m in each):
        raise TypeError(f"materials must be one Material or a sequence of them, not {one_line(materials)}")
    if len(each) != n:
        raise ValueError(f"materials must name one material for each of the {n} elements, not {len(each)}")
    return np.array([[m.youngs_modulus for m in each], [m.poisson for m in each], [m.density for m in each]], float)


def _element_name(element: int, coordinates: FloatArray) -> str:
    if len(coordinates) == 0:
        return f"element {element + 1}"
    centre = ", ".join(f"{x:.6g}" for x in coordinates.mean(axis=0))
    return f"element {element + 1} (centre {centre} m)"


def _checked_mesh(nodes: ArrayLike, elements: ArrayLike) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return nodes and elements if every element names eight different nodes that exist."""
    places = as_real("nodes", nodes, (None, 3))
    mesh = np.asarray(elements)
    if mesh.ndim != 2 or mesh.shape[1] != _NODES or mesh.dtype.kind not in "iu":
        raise ValueError(
            f"elements must be node numbers of shape (n, {_NODES}), not {mesh.dtype} of shape {mesh.shape}"
        )
    if len(mesh) == 0:
        raise ValueError("elements must hold at least one element")
    strange = (mesh < 0) | (mesh >= len(places))
    if strange.any():
        bad, at = np.argwhere(strange)[0]
        name = _element_name(bad, places[mesh[bad][~strange[bad]]])
        raise ValueError(f"{name} names node {mesh[bad, at]}; there are nodes 0 to {len(places) - 1}")
    mesh = mesh.astype(np.int64)
    in_order = np.sort(mesh, axis=1)
    twice = in_order[:, 1:] == in_order[:, :-1]
    if twice.any():
        bad, at = np.argwhere(twice)[0]
        raise ValueError(f"{_element_name(bad, places[mesh[bad]])} names node {in_order[bad, at]} twice")
    return places, mesh


class _Pairs:
    """The pairs of nodes that share an element, and their places among the 64 pairs of each element."""

    def __init__(self, mesh: NDArray[np.int64], n_nodes: int) -> None:
        pair = (mesh[:, :, None] * n_nodes + mesh[:, None, :]).ravel()
        self.order = np.argsort(pair, kind="stable")  # (i, j) and (j, i) are summed in the same order: exact symmetry
        in_order = pair[self.order]
        self.starts = np.flatnonzero(np.diff(in_order, prepend=-1))
        rows, columns = np.divmod(in_order[self.starts], n_nodes)
        self.columns = columns.astype(np.int32)
        self.row_starts = np.searchsorted(rows, np.arange(n_nodes + 1)).astype(np.int32)
        self.n_nodes = n_nodes

    def summed(self, blocks: FloatArray) -> sparse.csr_array:
        """Return the sum of square blocks, one for each pair of each element, as a matrix."""
        size = blocks.shape[1] * self.n_nodes
        sums = np.add.reduceat(blocks[self.order], self.starts, axis=0)
        return sparse.csr_array(sparse.bsr_array((sums, self.columns, self.row_starts), shape=(size, size)))
