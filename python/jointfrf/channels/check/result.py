"""The result of a check of FRFs, and the corrections that it proposes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.messages.finding import Finding, messages_of

__all__ = ["Correction", "FrfCheck", "FrfFix", "corrected"]

#: What `fix` of `check_frfs` names.
FrfFix = Literal["lines", "time-convention", "exchanged", "quantity", "sign", "units", "gain", "delay"]


@dataclass(frozen=True, eq=False)
class FrfCheck:
    """Result of `check_frfs`.

    Attributes
    ----------
    findings : tuple of Finding
        Errors first, then warnings, then notes.
    freq_hz : ndarray, shape (n_freq,)
    h : ndarray, shape (n_freq, n_responses, n_forces)
        The FRFs as given, with the corrections that `fix` asked for.
    changes : tuple of str
        Corrections that were made.
    unseen : str
        Errors that no check of these FRFs can detect.
    """

    findings: tuple[Finding, ...]
    freq_hz: FloatArray
    h: ComplexArray
    changes: tuple[str, ...]
    unseen: str

    @property
    def ok(self) -> bool:
        """Whether all findings are notes."""
        return all(finding.severity == "note" for finding in self.findings)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Errors and warnings, as they are printed."""
        return messages_of(self.findings)

    def __str__(self) -> str:
        head = f"{self.h.shape[0]} lines, {self.h.shape[1]} responses x {self.h.shape[2]} forces"
        found = [str(finding) for finding in self.findings] or ["nothing found"]
        changed = [f"changed: {change}" for change in self.changes]
        return "\n".join([head, *found, *changed, f"not visible: {self.unseen}"])

    def to_dict(self) -> dict[str, Any]:
        """Return all but the FRFs, for JSON."""
        return {
            "ok": self.ok,
            "findings": [finding.to_dict() for finding in self.findings],
            "changes": list(self.changes),
            "not_visible": self.unseen,
        }


@dataclass(frozen=True)
class Correction:
    """One correction: rows or columns divided by factor (i w)^power exp(-i w delay), exchanged, or all conjugated.

    Attributes
    ----------
    fix : str
        The word of `fix` that asks for it.
    text : str
        Description of the change.
    axis : {1, 2}
        Responses or forces.
    places : tuple of int
        Which of them.
    factor, power, delay : float
    exchange, conjugate : bool
        Whether the two places are exchanged, or all FRFs conjugated, instead.
    """

    fix: FrfFix
    text: str
    axis: int = 1
    places: tuple[int, ...] = ()
    factor: float = 1.0
    power: int = 0
    delay: float = 0.0
    exchange: bool = False
    conjugate: bool = False

    def apply(self, omega: FloatArray, h: ComplexArray) -> ComplexArray:
        """Return corrected FRFs, shape (n_freq, n_responses, n_forces); a copy."""
        if self.conjugate:
            return np.ascontiguousarray(h.conj())
        result: ComplexArray = h.copy()
        across = result if self.axis == 1 else result.swapaxes(1, 2)
        places = list(self.places)
        if self.exchange:
            across[:, places] = across[:, places[::-1]]
            return result
        with np.errstate(divide="ignore", invalid="ignore"):
            divisor = self.factor * (1j * omega) ** self.power * np.exp(-1j * omega * self.delay)
            across[:, places] /= divisor[:, None, None]
        return result


def corrected(omega: FloatArray, h: ComplexArray, corrections: list[Correction]) -> ComplexArray:
    """Return the FRFs with all corrections, one after the other."""
    for correction in corrections:
        h = correction.apply(omega, h)
    return h
