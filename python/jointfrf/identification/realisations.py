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
    """Initial values from an earlier fit to FRFs of the same structure.

    Attributes
    ----------
    estimate : JointEstimate
        Joint, and the FRFs that fit it.
    noise : NoiseModel or None
        Noise, with the poles of the smooth FRFs.

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
        """Fit one set of FRFs and return it as a start for further sets.

        Parameters
        ----------
        freq_hz : array_like, shape (n_freq,)
            Frequencies, Hz.
        gamma : array_like, shape (n_freq, 2 n, 2 n)
            Receptances of the same structure, m/N.
        dofs, damping, cross
            Options of the fit; see `identify_realisations`.

        Returns
        -------
        FitStart
            Estimate and noise.

        Raises
        ------
        ValueError
            An error of `identify`.
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
    """Identify a joint from each of several sets of FRFs of the same structure, and yield the fits.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz.
    gammas : iterable of array_like, shape (n_freq, m_r, m_f)
        Measured receptances, m/N, see `identify`: realisations of noise, repeated measurements.
    dofs, bands, transform, damping, cross, same, noise, reciprocal
        Options of the fit; see `identify`.
    start : FitStart, optional
        Initial values in place of the first set. A result then depends on its own set only, whatever sets are in the
        same call.

    Yields
    ------
    Fit
        Fit of one set. Warnings are in its `warnings` and are not issued; there is no data check (`check_frfs`).

    Raises
    ------
    ValueError
        An error of `identify`.

    See Also
    --------
    identify : fit of one set of FRFs, with a data check.
    realisations : polluted FRFs.
    monte_carlo : mean and covariance of line-by-line methods.

    Notes
    -----
    Each fit is independent and uses its own noise. It is faster than `identify` because the search for poles of the
    smooth FRFs, for the noise and for the joint starts at the result of the first set. The search ends at once if the
    sets are similar.

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
    """Return stiffness and viscous damping of several sets, without further results of `identify_realisations`.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    gammas : iterable of ndarray, shape (n_freq, 2 n, 2 n)
        Measured receptances of the same structure, m/N.
    dofs : sequence of str
        Names of the n joint DOFs.
    start : FitStart, optional
        Initial values in place of the first set.

    Returns
    -------
    ndarray, shape (r, 2 n)
        Stiffness of all DOFs, then damping.

    Raises
    ------
    ValueError
        An error of `identify`.
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
    """Return stiffness and viscous damping of one set with intervals, without further results of a fit.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    gamma : ndarray, shape (n_freq, 2 n, 2 n)
        Measured receptances, m/N.
    dofs : sequence of str
        Names of the n joint DOFs.
    start : FitStart, optional
        Initial values.

    Returns
    -------
    values : ndarray, shape (2 n,)
        Stiffness of all DOFs, then damping.
    intervals : ndarray, shape (2, 2 n)
        Limits of the intervals of 95 %.

    Raises
    ------
    ValueError
        An error of `identify`.
    """
    problem, found, _ = estimated_joint(_viscous_problem(freq_hz, gamma, dofs, start))
    return found.theta, np.array(
        list(joint_intervals(found, uncertainty_of(problem, found)[0].factor)(0.95).values())
    ).T


def _viscous_problem(
    freq_hz: FloatArray, gamma: ComplexArray, dofs: Sequence[str], start: FitStart | None
) -> FitProblem:
    """Return the fit of springs and dashpots without cross terms from `start`, for further noise on the same FRFs."""
    noise = NoiseOptions(None, like=None if start is None else start.noise)
    options = FitOptions("viscous", "zero", reciprocal=True)
    measured = as_measured(freq_hz, gamma, square=False)
    problem = prepare_compliance(measured, dofs, None, None, noise, options, is_checked=start is not None)
    return problem if start is None else replace(problem, near=start.estimate.starts)
