"""Lumped chains of masses, springs and dashpots."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from jointfrf.kernel.arguments import FloatArray, as_real, check_choice
from jointfrf.models.model import Model

__all__ = ["Ground", "chain"]

Ground = Literal["none", "start", "end", "both"]


def chain(
    masses: ArrayLike,
    stiffness: ArrayLike,
    damping: ArrayLike | None = None,
    *,
    ground: Ground = "start",
    loss_factor: float = 0.0,
) -> Model:
    """Chain of masses with a spring and a dashpot between neighbours (figure 3-1).

    Parameters
    ----------
    masses : array_like, shape (n,)
        kg.
    stiffness : array_like, shape (n_springs,)
        Springs from the first to the last, N/m: n - 1 between the masses, and one more for each grounded end.
    damping : array_like, shape (n_springs,), optional
        Dashpots beside the springs, N s/m.
    ground : {"start", "end", "both", "none"}
        Which ends are held by a spring to the ground.
    loss_factor : float
        Loss factor of all springs.

    Returns
    -------
    Model
        DOFs ``"1:x"`` ... ``"n:x"``.

    Raises
    ------
    ValueError
        A mass that is not positive, or a wrong number of springs.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.chain([5, 3], [2500, 3500], ground="start").stiffness.toarray().tolist()
    [[6000.0, -3500.0], [-3500.0, 3500.0]]
    """
    check_choice("ground", ground, get_args(Ground))
    m = as_real("masses", masses, (None,))
    if m.size == 0 or (m <= 0).any():
        raise ValueError("masses must name at least one mass, all positive")
    first = 0 if ground in ("start", "both") else 1
    count = m.size + 1 - first - (0 if ground in ("end", "both") else 1)
    k = as_real("stiffness", stiffness, (count,))
    c = None if damping is None else as_real("damping", damping, (count,))

    def assembled(springs: FloatArray) -> sparse.dia_array:
        links = np.zeros(m.size + 1)  # link i lies before mass i, the last one after the last mass
        links[first : first + count] = springs
        diagonals = {-1: -links[1:-1], 0: links[:-1] + links[1:], 1: -links[1:-1]}
        if m.size == 1:
            diagonals = {0: diagonals[0]}
        return sparse.dia_array(sparse.diags_array(list(diagonals.values()), offsets=list(diagonals)))

    return Model(
        stiffness=assembled(k),
        mass=sparse.dia_array(sparse.diags_array(m)),
        damping=None if c is None else assembled(c),
        dofs=tuple(f"{i + 1}:x" for i in range(m.size)),
        loss_factor=loss_factor,
    )
