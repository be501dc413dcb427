"""Words of the command line: what was meant, the project's own file, JSON and quiet, completion, exit codes."""

import contextlib
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
import weakref
from functools import partial
from itertools import chain, repeat
from pathlib import Path

import numpy as np
import pytest

from command import run_command
from jointfrf.__main__ import main as started
from jointfrf.cli.main import main
from jointfrf.cli.parser import COMMANDS, command_parser
from thinned_cases import DrawSome

ROOT = Path(__file__).resolve().parents[3]
BARS = ROOT / "cases" / "hammer-test" / "two_bars.uff"
JOINT = ["--j", "101,102", "--k", "201,202", "--dofs", "y,rz", "--band", "20:150"]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    """Where there is no jointfrf.toml but that of the test."""
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["identfy"], "there is no command 'identfy'; did you mean identify?"),
        (["nothing"], "there is no command 'nothing': jointfrf --help lists them"),
        (["identify", "a.uff", "--dof", "y"], "unknown option --dof; did you mean --dofs?"),
        (["identify", "a.uff", "--qiet"], "unknown option --qiet; did you mean --quiet?"),
        (["identify", "a.uff", "--damping=viscos"], "'viscos' is none of none, viscous, hysteretic, both, auto"),
        (["identify", "a.uff", "--damping", "viscos"], "did you mean viscous?"),
        (["identify", "a.uff", "--method", "complience"], "did you mean compliance?"),
        (["check", "a.uff", "--dofs", "thetax,tz"], "not 'tz'"),
        (["check", "a.uff", "--dofs", "theta_q"], "did you mean theta_"),
        (["check", "a.uff", "--j", "5:3"], "'5:3' is no node number or range"),
        (["check", "a.uff", "--j", "1:9999999"], "are more than 100000 nodes"),
        (["check", "a.uff", "--config", "no.toml"], "--config: there is no file no.toml"),
        (
            ["check", "a.uff", "--force-quantity"],
            "--force-quantity has no effect without --quantity or --unit; leave it out",
        ),
        (["completion", "bsh"], "did you mean bash?"),
        (["cases", "--key"], "did you mean --keys?"),
        ([], "identify a joint from a file of measured FRFs"),
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
        (["--element", "7"], "--element has no effect: it is for cards"),
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
         "--trend and --output have no effect: it is of the pool"),
        (["identify", BARS, *JOINT, "--save-lines"], "--save-lines has no effect: it is for --save"),
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


@pytest.mark.usefixtures("_structures")
def test_several_tests_of_models_say_the_time_left_and_their_warnings(monkeypatch, tmp_path):
    from jointfrf.cli import identify_model

    said = []
    monkeypatch.setattr(identify_model, "waiting", lambda text: said.append(text) or contextlib.nullcontext())
    monkeypatch.setattr(identify_model.time, "monotonic", chain([0.0, 0.0, 100.0], repeat(0.0)).__next__)
    wrong = CHAIN.replace("[2.0, 1.0, 3.0]", "[2.0, 1.1, 3.0]")  # which the residual shows
    (tmp_path / "assembly.toml").write_text(
        f'[A]\n{wrong.format(ground="start")}joint = ["3:x"]\nexact = true\n[B]\n{CHAIN.format(ground="end")}'
        'joint = ["1:x"]\nexact = true\n[joint]\ndofs = ["x"]\nstiffness = [9e4]\ndamping = [9.0]\n'
        '[channels]\n"2:+x" = "A/2:x"\n"102:+x" = "B/2:x"\n'
    )
    assert run_command("convert", "c.npz", "d.npz").returncode == 0
    words = ["identify", "c.npz", "d.npz", "--model", "assembly.toml", "--noise", "0.001", "--json"]
    result = run_command(*words, "--each")
    assert result.returncode == 0, result.stderr
    content = json.loads(result.stdout)
    own = [test["fits"][0]["warnings"] for test in content["tests"]]
    assert own[0]
    named = [f"{name}: {text}" for name, texts in zip("cd", own, strict=True) for text in texts]
    assert [text for text in content["warnings"] if text in named] == named
    assert said == ["fit of c.npz (1 of 2)", "fit of d.npz (2 of 2, about 2 min left)"]
    alone = json.loads(run_command(*[word for word in words if word != "d.npz"]).stdout)
    assert set(own[0]) <= set(alone["warnings"])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--model", "m.toml", "--window-decay", "3"], "--window-decay are of fits without models"),
        (["--out", "fit.txt"], "--out: fit.txt is a file, not a folder"),
        (["--out", "fit.txt/deep"], "--out: fit.txt is a file, not a folder"),
        (["--report", "."], "--report: . is a folder, not a file"),
        (["--report", "fit.txt/page.html"], "--report: fit.txt is a file, not a folder"),
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
        ("jinja2", ["plan", "no.toml", "--report", "p.html"]),
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
        monkeypatch.setattr(f"jointfrf.{module}.draw", DrawSome())
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
        ({"unit": "m/N"}, ["--quantity", "mobility"], "leave --quantity out, or say --force-quantity"),
        ({"h": np.ones((2, 2, 2)), "freq_hz": [1.0, 2.0], "more": 1}, [], "give --map axes=, such as freq,out,in"),
        ({"y": 1}, [], "has several fields for h; give --map h=... out of h, y"),
        ({"responses": None}, [], "have no names of responses; give --map responses=..., such as 1:x,2:x"),
        ({}, ["--map", "axis=3"], "'axis=3' is not FIELD=NAME with a field out of"),
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
    words = ["study", "3.1", "--estimator", "ismm", "--realisations", "1000000", "--jobs", "1", "--out", "study"]
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
    words = ["study", "3.1", "--estimator", "ismm", "--realisations", "1000000", "--jobs", "2", "--out", "study"]
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

    monkeypatch.setattr("jointfrf.cli.cases.run", cut_short)
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

    monkeypatch.setattr("jointfrf.cli.main.command_parser", swallowed)
    monkeypatch.setattr(signal, "getsignal", lambda number: signal.default_int_handler)
    assert main(["cases"]) == 130
    assert capsys.readouterr().err == "jointfrf: error: interrupted\n"


def test_an_interrupt_while_the_command_is_imported(monkeypatch, capsys):
    class Cut:
        def find_spec(self, name, path=None, target=None):
            if name == "jointfrf.cli.main":
                raise KeyboardInterrupt

    monkeypatch.delitem(sys.modules, "jointfrf.cli.main")
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
        ('"viscous"', '"viscos"', "[identify]: damping: 'viscos' is none of none, viscous"),
        ("[101, 102]", "[0]", "jointfrf.toml: j: '0' is no node number"),
        ('"y", "theta_z"', '"y", "theta_"', "dofs: dofs must be among"),
        ("[20, 100]", "[20]", "band: '20' is not a band like 200:550"),
        ('quantity = "accelerance"', "quantity = 2020-01-01", "quantity: must be a text, a number or a list"),
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
    assert f"[identify]: {key}: say it on the command line, or name the file by --config" in result.stderr
    assert sorted(each.name for each in tmp_path.rglob("*")) == ["jointfrf.toml", "stranger"]


def test_a_file_that_is_found_names_no_executor(tmp_path):
    """Dask takes pickles from whoever it connects to."""
    Path("jointfrf.toml").write_text('[study]\nexecutor = "dask:tcp://127.0.0.1:9"\n')
    result = run_command("study", "4.2", "--realisations", "2")
    assert result.returncode == 1
    assert "[study]: executor: say it on the command line" in result.stderr
    Path("jointfrf.toml").write_text("json = true\n")
    assert "json: say it on the command line" in run_command("cases").stderr
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
    assert f"channels: {name} is not in the folder of this file, which was found and not named" in result.stderr
    named = run_command("check", BARS, "--config", "jointfrf.toml")
    assert "is not in the folder" not in named.stderr


def test_a_wrong_value_of_a_file_that_is_named():
    Path("own.toml").write_text("quiet = 1\n")
    result = run_command("check", BARS, "--config", "own.toml")
    assert "quiet: must be true or false, not 1" in result.stderr


def test_the_limit_of_what_is_read_is_an_option(tmp_path, monkeypatch):
    monkeypatch.delenv("JOINTFRF_FILE_LIMIT_GB", raising=False)
    result = run_command("check", BARS, "--limit-gb", "1e-6")
    assert result.returncode == 1
    assert "more than the 1e-06 GB that are read; raise this limit by --limit-gb or the environment" in result.stderr
    assert "must be a number of GB above 0, not '0'" in run_command("check", BARS, "--limit-gb", "0").stderr
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


def test_time_left_on_a_terminal(monkeypatch, capsys):
    from jointfrf.cli import usage

    clock = iter([0.0, 10.0, 20.0, 1000.0, 2000.0])
    monkeypatch.setattr(usage.time, "monotonic", lambda: next(clock))
    monkeypatch.setattr(usage.sys.stderr, "isatty", lambda: True, raising=False)
    show = usage.progress("case")
    show(1, 4)
    show(2, 4)
    show(3, 6)
    show(1, 6)  # of another thread, later
    show(4, 4)
    said = capsys.readouterr().err
    assert said.count("%") == 3
    assert "case: 25 %, about 30 s left" in said
    assert "case: 50 %, about 20 s left" in said
    assert "about 17 min left" in said
    assert said.endswith("\r\x1b[K")


def test_a_list_of_methods_names_one():
    result = run_command("identify", BARS, *JOINT, "--method", ",")
    assert result.returncode == 2
    assert "argument --method: ',' is not one of compliance, inverse-substructuring" in result.stderr


def test_a_message_is_one_line_whatever_a_file_is_called():
    result = run_command("check", "two\nlines.uff")
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr == "jointfrf: error: there is no file two\\nlines.uff\n"
