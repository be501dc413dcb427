"""Joint parameters from noisy interface FRFs by maximum likelihood in the compliance domain.

The unknowns are the parameters of the joint and, on every line, the true FRFs. The joint is what ties the FRFs of a
line together: C(h) = K*(w)^-1, n^2 complex equations. Linearised about an estimate of the true FRFs this is a
generalised least-squares problem with the full covariance of C; its residual corrects the FRFs, and so on until
nothing moves. Without noise the fixed point is exact; with noise it reaches the Cramer-Rao bound of an unknown
structure around the joint (tests/python/test_estimator.py).

Everything has a leading axis over realisations, so that a Monte Carlo study is one call.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf._sweep import ComplexArray, FloatArray
from jointfrf.compliance import compliance_covariance, compliance_factors, joint_compliance
from jointfrf.linear_algebra import invert

__all__ = [
    "Basis",
    "ComplianceEstimate",
    "Cross",
    "Damping",
    "estimate",
    "jackknife_covariance",
    "joint_basis",
    "neighbour_mean",
    "reciprocity_noise",
]

Damping = Literal["none", "viscous", "hysteretic", "both"]
Cross = Literal["zero", "ignore", "fit"]

#: The first linearisation uses the mean of this many lines on either side, without the line itself: weights must not
#: follow the noise they weigh.
_NEIGHBOURS = 2
#: Beyond this share of the size of a rigid joint, or below zero, a parameter may have run off.
_RAN_OFF = 1e-8
#: A line is left out where the relative noise of gamma_jk, which has to be inverted, exceeds this: first order ends
#: there.
_LOST = 0.35
_OUTER, _INNER = 40, 60
_SMALL_STEP = 1e-3
#: A stiffness stops growing when its compliance is this share of the error that 100 % noise would leave.
_RIGID = 1e-9
#: From this linearisation on, FRFs move half way: lines with little more signal than noise would swing for long.
_FULL_STEPS = 4
#: Converged when no parameter moves by more than `tolerance` standard errors, or by this share of its value.
_SHARE_OF_VALUE = 1e-11


class Basis(NamedTuple):
    """K*(w) as a sum of parameters times matrices.

    Attributes
    ----------
    names : tuple of str
        ``"k_<dof>"`` stiffness, ``"h_<dof>"`` hysteretic stiffness eta k, ``"c_<dof>"`` viscous damping;
        ``"k_<dof>,<dof>"`` for cross terms.
    matrices : ndarray, shape (n_parameters, n_freq, n, n)
        Matrix of each parameter.
    """

    names: tuple[str, ...]
    matrices: ComplexArray


def joint_basis(omega: FloatArray, dofs: Sequence[str], damping: Damping, cross: Cross) -> Basis:
    """Matrices of K*(w) = k + i h + i w c for the terms asked for; symmetric cross terms where `cross` is "fit"."""
    n = len(dofs)
    factors: dict[str, NDArray[np.complexfloating]] = {"k": np.ones(omega.size, np.complex128)}
    if damping in ("hysteretic", "both"):
        factors["h"] = np.full(omega.size, 1j)
    if damping in ("viscous", "both"):
        factors["c"] = 1j * omega
    pairs = [(a, a) for a in range(n)]
    if cross == "fit":
        pairs += [(a, b) for a in range(n) for b in range(a + 1, n)]
    names, matrices = [], []
    for letter, factor in factors.items():
        for a, b in pairs:
            unit = np.zeros((n, n))
            unit[a, b] = unit[b, a] = 1
            names.append(f"{letter}_{dofs[a]}" if a == b else f"{letter}_{dofs[a]},{dofs[b]}")
            matrices.append(factor[:, None, None] * unit)
    return Basis(tuple(names), np.array(matrices))


class ComplianceEstimate(NamedTuple):
    """Result of `estimate`, with a leading axis over realisations r.

    Attributes
    ----------
    theta : ndarray, shape (r, p)
        Parameters in the order of the basis.
    covariance : ndarray, shape (r, p, p)
        Their covariance for unit noise level: times level^2.
    residual_level : ndarray, shape (r,)
        Noise level that the residual shows.
    off_diagonal : ndarray, shape (r,)
        Noise level that the entries of C beside the diagonal show, or NaN where they are not used.
    equations : int
        Complex equations used: entries of C on lines that are not left out.
    lost : ndarray of bool, shape (n_freq,)
        Lines on which gamma_jk, which has to be inverted, is lost in noise.
    left_out : bool
        Whether these lines are left out; they are not where too few would remain.
    iterations : int
        Linearisations done.
    converged : ndarray of bool, shape (r,)
        Whether the parameters stopped moving.
    line_gradient : ndarray, shape (r, n_used, p)
        What each line that is not left out pulls at the parameters, at unit noise level; sums to zero.
    line_information : ndarray, shape (r, n_used, p, p)
        What each of them knows of the parameters.
    """

    theta: FloatArray
    covariance: FloatArray
    residual_level: FloatArray
    off_diagonal: FloatArray
    equations: int
    lost: NDArray[np.bool_]
    left_out: bool
    iterations: int
    converged: NDArray[np.bool_]
    line_gradient: FloatArray
    line_information: FloatArray


def reciprocity_noise(h: ComplexArray) -> FloatArray:
    """Relative noise level from the differences h_pq - h_qp, robustly: shape (r,), 0 where h is reciprocal.

    For circular noise of level s, |h_pq - h_qp|^2 / (|h_pq|^2 + |h_qp|^2) is s^2 times an exponential variable, whose
    median is log 2. A median does not see a few bad FRFs.
    """
    m = h.shape[-1]
    p, q = np.triu_indices(m, 1)
    above, below = h[..., p, q], h[..., q, p]
    size = abs(above) ** 2 + abs(below) ** 2
    with np.errstate(invalid="ignore"):
        ratio = abs(above - below) ** 2 / size
    level: FloatArray = np.sqrt(np.nanmedian(ratio.reshape(h.shape[0], -1), axis=1) / np.log(2))
    return level


def estimate(
    h: ComplexArray,
    transform: FloatArray,
    basis: Basis,
    *,
    variance: FloatArray | None = None,
    reciprocal: bool = True,
    cross: Cross = "zero",
    used: NDArray[np.bool_] | None = None,
    near: ComplexArray | None = None,
    level: FloatArray | None = None,
    tolerance: float = 0.05,
) -> ComplianceEstimate:
    """Maximum-likelihood parameters of a joint.

    Parameters
    ----------
    h : ndarray, shape (r, n_freq, m, m)
        Measured FRFs, m/N.
    transform : ndarray, shape (2 n, m)
        From measured points to joint DOFs j, then k.
    basis : Basis
        Terms of K*(w).
    variance : ndarray, shape (n_freq, m, m), optional
        E|e|^2 of the measured FRFs for unit level, (m/N)^2; by default noise relative to each entry, |h|^2.
    reciprocal : bool
        Make h reciprocal first.
    cross : {"zero", "ignore", "fit"}
        What the entries of C beside its diagonal say: they are zero; nothing; they belong to the terms of the basis.
    used : ndarray of bool, shape (n_freq, n), optional
        Lines used for each DOF; all by default.
    near : ndarray, shape (r, n_freq, m, m), optional
        FRFs about which is linearised first; by default the mean of the neighbouring lines of `h`, which must then be
        neighbours in frequency.
    level : ndarray, shape (r,), optional
        Noise level, to judge convergence and lost lines; by default from the residual and from reciprocity.
    tolerance : float
        Share of its standard error by which a parameter may still move when the iteration stops.

    Returns
    -------
    ComplianceEstimate
    """
    n = transform.shape[0] // 2
    measured, true = h, neighbour_mean(h) if near is None else near
    if reciprocal:
        measured, true = ((x + x.swapaxes(-1, -2)) / 2 for x in (measured, true))
    lost = _lost_lines(measured, transform, _level_of(h, level, variance), variance)
    left_out = bool(lost.any() and np.count_nonzero(~lost) >= max(2, len(basis.names)))
    if left_out:
        kept = np.flatnonzero(~lost)
        measured, true, basis = measured[:, kept], true[:, kept], Basis(basis.names, basis.matrices[:, kept])
        variance = None if variance is None else variance[kept]
        used = None if used is None else used[kept]
    r, n_freq = measured.shape[:2]
    chosen = np.arange(n) * (n + 1) if cross == "ignore" else np.arange(n * n)
    lines = (r * n_freq,)

    def sweep(array: ComplexArray) -> ComplexArray:
        return array.reshape(lines + array.shape[2:])

    blocked = _blocked(used, n_freq, n)[:, chosen]
    model = _JointModel(basis, chosen)
    theta: FloatArray | None = None
    converged = np.zeros(r, bool)
    step = 0
    for step in range(1, _OUTER + 1):
        gamma = transform @ sweep(true) @ transform.T
        u, v = compliance_factors(gamma, transform)
        at_true = joint_compliance(gamma)
        spread = abs(sweep(true)) ** 2 if variance is None else np.tile(variance, (r, 1, 1))
        covariance = compliance_covariance(gamma, spread, transform, reciprocal=reciprocal)
        covariance = covariance[:, chosen[:, None], chosen]
        linear = (at_true + u @ sweep(measured - true) @ v).reshape(r, n_freq, n * n)[..., chosen]
        weight = _weights(covariance.reshape(r, n_freq, chosen.size, chosen.size), blocked)
        if theta is None:
            theta, limit = _linear_start(linear, weight, basis, chosen, n)
            starts = [_mean_start(linear, weight, theta.shape, chosen, n), theta]
            theta = _from_starts(starts, limit, linear, weight, model)
        before = theta
        theta, information, residual = _gauss_newton(theta, limit, linear, weight, model)
        scatter = _inverse(2 * information)

        # The residual moves the FRFs: dh = S J^H W r, with J dh = U dh V.
        pull = np.zeros((r, n_freq, n * n), np.complex128)
        pull[..., chosen] = (weight @ residual[..., None])[..., 0]
        back = u.conj().swapaxes(1, 2) @ sweep(pull.reshape(r, n_freq, n, n)) @ v.conj().swapaxes(1, 2)
        if reciprocal:
            back = (back + back.swapaxes(1, 2)) / 2
        corrected = measured - (spread * back).reshape(measured.shape)
        if reciprocal:
            corrected = (corrected + corrected.swapaxes(-1, -2)) / 2
        true = corrected if step < _FULL_STEPS else (corrected + true) / 2

        own = np.sqrt(_power(residual, weight, blocked, basis) if level is None else level**2)
        error = np.sqrt(np.einsum("raa->ra", scatter)) * own[:, None]
        moved = abs(theta - before)
        converged = (moved <= tolerance * error + _SHARE_OF_VALUE * abs(theta)).all(axis=1)
        if step > 1 and converged.all():
            break

    off = np.full(r, np.nan)
    if cross == "zero" and n > 1:
        beside = np.flatnonzero(chosen % (n + 1))
        part = covariance.reshape(r, n_freq, chosen.size, chosen.size)[..., beside[:, None], beside]
        off = np.sqrt(_power(residual[..., beside], _weights(part, blocked[:, beside]), blocked[:, beside], None))
    assert theta is not None
    slope = model.slope(model.compliance(theta))
    weighted = (weight @ slope).conj().swapaxes(-1, -2)
    return ComplianceEstimate(
        theta=theta,
        covariance=scatter,
        residual_level=np.sqrt(_power(residual, weight, blocked, basis)),
        off_diagonal=off,
        equations=int(np.count_nonzero(~blocked)),
        lost=lost,
        left_out=left_out,
        iterations=step,
        converged=converged,
        line_gradient=2 * (weighted @ residual[..., None]).real[..., 0],
        line_information=2 * (weighted @ slope).real,
    )


def jackknife_covariance(found: ComplianceEstimate, blocks: int = 10) -> FloatArray:
    """Covariance of the parameters from leaving out one block of neighbouring lines after the other.

    It needs no noise level and also sees what the model of the joint cannot follow over frequency. To first order, by
    one Gauss-Newton step without the block.

    Returns
    -------
    ndarray, shape (r, p, p)
    """
    r, n_freq, p = found.line_gradient.shape
    blocks = min(blocks, n_freq)
    whole = found.line_information.sum(axis=1)
    total = found.line_gradient.sum(axis=1)
    moved = np.empty((blocks, r, p))
    for b, lines in enumerate(np.array_split(np.arange(n_freq), blocks)):
        rest = whole - found.line_information[:, lines].sum(axis=1)
        pull = total - found.line_gradient[:, lines].sum(axis=1)
        moved[b] = (_inverse(rest) @ pull[..., None])[..., 0]
    moved -= moved.mean(axis=0)
    covariance: FloatArray = (blocks - 1) / blocks * np.einsum("bra,brc->rac", moved, moved)
    return covariance


def _level_of(h: ComplexArray, level: FloatArray | None, variance: FloatArray | None) -> FloatArray:
    """Noise level, shape (r,): as given, 1 for given variances, else what reciprocity shows."""
    if level is not None:
        return level
    return reciprocity_noise(h) if variance is None else np.ones(len(h))


def _lost_lines(
    h: ComplexArray, transform: FloatArray, level: FloatArray, variance: FloatArray | None
) -> NDArray[np.bool_]:
    """Lines on which gamma_jk is lost in noise, shape (n_freq,), by the median over realisations.

    The measure is the standard deviation of the diagonal of gamma_jk^-1 dgamma_jk: to be small against 1, whatever the
    units.
    """
    n = transform.shape[0] // 2
    spread = level[:, None, None, None] ** 2 * (abs(h) ** 2 if variance is None else variance)
    gamma_jk = transform[:n] @ h @ transform[n:].T
    inverse = invert(gamma_jk.reshape(-1, n, n), on_singular="nan").reshape(gamma_jk.shape)
    weights = abs(inverse @ transform[:n]) ** 2
    relative = np.einsum("rfap,aq,rfpq->rfa", weights, transform[n:] ** 2, spread, optimize=True)
    lost: NDArray[np.bool_] = ~(np.median(relative.max(axis=2), axis=0) <= _LOST**2)
    return lost


def _blocked(used: NDArray[np.bool_] | None, n_freq: int, n: int) -> NDArray[np.bool_]:
    """Return which entries of C are left out, shape (n_freq, n * n): those of a DOF outside its bands."""
    if used is None:
        return np.zeros((n_freq, n * n), bool)
    return ~(used[:, :, None] & used[:, None, :]).reshape(n_freq, n * n)


def neighbour_mean(h: ComplexArray) -> ComplexArray:
    """Mean of the lines around each line, without itself, shape (r, n_freq, m, m)."""
    n_freq = h.shape[1]
    if n_freq < 2:
        return h
    total = np.zeros_like(h)
    count = np.zeros(n_freq)
    for shift in range(1, min(_NEIGHBOURS, n_freq - 1) + 1):
        total[:, shift:] += h[:, :-shift]
        total[:, :-shift] += h[:, shift:]
        count[shift:] += 1
        count[:-shift] += 1
    return total / count[None, :, None, None]


def _weights(covariance: ComplexArray, blocked: NDArray[np.bool_]) -> ComplexArray:
    """Inverse covariance, zero for the entries left out."""
    q = covariance.shape[-1]
    keep = (~blocked).astype(float)
    masked = covariance * (keep[:, :, None] * keep[:, None, :])
    # An entry left out gets a variance of its own size and no covariance; its row of the inverse is then dropped.
    diagonal = np.einsum("rfqq->rfq", covariance).real * (1 - keep)
    masked = masked + diagonal[..., None] * np.eye(q)
    # Rows of different units are brought to one size before the inversion.
    size = np.sqrt(np.einsum("rfqq->rfq", masked).real)
    size = np.where(size > 0, size, 1)
    scaled = masked / (size[..., :, None] * size[..., None, :])
    inverse = invert(scaled.reshape(-1, q, q)).reshape(covariance.shape)
    weight: ComplexArray = inverse / (size[..., :, None] * size[..., None, :]) * (keep[:, :, None] * keep[:, None, :])
    return weight


def _inverse(information: FloatArray) -> FloatArray:
    """Inverse of information matrices of parameters of very different size; a pseudo-inverse where one is not seen."""
    size = np.sqrt(np.maximum(np.einsum("raa->ra", information), np.finfo(float).tiny))
    outer = size[:, :, None] * size[:, None, :]
    inverse: FloatArray = np.linalg.pinv(information / outer, hermitian=True) / outer
    return inverse


def _power(residual: ComplexArray, weight: ComplexArray, blocked: NDArray[np.bool_], basis: Basis | None) -> FloatArray:
    """Mean squared weighted residual for each complex equation left over, shape (r,)."""
    total = (residual.conj() * (weight @ residual[..., None])[..., 0]).real.sum(axis=(1, 2))
    equations = np.count_nonzero(~blocked) - (0 if basis is None else len(basis.names) / 2)
    power: FloatArray = np.maximum(total, 0) / max(equations, 1)
    return power


def _linear_start(
    linear: ComplexArray, weight: ComplexArray, basis: Basis, chosen: NDArray[np.intp], n: int
) -> tuple[FloatArray, FloatArray]:
    """First parameters, and the size at which a joint is as good as rigid: both of shape (r, p).

    Each DOF by itself, from K*(theta) C = 1 by weighted linear least squares, twice, the second time with the weights
    of the first K*. It finds damping at once, but noise draws it towards zero.
    """
    r = linear.shape[0]
    theta = np.zeros((r, len(basis.names)))
    rigid = np.empty((r, n))
    for d in range(n):
        at = int(np.flatnonzero(chosen == d * (n + 1))[0])
        own = weight[..., at, at].real
        rigid[:, d] = np.sqrt(own.sum(axis=1)) / _RIGID
        terms = np.flatnonzero(abs(basis.matrices[:, :, d, d]).max(axis=1))
        slope = linear[..., at, None] * basis.matrices[terms, :, d, d].T
        scale = np.sqrt((abs(slope) ** 2).sum(axis=1, keepdims=True))
        slope = slope / np.where(scale > 0, scale, 1)
        stiffness = np.ones_like(own)
        for _ in range(2):
            pull = (own / stiffness**2)[..., None] * slope.conj()
            normal = (pull.swapaxes(1, 2) @ slope).real
            found = (np.linalg.pinv(normal, hermitian=True) @ pull.real.sum(axis=1)[..., None])[..., 0]
            theta[:, terms] = found / np.where(scale > 0, scale, 1)[:, 0]
            model = abs(theta[:, terms] @ basis.matrices[terms, :, d, d])
            stiffness = np.maximum(model, 1e-3 * model.max(axis=1, keepdims=True))
            stiffness = np.where(stiffness > 0, stiffness, 1)
    size = abs(basis.matrices).max(axis=1)  # (p, n, n), one pair of entries each
    limit = np.stack(
        [np.sqrt(rigid[:, a] * rigid[:, b]) / entry[a, b] for entry in size for a, b in [np.argwhere(entry)[0]]], axis=1
    )
    return theta, limit


def _mean_start(
    linear: ComplexArray, weight: ComplexArray, shape: tuple[int, ...], chosen: NDArray[np.intp], n: int
) -> FloatArray:
    """Return stiffnesses from the weighted mean of the real compliance of each DOF, everything else zero.

    Noise does not bias it; much damping does.
    """
    theta = np.zeros(shape)
    for d in range(n):
        at = int(np.flatnonzero(chosen == d * (n + 1))[0])
        own = weight[..., at, at].real
        mean = (own * linear[..., at].real).sum(axis=1) / own.sum(axis=1)
        # A compliance lost in noise starts from what the noise would let through.
        theta[:, d] = 1 / np.maximum(mean, 1e-3 / np.sqrt(own.sum(axis=1)))
    return theta


def _from_starts(
    starts: Sequence[FloatArray], limit: FloatArray, linear: ComplexArray, weight: ComplexArray, model: _JointModel
) -> FloatArray:
    """Minimise from the first start; where a parameter runs off towards a rigid joint also from the others.

    Of each realisation the lowest minimum is kept.
    """

    def minimum(start: FloatArray, which: NDArray[np.intp]) -> tuple[FloatArray, FloatArray]:
        theta, _, left = _gauss_newton(start[which], limit[which], linear[which], weight[which], model)
        cost = (left.conj() * (weight[which] @ left[..., None])[..., 0]).real.sum(axis=(1, 2))
        return theta, np.where(np.isfinite(cost), cost, np.inf)

    theta, cost = minimum(starts[0], np.arange(len(linear)))
    ran_off = np.flatnonzero(~((theta >= 0) & (theta < _RAN_OFF * limit)).all(axis=1))
    for start in starts[1:] if ran_off.size else ():
        other, other_cost = minimum(start, ran_off)
        lower = other_cost < cost[ran_off]
        theta[ran_off[lower]] = other[lower]
        cost[ran_off[lower]] = other_cost[lower]
    return theta


class _JointModel:
    """K*(theta)^-1 and its derivatives, by elements where all matrices are diagonal."""

    def __init__(self, basis: Basis, chosen: NDArray[np.intp]) -> None:
        self.basis = basis
        self.n_freq, self.n = basis.matrices.shape[1:3]
        self.chosen = chosen
        diagonals = np.diagonal(basis.matrices, axis1=2, axis2=3)
        beside = basis.matrices - diagonals[..., None] * np.eye(self.n)
        self.diagonals: ComplexArray | None = None if beside.any() else diagonals

    def compliance(self, theta: FloatArray) -> ComplexArray:
        """Return K*^-1: shape (r, n_freq, n) where diagonal, else (r, n_freq, n, n)."""
        if self.diagonals is not None:
            with np.errstate(divide="ignore", invalid="ignore"):
                diagonal: ComplexArray = 1 / np.einsum("rp,pfa->rfa", theta, self.diagonals)
            return diagonal
        k = np.einsum("rp,pfab->rfab", theta, self.basis.matrices, optimize=True)
        return invert(k.reshape(-1, self.n, self.n), on_singular="nan").reshape(k.shape)

    def entries(self, compliance: ComplexArray) -> ComplexArray:
        """Return the chosen entries, shape (r, n_freq, q)."""
        whole = compliance if self.diagonals is None else compliance[..., None] * np.eye(self.n)
        entries: ComplexArray = whole.reshape(*whole.shape[:2], -1)[..., self.chosen]
        return entries

    def slope(self, compliance: ComplexArray) -> ComplexArray:
        """Return the derivatives -C B C of the chosen entries, shape (r, n_freq, q, p)."""
        if self.diagonals is not None:
            columns = [-(compliance**2) * matrix for matrix in self.diagonals]
        else:
            columns = [-(compliance @ matrix @ compliance) for matrix in self.basis.matrices]
        return np.stack([self.entries(column) for column in columns], axis=-1)


def _gauss_newton(
    theta: FloatArray, limit: FloatArray, linear: ComplexArray, weight: ComplexArray, model: _JointModel
) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Minimise the weighted squares of C - K*(theta)^-1; Levenberg's damping where a step fails.

    Returns the parameters, the information matrix Re(J^H W J) and the residual.
    """
    r, n_freq, q = linear.shape
    p = theta.shape[1]
    damping = np.zeros(r)

    def at(parameters: FloatArray) -> tuple[ComplexArray, ComplexArray, FloatArray]:
        compliance = model.compliance(parameters)
        left = linear - model.entries(compliance)
        cost = (left.conj() * (weight @ left[..., None])[..., 0]).real.sum(axis=(1, 2))
        return compliance, left, np.where(np.isfinite(cost), cost, np.inf)

    compliance, residual, cost = at(theta)
    for _ in range(_INNER):
        slope = model.slope(compliance)
        flat = slope.reshape(r, n_freq * q, p)
        weighted = (weight @ slope).conj().reshape(r, n_freq * q, p).swapaxes(1, 2)
        information = (weighted @ flat).real
        gradient = (weighted @ residual.reshape(r, n_freq * q, 1)).real[..., 0]
        size = np.sqrt(np.maximum(np.einsum("raa->ra", information), np.finfo(float).tiny))
        scaled = information / (size[:, :, None] * size[:, None, :]) + damping[:, None, None] * np.eye(p)
        step = (np.linalg.pinv(scaled, hermitian=True) @ (gradient / size)[..., None])[..., 0] / size
        step = np.clip(theta + step, -limit, limit) - theta
        # One standard error is about sqrt(cost / equations) in these units; the next step would be its square.
        small = _SMALL_STEP * np.sqrt(cost / (n_freq * q))[:, None] + _SHARE_OF_VALUE * abs(theta) * size
        settled = (abs(step) * size <= small).all(axis=1)
        compliance_new, residual_new, cost_new = at(theta + step)
        better = cost_new <= cost * (1 + 1e-14)
        damping = np.where(better, damping / 10, np.maximum(10 * damping, 1e-3))
        damping[damping < 1e-6] = 0
        theta = np.where(better[:, None], theta + step, theta)
        compliance = np.where(better.reshape(r, *[1] * (compliance.ndim - 1)), compliance_new, compliance)
        residual = np.where(better[:, None, None], residual_new, residual)
        cost = np.where(better, cost_new, cost)
        if (settled | (damping > 1e8)).all():
            break
    return theta, information, residual
