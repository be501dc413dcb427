"""Messages of fits, and of levels, pools and plans."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from jointfrf.messages.message import Message

__all__ = ["FIT_MESSAGES"]

FIT_MESSAGES: Final[Mapping[str, Message]] = {
    # ------------------------------------------------------------ the fit as a whole
    "residual-large": Message(
        "warning",
        {
            "": "the residual is {ratio:.2f} times the noise, {sigma:.0f} sigma above it: the joint does not fit "
            "the data",
            "local": "the residual is {ratio:.2f} times the noise ({sigma:.0f} sigma), most of the excess at "
            "{places}",
            "coupled": "the residual is {ratio:.2f} times the noise ({sigma:.0f} sigma), but not with cross terms: "
            "the "
            "joint DOFs are coupled",
            "laws": "the residual is {ratio:.2f} times the noise, {sigma:.0f} sigma above it: these laws do not fit "
            "the "
            "data",
            "model": "models and joint do not fit the FRFs: residual {ratio:.3g} times the noise, {where}",
            "model-failed": "no convergence, because models and joint do not fit the FRFs: residual "
            "{ratio:.3g} times the noise, {where}. No value or interval is valid",
            "model-uncovered": "models and joint do not fit the FRFs: residual {ratio:.3g} times the noise, {where}. "
            "The intervals do not cover this error",
        },
        {
            "": "Check coordinates, the joint DOFs chosen, and the noise given",
            "local": "Leave these bands out, or add the DOFs of local modes",
            "coupled": "Fit or ignore the cross terms (cross), or move the reference point",
            "per-part": "Give the noise of real and imaginary part together, 1.41 times the noise of each part",
            "laws": "Try another law",
            "model": "Check the models in these bands and channels",
            "model-failed": "Check models, clamps, added masses and channels; start with fewer bands",
            "model-uncovered": "Check the models there, or give them an error (model_error)",
        },
        means="The joint, with the parameters found, leaves more than noise of the FRFs. The parameters may be "
        "wrong by "
        "more than their intervals.",
        why="A joint DOF is missing, coordinates or models are wrong, the sides are flexible, the joint depends on "
        "amplitude, or the noise was given too small.",
        do="Look at the residual in the report: a local excess points to bad lines or local modes, a general one to "
        "coordinates, directions or a wrong noise level.",
    ),
    "residual-small": Message(
        "note",
        {
            "": "the residual is {ratio:.2g} times the noise that reciprocity shows: intervals are wider than "
            "necessary",
            "given": "the residual is {ratio:.2g} times the noise given: intervals are wider than necessary",
            "mean": "the residual is {ratio:.2g} times the noise given, perhaps because h_pq and h_qp are means: "
            "intervals are wider than necessary",
        },
        "",
        means="The FRFs have less noise than the fit was given or found.",
        why="FRFs were smoothed, h_pq and h_qp were replaced by their mean, or the noise was given too large.",
        do="Nothing is wrong. To narrow the intervals, give the true noise.",
    ),
    "compliance-scatter": Message(
        "warning",
        "the compliance varies from line to line beyond its noise: {varying}; its weighted mean was fitted",
        "Fit the cross terms (cross), or narrow the band",
        means="With unknown cross terms, the diagonal of the compliance should be one constant. It is not.",
        why="The joint depends on frequency or amplitude, or the sides are flexible.",
        do="Fit the cross terms, or compare fits of narrower bands.",
    ),
    "not-converged": Message(
        "warning",
        {"": "the fit did not converge", "iterations": "the fit did not converge in {iterations} iterations"},
        "Fit fewer terms, or start nearer to the joint",
        means="The search for the best parameters stopped before it ended. Values and intervals are unreliable.",
        why="The FRFs hardly determine some parameters, or the initial values are far away.",
        do="Fit fewer damping or cross terms, leave out bands without information, or give initial values.",
    ),
    "second-minimum": Message(
        "warning",
        "another joint fits nearly as well (-2 log likelihood higher by {difference:.1f})",
        "Give initial values nearer to the joint, or measure more FRFs",
        means="Two different joints explain the FRFs almost equally. The one printed is slightly better.",
        why="Few lines or channels, or models whose resonances can be matched in two ways.",
        do="Give initial values from another source, widen the band, or add channels.",
    ),
    "lines-rejected": Message(
        "warning",
        {
            "": "{rejected} of {total} lines of {about} do not fit the joint within their noise and are rejected",
            "whole": "{rejected} of {total} lines of {about} do not fit the joint and are rejected; with them the "
            "residual is {whole:.3g} times the noise",
        },
        "Check these lines for hum or local modes",
        means="No joint near the one found explains these lines. They have no influence on the result.",
        why="Hum, a local mode, an overload, or a joint that does not fit in part of the band.",
        do="A few lines are harmless. If many lines are rejected, look at the residual before you use the result.",
    ),
    "lines-hidden": Message(
        "note",
        "on {hidden} of {total} lines noise hides the transmission of {about}: they get less weight",
        "",
        means="On these lines the FRFs across the joint are below the noise.",
        why="Antiresonances, or a soft joint.",
        do="Nothing is wrong. More averages make these lines useful.",
    ),
    "noisy-lines": Message(
        "note",
        "lines with far more noise than their neighbours get less weight: {lines} Hz",
        "",
        means="Single lines scatter much more than the lines next to them.",
        why="Hum of the mains and its multiples, or interference.",
        do="Nothing is wrong. Leave them out if you like.",
    ),
    "noise-from-residual": Message(
        "note",
        "the noise level is taken from the residual, because the FRFs do not show it otherwise",
        "",
        means="There is no independent noise level, so the fit cannot test whether the joint fits.",
        why="The FRFs contain no reciprocal pairs, no coherence, and no noise was given.",
        do="Give the noise (`--noise`), or a file with coherence, to get a test of the fit.",
    ),
    "correlated-lines": Message(
        "note",
        "the noise of neighbouring lines is correlated: {lines} lines count as {independent:.0f} independent ones",
        "",
        means="Lines share their noise, so they contain less information than independent lines. Intervals allow "
        "for it.",
        why="Windows, zero padding, smoothing, or interpolation.",
        do="Nothing is wrong. Longer records give more independent lines.",
    ),
    "correlated-parameters": Message(
        "note",
        "errors of parameters are correlated: {pairs}",
        "",
        means="The FRFs determine a combination of two parameters better than each of them.",
        why="Both parameters have nearly the same effect in this band.",
        do="Fix one of them if you know it, or widen the band. Intervals already allow for the correlation.",
    ),
    "separate-groups": Message(
        "note",
        {
            "": "the FRFs between {groups} are zero: each group is fitted separately",
            "cross": "the FRFs between {groups} are zero: each group is fitted separately, without cross terms "
            "between "
            "them",
        },
        "",
        means="Motion in one group of DOFs causes none in the other group.",
        why="Symmetry of the structure, or a file of computed FRFs.",
        do="Nothing is wrong.",
    ),
    "dof-left-out": Message(
        "warning",
        "{reason}",
        "Add this DOF to the joint, or move the reference point",
        means="A DOF that you do not identify moves together with one that you identify, so it changes the result.",
        why="Fewer DOFs were chosen than the joint moves in.",
        do="Add the DOF to `--dofs`, or choose a reference point at which the coupling is small.",
    ),
    "saved-by-older-version": Message(
        "note",
        "{text}",
        "",
        means="A message in a file that another version saved. It has no code of this version.",
        why="The file was saved by jointfrf 0.2 or by a later version.",
        do="Read the sentence. Repeat the fit to get the messages of this version.",
    ),
    # ------------------------------------------------------------ stiffness and damping
    "stiffness-unbounded": Message(
        "warning",
        {
            "": "{parameter} cannot be distinguished from rigid: at least {low:.3g} {unit} (95 %), best estimate "
            "{value:.2g}",
            "no-bound": "the FRFs give no bound of {parameter}, from free to rigid (95 %)",
        },
        {
            "": "Use the lower bound, or measure nearer to the joint",
            "no-bound": "Fix this parameter, or measure channels that move in this DOF",
        },
        means="The interval of a stiffness has no upper end: the joint may be rigid in this DOF.",
        why="The joint is much stiffer than the parts around it, so noise hides its deformation.",
        do="Use the lower bound in your model. To find the value, measure nearer to the joint, in a higher band, or "
        "with less noise.",
    ),
    "stiffness-zero": Message(
        "warning",
        "{parameter} is not significantly different from zero, at most {high:.3g} {unit} (95 %)",
        "Treat this DOF as free, or measure with less noise",
        means="The interval of a stiffness reaches zero: the joint may be free in this DOF.",
        why="The joint is much softer than the parts around it, or the DOF hardly moves in the band.",
        do="Use the upper bound in your model, or measure at lower frequencies and with less noise.",
    ),
    "poorly-determined": Message(
        "warning",
        "{parameter} is poorly determined: 95 % interval {low:.3g} to {high:.3g} {unit}",
        "Add averages, lines or channels near the joint",
        means="The interval of a parameter is wider than half of its value on either side.",
        why="Noise, few lines, or modes that hardly move the joint in this DOF.",
        do="`jointfrf plan` names the channels that narrow the interval most.",
    ),
    "damping-negative": Message(
        "warning",
        "{parameter} is significantly negative, {value:.3g} {unit}, but a joint supplies no energy",
        "Check the sign of phases, delays between channels, and the damping terms",
        means="The whole interval of a damping parameter is below zero.",
        why="The time convention is exp(-i w t), channels are delayed, or the damping terms do not fit the joint.",
        do="Run `jointfrf check`. If it finds nothing, try `--damping auto`.",
    ),
    "damping-insignificant": Message(
        "note",
        "not significantly different from zero (95 %): {about}",
        "",
        means="The sign of these damping or cross terms is not known.",
        why="They are small compared with the noise.",
        do="Use their intervals as upper bounds, or leave the terms out.",
    ),
    "damping-chosen": Message(
        "note",
        "damping of {dof}: {best}, {strength} preferred to {second} (difference of BIC {margin:.1f})",
        "",
        means="The fit compared viscous, hysteretic, both and no damping, and chose one.",
        why="You asked for `damping=\"auto\"`, which is the default.",
        do="Nothing is wrong. Name the terms with `--damping` if you know them.",
    ),
    "damping-averaged": Message(
        "note",
        "damping of {dof}: undecided between {odds}; values are means, and intervals cover all of these",
        "",
        means="The FRFs do not decide between kinds of damping. The result is their weighted mean.",
        why="The band is narrow, so viscous and hysteretic damping look alike.",
        do="Widen the band, or name the terms with `--damping` if you know them.",
    ),
    "frequency-dependent": Message(
        "warning",
        {
            "": "{parameter} changes over frequency: {first:.3g} near {first_hz:.4g} Hz, {last:.3g} near "
            "{last_hz:.4g} Hz",
            "laws": "{parameter} changes over frequency, from {first:.3g} to {last:.3g}",
        },
        {"": "Fit a law of frequency (--law), or narrow the band", "laws": "Try another law"},
        means="Parts of the band give different values of a parameter, and the difference is no noise.",
        why="Rubber or glue, an unmodelled mode, flexible sides, or wrong coordinates.",
        do="Fit a law whose stiffness depends on frequency. If the joint is metallic, look for flexible sides or "
        "wrong "
        "coordinates first.",
    ),
    "band-parts-differ": Message(
        "warning",
        {
            "": "{parameter} differs between parts of the band: {values}; the interval covers this",
            "pair": "{parameter} differs between parts of the band, most between {one} and {other} ({values}); the "
            "interval covers this",
        },
        "Look for flexible sides, a missing DOF, or a law of frequency",
        means="Parts of the band, fitted separately, give values that disagree by more than their noise.",
        why="The joint as described does not fit in the whole band.",
        do="Find the part that disagrees, and compare its modes with your joint DOFs.",
    ),
    "band-scatter": Message(
        "warning",
        "parts of the band scatter more than the noise explains; the intervals of {about} are widened",
        "Look for flexible sides, local modes or a missing DOF",
        means="Ten parts of the band disagree slightly about these parameters. The intervals allow for it.",
        why="Small errors of coordinates or models that differ over frequency.",
        do="The intervals are valid. Correct the cause to narrow them.",
    ),
    "cross-terms-ignored": Message(
        "warning",
        "no joint without cross terms fits {about}, so cross terms were ignored",
        "Fit them (--cross fit), or move the reference point",
        means="The DOFs of the joint are coupled. The fit used only the diagonal of the compliance.",
        why="The reference point is not at the elastic centre of the joint, or the joint is not symmetric.",
        do="Fit the cross terms, or use the reference point that the fit proposes.",
    ),
    "compliance-unsymmetric": Message(
        "warning",
        "the compliance between {about} is not symmetric, and its symmetry was not used",
        "Use one reference point for both sides, and check that only the joint connects them",
        means="Forces and motions of both sides do not belong to one point.",
        why="Reference points of both sides differ, or a second path connects the parts.",
        do="Give one reference point with `--at`. Look for a second connection, such as a cable or the ground.",
    ),
    "reference-point-offset": Message(
        "note",
        "reference points moved by {offset} make the stiffness most nearly diagonal: largest coupling {before:.2g} "
        "becomes {after:.2g}",
        "",
        means="The elastic centre of the joint is not at the reference point. The distance is given with its "
        "standard "
        "error.",
        why="The reference point was chosen from the drawing.",
        do="Use the new point if you want a joint without cross terms (`jf.elastic_centre`).",
    ),
    "equal-points": Message(
        "note",
        "{about} are equal joints, which share their parameters",
        "",
        means="These joint points have one set of parameters.",
        why="You asked for it with `--same`.",
        do="Nothing is wrong.",
    ),
    # ------------------------------------------------------------ sides
    "sides-corrected": Message(
        "note",
        "the models of the sides corrected the FRFs to the reference points; intervals allow for {errors} errors of "
        "these models",
        "",
        means="Flexibility between channels and joint was removed with your models of the sides.",
        why="You gave `--side-j` and `--side-k`.",
        do="Nothing is wrong.",
    ),
    "sides-unchecked": Message(
        "note",
        "the channels cannot show whether the sides are rigid between them: intervals do not cover flexible sides",
        "",
        means="There are only as many channels as rigid motions, so flexible sides leave no trace.",
        why="Few channels around the joint.",
        do="Add channels around the joint, or give models of the sides (`--side-j`, `--side-k`).",
    ),
    "sides-flexible": Message(
        "note",
        "compliance of the sides between the channels, covered by the intervals: {values}",
        "",
        means="The sides deform between the channels, which makes the joint look softer.",
        why="Channels are far from the joint, or the sides are thin.",
        do="Measure nearer to the joint, or give models of the sides.",
    ),
    "sides-removed": Message(
        "note",
        "stiffness and damping are without the sides; as seen between the channels both together are softer",
        "",
        means="The table has two kinds of values: the joint alone, and the joint with the flexible sides.",
        why="The channels show that the sides are not rigid.",
        do="Use the values of the joint alone in your model.",
    ),
    "interval-cause": Message(
        "note",
        "to narrow the intervals of {about}: {cure}",
        "",
        means="The largest part of the interval has the cause that this remedy removes.",
        why="Flexible sides, inertia of the sides, or noise.",
        do="Follow the remedy if you need narrower intervals.",
    ),
    "sides-not-covered": Message(
        "note",
        "the intervals do not cover flexibility of the sides between the channels",
        "",
        means="For a joint of laws, the intervals contain noise only.",
        why="The correction for flexible sides is made for springs and dampers.",
        do="Compare with a fit of springs and dampers.",
    ),
    # ------------------------------------------------------------ calibration
    "calibration-errors": Message(
        "note",
        {
            "": "h_pq and h_qp differ smoothly over frequency, {sizes} (rms): taken as calibration errors, which the "
            "intervals cover",
            "resonant": "h_pq and h_qp differ smoothly over frequency, {sizes} (rms), as if sensors resonate near "
            "{resonance:.2g} Hz. Intervals cover this unless all resonate alike",
        },
        "",
        means="Gains or phases of channels are slightly wrong. Intervals also cover the same error in the part that "
        "h_pq and h_qp share.",
        why="Calibration factors of sensors and hammer, mounting of sensors, or filters.",
        do="Calibrate the channels to narrow the intervals. If sensors resonate, mount them with a stud or glue.",
    ),
    "moving-mass": Message(
        "warning",
        {
            "": "h_pq and h_qp differ as if a mass of {mass:.3g} kg ({error:.1g} kg) moves from point to point with "
            "the {where}; it was removed",
            "given": "the mass of {mass:.3g} kg that moves with the {where} was removed",
            "contradicted": "the mass of {mass:.3g} kg was removed, but h_pq and h_qp show {shown:.3g} kg; a "
            "negative mass moves with the excitation",
        },
        {
            "": "State the mass of the sensor (--sensor-mass; sensor_mass), or 0 if none moves",
            "given": "Check that only this mass moves",
            "contradicted": "State the mass in kg, or omit the option: then `identify` estimates the mass",
        },
        means="A sensor of this mass lowers the resonances of one row or column of FRFs at a time. The fit "
        "and its figures use FRFs of the structure without it. The value in brackets is the standard error.",
        why="A roving accelerometer, or an impedance head that moves with the shaker.",
        do="Compare with the mass of your sensor. Mount equal masses at all points, or use a lighter sensor.",
    ),
    "off-axis": Message(
        "warning",
        {
            "": "the FRFs of {about} contain {share:.2p} ({error:.1p}) of FRFs of {dof}, impact less sensor; half of "
            "the difference was removed from rows and from columns",
        },
        {"": "Align impacts and sensors, or state their directions"},
        means="The FRFs of a channel contain a share of FRFs of another joint DOF: h_pq and h_qp differ by it. The "
        "FRFs do not show whether the impact or the sensor is off axis, so that intervals contain an error of the same "
        "size. The channel with the largest share is named. The value in brackets is the standard error. If the "
        "shares add less than noise to all standard errors, the finding is a note.",
        why="An impact at an angle to its axis; sensors are glued at an angle, or sensors have cross-axis sensitivity.",
        do="Hit along the axis, use an impact guide or a shaker, and measure the directions of sensors.",
    ),
    "set-up-deviation": Message(
        "note",
        {
            "resonances": "set-up {about}: resonances are {size:+.2p} ({error:.1p}) off the mean at {bands}, as with "
            "other masses or temperatures",
            "gain": "set-up {about}: the gain is {size:+.2p} ({error:.1p}) off the mean at {bands}",
            "delay": "set-up {about}: FRFs are {size:+.3g} us ({error:.1g} us) late relative to the mean at {bands}",
            "phase": "set-up {about}: the phase is {size:+.2g} rad ({error:.1g} rad) off the mean at {bands}",
        },
        {"": "Check its calibration", "resonances": "Use equal masses and temperatures in all set-ups"},
        means="One set-up of the test disagrees with the other set-ups by more than chance. The value in brackets is "
        "the standard error.",
        why="Another sensor mass, temperature, or calibration in this set-up.",
        do="It is a warning if the difference is larger than usual. Then repeat the set-up, or leave it out.",
    ),
    "set-up-scatter": Message(
        "note",
        {
            "": "set-ups scatter by {gain:.2p} in gain and {phase:.2g} rad in phase, covered by the intervals",
            "given": "set-ups scatter by {gain:.2p} in gain, as given, and {phase:.2g} rad in phase, covered by the "
            "intervals",
            "few": "set-ups scatter by {gain:.2p} in gain and {phase:.2g} rad in phase, known from few set-ups",
            "exceeds": "set-ups differ by {gain:.2p} in gain, more than given",
            "common": "the common gain of all FRFs is known to {common:.2p}, as given, covered by the intervals",
        },
        {
            "": "",
            "few": "To narrow the intervals, give the gain error of a set-up (--setup-gain; SetUps.gain)",
            "exceeds": "Give a larger gain error (--setup-gain), or check the calibration of each set-up",
        },
        means="FRFs of one set-up share gain and phase errors. The intervals allow for them.",
        why="Each set-up has its own sensor positions and calibration.",
        do="Nothing is wrong as a note. As a warning: the gain error that you gave is too small.",
    ),
    # ------------------------------------------------------------ models of the parts
    "model-error": Message(
        "note",
        {
            "": "the models are off by {level:.2p} of their modal stiffnesses and masses, which the intervals cover",
            "given": "intervals cover errors of the models up to {level:.2p} of their modal stiffnesses and masses, "
            "as "
            "given or not excluded",
            "both": "intervals cover errors of modal stiffnesses and masses up to {level:.2p}, and of a common "
            "gain up to {gain:.2p}, as given or not excluded",
            "gain": "intervals cover errors of a common gain of all FRFs up to {gain:.2p}, as given or not excluded",
            "large": "with models off by {level:.2p} of modal stiffnesses and masses, the residual is {ratio:.3g} "
            "times "
            "the noise: intervals cover this in part",
            "far": "models and FRFs differ by {level:.2p} of modal stiffnesses and masses, {shapes:.2p} of mode "
            "shapes, and {noise:.3g} times the noise: intervals cover this",
        },
        {
            "": "Update the models of the parts, or declare more of their parameters unknown",
            "gain": "To narrow them, calibrate sensors and hammer (response_gains, force_gains)",
        },
        means="The models of the parts do not agree with the FRFs within noise, apart from their unknown parameters.",
        why="Mesh, material, missing details, or boundary conditions of the models.",
        do="Test the parts alone and update their models, or declare density and stiffness as unknown.",
    ),
    "model-gain": Message(
        "warning",
        "with the models, the FRFs show gains other than 1: {gains}; intervals cover this",
        "Calibrate these sensors and the hammer, or declare the gains unknown (response_gains, force_gains)",
        means="All FRFs of a response or of a force, or all FRFs, are too large or too small by one factor. The fit "
        "takes the factor as an error with a variance that the FRFs show.",
        why="A sensitivity is wrong or old. A wrong mass of all parts looks the same.",
        do="Calibrate the sensor and the hammer with a known mass. If they are right, check density and mass of the "
        "models.",
    ),
    "prior-contradicted": Message(
        "warning",
        "the FRFs contradict the prior, in standard deviations: {pulls}",
        "Check these values and units, or widen their priors",
        means="The best value of an unknown is far from its prior.",
        why="A nominal value is wrong, its standard deviation is too small, or the models contain another error.",
        do="Check the value first. If it is right, look for another error of the model that it compensates.",
    ),
    "prior-unchanged": Message(
        "note",
        "known from the prior, hardly from the FRFs: {about}",
        "",
        means="The FRFs narrow these unknowns by less than a tenth.",
        why="They have little effect in this band.",
        do="Nothing is wrong. Their uncertainty is in the intervals of the joint.",
    ),
    "prior-decides": Message(
        "note",
        "only priors determine {direction}",
        "",
        means="The FRFs cannot separate these parameters: changing them together by these amounts leaves the FRFs as "
        "they are. The priors fix their common scale.",
        why="A common gain, or density and stiffness of all parts, change the FRFs alike.",
        do="To narrow it, calibrate the hammer or weigh a part.",
    ),
    "direction-undetermined": Message(
        "warning",
        "the FRFs do not determine {direction}: moved along it, they stay within their noise",
        "Fix one of these parameters, give a prior, or add channels",
        means="A combination of parameters can change without a visible change of the FRFs.",
        why="Too few channels or lines for the number of unknowns.",
        do="Give a value or a prior for one of them, or measure the channels that `jointfrf plan` names.",
    ),
    "joints-not-separated": Message(
        "warning",
        {
            "": "the FRFs do not separate {about} of the joints {joints}",
            "known": "the FRFs do not separate {about} of the joints {joints}; known is {sums}",
            "prior": "the FRFs do not separate {about} of the joints {joints}; their priors do",
            "prior-known": "the FRFs do not separate {about} of the joints {joints}, only their priors do; known is "
            "{sums}",
        },
        {"": "Declare the joints equal, or measure between them", "prior": "", "prior-known": ""},
        means="Only combinations of the parameters of several joints are determined.",
        why="The joints are near to each other compared with the wave length, or channels are far away.",
        do="Declare the joints as equal (`same`), or add channels between them.",
    ),
    "joint-spread": Message(
        "note",
        {
            "": "{parameter} is a mean; the joints scatter around it by {spread:.2p}, found from {joints} joints",
            "given": "{parameter} is a mean; the joints scatter around it by {spread:.2p}, as given",
        },
        "",
        means="Joints of one kind share a mean and have their own deviations.",
        why="You declared the joints as alike.",
        do="Nothing is wrong.",
    ),
    "channel-changed": Message(
        "warning",
        "the fit takes {change}: the residual falls from {before:.3g} to {after:.3g} times the noise ({tried} "
        "changes "
        "tried)",
        "Correct the name or sign of the channel",
        means="With one sign reversed, or two channels exchanged, the models fit much better. The fit uses this "
        "change.",
        why="A sensor is reversed, or two cables were exchanged.",
        do="Look at the test set-up, and correct the channel names in the file.",
    ),
    "channel-change-ambiguous": Message(
        "warning",
        {
            "": "with {changes} the residual falls from {before:.3g} to {after:.3g} times the noise; none was made",
            "equal": "the FRFs fit as well with {changes}, and do not show which is right ({tried} changes tried)",
        },
        {"": "Check these channels, and correct the wrong one", "equal": ""},
        means="Several changes of channels fit alike, so the fit makes none.",
        why="The structure is symmetric, or few channels were measured.",
        do="Look at the test set-up: the FRFs cannot decide.",
    ),
    "channel-names-confirmed": Message(
        "note",
        "the channel names fit best: {tried} signs and exchanges were tried",
        "",
        means="No reversed sign and no exchange of two channels fits better.",
        why="You asked for it with `--find-wrong-channels`.",
        do="Nothing is wrong.",
    ),
    # ------------------------------------------------------------ how numbers were found
    "window-removed": Message(
        "note",
        "the exponential window exp(-{decay:g} t) adds {decay:g} /s times c to k, which is removed: {shown}",
        "",
        means="An exponential window adds damping, which the fit removes from the result.",
        why="You gave `--window-decay`.",
        do="Nothing is wrong.",
    ),
    "window-not-stated": Message(
        "warning",
        "hysteretic damping of {dofs} falls like 1/frequency: an exponential window of {of_accelerances:.2g} /s "
        "(accelerances) or {of_mobilities:.2g} /s (mobilities) explains it",
        "State the window with `--window-decay` (`window_decay=`)",
        means="An exponential window that was used in the test and not stated looks like hysteretic damping that falls "
        "with frequency.",
        why="FRFs under a window exp(-sigma t) belong to s = i w + sigma. Without sigma, accelerances and mobilities "
        "are divided by the wrong power of frequency.",
        do="Look up the decay of the exponential window in the analyser, and state it in 1/s.",
    ),
    "band-mean-error": Message(
        "note",
        "the standard error of a band mean is the scatter of its lines; the bias by noise is not included",
        "",
        means="A mean over a band has no model of noise. Its error is only the scatter.",
        why="You chose a method of the thesis that averages K* over bands.",
        do="Use the method `compliance` to get intervals with coverage.",
    ),
    # ------------------------------------------------------------ levels
    "amplitude-not-smooth": Message(
        "warning",
        "K* of {about} is no smooth function of amplitude from {low:.2g} to {high:.2g} (chance {chance:.1g}): "
        "intervals are wider, and cover K* over these amplitudes",
        "Test with response control, or check the models",
        means="On classes of amplitude within one test, K* departs from a cubic in ln a by more than noise.",
        why="The amplitude changes too much over the lines, the joint slips suddenly, or the models have an error that "
        "changes with frequency.",
        do="Keep the motion constant over the lines (response control), use narrower bands, or correct the models.",
    ),
    "law-misfit": Message(
        "warning",
        "no law explains the levels of {about}: chi^2 of the best, {law}, is {chi_square:.3g} at {degrees} degrees "
        "of "
        "freedom",
        "Use the table; intervals of the law are {widened:.2g} times as wide",
        means="No law over amplitude fits all levels within their errors.",
        why="The joint is more complicated than these laws, or levels differ by more than amplitude, such as bolt "
        "preload.",
        do="Use the values of the levels themselves.",
    ),
    "law-not-fitted": Message(
        "note",
        "no law is fitted to {about}: {reason}",
        "",
        means="There are too few levels with intervals for a law over amplitude.",
        why="A level has no standard error, or there are fewer levels than parameters.",
        do="Measure more levels.",
    ),
    "unknown-fixed": Message(
        "note",
        "unknown without a standard deviation, taken at the nominal value: {about}",
        "",
        means="A backbone has one number per level, which cannot determine further unknowns.",
        why="An unknown of the models has no prior.",
        do="Give a standard deviation, so that the intervals contain it.",
    ),
    "mode-not-in-models": Message(
        "warning",
        "stiffness or damping of {about} is not positive at {levels}: the models do not have this mode there",
        "Check the mode and the models of the parts",
        means="No positive stiffness gives the measured frequency and damping.",
        why="The frequency belongs to another mode, or the models contain more damping than the assembly.",
        do="Compare the mode shape, and check density and damping of the parts.",
    ),
    # ------------------------------------------------------------ free decays
    "decay-not-smooth": Message(
        "warning",
        "left out: {count} levels of {about} from {first:.4g} to {last:.4g} s, whose envelope is not smooth",
        "Narrow the filter (--bandwidth), or begin later (--start)",
        means="Amplitude and phase of a filtered decay are no smooth functions of time.",
        why="Two close modes beat in the pass-band, the structure was touched again, or a sensor moved.",
        do="Look at the envelope. Use a filter that separates the modes, or an impact at the node of one of them.",
    ),
    "decay-not-damped": Message(
        "warning",
        "left out: {count} levels of {about} from {first:.4g} to {last:.4g} s, in which the amplitude does not "
        "significantly fall",
        "Begin after the last impact (--start)",
        means="A free decay loses amplitude. This one does not, or the noise hides it.",
        why="A shaker or a second impact drives the mode, two close modes beat, or the noise is too large.",
        do="Begin where nothing drives the structure.",
    ),
    "decay-of-several-modes": Message(
        "warning",
        "left out: {count} levels of {about} from {first:.4g} to {last:.4g} s, where the mode at {other:.4g} Hz moves "
        "the sensors {share:.2g} times as much",
        "Excite one mode",
        means="Another mode moves the structure nearly as much as this one, so the joint has no single amplitude.",
        why="An impact excites all modes of its band.",
        do="Use a softer tip, release the structure in the shape of one mode, or stop a shaker at its resonance.",
    ),
    "decay-sensors-disagree": Message(
        "warning",
        "damping of {about} differs by {spread:.2g} % between sensors, more than noise explains",
        "Check the sensors, and look for a close mode",
        means="Sensors of one decaying mode see the same rate. Intervals contain their scatter.",
        why="A close mode lies in the pass-band, a sensor is loose or non-linear, or the mode changes its shape.",
        do="Narrow the filter, or leave out a sensor.",
    ),
    "decay-levels-scatter": Message(
        "warning",
        "damping of {about} scatters by {spread:.2g} % about any smooth law over amplitude",
        "Look for a close mode, and use sensors at which the two differ",
        means="Frequency and damping of a mode change smoothly with its amplitude. Intervals contain the scatter.",
        why="Two close modes beat, or the structure was touched while it rang.",
        do="Use a filter that separates the modes, or excite one of them.",
    ),
    "decay-sensor-unnamed": Message(
        "note",
        "not used, because no DOF of the models is named for them: {about}",
        "",
        means="The motion in the joint cannot be computed from a sensor whose DOF is unknown.",
        why="Its column is no DOF of the models, and [channels] and --sensors do not name it.",
        do="Name its DOF.",
    ),
    "decay-shape": Message(
        "warning",
        "the sensors do not move as {about} of the models does: MAC {mac:.2f}",
        "Check which DOF each sensor is, and which mode this is",
        means="The measured mode shape differs from the shape of the models with the joint found.",
        why="A sensor has another place, direction or calibration, or the mode is another one.",
        do="Compare the shape at each sensor.",
    ),
    # ------------------------------------------------------------ pools
    "fit-not-pooled": Message(
        "warning",
        "{about} is unbounded (rigid, free, or without an interval) in {fits}: mean and spread are of the other fits",
        "Measure these assemblies with less noise",
        means="A mean needs finite intervals. These fits have none for the parameter.",
        why="The joint is too stiff or too soft for the noise of these tests.",
        do="Repeat the tests with less noise, or remember that the mean is of a part of the assemblies.",
    ),
    "parameter-not-pooled": Message(
        "warning",
        "{about} is known from {count} of the fits, too few to pool",
        "Add fits in which it has a finite interval",
        means="Mean and spread need at least two fits.",
        why="The parameter is missing or unbounded in most fits.",
        do="Measure more assemblies, or with less noise.",
    ),
    "pooled-linearly": Message(
        "note",
        "{about} is not significantly positive in some fit: averaged as it is, not by its logarithm",
        "",
        means="Mean and spread are of the values, not of their logarithms.",
        why="An interval reaches zero.",
        do="Nothing is wrong.",
    ),
    "errors-shared": Message(
        "warning",
        "{about} of the fits agree better than their errors allow (chance {chance:.1g}): {share:.2p} of the variance "
        "is taken as one error of all fits",
        "State the error that all fits share (--common)",
        means="The fits scatter less than independent errors of this size would.",
        why="A part of each error is the same in all fits, such as a calibration or a wrong modulus of a model. Or the "
        "intervals of the fits are too wide.",
        do="Find the error that all fits share, and state it by `--common`. The mean is not known better than this.",
    ),
    "outlying-assembly": Message(
        "warning",
        "{parameter} of {about} does not belong to the other fits (chance below {chance:.3p} among {fits})",
        "Check this assembly before you use mean and spread",
        means="One assembly differs from the other ones by more than their spread.",
        why="A loose bolt, another part, or a mistake in the test.",
        do="Look at its test and at the structure. Leave it out only with a reason.",
    ),
    "factor-effect": Message(
        "note",
        {
            "": "{parameter} depends on {factor} (p-value if it had no effect: {chance})",
            "trend": "{parameter} changes with {factor} (p-value if it had no effect: {chance})",
        },
        "",
        means="Groups of assemblies differ, or the parameter follows the number that you gave.",
        why="Operator, batch, torque, temperature or another factor.",
        do="Use the spread of this factor in your model of scatter.",
    ),
    # ------------------------------------------------------------ plans
    "target-unbounded": Message(
        "warning",
        "{about} stays undetermined: with all {sensors} x {hits} candidates its standard error is {error:.2p}",
        "Plan other places, another band, less noise or better models",
        means="No choice among the candidates determines this parameter.",
        why="The candidates do not move with the joint in this DOF.",
        do="Add candidates near the joint, or lower the noise.",
    ),
    "sensor-mass": Message(
        "warning",
        "the masses of the sensors change {changes}, more than a standard error",
        "Add the masses to the model, or use lighter sensors",
        means="The sensors would shift the result by more than its error.",
        why="Sensors are heavy compared with the parts.",
        do="Model the sensors as masses, or use lighter ones.",
    ),
    "blind-channels": Message(
        "note",
        "next to no information of the joint from a {what} at {about}",
        "",
        means="Channels at these places would be measured in vain.",
        why="They are at nodes of the modes in the band, or far from the joint.",
        do="Choose other places.",
    ),
}  # fmt: skip
