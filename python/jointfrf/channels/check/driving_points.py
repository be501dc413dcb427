"""What the phases of driving-point FRFs show, with reciprocity: time convention, quantity, sign, passivity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

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
#: Share of FRFs that run backwards from which all are conjugated.
_BACKWARDS = 0.8
#: Lines taken together.
_BLOCK = 30
#: Standard errors by which Im h / |h| of a block must exceed zero, and its least value.
_SIGNIFICANT, _LEAST = 8.0, 0.05
#: Mean exponents of w in |h| of driving points: below the first it is a receptance, above the second an accelerance.
_RECEPTANCE, _ACCELERANCE = -0.2, 0.6
#: Receptances do not fall faster than those of a free mass, but for noise.
_STEEPEST = -2.2
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
    """

    quarter: NDArray[np.intp]
    negative: FloatArray


def convention_finding(omega: FloatArray, h: ComplexArray, smooth: FloatArray) -> Finding | None:
    """Report that most FRFs, shape (n_freq, rows, columns), run counterclockwise through the complex plane.

    Im sum conj(h_k) h_k+1 is below zero for exp(+i w t): it is minus the mean arrival time of the energy of the impulse
    response. FRFs count without their mean trend over frequency: otherwise a rigid-body line at the lowest frequencies
    outweighs the resonances.
    """
    use = smooth > max(_CIRCLES_SEEN, 6 / np.sqrt(h.shape[0]))
    if not use.any():
        return None
    own = h[:, use]
    # About the middle of the band: in a narrow one the exponent is large, and powers of w overflow.
    own = own * (omega[:, None] / np.sqrt(omega.min() * omega.max())) ** -mean_exponent(omega, own)
    turned = (own.real[:-1] * own.imag[1:] - own.imag[:-1] * own.real[1:]).sum(axis=0)
    share = float((turned > 0).mean())
    return Finding("time-convention", {"share": share}) if share >= _BACKWARDS else None


def mean_exponent(omega: FloatArray, h: ComplexArray) -> float:
    """Median over FRFs, shape (n_freq, m), of the exponent of w in |h|, by least squares."""
    return float(np.median(exponents(omega, np.log(np.maximum(modulus(h), TINY)))))


def sectors(driving: ComplexArray) -> Sectors:
    """Find the half plane of driving-point FRFs, shape (n_freq, n)."""
    u, real, imaginary = _balances(driving)
    quarter = np.where(
        _on_real_axis(u),
        np.where(imaginary < -_ONE_SIDED, 0, np.where(imaginary > _ONE_SIDED, 2, -1)),
        np.where(real > _ONE_SIDED, 1, np.where(real < -_ONE_SIDED, 3, -1)),
    )
    # Much damped: not near either axis, and on one side of the real one.
    damped = (abs((u**2).real.mean(axis=0)) < 0.2) & (abs(imaginary) > 0.9)
    quarter = np.where(damped, np.where(imaginary < 0, 0, 2), quarter)
    return Sectors(quarter.astype(np.intp), (driving.imag < 0).mean(axis=0))


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
    middle = block_medians(part, length)
    # Scatter within a block: of noise, or of the resonances that it holds.
    own = middle[np.minimum(np.arange(part.shape[0]) // length, middle.shape[0] - 1)]
    spread = 1.4826 * block_medians(abs(part - own), length)
    spread = np.fmax(spread, noise)
    error = 1.2533 * spread * np.sqrt(min(inflation, length) / length)
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
        Whether it distinguishes accelerances from receptances of the opposite sign.
    """

    power: NDArray[np.intp]
    sign: NDArray[np.intp]
    contradiction: NDArray[np.bool_]
    exponent: float
    certain: bool


def quantities(
    group: NDArray[np.intp],
    power: NDArray[np.intp],
    sign: NDArray[np.intp],
    driving: Sectors,
    exponent: float,
    span: float,
    strength: float | None = None,
) -> Quantities:
    """Combine powers and signs relative within each group with the half planes of the driving points.

    Parameters
    ----------
    group, power, sign : ndarray of int, shape (n,)
        As in `ChannelRatios`.
    driving : Sectors
    exponent : float
        Mean exponent of w in the driving-point FRFs, less `power`.
    span : float
        Highest over lowest frequency.
    strength : float, optional
        Exponent of w in the residues of resonances, which a smooth background does not change. Few modes near a node or
        a support may grow with frequency, so that a quantity is unlikely only by both exponents.

    Notes
    -----
    A response that is (i w)^q times a displacement, with sign s, turns its driving point by i^q s. Im < 0 is thus a
    receptance or an accelerance of the wrong sign: |h| falls with frequency in one and rises in the other.
    """
    certain = strength is not None or (span >= _LEAST_SPAN and not _RECEPTANCE < exponent < _ACCELERANCE)
    found_power, found_sign = power.copy(), sign.copy()
    contradiction = np.zeros(group.size, bool)
    for number in np.unique(group):
        some = group == number
        quarter = driving.quarter[some]
        if (quarter < 0).all():
            continue
        choices = []
        for shift in range(-2, 3 - int(power[some].max())):
            for turn in (1, -1):
                own = power[some] + shift
                signs = turn * sign[some]
                wrong = (quarter >= 0) & ((own + 2 * (signs < 0)) % 4 != quarter)
                # what is left of the exponent is that of receptances
                unlikely = span >= _LEAST_SPAN and not _STEEPEST <= exponent - shift <= _ACCELERANCE
                if strength is not None:
                    unlikely = unlikely and abs(strength - shift) > 1
                order = int(wrong.sum()), unlikely, shift == -2, int((signs < 0).sum()), abs(shift), shift, turn
                choices.append((order, wrong))
        (*_, shift, turn), wrong = min(choices, key=lambda choice: choice[0])
        found_power[some] = power[some] + shift
        found_sign[some] = turn * sign[some]
        contradiction[some] = wrong
    return Quantities(found_power, found_sign, contradiction, exponent, certain)


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
