"""Result of an identification with its uncertainty: one class for every method."""

from __future__ import annotations

import textwrap
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtri

from jointfrf.dofs import Parameter, ParameterKind, parameter_name, point_and_direction
from jointfrf.frf.bands import Band
from jointfrf.identification.derived import Derived, DerivedFunction, derived_quantity
from jointfrf.identification.fit_data import FitData, ModelData
from jointfrf.identification.profile import Intervals
from jointfrf.identification.residual_test import ResidualTest
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_probability, one_line
from jointfrf.laws.law_joint import LawJoint
from jointfrf.messages.finding import Finding, WithFindings, as_warning, worst_first
from jointfrf.messages.of_data import DATA_MESSAGES

__all__ = [
    "UNDETERMINED",
    "Fit",
    "FittedParameter",
    "IntervalsByProbability",
    "SeenStiffness",
    "columns_of",
    "is_undetermined",
    "joint_of",
    "law_parameters",
]

#: Function from a probability to the interval of each parameter.
IntervalsByProbability = Callable[[float], dict[str, tuple[float, float]]]
#: Text in tables for a parameter whose interval has no bound.
UNDETERMINED = "undetermined"
#: Columns of a printed fit, as in a terminal.
_WIDTH = 80


@dataclass(frozen=True)
class FittedParameter:
    """A fitted number.

    Attributes
    ----------
    name : str
        Name by owner and kind:

        - ``"k_<dof>"`` stiffness, ``"h_<dof>"`` hysteretic stiffness eta k, ``"c_<dof>"`` viscous damping
        - ``"k_<dof>,<dof>"`` a cross term
        - ``"tau_<dof>"`` and further parameters of laws
        - ``"bolt1.k_<dof>"`` at one of several points
        - ``"A/youngs_modulus"``, ``"mass A/151:y"``, ``"gain of response B/226:y"`` of models and channels
    unit : str
        Unit of the value.
    kind, row, column : str
        Kind of a joint parameter: ``"k"``, ``"tau"``, ..., and its DOFs, equal except for a cross term. Empty for
        further parameters.
    origin : str
        Owner: "joint", "mean" of several joints, name of a part ("A"), "attachment", "response", "force".
    prior : (float, float) or None
        Mean and standard deviation of the prior.
    """

    name: str
    unit: str
    kind: str = ""
    row: str = ""
    column: str = ""
    origin: str = "joint"
    prior: tuple[float, float] | None = None

    @property
    def is_cross(self) -> bool:
        """Whether it couples two DOFs of the joint."""
        return self.row != self.column

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class SeenStiffness:
    """Stiffness of a DOF between virtual points: joint and flexible sides together.

    Attributes
    ----------
    value, low, high : float
        Static stiffness, N/m or N m/rad, and its 95 % interval from noise and inertia; inf if it may be rigid.
    sides, inertia, noise : float
        Shares in the squared width of the compliance interval of the joint alone; their sum is 1.
    """

    value: float
    low: float
    high: float
    sides: float
    inertia: float
    noise: float


def law_parameters(joint: LawJoint) -> tuple[FittedParameter, ...]:
    """Return the parameters of a joint of laws, in its order."""
    places = [(field.name, *pair) for pair, law in joint.laws.items() for field in law.fields]
    places += [("m", dof, dof) for dof in joint.mass]
    named = zip(joint.quantities, places, strict=True)
    return tuple(FittedParameter(one.name, one.unit, *place) for one, place in named)


@dataclass(frozen=True)
class Fit(WithFindings):
    """Parameters of a joint and further unknowns, with their uncertainty.

    `plot`, `write_report`, `save` and `cards` take a fit as argument.

    Attributes
    ----------
    method : str
        Method: "compliance" (FRFs between all joint DOFs), "model" (an assembly and any FRFs), or a method of the
        thesis, averaged over bands.
    dofs : tuple of str
        Names of the joint DOFs.
    parameters : tuple of FittedParameter
        Parameters in the order of the covariance.
    estimate : ndarray, shape (p,)
        Values of the parameters; `value` has them by name.
    covariance : ndarray, shape (p, p)
        Covariance of the estimate, priors included.
    noise_level : float
        Median of the noise relative to the FRFs, estimated or given; NaN if the method has none.
    residual_level : float
        Relative noise level from the residual of the fit; well above `noise_level`, the model of the joint is wrong.
    freq_hz : ndarray, shape (n_freq,)
        Lines used, Hz.
    laws : LawJoint or None
        Identified joint of laws; `joint` is the joint of any fit.
    findings : tuple of Finding
        Remarks on the fit, the worst first: read `warnings` before you use the numbers; `notes` explain the result.
    k_lines : ndarray, shape (n_freq, n, n), or None
        Dynamic stiffness K*(w) of each line by itself, N/m; NaN if a line does not determine it, None if the method has
        none.
    bands : tuple
        Bands used for each DOF, (low, high) in Hz.
    responses, forces : tuple of str
        Channels of a fit of an assembly.
    residual_is_noise : bool or None
        Whether the residual is noise; None if the method has no noise.
    test : ResidualTest or None
        Test whether the residual is noise, and if not, at which lines and channels; None for a fit that was loaded.
    is_converged : bool
        Whether the iteration converged.
    intervals : callable or None
        Function from a probability to the interval of each parameter; None if intervals follow from the covariance. A
        fit that was loaded has intervals at some probabilities only.
    seen : mapping of str to SeenStiffness
        Stiffness ``"k_<dof>"`` between virtual points on sides that may be flexible, if no models of these were given.
        The parameters are then the stiffnesses of the joint alone.
    data : FitData, ModelData or None
        Data behind the fit, for figures and pages; None for a fit that was loaded.
    same : tuple of tuple of str
        Groups of equal joints: each has the parameters of the first of its group.
    """

    method: str
    dofs: tuple[str, ...]
    parameters: tuple[FittedParameter, ...]
    estimate: FloatArray
    covariance: FloatArray
    noise_level: float
    residual_level: float
    freq_hz: FloatArray
    laws: LawJoint | None = None
    findings: tuple[Finding, ...] = ()
    k_lines: ComplexArray | None = field(default=None, repr=False)
    bands: tuple[tuple[Band, ...], ...] = ()
    responses: tuple[str, ...] = ()
    forces: tuple[str, ...] = ()
    residual_is_noise: bool | None = None
    test: ResidualTest | None = field(default=None, repr=False)
    is_converged: bool = True
    intervals: IntervalsByProbability | None = field(default=None, repr=False, compare=False)
    seen: Mapping[str, SeenStiffness] = field(default_factory=dict)
    data: FitData | ModelData | None = field(default=None, repr=False, compare=False)
    same: tuple[tuple[str, ...], ...] = ()

    @classmethod
    def of_springs(
        cls,
        method: str,
        dofs: tuple[str, ...],
        values: Mapping[str, float],
        covariance: FloatArray,
        noise_level: float,
        residual_level: float,
        freq_hz: FloatArray,
        **more: Any,
    ) -> Fit:
        """Return a fit of springs and dampers; `values` by the names ``"k_y"``, ``"c_y,theta"``."""
        terms, estimate = [Parameter.parse(name) for name in values], np.array(list(values.values()), np.float64)
        parameters = tuple(FittedParameter(one.name, one.unit, one.kind, one.row, one.column) for one in terms)
        return cls(method, dofs, parameters, estimate, covariance, noise_level, residual_level, freq_hz, **more)

    @cached_property
    def value(self) -> dict[str, float]:
        """Value of each parameter, in its unit."""
        return dict(zip(self._names, self.estimate.tolist(), strict=True))

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(one.name for one in self.parameters)

    @property
    def std_error(self) -> dict[str, float]:
        """Standard error of each parameter, in its unit."""
        errors = np.sqrt(np.maximum(np.diagonal(self.covariance), 0))
        return dict(zip(self._names, errors.tolist(), strict=True))

    @property
    def correlation(self) -> FloatArray:
        """Correlation of the errors of all parameters, shape (p, p); 0 if a parameter has an infinite variance."""
        size = np.sqrt(np.maximum(np.diagonal(self.covariance), np.finfo(float).tiny))
        known = np.isfinite(np.outer(size, size))
        found = np.eye(size.size)
        return np.asarray(np.divide(self.covariance, np.outer(size, size), out=found, where=known))

    def _matrix(self, kind: ParameterKind) -> FloatArray:
        matrix = _matrix(self.dofs, self.parameters, self.estimate, kind)
        for first, *others in self.same:
            own = [i for i, dof in enumerate(self.dofs) if dof.startswith(f"{first}.")]
            for name in others:
                at = [i for i, dof in enumerate(self.dofs) if dof.startswith(f"{name}.")]
                if len(at) == len(own):
                    matrix[np.ix_(at, at)] = matrix[np.ix_(own, own)]
        return matrix

    @property
    def joint(self) -> Joint | LawJoint:
        """Identified joint, which you can couple, move, reorder or write; DOFs in the order of `dofs`.

        Several joints are one with DOFs named ``"mount.y"``; `at_point` returns one of them.

        Raises
        ------
        ValueError
            A stiffness of springs is infinite: the FRFs do not distinguish it from a rigid connection.
        """
        return joint_of(self.dofs, self.parameters, self.estimate) if self.laws is None else self.laws

    @property
    def stiffness_matrix(self) -> FloatArray:
        """Stiffness with its cross terms, shape (n, n), N/m, N, N m/rad."""
        return self._matrix("k")

    @property
    def damping_matrix(self) -> FloatArray:
        """Viscous damping with its cross terms, shape (n, n), N s/m, N s, N m s/rad."""
        return self._matrix("c")

    @property
    def stiffness(self) -> FloatArray:
        """Stiffness k of each DOF, shape (n,), N/m or N m/rad."""
        return self._matrix("k").diagonal()

    @property
    def damping(self) -> FloatArray:
        """Viscous damping c of each DOF, shape (n,), N s/m or N m s/rad."""
        return self._matrix("c").diagonal()

    @property
    def loss_factor(self) -> FloatArray:
        """Hysteretic loss factor eta = h/k of each DOF, shape (n,); `derived` gives its interval."""
        with np.errstate(divide="ignore", invalid="ignore"):
            found: FloatArray = self._matrix("h").diagonal() / self.stiffness
        return found

    @cached_property
    def loss_factors(self) -> dict[str, Derived]:
        """Loss factor eta = h/k, with its uncertainty, of each DOF whose hysteretic damping was fitted."""
        known = {one.row for one in self.parameters if one.kind == "h" and one.origin == "joint" and not one.is_cross}
        names = ([parameter_name(kind, dof, dof) for kind in ("eta", "h", "k")] for dof in self.dofs if dof in known)
        return {eta: self.derived(f"{{{h}}} / {{{k}}}") for eta, h, k in names if k in self._names}

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the joint points of DOFs such as ``"bolt1.y"``; empty for one point without a name."""
        return tuple(dict.fromkeys(point for point, _ in map(point_and_direction, self.dofs) if point))

    def at_point(self, point: str) -> Fit:
        """Return the fit of one of several joint points, without its name in the DOFs: for cards and `elastic_centre`.

        Parameters
        ----------
        point : str
            Name of the point, one of `points`.

        Returns
        -------
        Fit
            Parameters of the point from the common fit, with their covariance and intervals. It has no data for
            figures.

        Raises
        ------
        ValueError
            There is no such point.

        Examples
        --------
        >>> import numpy as np, jointfrf as jf
        >>> freq = np.linspace(0.5, 10, 200)
        >>> a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
        >>> b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
        >>> bolts = jf.Joint([2000.0, 2000.0], [3.0, 3.0]).dynamic_stiffness(freq)
        >>> gamma = jf.pollute(jf.couple(a, b, bolts, [0, 1], [0, 1]), 0.02, seed=2)
        >>> fit = jf.identify(freq, gamma, ["left.x", "right.x"], same=["left", "right"], damping="viscous")
        >>> fit.points, list(fit.value), list(fit.at_point("right").value)
        (('left', 'right'), ['left.k_x', 'right.k_x', 'left.c_x', 'right.c_x'], ['k_x', 'c_x'])
        """
        if point not in self.points:
            known = f"use one of {', '.join(self.points)}" if self.points else "name DOFs by points, such as bolt1.y"
            raise ValueError(f"unknown joint point {one_line(point)}; {known}")
        point = next((group[0] for group in self.same if point in group), point)
        at = [d for d, dof in enumerate(self.dofs) if point_and_direction(dof)[0] == point]
        own = {self.dofs[d]: point_and_direction(self.dofs[d])[1] for d in at}
        kept = [i for i, one in enumerate(self.parameters) if one.row in own and one.column in own]
        names = {
            one.name: replace(
                one, name=parameter_name(one.kind, own[one.row], own[one.column]), row=own[one.row],
                column=own[one.column],
            )
            for one in (self.parameters[i] for i in kept)
        }  # fmt: skip
        intervals: IntervalsByProbability
        if isinstance(self.intervals, Intervals):
            intervals = self.intervals.shared([one.name for one in names.values()], np.array(kept, np.intp))
        else:

            def intervals(probability: float) -> dict[str, tuple[float, float]]:
                every = self.confidence_interval(probability)
                return {one.name: every[name] for name, one in names.items()}

        laws = self.laws
        if laws is not None:
            terms = {(own[a], own[b]): law for (a, b), law in laws.laws.items() if a in own and b in own}
            rigid, mass = ([dof for dof in some if dof in own] for some in (laws.rigid, laws.mass))
            laws = LawJoint(
                terms, [own[dof] for dof in rigid], {own[dof]: laws.mass[dof] for dof in mass}, tuple(own.values()),
                {own[dof]: unit for dof, unit in laws.per.items() if dof in own},
            )  # fmt: skip
        found = replace(
            self,
            dofs=tuple(own.values()),
            parameters=tuple(names.values()),
            same=(),
            estimate=self.estimate[kept],
            covariance=self.covariance[np.ix_(kept, kept)],
            laws=laws,
            findings=tuple(
                replace(
                    one, about=tuple(names[name].name if name in names else own.get(name, name) for name in one.about)
                )
                for one in self.findings
                if not one.about or {*own, *names, point} & {*one.about}
            ),
            k_lines=None if self.k_lines is None else self.k_lines[:, at][:, :, at],
            bands=tuple(self.bands[d] for d in at) if self.bands else (),
            intervals=intervals,
            seen={names[name].name: one for name, one in self.seen.items() if name in names},
            data=None,
        )
        if "loss_factors" in vars(self):  # a fit that was loaded cannot compute them again
            etas = {parameter_name("eta", dof, dof): parameter_name("eta", new, new) for dof, new in own.items()}
            kept_etas = {etas[name]: one for name, one in self.loss_factors.items() if name in etas}
            vars(found)["loss_factors"] = kept_etas
        return found

    def with_findings(self, findings: Sequence[Finding]) -> Fit:
        """Return the same fit with other findings, the worst first."""
        return replace(self, findings=worst_first(findings))

    def with_findings_of_data(self, findings: Sequence[Finding]) -> Fit:
        """Return the same fit with findings of another check of its FRFs with more information on the channels."""
        of_fit = [one for one in self.findings if one.code not in DATA_MESSAGES]
        return self.with_findings([*of_fit, *(one for one in findings if one.severity != "note")])

    def issue_warnings(self) -> None:
        """Issue the warnings among the findings, at the caller of the public function that fitted."""
        for one in self.findings:
            if one.severity != "note":
                warnings.warn(as_warning(one), stacklevel=3)

    def confidence_interval(self, probability: float = 0.95) -> dict[str, tuple[float, float]]:
        """Return the interval of each parameter that contains the true value with the given probability.

        Parameters
        ----------
        probability : float
            Coverage probability, between 0 and 1, default 0.95.

        Returns
        -------
        dict of str to (low, high)
            Intervals by name, from the profile likelihood if asymmetric. A stiffness is unbounded above, up to inf, if
            the joint cannot be distinguished from a rigid one.

        Raises
        ------
        ValueError
            The probability is not between 0 and 1; or the fit was loaded and does not contain the interval of this one,
            see `save`.
        """
        probability = as_probability("probability", probability)
        if self.intervals is not None:
            return self.intervals(probability)
        reach = float(ndtri((1 + probability) / 2))
        limits = {}
        for name, value, error in zip(self._names, self.estimate.tolist(), self.std_error.values(), strict=True):
            limits[name] = (value - reach * error, value + reach * error)
        return limits

    def derived(self, function: str | DerivedFunction, probability: float = 0.95) -> Derived:
        """Return a function of the parameters, with standard error and interval.

        Parameters
        ----------
        function : str or callable
            Arithmetic expression of names of parameters, ``"h_y / k_y"``, ``"sqrt(k_y / 2.5) / (2 * pi)"``, with sqrt,
            exp, log, abs, pi; or a function from a dict of values by name to a number. Put names with characters other
            than letters, digits and _ in braces: ``"{k_y,theta} / k_y"``.
        probability : float
            Coverage probability of the interval, between 0 and 1, default 0.95.

        Returns
        -------
        Derived
            Value, standard error and interval.

        Raises
        ------
        ValueError
            The expression is invalid, or names no parameter; a probability as in `confidence_interval`.

        Notes
        -----
        For a function of one parameter, the interval is the transformed interval of the parameter. For several, it
        follows from the profile of the likelihood, minimised over all parameters with the function fixed. Without the
        likelihood, it follows from the covariance and the derivatives of the function, as the standard error does.

        Examples
        --------
        >>> import numpy as np, jointfrf as jf
        >>> freq = np.linspace(0.5, 10, 400)
        >>> a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start").receptance(freq)
        >>> b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end").receptance(freq)
        >>> h = jf.couple(a, b, jf.Joint([2000.0], dofs=["x"], loss_factor=0.1), [1], [0], freq_hz=freq)[:, 1:3, 1:3]
        >>> fit = jf.identify(freq, jf.pollute(h, 0.02, seed=2), ["x"], damping="hysteretic")
        >>> eta = fit.derived("h_x / k_x")
        >>> bool(eta.low < 0.1 < eta.high), bool(abs(eta.value / 0.1 - 1) < 0.05)
        (True, True)
        """
        intervals = self.confidence_interval if self.intervals is None else self.intervals
        probability = as_probability("probability", probability)
        return derived_quantity(function, self._names, self.estimate, self.covariance, intervals, probability)

    def k_joint(self, freq_hz: ArrayLike) -> ComplexArray:
        """Return the complex joint stiffness from the parameters.

        Parameters
        ----------
        freq_hz : array_like, shape (n_freq,)
            Frequencies, Hz.

        Returns
        -------
        ndarray, shape (n_freq, n, n)
            Dynamic stiffness, N/m, rotational N m/rad.

        Raises
        ------
        ValueError
            A DOF is rigid: use `joint.compliance`.
        """
        return self.joint.dynamic_stiffness(freq_hz)

    def unit(self, parameter: str) -> str:
        """Return the unit of a parameter; ValueError if the fit has none of this name."""
        for one in self.parameters:
            if one.name == parameter:
                return one.unit
        raise ValueError(f"unknown parameter {one_line(parameter)}; use one of {', '.join(self._names)}")

    def __str__(self) -> str:
        """Return the worst finding, a table of the parameters with their intervals, and all other findings."""
        intervals, errors = self.confidence_interval(0.95), self.std_error
        has_prior = any(one.prior for one in self.parameters)
        rows = [("parameter", "value", "std error", "95 % interval", *(["prior"] if has_prior else []), "unit")]
        for one in self.parameters:
            low, high = intervals[one.name]
            shown = _with_interval(self.value[one.name], errors[one.name], low, high)
            prior = "" if one.prior is None else f"{one.prior[0]:.4g} +- {one.prior[1]:.2g}"
            rows.append((one.name, *shown, *([prior] if has_prior else []), one.unit))
        for name, eta in self.loss_factors.items():
            shown = _with_interval(eta.value, eta.std_error, eta.low, eta.high)
            rows.append((name, *shown, *([""] if has_prior else []), "1"))
        channels = f", {len(self.responses)} responses x {len(self.forces)} forces" if self.responses else ""
        span = f"{self.freq_hz.min():g} to {self.freq_hz.max():g} Hz, {self.freq_hz.size} lines"
        worst, *others = [_wrapped(f"warning: {text}") for text in self.warnings] or [""]
        head = [*([worst, ""] if worst else []), f"method {self.method}, {span}{channels}"]
        if np.isfinite(self.noise_level):
            line = f"noise {100 * self.noise_level:.2g} %, residual {100 * self.residual_level:.2g} % of the FRFs"
            if self.test is not None and self.test.leaves_out:
                line += f", {self.test.whole:.3g} times the noise with the lines left out"
            head.append(line)
        if self.laws is not None and self.laws.rigid:
            head.append(f"rigid: {', '.join(self.laws.rigid)}")
        beside = ["", *columns_of(self._seen_rows())] if self.seen else []
        tail = [*others, *(_wrapped(f"note: {text}") for text in self.notes)]
        return "\n".join([*head, "", *columns_of(rows), *beside, *([""] if tail else []), *tail])

    def _seen_rows(self) -> list[tuple[str, ...]]:
        """Return the stiffnesses between virtual points, and the causes of wide intervals of the joint alone."""
        heading = ("between virtual points", "as seen", "95 % interval", "unit", "width by sides", "inertia", "noise")
        rows: list[tuple[str, ...]] = [heading]
        for name, one in self.seen.items():
            shares = (f"{100 * share:.0f} %" for share in (one.sides, one.inertia, one.noise))
            value, _, limits = _with_interval(one.value, 0.0, one.low, one.high)
            rows.append((name, value, limits, self.unit(name), *shares))
        return rows


def is_undetermined(low: float, high: float) -> bool:
    """Return whether an interval has no bound: the data do not determine the parameter."""
    return not np.isfinite(high) and (low == 0 or not np.isfinite(low))


def _with_interval(value: float, error: float, low: float, high: float) -> tuple[str, str, str]:
    """Return a value, its standard error and interval as text: with one bound there is only a best estimate."""
    if is_undetermined(low, high):
        return UNDETERMINED, "", ""
    is_open = not (np.isfinite(low) and np.isfinite(high))
    limits = f"{low:.4g} .. {high:.4g}"
    if is_open:
        return f"~{value:.2g}" if np.isfinite(value) else UNDETERMINED, "", limits
    return f"{value:.5g}", f"{error:.2g}", limits


def _matrix(dofs: tuple[str, ...], parameters: Sequence[FittedParameter], values: FloatArray, kind: str) -> FloatArray:
    """Return the parameters of one kind as a symmetric matrix, shape (n, n)."""
    matrix = np.zeros((len(dofs), len(dofs)))
    for one, value in zip(parameters, values, strict=True):
        if one.kind == kind and one.origin == "joint":
            a, b = dofs.index(one.row), dofs.index(one.column)
            matrix[a, b] = matrix[b, a] = value
    return matrix


def joint_of(dofs: tuple[str, ...], parameters: Sequence[FittedParameter], values: FloatArray) -> Joint:
    """Return the joint of springs and dampers with these parameters."""
    k, h, c = (_matrix(dofs, parameters, values, kind) for kind in "khc")
    return Joint(k, c, dofs, structural_damping=h)


def _wrapped(text: str) -> str:
    """Return a finding in lines of a printed fit."""
    return textwrap.fill(text, _WIDTH, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False)


def columns_of(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return rows in columns, the first one above a rule."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(w) for cell, w in zip(row, widths, strict=True)).rstrip() for row in rows]
    lines.insert(1, "-" * max(map(len, lines)))
    return lines
