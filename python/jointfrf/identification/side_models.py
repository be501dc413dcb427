"""Models of flexible sides of a joint, which correct FRFs of channels as if they were measured at the joint.

The derivation is in docs/sides.md. A free side has receptances between its virtual point c and the reference point q of
the joint. They convert the receptances gamma between the virtual points to gamma' at the joint, for any joint:

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

#: Default standard deviations of a model: Young's modulus as between batches of a metal, density including the volume
#: error of a mesh.
YOUNGS_MODULUS, DENSITY = 0.03, 0.02
#: Ratio to the highest line up to which modes have independent errors; errors of higher modes scale together.
_NEAR_MODES = 4.0
#: Elastic modes are modes above this share of the highest mode of the reduced model.
_ELASTIC = 1e-9
#: Model errors are omitted if they change every FRF by less than this share of its noise.
_UNSEEN = 0.03

#: A channel: a DOF of the model, or a weighted sum of DOFs.
ModelChannel = str | Mapping[str, float]


@dataclass(frozen=True)
class SideModel:
    """Model of one free side of a joint, with the places of the channels in it.

    Parameters
    ----------
    part : Substructure
        Part with `joint` DOFs at the reference point, in the order of the joint DOFs. Its `unknowns` state the model
        error; each needs a standard deviation. For a `Model` without these unknowns, Young's modulus has 3 % and the
        density 2 %; FRFs are exact.
    responses : sequence of str, or of mappings of str to float
        Responses of the side in the order of the FRFs, as DOFs of the part, ``"12:x"``, or as weighted sums:
        ``{"12:x": -1.0}`` for a sensor of opposite direction, ``{"12:x": 0.8, "12:y": 0.6}`` for an oblique one.
    forces : sequence of str, or of mappings of str to float, optional
        Excitations of the side; the responses by default.
    modes : float
        Additional relative standard deviation of the eigenvalue of each mode, default 0.03, which is 1.5 % of its
        frequency. It replaces the `model_error` of the part.

    Raises
    ------
    ValueError
        A DOF that the part does not have, an unknown without standard deviation, no channels, a negative `modes`.

    See Also
    --------
    identify : fit that takes a pair of side models.
    Substructure : a part with unknowns.

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
                    f"part: {name} has no standard deviation, and FRFs of the assembly do not determine it; state one, "
                    "such as 0.03 of its value"
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
        """Return the blocks of FRFs between q, c of the responses, c of the forces, shape (n_freq, 3 n, 3 n)."""
        n = h.shape[1] // 3
        q, u, f = slice(n), slice(n, 2 * n), slice(2 * n, None)
        return cls(h[:, u, f], h[:, u, q], h[:, q, f], h[:, q, q])


class _Ends(NamedTuple):
    """Factors of `gamma` on both sides of the joint, and the summand on one side."""

    left: ComplexArray
    right: ComplexArray
    cc: ComplexArray
    qq: ComplexArray

    @classmethod
    def of(cls, own: _Receptances) -> _Ends:
        """Return the factors of one side; NaN on a line with singular FRFs between its channels and joint."""
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
    """A side reduced once, with its model errors."""

    def __init__(self, name: str, model: SideModel, freq_hz: FloatArray, t_u: FloatArray, t_f: FloatArray) -> None:
        part, self.modes = model.part, model.modes
        if isinstance(part.source, Model):
            priors = {"youngs_modulus": Unknown(1.0, YOUNGS_MODULUS), "density": Unknown(1.0, DENSITY)}
            part = replace(part, unknowns=priors | dict(part.unknowns))
        assert model.forces is not None
        rows = [_weighted(own) for own in (part.joint, model.responses, model.forces)]
        names = list(dict.fromkeys(dof for own in rows for row in own for dof in row))
        weights = [np.array([[row.get(dof, 0.0) for dof in names] for row in own]) for own in rows]
        #: Matrix from the DOFs used to q, c of the responses and c of the forces.
        self.ports = np.vstack([weights[0], t_u @ weights[1], t_f @ weights[2]])
        self.unknowns = part.unknowns
        self.reduced = ReducedSubstructure(name, part, freq_hz, names)
        self.highest = float(2 * np.pi * freq_hz.max())

    def nominal(self) -> _Receptances:
        """Return the nominal receptances."""
        return self._at({name: one.value for name, one in self.unknowns.items()})

    def _at(self, values: Mapping[str, float]) -> _Receptances:
        return _Receptances.of(self.ports @ self.reduced.at(values).h @ self.ports.T)

    def others(self) -> Iterator[tuple[str, _Receptances]]:
        """Yield perturbed receptances: each unknown, and each near mode, changed by one standard deviation."""
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
    """Return the channels of each side; raise a ValueError if its model has another number of channels."""
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
    """Return the variance of FRFs at the joint from independent variances between virtual points, at most infinite."""
    with np.errstate(invalid="ignore"):
        found: FloatArray = abs(left) ** 2 @ spread @ abs(right) ** 2
    return np.where(np.isfinite(found), found, np.inf)


class CorrectedFrfs(NamedTuple):
    """FRFs of channels as if both sides were rigid between channels and joint.

    Attributes
    ----------
    h : ndarray, shape (n_freq, m_r, m_f)
        Corrected FRFs Y' = Y + R_u (gamma' - gamma) R_f^T, m/N.
    smooth_gamma : ndarray, shape (n_freq, 2 n, 2 n)
        Receptances gamma' from the smooth FRFs, m/N.
    variance : ndarray, shape (n_freq, m_r, m_f)
        Noise variance of the measured FRFs, (m/N)^2; inf on lines that the models do not correct.
    noise_paths : pair of ndarray, shapes (n_freq, 2 n, m_r), (n_freq, 2 n, m_f)
        Matrices N_r, N_f from noise e of the measured FRFs to noise N_r e N_f^T of gamma'.
    errors : ndarray, shape (n_freq, e, 2 n, 2 n)
        Change of gamma' by each model error of one standard deviation, m/N.
    error_names : tuple of str, length e
        Names of the model errors: ``"j: youngs_modulus"``, ``"k: mode at 812 Hz"``.
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
    """Return FRFs of channels on flexible sides, corrected by models of both sides.

    Parameters
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    h, smooth : ndarray, shape (n_freq, m_r, m_f)
        Measured and smooth FRFs of the channels, m/N; channels of side j first.
    variance : ndarray, shape (n_freq, m_r, m_f)
        Noise variance E|e|^2 of the measured FRFs, (m/N)^2.
    transforms, modes : pairs of ndarray, shapes (2 n, m) and (m, 2 n)
        Matrices T and R of responses and of forces; T R = 1.
    sides : pair of SideModel
        Models of sides j and k.

    Raises
    ------
    ValueError
        The channels or the joint DOFs of a side do not match the FRFs; a model cannot be computed on these lines.
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
