"""What the page of a fit of an assembly has beside: how each FRF agrees, where the residual is, unknowns, what next."""

from __future__ import annotations

import numpy as np

from jointfrf.identification.fit_data import ModelData
from jointfrf.identification.model.next_channels import NextChannel
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.workbench.report.document import HeatMap, Part, Words
from jointfrf.workbench.report.table import Cell, Table

__all__ = ["assurance", "assurance_map", "band_map", "is_wide", "next_parts", "next_sentences", "unknowns_table"]

#: An interval whose half is more than this share of a value is wide: designers ask for a stiffness to 10 %.
_WIDE = 0.1
#: Agreement from which on a cell is shaded, and that of the darkest.
_AGREES, _DIFFERS = 0.95, 0.6
#: Parts of the band in the map of the residual, and lines that each holds at least.
_PARTS, _LEAST_LINES = 8, 8
#: Residuals over noise of cells that are shaded first, and darkest unless some are larger.
_LIGHT, _DARK = 1.0, 10.0
#: Unknowns have moved from this many standard deviations of the prior on; the FRFs say little of one whose standard
#: deviation they leave above this share.
_MOVED, _UNCHANGED = 1.0, 0.9
#: Channels that are named, and shares that are printed alike.
_NAMED, _SAME = 3, 0.01


def assurance(measured: ComplexArray, predicted: ComplexArray) -> FloatArray:
    """Return the frequency response assurance criterion of each FRF, shape (n_o, n_i).

    Parameters
    ----------
    measured, predicted : ndarray, shape (n_freq, n_o, n_i)
        NaN where nothing was measured.

    Returns
    -------
    ndarray
        FRAC = |sum m conj(p)|^2 / (sum |m|^2 sum |p|^2) over the lines, from 0 to 1; a constant factor does not change
        it. NaN where nothing was measured.

    References
    ----------
    W. Heylen, S. Lammens, FRAC: a consistent way of comparing frequency response functions, Proc. Int. Conf. on
    Identification in Engineering Systems, Swansea 1996, 48-57; R. J. Allemang, The modal assurance criterion - twenty
    years of use and abuse, Sound and Vibration 37 (2003) no. 8, 14-23.
    """
    known = np.isfinite(measured) & np.isfinite(predicted)
    m, p = np.where(known, measured, 0), np.where(known, predicted, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        found = abs((m * p.conj()).sum(axis=0)) ** 2 / ((abs(m) ** 2).sum(axis=0) * (abs(p) ** 2).sum(axis=0))
    return np.asarray(found, float)


def assurance_map(fit: Fit) -> HeatMap:
    """Return the map of FRAC by response and force."""
    data = fit.data
    assert isinstance(data, ModelData)
    note = (
        "Frequency response assurance criterion |Σ m p*|² / (Σ |m|² Σ |p|²) of measured m and predicted p over the "
        "lines used (Heylen and Lammens 1996): 1 where they differ by a constant factor only. Peaks weigh most."
    )
    return HeatMap(
        "frac-map", "Agreement of each FRF (FRAC)", "response \\ force", fit.responses, fit.forces,
        assurance(data.measured, data.predicted), _AGREES, _DIFFERS, note, 3,
    )  # fmt: skip


def band_map(fit: Fit) -> HeatMap:
    """Return the map of the residual by channel and part of the band."""
    data = fit.data
    assert isinstance(data, ModelData)
    up = np.argsort(fit.freq_hz, kind="stable")
    parts = np.array_split(up, max(1, min(_PARTS, fit.freq_hz.size // _LEAST_LINES)))
    squares, known = np.nan_to_num(abs(data.residual) ** 2), np.isfinite(data.residual)
    rows = [*(f"response {name}" for name in fit.responses), *(f"force {name}" for name in fit.forces)]
    values = []
    for axis, names in ((2, fit.responses), (1, fit.forces)):
        for i in range(len(names)):
            own = [np.take(part.sum(axis=axis), i, axis=1) for part in (squares, known)]
            with np.errstate(invalid="ignore", divide="ignore"):
                values.append([float(np.sqrt(own[0][part].sum() / own[1][part].sum())) for part in parts])
    columns = [f"{fit.freq_hz[part[0]]:.4g}–{fit.freq_hz[part[-1]]:.4g} Hz" for part in parts]
    note = (
        "Root mean square in units of the noise. A column well above 1 is a part of the band where the models are off."
    )
    return HeatMap(
        "residual-band-map", "Residual by channel and band, in units of the noise", "channel \\ band", rows, columns,
        np.array(values), _LIGHT, _DARK, note, log=True,
    )  # fmt: skip


def unknowns_table(fit: Fit) -> Table | None:
    """Return what the FRFs say of the unknowns beside the joint that have a prior; None where there are none."""
    errors, rows = fit.std_error, list[tuple[Cell, ...]]()
    for one in fit.parameters:
        if one.origin == "joint" or one.prior is None:
            continue
        moved, left = (fit.value[one.name] - one.prior[0]) / one.prior[1], errors[one.name] / one.prior[1]
        says = "known from the prior only" if left > _UNCHANGED else "moved" if abs(moved) > _MOVED else "confirmed"
        prior = f"{one.prior[0]:.4g} ± {one.prior[1]:.2g}"
        found = f"{fit.value[one.name]:.5g} ± {errors[one.name]:.2g}"
        rows.append((one.name, one.unit, prior, found, f"{moved:+.2f}", f"{100 * left:.3g} %", says))
    if not rows:
        return None
    note = "Standard deviations; moved: in those of the prior; left: what the FRFs leave of the prior's."
    columns = ("unknown", "unit", "prior", "found", "moved", "left", "the FRFs")
    return Table("unknowns", "Unknowns of the models, before and after", columns, tuple(rows), note=note)


def is_wide(fit: Fit) -> bool:
    """Whether a parameter of the joint has a wide interval."""
    intervals = fit.confidence_interval(0.95)
    return any(
        not intervals[one.name][1] - intervals[one.name][0] < 2 * _WIDE * abs(fit.value[one.name])
        for one in fit.parameters
        if one.origin == "joint"
    )


def next_sentences(fit: Fit) -> list[str]:
    """Say what to measure next where intervals of the joint are wide; nothing where they are not."""
    data = fit.data
    if not isinstance(data, ModelData) or not is_wide(fit):
        return []
    found = data.next_channels()
    if not found:
        return ["No other translation of the models would narrow the widest interval by a tenth; less noise would."]
    sentences = []
    of_dof: dict[str, list[NextChannel]] = {}
    for one in found:
        of_dof.setdefault(one.dof, []).append(one)
    for dof, (one, *others) in list(of_dof.items())[:_NAMED]:
        # FRFs of one drive point are reciprocal: a sensor or a force there give the same.
        is_either = bool(others) and all(
            abs(others[0].shares[key] - share) < _SAME for key, share in one.shares.items()
        )
        what = "a response or a force" if is_either else f"a {one.kind}"
        others_of = {name: share for name, share in one.shares.items() if name != one.widest}
        text = f"{100 * one.shares[one.widest]:.2g} % of that of {one.widest}"
        if others_of:
            best = min(others_of, key=others_of.__getitem__)
            text += f" and {100 * others_of[best]:.2g} % of that of {best}"
        sentences.append(f"Measure {what} at {dof}: of the standard errors, it would leave {text}.")
    return sentences


def next_parts(fit: Fit) -> list[Part]:
    """Return what to measure next, where that is asked."""
    sentences = next_sentences(fit)
    if not sentences:
        return []
    how = "Each by itself, with lines and relative noise of this test, as the models and the joint found predict it."
    return [Words(sentences), Words([how], "notes")]
