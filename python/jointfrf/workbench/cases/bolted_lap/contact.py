"""Contact between pairs of nodes: unilateral, with Coulomb friction, by an active set (4.1)-(4.2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from jointfrf.kernel.arguments import FloatArray, as_not_negative, as_positive
from jointfrf.models.factors import SYMMETRIC

__all__ = ["ContactInterface", "ContactLaw", "InterfaceState", "Iteration", "Pairs", "solve_contact", "tie"]

BoolArray = NDArray[np.bool_]

#: Contact acts along y; x and z are tangential.
NORMAL: Final = 1
TANGENTIAL: Final = np.array([0, 2])
#: Tolerance of tension and penetration, as a fraction of the largest normal force or relative displacement.
_ROUNDING: Final = 1e-9
#: Tolerance of the friction forces of slipping pairs, as a fraction of the largest normal force.
_REPEAT: Final = 1e-6
#: Stiffness of the springs on slipping pairs, as a fraction of the stiffness of a node.
_SOFT: Final = 1e-8
#: A pivot below this fraction of the largest pivot indicates a rigid-body motion.
_SINGULAR: Final = 1e-13


@dataclass(frozen=True)
class ContactLaw:
    """Contact law of two faces: friction and contact stiffness.

    Parameters
    ----------
    friction : float
        Coefficient of Coulomb friction mu (4.1), default 0.3.
    normal_stiffness, tangential_stiffness : float or None
        Pressure divided by overlap and shear stress divided by elastic slip, N/m^3. The defaults 1e14 and 1e13 are
        typical of machined metal faces under high pressure. None is rigid: closed pairs do not overlap, sticking pairs
        do not move relative to each other, and their nodes are tied exactly.

    Raises
    ------
    ValueError
        Negative friction, a stiffness that is not positive.

    See Also
    --------
    solve_contact : Static equilibrium with contact.

    Examples
    --------
    >>> from jointfrf.workbench.cases.bolted_lap.contact import ContactLaw
    >>> ContactLaw(friction=0.2)
    ContactLaw(friction=0.2, normal_stiffness=100000000000000.0, tangential_stiffness=10000000000000.0)
    """

    friction: float = 0.3
    normal_stiffness: float | None = 1e14
    tangential_stiffness: float | None = 1e13

    def __post_init__(self) -> None:
        as_not_negative("friction", self.friction)
        for name in ("normal_stiffness", "tangential_stiffness"):
            value = getattr(self, name)
            if value is not None:
                as_positive(name, value, "N/m^3 (None: rigid)")


@dataclass(frozen=True)
class ContactInterface:
    """Two faces in potential contact, as pairs of nodes.

    Attributes
    ----------
    lower, upper : ndarray of int, shape (n_pairs,)
        Nodes of the body at lower y, and the opposite nodes of the body above, counted from 0.
    area : ndarray, shape (n_pairs,)
        Area of each pair, m^2.
    """

    lower: NDArray[np.int32]
    upper: NDArray[np.int32]
    area: FloatArray


class Pairs:
    """Pairs of several interfaces, one after another.

    Parameters
    ----------
    interfaces : mapping of str to ContactInterface
        Interfaces by name; no node may belong to two pairs.
    n : int
        Number of DOFs: x, y, z of node 0, then of node 1, ..., then any other DOFs.
    """

    def __init__(self, interfaces: Mapping[str, ContactInterface], n: int) -> None:
        ends = np.cumsum([len(one.lower) for one in interfaces.values()]).tolist()
        self.parts = {name: slice(a, b) for name, a, b in zip(interfaces, [0, *ends], ends, strict=False)}
        every = list(interfaces.values())
        self.lower = np.concatenate([one.lower for one in every]).astype(np.int64)
        self.upper = np.concatenate([one.upper for one in every]).astype(np.int64)
        self.area = np.concatenate([one.area for one in every])
        self.n = n
        self.up = 3 * self.upper[:, None] + np.arange(3)
        self.low = 3 * self.lower[:, None] + np.arange(3)

    def tied(self, law: ContactLaw, closed: BoolArray, sticking: BoolArray) -> BoolArray:
        """Return the directions in which upper nodes are tied to lower nodes, shape (n_pairs, 3)."""
        tied = np.zeros((len(self.area), 3), bool)
        if law.normal_stiffness is None:
            tied[closed, NORMAL] = True
        if law.tangential_stiffness is None:
            tied[np.ix_(sticking, TANGENTIAL)] = True
        return tied

    def springs(self, law: ContactLaw, closed: BoolArray, sticking: BoolArray) -> sparse.csr_array:
        """Return the stiffness matrix of the springs between closed pairs, shape (n, n), N/m."""
        stiffness = np.zeros((len(self.area), 3, 3))
        if law.normal_stiffness is not None:
            stiffness[closed, NORMAL, NORMAL] = law.normal_stiffness * self.area[closed]
        if law.tangential_stiffness is not None:
            for axis in TANGENTIAL.tolist():
                stiffness[sticking, axis, axis] = law.tangential_stiffness * self.area[sticking]
        return self.between(stiffness)

    def between(self, stiffness: FloatArray) -> sparse.csr_array:
        """Return the stiffness matrix of springs between the nodes of each pair, from blocks (n_pairs, 3, 3) in N/m."""
        used = stiffness.any(axis=(1, 2))
        blocks = stiffness[used]
        ends = np.concatenate([self.up[used], self.low[used]], axis=1)
        both = np.block([[blocks, -blocks], [-blocks, blocks]])
        rows, columns = np.broadcast_arrays(ends[:, :, None], ends[:, None, :])
        matrix = sparse.csr_array((both.ravel(), (rows.ravel(), columns.ravel())), shape=(self.n, self.n))
        matrix.eliminate_zeros()
        return matrix


def tie(pairs: Pairs, tied: BoolArray, fixed: ArrayLike = ()) -> tuple[sparse.csr_array, NDArray[np.int64]]:
    """Return the matrix that expands independent displacements to all DOFs, without tied and fixed DOFs.

    Parameters
    ----------
    pairs : Pairs
        Pairs of nodes.
    tied : ndarray of bool, shape (n_pairs, 3)
        Directions in which the upper node is tied to the lower node.
    fixed : array_like of int
        Fixed DOFs, none by default.

    Returns
    -------
    expansion : csr_array, shape (n, n_independent)
        Matrix of zeros and ones.
    independent : ndarray of int, shape (n_independent,)
        Independent DOFs in ascending order.

    See Also
    --------
    solve_contact : Static equilibrium with contact.
    """
    n = pairs.n
    followers, leaders = pairs.up[tied], pairs.low[tied]
    independent = np.ones(n, bool)
    independent[np.asarray(fixed, np.int64)] = False
    stands_for = np.arange(n)
    stands_for[followers] = leaders
    # If a tied node is fixed, its partner is fixed, too.
    independent[leaders[~independent[followers]]] = False
    rows = np.flatnonzero(independent[stands_for])
    independent[followers] = False
    column = np.cumsum(independent) - 1
    entries = (np.ones(rows.size), (rows, column[stands_for[rows]]))
    return sparse.csr_array(entries, shape=(n, int(independent.sum()))), np.flatnonzero(independent)


@dataclass(frozen=True)
class InterfaceState:
    """Forces and displacements of an interface, pair by pair.

    Attributes
    ----------
    closed, slipping : ndarray of bool, shape (n_pairs,)
        Pairs in contact, and pairs in contact at the limit of friction.
    force : ndarray, shape (n_pairs, 3)
        Force on the upper body, N.
    pressure : ndarray, shape (n_pairs,)
        Normal force divided by area, Pa.
    separation : ndarray, shape (n_pairs,)
        Distance along y, m; negative if closed pairs of finite stiffness overlap.
    slide : ndarray, shape (n_pairs, 2)
        Displacement of the upper node relative to the lower node along x and z, m.
    slip_ratio : ndarray, shape (n_pairs,)
        Shear stress divided by its limit mu p (4.1)-(4.2): 1 if slipping, 0 if open or without friction.
    """

    closed: BoolArray
    slipping: BoolArray
    force: FloatArray
    pressure: FloatArray
    separation: FloatArray
    slide: FloatArray
    slip_ratio: FloatArray

    @property
    def normal_force(self) -> float:
        """Resultant normal force between the two bodies, N."""
        return float(self.force[:, NORMAL].sum())


@dataclass(frozen=True)
class Iteration:
    """Iteration of the active set: one solution with a given set of contacts.

    Attributes
    ----------
    closed, slipping : int
        Numbers of closed pairs and of slipping pairs.
    changed : int
        Number of pairs whose state changes after the solution; 0 in the last iteration.
    residual : float
        Residual force divided by the largest load.
    """

    closed: int
    slipping: int
    changed: int
    residual: float


@dataclass(frozen=True)
class ContactSolution:
    """Static equilibrium of bodies in contact.

    Attributes
    ----------
    displacement : ndarray, shape (n,)
        Displacements of all DOFs.
    interfaces : dict of str to InterfaceState
        Forces and displacements of each interface.
    history : tuple of Iteration
        Iterations of the active set.
    """

    displacement: FloatArray
    interfaces: dict[str, InterfaceState]
    history: tuple[Iteration, ...]


def solve_contact(
    stiffness: sparse.sparray,
    load: FloatArray,
    interfaces: Mapping[str, ContactInterface],
    law: ContactLaw,
    *,
    fixed: ArrayLike = (),
    max_iterations: int = 50,
) -> ContactSolution:
    """Return the static equilibrium of elastic bodies in contact at pairs of nodes, for small displacements.

    Parameters
    ----------
    stiffness : sparse array, shape (n, n)
        Symmetric stiffness matrix, N/m. DOFs are x, y, z of node 0, then of node 1, ..., then any other DOFs.
    load : ndarray, shape (n,)
        Forces on the DOFs, N, applied in one step from the unloaded state.
    interfaces : mapping of str to ContactInterface
        Interfaces by name; no node may belong to two pairs.
    law : ContactLaw
        Contact law of all interfaces.
    fixed : array_like of int
        Fixed DOFs, none by default.
    max_iterations : int
        Largest number of iterations, default 50.

    Returns
    -------
    ContactSolution

    Raises
    ------
    ValueError
        A body is free to move, an interface opens everywhere, or the iteration does not converge.

    Notes
    -----
    The method is a primal-dual active set with these rules:

    - Initially, all pairs are closed and sticking, so a body is supported by contact with a supported body.
    - A closed pair in tension opens. An open pair that overlaps closes.
    - A sticking pair outside the friction cone slips. Its shear force is mu p, opposite to the sliding; the solution
      gives the force together with p, and Newton's method gives its direction.
    - A slipping pair sticks again if the sliding reverses.

    The load is applied in one step, so the load path is not followed. The result is exact if the contacts do not depend
    on the load level, which is true without slip.

    Springs of 1e-8 of the stiffness of a node act on slipping pairs, to support bodies that are fixed only by friction.
    Without slip there is no regularisation.

    See Also
    --------
    jointfrf.workbench.cases.bolted_lap.preload.preload : Static state of a lap joint under preload.

    Examples
    --------
    Two cubes of 10 mm are stacked and compressed:

    >>> import numpy as np
    >>> from jointfrf.workbench.solids.brick import Material, assemble_bricks
    >>> from jointfrf.workbench.cases.bolted_lap.contact import ContactInterface, ContactLaw, solve_contact
    >>> corners = np.array([[0, 0], [0, 1], [1, 1], [1, 0]])
    >>> nodes = [[0.01 * x, y, 0.01 * z] for y in (0.0, 0.01, 0.01, 0.02) for x, z in corners]
    >>> k, _ = assemble_bricks(nodes, [range(8), range(8, 16)], Material(70e9, 0.0, 2700.0))
    >>> load = np.zeros(48)
    >>> load[37::3] = -100.0
    >>> faces = ContactInterface(np.arange(4, 8), np.arange(8, 12), np.full(4, 25e-6))
    >>> found = solve_contact(k, load, {"faces": faces}, ContactLaw(), fixed=range(12)).interfaces["faces"]
    >>> (found.pressure / 1e6).round(9).tolist()
    [4.0, 4.0, 4.0, 4.0]
    """
    k = sparse.csr_array(stiffness)
    problem = _Problem(k, load, Pairs(interfaces, k.shape[0]), law, np.asarray(fixed, np.int64))
    return problem.iterate(max_iterations)


@dataclass
class _Contacts:
    """Set of contacts.

    Attributes
    ----------
    closed, slipping : ndarray of bool, shape (n_pairs,)
        Pairs in contact, and slipping pairs.
    direction : ndarray, shape (n_pairs, 2)
        Unit vector of the sliding in x and z.
    turning : ndarray, shape (n_pairs,)
        Stiffness of the shear force for sliding normal to its direction, N/m.
    """

    closed: BoolArray
    slipping: BoolArray
    direction: FloatArray
    turning: FloatArray

    def sticking(self) -> BoolArray:
        return self.closed & ~self.slipping


class _Problem:
    """Iteration over sets of contacts."""

    def __init__(
        self, k: sparse.csr_array, f: FloatArray, pairs: Pairs, law: ContactLaw, fixed: NDArray[np.int64]
    ) -> None:
        self.k, self.f, self.pairs, self.law, self.fixed = k, f, pairs, law, fixed
        self.node_stiffness = float(np.median(k.diagonal()[pairs.up]))

    def iterate(self, max_iterations: int) -> ContactSolution:
        count = len(self.pairs.area)
        slips = np.full(count, self.law.friction == 0)
        contacts = _Contacts(np.ones(count, bool), slips, np.zeros((count, 2)), np.zeros(count))
        history: list[Iteration] = []
        for _ in range(max_iterations):
            u, residual = self.solve(contacts)
            force = (self.k @ u - self.f)[self.pairs.up]
            relative = u[self.pairs.up] - u[self.pairs.low]
            after = self.judged(contacts, force, relative)
            history.append(self.record(contacts, after, force, residual))
            if history[-1].changed == 0:
                return ContactSolution(u, self.states(contacts, force, relative), tuple(history))
            contacts = after
            for name, part in self.pairs.parts.items():
                if not contacts.closed[part].any():
                    raise ValueError(f"interface {name!r} opens everywhere; apply a load that it can carry")
        raise ValueError(
            f"the contact did not converge in {max_iterations} iterations, {history[-1].changed} of {count} pairs "
            "still change; try more iterations, a finer mesh or a tangential stiffness"
        )

    def solve(self, contacts: _Contacts) -> tuple[FloatArray, float]:
        """Return the displacements with these contacts, and the residual force divided by the largest load."""
        pairs, law = self.pairs, self.law
        closed, sticking = contacts.closed, contacts.sticking()
        t, _ = tie(pairs, pairs.tied(law, closed, sticking), self.fixed)
        springs = pairs.springs(law, closed, sticking)
        k, f = self.k, self.f
        slips = closed & contacts.slipping
        if slips.any():
            springs = springs + pairs.between(self.slip_stiffness(contacts, slips))
            shear = self.friction_rows(contacts, slips)
            k, f = k + shear @ k, f + shear @ f
        matrix = sparse.csc_array(t.T @ (k + springs) @ t)
        right = t.T @ f
        try:
            factors = sparse_linalg.splu(matrix, **SYMMETRIC)
            pivots = abs(factors.U.diagonal())
            regular = pivots.min() > _SINGULAR * pivots.max()
        except RuntimeError:  # exactly singular
            regular = False
        if not regular:
            raise ValueError("a body can move freely; clamp one of its ends, or let it touch a body that is supported")
        q = factors.solve(right)
        u: FloatArray = t @ q
        return u, float(abs(matrix @ q - right).max() / abs(self.f).max())

    def slip_stiffness(self, contacts: _Contacts, slips: BoolArray) -> FloatArray:
        """Return the stiffness of slipping pairs: regularisation, and the derivative of the shear force's direction.

        The derivative of the shear force -mu p w/|w| with respect to sliding w normal to its direction d is mu p/|w|.
        """
        d = contacts.direction[slips]
        across = np.eye(2) - d[:, :, None] * d[:, None, :]
        blocks = np.zeros((len(slips), 3, 3))
        blocks[np.ix_(slips, TANGENTIAL, TANGENTIAL)] = contacts.turning[
            slips, None, None
        ] * across + _SOFT * self.node_stiffness * np.eye(2)
        return blocks

    def friction_rows(self, contacts: _Contacts, slips: BoolArray) -> sparse.csr_array:
        """Return the matrix that adds mu p d to the tangential equations of slipping pairs; p is the normal residual.

        The shear force is -mu p d on an upper node, and mu p d on a lower node.
        """
        pairs, n = self.pairs, len(self.f)
        normal = pairs.up[slips, NORMAL]
        share = self.law.friction * contacts.direction[slips]
        rows = np.concatenate([side[slips, axis] for side in (pairs.up, pairs.low) for axis in TANGENTIAL.tolist()])
        values = np.concatenate([share[:, 0], share[:, 1], -share[:, 0], -share[:, 1]])
        return sparse.csr_array((values, (rows, np.tile(normal, 4))), shape=(n, n))

    def judged(self, contacts: _Contacts, force: FloatArray, relative: FloatArray) -> _Contacts:
        """Return the updated contacts from the solution."""
        normal, shear, slide = force[:, NORMAL], force[:, TANGENTIAL], relative[:, TANGENTIAL]
        overlaps = relative[:, NORMAL] < -_ROUNDING * abs(relative).max()
        closed = np.where(contacts.closed, normal > -_ROUNDING * abs(normal).max(), overlaps)
        if self.law.friction == 0:
            return _Contacts(closed, contacts.slipping, contacts.direction, contacts.turning)
        limit = self.law.friction * np.maximum(normal, 0)
        along = (slide * contacts.direction).sum(axis=1)
        elastic = np.zeros(len(limit))
        if self.law.tangential_stiffness is not None:
            elastic = limit / (self.law.tangential_stiffness * self.pairs.area)
        goes_on = contacts.slipping & (along > elastic)
        starts = ~contacts.slipping & (np.linalg.norm(shear, axis=1) > limit * (1 + _ROUNDING))
        slipping = closed & contacts.closed & (goes_on | starts)
        towards = np.where(goes_on[:, None], slide, -shear)
        length = np.where(slipping, np.linalg.norm(towards, axis=1), 1.0)
        return _Contacts(
            closed,
            slipping,
            np.where(slipping[:, None], towards / length[:, None], 0.0),
            np.where(slipping & goes_on, limit / length, 0.0),
        )

    def record(self, before: _Contacts, after: _Contacts, force: FloatArray, residual: float) -> Iteration:
        normal = np.maximum(force[:, NORMAL], 0)
        turned = self.law.friction * normal * np.linalg.norm(after.direction - before.direction, axis=1)
        changed = (
            (before.closed != after.closed)
            | (after.closed & (before.slipping != after.slipping))
            | (turned > _REPEAT * normal.max())
        )
        return Iteration(
            closed=int(before.closed.sum()),
            slipping=int((before.closed & before.slipping).sum()),
            changed=int(changed.sum()),
            residual=residual,
        )

    def states(self, contacts: _Contacts, force: FloatArray, relative: FloatArray) -> dict[str, InterfaceState]:
        closed = contacts.closed
        carried = np.where(closed[:, None], force, 0.0)
        normal = carried[:, NORMAL]
        shear = np.linalg.norm(carried[:, TANGENTIAL], axis=1)
        limit = self.law.friction * normal
        each = {
            "closed": closed,
            "slipping": closed & contacts.slipping,
            "force": carried,
            "pressure": normal / self.pairs.area,
            "separation": relative[:, NORMAL],
            "slide": relative[:, TANGENTIAL],
            "slip_ratio": np.divide(shear, limit, out=np.zeros_like(shear), where=limit > 0),
        }
        return {
            name: InterfaceState(**{key: value[part] for key, value in each.items()})
            for name, part in self.pairs.parts.items()
        }
