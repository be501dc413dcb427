"""FRFs between channels, taken to the joint DOFs with the full covariance of their noise."""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import in_pieces
from jointfrf.frf.entry_groups import connected
from jointfrf.identification.manifold.on_manifold import FrfEntries, LineData
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.substructuring.modification import inverse_substructuring

__all__ = ["InterfaceFrfs"]

NumbersT = TypeVar("NumbersT", ComplexArray, FloatArray)
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
    smooth : ndarray, shape (n_freq, q)
        Smooth FRFs between the joint DOFs, m/N: the entries of `FrfEntries`.
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

    @classmethod
    def of(
        cls,
        measured: ComplexArray,
        smooth: ComplexArray,
        variance: FloatArray,
        responses: FloatArray,
        forces: FloatArray,
        reciprocal: bool,
        symmetrised: bool = False,
        response_modes: FloatArray | None = None,
        force_modes: FloatArray | None = None,
    ) -> InterfaceFrfs:
        """Return the same of smooth FRFs of shape (n_freq, 2 n, 2 n); their mean where two are one."""
        entries = FrfEntries.of(len(responses) // 2, reciprocal=reciprocal)
        (kept,) = in_pieces(len(smooth), lambda own: [entries.take(_mean(smooth[own], reciprocal))])
        return cls(measured, kept, variance, responses, forces, reciprocal, symmetrised, response_modes, force_modes)

    @property
    def n(self) -> int:
        """Number of joint DOFs."""
        return int(self.responses.shape[0]) // 2

    @property
    def smooth_gamma(self) -> ComplexArray:
        """Smooth FRFs between the joint DOFs as matrices, shape (n_freq, 2 n, 2 n), m/N."""
        return FrfEntries.of(self.n, reciprocal=self.reciprocal).matrix(self.smooth)

    def gamma(self, h: ComplexArray) -> ComplexArray:
        """Return FRFs between joint DOFs, shape (n_freq, 2 n, 2 n), m/N."""
        return between(self.responses, h, self.forces)

    def line_stiffness(self) -> ComplexArray:
        """Return K*(w) of each line alone, shape (n_freq, n, n), N/m; NaN where it cannot be inverted."""
        h = self.measured
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", IllConditionedWarning)
            (found,) = in_pieces(len(h), lambda own: [inverse_substructuring(self.gamma(h[own]), on_singular="nan")])
        return found

    def on_lines(self, lines: NDArray[np.intp] | slice) -> InterfaceFrfs:
        """Return some of the lines."""
        return self._replace(measured=self.measured[lines], smooth=self.smooth[lines], variance=self.variance[lines])

    def groups(self) -> list[NDArray[np.intp]]:
        """Joint DOFs between which FRFs are zero, to rounding or within their noise, on all lines.

        Each group is a separate problem: where a structure is symmetric, the FRFs between some DOFs vanish.
        """
        n, smooth = self.n, abs(self.smooth_gamma)
        size = np.sqrt(np.einsum("lpp->lp", smooth))
        relative = smooth / (size[:, :, None] * size[:, None, :])
        exact = (relative > _ZERO).any(axis=0)
        noise = between(self.responses**2, self.variance, self.forces**2)
        with np.errstate(invalid="ignore", divide="ignore"):
            seen = smooth**2 > _BELOW_NOISE * noise
        coupled = exact & (seen.mean(axis=0) > 0.02)
        both = coupled[:n, :n] | coupled[:n, n:] | coupled[n:, :n] | coupled[n:, n:]
        label = connected(both)
        return [np.flatnonzero(label == own) for own in dict.fromkeys(label.tolist())]

    def of_dofs(self, dofs: NDArray[np.intp]) -> LineData:
        """Return the entries between some joint DOFs with their whitening."""
        at = np.concatenate([dofs, dofs + self.n])
        t_r, t_f = self.responses[at], self.forces[at]
        entries = FrfEntries.of(len(dofs), reciprocal=self.reciprocal)

        def of_lines(own: slice) -> list[NDArray[Any]]:
            part = self.on_lines(own)
            measured = entries.take(_mean(between(t_r, part.measured, t_f), self.reciprocal))
            inverse_std, whitening = part._weights(entries, t_r, t_f)
            return [measured, inverse_std] if whitening is None else [measured, inverse_std, whitening]

        measured, *weights = in_pieces(len(self.measured), of_lines)
        return LineData(entries, measured, self.smooth_of(dofs), *weights)

    def smooth_of(self, dofs: NDArray[np.intp]) -> ComplexArray:
        """Return the smooth FRFs between some joint DOFs, shape (n_freq, q); what is there where these are all."""
        at = np.concatenate([dofs, dofs + self.n])
        own = FrfEntries.of(len(dofs), reciprocal=self.reciprocal)
        entries = FrfEntries.of(self.n, reciprocal=self.reciprocal).places[at[own.rows], at[own.columns]]
        return self.smooth if np.array_equal(entries, np.arange(self.smooth.shape[1])) else self.smooth.take(entries, 1)

    def entries_of(self, dofs: NDArray[np.intp], gamma: ComplexArray) -> ComplexArray:
        """Return the entries between some joint DOFs, as `of_dofs` does, of FRFs between all, shape (n_freq, q)."""
        at = np.concatenate([dofs, dofs + self.n])
        entries = FrfEntries.of(len(dofs), reciprocal=self.reciprocal)
        return entries.take(_mean(gamma[:, at[:, None], at], self.reciprocal))

    def _weights(self, entries: FrfEntries, t_r: FloatArray, t_f: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return 1/sqrt(variance), and unless every DOF is one channel, the triangles that whiten the correlation."""
        known = np.isfinite(self.variance)
        whole = bool(known.all())
        variance = self.variance if whole else np.where(known, self.variance, 0)
        single = all(
            (np.count_nonzero(t, axis=0) <= 1).all() and (np.count_nonzero(t, axis=1) <= 1).all() for t in (t_r, t_f)
        )
        p, q = entries.rows, entries.columns
        if single:
            of_entry = between(t_r**2, variance, t_f**2)
            unused = (
                np.zeros(of_entry.shape, bool) if whole else between(abs(t_r), (~known).astype(float), abs(t_f)) > 0
            )
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
        dead = ~known.reshape(own.shape) @ (g != 0).T
        total = own @ (g**2).T
        inverse_std = np.where(dead, 0, 1 / np.sqrt(np.where(dead, 1, total)))
        whitening = np.zeros((len(own), len(p), len(p)))
        for block in _blocks(g):
            whitening[:, block[:, None], block] = _whitening(g[block], own, inverse_std[:, block], dead[:, block])
        return inverse_std, whitening


def _mean(gamma: ComplexArray, reciprocal: bool) -> ComplexArray:
    """Return the mean of gamma_pq and gamma_qp where they are one."""
    return (gamma + gamma.swapaxes(1, 2)) / 2 if reciprocal else gamma


def taken(h: NumbersT, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NumbersT:
    """Return rows and columns of every line; what is there where these are all, in order."""
    whole = len(rows) == h.shape[1] and len(columns) == h.shape[2]
    if whole and (np.diff(rows) == 1).all() and (np.diff(columns) == 1).all():
        return h
    return h[:, rows[:, None], columns]


def between(t_r: FloatArray, h: NumbersT, t_f: FloatArray) -> NumbersT:
    """Return T_r h T_f^T of every line; where the rows of both are those of unit matrices, without products."""
    if all(np.count_nonzero(t) == len(t) and (t.max(axis=1) == 1).all() for t in (t_r, t_f)):
        return taken(h, t_r.argmax(axis=1), t_f.argmax(axis=1))
    return t_r @ h @ t_f.T


def _blocks(g: FloatArray) -> list[NDArray[np.intp]]:
    """Entries that share channels: those within a side, and those between the sides."""
    used = (g != 0).astype(float)
    label = connected(used @ used.T > 0)
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
