"""What `identify` is given, checked and put into a problem for each kind of fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.bands import Band, as_bands, in_bands
from jointfrf.frf.noise_estimate import neighbour_mean, reciprocity_noise
from jointfrf.identification.compliance_fit.joint_terms import CrossTerms, DampingTerms
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_frequency,
    as_lines,
    as_number,
    as_real,
    as_square,
    check_choice,
    check_finite_lines,
)
from jointfrf.substructuring.methods import STIFFNESS_METHODS, JointFrfs, StiffnessMethod, joint_stiffness

__all__ = [
    "BandMeanProblem",
    "BandsOfDofs",
    "ComplianceOptions",
    "ComplianceProblem",
    "MeasuredFrfs",
    "MeasurementNoise",
    "as_dof_names",
    "as_measured",
    "as_transform",
    "prepare_band_mean",
    "prepare_compliance",
]

#: What a user may write for the bands.
BandsOfDofs = None | Band | Sequence[Band] | Mapping[str, Band | Sequence[Band]]

#: FRFs that differ less than this from their transpose were made reciprocal: they do not show their noise.
_RECIPROCAL = 1e-9


@dataclass(frozen=True)
class MeasuredFrfs:
    """Measured FRFs, finite, at least one line.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
    h : ndarray, shape (n_freq, m_r, m_f)
        Responses by forces, m/N.
    """

    freq_hz: FloatArray
    h: ComplexArray


@dataclass(frozen=True)
class MeasurementNoise:
    """Noise model of the measured FRFs: independent between entries, E|e|^2 = level^2 times the variance.

    Attributes
    ----------
    level : float
        0 where it is not known.
    variance : ndarray, shape (n_freq, m, m), or None
        (m/N)^2; |h|^2 where it is None.
    """

    level: float
    variance: FloatArray | None


@dataclass(frozen=True)
class ComplianceOptions:
    """Choices of a compliance fit, as in `identify`."""

    damping: DampingTerms | Literal["auto"]
    cross: CrossTerms
    reciprocal: bool

    def __post_init__(self) -> None:
        """Check the words."""
        check_choice("damping", self.damping, (*get_args(DampingTerms), "auto"))
        check_choice("cross", self.cross, get_args(CrossTerms))


@dataclass(frozen=True)
class ComplianceProblem:
    """A compliance fit, ready to be computed: lines inside the bands only.

    Attributes
    ----------
    dofs : tuple of str
        Names of the n joint DOFs.
    freq_hz : ndarray, shape (n_freq,)
    measured, initial : ndarray, shape (n_freq, m, m)
        Measured FRFs, and those about which is linearised first, m/N.
    transform : ndarray, shape (2 n, m)
        From measured points to joint DOFs j, then k.
    noise : MeasurementNoise
    used : ndarray of bool, shape (n_freq, n)
        Lines used for each DOF.
    bands : tuple
        For each DOF its bands, (low, high) in Hz.
    options : ComplianceOptions
    """

    dofs: tuple[str, ...]
    freq_hz: FloatArray
    measured: ComplexArray
    initial: ComplexArray
    transform: FloatArray
    noise: MeasurementNoise
    used: NDArray[np.bool_]
    bands: tuple[tuple[Band, ...], ...]
    options: ComplianceOptions


@dataclass(frozen=True)
class BandMeanProblem:
    """K*(w) of all lines, to be averaged over bands.

    Attributes
    ----------
    method : str
        How K*(w) was computed.
    dofs : tuple of str
        Names of the n joint DOFs.
    freq_hz : ndarray, shape (n_freq,)
    k_lines : ndarray, shape (n_freq, n, n)
        N/m.
    bands : tuple
        For each DOF its bands, (low, high) in Hz.
    """

    method: StiffnessMethod
    dofs: tuple[str, ...]
    freq_hz: FloatArray
    k_lines: ComplexArray
    bands: tuple[tuple[Band, ...], ...]


def as_measured(freq_hz: ArrayLike, gamma: ArrayLike, *, square: bool = True) -> MeasuredFrfs:
    """Check measured FRFs and their frequencies; `square` asks for as many responses as forces."""
    h = as_square("gamma", gamma) if square else as_lines("gamma", gamma)
    freq = as_frequency(freq_hz, h.shape[0])
    if freq.size == 0:
        raise ValueError("gamma has no frequency lines")
    check_finite_lines("gamma", h, freq)
    return MeasuredFrfs(freq, h)


def prepare_compliance(
    measured: MeasuredFrfs,
    dofs: Sequence[str] | None,
    bands: BandsOfDofs,
    transform: ArrayLike | None,
    noise: float | ArrayLike | None,
    options: ComplianceOptions,
) -> ComplianceProblem:
    """Check the arguments of a compliance fit and keep the lines in the bands; arguments as in `identify`."""
    freq, h = measured.freq_hz, measured.h
    t = as_transform(transform, h.shape[1])
    names = as_dof_names(dofs, t.shape[0] // 2)
    own = as_bands(bands, names, freq)
    used = np.stack([in_bands(freq, b) for b in own], axis=1)
    kept = np.asarray(used.any(axis=1))
    return ComplianceProblem(
        dofs=names,
        freq_hz=freq[kept],
        measured=h[kept],
        # Taken before lines are left out: what is next to a line in a band may lie outside.
        initial=neighbour_mean(h[None])[0, kept],
        transform=t,
        noise=_as_noise(noise, h, kept),
        used=used[kept],
        bands=tuple(map(tuple, own)),
        options=options,
    )


def prepare_band_mean(
    method: StiffnessMethod,
    measured: MeasuredFrfs,
    frfs: JointFrfs,
    dofs: Sequence[str] | None,
    bands: BandsOfDofs,
    transform: ArrayLike | None,
) -> BandMeanProblem:
    """Compute K*(w) and check the rest; `frfs` holds all but what is measured, other arguments as in `identify`."""
    freq, h = measured.freq_hz, measured.h
    if STIFFNESS_METHODS[method].measured == "h_c":
        frfs = replace(frfs, h_c=h)
    elif transform is None:
        frfs = replace(frfs, gamma=h)
    else:
        t = as_transform(transform, h.shape[1])
        frfs = replace(frfs, gamma=t @ h @ t.T)
    k_lines = joint_stiffness(method, frfs, freq_hz=freq)
    names = as_dof_names(dofs, k_lines.shape[1])
    return BandMeanProblem(method, names, freq, k_lines, tuple(map(tuple, as_bands(bands, names, freq))))


def as_dof_names(dofs: Sequence[str] | None, n: int) -> tuple[str, ...]:
    """Return the names of the n joint DOFs, by default their numbers."""
    names = tuple(str(i) for i in range(n)) if dofs is None else tuple(dofs)
    if len(names) != n or len(set(names)) != n or not all(names) or any("," in name for name in names):
        raise ValueError(f"dofs must name {n} different joint DOFs without commas, not {', '.join(names) or 'none'}")
    return names


def as_transform(transform: ArrayLike | None, m: int, name: str = "transform") -> FloatArray:
    """Check a transform from m channels to joint DOFs, shape (2 n, m); without one the channels are the DOFs."""
    t = as_real(name, np.eye(m) if transform is None else transform, (None, m))
    if t.shape[0] == 0 or t.shape[0] % 2:
        what = name if transform is not None else "gamma"
        raise ValueError(f"{what} must have an even number of rows, DOFs j, then k, not {t.shape[0]}")
    if not t.any(axis=1).all():
        row = int(np.flatnonzero(~t.any(axis=1))[0])
        raise ValueError(f"{name}: row {row} is zero, so no channel shows this joint DOF")
    return t


def _as_noise(noise: float | ArrayLike | None, h: ComplexArray, kept: NDArray[np.bool_]) -> MeasurementNoise:
    """Return the noise of the lines kept: as given, or its level from the reciprocity of the FRFs."""
    if noise is None:
        level = float(reciprocity_noise(h[kept][None])[0]) if h.shape[1] > 1 else 0.0
        return MeasurementNoise(level if level > _RECIPROCAL else 0.0, None)
    if np.ndim(noise) == 0:
        level = as_number("noise", noise)
        if level <= 0:
            raise ValueError(f"noise must be positive, not {level:g}")
        return MeasurementNoise(level, None)
    variance = as_real("noise", noise, h.shape)[kept]
    if (variance <= 0).any():
        raise ValueError("noise must hold positive variances")
    return MeasurementNoise(1.0, variance)
