"""Checked arguments of `identify` that all methods share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.frf.bands import Band
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_frequency,
    as_lines,
    as_names,
    as_real,
    as_square,
    check_finite_lines,
)

__all__ = [
    "BandsOfDofs",
    "MeasuredFrfs",
    "as_dof_names",
    "as_measured",
    "as_transform",
]

#: Types that the argument `bands` accepts.
BandsOfDofs = None | Band | Sequence[Band] | Mapping[str, Band | Sequence[Band]]


@dataclass(frozen=True)
class MeasuredFrfs:
    """Measured FRFs, finite, at least one line.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    h : ndarray, shape (n_freq, m_r, m_f)
        Receptances, responses by forces, m/N.
    """

    freq_hz: FloatArray
    h: ComplexArray


def as_measured(freq_hz: ArrayLike, gamma: ArrayLike, *, square: bool = True) -> MeasuredFrfs:
    """Check measured FRFs and their frequencies; `square` asks for as many responses as forces."""
    h = as_square("gamma", gamma) if square else as_lines("gamma", gamma)
    freq = as_frequency(freq_hz, h.shape[0])
    if freq.size == 0:
        raise ValueError("gamma has no frequency lines")
    check_finite_lines("gamma", h, freq)
    return MeasuredFrfs(freq, h)


def as_dof_names(dofs: Sequence[str] | None, n: int) -> tuple[str, ...]:
    """Return the names of the n joint DOFs, by default their numbers."""
    names = tuple(str(i) for i in range(n)) if dofs is None else as_names("dofs", dofs)
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
