"""Files: how one begins, and writing whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from jointfrf.errors import FileContentError

__all__ = ["HEAD", "check_file", "head_of", "write_file", "written_whole"]

#: How much of a file shows what it is, bytes.
HEAD = 1 << 13
#: Files beyond this are not read, GB; the environment variable says another limit.
_LIMIT, _LIMIT_VARIABLE = 16.0, "JOINTFRF_FILE_LIMIT_GB"


def check_file(path: Path) -> None:
    """Check that a file can be read to its end: that it is one, and not larger than memory is likely to hold.

    Parameters
    ----------
    path : Path

    Raises
    ------
    FileNotFoundError
        There is no such file.
    FileContentError
        It is a folder, a pipe or a device, or larger than 16 GB. The environment variable JOINTFRF_FILE_LIMIT_GB takes
        another limit.
    """
    if not path.exists():
        raise FileNotFoundError("\\n".join(f"there is no file {path}".splitlines()))
    if path.is_dir():
        raise FileContentError(f"{path} is a folder, not a file")
    if not path.is_file():
        # Whoever opens a pipe waits for a writer; a device has no end.
        raise FileContentError(f"{path} is a pipe or a device, not a file: save what it gives first")
    word = os.environ.get(_LIMIT_VARIABLE, "")
    try:
        limit = float(word or _LIMIT)
    except ValueError:
        limit = -1.0
    if not limit > 0:
        raise FileContentError(f"the environment variable {_LIMIT_VARIABLE} is {word!r}: it must be a number of GB")
    size = path.stat().st_size / 1e9
    if size > limit:
        raise FileContentError(
            f"{path} has {size:.3g} GB, more than the {limit:.3g} GB that are read: the environment variable "
            f"{_LIMIT_VARIABLE} raises this limit"
        )


def head_of(path: Path) -> bytes:
    """Return the first bytes of a file that holds something.

    Parameters
    ----------
    path : Path

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
    check_file(path)
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
    except OSError as error:
        raise FileContentError(f"{path} cannot be read: {error.strerror}") from error
    if not head.strip() and path.stat().st_size <= HEAD:
        raise FileContentError(f"{path} is empty")
    return head


def write_file(path: Path, content: str | bytes) -> None:
    """Write a file beside its place and move it there: a reader finds the old one or the new one, never a part.

    Parameters
    ----------
    path : Path
        In a folder that exists.
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
    """Give a place beside a file for what is written piece by piece, and move it there at the end.

    Parameters
    ----------
    path : Path
        In a folder that exists.

    Raises
    ------
    OSError
        The file cannot be written; nothing is left behind.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    os.close(handle)
    temporary = Path(name)
    try:
        yield temporary
        # As an ordinary new file: mkstemp makes private ones.
        mask = os.umask(0)
        os.umask(mask)
        temporary.chmod(0o666 & ~mask)
        temporary.replace(path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
