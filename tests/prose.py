"""Find departures from plain technical English, and keep their number on each page from rising.

    python tests/prose.py FILE...          print each departure with its line and the remedy
    python tests/prose.py --counts         print departures, and departures per 1000 words, of each page
    python tests/prose.py --renew          store the counts that have fallen in tests/prose.toml
    python tests/prose.py --commit [FILE]  check the message of a commit (default: standard input)

A page is a document, the docstrings of public names of one package, or the messages of one package. Code, formulas,
tables and headings are not read. A page without a stored count may have 6 departures per 1000 words.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
STORED = ROOT / "tests" / "prose.toml"
DOCUMENTS = ("*.md", "docs/*.md", "fortran/README.md", "python/packaging/README.md", "cases/*/README.md")
PACKAGE = "python/jointfrf"
#: Departures per 1000 words on a page that has no stored count.
TARGET = 6
#: Words of a sentence at most.
LONGEST = {"document": 35, "docstrings": 35, "messages": 25}


class Rule(NamedTuple):
    """A pattern of words to avoid in a sentence, and the remedy."""

    name: str
    pattern: str
    remedy: str


#: Subjects that cannot know or speak.
_THINGS = r"(?:FRFs?|data|files?|lines?|fits?|residuals?|channels?|models?|priors?|impacts?|bands?|intervals?|pages?)"
RULES = (
    Rule("that-of", r"\b(?:that|those) of\b", "repeat the noun"),
    Rule("pronoun", r"\b(?:the others|as was said|the former|the latter)\b", "repeat the noun"),
    Rule(
        "what",
        r"\bwhat (?:an?|all|are|both|each|enters|is|it|lies|no|of|one|the|they|these|this|was|were"
        r"|(?:channels?|data|FRFs|hits?|impacts?|lines?|models?|sensors?))\b",
        "name the thing: 'the residual', not 'what is left'",
    ),
    Rule("where", r"(?:^|[.:;] )Where ", "begin with 'If' or 'When'; 'where' is a place"),
    Rule("of-first", r"(?:^|[:;] )Of [a-z\d]", "put the subject first"),
    Rule("nobody", r"\b[Ii]t is (?:said|seen|told|found|named)\b", "name who acts"),
    Rule("says", r"\b(?:says?|said|saying)\b", "prints, states, shows, specified"),
    Rule("holds", r"\b(?:holds?|held|holding)\b(?! fixed)", "contains, covers, is valid, is fixed"),
    Rule("stands", r"\bstands?\b(?! for\b)", "is, is listed, represents"),
    Rule("beside", r"\bbesides?\b", "next to, compared with, in addition to"),
    Rule("mind", rf"\b{_THINGS} (?:know|see|believe|den[yi]|tell|want|forget)(?:s|es)?\b", "contain, show, contradict"),
    Rule(
        "phrase",
        r"\b(?:all the same|anew|but for|go(?:es)? on|likewise|nor|of (?:one's|its) own|so (?:are|do|does|is)"
        r"|to and fro)\b",
        "use the plain word",
    ),
    Rule("term", r"\bbent\b", "amplitude-dependent"),
    Rule("term", r"\bsides? (?:that |which )?bends?\b", "flexible side"),
    Rule("term", r"\bopen (?:bounds?|intervals?)\b", "unbounded interval"),
    Rule("term", r"\brefus(?:e|ed|es|al)\b", "rejected, an error"),
    Rule("term", r"\b(?:\d+|all|each|every|more|of|such|the) draws?\b", "simulated test, realisation"),
    Rule("term", r"\blook at the (?:channels|data|FRFs)\b", "data check"),
    Rule("term", r"\brooms?\b", "package"),
    Rule("term", r"\bhits?\b", "impact"),
    Rule("colons", r"(?:[:;](?!\d).*){3}", "two sentences, or a list"),
)


class Passage(NamedTuple):
    """A paragraph, an item of a list, or a message, with the line on which it begins."""

    line: int
    text: str


class Departure(NamedTuple):
    """A place that departs from a rule."""

    line: int
    rule: str
    found: str
    remedy: str
    sentence: str


class Page(NamedTuple):
    """Passages that are counted together."""

    kind: str  # a key of LONGEST
    passages: list[Passage]

    def departures(self) -> list[Departure]:
        """Return all departures, in the order of the lines."""
        return [found for passage in self.passages for found in departures(passage, LONGEST[self.kind])]

    def words(self) -> int:
        """Return the number of words."""
        return sum(_count_words(sentence) for passage in self.passages for sentence in sentences(passage.text))


# -------------------------------------------------------------------------------------------------- what is read


def markdown_passages(text: str) -> Iterator[Passage]:
    """Yield paragraphs and items of lists; not code, tables, headings, comments, tags or directives."""
    text = re.sub(r"<!--.*?-->|<\w[^<>]*>", lambda found: "\n" * found[0].count("\n"), text, flags=re.DOTALL)
    text = re.sub(
        r"^ *(`{3,}|~{3,})(?!\{(?:tip|note|warning)\}).*?^ *\1$", _blank, text, flags=re.DOTALL | re.MULTILINE
    )
    begun, gathered = 0, [""][:0]
    for number, line in enumerate([*text.splitlines(), ""], 1):
        item = re.match(r"\s*(?:[-*+]|\d+\.)\s+(?:\[[ x]\] )?", line)
        words = line[item.end() :] if item else line.strip().lstrip("> ")
        skipped = re.match(r"\||#|:{3,}|:[\w-]+:|\^+$|-{3,}$|\+{3,}$|`{3}", words)
        formula = not gathered and not item and line.startswith("    ")
        if gathered and (item or skipped or not words):
            yield Passage(begun, " ".join(gathered))
            gathered = []
        if words and not skipped and not formula:
            begun = begun if gathered else number
            gathered.append(words)


def docstring_passages(text: str, line: int) -> Iterator[Passage]:
    """Yield paragraphs of a docstring in the form of numpydoc; not names, types, headings, examples or formulas."""
    begun, gathered, named, skipping = 0, [""][:0], False, False
    rows = [*text.expandtabs().splitlines(), ""]
    for number, (row, following) in enumerate(zip(rows, [*rows[1:], ""], strict=True), line):
        words = row.strip()
        if re.fullmatch(r"-{3,}", following.strip()):  # the heading of a section: what has names and types, or not
            named, words = words not in ("Notes", "Examples", "References"), ""
        name = named and not row.startswith(" ")
        skipping = words.startswith((">>>", ".. ")) or (skipping and (bool(words) or following.startswith(" ")))
        item = words.startswith("- ")
        if gathered and (item or name or skipping or not words):
            yield Passage(begun, " ".join(gathered))
            gathered = []
        if words and not name and not skipping and not re.fullmatch(r"-{3,}", words):
            begun = begun if gathered else number
            gathered.append(words.removeprefix("- "))
            skipping = words.endswith("::")


def python_passages(text: str) -> tuple[list[Passage], list[Passage]]:
    """Return the docstrings of public names, and the messages: texts that are raised, warned of, or in a table."""
    docstrings, messages = [], []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            if documented := ast.get_docstring(node):
                docstrings += docstring_passages(documented, node.body[0].lineno)
        elif isinstance(node, ast.Call) and re.search(r"(?:[Ww]arn|Warning|Error|Finding|Message)$", _called(node)):
            for argument in node.args:
                for part in argument.values if isinstance(argument, ast.Dict) else [argument]:
                    if len((message := _text_of(part)).split()) > 2:
                        messages.append(Passage(part.lineno, message))
    return sorted(docstrings, key=lambda one: one.line), sorted(messages, key=lambda one: one.line)


def _called(call: ast.Call) -> str:
    return getattr(call.func, "attr", getattr(call.func, "id", ""))


def _text_of(node: ast.expr) -> str:
    """Return the text of a string with VALUE for each part that is known only when the program runs."""
    if isinstance(node, ast.Constant):
        return re.sub(r"\{[^{}]*\}", "VALUE", node.value) if isinstance(node.value, str) else ""  # templates, too
    if isinstance(node, ast.JoinedStr):
        return "".join(_text_of(part) if isinstance(part, ast.Constant) else "VALUE" for part in node.values)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return (_text_of(node.left) or "VALUE") + (_text_of(node.right) or "VALUE")
    return ""


def _blank(found: re.Match[str]) -> str:
    return "\n" * found[0].count("\n")


def read_page(path: Path) -> dict[str, Page]:
    """Return the pages of one file by name: one of a document, two of a module."""
    text, name = path.read_text(encoding="utf-8"), _name(path)
    if path.suffix == ".py":
        return dict(zip((f"{name} docstrings", f"{name} messages"), _module_pages(text), strict=True))
    if path.name == "CHANGELOG.md":  # what was released stays as it is
        text = re.split(r"^(?=## \[\d)", text, flags=re.MULTILINE)[0]
    return {name: Page("document", list(markdown_passages(text)))}


def _module_pages(text: str) -> tuple[Page, Page]:
    docstrings, messages = python_passages(text)
    return Page("docstrings", docstrings), Page("messages", messages)


def _name(path: Path) -> str:
    path = path.resolve()
    return path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else str(path)


def all_pages() -> dict[str, Page]:
    """Return all pages of the project by name: documents, and packages with two pages each."""
    pages: dict[str, Page] = {}
    for pattern in DOCUMENTS:
        for path in sorted(ROOT.glob(pattern)):
            pages |= read_page(path)
    for path in sorted((ROOT / PACKAGE).rglob("*.py")):
        inside = path.relative_to(ROOT / PACKAGE).parts
        package = "/".join((PACKAGE, *inside[:-1][: 2 if inside[0] == "workbench" else 1]))
        for page in _module_pages(path.read_text(encoding="utf-8")):
            pages.setdefault(f"{package} {page.kind}", Page(page.kind, [])).passages.extend(page.passages)
    return {name: page for name, page in pages.items() if page.passages}


# ------------------------------------------------------------------------------------------------ what is counted


def sentences(text: str) -> list[str]:
    """Split a passage into sentences, with CODE for code and the text of links."""
    text = re.sub(r"!?\[([^]]*)\]\([^)]*\)", r"\1", text)
    text = re.sub(r"`+[^`]*`+|\$[^$]*\$", "CODE", text).replace("**", "")
    ends = r"(?<!\be\.g\.)(?<!\bi\.e\.)(?<!\bEq\.)(?<!\bFig\.)(?<!\b[A-Z]\.)(?<=[.!?])\s+(?=[^\Wa-z]|[\"'(])"
    return [part for part in re.split(ends, text) if re.search(r"[a-z]{2}", part)]


def _count_words(sentence: str) -> int:
    return sum(bool(re.search(r"\w", word)) for word in sentence.split())


def departures(passage: Passage, longest: int) -> Iterator[Departure]:
    """Yield each place of a passage that departs from a rule."""
    for sentence in sentences(passage.text):
        if (count := _count_words(sentence)) > longest:
            yield Departure(passage.line, "long", f"{count} words", f"at most {longest}", sentence)
        for rule in RULES:
            for found in re.finditer(rule.pattern, sentence, re.IGNORECASE if rule.name == "what" else 0):
                yield Departure(passage.line, rule.name, found[0].strip(" .:;"), rule.remedy, sentence)


def limit(name: str, page: Page, stored: dict[str, int]) -> int:
    """Return how many departures a page may have."""
    return stored.get(name, -(-TARGET * page.words() // 1000))


def stored_counts() -> dict[str, int]:
    """Return the stored count of each page."""
    return tomllib.loads(STORED.read_text(encoding="utf-8")) if STORED.exists() else {}


def renewed(pages: dict[str, Page], stored: dict[str, int]) -> dict[str, int]:
    """Return the table to be stored: the count of each page, but not above its limit if there was a table before."""
    counts = {name: len(page.departures()) for name, page in pages.items()}
    return {name: min(n, limit(name, pages[name], stored)) if stored else n for name, n in counts.items()}


def table_text(counts: dict[str, int]) -> str:
    """Return the text of the table."""
    head = "# Departures from plain English on each page: they may only fall. Renew by: python tests/prose.py --renew\n"
    return head + "".join(f'"{name}" = {counts[name]}\n' for name in sorted(counts))


# ------------------------------------------------------------------------------------------------------- commits


def commit_faults(message: str) -> list[str]:
    """Return the faults of the message of a commit; lines that begin with # are not part of it."""
    lines = [line for line in message.splitlines() if not line.startswith("#")]
    subject, body = (lines or [""])[0], lines[1:]
    if subject.startswith(("Merge ", "Revert ")):
        return []
    faults = []
    if len(subject) > 72:
        faults.append(f"subject of {len(subject)} characters; shorten it to 72")
    if not re.match(r"[\w/.-]+(?: [\w/.-]+){0,3}: [a-z]", subject):
        faults.append("subject without an area; write 'area: imperative', such as 'io: read labels without a unit'")
    if re.search(r"[:;] |\.$", re.sub(r"^[^:]*: ", "", subject)):
        faults.append("subject with a second clause or a full stop; move reasons into the body")
    if body and body[0].strip():
        faults.append("no empty line below the subject; add one")
    if not any(line.strip() for line in body):
        faults.append("no body; write why, and what a user notices")
    return faults


# ------------------------------------------------------------------------------------------------------- command


def _show(files: list[Path]) -> int:
    found = 0
    for path in files:
        for page in read_page(path).values():
            for departure in page.departures():
                line, rule, words, remedy, sentence = departure
                print(f"{path}:{line}: {rule}: {words[:40]}: {remedy}\n    {sentence[:110]}")
                found += 1
    return min(found, 1)


def _print_counts(pages: dict[str, Page]) -> int:
    stored, total, words = stored_counts(), 0, 0
    for name, page in pages.items():
        count, length = len(page.departures()), page.words()
        total, words = total + count, words + length
        more = "  more than stored" if count > limit(name, page, stored) else ""
        print(f"{count:5} {1000 * count / max(length, 1):6.1f}  {name}{more}")
    print(f"{total:5} {1000 * total / words:6.1f}  all")
    return 0


def main() -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--counts", action="store_true")
    parser.add_argument("--renew", action="store_true")
    parser.add_argument("--commit", action="store_true")
    given = parser.parse_args()
    if given.commit:
        message = given.files[0].read_text(encoding="utf-8") if given.files else sys.stdin.read()
        print("\n".join(faults := commit_faults(message)), end="\n" if faults else "")
        return bool(faults)
    if given.renew:
        STORED.write_text(table_text(renewed(all_pages(), stored_counts())), encoding="utf-8")
        return 0
    if given.counts or not given.files:
        return _print_counts(all_pages())
    return _show(given.files)


if __name__ == "__main__":
    sys.exit(main())
