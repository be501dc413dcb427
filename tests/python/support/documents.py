"""README and docs: their texts, what they show, and whether what is printed agrees with that."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
DOCUMENTS = {
    str(path.relative_to(ROOT)): path.read_text(encoding="utf-8")
    for path in sorted(
        [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("cases/*/README.md"), ROOT / "fortran/README.md"]
    )
}
README = DOCUMENTS["README.md"]


def blocks(language: str, text: str = README) -> list[str]:
    """Blocks of a language that run; those whose first line says that they are fragments are left out."""
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def words(text: str) -> list[float | str]:
    """Words of a text, numbers as numbers; rules of dashes left out."""
    found: list[float | str] = []
    for word in text.split():
        if set(word) == {"-"}:
            continue
        try:
            found.append(float(word.rstrip(",:)")))
        except ValueError:
            found.append(word)
    return found


def agree(printed: str, expected: str) -> None:
    """The same words, and numbers as far as the fit settles on any processor."""
    assert len(words(printed)) == len(words(expected))
    for found, said in zip(words(printed), words(expected), strict=True):
        assert found == (pytest.approx(said, rel=0.05) if isinstance(said, float) else said)
