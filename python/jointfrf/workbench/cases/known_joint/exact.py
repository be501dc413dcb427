"""FRFs of a case without noise, the FRFs that each method uses, and K*(w) by each method."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, cast

import numpy as np
import scipy.linalg

from jointfrf.channels.point_lines import difference_weights
from jointfrf.dofs import direction_names, is_rotation
from jointfrf.errors import IllConditionedWarning
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.kernel.call import OnSingular
from jointfrf.substructuring.coupling import couple
from jointfrf.substructuring.methods import STIFFNESS_METHODS, JointFrfs, StiffnessMethod, joint_stiffness
from jointfrf.workbench.cases.keys import FITTED, Observed
from jointfrf.workbench.cases.known_joint.keys import KnownJointCase
from jointfrf.workbench.structures.structure import Structure

__all__ = [
    "SHORT_FORM",
    "Exact",
    "NoiseFree",
    "exact_frfs",
    "frfs_by_differences",
    "joint_lines",
    "measured",
    "needed_frfs",
    "noise_free_errors",
    "noise_stream",
]

#: Joint points j and k and internal points r and s of A and B, in the notation of the thesis.
_POINTS = "jrks"


@dataclass(frozen=True)
class Exact:
    """FRFs of a case without noise, with n DOFs at each of the points j, r of A and k, s of B, in this order.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequency lines, Hz.
    dofs : tuple of str
        Names of the n joint DOFs.
    h_a, h_b : ndarray, shape (n_freq, 2 n, 2 n)
        Receptances of the substructures, m/N.
    h_initial, h_c : ndarray, shape (n_freq, 4 n, 4 n)
        Receptances of the assembly with the first estimate and with the actual joint, m/N.
    k_initial : ndarray, shape (n_freq, n, n)
        First estimate of K*, N/m.
    """

    freq_hz: FloatArray
    dofs: tuple[str, ...]
    h_a: ComplexArray
    h_b: ComplexArray
    h_initial: ComplexArray
    h_c: ComplexArray
    k_initial: ComplexArray

    @property
    def n(self) -> int:
        """Number of joint DOFs."""
        return len(self.dofs)

    def where(self, point: str) -> slice:
        """Return the DOFs of a point of the assembly: "j", "r", "k" or "s"."""
        start = self._start(point)
        return slice(start, start + self.n)

    def _start(self, point: str) -> int:
        return _POINTS.index(point) * self.n

    def at(self, observed: Observed) -> int:
        """Return the DOF of an observed FRF in the assembly."""
        return self._start(observed.point) + observed.dof

    def interface(self, h: ComplexArray) -> ComplexArray:
        """Return the FRFs at the joint, DOFs j then k, shape (n_freq, 2 n, 2 n)."""
        at = np.r_[self.where("j"), self.where("k")]
        return np.ascontiguousarray(h[:, at[:, None], at])


def exact_frfs(case: KnownJointCase) -> Exact:
    """Return receptances of the substructures (2.28)-(2.29) and of the assembly (2.26)."""
    freq, n = case.freq_hz, len(case.joint.dofs)
    h_a = case.a.receptance(freq, case.points["j"] + case.points["r"])
    h_b = case.b.receptance(freq, case.points["k"] + case.points["s"])
    first = list(range(n))
    initial = case.initial.dynamic_stiffness(freq)
    h_initial = couple(h_a, h_b, initial, first, first, freq_hz=freq)
    h_c = couple(h_a, h_b, case.joint.dynamic_stiffness(freq), first, first, freq_hz=freq)
    return Exact(freq, case.joint.dofs, h_a, h_b, h_initial, h_c, initial)


#: Translations whose slope along an axis is a rotation, with the sign of the slope.
_SLOPES = {"theta_x": ("z", 1, 1.0), "theta_y": ("z", 0, -1.0), "theta_z": ("y", 0, 1.0)}
#: Largest distance between a node and the place of a neighbour, as a fraction of the spacing.
_NEAR = 0.05


def frfs_by_differences(case: KnownJointCase, spacing: float) -> ComplexArray:
    """Return FRFs of the assembly at the joint, with rotations from finite differences of translations.

    Differences are central (2.57) between nodes on both sides, and one-sided at the end of a part.

    Parameters
    ----------
    case : KnownJointCase
        Case with models of both substructures.
    spacing : float
        Distance from the joint to the neighbouring points, m.

    Returns
    -------
    ndarray, shape (n_freq, 2 n, 2 n)
        Receptances at the joint DOFs j, then k, m/N.

    Raises
    ------
    ValueError
        No node at this distance.
    """
    freq, n = case.freq_hz, len(case.joint.dofs)
    sides, h = [], []
    for structure, point in ((case.a, "j"), (case.b, "k")):
        dofs = list(case.points[point])
        weights = _dof_weights(structure, dofs, spacing)
        dofs += dict.fromkeys(dof for row in weights for dof in row if dof not in dofs)
        sides.append(np.array([[row.get(dof, 0.0) for dof in dofs] for row in weights]))
        h.append(structure.receptance(freq, dofs))
    whole = couple(h[0], h[1], case.joint.dynamic_stiffness(freq), range(n), range(n), freq_hz=freq)
    taken = scipy.linalg.block_diag(*sides)
    found: ComplexArray = taken @ whole @ taken.T
    return found


def _dof_weights(structure: Structure, dofs: Sequence[str], spacing: float) -> list[dict[str, float]]:
    """Return for each DOF the DOFs of its finite difference, with their weights."""
    found = []
    for dof in dofs:
        node, _, direction = dof.rpartition(":")
        if not is_rotation(direction):
            found.append({dof: 1.0})
            continue
        along, axis, sign = _SLOPES["theta_z" if direction == "theta" else direction_names([direction])[0]]
        places = structure.places
        if node not in places:
            raise ValueError(f"node {node} has no coordinates for a difference in place of {dof}; give its coordinates")
        ends = set()
        for way in (-1, 1):
            wanted = places[node] + way * spacing * np.eye(3)[axis]
            nearest = min(places, key=lambda one: float(np.linalg.norm(places[one] - wanted)))
            if np.linalg.norm(places[nearest] - wanted) < _NEAR * spacing:
                ends.add(nearest)
        if not ends:
            raise ValueError(
                f"no node lies {spacing:g} m from {node} along {'xyz'[axis]} for rotation {dof}; change the spacing"
            )
        nodes = sorted(ends) if len(ends) == 2 else [node, *ends]
        slopes = difference_weights([places[one][axis] - places[node][axis] for one in nodes])[1]
        found.append({f"{one}:{along}": sign * slope for one, slope in zip(nodes, slopes.tolist(), strict=True)})
    return found


#: Short form of (2.47), which is equal up to rounding and needs no model.
SHORT_FORM = {"ismm": "inverse-substructuring"}

#: FRFs that fits use from a model.
_OF_FITS: dict[str, tuple[str, ...]] = {"compliance": (), "decoupling-fit": ("h_a", "h_b")}
#: Methods that use FRFs of the assembly at internal points.
_DECOUPLING = tuple(name for name, method in STIFFNESS_METHODS.items() if method.measured == "h_c")


def measured(exact: Exact, method: str) -> ComplexArray:
    """Return the FRFs of the assembly that a method uses.

    Parameters
    ----------
    exact : Exact
        FRFs without noise.
    method : str
        Name of the method.

    Returns
    -------
    ndarray, shape (n_freq, n, n) or (n_freq, 2 n, 2 n)
        Receptances, m/N. Decoupling by an equation uses n x n receptances between the internal points of the equation.
        The decoupling fit uses the points r, then s; all other methods use the joint DOFs j, then k.

    See Also
    --------
    joint_lines : K*(w) from these FRFs.
    """
    if method == "decoupling-fit":
        at = np.r_[exact.where("r"), exact.where("s")]
        return np.ascontiguousarray(exact.h_c[:, at[:, None], at])
    if method not in _DECOUPLING:
        return exact.interface(exact.h_c)
    points = method.removeprefix("decoupling-")
    return np.ascontiguousarray(exact.h_c[:, exact.where(points[0]), exact.where(points[1])])


def needed_frfs(exact: Exact, method: str) -> Exact:
    """Return a copy with only the FRFs that a method uses from a model, to send less to other processes."""
    needed = _OF_FITS[method] if method in FITTED else STIFFNESS_METHODS[cast(StiffnessMethod, method)].model
    slim = exact if "alpha" in needed else replace(exact, h_initial=exact.h_initial[:0])
    slim = replace(slim, h_c=exact.h_c[:0])
    return slim if "h_a" in needed else replace(slim, h_a=exact.h_a[:0], h_b=exact.h_b[:0])


def noise_stream(method: str) -> int:
    """Return the number that a method adds to the seed; FRFs at different points get different noise."""
    names = [*(str(name) for name in _DECOUPLING), "decoupling-fit"]
    return 1 + names.index(method) if method in names else 0


def joint_lines(exact: Exact, method: str, h: ComplexArray, on_singular: OnSingular = "raise") -> ComplexArray:
    """Return K* by a method, for several sets of measured FRFs.

    Parameters
    ----------
    exact : Exact
        Known FRFs of the substructures, or of the assembly with the first estimate.
    method : str
        Key of `STIFFNESS_METHODS`.
    h : ndarray, shape (r, n_freq, m, m)
        Receptances of `measured`, with or without noise, m/N.
    on_singular : {"raise", "nan"}
        Treatment of singular lines, default "raise".

    Returns
    -------
    ndarray, shape (r, n_freq, n, n)
        K*(w) of each set, N/m.

    See Also
    --------
    measured : FRFs that a method uses.
    """
    count, n_freq, n = len(h), exact.freq_hz.size, exact.n
    joint, inner = range(n), range(n, 2 * n)
    known = {
        "alpha": exact.interface(exact.h_initial),
        "k_initial": exact.k_initial,
        "h_a": exact.h_a,
        "h_b": exact.h_b,
    }
    name = cast(StiffnessMethod, method)
    needed = STIFFNESS_METHODS[name]
    frfs = JointFrfs(
        **{needed.measured: h.reshape(count * n_freq, *h.shape[2:])},
        **{field: np.tile(lines, (count, 1, 1)) for field, lines in known.items() if field in needed.model},
        dofs_j=joint, dofs_k=joint, dofs_r=inner, dofs_s=inner,
    )  # fmt: skip
    return joint_stiffness(name, frfs, on_singular=on_singular).reshape(count, n_freq, n, n)


class NoiseFree(NamedTuple):
    """Largest relative error of K* without noise, and relative change of K* by rounding of the FRFs."""

    error: float
    rounding: float


def noise_free_errors(exact: Exact, k_actual: ComplexArray) -> dict[str, NoiseFree]:
    """Return the largest relative error of K* without noise, by method.

    "short form" is the difference between (2.47) and -(gamma^-1)_jk. All other values are errors of the actual K*.
    """
    with warnings.catch_warnings():
        # The errors show the effect of ill-conditioned lines.
        warnings.simplefilter("ignore", IllConditionedWarning)
        found, changed = _all_methods(exact), _all_methods(_rounded(exact))
    size = np.sqrt(abs(np.diagonal(k_actual, axis1=1, axis2=2)))
    scale = size[:, :, None] * size[:, None, :]

    def difference(a: ComplexArray, b: ComplexArray) -> float:
        return float((abs(a - b) / scale).max())

    rounding = {method: difference(k, changed[method]) for method, k in found.items()}
    errors = {method: NoiseFree(difference(k, k_actual), rounding[method]) for method, k in found.items()}
    short = NoiseFree(difference(found["ismm"], found["inverse-substructuring"]), rounding["ismm"])
    return {"short form": short, **errors}


def _rounded(exact: Exact) -> Exact:
    """Return FRFs with reproducible rounding errors, up or down."""
    rng = np.random.default_rng(1)
    h_a, h_b, h_initial, h_c = (
        h * (1 + np.finfo(float).eps * rng.choice((-1.0, 1.0), h.shape))
        for h in (exact.h_a, exact.h_b, exact.h_initial, exact.h_c)
    )
    return replace(exact, h_a=h_a, h_b=h_b, h_initial=h_initial, h_c=h_c)


def _all_methods(exact: Exact) -> dict[str, ComplexArray]:
    """Return K* on every line by every method."""
    return {method: joint_lines(exact, method, measured(exact, method)[None])[0] for method in STIFFNESS_METHODS}
