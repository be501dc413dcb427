"""FRFs of structures with connections between their DOFs: springs, masses and constraints alike."""

from __future__ import annotations

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import solve
from jointfrf.kernel.status import OnSingular
from jointfrf.laws.law_joint import Connection

__all__ = ["connect", "connection_forces", "connection_matrix"]


def connection_matrix(
    h: ComplexArray, link: Connection, freq_hz: FloatArray | None = None, on_singular: OnSingular = "raise"
) -> ComplexArray:
    """Return W of Y = H - H E W E^T H: forces of connections by the free motions across them.

    Parameters
    ----------
    h : ndarray, shape (n_freq, m, m)
        Receptances of the structures before they are connected, m/N.
    link : Connection
        S f = T u with q motions u = E^T x.

    Returns
    -------
    ndarray, shape (n_freq, q, q)
        (S + T E^T H E)^-1 T, N/m; S = 0 leaves the dual form of a constraint, S = 1 the form of a modification (2.35).
    """
    e = link.pattern
    return connection_forces(e.T @ h @ e, link, freq_hz, on_singular)


def connection_forces(
    between: ComplexArray, link: Connection, freq_hz: FloatArray | None = None, on_singular: OnSingular = "raise"
) -> ComplexArray:
    """Return W of `connection_matrix` from the receptances E^T H E across the connections, shape (n_freq, q, q)."""
    left = link.s + link.t @ between
    # A constraint and a stiffness have rows of very different size.
    size = abs(left).max(axis=2, keepdims=True)
    size[size == 0] = 1
    return solve(left / size, link.t / size, freq_hz=freq_hz, on_singular=on_singular)


def connect(
    h: ComplexArray, link: Connection, freq_hz: FloatArray | None = None, on_singular: OnSingular = "raise"
) -> ComplexArray:
    """Return the receptances with the connections, shape (n_freq, m, m)."""
    e = link.pattern
    w = connection_matrix(h, link, freq_hz, on_singular)
    connected: ComplexArray = h - (h @ e) @ w @ (e.T @ h)
    return np.ascontiguousarray(connected)
