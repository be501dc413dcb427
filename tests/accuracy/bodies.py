"""Pairs of bodies of bricks with a known joint between patches of their surfaces, and channels around it."""

from __future__ import annotations

import copy
from dataclasses import dataclass, field

import numpy as np
from scipy import sparse
from scipy.linalg import eigh

import jointfrf as jf
from jointfrf.dofs import DIRECTIONS
from jointfrf.workbench.solids.mesh import Mesh
from jointfrf.workbench.solids.solid import mean_motion, solid_model

__all__ = ["Body", "ModalModel", "Pair", "pair"]

#: Kinds of bodies on side j and side k, in turn.
KINDS = (
    ("beam", "block"), ("beam", "beam"), ("block", "block"), ("block", "plate"), ("lap", "lap"), ("bracket", "block"),
    ("bracket", "plate"), ("beam", "plate"), ("lap", "block"), ("bracket", "bracket"), ("plate", "plate"),
    ("beam", "lap"),
)  # fmt: skip
STEEL, ALUMINIUM = jf.Material(210e9, 0.3, 7850.0, 0.004), jf.Material(70e9, 0.33, 2700.0, 0.003)
#: Noise of every FRF.
NOISE = 0.01


@dataclass(frozen=True, kw_only=True)
class ModalModel(jf.Model):
    """A body by its modes: modal stiffness and mass, and what named ports see of the modes."""

    shapes: dict[str, np.ndarray] = field(repr=False)

    def ports(self, *names: str) -> np.ndarray:
        """Return the modes at named ports, shape (m, n)."""
        return np.array([self.shapes[name] for name in names])


class Body:
    """A free body whose face at y = 0 has a patch about the origin, which the joint holds by its mean motion."""

    def __init__(self, mesh: Mesh, material: jf.Material, patch: np.ndarray) -> None:
        self.mesh, self.loss_factor = mesh, material.loss_factor
        model = solid_model(mesh, material)
        self.squared, self.shapes = eigh(model.stiffness.toarray(), model.mass.toarray())
        self.squared[:6] = 0
        self.joint = np.asarray(mean_motion(mesh, jf.Patch(np.zeros(3), patch)) @ self.shapes)

    @property
    def first_hz(self) -> float:
        """First elastic mode."""
        return float(np.sqrt(self.squared[6]) / (2 * np.pi))

    def channels(self, nodes: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the modes at channels, shape (m, n)."""
        return np.einsum("mi,mik->mk", directions, self.shapes.reshape(-1, 3, self.squared.size)[nodes])

    def receptance(self, omega: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Return receptances by all modes."""
        modal = 1 / (self.squared * (1 + 1j * self.loss_factor) - omega[:, None] ** 2)
        return (rows * modal[:, None]) @ rows.T

    def model(self, named: dict[str, np.ndarray]) -> ModalModel:
        """Return it as a model with named ports."""
        n = self.squared.size
        dofs = tuple(f"{i + 1}:q" for i in range(n))
        return ModalModel(
            stiffness=sparse.diags_array(self.squared).tocsr(),
            mass=sparse.eye_array(n, format="csr"),
            dofs=dofs,
            loss_factor=self.loss_factor,
            shapes=named,
        )

    def changed(self, eigenvalues: np.ndarray | float = 1.0, density: float = 1.0) -> Body:
        """Return the same with other eigenvalues of elastic modes (as by Young's modulus), and another density."""
        other = copy.copy(self)
        other.squared = self.squared * eigenvalues / density
        other.shapes, other.joint = self.shapes / np.sqrt(density), self.joint / np.sqrt(density)
        return other

    @property
    def surface(self) -> np.ndarray:
        """Nodes of the surface that are not on the face of the joint, the nearest to the joint first."""
        nodes = np.unique(self.mesh.faces()[0])
        places = self.mesh.nodes[nodes]
        apart = abs(places[:, 1]) > 1e-9
        return nodes[apart][np.argsort(np.linalg.norm(places[apart], axis=1), kind="stable")]


def bricks(x: np.ndarray, y: np.ndarray, z: np.ndarray, kept=None) -> Mesh:
    """Bricks of a grid, of those whose centres are kept."""
    shape = y.size, z.size, x.size
    number = np.arange(np.prod(shape)).reshape(shape)
    nodes = np.stack(np.meshgrid(y, z, x, indexing="ij"), -1).reshape(-1, 3)[:, [2, 0, 1]]
    corners = [number[:, :-1, :-1], number[:, 1:, :-1], number[:, 1:, 1:], number[:, :-1, 1:]]
    quads = np.stack(corners, -1)
    elements = np.concatenate([quads[:-1], quads[1:]], -1).reshape(-1, 8)
    if kept is not None:
        elements = elements[kept(nodes[elements].mean(axis=1))]
    used = np.unique(elements)
    place = np.full(len(nodes), -1)
    place[used] = np.arange(used.size)
    return Mesh(nodes[used], place[elements].astype(np.int32))


def body(kind: str, rng: np.random.Generator, *, turned: bool) -> Body:
    """Return a body of a kind with random sizes; turned about x, its joint face looks the other way."""
    between = rng.uniform
    material = STEEL if rng.random() < 0.4 else ALUMINIUM

    def line(low: float, high: float, count: int) -> np.ndarray:
        return np.linspace(low, high, count + 1)

    def centred(width: float, count: int) -> np.ndarray:
        return line(-width / 2, width / 2, count)

    kept = None
    if kind == "beam":
        b, c, length = between(0.04, 0.1), between(0.04, 0.1), between(0.15, 0.4)
        grid = centred(b, 4), line(0, length, 12), centred(c, 4)
        reach = 0.51 * b * (1 if rng.random() < 0.5 else 0.5)
    elif kind == "block":
        b, c, length = between(0.06, 0.12), between(0.06, 0.12), between(0.05, 0.12)
        grid = centred(b, 6), line(0, length, 6), centred(c, 6)
        reach = b * rng.choice([0.17, 0.34, 0.51])
    elif kind == "plate":
        b, c, t = between(0.12, 0.3), between(0.12, 0.3), between(0.008, 0.025)
        grid = centred(b, 10), line(0, t, 2), centred(c, 10)
        reach = b * rng.choice([0.11, 0.21])
    elif kind == "lap":
        w, t, length, half = between(0.025, 0.06), between(0.006, 0.015), between(0.15, 0.35), between(0.02, 0.04)
        z = np.concatenate([line(-half, half, 8)[:-1], line(half, length - half, 12)])
        grid = centred(w, 6), line(0, t, 2), z
        reach = min(w, 2 * half) * rng.choice([0.34, 0.51])
    else:  # bracket
        w, t, length, height = between(0.04, 0.08), between(0.01, 0.02), between(0.08, 0.15), between(0.08, 0.15)
        z = np.concatenate([centred(w, 6)[:-1], line(w / 2, length, 4)[:-1], line(length, length + t, 2)])
        grid = centred(w, 6), np.concatenate([line(0, t, 2)[:-1], line(t, height, 6)]), z
        reach = w * rng.choice([0.17, 0.34])

        def kept(centres: np.ndarray) -> np.ndarray:
            return (centres[:, 1] < t) | (centres[:, 2] > length)

    mesh = bricks(*grid, kept)
    half_z = grid[2][: len(grid[2]) // 2]
    reach = max(reach, 1.01 * max(np.diff(grid[0]).max(), np.diff(half_z).max()))
    at = abs(mesh.nodes) < np.array([reach, 1e-9, reach]) + 1e-9
    patch = np.flatnonzero(at.all(axis=1)).astype(np.int32)
    if min(np.ptp(mesh.nodes[patch][:, axis]) for axis in (0, 2)) == 0:
        raise ValueError("the patch holds no rotation")
    if turned:
        mesh = Mesh(mesh.nodes * [1, -1, -1], mesh.elements)
    return Body(mesh, material, patch)


@dataclass(frozen=True)
class Channels:
    """Sensors, or impacts, on a body."""

    nodes: np.ndarray
    directions: np.ndarray
    point: jf.VirtualPoint


def channels_on(own: Body, nodes: np.ndarray, directions: np.ndarray) -> Channels:
    """Return channels with their virtual point at the joint; ValueError where they show it badly."""
    point = jf.virtual_point(own.mesh.nodes[nodes], directions, np.zeros(3))
    if point.condition > 40:
        raise ValueError("badly placed")
    return Channels(nodes, directions, point)


def _spread(places: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return places far from one another."""
    kept = [int(rng.integers(len(places)))]
    far = np.linalg.norm(places - places[kept[0]], axis=1)
    while len(kept) < count:
        kept.append(int(np.argmax(far + 1e-6 * rng.random(len(far)))))
        far = np.minimum(far, np.linalg.norm(places - places[kept[-1]], axis=1))
    return np.array(kept)


def _ring(own: Body, some: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return four nodes around the joint, mirrored along x and z, as textbooks advise."""
    place = own.mesh.nodes[rng.choice(some)]
    mirrored = place * np.array([[1, 1, 1], [-1, 1, 1], [1, 1, -1], [-1, 1, -1]])
    apart = np.linalg.norm(own.mesh.nodes[:, None] - mirrored, axis=2)
    at = np.unique(apart.argmin(axis=0))
    if at.size < 4 or apart.min(axis=0).max() > 1e-9:
        raise ValueError("no ring there")
    return at


def layout(
    own: Body, rng: np.random.Generator, reach: str, sensors: int, impacts: int, *, same: bool
) -> tuple[Channels, Channels]:
    """Return triaxial sensors, and impacts along axes (on glued blocks) or at the sensors, near the joint or far."""
    nodes = own.surface
    low, high = {"near": (0, 0.3), "middle": (0, 0.6), "far": (0.3, 1)}[reach]
    some = nodes[int(low * nodes.size) : max(int(high * nodes.size), 12)]
    is_ring = rng.random() < 0.35
    for _ in range(300):
        try:
            at = _ring(own, some, rng) if is_ring else some[_spread(own.mesh.nodes[some], sensors, rng)]
            found = channels_on(own, np.repeat(at, 3), np.tile(np.eye(3), (at.size, 1)))
            if same:
                return found, found
            struck = some[_spread(own.mesh.nodes[some], impacts, rng)]
            axes = rng.permutation(np.arange(impacts) % 3)
            return found, channels_on(own, struck, np.eye(3)[axes])
        except ValueError:
            continue
    raise ValueError("no good places for channels")


@dataclass(frozen=True)
class Pair:
    """Two bodies with a joint, as measured.

    Attributes
    ----------
    kinds : tuple of str
    bodies : tuple of Body
    channels : for each body its sensors and impacts
    freq_hz : ndarray
    compliance : ndarray, shape (6,)
        C of the joint, real part.
    sides : ndarray, shape (6,)
        D0, the static compliance of the sides between channels and joint.
    exact, noisy : ndarray, shape (n_freq, m_r, m_f)
    reach : str
    band : float
        Upper end over the first elastic mode.
    """

    kinds: tuple[str, str]
    bodies: tuple[Body, Body]
    channels: tuple[tuple[Channels, Channels], ...]
    freq_hz: np.ndarray
    compliance: np.ndarray
    sides: np.ndarray
    exact: np.ndarray
    noisy: np.ndarray
    reach: str
    band: float

    @property
    def omega(self) -> np.ndarray:
        """rad/s."""
        return 2 * np.pi * self.freq_hz

    @property
    def transform(self) -> tuple[jf.Interface, jf.Interface]:
        """From responses and from forces to the joint."""
        one, other = (jf.virtual_interface(*(own[i].point for own in self.channels)) for i in (0, 1))
        return (one, one) if all(own[0] is own[1] for own in self.channels) else (one, other)

    def model(self, side: int, changed: Body | None = None) -> tuple[ModalModel, list[str], list[str], list[str]]:
        """Return a model of a side with the names of its joint DOFs, responses and forces."""
        own = self.bodies[side] if changed is None else changed
        named = {f"joint:{d}": row for d, row in zip(DIRECTIONS, own.joint, strict=True)}
        names: list[list[str]] = [list(named)]
        for what, channels in zip("uf", self.channels[side], strict=True):
            rows = own.channels(channels.nodes, channels.directions)
            names.append([f"{i + 1}:{what}" for i in range(len(rows))])
            named |= dict(zip(names[-1], rows, strict=True))
        return own.model(named), *names


def receptances(bodies, channels, omega: np.ndarray, compliance: np.ndarray) -> np.ndarray:
    """FRFs of all channels of two bodies coupled by a joint of this compliance (n_freq, 6, 6)."""
    parts, sizes = [], []
    for own, (sensors, impacts) in zip(bodies, channels, strict=True):
        rows = [own.channels(one.nodes, one.directions) for one in (sensors, impacts)]
        parts.append(own.receptance(omega, np.vstack([own.joint, *rows])))
        sizes.append([len(one) for one in rows])
    coupled = jf.couple(*parts, np.linalg.inv(compliance), range(6), range(6))
    first = len(parts[0][0])
    rows, columns = [], []
    for start, (m_r, m_f) in zip((0, first), sizes, strict=True):
        rows += range(start + 6, start + 6 + m_r)
        columns += range(start + 6 + m_r, start + 6 + m_r + m_f)
    return np.ascontiguousarray(coupled[:, rows][:, :, columns])


def _static(own: Body, sensors: Channels, impacts: Channels) -> tuple[np.ndarray, np.ndarray]:
    """Return D0 of a side, and the static compliance at its joint: elastic modes only."""
    elastic = own.squared[6:]

    def between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return (a[:, 6:] / elastic) @ b[:, 6:].T

    q = own.joint
    c_u = sensors.point.transform @ own.channels(sensors.nodes, sensors.directions)
    c_f = impacts.point.transform @ own.channels(impacts.nodes, impacts.directions)
    return between(q - c_u, q - c_f), between(q, q)


def pair(index: int, seed: int = 0, lines: int = 160) -> Pair:
    """Return member `index` of a family; ValueError where a random layout is of no use."""
    rng = np.random.default_rng([seed, index])
    kinds = KINDS[index % len(KINDS)]
    bodies = tuple(body(kind, rng, turned=turned) for kind, turned in zip(kinds, (False, True), strict=True))
    reach = ("near", "middle", "far")[rng.choice(3, p=[0.4, 0.4, 0.2])]
    sensors, impacts = int(rng.choice([3, 4, 6])), int(rng.choice([9, 12, 16]))
    same = bool(rng.random() < 0.3)
    channels = tuple(layout(own, rng, reach, sensors, impacts, same=same) for own in bodies)
    band = float(rng.choice([0.6, 1.0, 1.5, 2.0]))
    freq = np.linspace(0.05, band, lines) * min(own.first_hz for own in bodies)
    both = [_static(own, *c) for own, c in zip(bodies, channels, strict=True)]
    sides, whole = (sum(own) for own in zip(*both, strict=True))
    size = abs(np.diagonal(sides)) + 0.02 * np.diagonal(whole)
    share = 10 ** rng.uniform(-1.7, 1) * 10 ** rng.uniform(-0.3, 0.3, 6)
    compliance = size / share
    omega = 2 * np.pi * freq
    c = np.broadcast_to(np.diag(compliance / (1 + 0.01j)), (lines, 6, 6))
    exact = receptances(bodies, channels, omega, c)
    noisy = jf.pollute(exact, NOISE, seed=int(rng.integers(2**31)))
    real = np.diagonal(c[0]).real
    return Pair(kinds, bodies, channels, freq, real, np.diagonal(sides), exact, noisy, reach, band)
