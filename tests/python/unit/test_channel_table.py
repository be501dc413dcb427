"""Tables of channels in TOML and CSV files, and what is said of those that are wrong."""

import numpy as np
import pytest

from jointfrf import FileContentError
from jointfrf.io import read_channel_table

TOML = """
unit = "mm"

[[channel]]
node = 101
side = "j"
role = "response"
at = [30.0, 0.0, -20.0]
axes = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]

[[channel]]
channel = "111:-z"
side = "j"
role = "excitation"
at = [10, 20, 30]
direction = [0.0, 0.6, -0.8]
weight = 2

[[channel]]
channel = "201:+x"
side = "k"
"""
CSV = """# our table
channel;node;side;role;x [mm];y [mm];z [mm];direction_x;direction_y;direction_z;weight
;101;j;response;30,0;0;-20;;;;
111:-z;;j;excitation;10;20;30;0;0,6;-0,8;2

201:+x;;k;;;;;;;;
"""


def written(tmp_path, text, name):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(("text", "name"), [(TOML, "a.toml"), (CSV, "a.csv")])
def test_both_formats(tmp_path, text, name):
    places = read_channel_table(written(tmp_path, text, name))
    assert [str(place.channel) for place in places] == ["101:+x", "101:+y", "101:+z", "111:-z", "201:+x"]
    assert [place.side for place in places] == ["j", "j", "j", "j", "k"]
    assert [place.role for place in places] == ["response"] * 3 + ["excitation", "both"]
    assert [place.optional for place in places] == [True, True, True, False, False]
    np.testing.assert_allclose(places[0].position, [0.03, 0, -0.02])
    np.testing.assert_allclose(places[3].position, [0.01, 0.02, 0.03])
    np.testing.assert_allclose(places[3].unit, [0, 0.6, -0.8])
    assert places[3].weight == 2
    assert places[4].position is None
    np.testing.assert_allclose(places[4].unit, [1, 0, 0])
    turned = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]] if name == "a.toml" else np.eye(3)
    np.testing.assert_allclose([place.unit for place in places[:3]], turned)


def test_commas_tabs_and_inches(tmp_path):
    for mark in (",", "\t"):
        text = mark.join(("channel", "x [in]", "y[m]", "z")) + "\n" + mark.join(("1:y", "1", "2e-3", "-3")) + "\n"
        (place,) = read_channel_table(written(tmp_path, text, "a.txt"))
        np.testing.assert_allclose(place.position, [0.0254, 0.002, -3])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('side = "k"', 'side = "l"', "side must be one of j, k, not 'l'"),
        ('role = "excitation"', 'role = "exitation"', "did you mean excitation"),
        ('channel = "201:+x"', 'channel = "201:+w"', "'201:.w' is no channel"),
        ('channel = "201:+x"', "", "name either channel or node"),
        ('channel = "201:+x"', "node = 0", "node must be a whole number, at least 1"),
        ("weight = 2", "weight = -2", "weight must be a number, at least 0"),
        ("weight = 2", "wieght = 2", "unknown key 'wieght'.*did you mean 'weight'"),
        ("at = [10, 20, 30]", "at = [10, 20]", "at must be three numbers"),
        ("direction = [0.0, 0.6, -0.8]", "direction = [0.0, 0.6, -0.9]", "direction must have length 1, not 1.08"),
        ("axes = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]", "axes = [[0, 1, 0]]", "axes must be three lists"),
        (
            "axes = [[0, 1, 0], [-1, 0, 0], [0, 0, 1]]",
            "direction = [0, 0, 1]",
            "direction belongs to a channel; give axes of the node",
        ),
        ('unit = "mm"', 'unit = "km"', "unit must be one of m, mm, cm, in"),
        ('unit = "mm"', 'units = "mm"', "unknown key 'units'"),
        ("[[channel]]", "[[channels]]", "unknown key 'channels'.*did you mean 'channel'"),
    ],
)
def test_what_is_wrong_in_toml(tmp_path, old, new, message):
    assert old in TOML
    with pytest.raises(FileContentError, match=message) as caught:
        read_channel_table(written(tmp_path, TOML.replace(old, new), "a.toml"))
    assert "a.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("weight\n", "wait\n", "unknown column 'wait'.*did you mean weight"),
        ("x [mm]", "x [yd]", "only x, y, z have a unit"),
        ("x [mm]", "x [N]", "only x, y, z have a unit"),
        ("weight\n", "weight [mm]\n", "only x, y, z have a unit"),
        ("role;x", "node;x", "a column is named twice"),
        ("0,6", "a", "line 4: direction_y must be a number, not 'a'"),
        ("0,6;-0,8;2", "0,6;-0,8", "line 4 has 10 columns, the heading has 11"),
        ("10;20;30", "10;;30", "line 4: x is given without y; add y"),
        (";101;", ";1.5;", "line 3: node must be a whole number"),
        ("-0,8;2", "-0,8;-2", "line 4: weight must be a number, at least 0"),
    ],
)
def test_what_is_wrong_in_csv(tmp_path, old, new, message):
    assert old in CSV
    with pytest.raises(FileContentError, match=message):
        read_channel_table(written(tmp_path, CSV.replace(old, new, 1), "a.csv"))


def test_files_that_are_no_tables(tmp_path):
    with pytest.raises(FileContentError, match=r"cannot be read|No such"):
        read_channel_table(tmp_path / "none.csv")
    with pytest.raises(FileContentError, match="is empty"):
        read_channel_table(written(tmp_path, "\n# only this\n", "a.csv"))
    with pytest.raises(FileContentError, match="has no channels; add a row for each"):
        read_channel_table(written(tmp_path, "channel\n", "a.csv"))
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileContentError, match="is not a text file"):
        read_channel_table(tmp_path / "b.csv")
