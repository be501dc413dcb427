"""Plates against closed forms, published values and bricks; joints per length and area against brute force."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy import sparse

import jointfrf as jf
from jointfrf.identification.model.prediction import Prediction, parameter_vector
from jointfrf.models.plate import _Axis

STEEL = {"youngs_modulus": 210e9, "density": 7850.0, "poisson": 0.3}


def bending(thickness: float) -> float:
    return STEEL["youngs_modulus"] * thickness**3 / (12 * (1 - STEEL["poisson"] ** 2))


def mindlin(length: float, width: float, h: float, count: int) -> np.ndarray:
    """Frequencies of a plate on four simply supported edges by Mindlin's theory with k = 5/6: a closed form."""
    rho, d = STEEL["density"], bending(h)
    shear = 5 / 6 * STEEL["youngs_modulus"] / (2 * (1 + STEEL["poisson"])) * h
    found = []
    for m, n in itertools.product(range(1, 9), repeat=2):
        x = (m * np.pi / length) ** 2 + (n * np.pi / width) ** 2
        i = rho * h**3 / 12
        a, b, c = rho * h * i, -(rho * h * (d * x + shear) + shear * x * i), shear * d * x**2
        found.append(np.sqrt((-b - np.sqrt(b**2 - 4 * a * c)) / (2 * a)) / (2 * np.pi))
    return np.sort(found)[:count]


@pytest.mark.parametrize("ratio", [1e-3, 1 / 60, 0.1])
def test_simply_supported_plate_has_the_frequencies_of_mindlin(ratio):
    size = (0.3, 0.2)
    model = jf.plate(*size, ratio * 0.2, elements=(6, 5), edges=("supported",) * 4, **STEEL)
    assert model.natural_frequencies(8) == pytest.approx(mindlin(*size, ratio * 0.2, 8), rel=3e-4)


def test_frequencies_converge_with_the_fourth_order():
    """The error of the eighth frequency falls by more than 2^4 where elements are halved."""
    exact = mindlin(0.3, 0.2, 0.01, 8)[-1]
    errors = [
        jf.plate(0.3, 0.2, 0.01, elements=(n, n), edges=("supported",) * 4, **STEEL).natural_frequencies(8)[-1] / exact
        - 1
        for n in (3, 6)
    ]
    assert 0 < errors[1] < errors[0] / 2**4


@pytest.mark.parametrize(
    ("edges", "values"),
    [  # Leissa, J. Sound Vib. 31 (1973) 257; free and cantilever by the series of Gorman and of Li, to their digits
        (("free",) * 4, [0, 0, 0, 13.468, 19.596, 24.270, 34.801, 34.801, 61.093]),
        (("clamped", "free", "free", "free"), [3.471, 8.507, 21.29, 27.20, 30.96, 54.19]),
        (("clamped",) * 4, [35.985, 73.394, 73.394, 108.22, 131.58, 132.21]),
        (("clamped", "supported", "supported", "supported"), [23.646, 51.674, 58.646, 86.134]),
    ],
)
def test_thin_square_plates_have_published_frequencies(edges, values):
    h, side = 3e-4, 0.3
    model = jf.plate(side, side, h, elements=(6, 6), edges=edges, **STEEL)
    unit = np.sqrt(bending(h) / (STEEL["density"] * h)) / side**2 / (2 * np.pi)
    assert model.natural_frequencies(len(values)) / unit == pytest.approx(values, rel=6e-4, abs=0.01)


def test_bricks_of_a_cantilever_agree():
    """Bricks with incompatible modes, 4.98 mm of 0.3 m, extrapolated from two meshes to none."""
    material = jf.Material(STEEL["youngs_modulus"], STEEL["poisson"], STEEL["density"])
    coarse, fine = (
        jf.brick_beam(
            0.3, 0.274, 0.00498, material, ends=("clamped", "free"), preset="accurate", divisions=(12 * n, 1, 14 * n)
        ).natural_frequencies(8)
        for n in (1, 2)
    )
    model = jf.plate(0.274, 0.3, 0.00498, elements=(4, 4), edges=("free", "free", "clamped", "free"), **STEEL)
    assert model.natural_frequencies(8) == pytest.approx((4 * fine - coarse) / 3, rel=5e-3)
    assert model.natural_frequencies(3) == pytest.approx(((4 * fine - coarse) / 3)[:3], rel=2e-3)


def edge_matrix(model: jf.PointModel, lines: int, length: float, k: float, direction: str) -> sparse.csr_array:
    """The stiffness of an edge y = 0 by the integral of k N N of its elements."""
    axis = _Axis(np.linspace(0, length, lines + 1))
    at = [model.index(f"{node}:{direction}") for node in range(1, axis.nodes.size + 1)]
    entries = sparse.coo_array(k * axis.mass)
    rows, columns = (np.array(at)[own] for own in (entries.row, entries.col))
    return sparse.csr_array(sparse.coo_array((entries.data, (rows, columns)), shape=model.stiffness.shape))


def held(model: jf.PointModel, ends: list[str], laws: dict[str, jf.JointLaw], **names: str) -> jf.Assembly:
    joint = jf.PlacedJoint(jf.LawJoint(laws), ends)
    return jf.Assembly.of_parts({"plate": jf.Substructure(model, exact=True)}, {"clamp": joint})


def test_line_joint_converges_to_the_integral_along_the_edge():
    k, turn, freq = 6e7, 6e4, np.array([30.0, 250.0, 700.0])
    errors = []
    for degree in (4, 8, 12):
        model = jf.plate(
            0.3, 0.25, 0.005, elements=(3, 3), loss_factor=0.01,
            regions={"edge": jf.PlateRegion((0, 0), (0.3, 0), degree)}, **STEEL,
        )  # fmt: skip
        laws = {"z": jf.SpringLaw(k, c=30.0), "theta_x": jf.SpringLaw(turn, h=1e3)}
        whole = held(model, ["plate/edge:z", "plate/edge:theta_x"], laws)
        found = whole.receptance(freq, ["plate/100:z"], ["plate/130:z"])[:, 0, 0]
        by_k = edge_matrix(model, 3, 0.3, 1.0, "z")
        brute = jf.Model(
            model.stiffness + k * by_k + edge_matrix(model, 3, 0.3, turn, "theta_x"), model.mass, model.dofs,
            damping=30.0 * by_k,
            structural_damping=0.01 * model.stiffness + edge_matrix(model, 3, 0.3, 1e3, "theta_x"),
        )  # fmt: skip
        exact = brute.receptance(freq, ["100:z"], ["130:z"])[:, 0, 0]
        errors.append(np.linalg.norm(found - exact) / np.linalg.norm(exact))
    assert errors[0] > errors[1] > errors[2]
    assert errors[2] < 1e-4


def test_face_joint_under_a_whole_plate_moves_its_frequencies():
    """A bedding k of a thin free plate: w^2 = w_0^2 + k / (rho h) of all modes that the polynomials describe."""
    h, k = 0.001, 3e6
    model = jf.plate(0.3, 0.2, h, elements=(4, 4), regions={"bed": jf.PlateRegion((0, 0), (0.3, 0.2), 9)}, **STEEL)
    ports = sparse.vstack([model.shown[port] for port in model.region_ports("bed:z")])
    whole = jf.PointModel(model.stiffness + k * ports.T @ ports, model.mass, model.dofs)
    expected = np.sqrt(model.natural_frequencies(8) ** 2 + k / (STEEL["density"] * h) / (2 * np.pi) ** 2)
    assert whole.natural_frequencies(8) == pytest.approx(expected, rel=1e-4)
    assert model.regions["bed"].size == pytest.approx(0.06, rel=1e-12)
    assert model.regions["bed"].per == "m^2"


def test_stiff_line_joint_makes_one_plate_of_two():
    """Halves whose edges face each other, joined in all motions, are the whole plate: also with nodes of meshes."""
    h, freq = 0.005, np.array([40.0, 150.0, 333.0, 600.0])
    options = {"loss_factor": 0.01, **STEEL}
    whole = jf.plate(0.3, 0.4, h, elements=(4, 6), points={"a": (0.1, 0.05), "b": (0.25, 0.33)}, **options)
    low = jf.plate(
        0.3, 0.2, h, elements=(4, 3), points={"a": (0.1, 0.05)},
        regions={"seam": jf.PlateRegion((0, 0.2), (0.3, 0.2), 12)}, **options,
    )  # fmt: skip
    high = jf.plate(
        0.3, 0.2, h, elements=(3, 3), origin=(0, 0.2, 0), points={"b": (0.25, 0.33)},
        regions={"seam": jf.PlateRegion((0, 0.2), (0.3, 0.2), 12)}, **options,
    )  # fmt: skip
    moves = ("z", "theta_x", "theta_y")
    laws = {"z": jf.SpringLaw(1e13), "theta_x": jf.SpringLaw(1e9), "theta_y": jf.SpringLaw(1e9)}
    seam = jf.PlacedJoint(jf.LawJoint(laws), [f"low/seam:{m}" for m in moves], [f"high/seam:{m}" for m in moves])
    parts = {"low": jf.Substructure(low, exact=True), "high": jf.Substructure(high, exact=True)}
    joined = jf.Assembly.of_parts(parts, {"seam": seam})
    found = joined.receptance(freq, ["low/a:z", "high/b:z"], ["low/a:z"])[:, :, 0]
    exact = whole.receptance(freq, ["a:z", "b:z"], ["a:z"])[:, :, 0]
    assert (np.linalg.norm(found - exact, axis=1) < 8e-3 * np.linalg.norm(exact, axis=1)).all()


def test_regions_of_nodes_are_those_of_the_plate():
    """Trapezoids along nodes and triangles between them against the exact integrals, of the same motions."""
    model = jf.plate(
        0.3, 0.2, 0.005, elements=(6, 4),
        regions={"edge": jf.PlateRegion((0, 0), (0.3, 0), 3), "face": jf.PlateRegion((0, 0), (0.3, 0.2), 2)}, **STEEL,
    )  # fmt: skip
    nodes = [name for name in model.places if name not in model.regions]
    bare = jf.PointModel(model.stiffness, model.mass, model.dofs, places={n: model.places[n] for n in nodes})
    edge = [n for n in nodes if model.places[n][1] == 0]
    found = jf.add_regions(bare, [jf.NodeRegion("edge", edge, 3), jf.NodeRegion("face", nodes, 2)])
    smooth = np.zeros(len(model.dofs))
    for n in nodes:  # w = 1 + x - 2 y + 3 x y
        x, y, _ = model.places[n]
        smooth[model.index(f"{n}:z")] = 1 + x - 2 * y + 3 * x * y
    for name in ("edge", "face"):
        own, exact = found.regions[name], model.regions[name]
        assert own.size == pytest.approx(exact.size, rel=1e-12)
        assert own.centre == pytest.approx(exact.centre, abs=1e-12)
        values = [[(m.shown[p] @ smooth)[0] for p in m.region_ports(f"{name}:z")] for m in (found, model)]
        assert values[0] == pytest.approx(values[1], rel=5e-3, abs=2e-3 * max(map(abs, values[1])))


def test_weights_of_equal_joints_are_lengths_of_nodes():
    """Springs at nodes with the length of each as weight: with all polynomials a region of nodes is the same."""
    model = jf.plate(0.3, 0.2, 0.005, elements=(2, 2), loss_factor=0.01, **STEEL)
    edge = [str(i) for i in range(1, 10)]
    found = jf.add_regions(model, [jf.NodeRegion("edge", edge, len(edge) - 1)])
    spring, step, freq = jf.LawJoint({"z": jf.SpringLaw(4e7, c=50.0)}, mass={"z": 0.3}), 0.3 / 8, [55.0, 210.0, 480.0]
    region = jf.Assembly.of_parts(
        {"p": jf.Substructure(found, exact=True)}, {"e": jf.PlacedJoint(spring, ["p/edge:z"])}
    )
    joints = {
        f"e{node}": jf.PlacedJoint(spring, [f"p/{node}:z"], weight=step if 1 < int(node) < 9 else step / 2)
        for node in edge
    }
    nodes = jf.Assembly.of_parts({"p": jf.Substructure(model, exact=True)}, joints, same=[list(joints)])
    by_region, by_nodes = (one.receptance(freq, ["p/40:z"], ["p/70:z"]) for one in (region, nodes))
    assert by_region == pytest.approx(by_nodes, rel=1e-7)
    assert [one.unit for one in region.joint.quantities] == ["N/m per m", "N s/m per m", "kg per m"]


def test_modal_damping_is_that_of_each_mode():
    model = jf.with_modal_damping(jf.plate(0.3, 0.2, 0.005, elements=(2, 2), **STEEL), [0.01, 0.002, 0.03])
    freq, shapes = model.modes(6)
    modal = shapes.T @ model.damping @ shapes
    expected = np.diag([0, 0, 0, *(4 * np.pi * freq[3:] * [0.01, 0.002, 0.03])])
    assert modal == pytest.approx(expected, abs=1e-6 * expected.max())


ASSEMBLY = """
[parts.plate]
model = "plate"
length = 0.3
width = 0.25
thickness = 0.005
youngs_modulus = 70e9
density = 2700.0
poisson = 0.3
elements = [3, [0, 0.1, 0.18, 0.25]]
loss_factor = 0.002
points = { a = [0.05, 0.23], b = [0.21, 0.17] }
unknown = { youngs_modulus = 0.01 }
exact = true

[[parts.plate.region]]
name = "clamp"
edge = "y-"

[joints.clamp]
j = ["plate/clamp:z", "plate/clamp:theta_x"]

[[joints.clamp.law]]
dof = "z"
law = "spring"
values = { k = 2e7, h = 1.0 }

[[joints.clamp.law]]
dof = "theta_x"
law = "spring"
values = { k = 2e4, h = 1.0 }

[channels]
"1:+z" = "plate/a:z"
"2:+z" = "plate/b:z"
"""


def test_fit_of_a_line_joint_finds_it(tmp_path):
    """The values per length of a file, with their units; saved, read and refused where two nodes are meant."""
    path = tmp_path / "assembly.toml"
    path.write_text(ASSEMBLY)
    freq = np.arange(20.0, 500.0, 2.0)
    names, blank = tuple(map(jf.io.Channel.parse, ["1:+z", "2:+z"])), np.ones((freq.size, 2, 2), complex)
    whole = jf.measured_assembly(path, jf.io.FrfSet(freq, names, names, blank, "receptance")).assembly
    truth = whole.joint.with_values([5e7, 2e5, 3e4, 600.0])
    held = jf.PlacedJoint(
        jf.LawJoint({name: truth.laws[f"clamp.{name}", f"clamp.{name}"] for name in ("z", "theta_x")}),
        ["plate/clamp:z", "plate/clamp:theta_x"],
    )
    h = jf.Assembly.of_parts(whole.parts, {"clamp": held}).receptance(
        freq, ["plate/a:z", "plate/b:z"], ["plate/a:z", "plate/b:z"]
    )
    fit = jf.measured_assembly(path, jf.io.FrfSet(freq, names, names, jf.pollute(h, 0.01, seed=1), "receptance")).fit()
    limits = fit.confidence_interval(0.999)
    for name, value in zip(truth.names, truth.values.tolist(), strict=True):
        low, high = limits[name]
        assert low < value < high
    assert fit.test.is_noise
    assert [one.unit for one in fit.parameters[:4]] == ["N/m per m"] * 2 + ["N m/rad per m"] * 2
    again = jf.load(jf.save(fit, tmp_path / "fit.json") or tmp_path / "fit.json")
    assert again.laws == fit.laws
    assert jf.read_joint(jf.write_joint(tmp_path / "joint.toml", fit.laws)).per == fit.laws.per
    with pytest.raises(ValueError, match="per m"):
        fit.at_point("clamp").laws.export("abaqus", (1, 2))


def test_derivatives_are_differences_of_frfs(tmp_path):
    """Of joints per length with weights, and of numbers with which the plate is built again."""
    path = tmp_path / "assembly.toml"
    content = ASSEMBLY.replace("youngs_modulus = 0.01 }", "thickness = 0.01 }").replace(
        "[3, [0, 0.1, 0.18, 0.25]]", "[2, 2]"
    )
    path.write_text(content.replace('j = ["plate', 'weight = 0.7\nj = ["plate', 1))
    freq, names = np.array([60.0, 170.0, 240.0, 390.0]), ["plate/a:z", "plate/b:z"]
    channels = tuple(map(jf.io.Channel.parse, ["1:+z", "2:+z"]))
    frfs = jf.io.FrfSet(freq, channels, channels, np.ones((freq.size, 2, 2), complex), "receptance")
    whole = jf.measured_assembly(path, frfs).assembly
    prediction = Prediction(whole, freq, names, names)
    vector = parameter_vector(whole, ({}, {}), (), prediction.joint_stiffness())
    values = vector.values.copy()
    values[:4] = 5e7, 2e5, 3e4, 600.0
    assert {one.name for one in vector.fitted} >= {"clamp.k_z", "plate/thickness"}
    slopes = prediction.linearised(vector, values)[1]
    for i, slope in zip(vector.free, slopes, strict=True):
        step = np.zeros(values.size)
        step[i] = 1e-4 * values[i]
        difference = (prediction.frfs(vector, values + step) - prediction.frfs(vector, values - step)) / (2 * step[i])
        assert np.linalg.norm(slope - difference) < 5e-3 * np.linalg.norm(difference), vector.all[i].name


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('edge = "y-"', 'edge = "y-"\nbox = [0, 0, 0.3, 0]', "exactly one"),
        ('edge = "y-"', "box = [0, 0, 0.5, 0]", "within the plate"),
        ('edge = "y-"', 'edge = "y-"\ndegree = [2, 1]', "degree must be a number"),
        ("elements = [3, [0, 0.1, 0.18, 0.25]]", "elements = [3, [0, 0.1, 0.18]]", "must ascend from 0 to 0.25"),
        ("youngs_modulus = 0.01 }", "height = 0.005 }", "unknown number height"),
        ('name = "clamp"', 'name = "12"', "is taken"),
        ('"plate/clamp:theta_x"', '"plate/clamp:theta_z"', "has no DOF 'clamp:theta_z'"),
        ('"1:+z" = "plate/a:z"', '"1:+z" = "plate/clamp:z"', "has a DOF 'plate/clamp:z'"),
        ('dof = "z"', 'dof = "z"\nper = "m^2"', "per m^2"),
    ],
)
def test_wrong_tables_say_what_is_wrong(tmp_path, old, new, words):
    path = tmp_path / "assembly.toml"
    path.write_text(ASSEMBLY.replace(old, new, 1))
    freq = np.arange(20.0, 500.0, 40.0)
    names = tuple(map(jf.io.Channel.parse, ["1:+z", "2:+z"]))
    frfs = jf.io.FrfSet(freq, names, names, np.ones((freq.size, 2, 2), complex), "receptance")
    with pytest.raises(jf.FileContentError, match="(?s).*" + words.replace("^", r"\^")):
        jf.measured_assembly(path, frfs)


def test_regions_that_do_not_fit_together_are_refused():
    def part(degree: int, width: float) -> jf.Substructure:
        region = jf.PlateRegion((0, 0), (width, 0), degree)
        return jf.Substructure(jf.plate(width, 0.2, 0.005, elements=(2, 2), regions={"e": region}, **STEEL), exact=True)

    spring = jf.LawJoint({"z": jf.SpringLaw(1e6)})
    for other in (part(3, 0.3), part(4, 0.2)):
        with pytest.raises(ValueError, match="same size and degree"):
            jf.Assembly.of_parts(
                {"a": part(4, 0.3), "b": other}, {"seam": jf.PlacedJoint(spring, ["a/e:z"], ["b/e:z"])}
            )
    with pytest.raises(ValueError, match="region with a point"):
        jf.Assembly.of_parts(
            {"a": part(4, 0.3), "b": part(4, 0.3)}, {"seam": jf.PlacedJoint(spring, ["a/e:z"], ["b/3:z"])}
        )
    model = jf.plate(0.3, 0.2, 0.005, elements=(1, 1), **STEEL)
    with pytest.raises(ValueError, match="determine 5 of 8"):
        jf.add_regions(model, [jf.NodeRegion("edge", ["1", "2", "3", "4", "5"], 7)])
    places = {"1": np.zeros(3), "2": np.eye(3)[0], "3": np.eye(3)[1], "4": np.eye(3)[2]}
    solid = jf.PointModel(np.eye(4), np.eye(4), tuple(f"{i}:z" for i in range(1, 5)), places=places)
    with pytest.raises(ValueError, match="no straight line"):
        jf.add_regions(solid, [jf.NodeRegion("all", list(places), 1)])
