"""CPU seconds of fits on one thread: `tests/benchmarks/run-fits --help`."""

from __future__ import annotations

import argparse
import contextlib
import time
import unittest.mock
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

import hammer_test
import jointfrf as jf
import six_dof_beams
from jointfrf.identification.manifold.coordinates import CrossTerms
from jointfrf.identification.model.reduced import ReducedSubstructure
from jointfrf.identification.realisations import FitStart, viscous_joints
from rigid_bodies import DOFS, POINT

from .machine import processor
from .units import unit_timer

_SECTION = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
#: Channels of the beams of 1 mm elements.
_CHANNELS = {
    "16 FRFs at the joint": ("A/301:y", "A/301:theta", "B/1:y", "B/1:theta"),
    "16 at remote points": ("A/151:y", "A/251:y", "B/101:y", "B/226:y"),
    "one": ("B/226:y",),
}
_TRUE = ([6e5, 6e5, 4e6, 5e3, 5e3, 400], [20, 20, 60, 1.5, 1.5, 0.2])
_GUESS = ([3e5, 3e5, 2e6, 3e3, 3e3, 200], [10, 10, 30, 1, 1, 0.1])
#: Bricks across, through and along each of two large parts: 9 990 and 99 225 DOFs where free.
_LARGE = ((5, 2, 184), (20, 14, 104))
#: N/m: y of the beams of case 3.3 differs from rigid by less than noise.
_RIGID = 1e11
#: Realisations of one call.
_MANY = 20


class _Timed(NamedTuple):
    """What is timed: its name, the true values, what fits the draw of a seed, how many realisations that is."""

    name: str
    truth: dict[str, float]
    fit: Callable[[int], Any]
    count: int = 1


def main() -> int:
    parser = argparse.ArgumentParser(prog="run-fits", description=__doc__)
    parser.add_argument("--repetitions", type=int, default=5, metavar="N", help="draws of the noise, each timed")
    parser.add_argument("--only", metavar="TEXT", default="", help="fits whose name has this text")
    parser.add_argument(
        "--large", action="store_true", help="parts of 10 000 DOFs and of 100 000 instead, one draw each; minutes"
    )
    options = parser.parse_args()
    if options.large:
        for divisions in _LARGE:
            _time_large(divisions)
        return 0
    unit = unit_timer()
    print("| fit | CPU s, least | median | units, median | intervals of 95 % that hold |\n|---|---|---|---|---|")
    for make in (_at_two_dofs, _at_six_dofs, _at_virtual_points, _with_models):
        for one in make():
            if options.only in one.name:
                _time(one, options.repetitions, unit)
    print(f"{processor()}; unit: {1e3 * unit():.3g} ms, numpy.linalg.inv of 20 000 complex matrices of order 4")
    return 0


def _time(one: _Timed, repetitions: int, unit: Callable[[], float]) -> None:
    """Print a row: each fit between two measurements of the unit, of which the lower one counts."""
    seconds, units, held = [], [], []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        one.fit(0)  # what the first fit of a process imports and keeps
        before = unit()
        for seed in range(repetitions):
            start = time.process_time()
            found = one.fit(seed)
            seconds.append((time.process_time() - start) / one.count)
            after = unit()
            units.append(seconds[-1] / min(before, after))
            before = after
            if isinstance(found, jf.Fit):
                limits = found.confidence_interval(0.95)
                held += [limits[key][0] <= true <= limits[key][1] for key, true in one.truth.items() if key in limits]
    shown = f"{sum(held)} of {len(held)}" if held else ""
    row = f"{min(seconds):.3g} | {np.median(seconds):.3g} | {np.median(units):.3g}"
    print(f"| {one.name} | {row} | {shown} |", flush=True)


def _at_two_dofs() -> Iterator[_Timed]:
    """Case 3.3: 786 lines, 5 % noise."""
    exact, _, truth = _two_beams(_CHANNELS["16 FRFs at the joint"])
    freq, dofs = np.arange(15.0, 801.0), ["y", "theta"]
    for name, damping in (("case 3.3, 2 joint DOFs, 786 lines, 5 % noise", "auto"), ("the same, viscous", "viscous")):
        yield _Timed(
            name, truth,
            lambda seed, damping=damping: jf.identify(freq, jf.pollute(exact, 0.05, seed=seed), dofs, damping=damping),
        )  # fmt: skip
    for name, damping in (("", "viscous"), (", damping chosen", "auto")):
        start = FitStart.of(freq, jf.pollute(exact, 0.05, seed=99), dofs, damping=damping)

        def many(seed: int, damping: str = damping, start: FitStart = start) -> list[dict[str, tuple[float, float]]]:
            drawn = jf.realisations(exact, 0.05, seed=seed, count=_MANY)
            fits = jf.identify_realisations(freq, drawn, dofs, damping=damping, start=start)
            return [fit.confidence_interval(0.95) for fit in fits]

        yield _Timed(f"a realisation of it in `identify_realisations`, with its interval{name}", truth, many, _MANY)
    yield _Timed(
        "a realisation of it in a case", truth,
        lambda seed: viscous_joints(freq, jf.realisations(exact, 0.05, seed=seed, count=_MANY), dofs), _MANY,
    )  # fmt: skip
    pin, _, _ = _two_beams(_CHANNELS["16 FRFs at the joint"], jf.Joint([_RIGID, 0.0], [0.0, 0.1], dofs))
    yield _Timed(
        "a pin: rigid in y, free in theta", {}, lambda seed: jf.identify(freq, jf.pollute(pin, 0.05, seed=seed), dofs)
    )


def _at_six_dofs() -> Iterator[_Timed]:
    """Two beams with six joint DOFs, 600 lines."""
    freq, dofs = six_dof_beams.FREQ, six_dof_beams.DOFS
    diagonal, full = six_dof_beams.assembly(), six_dof_beams.assembly(six_dof_beams.FULL)
    yield _Timed(
        "6 joint DOFs, 600 lines, 5 % noise", _stiffnesses(six_dof_beams.JOINT),
        lambda seed: jf.identify(freq, jf.pollute(diagonal, 0.05, seed=seed), dofs),
    )  # fmt: skip
    for name, damping in (("damping chosen", "auto"), ("viscous damping", "viscous")):
        yield _Timed(
            f"full 6 x 6 joint, 600 lines, 1 % noise, {name}", _stiffnesses(six_dof_beams.FULL),
            lambda seed, damping=damping: jf.identify(
                freq, jf.pollute(full, 0.01, seed=seed), dofs, cross="fit", damping=damping
            ),
        )  # fmt: skip


def _at_virtual_points() -> Iterator[_Timed]:
    """A hammer test of 24 x 24 FRFs, 123 lines, 1 % noise, from the FRFs at the virtual points on."""
    nodes = [[node for pair in (hammer_test.SENSORS, hammer_test.IMPACTS)
              for node in range(pair[side][0], pair[side][1] + 1)] for side in (0, 1)]  # fmt: skip

    def fit(seed: int, cross: CrossTerms) -> jf.Fit:
        frfs = hammer_test.noisy(hammer_test.hammer_test(), seed=seed).receptance()
        found = jf.joint_channels(frfs, jf.places_of_nodes(frfs, *nodes), POINT, DOFS)
        return jf.identify(frfs.freq_hz, found.gamma(frfs), transform=(found.responses, found.forces), cross=cross)

    truth = _stiffnesses(hammer_test.JOINT)
    yield _Timed("24 x 24 FRFs through virtual points, 123 lines", truth, lambda seed: fit(seed, "zero"))
    yield _Timed("the same, full 6 x 6 joint", truth, lambda seed: fit(seed, "fit"))


def _with_models() -> Iterator[_Timed]:
    """Case 3.3, and two brick beams, by models of the parts."""
    for name, channels in _CHANNELS.items():
        exact, believed, truth = _two_beams(channels)
        yield _Timed(
            f"models, case 3.3, {name}", truth,
            lambda seed, exact=exact, believed=believed, channels=channels: jf.identify_model(
                np.arange(15.0, 801.0), jf.pollute(exact, 0.05, seed=seed), believed, channels, channels
            ),
        )  # fmt: skip
    yield _Timed("models, two bars of bricks, 600 lines, 20 FRFs, 20 unknowns", *_bricks())


def _stiffnesses(joint: jf.Joint) -> dict[str, float]:
    return {f"k_{dof}": float(value) for dof, value in zip(joint.dofs, joint.stiffness.diagonal(), strict=True)}


def _two_beams(
    channels: tuple[str, ...], joint: jf.Joint | None = None
) -> tuple[np.ndarray, jf.Assembly, dict[str, float]]:
    """Case 3.3 with exact models, or another joint: FRFs, the assembly as believed, the joint of the case."""
    parts = (
        jf.Substructure(jf.beam(0.3, 300, ends=("clamped", "free"), **_SECTION), ["301:y", "301:theta"], exact=True),
        jf.Substructure(jf.beam(0.225, 225, **_SECTION), ["1:y", "1:theta"], exact=True),
    )
    truth = jf.Assembly(*parts, joint or jf.Joint([6e5, 5e3], [20, 1.5], ["y", "theta"]))
    believed = jf.Assembly(*parts, jf.Joint([1e5, 1e3], [5, 0.5], ["y", "theta"]))
    exact = truth.receptance(np.arange(15.0, 801.0), channels, channels)
    return exact, believed, {"k_y": 6e5, "k_theta": 5e3, "c_y": 20.0, "c_theta": 1.5}


def _bar(length: float, clamped: bool, material: jf.Material, divisions: tuple[int, int, int] = (5, 2, 88)) -> jf.Model:
    """Brick beam with a joint at one end and observed sections along it."""
    return jf.brick_beam(
        length, 0.025, 0.006, material, divisions=divisions,
        ends=("clamped" if clamped else "free", "free"), sections={"joint": length if clamped else 0.0},
        observed={f"p{i}": length * i / 5 for i in ((1, 2, 3, 4) if clamped else (2, 3, 5))},
    )  # fmt: skip


def _bricks() -> tuple[dict[str, float], Callable[[int], jf.Fit]]:
    """Two brick beams, six joint DOFs; moduli, densities, loss factors and two sensors unknown."""
    freq, ports = np.linspace(5.0, 900.0, 600), [f"joint:{dof}" for dof in DOFS]
    outputs, forces = ["A/p4:x", "A/p4:y", "B/p5:x", "B/p5:y", "B/p5:z"], ["A/p3:x", "A/p3:y", "B/p5:x", "B/p5:z"]
    unknown = {
        "youngs_modulus": jf.Unknown(67e9, 0.02 * 67e9),
        "density": jf.Unknown(2700.0, 27.0),
        "loss_factor": jf.Unknown(0.008, 0.005, lower=1e-4),
    }

    def beams(youngs_modulus: float, loss_factor: float, unknowns: dict[str, jf.Unknown]) -> list[jf.Substructure]:
        material = jf.Material(youngs_modulus, 0.33, 2700.0, loss_factor)
        return [
            jf.Substructure(_bar(*own, material), ports, unknowns, exact=True) for own in ((0.3, True), (0.2, False))
        ]

    sensors = [jf.AddedMass("A/p4:y", 0.003), jf.AddedMass("B/p5:y", 0.002)]
    truth = jf.Assembly(*beams(1.01 * 67e9, 0.01, {}), jf.Joint(*_TRUE, list(DOFS)), sensors)
    exact = truth.receptance(freq, outputs, forces)
    masses = [jf.AddedMass(at, jf.Unknown(0.002, 0.002)) for at in ("A/p4:y", "B/p5:y")]
    believed = jf.Assembly(*beams(67e9, 0.008, unknown), jf.Joint(*_GUESS, list(DOFS)), masses)

    def fit(seed: int) -> jf.Fit:
        return jf.identify_model(freq, jf.pollute(exact, 0.02, seed=seed), believed, outputs, forces)

    return dict(zip([f"k_{dof}" for dof in DOFS], _TRUE[0], strict=True)), fit


def _time_large(divisions: tuple[int, int, int]) -> None:
    """Fit six stiffnesses, their damping, E and density of two parts of bricks: 16 responses, 4 forces, 800 lines."""
    freq, ports = np.linspace(5.0, 900.0, 800), [f"joint:{dof}" for dof in DOFS]
    places = [*(f"A/p{i}" for i in (1, 2, 3, 4)), *(f"B/p{i}" for i in (2, 3, 5))]
    outputs = [*(f"{place}:{axis}" for place in places for axis in "yz"), "A/p4:x", "B/p5:x"]
    forces = ["A/p3:x", "A/p3:y", "B/p5:x", "B/p5:z"]
    material = jf.Material(67e9, 0.33, 2700.0, 0.01)
    models = [_bar(*own, material, divisions) for own in ((0.3, True), (0.2, False))]
    truth = [jf.Substructure(model, ports, exact=True) for model in models]
    exact = jf.Assembly(*truth, jf.Joint(*_TRUE, list(DOFS))).receptance(freq, outputs, forces)
    unknown = {"youngs_modulus": jf.Unknown(1.0, 0.02), "density": jf.Unknown(1.0, 0.01)}
    parts = [jf.Substructure(model, ports, unknown) for model in models]
    believed = jf.Assembly(*parts, jf.Joint(*_GUESS, list(DOFS)))
    spent = _Spent()
    with warnings.catch_warnings(), spent.of_reductions():
        warnings.simplefilter("ignore")
        wall, cpu = time.perf_counter(), time.process_time()
        found = jf.identify_model(freq, jf.pollute(exact, 0.02, seed=0), believed, outputs, forces)
        fitted = time.perf_counter() - wall
        found.confidence_interval(0.95)
        whole = time.perf_counter() - wall, time.process_time() - cpu
    errors = [abs(found.value[f"k_{d}"] - k) / found.std_error[f"k_{d}"] for d, k in zip(DOFS, _TRUE[0], strict=True)]
    print(
        f"{len(models[0].dofs)} and {len(models[1].dofs)} DOFs: {whole[0]:.1f} s, {whole[1]:.1f} CPU s; reduction "
        f"{spent.seconds:.1f} s, fit {fitted - spent.seconds:.1f} s, intervals {whole[0] - fitted:.1f} s; "
        f"largest error of a stiffness {max(errors):.1f} standard errors",
        flush=True,
    )


class _Spent:
    """Seconds spent in reductions of models."""

    def __init__(self) -> None:
        self.seconds = 0.0

    @contextlib.contextmanager
    def of_reductions(self) -> Iterator[None]:
        own = ReducedSubstructure.__init__

        def timed(part: ReducedSubstructure, *args: Any) -> None:
            start = time.perf_counter()
            own(part, *args)
            self.seconds += time.perf_counter() - start

        with unittest.mock.patch.object(ReducedSubstructure, "__init__", timed):
            yield


if __name__ == "__main__":
    raise SystemExit(main())
