"""The report room by itself: limits of axes, labels, pages of neutral parts, the figures of one identification."""

import ast
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
import jointfrf.workbench.report
from jointfrf.dofs import Parameter
from jointfrf.workbench.cases.comparison import verdict_sentence
from jointfrf.workbench.report.axes import bulk_limits, modulus_label, parameter_label, parameter_lines
from jointfrf.workbench.report.document import Document, Listing, Picture, Section, make_document
from jointfrf.workbench.report.draw import draw
from jointfrf.workbench.report.figure import Curve, Figure, Panel
from jointfrf.workbench.report.fit import fit_figures
from jointfrf.workbench.report.table import Table, as_text, plain_rows, table_csv, written


def test_the_report_room_knows_of_no_case():
    for path in Path(jointfrf.workbench.report.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom):
                assert not str(node.module).startswith(("jointfrf.workbench.cases", "jointfrf.workbench.cli")), path


def test_limits_leave_out_a_few_outliers_and_hold_what_must_be_seen():
    rng = np.random.default_rng(1)
    values = np.append(rng.normal(10, 1, 1000), [1e6, -1e6, np.nan, np.inf])
    low, high = bulk_limits([values[:500], values[500:]])
    assert 6 < low < 8.5
    assert 11.5 < high < 14
    assert bulk_limits([values], shown=[40.0])[1] > 40
    # Not further from the actual value than three times its size.
    low, high = bulk_limits([np.array([100.0, 200.0, 300.0])], around=10.0)
    assert low < 10
    assert 40 < high < 50
    assert bulk_limits([np.zeros(3)]) == (-1.0, 1.0)
    assert bulk_limits([np.full(3, np.nan)]) == (-1.0, 1.0)


def test_labels_have_the_units_of_the_dof():
    assert parameter_label(Parameter.parse("c_Mtheta_z")) == r"$c_{M\theta _z}$, N m s/rad"
    assert modulus_label("ss", "Mtheta") == "$|H_{ss}|$, rad/(N m)"
    assert modulus_label("jj", "Fy") == "$|H_{jj}|$, m/N"


def test_lines_of_parameters():
    freq, k = np.array([1.0, 2.0]), np.array([3 + 4j, 5 + 8j])
    np.testing.assert_array_equal(parameter_lines(k, freq, Parameter.parse("k_y")), [3, 5])
    np.testing.assert_array_equal(parameter_lines(k, freq, Parameter.parse("h_y")), [4, 8])
    np.testing.assert_allclose(parameter_lines(k, freq, Parameter.parse("c_y")), np.array([4, 4]) / (2 * np.pi))


TABLE = Table(
    "k", "Found", ("parameter", "value", "RMSE, %", ""),
    ((Parameter.parse("k_theta_x"), 1234.5678, 1.23456, "fits"), (Parameter.parse("c_y"), 2.0, 5.0, "does not fit")),
    failing=(1,), note="a note", percentages=("RMSE, %",),
)  # fmt: skip


def test_a_parameter_in_a_table_is_its_name():
    assert as_text(TABLE).splitlines()[3].split() == ["fits", "k_theta_x", "1234.6", "1.23"]
    assert plain_rows(TABLE)[1] == ["c_y", 2.0, 5.0, "does not fit"]
    assert table_csv(TABLE).splitlines()[:2] == [
        'verdict,parameter,value,"RMSE, %"',
        "fits,k_theta_x,1234.5678,1.23456",
    ]


SUMMARY = Table("short", "What fits", ("table", "fit", ""), (("Found", "1 of 2", "does not fit"),), failing=(0,))


def test_a_page_of_neutral_parts():
    x = np.arange(1.0, 5.0)
    figure = Figure("f", "A <caption>", (Panel("", "x", "y", (Curve("a", x, x, "actual"),)),), number="9-9")
    sections = [
        Section("summary", "Summary", [SUMMARY, TABLE]), Section("figures", "Figures", [Picture(figure, draw(figure))]),
        Section("subject", "The data", [Listing("", "text"), Listing("file", "<x>")]),
    ]  # fmt: skip
    text = make_document(Document("A & B", "About.", sections))
    for part in ("A &amp; B", '<h3 id="short">What fits</h3>', "<i>k</i><sub>θx</sub>",
                 "<b>Figure 9-9.</b> A &lt;caption&gt;.",
                 '<h2 id="subject">The data</h2>', "<summary>file</summary><pre>&lt;x&gt;</pre>", "note"):  # fmt: skip
        assert part in text
    assert text.count('class="failing"') == 2
    assert "subject" not in make_document(Document("t", "", [Section("subject", "The data", [Listing("", "")])]))
    assert not re.search(r'(?:src|href)="(?!data:|#)', text)


def test_a_verdict_counts_comparisons():
    counted = replace(SUMMARY, key="agreement")
    assert verdict_sentence([TABLE, counted]).startswith("0 of 1 comparisons")
    assert verdict_sentence([replace(counted, failing=())]) == "What is known fits."
    assert verdict_sentence([TABLE]) == ""


def test_numbers_on_a_page_have_no_false_sign_and_no_false_digits():
    columns = ("error, %", "x, mm")
    table = Table("n", "Numbers", columns, ((2.6e-7, -0.0), (-2.6e-7, 0.25), (0.0, 1e-7)), percentages=columns[:1])
    assert written(table) == [["< 0.001", "0"], ["> -0.001", "0.25"], ["0", "1e-7"]]
    assert plain_rows(table)[0][0] == 2.6e-7


@pytest.fixture
def fit(beams):
    gamma = jf.pollute(beams.gamma(beams.joint), 0.01, "complex", 3)
    return jf.identify(beams.freq, gamma, ["y", "theta"], noise=0.01)


def test_figures_of_a_fit_hold_lines_fit_and_interval(fit):
    figures = {figure.key: figure for figure in fit_figures(fit)}
    assert list(figures) == ["joint_y", "joint_theta"]
    stiffness, _, compliance, loss = figures["joint_theta"].panels
    each, fitted = stiffness.curves
    np.testing.assert_array_equal(each.y, fit.k_lines[:, 1, 1].real)
    np.testing.assert_allclose(fitted.y, fit.stiffness[1])
    (interval,) = stiffness.ribbons
    assert (interval.low[0], interval.high[0]) == fit.confidence_interval(0.95)["k_theta"]
    assert stiffness.y_label == "Re K*, N m/rad"
    assert (compliance.y_label, loss.y_label) == ("Re C, rad/(N m)", "Im C, rad/(N m)")
    np.testing.assert_allclose(
        compliance.curves[1].y + 1j * loss.curves[1].y, np.linalg.inv(fit.k_joint(fit.freq_hz))[:, 1, 1]
    )
    assert not compliance.ribbons
    for panel in figures["joint_theta"].panels:
        low, high = panel.y_limits
        assert low < panel.curves[1].y.min() <= panel.curves[1].y.max() < high
    drawn = draw(figures["joint_theta"])
    assert drawn.png.startswith(b"\x89PNG")
    assert drawn.svg.startswith(b"<svg")
    assert drawn == draw(figures["joint_theta"])
    alone = draw(figures["joint_theta"], png=False)
    assert alone.png == b""
    assert alone.svg.count(b"<path") == drawn.svg.count(b"<path") > 10
