"""What a test that has not been made will know of a joint, and which sensors and hits to choose for it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.frf.bands import Band
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
from jointfrf.planning.design import Criterion, Design, Designer, Prices, criterion_of
from jointfrf.planning.information import FrfInformation, PlannedTest, expected_noise, narrowest_band
from jointfrf.spelling import did_you_mean

__all__ = ["Addition", "MeasurementPlan", "PlanStep", "plan"]

#: Without a goal, a further sensor or hit is worth its price while it lowers the error by this share.
_WORTH = 0.1
#: A candidate is blind where it has less than this part of the information that candidates have on the average.
_BLIND = 0.01
#: An error that leaves a parameter open.
_OPEN = 0.5
#: Names of blind candidates that one sentence can hold.
_NAMED = 6


@dataclass(frozen=True)
class PlanStep:
    """A test: sensors, each of them read at every hit.

    Attributes
    ----------
    sensors, hits : tuple of str
        DOFs.
    cost : float
    error : float
        Size of the relative errors of the targets, by the criterion.
    std_error : dict of str to float
        Of all parameters.
    """

    sensors: tuple[str, ...]
    hits: tuple[str, ...]
    cost: float
    error: float
    std_error: dict[str, float]


@dataclass(frozen=True)
class Addition:
    """A sensor or a hit more.

    Attributes
    ----------
    kind : str
        ``"sensor"`` or ``"hit"``.
    dof : str
    cost : float
    error : float
        Size of the relative errors of the targets with it.
    """

    kind: str
    dof: str
    cost: float
    error: float


@dataclass(frozen=True)
class MeasurementPlan(WithFindings):
    """What was planned.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
    value, unit : dict of str
        Expected values of all parameters, and their units.
    targets : tuple of str
        Parameters that the plan is for.
    steps : tuple of PlanStep
        From the smallest test to the one that is proposed: the last.
    everything : PlanStep
        All candidates.
    additions : tuple of Addition
        What would come next, the most useful for its price first.
    line_share : ndarray, shape (n_targets, n_freq)
        Share of what the proposed test knows of each target that comes from each line; with that of priors 1 together.
    frf_share : ndarray, shape (n_targets, n_responses, n_forces)
        The same of each candidate, if all were measured.
    responses, forces : tuple of str
        Candidates.
    bands : dict of str to tuple of float
        Of each target, the narrowest band with 90 % of what the lines know of it, Hz.
    shift : dict of str to float
        By how much the masses of the sensors move each target, where they are not in the model.
    findings : tuple of Finding
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
        """The test that is proposed."""
        return self.steps[-1]

    def relative_error(self, step: PlanStep, name: str) -> float:
        """Return the standard error of a parameter over its value; of one that is 0, inf."""
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
    noise: float = 0.01,
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
    """Plan a test: which sensors and hits show a joint best, and what they will know of it.

    Parameters
    ----------
    assembly : Assembly
        With the joint as it is expected, and what is unknown of the models, as for `identify_model`.
    freq_hz : array_like, shape (n_freq,)
        Lines that will be measured, above 0 Hz.
    responses, forces : sequence of str
        Candidates: DOFs ``"A/7:y"`` where there could be a sensor, and a hit or a shaker.
    noise : float
        Standard deviation of an average relative to the FRF.
    floor : float
        Standard deviation of an average of the accelerance that does not depend on the FRF, m/(s^2 N).
    averages : float
        Averages of each FRF.
    targets : sequence of str, optional
        Parameters that are to be found: those of joints by default. Unknowns of models, and means of joints that are
        alike with a spread that is given, can be named.
    criterion : {"A", "D"}
        What the choice makes small: the mean of the squared relative errors of the targets, or the volume of their
        ellipsoid. One target alone is c-optimality.
    within : float, optional
        Relative error (by the criterion) at which the plan ends.
    budget : float, optional
        What sensors and hits may cost together. By default the plan ends where one more lowers the error by less than
        a tenth.
    sensor_price, hit_price : float
        Of one sensor, of one hit.
    sensors, hits : sequence of str
        What is there already, or stays in any case; at no cost.
    sensor_mass : float
        kg of each sensor, which the model does not have: what it moves is shown.
    fixed, response_gains, force_gains
        As in `identify_model`.

    Returns
    -------
    MeasurementPlan

    Raises
    ------
    ValueError
        Names that there are not; a joint with a parameter that is 0, of which no relative error can be said; nothing
        to choose from; noise that is zero.
    SingularLineError
        An undamped assembly resonates at a line.

    Notes
    -----
    Fisher information of relative changes of all parameters, priors included: its inverse is the least covariance of an
    unbiased estimate, which `identify_model` reaches. Sensors and hits are added one at a time, the one first that
    lowers the criterion most for its price; after each, sensors and hits are exchanged one by one as long as that
    lowers it further (V. V. Fedorov, Theory of Optimal Experiments, 1972; D. C. Kammer, J. Guid. Control Dyn. 14 (1991)
    251, for sensors of modes). Every sensor is read at every hit. The proposal is as good as the expected joint is:
    plan with a soft and a stiff one where it is not known.

    Examples
    --------
    Which of three masses to hit, and where to put sensors:

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
        raise ValueError("freq_hz must hold lines above 0 Hz")
    for name, gains in (("response_gains", response_gains), ("force_gains", force_gains)):
        if not isinstance(gains, Mapping | None):
            raise TypeError(f"{name} must be a mapping of channels to Unknown, not {type(gains).__name__}")
    if criterion not in get_args(Criterion):
        raise ValueError(f"criterion must be A or D, not {one_line(criterion)}")
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
    planner = _Planner(test, channels, information, wanted, designer)
    return planner.planned(list(goal.steps(designer)), as_not_negative("sensor_mass", sensor_mass, "kg"))


def _targets(vector: ParameterVector, names: tuple[str, ...] | None) -> NDArray[np.intp]:
    """Return the numbers of the targets among the free parameters."""
    fitted = [one.name for one in vector.fitted]
    chosen = names or tuple(one.name for one in vector.fitted if one.origin == "joint")
    if not chosen:
        raise ValueError("there is nothing to find: all parameters of the joint are fixed")
    open_means = [one.name for one in vector.all if one.origin == "mean" and not one.is_free]
    for name in chosen:
        if name in open_means:
            raise ValueError(
                f"{name} is the mean of joints whose spread is not known: a plan for it needs their `spread`"
            )
        if name not in fitted:
            raise ValueError(f"no unknown is called {one_line(name)}{did_you_mean(name, fitted)}")
        if vector.fitted[fitted.index(name)].value == 0:
            raise ValueError(f"{name} is 0 in the assembly: a plan needs the value that is expected, or name targets")
    return np.array([fitted.index(name) for name in dict.fromkeys(chosen)], np.intp)


class _Goal(NamedTuple):
    """Where a plan ends."""

    budget: float
    within: float
    by_worth: bool

    def steps(self, designer: Designer) -> Iterator[Design]:
        """Yield designs up to the goal."""
        before: Design | None = None
        for design in designer.designs():
            if before is not None and designer.cost(design) > self.budget:
                return
            if before is not None and self.by_worth and np.exp((design.loss - before.loss) / 2) > 1 - _WORTH:
                return
            yield design
            if np.exp(design.loss / 2) <= self.within:
                return
            before = design


class _Planner(NamedTuple):
    """What a plan is made from."""

    test: PlannedTest
    channels: Channels
    information: FrfInformation
    targets: NDArray[np.intp]
    designer: Designer

    def planned(self, designs: list[Design], sensor_mass: float) -> MeasurementPlan:
        """Return the plan that ends with the last of these designs."""
        best, every = designs[-1], self.information
        chosen = self._chosen(best, sensor_mass)
        line_share = chosen.shares(chosen.of_line)[:, self.targets].T
        parameters = every.parameters
        names = tuple(parameters[i].name for i in self.targets)
        steps = tuple(self._step(design) for design in designs)
        n_o, n_i = every.of_frf.shape[:2]
        all_of_it = Design(tuple(range(n_o)), tuple(range(n_i)), np.inf)
        additions = sorted(
            (self._addition(best, more) for more in self.designer.additions(best)),
            key=lambda one: np.log(one.error / steps[-1].error) / one.cost,
        )
        everything = self._step(all_of_it)
        frf_share = np.moveaxis(every.shares(every.of_frf)[:, :, self.targets], -1, 0)
        found = MeasurementPlan(
            self.test.freq_hz,
            {one.name: one.value for one in parameters},
            {one.name: one.unit for one in parameters},
            names,
            steps,
            everything,
            tuple(additions),
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
        information = self.designer.information(design)
        errors = np.sqrt(np.diagonal(np.linalg.inv(information))) * self.information.scale
        return PlanStep(
            tuple(self.channels.responses[o] for o in design.sensors),
            tuple(self.channels.forces[i] for i in design.hits),
            self.designer.cost(design),
            float(np.exp(self.designer.loss(information) / 2)),
            {one.name: float(error) for one, error in zip(self.information.parameters, errors, strict=True)},
        )

    def _addition(self, design: Design, more: Design) -> Addition:
        is_sensor = len(more.sensors) > len(design.sensors)
        dof = self.channels.responses[more.sensors[-1]] if is_sensor else self.channels.forces[more.hits[-1]]
        cost = self.designer.prices.sensor if is_sensor else self.designer.prices.hit
        return Addition("sensor" if is_sensor else "hit", dof, cost, float(np.exp(more.loss / 2)))

    def _chosen(self, design: Design, sensor_mass: float) -> FrfInformation:
        """Return the information of a design by line, and what the masses of its sensors move."""
        own = self.channels
        responses = tuple(own.responses[o] for o in design.sensors)
        forces = tuple(own.forces[i] for i in design.hits)
        chosen = Channels(
            responses, forces,
            {name: gain for name, gain in own.response_gains.items() if name in responses},
            {name: gain for name, gain in own.force_gains.items() if name in forces},
        )  # fmt: skip
        measured = None
        if sensor_mass:
            masses = tuple(AddedMass(dofs, sensor_mass) for dofs in self._nodes(responses))
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
    """Say what no choice cures, what sees nothing, and what sensors do to the structure."""
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
