"""Plan of a test: choice of sensors and impacts, and the standard errors to expect."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.bands import Band
from jointfrf.frf.stated_noise import StatedNoise
from jointfrf.identification.model.assembly import AddedMass, Assembly
from jointfrf.identification.model.prepare import Channels
from jointfrf.identification.model.substructure import Unknown
from jointfrf.identification.parameters import ParameterVector
from jointfrf.identification.result import columns_of
from jointfrf.kernel.arguments import (
    FloatArray,
    as_frequency,
    as_names,
    as_not_negative,
    as_positive,
    check_type,
    one_line,
)
from jointfrf.messages.finding import Finding, WithFindings
from jointfrf.spelling import did_you_mean, some_of
from jointfrf.workbench.planning.design import Criterion, Design, Designer, Prices, criterion_of, loss_of
from jointfrf.workbench.planning.information import FrfInformation, PlannedTest, expected_noise, narrowest_band

__all__ = ["Addition", "MeasurementPlan", "PlanStep", "plan"]

#: Share by which a further sensor or impact must lower the error if neither `within` nor `budget` is given.
_WORTH = 0.1
#: Share of the mean information of candidates below which a candidate is blind.
_BLIND = 0.01
#: Relative error above which a parameter is not determined.
_OPEN = 0.5
#: Largest number of blind candidates that a sentence names.
_NAMED = 6


@dataclass(frozen=True)
class PlanStep:
    """A test in which every sensor is read at every impact.

    Attributes
    ----------
    sensors, hits : tuple of str
        DOFs of the sensors and of the impacts.
    cost : float
        Price of sensors and impacts that are not given already.
    error : float
        Size of the relative errors of the targets, by the criterion.
    std_error : dict of str to float
        Expected standard errors of all parameters.
    """

    sensors: tuple[str, ...]
    hits: tuple[str, ...]
    cost: float
    error: float
    std_error: dict[str, float]


@dataclass(frozen=True)
class Addition:
    """A further sensor or impact.

    Attributes
    ----------
    kind : str
        ``"sensor"`` or ``"hit"``.
    dof : str
        DOF of the sensor or impact.
    cost : float
        Price of the sensor or impact.
    error : float
        Size of the relative errors of the targets if it is added.
    """

    kind: str
    dof: str
    cost: float
    error: float


@dataclass(frozen=True)
class MeasurementPlan(WithFindings):
    """A plan of a test; `print` shows it.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Lines of the test, Hz.
    value, unit : dict of str
        Expected values of all parameters, and their units.
    targets : tuple of str
        Names of the parameters that the plan is for.
    steps : tuple of PlanStep
        Tests of rising size; the last one is proposed.
    everything : PlanStep
        Test with all candidates.
    additions : tuple of Addition
        Further sensors and impacts, by falling gain for the price.
    line_share : ndarray, shape (n_targets, n_freq)
        Share of the information on each target that each line of the proposed test contributes. With the share of the
        priors the sum is 1.
    frf_share : ndarray, shape (n_targets, n_responses, n_forces)
        Share of the information on each target that each candidate contributes if all are measured.
    responses, forces : tuple of str
        DOFs of the candidates.
    bands : dict of str to tuple of float
        Narrowest band with 90 % of the information on each target, Hz.
    shift : dict of str to float
        Error of each target by the masses of the sensors; empty if no mass is given.
    findings : tuple of Finding
        Warnings about the plan.
    """

    freq_hz: FloatArray
    value: dict[str, float]
    unit: dict[str, str]
    targets: tuple[str, ...]
    steps: tuple[PlanStep, ...]
    everything: PlanStep
    additions: tuple[Addition, ...]
    line_share: FloatArray
    frf_share: FloatArray
    responses: tuple[str, ...]
    forces: tuple[str, ...]
    bands: dict[str, Band]
    shift: dict[str, float]
    findings: tuple[Finding, ...]

    @property
    def proposed(self) -> PlanStep:
        """The proposed test."""
        return self.steps[-1]

    def relative_error(self, step: PlanStep, name: str) -> float:
        """Return the standard error of a parameter over its value, or inf if the value is 0."""
        return step.std_error[name] / abs(self.value[name]) if self.value[name] else np.inf

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        best = self.proposed
        yield f"sensors: {', '.join(best.sensors)}"
        yield f"hits:    {', '.join(best.hits)}"
        yield ""
        shifted = bool(self.shift)
        heading = ("", "expected", "", "standard error", "all candidates", "band, Hz")
        yield from columns_of([
            (*heading, "sensors' masses") if shifted else heading,
            *(self._row(name, shifted) for name in self.targets),
        ])  # fmt: skip
        yield ""
        sizes = [
            (str(len(one.sensors)), str(len(one.hits)), f"{one.cost:g}", _percent(one.error)) for one in self.steps
        ]
        yield from columns_of([("sensors", "hits", "cost", "error"), *sizes])
        if self.additions:
            yield ""
            yield "next: " + ", ".join(f"{one.kind} {one.dof} ({_percent(one.error)})" for one in self.additions[:3])
        yield from map(str, self.findings)

    def _row(self, name: str, shifted: bool) -> tuple[str, ...]:
        low, high = self.bands[name]
        row = (
            name, f"{self.value[name]:.4g}", self.unit[name], f"{100 * self.relative_error(self.proposed, name):.2g} %",
            f"{100 * self.relative_error(self.everything, name):.2g} %", f"{low:.4g} to {high:.4g}",
        )  # fmt: skip
        return (*row, f"{100 * self.shift[name] / abs(self.value[name]):+.2g} %") if shifted else row


def plan(
    assembly: Assembly,
    freq_hz: ArrayLike,
    responses: Sequence[str],
    forces: Sequence[str],
    *,
    noise: float | StatedNoise = 0.01,
    floor: float = 0.0,
    averages: float = 1.0,
    targets: Sequence[str] | None = None,
    criterion: Criterion = "A",
    within: float | None = None,
    budget: float | None = None,
    sensor_price: float = 1.0,
    hit_price: float = 1.0,
    sensors: Sequence[str] = (),
    hits: Sequence[str] = (),
    sensor_mass: float = 0.0,
    fixed: Sequence[str] = (),
    response_gains: Mapping[str, Unknown] | None = None,
    force_gains: Mapping[str, Unknown] | None = None,
) -> MeasurementPlan:
    """Choose sensors and impacts for a test, and return the standard errors to expect.

    Parameters
    ----------
    assembly : Assembly
        Assembly with the expected joint and the unknowns of the models, as `identify_model` takes it.
    freq_hz : array_like, shape (n_freq,)
        Lines of the test, Hz, above 0.
    responses, forces : sequence of str
        DOFs ``"A/7:y"`` that are candidates for a sensor, and for an impact or a shaker.
    noise : float or StatedNoise
        Standard deviation of an average relative to the FRF, default 0.01; or relative part and floors.
    floor : float
        Standard deviation of an average of the accelerance that does not depend on the FRF, m/(s^2 N), default 0.
    averages : float
        Number of averages of each FRF, default 1.
    targets : sequence of str, optional
        Names of the parameters whose errors the plan lowers, default all free parameters of joints. Unknowns of models
        are possible, and means of alike joints whose spread is given.
    criterion : {"A", "D"}
        Criterion that the choice minimises: mean of the squared relative errors of the targets ("A", default), or
        volume of their ellipsoid ("D"). With one target both are c-optimality.
    within : float, optional
        Relative error (by the criterion) at which the plan ends.
    budget : float, optional
        Largest total price of sensors and impacts. Without `within` and `budget` the plan ends when one more sensor or
        impact lowers the error by less than a tenth.
    sensor_price, hit_price : float
        Price of one sensor, and of one impact, default 1.
    sensors, hits : sequence of str
        DOFs of sensors and impacts that are part of every test, at no cost.
    sensor_mass : float
        Mass of each sensor in kg, default 0, which the model does not contain; `shift` contains its effect.
    fixed : sequence of str
        Names of parameters of the joint that are known.
    response_gains, force_gains : mapping of str to Unknown, optional
        Unknown gains of channels, by DOF.

    Returns
    -------
    MeasurementPlan
        Proposed test, smaller tests, and shares of lines and FRFs.

    Raises
    ------
    ValueError
        Unknown names; a target whose value is 0, which has no relative error; no candidates, or noise that is zero.
    SingularLineError
        An undamped assembly resonates at a line.

    See Also
    --------
    identify_model : fit of the measured FRFs.
    plan_joint_frfs : expected errors from FRFs between all joint DOFs.
    write_plan : page of a plan.

    Notes
    -----
    The inverse of the Fisher information of relative changes, priors included, is the least covariance of an unbiased
    estimate, which `identify_model` reaches. The stated errors include errors of models that are not exact, at the
    level that `identify_model` is expected to allow for. The choice is made without them.

    `plan` adds the sensor or impact that lowers the criterion most for its price. After each addition it exchanges
    sensors and impacts one by one as long as the criterion falls [1]_ [2]_. Designs whose errors differ by less than
    5e-6 are taken in the order of the candidates. Every sensor is read at every impact.

    The proposal is only as good as the expected joint. If the joint is not known, plan with a soft and a stiff one.

    References
    ----------
    .. [1] V. V. Fedorov, Theory of Optimal Experiments, 1972.
    .. [2] D. C. Kammer, J. Guid. Control Dyn. 14 (1991) 251, for sensors of modes.

    Examples
    --------
    Choose one of three masses for the impact, and the position of the sensors:

    >>> import numpy as np, jointfrf as jf
    >>> a = jf.Substructure(jf.chain([5, 3], [2500, 3500], [3, 4], ground="start"), ["2:x"], exact=True)
    >>> b = jf.Substructure(jf.chain([4, 2], [2000, 2500], [2, 1], ground="end"), ["1:x"], exact=True)
    >>> whole = jf.Assembly(a, b, jf.Joint([2000.0], [3.0], dofs=["x"]))
    >>> masses = ["A/1:x", "A/2:x", "B/1:x", "B/2:x"]
    >>> found = jf.plan(whole, np.linspace(0.5, 10, 400), masses, masses, noise=0.05, targets=["k_x"], within=0.004)
    >>> found.proposed.sensors, found.proposed.hits
    (('A/1:x',), ('A/2:x',))
    """
    check_type("assembly", assembly, Assembly)
    freq = as_frequency(freq_hz)
    if not freq.size or freq.min() <= 0:
        raise ValueError("freq_hz has no lines or a line at or below 0 Hz; give lines above 0 Hz")
    for name, gains in (("response_gains", response_gains), ("force_gains", force_gains)):
        if not isinstance(gains, Mapping | None):
            raise TypeError(f"{name} is {type(gains).__name__}; give a mapping of channels to Unknown")
    if criterion not in get_args(Criterion):
        raise ValueError(f"unknown criterion {one_line(criterion)}; use A or D")
    stays = as_names("sensors", sensors), as_names("hits", hits)
    named = [
        tuple(dict.fromkeys([*own, *as_names(what, more)]))
        for own, what, more in zip(stays, ("responses", "forces"), (responses, forces), strict=True)
    ]
    channels = Channels(named[0], named[1], dict(response_gains or {}), dict(force_gains or {}))
    for names, what in ((channels.responses, "response"), (channels.forces, "force")):
        assembly.check(names, what)
    test = PlannedTest(assembly, freq, expected_noise(noise, floor, averages), as_names("fixed", fixed))
    goal = _Goal(
        np.inf if budget is None else as_positive("budget", budget),
        0.0 if within is None else as_positive("within", within),
        within is None and budget is None,
    )
    prices = Prices(as_positive("sensor_price", sensor_price), as_positive("hit_price", hit_price))
    vector = test.vector(channels)
    wanted = _targets(vector, None if targets is None else as_names("targets", targets))
    information = test.information(channels)
    kept = Design(
        tuple(channels.responses.index(one) for one in stays[0]), tuple(channels.forces.index(one) for one in stays[1]),
        np.inf,
    )  # fmt: skip
    designer = Designer(information.of_frf, information.prior, criterion_of(wanted, criterion), prices, kept)
    planner = _Planner(test, channels, information, wanted, criterion, designer)
    return planner.planned(goal, as_not_negative("sensor_mass", sensor_mass, "kg"))


def _targets(vector: ParameterVector, names: tuple[str, ...] | None) -> NDArray[np.intp]:
    """Return the numbers of the targets among the free parameters."""
    fitted = [one.name for one in vector.fitted]
    chosen = names or tuple(one.name for one in vector.fitted if one.origin == "joint")
    if not chosen:
        raise ValueError("all parameters of the joint are fixed; leave one free")
    open_means = [one.name for one in vector.all if one.origin == "mean" and not one.is_free]
    for name in chosen:
        if name in open_means:
            raise ValueError(f"{name} is the mean of joints with unknown spread; give their `spread`")
        if name not in fitted:
            raise ValueError(
                f"unknown target {one_line(name)}; use one of {some_of(list(fitted), 12)}{did_you_mean(name, fitted)}"
            )
        if vector.fitted[fitted.index(name)].value == 0:
            raise ValueError(f"{name} is 0 in the assembly; give its expected value, or other targets")
    return np.array([fitted.index(name) for name in dict.fromkeys(chosen)], np.intp)


class _Goal(NamedTuple):
    """Conditions at which a plan ends."""

    budget: float
    within: float
    by_worth: bool

    def steps(self, designs: Iterable[PlanStep]) -> Iterator[PlanStep]:
        """Yield designs up to the goal."""
        before: PlanStep | None = None
        for one in designs:
            if before is not None and one.cost > self.budget:
                return
            if before is not None and self.by_worth and one.error > (1 - _WORTH) * before.error:
                return
            yield one
            if one.error <= self.within:
                return
            before = one


class _Planner(NamedTuple):
    """Makes the plan from the candidates and their information."""

    test: PlannedTest
    channels: Channels
    information: FrfInformation
    targets: NDArray[np.intp]
    criterion: Criterion
    designer: Designer

    def planned(self, goal: _Goal, sensor_mass: float) -> MeasurementPlan:
        """Return the plan that ends at a goal."""
        designs = list[Design]()

        def every_step() -> Iterator[PlanStep]:
            for design in self.designer.designs():
                designs.append(design)
                yield self._step(design)

        steps, every = tuple(goal.steps(every_step())), self.information
        best = designs[len(steps) - 1]
        chosen = self._chosen(best, sensor_mass)
        line_share = chosen.shares(chosen.of_line)[:, self.targets].T
        parameters = every.parameters
        names = tuple(parameters[i].name for i in self.targets)
        n_o, n_i = every.of_frf.shape[:2]
        everything = self._step(Design(tuple(range(n_o)), tuple(range(n_i)), np.inf))
        frf_share = np.moveaxis(every.shares(every.of_frf)[:, :, self.targets], -1, 0)
        found = MeasurementPlan(
            self.test.freq_hz,
            {one.name: one.value for one in parameters},
            {one.name: one.unit for one in parameters},
            names,
            steps,
            everything,
            tuple(self._additions(best, steps[-1])),
            line_share,
            frf_share,
            self.channels.responses,
            self.channels.forces,
            {name: narrowest_band(self.test.freq_hz, share) for name, share in zip(names, line_share, strict=True)},
            self._shift(chosen, names),
            (),
        )
        return replace(found, findings=tuple(_findings(found)))

    def _step(self, design: Design) -> PlanStep:
        """Return a design with the expected standard errors, errors of the models included."""
        covariance = np.array(np.linalg.inv(self.designer.information(design)), np.float64)
        own = self._own_channels(design)
        if self.test.has_errors:
            at, known = self._places(own), self.test.error_information(own)
            covariance[np.ix_(at, at)] = known.covariance(range(len(design.sensors)), range(len(design.hits)))
        errors = np.sqrt(np.diagonal(covariance)) * self.information.scale
        return PlanStep(
            own.responses,
            own.forces,
            self.designer.cost(design),
            self._size(covariance),
            {one.name: float(error) for one, error in zip(self.information.parameters, errors, strict=True)},
        )

    def _size(self, covariance: FloatArray) -> float:
        """Return the size of the errors of the targets."""
        return float(np.exp(loss_of(covariance[np.ix_(self.targets, self.targets)], self.criterion) / 2))

    def _places(self, channels: Channels) -> list[int]:
        """Return the numbers of the parameters of some channels among all."""
        names = [one.name for one in self.information.parameters]
        return [names.index(one.name) for one in self.test.vector(channels).fitted]

    def _additions(self, best: Design, step: PlanStep) -> Iterator[Addition]:
        """Yield further sensors and impacts, by falling gain for the price."""
        grown = list(self.designer.additions(best))
        if self.test.has_errors:
            grown = [replace(more, loss=2 * np.log(size)) for more, size in self._sizes_with_errors(best, grown)]
        prices = self.designer.prices
        for more in self.designer.ranked(replace(best, loss=2 * np.log(step.error)), grown):
            is_sensor = len(more.sensors) > len(best.sensors)
            dof = self.channels.responses[more.sensors[-1]] if is_sensor else self.channels.forces[more.hits[-1]]
            kind, cost = ("sensor", prices.sensor) if is_sensor else ("hit", prices.hit)
            yield Addition(kind, dof, cost, float(np.exp(more.loss / 2)))

    def _sizes_with_errors(self, best: Design, grown: Sequence[Design]) -> Iterator[tuple[Design, float]]:
        """Yield larger designs with the size of their errors, errors of the models included."""
        n_o, n_i = self.information.of_frf.shape[:2]
        sensors = [*best.sensors, *(o for o in range(n_o) if o not in best.sensors)]
        hits = [*best.hits, *(i for i in range(n_i) if i not in best.hits)]
        for rows, columns in ((sensors, best.hits), (best.sensors, hits)):
            own = [one for one in grown if (len(one.sensors) > len(best.sensors)) == (rows is sensors)]
            if not own:
                continue
            channels = self._own_channels(Design(tuple(rows), tuple(columns), np.inf))
            known, at = self.test.error_information(channels), self._places(channels)
            covariance: FloatArray = np.diag(np.full(len(self.information.parameters), np.inf))
            for one in own:
                covariance[np.ix_(at, at)] = known.covariance(
                    [rows.index(o) for o in one.sensors], [columns.index(i) for i in one.hits]
                )
                yield one, self._size(covariance)

    def _own_channels(self, design: Design) -> Channels:
        """Return the channels of a design."""
        own = self.channels
        responses = tuple(own.responses[o] for o in design.sensors)
        forces = tuple(own.forces[i] for i in design.hits)
        return Channels(
            responses, forces,
            {name: gain for name, gain in own.response_gains.items() if name in responses},
            {name: gain for name, gain in own.force_gains.items() if name in forces},
        )  # fmt: skip

    def _chosen(self, design: Design, sensor_mass: float) -> FrfInformation:
        """Return the information of a design by line, and the effect of the masses of its sensors."""
        chosen, measured = self._own_channels(design), None
        if sensor_mass:
            masses = tuple(AddedMass(dofs, sensor_mass) for dofs in self._nodes(chosen.responses))
            measured = self.test.assembly.with_attachments(*masses)
        return self.test.information(chosen, measured)

    def _nodes(self, responses: Sequence[str]) -> list[tuple[str, ...]]:
        """Return the translations of each node that carries a sensor."""
        nodes = dict.fromkeys(name.rpartition(":")[0] for name in responses)
        moving = []
        for node in nodes:
            own = [f"{node}:{axis}" for axis in "xyz" if self.test.assembly.has(f"{node}:{axis}")]
            moving.append(tuple(own or [name for name in responses if name.rpartition(":")[0] == node]))
        return moving

    def _shift(self, chosen: FrfInformation, names: tuple[str, ...]) -> dict[str, float]:
        if chosen.pull is None:
            return {}
        moved = chosen.covariance() @ chosen.pull.sum(axis=(0, 1)) * chosen.scale
        own = [one.name for one in chosen.parameters]
        return {name: float(moved[own.index(name)]) for name in names}


def _percent(value: float) -> str:
    return f"{100 * value:.3g} %"


def _findings(found: MeasurementPlan) -> Iterator[Finding]:
    """Yield warnings of targets that no choice determines, of blind candidates and of heavy sensors."""
    for name in found.targets:
        least = found.relative_error(found.everything, name)
        if least > _OPEN:
            numbers = {"sensors": len(found.responses), "hits": len(found.forces), "error": least}
            yield Finding("target-unbounded", numbers, (name,))
    moved = [name for name, shift in found.shift.items() if abs(shift) > found.proposed.std_error[name]]
    if moved:
        changes = tuple(f"{name} by {100 * found.shift[name] / abs(found.value[name]):+.2g} %" for name in moved)
        yield Finding("sensor-mass", {"changes": changes}, tuple(moved))
    for what, names, axis in (("sensor", found.responses, 1), ("hit", found.forces, 0)):
        mean = found.frf_share.mean(axis=0).sum(axis=axis)
        blind = [one for one, share in zip(names, mean.tolist(), strict=True) if share < _BLIND * mean.mean()]
        if blind:
            yield Finding("blind-channels", {"what": what}, tuple(blind))
