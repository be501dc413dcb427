"""Result files are whole or not there."""

import errno
import os
import stat
from contextlib import suppress
from pathlib import Path, PureWindowsPath

import pytest

from jointfrf.errors import FileContentError
from jointfrf.files import OwnFolder, check_file, clean_name, write_file


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
    with pytest.raises(OSError, match="Too many levels of symbolic links"):
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
    "name", ["../../pwn", "/etc/passwd", "a/b", ".bashrc", "-rf", "a\0b", "x" * 300, "a\nb", "ä:y", "", "nul", "COM1.x"]
)
def test_a_name_of_anybody_is_that_of_a_file_in_the_folder(tmp_path, name):
    own = OwnFolder(tmp_path)
    path = own.write(clean_name(name, ".png"), b"")
    assert path.parent == tmp_path
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    assert path.name.isascii()
    assert path.name.isprintable()
    assert not PureWindowsPath(path.name).is_reserved()
    assert path.name != clean_name(name + "_", ".png")


def test_usual_names_stay_as_they_are():
    for name in ("k-theta_x", "4.2", "identification.json", "a+b,c=1"):
        assert clean_name(name) == name


def test_a_name_with_a_folder_is_none(tmp_path):
    for name in ("../a", "/a", "a/b", ""):
        with pytest.raises(ValueError, match="is not a name: make one by clean_name"):
            OwnFolder(tmp_path).write(name, "")


@pytest.fixture
def results(tmp_path) -> OwnFolder:
    """A folder in a folder, and beside both a file of the user."""
    (tmp_path / "secret").write_text("of the user")
    return (OwnFolder(tmp_path / "results") / "tables").make()


@pytest.mark.parametrize("goal", ["../../secret", "../../new", "a.csv", "other", "/dev/null"])
def test_a_link_in_a_folder_of_results_is_not_followed(results, tmp_path, goal):
    results.write("other", "own")
    (results.path / "a.csv").symlink_to(goal)
    with pytest.raises(FileContentError, match=r"a\.csv is a link, not a file; remove it"):
        results.write("a.csv", "new")
    with pytest.raises(FileContentError, match="is a link"), results.opened("a.csv"):
        pass
    assert (tmp_path / "secret").read_text() == "of the user"
    assert sorted(path.name for path in results.path.iterdir()) == ["a.csv", "other"]
    assert not (tmp_path / "new").exists()


def test_a_folder_of_results_that_is_a_link_is_not_entered(results, tmp_path):
    results.path.rmdir()
    results.path.symlink_to(tmp_path)
    for call in (results.make, results.entries, results.check, lambda: results.write("secret", "")):
        with pytest.raises(FileContentError, match="tables is a link or no folder, not a folder; remove it"):
            call()
    assert (tmp_path / "secret").read_text() == "of the user"


@pytest.mark.parametrize("made", [os.mkfifo, os.mkdir], ids=["pipe", "folder"])
def test_what_is_no_file_in_a_folder_of_results_is_rejected(results, made):
    made(results.path / "a.csv")
    for call in (lambda: results.write("a.csv", "new"), lambda: results.opened("a.csv").__enter__()):
        with pytest.raises(FileContentError, match=r"is a (pipe or a device|folder), not a file"):
            call()


@pytest.mark.skipif(os.open not in os.supports_dir_fd, reason="this system opens nothing relative to a folder")
@pytest.mark.parametrize("when", ["stat", "open", "replace"])
def test_a_link_put_there_between_check_and_use_is_not_followed(results, tmp_path, monkeypatch, when):
    """Somebody else who may write into the folder exchanges it, and the file, for links to the user's."""
    results.write("secret", "old")
    used = getattr(os, when)
    folder = results.path

    def exchanged(path, *arguments, **options):
        if "secret" in str(path) and folder.is_dir() and not folder.is_symlink():
            folder.rename(tmp_path / "moved")
            folder.symlink_to(tmp_path)
            if when != "replace":
                (tmp_path / "moved" / "secret").unlink()
                (tmp_path / "moved" / "secret").symlink_to(tmp_path / "secret")
        return used(path, *arguments, **options)

    monkeypatch.setattr(os, when, exchanged)
    with suppress(FileContentError):
        results.write("secret", "new")
    assert (tmp_path / "secret").read_text() == "of the user"
    assert (tmp_path / "moved").is_dir()
    with suppress(FileContentError), results.opened("secret") as file:
        assert file.read() != b"of the user"


def test_a_file_of_a_folder_keeps_its_mode_and_is_whole_or_as_it_was(results, monkeypatch):
    path = results.write("a.csv", "old")
    path.chmod(0o640)
    if os.getuid() == 0:
        os.chown(path, 1234, 4321)
    before = path.stat()
    results.write("a.csv", "new")
    after = path.stat()
    assert (path.read_text(), after.st_mode, after.st_uid) == ("new", before.st_mode, before.st_uid)
    with pytest.raises(TypeError), results.written("a.csv") as file:
        file.writelines([b"half", "a text"])
    done = []
    monkeypatch.setattr(os, "fsync", lambda handle: done.append(os.fstat(handle).st_size))
    results.write("b.csv", "four")
    assert done == [4]

    def full(_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left on device") as caught:
        results.write("a.csv", "newer")
    assert caught.value.filename == str(path)
    assert path.read_text() == "new"
    assert sorted(results.entries()) == ["a.csv", "b.csv"]


def test_a_file_name_that_is_nearly_right_is_proposed(tmp_path):
    (tmp_path / "two_bars.uff").write_text("x")
    (tmp_path / "two_bar\x1b[31m.uff").write_text("characters that a terminal interprets are not proposed")
    with pytest.raises(FileNotFoundError, match=r"there is no file .*two_bar\.uff; did you mean two_bars\.uff\?"):
        check_file(tmp_path / "two_bar.uff")
    with pytest.raises(FileNotFoundError, match=r"there is no file \S*other\.npz$"):
        check_file(tmp_path / "other.npz")
