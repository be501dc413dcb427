"""Everything a case yields: exact FRFs, natural frequencies, sensitivities, identified parameters, regenerated FRFs."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from jointfrf.cases.known_joint.read import Case, Observed
from jointfrf.cases.known_joint.study import Exact, Identified, exact_frfs, regenerate, run_study
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import Band
from jointfrf.frf.metrics import amplitude_error, frequency_error
from jointfrf.identification.sensitivity import Sensitivity, propose_bands, sensitivity
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.models.model import Model, assemble
from jointfrf.solids.solid import SolidModel
from jointfrf.substructuring.decoupling import Equation, decouple
from jointfrf.substructuring.ismm import inverse_substructuring, ismm

__all__ = ["CaseResult", "Modes", "NoiseFree", "Regenerated", "compute", "find_modes", "noise_free_errors"]

#: Realisations whose FRFs are regenerated.
_REGENERATED = 200
#: Modes shown, unless more are expected.
_MODES = 5
#: Modes below this share of the highest one sought are rigid-body motions: round-off of a fine mesh gives them some.
_RIGID = 1e-3


@dataclass(frozen=True)
class Modes:
    """Undamped modes without rigid-body motions.

    Attributes
    ----------
    freq_hz : ndarray, shape (n,)
        Hz.
    shapes : ndarray, shape (n_dofs, n)
    dofs : tuple of str
        Names of the DOFs.
    directions : tuple of str
        Where a solid moves most in each mode, "x", "y" or "z"; empty for other models.
    """

    freq_hz: FloatArray
    shapes: FloatArray
    dofs: tuple[str, ...]
    directions: tuple[str, ...] = ()


@dataclass(frozen=True)
class Regenerated:
    """An FRF of the assembly with identified parameters.

    Attributes
    ----------
    identified : Identified
    observed : Observed
        Which FRF.
    percentiles : ndarray, shape (3, n_freq)
        2.5, 50 and 97.5 percentile of the modulus, m/N.
    first : ndarray, shape (n_freq,)
        That of the first realisation.
    bands : tuple of (low, high) or None
        Where errors are counted, Hz; None for all lines.
    amplitude, frequency : ndarray, shape (n_bands, n_realisations)
        Errors (4.11) and (4.12), percent.
    """

    identified: Identified
    observed: Observed
    percentiles: FloatArray
    first: ComplexArray
    bands: tuple[Band | None, ...]
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
        Key of an observed FRF to Sensitivity.
    proposals : dict
        (key, parameter) to bands, Hz.
    identified : list of Identified
    regenerated : list of Regenerated
    noise_free : dict
        Method to NoiseFree.
    """

    case: Case
    exact: Exact
    n_realisations: int
    modes: dict[str, Modes]
    sensitivities: dict[str, Sensitivity]
    proposals: dict[tuple[str, str], list[Band]]
    identified: list[Identified]
    regenerated: list[Regenerated]
    noise_free: dict[str, NoiseFree]


def find_modes(model: Model, count: int) -> Modes:
    """Lowest undamped modes, rigid-body motions left out."""
    freq, shapes = model.modes(min(count + 3, len(model.dofs)))
    kept = np.flatnonzero(freq > _RIGID * freq.max(initial=0))[:count]
    return Modes(freq[kept], shapes[:, kept], model.dofs)


def _with_directions(modes: Modes, a: Model, b: Model) -> Modes:
    """Name the direction in which the reference points of solids move most: in torsion it is not that of the edges."""
    if not (isinstance(a, SolidModel) and isinstance(b, SolidModel)):
        return modes
    names = {*a.references, *b.references}
    at = [[i for i, dof in enumerate(modes.dofs) if dof[2:] in {f"{name}:{axis}" for name in names}] for axis in "xyz"]
    squares = [(modes.shapes[rows] ** 2).sum(axis=0) for rows in at]
    return replace(modes, directions=tuple("xyz"[i] for i in np.argmax(squares, axis=0)))


class NoiseFree(NamedTuple):
    """Largest relative error of K* without noise, and how much K* moves when the last bits of the FRFs do."""

    error: float
    rounding: float


def noise_free_errors(exact: Exact, k_actual: ComplexArray) -> dict[str, NoiseFree]:
    """Find the largest relative error of K* of every method without noise.

    "short form" is the difference between (2.47) and -(gamma^-1)_jk; the others are errors against the actual K*.
    """
    with warnings.catch_warnings():
        # What a poor condition does is what is shown.
        warnings.simplefilter("ignore", IllConditionedWarning)
        found, moved = _noise_free_lines(exact), _noise_free_lines(_rounded(exact))
    size = np.sqrt(abs(np.diagonal(k_actual, axis1=1, axis2=2)))
    scale = size[:, :, None] * size[:, None, :]

    def difference(a: ComplexArray, b: ComplexArray) -> float:
        return float((abs(a - b) / scale).max())

    rounding = {method: difference(k, moved[method]) for method, k in found.items()}
    errors = {method: NoiseFree(difference(k, k_actual), rounding[method]) for method, k in found.items()}
    short = NoiseFree(difference(found["ismm"], found["inverse-substructuring"]), rounding["ismm"])
    return {"short form": short, **errors}


def _rounded(exact: Exact) -> Exact:
    """Move every FRF by a rounding, up or down, always the same."""
    rng = np.random.default_rng(1)
    h_a, h_b, h_initial, h_c = (
        h * (1 + np.finfo(float).eps * rng.choice((-1.0, 1.0), h.shape))
        for h in (exact.h_a, exact.h_b, exact.h_initial, exact.h_c)
    )
    return replace(exact, h_a=h_a, h_b=h_b, h_initial=h_initial, h_c=h_c)


def _noise_free_lines(exact: Exact) -> dict[str, ComplexArray]:
    """K* on every line by every method."""
    n = exact.n
    joint, inner = list(range(n)), list(range(n, 2 * n))
    gamma = exact.interface(exact.h_c)
    found = {
        "ismm": ismm(exact.interface(exact.h_initial), gamma, exact.k_initial),
        "inverse-substructuring": inverse_substructuring(gamma),
    }
    equations: tuple[Equation, ...] = ("rr", "rs", "sr", "ss")
    for equation in equations:
        between = np.ascontiguousarray(exact.h_c[:, exact.where(equation[0]), exact.where(equation[1])])
        found[f"decoupling-{equation}"] = decouple(equation, exact.h_a, exact.h_b, between, joint, joint, inner, inner)
    return found


def _sensitivity(case: Case, exact: Exact, joint: Joint, observed: Observed) -> Sensitivity:
    at = exact.where(observed.point).start + observed.dof
    j, k = (list(range(exact.where(p).start, exact.where(p).stop)) for p in "jk")
    return sensitivity(case.freq_hz, exact.h_c, joint, j, k, at, at)


def _regenerated(exact: Exact, identified: Identified, observed: Observed) -> Regenerated:
    at = exact.where(observed.point).start + observed.dof
    h = regenerate(exact, identified.theta[:_REGENERATED], observed.point, observed.dof)
    h_exact = exact.h_c[:, at, at]
    bands = observed.bands or (None,)
    amplitude, frequency = (
        np.array([[error(h_exact, one, exact.freq_hz, band) for one in h] for band in bands], np.float64)
        for error in (amplitude_error, frequency_error)
    )
    percentiles: FloatArray = np.asarray(np.percentile(abs(h), [2.5, 50, 97.5], axis=0), np.float64)
    return Regenerated(identified, observed, percentiles, h[0], bands, amplitude, frequency)


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
        As in `jointfrf.cases.known_joint.study.run_study`.

    Returns
    -------
    CaseResult
    """
    count = case.realisations if n_realisations is None else n_realisations
    exact = exact_frfs(case)
    modes = {}
    for which, joint in (("initial", case.initial), ("actual", case.joint)):
        model = assemble(case.a.model, case.b.model, joint, case.dofs_j, case.dofs_k)
        wanted = max([_MODES, *(len(values) for _, _, values, _ in case.expected.frequencies)])
        modes[which] = _with_directions(find_modes(model, wanted), case.a.model, case.b.model)
    sensitivities = {one.key: _sensitivity(case, exact, case.joint, one) for one in case.observed}
    proposals = {
        (key, parameter): propose_bands(case.freq_hz, change)
        for key, found in sensitivities.items()
        for parameter, change in zip(found.parameters, found.change, strict=True)
    }
    identified = run_study(case, exact, count, pool, progress)
    # Without the lines, which are large and not needed there.
    slim = [replace(found, k_lines=found.k_lines[:0]) for found in identified for _ in case.observed]
    watched = case.observed * len(identified)
    regenerated = list((map if pool is None else pool.map)(partial(_regenerated, exact), slim, watched))
    errors = noise_free_errors(exact, case.joint.dynamic_stiffness(case.freq_hz))
    return CaseResult(case, exact, count, modes, sensitivities, proposals, identified, regenerated, errors)
