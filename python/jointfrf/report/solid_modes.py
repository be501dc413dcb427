"""Mode shapes of solids as shaded surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from jointfrf.kernel.arguments import FloatArray
from jointfrf.report.figure import Surface

__all__ = ["MovingBody", "deformed_surface"]

#: Largest displacement drawn, as a share of the length of the structure.
_DEFLECTION = 0.12


@dataclass(frozen=True)
class MovingBody:
    """The outside of a body and how its nodes move.

    Attributes
    ----------
    nodes : ndarray, shape (n_nodes, 3)
        Positions, m.
    faces : ndarray of int, shape (n_faces, 4)
        Nodes of the quadrilaterals on the outside, counted from 0.
    motion : ndarray, shape (n_nodes, 3)
        Displacements, of any size.
    """

    nodes: FloatArray
    faces: NDArray[np.integer]
    motion: FloatArray


def deformed_surface(bodies: Sequence[MovingBody]) -> Surface:
    """Draw bodies in a common motion: deformed true to scale, darker where they move more, outlines at rest.

    Parameters
    ----------
    bodies : sequence of MovingBody

    Returns
    -------
    Surface
        Values are displacements, as shares of the largest.
    """
    reach = _DEFLECTION * np.ptp(np.concatenate([body.nodes for body in bodies]), axis=0).max()
    sizes = [np.linalg.norm(body.motion, axis=1) for body in bodies]
    largest = max(float(size.max()) for size in sizes)
    drawn = [(body.nodes + reach / largest * body.motion)[body.faces] for body in bodies]
    values = [(size / largest)[body.faces].mean(axis=1) for body, size in zip(bodies, sizes, strict=True)]
    at_rest = [body.nodes[body.faces] for body in bodies]
    return Surface(np.concatenate(drawn), np.concatenate(values), edges=np.concatenate(at_rest))
