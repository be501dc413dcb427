"""Checked arguments of `identify` for a compliance fit, as a problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.joint_channels import LeftOutDof, left_out_dofs
from jointfrf.dofs import is_rotation, point_and_direction
from jointfrf.frf.bands import Band, as_bands, in_bands, line_slices, spread_lines
from jointfrf.frf.cross_axis import CrossAxis, found_cross_axis
from jointfrf.frf.entry_groups import ZERO
from jointfrf.frf.quantiles import medians
from jointfrf.identification.manifold.coordinates import CrossTerms, DampingTerms
from jointfrf.identification.manifold.estimate import GroupStart, JointEstimate
from jointfrf.identification.manifold.flexible_sides import SideBending, side_bending
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs, direction_share, mean_of_directions
from jointfrf.identification.manifold.transforms import (
    Transform,
    Transforms,
    as_transforms,
    deformation_variance,
)
from jointfrf.identification.noise import KnownNoise, NoiseOptions, SmoothedFrfs, noise_of_matrix, without_mass
from jointfrf.identification.prepare import BandsOfDofs, MeasuredFrfs, as_dof_names
from jointfrf.identification.side_models import SideModel, corrected_frfs
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_names, check_choice, one_line

__all__ = [
    "FitOptions",
    "FitProblem",
    "as_equal_points",
    "check_channels",
    "check_estimate",
    "check_joint_seen",
    "check_transform",
    "prepare_compliance",
    "shown_percent",
]

#: Relative difference of FRFs from their transpose below which they were made reciprocal.
_RECIPROCAL = 1e-9


@dataclass(frozen=True)
class FitOptions:
    """Choices of a fit on the manifold, as in `identify`."""

    damping: DampingTerms | Literal["auto"] | Sequence[DampingTerms]
    cross: CrossTerms
    reciprocal: bool
    same: tuple[tuple[str, ...], ...] = ()
    position_error: float = 0.0

    def __post_init__(self) -> None:
        """Check the choices."""
        if isinstance(self.damping, str):
            check_choice("damping", self.damping, (*get_args(DampingTerms), "auto"))
        else:
            for word in as_names("damping", self.damping):
                check_choice("damping", word, get_args(DampingTerms))
        check_choice("cross", self.cross, get_args(CrossTerms))
        if self.same and self.cross == "ignore":
            raise ValueError('cross "ignore" does not go with same, which fits joints as a whole; leave one out')


@dataclass(frozen=True)
class FitProblem:
    """A fit on the manifold, ready to be computed, on the lines inside the bands.

    Attributes
    ----------
    dofs : tuple of str
        Names of the n joint DOFs.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    frfs : InterfaceFrfs
        Measured and smooth FRFs, their variance, and their conversion to the joint DOFs.
    noise : KnownNoise
        Noise of the FRFs.
    used : ndarray of bool, shape (n_freq, n)
        Lines used for each DOF.
    bands : tuple
        Bands of each DOF, (low, high) in Hz.
    options : FitOptions
        Choices of the fit.
    near : tuple of GroupStart
        First initial values, from other FRFs of the same structure.
    deformation : ndarray, shape (n_freq, m_r, m_f), optional
        Part of the variance by non-rigid motion of the channels, (m/N)^2.
    bending : SideBending, optional
        Deformation of the sides among the channels, if these show it and no models correct it.
    added_compliance : ndarray, shape (n,), optional
        Stated compliance that the sides add to each joint DOF, m/N or rad/(N m).
    model_errors : tuple of str, optional
        Names of errors of the models of the sides, if models correct the FRFs.
    left_out : tuple of LeftOutDof
        Omitted DOFs whose motion the channels attribute to a joint DOF.
    motion : ndarray, shape (n_freq,), optional
        Size of the motion on each line, if the FRFs depend on amplitude.
    position_errors : tuple of ndarray, shapes (n_errors, 2 n, 2 n), optional
        Joint DOFs that errors of the positions mix, see `Transforms.position_errors`.
    """

    dofs: tuple[str, ...]
    freq_hz: FloatArray
    frfs: InterfaceFrfs
    noise: KnownNoise
    used: NDArray[np.bool_]
    bands: tuple[tuple[Band, ...], ...]
    options: FitOptions
    near: tuple[GroupStart, ...] = ()
    deformation: FloatArray | None = None
    bending: SideBending | None = None
    added_compliance: FloatArray | None = None
    model_errors: tuple[str, ...] | None = None
    left_out: tuple[LeftOutDof, ...] = ()
    motion: FloatArray | None = None
    position_errors: tuple[FloatArray, FloatArray] | None = None

    @property
    def sides_bend(self) -> bool:
        """Whether the sides may be flexible between channels and joint."""
        return self.bending is not None or self.model_errors is not None

    def with_noise(self, scale: float) -> FitProblem:
        """Return the same with another noise level."""
        noise = replace(self.noise, level=scale * self.noise.level)
        flexible = 0.0 if self.deformation is None else self.deformation
        variance = (self.frfs.variance - flexible) * scale**2 + flexible
        return replace(self, noise=noise, frfs=self.frfs._replace(variance=variance))


def as_equal_points(same: Sequence[str] | Sequence[Sequence[str]] | None) -> tuple[tuple[str, ...], ...]:
    """Return lists of points with equal joints, from the argument `same` of `identify`: one list, or several."""
    if same is None:
        return ()
    if isinstance(same, Sequence) and not isinstance(same, str) and all(isinstance(one, str) for one in same):
        same = [cast("Sequence[str]", same)]
    if not isinstance(same, Sequence) or isinstance(same, str):
        raise TypeError(f"same must be a list of names of points, not {one_line(same)}")
    found = tuple(as_names("same", one) for one in same)
    named = [point for points in found for point in points]
    if len(set(named)) != len(named) or any(len(points) < 2 for points in found):
        raise ValueError(f"same must name at least two points, each once, not {one_line(same)}")
    return found


def _check_points(options: FitOptions, dofs: tuple[str, ...]) -> None:
    """Raise an error for options about points that the DOFs do not have."""
    points = {point for point, _ in map(point_and_direction, dofs) if point}
    if options.cross == "points" and not points:
        raise ValueError(f'cross "points" needs DOFs of points, such as "bolt1.y", not {", ".join(dofs)}')
    for point in (point for own in options.same for point in own):
        if point not in points:
            known = f"use one of {', '.join(sorted(points))}" if points else 'name DOFs by points, such as "bolt1.y"'
            raise ValueError(f"unknown point {point!r} in same; {known}")


def prepare_compliance(
    measured: MeasuredFrfs,
    dofs: Sequence[str] | None,
    bands: BandsOfDofs,
    transform: Transform | tuple[Transform, Transform] | None,
    noise: NoiseOptions,
    options: FitOptions,
    sides: tuple[SideModel, SideModel] | None = None,
    *,
    is_checked: bool = False,
    is_reciprocal: bool = True,
) -> FitProblem:
    """Check the arguments of the fit, estimate the noise, and keep the lines in the bands; see `identify`.

    `is_checked` states that the channels show the joint DOFs, because other realisations of the same FRFs did.
    `is_reciprocal` states that FRFs without errors have h_pq = h_qp, which is not true if the joint depends on
    amplitude.
    """
    freq, h = measured.freq_hz, measured.h
    transforms = as_transforms(transform, h)
    responses, forces = transforms[:2]
    if dofs is None and transforms.geometry is not None:
        dofs = transforms.geometry.dofs
    names = as_dof_names(dofs, responses.shape[0] // 2)
    _check_points(options, names)
    if not isinstance(options.damping, str) and len(options.damping) != len(names):
        raise ValueError(f"damping must have one word for each of {len(names)} DOFs, not {len(options.damping)}")
    own = as_bands(bands, names, freq)
    used = np.stack([in_bands(freq, b) for b in own], axis=1)
    kept = np.asarray(used.any(axis=1))
    if not kept.all():  # no copy of long sweeps otherwise
        freq, h = freq[kept], h[kept]
    noise = noise.on_lines(kept, measured.h.shape)
    # Channels are known to be the same points if both transforms are one.
    square = h.shape[1] == h.shape[2] and np.array_equal(responses, forces)
    is_square = options.reciprocal and square
    if not is_checked:
        _check_joint_dofs(transforms, h, names)
    h, found = _without_errors(
        freq, h, noise, names, transforms, is_square=is_square, has_shares=is_reciprocal and sides is None
    )
    if is_square and not _is_symmetrised(found.smooth):
        # Few lines are not smoothed.
        found = found._replace(smooth=mean_of_directions(found.smooth, direction_share(found.variance)))
    smooth, variance = transforms.gamma(found.smooth), found.variance
    check_joint_seen(freq, smooth, transforms.variance(variance))
    transforms = transforms.with_modes(found.smooth)
    channels, deformation, bending, corrected = transforms.channels, None, None, None
    if sides is not None:
        corrected = corrected_frfs(freq, h, found.smooth, variance, *_for_models(transforms), sides)
        smooth, variance = corrected.smooth_gamma, corrected.variance
    elif channels is not None:
        deformation = deformation_variance(found.smooth, *channels)
        bending = side_bending(h, found.smooth, variance, *channels)
    return FitProblem(
        dofs=names,
        freq_hz=freq,
        frfs=InterfaceFrfs.of(
            h if corrected is None else corrected.h,
            smooth,
            variance if deformation is None else variance + deformation,
            responses,
            forces,
            options.reciprocal,
            symmetrised=square and _is_symmetrised(h),
            response_modes=transforms.response_modes,
            force_modes=transforms.force_modes,
            errors=None if corrected is None else corrected.errors,
            noise_paths=None if corrected is None else corrected.noise_paths,
        ),
        noise=found.noise,
        used=used[kept],
        bands=tuple(map(tuple, own)),
        options=options,
        deformation=deformation,
        bending=bending,
        added_compliance=transforms.compliance,
        model_errors=None if corrected is None else corrected.error_names,
        left_out=() if transforms.geometry is None else left_out_dofs(h, transforms.geometry),
        position_errors=_position_errors(transforms, options.position_error),
    )


def _position_errors(transforms: Transforms, size: float) -> tuple[FloatArray, FloatArray] | None:
    """Return the joint DOFs that errors of positions mix, if these are stated; `size` in m."""
    found = transforms.position_errors(size) if size else None
    if size and found is None:
        raise ValueError(
            "position_error needs rotations among the joint DOFs and the positions of the channels: give transform as "
            "an Interface (interface, virtual_interface), or leave position_error out"
        )
    return found


def _without_errors(
    freq: FloatArray,
    h: ComplexArray,
    noise: NoiseOptions,
    names: tuple[str, ...],
    transforms: Transforms,
    *,
    is_square: bool,
    has_shares: bool,
) -> tuple[ComplexArray, SmoothedFrfs]:
    """Return FRFs without the mass of a sensor and shares of other DOFs in the channels, and their noise.

    FRFs that differ from their transpose are smooth only without the shares. The mean of both directions first shows
    the shares, whose noise is also in their differences, and then smooth FRFs. Without `has_shares` none are estimated.
    """
    rotations = np.array([is_rotation(name) for name in names])
    # Without a transform the channels are the joint DOFs.
    is_translation = not transforms.are_units or not rotations.any()

    def off_axis(smooth: ComplexArray) -> CrossAxis | None:
        return found_cross_axis(freq, h, smooth, transforms.responses, rotations, is_translation=is_translation)

    def with_noise(axis: CrossAxis | None, smooth: ComplexArray) -> tuple[ComplexArray, SmoothedFrfs]:
        own = h if axis is None else axis.removed(h, smooth)
        own, mass = without_mass(freq, own, noise.sensor_mass, is_square=is_square, is_translation=is_translation)
        found = noise_of_matrix(freq, own, noise, reciprocal=is_square)
        return own, found._replace(noise=replace(found.noise, mass=mass, cross_axis=axis))

    if not (is_square and has_shares) or noise.setups is not None:
        return with_noise(None, h)
    mean: ComplexArray = h + h.swapaxes(1, 2)
    mean /= 2
    first = off_axis(mean)
    if first is None:
        del mean  # for a long sweep it is as large as all arrays that the fit keeps
        return with_noise(None, h)
    found = with_noise(first, mean)
    return with_noise(off_axis(found[1].smooth), found[1].smooth)


def _for_models(transforms: Transforms) -> tuple[tuple[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]:
    """Return T and R of responses and of forces."""
    both = transforms.responses, transforms.forces
    if transforms.are_units:
        return both, both
    if transforms.response_modes is None or transforms.force_modes is None:
        raise ValueError(
            "sides need the rigid motion of the channels: give transform as an Interface (virtual_interface)"
        )
    return both, (transforms.response_modes, transforms.force_modes)


def _check_joint_dofs(transforms: Transforms, h: ComplexArray, names: tuple[str, ...]) -> None:
    """Raise an error for channels that do not show every joint DOF, once on each side."""
    labels = [f"{side}:{name}" for side in "jk" for name in names]
    if not transforms.are_units:
        both = np.array_equal(transforms.responses, transforms.forces)
        check_transform("transform" if both else "transform[0]", transforms.responses, labels)
        check_transform("transform[1]", transforms.forces, labels)
    check_channels(transforms.gamma(h), labels)


def _is_symmetrised(h: ComplexArray) -> bool:
    """Return whether FRFs were made reciprocal: both directions are then one measurement, with one noise."""
    # Usually the first line shows that they were not.
    return all(
        bool((abs(part - part.swapaxes(1, 2)) <= _RECIPROCAL * abs(part)).all())
        for part in (h[own] for own in (slice(1), *line_slices(len(h))))
    )


#: Eigenvalue of the normalised products of rows below which the rows are equal to rounding, or linearly dependent.
_DEPENDENT = 1e-13
#: Number of evenly spaced lines of this check.
_MOST_LINES = 500
#: Relative residual below which a row of a transform is a sum of other rows.
_RANK = 1e-9
#: Relative noise of driving points above which they cannot be recognised.
_HIDDEN = 1.0
#: Share of lines with FRFs above their noise below which there is no signal.
_SEEN = 0.02
#: Residual, relative to the FRFs and to the noise, above which no joint fits.
_NO_FIT, _FAR = 0.5, 2.0
_TINY = float(np.finfo(float).tiny)


def check_transform(name: str, transform: FloatArray, labels: list[str]) -> None:
    """Raise an error for a transform whose joint DOFs are not independent."""
    size = np.linalg.norm(transform, axis=1, keepdims=True)
    rank = int(np.linalg.matrix_rank(transform / size, tol=_RANK))
    if rank < len(transform):
        raise ValueError(
            f"{name}: channels show {rank} of {len(transform)} joint DOFs ({', '.join(labels)}); add channels in other "
            "places or directions"
        )


def check_channels(gamma: ComplexArray, labels: list[str]) -> None:
    """Raise an error for measured FRFs between joint DOFs j, then k, without a signal, or with one DOF twice.

    On both sides of a rigid joint calculated FRFs are equal; measured ones differ by their noise.
    """
    half = len(labels) // 2
    some = gamma[:: -(-len(gamma) // _MOST_LINES)]
    squares = some.real**2 + some.imag**2
    for what, h, of_h in (("responses", some, squares), ("forces", some.swapaxes(1, 2), squares.swapaxes(1, 2))):
        seen = of_h.any(axis=(0, 2))
        if not seen.all():
            dead = [labels[i] for i in np.flatnonzero(~seen)]
            raise ValueError(f"gamma: the {what} {', '.join(dead)} are zero; measure them or leave them out")
        product = _products(h, of_h)
        sides = slice(0, half), slice(half, 2 * half)
        values, vectors = np.linalg.eigh(np.array([product[side, side] for side in sides]))
        for side, least, vector in zip(sides, values[:, 0], vectors[:, :, 0], strict=True):
            if least < _DEPENDENT:
                own = np.array(labels[side])[abs(vector) > 1e-3].tolist()
                raise ValueError(
                    f"gamma: the {what} {', '.join(own)} are not independent; leave out the one that repeats "
                    "others, or their sum"
                )
        for i in range(half):
            # The lower eigenvalue of the products of two rows of norm 1.
            if 1 - abs(product[i, i + half]) < _DEPENDENT and _is_measured(some):
                raise ValueError(
                    f"gamma: the {what} {labels[i]} and {labels[i + half]} are the same numbers, noise included: "
                    "measure both sides of the joint"
                )


def _products(h: ComplexArray, squares: FloatArray) -> ComplexArray:
    """Return products of rows of norm 1, shape (rows, rows), with equal weight for every line and column."""
    of_columns = np.maximum(np.sqrt(squares.mean(axis=(0, 1))), _TINY)
    of_lines = np.maximum(np.sqrt((squares / of_columns / of_columns).mean(axis=(1, 2), keepdims=True)), _TINY)
    # A divisor below the smallest normal number has no finite inverse: dead rows stay 0.
    flat = (h / np.maximum(of_columns * of_lines, _TINY)).swapaxes(0, 1).reshape(h.shape[1], -1)
    product: ComplexArray = flat @ flat.conj().T
    size = np.sqrt(product.diagonal().real)
    return product / size / size[:, None]


def _is_measured(gamma: ComplexArray) -> bool:
    """Return whether there is noise between h_pq and h_qp."""
    return bool(abs(gamma - gamma.swapaxes(1, 2)).max() > 1e-9 * abs(gamma).max())


def check_joint_seen(freq: FloatArray, smooth: ComplexArray, variance: FloatArray) -> None:
    """Raise an error for FRFs that are noise only, or that show nothing across the joint.

    Parameters
    ----------
    freq : ndarray, shape (n_freq,)
        Frequencies, Hz.
    smooth : ndarray, shape (n_freq, 2 n, 2 n)
        Smooth FRFs between joint DOFs j, then k, m/N.
    variance : ndarray, shape (n_freq, 2 n, 2 n)
        Noise variance E|e|^2 of the measured FRFs, (m/N)^2.
    """
    span = f"{freq.min():g} to {freq.max():g} Hz"
    some = spread_lines(len(freq))
    smooth, variance = smooth[some], variance[some]
    n, squares = smooth.shape[1] // 2, smooth.real**2 + smooth.imag**2
    driving = np.sqrt(np.einsum("lpp->lp", squares))
    noise = np.sqrt(np.einsum("lpp->lp", variance)) / np.maximum(driving, _TINY)
    level = float(medians(noise.ravel()))
    if level >= _HIDDEN:
        raise ValueError(
            f"gamma consists of noise: {shown_percent(level)} of the driving points ({len(freq)} lines, {span}), or "
            "its lines are too coarse to show the noise. Measure more averages or finer lines, or state the noise"
        )
    across = squares > ZERO**2 * np.maximum(driving[:, :, None] * driving[:, None, :], _TINY)
    if not across[:, :n, n:].any() and not across[:, n:, :n].any():
        raise ValueError(
            f"gamma is zero between sides j and k of the joint ({span}); check that a joint connects them, and the "
            "order of DOFs"
        )
    seen = (squares > _HIDDEN**2 * variance).mean(axis=0) > _SEEN
    if not seen[:n, n:].any() and not seen[n:, :n].any():
        raise ValueError(
            f"gamma between sides j and k of the joint consists of noise ({span}); measure more averages or another "
            "band"
        )


def check_estimate(found: JointEstimate, level: float, span: str, *, is_level_known: bool) -> None:
    """Raise an error for a result that fits nothing, or with fewer equations than parameters.

    Parameters
    ----------
    found : JointEstimate
        Result of the fit.
    level : float
        Noise relative to the FRFs.
    span : str
        Frequency range as text.
    is_level_known : bool
        Whether the noise level has another source than the residual.
    """
    for group in found.groups:
        equations, unknowns = 2 * group.equations, group.x.size
        if equations < unknowns:
            raise ValueError(
                f"gamma gives {equations:.0f} real equations ({span}) for {unknowns} parameters of the joint; use more "
                "lines or fewer parameters"
            )
    ratio = float(np.sqrt(max(found.excess, 0.0)))
    left = ratio * level
    if left > _NO_FIT and (ratio > _FAR or not is_level_known):
        raise ValueError(
            f"no joint was found that fits gamma ({span}): {shown_percent(left)} of the FRFs is left; check the order "
            "and places of channels (check_frfs), transform and noise"
        )
    variance = np.diagonal(found.covariance)
    names = [
        one.name for one, v, x in zip(found.parameters, variance, found.theta, strict=True) if not (v > 0 and x == x)
    ]
    if names:
        raise ValueError(f"gamma does not determine {', '.join(names)} ({span}); use more lines or fewer parameters")


def shown_percent(share: float) -> str:
    """Return a share in percent, in words if it is far above 1."""
    return f"{100 * share:.0f} %" if share < 10 else "far more than 100 %"
