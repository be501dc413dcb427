"""`jointfrf identify --model` on the simulated beam with a lap joint, `--law`, and what they say of wrong words."""

import csv
import importlib.util
import json
import re
import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import jointfrf as jf
from command import run_command
from documents import DOCUMENTS, agree, blocks
from jointfrf.io import read_frfs, write_frfs
from jointfrf.models.points import PointPatch
from jointfrf.workbench.assembly_file.read import read_assembly_file
from jointfrf.workbench.cli.export import CardRequest
from jointfrf.workbench.cli.identify_model import _place_of_joint, _rigid_faces
from thinned_cases import DrawSome

CASES = Path(__file__).resolve().parents[3] / "cases"
LAP = CASES / "lap-beam"
LEVELS = sorted(LAP.glob("level_*.uff"))
MODEL = ["--model", LAP / "assembly.toml"]
BARS = [CASES / "hammer-test" / "two_bars.uff", "--j", "101,102", "--k", "201,202", "--dofs", "y,theta_z"]


def run(*words, expect=0):
    result = run_command("identify", *words)
    assert result.returncode == expect, result.stderr
    assert "Traceback" not in result.stderr
    return result


@pytest.fixture(scope="module")
def make():
    spec = importlib.util.spec_from_file_location("make_lap_beam", LAP / "make.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_files_are_what_make_writes(make):
    held = read_frfs(LEVELS[2])
    made = make.measured(2)
    np.testing.assert_allclose(held.h, made.h, rtol=1e-6)
    assert sum(path.stat().st_size for path in LEVELS) < 400_000


@pytest.fixture(
    scope="module",
    params=[pytest.param([LEVELS[0], LEVELS[-1]], id="ends"), pytest.param(LEVELS, id="all", marks=pytest.mark.long)],
)
def table(request, tmp_path_factory):
    """The fits of the first and the last level, and of all: what was said, the folder with empty pictures, levels."""
    folder = tmp_path_factory.mktemp("lap") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("jointfrf.workbench.report.fit.draw", DrawSome())
        return run(*request.param, "--each", *MODEL, "--out", folder), folder, request.param


def test_intervals_hold_the_joint_at_the_levels(table, make):
    """The 95 % interval of each file holds what the file was made with."""
    result, folder, levels = table
    rows = list(csv.DictReader((folder / "parameters.csv").read_text().splitlines()))
    held = {"k_theta_z": [], "eta_theta_z": []}
    for row in rows:
        if row["parameter"] in held:
            level = int(row["test"].removeprefix("level_")) - 1
            true = {"k_theta_z": make.STIFFNESS, "eta_theta_z": make.LOSS_FACTOR}[row["parameter"]][level]
            held[row["parameter"]].append(float(row["low_95"]) < true < float(row["high_95"]))
            assert float(row["value"]) == pytest.approx(true, rel=0.003 if row["unit"] != "1" else 0.08)
    assert {name: (sum(own), len(own)) for name, own in held.items()} == dict.fromkeys(held, (len(levels), len(levels)))
    assert result.stderr == ""


def test_the_table_in_the_readme_is_what_the_command_prints(table):
    readme = DOCUMENTS["cases/lap-beam/README.md"]
    (command,), (shown,) = blocks("sh", readme), blocks("text", readme)
    words = command.replace("cases/lap-beam/level_*.uff", " ".join(map(str, LEVELS)))
    words = words.replace("cases/lap-beam/assembly.toml", str(LAP / "assembly.toml")).split()
    assert words == ["jointfrf", "identify", *map(str, LEVELS), "--each", *map(str, MODEL)]
    result, _, levels = table
    left_out = tuple(path.stem for path in LEVELS if path not in levels)
    rows = [row for row in shown.splitlines() if not row.startswith(left_out)]
    agree(result.stdout.strip().split("\n\n")[1], "\n".join(rows))


def test_each_test_has_files_of_its_own(table):
    _, folder, levels = table
    assert {path.name for path in folder.iterdir()} == {"parameters.csv", *(path.stem for path in levels)}
    for path in levels:
        assert json.loads((folder / path.stem / "identification.json").read_text())["source"] == path.name


def thinned(path, folder):
    """Every third line of a file."""
    frfs = read_frfs(path)
    few = jf.io.FrfSet(frfs.freq_hz[::3], frfs.responses, frfs.excitations, frfs.h[::3], frfs.quantity)
    target = folder / f"{path.stem}.npz"
    write_frfs(target, few)
    return target


def test_one_test_in_several_files_with_all_that_is_written(tmp_path):
    frfs = read_frfs(thinned(LEVELS[0], tmp_path))
    halves = []
    for i, rows in enumerate(([0, 1], [2, 3])):
        part = jf.io.FrfSet(frfs.freq_hz, [frfs.responses[r] for r in rows], frfs.excitations, frfs.h[:, rows],
                            frfs.quantity)  # fmt: skip
        halves.append(tmp_path / f"half_{i}.npz")
        write_frfs(halves[-1], part)
    save, page, cards = tmp_path / "joint.json", tmp_path / "report.html", tmp_path / "joint.bdf"
    words = ["--save", save, "--report", page, "--export", "nastran:1,2", "--output", cards, "--json"]
    result = run(*halves, *MODEL, *words)
    content = json.loads(result.stdout)
    assert content["channels"]["responses"] == {
        "A/1:y": "11:+y",
        "A/15:y": "12:+y",
        "B/9:y": "21:+y",
        "B/25:y": "22:+y",
    }
    assert content["fits"][0]["derived"]["eta_theta_z"]["value"] == pytest.approx(0.006, rel=0.2)
    assert content["written"] == [str(path) for path in (save, cards, page)]
    loaded = jf.load(save)
    assert loaded.value["k_theta_z"] == content["fits"][0]["parameters"]["k_theta_z"]["value"]
    assert "PBUSH" in cards.read_text()
    assert "predicted by the models" in page.read_text()
    text = run(*halves, *MODEL).stdout
    assert "joint between A/25 at (0.36, 0, 0) m and B/1 at (0, 0, 0) m: rigid y; spring theta_z" in text
    assert re.search(r"A/15  0\.21, 0, 0  0\.15 +response y \(12:\+y\), mass", text)
    assert 'aria-label="Sketch of the assembly' in page.read_text()
    assert re.search(r"eta_theta_z +0\.00", text)
    assert run("--quiet", *halves, *MODEL).stdout == ""


@pytest.mark.parametrize(
    ("k", "coupling", "expected"),
    [(("5", "6"), "rigid", ([1, 2], [5, 6])), (("2", "6"), "rigid", None), (("5", "6"), "distributing", None)],
)
def test_rigid_points_of_the_joint_are_the_faces_of_cards(k, coupling, expected):
    """Not where both parts have a node of one number, which the whole model cannot have."""
    patches = [PointPatch("lap", ("1", "2"), "rigid"), PointPatch("lap", k, coupling)]
    parts = {name: SimpleNamespace(joint_patch=one) for name, one in zip("AB", patches, strict=True)}
    assert _rigid_faces(SimpleNamespace(parts=parts)) == expected


@pytest.mark.parametrize(("coupling", "said"), [("rigid", 1), ("distributing", 2)])
def test_cards_say_where_the_nodes_of_the_joint_lie_and_what_they_follow(coupling, said):
    parts = tuple(
        SimpleNamespace(joint_patch=PointPatch("lap", ("1", "2"), coupling), keys=SimpleNamespace(joint=("lap:y",)),
                        places={"lap": np.array([0.01, x, 0.0])}) for x in (0.0, -0.002)
    )  # fmt: skip
    options = {"units": "mm-t-s"}
    lines = _place_of_joint(
        SimpleNamespace(parts=dict(zip("AB", parts, strict=True))),
        CardRequest("nastran", [7, 8], options, {}),
    )
    assert lines[-1] == "node 7 lies at (10, 0, 0), node 8 at (10, -2, 0) mm"
    assert len(lines) == said
    assert said == 1 or lines[0].startswith("A/lap and B/lap: the joint acts on the mean motion of the nodes")


def test_a_file_that_cannot_be_read_leaves_the_others(tmp_path):
    good, bad = thinned(LEVELS[0], tmp_path), tmp_path / "bad.npz"
    bad.write_bytes(b"nothing")
    result = run(good, bad, "--each", *MODEL, expect=1)
    assert "level_1" in result.stdout
    assert len(result.stderr.splitlines()) == 1
    assert result.stderr.startswith(f"jointfrf: error: {bad} ")


@pytest.mark.parametrize(
    ("words", "status", "sentence"),
    [
        ([LEVELS[0], "--each"], 2, "--each needs --model"),
        ([LEVELS[0], *MODEL, "--j", "1", "--dofs", "y"], 2, "--j and --dofs are for fits without models"),
        ([LEVELS[0], *MODEL, "--damping", "both"], 2, "--damping is for fits without models"),
        ([LEVELS[0], "--model", "none.toml"], 1, "none.toml cannot be read"),
        ([LEVELS[0], *MODEL, "--band", "5000:6000"], 1, "the band 5000 to 6000 Hz contains no frequency line"),
        ([LEVELS[0], LEVELS[1], *MODEL], 1, "; use --each if every file is a test of its own"),
        ([LEVELS[0], LEVELS[1], "--each", *MODEL, "--export", "nastran:1,2"], 2, "needs files; add --output"),
        ([*BARS, "--law", "y=sprung"], 2, "unknown law 'sprung'; use one of spring, standard-linear-solid"),
        ([*BARS, "--law", "y"], 2, "'y' is no DOF with a law; use the form y=standard-linear-solid"),
        ([*BARS, "--law", "y=spring"], 2, "--law names the DOFs y, and --dofs y, theta_z; give each DOF one law"),
        ([*BARS, "--law", "y=spring", "--law", "y=rigid"], 2, "--law: y has two laws"),
        ([*BARS, "--law", "y=spring", "--law", "theta_z=spring", "--cross", "fit"], 2, "--cross fit is for springs"),
        ([*BARS, "--law", "y=spring", "--law", "theta_z=spring", "--method", "inverse-substructuring"], 2,
         "laws need method compliance"),
        ([*BARS, "--law", "y=rigid", "--law", "theta_z=rigid"], 2, "all joint DOFs are rigid; give at least one"),
        ([*BARS, "--law", "y=power", "--law", "theta_z=spring", "--export", "nastran:1,2"], 2,
         "use --save, then jointfrf export --frequency HZ"),
        ([*BARS, "--joint", "none.toml"], 1, "there is no file none.toml"),
    ],
)  # fmt: skip
def test_wrong_words(tmp_path, monkeypatch, words, status, sentence):
    monkeypatch.chdir(tmp_path)
    result = run(*words, expect=status)
    assert sentence in result.stderr
    assert result.stdout == ""


def test_laws_by_words_and_by_a_file_are_one_fit(tmp_path, monkeypatch):
    monkeypatch.setattr("jointfrf.workbench.report.fit.draw", DrawSome())
    words = run(*BARS, "--law", "y=spring", "--law", "theta_z=spring", "--json")
    (tmp_path / "joint.toml").write_text('dofs = ["y", "theta_z"]\nstiffness = [2e6, 2e3]\ndamping = [50.0, 0.5]\n')
    page = tmp_path / "report.html"
    by_file = run(*BARS, "--joint", tmp_path / "joint.toml", "--json", "--report", page, "--out", tmp_path / "out")
    one, other = (json.loads(each.stdout)["fits"][0]["parameters"] for each in (words, by_file))
    for name, true in {"k_y": 1e7, "k_theta_z": 5e3, "c_y": 200.0, "c_theta_z": 1.0}.items():
        assert one[name]["value"] == pytest.approx(other[name]["value"], rel=1e-4)
        assert one[name]["value"] == pytest.approx(true, rel=0.05)
    assert "regenerated with the joint found" in page.read_text()
    assert (tmp_path / "out" / "joint_theta_z.png").exists()


def test_saved_laws_are_exported_at_a_frequency(tmp_path):
    save = tmp_path / "joint.json"
    run(*BARS, "--law", "y=spring", "--law", "theta_z=fractional-zener", "--save", save, "--quiet")
    refused = run_command("export", save, "nastran:1,2")
    assert refused.returncode == 2
    assert "by --frequency HZ" in refused.stderr
    cards = run_command("export", save, "nastran:1,2", "--frequency", "200").stdout
    k = jf.load(save).joint.dynamic_stiffness([200.0])[0, 1, 1].real
    (line,) = (line for line in cards.splitlines() if line.startswith("*") and line.endswith("+3"))
    assert float(line[-16:].replace("+3", "e3")) == pytest.approx(k, rel=1e-9)


def test_a_new_assembly_is_read_as_it_is(tmp_path):
    folder = tmp_path / "joint"
    result = run_command("new", "assembly", folder)
    assert result.returncode == 0
    assert "jointfrf identify TEST.uff --model" in result.stdout
    schema = json.loads((folder / "assembly.schema.json").read_text())
    assert [one["$ref"].rpartition("/")[2] for one in schema["anyOf"]] == ["AssemblyKeys", "PartsKeys"]
    # What stands in comments, too, is read: keys and values are known.
    text = (folder / "assembly.toml").read_text()
    assert read_assembly_file(folder / "assembly.toml").joint.dofs == ("y", "theta_z")
    commented = text[text.index("# [B]") : text.index("[[joint.law]]")].split("# A part whose modes")
    read = []
    for part in commented:
        files = re.sub(r"(?m)^# ?", "", part[part.index("# [B]") :])
        (folder / "files.toml").write_text(text[: text.index("[B]   ")] + files + text[text.index("[[joint.law]]") :])
        read.append(read_assembly_file(folder / "files.toml").keys.B)
    assert (read[0].units, read[1].residuals) == ("mm-t-s", "part.uff")
    (folder / "several.toml").write_text(re.sub(r"(?m)^# ?", "", text[text.index("# same = ") :]))
    several = read_assembly_file(folder / "several.toml")
    whole = several.assembly(np.ones(1), several.parts(np.ones(1)), [])
    assert (list(whole.joints), whole.same) == (["left", "right"], (("left", "right"),))
    # A simulated test of it gives its joint.
    truth = read_assembly_file(folder / "assembly.toml")
    freq = np.arange(10.0, 600.0, 4.0)
    laws = jf.LawJoint({"y": jf.SpringLaw(4e5, c=8.0), "theta_z": jf.SpringLaw(2e3, c=0.4)})
    whole = truth.assembly(freq, truth.parts(freq), ["A/7:y"]).with_joint(laws)
    h = jf.pollute(whole.receptance(freq, ["A/7:y", "A/10:y", "B/10:y"], ["A/7:y"]), 0.02, seed=4)
    channels = [jf.io.Channel(i, "+y") for i in (1, 2, 3)]
    write_frfs(tmp_path / "test.npz", jf.io.FrfSet(freq, channels, channels[:1], h, "receptance"))
    result = run(tmp_path / "test.npz", "--model", folder / "assembly.toml", "--json")
    found = json.loads(result.stdout)["fits"][0]["parameters"]
    assert found["k_y"]["value"] == pytest.approx(4e5, rel=0.03)
    assert found["k_theta_z"]["value"] == pytest.approx(2e3, rel=0.05)
    assert run_command("new", "assembly", folder).returncode == 2
    assert json.loads(run_command("new", "assembly", "--schema").stdout)["$defs"]


@pytest.mark.long
def test_a_sensor_that_points_the_other_way_is_named(tmp_path):
    file = tmp_path / "assembly.toml"
    file.write_text((LAP / "assembly.toml").read_text().replace('"22:+y"', '"22:-y"'))
    result = run(LEVELS[0], "--model", file, "--find-wrong-channels", "--save", tmp_path / "joint.json")
    assert "the fit takes response B/25:y with the opposite sign" in " ".join(result.stdout.split())
    assert json.loads((tmp_path / "joint.json").read_text())["residual_is_noise"]


def test_looking_for_exchanged_channels_needs_models():
    assert "--find-wrong-channels needs --model" in run(*BARS, "--find-wrong-channels", expect=2).stderr


@pytest.mark.filterwarnings("ignore:.*poorly determined:jointfrf.errors.IdentificationWarning")
@pytest.mark.parametrize("case", ["four-mounts", "four-floors"])
def test_pages_of_cases_with_several_joints_show_what_is_found_beside_the_truth(case):
    folder = CASES / case
    own = runpy.run_path(str(folder / "make.py"))
    if case == "four-mounts":
        true = {
            f"{mount}.k_{way}": k for mount, ks in own["mounts"](1).items() for way, k in zip("xyz", ks, strict=True)
        }
        true |= {f"mounts.k_{way}": k for way, k in zip("xyz", own["STIFFNESS"], strict=True)}
        true |= {f"{rail}/youngs_modulus": modulus for rail, modulus in own["YOUNGS_MODULUS"].items()}
        true["machine/density"] = own["MASS"] / own["KEYS"]["parts"]["machine"]["mass"]
    else:
        k = own["STIFFNESS"]
        true = {"f1c1.k_theta_z": k, "f1c1.h_theta_z": own["LOSS_FACTOR"] * k}
        true["column1/youngs_modulus"] = own["YOUNGS_MODULUS"]
    (command,) = [line for line in (folder / "README.md").read_text().splitlines() if line.startswith("jointfrf")]
    file, model = (CASES.parent / command.split()[place] for place in (2, 4))
    fit = jf.measured_assembly(model, read_frfs(file)).fit()  # as the command does
    assert fit.residual_is_noise
    rows = [line.strip("| ").split(" | ") for line in (folder / "README.md").read_text().splitlines() if "|" in line]
    shown = {name: (float(a), float(b), tuple(map(float, interval.split(" .. ")))) for name, a, b, interval in rows[2:]}
    assert shown.keys() == true.keys()
    intervals = fit.confidence_interval(0.95)
    for name, (stated, value, interval) in shown.items():
        found, size = [fit.value[name], *intervals[name]], fit.std_error[name]
        assert stated == pytest.approx(true[name], rel=1e-4)
        assert [value, *interval] == pytest.approx(found, abs=0.1 * size + 1e-4 * value)
        assert found[1] < true[name] < found[2]
    if case == "four-floors":  # a set of equations for each joint, one that selects all
        nodes = {name: (2 * i + 1, 2 * i + 2) for i, name in enumerate(own["KEYS"]["joints"])}
        text = jf.cards(fit, "nastran", nodes)
        words = text.split()
        sets = [words[i + 1] for i, word in enumerate(words) if word == "MPC*"]
        assert words[words.index("MPCADD") + 2 :] == sets
        assert len(sets) == text.count("\nCBUSH ") == 16


@pytest.mark.filterwarnings("ignore:.*poorly determined:jointfrf.errors.IdentificationWarning")
def test_what_rational_functions_miss_of_close_modes_is_no_correlated_noise():
    folder = CASES / "four-mounts"
    own = runpy.run_path(str(folder / "make.py"))
    frfs = own["measured"](0)
    alone = jf.estimate_noise(frfs.freq_hz, frfs.receptance().h)
    assert alone.inflation > 4  # each line has noise of its own
    fit = jf.measured_assembly(folder / "assembly.toml", frfs).fit()
    assert not any("[correlated-lines]" in note for note in fit.notes)
    off = [
        (fit.value[name] - k) / fit.std_error[name]
        for mount, ks in own["mounts"](0).items()
        for name, k in zip((f"{mount}.k_x", f"{mount}.k_y"), ks[:2], strict=True)
    ]
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.7
