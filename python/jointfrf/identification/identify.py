"""From measured FRFs between all joint DOFs to the parameters of the joint: checks, fit, findings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.channels.check.amplitude import amplitude_of_channels, motion_of_lines
from jointfrf.channels.check.check import as_accepted, check_frfs, stop_at_errors, wrong_numbers_of
from jointfrf.channels.check.result import FrfCheck
from jointfrf.frf.bands import spread_lines
from jointfrf.frf.setups import SetUps
from jointfrf.frf.stated_noise import StatedNoise
from jointfrf.identification.compliance_data import as_pair, channel_names, compliance_data
from jointfrf.identification.describe import describe_laws, describe_springs
from jointfrf.identification.exponential_window import unstated_window, without_window
from jointfrf.identification.manifold.coordinates import CrossTerms, DampingTerms
from jointfrf.identification.manifold.fit import ManifoldFit, fit_laws, fit_springs
from jointfrf.identification.manifold.prepare import (
    FitOptions,
    FitProblem,
    as_equal_points,
    prepare_compliance,
)
from jointfrf.identification.manifold.transforms import Transform
from jointfrf.identification.noise import NoiseOptions
from jointfrf.identification.prepare import BandsOfDofs, MeasuredFrfs, as_measured
from jointfrf.identification.result import Fit
from jointfrf.identification.side_models import SideModel
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_names, as_not_negative, check_type
from jointfrf.laws.law_joint import LawJoint
from jointfrf.messages.finding import Finding

__all__ = ["identify"]


def identify(
    freq_hz: ArrayLike,
    gamma: ArrayLike,
    dofs: Sequence[str] | None = None,
    bands: BandsOfDofs = None,
    *,
    transform: Transform | tuple[Transform, Transform] | None = None,
    joint: LawJoint | None = None,
    damping: DampingTerms | Literal["auto"] | Sequence[DampingTerms] | None = None,
    cross: CrossTerms | None = None,
    same: Sequence[str] | Sequence[Sequence[str]] | None = None,
    noise: float | StatedNoise | ArrayLike | None = None,
    coherence: ArrayLike | None = None,
    averages: float | None = None,
    setups: SetUps | None = None,
    sensor_mass: float | None = None,
    reciprocal: bool = True,
    window_decay: float = 0.0,
    position_error: float = 0.0,
    sides: tuple[SideModel, SideModel] | None = None,
    accept: Sequence[str] = (),
) -> Fit:
    """Identify a joint from measured FRFs of the assembly between all its joint DOFs, without models.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz.
    gamma : array_like, shape (n_freq, 2 n, 2 n), or (n_freq, m_r, m_f) with `transform`
        Measured receptances, m/N, at joint DOFs j, then k, or at the channels of `transform`.
    dofs : sequence of str, optional
        Names of the n joint DOFs, default ``"0"``, ``"1"``, ...; names that begin with theta, rx, ry, rz are rotations.
        For several points the names have point and DOF: ``"bolt1.y"``, with parameters ``"bolt1.k_y"``.
    bands : None, (low, high), sequence of these, or mapping of DOF name to these, optional
        Sensitive bands, Hz; all lines by default. Bands are not needed, because each line is weighted by its
        information.
    transform : array_like, shape (2 n, m), or Interface, or a pair of these, optional
        Matrix from channels to joint DOFs j, then k: finite differences, virtual points. A pair has one matrix for
        responses and one for forces, of shapes (2 n, m_r) and (2 n, m_f). Noise is then independent between channels.
        An `Interface` from `interface` or `virtual_interface` has the geometry of the channels. With it, findings name
        omitted DOFs that enter the result, and intervals cover non-rigid motion between the channels; with a plain
        matrix they do so only if the channels move as its pseudo-inverse predicts.
    joint : LawJoint, optional
        Laws to fit, with rigid DOFs and cross terms; its parameters are initial values. By default springs and dampers
        according to `damping` and `cross`, as in a joint of `SpringLaw`. Masses need models: `identify_model`.
    damping : {"auto", "viscous", "hysteretic", "both", "none"}, or a sequence of these, one for each DOF
        Terms of K* = k (1 + i eta) + i w c to fit. The default "auto" chooses for each DOF by the Bayesian information
        criterion, two terms with a margin of 6. Values are then means over the kinds that the data do not exclude, and
        intervals cover all these kinds. With `cross` "points" or "fit", and with `same`, one choice is made for all
        DOFs.
    cross : {"zero", "ignore", "points", "fit"}
        Terms that couple the DOFs of the joint, default "zero":

        - "zero": no cross terms, which the fit uses
        - "ignore": unknown cross terms, not fitted; k is then 1/C_dd of the compliance
        - "points": symmetric cross terms between the DOFs of each point, none between points
        - "fit": symmetric cross terms between all DOFs
    same : sequence of str, or sequence of these, optional
        Points with equal joints, ``["bolt1", "bolt2"]``: they share all parameters, which are listed for each point.
    noise : float, StatedNoise or array_like, shape (n_freq, m_r, m_f), optional
        Relative noise level of each entry, 0.01 for 1 %, sqrt(E|e|^2) of real and imaginary part together; or relative
        part and floors; or the variance E|e|^2 of each channel, (m/N)^2. By default it is estimated by entry and
        frequency, see `estimate_noise`.
    coherence, averages : optional
        Coherence and number of averages of the FRFs if `noise` is not given; see `estimate_noise`.
    setups : SetUps, optional
        Set-up of the test of each FRF, from `FrfSet.setups_between`. Intervals cover errors common to the FRFs of a
        set-up and errors common to all FRFs; findings name set-ups that disagree.
    reciprocal : bool
        Whether the structure is reciprocal, so that gamma_pq and gamma_qp may be averaged; default True.
    sensor_mass : float, optional
        Mass of the accelerometer that moves from point to point, kg; 0 if no mass moves. If responses and forces are
        translations at the same points, the default is an estimate from h_pq - h_qp, which is removed with a warning.
    window_decay : float
        Decay sigma of an exponential window exp(-sigma t) on the responses, 1/s, default 0. The receptances must be
        those at s = i w + sigma: divide an accelerance by s^2 and a mobility by s (`FrfSet.receptance`). Stiffnesses of
        springs are larger there by sigma c, which is subtracted.
    position_error : float
        Standard deviation of the position of each channel along each axis, m, default 0. Intervals of rotations cover
        it. It needs an `Interface`; FRFs do not show such errors if the points of a side determine its motion exactly.
    sides : pair of SideModel, optional
        Models of the free sides j and k, which are flexible between channels and joint. The FRFs are first corrected by
        them; weights and intervals cover the uncertainty of the models.
    accept : sequence of str
        Codes of data errors at which the fit does not stop, such as "quantity" or "driving-point-sign"; none by
        default.

    Returns
    -------
    Fit
        Parameters of the joint with intervals, findings, and the test of the residual.

    Raises
    ------
    ValueError
        Wrong shapes, names, bands; NaN or Inf in a line; FRFs that no joint fits.
    FrfCheckError
        The FRFs are of another quantity, sign or time convention, and this is not accepted.

    Warns
    -----
    IdentificationWarning
        The data determine a parameter poorly, or the residual exceeds the noise: also in `Fit.findings`.
    ConvergenceWarning
        The fit did not converge.
    FrfCheckWarning
        The FRFs look wrong (`check_frfs`): gain, delay, a dead or doubled channel, amplitude dependence; only amplitude
        dependence is checked if the structure is not reciprocal.

    See Also
    --------
    identify_model : fit of any FRFs of an assembly, with models of the parts.
    identify_realisations : the same fit of many sets of FRFs.
    check_frfs : data check of the FRFs.

    Notes
    -----
    Maximum likelihood, linearised at the smooth FRFs, on the manifold of FRFs that fit a joint. This is regular for
    stiff joints and on lines at which gamma_jk is singular. The standard error is the inverse information of the noise,
    multiplied by the correlation between lines and by the ratio of residual to noise if it is above 1. The scatter
    between lines, or between ten parts of the band, replaces it if it exceeds it by more than chance. Asymmetric
    intervals follow from the profile of the likelihood. DOFs that may be free are fitted in k, h and c instead of 1/k.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    >>> b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    >>> assembly = jf.couple(a, b, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [1], [0])
    >>> gamma = jf.pollute(assembly[:, 1:3, 1:3], 0.05, seed=2)
    >>> fit = jf.identify(freq, gamma, dofs=["x"])
    >>> low, high = fit.confidence_interval(0.95)["k_x"]
    >>> bool(low < 2000 < high), bool(abs(fit.stiffness[0] / 2000 - 1) < 0.01)
    (True, True)

    A mount whose stiffness rises with frequency:

    >>> mount = jf.LawJoint({"x": jf.StandardLinearSolid(1500.0, 2000.0, tau=0.05)})
    >>> assembly = jf.couple(a, b, mount, [1], [0], freq_hz=freq)
    >>> gamma = jf.pollute(assembly[:, 1:3, 1:3], 0.02, seed=2)
    >>> guess = jf.LawJoint({"x": jf.StandardLinearSolid(100.0, 100.0, tau=1.0)})
    >>> found = jf.identify(freq, gamma, joint=guess)
    >>> [bool(low < true < high) for true, (low, high) in zip(mount.values, found.confidence_interval().values())]
    [True, True, True]
    """
    if joint is not None:
        if damping is not None or cross is not None:
            raise ValueError("damping and cross do not go with joint, which states the laws; leave them out")
        joint = _check_law_joint(joint, dofs)
        dofs = joint.dofs
        damping = "viscous"
    equal = as_equal_points(same)
    decay = as_not_negative("window_decay", window_decay)
    if decay and joint is not None:
        raise ValueError(f"window_decay {decay:g} corrects springs and dampers, not laws; leave out joint")
    if decay and sides is not None:
        raise ValueError(f"window_decay {decay:g}: models of sides give FRFs without a window; leave out sides")
    stray = as_not_negative("position_error", position_error)
    options = FitOptions(damping or "auto", cross or "zero", reciprocal, equal, stray)
    mass = None if sensor_mass is None else as_not_negative("sensor_mass", sensor_mass)
    measured = as_measured(freq_hz, gamma, square=False)
    arguments = (
        measured, dofs, bands, transform,
        NoiseOptions(noise, coherence, averages, setups=setups, sensor_mass=mass), options, _check_sides(sides),
    )  # fmt: skip
    problem = prepare_compliance(*arguments)
    accepted = as_accepted(accept)
    # Models of the sides have corrected the FRFs of the problem.
    raw = None if sides is None else measured.h[np.isin(measured.freq_hz, problem.freq_hz)]
    of_data = _data_checks(problem, transform, raw)
    stop_at_errors(of_data, accepted)
    if any(one.code == "amplitude-dependent" for one in of_data):
        if problem.noise.cross_axis is not None:
            # Forces of different motion break reciprocity, which looks like shares of other DOFs.
            problem = prepare_compliance(*arguments, is_checked=True, is_reciprocal=False)
        problem = replace(problem, motion=motion_of_lines(problem.frfs.measured))
    if joint is None:
        found = fit_springs(problem)
        fit = describe_springs(found, problem)
        if decay:
            fit = without_window(fit, decay)
    else:
        count = 2 * np.count_nonzero(np.isfinite(problem.frfs.variance))
        if count < len(joint.names):
            raise ValueError(f"{count} measured numbers for {len(joint.names)} parameters of laws; use more lines")
        found = fit_laws(problem, joint)
        fit = describe_laws(found, joint)
    fit = replace(fit, data=compliance_data(found, problem, transform))
    unstated = [] if decay else unstated_window(fit)
    fit = fit.with_findings([*fit.findings, *_off_axis(found, transform), *unstated, *of_data])
    fit.issue_warnings()
    return fit


def _off_axis(found: ManifoldFit, transform: Transform | tuple[Transform, Transform] | None) -> list[Finding]:
    """Name the channel with the largest share of another DOF; a note if noise exceeds the errors of all channels."""
    axis, known = found.problem.noise.cross_axis, found.known
    if axis is None:
        return []
    forces = channel_names(found.problem.frfs, found.problem.dofs, as_pair(transform))[1]
    worst = int(np.argmax(abs(axis.share) * axis.size))
    side, dof = divmod(int(axis.dofs[worst]), len(found.problem.dofs))
    numbers = {
        "share": float((abs(axis.share) * axis.size)[worst]), "error": float((axis.std_error * axis.size)[worst]),
        "dof": f"{'jk'[side]}:{found.problem.dofs[dof]}",
    }  # fmt: skip
    severity: Literal["warning", "note"] = "warning" if (known.smooth > known.spread.factor).any() else "note"
    return [Finding("off-axis", numbers, (forces[axis.channels[worst]],), severity=severity)]


def _check_sides(sides: tuple[SideModel, SideModel] | None) -> tuple[SideModel, SideModel] | None:
    if sides is None:
        return None
    if not isinstance(sides, Sequence) or len(sides) != 2:
        raise ValueError("sides must be the models of both sides of the joint, j and k")
    for side in sides:
        check_type("sides", side, SideModel)
    return sides[0], sides[1]


def _data_checks(
    problem: FitProblem, transform: Transform | tuple[Transform, Transform] | None, raw: ComplexArray | None
) -> list[Finding]:
    """Return errors and warnings of the FRFs; amplitude dependence of `raw` ones if models corrected them."""
    h, found = problem.frfs.measured if raw is None else raw, list[Finding]()
    names = channel_names(problem.frfs, problem.dofs, as_pair(transform))
    wrong = wrong_numbers_of(problem.freq_hz, h)
    if wrong is not None:
        return [wrong]
    if problem.options.reciprocal:
        transforms = None if transform is None else (problem.frfs.responses, problem.frfs.forces)
        check = _checked(MeasuredFrfs(problem.freq_hz, problem.frfs.measured), problem.dofs, transforms)
        found = [one for one in check.findings if one.severity != "note"]
        if transforms is not None:
            # DOFs of virtual points on flexible sides may be active, or have another sign than a driving point.
            found = [replace(one, severity="warning") if one.severity == "error" else one for one in found]
        if raw is None and all(one.code != "amplitude-dependent" for one in found):
            return found
    # by the names of the channels
    others = [one for one in found if one.code != "amplitude-dependent"]
    return others + amplitude_of_channels(problem.freq_hz, h, *names)


def _checked(
    measured: MeasuredFrfs, dofs: tuple[str, ...], transforms: tuple[FloatArray, FloatArray] | None
) -> FrfCheck:
    """Check the FRFs of the lines used; messages have the names of the joint DOFs if these are the channels."""
    # Some evenly spaced lines are sufficient.
    some = spread_lines(measured.freq_hz.size)
    freq, h = measured.freq_hz[some], measured.h[some]
    if transforms is None:
        return check_frfs(freq, h, [f"{side}:{dof}" for side in "jk" for dof in dofs])
    responses, forces = transforms
    if responses is forces:
        return check_frfs(freq, h)
    rows, columns = (
        [f"{what} {i}" for i in range(count)] for what, count in zip(("response", "force"), h.shape[1:], strict=True)
    )
    return check_frfs(freq, h, responses=rows, forces=columns, transform=transforms, dofs=dofs)


def _check_law_joint(joint: LawJoint, dofs: Sequence[str] | None) -> LawJoint:
    """Check a joint that is to be fitted without models; return it with its DOFs in the order of the FRFs."""
    check_type("joint", joint, LawJoint)
    names = joint.dofs if dofs is None else as_names("dofs", dofs)
    if sorted(names) != sorted(joint.dofs):
        raise ValueError(f"dofs must be the DOFs of joint, {', '.join(joint.dofs)}, not {', '.join(names)}")
    if joint.mass:
        raise ValueError(
            f"joint has a mass in {', '.join(joint.mass)}, which FRFs at the joint do not separate from the sides; "
            "leave it out, or use identify_model"
        )
    if not joint.laws:
        raise ValueError("joint has no law to fit, all DOFs are rigid; give a law to at least one DOF")
    return LawJoint(joint.laws, joint.rigid, None, names)
