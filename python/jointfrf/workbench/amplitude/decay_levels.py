"""Stiffness and loss factor of a joint from free decays of modes, by models of the assembly."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from jointfrf.identification.model.assembly import Assembly
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_real, check_type, one_line
from jointfrf.messages.finding import Finding, worst_first
from jointfrf.workbench.amplitude.amplitude_laws import AMPLITUDE_LAWS
from jointfrf.workbench.amplitude.backbone import Backbone, backbone_levels, dof_of_joint, receptances_across
from jointfrf.workbench.amplitude.decay import ModalDecay, pooled
from jointfrf.workbench.amplitude.levels import JointLevels

__all__ = ["decay_levels"]

#: Relative step of omega^2 of the slope of a receptance.
_STEP = 1e-4
#: Modal assurance criterion of measured shape and models below which they are two modes.
_ALIKE = 0.9


def decay_levels(
    whole: Assembly,
    decays: ModalDecay | Sequence[ModalDecay],
    *,
    channels: Mapping[str, str] | None = None,
    dof: str | None = None,
    errors: tuple[float, float] = (0.001, 0.0),
    laws: Iterable[str] = AMPLITUDE_LAWS,
    probability: float = 0.95,
) -> JointLevels:
    """Return k(a) and eta(a) of a joint DOF from free decays of modes, by models of the assembly.

    Parameters
    ----------
    whole : Assembly
        Models of both parts, and the joint except the DOF to be identified.
    decays : ModalDecay or sequence of ModalDecay
        Modes over amplitude from `decay_of_mode`.
    channels : mapping of str to str, optional
        DOF of the models by the name of the sensor, ``{"acc1": "A/1:y", "acc2": "-B/25:y"}``; by default the names of
        sensors are DOFs. Sensors without a DOF are not used.
    dof : str, optional
        DOF of the joint; needed if more than one has a law.
    errors : tuple of float
        Relative standard errors of frequency and damping that all levels share, in addition to the unknowns of the
        models, default (0.001, 0).
    laws : iterable of str
        Names of the laws to fit (see `fit_amplitude_laws`), default all; empty for no fit.
    probability : float
        Coverage probability of the intervals, default 0.95.

    Returns
    -------
    JointLevels
        Stiffness and loss factor at each level of the decays, and the laws.

    Raises
    ------
    ValueError
        No sensor is a DOF of the models; a substructure given by FRFs, or a DOF or channel that does not exist.

    See Also
    --------
    decay_of_mode : frequency and damping over amplitude from a record.
    backbone_levels : stiffness and loss factor from a backbone.

    Notes
    -----
    A sensor with the displacement x of the first harmonic has the modal amplitude q = x/phi, where phi is its component
    of the mass-normalised mode. The energy of the mode changes by dE = omega dJ with the action J = omega q^2/2. A
    cycle loses pi Im(K*) a^2 in the joint. So the damping of the linear mode that K*(a) would have is

        zeta omega = -d ln(x)/dt + d ln(phi)/dt - 1/2 d ln(omega)/dt

    This is less than the decay rate if the frequency rises while the amplitude falls. phi follows K* along the levels.
    It comes from receptances, y across the open joint and c from there to the sensor, as phi^2 = c^2 / (dy/d(omega^2)).
    The square of d ln(omega)/d ln(a), the order of the terms left out, widens the error of the frequency.
    Damping is averaged over the sensors with the weight 1/variance, and errors are widened if the sensors scatter by
    more. K* is -1/y at the complex frequency, as in `backbone_levels`. The relative motion is fitted to all sensors.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [0, 0], ground="start"), ["2:x"], exact=True)
    >>> b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [0, 0], ground="end"), ["1:x"], exact=True)
    >>> whole = jf.Assembly(a, b, jf.LawJoint({"x": jf.SpringLaw(2000.0)}))
    >>> t = np.arange(6000) / 50
    >>> x = np.exp(-0.05 * t) * np.cos(20.0 * t) + 1e-4 * np.random.default_rng(1).normal(size=t.size)
    >>> mode = jf.decay_of_mode(jf.DecayRecord(t, x[:, None], ["A/1:x"], "displacement"), 3.2)
    >>> len(jf.decay_levels(whole, mode, laws=()).levels["x"]) == mode.time.size
    True
    """
    check_type("whole", whole, Assembly)
    every = [decays] if isinstance(decays, ModalDecay) else list(decays)
    if not every:
        raise ValueError("no decays are given; give one for each mode")
    for one in every:
        check_type("decays", one, ModalDecay)
    shared = as_real("errors", errors, (2,))
    own, findings = dof_of_joint(whole, dof), [one for each in every for one in each.findings]
    points = []
    for one in every:
        sensors = _sensors(whole, one, channels, findings)
        points.append(_backbone(whole, one, sensors, own, findings, several=len(every) > 1))
    joined = {
        name: np.concatenate([getattr(one, name) for one in points])
        for name in ("freq_hz", "amplitude", "damping", "freq_error", "damping_error")
    }
    backbone = Backbone(
        "", joined["freq_hz"], joined["amplitude"], joined["damping"], freq_error=joined["freq_error"],
        damping_error=joined["damping_error"], labels=tuple(label for one in points for label in one.labels),
        shared_error=(float(shared[0]), float(shared[1])),
    )  # fmt: skip
    found = backbone_levels(whole, backbone, dof=own, laws=laws, probability=probability)
    return replace(found, findings=worst_first([*findings, *found.findings]))


class _Sensor(NamedTuple):
    """Number of a sensor in the record, its DOF, and its direction."""

    number: int
    dof: str
    sign: float


def _sensors(
    whole: Assembly, decay: ModalDecay, channels: Mapping[str, str] | None, findings: list[Finding]
) -> list[_Sensor]:
    found, left = list[_Sensor](), list[str]()
    for i, name in enumerate(decay.sensors):
        dof = name if channels is None else channels.get(name)
        if dof is None:
            left.append(name)
            continue
        sign = -1.0 if dof.startswith("-") else 1.0
        found.append(_Sensor(i, dof.removeprefix("-"), sign))
    if not found:
        raise ValueError(f"no sensor of {one_line(decay.sensors)} has a DOF of the models; name one in channels")
    whole.check([one.dof for one in found], "channel")
    if left:
        findings.append(Finding("decay-sensor-unnamed", about=tuple(left)))
    return found


class _Points(NamedTuple):
    """The arguments of a `Backbone` of the motion in the joint."""

    freq_hz: FloatArray
    amplitude: FloatArray
    damping: FloatArray
    freq_error: FloatArray
    damping_error: FloatArray
    labels: tuple[str, ...]


def _backbone(
    whole: Assembly, decay: ModalDecay, sensors: Sequence[_Sensor], dof: str, findings: list[Finding], *, several: bool
) -> _Points:
    """Return the mode as a backbone of the relative motion of the joint: amplitude across it, damping of its action."""
    numbers = [one.number for one in sensors]
    omega, rate, error = (getattr(decay, name)[:, numbers] for name in ("omega", "decay", "error"))
    seen = np.isfinite(omega).any(axis=1)
    if not seen.any():
        raise ValueError(f"no sensor with a DOF shows {decay.name} above the noise; name more sensors in channels")
    omega, rate, error, time = omega[seen], rate[seen], error[seen], decay.time[seen]
    mean, mean_error, _ = pooled(omega, error)
    y, c, slope = _receptances(whole, mean / (2 * np.pi), [one.dof for one in sensors], dof)
    phi = np.log(abs(c / np.sqrt(slope)[:, None]))
    bend = np.zeros(time.size)
    if time.size > 1:
        rise = np.gradient(np.log(mean), time)
        bend = rise / pooled(rate, error)[0]
        rate = rate + np.gradient(phi, time, axis=0) - 0.5 * rise[:, None]
    damping, damping_error, _ = pooled(rate, error)
    freq_error = np.sqrt((mean_error / mean) ** 2 + bend**4 + decay.scatter[0] ** 2)
    damping_error = np.hypot(damping_error, decay.scatter[1] * damping)
    freq = np.hypot(mean, damping) / (2 * np.pi)
    shape = decay.shape[seen][:, numbers] * np.array([one.sign for one in sensors])
    present = np.isfinite(shape)
    x, c = np.where(present, shape, 0.0), np.where(present, c, 0.0)
    mac = abs(np.sum(c.conj() * x, axis=1)) ** 2 / np.sum(abs(c) ** 2, axis=1) / np.sum(abs(x) ** 2, axis=1)
    if mac.min() < _ALIKE:
        findings.append(Finding("decay-shape", {"mac": float(mac.min())}, (decay.name,)))
    motion = abs(y) * np.sum(abs(c) * abs(x), axis=1) / np.sum(abs(c) ** 2, axis=1)
    begin = f"{decay.name} " if several else ""
    labels = tuple(f"{begin}{i}" for i in range(1, time.size + 1))
    return _Points(freq, motion, damping / (2 * np.pi * freq), freq_error, damping_error / damping, labels)


def _receptances(
    whole: Assembly, freq_hz: FloatArray, channels: Sequence[str], dof: str
) -> tuple[FloatArray, ComplexArray, FloatArray]:
    """Return y across the open joint, (n,), c from it to the sensors, (n, n_sensors), and dy/d(omega^2), (n,)."""
    steps = [freq_hz * np.sqrt(1 + sign * _STEP) for sign in (-1, 1)]
    below, above = (receptances_across(whole, one, channels, dof)[0].real for one in steps)
    y, c = receptances_across(whole, freq_hz, channels, dof)
    slope = abs(above - below) / (2 * _STEP * (2 * np.pi * freq_hz) ** 2)
    return y.real, c, slope
