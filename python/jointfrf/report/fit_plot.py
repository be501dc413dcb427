"""An identification as one figure: stiffness and compliance of the joint, measured and regenerated FRFs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from jointfrf.identification.fit_data import FitData
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import check_type
from jointfrf.report.draw import laid_out
from jointfrf.report.figure import Figure, Panel
from jointfrf.report.fit import fit_figures
from jointfrf.report.fit_frfs import compare_frfs, compare_model, frf_figures

__all__ = ["fit_overview", "plot"]

#: FRFs that are drawn, two beside each other.
_FRFS = 4


def fit_overview(fit: Fit) -> Figure:
    """Return K* and compliance of each DOF, and the first FRFs where the fit holds them, as one figure."""
    panels: list[Panel] = []
    for figure in fit_figures(fit):
        dof = figure.key.removeprefix("joint_")
        titles = (f"DOF {dof}: joint stiffness", "", f"DOF {dof}: joint compliance", "")
        panels += [replace(panel, title=title) for panel, title in zip(figure.panels, titles, strict=True)]
    if fit.data is not None:
        up = np.argsort(fit.freq_hz, kind="stable")
        compared = compare_frfs(fit.data, fit.dofs) if isinstance(fit.data, FitData) else compare_model(fit)
        frfs = frf_figures(compared, fit.freq_hz, up)[:_FRFS]
        for first in range(0, len(frfs), 2):
            beside = frfs[first : first + 2]
            for part in zip(*(figure.panels for figure in beside), strict=True):
                own = [
                    replace(panel, title=figure.caption if panel.log_y else "")
                    for panel, figure in zip(part, beside, strict=True)
                ]
                panels += [*own, *([Panel("", "", "")] * (2 - len(own)))]
    return Figure("joint", "Joint found", tuple(panels), 2)


def plot(fit: Fit) -> Any:
    """Draw the joint over frequency, K* and compliance of each DOF, and measured against regenerated FRFs.

    Parameters
    ----------
    fit : Fit
        A fit that was loaded shows no FRFs.

    Returns
    -------
    matplotlib.figure.Figure
        ``jf.plot(fit).savefig("joint.png")`` writes it.

    Raises
    ------
    MissingPackageError
        matplotlib is missing.
    """
    check_type("fit", fit, Fit)
    return laid_out(fit_overview(fit))
