"""Sensitive bands and averaging in them."""

from __future__ import annotations

import reprlib
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf._sweep import ComplexArray, FloatArray, as_dofs, as_frequency, as_square, as_values
from jointfrf.joint import Joint

__all__ = ["Band", "BandMean", "Sensitivity", "as_bands", "band_mean", "in_bands", "propose_bands", "sensitivity"]

Band = tuple[float, float]


def in_bands(freq_hz: ArrayLike, bands: Sequence[Band]) -> NDArray[np.bool_]:
    """Which lines lie in any of the bands, limits included.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Hz.
    bands : sequence of (low, high)
        Hz.

    Returns
    -------
    ndarray of bool, shape (n_freq,)

    Raises
    ------
    ValueError
        A band is not (low, high), or holds no line.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.in_bands([1, 2, 3, 4], [(2, 3)]).tolist()
    [False, True, True, False]
    """
    freq = as_frequency(freq_hz)
    inside = np.zeros(freq.size, bool)
    for low, high in _pairs(bands):
        here = (freq >= low) & (freq <= high)
        if not here.any():
            extent = f"they run from {freq.min():g} to {freq.max():g} Hz" if freq.size else "there are none"
            raise ValueError(f"the band {low:g} to {high:g} Hz holds no frequency line; {extent}")
        inside |= here
    return inside


def _pairs(bands: object) -> list[Band]:
    """Return bands as pairs of numbers."""
    try:
        pairs = [(float(low), float(high)) for low, high in bands]  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        pairs = [(np.nan, np.nan)]
    if not all(0 <= low <= high < np.inf for low, high in pairs):
        raise ValueError(f"a band must be (low, high) in Hz with 0 <= low <= high, not {reprlib.repr(bands)}")
    return pairs


def as_bands(
    bands: Band | Sequence[Band] | Mapping[str, Band | Sequence[Band]] | None, dofs: Sequence[str], freq_hz: FloatArray
) -> list[list[Band]]:
    """Bands of each DOF from what a user writes: nothing (all lines), one band, several, or one of these for each DOF.

    Parameters
    ----------
    bands : None, (low, high), sequence of (low, high), or mapping of DOF name to these
        Hz. A sequence holds bands that serve all DOFs together.
    dofs : sequence of str
        Names of the DOFs.
    freq_hz : ndarray, shape (n_freq,)
        Hz.

    Returns
    -------
    list of list of (low, high)
        One list for each DOF.

    Raises
    ------
    ValueError
        A name that is not a DOF, a DOF without a band, a band without lines.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> jf.as_bands({"y": (1, 2), "theta": [(1, 2), (3, 4)]}, ["y", "theta"], np.arange(5.0))
    [[(1.0, 2.0)], [(1.0, 2.0), (3.0, 4.0)]]
    """

    def several(entry: Band | Sequence[Band] | None) -> list[Band]:
        if entry is None:
            return [(float(freq_hz.min(initial=np.inf)), float(freq_hz.max(initial=0)))]
        single = isinstance(entry, Sequence | np.ndarray) and len(entry) == 2 and all(np.ndim(x) == 0 for x in entry)
        pairs = _pairs([entry] if single else entry)
        in_bands(freq_hz, pairs)
        return pairs

    if not isinstance(bands, Mapping):
        return [several(bands)] * len(dofs)
    unknown = [name for name in bands if name not in dofs]
    missing = [name for name in dofs if name not in bands]
    if unknown or missing:
        what = f"names {unknown[0]!r}, which is no DOF" if unknown else f"has no band for DOF {missing[0]!r}"
        raise ValueError(f"bands {what}; the DOFs are {', '.join(dofs)}")
    return [several(bands[name]) for name in dofs]


class BandMean(NamedTuple):
    """Means over a band.

    Attributes
    ----------
    stiffness, damping : ndarray, shape (n,)
        Mean of Re K* and of Im K*/w of each DOF: N/m and N s/m, rotational N m/rad and N m s/rad.
    """

    stiffness: FloatArray
    damping: FloatArray


def band_mean(
    freq_hz: ArrayLike,
    k_joint: ArrayLike,
    bands: Band | Sequence[Band] | Mapping[str, Band | Sequence[Band]] | None = None,
    dofs: Sequence[str] | None = None,
) -> BandMean:
    """Mean of Re K* and Im K*/w of each DOF over its sensitive band, as the source does.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Hz; a line at 0 Hz cannot give a damping.
    k_joint : array_like, shape (n_freq, n, n)
        Identified K*.
    bands, dofs
        As in `as_bands`; names ``"0"``, ``"1"``, ... by default.

    Returns
    -------
    BandMean

    Raises
    ------
    ValueError
        Wrong shapes, bands without lines, 0 Hz inside a band.

    Notes
    -----
    The mean of an inverse of noise: where the noise exceeds the joint's compliance, k and c shrink to zero.

    Examples
    --------
    >>> import jointfrf as jf
    >>> joint = jf.Joint([2000.0], [3.0])
    >>> mean = jf.band_mean([3.0, 6.0, 9.0], joint.dynamic_stiffness([3.0, 6.0, 9.0]), (3, 9))
    >>> mean.stiffness.tolist(), mean.damping.round(12).tolist()
    ([2000.0], [3.0])
    """
    lines = as_square("k_joint", k_joint)
    n_freq, n, _ = lines.shape
    freq = as_frequency(freq_hz, n_freq)
    names = [str(i) for i in range(n)] if dofs is None else list(dofs)
    if len(names) != n:
        raise ValueError(f"dofs must name {n} DOFs, not {len(names)}")
    stiffness, damping = np.empty(n), np.empty(n)
    for d, own in enumerate(as_bands(bands, names, freq)):
        inside = in_bands(freq, own)
        if (freq[inside] == 0).any():
            raise ValueError(f"the band of {names[d]} holds 0 Hz, where Im K*/w is not defined")
        k = lines[inside, d, d]
        stiffness[d] = k.real.mean()
        damping[d] = (k.imag / (2 * np.pi * freq[inside])).mean()
    return BandMean(stiffness, damping)


class Sensitivity(NamedTuple):
    """How much an FRF of the assembly moves with the parameters of the joint.

    Attributes
    ----------
    parameters : tuple of str
        ``"k_<dof>"`` for all DOFs, then ``"c_<dof>"``.
    change : ndarray, shape (n_parameters, n_freq)
        Relative change of the FRF for one percent of the parameter, (dH/dp) (p/100)/H, complex.
    """

    parameters: tuple[str, ...]
    change: ComplexArray

    @property
    def in_db(self) -> FloatArray:
        """20 log10 of the modulus of `change`, shape (n_parameters, n_freq), dB."""
        with np.errstate(divide="ignore"):
            decibel: FloatArray = 20 * np.log10(abs(self.change))
        return decibel


def sensitivity(
    freq_hz: ArrayLike,
    h_c: ArrayLike,
    joint: Joint,
    dofs_j: ArrayLike,
    dofs_k: ArrayLike,
    output: int,
    input: int,
) -> Sensitivity:
    """Sensitivity of one FRF of the assembly to each stiffness and damping of the joint.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Hz.
    h_c : array_like, shape (n_freq, n, n)
        Receptance of the assembly with this joint, m/N.
    joint : Joint
        The joint, uncoupled DOFs.
    dofs_j, dofs_k : array_like of int, shape (n_j,)
        Joint DOFs on both sides, in `h_c`, counted from 0.
    output, input : int
        The FRF: response and force DOF in `h_c`, counted from 0.

    Returns
    -------
    Sensitivity

    Raises
    ------
    ValueError
        Wrong shapes or DOFs.

    Notes
    -----
    Exact, from (2.34) for an infinitesimal D: dH_oi/dp = -(H_oj - H_ok) dK*/dp (H_ji - H_ki).

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> h = np.full((1, 1, 1), 0.5)
    >>> joint = jf.Joint([3.0])
    >>> c = jf.couple(h, h, joint.stiffness, [0], [0])
    >>> jf.sensitivity([0.0], c, joint, [0], [1], 0, 1).change[0].real.round(5).tolist()
    [0.0025]
    """
    lines = as_square("h_c", h_c)
    n_freq, n, _ = lines.shape
    freq = as_frequency(freq_hz, n_freq)
    if not isinstance(joint, Joint):
        raise TypeError(f"joint must be a Joint, not {type(joint).__name__}")
    n_j = len(joint.dofs)
    j, k = (as_dofs(name, d, n) - 1 for name, d in (("dofs_j", dofs_j), ("dofs_k", dofs_k)))
    if not j.size == k.size == n_j:
        raise ValueError(f"dofs_j and dofs_k must name {n_j} DOFs each, not {j.size} and {k.size}")
    o, i = as_dofs("output and input", [output, input], n, unique=False) - 1
    through = -(lines[:, o, j] - lines[:, o, k]) * (lines[:, j, i] - lines[:, k, i])  # (n_freq, n_j)
    relative = through.T / lines[:, o, i] / 100
    k_parts = np.diagonal(joint.stiffness) + 1j * np.diagonal(joint.hysteretic_stiffness)
    c_parts = 2j * np.pi * freq * np.diagonal(joint.damping)[:, None]
    names = [f"k_{d}" for d in joint.dofs] + [f"c_{d}" for d in joint.dofs]
    return Sensitivity(tuple(names), np.concatenate([relative * k_parts[:, None], relative * c_parts]))


def propose_bands(
    freq_hz: ArrayLike, change: ArrayLike, *, drop_db: float = 20.0, smooth: float = 0.02, shortest: float = 0.02
) -> list[Band]:
    """Propose sensitive bands: where the sensitivity stays near its largest value.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Hz, increasing.
    change : array_like, shape (n_freq,)
        Relative change of an FRF per percent of a parameter, one row of `Sensitivity.change`.
    drop_db : float
        How far below its largest value the smoothed sensitivity may fall, dB.
    smooth : float
        Width of the moving mean that bridges resonances and antiresonances, as a share of the frequency range.
    shortest : float
        Bands shorter than this share of the range are left out, gaps shorter than it are bridged.

    Returns
    -------
    list of (low, high)
        Hz; empty where the sensitivity is zero throughout.

    Raises
    ------
    ValueError
        Shapes that do not agree, frequencies that do not increase.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> f = np.arange(0.0, 101.0)
    >>> [(float(a), float(b)) for a, b in jf.propose_bands(f, np.where((f > 30) & (f < 60), 1.0, 1e-3))]
    [(30.0, 60.0)]
    """
    freq = as_frequency(freq_hz)
    level = abs(as_values("change", change, freq.size))
    if freq.size < 2 or (np.diff(freq) <= 0).any():
        raise ValueError("freq_hz must hold at least two lines and increase")
    extent = freq[-1] - freq[0]
    power = level**2
    first = np.searchsorted(freq, freq - smooth * extent / 2)
    last = np.searchsorted(freq, freq + smooth * extent / 2, side="right")
    total = np.concatenate([[0.0], np.cumsum(power)])
    smoothed = np.sqrt((total[last] - total[first]) / (last - first))
    inside = smoothed >= smoothed.max() * 10 ** (-drop_db / 20)
    if not smoothed.max() > 0:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
    bands: list[Band] = []
    for start, stop in zip(edges[::2], edges[1::2] - 1, strict=True):
        low, high = float(freq[start]), float(freq[stop])
        if bands and low - bands[-1][1] < shortest * extent:
            bands[-1] = (bands[-1][0], high)
        else:
            bands.append((low, high))
    return [band for band in bands if band[1] - band[0] >= shortest * extent]
