"""Measured FRFs against those regenerated or predicted with the joint, and maps of agreement and residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import compliance_unit
from jointfrf.frf.bands import line_slices
from jointfrf.frf.entry_groups import ZERO, own_size
from jointfrf.identification.fit_data import FitData, ModelData
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.workbench.report.document import HeatMap
from jointfrf.workbench.report.figure import Curve, Figure
from jointfrf.workbench.report.receptance import ReceptanceCurve, receptance_panels

__all__ = ["ComparedFrfs", "assurance", "compare_fit", "frf_figures", "frf_maps"]

#: Largest number of FRFs that are drawn.
_MOST = 24
#: Share of an FRF below which its noise counts as none.
_NO_NOISE = 1e-9
#: Value above which a cell of a map is shaded, and value of the darkest cell unless some are larger.
_LIGHT, _DARK = 1.0, 10.0
#: Agreement below which a cell is shaded, and agreement of the darkest cell.
_AGREES, _DIFFERS = 0.95, 0.6
#: Number of parts of the band in the map of the residual, and least number of lines of a part.
_PARTS, _LEAST_LINES = 8, 8
#: Mean square over the noise variance above which an FRF has signal, and number of lines that are tested.
_SIGNAL, _ASKED = 2.0, 200
#: Share of the differences that may lie below a panel.
_LOWEST = 0.05


@dataclass(frozen=True, eq=False)
class ComparedFrfs:
    """Measured and regenerated FRFs between channels, or between joint DOFs if channels have no rigid motion.

    Attributes
    ----------
    rows, columns : tuple of str
        Names of responses and forces.
    of_channels : bool
        Whether the FRFs are between channels.
    entries : tuple of (int, int)
        Rows and columns of the drawn FRFs.
    measured, regenerated : ndarray, shape (n_freq, n_entries)
        Drawn FRFs, m/N.
    residual : ndarray, shape (n_rows, n_columns)
        Root mean square of measured minus regenerated FRFs over all lines in the bands, excluded lines included. The
        unit is the noise of the FRF or of rigid motion, whichever is larger.
    reciprocity : ndarray, shape (n_rows, n_columns), or None
        Root mean square of h_pq - h_qp in units of the noise; NaN on the diagonal. None if rows and columns differ, or
        if FRFs need not be reciprocal.
    predicted : str
        Name of the FRFs that are compared with the measured ones.
    silent : int
        Number of FRFs with noise only, such as FRFs that are zero by symmetry; they are not drawn.
    """

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    of_channels: bool
    entries: tuple[tuple[int, int], ...]
    measured: ComplexArray
    regenerated: ComplexArray
    residual: FloatArray
    reciprocity: FloatArray | None
    predicted: str = "regenerated with the joint found"
    silent: int = 0

    @property
    def worst(self) -> int:
        """Number of the drawn FRF with the largest residual."""
        left = [self.residual[entry] for entry in self.entries]
        return int(np.argmax(np.where(np.isfinite(left), left, -1.0)))


def compare_fit(fit: Fit) -> ComparedFrfs:
    """Compare the FRFs of a fit with the prediction of the fitted joint and, if there are any, the models."""
    return _compare_joint(fit.data, fit.dofs) if isinstance(fit.data, FitData) else _compare_model(fit)


def _compare_joint(data: FitData, dofs: tuple[str, ...]) -> ComparedFrfs:
    """Regenerate the FRFs of a fit in pieces of the lines, and compare them with the measured FRFs."""
    same = data.responses.shape == data.forces.shape and np.array_equal(data.responses, data.forces)
    modes = data.modes
    of_channels = modes is not None
    joint_names = tuple(f"{side}:{dof}" for side in "jk" for dof in dofs)
    rows, columns = (data.response_names, data.force_names) if of_channels else (joint_names, joint_names)
    loud = _is_loud(data, of_channels=of_channels)
    entries = _entries(data, loud, of_channels=of_channels, same=same)
    p, q = np.array(entries).T
    n_freq = len(data.measured)
    shown = np.empty((2, n_freq, len(entries)), np.complex128)
    squares, counts = np.zeros((2, len(rows), len(columns))), np.zeros((2, len(rows), len(columns)))
    for own in line_slices(n_freq):
        h, variance = data.measured[own], data.noise_variance(own)
        regenerated = data.regenerated(own)
        if modes is None:
            h = data.responses @ h @ data.forces.T
            variance = data.responses**2 @ variance @ (data.forces**2).T
            apart = variance
        else:
            regenerated = modes[0] @ regenerated @ modes[1].T
            # Rigid motion at a channel carries the noise of all channels.
            rigid = [(mode @ own) ** 2 for mode, own in zip(modes, (data.responses, data.forces), strict=True)]
            of_rigid = rigid[0] @ np.where(np.isfinite(variance), variance, 0) @ rigid[1].T
            apart = np.where(np.isfinite(variance), np.maximum(variance, of_rigid), np.inf)
        shown[0, own], shown[1, own] = h[:, p, q], regenerated[:, p, q]
        # An FRF that is zero by symmetry has no information, and no noise.
        is_there = abs(h) ** 2 > ZERO**2 * own_size(h) if same or modes is None else np.ones_like(h, bool)
        _add(squares[0], counts[0], abs(h - regenerated) ** 2, np.where(is_there, apart, 0))
        if same:
            both = variance + variance.swapaxes(1, 2)
            both = np.where(is_there & (both > (_NO_NOISE * abs(h)) ** 2), both, 0)
            _add(squares[1], counts[1], abs(h - h.swapaxes(1, 2)) ** 2, both)
    with np.errstate(invalid="ignore", divide="ignore"):
        residual, reciprocity = np.sqrt(squares / np.where(counts > 0, counts, np.nan))
    if same:
        np.fill_diagonal(reciprocity, np.nan)
        # FRFs that were made reciprocal before have no information on reciprocity.
        same = bool((reciprocity > 0).any())
    is_shown = same and data.reciprocal
    return ComparedFrfs(
        rows, columns, of_channels, entries, shown[0], shown[1], residual, reciprocity if is_shown else None,
        silent=int((~loud).sum()),
    )  # fmt: skip


def _is_loud(data: FitData, *, of_channels: bool) -> NDArray[np.bool_]:
    """Return which FRFs contain more than noise, shape (n_rows, n_columns), or all of them if none does."""
    asked = np.unique(np.linspace(0, len(data.measured) - 1, min(len(data.measured), _ASKED)).astype(np.intp))
    h, variance = data.measured[asked], np.stack([data.noise_variance(slice(i, i + 1))[0] for i in asked])
    if not of_channels:
        h, variance = data.responses @ h @ data.forces.T, data.responses**2 @ variance @ (data.forces**2).T
    return _above_noise(abs(h) ** 2, variance)


def _above_noise(squares: NDArray[np.floating], variance: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Return which FRFs are larger than their noise, or all measured FRFs if none is."""
    known = np.isfinite(squares) & np.isfinite(variance)
    signal, noise = (np.where(known, values, 0).sum(axis=0) for values in (squares, variance))
    # Without noise, rounding is no signal.
    loud = (signal > _SIGNAL * noise) & (signal > ZERO**2 * signal.max(initial=0.0))
    return np.asarray(loud if loud.any() else known.any(axis=0), np.bool_)


def _compare_model(fit: Fit) -> ComparedFrfs:
    """Compare the FRFs of a fit of an assembly with the prediction of its models and the joint."""
    data = fit.data
    assert isinstance(data, ModelData)
    known = np.isfinite(data.variance).any(axis=0)
    loud = np.asarray(known & _above_noise(abs(data.measured) ** 2, data.variance), np.bool_)
    pairs = [(int(p), int(q)) for p, q in np.argwhere(loud)]
    driving = [(p, q) for p, q in pairs if fit.responses[p] == fit.forces[q]]
    rest = [one for one in pairs if one not in driving]
    entries = driving[:_MOST]
    entries += _evenly(rest, _MOST - len(entries))
    p, q = np.array(entries).T
    squares = np.where(np.isfinite(data.residual), abs(data.residual) ** 2, 0).sum(axis=0)
    counts = np.isfinite(data.residual).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        residual = np.sqrt(squares / np.where(counts > 0, counts, np.nan))
    return ComparedFrfs(
        fit.responses, fit.forces, True, tuple(entries), data.measured[:, p, q], data.predicted[:, p, q], residual,
        None, "predicted by the models and the joint found", int((known & ~loud).sum()),
    )  # fmt: skip


def _add(squares: FloatArray, counts: FloatArray, own: NDArray[np.floating], variance: FloatArray) -> None:
    """Add squares in units of their variance if both are known."""
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = own / variance
    known = np.isfinite(ratio) & (variance > 0)
    squares += np.where(known, ratio, 0).sum(axis=0)
    counts += known.sum(axis=0)


def _entries(data: FitData, loud: NDArray[np.bool_], *, of_channels: bool, same: bool) -> tuple[tuple[int, int], ...]:
    """Return the FRFs to draw: at one channel, across the joint, then other FRFs; evenly spread if there are many."""
    n, (n_rows, n_columns) = len(data.responses) // 2, loud.shape
    side_of_row, side_of_column = (
        list((matrix[n:] != 0).any(axis=0)) if of_channels else [i >= n for i in range(2 * n)]
        for matrix in (data.responses, data.forces)
    )
    driving = [(i, i) for i in range(min(n_rows, n_columns))] if same or not of_channels else []
    across = [(p, q) for p in range(n_rows) for q in range(n_columns) if not side_of_row[p] and side_of_column[q]]
    known = {*driving, *across}
    rest = [(p, q) for p in range(n_rows) for q in range(n_columns) if (p, q) not in known]
    kept: list[tuple[int, int]] = []
    for pairs, most in ((driving, _MOST // 3), (across, _MOST // 3), (rest, _MOST)):
        kind = [pair for pair in pairs if loud[pair]]
        kept += _evenly(kind, min(most, _MOST - len(kept)))
    return tuple(kept)


def _evenly(pairs: Sequence[tuple[int, int]], most: int) -> list[tuple[int, int]]:
    """Return evenly spread pairs."""
    count = min(most, len(pairs))
    return [pairs[round(i * (len(pairs) - 1) / max(count - 1, 1))] for i in range(count)]


def frf_figures(compared: ComparedFrfs, freq_hz: FloatArray) -> list[Figure]:
    """Return figures of modulus and phase of the drawn FRFs."""
    figures, up = [], np.argsort(freq_hz, kind="stable")
    for i, (p, q) in enumerate(compared.entries):
        names = (compared.rows[p], compared.columns[q])
        ends = [name.rpartition(":")[2].lstrip("+-") for name in names]
        curves = [
            ReceptanceCurve("measured", freq_hz[up], compared.measured[up, i], "wide"),
            ReceptanceCurve(compared.predicted, freq_hz[up], compared.regenerated[up, i], "fitted"),
        ]
        modulus, phase = receptance_panels("", f"modulus, {compliance_unit(ends[0], ends[1])}", curves)
        left = abs(compared.measured[up, i] - compared.regenerated[up, i])
        difference = Curve("modulus of their difference", freq_hz[up], np.asarray(left, np.float64), "difference")
        limits = _limits(modulus.curves, difference.y)
        panels = (replace(modulus, curves=(*modulus.curves, difference), y_limits=limits), phase)
        figures.append(Figure(f"frf-{i + 1}", f"Response {names[0]}, force {names[1]}", panels))
    return figures


def _limits(curves: tuple[Curve, ...], difference: FloatArray) -> tuple[float, float] | None:
    """Return limits along y that contain the FRFs, and their difference except its lowest part."""
    values = np.concatenate([curve.y for curve in curves])
    values = values[np.isfinite(values) & (values > 0)]
    left = difference[np.isfinite(difference) & (difference > 0)]
    if values.size == 0:
        return None
    low = min(float(values.min()), float(np.quantile(left, _LOWEST)) if left.size else np.inf)
    return low / 1.5, 1.5 * float(values.max())


def frf_maps(fit: Fit, compared: ComparedFrfs) -> list[HeatMap]:
    """Return maps by response and force: residual, and agreement or reciprocity if they are known."""
    if isinstance(fit.data, ModelData):
        return [assurance_map(fit), residual_map(compared), band_map(fit)]
    return [one for one in (residual_map(compared), reciprocity_map(compared)) if one]


def _map(compared: ComparedFrfs, key: str, title: str, values: FloatArray, note: str) -> HeatMap:
    return HeatMap(
        key, f"{title}, in units of the noise", "response \\ force", compared.rows, compared.columns, values, _LIGHT,
        _DARK, note, log=True,
    )  # fmt: skip


def residual_map(compared: ComparedFrfs) -> HeatMap:
    """Return the map of the residual by response and force."""
    where = "channel" if compared.of_channels else "joint DOF"
    if compared.predicted != "regenerated with the joint found":
        note = (
            "Root mean square of measured minus predicted over the lines used, in units of the noise of the FRF. About "
            "1 is noise. A row or a column well above 1 is a channel that does not fit: gain, place, direction, or a "
            "part of the model near it."
        )
    else:
        note = (
            "Root mean square of measured minus regenerated over the lines used, in units of the noise of the FRF, or "
            "of rigid motion there if that has more. About 1 or below is noise. A row and a column well above 1 are a "
            "channel that does not fit (gain, place, direction); the rows and columns of a side, one whose channels do "
            "not move as a rigid body."
        )
    return _map(compared, "residual-map", f"Residual by {where}", compared.residual, note)


def reciprocity_map(compared: ComparedFrfs) -> HeatMap | None:
    """Return the map of h_pq - h_qp, or None if there is none."""
    if compared.reciprocity is None:
        return None
    note = (
        "Root mean square of h_pq - h_qp in units of its noise: 1 is noise. A row well above 1 is a response and a "
        "force that are not at one place or in one direction."
    )
    return _map(compared, "reciprocity-map", "Reciprocity", compared.reciprocity, note)


def assurance(measured: ComplexArray, predicted: ComplexArray) -> FloatArray:
    """Return the frequency response assurance criterion of each FRF, shape (n_o, n_i).

    Parameters
    ----------
    measured, predicted : ndarray, shape (n_freq, n_o, n_i)
        Measured and predicted FRFs; NaN for entries that were not measured.

    Returns
    -------
    ndarray
        FRAC = |sum m conj(p)|^2 / (sum |m|^2 sum |p|^2) over the lines, from 0 to 1; a constant factor does not change
        it. NaN for FRFs that were not measured.

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
