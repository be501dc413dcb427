"""A folder of a stranger: nothing is written outside the results, no program is started, all that is shown is seen."""

import csv
import html
import io
import os
import re
import subprocess
import sys
from base64 import b64encode
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from command import run_command
from jointfrf.io.card_link import CardFormat
from jointfrf.workbench.cases.catalogue import find_case
from jointfrf.workbench.cases.run import run_case
from jointfrf.workbench.report.chart import Chart
from jointfrf.workbench.report.document import Document, Section, Words, make_document
from jointfrf.workbench.report.draw import draw
from jointfrf.workbench.report.figure import Curve, Figure, Panel, figure_csv
from jointfrf.workbench.report.table import Table, table_csv
from thinned_cases import DrawSome

pytest.importorskip("matplotlib")
pytest.importorskip("jinja2")
#: Names of everybody's choice: a path, what a terminal acts upon, and a formula of a spreadsheet.
DOF, TITLE, NOISE = "x/../../../../../pwn", "a\x1b]0;owned\x07\u202e case <b>$x^{", "=cmd|calc"


def case_of_a_stranger(folder: Path) -> Path:
    folder.mkdir()
    text = (find_case("3.1") / "case.toml").read_text(encoding="utf-8")
    title = text.splitlines()[0]
    changes = {
        title: 'title = "a\\u001b]0;owned\\u0007\\u202e case <b>$x^{"',
        'dof = "x"': f'dof = "{DOF}"',
        "k_x =": f'"k_{DOF}" =',
        "c_x =": f'"c_{DOF}" =',
        'name = "5 %"': f'name = "{NOISE}"',
        "step = 0.01": "step = 0.1",
    }
    for old, new in changes.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return folder


def test_names_in_a_case_are_no_paths_no_orders_and_no_formulas(tmp_path, monkeypatch):
    """`../../pwn.png` landed outside `--out`."""
    deep = tmp_path / "a" / "b" / "c" / "d"
    deep.mkdir(parents=True)
    monkeypatch.chdir(deep)
    drawn = DrawSome(frozenset([f"identified-k_{DOF}", "noise"]))
    monkeypatch.setattr("jointfrf.workbench.cases.run.draw", drawn)
    case = case_of_a_stranger(tmp_path / "case")
    shown = run_command("run", case, "--out", "results", "--realisations", "2", "--jobs", "1")
    assert shown.returncode == 0, shown.stderr
    written = [path for path in tmp_path.rglob("*") if path.is_file()]
    results = deep / "results" / "case"
    outside = [path for path in written if results not in path.parents]
    assert outside == [case / "case.toml"]
    assert all(path.name.isascii() and path.name.isprintable() for path in written)
    assert any("pwn" in path.name for path in written)
    assert not {"\x1b", "\x07", "\u202e"} & set(shown.stdout + shown.stderr)
    assert r"a\x1b]0;owned\x07\u202e case <b>$x^{" in shown.stdout
    page = (results / "report.html").read_text(encoding="utf-8")
    assert not {"\x1b", "\x07", "\u202e"} & set(page)
    assert r"a\x1b]0;owned\x07\u202e case <b>$x^{" in html.unescape(page)
    assert "case <b>" not in page
    for path in results.rglob("*.csv"):
        for row in csv.reader(io.StringIO(path.read_text(encoding="utf-8"))):
            assert not any(cell[:1] in ("=", "@") for cell in row), path


def test_a_link_in_the_folder_of_results_is_not_followed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "home").mkdir()
    (tmp_path / "results" / "3.1-discrete").mkdir(parents=True)
    (tmp_path / "results" / "3.1-discrete" / "tables").symlink_to(tmp_path / "home")
    with pytest.raises(jf.FileContentError, match="tables is a link or no folder, not a folder"):
        run_case(find_case("3.1"), realisations=2)
    assert not list((tmp_path / "home").iterdir())


@pytest.mark.parametrize(("kind", "schema"), [("study", "case.schema.json"), ("assembly", "assembly.schema.json")])
def test_a_new_case_is_written_through_no_link(tmp_path, kind, schema):
    (tmp_path / "thesis.txt").write_text("of the user")
    (tmp_path / "new").mkdir()
    (tmp_path / "new" / schema).symlink_to(tmp_path / "thesis.txt")
    done = run_command("new", kind, tmp_path / "new")
    assert done.returncode == 1
    assert f"{schema} is a link, not a file; remove it" in done.stderr
    assert (tmp_path / "thesis.txt").read_text() == "of the user"
    assert [path.name for path in (tmp_path / "new").iterdir()] == [schema]


def test_the_folder_of_a_case_is_no_link_out_of_the_results(tmp_path):
    (tmp_path / "home").mkdir()
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "3.1-discrete").symlink_to(tmp_path / "home")
    with pytest.raises(jf.FileContentError, match=r"3\.1-discrete is a link or no folder"):
        run_case(find_case("3.1"), tmp_path / "results", realisations=2)
    assert not list((tmp_path / "home").iterdir())


def test_a_page_shows_no_text_of_another_folder(tmp_path, without_pictures):
    """A README.md that is a link put any file of its reader on the page, which is then sent around."""
    (tmp_path / "key").write_text("secret of the reader")
    case = tmp_path / "case"
    case.mkdir()
    text = (find_case("3.1") / "case.toml").read_text(encoding="utf-8")
    (case / "case.toml").write_text(text.replace("step = 0.01", "step = 0.1"), encoding="utf-8")
    (case / "README.md").symlink_to(tmp_path / "key")
    page = run_case(case, tmp_path / "results", realisations=2).report.read_text(encoding="utf-8")
    assert "secret of the reader" not in page
    assert "Two masses and two masses" in page


@pytest.mark.parametrize("has_chart", [True, False])
def test_the_policy_of_a_page_allows_its_own_script_only(has_chart):
    x = np.array([1.0, 2.0])
    chart = Chart(Figure("key", "caption", (Panel("", "x", "y", (Curve("curve", x, x, "actual"),)),)), "in words")
    page = make_document(Document("title", "", [Section("s", "S", [chart if has_chart else Words(["text"])])]))
    (policy,) = re.findall(r'<meta http-equiv="Content-Security-Policy" content="([^"]*)">', page)
    rules = dict(rule.split(" ", 1) for rule in html.unescape(policy).split("; "))
    assert page.index("Content-Security-Policy") < page.index("<title>") < page.index("<style>")
    scripts = re.findall(r"<script>(.*?)</script>", page, re.DOTALL)
    sums = [b64encode(sha256(script.encode()).digest()).decode() for script in scripts]
    assert len(sums) == has_chart
    assert rules.pop("script-src") == (f"'sha256-{sums[0]}'" if has_chart else "'none'")
    assert rules == {"default-src": "'none'", "style-src": "'unsafe-inline'", "img-src": "data:",
                     "base-uri": "'none'", "form-action": "'none'"}  # fmt: skip


FORMULAS = ("=1+1", "+1+a", "-1+a", "@SUM(A1)", "\t=1", " =1")


def test_no_text_of_a_csv_file_is_a_formula():
    table = Table("key", "title", ("=name", "value"), tuple((text, -1.5) for text in FORMULAS))
    rows = list(csv.reader(io.StringIO(table_csv(table))))
    assert rows[0] == ["'=name", "value"]
    assert [row[0][0] for row in rows[1:]] == ["'", "'", "'", "'", "\\", "'"]
    assert {row[1] for row in rows[1:]} == {"-1.5"}
    x = np.array([-1.0, 2.0])
    panel = Panel("=panel", "", "", (Curve("@curve", x, x, "actual"),))
    rows = list(csv.reader(io.StringIO(figure_csv(Figure("key", "caption", (panel,))))))[1:]
    assert {row[0] for row in rows} == {"'=panel"}
    assert {row[1] for row in rows} == {"'@curve"}
    assert [float(row[2]) for row in rows] == [-1.0, 2.0]


@pytest.mark.parametrize("text", ["$\\frac{1}$", "a $ b", "$x^{", "\x1b[2J", "$\\nonsense$ and $y$"])
def test_a_text_that_is_no_formula_is_drawn_as_it_stands(text):
    x = np.array([1.0, 2.0])
    drawn = draw(Figure("key", text, (Panel(text, text, text, (Curve(text, x, x, "actual"),)),), heading=text))
    assert b"\x1b" not in drawn.svg
    assert drawn.png


def test_formulas_of_our_own_are_drawn():
    x = np.array([1.0, 2.0])
    (one, other) = (
        draw(Figure("key", "", (Panel(text, "", "", (Curve("", x, x, "actual"),)),))).svg for text in ("$H_{ss}$", "H")
    )
    assert one != other
    assert b"$" not in one


@pytest.mark.parametrize("program", CardFormat.__args__)
def test_comments_of_cards_stay_comments(program):
    """A file of cards is also read by people, in a terminal."""
    joint = jf.Joint([1e6], None, ["y"])
    stranger = "from a\n*INCLUDE, INPUT=/etc/passwd\r\x85FINISH\u2028/SYS,sh\x1b]0;owned\x07.uff"
    text = joint.export(program, [1, 2], comments=[stranger])
    marks = {"abaqus": "**", "calculix": "**", "nastran": "$", "ansys": "!", "code_aster": "#", "lsdyna": "$",
             "subdyn": "!"}  # fmt: skip
    for line in text.splitlines():
        if "passwd" in line or "FINISH" in line or "owned" in line:
            assert line.startswith(marks[program])
    assert text.replace("\n", "").isprintable()


_DRAW = """
import numpy as np
from jointfrf.workbench.report.chart import Chart
from jointfrf.workbench.report.document import Document, Section, Words, make_document
from jointfrf.workbench.report.draw import draw
from jointfrf.workbench.report.figure import Curve, Figure, Panel
x = np.array([1.0, 2.0])
drawn = draw(Figure("key", "", (Panel("title", "x", "y", (Curve("curve", x, x, "actual"),)),)))
print(len(drawn.png))
"""


def test_a_matplotlibrc_of_the_working_directory_does_not_apply(tmp_path):
    """`text.usetex` started latex, with whatever stood beside the file."""
    tools = tmp_path / "tools"
    tools.mkdir()
    for name in ("latex", "dvipng", "dvips", "kpsewhich"):
        (tools / name).write_text(f"#!/bin/sh\ntouch {tmp_path}/ran\nexit 1\n")
        (tools / name).chmod(0o755)
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\nfont.size: 40\nsvg.fonttype: path\n")
    script = tmp_path / "draw.py"
    script.write_text(_DRAW)
    environment = os.environ | {"PATH": f"{tools}{os.pathsep}{os.environ['PATH']}"}
    sizes = []
    for folder in (tmp_path, tools):
        done = subprocess.run([sys.executable, script], cwd=folder, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        sizes.append(done.stdout)
    assert not (tmp_path / "ran").exists()
    assert sizes[0] == sizes[1]
