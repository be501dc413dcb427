"""Which frequencies tell about which parameter of a joint."""

from __future__ import annotations

import numpy as np

from jointfrf.identification.result import Fit, FittedParameter
from jointfrf.kernel.arguments import FloatArray
from jointfrf.report.axes import FREQUENCY
from jointfrf.report.figure import Curve, Figure, Panel
from jointfrf.report.fit_words import shown_name
from jointfrf.report.table import Cell, Table

__all__ = ["information_figure", "information_table"]

#: Parts of the band over which shares are summed, and lines a part at least.
_PARTS, _LEAST = 48, 4
#: Shares of the information below the frequencies in the table.
_QUANTILES = (0.1, 0.5, 0.9)
_STYLES = {"k": "ismm", "h": "stiffness", "c": "high"}
_LABELS = {"k": "stiffness k", "h": "hysteretic damping h", "c": "viscous damping c"}
#: Styles of other parameters of laws, in their order.
_OTHERS = ("stiffness", "high", "actual")


def information_table(fit: Fit, freq_hz: FloatArray, shares: FloatArray) -> Table:
    """Return for each parameter below which frequency a tenth, half and nine tenths of the information lie.

    Parameters
    ----------
    fit : Fit
    freq_hz : ndarray, shape (n_freq,)
        Rising, Hz.
    shares : ndarray, shape (n_freq, p)
        Share of each line.
    """
    total = np.cumsum(shares, axis=0)
    rows: list[tuple[Cell, ...]] = []
    for i, term in enumerate(fit.parameters):
        at = [min(int(np.searchsorted(total[:, i], q * total[-1, i])), freq_hz.size - 1) for q in _QUANTILES]
        rows.append((shown_name(term), *(float(freq_hz[a]) for a in at)))
    columns = ("parameter", *(f"{100 * q:.0f} % below, Hz" for q in _QUANTILES))
    note = "Eight tenths of what the data say of a parameter lie between the first and the last frequency."
    return Table("information-table", "Where the information lies", columns, tuple(rows), note=note)


def information_figure(fit: Fit, freq_hz: FloatArray, shares: FloatArray) -> Figure | None:
    """Draw the share of each part of the band in what is known of the parameters of each DOF; None for few lines."""
    parts = min(_PARTS, freq_hz.size // _LEAST)
    if parts < 3 or freq_hz[-1] == freq_hz[0]:
        return None
    edges = np.linspace(freq_hz[0], freq_hz[-1], parts + 1)
    at = np.clip(np.searchsorted(edges, freq_hz, side="right") - 1, 0, parts - 1)
    panels = []
    for dof in fit.dofs:
        terms = [(i, term) for i, term in enumerate(fit.parameters) if term.row == term.column == dof]
        if not terms:
            continue
        others = [term.kind for _, term in terms if term.kind not in _STYLES]
        curves = tuple(
            _steps(edges, np.bincount(at, shares[:, i], parts).astype(np.float64), term, others) for i, term in terms
        )
        panels.append(Panel(f"DOF {dof}", FREQUENCY, f"share of the band in {parts} parts, %", curves))
    caption = "Information density: how much each part of the band says about each parameter"
    return Figure("information", caption, tuple(panels), 2 if len(panels) > 1 else 1)


def _steps(edges: FloatArray, share: FloatArray, term: FittedParameter, others: list[str]) -> Curve:
    """Draw shares as steps; `others` are the kinds of this DOF that springs and dampers do not have."""
    style = _STYLES.get(term.kind) or _OTHERS[others.index(term.kind) % len(_OTHERS)]
    return Curve(_LABELS.get(term.kind, term.kind), np.repeat(edges, 2)[1:-1], np.repeat(100 * share, 2), style)
