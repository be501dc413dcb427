"""Everything a case yields: exact FRFs, natural frequencies, sensitivities, identified parameters, regenerated FRFs."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from jointfrf._sweep import ComplexArray, FloatArray
from jointfrf.bands import Band, Sensitivity, propose_bands, sensitivity
from jointfrf.case_file import Case
from jointfrf.decoupling import Equation, decouple
from jointfrf.ismm import inverse_substructuring, ismm
from jointfrf.joint import Joint
from jointfrf.metrics import amplitude_error, frequency_error
from jointfrf.model import Model, assemble
from jointfrf.study import Exact, Identified, exact_frfs, regenerate, run_study

__all__ = ["CaseResult", "Modes", "Regenerated", "compute", "find_modes", "noise_free_errors"]

#: Realisations whose FRFs are regenerated.
_REGENERATED = 200
#: Modes below this share of the highest one sought are rigid-body motions: round-off of a fine mesh gives them some.
_RIGID = 1e-3


@dataclass(frozen=True)
class Modes:
    """Undamped modes without rigid-body motions: frequencies (n,) in Hz, shapes (n_dofs, n), names of the DOFs."""

    freq_hz: FloatArray
    shapes: FloatArray
    dofs: tuple[str, ...]


@dataclass(frozen=True)
class Regenerated:
    """FRFs of the assembly with identified parameters, at a point.

    Attributes
    ----------
    identified : Identified
    point : str
        "r" or "s".
    percentiles : ndarray, shape (3, n_freq)
        2.5, 50 and 97.5 percentile of the modulus, m/N.
    first : ndarray, shape (n_freq,)
        That of the first realisation.
    amplitude, frequency : ndarray, shape (n_realisations,)
        Errors (4.11) and (4.12), percent.
    """

    identified: Identified
    point: str
    percentiles: FloatArray
    first: ComplexArray
    amplitude: FloatArray
    frequency: FloatArray


@dataclass(frozen=True)
class CaseResult:
    """Results of a case.

    Attributes
    ----------
    case : Case
    exact : Exact
    n_realisations : int
    modes : dict
        ``"actual"`` and ``"initial"`` joint to Modes.
    sensitivities : dict
        Point "r" or "s" to Sensitivity.
    proposals : dict
        (point, parameter) to bands, Hz.
    identified : list of Identified
    regenerated : list of Regenerated
    noise_free : dict
        Method to largest relative error without noise.
    """

    case: Case
    exact: Exact
    n_realisations: int
    modes: dict[str, Modes]
    sensitivities: dict[str, Sensitivity]
    proposals: dict[tuple[str, str], list[Band]]
    identified: list[Identified]
    regenerated: list[Regenerated]
    noise_free: dict[str, float]


def find_modes(model: Model, count: int) -> Modes:
    """Lowest undamped modes, rigid-body motions left out."""
    freq, shapes = model.modes(min(count + 3, len(model.dofs)))
    kept = np.flatnonzero(freq > _RIGID * freq.max(initial=0))[:count]
    return Modes(freq[kept], shapes[:, kept], model.dofs)


def noise_free_errors(exact: Exact, k_actual: ComplexArray) -> dict[str, float]:
    """Largest relative error of K* of every method without noise.

    "short form" is the difference between (2.47) and -(gamma^-1)_jk; the others are errors against the actual K*.
    """
    n = exact.n
    joint, inner = list(range(n)), list(range(n, 2 * n))
    gamma = exact.interface(exact.h_c)
    found = {
        "ismm": ismm(exact.interface(exact.h_initial), gamma, exact.k_initial),
        "inverse_substructuring": inverse_substructuring(gamma),
    }
    equations: tuple[Equation, ...] = ("rr", "rs", "sr", "ss")
    for equation in equations:
        h_c = np.ascontiguousarray(exact.h_c[:, exact.where(equation[0]), exact.where(equation[1])])
        found[f"decoupling-{equation}"] = decouple(equation, exact.h_a, exact.h_b, h_c, joint, joint, inner, inner)
    size = np.sqrt(abs(np.diagonal(k_actual, axis1=1, axis2=2)))
    scale = size[:, :, None] * size[:, None, :]

    def difference(a: ComplexArray, b: ComplexArray) -> float:
        return float((abs(a - b) / scale).max())

    errors = {method: difference(k, k_actual) for method, k in found.items()}
    return {"short form": difference(found["ismm"], found["inverse_substructuring"]), **errors}


def _sensitivity(case: Case, exact: Exact, joint: Joint, point: str) -> Sensitivity:
    at = exact.where(point).start
    j, k = (list(range(exact.where(p).start, exact.where(p).stop)) for p in "jk")
    return sensitivity(case.freq_hz, exact.h_c, joint, j, k, at, at)


def _regenerated(exact: Exact, identified: Identified, point: str) -> Regenerated:
    at = exact.where(point).start
    h = regenerate(exact, identified.theta[:_REGENERATED], point)
    h_exact = exact.h_c[:, at, at]
    amplitude, frequency = (
        np.array([error(h_exact, one, exact.freq_hz) for one in h]) for error in (amplitude_error, frequency_error)
    )
    return Regenerated(identified, point, np.percentile(abs(h), [2.5, 50, 97.5], axis=0), h[0], amplitude, frequency)


def compute(
    case: Case,
    n_realisations: int | None = None,
    pool: Executor | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> CaseResult:
    """Run a case.

    Parameters
    ----------
    case : Case
    n_realisations : int, optional
        Instead of the number that the case names.
    pool, progress
        As in `jointfrf.study.run_study`.

    Returns
    -------
    CaseResult
    """
    count = case.realisations if n_realisations is None else n_realisations
    exact = exact_frfs(case)
    modes = {}
    for which, joint in (("initial", case.initial), ("actual", case.joint)):
        model = assemble(case.a.model, case.b.model, joint, case.dofs_j, case.dofs_k)
        modes[which] = find_modes(model, 5)
    sensitivities = {point: _sensitivity(case, exact, case.joint, point) for point in "rs"}
    proposals = {
        (point, parameter): propose_bands(case.freq_hz, change)
        for point, found in sensitivities.items()
        for parameter, change in zip(found.parameters, found.change, strict=True)
    }
    identified = run_study(case, exact, count, pool, progress)
    # Without the lines, which are large and not needed there.
    slim = [replace(found, k_lines=found.k_lines[:0]) for found in identified for _ in "rs"]
    regenerated = list((map if pool is None else pool.map)(partial(_regenerated, exact), slim, "rs" * len(identified)))
    errors = noise_free_errors(exact, case.joint.dynamic_stiffness(case.freq_hz))
    return CaseResult(case, exact, count, modes, sensitivities, proposals, identified, regenerated, errors)
