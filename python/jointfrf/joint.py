"""A joint: stiffness and damping between DOFs of two substructures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Unpack

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.dofs import rigid_offset
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_array, as_frequency, as_names, as_real

if TYPE_CHECKING:
    from jointfrf.io.card_link import CardFormat
    from jointfrf.io.cards import CardOptions

__all__ = ["Joint"]


def _as_matrix(name: str, value: ArrayLike, n: int | None) -> FloatArray:
    array = np.atleast_1d(as_array(name, value))
    if array.ndim == 1:
        return np.diag(as_real(name, array, (n,)))
    return as_real(name, array, (n or len(array), n or len(array)))


@dataclass(frozen=True)
class Joint:
    """Massless joint, K*(w) = K (1 + i eta) + i H + i w C (2.11).

    Parameters
    ----------
    stiffness : array_like, shape (n,) or (n, n)
        Stiffness of each DOF, or the full matrix; N/m, rotational N m/rad.
    damping : array_like, shape (n,) or (n, n), optional
        Viscous damping, N s/m, rotational N m s/rad; none by default.
    dofs : sequence of str, optional
        Names of the DOFs, in any order.
    loss_factor : float or array_like, shape (n,)
        Hysteretic loss factor eta of each DOF, default 0; eta_ab = sqrt(eta_a eta_b) for a full matrix.
    structural_damping : array_like, shape (n,) or (n, n), optional
        Hysteretic damping H that loss factors cannot express; N/m, rotational N m/rad.

    Raises
    ------
    ValueError
        Shapes that do not agree, NaN or Inf, a negative loss factor.

    See Also
    --------
    LawJoint : joint of laws, which may depend on frequency.
    couple : FRFs of an assembly with a joint.

    Examples
    --------
    >>> import jointfrf as jf
    >>> joint = jf.Joint([6e5, 5e3], [20, 1.5], dofs=["y", "theta"])
    >>> joint.dynamic_stiffness([0.0])[0].real.tolist()
    [[600000.0, 0.0], [0.0, 5000.0]]
    >>> joint.reordered(["theta", "y"]).damping.tolist()
    [[1.5, 0.0], [0.0, 20.0]]
    """

    stiffness: FloatArray
    damping: FloatArray = field(default_factory=lambda: np.zeros(0))
    dofs: tuple[str, ...] = ()
    loss_factor: FloatArray = field(default_factory=lambda: np.zeros(1))
    structural_damping: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __init__(
        self,
        stiffness: ArrayLike,
        damping: ArrayLike | None = None,
        dofs: Sequence[str] | None = None,
        loss_factor: ArrayLike = 0.0,
        structural_damping: ArrayLike | None = None,
    ) -> None:
        k = _as_matrix("stiffness", stiffness, None)
        n = len(k)
        names = tuple(str(i) for i in range(n)) if dofs is None else as_names("dofs", dofs)
        if len(names) != n or len(set(names)) != n:
            raise ValueError(f"dofs must name {n} different DOFs, not {names}")
        losses = as_array("loss_factor", loss_factor)
        eta = as_real("loss_factor", losses if losses.ndim else np.broadcast_to(losses, (n,)), (n,))
        if (eta < 0).any():
            raise ValueError(f"loss_factor must not be negative, not {eta.min():g}")
        c, h = (
            np.zeros((n, n)) if value is None else _as_matrix(name, value, n)
            for name, value in (("damping", damping), ("structural_damping", structural_damping))
        )
        object.__setattr__(self, "stiffness", k)
        object.__setattr__(self, "damping", c)
        object.__setattr__(self, "dofs", names)
        object.__setattr__(self, "loss_factor", eta)
        object.__setattr__(self, "structural_damping", h)

    @property
    def hysteretic_stiffness(self) -> FloatArray:
        """Hysteretic damping, sqrt(eta_a eta_b) K_ab + H_ab, shape (n, n), N/m or N m/rad."""
        whole: FloatArray = self.stiffness * np.sqrt(np.outer(self.loss_factor, self.loss_factor))
        return whole + self.structural_damping

    def dynamic_stiffness(self, freq_hz: ArrayLike) -> ComplexArray:
        """Return the complex joint stiffness K*(w).

        Parameters
        ----------
        freq_hz : array_like, shape (n_freq,)
            Frequencies, Hz.

        Returns
        -------
        ndarray, shape (n_freq, n, n)
            Dynamic stiffness, N/m, rotational N m/rad.
        """
        freq = as_frequency(freq_hz)
        omega = 2 * np.pi * freq[:, None, None]
        k_joint: ComplexArray = self.stiffness + 1j * self.hysteretic_stiffness + 1j * omega * self.damping
        return k_joint

    def reordered(self, dofs: Sequence[str]) -> Joint:
        """Return the same joint with its DOFs in another order.

        Parameters
        ----------
        dofs : sequence of str
            Names of all its DOFs in the new order.

        Raises
        ------
        ValueError
            The names are not the names of its DOFs.
        """
        dofs = as_names("dofs", dofs)
        if len(dofs) != len(self.dofs) or set(dofs) != set(self.dofs):
            raise ValueError(f"dofs must name {', '.join(self.dofs)} in some order, not {', '.join(map(str, dofs))}")
        order = [self.dofs.index(dof) for dof in dofs]
        k, c, h = (matrix[np.ix_(order, order)] for matrix in (self.stiffness, self.damping, self.structural_damping))
        return Joint(k, c, tuple(dofs), self.loss_factor[order], h)

    def moved(self, offset: ArrayLike) -> Joint:
        """Return the same joint between other reference points, rigidly connected to the present ones.

        Parameters
        ----------
        offset : array_like, shape (3,)
            Vector from the present to the new reference points along x, y, z, m, equal on both sides.

        Returns
        -------
        Joint
            Joint with T^-T K T^-1, and the same of all damping, with T of `rigid_offset`: in general full matrices.

        Raises
        ------
        ValueError
            DOFs whose names do not name a direction, a wrong shape, NaN or Inf.

        Notes
        -----
        A joint resists the difference of the motions of its two reference points. Moved by different offsets, these
        would differ when both sides turn together, and the force would not depend on their difference alone.

        Examples
        --------
        >>> import jointfrf as jf
        >>> joint = jf.Joint([1e6, 1e3], dofs=["z", "theta_x"])
        >>> joint.moved([0, 0.1, 0]).stiffness.round(6).tolist()
        [[1000000.0, -100000.0], [-100000.0, 11000.0]]
        """
        back = rigid_offset(self.dofs, -as_real("offset", offset, (3,)))
        k, c, h = (back.T @ matrix @ back for matrix in (self.stiffness, self.damping, self.hysteretic_stiffness))
        return Joint(k, c, self.dofs, structural_damping=h)

    def export(self, program: CardFormat, nodes: Sequence[int], **options: Unpack[CardOptions]) -> str:
        """Return the joint as input of a finite-element program, in the units of the model.

        Parameters
        ----------
        program : {"abaqus", "calculix", "nastran", "ansys", "code_aster", "lsdyna", "subdyn"}
            Name of the program:

            - Abaqus: SPRING2 (complex with hysteretic damping) and DASHPOT2, or MATRIX INPUT if DOFs are coupled or
              nodes are away from the joint
            - CalculiX: SPRING2, SPRING1
            - Nastran: CBUSH and PBUSH, or DMIG if DOFs are coupled
            - Ansys: MATRIX27
            - Code_Aster: DISCRET of K_TR_L and A_TR_L
            - LS-DYNA: a discrete beam, or DMIG if DOFs are coupled or nodes are away from the joint
            - SubDyn: a spring element, no damping
        nodes : sequence of two int
            Nodes j on A and k on B. Directions are the global ones; Ansys uses the nodal coordinate systems.
        element, number : int
            First number of the new elements; first number of property, type and real constants, and part of names;
            default 1.
        rotation_nodes : sequence of two int, optional
            Nodes ROT NODE of rigid bodies whose REF NODEs are `nodes`: CalculiX only, and needed there for rotations.
        damping : bool
            Whether to write damping, default True.
        damping_nodes : int, optional
            First number of the auxiliary nodes of dashpots, two for each: CalculiX only, and needed there for viscous
            damping.
        full_matrix : bool
            Whether to write matrices even if springs are sufficient: Abaqus, Nastran; default False.
        positions : array_like, shape (2, 3), optional
            Positions of the two nodes in the model, in its unit of length; rigid arms connect them with `points`.
        points : array_like, shape (3,) or (2, 3), optional
            Reference point of the joint, or one for each side j and k, in the same unit, with `positions`; by default
            midway between the nodes. A comment states it.
        units : {"SI", "mm-t-s", "mm-kg-ms"}
            Units of the model: "SI" is m, N, s (default), "mm-t-s" is mm, N, s, and "mm-kg-ms" is mm, kN, ms. Arms of
            more than 10 m are an error.
        faces : sequence of two sequences of int, optional
            Nodes that follow the nodes j and k as rigid bodies: ``*RIGID BODY``, RBE2, CERIG. Without them, comments
            contain a sketch of such cards if nodes are apart from the reference point.
        comments : sequence of str, optional
            Lines of comment before the input.
        connector : bool
            Whether Abaqus gets a connector element instead of matrices or springs, default False: direct steady-state
            steps take no matrices. Both sides have one reference point, and hysteretic damping needs a table.
        table_hz : array_like, optional
            Frequencies of tables, Hz, above 0: Re K* and Im K*/w over frequency, for direct steady-state steps. Abaqus:
            SPRING2 and DASHPOT2 with frequencies, or a connector element if DOFs are coupled or nodes are away from
            the joint. Nastran: PBUSHT and TABLED1, not for coupled DOFs. Code_Aster: a dictionary of DISCRET by
            frequency.

        Returns
        -------
        str
            Lines of input; numbers have 14 digits, or as many as their field takes (9 at least, in LS-DYNA 4).

        Raises
        ------
        ValueError
            DOFs whose names do not name a direction; matrices that are not symmetric; numbers out of range. The program
            does not support the joint: hysteretic damping in CalculiX, Ansys and LS-DYNA, any damping in SubDyn,
            rotations of CalculiX without `rotation_nodes`.

        Notes
        -----
        Forces are K* (u_j - u_k), DOF by DOF, between the reference points of the joint. Nodes at other places move the
        points by rigid arms r, u_point = u + theta x r, and receive the moments r x f. The stiffness between the nodes
        is then T^T K* T. Without `positions` the nodes are the reference points, with no arm between them. A CBUSH has
        arms to the middle between its grids, and is the same joint if these coincide. Coupled springs of CalculiX:
        K_ab q_a q_b with q = u_j - u_k is the sum of four springs, two of them negative.

        Examples
        --------
        >>> import jointfrf as jf
        >>> print(jf.Joint([6e5], [20.0], dofs=["y"]).export("abaqus", (102, 202)))
        ** DOFs y; SI units, written by jointfrf
        *ELEMENT, TYPE=SPRING2, ELSET=JOINT1_K2
        1, 102, 202
        *SPRING, ELSET=JOINT1_K2
        2, 2
        6.0000000000000E+05
        *ELEMENT, TYPE=DASHPOT2, ELSET=JOINT1_C2
        2, 102, 202
        *DASHPOT, ELSET=JOINT1_C2
        2, 2
        2.0000000000000E+01
        <BLANKLINE>
        """
        matrices = self.stiffness, self.damping, self.hysteretic_stiffness
        from jointfrf.io.cards import spring_cards, table_cards  # importing readers of files is slow

        if (table_hz := options.get("table_hz")) is not None:
            freq = as_real("table_hz", table_hz, (None,))
            return table_cards(program, self.dofs, freq, self.dynamic_stiffness(freq), nodes, **options)
        return spring_cards(program, self.dofs, matrices, nodes, **options)
