"""Plane beams of two-node elements: Euler-Bernoulli, and a shear-flexible one like Abaqus' B21."""

from __future__ import annotations

import reprlib
from typing import Literal, get_args

import numpy as np
from scipy import sparse

from jointfrf.kernel.arguments import FloatArray, as_count, as_number, as_positive, as_real, check_choice
from jointfrf.models.model import Model

__all__ = ["BeamElement", "End", "beam", "check_ends"]

BeamElement = Literal["euler-bernoulli", "shear-flexible"]
End = Literal["free", "clamped"]

#: Shear coefficient of a rectangular section in Abaqus.
_SHEAR_COEFFICIENT = 0.85
#: Abaqus' slenderness compensation: keeps the shear stiffness of long elements from locking.
_SLENDERNESS_COMPENSATION = 0.25


def beam(
    length: float,
    n_elements: int,
    *,
    youngs_modulus: float,
    density: float,
    width: float,
    height: float,
    ends: tuple[End, End] = ("free", "free"),
    element: BeamElement = "euler-bernoulli",
    axial: bool = False,
    poisson: float = 0.3,
    loss_factor: float = 0.0,
    viscous: tuple[float, float] = (0.0, 0.0),
) -> Model:
    """Return a straight uniform beam of rectangular section along x, bending in y.

    Parameters
    ----------
    length : float
        Length, m.
    n_elements : int
        Number of equal elements.
    youngs_modulus, density : float
        Young's modulus, N/m^2, and density, kg/m^3.
    width, height : float
        Width and height of the section, m; it bends about its width.
    ends : tuple of {"free", "clamped"}
        Boundary conditions of the first and last node, default free. The DOFs of a clamped node are omitted.
    element : {"euler-bernoulli", "shear-flexible"}
        Element type: cubic with consistent mass (default); or linear with shear, one integration point and lumped mass,
        like Abaqus' B21.
    axial : bool
        Whether a node also moves along x, default False.
    poisson : float
        Poisson's ratio, for the shear modulus of the shear-flexible element.
    loss_factor : float
        Loss factor eta of structural damping, K (1 + i eta), default 0.
    viscous : tuple of float
        Coefficients (a, b) of viscous damping C = a M + b K, 1/s and s, default 0.

    Returns
    -------
    Model
        Beam with banded matrices. DOFs ``"node:y"``, ``"node:theta"`` (and ``"node:x"`` first); nodes are counted from
        1 at x = 0, including clamped ones.

    Raises
    ------
    ValueError
        A dimension that is not positive, or an unknown option.

    See Also
    --------
    plate : rectangular plates.
    chain : chains of masses and springs.
    with_modal_damping : a model with damping ratios of its modes.

    Examples
    --------
    The first natural frequency of a cantilever, 3.5160 sqrt(E I / (rho A L^4)) / (2 pi):

    >>> import jointfrf as jf
    >>> steel = dict(youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006)
    >>> model = jf.beam(0.3, 8, ends=("clamped", "free"), **steel)
    >>> round(float(model.natural_frequencies(1)[0]), 2)
    53.65
    """
    check_choice("element", element, get_args(BeamElement))
    check_ends(ends)
    sizes = {"length": length, "youngs_modulus": youngs_modulus, "density": density, "width": width, "height": height}
    for name, value in sizes.items():
        as_positive(name, value)
    n_elements = as_count("n_elements", n_elements)
    if not -1 < as_number("poisson", poisson) < 0.5:
        raise ValueError(f"poisson must lie between -1 and 0.5, not {poisson}")
    viscous = tuple(as_real("viscous", viscous, (2,)).tolist())

    area = width * height
    step = length / n_elements
    inertia = width * height**3 / 12
    if not 0 < step**3 < np.inf or not 0 < inertia < np.inf:
        raise ValueError(
            f"length {length:g} m, width {width:g} m and height {height:g} m give a section of no second moment of area"
        )
    if element == "euler-bernoulli":
        stiffness, mass = _euler_bernoulli(step, youngs_modulus * inertia, density * area)
    else:
        shear = youngs_modulus / (2 * (1 + poisson)) * _SHEAR_COEFFICIENT * area
        shear /= 1 + _SLENDERNESS_COMPENSATION * step**2 * area / (12 * inertia)
        stiffness, mass = _shear_flexible(step, youngs_modulus * inertia, shear, density * area, density * inertia)
    if axial:
        stiffness = _with_axial(stiffness, youngs_modulus * area / step * np.array([[1.0, -1.0], [-1.0, 1.0]]))
        stretch = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6 if element == "euler-bernoulli" else np.eye(2) / 2
        mass = _with_axial(mass, density * area * step * stretch)

    directions = ("x", "y", "theta") if axial else ("y", "theta")
    per_node = len(directions)
    first = per_node if ends[0] == "clamped" else 0
    last = per_node * (n_elements + 1) - (per_node if ends[1] == "clamped" else 0)
    k = _assembled(stiffness, n_elements, per_node, first, last)
    m = _assembled(mass, n_elements, per_node, first, last)
    names = [f"{node + 1}:{direction}" for node in range(n_elements + 1) for direction in directions]
    return Model(
        stiffness=k,
        mass=m,
        damping=None if viscous == (0.0, 0.0) else viscous[0] * m + viscous[1] * k,
        dofs=tuple(names[first:last]),
        loss_factor=loss_factor,
    )


def check_ends(ends: object) -> None:
    """Raise an error unless these are two words for the ends of a beam."""
    if not isinstance(ends, tuple | list) or len(ends) != 2:
        raise ValueError(f"ends must be two of {', '.join(get_args(End))}, not {reprlib.repr(ends)}")
    for end in ends:
        check_choice("ends", end, get_args(End))


def _euler_bernoulli(step: float, bending: float, line_mass: float) -> tuple[FloatArray, FloatArray]:
    """Return stiffness and consistent mass of the cubic element, DOFs y1, theta1, y2, theta2."""
    a = step
    k = np.array(
        [
            [12, 6 * a, -12, 6 * a],
            [6 * a, 4 * a**2, -6 * a, 2 * a**2],
            [-12, -6 * a, 12, -6 * a],
            [6 * a, 2 * a**2, -6 * a, 4 * a**2],
        ]
    )
    m = np.array(
        [
            [156, 22 * a, 54, -13 * a],
            [22 * a, 4 * a**2, 13 * a, -3 * a**2],
            [54, 13 * a, 156, -22 * a],
            [-13 * a, -3 * a**2, -22 * a, 4 * a**2],
        ]
    )
    return bending / a**3 * k, line_mass * a / 420 * m


def _shear_flexible(
    step: float, bending: float, shear: float, line_mass: float, rotary_mass: float
) -> tuple[FloatArray, FloatArray]:
    """Return stiffness and lumped mass of the linear element, integrated at its middle."""
    curvature = np.array([0, -1, 0, 1]) / step
    angle = np.array([-1 / step, -0.5, 1 / step, -0.5])
    k = step * (bending * np.outer(curvature, curvature) + shear * np.outer(angle, angle))
    return k, step / 2 * np.diag([line_mass, rotary_mass, line_mass, rotary_mass])


def _with_axial(bending: FloatArray, axial: FloatArray) -> FloatArray:
    """Return an element matrix with the axial DOF first at each node."""
    whole = np.zeros((6, 6))
    whole[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])] = bending
    whole[np.ix_([0, 3], [0, 3])] = axial
    return whole


def _assembled(element: FloatArray, count: int, per_node: int, first: int, last: int) -> sparse.dia_array:
    """Return the sum of equal elements along the beam by diagonals; DOFs first to last - 1 are kept."""
    size = 2 * per_node
    total = per_node * (count + 1)
    diagonals = np.zeros((2 * size - 1, total))
    starts = per_node * np.arange(count)
    for row in range(size):
        for column in range(size):
            diagonals[column - row + size - 1, starts + column] += element[row, column]
    whole = sparse.dia_array((diagonals, np.arange(1 - size, size)), shape=(total, total))
    return sparse.dia_array(sparse.csr_array(whole)[first:last, first:last])
