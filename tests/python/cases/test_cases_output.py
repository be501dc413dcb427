"""Figures, reports, tables in print, and the command line."""

import csv
import io
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from PIL import Image, ImageColor

import jointfrf as jf
from command import Finished, run_command
from jointfrf.dofs import Parameter
from jointfrf.workbench.cases.catalogue import find_case, list_cases
from jointfrf.workbench.cases.known_joint.figures import build_figures
from jointfrf.workbench.cases.run import CaseOutput, numbered, run_case
from jointfrf.workbench.cli.main import main
from jointfrf.workbench.report.axes import symbol
from jointfrf.workbench.report.draw import STYLES, draw
from jointfrf.workbench.report.figure import Curve, Figure, Interval, Panel, figure_csv
from jointfrf.workbench.report.table import Table, as_text, number
from thinned_cases import DrawSome

COMMAND = [sys.executable, "-m", "jointfrf"]
#: A figure of each form: curves of several methods, mode shapes, ribbons, intervals.
DRAWN = frozenset(["methods-k_Fy", "modes", "identified-c_x", "noise"])


class Ran(NamedTuple):
    """What a command gave, and the cases that it ran to their ends, by name."""

    folder: Path
    done: Finished
    outputs: dict[str, CaseOutput]


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """One command, two processes: one parameter a kind, several methods on beams, a case that fails, one behind it."""
    folder = tmp_path_factory.mktemp("results")
    cases = tmp_path_factory.mktemp("cases")
    chain, beams, wrong, behind = (cases / name for name in ("3.1-discrete", "beams", "wrong", "behind"))
    beams.mkdir()
    wrong.mkdir()
    for own in (chain, behind):
        shutil.copytree(find_case("3.1"), own)
        text = (own / "case.toml").read_text()
        (own / "case.toml").write_text(text.replace("step = 0.01", "step = 0.1"))
    (wrong / "case.toml").write_text("title = 1\n")
    for name in ("case.toml", "expected.toml", "README.md"):
        text = (find_case("3.3.1") / name).read_text()
        text = text.replace("elements = 300", "elements = 30").replace("elements = 225", "elements = 20")
        text = (
            text.replace("301:", "31:")
            .replace("151:", "16:")
            .replace("226:", "21:")
            .replace("step = 1.0", "step = 5.0")
        )
        (beams / name).write_text(text)
    outputs = {}

    def kept(case, *arguments, **options):
        outputs[case.name] = run_case(case, *arguments, **options)
        return outputs[case.name]

    words = (chain, beams, wrong, behind, "--realisations", "4", "--jobs", "2", "--png", "--out", folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("jointfrf.workbench.cli.run.run_case", kept)
        patch.setattr("jointfrf.workbench.cases.run.draw", DrawSome(DRAWN))
        done = run_command("run", *words)
    return Ran(folder, done, outputs)


@pytest.fixture
def outputs(ran):
    return {"chain": ran.outputs["3.1-discrete"], "beams": ran.outputs["beams"]}


FIGURES = {
    "chain": ["3-2", "3-3", "3-4", "3-5", "3-6", "3-7"],
    "beams": ["3-30", "3-31", "3-32", "3-33", "3-34"],
}


def check_picture(figure, png):
    with Image.open(io.BytesIO(png)) as image:
        assert image.format == "PNG"
        assert image.width == 910
        # More than an empty frame: many shades, and mostly paper.
        shades, colours = np.asarray(image.convert("L")), np.asarray(image.convert("RGB"), int)
    assert 0.5 < (shades > 200).mean() < 0.999
    assert len(np.unique(shades)) > 30
    for style in {curve.style for panel in figure.panels for curve in panel.curves}:
        assert (abs(colours - ImageColor.getrgb(STYLES[style].colour)).max(axis=2) < 48).any(), style


@pytest.mark.long
@pytest.mark.parametrize("which", FIGURES)
def test_every_figure_is_drawn(outputs, which):
    for figure in outputs[which].figures:
        check_picture(figure, draw(figure).png)


@pytest.mark.parametrize("which", FIGURES)
def test_figures_of_the_source_are_drawn(outputs, which):
    figures = {figure.number: figure for figure in outputs[which].figures}
    assert set(FIGURES[which]) == set(figures) - {""}
    folder = outputs[which].report.parent / "figures"
    assert len(DRAWN & {figure.key for figure in figures.values()}) >= 1
    for figure in figures.values():
        if figure.key in DRAWN:
            check_picture(figure, (folder / f"{figure.key}.png").read_bytes())
        rows = list(csv.DictReader(io.StringIO((folder / f"{figure.key}.csv").read_text())))
        points = sum(curve.x.size for panel in figure.panels for curve in panel.curves)
        assert len(rows) >= points
        assert len(rows) > 10


def test_case_3_3_has_all_figures_of_the_source(thinned):
    result = thinned("3.3-beams-1mm")
    numbers = {figure.number for figure in numbered(result.case, build_figures(result))} - {""}
    assert numbers == {f"3-{i}" for i in range(16, 28)}


def test_report_holds_every_table_and_figure_and_no_link(outputs):
    for output in outputs.values():
        text = output.report.read_text(encoding="utf-8")
        for table in output.tables:
            assert f'id="{table.key}"' in text
            body = text.split(f'id="{table.key}"')[1].split("</table>")[0]
            assert body.count("<tr") == len(table.rows) + 1
            assert body.count('class="failing"') == len(table.failing)
        figures = output.figures
        assert text.count('src="data:image/svg+xml,') == len(figures)
        assert not re.search(r'(?:src|href)="(?!data:|#)', text)
        assert re.search(r"realisations = \d+\nseed = \d+", text)  # the case itself
        assert all(number in text for number in (f.number for f in figures))


def test_report_escapes_what_a_user_writes(tmp_path, without_pictures):
    own = tmp_path / "own"
    own.mkdir()
    text = (find_case("3.1") / "case.toml").read_text().replace("step = 0.01", "step = 0.1")
    (own / "case.toml").write_text(text.replace("Two masses and", "<script>alert(1)</script> &"))
    report = run_case(own, tmp_path, realisations=2).report.read_text(encoding="utf-8")
    assert "<script>" not in report
    assert "&lt;script&gt;" in report


def test_a_figure_is_reproducible_and_leaves_no_global_state():
    import matplotlib

    before = dict(matplotlib.rcParams)
    x = np.arange(1.0, 5.0)
    figure = Figure("f", "caption", (Panel("t", "x", "y", (Curve("a", x, x**2, "actual"),), log_y=True),))
    assert draw(figure) == draw(figure)
    assert dict(matplotlib.rcParams) == before


def test_data_of_a_figure():
    x = np.array([1.0, 2.0])
    curve, interval = Curve("a, b", x, 2 * x, "actual"), Interval("one\ntwo", 1.0, 2.0, 3.0, 2.5)
    figure = Figure("f", "", (Panel("p", "x", "y", (curve,)), Panel("q", "x", "", intervals=(interval,))))
    rows = list(csv.reader(io.StringIO(figure_csv(figure))))
    assert rows[1:3] == [["p", "a, b", "1.0", "2.0", ""], ["p", "a, b", "2.0", "4.0", ""]]
    assert ["q", "one, two: 2.5 to 97.5 %", "", "1.0", "3.0"] in rows
    assert ["q", "one, two: thesis", "", "2.5", ""] in rows


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2010.9, "2010.9"), (2000.0, "2000"), (6.069e5, "606900"), (6.23e6, "6.23e6"), (0.0, "0"), (-0.25, "-0.25"),
        (4.9491e-4, "4.9491e-4"), (float("nan"), "nan"), (None, ""), ("word", "word"), (123456.0, "123456"),
    ],
)  # fmt: skip
def test_numbers_for_a_reader(value, text):
    assert number(value) == text


def test_text_table_is_aligned():
    table = Table("k", "Title", ("name", "value"), (("a", 1.5), ("longer", 20.0)))
    assert as_text(table).splitlines() == ["Title", "name    value", "------  -----", "a         1.5", "longer     20"]


def test_symbols_of_parameters():
    assert symbol(Parameter.parse("k_Mtheta")) == r"$k_{M\theta}$"
    assert symbol(Parameter.parse("c_x")) == "$c_{x}$"


def call(*words, cwd=None):
    return subprocess.run([*COMMAND, *words], capture_output=True, text=True, cwd=cwd)


def test_processes_give_what_one_gives(ran, tmp_path, without_pictures):
    alone = run_case(ran.outputs["3.1-discrete"].case.folder, tmp_path, realisations=4).report.parent
    table = "tables/identified.csv"
    assert (ran.folder / "3.1-discrete" / table).read_text() == (alone / table).read_text()


def test_cases_of_one_command_are_told_in_their_order(ran):
    """They are under way at the same time; one that fails does so where its turn comes."""
    done = ran.done
    assert done.returncode == 1
    assert re.fullmatch(r"jointfrf: error: \S*case.toml: the keys 'frequency' .* are missing\n", done.stderr)
    assert "2010.9" in done.stdout
    assert "Natural frequencies of the assembly" in done.stdout
    said = [
        line
        for line in done.stdout.splitlines()
        if line.startswith(("3.1", "beams", "What fits")) or "report: " in line
    ]
    reports = [ran.folder / name / "report.html" for name in ("3.1-discrete", "beams")]
    assert [line.split(": ")[-1] for line in (said[2], said[5])] == [str(report) for report in reports]
    assert [line.split(":")[0] for line in said[::3]] == ["3.1-discrete", "beams"]
    assert len(said) == 6
    assert all(report.is_file() for report in reports)


def test_tables_are_told_before_figures_are_drawn(tmp_path, monkeypatch):
    shown = []

    def stopped(figure, png):
        raise RuntimeError(f"{len(shown)} shown")

    monkeypatch.setattr("jointfrf.workbench.cases.run.draw", stopped)
    with pytest.raises(RuntimeError, match="1 shown"):
        run_case(find_case("3.1"), tmp_path, realisations=2, show=lambda case, tables: shown.append(tables))
    assert shown[0][0].title == "What fits"
    assert "Natural frequencies of the assembly" in [table.title for table in shown[0]]


def test_command_lists_cases(capsys):
    assert main(["cases"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [folder.name for folder in list_cases()]
    assert all(len(line.split()) > 3 for line in lines)


@pytest.mark.parametrize("words", [[], ["walk"]])
def test_a_command_that_is_missing_or_unknown(words):
    assert main(words) == 2


@pytest.mark.parametrize("words", [["--realisations", "0"], ["--realisations", "x"], ["--jobs", "-1"]])
def test_wrong_words_of_a_command(words):
    with pytest.raises(SystemExit) as stop:
        main(["run", *words])
    assert stop.value.code == 2


def test_version(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    assert capsys.readouterr().out == f"jointfrf {jf.__version__}\n"


def test_unknown_case_is_one_sentence_and_status_2(capsys):
    assert main(["run", "9.9"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("jointfrf: error: unknown case '9.9'; name a folder with a case.toml, or one of the")
    assert error.count("\n") == 1


def test_wrong_case_file_is_one_sentence_and_status_1(tmp_path, capsys):
    (tmp_path / "case.toml").write_text("title = 1\n")
    assert main(["run", str(tmp_path), "--jobs", "1"]) == 1
    error = capsys.readouterr().err
    assert error.startswith(
        f"jointfrf: error: {tmp_path / 'case.toml'}: the keys 'frequency' (a table [frequency]), 'study' "
    )
    assert error.endswith("'noise' (a table [[noise]] with name, level, methods) are missing\n")
    assert error.count("\n") == 1


def test_results_that_cannot_be_written_are_one_sentence(tmp_path, capsys):
    (tmp_path / "file").touch()
    out = tmp_path / "file" / "out"
    assert main(["run", "3.1", "--realisations", "2", "--jobs", "1", "--out", str(out)]) == 2
    # Before the work, and the file that is in the way.
    assert capsys.readouterr().err == f"jointfrf: error: --out: {out.parent} is a file; name a folder\n"


def test_two_cases_of_one_name_are_refused(tmp_path, capsys):
    own = tmp_path / "3.1-discrete"
    own.mkdir()
    (own / "case.toml").write_text((find_case("3.1") / "case.toml").read_text())
    assert main(["run", "3.1", str(own)]) == 2
    assert "run each with its own --out" in capsys.readouterr().err


def test_command_survives_a_closed_pipe():
    script = f"{sys.executable} -m jointfrf cases | head -c 1"
    done = subprocess.run(["sh", "-c", script], capture_output=True, text=True)
    assert done.stderr == ""
