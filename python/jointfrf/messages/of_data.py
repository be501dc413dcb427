"""Messages of the data checks: possible errors of measured FRFs, from simple causes to rare ones."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from jointfrf.messages.message import Message

__all__ = ["DATA_MESSAGES", "FATAL_CODES"]

#: Errors with which every fit is meaningless: `identify` stops, unless they are accepted.
FATAL_CODES: Final = (
    "quantity", "driving-point-sign", "gyroscopic", "time-convention", "phase-unit", "unsigned-phase", "decibel",
)  # fmt: skip

#: Deviation of a channel from the rigid motion of its neighbours.
_DIFFERS = "it differs by {error:.3p} from the rigid motion of {neighbours} neighbours, which agree to {rest:.2p}"
_DIFFER = "they differ by {error:.3p} from the rigid motion of {neighbours} neighbours, which agree to {rest:.2p}"
_UNDECIDED = "; {others} may be wrong instead, because as many channels agree with each side"

DATA_MESSAGES: Final[Mapping[str, Message]] = {
    "not-finite": Message(
        "error",
        {
            "": "NaN or Inf in {count} of {total} lines, first at line {line} ({freq:g} Hz)",
            "channels": "NaN or Inf in {about} on {count} of {total} lines, first at line {line} ({freq:g} Hz)",
        },
        "Leave out these lines or these channels",
        means="Some FRFs contain values that are not numbers. A fit stops at such a line.",
        why="An FRF was divided by a force of zero, a channel was overloaded, or a file was exported with gaps.",
        do='Leave out the lines (`fix=["lines"]`, or `--band`), or leave out the channels that the message names.',
    ),
    "frequency-order": Message(
        "error",
        "frequencies do not increase at line {line}: {before:g} Hz, then {after:g} Hz",
        "Sort the lines and keep each frequency once",
        means="The frequency axis goes back or repeats a value.",
        why="Two measurements were joined in one file, or frequencies were rounded when the file was written.",
        do="Sort the lines, and remove the repeated frequencies.",
    ),
    "zero-frequency": Message(
        "warning",
        "line {line} is at 0 Hz, where accelerometers measure nothing and viscous damping has no effect",
        "Leave this line out",
        means="The first line is static. An accelerance cannot be converted to a receptance there.",
        why="Most analysers export the line at 0 Hz.",
        do="Start the band above 0 Hz, for example with `--band 10:500`.",
    ),
    "missing-frf": Message(
        "warning",
        {
            "": "{count} of {total} FRFs missing: {pairs}",
            "too-many": "{count} of {total} FRFs missing: {pairs}; {reason}",
        },
        {
            "": "Measure them, or leave their channels out",
            "left-out": "Measure them to use these channels, too: a fit leaves out {left_out}",
        },
        means="Pairs of response and force have no FRF. The checks use the FRFs that are there.",
        why="A roving hammer or a roving sensor did not reach some points, or a file was not read.",
        do="Measure the pairs, add the missing file, or accept that a fit leaves out some channels. The message is "
        "an "
        "error if the remaining channels cannot give the joint DOFs.",
    ),
    "coordinates-unit": Message(
        "error",
        {
            "": "coordinates look like {unit}: the channels of side {side} lie {reach:.3g} m around their middle",
            "reference": "{which} at {point} m looks like {unit}: it lies {distance:.3g} m from its channels",
        },
        "Give the coordinates of channels and reference point in metres",
        means="Places of channels, or the reference point, are far too large for a joint.",
        why="Coordinates were written in millimetres or inches.",
        do="Convert all coordinates to metres, or name their unit when you read the file.",
    ),
    "reference-point-far": Message(
        "warning",
        "{which} lies {distance:.3g} m from its channels, {times:.3g} times their reach of {reach:.3g} mm",
        "Move it to the joint, or choose the channels next to the joint",
        means="The virtual point is far away from its channels. A small error of a rotation becomes a large error "
        "of a "
        "displacement there.",
        why="The reference point was mistyped, or channels of another place were chosen.",
        do="Put the reference point (`--at`) at the joint, and choose channels around it.",
    ),
    "phase-unit": Message(
        "error",
        "all phases lie within +-{largest:.4g} degrees, so they are probably radians",
        "Read the phases as radians, or accept them (--accept phase-unit)",
        means="All phases are so small that the FRFs look real. They were probably radians, read as degrees.",
        why="The heading of the file states degrees, or no unit, for phases in radians.",
        do="State `rad` in the heading of the phase column. If your FRFs are really almost real, accept the finding.",
    ),
    "decibel": Message(
        "error",
        "magnitudes from {low:.3g} to {high:.3g} hardly change while phases turn, so they are probably decibels",
        "Convert them to linear magnitudes, or state dB in the heading",
        means="The magnitudes change far less over frequency than magnitudes of FRFs do.",
        why="Magnitudes in decibels were read as linear magnitudes.",
        do="State `dB` with its reference in the heading, or export linear magnitudes.",
    ),
    "unsigned-phase": Message(
        "error",
        "all phases have one sign, yet FRFs turn both ways: the sign of the phases is lost",
        "Export the phases with their sign, or real and imaginary parts",
        means="FRFs between different DOFs have phases of both signs. These FRFs have phases of one sign only.",
        why="The program that wrote the file plots the absolute value of the phase.",
        do="Export phases from -180 to 180 degrees, or real and imaginary parts. No correction is possible afterwards.",
    ),
    "quantity": Message(
        "error",
        {
            "": "the FRFs look like {quantity}: Im of driving points is {half} 0 on {share:.3p} of lines, "
            "|h| goes with w^{exponent:.1f}",
            "narrow": "the FRFs look like {quantity}, or have the wrong sign: Im of driving points is {half} 0 on "
            "{share:.3p} of lines",
            "some": "{about} look like {quantity}: h_pq / h_qp goes with w^{exponent:.1f} relative to the other "
            "responses",
            "neighbours": "{about} looks like {quantity}: " + _DIFFERS,
        },
        "{action}",
        means="The FRFs are not receptances (displacement per force), the quantity that every fit takes. Stiffness "
        "and damping would be meaningless.",
        why="The file does not state its quantity, or states a wrong one: accelerances were read as receptances, or "
        "the reverse.",
        do="If the file states another quantity, give the right unit and force it: `--unit '(m/s^2)/N' "
        "--force-quantity`. If it states none, give `--quantity` or `--unit`. In Python use `unit=`, "
        '`force_quantity=` and `quantity=`, or `fix=["quantity"]` of `check_frfs`.',
    ),
    "time-convention": Message(
        "error",
        "{share:.3p} of the FRFs run anticlockwise: responses come before forces, as with exp(-i w t)",
        "Conjugate all FRFs",
        means="The FRFs are the complex conjugates of FRFs with the convention exp(+i w t). Damping would be negative.",
        why="Another sign of the Fourier transform, or of the phase, in the program that wrote the file.",
        do='Conjugate the FRFs: `np.conj(h)`, or `fix=["time-convention"]` of `check_frfs`.',
    ),
    "dead-channel": Message(
        "error",
        {
            "": "{about} is noise: its phase agrees by {agreement:.2f} from line to line, signals by more than "
            "{least:.2f}",
            "zero": "{about} is zero",
        },
        "Repair and measure it again, or leave it out",
        means="The channel contains no signal. No other check uses it.",
        why="A cable is broken, a sensor is loose, or impacts were too weak or at another point.",
        do="Check sensor and cable, or repeat the impacts. Otherwise leave the channel out.",
    ),
    "doubled-channel": Message(
        "error",
        {
            "": "{about} contain the same numbers, noise included (difference {difference:.1e})",
            "moves-alike": "{second} shows the signal of {first}: scatter of their ratio {difference:.2g}, of "
            "h_pq / h_qp {scatter:.2g}",
        },
        {"": "Measure one of them again", "moves-alike": "Check cable and place of {second}, and measure it again"},
        means="Two channels are one measurement. Two DOFs need two measurements.",
        why="One column was exported twice, a cable was connected to another sensor, or an impact was elsewhere.",
        do="Measure the second channel again, or leave it out.",
    ),
    "exchanged-channels": Message(
        "error",
        {
            "": "responses {about}, or the forces there, are exchanged: exchanged, the misfit of h_pq / h_qp falls "
            "from "
            "{before:.2g} to {after:.2g}",
            "alternatives": "responses {about}, or {others}, or the forces there, are exchanged: the misfit of "
            "h_pq / h_qp falls from {before:.2g} to {after:.2g}",
            "neighbours": "{about} are exchanged: " + _DIFFER,
        },
        "Check cables and impact points, and exchange the two names",
        means="Two channels have each other's names. With the names exchanged the FRFs are reciprocal, or rigid.",
        why="Two cables, or two rows of a channel table, were exchanged.",
        do="Exchange the two names. Reciprocity does not show whether the responses or the forces are exchanged, so "
        "look at the test set-up.",
    ),
    "reciprocity": Message(
        "error",
        {
            "": "{broken} of {pairs} pairs h_pq, h_qp are not the same FRF (scatter {scatter:.2g}): {worst}",
            "channel": "{broken} of {pairs} pairs h_pq, h_qp are not the same FRF (scatter {scatter:.2g}), all with "
            "{about}",
        },
        {
            "": "Check the order of rows and columns, and places and directions of sensors and impacts",
            "channel": "Check place, direction and name of its sensor and impacts, or leave it out",
        },
        means="h_pq and h_qp must be equal for a linear structure without rotating parts. These pairs are different "
        "functions.",
        why="Rows and columns are in another order, a sensor or impact is at another place, or a channel is noise.",
        do="Check the channel that the message names first. If many pairs are named, check the order of the channels.",
    ),
    "driving-point-sign": Message(
        "error",
        {
            "": "the response {about} points against its force: Im of the driving point is positive on {share:.3p} "
            "of "
            "lines",
            "all": "all responses point against the forces: Im of driving points is positive on {share:.3p} of lines",
            "narrow": "all responses point against the forces, or are accelerances: Im of driving points is positive "
            "on {share:.3p} of lines",
        },
        "Reverse the sign of the response, or of the force",
        means="At a driving point, response and force have the same direction, so Im of the receptance is negative. "
        "This one is positive.",
        why="A sensor is mounted upside down, an impact came from the other side, or a direction has the wrong sign.",
        do="Change the direction of the channel, for example `102:-y` instead of `102:+y`. Reciprocity does not show "
        "whether the response or the force is reversed.",
    ),
    "driving-point-residues": Message(
        "warning",
        {
            "": "{about} is no driving point: residues are positive at {positive} Hz, negative at {negative} Hz",
            "proposed": "{about} is no driving point: residues are positive at {positive} Hz, negative at {negative} "
            "Hz; {others} have one sign in all {modes} modes",
        },
        "Check where the force acts",
        means="At the driving point the residue of each mode is the square of its shape, so all have one sign. These "
        "do not: the force acts elsewhere, or two sensors are exchanged.",
        why="The point of the force is numbered wrongly, points are counted from 0 or along another direction, or a "
        "sensor near it was exchanged.",
        do="Compare with notes and photographs of the test. If the message proposes responses, the force may act at "
        "one of these: name it so, and run the check again. The check needs three clear resonances and one force; a "
        "smooth background does not change it.",
    ),
    "gyroscopic": Message(
        "error",
        "h_pq = -h_qp between {about} and the other channels, although every driving point has the right sign",
        "Use reciprocal=False if a part rotates; otherwise check the signs of these channels",
        means="The FRFs are antisymmetric between two groups of channels, as with a rotor measured in two directions.",
        why="Gyroscopic forces of a rotating part. The fit assumes a reciprocal structure by default.",
        do="Give `reciprocal=False` to `identify`. If no part rotates, check the axes of these channels.",
    ),
    "channel-sign": Message(
        "error",
        "{about} is {factor:.3g} times the expected motion: " + _DIFFERS,
        "Reverse its sign or its direction",
        means="A channel moves against the rigid motion that its neighbours around the virtual point show.",
        why="A sensor is mounted upside down, or an impact came from the other side.",
        do="Change the direction of the channel, for example `102:-y` instead of `102:+y`.",
    ),
    "channel-unit": Message(
        "error",
        {
            "": "responses over forces of {about} are {factor:.4g} times the other ones: {unit}",
            "undecided": "responses over forces of {about} are {factor:.4g} times the other ones: {unit}" + _UNDECIDED,
            "side": "responses over forces are {factor:.4g} times as large on side k as on side j: {unit}",
            "neighbours": "{about} is {factor:.4g} times the expected motion, {unit}: " + _DIFFERS,
        },
        "Convert all channels to SI units",
        means="One channel, or one side, differs from the other ones by a factor that a unit explains.",
        why="A sensor was calibrated in g, a coordinate or rotation is in mm or degrees, or forces are in lbf.",
        do="State the unit of the channel when you read the file, or correct its calibration.",
    ),
    "channel-inconsistent": Message(
        "warning",
        "h_pq and h_qp of {about} differ by {scatter:.2p}, of all other channels by {others:.1p} at most; no gain or "
        "delay explains this",
        "Measure {about} again: an average may come from another point or direction, or a sensor is loose",
        means="FRFs of one DOF contradict the reciprocity of the structure, smoothly over frequency.",
        why="One of the averaged impacts was at another point, at an angle or double, or a sensor is loose.",
        do="Measure the row and the column of this DOF again, or leave it out.",
    ),
    "channel-gain": Message(
        "warning",
        {
            "": "responses over forces of {about} are {factor:.4g} +- {error:.1g} times the other ones",
            "undecided": "responses over forces of {about} are {factor:.4g} +- {error:.1g} times the other ones"
            + _UNDECIDED,
            "side": "responses over forces are {factor:.4g} times as large on side k as on side j",
            "neighbours": "{about} is {factor:.4g} times the expected motion: " + _DIFFERS,
        },
        {
            "": "Calibrate sensor and hammer there; reciprocity does not show which of the two is wrong",
            "side": "Convert all channels to SI units",
            "neighbours": "Check its calibration, range, unit and sign",
        },
        means="The gain of one DOF differs from the other ones by more than noise. Stiffness and damping carry an "
        "error "
        "of about this size. A factor above 2 is an error.",
        why="A sensitivity is wrong or old, a range was changed, or the sensor is at another place.",
        do='Calibrate the sensor and the hammer. With `fix=["gain"]` the response is corrected, with '
        '`blame="forces"` the force.',
    ),
    "channel-delay": Message(
        "warning",
        {
            "": "{about} is {way} by {delay:.3g} +- {error:.2g} us ({degrees:.3g} degrees at {freq:g} Hz), or its "
            "force "
            "is {opposite}",
            "undecided": "{about} is {way} by {delay:.3g} +- {error:.2g} us, or its force is {opposite}" + _UNDECIDED,
            "neighbours": "{about} is {way} by {delay:.3g} us: " + _DIFFERS,
        },
        "Check filter, cable and trigger of sensor and hammer",
        means="The phase of a channel falls or rises with frequency relative to the other ones. Damping carries the "
        "error.",
        why="Channels have different filters, or come from two analysers that are not synchronised.",
        do='Use the same filter for all channels. With `fix=["delay"]` the delay is removed.',
    ),
    "channel-direction": Message(
        "error",
        {
            "": "{about} shows direction {shown}, not {stated}: " + _DIFFERS,
            "sensor": "{about} show directions {shown}: " + _DIFFER,
        },
        "Check how the sensor is mounted, its cable and its name",
        means="A channel, or all channels of a sensor, show another axis than their names state.",
        why="A triaxial sensor is turned, or two of its cables are exchanged.",
        do="Correct the directions in the names of the channels, or in the channel table.",
    ),
    "channel-place": Message(
        "error",
        {
            "": "{about} fits no place: " + _DIFFERS,
            "copy": "{about} shows the motion expected of {other}: " + _DIFFERS,
            "sensor": "{about} do not move as their place should: " + _DIFFER,
        },
        {
            "": "Check place, direction, cable and name, or leave the channel out",
            "sensor": "Check the coordinates of the sensor, and how it is mounted",
        },
        means="No factor, sign or direction makes the channel agree with the rigid motion of its neighbours.",
        why="Coordinates are wrong, a sensor is loose, or the channel belongs to another point.",
        do="Compare the coordinates with the structure. Leave the channel out if you find no cause.",
    ),
    "passivity": Message(
        "warning",
        {
            "mass": "power comes out at {about} near {freq:.4g} Hz, in {bands} of {total} bands between resonances: "
            "Im h / |h| = {value:.2g} +- {error:.1g}",
            "stiffness": "power comes out at {about} near {freq:.4g} Hz, in {bands} of {total} bands below "
            "resonances: "
            "Im h / |h| = {value:.2g} +- {error:.1g}",
            "": "power comes out at {about} near {freq:.4g} Hz, in {bands} of {total} bands at resonances: "
            "Im h / |h| = {value:.2g} +- {error:.1g}",
            "contradiction": "the driving point {about} has Im > 0 on {share:.3p} of lines, although its channel is "
            "reciprocal to the other ones",
        },
        {
            "mass": "Look for a delay of this FRF or of all FRFs, or leave these bands out",
            "stiffness": "Check whether this FRF, or all FRFs, are too early in time, or leave these bands out",
            "": "Check the sign of this FRF, or leave these bands out",
            "contradiction": "Check the sign of this FRF, and where it was measured",
        },
        means="A passive structure takes power at every driving point. Here Im of a driving point has the wrong sign "
        "over a band.",
        why="A delay that all channels share, a phase error of sensor or hammer, or an impact next to the sensor.",
        do="Check the phase of sensor and hammer. Leave out the bands that the message names.",
    ),
    "amplitude-dependent": Message(
        "warning",
        "FRFs of {about} are amplitude-dependent: the resonance at {freq:.4g} Hz moves by {shift:+.2g} Hz while the "
        "motion grows {growth:.2g} times (chance {chance:.1g})",
        "Test at a lower level or with response control, or use `jointfrf levels`",
        means="A resonance moves with its own motion, which no linear structure does. A fit describes this test, and "
        "its intervals are widened by the scatter between amplitudes.",
        why="Friction or clearance in the joint: stiffness falls, and damping rises, with the motion.",
        do="Measure at a lower level, or keep the motion constant (response control). `jointfrf levels` finds "
        "stiffness "
        "and damping over amplitude from several tests.",
    ),
}
