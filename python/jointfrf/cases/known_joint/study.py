"""Monte Carlo study of an identification: many realisations of the noise, several methods."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from jointfrf.cases.definitions import BandSet, Noise
from jointfrf.cases.fitting import FITTED, fit_decoupling, fit_viscous
from jointfrf.cases.known_joint.exact import Exact
from jointfrf.cases.known_joint.methods import joint_lines, measured, needed_frfs, noise_stream
from jointfrf.cases.known_joint.read import KnownJointCase
from jointfrf.cases.workers import Workers
from jointfrf.dofs import joint_parameters
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import in_bands
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ALL_LINES", "Identified", "chunk_size", "means_over_bands", "run_study"]

#: Lines, and entries of their FRF matrices, treated at once, over realisations: bound the memory to some tens of MB.
_CHUNK, _CHUNK_ENTRIES = 20_000, 1_500_000
#: Realisations whose K*(w) is kept line by line, for figures.
_KEPT = 200
#: The bands of a fit that takes every line.
ALL_LINES = "all lines"


@dataclass(frozen=True)
class Identified:
    """What one method finds at one noise level, with one set of bands.

    Attributes
    ----------
    noise, method, bands : str
        Names.
    theta : ndarray, shape (n_realisations, n_parameters)
        Parameters: stiffness of all DOFs, then damping.
    k_lines : ndarray, shape (n_kept, n_freq, n)
        Diagonal of K* line by line for the first realisations; empty for a fit over all lines.
    theta_kj : ndarray, shape (n_realisations, n_parameters) or (0, n_parameters)
        For "ismm", which takes K* from D_jk: the parameters from D_kj of the same FRFs.
    """

    noise: str
    method: str
    bands: str
    theta: FloatArray
    k_lines: ComplexArray
    theta_kj: FloatArray


@dataclass(frozen=True)
class _Chunk:
    """One method on some realisations of one noise; `exact` without the FRFs that the method does not take."""

    exact: Exact
    measured: ComplexArray
    noise: Noise
    method: str
    band_sets: tuple[BandSet, ...]
    seed: int
    first: int
    count: int


def chunk_size(n_freq: int, entries: int) -> int:
    """Return how many realisations of `n_freq` lines, with so many entries each, are treated at once."""
    return max(1, min(_CHUNK, _CHUNK_ENTRIES // entries) // n_freq)


class _ChunkResult(NamedTuple):
    """What comes out of a chunk: arrays as in `Identified`, the parameters for each set of bands."""

    theta: FloatArray
    k_lines: ComplexArray
    theta_kj: FloatArray


def _identify(chunk: _Chunk) -> _ChunkResult:
    exact, method = chunk.exact, chunk.method
    seed = chunk.seed + noise_stream(method)
    h = chunk.noise.realisations(chunk.measured, seed, chunk.first, chunk.count)
    with warnings.catch_warnings():
        # Noise makes any line ill-conditioned now and then.
        warnings.simplefilter("ignore", IllConditionedWarning)
        if method in FITTED:
            theta = (
                fit_viscous(exact.freq_hz, exact.dofs, h)
                if method == "compliance"
                else fit_decoupling(exact.freq_hz, exact.dofs, (exact.h_a, exact.h_b), exact.k_initial, h)
            )
            no_lines = np.empty((0, exact.freq_hz.size, exact.n), np.complex128)
            return _ChunkResult(theta[None], no_lines, np.empty((1, 0, theta.shape[1])))
        k_joint = joint_lines(exact, method, h, "nan")
        of_kj = joint_lines(exact, "ismm-kj", h, "nan") if method == "ismm" else k_joint[:0]
    kept = max(0, min(chunk.count, _KEPT - chunk.first))
    k_lines = np.diagonal(k_joint[:kept], axis1=2, axis2=3).copy()
    theta, theta_kj = (
        np.array([means_over_bands(exact, k, band_set) for band_set in chunk.band_sets]) for k in (k_joint, of_kj)
    )
    return _ChunkResult(theta, k_lines, theta_kj)


def means_over_bands(exact: Exact, k_joint: ComplexArray, band_set: BandSet) -> FloatArray:
    """Mean of Re K* and Im K*/w of several realisations, each parameter over its own bands.

    Parameters
    ----------
    exact : Exact
        Names the lines and the n DOFs.
    k_joint : ndarray, shape (r, n_freq, n, n)
        N/m.
    band_set : BandSet

    Returns
    -------
    ndarray, shape (r, 2 n)
        Stiffness of all DOFs, then damping.
    """
    found = np.empty((len(k_joint), 2 * exact.n))
    for p, parameter in enumerate(joint_parameters(exact.dofs)):
        inside, d = in_bands(exact.freq_hz, band_set.bands[parameter]), p % exact.n
        lines = k_joint[:, inside, d, d]
        values = lines.real if p < exact.n else lines.imag / (2 * np.pi * exact.freq_hz[inside])
        found[:, p] = values.mean(axis=1)
    return found


def run_study(
    case: KnownJointCase, exact: Exact, n_realisations: int, workers: Workers | None = None
) -> list[Identified]:
    """Identify the joint of a case from many realisations of every noise by every method.

    Parameters
    ----------
    case : KnownJointCase
    exact : Exact
        Its noise-free FRFs.
    n_realisations : int
    workers : Workers, optional
        Where chunks are computed; in this process by default.

    Returns
    -------
    list of Identified
        One for each noise, method and set of bands (`ALL_LINES` for fits). A realisation depends on the
        seed and its own number only: neither on `workers` nor on how many there are.
    """
    at_work = workers or Workers()
    groups = [(noise, method) for noise in case.noises for method in noise.methods]
    taken = {method: (needed_frfs(exact, method), measured(exact, method)) for _, method in groups}
    size = chunk_size(case.freq_hz.size, (2 * exact.n) ** 2)
    spans = [(first, min(size, n_realisations - first)) for first in range(0, n_realisations, size)]
    chunks = [
        _Chunk(*taken[method], noise, method, case.band_sets, case.seed, first, count)
        for noise, method in groups
        for first, count in spans
    ]
    parts = list(at_work.counted(at_work.map(_identify, chunks), len(chunks)))
    found = []
    for i, (noise, method) in enumerate(groups):
        own = parts[i * len(spans) : (i + 1) * len(spans)]
        theta, theta_kj = (np.concatenate([getattr(p, x) for p in own], axis=1) for x in ("theta", "theta_kj"))
        k_lines = np.concatenate([part.k_lines for part in own])
        names = [ALL_LINES] if method in FITTED else [band_set.name for band_set in case.band_sets]
        found += [Identified(noise.name, method, name, theta[b], k_lines, theta_kj[b]) for b, name in enumerate(names)]
    return found
