"""Free decays: frequency and damping of a mode over its amplitude, from the records of one or several sensors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from jointfrf.choices import MotionQuantity
from jointfrf.identification.result import columns_of
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_names, as_real, check_choice, check_type
from jointfrf.messages.finding import Finding, WithFindings, worst_first

__all__ = ["DecayRecord", "ModalDecay", "decay_of_mode", "pooled"]

#: Least number of samples of a record.
_FEWEST = 64
#: Largest distance of a time from a uniform grid, in steps: rounding in the file.
_UNEVEN = 0.1
#: Kaiser window of the filter: side lobes of -80 dB, and half the width of its main lobe times its length.
_BETA = 10.73
_WIDTH = float(np.sqrt(_BETA**2 + np.pi**2) / np.pi)
#: Bandwidth of the filter as a share of the distance to the next resonance, to 0 or to the image.
_SHARE = 0.9
#: Samples of the envelope in a length of the filter, between which noise is partly correlated; fewest and most samples
#: of a fit.
_PER_FILTER, _LEAST, _MOST = 4, 12, 4000
#: Orders of the polynomials of log amplitude and phase, odd because only odd terms change the slope in the middle. The
#: first is one more than a stretch without curvature of the slope needs. Then the p-value below which a higher order is
#: taken.
_ORDER, _HIGHEST, _CHANGES = 3, 7, 0.05
#: p-value below which an envelope is no smooth function of time, or sensors disagree; and the relative change of
#: damping, by the last terms of the polynomial or between sensors, above which this is reported.
_RARE, _TOO_MUCH = 1e-4, 0.1
#: Amplitude over noise of the envelope below which a sensor is not used.
_ABOVE_NOISE = 6.0
#: Share of the largest envelope below which the free decay begins; before it a shaker may drive the motion.
_BEGINS = 0.9
#: Prominence of a peak of a spectrum, dB, and degrees of freedom of the averaged spectrum: noise makes a peak of 10 dB
#: in fewer than 1e-6 of the lines.
_PROMINENT, _FREEDOM = 10.0, 20
#: Height in dB below the peak of the mode at which a resonance need not be filtered out.
_WEAK = 40.0
#: Relative distance between the frequency given and the peak taken.
_NEAR = 0.1
#: Displacement of another mode over the displacement of this mode above which it changes the joint.
_OTHERS = 0.3
#: Largest number of steps of the fit.
_STEPS = 8
#: Levels over which the scatter of sensors is averaged; with two sensors a level has one degree of freedom.
_AROUND = 5
#: Order of the polynomial in ln a of frequency and damping, and least number of levels for its scatter.
_SMOOTH, _FEW_LEVELS = 5, 6


@dataclass(frozen=True)
class DecayRecord:
    """Measured record of a free decay.

    Parameters
    ----------
    time : array_like, shape (n,)
        Instants in s, equally spaced.
    signals : array_like, shape (n, n_sensors)
        Motion of the sensors in m, m/s or m/s^2 (rotations in rad, ...); means and drift need not be removed.
    sensors : sequence of str
        Names, such as the DOFs of the models, ``"A/1:y"``.
    motion : str or sequence of str
        Quantity of all sensors or of each, "displacement", "velocity" or "acceleration", default "acceleration".

    Raises
    ------
    ValueError
        Times that are not uniform, values that are not finite, a sensor that does not move or that is clipped.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> t = np.arange(4000) / 1000
    >>> jf.DecayRecord(t, np.exp(-2 * t)[:, None] * np.cos(2 * np.pi * 50 * t)[:, None], ["A/1:y"]).rate
    1000.0
    """

    time: FloatArray
    signals: FloatArray
    sensors: tuple[str, ...]
    motion: tuple[MotionQuantity, ...] | str = "acceleration"

    def __post_init__(self) -> None:
        time, sensors = as_real("time", self.time, (None,)), as_names("sensors", self.sensors)
        signals = as_real("signals", self.signals, (time.size, len(sensors)))
        motion = (self.motion,) * len(sensors) if isinstance(self.motion, str) else as_names("motion", self.motion)
        if len(motion) != len(sensors):
            raise ValueError(f"motion has {len(motion)} quantities for {len(sensors)} sensors; give one for each")
        if len(set(sensors)) < len(sensors) or not sensors:
            raise ValueError("sensors have no names, or two have the same name; give each its own")
        for one in motion:
            check_choice("motion", one, get_args(MotionQuantity))
        if time.size < _FEWEST:
            raise ValueError(f"the record has {time.size} samples; give at least {_FEWEST}")
        _check_grid(time)
        for name, signal in zip(sensors, signals.T, strict=True):
            _check_signal(name, signal)
        for key, value in (("time", time), ("signals", signals), ("sensors", sensors), ("motion", motion)):
            object.__setattr__(self, key, value)

    @cached_property
    def rate(self) -> float:
        """Samples per second."""
        return (self.time.size - 1) / float(self.time[-1] - self.time[0])

    def peaks(self) -> FloatArray:
        """Return the frequencies of the resonances in Hz, the strongest first; (n_peaks,)."""
        return _peaks(self)[0]


def _check_grid(time: FloatArray) -> None:
    step = (time[-1] - time[0]) / (time.size - 1)
    if not step > 0:
        raise ValueError("times do not increase; give the instants of the samples in s")
    steps = np.diff(time)
    if abs(time - time[0] - step * np.arange(time.size)).max() > _UNEVEN * step:
        worst = int(np.argmax(abs(steps - step)))
        raise ValueError(
            f"times are not uniform: a step of {steps[worst]:.4g} s at {time[worst]:.6g} s, {step:.4g} s in the mean; "
            "resample the record, or give its sampling rate"
        )


def _check_signal(name: str, signal: FloatArray) -> None:
    ends = signal.min(), signal.max()
    if ends[0] == ends[1]:
        raise ValueError(f"sensor {name} does not move; leave it out")
    for end in ends:
        flat = np.concatenate([[0], (signal == end).astype(int), [0]])
        runs = np.flatnonzero(np.diff(flat) == -1) - np.flatnonzero(np.diff(flat) == 1)
        middle = abs(end - np.median(signal)) > 0.5 * np.ptp(ends) / 2
        if middle and (runs >= 3).sum() > 1:
            raise ValueError(f"sensor {name} is clipped at {end:.4g}; leave it out, or measure with a larger range")


@dataclass(frozen=True)
class ModalDecay(WithFindings):
    """A mode over its amplitude, from one free decay; `print` shows it.

    Attributes
    ----------
    name : str
        Frequency of the mode as text, ``"235 Hz"``.
    sensors : tuple of str
        Names of the sensors.
    time : ndarray, shape (n,)
        Instants of the levels, s; the largest amplitude first.
    amplitude : ndarray, shape (n, n_sensors)
        Peak displacement of the first harmonic, m or rad; NaN where noise hides it.
    shape : ndarray, shape (n, n_sensors)
        Displacements, complex, with the phases between sensors.
    omega, decay : ndarray, shape (n, n_sensors)
        Frequency of the decaying motion in rad/s, and rate -d ln(amplitude)/dt in 1/s, by sensor.
    error : ndarray, shape (n, n_sensors)
        Standard error of both, from the noise of each sensor.
    bandwidth : float
        Hz to either side of the mode from where on the filter suppresses everything by 80 dB.
    findings : tuple of Finding
    """

    name: str
    sensors: tuple[str, ...]
    time: FloatArray
    amplitude: FloatArray
    shape: ComplexArray
    omega: FloatArray
    decay: FloatArray
    error: FloatArray
    bandwidth: float
    findings: tuple[Finding, ...]

    @cached_property
    def freq_hz(self) -> FloatArray:
        """Undamped frequency at each level, Hz; shape (n,)."""
        return np.hypot(pooled(self.omega, self.error)[0], pooled(self.decay, self.error)[0]) / (2 * np.pi)

    @cached_property
    def damping(self) -> FloatArray:
        """Damping ratio of the decay at each level; shape (n,)."""
        return np.asarray(pooled(self.decay, self.error)[0] / (2 * np.pi * self.freq_hz))

    @cached_property
    def errors(self) -> tuple[FloatArray, FloatArray]:
        """Relative standard errors of frequency and of damping ratio: noise, scatter over sensors and over levels."""
        omega, decay = pooled(self.omega, self.error), pooled(self.decay, self.error)
        of_omega, of_decay = self.scatter
        return np.hypot(omega[1] / omega[0], of_omega), np.hypot(decay[1] / decay[0], of_decay)

    @cached_property
    def scatter(self) -> tuple[float, float]:
        """Relative standard deviations of frequency and of damping about smooth functions of ln a, beyond errors."""
        return self._scatter()[0][0], self._scatter()[1][0]

    def _scatter(self) -> tuple[tuple[float, float], tuple[float, float]]:
        log = np.log(np.nanmean(self.amplitude / np.nanmean(self.amplitude, axis=0), axis=1))
        found = []
        for values in (self.omega, self.decay):
            mean, error, _ = pooled(values, self.error)
            found.append(scatter_over_levels(log, np.log(mean), error / mean))
        return found[0], found[1]

    def __str__(self) -> str:
        """Return a table of the levels, and the findings."""
        strongest = int(np.nanargmax(np.nanmean(self.amplitude, axis=0)))
        head = (self.name, "time, s", f"amplitude of {self.sensors[strongest]}", "frequency, Hz", "95 %", "damping",
                "95 %", "sensors")  # fmt: skip
        rows: list[tuple[str, ...]] = [head]
        for i in range(self.time.size):
            freq, ratio = self.freq_hz[i], self.damping[i]
            of_freq, of_ratio = 1.96 * self.errors[0][i] * freq, 1.96 * self.errors[1][i] * ratio
            count = int(np.isfinite(self.omega[i]).sum())
            rows.append((
                str(i + 1), f"{self.time[i]:.4f}", f"{self.amplitude[i, strongest]:.4g}", f"{freq:.4f}",
                f"+- {of_freq:.2g}", f"{ratio:.5g}", f"+- {of_ratio:.2g}", str(count),
            ))  # fmt: skip
        said = [str(one) for one in self.findings]
        return "\n".join([*columns_of(rows), *([""] if said else []), *said])


def pooled(values: FloatArray, errors: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return weighted means over sensors, their standard errors and chi-square, without NaN.

    Parameters
    ----------
    values, errors : ndarray, shape (n, n_sensors)
        Values of the sensors, and their standard errors.

    Returns
    -------
    tuple of ndarray, shape (n,)
        Means, errors and chi-square. If sensors scatter by more than their errors, the errors are widened by the root
        of chi-square over its degrees of freedom.
    """
    weight = np.where(np.isfinite(values), 1 / errors**2, 0.0)
    total = weight.sum(axis=1)
    mean = np.sum(weight * np.nan_to_num(values), axis=1) / total
    chi = np.sum(weight * np.nan_to_num(values - mean[:, None]) ** 2, axis=1)
    degrees = (weight > 0).sum(axis=1) - 1
    around = np.ones(min(_AROUND, len(values)))
    near = np.convolve(chi, around, "same") / np.maximum(np.convolve(degrees, around, "same"), 1)
    widened = np.maximum(1.0, np.maximum(near, chi / np.maximum(degrees, 1)))
    return mean, np.sqrt(widened / total), chi


def scatter_over_levels(log_amplitude: FloatArray, values: FloatArray, errors: FloatArray) -> tuple[float, float]:
    """Return the standard deviation of values about a polynomial in ln a beyond their errors, and its p-value.

    Parameters
    ----------
    log_amplitude, values, errors : ndarray, shape (n,)
        Logarithm of the amplitudes, values and their standard errors.

    Returns
    -------
    tuple of float
        Standard deviation and p-value; 0 and 1 for fewer than six levels.
    """
    from scipy.optimize import brentq
    from scipy.special import chdtrc

    n = values.size
    if n < _FEW_LEVELS:
        return 0.0, 1.0
    order = min(_SMOOTH, n // 2)
    x = log_amplitude - log_amplitude.mean()
    basis = np.polynomial.legendre.legvander(x / abs(x).max(), order)

    def excess(variance: float) -> float:
        root = 1 / np.sqrt(errors**2 + variance)
        left = (
            root * values
            - (root[:, None] * basis) @ np.linalg.lstsq(root[:, None] * basis, root * values, rcond=None)[0]
        )
        return float(left @ left) - (n - order - 1)

    least = excess(0.0)
    if least <= 0:
        return 0.0, 1.0
    most = float(np.ptp(values)) ** 2 + float(np.max(errors)) ** 2
    variance = brentq(excess, 0.0, most) if excess(most) < 0 else most  # by moments (Paule and Mandel)
    return float(np.sqrt(variance)), float(chdtrc(n - order - 1, least + n - order - 1))


def decay_of_mode(
    record: DecayRecord,
    freq_hz: float,
    *,
    bandwidth: float | None = None,
    start: float | None = None,
    ratio: float = 1.5,
) -> ModalDecay:
    """Return frequency and damping of a mode over its amplitude, from a free decay.

    Parameters
    ----------
    record : DecayRecord
        Measured free decay.
    freq_hz : float
        Frequency of the mode, Hz, to 10 %: the nearest resonance of the record is taken.
    bandwidth : float, optional
        Distance from the mode in Hz beyond which the filter suppresses everything by 80 dB. The default is 0.9 of the
        distance to the next resonance, to 0 or to the image at the sampling rate.
    start : float, optional
        Time in s after which nothing drives the structure; by default the last time at which the mode has 90 % of its
        largest amplitude.
    ratio : float
        Ratio of the amplitudes at both ends of the stretch from which a level comes, default 1.5.

    Returns
    -------
    ModalDecay
        Frequency, damping and amplitude at each level.

    Raises
    ------
    ValueError
        No resonance near the frequency, sampling that is too coarse, a record too short for the filter, or no stretch
        above the noise in which the amplitude falls by `ratio`.

    See Also
    --------
    decay_levels : stiffness and loss factor of a joint from decays.
    backbone_levels : stiffness and loss factor of a joint from a backbone.

    Notes
    -----
    A Kaiser window of finite length, moved to the frequency, filters the record to the analytic signal z of each sensor
    (gain 1). Only samples whose window lies in the free decay are used, so that the ends of the record do not ring in
    them. Stretches in which the amplitude falls by `ratio` follow each other. In each, exp(p) is fitted to z, with p a
    complex polynomial of third order, or of a higher one if it is significant (F test, 5 %). The fit is one of
    generalised least squares with the correlation of filtered noise. dp/dt in the middle is -decay + i omega.
    Values of sensors are averaged with the weight 1/variance, and errors are widened if the sensors scatter by more.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> t = np.arange(4000) / 1000
    >>> x = np.exp(-2 * t) * np.cos(2 * np.pi * 50 * t) + 1e-4 * np.random.default_rng(1).normal(size=t.size)
    >>> found = jf.decay_of_mode(jf.DecayRecord(t, x[:, None], ["A/1:y"]), 50.0)
    >>> found.freq_hz.round(2)[0], found.damping.round(4)[0]
    (np.float64(50.0), np.float64(0.0064))
    """
    check_type("record", record, DecayRecord)
    if not (np.isfinite(ratio) and ratio > 1.05):
        raise ValueError(f"ratio is {ratio:g}; give a number above 1.05, such as 1.5")
    own, others = _nearest(record, freq_hz)
    width = _bandwidth(record, own, others) if bandwidth is None else _checked_width(record, own, bandwidth)
    envelope = _envelope(record, own, width)
    found, findings = list[_Level](), list[Finding]()
    for stretch in _stretches(envelope, _first(envelope, record, start), ratio):
        level = _level(envelope, stretch)
        if level is None:
            break
        found.append(level)
    if not found:
        raise ValueError(
            f"no stretch at {own:.4g} Hz is above the noise over an amplitude ratio of {ratio:g}; lower ratio, narrow "
            "bandwidth, or measure with less noise"
        )
    kept = _sound(found, record, own, others, envelope, findings)
    if len(kept) < len(found) - len(kept):  # most of the record is not one decaying mode
        why = "; ".join(one.text for one in findings)
        raise ValueError(f"{len(kept)} of {len(found)} levels at {own:.4g} Hz are usable: {why}")
    name = f"{own:.4g} Hz"
    power = np.array([get_args(MotionQuantity).index(one) for one in record.motion])
    omega = np.array([one.omega for one in kept])
    shape = np.array([one.shape for one in kept]) / (1j * omega) ** power
    decay = ModalDecay(
        name, record.sensors, np.array([one.time for one in kept]), abs(shape), shape, omega,
        np.array([one.decay for one in kept]), np.array([one.error for one in kept]), width,
        tuple(worst_first([*findings, *_disagreement(name, kept)])),
    )  # fmt: skip
    (_, of_omega), (spread, of_decay) = decay._scatter()
    if min(of_omega, of_decay) < _RARE and spread > _TOO_MUCH:
        found_too = Finding("decay-levels-scatter", {"spread": 100 * spread}, (name,))
        decay = replace(decay, findings=tuple(worst_first([*decay.findings, found_too])))
    return decay


def _peaks(record: DecayRecord) -> tuple[FloatArray, FloatArray]:
    """Return frequencies of resonances, the strongest first, and their heights in dB."""
    from scipy.signal import find_peaks
    from scipy.signal.windows import blackmanharris

    signals = record.signals - record.signals.mean(axis=0)
    signals = signals / np.sqrt(np.mean(signals**2, axis=0))
    energy = np.sum(signals**2, axis=1)
    first = min(int(np.argmax(energy)), len(signals) - _FEWEST)
    most = np.cumsum(energy[first:])
    own = signals[first : first + max(2 * int(np.searchsorted(most, 0.9 * most[-1])), _FEWEST)]
    own = (own - own.mean(axis=0)) * blackmanharris(len(own))[:, None]
    power = np.sum(abs(np.fft.rfft(own, 2 * len(own), axis=0)) ** 2, axis=1)
    count = 2 * (-(-_FREEDOM // (2 * signals.shape[1])) // 2) + 1
    mean = np.convolve(power, np.full(count, 1 / count), "same")
    level = 10 * np.log10(np.maximum(mean, np.finfo(float).tiny))
    found, _ = find_peaks(level, height=float(np.median(level)) + _PROMINENT, prominence=_PROMINENT)
    exact = [int(np.argmax(power[max(i - count, 0) : i + count + 1])) + max(i - count, 0) for i in found]
    order = np.argsort(-level[found])
    freq: FloatArray = np.array(exact, float)[order] * record.rate / (2 * len(own))
    return freq, level[found][order]


def _nearest(record: DecayRecord, freq_hz: float) -> tuple[float, FloatArray]:
    """Return the resonance next to a frequency, and other resonances that are not weak compared with it."""
    if not (np.isfinite(freq_hz) and freq_hz > 0):
        raise ValueError(f"freq_hz is {freq_hz:g}; give a positive number of Hz")
    if freq_hz > 0.45 * record.rate:
        raise ValueError(
            f"a mode at {freq_hz:g} Hz needs a sampling rate above {freq_hz / 0.45:.4g} Hz; the record has "
            f"{record.rate:.4g} Hz"
        )
    peaks, level = _peaks(record)
    if not peaks.size or min(abs(peaks / freq_hz - 1)) > _NEAR:
        shown = ", ".join(f"{one:.4g}" for one in peaks[:6]) or "nowhere"
        raise ValueError(f"no resonance within {100 * _NEAR:.0f} % of {freq_hz:g} Hz; the strongest are at {shown} Hz")
    i = int(np.argmin(abs(peaks - freq_hz)))
    return float(peaks[i]), peaks[(level > level[i] - _WEAK) & (np.arange(peaks.size) != i)]


def _bandwidth(record: DecayRecord, own: float, others: FloatArray) -> float:
    return _SHARE * float(min([own, record.rate - 2 * own, *abs(others - own)]))


def _checked_width(record: DecayRecord, own: float, bandwidth: float) -> float:
    most = _bandwidth(record, own, np.zeros(0))
    if not (np.isfinite(bandwidth) and 0 < bandwidth <= most):
        raise ValueError(f"bandwidth is {bandwidth:g} Hz; give a positive number up to {most:.4g} Hz for {own:.4g} Hz")
    return float(bandwidth)


class _Envelope(NamedTuple):
    """Analytic signals at equal steps, less the frequency; all windows lie in the record.

    time: (n,); z: (n, n_sensors); omega: rad/s; window: of the filter, sum 1, with `offsets` in s; step: s; length: s.
    """

    time: FloatArray
    z: ComplexArray
    omega: float
    window: FloatArray
    offsets: FloatArray
    correlation: FloatArray
    length: float

    @property
    def total(self) -> FloatArray:
        """Amplitude of all sensors together, each relative to its least motion."""
        power = abs(self.z) ** 2
        count = max(1, 2 * _PER_FILTER)
        least = [min(np.convolve(one, np.full(count, 1 / count), "valid")) for one in power.T]
        return np.sqrt(power @ (1 / np.maximum(least, np.finfo(float).tiny)))


def _envelope(record: DecayRecord, freq_hz: float, width: float) -> _Envelope:
    from scipy.signal import oaconvolve
    from scipy.signal.windows import kaiser

    half = int(np.ceil(_WIDTH / width * record.rate / 2))
    n = record.time.size
    hop = max(1, 2 * half // _PER_FILTER)
    if n < 2 * half + 1 + _LEAST * hop:
        needed = (2 * half + _LEAST * hop) / record.rate
        raise ValueError(
            f"a band of {width:.3g} Hz to either side of {freq_hz:.4g} Hz needs {needed:.3g} s, the record has "
            f"{n / record.rate:.3g} s; widen bandwidth, or measure longer"
        )
    window = kaiser(2 * half + 1, _BETA)
    window = window / window.sum()
    omega, time = 2 * np.pi * freq_hz, record.time[0] + np.arange(n) / record.rate
    moved = 2 * (record.signals - record.signals.mean(axis=0)) * np.exp(-1j * omega * time)[:, None]
    z = oaconvolve(moved, window[:, None], "valid", axes=0)[::hop]
    own = np.convolve(window, window)[2 * half :: hop]
    offsets = np.arange(-half, half + 1) / record.rate
    return _Envelope(time[half : n - half : hop], z, omega, window, offsets, own / own[0], 2 * half / record.rate)


def _first(envelope: _Envelope, record: DecayRecord, start: float | None) -> int:
    """Return the first sample whose window lies in the free decay."""
    if start is None:
        total = envelope.total
        begins = float(envelope.time[np.flatnonzero(total >= _BEGINS * total.max())[-1]])
    elif not (np.isfinite(start) and record.time[0] <= start < record.time[-1]):
        raise ValueError(f"start is {start:g} s; give a time between {record.time[0]:.6g} and {record.time[-1]:.6g} s")
    else:
        begins = start
    after = np.flatnonzero(envelope.time >= begins + envelope.length / 2 * (1 - 1e-9))
    if not after.size:
        raise ValueError(
            f"the record ends {record.time[-1] - begins:.3g} s after the free decay begins, before a filter of "
            f"{envelope.length:.3g} s fits in; widen bandwidth, or measure longer"
        )
    return int(after[0])


def _stretches(envelope: _Envelope, first: int, ratio: float) -> Iterator[slice]:
    """Yield stretches in which the amplitude falls by a ratio, one after the other."""
    total = envelope.total
    while first + _LEAST < total.size:
        above = np.flatnonzero(total[first:] >= total[first] / ratio)
        last = max(first + int(above[-1]), first + _LEAST - 1)
        if last >= total.size - 1:
            return
        yield slice(first, last + 1)
        first = last + 1


class _Level(NamedTuple):
    """Values of sensors in the middle of a stretch; the relative change of damping by the last terms."""

    stretch: slice
    time: float
    shape: ComplexArray
    omega: FloatArray
    decay: FloatArray
    error: FloatArray
    change: float


class _Fit(NamedTuple):
    """A polynomial fitted to a sensor: value and slope in the middle, error of the slope, residual and its degrees."""

    value: complex
    slope: complex
    error: float
    residual: float
    degrees: int
    end: float


def _level(envelope: _Envelope, stretch: slice) -> _Level | None:
    """Return the level of a stretch, or None if no sensor is above its noise."""
    from scipy.special import fdtrc

    thin = -(-(stretch.stop - stretch.start) // _MOST)
    z, time = envelope.z[stretch][::thin], envelope.time[stretch][::thin]
    correlation = envelope.correlation[::thin]

    def fits(order: int) -> list[_Fit]:
        return [_fit(one, time, order, correlation) for one in z.T]

    def chance_of(low: list[_Fit], high: list[_Fit], used: NDArray[np.bool_]) -> float:
        less, more = (np.array([[each.residual, each.degrees] for each in one])[used] for one in (low, high))
        freed, left = 2 * float(np.sum(less[:, 1] - more[:, 1])), 2 * float(np.sum(more[:, 1]))
        share = np.sum(1 - more[:, 0] / less[:, 0]) / used.sum()
        return float(fdtrc(freed, left, max(share, 0.0) / max(1 - share, 1e-300) * left / freed))

    order, own = _ORDER, fits(_ORDER)
    lower = fits(_ORDER - 2)
    used = np.array([_is_above(one) for one in own])
    if not used.any():
        return None
    while order < _HIGHEST and chance_of(lower, own, used) < _CHANGES:
        lower, own, order = own, fits(order + 2), order + 2
    used &= np.array([_is_above(one) for one in own])
    if not used.any():
        return None
    slope = np.where(used, np.array([one.slope for one in own]), np.nan + 1j * np.nan)
    error = np.where(used, np.array([one.error for one in own]), np.nan)
    value, change = np.array([one.value for one in own]), 0.0
    if order == _HIGHEST and chance_of(lower, own, used) < _RARE:  # further terms would matter, too
        moved = np.nan_to_num(abs(slope - np.array([one.slope for one in lower])), nan=0.0, posinf=np.inf)
        error = np.hypot(error, moved)
        change = float(np.nanmax(moved / abs(slope.real)))
    gain = np.exp(-np.multiply.outer(np.nan_to_num(slope), envelope.offsets)) @ envelope.window
    shape = np.where(used, np.exp(value) / gain, np.nan)
    return _Level(
        stretch, float((time[0] + time[-1]) / 2), shape, envelope.omega + slope.imag, -slope.real, error,
        change,
    )  # fmt: skip


def _is_above(one: _Fit) -> bool:
    noise = np.sqrt(one.residual / one.degrees)
    return bool(np.isfinite(one.slope) and 0 < one.error < np.inf and one.end > _ABOVE_NOISE * noise)


def _fit(z: ComplexArray, time: FloatArray, order: int, correlation: FloatArray) -> _Fit:
    """Fit exp(polynomial) to an analytic signal with the correlation of its noise at the steps 0, 1, ..."""
    from scipy.linalg import cholesky_banded, solve_banded

    n = z.size
    u = 2 * (time - time[0]) / (time[-1] - time[0]) - 1
    basis = np.polynomial.legendre.legvander(u, order)
    bands = correlation[:n]
    ab = np.zeros((bands.size, n))
    ab[:] = bands[:, None]
    root = cholesky_banded(ab, lower=True)

    def white(values: ComplexArray) -> ComplexArray:
        found: ComplexArray = solve_banded((bands.size - 1, 0), root, values)
        return found

    log = np.log(np.maximum(abs(z), np.finfo(float).tiny)) + 1j * np.unwrap(np.angle(z))
    weight = abs(z)[:, None]
    own = np.linalg.lstsq(basis * weight, log[:, None] * weight, rcond=None)[0][:, 0]
    target, model = white(z), np.exp(basis @ own)
    residual = _squares(target - white(model))
    for _ in range(_STEPS):
        jacobian = white(model[:, None] * basis)
        change = np.linalg.lstsq(jacobian, target - white(model), rcond=None)[0]
        with np.errstate(all="ignore"):  # a step too far, which is not taken
            moved = np.exp(basis @ (own + change))
            left = _squares(target - white(moved)) if np.isfinite(moved).all() else np.inf
        if not left < residual:
            break
        own, model, residual = own + change, moved, left
    jacobian = white(model[:, None] * basis)
    degrees = n - order - 1
    middle = [np.polynomial.legendre.Legendre.basis(i) for i in range(order + 1)]
    value, slope = (np.array([(one if power == 0 else one.deriv())(0.0) for one in middle]) for power in (0, 1))
    covariance = np.linalg.pinv(jacobian.conj().T @ jacobian).real
    per_second = 2 / (time[-1] - time[0])
    # half the variance of complex noise is that of each part; degrees - 1: the mean of 1 / chi^2
    error = per_second * np.sqrt(slope @ covariance @ slope * residual / (2 * max(degrees - 1, 1)))
    return _Fit(
        complex(value @ own), complex(per_second * (slope @ own)), float(error), max(residual, 1e-300), degrees,
        float(min(abs(model[0]), abs(model[-1]))),
    )  # fmt: skip


def _squares(values: ComplexArray) -> float:
    return float(np.sum(abs(values) ** 2))


def _sound(
    found: Sequence[_Level], record: DecayRecord, own: float, others: FloatArray, envelope: _Envelope,
    findings: list[Finding],
) -> list[_Level]:  # fmt: skip
    """Return the levels that one smooth decaying mode explains, and name other levels in findings."""
    name, kept = f"{own:.4g} Hz", list[_Level]()
    rough, rising, mixed = list[float](), list[float](), list[tuple[float, float, float]]()
    for one in found:
        mean, error, _ = pooled(one.decay[None], one.error[None])
        share, freq = _largest(record, one, own, others, envelope)
        if one.change > _TOO_MUCH:
            rough.append(one.time)
        elif not mean[0] > 2 * error[0]:  # NaN, too
            rising.append(one.time)
        elif share > _OTHERS:
            mixed.append((one.time, share, freq))
        else:
            kept.append(one)
    if rough:
        findings.append(Finding("decay-not-smooth", _places(rough), (name,)))
    if rising:
        findings.append(Finding("decay-not-damped", _places(rising), (name,)))
    if mixed:
        _, share, freq = max(mixed, key=lambda one: one[1])
        numbers = {"first": mixed[0][0], "last": mixed[-1][0], "count": len(mixed), "share": share, "other": freq}
        findings.append(Finding("decay-of-several-modes", numbers, (name,)))
    return kept


def _places(times: Sequence[float]) -> dict[str, float]:
    return {"first": min(times), "last": max(times), "count": len(times)}


def _largest(
    record: DecayRecord, one: _Level, own: float, others: FloatArray, envelope: _Envelope
) -> tuple[float, float]:
    """Return the largest ratio of another mode's displacement to this mode's in a stretch, and its frequency."""
    if not others.size:
        return 0.0, own
    first, last = (np.searchsorted(record.time, envelope.time[i]) for i in (one.stretch.start, one.stretch.stop - 1))
    reach = int(envelope.length * record.rate / 2)
    rows = slice(max(first - reach, 0), last + reach)
    part = record.signals[rows] - record.signals.mean(axis=0)
    window = np.hanning(len(part)) / np.hanning(len(part)).sum()
    powers = np.array([get_args(MotionQuantity).index(each) for each in record.motion])
    every = np.array([own, *others])
    size = abs(np.exp(-2j * np.pi * np.multiply.outer(every, record.time[rows])) @ (part * window[:, None]))
    size = np.sqrt(np.mean((size / (2 * np.pi * every[:, None]) ** powers) ** 2, axis=1))
    i = int(np.argmax(size[1:])) + 1
    return float(size[i] / size[0]), float(every[i])


def _disagreement(name: str, kept: Sequence[_Level]) -> Iterator[Finding]:
    """Yield a finding if sensors scatter by more than their noise, and by more than shapes change."""
    from scipy.special import chdtrc

    decay, error = (np.array([getattr(one, part) for one in kept]) for part in ("decay", "error"))
    mean, _, chi = pooled(decay, error)
    degrees = np.isfinite(decay).sum(axis=1) - 1
    if degrees.sum() < 1 or chdtrc(degrees.sum(), chi.sum()) > _RARE:
        return
    spread = float(np.nanmax(np.nanstd(decay / mean[:, None], axis=1)))
    if spread > _TOO_MUCH:
        yield Finding("decay-sensors-disagree", {"spread": 100 * spread}, (name,))
