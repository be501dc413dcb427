"""FRFs of the preloaded solid model and of the single beams of a bolted lap joint, and resonances of the tip."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from jointfrf.dofs import DIRECTIONS
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import Band, has_peak, peak
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.substructuring.coupling import couple
from jointfrf.workbench.cases.bolted_lap.contact import ContactLaw
from jointfrf.workbench.cases.bolted_lap.keys import BoltedLapCase
from jointfrf.workbench.cases.bolted_lap.lap import BoltedLap, bolted_lap
from jointfrf.workbench.cases.bolted_lap.preload import PreloadedLap, preload
from jointfrf.workbench.cases.bolted_lap.routes import DOFS, FivePoints
from jointfrf.workbench.solids.brick_beam import Hole, brick_beam
from jointfrf.workbench.solids.mesh import Mesh, interpolation
from jointfrf.workbench.solids.solid import Patch, SolidModel, mean_motion

__all__ = [
    "JOINT_DOFS",
    "TIP_DIRECTIONS",
    "BeamFrfs",
    "Resonance",
    "ResonanceErrors",
    "SolidFrfs",
    "beam_frfs",
    "resonance_errors",
    "resonances",
    "solid_frfs",
]

#: Number of natural frequencies of the solid model.
_MODES = 12
#: Spacing of the lines around a peak, and their extent, in half-power bandwidths.
_SPACING, _EXTENT = 1 / 8, 3
#: Lines closer than this fraction of their frequency are merged.
_COINCIDENT = 1e-6
#: Least loss factor that sets the spacing of lines.
_LEAST_LOSS = 0.005
#: Directions in which FRFs of the tip are compared.
TIP_DIRECTIONS = ("x", "y")
#: Positions of the joint DOFs in the DOFs of each beam.
JOINT_DOFS = list(range(6))


@dataclass(frozen=True)
class SolidFrfs:
    """Preloaded solid model and its FRFs.

    Attributes
    ----------
    state : PreloadedLap
        Static state under preload.
    model : SolidModel
        Linear model about this state.
    points : tuple of FivePoints
        Measured points on sides j and k.
    channels : ndarray, shape (n_freq, 30, 30)
        Receptances between the measured channels, m/N; empty if only the tip is computed.
    reference : ndarray, shape (n_freq, 12, 12)
        Receptances between the six-DOF reference points of both sides, m/N; empty if only the tip is computed.
    natural_frequencies : ndarray, shape (12,)
        Natural frequencies of the model, Hz.
    tip_hz : ndarray, shape (n_tip,)
        Frequency lines of the case, and close lines around the natural frequencies, Hz.
    tip : ndarray, shape (n_tip, 2)
        Receptances of the tip in `TIP_DIRECTIONS`, m/N.
    """

    state: PreloadedLap
    model: SolidModel
    points: tuple[FivePoints, FivePoints]
    channels: ComplexArray
    reference: ComplexArray
    natural_frequencies: FloatArray
    tip_hz: FloatArray
    tip: ComplexArray


@dataclass(frozen=True)
class BeamFrfs:
    """FRFs of the substructures: A at the joint; B at the joint, and at its tip in `TIP_DIRECTIONS`.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequency lines of the case, and additional lines that resolve the peaks of the assembly, Hz.
    h_a, h_b : ndarray, shapes (n_freq, 6, 6), (n_freq, 8, 8)
        Receptances of A and B, m/N.
    """

    freq_hz: FloatArray
    h_a: ComplexArray
    h_b: ComplexArray

    def on(self, freq_hz: FloatArray) -> BeamFrfs:
        """Return the FRFs on some of the lines."""
        at = np.searchsorted(self.freq_hz, freq_hz)
        return BeamFrfs(freq_hz, self.h_a[at], self.h_b[at])

    def coupled(self, k_joint: ComplexArray) -> ComplexArray:
        """Return the receptance of the assembly with a joint (2.26), DOFs of A, then of B."""
        return couple(self.h_a, self.h_b, k_joint, JOINT_DOFS, JOINT_DOFS)

    def tip(self, k_joint: ComplexArray) -> ComplexArray:
        """Return FRFs of the tip of the assembly with an identified joint, shape (n_freq, 2), m/N."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", IllConditionedWarning)  # identified joints may be absurd
            h_c = self.coupled(k_joint)
        return np.stack([h_c[:, at, at] for at in (12, 13)], axis=1)


def solid_frfs(case: BoltedLapCase, length_b: float, measured: bool) -> SolidFrfs:
    """Return the FRFs of the linear model about the preloaded state, at all channels or only at the tip."""
    lap = _lap(case, length_b)
    state = preload(lap, case.preload, ContactLaw(friction=case.friction))
    model = state.model()
    height = case.beams.height
    on_j, on_k = (lap.axis + np.array([0, y, 0]) for y in (height, -height))
    points = (FivePoints(on_j, case.spacing), FivePoints(on_k, case.spacing))
    weights = [_tip(model.mesh)]
    if measured:
        weights += [interpolation(model.mesh, *side.channels) for side in points]
        rings = (lap.interfaces["head"].lower, lap.interfaces["nut"].upper)
        weights += [_mean(model.mesh, ring, at, DOFS) for ring, at in zip(rings, (on_j, on_k), strict=True)]
    natural = model.natural_frequencies(_MODES)
    freq = _with_lines_around(case, natural)
    h = model.receptance(freq, sparse.vstack(weights) @ model.expansion)
    tip = np.stack([h[:, 0, 0], h[:, 1, 1]], axis=1)
    of_case = h[np.searchsorted(freq, case.freq_hz)]
    channels, reference = of_case[:, 2:32, 2:32].copy(), of_case[:, 32:, 32:].copy()
    return SolidFrfs(state, model, points, channels, reference, natural, freq, tip)


def _loss(case: BoltedLapCase) -> float:
    return max(case.beams.material.loss_factor, _LEAST_LOSS)


def _with_lines_around(case: BoltedLapCase, natural: FloatArray) -> FloatArray:
    """Return lines of the case, and lines around natural frequencies with a spacing from the loss factor."""
    steps = np.arange(-_EXTENT, _EXTENT + _SPACING, _SPACING)
    close = (natural[:, None] * (1 + _loss(case) * steps)).ravel()
    first, last = case.freq_hz[[0, -1]]
    return _joined(case.freq_hz, close[(close > first) & (close < last)])


def _close_lines(case: BoltedLapCase) -> FloatArray:
    """Return lines of the case, and lines over its whole range with a spacing from the loss factor."""
    first, last = case.freq_hz[[0, -1]]
    count = int(np.log(last / first) / np.log1p(_SPACING * _loss(case))) + 2
    return _joined(case.freq_hz, np.geomspace(first, last, count)[1:-1])


def _joined(lines: FloatArray, close: FloatArray) -> FloatArray:
    """Return all lines of the case, and close lines that do not nearly coincide with any other line."""
    every = np.unique(np.concatenate([lines, close]))
    gaps = np.concatenate([[np.inf], np.diff(every), [np.inf]])
    apart = np.minimum(gaps[:-1], gaps[1:]) > _COINCIDENT * every
    joined: FloatArray = every[apart | np.isin(every, lines)]
    return joined


def _lap(case: BoltedLapCase, length_b: float) -> BoltedLap:
    beams = case.beams
    return bolted_lap(
        (beams.lengths[0], length_b), (beams.height, beams.height), beams.width, beams.overlap, beams.hole_radius,
        case.bolt, materials=(beams.material, beams.material), preset=beams.preset,
    )  # fmt: skip


def _tip(mesh: Mesh) -> sparse.csr_array:
    """Return weights of all nodes for the mean motion of the end of B."""
    nodes = mesh.nodes
    end = np.flatnonzero(nodes[:, 2] > nodes[:, 2].max() - 1e-9).astype(np.int32)
    return _mean(mesh, end, nodes[end].mean(axis=0), TIP_DIRECTIONS)


def _mean(mesh: Mesh, nodes: NDArray[np.int32], point: FloatArray, dofs: tuple[str, ...]) -> sparse.csr_array:
    """Return weights of all nodes for the mean rigid motion of given nodes about a point, in the order of the DOFs."""
    return mean_motion(mesh, Patch(point, nodes))[[DIRECTIONS.index(dof) for dof in dofs]]


def beam_frfs(case: BoltedLapCase, length_b: float) -> BeamFrfs:
    """Return FRFs of the single beams, with reference points at the faces under the head and the nut."""
    beams = case.beams
    size = (beams.width, beams.height, beams.material)
    start = beams.overlap / 2
    hole_a = Hole(beams.lengths[0] - start, beams.hole_radius, case.bolt.head_radius, "top", "joint")
    hole_b = Hole(start, beams.hole_radius, case.bolt.nut_radius, "bottom", "joint")
    a = brick_beam(beams.lengths[0], *size, ends=("clamped", "free"), hole=hole_a, preset=beams.preset)
    b = brick_beam(length_b, *size, hole=hole_b, observed={"tip": length_b}, preset=beams.preset)
    freq = _close_lines(case)
    joint = [f"joint:{dof}" for dof in DOFS]
    tip = [f"tip:{axis}" for axis in TIP_DIRECTIONS]
    h_a, h_b = (model.receptance(freq, model.ports(*names)) for model, names in ((a, joint), (b, joint + tip)))
    return BeamFrfs(freq, h_a, h_b)


#: Half-width of the search band of a regenerated resonance, as a fraction of its actual frequency.
_REACH = 0.15
#: Least prominence of a peak, as a factor.
_PROMINENCE = 1.5


@dataclass(frozen=True)
class Resonance:
    """Resonance of the actual FRF: direction, frequency in Hz, amplitude in m/N, and search band in Hz."""

    direction: str
    freq_hz: float
    amplitude: float
    band: Band


class ResonanceErrors(NamedTuple):
    """Errors of a regenerated FRF at every resonance.

    Attributes
    ----------
    amplitude, frequency : ndarray, shape (n_peaks,)
        Errors (4.11) and (4.12), percent.
    found : ndarray of bool, shape (n_peaks,)
        Whether the regenerated FRF has a peak in the band. Without a peak, the largest value is at an end of the band.
        The frequency error is then the limit of the search, and the amplitude error is NaN.
    """

    amplitude: FloatArray
    frequency: FloatArray
    found: NDArray[np.bool_]


def resonances(freq_hz: FloatArray, tip: ComplexArray) -> list[Resonance]:
    """Return resonances of the FRFs of the tip, shape (n_freq, 2); each band ends at the minima on both sides."""
    from scipy.signal import find_peaks  # takes as long to import as all else together

    found = []
    for d, direction in enumerate(TIP_DIRECTIONS):
        size = np.log(abs(tip[:, d]))
        tops = find_peaks(size, prominence=np.log(_PROMINENCE))[0]
        parts = np.split(np.arange(freq_hz.size), tops)
        valleys = [part[np.argmin(size[part])] for part in parts]
        for at, left, right in zip(tops, valleys, valleys[1:], strict=False):
            low = max(freq_hz[left], freq_hz[at] * (1 - _REACH))
            high = min(freq_hz[right], freq_hz[at] * (1 + _REACH))
            band = (float(low), float(high))
            amplitude, freq = peak(tip[:, d], freq_hz, band, refine=True)
            found.append(Resonance(direction, freq, amplitude, band))
    return found


def resonance_errors(freq_hz: FloatArray, peaks: list[Resonance], h: ComplexArray) -> ResonanceErrors:
    """Return errors of regenerated FRFs of the tip, shape (n_freq, 2), with peaks interpolated between the lines."""
    errors = []
    for one in peaks:
        own = h[:, TIP_DIRECTIONS.index(one.direction)]
        amplitude, freq = peak(own, freq_hz, one.band, refine=True)
        found = has_peak(own, freq_hz, one.band)
        in_amplitude = abs(amplitude / one.amplitude - 1) * 100 if found else np.nan  # (4.11)
        errors.append((in_amplitude, abs(freq / one.freq_hz - 1) * 100, found))  # (4.12)
    amplitudes, frequencies, which = np.array(errors, np.float64).reshape(-1, 3).T
    return ResonanceErrors(amplitudes, frequencies, which.astype(bool))
