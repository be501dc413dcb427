"""Pooling fits, and comparing those of several structures: what is refused, said and written."""

import json
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import jointfrf as jf
from jointfrf.identification.result import Fit
from jointfrf.workbench.cli.main import main
from jointfrf.workbench.report.pool_page import pool_csv


def fit_of(k: float, c: float, error: float = 0.01) -> Fit:
    """A fit of one spring and one dashpot with relative standard errors."""
    covariance = np.diag([(error * k) ** 2, (error * c) ** 2])
    return Fit.of_springs("compliance", ("y",), {"k_y": k, "c_y": c}, covariance, 0.01, 0.01, np.array([1.0, 2.0]))


@pytest.fixture
def fits() -> list[Fit]:
    rng = np.random.default_rng(4)
    return [fit_of(1e6 * np.exp(rng.normal(0, 0.1)), 20 * np.exp(rng.normal(0, 0.3))) for _ in range(8)]


def test_mean_spread_and_next_assembly(fits):
    pooled = jf.pool(fits).parameters["k_y"]
    logs = np.log([fit.value["k_y"] for fit in fits])
    assert_allclose(np.log(pooled.mean.value), logs.mean(), atol=2e-3)
    (spread,) = pooled.spreads
    assert spread.factor == "assembly"
    assert spread.p_value < 1e-6
    assert_allclose(spread.value, np.sqrt(logs.var(ddof=1) - 0.01**2), rtol=1e-2)
    assert pooled.next_one.low < pooled.mean.low < pooled.mean.value < pooled.mean.high < pooled.next_one.high


def test_a_common_error_is_not_averaged_away(fits):
    narrow, wide = (jf.pool(fits, common=own).parameters["k_y"].mean for own in (0.0, 0.2))
    assert wide.high / wide.low > np.exp(2 * 1.9 * 0.2) > narrow.high / narrow.low


def test_repeats_of_an_assembly_are_no_further_assemblies():
    rng = np.random.default_rng(1)
    own = rng.normal(0, 0.2, 4)
    fits = [fit_of(1e6 * np.exp(own[i // 5] + rng.normal(0, 0.01)), 20.0, 0.002) for i in range(20)]
    pooled = jf.pool(fits, factors={"assembly": [i // 5 for i in range(20)]}).parameters["k_y"]
    between, repeat = pooled.spreads
    assert (between.factor, between.levels, repeat.factor, repeat.levels) == ("assembly", 4, "repeat", 20)
    assert between.value > 5 * repeat.value
    assert jf.pool(fits).parameters["k_y"].mean.low > pooled.mean.low


def test_a_factor_that_matters_is_named():
    rng = np.random.default_rng(2)
    day, operator = np.arange(12) % 3, np.arange(12) % 2
    fits = [fit_of(1e6 * np.exp(0.3 * day[i] + rng.normal(0, 0.02)), 20.0) for i in range(12)]
    pooled = jf.pool(fits, factors={"day": day.tolist(), "operator": operator.tolist()}, parameters=["k_y"])
    chances = {own.factor: own.p_value for own in pooled.parameters["k_y"].spreads}
    assert chances["day"] < 1e-3 < 0.05 < chances["operator"]
    assert any("depends on day" in text for text in pooled.notes)
    assert not any("operator" in text for text in pooled.notes)


def test_a_trend_is_a_power_law():
    torque = [5.0, 10, 15, 20, 5, 10, 15, 20]
    rng = np.random.default_rng(6)
    fits = [fit_of(1e6 * (t / 10) ** 0.4 * np.exp(rng.normal(0, 0.02)), 20.0, 0.005) for t in torque]
    (trend,) = jf.pool(fits, factors={"torque": torque}, trends=["torque"]).parameters["k_y"].trends
    assert trend.low < 0.4 < trend.high
    assert trend.p_value < 1e-4
    assert_allclose(trend.value, 0.4, atol=0.05)


def test_mean_and_next_assembly_state_the_number_at_which_they_hold(tmp_path):
    torque = [5.0, 10, 20, 40] * 2
    rng = np.random.default_rng(6)
    fits = [fit_of(1e6 * (t / 10) ** 0.4 * np.exp(rng.normal(0, 0.02)), 20.0, 0.005) for t in torque]
    pooled = jf.pool(fits, factors={"torque": torque}, trends=["torque"])
    own = pooled.parameters["k_y"]
    assert_allclose(own.at["torque"], np.sqrt(200))
    assert_allclose(own.mean.value, 1e6 * (own.at["torque"] / 10) ** 0.4, rtol=0.03)
    page = jf.write_pool(pooled, tmp_path / "pool.html").read_text()
    for shown in (str(pooled), page, pool_csv(pooled)):
        assert "torque 14.14 (geometric mean)" in shown
    chances = [re.sub("<[^>]*>", "", cell) for cell in re.findall(r'data-label="p"[^>]*>(.*?)</td>', page)]
    assert "&lt; 1e-4" in chances
    assert not any("e-" in chance for chance in chances if chance != "&lt; 1e-4")


def test_errors_that_all_fits_share_are_named():
    rng = np.random.default_rng(12)
    fits = [fit_of(1e6 * np.exp(rng.normal(0, 0.002)), 20.0, error=0.05) for _ in range(6)]
    pooled = jf.pool(fits, parameters=["k_y"])
    assert any("one error of all fits" in text for text in pooled.warnings)
    mean = pooled.parameters["k_y"].mean
    assert mean.high / mean.low > np.exp(2 * 1.9 * 0.05)
    alone = jf.pool(fits, parameters=["k_y"], common=0.05).parameters["k_y"].mean
    assert mean.high / mean.low <= alone.high / alone.low


def test_an_outlying_assembly_is_named():
    rng = np.random.default_rng(3)
    fits = [fit_of(1e6 * np.exp(rng.normal(0, 0.03)), 20.0) for _ in range(7)] + [fit_of(3e6, 20.0)]
    pooled = jf.pool(fits, labels=[f"test {i}" for i in range(8)])
    assert pooled.parameters["k_y"].outlying == ("test 7",)
    assert pooled.parameters["c_y"].outlying == ()
    assert any("of test 7 does not belong" in text for text in pooled.warnings)


def test_an_open_stiffness_is_left_out_and_said():
    open_one = Fit.of_springs(
        "compliance", ("y",), {"k_y": np.inf}, np.array([[np.inf]]), 0.01, 0.01, np.array([1.0]),
        intervals=lambda _: {"k_y": (1e7, np.inf)},
    )  # fmt: skip
    pooled = jf.pool([fit_of(1e6, 20), fit_of(1.1e6, 22), open_one], labels=["a", "b", "c"])
    assert pooled.parameters["k_y"].labels == ("a", "b")
    assert "unbounded (rigid, free, or without an interval) in c" in pooled.warnings[0]


def test_damping_about_zero_is_averaged_as_it_is():
    fits = [fit_of(1e6, c, error=0.01) for c in (2.0, -1.0, 0.5)]
    pooled = jf.pool(fits)
    assert pooled.parameters["c_y"].scale == "linear"
    assert pooled.parameters["k_y"].scale == "log"
    assert_allclose(pooled.parameters["c_y"].mean.value, 0.5, atol=0.05)
    assert any("[pooled-linearly]" in text for text in pooled.notes)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"factors": {"day": [1, 2]}}, "factor 'day' has 2 groups; give 8"),
        ({"factors": {"day": [1] * 8}}, "factor 'day' is the same for all fits"),
        ({"factors": {"day": list(range(8))}}, "has a different group for each fit"),
        ({"factors": {"day": [0, 1] * 4, "hour": ["a", "b"] * 4}}, "factors 'day' and 'hour' have the same groups"),
        ({"trends": ["torque"]}, "unknown factor 'torque'"),
        ({"factors": {"torque": ["low", "high"] * 4}, "trends": ["torque"]}, "give numbers such as 12.5"),
        ({"factors": {"torque": [0.0, 1.0] * 4}, "trends": ["torque"]}, "give numbers above zero"),
        ({"common": -0.1}, "common is negative or not finite"),
        ({"common": {"day": 0.1}}, "unknown factor 'day'"),
        ({"parameters": ["k_z"]}, "unknown parameter 'k_z'"),
        ({"labels": ["a"] * 8}, "wrong labels; give 8 different names"),
        ({"probability": 1.0}, "probability must lie between 0 and 1"),
    ],
)
def test_what_cannot_be_pooled_is_one_sentence(fits, options, words):
    with pytest.raises(ValueError, match=words):
        jf.pool(fits, **options)


def test_one_fit_is_no_pool(fits):
    with pytest.raises(ValueError, match="too few for"):
        jf.pool(fits[:1])
    with pytest.raises(TypeError, match="fits must be a Fit"):
        jf.pool([fits[0], 3.0])


def test_one_joint_explains_two_structures_where_it_does():
    same = jf.transfer([fit_of(1.000e6, 20.0), fit_of(1.005e6, 20.1)])
    other = jf.transfer([fit_of(1.000e6, 20.0), fit_of(1.100e6, 20.1)], labels=["short", "long"])
    assert same.p_value > 0.5
    assert other.p_value < 1e-6
    assert other.differences[0].name == "k_y"
    assert "no one joint explains all" in str(other)
    assert_allclose(same.statistic, (np.log(1.005) ** 2 + np.log(20.1 / 20) ** 2) / (2 * 0.01**2), rtol=1e-9)
    assert jf.transfer([fit_of(1.000e6, 20.0), fit_of(1.100e6, 20.1)], spread=0.1).p_value > 0.5
    with pytest.raises(ValueError, match="spread is negative or not finite"):
        jf.transfer([fit_of(1.000e6, 20.0), fit_of(1.100e6, 20.1)], spread=-0.1)


def test_the_statistic_of_a_transfer_is_chi_squared():
    rng = np.random.default_rng(8)
    chances = [
        jf.transfer(
            [fit_of(1e6 * np.exp(rng.normal(0, 0.01)), 20 * np.exp(rng.normal(0, 0.01))) for _ in range(3)]
        ).p_value
        for _ in range(200)
    ]
    assert 0.02 < np.mean(np.array(chances) < 0.05) < 0.1


@pytest.fixture
def folder(fits, tmp_path):
    for number, fit in enumerate(fits):
        jf.save(fit, tmp_path / f"a{number}.json")
    rows = [f"a{number}.json,{number // 2},{10 + number % 2}" for number in range(8)]
    (tmp_path / "tests.csv").write_text("\n".join(["file,assembly,torque", *rows]) + "\n")
    return tmp_path


def test_the_command_writes_table_page_and_csv(folder, capsys):
    page, table = folder / "pool.html", folder / "pool.csv"
    words = [
        "pool",
        "--table",
        str(folder / "tests.csv"),
        "--trend",
        "torque",
        "--report",
        str(page),
        "--output",
        str(table),
    ]
    assert main(words) == 0
    shown = capsys.readouterr().out
    assert "next assembly, 95 %" in shown
    assert "repeat" in shown
    assert "torque" in shown
    assert "next assembly" in page.read_text()
    assert "a7" in page.read_text()
    assert table.read_text().startswith("parameter,unit,what,of,value,low,high,p\nk_y,N/m,fit,a0,")


def test_the_command_gives_json(folder, capsys):
    files = [str(folder / f"a{number}.json") for number in range(8)]
    assert main(["pool", *files, "--factor", "day=1,1,1,1,2,2,2,2", "--common", "0.02", "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["parameters"]["k_y"]["next_one"]["low"] < content["parameters"]["k_y"]["mean"]["low"]
    assert main(["pool", *files[:2], "--transfer", "--json"]) == 0
    assert 0 <= json.loads(capsys.readouterr().out)["transfer"]["p_value"] <= 1


@pytest.mark.parametrize(
    ("words", "status", "message"),
    [
        ([], 2, "no fits are given"),
        (["--factor", "day"], 2, "is no factor; use the form NAME=GROUP"),
        (["--table", "t.csv", "a.json"], 2, "--table names files and factors"),
        (["missing.json", "gone.json"], 1, "missing.json"),
        (["--table", "t.csv"], 1, "column file is missing"),
    ],
)
def test_wrong_words_are_one_sentence(words, status, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "t.csv").write_text("name,day\na,1\n")
    try:
        found = main(["pool", *words])
    except SystemExit as stop:
        found = stop.code
    assert found == status
    assert message in capsys.readouterr().err


def test_cells_of_the_table_start_no_formula(fits):
    assert "'=1+1" in pool_csv(jf.pool(fits, labels=["=1+1", *"bcdefgh"]))


def test_a_pool_names_the_findings_of_the_frfs_of_its_fits(fits, tmp_path, capsys):
    wrong = fits[2].with_findings([jf.Finding("channel-gain", dict(factor=1.1, error=0.01), ("1:y",))])
    fits[2] = wrong.with_findings([*wrong.findings, jf.Finding("sides-unchecked")])
    pooled = jf.pool(fits)
    (one,) = [one for one in pooled.findings if one.code == "channel-gain"]
    assert one.test == pooled.labels[2]
    for i, fit in enumerate(fits):
        jf.save(fit, tmp_path / f"t{i}.json")
    assert main(["pool", *(str(tmp_path / f"t{i}.json") for i in range(len(fits))), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert any(text.startswith("t2: ") and text.endswith("[channel-gain]") for text in content["warnings"])
    assert [found["code"] for found in content["findings"] if found["test"] == "t2"] == ["channel-gain"]
