"""README and docs are true: their Python runs, their commands give the output shown, and links lead somewhere."""

import ast
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from tables import marked, tables_printed, written

import jointfrf as jf
from assembly_keys import assembly_page
from documents import DOCUMENTS, ROOT, Step, agree, blocks, commands_shown, follow, steps
from harmonic_balance import Sliders, iwan_beam
from jointfrf.toml.declared import read_keys
from jointfrf.toml.table import TomlTable
from jointfrf.workbench.assembly_file.keys import AssemblyKeys
from jointfrf.workbench.assembly_file.read import read_assembly_file
from jointfrf.workbench.cli.main import main


@pytest.mark.parametrize(
    ("printed", "shown", "agreed"),
    [
        ("k 1993.1 N/m", "k 1993.1 N/m", True),
        ("k 1993.1 N/m", "k 1993 N/m", True),  # rounded on the page
        ("k 1993.1 N/m", "k 1993.2 N/m", False),
        ("k 1993 N/m", "k 1993.1 N/m", False),  # a digit that nothing printed
        ("9.9955406E+06, (95 %)", "9.9955E+06, (95 %)", True),
        ("9.9956406E+06, (95 %)", "9.9955E+06, (95 %)", False),
        ("k 1993.1 N/m", "c 1993.1 N/m", False),
        ("a\nb c\n-----\nd", "a\n...\nd", True),
        ("a\nb c\nd", "a\n...", True),
        ("a\nb c\nd", "...\nb\nc d", True),
        ("a\nb c\nd", "...\nb\n...\ne", False),
        ("a b c", "a b", False),
        ("a b", "a b c", False),
    ],
)
def test_digits_are_compared_exactly(printed, shown, agreed):
    if agreed:
        agree(printed, shown)
    else:
        with pytest.raises(AssertionError):
            agree(printed, shown)


def test_steps_of_a_page_are_its_blocks_and_the_commands_in_its_tables():
    page = """
```sh fragment
rm everything
```
```text
$ one \\
    more
printed
$ two
```
- an item
  ```python
  f()
  ```
  ```text
  found
  ```

| a | `jointfrf check` | `jointfrf check cases/a.uff` | `jointfrf.toml` |
"""
    assert steps(page) == [
        ("sh", "one \\\n    more\n", "printed\n"),
        ("sh", "two\n", ""),
        ("python", "f()\n", "found\n"),
        ("sh", "jointfrf check cases/a.uff", None),
    ]
    with pytest.raises(AssertionError, match="belongs to no step"):
        steps("```python\n```\n```text\na\n```\n```text\nb\n```")


#: Pages that a newcomer follows: every block and every command in a table is a step, in the order of the page.
WALKED = ("README.md", "docs/index.md", "docs/quickstart.md", "docs/measured-file.md", "docs/checks.md")


@pytest.mark.parametrize("name", ["README.md", "docs/quickstart.md"])
def test_a_newcomer_sees_the_first_results_that_the_page_shows(name, tmp_path):
    languages = []
    for step, printed in follow(DOCUMENTS[name], tmp_path):
        if step.shown is None and name == "README.md":
            break  # the table of commands: below
        if step.shown is not None:
            agree(printed, step.shown)
            languages.append(step.language)
    assert set(languages) == {"sh", "python"}


@pytest.mark.long
@pytest.mark.parametrize("name", WALKED)
def test_a_newcomer_can_do_every_step_of_the_page(name, tmp_path):
    for step, printed in follow(DOCUMENTS[name], tmp_path):
        agree(printed, printed if step.shown is None else step.shown)
    assert len(steps(DOCUMENTS[name])) >= 3


def test_the_bound_in_the_readme_is_that_of_the_case(capsys, monkeypatch):
    (row,) = re.findall(r"^\| Cramér-Rao bound.*? \| (.*) \|$", DOCUMENTS["README.md"], re.MULTILINE)
    monkeypatch.chdir(ROOT)
    command = "plan cases/3.3-beams-1mm/case.toml --band 15:800 --step 1 --noise 0.05 --json"
    assert main(command.split()) == 0
    planned = json.loads(capsys.readouterr().out)
    names = ("k_Fy", "c_Fy", "k_Mtheta", "c_Mtheta")
    percent = [100 * planned["std_error"][name] / planned["value"][name] for name in names]
    agree(" ".join(f"{value:.6f}" for value in percent), row.replace("|", ""))


def test_python_example_of_several_joint_points(capsys):
    example, (shown,) = blocks("python", DOCUMENTS["docs/python.md"])[0], blocks("text", DOCUMENTS["docs/python.md"])
    exec(example, {})
    agree(capsys.readouterr().out, shown)


def test_python_example_of_solid_bodies(capsys):
    _, example = blocks("python", DOCUMENTS["docs/python.md"])
    exec(example, {})
    printed = capsys.readouterr().out
    found = {line.split()[0]: float(line.split()[1]) for line in printed.splitlines() if line[:2] in ("k_", "c_")}
    assert found["k_x"] == pytest.approx(1e6, rel=0.02)
    assert found["k_theta_x"] == pytest.approx(1e3, rel=0.05)
    # All stiffnesses, and the dashpots that the data support.
    assert len(found) >= 10


@pytest.mark.long
def test_python_of_the_page_on_fits_with_models_prints_what_it_shows(capsys):
    shown = [text for text in blocks("text", DOCUMENTS["docs/model-fit.md"]) if not text.startswith("$ ")]
    for example, text in zip(blocks("python", DOCUMENTS["docs/model-fit.md"]), shown, strict=True):
        exec(example, {})
        agree(capsys.readouterr().out, text)


@pytest.mark.long
def test_the_page_on_levels_finds_the_joint_it_was_made_of(capsys, monkeypatch):
    page = DOCUMENTS["docs/levels.md"]
    (example,), (command, *_, shown) = blocks("python", page), blocks("text", page)
    words, expected = command.removeprefix("$ jointfrf ").split("\n", 1)
    monkeypatch.chdir(ROOT)
    assert main(words.split()) == 0
    # the data hold only a combination of slip force and beta: parameters are compared with the truth
    printed, expected = (text.split("parameter of iwan") for text in (capsys.readouterr().out, expected))
    agree(printed[0], expected[0])
    for text in (printed[1], expected[1]):
        intervals = {row.split()[0]: row.split()[2::2] for row in text.splitlines()[2:] if row}
        for name, true in {"slip_force": 20, "k": 1.2e5, "chi": -0.4, "beta": 0.8, "loss_factor": 0}.items():
            assert float(intervals[name][0]) <= true <= float(intervals[name][1])
    named = {}
    exec(example, named)
    agree(capsys.readouterr().out, shown)
    best = named["found"].fits[0]
    assert best.law == "iwan"
    for name, true in {"slip_force": 3.0, "k": 1e6, "chi": -0.4, "beta": 0.8, "loss_factor": 0.004}.items():
        assert best.intervals[name][0] < true < best.intervals[name][1]


def test_the_page_on_levels_reads_a_free_decay(capsys, monkeypatch):
    (shown,) = [each for each in blocks("text", DOCUMENTS["docs/levels.md"]) if "--decay" in each]
    command, expected = shown.removeprefix("$ jointfrf ").split("\n", 1)
    monkeypatch.chdir(ROOT)
    assert main(command.split()) == 0
    agree(capsys.readouterr().out.split("parameter of iwan")[0], expected)


def test_the_page_on_levels_shows_the_warning_about_amplitude(capsys, tmp_path):
    command, expected = blocks("text", DOCUMENTS["docs/levels.md"])[1].removeprefix("$ jointfrf ").split("\n", 1)
    beam = iwan_beam(Sliders.iwan(20.0, 1.2e5, -0.4, 0.8), youngs_modulus=(1.004 * 210e9, 0.998 * 210e9),
                     loss_factor=0.0012)  # fmt: skip
    freq, channels = np.arange(215.0, 255.0, 0.5), tuple(jf.io.Channel(node, "+y") for node in (11, 12, 21, 22))
    h = jf.pollute(beam.at_force(freq, 1.0).h[:, :, None], 0.01, seed=1)
    jf.io.write_uff(tmp_path / "force_1N.uff", jf.io.FrfSet(freq, channels, channels[:1], h), single=True)
    assert main(command.replace("force_1N.uff", str(tmp_path / "force_1N.uff")).split()) == 1
    agree(capsys.readouterr().err, " ".join(expected.split()))


def cells_printed(path):
    """Patterns of the texts of a program between the bars of its tables."""
    for one in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        parts = one.values if isinstance(one, ast.JoinedStr) else [one]
        texts = [part.value if isinstance(part, ast.Constant) else None for part in parts]
        if any(isinstance(text, str) and text.strip(" |") for text in texts):
            # what stands for a value is one word, or two
            whole = "".join("\0" if text is None else str(text) for text in texts)
            for cell in re.split(r"[|\n]", whole):
                if cell.strip("\0 "):
                    yield re.escape(cell.strip()).replace("\0", r"[^\s|]+(?: [^\s|]+)?")


@pytest.mark.parametrize("name", ["docs/accuracy.md", "docs/benchmarks.md", "docs/checks.md"])
def test_tables_of_studies_have_the_heads_that_these_print(name):
    page, folder = DOCUMENTS[name], ROOT / "tests" / "accuracy"
    found = list(marked(page))
    assert len(found) == page.count("<!-- table") == page.count("<!-- /table -->") > 2
    known = (folder / "run").read_text(encoding="utf-8")
    for one in found:
        study = one.words.split()[0]
        module = folder / f"{study.replace('-', '_')}.py"
        if study.startswith("run-"):
            benchmarks = ROOT / "tests" / "benchmarks"
            module = benchmarks / f"{study.removeprefix('run-').replace('-', '_')}.py"
            assert f"-m benchmarks.{module.stem} " in (benchmarks / study).read_text(encoding="utf-8")
        elif module.exists():
            assert re.search(rf"^{re.escape(study)}\)|[ |]{re.escape(study)}[ )]", known, re.MULTILINE), study
        else:  # a part of the study of the compliance fit
            assert f'"{study}": ' in (folder / "trials.py").read_text(encoding="utf-8")
            module = folder / "fits.py"
        head, line, *rows = one.table.splitlines()
        # what columns are of may stand in a module that it imports
        imported = re.findall(r"^from (\w+) import", module.read_text(encoding="utf-8"), re.MULTILINE)
        sources = [module, *(path for other in imported if (path := folder / f"{other}.py").exists())]
        patterns = {pattern for path in sources for pattern in cells_printed(path)}
        for cell in head.strip("| ").split(" | "):
            assert any(re.fullmatch(pattern, cell.strip()) for pattern in patterns), f"{one.words}: {cell}"
        assert {row.count("|") for row in (line, *rows)} == {head.count("|")}
        # what a study prints beside its table is none of it, and writing it again changes nothing
        wanted = [other.table for other in found if other.words == one.words]
        printed = "case\n" + rows[0] + "\n\n" + "\n\n".join(wanted) + "\n\nseconds\n"
        assert tables_printed(printed) == wanted
        assert written(page, one.words, wanted) == page
        changed = written(page, one.words, [table + "\n" + rows[0] for table in wanted])
        assert changed.count(rows[0]) == page.count(rows[0]) + len(wanted)


@pytest.mark.long
def test_the_page_on_planning_prints_what_it_shows(capsys, monkeypatch, tmp_path):
    page = DOCUMENTS["docs/planning.md"]
    commands, shown = [], []
    for text in blocks("text", page):
        (commands if text.startswith("$") else shown).append(text)
    monkeypatch.chdir(ROOT)
    assert len(commands) == 2
    for command in commands:
        words, expected = command.removeprefix("$ jointfrf ").split("\n", 1)
        assert main(words.split()) == 0
        agree(capsys.readouterr().out, expected)
    monkeypatch.chdir(tmp_path)
    for example, text in zip(blocks("python", page), shown, strict=True):
        exec(example, {})
        agree(capsys.readouterr().out, text)


#: Blocks that are no fragments, which tests of their own run: how many of each language a page has.
OWN_TESTS = {
    ("docs/cases.md", "python"): 1,
    ("docs/cases.md", "sh"): 1,
    ("docs/cases.md", "toml"): 1,
    ("docs/command-line.md", "toml"): 1,
    ("docs/embedding.md", "fortran"): 3,
    ("docs/engine.md", "python"): 1,
    ("docs/files.md", "python"): 2,
    ("docs/julia.md", "julia"): 1,  # test_neighbours.py
    ("docs/levels.md", "python"): 1,
    ("docs/matlab.md", "matlab"): 3,
    ("docs/model-fit.md", "python"): 4,
    ("docs/model-fit.md", "toml"): 3,
    ("docs/planning.md", "python"): 2,
    ("docs/python.md", "python"): 2,
    ("docs/tutorial.md", "sh"): 4,
    ("docs/tutorial.md", "toml"): 1,
}
#: Pages whose Python `test_python_that_shows_no_output_runs` runs, and numbers that make it short.
SHORT = {
    "docs/performance.md": {},
    "docs/report.md": {},
    "docs/studies.md": {"200, design": "2, design", "100_000_000": "2000"},
}


def test_every_block_runs_or_is_a_fragment():
    """Commands of a shell are found by `SHELL`, whatever page they are on; pages that are walked run as a whole."""
    for name, text in DOCUMENTS.items():
        if name in WALKED:
            continue
        for language in set(re.findall(r"^```(\w+)", text, re.MULTILINE)) - {"text", "sh", "console"}:
            wanted = OWN_TESTS.get((name, language), 0)
            if not (language == "python" and name in SHORT):
                assert len(blocks(language, text)) == wanted, f"{name}: a block of {language} that no test runs"
    assert not set(SHORT) & {name for name, language in OWN_TESTS if language == "python"}


@pytest.mark.long
@pytest.mark.parametrize("name", SHORT)
def test_python_that_shows_no_output_runs(name, monkeypatch, tmp_path, hammer):
    monkeypatch.chdir(tmp_path)
    np.memmap("gamma.bin", complex, "w+", shape=(2000, 4, 4))[:] = 2 * np.eye(4)[::-1] + np.eye(4)
    named = {"__name__": "__main__", "jf": jf, **hammer}
    for example in blocks("python", DOCUMENTS[name]):
        for usual, short in SHORT[name].items():
            example = example.replace(usual, short)
        exec(example, named)
    if name == "docs/performance.md":
        np.testing.assert_allclose(named["z"], jf.invert(named["h"]))
    elif name == "docs/report.md":
        assert (tmp_path / "report.html").stat().st_size > 50_000
        assert named["fit"].value == named["known"].value
    else:
        assert {path.name for path in (tmp_path / "studies").iterdir()} >= {"noise", "noise.parquet"}
        np.testing.assert_allclose(named["k_joint"][1999], -np.linalg.inv(named["gamma"][1999])[:2, 2:])


@pytest.fixture
def hammer():
    """What pages take as given: a measured file, its FRFs and channels."""
    frfs = jf.io.read_frfs(ROOT / "cases/hammer-test/two_bars.uff").receptance()
    sides = jf.interface([101, 102], [201, 202], ["y", "theta_z"], frfs.coordinates)
    known = jf.identify(frfs.freq_hz, h := frfs.matrix(sides.channels, sides.channels), transform=sides)
    return {
        "frfs": frfs, "nodes_j": [101, 102], "nodes_k": [201, 202], "freq": frfs.freq_hz, "h": h, "sides": sides,
        "names": [str(channel) for channel in sides.channels], "known": known, "dofs_a": [0, 1], "dofs_b": [0, 1],
        "h_a": h[:, :2, :2], "h_b": h[:, 2:, 2:],
    }  # fmt: skip


def _shell_blocks():
    """Blocks of commands with the page's folder; if prompts stand before commands, their outputs follow."""
    for name, text in DOCUMENTS.items():
        if name not in WALKED and (name, "sh") not in OWN_TESTS:
            yield from ((name, block) for block in blocks("sh", text))
    for name in ("docs/pools.md", "docs/command-line.md", "docs/model-fit.md", "docs/sides.md", "docs/studies.md"):
        for block in (*blocks("text", DOCUMENTS[name]), *blocks("console", DOCUMENTS[name])):
            if block.startswith(tuple(f"$ jointfrf {command}" for command in ("pool", "new", "identify", "study"))):
                yield name, block


SHELL = list(dict.fromkeys(_shell_blocks()))


@pytest.mark.long
@pytest.mark.parametrize(("name", "block"), SHELL, ids=[f"{name}-{i}" for i, (name, _) in enumerate(SHELL)])
def test_commands_run_and_print_what_is_shown(name, block, tmp_path, monkeypatch):
    for path in (ROOT / name).parent.iterdir() if name.startswith("cases/") else ():
        (tmp_path / path.name).symlink_to(path)
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    monkeypatch.chdir(tmp_path)
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    for step in commands_shown(block) if block.startswith("$ ") else [Step("sh", block)]:
        done = subprocess.run(["sh", "-ec", step.code], capture_output=True, text=True, check=False, env=environment)
        assert done.returncode == 0, done.stderr
        assert done.stdout.strip()
        agree(done.stdout, done.stdout if step.shown is None else step.shown)


def test_joint_in_a_file_of_the_page_on_fits_with_models_is_read(tmp_path):
    (content,) = [text for text in blocks("toml", DOCUMENTS["docs/model-fit.md"]) if text.startswith("[[law]]")]
    (tmp_path / "mount.toml").write_text(content)
    joint = jf.read_joint(tmp_path / "mount.toml")
    assert (joint.dofs, joint.rigid) == (("y", "theta"), ("theta",))


def test_assembly_of_the_page_on_fits_with_models_is_read():
    (content,) = [text for text in blocks("toml", DOCUMENTS["docs/model-fit.md"]) if "[A]" in text]
    keys = read_keys(TomlTable(tomllib.loads(content), "assembly.toml"), AssemblyKeys)
    assert (keys.A.joint, keys.B.joint) == (("25:y", "25:theta"), ("601:y", "601:theta"))
    assert keys.A.unknown["loss_factor"].std == 0.0005


def test_the_page_of_the_keys_of_an_assembly_is_what_they_declare():
    assert DOCUMENTS["docs/assembly-keys.md"] == assembly_page()


def test_python_of_the_page_on_the_engine_runs(capsys, monkeypatch, tmp_path, beams):
    monkeypatch.chdir(tmp_path)
    (example,) = blocks("python", DOCUMENTS["docs/engine.md"])
    joint = jf.Joint([6e5, 5e3], dofs=["y", "theta"], loss_factor=[0.05, 0.1])
    gamma = jf.pollute(beams.gamma(joint), 0.01, seed=1)
    named = {"jf": jf, "freq": beams.freq, "gamma": gamma}
    exec(example, named)
    assert named["eta"].low < 0.05 < named["eta"].high
    assert sorted(path.name for path in tmp_path.iterdir()) == ["joint.html", "joint.json"]
    printed = capsys.readouterr().out
    assert "h_theta_z" in printed
    assert "note damping-chosen ('y',) damping of y: hysteretic" in printed
    assert "CBUSH" in printed


def test_python_of_the_page_on_files_prints_what_it_shows(capsys, monkeypatch):
    monkeypatch.chdir(ROOT)
    page = DOCUMENTS["docs/files.md"]
    for example, text in zip(blocks("python", page), blocks("text", page)[:2], strict=True):
        exec(example, {})
        agree(capsys.readouterr().out, text)


def test_convert_prints_what_is_shown(capsys, tmp_path, monkeypatch):
    (shown,) = (block for block in blocks("text", DOCUMENTS["docs/command-line.md"]) if "$ jointfrf convert" in block)
    command, expected = shown.removeprefix("$ ").split("\n", 1)
    _, *arguments, file, target = shlex.split(command)
    (tmp_path / file).parent.mkdir(parents=True)
    shutil.copy(ROOT / file, tmp_path / file)
    monkeypatch.chdir(tmp_path)
    assert main([*arguments, file, target]) == 0
    assert capsys.readouterr().out == expected


def test_the_readme_fits_a_reader():
    assert len(DOCUMENTS["README.md"].splitlines()) <= 110


@pytest.mark.parametrize("name", DOCUMENTS)
def test_lines_can_be_read_in_an_editor_and_compared(name):
    """Rows of tables cannot be broken, nor what a command prints."""
    lines = re.sub(r"```text\n.*?```", "", DOCUMENTS[name], flags=re.DOTALL).splitlines()
    assert not [line for line in lines if len(line) > 120 and not line.startswith("|")]


@pytest.mark.parametrize("name", DOCUMENTS)
def test_files_that_are_named_exist(name):
    named = set(re.findall(r"`((?:tests|cases|python|fortran|docs)/[\w./-]+)`", DOCUMENTS[name]))
    missing = [file for file in sorted(named) if not (ROOT / file).exists()]
    assert not missing


@pytest.mark.parametrize("name", DOCUMENTS)
def test_links_lead_to_files_and_headings(name):
    for link in re.findall(r"\]\((?!https?:)([^)\s]+)\)", DOCUMENTS[name]):
        file, _, heading = link.partition("#")
        target = (ROOT / name).parent / file if file else ROOT / name
        assert target.exists(), link
        if heading:
            titles = re.findall(r"^#+ (.*)$", target.read_text(encoding="utf-8"), re.MULTILINE)
            assert heading in [re.sub(r"[^\w -]", "", title).lower().replace(" ", "-") for title in titles], link


@pytest.mark.skipif(shutil.which("gfortran") is None, reason="gfortran is not on PATH")
def test_calls_in_fixed_form_fit_its_lines_and_compile(tmp_path):
    """Beyond column 72 fixed form reads nothing, and what is left of a call is none."""
    found = blocks("fortran", DOCUMENTS["docs/embedding.md"])
    calls = [text for text in found if text.startswith("      CALL")]
    assert len(calls) == 3
    for text in calls:
        assert max(map(len, text.splitlines())) <= 72
        (tmp_path / "call.f").write_text(f"      SUBROUTINE HOST\n{text.rstrip()}\n      END\n")
        words = ["gfortran", "-fsyntax-only", "-Wall", "-Werror=line-truncation", "call.f"]
        said = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=100)
        assert said.returncode == 0, said.stderr


def test_plate_with_a_line_joint_is_an_assembly(tmp_path):
    (content,) = [text for text in blocks("toml", DOCUMENTS["docs/model-fit.md"]) if 'model = "plate"' in text]
    path = tmp_path / "assembly.toml"
    path.write_text(content)
    file, freq = read_assembly_file(path), np.array([100.0])
    whole = file.assembly(freq, file.parts(freq), ["plate/5:z"])
    assert {one.name: one.unit for one in whole.joint.quantities if one.field.name == "k"} == {
        "clamp.k_z": "N/m per m",
        "clamp.k_theta_x": "N m/rad per m",
    }
