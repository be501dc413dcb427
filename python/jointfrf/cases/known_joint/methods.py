"""The FRFs of a case that each method takes, and K*(w) of many realisations by it."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np

from jointfrf.cases.fitting import FITTED
from jointfrf.cases.known_joint.exact import Exact
from jointfrf.kernel.arguments import ComplexArray
from jointfrf.kernel.call import OnSingular
from jointfrf.substructuring.methods import STIFFNESS_METHODS, JointFrfs, StiffnessMethod, joint_stiffness

__all__ = ["SHORT_FORM", "joint_lines", "measured", "needed_frfs", "noise_stream"]

#: Equal up to rounding, and without the model: (2.47) and its short form.
SHORT_FORM = {"ismm": "inverse-substructuring"}

#: What fits take from a model.
_OF_FITS: dict[str, tuple[str, ...]] = {"compliance": (), "decoupling-fit": ("h_a", "h_b")}
_DECOUPLING = tuple(name for name, method in STIFFNESS_METHODS.items() if method.measured == "h_c")


def measured(exact: Exact, method: str) -> ComplexArray:
    """FRFs of the assembly that a method takes.

    Parameters
    ----------
    exact : Exact
    method : str

    Returns
    -------
    ndarray, shape (n_freq, n, n) for decoupling by an equation, else (n_freq, 2 n, 2 n)
        Between the internal points that the equation names; at r, then s; at joint DOFs j, then k. m/N.
    """
    if method == "decoupling-fit":
        at = np.r_[exact.where("r"), exact.where("s")]
        return np.ascontiguousarray(exact.h_c[:, at[:, None], at])
    if method not in _DECOUPLING:
        return exact.interface(exact.h_c)
    points = method.removeprefix("decoupling-")
    return np.ascontiguousarray(exact.h_c[:, exact.where(points[0]), exact.where(points[1])])


def needed_frfs(exact: Exact, method: str) -> Exact:
    """Leave out the FRFs that a method does not take from a model: a task goes to another process."""
    needed = _OF_FITS[method] if method in FITTED else STIFFNESS_METHODS[cast(StiffnessMethod, method)].model
    slim = exact if "alpha" in needed else replace(exact, h_initial=exact.h_initial[:0])
    slim = replace(slim, h_c=exact.h_c[:0])
    return slim if "h_a" in needed else replace(slim, h_a=exact.h_a[:0], h_b=exact.h_b[:0])


def noise_stream(method: str) -> int:
    """Return what a method adds to the seed: FRFs at other points have noise of their own."""
    names = [*(str(name) for name in _DECOUPLING), "decoupling-fit"]
    return 1 + names.index(method) if method in names else 0


def joint_lines(exact: Exact, method: str, h: ComplexArray, on_singular: OnSingular = "raise") -> ComplexArray:
    """K* by a method, for several sets of measured FRFs.

    Parameters
    ----------
    exact : Exact
        What the method knows of the substructures, or of the assembly with the first estimate.
    method : str
        A key of `STIFFNESS_METHODS`.
    h : ndarray, shape (r, n_freq, m, m)
        FRFs as `measured` returns them, with noise or without.
    on_singular : {"raise", "nan"}

    Returns
    -------
    ndarray, shape (r, n_freq, n, n)
        N/m.
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
