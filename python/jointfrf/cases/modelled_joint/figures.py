"""Figures of a case of a modelled joint."""

from __future__ import annotations

import numpy as np

from jointfrf.cases.modelled_joint.compute import ModelledJointResult, moving_stiffness
from jointfrf.dofs import is_rotation
from jointfrf.identification.fit_data import ModelData
from jointfrf.report.figure import Curve, Figure, Panel, Ribbon

__all__ = ["modelled_figures"]


def modelled_figures(result: ModelledJointResult) -> list[Figure]:
    """Return stiffness and loss factor over frequency, and the FRFs of the first realisation."""
    return [_stiffness(result), _frfs(result)]


def _stiffness(result: ModelledJointResult) -> Figure:
    case = result.case
    exact, constant = (moving_stiffness(j, case.freq_hz) for j in (case.truth.joint, result.constant.joint))
    found = np.array([draw.stiffness for draw in result.draws])
    panels = []
    for d, dof in enumerate(a for a, b in case.truth.joint.laws if a == b):
        unit = "N m/rad" if is_rotation(dof) else "N/m"
        for part, label in ((lambda k: k.real, f"Re K*, {unit}"), (lambda k: k.imag / k.real, "loss factor")):
            low, high = np.percentile(part(found[:, :, d]), [2.5, 97.5], axis=0)
            panels.append(
                Panel(
                    dof,
                    "frequency, Hz",
                    label,
                    curves=(
                        Curve("actual", case.freq_hz, part(exact[:, d]), "actual"),
                        Curve("springs and dashpots", case.freq_hz, part(constant[:, d]), "mean"),
                    ),
                    ribbons=(Ribbon("95 % of the realisations", case.freq_hz, low, high, "ismm"),),
                )
            )
    return Figure(
        "stiffness", "Stiffness and loss factor of the joint: actual, found, and by springs and dashpots.",
        tuple(panels), columns=2,
    )  # fmt: skip


def _frfs(result: ModelledJointResult) -> Figure:
    case, panels = result.case, []
    first, constant = result.first.data, result.constant.data
    assert isinstance(first, ModelData)
    assert isinstance(constant, ModelData)
    for row, response in enumerate(case.responses):
        for column, force in enumerate(case.forces):
            title, freq = f"{response} by {force}", case.freq_hz
            curves = (
                Curve("fitted", freq, np.abs(first.predicted[:, row, column]), "actual"),
                Curve("measured", freq, np.abs(result.measured[:, row, column]), "measured"),
            )
            panels.append(Panel(title, "frequency, Hz", "|H|, m/N", curves=curves, log_y=True))
            residuals = (
                Curve("springs and dashpots", freq, np.abs(constant.residual[:, row, column]), "low"),
                Curve("laws of the case", freq, np.abs(first.residual[:, row, column]), "measured"),
            )
            panels.append(Panel(title, "frequency, Hz", "|residual| over noise", curves=residuals, log_y=True))
    return Figure(
        "frfs",
        "FRFs of the first realisation, measured and fitted; and their residual beside that of springs and dashpots.",
        tuple(panels),
        columns=2,
    )
