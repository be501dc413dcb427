"""Statics and natural frequencies against CalculiX, where it is installed (Debian: calculix-ccx)."""

import shutil
import subprocess
import sys

import numpy as np
import pytest
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

import jointfrf as jf
from calculix_deck import deck, displacements, frequency_step, natural_frequencies, run, static_step, stored_matrices
from jointfrf.workbench.cases.bolted_lap.contact import ContactLaw
from jointfrf.workbench.cases.bolted_lap.lap import BODIES, LapDivisions, bolted_lap
from jointfrf.workbench.cases.bolted_lap.preload import preload
from jointfrf.workbench.solids.brick import Material
from jointfrf.workbench.solids.brick_beam import brick_beam
from jointfrf.workbench.solids.mesh import extrude, rectangle

CCX = shutil.which("ccx")
pytestmark = pytest.mark.skipif(CCX is None, reason="CalculiX (ccx) is not on PATH")
ALUMINIUM = Material(70e9, 0.33, 2700.0)
# Higher modes come out lower in CalculiX, which gives the inner functions of its bricks a mass: by the square of the
# size of a brick over the wavelength.
FIRST, ALL = 1e-4, 4e-3


def test_frequencies_of_a_cantilever(tmp_path):
    beam = brick_beam(0.3, 0.025, 0.006, ALUMINIUM, ends=("clamped", "free"))
    held = np.flatnonzero(beam.mesh.nodes[:, 2] < 1e-9)
    bodies = {"A": (range(len(beam.mesh.elements)), ALUMINIUM)}
    theirs = natural_frequencies(CCX, deck(beam.mesh, bodies, held, frequency_step(8)), tmp_path)
    ours = beam.natural_frequencies(8)
    assert ours[:3] == pytest.approx(theirs[:3], rel=FIRST)
    assert ours == pytest.approx(theirs, rel=1e-3)


@pytest.fixture(
    scope="module",
    params=[pytest.param(ContactLaw(1e6, None, None), marks=pytest.mark.long), ContactLaw()],
    ids=["ties", "springs"],
)
def joint(request):
    """A preloaded lap joint, and the linear model of its contacts in CalculiX."""
    lap = bolted_lap((0.15, 0.12), divisions=LapDivisions(across=6, rings=1, circles=1))
    tight = preload(lap, 22784.0, request.param)
    ties, springs = [], []
    for name, pairs in lap.interfaces.items():
        state = tight.interfaces[name]
        assert not state.slipping.any()
        for i in np.flatnonzero(state.closed):
            both = (pairs.upper[i], pairs.lower[i])
            if request.param.normal_stiffness is None:
                ties += [(*both, axis) for axis in range(3)]
            else:
                springs += [(*both, axis, k * pairs.area[i]) for axis, k in enumerate([1e13, 1e14, 1e13])]
    bodies = {name: (lap.elements(name), m) for name, m in zip(BODIES, lap.materials, strict=True)}
    return tight, lambda step: deck(lap.mesh, bodies, lap.clamped, step, ties, springs)


def test_frequencies_of_a_preloaded_lap_joint(joint, tmp_path):
    tight, text = joint
    theirs = natural_frequencies(CCX, text(frequency_step(7)), tmp_path)
    ours = tight.model().natural_frequencies(7)
    assert ours[:2] == pytest.approx(theirs[:2], rel=FIRST)
    assert ours == pytest.approx(theirs, rel=ALL)


def test_stiffness_of_a_preloaded_lap_joint(joint, tmp_path):
    tight, text = joint
    model, force = tight.model(), np.array([3.0, 1.0, 50.0])
    tip = model.mesh.near([0.0, -0.003, model.mesh.nodes[:, 2].max()])
    theirs = displacements(CCX, text(static_step(tip, force)), tmp_path)
    load = np.zeros(model.expansion.shape[0])
    load[3 * tip : 3 * tip + 3] = force
    ours = model.displacements(splu(csc_array(model.stiffness)).solve(model.expansion.T @ load))
    # Both pass the patch test on bricks that are not rectangular, by inner functions that differ a little.
    assert abs(ours - theirs).max() < 1e-3 * abs(theirs).max()


@pytest.mark.long
def test_matrices_that_calculix_stores_give_its_frequencies(tmp_path):
    """Its deck, its matrices, its frequencies; mass and rigid motions are said."""
    beam = brick_beam(0.3, 0.025, 0.006, ALUMINIUM)
    bodies = {"A": (range(len(beam.mesh.elements)), ALUMINIUM)}
    text = stored_matrices(CCX, deck(beam.mesh, bodies, (), ["*FREQUENCY, SOLVER=MATRIXSTORAGE", "1"]), tmp_path)
    part = jf.read_part(text)
    theirs = natural_frequencies(CCX, deck(beam.mesh, bodies, (), frequency_step(14)), tmp_path / "modes")
    found = part.structure.model.natural_frequencies(14)
    assert found[6:] == pytest.approx(theirs[6:], rel=1e-6)
    lines = "\n".join(part.describe())
    assert (
        "model.sti, model.mas (CalculiX, SI); the upper triangle is stored, the rest was completed by symmetry" in lines
    )
    assert f"mass {0.3 * 0.025 * 0.006 * 2700:.4g} kg, centre of gravity" in lines
    assert "6 rigid motions are free" in lines
    assert "warning" not in lines


LARGE = """
import resource, sys, warnings
import numpy as np
import jointfrf as jf
from jointfrf.io import Channel, FrfSet

freq = np.arange(20.0, 420.0, 3.0)
dofs = ["A/1:y", "A/@0.1,0.012,0.3:y", "B/@0,0,0.9:y"]
blank = np.ones((freq.size, 3, 1), complex)
channels = [Channel(n, "+y") for n in (1, 2, 3)]
believed = jf.measured_assembly("assembly.toml", FrfSet(freq, channels, channels[:1], blank, "receptance"))
joint = jf.LawJoint({"y": jf.SpringLaw(3e6, h=6e4), "theta_x": jf.SpringLaw(8e3, h=80.0)})
truth = jf.Assembly(believed.assembly.a, believed.assembly.b, joint)
h = jf.pollute(truth.receptance(freq, believed.responses, believed.forces), 0.02, seed=4)
del truth
warnings.simplefilter("ignore")
measured = jf.measured_assembly("assembly.toml", FrfSet(freq, channels, channels[:1], h, "receptance"))
fit = measured.fit()
low, high = fit.confidence_interval(0.99)["k_theta_x"]
assert low < 8e3 < high, (low, high)
print(len(measured.parts["A"].structure.model.dofs), 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.long
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="memory as Linux counts it")
def test_a_part_of_a_hundred_thousand_dofs_within_three_gigabytes(tmp_path):
    text = ""
    for name, long, count, start in (("A", 0.6, (120, 70, 3), 0.0), ("B", 0.3, (12, 8, 1), 0.6)):
        z, x, y = (np.linspace(0, size, n + 1) for size, n in zip((long, 0.2, 0.012), count, strict=True))
        mesh = extrude((rectangle(start + z, x), y))
        steel = {"E": (range(len(mesh.elements)), Material(210e9, 0.3, 7850.0))}
        step = ["*FREQUENCY, SOLVER=MATRIXSTORAGE", "1"]
        run(CCX, deck(mesh, steel, (), step).replace("C3D8I", "C3D8"), tmp_path / name)
        ends = {"stiffness": "sti", "mass": "mas", "nodes": "inp"}
        files = "".join(f'{key} = "{name}/model.{end}"\n' for key, end in ends.items())
        text += f'[{name}]\nmodel = "matrices"\n{files}units = "SI"\nloss_factor = 0.002\nexact = true\n'
        text += f'joint = ["end:y", "end:theta_x"]\n[[{name}.point]]\nname = "end"\n'
        text += "box = [-1, -1, 0.5999, 1, 1, 0.6001]\n"
    for dof, k in (("y", 2e6), ("theta_x", 5e3)):
        text += f'[[joint.law]]\ndof = "{dof}"\nlaw = "spring"\nvalues = {{ k = {k}, h = {0.01 * k} }}\n'
    text += '[channels]\n"1:+y" = "A/1:y"\n"2:+y" = "A/@0.1,0.012,0.3:y"\n"3:+y" = "B/@0,0,0.9:y"\n'
    (tmp_path / "assembly.toml").write_text(text)
    done = subprocess.run([sys.executable, "-c", LARGE], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    dofs, most = map(int, done.stdout.split())
    assert dofs == 103_092
    assert most < 3e9


def in_mm(mesh):
    return jf.Mesh(1e3 * mesh.nodes, mesh.elements)


@pytest.mark.long
def test_cards_of_a_joint_between_faces_in_mm(tmp_path):
    """Rigid faces and arms in a deck in mm, t, s give the frequencies of the parts with points and the joint."""
    aluminium = Material(70e3, 0.33, 2.7e-9)  # N/mm^2, t/mm^3
    arms = [brick_beam(0.12, 0.025, 0.01, ALUMINIUM, origin=(0.0, 0.0, z)) for z in (0.0, 0.13)]
    a, b = (in_mm(arm.mesh) for arm in arms)
    faces = [np.flatnonzero(abs(mesh.nodes[:, 2] - z) < 1e-6) + 1 for mesh, z in ((a, 120.0), (b, 130.0))]
    where = np.array([1.0, 4.0, 126.0])  # of the joint, mm: beside the axis, between the faces
    names = ("x", "y", "z", "theta_x", "theta_y", "theta_z")
    joint = jf.Joint([2e6, 4e6, 3e6, 300.0, 200.0, 500.0], dofs=names)
    # Parts by themselves, with points of their faces where the joint is.
    parts = []
    for name, mesh, face in (("a", a, faces[0]), ("b", b, faces[1])):
        step = ["*FREQUENCY, SOLVER=MATRIXSTORAGE", "1"]
        text = deck(mesh, {"E": (range(len(mesh.elements)), aluminium)}, (), step)
        more = f'joint = ["face:x"]\n[[point]]\nname = "face"\ncoupling = "rigid"\nnodes = {face.tolist()}\n'
        more += f"at = {(where / 1e3).tolist()}\n"
        part = jf.read_part(stored_matrices(CCX, text, tmp_path / name, "mm-t-s", more)).structure.model
        parts.append((part, part.index(*(f"face:{way}" for way in names))))
    (one, at_a), (other, at_b) = parts
    ours = jf.assemble(one, other, joint, at_a, at_b).natural_frequencies(16)
    # The whole: nodes at the middles of the faces, rigid bodies, arms.
    n, count = len(a.nodes), len(a.elements)
    both = jf.Mesh(np.vstack([a.nodes, b.nodes]), np.vstack([a.elements, b.elements + n]))
    bodies = {"A": (range(count), aluminium), "B": (range(count, len(both.elements)), aluminium)}
    ends = np.array([a.nodes[faces[0] - 1].mean(axis=0), b.nodes[faces[1] - 1].mean(axis=0)])
    cards = joint.export("calculix", (90001, 90002), rotation_nodes=(90003, 90004), element=90001, units="mm-t-s",
                         positions=ends, points=where, faces=[faces[0].tolist(), (faces[1] + n).tolist()])  # fmt: skip
    assert "reference point of the joint: (1, 4, 126) mm" in cards

    def whole(cards, ends):
        own = [f"{90001 + i}, " + ", ".join(f"{c:.12g}" for c in ends[i % 2]) for i in range(4)]
        nodes = "\n".join(["*NODE", *own, cards + "*STEP"])
        return deck(both, bodies, (), frequency_step(16)).replace("*STEP", nodes, 1)

    theirs = natural_frequencies(CCX, whole(cards, ends), tmp_path / "whole")
    assert ours[6:] == pytest.approx(theirs[6:], rel=1e-6)
    # Rigid DOFs: equations with arms from the middles of the faces hold what those between nodes at the joint hold.
    laws = jf.LawJoint({name: jf.SpringLaw(k) for name, k in (("x", 2e6), ("z", 3e6), ("theta_x", 300.0))},
                       rigid=["y", "theta_y", "theta_z"], dofs=names)  # fmt: skip
    found = []
    for name, at in (("arms", ends), ("there", np.array([where, where]))):
        more = {"positions": ends, "points": where} if name == "arms" else {}
        cards = laws.export("calculix", (90001, 90002), rotation_nodes=(90003, 90004), element=90001, units="mm-t-s",
                            faces=[faces[0].tolist(), (faces[1] + n).tolist()], **more)  # fmt: skip
        found.append(natural_frequencies(CCX, whole(cards, at), tmp_path / name))
    assert found[0][6:] == pytest.approx(found[1][6:], rel=1e-6)
    assert abs(found[0][6:] / theirs[6:] - 1).max() > 1e-3
