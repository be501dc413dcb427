"""Uncertainty that noise does not explain: models of the sides, bands that disagree, channels a little off."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.frf.bands import line_slices
from jointfrf.frf.calibration import CalibrationErrors, ErrorKind
from jointfrf.identification.calibration import CalibrationSpread, Effects, effects_by_function
from jointfrf.identification.manifold.estimate import JointEstimate
from jointfrf.identification.manifold.group_fit import GroupFit, effects_of, gradients_of
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs
from jointfrf.identification.minimise import inverse_information
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = [
    "BandParts",
    "JointCalibration",
    "SideSpread",
    "fit_band_parts",
    "joint_calibration",
    "left_out_share",
    "side_spread",
]


class SideSpread(NamedTuple):
    """What is not known of sides that bend adds to the uncertainty, shape (p,) each.

    Attributes
    ----------
    std_error : ndarray
        Standard error of each parameter; of the compliance a = 1/k where a joint without cross terms has a stiffness.
    factor : ndarray
        Variance of each parameter in units of that from independent noise.
    """

    std_error: FloatArray
    factor: FloatArray


def side_spread(found: JointEstimate, frfs: InterfaceFrfs, compliance: FloatArray | None) -> SideSpread | None:
    """Return what errors of models of the sides, or a compliance that was said, add; None without either.

    Parameters
    ----------
    found : JointEstimate
    frfs : InterfaceFrfs
    compliance : ndarray, shape (n,), optional
        What the sides add to the compliance of each joint DOF, taken as its standard error, m/N or rad/(N m).

    Notes
    -----
    Sum of squared changes of the parameters when something of the models is off by one standard deviation, or a DOF is
    softer. To first order, by one Gauss-Newton step.
    """
    if frfs.errors is None and compliance is None:
        return None
    std_error, factor = np.zeros((2, len(found.parameters)))
    for group in found.groups:
        inverse = inverse_information(group.information)
        changes = [np.zeros((0, group.x.size))]
        errors = frfs.errors_of(group.dofs)
        if errors is not None:
            changes.append(gradients_of(group, errors.swapaxes(0, 1)) @ inverse)
        if compliance is not None:
            softer = _softer(group, compliance[group.dofs]) @ inverse
            of_compliance = group.joint.is_compliance
            if of_compliance.any():
                # Whatever the damping takes up of it.
                own = np.diag(compliance[group.dofs])[:, of_compliance[: len(group.dofs)]]
                softer[:, of_compliance] = own / group.joint.compliance_slope(group.x)[of_compliance]
            changes.append(softer)
        std_error[group.which], factor[group.which] = _spread(group, np.concatenate(changes), inverse / 2)
    return SideSpread(std_error, factor)


def _spread(group: GroupFit, changes: FloatArray, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return standard errors, and variances over those from noise, of changes of the coordinates."""
    slope = group.joint.theta_slope(group.x)
    found = []
    for to_parameters in (np.eye(len(slope)), slope):
        with np.errstate(divide="ignore", invalid="ignore"):
            own = ((changes @ to_parameters.T) ** 2).sum(axis=0)
            found.append((np.sqrt(own), own / np.einsum("ij,jk,ik->i", to_parameters, noise, to_parameters)))
    (of_coordinate, of_coordinates), (of_parameter, ratio) = found
    # A rigid DOF has no finite slope.
    ratio = np.where(np.isfinite(ratio), ratio, of_coordinates)
    of_coordinate = of_coordinate * group.joint.compliance_slope(group.x)
    return np.where(group.joint.is_compliance, of_coordinate, of_parameter), np.nan_to_num(ratio)


def _softer(group: GroupFit, compliance: FloatArray) -> FloatArray:
    """Return by how much the gradient changes when the compliance of each DOF is larger, shape (n, p)."""
    joint, forms = group.joint, group.forms
    entries = joint.compliance(group.x)
    adjoint = joint.slope(group.x, entries).conj()
    # dR = (1 - R Z) dC (1 - Z R)
    kept = np.eye(joint.n) - joint.matrix(entries) * joint.springs
    change = np.einsum("lad,d,lbd->ldab", kept, compliance, kept)[:, :, joint.rows, joint.columns]
    weighted = np.einsum("lqr,ldr->ldq", forms.weight, change)
    found: FloatArray = np.einsum("lqp,ldq->dp", adjoint, weighted).real
    return found


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


class JointCalibration(NamedTuple):
    """What errors of channels that are smooth over frequency add to the uncertainty of a joint.

    Attributes
    ----------
    factor : ndarray, shape (p,)
        Variance of each parameter in units of that from independent noise.
    degrees : ndarray, shape (p,)
        Degrees of freedom of that, as far as it was found.
    found : ndarray, shape (p,)
        Share of it that was found, and not said.
    covariance : ndarray, shape (p, p)
        Of the parameters.
    excess, excess_error : float
        Mean square of the residual that they leave, in units of the noise, and its standard error.
    by_group : mapping
        Of each group, by its DOFs, what unit errors of each kind do to its gradient on the parts of the band.
    errors : CalibrationErrors
    """

    factor: FloatArray
    degrees: FloatArray
    found: FloatArray
    covariance: FloatArray
    excess: float
    excess_error: float
    by_group: Mapping[tuple[int, ...], Mapping[ErrorKind, FloatArray]]
    errors: CalibrationErrors

    def between(self, group: GroupFit, which: NDArray[np.bool_], inverse: FloatArray) -> FloatArray:
        """Return the covariance of what errors make coordinates of parts of the band differ from those of all lines.

        Parameters
        ----------
        group : GroupFit
        which : ndarray of bool, shape (n_parts,)
        inverse : ndarray, shape (n_chosen, p, p)
            Of the information of each part chosen.

        Returns
        -------
        ndarray, shape (n_chosen, p, p)
        """
        whole, found = inverse_information(group.information), np.zeros_like(inverse)
        for kind, variance, _ in self.errors.kinds():
            gradient = self.by_group[tuple(group.dofs.tolist())][kind]
            steps = gradient[:, :, which] @ inverse - (gradient.sum(axis=2) @ whole)[:, :, None]
            found += np.einsum("af,eabfp,eabfq->bpq", variance, steps, steps, optimize=True)
        return found


def joint_calibration(
    found: JointEstimate, frfs: InterfaceFrfs, freq_hz: FloatArray, errors: CalibrationErrors | None
) -> JointCalibration | None:
    """Return what smooth errors add to the uncertainty; None where there are none.

    Parameters
    ----------
    found : JointEstimate
    frfs : InterfaceFrfs
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    errors : CalibrationErrors, optional
        Found from h_pq - h_qp.

    Notes
    -----
    Cov(theta) += J Var J^T, J being the change of the parameters with each error, to first order by one Gauss-Newton
    step. h_pq - h_qp show g_p - f_p of responses and forces only; g_p + f_p, which the mean of h_pq and h_qp carries,
    is taken to be as large: both are independent.
    """
    if errors is None:
        return None
    p = len(found.parameters)
    factor, degrees, share, covariance = np.zeros(p), np.full(p, np.inf), np.zeros(p), np.zeros((p, p))
    excess = error = 0.0
    by_group: dict[tuple[int, ...], dict[ErrorKind, FloatArray]] = {}
    for group in found.groups:
        effects = _effects(group, frfs, freq_hz, errors)
        by_group[tuple(group.dofs.tolist())] = {kind: one.steps for kind, one in effects.items()}
        which, slope, inverse = group.which, group.joint.theta_slope(group.x), inverse_information(group.information)
        of_all = {
            kind: Effects(one.steps.sum(axis=2) @ inverse, one.squares.sum(axis=1)) for kind, one in effects.items()
        }
        spread = CalibrationSpread.of(errors, slope, of_all.__getitem__)
        own, of_theta = np.diagonal(group.covariance), slope @ spread.covariance @ slope.T
        by_noise = np.einsum("ij,jk,ik->i", slope, group.covariance, slope)
        with np.errstate(divide="ignore", invalid="ignore"):
            of_coordinate = np.diagonal(spread.covariance) / own
            ratio = np.diagonal(of_theta) / by_noise
        # A rigid DOF has no finite slope.
        in_coordinate = group.joint.is_compliance | ~np.isfinite(ratio)
        factor[which] = np.nan_to_num(np.where(in_coordinate, of_coordinate, ratio))
        degrees[which], share[which] = spread.degrees, spread.found
        covariance[which[:, None], which] = np.nan_to_num(of_theta, posinf=0.0, neginf=0.0)
        excess += spread.squares
        error = float(np.hypot(error, spread.squares_error))
    equations = max(found.equations - p / 2, 1.0)
    return JointCalibration(factor, degrees, share, covariance, excess / equations, error / equations, by_group, errors)


def _effects(
    group: GroupFit, frfs: InterfaceFrfs, freq_hz: FloatArray, errors: CalibrationErrors
) -> dict[ErrorKind, Effects]:
    """Return by how much unit errors of each kind change the gradient on each part of the band, and their squares.

    Shapes (number, 2, n_parts, n_functions, p) and (2, n_parts, n_functions).
    """
    functions, member, p = errors.functions(freq_hz), group.band_parts, group.x.size
    shape, found = (2, len(member), functions.shape[1]), dict[ErrorKind, Effects]()
    for kind, *_ in errors.kinds():
        some = []
        for own in line_slices(len(freq_hz)):
            changes = _unit_errors(frfs.on_lines(own), group.dofs, errors, kind)
            by_part = (functions[:, None, :, own] * member[:, None, own]).reshape(2, shape[1] * shape[2], -1)
            some.append(effects_by_function(effects_of(group, changes, own), by_part, np.eye(p)))
        steps, squares = (np.sum(parts, axis=0) for parts in zip(*some, strict=True))
        found[kind] = Effects(steps.reshape(-1, *shape, p), squares.reshape(shape))
    return found


def _unit_errors(
    frfs: InterfaceFrfs, dofs: NDArray[np.intp], errors: CalibrationErrors, kind: ErrorKind
) -> Iterator[ComplexArray]:
    """Yield changes of the entries between some joint DOFs by a unit relative error of each of a kind."""
    for mask in errors.masks(kind, frfs.measured.shape[1:]):
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        own = np.where(mask[np.ix_(rows, columns)], frfs.measured[:, rows[:, None], columns], 0)
        change = frfs.responses[:, rows] @ own @ frfs.forces[:, columns].T
        yield frfs.entries_of(dofs, np.asarray(change, np.complex128))
