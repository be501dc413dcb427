"""The cases, in a short form: their expected numbers, and what the algebra must give without noise."""

import csv
import dataclasses
import json

import numpy as np
import pytest

from jointfrf.case_file import read_case
from jointfrf.cases import UnknownCaseError, find_case, list_cases, run_case
from jointfrf.results import compute
from jointfrf.study import exact_frfs, run_study
from jointfrf.tables import identified_rows, make_tables

NAMES = ["3.1-discrete", "3.2-fe-beams", "3.3-beams-1mm", "3.3.1-decoupling"]
#: Every so many lines are left, to save time.
THINNED = {"3.1-discrete": 1, "3.2-fe-beams": 1, "3.3-beams-1mm": 3, "3.3.1-decoupling": 3}
COUNT = 60
#: Realisations where tails are looked at.
MANY = 300


@pytest.fixture(scope="module")
def results():
    found = {}
    for name in NAMES:
        case = read_case(find_case(name))
        case = dataclasses.replace(case, freq_hz=case.freq_hz[:: THINNED[name]])
        found[name] = compute(case, MANY if name == "3.2-fe-beams" else COUNT)
    return found


def rmse(result, noise, method, bands=None):
    """Percent, by parameter."""
    rows = identified_rows(result)
    return {
        r.parameter: r.rmse_percent for r in rows if (r.noise, r.method) == (noise, method) and bands in (None, r.bands)
    }


def test_the_four_cases_come_with_the_package():
    assert [folder.name for folder in list_cases()] == NAMES


@pytest.mark.parametrize(("word", "name"), [(n.split("-")[0], n) for n in NAMES] + [(n, n) for n in NAMES])
def test_a_number_or_a_name_selects_exactly_one_case(word, name):
    assert find_case(word).name == name


def test_a_folder_comes_before_a_name(tmp_path, monkeypatch):
    (tmp_path / "3.1").mkdir()
    monkeypatch.chdir(tmp_path)
    assert find_case("3.1").name == "3.1-discrete"
    (tmp_path / "3.1" / "case.toml").touch()
    assert find_case("3.1").resolve() == tmp_path / "3.1"


@pytest.mark.parametrize("word", ["3", "3.", "discrete", "", "no/such/folder"])
def test_an_unknown_case_lists_the_known_ones(word):
    with pytest.raises(UnknownCaseError, match=r"3\.1-discrete, 3\.2-fe-beams, 3\.3-beams-1mm, 3\.3\.1-decoupling"):
        find_case(word)


@pytest.mark.parametrize(
    ("name", "joint", "frequencies", "within"),
    [
        ("3.1-discrete", "initial", [2.596, 3.936, 7.574, 8.049], 6e-4),
        ("3.1-discrete", "actual", [2.598, 4.682, 7.770, 8.374], 6e-4),
        ("3.2-fe-beams", "actual", [17.5, 108.7, 313.6, 695.7], 0.06),
        ("3.3-beams-1mm", "actual", [17.47, 108.4, 300.8, 583.8, 959.2], 0.06),
        ("3.3.1-decoupling", "actual", [17.47, 108.4, 300.8, 583.8, 959.2], 0.06),
    ],
)
def test_natural_frequencies(results, name, joint, frequencies, within):
    found = results[name].modes[joint].freq_hz[: len(frequencies)]
    np.testing.assert_allclose(found, frequencies, atol=within)


@pytest.mark.parametrize("name", NAMES)
def test_the_equations_are_exact_without_noise(results, name):
    errors = results[name].noise_free
    assert errors["short form"] < 1e-10
    assert errors["ismm"] < 1e-10
    assert {f"decoupling-{e}" for e in ("rr", "rs", "sr", "ss")} < set(errors)
    assert max(errors.values()) < 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_band_means_are_those_of_the_public_functions(results, name):
    import jointfrf as jf

    result = results[name]
    case, noise = result.case, result.case.noises[0]
    found = next(f for f in result.identified if (f.noise, f.method) == (noise.name, "ismm"))
    gamma = result.exact.interface(result.exact.h_c)
    polluted = jf.pollute(gamma, noise.level, noise.kind, case.seed, block=noise.block, realisation=37)
    bands = {dof: case.band_sets[0].bands[f"k_{dof}"] for dof in case.joint.dofs}
    mean = jf.band_mean(case.freq_hz, jf.inverse_substructuring(polluted), bands, case.joint.dofs)
    np.testing.assert_allclose(found.theta[37], np.concatenate(mean), rtol=1e-8)


def test_discrete_case_holds_the_published_values(results):
    rows = [row for row in identified_rows(results["3.1-discrete"]) if row.published is not None]
    assert [row.published for row in rows] == [2010.9, 3.37]
    result = results["3.1-discrete"]
    theta = next(f.theta for f in result.identified if f.method == "ismm")
    mean, spread = theta.mean(axis=0), theta.std(axis=0)
    # Inside the central 98 % of a normal distribution; the tails of 60 realisations are too thin to count.
    assert (abs(np.array([2010.9, 3.37]) - mean) < 2.6 * spread).all()
    assert mean[0] == pytest.approx(2000, rel=2e-3)
    assert mean[1] == pytest.approx(3, rel=0.05)


def test_table_3_2_cannot_be_reached_by_noise_of_each_entry(results):
    rows = [row for row in identified_rows(results["3.2-fe-beams"]) if row.published is not None]
    own = {row.parameter: row for row in rows if row.noise == "5 %"}
    assert not own["k_Fy"].fits
    assert not own["k_Mtheta"].fits
    assert own["k_Mtheta"].median < 0.4 * 5000
    common = {row.parameter: row for row in rows if row.noise != "5 %"}
    assert all(common[p].low * 0.95 < common[p].published < common[p].high * 1.05 for p in common)


def test_table_3_4(results):
    rows = [row for row in identified_rows(results["3.3-beams-1mm"]) if row.published is not None]
    fits = {(row.noise, row.bands.split(":")[0], row.parameter): row.fits for row in rows}
    assert len(fits) == 16
    assert fits["5 %", "point s", "k_Fy"]
    assert fits["5 %", "point s", "c_Fy"]
    assert fits["5 %", "point r", "k_Mtheta"]
    assert fits["10 %", "point s", "k_Mtheta"]
    # The source's damping of the rotation is never reached: its band mean is not biased downwards.
    damping = [row for row in rows if row.parameter == "c_Mtheta"]
    assert len(damping) == 4
    assert all(row.published < row.low < 1.5 < row.median + 0.05 for row in damping)


def test_compliance_fit_beats_the_band_means(results):
    result = results["3.3-beams-1mm"]
    fit = rmse(result, "5 % complex", "compliance")
    means = rmse(result, "5 % complex", "ismm", "point s: 200-400 / 650-800")
    # Every third line is used: sqrt(3) times the limits on all lines.
    for parameter, limit in {"k_Fy": 0.2, "c_Fy": 1.3, "k_Mtheta": 0.9, "c_Mtheta": 1.2}.items():
        assert fit[parameter] < 1.25 * np.sqrt(3) * limit
        assert fit[parameter] < means[parameter]
    assert 8 < means["k_Fy"] < 25
    assert means["c_Fy"] > 40


@pytest.mark.parametrize(("name", "noise", "number"), [("3.3", "5 % complex", 237), ("3.2", "5 %", 148)])
def test_compliance_fit_of_a_realisation_that_once_ran_away(name, noise, number):
    import jointfrf as jf
    from jointfrf.estimator import estimate, joint_basis

    case = read_case(find_case(name))
    exact = exact_frfs(case)
    kind = next(n for n in case.noises if n.name == noise)
    h = jf.realisations(exact.interface(exact.h_c), kind.level, kind.kind, case.seed, first=number)
    basis = joint_basis(2 * np.pi * case.freq_hz, case.joint.dofs, "viscous", "zero")
    theta = estimate(h, np.eye(4), basis, tolerance=0.5).theta[0]
    np.testing.assert_allclose(theta[[0, 1, 3]], case.actual[[0, 1, 3]], rtol=0.15)


def test_ismm_against_decoupling(results):
    result = results["3.3.1-decoupling"]
    ismm = rmse(result, "5 %", "ismm")
    for equation in ("rr", "rs", "sr", "ss"):
        other = rmse(result, "5 %", f"decoupling-{equation}")
        for parameter in ("k_Fy", "k_Mtheta", "c_Mtheta"):
            assert ismm[parameter] < other[parameter], (equation, parameter)
    rr = rmse(result, "5 %", "decoupling-rr")
    assert rr["k_Fy"] == pytest.approx(23, abs=3)
    assert rr["k_Mtheta"] == pytest.approx(36, abs=6)
    assert rr["c_Fy"] < ismm["c_Fy"]


def test_regenerated_frfs_are_near_the_exact_ones(results):
    found = [r for r in results["3.3-beams-1mm"].regenerated if r.identified.method == "compliance"]
    assert {r.point for r in found} == {"r", "s"}
    for r in found:
        assert 0 < np.median(r.amplitude) < 1
        assert r.frequency.max() == 0


def test_a_realisation_depends_on_its_number_only():
    case = read_case(find_case("3.2"))
    exact = exact_frfs(case)
    few, more = run_study(case, exact, 3), run_study(case, exact, 5)
    for a, b in zip(few, more, strict=True):
        np.testing.assert_array_equal(a.theta, b.theta[:3])
        assert len(np.unique(b.theta[:, 0])) == 5


def test_published_values_are_ranked_among_the_realisations(results):
    result = results["3.1-discrete"]
    theta = next(f.theta for f in result.identified if f.method == "ismm")
    row = next(row for row in identified_rows(result) if row.parameter == "c_x" and row.published)
    assert row.percentile == pytest.approx(100 * np.mean(theta[:, 1] < 3.37))
    assert row.fits == (1 <= row.percentile <= 99)
    assert (row.low, row.median, row.high) == pytest.approx(tuple(np.percentile(theta[:, 1], [2.5, 50, 97.5])))


def test_files_of_a_case(tmp_path):
    output = run_case(find_case("3.1"), tmp_path / "deep" / "out", realisations=5)
    folder = tmp_path / "deep" / "out" / "3.1-discrete"
    assert output.report == folder / "report.html"
    tables = {table.key: table for table in make_tables(output.result)}
    assert {path.stem for path in (folder / "tables").iterdir()} == set(tables)
    with (folder / "tables" / "identified.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["parameter"] for row in rows] == ["k_x", "c_x", "k_x", "c_x"]
    assert float(rows[0]["median"]) == float(np.median(output.result.identified[0].theta[:, 0]))
    content = json.loads((folder / "results.json").read_text())
    assert content["realisations"] == 5
    assert content["natural_frequencies_hz"]["actual"] == pytest.approx([2.598, 4.682, 7.770, 8.374], abs=6e-4)
    assert content["identified"][0]["published"] == 2010.9
    assert not [path.name for path in folder.rglob(".*")]


def test_a_case_of_ones_own_without_expected_numbers(tmp_path):
    own = tmp_path / "mine"
    own.mkdir()
    text = (find_case("3.1") / "case.toml").read_text()
    (own / "case.toml").write_text(text.replace("stiffness = 2000.0  # N/m", "stiffness = 1500.0"))
    output = run_case(own, tmp_path, realisations=4)
    row = identified_rows(output.result)[0]
    assert (row.actual, row.published, row.fits) == (1500.0, None, None)
    assert row.median == pytest.approx(1500, rel=0.02)
    assert (tmp_path / "mine" / "report.html").is_file()
