"""One row of the table of messages: templates, and the paragraph of the reference page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from string import Formatter
from typing import Any, Literal

from jointfrf.spelling import some_of

__all__ = ["Message", "Severity", "Templates"]

Severity = Literal["error", "warning", "note"]
#: One template, or one for each variant; the variant "" is used for the variants that are not listed.
Templates = str | Mapping[str, str]
#: Number of names of a list in a message.
_SHOWN = 4


@dataclass(frozen=True)
class Message:
    """A message of one code.

    Attributes
    ----------
    severity : {"error", "warning", "note"}
        Severity: "error" if the fit is meaningless, "warning" if some numbers are in doubt, "note" for information.
        A finding may have another one.
    text : str or mapping of str to str
        Template of the sentence that states the fact, with the names of numbers in braces.
    remedy : str or mapping of str to str
        Template of the sentence that states the remedy; empty for a note that needs none.
    means, why, do : str
        Paragraph of the reference page: meaning, cause and remedy.
    """

    severity: Severity
    text: Templates
    remedy: Templates
    means: str
    why: str
    do: str

    def templates(self, variant: str) -> tuple[str, str]:
        """Return the templates of text and remedy for a variant."""
        text, remedy = (
            one if isinstance(one, str) else one.get(variant, one.get("", "")) for one in (self.text, self.remedy)
        )
        return text, remedy

    def filled(self, variant: str, numbers: Mapping[str, Any]) -> str:
        """Return the sentence, and the remedy as a second one.

        Examples
        --------
        >>> from jointfrf.messages.message import Message
        >>> Message("note", "{about}: off by {share:.2p}", "Look there", "", "", "").filled(
        ...     "", {"about": ("a", "b"), "share": 0.0123})
        'a, b: off by 1.2 %. Look there'
        """
        parts = [_WORDS.vformat(one, (), numbers) for one in self.templates(variant) if one]
        return ". ".join(parts)


class _Words(Formatter):
    """Formatter like `str.format`, with lists of names separated by commas, and type `p` for a share in percent."""

    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, str):
            return value
        if isinstance(value, Iterable):
            return some_of([self.format_field(each, format_spec) for each in value], _SHOWN)
        if format_spec.endswith("p"):
            return f"{100 * value:{format_spec[:-1]}g} %"
        return format(value, format_spec)


_WORDS = _Words()
