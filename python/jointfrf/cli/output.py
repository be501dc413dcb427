"""What a command prints: text for a reader, or JSON for a program, or nothing."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Mapping
from typing import Any

from jointfrf.spelling import visible

__all__ = ["Output", "plain"]


class Output:
    """Where the text and the numbers of a command go, by its options `--json` and `--quiet`."""

    def __init__(self, options: argparse.Namespace) -> None:
        self.is_json: bool = options.json
        self.is_text: bool = not (options.json or options.quiet)

    def say(self, *lines: object) -> None:
        """Print lines of text, unless JSON or nothing is wanted."""
        if self.is_text and lines:
            print(*(visible(str(line), "\n\t") for line in lines), sep="\n")

    def give(self, content: Mapping[str, Any]) -> None:
        """Print the result as JSON where that is wanted."""
        if self.is_json:
            print(json.dumps(plain(content), indent=2, allow_nan=False))


def plain(value: Any) -> Any:
    """Return a value as JSON holds it: what is not finite becomes null, a complex number a pair."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items()}
    if hasattr(value, "tolist"):  # arrays and numbers of numpy
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, complex):
        return [plain(value.real), plain(value.imag)]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if isinstance(value, str | int | None) else str(value)
