"""Receptance of a model from its matrices (2.28)-(2.29)."""

from __future__ import annotations

import warnings
from typing import Any, Literal, NamedTuple, cast, get_args, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg

from jointfrf.channels.point_lines import transform
from jointfrf.errors import ConvergenceWarning
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_frequency,
    as_number,
    as_positive,
    as_real,
    check_choice,
    checked_out,
)
from jointfrf.kernel.call import N_FREQ, RCOND_LIMIT, LineStatus, OnSingular, check_lines, run
from jointfrf.models.factors import Factors, SingularMatrixError, SparseSolver
from jointfrf.models.krylov import reduce_model, spot_error
from jointfrf.models.matrices import Matrix, ModelMatrices, Ports, as_ports, directions
from jointfrf.models.modal import SINGULAR, Modes, all_modes, find_rigid_modes, mode_condition

__all__ = ["ReceptanceInfo", "ReceptanceMethod", "receptance"]


Direct = Literal["dense", "banded", "sparse"]
ReceptanceMethod = Literal["auto", "dense", "banded", "sparse", "modal", "krylov"]

#: Share of the size of a matrix above which a band is solved as a full matrix.
_BAND_LIMIT = 0.25
#: Size up to which a model is solved as a full matrix, for any structure.
_TINY = 8
#: Band, or size, up to which a direct solution of many lines side by side is as fast as any reduction.
_NARROW, _SMALL = 64, 64
#: Size above which all modes cost more than a reduced model.
_ALL_MODES = 600
#: Number of lines from which on, and number of requested DOFs up to which a reduction is faster.
_MANY_LINES, _FEW_DOFS = 32, 64
#: Share of entries of a full matrix below which larger models are factored as sparse matrices.
_SPARSE = 0.1
#: Number of lines at which a sum of all modes is compared with a direct solution.
_SPOTS = 3


class ReceptanceInfo(NamedTuple):
    """Method, error estimate and solver of calculated receptances.

    Parameters
    ----------
    method : {"dense", "banded", "sparse", "modal", "krylov"}
        Method that was used.
    reason : str
        Reason of the choice, in a sentence.
    error_estimate : float or None
        Error of "modal" and "krylov": largest difference to a direct solution at a few lines, relative to the largest
        entry of the line. None for a direct solution.
    tolerance : float or None
        Upper limit of the estimate, unless rounding keeps a direct solution from it, too.
    n_vectors : int or None
        Number of modes, or of vectors of the reduced model.
    solver : str or None
        Library and order of elimination of factored sparse matrices, for "sparse" and "krylov".
    checked_hz : tuple of float
        Lines of the error estimate, Hz: between them the error is not bounded.
    """

    method: Literal["dense", "banded", "sparse", "modal", "krylov"]
    reason: str
    error_estimate: float | None = None
    tolerance: float | None = None
    n_vectors: int | None = None
    solver: str | None = None
    checked_hz: tuple[float, ...] = ()


class _Task(NamedTuple):
    """A request whose arguments are checked."""

    freq_hz: FloatArray
    matrices: ModelMatrices
    outputs: Ports
    inputs: Ports
    on_singular: OnSingular
    tolerance: float
    out: ComplexArray | None

    @property
    def is_empty(self) -> bool:
        """Whether there are no lines, or no DOF has a weight."""
        return not (self.freq_hz.size and (self.outputs.weights.nnz or self.inputs.weights.nnz))


@overload
def receptance(
    freq_hz: ArrayLike,
    stiffness: Matrix,
    mass: Matrix,
    damping: Matrix | None = ...,
    loss_factor: float = ...,
    structural_damping: Matrix | None = ...,
    outputs: ArrayLike | Matrix | None = ...,
    inputs: ArrayLike | Matrix | None = ...,
    method: ReceptanceMethod = ...,
    *,
    on_singular: OnSingular = ...,
    out: ComplexArray | None = ...,
    tolerance: float = ...,
    full_output: Literal[False] = ...,
) -> ComplexArray: ...


@overload
def receptance(
    freq_hz: ArrayLike,
    stiffness: Matrix,
    mass: Matrix,
    damping: Matrix | None = ...,
    loss_factor: float = ...,
    structural_damping: Matrix | None = ...,
    outputs: ArrayLike | Matrix | None = ...,
    inputs: ArrayLike | Matrix | None = ...,
    method: ReceptanceMethod = ...,
    *,
    on_singular: OnSingular = ...,
    out: ComplexArray | None = ...,
    tolerance: float = ...,
    full_output: Literal[True],
) -> tuple[ComplexArray, ReceptanceInfo]: ...


def receptance(
    freq_hz: ArrayLike,
    stiffness: Matrix,
    mass: Matrix,
    damping: Matrix | None = None,
    loss_factor: float = 0.0,
    structural_damping: Matrix | None = None,
    outputs: ArrayLike | Matrix | None = None,
    inputs: ArrayLike | Matrix | None = None,
    method: ReceptanceMethod = "auto",
    *,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
    tolerance: float = 1e-8,
    full_output: bool = False,
) -> ComplexArray | tuple[ComplexArray, ReceptanceInfo]:
    """Return the receptance ((1 + i eta) K + i H + i w C - w^2 M)^-1 at chosen DOFs.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz.
    stiffness, mass : array_like or scipy sparse array, shape (n, n)
        Stiffness K, N/m, and mass M, kg.
    damping : array_like or sparse array, shape (n, n), optional
        Viscous damping C, N s/m; none by default.
    loss_factor : float
        Loss factor eta of the whole stiffness, default 0.
    structural_damping : array_like or sparse array, shape (n, n), optional
        Structural damping H, N/m; none by default.
    outputs, inputs : array_like of int, or of shape (m, n), optional
        DOFs of responses and of forces, counted from 0; all by default. Or weights of all DOFs for each response or
        force, an array or sparse array: a mean, a difference, a point between nodes.
    method : {"auto", "dense", "banded", "sparse", "modal", "krylov"}
        Method, default "auto", see Notes:

        - "dense": full matrices solved on every line, with any damping
        - "banded": the same in band storage
        - "sparse": a sparse factorisation of every line, with any damping
        - "modal": the sum of all modes; for symmetric K and M and damping that the undamped modes diagonalise
        - "krylov": the model is reduced to solutions at a few frequencies; for symmetric K and M, damping a M + b K and
          one loss factor. If `tolerance` is not met, the model is solved with a warning
    on_singular : {"raise", "nan"}
        Whether a singular line raises an error (default) or becomes NaN.
    out : ndarray of complex128, shape (n_freq, n_out, n_in), optional
        Array for the result, see `invert`.
    tolerance : float
        Upper limit of the error estimate of "krylov", and of "modal" if "auto" chose it: the largest error of a line
        relative to its largest entry. If rounding limits a direct solution, too, 30 times its rounding is sufficient,
        up to 2.2e-4, which is the rounding at the reciprocal condition `jointfrf.RCOND_LIMIT`.
    full_output : bool
        Whether to return a `ReceptanceInfo` as well, with method, reason and error estimate; default False.

    Returns
    -------
    h : ndarray, shape (n_freq, n_out, n_in)
        Receptance, m/N (rotational rows rad/N, rotational columns m/(N m)).
    info : ReceptanceInfo
        Method and error, only with `full_output`.

    Raises
    ------
    SingularLineError
        A line is at an undamped natural frequency, or at 0 Hz of a free structure.
    ValueError
        Wrong shapes or DOFs, NaN or Inf; "modal" or "krylov" with damping that couples the modes.

    Warns
    -----
    ConvergenceWarning
        "krylov" did not meet the tolerance; the model was solved instead.
    IllConditionedWarning
        A line is singular to working precision; or rounding of the entries of K changes the rigid-body motion of a
        structure on soft springs by more than 2.2e-4 of it.

    See Also
    --------
    Model.receptance : the same by names of DOFs.
    couple : receptance of an assembly.

    Notes
    -----
    Eqs. (2.28), (2.29), with i w C for viscous damping. Cost a line: n^3 (dense), n b^2 (band of b diagonals),
    n_vectors n_out n_in (modal, krylov); about n^1.5 for a sparse solution of a solid.

    "auto" uses band storage if the band is narrow, and full matrices if the model is small. For many lines of a larger
    symmetric model with damping a M + b K and one loss factor it sums modes, all of them or the modes of a reduced
    model. This sum is compared with direct solutions at a few lines: at both ends, and for a reduced model at the
    largest residual. If the tolerance is not met, the model is solved. The error between these lines is estimated, not
    bounded. A model with any other damping is solved, by a sparse factorisation if it has many DOFs and few entries.

    Rigid-body motions are first separated and enter by their mass alone, because near 0 Hz rounding hides them from any
    solution of a free structure. A motion is free if its stiffness in K is within 32 roundings of its terms.

    SuperLU factors sparse matrices, from 4 000 DOFs on in an order by nested dissection, by METIS if the package
    pymetis is installed. From 20 000 DOFs on PARDISO (package pypardiso) factors real symmetric matrices, which a
    reduction needs, or MUMPS (package python-mumps) factors symmetric ones, if they are installed.
    `ReceptanceInfo.solver` names library and order.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.receptance([0.0], [[2.0]], [[1.0]], loss_factor=1.0).tolist()
    [[[(0.25-0.25j)]]]
    >>> beam = jf.beam(0.3, 40, youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006)
    >>> h, info = jf.receptance([50.0], beam.stiffness, beam.mass, outputs=[0], inputs=[0], full_output=True)
    >>> info.method, info.reason
    ('banded', 'narrow band: 3 diagonals below and 3 above the main one')
    """
    check_choice("method", method, get_args(ReceptanceMethod))
    freq = as_frequency(freq_hz)
    matrices = ModelMatrices(stiffness, mass, damping, structural_damping, as_number("loss_factor", loss_factor))
    n = matrices.n
    to = as_ports("outputs", outputs, n)
    into = to if inputs is outputs else as_ports("inputs", inputs, n)
    task = _Task(freq, matrices, to, into, on_singular, as_positive("tolerance", tolerance), out)
    if method in ("dense", "banded", "sparse"):
        result, made = _solved(task, cast(Direct, method), "as requested")
    elif method == "modal":
        modes, _ = all_modes(matrices, to, into)
        result = modes.receptance(freq, on_singular, out)
        made = ReceptanceInfo(method="modal", reason="as requested", n_vectors=modes.stiffness.size)
    elif method == "krylov":
        result, made = _reduced(task, "as requested")
        if made.method != "krylov" and not task.is_empty:
            warnings.warn(f"receptance: {made.reason}", ConvergenceWarning, stacklevel=2)
    else:
        result, made = _automatic(task)
    return (result, made) if full_output else result


def _direct(matrices: ModelMatrices) -> Direct:
    """Return the best direct method for every line of a model."""
    if matrices.n <= _TINY:
        return "dense"
    n, widths = matrices.n, matrices.widths
    if max(widths) < _NARROW and sum(widths) < _BAND_LIMIT * n:
        return "banded"
    if n > _ALL_MODES and sum(matrices.sparse(name).nnz for name in ("stiffness", "mass")) < _SPARSE * n**2:
        return "sparse"
    return "banded" if sum(widths) < _BAND_LIMIT * n else "dense"


def _automatic(task: _Task) -> tuple[ComplexArray, ReceptanceInfo]:
    """Return the receptance by a method chosen by size, band, damping and number of lines."""
    matrices, n = task.matrices, task.matrices.n
    if n <= _TINY:
        return _solved(task, "dense", f"small model: {n} DOFs")
    kl, ku = matrices.widths
    direct = _direct(matrices)
    if direct == "banded" and max(kl, ku) < _NARROW:
        return _solved(task, direct, f"narrow band: {kl} diagonals below and {ku} above the main one")
    if n <= _SMALL:
        return _solved(task, "dense", f"small model: {n} DOFs")
    if task.freq_hz.size < _MANY_LINES:
        return _solved(task, direct, f"few lines: {task.freq_hz.size}")
    if matrices.proportional is None:
        return _solved(task, direct, "damping couples the modes")
    if not matrices.have_real_modes:
        return _solved(task, direct, "stiffness or mass is not symmetric")
    if n <= _ALL_MODES:
        return _summed(task, f"{task.freq_hz.size} lines of {n} DOFs whose modes the damping does not couple")
    n_ports = directions(task.outputs, task.inputs).shape[1]
    if n_ports > _FEW_DOFS:
        return _solved(task, direct, f"many DOFs are requested: {n_ports}")
    return _reduced(task, f"{task.freq_hz.size} lines of {n} DOFs whose modes the damping does not couple")


def _solved(task: _Task, how: Direct, reason: str) -> tuple[ComplexArray, ReceptanceInfo]:
    """Return a direct solution."""
    freq, to, into = task.freq_hz, task.outputs, task.inputs
    solver, weighted = None, to.picked is None or into.picked is None
    if how == "sparse":
        result, status, solver = _solve_sparse(task)
    elif to.picked is not None and into.picked is not None:
        result, status = _solve_stored(task, to.picked, into.picked, how, task.out)
    else:
        result, status = _solve_stored(task, to.needed, into.needed, how)
    if status.lowest_rcond < RCOND_LIMIT:
        status = _checked_status(task.matrices, freq, status)
        result[status.line_info > 0] = np.nan
        check_lines("receptance", status, {}, freq, task.on_singular, RCOND_LIMIT)
    if how != "sparse" and weighted:
        t_out, t_in = (ports.weights[:, ports.needed - 1].toarray() for ports in (to, into))
        result = transform(result, t_out, t_in, freq_hz=freq, on_singular=task.on_singular, out=task.out)
    return result, ReceptanceInfo(method=how, reason=reason, solver=solver)


def _solve_stored(
    task: _Task, outputs: NDArray[np.int32], inputs: NDArray[np.int32], how: Direct, out: ComplexArray | None = None
) -> tuple[ComplexArray, LineStatus]:
    """Solve full matrices by zgesv, or bands by zgbsv or an elimination of many lines side by side.

    DOFs count from 1. The status has the reciprocal condition of each line; ill-conditioned lines give no warning yet.
    """
    matrices, omega = task.matrices, 2 * np.pi * task.freq_hz
    n, shape = matrices.n, (omega.size, outputs.size, inputs.size)
    kl, ku = matrices.widths if how == "banded" else (0, 0)

    def stored(name: str) -> FloatArray | None:
        """Return a matrix, or its band as LAPACK stores it, transposed: row j contains column j."""
        if how == "dense" or matrices.named[name] is None:
            return matrices.dense(name)
        entries = sparse.coo_array(matrices.named[name])
        band = np.zeros((n, kl + ku + 1))
        np.add.at(band, (entries.col, ku + entries.row - entries.col), as_real(name, entries.data, (None,)))
        return band

    width = n if how == "dense" else kl + ku + 1
    args: list[Any] = [n, N_FREQ] if how == "dense" else [n, kl, ku, N_FREQ]
    args += [*shape[1:], omega, stored("stiffness"), stored("mass")]
    for name in ("damping", "structural_damping"):
        matrix = stored(name)
        args += [0, np.zeros((1, width))] if matrix is None else [n, matrix]
    args += [matrices.loss_factor, outputs, inputs]
    routine = "receptance" if how == "dense" else "receptance_banded"
    result, line_info, rcond = run(routine, args, shape, {"omega": omega}, task.freq_hz, task.on_singular, 0.0, out)
    return result, LineStatus(line_info, rcond)


def _solve_sparse(task: _Task) -> tuple[ComplexArray, LineStatus, str]:
    """Solve by a sparse factorisation of every line; the library and the order of elimination come last."""
    freq_hz, matrices, outputs = task.freq_hz, task.matrices, task.outputs
    shape = (freq_hz.size, len(outputs), len(task.inputs))
    result = np.empty(shape, np.complex128) if task.out is None else checked_out(task.out, shape, (), {})
    solver, is_symmetric = SparseSolver(), matrices.are_symmetric
    status = LineStatus(np.zeros(freq_hz.size, np.int32), np.ones(freq_hz.size))
    forces = task.inputs.forces().astype(np.complex128)
    for i, omega in enumerate(2 * np.pi * freq_hz):
        z = matrices.dynamic_stiffness(omega)
        try:
            factors = solver.factor(z, is_symmetric)
        except SingularMatrixError:
            result[i], status.line_info[i], status.rcond[i] = np.nan, 1, 0
            continue
        result[i] = outputs.of(factors.solve(forces))
        status.rcond[i] = _reciprocal_condition(z, factors)
        if not np.isfinite(result[i]).all():
            result[i], status.line_info[i], status.rcond[i] = np.nan, -2, 0
    check_lines("receptance", status, {}, freq_hz, task.on_singular)
    return result, status, solver.used


def _reciprocal_condition(z: sparse.csc_matrix, factors: Factors) -> float:
    """Estimate 1 / (||Z|| ||Z^-1||) in the 1-norm by a few solutions."""

    def adjoint(b: ComplexArray) -> ComplexArray:
        return factors.solve(b, "H")

    inverse = sparse_linalg.LinearOperator(
        z.shape, matvec=factors.solve, rmatvec=adjoint, matmat=factors.solve, rmatmat=adjoint, dtype=np.complex128
    )
    size = float(sparse_linalg.onenormest(inverse, t=1) * abs(z).sum(axis=0).max())
    return 1 / size if size > 0 else 0.0


def _checked_status(matrices: ModelMatrices, freq: FloatArray, status: LineStatus) -> LineStatus:
    """Return the status of lines: singular if the structure is free, or with an unreliable condition.

    Rounding decides whether elimination of a singular matrix meets a zero; rigid motions without stiffness show it. A
    fine mesh in mixed units has rcond 1e-13 and still gives nine digits: such a line is unreliable if it is singular
    to working precision, or if rounding of K hides the stiffness against rigid-body motion.
    """
    rcond, info = np.where(status.rcond < SINGULAR, status.rcond, 1.0), status.line_info.copy()
    poor = status.rcond < RCOND_LIMIT
    if poor.any() and matrices.have_real_modes:
        rigid = find_rigid_modes(matrices.operand("stiffness"), matrices.operand("mass"))
        left = rigid.dynamic_stiffness(matrices, 2 * np.pi * freq[poor])
        info[poor] = np.where((info[poor] == 0) & (left == 0).any(axis=1), 1, info[poor])
        rcond[poor] = np.minimum(rcond[poor], mode_condition(left, rigid.uncertainty))
    return LineStatus(info, rcond)


def _fallen_back(task: _Task, error: float, n_vectors: int, what: str) -> tuple[ComplexArray, ReceptanceInfo]:
    """Return a direct solution after a sum of modes that was not accurate enough."""
    reason = (
        f"{what} of {n_vectors} vectors has the error estimate {error:.1e}, above the tolerance {task.tolerance:.1e}"
    )
    return _solved(task, _direct(task.matrices), reason)


def _summed(task: _Task, reason: str) -> tuple[ComplexArray, ReceptanceInfo]:
    """Return the sum of all modes if it meets the tolerance."""
    try:
        modes, rigid = all_modes(task.matrices, task.outputs, task.inputs)
    except ValueError as cause:
        return _solved(task, _direct(task.matrices), str(cause).split(":")[0])
    order = np.argsort(task.freq_hz)
    lines = order[np.linspace(0, order.size - 1, _SPOTS).astype(int)]
    spots = np.unique(task.freq_hz[lines])
    error, attainable = spot_error(spots, task.matrices, modes, task.outputs, task.inputs, rigid)
    return _finished(task, modes, (error, spots), attainable, "modal", reason)


def _reduced(task: _Task, reason: str) -> tuple[ComplexArray, ReceptanceInfo]:
    """Return the solution by a reduced model if it meets the tolerance."""
    if task.is_empty:
        return _solved(task, _direct(task.matrices), "no lines, or no DOFs with a weight")
    found = reduce_model(task.freq_hz, task.matrices, task.outputs, task.inputs, task.tolerance)
    result, made = _finished(
        task, found.modes, (found.error_estimate, found.checked_hz), found.attainable, "krylov", reason
    )
    return result, made._replace(solver=found.solver) if made.method == "krylov" else made


def _finished(
    task: _Task,
    modes: Modes,
    found: tuple[float, FloatArray],
    attainable: float,
    method: Literal["modal", "krylov"],
    reason: str,
) -> tuple[ComplexArray, ReceptanceInfo]:
    """Return a sum of modes, or a direct solution if its error at some lines is too large."""
    n_vectors, (error, checked_hz) = modes.stiffness.size, found
    if not error <= max(task.tolerance, attainable):
        return _fallen_back(task, error, n_vectors, "a sum of modes" if method == "modal" else "a reduced model")
    result = modes.receptance(task.freq_hz, task.on_singular, task.out)
    return result, ReceptanceInfo(
        method=method,
        reason=reason,
        error_estimate=error,
        checked_hz=tuple(checked_hz.tolist()),
        tolerance=task.tolerance,
        n_vectors=n_vectors,
    )
