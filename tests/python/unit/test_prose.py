"""Prose is plain English: what the checker finds and leaves alone, and no page has more departures than before."""

import subprocess
import sys

import prose
import pytest


def found_in(text, kind="document"):
    return [departure.rule for departure in prose.departures(prose.Passage(1, text), prose.LONGEST[kind])]


@pytest.mark.parametrize(
    ("rule", "before", "after"),
    [
        (
            "where",
            "Where models fit as well as rational functions do, r is estimated.",
            "If models fit as well as rational functions, r is estimated.",
        ),
        (
            "that-of",
            "The error is that of the calibration.",
            "The error is the calibration error of the hammer that Ann calibrated.",
        ),
        ("pronoun", "One channel is late, the others are not.", "One channel is late, the other channels are not."),
        ("what", "The residual is what is left.", "The table lists the residual and what to do."),
        ("what", "What the sides bend is not in the intervals.", "The intervals do not cover what follows."),
        ("mind", "The FRFs deny the joint.", "The FRFs contradict the joint."),
        ("of-first", "Of pins without damping, 14 bounds were false.", "The bounds of 14 pins were false."),
        ("nobody", "Before the fit it is said how the joint lies.", "The command prints the position of the joint."),
        ("says", "The file says its unit.", "The file states its unit, and essays are not read."),
        ("holds", "The intervals hold all values.", "The intervals contain all values; a value is held fixed."),
        ("stands", "The value stands in the table.", "The value is in the table; k stands for stiffness."),
        ("beside", "The noise is small beside the signal.", "The noise is small compared with the signal."),
        ("phrase", "The fit goes on anew.", "The fit continues; the page is good on paper."),
        ("term", "The lines are bent.", "The lines are amplitude-dependent."),
        ("term", "The fit refuses the file.", "The fit rejects the file."),
        ("term", "Of the 40 draws none failed.", "No simulated test failed; a page draws the curve."),
        ("colons", "One: two; three: four.", "At 10:20 one thing: two; three."),
    ],
)
def test_a_rule_finds_the_word_and_not_the_remedy(rule, before, after):
    assert rule in found_in(before)
    assert rule not in found_in(after)


def test_messages_may_have_fewer_words_than_documents():
    sentence = " ".join(["word"] * 30)
    assert found_in(sentence, "messages") == ["long"]
    assert found_in(sentence) == []
    assert found_in(sentence + ". Then " + sentence) == []


def test_of_a_document_paragraphs_and_items_are_read_and_nothing_else():
    text = """# Where it stands

Text that goes
over two lines with `what is code`.
<!-- what is a comment -->
- an item
  of two lines
- [ ] a task

| what is | a table |
|---|---|

    what = the_formula(1)

```sh
what is run
```
::::{grid}
:gutter: 2
Inside a card.
::::
<img src="a.png" alt="what is
drawn"> After it.
"""
    assert list(prose.markdown_passages(text)) == [
        (3, "Text that goes over two lines with `what is code`."),
        (6, "an item of two lines"),
        (8, "a task"),
        (20, "Inside a card."),
        (23, "After it."),
    ]


def test_of_a_module_docstrings_of_public_names_and_messages_are_read():
    docstrings, messages = prose.python_passages(
        '''
def public(what):
    """Return it.

    Parameters
    ----------
    what : str
        What is wanted.

    Notes
    -----
    See the text::

        what = is_literal

    After it.

    >>> what is an example
    """
    if what:
        raise ValueError(f"the name {what} is "
                         "not known; use another")
    warn("what the user gave" + what + " is odd", stacklevel=2)
    print("what is printed is no message")
    Message("note", {"": "a table of messages", "b": "{count:g} of {total} lines"}, means="what is a paragraph")


def _private():
    """What is private."""
'''
    )
    assert [text for _, text in docstrings] == ["Return it.", "What is wanted.", "See the text::", "After it."]
    assert [text for _, text in messages] == [
        "the name VALUE is not known; use another",
        "what the user gaveVALUE is odd",
        "a table of messages",
        "VALUE of VALUE lines",
    ]


def test_released_versions_of_the_changelog_are_not_read(tmp_path):
    path = tmp_path / "CHANGELOG.md"
    path.write_text("# Changelog\n\n## [Unreleased]\n\n- New.\n\n## [0.1.0] - 2020-01-01\n\n- What is old.\n")
    (page,) = prose.read_page(path).values()
    assert [text for _, text in page.passages] == ["New."]


def test_no_page_has_more_departures_than_its_stored_count():
    stored, pages = prose.stored_counts(), prose.all_pages()
    more = []
    for name, page in pages.items():
        found, allowed = len(page.departures()), prose.limit(name, page, stored)
        if found > allowed:
            more.append(f"{name}: {found} departures, {allowed} allowed; show them by python tests/prose.py FILE")
    assert not more
    assert {"README.md", "CHANGELOG.md", "docs/quickstart.md", "python/jointfrf/io messages"} <= pages.keys()
    assert stored.keys() <= pages.keys(), "renew the table: python tests/prose.py --renew"


def test_a_renewed_table_never_rises():
    many = prose.Page("document", [prose.Passage(1, "What is held stands beside those of the others.")])
    counts = {"lower": 9, "higher": 2}
    assert prose.renewed({"lower": many, "higher": many, "new": many}, counts) == {"lower": 6, "higher": 2, "new": 1}
    assert prose.renewed({"any": many}, {}) == {"any": 6}


@pytest.mark.parametrize(
    ("message", "faults"),
    [
        ("model fit: handle data that determine no parameter\n\nThe scatter of nothing raised IndexError.\n", []),
        ("io: read labels\n\n# a comment of git\nUsers see the unit.\n", []),
        ("Merge branch 'readers'\n", []),
        ("Fit a model: the scatter ended; restrict parts\n\nWhy.", ["second clause"]),
        ("Fit a model\n\nWhy.", ["without an area"]),
        ("io: " + "word " * 14 + "more\n\nWhy.", ["characters"]),
        ("io: read labels.\n\nWhy.", ["full stop"]),
        ("io: read labels\n", ["no body"]),
        ("io: read labels\nThe reason.\n", ["no empty line"]),
        ("", ["without an area", "no body"]),
    ],
)
def test_messages_of_commits(message, faults):
    found = prose.commit_faults(message)
    assert len(found) == len(faults)
    assert all(part in fault for part, fault in zip(faults, found, strict=True))


def test_the_command_prints_places_and_fails_if_there_are_any(tmp_path):
    good, bad = tmp_path / "good.md", tmp_path / "bad.md"
    good.write_text("Text.\n")
    bad.write_text("Text.\n\nThe file says it.\n")

    def run(*words, **given):
        command = [sys.executable, prose.__file__, *map(str, words)]
        return subprocess.run(command, capture_output=True, text=True, check=False, **given)

    assert run(good).returncode == 0
    done = run(good, bad)
    assert done.returncode == 1
    assert done.stdout.startswith(f"{bad}:3: says: says: ")
    assert run("--commit", input="io: read labels\n\nWhy.\n").returncode == 0
    assert run("--commit", input="Read labels\n").stdout.count("\n") == 2
