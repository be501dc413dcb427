"""A joint: stiffness and damping between DOFs of two substructures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from jointfrf._sweep import ComplexArray, FloatArray, as_frequency, as_real

__all__ = ["Joint"]


def _as_matrix(name: str, value: ArrayLike, n: int | None) -> FloatArray:
    array = np.atleast_1d(np.asarray(value))
    if array.ndim == 1:
        return np.diag(as_real(name, array, (n,)))
    return as_real(name, array, (n or len(array), n or len(array)))


@dataclass(frozen=True)
class Joint:
    """Massless joint, K*(w) = K (1 + i eta) + i w C (2.11).

    Parameters
    ----------
    stiffness : array_like, shape (n,) or (n, n)
        Stiffness of each DOF, or the full matrix; N/m, rotational N m/rad.
    damping : array_like, shape (n,) or (n, n), optional
        Viscous damping, N s/m, rotational N m s/rad.
    dofs : sequence of str, optional
        Names of the DOFs.
    loss_factor : float or array_like, shape (n,)
        Hysteretic loss factor eta of each DOF.

    Raises
    ------
    ValueError
        Shapes that do not agree, NaN or Inf.

    Examples
    --------
    >>> import jointfrf as jf
    >>> joint = jf.Joint([6e5, 5e3], [20, 1.5], dofs=["y", "theta"])
    >>> joint.dynamic_stiffness([0.0])[0].real.tolist()
    [[600000.0, 0.0], [0.0, 5000.0]]
    """

    stiffness: FloatArray
    damping: FloatArray = field(default_factory=lambda: np.zeros(0))
    dofs: tuple[str, ...] = ()
    loss_factor: FloatArray = field(default_factory=lambda: np.zeros(1))

    def __init__(
        self,
        stiffness: ArrayLike,
        damping: ArrayLike | None = None,
        dofs: Sequence[str] | None = None,
        loss_factor: ArrayLike = 0.0,
    ) -> None:
        k = _as_matrix("stiffness", stiffness, None)
        n = len(k)
        names = tuple(str(i) for i in range(n)) if dofs is None else tuple(dofs)
        if len(names) != n or len(set(names)) != n:
            raise ValueError(f"dofs must name {n} different DOFs, not {names}")
        eta = as_real("loss_factor", np.broadcast_to(np.asarray(loss_factor, dtype=np.float64), (n,)), (n,))
        object.__setattr__(self, "stiffness", k)
        object.__setattr__(self, "damping", np.zeros((n, n)) if damping is None else _as_matrix("damping", damping, n))
        object.__setattr__(self, "dofs", names)
        object.__setattr__(self, "loss_factor", eta)

    def dynamic_stiffness(self, freq_hz: ArrayLike) -> ComplexArray:
        """Complex joint stiffness K*(w).

        Parameters
        ----------
        freq_hz : array_like, shape (n_freq,)
            Frequencies in Hz.

        Returns
        -------
        ndarray, shape (n_freq, n, n)
            N/m, rotational N m/rad.
        """
        freq = as_frequency(freq_hz)
        omega = 2 * np.pi * freq[:, None, None]
        static = self.stiffness * (1 + 1j * np.sqrt(np.outer(self.loss_factor, self.loss_factor)))
        return static + 1j * omega * self.damping
