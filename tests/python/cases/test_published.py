"""What tables of the cases say of published values: each recomputed by another route, from the files of the case."""

import tomllib

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import eigsh

import jointfrf as jf
from jointfrf.dofs import Parameter
from jointfrf.workbench.cases.catalogue import find_case
from jointfrf.workbench.cases.known_joint.tables import build_tables
from thinned_cases import PLANE, SOLID

NAMES = [*PLANE, *SOLID]


@pytest.fixture(scope="module")
def results(thinned):
    return {name: thinned(name) for name in NAMES}


def expected_of(name):
    return tomllib.loads((find_case(name) / "expected.toml").read_text(encoding="utf-8"))


def by_key(result):
    return {table.key: table for table in build_tables(result)}


@pytest.mark.parametrize("name", NAMES)
def test_parameters_fit_where_they_lie_inside_the_interval_that_is_shown(results, name):
    result = results[name]
    rows = [
        dict(zip(t.columns, row, strict=True))
        for t in by_key(result).values()
        if "thesis" in t.columns
        for row in t.rows
    ]
    rows = [row for row in rows if "percentile" in row and "parameter" in row]
    printed = [one for one in expected_of(name).get("identified", []) if one.get("values")]
    assert len(rows) == sum(len(one["values"]) for one in printed)
    names = [parameter.name for parameter in result.case.parameters]
    left = list(rows)
    for one in printed:
        found = next(
            f for f in result.identified if (f.noise, f.method, f.bands) == (one["noise"], one["method"], one["bands"])
        )
        for parameter, value in one["values"].items():
            low, high = np.percentile(found.theta[:, names.index(parameter)], [2.5, 97.5])
            row = next(r for r in left if (r["noise"], r["bands"], r["parameter"].name, r["thesis"]) ==
                       (one["noise"], one["bands"], parameter, value))  # fmt: skip
            left.remove(row)
            assert (row["2.5 %"], row["97.5 %"]) == pytest.approx((low, high))
            assert row[""] == ("fits" if low <= value <= high else "does not fit")


def coupled_frequencies(case, joint, count):
    """Natural frequencies of both models with springs between them."""
    k, m = (
        sparse.block_diag([sparse.csc_array(getattr(side.model, what)) for side in (case.a, case.b)], format="lil")
        for what in ("stiffness", "mass")
    )
    at_j, at_k = case.a.dofs(case.points["j"]), [len(case.a.model.dofs) + k for k in case.b.dofs(case.points["k"])]
    for i, j, spring in zip(at_j, at_k, np.diagonal(joint.stiffness), strict=True):
        k[i, i] += spring
        k[j, j] += spring
        k[i, j] -= spring
        k[j, i] -= spring
    if k.shape[0] < 20:
        values = np.linalg.eigvals(np.linalg.solve(m.toarray(), k.toarray()))
    else:
        # Shifted below zero: along the beams, B of the plane cases is free.
        values = eigsh(k.tocsc(), count + 1, m.tocsc(), sigma=-1000.0, return_eigenvectors=False)
    return np.sqrt(np.sort(values.real[values.real > 1])[:count]) / (2 * np.pi)


@pytest.mark.parametrize("name", NAMES)
def test_natural_frequencies_fit_where_they_are_as_near_as_the_file_says(results, name):
    case = results[name].case
    table = by_key(results[name])["natural-frequencies"]
    at = next(i for i, column in enumerate(table.columns) if column.endswith("Hz"))
    rows = [row[at:] for row in table.rows if row[-1]]
    printed = sorted(expected_of(name).get("frequencies", []), key=lambda one: one["joint"] != "initial")
    values = [(value, one["within_percent"]) for one in printed for value in one["values"]]
    assert len(rows) == len(values)
    joints = {"actual": case.joint, "initial": case.initial}
    own = (coupled_frequencies(case, joints[one["joint"]], len(one["values"])) for one in printed)
    frequencies = np.concatenate([[], *own])
    for row, (value, within), found in zip(rows, values, frequencies, strict=True):
        assert row[:2] == (pytest.approx(found, rel=1e-6), value)
        assert row[-1] == ("fits" if abs(found / value - 1) * 100 <= within else "does not fit")
        assert row[-1] == "fits"


def changes(result, joint, parameter, key):
    """Relative change of an observed FRF for one percent of a stiffness, by coupling twice."""
    exact, n = result.exact, result.exact.n
    observed = next(one for one in result.case.observed if one.key == key)
    at = "jrks".index(observed.point) * n + observed.dof
    dof = [p.name for p in result.case.parameters].index(parameter)
    h = []
    for factor in (1 - 1e-4, 1 + 1e-4):
        springs = np.diagonal(joint.stiffness).copy()
        springs[dof] *= factor
        k = jf.Joint(springs, np.diagonal(joint.damping)).dynamic_stiffness(exact.freq_hz)
        h.append(jf.couple(exact.h_a, exact.h_b, k, range(n), range(n))[:, at, at])
    return abs((h[1] - h[0]) / (h[1] + h[0]) * 2 / 2e-4 / 100)


#: Regions that the source names, and those that our sensitivities confirm.
REGIONS = {"3.1-discrete": (1, 1), "3.2-fe-beams": (2, 2), "3.3-beams-1mm": (5, 3), "4.3.1-six-dof": (8, 7)}


@pytest.mark.parametrize("name", REGIONS)
def test_regions_fit_where_an_frf_is_twice_as_sensitive_inside(results, name):
    result = results[name]
    printed = expected_of(name)["regions"]
    freq = result.exact.freq_hz
    table = next(table for table in by_key(result).values() if "first estimate: inside, dB" in table.columns)
    rows = [dict(zip(table.columns, row, strict=True)) for row in table.rows]
    at = 0
    for one in printed:
        curves = [
            changes(result, joint, one["parameter"], one["observed"])
            for joint in (result.case.initial, result.case.joint)
        ]
        regions = [(freq >= low) & (freq <= high) for low, high in one["bands"]]
        outside = ~np.any(regions, axis=0)
        for region in regions:
            row = rows[at]
            at += 1
            assert row["parameter"].name == one["parameter"]
            levels = [20 * np.log10(np.median(c[region]) / np.median(c[outside])) for c in curves]
            assert [row[f"{joint}: inside, dB"] for joint in ("first estimate", "actual")] == pytest.approx(
                levels, abs=0.02
            )
            assert row[""] == ("fits" if max(levels) > 6.02 else "does not fit")
    assert (at, at - len(table.failing)) == REGIONS[name]


def test_bands_of_the_first_estimate_are_nearer_to_the_regions_of_section_3_3(results):
    """At the tip 200-400 and 600-800 Hz: k_Fy. The text speaks of the sensitivity that a user has before."""
    result = results["3.3-beams-1mm"]
    k_fy = Parameter.parse("k_Fy")
    initial, actual = (one.proposals["s", k_fy] for one in result.sensitive.values())
    assert len(initial) == len(actual) == 2
    low, high = initial[0]
    assert abs(low - 200) < 5 < abs(actual[0][0] - 200)
    assert initial[1][0] < actual[1][0]
    table = by_key(result)["bands"]
    shown = {(row[0].name, row[2]): row[4] for row in table.rows}
    assert shown["k_Fy", "first estimate"].startswith(f"{low:g}-{high:g}, ")
    assert shown["k_Fy", "actual"] != shown["k_Fy", "first estimate"]


@pytest.mark.parametrize("name", SOLID)
def test_published_errors_are_ranked_among_the_realisations(results, name):
    result = results[name]
    ranks = {}
    for one in result.case.expected.regenerated:
        found = next(
            frf for frf in result.regenerated
            if (frf.observed.key, frf.identified.noise, frf.identified.method) == (one.observed, one.noise, one.method)
        )  # fmt: skip
        for published, errors in ((one.amplitude, found.amplitude), (one.frequency, found.frequency)):
            errors = errors[found.bands.index(one.band)]
            errors = errors[np.isfinite(errors)]
            below = 100 * np.mean(errors < published) if errors.size and published is not None else None
            ranks.setdefault(one.source, []).append(below)
    tables = [table for table in by_key(result).values() if {"error", "percentile"} <= set(table.columns)]
    assert len(tables) == len(ranks)
    for table, expected in zip(tables, ranks.values(), strict=True):
        at = table.columns.index("percentile")
        shown = [(row[at], rank) for row, rank in zip(table.rows, expected, strict=True) if row[at] is not None]
        assert max(rank for _, rank in shown) > 1
        np.testing.assert_allclose(*zip(*shown, strict=True))


@pytest.mark.parametrize("name", ["3.1-discrete", "3.3.1-decoupling", "4.3.1-six-dof"])
def test_both_blocks_of_the_modification_are_reported(results, name):
    """K0 - D_jk and K0 - D_kj from the whole of D (2.47), over the bands of the case."""
    result = results[name]
    case, exact, n = result.case, result.exact, result.exact.n
    noise = case.noises[0]
    gamma = noise.pollute(exact.interface(exact.h_c), case.seed, 3)
    d = jf.find_modification(exact.interface(exact.h_initial), gamma)
    found = next(f for f in result.identified if (f.noise, f.method) == (noise.name, "ismm"))
    bands = {dof: case.band_sets[0].bands[Parameter.of_dof("k", dof)] for dof in exact.dofs}
    for theta, block in ((found.theta, d[:, :n, n:]), (found.theta_kj, d[:, n:, :n])):
        mean = jf.band_mean(case.freq_hz, exact.k_initial - block, bands, exact.dofs)
        np.testing.assert_allclose(theta[3], np.concatenate(mean), rtol=1e-6)
    assert (found.theta != found.theta_kj).all()
    table = by_key(result)["blocks"]
    assert len(table.rows) == 2 * n * sum(f.method == "ismm" for f in result.identified)
    row = dict(enumerate(table.rows[0]))
    assert (row[6], row[9]) == pytest.approx((np.median(found.theta[:, 0]), np.median(found.theta_kj[:, 0])))
