"""What the FRFs do not hold, by its direction among the parameters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from jointfrf.identification.model_fit.unknowns import ParameterVector
from jointfrf.kernel.arguments import FloatArray

__all__ = ["OpenDirection", "open_directions"]

#: A direction is open where moving its parameters by this share, or by a standard deviation of their prior, changes
#: -2 log likelihood by less than 1.
_SHARE = 0.3
#: Components below this part of the largest are not named.
_NAMED = 0.2


class OpenDirection(NamedTuple):
    """A combination of parameters that the FRFs hardly change with.

    Attributes
    ----------
    parts : tuple of (str, float)
        Name of each parameter, and by how much of its value it changes, the largest first.
    std : float
        Standard deviation of the combination from the FRFs alone, in units of `parts`; inf where they say nothing.
    is_held_by_prior : bool
        Whether priors hold it.
    """

    parts: tuple[tuple[str, float], ...]
    std: float
    is_held_by_prior: bool


def open_directions(vector: ParameterVector, x: FloatArray, information: FloatArray) -> tuple[OpenDirection, ...]:
    """Return the directions that the FRFs do not hold.

    Parameters
    ----------
    vector : ParameterVector
    x : ndarray, shape (p,)
        Coordinates found.
    information : ndarray, shape (p, p)
        Half of the second derivatives of -2 log likelihood with priors, in coordinates.

    Notes
    -----
    Eigenvectors of the information of the FRFs alone, in units of a share of each value, or of its prior.
    """
    values, slope = vector.to_values(x)[vector.free], vector.slope(x)
    of_priors = vector.pull_slopes(x)
    of_frfs = information - np.diag(of_priors**2)
    std = np.array([one.std or np.inf for one in vector.fitted])
    unit = np.minimum(np.where(values == 0, np.inf, _SHARE * abs(values)), std)
    unit = np.where(np.isfinite(unit), unit, 1.0) / np.maximum(slope, np.finfo(float).tiny)
    value, turned = np.linalg.eigh(of_frfs * np.outer(unit, unit))
    told = []
    for size, direction in zip(value, turned.T, strict=True):
        if size >= 1:
            continue
        largest = abs(direction).max()
        change = direction * unit * slope / np.where(values == 0, 1, abs(values))
        change = change * np.sign(direction[abs(direction).argmax()])
        named = [i for i in np.argsort(-abs(direction)) if abs(direction[i]) > _NAMED * largest]
        by_prior = float(((direction * unit * of_priors) ** 2).sum())
        told.append(
            OpenDirection(
                tuple((vector.fitted[i].name, float(change[i])) for i in named),
                float(1 / np.sqrt(size)) if size > 0 else float("inf"),
                by_prior + max(size, 0) > 1 / 9,
            )
        )
    return tuple(told)
