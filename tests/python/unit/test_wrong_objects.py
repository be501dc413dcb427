"""Objects of another class than the one that is needed get one sentence, not an AttributeError."""

import re

import numpy as np
import pytest

import jointfrf as jf

FREQ = np.arange(1.0, 6.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda h: jf.virtual_points(h, h), "side_j must be a VirtualPoint, not ndarray"),
        (lambda h: jf.virtual_interface(None, h), "side_j must be a VirtualPoint, not NoneType"),
        (lambda h: jf.multi_point_stiffness(h, "j", "k"), "side_j must be a VirtualPoint, not str"),
        (lambda h: jf.multi_point_compliance(h, "j", "k"), "side_j must be a VirtualPoint, not str"),
        (lambda h: jf.sensor_consistency(h, h), "point must be a VirtualPoint, not ndarray"),
        (lambda h: jf.impact_consistency(h, h), "point must be a VirtualPoint, not ndarray"),
        (lambda h: jf.channel_geometry(h, {}), "channel must be a str, not ndarray"),
        (lambda h: jf.elastic_centre(h), "joint must be a Joint, not ndarray"),
        (lambda h: jf.as_bands(None, ["x"], None), "freq_hz must contain real numbers, not object"),
    ],
)
def test_the_argument_is_named(random_lines, call, message):
    with pytest.raises(TypeError, match=f"^{message}$"):
        call(random_lines(5, 2))


def chain():
    return jf.chain([5, 3], [2500, 3500], ground="start")


SPRING = jf.SpringLaw(1e3)
CHANNEL = jf.io.Channel(1, "+x")
BRICK = jf.Mesh(np.eye(8, 3), np.arange(8)[None])
STEEL = jf.Material(210e9, 0.3, 7850.0)
FREQUENCIES = np.linspace(1.0, 9.0, 9)


def swept(**options):
    jf.sweep(jf.invert, {"a": np.ones((2, 1, 1))}, np.zeros((2, 1, 1), complex), **options)


def fitted_law(**options):
    h = np.ones((9, 2, 2)) + np.eye(2)
    return jf.identify(FREQUENCIES, h, **{"dofs": ["x"], "joint": jf.LawJoint({"x": SPRING})} | options)


def half_model():
    """Its modes were those of the diagonal, without a word."""
    return jf.Model(np.array([[3.0, 1.0], [0.0, 4.0]]), np.eye(2), ("x", "y"))


def turned_model():
    return jf.Model(np.array([[3.0, 1.0], [-1.0, 4.0]]), np.eye(2), ("x", "y"))


def realised(**options):
    return jf.identify_realisations(FREQUENCIES, [np.ones((9, 2, 2)) + np.eye(2)], **options)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: jf.Assembly("a", chain(), jf.Joint([1.0])), "a must be a Substructure, not str"),
        (lambda: jf.Substructure(chain(), None), "joint must be a sequence of names, not None"),
        (lambda: jf.Substructure(chain(), ["2:x"], [1]), "unknowns must be a mapping of names to Unknown, not list"),
        (lambda: jf.LawJoint([SPRING]), "laws must be a mapping by the names of DOFs"),
        (lambda: jf.LawJoint({"x": SPRING}, mass=[1.0]), "mass must be a mapping by the names of DOFs"),
        (lambda: jf.LawJoint({"x": SPRING}, rigid=True), "rigid must be a sequence of names, not True"),
        (lambda: jf.LawJoint.of_joint([1.0]), "joint must be a Joint, not list"),
        (lambda: jf.LawField("k", "stiffness").unit(10**20), "rotations must be 0, 1 or 2, not 1000"),
        (lambda: jf.FunctionLaw(1, 2, 3, [1.0]), "fields must be a sequence of LawField, not int"),
        (lambda: jf.SpringLaw(1.0, c=np.ones(2)), "c must be one real number, not array"),
        (lambda: jf.AddedMass((), 0.1), "dofs must name at least one DOF"),
        (lambda: jf.GroundSpring(3, 1.0), "dof must be a str, not int"),
        (lambda: jf.Unknown(1.0, lower=[0.0]), "bounds must be real numbers, not"),
        (lambda: jf.difference_error(0.01, [1.0, 2.0], 1.0), "bending_stiffness must be one real number, not"),
        (lambda: jf.central_difference(np.eye(2)[None], 0.1, sign=[]), "sign must be one real number, not"),
        (lambda: jf.interface([1], [2], ["y"], None), "coordinates must be a mapping of nodes to x, y, z"),
        (lambda: jf.interface(None, [2], ["y"], {}), "points_j must be a list of node numbers, not None"),
        (lambda: jf.append_virtual_point(np.eye(3)[None], [0], [1.0]), "point must be a VirtualPoint, not list"),
        (lambda: jf.interpolation([(1, 2)], [[0, 0, 0]]), "mesh must be a Mesh, not list"),
        (lambda: jf.Mesh(np.zeros((8, 3)), np.array([[0, 1, 2, 3, 4, 5, 6, 8]])), "elements must name nodes 0 to 7"),
        (lambda: jf.Mesh(np.zeros((8, 3)), np.zeros((1, 7), int)), "elements must contain eight node numbers each"),
        (lambda: jf.places_of_nodes(None, [1], [2]), "frfs must be a FrfSet, not NoneType"),
        (lambda: jf.assemble(chain(), "b", jf.Joint([1.0]), [0], [0]), "b must be a Model, not str"),
        (lambda: jf.Model(3.0, np.eye(2), ("x", "y")), r"stiffness must be a square matrix, not of shape \(\)"),
        (lambda: chain().index([1.0]), r"names must be a sequence of names, not"),
        (lambda: jf.beam([], 3, youngs_modulus=1, density=1, width=1, height=1), "length must be one real number"),
        (lambda: jf.beam(1e-300, 3, youngs_modulus=1, density=1, width=1, height=1), "length 1e-300 m, width 1 m"),
        (lambda: jf.beam(1, 3, youngs_modulus=1, density=1, width=1e-320, height=1e-9), "no second moment of area"),
        (lambda: jf.Joint([1.0], dofs=False), "dofs must be a sequence of names, not False"),
        (lambda: jf.Joint([1.0, [2.0]]), "stiffness must be an array of numbers: its rows differ in length or kind"),
        (lambda: jf.Joint([1.0, 2.0], loss_factor=[1, 2, 3]), r"loss_factor must have shape \(2\), not \(3,\)"),
        (lambda: jf.pollute(np.ones((1, 1, 1)), 0.1, seed=None), "seed must be a whole number, not None"),
        (lambda: jf.io.Channel(None, "+y"), "node must be a whole number, not None"),
        (lambda: jf.io.Channel(1, 2.0), "direction must be a str, not float"),
        (lambda: jf.study(np.zeros((9, 9)), "out"), "case must be the name or the folder of a case, not array"),
        (
            lambda: jf.io.FrfSet([1.0], (), (), np.zeros((1, 0, 0)), coordinates=[1]),
            "coordinates must map nodes to places, not list",
        ),
        (lambda: jf.io.FrfSet([1.0], None, (), [[[1.0]]]), "responses must be a tuple of Channel, not NoneType"),
        (lambda: jf.io.merge_frfs(np.zeros(0)), "sets must be a list of FrfSet"),
        (lambda: jf.io.read_frfs("none", mapping=[1]), "mapping must be a mapping or an FrfMapping, not list"),
        (lambda: jf.io.read_uff("none", nodes=3), "nodes must be a list of node numbers, not 3"),
        (lambda: jf.io.write_npz("none", 3), "frfs must be a FrfSet, not int"),
        (lambda: jf.io.write_uff("none", 3), "frfs must be a FrfSet, not int"),
        (lambda: jf.smooth_frfs(FREQUENCIES, np.ones((9, 1, 1)), max_poles=None), "max_poles must be a whole number"),
        (lambda: jf.estimate_noise(FREQUENCIES, np.ones((9, 1, 1)), like="x"), "like must be a NoiseModel, not str"),
        (lambda: jf.propose_bands(FREQUENCIES, FREQUENCIES, drop_db="x"), "drop_db must be one real number, not 'x'"),
        (lambda: jf.band_mean(FREQUENCIES, np.ones((9, 1, 1)), dofs=False), "dofs must be a sequence of names"),
        (lambda: jf.solid_model(BRICK, STEEL, clamped=[0, [1, 2]]), "clamped must be an array of numbers"),
        (lambda: jf.io.frfs_of_arrays([1.0], [[[1.0]]], [[[1.0] * 99] * 9], ["1:x"]), r"has .* in its responses"),
        (lambda: jf.rigid_offset(np.array([["x"]]), [0, 0, 0]), "dofs must be a sequence of names, not"),
        (lambda: jf.as_bands({}, ["a\nb"], FREQUENCIES), r"dofs must contain names without line breaks, not 'a\\nb'"),
        (lambda: jf.StudyDesign([1]), "factors must be a Mapping, not list"),
        (lambda: jf.StudyDesign({"noise": None}), "factor 'noise' is None; give a list of values"),
        (lambda: jf.StudyDesign({"noise": "0.1"}), "factor 'noise' is '0.1'; give a list of values"),
        (lambda: jf.StudyDesign({"noise": [None]}), "factor 'noise' has the value None; give numbers or words"),
        (lambda: jf.StudyDesign({3: [1.0]}), "factors must be a sequence of names"),
        (lambda: jf.StudyDesign(estimators="ismm"), "estimators must be a sequence of names, not 'ismm'"),
        (lambda: jf.StudyDesign(estimators={"mine": 3}), "estimators: 'mine' is 3; give a function"),
        (lambda: jf.StudyDesign(own_noises={"mine": None}), "own_noises: 'mine' is None; give a function"),
        (lambda: jf.study("3.1", "none", 2, design={"noise": [1.0]}), "design must be a StudyDesign, not dict"),
        (lambda: jf.study("3.1", "none", 2, progress=3), "progress must be a function, not int"),
        (lambda: swept(jobs=0), "jobs must be at least 1, not 0"),
        (lambda: swept(jobs="2"), "jobs must be a whole number, not '2'"),
        (lambda: swept(jobs=1.5), "jobs must be a whole number, not 1.5"),
        (lambda: swept(executor="processes"), "executor is a str; give one of concurrent.futures"),
        (lambda: swept(executor=list), "executor returned a list; let it return"),
        (lambda: swept(progress=False, jobs=1), "progress must be a function, not bool"),
        (lambda: swept(plan=1, jobs=1), "plan must be a SweepPlan, not int"),
        (lambda: jf.smooth_frfs([], np.zeros((0, 1, 1))), "h has no FRFs, its shape is 0 x 1 x 1"),
        (lambda: fitted_law(dofs=np.zeros((2, 2))), "dofs must be a sequence of names, not"),
        (lambda: fitted_law(cross=np.zeros(2)), "do not go with joint, which states the laws"),
        (lambda: jf.write_joint("a\nb", jf.Joint([1.0])), r"name a file that ends in .toml, not 'a\\nb'"),
        (lambda: half_model().modes(), "stiffness contains its upper triangle only"),
        (lambda: half_model().natural_frequencies(1), "stiffness contains its upper triangle only"),
        (lambda: turned_model().modes(), "stiffness is not symmetric: the model has no real modes"),
        (lambda: jf.beam(1, 3, youngs_modulus=1, density=1, width=1, height=1, poisson=-1), "poisson must lie between"),
        (lambda: jf.merge_studies("one", "all"), "parts is 'one'; give a list of folders"),
        (lambda: jf.merge_studies(2, "all"), "parts is 2; give a list of folders"),
        (lambda: jf.joint_channels(None, 3.0, [0, 0, 0]), "places must be a list of ChannelPlace, not float"),
        (lambda: jf.virtual_point(np.eye(3), np.eye(3), [0, 0, 0], dofs=3), "dofs must be a sequence of names, not 3"),
        (lambda: jf.bolted_lap((0.1, 0.1, 0.1)), "lengths must be a pair, of A and of B, not"),
        (lambda: jf.bolted_lap(ends=["free"]), "ends must be a pair, of A and of B, not"),
        (lambda: jf.bolted_lap(materials=(STEEL, None)), "materials must be a Material, not NoneType"),
        (lambda: jf.bolted_lap(bolt=8), "bolt must be a Bolt, not int"),
        (lambda: jf.bolted_lap(divisions=2), "divisions must be a LapDivisions, not int"),
        (lambda: jf.preload([1], 5e3), "lap must be a BoltedLap, not list"),
        (lambda: next(realised(start=0.5)), "start must be a FitStart, not float"),
        (lambda: next(realised(damping=0.5)), "damping must be a sequence of names, not 0.5"),
        (lambda: next(realised(dofs=3)), "dofs must be a sequence of names, not 3"),
        (lambda: jf.check_frfs(FREQUENCIES, np.ones((9, 1, 1)), names=3), "names must be a sequence of names, not 3"),
        (lambda: jf.check_frfs(FREQUENCIES, np.ones((9, 1, 1)), names="x"), "names must be a sequence of names, not"),
        (lambda: jf.Joint([1.0], dofs=["x"]).export("ansys", {1: 2}), "nodes must be two different nodes, not"),
        (lambda: jf.Joint([1.0], dofs=["x"]).export("ansys", {"x": 1, 3: 2}), "nodes must be a list of node numbers"),
        (lambda: jf.assemble(chain(), chain(), 1e3, [1], [0]), "joint must be a Joint or a LawJoint, not float"),
        (lambda: jf.levels(3, [jf.Drive("force", 1.0)]), "give a sequence of Fit"),
        (lambda: jf.write_plan(3, "plan.html"), "plan must be a MeasurementPlan or a JointFrfPlan, not int"),
        (
            lambda: jf.io.FrfSet([1.0], [CHANNEL], [CHANNEL], np.ones((1, 1, 1)), "receptance").matrix(3, [CHANNEL]),
            "outputs must be a sequence of channels, not int",
        ),
    ],
)  # fmt: skip
def test_one_sentence_of_our_own(call, message):
    """All of these were AttributeError, IndexError, ZeroDivisionError, or a sentence of numpy's."""
    with pytest.raises((TypeError, ValueError), match=message) as raised:
        call()
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 300


def test_one_text_is_no_sequence_of_names():
    """Its letters would be names of DOFs."""
    with pytest.raises(TypeError, match="dofs must be a sequence of names, not 'xy'"):
        jf.Model(np.eye(2), np.eye(2), dofs="xy")


class Tensor:
    """An array of another library, as torch has them: it becomes a numpy array, or says why not."""

    def __init__(self, values, refusal=None):
        self.values, self.refusal = values, refusal

    def __array__(self, dtype=None, copy=None):
        if self.refusal:
            raise self.refusal
        return self.values if dtype is None else self.values.astype(dtype)


def test_arrays_of_other_libraries():
    a = np.array([[[2.0 + 1j]]] * 5)
    np.testing.assert_array_equal(jf.invert(Tensor(a)), jf.invert(a))
    for refusal in (RuntimeError("Can't call numpy() on Tensor that requires grad."), TypeError("can't convert\ncuda")):
        message = f"does not become a numpy array: {' '.join(str(refusal).split())}"
        with pytest.raises(TypeError, match=re.escape(f"a {message}")):
            jf.invert(Tensor(a, refusal))
        with pytest.raises(TypeError, match=re.escape(f"gamma {message}")):
            jf.identify(np.arange(1.0, 6.0), Tensor(a, refusal), ["x"])
