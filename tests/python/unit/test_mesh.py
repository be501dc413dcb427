"""Meshes of bricks: volumes and surfaces against formulas, no gaps, right orientation, and errors."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.workbench.solids.mesh import Plan, disc, extrude, holed_rectangle, join_plans, rectangle

HOLE, HEAD, WIDTH = 4.5e-3, 6.5e-3, 25e-3
LAYERS = np.array([0.0, 2e-3, 6e-3])
HEIGHT = 6e-3


def polygon(radius, corners):
    """Area and perimeter of a regular polygon inscribed in a circle."""
    return corners / 2 * radius**2 * np.sin(2 * np.pi / corners), 2 * corners * radius * np.sin(np.pi / corners)


def plate(position=12.5e-3, divisions=6):
    """Rectangle with a hole, from z = 0 on."""
    reach = (position, 12.5e-3, WIDTH / 2)
    return holed_rectangle((position, 0.0), reach, (HOLE, HEAD), divisions, layers=2)


def strip(start=25e-3, stop=60e-3, divisions=6):
    return rectangle(np.linspace(start, stop, 8), np.linspace(-WIDTH / 2, WIDTH / 2, divisions + 1))


def area(plan):
    """Signed area of every quadrilateral, positive counter-clockwise in z, x."""
    z, x = plan.points[plan.quads].transpose(2, 0, 1)
    return (z * np.roll(x, -1, axis=1) - np.roll(z, -1, axis=1) * x).sum(axis=1) / 2


def euler(plan):
    """Points less edges and quadrilaterals: 1 for a plan in one piece, less the number of its holes."""
    edges = {frozenset(edge) for quad in plan.quads.tolist() for edge in pairwise([*quad, quad[0]])}
    return len(np.unique(plan.quads)) - len(edges) + len(plan.quads)


def area_vectors(mesh, faces):
    """Of plane faces, by their diagonals."""
    a, b, c, d = mesh.nodes[faces].swapaxes(0, 1)
    return np.cross(c - a, d - b) / 2


def volume(mesh):
    """By the divergence theorem over the outer faces."""
    faces, _ = mesh.faces()
    return (mesh.nodes[faces].mean(axis=1) * area_vectors(mesh, faces)).sum() / 3


PLATE = (60e-3 * WIDTH - polygon(HOLE, 24)[0], 2 * (60e-3 + WIDTH) + polygon(HOLE, 24)[1])
CASES = {
    "box": (rectangle([0, 0.01, 0.04], [-0.01, 0.0, 0.005]), 0.04 * 0.015, 2 * (0.04 + 0.015), 1),
    "plate": (join_plans(plate(), strip()), *PLATE, 0),
    "disc": (disc((0.02, 0.01), (4e-3, 4.5e-3, 6e-3), 4, layers=2), *polygon(6e-3, 16), 1),
    "disc of one ring": (disc((0.0, 0.0), (4e-3,), 3), *polygon(4e-3, 12), 1),
    "filled plate": (join_plans(plate(), strip(), disc((12.5e-3, 0), (HOLE,), 6)),
                     60e-3 * WIDTH, 2 * (60e-3 + WIDTH), 1),
    "hole near the end": (plate(8e-3), 20.5e-3 * WIDTH - polygon(HOLE, 24)[0],
                          2 * (20.5e-3 + WIDTH) + polygon(HOLE, 24)[1], 0),
}  # fmt: skip


@pytest.fixture(params=CASES)
def case(request):
    return CASES[request.param]


def test_plans_have_the_area_of_the_formula_and_no_gaps(case):
    plan, expected, _, pieces = case
    assert (area(plan) > 0).all()
    assert area(plan).sum() == pytest.approx(expected, rel=1e-12)
    assert euler(plan) == pieces
    assert np.unique(plan.quads).size == len(plan.points)


def test_meshes_have_the_volume_and_the_surface_of_the_formula(case):
    plan, base, perimeter, _ = case
    mesh = extrude((plan, LAYERS))
    faces, _ = mesh.faces()
    sizes = np.linalg.norm(area_vectors(mesh, faces), axis=1)
    assert volume(mesh) == pytest.approx(base * HEIGHT, rel=1e-12)
    assert sizes.sum() == pytest.approx(2 * base + perimeter * HEIGHT, rel=1e-12)
    np.testing.assert_allclose(area_vectors(mesh, faces).sum(axis=0), 0, atol=1e-12 * sizes.sum())
    _, m = jf.assemble_bricks(mesh.nodes, mesh.elements, jf.Material(1.0, 0.3, 1000.0))
    assert m.sum() / 3 == pytest.approx(1000 * base * HEIGHT, rel=1e-12)


def test_every_inner_face_belongs_to_two_bricks_and_faces_point_outwards(case):
    mesh = extrude((case[0], LAYERS))
    corners = [(0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 4, 5), (1, 2, 5, 6), (2, 3, 6, 7), (0, 3, 4, 7)]
    owners = Counter(frozenset(brick[list(c)].tolist()) for brick in mesh.elements for c in corners)
    assert set(owners.values()) <= {1, 2}
    faces, elements = mesh.faces()
    assert {frozenset(f.tolist()) for f in faces} == {face for face, count in owners.items() if count == 1}
    assert len(faces) == sum(count == 1 for count in owners.values())
    for face, element in zip(faces, elements, strict=True):
        assert set(face.tolist()) <= set(mesh.elements[element].tolist())
    middle = mesh.nodes[mesh.elements[elements]].mean(axis=1)
    assert ((mesh.nodes[faces].mean(axis=1) - middle) * area_vectors(mesh, faces)).sum(axis=1).min() > 0


def test_bricks_are_not_turned_inside_out(case):
    mesh = extrude((case[0], LAYERS))
    scaled, aspect = jf.brick_quality(mesh.nodes, mesh.elements)
    assert scaled.min() > 0.3
    assert aspect.max() < 30


def test_joined_plans_share_the_points_of_their_edges():
    plate_only, strip_only = plate(), strip()
    joined = join_plans(plate_only, strip_only)
    assert len(joined.points) == len(plate_only.points) + len(strip_only.points) - 7
    assert len(joined.quads) == len(plate_only.quads) + len(strip_only.quads)
    at_the_joint = joined.points[abs(joined.points[:, 0] - 25e-3) < 1e-9]
    assert len(at_the_joint) == 7
    apart = join_plans(plate_only, strip(start=25.1e-3))
    assert len(apart.points) == len(plate_only.points) + len(strip_only.points)
    assert euler(apart) == 0 + 1  # a piece with a hole, and one without


def test_many_points_at_one_place_become_one():
    corner = rectangle([0, 1], [0, 1])
    four = [Plan(corner.points - shift, corner.quads) for shift in ([0, 0], [1, 0], [1, 1], [0, 1])]
    assert len(join_plans(*four).points) == 9
    grid = rectangle(np.linspace(0, 1, 6), np.linspace(0, 1, 6))
    order = np.random.default_rng(6)
    shuffled = []
    for _ in range(9):
        new = order.permutation(36)
        shuffled.append(Plan(grid.points[np.argsort(new)], new[grid.quads].astype(np.int32)))
    joined = join_plans(*shuffled)
    assert len(joined.points) == 36
    np.testing.assert_array_equal(joined.quads.reshape(9, -1), np.tile(joined.quads[:25].ravel(), (9, 1)))


def test_parts_of_different_height_grow_together():
    mesh = extrude((rectangle([0, 1, 2], [0, 1]), [0, 1]), (rectangle([0, 1], [0, 1]), [1, 1.5, 3]))
    assert len(mesh.nodes) == 12 + 8
    assert volume(mesh) == pytest.approx(2 + 2)
    faces, _ = mesh.faces()
    assert np.linalg.norm(area_vectors(mesh, faces), axis=1).sum() == pytest.approx(2 + 2 + 6 * 1 + 4 * 2)
    assert jf.brick_quality(mesh.nodes, mesh.elements)[0].min() == pytest.approx(1)


def test_z_and_x_of_a_plan_become_z_and_x_of_the_mesh():
    mesh = extrude((rectangle([0.1, 0.4], [-0.02, 0.01]), [0.5, 0.6]))
    np.testing.assert_allclose([mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)], [[-0.02, 0.5, 0.1], [0.01, 0.6, 0.4]])


def test_a_hole_near_the_end_keeps_the_rectangle_in_its_place():
    for reach in ((8e-3, 12e-3, 9e-3), (12e-3, 8e-3, 10e-3)):
        points = holed_rectangle((0.1, 0.02), reach, (HOLE, HEAD), 4, layers=2).points - [0.1, 0.02]
        expected = [[-reach[0], -reach[2]], [reach[1], reach[2]]]
        np.testing.assert_allclose([points.min(axis=0), points.max(axis=0)], expected, rtol=1e-12)


def test_points_of_rings_lie_on_their_circles():
    plan = disc((0.02, 0.01), (4e-3, 4.5e-3, 6e-3), 4)
    radius = np.hypot(*(plan.points - [0.02, 0.01]).T)
    for ring in (4e-3, 4.5e-3, 6e-3):
        assert np.count_nonzero(abs(radius - ring) < 1e-12) == 16


def test_a_node_is_found_by_its_place():
    mesh = extrude((plate(), LAYERS))
    number = mesh.near([0.0, 2e-3, 12.5e-3 + HOLE])
    np.testing.assert_allclose(mesh.nodes[number], [0.0, 2e-3, 17e-3], atol=1e-12)
    with pytest.raises(ValueError, match=r"no node lies at x, y, z = 0, 2, 12.5 mm; the nearest is 4.5 mm away"):
        mesh.near([0.0, 2e-3, 12.5e-3])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: rectangle([0, 1], [0]), "x must contain at least two grid lines in ascending order"),
        (lambda: rectangle([0, 2, 1], [0, 1]), "z must contain at least two grid lines in ascending order"),
        (lambda: rectangle([0, 1], [0, np.nan]), "x contains NaN or Inf"),
        (lambda: extrude((rectangle([0, 1], [0, 1]), [1, 0])), "heights must contain at least two values in ascending"),
        (
            lambda: holed_rectangle((0, 0), (2, 2, 1), (0.4, 0.3), 4),
            r"radii 400, 300 mm must grow .* to less than 1000 mm",
        ),
        (lambda: holed_rectangle((0, 0), (2, 0.5, 1), (0.4, 0.5), 4), "to less than 500 mm at the nearest edge"),
        (lambda: holed_rectangle((0, 0), (2, 2, 1), (-0.1, 0.5), 4), "radii -100, 500 mm must grow"),
        (lambda: holed_rectangle((0, 0), (2, 2, 1), (np.nan,), 4), "radii nan mm must grow"),
        (lambda: holed_rectangle((0, 0), (2, 2, 1), (0.3, 0.4), 0), "divisions must be a whole number, at least 1"),
        (lambda: holed_rectangle((0, 0), (2, 2, 1), (0.3, 0.4), 4, 0), "layers must be a whole number, at least 1"),
        (lambda: disc((0, 0), (0.3, 0.3), 4), "radii 300, 300 mm must grow from the middle outwards"),
        (lambda: disc((0, 0), (0.3, 0.4), 1.5), "divisions must be a whole number, at least 1, not 1.5"),
        (lambda: disc((0, 0), (0.3, 0.4), 2, 0), "layers must be a whole number, at least 1"),
    ],
)
def test_bad_meshes_get_one_sentence(make, message):
    with pytest.raises(ValueError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)
