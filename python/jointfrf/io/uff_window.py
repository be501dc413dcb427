"""Windows that dataset 1858 of Universal Files, the qualifiers of dataset 58, states."""

from __future__ import annotations

from jointfrf.io.uff_file import UniversalFile

__all__ = ["note_exponential_windows"]

#: Window types of record 2 with an exponential window: exponential; impact and exponential.
_EXPONENTIAL = (4, 6)
#: Columns of the window type in record 2 (12I6), and of the damping factor in record 4 (1P5E15.7).
_TYPE, _FACTOR = slice(6, 12), slice(60, 75)


def note_exponential_windows(file: UniversalFile) -> None:
    """Note exponential windows in the file; the definition does not state the unit of their damping factor."""
    for number in file.datasets(1858):
        records = [*file.records(number), *[""] * 4]
        try:
            kind, factor = int(records[1][_TYPE].strip() or 0), float(records[3][_FACTOR].strip() or 0)
        except ValueError:
            file.note("qualifiers of dataset 58 that are not understood: no window is read from them", number)
            continue
        if kind in _EXPONENTIAL or factor > 0:
            stated = f"with damping factor {factor:g}" if factor > 0 else "without its damping factor"
            file.note(f"the FRFs have an exponential window {stated}: give its decay in 1/s as window_decay", number)
