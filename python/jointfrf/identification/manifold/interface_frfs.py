"""FRFs between channels, converted to the joint DOFs with the full covariance of their noise."""

from __future__ import annotations

import warnings
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import in_pieces, spread_lines
from jointfrf.frf.entry_groups import connected
from jointfrf.frf.quantiles import medians
from jointfrf.identification.manifold.on_manifold import FrfEntries, LineData
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.substructuring.modification import inverse_substructuring

__all__ = ["InterfaceFrfs", "direction_share", "mean_of_directions"]

NumbersT = TypeVar("NumbersT", ComplexArray, FloatArray)
#: A smooth FRF below this share of sqrt|h_pp h_qq| and of its own noise is zero by symmetry.
_ZERO = 1e-8
_BELOW_NOISE = 1.0
#: Weight of the square of a model error in the variance of a line: it is the same error on all lines, and so counts for
#: more than noise does. By trial on simulated pairs: 1 to 10 are nearly as good.
_ERRORS = 3.0
#: Least part of the variance of an entry that remains if all further entries are known.
_OWN_NOISE = 1e-9


class InterfaceFrfs(NamedTuple):
    """FRFs of channels with their noise, and their conversion to joint DOFs: gamma = T_r h T_f^T.

    Attributes
    ----------
    measured : ndarray, shape (n_freq, m_r, m_f)
        Measured FRFs between the channels, m/N.
    smooth : ndarray, shape (n_freq, q)
        Smooth FRFs between the joint DOFs, m/N: the entries of `FrfEntries`.
    variance : ndarray, shape (n_freq, m_r, m_f)
        Noise variance E|e|^2 of the measured FRFs, (m/N)^2; inf if one is not used.
    responses, forces : ndarray, shapes (2 n, m_r), (2 n, m_f)
        Matrices from channels to joint DOFs j, then k.
    reciprocal : bool
        Whether gamma_pq and gamma_qp are equal.
    symmetrised : bool
        Whether h_pq and h_qp are one measurement, because the FRFs were made reciprocal before.
    response_modes, force_modes : ndarray, shapes (m_r, 2 n), (m_f, 2 n), optional
        Motion of the channels for a unit of each joint DOF if the sides are rigid; None if it is not known.
    errors : ndarray, shape (n_freq, e, q), optional
        Change of the FRFs between the joint DOFs by each error of the correcting models, one standard deviation, m/N.
    noise_paths : pair of ndarray, shapes (n_freq, 2 n, m_r), (n_freq, 2 n, m_f), optional
        Matrices from noise of the channels to noise of FRFs that models have corrected, in place of `responses` and
        `forces`.
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
    errors: ComplexArray | None = None
    noise_paths: tuple[ComplexArray, ComplexArray] | None = None

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
        *,
        errors: ComplexArray | None = None,
        **more: Any,
    ) -> InterfaceFrfs:
        """Return the same of smooth FRFs of shape (n_freq, 2 n, 2 n), and errors of (n_freq, e, 2 n, 2 n)."""
        entries = FrfEntries.of(len(responses) // 2, reciprocal=reciprocal)
        (kept,) = in_pieces(len(smooth), lambda own: [entries.take(_mean(smooth[own], reciprocal))])
        if errors is not None:
            errors = entries.take(_mean(errors, reciprocal))
        return cls(measured, kept, variance, responses, forces, reciprocal, symmetrised, errors=errors, **more)

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
        """Return K*(w) of each line alone, shape (n_freq, n, n), N/m; NaN if it cannot be inverted."""
        h = self.measured
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", IllConditionedWarning)
            (found,) = in_pieces(len(h), lambda own: [inverse_substructuring(self.gamma(h[own]), on_singular="nan")])
        return found

    def on_lines(self, lines: NDArray[np.intp] | slice) -> InterfaceFrfs:
        """Return some of the lines."""
        found = self._replace(measured=self.measured[lines], smooth=self.smooth[lines], variance=self.variance[lines])
        if self.errors is not None:
            found = found._replace(errors=self.errors[lines])
        if self.noise_paths is not None:
            found = found._replace(noise_paths=(self.noise_paths[0][lines], self.noise_paths[1][lines]))
        return found

    def without(self, variance: FloatArray) -> InterfaceFrfs:
        """Return the same without a part of the variance."""
        with np.errstate(invalid="ignore"):
            rest = self.variance - variance
        return self._replace(variance=np.where(np.isfinite(self.variance), rest, np.inf))

    def groups(self) -> list[NDArray[np.intp]]:
        """Joint DOFs between which FRFs are zero, to rounding or within their noise, on all lines.

        Each group is a separate problem: in a symmetric structure, the FRFs between some DOFs vanish.
        """
        n, smooth = self.n, self.smooth_gamma
        squares = smooth.real**2 + smooth.imag**2
        own = np.einsum("lpp->lp", squares)
        exact = (squares > _ZERO**2 * np.sqrt(own[:, :, None] * own[:, None, :])).any(axis=0)
        noise = between(self.responses**2, self.variance, self.forces**2)
        with np.errstate(invalid="ignore"):
            seen = squares > _BELOW_NOISE * noise
        coupled = exact & (seen.mean(axis=0) > 0.02)
        both = coupled[:n, :n] | coupled[:n, n:] | coupled[n:, :n] | coupled[n:, n:]
        label = connected(both)
        return [np.flatnonzero(label == own) for own in dict.fromkeys(label.tolist())]

    def of_dofs(self, dofs: NDArray[np.intp]) -> LineData:
        """Return the entries between some joint DOFs with their whitening."""
        at = np.concatenate([dofs, dofs + self.n])
        entries = FrfEntries.of(len(dofs), reciprocal=self.reciprocal)
        frfs = self if self.noise_paths is not None else self._with_channels_of(at)
        t_r, t_f = frfs.responses[at], frfs.forces[at]
        share = None
        # Shares by channel do not commute with models of the sides, which mix noise of channels: the shares of h_pq and
        # h_qp are then a half.
        is_square = np.array_equal(self.responses, self.forces)
        if self.reciprocal and not self.symmetrised and is_square and self.noise_paths is None:
            share = direction_share(frfs.variance)

        def of_lines(own: slice) -> list[NDArray[Any]]:
            part = frfs.on_lines(own)
            part = part if share is None else part._made_reciprocal(share)
            measured = entries.take(_mean(between(t_r, part.measured, t_f), self.reciprocal))
            if part.noise_paths is None:
                inverse_std, whitening = part._weights(entries, t_r, t_f)
            else:
                inverse_std, whitening = part._corrected_weights(entries, at, part.errors_of(dofs))
            return [measured, inverse_std] if whitening is None else [measured, inverse_std, whitening]

        measured, *weights = in_pieces(len(self.measured), of_lines)
        return LineData(entries, measured, self.smooth_of(dofs), *weights)

    def _with_channels_of(self, at: NDArray[np.intp]) -> InterfaceFrfs:
        """Return the same without channels that some joint DOFs do not use; the object itself if they use all."""
        rows, columns = (np.flatnonzero(t[at].any(axis=0)) for t in (self.responses, self.forces))
        if (rows.size, columns.size) == self.measured.shape[1:]:
            return self
        return self._replace(
            measured=taken(self.measured, rows, columns), variance=taken(self.variance, rows, columns),
            responses=self.responses[:, rows], forces=self.forces[:, columns],
        )  # fmt: skip

    def smooth_of(self, dofs: NDArray[np.intp]) -> ComplexArray:
        """Return the smooth FRFs between some joint DOFs, shape (n_freq, q); without a copy if these are all."""
        entries = self._places_of(dofs)
        return self.smooth if np.array_equal(entries, np.arange(self.smooth.shape[1])) else self.smooth.take(entries, 1)

    def errors_of(self, dofs: NDArray[np.intp]) -> ComplexArray | None:
        """Return the errors of FRFs between some joint DOFs, shape (n_freq, e, q); None if there are none."""
        return None if self.errors is None else self.errors.take(self._places_of(dofs), 2)

    def _places_of(self, dofs: NDArray[np.intp]) -> NDArray[np.intp]:
        """Return the numbers of the entries between some joint DOFs."""
        at = np.concatenate([dofs, dofs + self.n])
        own = FrfEntries.of(len(dofs), reciprocal=self.reciprocal)
        places: NDArray[np.intp] = FrfEntries.of(self.n, reciprocal=self.reciprocal).places
        return np.asarray(places[at[own.rows], at[own.columns]])

    def entries_of(self, dofs: NDArray[np.intp], gamma: ComplexArray) -> ComplexArray:
        """Return the entries between some joint DOFs, as `of_dofs` does, of FRFs between all, shape (n_freq, q)."""
        at = np.concatenate([dofs, dofs + self.n])
        entries = FrfEntries.of(len(dofs), reciprocal=self.reciprocal)
        return entries.take(_mean(gamma[:, at[:, None], at], self.reciprocal))

    def _made_reciprocal(self, share: FloatArray) -> InterfaceFrfs:
        """Return the same with the means of h_pq and h_qp, one measurement each; not used if one is not used."""
        known = np.isfinite(self.variance)
        own = np.where(known, share**2 * np.where(known, self.variance, 0), np.inf)
        diagonal = np.eye(len(share), dtype=bool)
        return self._replace(
            measured=mean_of_directions(self.measured, share),
            variance=np.where(diagonal, self.variance, own + own.swapaxes(1, 2)),
            symmetrised=True,
        )

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
            return _inverse_root(total, dead), None
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
        dead = np.zeros((len(own), len(p)), bool)
        if not whole:
            dead = (~known.reshape(own.shape)).astype(float) @ (g != 0).T > 0
        total = own @ (g**2).T
        inverse_std = _inverse_root(total, dead)
        whitening = np.zeros((len(own), len(p), len(p)))
        for block in _blocks(g):
            whitening[:, block[:, None], block] = _whitening(g[block], own, inverse_std[:, block], dead[:, block])
        return inverse_std, whitening

    def _corrected_weights(
        self, entries: FrfEntries, at: NDArray[np.intp], errors: ComplexArray | None
    ) -> tuple[FloatArray, FloatArray]:
        """Return the same of FRFs that models have corrected: every entry has noise of all channels of a side."""
        assert self.noise_paths is not None
        known = np.isfinite(self.variance)
        std = np.sqrt(np.where(known, self.variance, 0))
        (t_r, t_f), n = (path[:, at] for path in self.noise_paths), entries.n
        whitening = np.zeros((len(std), entries.rows.size, entries.rows.size))
        inverse_std = np.zeros(whitening.shape[:2])
        sides = entries.rows // n + entries.columns // n
        for block in (np.flatnonzero(sides == one) for one in np.unique(sides)):
            p, q = entries.rows[block], entries.columns[block]
            # Entry i is a sum over pairs of channels h_ab, over those that enter the block at all.
            ways = [(p, q), (q, p)] if self.reciprocal else [(p, q)]
            used = [((t_r[:, i] != 0).any(axis=0), (t_f[:, k] != 0).any(axis=0)) for i, k in ways]
            pairs = np.any([(own[:, :, None] & other[:, None]).any(axis=0) for own, other in used], axis=0)
            if self.symmetrised:
                pairs = np.triu(pairs | pairs.T)
            a, b = np.nonzero(pairs)
            of_channels = _mean_product(t_r, t_f, ways, (a, b))
            if self.symmetrised:
                of_channels += np.where(a < b, _mean_product(t_r, t_f, ways, (b, a)), 0)
            dead = ((of_channels != 0) & ~known[:, None, a, b]).any(axis=2)
            weighted = of_channels * std[:, None, a, b]
            parts = np.concatenate([weighted.real, weighted.imag], axis=2)
            covariance: FloatArray = parts @ parts.swapaxes(1, 2)
            if errors is not None:
                # Real and imaginary part are separate directions, so that the covariance stays real.
                own = np.concatenate([errors.real, errors.imag], axis=1)[:, :, block]
                covariance += _ERRORS * own.swapaxes(1, 2) @ own
            total = np.einsum("lqq->lq", covariance)
            dead |= ~(total > 0)
            inverse_std[:, block] = _inverse_root(total, dead)
            size = inverse_std[:, block]
            covariance *= size[:, :, None] * size[:, None, :]
            whitening[:, block[:, None], block] = _triangles(covariance, dead)
        return inverse_std, whitening


def _mean_product(
    t_r: ComplexArray,
    t_f: ComplexArray,
    ways: list[tuple[NDArray[np.intp], NDArray[np.intp]]],
    pairs: tuple[NDArray[np.intp], NDArray[np.intp]],
) -> ComplexArray:
    """Return the mean contribution of pairs of channels to entries, over the paths to them, (n_freq, q, n_pairs)."""
    total: ComplexArray = np.sum([t_r[:, p][:, :, pairs[0]] * t_f[:, q][:, :, pairs[1]] for p, q in ways], axis=0)
    return total / len(ways)


def direction_share(variance: FloatArray) -> FloatArray:
    """Return the share of h_pq in the mean of h_pq and h_qp, by their variances E|e|^2, shape (m, m).

    It is the same on all lines, because variances that follow measured FRFs would favour the smaller one of each line.
    """
    some = variance[spread_lines(len(variance))]
    with np.errstate(invalid="ignore", divide="ignore"):
        share = some.swapaxes(1, 2) / (some + some.swapaxes(1, 2))
    of_entries = medians(np.where(np.isfinite(share), share, 0.5).T).T
    return np.asarray(of_entries / (of_entries + of_entries.T))


def mean_of_directions(h: ComplexArray, share: FloatArray) -> ComplexArray:
    """Return the mean of h_pq and h_qp, h_pq with this share, shape (n_freq, m, m)."""
    own = share * h
    mean: ComplexArray = own + own.swapaxes(1, 2)
    return mean


def _mean(gamma: ComplexArray, reciprocal: bool) -> ComplexArray:
    """Return the mean of gamma_pq and gamma_qp if they are equal."""
    return (gamma + gamma.swapaxes(-2, -1)) / 2 if reciprocal else gamma


def taken(h: NumbersT, rows: NDArray[np.intp], columns: NDArray[np.intp]) -> NumbersT:
    """Return rows and columns of every line; without a copy if these are all, in order."""
    whole = len(rows) == h.shape[1] and len(columns) == h.shape[2]
    if whole and (np.diff(rows) == 1).all() and (np.diff(columns) == 1).all():
        return h
    return h[:, rows[:, None], columns]


def between(t_r: FloatArray, h: NumbersT, t_f: FloatArray) -> NumbersT:
    """Return T_r h T_f^T of every line; without products if all rows of both are rows of unit matrices."""
    if all(np.count_nonzero(t) == len(t) and (t.max(axis=1) == 1).all() for t in (t_r, t_f)):
        return taken(h, t_r.argmax(axis=1), t_f.argmax(axis=1))
    return t_r @ h @ t_f.T


def _inverse_root(variance: FloatArray, dead: NDArray[np.bool_]) -> FloatArray:
    """Return one over the standard deviation, 0 for dead entries."""
    return np.asarray(np.where(dead, 0, 1 / np.sqrt(np.where(dead, 1, variance))))


def _blocks(g: FloatArray) -> list[NDArray[np.intp]]:
    """Return groups of entries that share channels: within a side, and between the sides."""
    used = (g != 0).astype(float)
    label = connected(used @ used.T > 0)
    return [np.flatnonzero(label == one) for one in range(label.max() + 1)]


def _whitening(g: FloatArray, variance: FloatArray, inverse_std: FloatArray, dead: NDArray[np.bool_]) -> FloatArray:
    """Return the triangles that whiten entries sum_c G_ic h_c, shape (n_freq, q, q)."""
    seen = np.flatnonzero(g.any(axis=0))
    # All lines in one product: the entries are few, so that each pair of them has its row.
    pairs = (g[:, None, seen] * g[:, seen]).reshape(-1, seen.size)
    covariance = (variance[:, seen] @ pairs.T).reshape(-1, len(g), len(g))
    covariance *= inverse_std[:, :, None]
    covariance *= inverse_std[:, None, :]
    return _triangles(covariance, dead)


def _triangles(covariance: FloatArray, dead: NDArray[np.bool_]) -> FloatArray:
    """Return the inverse of the triangles of covariances of unit variance, which may be overwritten."""
    n = covariance.shape[1]
    # DOFs that share all channels may leave an entry without independent noise.
    covariance[:, range(n), range(n)] += dead + _OWN_NOISE
    inverse: FloatArray = np.linalg.inv(np.linalg.cholesky(covariance))
    return inverse
