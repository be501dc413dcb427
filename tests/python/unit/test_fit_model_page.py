"""What the page of a fit of an assembly has beside: FRAC, residual by channel and band, unknowns, what to do next."""

import pickle
import warnings

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.workbench.report.fit import fit_figures
from jointfrf.workbench.report.fit_frfs import assurance, assurance_map, band_map
from jointfrf.workbench.report.fit_page import ReportOptions, fit_document
from jointfrf.workbench.report.fit_words import is_wide, next_parts, next_sentences, unknowns_table

FREQ = np.arange(15.0, 801.0, 8.0)
SECTION = {"density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}


def assembly(joint, unknowns=None):
    a = jf.beam(0.3, 12, ends=("clamped", "free"), youngs_modulus=67e9, **SECTION)
    b = jf.beam(0.225, 9, youngs_modulus=67e9, **SECTION)
    return jf.Assembly(
        jf.Substructure(a, ["13:y", "13:theta"], unknowns or {}), jf.Substructure(b, ["1:y", "1:theta"]), joint,
        [jf.AddedMass("B/10:y", jf.Unknown(0.001, 0.002, 0.0))],
    )  # fmt: skip


def fit_of(responses, forces, level=0.05):
    truth = assembly(jf.Joint([6e5, 5e3], [20, 1.5], ["y", "theta"]))
    truth = jf.Assembly(truth.a, truth.b, truth.joint, [jf.AddedMass("B/10:y", 0.005)])
    h = jf.pollute(truth.receptance(FREQ, responses, forces), level, seed=4)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return jf.identify_model(
            FREQ, h, assembly(jf.Joint([4e5, 4e3], [10, 1], ["y", "theta"])), responses, forces, noise=level
        )


@pytest.fixture(scope="module")
def fit():
    return fit_of(["B/10:y", "A/7:y"], ["B/10:y"])


def test_frac_is_the_squared_correlation_of_frfs():
    rng = np.random.default_rng(1)
    m = rng.standard_normal((50, 2, 2)) + 1j * rng.standard_normal((50, 2, 2))
    p = (0.3 - 2j) * m
    p[:, 0, 1] += rng.standard_normal(50)
    m[:, 1, 1] = np.nan
    found = assurance(m, p)
    assert found[0, 0] == pytest.approx(1, abs=1e-12)
    assert np.isnan(found[1, 1])
    of_one = np.vdot(p[:, 0, 1], m[:, 0, 1]) / np.linalg.norm(m[:, 0, 1]) / np.linalg.norm(p[:, 0, 1])
    assert found[0, 1] == pytest.approx(abs(of_one) ** 2)
    assert found[0, 1] < 0.99


def test_maps_say_how_each_frf_agrees_and_where_not(fit):
    agreement = assurance_map(fit)
    assert agreement.values.shape == (2, 1)
    assert (agreement.values > 0.95).all()
    bands = band_map(fit)
    assert list(bands.rows) == ["response B/10:y", "response A/7:y", "force B/10:y"]
    assert bands.columns[0].startswith("15–")
    counts = [len(part) for part in np.array_split(FREQ, 8)]
    of_force = float(np.sqrt((bands.values[2] ** 2 * counts).sum() / sum(counts)))
    assert of_force == pytest.approx(float(np.sqrt((abs(fit.data.residual) ** 2).mean())))


def test_unknowns_that_moved_are_named(fit):
    rows = {row[0]: row for row in unknowns_table(fit).rows}
    assert set(rows) == {"A/youngs_modulus", "A/density", "B/youngs_modulus", "B/density", "mass B/10:y"}
    assert rows["mass B/10:y"][-1] == "moved"  # 5 g, believed 1 g to 2 g
    assert float(rows["mass B/10:y"][4]) == pytest.approx(2, abs=0.3)
    assert rows["A/youngs_modulus"][-1] == "confirmed"


def test_what_to_measure_next_keeps_its_promise(fit):
    """The standard errors of a fit with the channel that is named, against those that were promised."""
    assert is_wide(fit)
    best = fit.data.next_channels()[0]
    assert best.widest == "c_theta"
    assert best.dof not in fit.responses
    more = fit_of(["B/10:y", "A/7:y", best.dof], ["B/10:y"]) if best.kind == "response" else fit_of(
        ["B/10:y", "A/7:y"], ["B/10:y", best.dof]
    )  # fmt: skip
    for name, share in best.shares.items():
        # The noise that is drawn moves the values at which both are computed.
        assert more.std_error[name] / fit.std_error[name] == pytest.approx(share, rel=0.3), name
    sentences = next_sentences(fit)
    assert sentences[0].startswith("Measure a ")
    assert best.dof in sentences[0]
    assert "c_theta" in sentences[0]


def test_nothing_is_advised_where_intervals_are_narrow(fit):
    narrow = fit_of(["A/13:y", "B/1:y", "A/7:y", "B/10:y"], ["A/13:y", "B/10:y"], 0.005)
    assert not is_wide(narrow)
    assert next_parts(narrow) == []
    keys = [section.key for section in fit_document(narrow, ReportOptions()).sections]
    assert "next" not in keys
    keys = [section.key for section in fit_document(fit, ReportOptions()).sections]
    assert keys.index("maps") < keys.index("unknowns") < keys.index("next")


def test_axes_of_a_joint_without_lines_fit_its_intervals(fit):
    ends = fit.confidence_interval(0.95)
    for dof, figure in zip(fit.dofs, fit_figures(fit), strict=True):
        low, high = ends[f"k_{dof}"]
        bottom, top = figure.panels[0].y_limits
        assert bottom < low < high < top
        assert top - bottom < 1.5 * (high - low)
        (damping,) = figure.panels[1].ribbons
        np.testing.assert_allclose(damping.high / damping.x / 2 / np.pi, ends[f"c_{dof}"][1], rtol=0.05)


def test_a_fit_goes_to_another_process_and_answers_there_as_here(fit):
    there = pickle.loads(pickle.dumps(fit))
    assert there.confidence_interval(0.95) == fit.confidence_interval(0.95)
    assert there.derived("c_y / k_y") == fit.derived("c_y / k_y")
    assert there.data.next_channels() == fit.data.next_channels()


def test_axes_of_a_joint_without_lines_of_its_own_fit_what_was_found(fit):
    loss = fit_figures(fit)[1].panels[3]
    (curve,) = loss.curves
    assert loss.y_label == "Im C, rad/(N m)"
    assert np.ptp(loss.y_limits) == pytest.approx(1.3 * np.ptp(curve.y))
