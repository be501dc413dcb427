"""Data of the figures of a compliance fit: FRFs regenerated with the joint, and the contribution of each line."""

from __future__ import annotations

import warnings
from functools import partial

import numpy as np

from jointfrf.channels.point_lines import Interface
from jointfrf.errors import IllConditionedWarning
from jointfrf.identification.fit_data import FitData
from jointfrf.identification.manifold.estimate import JointEstimate
from jointfrf.identification.manifold.fit import ManifoldFit
from jointfrf.identification.manifold.group_fit import GroupFit
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs
from jointfrf.identification.manifold.on_manifold import frfs_of_joint, project, smooth_compliance, starts_on_manifold
from jointfrf.identification.manifold.prepare import FitProblem
from jointfrf.identification.manifold.transforms import Transform, Transforms, as_transforms
from jointfrf.identification.manifold.uncertainty import JointUncertainty
from jointfrf.identification.minimise import inverse_information
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import solve

__all__ = [
    "as_pair",
    "channel_names",
    "compliance_data",
    "hidden_errors",
    "information_shares",
    "line_compliance",
    "regenerated_frfs",
]

#: Number of projections.
_STEPS = 30
#: Errors whose effect is computed: a delay of all forces, s; a resonance of all sensors at this multiple of the highest
#: line; the share of noise in the power of the force; the standard deviation of positions, m.
_DELAY, _RESONANCE, _FORCE_NOISE, _POSITION = 1e-6, 10.0, 0.01, 1e-3
#: Share of the largest information below which a line does not determine a direction.
_SEEN = 1e-10


def compliance_data(
    found: ManifoldFit, problem: FitProblem, transform: Transform | tuple[Transform, Transform] | None
) -> FitData:
    """Return the data behind a fit; `transform` as in `identify`."""
    frfs = problem.frfs
    fitted = problem.used.copy()
    for group in found.estimate.groups:
        fitted[:, group.dofs] &= group.used[:, None]
    # The level of the residual replaces an assumed level.
    scale = (found.noise_level / problem.noise.level) ** 2 if problem.noise.is_assumed else 1.0
    pair = as_pair(transform)
    names = channel_names(frfs, problem.dofs, pair)
    return FitData(
        measured=frfs.measured,
        response_names=names[0],
        force_names=names[1],
        responses=frfs.responses,
        forces=frfs.forces,
        modes=_modes(frfs),
        interface=pair[0] if isinstance(pair[0], Interface) else None,
        reciprocal=frfs.reciprocal,
        variance=frfs.variance,
        variance_scale=float(scale),
        deformation=problem.deformation,
        noise=problem.noise.model,
        fitted=fitted,
        regenerated=partial(regenerated_frfs, found.estimate, frfs.n),
        line_compliance=partial(line_compliance, found.estimate, frfs.n),
        information=partial(information_shares, found.estimate),
        hidden_errors=partial(
            hidden_errors,
            found.known,
            found.estimate,
            problem.freq_hz,
            as_transforms(transform, frfs.measured).position_errors(_POSITION),
        ),
    )


def as_pair(transform: Transform | tuple[Transform, Transform] | None) -> tuple[Transform | None, Transform | None]:
    """Return the transforms of responses and of forces."""
    # An `Interface` is a tuple, too.
    pair = transform if isinstance(transform, tuple) and not isinstance(transform, Interface) else (transform,) * 2
    return pair[0], pair[1]


def _modes(frfs: InterfaceFrfs) -> tuple[FloatArray, FloatArray] | None:
    """Return the rigid motion of responses and of forces, if both are known."""
    if Transforms(frfs.responses, frfs.forces).are_units:
        return frfs.responses, frfs.forces
    if frfs.response_modes is None or frfs.force_modes is None:
        return None
    return frfs.response_modes, frfs.force_modes


def channel_names(
    frfs: InterfaceFrfs, dofs: tuple[str, ...], transforms: tuple[Transform | None, Transform | None]
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names of responses and forces: of the channels, of the joint DOFs, or their numbers."""
    if Transforms(frfs.responses, frfs.forces).are_units:
        own = tuple(f"{side}:{dof}" for side in "jk" for dof in dofs)
        return own, own
    numbered = [
        [f"{what} {i}" for i in range(count)]
        for what, count in zip(("response", "force"), frfs.measured.shape[1:], strict=True)
    ]
    found = [
        tuple(map(str, given.channels)) if isinstance(given, Interface) and given.channels else tuple(other)
        for given, other in zip(transforms, numbered, strict=True)
    ]
    return found[0], found[1]


def regenerated_frfs(found: JointEstimate, n: int, lines: slice) -> ComplexArray:
    """Return the FRFs between joint DOFs that fit the identified joint and are nearest to the measured FRFs.

    Parameters
    ----------
    found : JointEstimate
        Estimate of the joint.
    n : int
        Number of joint DOFs.
    lines : slice
        Frequency lines to return.

    Returns
    -------
    ndarray, shape (lines, 2 n, 2 n)
        Receptances, m/N; zero between DOFs of different groups, NaN on lines without such FRFs.
    """
    parts = [(group, _of_group(group, lines)) for group in found.groups]
    gamma = np.zeros((len(parts[0][1]), 2 * n, 2 * n), np.complex128)
    for group, own in parts:
        at = np.concatenate([group.dofs, group.dofs + n])
        gamma[:, at[:, None], at] = own
    return gamma


def _of_group(group: GroupFit, lines: slice) -> ComplexArray:
    """Return the regenerated FRFs of one group of DOFs."""
    data, joint = group.problem.data.on_lines(lines), group.joint
    c = joint.matrix(joint.on_lines(lines).compliance(group.x))
    unknown = group.problem.unknown[lines].reshape(c.shape)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore", IllConditionedWarning)
        if unknown.any():
            c = np.where(unknown, smooth_compliance(data), c)
        on = project(data.measured, data, c, starts_on_manifold(data, c, _STEPS), _STEPS)
        gamma = frfs_of_joint(on.h, on.q, c, data.reference)
    gamma[~np.isfinite(on.squares)] = np.nan
    return gamma


def line_compliance(found: JointEstimate, n: int) -> ComplexArray:
    """Return the diagonal of C of each line by itself, shape (n_freq, n), m/N: the minimum of its quadratic form."""
    whole = np.full((len(found.groups[0].used), n), np.nan + 1j * np.nan)
    for group in found.groups:
        forms, own = group.forms, group.dofs.size
        size = np.sqrt(np.einsum("lqq->lq", forms.weight).real)
        known = (size > 0).all(axis=1) & np.isfinite(size).all(axis=1)
        outer = size[known, :, None] * size[known, None, :]
        scaled = np.linalg.pinv(forms.weight[known] / outer, rcond=_SEEN, hermitian=True)
        step = (scaled @ (forms.gradient[known] / size[known])[..., None])[..., 0] / size[known]
        r = group.joint.matrix(forms.compliance[known] + step)
        compliance = solve(np.eye(own) - r * group.joint.springs, r, on_singular="nan")
        whole[np.ix_(known, group.dofs)] = np.einsum("ldd->ld", compliance)
    return whole


def hidden_errors(
    known: JointUncertainty,
    estimate: JointEstimate,
    freq_hz: FloatArray,
    positions: tuple[FloatArray, FloatArray] | None,
) -> dict[str, dict[str, float]]:
    """Return the change of each parameter by errors that no FRF shows; as `FitData.hidden_errors`."""
    omega = 2 * np.pi * freq_hz
    errors = {
        "delay": -1j * omega * _DELAY,
        "resonance": ((omega / (_RESONANCE * omega.max())) ** 2).astype(complex),
        "force-noise": np.full(freq_hz.size, -_FORCE_NOISE, complex),
    }
    names = [one.name for one in estimate.parameters]
    found: dict[str, dict[str, float]] = {name: {} for name in (*errors, *([] if positions is None else ["position"]))}
    for group in known.groups:
        at = group.at
        every = np.ones((1, *at.measured_shape), bool)
        gradient, _ = next(at.errors(every, slice(0, freq_hz.size)))
        steps = {name: [(gradient * error[:, None]).real.sum(axis=0) @ at.covariance] for name, error in errors.items()}
        for effect in at.position_effects(positions):
            steps["position"] = list(effect.steps(at.covariance))
        for name, own in steps.items():
            changes = np.nan_to_num(np.array(own) @ at.group.joint.theta_slope(at.group.x).T)
            # Independent errors add as squares; a single one keeps its sign.
            total = changes[0] if len(changes) == 1 else np.linalg.norm(changes, axis=0)
            found[name] |= {names[i]: float(change) for i, change in zip(at.group.which, total, strict=True)}
    return found


def information_shares(found: JointEstimate) -> FloatArray:
    """Return the share of each line in the information on each parameter, shape (n_freq, p); the shares sum to 1.

    Notes
    -----
    A is the information of all lines on the coordinates x, A_l is the information of line l, and s = dtheta/dx. The
    variance of a parameter is s^T A^-1 s. To first order a line of weight 1 + w changes it by -w s^T A^-1 A_l A^-1 s.
    """
    n_freq = len(found.groups[0].used)
    share = np.zeros((n_freq, len(found.parameters)))
    for group in found.groups:
        slope = group.joint.theta_slope(group.x)
        # Only shares count, so rows may have any scale, also the row of a rigid DOF.
        slope = np.nan_to_num(slope / np.maximum(abs(slope).max(axis=1, keepdims=True), np.finfo(float).tiny))
        to = slope @ inverse_information(group.information)
        own = np.einsum("pa,lab,pb->lp", to, group.of_lines().information, to, optimize=True)
        share[:, group.which] = np.maximum(own, 0) / np.maximum(own.sum(axis=0), np.finfo(float).tiny)
    return share
