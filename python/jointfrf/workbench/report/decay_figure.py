"""The figure of a free decay: frequency and damping of a mode over its amplitude."""

from __future__ import annotations

import numpy as np

from jointfrf.workbench.amplitude.decay import ModalDecay
from jointfrf.workbench.report.figure import Curve, Figure, Panel, Ribbon

__all__ = ["modal_decay_figure"]

#: Standard errors of a 95 % interval.
_QUANTILE = 1.96


def modal_decay_figure(mode: ModalDecay) -> Figure:
    """Return frequency and damping over the amplitude of the sensor that moves most, with 95 % intervals."""
    strongest = int(np.nanargmax(np.nanmean(mode.amplitude, axis=0)))
    seen = np.isfinite(mode.amplitude[:, strongest])
    order = np.flatnonzero(seen)[np.argsort(mode.amplitude[seen, strongest])]
    x, panels = mode.amplitude[order, strongest], []
    for label, value, error in zip(
        ("frequency, Hz", "damping ratio, 1"), (mode.freq_hz, mode.damping), mode.errors, strict=True
    ):
        own, half = value[order], _QUANTILE * (value * error)[order]
        ribbon = Ribbon("95 %", x, own - half, own + half, "ismm")
        curve = Curve("found", x, own, "ismm-points")
        panels.append(Panel("", f"amplitude of {mode.sensors[strongest]}, m", label, (curve,), (ribbon,), log_x=True))
    caption = f"Mode at {mode.name}: frequency and damping over the peak displacement of {mode.sensors[strongest]}"
    return Figure(f"decay-{mode.name.replace(' ', '-')}", caption, tuple(panels), columns=2)
