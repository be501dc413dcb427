"""Words of messages: a proposal for a misspelt word, the first few of many, escaped characters, bounded length."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

__all__ = ["LONGEST_MESSAGE", "cut", "did_you_mean", "look_alike", "message", "some_of", "visible"]

#: Categories of invisible characters, which a terminal, a card or a page may interpret.
_UNSEEN = {"Cc", "Cf", "Cs", "Zl", "Zp"}

#: Largest number of characters of a message, for any content of a file or a study.
LONGEST_MESSAGE = 2000


def cut(text: str, most: int = LONGEST_MESSAGE) -> str:
    """Return a text, or the beginning and the end of one that is too long, because the remedy is at the end.

    Examples
    --------
    >>> from jointfrf.spelling import cut
    >>> cut("bolt", 9), cut("bolt, nut and washer", 11)
    ('bolt', 'bolt...sher')
    """
    if len(text) <= most:
        return text
    each = (most - 3) // 2
    return f"{text[:each]}...{text[len(text) - each :]}"


def message(text: str) -> str:
    """Return a message to a user: invisible characters are escaped, and it has at most `LONGEST_MESSAGE` characters."""
    return cut(visible(cut(text)))


def look_alike(word: str, known: Iterable[str]) -> str:
    """Return the known word that is most similar; empty if there is none.

    Examples
    --------
    >>> from jointfrf.spelling import look_alike
    >>> look_alike("identfy", ["check", "identify"]), look_alike("no", ["check", "identify"])
    ('identify', '')
    """
    import difflib  # only for a misspelt word

    by_lower = {name.lower(): name for name in known}
    found = difflib.get_close_matches(word.lower(), list(by_lower), 1)
    return by_lower[found[0]] if found else ""


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return the end of a sentence that proposes the known word; empty if there is none.

    Examples
    --------
    >>> from jointfrf.spelling import did_you_mean
    >>> print("unknown option --dof" + did_you_mean("--dof", ["--dofs", "--band"]))
    unknown option --dof; did you mean --dofs?
    """
    similar = look_alike(word, known)
    return f"; did you mean {similar}?" if similar else ""


def some_of(names: Sequence[object], most: int, between: str = ", ") -> str:
    """Return the first of some names, and the number of further ones.

    Examples
    --------
    >>> from jointfrf.spelling import some_of
    >>> some_of([3, 4, 7, 9], 2), some_of(["y", "z"], 2)
    ('3, 4 and 2 more', 'y, z')
    """
    more = f"{between.rstrip().rstrip(',')} and {len(names) - most} more" if len(names) > most else ""
    return between.join(map(str, names[:most])) + more


def visible(text: str, keep: str = "") -> str:
    r"""Return a text of a file with invisible characters escaped, such as characters that move a cursor.

    Parameters
    ----------
    text : str
        Text to print.
    keep : str
        Characters that stay: ``"\n"`` for several lines.

    Examples
    --------
    >>> from jointfrf.spelling import visible
    >>> visible("bolt\x1b]0;x\x07")
    'bolt\\x1b]0;x\\x07'
    """
    if text.isprintable():
        return text
    import unicodedata

    return "".join(
        letter.encode("unicode_escape").decode("ascii")
        if unicodedata.category(letter) in _UNSEEN and letter not in keep else letter
        for letter in text
    )  # fmt: skip
