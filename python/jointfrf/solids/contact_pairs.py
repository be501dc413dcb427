"""Pairs of nodes that may touch: how they are tied, exactly or by springs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from jointfrf.kernel.arguments import FloatArray, as_number

__all__ = ["NORMAL", "TANGENTIAL", "BoolArray", "ContactInterface", "ContactLaw", "Pairs", "tie"]

BoolArray = NDArray[np.bool_]

#: Contact acts along y; x and z are tangential.
NORMAL: Final = 1
TANGENTIAL: Final = np.array([0, 2])


@dataclass(frozen=True)
class ContactLaw:
    """How faces resist each other.

    Parameters
    ----------
    friction : float
        Coulomb's mu (4.1).
    normal_stiffness, tangential_stiffness : float or None
        Pressure over overlap and shear stress over elastic slip, N/m^3. The defaults are of the order of machined metal
        faces under high pressure. None is rigid: closed pairs do not overlap, sticking pairs do not move at all, and
        their nodes are tied exactly.

    Raises
    ------
    ValueError
        Negative friction, a stiffness that is not positive.

    Examples
    --------
    >>> from jointfrf.solids.contact import ContactLaw
    >>> ContactLaw(friction=0.2)
    ContactLaw(friction=0.2, normal_stiffness=100000000000000.0, tangential_stiffness=10000000000000.0)
    """

    friction: float = 0.3
    normal_stiffness: float | None = 1e14
    tangential_stiffness: float | None = 1e13

    def __post_init__(self) -> None:
        if as_number("friction", self.friction) < 0:
            raise ValueError(f"friction must not be negative, not {self.friction:g}")
        for name in ("normal_stiffness", "tangential_stiffness"):
            value = getattr(self, name)
            if value is not None and as_number(name, value) <= 0:
                raise ValueError(f"{name} must be positive, or None for rigid, not {value:g} N/m^3")


@dataclass(frozen=True)
class ContactInterface:
    """Two faces that may touch, given by pairs of nodes.

    Attributes
    ----------
    lower, upper : ndarray of int, shape (n_pairs,)
        Nodes of the body on the side of lower y, and their partners on the body above, counted from 0.
    area : ndarray, shape (n_pairs,)
        Of each pair, m^2.
    gap : ndarray, shape (n_pairs,), optional
        Distance along y before loading, m; zero by default.
    """

    lower: NDArray[np.int32]
    upper: NDArray[np.int32]
    area: FloatArray
    gap: FloatArray | None = None

    def gaps(self) -> FloatArray:
        """Return the distance of all pairs before loading, m."""
        return np.zeros(len(self.lower)) if self.gap is None else self.gap


class Pairs:
    """The pairs of several interfaces in one row.

    Parameters
    ----------
    interfaces : mapping of str to ContactInterface
        No node may belong to two pairs.
    n : int
        Number of DOFs: x, y, z of node 0, then of node 1, ...; others may follow.
    """

    def __init__(self, interfaces: Mapping[str, ContactInterface], n: int) -> None:
        if not interfaces:
            raise ValueError("interfaces must name at least one interface")
        for name, one in interfaces.items():
            counts = {len(one.lower), len(one.upper), len(one.area), len(one.gaps())}
            if len(counts) != 1 or counts == {0}:
                raise ValueError(f"interfaces: {name!r} must have pairs, with an area and a gap for each")
            if (one.gaps() < 0).any() or (one.area <= 0).any():
                raise ValueError(f"interfaces: {name!r} must have positive areas and gaps that are not negative")
        ends = np.cumsum([len(one.lower) for one in interfaces.values()]).tolist()
        self.parts = {name: slice(a, b) for name, a, b in zip(interfaces, [0, *ends], ends, strict=False)}
        every = list(interfaces.values())
        self.lower = np.concatenate([one.lower for one in every]).astype(np.int64)
        self.upper = np.concatenate([one.upper for one in every]).astype(np.int64)
        self.area = np.concatenate([one.area for one in every])
        self.gap = np.concatenate([one.gaps() for one in every])
        self.n = n
        nodes = np.concatenate([self.lower, self.upper])
        if np.unique(nodes).size != nodes.size:
            raise ValueError("interfaces: a node belongs to two pairs")
        if nodes.min() < 0 or 3 * nodes.max() + 2 >= n:
            raise ValueError(f"interfaces: a node is none of the {n // 3} of the stiffness")
        self.up = 3 * self.upper[:, None] + np.arange(3)
        self.low = 3 * self.lower[:, None] + np.arange(3)

    def tied(self, law: ContactLaw, closed: BoolArray, sticking: BoolArray) -> BoolArray:
        """Return the directions in which upper nodes follow the lower ones exactly, (n_pairs, 3)."""
        tied = np.zeros((len(self.area), 3), bool)
        if law.normal_stiffness is None:
            tied[closed, NORMAL] = True
        if law.tangential_stiffness is None:
            tied[np.ix_(sticking, TANGENTIAL)] = True
        return tied

    def springs(self, law: ContactLaw, closed: BoolArray, sticking: BoolArray) -> sparse.csr_array:
        """Return the stiffness of the pairs that are held by springs, (n, n)."""
        stiffness = np.zeros((len(self.area), 3, 3))
        if law.normal_stiffness is not None:
            stiffness[closed, NORMAL, NORMAL] = law.normal_stiffness * self.area[closed]
        if law.tangential_stiffness is not None:
            for axis in TANGENTIAL.tolist():
                stiffness[sticking, axis, axis] = law.tangential_stiffness * self.area[sticking]
        return self.between(stiffness)

    def between(self, stiffness: FloatArray) -> sparse.csr_array:
        """Return springs between the nodes of each pair, given by blocks (n_pairs, 3, 3) in N/m."""
        used = stiffness.any(axis=(1, 2))
        blocks = stiffness[used]
        ends = np.concatenate([self.up[used], self.low[used]], axis=1)
        both = np.block([[blocks, -blocks], [-blocks, blocks]])
        rows, columns = np.broadcast_arrays(ends[:, :, None], ends[:, None, :])
        matrix = sparse.csr_array((both.ravel(), (rows.ravel(), columns.ravel())), shape=(self.n, self.n))
        matrix.eliminate_zeros()
        return matrix


def tie(pairs: Pairs, tied: BoolArray, fixed: ArrayLike = ()) -> tuple[sparse.csr_array, NDArray[np.int64]]:
    """Expand independent displacements to all: tied nodes follow their partners, which eliminates them exactly.

    Parameters
    ----------
    pairs : Pairs
    tied : ndarray of bool, shape (n_pairs, 3)
        Directions in which the upper node follows the lower one.
    fixed : array_like of int
        DOFs that do not move.

    Returns
    -------
    expansion : csr_array, shape (n, n_independent)
        Of zeros and ones.
    independent : ndarray of int, shape (n_independent,)
        These DOFs, ascending.
    """
    n = pairs.n
    followers, leaders = pairs.up[tied], pairs.low[tied]
    independent = np.ones(n, bool)
    independent[np.asarray(fixed, np.int64)] = False
    stands_for = np.arange(n)
    stands_for[followers] = leaders
    # Where a follower is fixed and its leader is not, the leader is fixed too.
    independent[leaders[~independent[followers]]] = False
    rows = np.flatnonzero(independent[stands_for])
    independent[followers] = False
    column = np.cumsum(independent) - 1
    entries = (np.ones(rows.size), (rows, column[stands_for[rows]]))
    return sparse.csr_array(entries, shape=(n, int(independent.sum()))), np.flatnonzero(independent)
