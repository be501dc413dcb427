"""The report of an identification: what it says and draws, and that what is thinned hides nothing."""

import json
import re
import warnings
from dataclasses import replace

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.channels.joint_channels import node_dofs
from jointfrf.dofs import DIRECTIONS, joint_parameters
from jointfrf.identification.fit_data import FitData
from jointfrf.identification.result import Fit
from jointfrf.workbench.report.chart import Chart, chart_view, thinned_dots, thinned_line
from jointfrf.workbench.report.document import Document, HeatMap, Section, make_document, words_of_findings
from jointfrf.workbench.report.draw import STYLES
from jointfrf.workbench.report.figure import Curve, Figure, Panel
from jointfrf.workbench.report.fit import fit_figures
from jointfrf.workbench.report.fit_frfs import compare_fit
from jointfrf.workbench.report.fit_page import ReportOptions, fit_document
from jointfrf.workbench.report.fit_words import finding_sentences, parameter_table, quality_sentences
from jointfrf.workbench.report.sketch import interface_points, interface_sketch, point_table
from jointfrf.workbench.report.table import written


def points_of(path: str) -> np.ndarray:
    """Places of the points of a path, shape (n, 2)."""
    found, at = [], np.zeros(2)
    for piece in path.split("m")[1:]:
        for step in np.array(re.findall(r"-?\d+", piece.split("h")[0]), float).reshape(-1, 2):
            at = at + step
            found.append(at)
    return np.array(found)


def drawn(x, y, most=4000, log_y=False, style="actual"):
    """Values of the points of a chart with one curve, and what the template shows of it."""
    figure = Figure("f", "f", (Panel("", "frequency, Hz", "h, m/N", (Curve("a", x, y, style),), log_y=log_y),))
    view = chart_view(Chart(figure, "alt", most))
    (panel,) = view["panels"]
    points, limits = points_of(panel["curves"][0]["path"]), panel["limits"]
    (x_low, x_high), (low, high) = limits["x"], limits["y"]
    found_x = x_low + points[:, 0] / view["wide"] * (x_high - x_low)
    found_y = low + (1 - points[:, 1] / view["high"]) * (high - low)
    return found_x, 10**found_y if log_y else found_y, panel


@pytest.mark.parametrize("log_y", [False, True])
def test_a_path_holds_the_curve(log_y):
    x = np.linspace(20, 1000, 491)
    y = 1e-6 * (2 + np.sin(x / 30)) * 10 ** (np.cos(x / 200))
    found_x, found_y, panel = drawn(x, y, log_y=log_y)
    np.testing.assert_allclose(found_x, x, atol=0.03)
    if log_y:
        np.testing.assert_allclose(found_y, y, rtol=1e-3)
    else:
        np.testing.assert_allclose(found_y, y, atol=1e-4 * np.ptp(y))
    ticks = [(at, float(text.replace("−", "-"))) for at, text in panel["x_ticks"]]
    for at, value in ticks:
        assert at == pytest.approx(100 * (value - 20) / 980)


def test_gaps_stay_gaps():
    x = np.r_[np.arange(10.0), np.arange(50.0, 60.0)]
    y = x.copy()
    y[4] = np.nan
    *_, panel = drawn(x, y)
    assert panel["curves"][0]["path"].count("m") == 3
    steps = np.repeat(np.arange(10.0), 2)[1:-1]
    *_, panel = drawn(steps, np.repeat(np.arange(9.0), 2))
    assert panel["curves"][0]["path"].count("m") == 1


def test_thinning_keeps_every_peak():
    rng = np.random.default_rng(3)
    y = rng.standard_normal(100_000)
    peaks = rng.choice(y.size, 40, replace=False)
    y[peaks[:20]], y[peaks[20:]] = 50 + rng.random(20), -50 - rng.random(20)
    y[70_000:71_000] = np.nan
    kept = thinned_line(y, 1000)
    assert kept.size <= 1000
    assert (np.diff(kept) > 0).all()
    edges = np.linspace(0, y.size, 500, endpoint=False).astype(int)
    for first, end in zip(edges, np.r_[edges[1:], y.size], strict=True):
        own, column = y[kept[(kept >= first) & (kept < end)]], y[first:end]
        assert own.size
        if np.isfinite(column).any():
            assert (np.nanmin(own), np.nanmax(own)) == (np.nanmin(column), np.nanmax(column))
    assert np.isnan(y[kept[(kept >= 70_400) & (kept < 70_600)]]).all()
    dots = thinned_dots(y, 1000)
    assert dots.size <= 1000
    assert {np.nanmax(y), np.nanmin(y)} <= set(y[dots])
    np.testing.assert_array_equal(thinned_line(y[:900], 1000), np.arange(900))


def test_dots_and_lines_come_back():
    x = np.arange(1.0, 30.0)
    found_x, found_y, _ = drawn(x, x**2, style="dots")
    np.testing.assert_allclose(found_x, x, atol=0.01)
    np.testing.assert_allclose(found_y, x**2, atol=0.2)


def test_points_of_an_interface_lie_where_they_were_put():
    places = {1: (0.1, 0.02, 0.3), 2: (0.1, 0.02, 0.34), 3: (0.1, 0.0, 0.3), 4: (0.1, 0.0, 0.34)}
    sides = jf.interface([1, 2], [3, 4], ["y", "theta_x"], places)
    for point in interface_points(sides):
        np.testing.assert_allclose(point.place, places[int(point.name)], atol=1e-12)
        assert point.side == (int(point.name) > 2)


def test_sensors_of_three_axes_without_names_lie_where_they_were_put():
    rng = np.random.default_rng(2)
    at = rng.uniform(-0.1, 0.1, (8, 3))
    axes = np.linalg.qr(rng.standard_normal((8, 3, 3)))[0]
    sides = [
        jf.virtual_point(np.repeat(at[own], 3, axis=0), axes[own].reshape(-1, 3), about, DIRECTIONS)
        for own, about in ((slice(4), [0.01, 0, 0]), (slice(4, 8), [0, 0.02, 0]))
    ]
    points = interface_points(jf.virtual_interface(*sides))
    assert [point.name for point in points] == [f"{3 * i}-{3 * i + 2}" for i in range(8)]
    assert [point.side for point in points] == [0] * 4 + [1] * 4
    np.testing.assert_allclose([point.place for point in points], at, atol=1e-12)
    # One direction each: what is along it is not known.
    single = [jf.virtual_point(at[own], [[0, 1, 0]] * 4, [0, 0, 0], ["y"]) for own in (slice(4), slice(4, 8))]
    points = interface_points(jf.virtual_interface(*single))
    np.testing.assert_allclose([point.place for point in points], at * [1, 0, 1], atol=1e-12)


@pytest.fixture(scope="module")
def fits(beams):
    gamma = jf.pollute(beams.gamma(beams.joint), 0.01, seed=5)
    coupled = jf.pollute(beams.gamma(jf.Joint([[6e5, 1e4], [1e4, 5e3]], [20, 1.5])), 0.005, seed=1)
    stiff = jf.Joint([1e12, 5e3], [0, 1.5], ["y", "theta"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", jf.IdentificationWarning)
        return {
            "plain": jf.identify(beams.freq, gamma, ["y", "theta_z"]),
            "open": jf.identify(beams.freq, jf.pollute(beams.gamma(stiff), 0.01, seed=2), ["y", "theta_z"]),
            "ignore": jf.identify(beams.freq, gamma, ["y", "theta_z"], cross="ignore"),
            "cross": jf.identify(beams.freq, coupled, ["y", "theta_z"], cross="fit"),
            "one line": jf.identify(beams.freq[50:51], gamma[50:51], ["y", "theta_z"], noise=0.01),
            "numbers": jf.identify(beams.freq[::-1], gamma[::-1], reciprocal=False),
        }


@pytest.mark.parametrize("kind", ["plain", "open", "ignore", "cross", "one line", "numbers"])
def test_every_fit_has_a_report(fits, kind, tmp_path):
    fit = fits[kind]
    path = jf.write_report(fit, tmp_path / "report.html", source="<bars & plates>.uff", command="jointfrf identify")
    text = path.read_text(encoding="utf-8")
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    assert "&lt;bars &amp; plates&gt;.uff" in text
    assert not re.search(r'(?:src|href)="(?!data:|#)', text)
    assert "nan" not in re.sub(r"<script>.*</script>", "", text, flags=re.DOTALL).lower().split()
    for name in fit.value:
        assert f"({name})" in text or (name.count(",") and kind == "cross")
    for said in (one.text for one in fit.findings):
        assert said.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;").replace("'", "&#39;") in text
    for limits in re.findall(r'data-limits="([^"]*)"', text):
        json.loads(limits.replace("&#34;", '"'))


def test_sentences_say_what_the_intervals_say(fits):
    fit = fits["plain"]
    said = finding_sentences(fit)
    assert len(said) == len(fit.parameters)
    for sentence, (name, (low, high)) in zip(said, fit.confidence_interval(0.95).items(), strict=True):
        assert f"({name})" in sentence
        numbers = re.search(r"between ([\d.]+) and ([\d.]+) (k?)N", sentence)
        size = 1e3 if numbers[3] else 1.0
        np.testing.assert_allclose([float(numbers[1]), float(numbers[2])], [low / size, high / size], rtol=5e-3)
    assert said[0].startswith("Stiffness along y (k_y): ")
    assert said[1].startswith("Rotational stiffness about z (k_theta_z): ")
    crossed = finding_sentences(fits["cross"])
    assert len(crossed) == 5
    assert crossed[-1].endswith("(values in the table): 1 of 2: k_y,theta_z.")
    low, _ = fits["open"].confidence_interval(0.95)["k_y"]
    best = fits["open"].value["k_y"]
    assert low < best < np.inf
    assert finding_sentences(fits["open"])[0] == (
        f"Stiffness along y (k_y): cannot be distinguished from rigid; at least {low / 1e6:.4g} MN/m (95 %), best "
        f"estimate {float(f'{best / 1e6:.2g}'):g} MN/m."
    )
    assert "explains the FRFs to within their noise" in quality_sentences(fit)[0]
    assert "does not explain all" in quality_sentences(replace(fit, residual_level=0.03))[0]


def test_a_rigid_dof_is_drawn_by_its_bound(fits):
    stiffness, loss, *_ = fit_figures(fits["open"])[0].panels
    low, _ = fits["open"].confidence_interval(0.95)["k_y"]
    assert [curve.label for curve in stiffness.curves] == ["each line", "lower bound of k, 95 %"]
    assert stiffness.curves[1].y.tolist() == [low, low]
    assert [curve.label for curve in loss.curves] == ["each line"]


def test_loss_factors_stand_below_the_parameters_where_there_are_any(fits, beams):
    assert "loss factors" not in parameter_table(fits["plain"]).note
    h = jf.pollute(beams.gamma(jf.Joint([6e5, 5e3], [20, 0], structural_damping=[0, 400])), 0.01, seed=3)
    fit = jf.identify(beams.freq, h, ["y", "theta_z"], damping=["viscous", "hysteretic"])
    row = parameter_table(fit).rows[-1]
    eta = fit.loss_factors["eta_theta_z"]
    assert row == ("eta_theta_z", eta.value, eta.std_error, eta.low, eta.high, "1")
    assert eta.low < 0.08 < eta.high
    assert any(text.startswith("Loss factor of theta_z (eta_theta_z): 0.08") for text in finding_sentences(fit))


def test_a_cell_of_a_map_without_a_number_is_empty():
    values = np.array([[np.nan, 1.0], [0.5, 12.345]])
    heat = HeatMap("map", "A map", "row \\ column", ["a", "b"], ["c", "d"], values, 1, 3)
    page = make_document(Document("Page", "", [Section("one", "One", [heat])]))
    cells = re.findall(r"<td[^>]*>([^<]*)</td>", page)
    assert cells == ["", "1.00", "0.50", "12.3"]


def test_a_map_of_residuals_shades_by_their_logarithm_up_to_the_largest():
    values = np.array([[0.5, 1.0, 6.0, 88.0, np.nan]])
    shades = {}
    for largest in (88.0, 4.0):
        own = np.minimum(values, largest)
        heat = HeatMap("map", "A map", "r", ["a"], list("abcde"), own, 1, 10, log=True)
        page = make_document(Document("Page", "", [Section("one", "One", [heat])]))
        shades[largest] = [int(s) for s in re.findall(r'style="--s:(\d+)"', page)]
    assert shades[88.0] == [0, 0, round(100 * np.log(6) / np.log(88)), 100, 0]
    assert shades[4.0] == [0, 0, 60, 60, 0]


def test_findings_are_a_line_a_kind_the_worst_first_and_nothing_is_lost():
    lines = [f"{hz} Hz and its multiples, by the mains" for hz in range(40)]
    found = [
        jf.Finding("noisy-lines", {"lines": lines}),
        jf.Finding("poorly-determined", {"parameter": "k_y", "low": 1.0, "high": 3.0, "unit": "N/m"}),
        jf.Finding("compliance-scatter", {"varying": "y"}),
        jf.Finding("equal-points", about=("a", "b")),
        jf.Finding("equal-points", about=("c", "d")),
    ]
    warned, noted = words_of_findings(found)
    assert [line.rpartition(" ")[2] for line in warned.sentences] == ["[compliance-scatter]", "[poorly-determined]"]
    assert [len(own) for own in noted.folded] == [1, 2]
    assert all(len(line) < 120 for line in (*noted.sentences, *warned.sentences))
    page = make_document(Document("Page", "", [Section("one", "One", [warned, noted])]))
    assert page.count("<summary>") == 4
    for one in found:
        assert one.text in page


def _two_directions(freq, seed):
    """FRFs of two masses joined by springs in x and in y, which do not couple, with noise of a constant level."""
    omega = 2 * np.pi * freq
    h = np.zeros((freq.size, 4, 4), complex)
    for d, (k, mass) in enumerate(((1e5, 1.0), (3e5, 2.0))):
        z = np.zeros((freq.size, 2, 2), complex)
        for side, ground in enumerate((2e4, 5e4)):
            z[:, side, side] = k + 5j * omega + ground * (1 + 0.05j) - mass * omega**2
        z[:, 0, 1] = z[:, 1, 0] = -k - 5j * omega
        h[:, d::2, d::2] = np.linalg.inv(z)
    noise = np.random.default_rng(seed).standard_normal((2, *h.shape))
    return h + 1e-8 * (noise[0] + 1j * noise[1]) / np.sqrt(2)


def test_frfs_that_are_zero_by_symmetry_are_not_drawn():
    freq = np.arange(5.0, 300.0)
    variance = np.full((freq.size, 4, 4), 1e-16)
    fit = jf.identify(freq, _two_directions(freq, 3), ["x", "y"], noise=variance)
    compared = compare_fit(fit)
    assert compared.silent == 8
    assert sorted(compared.entries) == [(p, q) for p in range(4) for q in range(4) if (p - q) % 2 == 0]
    text = make_document(fit_document(fit, ReportOptions()))
    assert "All 8 FRFs between the channels that hold more than noise" in text
    assert "8 hold noise only" in text


def test_a_page_begins_with_what_was_found_and_the_frf_that_fits_worst(fits):
    fit = fits["plain"]
    compared = compare_fit(fit)
    parts = fit_document(fit, ReportOptions()).sections[0].parts
    kinds = [type(part).__name__ for part in parts]
    assert kinds[:2] == ["Words", "Chart"]
    assert set(kinds[2 : kinds.index("Table")]) == {"Words"}
    chart = parts[1]
    worst = max(compared.entries, key=lambda entry: compared.residual[entry])
    assert chart.figure.caption.startswith(f"Response {compared.rows[worst[0]]}, force {compared.columns[worst[1]]}: ")
    keys = re.findall(r'<figure class="chart" id="([^"]*)"', make_document(fit_document(fit, ReportOptions())))
    assert sorted(key for key in keys if key.startswith("frf")) == sorted(f"frf-{i + 1}" for i in range(16))


def _label_boxes(svg):
    boxes = []
    for x, y, anchor, text in re.findall(r'<text x="([\d.-]+)" y="([\d.-]+)" text-anchor="(\w+)">([^<]*)<', svg):
        width = 0.55 * 17 * len(text)
        left = float(x) - {"start": 0, "middle": 0.5, "end": 1}[anchor] * width
        boxes.append((left, float(y) - 12, left + width, float(y)))
    return boxes


@pytest.mark.parametrize("count", [3, 12, 40])
def test_names_in_a_sketch_overprint_neither_each_other_nor_points(count):
    rng = np.random.default_rng(count)
    at = rng.uniform(-0.1, 0.1, (2, count, 3))
    sides = jf.virtual_interface(*(
        jf.virtual_point(np.repeat(own, 3, axis=0), np.tile(np.eye(3), (count, 1)), [0, 0, 0], DIRECTIONS) for own in at
    ))  # fmt: skip
    points = interface_points(sides)
    sketch = interface_sketch(sides, points, sides.dofs)
    boxes = _label_boxes(sketch.svg)
    left_out = re.search(r"(\d+) names? without room", sketch.caption)
    assert len(boxes) + int(left_out[1] if left_out else 0) == 2 * count
    assert len(boxes) > min(count, 12)
    circles = [(x - 4, y - 4, x + 4, y + 4) for x, y in
               np.array(re.findall(r'cx="([\d.-]+)" cy="([\d.-]+)"', sketch.svg), float)]  # fmt: skip
    for i, a in enumerate(boxes):
        for b in (*boxes[i + 1 :], *circles):
            assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1], (a, b)
    named = interface_sketch(sides, [points[0]._replace(name="<tip>"), *points[1:]], sides.dofs)
    assert "&lt;tip&gt;" in named.svg
    assert "<tip>" not in named.svg


def test_the_table_of_points_has_no_coordinate_that_nobody_measured():
    sides = jf.interface([1, 2], [3, 4], ["y", "theta_z"], {1: (-0.1, 0.02, 0), 2: (-0.2, 0.02, 0), 3: (0.1, 0, 0),
                                                           4: (0.2, 0, 0)})  # fmt: skip
    table = point_table(interface_points(sides))
    assert [row[3] for row in table.rows] == [None] * 4
    assert [row[2] for row in table.rows] == pytest.approx([-100, -200, 100, 200])
    assert "-0" not in [cell for row in written(table) for cell in row]
    assert "nor do the directions of the channels" in table.note


def test_lines_left_out_are_drawn_apart(fits):
    fit = fits["plain"]
    fitted = fit.data.fitted.copy()
    fitted[20:30, 0] = False
    panel = fit_figures(replace(fit, data=replace(fit.data, fitted=fitted)))[0].panels[0]
    used, _, out = panel.curves
    np.testing.assert_array_equal(out.x, fit.freq_hz[20:30])
    np.testing.assert_array_equal(out.y, fit.k_lines[20:30, 0, 0].real)
    assert used.x.size == fit.freq_hz.size - 10


def test_maps_show_the_channel_that_is_wrong(beams):
    places = {i + 1: (0.03 * (i % 5), 0.0, 0.0) for i in range(10)}
    sides = jf.interface(range(1, 6), range(6, 11), ["y", "theta_z"], places)
    h = jf.pollute(sides.modes @ beams.gamma(beams.joint) @ sides.modes.T, 0.01, seed=4)
    gain = np.ones(10)
    gain[1] = 1.05
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        good, of_both, of_responses = (
            compare_fit(jf.identify(beams.freq, own, transform=sides))
            for own in (h, gain[:, None] * h * gain, (0.6 + 0.4 * gain)[:, None] * h)
        )
    apart = ~np.eye(10, dtype=bool)
    assert good.of_channels
    assert good.residual.max() < 1.3
    assert np.median(good.residual) == pytest.approx(0.8, abs=0.3)
    np.testing.assert_allclose(good.reciprocity[apart], 1, atol=0.2)
    # The gain of a point, struck and measured, is not seen by reciprocity; the rigid motion of its side is.
    assert np.argmax(of_both.residual) == 11
    assert of_both.residual[1, 1] > 3
    assert of_both.residual[5:, 5:].max() < 1.3
    np.testing.assert_allclose(of_both.reciprocity[apart], 1, atol=0.2)
    # That of its sensor alone is.
    by_row = np.nanmean(of_responses.reciprocity, axis=1)
    assert np.argmax(by_row) == 1
    assert by_row[1] > 1.1 * np.delete(by_row, 1).max()


def test_reciprocity_says_nothing_of_frfs_made_reciprocal(beams):
    gamma = jf.pollute(beams.gamma(beams.joint), 0.01, seed=5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = jf.identify(beams.freq, (gamma + gamma.swapaxes(1, 2)) / 2, ["y", "theta_z"])
    assert compare_fit(fit).reciprocity is None


def long_fit(n_freq: int, n: int) -> Fit:
    """A fit of n DOFs on many lines whose FRFs need no computing."""
    rng = np.random.default_rng(0)
    freq = np.linspace(1, 2000, n_freq)
    h = np.empty((n_freq, 2 * n, 2 * n), complex)
    for a in range(2 * n):
        for b in range(2 * n):
            h[:, a, b] = 1e-6 / (1 - (freq / (100 + 50 * (a + b))) ** 2 + 0.01j)
    h += 1e-8 * rng.standard_normal(h.shape)
    dofs = DIRECTIONS[:n]
    names = tuple(f"{side}:{dof}" for side in "jk" for dof in dofs)
    parameters = {one.name: 1e4 for one in joint_parameters(dofs)}
    k = np.eye(n) * 1e4 * (1 + 0.1 * rng.standard_normal((n_freq, 1, 1))) + 0j
    data = FitData(
        h, names, names, np.eye(2 * n), np.eye(2 * n), (np.eye(2 * n), np.eye(2 * n)), None, True, 1e-4 * abs(h) ** 2,
        1.0, None, None, np.ones((n_freq, n), bool), lambda own: 0.99 * h[own], lambda: np.full((n_freq, n), 1e-4 + 0j),
        lambda: np.full((n_freq, 2 * n), 1 / n_freq), dict,
    )  # fmt: skip
    bands = (((1.0, 2000.0),),) * n
    return Fit.of_springs(
        "compliance", dofs, parameters, np.eye(2 * n), 0.01, 0.01, freq, k_lines=k, bands=bands, data=data
    )


@pytest.mark.parametrize(("n_freq", "n"), [(100_000, 1), (3000, 6)])
def test_the_page_of_large_data_is_small_and_says_what_it_leaves_out(n_freq, n, tmp_path):
    fit = long_fit(n_freq, n)
    path = jf.write_report(fit, tmp_path / "report.html")
    assert path.stat().st_size < 1.5e6
    text = path.read_text(encoding="utf-8")
    assert ("24 of 144 FRFs between the channels" in text) == (n == 6)
    (most,) = re.findall(r"Curves of more than (\d+) lines", text)
    # The resonance of the first FRF is on the page as high as it was measured.
    (path_of_first,) = re.findall(r'id="frf-1".*?class="s-wide" data-label="measured" d="([^"]*)"', text, re.DOTALL)
    points = points_of(path_of_first)
    assert 100 < len(points) <= int(most)
    limits = json.loads(re.findall(r'id="frf-1".*?data-limits="([^"]*)"', text, re.DOTALL)[0].replace("&#34;", '"'))
    low, high = limits["y"]
    highest = 10 ** (low + (1 - points[:, 1].min() / 8000) * (high - low))
    assert highest == pytest.approx(abs(fit.data.measured[:, 0, 0]).max(), rel=2e-3)


def test_a_loaded_fit_says_what_a_report_needs(fits, tmp_path):
    loaded = jf.fit_from_dict(jf.fit_to_dict(fits["plain"]))
    with pytest.raises(ValueError, match="call identify with the FRFs"):
        jf.write_report(loaded, tmp_path / "report.html")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(FileNotFoundError):
        jf.write_report(fits["plain"], tmp_path / "missing" / "report.html")


def test_the_same_fit_gives_the_same_page(fits, tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "86400")
    pages = [jf.write_report(fits["plain"], tmp_path / name).read_bytes() for name in ("a.html", "b.html")]
    assert pages[0] == pages[1]
    assert b"1970-01-02" in pages[0]


def test_cards_stand_between_the_nodes_named(fits):
    parts = {part.name: part.text for section in fit_document(fits["plain"], ReportOptions(nodes=(7, 9))).sections
             if section.key == "cards" for part in section.parts if hasattr(part, "text")}  # fmt: skip
    assert list(parts) == ["Abaqus", "CalculiX (stiffness only)", "Nastran", "Ansys", "Code_Aster", "LS-DYNA"]
    assert parts["Abaqus"] == jf.cards(fits["plain"], "abaqus", (7, 9))
    # DOFs without a direction have no cards, which is said.
    document = fit_document(fits["numbers"], ReportOptions())
    (cards,) = (section for section in document.sections if section.key == "cards")
    assert any("dofs must be among" in said for said in cards.parts[-1].sentences)


def test_a_fit_is_drawn_with_its_frfs_and_without(fits):
    pytest.importorskip("matplotlib")
    canvas = jf.plot(fits["plain"])
    labels = {text.get_text() for text in canvas.legends[0].get_texts()}
    assert {"measured", "regenerated with the joint found", "each line"} <= labels
    loaded = jf.plot(jf.fit_from_dict(jf.fit_to_dict(fits["plain"])))
    assert "measured" not in {text.get_text() for text in loaded.legends[0].get_texts()}
    assert len(canvas.axes) == len(loaded.axes) + 8


def test_styles_differ_in_grey():
    """Curves that share a panel of a report: by lightness, dashes, or width."""
    for names in (("wide", "fitted", "difference"), ("dots", "actual", "outlying"), ("ismm", "high", "stiffness")):
        looks = []
        for name in names:
            style = STYLES[name]
            red, green, blue = (int(style.colour[i : i + 2], 16) for i in (1, 3, 5))
            looks.append((0.2126 * red + 0.7152 * green + 0.0722 * blue, str(style.dashes), style.width, style.marker))
        for i, one in enumerate(looks):
            for other in looks[:i]:
                assert (
                    abs(one[0] - other[0]) > 25 or one[1] != other[1] or one[3] != other[3] or one[2] > 1.5 * other[2]
                )


def test_a_rotation_has_its_axis_and_a_point_without_coordinates_has_none():
    sides = node_dofs(1, 2, ["y", "theta_z"], {})
    for one in interface_points(sides):
        assert one.known == (False, False, False)
    table = point_table(interface_points(sides))
    assert [row[2:] for row in table.rows] == [(None, None, None, "+y, +rz")] * 2
    placed = point_table(interface_points(node_dofs(1, 2, ["y", "theta_z"], {1: (0, 0, 0.1), 2: (0, 0, 0.1)})))
    assert [row[2:] for row in placed.rows] == [(0.0, None, 100.0, "+y, +rz")] * 2
