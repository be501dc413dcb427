"""The page of an identification and that of a case as a browser shows them: wide, narrow, dark, zoomed, on paper."""

import re
import zlib
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import pairwise
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

import jointfrf as jf
from browser import started_browser
from jointfrf.workbench.report.document import Document, HeatMap, Picture, Section, make_document
from jointfrf.workbench.report.draw import draw
from jointfrf.workbench.report.figure import Curve, Figure, Panel
from jointfrf.workbench.report.table import Table

BARS = Path(__file__).resolve().parents[3] / "cases" / "hammer-test" / "two_bars.uff"


pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """A page of each kind."""
    pytest.importorskip("jinja2")
    folder = tmp_path_factory.mktemp("pages")
    frfs = jf.io.read_frfs(BARS).receptance()
    sides = jf.interface([101, 102], [201, 202], ["y", "theta_z"], frfs.coordinates)
    fit = jf.identify(frfs.freq_hz, frfs.matrix(sides.channels, sides.channels), transform=sides)
    jf.write_report(fit, folder / "fit.html", source=BARS.name, command="jointfrf identify")
    x = np.arange(1.0, 50.0)
    figure = Figure("f", "A figure", (Panel("", "x", "y", (Curve("a", x, x, "actual"),)),))
    rows = tuple((f"row {i}", *map(float, range(11))) for i in range(120))
    table = Table("long", "A long table", ("name", *(f"column {c}, N/m" for c in range(11))), rows)
    sections = [Section("summary", "Summary", [table]), Section("figures", "Figures", [Picture(figure, draw(figure))])]
    (folder / "case.html").write_text(make_document(Document("A case", "About.", sections)))
    names = [f"response {i}" for i in range(24)]
    heat = HeatMap("map", "A map", "response \\ force", names, names, np.linspace(0, 12, 576).reshape(24, 24), 1, 3)
    (folder / "map.html").write_text(make_document(Document("A map", "", [Section("s", "Map", [heat])])))
    return folder


@pytest.fixture(scope="module")
def browser():
    with started_browser() as started:
        yield started


class Opened:
    """A page in a browser of some width, with what it complained of."""

    def __init__(self, browser, path, width=1100, scheme="light"):
        context = browser.new_context(viewport={"width": width, "height": 800}, color_scheme=scheme)
        self.page = context.new_page()
        self.complaints: list[str] = []
        self.requests: list[str] = []
        self.page.on("console", lambda message: self.complaints.append(message.text))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.goto(path.as_uri())

    def luminance(self, what: str, part: str) -> float:
        """Luminance of a colour of the first element of a selector, as WCAG has it."""
        colour = self.page.eval_on_selector(what, f"element => getComputedStyle(element)[{part!r}]")
        rgb = np.array([float(x) for x in re.findall(r"[\d.]+", colour)[:3]]) / 255
        linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722])


@pytest.mark.parametrize("name", ["fit.html", "case.html", "map.html"])
@pytest.mark.parametrize("width", [1100, 400])
def test_a_page_fits_its_window_and_complains_of_nothing(browser, pages, name, width):
    opened = Opened(browser, pages / name, width)
    assert opened.complaints == []
    assert [url for url in opened.requests if not url.startswith(("file:", "data:"))] == []
    assert len([url for url in opened.requests if url.startswith("file:")]) == 1
    # Nothing but tables in frames of their own is wider than the window.
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("name", ["fit.html", "case.html"])
def test_a_dark_page_is_dark_and_legible(browser, pages, name):
    opened = Opened(browser, pages / name, scheme="dark")
    page, ink = opened.luminance("body", "backgroundColor"), opened.luminance("body", "color")
    assert page < 0.05
    assert (ink + 0.05) / (page + 0.05) > 7
    soft = opened.luminance(".about", "color")
    assert (soft + 0.05) / (page + 0.05) > 4.5
    if name == "fit.html":
        curves = opened.page.eval_on_selector_all(
            "svg.plot path[data-label]", "all => [...new Set(all.map(path => path.getAttribute('class')))]"
        )
        assert len(curves) > 4
        for curve in curves:
            assert (opened.luminance(f"svg.plot .{curve}", "stroke") + 0.05) / (page + 0.05) > 3, curve


def box_of(page, selector):
    return [float(x) for x in page.locator(selector).first.get_attribute("viewBox").split()]


def test_dragging_zooms_all_panels_of_a_figure_and_double_click_goes_back(browser, pages):
    opened = Opened(browser, pages / "fit.html")
    page, figure = opened.page, "#frf-1"
    plots = page.locator(f"{figure} svg.plot")
    assert plots.count() == 2
    ticks = page.locator(f"{figure} .x-ticks").last.inner_text()
    whole = box_of(page, f"{figure} svg.plot")
    plots.first.scroll_into_view_if_needed()
    place = plots.first.bounding_box()
    y = place["y"] + place["height"] / 2
    page.mouse.move(place["x"] + 0.25 * place["width"], y)
    page.mouse.down()
    page.mouse.move(place["x"] + 0.5 * place["width"], y + 3, steps=4)
    assert page.locator(f"{figure} .drag").first.is_visible()
    page.mouse.up()
    for i in range(2):
        left, _, width, _ = [float(x) for x in plots.nth(i).get_attribute("viewBox").split()]
        assert left == pytest.approx(whole[0] + 0.25 * whole[2], rel=0.02)
        assert width == pytest.approx(0.25 * whole[2], rel=0.02)
    shown = [float(word) for word in page.locator(f"{figure} .x-ticks").last.inner_text().split()]
    assert 265 - 15 < min(shown) < max(shown) < 510 + 15
    assert len(shown) >= 3
    # Nothing else moved.
    assert box_of(page, "#frf-2 svg.plot")[2] == whole[2]
    plots.first.dblclick()
    assert box_of(page, f"{figure} svg.plot") == whole
    assert page.locator(f"{figure} .x-ticks").last.inner_text() == ticks
    assert opened.complaints == []


def test_buttons_and_keys_zoom_and_the_readout_names_the_curves(browser, pages):
    opened = Opened(browser, pages / "fit.html")
    page = opened.page
    whole = box_of(page, "#frf-1 svg.plot")
    reset = page.locator("#frf-1 .reset")
    assert reset.is_disabled()
    page.locator("#frf-1 .in").click()
    assert box_of(page, "#frf-1 svg.plot")[2] == pytest.approx(whole[2] / 2)
    page.locator("#frf-1 svg.plot").first.press("ArrowRight")
    assert box_of(page, "#frf-1 svg.plot")[0] == pytest.approx(0.375 * whole[2])
    page.locator("#frf-1 svg.plot").first.press("0")
    assert box_of(page, "#frf-1 svg.plot") == whole
    assert reset.is_disabled()
    plot = page.locator("#frf-1 svg.plot").first
    plot.hover()
    said = page.locator("#frf-1 .readout").inner_text()
    # In the middle of the band, at 510 Hz.
    found = re.match(r"([\d.]+) Hz; measured ([\d.e-]+); regenerated .* ([\d.e-]+); modulus of .* m/N$", said)
    assert found, said
    assert float(found[1]) == pytest.approx(510, abs=3)
    frfs = jf.io.read_frfs(BARS).receptance()
    h = abs(frfs.matrix(["101:y"], ["101:y"])[:, 0, 0])
    assert float(found[2]) == pytest.approx(h[np.argmin(abs(frfs.freq_hz - 510))], rel=0.1)
    assert opened.complaints == []


def test_without_a_script_the_page_shows_the_same(browser, pages):
    context = browser.new_context(java_script_enabled=False, viewport={"width": 1100, "height": 800})
    page = context.new_page()
    page.goto((pages / "fit.html").as_uri())
    for selector in ("#joint_y svg.plot path.s-dots", "#frf-1 .x-ticks span", "#residual-map td", "#sketch svg"):
        assert page.locator(selector).first.is_visible(), selector
    assert not page.locator(".tools").first.is_visible()
    # The script writes the same numbers along the axes as the page without it.
    texts = """all => all.map(ticks => [...ticks.children].map(mark => mark.textContent).join(' '))"""
    scripted = Opened(browser, pages / "fit.html").page
    for axis in (".x-ticks", ".y-ticks"):
        found = page.eval_on_selector_all(axis, texts)
        assert len(found) > 20
        assert scripted.eval_on_selector_all(axis, texts) == found


def test_headings_alternatives_and_names_are_there(browser, pages):
    page = Opened(browser, pages / "fit.html").page
    levels = page.eval_on_selector_all("h1, h2, h3", "all => all.map(h => +h.tagName[1])")
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))
    unnamed = """all => all.filter(e => !(e.getAttribute('aria-label') || e.textContent).trim()).length"""
    assert page.eval_on_selector_all("[role=img], [role=group], [role=region], button, summary, th", unnamed) == 0
    assert page.eval_on_selector_all("th", "all => all.filter(th => !th.getAttribute('scope')).length") == 0
    assert page.eval_on_selector_all("img", "all => all.filter(image => !image.alt).length") == 0
    ids = page.eval_on_selector_all("[id]", "all => all.map(e => e.id)")
    assert len(ids) == len(set(ids))
    for target in page.eval_on_selector_all("nav a", "all => all.map(a => a.getAttribute('href').slice(1))"):
        assert target in ids


#: What a stranger's text would do if it came into a page as markup: load, send, run, and lead links elsewhere.
_SMUGGLED = """<script>document.title = "owned"</script><script src="{0}/a.js"></script>
<img src="{0}/a.png" onerror="document.title = 'owned'"><link rel="stylesheet" href="{0}/a.css">
<iframe src="{0}/frame"></iframe><object data="{0}/object"></object><svg><image href="{0}/b.png"></image></svg>
<style>@import "{0}/b.css"; body {{background: url({0}/c.png)}} @font-face {{font-family: f; src: url({0}/f.woff)}}
p {{font-family: f}}</style><video src="{0}/a.mp4"></video><base href="{0}/"><p>text</p>"""


class _Listener(BaseHTTPRequestHandler):
    """Notes what is asked for; answers that there is none."""

    def do_GET(self):
        self.server.asked.append(self.path)
        self.send_error(404)

    def log_message(self, *_):
        pass


@pytest.fixture
def listener():
    """A server of this machine."""
    with ThreadingHTTPServer(("127.0.0.1", 0), _Listener) as server:
        server.asked = []
        thread = Thread(target=server.serve_forever)
        thread.start()
        yield server
        server.shutdown()
        thread.join()


@pytest.mark.parametrize("has_policy", [True, False])
def test_what_is_smuggled_into_a_page_loads_and_runs_nothing(browser, pages, listener, has_policy):
    """All texts are escaped; if one were not, the policy of the page still let nothing in or out."""
    address = f"http://127.0.0.1:{listener.server_port}"
    text = (pages / "fit.html").read_text(encoding="utf-8").replace("</h1>", f"</h1>{_SMUGGLED.format(address)}")
    if not has_policy:  # the same page shows that these ways lead out
        text = re.sub('<meta http-equiv="Content-Security-Policy"[^>]*>', "", text)
    (pages / "smuggled.html").write_text(text, encoding="utf-8")
    opened = Opened(browser, pages / "smuggled.html")
    opened.page.evaluate(f"fetch('{address}/fetched', {{mode: 'no-cors'}}).catch(() => null)")
    opened.page.wait_for_load_state("networkidle")
    assert (opened.page.title() == "owned") is not has_policy
    assert opened.page.evaluate("document.baseURI").startswith("file:" if has_policy else address)
    assert opened.page.locator("#frf-1 .tools").is_visible()  # the own script runs
    if has_policy:
        assert listener.asked == []
    else:
        assert {"/a.js", "/a.png", "/a.css", "/b.css", "/b.png", "/c.png", "/frame", "/fetched"} <= set(listener.asked)


def paths_outside(page):
    """Tables and figures that reach beyond the paper."""
    return page.evaluate(
        """() => [...document.querySelectorAll('table, figure, pre, svg, p')].filter(e => {
             const box = e.getBoundingClientRect();
             return box.width && (box.right > document.documentElement.clientWidth + 1 || box.left < -1);
           }).map(e => e.id || e.tagName + e.className)"""
    )


@pytest.mark.parametrize("name", ["fit.html", "case.html", "map.html"])
def test_paper_shows_all_of_every_table(browser, pages, name):
    # A4 between margins of 15 mm.
    opened = Opened(browser, pages / name, 680, scheme="dark")
    opened.page.emulate_media(media="print")
    assert paths_outside(opened.page) == []
    assert opened.luminance("body", "color") < 0.1  # black on white, also of a dark page
    if name == "fit.html":
        assert opened.page.locator("#cards ~ details.printed pre").first.bounding_box()["height"] > 50
    paper = opened.page.pdf(format="A4", margin=dict.fromkeys(("top", "bottom", "left", "right"), "15mm"))
    assert paper.startswith(b"%PDF")
    assert (name != "map.html") < len(re.findall(rb"/Type\s*/Page\b", paper + inflated(paper))) <= 20


def inflated(paper: bytes) -> bytes:
    """Return what streams of a PDF hold, where page objects may be packed."""
    found = b""
    for stream in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", paper, re.DOTALL):
        try:
            found += zlib.decompress(stream)
        except zlib.error:
            continue
    return found
