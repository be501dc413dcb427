"""Beams of bricks: frequencies of a cantilever and of two beams with a joint, holes, sections, and errors."""

import numpy as np
import pytest
from scipy.sparse.csgraph import connected_components

import jointfrf as jf
from jointfrf.workbench.solids.brick_beam import PRESETS

ALUMINIUM = jf.Material(70e9, 0.33, 2700.0)
SIZE = (0.3, 0.025, 0.006)
HOLE_A, HOLE_B = jf.Hole(0.2875, 0.0045, 0.0065), jf.Hole(0.0125, 0.0045, 0.0065, "bottom")
JOINT_DOFS = ("x", "theta_y", "y", "theta_x", "z", "theta_z")
#: The joint to be identified, Table 4-1: N/m and N m/rad.
JOINT = jf.Joint([1e6, 1e4, 1e6, 1e3, 1e7, 1e3], dofs=JOINT_DOFS)


def beam(**options):
    return jf.brick_beam(*SIZE, ALUMINIUM, **options)


@pytest.mark.parametrize(("preset", "expected"), [("accurate", 55.16), ("seed", 47.9)])
def test_first_frequency_of_a_cantilever_of_1030_bricks(preset, expected):
    cantilever = beam(ends=("clamped", "free"), preset=preset)
    assert len(cantilever.mesh.elements) == 5 * 2 * 103
    assert cantilever.natural_frequencies(1)[0] == pytest.approx(expected, rel=2e-3)


def test_a_free_beam_follows_euler_and_bernoulli_where_it_is_slender():
    found = beam(divisions=(4, 2, 60)).natural_frequencies(7)
    np.testing.assert_allclose(found[:6], 0, atol=0.2)
    slender = 22.3733 / (2 * np.pi) / 0.3**2 * np.sqrt(70e9 * 0.006**2 / 12 / 2700)
    # 0.6 %: a broad section cannot bend freely about its own length
    assert found[6] == pytest.approx(slender, rel=0.01)


def two_beams(**options):
    """Case study 1: a clamped beam and a free one that overlap by 25 mm."""
    a = beam(ends=("clamped", "free"), hole=HOLE_A, **options)
    b = beam(hole=HOLE_B, origin=(0.0, -0.006, 0.275), **options)
    joint = (model.index(*(f"hole:{dof}" for dof in JOINT_DOFS)) for model in (a, b))
    return a, b, jf.assemble(a, b, JOINT, *joint)


def directions(a, b, shapes):
    """The direction of the largest motion of B's free end, and whether the end rolls about z instead."""
    far = np.flatnonzero(abs(b.mesh.nodes[:, 2] - b.mesh.nodes[:, 2].max()) < 1e-9)
    found = []
    for shape in shapes[len(a.dofs) :].T:
        moved = b.displacements(shape)[far]
        mean = abs(moved.mean(axis=0))
        rolls = np.ptp(moved[:, 1]) > 2 * mean.max()
        found.append("roll" if rolls else "xyz"[int(mean.argmax())])
    return found


def test_two_beams_and_a_joint_of_six_stiffnesses():
    a, b, assembly = two_beams(preset="seed")
    assert len(a.mesh.elements) == len(b.mesh.elements) == 1024
    freq, shapes = assembly.modes(7)
    assert directions(a, b, shapes) == ["y", "x", "y", "y", "x", "y", "roll"]
    # from another program with bricks of the same kind, about as many
    np.testing.assert_allclose(freq, [12.8, 58.8, 76.1, 226.5, 325.8, 417.5, 491.2], rtol=2e-3, atol=0.05)


def test_reference_points_lie_on_the_outer_faces_12_mm_apart():
    a, b, _ = two_beams(divisions=(4, 2, 20))
    np.testing.assert_allclose(a.references["hole"], [0, 0.006, 0.2875], atol=1e-12)
    np.testing.assert_allclose(b.references["hole"], [0, -0.006, 0.2875], atol=1e-12)


@pytest.mark.parametrize("position", [0.2875, 0.0125, 0.15, 0.0105, 0.292])
@pytest.mark.parametrize("face", ["top", "bottom"])
def test_a_hole_takes_its_volume_and_its_ring_follows_the_reference_point(position, face):
    model = beam(hole=jf.Hole(position, 0.0045, 0.0065, face, "bolt"), origin=(0.1, 0.2, 0.3))
    hole = 32 / 2 * 0.0045**2 * np.sin(2 * np.pi / 32)  # a polygon of 8 bricks for each quarter
    _, mass = jf.assemble_bricks(model.mesh.nodes, model.mesh.elements, ALUMINIUM)
    assert mass.sum() / 3 == pytest.approx(2700 * 0.006 * (0.3 * 0.025 - hole), rel=1e-10)
    assert jf.brick_quality(model.mesh.nodes, model.mesh.elements)[0].min() > 0.3
    assert connected_components(model.stiffness)[0] == 1
    low, high = model.mesh.nodes.min(axis=0), model.mesh.nodes.max(axis=0)
    np.testing.assert_allclose([low, high], [[0.0875, 0.2, 0.3], [0.1125, 0.206, 0.6]], rtol=1e-12)
    lifted = np.zeros(len(model.dofs))
    lifted[model.index("bolt:y")] = 1
    nodes = model.mesh.nodes[model.displacements(lifted).any(axis=1)] - [0.1, 0.2, 0.3 + position]
    np.testing.assert_allclose(nodes[:, 1], 0.006 if face == "top" else 0.0, atol=1e-12)
    radius = np.hypot(nodes[:, 0], nodes[:, 2])
    assert sorted(np.round(radius, 9)) == [0.0045] * 32 + [0.0065] * 32


def test_sections_take_the_nearest_plane_of_nodes():
    model = beam(divisions=(2, 2, 30), sections={"start": 0.0, "middle": 0.153, "end": 0.3}, origin=(0.0, 0.0, 1.0))
    for name, z in (("start", 0.0), ("middle", 0.15), ("end", 0.3)):
        np.testing.assert_allclose(model.references[name], [0, 0.003, 1 + z], atol=1e-12)
        moved = np.zeros(len(model.dofs))
        moved[model.index(f"{name}:z")] = 1
        np.testing.assert_allclose(model.mesh.nodes[model.displacements(moved).any(axis=1)][:, 2], 1 + z, atol=1e-12)


def test_a_hole_and_sections_beside_it():
    model = beam(hole=HOLE_A, ends=("clamped", "free"), sections={"middle": 0.1, "tip": 0.3})
    assert model.dofs[-18:-12] == tuple(f"hole:{d}" for d in ("x", "y", "z", "theta_x", "theta_y", "theta_z"))
    assert model.dofs[-1] == "tip:theta_z"
    assert abs(model.references["middle"][2] - 0.1) < 0.003


def test_divisions_and_presets():
    assert len(beam(divisions=(3, 4, 5)).mesh.elements) == 60
    assert len(beam(divisions=(np.int64(3), 4.0, 5)).mesh.elements) == 60
    for preset, formulation in PRESETS.items():
        model = beam(divisions=(2, 2, 8), preset=preset)
        k, m = jf.assemble_bricks(model.mesh.nodes, model.mesh.elements, ALUMINIUM, formulation)
        np.testing.assert_array_equal(model.stiffness.toarray(), k.toarray())
        np.testing.assert_array_equal(model.mass.toarray(), m.toarray())


def test_the_loss_factor_of_the_material_is_that_of_the_model():
    model = jf.brick_beam(*SIZE, jf.Material(70e9, 0.33, 2700.0, 0.04), divisions=(1, 1, 2))
    assert (model.loss_factor, model.structural_damping) == (0.04, None)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(length=0), "length must be positive, not 0 m"),
        (dict(height=-0.1), "height must be positive, not -0.1 m"),
        (dict(width=np.nan), "width must be finite"),
        (dict(preset="fine"), "preset must be one of seed, accurate, not 'fine'"),
        (dict(ends=("free", "pinned")), "ends must be one of free, clamped, not 'pinned'"),
        (dict(ends=("free",)), r"ends must be two of free, clamped, not \('free',\)"),
        (dict(ends="clamped"), "ends must be two of free, clamped, not 'clamped'"),
        (dict(divisions=(1, 1)), r"divisions must be three numbers, along x, y and z, not \(1, 1\)"),
        (dict(divisions=(1, 0, 5)), "divisions along y must be a whole number, at least 1, not 0"),
        (dict(divisions=(1, 2, 2.5)), "divisions along z must be a whole number, at least 1, not 2.5"),
        (dict(divisions=(1, 2, np.nan)), "divisions along z must be finite"),
        (dict(origin=(0, 0)), r"origin must have shape \(3\)"),
        (dict(origin=(0, 0, np.inf)), "origin contains NaN or Inf"),
        (dict(hole=jf.Hole(0.29, 0.0045, 0.0105)), "hole at 290 mm with its ring of radius 10.5 mm"),
        (dict(hole=jf.Hole(0.4, 0.0045, 0.0065)), "hole at 400 mm .* leaves the beam of 300 x 25 mm"),
        (dict(hole=jf.Hole(-0.01, 0.0045, 0.0065)), "hole at -10 mm .* leaves the beam"),
        (dict(hole=jf.Hole(0.15, 0.0045, 0.0125)), "ring of radius 12.5 mm leaves the beam"),
        (dict(hole=jf.Hole(0.15, 0.0065, 0.0045)), "radii 6.5, 4.5 mm must grow from the hole outwards"),
        (dict(hole=jf.Hole(0.15, 0.0, 0.0045)), "radii 0, 4.5 mm must grow from the hole outwards"),
        (dict(sections={"a": 0.31}), "section 'a' at 310 mm lies outside the beam of 300 mm"),
        (dict(sections={"a": -0.01}), "section 'a' at -10 mm lies outside the beam of 300 mm"),
        (dict(sections={"a": np.nan}), "section 'a' must be finite"),
        (dict(sections={"a": 0.1, "b": 0.1001}), "patch 'b' overlaps patch 'a' at x, y, z = "),
        (dict(sections={"a": 0.0}, ends=("clamped", "free")), "patch 'a' overlaps the clamped nodes"),
        (dict(hole=HOLE_A, sections={"hole": 0.1}), "two reference points have the name 'hole'"),
        (dict(hole=HOLE_A, sections={"a": 0.285}), "section 'a' at 285 mm cuts the mesh around the hole"),
        (dict(hole=HOLE_A, sections={"a": 0.2875}), "section 'a' at 287.5 mm cuts the mesh around the hole"),
        (dict(hole=jf.Hole(0.15, 0.0045, 0.0065, name="a:b")), "a patch cannot be named 'a:b'"),
    ],
)
def test_bad_beams_get_one_sentence(change, message):
    arguments = dict(length=0.3, width=0.025, height=0.006, material=ALUMINIUM) | change
    with pytest.raises(ValueError, match=message) as caught:
        jf.brick_beam(**arguments)
    assert "\n" not in str(caught.value)


def test_holes_are_checked():
    with pytest.raises(ValueError, match="face must be one of top, bottom, not 'side'"):
        jf.Hole(0.1, 0.004, 0.006, "side")
    with pytest.raises(ValueError, match="position must be finite"):
        jf.Hole(np.nan, 0.004, 0.006)
    with pytest.raises(TypeError, match="hole must be a Hole, not tuple"):
        beam(hole=(0.1, 0.004, 0.006))
