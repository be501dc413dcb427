"""Result files are whole or not there."""

import pytest

from jointfrf.files import write_file


def test_a_file_is_replaced_and_nothing_else_is_left(tmp_path):
    path = tmp_path / "a.txt"
    write_file(path, "old")
    write_file(path, "näw")
    write_file(tmp_path / "b.bin", b"\x00\xff")
    assert path.read_text(encoding="utf-8") == "näw"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.txt", "b.bin"]
    reference = tmp_path / "c"
    reference.touch()
    assert path.stat().st_mode == reference.stat().st_mode


def test_a_failure_leaves_the_old_file_and_no_part(tmp_path):
    path = tmp_path / "a.txt"
    write_file(path, "old")
    with pytest.raises(UnicodeEncodeError):
        write_file(path, "\ud800")
    with pytest.raises(TypeError):
        write_file(path, 3)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]
