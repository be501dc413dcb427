"""Words of the command line: what was meant, the project's own file, JSON and quiet, completion, exit codes."""

import contextlib
import io
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
import warnings
import weakref
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from command import run_command
from jointfrf.__main__ import main as started
from jointfrf.errors import FrfCheckWarning
from jointfrf.workbench.cli import progress, usage
from jointfrf.workbench.cli.main import main
from jointfrf.workbench.cli.parser import COMMANDS, command_parser
from thinned_cases import DrawSome

ROOT = Path(__file__).resolve().parents[3]
BARS = ROOT / "cases" / "hammer-test" / "two_bars.uff"
JOINT = ["--j", "101,102", "--k", "201,202", "--dofs", "y,rz", "--band", "20:150"]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    """Where there is no jointfrf.toml but that of the test."""
    monkeypatch.chdir(tmp_path)


def test_a_pipe_that_lacks_a_character_gets_its_number(tmp_path, monkeypatch):
    """As on Windows, where the encoding of a pipe is that of the country."""
    pipe = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", pipe)
    assert main(["new", "known-joint", "ma\N{GREEK SMALL LETTER OMEGA}"]) == 0
    assert rb"ma\u03c9" in pipe.buffer.getvalue()
    assert (tmp_path / "ma\N{GREEK SMALL LETTER OMEGA}" / "case.toml").is_file()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["identfy"], "unknown command 'identfy'; did you mean identify?"),
        (["nothing"], "unknown command 'nothing'; see jointfrf --help"),
        (["identify", "a.uff", "--dof", "y"], "unknown option --dof; did you mean --dofs?"),
        (["identify", "a.uff", "--qiet"], "unknown option --qiet; did you mean --quiet?"),
        (["identify", "a.uff", "--damping=viscos"], "unknown value 'viscos'; use one of none, viscous"),
        (["identify", "a.uff", "--damping", "viscos"], "did you mean viscous?"),
        (["identify", "a.uff", "--method", "complience"], "did you mean compliance?"),
        (["check", "a.uff", "--dofs", "thetax,tz"], "not 'tz'"),
        (["check", "a.uff", "--dofs", "theta_q"], "did you mean theta_"),
        (["check", "a.uff", "--j", "5:3"], "'5:3' is no node number or range"),
        (["check", "a.uff", "--j", "1:9999999"], "are too many nodes; name at most 100000"),
        (["check", "a.uff", "--config", "no.toml"], "--config: file no.toml does not exist"),
        (["check", "a.uff", "--force-quantity"], "without --quantity or --unit; leave it out"),
        (["completion", "bsh"], "did you mean bash?"),
        (["cases", "--key"], "did you mean --keys?"),
        ([], "identify a joint from measured FRFs"),
        (["--hlep"], "unknown option --hlep; did you mean --help?"),
    ],
)
def test_what_was_meant(words, message):
    result = run_command(*words)
    assert result.returncode == 2
    assert message in result.stderr
    if words and words[0] in COMMANDS and "usage" in result.stderr:
        assert result.stderr.startswith(f"usage: jointfrf {words[0]} ")  # of this command only
        assert not any(f" {name} " in result.stderr for name in COMMANDS if name not in words)


def test_options_are_written_in_full():
    assert "unknown option --spac; did you mean --" in run_command("check", BARS, "--spac", "1").stderr


def test_a_value_may_begin_with_a_minus():
    for words in (["--at", "-0.01,-.5,0"], ["--at=-0.01,-.5,0"]):
        args = command_parser("check").parse_words(["a.uff", *words])
        assert args.at == (-0.01, -0.5, 0.0)


def test_help_names_every_command_and_ends_well(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    said = capsys.readouterr().out
    for name, what in COMMANDS.items():
        assert re.search(rf"^    {name}\s", said, re.MULTILINE)
        assert what.split(":")[0][:30] in re.sub(r"\s+", " ", said)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_the_common_options(command):
    options = command_parser(command).options
    assert {"--help", "--json", "--quiet", "--config", "--no-config"} <= set(options)
    result = run_command(command, "--help")
    assert (result.returncode, result.stderr) == (0, "")
    assert result.stdout.startswith(f"usage: jointfrf {command} ")


def test_json_is_json_and_nothing_else():
    result = run_command("identify", BARS, *JOINT, "--json")
    content = json.loads(result.stdout, parse_constant=lambda word: pytest.fail(f"{word} is no JSON"))
    assert content["fits"][0]["dofs"] == ["y", "theta_z"]
    assert content["joint"]["responses"] == ["101:+y", "102:+y", "201:+y", "202:+y"]
    assert content["written"] == []
    cases = json.loads(run_command("cases", "--json").stdout)["cases"]
    assert {"name", "title", "folder"} == set(cases[0])
    check = json.loads(run_command("check", BARS, "--json").stdout)
    assert check["ok"] is True


def test_quiet_prints_nothing(tmp_path):
    result = run_command("identify", BARS, *JOINT, "--quiet", "--save", "joint.json")
    assert (result.returncode, result.stdout) == (0, "")
    assert json.loads((tmp_path / "joint.json").read_text())["format"] == "jointfrf joint"
    assert run_command("cases", "--quiet") == (0, "", "")


def test_quiet_prints_warnings(monkeypatch):
    monkeypatch.chdir(ROOT)
    words = ["identify", BARS, *JOINT[:-4], "--dofs", "y", "--band", "20:150"]
    warned = json.loads(run_command(*words, "--json").stdout)["fits"][0]["warnings"]
    assert warned
    result = run_command(*words, "--quiet")
    assert (result.returncode, result.stdout) == (0, "")
    for text in warned:
        assert f"jointfrf: warning: {text}\n" in result.stderr


@pytest.mark.parametrize(
    ("words", "warning"),
    [
        (["--method", "inverse-substructuring", "--noise", "0.01"], "--noise has no effect: method inverse-"),
        (
            ["--method", "inverse-substructuring", "--damping=both", "--cross=fit"],
            "--damping and --cross have no effect",
        ),
        (["--at", "0.5,0,0", "--bending-stiffness", "1"], "--bending-stiffness has no effect: no rotation is found"),
        (["--element", "7"], "--element has no effect: no cards are written"),
    ],
)
def test_options_without_effect_are_named(words, warning):
    result = run_command("identify", BARS, *JOINT, *words)
    assert result.returncode == 0
    assert f"jointfrf: warning: {warning}" in result.stderr


def test_without_such_options_nothing_is_said_of_them():
    result = run_command("identify", BARS, *JOINT)
    assert result.returncode == 0
    assert "no effect" not in result.stderr


PARTS = ("a.toml", "b.toml")
CHAIN = (
    'model = "chain"\nmasses = [2.0, 1.0, 3.0]\nstiffness = [1e5, 2e5, 3e5]\ndamping = [3.0, 2.0, 1.0]\n'
    'ground = "{ground}"\n'
)
BETWEEN = ["--joint", "joint.toml", "--j", "3", "--k", "1", "--renumber-b", "100"]


@pytest.fixture(scope="module")
def structures(tmp_path_factory):
    """A folder with two chains, their joint, FRFs of their assembly, a saved fit."""
    folder = tmp_path_factory.mktemp("structures")
    with contextlib.chdir(folder):
        for name, ground in zip(PARTS, ("start", "end"), strict=True):
            Path(name).write_text(CHAIN.format(ground=ground))
        Path("joint.toml").write_text('dofs = ["x"]\nstiffness = [1e5]\ndamping = [10.0]\n')
        words = ["couple", *PARTS, *BETWEEN, "--band", "5:100", "--step", "0.5", "--output", "c.npz"]
        result = run_command(*words)
        assert result == (0, result.stdout, ""), result.stderr
        assert run_command("identify", BARS, *JOINT, "--save", "fit.json").returncode == 0
        shutil.copy("fit.json", "again.json")
    return folder


@pytest.fixture
def _structures(structures, tmp_path):
    """The same for one test."""
    shutil.copytree(structures, tmp_path, dirs_exist_ok=True)


@pytest.mark.usefixtures("_structures")
@pytest.mark.parametrize(
    ("words", "warning"),
    [
        (["couple", *PARTS, *BETWEEN, "--band", "5:9", "--step", "1", "--output", "d.npz", "--quantity", "mobility"],
         "--quantity has no effect: both substructures are models"),
        (["validate", *PARTS, "c.npz", *BETWEEN, "--band", "5:100", "--step", "0.5"],
         "--step has no effect: c.npz has frequency lines of its own"),
        (["frf", "a.toml", "--band", "5:9", "--step", "1", "--output", "d.npz", "--map", "h=A"],
         "--map has no effect: no file of FRFs is read"),
        (["decouple", *PARTS, "c.npz", "--equation", "rr", "--j", "3", "--k", "1", "--dofs", "x", "--r", "2:x", "--s",
          "2:x", "--renumber-b", "100"], "--s has no effect: equation rr does not use it"),
        (["pool", "fit.json", "again.json", "--transfer", "--output", "p.csv", "--trend", "m"],
         "--trend and --output have no effect: --transfer only tests"),
        (["identify", BARS, *JOINT, "--save-lines"], "--save-lines has no effect: nothing is saved without --save"),
        (["export", "joint.toml", "abaqus:1,2", "--frequency", "5"], "--frequency has no effect: no law"),
    ],
)  # fmt: skip
def test_every_command_names_options_without_effect_also_in_json(words, warning):
    result = run_command(*words, "--json")
    assert result.returncode == 0, result.stderr
    assert f"jointfrf: warning: {warning}" in result.stderr
    found = json.loads(result.stdout)["warnings"]
    assert any(text.startswith(warning) for text in found)
    assert len(found) == len(set(found))
    assert f"jointfrf: warning: {warning}" in run_command(*words, "--quiet").stderr


@pytest.fixture
def _models(_structures, tmp_path):
    """The same with models of the chains, one of them wrong, and four tests, the third of them damaged."""
    wrong = CHAIN.replace("[2.0, 1.0, 3.0]", "[2.0, 1.1, 3.0]")  # which the residual shows
    (tmp_path / "assembly.toml").write_text(
        f'[A]\n{wrong.format(ground="start")}joint = ["3:x"]\nexact = true\n[B]\n{CHAIN.format(ground="end")}'
        'joint = ["1:x"]\nexact = true\n[joint]\ndofs = ["x"]\nstiffness = [9e4]\ndamping = [9.0]\n'
        '[channels]\n"2:+x" = "A/2:x"\n"102:+x" = "B/2:x"\n'
    )
    for name in ("d", "e", "f"):
        assert run_command("convert", "c.npz", f"{name}.npz").returncode == 0
    (tmp_path / "e.npz").write_bytes((tmp_path / "e.npz").read_bytes()[:200])


EACH = ["identify", "c.npz", "d.npz", "e.npz", "f.npz", "--model", "assembly.toml", "--noise", "0.001", "--each"]


@pytest.mark.usefixtures("_models")
def test_a_test_that_fails_ends_no_other_one():
    result = run_command(*EACH, "--save", "fit.json")
    assert result.returncode == 1
    shown = [line for line in result.stdout.splitlines() if " of 4): " in line]
    assert [line.partition(":")[0] for line in shown] == [f"{one} ({i} of 4)" for i, one in enumerate("cdef", 1)]
    assert shown[0].partition(": ")[2].startswith("k_x ")
    assert shown[2] == "e (3 of 4): failed"
    last = result.stderr.splitlines()[-1]
    assert last.startswith("jointfrf: error: e.npz")
    assert last.count("e.npz") == 1
    assert all(Path(f"fit_{one}.json").exists() == (one != "e") for one in "cdef")
    content = json.loads(run_command(*EACH, "--json").stdout)
    own = [test["fits"][0]["warnings"] for test in content["tests"]]
    assert own[0]
    named = [f"{name}: {text}" for name, texts in zip("cdf", own, strict=True) for text in texts]
    assert [text for text in content["warnings"] if text in named] == named
    assert list(content["failed"]) == ["e.npz"]
    alone = json.loads(run_command(*EACH[:2], *EACH[5:-1], "--json").stdout)
    assert set(own[0]) <= set(alone["warnings"])


@pytest.mark.usefixtures("_models")
@pytest.mark.parametrize("wrong", [AssertionError("no"), IndexError("no"), np.linalg.LinAlgError("no")])
def test_any_error_of_a_test_is_named_at_the_end(monkeypatch, wrong):
    from jointfrf.workbench.cli import identify_model

    fit = identify_model._one
    one = lambda args, out: fit(args, out) if args.files[0].name != "d.npz" else (_ for _ in ()).throw(wrong)  # noqa: E731
    monkeypatch.setattr(identify_model, "_one", one)
    result = run_command(*EACH[:3], *EACH[5:])
    assert result.returncode == 1
    name = "" if isinstance(wrong, ValueError) else f"{type(wrong).__name__}: "
    assert result.stderr.splitlines()[-1] == f"jointfrf: error: d.npz: {name}no"
    assert "c (1 of 2): k_x" in result.stdout


@pytest.mark.usefixtures("_models")
def test_an_interrupt_leaves_the_tests_that_are_finished(monkeypatch):
    from jointfrf.workbench.cli import identify_model

    fit = identify_model._one

    def until_d(args, out):
        if args.files[0].name == "d.npz":
            raise KeyboardInterrupt
        return fit(args, out)

    monkeypatch.setattr(identify_model, "_one", until_d)
    result = run_command(*EACH, "--out", "o")
    assert (result.returncode, result.stderr.splitlines()[-1]) == (130, "jointfrf: error: interrupted")
    assert Path("o/parameters.csv").read_text().splitlines()[1].startswith("c,k_x,")
    assert "wrote o/parameters.csv" in result.stdout
    result = run_command(*EACH[:1], "d.npz", *EACH[5:])  # nothing is finished
    assert result == (130, "", "jointfrf: error: interrupted\n")


def test_an_interrupt_leaves_the_methods_that_are_finished(monkeypatch):
    from jointfrf.workbench.cli import identify as command

    fit = command._fit

    def compliance_only(args, method, *rest):
        if method != "compliance":
            raise KeyboardInterrupt
        return fit(args, method, *rest)

    monkeypatch.setattr(command, "_fit", compliance_only)
    words = ["identify", BARS, *JOINT, "--save", "fit.json", "--report", "fit.html"]
    result = run_command(*words, "--method", "compliance,inverse-substructuring")
    assert (result.returncode, result.stderr.splitlines()[-1]) == (130, "jointfrf: error: interrupted")
    assert result.stdout.splitlines()[-2:] == ["wrote fit.json", "wrote fit.html"]
    result = run_command(*words[:1], BARS, *JOINT, "--save", "other.json", "--method", "inverse-substructuring")
    assert (result.returncode, Path("other.json").exists()) == (130, False)


@pytest.mark.usefixtures("_models")
def test_levels_and_pool_name_files_that_fail(monkeypatch):
    from jointfrf.workbench.cli import levels as command

    words = ["levels", *EACH[1:5], "--level", "1,2,3,4", "--model", "assembly.toml", "--noise", "0.001"]
    result = run_command(*words)
    assert result.returncode == 1
    assert result.stderr.splitlines()[-1].startswith("jointfrf: error: e.npz")
    assert all(f"\n{one} " in result.stdout for one in "cdf")
    assert "\ne " not in result.stdout
    result = run_command(words[0], "e.npz", "--level", "1", *words[7:])
    assert (result.returncode, result.stdout) == (1, "")
    assert "e.npz" in result.stderr
    fit, done = command._fit, []
    monkeypatch.setattr(command, "_fit", lambda *own: fit(*own) if not done.append(own) and len(done) < 3 else 1 / 0)
    assert "f.npz: division by zero" in run_command(*words).stderr
    for name in ("third.json", "fourth.json"):
        shutil.copy("fit.json", name)
    Path("again.json").write_text("{")
    result = run_command("pool", "fit.json", "again.json", "third.json", "fourth.json", "--factor", "day=1,1,2,2")
    assert result.returncode == 1
    assert result.stderr.splitlines()[-1].startswith("jointfrf: error: again.json ")
    assert "k_y" in result.stdout
    result = run_command("pool", "fit.json", "again.json")
    assert (result.returncode, result.stdout) == (1, "")
    assert "again.json is no file of a joint" in result.stderr
    result = run_command("pool", "fit.json", "third.json", "--factor", "day=1,1,2")
    assert "--factor day has 3 groups; give 2, one for each file" in result.stderr


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--model", "m.toml", "--window-decay", "3"], "--window-decay are for fits without models"),
        (["--out", "fit.txt"], "--out: fit.txt is a file; name a folder"),
        (["--out", "fit.txt/deep"], "--out: fit.txt is a file; name a folder"),
        (["--report", "."], "--report: . is a folder; name a file"),
        (["--report", "fit.txt/page.html"], "--report: fit.txt is a file; name a folder"),
    ],
)  # fmt: skip
def test_what_cannot_be_done_is_said_before_a_file_is_read(tmp_path, words, message):
    (tmp_path / "fit.txt").write_text("")
    result = run_command("identify", "no.uff", *JOINT, *words)
    assert result.returncode == 2
    assert message in result.stderr


@pytest.mark.parametrize(
    ("package", "words"),
    [
        ("matplotlib", ["identify", "no.uff", "--out", "o"]),
        ("jinja2", ["identify", "no.uff", "--report", "r.html"]),
        ("matplotlib", ["run", "no"]),
        ("jinja2", ["study", "no"]),
        ("pyarrow", ["study", "no", "--values", "parquet"]),
        ("pyarrow", ["study", "merge", "a", "b", "--out", "c", "--values", "parquet"]),
        ("jinja2", ["plan", "no.toml", "--band", "1:2", "--step", "1", "--report", "p.html"]),
        ("jinja2", ["pool", "no.json", "--report", "p.html"]),
        ("h5py", ["convert", "no.uff", "a.h5"]),
        ("h5py", ["frf", "no.toml", "--output", "a.h5"]),
        ("h5py", ["couple", *PARTS, *BETWEEN, "--output", "a.h5"]),
        ("h5py", ["validate", *PARTS, "no.uff", *BETWEEN, "--output", "a.h5"]),
        ("shtab", ["completion", "bash"]),
    ],
)
def test_what_an_option_needs_is_checked_before_the_work(monkeypatch, package, words):
    """None of the files named is there: nothing was read before."""
    monkeypatch.setitem(sys.modules, package, None)
    result = run_command(*words)
    assert result.returncode == 1
    assert f"need the package {package}: pip install 'jointfrf[" in result.stderr


@pytest.mark.skipif(os.name == "nt", reason="links need rights on Windows")
def test_paths_through_a_link_mean_what_the_system_means(tmp_path, monkeypatch):
    """link/.. is the folder above that of the link's target, not the one that holds the link."""
    for module in ("report.fit", "studies.result"):
        monkeypatch.setattr(f"jointfrf.workbench.{module}.draw", DrawSome())
    (tmp_path / "real" / "deep").mkdir(parents=True)
    (tmp_path / "link").symlink_to(Path("real") / "deep")
    words = ["--out", "link/../out", "--save", "link/../new.json", "--report", "link/../page/r.html"]
    words += ["--export", "abaqus:1,2", "--bounds", "--output", "link/../cards.inp"]
    assert run_command("identify", BARS, *JOINT, *words).returncode == 0
    assert run_command("convert", BARS, "link/../bars.npz").returncode == 0
    assert run_command("new", "known-joint", "link/../case").returncode == 0
    part = ["--realisations", "2", "--jobs", "1", "--first", "0", "--count", "1"]
    study = run_command("study", "link/../case", "--out", "link/../study", *part)
    assert study.returncode == 0, study.stderr
    (tmp_path / "link" / "link.json").symlink_to("../../real/other.json")  # a link where a file is written
    (tmp_path / "real" / "other.json").write_text("")
    assert run_command("identify", BARS, *JOINT, "--save", "link/link.json").returncode == 0
    made = {path.name for path in (tmp_path / "real").iterdir()}
    files = {"new.json", "cards.inp", "bars.npz", "other.json"}
    assert made == {"deep", "out", "page", "case", "study"} | files
    assert {path.name for path in tmp_path.iterdir()} == {"link", "real"}
    assert json.loads((tmp_path / "real" / "other.json").read_text())["format"] == "jointfrf joint"


@pytest.mark.parametrize(
    ("fields", "words", "message"),
    [
        ({"quantity": None}, [], "the FRFs have no unit; give --unit, such as g/N or (m/s^2)/N"),
        ({"unit": "V"}, [], "the unit 'V' is not understood; give --unit, such as g/N"),
        ({"unit": "m/N"}, ["--unit", "mm/N"], "not the one of --unit; leave --unit out, or give --force-quantity"),
        ({"unit": "m/N"}, ["--unit", "phase=rad"], "--unit phase= has no effect on a.npz; leave it out"),
        ({"unit": "m/N"}, ["--skip-lines", "2"], "--skip-lines has no effect on a.npz; leave it out"),
        (
            {"unit": "m/N"},
            ["--unit", "mm/N", "--quantity", "mobility"],
            "--unit mm/N is one of receptance, not mobility",
        ),
        ({}, ["--unit", "V"], "argument --unit: unit 'V' of frf is not understood; use motion per force, such as g/N"),
        ({"unit": "m/N"}, ["--quantity", "mobility"], "out, or give --unit and --force-quantity"),
        ({"h": np.ones((2, 2, 2)), "freq_hz": [1.0, 2.0], "more": 1}, [], "give --map axes=, such as freq,out,in"),
        ({"y": 1}, [], "has several fields for h; give --map h=... out of h, y"),
        ({"responses": None}, [], "have no names of responses; give --map responses=..., such as 1:x,2:x"),
        ({}, ["--map", "axis=3"], "'axis=3' is not FIELD=NAME; use a"),
        ({}, ["--limit-gb", "1e-9"], "raise this limit by --limit-gb or the environment variable"),
    ],
)
def test_messages_speak_of_options(tmp_path, fields, words, message):
    rng = np.random.default_rng(0)
    values = {"h": rng.normal(size=(3, 2, 2)) + 0j, "freq_hz": [1.0, 2.0, 3.0], "quantity": "receptance"}
    values |= {"responses": ["1:y", "2:y"], "excitations": ["1:y", "2:y"]} | fields
    values["h"] = values["h"] * np.arange(1, 5).reshape(2, 2)
    np.savez(tmp_path / "a.npz", **{name: value for name, value in values.items() if value is not None})
    result = run_command("convert", "a.npz", "b.npz", *words)
    assert result.returncode != 0
    assert message in result.stderr
    assert not re.search(r"mapping|limit_gb|quantity=|unit=|skip_lines|force it", result.stderr)


@pytest.mark.skipif(os.name == "nt", reason="Windows has no such signal")
def test_an_interrupted_command_ends_with_one_sentence(tmp_path):
    words = [
        "study",
        "3.1",
        "--estimator",
        "ismm",
        "--realisations",
        "1000000",
        "--jobs",
        "1",
        "--out",
        "study",
        "--quiet",
    ]
    # A shell starts what runs in its background with the signal ignored, and tests hand that on.
    with subprocess.Popen([sys.executable, "-m", "jointfrf", *words], stdout=-1, stderr=-1, text=True,
                          start_new_session=True, preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
                          ) as process:  # fmt: skip
        while not (tmp_path / "study").exists() and process.poll() is None:
            time.sleep(0.05)
        time.sleep(1)
        os.killpg(process.pid, signal.SIGINT)  # as Ctrl-C on a terminal
        complained = _last_words(process)
    assert process.returncode == 130
    assert complained == "jointfrf: error: interrupted\n"


def _last_words(process: subprocess.Popen[str]) -> str:
    """What a process complains of until it ends; one that does not is ended with all of its group."""
    try:
        return process.communicate(timeout=300)[1]
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        raise


def _workers(children: Path) -> list[str]:
    """Processes of a pool out of a list of children of Linux."""
    found = []
    for number in children.read_text().split():
        with contextlib.suppress(OSError):  # one that has ended meanwhile
            found += [number] if b"spawn_main" in Path(f"/proc/{number}/cmdline").read_bytes() else []
    return found


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="children are listed by Linux")
@pytest.mark.parametrize("delay", [0, *(pytest.param(each, marks=pytest.mark.long) for each in (0.1, 0.2, 0.4, 0.8))])
def test_an_interrupt_while_processes_start_ends_all_of_them(delay):
    words = [
        "study",
        "3.1",
        "--estimator",
        "ismm",
        "--realisations",
        "1000000",
        "--jobs",
        "2",
        "--out",
        "study",
        "--quiet",
    ]
    with subprocess.Popen([sys.executable, "-m", "jointfrf", *words], stdout=-1, stderr=-1, text=True,
                          start_new_session=True, preexec_fn=partial(signal.signal, signal.SIGINT, signal.SIG_DFL),
                          ) as process:  # fmt: skip
        children = Path(f"/proc/{process.pid}/task/{process.pid}/children")
        while process.poll() is None and not _workers(children):
            time.sleep(0.01)
        time.sleep(delay)
        os.killpg(process.pid, signal.SIGINT)
        complained = _last_words(process)
    # Python ends itself by the signal where it came inside exec(), as in dataclasses: to a shell that is 130, too
    assert process.returncode in (130, -signal.SIGINT), complained
    assert complained == "jointfrf: error: interrupted\n"


def test_an_interrupt_that_an_import_calls_something_else(monkeypatch, capsys):
    def cut_short(args):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as error:
            raise ImportError("numpy was cut short") from error

    monkeypatch.setattr("jointfrf.workbench.cli.cases.run", cut_short)
    monkeypatch.setattr(signal, "getsignal", lambda number: signal.default_int_handler)
    assert main(["cases"]) == 130
    assert capsys.readouterr().err == "jointfrf: error: interrupted\n"


def test_an_interrupt_inside_a_callback_that_an_import_calls(monkeypatch, capsys):
    """Python only prints what a callback raises, and goes on."""

    def swallowed(name):
        gone = set()
        held = weakref.ref(gone, lambda _: signal.raise_signal(signal.SIGINT))
        del gone
        assert held() is None
        return command_parser(name)

    monkeypatch.setattr("jointfrf.workbench.cli.main.command_parser", swallowed)
    monkeypatch.setattr(signal, "getsignal", lambda number: signal.default_int_handler)
    assert main(["cases"]) == 130
    assert capsys.readouterr().err == "jointfrf: error: interrupted\n"


def test_an_interrupt_while_the_command_is_imported(monkeypatch, capsys):
    class Cut:
        def find_spec(self, name, path=None, target=None):
            if name == "jointfrf.workbench.cli.main":
                raise KeyboardInterrupt

    monkeypatch.delitem(sys.modules, "jointfrf.workbench.cli.main")
    monkeypatch.setattr(sys, "meta_path", [Cut(), *sys.meta_path])
    assert started() == 130
    assert capsys.readouterr().err == "jointfrf: error: interrupted\n"


@pytest.mark.skipif(os.name == "nt", reason="a shell of POSIX")
@pytest.mark.parametrize(
    "end", ["| true", "2>&- >&-", *(pytest.param(each, marks=pytest.mark.long) for each in (">&-", "2>&1 | true"))]
)
def test_files_are_written_though_nobody_reads(end):
    words = shlex.join([sys.executable, "-m", "jointfrf", "identify", str(BARS), *JOINT, "--save", "kept.json"])
    line = f"set -o pipefail; {words} {end}"
    result = subprocess.run(["bash", "-c", line], capture_output=True, text=True, timeout=300)
    assert result.returncode == 0, result.stderr
    assert "Traceback" not in result.stderr
    assert json.loads(Path("kept.json").read_text())["format"] == "jointfrf joint"


def test_an_error_has_its_status_though_nobody_reads():
    line = f"set -o pipefail; {shlex.quote(sys.executable)} -m jointfrf identify no.uff 2>&1 | true"
    assert subprocess.run(["bash", "-c", line], timeout=300).returncode == 1


PROJECT = """
quantity = "accelerance"
dofs = ["y", "theta_z"]
j = [101, 102]
k = "201:202"

[identify]
band = [[20, 100], [110, 150]]
damping = "viscous"
"""
#: What a file says that was named.
NAMED = PROJECT + 'save = "kept.json"\nexport = "abaqus:1,2"\n'


def test_a_project_has_defaults_of_its_own():
    Path("jointfrf.toml").write_text(PROJECT)
    result = run_command("identify", BARS, "--json")
    assert result.stderr.splitlines()[0] == "jointfrf: using jointfrf.toml of this folder (--no-config: without it)"
    fit = json.loads(result.stdout)["fits"][0]
    assert fit["dofs"] == ["y", "theta_z"]
    assert fit["bands_hz"]["y"] == [[20, 100], [110, 150]]
    assert not any("damping of y" in note for note in fit["notes"])
    assert run_command("check", BARS).returncode == 0
    assert run_command("cases").stderr == ""  # which asks it for nothing


def test_the_command_line_wins(tmp_path):
    (tmp_path / "deep").mkdir()
    Path("deep/other.toml").write_text(NAMED)
    words = ["--config", "deep/other.toml", "--dofs", "y", "--band", "20:150", "--bounds", "--json"]
    content = json.loads(run_command("identify", BARS, *words).stdout)
    fit = content["fits"][0]
    assert (fit["dofs"], fit["bands_hz"]["y"]) == (["y"], [[20, 150]])
    assert "*SPRING" in content["cards"]  # `export` is also the name of a command
    assert (tmp_path / "deep" / "kept.json").exists()  # files stand beside the configuration
    Path("jointfrf.toml").write_text(PROJECT)
    assert "--j, --k and --dofs are missing" in run_command("identify", BARS, "--no-config").stderr


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("quantity", "quantitty", "jointfrf.toml: unknown key 'quantitty'"),
        ("quantity", "quantitty", "did you mean 'quantity'?"),
        ("[identify]", "[identfy]", "did you mean 'identify'?"),
        ("damping", "dampening", "[identify]: unknown key 'dampening'"),
        ('"viscous"', '"viscos"', "[identify]: damping: unknown value 'viscos'; use one of none, viscous"),
        ("[101, 102]", "[0]", "jointfrf.toml: j: '0' is no node number"),
        ('"y", "theta_z"', '"y", "theta_"', "dofs: dofs must be among"),
        ("[20, 100]", "[20]", "band: '20' is no band; use the form 200:550"),
        ('quantity = "accelerance"', "quantity = 2020-01-01", "is no option value; write a text, a number or a list"),
        ("[identify]", "[identify", "not a TOML file"),
        ("[identify]", "identify = 3\n[run]", "identify must be a table"),
    ],
)
def test_what_is_wrong_in_the_file_of_a_project(old, new, message):
    Path("jointfrf.toml").write_text(PROJECT.replace(old, new))
    result = run_command("identify", BARS)
    assert result.returncode == 1
    assert message in result.stderr
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    ("said", "key"),
    [
        ('save = "../joint.json"', "save"),
        ('report = "a.html"', "report"),
        ('out = "a"', "out"),
        ('output = "a"', "output"),
        ('export = "abaqus:1,2"', "export"),
        ("quiet = true", "quiet"),
        ("limit_gb = 1e9", "limit_gb"),
    ],
)
def test_a_file_that_is_found_writes_nothing(tmp_path, monkeypatch, said, key):
    """`save = "../home/.bashrc"` in the folder of a stranger was done, and nothing said."""
    folder = tmp_path / "stranger"
    folder.mkdir()
    monkeypatch.chdir(folder)
    (folder / "jointfrf.toml").write_text(f"{PROJECT}{said}\n")
    result = run_command("identify", BARS)
    assert result.returncode == 1
    assert (
        f"[identify]: {key}: not taken from a jointfrf.toml in the working directory; give it on the command line"
        in result.stderr
    )
    assert sorted(each.name for each in tmp_path.rglob("*")) == ["jointfrf.toml", "stranger"]


def test_a_file_that_is_found_names_no_executor(tmp_path):
    Path("jointfrf.toml").write_text('[study]\nexecutor = "mpi"\n')
    result = run_command("study", "4.2", "--realisations", "2")
    assert result.returncode == 1
    assert "[study]: executor: not taken from a jointfrf.toml" in result.stderr
    Path("jointfrf.toml").write_text("json = true\n")
    assert "json: not taken from a jointfrf.toml" in run_command("cases").stderr
    Path("jointfrf.toml").write_text('export = "abaqus:1,2"\n')
    assert "export must be a table" in run_command("cases").stderr


@pytest.mark.parametrize("link", [False, True])
def test_a_file_that_is_found_reads_nothing_outside_its_folder(tmp_path, monkeypatch, link):
    folder = tmp_path / "stranger"
    folder.mkdir()
    monkeypatch.chdir(folder)
    (tmp_path / "secret.csv").write_text("channel,side,x,y,z\n101:+x,j,0,0,0\n")
    (folder / "own.csv").symlink_to(tmp_path / "secret.csv")
    name = "own.csv" if link else "../secret.csv"
    (folder / "jointfrf.toml").write_text(f'channels = "{name}"\nat = [0, 0, 0]\n')
    result = run_command("check", BARS)
    assert result.returncode == 1
    assert f"channels: {name} is not in the folder of this file; name the file by --config" in result.stderr
    named = run_command("check", BARS, "--config", "jointfrf.toml")
    assert "is not in the folder" not in named.stderr


def test_a_wrong_value_of_a_file_that_is_named():
    Path("own.toml").write_text("quiet = 1\n")
    result = run_command("check", BARS, "--config", "own.toml")
    assert "quiet: 1 is no switch; write true or false" in result.stderr


def test_the_limit_of_what_is_read_is_an_option(tmp_path, monkeypatch):
    monkeypatch.delenv("JOINTFRF_FILE_LIMIT_GB", raising=False)
    result = run_command("check", BARS, "--limit-gb", "1e-6")
    assert result.returncode == 1
    assert "more than the 1e-06 GB that are read; raise this limit by --limit-gb or the environment" in result.stderr
    assert "'0' is not a number above 0; use a size in GB" in run_command("check", BARS, "--limit-gb", "0").stderr
    assert main(["check", str(BARS), "--limit-gb", "1e-6", "--quiet"]) == 1
    assert "JOINTFRF_FILE_LIMIT_GB" not in os.environ


def test_names_do_nothing_to_a_terminal(tmp_path):
    path = tmp_path / "a\x1b]0;owned\x07\u202e.uff"
    path.write_bytes(BARS.read_bytes())
    result = run_command("check", path.name)
    assert "\x1b" not in result.stdout
    assert r"a\x1b]0;owned\x07\u202e.uff" in result.stdout
    for words in (["check", "\x1bx"], ["identify", path.name, "--j", "1\x1b"], ["\x1bx"]):
        assert "\x1b" not in run_command(*words).stderr


def test_completion_of_the_shells():
    pytest.importorskip("shtab")
    for shell in ("bash", "zsh", "fish"):
        result = run_command("completion", shell)
        assert (result.returncode, result.stderr) == (0, "")
        for word in (*COMMANDS, "bending-stiffness", "renumber-b"):
            assert word in result.stdout
    script = run_command("completion", "bash").stdout
    asked = 'COMP_WORDS=(jointfrf identify --ba); COMP_CWORD=2; _shtab_jointfrf; printf "%s\\n" "${COMPREPLY[@]}"'
    done = subprocess.run(["bash", "-c", script + "\n" + asked], capture_output=True, text=True)
    assert done.stdout.split() == ["--band"], done.stderr


def test_warnings_are_sentences(monkeypatch):
    def warn(args):
        warnings.warn("error: sign: 101:+y is reversed; turn it", FrfCheckWarning, stacklevel=1)
        warnings.warn("warning: gain: 102:+y", UserWarning, stacklevel=1)
        with np.errstate(all="warn"):
            assert np.isinf(np.array([1.0]) / 0.0 * np.float64(1e308) * 10).all()  # numpy's own warnings
        usage.Output(args).give({})
        return 0

    monkeypatch.setattr("jointfrf.workbench.cli.cases.run", warn)
    result = run_command("cases", "--json")
    shown = ["sign: 101:+y is reversed; turn it", "gain: 102:+y"]
    assert json.loads(result.stdout)["warnings"] == shown
    assert result.stderr == "".join(f"jointfrf: warning: {text}\n" for text in shown)


class _Clock:
    """Time that passes only where a test says so, and waits of the thread that shows progress."""

    def __init__(self, monkeypatch, is_terminal):
        self.now = 0.0
        monkeypatch.setattr(progress.time, "monotonic", lambda: self.now)
        monkeypatch.setattr(progress.sys.stderr, "isatty", lambda: is_terminal, raising=False)

    def text(self, *, bar=False):
        return progress._progress_text(self.now, bar=bar)

    def lines(self, times):
        """Show progress at these times, as the thread does."""
        waits = iter([*times, None])

        class Ended:
            def wait(this, seconds):  # noqa: N805
                following = next(waits)
                self.now = self.now if following is None else following
                return following is None

        progress._show_progress(Ended())


def test_progress_has_stage_time_share_and_time_left(monkeypatch):
    clock = _Clock(monkeypatch, is_terminal=True)
    with progress.waiting("identify"), progress.waiting("tests") as count:
        clock.now = 10.0
        assert clock.text() == "tests: 10 s"
        count(1, 4)
        with progress.waiting("fit of a.uff"):
            clock.now = 20.0
            assert clock.text() == "fit of a.uff: 10 s, 25 %, about 20 s left"  # 10 s for each test, 10 s have passed
        count(2, 4)
        assert clock.text(bar=True) == "[##########----------] tests: 20 s, 50 %, about 20 s left"
        count(1, 4)  # of another thread, later
        assert "50 %" in clock.text()
        clock.now = 1000.0
        count(3, 6)
        assert clock.text() == "tests: 1000 s, 50 %, about 17 min left"
        count(6, 6)  # all of one part: the next may begin
        assert clock.text() == "tests: 1000 s"
    assert not progress._STAGES


def test_progress_is_a_line_now_and_then(monkeypatch, capsys):
    clock = _Clock(monkeypatch, is_terminal=False)
    with progress.waiting("plan"):
        clock.lines([1.0, 2.9, 3.0, 8.0, 13.0, 13.5, 23.0])
    assert capsys.readouterr() == ("", "jointfrf: plan: 3 s\njointfrf: plan: 13 s\njointfrf: plan: 23 s\n")


def test_progress_on_a_terminal_gives_way_to_text(monkeypatch, capsys):
    clock = _Clock(monkeypatch, is_terminal=True)
    monkeypatch.setenv("COLUMNS", "20")
    with progress.waiting("a very long name of a stage"):
        clock.lines([1.0])
        assert capsys.readouterr().err == "\r\x1b[Ka very long name of"[: 4 + 19]
        usage.complain("error", "no")
    assert capsys.readouterr().err == "\r\x1b[Kjointfrf: error: no\n"


@pytest.mark.parametrize("quiet", [False, True])
def test_every_command_that_takes_long_prints_its_stage(monkeypatch, capsys, quiet):
    monkeypatch.setattr(progress, "FIRST_LINE", 0.0)
    monkeypatch.setattr(progress, "_SETTLED", 0.01)
    printed = threading.Event()
    text = progress._progress_text
    monkeypatch.setattr(progress, "_progress_text", lambda *args, **options: printed.set() or text(*args, **options))
    monkeypatch.setattr("jointfrf.workbench.cli.cases.run", lambda args: 0 if quiet or printed.wait(60) else 1)
    assert main(["cases", *(["--quiet"] if quiet else [])]) == 0
    assert capsys.readouterr() == ("", "" if quiet else "jointfrf: cases: 0 s\n")


def test_a_list_of_methods_names_one():
    result = run_command("identify", BARS, *JOINT, "--method", ",")
    assert result.returncode == 2
    assert "argument --method: unknown method ','; use one of compliance, inverse-substructuring" in result.stderr


def test_a_message_is_one_line_whatever_a_file_is_called():
    result = run_command("check", "two\nlines.uff")
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr == "jointfrf: error: there is no file two\\nlines.uff\n"
