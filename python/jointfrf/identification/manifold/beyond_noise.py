"""Uncertainty that noise does not explain: sides that are not rigid, parts of the band that disagree."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.identification.manifold.estimate import JointEstimate
from jointfrf.identification.manifold.group_fit import GroupFit, gradients_of
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs
from jointfrf.identification.manifold.transforms import ChannelModes, left_out
from jointfrf.identification.minimise import inverse_information
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["BandParts", "ChannelSpread", "channel_spread", "fit_band_parts", "left_out_share"]

#: How often the noise of an FRF is left out: with its response, and with its force.
_TIMES = 2.0


class _Changes(NamedTuple):
    """Changes of gamma without a channel, shape (n_freq, 2 n, 2 n) each, and redundancies of the channels."""

    gamma: list[ComplexArray]
    redundancy: FloatArray


class ChannelSpread(NamedTuple):
    """What sides that are not rigid add to the uncertainty, shape (p,) each.

    Attributes
    ----------
    std_error : ndarray
        Standard error of each parameter; of the compliance a = 1/k where a joint without cross terms has a stiffness.
    factor : ndarray
        Variance of each parameter in units of that from independent noise.
    """

    std_error: FloatArray
    factor: FloatArray


def channel_spread(found: JointEstimate, frfs: InterfaceFrfs, compliance: FloatArray | None) -> ChannelSpread | None:
    """Return what sides that are not rigid add to the uncertainty; None where the channels do not tell.

    Parameters
    ----------
    found : JointEstimate
    frfs : InterfaceFrfs
    compliance : ndarray, shape (n,), optional
        What the sides add to the compliance of each joint DOF, taken as its standard error, m/N or rad/(N m).

    Notes
    -----
    The jackknife variance over channels, sum of redundancy times squared change when one is left out (unbiased for
    errors that are independent between channels) less what noise makes of it, and the square of the change for a
    compliance of every DOF; both times Student's t for the few channels. To first order, by one Gauss-Newton step.
    Where responses and forces are the same channels both are left out together: a body deforms alike where it is struck
    and where it is measured.
    """
    without = _without_channels(frfs)
    if without is None and compliance is None:
        return None
    few = 1.0
    if without is not None:
        degrees = max(float(without.redundancy.sum()), 1.0)
        few = (special.stdtrit(degrees, 0.975) / special.ndtri(0.975)) ** 2
    std_error, factor = np.zeros((2, len(found.parameters)))
    for group in found.groups:
        inverse = inverse_information(group.information)
        changes, weights, of_noise = np.zeros((0, group.x.size)), np.zeros(0), 0.0
        if without is not None:
            entries = (frfs.entries_of(group.dofs, one) for one in without.gamma)
            changes = gradients_of(group, entries) @ inverse
            weights, of_noise = without.redundancy, few * _TIMES
        if compliance is not None:
            softer = _softer(group, compliance[group.dofs]) @ inverse
            if group.joint.in_compliance:
                # Whatever the damping takes up of it.
                softer[:, group.joint.is_compliance] = np.diag(compliance[group.dofs])
        else:
            softer = np.zeros((0, group.x.size))
        scatters = (few * weights, changes), (np.full(len(softer), few), softer)
        std_error[group.which], factor[group.which] = _spread(group, scatters, of_noise, inverse / 2)
    return ChannelSpread(std_error, factor)


def _spread(
    group: GroupFit, scatters: tuple[tuple[FloatArray, FloatArray], ...], of_noise: float, noise: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return standard errors, and variances over those from noise, of weighted changes of the coordinates.

    The first changes are those of channels left out, of which noise makes up `of_noise` of its variance.
    """
    slope = group.joint.theta_slope(group.x)
    found = []
    for to_parameters in (np.eye(len(slope)), slope):
        with np.errstate(divide="ignore", invalid="ignore"):
            of_channels, of_compliance = (w @ (changes @ to_parameters.T) ** 2 for w, changes in scatters)
            by_noise = np.einsum("ij,jk,ik->i", to_parameters, noise, to_parameters)
            own = np.maximum(of_channels - of_noise * by_noise, 0) + of_compliance
            found.append((np.sqrt(own), own / by_noise))
    (of_coordinate, of_coordinates), (of_parameter, ratio) = found
    # A rigid DOF has no finite slope.
    ratio = np.where(np.isfinite(ratio), ratio, of_coordinates)
    return np.where(group.joint.is_compliance, of_coordinate, of_parameter), np.nan_to_num(ratio)


def _softer(group: GroupFit, compliance: FloatArray) -> FloatArray:
    """Return by how much the gradient changes when the compliance of each DOF is larger, shape (n, p)."""
    joint, forms = group.joint, group.forms
    adjoint = joint.slope(group.x, joint.compliance(group.x)).conj()
    own = (joint.rows == joint.columns) & (joint.rows == np.arange(joint.n)[:, None])
    change = own * compliance[:, None]
    weighted = np.einsum("lqr,dr->ldq", forms.weight, change)
    found: FloatArray = np.einsum("lqp,ldq->dp", adjoint, weighted).real
    return found


def _without_channels(frfs: InterfaceFrfs) -> _Changes | None:
    """Return what leaving out one channel after the other changes."""
    if frfs.response_modes is None or frfs.force_modes is None:
        return None
    responses = list(left_out(ChannelModes(frfs.responses, frfs.response_modes)))
    forces = list(left_out(ChannelModes(frfs.forces, frfs.force_modes)))
    h, base, gamma = frfs.measured, frfs.gamma(frfs.measured), []
    if frfs.responses.shape == frfs.forces.shape and np.array_equal(frfs.responses, frfs.forces):
        for one in responses:
            t = frfs.responses + one.change
            gamma.append(t @ h @ t.T - base)
        forces = []
    else:
        gamma += [one.change @ h @ frfs.forces.T for one in responses]
        gamma += [frfs.responses @ h @ one.change.T for one in forces]
    if not gamma:
        return None
    return _Changes(gamma, np.array([one.redundancy for one in (*responses, *forces)]))


#: Parts of the band that are fitted separately.
_PARTS = 4
#: Probability at which parts disagree.
_DISAGREE = 1e-3


class BandParts(NamedTuple):
    """Separate fits of parts of the band, compared with the fit of all of it.

    Attributes
    ----------
    spans : tuple of (low, high)
        Hz.
    values : ndarray, shape (n_parts, p)
        Parameters of each part; NaN where it does not show one.
    disagree : ndarray of bool, shape (p,)
        Parameters on which the parts do not agree.
    std_error : ndarray, shape (p,)
        Standard deviation between the parts where they do not agree, 0 elsewhere; of the compliance where a joint
        without cross terms has a stiffness.
    """

    spans: tuple[tuple[float, float], ...]
    values: FloatArray
    disagree: NDArray[np.bool_]
    std_error: FloatArray


def left_out_share(found: JointEstimate) -> float:
    """Return the largest share of lines that do not fit the joint found, over the groups fitted on the manifold."""
    shares = [float(np.mean(~group.used)) for group in found.groups if group.unknown_cross is None]
    return max(shares, default=0.0)


def fit_band_parts(
    found: JointEstimate, freq_hz: FloatArray, factor: FloatArray, fit: Callable[[NDArray[np.intp]], JointEstimate]
) -> BandParts:
    """Fit parts of the band, and compare.

    Parameters
    ----------
    found : JointEstimate
        Of all lines.
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    factor : ndarray, shape (p,)
        By how much variances exceed those from independent noise, scatter between lines and parts left out.
    fit : callable
        From numbers of lines to their estimate.

    Notes
    -----
    Lines that do not fit the joint found are left out of a fit, and with them what contradicts it: the residual stays
    that of the noise, and no scatter shows. Parts of the band find joints of their own. They disagree where the squares
    of their differences from the weighted mean, over their variances, are improbable for noise.
    """
    in_compliance = np.zeros(factor.size, bool)
    for group in found.groups:
        in_compliance[group.which] = group.joint.is_compliance
    parts = [np.sort(own) for own in np.array_split(np.argsort(freq_hz), _PARTS)]
    theta, variance = (np.full((_PARTS, factor.size), np.nan) for _ in range(2))
    for b, own in enumerate(parts):
        try:
            one = fit(own)
        except (np.linalg.LinAlgError, ValueError):
            continue
        if one.parameters == found.parameters:
            theta[b], variance[b] = one.theta, np.diagonal(one.covariance) * factor
    with np.errstate(divide="ignore", invalid="ignore"):
        seen = variance < theta**2
        value = np.where(seen, np.where(in_compliance, 1 / theta, theta), np.nan)
        weight = np.where(seen, 1 / np.where(in_compliance, variance / theta**4, variance), 0)
        mean = np.nansum(weight * value, axis=0) / weight.sum(axis=0)
        squares = np.nansum(weight * (value - mean) ** 2, axis=0)
        degrees = seen.sum(axis=0) - 1
        disagree = (degrees > 0) & (special.chdtrc(np.maximum(degrees, 1), squares) < _DISAGREE)
        scatter = np.sqrt(np.nansum((value - mean) ** 2, axis=0) / np.maximum(degrees, 1))
    spans = tuple((float(freq_hz[own].min()), float(freq_hz[own].max())) for own in parts)
    return BandParts(spans, np.where(seen, theta, np.nan), disagree, np.where(disagree, scatter, 0.0))
