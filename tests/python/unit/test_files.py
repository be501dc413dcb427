"""Result files are whole or not there."""

import errno
import os
import stat
from pathlib import Path

import pytest

from jointfrf.errors import FileContentError
from jointfrf.files import below, write_file


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


def test_a_file_keeps_its_mode_and_its_owner(tmp_path):
    path = tmp_path / "a.txt"
    path.touch()
    path.chmod(0o604)
    if os.getuid() == 0:
        os.chown(path, 1234, 4321)
    before = path.stat()
    write_file(path, "new")
    after = path.stat()
    assert path.read_text() == "new"
    assert (after.st_mode, after.st_uid, after.st_gid) == (before.st_mode, before.st_uid, before.st_gid)


def test_the_mask_of_the_process_is_not_touched(tmp_path, monkeypatch):
    """Another thread made a file that everybody could write in the meantime."""
    mask = os.umask(0o027)
    try:
        with monkeypatch.context() as patched:
            patched.setattr(os, "umask", None)
            write_file(tmp_path / "a.txt", "new")
        assert stat.S_IMODE((tmp_path / "a.txt").stat().st_mode) == 0o640
    finally:
        os.umask(mask)


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "a.txt").write_text("old")
    (tmp_path / "one").symlink_to("inner/a.txt")
    (tmp_path / "two").symlink_to("one")
    (tmp_path / "new").symlink_to("inner/b.txt")
    write_file(tmp_path / "two", "new")
    write_file(tmp_path / "new", "made")
    assert (tmp_path / "two").is_symlink()
    assert (tmp_path / "one").is_symlink()
    assert (tmp_path / "inner" / "a.txt").read_text() == "new"
    assert (tmp_path / "inner" / "b.txt").read_text() == "made"
    assert not (tmp_path / "inner" / "a.txt").is_symlink()
    (tmp_path / "round").symlink_to("round")
    with pytest.raises(OSError, match="too many levels of symbolic links"):
        write_file(tmp_path / "round", "")


def test_what_is_no_file_is_written_into(tmp_path):
    """Root's `--save /dev/null` made a file of it."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write_file(pipe, "through")
        assert os.read(reader, 100) == b"through"
    finally:
        os.close(reader)
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert os.listdir(tmp_path) == ["pipe"]
    if os.path.exists("/dev/null"):
        write_file(Path("/dev/null"), "gone")
        assert stat.S_ISCHR(os.stat("/dev/null").st_mode)
    with pytest.raises(IsADirectoryError):
        write_file(tmp_path, "")


@pytest.mark.skipif(not os.path.exists("/proc/self/fd"), reason="open files have no names")
@pytest.mark.parametrize("where", ["/dev/fd", "/proc/self/fd"])
def test_an_open_file_of_a_shell_is_written_into(tmp_path, where):
    """As with `--save >(gzip > joint.gz)`."""
    read, write = os.pipe()
    try:
        write_file(Path(where) / str(write), "through")
        assert os.read(read, 100) == b"through"
    finally:
        os.close(read)
        os.close(write)
    with open(tmp_path / "a.txt", "w") as file:
        write_file(Path(where) / str(file.fileno()), "through")
    assert (tmp_path / "a.txt").read_text() == "through"


@pytest.mark.parametrize("name", ["a" * 251 + ".txt", "ä" * 125 + ".txt"])
def test_names_as_long_as_the_file_system_takes(tmp_path, name):
    write_file(tmp_path / name, "old")
    write_file(tmp_path / name, "new")
    assert os.listdir(tmp_path) == [name]


def test_all_is_on_the_disk_before_the_old_file_goes(tmp_path, monkeypatch):
    done = []
    monkeypatch.setattr(os, "fsync", lambda handle: done.append(os.fstat(handle).st_size))
    replace = Path.replace
    monkeypatch.setattr(Path, "replace", lambda *paths: (done.append("moved"), replace(*paths)))
    write_file(tmp_path / "a.txt", "four")
    assert done == [4, "moved"]


def test_a_message_names_the_file(tmp_path, monkeypatch):
    """Not the one beside it, and not none where the disk is full."""
    with pytest.raises(FileNotFoundError) as caught:
        write_file(tmp_path / "no" / "a.txt", "")
    assert caught.value.filename == str(tmp_path / "no" / "a.txt")

    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left on device") as caught:
        write_file(tmp_path / "a.txt", "new")
    assert caught.value.filename == str(tmp_path / "a.txt")
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize(
    "name", ["../../pwn", "/etc/passwd", "a/b", ".bashrc", "-rf", "a\0b", "x" * 300, "a\nb", "ä:y", ""]
)
def test_a_name_of_anybody_is_that_of_a_file_in_the_folder(tmp_path, name):
    path = below(tmp_path, name, ".png")
    write_file(path, b"")
    assert path.parent == tmp_path
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert path.name.isascii()
    assert path.name.isprintable()
    assert path != below(tmp_path, name + "_", ".png")


def test_usual_names_stay_as_they_are(tmp_path):
    for name in ("k-theta_x", "4.2", "identification.json", "a+b,c=1"):
        assert below(tmp_path, name) == tmp_path / name


def test_a_link_out_of_a_folder_of_results_is_not_followed(tmp_path):
    folder = tmp_path / "results"
    folder.mkdir()
    (folder / "report.html").symlink_to(tmp_path / "secret")
    (folder / "tables").symlink_to(tmp_path)
    with pytest.raises(FileContentError, match="is a link out of its folder, to which nothing is written; remove it"):
        below(folder, "report.html")
    (folder / "inside").symlink_to("other")
    assert below(folder, "inside") == folder / "inside"
