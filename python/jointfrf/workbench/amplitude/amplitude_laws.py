"""Laws over amplitude, fitted to stiffness and loss factor of a joint at several levels."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.choices import AMPLITUDE_LAWS
from jointfrf.identification.result import columns_of
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_names, as_probability, as_real, check_choice
from jointfrf.workbench.amplitude.friction import bouc_wen, iwan, jenkins

__all__ = ["AMPLITUDE_LAWS", "AmplitudeLawFit", "AmplitudeLawFits", "fit_amplitude_laws"]

#: Slip displacements that fits start from, times the median amplitude: a decade to either side.
_STARTS = (0.1, 0.3, 1.0, 3.0, 10.0)
#: Least distance of an Iwan exponent from -1, at which the element has no stiffness.
_CHI = (-0.98, 1.0)
#: Largest distance of a parameter's logarithm from its initial value; beyond it the data do not change.
_FAR = 14.0
#: Share of the measured stiffness below which a difference of terms is rounding.
_ROUNDING = 1e-12
#: p-value of the residuals below which the law is wrong or the errors are too small.
_CHANCE = 1e-3
#: Least logarithmic distance from the minimum, and number of evaluations, of a profile.
_BEND, _PROFILE = 0.1, 100
#: Least share of each variance that is independent, so that the covariance has an inverse.
_OWN = 1e-6
#: Range of values and errors in which no square of a ratio overflows.
_LEAST, _MOST = 1e-30, 1e30


@dataclass(frozen=True)
class _Law:
    """Names of parameters, names fitted by logarithm, initial values by (k at the lowest level, slip), and K(a)."""

    names: tuple[str, ...]
    start: Callable[[float, float], tuple[float, ...]]
    stiffness: Callable[..., ComplexArray]
    not_logarithmic: tuple[str, ...] = ("loss_factor",)


def _power(a: FloatArray, k: float, at_median: float, exponent: float, median: float) -> ComplexArray:
    return np.asarray(k * (1 + 1j * at_median * (a / median) ** exponent), dtype=np.complex128)


_LAWS = {
    "constant": _Law(
        ("k", "loss_factor"), lambda k, _: (k, 0.01), lambda a, k, loss: np.full(a.shape, k * (1 + 1j * loss))
    ),
    "power": _Law(
        ("k", "loss_factor", "exponent"), lambda k, _: (k, 0.01, 0.5), _power, ("loss_factor", "exponent")
    ),
    "jenkins": _Law(
        ("k_parallel", "k_slider", "slip", "loss_factor"),
        lambda k, slip: (k / 2, k / 2, slip, 0.0),
        lambda a, spring, k, slip, loss: spring + jenkins(a, k, slip) + 1j * loss * (spring + k),
    ),
    "iwan": _Law(
        ("slip_force", "k", "chi", "beta", "loss_factor"),
        lambda k, slip: (k * slip, k, -0.5, 1.0, 0.0),
        lambda a, force, k, chi, beta, loss: iwan(a, force, k, chi, beta) + 1j * loss * k,
        ("chi", "loss_factor"),
    ),
    "bouc-wen": _Law(
        ("k_parallel", "k_hysteretic", "yield", "loss_factor"),
        lambda k, slip: (k / 2, k / 2, slip, 0.0),
        lambda a, spring, k, limit, loss: spring + bouc_wen(a, k, limit) + 1j * loss * (spring + k),
    ),
}  # fmt: skip


@dataclass(frozen=True)
class AmplitudeLawFit:
    """One law fitted to a joint at several levels.

    Attributes
    ----------
    law : str
        Name of the law.
    values : dict of str to float
        Parameters; forces in N, stiffness in N/m, displacements in m.
    intervals : dict of str to (float, float)
        Intervals of the parameters, symmetric in the logarithm of stiffness, force and displacement; 0 .. inf if the
        data do not determine a parameter.
    chi_square, degrees : float, int
        Squared residuals in the metric of the covariance of the levels, and their degrees of freedom.
    widened : float
        Factor by which residuals widen the intervals: the root of chi_square / degrees if the p-value of the residuals
        is below 0.001, else 1.
    aicc, bic : float
        Akaike's criterion, corrected for few data, and the Bayesian criterion; lower is better.
    stiffness, loss_factor : ndarray, shape (n_levels,)
        Values of the law at the amplitudes, N/m and 1.
    """

    law: str
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    chi_square: float
    degrees: int
    widened: float
    aicc: float
    bic: float
    stiffness: FloatArray
    loss_factor: FloatArray


@dataclass(frozen=True)
class AmplitudeLawFits:
    """Laws fitted to a joint at several levels, the lowest AICc first; `print` shows them.

    Attributes
    ----------
    fits : tuple of AmplitudeLawFit
        One fit for each law.
    left_out : dict of str to str
        Reason for each law that was not fitted.
    """

    fits: tuple[AmplitudeLawFit, ...]
    left_out: dict[str, str]

    def __str__(self) -> str:
        """Return a table of the laws, and a table of the parameters of the best law."""
        best = self.fits[0]
        laws = [("law", "AICc", "BIC", "chi^2", "degrees of freedom")]
        laws += [(f.law, _shown(f.aicc), _shown(f.bic), f"{f.chi_square:.3g}", str(f.degrees)) for f in self.fits]
        rows = [(f"parameter of {best.law}", "value", "interval")]
        rows += [(n, f"{v:.4g}", "{:.4g} .. {:.4g}".format(*best.intervals[n])) for n, v in best.values.items()]
        said = [f"{law}: {why}" for law, why in self.left_out.items()]
        return "\n\n".join("\n".join(lines) for lines in (columns_of(laws), columns_of(rows), said) if lines)


def _shown(criterion: float) -> str:
    """Return a criterion with one decimal, or with four digits if it is large."""
    return f"{criterion:.1f}" if abs(criterion) < 1000 else f"{criterion:.4g}"


def fit_amplitude_laws(
    amplitude: ArrayLike,
    stiffness: ArrayLike,
    loss_factor: ArrayLike,
    stiffness_error: ArrayLike,
    loss_factor_error: ArrayLike,
    *,
    common: ArrayLike | None = None,
    laws: Iterable[str] = AMPLITUDE_LAWS,
    probability: float = 0.95,
) -> AmplitudeLawFits:
    """Fit laws over amplitude to k(a) and eta(a) of one joint, and return them by rising AICc.

    Parameters
    ----------
    amplitude : array_like, shape (n_levels,)
        Peak value of the relative motion in the joint, m.
    stiffness, loss_factor : array_like, shape (n_levels,)
        Stiffness and loss factor of the joint at each level, N/m and 1.
    stiffness_error, loss_factor_error : array_like, shape (n_levels,)
        Standard errors of stiffness and loss factor, N/m and 1.
    common : array_like, shape (n_errors, 2, n_levels), optional
        Changes of stiffness and loss factor by one standard deviation of each error that all levels share, such as the
        error of a modulus. By default errors are independent between levels.
    laws : iterable of {"constant", "power", "jenkins", "iwan", "bouc-wen"}
        Names of the laws, default all. "power" has a constant stiffness, and a loss factor that is a power of the
        amplitude ("loss_factor" is its value at the median amplitude). "iwan" is Segalman's element. "jenkins" and
        "bouc-wen" (n = 1, beta = gamma) have a parallel spring. These three also have a constant loss factor of the
        stiffness at rest.
    probability : float
        Coverage probability of the intervals, default 0.95.

    Returns
    -------
    AmplitudeLawFits
        One fit for each law, the lowest AICc first.

    Raises
    ------
    ValueError
        Values that are not positive, or beyond 1e-30 to 1e30, unknown laws, levels too few for any of the laws.

    See Also
    --------
    levels : stiffness and loss factor from fits at several levels.
    decay_levels : stiffness and loss factor from free decays.

    Notes
    -----
    The residuals of ln k and of eta are whitened by their covariance; intervals come from their derivatives.
    Stiffness and loss factor belong to the first harmonic, which FRFs of stepped sines show.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> a = np.geomspace(1e-7, 1e-5, 8)
    >>> found = jf.fit_amplitude_laws(a, np.full(8, 1e6), 0.01 * (a / 1e-6)**0.6, np.full(8, 1e3), np.full(8, 1e-4))
    >>> found.fits[0].law, round(found.fits[0].values["exponent"], 3)
    ('power', 0.6)
    """
    a = _positive("amplitude", amplitude, None)
    k, dk, d_eta = (
        _positive(name, value, a.size)
        for name, value in (("stiffness", stiffness), ("stiffness_error", stiffness_error),
                            ("loss_factor_error", loss_factor_error))
    )  # fmt: skip
    eta = as_real("loss_factor", loss_factor, (a.size,))
    if (np.abs(eta) > _MOST).any():
        raise ValueError(f"loss_factor is {eta[np.argmax(np.abs(eta))]:g}; give values within +-{_MOST:g}")
    chosen = dict.fromkeys(as_names("laws", laws))
    for law in chosen:
        check_choice("laws", law, AMPLITUDE_LAWS)
    share = as_probability("probability", probability)
    columns = np.zeros((0, 2, a.size)) if common is None else as_real("common", common, (None, 2, a.size))
    white = _whitening(np.array([dk / k, d_eta]), columns / np.array([k, np.ones(a.size)]))
    fits, left_out = [], {}
    for law in chosen:
        count = len(_LAWS[law].names)
        if 2 * a.size - count - 1 <= 0:
            left_out[law] = f"{count} parameters need at least {count // 2 + 1} levels, not {a.size}"
        else:
            fits.append(_fit(law, a, k, eta, white, share))
    if not fits:
        raise ValueError(
            f"{a.size} levels are too few for the laws {', '.join(chosen) or '(none)'}; give more levels or fewer laws"
        )
    return AmplitudeLawFits(tuple(sorted(fits, key=lambda one: one.aicc)), left_out)


def _positive(name: str, value: ArrayLike, size: int | None) -> FloatArray:
    array = as_real(name, value, (size,))
    bad = np.flatnonzero(~((array >= _LEAST) & (array <= _MOST)))
    if bad.size:
        where = f"is {array[bad[0]]:g} at level {bad[0]}"
        raise ValueError(f"{name} {where}; give values between {_LEAST:g} and {_MOST:g}")
    return array


def _whitening(errors: FloatArray, common: FloatArray) -> FloatArray:
    """Return the inverse root of the covariance of ln k and eta, shape (2 n, 2 n), by errors (2, n) and common parts.

    The remainder of the errors beyond the common parts is independent, and at least rounding.
    """
    columns, variance = common.reshape(len(common), errors.size), np.square(errors).ravel()
    own = np.maximum(variance - np.square(columns).sum(axis=0), _OWN * variance)
    root = np.linalg.cholesky(np.diag(own) + columns.T @ columns)
    return np.asarray(np.linalg.inv(root))


def _profile(
    residual: Callable[[FloatArray], FloatArray], best: FloatArray, bounds: FloatArray, i: int, value: float
) -> float:
    """Return the least chi-square with one parameter at another value."""
    from scipy.optimize import least_squares

    def of_rest(rest: FloatArray) -> FloatArray:
        return residual(np.insert(rest, i, value))

    return 2 * float(
        least_squares(
            of_rest, np.delete(best, i), bounds=np.delete(bounds, i, 1), x_scale="jac", max_nfev=_PROFILE
        ).cost
    )


def _fit(law: str, a: FloatArray, k: FloatArray, eta: FloatArray, white: FloatArray, share: float) -> AmplitudeLawFit:
    from scipy.optimize import least_squares
    from scipy.special import chdtrc, ndtri

    own = _LAWS[law]
    is_log = np.array([name not in own.not_logarithmic for name in own.names])
    extra = (float(np.median(a)),) if law == "power" else ()

    def of_law(x: FloatArray) -> ComplexArray:
        return own.stiffness(a, *np.where(is_log, np.exp(np.where(is_log, x, 0.0)), x), *extra)

    def residual(x: FloatArray) -> FloatArray:
        found = of_law(x)
        real = np.maximum(found.real, _ROUNDING * k)
        return np.asarray(white @ np.concatenate([np.log(real) - np.log(k), found.imag / real - eta]))

    best = None
    for slip in _STARTS:
        start = np.array(own.start(float(k[np.argmin(a)]), slip * float(np.median(a))))
        x = np.where(is_log, np.log(np.where(is_log, start, 1.0)), start)
        low, high = np.where(is_log, x - _FAR, -10.0), np.where(is_log, x + _FAR, 10.0)
        if "chi" in own.names:
            low[own.names.index("chi")], high[own.names.index("chi")] = _CHI
        run = least_squares(residual, x, bounds=(low, high), x_scale="jac")
        if best is None or run.cost < best.cost:
            best, bounds = run, np.array([low, high])
    assert best is not None
    _, values, rows = np.linalg.svd(best.jac, full_matrices=False)
    # A direction in which residuals change by less than rounding has an unbounded error, not a zero one.
    values = np.maximum(values, np.finfo(float).eps * values[0])
    n, count, chi_square = 2 * a.size, len(own.names), 2 * float(best.cost)
    widened = math.sqrt(chi_square / (n - count)) if chdtrc(n - count, chi_square) < _CHANCE else 1.0
    width = widened * float(ndtri((1 + share) / 2)) * np.sqrt(np.sum((rows / values[:, None]) ** 2, axis=0))
    found = of_law(best.x)
    limits, parameters = {}, {}
    for name, x, half, logarithmic in zip(own.names, best.x, width, is_log, strict=True):
        parameters[name] = math.exp(x) if logarithmic else float(x)
        ends = (float(x - half), float(x + half))
        if logarithmic:  # beyond a factor of exp(7) to either side the data do not determine it
            ends = (math.exp(ends[0]), math.exp(ends[1])) if half < _FAR / 2 else (0.0, math.inf)
            if half < _FAR / 2:  # a flat profile is checked too: the law may have a kink at the minimum
                i, most = own.names.index(name), chi_square + (widened * float(ndtri((1 + share) / 2))) ** 2
                far = [
                    _profile(residual, best.x, bounds, i, x + side * max(2 * half, _BEND)) < most for side in (-1, 1)
                ]
                ends = (0.0 if far[0] else ends[0], math.inf if far[1] else ends[1])
        limits[name] = ends
    return AmplitudeLawFit(
        law, parameters, limits, chi_square, n - count, widened,
        chi_square + 2 * count + 2 * count * (count + 1) / (n - count - 1), chi_square + count * math.log(n),
        found.real, found.imag / found.real,
    )  # fmt: skip
