"""The preloaded bolt in solid elements: its mesh, its static state, and its vibrations."""

from dataclasses import replace

import numpy as np
import pytest

from jointfrf.workbench.cases.bolted_lap.contact import ContactLaw
from jointfrf.workbench.cases.bolted_lap.lap import (
    ALUMINIUM,
    PROOF_STRENGTH,
    STRESS_AREA,
    Bolt,
    LapDivisions,
    bolted_lap,
    preload_force,
)
from jointfrf.workbench.cases.bolted_lap.preload import preload

FORCE = 22784.0
COARSE = LapDivisions(across=4, rings=1, circles=0, head=1, nut=1)
RIGID = ContactLaw(0.3, None, None)
# Natural frequencies of the same joint in CalculiX: 4280 other C3D8I bricks, contact between surfaces, Hz.
CALCULIX = [14.65, 60.43, 86.86, 261.3, 345.0, 484.8, 552.9]


@pytest.fixture(scope="module")
def default():
    """Case study 2."""
    tight = preload(bolted_lap(), FORCE)
    return tight, tight.model()


@pytest.fixture(
    scope="module",
    params=[LapDivisions(across=6, circles=1), pytest.param(LapDivisions(), marks=pytest.mark.long)],
    ids=["coarse", "default"],
)
def meshed(request):
    """Case study 2, on a mesh that shows the same and on its own."""
    if request.param == LapDivisions():
        return request.getfixturevalue("default")
    tight = preload(bolted_lap(divisions=request.param), FORCE)
    return tight, tight.model()


@pytest.fixture(scope="module")
def short():
    """Short beams on a coarse mesh, for what does not need more."""
    return bolted_lap((0.1, 0.08), divisions=COARSE)


def volumes(mesh):
    """Of bricks, by 2 x 2 x 2 points."""
    signs = np.array([[x, y, z] for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    total = np.zeros(len(mesh.elements))
    for point in signs / np.sqrt(3):
        factors = 1 + signs * point
        slopes = signs * np.stack([np.delete(factors, i, 1).prod(1) for i in range(3)], 1) / 8
        total += np.linalg.det(np.einsum("nj,eni->eij", slopes, mesh.nodes[mesh.elements]))
    return total


def polygon(radius, corners):
    return corners / 2 * radius**2 * np.sin(2 * np.pi / corners)


def test_bodies_and_interfaces_of_the_mesh():
    bolt = Bolt(head_radius=0.0075, nut_radius=0.006)
    heights = (0.005, 0.008)
    lap = bolted_lap((0.2, 0.15), heights, 0.03, 0.04, bolt=bolt, divisions=LapDivisions(across=6))
    owners = [np.unique(lap.mesh.elements[lap.elements(body)]) for body in ("A", "B", "bolt")]
    assert sum(len(o) for o in owners) == len(lap.mesh.nodes) == len(np.unique(np.concatenate(owners)))
    bounds = [(lap.mesh.nodes[o].min(0), lap.mesh.nodes[o].max(0)) for o in owners]
    assert np.allclose(bounds[0], [[-0.015, 0, 0], [0.015, 0.005, 0.2]], atol=1e-12)
    assert np.allclose(bounds[1], [[-0.015, -0.008, 0.16], [0.015, 0, 0.31]], atol=1e-12)
    assert np.allclose(bounds[2][0][1], -0.008 - bolt.nut_height)
    assert np.allclose(bounds[2][1][1], 0.005 + bolt.head_height)
    assert np.allclose(lap.axis, [0, 0, 0.18])

    hole, shank, head, nut = (polygon(r, 24) for r in (0.0045, bolt.shank_radius, 0.0075, 0.006))
    size = volumes(lap.mesh)
    expected = [(0.03 * 0.2 - hole) * 0.005, (0.03 * 0.15 - hole) * 0.008]
    expected += [shank * sum(heights) + head * bolt.head_height + nut * bolt.nut_height]
    assert [size[lap.elements(b)].sum() for b in ("A", "B", "bolt")] == pytest.approx(expected, rel=1e-12)

    touching = {"head": head - hole, "lap": 0.03 * 0.04 - hole, "nut": nut - hole}
    for name, pairs in lap.interfaces.items():
        assert np.allclose(lap.mesh.nodes[pairs.lower], lap.mesh.nodes[pairs.upper], atol=1e-15)
        assert pairs.area.sum() == pytest.approx(touching[name], rel=1e-12)
        assert not np.intersect1d(pairs.lower, pairs.upper).size
    assert set(lap.clamped) == set(np.flatnonzero(lap.mesh.nodes[:, 2] < 1e-12))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"width": -0.1}, "width must be positive"),
        ({"lengths": (0.3, 0.0)}, "lengths must be positive"),
        ({"overlap": 0.31}, "overlap .* must not exceed the lengths"),
        ({"hole_radius": 0.004}, "hole_radius .* must exceed the shank_radius"),
        ({"hole_radius": 0.0065}, "head_radius .* must exceed hole_radius"),
        ({"overlap": 0.0125}, "head_radius .* must stay within the overlap"),
        ({"width": 0.013}, "head_radius .* must stay within the overlap"),
        ({"bolt": Bolt(nut_radius=0.0125)}, "nut_radius .* must stay within the overlap"),
        ({"ends": ("clamped", "hinged")}, "ends must be one of"),
        ({"preset": "best"}, "preset must be one of"),
        ({"overlap": 0.0135, "width": 0.2}, "a brick of A near .* has a scaled Jacobian"),
    ],
)
def test_impossible_geometry(change, message):
    with pytest.raises(ValueError, match=message):
        bolted_lap(**change)


def test_impossible_bolts_and_divisions():
    with pytest.raises(ValueError, match=r"head_radius .* must exceed shank_radius"):
        Bolt(head_radius=0.003)
    with pytest.raises(ValueError, match="nut_height must be positive"):
        Bolt(nut_height=0.0)
    with pytest.raises(ValueError, match="across must be a whole number, at least 1"):
        LapDivisions(across=0)
    with pytest.raises(ValueError, match="layers must be a whole number"):
        LapDivisions(layers=1.5)


def test_preload_of_bolts():
    assert preload_force(STRESS_AREA["M8"], PROOF_STRENGTH["10.9"]) == pytest.approx(FORCE, abs=1)
    # Stress areas of the table are those of the mean of pitch and minor diameter, rounded.
    for name, pitch in (("M5", 0.8), ("M6", 1.0), ("M8", 1.25), ("M10", 1.5), ("M12", 1.75)):
        area = np.pi / 4 * (float(name[1:]) - 0.9382 * pitch) ** 2
        assert 1e6 * STRESS_AREA[name] == pytest.approx(area, rel=2e-3)
    # The first number of a class is a hundredth of the strength in MPa, the second the share of yield; proof is less.
    for name, proof in PROOF_STRENGTH.items():
        strength, share = name.split(".")
        assert 0.85 < proof / (1e8 * float(strength) * float(share) / 10) < 1.0
    for bad in ((0, 1e6), (1e-6, -1), (1e-6, 1e6, 1.2)):
        with pytest.raises(ValueError, match="must"):
            preload_force(*bad)


@pytest.mark.long
def test_static_state_of_the_case_study(default):
    tight, _ = default
    assert len(tight.lap.mesh.elements) == 3840
    assert len(tight.history) <= 5
    assert tight.history[-1].changed == 0
    assert tight.history[-1].residual < 1e-10
    for state in tight.interfaces.values():
        assert state.normal_force == pytest.approx(FORCE, rel=1e-8)
        assert not state.slipping.any()
        assert state.slip_ratio.max() < 0.9
    assert 1e6 * tight.elongation == pytest.approx(81.4, rel=0.05)
    assert 0.009 < tight.contact_radius < 0.0105
    assert tight.interfaces["head"].closed.all()
    assert tight.interfaces["nut"].closed.all()


def test_forces_balance_on_every_body(meshed):
    tight, _ = meshed
    at = {name: tight.lap.mesh.nodes[pairs.upper] for name, pairs in tight.lap.interfaces.items()}
    force = {name: state.force for name, state in tight.interfaces.items()}
    # The bolt: head on its upper side, nut below. B: lap above, nut below; nothing else holds it.
    for upper, lower in (("head", "nut"), ("nut", "lap")):
        resultant = force[upper].sum(0) - force[lower].sum(0)
        moment = np.cross(at[upper] - tight.lap.axis, force[upper]).sum(0)
        moment -= np.cross(at[lower] - tight.lap.axis, force[lower]).sum(0)
        assert abs(resultant).max() < 1e-7 * FORCE
        assert abs(moment).max() < 1e-7 * FORCE * 0.01


def test_pressure_is_symmetric(meshed):
    tight, _ = meshed
    for name, pairs in tight.lap.interfaces.items():
        place = tight.lap.mesh.nodes[pairs.upper]
        mirrored = place * [-1, 1, 1]
        partner = np.linalg.norm(place[:, None] - mirrored, axis=2).argmin(axis=0)
        pressure = tight.interfaces[name].pressure
        assert abs(pressure - pressure[partner]).max() < 1e-7 * pressure.max()
        assert pressure.min() >= 0


def test_pressure_maps(meshed):
    tight, _ = meshed
    maps = tight.pressure_maps()
    assert list(maps) == ["head", "lap", "nut"]
    for name, one in maps.items():
        corners = one.points[one.quads]
        d1, d2 = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
        area = abs(d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]) / 2
        assert area.sum() == pytest.approx(tight.lap.interfaces[name].area.sum(), rel=1e-12)
        assert (one.pressure[one.quads].mean(axis=1) * area).sum() == pytest.approx(FORCE, rel=0.03)
        assert (one.pressure[~one.closed] == 0).all()


def test_frequencies_of_the_case_study(meshed):
    tight, model = meshed
    freq = model.natural_frequencies(7)
    if len(tight.lap.mesh.elements) < 3000:  # a coarser mesh is stiffer, by less where the joint turns less
        assert (freq > CALCULIX).all()
        assert abs(freq / CALCULIX - 1).max() < 0.012
        return
    assert abs(freq / CALCULIX - 1).max() < 0.0015
    # The same with other meshes; the fifth mode, which turns the joint, depends on them most.
    assert abs(freq / [14.67, 60.48, 86.94, 261.4, 346.8, 485.6, 554.2] - 1).max() < 0.005


@pytest.mark.long
def test_frequencies_of_one_point_bricks():
    lap = bolted_lap(preset="seed")
    freq = preload(lap, FORCE).model().natural_frequencies(7)
    assert abs(freq / [12.79, 59.88, 75.78, 228.0, 342.4, 423.3, 487.8] - 1).max() < 0.004


def test_model_takes_its_outputs_from_all_nodes(meshed):
    tight, model = meshed
    assert isinstance(model.dofs, tuple)
    assert model.loss_factor == 0.01
    assert model.structural_damping is None
    mass = volumes(tight.lap.mesh) @ [m.density for m in tight.lap.element_materials()]
    whole = np.ones(model.expansion.shape[1])
    # A rigid translation of all that is not clamped; the clamped face takes its share of the first bricks.
    moving = model.mass.sum() / 3
    assert moving == pytest.approx(mass, rel=0.01)
    shape = model.displacements(whole)
    assert (shape[tight.lap.clamped] == 0).all()
    assert (np.delete(shape, tight.lap.clamped, axis=0) == 1).all()


def test_the_contacts_do_not_depend_on_the_preload(short):
    one, two = preload(short, 1.0), preload(short, 5e4)
    assert two.elongation == pytest.approx(5e4 * one.elongation, rel=1e-9)
    for name in short.interfaces:
        assert (one.interfaces[name].closed == two.interfaces[name].closed).all()
        assert (one.interfaces[name].slipping == two.interfaces[name].slipping).all()
    assert np.allclose(5e4 * one.displacement, two.displacement, atol=1e-9 * abs(two.displacement).max())


def test_elongation_against_springs_in_series(short):
    """Bolt and clamped parts as bars: shank with 0.4 diameters of head and nut, pressure in cones of 30 degrees."""
    tight = preload(short, FORCE, RIGID)
    diameter, grip = 0.008, 0.012
    bolt = 210e9 * np.pi / 4 * diameter**2 / (grip + 0.8 * diameter)
    washer, slope = 0.013, np.tan(np.pi / 6)
    wide = washer + slope * grip
    hole = 0.009
    frustum = np.log((wide - hole) * (washer + hole) / ((wide + hole) * (washer - hole)))
    clamped = np.pi * 70e9 * hole * slope / (2 * frustum)
    assert tight.elongation == pytest.approx(FORCE * (1 / bolt + 1 / clamped), rel=0.2)


def test_friction_stiffens(short):
    free, held = (preload(short, FORCE, ContactLaw(mu, None, None)) for mu in (0.0, 1e6))
    assert held.elongation < free.elongation < 1.1 * held.elongation
    for tight in (free, held):
        assert [s.normal_force for s in tight.interfaces.values()] == pytest.approx([FORCE] * 3, rel=1e-7)
    assert not any(s.slipping.any() for s in held.interfaces.values())
    assert all((s.slipping == s.closed)[s.closed].all() for s in free.interfaces.values())

    # Held, nothing moves as a rigid body; without friction, B slides and turns on A, and the bolt in its hole.
    assert held.model().natural_frequencies(1)[0] > 50
    loose = free.model().natural_frequencies(7)
    assert (loose[:6] < 0.5).all()
    assert loose[6] > 20


def test_stiff_springs_become_ties(short):
    tied, sprung = (preload(short, FORCE, ContactLaw(1e6, *two)) for two in ((None, None), (1e17, 1e17)))
    assert sprung.elongation == pytest.approx(tied.elongation, rel=1e-3)
    freq = [one.model().natural_frequencies(6) for one in (tied, sprung)]
    assert freq[1] == pytest.approx(freq[0], rel=1e-4)
    assert (freq[1] <= freq[0] * (1 + 1e-6)).all()
    assert len(tied.model().dofs) < len(sprung.model().dofs)


def test_loss_factors_that_differ(short):
    lap = replace(short, materials=(ALUMINIUM, ALUMINIUM, replace(Bolt().material, loss_factor=0.0)))
    model = preload(lap, FORCE).model()
    assert model.loss_factor == 0
    freq, shapes = model.modes(1)
    loss = shapes[:, 0] @ (model.structural_damping @ shapes[:, 0]) / (2 * np.pi * freq[0]) ** 2
    assert 0.005 < loss < 0.01


def test_what_cannot_carry_a_preload(short):
    for force in (0.0, -5.0):
        with pytest.raises(ValueError, match="force must be positive"):
            preload(short, force)
    with pytest.raises(ValueError, match="lap is not supported: one of its ends must be clamped"):
        preload(bolted_lap((0.1, 0.08), ends=("free", "free"), divisions=COARSE), FORCE)
    with pytest.raises(ValueError, match="did not converge in 1 iterations"):
        preload(short, FORCE, max_iterations=1)
    # Held at the other end, all is well.
    other = preload(bolted_lap((0.08, 0.1), ends=("free", "clamped"), divisions=COARSE), FORCE)
    here = preload(short, FORCE)
    assert other.elongation == pytest.approx(here.elongation, rel=0.02)
