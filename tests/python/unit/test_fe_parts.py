"""Parts by files of finite-element programs: matrices, DOFs, nodes, units, reference points, what is printed."""

import random
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import sparse

import jointfrf as jf
from fe_files import NODE_FILES, WRITERS, block, dmig, in_units, part_toml
from jointfrf.errors import FileContentError
from jointfrf.models.facts import model_facts
from jointfrf.models.points import PointModel, PointPatch, couple_points
from jointfrf.workbench.assembly_file.read import scaled_model
from jointfrf.workbench.fe.matrix_formats import MATRIX_FORMATS, read_matrix
from jointfrf.workbench.fe.nodes import read_dof_names, read_nodes

FREQ = np.array([500.0, 2500.0, 9000.0])
JOINT = 'joint = ["1:x", "1:y", "1:z"]\n'


@pytest.fixture(scope="module")
def model():
    return block()


def _is_short(form, units):
    """A format gives numbers, which units scale whatever the format: each once, and all of both in the long run."""
    return units == "mm-t-s" or form == "calculix"


@pytest.mark.parametrize(
    ("form", "units"),
    [
        pytest.param(form, units, marks=() if _is_short(form, units) else pytest.mark.long)
        for form in WRITERS
        for units in ("SI", "mm-t-s", "mm-kg-ms")
    ],
)
def test_every_format_gives_the_same_frfs(tmp_path, model, form, units):
    part = jf.read_part(part_toml(tmp_path, model, form, units=units, more=JOINT))
    last = max((dof for dof in model.dofs), key=lambda dof: int(dof.partition(":")[0])).partition(":")[0]
    points = ["1:x", "1:y", f"{last}:z"]
    whole = jf.receptance(FREQ, model.stiffness, model.mass, loss_factor=0.01, outputs=model.ports(*points),
                          inputs=model.ports(*points))  # fmt: skip
    found = part.receptance(FREQ, points)
    # DMIG holds nine digits, which the stiffness of a free structure shows near its rigid motions.
    np.testing.assert_allclose(found, whole, rtol=1e-3 if form == "dmig" else 1e-8, atol=1e-9 * abs(whole).max())
    np.testing.assert_allclose(part.places[last], model.places[last], atol=1e-9)


@pytest.mark.parametrize("nodes", NODE_FILES)
def test_every_file_of_nodes_gives_the_same_places(tmp_path, model, nodes):
    part = jf.read_part(part_toml(tmp_path, model, nodes=nodes, more=JOINT))
    for name, at in part.places.items():
        np.testing.assert_allclose(at, model.places[name], atol=1e-9)
    assert set(part.places) == {dof.partition(":")[0] for dof in model.dofs}


def test_units_are_said_or_refused(tmp_path, model):
    path = part_toml(tmp_path, model, more=JOINT)
    path.write_text(path.read_text().replace('units = "mm-t-s"\n', ""))
    with pytest.raises(FileContentError, match="no file of CalculiX says its units, which are SI, mm-t-s or mm-kg-ms"):
        jf.read_part(path)
    path.write_text(path.read_text() + 'units = "inch"\n')
    with pytest.raises(FileContentError, match=r"units must be one of SI, mm-t-s, mm-kg-ms"):
        jf.read_part(path)


@pytest.mark.parametrize("form", ["calculix", "harwell-boeing"])
def test_names_of_dofs_that_are_missing(tmp_path, model, form):
    path = part_toml(tmp_path, model, form, more=JOINT)
    for name in ("part.dof", "k.mapping"):
        (tmp_path / name).unlink(missing_ok=True)
    with pytest.raises(FileContentError, match=r"does not name its DOFs, and there is no (part.dof|k.mapping) beside"):
        jf.read_part(path)


def test_dofs_that_the_file_names_itself(tmp_path, model):
    path = part_toml(tmp_path, model, "dmig", more='dofs = ["1:x"]\n' + JOINT)
    with pytest.raises(FileContentError, match="names its DOFs itself: leave the key out"):
        jf.read_part(path)


def test_a_mass_that_lacks_dofs_without_mass(tmp_path):
    """A file of labels leaves out rows without entries."""
    k = np.array([[2.0, -1, 0], [-1, 2, -1], [0, -1, 1]])
    rows = [f"{a},1, {b},1, {k[a - 1, b - 1]}\n" for a in (1, 2, 3) for b in range(1, a + 1)]
    (tmp_path / "k.mtx").write_text("".join(rows))
    (tmp_path / "m.mtx").write_text("3,1, 3,1, 2.0\n1,1, 1,1, 1.0\n")
    keys = ['model = "matrices"', 'stiffness = "k.mtx"', 'mass = "m.mtx"', 'units = "SI"', 'joint = ["1:x"]']
    (tmp_path / "part.toml").write_text("\n".join(keys))
    found = jf.read_part(tmp_path / "part.toml").structure.model
    assert found.dofs == ("1:x", "2:x", "3:x")
    np.testing.assert_allclose(found.mass.toarray(), np.diag([1, 0, 2.0]))
    np.testing.assert_allclose(found.stiffness.toarray(), k)


def test_modal_coordinates_and_names_of_nastran(tmp_path):
    """A Craig-Bampton model as punched: grids with six DOFs, scalar points; its FRFs are those of the whole."""
    k = np.diag([0.0, 0, 0, 0, 0, 0, 4e6, 9e6])
    m = np.eye(8) + 0.3 * np.eye(8, k=6) + 0.3 * np.eye(8, k=-6)
    dofs = [f"3:{way}" for way in ("x", "y", "z", "theta_x", "theta_y", "theta_z")] + ["901:q", "902:q"]
    text = dmig(tmp_path, sparse.csr_array(k), sparse.csr_array(m), dofs)
    (tmp_path / "part.toml").write_text(f'model = "matrices"\n{text}units = "SI"\njoint = ["3:x"]\n')
    part = jf.read_part(tmp_path / "part.toml")
    assert set(part.structure.model.dofs) == set(dofs)
    w = 2 * np.pi * FREQ
    expected = [np.linalg.inv(k - one**2 * m)[0, 0] for one in w]
    np.testing.assert_allclose(part.receptance(FREQ, ["3:x"])[:, 0, 0], expected, rtol=1e-6)
    (tmp_path / "part.asm").write_text("BEGIN SUPER 1\nEXTRN          3  123456     901       0     902       0\n")
    assert read_dof_names(tmp_path / "part.asm") == tuple(dofs)


def test_names_after_the_file_and_several_matrices(tmp_path):
    for name in ("K1", "K2"):
        text = f"DMIG    {name:<8}{0:8d}{6:8d}{2:8d}{0:8d}\nDMIG*   {name:<16}{1:16d}{1:16d}\n*       {1:16d}{1:16d}"
        with (tmp_path / "two.pch").open("a") as file:
            file.write(f"{text}{float(name[1]):16.8E}\n")
    with pytest.raises(FileContentError, match=r"several that may be the stiffness, but K1, K2; name one"):
        read_matrix(tmp_path / "two.pch", "stiffness")
    assert read_matrix(tmp_path / "two.pch#K2", "stiffness").matrix.toarray().tolist() == [[2.0]]


def test_a_triangle_is_completed_where_the_format_says_so_only(tmp_path):
    (tmp_path / "k.sti").write_text("1 1 2.0\n1 2 -1.0\n2 2 3.0\n")
    found = read_matrix(tmp_path / "k.sti", "stiffness")
    assert (found.matrix.toarray().tolist(), found.completed) == ([[2, -1], [-1, 3]], "the upper triangle")
    (tmp_path / "k.sti").write_text("1 1 2.0\n1 2 -1.0\n2 1 -1.5\n2 2 3.0\n")
    found = read_matrix(tmp_path / "k.sti", "stiffness")
    assert (found.matrix.toarray().tolist(), found.completed) == ([[2, -1], [-1.5, 3]], "")
    np.savez(tmp_path / "k.npz", stiffness=np.array([[2.0, -1], [0, 3]]))
    assert read_matrix(tmp_path / "k.npz", "stiffness").matrix.toarray().tolist() == [[2, -1], [0, 3]]


def _dmig(form, entries):
    """A DMIG matrix of node 1 to 9, DOF 1, of entries (row, column, value)."""
    lines = [f"DMIG,KAAX,0,{form},2,0,,,9", *(f"DMIG,KAAX,{j},1,,{i},1,{x}" for i, j, x in entries)]
    return "\n".join([*lines, ""])


@pytest.mark.parametrize("seed", range(4))
def test_off_diagonal_terms_once_in_any_mixture_of_triangles(tmp_path, seed):
    rng = np.random.default_rng(seed)
    whole = rng.standard_normal((6, 6)).round(6)
    whole = whole + whole.T
    entries = []
    for i in range(6):
        for j in range(i + 1):
            at = (i, j) if rng.uniform() < 0.5 else (j, i)
            entries += [(at[0] + 1, at[1] + 1, whole[i, j])]
            if i != j and seed == 3 and rng.uniform() < 0.5:  # some on both sides, which form 6 allows
                entries += [(at[1] + 1, at[0] + 1, whole[i, j])]
    (tmp_path / "k.pch").write_text(_dmig(6, sorted(entries, key=lambda one: one[1])))
    found = read_matrix(tmp_path / "k.pch", "stiffness")
    assert_allclose(found.matrix.toarray(), whole)
    assert found.completed == "each off-diagonal term once"
    (tmp_path / "k.pch").write_text(_dmig(1, entries))
    assert not np.allclose(read_matrix(tmp_path / "k.pch", "stiffness").matrix.toarray(), whole)
    if seed < 3:
        (tmp_path / "k.mtx").write_text("".join(f"{i},1, {j},1, {x}\n" for i, j, x in entries))
        assert_allclose(read_matrix(tmp_path / "k.mtx", "stiffness").matrix.toarray(), whole)


def test_an_unsymmetric_matrix_stays_one(tmp_path):
    entries = [(1, 1, 2.0), (1, 2, -1.0), (2, 1, -1.0), (2, 2, 3.0), (3, 3, 1.0), (2, 3, 0.5)]  # (3, 2) is zero
    (tmp_path / "k.mtx").write_text("".join(f"{i},1, {j},1, {x}\n" for i, j, x in entries))
    found = read_matrix(tmp_path / "k.mtx", "stiffness").matrix.toarray()
    assert (found[1, 2], found[2, 1]) == (0.5, 0)
    (tmp_path / "k.pch").write_text(_dmig(6, [(1, 1, 2.0), (1, 2, -1.0), (2, 1, -1.5), (2, 2, 3.0)]))
    found = read_matrix(tmp_path / "k.pch", "stiffness").matrix.toarray()
    assert (found[0, 1], found[1, 0]) == (-1.0, -1.5)  # a part of this matrix is an error


# ---------------------------------------------------------------- reference points


def end_nodes(model, z):
    return tuple(name for name, at in model.places.items() if name.isdigit() and abs(at[2] - z) < 1e-9)


@pytest.fixture(scope="module")
def patched(model):
    """The same patches by the solids' own code."""

    def with_points(**names):
        patches = {name: jf.Patch(np.array([0.0, 0.01, 0.0]), np.array([int(n) - 1 for n in end_nodes(model, 0.0)]))
                   for name in names}  # fmt: skip
        return jf.solid_model(model.mesh, jf.Material(70e9, 0.33, 2700.0), **{way: patches for way in names.values()})

    return with_points


@pytest.mark.parametrize(("coupling", "way"), [("rigid", "patches"), ("distributing", "observed")])
def test_points_are_those_of_the_solids(model, patched, coupling, way):
    theirs = patched(joint=way)
    own = couple_points(model, [PointPatch("joint", end_nodes(model, 0.0), coupling, np.array([0.0, 0.01, 0.0]))])
    names = [f"joint:{d}" for d in ("x", "y", "theta_x", "theta_z")] + ["60:x"]
    h = theirs.receptance(FREQ, names)
    np.testing.assert_allclose(own.receptance(FREQ, names), h, rtol=1e-7, atol=1e-9 * abs(h).max())
    # Nodes that follow are still seen.
    node = end_nodes(model, 0.0)[0]
    seen = own.receptance(FREQ, [f"{node}:x"], ["60:x"])[:, 0, 0]
    point = own.receptance(FREQ, [f"joint:{d}" for d in ("x", "theta_y", "theta_z")], ["60:x"])[:, :, 0]
    r = model.places[node] - np.array([0.0, 0.01, 0.0])
    follows = point[:, 0] + point[:, 1] * r[2] - point[:, 2] * r[1]
    if coupling == "rigid":
        np.testing.assert_allclose(seen, follows, rtol=1e-6)
    else:
        assert abs(seen - follows).max() > 1e-4 * abs(seen).max()


@pytest.mark.parametrize(
    "patch",
    ['set = "FIRST"', "nodes = [1, 2, 79, 80]", "box = [-1.0, -1.0, -1e-6, 1.0, 1.0, 1e-6]\nat = [0.0, 0.0, 0.0]"],
)
def test_patches_by_set_numbers_and_box(tmp_path, model, patch):
    more = f'joint = ["tip:x", "tip:theta_y"]\n[[point]]\nname = "tip"\ncoupling = "rigid"\n{patch}\n'
    part = jf.read_part(part_toml(tmp_path, model, more=more))
    assert part.receptance(FREQ, part.keys.joint).shape == (3, 2, 2)
    assert part.places["tip"].shape == (3,)


def test_a_node_that_follows_a_rigid_point_is_found_by_its_place(tmp_path, model):
    """The nearest other node was taken for it."""
    where = ",".join(f"{x:.12g}" for x in model.places["2"])
    more = f'joint = ["@{where}:y"]\n[[point]]\nname = "tip"\ncoupling = "rigid"\nnodes = [1, 2, 79, 80]\n'
    assert jf.read_part(part_toml(tmp_path, model, more=more)).keys.joint == ("2:y",)


@pytest.mark.parametrize(
    ("patch", "message"),
    [
        ('set = "NONE"', r"has no set 'NONE'; it has ALL, ENDS, LINE, FIRST"),
        ("nodes = [1, 9999]", "point tip: the place of node 9999 is not known"),
        ("nodes = [1]", "cannot rotate with its nodes; give three that are not on one line"),
        ("box = [5.0, 5.0, 5.0, 6.0, 6.0, 6.0]", "no node lies in it"),
        ('nodes = [1]\nset = "ENDS"', "exactly one of them names the patch"),
        ("", "exactly one of them names the patch"),
    ],
)
def test_patches_that_cannot_be(tmp_path, model, patch, message):
    more = f'joint = ["tip:x"]\n[[point]]\nname = "tip"\n{patch}\n'
    with pytest.raises(FileContentError, match=message):
        jf.read_part(part_toml(tmp_path, model, more=more))


@pytest.mark.parametrize("coupling", ["rigid", "distributing"])
def test_points_of_a_part_whose_lengths_are_scaled(model, coupling):
    """As those of the part whose nodes are elsewhere: 2 % longer, wider and higher."""
    places = {name: 1.02 * np.asarray(at) for name, at in model.places.items() if name.isdigit()}
    patch = PointPatch("tip", end_nodes(model, 0.0), coupling)
    larger = jf.solid_model(jf.Mesh(1.02 * model.mesh.nodes, model.mesh.elements), jf.Material(70e9, 0.33, 2700.0))
    larger = couple_points(replace(larger, places=places), [patch])
    scaled = scaled_model(couple_points(model, [patch]), length_scale=1.02)
    names = ["tip:x", "tip:theta_z", "tip:theta_y", f"{end_nodes(model, 0.0)[0]}:x", "60:x"]
    expected = larger.receptance(FREQ, names)
    np.testing.assert_allclose(scaled.receptance(FREQ, names), expected, rtol=1e-6, atol=1e-9 * abs(expected).max())
    np.testing.assert_allclose(scaled.places["tip"], larger.places["tip"], atol=1e-12)


@pytest.mark.parametrize("count", [2, 3])
def test_rotations_of_nodes_hold_a_distributing_point_where_translations_cannot(count):
    """The nearest rigid motion, Q u, of translations alone from three nodes on, and so Q H Q^T; H by its definition."""
    at = np.array([[0.0, 0.0, 0.0], [0.2, 0.01, 0.0], [0.1, 0.15, 0.03]])[:count]
    directions = ("x", "y", "z", "theta_x", "theta_y", "theta_z")
    dofs = tuple(f"{node}:{direction}" for node in range(1, count + 1) for direction in directions)
    root = np.random.default_rng(count).standard_normal((2, len(dofs), len(dofs)))
    k, m = (one @ one.T + len(dofs) * np.eye(len(dofs)) for one in root)
    places = {str(node + 1): place for node, place in enumerate(at)}
    patch = PointPatch("p", tuple(places), "distributing")
    found = couple_points(PointModel(k, m, dofs=dofs, places=places), [patch])
    motion = np.array([[[*unit, *np.cross(np.eye(3), r - at.mean(axis=0)) @ unit] for unit in np.eye(3)] for r in at])
    turning = np.broadcast_to(np.eye(6)[3:], (count, 3, 6))
    seen = motion if count > 2 else np.concatenate([motion, turning], axis=1)
    nearest = np.zeros((6, count, 6))
    nearest[:, :, : seen.shape[1]] = np.linalg.pinv(seen.reshape(-1, 6)).reshape(6, count, -1)
    nearest = nearest.reshape(6, -1)
    names = [f"p:{direction}" for direction in directions]
    exact = nearest @ np.linalg.inv(k - (2 * np.pi * 0.1) ** 2 * m) @ nearest.T
    np.testing.assert_allclose(found.receptance([0.1], names)[0], exact, rtol=1e-9, atol=1e-12)


def test_a_node_in_two_rigid_points(model):
    nodes = end_nodes(model, 0.0)
    with pytest.raises(ValueError, match="follows both a and b"):
        couple_points(model, [PointPatch(name, nodes, "rigid") for name in "ab"])


# ---------------------------------------------------------------- what is printed


def test_facts_of_a_free_block_and_of_a_held_one(tmp_path, model):
    facts = model_facts(jf.read_part(part_toml(tmp_path, model, more=JOINT)).structure.model)
    mass = 0.12 * 0.03 * 0.02 * 2700
    np.testing.assert_allclose(facts.mass, mass, rtol=1e-9)
    np.testing.assert_allclose(facts.centre, [0, 0.01, 0.06], atol=1e-9)
    assert facts.rigid_motions == 6
    assert facts.findings == ()
    np.testing.assert_allclose(facts.natural_frequencies[:3], model.natural_frequencies(9)[6:], rtol=1e-6)
    held = model_facts(
        jf.read_part(part_toml(tmp_path, block(("clamped", "free")), more='joint = ["60:x"]')).structure.model
    )
    assert held.rigid_motions == 0
    assert "no rigid motion is free" in held.lines()[1]


def test_facts_show_a_wrong_file(tmp_path, model):
    k, m, _ = in_units(model, "SI")
    places = {name: at for name, at in model.places.items() if name.isdigit()}

    def findings(k, m):
        return " ".join(model_facts(PointModel(k, m, model.dofs, places=places)).findings)

    assert findings(k, m) == ""
    assert "stiffness has a negative diagonal entry" in findings(-k, m)
    assert "not positive semidefinite: a motion has a negative stiffness" in findings(k - 1e6 * m * (2 * np.pi) ** 2, m)
    without = m.tolil()
    without[:, 0] = without[0, :] = 0
    assert "masses along x, y and z differ" in findings(k, sparse.csr_array(without))


def test_axes_of_nodes_of_their_own_are_not_taken_for_those_of_the_model(tmp_path, model):
    path = part_toml(tmp_path, model, more='joint = ["60:x"]\n')
    with (tmp_path / "part.inp").open("a") as file:
        file.write("*TRANSFORM, NSET=FIRST, TYPE=R\n0,1,0, -1,0,0\n")
    part = jf.read_part(path)
    assert part.has("1:local_x")
    assert not part.has("1:x")
    assert "5 nodes have directions of their own" in part.structure.about
    with path.open("a") as file:
        file.write('[[point]]\nname = "end"\nset = "FIRST"\n')
    with pytest.raises(FileContentError, match="node 1 has no DOF 1:x: its directions are local; write"):
        jf.read_part(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("*NODE\n1, 0, 0, 0\n*NGEN\n1, 5, 1\n", "makes nodes in a way that is not read"),
        ("*NODE, SYSTEM=C\n1, 1, 90, 0\n", "makes nodes in a way that is not read"),
        ("*PART, NAME=A\n*NODE\n1, 0, 0\n*END PART\n*ASSEMBLY\n*INSTANCE, NAME=B, PART=A\n", "write a flat deck"),
        ("*INCLUDE, INPUT=mesh.inp\n*STEP\n", "it includes mesh.inp: name that file"),
        ("*NODE\n1, 0, 0, nan\n", "must have a number and finite coordinates"),
        ("*NODE\n1, 0, 0, 0\n*NSET, NSET=A, GENERATE\n1, 999999999, 1\n", "states content of"),
        ("*NODE\n1, 0, 0, 0\n*NSET, NSET=A, GENERATE\n5, 1, 1\n", "must count up in steps"),
        ("*NODE, NSET=ALL, INPUT=Mesh.txt\n", "takes its nodes from Mesh.txt; name that file instead"),
        ("*PART, NAME=A\n*NODE\n1, 0, 0\n*END PART\n*PART, NAME=B\n*NODE\n1, 0, 0\n", "parts A and B both have a"),
        ("*NODE\n1, 0, 0, 0\n1, 5, 0, 0\n", r"node 1 is defined twice, at \(0, 0, 0\) and \(5, 0, 0\)"),
        ("*NODE\n1, 0, 0, 0\n*TRANSFORM, NSET=A\n0,1,0, -1,0,0\n", "turns the set A, which is not there"),
        ("GRID,1,7,0.,0.,0.\n", r"in a local system \(CP\)"),
        ("1 0 0\n", "must contain node, x, y, z"),
    ],
)
def test_nodes_that_are_not_read(tmp_path, text, message):
    path = tmp_path / "nodes.inp"
    path.write_text(text)
    if not text.startswith("*"):
        path = path.rename(tmp_path / "nodes.txt")
    with pytest.raises(FileContentError, match=message):
        read_nodes(path)


# ---------------------------------------------------------------- files of strangers


@pytest.mark.parametrize("form", WRITERS)
def test_files_cut_and_changed_anywhere(tmp_path, form):
    part_toml(tmp_path, block(length=0.03), form)
    chance = random.Random(5)
    for path in sorted(tmp_path.iterdir()):
        if path.suffix in (".toml", ".inp"):
            continue
        sound = path.read_bytes()
        for _ in range(12):
            content = bytearray(sound[: chance.randrange(1, len(sound))])
            for _ in range(chance.randrange(4)):
                start = chance.randrange(len(content))
                content[start : start + chance.randrange(1, 5)] = chance.randbytes(chance.randrange(5))
            path.write_bytes(content)
            with suppress(FileContentError):
                read_dof_names(path) if path.suffix in (".dof", ".mapping", ".txt") else read_matrix(path, "stiffness")
        path.write_bytes(sound)


@pytest.mark.parametrize("name", NODE_FILES)
def test_files_of_nodes_cut_and_changed_anywhere(tmp_path, model, name):
    chance = random.Random(6)
    sound = NODE_FILES[name](in_units(model, "mm-t-s")[2]).encode()
    for _ in range(60):
        content = bytearray(sound[: chance.randrange(1, len(sound))])
        for _ in range(chance.randrange(4)):
            start = chance.randrange(len(content))
            content[start : start + chance.randrange(1, 5)] = chance.randbytes(chance.randrange(5))
        (tmp_path / name).write_bytes(content)
        with suppress(FileContentError):
            read_nodes(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("k.sti", "999999999999 1 1.0\n", "states content of"),
        ("k.sti", "1 1\n", "a line must contain 3 numbers, not 2"),
        ("k.sti", "1.5 1 2.0\n", "numbers of rows and columns must be whole numbers"),
        ("k.sti", "0 1 2.0\n", "names row or column 0 of 1"),
        ("k.sti", "1 1 nan\n", "contains NaN or Inf in row 1, column 1"),
        ("k.mtx", "1,1, 1,1001, 2.0\n", "numbers of DOFs must be 0 to 999"),
        ("k.pch", "DMIG,KAAX,1,1,,1,1,2.0\n", "'KAAX' has no card that begins it"),
        ("k.pch", "DMIG,KAAX,0,2,2,0,,,1\nDMIG,KAAX,1,1,,1,1,2.0\n", "is of form 2; write a square matrix"),
        ("k.pch", "DMIG,KAAX,0,6,4,0,,,1\nDMIG,KAAX,1,1,,1,1,2.0,3.0\n", "must contain real numbers, not complex"),
        ("k.pch", "DMIG,KAAX,0,6,2,0,,,1\nDMIG,KAAX,1,1,,1,1,abc\n", "'ABC' is no number|'abc' is no number"),
        ("k.rsa", "t\n 3 1 1 1 0\nRSA 999999999 999999999 999999999 0\n(1I8) (1I8) (1D25.15)\n", "not contain the 999"),
        ("k.rsa", "t\n 3 1 1 1 0\nPSA 1 1 1 0\n(1I8) (1I8) (1D25.15)\n", "must contain an assembled real matrix"),
        ("k.xyz", "1 1 1\n", "is of an unknown format of matrices; known are NPZ"),
    ],
)  # fmt: skip
def test_files_that_say_too_much_or_something_else(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(FileContentError, match=message) as caught:
        read_matrix(tmp_path / name, "stiffness")
    assert "\n" not in str(caught.value)


def test_a_missing_package_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyyeti", None)
    (tmp_path / "k.op4").write_bytes(b"\0" * 40)
    with pytest.raises(jf.MissingPackageError, match=r"pip install 'jointfrf\[nastran\]'"):
        read_matrix(tmp_path / "k.op4", "stiffness")


def test_the_table_of_formats_is_whole():
    assert len({one.name for one in MATRIX_FORMATS}) == len(MATRIX_FORMATS) == 9
