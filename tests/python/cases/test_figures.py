"""What figures and pages owe to a reader: phases, scales, order, styles, tables that fit on any screen."""

import re
from itertools import combinations, pairwise

import numpy as np
import pytest

from jointfrf.workbench.cases.catalogue import list_cases, read_case
from jointfrf.workbench.cases.known_joint.figures import build_figures
from jointfrf.workbench.cases.known_joint.keys import KnownJointCase
from jointfrf.workbench.cases.known_joint.tables import build_summary, build_tables
from jointfrf.workbench.cases.run import numbered
from jointfrf.workbench.report.document import Document, Picture, Section, make_document
from jointfrf.workbench.report.draw import STYLES, draw, laid_out, shortened
from jointfrf.workbench.report.figure import Curve, Figure, Interval, Panel
from jointfrf.workbench.report.receptance import PHASE, phase_degrees
from jointfrf.workbench.report.table import Table, as_text, shown, table_csv, turned

X = np.linspace(0, 10, 50)


@pytest.fixture(scope="module")
def result(thinned):
    return thinned("3.2-fe-beams")


@pytest.fixture(scope="module")
def figures(result):
    return numbered(result.case, build_figures(result))


def texts(svg):
    """Texts of a drawing: place to the right, place down, text."""
    found = re.findall(r'<text[^>]*? x="([\d.-]+)" y="([\d.-]+)"[^>]*>([^<]+)</text>', svg.decode())
    return [(float(x), float(y), text) for x, y, text in found]


def test_every_modulus_has_its_phase_below(figures):
    count = 0
    for figure in figures:
        for i, panel in enumerate(figure.panels):
            if not panel.y_label.startswith("$|H"):
                continue
            count += 1
            phase = figure.panels[i + figure.columns]
            assert phase.y_label == PHASE
            assert panel.x_label == ""
            assert [curve.label for curve in phase.curves] == [curve.label for curve in panel.curves]
            for curve, modulus in zip(phase.curves, panel.curves, strict=True):
                np.testing.assert_array_equal(curve.x, modulus.x)
                assert phase.y_limits[0] < curve.y.min() <= curve.y.max() < phase.y_limits[1]
    assert count == 2 + 4 + 4 + 4  # receptances, polluted, sensitivities, regenerated


def test_the_phase_of_an_oscillator_falls_from_0_to_180_degrees():
    omega = np.linspace(0, 5, 200)
    phase = phase_degrees(1 / (4 - omega**2 + 0.1j * omega))
    np.testing.assert_allclose(phase, -np.degrees(np.arctan2(0.1 * omega, 4 - omega**2)), atol=1e-12)
    assert np.all(np.diff(phase) < 0)
    assert abs(np.diff(phase_degrees(-1 + 1e-3j * np.array([1, -1, 1, -1])))).max() < 1


def test_figures_stand_in_the_order_of_the_source(result, figures):
    numbers = [figure.number for figure in figures]
    count = len(result.case.figure_numbers)
    assert numbers[:count] == ["3-9a", "3-9b", "3-10", "3-11", "3-12", "3-13a", "3-13b", "3-14a", "3-14b"]
    assert set(numbers[count:]) == {""}


def test_curves_of_a_figure_are_told_apart_without_colour(figures):
    def grey(style):
        red, green, blue = (int(style.colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
        return 0.3 * red + 0.59 * green + 0.11 * blue

    for figure in figures:
        used = {
            (shape.label, shape.style)
            for panel in figure.panels
            for shape in (*panel.curves, *panel.levels)
            if shape.label
        }
        assert len({label for label, _ in used}) == len(used)
        for (_, a), (_, b) in combinations(used, 2):
            first, second = STYLES[a], STYLES[b]
            wider = max(first.width, second.width) / min(first.width, second.width)
            assert first.dashes != second.dashes or abs(grey(first) - grey(second)) > 0.2 or wider > 1.5, (a, b)


def test_the_compliance_fit_stands_in_every_figure_of_identified_parameters(figures):
    shown_in = [f for f in figures if f.key.startswith(("identified", "methods"))]
    assert len(shown_in) == 4
    for figure in shown_in:
        for panel in figure.panels:
            assert "compliance fit, median" in [level.label for level in panel.levels]
    for folder in list_cases():
        case = read_case(folder)
        if isinstance(case, KnownJointCase):
            assert "compliance" in case.noises[0].methods, folder


def test_mode_panels_have_one_range(figures):
    modes = next(figure for figure in figures if figure.key == "modes")
    ((low, high),) = {panel.y_limits for panel in modes.panels}
    for panel in modes.panels:
        heights = np.concatenate([curve.y for curve in panel.curves])
        assert low < heights.min() <= heights.max() < high
        assert abs(heights).max() == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize(("size", "unit", "shown_unit"), [
    (6e6, "N/m", "MN/m"), (5e3, "N m/rad", "N m/rad"), (3e-8, "m/N", "nm/N"), (2e-4, "rad/(N m)", "µrad/(N m)"),
    (3e5, "%", "%"),
])  # fmt: skip
def test_a_prefix_stands_for_the_power_of_ten(size, unit, shown_unit):
    panel = Panel("", "x, m", f"a, {unit}", (Curve("c", X, size * (1 + 0.001 * X), "actual"),))
    written = [text for _, _, text in texts(draw(Figure("f", "", (panel,))).svg)]
    assert f"a, {shown_unit}" in written
    assert not [text for text in written if re.search(r"[e×+]", text)]  # no offset, no power


@pytest.mark.parametrize(
    "key",
    [
        "polluted",
        "noise",
        "sensitivity-s-Fy",
        pytest.param("identified-k_Mtheta", marks=pytest.mark.long),
    ],
)
def test_numbers_along_axes_do_not_collide(figures, key):
    drawn = texts(draw(next(figure for figure in figures if figure.key == key)).svg)
    numbers = [(x, y, text) for x, y, text in drawn if re.fullmatch(r"[−\d.]+", text)]
    assert len(numbers) > 10
    for row in {y for _, y, _ in numbers}:
        own = sorted((x, text) for x, y, text in numbers if y == row)
        for (x, text), (other_x, other) in pairwise(own):
            assert other_x - x > 0.5 * 0.62 * 8.5 * (len(text) + len(other)), (text, other)
    for column in {x for x, _, _ in numbers}:
        heights = sorted(y for x, y, _ in numbers if x == column)
        assert all(b - a > 8.5 for a, b in pairwise(heights))


def test_an_interval_that_reaches_beyond_the_axis_ends_in_an_arrowhead():
    def marks(low, high):
        """Where marks lie: those of the axes, of the interval where they can be seen, arrowheads."""
        panel = Panel("", "k, N/m", "", intervals=(Interval("fit", low, 5.0, high),), x_limits=(0.0, 10.0))
        svg = draw(Figure("one", "caption", (panel,))).svg.decode()
        return [float(x) for x in re.findall(r'<use [^>]*?x="([-\d.]+)"', svg)]

    within = marks(1.0, 9.0)
    left, right = min(within), max(within)
    for low, high, more in ((1.0, 20.0, {right}), (-5.0, 9.0, {left}), (-5.0, 20.0, {left, right})):
        found = marks(low, high)
        assert all(found.count(edge) == within.count(edge) + (edge in more) for edge in (left, right))


def test_a_short_drawing_has_the_same_lines_and_texts():
    points = np.random.default_rng(3).uniform(0, 500, (40, 2))
    line = "M " + " \nL ".join(f"{x:.6f} {y:.6f}" for x, y in points)
    path = f'<path d="{line} \n" style="fill: none"/>'
    svg = f'<svg><!-- a --><style></style><g id="a">\n {path}\n<text>1.2345</text></g></svg>'
    text = shortened(svg)
    assert len(text) < 0.8 * len(svg)
    found = np.array(re.findall(r"[\d.]+", re.search(r' d="([^"]*)"', text)[1]), float).reshape(-1, 2)
    np.testing.assert_allclose(found, points, atol=0.0051)
    assert text.endswith("><text>1.2345</text></g></svg>")


def test_numbers_along_an_axis_follow_its_limits():
    panel = Panel("", "x, m", "k, N/m", (Curve("c", X, 1e6 * X, "actual"),))
    (ax,) = laid_out(Figure("f", "", (panel,))).axes
    assert [text.get_text() for text in ax.get_yticklabels()] == ["0.0", "2.5", "5.0", "7.5", "10.0"]
    ax.set_ylim(0, 4e4)
    assert [text.get_text() for text in ax.get_yticklabels()] == ["0", "10", "20", "30", "40"]
    assert ax.get_ylabel() == "k, kN/m"


def test_the_verdict_is_the_first_column_wherever_a_table_is_shown(result):
    tables = build_tables(result)
    summary = build_summary(result, tables)
    text = make_document(Document("", "", [Section("tables", "Tables", [*summary, *tables])]))
    judged = [table for table in (*summary, *tables) if "" in table.columns]
    regions = "section-3-2-figures-3-11-and-3-12"
    assert [table.key for table in judged] == ["agreement", "table-3-2", regions, "natural-frequencies", "noise-free"]
    for table in judged:
        head = text.split(f'id="{table.key}"')[1].split("</tr>")[0]
        assert re.findall(r"<th[^>]*>([^<]*)</th>", head)[:2] == ["verdict", table.columns[0]]
        assert as_text(table).splitlines()[1].startswith("verdict ")
        assert table_csv(table).startswith("verdict,")
        for before, after in zip(table.rows, shown(table).rows, strict=True):
            assert after == (before[-1], *before[:-1])


def test_the_summary_counts_verdicts(result):
    tables = build_tables(result)
    agreement = build_summary(result, tables)[0]
    table = next(table for table in tables if table.key == "table-3-2")
    own = [row for row in agreement.rows if row[0] == "Table 3-2"]
    assert [row[1] for row in own] == [noise.name for noise in result.case.noises]
    for row in own:
        judged = [cells for cells in table.rows if cells[0] == row[1]]
        bad = [str(cells[2]) for cells in judged if cells[-1] == "does not fit"]
        assert row[3:] == (f"{4 - len(bad)} of 4", ", ".join(bad), "does not fit" if bad else "fits")


def test_a_page_fits_on_any_screen(result, figures):
    tables = build_tables(result)
    parts = [*build_summary(result, tables), *tables, Picture(figures[0], draw(figures[0]))]
    text = make_document(Document("", "", [Section("all", "All", parts)]))
    style = text.split("<style>")[1].split("</style>")[0]
    assert not re.search(r"overflow(-x)?:\s*(auto|scroll)|[^-]width:\s*\d+(px|pt|cm)", style)
    assert text.count('src="data:image/svg+xml,') == 1
    assert "image/png" not in text.split('src="')[1].split('"')[0]  # lines, not dots
    # Every cell knows its column where rows become cards.
    assert text.count("<td ") == text.count("data-label=")
    assert "<ul>" not in text


def test_a_table_of_many_columns_is_turned_on_a_page():
    names = tuple(f"{i} Hz, %" for i in range(14))
    wide = Table("w", "Errors", ("by", "from", *names), tuple((r, "x", *map(float, range(14))) for r in "AB"),
                 percentages=names)  # fmt: skip
    assert turned(wide).columns == ("by, from", "A, x", "B, x")
    assert turned(wide).rows == tuple((name, float(i), float(i)) for i, name in enumerate(names))
    assert turned(wide).percentages == ("A, x", "B, x")
    body = make_document(Document("", "", [Section("tables", "Tables", [wide])])).split("<tbody>")[1]
    assert body.count("<tr") == 14
