"""Number of assemblies for a wanted prediction interval of the next assembly."""

from __future__ import annotations

import math

from scipy.stats import chi2, norm, t

from jointfrf.kernel.arguments import as_count, as_not_negative, as_positive, as_probability

__all__ = ["assemblies_needed", "expected_half_width"]

#: Largest number of assemblies that is tried.
_MOST = 100_000


def expected_half_width(number: int, spread: float, error: float, probability: float = 0.95) -> float:
    """Return the expected half width of the prediction interval of the next assembly, relative to its middle.

    Parameters
    ----------
    number : int
        Number of tested assemblies, at least 2.
    spread : float
        Relative standard deviation of the parameter between assemblies.
    error : float
        Relative standard error of one fit.
    probability : float
        Coverage probability of the interval, default 0.95.

    Raises
    ------
    ValueError
        Fewer than two assemblies; a spread or an error below zero; a probability outside 0 to 1.

    See Also
    --------
    assemblies_needed : number of assemblies for a wanted half width.
    pool : prediction intervals from fits.

    Notes
    -----
    On a logarithmic scale the median of the half widths is

        t_{n-1} sqrt( (s^2 + e^2)(1 + 1/n) m - e^2 ),   m = median of chi^2_{n-1} / (n - 1)

    with the spread s and the known error e of a fit, which is no part of the next assembly. If the spread is near
    zero, intervals of `pool` are wider.

    Examples
    --------
    >>> import jointfrf as jf
    >>> [round(jf.expected_half_width(n, spread=0.1, error=0.02), 2) for n in (3, 5, 10, 30)]
    [0.51, 0.32, 0.26, 0.23]
    """
    spread, error = as_not_negative("spread", spread), as_not_negative("error", error)
    probability = as_probability("probability", probability)
    free = float(as_count("number", number, 2) - 1)
    seen = float(chi2.median(free)) / free
    variance = max((spread**2 + error**2) * (1 + 1 / number) * seen - error**2, error**2 / number)
    return math.expm1(float(t.ppf((1 + probability) / 2, free)) * math.sqrt(variance))


def assemblies_needed(half_width: float, spread: float, error: float, probability: float = 0.95) -> int | None:
    """Return the least number of assemblies whose prediction interval is as narrow as wanted.

    Parameters
    ----------
    half_width : float
        Wanted half width of the interval, relative to its middle.
    spread : float
        Relative standard deviation of the parameter between assemblies.
    error : float
        Relative standard error of one fit.
    probability : float
        Coverage probability of the interval, default 0.95.

    Returns
    -------
    int or None
        Number of assemblies; None if the spread alone makes the interval wider.

    Raises
    ------
    ValueError
        A spread or an error below zero; a probability outside 0 to 1, or a half width that is not positive.

    See Also
    --------
    expected_half_width : half width for a number of assemblies.
    pool : prediction intervals from fits.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.assemblies_needed(0.3, spread=0.1, error=0.02)
    6
    >>> jf.assemblies_needed(0.2, spread=0.1, error=0.02) is None
    True
    """
    wanted = as_positive("half_width", half_width)
    expected_half_width(2, spread, error, probability)  # checks the arguments
    if math.expm1(float(norm.ppf((1 + probability) / 2)) * spread) >= wanted:
        return None
    low, high = 1, 2
    while expected_half_width(high, spread, error, probability) > wanted:
        low, high = high, 2 * high
        if high > _MOST:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        if expected_half_width(middle, spread, error, probability) > wanted:
            low = middle
        else:
            high = middle
    return high
