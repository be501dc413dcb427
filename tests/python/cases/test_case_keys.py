"""Declared keys: what is required, which values they take, and what is written from them."""

import json
import tomllib
from functools import partial
from pathlib import Path

import pytest

from jointfrf.choices import CASE_KINDS
from jointfrf.errors import FileContentError
from jointfrf.spelling import look_alike
from jointfrf.toml.declared import keys_of
from jointfrf.toml.documents import schema_of
from jointfrf.toml.table import TomlTable, read_toml
from jointfrf.workbench.cases import catalogue
from jointfrf.workbench.cases.catalogue import find_case, key_page, kind_named, list_cases, read_case
from jointfrf.workbench.cli.main import main
from own_case import write_by_matrices, write_by_receptances
from thinned_cases import DrawSome

#: Cases that are read without a mesh.
QUICK = (*(find_case(number) for number in ("3.1", "3.2", "4.3.3")), list_cases()[-1])
ROOT = Path(__file__).resolve().parents[3]
#: Keys that a case needs for the methods that it names, or instead of others: they are not required by themselves.
BY_METHODS = {"initial_stiffness", "initial_damping", "bands", "actual", "start", "first", "last", "step"}


@pytest.fixture
def own(tmp_path):
    return write_by_matrices(tmp_path / "matrices"), write_by_receptances(tmp_path / "receptances")


def places(content, kinds, where=()):
    """Go through all keys of a file and of the tables inside: path to the key, and its declaration."""
    declared = [keys_of(kind) for kind in kinds]
    table = next((one for one in declared if content.get(one.tag_name) == one.tag), declared[0])
    for word, value in content.items():
        one = next((one for one in table.keys if one.name == word), table.rest if word != table.tag_name else None)
        if one is None:
            continue
        yield (*where, word), one
        inner = [value] if isinstance(value, dict) else value if isinstance(value, list) else []
        for number, each in enumerate(inner):
            if isinstance(each, dict) and one.tables:
                step = (word,) if each is value else (word, number)
                yield from places(each, one.tables, (*where, *step))


def read_changed(changed, path):
    """Read a file of a case, but for `case.toml` return another table."""
    return changed if path.name == "case.toml" else read_toml(path)


def variations(folders, values):
    """Go through the cases with one key at a time set to each of some values, or deleted where the value is None.

    A declared key is treated once, where it stands first.
    """
    seen = set()
    for folder in folders:
        text = (folder / "case.toml").read_text()
        kind = kind_named(tomllib.loads(text).get("kind", "known-joint"))
        for (*where, word), key in list(places(tomllib.loads(text), (kind.keys,))):
            if id(key) in seen:
                continue
            seen.add(id(key))
            for value in values(key):
                content = tomllib.loads(text)
                table = content
                for step in where:
                    table = table[step]
                table[word] = value
                if value is None:
                    del table[word]
                yield folder, content, key, word, value


@pytest.fixture
def read_instead(monkeypatch):
    """Return a function that reads a case with another content of its `case.toml`."""

    def read(folder, content):
        monkeypatch.setattr(catalogue, "read_toml", partial(read_changed, TomlTable(content, "here", folder)))
        return read_case(folder)

    return read


def test_a_key_may_be_absent_where_the_reference_says_so(own, read_instead):
    required = optional = 0
    for folder, content, key, word, _ in variations(QUICK + own, lambda key: [None]):
        if key.is_required or key.absent.startswith("required") or key.name in BY_METHODS:
            required += 1
            with pytest.raises(FileContentError, match=rf"the keys? .*'{word}'.* (is|are) missing"):
                read_instead(folder, content)
        else:
            optional += 1
            read_instead(folder, content)
    assert required > 60
    assert optional > 15


def test_all_missing_keys_are_named_at_once(tmp_path):
    text = (find_case("3.1") / "case.toml").read_text()
    for line in ("seed = 31\n", "realisations = 1000\n", 'title = "Two masses and two masses', 'dof = "x"\n'):
        assert line in text
        text = text.replace(line, "#" if line.startswith("title") else "", 1)
    (tmp_path / "case.toml").write_text(text)
    with pytest.raises(FileContentError) as error:
        read_case(tmp_path)
    assert set(str(error.value).partition("case.toml: ")[2].split("; ")) == {
        "the key 'title' is missing",
        "[[joint]] number 1: the key 'dof' is missing",
        "[study]: the keys 'realisations', 'seed' are missing",
    }


def without(text, *names):
    """Leave out lines that set keys."""
    return "\n".join(line for line in text.splitlines() if line.partition(" = ")[0] not in names)


def test_keys_that_no_method_needs_may_be_absent(tmp_path):
    text = (find_case("3.1") / "case.toml").read_text()
    start, end = text.index("[[bands]]"), text.index("[[noise]]")
    lean = without(text[:start] + text[end:], "r", "s", "initial_stiffness", "initial_damping", "motion", "section")
    fit_only = lean.replace('["ismm", "compliance"]', '["compliance"]').replace('["ismm"]', '["compliance"]')
    (tmp_path / "case.toml").write_text(fit_only)
    case = read_case(tmp_path)
    assert case.points["r"] == case.points["j"]
    assert case.initial.stiffness == case.joint.stiffness
    for method, lacking in (
        ("ismm", "'initial_stiffness', 'initial_damping' are missing: ismm begins with a first estimate"),
        ("inverse-substructuring", "the key 'bands' is missing: inverse-substructuring takes means over bands"),
        ("decoupling-rr", "the keys 'r', 's' are missing: decoupling-rr takes FRFs of internal points"),
    ):
        (tmp_path / "case.toml").write_text(fit_only.replace('["compliance"]', f'["{method}"]', 1))
        with pytest.raises(FileContentError, match=lacking):
            read_case(tmp_path)


#: How a value begins in the reference, to values that are something else.
WRONG = {
    "number": ["1", True, [1.0], float("nan"), 10**400],
    "number, above 0": [0, -1],
    "number, at least 0": [-1],
    "whole number": [1.5, "1", True, -1, 10**400],
    "whole number, at least 1": [0],
    "text": [1, ["x"]],
    "name of a": [1, "no such file"],
    "one of": ["no such word", 1, ["x"]],
    "true or false": [1, "true"],
    "list of": [1, [], {}],
    "list of numbers": [["1"]],
    "list of texts": [[1]],
    "list of bands": [[[2.0, 1.0]], [[1.0]], [1.0, 2.0]],
    "table": [1, []],
    "tables": [1, [], [1]],
}


def test_a_value_is_what_the_reference_says(own, read_instead):
    def wrong(key):
        return [value for start, values in WRONG.items() if key.takes.startswith(start) for value in values]

    accepted, count = [], 0
    for folder, content, _, word, value in variations(QUICK + own, wrong):
        count += 1
        try:
            read_instead(folder, content)
            accepted.append((folder.name, word, value))
        except FileContentError:
            pass
    assert accepted == []
    assert count > 250


def test_the_reference_is_printed_from_the_declared_keys(capsys):
    assert main(["cases", "--keys"]) == 0
    page = capsys.readouterr().out
    assert page == (ROOT / "docs/case-keys.md").read_text(encoding="utf-8") == key_page()
    headings = [line for line in page.splitlines() if line.startswith("#")]
    assert len(headings) == len(set(headings))
    for _, key in places(
        tomllib.loads((find_case("4.3.1") / "case.toml").read_text()), (kind_named("known-joint").keys,)
    ):
        assert f"`{key.shown.split(', ')[0]}`" in page
        assert f"| {key.takes} |" in page
    assert all(row.count("|") == 6 for row in page.splitlines() if row.startswith("|"))


# What a known joint shows is also looked at by tests of the shipped cases.
LONG = pytest.param("known-joint", marks=pytest.mark.long)


@pytest.mark.parametrize("kind", [LONG if kind == "known-joint" else kind for kind in (*CASE_KINDS, "study")])
def test_a_template_runs_as_it_stands(kind, tmp_path, capsys, monkeypatch, without_pictures):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("jointfrf.workbench.studies.result.draw", DrawSome())
    assert main(["new", kind, "own"]) == 0
    text = (tmp_path / "own" / "case.toml").read_text()
    assert text.startswith("#:schema ./case.schema.json\n")
    schema = json.loads((tmp_path / "own" / "case.schema.json").read_text())
    assert set(tomllib.loads(text)) <= set(schema["$defs"][schema["$ref"].rpartition("/")[2]]["properties"])
    assert read_case(tmp_path / "own").realisations <= 100
    if kind == "study":
        assert main(["study", "own", "--jobs", "1", "--realisations", "2"]) == 0
        assert "noise level" in capsys.readouterr().out
    elif kind != "bolted-lap":  # a mesh: run by the test below
        assert main(["run", "own", "--jobs", "1", "--realisations", "2"]) == 0
    capsys.readouterr()
    assert main(["new", kind, "own"]) == 2
    assert "own/case.toml exists; name another folder" in capsys.readouterr().err
    assert (tmp_path / "own" / "case.toml").read_text() == text


@pytest.mark.long
def test_the_template_of_a_bolted_lap_runs_as_it_stands(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "bolted-lap"]) == 0
    path = tmp_path / "my-bolted-lap" / "case.toml"
    path.write_text(path.read_text().replace("step = 2.0", "step = 20.0"))
    assert main(["run", "my-bolted-lap", "--jobs", "1", "--realisations", "1"]) == 0
    assert "Preloaded contact" in capsys.readouterr().out


def test_commented_keys_of_a_template_are_known(tmp_path, monkeypatch, capsys):
    """Every optional key of a template is one that the schema has."""
    monkeypatch.chdir(tmp_path)
    for kind in CASE_KINDS:
        assert main(["new", kind, kind]) == 0
        schema = schema_of(kind_named(kind).keys)
        known = {name for one in schema["$defs"].values() for name in one["properties"]}
        commented = [
            line.removeprefix("# ").partition(" = ")[0]
            for line in (tmp_path / kind / "case.toml").read_text().splitlines()
            if line.startswith("# ") and " = " in line
        ]
        assert len(commented) > 10
        assert {name for name in commented if not name.endswith("_DOF")} <= known


def test_the_schema_says_what_the_reader_checks(capsys):
    assert main(["new", "known-joint", "--schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert "null" not in json.dumps(schema)
    bands, noise = schema["$defs"]["BandKeys"], schema["$defs"]["Noise"]
    assert list(bands["patternProperties"]) == ["^(k_|c_).+$"]
    assert bands["required"] == ["name"]
    assert not bands["additionalProperties"]
    assert "compliance" in noise["properties"]["methods"]["items"]["enum"]
    assert noise["properties"]["level"]["minimum"] == 0
    assert "Unit: Hz." in schema["$defs"]["FrequencyKeys"]["properties"]["first"]["description"]
    top = schema["$defs"]["KnownJointKeys"]
    assert {"title", "frequency", "joint"} <= set(top["required"])
    assert "kind" not in top["required"]


@pytest.mark.parametrize(
    ("word", "similar"),
    [("sead", "seed"), ("Seed", "seed"), ("realizations", "realisations"), ("xyz", ""), ("", "")],
)
def test_a_misspelt_word_looks_like_a_known_one(word, similar):
    assert look_alike(word, ["realisations", "seed"]) == similar
