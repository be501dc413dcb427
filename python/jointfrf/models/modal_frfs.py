"""FRFs of a structure from its modes: poles, scaled shapes, rigid motions, and residuals of all other modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ModalFrfs"]


@dataclass(frozen=True, eq=False)
class ModalFrfs:
    """Modes of a structure between n DOFs, in SI units.

    Attributes
    ----------
    dofs : tuple of str, length n
    poles : ndarray, shape (m,)
        s of the upper half plane, rad/s.
    shapes : ndarray, shape (n, m)
        psi, scaled so that the residues are psi psi^T.
    rigid : ndarray, shape (n, k)
        Motions at 0 Hz, phi / sqrt(modal mass).
    lower, upper : ndarray, shape (n, n)
        Residuals L and U of modes below and above the band, N^-1 m s^-2 and m/N.

    Notes
    -----
    H = sum_r psi_r psi_r^T / (i w - s_r) + the same of complex conjugates - (phi phi^T + L) / w^2 + U.
    """

    dofs: tuple[str, ...]
    poles: ComplexArray
    shapes: ComplexArray
    rigid: FloatArray
    lower: FloatArray
    upper: FloatArray

    def receptance(self, freq_hz: FloatArray, at: Sequence[int]) -> ComplexArray:
        """Return the receptances between DOFs, counted from 0, on lines above 0 Hz; shape (n_freq, m, m), m/N."""
        omega = 2 * np.pi * freq_hz[:, None]
        own = np.asarray(at, np.intp)
        h = np.zeros((freq_hz.size, own.size, own.size), np.complex128)
        for poles, shapes in ((self.poles, self.shapes[own]), (self.poles.conj(), self.shapes[own].conj())):
            h += np.einsum("pm,fm,qm->fpq", shapes, 1 / (1j * omega - poles), shapes, optimize=True)
        low = self.rigid[own] @ self.rigid[own].T + self.lower[np.ix_(own, own)]
        return h - low / omega[:, :, None] ** 2 + self.upper[np.ix_(own, own)]

    def with_residuals(self, freq_hz: FloatArray, h: ComplexArray, at: Sequence[int]) -> ModalFrfs:
        """Return the same with L and U of measured FRFs, by least squares of relative errors.

        Parameters
        ----------
        freq_hz : ndarray, shape (n_freq,)
            Above 0 Hz.
        h : ndarray, shape (n_freq, k, k)
            Receptances, m/N; NaN where nothing was measured: then h_qp stands for h_pq, or there are no residuals.
        at : sequence of int
            Their DOFs.
        """
        lower, upper = self.lower.copy(), self.upper.copy()
        left = h - self.receptance(freq_hz, at)
        terms = np.stack([-1 / (2 * np.pi * freq_hz) ** 2, np.ones(freq_hz.size)], axis=1)
        for p, a in enumerate(at):
            for q, b in enumerate(at[: p + 1]):
                found = [(left[:, i, j], abs(h[:, i, j])) for i, j in {(p, q), (q, p)} if np.isfinite(h[:, i, j]).all()]
                if not found:
                    continue
                rows = np.concatenate([terms / size[:, None] for _, size in found])
                sides = np.concatenate([own.real / size for own, size in found])
                scale = np.linalg.norm(rows, axis=0)
                low, high = np.linalg.lstsq(rows / scale, sides, rcond=None)[0] / scale
                lower[a, b] = lower[b, a] = self.lower[a, b] + low
                upper[a, b] = upper[b, a] = self.upper[a, b] + high
        return replace(self, lower=lower, upper=upper)
