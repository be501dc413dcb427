"""Files of time records: tables and MATLAB files, their units, and what is wrong with them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.io import savemat

import jointfrf as jf
from jointfrf.io.time_file import read_time_record

TIME = np.arange(5) / 1000
X = np.arange(10.0).reshape(5, 2)


def written(path, head, rows, between=","):
    path.write_text("\n".join([*head, *(between.join(map(str, row)) for row in rows)]) + "\n", encoding="utf-8")
    return path


ROWS = [(t, *x) for t, x in zip(TIME, X, strict=True)]


@pytest.mark.parametrize(
    ("head", "options", "factor", "motion"),
    [
        (["time [s],A/1:y [m/s^2],B/2:y [m/s^2]"], {}, 1, "acceleration"),
        (["time,A/1:y (g),B/2:y (g)"], {}, 9.80665, "acceleration"),
        (["time,A/1:y,B/2:y", "s,mm/s,mm/s"], {}, 1e-3, "velocity"),
        (["# a comment", "Time (s),A/1:y,B/2:y"], {"unit": "mm"}, 1e-3, "displacement"),
        (["analyser,1.2", "t,A/1:y,B/2:y"], {"skip_lines": 1}, 1, ""),
        (["ms,A/1:y,B/2:y"], {"rate": 1000.0}, 1, ""),
    ],
)
def test_a_table_is_read_in_si_units(tmp_path, head, options, factor, motion):
    rows = [row[1:] for row in ROWS] if "rate" in options else ROWS
    head = ["A/1:y,B/2:y"] if "rate" in options else head
    found = read_time_record(written(tmp_path / "x.csv", head, rows), **options)
    assert_allclose(found.time, TIME)
    assert_allclose(found.signals, factor * X)
    assert found.sensors == ("A/1:y", "B/2:y")
    assert found.motion == (motion, motion)


def test_semicolons_decimal_commas_and_milliseconds(tmp_path):
    rows = [[str(one).replace(".", ",") for one in (1000 * t, *x)] for t, *x in ROWS]
    found = read_time_record(written(tmp_path / "x.csv", ["t [ms];a [m];b [m]"], rows, ";"))
    assert_allclose(found.time, TIME)
    assert_allclose(found.signals, X)


@pytest.mark.parametrize("content", [
    {"t": TIME, "acc": X}, {"time": TIME[:, None], "acc": X.T}, {"fs": 1000.0, "acc": X}, {"dt": 1e-3, "acc": X},
    {"data": {"t": TIME, "acc": X}, "note": "a text"},
])  # fmt: skip
def test_matlab_files_have_times_or_a_rate(tmp_path, content):
    savemat(tmp_path / "x.mat", content)
    found = read_time_record(tmp_path / "x.mat")
    assert_allclose(found.time, TIME)
    assert_allclose(found.signals, X)
    assert found.sensors == ("acc1", "acc2")


@pytest.mark.parametrize(
    ("head", "rows", "text"),
    [
        (["f,a"], [(1, 2)], "the first column is 'f', no time; name it time, or state the sampling rate"),
        (["time"], [(1,)], "has times and no sensors"),
        (["time,a,a"], [(1, 2, 3)], "two sensors have the same name"),
        (["time,a [V]"], [(1, 2)], "a has the unit 'V', no motion"),
        (["time [Hz],a"], [(1, 2)], "time has the unit 'Hz'; use s or ms"),
        (["time,a"], [(1, 2), (2, "x")], "line 3: a 'x' is no number"),
        (["time,a"], [(1, 2, 3)], "line 2 has 3 columns, the heading has 2"),
        ([], ROWS, "the first line contains numbers; add a heading"),
        (["time,a"], [], "has no numbers below its heading"),
    ],
)
def test_a_wrong_table_is_one_sentence(tmp_path, head, rows, text):
    with pytest.raises(jf.FileContentError, match=text.replace("[", r"\[")):
        read_time_record(written(tmp_path / "x.csv", head, rows))


@pytest.mark.parametrize("value", ["inf", "nan"])
def test_a_sample_that_is_not_finite_is_named(tmp_path, value):
    rows = [(t, a, value if t == TIME[2] else b) for t, a, b in ROWS]
    path = written(tmp_path / "record.csv", ["time,A/1:y,B/2:y"], rows)
    with pytest.raises(jf.FileContentError, match=r"'B/2:y' has no finite value at 0.002 s; leave out these samples"):
        read_time_record(path)


def test_a_wrong_matlab_file_is_one_sentence(tmp_path):
    for content, text in (({"a": "text"}, "has no signals"), ({"t": TIME, "a": X[:3]}, "values for 5 instants"),
                          ({"a": X}, "no time")):  # fmt: skip
        savemat(tmp_path / "x.mat", content)
        with pytest.raises(jf.FileContentError, match=text):
            read_time_record(tmp_path / "x.mat")
    with pytest.raises(FileNotFoundError):
        read_time_record(tmp_path / "none.mat")
