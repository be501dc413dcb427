"""Stiffness and loss factor of a joint from modal backbones (frequency and damping over amplitude), by models."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
from scipy.special import ndtri

from jointfrf.identification.derived import Derived
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.model.substructure import FrfSource, Substructure, Unknown
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_probability,
    as_real,
    check_type,
    one_line,
)
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.springs import SpringLaw
from jointfrf.messages.finding import Finding
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.amplitude.amplitude_laws import AMPLITUDE_LAWS
from jointfrf.workbench.amplitude.levels import JointLevel, JointLevels, check_laws, of_levels

__all__ = ["Backbone", "backbone_levels"]

#: Step of central differences, in standard errors.
_STEP = 1e-3
#: Points of omega^2 about omega^2 of the mode, in units of the damping ratio, through which a polynomial continues the
#: receptance to the complex frequency, which is as far away as the outermost point. Below the least spacing rounding
#: matters; above the largest spacing frequencies are not positive.
_POINTS, _LEAST, _MOST = np.arange(-2, 3), 1e-4, 0.4


@dataclass(frozen=True)
class Backbone:
    """Frequency and damping of a mode at several amplitudes; give either `damping` or `force`.

    Parameters
    ----------
    channel : str
        DOF of the amplitude, ``"A/1:y"``; empty for the relative motion in the joint itself (with `damping`).
    freq_hz : array_like, shape (n,)
        Frequency of the mode, Hz; in a free decay the frequency of the undamped mode, |s| / (2 pi).
    amplitude : array_like, shape (n,)
        Peak displacement of the channel, m or rad.
    damping : array_like, shape (n,), optional
        Damping ratio.
    force : array_like, shape (n,), optional
        Peak force at the channel in tests at phase resonance, where the motion lags the force by 90 degrees, N or N m.
    freq_error, damping_error : float or array_like, shape (n,)
        Relative standard errors of the frequency, and of damping or of amplitude over force.
    labels : sequence of str, optional
        Names of the points, default their numbers.
    shared_error : tuple of float
        Relative standard errors of frequency and of damping (or force) that all points share, default none.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.Backbone("A/1:y", [261.0, 259.5], [1e-5, 1e-4], damping=[0.002, 0.006]).labels
    ('1', '2')
    """

    channel: str
    freq_hz: FloatArray
    amplitude: FloatArray
    damping: FloatArray | None = None
    force: FloatArray | None = None
    freq_error: float | FloatArray = 0.001
    damping_error: float | FloatArray = 0.05
    labels: tuple[str, ...] = field(default=())
    shared_error: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        check_type("channel", self.channel, str)
        freq = as_real("freq_hz", self.freq_hz, (None,))
        if (self.damping is None) == (self.force is None):
            raise ValueError("damping and force are both given, or neither; give one of them")
        for name in ("freq_hz", "amplitude", "damping", "force"):
            value = getattr(self, name)
            if value is not None:
                own = as_real(name, value, (freq.size,))
                if not own.size or (own <= 0).any():
                    raise ValueError(f"{name} has no numbers or one that is not positive; give positive numbers")
                object.__setattr__(self, name, own)
        if self.damping is not None and (self.damping >= 1).any():
            raise ValueError("damping has a ratio of 1 or more; give ratios below 1")
        for name in ("freq_error", "damping_error"):
            error = as_real(name, np.broadcast_to(getattr(self, name), freq.shape), (freq.size,))
            if (error <= 0).any() or (error >= 1).any():
                raise ValueError(f"{name} is {one_line(getattr(self, name))}; give errors between 0 and 1")
            object.__setattr__(self, name, error)
        shared = as_real("shared_error", self.shared_error, (2,))
        if (shared < 0).any() or (shared >= 1).any():
            raise ValueError(f"shared_error is {one_line(self.shared_error)}; give two errors from 0 to 1")
        if self.force is not None and not self.channel:
            raise ValueError("channel is empty; name the DOF at which the force acts")
        named = tuple(self.labels) if self.labels else tuple(str(i) for i in range(1, freq.size + 1))
        if len(named) != freq.size or not all(isinstance(one, str) for one in named):
            raise ValueError(f"labels are {one_line(self.labels)}; give {freq.size} names, one for each point")
        object.__setattr__(self, "labels", named)


def backbone_levels(
    whole: Assembly,
    backbone: Backbone,
    *,
    dof: str | None = None,
    laws: Iterable[str] = AMPLITUDE_LAWS,
    probability: float = 0.95,
) -> JointLevels:
    """Return k(a) and eta(a) of a joint DOF from the backbone of a mode, by models of the assembly.

    Parameters
    ----------
    whole : Assembly
        Models of both parts, and the joint except the DOF to be identified.
    backbone : Backbone
        Frequency and damping of the mode over amplitude.
    dof : str, optional
        DOF of the joint; needed if more than one has a law.
    laws : iterable of str
        Names of the laws to fit (see `fit_amplitude_laws`), default all; empty for no fit.
    probability : float
        Coverage probability of the intervals, default 0.95.

    Returns
    -------
    JointLevels
        Stiffness and loss factor at each point of the backbone, and the laws.

    Raises
    ------
    ValueError
        A substructure given by FRFs, a DOF or channel that does not exist.
    SingularLineError
        A part that is undamped resonates at the frequency.

    See Also
    --------
    decay_levels : stiffness and loss factor from free decays.
    levels : stiffness and loss factor from fits at several levels.

    Notes
    -----
    Let y be the receptance across the DOF of the open joint. The mode has 1 + K* y = 0 at the complex frequency
    w^2 (1 + 2 i zeta), so K* = -1 / y there. A polynomial through five real frequencies continues y to it. At phase
    resonance H of the driven channel is -i |H|. With c from the channel to the joint, the equation
    H = H_open - c K* c / (1 + K* y) is solved for K* at the frequency itself.

    Intervals are of first order. They contain errors of frequency and damping, and the standard deviations of unknowns
    of the models, which all levels share. The shape of the mode changes with K*. A point of the backbone has one
    amplitude, so mean and scatter of lines do not enter.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [0, 0], ground="start"), ["2:x"], exact=True)
    >>> b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [0, 0], ground="end"), ["1:x"], exact=True)
    >>> whole = jf.Assembly(a, b, jf.LawJoint({"x": jf.SpringLaw(2000.0)}))
    >>> found = jf.backbone_levels(whole, jf.Backbone("A/1:x", [3.2], [1e-3], damping=[0.01]), laws=())
    >>> len(found.levels["x"])
    1
    """
    check_type("whole", whole, Assembly)
    check_type("backbone", backbone, Backbone)
    share, chosen, own = as_probability("probability", probability), check_laws(laws), dof_of_joint(whole, dof)
    for name, part in (("A", whole.a), ("B", whole.b)):
        if isinstance(part.source, FrfSource):
            raise ValueError(f"{name} is given by FRFs; give models of both parts for a backbone")
    whole.check([backbone.channel] if backbone.channel else [], "channel")
    with np.errstate(all="ignore"):  # values that are not finite are checked below
        points, findings = _points(whole, backbone, own), list[Finding]()
    for one, label in zip(points, backbone.labels, strict=True):
        if not np.isfinite([one.k, one.motion, *one.errors]).all():
            raise ValueError(
                f"point {label}: no finite K* of {own} gives this frequency, amplitude and damping; check the models"
            )
    found = [_level(one, label, share) for one, label in zip(points, backbone.labels, strict=True)]
    loose = [name for name, std, _ in _unknowns(whole) if std is None]
    if loose:
        findings.append(Finding("unknown-fixed", about=tuple(loose)))
    wrong = [one.label for one in found if one.stiffness.value <= 0 or one.loss_factor.value <= 0]
    if wrong:
        findings.append(Finding("mode-not-in-models", {"levels": tuple(wrong)}, (own,)))
    around = whole.joint if isinstance(whole.joint, LawJoint) else None
    return of_levels({own: found}, findings, chosen, share, dict.fromkeys(backbone.labels, around))


def dof_of_joint(whole: Assembly, dof: str | None) -> str:
    """Return the named joint DOF, or the only DOF that has a law."""
    known = [a for a, b in whole.joint.laws if a == b]
    if dof is None and len(known) == 1:
        return known[0]
    if not isinstance(dof, str) or dof not in known:
        hint = did_you_mean(dof, known) if isinstance(dof, str) else ""
        raise ValueError(f"dof is {one_line(dof)}; use one of {', '.join(known)}{hint}")
    return dof


def _unknowns(whole: Assembly) -> Iterator[tuple[str, float | None, Callable[[float], Assembly]]]:
    """Yield name and standard deviation of each unknown of the models, and the assembly as a function of its value."""
    for side in ("a", "b"):
        part: Substructure = getattr(whole, side)
        for name, one in part.fitted.items():

            def changed(step: float, side: str = side, name: str = name, part: Substructure = part) -> Assembly:
                model = part.model({name: part.nominal[name] + step})
                own = Substructure(model, part.joint, exact=True)
                a, b = (own, whole.b) if side == "a" else (whole.a, own)
                return Assembly(a, b, whole.joint, whole.attachments)

            yield f"{name} of {side.upper()}", one.std, changed
    for i, attached in enumerate(whole.attachments):
        for name, number in zip(("stiffness", "damping") if len(attached.numbers) > 1 else ("mass",),
                                attached.numbers, strict=True):  # fmt: skip
            if isinstance(number, Unknown):

                def other(step: float, i: int = i, name: str = name, value: float = number.value) -> Assembly:
                    own: dict[str, Any] = {name: value + step}
                    every = list(whole.attachments)
                    every[i] = replace(every[i], **own)
                    return replace(whole, attachments=tuple(every))

                yield f"{name} of attachment {i + 1}", number.std, other


class _Point(NamedTuple):
    """K* of a level, motion in the joint, standard errors of stiffness and loss factor, and parts by each unknown."""

    k: complex
    motion: float
    errors: FloatArray
    common: dict[str, tuple[float, float]]


def _points(whole: Assembly, backbone: Backbone, dof: str) -> list[_Point]:
    """Return K* of all levels with its errors, by central differences."""
    k, motion = _stiffness(whole, backbone, dof)
    second = "force" if backbone.damping is None else "damping"

    def change(name: str, error: float | FloatArray) -> FloatArray:
        value = getattr(backbone, name)
        return _slopes(*(
            _stiffness(whole, replace(backbone, **{name: value * (1 + sign * _STEP * error)}), dof)[0]
            for sign in (1, -1)
        ))  # fmt: skip

    own = [change("freq_hz", backbone.freq_error), change(second, backbone.damping_error)]
    common = {
        f"{name} of all points": change(name, error)
        for name, error in zip(("freq_hz", second), backbone.shared_error, strict=True)
        if error
    }
    for name, std, changed in _unknowns(whole):
        if std is not None:
            ends = [_stiffness(changed(sign * _STEP * std), backbone, dof)[0] for sign in (1, -1)]
            common[name] = _slopes(*ends)
    errors = np.sqrt(np.sum(np.square([*own, *common.values()]), axis=0))
    return [
        _Point(complex(k[i]), float(motion[i]), errors[:, i],
               {name: (float(each[0, i]), float(each[1, i])) for name, each in common.items()})
        for i in range(k.size)
    ]  # fmt: skip


def _slopes(above: ComplexArray, below: ComplexArray) -> FloatArray:
    """Return the changes of stiffness and loss factor by one standard error, shape (2, n)."""
    pairs = [np.array([k.real, k.imag / k.real]) for k in (above, below)]
    return np.asarray((pairs[0] - pairs[1]) / (2 * _STEP))


def _stiffness(whole: Assembly, backbone: Backbone, dof: str) -> tuple[ComplexArray, FloatArray]:
    """Return K* of all levels, and the amplitude of the relative motion."""
    channels = [backbone.channel] if backbone.channel else []
    squared = np.square(backbone.freq_hz)

    def at(freq_hz: FloatArray) -> ComplexArray:
        lines, place = np.unique(freq_hz, return_inverse=True)
        return _across(whole, lines, channels, dof)[place]

    if backbone.force is not None:
        h = at(backbone.freq_hz)
        y, c, free = h[:, 0, 0], h[:, 0, 1], h[:, 1, 1]
        q = (free + 1j * backbone.amplitude / backbone.force) / (h[:, 1, 0] * c)
        k = q / (1 - q * y)
        return k, np.asarray(abs(c / (1 + k * y)) * backbone.force)
    assert backbone.damping is not None
    spacing = np.clip(backbone.damping, _LEAST, _MOST)
    target = 2j * backbone.damping / spacing
    h = np.zeros((squared.size, 1 + len(channels), 1 + len(channels)), np.complex128)
    for point in _POINTS:
        others = _POINTS[point != _POINTS]
        weight = np.prod((target[:, None] - others) / (point - others), axis=1)
        h = h + weight[:, None, None] * at(np.sqrt(squared * (1 + point * spacing)))
    return -1 / h[:, 0, 0], np.asarray(abs(h[:, 0, 0] / h[:, -1, 0]) * backbone.amplitude)


def _across(whole: Assembly, lines: FloatArray, channels: list[str], dof: str) -> ComplexArray:
    """Return receptances between the relative motion of the open joint and channels, shape (n, 1 + m, 1 + m)."""
    joint, i = whole.joint, whole.joint.dofs.index(dof)
    laws = dict(joint.laws) | {(dof, dof): SpringLaw(0.0)}
    opened = whole.with_joint(LawJoint(laws, joint.rigid, joint.mass, joint.dofs))
    names = [f"A/{whole.a.joint[i]}", f"B/{whole.b.joint[i]}", *channels]
    across = np.eye(1 + len(channels), len(names), 1)
    across[0, :2] = 1.0, -1.0
    found: ComplexArray = across @ opened.receptance(lines, names, names) @ across.T
    return found


def receptances_across(
    whole: Assembly, freq_hz: FloatArray, channels: Iterable[str], dof: str
) -> tuple[ComplexArray, ComplexArray]:
    """Return receptances across the open joint, (n,), and from it to channels, (n, n_channels)."""
    lines, place = np.unique(freq_hz, return_inverse=True)
    h = _across(whole, lines, list(channels), dof)[place]
    return h[:, 0, 0], h[:, 1:, 0]


def _level(one: _Point, label: str, share: float) -> JointLevel:
    t = float(ndtri((1 + share) / 2))
    k, eta = (
        Derived(value, float(error), value - t * float(error), value + t * float(error))
        for value, error in zip((one.k.real, one.k.imag / one.k.real), one.errors, strict=True)
    )
    return JointLevel(label, one.motion, one.motion, one.motion, 0, abs(one.k) * one.motion, k, eta, one.common)
