"""What a study keeps and says: chunks that overlap, damaged ones, moments, coverage, files."""

import json
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.workbench.cases.kind import EstimateColumn, EstimateGroup, Estimates
from jointfrf.workbench.studies.run import Schedule
from jointfrf.workbench.studies.store import GroupRecord, Span, StudyRecord, StudyStore
from jointfrf.workbench.studies.summary import summarise

COUNT = 1000
COLUMNS = tuple(
    EstimateColumn(estimator, name, "N/m", actual, bound)
    for estimator, name, actual, bound in (("a", "k_x", 5.0, 1.0), ("b", "k_x", 5.0, np.nan), ("a", "c_x", np.nan, 2.0))
)


@pytest.fixture(scope="module")
def drawn():
    rng = np.random.default_rng(3)
    values = rng.standard_normal((COUNT, 3)) * [1.0, 2.0, 3.0] + [5.5, 5.0, 1e9]
    values[[10, 400], 1] = np.nan
    reach = np.array([1.96, np.nan, 6])
    return Estimates(values, values - reach, values + reach)


def stored(folder, drawn, cuts=(0, 7, 300, COUNT), levels=(0.01, 0.1)):
    store = StudyStore(folder)
    groups = tuple(GroupRecord({"noise": level}, "complex", COLUMNS) for level in levels)
    identity = {"case": {}, "factors": {"noise": list(levels)}, "arrangement": "full"}
    store.begin(StudyRecord("case", "A case", 3, COUNT, identity, groups))
    for group in range(len(levels)):
        for first, end in pairwise(cuts):
            store.write(group, first, Estimates(*(part[first:end] for part in drawn)))
    return store


@pytest.fixture(scope="module")
def whole(drawn, tmp_path_factory):
    return jf.StudyResult(stored(tmp_path_factory.mktemp("study"), drawn).folder)


def test_moments_are_those_of_all_realisations(whole, drawn):
    for c, row in enumerate(whole.summary[:3]):
        values = drawn.values[np.isfinite(drawn.values[:, c]), c]
        assert (row.count, row.failed) == (COUNT, COUNT - values.size)
        assert row.mean == pytest.approx(values.mean(), rel=1e-12)
        assert row.std == pytest.approx(values.std(ddof=1), rel=1e-7)
        assert (row.low, row.median, row.high) == tuple(np.percentile(values, (2.5, 50, 97.5)))
        if not np.isnan(row.actual):
            assert row.bias == pytest.approx(values.mean() - row.actual, rel=1e-9)
            assert row.rmse == pytest.approx(np.sqrt(np.mean((values - row.actual) ** 2)), rel=1e-9)
    first, second, third = whole.summary[:3]
    assert first.coverage == np.mean(abs(drawn.values[:, 0] - 5.0) <= 1.96)
    assert np.isnan([second.coverage, second.bound, third.coverage, third.rmse]).all()


def test_percentiles_of_very_many_are_those_of_the_first(whole, drawn, monkeypatch):
    monkeypatch.setattr("jointfrf.workbench.studies.summary._SAMPLE", 30)
    row = summarise(StudyStore(whole.folder), whole.record)[0]
    assert row.median == np.median(drawn.values[:10, 0])
    assert row.mean == pytest.approx(drawn.values[:, 0].mean(), rel=1e-12)


def test_realisations_of_chunks_that_overlap_count_once(drawn, tmp_path):
    store = stored(tmp_path, drawn)
    for first, end in ((3, 12), (5, 250), (299, 302), (900, COUNT)):
        store.write(0, first, Estimates(*(part[first:end] for part in drawn)))
    numbers, values, low, _ = jf.StudyResult(tmp_path).estimates(0)
    assert numbers.tolist() == list(range(COUNT))
    np.testing.assert_array_equal(values, drawn.values)
    np.testing.assert_array_equal(low, drawn.low)


@pytest.mark.parametrize("group", [-1, 7, 2**70])
def test_a_group_that_is_none_is_said(whole, group):
    """-1 gave no realisations and no word, 7 an IndexError."""
    with pytest.raises(ValueError, match="group must be from 0 to"):
        whole.estimates(group)


def test_what_is_missing(drawn, tmp_path):
    store = stored(tmp_path, drawn, (0, 7, 300), levels=(0.01,))
    store.write(0, 500, Estimates(*(part[500:600] for part in drawn)))
    record = store.read()
    assert store.missing(record, Span(0, 1000)) == [[Span(300, 200), Span(600, 400)]]
    assert store.missing(record, Span(100, 350)) == [[Span(300, 150)]]
    assert store.missing(record, Span(10, 20)) == [[]]
    assert store.missing(replace(record, groups=record.groups * 2), Span(10, 20))[1] == [Span(10, 20)]
    assert jf.StudyResult(tmp_path).missing == 600
    assert "600 realisations of 1000 are missing" in jf.StudyResult(tmp_path).table.note


def test_a_file_cut_short_is_named_and_an_empty_one_is_missing(drawn, tmp_path):
    store = stored(tmp_path, drawn)
    chunk = sorted((tmp_path / "chunks").iterdir())[1]
    content = chunk.read_bytes()
    chunk.write_bytes(content[: len(content) // 2])
    with pytest.raises(jf.FileContentError, match=f"{chunk.name} is damaged .*: delete it"):
        jf.StudyResult(tmp_path).estimates(0)
    chunk.write_bytes(b"")
    assert store.missing(store.read(), Span(0, COUNT)) == [[Span(7, 293)], []]
    (tmp_path / "study.json").write_text('{"format": 9}')
    with pytest.raises(jf.FileContentError, match="another version"):
        jf.read_study(tmp_path)
    (tmp_path / "study.json").write_text('{"form')
    with pytest.raises(jf.FileContentError, match="is not the file of a study"):
        jf.read_study(tmp_path)


def test_files_hold_every_realisation(whole, drawn, tmp_path):
    with np.load(whole.save_npz(tmp_path / "a.npz")) as held:
        assert held["realisations_1"].tolist() == list(range(COUNT))
        for name, part in zip(("values", "low", "high"), drawn, strict=True):
            np.testing.assert_array_equal(held[f"{name}_1"], part)
        groups = json.loads(str(held["groups"]))
    assert groups[1]["point"] == {"noise": 0.1}
    assert groups[1]["columns"][2] == ["a", "c_x", "N/m"]
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(whole.save_parquet(tmp_path / "a.parquet"))
    assert table.num_rows == 2 * COUNT * 3
    row = table.slice(3 * COUNT + 3 * 7, 1).to_pylist()[0]
    assert (row["noise"], row["estimator"], row["parameter"], row["realisation"]) == ("complex", "a", "k_x", 7)
    assert (row["value"], row["low"]) == (drawn.values[7, 0], drawn.low[7, 0])


def test_json_holds_no_nan(whole):
    shown = json.loads(json.dumps(whole.to_dict(), allow_nan=False))
    assert shown["summary"][1]["bound"] is None
    assert shown["design"]["factors"] == {"noise": [0.01, 0.1]}


def test_figures_over_a_factor(whole):
    figures = {figure.key: figure for figure in whole.figures}
    assert list(figures) == ["distributions", "rmse-noise", "coverage-noise"]
    panel = figures["rmse-noise"].panels[0]
    assert (panel.x_label, panel.log_x, panel.log_y) == ("noise level", True, True)
    bound, first, _ = panel.curves
    assert bound.x.tolist() == [0.01, 0.1]
    assert bound.y == pytest.approx([20.0, 20.0])
    assert first.y == pytest.approx([100 * whole.summary[0].rmse / 5] * 2)
    assert len({curve.style for curve in panel.curves}) == 3
    (ribbon,) = figures["coverage-noise"].panels[0].ribbons
    assert ribbon.low == pytest.approx(95 - 1.35, abs=0.01)


def test_columns_of_the_table(whole):
    columns = whole.table.columns
    assert columns[:5] == ("noise level", "noise", "estimator", "parameter", "unit")
    assert columns[-2:] == ("coverage, %", "failed")


def test_chunks_take_about_two_seconds_and_end_together():
    group = EstimateGroup("noise", "method", COLUMNS, Estimates.without_intervals, 5)
    schedule = Schedule([group], [[Span(3, 100_000)]], workers=2)
    chunks, taken = iter(schedule), []
    for chunk in chunks:
        taken.append((chunk.first, chunk.count))
        schedule.learn(chunk, 0.004 * chunk.count)
    firsts, counts = np.array(taken).T
    assert firsts[0] == 3
    assert (firsts[1:] == (firsts + counts)[:-1]).all()
    assert counts.sum() == 100_000
    assert ((firsts + counts)[:-1] % 5 == 0).all()
    assert counts[0] <= 5
    assert abs(counts[1:100] * 0.004 - 2).max() < 0.03
    assert counts[-1] <= 5
    done, total = schedule.done
    assert done == total == pytest.approx(400_000, rel=1e-3)
