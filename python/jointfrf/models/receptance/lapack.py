"""LAPACK for real arrays of few columns, without what `scipy.linalg` asks first: that takes longer than the numbers."""

from __future__ import annotations

import numpy as np
from scipy.linalg import lapack

from jointfrf.kernel.arguments import FloatArray

__all__ = ["eigh", "orthonormal"]

#: LAPACK's columns a block: with less work space it may take fewer.
_BLOCK = 64


def eigh(k: FloatArray, m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return w^2, ascending, and shapes of unit modal mass of K x = w^2 M x; the lower triangles are read.

    Raises
    ------
    numpy.linalg.LinAlgError
        M is not positive definite, an entry is not finite, or there is no convergence.
    """
    _check_finite(k, m)
    squared, shapes, info = lapack.dsygvd(k, m, uplo="L")
    if info:
        raise np.linalg.LinAlgError(f"dsygvd: info {info}")
    return squared, shapes


def orthonormal(a: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the columns, shape (n, k), k <= n.

    Raises
    ------
    numpy.linalg.LinAlgError
        An entry is not finite.
    """
    _check_finite(a)
    n_work = _BLOCK * a.shape[1]
    reflectors, scales, _, _ = lapack.dgeqrf(a, lwork=n_work)
    basis: FloatArray = lapack.dorgqr(reflectors, scales, lwork=n_work)[0]
    return basis


def _check_finite(*arrays: FloatArray) -> None:
    for array in arrays:
        if np.count_nonzero(np.isfinite(array)) != array.size:
            raise np.linalg.LinAlgError("an entry is NaN or Inf")
