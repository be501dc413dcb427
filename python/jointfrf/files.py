"""Files: their first bytes, limits of reading, and writing whole or not at all."""

from __future__ import annotations

import errno
import os
import re
import secrets
import shutil
import stat
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from jointfrf.errors import FileContentError, first_line
from jointfrf.spelling import did_you_mean

__all__ = [
    "HEAD",
    "LIMIT_VARIABLE",
    "OwnFolder",
    "ReadLimit",
    "check_file",
    "check_stated",
    "clean_name",
    "damage_named",
    "head_of",
    "text_of",
    "write_file",
    "written_whole",
]

#: Number of bytes of a file that show its format: the largest header is HDF5 after a block of 4 kB.
HEAD = 1 << 13
#: Environment variable with another limit, GB.
LIMIT_VARIABLE = "JOINTFRF_FILE_LIMIT_GB"
#: Limits without it: the largest file, GB, about the memory of a workstation; and the memory of its content, which is
#: the larger of this many GB and this multiple of the size of the file, which compressed FRFs may take.
_LARGEST, _SMALL, _TIMES = 16.0, 1.0, 10
#: Least number of bytes of each array, group or cell, because a file may consist of millions of empty ones.
_LEAST = 10_000
#: Number of files of a folder among which a name is searched.
_LISTED = 10_000
#: Characters with a meaning to some file system, shell or page, and the longest name.
_UNUSUAL, _LONGEST = re.compile(r"[^\w+,=.-]", re.ASCII), 100
#: Names of devices on Windows, in every folder and with any suffix: data written to them are lost.
_DEVICE = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.ASCII | re.IGNORECASE)
#: Folders with names of open files, which cannot be replaced.
_OPEN_FILES = "/proc/"
#: Errors of readers of numpy, scipy and h5py for a damaged file.
_DAMAGE = (OSError, ValueError, KeyError, TypeError, EOFError, RuntimeError, OverflowError, MemoryError)
#: Number of links to links that are followed, as in Linux.
_MOST_LINKS = 40


def _limit_gb(given: float | None) -> float | None:
    """Return the limit given by a keyword or by the environment."""
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


#: End of a message about the limit.
_RAISED = f"raise this limit by limit_gb=, --limit-gb or the environment variable {LIMIT_VARIABLE}"


class ReadLimit:
    """Limit of memory for the content of one file: a few kB can decompress to more than a machine has.

    Parameters
    ----------
    path : Path
        Name of an existing file.
    gb : float, optional
        Limit, GB. By default the environment variable JOINTFRF_FILE_LIMIT_GB; without it the larger of 1 GB and 10
        times the size of the file.
    """

    def __init__(self, path: Path, gb: float | None = None) -> None:
        limit = _limit_gb(gb)
        self._path = path
        self.bytes = max(_SMALL * 1e9, _TIMES * path.stat().st_size) if limit is None else 1e9 * limit
        self._taken = 0

    def take(self, size: int) -> None:
        """Count memory before it is used.

        Parameters
        ----------
        size : int
            Number of bytes.

        Raises
        ------
        FileContentError
            The sum exceeds the limit.
        """
        self._taken += max(size, _LEAST)
        if self._taken > self.bytes:
            raise FileContentError(
                f"{self._path} states content of {self._taken / 1e9:.3g} GB or more, beyond the "
                f"{self.bytes / 1e9:.3g} GB that a file may take; {_RAISED}"
            )


def check_stated(what: str, size: float) -> None:
    """Check the memory that a number in a small file requires, before the number is used.

    Parameters
    ----------
    what : str
        File and number, for the message: ``case.toml: elements = 1000000``.
    size : float
        Number of bytes.

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


def _near_name(path: Path) -> str:
    """Return the end of a sentence that proposes a file of the same folder with a similar name."""
    try:
        listed = islice(path.parent.iterdir(), _LISTED)
        known = [one.name for one in listed if one.name.isprintable() and one.is_file()]
    except OSError:
        return ""
    return did_you_mean(path.name, known)


def check_file(path: Path, limit_gb: float | None = None) -> None:
    """Check that a file is a regular file, and not larger than memory usually is.

    Parameters
    ----------
    path : Path
        Name of the file.
    limit_gb : float, optional
        Limit, GB; see `ReadLimit`.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        It is a folder, a pipe or a device, or larger than 16 GB, or than the given limit.
    """
    if not path.exists():
        raise FileNotFoundError("\\n".join(f"there is no file {path}{_near_name(path)}".splitlines()))
    if path.is_dir():
        raise FileContentError(f"{path} is a folder; name a file")
    if not path.is_file():
        # Opening a pipe waits for a writer; a device has no end.
        raise FileContentError(f"{path} is a pipe or a device, not a file; save its content and name that file")
    _check_size(path, path.stat().st_size, limit_gb)


def _check_size(path: Path, size_bytes: int, limit_gb: float | None = None) -> None:
    limit, size = _limit_gb(limit_gb) or _LARGEST, size_bytes / 1e9
    if size > limit:
        raise FileContentError(f"{path} has {size:.3g} GB, more than the {limit:.3g} GB that are read; {_RAISED}")


def head_of(path: Path, limit_gb: float | None = None) -> bytes:
    """Return the first bytes of a file that is not empty.

    Parameters
    ----------
    path : Path
        Name of the file.
    limit_gb : float, optional
        Limit, GB; see `check_file`.

    Returns
    -------
    bytes
        First bytes, `HEAD` of them or all.

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
    """Turn errors of libraries for a damaged file into one sentence that names the file.

    Parameters
    ----------
    path : Path
        Name of the file.
    kind : str
        Kind of the file with its article: ``an NPZ file``.
    *others : type
        Errors for this kind of file, in addition to errors of readers of any kind.

    Raises
    ------
    FileContentError
        The block raised one of these errors.
    """
    try:
        yield
    except FileContentError:
        raise
    except _DAMAGE + others as error:
        raise FileContentError(f"{path} cannot be read as {kind}: {first_line(error)}; write it again") from error


def text_of(path: Path) -> str:
    """Return the text of a file: UTF-16 if it begins so, else UTF-8, else Latin-1, in which older programs write units.

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


def clean_name(name: str, suffix: str = "") -> str:
    """Return the name of a file for a text of unknown origin.

    Parameters
    ----------
    name : str
        Text. Replaced are unusual characters (all except letters and digits of ASCII and ``_+,=.-``), a point at the
        beginning, the end of a long name and names of devices on Windows. A checksum is then added, so that two names
        stay different.
    suffix : str
        Suffix of the file, with its point.

    Returns
    -------
    str
        Name without folders.

    Examples
    --------
    >>> clean_name("k-theta"), clean_name("../../x", ".png"), clean_name("nul")
    ('k-theta', '_._.._x-422533a8.png', '_ul-ab449ff8')
    """
    clean = _UNUSUAL.sub("_", name)[:_LONGEST]
    clean = f"_{clean[1:]}" if clean[:1] in ("", ".", "-") or _DEVICE.fullmatch(clean) else clean
    if clean != name:
        clean += f"-{zlib.crc32(name.encode('utf-8', 'surrogatepass')):08x}"
    return f"{clean}{suffix}"


#: Flags of `os.open` on this system: a link is not followed, a pipe is not waited for.
_READ = sum(getattr(os, name, 0) for name in ("O_RDONLY", "O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_BINARY"))
_CREATE = sum(getattr(os, name, 0) for name in ("O_WRONLY", "O_CREAT", "O_EXCL", "O_NOFOLLOW", "O_CLOEXEC", "O_BINARY"))
_FOLDER = sum(getattr(os, name, 0) for name in ("O_RDONLY", "O_DIRECTORY", "O_CLOEXEC"))
#: Whether files are opened relative to an open folder, which cannot be exchanged for a link meanwhile.
_HAS_PLACES = os.open in os.supports_dir_fd and os.rename in os.supports_dir_fd


@dataclass(frozen=True)
class OwnFolder:
    """A folder of results of unknown origin: no link in it is followed, for reading or writing.

    Attributes
    ----------
    base : Path
        Folder that the user named; it may be a link.
    inner : tuple of str
        Folders in it, each in the previous one; none of them may be a link.
    """

    base: Path
    inner: tuple[str, ...] = ()

    def __truediv__(self, name: str) -> OwnFolder:
        """Return a folder in this one."""
        return OwnFolder(self.base, (*self.inner, name))

    @property
    def path(self) -> Path:
        """Path for messages; opening it follows links."""
        return self.base.joinpath(*self.inner)

    def make(self) -> OwnFolder:
        """Make the folder, unless it exists, and return it.

        Raises
        ------
        FileContentError
            It, or a folder between it and `base`, is a link or no folder.
        """
        self.base.mkdir(parents=True, exist_ok=True)
        for depth in range(len(self.inner)):
            outer, name = OwnFolder(self.base, self.inner[:depth]), self.inner[depth]
            with outer._entered() as place, _named(outer.path / name, name), suppress(FileExistsError):
                os.mkdir(outer._at(place, name), dir_fd=place)
        self.check()
        return self

    def check(self) -> None:
        """Raise a FileContentError if it, or a folder between it and `base`, is a link or no folder."""
        with suppress(FileNotFoundError), self._entered():
            pass

    def entries(self) -> dict[str, os.stat_result]:
        """Return the names in the folder, with the status of each or of the link; none if there is no such folder."""
        with (
            suppress(FileNotFoundError),
            self._entered() as place,
            os.scandir(self.path if place is None else place) as found,
        ):
            return {one.name: one.stat(follow_symlinks=False) for one in found}
        return {}

    @contextmanager
    def opened(self, name: str) -> Iterator[BinaryIO]:
        """Open a file for reading.

        Raises
        ------
        FileContentError
            It is a link, a folder, a pipe or a device, or larger than `check_file` allows.
        FileNotFoundError
            There is no such file.
        """
        path = self.path / name
        with self._entered() as place:
            with _named(path, name):
                self._status(place, name)
                handle = os.open(self._at(place, name), _READ, dir_fd=place)
            with os.fdopen(handle, "rb") as file:
                status = os.fstat(handle)
                _check_own(path, status)
                _check_size(path, status.st_size)
                yield file

    @contextmanager
    def written(self, name: str) -> Iterator[BinaryIO]:
        """Yield a new file to write into, and move it to its place at the end, like `written_whole`.

        Raises
        ------
        FileContentError
            A link, a folder, a pipe or a device is in its place.
        OSError
            The file cannot be written; nothing is left behind.
        """
        path, temporary = self.path / name, _temporary_name(self.path, name)
        with self._entered() as place, _named(path, name, temporary):
            try:
                older = self._status(place, name)
            except FileNotFoundError:
                older = None
            mode = 0o600 if older is not None else 0o666
            handle = os.open(self._at(place, temporary), _CREATE, mode, dir_fd=place)
            try:
                with os.fdopen(handle, "wb") as file:
                    yield file
                    file.flush()
                    os.fsync(handle)
                    if older is not None:
                        _keep(self.path / temporary if place is None else handle, older)
                at = self._at(place, temporary), self._at(place, name)
                os.replace(*at, src_dir_fd=place, dst_dir_fd=place)
            except BaseException:
                with suppress(FileNotFoundError):
                    os.unlink(self._at(place, temporary), dir_fd=place)
                raise

    def write(self, name: str, content: str | bytes) -> Path:
        """Write a file whole or not at all, text as UTF-8, and return its path; errors as in `written`."""
        with self.written(name) as file:
            file.write(content.encode("utf-8") if isinstance(content, str) else content)
        return self.path / name

    @contextmanager
    def _entered(self) -> Iterator[int | None]:
        """Open the folder, each part in the previous one; None if the system opens nothing relative to a folder."""
        if not _HAS_PLACES:
            for depth in range(len(self.inner)):
                part = self.base.joinpath(*self.inner[: depth + 1])
                if part.is_symlink() or not part.is_dir():
                    part.lstat()
                    raise _not_own(part, "a link or no folder", "a folder")
            yield None
            return
        with _named(self.base, str(self.base)):
            place = os.open(self.base, _FOLDER)
        try:
            for depth, part_name in enumerate(self.inner):
                part = self.base.joinpath(*self.inner[: depth + 1])
                try:
                    with _named(part, part_name):
                        inner = os.open(part_name, _FOLDER | os.O_NOFOLLOW, dir_fd=place)
                except OSError as error:
                    if error.errno in (errno.ELOOP, errno.ENOTDIR):
                        raise _not_own(part, "a link or no folder", "a folder") from error
                    raise
                os.close(place)
                place = inner
            yield place
        finally:
            os.close(place)

    def _at(self, place: int | None, name: str) -> str:
        """Return the name of an entry of the folder for functions of `os`."""
        if not name or Path(name).name != name:
            raise ValueError(f"{name!r} is not a name: make one by clean_name")
        return name if place is not None else str(self.path / name)

    def _status(self, place: int | None, name: str) -> os.stat_result:
        status = os.stat(self._at(place, name), dir_fd=place, follow_symlinks=False)
        _check_own(self.path / name, status)
        return status


@contextmanager
def _named(path: Path, *names: str) -> Iterator[None]:
    """Make errors of the system that name nothing, or one of these names, name this path."""
    try:
        yield
    except OSError as error:
        if error.errno is None or error.filename not in (None, *names):
            raise
        raise type(error)(error.errno, error.strerror, str(path)) from error


def _check_own(path: Path, status: os.stat_result) -> None:
    if not stat.S_ISREG(status.st_mode):
        is_folder, is_link = stat.S_ISDIR(status.st_mode), stat.S_ISLNK(status.st_mode)
        raise _not_own(path, "a link" if is_link else "a folder" if is_folder else "a pipe or a device", "a file")


def _not_own(path: Path, kind: str, wanted: str) -> FileContentError:
    return FileContentError(f"{path} is {kind}, not {wanted}; remove it, because nothing is read or written there")


def write_file(path: Path, content: str | bytes) -> None:
    """Write a file whole or not at all: a reader finds the old one or the new one, never a part.

    Parameters
    ----------
    path : Path
        Name of the file; see `written_whole`.
    content : str or bytes
        Content; text is written as UTF-8.

    Raises
    ------
    OSError
        The file cannot be written; nothing is left behind.
    """
    with written_whole(path) as temporary:
        temporary.write_bytes(content.encode("utf-8") if isinstance(content, str) else content)


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Yield a temporary name in the folder of a file, and move it to the file at the end.

    Parameters
    ----------
    path : Path
        Name of the file, in a folder that exists. For a link, the target is replaced. The new file gets mode and owner
        of an older one. A device or a pipe is not replaced: all is written into it at the end.

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
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
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
            _keep(temporary, older)  # at the end, because its owner may not be able to open the file
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
    """Return the target of links, except for links of open files, which name no place."""
    for _ in range(_MOST_LINKS):
        if not path.is_symlink() or path.parent.resolve().as_posix().startswith(_OPEN_FILES):
            return path
        path = path.parent / path.readlink()
    raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))


def _created(folder: Path, name: str, *, private: bool) -> Path:
    """Create a file of a new name; the mask of the process, or the folder, determines its mode."""
    path = folder / _temporary_name(folder, name)
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600 if private else 0o666))
    return path


def _temporary_name(folder: Path, name: str) -> str:
    """Return a new name for a file that will be called `name`, within the limit of the file system."""
    try:
        longest = os.pathconf(folder, "PC_NAME_MAX")
    except (AttributeError, OSError, ValueError):
        longest = 255
    end = f".{secrets.token_hex(8)}"
    while len(os.fsencode(name)) + len(end) + 1 > longest:
        name = name[:-1]
    return f".{name}{end}"


def _keep(path: Path | int, older: os.stat_result) -> None:
    """Copy owner and mode of an older file to a file, or an open one; without permission, its group or mode."""
    mode = stat.S_IMODE(older.st_mode)
    if hasattr(os, "chown"):
        for owner in (older.st_uid, -1):
            with suppress(PermissionError):
                os.chown(path, owner, older.st_gid)
                break
    own = os.stat(path)
    if (own.st_uid, own.st_gid) != (older.st_uid, older.st_gid):
        mode &= 0o777  # setuid and setgid are not passed on to another owner
    os.chmod(path, mode)
