"""What an identification found, with its uncertainty."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from jointfrf.dofs import Parameter, ParameterKind
from jointfrf.files import write_file
from jointfrf.identification.fit_cards import fit_cards
from jointfrf.identification.fit_data import FitData
from jointfrf.identification.fit_record import fields_of_record, read_record, record_of
from jointfrf.identification.parameter_table import wrapped
from jointfrf.io.cards import CardFormat, CardOptions
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["JointFit"]


@dataclass(frozen=True)
class JointFit:
    """Parameters of a joint, K*(w) = k + i h + i w c, and their uncertainty.

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
    intervals : callable, optional
        From a probability to the interval of each parameter, where the method has its own; a fit that was loaded has
        those of some probabilities.
    data : FitData, optional
        What it was made from, for figures and reports; a fit that was loaded has none.
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
    intervals: Callable[[float], dict[str, tuple[float, float]]] | None = field(default=None, repr=False, compare=False)
    data: FitData | None = field(default=None, repr=False, compare=False)

    @cached_property
    def terms(self) -> tuple[Parameter, ...]:
        """The parameters as objects, in the order of `parameters`: kind, DOFs, unit."""
        return tuple(Parameter.parse(name) for name in self.parameters)

    def _matrix(self, kind: ParameterKind) -> FloatArray:
        matrix = np.zeros((len(self.dofs), len(self.dofs)))
        for term, value in zip(self.terms, self.parameters.values(), strict=True):
            if term.kind == kind:
                a, b = self.dofs.index(term.row), self.dofs.index(term.column)
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

    def _of_each_dof(self, kind: ParameterKind) -> FloatArray:
        return np.array([self.parameters.get(Parameter.of_dof(kind, dof).name, 0.0) for dof in self.dofs])

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
        """Interval that contains the true parameter with the given probability.

        Parameters
        ----------
        probability : float
            Between 0 and 1.

        Returns
        -------
        dict of str to (low, high)
            A stiffness gets its interval from that of the compliance 1/k, in which the noise is nearly normal: it is
            not symmetric, and open above, up to inf, where the joint cannot be distinguished from a rigid one.

        Raises
        ------
        ValueError
            The probability is not between 0 and 1; or the fit was loaded and does not keep the interval of this one,
            see `to_dict`.
        """
        if not 0 < probability < 1:
            raise ValueError(f"probability must lie between 0 and 1, not {probability}")
        if self.intervals is not None:
            return self.intervals(probability)
        reach = float(ndtri((1 + probability) / 2))
        intervals = {}
        values = zip(self.terms, self.parameters.values(), self.std_error.values(), strict=True)
        for term, value, error in values:
            if term.kind == "k" and not term.is_cross and self.method == "compliance" and value != 0:
                soft, own = 1 / value, error / value**2
                low, high = soft - reach * own, soft + reach * own
                intervals[term.name] = (1 / high if high > 0 else -np.inf, 1 / low if low > 0 else np.inf)
            else:
                intervals[term.name] = (value - reach * error, value + reach * error)
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

    def export(
        self,
        program: CardFormat,
        nodes: Sequence[int],
        *,
        about: Sequence[str] = (),
        all_damping: bool = False,
        **options: Unpack[CardOptions],
    ) -> str:
        """Write the joint found as input of a finite-element program, with comments on what each number is worth.

        Parameters
        ----------
        program, nodes, **options
            As in `Joint.export`.
        about : sequence of str
            Where the fit comes from: first lines of comment.
        all_damping : bool
            Also damping that is negative or not significantly above zero (95 %), which is left out otherwise, with the
            cross terms of its DOF.

        Returns
        -------
        str
            Lines of input.

        Raises
        ------
        ValueError
            As `Joint.export`; or a stiffness is infinite.
        """
        return fit_cards(self, program, nodes, about, all_damping=all_damping, **options)

    def unit(self, parameter: str) -> str:
        """Return the unit of a parameter, by the names of its DOFs as `Parameter.unit` reads them."""
        return Parameter.parse(parameter).unit

    def plot(self) -> Any:
        """Draw the joint over frequency, K* and compliance of each DOF, and measured against regenerated FRFs.

        Returns
        -------
        matplotlib.figure.Figure
            ``fit.plot().savefig("joint.png")`` writes it. A fit that was loaded shows no FRFs.

        Raises
        ------
        MissingPackageError
            matplotlib is missing.
        """
        from jointfrf.report.fit import plot_fit

        return plot_fit(self)

    def report(self, path: Path | str, *, source: str = "", command: str = "", nodes: Sequence[int] = (1, 2)) -> Path:
        """Write a report: one HTML file with all that is needed to judge and to quote the joint, no link to another.

        Parameters
        ----------
        path : Path or str
            In a folder that exists.
        source : str
            Name of the file that was measured.
        command : str
            How the fit was made, as typed.
        nodes : sequence of two or four int
            Nodes j and k of the finite-element cards; then ROT NODEs of CalculiX.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        ValueError
            The fit does not hold the measured FRFs: it was loaded, or is a mean over bands.
        MissingPackageError
            jinja2 is missing.
        OSError
            The file cannot be written.
        """
        from jointfrf.report.fit_page import ReportOptions, write_report

        return write_report(self, Path(path), ReportOptions(source, command, nodes))

    def to_dict(self, *, probabilities: Sequence[float] | None = None, lines: bool = True) -> dict[str, Any]:
        """Everything as plain numbers and text, ready for JSON; `from_dict` gives the same fit again.

        Parameters
        ----------
        probabilities : sequence of float, optional
            Probabilities of the intervals that are kept beside 0.5, 0.6827, 0.9, 0.95 and 0.99: where intervals follow
            from the profile of the likelihood they cannot be found again without the FRFs.
        lines : bool
            Whether K*(w) of each line is kept, two numbers for each of the n n entries.

        Returns
        -------
        dict
            ``"format"``, ``"format_version"``, and under ``"parameters"`` value, unit, standard error and 95 % interval
            of each; in an interval there, None is an open end. Elsewhere None is NaN, ``"inf"`` infinity.

        Raises
        ------
        ValueError
            A probability is not between 0 and 1, or not known to a fit that was loaded.
        """
        return record_of(self, probabilities, lines=lines)

    @classmethod
    def from_dict(cls, content: dict[str, Any]) -> JointFit:
        """Make a fit of what `to_dict` wrote.

        Parameters
        ----------
        content : dict

        Returns
        -------
        JointFit
            The same numbers; intervals at the probabilities kept, and no FRFs: no report can be made of it.

        Raises
        ------
        FileContentError
            It is no fit, of a later version of jointfrf, or something is missing or damaged.

        Examples
        --------
        >>> import numpy as np, jointfrf as jf
        >>> freq = np.linspace(0.5, 10, 100)
        >>> a = jf.chain([5], [2500], [3], ground="start").receptance(freq)
        >>> b = jf.chain([4], [2000], [2], ground="end").receptance(freq)
        >>> gamma = jf.couple(a, b, jf.Joint([2000.0], [3.0]).dynamic_stiffness(freq), [0], [0])
        >>> fit = jf.identify(freq, jf.pollute(gamma, 0.02, seed=1), ["x"])
        >>> same = jf.JointFit.from_dict(fit.to_dict())
        >>> same.confidence_interval(0.95) == fit.confidence_interval(0.95), str(same) == str(fit)
        (True, True)
        """
        return cls(**fields_of_record(content))

    def save(self, path: Path | str, *, probabilities: Sequence[float] | None = None, lines: bool = True) -> Path:
        """Write the fit to a JSON file, whole or not at all.

        Parameters
        ----------
        path : Path or str
            In a folder that exists.
        probabilities, lines : optional
            As in `to_dict`.

        Returns
        -------
        Path
            The file written.

        Raises
        ------
        ValueError
            As `to_dict`.
        OSError
            The file cannot be written.
        """
        content = self.to_dict(probabilities=probabilities, lines=lines)
        write_file(Path(path), json.dumps(content, indent=1, allow_nan=False) + "\n")
        return Path(path)

    @classmethod
    def load(cls, path: Path | str) -> JointFit:
        """Read a fit that `save` wrote.

        Parameters
        ----------
        path : Path or str

        Returns
        -------
        JointFit
            As `from_dict` makes it.

        Raises
        ------
        FileContentError
            The file is no such file, of a later version of jointfrf, or damaged.
        OSError
            It cannot be read.
        """
        return cls(**read_record(Path(path)))

    def __str__(self) -> str:
        """Return a table of the parameters with their intervals, and the warnings."""
        intervals = self.confidence_interval(0.95)
        errors = self.std_error
        rows = [("parameter", "value", "std error", "95 % interval", "unit")]
        for term, value in zip(self.terms, self.parameters.values(), strict=True):
            low, high = intervals[term.name]
            is_open = term.kind == "k" and not np.isfinite(high)
            shown = "open" if is_open else f"{value:.5g}"
            rows.append((term.name, shown, f"{errors[term.name]:.2g}", f"{low:.4g} .. {high:.4g}", term.unit))
        widths = [max(len(row[i]) for row in rows) for i in range(5)]
        lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows]
        lines.insert(1, "-" * len(lines[0]))
        span = f"{self.freq_hz.min():g} to {self.freq_hz.max():g} Hz, {self.freq_hz.size} lines"
        head = [f"method {self.method}, {span}"]
        if np.isfinite(self.noise_level):
            head.append(f"noise {100 * self.noise_level:.2g} %, residual {100 * self.residual_level:.2g} % of the FRFs")
        tail = [wrapped(f"note: {text}") for text in self.notes]
        tail += [wrapped(f"warning: {text}") for text in self.warnings]
        return "\n".join([*head, "", *lines, *([""] if tail else []), *tail])
