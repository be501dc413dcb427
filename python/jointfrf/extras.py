"""Packages that only some tasks need, and how to install them."""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any

__all__ = ["MissingPackageError", "check_extras", "extra_of", "import_extra"]

#: What each package is for, and the extra of the installation that brings it.
_EXTRAS = {
    "h5py": ("HDF5 files (MATLAB 7.3 among them)", "hdf5"),
    "jinja2": ("reports", "report"),
    "matplotlib": ("figures", "plot"),
    "mumps": ("factors by MUMPS", "mumps"),
    "ansys": (".full files of Ansys", "ansys"),
    "pyyeti": ("OUTPUT2 and OUTPUT4 files of Nastran", "nastran"),
    "pymetis": ("orders of elimination by METIS", "metis"),
    "pypardiso": ("factors by PARDISO", "pardiso"),
    "pyarrow": ("Parquet files", "parquet"),
    "zarr": ("Zarr arrays", "zarr"),
    "loky": ("processes of loky", "loky"),
    "distributed": ("Dask clusters", "dask"),
    "mpi4py": ("MPI pools", "mpi"),
    "shtab": ("completions for shells", "completion"),
}


class MissingPackageError(ImportError):
    """A package that only some tasks need is not installed; the message says how to install it."""


def import_extra(module: str) -> Any:
    """Import a package, or a module of it, that is no requirement of the installation.

    Parameters
    ----------
    module : str
        Such as ``h5py`` or ``matplotlib.figure``.

    Returns
    -------
    module

    Raises
    ------
    MissingPackageError
        The package is not installed; the message says how to install it.
    """
    import numpy as np

    package = module.partition(".")[0]
    try:
        with np.printoptions():  # pyYeti sets how arrays print, also those of the program that reads a file by it
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
        except ValueError:  # its entry of sys.modules is no module
            is_found = False
        if not is_found:
            raise _missing(package)


def extra_of(package: str) -> str:
    """Return the extra of the installation that brings a package."""
    return _EXTRAS[package][1]


def _missing(package: str) -> MissingPackageError:
    what, extra = _EXTRAS[package]
    return MissingPackageError(f"{what} need the package {package}: pip install 'jointfrf[{extra}]'", name=package)
