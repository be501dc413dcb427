"""Contact against uniform pressure, bars in series, and projected iterations on the condensed compliance."""

import numpy as np
import pytest
from scipy.optimize import nnls

from jointfrf.workbench.cases.bolted_lap.contact import ContactInterface, ContactLaw, solve_contact
from jointfrf.workbench.solids.brick import Material, assemble_bricks
from jointfrf.workbench.solids.mesh import Mesh, extrude, rectangle

RIGID = ContactLaw(0.3, None, None)
SIDE = 0.02


def node_areas(z, x):
    """Lumped areas of a grid of lines, z slowest."""

    def shares(lines):
        half = np.diff(lines) / 2
        return np.append(half, 0) + np.insert(half, 0, 0)

    return np.outer(shares(z), shares(x)).ravel()


def stack(z, x, heights=(0.01, 0.01), poisson=0.3):
    """Two blocks, one on the other: K, nodes, and the nodes of the bottom, both faces that touch, and the top."""
    plan = rectangle(z, x)
    lower = extrude((plan, np.linspace(-heights[0], 0, 3)))
    upper = extrude((plan, np.linspace(0, heights[1], 3)))
    count = len(lower.nodes)
    mesh = Mesh(np.vstack([lower.nodes, upper.nodes]), np.vstack([lower.elements, upper.elements + count]))
    k, _ = assemble_bricks(mesh.nodes, mesh.elements, Material(70e9, poisson, 2700.0))
    y, n = mesh.nodes[:, 1], len(mesh.nodes)
    first = np.arange(n) < count
    levels = (
        first & (y < -heights[0] / 2 * 1.5),
        first & (y > -1e-9),
        ~first & (y < 1e-9),
        ~first & (y > y.max() - 1e-9),
    )
    return k, mesh.nodes, [np.flatnonzero(level) for level in levels]


def dofs(nodes, *axes):
    return np.concatenate([3 * nodes + axis for axis in axes])


Z, X = np.array([0, 0.003, 0.008, 0.014, SIDE]), np.array([-0.01, -0.003, 0.002, 0.01])


@pytest.mark.parametrize("friction", [0.0, 0.3, 50.0])
@pytest.mark.parametrize("stiffness", [None, 1e14])
def test_a_pressed_stack_has_uniform_pressure(friction, stiffness):
    k, _, (bottom, below, above, top) = stack(Z, X)
    area = node_areas(Z, X)
    f = np.zeros(k.shape[0])
    f[3 * top + 1] = -5e6 * area
    # The bottom slides on a plane, held against motions of a rigid body.
    fixed = np.concatenate([3 * bottom + 1, [3 * bottom[0], 3 * bottom[0] + 2, 3 * bottom[-1]]])
    law = ContactLaw(friction, stiffness, stiffness)
    found = solve_contact(k, f, {"faces": ContactInterface(below, above, area)}, law, fixed=fixed)
    state = found.interfaces["faces"]
    assert state.pressure == pytest.approx(np.full(20, 5e6), rel=1e-7)
    assert state.closed.all()
    assert abs(state.force[:, [0, 2]]).max() < 1e-5 * state.normal_force
    assert state.normal_force == pytest.approx(5e6 * SIDE**2, rel=1e-9)
    overlap = 0 if stiffness is None else 5e6 / stiffness
    assert state.separation == pytest.approx(np.full(20, -overlap), abs=1e-15)
    assert found.history[-1].changed == 0
    assert found.history[-1].residual < 1e-9
    assert state.slipping.any() == (friction == 0)


@pytest.mark.parametrize("stiffness", [None, 2e13])
def test_bars_that_share_a_load(stiffness):
    """A hanging bar, pressed down at its end onto a standing one; without Poisson effect, springs in series."""
    k, _, (bottom, below, above, top) = stack(Z, X, heights=(0.01, 0.03), poisson=0.0)
    area, force = node_areas(Z, X), 8e3
    f = np.zeros(k.shape[0])
    f[3 * above + 1] = -force * area / area.sum()
    pairs = {"face": ContactInterface(below, above, area)}
    held = dofs(np.concatenate([bottom, top]), 0, 1, 2)
    state = solve_contact(k, f, pairs, ContactLaw(0.3, stiffness, stiffness), fixed=held).interfaces["face"]

    hanging, standing = 70e9 * SIDE**2 / 0.03, 70e9 * SIDE**2 / 0.01
    flexibility = 1 / standing + (0 if stiffness is None else 1 / (stiffness * SIDE**2))
    # end = (force - carried) / hanging = flexibility carried
    carried = (force / hanging) / (1 / hanging + flexibility)
    assert carried > 0
    assert state.normal_force == pytest.approx(carried, rel=1e-8)

    with pytest.raises(ValueError, match="'face' opens everywhere"):
        solve_contact(k, -f, pairs, RIGID, fixed=held)


def plate_on_block():
    """A plate clamped at one end that rests on a block; a load tilts it, another one pushes it sideways."""
    k, nodes, (bottom, below, above, top) = stack(Z, X, heights=(0.01, 0.004))
    at_end = np.flatnonzero((nodes[:, 2] < 1e-9) & (nodes[:, 1] > 1e-9))
    far = top[nodes[top, 2] > SIDE - 1e-9]
    middle = top[abs(nodes[top, 2] - 0.008) < 1e-9]
    f = np.zeros(k.shape[0])
    f[3 * far + 1] = 30.0
    f[3 * middle + 1] = -400.0
    f[3 * far] = 60.0
    return k, f, ContactInterface(below, above, node_areas(Z, X)), dofs(np.concatenate([bottom, at_end]), 0, 1, 2)


def condensed(k, f, pairs, held):
    """Compliance between the pairs and their free motion, without contact: upper less lower, x, y, z of each."""
    free = np.setdiff1d(np.arange(k.shape[0]), held)
    relative = np.zeros((k.shape[0], 3 * len(pairs.area)))
    columns = np.arange(relative.shape[1])
    relative[(3 * pairs.upper[:, None] + np.arange(3)).ravel(), columns] = 1
    relative[(3 * pairs.lower[:, None] + np.arange(3)).ravel(), columns] = -1
    flexibility = np.linalg.inv(k.toarray()[np.ix_(free, free)])
    return relative[free].T @ flexibility @ relative[free], relative[free].T @ flexibility @ f[free]


def test_partly_open_without_friction_against_quadratic_programming():
    k, f, pairs, held = plate_on_block()
    flexibility, motion = condensed(k, f, pairs, held)
    g, start = flexibility[1::3, 1::3], motion[1::3]
    # min p G p / 2 + p start, p >= 0, as least squares
    half = np.linalg.cholesky(g).T
    expected, _ = nnls(half, -np.linalg.solve(half.T, start))
    state = solve_contact(k, f, {"p": pairs}, ContactLaw(0.0, None, None), fixed=held).interfaces["p"]
    assert 2 < state.closed.sum() < 18
    assert state.force[:, 1] == pytest.approx(expected, abs=1e-6 * expected.max())
    assert (state.separation >= -1e-15).all()
    assert (state.closed == (expected > 1e-6 * expected.max())).all()


def projected(flexibility, motion, area, friction, stiffness):
    """Forces of Coulomb friction by small projected steps."""
    compliance = flexibility.copy()
    if stiffness is not None:
        compliance += np.diag(np.repeat(1 / (stiffness * area), 3))
    step = 1.0 / np.linalg.eigvalsh(compliance).max()
    force = np.zeros((len(area), 3))
    for _ in range(200_000):
        before = force
        trial = force - step * (compliance @ force.ravel() + motion).reshape(-1, 3)
        normal = np.maximum(trial[:, 1], 0)
        shear = trial[:, [0, 2]]
        size = np.linalg.norm(shear, axis=1)
        shear = shear * np.minimum(1, friction * normal / np.maximum(size, 1e-300))[:, None]
        force = np.stack([shear[:, 0], normal, shear[:, 1]], axis=1)
        if abs(force - before).max() < 1e-11 * abs(force).max():
            break
    return force


@pytest.mark.parametrize("stiffness", [None, 1e14])
@pytest.mark.parametrize("friction", [0.05, 0.3])
def test_friction_against_projected_iterations(friction, stiffness):
    k, f, pairs, held = plate_on_block()
    expected = projected(*condensed(k, f, pairs, held), pairs.area, friction, stiffness)
    found = solve_contact(k, f, {"p": pairs}, ContactLaw(friction, stiffness, stiffness), fixed=held)
    state = found.interfaces["p"]
    assert abs(state.force - expected).max() < 1e-5 * abs(expected).max()
    assert 0 < state.slipping.sum() <= state.closed.sum() < len(pairs.area)
    # What slips lies on the cone and moves against the force; what sticks lies within.
    assert state.slip_ratio[state.slipping] == pytest.approx(np.ones(state.slipping.sum()), rel=1e-5)
    assert (state.slip_ratio[~state.slipping] <= 1 + 1e-9).all()
    work = (state.force[:, [0, 2]] * state.slide).sum(axis=1)
    assert (work[state.slipping] < 0).all()


def test_huge_friction_sticks():
    k, f, pairs, held = plate_on_block()
    state = solve_contact(k, f, {"p": pairs}, ContactLaw(1e9, None, None), fixed=held).interfaces["p"]
    assert not state.slipping.any()
    assert abs(state.slide[state.closed]).max() < 1e-18


def test_refusals():
    k, f, pairs, held = plate_on_block()
    both = {"p": pairs}
    with pytest.raises(ValueError, match="did not converge in 1 iterations"):
        solve_contact(k, f, both, ContactLaw(), max_iterations=1, fixed=held)
    with pytest.raises(ValueError, match="a body can move freely"):
        solve_contact(k, f, both, ContactLaw())
    with pytest.raises(ValueError, match="friction must not be negative"):
        ContactLaw(-0.1)
    with pytest.raises(ValueError, match="normal_stiffness must be positive"):
        ContactLaw(0.3, 0.0)
