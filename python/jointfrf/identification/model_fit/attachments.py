"""What is attached to an assembly beside its joint: masses of sensors and shakers, springs to the ground."""

from __future__ import annotations

from dataclasses import dataclass

from jointfrf.dofs import is_rotation
from jointfrf.identification.model_fit.unknown import Unknown
from jointfrf.kernel.arguments import as_names, check_type

__all__ = ["AddedMass", "Attachment", "GroundSpring"]


@dataclass(frozen=True)
class AddedMass:
    """Mass of a sensor or a shaker that the models do not have.

    Parameters
    ----------
    dofs : str or tuple of str
        Where it moves, ``"A/151:y"``; all directions in which it does.
    mass : Unknown or float
        kg (of a rotation kg m^2).

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.AddedMass("A/151:y", jf.Unknown(0.01, 0.005, lower=0)).names
    ('mass A/151:y',)
    """

    dofs: str | tuple[str, ...]
    mass: Unknown | float

    def __post_init__(self) -> None:
        if not isinstance(self.dofs, str) and not as_names("dofs", self.dofs):
            raise ValueError("dofs must name at least one DOF")

    @property
    def places(self) -> tuple[str, ...]:
        """The DOFs."""
        return (self.dofs,) if isinstance(self.dofs, str) else tuple(self.dofs)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its numbers."""
        return (f"mass {self.places[0]}",)

    @property
    def units(self) -> tuple[str, ...]:
        """Their units."""
        return ("kg m^2" if is_rotation(self.places[0].rpartition(":")[2]) else "kg",)

    @property
    def numbers(self) -> tuple[Unknown | float, ...]:
        """Its numbers: the mass."""
        return (self.mass,)


@dataclass(frozen=True)
class GroundSpring:
    """Spring and dashpot to the ground: a suspension, a clamp that gives way, the stinger of a shaker.

    Parameters
    ----------
    dof : str
        Where it holds, ``"A/1:theta"``.
    stiffness : Unknown or float
        N/m, of a rotation N m/rad.
    damping : Unknown or float
        Viscous, N s/m, N m s/rad.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.GroundSpring("A/1:theta", jf.Unknown(1e5, 5e4, lower=0)).names
    ('ground stiffness A/1:theta', 'ground damping A/1:theta')
    """

    dof: str
    stiffness: Unknown | float
    damping: Unknown | float = 0.0

    def __post_init__(self) -> None:
        check_type("dof", self.dof, str)

    @property
    def places(self) -> tuple[str, ...]:
        """The DOF."""
        return (self.dof,)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its numbers."""
        return f"ground stiffness {self.dof}", f"ground damping {self.dof}"

    @property
    def units(self) -> tuple[str, ...]:
        """Their units."""
        turns = is_rotation(self.dof.rpartition(":")[2])
        return ("N m/rad", "N m s/rad") if turns else ("N/m", "N s/m")

    @property
    def numbers(self) -> tuple[Unknown | float, ...]:
        """Its numbers: stiffness and damping."""
        return self.stiffness, self.damping


Attachment = AddedMass | GroundSpring
