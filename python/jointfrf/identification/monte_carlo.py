"""Monte Carlo study of an identification in the kernel: no realisation is ever stored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.bands import Band, in_bands
from jointfrf.frf.noise import NoiseKind, NoiseReference, noise_arguments
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_frequency,
    as_integer,
    as_interface,
    as_joint_lines,
    check_choice,
    one_line,
    optional_frequency,
)
from jointfrf.kernel.call import LineStatus, OnSingular, call, check_lines
from jointfrf.substructuring.methods import STIFFNESS_METHODS

__all__ = ["BandStatistics", "MonteCarlo", "MonteCarloMethod", "monte_carlo"]

MonteCarloMethod = Literal["ismm", "inverse-substructuring", "compliance"]

#: The letters of the kernel.
_LETTERS: Mapping[MonteCarloMethod, str] = {"ismm": "I", "inverse-substructuring": "S", "compliance": "C"}


class BandStatistics(NamedTuple):
    """Mean and standard deviation of the band means of single realisations, shape (n, n) each.

    Attributes
    ----------
    stiffness, stiffness_std : ndarray
        Mean of Re K* over the lines of the band, and its standard deviation, N/m.
    damping, damping_std : ndarray
        Mean of Im K*/w, and its standard deviation, N s/m.
    """

    stiffness: FloatArray
    stiffness_std: FloatArray
    damping: FloatArray
    damping_std: FloatArray


@dataclass(frozen=True)
class MonteCarlo:
    """Result of `monte_carlo`.

    Attributes
    ----------
    count : int
        Number of realisations of every line.
    good : ndarray of int32, shape (n_freq,)
        Number of realisations that were identified; all further realisations are excluded.
    mean : ndarray, shape (n_freq, n, n)
        Mean over the good realisations, N/m (m/N for "compliance"); NaN if there is none.
    covariance : ndarray, shape (n_freq, n, n, 3)
        Var Re, Var Im and Cov(Re, Im) of each entry; NaN if fewer than two realisations are good.
    line_info : ndarray of int32, shape (n_freq,)
        Status of the line: 0, or the error of the first realisation if none is good, see `LineStatus`.
    rcond : ndarray, shape (n_freq,)
        Smallest reciprocal condition number over the good realisations.
    """

    count: int
    good: NDArray[np.int32]
    mean: ComplexArray
    covariance: FloatArray
    line_info: NDArray[np.int32]
    rcond: FloatArray

    @property
    def variance(self) -> FloatArray:
        """E|x - mean|^2 of each entry, shape (n_freq, n, n)."""
        total: FloatArray = self.covariance[..., 0] + self.covariance[..., 1]
        return total

    @property
    def std_error(self) -> FloatArray:
        """Standard error of the mean, sqrt(variance/good), shape (n_freq, n, n)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            error: FloatArray = np.sqrt(self.variance / self.good[:, None, None])
        return error

    def band(self, freq_hz: ArrayLike, bands: Sequence[Band]) -> BandStatistics:
        """Return statistics of the band means of single realisations.

        Parameters
        ----------
        freq_hz : array_like, shape (n_freq,)
            Frequency lines, Hz.
        bands : sequence of (low, high)
            Intervals that together are the band, Hz.

        Returns
        -------
        BandStatistics
            Means and standard deviations.

        Raises
        ------
        ValueError
            No line in the band, or one at 0 Hz.

        Notes
        -----
        The noise of different lines is independent, so the variance of a mean over N lines is the sum of their
        variances over N^2. It is exact if no line has lost realisations.
        """
        freq = as_frequency(freq_hz, self.good.size)
        inside = in_bands(freq, bands)
        if not inside.any() or not freq[inside].all():
            raise ValueError(f"the band must contain lines, and none at 0 Hz: {one_line(bands)}")
        number = int(inside.sum())
        omega = 2 * np.pi * freq[inside, None, None]
        mean, covariance = self.mean[inside], self.covariance[inside]
        return BandStatistics(
            mean.real.mean(axis=0),
            np.sqrt(covariance[..., 0].sum(axis=0)) / number,
            (mean.imag / omega).mean(axis=0),
            np.sqrt((covariance[..., 1] / omega**2).sum(axis=0)) / number,
        )


def monte_carlo(
    gamma: ArrayLike,
    level: float,
    kind: NoiseKind = "complex",
    seed: int = 0,
    *,
    count: int = 1000,
    first: int = 0,
    method: MonteCarloMethod = "inverse-substructuring",
    alpha: ArrayLike | None = None,
    k_initial: ArrayLike | None = None,
    relative_to: NoiseReference = "entry",
    reciprocal: bool = False,
    block: int | None = None,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    rng: int | np.random.Generator | None = None,
) -> MonteCarlo:
    """Return mean and covariance of the joint identified from polluted FRFs.

    Parameters
    ----------
    gamma : array_like, shape (n_freq, 2 n, 2 n)
        Exact receptance of the assembly at joint DOFs j, then k, m/N; it is polluted.
    level, kind, seed, relative_to, reciprocal, block, rng
        Options of the noise; see `pollute`.
    count, first : int
        Number of realisations and the number of the first one, which are the realisations of `realisations`.
    method : {"ismm", "inverse-substructuring", "compliance"}
        Method line by line: `ismm`, `inverse_substructuring` or `joint_compliance`.
    alpha : array_like, shape (n_freq, 2 n, 2 n), optional
        Calculated receptance of the assembly with K0, free of noise, m/N; needed by "ismm".
    k_initial : array_like, shape (n_freq, n, n) or (n, n), optional
        Initial value K0, N/m; needed by "ismm".
    freq_hz, on_singular
        Frequencies, Hz, and treatment of singular lines; see `couple`. A line is singular if no realisation can be
        identified.

    Returns
    -------
    MonteCarlo
        Mean and covariance of each line.

    Raises
    ------
    SingularLineError, ValueError
        An error of `couple` or `pollute`; alpha or k_initial missing for "ismm", or given for another method.

    See Also
    --------
    realisations : the polluted FRFs themselves.
    identify_realisations : a fit of each set of FRFs.

    Notes
    -----
    Memory does not depend on `count`. Results do not depend on the number of threads; other engines differ by rounding.
    Noise is on gamma only. By D = gamma^-1 - alpha^-1, eq. (2.40), ISMM is K0 + (alpha^-1)_jk - (gamma^-1)_jk, and only
    the last term depends on the realisation. If noise makes gamma nearly singular, K* has heavy tails. Mean and
    variance then converge slowly or not at all; use quantiles from `realisations`.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> h = np.full((1, 1, 1), 0.5)
    >>> gamma = jf.couple(h, h, [[3.0]], [0], [0])
    >>> study = jf.monte_carlo(gamma, 0.01, seed=1, count=4000)
    >>> study.mean.real.round(1).tolist(), study.good.tolist()
    ([[[3.0]]], [4000])
    """
    exact, n = as_interface("gamma", gamma)
    n_freq = exact.shape[0]
    check_choice("method", method, get_args(MonteCarloMethod))
    noise = noise_arguments(level, kind, seed, rng, relative_to, reciprocal, block, first, count, exact.shape[1:])
    if as_integer("count", count) < 1:
        raise ValueError(f"count must be positive, not {count}")
    needed = () if method == "compliance" else STIFFNESS_METHODS[method].model
    if any((name in needed) != (value is not None) for name, value in (("alpha", alpha), ("k_initial", k_initial))):
        raise ValueError('method "ismm", and no other, needs alpha and k_initial')
    sweeps = {"gamma": exact}
    calculated, initial = exact, np.zeros((n_freq, n, n), np.complex128)
    if alpha is not None and k_initial is not None:
        calculated, m = as_interface("alpha", alpha, n_freq)
        if m != n:
            raise ValueError(f"alpha must have the shape of gamma, {exact.shape}, not {calculated.shape}")
        initial = np.ascontiguousarray(as_joint_lines("k_initial", k_initial, n, n_freq))
        sweeps |= {"alpha": calculated, "k_initial": initial}
    freq = optional_frequency(freq_hz, n_freq)
    good, mean = np.zeros(n_freq, np.int32), np.empty((n_freq, n, n), np.complex128)
    covariance = np.empty((n_freq, n, n, 3))
    status = LineStatus(np.zeros(n_freq, np.int32), np.ones(n_freq))
    if n_freq:
        results = (good, mean, covariance, *status)
        call("monte_carlo", (_LETTERS[method], *noise, n, n_freq, first, count, calculated, exact, initial, *results))
    check_lines("monte_carlo", status, sweeps, freq, on_singular)
    return MonteCarlo(count, good, mean, covariance, *status)
