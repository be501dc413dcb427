"""FRFs as measurements give them: structures, noise of many kinds, and errors of channels, each by its name."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

import jointfrf as jf
import six_dof_beams
from jointfrf.dofs import is_rotation
from jointfrf.workbench.cases.catalogue import find_case, read_case
from jointfrf.workbench.cases.known_joint.exact import exact_frfs


class Structure(NamedTuple):
    """FRFs at the joint without noise: DOFs j, then k."""

    freq: np.ndarray
    gamma: np.ndarray
    dofs: tuple[str, ...]


@cache
def structure(name: str) -> Structure:
    """One of the cases "3.1", "3.2", "3.3", or "six": the beams of `six_dof_beams`."""
    if name == "six":
        return Structure(six_dof_beams.FREQ, six_dof_beams.assembly(), six_dof_beams.DOFS)
    exact = exact_frfs(read_case(find_case(name)))
    gamma = exact.interface(exact.h_c)
    return Structure(exact.freq_hz, gamma, exact.dofs)


def circular(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Complex normal numbers, E|e|^2 = 1."""
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def correlated(rng: np.random.Generator, shape: tuple[int, ...], over: int) -> np.ndarray:
    """The same, each the mean of as many neighbouring lines, scaled to E|e|^2 = 1."""
    white = circular(rng, (shape[0] + over - 1, *shape[1:]))
    summed = np.cumsum(np.concatenate([np.zeros((1, *shape[1:]), complex), white]), axis=0)
    return (summed[over:] - summed[:-over]) / np.sqrt(over)


def hum(freq: np.ndarray) -> np.ndarray:
    """100 on the line nearest to each multiple of a sixteenth of the highest frequency (50 Hz below 800 Hz), else 1."""
    base = 50.0 if freq[-1] > 100 else freq[-1] / 16
    factor = np.ones(freq.size)
    for multiple in np.arange(base, freq[-1], base):
        factor[np.argmin(abs(freq - multiple))] = 100.0
    return factor


def floor(h: np.ndarray) -> np.ndarray:
    """Median modulus of each entry over frequency, shape (1, n, n)."""
    return np.median(abs(h), axis=0, keepdims=True)


Noise = Callable[[np.random.Generator, np.ndarray, np.ndarray, float], np.ndarray]
#: Noise by its name: from a generator, frequencies, FRFs and a level, what is added to the FRFs.
NOISE: dict[str, Noise] = {
    "complex": lambda rng, f, h, level: level * h * circular(rng, h.shape),
    "real": lambda rng, f, h, level: level * h * rng.standard_normal(h.shape),
    "uniform": lambda rng, f, h, level: level * h * rng.uniform(-1, 1, h.shape),
    "floor": lambda rng, f, h, level: level * floor(h) * circular(rng, h.shape),
    "mixed": lambda rng, f, h, level: level * (abs(h) + floor(h)) * circular(rng, h.shape),
    "by entry": lambda rng, f, h, level: level * h * rng.uniform(0.1, 2, h.shape[1:]) * circular(rng, h.shape),
    "correlated 5": lambda rng, f, h, level: level * h * correlated(rng, h.shape, 5),
    "correlated 25": lambda rng, f, h, level: level * h * correlated(rng, h.shape, 25),
    "hum": lambda rng, f, h, level: level * hum(f)[:, None, None] * h * circular(rng, h.shape),
}


#: All kinds of noise of `measured`.
KINDS_OF_NOISE = (*NOISE, "missing")


def measured(s: Structure, kind: str, level: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and noisy FRFs; "missing": complex noise, and a fifth of the lines is not there."""
    rng = np.random.default_rng([seed, sum(map(ord, kind))])
    if kind == "missing":
        kept = rng.random(s.freq.size) > 0.2
        h = s.gamma[kept]
        return s.freq[kept], h + NOISE["complex"](rng, s.freq[kept], h, level)
    return s.freq, s.gamma + NOISE[kind](rng, s.freq, s.gamma, level)


class ChannelError(NamedTuple):
    """What is done to measured FRFs, and what a check must find: code and channel (by place; None: any or all)."""

    change: Callable[[np.random.Generator, np.ndarray, np.ndarray, int], None]
    code: str
    names_channel: bool = True
    rotation: bool | None = None  # whether the channel must be a rotation, or a displacement
    also: tuple[str, ...] = ()  # findings that must come with it
    least: int = 2  # channels that it takes


class Told(NamedTuple):
    """Whether a check found the error with its channel, and nothing else."""

    found: bool
    alone: bool
    check: jf.FrfCheck


def names(s: Structure) -> list[str]:
    """Names of the channels."""
    return [f"{side}:{dof}" for side in "jk" for dof in s.dofs]


def check_with_error(s: Structure, error: ChannelError, kind: str, level: float, seed: int) -> Told | None:
    """Check noisy FRFs with an error; None where the structure has no channel for it. The seed chooses the channel."""
    freq, h = (values.copy() for values in measured(s, kind, level, seed))
    labels = names(s)
    able = [i for i, dof in enumerate(s.dofs * 2) if error.rotation in (None, is_rotation(dof))]
    if not able or h.shape[1] < error.least:
        return None
    at = able[seed % len(able)]
    error.change(np.random.default_rng(seed), freq, h, at)
    check = jf.check_frfs(freq, h, labels)
    serious = [finding for finding in check.findings if finding.severity != "note"]
    own = [
        finding
        for finding in serious
        if finding.code == error.code
        and (not error.names_channel or any(labels[at] in name for name in (*finding.about, finding.text)))
    ]
    others = [finding for finding in serious if finding not in own and finding.code not in error.also]
    codes = {finding.code for finding in serious}
    return Told(bool(own) and codes.issuperset(error.also), not others, check)


def scaled(factor: float, *, force: bool = False) -> Callable[..., None]:
    """One response, or force, times a factor."""

    def change(rng: np.random.Generator, f: np.ndarray, h: np.ndarray, at: int) -> None:
        h.swapaxes(1, 2)[:, at] *= factor
        if not force:
            h.swapaxes(1, 2)[:, at] /= factor
            h[:, at] *= factor

    return change


def late(seconds: float, *, force: bool = False) -> Callable[..., None]:
    """One response late, or one force early."""

    def change(rng: np.random.Generator, f: np.ndarray, h: np.ndarray, at: int) -> None:
        (h.swapaxes(1, 2) if force else h)[:, at] *= np.exp(-2j * np.pi * f * seconds)[:, None]

    return change


def all_times(power: int, *, conjugate: bool = False, sign: float = 1.0) -> Callable[..., None]:
    """All FRFs times (i w)^power, conjugated."""

    def change(rng: np.random.Generator, f: np.ndarray, h: np.ndarray, at: int) -> None:
        h *= sign * ((2j * np.pi * f) ** power)[:, None, None]
        if conjugate:
            np.conj(h, out=h)

    return change


def one_side(power: int) -> Callable[..., None]:
    """The responses of side k times (i w)^power."""

    def change(rng: np.random.Generator, f: np.ndarray, h: np.ndarray, at: int) -> None:
        h[:, h.shape[1] // 2 :] *= ((2j * np.pi * f) ** power)[:, None, None]

    return change


def put(what: str) -> Callable[..., None]:
    """One response, or force, replaced by zeros or noise."""

    def change(rng: np.random.Generator, f: np.ndarray, h: np.ndarray, at: int) -> None:
        own = h.swapaxes(1, 2) if "force" in what else h
        shape = own[:, at].shape
        own[:, at] = 0 if "zero" in what else np.median(abs(own[:, at])) * circular(rng, shape)

    return change


def copied(*, force: bool = False, anew: bool = False) -> Callable[..., None]:
    """The channel shows what the next one shows; measured anew, with noise of its own."""

    def change(rng: np.random.Generator, f: np.ndarray, h: np.ndarray, at: int) -> None:
        own = h.swapaxes(1, 2) if force else h
        own[:, at] = own[:, (at + 1) % own.shape[1]]
        if anew:
            own[:, at] *= 1 + 0.02 * circular(rng, own[:, at].shape)

    return change


def exchanged(*, force: bool = False) -> Callable[..., None]:
    """The channel and the next one exchanged."""

    def change(rng: np.random.Generator, f: np.ndarray, h: np.ndarray, at: int) -> None:
        own = h.swapaxes(1, 2) if force else h
        other = (at + 1) % own.shape[1]
        own[:, [at, other]] = own[:, [other, at]]

    return change


def nan_lines(rng: np.random.Generator, f: np.ndarray, h: np.ndarray, at: int) -> None:
    """Two lines of one channel are NaN."""
    h[5:7, at] = np.nan


def zero_line(rng: np.random.Generator, f: np.ndarray, h: np.ndarray, at: int) -> None:
    """The first line is at 0 Hz."""
    f[0] = 0.0


#: Errors by their names.
ERRORS: dict[str, ChannelError] = {
    "gain of a sensor +10 %": ChannelError(scaled(1.1), "channel-gain"),
    "gain of a hammer +10 %": ChannelError(scaled(1.1, force=True), "channel-gain"),
    "gain of a sensor +3 %": ChannelError(scaled(1.03), "channel-gain"),
    "delay of a sensor, 20 us": ChannelError(late(20e-6), "channel-delay"),
    "delay of a force, 20 us": ChannelError(late(20e-6, force=True), "channel-delay"),
    "sign of a sensor": ChannelError(scaled(-1.0), "driving-point-sign"),
    "sign of a force": ChannelError(scaled(-1.0, force=True), "driving-point-sign"),
    "sign of all forces": ChannelError(all_times(0, sign=-1.0), "driving-point-sign", False),
    "conjugated, exp(-i w t)": ChannelError(all_times(0, conjugate=True), "time-convention", False),
    "accelerances": ChannelError(all_times(2), "quantity", False),
    "mobilities": ChannelError(all_times(1), "quantity", False),
    "accelerances, conjugated": ChannelError(
        all_times(2, conjugate=True), "time-convention", False, also=("quantity",)
    ),
    "one side in accelerance": ChannelError(one_side(2), "quantity", False),
    "one side in mobility": ChannelError(one_side(1), "quantity", False),
    "degrees instead of radians": ChannelError(scaled(180 / np.pi), "channel-unit", rotation=True),
    "mm instead of m": ChannelError(scaled(1e3), "channel-unit", rotation=False),
    "g instead of m/s^2": ChannelError(scaled(1 / 9.80665), "channel-unit", rotation=False),
    "response zero": ChannelError(put("zero"), "dead-channel"),
    "response noise": ChannelError(put("noise"), "dead-channel"),
    "force zero": ChannelError(put("zero force"), "dead-channel"),
    "force noise": ChannelError(put("noise force"), "dead-channel"),
    "response copied": ChannelError(copied(), "doubled-channel"),
    "force copied": ChannelError(copied(force=True), "doubled-channel"),
    "response doubled": ChannelError(copied(anew=True), "doubled-channel"),
    "force doubled": ChannelError(copied(force=True, anew=True), "doubled-channel"),
    "responses exchanged": ChannelError(exchanged(), "exchanged-channels"),
    "forces exchanged": ChannelError(exchanged(force=True), "exchanged-channels"),
    "NaN lines": ChannelError(nan_lines, "not-finite"),
    "0 Hz": ChannelError(zero_line, "zero-frequency", False),
}
