"""Sensitivity of an FRF of the assembly to the joint, and the resulting sensitive bands."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.dofs import joint_parameters
from jointfrf.frf.bands import Band
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_dofs, as_frequency, as_number, as_square, as_values

__all__ = ["Sensitivity", "propose_bands", "sensitivity"]


class Sensitivity(NamedTuple):
    """Sensitivity of an FRF of the assembly to the parameters of the joint.

    Attributes
    ----------
    parameters : tuple of str
        Names ``"k_<dof>"`` of all DOFs, then ``"c_<dof>"``.
    change : ndarray, shape (n_parameters, n_freq)
        Relative change of the FRF for one percent of the parameter, (dH/dp) (p/100)/H, complex.
    """

    parameters: tuple[str, ...]
    change: ComplexArray

    @property
    def in_db(self) -> FloatArray:
        """Modulus of `change`, 20 log10, shape (n_parameters, n_freq), dB."""
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
    """Return the sensitivity of one FRF of the assembly to each stiffness and damping of the joint.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz.
    h_c : array_like, shape (n_freq, n, n)
        Receptance of the assembly with this joint, m/N.
    joint : Joint
        Joint with uncoupled DOFs.
    dofs_j, dofs_k : array_like of int, shape (n_j,)
        Joint DOFs on both sides, in `h_c`, counted from 0.
    output, input : int
        Response and force DOF of the FRF in `h_c`, counted from 0.

    Returns
    -------
    Sensitivity
        Relative changes of the FRF by parameter and line.

    Raises
    ------
    ValueError
        Wrong shapes or DOFs.

    See Also
    --------
    propose_bands : bands of high sensitivity.

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
    names = tuple(one.name for one in joint_parameters(joint.dofs))
    return Sensitivity(names, np.concatenate([relative * k_parts[:, None], relative * c_parts]))


def propose_bands(
    freq_hz: ArrayLike, change: ArrayLike, *, drop_db: float = 20.0, smooth: float = 0.02, shortest: float = 0.02
) -> list[Band]:
    """Propose sensitive bands, in which the sensitivity is near its largest value.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz, increasing.
    change : array_like, shape (n_freq,)
        Relative change of an FRF per percent of a parameter, one row of `Sensitivity.change`.
    drop_db : float
        Largest drop of the smoothed sensitivity below its largest value, dB.
    smooth : float
        Width of the moving mean that bridges resonances and antiresonances, as a share of the frequency range.
    shortest : float
        Least length of bands and of gaps between them, as a share of the range.

    Returns
    -------
    list of (low, high)
        Bands, Hz; empty if the sensitivity is zero throughout.

    Raises
    ------
    ValueError
        Shapes that do not agree, frequencies that do not increase.

    See Also
    --------
    sensitivity : sensitivity of an FRF.
    identify_band_mean : mean of K* over bands.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> f = np.arange(0.0, 101.0)
    >>> [(float(a), float(b)) for a, b in jf.propose_bands(f, np.where((f > 30) & (f < 60), 1.0, 1e-3))]
    [(30.0, 60.0)]
    """
    freq = as_frequency(freq_hz)
    level = abs(as_values("change", change, freq.size))
    for name, number in (("drop_db", drop_db), ("smooth", smooth), ("shortest", shortest)):
        as_number(name, number)
    if freq.size < 2 or (np.diff(freq) <= 0).any():
        raise ValueError("freq_hz must contain at least two increasing lines")
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
