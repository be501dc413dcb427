"""The declared keys are those that the readers ask for; the reference of all keys is printed from them."""

import tomllib
from collections import defaultdict
from functools import partial
from pathlib import Path

import pytest

from jointfrf.cases import catalogue
from jointfrf.cases.catalogue import find_case, list_cases, read_case
from jointfrf.cases.key_page import key_page
from jointfrf.cases.kinds import KINDS
from jointfrf.cli.main import main
from jointfrf.errors import FileContentError
from jointfrf.spelling import look_alike
from jointfrf.toml.table import TomlTable, read_toml
from own_case import write_by_matrices, write_by_receptances

#: Cases that are read without a mesh.
QUICK = tuple(find_case(number) for number in ("3.1", "3.2", "4.3.3"))
ROOT = Path(__file__).resolve().parents[3]
DECLARED = [table for kind in KINDS.values() for top in (kind.keys, kind.expected_keys) for table in top.all_tables()]


@pytest.fixture
def asked(monkeypatch):
    """Keys that readers ask for, by the identity of the declared table."""
    found = defaultdict(set)
    ask = TomlTable._ask

    def recorded(self, key):
        ask(self, key)
        if self.known is not None:
            found[id(self.known)] |= {one.name for one in self.known.keys if one.matches(key)}

    monkeypatch.setattr(TomlTable, "_ask", recorded)
    return found


@pytest.fixture
def own(tmp_path):
    return write_by_matrices(tmp_path / "matrices"), write_by_receptances(tmp_path / "receptances")


def test_readers_ask_for_every_key_that_is_declared(asked, own, tmp_path):
    for folder in (*list_cases(), *own):
        read_case(folder)
    shear = tmp_path / "shear"
    shear.mkdir()
    text = (list_cases()[1] / "case.toml").read_text()
    assert 'element = "euler-bernoulli"' in text
    (shear / "case.toml").write_text(text.replace('"euler-bernoulli"', '"shear-flexible"\npoisson = 0.3'))
    read_case(shear)
    # `kind` and what every case says are read before the kind is known.
    common = {"kind", "title", "section", "frequency", "study"}
    for table in DECLARED:
        names = [key.name for key in table.keys]
        assert len(names) == len(set(names)), table.header
        early = {"case.toml": common, "expected.toml": {"figures"}}.get(table.header.split()[0], set())
        assert set(names) - asked[id(table)] <= early, table.header


def places(content, known, where=()):
    """Go through all keys of a file and of the tables inside: path to the table, and the declared key."""
    table = known.variant(content)
    for word, value in content.items():
        key = next(key for key in table.keys if key.matches(word))
        yield (*where, word), key
        inner = [value] if isinstance(value, dict) else value if isinstance(value, list) else []
        for number, each in enumerate(inner):
            if isinstance(each, dict) and key.inner is not None:
                step = (word,) if each is value else (word, number)
                yield from places(each, key.inner, (*where, *step))


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
        kind = KINDS[tomllib.loads(text).get("kind", "known-joint")]
        for (*where, word), key in list(places(tomllib.loads(text), kind.keys)):
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
    count = 0
    for folder, content, key, word, _ in variations(QUICK + own, lambda key: [None]):
        count += 1
        if word == "kind":
            continue  # another kind takes other keys
        if key.default is None or key.default.startswith("required"):
            with pytest.raises(FileContentError, match=f"the key '{word}' is missing"):
                read_instead(folder, content)
        else:
            read_instead(folder, content)
    assert count > 80


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
    "list of `[low, high]`": [[[2.0, 1.0]], [[1.0]], [1.0, 2.0]],
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
    for table in DECLARED:
        assert page.count(f"# {table.header}\n") == 1
        for key in table.keys:
            assert f"| `{key.name}` | {key.takes} |" in page
    assert all(row.count("|") == 6 for row in page.splitlines() if row.startswith("|"))


def test_kinds_of_the_reference_are_those_of_the_registry():
    for kind in KINDS.values():
        (key,) = (key for key in kind.keys.keys if key.name == "kind")
        assert key.takes == "one of " + ", ".join(f"`{name}`" for name in KINDS)
        assert key.default == f"`{next(iter(KINDS))}`"


@pytest.mark.parametrize(
    ("word", "similar"),
    [("sead", "seed"), ("Seed", "seed"), ("realizations", "realisations"), ("xyz", ""), ("", "")],
)
def test_a_misspelt_word_looks_like_a_known_one(word, similar):
    assert look_alike(word, ["realisations", "seed"]) == similar
