"""SVG as matplotlib writes it, in a quarter of its length."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np

__all__ = ["shortened"]

_LINE = re.compile(r' d="M ([\d.\sL-]+?)\s*(z?)\s*"')
_STYLE = re.compile(r' style="([^"]*)"')
_DECIMALS = re.compile(r"\d+\.\d{3,}")


def shortened(svg: str) -> str:
    r"""Write a drawing shorter: nobody sees a hundredth of a typographic point.

    Parameters
    ----------
    svg : str
        As matplotlib writes it, text as text.

    Returns
    -------
    str
        Lines as steps from point to point, places in hundredths of a point, styles that occur often as classes; without
        names of groups and without space between elements.

    Examples
    --------
    >>> from jointfrf.report.svg import shortened
    >>> shortened('<g id="a"> <path d="M 1.2345 2 \nL 2.5 2.25 \n" style="fill: none"/> </g>')
    '<g><path d="m1.23 2 1.27 0.25" style="fill: none"/></g>'
    """
    svg = svg[svg.index("<svg") if "<svg" in svg else 0 :]
    svg = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", svg, flags=re.DOTALL)
    svg = re.sub(r">\s+<", "><", svg)
    svg = re.sub(r'<g id="[^"]*"', "<g", svg)
    svg = _LINE.sub(_steps, svg)
    svg = re.sub(r' (?:x|y|transform)="[^"]*"', lambda match: _DECIMALS.sub(_rounded, match[0]), svg)
    often = [style for style, count in Counter(_STYLE.findall(svg)).items() if count > 1]
    classes = {style: f"c{i}" for i, style in enumerate(often)}
    rules = "".join(f".{name}{{{style}}}" for style, name in classes.items())
    svg = _STYLE.sub(lambda match: f' class="{classes[match[1]]}"' if match[1] in classes else match[0], svg)
    return svg.replace("</style>", rules + "</style>", 1)


def _steps(match: re.Match[str]) -> str:
    """Write a line of straight pieces as its first point and the steps to the others."""
    points = np.round(np.array(match[1].replace("L", " ").split(), np.float64).reshape(-1, 2), 2)
    steps = np.diff(points, axis=0, prepend=0)
    return ' d="m' + " ".join(f"{value:.2f}".rstrip("0").rstrip(".") for value in steps.ravel()) + match[2] + '"'


def _rounded(number: re.Match[str]) -> str:
    return f"{float(number[0]):.2f}"
