"""Files: their first bytes, limits of reading, and writing whole or not at all."""

from __future__ import annotations

import os
import re
import secrets
import shutil
import stat
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from jointfrf.errors import FileContentError, first_line

__all__ = [
    "HEAD",
    "LIMIT_VARIABLE",
    "ReadLimit",
    "below",
    "check_file",
    "check_stated",
    "damage_named",
    "head_of",
    "text_of",
    "write_file",
    "written_whole",
]

#: Bytes of a file that show its format: the largest header is that of HDF5 after a block of 4 kB.
HEAD = 1 << 13
#: Says another limit, GB.
LIMIT_VARIABLE = "JOINTFRF_FILE_LIMIT_GB"
#: Without one: the largest file, GB, about the memory of a workstation; and the memory of its content: GB that
#: every machine has, or so many times the size of the file, as compressed FRFs may take, whichever is more.
_LARGEST, _SMALL, _TIMES = 16.0, 1.0, 10
#: Bytes that each array, group or cell counts at least: a file may consist of millions of empty ones.
_LEAST = 10_000
#: Characters that have a meaning to some file system, shell or page, and the longest name.
_UNUSUAL, _LONGEST = re.compile(r"[^\w+,=.-]", re.ASCII), 100
#: Where names are those of open files, which cannot be replaced.
_OPEN_FILES = "/proc/"
#: What readers of numpy, scipy and h5py raise for a damaged file.
_DAMAGE = (OSError, ValueError, KeyError, TypeError, EOFError, RuntimeError, OverflowError, MemoryError)
#: Links to links that are followed, as many as Linux does.
_MOST_LINKS = 40


def _limit_gb(given: float | None) -> float | None:
    """Return the limit that was asked for, by a keyword or by the environment."""
    if given is not None:
        if not isinstance(given, int | float) or not given > 0:
            raise ValueError(f"limit_gb must be a number of GB above 0, not {given!r}")
        return float(given)
    word = os.environ.get(LIMIT_VARIABLE, "")
    if not word:
        return None
    try:
        limit = float(word)
    except ValueError:
        limit = -1.0
    if not limit > 0:
        raise FileContentError(f"the environment variable {LIMIT_VARIABLE} is {word!r}; set it to a number of GB")
    return limit


#: How a message about the limit ends.
_RAISED = f"raise this limit by limit_gb=, --limit-gb or the environment variable {LIMIT_VARIABLE}"


class ReadLimit:
    """The memory that the content of one file may take: a few kB can decompress to more than a machine has.

    Parameters
    ----------
    path : Path
        An existing file.
    gb : float, optional
        GB; the environment variable JOINTFRF_FILE_LIMIT_GB is used where it is not given. Without either 1 GB, or 10
        times the size of the file where that is more.
    """

    def __init__(self, path: Path, gb: float | None = None) -> None:
        limit = _limit_gb(gb)
        self._path = path
        self.bytes = max(_SMALL * 1e9, _TIMES * path.stat().st_size) if limit is None else 1e9 * limit
        self._taken = 0

    def take(self, size: int) -> None:
        """Count what is about to be read.

        Parameters
        ----------
        size : int
            Bytes.

        Raises
        ------
        FileContentError
            With all before it, it is more than the limit.
        """
        self._taken += max(size, _LEAST)
        if self._taken > self.bytes:
            raise FileContentError(
                f"{self._path} states content of {self._taken / 1e9:.3g} GB or more, beyond the "
                f"{self.bytes / 1e9:.3g} GB that a file may take; {_RAISED}"
            )


def check_stated(what: str, size: float) -> None:
    """Check the memory that a number in a small file asks for, before the number is used.

    Parameters
    ----------
    what : str
        File and number, for the message: ``case.toml: elements = 1000000``.
    size : float
        Bytes.

    Raises
    ------
    FileContentError
        It is more than the limit of `ReadLimit` for a small file.

    Examples
    --------
    >>> check_stated("part.toml: elements = 6", 6 * 2000)
    """
    limit = 1e9 * (_limit_gb(None) or _SMALL)
    if not size <= limit:
        raise FileContentError(
            f"{what} needs {size / 1e9:.3g} GB, beyond the {limit / 1e9:.3g} GB that a file may take; {_RAISED}"
        )


def check_file(path: Path, limit_gb: float | None = None) -> None:
    """Check that a file can be read to its end: that it is one, and not larger than memory is likely to hold.

    Parameters
    ----------
    path : Path
    limit_gb : float, optional
        GB; see `ReadLimit`.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        It is a folder, a pipe or a device, or larger than 16 GB, or than another limit where one is given.
    """
    if not path.exists():
        raise FileNotFoundError("\\n".join(f"there is no file {path}".splitlines()))
    if path.is_dir():
        raise FileContentError(f"{path} is a folder; name a file")
    if not path.is_file():
        # Opening a pipe waits for a writer; a device has no end.
        raise FileContentError(f"{path} is a pipe or a device, not a file; save its content and name that file")
    limit, size = _limit_gb(limit_gb) or _LARGEST, path.stat().st_size / 1e9
    if size > limit:
        raise FileContentError(f"{path} has {size:.3g} GB, more than the {limit:.3g} GB that are read; {_RAISED}")


def head_of(path: Path, limit_gb: float | None = None) -> bytes:
    """Return the first bytes of a file that holds something.

    Parameters
    ----------
    path : Path
    limit_gb : float, optional
        As in `check_file`.

    Returns
    -------
    bytes
        `HEAD` of them, or all there are.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        It is a folder, a pipe or a device, cannot be read, or is empty.
    """
    check_file(path, limit_gb)
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError as error:
        raise FileContentError(f"{path} cannot be read: {error.strerror}") from error
    if not head.strip() and path.stat().st_size <= HEAD:
        raise FileContentError(f"{path} is empty")
    return head


@contextmanager
def damage_named(path: Path, kind: str, *others: type[Exception]) -> Iterator[None]:
    """Turn what libraries raise for a damaged file into one sentence that names the file.

    Parameters
    ----------
    path : Path
    kind : str
        With its article: ``an NPZ file``.
    *others : type
        Errors of this kind of file, beside those that readers of any kind raise.

    Raises
    ------
    FileContentError
    """
    try:
        yield
    except FileContentError:
        raise
    except _DAMAGE + others as error:
        raise FileContentError(f"{path} cannot be read as {kind}: {first_line(error)}; write it again") from error


def text_of(path: Path) -> str:
    """Return the text of a file: UTF-16 where it begins so, else UTF-8, else Latin-1, as older programs write units.

    Raises
    ------
    FileContentError
        There is no such file, it cannot be read, or it is not a text file.
    """
    if path.exists():
        check_file(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise FileContentError(f"{path} cannot be read: {error.strerror}") from error
    is_wide = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    try:
        return content.decode("utf-16" if is_wide else "utf-8-sig")
    except UnicodeDecodeError as error:
        if is_wide or b"\0" in content:
            raise FileContentError(f"{path} is not a text file; save text in UTF-8") from error
        return content.decode("latin-1")


def below(folder: Path, name: str, suffix: str = "") -> Path:
    """Return the path of a file in a folder, by a name that may come from a stranger.

    Parameters
    ----------
    folder : Path
    name : str
        Where it has characters that are unusual in names of files (all but letters and digits of ASCII and ``_+,=.-``),
        begins with a point or is long, these are replaced and a checksum is added, so that two names stay two.
    suffix : str
        Of the file, with its point.

    Returns
    -------
    Path
        Directly in the folder.

    Raises
    ------
    FileContentError
        There is a link of this name which leads out of the folder.

    Examples
    --------
    >>> below(Path("figures"), "k-theta").as_posix(), below(Path("figures"), "../../x", ".png").as_posix()
    ('figures/k-theta', 'figures/_._.._x-422533a8.png')
    """
    clean = _UNUSUAL.sub("_", name)[:_LONGEST]
    clean = f"_{clean[1:]}" if clean[:1] in ("", ".", "-") else clean
    if clean != name:
        clean += f"-{zlib.crc32(name.encode('utf-8', 'surrogatepass')):08x}"
    path = folder / f"{clean}{suffix}"
    if path.resolve().parent != folder.resolve():
        raise FileContentError(f"{path} is a link out of its folder, to which nothing is written; remove it")
    return path


def write_file(path: Path, content: str | bytes) -> None:
    """Write a file beside its place and move it there: a reader finds the old one or the new one, never a part.

    Parameters
    ----------
    path : Path
        As for `written_whole`.
    content : str or bytes
        Text is written as UTF-8.

    Raises
    ------
    OSError
        The file cannot be written; nothing is left behind.
    """
    with written_whole(path) as temporary:
        temporary.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Give a place beside a file for what is written in chunks, and move it there at the end.

    Parameters
    ----------
    path : Path
        In a folder that exists. Where a link is, the file is replaced that it leads to. An older file leaves its mode
        and its owner to the new one. A device or a pipe is not replaced: all is written into it at the end.

    Raises
    ------
    OSError
        The file cannot be written; nothing is left behind. It names `path`.
    """
    target = _followed(path)
    older = _status(target)
    into = older is not None and not stat.S_ISREG(older.st_mode)
    into |= target.parent.resolve().as_posix().startswith(_OPEN_FILES)
    if into and target.is_dir():
        raise IsADirectoryError(21, os.strerror(21), str(path))
    temporary: Path | None = None
    try:
        folder = Path(tempfile.gettempdir()) if into else target.parent
        temporary = _created(folder, target.name, private=into or older is not None)
        yield temporary
        if into:
            with temporary.open("rb") as source, target.open("wb") as sink:
                shutil.copyfileobj(source, sink)
            temporary.unlink()
            return
        with temporary.open("r+b") as file:
            os.fsync(file.fileno())
        if older is not None:
            _keep(temporary, older)  # in the end: it may be a file that its owner cannot open
        temporary.replace(target)
    except BaseException as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        own = (None, str(temporary), str(target))
        if isinstance(error, OSError) and error.errno is not None and (temporary is None or error.filename in own):
            raise type(error)(error.errno, error.strerror, str(path)) from error
        raise


def _status(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except FileNotFoundError:
        return None


def _followed(path: Path) -> Path:
    """Follow links to the file that is meant; not those of open files, which name no place."""
    for _ in range(_MOST_LINKS):
        if not path.is_symlink() or path.parent.resolve().as_posix().startswith(_OPEN_FILES):
            return path
        path = path.parent / path.readlink()
    raise OSError(40, "too many levels of symbolic links", str(path))


def _created(folder: Path, name: str, *, private: bool) -> Path:
    """Create a file of a new name; the mask of the process, or what the folder says, gives its mode."""
    try:
        longest = os.pathconf(folder, "PC_NAME_MAX")
    except (AttributeError, OSError, ValueError):
        longest = 255
    end = f".{secrets.token_hex(8)}"
    while len(os.fsencode(name)) + len(end) + 1 > longest:
        name = name[:-1]
    path = folder / f".{name}{end}"
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600 if private else 0o666))
    return path


def _keep(path: Path, older: os.stat_result) -> None:
    """Give a file the owner and the mode of an older one; without the right to, its group, or only the mode."""
    mode = stat.S_IMODE(older.st_mode)
    if hasattr(os, "chown"):
        for owner in (older.st_uid, -1):
            with suppress(PermissionError):
                os.chown(path, owner, older.st_gid)
                break
    own = path.stat()
    if (own.st_uid, own.st_gid) != (older.st_uid, older.st_gid):
        mode &= 0o777  # setuid and setgid are not passed on to another owner
    path.chmod(mode)
