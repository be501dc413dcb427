"""Files of one identification: parameters as JSON, figures of the joint over frequency."""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from jointfrf.files import write_file
from jointfrf.identification.joint_fit import JointFit
from jointfrf.kernel.linear_algebra import invert

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["fit_figures", "write_fit"]


def fit_figures(fit: JointFit) -> dict[str, Figure]:
    """Figures of the identified joint: K* and compliance of each DOF, line by line and as fitted.

    Parameters
    ----------
    fit : JointFit
        What `identify` found.

    Returns
    -------
    dict of str to matplotlib Figure
        ``"joint_<dof>"`` for each DOF.

    Raises
    ------
    ImportError
        matplotlib is missing.
    """
    from matplotlib.figure import Figure

    figures = {}
    freq = fit.freq_hz
    model = fit.k_joint(freq)
    soft = invert(model, on_singular="nan")
    lines = invert(np.where(np.isfinite(fit.k_lines), fit.k_lines, 0), on_singular="nan")
    for d, dof in enumerate(fit.dofs):
        unit = fit.unit(f"k_{dof}")
        inverse = "m/N" if unit == "N/m" else "rad/(N m)"
        figure = Figure(figsize=(7.5, 6.0), layout="constrained")
        axes = figure.subplots(2, 2, sharex=True)
        low, high = fit.confidence_interval(0.95)[f"k_{dof}"]
        rows = (("K*", fit.k_lines[:, d, d], model[:, d, d], unit), ("C", lines[:, d, d], soft[:, d, d], inverse))
        for row, (name, each, fitted, its_unit) in zip(axes, rows, strict=True):
            for ax, part in zip(row, ("real", "imag"), strict=True):
                values, curve = getattr(each, part), getattr(fitted, part)
                ax.plot(freq, values, ".", ms=2.5, color="0.55", label="each line")
                ax.plot(freq, curve, "-", color="black", lw=1.6, label=f"fit ({fit.method})")
                if name == "K*" and part == "real" and np.isfinite(low) and np.isfinite(high):
                    ax.axhspan(low, high, color="0.8", alpha=0.6, lw=0, label="95 % interval of k")
                _limits(ax, values, curve)
                ax.set_ylabel(f"{'Re' if part == 'real' else 'Im'} {name} [{its_unit}]")
                ax.grid(True, color="0.9", lw=0.6)
                ax.ticklabel_format(axis="y", style="sci", scilimits=(-2, 3))
        for ax in axes[1]:
            ax.set_xlabel("frequency [Hz]")
        axes[0, 0].legend(loc="best", fontsize=8)
        figure.suptitle(f"Joint DOF {dof}: complex stiffness and compliance", fontsize=11)
        figures[f"joint_{dof}"] = figure
    return figures


def _limits(ax: object, values: np.ndarray, curve: np.ndarray) -> None:
    """Show what most lines say: a few lines near a singular matrix would hide the rest."""
    finite = values[np.isfinite(values)]
    if finite.size:
        low, high = np.percentile(finite, [5, 95])
        low, high = min(low, curve.min()), max(high, curve.max())
        margin = 0.15 * (high - low) or abs(high) or 1.0
        ax.set_ylim(low - margin, high + margin)  # type: ignore[attr-defined]


def write_fit(fits: Sequence[JointFit], folder: Path, source: str) -> list[Path]:
    """Write ``identification.json`` and one PNG a DOF for each fit; nothing is left half-written.

    Parameters
    ----------
    fits : sequence of JointFit
        Results on the same data; the figures of the second and later ones carry their method in the name.
    folder : Path
        Made if it is missing.
    source : str
        Name of the file that was measured, written into the JSON.

    Returns
    -------
    list of Path
        What was written.
    """
    text = json.dumps({"source": source, "fits": [fit.to_dict() for fit in fits]}, indent=2)
    contents: dict[str, str | bytes] = {"identification.json": text + "\n"}
    for i, fit in enumerate(fits):
        for name, figure in fit_figures(fit).items():
            drawn = io.BytesIO()
            figure.savefig(drawn, dpi=150)
            contents[f"{name}.png" if i == 0 else f"{name}_{fit.method}.png"] = drawn.getvalue()
    folder.mkdir(parents=True, exist_ok=True)
    for file, content in contents.items():
        write_file(folder / file, content)
    return [folder / file for file in contents]
