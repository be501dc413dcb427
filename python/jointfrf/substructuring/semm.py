"""Measured FRFs expanded to all DOFs of a model: system equivalent model mixing (SEMM)."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import (
    ComplexArray,
    as_dofs,
    as_lines,
    as_number,
    check_choice,
    check_finite_lines,
    optional_frequency,
)

__all__ = ["SemmMethod", "semm"]

SemmMethod = Literal["original", "extended"]


def semm(
    h_model: ArrayLike,
    h_measured: ArrayLike,
    outputs: ArrayLike,
    inputs: ArrayLike | None = None,
    *,
    method: SemmMethod = "extended",
    rcond: float = 1e-12,
    freq_hz: ArrayLike | None = None,
) -> ComplexArray:
    """Expand measured FRFs to all DOFs of a model.

    Parameters
    ----------
    h_model : array_like, shape (n_freq, n, n)
        FRFs of the parent model between all DOFs g that are wanted, m/N.
    h_measured : array_like, shape (n_freq, m_o, m_i)
        Measured FRFs, m/N.
    outputs, inputs : array_like of int, shape (m_o,), (m_i,)
        DOFs of the model at which responses and forces were measured, counted from 0; `inputs` are the `outputs` by
        default.
    method : {"original", "extended"}
        Which part of the parent model is taken out: that of the measured DOFs only, or that of all of its DOFs, which
        leaves less of the model in the result.
    rcond : float
        Singular values below this share of the largest are taken as zero in the pseudo-inverses.
    freq_hz : array_like, shape (n_freq,), optional
        Frequencies in Hz, to name a bad line.

    Returns
    -------
    ndarray, shape (n_freq, n, n)
        m/N. At the measured DOFs it is the measurement: its noise is expanded, too.

    Raises
    ------
    ValueError
        Wrong shapes or DOFs, NaN or Inf in a line.

    Notes
    -----
    Original: Y = Y_gg - Y_gb Y_bb^-1 (Y_bb - Y_meas) Y_bb^-1 Y_bg. Extended: Y = Y_gg - Y_gg Y_bg^+ (Y_bb - Y_meas)
    Y_gb^+ Y_gg, with pseudo-inverses. Both are the parent model, less the removed one, plus the measurement, coupled at
    the measured and, extended, at all DOFs. Where noise is known and a joint is sought, `identify_model` uses the
    same FRFs without expanding them.

    References
    ----------
    .. [1] S. W. B. Klaassen, M. V. van der Seijs, D. de Klerk, System equivalent model mixing, Mech. Syst. Signal
       Process. 105 (2018) 90-112.

    Examples
    --------
    A chain whose first spring is 10 % softer in the model, measured at its first mass:

    >>> import numpy as np, jointfrf as jf
    >>> freq = np.array([1.0])
    >>> real = jf.chain([5, 3], [2500, 3500], ground="start").receptance(freq)
    >>> model = jf.chain([5, 3], [2250, 3500], ground="start").receptance(freq)
    >>> mixed = jf.semm(model, real[:, :1, :1], [0], method="original")
    >>> bool(np.allclose(mixed, real))
    True
    """
    check_choice("method", method, get_args(SemmMethod))
    model = as_lines("h_model", h_model)
    rcond = as_number("rcond", rcond)
    n_freq, n, columns = model.shape
    if n != columns:
        raise ValueError(f"h_model must be square, not {n} x {columns}")
    out = as_dofs("outputs", outputs, n) - 1
    into = out if inputs is None else as_dofs("inputs", inputs, n) - 1
    measured = as_lines("h_measured", h_measured, out.size, into.size, n_freq)
    freq = optional_frequency(freq_hz, n_freq)
    for name, lines in (("h_model", model), ("h_measured", measured)):
        check_finite_lines(name, lines, freq)
    wrong = model[:, out][:, :, into] - measured
    if method == "original":
        inverse = np.linalg.pinv(model[:, out][:, :, into], rcond=rcond)
        left, right = model[:, :, into] @ inverse, inverse @ model[:, out]
    else:
        left = model @ np.linalg.pinv(model[:, out], rcond=rcond)
        right = np.linalg.pinv(model[:, :, into], rcond=rcond) @ model
    mixed: ComplexArray = model - left @ wrong @ right
    return np.ascontiguousarray(mixed)
