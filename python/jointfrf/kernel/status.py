"""How each line of a sweep went: bad lines become exceptions, poor conditions a warning."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from jointfrf.errors import IllConditionedWarning, SingularLineError
from jointfrf.kernel.arguments import FloatArray, check_choice

__all__ = ["RCOND_LIMIT", "LineStatus", "OnSingular", "check_lines", "check_status"]

OnSingular = Literal["raise", "nan"]

#: Below this reciprocal condition number (1-norm) a result is called ill-conditioned: fewer than four digits may be
#: left.
RCOND_LIMIT = 1e-12

_LINE_NOT_FINITE = -1
_LINE_OVERFLOW = -2


class LineStatus(NamedTuple):
    """How each line of a sweep went.

    Attributes
    ----------
    line_info : ndarray of int32, shape (n_freq,)
        0 good; > 0 singular (LAPACK's INFO); -1 NaN or Inf in the line; -2 its result overflows.
    rcond : ndarray, shape (n_freq,)
        Reciprocal condition number of the worst matrix inverted; 0 in a bad line. In the 1-norm of the stored matrix
        with |re| + |im| for the modulus, within a factor 2; an estimate where the fast engines solve.
    """

    line_info: NDArray[np.int32]
    rcond: FloatArray

    @property
    def lowest_rcond(self) -> float:
        """The lowest reciprocal condition number; 1 where there are no lines."""
        return self.rcond.item(self.rcond.argmin()) if self.rcond.size else 1.0


def _line_names(lines: NDArray[np.intp], freq_hz: FloatArray | None) -> str:
    """Return the first few lines in words."""
    some = [f"line {i}" + (f" ({freq_hz[i]:g} Hz)" if freq_hz is not None else "") for i in lines[:3]]
    more = f" and {lines.size - 3} more" if lines.size > 3 else ""
    return ", ".join(some) + more


def check_status(
    routine: str,
    status: LineStatus,
    n_bad: int,
    sweeps: Mapping[str, NDArray[Any]],
    freq_hz: FloatArray | None,
    on_singular: OnSingular,
    rcond_limit: float,
) -> None:
    """Turn bad lines into exceptions and poor conditions into a warning."""
    info = status.line_info
    if n_bad and on_singular == "raise":
        broken = np.flatnonzero(info == _LINE_NOT_FINITE)
        if broken.size:
            line = broken[0]
            names = [name for name, sweep in sweeps.items() if not np.isfinite(sweep[line]).all()]
            raise ValueError(f"{' and '.join(names) or routine}: NaN or Inf in {_line_names(broken, freq_hz)}")
        overflow = np.flatnonzero(info == _LINE_OVERFLOW)
        if overflow.size:
            raise OverflowError(f"{routine}: the result overflows in {_line_names(overflow, freq_hz)}")
        singular = np.flatnonzero(info > 0)
        raise SingularLineError(
            f"{routine}: singular matrix in {_line_names(singular, freq_hz)}",
            singular,
            None if freq_hz is None else freq_hz[singular],
        )
    if not n_bad and (rcond_limit <= 0 or status.lowest_rcond >= rcond_limit):
        return
    poor = np.flatnonzero((status.rcond < rcond_limit) & (info == 0))
    if poor.size:
        worst = poor[np.argmin(status.rcond[poor])]
        warnings.warn(
            f"{routine}: {poor.size} of {info.size} lines are ill-conditioned, worst "
            f"{_line_names(np.array([worst]), freq_hz)} with rcond {status.rcond[worst]:.1e}",
            IllConditionedWarning,
            stacklevel=4,
        )


def check_lines(
    routine: str,
    status: LineStatus,
    sweeps: Mapping[str, NDArray[Any]],
    freq_hz: FloatArray | None,
    on_singular: OnSingular,
    rcond_limit: float = 0.0,
) -> None:
    """Turn bad lines into exceptions and, below a limit, poor conditions into a warning."""
    check_choice("on_singular", on_singular, get_args(OnSingular))
    if status.line_info.size:
        n_bad = int((status.line_info != 0).sum())
        check_status(routine, status, n_bad, sweeps, freq_hz, on_singular, rcond_limit)
