"""From measured FRFs of an assembly to the parameters of its joint: every method behind one door."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.errors import ConvergenceWarning, IdentificationWarning, IllConditionedWarning
from jointfrf.frf.bands import Band, as_bands, band_mean, in_bands
from jointfrf.identification.compliance_fit.estimator import (
    ComplianceEstimate,
    Cross,
    Damping,
    estimate,
    jackknife_covariance,
    joint_basis,
    neighbour_mean,
    reciprocity_noise,
)
from jointfrf.identification.compliance_fit.fit_notes import MISFIT, doubts, group_notes, left_out_notes, lost_warnings
from jointfrf.identification.joint_fit import JointFit
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_frequency,
    as_number,
    as_real,
    as_square,
    check_choice,
)
from jointfrf.substructuring.decoupling import Equation, decouple
from jointfrf.substructuring.ismm import inverse_substructuring, ismm

__all__ = ["Method", "identify"]

Method = Literal[
    "compliance",
    "ismm",
    "inverse_substructuring",
    "decoupling-rr",
    "decoupling-rs",
    "decoupling-sr",
    "decoupling-ss",
]
Bands = None | Band | Sequence[Band] | Mapping[str, Band | Sequence[Band]]

#: FRFs that differ less than this from their transpose were made reciprocal: they do not show their noise.
_RECIPROCAL = 1e-9


def identify(
    freq_hz: ArrayLike,
    gamma: ArrayLike,
    dofs: Sequence[str] | None = None,
    method: Method = "compliance",
    bands: Bands = None,
    *,
    transform: ArrayLike | None = None,
    damping: Damping | Literal["auto"] = "viscous",
    cross: Cross = "zero",
    noise: float | ArrayLike | None = None,
    reciprocal: bool = True,
    alpha: ArrayLike | None = None,
    k_initial: ArrayLike | None = None,
    h_a: ArrayLike | None = None,
    h_b: ArrayLike | None = None,
    dofs_j: ArrayLike | None = None,
    dofs_k: ArrayLike | None = None,
    dofs_r: ArrayLike | None = None,
    dofs_s: ArrayLike | None = None,
) -> JointFit:
    """Identify a joint from measured FRFs of the assembly.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Hz.
    gamma : array_like, shape (n_freq, 2 n, 2 n), or (n_freq, m, m) with `transform`, or (n_freq, n, n) for decoupling
        Measured receptances, m/N: at joint DOFs j, then k; or at the points that `transform` takes there; or, for
        decoupling, between the internal points that the equation names.
    dofs : sequence of str, optional
        Names of the n joint DOFs; names beginning with theta, rx, ry, rz are rotations. ``"0"``, ``"1"``, ... by
        default.
    method : str
        "compliance": maximum likelihood in the compliance domain, with error bars; needs no model of the
        substructures. "ismm": inverse structural modification (2.47), needs `alpha` and `k_initial`.
        "inverse_substructuring": -(gamma^-1)_jk, which ISMM reduces to. "decoupling-rr", "-rs", "-sr", "-ss":
        (2.53)-(2.56), need `h_a`, `h_b` and the DOF lists. All but the first take the mean over bands, as the source
        does.
    bands : None, (low, high), sequence of these, or mapping of DOF name to these, optional
        Sensitive bands in Hz; all lines by default. The compliance fit weighs each line by what it knows and needs
        none.
    transform : array_like, shape (2 n, m), optional
        From measured points to joint DOFs j, then k: rotations by finite differences. Noise is then taken as
        independent between the measured FRFs, not between the transformed ones.
    damping : {"viscous", "hysteretic", "both", "none", "auto"}
        Terms of K* = k (1 + i eta) + i w c to fit. "auto" takes what the data support (Bayesian information criterion).
        Compliance fit only.
    cross : {"zero", "ignore", "fit"}
        Terms that couple the DOFs of the joint: none, and this is used; perhaps, but not sought; fitted, symmetric.
        Compliance fit only.
    noise : float or array_like, shape (n_freq, m, m), optional
        Relative noise level of each entry, 0.01 for 1 %; or the variance E|e|^2 of each, (m/N)^2. By default relative,
        with its level estimated from the differences gamma_pq - gamma_qp.
    reciprocal : bool
        Whether the structure is reciprocal, so that gamma_pq and gamma_qp may be averaged. Compliance fit only.
    alpha : array_like, shape (n_freq, 2 n, 2 n), optional
        Calculated receptance of the assembly with the first estimate, for "ismm".
    k_initial : array_like, shape (n_freq, n, n) or (n, n), optional
        First estimate K0, for "ismm".
    h_a, h_b, dofs_j, dofs_k, dofs_r, dofs_s : optional
        As in `decouple`.

    Returns
    -------
    JointFit

    Raises
    ------
    ValueError
        Wrong shapes, names, bands; NaN or Inf in a line; an argument that the method needs is missing.
    SingularLineError
        A line cannot be inverted.

    Warns
    -----
    IdentificationWarning
        The data barely see a parameter, or the residual exceeds the noise: also in `JointFit.warnings`.
    ConvergenceWarning
        The fit did not converge.

    Notes
    -----
    Standard errors of the compliance fit: first-order propagation of the noise, at the larger of the noise
    level and the level the residual shows; where the residual exceeds the noise by 30 %, not below those of a
    jackknife over ten parts of the band, which sees what the model of the joint cannot follow. Standard errors of a
    band mean: scatter of its lines over the root of their number; they say nothing of its bias.

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
    """
    check_choice("method", method, get_args(Method))
    measured = as_square("gamma", gamma)
    freq = as_frequency(freq_hz, measured.shape[0])
    if freq.size == 0:
        raise ValueError("gamma has no frequency lines")
    broken = np.flatnonzero(~np.isfinite(measured).all(axis=(1, 2)))
    if broken.size:
        raise ValueError(f"gamma: NaN or Inf in line {broken[0]} ({freq[broken[0]]:g} Hz)")
    if method == "compliance":
        return _by_compliance(freq, measured, dofs, bands, transform, damping, cross, noise, reciprocal)

    if method.startswith("decoupling"):
        if h_a is None or h_b is None or dofs_j is None or dofs_k is None:
            raise ValueError(f"method {method!r} needs h_a, h_b, dofs_j and dofs_k")
        equation: Equation = method[-2:]  # type: ignore[assignment]
        k_lines = decouple(equation, h_a, h_b, measured, dofs_j, dofs_k, dofs_r, dofs_s, freq_hz=freq)
    else:
        at_joint = measured
        if transform is not None:
            t = _as_transform(transform, measured)
            at_joint = t @ measured @ t.T
        if method == "ismm":
            if alpha is None or k_initial is None:
                raise ValueError("method 'ismm' needs alpha and k_initial")
            k_lines = ismm(alpha, at_joint, k_initial, freq_hz=freq)
        else:
            k_lines = inverse_substructuring(at_joint, freq_hz=freq)
    return _by_band_mean(method, freq, k_lines, dofs, bands)


def _as_names(dofs: Sequence[str] | None, n: int) -> tuple[str, ...]:
    names = tuple(str(i) for i in range(n)) if dofs is None else tuple(dofs)
    if len(names) != n or len(set(names)) != n or any("," in name for name in names):
        raise ValueError(f"dofs must name {n} different joint DOFs without commas, not {', '.join(names) or 'none'}")
    return names


def _as_transform(transform: ArrayLike | None, measured: ComplexArray) -> FloatArray:
    m = measured.shape[1]
    t = as_real("transform", np.eye(m) if transform is None else transform, (None, m))
    if t.shape[0] == 0 or t.shape[0] % 2:
        what = "transform" if transform is not None else "gamma"
        raise ValueError(f"{what} must have an even number of rows, DOFs j, then k, not {t.shape[0]}")
    return t


def _by_band_mean(
    method: str, freq: FloatArray, k_lines: ComplexArray, dofs: Sequence[str] | None, bands: Bands
) -> JointFit:
    """Means over the bands, as the source takes them."""
    n = k_lines.shape[1]
    names = _as_names(dofs, n)
    own = as_bands(bands, names, freq)
    mean = band_mean(freq, k_lines, dict(zip(names, own, strict=True)), names)
    errors = []
    for part in (k_lines.real, k_lines.imag / np.where(freq > 0, 2 * np.pi * freq, np.nan)[:, None, None]):
        for d in range(n):
            values = part[in_bands(freq, own[d]), d, d]
            errors.append(values.std(ddof=1) / np.sqrt(values.size) if values.size > 1 else np.nan)
    parameters = {f"k_{d}": float(v) for d, v in zip(names, mean.stiffness, strict=True)}
    parameters |= {f"c_{d}": float(v) for d, v in zip(names, mean.damping, strict=True)}
    keep = np.any([in_bands(freq, b) for b in own], axis=0)
    note = "the standard error of a band mean is the scatter of its lines; its bias by noise is not in it"
    return JointFit(
        method=method,
        dofs=names,
        parameters=parameters,
        covariance=np.diag(np.square(errors)),
        noise_level=np.nan,
        residual_level=np.nan,
        freq_hz=freq[keep],
        k_lines=k_lines[keep],
        bands=tuple(tuple(b) for b in own),
        notes=(note,),
    )


def _by_compliance(
    freq: FloatArray,
    measured: ComplexArray,
    dofs: Sequence[str] | None,
    bands: Bands,
    transform: ArrayLike | None,
    damping: Damping | Literal["auto"],
    cross: Cross,
    noise: float | ArrayLike | None,
    reciprocal: bool,
) -> JointFit:
    t = _as_transform(transform, measured)
    names = _as_names(dofs, t.shape[0] // 2)
    check_choice("damping", damping, (*get_args(Damping), "auto"))
    check_choice("cross", cross, get_args(Cross))
    own = as_bands(bands, names, freq)
    used = np.stack([in_bands(freq, b) for b in own], axis=1)
    keep = np.asarray(used.any(axis=1))
    # Taken before lines are left out: what is next to a line in a band may lie outside.
    near = neighbour_mean(measured[None])[:, keep]
    freq, measured, used = freq[keep], measured[keep], used[keep]
    level, variance = _noise_of(noise, measured, keep)

    def fit(kind: Damping) -> ComplianceEstimate:
        basis = joint_basis(2 * np.pi * freq, names, kind, cross)
        with warnings.catch_warnings():
            # Lines on which noise hides the joint are ill-conditioned; they are left out, and this is told.
            warnings.simplefilter("ignore", IllConditionedWarning)
            return estimate(
                measured[None], t, basis, variance=variance, reciprocal=reciprocal, cross=cross, used=used, near=near,
                level=np.array([level]) if level > 0 else None,
            )  # fmt: skip

    notes: list[str] = []
    if damping == "auto":
        damping, result = _choose_damping(fit, level, notes)
    else:
        result = fit(damping)
    basis_names = joint_basis(2 * np.pi * freq[:1], names, damping, cross).names
    result, seen = result.of_seen(), np.flatnonzero(result.seen)
    residual = float(result.residual_level[0])
    if not level > 0:
        level = residual
        notes.append("the noise level is taken from the residual: the FRFs do not show it by their reciprocity")
    parameters = dict(zip([basis_names[i] for i in seen], result.theta[0].tolist(), strict=True))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", IllConditionedWarning)
        k_lines = inverse_substructuring(t @ measured @ t.T, on_singular="nan")
    found = JointFit(
        method="compliance",
        dofs=names,
        parameters=parameters,
        covariance=_covariance(result, level, residual),
        noise_level=level,
        residual_level=residual,
        freq_hz=freq,
        k_lines=k_lines,
        bands=tuple(tuple(b) for b in own),
    )
    notes += left_out_notes(result, names)
    unseen = [
        name for name, (low, high) in found.confidence_interval(0.95).items() if name[0] in "hc" and low < 0 < high
    ]
    if unseen:
        notes.append(f"{', '.join(unseen)}: not told from zero, the 95 % interval holds it")
    notes += group_notes(result, names, cross)
    told = lost_warnings(result, names) + doubts(found, result, cross)
    for text in told:
        warnings.warn(text, IdentificationWarning, stacklevel=3)
    if not result.converged[0]:
        warnings.warn(
            f"the fit did not converge in {result.iterations[0]} iterations", ConvergenceWarning, stacklevel=3
        )
        told.append(f"the fit did not converge in {result.iterations[0]} iterations")
    return replace(found, warnings=tuple(told), notes=tuple(notes))


def _covariance(result: ComplianceEstimate, level: float, residual: float) -> FloatArray:
    """Covariance from the noise; where the residual exceeds it, not below what blocks of lines say of each other."""
    covariance: FloatArray = result.covariance[0] * max(level, residual) ** 2
    if residual > MISFIT * level:
        by_blocks = jackknife_covariance(result)[0]
        grown = np.sqrt(np.maximum(np.diagonal(by_blocks) / np.diagonal(covariance), 1))
        covariance = covariance * np.outer(grown, grown)
    return covariance


def _noise_of(
    noise: float | ArrayLike | None, measured: ComplexArray, keep: NDArray[np.bool_]
) -> tuple[float, FloatArray | None]:
    """Return the noise level (0: not known) and, where given, the variances of unit level."""
    if noise is None:
        level = float(reciprocity_noise(measured[None])[0]) if measured.shape[1] > 1 else 0.0
        return (level if level > _RECIPROCAL else 0.0), None
    if np.ndim(noise) == 0:
        level = as_number("noise", noise)
        if level <= 0:
            raise ValueError(f"noise must be positive, not {level:g}")
        return level, None
    variance = as_real("noise", noise, (keep.size, *measured.shape[1:]))[keep]
    if (variance <= 0).any():
        raise ValueError("noise must hold positive variances")
    return 1.0, variance


def _choose_damping(
    fit: Callable[[Damping], ComplianceEstimate], level: float, notes: list[str]
) -> tuple[Damping, ComplianceEstimate]:
    """Take the damping terms with the lowest Bayesian information criterion, and note how clear the choice is."""
    kinds: tuple[Damping, ...] = ("viscous", "hysteretic", "both")
    results = {kind: fit(kind) for kind in kinds}
    # All are judged at the noise that the richest model leaves.
    power = float(results["both"].residual_level[0]) ** 2
    scores = {}
    for kind, result in results.items():
        equations, p = 2 * float(result.equations[0]), int(np.count_nonzero(result.seen))
        misfit = float(result.residual_level[0]) ** 2 * (equations - p) / max(power, np.finfo(float).tiny)
        scores[kind] = misfit + p * np.log(equations)
    ranked = sorted(scores, key=lambda kind: scores[kind])
    if ranked[0] == "both" and not _both_seen(results["both"], level):
        ranked.remove("both")
        notes.append("viscous and hysteretic damping cannot be told apart: only one of them is fitted")
    best = ranked[0]
    margin = scores[ranked[1]] - scores[best]
    strength = "clearly" if margin > 10 else "weakly" if margin > 2 else "hardly"
    notes.append(f"damping {best}: {strength} preferred to {ranked[1]} (difference of BIC {margin:.1f})")
    return best, results[best]


def _both_seen(result: ComplianceEstimate, level: float) -> bool:
    """Whether, for some DOF, the hysteretic and the viscous term both exceed zero by two standard errors.

    A joint feeds no energy: two terms of opposite sign that nearly cancel are noise.
    """
    residual = float(result.residual_level[0])
    result = result.of_seen()
    error = np.sqrt(np.diagonal(_covariance(result, level or residual, residual)))
    seen = (result.theta[0] > 2 * error).reshape(3, -1)  # k, h, c by DOF
    return bool((seen[1] & seen[2]).any())
