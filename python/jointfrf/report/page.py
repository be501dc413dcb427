"""One self-contained HTML report for a case."""

from __future__ import annotations

import base64
import re
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol

from jointfrf.cases.known_joint.compute import CaseResult
from jointfrf.cases.known_joint.tables import Row, Table, identified_rows, number, written
from jointfrf.kernel.arguments import FloatArray
from jointfrf.report.plots import Figure

__all__ = ["Reported", "make_report", "summary"]

_TEMPLATE = Path(__file__).with_name("page.html.jinja")
_PARAMETER = re.compile(r"^([kc])_(\w+)$")


def _joined(words: list[str]) -> str:
    return ", ".join(words[:-1]) + " and " + words[-1] if len(words) > 1 else "".join(words)


def summary(result: CaseResult, tables: list[Table]) -> list[str]:
    """Say in a few sentences what came out."""
    rows = identified_rows(result)
    by_key = {table.key: table for table in tables}
    sentences = _published(rows)
    frequencies = by_key["natural-frequencies"]
    known = sum(row[3] is not None for row in frequencies.rows)
    if known:
        agree = known - len(frequencies.failing)
        sentences.append(f"{agree} of {known} natural frequencies of the assembly agree with the expected ones.")
    if "limits" in by_key:
        limits = by_key["limits"]
        kept = len(limits.rows) - len(limits.failing)
        sentences.append(f"{kept} of {len(limits.rows)} root-mean-square errors are below their limits.")
    exact = by_key["noise-free"]
    sentences.append(
        f"Without noise {len(exact.rows) - len(exact.failing)} of {len(exact.rows)} checks of the equations are exact."
    )
    return sentences + _methods(rows)


def _published(rows: list[Row]) -> list[str]:
    sentences = []
    beside = [row for row in rows if row.source is not None]
    for source, noise, bands in dict.fromkeys((r.source, r.noise, r.bands) for r in beside):
        own = [r for r in beside if (r.source, r.noise, r.bands) == (source, noise, bands)]
        outside = [
            f"{r.parameter} (thesis {number(r.published)}, ours {number(r.low)} to {number(r.high)})"
            for r in own if not r.fits
        ]  # fmt: skip
        text = f"{str(source)[:1].upper()}{str(source)[1:]}, noise {noise}, bands {bands}: "
        text += f"{len(own) - len(outside)} of {len(own)} values of the thesis lie inside the central "
        text += f"{own[0].central:g} % of ours"
        sentences.append(text + (f"; {_joined(outside)} do not fit." if outside else "."))
    return sentences


def _methods(rows: list[Row]) -> list[str]:
    """Root-mean-square errors of all methods at noise levels where there are several."""
    sentences = []
    for noise in dict.fromkeys(row.noise for row in rows):
        errors: dict[str, dict[str, str]] = {}
        for row in rows:
            if row.noise == noise:
                name = row.method if row.method == "compliance" else f"{row.method} ({row.bands})"
                errors.setdefault(name, {})[row.parameter] = number(row.rmse_percent, 2)
        if len(errors) > 1:
            parameters = " / ".join(next(iter(errors.values())))
            each = "; ".join(f"{name} {' / '.join(values.values())}" for name, values in errors.items())
            sentences.append(f"RMSE in percent of {parameters}, noise {noise}: {each}.")
    return sentences


def _marked(text: str) -> str:
    """Give a parameter its index and Greek letter."""
    from markupsafe import Markup

    found = _PARAMETER.match(text)
    if not found:
        return text
    index = found[2].replace("theta_", "θ").replace("theta", "θ")
    return Markup("<i>{}</i><sub>{}</sub>").format(found[1], index)


def _for_template(table: Table) -> dict[str, Any]:
    return {
        "key": table.key,
        "title": table.title,
        "columns": table.columns,
        "numeric": [any(isinstance(row[c], float) for row in table.rows) for c in range(len(table.columns))],
        "rows": [[_marked(text) for text in row] for row in written(table)],
        "failing": table.failing,
        "note": table.note,
    }


class Reported(Protocol):
    """What a report says of any kind of case."""

    @property
    def folder(self) -> Path:
        """Where the case stands."""

    @property
    def title(self) -> str:
        """What it is."""

    @property
    def section(self) -> str:
        """Where the source treats it."""

    @property
    def freq_hz(self) -> FloatArray:
        """Frequency lines, Hz."""

    @property
    def seed(self) -> int:
        """Seed of the noise."""


def make_report(
    case: Reported, count: int, sentences: list[str], tables: list[Table], figures: list[tuple[Figure, bytes]]
) -> str:
    """Write the report of a case.

    Parameters
    ----------
    case : Reported
    count : int
        Realisations of the noise.
    sentences : list of str
        Summary.
    tables : list of Table
    figures : list of (Figure, bytes)
        Figures and their PNG files, which become part of the report.

    Returns
    -------
    str
        HTML without any link to another file.
    """
    import jinja2

    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, keep_trailing_newline=True)
    about = case.folder / "README.md"
    return environment.from_string(_TEMPLATE.read_text(encoding="utf-8")).render(
        case=case,
        count=count,
        lines=case.freq_hz.size,
        first=f"{case.freq_hz[0]:g}",
        last=f"{case.freq_hz[-1]:g}",
        version=version("jointfrf"),
        summary=sentences,
        tables=[_for_template(table) for table in tables],
        figures=[
            {
                "key": figure.key,
                "caption": figure.caption,
                "number": figure.number,
                "image": base64.b64encode(png).decode("ascii"),
            }
            for figure, png in figures
        ],
        about=about.read_text(encoding="utf-8") if about.is_file() else "",
        source=(case.folder / "case.toml").read_text(encoding="utf-8"),
    )
