"""One self-contained HTML page of sections and their parts; for screens of any width, light or dark, and for paper."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np

from jointfrf.dofs import Parameter
from jointfrf.extras import check_extras
from jointfrf.files import write_file
from jointfrf.kernel.arguments import FloatArray
from jointfrf.messages.finding import Finding, worst_first
from jointfrf.spelling import visible
from jointfrf.workbench.report.chart import Chart, chart_view, style_rules
from jointfrf.workbench.report.draw import Drawing, draw
from jointfrf.workbench.report.figure import Figure
from jointfrf.workbench.report.table import VERDICT, Table, shown, turned, without_repeats, written

__all__ = [
    "Document",
    "HeatMap",
    "Listing",
    "Part",
    "Picture",
    "Section",
    "Sketch",
    "Words",
    "make_document",
    "section_of_command",
    "words_of_findings",
    "write_document",
]

#: Columns that fit on any screen; columns above which a table is written smaller, and above which they become rows.
_NARROW, _WIDE, _WIDEST = 4, 9, 12
#: Folder of templates and styles.
_FOLDER = Path(__file__).parent
#: Number of columns above which a map is written smaller.
_DENSE = 8


@dataclass(frozen=True)
class Words:
    """Sentences: paragraphs, or with `kind` a list of notes, warnings or findings.

    `folded` has for each sentence the texts that a click shows, and that paper shows.
    """

    sentences: Sequence[str]
    kind: str = ""
    folded: Sequence[Sequence[str]] = ()


class Picture(NamedTuple):
    """A drawn figure, whose SVG file becomes part of the page. A `Figure` is drawn for its page."""

    figure: Figure
    drawing: Drawing


@dataclass(frozen=True)
class Sketch:
    """A sketch: SVG whose colours follow the page, its caption, and its description in words."""

    key: str
    svg: str
    caption: str
    alt: str


@dataclass(frozen=True)
class HeatMap:
    """Numbers by row and column, shaded from `light` (no shade) to `dark`; NaN is left empty.

    With `log` the shade is proportional to the logarithm, up to the largest value if it is above `dark`.
    """

    key: str
    title: str
    corner: str
    rows: Sequence[str]
    columns: Sequence[str]
    values: FloatArray
    light: float
    dark: float
    note: str = ""
    digits: int = 2
    log: bool = False

    @property
    def darkest(self) -> float:
        """Value of the darkest shade."""
        finite = self.values[np.isfinite(self.values)]
        return max(self.dark, float(finite.max())) if self.log and finite.size else self.dark


@dataclass(frozen=True)
class Listing:
    """A verbatim text that a click shows; with `printed` on paper, too."""

    name: str
    text: str
    printed: bool = False


Part = Table | Words | Figure | Picture | Chart | Sketch | HeatMap | Listing


@dataclass(frozen=True)
class Section:
    """A heading and its parts; `more` are parts that a click on their name shows.

    A part that is None, or a table or text without content, is left out.
    """

    key: str
    heading: str
    parts: Sequence[Part | None]
    more: tuple[str, Sequence[Part]] = ("", ())


@dataclass(frozen=True)
class Document:
    """The content of a page; sections without content are left out."""

    title: str
    about: str
    sections: Sequence[Section] = field(default_factory=tuple)

    def __post_init__(self) -> None:
        kept = [replace(one, parts=[part for part in one.parts if not _is_empty(part)]) for one in self.sections]
        object.__setattr__(self, "sections", [one for one in kept if one.parts])

    @property
    def parts(self) -> list[Part]:
        """All parts of all sections."""
        return [part for one in self.sections for part in (*one.parts, *one.more[1]) if part is not None]


def _is_empty(part: Part | None) -> bool:
    content = {Table: "rows", Words: "sentences", Listing: "text"}.get(type(part))
    return part is None or (content is not None and not getattr(part, content))


def section_of_command(command: str) -> Section:
    """Return the section with the command that made a page."""
    return Section("made", "How this was made", [Listing("", command)])


#: Largest number of characters of a finding in one line of a page.
_ONE_LINE = 84


def words_of_findings(findings: Sequence[Finding]) -> list[Words]:
    """Return warnings and notes as lists, the worst first, with a line for each code and long texts folded below it.

    Examples
    --------
    >>> import jointfrf as jf
    >>> from jointfrf.workbench.report.document import words_of_findings
    >>> (words,) = words_of_findings([jf.Finding("equal-points", about=(a, "b")) for a in "cd"])
    >>> words.sentences
    ['c, b are equal joints, which share their parameters (and 1 more) [equal-points]']
    >>> words.folded
    [['c, b are equal joints, which share their parameters.', 'd, b are equal joints, which share their parameters.']]
    """
    words = []
    for severities, style in ((("error", "warning"), "warnings"), (("note",), "notes")):
        groups: dict[str, list[str]] = {}
        for one in worst_first(findings):
            if one.severity in severities:
                groups.setdefault(one.code, []).append(one.text)
        heads = [_head(texts) for texts in groups.values()]
        folded = [
            [f"{text}." for text in texts] if head.rstrip(".") != texts[0] else []
            for head, texts in zip(heads, groups.values(), strict=True)
        ]
        if heads:
            coded = [f"{head} [{code}]" for head, code in zip(heads, groups, strict=True)]
            words.append(Words(coded, style, folded))
    return words


def _head(texts: Sequence[str]) -> str:
    """Return the line of a group of findings: the first one, cut to one line."""
    first, more = texts[0], f" (and {len(texts) - 1} more)" if len(texts) > 1 else ""
    if len(first) > _ONE_LINE:
        ends = [match.start() for match in re.finditer(r"[;,:(](?= )|(?<= )[(]| (?=%|and|which|because)", first)]
        cut = max((end for end in ends if _ONE_LINE // 3 < end <= _ONE_LINE), default=first.rfind(" ", 0, _ONE_LINE))
        first = first[: cut if cut > 0 else _ONE_LINE].rstrip(" ;,:(") + " …"
    return first + (more or ("" if first.endswith("…") else "."))


def make_document(document: Document) -> str:
    """Return a page as HTML.

    Parameters
    ----------
    document : Document
        Content of the page.

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
    from markupsafe import Markup

    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_FOLDER), autoescape=True, undefined=jinja2.StrictUndefined,
        keep_trailing_newline=True, trim_blocks=True, lstrip_blocks=True, finalize=_seen,
    )  # fmt: skip
    charts = [part for part in document.parts if isinstance(part, Chart)]
    script = (_FOLDER / "chart.js").read_text(encoding="utf-8") if charts else ""
    script = script.replace("\r\n", "\n").replace("\r", "\n")  # as a browser reads it, whose checksum must be the same
    return environment.get_template("page.html.jinja").render(
        document=document,
        policy=_policy(script),
        version=version("jointfrf"),
        verdict=VERDICT,
        style=Markup(_style(document.parts, charts)),
        script=Markup(script),
        views=lambda parts: [_view(part) for part in parts],
    )


def write_document(document: Document, path: Path | str) -> Path:
    """Write a page as a file, in a folder that exists, and return the path of the file."""
    write_file(Path(path), make_document(document))
    return Path(path)


def _policy(script: str) -> str:
    """Return the security policy of the page: run this script, load nothing, send nothing."""
    checksum = b64encode(sha256(script.encode("utf-8")).digest()).decode("ascii")
    allowed = f"'sha256-{checksum}'" if script else "'none'"
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; "
        "form-action 'none'"
    )


def _seen(value: Any) -> Any:
    """Return a value with invisible characters of texts escaped; markup stays unchanged."""
    return visible(value, "\n\t") if type(value) is str else value


def _style(parts: Sequence[Part], charts: Sequence[Chart]) -> str:
    """Return the rules of style of a page: common rules, and rules of its parts."""
    kinds = {"chart": Chart, "map": HeatMap, "sketch": Sketch}
    names = ["page", *(name for name, kind in kinds.items() if any(isinstance(part, kind) for part in parts))]
    rules = [(_FOLDER / f"{name}.css").read_text(encoding="utf-8") for name in names]
    return "".join(rules) + (style_rules(charts) if charts else "")


def _view(part: Part) -> dict[str, Any]:
    """Return the fields of a part for the template; `kind` names its macro."""
    shown: dict[str, Any] = {}
    if isinstance(part, Figure):
        part = Picture(part, draw(part, png=False))
    if isinstance(part, Table):
        shown = _table_view(part)
    elif isinstance(part, Picture):
        shown = {"image": _as_address(part.drawing.svg)}
    elif isinstance(part, Chart):
        shown = chart_view(part)
    elif isinstance(part, HeatMap):
        shown = _map_view(part)
    return {"kind": type(part).__name__.lower(), "part": part, **shown}


def _as_address(svg: bytes) -> str:
    """Return a drawing as the address of an image, a quarter shorter than base64."""
    text = re.sub("<[^<>]*>", lambda tag: tag[0].replace("'", "").replace('"', "'"), svg.decode())
    return "data:image/svg+xml," + quote(" ".join(text.split()), safe=" !$&'()*+,-./:;=?@_~|")


def _map_view(part: HeatMap) -> dict[str, Any]:
    """Return the cells of a map: text, and its shade from 0 to 100."""
    known = np.where(np.isfinite(part.values), part.values, part.light)
    light, dark = part.light, part.darkest
    if part.log:
        known, light, dark = np.log(np.maximum(known, light)), np.log(light), np.log(dark)
    shades = 100 * np.clip((known - light) / (dark - light), 0, 1)
    rows = [
        (name, [(_map_text(v, part.digits), f"{s:.0f}") for v, s in zip(own, shade, strict=True)])
        for name, own, shade in zip(part.rows, part.values.tolist(), shades.tolist(), strict=True)
    ]
    ends = [f"{value:.3g}" for value in (part.light, part.darkest)]
    return {"rows": rows, "dense": len(part.columns) > _DENSE, "ends": ends}


def _map_text(value: float, digits: int) -> str:
    """Return the text of a cell of a map, with fewer decimals for larger values."""
    if np.isnan(value):
        return ""
    return f"{value:.{max(digits - (int(np.log10(abs(value))) if abs(value) >= 1 else 0), 0)}f}"


def _table_view(table: Table) -> dict[str, Any]:
    table = without_repeats(shown(table))
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
    """Return a parameter with its index and Greek letter as markup."""
    from markupsafe import Markup

    index = ",".join(dict.fromkeys((parameter.row, parameter.column))).replace("theta_", "θ").replace("theta", "θ")
    return Markup("<i>{}</i><sub>{}</sub>").format(parameter.kind, index)
