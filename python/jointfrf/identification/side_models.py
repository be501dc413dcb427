"""Sides of a joint that bend, by their models: FRFs of channels corrected as if they were measured at the joint.

The derivation is in docs/sides.md. With receptances of a free side between its virtual point c and the reference point
q of the joint, those between the virtual points, gamma, become those at the joint, gamma', whatever the joint is:

    gamma'_jj = A_qq + L_A (gamma_jj - A_cc) R_A,   gamma'_jk = L_A gamma_jk R_B,   L = H_qq H_cq^-1,  R = H_qc^-1 H_qq.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.identification.model.reduced import ReducedSubstructure
from jointfrf.identification.model.substructure import Substructure, Unknown
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_not_negative, as_number, one_line
from jointfrf.kernel.linear_algebra import invert
from jointfrf.models.model import Model

__all__ = ["CorrectedFrfs", "SideModel", "corrected_frfs"]

#: Standard deviations of what is not known of a model where nothing is said: Young's modulus as between batches of a
#: metal, density with what a mesh makes of the volume.
YOUNGS_MODULUS, DENSITY = 0.03, 0.02
#: Modes up to this many times the highest line are wrong one by one; the others are, together, as by Young's modulus.
_NEAR_MODES = 4.0
#: Elastic modes are those above this share of the highest one that the reduced model has.
_ELASTIC = 1e-9
#: An error of the models that nowhere moves an FRF by this share of its noise is left out.
_UNSEEN = 0.03

#: A channel: a DOF of the model, or the sum of some with weights.
ModelChannel = str | Mapping[str, float]


@dataclass(frozen=True)
class SideModel:
    """Model of one side of a joint, free of the other one, and where the channels are in it.

    Parameters
    ----------
    part : Substructure
        Its `joint` are the DOFs of the reference point, in the order of the joint DOFs; its `unknowns` say how far it
        is known: each needs a standard deviation. Of a `Model` Young's modulus counts as known to 3 % and the density
        to 2 % unless they are among these; FRFs are taken as exact.
    responses : sequence of str, or of mappings of str to float
        The responses of the side in the order of the FRFs, as DOFs of the part: ``"12:x"``; or their weighted sum, as
        ``{"12:x": -1.0}`` of a sensor that points the other way, ``{"12:x": 0.8, "12:y": 0.6}`` of an oblique one.
    forces : the same, optional
        Its excitations; the responses by default.
    modes : float
        Relative standard deviation of the eigenvalue of each mode beside that, 0.03: 1.5 % of its frequency; in place
        of the `model_error` of the part.

    Raises
    ------
    ValueError
        A DOF that the part does not have, an unknown without standard deviation, no channels, a negative `modes`.

    Examples
    --------
    >>> import jointfrf as jf
    >>> bar = jf.beam(0.4, 16, youngs_modulus=210e9, density=7850.0, width=0.04, height=0.015, loss_factor=0.004)
    >>> side = jf.SideModel(jf.Substructure(bar, ["17:y", "17:theta"]), ["16:y", {"14:y": -1.0}])
    >>> side.forces == side.responses, len(side.responses)
    (True, 2)
    """

    part: Substructure
    responses: tuple[ModelChannel, ...]
    forces: tuple[ModelChannel, ...] | None = None
    modes: float = 0.03

    def __post_init__(self) -> None:
        if not isinstance(self.part, Substructure):
            raise TypeError(f"part must be a Substructure, not {type(self.part).__name__}")
        for name, given in (("responses", self.responses), ("forces", self.forces)):
            if given is not None:
                object.__setattr__(self, name, self._checked(name, given))
        if self.forces is None:
            object.__setattr__(self, "forces", self.responses)
        as_not_negative("modes", self.modes)
        for name, unknown in self.part.unknowns.items():
            if unknown.std is None:
                raise ValueError(
                    f"part: {name} has no standard deviation, and FRFs of the assembly do not determine it: say how "
                    "far it is known, such as 0.03 of its value"
                )
        for dof in self.part.joint:
            if not self.part.has(dof):
                raise ValueError(f"part has no DOF {dof!r}, which is to be one of the joint")

    def _checked(self, name: str, channels: Sequence[ModelChannel]) -> tuple[ModelChannel, ...]:
        if isinstance(channels, str) or not isinstance(channels, Sequence) or not channels:
            raise ValueError(f"{name} must name the channels of the side, one DOF of the model each")
        for i, channel in enumerate(channels):
            own = _weights(channel)
            for dof, weight in own.items():
                if not isinstance(dof, str) or not self.part.has(dof):
                    raise ValueError(f"{name}: channel {i + 1}: the part has no DOF {one_line(dof)}")
                as_number(f"{name}: weight of {dof}", weight)
            if not any(own.values()):
                raise ValueError(f"{name}: channel {i + 1} has no DOF with a weight")
        return tuple(channels)


def _weighted(channels: Sequence[ModelChannel]) -> list[Mapping[str, float]]:
    return [_weights(channel) for channel in channels]


def _weights(channel: ModelChannel) -> Mapping[str, float]:
    if isinstance(channel, str):
        return {channel: 1.0}
    if not isinstance(channel, Mapping):
        raise TypeError(f"a channel must be a DOF or a mapping of DOFs to weights, not {type(channel).__name__}")
    return channel


class _Receptances(NamedTuple):
    """Receptances of a free side between its virtual points c and the joint q, shape (n_freq, n, n) each."""

    cc: ComplexArray
    cq: ComplexArray
    qc: ComplexArray
    qq: ComplexArray

    @classmethod
    def of(cls, h: ComplexArray) -> _Receptances:
        """Take them from those between q, c of the responses, c of the forces, shape (n_freq, 3 n, 3 n)."""
        n = h.shape[1] // 3
        q, u, f = slice(n), slice(n, 2 * n), slice(2 * n, None)
        return cls(h[:, u, f], h[:, u, q], h[:, q, f], h[:, q, q])


class _Ends(NamedTuple):
    """Factors of `gamma` on both sides of the joint, and what is added on one."""

    left: ComplexArray
    right: ComplexArray
    cc: ComplexArray
    qq: ComplexArray

    @classmethod
    def of(cls, own: _Receptances) -> _Ends:
        """Return those of one side; NaN on a line where its FRFs between channels and joint are singular."""
        left, right = (invert(np.ascontiguousarray(one), on_singular="nan") for one in (own.cq, own.qc))
        return cls(own.qq @ left, right @ own.qq, own.cc, own.qq)


def _at_joint(gamma: ComplexArray, a: _Ends, b: _Ends) -> ComplexArray:
    """Return FRFs at the joint from those between virtual points."""
    n = gamma.shape[1] // 2
    found = np.empty_like(gamma)
    found[:, :n, :n] = a.qq + a.left @ (gamma[:, :n, :n] - a.cc) @ a.right
    found[:, :n, n:] = a.left @ gamma[:, :n, n:] @ b.right
    found[:, n:, :n] = b.left @ gamma[:, n:, :n] @ a.right
    found[:, n:, n:] = b.qq + b.left @ (gamma[:, n:, n:] - b.cc) @ b.right
    return found


class _ReducedSide:
    """A side reduced once, with what is not known of it."""

    def __init__(self, name: str, model: SideModel, freq_hz: FloatArray, t_u: FloatArray, t_f: FloatArray) -> None:
        part, self.modes = model.part, model.modes
        if isinstance(part.source, Model):
            priors = {"youngs_modulus": Unknown(1.0, YOUNGS_MODULUS), "density": Unknown(1.0, DENSITY)}
            part = replace(part, unknowns=priors | dict(part.unknowns))
        assert model.forces is not None
        rows = [_weighted(own) for own in (part.joint, model.responses, model.forces)]
        names = list(dict.fromkeys(dof for own in rows for row in own for dof in row))
        weights = [np.array([[row.get(dof, 0.0) for dof in names] for row in own]) for own in rows]
        #: From the DOFs used to q, c of the responses and c of the forces.
        self.ports = np.vstack([weights[0], t_u @ weights[1], t_f @ weights[2]])
        self.unknowns = part.unknowns
        self.reduced = ReducedSubstructure(name, part, freq_hz, names)
        self.highest = float(2 * np.pi * freq_hz.max())

    def nominal(self) -> _Receptances:
        """Return the receptances as believed."""
        return self._at({name: one.value for name, one in self.unknowns.items()})

    def _at(self, values: Mapping[str, float]) -> _Receptances:
        return _Receptances.of(self.ports @ self.reduced.at(values).h @ self.ports.T)

    def others(self) -> Iterator[tuple[str, _Receptances]]:
        """Yield what the receptances may be as well: with each unknown, and each near mode, off by one deviation."""
        believed = {name: one.value for name, one in self.unknowns.items()}
        for name, unknown in self.unknowns.items():
            assert unknown.std is not None
            yield name, self._at(believed | {name: min(unknown.value + unknown.std, unknown.upper)})
        state = self.reduced.at(believed)
        if self.modes == 0 or state.matrices is None:
            return
        h, x = self.ports @ state.h @ self.ports.T, self.ports @ state.x
        squared = state.squared
        near = (squared > _ELASTIC * squared.max()) & (squared < (_NEAR_MODES * self.highest) ** 2)
        for k in np.flatnonzero(near):
            # K + d M phi phi^T M: a change of rank one.
            change = self.modes * squared[k] * (1 + 1j * state.matrices.eta)
            own = squared[k] * (1 + 1j * state.matrices.eta) - (2 * np.pi * self.reduced.freq_hz) ** 2
            factor = change / (1 + change / own)
            outer = x[:, :, k, None] * x[:, None, :, k]
            yield (
                f"mode at {np.sqrt(squared[k]) / (2 * np.pi):.4g} Hz",
                _Receptances.of(h - factor[:, None, None] * outer),
            )


def _of_sides(transform: FloatArray, what: str, sides: tuple[SideModel, SideModel], n: int) -> list[NDArray[np.intp]]:
    """Return the channels of each side; raises a ValueError where its model has others."""
    found = []
    for side, model in enumerate(sides):
        own = np.flatnonzero(transform[side * n : (side + 1) * n].any(axis=0))
        count = len(getattr(model, what))
        if count != own.size:
            raise ValueError(
                f"side {'jk'[side]} has {count} {what} in its model, {own.size} in the FRFs; name all of them"
            )
        found.append(own)
    return found


def _is_finite(gamma: ComplexArray) -> NDArray[np.bool_]:
    """Return which lines are finite, shape (n_freq,)."""
    return np.asarray(np.isfinite(gamma).all(axis=(1, 2)))


def _both(a: ComplexArray, b: ComplexArray) -> ComplexArray:
    """Return factors of both sides as one, shape (n_freq, 2 n, 2 n)."""
    n = a.shape[1]
    found = np.zeros((len(a), 2 * n, 2 * n), np.complex128)
    found[:, :n, :n], found[:, n:, n:] = a, b
    return found


def _spread_at_joint(spread: FloatArray, left: ComplexArray, right: ComplexArray) -> FloatArray:
    """Return the variance of FRFs at the joint if that between virtual points were independent, at most infinite."""
    with np.errstate(invalid="ignore"):
        found: FloatArray = abs(left) ** 2 @ spread @ abs(right) ** 2
    return np.where(np.isfinite(found), found, np.inf)


class CorrectedFrfs(NamedTuple):
    """FRFs of channels as if both sides were rigid between channels and joint.

    Attributes
    ----------
    h : ndarray, shape (n_freq, m_r, m_f)
        Y' = Y + R_u (gamma' - gamma) R_f^T, m/N.
    smooth_gamma : ndarray, shape (n_freq, 2 n, 2 n)
        gamma' of the smooth FRFs.
    variance : ndarray, shape (n_freq, m_r, m_f)
        Of the noise of the measured FRFs; inf on lines that the models do not correct.
    noise_paths : pair of ndarray, shapes (n_freq, 2 n, m_r), (n_freq, 2 n, m_f)
        From noise e of the measured FRFs to that of gamma', N_r e N_f^T.
    errors : ndarray, shape (n_freq, e, 2 n, 2 n)
        By how much gamma' changes when something of the models is off by one standard deviation.
    error_names : tuple of str, length e
        What: ``"j: youngs_modulus"``, ``"k: mode at 812 Hz"``.
    """

    h: ComplexArray
    smooth_gamma: ComplexArray
    variance: FloatArray
    noise_paths: tuple[ComplexArray, ComplexArray]
    errors: ComplexArray
    error_names: tuple[str, ...]


def corrected_frfs(
    freq_hz: FloatArray,
    h: ComplexArray,
    smooth: ComplexArray,
    variance: FloatArray,
    transforms: tuple[FloatArray, FloatArray],
    modes: tuple[FloatArray, FloatArray],
    sides: tuple[SideModel, SideModel],
) -> CorrectedFrfs:
    """Correct FRFs of channels on sides that bend, by models of both.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    h, smooth : ndarray, shape (n_freq, m_r, m_f)
        Measured and smooth FRFs of the channels, those of side j first, m/N.
    variance : ndarray, shape (n_freq, m_r, m_f)
        E|e|^2 of the measured ones.
    transforms, modes : pairs of ndarray, shapes (2 n, m) and (m, 2 n)
        T and R, of responses and of forces; T R = 1.
    sides : pair of SideModel
        j, k.

    Raises
    ------
    ValueError
        The channels or the joint DOFs of a side are not as many as the FRFs have; a model that cannot be computed on
        these lines.
    """
    t_u, t_f = transforms
    n = len(t_u) // 2
    rows, columns = (_of_sides(t, what, sides, n) for t, what in ((t_u, "responses"), (t_f, "forces")))
    own = []
    for side, model in enumerate(sides):
        if len(model.part.joint) != n:
            raise ValueError(f"side {'jk'[side]} has {len(model.part.joint)} joint DOFs in its model, not {n}")
        here = slice(side * n, (side + 1) * n)
        own.append(_ReducedSide("jk"[side], model, freq_hz, t_u[here, rows[side]], t_f[here, columns[side]]))
    a, b = (_Ends.of(one.nominal()) for one in own)
    gamma, smooth_gamma = t_u @ h @ t_f.T, t_u @ smooth @ t_f.T
    at_joint, smooth_at_joint = _at_joint(gamma, a, b), _at_joint(smooth_gamma, a, b)
    left, right = _both(a.left, b.left), _both(a.right, b.right)
    noise = np.sqrt(_spread_at_joint(t_u**2 @ np.where(np.isfinite(variance), variance, 0) @ (t_f**2).T, left, right))
    bad = ~(_is_finite(at_joint) & _is_finite(smooth_at_joint))
    if bad.all():
        raise ValueError("the models give no FRFs between channels and joint on any line; check their DOFs")
    at_joint[bad], smooth_at_joint[bad] = gamma[bad], smooth_gamma[bad]
    variance = np.where(bad[:, None, None], np.inf, variance)
    left[bad] = right[bad] = np.eye(2 * n)
    found, names = [], []
    for side, one in enumerate(own):
        for name, other in one.others():
            ends = (_Ends.of(other), b) if side == 0 else (a, _Ends.of(other))
            change = np.where(bad[:, None, None], 0, _at_joint(smooth_gamma, *ends) - smooth_at_joint)
            change[~_is_finite(change)] = 0
            if (abs(change) > _UNSEEN * noise).any():
                found.append(change)
                names.append(f"{'jk'[side]}: {name}")
    errors = np.stack(found, axis=1) if found else np.zeros((len(h), 0, 2 * n, 2 * n), complex)
    corrected = h + modes[0] @ (at_joint - gamma) @ modes[1].T
    paths = left @ t_u, right.swapaxes(1, 2) @ t_f
    return CorrectedFrfs(corrected, smooth_at_joint, variance, paths, errors, tuple(names))
