"""Exceptions and warnings, each with one meaning."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from jointfrf.spelling import message

__all__ = [
    "ConvergenceWarning",
    "CopyWarning",
    "FileContentError",
    "FileContentWarning",
    "FrfCheckError",
    "FrfCheckWarning",
    "IdentificationWarning",
    "IllConditionedWarning",
    "SingularLineError",
    "first_line",
]


#: Largest number of characters of a message of another library that is repeated.
_LONGEST = 200


class SingularLineError(np.linalg.LinAlgError):
    """A matrix that had to be inverted is singular at some frequency lines.

    Attributes
    ----------
    lines : ndarray of int
        Numbers of the singular lines, counted from 0.
    freq_hz : ndarray of float or None
        Frequencies of the lines, Hz, if the caller gave them.
    """

    def __init__(self, message: str, lines: NDArray[np.intp], freq_hz: NDArray[np.float64] | None = None) -> None:
        super().__init__(message)
        self.lines = lines
        self.freq_hz = freq_hz

    def __reduce__(self) -> tuple[type[SingularLineError], tuple[object, ...]]:
        """Return the arguments that create it again in another process."""
        return type(self), (str(self), self.lines, self.freq_hz)


class FileContentError(ValueError):
    """A file cannot be read, or lacks something; one line of bounded length, for any name of the file."""

    def __init__(self, text: str) -> None:
        super().__init__(message(" ".join(text.splitlines())))


class FileContentWarning(UserWarning):
    """Something in a file was assumed or omitted; one line of bounded length, for any content of the file."""

    def __init__(self, text: str) -> None:
        super().__init__(message(" ".join(text.splitlines())))


class FrfCheckError(ValueError):
    """Measured FRFs are not usable as they are: the quantity, a sign, the time convention; see `check_frfs`."""


class FrfCheckWarning(UserWarning):
    """Measured FRFs look wrong: a channel, the quantity, the sign; see `jointfrf.check_frfs`."""


class IllConditionedWarning(UserWarning):
    """A result may have lost most of its digits: rcond is below `jointfrf.RCOND_LIMIT`."""


class CopyWarning(UserWarning):
    """A large array had to be copied because of its type or its order in memory."""


class IdentificationWarning(UserWarning):
    """A parameter is poorly determined, or the data do not fit the model of the joint."""


class ConvergenceWarning(UserWarning):
    """An iteration stopped before it converged."""


def first_line(error: BaseException) -> str:
    """Return the message of an error of another library in one line."""
    line = (str(error).strip().splitlines() or [type(error).__name__])[0]
    return line if len(line) <= _LONGEST else f"{line[:_LONGEST]}..."
