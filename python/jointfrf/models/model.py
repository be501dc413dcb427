"""A linear model by its matrices and the names of its DOFs; assemblies; lumped chains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, TypeVar, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy import linalg, sparse
from scipy.sparse import linalg as sparse_linalg

from jointfrf.dofs import similar_dof
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_dofs, as_names, as_real, check_choice, check_type
from jointfrf.laws.law_joint import LawJoint
from jointfrf.models.matrices import Matrix, ModelMatrices
from jointfrf.models.receptance import ReceptanceMethod, receptance

__all__ = ["Ground", "Model", "assemble", "chain", "shift_of", "with_modal_damping"]

#: Size up to which all modes are computed; beyond it only the requested ones.
_DENSE_LIMIT = 50
#: Share of the mean w^2 of single DOFs below zero at which modes are computed: K - shift M is then regular for a free
#: structure, too, and its condition leaves eight digits (at 1 Hz it left five).
_SHIFT = 1e-8
#: Largest number of rigid-body motions; their frequencies are below this share of the next ones.
_RIGID, _ELASTIC = 6, 1e-3
Ground = Literal["none", "start", "end", "both"]
_Model = TypeVar("_Model", bound="Model")


@dataclass(frozen=True)
class Model:
    """Stiffness, mass and damping of a structure.

    Parameters
    ----------
    stiffness, mass : scipy sparse array or ndarray, shape (n, n)
        Stiffness K, N/m, and mass M, kg.
    dofs : tuple of str
        Names of the DOFs, ``"node:direction"`` with nodes counted from 1.
    damping : sparse array or ndarray, shape (n, n), optional
        Viscous damping C, N s/m.
    structural_damping : sparse array or ndarray, shape (n, n), optional
        Structural damping H, N/m.
    loss_factor : float
        Loss factor of the whole stiffness, K (1 + i eta), default 0.

    Examples
    --------
    >>> import jointfrf as jf
    >>> model = jf.chain([1.0, 1.0], [2.0, 2.0], ground="start")
    >>> model.dofs, model.index("2:x")
    (('1:x', '2:x'), 1)
    """

    stiffness: sparse.sparray | FloatArray
    mass: sparse.sparray | FloatArray
    dofs: tuple[str, ...]
    damping: sparse.sparray | FloatArray | None = None
    structural_damping: sparse.sparray | FloatArray | None = None
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        for name in ("stiffness", "mass"):
            shape = np.shape(getattr(self, name))
            if len(shape) != 2 or shape[0] != shape[1]:
                raise ValueError(f"{name} must be a square matrix, not of shape {shape}")
        n = np.shape(self.stiffness)[0]
        object.__setattr__(self, "dofs", as_names("dofs", self.dofs))
        if len(self.dofs) != n or len(set(self.dofs)) != n:
            raise ValueError(f"dofs must name {n} different DOFs of stiffness, not {len(set(self.dofs))}")

    def index(self, *names: str) -> int | list[int]:
        """Return the number of a DOF, or the list of several numbers, counted from 0.

        Raises
        ------
        ValueError
            The model has no such DOF.
        """
        for name in as_names("names", names):
            if name not in self.dofs:
                hint = similar_dof(name, self.dofs) or f"; use one of {self.dofs[0]!r} to {self.dofs[-1]!r}"
                raise ValueError(f"the model has no DOF {name!r}{hint}")
        found = [self.dofs.index(name) for name in names]
        return found[0] if len(found) == 1 else found

    def ports(self, *names: str) -> list[int] | sparse.csr_array:
        """Return the argument `outputs` or `inputs` of `jointfrf.receptance` for these names: DOFs, counted from 0.

        Raises
        ------
        ValueError
            The model has no such DOF.
        """
        found = self.index(*names)
        return [found] if isinstance(found, int) else found

    def receptance(
        self,
        freq_hz: ArrayLike,
        outputs: Sequence[str] | ArrayLike | Matrix | None = None,
        inputs: Sequence[str] | ArrayLike | Matrix | None = None,
        method: ReceptanceMethod = "auto",
    ) -> ComplexArray:
        """Return the receptance of the model, see `jointfrf.receptance`; `inputs` are the `outputs` by default.

        Both are names of DOFs, or arguments of `jointfrf.receptance`.
        """
        outputs = self._numbered(outputs)
        return receptance(
            freq_hz,
            self.stiffness,
            self.mass,
            self.damping,
            self.loss_factor,
            self.structural_damping,
            outputs,
            outputs if inputs is None else self._numbered(inputs),
            method=method,
        )

    def _numbered(self, ports: Any) -> Any:
        """Return the numbers of named DOFs, any other argument unchanged."""
        if isinstance(ports, str):
            return self.ports(ports)
        if isinstance(ports, list | tuple) and ports and all(isinstance(one, str) for one in ports):
            return self.ports(*ports)
        return ports

    def natural_frequencies(self, count: int | None = None) -> FloatArray:
        """Return undamped natural frequencies, lowest first.

        Parameters
        ----------
        count : int, optional
            Number of frequencies; all by default.

        Returns
        -------
        ndarray, shape (count,)
            Natural frequencies, Hz.
        """
        return self.modes(count)[0]

    def modes(self, count: int | None = None) -> tuple[FloatArray, FloatArray]:
        """Return undamped natural frequencies, lowest first, and their shapes.

        Parameters
        ----------
        count : int, optional
            Number of modes; all by default.

        Returns
        -------
        freq_hz : ndarray, shape (count,)
            Natural frequencies, Hz; about 0 for a rigid-body motion. Fewer than requested if DOFs have no mass.
        shapes : ndarray, shape (n, count)
            Shapes of unit modal masses, 1/sqrt(kg).

        Raises
        ------
        ValueError
            There are no modes: mass or stiffness is negative or not symmetric, or both are zero for a motion.
        """
        n = len(self.dofs)
        matrices = ModelMatrices(self.stiffness, self.mass, None, None, 0.0)
        matrices.check_symmetric("the model has no real modes")  # else half of it would be used
        k, m = matrices.sparse("stiffness"), matrices.sparse("mass")
        try:
            if count is None or count > n - 2 or n <= _DENSE_LIMIT:
                squared, shapes = _all_modes(k.toarray(), m.toarray())
            else:
                # A fixed start makes results reproducible.
                squared, shapes = sparse_linalg.eigsh(k, count, m, sigma=shift_of(k, m), v0=np.ones(n))
        except (linalg.LinAlgError, RuntimeError) as error:
            raise ValueError(
                "the model has no modes: a motion has no stiffness and no mass, or one of them is negative"
            ) from error
        order = np.argsort(squared)[:count]
        freq: FloatArray = np.sqrt(np.maximum(squared[order], 0)) / (2 * np.pi)
        return freq, shapes[:, order]


def with_modal_damping(model: _Model, ratios: ArrayLike) -> _Model:
    """Return a model with viscous damping of its modes.

    Parameters
    ----------
    model : Model
        Model without this damping.
    ratios : array_like, shape (n,)
        Damping ratios of its lowest elastic modes; higher modes get no damping.

    Returns
    -------
    Model
        Model of the same type, with a full matrix C = M Phi diag(2 zeta omega) Phi^T M added to its damping.

    Raises
    ------
    ValueError
        A negative ratio, more ratios than elastic modes.

    See Also
    --------
    Model.modes : undamped modes.
    beam, plate : models of structures.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> model = jf.with_modal_damping(jf.chain([1.0, 1.0], [100.0], ground="none"), [0.01])
    >>> c, (freq, shapes) = model.damping, model.modes()
    >>> np.round(abs(np.diagonal(shapes.T @ c @ shapes)) / (4 * np.pi * freq[1]), 6).tolist()
    [0.0, 0.01]
    """
    check_type("model", model, Model)
    zeta = as_real("ratios", ratios, (None,))
    if (zeta < 0).any():
        raise ValueError(f"ratios must not be negative, not {zeta.min():g}")
    freq, shapes = model.modes(min(zeta.size + _RIGID, len(model.dofs)))
    elastic = freq > _ELASTIC * max(freq.max(initial=0.0), np.finfo(float).tiny)
    freq, shapes = freq[elastic][: zeta.size], shapes[:, elastic][:, : zeta.size]
    if freq.size < zeta.size:
        raise ValueError(f"ratios names {zeta.size} modes; the model has {freq.size} elastic ones")
    moved = np.asarray(model.mass @ shapes)
    c = moved * (4 * np.pi * freq * zeta) @ moved.T
    own: Any = 0.0 if model.damping is None else model.damping
    return replace(model, damping=np.asarray(c + (own.toarray() if sparse.issparse(own) else own)))


def shift_of(k: Matrix, m: Matrix) -> float:
    """Return a shift for which K - shift M is regular and well-conditioned, also for a free structure, (rad/s)^2."""
    return -_SHIFT * float(abs(k.diagonal()).sum() / max(abs(m.diagonal()).sum(), 1e-300))


def _all_modes(k: FloatArray, m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return squared natural circular frequencies and shapes; infinite ones of DOFs without mass are omitted."""
    try:
        squared, shapes = linalg.eigh(k, m)
    except linalg.LinAlgError:
        # M v = mu (K - shift M) v, where 1/mu = w^2 - shift is infinite for a motion without mass.
        shift = shift_of(k, m)
        mu, shapes = linalg.eigh(m, k - shift * m)
        finite = mu > len(mu) * np.finfo(float).eps * mu.max()
        shapes = shapes[:, finite] / np.sqrt(mu[finite])
        squared = 1 / mu[finite] + shift
    return squared, shapes


def _block_diagonal(
    a: sparse.sparray | FloatArray | None, b: sparse.sparray | FloatArray | None, n_a: int, n_b: int
) -> sparse.csr_array:
    blocks = [sparse.csr_array((n, n)) if x is None else sparse.csr_array(x) for x, n in ((a, n_a), (b, n_b))]
    return sparse.csr_array(sparse.block_diag(blocks, format="csr"))


def assemble(a: Model, b: Model, joint: Joint | LawJoint, dofs_a: Sequence[int], dofs_b: Sequence[int]) -> Model:
    """Return the assembly of two models through a joint, by adding the joint to the matrices.

    Parameters
    ----------
    a, b : Model
        Models of the substructures.
    joint : Joint or LawJoint
        Joint; its laws must be springs and dampers, its masses are on either side.
    dofs_a, dofs_b : sequence of int
        Joint DOFs j of A and k of B, counted from 0, in the order of the joint.

    Returns
    -------
    Model
        Assembly with DOFs of A (named ``"A/..."``), then of B (``"B/..."``). A loss factor becomes a structural damping
        matrix.

    Raises
    ------
    ValueError
        The numbers of DOFs differ; a rigid DOF, or a law that depends on frequency: matrices cannot contain these, use
        `couple`.

    See Also
    --------
    couple : FRFs of an assembly, for any joint.
    Assembly : an assembly with unknowns, for fits.

    Examples
    --------
    >>> import jointfrf as jf
    >>> a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start")
    >>> b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end")
    >>> jf.assemble(a, b, jf.Joint([2000.0], [3.0]), [1], [0]).natural_frequencies().round(3).tolist()
    [2.598, 4.682, 7.77, 8.374]
    """
    for name, value in (("a", a), ("b", b)):
        check_type(name, value, Model)
    if not isinstance(joint, Joint | LawJoint):
        raise TypeError(f"joint must be a Joint or a LawJoint, not {type(joint).__name__}")
    as_dofs("dofs_a", dofs_a, len(a.dofs))
    as_dofs("dofs_b", dofs_b, len(b.dofs))
    n_a, n_b, n_j = len(a.dofs), len(b.dofs), len(joint.dofs)
    if not len(dofs_a) == len(dofs_b) == n_j:
        raise ValueError(f"dofs_a and dofs_b must name {n_j} DOFs each, not {len(dofs_a)} and {len(dofs_b)}")
    springs, added = _constants(joint)
    rows = np.tile(np.arange(n_j), 2)
    columns = np.concatenate([np.asarray(dofs_a), n_a + np.asarray(dofs_b)])
    relative = sparse.csr_array((np.repeat([1.0, -1.0], n_j), (rows, columns)), shape=(n_j, n_a + n_b))

    def across(matrix: FloatArray) -> sparse.csr_array:
        return sparse.csr_array(relative.T @ sparse.csr_array(matrix) @ relative)

    losses = [
        (0 if m.structural_damping is None else m.structural_damping) + m.loss_factor * m.stiffness for m in (a, b)
    ]
    return Model(
        stiffness=_block_diagonal(a.stiffness, b.stiffness, n_a, n_b) + across(springs.stiffness),
        mass=_block_diagonal(a.mass, b.mass, n_a, n_b) + sparse.diags_array(abs(relative).T @ (added / 2)),
        damping=_block_diagonal(a.damping, b.damping, n_a, n_b) + across(springs.damping),
        structural_damping=_block_diagonal(losses[0], losses[1], n_a, n_b) + across(springs.hysteretic_stiffness),
        dofs=tuple(f"A/{d}" for d in a.dofs) + tuple(f"B/{d}" for d in b.dofs),
    )


def _constants(joint: Joint | LawJoint) -> tuple[Joint, FloatArray]:
    """Return springs and dampers of a joint, and its mass by DOF."""
    if isinstance(joint, Joint):
        return joint, np.zeros(len(joint.dofs))
    if joint.rigid:
        raise ValueError(f"joint: {', '.join(joint.rigid)} is rigid, which adds no spring to matrices; use couple")
    varying = [type(law).__name__ for law in joint.laws.values() if law.constant_terms is None]
    if varying:
        raise ValueError(f"joint: a {varying[0]} depends on frequency, which matrices do not; use couple")
    springs = LawJoint(joint.laws, dofs=joint.dofs, per=joint.per).constant_joint()
    return springs, np.array([joint.mass.get(dof, 0.0) for dof in joint.dofs])


def chain(
    masses: ArrayLike,
    stiffness: ArrayLike,
    damping: ArrayLike | None = None,
    *,
    ground: Ground = "start",
    loss_factor: float = 0.0,
) -> Model:
    """Return a chain of masses with a spring and a dashpot between neighbours (figure 3-1).

    Parameters
    ----------
    masses : array_like, shape (n,)
        Masses, kg.
    stiffness : array_like, shape (n_springs,)
        Springs from the first to the last, N/m: n - 1 between the masses, and one more for each grounded end.
    damping : array_like, shape (n_springs,), optional
        Dashpots parallel to the springs, N s/m; none by default.
    ground : {"start", "end", "both", "none"}
        Ends that a spring connects to the ground.
    loss_factor : float
        Loss factor of all springs, default 0.

    Returns
    -------
    Model
        Chain with DOFs ``"1:x"`` ... ``"n:x"``.

    Raises
    ------
    ValueError
        A mass that is not positive, or a wrong number of springs.

    See Also
    --------
    beam : beams.
    rigid_body : rigid bodies.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.chain([5, 3], [2500, 3500], ground="start").stiffness.toarray().tolist()
    [[6000.0, -3500.0], [-3500.0, 3500.0]]
    """
    check_choice("ground", ground, get_args(Ground))
    m = as_real("masses", masses, (None,))
    if m.size == 0 or (m <= 0).any():
        raise ValueError("masses must name at least one mass, all positive")
    first = 0 if ground in ("start", "both") else 1
    count = m.size + 1 - first - (0 if ground in ("end", "both") else 1)
    k = as_real("stiffness", stiffness, (count,))
    c = None if damping is None else as_real("damping", damping, (count,))

    def assembled(springs: FloatArray) -> sparse.dia_array:
        links = np.zeros(m.size + 1)  # link i is before mass i, the last one after the last mass
        links[first : first + count] = springs
        diagonals = {-1: -links[1:-1], 0: links[:-1] + links[1:], 1: -links[1:-1]}
        if m.size == 1:
            diagonals = {0: diagonals[0]}
        return sparse.dia_array(sparse.diags_array(list(diagonals.values()), offsets=list(diagonals)))

    return Model(
        stiffness=assembled(k),
        mass=sparse.dia_array(sparse.diags_array(m)),
        damping=None if c is None else assembled(c),
        dofs=tuple(f"{i + 1}:x" for i in range(m.size)),
        loss_factor=loss_factor,
    )
