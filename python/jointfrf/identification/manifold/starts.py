"""Initial coordinates of a joint from the compliance of smooth FRFs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.bands import in_pieces
from jointfrf.identification.manifold.coordinates import DiagonalJoint, SpringJoint, summed_terms
from jointfrf.identification.manifold.line_forms import LineForms
from jointfrf.identification.manifold.on_manifold import LineData
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.call import call
from jointfrf.kernel.linear_algebra import invert
from jointfrf.substructuring.compliance import compliance_covariance, joint_compliance

__all__ = ["first_joints", "hidden_share"]

#: Approximate error of smooth FRFs, as a share of the noise.
_SMOOTH = 0.2
#: Number of lines whose covariance of all entries of C is in memory at once: n^4 numbers a line.
_PIECE = 1024
#: Tolerance of the squares of an initial value.
_ROUGH = 0.1
#: Number of evenly spaced lines that give the initial values and compare them.
_SOME_LINES = 150
#: Relative noise of gamma_jk above which lines get less weight.
_HIDDEN = 0.1


def first_joints(data: LineData, joint: SpringJoint) -> list[FloatArray]:
    """Return coordinates of the joint from the compliance of the smooth FRFs, the most probable first.

    The compliance is C = gamma_kk gamma_jk^-1 gamma_jj - gamma_kj of the smooth FRFs on every line, with the covariance
    by a share of the noise. From it follows R = (1 + C Z)^-1 C. Lines whose noise exceeds gamma_jk have little weight.
    """
    n = data.entries.n
    a = range(n)

    def of_lines(own: slice) -> list[NDArray[Any]]:
        part = data.on_lines(own)
        gamma, spread = part.entries.matrix(part.smooth), part.entries.matrix(_variance(part))
        compliance = joint_compliance(gamma, on_singular="nan")
        covariance = _SMOOTH**2 * compliance_covariance(gamma, spread, np.eye(2 * n), on_singular="nan")
        ratio = _hidden(gamma, spread)
        if data.springs is not None:
            compliance, covariance = _with_springs(compliance, covariance, data.springs)
        good = np.isfinite(compliance).all(axis=(1, 2)) & np.isfinite(covariance).all(axis=(1, 2)) & np.isfinite(ratio)
        variance = covariance.reshape(-1, n, n, n, n)[:, a, a, a, a].real
        return [good, compliance, variance, ratio, covariance]

    if isinstance(joint, DiagonalJoint):
        return _diagonal_starts(data, joint)
    good, *found = in_pieces(len(data.smooth), of_lines, _PIECE)
    if not good.any():
        return []
    compliance, own, ratio, covariance = (x[good] for x in found)
    here = joint.on_lines(np.flatnonzero(good))
    threshold = _HIDDEN if np.count_nonzero(ratio < _HIDDEN) > 2 * joint.lower.size else float(np.median(ratio))
    line_weight = 1 / (1 + (ratio / threshold) ** 8)
    return _coupled_starts(compliance, covariance, own, line_weight, here)


def _with_springs(
    compliance: ComplexArray, covariance: ComplexArray, springs: FloatArray
) -> tuple[ComplexArray, ComplexArray]:
    """Return R = (1 + C Z)^-1 C and its covariance from C and its covariance: dR = (1 + C Z)^-1 dC (1 + Z C)^-1."""
    n = compliance.shape[-1]
    left = invert(np.eye(n) + compliance * springs, on_singular="nan")
    right = invert(np.eye(n) + springs[:, None] * compliance, on_singular="nan")
    slope = np.einsum("lac,ldb->labcd", left, right).reshape(-1, n * n, n * n)
    return left @ compliance, slope @ covariance @ slope.conj().swapaxes(1, 2)


def _variance(data: LineData) -> FloatArray:
    """Return the variance of the entries, 0 if one is not used, shape (n_freq, q)."""
    w = data.inverse_std
    return np.where(w > 0, 1 / np.where(w > 0, w, 1) ** 2, 0)


def hidden_share(data: LineData) -> FloatArray:
    """Return the largest relative noise of gamma_jk, of the smooth FRFs, on each line, shape (n_freq,)."""
    matrix = data.entries.matrix

    def of_lines(own: slice) -> list[FloatArray]:
        part = data.on_lines(own)
        return [_hidden(matrix(part.smooth), matrix(_variance(part)))]

    (share,) = in_pieces(len(data.smooth), of_lines)
    return share


def _hidden(gamma: ComplexArray, spread: FloatArray) -> FloatArray:
    """Return the largest relative noise of gamma_jk on the diagonal of gamma_jk^-1 dgamma_jk, shape (n_freq,)."""
    n = gamma.shape[-1] // 2
    inverse = invert(gamma[:, :n, n:], on_singular="nan")
    squares = abs(inverse) ** 2 @ spread[:, :n, n:]
    ratio: FloatArray = np.sqrt(np.diagonal(squares, axis1=1, axis2=2).max(axis=1))
    return ratio


def _diagonal_starts(data: LineData, joint: DiagonalJoint) -> list[FloatArray]:
    """Return initial values of a joint without cross terms from the kernel: least squares of R, and its mean."""
    entries, p = data.entries, joint.lower.size
    found = np.empty((2, p))
    # Packed: entries as a column of each line.
    sizes = int(entries.reciprocal), entries.n, p, entries.rows.size, 1, len(data.smooth)
    frfs = (np.ascontiguousarray(one)[:, None] for one in (data.smooth, data.inverse_std))
    lines = joint.omega, data.reference, *frfs
    call("start_joint", (*sizes, *joint.kernel_terms, *lines, *found))
    return list(found) if found.any() else []


def _coupled_starts(
    value: ComplexArray, covariance: ComplexArray, own: FloatArray, line_weight: FloatArray, joint: SpringJoint
) -> list[FloatArray]:
    """Fit all entries of R; initial values from K* R = 1 - Z R by linear least squares, and from the mean of R."""
    n = joint.n
    a, b = joint.rows, joint.columns
    size = np.sqrt(np.maximum(np.einsum("lqq->lq", covariance).real, np.finfo(float).tiny))
    outer = size[:, :, None] * size[:, None, :]
    q = n * n
    weight = invert(covariance / outer + 1e-10 * np.eye(q), on_singular="nan")
    weight /= outer
    fold = np.zeros((q, a.size))
    fold[a * n + b, np.arange(a.size)] = 1
    fold[b * n + a, np.arange(a.size)] = 1
    weight = (fold.T @ weight @ fold) * line_weight[:, None, None]
    mean = ((value + value.swapaxes(1, 2)) / 2)[:, a, b]
    forms = LineForms(mean, weight, np.zeros_like(mean), np.zeros(len(mean)))
    some = slice(None, None, max(1, len(mean) // _SOME_LINES))
    few, of_few = joint.on_lines(some), forms.on_slice(some)
    linear = _linear_start(value[some], own[some], line_weight[some], few)
    starts = [start for start in (linear, _mean_start(value, own, line_weight, joint)) if np.isfinite(start).all()]
    minima = sorted((few.minimise(of_few, start, least_gain=_ROUGH) for start in starts), key=lambda one: one.cost)
    if len(minima) > 1 and minima[1].cost < minima[0].cost + _ROUGH:  # the same minimum twice
        del minima[1]
    found = [one.x for one in minima]
    if some.step > 1 and found:
        found[0] = joint.minimise(forms, found[0], least_gain=_ROUGH).x
    return found + starts


def _mean_start(value: ComplexArray, own: FloatArray, line_weight: FloatArray, joint: SpringJoint) -> FloatArray:
    """Return the stiffness whose compliance is the weighted mean of Re R, no damping."""
    w = line_weight / own.max(axis=1)
    size = np.sqrt(np.median(abs(np.einsum("laa->la", value)), axis=0))
    scaled = value.real / np.outer(size, size)
    w = line_weight / (own / size**4).max(axis=1)
    mean = np.tensordot(w, scaled, 1) / w.sum()
    k = np.linalg.pinv((mean + mean.T) / 2, hermitian=True) / np.outer(size, size) - np.diag(joint.springs)
    terms, first = joint.terms, joint.terms.first
    start: FloatArray = np.where(terms.kinds[first] == 0, k[tuple(terms.pairs[first].T)], 0.0)
    return start


def _linear_start(value: ComplexArray, own: FloatArray, line_weight: FloatArray, joint: SpringJoint) -> FloatArray:
    """Solve K*(theta) R = 1 - Z R by weighted linear least squares in units of each DOF: exact without noise."""
    terms, n = joint.terms, joint.n
    size = np.sqrt(np.median(abs(np.einsum("laa->la", value)), axis=0))
    c = value / np.outer(size, size)
    root = np.sqrt(line_weight / (own / size**4).max(axis=1))
    scale = abs(terms.factors).max(axis=1)
    factors = terms.factors / scale[:, None]
    columns = []
    for kind, (a, b) in zip(terms.kinds, terms.pairs, strict=True):
        column = np.zeros_like(c)
        column[:, a] = c[:, b]
        if a != b:
            column[:, b] = c[:, a]
        columns.append((column * (root * factors[kind])[:, None, None]).ravel())
    right = (root[:, None, None] * (np.eye(n) - (joint.springs * size**2)[:, None] * c)).ravel()
    units = size[terms.pairs[:, 0]] * size[terms.pairs[:, 1]] * scale[terms.kinds]
    of_parameter = units[terms.first]
    matrix = summed_terms(np.array(columns).T * (units / of_parameter[terms.shared]), terms.shared)
    theta = np.linalg.lstsq(np.r_[matrix.real, matrix.imag], np.r_[right.real, right.imag], rcond=1e-12)[0]
    start: FloatArray = theta / of_parameter
    return start
