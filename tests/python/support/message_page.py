"""The reference page of messages, from the table of messages.

python tests/python/support/message_page.py docs/messages.md    writes it
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from jointfrf.messages.message import Message
from jointfrf.messages.of_data import DATA_MESSAGES
from jointfrf.messages.of_fits import FIT_MESSAGES

_HEAD = """\
# Messages

Every message about your data or your fit ends with a code in brackets, such as `[residual-large]`. Look up the code
here to find its meaning, its usual cause, and a remedy.

- An **error** makes a fit meaningless.
- A **warning** puts some numbers in doubt.
- A **note** explains how a number was found.

The table lists the usual severity; a single message may be more or less severe. In Python a message is a `Finding` with
`code`, `severity`, `numbers` (the values in the sentence), `about` (parameters, DOFs or channels) and `bands`:

```python fragment
for finding in fit.findings:  # or check.findings
    print(finding.severity, finding.code, finding.about, dict(finding.numbers))
```

In the JSON of `--json` and of saved fits the same fields are under `findings`. The words in angle brackets are filled
with values.
"""


def message_page() -> str:
    """Return the page: messages of the data checks, then messages of fits."""
    parts = [
        _HEAD,
        _section("Messages about measured data", DATA_MESSAGES),
        _details(DATA_MESSAGES),
        _section("Messages about fits, levels, pools and plans", FIT_MESSAGES),
        _details(FIT_MESSAGES),
    ]
    return "\n".join(parts).rstrip("\n") + "\n"


def _section(title: str, messages: dict[str, Message]) -> str:
    rows = [
        f"| [`{code}`](#{code}) | {one.severity} | {_first_sentence(one.means)} |" for code, one in messages.items()
    ]
    return "\n".join([f"## {title}", "", "| code | severity | meaning |", "|---|---|---|", *rows]) + "\n"


def _details(messages: dict[str, Message]) -> str:
    return "\n".join(_entry(code, one) for code, one in messages.items())


def _entry(code: str, one: Message) -> str:
    texts = [one.text] if isinstance(one.text, str) else list(one.text.values())
    shown = "\n".join(_wrapped(f"> {_shown(text)}") + "\n" for text in texts)
    remedies = [one.remedy] if isinstance(one.remedy, str) else list(one.remedy.values())
    advice = " ".join(f"{_shown(text)}." for text in dict.fromkeys(remedies) if text and "{action}" not in text)
    facts = [
        f"**Meaning.** {one.means}",
        f"**Cause.** {one.why}",
        f"**What to do.** {one.do}",
        *([f"**The message adds.** {advice}"] if advice else []),
    ]
    body = "\n\n".join(_wrapped(fact) for fact in facts)
    return f"### {code}\n\n*{one.severity.capitalize()}.*\n\n{shown}\n{body}\n"


def _shown(template: str) -> str:
    """Return a template with the names of its values in angle brackets."""
    return re.sub(r"\{(\w+)[^}]*\}", lambda match: f"⟨{match[1].replace('_', ' ')}⟩", template)


def _first_sentence(text: str) -> str:
    return re.split(r"(?<=[.!?])\s", text)[0]


def _wrapped(text: str, width: int = 120) -> str:
    mark = "> " if text.startswith("> ") else ""
    lines, line = [], ""
    for word in text.removeprefix(mark).split():
        if line and len(mark) + len(line) + 1 + len(word) > width:
            lines.append(mark + line)
            line = word
        else:
            line = f"{line} {word}".strip()
    return "\n".join([*lines, mark + line])


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(message_page(), encoding="utf-8")
