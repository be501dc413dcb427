"""Means of K*(w) over bands, by the methods of the thesis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.channels.point_lines import Interface
from jointfrf.dofs import joint_parameters
from jointfrf.frf.bands import Band, as_bands, band_mean, in_bands
from jointfrf.identification.prepare import BandsOfDofs, as_dof_names, as_measured, as_transform
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import ComplexArray, FloatArray, check_choice
from jointfrf.messages.finding import Finding
from jointfrf.substructuring.methods import STIFFNESS_METHODS, JointFrfs, StiffnessMethod, joint_stiffness

__all__ = ["identify_band_mean"]


def identify_band_mean(
    freq_hz: ArrayLike,
    measured: ArrayLike,
    method: StiffnessMethod,
    dofs: Sequence[str] | None = None,
    bands: BandsOfDofs = None,
    *,
    transform: ArrayLike | Interface | None = None,
    alpha: ArrayLike | None = None,
    k_initial: ArrayLike | None = None,
    h_a: ArrayLike | None = None,
    h_b: ArrayLike | None = None,
    dofs_j: ArrayLike | None = None,
    dofs_k: ArrayLike | None = None,
    dofs_r: ArrayLike | None = None,
    dofs_s: ArrayLike | None = None,
) -> Fit:
    """Identify a joint by a method of the thesis: K*(w) of each line by itself, averaged over sensitive bands.

    `identify` needs no bands and no models and gives intervals for the noise. This function reproduces the thesis.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz.
    measured : array_like, shape (n_freq, 2 n, 2 n), (n_freq, m, m) with `transform`, or (n_freq, n, n) for decoupling
        Receptances, m/N, at joint DOFs j, then k, or at the channels of `transform`. For decoupling: receptances
        between the internal points in the equation.
    method : str
        Name of the method. "ismm", "ismm-kj": inverse structural modification (2.47) with D_jk or D_kj, need `alpha`
        and `k_initial`. "inverse-substructuring": -(gamma^-1)_jk, to which ISMM reduces. "decoupling-rr", "-rs", "-sr",
        "-ss": (2.53)-(2.56), need `h_a`, `h_b` and the DOF lists.
    dofs : sequence of str
        Names of the n joint DOFs; names that begin with theta, rx, ry or rz are rotations.
    bands : (low, high), sequence of these, or mapping of DOF name to these
        Sensitive bands, Hz.
    transform : array_like, shape (2 n, m), or Interface, optional
        Matrix from channels to joint DOFs j, then k; none by default.
    alpha : array_like, shape (n_freq, 2 n, 2 n), optional
        Receptance of the assembly calculated with the initial value of K*, m/N, for ISMM.
    k_initial : array_like, shape (n_freq, n, n) or (n, n), optional
        Initial value K0 of the dynamic stiffness, N/m, for ISMM.
    h_a, h_b : array_like, optional
        Receptances of the substructures, m/N, for decoupling; see `decouple`.
    dofs_j, dofs_k, dofs_r, dofs_s : sequence of int, optional
        Positions of joint and internal DOFs in `h_a` and `h_b`, for decoupling; see `decouple`.

    Returns
    -------
    Fit
        Stiffness and viscous damping. The standard error is the scatter of the lines over the root of their number; it
        does not contain the bias of a mean by noise.
        of a mean by noise is not included.

    Raises
    ------
    ValueError
        Wrong shapes, names, bands; NaN or Inf in a line; an argument that the method needs is missing.
    SingularLineError
        A line cannot be inverted.

    See Also
    --------
    identify : fit by maximum likelihood, without bands or models.
    decouple : K* line by line.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> h = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)[:, 1:, 1:]
    >>> gamma = jf.couple(h, h, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [0], [0])
    >>> fit = jf.identify_band_mean(freq, gamma, "inverse-substructuring", ["x"], (2, 8))
    >>> fit.stiffness.round(6).tolist(), fit.damping.round(6).tolist()
    ([2000.0], [3.0])
    """
    check_choice("method", method, tuple(STIFFNESS_METHODS))
    if isinstance(transform, Interface):
        transform = transform.transform
    if isinstance(transform, tuple):
        raise ValueError("a pair of transforms, for responses and for forces, is for identify")
    lines = as_measured(freq_hz, measured)
    freq, h = lines.freq_hz, lines.h
    known = JointFrfs(
        alpha=alpha, k_initial=k_initial, h_a=h_a, h_b=h_b,
        dofs_j=dofs_j, dofs_k=dofs_k, dofs_r=dofs_r, dofs_s=dofs_s,
    )  # fmt: skip
    if STIFFNESS_METHODS[method].measured == "h_c":
        known = replace(known, h_c=h)
    elif transform is None:
        known = replace(known, gamma=h)
    else:
        t = as_transform(transform, h.shape[1])
        known = replace(known, gamma=t @ h @ t.T)
    k_lines = joint_stiffness(method, known, freq_hz=freq)
    names = as_dof_names(dofs, k_lines.shape[1])
    of_dofs = tuple(map(tuple, as_bands(bands, names, freq)))
    mean = band_mean(freq, k_lines, dict(zip(names, of_dofs, strict=True)), names)
    parameters = [one.name for one in joint_parameters(names)]
    values = dict(zip(parameters, [*mean.stiffness.tolist(), *mean.damping.tolist()], strict=True))
    covariance = np.diag(np.square(_scatter(freq, k_lines, of_dofs)))
    kept = np.any([in_bands(freq, bands) for bands in of_dofs], axis=0)
    return Fit.of_springs(
        method, names, values, covariance, np.nan, np.nan, freq[kept],
        findings=(Finding("band-mean-error"),), k_lines=k_lines[kept], bands=of_dofs,
    )  # fmt: skip


def _scatter(freq: FloatArray, k: ComplexArray, bands_of_dofs: tuple[tuple[Band, ...], ...]) -> FloatArray:
    """Return the standard errors of the means: the scatter of the lines over the root of their number."""
    omega = np.where(freq > 0, 2 * np.pi * freq, np.nan)[:, None, None]
    errors = []
    for part in (k.real, k.imag / omega):
        for d, bands in enumerate(bands_of_dofs):
            values = part[in_bands(freq, bands), d, d]
            errors.append(values.std(ddof=1) / np.sqrt(values.size) if values.size > 1 else np.nan)
    return np.array(errors)
