"""What the phases of driving-point FRFs show, with reciprocity: time convention, quantity, sign, passivity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.pair_ratios import block_medians, exponents
from jointfrf.channels.check.result import Correction
from jointfrf.channels.check.signals import Measurement, modulus
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.messages.finding import Finding

__all__ = [
    "Sectors",
    "convention_finding",
    "mean_exponent",
    "one_sidedness",
    "passivity_findings",
    "quantities",
    "quantity_findings",
    "sectors",
    "sign_findings",
]

#: Im (or Re) of a driving-point FRF has one sign to this share, (sum of values) / (sum of their sizes).
_ONE_SIDED = 0.3
#: FRFs whose phase agrees better than this from line to line show circles.
_CIRCLES_SEEN = 0.5
#: Median turn, rad, weighted by |h|^2, of FRFs with resonances, which turn by nearly pi where |h| is largest.
_LEAST_TURN = 1.0
#: Share of FRFs that run backwards from which all are conjugated.
_BACKWARDS = 0.8
#: Lines taken together; standard error of the median of normal numbers, relative to that of the mean.
_BLOCK, _MEDIAN_ERROR = 30, 1.2533
#: Standard errors by which Im h / |h| of a block must exceed zero, and its least value.
_SIGNIFICANT, _LEAST = 8.0, 0.05
#: Standard errors from which a block has a sign, and share of these blocks that may have the other one.
_SIGN_ERRORS, _OTHER_SIGN = 5.0, 0.1
#: Mean exponents of w in |h| of receptances over many resonances: from a free mass to a stiffness, and noise.
_STEEPEST, _SHALLOWEST = -2.2, 0.6
#: Standard errors by which a slope must exceed its bound, and mean excess from which FRFs are not passive receptances:
#: quantities of the same phase differ by 2.
_SLOPE_ERRORS, _EXCESS = 5.0, 0.25
#: Lines between resonances from which a slope and its error are estimated.
_LEAST_LINES = 4
#: A band that spans less than this factor in frequency does not show the exponent.
_LEAST_SPAN = 3.0
#: Names of the quantities, by the power of i w.
_NAMES = ("receptances", "mobilities", "accelerances")
_UNITS = ("m/N", "m/s/N", "(m/s^2)/N")
#: What was divided too often, by the power that is left.
_TAKEN_FOR = {
    -1: "receptances divided by i w: mobilities read as accelerances, or receptances read as mobilities",
    -2: "receptances divided by (i w)^2: receptances read as accelerances",
}


@dataclass(frozen=True, eq=False)
class Sectors:
    """The half plane in which each driving-point FRF lies.

    Attributes
    ----------
    quarter : ndarray of int, shape (n,)
        0 is a receptance (Im < 0), 1 a mobility (Re > 0), 2 an accelerance or a receptance of the wrong sign (Im > 0),
        3 a mobility of the wrong sign (Re < 0), -1 undecided.
    negative : ndarray, shape (n,)
        Share of the lines with Im < 0.
    mixed : ndarray of bool, shape (n,)
        Undecided because the sign differs significantly between bands.
    """

    quarter: NDArray[np.intp]
    negative: FloatArray
    mixed: NDArray[np.bool_]


def convention_finding(omega: FloatArray, h: ComplexArray, smooth: FloatArray) -> Finding | None:
    """Report that most FRFs, shape (n_freq, rows, columns), run counterclockwise through the complex plane.

    Im sum conj(h_k) h_k+1 is below zero for exp(+i w t): it is minus the mean arrival time of the energy of the impulse
    response. FRFs count without their mean trend over frequency: otherwise a rigid-body line at the lowest frequencies
    outweighs the resonances. An antiresonance turns counterclockwise, where |h| is least: FRFs without resonances turn
    by less than a radian.
    """
    use = smooth > max(_CIRCLES_SEEN, 6 / np.sqrt(h.shape[0]))
    if not use.any():
        return None
    own = h[:, use]
    # About the middle of the band: in a narrow one the exponent is large, and powers of w overflow.
    own = own * (omega[:, None] / np.sqrt(omega.min() * omega.max())) ** -mean_exponent(omega, own)
    turned = (own.real[:-1] * own.imag[1:] - own.imag[:-1] * own.real[1:]).sum(axis=0)
    share, turn = float((turned > 0).mean()), np.median(turned / (modulus(own) ** 2).mean(axis=0))
    return Finding("time-convention", {"share": share}) if share >= _BACKWARDS and turn > _LEAST_TURN else None


def mean_exponent(omega: FloatArray, h: ComplexArray) -> float:
    """Median over FRFs, shape (n_freq, m), of the exponent of w in |h|, by least squares."""
    return float(np.median(exponents(omega, np.log(np.maximum(modulus(h), TINY)))))


def sectors(driving: ComplexArray, inflation: float = 1.0) -> Sectors:
    """Find the half plane of driving-point FRFs, shape (n_freq, n), of whose lines `inflation` share their noise."""
    u, real, imaginary = _balances(driving)
    on_real_axis = _on_real_axis(u)
    quarter = np.where(
        on_real_axis,
        np.where(imaginary < -_ONE_SIDED, 0, np.where(imaginary > _ONE_SIDED, 2, -1)),
        np.where(real > _ONE_SIDED, 1, np.where(real < -_ONE_SIDED, 3, -1)),
    )
    # Much damped: not near either axis, and on one side of the real one.
    damped = (abs((u**2).real.mean(axis=0)) < 0.2) & (abs(imaginary) > 0.9)
    quarter = np.where(damped, np.where(imaginary < 0, 0, 2), quarter)
    mixed = _has_both_signs(np.where(on_real_axis | damped, u.imag, u.real), inflation)
    return Sectors(np.where(mixed, -1, quarter).astype(np.intp), (driving.imag < 0).mean(axis=0), mixed)


def _has_both_signs(part: FloatArray, inflation: float) -> NDArray[np.bool_]:
    """Find driving points, shape (n_freq, n), whose blocks of lines significantly have different signs.

    An error of sign or quantity turns all lines. Records that end before the response does turn some of them.
    """
    length = min(_BLOCK, part.shape[0])
    middle, error = _blocks(part, length, inflation)
    limit = _SIGN_ERRORS * error
    positive, negative = (middle > limit).sum(axis=0), (middle < -limit).sum(axis=0)
    return np.asarray(np.minimum(positive, negative) > _OTHER_SIGN * (positive + negative))


def _blocks(
    part: FloatArray, length: int, inflation: float, noise: FloatArray | float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Return medians over blocks of lines and their standard errors, from the scatter within blocks.

    The scatter is that of noise, at least `noise`, or of the resonances in a block.
    """
    middle = block_medians(part, length)
    own = middle[np.minimum(np.arange(part.shape[0]) // length, middle.shape[0] - 1)]
    spread = np.fmax(1.4826 * block_medians(abs(part - own), length), noise)
    return middle, _MEDIAN_ERROR * spread * np.sqrt(min(inflation, length) / length)


def one_sidedness(driving: ComplexArray) -> FloatArray:
    """Measure how far each driving-point FRF, shape (n_freq, n), lies in one half plane: 1 on all lines, 0 on half."""
    u, real, imaginary = _balances(driving)
    return np.where(_on_real_axis(u), abs(imaginary), abs(real))


def _balances(driving: ComplexArray) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Return h / |h|, and sums of its real and imaginary parts over the sums of their sizes."""
    size = modulus(driving)
    u: ComplexArray = np.where(size > 0, driving / np.where(size > 0, size, 1), 0)
    imaginary = u.imag.sum(axis=0) / np.maximum(abs(u.imag).sum(axis=0), TINY)
    real = u.real.sum(axis=0) / np.maximum(abs(u.real).sum(axis=0), TINY)
    return u, real, imaginary


def _on_real_axis(u: ComplexArray) -> NDArray[np.bool_]:
    """Between resonances a receptance is nearly real and a mobility nearly imaginary."""
    return np.asarray((u**2).real.mean(axis=0) > 0)


def passivity_findings(measurement: Measurement, noise: FloatArray, inflation: float) -> Iterator[Finding]:
    """Find driving points whose Im is positive over a band.

    `noise` is the standard deviation of Im h / |h| on a line, shape (n,); NaN where it is not known.
    """
    driving = measurement.driving
    length = min(_BLOCK, driving.shape[0])
    size = modulus(driving)
    part = np.where(size > 0, driving.imag / np.where(size > 0, size, 1), 0)
    real = np.where(size > 0, driving.real / np.where(size > 0, size, 1), 0)
    middle, error = _blocks(part, length, inflation, noise)
    active = middle > np.maximum(_LEAST, _SIGNIFICANT * error)
    freq = block_medians(measurement.freq_hz[:, None], length)[:, 0]
    for i in np.flatnonzero(active.any(axis=0)):
        where = np.flatnonzero(active[:, i])
        worst = int(where[np.argmax(middle[where, i])])
        side = block_medians(real[:, i : i + 1], length)[where, 0]
        variant = "mass" if (side < -0.5).all() else "stiffness" if (side > 0.5).all() else ""
        numbers = {
            "freq": float(freq[worst]), "value": float(middle[worst, i]), "error": float(error[worst, i]),
            "bands": int(where.size), "total": int(middle.shape[0]),
        }  # fmt: skip
        yield Finding("passivity", numbers, (measurement.dofs[i],), variant=variant)


@dataclass(frozen=True, eq=False)
class Quantities:
    """Quantity and sign of each DOF.

    Attributes
    ----------
    power : ndarray of int, shape (n,)
        0 receptance, 1 mobility, 2 accelerance; -1, -2: divided by i w once, twice too often.
    sign : ndarray of int, shape (n,)
        -1 where the response points against the force.
    contradiction : ndarray of bool, shape (n,)
        The driving point has another sign or quantity than the reciprocity of its channel.
    exponent : float
        Mean exponent of w in |h|.
    certain : bool
        Whether slopes exclude the quantity and sign of the same phase: accelerances are receptances of the opposite
        sign.
    """

    power: NDArray[np.intp]
    sign: NDArray[np.intp]
    contradiction: NDArray[np.bool_]
    exponent: float
    certain: bool


def quantities(
    omega: FloatArray,
    driving: ComplexArray,
    group: NDArray[np.intp],
    power: NDArray[np.intp],
    sign: NDArray[np.intp],
    half_planes: Sectors,
    strength: float | None = None,
) -> Quantities:
    """Combine powers and signs relative within each group with the half planes of the driving points.

    Parameters
    ----------
    omega : ndarray, shape (n_freq,)
        Angular frequencies, rad/s.
    driving : ndarray, shape (n_freq, n, m)
        m driving-point FRFs of each channel.
    group, power, sign : ndarray of int, shape (n,)
        As in `ChannelRatios`.
    half_planes : Sectors
        Half planes of the n channels.
    strength : float, optional
        Exponent of w in the residues of resonances, which a smooth background does not change.

    Notes
    -----
    A response that is (i w)^q times a displacement, with sign s, turns its driving point by i^q s. Im < 0 is thus a
    receptance or an accelerance of the wrong sign. FRFs of the phase of receptances are receptances unless their slopes
    exclude it. Between an accelerance and a receptance of the wrong sign the mean exponent decides.
    """
    slopes = _Slopes(omega, driving, power, strength)
    found_power, found_sign = power.copy(), sign.copy()
    contradiction, certain = np.zeros(group.size, bool), True
    for number in np.unique(group):
        some = group == number
        if np.count_nonzero(half_planes.quarter[some] >= 0) <= np.count_nonzero(half_planes.mixed[some]):
            found_sign[some] *= 1 if sign[some].sum() >= 0 else -1
            continue
        choices = {}
        for shift in range(-2, 3 - int(power[some].max())):
            for turn in (1, -1):
                own, signs = power[some] + shift, turn * sign[some]
                quarter = half_planes.quarter[some]
                wrong = (quarter >= 0) & ((own + 2 * (signs < 0)) % 4 != quarter)
                excluded, has_both = slopes.exclude(some, signs, shift), shift != 0 and bool((signs < 0).all())
                order = excluded, shift == -2, has_both, not slopes.is_usual(shift), int((signs < 0).sum()), abs(shift)
                choices[shift, turn] = (int(wrong.sum()), *order), (shift, turn), wrong
        _, (shift, turn), wrong = min(choices.values(), key=lambda choice: choice[0])
        found_power[some], found_sign[some], contradiction[some] = power[some] + shift, turn * sign[some], wrong
        alike = choices.get((shift - 2 if shift > 0 else shift + 2, -turn))
        certain &= alike is None or bool(alike[0][1])
    return Quantities(found_power, found_sign, contradiction, slopes.exponent, certain)


@dataclass(frozen=True, eq=False)
class _Slopes:
    """Exponents of w in driving-point FRFs, compared with the exponents of passive receptances.

    Attributes
    ----------
    omega, driving, power, strength
        As in `quantities`.
    """

    omega: FloatArray
    driving: ComplexArray
    power: NDArray[np.intp]
    strength: float | None

    @cached_property
    def displacements(self) -> ComplexArray:
        """FRFs over (i w)^power; w in units of the middle of the band, whose powers do not overflow."""
        return np.asarray(self.driving / self._ratio ** self.power[:, None].astype(float))

    @cached_property
    def _ratio(self) -> ComplexArray:
        middle = np.sqrt(self.omega[0] * self.omega[-1])
        return np.asarray(1j * self.omega[:, None, None] / middle)

    @cached_property
    def exponent(self) -> float:
        """Mean exponent of w in |h|, less `power`."""
        return mean_exponent(self.omega, self.displacements.reshape(self.omega.size, -1))

    def is_usual(self, shift: int) -> bool:
        """Return whether the mean exponent less `shift` is usual for receptances over many resonances."""
        is_wide = self.omega[-1] >= _LEAST_SPAN * self.omega[0]
        return not is_wide or _STEEPEST <= self.exponent - shift <= _SHALLOWEST

    def exclude(self, some: NDArray[np.bool_], sign: NDArray[np.intp], shift: int) -> bool:
        """Return whether some channels are not (i w)^(power + shift) times receptances of these signs.

        The mean exponent must agree: few modes near a node or a support may grow with frequency. Residues that grow
        with frequency exclude it, if there are enough resonances; otherwise slopes between poles and zeros.
        """
        if self.is_usual(shift):
            return False
        if self.strength is not None:
            return abs(self.strength - shift) > 1
        receptances = self.displacements[:, some] / (self._ratio ** float(shift) * sign[:, None])
        return _excess(self.omega, receptances.reshape(self.omega.size, -1)) > _EXCESS


def _excess(omega: FloatArray, h: ComplexArray) -> float:
    """Return by how much slopes of driving-point receptances, shape (n_freq, n), exceed the bounds of passive ones.

    Notes
    -----
    Between its poles and zeros, h = sum A / (w_r^2 - w^2), A > 0, rises with w (Foster), and so does w^2 h. The
    exponent of w in |h| is thus at least 0 where h > 0, and at most -2 where h < 0. Within the half-power bandwidth of
    a resonance, where |Im h| > |Re h|, a receptance falls. Runs of lines of one sign have the weights of least squares.
    """
    x, total, beyond = np.log(omega), 0.0, 0.0
    for own in h.T:
        sign = np.where(abs(own.real) > abs(own.imag), np.sign(own.real), 0)
        for run in np.split(np.arange(x.size), np.flatnonzero(np.diff(sign)) + 1):
            if sign[run[0]] == 0 or run.size < _LEAST_LINES:
                continue
            lever, y = x[run] - x[run].mean(), np.log(abs(own.real[run]))
            inertia = float(lever @ lever)
            slope = float(lever @ y) / inertia
            rest = y - y.mean() - slope * lever
            error = np.sqrt(rest @ rest / (run.size - 2) / inertia)
            over = -slope if sign[run[0]] > 0 else slope + 2
            total += inertia
            beyond += inertia * min(max(over - _SLOPE_ERRORS * error, 0.0), 2.0)
    return beyond / total if total else 0.0


def quantity_findings(
    measurement: Measurement, found: Quantities, driving: Sectors, read_as: str | None
) -> Iterator[Finding | Correction]:
    """Report which responses are velocities or accelerations, or were taken for them.

    `read_as` is the quantity that FRFs were taken for when they were made receptances, where that is known.
    """
    for power in (1, 2, -1, -2):
        places = np.flatnonzero(found.power == power)
        if not places.size:
            continue
        every = places.size == found.power.size
        names = () if every else tuple(measurement.dofs[i] for i in places)
        rows = tuple(range(len(measurement.responses))) if every else tuple(map(int, measurement.rows[places]))
        share = float(np.median(driving.negative[places]))
        is_narrow = power == 2 and every and not found.certain
        quantity, action = _quantity_and_action(power, read_as if every else None)
        numbers = {
            "quantity": quantity, "action": action, "half": ">" if abs(power) == 2 else "<",
            "share": 1 - share if abs(power) == 2 else share,
            "exponent": float(found.exponent + power) if every else power,
        }  # fmt: skip
        yield Finding("quantity", numbers, names, variant="narrow" if is_narrow else "" if every else "some")
        factor = ("i w", "(i w)^2")[abs(power) - 1]
        text = f"{'all FRFs' if every else 'responses ' + ', '.join(names)} "
        text += f"{'divided' if power > 0 else 'multiplied'} by {factor}"
        yield Correction("quantity", text, 1, rows, power=power)


def _quantity_and_action(power: int, read_as: str | None) -> tuple[str, str]:
    """Return the quantity of FRFs that are (i w)^power times a receptance, and the remedy.

    `read_as` is the quantity as which all of them were read, if it is known.
    """
    does = f"{'Divide' if power > 0 else 'Multiply'} by {('i w', '(i w)^2')[abs(power) - 1]}"
    actual = POWER_OF_I_OMEGA.get(read_as or "", -9) + power
    if 0 <= actual <= 2:
        quantity = _NAMES[actual] if power > 0 and read_as == "receptance" else f"{_NAMES[actual]} read as {read_as}"
        options = f"`--unit {_UNITS[actual]} --force-quantity` (`unit=`, `force_quantity=`)"
        return quantity, f"Read the file as {_NAMES[actual]}: {options}"
    quantity = _NAMES[power] if power > 0 else _TAKEN_FOR[power]
    return quantity, does if read_as is not None else f"{does}, or state the quantity when you read the file"


def sign_findings(
    measurement: Measurement, found: Quantities, driving: Sectors, side: int, *, may_rotate: bool
) -> Iterator[Finding | Correction]:
    """Report which responses point against the force of the same DOF, or FRFs of a part that may rotate."""
    places, contradicts = np.flatnonzero(found.sign < 0), found.contradiction
    is_antisymmetric = bool(places.size and (contradicts == (found.sign < 0)).all())
    if may_rotate and is_antisymmetric and (driving.quarter == 0).all():
        # h_pq = -h_qp, but every driving point has the right sign: no channel is reversed.
        yield Finding("gyroscopic", about=tuple(measurement.dofs[i] for i in places))
        return
    if places.size:
        names = tuple(measurement.dofs[i] for i in places)
        every = places.size == found.sign.size
        variant = "" if not every or len(names) == 1 else "all" if found.certain else "narrow"
        numbers = {"share": float(np.median(1 - driving.negative[places]))}
        yield Finding("driving-point-sign", numbers, names, variant=variant)
        name, own = measurement.of_side(side, places)
        yield Correction("sign", f"sign of {name} turned", side, own, -1.0)
    for i in np.flatnonzero(contradicts):
        numbers = {"share": float(1 - driving.negative[i])}
        yield Finding("passivity", numbers, (measurement.dofs[i],), severity="error", variant="contradiction")
