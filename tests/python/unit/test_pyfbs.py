"""Arrays, tables and files of pyFBS against the motion of rigid bodies, and against pyFBS where it is installed."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from command import run_command
from jointfrf.errors import FileContentError, FileContentWarning
from jointfrf.io.pyfbs import places_of_sheets
from shared_data import shared_data

FREQ = np.arange(40.0, 400.0, 20.0)
DOFS = ("x", "y", "z", "theta_x", "theta_y", "theta_z")
AT = np.array([0.1, -0.02, 0.03])
MM = 1e3
#: Receptances of both ends of the joint, and accelerances, g/N.
JOINT = jf.Joint([2e7, 2e7, 3e7, 6e3, 8e3, 7e3], [90.0, 90.0, 120.0, 0.03, 0.04, 0.03], DOFS)
GRAVITY = 9.80665


def rows(seed, letter):
    """Three oblique, orthogonal directions at three places of both sides, in mm; an axis of some is along z."""
    rng = np.random.default_rng(seed)
    found = []
    for side in (1, 2):
        for i in range(3):
            place = AT + 0.05 * rng.standard_normal(3)
            angle = rng.uniform(0.2, 1.2)
            turned = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
            directions = turned if i else np.linalg.qr(rng.standard_normal((3, 3)))[0]
            found += [
                {"Name": f"{letter}{i}", "Grouping": side, "Quantity": {"S": "Acceleration", "I": "Force"}[letter]}
                | {f"Position_{a + 1}": MM * place[a] for a in range(3)}
                | {f"Direction_{a + 1}": direction[a] for a in range(3)}
                for direction in directions
            ]
    return found


CHN, IMP = rows(1, "S"), rows(2, "I")


def motions(table):
    """Motion of each channel by both ends of the joint, (n, 12)."""
    places, directions = (
        np.array([[row[f"{name}_{a}"] for a in (1, 2, 3)] for row in table]) for name in ("Position", "Direction")
    )
    arms = np.hstack([directions, np.cross(places / MM - AT, directions)])
    side = np.array([row["Grouping"] for row in table])[:, None]
    return np.hstack([arms * (side == 1), arms * (side == 2)])


@pytest.fixture(scope="module")
def at_joint():
    """Accelerances at the joint, SI."""
    blocks = [
        jf.rigid_body(m, [m / 900] * 3, {"joint": at}) for m, at in ((1.4, (0.04, 0, 0)), (0.9, (-0.04, 0.01, 0)))
    ]
    h = [block.receptance(FREQ, block.ports(*(f"joint:{dof}" for dof in DOFS))) for block in blocks]
    coupled = jf.couple(*h, JOINT.dynamic_stiffness(FREQ), range(6), range(6))
    return -((2 * np.pi * FREQ) ** 2)[:, None, None] * coupled


@pytest.fixture(scope="module")
def measured(at_joint):
    """The array of pyFBS, g/N."""
    return motions(CHN) @ at_joint @ motions(IMP).T / GRAVITY


def columns(table):
    return {name: [row[name] for row in table] for name in table[0]}


def check_joint(test, at_joint):
    """The fit of the channels is the joint, and virtual points are those of the bodies."""
    channels = jf.joint_channels(test.frfs, test.places, AT, DOFS)
    gamma = channels.gamma(test.frfs)
    found = jf.transform(gamma, channels.responses.transform, channels.forces.transform)
    np.testing.assert_allclose(found, at_joint, atol=1e-9 * abs(at_joint).max())


@pytest.mark.parametrize("form", [list, columns])
def test_tables_of_oblique_channels(measured, at_joint, form):
    options = {"unit": "g/N", "position_unit": "mm", "sides": {1: "j", 2.0: "k"}}
    test = jf.io.from_pyfbs(FREQ, measured, form(CHN), form(IMP), **options)
    check_joint(test, at_joint)
    assert test.frfs.coordinates == {}  # x of a node is not x of the model
    reverse = np.transpose(measured, (2, 1, 0))
    again = jf.io.from_pyfbs(FREQ, reverse, form(CHN), form(IMP), axes="in,out,freq", **options)
    np.testing.assert_array_equal(again.frfs.h, test.frfs.h)


def test_names_of_channels():
    """A direction along an axis keeps its name and sign; sensor and impact at one place share the node."""

    def row(place, direction, group=1):
        return (
            {f"Position_{a + 1}": place[a] for a in range(3)}
            | {f"Direction_{a + 1}": direction[a] for a in range(3)}
            | {"Grouping": group}
        )

    turned = [(0.6, 0.8, 0), (-0.8, 0.6, 0), (0, 0, -1)]
    chn = [row((0, 0, 0), each) for each in turned] + [row((1, 0, 0), (0, 1, 0)), row((1, 0, 0), (0, 1, 0), 2)]
    imp = [row((0, 0, 0), (0, 0, 1)), row((0, 0, 0), (-0.6, -0.8, 0)), row((0, 0, 0), (1, 0, 0)),
           row((2, 0, 0), (0, 0, -3))]  # fmt: skip
    test = jf.io.from_pyfbs(FREQ, np.ones((FREQ.size, 5, 4)), chn, imp, unit="m/N", position_unit="m")
    assert [str(one) for one in test.frfs.responses] == ["1:+x", "1:+y", "1:-z", "2:+y", "3:+y"]
    assert [str(one) for one in test.frfs.excitations] == ["1:+z", "1:-x", "4:+x", "5:-z"]
    assert {place.side for place in test.places} == {None}
    for place, given in zip(test.places, [*chn, *imp], strict=True):
        direction = np.array([given[f"Direction_{a}"] for a in (1, 2, 3)])
        np.testing.assert_allclose(place.unit, direction / np.linalg.norm(direction))


def virtual(words, unit=MM, **quantities):
    return [
        {"Grouping": 10 * side, "Description": word, "Quantity": quantities.get(word[0], "")}
        | {f"Position_{a + 1}": unit * AT[a] for a in range(3)} | {f"Direction_{a}": 0.0 for a in (1, 2, 3)}
        for side in (1, 2) for word in words.split()
    ]  # fmt: skip


def test_virtual_points_in_millimetres_become_si(at_joint):
    """Rotations of pyFBS are per mm where positions are in mm."""
    per = np.where(np.arange(12) % 6 < 3, 1.0, MM)
    held = at_joint / per[:, None] / per / GRAVITY
    test = jf.io.from_pyfbs(
        FREQ, held, virtual("ux uy uz rx ry rz"), virtual("fx fy fz mx my mz"), unit="g/N", position_unit="mm"
    )
    assert [str(one) for one in test.frfs.responses[:6]] == ["10:+x", "10:+y", "10:+z", "10:+rx", "10:+ry", "10:+rz"]
    assert [str(one) for one in test.frfs.excitations[6:8]] == ["20:+x", "20:+y"]
    np.testing.assert_allclose(test.frfs.h, at_joint, rtol=1e-12)
    np.testing.assert_allclose(test.frfs.coordinates[20], AT)
    old = virtual("ux uy uz tx ty tz", t="Rotational acceleration")  # before pyFBS 1.0
    again = jf.io.from_pyfbs(FREQ, held, old, virtual("fx fy fz mx my mz"), unit="g/N", position_unit="mm")
    np.testing.assert_allclose(again.frfs.h, at_joint, rtol=1e-12)


def test_a_vpt_of_pyfbs(measured, at_joint):
    vpt = pytest.importorskip("pyfbs.interface.vpt")
    pd = pytest.importorskip("pandas")
    shifted = [[row | {"Grouping": 10 * row["Grouping"]} for row in table] for table in (CHN, IMP)]
    tables = [*shifted, virtual("ux uy uz rx ry rz"), virtual("fx fy fz mx my mz")]
    one = vpt.VPT(*(pd.DataFrame(table) for table in tables))
    with pytest.raises(ValueError, match="call its apply_vpt"):
        jf.io.from_pyfbs(one, unit="g/N", position_unit="mm")
    one.apply_vpt(FREQ, measured)
    test = jf.io.from_pyfbs(one, unit="g/N", position_unit="mm")
    names = [f"{node}:{axis}" for node in (10, 20) for axis in ("x", "y", "z", "rx", "ry", "rz")]
    np.testing.assert_allclose(test.frfs.matrix(names, names), at_joint, atol=1e-9 * abs(at_joint).max())


def changed(table, at, **values):
    return [row | values if i == at else row for i, row in enumerate(table)]


@pytest.mark.parametrize(
    ("chn", "options", "message"),
    [
        (CHN, {"position_unit": "N"}, "position_unit 'N' is no unit of length; use m, mm or in"),
        (CHN, {"unit": ""}, "the FRFs have no unit; give unit="),
        (CHN, {"sides": {7: "j"}}, "no row has grouping '7'; use one of 1, 2"),
        (CHN, {"sides": {1: "left"}}, "the side of grouping 1 must be j or k, not 'left'"),
        (CHN[:-1], {}, "do not fit 18 lines, 17 responses, 18 excitations in the order freq,out,in"),
        (changed(CHN, 1, Direction_1=0, Direction_2=0, Direction_3=0), {}, "row 2 of the responses has no direction"),
        (changed(CHN, 1, Position_2=np.nan), {}, "row 2 of the responses has no number in Position_1 to Position_3"),
        (changed(CHN, 1, Position_2="a"), {}, "columns Position_1 to Position_3 of the responses are not numbers"),
        (changed(CHN, 1, **CHN[0]), {}, "row 2 of the responses has the place and direction of row 1; leave one out"),
        (changed(CHN, 1, Description="tx"), {}, "row 2 of the responses is tx, a flexible mode of the interface"),
        (changed(CHN, 1, Description="sxy"), {}, "row 2 of the responses is sxy, a flexible mode"),
        (changed(CHN, 1, Description="ux"), {}, r"row 2 of the responses is ux and points along \("),
        ([{"Position_1": 0}], {}, "the table of the responses has no column Position_2; it has Position_1"),
    ],
)
def test_a_wrong_table_is_one_sentence(measured, chn, options, message):
    with pytest.raises(ValueError, match=message):
        jf.io.from_pyfbs(FREQ, measured, chn, IMP, **({"unit": "g/N", "position_unit": "mm"} | options))


def test_what_is_missing_is_named(measured):
    with pytest.raises(
        ValueError, match="df_imp is missing; give frf, df_chn and df_imp after the frequencies, or a V"
    ):
        jf.io.from_pyfbs(FREQ, measured, CHN, unit="g/N", position_unit="mm")


# ---------------------------------------------------------------- files


def write_sheets(path, **sheets):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, table in sheets.items():
        sheet = book.create_sheet(name)
        sheet.append([])  # blank rows are none
        sheet.append(list(table[0]))
        for row in table:
            sheet.append(list(row.values()))
    book.save(path)
    return path


MAP = {"axes": "freq,out,in", "freq_hz": "freq.npy", "responses": "t.xlsx#Channels", "excitations": "t.xlsx#Impacts"}


@pytest.fixture
def folder(tmp_path, measured):
    np.save(tmp_path / "y.npy", measured)
    np.save(tmp_path / "freq.npy", FREQ)
    write_sheets(tmp_path / "t.xlsx", Channels=CHN, Impacts=IMP)
    return tmp_path


def test_arrays_and_sheets_as_users_of_pyfbs_keep_them(folder, measured, at_joint):
    with pytest.warns(FileContentWarning, match=r"1:\+x, 1:\+y, .* do not point along the axes of their names"):
        frfs = jf.io.read_frfs(folder / "y.npy", mapping=MAP, unit="g/N, coordinates=mm")
    test = jf.io.from_pyfbs(FREQ, measured, CHN, IMP, unit="g/N", position_unit="mm", sides={1: "j", 2: "k"})
    assert (frfs.responses, frfs.excitations) == (test.frfs.responses, test.frfs.excitations)
    np.testing.assert_array_equal(frfs.h, test.frfs.h)
    places = jf.io.read_channel_table(folder / "t.xlsx#Channels,Impacts", position_unit="mm")
    for one, other in zip(places, test.places, strict=True):
        assert (one.channel, one.role) == (other.channel, other.role)
        np.testing.assert_allclose([one.position, one.unit], [other.position, other.unit], atol=1e-14)


def test_directions_along_axes_bring_coordinates(folder, measured):
    plain = [
        [row | {f"Direction_{a + 1}": float(i % 3 == a) for a in range(3)} for i, row in enumerate(table)]
        for table in (CHN, IMP)
    ]
    write_sheets(folder / "t.xlsx", Channels=plain[0], Impacts=plain[1])
    frfs = jf.io.read_frfs(folder / "y.npy", mapping=MAP, unit="g/N, coordinates=mm")
    np.testing.assert_allclose(frfs.coordinates[1], [CHN[0][f"Position_{a}"] / MM for a in (1, 2, 3)])
    again = jf.io.frfs_of_arrays(FREQ, measured, plain[0], plain[1], unit="g/N")
    assert again.responses == frfs.responses


@pytest.mark.parametrize(
    ("change", "unit", "message"),
    [
        ({"axes": None}, None, "18 x 18 x 18 numbers; give mapping axes=freq,out,in or their other order"),
        ({}, "g/N", r"t\.xlsx#Channels has no unit of positions; give unit= with coordinates=mm"),
        ({"excitations": "1:x"}, None, r"t\.xlsx#Channels is a table; name one for each of mapping responses= and ex"),
        (
            {"excitations": "t.xlsx#Impact"},
            None,
            r"t\.xlsx has no sheet 'Impact'; .* out of Channels, Impacts; did you",
        ),
        ({"excitations": "t.xlsx"}, None, r"t\.xlsx has several sheets; name one as t\.xlsx#NAME"),
        ({"excitations": "t.xlsx#Channels,Impacts"}, None, "names several sheets for mapping excitations=; name one"),
        ({"freq_hz": "../freq.npy"}, None, r"\.\./freq\.npy is not in the folder of the FRFs; name a file there"),
        ({"h": "y"}, None, "contains one array without a name; leave out mapping h="),
        ({"freq_hz": "none.npy"}, None, r"there is no file .*none\.npy"),
        ({"freq_hz": None}, None, "has no field for the frequencies; give mapping freq_hz="),
    ],
)
def test_what_the_files_lack_is_one_sentence(folder, change, unit, message):
    mapping = {name: value for name, value in (MAP | change).items() if value is not None}
    with pytest.raises((FileContentError, FileNotFoundError), match=message):
        jf.io.read_frfs(folder / "y.npy", mapping=mapping, unit=unit or "g/N, coordinates=mm")


def test_time_data_and_objects_are_no_frfs(tmp_path):
    np.save(tmp_path / "t.npy", np.ones((3, 1000)))
    with pytest.raises(FileContentError, match=r"3 x 1000 real numbers, FRFs are complex; .* for example with pyFRF"):
        jf.io.read_frfs(tmp_path / "t.npy")
    np.save(tmp_path / "o.npy", np.array([FREQ, "a"], dtype=object), allow_pickle=True)
    with pytest.raises(
        FileContentError, match=r"o\.npy contains Python objects \(its array\), which could run any program"
    ):
        jf.io.read_frfs(tmp_path / "o.npy")


def test_a_sheet_of_our_own_columns(tmp_path):
    own = [{"channel": "101:-z", "side": "j", "x [mm]": 12.5, "y [mm]": 0, "z [mm]": 6}]
    path = write_sheets(tmp_path / "c.xlsx", places=own)
    (place,) = jf.io.read_channel_table(path)
    assert (str(place.channel), place.side) == ("101:-z", "j")
    np.testing.assert_allclose(place.position, [0.0125, 0, 0.006])
    with pytest.raises(FileContentError, match="unit mm of positions has no effect on"):
        jf.io.read_channel_table(path, position_unit="mm")
    write_sheets(path, Channels=CHN)
    with pytest.raises(FileContentError, match="has columns of pyFBS; name the sheets of channels and impacts"):
        jf.io.read_channel_table(path)


def test_damaged_workbooks_are_one_sentence(folder):
    path = folder / "t.xlsx"
    sound = path.read_bytes()
    rng = np.random.default_rng(0)
    for cut in (100, len(sound) // 2, len(sound) - 30):
        path.write_bytes(sound[:cut])
        with pytest.raises(FileContentError, match=re.escape(str(path))):
            places_of_sheets(Path(f"{path}#Channels,Impacts"), "mm")
    for _ in range(60):
        content = bytearray(sound)
        for at in rng.integers(0, len(content), 4):
            content[at] = rng.integers(256)
        path.write_bytes(content)
        try:
            places_of_sheets(Path(f"{path}#Channels,Impacts"), "mm")
        except FileContentError as error:
            assert str(path) in str(error)  # noqa: PT017


def test_the_sheets_of_a_laboratory():
    """Each sensor is one node with three orthogonal channels; directions have length 1."""
    path = shared_data("pyfbs", "AM_Measurements.xlsx")
    pytest.importorskip("openpyxl")
    for sheets, sensors, impacts in (("AB", 9, 27), ("A", 2, 6), ("B", 7, 21)):
        places = places_of_sheets(Path(f"{path}#Channels_{sheets},Impacts_{sheets}"), "mm")
        assert len(places) == 3 * sensors + impacts
        for i in range(sensors):
            own = places[3 * i : 3 * i + 3]
            assert {place.channel.node for place in own} == {i + 1}
            units = np.array([place.unit for place in own])
            np.testing.assert_allclose(units @ units.T, np.eye(3), atol=1e-6)
        assert all(np.linalg.norm(place.position) < 1 for place in places)


def test_the_command_line_takes_the_same_files(folder, measured):
    """Oblique sensors and impacts of both sides, by their nodes; 1 % noise."""
    np.save(folder / "y.npy", jf.pollute(measured, 0.01, seed=3))
    words = [f"--map={name}={value}" for name, value in MAP.items()]
    done = run_command(
        "identify", folder / "y.npy", *words, "--unit", "g/N, coordinates=mm", "--channels",
        f"{folder}/t.xlsx#Channels,Impacts", "--j", "1:3,7:9", "--k", "4:6,10:12", "--dofs", "x,y,z,rx,ry,rz",
        "--at", ",".join(map(str, AT.tolist())), "--json",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["fits"][0]["parameters"]
    inside = 0
    for dof, value in zip(DOFS, JOINT.stiffness.diagonal(), strict=True):
        low, high = found[f"k_{dof}"]["confidence_interval_95"]
        inside += low < value < high
        assert abs(found[f"k_{dof}"]["value"] / value - 1) < 0.2
    assert inside >= 5
