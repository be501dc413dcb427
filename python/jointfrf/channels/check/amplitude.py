"""Amplitude-dependent FRFs: a resonance that moves with its own motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from jointfrf.channels.check.residues import fit_poles
from jointfrf.channels.check.signals import LEAST_LINES, Measurement, as_measurement, check_signals
from jointfrf.frf.bands import spread_lines
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.messages.finding import Finding

__all__ = ["amplitude_findings", "amplitude_of_channels", "motion_of_lines"]

#: Powers of 1 / (f - z) of a pole alone, and of each of two, for further ones close by; powers of f, for all others.
_ALONE, _TOGETHER, _POWERS = 3, 2, 4
#: Lines on both sides of a peak at most; beyond the powers the fewest that show a residual.
_REACH, _FEWEST = 60, 8
#: A peak rises by this factor from the minima beside it; its lines are those above this share of it.
_RISE, _SHARE = 3.0, 1 / 8
#: Peaks and responses that are looked at for each force, the largest ones: more hardly add to what one mode shows.
#: Fewer responses cannot agree.
_PEAKS, _RESPONSES, _LEAST = 10, 8, 3
#: Significance level, divided by the number of peaks, and shift in half bandwidths from which a resonance counts as
#: amplitude-dependent: less hardly changes the FRF, other modes that the powers do not quite describe reach 0.1, and
#: 2 % of noise of the force that goes on over five lines 0.7.
_CHANCE, _SHIFT = 1e-7, 0.75
#: Least half-power bandwidth in lines, twice that of a Hann window: the leakage of a narrower resonance moves all
#: responses of a force alike.
_LEAST_WIDTH = 2 * 1.44
#: Powers of ln a, and of 1 / (f - z), that a pole has beside those of first order where it moves far.
_FURTHER = ((2, 2), (2, 3), (3, 2), (3, 4))
#: Chance below which responses agree on the shift: noise that goes on over many lines is not common to all.
_AGREE = 1e-3
#: Lines whose residual is so many times the median are left out: of noise one in 10^15 is.
_OUTLYING = 6.0


class _Peak(NamedTuple):
    """Chance of a linear structure; by how much its pole moves, Hz and half bandwidths; range of amplitude, e-fold."""

    chance: float
    hertz: complex
    shift: complex
    span: float


def amplitude_of_channels(
    freq_hz: FloatArray, h: ComplexArray, responses: Sequence[str], forces: Sequence[str]
) -> list[Finding]:
    """Return what `amplitude_findings` finds in FRFs of shape (n_freq, n_responses, n_forces), NaN where not measured.

    Dead and doubled channels are left out, and many lines thinned.
    """
    some = spread_lines(freq_hz.size)
    if freq_hz[some].size < LEAST_LINES:
        return []
    m = as_measurement(freq_hz[some], h[some], responses, forces, np.asarray(np.isnan(h).all(axis=0)))
    _, rows, columns = check_signals(m)
    return list(amplitude_findings(m, set(rows), set(columns)))


def motion_of_lines(h: ComplexArray) -> FloatArray:
    """Return the size of the motion on each line: root mean square of FRFs over their medians, NaN left out."""
    with np.errstate(invalid="ignore", divide="ignore"):
        relative = abs(h) / np.median(abs(h), axis=0)
    known = np.isfinite(relative).all(axis=0)
    return np.sqrt(np.mean(relative[:, known] ** 2, axis=1)) if known.any() else np.ones(len(h))


def amplitude_findings(m: Measurement, rows: set[int], columns: set[int]) -> Iterator[Finding]:
    """Yield a finding for each force whose FRFs depend on amplitude, of channels that are not left out.

    Near a resonance the FRFs of a linear structure are c_p / (f - z), with one pole z for all responses. Powers of f
    and further powers of 1 / (f - z) describe the other modes. If a joint depends on amplitude, the pole is z + g ln a,
    where a is the motion on the line. For a resonance, ln a is half of ln(f - z) + ln(f - z*). The second logarithm has
    its branch in the half plane in which no causal system has a singularity.

    The residual is therefore projected on c_p ln a / (f - z)^2, without the part that all powers of each response
    explain. Four tests judge the common g, and the largest chance counts:

    - F, widened by the correlation from line to line;
    - the scatter of each line (HC3), because noise may follow the FRF, widened in the same way;
    - the scatter along the mode with further powers of ln a, because all responses share the noise of the force;
    - the same with a second pole.

    In addition, the responses must agree on g, compared with their scatter.
    """
    kept = [i for i in range(len(m.responses)) if i not in rows]
    found = [
        (column, m.freq_hz[lines], peak)
        for column in (i for i in range(len(m.forces)) if i not in columns)
        for lines, peak in _peaks(m.freq_hz, m.h[:, kept, column])
    ]
    looked = len(found)
    moving = [one for one in found if one[2].chance * looked < _CHANCE and abs(one[2].shift) > _SHIFT]
    for column in dict.fromkeys(one[0] for one in moving):
        _, (freq, low, high), worst = min((one for one in moving if one[0] == column), key=lambda one: one[2].chance)
        numbers = {
            "freq": float(freq), "shift": worst.hertz.real, "growth": float(np.exp(worst.span)),
            "chance": worst.chance * looked, "half_bandwidths": float(abs(worst.shift)),
            "resonances": sum(one[0] == column for one in moving),
        }  # fmt: skip
        yield Finding("amplitude-dependent", numbers, (f"force {m.forces[column]}",), ((float(low), float(high)),))


def _peaks(freq_hz: FloatArray, h: ComplexArray) -> Iterator[tuple[list[int], _Peak]]:
    """Yield line, first and last line of each peak of the FRFs of a force, shape (n_freq, n), and what is found."""
    usual = np.median(abs(h), axis=0)
    h, usual = h[:, usual > 0], usual[usual > 0]
    if h.shape[1] < _LEAST:
        return
    above = abs(h) / usual
    size = np.sqrt(np.mean(above**2, axis=1))
    inner = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    for line in inner[np.argsort(-size[inner])][:_PEAKS].tolist():
        first, last = _reach(size[line::-1]), _reach(size[line:])
        own = slice(line - first, line + last + 1)
        if min(first, last) < 2 or first + last + 1 < 2 * _TOGETHER + _POWERS + _FEWEST:
            continue
        largest = np.argsort(-above[own].max(axis=0))[:_RESPONSES]
        peak = _look(freq_hz[own], h[own, largest])
        if peak is not None:
            yield [line, own.start, own.stop - 1], peak


def _reach(size: FloatArray) -> int:
    """Return how many lines beyond the first belong to its peak; 0 where it is none."""
    top = lowest = float(size[0])
    reach = 0
    for value in size[1 : _REACH + 1].tolist():
        if value > top or value > 2 * lowest or value < _SHARE * top:
            break
        if value < lowest:
            lowest = value
        reach += 1
    return reach if lowest < top / _RISE else 0


def _basis(x: FloatArray, poles: ComplexArray, powers: int) -> ComplexArray:
    """Return an orthonormal basis of powers of 1 / (x - z) of each pole, and of x, shape (n, n_powers)."""
    columns = [(x - z) ** -k for z in poles for k in range(1, powers + 1)] + [x**k + 0j for k in range(_POWERS)]
    own: ComplexArray = np.linalg.qr(np.stack([one / np.linalg.norm(one) for one in columns], axis=1))[0]
    return own


def _look(freq_hz: FloatArray, h: ComplexArray) -> _Peak | None:
    """Test one resonance: lines, and FRFs of shape (n_freq, n); None where lines do not show its pole."""
    half = (freq_hz[-1] - freq_hz[0]) / 2
    x = (freq_hz - freq_hz[0]) / half - 1
    h = h / abs(h).max(axis=0)
    size = np.linalg.norm(h, axis=1)
    width = max(float(np.ptp(x[size > size.max() / np.sqrt(2)])) / 2, float(x[1] - x[0]))
    alone = fit_poles(x, h, np.array([x[np.argmax(size)] + 1j * width]))
    if alone is None or 2 * alone[0][0].imag < _LEAST_WIDTH * (x[1] - x[0]):
        return None
    one, left = _moved(x, h, *alone[:2], _ALONE)
    size = np.linalg.norm(left, axis=1)
    usual = size < _OUTLYING * np.median(size)
    if not usual.all():  # hum
        x, h = x[usual], h[usual]
        one, left = _moved(x, h, *alone[:2], _ALONE)
    if one.chance < _CHANCE and abs(one.shift) > _SHIFT:
        # Two resonances, so close that there is one peak, look like one that moves.
        second = x[np.argmax(np.linalg.norm(left, axis=1))] + 1j * alone[0][0].imag
        both = fit_poles(x, h, np.array([alone[0][0], second]))
        if both is not None:
            one = one._replace(chance=max(one.chance, _moved(x, h, *both[:2], _TOGETHER)[0].chance))
    return one._replace(hertz=one.hertz * half)


def _moved(
    x: FloatArray, h: ComplexArray, poles: ComplexArray, residues: ComplexArray, powers: int
) -> tuple[_Peak, ComplexArray]:
    """Return by how much the first pole moves with the motion, in units of x, and what is left of h without that."""
    q: ComplexArray = _basis(x, poles, powers)
    fitted = q @ (q.conj().T @ h)
    left = h - fitted
    log = np.log(np.maximum(np.linalg.norm(fitted, axis=1), TINY))
    log -= log.max()
    g = residues[0] * (log / (x - poles[0]) ** 2)[:, None]
    g -= q @ (q.conj().T @ g)
    information = max(float(np.vdot(g, g).real), TINY)
    slope = complex(np.vdot(g, left)) / information
    rest = left - slope * g
    squares, wider = _squares(rest)
    degrees = max((h.shape[1] * (len(x) - q.shape[1]) - 1) / wider, 1.0)
    span = float(-log.min())
    peak = _Peak(1.0, slope * span, slope * span / poles[0].imag, span)
    chances = [_tail(abs(slope) ** 2 * information / squares * degrees, degrees)]
    if chances[0] >= _CHANCE:
        return peak._replace(chance=chances[0]), left  # the others can only raise it
    known = np.maximum(1 - np.sum(abs(q) ** 2, axis=1), 1 / len(x))[:, None]
    scatter = max(float(np.sum(abs(g * rest / known) ** 2)), TINY)
    chances.append(_tail(abs(slope * information) ** 2 / scatter / wider, degrees))
    size = float(np.linalg.norm(residues[0]))
    chances.append(_of_lines(left @ residues[0].conj() / size, log, x - poles[0], q))
    scatter = max(float(np.sum(abs(np.sum(g.conj() * rest, axis=0)) ** 2)), TINY)
    agree = _tail(abs(slope * information) ** 2 / scatter, h.shape[1] - 1)
    return (peak._replace(chance=max(chances)) if agree < _AGREE else peak), left


def _of_lines(left: ComplexArray, log: FloatArray, from_pole: ComplexArray, q: ComplexArray) -> float:
    """Return the chance of what is left along the mode, one number a line, without a pole that moves."""
    columns = np.stack([log**i / from_pole**k for i, k in ((1, 2), *_FURTHER)], axis=1)
    columns -= q @ (q.conj().T @ columns)
    own = np.linalg.qr(columns)[0]
    noise = left - own @ (own.conj().T @ left)
    wider = _squares(noise)[1]
    known = np.maximum(1 - np.sum(abs(q) ** 2, axis=1), 1 / len(left))
    scatter = max(float(np.sum(abs(columns[:, 0] * noise / known) ** 2)), TINY)
    degrees = max((len(left) - q.shape[1] - own.shape[1]) / wider, 1.0)
    return _tail(float(abs(np.vdot(columns[:, 0], left))) ** 2 / scatter / wider, degrees)


def _squares(residual: ComplexArray) -> tuple[float, float]:
    """Return the sum of squares, and the inflation of variances by the correlation from line to line."""
    squares = max(float(np.vdot(residual, residual).real), TINY)
    correlation = float(np.vdot(residual[:-1], residual[1:]).real) / squares
    return squares, max((1 + correlation) / max(1 - correlation, TINY), 1.0)


def _tail(value: float, degrees: float) -> float:
    """Return the upper tail of F of 2 and twice these degrees."""
    return float((1 + value / degrees) ** -degrees)
