"""Hammer tests on virtual points of many kinds, and one fault in each: bodies, sensors, impacts, joint by a seed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, lru_cache

import numpy as np

import jointfrf as jf
from deforming_blocks import block
from jointfrf.channels.joint_channels import joint_channels_of_all
from jointfrf.dofs import DIRECTIONS
from jointfrf.io import Channel, FrfSet
from rigid_bodies import Body, along, six

_AXES = "xyz"
#: Kinds of bodies: no mode, modes above the band, modes inside it, blocks of bricks.
BODIES = ("rigid", "stiff", "flexible", "bricks")
#: Where the joint is, m: away from the origin, so that a scale of coordinates shows.
JOINT_AT = np.array([0.12, 0.05, 0.08])
N_LINES = 120


@dataclass(frozen=True)
class SimulatedTest:
    """FRFs of sensors and impacts around a joint; which of them are on which side; where its reference point is."""

    frfs: FrfSet
    nodes: tuple[list[int], list[int]]
    at: np.ndarray

    def check(self) -> jf.FrfCheck:
        """Look at it as the command line does."""
        places = jf.places_of_nodes(self.frfs, *self.nodes)
        joint = joint_channels_of_all(self.frfs, places, self.at)
        h = self.frfs.matrix(joint.responses.channels, joint.forces.channels, allow_missing=True)
        return jf.check_frfs(self.frfs.freq_hz, h, joint=joint)


@lru_cache(4)
def simulated_test(seed: int) -> SimulatedTest:
    """A test without a fault: kind of bodies, places, band, joint and noise are drawn."""
    rng = np.random.default_rng(seed)
    kind = BODIES[seed % len(BODIES)]
    n_sensors, n_impacts = int(rng.integers(3, 6)), int(rng.integers(12, 17))
    top = float(rng.uniform(400, 1500))
    freq = np.linspace(top / 40, top, N_LINES)
    sides = [_good_points(rng, kind, sign, n_sensors, n_impacts) for sign in (-1, 1)]
    if kind == "bricks":
        parts = [_brick_part(i, side, tuple(freq)) for i, side in enumerate(sides)]
    else:
        parts = [_modal_part(rng, kind, sign, side, freq) for sign, side in zip((-1, 1), sides, strict=True)]
    stiffness = np.array([3e6] * 3 + [3e3] * 3) * 10 ** rng.uniform(-0.7, 1, 6)
    joint = jf.Joint(stiffness, 2e-5 * stiffness, DIRECTIONS)
    h = jf.couple(*parts, joint.dynamic_stiffness(freq), range(6), range(6))
    m = 3 * n_sensors
    size = 6 + m + n_impacts
    rows = [*range(6, 6 + m), *range(size + 6, size + 6 + m)]
    columns = [*range(6 + m, size), *range(size + 6 + m, 2 * size)]
    h = h[:, rows][:, :, columns] * (2j * np.pi * freq[:, None, None]) ** 2
    level = 10 ** rng.uniform(-2.3, -1.5)
    floor = level * np.median(abs(h), axis=0, keepdims=True)
    noise = (rng.standard_normal(h.shape) + 1j * rng.standard_normal(h.shape)) / np.sqrt(2)
    h = h + (level * abs(h) + 0.3 * floor) * noise
    responses, excitations, coordinates, nodes = [], [], {}, ([], [])
    for i, side in enumerate(sides):
        for kind_of, first, places in (("s", 101, side.sensors), ("i", 151, side.impacts)):
            for number, place in enumerate(places):
                node = 100 * i + first + number
                coordinates[node] = place + JOINT_AT
                nodes[i].append(node)
                if kind_of == "s":
                    responses += [Channel(node, f"+{axis}") for axis in _AXES]
                else:
                    excitations.append(Channel(node, side.directions[number]))
    frfs = FrfSet(freq, tuple(responses), tuple(excitations), h, "accelerance", coordinates, "test")
    return SimulatedTest(frfs.receptance(), nodes, JOINT_AT.copy())


@dataclass(frozen=True)
class _Side:
    """Places about the joint, m: of triaxial sensors, and of impacts with their directions."""

    sensors: np.ndarray
    impacts: np.ndarray
    directions: list[str]


def _good_points(rng: np.random.Generator, kind: str, sign: int, n_sensors: int, n_impacts: int) -> _Side:
    """Points as somebody chooses them who wants to see all six motions: drawn until the condition is below 20."""
    while True:
        side = _points(rng, kind, sign, n_sensors, n_impacts)
        groups = _loads(side)[6 : 6 + 3 * n_sensors], _loads(side)[6 + 3 * n_sensors :]
        if all(_condition(group) < 20 for group in groups):
            return side


def _condition(channels: list) -> float:
    arms = np.array([channel.place for channel in channels])
    arms = (arms - arms.mean(axis=0)) / np.sqrt(((arms - arms.mean(axis=0)) ** 2).sum(axis=1).mean())
    axes = np.array([channel.axis for channel in channels])
    return float(np.linalg.cond(np.hstack([axes, np.cross(arms, axes)])))


def _points(rng: np.random.Generator, kind: str, sign: int, n_sensors: int, n_impacts: int) -> _Side:
    """Sensors and impacts on the faces of a block that begins at the joint: along x, of bricks along z."""
    directions = [f"{rng.choice(['+', '-'])}{_AXES[i % 3]}" for i in range(n_impacts)]
    if kind == "bricks":
        z = sign * 0.02 * np.arange(1, 4)
        grid = np.array([(a, b, c) for a in (-0.04, 0.0, 0.04) for b in (-0.03, 0.03) for c in z])
        sensors = grid[rng.permutation(len(grid))[:n_sensors]]
        return _Side(sensors, grid[rng.integers(0, len(grid), n_impacts)], directions)
    # n points about the joint at least 15 mm apart: a sensor takes place
    sensors: list[np.ndarray] = []
    while len(sensors) < n_sensors:
        place = np.array([sign * rng.uniform(0.01, 0.06), rng.uniform(-0.04, 0.04), rng.choice([-0.03, 0.03])])
        if all(np.linalg.norm(place - other) > 0.02 for other in sensors):
            sensors.append(place)
    impacts = np.column_stack(
        [
            sign * rng.uniform(0.0, 0.07, n_impacts),
            rng.uniform(-0.04, 0.04, n_impacts),
            rng.choice([-0.03, 0.03], n_impacts),
        ]
    )
    return _Side(np.array(sensors), impacts, directions)


def _loads(side: _Side) -> list:
    """Joint DOFs, sensors, impacts of a body."""
    seen = along(np.repeat(side.sensors, 3, axis=0), np.tile(np.eye(3), (len(side.sensors), 1)))
    axes = [float(f"{d[0]}1") * np.eye(3)[_AXES.index(d[1])] for d in side.directions]
    return [*six(np.zeros(3)), *seen, *along(side.impacts, axes)]


def _modal_part(rng: np.random.Generator, kind: str, sign: int, side: _Side, freq: np.ndarray) -> np.ndarray:
    """A free block with modes whose shapes are polynomials of second and third degree: bending, twisting, shear."""
    mass, size = rng.uniform(1, 4), np.array([0.15, 0.08, 0.06]) * rng.uniform(0.8, 1.5)
    inertia = (
        mass / 12 * np.diag([size[1] ** 2 + size[2] ** 2, size[0] ** 2 + size[2] ** 2, size[0] ** 2 + size[1] ** 2])
    )
    body = Body(mass, inertia, np.array([sign * size[0] / 2, 0.0, 0.0]))
    loads = _loads(side)
    modes = []
    low, high = {"rigid": (1.0, 1.0), "stiff": (1.5, 5.0), "flexible": (0.5, 3.0)}[kind]
    for _ in range(0 if kind == "rigid" else 6):
        # modal mass 1: the mean square of such a shape over a block is 3 (3/5 + 6/9)
        weights = rng.standard_normal((3, 3, 3)) / np.sqrt(3.8 * mass)
        shape = np.array([_shape(load, body.centre, size, weights) for load in loads])
        modes.append((rng.uniform(low, high) * freq[-1], shape, shape))
    return body.receptance(freq, loads, loads, modes, loss_factor=0.01)


def _shape(load, centre: np.ndarray, size: np.ndarray, weights: np.ndarray) -> float:
    """What a mode u = W_a (x_i x_j) of squares, whose turn is half its curl, shows at a channel."""
    x = 2 * (load.place - centre) / size
    if not load.rotation:
        return float(load.axis @ np.einsum("aij,i,j->a", weights, x, x))
    gradient = np.einsum("aij,j->ai", weights + weights.swapaxes(1, 2), x) * 2 / size
    turn = 0.5 * np.array(
        [gradient[2, 1] - gradient[1, 2], gradient[0, 2] - gradient[2, 0], gradient[1, 0] - gradient[0, 1]]
    )
    return float(load.axis @ turn)


@cache
def _blocks():
    return block(-0.12, 0.0), block(0.0, 0.1)


def _brick_part(number: int, side: _Side, freq: tuple[float, ...]) -> np.ndarray:
    """A block of aluminium bricks."""
    model = _blocks()[number]
    seen = [f"{model.mesh.near(place) + 1}:{axis}" for place in side.sensors for axis in _AXES]
    hit = [f"{model.mesh.near(place) + 1}:{d[1]}" for place, d in zip(side.impacts, side.directions, strict=True)]
    names = list(dict.fromkeys([*(f"joint:{d}" for d in DIRECTIONS), *seen, *hit]))
    h = model.receptance(freq, model.ports(*names))
    at = [*range(6), *(names.index(name) for name in (*seen, *hit))]
    signs = np.array([1.0] * (6 + len(seen)) + [float(f"{d[0]}1") for d in side.directions])
    return np.ascontiguousarray(h[:, at][:, :, at] * np.outer(signs, signs))


#: What a check must name: codes of the finding, and words of its message or channels, each of which must be there.
Named = tuple[tuple[str, ...], tuple[str, ...]]
Fault = Callable[[np.random.Generator, SimulatedTest], tuple[SimulatedTest, Named]]


def _channel(rng: np.random.Generator, test: SimulatedTest, axis: int) -> tuple[int, str]:
    """One response (axis 1) or force (axis 2), and its name."""
    own = test.frfs.responses if axis == 1 else test.frfs.excitations
    i = int(rng.integers(len(own)))
    return i, f"{'response' if axis == 1 else 'force'} {own[i]}"


def _changed(test: SimulatedTest, h: np.ndarray, **more) -> SimulatedTest:
    return replace(test, frfs=replace(test.frfs, h=h, **more))


def _times(axis: int, factor: Callable[[np.random.Generator], float], codes: tuple[str, ...]) -> Fault:
    """A channel times a factor."""

    def fault(rng, test):
        i, name = _channel(rng, test, axis)
        h = test.frfs.h.copy()
        h.swapaxes(1, axis)[:, i] *= factor(rng)
        return _changed(test, h), (codes, (name,))

    return fault


def _same_side(rng: np.random.Generator, test: SimulatedTest, axis: int) -> tuple[int, int]:
    """Two channels of one side."""
    own = test.frfs.responses if axis == 1 else test.frfs.excitations
    nodes = test.nodes[int(rng.integers(2))]
    side = [i for i, channel in enumerate(own) if channel.node in nodes]
    i, j = rng.permutation(side)[:2]
    return int(i), int(j)


def _swapped(axis: int) -> Fault:
    """Two channels of a side have each other's cables."""

    def fault(rng, test):
        i, j = _same_side(rng, test, axis)
        own = test.frfs.responses if axis == 1 else test.frfs.excitations
        h = test.frfs.h.copy()
        across = h.swapaxes(1, axis)
        across[:, [i, j]] = across[:, [j, i]]
        return _changed(test, h), (("exchanged-channels",), (str(own[i]), str(own[j])))

    return fault


def _sensor_turned(rng, test):
    """A sensor is turned about one of its axes by a quarter."""
    node = test.frfs.responses[int(rng.integers(len(test.frfs.responses)))].node
    x, y, z = (3 * (next(i for i, c in enumerate(test.frfs.responses) if c.node == node) // 3) + k for k in range(3))
    a, b, _ = rng.permutation([x, y, z])
    h = test.frfs.h.copy()
    h[:, [a, b]] = h[:, [b, a]]
    h[:, b] *= -1
    return _changed(test, h), (("channel-direction", "exchanged-channels", "channel-place"), (str(node),))


def _wrong_place(rng, test):
    """A coordinate of a sensor has the wrong sign, measured from the joint: some 6 cm off, at least 4."""
    nodes = sorted({channel.node for channel in test.frfs.responses})
    off = {n: 2 * abs(test.frfs.coordinates[n] - test.at) for n in nodes}
    able = [(n, a) for n in nodes for a in range(3) if off[n][a] >= 0.04]
    node, axis = able[int(rng.integers(len(able)))]
    places = {n: np.array(p) for n, p in test.frfs.coordinates.items()}
    places[node][axis] = 2 * test.at[axis] - places[node][axis]
    return _changed(test, test.frfs.h, coordinates=places), (("channel-place", "channel-direction"), (str(node),))


def _impact_along(rng, test):
    """An impact was along another axis than its name says."""
    i, _ = _channel(rng, test, 2)
    own = list(test.frfs.excitations)
    word = own[i].direction
    own[i] = Channel(own[i].node, word[0] + "xyz"[("xyz".index(word[1]) + 1 + int(rng.integers(2))) % 3])
    found = _changed(test, test.frfs.h, excitations=tuple(own))
    return found, (("channel-direction", "channel-place"), (f"force {own[i]}",))


def _copied(rng, test):
    """A response shows what another one of its side shows, with noise of its own."""
    i, j = _same_side(rng, test, 1)
    h = test.frfs.h.copy()
    noise = rng.standard_normal(h[:, i].shape) + 1j * rng.standard_normal(h[:, i].shape)
    h[:, i] = h[:, j] * (1 + 0.01 * noise)
    codes = ("doubled-channel", "channel-place", "channel-direction", "channel-sign", "channel-gain", "channel-unit")
    return _changed(test, h), (codes, (f"response {test.frfs.responses[i]}",))


def _power_of(axis: int, power: int) -> Fault:
    """A channel times a power of i w."""

    def fault(rng, test):
        i, name = _channel(rng, test, axis)
        h = test.frfs.h.copy()
        h.swapaxes(1, axis)[:, i] *= ((2j * np.pi * test.frfs.freq_hz) ** power)[:, None]
        return _changed(test, h), (("quantity",), (name,))

    return fault


def _taken_for(power: int) -> Fault:
    """All FRFs have been read as another quantity: they are (i w)^power times receptances."""

    def fault(rng, test):
        h = test.frfs.h * ((2j * np.pi * test.frfs.freq_hz) ** power)[:, None, None]
        words = {-1: "receptances divided by i w", -2: "by (i w)^2", 1: "mobilities", 2: "accelerances"}[power]
        return _changed(test, h), (("quantity",), (words,))

    return fault


def _side_times(factor: float, codes: tuple[str, ...]) -> Fault:
    """All responses of one side times a factor."""

    def fault(rng, test):
        side = int(rng.integers(2))
        h = test.frfs.h.copy()
        h[:, [c.node in test.nodes[side] for c in test.frfs.responses]] *= factor
        return _changed(test, h), (codes, ("side",))

    return fault


def _dead(axis: int) -> Fault:
    """A channel holds noise only."""

    def fault(rng, test):
        i, name = _channel(rng, test, axis)
        h = test.frfs.h.copy()
        own = h.swapaxes(1, axis)
        noise = rng.standard_normal(own[:, i].shape) + 1j * rng.standard_normal(own[:, i].shape)
        own[:, i] = np.median(abs(own[:, i])) * noise
        return _changed(test, h), (("dead-channel",), (name,))

    return fault


def _millimetres(rng, test):
    """Coordinates of all nodes in mm, the reference point in m."""
    places = {node: 1e3 * place for node, place in test.frfs.coordinates.items()}
    return _changed(test, test.frfs.h, coordinates=places), (("coordinates-unit",), ("millimetres",))


def _point_in_millimetres(rng, test):
    return replace(test, at=1e3 * test.at), (("coordinates-unit",), ("millimetres",))


def _point_far(rng, test):
    """The reference point is 1 to 3 m away."""
    way = rng.standard_normal(3)
    return replace(test, at=test.at + rng.uniform(1, 3) * way / np.linalg.norm(way)), (
        ("reference-point-far", "coordinates-unit"),
        ("lies",),
    )


def _conjugated(rng, test):
    return _changed(test, test.frfs.h.conj()), (("time-convention",), ())


def _one_missing(rng, test):
    """One FRF is not in the file."""
    h = test.frfs.h.copy()
    i, j = int(rng.integers(h.shape[1])), int(rng.integers(h.shape[2]))
    h[:, i, j] = np.nan
    words = f"{test.frfs.responses[i]} / {test.frfs.excitations[j]}"
    return _changed(test, h), (("missing-frf",), (words,))


def _nan_lines(rng, test):
    """Some lines of a response are NaN."""
    i, name = _channel(rng, test, 1)
    h = test.frfs.h.copy()
    h[7:9, i] = np.nan
    return _changed(test, h), (("not-finite",), (name,))


def _factor(rng: np.random.Generator) -> float:
    """2 to 6, or its inverse."""
    return float(rng.uniform(2, 6) ** rng.choice([-1, 1]))


#: Faults by their names.
FAULTS: dict[str, Fault] = {
    "sign of a sensor": _times(1, lambda rng: -1.0, ("channel-sign",)),
    "sign of an impact": _times(2, lambda rng: -1.0, ("channel-sign",)),
    "sensor x 9.81": _times(1, lambda rng: 9.80665, ("channel-unit",)),
    "sensor / 9.81": _times(1, lambda rng: 1 / 9.80665, ("channel-unit",)),
    "sensor x 1000": _times(1, lambda rng: 1e3, ("channel-unit",)),
    "impacts in lbf": _times(2, lambda rng: 1 / 4.4482216, ("channel-unit",)),
    "gain of a sensor 2 to 6": _times(1, _factor, ("channel-gain", "channel-unit")),
    "gain of an impact 2 to 6": _times(2, _factor, ("channel-gain", "channel-unit")),
    "two responses exchanged": _swapped(1),
    "two impacts exchanged": _swapped(2),
    "sensor turned by 90 degrees": _sensor_turned,
    "sensor at another place": _wrong_place,
    "impact along another axis": _impact_along,
    "response copied from another": _copied,
    "velocity among displacements": _power_of(1, 1),
    "acceleration among displacements": _power_of(1, 2),
    "mobility read as accelerance": _taken_for(-1),
    "receptance read as accelerance": _taken_for(-2),
    "accelerance read as mobility": _taken_for(1),
    "accelerance read as receptance": _taken_for(2),
    "a side in g": _side_times(1 / 9.80665, ("channel-unit",)),
    "a side with the wrong sign": _side_times(-1.0, ("driving-point-sign",)),
    "response noise": _dead(1),
    "impact noise": _dead(2),
    "coordinates in mm": _millimetres,
    "reference point in mm": _point_in_millimetres,
    "reference point far away": _point_far,
    "conjugated": _conjugated,
    "one FRF missing": _one_missing,
    "NaN lines": _nan_lines,
}


@dataclass(frozen=True)
class FaultFound:
    """Whether a fault was named as it is, and how many findings there were."""

    named: bool
    findings: int
    check: jf.FrfCheck


def check_with_fault(name: str, seed: int) -> FaultFound:
    """Put one fault in a simulated test and look at it."""
    test, (codes, words) = FAULTS[name](np.random.default_rng([seed, 1]), simulated_test(seed))
    check = test.check()
    serious = [finding for finding in check.findings if finding.severity != "note"]
    named = any(
        finding.code in codes and all(word in " ".join([*finding.about, finding.text]) for word in words)
        for finding in serious
    )
    return FaultFound(named, len(serious), check)
