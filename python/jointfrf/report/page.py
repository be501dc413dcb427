"""The page of a case: a summary, tables, figures and texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from jointfrf.report.document import Document, Listing, Picture, Section, make_document
from jointfrf.report.draw import Drawing
from jointfrf.report.figure import Figure
from jointfrf.report.table import Table

__all__ = ["Page", "make_page"]


@dataclass(frozen=True)
class Page:
    """What a page holds.

    Attributes
    ----------
    title : str
    about : str
        A sentence or two below it: what was computed from what.
    summary : sequence of Table
        Short tables.
    tables : sequence of Table
    figures : sequence of (Figure, Drawing)
        Figures as they are drawn: the SVG files become part of the page.
    subject : str
        Heading of the texts that follow.
    text : str
        Shown as it is written; left out if empty.
    sources : sequence of (name, text)
        Shown when the reader asks for them.
    """

    title: str
    about: str
    summary: Sequence[Table]
    tables: Sequence[Table]
    figures: Sequence[tuple[Figure, Drawing]]
    subject: str = ""
    text: str = ""
    sources: Sequence[tuple[str, str]] = ()

    @property
    def document(self) -> Document:
        """The page as sections and their parts."""
        sections = [
            Section("summary", "Summary", self.summary),
            Section("tables", "Tables", self.tables),
            Section("figures", "Figures", [Picture(figure, drawing) for figure, drawing in self.figures]),
        ]
        if self.subject:
            texts = ([Listing("", self.text)] if self.text else []) + [Listing(*own) for own in self.sources]
            sections.append(Section("subject", self.subject, texts))
        return Document(self.title, self.about, sections)


def make_page(page: Page) -> str:
    """Write a page.

    Parameters
    ----------
    page : Page

    Returns
    -------
    str
        HTML without any link to another file.

    Raises
    ------
    MissingPackageError
        jinja2 is missing.
    """
    return make_document(page.document)
