"""One self-contained HTML page: a summary, tables, figures and texts; for screens of any width and for paper."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any
from urllib.parse import quote

from jointfrf.dofs import Parameter
from jointfrf.extras import check_extras
from jointfrf.report.draw import Drawing
from jointfrf.report.figure import Figure
from jointfrf.report.table import VERDICT, Table, shown, turned, written

__all__ = ["Page", "make_page"]

#: Up to so many columns fit on any screen; more than so many are written smaller; more than so many become rows.
_NARROW, _WIDE, _WIDEST = 4, 9, 12
_TEMPLATE = Path(__file__).with_name("page.html.jinja")


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
    check_extras("jinja2")
    import jinja2

    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, keep_trailing_newline=True)
    return environment.from_string(_TEMPLATE.read_text(encoding="utf-8")).render(
        page=page,
        version=version("jointfrf"),
        verdict=VERDICT,
        summary=[_for_template(table) for table in page.summary],
        tables=[_for_template(table) for table in page.tables],
        figures=[(figure, _as_address(drawing.svg)) for figure, drawing in page.figures],
    )


def _as_address(svg: bytes) -> str:
    """Return a drawing as the address of an image, in a quarter less than base64 takes."""
    text = re.sub("<[^>]*>", lambda tag: tag[0].replace("'", "").replace('"', "'"), svg.decode())
    return "data:image/svg+xml," + quote(" ".join(text.split()), safe=" !$&'()*+,-./:;=?@_~|")


def _for_template(table: Table) -> dict[str, Any]:
    table = shown(table)
    if len(table.columns) > _WIDEST and len(table.rows) < _WIDEST:
        table = turned(table)
    cells = [
        [_marked(cell) if isinstance(cell, Parameter) else text for cell, text in zip(row, texts, strict=True)]
        for row, texts in zip(table.rows, written(table), strict=True)
    ]
    return {"table": table, "numeric": table.is_number, "rows": cells, "shape": _shape(table)}


def _shape(table: Table) -> str:
    """Return the class of style of a table."""
    count = len(table.columns)
    return "narrow" if count <= _NARROW else "usual" if count <= _WIDE else "wide"


def _marked(parameter: Parameter) -> str:
    """Write a parameter with its index and Greek letter."""
    from markupsafe import Markup

    index = parameter.name.partition("_")[2].replace("theta_", "θ").replace("theta", "θ")
    return Markup("<i>{}</i><sub>{}</sub>").format(parameter.kind, index)
