"""FRFs between channels, taken to the joint DOFs with the full covariance of their noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jointfrf.identification.compliance_fit.manifold import FrfEntries, LineData
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["InterfaceFrfs"]

#: A smooth FRF below this share of sqrt|h_pp h_qq| and of its own noise is zero by symmetry.
_ZERO = 1e-8
_BELOW_NOISE = 1.0
#: Part of its variance that an entry keeps when all others are known.
_OWN_NOISE = 1e-9


class InterfaceFrfs(NamedTuple):
    """FRFs of channels with their noise, and how joint DOFs are made of them: gamma = T_r h T_f^T.

    Attributes
    ----------
    measured : ndarray, shape (n_freq, m_r, m_f)
        Between the channels, m/N.
    smooth : ndarray, shape (n_freq, 2 n, 2 n)
        Smooth FRFs between the joint DOFs, m/N.
    variance : ndarray, shape (n_freq, m_r, m_f)
        E|e|^2 of the measured FRFs, (m/N)^2; inf where one is not used.
    responses, forces : ndarray, shapes (2 n, m_r), (2 n, m_f)
        From channels to joint DOFs j, then k.
    reciprocal : bool
        Whether gamma_pq and gamma_qp are one.
    symmetrised : bool
        Whether h_pq and h_qp are one measurement, as where FRFs were made reciprocal before.
    response_modes, force_modes : ndarray, shapes (m_r, 2 n), (m_f, 2 n), optional
        Motion of the channels for a unit of each joint DOF where the sides are rigid; None where it is not known.
    """

    measured: ComplexArray
    smooth: ComplexArray
    variance: FloatArray
    responses: FloatArray
    forces: FloatArray
    reciprocal: bool
    symmetrised: bool = False
    response_modes: FloatArray | None = None
    force_modes: FloatArray | None = None

    @property
    def n(self) -> int:
        """Number of joint DOFs."""
        return int(self.responses.shape[0]) // 2

    def gamma(self, h: ComplexArray) -> ComplexArray:
        """Return FRFs between joint DOFs, shape (n_freq, 2 n, 2 n), m/N."""
        return self.responses @ h @ self.forces.T

    def on_lines(self, lines: NDArray[np.intp]) -> InterfaceFrfs:
        """Return some of the lines."""
        return self._replace(measured=self.measured[lines], smooth=self.smooth[lines], variance=self.variance[lines])

    def groups(self) -> list[NDArray[np.intp]]:
        """Joint DOFs between which FRFs are zero, to rounding or beside their noise, on all lines.

        Each group is a problem of its own: where a structure is symmetric, the FRFs between some DOFs vanish.
        """
        n = self.n
        size = np.sqrt(abs(np.einsum("lpp->lp", self.smooth)))
        relative = abs(self.smooth) / (size[:, :, None] * size[:, None, :])
        exact = (relative > _ZERO).any(axis=0)
        noise = abs(self.responses) ** 2 @ self.variance @ (abs(self.forces) ** 2).T
        with np.errstate(invalid="ignore", divide="ignore"):
            seen = abs(self.smooth) ** 2 > _BELOW_NOISE * noise
        coupled = exact & (seen.mean(axis=0) > 0.02)
        both = coupled[:n, :n] | coupled[:n, n:] | coupled[n:, :n] | coupled[n:, n:]
        _, label = sparse.csgraph.connected_components(sparse.csr_array(both), directed=False)
        return [np.flatnonzero(label == own) for own in dict.fromkeys(label.tolist())]

    def of_dofs(self, dofs: NDArray[np.intp]) -> LineData:
        """Return the entries between some joint DOFs with their whitening."""
        at = np.concatenate([dofs, dofs + self.n])
        t_r, t_f = self.responses[at], self.forces[at]
        entries = FrfEntries.of(len(dofs), reciprocal=self.reciprocal)
        between = (t_r @ self.measured @ t_f.T, self.smooth[:, at[:, None], at])
        measured, smooth = (entries.take(self._mean(gamma)) for gamma in between)
        return LineData(entries, measured, smooth, *self._weights(entries, t_r, t_f))

    def entries_of(self, dofs: NDArray[np.intp], gamma: ComplexArray) -> ComplexArray:
        """Return the entries between some joint DOFs, as `of_dofs` does, of FRFs between all, shape (n_freq, q)."""
        at = np.concatenate([dofs, dofs + self.n])
        return FrfEntries.of(len(dofs), reciprocal=self.reciprocal).take(self._mean(gamma[:, at[:, None], at]))

    def _mean(self, gamma: ComplexArray) -> ComplexArray:
        return (gamma + gamma.swapaxes(1, 2)) / 2 if self.reciprocal else gamma

    def _weights(self, entries: FrfEntries, t_r: FloatArray, t_f: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return 1/sqrt(variance), and unless every DOF is one channel, the triangles that whiten the correlation."""
        variance = np.where(np.isfinite(self.variance), self.variance, 0)
        single = all(
            (np.count_nonzero(t, axis=0) <= 1).all() and (np.count_nonzero(t, axis=1) <= 1).all() for t in (t_r, t_f)
        )
        p, q = entries.rows, entries.columns
        if single:
            of_entry = t_r**2 @ variance @ (t_f**2).T
            unused = abs(t_r) @ ~np.isfinite(self.variance) @ abs(t_f).T > 0
            total, dead = of_entry[:, p, q], unused[:, p, q]
            if self.reciprocal:
                share = 2 if self.symmetrised else 4
                total = np.where(p == q, total, (total + of_entry[:, q, p]) / share)
                dead = dead | unused[:, q, p]
            dead = dead | (total <= 0)
            return np.where(dead, 0, 1 / np.sqrt(np.where(dead, 1, total))), None
        # Entry i is sum over channels of G_i,ab h_ab.
        of_channels = t_r[p][:, :, None] * t_f[q][:, None, :]
        if self.reciprocal:
            of_channels = (of_channels + t_r[q][:, :, None] * t_f[p][:, None, :]) / 2
        if self.symmetrised:
            m = t_r.shape[1]
            of_channels = np.where(
                np.triu(np.ones((m, m), bool), 1), of_channels + of_channels.swapaxes(1, 2), of_channels
            )
            of_channels = np.triu(of_channels)
        g = of_channels.reshape(len(p), -1)
        own = variance.reshape(len(variance), -1)
        dead = ~np.isfinite(self.variance.reshape(own.shape)) @ (g != 0).T
        total = own @ (g**2).T
        inverse_std = np.where(dead, 0, 1 / np.sqrt(np.where(dead, 1, total)))
        whitening = np.zeros((len(own), len(p), len(p)))
        for block in _blocks(g):
            whitening[:, block[:, None], block] = _whitening(g[block], own, inverse_std[:, block], dead[:, block])
        return inverse_std, whitening


def _blocks(g: FloatArray) -> list[NDArray[np.intp]]:
    """Entries that share channels: those within a side, and those between the sides."""
    shared = sparse.csr_array(g != 0).astype(float)
    _, label = sparse.csgraph.connected_components(shared @ shared.T, directed=False)
    return [np.flatnonzero(label == one) for one in range(label.max() + 1)]


def _whitening(g: FloatArray, variance: FloatArray, inverse_std: FloatArray, dead: NDArray[np.bool_]) -> FloatArray:
    """Return the triangles that whiten entries sum_c G_ic h_c, shape (n_freq, q, q)."""
    seen = np.flatnonzero(g.any(axis=0))
    scaled_g = inverse_std[:, :, None] * g[:, seen]
    covariance = (scaled_g * variance[:, None, seen]) @ scaled_g.swapaxes(1, 2)
    # DOFs made of the same channels may leave an entry without noise of its own.
    covariance[:, range(len(g)), range(len(g))] += dead + _OWN_NOISE
    inverse: FloatArray = np.linalg.inv(np.linalg.cholesky(covariance))
    return inverse
