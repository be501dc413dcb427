"""The documentation site: its scripts run, its table of equations is true, all of it is built without a warning."""

import importlib.util
import re
import runpy
import subprocess
import sys

import pytest

import jointfrf as jf
from browser import started_browser
from documents import DOCUMENTS, ROOT

EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.py"))
#: A row of the table: numbers of equations, what, place, names in Python.
ROW = re.compile(r"^\| (\([2-4]\..*?) \| .*? \| `(.*?)` \| (.*?) \|$", re.MULTILINE)


@pytest.mark.long
@pytest.mark.parametrize("script", EXAMPLES, ids=lambda path: path.stem)
def test_a_script_of_the_gallery_runs(script, monkeypatch, capsys):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.chdir(script.parent)
    runpy.run_path(str(script))
    printed = capsys.readouterr().out
    assert "nan" not in printed
    if script.stem == "exchange":
        assert "True True True" in printed  # there and back
        found = re.findall(r"95 % (\S+) \.\. (\S+), true (\S+)", printed)
        assert len(found) == 6
        assert all(float(low) < float(true) < float(high) for low, high, true in found)


def _numbers(text):
    """(2.24)-(2.26), (2.28): every number meant, as chapter and place."""
    for first, last in re.findall(r"\((\d\.\d+)\)(?:-\((\d\.\d+)\))?", text):
        chapter, begin = map(int, first.split("."))
        end = int((last or first).split(".")[1])
        yield from ((chapter, number) for number in range(begin, end + 1))


def test_the_table_has_every_equation_once_at_a_place_that_exists():
    rows = ROW.findall(DOCUMENTS["docs/equations.md"])
    found = [number for numbers, _, _ in rows for number in _numbers(numbers)]
    assert sorted(found) == [(2, i) for i in range(1, 60)] + [(3, i) for i in range(1, 16)] + [
        (4, i) for i in range(1, 31)
    ]
    for _, place, names in rows:
        assert (ROOT / place).is_file(), place
        for name in re.findall(r"`(\w+)(?:\.\w+)?`", names):
            assert hasattr(jf, name), name


@pytest.mark.long
@pytest.mark.builds
@pytest.mark.skipif(
    importlib.util.find_spec("sphinx") is None, reason="Sphinx is not installed: docs/build installs it"
)
def test_the_site_is_built_without_a_warning(tmp_path):
    command = [sys.executable, "-m", "sphinx", "-b", "html", "-W", "--keep-going", "-q", "-c", "docs"]
    made = subprocess.run([*command, "-d", str(tmp_path / "trees"), ".", str(tmp_path / "site")], cwd=ROOT,
                          capture_output=True, text=True, check=False)  # fmt: skip
    assert made.returncode == 0, made.stderr
    pages = {path.relative_to(tmp_path / "site").as_posix() for path in (tmp_path / "site").rglob("*.html")}
    names = {f"docs/generated/api/jointfrf.{name}.html" for name in jf.__all__}
    assert names <= pages
    text = (tmp_path / "site" / "docs" / "index.html").read_text(encoding="utf-8")
    assert not re.search(r"(src|href)=\"https?://", text)  # it is read without a network
    # nor a server, and on a phone
    some = {"search.html", "docs/index.html", "docs/validation.html", "docs/generated/api/jointfrf.identify.html"}
    some |= {"docs/generated/examples/amplitude.html", "docs/quickstart.html", "docs/measured-file.html"}
    with started_browser() as browser:
        page = browser.new_context(viewport={"width": 390, "height": 800}).new_page()
        for path in sorted(some):
            page.goto((tmp_path / "site" / path).as_uri())
            assert page.evaluate("document.documentElement.scrollWidth") <= 390, path
        wide = browser.new_context(viewport={"width": 1280, "height": 800}).new_page()
        for path in ("docs/index.html", "docs/quickstart.html", "docs/measured-file.html"):
            wide.goto((tmp_path / "site" / path).as_uri())
            clipped = (
                "all => all.filter(block => block.scrollWidth > block.clientWidth).map(block => block.textContent)"
            )
            assert wide.eval_on_selector_all("pre", clipped) == []
        page.goto((tmp_path / "site" / "search.html").as_uri() + "?q=loss+factor")
        page.wait_for_function("document.querySelectorAll('#search-results li').length > 3")
