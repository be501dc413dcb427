"""Nodes with axes of their own, in every reader that uses directions: turned, named local, or rejected."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import jointfrf as jf
from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.io import read_uff
from jointfrf.workbench.fe.modes import read_modes
from jointfrf.workbench.fe.nodes import read_nodes
from uff_writer import dataset, function, nodes_2411, units

OBLIQUE = Rotation.from_euler("zyx", [30.0, -50.0, 20.0], degrees=True).as_matrix()
#: Rows are the local axes: y, -x, z.
QUARTER = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
PLACES = {1: (0.3, 0.4, 0.1), 2: (1.0, 0.0, 0.0)}


def system(label, axes, kind=0, origin=(0, 0, 0), form=2420):
    if form == 18:
        points = [*origin, *(origin + axes[0]), *(origin + axes[2] + axes[0])]
        lines = ["".join(f"{x:13.5e}" for x in own) for own in (points[:6], points[6:])]
        return dataset(18, f"{label:10d}{kind:10d}{0:10d}{1:10d}{1:10d}", "own", *lines)
    rows = ["".join(f"{x:25.16e}" for x in row) for row in (*axes, origin)]
    return dataset(2420, f"{1:10d}", "part", f"{label:10d}{kind:10d}{8:10d}", "own", *rows)


def nodes(label):
    """Node 1 with a displacement system, node 2 with none."""
    return nodes_2411({1: PLACES[1]}, label) + nodes_2411({2: PLACES[2]})


def axes_at(kind, axes, place):
    if kind == 0:
        return axes
    x, y = (axes @ place)[:2] / np.linalg.norm((axes @ place)[:2])
    return np.array([[x, y, 0], [-y, x, 0], [0, 0, 1]]) @ axes


def written(path, h, local, *parts):
    """Write FRFs between x, y, z of node 1 and z of node 2; rows and columns of node 1 in local directions."""
    turn = np.eye(4)
    turn[:3, :3] = local
    own = turn @ h @ turn.T
    channels = [(1, 1), (1, 2), (1, 3), (2, 3)]
    frfs = [function(own[:, i, j], response=channels[i], reference=channels[j]) for i, j in np.ndindex(4, 4)]
    path.write_bytes("".join(parts).encode() + b"".join(frfs))
    return path


@pytest.mark.parametrize("form", [2420, 18])
@pytest.mark.parametrize(("kind", "axes"), [(0, OBLIQUE), (0, QUARTER), (1, np.eye(3)), (1, OBLIQUE)])
def test_frfs_in_local_directions_are_turned(tmp_path, kind, axes, form):
    rng = np.random.default_rng(3)
    h = rng.standard_normal((3, 4, 4)) + 1j * rng.standard_normal((3, 4, 4))
    local = axes_at(kind, axes, np.array(PLACES[1]))
    path = written(tmp_path / "a.uff", h, local, units(1, 1), system(5, axes, kind, form=form), nodes(5))
    with pytest.warns(FileContentWarning, match="local directions at node 1 are turned to global ones"):
        frfs = read_uff(path)
    names = ["1:x", "1:y", "1:z", "2:z"]
    assert_allclose(frfs.matrix(names, names), h, atol=2e-5 * abs(h).max() if form == 18 else 1e-9)


def test_frfs_without_all_three_directions_are_left_out(tmp_path):
    head = (units(1, 1) + system(5, OBLIQUE) + nodes(5)).encode()
    functions = [function(response=(node, 3), reference=(node, 3)) for node in (1, 2)]
    (tmp_path / "a.uff").write_bytes(head + b"".join(functions))
    with pytest.warns(FileContentWarning, match="directions at node 1 are local and left out"):
        frfs = read_uff(tmp_path / "a.uff")
    assert [str(one) for one in frfs.responses] == ["2:+z"]
    (tmp_path / "b.uff").write_bytes(head + functions[0])
    with pytest.raises(FileContentError, match="in local directions only; set the displacement system"):
        read_uff(tmp_path / "b.uff")
    for parts in (nodes(7), system(1, 2 * OBLIQUE) + nodes(1)):  # a system that is not there, and one that is none
        (tmp_path / "c.uff").write_bytes((units(1, 1) + parts).encode() + functions[0])
        with pytest.raises(FileContentError, match="in local directions only"):
            read_uff(tmp_path / "c.uff")


@pytest.mark.parametrize("label", [0, 1])
def test_the_global_system_by_its_labels(tmp_path, label):
    (tmp_path / "a.uff").write_bytes((units(1, 1) + nodes(label)).encode() + function(response=(1, 1)))
    frfs = read_uff(tmp_path / "a.uff")
    assert str(frfs.responses[0]) == "1:+x"


def modes_55(shape, *, free=False):
    """A normal mode at 40 Hz, three or six values of each node; free of columns or in them."""
    words = [1, 2, 2, 8, 2, len(shape[0])], [2, 4, 1, 1], [40.0, 1.0, 0.02, 0.0]
    whole, reals = ("{} ", "{:.6g}  ") if free else ("{:10d}", "{:13.5E}")

    def line(form, own):
        return "".join(form.format(x) for x in own)

    rows = [text for node, own in enumerate(shape, 1) for text in (line(whole, [node]), line(reals, own))]
    return dataset(
        55, "mode", *["NONE"] * 4, line(whole, words[0]), line(whole, words[1]), line(reals, words[2]), *rows
    )


@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize(("kind", "axes"), [(0, OBLIQUE), (1, OBLIQUE)])
def test_modes_in_local_directions_are_turned(tmp_path, kind, axes, free):
    motion = np.array([[0.2, -0.5, 0.3, 0.1, 0.0, -0.4], [0.6, 0.1, -0.2, 0.0, 0.3, 0.2]])
    local = axes_at(kind, axes, np.array(PLACES[1]))
    own = motion.copy()
    own[0, :3], own[0, 3:] = local @ motion[0, :3], local @ motion[0, 3:]
    (tmp_path / "a.unv").write_text(units(1, 1) + system(5, axes, kind) + nodes(5) + modes_55(own, free=free))
    found = read_modes(tmp_path / "a.unv")
    assert found.dofs[:6] == ("1:x", "1:y", "1:z", "1:theta_x", "1:theta_y", "1:theta_z")
    assert_allclose(found.shapes[:, 0], motion.ravel(), atol=2e-5)
    assert (found.frequency[0], found.damping[0]) == (40.0, 0.02)


def test_modes_whose_axes_are_not_known_have_local_names(tmp_path):
    (tmp_path / "a.unv").write_text(units(1, 1) + nodes(7) + modes_55(np.ones((2, 3))))
    found = read_modes(tmp_path / "a.unv")
    assert found.dofs == ("1:local_x", "1:local_y", "1:local_z", "2:x", "2:y", "2:z")
    assert "directions at node 1 are local" in found.notes[0]
    (tmp_path / "part.toml").write_text('model = "modes"\nfile = "a.unv"\njoint = ["1:z"]\n')
    assert not jf.read_part(tmp_path / "part.toml").has("1:z")


def test_numbers_that_touch_are_read_by_columns(tmp_path):
    shape = np.array([[-1.25, -2.5, -3.75], [1e-100, -1e-5, -1.0]])
    text = modes_55(shape).replace("  1.00000E-100", " 1.00000E-100")  # no blank is left between columns
    assert "-1.25000E+00 -2.50000E+00" in text
    (tmp_path / "a.unv").write_text(units(1, 1) + text.replace(" -2.50000E+00", "-12.50000E+00"))
    assert read_modes(tmp_path / "a.unv").shapes[:3, 0].tolist() == [-1.25, -12.5, -3.75]


#: Node 1 has axes of its own, node 2 has none.
_FILES = {
    "a.unv": units(1, 1) + system(5, OBLIQUE) + nodes(5),
    "b.unv": units(1, 1) + nodes(7),
    "a.inp": "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n*NSET, NSET=A\n1\n*TRANSFORM, NSET=A\n0,1,0, -1,0,0\n",
    "b.inp": "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n*TRANSFORM, NSET=A\n0,1,0, -1,0,0\n*NSET, NSET=A\n1\n",
    "a.bdf": "GRID,1,,0.,0.,0.,7\nGRID,2,,1.,0.,0.\n",
    "b.bdf": "GRDSET,,,,,,7\nGRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.,0\n",
    "a.cdb": "NBLOCK,6,SOLID\n(3i9,6e21.13)\n" + f"{1:9d}{0:9d}{0:9d}" + "".join(f"{x:21.13E}" for x in (0, 0, 0, 30))
    + f"\n{2:9d}{0:9d}{0:9d}{1:21.13E}\n",
}  # fmt: skip


@pytest.mark.parametrize("name", _FILES)
def test_nodes_of_every_file_say_that_they_are_turned(tmp_path, name):
    (tmp_path / name).write_text(_FILES[name])
    found = read_nodes(tmp_path / name)
    assert found.turned == ("1",)
    assert found.named(["1:x", "2:x", "901:q"]) == ("1:local_x", "2:x", "901:q")


@pytest.mark.parametrize("name", _FILES)
def test_modes_of_arrays_take_the_directions_of_their_nodes(tmp_path, name):
    (tmp_path / name).write_text(_FILES[name])
    arrays = {"nat_freq": [40.0], "nat_xi": [0.02], "Phi": np.ones((2, 1)), "modal_mass": [1.0], "dofs": ["1:z", "2:z"]}
    np.savez(tmp_path / "m.npz", **arrays)
    (tmp_path / "part.toml").write_text(
        f'model = "modes"\nfile = "m.npz"\nnodes = "{name}"\nunits = "SI"\njoint = ["2:z"]\n'
    )
    part = jf.read_part(tmp_path / "part.toml")
    assert part.has("1:local_z")
    assert not part.has("1:z")


@pytest.mark.parametrize(
    ("form", "line"),
    [
        ("(3i9,6e21.13e3)", "{0:9d}{1:9d}{1:9d}{2:21.13E}{3:21.13E}{4:21.13E}"),
        ("(1i7,2i9,6e21.13)", "{0:7d}{1:9d}{1:9d}{2:21.13E}{3:21.13E}{4:21.13E}"),
        ("(3i8,6e16.9)", "{0:8d}{1:8d}{1:8d}{2:16.9E}{3:16.9E}{4:16.9E}"),
        ("(i10,6E20.13)", "{0:10d}{2:20.13E}{3:20.13E}{4:20.13E}"),
    ],
)
def test_every_format_of_nblock(tmp_path, form, line):
    rows = [line.format(node, 0, 0.1 * node, -0.2, 3e-3) for node in (7, 8, 1234567)]
    (tmp_path / "a.cdb").write_text("\n".join(["/PREP7", "NBLOCK,6,SOLID", form, *rows, "N,R5.3,LOC,       -1,", ""]))
    found = read_nodes(tmp_path / "a.cdb")
    assert list(found.coordinates) == ["7", "8", "1234567"]
    assert_allclose(found.coordinates["8"], [0.8, -0.2, 3e-3])
    assert found.turned == ()


@pytest.mark.parametrize(
    "form", ["(999999999i9,6e21.13)", "(6e21.13)", "(3i9)", "(3a9,6e21.13)", "", "(3i999,6e999.13)"]
)
def test_formats_of_nblock_that_are_none(tmp_path, form):
    (tmp_path / "a.cdb").write_text(f"NBLOCK,6,SOLID\n{form}\n{1:9d}{0:9d}{0:9d}{1:21.13E}\n")
    with pytest.raises(FileContentError, match="is no format of NBLOCK; write one like"):
        read_nodes(tmp_path / "a.cdb")


@pytest.mark.parametrize("word", ["1.5D-1", "1.5d-01", "0.15", "+1.5E-1", ".15"])
def test_exponents_of_fortran(tmp_path, word):
    (tmp_path / "a.inp").write_text(f"*NODE\n1, {word}, 0.D0\n")
    (tmp_path / "a.txt").write_text(f"1 {word} 0.D0 0\n")
    for name in ("a.inp", "a.txt"):
        assert read_nodes(tmp_path / name).coordinates["1"].tolist() == [0.15, 0, 0]
