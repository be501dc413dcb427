"""The table of messages: every code is used, every sentence keeps to the rules, the page is the table."""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path
from string import Formatter

import pytest

import jointfrf as jf
from documents import DOCUMENTS
from jointfrf.errors import FrfCheckWarning, IdentificationWarning
from jointfrf.messages.finding import MESSAGES, as_warning, saved_finding, worst_first
from jointfrf.messages.message import Message
from message_page import message_page

PACKAGE = Path(jf.__file__).parent
#: Callables whose first argument is a code.
MAKERS = {"Finding", "_Cause"}


def constants(node: ast.expr) -> list[str]:
    """The words that an argument may be; the code of a cause is one that its maker gave."""
    if isinstance(node, ast.IfExp):
        return [*constants(node.body), *constants(node.orelse)]
    if ast.unparse(node) in ("cause.code", 'content["code"]', "content['code']", "_OLD"):
        return []
    assert isinstance(node, ast.Constant), ast.unparse(node)
    return [node.value]


def made_codes() -> dict[str, str]:
    """Every code that the package makes, and where."""
    found = {"saved-by-older-version": "finding.py"}
    for file in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") in MAKERS:
                found |= dict.fromkeys(constants(node.args[0]), f"{file.name}:{node.lineno}")
    return found


def test_every_code_is_made_and_every_code_made_is_in_the_table():
    made = made_codes()
    assert not {code: where for code, where in made.items() if code not in MESSAGES}
    assert not set(MESSAGES) - set(made)


def templates(code: str) -> Iterator[str]:
    for one in (MESSAGES[code].text, MESSAGES[code].remedy):
        yield from [one] if isinstance(one, str) else one.values()


@pytest.mark.parametrize("code", MESSAGES)
def test_every_sentence_keeps_to_the_rules(code):
    """A value is one word. A fact begins small, after the severity; a remedy is a sentence of its own."""
    assert re.fullmatch(r"[a-z]+(-[a-z]+)*", code)
    message = MESSAGES[code]
    for template in templates(code):
        assert not template.endswith(".")
        for sentence in template.split(". "):
            words = [word for word in re.sub(r"\{[^}]*\}", "X", sentence).split() if re.search(r"\w", word)]
            assert len(words) <= 25, sentence
    variants = [""] if isinstance(message.text, str) else list(message.text)
    for variant in variants:
        _, remedy = message.templates(variant)
        assert remedy or message.severity == "note" or variant in ("prior", "prior-known", "equal"), variant
        assert not remedy or remedy[0].isupper() or remedy.startswith("{")
    for part in (message.means, message.why, message.do):
        assert part.endswith("."), part
        assert all(len(sentence.split()) <= 35 for sentence in part.split(". "))


def test_templates_have_no_type_but_known_ones():
    for code in MESSAGES:
        for template in templates(code):
            for _, name, spec, _ in Formatter().parse(template):
                assert name is None or re.fullmatch(r"\w+", name), template
                assert re.fullmatch(r"([+]?(\.\d)?[efgp]?)?", spec or ""), template


def test_a_finding_is_its_numbers_in_its_template():
    one = jf.Finding("poorly-determined", dict(parameter="k_x", low=1.0, high=3.0, unit="N/m"), ("k_x",))
    assert one.severity == "warning"
    assert (
        one.text == "k_x is poorly determined: 95 % interval 1 to 3 N/m. Add averages, lines or channels near the joint"
    )
    assert str(one) == f"warning: {one.text} [poorly-determined]"
    assert type(as_warning(one)) is IdentificationWarning
    named = jf.Finding("zero-frequency", {"line": 0}, test="run 3")
    assert named.text.startswith("run 3: line 0 is at 0 Hz")
    assert type(as_warning(named)) is FrfCheckWarning
    assert worst_first([jf.Finding("sides-removed"), named, one, jf.Finding("time-convention", {"share": 1.0})])[
        0
    ].code == ("time-convention")
    with pytest.raises(ValueError, match="unknown code 'bent'; use one of not-finite"):
        jf.Finding("bent")


def test_shares_and_lists_are_written_as_words():
    message = Message("note", "{share:.2p} of {names}, {none}", "", "", "", "")
    assert (
        message.filled("", {"share": 0.123, "names": list("abcdef"), "none": "x"}) == "12 % of a, b, c, d and 2 more, x"
    )


def test_findings_come_back_from_a_file():
    whole = jf.Finding("channel-gain", dict(factor=1.1, error=0.01, others=("k:x",)), ("j:x",), ((1.0, 2.0),), "error",
                       "undecided", "run 3")  # fmt: skip
    content = json.loads(json.dumps(whole.to_dict(), allow_nan=False))
    assert content["code"] == "channel-gain"
    assert content["text"] == whole.text
    assert saved_finding(content) == whole
    # of version 0.2, of a later version, and a number that JSON does not have
    old = dict(kind="residual", severity="warning", text="the residual is large", about=["k_x"], bands=[[1, 2]])
    infinite = jf.Finding("second-minimum", {"difference": float("inf")}).to_dict()
    for one in (old, content | {"code": "of-later"}, infinite):
        found = saved_finding(one)
        assert (found.code, found.text, found.severity) == ("saved-by-older-version", one["text"], one["severity"])
        assert found.about == tuple(one["about"])
    for damaged in ({"severity": "fatal"}, {"bands": [[1]]}, {"numbers": {"factor": {}}}, {"about": 3}):
        with pytest.raises((KeyError, TypeError, ValueError)):
            saved_finding(content | damaged)


def test_the_page_is_the_table():
    assert DOCUMENTS["docs/messages.md"] == message_page(), (
        "python tests/python/support/message_page.py docs/messages.md"
    )
    for code in MESSAGES:
        assert f"\n### {code}\n" in DOCUMENTS["docs/messages.md"]
