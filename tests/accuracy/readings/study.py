"""Realisations of every reading of the noise: the numbers and the exact FRFs are computed once for all of them."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from jointfrf.dofs import rigid_offset
from jointfrf.errors import IllConditionedWarning
from jointfrf.frf.bands import in_bands
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.workbench.cases.keys import BandSet, Observed
from jointfrf.workbench.cases.known_joint.exact import (
    SHORT_FORM,
    Exact,
    exact_frfs,
    joint_lines,
    measured,
    needed_frfs,
    noise_stream,
)
from jointfrf.workbench.cases.known_joint.keys import ExpectedErrors, KnownJointCase
from jointfrf.workbench.cases.known_joint.realisations import chunk_size
from jointfrf.workbench.cases.known_joint.regenerate import regenerate

from .printed_values import ErrorQuantity, PrintedTable, printed_tables
from .reading import Draw, NoiseScale, Reading, every_reading, noise_numbers, reference_moduli
from .score import Score, score

#: A range of fewer lines asks for a spacing of its own.
_FEWEST_LINES = 100
#: Lines on which two cases are compared.
_COMPARED = 3


@dataclass(frozen=True)
class Window:
    """An FRF that is regenerated in a band: `exact` holds the lines of the band, its observed point moved."""

    known: ExpectedErrors
    exact: Exact
    observed: Observed


@dataclass(frozen=True)
class DrawTask:
    """All realisations of one draw for one method.

    Attributes
    ----------
    exact : Exact
        As far as the method needs it.
    method : str
    h : ndarray, shape (n_freq, m, m)
        Exact FRFs that the method takes, m/N.
    draw : Draw
    scales : tuple of NoiseScale
    band_sets : tuple of BandSet
    windows : tuple of Window
        Regenerated with the means over the first set of bands.
    seed, count : int
        Seed, and number of realisations.
    """

    exact: Exact
    method: str
    h: ComplexArray
    draw: Draw
    scales: tuple[NoiseScale, ...]
    band_sets: tuple[BandSet, ...]
    windows: tuple[Window, ...]
    seed: int
    count: int


@dataclass(frozen=True)
class Realised:
    """What the realisations of a draw on one scale gave.

    Attributes
    ----------
    theta : dict of str to ndarray, shape (count, 2 n)
        Set of bands to stiffness of all DOFs, then damping; NaN where K* could not be computed.
    errors : dict of ExpectedErrors to ndarray, shape (2, count)
        Errors (4.11) and (4.12), percent; NaN where there is no peak in the band.
    """

    theta: dict[str, FloatArray]
    errors: dict[ExpectedErrors, FloatArray]


def find_window(exact: Exact, known: ExpectedErrors, observed: Observed) -> Window:
    """Take the lines of a band, and move the point that is observed where the source looks at another one."""
    inside = in_bands(exact.freq_hz, [known.band])
    inner = slice(exact.n, 2 * exact.n)
    move = rigid_offset(exact.dofs, known.offset) if known.offset else np.eye(exact.n)

    def moved(h: ComplexArray, at: slice) -> ComplexArray:
        transform = np.eye(h.shape[1])
        transform[at, at] = move
        return np.asarray(transform @ h[inside] @ transform.T, np.complex128)

    own = replace(
        exact,
        freq_hz=exact.freq_hz[inside],
        k_initial=exact.k_initial[inside],
        h_initial=exact.h_initial[:0],
        h_c=moved(exact.h_c, exact.where(observed.point)),
        h_a=moved(exact.h_a, inner) if observed.point == "r" else exact.h_a[inside],
        h_b=moved(exact.h_b, inner) if observed.point == "s" else exact.h_b[inside],
    )
    return Window(known, own, observed)


def realise(task: DrawTask) -> list[Realised]:
    """Compute all realisations of a task, one result for each of its scales."""
    n_freq, size, _ = task.h.shape
    moduli = {scale.reference: reference_moduli(task.h, scale.reference) for scale in task.scales}
    theta = np.full((len(task.scales), len(task.band_sets), task.count, 2 * task.exact.n), np.nan)
    at_once = chunk_size(n_freq, size**2)
    for first in range(0, task.count, at_once):
        several = slice(first, min(first + at_once, task.count))
        numbers = noise_numbers(task.draw, task.h.shape, task.seed, first, several.stop - first)
        for s, scale in enumerate(task.scales):
            with warnings.catch_warnings():
                # Noise makes any line ill-conditioned now and then.
                warnings.simplefilter("ignore", IllConditionedWarning)
                k_joint = joint_lines(
                    task.exact, task.method, scale.pollute(task.h, moduli[scale.reference], numbers), "nan"
                )
            for b, band_set in enumerate(task.band_sets):
                theta[s, b, several] = band_set.means(task.exact.freq_hz, k_joint)
    return [_realised(task, own) for own in theta]


def _realised(task: DrawTask, theta: FloatArray) -> Realised:
    errors = {window.known: _window_errors(window, theta[0]) for window in task.windows}
    return Realised({band_set.name: own for band_set, own in zip(task.band_sets, theta, strict=True)}, errors)


def _window_errors(window: Window, theta: FloatArray) -> FloatArray:
    """Errors (4.11) and (4.12) of the FRF regenerated from each realisation, shape (2, count), percent."""
    exact, at = window.exact, window.exact.at(window.observed)
    good = np.isfinite(theta).all(axis=1)
    regenerated = regenerate(exact, theta[good], window.observed.point, window.observed.dof)
    actual, found = (_peaks(h, exact.freq_hz) for h in (exact.h_c[None, :, at, at], regenerated))
    errors = np.full((2, len(theta)), np.nan)
    errors[:, good] = abs(found / actual - 1) * 100
    return errors


def _peaks(h: ComplexArray, freq_hz: FloatArray) -> FloatArray:
    """Amplitude and frequency of the largest of (r, n_freq) FRFs, shape (2, r); NaN at an edge: there it is no peak."""
    modulus = np.abs(h)
    at = modulus.argmax(axis=1)
    found = np.array([modulus[np.arange(len(h)), at], freq_hz[at]])
    found[:, (at == 0) | (at == freq_hz.size - 1)] = np.nan
    return found


@dataclass(frozen=True)
class SameStructure:
    """Cases of the same structures and joint: what is computed for one serves all.

    Attributes
    ----------
    cases : tuple of KnownJointCase
    tables : tuple of PrintedTable
    """

    cases: tuple[KnownJointCase, ...]
    tables: tuple[PrintedTable, ...]

    def spacings(self, asked: Sequence[float]) -> list[float]:
        """Spacings of lines, Hz: the asked ones, or its own where the finest of them would leave a few lines only."""
        freq = self.cases[0].freq_hz
        few = float(freq[-1] - freq[0]) < _FEWEST_LINES * min(asked)
        return [float(freq[1] - freq[0])] if few and freq.size > 1 else list(asked)

    @property
    def n(self) -> int:
        """Number of joint DOFs."""
        return len(self.cases[0].joint.dofs)

    def observed(self, known: ExpectedErrors) -> Observed:
        """Return the FRF that published errors belong to."""
        return next(one for case in self.cases for one in case.observed if one.key == known.observed)

    def exact(self, spacing: float) -> Exact:
        """Exact FRFs on lines between the limits of the first case."""
        first, last = (float(self.cases[0].freq_hz[i]) for i in (0, -1))
        lines = np.round(first + spacing * np.arange(int((last - first) / spacing + 1 + 1e-9)), 9)
        return exact_frfs(replace(self.cases[0], freq_hz=lines))


@dataclass(frozen=True)
class ReadingsPlan:
    """What is compared.

    Attributes
    ----------
    spacings : tuple of float
        Of the frequency lines, Hz.
    shares : tuple of float
        Levels of the noise as shares of the printed one: 1 for what is printed.
    count, seed : int
        Realisations of each reading, and the seed they come from.
    readings : tuple of Reading
        All by default.
    """

    spacings: tuple[float, ...]
    shares: tuple[float, ...] = (1.0,)
    count: int = 300
    seed: int = 1
    readings: tuple[Reading, ...] = field(default_factory=lambda: tuple(every_reading()))


@dataclass(frozen=True)
class Explained:
    """How well a reading explains a printed table.

    Attributes
    ----------
    table : PrintedTable
    reading : Reading
    spacing : float
        Of the lines, Hz.
    own_spacing : bool
        Whether it is the only one, whatever others have.
    share : float
        Level of the noise as a share of the printed one.
    scores : tuple of Score
        One for each printed value.
    """

    table: PrintedTable
    reading: Reading
    spacing: float
    own_spacing: bool
    share: float
    scores: tuple[Score, ...]

    @property
    def inside(self) -> int:
        """Printed values inside the central 95 %."""
        return sum(one.inside for one in self.scores)

    @property
    def log_density(self) -> float:
        """Sum over the printed values."""
        return float(sum(one.log_density for one in self.scores))


def group_cases(cases: Sequence[KnownJointCase]) -> list[SameStructure]:
    """Put cases together whose exact FRFs are the same, and leave out those without printed values.

    Parameters
    ----------
    cases : sequence of KnownJointCase

    Returns
    -------
    list of SameStructure
    """
    groups: list[tuple[Exact, list[KnownJointCase]]] = []
    for case in cases:
        if not printed_tables([case]):
            continue
        few = exact_frfs(replace(case, freq_hz=case.freq_hz[:: max(1, case.freq_hz.size // _COMPARED)]))
        same = next((own for exact, own in groups if _are_same(exact, few)), None)
        if same is None:
            groups.append((few, [case]))
        else:
            same.append(case)
    return [SameStructure(tuple(own), tuple(printed_tables(own))) for _, own in groups]


def _are_same(a: Exact, b: Exact) -> bool:
    return a.dofs == b.dofs and all(
        np.array_equal(getattr(a, x), getattr(b, x)) for x in ("freq_hz", "h_a", "h_b", "h_c")
    )


def study_readings(
    group: SameStructure,
    plan: ReadingsPlan,
    mapped: Callable[[Callable[[DrawTask], list[Realised]], Iterable[DrawTask]], Iterable[list[Realised]]] = map,
) -> list[Explained]:
    """Compare the printed values of cases with realisations of every reading.

    One result for each spacing, share, reading and table. A realisation depends on the seed and its own number only.
    `mapped` is `map`, or that of an executor.
    """
    own = group.spacings(plan.spacings)
    tasks = {spacing: _tasks(group, group.exact(spacing), plan) for spacing in own}
    flat = [task for of_spacing in tasks.values() for task in of_spacing.values()]
    results = iter(mapped(realise, flat))
    found: list[Explained] = []
    for spacing, of_spacing in tasks.items():
        realised = {
            (*key, scale): one
            for key, task in of_spacing.items()
            for scale, one in zip(task.scales, next(results), strict=True)
        }
        alone = own != list(plan.spacings)
        found += [
            _explained(Explained(table, reading, spacing, alone, share, ()), realised, group.n)
            for share, reading, table in product(plan.shares, plan.readings, group.tables)
        ]
    return found


def _tasks(group: SameStructure, exact: Exact, plan: ReadingsPlan) -> dict[tuple[str, Draw], DrawTask]:
    """Return the work for one spacing of the lines: readings that draw the same numbers share a task."""
    tasks: dict[tuple[str, Draw], DrawTask] = {}
    for method in dict.fromkeys(value.quantity.method for table in group.tables for value in table.values):
        own = [(table, v.quantity) for table in group.tables for v in table.values if v.quantity.method == method]
        levels = dict.fromkeys(table.level * share for share in plan.shares for table, _ in own)
        band_sets = {quantity.bands.name: quantity.bands for _, quantity in own}
        errors = dict.fromkeys(quantity.known for _, quantity in own if isinstance(quantity, ErrorQuantity))
        scales: dict[Draw, dict[NoiseScale, None]] = {}
        for reading in plan.readings:
            drawn = scales.setdefault(_draw(reading, method, group.n), {})
            drawn.update(dict.fromkeys(reading.scale(level) for level in levels))
        short = SHORT_FORM.get(method, method)
        common = DrawTask(
            needed_frfs(exact, short), short, measured(exact, method), next(iter(scales)), (),
            tuple(band_sets.values()), tuple(find_window(exact, one, group.observed(one)) for one in errors),
            plan.seed + noise_stream(method), plan.count,
        )  # fmt: skip
        tasks |= {(method, draw): replace(common, draw=draw, scales=tuple(of)) for draw, of in scales.items()}
    return tasks


def _draw(reading: Reading, method: str, n: int) -> Draw:
    """Return the numbers that a reading takes for a method."""
    between = {"decoupling-rs": False, "decoupling-sr": False}
    return reading.draw(n, n if method.startswith("decoupling") else 2 * n, between.get(method, True))


def _explained(empty: Explained, realised: Mapping[tuple[str, Draw, NoiseScale], Realised], n: int) -> Explained:
    """Compare each value of a table with the realisations of a reading."""
    table, reading = empty.table, empty.reading
    scale = reading.scale(table.level * empty.share)
    scores = []
    for value in table.values:
        quantity = value.quantity
        found = realised[quantity.method, _draw(reading, quantity.method, n), scale]
        if isinstance(quantity, ErrorQuantity):
            values = found.errors[quantity.known][quantity.index]
        else:
            values = found.theta[quantity.bands.name][:, quantity.index]
        scores.append(score(values, value.value, value.unit, value.resolution(empty.spacing)))
    return replace(empty, scores=tuple(scores))
