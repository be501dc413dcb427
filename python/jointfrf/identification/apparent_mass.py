"""Apparent mass of each side of a joint, and static compliances: a check of the common scale of the FRFs.

Ratios of FRFs do not show a factor that all FRFs share, such as a unit of acceleration. One known mass shows it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from jointfrf.dofs import is_rotation, point_and_direction
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.linear_algebra import invert
from jointfrf.models.model import Model

__all__ = [
    "KNOWN",
    "ApparentMass",
    "ApparentScale",
    "StaticCompliance",
    "apparent_scale",
    "common_factor",
    "model_mass",
]

#: Number of lines of the first fit, and the ratio by which it grows from fit to fit.
_FIRST, _GROWTH = 8, 1.25
#: Probability of a larger sum of squares: below the first value, lines are not on the mass line; above the second, the
#: series is accepted.
_UNFIT, _FIT = 1e-3, 0.05
#: Standard deviations of a 95 % interval.
_REACH = 1.96
#: Relative standard error above which a number is not stated, and share of the next term of the series at the lowest
#: line above which this line is not on the mass line, or not static.
KNOWN = 0.2
#: Relative error that is allowed for a stated mass: sensors, cables, rotations that were not measured.
_STATED = 0.2
#: Factors between FRFs in SI units and FRFs in other units, by the mistaken unit.
_FACTORS = {
    9.80665: "accelerations in g", 4.448222: "forces in lbf", 1000.0: "lengths in mm or forces in kN",
    (2 * np.pi) ** 2: "frequencies in rad/s called Hz", 386.0886: "accelerations in g and lengths in inches",
    39.37008: "lengths in inches",
}  # fmt: skip
#: Share of the forces of single DOFs below which forces of a rigid motion are rounding.
_ROUNDING = 1e-6
#: Relative distance of a ratio from a factor up to which they agree, if the standard error of the ratio is smaller.
_NEAR = 0.1


@dataclass(frozen=True)
class ApparentMass:
    """Apparent mass in one direction, kg.

    Attributes
    ----------
    side : {"j", "k", "j and k"}
        Side of the joint, or both sides together.
    direction : str
        Axis of the translation.
    value, std_error : float
        Mass and its standard error, kg.
    highest : float
        Highest frequency used, Hz.
    is_least : bool
        Whether the mass may be larger, because rotations of the body, which were not measured, reduce it.
    """

    side: str
    direction: str
    value: float
    std_error: float
    highest: float
    is_least: bool

    def __str__(self) -> str:
        least = "at least " if self.is_least else ""
        return f"{least}{self.value:.3g} +- {_REACH * self.std_error:.1g} kg"


@dataclass(frozen=True)
class StaticCompliance:
    """Compliance of the assembly at a joint DOF at 0 Hz, m/N or rad/(N m)."""

    side: str
    dof: str
    value: float
    std_error: float

    def __str__(self) -> str:
        unit = "rad/(N m)" if is_rotation(self.dof) else "m/N"
        return f"{self.value:.3g} +- {_REACH * self.std_error:.1g} {unit} ({self.dof} of side {self.side})"


@dataclass(frozen=True)
class ApparentScale:
    """Apparent masses and compliance from low frequencies; empty if the data determine none.

    Attributes
    ----------
    masses : tuple of ApparentMass
        Masses in each direction.
    compliance : StaticCompliance or None
        Largest static compliance.
    """

    masses: tuple[ApparentMass, ...] = ()
    compliance: StaticCompliance | None = None

    @property
    def of_both(self) -> tuple[ApparentMass, ...]:
        """Return the masses of both sides together."""
        return tuple(one for one in self.masses if one.side == "j and k")

    def of_side(self, side: str) -> ApparentMass | None:
        """Return the most precise mass of a side; if there is none, the largest lower bound."""
        own = [one for one in self.masses if one.side == side]
        whole = [one for one in own if not one.is_least]
        best = min(whole, key=lambda one: one.std_error / one.value, default=None)
        if best is not None:
            return best
        return max(own, key=lambda one: one.value - _REACH * one.std_error, default=None)

    def text(self) -> Iterator[str]:
        """Yield a line of text for the masses and one for the compliance."""
        found = [f"{one} of side {side}" for side in "jk" if (one := self.of_side(side)) is not None]
        both = self.of_side("j and k")
        found += [f"{both} of both"] if both is not None else []
        if found:
            yield f"apparent mass: {', '.join(found)}"
        if self.compliance is not None:
            yield f"largest static compliance: {self.compliance}"

    def contradiction(self, side: str, stated: float) -> str | None:
        """Return a sentence if the FRFs contradict a stated mass, kg; None if they agree or determine no mass."""
        own = self.of_side(side)
        if own is None or abs(own.value - stated) <= _REACH * own.std_error + _STATED * stated:
            return None
        if own.is_least and own.value < stated:
            return None
        where = "both sides" if side == "j and k" else f"side {side}"
        cause = common_factor(own.value / stated, _REACH * own.std_error / own.value)
        hint = f"; {cause} would explain it" if cause else ""
        return f"apparent mass of {where} {own}, {own.value / stated:.3g} times the stated {stated:.4g} kg{hint}"


def common_factor(ratio: float, error: float = 0.0) -> str | None:
    """Return an explanation of a ratio of apparent to true mass: units, each with its factor; None if there is none."""
    near = np.log1p(max(error, _NEAR))
    causes = [
        f"a factor of {factor**power:.4g} ({words}{'' if power > 0 else ', the other way round'})"
        for power in (1, -1)
        for factor, words in _FACTORS.items()
        if abs(np.log(ratio) - power * np.log(factor)) < near
    ]
    return " or ".join(causes) or None


def apparent_scale(
    freq_hz: FloatArray, gamma: ComplexArray, variance: FloatArray, dofs: Sequence[str]
) -> ApparentScale:
    """Estimate apparent masses of both sides of a joint, and the largest static compliance of the assembly.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    gamma, variance : ndarray, shape (n_freq, 2 n, 2 n)
        Receptances between joint DOFs j, then k, m/N, and the noise variance E|e|^2, (m/N)^2.
    dofs : sequence of str, length n
        Names of the joint DOFs.

    Returns
    -------
    ApparentScale
        Masses and compliance with a standard error below 20 %.

    Notes
    -----
    The joint cancels in a row of the inverse: Z_A = (gamma^-1)_jj + (gamma^-1)_jk, H_A = Z_A^-1. A free side has
    -w^2 H_A = M^-1 + w^2 B + ... with its mass matrix M at the joint, as the free assembly has for gamma_jj. The series
    is fitted to the lowest lines, as many as it fits within their noise.
    """
    usable = np.isfinite(gamma).all(axis=(1, 2)) & np.isfinite(variance).all(axis=(1, 2)) & (freq_hz > 0)
    order = np.flatnonzero(usable)[np.argsort(freq_hz[usable])]
    omega, gamma, variance = 2 * np.pi * freq_hz[order], gamma[order], variance[order]
    if omega.size < _FIRST:
        return ApparentScale()
    n, names = len(dofs), tuple(dofs)
    masses = [one for side in "jk" for one in _masses(side, omega, *_of_side(side, gamma, variance), names)]
    for own in (slice(n), slice(n, None)):
        masses += _masses("j and k", omega, gamma[:, own, own], variance[:, own, own], names)
    # A grounded assembly has a static compliance, a free one a mass.
    static = [] if masses else list(_compliances(omega, gamma, variance, names))
    return ApparentScale(tuple(masses), max(static, key=lambda one: one.value, default=None))


def _of_side(side: str, gamma: ComplexArray, variance: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Return receptances of a side without the joint and the second side, and their variance; NaN if singular."""
    n = gamma.shape[1] // 2
    both = np.vstack([np.eye(n), np.eye(n)])
    one = both * np.repeat([side == "j", side == "k"], n)[:, None]
    with np.errstate(all="ignore"):
        z = invert(gamma, on_singular="nan")
        h = invert(np.ascontiguousarray(one.T @ z @ both), on_singular="nan")
        left, right = h @ one.T @ z, z @ both @ h
        return h, np.asarray(abs(left) ** 2 @ variance @ abs(right) ** 2, float)


def _masses(
    side: str, omega: FloatArray, h: ComplexArray, variance: FloatArray, dofs: tuple[str, ...]
) -> Iterator[ApparentMass]:
    """Yield the mass in each direction of a body with these receptances, if it is free."""
    usable = np.isfinite(h).all(axis=(1, 2)) & np.isfinite(variance).all(axis=(1, 2))
    omega, h, variance = omega[usable], h[usable], variance[usable]
    inverse, spread, highest = np.zeros((len(dofs), len(dofs))), np.zeros((len(dofs), len(dofs))), omega.size
    for p, q in np.ndindex(inverse.shape):
        w2 = omega**2
        found = _series(omega, -w2 * h[:, p, q].real, w2 * np.sqrt(variance[:, p, q] / 2))
        if found is None:
            return
        (inverse[p, q], slope, *_), errors, last = found
        spread[p, q], highest = errors[0] ** 2, min(highest, last)
        known = _is_known(float(inverse[p, q]), float(errors[0]), float(slope * omega[0] ** 2))
        if p == q and not (known or is_rotation(dofs[p])):
            return
    up_to = float(omega[highest] / (2 * np.pi))
    mass = np.linalg.pinv((inverse + inverse.T) / 2)
    error = np.sqrt(mass**2 @ ((spread + spread.T) / 4) @ mass**2)
    turns = any(is_rotation(dof) for dof in dofs)
    for direction in dict.fromkeys(point_and_direction(dof)[1] for dof in dofs if not is_rotation(dof)):
        moved = np.array([point_and_direction(dof)[1] == direction for dof in dofs])
        value, own = float(mass[np.ix_(moved, moved)].sum()), float(np.linalg.norm(error[np.ix_(moved, moved)]))
        if turns and _is_known(value, own):
            yield ApparentMass(side, direction, value, own, up_to, is_least=False)
            continue
        for p in np.flatnonzero(moved):
            value = 1 / inverse[p, p]
            yield ApparentMass(side, direction, value, value**2 * float(np.sqrt(spread[p, p])), up_to, is_least=True)


def _is_known(value: float, error: float, next_term: float = 0.0) -> bool:
    """Return whether a number is positive and precise, and the next term of its series small at the lowest line."""
    return max(error, abs(next_term)) < KNOWN * value


def _compliances(
    omega: FloatArray, gamma: ComplexArray, variance: FloatArray, dofs: tuple[str, ...]
) -> Iterator[StaticCompliance]:
    for i in range(2 * len(dofs)):
        found = _series(omega, gamma[:, i, i].real, np.sqrt(variance[:, i, i] / 2))
        if found is not None:
            (value, slope, *_), errors, _ = found
            if _is_known(value, errors[0], slope * omega[0] ** 2):
                yield StaticCompliance("jk"[i // len(dofs)], dofs[i % len(dofs)], value, errors[0])


def _series(omega: FloatArray, y: FloatArray, std: FloatArray) -> tuple[FloatArray, FloatArray, int] | None:
    """Fit a series in w^2 to the lowest lines; return terms, standard errors, and the last line.

    The fit uses as many lines as three terms fit; one more term absorbs the remaining misfit on these lines.
    """
    count, last = _FIRST, None
    while count <= omega.size:
        chance = _least_squares(omega[:count], y[:count], std[:count], 3)[2]
        if not chance > _UNFIT:
            break
        if chance > _FIT or last is None:
            last = count
        count = max(count + 1, int(count * _GROWTH))
    if last is None:
        return None
    terms, errors, _ = _least_squares(omega[:last], y[:last], std[:last], 4)
    return terms, errors, last - 1


def _least_squares(
    omega: FloatArray, y: FloatArray, std: FloatArray, count: int
) -> tuple[FloatArray, FloatArray, float]:
    """Return terms of a series in w^2, their standard errors, and the chance of larger squares."""
    weight = 1 / np.maximum(std, np.finfo(float).tiny)
    terms = (omega[:, None] / omega[-1]) ** (2 * np.arange(count)) * weight[:, None]
    inverse = np.linalg.pinv(terms)
    at, unit = inverse @ (y * weight), omega[-1] ** (2.0 * np.arange(count))
    squares = float(((y * weight - terms @ at) ** 2).sum())
    return at / unit, np.linalg.norm(inverse, axis=1) / unit, float(chdtrc(y.size - count, squares))


def model_mass(model: Model, direction: str) -> float | None:
    """Return the mass of a model that can move freely along a direction, kg; None if it cannot."""
    moved = np.array([dof.rpartition(":")[2] == direction for dof in model.dofs], float)
    force, size = model.stiffness @ moved, abs(model.stiffness) @ moved
    if not moved.any() or (abs(force) > _ROUNDING * size.max()).any():
        return None
    return float(moved @ (model.mass @ moved))
