"""Time convention, quantity and sign of each channel, from driving points and reciprocity together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.channels.check.driving_points import Circles, Sectors
from jointfrf.channels.check.finding import Correction, FrfFinding
from jointfrf.channels.check.measurement import Measurement

__all__ = ["convention_finding", "quantities", "quantity_findings", "sign_findings"]

#: Mean exponents of w in |h| of driving points: below the first it is a receptance, above the second an accelerance.
_RECEPTANCE, _ACCELERANCE = -0.2, 0.6
#: A band that spans less than this factor in frequency does not show the exponent.
_LEAST_SPAN = 3.0
#: Names of the quantities, by the power of i w.
_NAMES = ("receptances", "mobilities", "accelerances")


@dataclass(frozen=True, eq=False)
class Quantities:
    """What each DOF shows.

    Attributes
    ----------
    power : ndarray of int, shape (n,)
        0 receptance, 1 mobility, 2 accelerance.
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

    Notes
    -----
    A response that is (i w)^q times a displacement, with sign s, turns its driving point by i^q s. Im < 0 is thus a
    receptance or an accelerance of the wrong sign: |h| falls with frequency in one and rises in the other.
    """
    certain = span >= _LEAST_SPAN and not _RECEPTANCE < exponent < _ACCELERANCE
    expected = (2 if exponent > _ACCELERANCE else 0) if certain else None
    found_power, found_sign = power.copy(), sign.copy()
    contradiction = np.zeros(group.size, bool)
    for number in np.unique(group):
        some = group == number
        quarter = driving.quarter[some]
        if (quarter < 0).all():
            continue
        choices = []
        for shift in range(3 - int(power[some].max())):
            for turn in (1, -1):
                own = power[some] + shift
                signs = turn * sign[some]
                wrong = (quarter >= 0) & ((own + 2 * (signs < 0)) % 4 != quarter)
                unlikely = expected is not None and shift != 1 and shift != expected
                choices.append((int(wrong.sum()), unlikely, int((signs < 0).sum()), shift, turn, wrong))
        best = min(choices, key=lambda choice: choice[:5])
        found_power[some] = power[some] + best[3]
        found_sign[some] = best[4] * sign[some]
        contradiction[some] = best[5]
    return Quantities(found_power, found_sign, contradiction, exponent, certain)


def convention_finding(around: Circles, driving: Sectors) -> FrfFinding:
    """Report that FRFs are conjugated."""
    turned = (
        f"; Im of driving points is positive on {100 * float(np.median(1 - driving.negative)):.0f} % of lines"
        if driving.negative.size
        else ""
    )
    return FrfFinding(
        "time-convention", "error", (), around.value, 0.0,
        f"{100 * around.share:.0f} % of the FRFs run anticlockwise through the complex plane, their responses come "
        f"before the forces{turned}: the time convention is exp(-i w t), or the FRFs are conjugated",
        "conjugate all FRFs",
    )  # fmt: skip


def quantity_findings(
    measurement: Measurement, found: Quantities, driving: Sectors
) -> tuple[list[FrfFinding], list[Correction]]:
    """Report which responses are velocities or accelerations."""
    findings, corrections = [], []
    for power in (1, 2):
        places = np.flatnonzero(found.power == power)
        if not places.size:
            continue
        every = places.size == found.power.size
        names = () if every else tuple(measurement.dofs[i] for i in places)
        rows = tuple(range(len(measurement.responses))) if every else tuple(map(int, measurement.rows[places]))
        what = "the FRFs are" if every else f"the FRFs of the responses {', '.join(names)} are"
        negative = 100 * float(np.median(driving.negative[places]))
        negative = 100 - negative if power == 2 else negative
        seen = f"driving points have Im {'>' if power == 2 else '<'} 0 on {negative:.0f} % of lines"
        if every:
            seen += f", |h| goes with w^{found.exponent + power:.1f}"
        else:
            seen += f", h_pq / h_qp goes with w^{power} against the other responses"
        doubt = "" if found.certain or power == 1 or not every else _doubt(found)
        findings.append(
            FrfFinding(
                "quantity", "error", names, float(found.exponent + power), 0.0,
                f"{what} {_NAMES[power]}, not receptances: {seen}{doubt}",
                f"divide by {('i w', '(i w)^2')[power - 1]}, or state the quantity when the file is read",
            )
        )  # fmt: skip
        text = f"{'all FRFs' if every else 'responses ' + ', '.join(names)} divided by {('i w', '(i w)^2')[power - 1]}"
        corrections.append(Correction("quantity", text, 1, rows, power=power))
    return findings, corrections


def _doubt(found: Quantities) -> str:
    return f" (or receptances of the wrong sign: |h| goes with w^{found.exponent + 2:.1f} on this band)"


def sign_findings(
    measurement: Measurement, found: Quantities, driving: Sectors, side: int
) -> tuple[list[FrfFinding], list[Correction]]:
    """Report which responses point against the force of the same DOF."""
    findings, corrections = [], []
    places = np.flatnonzero(found.sign < 0)
    if places.size:
        names = tuple(measurement.dofs[i] for i in places)
        every = places.size == found.sign.size
        share = 100 * float(np.median(1 - driving.negative[places]))
        seen = f"Im of {'all driving points' if every else 'the driving point'} is positive on {share:.0f} % of lines"
        if not every and measurement.dofs:
            seen += " and h_pq = -h_qp with the others"
        who = "all responses point" if every else f"the response of {', '.join(names)} points"
        doubt = "" if found.certain or not every else " (or the FRFs are accelerances: the band is too narrow)"
        findings.append(
            FrfFinding(
                "sign", "error", names, share / 100, 0.5,
                f"{who} against the force of the same name: {seen}{doubt}",
                "turn the sign of the response, or of the force: reciprocity does not show which of the two",
            )
        )  # fmt: skip
        dofs = measurement.rows if side == 1 else measurement.columns
        own = tuple(map(int, dofs[places]))
        labels = measurement.responses if side == 1 else measurement.forces
        text = f"sign of {'response' if side == 1 else 'force'} {', '.join(labels[i] for i in own)} turned"
        corrections.append(Correction("sign", text, side, own, -1.0))
    for i in np.flatnonzero(found.contradiction):
        findings.append(
            FrfFinding(
                "passivity", "error", (measurement.dofs[i],), float(1 - driving.negative[i]), 0.5,
                f"the driving point of {measurement.dofs[i]} has Im > 0 on {100 * (1 - driving.negative[i]):.0f} % of "
                "lines, although its channel is reciprocal to the others: power comes out of the structure",
                "look at this FRF: its sign, or where it was measured",
            )
        )  # fmt: skip
    return findings, corrections
