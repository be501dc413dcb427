"""Joints from many sets of FRFs of one structure: repeated measurements, realisations of noise."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.frf.noise_model import NoiseModel
from jointfrf.identification.describe import describe_springs
from jointfrf.identification.manifold.coordinates import CrossTerms, DampingTerms
from jointfrf.identification.manifold.estimate import GroupStart, JointEstimate
from jointfrf.identification.manifold.fit import estimated_joint, fit_springs, uncertainty_of
from jointfrf.identification.manifold.prepare import (
    FitOptions,
    FitProblem,
    as_equal_points,
    prepare_compliance,
)
from jointfrf.identification.manifold.uncertainty import joint_intervals
from jointfrf.identification.noise import NoiseOptions
from jointfrf.identification.prepare import BandsOfDofs, as_measured
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import ComplexArray, FloatArray, check_type

__all__ = ["FitStart", "identify_realisations", "viscous_estimate", "viscous_joints"]


class FitStart(NamedTuple):
    """Where searches begin: what an earlier fit to FRFs of the same structure has found.

    Attributes
    ----------
    estimate : JointEstimate
        The joint, and the FRFs that fit it.
    noise : NoiseModel or None
        With the poles of the smooth FRFs.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 200)
    >>> h = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)[:, 1:, 1:]
    >>> gamma = jf.couple(h, h, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [0], [0])
    >>> drawn = jf.realisations(gamma, 0.02, count=3)
    >>> start = jf.FitStart.of(freq, drawn[0], ["x"])
    >>> alone, *_ = jf.identify_realisations(freq, drawn[2:], ["x"], start=start)
    >>> *_, last = jf.identify_realisations(freq, drawn, ["x"], start=start)
    >>> alone.stiffness == last.stiffness
    array([ True])
    """

    estimate: JointEstimate
    noise: NoiseModel | None

    @classmethod
    def of(
        cls,
        freq_hz: ArrayLike,
        gamma: ArrayLike,
        dofs: Sequence[str] | None = None,
        *,
        damping: DampingTerms | Literal["auto"] | Sequence[DampingTerms] = "auto",
        cross: CrossTerms = "zero",
    ) -> FitStart:
        """Fit one set of FRFs.

        Parameters
        ----------
        freq_hz, dofs, damping, cross
            As in `identify_realisations`.
        gamma : array_like, shape (n_freq, 2 n, 2 n)
            Receptances of the same structure, m/N.

        Returns
        -------
        FitStart

        Raises
        ------
        ValueError
            As `identify`.
        """
        options = FitOptions(damping, cross, reciprocal=True)
        measured = as_measured(freq_hz, gamma, square=False)
        problem = prepare_compliance(measured, dofs, None, None, NoiseOptions(None), options)
        return cls(fit_springs(problem).estimate, problem.noise.model)


def identify_realisations(
    freq_hz: ArrayLike,
    gammas: Iterable[ArrayLike],
    dofs: Sequence[str] | None = None,
    bands: BandsOfDofs = None,
    *,
    transform: ArrayLike | tuple[ArrayLike, ArrayLike] | None = None,
    damping: DampingTerms | Literal["auto"] | Sequence[DampingTerms] = "auto",
    cross: CrossTerms = "zero",
    same: Sequence[str] | Sequence[Sequence[str]] | None = None,
    noise: float | ArrayLike | None = None,
    reciprocal: bool = True,
    start: FitStart | None = None,
) -> Iterator[Fit]:
    """Identify a joint from each of several sets of FRFs of the same structure.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Hz.
    gammas : iterable of array_like, shape (n_freq, m_r, m_f)
        Measured receptances, m/N, as `identify` takes them: realisations of noise, repeated measurements.
    dofs, bands, transform, damping, cross, same, noise, reciprocal
        As in `identify` with the method "compliance".
    start : FitStart, optional
        Where the searches begin, in place of the first set: then a result depends on its own set only, whatever others
        are in the same call.

    Yields
    ------
    Fit
        One for each set, as it is asked for. Warnings are in its `warnings` and are not issued; the FRFs are not looked
        at as `check_frfs` does.

    Raises
    ------
    ValueError
        As `identify`.

    Notes
    -----
    Each fit stands for itself, by its own noise. What makes a set faster than `identify`: the search for poles of the
    smooth FRFs, for the noise and for the joint begins at those of the first set, and ends at once where the set is
    alike.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    >>> b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    >>> gamma = jf.couple(a, b, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [1], [0])[:, 1:3, 1:3]
    >>> drawn = jf.realisations(gamma, 0.05, seed=2, count=20)
    >>> k = [fit.stiffness[0] for fit in jf.identify_realisations(freq, drawn, ["x"], damping="viscous")]
    >>> bool(abs(np.mean(k) / 2000 - 1) < 0.005), bool(np.std(k) / 2000 < 0.01)
    (True, True)
    """
    options = FitOptions(damping, cross, reciprocal, as_equal_points(same))
    known = NoiseOptions(noise)
    near: tuple[GroupStart, ...] | None = None
    if start is not None:
        check_type("start", start, FitStart)
        near, known = start.estimate.starts, replace(known, like=start.noise)
    if not isinstance(gammas, Iterable):
        raise TypeError(f"gammas must be a list of sets of FRFs, not {type(gammas).__name__}")
    for gamma in gammas:
        measured = as_measured(freq_hz, gamma, square=False)
        problem = replace(prepare_compliance(measured, dofs, bands, transform, known, options), near=near or ())
        found = fit_springs(problem)
        if near is None:
            near, known = found.estimate.starts, replace(known, like=problem.noise.like)
        yield describe_springs(found, problem)


def viscous_joints(
    freq_hz: FloatArray, gammas: Iterable[ComplexArray], dofs: Sequence[str], start: FitStart | None = None
) -> FloatArray:
    """Return stiffness and viscous damping of several sets as `identify_realisations` gives them, and nothing else.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    gammas : iterable of ndarray, shape (n_freq, 2 n, 2 n)
        Measured receptances of the same structure, m/N.
    dofs : sequence of str
        Names of the n joint DOFs.
    start : FitStart, optional

    Returns
    -------
    ndarray, shape (r, 2 n)
        Stiffness of all DOFs, then damping.

    Raises
    ------
    ValueError
        As `identify`.
    """
    values = []
    for gamma in gammas:
        problem = _viscous_problem(freq_hz, gamma, dofs, start)
        _, found, _ = estimated_joint(problem)
        if start is None:
            start = FitStart(found, problem.noise.model)
        values.append(found.theta)
    return np.array(values)


def viscous_estimate(
    freq_hz: FloatArray, gamma: ComplexArray, dofs: Sequence[str], start: FitStart | None
) -> tuple[FloatArray, FloatArray]:
    """Return stiffness and viscous damping of one set as `identify_realisations` gives them, without looking further.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    gamma : ndarray, shape (n_freq, 2 n, 2 n)
        Measured receptances, m/N.
    dofs : sequence of str
        Names of the n joint DOFs.
    start : FitStart, optional

    Returns
    -------
    values : ndarray, shape (2 n,)
        Stiffness of all DOFs, then damping.
    intervals : ndarray, shape (2, 2 n)
        Limits of the intervals of 95 %.

    Raises
    ------
    ValueError
        As `identify`.
    """
    problem, found, _ = estimated_joint(_viscous_problem(freq_hz, gamma, dofs, start))
    return found.theta, np.array(
        list(joint_intervals(found, uncertainty_of(problem, found)[0].factor)(0.95).values())
    ).T


def _viscous_problem(
    freq_hz: FloatArray, gamma: ComplexArray, dofs: Sequence[str], start: FitStart | None
) -> FitProblem:
    """Return the fit of springs and dashpots without cross terms, begun at `start`: other noise on the same FRFs."""
    noise = NoiseOptions(None, like=None if start is None else start.noise)
    options = FitOptions("viscous", "zero", reciprocal=True)
    measured = as_measured(freq_hz, gamma, square=False)
    problem = prepare_compliance(measured, dofs, None, None, noise, options, is_checked=start is not None)
    return problem if start is None else replace(problem, near=start.estimate.starts)
