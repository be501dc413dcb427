"""Bolts: their shape as one piece of steel, and the preload they are tightened to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from jointfrf.kernel.arguments import as_number
from jointfrf.solids.brick import Material

__all__ = ["PROOF_STRENGTH", "STEEL", "STRESS_AREA", "Bolt", "preload_force"]

#: Usual values of steel.
STEEL: Final = Material(youngs_modulus=210e9, poisson=0.3, density=7850.0, loss_factor=0.01)

#: Proof strength of a property class, Pa: ISO 898-1, Table 3, diameters up to 16 mm.
PROOF_STRENGTH: Final[dict[str, float]] = {
    "4.6": 225e6,
    "4.8": 310e6,
    "5.6": 280e6,
    "5.8": 380e6,
    "6.8": 440e6,
    "8.8": 580e6,
    "9.8": 650e6,
    "10.9": 830e6,
    "12.9": 970e6,
}
#: Tensile stress area of coarse metric threads, m^2: ISO 898-1, Table 4.
STRESS_AREA: Final[dict[str, float]] = {"M5": 14.2e-6, "M6": 20.1e-6, "M8": 36.6e-6, "M10": 58.0e-6, "M12": 84.3e-6}


@dataclass(frozen=True)
class Bolt:
    """Shank, head and nut as one body; the thread is left out.

    Parameters
    ----------
    shank_radius, head_radius, nut_radius : float
        m. Head and nut are round.
    head_height, nut_height : float
        m.
    material : Material

    Raises
    ------
    ValueError
        A dimension that is not positive; a head or nut that is not wider than the shank.

    Examples
    --------
    The default is an M8 bolt:

    >>> from jointfrf.solids.bolt import Bolt
    >>> Bolt().shank_radius, Bolt().head_height
    (0.004, 0.0053)
    """

    shank_radius: float = 0.004
    head_radius: float = 0.0065
    head_height: float = 0.0053
    nut_radius: float = 0.0065
    nut_height: float = 0.0068
    material: Material = STEEL

    def __post_init__(self) -> None:
        for name in ("shank_radius", "head_radius", "head_height", "nut_radius", "nut_height"):
            if as_number(name, getattr(self, name)) <= 0:
                raise ValueError(f"{name} must be positive, not {getattr(self, name):g} m")
        for name in ("head_radius", "nut_radius"):
            if getattr(self, name) <= self.shank_radius:
                radius, shank = 1e3 * getattr(self, name), 1e3 * self.shank_radius
                raise ValueError(f"{name} ({radius:g} mm) must exceed shank_radius ({shank:g} mm)")


def preload_force(tensile_area: float, proof_strength: float, share: float = 0.75) -> float:
    """Preload of a bolt, F_i = share A_t S_p (4.3)-(4.4).

    Parameters
    ----------
    tensile_area : float
        Tensile stress area A_t of the thread, m^2; see `STRESS_AREA`.
    proof_strength : float
        S_p, Pa; see `PROOF_STRENGTH`.
    share : float
        Of the proof load: 0.75 for connections that are taken apart again, 0.9 for permanent ones.

    Returns
    -------
    float
        N.

    Raises
    ------
    ValueError
        A value that is not positive; a share above 1.

    Examples
    --------
    An M8 bolt of class 10.9:

    >>> from jointfrf.solids.bolt import PROOF_STRENGTH, STRESS_AREA, preload_force
    >>> round(preload_force(STRESS_AREA["M8"], PROOF_STRENGTH["10.9"]), 1)
    22783.5
    """
    for name, value in (("tensile_area", tensile_area), ("proof_strength", proof_strength), ("share", share)):
        if as_number(name, value) <= 0:
            raise ValueError(f"{name} must be positive, not {value:g}")
    if share > 1:
        raise ValueError(f"share must not exceed 1, the proof load itself, not {share:g}")
    return share * tensile_area * proof_strength  # (4.3), (4.4)
