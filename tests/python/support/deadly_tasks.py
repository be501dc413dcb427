"""Tasks that end their process, for tests of executors; they stand here so that other processes find them."""

import os
import signal
import time
from pathlib import Path

import numpy as np

import jointfrf as jf
from studied_case import broken_off


def note(folder: Path, task: int, is_deadly: bool) -> int:
    """Leave a file for each time a task begins; a deadly one kills its process the first time."""
    (folder / f"{task}-{time.monotonic_ns()}").touch()
    if is_deadly and len(list(folder.glob(f"{task}-*"))) == 1:
        kill_this_process()
    return os.getpid()


def note_each(task: tuple[Path, int, bool]) -> int:
    """The same with one argument."""
    return note(*task)


def kill_this_process(_: object = None) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


#: Variable of the environment that says where processes leave their marks.
MARKS = "JOINTFRF_TEST_MARKS"
#: The call at which a process ends.
_DEADLY_CALL = 3


def pass_or_die(marks: Path) -> None:
    """Count the calls of all processes; the one with the deadly number ends its process, later ones do not."""
    for call in range(1, _DEADLY_CALL + 1):
        try:
            (marks / str(call)).touch(exist_ok=False)
        except FileExistsError:
            continue
        if call == _DEADLY_CALL:
            kill_this_process()
        return


def deadly_estimator(freq_hz: np.ndarray, gamma: np.ndarray, dofs: tuple[str, ...]) -> np.ndarray:
    """An estimator for studies; one call ends its process."""
    pass_or_die(Path(os.environ[MARKS]))
    return broken_off(freq_hz, gamma, dofs)


def deadly_inverse(a: np.ndarray, marks: Path) -> np.ndarray:
    """An operation for sweeps; one call ends its process."""
    pass_or_die(marks)
    return jf.invert(a)
