"""Packages that only some commands need."""

from __future__ import annotations

import importlib.util

__all__ = ["check_installed"]


def check_installed(*packages: str) -> None:
    """Check that packages for reports and figures are there, before anything is computed.

    Raises
    ------
    RuntimeError
        One is missing.
    """
    missing = [name for name in packages if importlib.util.find_spec(name) is None]
    if missing:
        raise RuntimeError(f"{' and '.join(missing)} missing: reports and figures need pip install 'jointfrf[report]'")
