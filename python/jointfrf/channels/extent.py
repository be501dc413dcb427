"""How far apart the points of a side of a joint may be: further ones have coordinates in another unit than metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.kernel.arguments import as_real

__all__ = ["extent_of", "longest_extent"]

#: Points of one side of a joint, m; speed of the fastest waves in steel and aluminium, m/s; wave lengths over which
#: nothing is rigid.
_JOINT, _FASTEST, _WAVES = 3.0, 5e3, 20.0


def extent_of(places: ArrayLike) -> float:
    """Return the diagonal of the box around points, shape (n, 3), m."""
    return float(np.linalg.norm(np.ptp(as_real("places", places, (None, 3)), axis=0)))


def longest_extent(highest_hz: float | None = None) -> float:
    """Return the extent, m, beyond which points lie about no joint.

    Parameters
    ----------
    highest_hz : float, optional
        Upper end of the band, Hz; 20 lengths of longitudinal waves there, if these are shorter than 3 m.

    Examples
    --------
    >>> from jointfrf.channels.extent import longest_extent
    >>> longest_extent(1e3), longest_extent(50e3)
    (3.0, 2.0)
    """
    return _JOINT if not highest_hz else min(_JOINT, _WAVES * _FASTEST / highest_hz)
