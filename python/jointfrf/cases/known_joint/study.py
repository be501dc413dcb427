"""Monte Carlo study of an identification: many realisations of the noise, several methods."""

from __future__ import annotations

import os
import signal
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from jointfrf.cases.known_joint.read import BandSet, Case, Noise
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import band_mean
from jointfrf.frf.noise import realisations
from jointfrf.identification.compliance_fit.estimator import estimate, joint_basis
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.substructuring.coupling import couple
from jointfrf.substructuring.decoupling import Equation, decouple
from jointfrf.substructuring.ismm import inverse_substructuring, ismm

__all__ = ["Exact", "Identified", "exact_frfs", "regenerate", "run_study", "workers"]

#: Lines, and entries of their FRF matrices, treated at once, over realisations: bound the memory to some tens of MB.
_CHUNK, _CHUNK_ENTRIES = 20_000, 1_500_000
#: Realisations whose K*(w) is kept line by line, for figures.
_KEPT = 200
_ALL_LINES = "all lines"
#: Standard errors by which a fitted parameter may still move: far less than realisations differ.
_TOLERANCE = 0.5
_POINTS = "jrks"
_EQUATIONS: tuple[Equation, ...] = ("rr", "rs", "sr", "ss")


@dataclass(frozen=True)
class Exact:
    """Noise-free FRFs of a case; DOFs in the order j, r of A, then k, s of B, n of each.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    dofs : tuple of str
        Names of the n joint DOFs.
    h_a, h_b : ndarray, shape (n_freq, 2 n, 2 n)
        Receptances of the substructures, m/N.
    h_initial, h_c : ndarray, shape (n_freq, 4 n, 4 n)
        Receptances of the assembly with the first estimate and with the actual joint.
    k_initial : ndarray, shape (n_freq, n, n)
        First estimate of K*, N/m.
    """

    freq_hz: FloatArray
    dofs: tuple[str, ...]
    h_a: ComplexArray
    h_b: ComplexArray
    h_initial: ComplexArray
    h_c: ComplexArray
    k_initial: ComplexArray

    @property
    def n(self) -> int:
        """Number of joint DOFs."""
        return len(self.dofs)

    def where(self, point: str) -> slice:
        """Return the DOFs of a point of the assembly: "j", "r", "k" or "s"."""
        start = _POINTS.index(point) * self.n
        return slice(start, start + self.n)

    def interface(self, h: ComplexArray) -> ComplexArray:
        """Return the FRFs at the joint, DOFs j then k, shape (n_freq, 2 n, 2 n)."""
        at = np.r_[self.where("j"), self.where("k")]
        return np.ascontiguousarray(h[:, at[:, None], at])


@dataclass(frozen=True)
class Identified:
    """What one method finds at one noise level, with one set of bands.

    Attributes
    ----------
    noise, method, bands : str
        Names.
    theta : ndarray, shape (n_realisations, n_parameters)
        Parameters: stiffness of all DOFs, then damping.
    k_lines : ndarray, shape (n_kept, n_freq, n)
        Diagonal of K* line by line for the first realisations; empty for a fit over all lines.
    """

    noise: str
    method: str
    bands: str
    theta: FloatArray
    k_lines: ComplexArray


def exact_frfs(case: Case) -> Exact:
    """Receptances of the substructures (2.28)-(2.29) and of the assembly (2.26)."""
    freq, n = case.freq_hz, len(case.joint.dofs)
    h_a = case.a.model.receptance(freq, case.ports_a)
    h_b = case.b.model.receptance(freq, case.ports_b)
    first = list(range(n))
    initial = case.initial.dynamic_stiffness(freq)
    h_initial = couple(h_a, h_b, initial, first, first, freq_hz=freq)
    h_c = couple(h_a, h_b, case.joint.dynamic_stiffness(freq), first, first, freq_hz=freq)
    return Exact(freq, case.joint.dofs, h_a, h_b, h_initial, h_c, initial)


@dataclass(frozen=True)
class _Task:
    """One method on some realisations of one noise."""

    exact: Exact
    noise: Noise
    method: str
    band_sets: tuple[BandSet, ...]
    seed: int
    first: int
    count: int


def _polluted(task: _Task, h: ComplexArray, seed: int) -> ComplexArray:
    noise = task.noise
    return realisations(
        h, noise.level, noise.kind, seed, relative_to=noise.relative_to, reciprocal=noise.reciprocal,
        block=noise.block, first=task.first, count=task.count,
    )  # fmt: skip


def _run_task(task: _Task) -> tuple[FloatArray, ComplexArray]:
    """Return the parameters, shape (n_band_sets, count, p), and the lines kept, shape (n_kept, n_freq, n)."""
    with warnings.catch_warnings():
        # Noise makes any line ill-conditioned now and then.
        warnings.simplefilter("ignore", IllConditionedWarning)
        if task.method == "compliance":
            return _fit(task)
        k_joint = _joint_lines(task)
    exact = task.exact
    theta = np.array(
        [
            [np.concatenate(_band_means(exact, k, band_set)) for k in k_joint]
            for band_set in task.band_sets
        ]
    )  # fmt: skip
    kept = max(0, min(task.count, _KEPT - task.first))
    return theta, np.ascontiguousarray(np.diagonal(k_joint[:kept], axis1=2, axis2=3))


def _fit(task: _Task) -> tuple[FloatArray, ComplexArray]:
    exact = task.exact
    basis = joint_basis(2 * np.pi * exact.freq_hz, exact.dofs, "viscous", "zero")
    gamma = _polluted(task, exact.interface(exact.h_c), task.seed)
    # One realisation at a time: a slow one does not hold up others, and all stays in the processor's cache.
    fits = [estimate(one[None], np.eye(2 * exact.n), basis, tolerance=_TOLERANCE).theta for one in gamma]
    return np.concatenate(fits)[None], np.empty((0, exact.freq_hz.size, exact.n), np.complex128)


def _joint_lines(task: _Task) -> ComplexArray:
    """K* of every realisation and line, shape (count, n_freq, n, n)."""
    exact, n, lines = task.exact, task.exact.n, task.count * task.exact.freq_hz.size

    def flat(h: ComplexArray) -> ComplexArray:
        return h.reshape(lines, *h.shape[2:])

    def repeated(h: ComplexArray) -> ComplexArray:
        return np.tile(h, (task.count, 1, 1))

    if task.method.startswith("decoupling"):
        equation = next(e for e in _EQUATIONS if task.method == f"decoupling-{e}")
        h_c = np.ascontiguousarray(exact.h_c[:, exact.where(equation[0]), exact.where(equation[1])])
        # Noise of its own: another block of the assembly's FRFs.
        seed = task.seed + 1 + _EQUATIONS.index(equation)
        joint, inner = list(range(n)), list(range(n, 2 * n))
        found = decouple(
            equation, repeated(exact.h_a), repeated(exact.h_b), flat(_polluted(task, h_c, seed)), joint, joint,
            inner, inner, on_singular="nan",
        )  # fmt: skip
    else:
        gamma = flat(_polluted(task, exact.interface(exact.h_c), task.seed))
        if task.method == "ismm":
            alpha = exact.interface(exact.h_initial)
            found = ismm(repeated(alpha), gamma, repeated(exact.k_initial), on_singular="nan")
        else:
            found = inverse_substructuring(gamma, on_singular="nan")
    return found.reshape(task.count, -1, n, n)


def _band_means(exact: Exact, k_joint: ComplexArray, band_set: BandSet) -> tuple[FloatArray, FloatArray]:
    """Mean of Re K* and Im K*/w, each parameter over its own bands."""
    means = [
        band_mean(exact.freq_hz, k_joint, {dof: band_set.bands[f"{letter}_{dof}"] for dof in exact.dofs}, exact.dofs)
        for letter in "kc"
    ]
    return means[0].stiffness, means[1].damping


@contextmanager
def workers(jobs: int) -> Iterator[Executor | None]:
    """Provide processes that treat chunks of realisations side by side; None for one job.

    Each process computes on one thread: two pools of threads on the same cores slow each other down.
    """
    if jobs <= 1:
        yield None
        return
    single = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    before = {name: os.environ.get(name) for name in single}
    os.environ.update(single)
    try:
        # An interrupt goes to the process that waits for the others.
        ignore = (signal.SIGINT, signal.SIG_IGN)
        pool = ProcessPoolExecutor(jobs, get_context("spawn"), initializer=signal.signal, initargs=ignore)
        try:
            yield pool
        finally:
            pool.shutdown(cancel_futures=True)
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def run_study(
    case: Case,
    exact: Exact,
    n_realisations: int,
    pool: Executor | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Identified]:
    """Identify the joint of a case from many realisations of every noise by every method.

    Parameters
    ----------
    case : Case
    exact : Exact
        Its noise-free FRFs.
    n_realisations : int
    pool : Executor, optional
        Where chunks are computed, see `workers`.
    progress : callable
        Called with the numbers of chunks done and in all.

    Returns
    -------
    list of Identified
        One for each noise, method and set of bands ("all lines" for the compliance fit). A realisation depends on the
        seed and its own number only: neither on `pool` nor on how many there are.
    """
    groups = [(noise, method) for noise in case.noises for method in noise.methods]
    size = max(1, min(_CHUNK, _CHUNK_ENTRIES // (2 * exact.n) ** 2) // case.freq_hz.size)
    chunks = [(first, min(size, n_realisations - first)) for first in range(0, n_realisations, size)]
    tasks = [
        _Task(exact, noise, method, case.band_sets, case.seed, first, count)
        for noise, method in groups
        for first, count in chunks
    ]
    parts = []
    for part in map(_run_task, tasks) if pool is None else pool.map(_run_task, tasks):
        parts.append(part)
        progress(len(parts), len(tasks))
    found = []
    for i, (noise, method) in enumerate(groups):
        own = parts[i * len(chunks) : (i + 1) * len(chunks)]
        theta = np.concatenate([part[0] for part in own], axis=1)
        k_lines = np.concatenate([part[1] for part in own])
        names = [_ALL_LINES] if method == "compliance" else [band_set.name for band_set in case.band_sets]
        found += [Identified(noise.name, method, name, theta[b], k_lines) for b, name in enumerate(names)]
    return found


def regenerate(exact: Exact, theta: FloatArray, point: str, dof: int = 0) -> ComplexArray:
    """Receptance of the assembly at a point, regenerated from identified parameters.

    Parameters
    ----------
    exact : Exact
    theta : ndarray, shape (r, 2 n)
        Stiffness of all DOFs, then damping.
    point : {"r", "s"}
    dof : int
        Response and force at this DOF of the point.

    Returns
    -------
    ndarray, shape (r, n_freq)
        m/N.
    """
    n, r, n_freq = exact.n, len(theta), exact.freq_hz.size
    omega = np.tile(2 * np.pi * exact.freq_hz, r)
    diagonal = np.repeat(theta[:, :n], n_freq, axis=0) + 1j * omega[:, None] * np.repeat(theta[:, n:], n_freq, axis=0)
    k_joint = diagonal[:, :, None] * np.eye(n)
    joint = list(range(n))
    of_a, of_b = ([*joint, n + dof], joint) if point == "r" else (joint, [*joint, n + dof])
    h_a, h_b = (
        np.tile(h[:, np.array(dofs)[:, None], dofs], (r, 1, 1))
        for h, dofs in ((exact.h_a, of_a), (exact.h_b, of_b))
    )  # fmt: skip
    at = n if point == "r" else 2 * n
    with warnings.catch_warnings():
        # Identified parameters may be absurd.
        warnings.simplefilter("ignore", IllConditionedWarning)
        h_c = couple(h_a, h_b, k_joint, joint, joint)
    return h_c[:, at, at].reshape(r, n_freq)
