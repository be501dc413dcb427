"""Joint compliance K*^-1 from interface FRFs, and its derivative and covariance for noisy FRFs."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import ComplexArray, as_interface, as_real, optional_frequency
from jointfrf.kernel.call import N_FREQ, run
from jointfrf.kernel.status import OnSingular

__all__ = ["compliance_covariance", "compliance_factors", "joint_compliance"]


def joint_compliance(
    gamma: ArrayLike,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
    out: ComplexArray | None = None,
) -> ComplexArray:
    """Joint compliance C = K*^-1 without model, first estimate or band.

    Parameters
    ----------
    gamma : array_like, shape (n_freq, 2 n, 2 n)
        Receptance of the assembly at joint DOFs j, then k, m/N.
    freq_hz, on_singular, out
        As in `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        C, m/N: relative displacement across the joint per force through it.

    Raises
    ------
    SingularLineError, ValueError
        As in `couple`.

    Notes
    -----
    C = gamma_kk gamma_jk^-1 gamma_jj - gamma_kj, exactly. Noise enters C almost linearly, while it enters K* through an
    inverse: averaging K*, an inverse of noisy data, over a band is biased towards zero where the noise exceeds the
    compliance, averaging C is not.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> h = np.full((1, 1, 1), 0.5)
    >>> jf.joint_compliance(jf.couple(h, h, [[4.0]], [0], [0])).real.round(12).tolist()
    [[[0.25]]]
    """
    measured, n = as_interface("gamma", gamma)
    n_freq = measured.shape[0]
    freq = optional_frequency(freq_hz, n_freq)
    shape, sweeps = (n_freq, n, n), {"gamma": measured}
    return run("joint_compliance", (n, N_FREQ, measured), shape, sweeps, freq, on_singular, out=out)[0]


def compliance_factors(
    gamma: ArrayLike,
    transform: ArrayLike | None = None,
    *,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
) -> tuple[ComplexArray, ComplexArray]:
    """Return the derivative of the joint compliance by the measured FRFs: dC = U dh V, to first order.

    Parameters
    ----------
    gamma : array_like, shape (n_freq, 2 n, 2 n)
        Receptance about which is linearised, m/N.
    transform : array_like, shape (2 n, m), optional
        T of gamma = T h T^T; by default gamma itself was measured.
    freq_hz, on_singular
        As in `couple`.

    Returns
    -------
    u : ndarray, shape (n_freq, n, m)
    v : ndarray, shape (n_freq, m, n)

    Raises
    ------
    SingularLineError, ValueError
        As in `couple`.

    Notes
    -----
    U = [L, -I] T and V = T^T [I; -R] with L = gamma_kk gamma_jk^-1 and R = gamma_jk^-1 gamma_jj.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> gamma = np.array([[[0.3125, 0.1875], [0.1875, 0.3125]]])
    >>> u, v = jf.compliance_factors(gamma)
    >>> dh = 1e-6 * np.array([[1.0, 2.0], [3.0, 4.0]])
    >>> change = jf.joint_compliance(gamma + dh) - jf.joint_compliance(gamma)
    >>> bool(abs(change - u @ dh @ v).max() < 1e-9)
    True
    """
    mean, n = as_interface("gamma", gamma)
    n_freq = mean.shape[0]
    t = as_real("transform", np.eye(2 * n) if transform is None else transform, (2 * n, None))
    m = t.shape[1]
    freq = optional_frequency(freq_hz, n_freq)
    args = (n, m, N_FREQ, mean, t)
    factors = run("compliance_factors", args, (n_freq, 2 * n, m), {"gamma": mean}, freq, on_singular)[0]
    return factors[:, :n], factors[:, n:].swapaxes(1, 2)


def compliance_covariance(
    gamma: ArrayLike,
    variance: ArrayLike,
    transform: ArrayLike | None = None,
    *,
    reciprocal: bool = True,
    freq_hz: ArrayLike | None = None,
    on_singular: OnSingular = "raise",
) -> ComplexArray:
    """Covariance of the entries of the joint compliance from the noise of the measured FRFs, to first order.

    Parameters
    ----------
    gamma : array_like, shape (n_freq, 2 n, 2 n)
        Receptance about which is linearised, m/N: a smoothed one, so that the weights do not follow the noise.
    variance : array_like, shape (n_freq, m, m)
        E|e|^2 of the measured FRFs h, (m/N)^2; circular noise, independent between entries.
    transform : array_like, shape (2 n, m), optional
        T of gamma = T h T^T; by default gamma itself was measured.
    reciprocal : bool
        Whether h was symmetrised, (h + h^T)/2, before.
    freq_hz, on_singular
        As in `couple`.

    Returns
    -------
    ndarray, shape (n_freq, n * n, n * n)
        E[dC_ab conj(dC_cd)] at row a n + b, column c n + d, (m/N)^2.

    Raises
    ------
    SingularLineError, ValueError
        As in `couple`.

    Notes
    -----
    With dC = U dh V of `compliance_factors`.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> gamma = np.array([[[0.3125, 0.1875], [0.1875, 0.3125]]])
    >>> jf.compliance_covariance(gamma, 1e-4 * gamma**2, reciprocal=False).real.round(8).tolist()
    [[[8.49e-05]]]
    """
    mean, n = as_interface("gamma", gamma)
    n_freq = mean.shape[0]
    t = as_real("transform", np.eye(2 * n) if transform is None else transform, (2 * n, None))
    m = t.shape[1]
    spread = as_real("variance", variance, (n_freq, m, m))
    if (spread < 0).any():
        raise ValueError("variance must not be negative")
    freq = optional_frequency(freq_hz, n_freq)
    args = (int(reciprocal), n, m, N_FREQ, mean, t, spread)
    sweeps = {"gamma": mean, "variance": spread}
    return run("compliance_covariance", args, (n_freq, n * n, n * n), sweeps, freq, on_singular)[0]
