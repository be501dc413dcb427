"""What `identify` is given for a fit on the manifold, checked, with its noise and smooth FRFs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.channels.left_out_dofs import LeftOutDof, left_out_dofs
from jointfrf.channels.point_lines import Interface
from jointfrf.frf.bands import PIECE, Band, as_bands, in_bands, line_slices
from jointfrf.frf.noise_estimate import ZERO
from jointfrf.frf.noise_model import NoiseModel, estimate_noise
from jointfrf.frf.smoothing import near_squares, smooth_frfs
from jointfrf.identification.compliance_fit.estimator import JointEstimate
from jointfrf.identification.compliance_fit.from_nothing import check_channels, check_joint_seen, check_transform
from jointfrf.identification.compliance_fit.interface_frfs import InterfaceFrfs
from jointfrf.identification.compliance_fit.joint_terms import CrossTerms, DampingTerms
from jointfrf.identification.compliance_fit.rigidity import (
    ChannelModes,
    deformation_compliance,
    deformation_variance,
    modes_of,
)
from jointfrf.identification.prepare import BandsOfDofs, MeasuredFrfs, as_dof_names, as_transform
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_number,
    as_real,
    check_choice,
)

__all__ = [
    "FitOptions",
    "FitProblem",
    "KnownNoise",
    "NoiseOptions",
    "Transform",
    "Transforms",
    "as_transforms",
    "prepare_compliance",
]

#: What a transform may be given as.
Transform = ArrayLike | Interface

#: Relative noise where neither the data nor the user say one: the residual then tells.
_ASSUMED_LEVEL = 0.01
#: FRFs that differ less than this from their transpose were made reciprocal.
_RECIPROCAL = 1e-9
#: Smooth FRFs that lie so many standard deviations of the noise off the measured ones are none of a line.
_MISSED = 3.0
#: Relative noise below this is rounding.
_LEAST_LEVEL = 1e-7


@dataclass(frozen=True)
class NoiseOptions:
    """What is known of the noise, as in `identify` and `estimate_noise`."""

    noise: float | ArrayLike | None = None
    coherence: ArrayLike | None = None
    averages: float | None = None
    like: NoiseModel | None = None


@dataclass(frozen=True)
class FitOptions:
    """Choices of a fit on the manifold, as in `identify`."""

    damping: DampingTerms | Literal["auto"] | tuple[DampingTerms, ...]
    cross: CrossTerms
    reciprocal: bool

    def __post_init__(self) -> None:
        """Check the words."""
        if isinstance(self.damping, str):
            check_choice("damping", self.damping, (*get_args(DampingTerms), "auto"))
        else:
            for word in self.damping:
                check_choice("damping", word, get_args(DampingTerms))
        check_choice("cross", self.cross, get_args(CrossTerms))


class Transforms(NamedTuple):
    """From channels to joint DOFs j, then k.

    Attributes
    ----------
    responses, forces : ndarray, shapes (2 n, m_r), (2 n, m_f)
    response_modes, force_modes : ndarray, shapes (m_r, 2 n), (m_f, 2 n), or None
        Rigid motion of the channels, where it is known.
    geometry : Interface or None
        Of the responses, where it is known.
    compliance : ndarray, shape (n,), or None
        What the sides add to the compliance of the joint DOFs, where that was said.
    """

    responses: FloatArray
    forces: FloatArray
    response_modes: FloatArray | None = None
    force_modes: FloatArray | None = None
    geometry: Interface | None = None
    compliance: FloatArray | None = None

    @property
    def are_units(self) -> bool:
        """Whether the channels are the joint DOFs."""
        return all(
            t.shape[0] == t.shape[1] and np.array_equal(t, np.eye(len(t))) for t in (self.responses, self.forces)
        )

    def gamma(self, h: ComplexArray) -> ComplexArray:
        """Return FRFs between the joint DOFs, m/N."""
        return h if self.are_units else self.responses @ h @ self.forces.T

    def variance(self, variance: FloatArray) -> FloatArray:
        """Return their variance where that of the channels is independent, (m/N)^2."""
        return variance if self.are_units else self.responses**2 @ variance @ (self.forces**2).T

    def with_modes(self, smooth: ComplexArray) -> Transforms:
        """Return the same with the rigid modes of plain matrices, as far as smooth FRFs bear them out."""
        if self.are_units:
            return self
        responses, forces = self.response_modes, self.force_modes
        if responses is None:
            responses = modes_of(self.responses, smooth)
        if forces is None:
            forces = modes_of(self.forces, smooth.swapaxes(1, 2))
        return self._replace(response_modes=responses, force_modes=forces)

    @property
    def channels(self) -> tuple[ChannelModes, ChannelModes] | None:
        """Rigid motion of responses and of forces, where both are known."""
        if self.response_modes is None or self.force_modes is None:
            return None
        return ChannelModes(self.responses, self.response_modes), ChannelModes(self.forces, self.force_modes)


@dataclass(frozen=True)
class KnownNoise:
    """Noise of the FRFs as a fit uses it.

    Attributes
    ----------
    level : float
        Median of the noise relative to the FRFs.
    inflation : float
        By how much correlation between lines makes the variance of a mean larger.
    is_assumed : bool
        Whether the level is only a guess, to be replaced by that of the residual.
    outlying : ndarray of int
        Lines whose noise is far above that of the others.
    model : NoiseModel, optional
        Noise of the channels, where it was found from their FRFs.
    is_told : bool
        Whether the user said the noise.
    """

    level: float
    inflation: float
    is_assumed: bool
    outlying: NDArray[np.intp]
    model: NoiseModel | None = None
    is_told: bool = False


class PreparedFrfs(NamedTuple):
    """What smoothing of the channels gives.

    Attributes
    ----------
    smooth : ndarray, shape (n_freq, 2 n, 2 n)
        Smooth FRFs of the joint DOFs, m/N.
    variance : ndarray, shape (n_freq, m_r, m_f)
        Noise of the measured FRFs, (m/N)^2.
    deformation : ndarray, shape (n_freq, m_r, m_f), or None
        Squares of what is not rigid in them, (m/N)^2; None where that is not known.
    compliance : ndarray, shape (n,), or None
        What the sides between the channels add to the compliance of each joint DOF, m/N or rad/(N m).
    transforms : Transforms
        With rigid modes where these are known.
    noise : KnownNoise
    """

    smooth: ComplexArray
    variance: FloatArray
    deformation: FloatArray | None
    compliance: FloatArray | None
    transforms: Transforms
    noise: KnownNoise


@dataclass(frozen=True)
class FitProblem:
    """A fit on the manifold, ready to be computed: lines inside the bands only.

    Attributes
    ----------
    dofs : tuple of str
        Names of the n joint DOFs.
    freq_hz : ndarray, shape (n_freq,)
    frfs : InterfaceFrfs
        Measured and smooth FRFs, their variance, and the way to the joint DOFs.
    noise : KnownNoise
    used : ndarray of bool, shape (n_freq, n)
        Lines used for each DOF.
    bands : tuple
        For each DOF its bands, (low, high) in Hz.
    options : FitOptions
    near : JointEstimate, optional
        Of other FRFs of the same structure: where the fit starts first.
    deformation : ndarray, shape (n_freq, m_r, m_f), optional
        Part of the variance that is not noise: squares of what is not rigid in the channels, (m/N)^2.
    added_compliance : ndarray, shape (n,), optional
        What the sides between the channels add to the compliance of each joint DOF, m/N or rad/(N m).
    left_out : tuple of LeftOutDof
        DOFs that are not sought, but whose motion the channels take for one that is.
    """

    dofs: tuple[str, ...]
    freq_hz: FloatArray
    frfs: InterfaceFrfs
    noise: KnownNoise
    used: NDArray[np.bool_]
    bands: tuple[tuple[Band, ...], ...]
    options: FitOptions
    near: JointEstimate | None = None
    deformation: FloatArray | None = None
    added_compliance: FloatArray | None = None
    left_out: tuple[LeftOutDof, ...] = ()

    def with_noise(self, scale: float) -> FitProblem:
        """Return the same with another noise level."""
        noise = replace(self.noise, level=scale * self.noise.level)
        flexible = 0.0 if self.deformation is None else self.deformation
        variance = (self.frfs.variance - flexible) * scale**2 + flexible
        return replace(self, noise=noise, frfs=self.frfs._replace(variance=variance))


def prepare_compliance(
    measured: MeasuredFrfs,
    dofs: Sequence[str] | None,
    bands: BandsOfDofs,
    transform: Transform | tuple[Transform, Transform] | None,
    noise: NoiseOptions,
    options: FitOptions,
) -> FitProblem:
    """Check the arguments of the fit, find the noise, and keep the lines in the bands; as in `identify`."""
    freq, h = measured.freq_hz, measured.h
    transforms = as_transforms(transform, h)
    responses, forces = transforms[:2]
    if dofs is None and transforms.geometry is not None:
        dofs = transforms.geometry.dofs
    names = as_dof_names(dofs, responses.shape[0] // 2)
    if not isinstance(options.damping, str) and len(options.damping) != len(names):
        raise ValueError(f"damping must hold one word for each of {len(names)} DOFs, not {len(options.damping)}")
    own = as_bands(bands, names, freq)
    used = np.stack([in_bands(freq, b) for b in own], axis=1)
    kept = np.asarray(used.any(axis=1))
    if not kept.all():  # no copy of long sweeps otherwise
        freq, h = freq[kept], h[kept]
    if noise.coherence is not None:
        noise = replace(noise, coherence=as_real("coherence", noise.coherence, measured.h.shape)[kept])
    if noise.noise is not None and np.ndim(noise.noise) > 0:
        noise = replace(noise, noise=as_real("noise", noise.noise, measured.h.shape)[kept])
    # Whether channels are the same points is known where both transforms are one.
    square = h.shape[1] == h.shape[2] and np.array_equal(responses, forces)
    _check_joint_dofs(transforms, h, names)
    found = _known_noise(freq, h, noise, transforms, reciprocal=options.reciprocal and square)
    check_joint_seen(freq, found.smooth, transforms.variance(found.variance))
    return FitProblem(
        dofs=names,
        freq_hz=freq,
        frfs=InterfaceFrfs(
            h,
            found.smooth,
            found.variance if found.deformation is None else found.variance + found.deformation,
            responses,
            forces,
            options.reciprocal,
            symmetrised=square and _is_symmetrised(h),
            response_modes=found.transforms.response_modes,
            force_modes=found.transforms.force_modes,
        ),
        noise=found.noise,
        used=used[kept],
        bands=tuple(map(tuple, own)),
        options=options,
        deformation=found.deformation,
        added_compliance=found.compliance,
        left_out=() if transforms.geometry is None else left_out_dofs(h, transforms.geometry),
    )


def _check_joint_dofs(transforms: Transforms, h: ComplexArray, names: tuple[str, ...]) -> None:
    """Refuse channels that do not show every joint DOF, once on each side."""
    labels = [f"{side}:{name}" for side in "jk" for name in names]
    if not transforms.are_units:
        both = np.array_equal(transforms.responses, transforms.forces)
        check_transform("transform" if both else "transform[0]", transforms.responses, labels)
        check_transform("transform[1]", transforms.forces, labels)
    check_channels(transforms.gamma(h), labels)


def as_transforms(transform: Transform | tuple[Transform, Transform] | None, h: ComplexArray) -> Transforms:
    """Check the transforms of responses and of forces; one for both, or a pair."""
    m_r, m_f = h.shape[1:]
    if transform is None or isinstance(transform, Interface) or not isinstance(transform, tuple):
        if m_r != m_f:
            raise ValueError(
                f"gamma has {m_r} responses and {m_f} forces: transform must be a pair, for responses and for forces"
            )
        pair = (transform, transform)
    elif len(transform) != 2:
        raise ValueError(f"transform must be one matrix or a pair for responses and forces, not {len(transform)}")
    else:
        pair = transform
    one = pair[0] is pair[1]
    names = ("transform", "transform") if one else ("transform[0]", "transform[1]")
    matrices = [
        as_transform(given.transform if isinstance(given, Interface) else given, m, name)
        for given, m, name in zip(pair, (m_r, m_f), names, strict=True)
    ]
    if one:
        matrices[1] = matrices[0]
    if matrices[0].shape[0] != matrices[1].shape[0]:
        raise ValueError(
            f"transform must lead to the same DOFs from responses and forces, not to {matrices[0].shape[0]} and "
            f"{matrices[1].shape[0]}"
        )
    known = [given if isinstance(given, Interface) else None for given in pair]
    compliances = [given.compliance for given in known if given is not None and given.compliance is not None]
    return Transforms(
        responses=matrices[0],
        forces=matrices[1],
        response_modes=None if known[0] is None else known[0].modes,
        force_modes=None if known[1] is None else known[1].modes,
        geometry=known[0],
        compliance=np.max(compliances, axis=0) if compliances else None,
    )


def _is_symmetrised(h: ComplexArray) -> bool:
    """Whether FRFs were made reciprocal: both directions are then one measurement, with one noise."""
    return bool((abs(h - h.swapaxes(1, 2)) <= _RECIPROCAL * abs(h)).all())


def _known_noise(
    freq: FloatArray, h: ComplexArray, options: NoiseOptions, transforms: Transforms, *, reciprocal: bool
) -> PreparedFrfs:
    """Return smooth FRFs of the joint DOFs, the variance of the measured ones, and what else is known of the noise."""
    if options.noise is None:
        return _estimated_noise(freq, h, options, transforms, reciprocal=reciprocal)
    if options.coherence is not None or options.averages is not None:
        raise ValueError("coherence and averages are used where noise is not given: leave one of them out")
    if np.ndim(options.noise) == 0:
        level = as_number("noise", options.noise)
        if level <= 0:
            raise ValueError(f"noise must be positive, not {level:g}")
        variance = _relative_variance(np.sqrt(near_squares(h)), level)
    else:
        variance = as_real("noise", options.noise, h.shape)
        if (variance <= 0).any():
            raise ValueError("noise must hold positive variances")
        level = float(np.median(np.sqrt(variance) / np.maximum(abs(h), np.finfo(float).tiny)))
    smooth = smooth_frfs(freq, h, variance, reciprocal=reciprocal).h
    if np.ndim(options.noise) == 0:
        # Measured FRFs as weights favour lines that noise has made small.
        smooth = smooth_frfs(freq, h, _relative_variance(smooth, level), reciprocal=reciprocal).h
        variance = _relative_variance(smooth, level)
    known = KnownNoise(level, 1.0, False, np.empty(0, np.intp), is_told=True)
    return _prepared(h, _near(smooth, h, variance), variance, transforms, known)


def _prepared(
    h: ComplexArray, smooth: ComplexArray, variance: FloatArray, transforms: Transforms, known: KnownNoise
) -> PreparedFrfs:
    """Take smooth FRFs of the channels to the joint DOFs, and see what is not rigid in them."""
    transforms = transforms.with_modes(smooth)
    deformation, compliance = None, None
    if transforms.channels is not None:
        deformation = deformation_variance(smooth, *transforms.channels)
        compliance = deformation_compliance(h, variance, *transforms.channels)
    if transforms.compliance is not None:
        compliance = np.maximum(transforms.compliance, 0.0 if compliance is None else compliance)
    return PreparedFrfs(transforms.gamma(smooth), variance, deformation, compliance, transforms, known)


def _estimated_noise(
    freq: FloatArray, h: ComplexArray, options: NoiseOptions, transforms: Transforms, *, reciprocal: bool
) -> PreparedFrfs:
    """Find smooth FRFs and noise of the channels from the FRFs themselves."""
    model = estimate_noise(
        freq, h, reciprocal=reciprocal, coherence=options.coherence, averages=options.averages, like=options.like
    )
    # Below this, what looks like noise is rounding.
    is_assumed = model.source == "none" or model.level < _LEAST_LEVEL
    # What a rational function leaves of FRFs that it meets but for so little is no noise, either.
    is_assumed |= model.source == "residual" and not model.smooth.is_smooth
    least = _ASSUMED_LEVEL if is_assumed else _LEAST_LEVEL
    variance = _relative_variance(model.smooth.h, least)
    if not is_assumed:
        np.maximum(model.variance, variance, out=variance)
    # Other realisations start from the model; of a long sweep it would take too much memory.
    kept = model if len(freq) <= PIECE else None
    known = KnownNoise(least if is_assumed else model.level, model.inflation, is_assumed, model.outlying, kept)
    smooth = model.smooth.h.copy() if kept else model.smooth.h
    del model
    return _prepared(h, _near(smooth, h, variance), variance, transforms, known)


def _near(smooth: ComplexArray, h: ComplexArray, variance: FloatArray) -> ComplexArray:
    """Put the measured FRFs in place of the smooth ones on lines that smoothing misses by more than their noise."""
    # Entries that are zero by symmetry hold rounding.
    shown = (smooth != 0).any(axis=0)
    for own in line_slices(len(h)):
        squares = (abs(h[own] - smooth[own]) ** 2 / variance[own])[:, shown].mean(axis=1)
        missed = squares > _MISSED**2
        smooth[own][missed] = h[own][missed]
    return smooth


def _relative_variance(h: ComplexArray | FloatArray, level: float) -> FloatArray:
    """Return level^2 |h|^2, with a floor for FRFs that are zero to rounding."""
    variance = np.empty(h.shape)
    for own in line_slices(len(h)):
        variance[own] = abs(h[own]) ** 2
    least = np.median(variance[:: -(-len(h) // PIECE)], axis=0) * ZERO**2 + ZERO**4 * variance.max()
    np.maximum(variance, least, out=variance)
    variance *= level**2
    return variance
