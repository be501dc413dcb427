"""Any number of bodies and connections at once: dual assembly (LM-FBS) with flexible and rigid connections."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.dofs import similar_dof
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_frequency, as_names, as_square, check_type, one_line
from jointfrf.kernel.call import N_FREQ, OnSingular, run
from jointfrf.laws.law_joint import LawJoint
from jointfrf.substructuring.coupling import lost_rcond, redundant_ties

__all__ = ["BodyLink", "FreeBody", "couple_bodies"]


@dataclass(frozen=True)
class FreeBody:
    """Receptances of a body between named DOFs.

    Parameters
    ----------
    h : array_like, shape (n_freq, n, n)
        Receptances, m/N (rotational rows rad/N, rotational columns m/(N m)).
    dofs : sequence of str
        Names of its DOFs, ``"3:y"``.

    See Also
    --------
    couple_bodies : receptances of connected bodies.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> jf.FreeBody(np.full((1, 1, 1), 0.5), ["1:x"]).dofs
    ('1:x',)
    """

    h: ArrayLike
    dofs: Sequence[str]

    def __post_init__(self) -> None:
        object.__setattr__(self, "h", as_square("h", self.h))
        object.__setattr__(self, "dofs", as_names("dofs", self.dofs))
        if len(set(self.dofs)) != len(self.dofs):
            raise ValueError("dofs must name each DOF once")
        if np.shape(self.h)[1] != len(self.dofs) or not self.dofs:
            raise ValueError(f"dofs must name the {np.shape(self.h)[1]} DOFs of h, at least one, not {len(self.dofs)}")


@dataclass(frozen=True)
class BodyLink:
    """A joint between DOFs of two bodies, of one body, or of a body and the ground.

    Parameters
    ----------
    joint : Joint or LawJoint
        Joint; a `LawJoint` may have rigid DOFs and masses: ``LawJoint({}, rigid=["x", "y"])``.
    first, second : sequence of str
        DOFs ``"A/3:y"`` on both sides in the order of the joint; without `second` the joint acts against the ground.

    See Also
    --------
    couple_bodies : receptances of connected bodies.

    Examples
    --------
    >>> import jointfrf as jf
    >>> jf.BodyLink(jf.Joint([1e6], dofs=["y"]), ["frame/12:y"], ["motor/1:y"]).second
    ('motor/1:y',)
    """

    joint: Joint | LawJoint
    first: Sequence[str]
    second: Sequence[str] = field(default=())

    def __post_init__(self) -> None:
        if not isinstance(self.joint, Joint | LawJoint):
            raise TypeError(f"joint must be a Joint or LawJoint, not {type(self.joint).__name__}")
        for name in ("first", "second"):
            object.__setattr__(self, name, as_names(name, getattr(self, name)))
            own = getattr(self, name)
            if len(own) != len(self.joint.dofs) and (own or name == "first"):
                raise ValueError(f"{name} must name {len(self.joint.dofs)} DOFs as the joint has, not {len(own)}")


class _Rows(NamedTuple):
    """Rows of one connection: DOFs plus and minus counted from 1 (0 for the ground), flags of rigid rows, and T."""

    ends: NDArray[np.int32]
    rigid: NDArray[np.int32]
    t: ComplexArray

    def only(self, kept: NDArray[np.bool_]) -> _Rows:
        """Return some of the rows."""
        return _Rows(self.ends[kept], self.rigid[kept], self.t[:, kept][:, :, kept])


def couple_bodies(
    freq_hz: ArrayLike,
    bodies: Mapping[str, FreeBody],
    links: Iterable[BodyLink],
    responses: Sequence[str] | None = None,
    forces: Sequence[str] | None = None,
    *,
    on_singular: OnSingular = "raise",
) -> ComplexArray:
    """Return the receptances of bodies that are all connected at once.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Frequencies, Hz.
    bodies : mapping of str to FreeBody
        Bodies by name.
    links : iterable of BodyLink
        Any number of joints between any DOFs, in loops and to the ground.
    responses, forces : sequence of str, optional
        DOFs ``"A/3:y"`` of the rows and columns; by default all, body after body.
    on_singular : {"raise", "nan"}
        Whether a singular line raises an error (default) or becomes NaN.

    Returns
    -------
    ndarray, shape (n_freq, n_responses, n_forces)
        Receptances, m/N.

    Raises
    ------
    SingularLineError
        The assembly resonates without damping at a line, or rigid connections fix a rigid body more than once. The
        matrix to be inverted is then singular to working precision: its reciprocal condition number is below q times
        the machine epsilon, with q rows.
    ValueError
        Names that do not exist; shapes that do not agree; NaN or Inf in a line.

    See Also
    --------
    couple : two bodies and one joint.
    Assembly : an assembly with unknowns, for fits.

    Notes
    -----
    Y = H - H B^T (S + T B H B^T)^-1 T B H is the dual assembly of [1]_ if all connections are rigid (S = 0, T = 1); a
    stiffness has S = 1 and T = K*. H is block-diagonal, so that each product involves one body and its rows.

    A rigid connection that follows from others (A-B, B-C, C-A) adds nothing and is omitted. The signed Boolean matrix B
    of all rigid rows is the incidence matrix of a graph, whose rank is the size of a spanning forest.

    References
    ----------
    .. [1] D. de Klerk, D. J. Rixen, S. N. Voormeeren, General framework for dynamic substructuring, AIAA Journal 46
       (2008) 1169-1181.

    Examples
    --------
    Three masses in a ring of springs of 3 N/m, each with a spring of 2 N/m to the ground, at rest:

    >>> import numpy as np, jointfrf as jf
    >>> bodies = {name: jf.FreeBody(np.full((1, 1, 1), 0.5), ["x"]) for name in "ABC"}
    >>> spring = jf.Joint([3.0], dofs=["x"])
    >>> ring = [jf.BodyLink(spring, [f"{a}/x"], [f"{b}/x"]) for a, b in ("AB", "BC", "CA")]
    >>> jf.couple_bodies([0.0], bodies, ring).real.round(4)[0].tolist()
    [[0.2273, 0.1364, 0.1364], [0.1364, 0.2273, 0.1364], [0.1364, 0.1364, 0.2273]]
    """
    freq = as_frequency(freq_hz)
    named = _named(bodies, freq.size)
    all_dofs = [f"{name}/{dof}" for name, body in named.items() for dof in body.dofs]
    number = {dof: i for i, dof in enumerate(all_dofs, 1)}
    rows = _independent([_rows(link, number, freq) for link in _links(links)])
    sizes = np.array([len(body.dofs) for body in named.values()], np.int32)
    h = np.concatenate([np.reshape(body.h, (freq.size, -1)) for body in named.values()], axis=1)
    t = np.concatenate([one.t.reshape(freq.size, -1) for one in rows], axis=1)
    ends, rigid = np.concatenate([one.ends for one in rows]), np.concatenate([one.rigid for one in rows])
    connection = np.repeat(np.arange(1, len(rows) + 1, dtype=np.int32), [len(one.ends) for one in rows])
    wanted = [_wanted(what, own, number) for what, own in (("responses", responses), ("forces", forces))]
    order = [np.argsort(own, kind="stable") for own in wanted]
    outputs, inputs = (own[at] for own, at in zip(wanted, order, strict=True))
    args = (
        sizes.size, len(ends), h.shape[1], t.shape[1], outputs.size, inputs.size, N_FREQ, sizes, ends, connection,
        rigid, h, t, outputs, inputs,
    )  # fmt: skip
    shape = (freq.size, outputs.size, inputs.size)
    lost = lost_rcond(len(ends))
    found = run("couple_bodies", args, shape, {"h": h, "links": t}, freq, on_singular, singular_rcond=lost)[0]
    if all((np.diff(at) > 0).all() for at in order):
        return found
    back = np.empty_like(found)
    back[:, order[0][:, None], order[1]] = found
    return back


def _named(bodies: Mapping[str, FreeBody], n_freq: int) -> dict[str, FreeBody]:
    """Return the bodies, at least one, all on the same lines."""
    if not isinstance(bodies, Mapping) or not bodies:
        raise TypeError(f"bodies must be a mapping of names to FreeBody, not {one_line(bodies)}")
    for name, body in bodies.items():
        check_type("bodies", body, FreeBody)
        if not isinstance(name, str) or not name or "/" in name:
            raise ValueError(f"bodies must have names without '/', not {one_line(name)}")
        if len(np.asarray(body.h)) != n_freq:
            raise ValueError(f"body {name} must have {n_freq} lines as freq_hz, not {len(np.asarray(body.h))}")
    return dict(bodies)


def _links(links: Iterable[BodyLink]) -> list[BodyLink]:
    if not isinstance(links, Iterable) or isinstance(links, str | Mapping):
        raise TypeError(f"links must be a sequence of BodyLink, not {one_line(links)}")
    listed = list(links)
    for link in listed:
        check_type("links", link, BodyLink)
    if not listed:
        raise ValueError("links must contain at least one BodyLink")
    return listed


def _places(what: str, dofs: Sequence[str], number: Mapping[str, int]) -> NDArray[np.int32]:
    for dof in dofs:
        if dof not in number:
            raise ValueError(f"{what}: no body has a DOF {one_line(dof)}{similar_dof(dof, number)}")
    return np.array([number[dof] for dof in dofs], np.int32)


def _wanted(what: str, dofs: Sequence[str] | None, number: Mapping[str, int]) -> NDArray[np.int32]:
    names = tuple(number) if dofs is None else as_names(what, dofs)
    if len(set(names)) != len(names):
        raise ValueError(f"{what} must name each DOF once")
    return _places(what, names, number)


def _rows(link: BodyLink, number: Mapping[str, int], freq_hz: FloatArray) -> _Rows:
    """Return the rows of a connection."""
    first, second = (_places("links", own, number) for own in (link.first, link.second))
    n = first.size
    if second.size == 0:
        second = np.zeros(n, np.int32)
    if (first == second).any():
        raise ValueError(f"links: {link.first[int(np.argmax(first == second))]} is connected with itself")
    if isinstance(link.joint, Joint):
        return _Rows(np.stack([first, second], 1), np.zeros(n, np.int32), link.joint.dynamic_stiffness(freq_hz))
    link.joint.check_at_points("a link connects points")
    own = link.joint.connection(2 * np.pi * freq_hz)
    places = np.concatenate([first, second])
    plus, minus = (np.abs(own.pattern * (own.pattern * sign > 0)) for sign in (1, -1))
    ends = np.stack([(places @ side).astype(np.int32) for side in (plus, minus)], 1)
    rigid = (np.diagonal(own.s, axis1=1, axis2=2)[:1] == 0).any(axis=0).astype(np.int32)
    return _Rows(ends, rigid, own.t).only(ends[:, 0] > 0)  # half the mass of a joint to the ground moves with the body


def _independent(rows: Sequence[_Rows]) -> list[_Rows]:
    """Return the rows without rigid ones that follow from others."""
    ends, rigid = (np.concatenate(parts) for parts in zip(*((one.ends, one.rigid) for one in rows), strict=True))
    kept = rigid == 0
    kept[~kept] = ~redundant_ties(ends[~kept])
    pieces = np.split(kept, np.cumsum([len(one.ends) for one in rows])[:-1])
    return [one.only(own) for one, own in zip(rows, pieces, strict=True) if own.any()]
