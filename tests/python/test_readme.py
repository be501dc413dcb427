"""The README is true: its Python runs, and its measured file gives the output it shows."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()
DATA = Path(os.environ.get("JOINTFRF_TEST_DATA", ROOT.parent / "shared" / "data"))
LAP = DATA / "lap_joint" / "lap_joint.uff"


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_python_example(capsys):
    example, _ = blocks("python")
    names: dict[str, object] = {}
    exec(example, names)
    fit = names["fit"]
    assert fit.stiffness[0] == pytest.approx(2000, rel=0.01)
    assert fit.damping[0] == pytest.approx(3, rel=0.15)
    assert capsys.readouterr().out.rstrip().endswith("%")


def test_python_example_of_solid_bodies(capsys):
    _, example = blocks("python")
    exec(example, {})
    printed = capsys.readouterr().out
    found = {line.split()[0]: float(line.split()[1]) for line in printed.splitlines() if line[:2] in ("k_", "c_")}
    assert found["k_x"] == pytest.approx(1e6, rel=0.02)
    assert found["k_theta_x"] == pytest.approx(1e3, rel=0.05)
    assert len(found) == 12


def words(text: str) -> list[float | str]:
    """Words of a text, numbers as numbers; rules of dashes left out."""
    found: list[float | str] = []
    for word in text.split():
        if set(word) == {"-"}:
            continue
        try:
            found.append(float(word.rstrip(",:)")))
        except ValueError:
            found.append(word)
    return found


def test_measured_file_gives_the_output_shown(tmp_path):
    (shown,) = (block for block in blocks("text") if "jointfrf identify" in block)
    command, expected = re.match(r"\$ (.*?[^\\])\n(.*)", shown, re.DOTALL).groups()
    program, subcommand, file, *options = shlex.split(command.replace("\\\n", " "))
    assert (program, subcommand) == ("jointfrf", "identify")
    source = ROOT / file if (ROOT / file).exists() else LAP
    if not source.exists():
        pytest.skip("the measured file is not beside the project (JOINTFRF_TEST_DATA)")
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(source, tmp_path / file)
    arguments = [subcommand, file, *options]
    printed = subprocess.run(
        [sys.executable, "-m", "jointfrf", *arguments], cwd=tmp_path, capture_output=True, text=True, check=True
    ).stdout
    assert len(words(printed)) == len(words(expected))
    for found, said in zip(words(printed), words(expected), strict=True):
        assert found == (pytest.approx(said, rel=0.05) if isinstance(said, float) else said)


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`((?:tests|cases|python|fortran)/[\w./-]+)`", README))))
def test_files_that_are_named_exist(name):
    assert (ROOT / name).exists()
