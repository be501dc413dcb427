"""Expected standard errors of a joint from FRFs between all its DOFs, without models of the sides."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.dofs import Parameter, parameter_name
from jointfrf.frf.bands import Band
from jointfrf.frf.stated_noise import StatedNoise
from jointfrf.identification.identify import identify
from jointfrf.identification.information_bound import information_rows
from jointfrf.identification.manifold.coordinates import DampingTerms
from jointfrf.identification.result import columns_of
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_frequency, as_square, check_type, one_line
from jointfrf.kernel.linear_algebra import invert
from jointfrf.workbench.planning.information import expected_noise, narrowest_band

__all__ = ["JointFrfPlan", "plan_joint_frfs"]


@dataclass(frozen=True)
class JointFrfPlan:
    """Expected standard errors from FRFs between all joint DOFs; `print` shows them.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Lines of the test, Hz.
    value, std_error : dict of str to float
        Expected stiffness and damping of each DOF, and their standard errors; N/m, N s/m (N m/rad, N m s/rad).
    line_share : ndarray, shape (n_parameters, n_freq)
        Share of the information on each parameter that each line contributes.
    frf_share : ndarray, shape (n_parameters, 2 n, 2 n)
        Share of the information on each parameter that each FRF contributes, joint DOFs j, then k. Averages that
        increase by 1 % lower the variance by a hundredth of the share.
    bands : dict of str to tuple of float
        Narrowest band with 90 % of the information on each parameter, Hz.
    shifts : dict of str to dict of str to float
        Error of each parameter that each set of biased FRFs causes, by the name of the set ("" without a name).
    """

    freq_hz: FloatArray
    value: dict[str, float]
    std_error: dict[str, float]
    line_share: FloatArray
    frf_share: FloatArray
    bands: dict[str, Band]
    shifts: dict[str, dict[str, float]]

    @property
    def shift(self) -> dict[str, float]:
        """Errors that the biased FRFs without a name cause; empty if there are none."""
        return self.shifts.get("", {})

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def moved(self) -> dict[str, dict[str, float]]:
        """Return the shifts by the headings of their columns in the table."""
        return {f"shift, {way}" if way else "shift": by for way, by in self.shifts.items()}

    def _lines(self) -> Iterator[str]:
        moved = self.moved()
        rows = [("", "expected", "standard error", "band, Hz", *moved)]
        for name, value in self.value.items():
            low, high = self.bands[name]
            row = (name, f"{value:.4g}", _relative(self.std_error[name], value), f"{low:.4g} to {high:.4g}")
            rows.append((*row, *(_relative(by[name], value) for by in moved.values())))
        yield from columns_of(rows)


def _relative(error: float, value: float) -> str:
    return f"{100 * error / abs(value):.2g} %" if value else f"{error:.2g}"


def plan_joint_frfs(
    freq_hz: ArrayLike,
    gamma: ArrayLike,
    joint: Joint,
    *,
    noise: float | StatedNoise = 0.01,
    floor: float = 0.0,
    averages: float = 1.0,
    biased: ArrayLike | Mapping[str, ArrayLike] | None = None,
) -> JointFrfPlan:
    """Return the standard errors that `identify` is expected to reach, and the information of lines and FRFs.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Lines of the test, Hz, above 0.
    gamma : array_like, shape (n_freq, 2 n, 2 n)
        Expected FRFs of the assembly, joint DOFs j, then k, m/N: from models of the parts by `couple`.
    joint : Joint
        Expected joint, without cross terms.
    noise : float or StatedNoise
        Standard deviation of an average relative to the FRF, default 0.01; or relative part and floors.
    floor : float
        Standard deviation of an average of the accelerance that does not depend on the FRF, m/(s^2 N), default 0.
    averages : float
        Number of averages of each FRF, default 1.
    biased : array_like, shape of gamma, or mapping of str to array_like, optional
        FRFs with the systematic errors of the test and without noise: rotations by finite differences at a spacing,
        virtual points on flexible sides, sensors with masses. `shift` contains the effect of one set, `shifts` the
        effects of several sets by name.

    Returns
    -------
    JointFrfPlan
        Expected values and standard errors, and shares of lines and FRFs.

    Raises
    ------
    ValueError
        Wrong shapes; a joint with cross terms; noise that is zero, or an FRF that is zero.
    SingularMatrixError
        The lines do not determine the parameters.

    See Also
    --------
    identify : fit of the measured FRFs.
    plan : choice of sensors and impacts with models of the parts.

    Notes
    -----
    The standard errors are the Cramer-Rao bound with unknown dynamic stiffnesses of both sides on every line, which
    `identify` reaches.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
    >>> b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
    >>> joint = jf.Joint([2000.0], [3.0], ["x"])
    >>> gamma = jf.couple(a, b, joint.dynamic_stiffness(freq), [1], [0])[:, 1:3, 1:3]
    >>> print(jf.plan_joint_frfs(freq, gamma, joint, noise=0.05))
         expected  standard error  band, Hz
    ---------------------------------------------
    k_x  2000      0.25 %          3.238 to 9.143
    c_x  3         4.2 %           3.881 to 9.786
    """
    check_type("joint", joint, Joint)
    lines = as_square("gamma", gamma)
    freq, n = as_frequency(freq_hz, len(lines)), len(joint.dofs)
    if not freq.size or freq.min() <= 0:
        raise ValueError("freq_hz has no lines or a line at or below 0 Hz; give lines above 0 Hz")
    if lines.shape[1] != 2 * n:
        raise ValueError(f"gamma has shape {lines.shape}; give {2 * n} x {2 * n} FRFs for {n} joint DOFs")
    matrices = {"k": joint.stiffness, "c": joint.damping, "h": joint.hysteretic_stiffness}
    if any((one - np.diag(np.diagonal(one))).any() for one in matrices.values()):
        raise ValueError("the joint has cross terms; give a joint without them")
    variance = expected_noise(noise, floor, averages).variance(freq, lines)
    if not variance.all():
        raise ValueError("an FRF is zero on a line and has no noise there; give floor")
    kinds = ["k", *(kind for kind in "ch" if matrices[kind].any())]
    expected = {
        parameter_name(kind, dof, dof): float(matrices[kind][i, i])
        for kind in kinds
        for i, dof in enumerate(joint.dofs)
    }

    ways = biased if isinstance(biased, Mapping) else {} if biased is None else {"": biased}
    names = {way: f"biased {one_line(way)}" if way else "biased" for way in ways}
    wrong = {way: as_square(names[way], own, freq.size) for way, own in ways.items()}
    rows = information_rows(freq, lines, variance, kinds)
    size = 1 / np.sqrt(2 * np.einsum("lfp,lfp->p", rows.conj(), rows).real)  # scaling: columns differ by decades
    rows = rows * size
    of_line = 2 * np.einsum("lfp,lfq->lpq", rows.conj(), rows, optimize=True).real
    of_frf = 2 * np.einsum("lfp,lfq->fpq", rows.conj(), rows, optimize=True).real
    covariance = invert(of_line.sum(axis=0)[None])[0].real
    own = np.diagonal(covariance)
    line_share, frf_share = (
        np.einsum("ia,eab,bi->ie", covariance, each, covariance, optimize=True) / own[:, None]
        for each in (of_line, of_frf)
    )
    return JointFrfPlan(
        freq,
        expected,
        dict(zip(expected, (size * np.sqrt(own)).tolist(), strict=True)),
        line_share,
        frf_share.reshape(-1, 2 * n, 2 * n),
        {name: narrowest_band(freq, share) for name, share in zip(expected, line_share, strict=True)},
        {way: _shift(freq, own, variance, joint, expected) for way, own in wrong.items()},
    )


def _shift(
    freq_hz: FloatArray, biased: ComplexArray, variance: FloatArray, joint: Joint, expected: dict[str, float]
) -> dict[str, float]:
    """Return the parameters from a fit of biased FRFs without noise, less the expected values."""
    kinds = {Parameter.parse(name).kind for name in expected}
    damping: DampingTerms = "both" if kinds == {"k", "c", "h"} else "hysteretic" if "h" in kinds else "viscous"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = identify(freq_hz, biased, joint.dofs, damping=damping, noise=variance)
    return {name: found.value[name] - value for name, value in expected.items()}
