"""Realisations of one draw of noise numbers, on every scale: parameters, and errors of regenerated FRFs."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace

import numpy as np

from jointfrf.cases.definitions import BandSet, Observed
from jointfrf.cases.known_joint.exact import Exact
from jointfrf.cases.known_joint.expected import ExpectedErrors
from jointfrf.cases.known_joint.methods import joint_lines
from jointfrf.cases.known_joint.readings.reading import Draw, NoiseScale, noise_numbers, reference_moduli
from jointfrf.cases.known_joint.regenerate import regenerate
from jointfrf.cases.known_joint.study import chunk_size, means_over_bands
from jointfrf.dofs import rigid_offset
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import in_bands
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["DrawTask", "Realised", "Window", "find_window", "realise"]


@dataclass(frozen=True)
class Window:
    """An FRF that is regenerated in a band: `exact` holds the lines of the band, its observed point moved."""

    known: ExpectedErrors
    exact: Exact
    observed: Observed


@dataclass(frozen=True)
class DrawTask:
    """All realisations of one draw for one method.

    Attributes
    ----------
    exact : Exact
        As far as the method needs it.
    method : str
    h : ndarray, shape (n_freq, m, m)
        Exact FRFs that the method takes, m/N.
    draw : Draw
    scales : tuple of NoiseScale
    band_sets : tuple of BandSet
    windows : tuple of Window
        Regenerated with the means over the first set of bands.
    seed, count : int
        Seed, and number of realisations.
    """

    exact: Exact
    method: str
    h: ComplexArray
    draw: Draw
    scales: tuple[NoiseScale, ...]
    band_sets: tuple[BandSet, ...]
    windows: tuple[Window, ...]
    seed: int
    count: int


@dataclass(frozen=True)
class Realised:
    """What the realisations of a draw on one scale gave.

    Attributes
    ----------
    theta : dict of str to ndarray, shape (count, 2 n)
        Set of bands to stiffness of all DOFs, then damping; NaN where K* could not be computed.
    errors : dict of ExpectedErrors to ndarray, shape (2, count)
        Errors (4.11) and (4.12), percent; NaN where there is no peak in the band.
    """

    theta: dict[str, FloatArray]
    errors: dict[ExpectedErrors, FloatArray]


def find_window(exact: Exact, known: ExpectedErrors, observed: Observed) -> Window:
    """Take the lines of a band, and move the point that is observed where the source looks at another one."""
    inside = in_bands(exact.freq_hz, [known.band])
    inner = slice(exact.n, 2 * exact.n)
    move = rigid_offset(exact.dofs, known.offset) if known.offset else np.eye(exact.n)

    def moved(h: ComplexArray, at: slice) -> ComplexArray:
        transform = np.eye(h.shape[1])
        transform[at, at] = move
        return np.asarray(transform @ h[inside] @ transform.T, np.complex128)

    own = replace(
        exact,
        freq_hz=exact.freq_hz[inside],
        k_initial=exact.k_initial[inside],
        h_initial=exact.h_initial[:0],
        h_c=moved(exact.h_c, exact.where(observed.point)),
        h_a=moved(exact.h_a, inner) if observed.point == "r" else exact.h_a[inside],
        h_b=moved(exact.h_b, inner) if observed.point == "s" else exact.h_b[inside],
    )
    return Window(known, own, observed)


def realise(task: DrawTask) -> list[Realised]:
    """Compute all realisations of a task, one result for each of its scales."""
    n_freq, size, _ = task.h.shape
    moduli = {scale.reference: reference_moduli(task.h, scale.reference) for scale in task.scales}
    theta = np.full((len(task.scales), len(task.band_sets), task.count, 2 * task.exact.n), np.nan)
    at_once = chunk_size(n_freq, size**2)
    for first in range(0, task.count, at_once):
        several = slice(first, min(first + at_once, task.count))
        numbers = noise_numbers(task.draw, task.h.shape, task.seed, first, several.stop - first)
        for s, scale in enumerate(task.scales):
            with warnings.catch_warnings():
                # Noise makes any line ill-conditioned now and then.
                warnings.simplefilter("ignore", IllConditionedWarning)
                k_joint = joint_lines(
                    task.exact, task.method, scale.pollute(task.h, moduli[scale.reference], numbers), "nan"
                )
            for b, band_set in enumerate(task.band_sets):
                theta[s, b, several] = means_over_bands(task.exact, k_joint, band_set)
    return [_realised(task, own) for own in theta]


def _realised(task: DrawTask, theta: FloatArray) -> Realised:
    errors = {window.known: _window_errors(window, theta[0]) for window in task.windows}
    return Realised({band_set.name: own for band_set, own in zip(task.band_sets, theta, strict=True)}, errors)


def _window_errors(window: Window, theta: FloatArray) -> FloatArray:
    """Errors (4.11) and (4.12) of the FRF regenerated from each realisation, shape (2, count), percent."""
    exact, at = window.exact, window.exact.at(window.observed)
    good = np.isfinite(theta).all(axis=1)
    regenerated = regenerate(exact, theta[good], window.observed.point, window.observed.dof)
    actual, found = (_peaks(h, exact.freq_hz) for h in (exact.h_c[None, :, at, at], regenerated))
    errors = np.full((2, len(theta)), np.nan)
    errors[:, good] = abs(found / actual - 1) * 100
    return errors


def _peaks(h: ComplexArray, freq_hz: FloatArray) -> FloatArray:
    """Amplitude and frequency of the largest of (r, n_freq) FRFs, shape (2, r); NaN at an edge: there it is no peak."""
    modulus = np.abs(h)
    at = modulus.argmax(axis=1)
    found = np.array([modulus[np.arange(len(h)), at], freq_hz[at]])
    found[:, (at == 0) | (at == freq_hz.size - 1)] = np.nan
    return found
