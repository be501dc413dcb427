"""Displacements between nodes: linear fields, known places in distorted bricks, touching bodies."""

import numpy as np
import pytest

from jointfrf.workbench.cases.bolted_lap.lap import LapDivisions, bolted_lap
from jointfrf.workbench.solids.mesh import Mesh, extrude, holed_rectangle, interpolation

SIGNS = np.array([[x, y, z] for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


@pytest.fixture(scope="module")
def mesh():
    """A plate with a hole, its inner nodes shaken."""
    plate = extrude((holed_rectangle((0.0, 0.0), (0.02, 0.03, 0.02), (0.004, 0.008), 4, 2), [0, 0.004, 0.01]))
    shaken = plate.nodes.copy()
    middle = abs(plate.nodes[:, 1] - 0.004) < 1e-9
    shaken[middle, 1] += np.random.default_rng(1).uniform(-5e-4, 5e-4, middle.sum())
    return Mesh(shaken, plate.elements)


def inside(mesh, count, seed=0, on_face=False):
    """Places by their own coordinates in random bricks."""
    rng = np.random.default_rng(seed)
    brick = rng.integers(len(mesh.elements), size=count)
    own = rng.uniform(-1, 1, (count, 3))
    if on_face:
        own[np.arange(count), rng.integers(3, size=count)] = rng.choice([-1, 1], size=count)
    weights = (1 + own[:, None, :] * SIGNS).prod(axis=2) / 8
    return np.einsum("pn,pni->pi", weights, mesh.nodes[mesh.elements[brick]]), brick, weights


@pytest.mark.parametrize("on_face", [False, True])
def test_known_places(mesh, on_face):
    points, brick, weights = inside(mesh, 60, on_face=on_face)
    values = np.random.default_rng(2).standard_normal((len(mesh.nodes), 3))
    expected = np.einsum("pn,pni->pi", weights, values[mesh.elements[brick]])
    found = (interpolation(mesh, points) @ values.ravel()).reshape(-1, 3)
    assert abs(found - expected).max() < 1e-8


def test_linear_fields_and_directions(mesh):
    points, _, _ = inside(mesh, 20, seed=5)
    slope = np.random.default_rng(3).standard_normal((3, 3))
    u, exact = (mesh.nodes @ slope.T).ravel(), points @ slope.T
    assert abs(interpolation(mesh, points, "zx") @ u - exact[:, [2, 0]].ravel()).max() < 1e-12
    names = ["x", "y", "z", "y"] * 5
    picked = exact[np.arange(20), ["xyz".index(name) for name in names]]
    assert abs(interpolation(mesh, points, names) @ u - picked).max() < 1e-12
    vectors = np.random.default_rng(4).standard_normal((20, 3))
    along = (exact * vectors).sum(1) / np.linalg.norm(vectors, axis=1)
    assert abs(interpolation(mesh, points, vectors) @ u - along).max() < 1e-12


def test_at_nodes(mesh):
    chosen = [0, 17, len(mesh.nodes) - 1]
    weights = interpolation(mesh, mesh.nodes[chosen]).toarray()
    expected = np.zeros((9, mesh.nodes.size))
    expected[np.arange(9), (3 * np.array(chosen)[:, None] + np.arange(3)).ravel()] = 1
    assert abs(weights - expected).max() < 1e-9


def test_the_body_is_chosen_where_two_touch():
    lap = bolted_lap((0.05, 0.05), divisions=LapDivisions(across=4, rings=1, circles=0))
    point = [[0.010, 0.0, lap.axis[2] + 0.009]]
    for body in ("A", "B"):
        weights = interpolation(lap.mesh, point, "y", elements=lap.elements(body))
        nodes = weights.indices // 3
        assert np.isin(nodes, lap.mesh.elements[lap.elements(body)]).all()
        assert weights.sum() == pytest.approx(1)


def test_refusals(mesh):
    with pytest.raises(ValueError, match=r"points: number 1 at x, y, z = 0, 5, 0 mm lies .* mm off the bricks"):
        interpolation(mesh, [[0, 0.005, 0.01], [0, 0.005, 0]])
    point = [[0, 0.010002, 0.01]]
    with pytest.raises(ValueError, match=r"lies 0\.002 mm off"):
        interpolation(mesh, point)
    assert interpolation(mesh, point, "y", tolerance=1e-5).sum() == pytest.approx(1)
    for directions in ("w", "", ["x", "y"], ["q"], [[0.0, 0.0, 0.0]], [[1.0, 0.0]]):
        with pytest.raises(ValueError, match="directions"):
            interpolation(mesh, [[0, 0.01, 0.01]], directions)
    for elements in ([], [-1], [10_000], [0.5]):
        with pytest.raises(ValueError, match="elements"):
            interpolation(mesh, [[0, 0.01, 0.01]], elements=elements)
    with pytest.raises(ValueError, match="tolerance must not be negative"):
        interpolation(mesh, [[0, 0.01, 0.01]], tolerance=-1)
