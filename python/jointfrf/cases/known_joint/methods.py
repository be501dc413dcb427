"""K*(w) line by line, by each method, and the FRFs of the assembly that a method takes."""

from __future__ import annotations

from typing import Literal

import numpy as np

from jointfrf.cases.known_joint.exact import Exact
from jointfrf.kernel.arguments import ComplexArray
from jointfrf.substructuring.decoupling import Equation, decouple
from jointfrf.substructuring.ismm import inverse_substructuring, ismm

__all__ = ["LINE_METHODS", "joint_lines", "measured", "noise_stream"]

_DECOUPLING: dict[str, Equation] = {
    "decoupling-rr": "rr",
    "decoupling-rs": "rs",
    "decoupling-sr": "sr",
    "decoupling-ss": "ss",
}
#: Methods that give K* on every line.
LINE_METHODS = ("ismm", "inverse_substructuring", *_DECOUPLING)


def measured(exact: Exact, method: str) -> ComplexArray:
    """FRFs of the assembly that a method takes.

    Parameters
    ----------
    exact : Exact
    method : str

    Returns
    -------
    ndarray, shape (n_freq, n, n) for decoupling, else (n_freq, 2 n, 2 n)
        Between the internal points that the equation names; at joint DOFs j, then k. m/N.
    """
    if method not in _DECOUPLING:
        return exact.interface(exact.h_c)
    response, force = _DECOUPLING[method]
    return np.ascontiguousarray(exact.h_c[:, exact.where(response), exact.where(force)])


def noise_stream(method: str) -> int:
    """Return what a method adds to the seed: FRFs at other points have noise of their own."""
    return 1 + list(_DECOUPLING).index(method) if method in _DECOUPLING else 0


def joint_lines(
    exact: Exact, method: str, h: ComplexArray, on_singular: Literal["raise", "nan"] = "raise"
) -> ComplexArray:
    """K* by a method, for several sets of measured FRFs.

    Parameters
    ----------
    exact : Exact
        What the method knows of the substructures, or of the assembly with the first estimate.
    method : str
        One of `LINE_METHODS`.
    h : ndarray, shape (r, n_freq, m, m)
        FRFs as `measured` returns them, with noise or without.
    on_singular : {"raise", "nan"}

    Returns
    -------
    ndarray, shape (r, n_freq, n, n)
        N/m.
    """
    count, n_freq, n = len(h), exact.freq_hz.size, exact.n
    lines = h.reshape(count * n_freq, *h.shape[2:])

    def repeated(of_case: ComplexArray) -> ComplexArray:
        return np.tile(of_case, (count, 1, 1))

    if method in _DECOUPLING:
        joint, inner = list(range(n)), list(range(n, 2 * n))
        h_a, h_b = repeated(exact.h_a), repeated(exact.h_b)
        found = decouple(
            _DECOUPLING[method], h_a, h_b, lines, joint, joint, inner, inner, on_singular=on_singular
        )
    elif method == "ismm":
        alpha = exact.interface(exact.h_initial)
        found = ismm(repeated(alpha), lines, repeated(exact.k_initial), on_singular=on_singular)
    else:
        found = inverse_substructuring(lines, on_singular=on_singular)
    return found.reshape(count, n_freq, n, n)
