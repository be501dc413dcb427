"""What an identification found, with its uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from jointfrf.io.cards import CardFormat, CardOptions
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["JointFit"]

_UNITS = {
    "k": ("N/m", "N m/rad"),
    "h": ("N/m", "N m/rad"),
    "c": ("N s/m", "N m s/rad"),
}


def _is_rotation(dof: str) -> bool:
    return dof.lower().startswith(("theta", "rx", "ry", "rz", "rot"))


@dataclass(frozen=True)
class JointFit:
    """Parameters of a joint, K*(w) = k + i h + i w c, and what the data say of their accuracy.

    Attributes
    ----------
    method : str
        How they were found.
    dofs : tuple of str
        Names of the joint DOFs.
    parameters : dict of str to float
        ``"k_<dof>"`` stiffness, ``"h_<dof>"`` hysteretic stiffness eta k, ``"c_<dof>"`` viscous damping, in the order
        of the covariance; ``"k_<dof>,<dof>"`` cross terms. N/m, N s/m; rotational N m/rad, N m s/rad.
    covariance : ndarray, shape (p, p)
        Covariance of the parameters.
    noise_level : float
        Relative noise level of the measured FRFs as estimated or given; NaN where the method has none.
    residual_level : float
        Noise level that the residual of the fit shows; well above `noise_level`, the model of the joint is wrong.
    freq_hz : ndarray, shape (n_freq,)
        Lines used, Hz.
    k_lines : ndarray, shape (n_freq, n, n)
        K*(w) of each line by itself, N/m; NaN where a line could not be inverted.
    bands : tuple
        For each DOF the bands used, (low, high) in Hz.
    warnings : tuple of str
        What a reader must know before using the numbers.
    notes : tuple of str
        How the numbers came about.
    """

    method: str
    dofs: tuple[str, ...]
    parameters: dict[str, float]
    covariance: FloatArray
    noise_level: float
    residual_level: float
    freq_hz: FloatArray
    k_lines: ComplexArray
    bands: tuple[tuple[tuple[float, float], ...], ...]
    warnings: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def _matrix(self, letter: str) -> FloatArray:
        matrix = np.zeros((len(self.dofs), len(self.dofs)))
        for name, value in self.parameters.items():
            if name[0] == letter:
                pair = name[2:].split(",")
                a, b = self.dofs.index(pair[0]), self.dofs.index(pair[-1])
                matrix[a, b] = matrix[b, a] = value
        return matrix

    @property
    def stiffness_matrix(self) -> FloatArray:
        """Stiffness with its cross terms, shape (n, n), N/m, N, N m/rad."""
        return self._matrix("k")

    @property
    def damping_matrix(self) -> FloatArray:
        """Viscous damping with its cross terms, shape (n, n), N s/m, N s, N m s/rad."""
        return self._matrix("c")

    @property
    def joint(self) -> Joint:
        """The joint found, to be coupled, moved or reordered; DOFs in the order of `dofs`."""
        return Joint(self.stiffness_matrix, self.damping_matrix, self.dofs, structural_damping=self._matrix("h"))

    def _of_each_dof(self, letter: str) -> FloatArray:
        return np.array([self.parameters.get(f"{letter}_{dof}", 0.0) for dof in self.dofs])

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness k of each DOF, shape (n,), N/m or N m/rad."""
        return self._of_each_dof("k")

    @property
    def damping(self) -> FloatArray:
        """Viscous damping c of each DOF, shape (n,), N s/m or N m s/rad."""
        return self._of_each_dof("c")

    @property
    def loss_factor(self) -> FloatArray:
        """Hysteretic loss factor eta = h/k of each DOF, shape (n,)."""
        return self._of_each_dof("h") / self.stiffness

    @property
    def std_error(self) -> dict[str, float]:
        """Standard error of each parameter, in its unit."""
        errors = np.sqrt(np.maximum(np.diagonal(self.covariance), 0))
        return dict(zip(self.parameters, errors.tolist(), strict=True))

    def confidence_interval(self, probability: float = 0.95) -> dict[str, tuple[float, float]]:
        """Interval that holds the true parameter with the given probability.

        Parameters
        ----------
        probability : float
            Between 0 and 1.

        Returns
        -------
        dict of str to (low, high)
            A stiffness gets its interval from that of the compliance 1/k, in which the noise is nearly normal: it is
            not symmetric, and open above, up to inf, where the data cannot tell the joint from a rigid one.

        Raises
        ------
        ValueError
            The probability is not between 0 and 1.
        """
        if not 0 < probability < 1:
            raise ValueError(f"probability must lie between 0 and 1, not {probability}")
        reach = float(stats.norm.ppf((1 + probability) / 2))
        intervals = {}
        for (name, value), error in zip(self.parameters.items(), self.std_error.values(), strict=True):
            if name.startswith("k_") and "," not in name and self.method == "compliance" and value != 0:
                soft, own = 1 / value, error / value**2
                low, high = soft - reach * own, soft + reach * own
                intervals[name] = (1 / high if high > 0 else -np.inf, 1 / low if low > 0 else np.inf)
            else:
                intervals[name] = (value - reach * error, value + reach * error)
        return intervals

    def k_joint(self, freq_hz: ArrayLike) -> ComplexArray:
        """Complex joint stiffness from the parameters.

        Parameters
        ----------
        freq_hz : array_like, shape (n_freq,)
            Hz.

        Returns
        -------
        ndarray, shape (n_freq, n, n)
            N/m, rotational N m/rad.
        """
        return self.joint.dynamic_stiffness(freq_hz)

    def export(self, program: CardFormat, nodes: Sequence[int], **options: Unpack[CardOptions]) -> str:
        """Write the joint found as input of a finite-element program; all as in `Joint.export`."""
        return self.joint.export(program, nodes, **options)

    def unit(self, parameter: str) -> str:
        """Return the unit of a parameter, told from the name of its DOF (theta..., rx, ry, rz are rotations)."""
        pair = parameter[2:].split(",")
        rotations = [_is_rotation(dof) for dof in pair]
        if rotations[0] != rotations[-1]:
            return "N" if parameter[0] != "c" else "N s"
        return _UNITS[parameter[0]][rotations[0]]

    def to_dict(self) -> dict[str, Any]:
        """Everything but the lines, as plain numbers and text, ready for JSON (an open interval ends at None)."""
        intervals = self.confidence_interval(0.95)
        errors = self.std_error

        def plain(number: float) -> float | None:
            return float(number) if np.isfinite(number) else None

        return {
            "method": self.method,
            "dofs": list(self.dofs),
            "parameters": {
                name: {
                    "value": float(value),
                    "unit": self.unit(name),
                    "std_error": plain(errors[name]),
                    "confidence_interval_95": [plain(limit) for limit in intervals[name]],
                }
                for name, value in self.parameters.items()
            },
            "loss_factor": {dof: plain(eta) for dof, eta in zip(self.dofs, self.loss_factor, strict=True)},
            "noise_level": plain(self.noise_level),
            "residual_level": plain(self.residual_level),
            "frequency_hz": [float(self.freq_hz.min()), float(self.freq_hz.max())],
            "n_lines": int(self.freq_hz.size),
            "bands_hz": {d: [list(b) for b in own] for d, own in zip(self.dofs, self.bands, strict=True)},
            "warnings": list(self.warnings),
            "notes": list(self.notes),
        }

    def __str__(self) -> str:
        """Return a table of the parameters with their intervals, and the warnings."""
        intervals = self.confidence_interval(0.95)
        errors = self.std_error
        rows = [("parameter", "value", "std error", "95 % interval", "unit")]
        for name, value in self.parameters.items():
            low, high = intervals[name]
            between = f"{low:.4g} .. {high:.4g}"
            is_open = name.startswith("k_") and not np.isfinite(high)
            rows.append((name, "open" if is_open else f"{value:.5g}", f"{errors[name]:.2g}", between, self.unit(name)))
        widths = [max(len(row[i]) for row in rows) for i in range(5)]
        lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows]
        lines.insert(1, "-" * len(lines[0]))
        span = f"{self.freq_hz.min():g} to {self.freq_hz.max():g} Hz, {self.freq_hz.size} lines"
        head = [f"method {self.method}, {span}"]
        if np.isfinite(self.noise_level):
            head.append(f"noise {100 * self.noise_level:.2g} %, residual {100 * self.residual_level:.2g} % of the FRFs")
        tail = [f"note: {text}" for text in self.notes] + [f"warning: {text}" for text in self.warnings]
        return "\n".join([*head, "", *lines, *([""] if tail else []), *tail])
