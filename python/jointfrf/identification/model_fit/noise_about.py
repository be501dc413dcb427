"""Noise of measured FRFs about fitted ones."""

from __future__ import annotations

import numpy as np

from jointfrf.frf.noise_parts import noise_parts
from jointfrf.kernel.arguments import FloatArray

__all__ = ["noise_about"]

#: A floor counts where it raises the logarithm of the likelihood by more than this.
_SIGNIFICANT = 4.0
_TINY = float(np.finfo(float).tiny)


def noise_about(squares: FloatArray, size: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return relative part and floor of the variance by entry, (relative^2, floor^2), shape (n_entries,) each.

    Parameters
    ----------
    squares : ndarray, shape (n_entries, n_freq)
        |e|^2 of measured minus fitted FRFs.
    size : ndarray, shape (n_entries, n_freq)
        |h|^2 of the fitted ones.

    Notes
    -----
    At antiresonances a small FRF may say most of all. A floor that the squares do not clearly show would hide it.
    """
    size = np.maximum(size, _TINY)
    relative, floor = noise_parts(squares, np.stack([size, np.ones_like(size)]))
    alone = (squares / size).mean(axis=1)

    def likelihood(parts: FloatArray, rest: FloatArray) -> FloatArray:
        variance = np.maximum(parts[:, None] * size + rest[:, None], _TINY)
        return np.asarray(-(np.log(variance) + squares / variance).sum(axis=1))

    shown = likelihood(relative, floor) > likelihood(alone, np.zeros_like(floor)) + _SIGNIFICANT
    return np.where(shown, relative, alone), np.where(shown, floor, 0.0)
