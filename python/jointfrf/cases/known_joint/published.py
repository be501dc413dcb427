"""Tables that hold what a source prints beside what follows from it exactly: printed parameters, sensitive regions."""

from __future__ import annotations

import re

import numpy as np

from jointfrf.cases.comparison import verdict
from jointfrf.cases.keys import Observed
from jointfrf.cases.known_joint.compute import KnownJointResult, SensitiveBands, contrast
from jointfrf.cases.known_joint.keys import ExpectedRegions
from jointfrf.dofs import Parameter
from jointfrf.frf.bands import Band
from jointfrf.report.axes import bands_in_words
from jointfrf.report.table import Cell, Table

__all__ = [
    "JOINT_NAMES",
    "NO_PEAK",
    "band_table",
    "frf_name",
    "key_of",
    "printed_parameter_tables",
    "region_tables",
    "title_of",
]

#: Stands for the frequency of a peak that is not there.
NO_PEAK = "no peak in the band"
#: Joints by their names in tables.
JOINT_NAMES = {"initial": "first estimate", "actual": "actual"}
#: What the table of regions says of either.
_OF_JOINT = ("proposed, Hz", "inside, dB")
#: Twice as sensitive, dB.
_TWICE = 20 * np.log10(2)


def key_of(source: str) -> str:
    """Key of the table of a source."""
    return re.sub(r"[^a-z0-9]+", "-", source.lower()).strip("-")


def title_of(source: str) -> str:
    """Name of a source at the start of a title."""
    return source[:1].upper() + source[1:]


def frf_name(result: KnownJointResult, observed: Observed) -> str:
    """Name an observed FRF: "H_ss", with its direction where the case names one."""
    name = f"H_{observed.point * 2}"
    return name if observed.key == observed.point else f"{name} {result.case.joint.dofs[observed.dof]}"


def printed_parameter_tables(result: KnownJointResult) -> list[Table]:
    """Table of the FRFs regenerated from printed parameters; none where there are none."""
    lines = result.case.expected.printed
    if lines is None or not result.printed:
        return []
    cells: list[tuple[Cell, ...]] = []
    for one in result.printed:
        known = one.known
        observed = next(o for o in result.case.observed if o.key == known.observed)
        seen = f", {1e3 * float(np.linalg.norm(known.offset)):.3g} mm away" if known.offset else ""
        named = (known.source, frf_name(result, observed) + seen, bands_in_words([known.band]), known.method)
        for what, published, found, good in (
            ("amplitude (4.11)", known.amplitude, one.amplitude, one.amplitude_fits),
            ("frequency (4.12)", known.frequency, one.frequency, one.frequency_fits),
        ):
            cells.append((*named, what, published, NO_PEAK if found is None else found, verdict(good)))
    columns = ("source", "FRF", "band, Hz", "method", "error", "thesis, %", "from the printed parameters, %", "")
    note = (
        f"On lines {lines.step:g} Hz apart, without noise: what differs is the model, the lines or the printed"
        f" digits. It fits within {lines.amplitude_within_percent:g} % of the printed amplitude error, and within "
        f"{lines.lines_within:g} lines of the printed frequency error; an empty cell fits where there is no peak."
    )
    title = "Errors of FRFs regenerated from the printed parameters"
    return [Table("printed-parameters", title, columns, tuple(cells), _failing(cells), note, columns[6:7])]


def region_tables(result: KnownJointResult) -> list[Table]:
    """Tables of the regions that the source finds sensitive, one for each source."""
    rows: dict[str, list[tuple[Cell, ...]]] = {}
    for known in result.case.expected.regions:
        rows.setdefault(known.source, []).extend(_region_rows(result, known))
    of_joints = (f"{joint}: {what}" for joint in JOINT_NAMES.values() for what in _OF_JOINT)
    columns = ("parameter", "FRF", "region, Hz", *of_joints, "")
    note = (
        "Inside: median sensitivity of the FRF on the lines of the region relative to that on the lines outside all "
        "regions of the parameter. A region fits where the FRF is at least twice as sensitive inside (6 dB), with the "
        "first estimate of the joint, which is what a user has, or with the actual joint."
    )
    return [
        Table(key_of(source), f"{title_of(source)}: sensitive regions", columns, tuple(own), _failing(own), note,
              tuple(column for column in columns if column.endswith("dB")))
        for source, own in rows.items()
    ]  # fmt: skip


def _region_rows(result: KnownJointResult, known: ExpectedRegions) -> list[tuple[Cell, ...]]:
    observed = next(o for o in result.case.observed if o.key == known.observed)
    rows = []
    for band in known.bands:
        cells: list[Cell] = [known.parameter, frf_name(result, observed), bands_in_words([band])]
        levels = []
        for sensitive in _both(result):
            level = _level(result, sensitive, known, band)
            levels.append(level)
            cells += [_proposed(sensitive, observed, known.parameter), level]
        rows.append((*cells, verdict(any(level is not None and level >= _TWICE for level in levels))))
    return rows


def _both(result: KnownJointResult) -> tuple[SensitiveBands, SensitiveBands]:
    """With the first estimate, and with the actual joint."""
    return result.from_initial, SensitiveBands(result.sensitivities, result.proposals)


def _level(result: KnownJointResult, sensitive: SensitiveBands, known: ExpectedRegions, band: Band) -> float | None:
    change = sensitive.sensitivities[known.observed].change[result.case.parameters.index(known.parameter)]
    return contrast(result.exact.freq_hz, change, band, known.bands)


def _proposed(sensitive: SensitiveBands, observed: Observed, parameter: Parameter) -> str:
    return bands_in_words(sensitive.proposals[observed.key, parameter]) or "none"


def band_table(result: KnownJointResult) -> Table:
    """Table of the bands of the case beside those proposed with either joint."""
    sets, observed = result.case.band_sets, result.case.observed
    cells: tuple[tuple[Cell, ...], ...] = tuple(
        (
            parameter,
            "; ".join(dict.fromkeys(bands_in_words(s.bands[parameter]) for s in sets)),
            joint,
            *(_proposed(sensitive, one, parameter) for one in observed),
        )
        for parameter in result.case.parameters
        for joint, sensitive in zip(JOINT_NAMES.values(), _both(result), strict=True)
    )
    proposed = tuple(f"proposed from {frf_name(result, one)}, Hz" for one in observed)
    columns = ("parameter", "bands of the case, Hz", "joint", *proposed)
    note = (
        "Proposed: where the smoothed sensitivity of the FRF stays within 20 dB of its largest value. Before the "
        "identification a user has the first estimate only."
    )
    return Table("bands", "Sensitive bands", columns, cells, note=note)


def _failing(cells: list[tuple[Cell, ...]]) -> tuple[int, ...]:
    return tuple(i for i, row in enumerate(cells) if row[-1] == verdict(False))
