"""What `identify` is given for a fit on the manifold, checked, with its noise and smooth FRFs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.bands import PIECE, Band, as_bands, in_bands, line_slices
from jointfrf.frf.noise_estimate import ZERO
from jointfrf.frf.noise_model import NoiseModel, estimate_noise
from jointfrf.frf.smoothing import near_squares, smooth_frfs
from jointfrf.identification.manifold_fit.estimator import JointEstimate
from jointfrf.identification.manifold_fit.from_nothing import check_channels, check_joint_seen, check_transform
from jointfrf.identification.manifold_fit.interface_frfs import InterfaceFrfs
from jointfrf.identification.manifold_fit.joint_terms import CrossTerms, DampingTerms
from jointfrf.identification.prepare import BandsOfDofs, MeasuredFrfs, as_dof_names, as_transform
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_number,
    as_real,
    check_choice,
)

__all__ = [
    "KnownNoise",
    "ManifoldOptions",
    "ManifoldProblem",
    "NoiseOptions",
    "Transforms",
    "as_transforms",
    "prepare_manifold",
]

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
class ManifoldOptions:
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
    """From channels to joint DOFs j, then k: shapes (2 n, m_r), (2 n, m_f)."""

    responses: FloatArray
    forces: FloatArray

    @property
    def are_units(self) -> bool:
        """Whether the channels are the joint DOFs."""
        return all(t.shape[0] == t.shape[1] and np.array_equal(t, np.eye(len(t))) for t in self)

    def gamma(self, h: ComplexArray) -> ComplexArray:
        """Return FRFs between the joint DOFs, m/N."""
        return h if self.are_units else self.responses @ h @ self.forces.T

    def variance(self, variance: FloatArray) -> FloatArray:
        """Return their variance where that of the channels is independent, (m/N)^2."""
        return variance if self.are_units else self.responses**2 @ variance @ (self.forces**2).T


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


@dataclass(frozen=True)
class ManifoldProblem:
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
    options : ManifoldOptions
    near : JointEstimate, optional
        Of other FRFs of the same structure: where the fit starts first.
    """

    dofs: tuple[str, ...]
    freq_hz: FloatArray
    frfs: InterfaceFrfs
    noise: KnownNoise
    used: NDArray[np.bool_]
    bands: tuple[tuple[Band, ...], ...]
    options: ManifoldOptions
    near: JointEstimate | None = None


def prepare_manifold(
    measured: MeasuredFrfs,
    dofs: Sequence[str] | None,
    bands: BandsOfDofs,
    transform: ArrayLike | tuple[ArrayLike, ArrayLike] | None,
    noise: NoiseOptions,
    options: ManifoldOptions,
) -> ManifoldProblem:
    """Check the arguments of the fit, find the noise, and keep the lines in the bands; as in `identify`."""
    freq, h = measured.freq_hz, measured.h
    responses, forces = as_transforms(transform, h)
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
    transforms = Transforms(responses, forces)
    _check_joint_dofs(transforms, h, names)
    smooth, variance, known = _known_noise(freq, h, noise, transforms, reciprocal=options.reciprocal and square)
    check_joint_seen(freq, smooth, transforms.variance(variance))
    return ManifoldProblem(
        dofs=names,
        freq_hz=freq,
        frfs=InterfaceFrfs(
            h,
            smooth,
            variance,
            responses,
            forces,
            options.reciprocal,
            symmetrised=square and _is_symmetrised(h),
        ),
        noise=known,
        used=used[kept],
        bands=tuple(map(tuple, own)),
        options=options,
    )


def _check_joint_dofs(transforms: Transforms, h: ComplexArray, names: tuple[str, ...]) -> None:
    """Refuse channels that do not show every joint DOF, once on each side."""
    labels = [f"{side}:{name}" for side in "jk" for name in names]
    if not transforms.are_units:
        both = np.array_equal(transforms.responses, transforms.forces)
        check_transform("transform" if both else "transform[0]", transforms.responses, labels)
        check_transform("transform[1]", transforms.forces, labels)
    check_channels(transforms.gamma(h), labels)


def as_transforms(
    transform: ArrayLike | tuple[ArrayLike, ArrayLike] | None, h: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Check the transforms of responses and of forces; one for both, or a pair."""
    m_r, m_f = h.shape[1:]
    if transform is None or not isinstance(transform, tuple):
        if m_r != m_f:
            raise ValueError(
                f"gamma has {m_r} responses and {m_f} forces: transform must be a pair, for responses and for forces"
            )
        both = as_transform(transform, m_r)
        return both, both
    if len(transform) != 2:
        raise ValueError(f"transform must be one matrix or a pair for responses and forces, not {len(transform)}")
    responses = as_transform(transform[0], m_r, "transform[0]")
    forces = as_transform(transform[1], m_f, "transform[1]")
    if responses.shape[0] != forces.shape[0]:
        raise ValueError(
            f"transform must lead to the same DOFs from responses and forces, not to {responses.shape[0]} and "
            f"{forces.shape[0]}"
        )
    return responses, forces


def _is_symmetrised(h: ComplexArray) -> bool:
    """Whether FRFs were made reciprocal: both directions are then one measurement, with one noise."""
    return bool((abs(h - h.swapaxes(1, 2)) <= _RECIPROCAL * abs(h)).all())


def _known_noise(
    freq: FloatArray, h: ComplexArray, options: NoiseOptions, transforms: Transforms, *, reciprocal: bool
) -> tuple[ComplexArray, FloatArray, KnownNoise]:
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
    known = KnownNoise(level, 1.0, False, np.empty(0, np.intp), is_told=True)
    gamma, of_gamma = transforms.gamma(h), transforms.variance(variance)
    smooth = smooth_frfs(freq, gamma, of_gamma, reciprocal=reciprocal).h
    if np.ndim(options.noise) == 0 and transforms.are_units:
        # Measured FRFs as weights favour lines that noise has made small.
        smooth = smooth_frfs(freq, gamma, _relative_variance(smooth, level), reciprocal=reciprocal).h
        variance = of_gamma = _relative_variance(smooth, level)
    return _near(smooth, gamma, of_gamma), variance, known


def _estimated_noise(
    freq: FloatArray, h: ComplexArray, options: NoiseOptions, transforms: Transforms, *, reciprocal: bool
) -> tuple[ComplexArray, FloatArray, KnownNoise]:
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
    return transforms.gamma(_near(smooth, h, variance)), variance, known


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
