"""A finding: a fact about data or a fit, as data; its sentence comes from the table of messages."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, get_args

from jointfrf.errors import ConvergenceWarning, FrfCheckWarning, IdentificationWarning
from jointfrf.messages.message import Message, Severity
from jointfrf.messages.of_data import DATA_MESSAGES
from jointfrf.messages.of_fits import FIT_MESSAGES
from jointfrf.spelling import visible

__all__ = ["MESSAGES", "Finding", "WithFindings", "as_warning", "messages_of", "saved_finding", "worst_first"]

#: Every message by its code, in the order of the reference page.
MESSAGES: Mapping[str, Message] = {**DATA_MESSAGES, **FIT_MESSAGES}

#: Warnings that put the whole fit in doubt, the worst first; warnings about single numbers follow.
_WORST = (
    "amplitude-dependent", "amplitude-not-smooth", "channel-changed", "channel-change-ambiguous",
    "channel-inconsistent", "not-converged",
    "second-minimum", "residual-large", "compliance-scatter", "lines-rejected", "dof-left-out", "cross-terms-ignored",
    "compliance-unsymmetric", "damping-negative", "frequency-dependent", "band-parts-differ", "band-scatter",
    "moving-mass", "off-axis", "set-up-deviation", "set-up-scatter", "model-error", "model-gain", "prior-contradicted",
    "direction-undetermined", "joints-not-separated", "stiffness-unbounded", "stiffness-zero", "poorly-determined",
)  # fmt: skip
_OLD = "saved-by-older-version"


@dataclass(frozen=True)
class Finding:
    """One fact to know about data or a fit.

    Attributes
    ----------
    code : str
        Stable name, such as "residual-large"; `docs/messages.md` explains each.
    numbers : mapping of str to number, str or tuple
        Values that the sentence contains.
    about : tuple of str
        Names of the parameters, DOFs or channels concerned; empty if the finding concerns all.
    bands : tuple of (low, high)
        Parts of the band concerned, Hz.
    severity : {"error", "warning", "note"}
        Severity: "error" if the fit is meaningless, "warning" if some numbers are in doubt, "note" for information.
    variant : str
        Name of the template of the code.
    test : str
        Name of the test concerned, if there are several.

    Examples
    --------
    >>> import jointfrf as jf
    >>> print(jf.Finding("stiffness-zero", dict(parameter="k_x", high=12.3, unit="N/m"), ("k_x",)))
    warning: k_x is not significantly different from zero, at most 12.3 N/m (95 %). Treat this DOF as free, or measure \
with less noise [stiffness-zero]
    """

    code: str
    numbers: Mapping[str, Any] = field(default_factory=dict)
    about: tuple[str, ...] = ()
    bands: tuple[tuple[float, float], ...] = ()
    severity: Severity = ""  # type: ignore[assignment]  # of the table
    variant: str = ""
    test: str = ""

    def __post_init__(self) -> None:
        if self.code not in MESSAGES:
            raise ValueError(f"unknown code {self.code!r}; use one of {', '.join(MESSAGES)}")
        if not self.severity:
            object.__setattr__(self, "severity", MESSAGES[self.code].severity)

    @property
    def text(self) -> str:
        """The sentence, and the remedy as a second one, without the code."""
        known = {"about": self.about or "all channels", "bands": [f"{low:g}-{high:g} Hz" for low, high in self.bands]}
        filled = MESSAGES[self.code].filled(self.variant, {**known, **self.numbers})
        return f"{self.test}: {filled}" if self.test else filled

    @property
    def message(self) -> str:
        """The text with the code, as it is printed."""
        return f"{self.text} [{self.code}]"

    def __str__(self) -> str:
        return f"{self.severity}: {self.message}"

    def to_dict(self) -> dict[str, Any]:
        """Return the finding for JSON; a number that is not finite becomes None."""
        return {
            "code": self.code,
            "severity": self.severity,
            "text": self.text,
            "about": list(self.about),
            "bands": [list(band) for band in self.bands],
            "numbers": {name: _plain(value) for name, value in self.numbers.items()},
            "variant": self.variant,
            "test": self.test,
        }


def _plain(value: Any) -> Any:
    """Return a value for JSON."""
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if hasattr(value, "item"):  # a number of numpy
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def saved_finding(content: Mapping[str, Any], read_text: Callable[[Any], str] = visible) -> Finding:
    """Return a finding of a file, as `Finding.to_dict` or version 0.2 wrote it.

    A text that does not follow from the numbers is kept unchanged: of version 0.2, of a code of a later version, and
    with numbers that are not finite, which JSON does not contain.

    Raises
    ------
    KeyError, TypeError, ValueError
        The content is damaged.
    """
    text, severity = read_text(content["text"]), content["severity"]
    if severity not in get_args(Severity):
        raise ValueError(severity)
    about = tuple(read_text(name) for name in content["about"])
    bands = tuple((float(low), float(high)) for low, high in content["bands"])
    if content.get("code") in MESSAGES:
        numbers = {str(name): _value(value, read_text) for name, value in content["numbers"].items()}
        words = (read_text(content[name]) for name in ("variant", "test"))
        found = Finding(content["code"], numbers, about, bands, severity, *words)
        try:
            if found.text == text:
                return found
        except (KeyError, TypeError, ValueError):
            pass
    return Finding(_OLD, {"text": text}, about, bands, severity)


def _value(value: Any, read_text: Callable[[Any], str]) -> Any:
    if isinstance(value, list):
        return tuple(_value(each, read_text) for each in value)
    if isinstance(value, str):
        return read_text(value)
    if value is not None and not isinstance(value, int | float):
        raise TypeError(value)
    return value


class WithFindings:
    """An object with findings, and their sentences."""

    findings: tuple[Finding, ...]

    @property
    def warnings(self) -> tuple[str, ...]:
        """Errors and warnings: read them before you use the numbers."""
        return messages_of(self.findings)

    @property
    def notes(self) -> tuple[str, ...]:
        """Origin of the numbers."""
        return tuple(one.message for one in self.findings if one.severity == "note")

    def content(self) -> dict[str, list[dict[str, Any]]]:
        """Return the findings for JSON."""
        return {"findings": [one.to_dict() for one in self.findings]}


def messages_of(findings: Iterable[Finding], test: str = "") -> tuple[str, ...]:
    """Return errors and warnings as printed, for a test of this name."""
    found = (one for one in findings if one.severity != "note")
    return tuple((replace(one, test=test) if test else one).message for one in found)


def worst_first(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return findings ordered: errors, warnings about the whole fit, warnings about single numbers, notes."""

    def rank(one: Finding) -> tuple[int, int]:
        of_code = _WORST.index(one.code) if one.severity == "warning" and one.code in _WORST else len(_WORST)
        return get_args(Severity).index(one.severity), of_code

    return tuple(sorted(findings, key=rank))


def as_warning(finding: Finding) -> Warning:
    """Return the warning that Python issues for a finding."""
    if finding.code in DATA_MESSAGES:
        return FrfCheckWarning(finding.message)
    return (ConvergenceWarning if finding.code == "not-converged" else IdentificationWarning)(finding.message)
