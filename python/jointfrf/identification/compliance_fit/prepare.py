"""What `identify` is given for a compliance fit, checked and put into a problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.joint_channels import LeftOutDof, left_out_dofs
from jointfrf.frf.bands import Band, as_bands, in_bands, line_slices
from jointfrf.identification.manifold.coordinates import CrossTerms, DampingTerms
from jointfrf.identification.manifold.estimate import GroupStart
from jointfrf.identification.manifold.interface_frfs import InterfaceFrfs
from jointfrf.identification.manifold.prepare import check_channels, check_joint_seen, check_transform
from jointfrf.identification.manifold.transforms import Transform, Transforms, as_transforms
from jointfrf.identification.noise import KnownNoise, NoiseOptions, known_noise
from jointfrf.identification.prepare import BandsOfDofs, MeasuredFrfs, as_dof_names
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_names, as_real, check_choice

__all__ = ["FitOptions", "FitProblem", "prepare_compliance"]

#: FRFs that differ less than this from their transpose were made reciprocal.
_RECIPROCAL = 1e-9


@dataclass(frozen=True)
class FitOptions:
    """Choices of a fit on the manifold, as in `identify`."""

    damping: DampingTerms | Literal["auto"] | Sequence[DampingTerms]
    cross: CrossTerms
    reciprocal: bool

    def __post_init__(self) -> None:
        """Check the words."""
        if isinstance(self.damping, str):
            check_choice("damping", self.damping, (*get_args(DampingTerms), "auto"))
        else:
            for word in as_names("damping", self.damping):
                check_choice("damping", word, get_args(DampingTerms))
        check_choice("cross", self.cross, get_args(CrossTerms))


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
    near : tuple of GroupStart
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
    near: tuple[GroupStart, ...] = ()
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
    found = known_noise(freq, h, noise, transforms, reciprocal=options.reciprocal and square)
    check_joint_seen(freq, found.smooth, transforms.variance(found.variance))
    return FitProblem(
        dofs=names,
        freq_hz=freq,
        frfs=InterfaceFrfs.of(
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


def _is_symmetrised(h: ComplexArray) -> bool:
    """Whether FRFs were made reciprocal: both directions are then one measurement, with one noise."""
    # Mostly the first line tells that they were not.
    return all(
        bool((abs(part - part.swapaxes(1, 2)) <= _RECIPROCAL * abs(part)).all())
        for part in (h[own] for own in (slice(1), *line_slices(len(h))))
    )
