"""The mean of K*(w) over bands, as the thesis takes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.dofs import joint_parameters
from jointfrf.frf.bands import Band, as_bands, band_mean, in_bands
from jointfrf.identification.joint_fit import JointFit
from jointfrf.identification.prepare import BandsOfDofs, MeasuredFrfs, as_dof_names, as_transform
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.substructuring.methods import STIFFNESS_METHODS, JointFrfs, StiffnessMethod, joint_stiffness

__all__ = ["BandMeanProblem", "fit_band_mean", "prepare_band_mean"]

_NOTE = "the standard error of a band mean is the scatter of its lines; its bias by noise is not included"


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


def fit_band_mean(problem: BandMeanProblem) -> JointFit:
    """Average K*(w) over the bands of each DOF, as the thesis does; standard errors from the scatter of the lines."""
    freq, names = problem.freq_hz, problem.dofs
    mean = band_mean(freq, problem.k_lines, dict(zip(names, problem.bands, strict=True)), names)
    values = np.concatenate([mean.stiffness, mean.damping]).tolist()
    kept = np.any([in_bands(freq, bands) for bands in problem.bands], axis=0)
    return JointFit(
        method=problem.method,
        dofs=names,
        parameters=dict(zip([one.name for one in joint_parameters(names)], values, strict=True)),
        covariance=np.diag(np.square(_scatter(problem))),
        noise_level=np.nan,
        residual_level=np.nan,
        freq_hz=freq[kept],
        k_lines=problem.k_lines[kept],
        bands=problem.bands,
        notes=(_NOTE,),
    )


def _scatter(problem: BandMeanProblem) -> FloatArray:
    """Return standard errors of the means: the scatter of the lines over the root of their number."""
    freq, k = problem.freq_hz, problem.k_lines
    omega = np.where(freq > 0, 2 * np.pi * freq, np.nan)[:, None, None]
    errors = []
    for part in (k.real, k.imag / omega):
        for d, bands in enumerate(problem.bands):
            values = part[in_bands(freq, bands), d, d]
            errors.append(values.std(ddof=1) / np.sqrt(values.size) if values.size > 1 else np.nan)
    return np.array(errors)
