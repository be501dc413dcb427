"""Packages that only some tasks need, and how to install them; entry points of other packages."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

__all__ = ["MissingPackageError", "check_extras", "extra_of", "import_extra", "load_plugin", "plugin_call", "plugins"]

_T = TypeVar("_T")

#: Purpose of each package, and the extra of the installation that contains it.
_EXTRAS = {
    "h5py": ("HDF5 files (MATLAB 7.3 among them)", "hdf5"),
    "openpyxl": ("Excel workbooks", "xlsx"),
    "jinja2": ("reports", "report"),
    "matplotlib": ("figures", "plot"),
    "mumps": ("factors by MUMPS", "mumps"),
    "ansys": (".full files of Ansys", "ansys"),
    "pyyeti": ("OUTPUT2 and OUTPUT4 files of Nastran", "nastran"),
    "pymetis": ("orders of elimination by METIS", "metis"),
    "pypardiso": ("factors by PARDISO", "pardiso"),
    "pyarrow": ("Parquet files", "parquet"),
    "loky": ("processes of loky", "loky"),
    "mpi4py": ("MPI pools", "mpi"),
    "shtab": ("completions for shells", "completion"),
}


class MissingPackageError(ImportError):
    """A package that only some tasks need is not installed; the message states how to install it."""


def import_extra(module: str) -> Any:
    """Import a package, or a module of it, that is no requirement of the installation, and return it.

    Parameters
    ----------
    module : str
        Name, such as ``h5py`` or ``matplotlib.figure``.

    Returns
    -------
    module
        Imported module.

    Raises
    ------
    MissingPackageError
        The package is not installed; the message states how to install it.
    """
    package = module.partition(".")[0]
    try:
        # pyYeti changes how arrays print, also in the program that calls this function; numpy is imported by then.
        numpy = sys.modules.get("numpy")
        with nullcontext() if numpy is None else numpy.printoptions():
            return importlib.import_module(module)
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != package:
            raise
        raise _missing(package) from error


def check_extras(*packages: str) -> None:
    """Check that packages are installed, before anything is computed.

    Raises
    ------
    MissingPackageError
        One is missing.
    """
    for package in packages:
        try:
            is_found = importlib.util.find_spec(package) is not None
        except ValueError:  # the entry of sys.modules is no module
            is_found = False
        if not is_found:
            raise _missing(package)


def plugins(group: str) -> list[EntryPoint]:
    """Return the entry points of installed packages in a group, such as ``jointfrf.formats``; nothing is loaded."""
    from importlib.metadata import entry_points

    return sorted(entry_points(group=group), key=lambda entry: (entry.name, entry.value))


def load_plugin(entry: EntryPoint, is_right: Callable[[Any], bool], what: str) -> Any:
    """Return the object of a plugin, after importing its package.

    Raises
    ------
    FileContentError
        It cannot be loaded, or is not `what` it must be.
    """
    from jointfrf.errors import FileContentError  # imports numpy, which a command that only prints help does not need

    found = plugin_call(entry, lambda: entry.load())
    if not plugin_call(entry, lambda: is_right(found)):
        raise FileContentError(f"{_plugin(entry)} is not {what}")
    return found


def plugin_call(entry: EntryPoint, function: Callable[..., _T], *arguments: Any) -> _T:
    """Call a function of a plugin.

    Raises
    ------
    FileContentError
        It raised an error that is not about a file it was given or a missing package.
    """
    from jointfrf.errors import FileContentError, first_line

    try:
        return function(*arguments)
    except (FileContentError, MissingPackageError, MemoryError):
        raise
    except (Exception, SystemExit) as error:  # foreign code may raise any error
        if isinstance(error, OSError) and arguments:
            raise
        where = "".join(f"{one}: " for one in arguments if isinstance(one, Path))
        why = f"{type(error).__name__}: {first_line(error)}"
        raise FileContentError(f"{where}{_plugin(entry)} fails: {why}") from error


def _plugin(entry: EntryPoint) -> str:
    return f"the plugin {entry.name!r} ({entry.value}{f' of {entry.dist.name}' if entry.dist else ''})"


def extra_of(package: str) -> str:
    """Return the extra of the installation that contains a package."""
    return _EXTRAS[package][1]


def _missing(package: str) -> MissingPackageError:
    what, extra = _EXTRAS[package]
    return MissingPackageError(f"{what} need the package {package}: pip install 'jointfrf[{extra}]'", name=package)
