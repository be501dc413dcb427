"""What a Universal File without FRFs holds, in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

__all__ = ["contents_without_frf"]

_DATASETS = {
    15: "nodes",
    18: "coordinate systems",
    55: "data at nodes",
    82: "trace lines",
    151: "header",
    164: "units",
    1858: "qualifiers of dataset 58",
    2400: "model header",
    2411: "nodes",
    2412: "elements",
    2414: "analysis data",
    2420: "coordinate systems",
    2429: "groups",
    2467: "groups",
}
_FUNCTIONS = {
    1: ("time history", "time histories"),
    2: ("auto spectrum", "auto spectra"),
    3: ("cross spectrum", "cross spectra"),
    5: ("transmissibility", "transmissibilities"),
    6: ("coherence", "coherences"),
    7: ("auto correlation", "auto correlations"),
    8: ("cross correlation", "cross correlations"),
    9: ("power spectral density", "power spectral densities"),
    12: ("spectrum", "spectra"),
    25: ("impulse response", "impulse responses"),
    26: ("multiple coherence", "multiple coherences"),
    27: ("order function", "order functions"),
}
_OTHER_FUNCTION = ("function of another kind", "functions of another kind")


def contents_without_frf(types: Iterable[int], functions: Counter[int]) -> str:
    """Say what a file without FRFs holds, by the types of its datasets and the functions of dataset 58."""
    if functions:
        held = ", ".join(f"{_count(n, kind)} (dataset 58, function type {kind})" for kind, n in functions.items())
        return f"{held} and no FRF"
    kinds = [f"{kind} ({_DATASETS[kind]})" if kind in _DATASETS else str(kind) for kind in sorted(set(types))]
    return f"dataset{'s' if len(kinds) > 1 else ''} {', '.join(kinds)} and no FRF (dataset 58, function type 4)"


def _count(n: int, function_type: int) -> str:
    singular, plural = _FUNCTIONS.get(function_type, _OTHER_FUNCTION)
    return f"{n} {singular if n == 1 else plural}"
