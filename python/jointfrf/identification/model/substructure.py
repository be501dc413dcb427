"""A substructure of a fit: a model, a function that builds one, or FRFs; with its unknowns."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from jointfrf.frf.noise_model import estimate_noise
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_frequency,
    as_limits,
    as_names,
    as_not_negative,
    as_number,
    as_real,
    as_square,
    check_finite_lines,
    one_line,
)
from jointfrf.models.model import Model
from jointfrf.models.points import PointModel, Region

__all__ = ["FrfSource", "Substructure", "Unknown"]


@dataclass(frozen=True)
class Unknown:
    """A number of a model that is not known exactly and is fitted with the joint.

    Parameters
    ----------
    value : float
        Nominal value and initial value, in the unit of the number.
    std : float, optional
        Standard deviation of a normal prior about the value; by default only the FRFs determine it.
    lower, upper : float
        Bounds; none by default.

    Raises
    ------
    ValueError
        A standard deviation that is not positive, a value outside its limits, NaN or Inf.

    Examples
    --------
    Young's modulus of aluminium, known to 2 %:

    >>> import jointfrf as jf
    >>> jf.Unknown(67e9, 0.02 * 67e9).std
    1340000000.0
    """

    value: float
    std: float | None = None
    lower: float = -np.inf
    upper: float = np.inf

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", as_number("value", self.value))
        if self.std is not None:
            object.__setattr__(self, "std", as_number("std", self.std))
            if self.std <= 0:
                raise ValueError(f"std must be positive, not {self.std:g}")
        as_limits("bounds", self.lower, self.upper)
        if not self.lower <= self.value <= self.upper:
            raise ValueError(f"value must lie in {self.lower:g} to {self.upper:g}, not {self.value:g}")


#: Relative prior standard deviations of every model: Young's modulus, density.
_NEVER_EXACT = {"youngs_modulus": 0.03, "density": 0.01}
#: Relative standard deviation of each modal stiffness and mass of a model, in addition to its unknowns.
_MODEL_ERROR = 0.005
#: Error above which a model does not describe its part.
_LARGEST_ERROR = 0.1
#: Relative noise below this is rounding.
_LEAST_LEVEL = 1e-7
#: Factors of the matrices of a model, and its loss factor.
SCALES = ("youngs_modulus", "density", "loss_factor")


@dataclass(frozen=True)
class FrfSource:
    """FRFs of a substructure between named DOFs.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Frequencies, Hz.
    h : ndarray, shape (n_freq, m, m)
        Receptances, m/N.
    dofs : tuple of str, length m
        Names of the DOFs.
    noise : float or ndarray, shape (n_freq, m, m), optional
        Relative level, or E|e|^2 of each FRF, (m/N)^2; 0 if they are exact. By default it is estimated from the FRFs.
    """

    freq_hz: FloatArray
    h: ComplexArray
    dofs: tuple[str, ...]
    noise: float | FloatArray | None = None

    @cached_property
    def variance(self) -> FloatArray | None:
        """E|e|^2 times the number of lines with the noise of one independent line; None if the FRFs are exact."""
        if isinstance(self.noise, np.ndarray):
            return self.noise if self.noise.any() else None
        if self.noise is not None:
            return np.asarray(self.noise**2 * abs(self.h) ** 2, np.float64) if self.noise else None
        found = estimate_noise(self.freq_hz, self.h)
        # The residual of a rational function that does not fit is no noise.
        is_seen = found.source == "reciprocity" or (found.source == "residual" and found.smooth.is_smooth)
        if not is_seen or found.level < _LEAST_LEVEL:
            return None
        return np.asarray(found.inflation * found.variance)

    @cached_property
    def is_symmetrised(self) -> bool:
        """Whether h_pq and h_qp are one measurement, with one noise."""
        return bool(np.allclose(self.h, self.h.swapaxes(1, 2), rtol=1e-9, atol=0))


@dataclass(frozen=True)
class Substructure:
    """A substructure: a model with its unknowns, or FRFs.

    Parameters
    ----------
    source : Model, or callable, or FrfSource
        A model; a function that builds one from the values of `unknowns` by name, ``build(length=0.3)``; or FRFs, see
        `of_frfs`.
    joint : sequence of str
        Names of its joint DOFs, in the order of the joint; only for two parts and one joint.
    unknowns : mapping of str to Unknown
        Unknowns by name, none by default. For a `Model`: ``"youngs_modulus"`` scales K and H, ``"density"`` scales M,
        ``"loss_factor"`` is its eta. For a function: its arguments.
    exact : bool
        Whether a model has no further unknowns, except its `model_error` if one is given; default False. Young's
        modulus and density that are not among the unknowns are then fitted as factors of K and M. Their priors are 3 %
        and 1 %, the coefficients of variation of structural steel [1]_.
    model_error : float, optional
        Prior relative standard deviation of each modal stiffness and mass of the free substructure, in addition to its
        unknowns: mesh, clamps, small masses. Default 0.005, and 0 if it is exact.

    References
    ----------
    .. [1] JCSS Probabilistic Model Code, part 2.1 (density) and part 3.2 (Young's modulus), Joint Committee on
       Structural Safety, 2001.

    Raises
    ------
    ValueError
        An unknown that the source does not have; unknowns or errors of FRFs; an error that is negative or above 0.1.

    See Also
    --------
    Assembly : assembly of substructures and joints.
    Unknown : value and prior of an unknown.

    Examples
    --------
    >>> import jointfrf as jf
    >>> def arm(length, youngs_modulus):
    ...     return jf.beam(length, 12, youngs_modulus=youngs_modulus, density=2700.0, width=0.025, height=0.006,
    ...                    ends=("clamped", "free"), loss_factor=0.01)
    >>> a = jf.Substructure(arm, ["13:y", "13:theta"],
    ...                     {"length": jf.Unknown(0.3, 0.006), "youngs_modulus": jf.Unknown(67e9, 1.3e9)})
    >>> a.model().index("13:y")
    22
    """

    source: Model | Callable[..., Model] | FrfSource
    joint: tuple[str, ...] = ()
    unknowns: Mapping[str, Unknown] = field(default_factory=dict)
    exact: bool = False
    model_error: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "joint", as_names("joint", self.joint))
        if not isinstance(self.unknowns, Mapping):
            raise TypeError(f"unknowns must be a mapping of names to Unknown, not {type(self.unknowns).__name__}")
        for name, unknown in self.unknowns.items():
            if not isinstance(unknown, Unknown):
                raise TypeError(f"unknowns: {name} must be an Unknown, not {type(unknown).__name__}")
            if isinstance(self.source, FrfSource):
                raise ValueError(f"FRFs have no unknowns such as {name!r}; give the substructure as a model")
            if isinstance(self.source, Model) and name not in SCALES:
                raise ValueError(
                    f"unknown name {name!r}; use one of {', '.join(SCALES)}, or a function that builds the model"
                )
        if isinstance(self.source, Model):
            for name in ("youngs_modulus", "density"):
                if name in self.unknowns and self.unknowns[name].value <= 0:
                    raise ValueError(f"{name} must be positive, not {self.unknowns[name].value:g}")
        if not isinstance(self.source, Model | FrfSource) and not callable(self.source):
            raise TypeError(f"source must be a Model, a function or FRFs, not {type(self.source).__name__}")
        if self.model_error is not None:
            object.__setattr__(self, "model_error", as_number("model_error", self.model_error))
            if not 0 <= self.model_error <= _LARGEST_ERROR:
                raise ValueError(f"model_error must be 0 to {_LARGEST_ERROR:g}, not {self.model_error:g}")
            if self.model_error and isinstance(self.source, FrfSource):
                raise ValueError("FRFs have no model_error; give the noise of the FRFs (noise)")

    @classmethod
    def of_frfs(
        cls,
        freq_hz: ArrayLike,
        h: ArrayLike,
        dofs: Sequence[str],
        joint: Sequence[str],
        *,
        noise: float | ArrayLike | None = None,
    ) -> Substructure:
        """Return a substructure given by FRFs.

        Parameters
        ----------
        freq_hz : array_like, shape (n_freq,)
            Lines of the measurement of the assembly, Hz.
        h : array_like, shape (n_freq, m, m)
            Receptances between its joint DOFs and the measured points, m/N.
        dofs : sequence of str, length m
            Names of the DOFs.
        joint : sequence of str
            Names of the joint DOFs among them.
        noise : float or array_like, shape of h, optional
            Relative noise of these FRFs, or E|e|^2 of each, (m/N)^2; 0 if they are exact. By default `estimate_noise`
            estimates it; computed FRFs have none. Weights and intervals of `identify_model` include it.

        Raises
        ------
        ValueError
            Wrong shapes or names, NaN or Inf, noise that is negative.
        """
        lines = as_square("h", h)
        freq = as_frequency(freq_hz, len(lines))
        check_finite_lines("h", lines, freq)
        names = as_names("dofs", dofs)
        if len(names) != lines.shape[1] or len(set(names)) != len(names):
            raise ValueError(f"dofs must name {lines.shape[1]} different DOFs, not {one_line(names)}")
        level: float | FloatArray | None = None
        if noise is not None:
            level = as_not_negative("noise", noise) if np.ndim(noise) == 0 else as_real("noise", noise, lines.shape)
            if np.min(level) < 0:
                raise ValueError("noise must be variances E|e|^2 of each FRF, none below 0")
        return cls(FrfSource(freq, lines, names, level), as_names("joint", joint))

    @cached_property
    def fitted(self) -> dict[str, Unknown]:
        """The unknowns, including the unknowns of every model that is not exact."""
        if self.exact or isinstance(self.source, FrfSource):
            return dict(self.unknowns)
        errors = {name: Unknown(1.0, std, 0.0) for name, std in _NEVER_EXACT.items() if name not in self.unknowns}
        return {**self.unknowns, **errors}

    @property
    def is_uncertain(self) -> bool:
        """Whether it is a model that is not exact: FRFs of an assembly then hardly show a gain that all share."""
        return not isinstance(self.source, FrfSource) and (not self.exact or self.error_level > 0)

    @property
    def error_level(self) -> float:
        """Relative standard deviation of its modal stiffnesses and masses in addition to its unknowns."""
        if self.model_error is None:
            return 0.0 if self.exact or isinstance(self.source, FrfSource) else _MODEL_ERROR
        return self.model_error

    @cached_property
    def scaled(self) -> dict[str, Unknown]:
        """Unknowns that are factors of the matrices, or their loss factor."""
        is_model = isinstance(self.source, Model)
        return {name: one for name, one in self.fitted.items() if is_model or name not in self.unknowns}

    @property
    def nominal(self) -> dict[str, float]:
        """Nominal values of all unknowns."""
        return {name: unknown.value for name, unknown in self.fitted.items()}

    @cached_property
    def nominal_model(self) -> Model:
        """Model for the nominal values."""
        return self.model()

    def model(self, values: Mapping[str, float] | None = None) -> Model:
        """Return the model for values of its unknowns, by default the nominal ones.

        Raises
        ------
        TypeError
            The substructure is given by FRFs, or the function returns no model.
        """
        if not isinstance(values, Mapping | None):
            raise TypeError(f"values must be a mapping of names to numbers, not {type(values).__name__}")
        named = self.nominal | dict(values or {})
        if isinstance(self.source, FrfSource):
            raise TypeError("a substructure given by FRFs has no model")
        model = self.source
        if not isinstance(model, Model):
            built = model(**{name: value for name, value in named.items() if name not in self.scaled})
            if not isinstance(built, Model):
                raise TypeError(f"the function of a substructure must return a Model, not {type(built).__name__}")
            model = built
        changed: dict[str, Any] = {}
        for name, unknown in self.scaled.items():
            factor = 1.0 if name == "loss_factor" else named[name] / unknown.value
            if name == "loss_factor":
                changed["loss_factor"] = named[name]
            elif factor != 1 and name == "density":
                changed["mass"] = model.mass * factor
            elif factor != 1:
                changed["stiffness"] = model.stiffness * factor
                if model.structural_damping is not None:
                    changed["structural_damping"] = model.structural_damping * factor
        return replace(model, **changed) if changed else model

    def has(self, dof: str) -> bool:
        """Whether there is a DOF of this name."""
        if isinstance(self.source, FrfSource):
            return dof in self.source.dofs
        try:
            self.nominal_model.ports(dof)
        except ValueError:
            return False
        return True

    def region(self, dof: str) -> Region | None:
        """Return the region whose motion ``"edge:z"`` is; None for other DOFs."""
        return self.nominal_model.regions[dof.rpartition(":")[0]] if self.region_ports(dof) else None  # type: ignore[attr-defined]

    def region_ports(self, dof: str) -> tuple[str, ...]:
        """Return the coefficients of the motion of a region; none for other DOFs."""
        if isinstance(self.source, FrfSource) or not isinstance(self.nominal_model, PointModel):
            return ()
        return self.nominal_model.region_ports(dof)

    def receptance(self, freq_hz: FloatArray, dofs: Sequence[str]) -> ComplexArray:
        """Return the nominal receptances between DOFs, shape (n_freq, m, m), m/N."""
        if isinstance(self.source, FrfSource):
            at = [self.source.dofs.index(dof) for dof in dofs]
            return self.source.h[:, at][:, :, at]
        model = self.nominal_model
        return model.receptance(freq_hz, model.ports(*dofs))


def check_same_lines(name: str, source: FrfSource, freq_hz: FloatArray) -> None:
    """Raise an error if FRFs of a substructure are not on the lines of the measurement."""
    if source.freq_hz.shape != freq_hz.shape or not np.allclose(source.freq_hz, freq_hz, rtol=1e-9, atol=0):
        raise ValueError(
            f"the FRFs of {name} must be on the lines of the measurement, {freq_hz.size} from {freq_hz[0]:g} to "
            f"{freq_hz[-1]:g} Hz, not {source.freq_hz.size} from {source.freq_hz[0]:g} to {source.freq_hz[-1]:g} Hz"
        )
