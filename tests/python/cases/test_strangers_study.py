"""A study folder of a stranger: no link in it is followed, no count of it is believed, damage is one sentence."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from command import run_command

CASE = "3.1"
DESIGN = jf.StudyDesign({"lines": [50]}, noises=["5 %"], estimators=["inverse-substructuring"])
WORDS = ("study", CASE, "--factor", "lines=50", "--noise", "5 %", "--estimator", "inverse-substructuring", "--jobs", 1)
N = 6


@pytest.fixture(scope="module")
def begun(tmp_path_factory) -> Path:
    """A study of which each half is in a chunk of its own."""
    folder = tmp_path_factory.mktemp("begun")
    for part in (range(0, 3), range(3, N)):
        jf.study(CASE, folder, N, design=DESIGN, part=part, jobs=1)
    return folder


@pytest.fixture
def study(begun, tmp_path) -> Path:
    shutil.copytree(begun, tmp_path / "study")
    return tmp_path / "study"


@pytest.fixture
def home(tmp_path) -> Path:
    """Files of the user, whose content nothing may change."""
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "thesis.txt").write_text("of the user")
    (tmp_path / "home" / "empty").touch()
    return tmp_path / "home"


def content_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def chunks_of(study: Path) -> list[Path]:
    return sorted((study / "chunks").glob("[0-9]*.npz"))


def go_on(study: Path, count: int = N) -> jf.StudyResult:
    return jf.study(CASE, study, count, design=DESIGN, jobs=1)


def rejected(study: Path, message: str, home: Path, count: int = N) -> None:
    """All that reads or writes a study ends in this sentence, and leaves the files of the user as they are."""
    before = content_of(home)
    for call in (
        lambda: go_on(study, count),
        lambda: jf.merge_studies([study], study.parent / "merged"),
        lambda: jf.read_study(study).estimates(0),
        lambda: jf.read_study(study).missing,
    ):
        with pytest.raises(jf.FileContentError, match=message) as caught:
            call()
        assert "\n" not in str(caught.value)
    assert content_of(home) == before


def test_chunks_are_written_into_no_other_folder(study, home):
    shutil.rmtree(study / "chunks")
    (study / "chunks").symlink_to(home)
    rejected(study, "chunks is a link or no folder, not a folder; remove it", home)
    (study / "chunks").unlink()
    (study / "chunks").write_text("no folder")
    rejected(study, "chunks is a link or no folder", home)


@pytest.mark.parametrize("name", ["thesis.txt", "empty"])
def test_a_chunk_that_is_a_link_is_rejected(study, home, name):
    """One to an empty file was taken for a chunk that is not there, and what it leads to overwritten."""
    first = chunks_of(study)[0]
    first.unlink()
    first.symlink_to(home / name)
    rejected(study, f"{first.name} is a link, not a file; remove it", home)


def test_a_chunk_that_links_to_another_study_is_not_copied(study, begun, home):
    first = chunks_of(study)[0]
    first.unlink()
    first.symlink_to(chunks_of(begun)[0])
    rejected(study, "is a link", home)
    assert not list((study.parent / "merged" / "chunks").glob("*"))


@pytest.mark.parametrize("name", ["thesis.txt", "not there"])
def test_a_record_that_is_a_link_is_rejected(study, home, name):
    (study / "study.json").unlink()
    (study / "study.json").symlink_to(home / name)
    rejected(study, r"study.json is a link, not a file; remove it", home)


def test_a_record_that_links_to_one_is_not_replaced(study, begun, home):
    shutil.copy(begun / "study.json", home)
    (study / "study.json").unlink()
    (study / "study.json").symlink_to(home / "study.json")
    rejected(study, r"study.json is a link", home, N + 2)


@pytest.mark.parametrize("kind", ["npz", "parquet"])
@pytest.mark.parametrize("name", ["thesis.txt", "not there"])
def test_values_go_through_no_link(study, home, kind, name):
    if kind == "parquet":
        pytest.importorskip("pyarrow")
    before = content_of(home)
    (study / f"realisations.{kind}").symlink_to(home / name)
    done = run_command(*WORDS, "--realisations", N, "--out", study, "--values", kind)
    assert done.returncode == 1
    assert f"realisations.{kind} is a link, not a file; remove it" in done.stderr
    assert content_of(home) == before
    (study / f"realisations.{kind}").unlink()
    assert jf.read_study(study).save_values(kind).stat().st_size


def test_tables_go_through_no_link_inside_the_folder(study, home):
    (study / "tables").mkdir()
    (study / "tables" / "study.csv").symlink_to(study / "study.json")
    before = (study / "study.json").read_bytes()
    with pytest.raises(jf.FileContentError, match=r"study\.csv is a link"):
        jf.read_study(study).report()
    assert (study / "study.json").read_bytes() == before


def test_the_usual_folder_is_no_link(study, home, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "studies").mkdir()
    (tmp_path / "studies" / CASE).symlink_to(home)
    before = content_of(home)
    done = run_command(*WORDS, "--realisations", N)
    assert (done.returncode, content_of(home)) == (1, before)
    assert f"{CASE} is a link or no folder" in done.stderr


def test_a_folder_that_the_user_names_may_be_a_link(study, tmp_path):
    (tmp_path / "link").symlink_to(study)
    assert go_on(tmp_path / "link", N + 2).estimates(0)[0].tolist() == list(range(N + 2))
    assert (tmp_path / "link").is_symlink()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes of POSIX")
def test_a_pipe_is_not_waited_for(study, home):
    first = chunks_of(study)[0]
    shutil.move(first, study / "kept")
    os.mkfifo(first)  # has no size: it was taken for a chunk that is not there
    rejected(study, f"{first.name} is a pipe or a device, not a file", home)
    first.unlink()
    shutil.move(study / "kept", first)
    (study / "study.json").unlink()
    os.mkfifo(study / "study.json")
    rejected(study, r"study\.json is a pipe or a device", home)


def test_a_sparse_chunk_is_not_copied(study, home):
    with chunks_of(study)[0].open("r+b") as file:
        file.truncate(300 * 10**9)
    rejected(study, "has 300 GB, more than the 16 GB that are read", home)
    assert sum(path.stat().st_size for path in study.parent.rglob("merged/**/*") if path.is_file()) < 1e6


def written_anew(path: Path, **arrays) -> None:
    path.unlink()
    with path.open("wb") as file:
        np.savez(file, **arrays)


def whole(**changed):
    """The arrays of a chunk of three realisations with two columns, some of them changed."""
    values = np.arange(6.0).reshape(3, 2)
    return {"values": values, "low": values - 1, "high": values + 1} | changed


WRONG = {
    "fewer rows": (whole(values=np.ones((2, 2))), "values must be 3 realisations x 2 columns, not 2 x 2"),
    "more rows": (whole(values=np.ones((4, 2))), "values must be 3 realisations x 2 columns, not 4 x 2"),
    "a column less": (whole(values=np.ones((3, 1))), "values must be 3 realisations x 2 columns, not 3 x 1"),
    "one number": (whole(values=np.array(1.0)), "values must be 3 realisations x 2 columns, not one number"),
    "low of another shape": (whole(low=np.zeros((1, 2))), "low must be 3 realisations x 2 columns, not 1 x 2"),
    "whole numbers": (whole(values=np.ones((3, 2), int)), "values must be float64, not int64"),
    "texts": (whole(values=np.full((3, 2), "a")), "values must be float64, not <U1"),
    "infinite": (whole(values=np.full((3, 2), np.inf)), "values must be finite, or NaN if a realisation failed"),
    "turned intervals": (whole(low=np.full((3, 2), 9.0)), "low must be at most high"),
    "no interval": (whole(low=np.full((3, 2), np.inf), high=np.full((3, 2), np.inf)), "low must be at most high"),
    "half an interval": ({k: v for k, v in whole().items() if k != "high"}, "arrays must be values, low and high"),
    "other arrays": ({"a": np.ones(3)}, "arrays must be values, low and high, not a"),
}  # fmt: skip


@pytest.mark.parametrize("kind", WRONG)
def test_a_chunk_that_does_not_hold_its_realisations_is_named(study, home, kind):
    arrays, message = WRONG[kind]
    first = chunks_of(study)[0]
    written_anew(first, **arrays)
    rejected(study, rf"{first.name} is damaged \({message}.*\): delete it, and the same study computes", home)
    first.unlink()
    assert go_on(study).missing == 0


def test_unbounded_intervals_are_read(study):
    written_anew(chunks_of(study)[0], **whole(low=np.full((3, 2), -np.inf), high=np.full((3, 2), np.inf)))
    assert np.isinf(jf.read_study(study).estimates(0)[2][:3]).all()


def test_numbers_of_another_byte_order_are_read(study):
    arrays = {name: part.astype(">f8") for name, part in whole().items()}
    written_anew(chunks_of(study)[0], **arrays)
    assert jf.read_study(study).estimates(0)[1][:3].tolist() == whole()["values"].tolist()


@pytest.mark.parametrize(
    "name", ["00001-0000000000-0000003.npz", "00000-2147483646-0000003.npz", f"0-{10**19}-1.npz", "99999-0-1.npz"]
)
def test_a_name_of_realisations_that_no_study_has_is_rejected(study, home, name):
    shutil.copy(chunks_of(study)[0], study / "chunks" / name)
    rejected(study, f"{name} belongs to no group of this study: delete it", home)


def changed(study: Path, **fields) -> None:
    record = json.loads((study / "study.json").read_text())
    for place, value in fields.items():
        *outer, last = place.split("__")
        table = record
        for key in outer:
            table = table[int(key) if key.isdigit() else key]
        table[last] = value
    (study / "study.json").write_text(json.dumps(record))


@pytest.mark.parametrize("count", [10**18, 2**31, 0, -3, True, "8", 1.5, None])
def test_realisations_of_a_record_are_checked(study, home, count):
    changed(study, realisations=count)
    rejected(study, r"study\.json is not the file of a study \(.*realisations.*\): name another folder", home)


def test_realisations_that_are_stated_win_over_those_of_the_folder(study):
    changed(study, realisations=2**31 - 1)
    done = run_command(*WORDS, "--realisations", 8, "--out", study, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    printed = json.loads(done.stdout)
    assert (printed["realisations"], printed["missing"]) == (8, 0)
    assert printed["summary"][0]["count"] == 8


def test_fewer_realisations_are_the_first_and_the_others_stay(study):
    whole = jf.read_study(study).estimates(0)[1]
    fewer = go_on(study, 4)
    assert (fewer.record.realisations, fewer.missing, fewer.summary[0].count) == (4, 0, 4)
    np.testing.assert_array_equal(fewer.estimates(0)[1], whole[:4])
    assert len(chunks_of(study)) == 2
    np.testing.assert_array_equal(go_on(study).estimates(0)[1], whole)


RECORDS = {
    "identity": [], "identity__factors": [1], "identity__factors__lines": 50, "identity__arrangement": ["full"],
    "groups": {}, "groups__0": [], "groups__0__point": ["lines"], "groups__0__columns": "k_x",
    "groups__0__columns__0": None, "groups__0__columns__0__actual": "2000", "groups__0__noise": 5, "seed": "31",
    "title": {"a": 1}, "name": None,
}  # fmt: skip


@pytest.mark.parametrize("place", RECORDS)
def test_a_record_of_other_types_is_one_sentence(study, home, place):
    record = json.loads((study / "study.json").read_text())
    *outer, last = place.split("__")
    table = record
    for key in outer:
        table = table[int(key) if key.isdigit() else key]
    table[int(last) if last.isdigit() else last] = RECORDS[place]
    (study / "study.json").write_text(json.dumps(record))
    rejected(study, r"study\.json is not the file of a study \(.*\): name another folder", home)


@pytest.mark.parametrize("text", ["[]", "3", "null", '"a"', '{"format": 1}', "[" * 10**5, "1" * 10**5, "\xff{"])
def test_a_record_that_is_none_is_one_sentence(study, home, text):
    (study / "study.json").write_text(text, encoding="latin-1")
    rejected(study, r"study\.json is not the file of a study", home)


def test_a_record_that_would_fill_the_memory_is_rejected(study, home):
    (study / "study.json").write_text(f'{{"format": 1, "more": [{"{}," * 14_000_000}{{}}]}}')
    rejected(study, r"study\.json states content of .* GB or more", home)


def test_chunks_of_an_unknown_study_are_not_taken(study):
    """Without study.json the chunks of a stranger were results of any study into this folder."""
    part = shutil.copytree(study, study.parent / "part")
    (study / "study.json").unlink()
    for call in (lambda: go_on(study), lambda: jf.merge_studies([part], study)):
        with pytest.raises(
            jf.FileContentError, match=r"chunks contains chunks of an unknown study, without study\.json"
        ):
            call()
    assert not (study / "study.json").exists()
    shutil.rmtree(study / "chunks")
    assert go_on(study).missing == 0


def test_a_record_with_other_columns_is_of_another_version(study, home):
    record = json.loads((study / "study.json").read_text())
    record["groups"][0]["columns"].pop()
    (study / "study.json").write_text(json.dumps(record))
    for path in chunks_of(study):
        path.unlink()
    with pytest.raises(jf.FileContentError, match="was written by another version of jointfrf"):
        go_on(study)
