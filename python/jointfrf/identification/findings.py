"""What a reader must know of a fit before its numbers are used, as objects: the sentences are their text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from jointfrf.channels.check.finding import FrfFinding
from jointfrf.errors import ConvergenceWarning, IdentificationWarning

__all__ = ["Finding", "FitFindingKind", "WithFindings", "as_warning", "note", "of_bent_frfs", "warn", "worst_first"]

#: What a finding is about.
FitFindingKind = Literal[
    "averages",  # how a mean over bands is to be read
    "bent",  # FRFs of a joint whose stiffness changes with their amplitude
    "blind",  # places where a planned sensor or hit would see nothing
    "calibration",  # channels whose gain or phase is a little off
    "channels",  # signs and exchanges of channels that were looked for
    "choice",  # damping terms that were chosen
    "convergence",
    "correlation",  # parameters, or lines, that are not independent
    "cross terms",
    "direction",  # a combination of parameters that the FRFs do not determine
    "factor",  # what a parameter depends on from one fit to the next
    "groups",  # DOFs between which FRFs are zero
    "left out",  # lines, or DOFs, that were not used
    "mass",  # what sensors weigh
    "model",  # errors of models that none of their unknowns describes
    "noise",
    "open",  # a parameter that may be infinite or zero
    "outlying",  # a fit that does not belong to the others
    "poor",  # a parameter with a wide interval
    "prior",
    "reference point",
    "residual",  # it is not the noise
    "same",  # joint points that share their parameters
    "sides",  # bodies that deform between the channels
    "sign",  # damping that is negative, or may be
    "trend",  # a parameter that changes over the band
    "window",  # what an exponential window adds
    "other",  # read from a file that does not say
]


#: Kinds whose warnings say that the whole fit is in doubt, the worst first; then those of single numbers, likewise.
_WORST: tuple[FitFindingKind, ...] = (
    "bent", "channels", "convergence", "residual", "left out", "cross terms", "sign", "trend", "calibration", "model",
    "window", "prior", "direction", "open", "sides", "poor",
)  # fmt: skip


@dataclass(frozen=True)
class Finding:
    """Something to know of a fit.

    Attributes
    ----------
    kind : str
        What it is about: "residual", "open", "sides", ... (`FitFindingKind`).
    severity : {"warning", "note"}
        Whether it puts numbers in doubt, or says how they came about.
    text : str
        The sentence.
    about : tuple of str
        Names of the parameters, DOFs or channels concerned; empty where it is the whole fit.
    bands : tuple of (low, high)
        Parts of the band concerned, Hz.
    """

    kind: FitFindingKind
    severity: Literal["warning", "note"]
    text: str
    about: tuple[str, ...] = ()
    bands: tuple[tuple[float, float], ...] = ()

    def __str__(self) -> str:
        return self.text


class WithFindings:
    """What has findings says them in sentences, too."""

    findings: tuple[Finding, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a reader must know before using the numbers."""
        return tuple(one.text for one in self.findings if one.severity == "warning")

    @property
    def notes(self) -> tuple[str, ...]:
        """How the numbers came about."""
        return tuple(one.text for one in self.findings if one.severity == "note")


def warn(
    kind: FitFindingKind, text: str, about: tuple[str, ...] = (), bands: tuple[tuple[float, float], ...] = ()
) -> Finding:
    """Return a finding that puts numbers in doubt."""
    return Finding(kind, "warning", text, about, bands)


def note(kind: FitFindingKind, text: str, about: tuple[str, ...] = ()) -> Finding:
    """Return a finding that says how numbers came about."""
    return Finding(kind, "note", text, about)


def of_bent_frfs(found: Iterable[FrfFinding]) -> list[Finding]:
    """Return the findings of a fit to FRFs that are bent by amplitude."""
    return [warn("bent", f"{one.message}: the fit describes this test, not the structure; {one.remedy}", one.channels)
            for one in found]  # fmt: skip


def worst_first(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return findings by what they put in doubt: warnings before notes, of the whole fit before those of a number."""

    def rank(one: Finding) -> tuple[bool, int]:
        of_kind = _WORST.index(one.kind) if one.severity == "warning" and one.kind in _WORST else len(_WORST)
        return one.severity == "note", of_kind

    return tuple(sorted(findings, key=rank))


def as_warning(finding: Finding) -> Warning:
    """Return the warning that Python issues for a finding."""
    return (ConvergenceWarning if finding.kind == "convergence" else IdentificationWarning)(finding.text)
