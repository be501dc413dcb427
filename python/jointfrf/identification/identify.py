"""From measured FRFs of an assembly to the parameters of its joint: the one door to every method."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, get_args, overload

from numpy.typing import ArrayLike

from jointfrf.channels.check.check import check_frfs, warn_of_frfs
from jointfrf.channels.check.finding import FrfCheck
from jointfrf.channels.point_lines import Interface
from jointfrf.frf.bands import spread_lines
from jointfrf.identification.band_means import fit_band_mean, prepare_band_mean
from jointfrf.identification.compliance_data import compliance_data
from jointfrf.identification.compliance_fit.describe import describe_compliance
from jointfrf.identification.joint_fit import JointFit
from jointfrf.identification.law_fit.identify_laws import check_law_joint, identify_laws
from jointfrf.identification.law_fit.law_fit import LawFit
from jointfrf.identification.manifold.coordinates import CrossTerms, DampingTerms
from jointfrf.identification.manifold.fit import fit_springs
from jointfrf.identification.manifold.prepare import FitOptions, FitProblem, prepare_compliance
from jointfrf.identification.manifold.transforms import Transform
from jointfrf.identification.noise import NoiseOptions
from jointfrf.identification.prepare import BandsOfDofs, MeasuredFrfs, as_measured
from jointfrf.kernel.arguments import FloatArray, check_choice
from jointfrf.laws.law_joint import LawJoint
from jointfrf.substructuring.methods import JointFrfs, StiffnessMethod

__all__ = ["IdentificationMethod", "identify"]

IdentificationMethod = Literal["compliance", StiffnessMethod]
_METHODS: tuple[IdentificationMethod, ...] = get_args(IdentificationMethod)


@overload
def identify(
    freq_hz: ArrayLike,
    gamma: ArrayLike,
    dofs: Sequence[str] | None = None,
    method: IdentificationMethod = "compliance",
    bands: BandsOfDofs = None,
    *,
    transform: Transform | tuple[Transform, Transform] | None = None,
    damping: DampingTerms | Literal["auto"] | Sequence[DampingTerms] = "auto",
    cross: CrossTerms = "zero",
    noise: float | ArrayLike | None = None,
    coherence: ArrayLike | None = None,
    averages: float | None = None,
    reciprocal: bool = True,
    alpha: ArrayLike | None = None,
    k_initial: ArrayLike | None = None,
    h_a: ArrayLike | None = None,
    h_b: ArrayLike | None = None,
    dofs_j: ArrayLike | None = None,
    dofs_k: ArrayLike | None = None,
    dofs_r: ArrayLike | None = None,
    dofs_s: ArrayLike | None = None,
    joint: None = None,
) -> JointFit: ...


@overload
def identify(
    freq_hz: ArrayLike,
    gamma: ArrayLike,
    dofs: Sequence[str] | None = None,
    method: Literal["compliance"] = "compliance",
    bands: BandsOfDofs = None,
    *,
    transform: Transform | tuple[Transform, Transform] | None = None,
    noise: float | ArrayLike | None = None,
    coherence: ArrayLike | None = None,
    averages: float | None = None,
    reciprocal: bool = True,
    joint: LawJoint,
) -> LawFit: ...


def identify(
    freq_hz: ArrayLike,
    gamma: ArrayLike,
    dofs: Sequence[str] | None = None,
    method: IdentificationMethod = "compliance",
    bands: BandsOfDofs = None,
    *,
    transform: Transform | tuple[Transform, Transform] | None = None,
    damping: DampingTerms | Literal["auto"] | Sequence[DampingTerms] = "auto",
    cross: CrossTerms = "zero",
    noise: float | ArrayLike | None = None,
    coherence: ArrayLike | None = None,
    averages: float | None = None,
    reciprocal: bool = True,
    alpha: ArrayLike | None = None,
    k_initial: ArrayLike | None = None,
    h_a: ArrayLike | None = None,
    h_b: ArrayLike | None = None,
    dofs_j: ArrayLike | None = None,
    dofs_k: ArrayLike | None = None,
    dofs_r: ArrayLike | None = None,
    dofs_s: ArrayLike | None = None,
    joint: LawJoint | None = None,
) -> JointFit | LawFit:
    """Identify a joint from measured FRFs of the assembly.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Hz.
    gamma : array_like, shape (n_freq, 2 n, 2 n), (n_freq, m_r, m_f) with `transform`, or (n_freq, n, n) for decoupling
        Measured receptances, m/N: at joint DOFs j, then k; or at the points that `transform` takes there; or, for
        decoupling, between the internal points that the equation names.
    dofs : sequence of str, optional
        Names of the n joint DOFs; names beginning with theta, rx, ry, rz are rotations. ``"0"``, ``"1"``, ... by
        default.
    method : str
        "compliance": maximum likelihood, with error bars; needs no model of the substructures. "ismm", "ismm-kj":
        inverse structural modification (2.47) with D_jk or D_kj, need `alpha` and `k_initial`.
        "inverse-substructuring": -(gamma^-1)_jk, which ISMM reduces to. "decoupling-rr", "-rs", "-sr", "-ss":
        (2.53)-(2.56), need `h_a`, `h_b` and the DOF lists. All but the first take the mean over bands, as the thesis
        does.
    bands : None, (low, high), sequence of these, or mapping of DOF name to these, optional
        Sensitive bands in Hz; all lines by default. "compliance" weights each line by its information and needs none.
    transform : array_like, shape (2 n, m), or Interface, or a pair of these, optional
        From channels to joint DOFs j, then k: finite differences, virtual points. Noise is then taken as independent
        between the channels, not between the transformed FRFs. A pair, for responses and for forces, of shapes
        (2 n, m_r) and (2 n, m_f), with "compliance". An `Interface`, as `interface` and `virtual_interface` make it,
        has the geometry of the channels: "compliance" then names DOFs left out that enter those sought, and widens
        intervals by what is not rigid between the channels; of a plain matrix it does the latter where the channels
        move as those of which it is the least-squares inverse.
    damping : {"auto", "viscous", "hysteretic", "both", "none"}, or a sequence of these, one for each DOF
        Terms of K* = k (1 + i eta) + i w c to fit. "auto" chooses for each DOF by the Bayesian information criterion,
        with `cross` "fit" for all DOFs together. Not for band means, which give viscous damping.
    cross : {"zero", "ignore", "fit"}
        Terms that couple the DOFs of the joint: none, and this is used; unknown and not fitted; fitted, symmetric.
        Where they are unknown, k is 1/C_dd of the compliance. Not for band means.
    noise : float or array_like, shape (n_freq, m_r, m_f), optional
        Relative noise level of each entry, 0.01 for 1 %, sqrt(E|e|^2) of real and imaginary part together; or the
        variance E|e|^2 of each, (m/N)^2. By default it is found by entry and frequency, as
        `estimate_noise` does. Not for band means.
    coherence, averages : optional
        As in `estimate_noise`, where `noise` is not given. Not for band means.
    reciprocal : bool
        Whether the structure is reciprocal, so that gamma_pq and gamma_qp may be averaged. Not for band means.
    alpha : array_like, shape (n_freq, 2 n, 2 n), optional
        Calculated receptance of the assembly with the first estimate, for ISMM.
    k_initial : array_like, shape (n_freq, n, n) or (n, n), optional
        First estimate K0, for ISMM.
    h_a, h_b, dofs_j, dofs_k, dofs_r, dofs_s : optional
        As in `decouple`.
    joint : LawJoint, optional
        Laws to fit in place of k (1 + i eta) + i w c, with rigid DOFs and cross terms, for "compliance"; it says what
        `damping` and `cross` do for springs. Masses need models: `identify_model`.

    Returns
    -------
    JointFit, or LawFit with `joint`

    Raises
    ------
    ValueError
        Wrong shapes, names, bands; NaN or Inf in a line; an argument that the method needs is missing.
    SingularLineError
        A line cannot be inverted.

    Warns
    -----
    IdentificationWarning
        The data determine a parameter poorly, or the residual exceeds the noise: also in `JointFit.warnings`.
    ConvergenceWarning
        The fit did not converge.
    FrfCheckWarning
        The FRFs look wrong (`check_frfs`): sign, quantity, gain, delay, a dead or doubled channel. Not for
        band means, nor where the structure is not reciprocal.

    Notes
    -----
    "compliance" is linearised at the smooth FRFs, on the manifold of FRFs that fit a joint: regular for stiff joints
    and on lines where gamma_jk is singular. Its standard errors: inverse information of the noise, times the
    correlation between lines, times the residual over the noise where it is above 1; the scatter between lines, or
    between ten parts of the band, replaces that where it exceeds it by more than chance. Intervals by the profile of
    the likelihood where they are not symmetric. Standard errors of a band mean: scatter of its lines over the root of
    their number; its bias is not included.

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
    check_choice("method", method, _METHODS)
    if joint is not None:
        is_free = isinstance(damping, str) and isinstance(cross, str) and (damping, cross) == ("auto", "zero")
        if method != "compliance" or not is_free:
            raise ValueError("joint says which laws are fitted, by method 'compliance': leave damping and cross out")
        own = check_law_joint(joint, dofs)
        problem = prepare_compliance(
            as_measured(freq_hz, gamma, square=False), own.dofs, bands, transform,
            NoiseOptions(noise, coherence, averages), FitOptions("viscous", "zero", reciprocal),
        )  # fmt: skip
        if reciprocal:
            _look_at(problem, transform)
        laws = identify_laws(problem, own)
        _warn(laws.warnings)
        return laws.fit
    if method == "compliance":
        problem = prepare_compliance(
            as_measured(freq_hz, gamma, square=False), dofs, bands, transform,
            NoiseOptions(noise, coherence, averages), FitOptions(damping, cross, reciprocal),
        )  # fmt: skip
        if reciprocal:
            _look_at(problem, transform)
        found = fit_springs(problem)
        described = describe_compliance(found, problem)
        _warn(described.warnings)
        return replace(described.fit, data=compliance_data(found, problem, transform))
    if coherence is not None or averages is not None:
        raise ValueError("coherence and averages are for method 'compliance'")
    if isinstance(transform, Interface):
        transform = transform.transform
    if isinstance(transform, tuple):
        raise ValueError("a pair of transforms, for responses and for forces, is for method 'compliance'")
    known = JointFrfs(
        alpha=alpha, k_initial=k_initial, h_a=h_a, h_b=h_b,
        dofs_j=dofs_j, dofs_k=dofs_k, dofs_r=dofs_r, dofs_s=dofs_s,
    )  # fmt: skip
    means = prepare_band_mean(method, as_measured(freq_hz, gamma), known, dofs, bands, transform)
    return fit_band_mean(means)


def _look_at(problem: FitProblem, transform: Transform | tuple[Transform, Transform] | None) -> None:
    """Warn of FRFs that look wrong."""
    transforms = None if transform is None else (problem.frfs.responses, problem.frfs.forces)
    warn_of_frfs(_checked(MeasuredFrfs(problem.freq_hz, problem.frfs.measured), problem.dofs, transforms), 3)


def _warn(told: Sequence[Warning]) -> None:
    """Issue the warnings of a fit."""
    for warning in told:
        warnings.warn(warning, stacklevel=3)


def _checked(
    measured: MeasuredFrfs, dofs: tuple[str, ...], transforms: tuple[FloatArray, FloatArray] | None
) -> FrfCheck:
    """Look at the FRFs of the lines used, by the names of the joint DOFs where these are the channels."""
    # A look at some lines, evenly spread, tells as much.
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
