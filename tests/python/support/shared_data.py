"""Data for tests that are not part of the project: beside the repository, or above the place of a copy of it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

__all__ = ["shared_data"]

_ROOT = Path(__file__).resolve().parents[3]


def shared_data(*names: str) -> Path:
    """Return the path of a file or folder of these data; skip the test if there is none."""
    own = os.environ.get("JOINTFRF_TEST_DATA")
    places = [Path(own)] if own else [above / "shared" / "data" for above in _ROOT.parents]
    found = next((place.joinpath(*names) for place in places if place.joinpath(*names).exists()), None)
    if found is None:
        pytest.skip(f"no data {'/'.join(names)} (set JOINTFRF_TEST_DATA)")
    return found
