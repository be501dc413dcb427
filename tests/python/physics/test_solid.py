"""Models of bricks: kinematic coupling, rigid bodies, beam theory, supports, and structural damping."""

import numpy as np
import pytest
from scipy.sparse import linalg as sparse_linalg
from scipy.spatial.transform import Rotation

import jointfrf as jf
from jointfrf.dofs import DIRECTIONS, rigid_motion
from jointfrf.workbench.solids.solid import mean_motion
from rigid_bodies import Body, six

ALUMINIUM = jf.Material(70e9, 0.33, 2700.0)
LENGTH, WIDTH, HEIGHT = 0.1, 0.02, 0.01
ORIGIN = (0.01, -0.02, 0.3)


def six_dofs(model, name):
    return model.index(*(f"{name}:{direction}" for direction in DIRECTIONS))


def block(material=ALUMINIUM, **options):
    """Beam with a reference point at either end."""
    options = dict(sections={"a": 0.0, "b": LENGTH}, divisions=(2, 2, 6)) | options
    return jf.brick_beam(LENGTH, WIDTH, HEIGHT, material, **options)


def mesh_of(divisions=(2, 1, 3)):
    """Mesh of a block, without any patch."""
    return jf.brick_beam(LENGTH, WIDTH, HEIGHT, ALUMINIUM, divisions=divisions).mesh


def at_end(mesh, z):
    return np.flatnonzero(abs(mesh.nodes[:, 2] - z) < 1e-9)


def rigid_dofs(model, about):
    """All DOFs in six unit motions as a rigid body, one DOF after the other."""
    motions = np.zeros((len(model.dofs), 6))
    for row, dof in enumerate(model.dofs):
        name, direction = dof.split(":")
        place = model.references[name] if name in model.references else model.mesh.nodes[int(name) - 1]
        axis = DIRECTIONS.index(direction)
        for column, unit in enumerate(np.eye(6)):
            moved = unit[:3] + np.cross(unit[3:], place - about)
            motions[row, column] = moved[axis] if axis < 3 else unit[axis]
    return motions


def test_a_rigid_motion_is_the_beginning_of_a_rotation():
    points = np.random.default_rng(1).standard_normal((5, 3))
    about, step = np.array([0.3, -0.2, 1.0]), 1e-6
    motion = rigid_motion(points, about)
    for axis in range(3):
        turned = [Rotation.from_rotvec(s * step * np.eye(3)[axis]).apply(points - about) for s in (1, -1)]
        np.testing.assert_allclose(motion[:, :, 3 + axis], (turned[0] - turned[1]) / (2 * step), atol=1e-9)
        np.testing.assert_array_equal(motion[:, :, axis], np.tile(np.eye(3)[axis], (5, 1)))


def test_nodes_of_a_patch_follow_their_point_and_others_are_free():
    mesh = mesh_of()
    patches = {
        "left": jf.Patch([0.03, 0.02, -0.01], at_end(mesh, 0)),
        "right": jf.Patch([0.0, 0.0, 0.1], at_end(mesh, LENGTH)),
    }
    model = jf.solid_model(mesh, ALUMINIUM, patches=patches)
    q = np.random.default_rng(2).standard_normal(len(model.dofs))
    moved = model.displacements(q)
    for name, patch in patches.items():
        motion = q[six_dofs(model, name)]
        for node in patch.nodes:
            expected = motion[:3] + np.cross(motion[3:], mesh.nodes[node] - patch.point)
            np.testing.assert_allclose(moved[node], expected, atol=1e-14)
    free = np.setdiff1d(np.arange(len(mesh.nodes)), np.concatenate([p.nodes for p in patches.values()]))
    for node in free:
        np.testing.assert_array_equal(moved[node], q[model.index(*(f"{node + 1}:{d}" for d in "xyz"))])
    assert len(model.dofs) == 3 * free.size + 12
    np.testing.assert_allclose(model.references["left"], [0.03, 0.02, -0.01])


def test_a_node_named_twice_follows_once():
    mesh = mesh_of()
    nodes = at_end(mesh, 0)
    once, twice = (
        jf.solid_model(mesh, ALUMINIUM, patches={"p": jf.Patch(np.zeros(3), n)}) for n in (nodes, [*nodes, *nodes])
    )
    np.testing.assert_array_equal(once.expansion.toarray(), twice.expansion.toarray())


@pytest.mark.parametrize("preset", ["seed", "accurate"])
def test_a_free_body_has_six_motions_without_energy_and_the_mass_and_inertia_of_a_block(preset):
    model = block(preset=preset, origin=ORIGIN, divisions=(4, 2, 6))
    about = np.array([0.05, 0.04, 0.1])
    rigid = rigid_dofs(model, about)
    stiffness = model.stiffness.toarray()
    np.testing.assert_allclose(stiffness @ rigid, 0, atol=1e-12 * abs(stiffness).max())
    values = np.linalg.eigvalsh(stiffness)
    assert np.count_nonzero(values < 1e-9 * values[-1]) == 6
    mass = ALUMINIUM.density * LENGTH * WIDTH * HEIGHT
    centre = ORIGIN + np.array([0, HEIGHT / 2, LENGTH / 2])
    second = np.array([WIDTH, HEIGHT, LENGTH]) ** 2 / 12
    arm = centre - about
    inertia = mass * (np.diag(second.sum() - second) + (arm @ arm) * np.eye(3) - np.outer(arm, arm))
    found = rigid.T @ (model.mass @ rigid)
    np.testing.assert_allclose(found[:3, :3], mass * np.eye(3), rtol=1e-10, atol=1e-12 * mass)
    np.testing.assert_allclose(found[3:, 3:], inertia, rtol=1e-10)
    first = mass * np.array([np.cross(unit, arm) for unit in np.eye(3)]).T
    np.testing.assert_allclose(found[:3, 3:], first, rtol=1e-10, atol=1e-12 * mass)


def test_a_stiff_free_block_moves_as_newton_and_euler_say():
    model = block(jf.Material(70e13, 0.33, 2700.0), origin=ORIGIN)
    a, b = six_dofs(model, "a"), six_dofs(model, "b")
    mass = 2700 * LENGTH * WIDTH * HEIGHT
    sides = np.array([WIDTH, HEIGHT, LENGTH]) ** 2
    body = Body(mass, mass / 12 * np.diag(sides.sum() - sides), ORIGIN + np.array([0, HEIGHT / 2, LENGTH / 2]))
    points = six(model.references["a"]) + six(model.references["b"])
    freq = np.array([1.0, 5.0])  # Hz; the first elastic mode lies at 160 kHz
    exact = body.receptance(freq, points, points)
    h = jf.receptance(freq, model.stiffness, model.mass, outputs=a + b, inputs=a + b, method="krylov")
    size = np.sqrt(abs(np.einsum("fii->fi", exact)))
    np.testing.assert_array_less(abs(h - exact), 1e-8 * size[:, :, None] * size[:, None, :])


def tip_compliance(length=0.3, width=0.025, height=0.006, divisions=None):
    """Motions of the free end of a cantilever, for unit forces and moments there, shape (6, 6)."""
    beam = jf.brick_beam(
        length, width, height, ALUMINIUM, ends=("clamped", "free"), sections={"tip": length}, divisions=divisions
    )
    tip = six_dofs(beam, "tip")
    loads = np.zeros((len(beam.dofs), 6))
    loads[tip, range(6)] = 1
    return sparse_linalg.splu(beam.stiffness.tocsc()).solve(loads)[tip]


SHEAR_MODULUS = 70e9 / (2 * 1.33)
BENDS_IN_Y, BENDS_IN_X = 70e9 * 0.025 * 0.006**3 / 12, 70e9 * 0.006 * 0.025**3 / 12
STRETCHES = 70e9 * 0.025 * 0.006
#: Saint-Venant's torsion of a rectangle, as a series in its sides.
TWISTS = SHEAR_MODULUS * (
    0.025 * 0.006**3 / 3
    * (1 - 192 * 0.006 / (np.pi**5 * 0.025) * sum(np.tanh(n * np.pi * 0.025 / 0.012) / n**5 for n in (1, 3, 5, 7)))
)  # fmt: skip


def test_forces_and_moments_at_the_tip_give_the_deflections_of_timoshenko():
    length = 0.3
    shear = length / (5 / 6 * SHEAR_MODULUS * 0.025 * 0.006)
    exact = np.diag([
        length**3 / (3 * BENDS_IN_X) + shear, length**3 / (3 * BENDS_IN_Y) + shear, length / STRETCHES,
        length / BENDS_IN_Y, length / BENDS_IN_X, 0.0,
    ])  # fmt: skip
    exact[0, 4] = exact[4, 0] = length**2 / (2 * BENDS_IN_X)  # a force in x turns the tip to +theta_y
    exact[1, 3] = exact[3, 1] = -(length**2) / (2 * BENDS_IN_Y)  # one in y to -theta_x
    found = tip_compliance()
    exact[5, 5] = found[5, 5]
    size = np.sqrt(np.diag(exact))
    # the clamped face keeps its width, which stiffens the first few millimetres
    np.testing.assert_allclose(found / np.outer(size, size), exact / np.outer(size, size), atol=0.01)
    assert found[2, 2] == pytest.approx(exact[2, 2], rel=0.005)


def test_a_longer_beam_stretches_bends_and_twists_more_by_what_was_added():
    """What the ends do differently cancels."""
    errors = []
    for nx, ny in ((8, 4), (16, 8)):
        short, long = (tip_compliance(length, divisions=(nx, ny, n)) for length, n in ((0.15, 6), (0.2, 8)))
        added = np.diag(long - short)
        assert added[2] == pytest.approx(0.05 / STRETCHES, rel=5e-4)
        assert added[3] == pytest.approx(0.05 / BENDS_IN_Y, rel=5e-4)
        assert added[4] == pytest.approx(0.05 / BENDS_IN_X, rel=5e-4)
        errors.append(0.05 / added[5] / TWISTS - 1)
    assert 0 < 3 * errors[1] < errors[0] < 0.025  # too stiff, by a share that goes with the square of the bricks


def test_clamped_nodes_have_no_dofs_and_stay():
    mesh = mesh_of()
    held = at_end(mesh, 0)
    model = jf.solid_model(mesh, ALUMINIUM, clamped=held)
    assert len(model.dofs) == 3 * (len(mesh.nodes) - held.size)
    moved = model.displacements(np.ones(len(model.dofs)))
    assert not moved[held].any()
    assert (np.delete(moved, held, axis=0) == 1).all()
    free = jf.solid_model(mesh, ALUMINIUM)
    kept = free.index(*model.dofs)
    np.testing.assert_array_equal(model.stiffness.toarray(), free.stiffness.toarray()[np.ix_(kept, kept)])
    assert np.linalg.eigvalsh(model.stiffness.toarray()).min() > 0


@pytest.mark.parametrize("formulation", ["reduced", "incompatible"])
def test_different_loss_factors_become_the_sum_of_their_elements(formulation):
    mesh = mesh_of()
    losses = np.tile([0.0, 0.01, 0.3], len(mesh.elements))[: len(mesh.elements)]
    moduli = 70e9 * (1 + np.arange(len(losses)) / 7)
    materials = [jf.Material(e, 0.3, 2700.0, eta) for e, eta in zip(moduli, losses, strict=True)]
    patches = {"p": jf.Patch([0.0, 0.01, 0.1], at_end(mesh, LENGTH))}
    model = jf.solid_model(mesh, materials, formulation=formulation, patches=patches, clamped=at_end(mesh, 0))
    k, _ = jf.element_matrices(mesh.nodes[mesh.elements], materials, formulation)
    q = np.random.default_rng(3).standard_normal((len(model.dofs), 2))
    u, v = model.displacements(q[:, 0]), model.displacements(q[:, 1])
    products = [u[e].ravel() @ one @ v[e].ravel() for e, one in zip(mesh.elements, k, strict=True)]
    assert q[:, 0] @ (model.stiffness @ q[:, 1]) == pytest.approx(sum(products), rel=1e-10)
    assert q[:, 0] @ (model.structural_damping @ q[:, 1]) == pytest.approx(losses @ products, rel=1e-10)
    assert model.loss_factor == 0


def test_one_loss_factor_is_that_of_the_model_and_gives_the_same_receptance_as_its_matrix():
    mesh = mesh_of()
    held, patches = at_end(mesh, 0), {"p": jf.Patch([0.0, 0.0, 0.1], at_end(mesh, LENGTH))}
    lossy, hardly = (jf.Material(70e9, 0.3, 2700.0, eta) for eta in (0.02, 0.02 + 1e-12))
    one = jf.solid_model(mesh, [lossy] * len(mesh.elements), patches=patches, clamped=held)
    two = jf.solid_model(mesh, [lossy] * (len(mesh.elements) - 1) + [hardly], patches=patches, clamped=held)
    assert (one.loss_factor, one.structural_damping) == (0.02, None)
    assert two.loss_factor == 0
    np.testing.assert_allclose(two.structural_damping.toarray(), 0.02 * one.stiffness.toarray(), atol=1)
    at = six_dofs(one, "p")
    np.testing.assert_allclose(
        one.receptance([900.0], at, method="dense"), two.receptance([900.0], at, method="dense"), rtol=1e-7, atol=1e-15
    )


def test_a_shifted_body_is_the_same_body():
    here, there = block(), block(origin=ORIGIN)
    assert here.dofs == there.dofs
    np.testing.assert_allclose(there.mesh.nodes - here.mesh.nodes, np.tile(ORIGIN, (len(here.mesh.nodes), 1)))
    np.testing.assert_allclose(there.references["b"], here.references["b"] + ORIGIN)
    np.testing.assert_allclose(here.references["b"], [0, HEIGHT / 2, LENGTH])
    for name in ("stiffness", "mass"):
        before, after = getattr(here, name).toarray(), getattr(there, name).toarray()
        np.testing.assert_allclose(after, before, atol=1e-12 * abs(before).max())


MESH = mesh_of()
END = at_end(MESH, LENGTH)


@pytest.mark.parametrize(
    ("patches", "clamped", "message"),
    [
        ({"p": ([0, 0, 0], [])}, [], "patch 'p' has no nodes; refine the mesh there, or move the patch inside"),
        ({"p": ([0, 0, 0], END[:2])}, [], "patch 'p' needs at least three nodes that are not on one line"),
        ({"p": ([0, 0, 0], at_end(MESH, 0)[:3])}, [], "patch 'p' needs at least three nodes that are not on one line"),
        ({"p": ([0, 0, 0], END), "q": ([0, 0, 1], END)}, [], "patch 'q' overlaps patch 'p' at x, y, z = -10, 0, 100"),
        ({"p": ([0, 0, 0], END)}, END, "patch 'p' overlaps the clamped nodes at x, y, z = -10, 0, 100 mm"),
        ({"p": ([0, 0], END)}, [], r"point of patch 'p' must have shape \(3\), not \(2,\)"),
        ({"p": ([0, 0, np.nan], END)}, [], "point of patch 'p' contains NaN or Inf"),
        ({"p": ([0, 0, 0], [0, 1, 24])}, [], "patch 'p' names node 24; there are nodes 0 to 23"),
        ({"p": ([0, 0, 0], [0, 1, -1])}, [], "patch 'p' names node -1; there are nodes 0 to 23"),
        ({"7": ([0, 0, 0], END)}, [], "a patch cannot be named '7': a name without colon that is not a number"),
        ({"p:x": ([0, 0, 0], END)}, [], "a patch cannot be named 'p:x'"),
        ({"": ([0, 0, 0], END)}, [], "a patch cannot be named ''"),
        ({}, [99], "clamped names node 99; there are nodes 0 to 23"),
    ],
)  # fmt: skip
def test_bad_patches_get_one_sentence(patches, clamped, message):
    given = {name: jf.Patch(*patch) for name, patch in patches.items()}
    with pytest.raises(ValueError, match=message) as caught:
        jf.solid_model(MESH, ALUMINIUM, patches=given, clamped=clamped)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(mesh=MESH.nodes), "mesh must be a Mesh, not ndarray"),
        (dict(materials="steel"), "materials must be one Material or a sequence of them"),
        (dict(patches=[END]), "patches must map names to patches, not list"),
        (dict(patches={"p": END}), "patch 'p' must be a Patch, not ndarray"),
        (dict(patches={"p": jf.Patch(np.zeros(3), [0.5, 1.0])}), "patch 'p' must be a list of node numbers"),
        (dict(clamped=[0.5]), "clamped must be a list of node numbers, not float64"),
    ],
)
def test_wrong_types_are_named(change, message):
    arguments = dict(mesh=MESH, materials=ALUMINIUM) | change
    with pytest.raises(TypeError, match=message):
        jf.solid_model(arguments.pop("mesh"), arguments.pop("materials"), **arguments)


def test_lumped_masses_roll_with_more_inertia():
    whole = block(divisions=(4, 2, 6))
    model = jf.solid_model(whole.mesh, ALUMINIUM, mass="lumped")
    # trapezoidal sums over n equal bricks add 2 / n^2 to the second moment of a side
    second = np.array([WIDTH, HEIGHT, LENGTH]) ** 2 / 12 * (1 + 2 / np.array([4, 2, 6]) ** 2)
    rigid = rigid_dofs(model, whole.mesh.nodes.mean(axis=0))[:, 3:]
    mass = ALUMINIUM.density * LENGTH * WIDTH * HEIGHT
    np.testing.assert_allclose(np.diagonal(rigid.T @ (model.mass @ rigid)), mass * (second.sum() - second), rtol=1e-10)


def observed_block(**keywords):
    return jf.brick_beam(
        LENGTH, WIDTH, HEIGHT, ALUMINIUM, divisions=(4, 2, 6), observed={"end": LENGTH}, ends=("clamped", "free"),
        **keywords,
    )  # fmt: skip


def test_a_mean_motion_does_not_stiffen_and_shows_rigid_motions():
    plain = jf.brick_beam(LENGTH, WIDTH, HEIGHT, ALUMINIUM, divisions=(4, 2, 6), ends=("clamped", "free"))
    shown = observed_block()
    assert shown.dofs == plain.dofs
    assert abs(shown.stiffness - plain.stiffness).max() == 0
    about = shown.references["end"]
    np.testing.assert_allclose(about, [0, HEIGHT / 2, LENGTH], atol=1e-15)
    motion = rigid_motion(shown.mesh.nodes, about).reshape(-1, 6)
    end = jf.Patch(about, np.flatnonzero(abs(shown.mesh.nodes[:, 2] - LENGTH) < 1e-9))
    np.testing.assert_allclose((mean_motion(shown.mesh, end) @ motion), np.eye(6), atol=1e-12)


def test_forces_on_a_mean_motion_have_its_resultant_and_strain_the_body_as_a_beam():
    model = observed_block()
    names = [f"end:{d}" for d in DIRECTIONS]
    weights = model.ports(*names)
    # the resultant of what is spread over the nodes: R^T (T^T f) = f
    motion = rigid_motion(model.mesh.nodes, model.references["end"]).reshape(-1, 6)
    on_nodes = model.expansion @ weights.T.toarray()
    np.testing.assert_allclose(motion.T @ on_nodes, np.eye(6), atol=1e-10)
    stretch = jf.receptance([0.0], model.stiffness, model.mass, outputs=weights, inputs=weights)[0].real
    area = WIDTH * HEIGHT
    assert stretch[2, 2] == pytest.approx(LENGTH / (ALUMINIUM.youngs_modulus * area), rel=0.03)
    np.testing.assert_allclose(stretch, stretch.T, rtol=1e-7, atol=1e-9 * abs(stretch).max())


def test_ports_mix_dofs_and_mean_motions():
    model = observed_block()
    last = model.dofs[-1]
    mixed = model.ports(last, "end:x")
    assert mixed.shape == (2, len(model.dofs))
    assert mixed[[0]].toarray().ravel().tolist() == np.eye(len(model.dofs))[-1].tolist()
    assert model.ports(last) == [len(model.dofs) - 1]
    with pytest.raises(ValueError, match="the model has no DOF 'start:x'"):
        model.ports("end:x", "start:x")
    with pytest.raises(ValueError, match="patches and observed both name 'end'"):
        observed_block(sections={"end": LENGTH / 2})
