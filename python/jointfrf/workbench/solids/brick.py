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

#: Letters of the formulations in calls of the kernel.
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
        Young's modulus, N/m^2.
    poisson : float
        Poisson's ratio, between -1 and 0.5.
    density : float
        Density, kg/m^3.
    loss_factor : float
        Loss factor eta of the structural damping, K (1 + i eta), default 0. The real matrices of this module do not
        contain it.

    Raises
    ------
    ValueError
        A value that is out of range.

    See Also
    --------
    assemble_bricks : Matrices of a mesh.
    jointfrf.workbench.solids.solid.solid_model : Model of a mesh, with damping.

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
    """Return stiffness and mass matrices of eight-node bricks.

    Parameters
    ----------
    coordinates : array_like, shape (n_elements, 8, 3)
        Coordinates of the nodes of each element, m. The order is the order of C3D8 in Abaqus and CalculiX and of the
        hexahedron in VTK. Nodes 1 to 4 run around one face, counter-clockwise as seen from the opposite face. Nodes 5
        to 8 run around the opposite face, with node 5 opposite node 1.
    materials : Material, or a sequence with one for each element
        Materials of the elements.
    formulation : {"incompatible", "reduced", "full"}
        Formulation of the elements, default "incompatible".

        - "incompatible": 2 x 2 x 2 integration points and three quadratic displacements 1 - xi^2 in each direction,
          condensed. Their gradients use the Jacobian at the centre [2]_. A rectangular brick is exact in bending. The
          counterpart is C3D8I.
        - "reduced": one strain, the mean over the element, and a stiffness against hourglass patterns [1]_. The bending
          stiffness of n layers is 1 - 1/n^2 of the exact stiffness. One layer has no bending stiffness except the
          hourglass stiffness. The counterpart is C3D8R.
        - "full": 2 x 2 x 2 integration points. The element is far too stiff in bending.
    hourglass : float
        Hourglass stiffness of "reduced" as a fraction of the shear modulus, default 0.005; see Notes.
    mass : {"consistent", "lumped"}
        Mass matrix, default "consistent": integrated from the shape functions at 2 x 2 x 2 points. "lumped" sums the
        rows into the diagonal.

    Returns
    -------
    stiffness : ndarray, shape (n_elements, 24, 24)
        Stiffness matrices, N/m, exactly symmetric. DOFs are x, y, z of node 1, then of node 2, ...
    mass : ndarray, shape (n_elements, 24, 24)
        Mass matrices, kg, exactly symmetric, with the same DOFs.

    Raises
    ------
    ValueError
        An element that is turned inside out or flat at an integration point: the first one is named, counted from 1,
        with its centre in m. NaN or Inf among the coordinates.
    OverflowError
        The matrices of an element overflow.

    See Also
    --------
    assemble_bricks : Matrices of a mesh.
    brick_quality : Scaled Jacobian and aspect ratio of bricks.

    Notes
    -----
    The hourglass stiffness of "reduced" is the same in each direction, with the shear modulus G, the volume V and the
    mean gradients b of the shape functions::

        hourglass G V (b : b) / 8 sum gamma gamma^T

    The sum covers four patterns gamma = Gamma - b x^T Gamma. Their base vectors Gamma contain 1 and -1, and the second
    term makes the patterns orthogonal to linear displacements.

    The table lists the first bending frequency of a cantilever of 0.3 x 0.025 x 0.006 m (70 GPa, 0.33, 2700 kg/m^3)
    with consistent mass. Euler-Bernoulli theory gives 54.84 Hz. Elements are counted over width, height and length::

        formulation   elements      Hz
        reduced       10 x 1 x 100   6.75
        reduced       10 x 2 x 100  47.89
        reduced       10 x 3 x 50   52.25
        reduced       10 x 4 x 50   53.59
        incompatible  5 x 2 x 103   55.16
        full          5 x 2 x 103   59.30

    References
    ----------
    .. [1] D. P. Flanagan, T. Belytschko, A uniform strain hexahedron and quadrilateral with orthogonal hourglass
       control, Int. J. Numer. Methods Eng. 17 (1981) 679-706.
    .. [2] R. L. Taylor, P. J. Beresford, E. L. Wilson, A non-conforming element for stress analysis, Int. J. Numer.
       Methods Eng. 10 (1976) 1211-1219.

    Examples
    --------
    A bar of length l under an axial force F stretches by F l/(E A):

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
    """Return stiffness and mass matrices of a mesh of eight-node bricks.

    Parameters
    ----------
    nodes : array_like, shape (n_nodes, 3)
        Coordinates x, y, z of the nodes, m.
    elements : array_like of int, shape (n_elements, 8)
        Nodes of each element, counted from 0, in the order of `element_matrices`.
    materials : Material, or a sequence with one for each element
        Materials of the elements.
    formulation : {"incompatible", "reduced", "full"}
        Formulation of the elements, default "incompatible"; see `element_matrices`.
    hourglass : float
        Hourglass stiffness of "reduced" as a fraction of the shear modulus, default 0.005.
    mass : {"consistent", "lumped"}
        Mass matrix, default "consistent".

    Returns
    -------
    stiffness, mass : csr_array, shape (3 n_nodes, 3 n_nodes)
        Stiffness and mass matrix, N/m and kg, exactly symmetric. DOFs are x, y, z of node 0, then of node 1, ... The
        matrices do not contain the loss factors of the materials.

    Raises
    ------
    ValueError, OverflowError
        Errors of `element_matrices`; a node that does not exist, or is named twice by an element.

    See Also
    --------
    jointfrf.workbench.solids.solid.solid_model : Model of a mesh, with damping, supports and reference points.
    jointfrf.workbench.solids.mesh.extrude : Mesh over the quadrilaterals of a plan.

    Notes
    -----
    The matrices store no entries between nodes that share no element.

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
    """Return scaled Jacobian and aspect ratio of the bricks of a mesh.

    Parameters
    ----------
    nodes : array_like, shape (n_nodes, 3)
        Coordinates x, y, z of the nodes, m.
    elements : array_like of int, shape (n_elements, 8)
        Nodes of each element, counted from 0, in the order of `element_matrices`.

    Returns
    -------
    scaled_jacobian : ndarray, shape (n_elements,)
        Volume spanned by the three edges of a corner, divided by the product of their lengths; the smallest value of
        the eight corners. It is 1 if all angles are right, and not positive if a corner is turned inside out.
    aspect_ratio : ndarray, shape (n_elements,)
        Length of the longest edge divided by the length of the shortest.

    Raises
    ------
    ValueError
        NaN or Inf among the nodes; a node that does not exist, or is named twice by an element.

    See Also
    --------
    element_matrices : Matrices of bricks.

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
    """Return the matrices of elements with valid coordinates."""
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
        raise ValueError("elements must contain at least one element")
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
    """Pairs of nodes that share an element, and their positions among the 64 pairs of each element."""

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
