"""From any measured FRFs and models of the substructures to a joint: entry point to the fit of a model."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.channels.check.amplitude import motion_of_lines
from jointfrf.channels.check.check import as_accepted, check_frfs, stop_at_errors, wrong_numbers_of
from jointfrf.frf.bands import spread_lines
from jointfrf.frf.setups import SetUps
from jointfrf.frf.stated_noise import StatedNoise
from jointfrf.identification.describe import describe_model
from jointfrf.identification.identify import identify
from jointfrf.identification.manifold.coordinates import CrossTerms
from jointfrf.identification.model.assembly import Assembly
from jointfrf.identification.model.channel_map import ChannelChange, find_channel_change
from jointfrf.identification.model.fit import ModelProblem, fit_assembly
from jointfrf.identification.model.prepare import Channels, prepare_model_fit
from jointfrf.identification.model.substructure import Unknown
from jointfrf.identification.noise import NoiseOptions
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_lines, as_names, as_not_negative, check_type
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.springs import SpringLaw
from jointfrf.messages.finding import Finding
from jointfrf.messages.of_data import FATAL_CODES

__all__ = ["identify_model"]

#: Errors that the search for wrong channels checks itself.
_SOUGHT = ("driving-point-sign",)


def identify_model(
    freq_hz: ArrayLike,
    h: ArrayLike,
    assembly: Assembly,
    responses: Sequence[str],
    forces: Sequence[str],
    *,
    response_gains: Mapping[str, Unknown] | None = None,
    force_gains: Mapping[str, Unknown] | None = None,
    fixed: Sequence[str] = (),
    noise: float | StatedNoise | ArrayLike | None = None,
    coherence: ArrayLike | None = None,
    averages: float | None = None,
    setups: SetUps | None = None,
    sensor_mass: float | None = None,
    find_wrong_channels: bool = False,
    accept: Sequence[str] = (),
) -> Fit:
    """Identify a joint from any measured FRFs of the assembly, given its substructures as models or FRFs.

    `identify` needs all FRFs between the joint DOFs, and no model. This function needs models, and any FRFs: remote
    points, translations only, one shaker position.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz.
    h : array_like, shape (n_freq, n_responses, n_forces)
        Measured receptances, m/N; NaN on all lines for an FRF that was not measured.
    assembly : Assembly
        Substructures, joint with its laws, attached masses and springs, and the unknowns of each.
    responses, forces : sequence of str
        DOFs ``"A/..."`` or ``"B/..."`` of the channels.
    response_gains, force_gains : mapping of str to Unknown, optional
        Calibration factors of channels that are not exactly 1: measured = factor times true.
    fixed : sequence of str
        Parameters of the joint that keep their value in `assembly`, such as ``"c_y"``; none by default.
    noise : float, StatedNoise or array_like, shape of h, optional
        Relative noise level of each FRF, or its relative part and floors, or E|e|^2 of each FRF, (m/N)^2. By default it
        is estimated, see `estimate_noise`.
    coherence, averages : optional
        Coherence and number of averages of the FRFs if `noise` is not given; see `estimate_noise`.
    sensor_mass : float, optional
        Mass of the accelerometer that moves from point to point, kg; 0 if no mass moves. If responses and forces are
        the same translations, the default is an estimate from h_pq - h_qp, which is removed with a warning.
    setups : SetUps, optional
        Set-up of the test of each FRF, from `FrfSet.setups_between`. Intervals cover errors common to the FRFs of a
        set-up and errors common to all FRFs; findings name set-ups that disagree.
    find_wrong_channels : bool
        Whether to search for one channel of the opposite sign, or two exchanged channels of the same quantity, with
        which the models fit the FRFs far better; default True. The fit corrects the channels, and a warning names them.
        If two changes fit equally, the warning names both, and neither is made.
    accept : sequence of str
        Codes of data errors at which the fit does not stop, such as "quantity" or "driving-point-sign"; none by
        default.

    Returns
    -------
    Fit
        Parameters of the joint and the unknowns, their intervals, correlations, and whether the residual is noise.

    Raises
    ------
    ValueError
        Wrong shapes or names; NaN or Inf in a line. An unknown that does not exist, or fewer numbers than unknowns.
    FrfCheckError
        The FRFs are of another quantity, sign or time convention, and this is not accepted.
    SingularLineError
        An undamped substructure resonates at a line.

    Warns
    -----
    IdentificationWarning
        The residual is more than noise, with its place; a parameter, or a combination of parameters, is poorly
        determined.
    ConvergenceWarning
        The fit did not converge.
    FrfCheckWarning
        The FRFs look wrong (`check_frfs`).

    See Also
    --------
    identify : fit of FRFs between all joint DOFs, without models.
    Assembly : parts, joint and unknowns.
    validate : test of the identified joint with other FRFs.

    Notes
    -----
    Maximum likelihood for circular noise and normal priors. Models are reduced once; derivatives of the FRFs are
    -H dZ H in the reduced model. Matrices that a function builds are differentiated by differences of the fourth order.
    If all FRFs between the joint DOFs were measured, the initial value is K* of the smooth FRFs and the compliance fit;
    otherwise it is the best of many trials. Relative noise is finally taken relative to the fitted FRFs. Intervals
    follow from the profile likelihood.

    Model errors enter the result: 1 % of Young's modulus or of a length may change a stiffness by 20 %. Declare every
    quantity that is not exactly known as an unknown. Other model errors appear in the residual, and a warning names
    their frequencies and channels, or as a contradiction between a prior and the FRFs.

    FRFs of the assembly share the noise of the FRFs of a substructure, Y = ... + P e Q to first order. The FRFs of a
    line are therefore weighted by their full covariance, with P and Q at the minimum. The noise is estimated or given,
    see `Substructure.of_frfs`.

    Examples
    --------
    One driving point far from the joint; Young's modulus of the left chain is known to 2 %:

    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"],
    ...                     {"youngs_modulus": jf.Unknown(1.0, 0.02)})
    >>> b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"])
    >>> truth = jf.Assembly(a, b, jf.Joint([2000.0], [3.0], dofs=["x"]))
    >>> h = jf.pollute(truth.receptance(freq, ["A/1:x"], ["A/1:x"]), 0.05, seed=2)
    >>> guess = jf.Assembly(a, b, jf.Joint([100.0], [1.0], dofs=["x"]))
    >>> fit = jf.identify_model(freq, h, guess, ["A/1:x"], ["A/1:x"])
    >>> low, high = fit.confidence_interval(0.95)["k_x"]
    >>> bool(low < 2000 < high), bool(high - low < 200), fit.test.is_noise
    (True, True, True)
    """
    check_type("assembly", assembly, Assembly)
    for name, gains in (("response_gains", response_gains), ("force_gains", force_gains)):
        if not isinstance(gains, Mapping | None):
            raise TypeError(f"{name} must be a mapping of channels to Unknown, not {type(gains).__name__}")
    named = as_names("responses", responses), as_names("forces", forces)
    channels = Channels(*named, dict(response_gains or {}), dict(force_gains or {}))
    mass = None if sensor_mass is None else as_not_negative("sensor_mass", sensor_mass)
    known = NoiseOptions(noise, coherence, averages, setups=setups, sensor_mass=mass)
    problem = prepare_model_fit(freq_hz, h, assembly, channels, known, fixed, _springs_at_joint)
    of_data = _data_checks(problem, channels)
    stop_at_errors(of_data, [*as_accepted(accept), *(_SOUGHT if find_wrong_channels else ())])
    if any(one.code == "amplitude-dependent" for one in of_data):
        problem = replace(problem, motion=motion_of_lines(problem.measured))
    search = find_channel_change(problem, channels) if find_wrong_channels else None
    if search is not None and search.change is not None:
        lines = search.change.of(as_lines("h", h))
        known = _changed(known, search.change)
        motion = problem.motion
        problem = prepare_model_fit(freq_hz, lines, assembly, channels, known, fixed, _springs_at_joint)
        problem = replace(problem, motion=motion)
    fit = describe_model(fit_assembly(problem), channels)
    fit = fit.with_findings([*fit.findings, *([] if search is None else [search.finding]), *of_data])
    fit.issue_warnings()
    return fit


def _data_checks(problem: ModelProblem, channels: Channels) -> list[Finding]:
    """Return errors and warnings of the FRFs, except gains that are unknowns of the fit."""
    wrong = wrong_numbers_of(problem.freq_hz, problem.measured)
    if wrong is not None:
        return [wrong]
    some = spread_lines(problem.freq_hz.size)
    shown = np.isfinite(problem.measured[0])
    rows, columns = np.flatnonzero(shown.any(axis=1)), np.flatnonzero(shown.any(axis=0))
    check = check_frfs(
        problem.freq_hz[some], problem.measured[some][:, rows][:, :, columns],
        responses=[channels.responses[i] for i in rows], forces=[channels.forces[i] for i in columns],
    )  # fmt: skip
    unknown = {*channels.response_gains, *channels.force_gains}
    return [
        one for one in check.findings
        if one.severity != "note" and one.code != "missing-frf"
        and not (one.code in ("channel-gain", "channel-unit") and unknown & {*one.about})
    ]  # fmt: skip


def _changed(known: NoiseOptions, change: ChannelChange) -> NoiseOptions:
    """Return noise options and the set-up of each FRF after a change of the channels."""

    def of(one: ArrayLike) -> ArrayLike:
        return one if np.ndim(one) != 3 else change.of(np.asarray(one, float), signed=False)

    setups = None if known.setups is None else change.of_setups(known.setups)
    noise = known.noise if known.noise is None or isinstance(known.noise, StatedNoise) else of(known.noise)
    coherence = None if known.coherence is None else of(known.coherence)
    return replace(known, noise=noise, coherence=coherence, setups=setups)


def _springs_at_joint(
    joint: LawJoint, freq_hz: FloatArray, gamma: ComplexArray, variance: FloatArray
) -> FloatArray | None:
    """Return initial values of a joint of springs from the compliance fit; None for other joints, or if it fails.

    Parameters
    ----------
    joint : LawJoint
        Joint of the model.
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    gamma, variance : ndarray, shape (n_freq, 2 n, 2 n)
        FRFs between all joint DOFs j, then k, m/N, and their noise variance E|e|^2, (m/N)^2.
    """
    if joint.rigid or not all(isinstance(law, SpringLaw) for law in joint.laws.values()):
        return None
    cross: CrossTerms = "fit" if any(a != b for a, b in joint.laws) else "zero"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            found = identify(
                freq_hz, gamma, joint.dofs, damping="viscous", cross=cross, noise=variance, accept=FATAL_CODES
            )
        except (ValueError, np.linalg.LinAlgError):
            return None
    k, c = found.stiffness_matrix, found.damping_matrix
    values: list[float] = []
    for (a, b), law in joint.laws.items():
        i, j = joint.dofs.index(a), joint.dofs.index(b)
        named = {"k": k[i, j], "c": c[i, j], "h": 0.0}
        if not np.isfinite(named["k"]):
            return None
        values += [max(named[one.name], one.lower) for one in law.fields]
    return np.array([*values, *joint.mass.values()])
