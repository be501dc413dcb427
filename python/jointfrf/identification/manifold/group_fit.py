"""The fit of one group of joint DOFs: project smooth FRFs, linearise there, minimise, until convergence."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

from jointfrf.frf.bands import in_pieces, is_long
from jointfrf.identification.manifold.coordinates import DiagonalJoint
from jointfrf.identification.manifold.line_forms import FormMinimum, FormSquares, JointCoordinates, LineForms
from jointfrf.identification.manifold.on_manifold import (
    LineData,
    OnManifold,
    PriorOfM,
    expected_m,
    frfs_of_joint,
    normal_forms,
    prior_of_m,
    project,
    smooth_compliance,
    starts_on_manifold,
)
from jointfrf.identification.scatter import BLOCKS
from jointfrf.kernel.arguments import TINY, ComplexArray, FloatArray
from jointfrf.kernel.call import call_for_number

__all__ = [
    "FAR",
    "LITTLE_PATIENCE",
    "GroupFit",
    "GroupProblem",
    "UnknownCrossTerms",
    "effects_of",
    "fit_dofs",
    "fitted_frfs",
]

#: Maximum number of linearisations.
_MOST = 25
#: The fit has converged when the coordinates move by less than this many standard errors, root mean square.
_MOVED = 0.02
#: Steps of the projection: of the first one, of those after a small change of the joint, of lines started again.
_FIRST_STEPS, _NEXT_STEPS, _OTHER_STEPS = 30, 8, 25
#: A line is omitted if its distance from the manifold exceeds this multiple of the squares per unknown and of the
#: noise, and the distance that noise reaches on any line with this probability.
FAR, _BY_CHANCE = 3.0, 1e-3
#: Number of lines below which FRFs are not smoothed: the second distance is larger by this factor for them.
_NOT_SMOOTHED, _LEVEL = 50, 2.0
#: Linearisations of a fit that stays far from the data, from the first and from further initial values; after twice the
#: first number, omitted lines stay omitted.
PATIENCE, LITTLE_PATIENCE = 8, 4
#: A fit is far from the data if the squares exceed their number by this factor.
_LOST = 9.0
#: Difference of squares below which two fits have ended at the same minimum.
_SAME = 1.0
#: Largest mean square of a residual of noise, for errors of the noise level, and the margin in standard deviations.
_NOISE, _SIGMA = 1.03, 5.0
#: A compliance is poorly determined if its standard error exceeds this share of it: the FRFs may then hardly show M.
_POORLY = 0.05
#: Steps oscillate if their cosine is below this value, and they shrink by less than this factor.
_REVERSED, _SHRUNK = -0.8, 0.5
#: Least length of a damped step; a fit that needs shorter steps ends.
_LEAST_SHARE = 0.1
#: Largest distance of two ends, in standard errors, root mean square, between which an oscillating fit has converged.
#: Along so flat a direction of -2 log likelihood, terms above the second order matter, which no step contains.
_SWINGS = 0.5
#: Number of initial values of a fit with flexible sides.
_FEW_STARTS = 2
#: Number of targets whose gradients are computed together.
_AT_ONCE = 8
#: Number of entries of changed FRFs in memory at once: 64 MB.
_MOST_ENTRIES = 2**22


class GroupProblem(NamedTuple):
    """The fit of one group.

    Attributes
    ----------
    dofs : ndarray of int
        Its DOFs among all.
    which : ndarray of int
        Its parameters among all.
    data : LineData
        FRFs with known noise: a weighted residual has mean square 1.
    joint : JointCoordinates
        Coordinates of the joint.
    unknown : ndarray of bool, shape (n_freq, n * n)
        Entries of C, row by row, that may have any value on a line: cross terms that are not fitted, and DOFs outside
        their bands.
    hidden : int
        Number of entries of M that no FRF shows: those between rigid DOFs.
    sides_bend : bool
        Whether the sides may be flexible between channels and joint: no joint need be near all lines, and the search is
        short.
    """

    dofs: NDArray[np.intp]
    which: NDArray[np.intp]
    data: LineData
    joint: JointCoordinates
    unknown: NDArray[np.bool_]
    hidden: int = 0
    sides_bend: bool = False

    def equations(self) -> FloatArray:
        """Return the number of complex equations of each line: entries used minus free and unknown entries."""
        places = _unit_places(self.data)
        unknown = np.count_nonzero(self.unknown[:, places], axis=1)
        used = np.count_nonzero(self.data.used, axis=1)
        equations: FloatArray = np.maximum(used - 2 * len(places) + self.hidden - unknown, 0).astype(float)
        return equations


class UnknownCrossTerms(NamedTuple):
    """Residual statistics of a fit that leaves cross terms of C unknown.

    Attributes
    ----------
    noise_squares : float
        Squares of the residual in units of the noise alone, at their own minimum.
    is_symmetric : bool
        Whether C is symmetric to noise; otherwise its symmetry was not used.
    scatter : ndarray, shape (n,), optional
        Standard deviation of the diagonal of C between lines in excess of its noise, m/N; None without such excess.
    hidden : int
        Number of lines that count less than half because noise exceeds gamma_jk.
    """

    noise_squares: float
    is_symmetric: bool
    scatter: FloatArray | None
    hidden: int


@dataclass(frozen=True)
class GroupFit(FormMinimum):
    """The fit of one group: the minimum of the quadratic forms of the last linearisation.

    Attributes
    ----------
    problem : GroupProblem
        FRFs and options.
    used : ndarray of bool, shape (n_freq,)
        Lines on which the FRFs fit a joint near the estimate; all further lines have no weight in the forms.
    equations : float
        Number of complex equations used.
    possible : float
        Number of complex equations of all lines.
    iterations : int
        Number of linearisations.
    converged : bool
        Whether the iteration converged.
    unknown_cross : UnknownCrossTerms, optional
        Statistics of a fit with unknown cross terms of C.
    on : OnManifold, optional
        Point of the last linearisation, near to other FRFs of the same structure; not for long sweeps.
    """

    problem: GroupProblem
    used: NDArray[np.bool_]
    equations: float
    possible: float
    iterations: int
    converged: bool
    unknown_cross: UnknownCrossTerms | None = None
    on: OnManifold | None = None

    @classmethod
    def of(cls, minimum: FormMinimum, **more: Any) -> GroupFit:
        """Return a minimum with further attributes, including its computed properties."""
        found = cls(**{one.name: getattr(minimum, one.name) for one in fields(FormMinimum)}, **more)
        vars(found).update(vars(minimum))
        return found

    @property
    def dofs(self) -> NDArray[np.intp]:
        """DOFs of the group among all."""
        return self.problem.dofs

    @property
    def which(self) -> NDArray[np.intp]:
        """Parameters of the group among all."""
        return self.problem.which

    @cached_property
    def band_parts(self) -> FloatArray:
        """Lines used of parts of the band that are compared, 1 and 0, shape (n_parts, n_freq)."""
        member = np.zeros((BLOCKS, self.used.size))
        for of_part, own in zip(member, np.array_split(np.flatnonzero(self.used), BLOCKS), strict=True):
            of_part[own] = 1
        return member

    @property
    def noise_squares(self) -> float:
        """Squares of the residual in units of the noise."""
        return self.unknown_cross.noise_squares if self.unknown_cross else self.cost

    @property
    def squares(self) -> float:
        """Squares of the residual; an omitted line counts with its threshold."""
        return self.cost + FAR * (self.possible - self.equations)

    @property
    def is_lost(self) -> bool:
        """Whether it ended far from the data."""
        return not self.converged and self.excess > _LOST

    @property
    def is_noise(self) -> bool:
        """Whether the residual is no larger than the noise, and nearly all lines are used."""
        possible = max(self.possible, 1.0)
        return bool(self.squares < (_NOISE + _SIGMA / np.sqrt(possible)) * possible)

    @property
    def is_good(self) -> bool:
        """Whether it converged with a residual at the level of the noise."""
        return self.converged and self.is_noise

    @property
    def excess(self) -> float:
        """Mean square of the residual in units of the noise."""
        return self.noise_squares / max(self.equations - self.x.size / 2, 1)


def fit_dofs(
    problem: GroupProblem, starts: Iterable[FloatArray], patience: int = PATIENCE, on: OnManifold | None = None
) -> GroupFit:
    """Fit from one initial value after the other until the residual is noise; else return the lowest fit.

    A fit may oscillate without end at a residual that is noise; if two initial values lead there, others do, too.

    Parameters
    ----------
    problem : GroupProblem
        FRFs and options.
    starts : iterable of ndarray, shape (p,)
        Initial coordinates of the joint.
    patience : int
        Number of linearisations from the first initial value after which a fit far from the data ends.
    on : OnManifold, optional
        FRFs near the smooth ones that nearly fit the joint, as initial value of the projection.
    """
    best: GroupFit | None = None
    # The kernel fits a joint without cross terms; laws, cross terms and unknown entries are fitted here.
    own = _KernelFit.of(problem)
    for start in itertools.islice(starts, _FEW_STARTS if problem.sides_bend else None):
        if not np.isfinite(start).all():
            continue
        try:
            now = patience if best is None else LITTLE_PATIENCE
            found = _iterated(problem, start, now, on) if own is None else own.fit(start, now, on)
        except np.linalg.LinAlgError:  # K* diverged: try the next initial value
            continue
        again = best is not None and found.is_noise and abs(found.squares - best.squares) < _SAME
        if best is None or found.squares < best.squares:
            best = found
        if best.is_good or again:
            break
    if best is None:
        raise np.linalg.LinAlgError("no start of the fit stays finite")
    return best


def effects_of(
    fit: GroupFit, changes: Iterable[ComplexArray], lines: slice = slice(None)
) -> Iterator[tuple[ComplexArray, FloatArray]]:
    """Yield the effect of changes of the measured FRFs at the minimum, line by line.

    Parameters
    ----------
    fit : GroupFit
        Fit at its minimum.
    changes : iterable of ndarray, shape (n_lines, q)
        Changes of the entries of gamma on these lines, m/N.
    lines : slice
        Frequency lines; all by default.

    Yields
    ------
    gradient : ndarray, shape (n_lines, p)
        Change of the gradient in its real part; minus its imaginary part is the effect of the change multiplied by 1j.
    squares : ndarray, shape (n_lines,)
        Squares of the residual that the change alone leaves, in units of the noise.
    """
    problem, own = fit.problem, fit.problem.data.on_lines(lines)
    joint = fit.joint.on_lines(lines)
    used = fit.used[lines].astype(float)
    adjoint = joint.slope(fit.x, joint.compliance(fit.x)).conj() * used[:, None, None]
    c = joint.matrix(fit.forms.compliance[lines])
    unknown = problem.unknown[lines].reshape(c.shape)
    if unknown.any():
        c = np.where(unknown, smooth_compliance(own), c)
    # With unknown cross terms there is no point of the manifold.
    on = fit.on if fit.on is not None and not unknown.any() else None
    point = _first_points(own, c) if on is None else OnManifold(on.h[lines], on.q[lines], on.squares[lines])
    point = _restarted(own, c, point)
    fitted = own.entries.take(frfs_of_joint(point.h, point.q, c, own.reference))
    here, more = problem._replace(data=own, unknown=problem.unknown[lines]), iter(changes)
    # A form is factorised once for all changes of a call.
    at_once = max(_AT_ONCE, _MOST_ENTRIES // max(fitted.size, 1))
    while some := tuple(fitted + change for change in itertools.islice(more, at_once)):
        for left in _of_coordinates(here, normal_forms(own, c, point, some))[0]:
            gradient, squares = np.einsum("lqp,lq->lp", adjoint, left.gradient), left.squares * used
            yield np.where(np.isfinite(gradient), gradient, 0), np.where(np.isfinite(squares), squares, 0)


def fitted_frfs(fit: GroupFit, lines: NDArray[np.intp]) -> ComplexArray:
    """Return the FRFs between joint DOFs at which a fit without unknown cross terms was linearised, on some lines."""
    own, c = fit.problem.data.on_lines(lines), fit.joint.matrix(fit.forms.compliance[lines])
    point = (
        _first_points(own, c) if fit.on is None else OnManifold(fit.on.h[lines], fit.on.q[lines], fit.on.squares[lines])
    )
    return frfs_of_joint(point.h, point.q, c, own.reference)


class _KernelFit(NamedTuple):
    """The fit of a joint of springs without cross terms in the kernel, with its arrays."""

    problem: GroupProblem
    joint: DiagonalJoint
    equations: FloatArray
    frfs: tuple[NDArray[Any], ...]

    @classmethod
    def of(cls, problem: GroupProblem) -> _KernelFit | None:
        """Return the fit of a problem; None if the kernel has none."""
        data, joint = problem.data, problem.joint
        if not isinstance(joint, DiagonalJoint) or data.springs is None or problem.unknown.any():
            return None
        # Packed: entries as a column of each line.
        frfs = [np.ascontiguousarray(one)[:, None] for one in (data.smooth, data.measured, data.inverse_std)]
        return cls(problem, joint, problem.equations(), (*frfs, data.whitening))

    def fit(self, start: FloatArray, patience: int, on: OnManifold | None) -> GroupFit:
        """Fit from one start."""
        data, joint, p, n_freq = self.problem.data, self.joint, start.size, len(self.equations)
        n, is_near = joint.n, on is not None and on.h.shape == (n_freq, joint.n, joint.n)
        sizes = int(data.entries.reciprocal), n, p, data.entries.rows.size, 1, data.whitening_order, n_freq
        options = 2 if is_near else 1, patience, int(self.problem.sides_bend), _LinesUsed(self.problem).farthest
        x, springs = np.array(start, np.float64), np.array(data.reference, np.float64)
        h, q = np.array((on.h, on.q) if on is not None and is_near else np.zeros((2, n_freq, n, n)), np.complex128)
        values, descent = np.empty((2, p))
        covariance, information = np.empty((2, p, p))
        line_descent, distance, used = np.empty((n_freq, p)), np.empty(n_freq), np.empty(n_freq, np.int32)
        forms = LineForms(
            np.empty((n_freq, n), np.complex128), np.empty((n_freq, n, n), np.complex128),
            np.empty((n_freq, n), np.complex128), np.empty(n_freq),
        )  # fmt: skip
        results = values, covariance, information, descent, line_descent, distance, used, *forms
        args = *sizes, *options, *joint.kernel_terms, joint.omega, *self.frfs, springs, x, h, q, *results
        cost, equations, steps, converged, _ = call_for_number("fit_joint", (*args, np.empty(n_freq, np.int32)))
        return GroupFit.of(
            FormMinimum(x, cost, information, descent, forms, joint), problem=self.problem, used=used == 1,
            equations=equations, possible=float(self.equations.sum()), iterations=int(steps),
            converged=bool(converged), on=None if is_long(n_freq) else OnManifold(h, q, distance),
        )  # fmt: skip


def _iterated(
    problem: GroupProblem, start: FloatArray, patience: int = PATIENCE, on: OnManifold | None = None
) -> GroupFit:
    """Linearise, minimise and test until convergence, or until it is out of reach."""
    data, joint, equations = problem.data, problem.joint, problem.equations()
    lines, choice_of_m, length = _LinesUsed(problem), _ChoiceOfM(problem), _StepLength(start.size)
    unknown = smooth_compliance(data) if problem.unknown.any() else None
    if on is not None and on.h.shape != (len(data.measured), joint.n, joint.n):
        on = None
    x = linearised_at = start
    for step in itertools.count(1):
        c = joint.matrix(joint.compliance(linearised_at))
        if unknown is not None:
            c = np.where(problem.unknown.reshape(c.shape), unknown, c)
        on = (
            project(data.smooth, data, c, on, _FIRST_STEPS if step == 1 else _NEXT_STEPS)
            if on
            else _first_points(data, c)
        )
        if step == 1 or not problem.sides_bend:
            on = _restarted(data, c, on)
        before, used = np.count_nonzero(lines.last), lines.near(on, step)
        # Lines that come near only now have not influenced the joint yet.
        is_whole = step > 1 and bool(np.count_nonzero(used) <= before)
        # Unknown entries of C change on all lines, so that an omitted line may be used again.
        forms, unknown = _linearised(problem, c, on, used, choice_of_m.prior)
        minimum = joint.lowest(forms, x)
        change, count = minimum.x - x, float(equations[used].sum())
        # In standard errors along the direction of the step, because undetermined directions are arbitrary.
        moved = float(np.sqrt(abs(2 * (change @ minimum.information @ change))))
        is_lost = minimum.cost > _LOST * count
        converged = choice_of_m.holds_for(minimum, step) and bool(moved < _MOVED * np.sqrt(x.size)) and is_whole
        if length.is_spent and not converged and moved < _SWINGS * np.sqrt(x.size):
            # Between the two ends of the last step, of which a tenth was taken.
            minimum, converged = FormMinimum(x, *FormSquares(forms, joint).linearised(x), forms, joint), True
        if converged or step == _MOST or length.is_spent or (is_lost and step > patience):
            kept = None if is_long(len(data.measured)) else on
            return GroupFit.of(
                minimum, problem=problem, used=used, equations=count, possible=float(equations.sum()),
                iterations=step, converged=converged, on=kept,
            )  # fmt: skip
        x = x + length.of(change, minimum.information, is_lost=is_lost) * change
        linearised_at = joint.linearisation_point(minimum, x)
        # For a long sweep the forms of one step take as much memory as the forms of the next.
        del forms, minimum
    raise AssertionError


class _LinesUsed:
    """Lines near enough to the manifold, at least half of them if few are. In a long search no omitted line returns.

    Few means fewer than the parameters, or less than a quarter of all; if all lines are so few, none is omitted. FRFs
    that were not smoothed differ from the manifold by all of their noise, whose level few lines determine to a factor.
    """

    def __init__(self, problem: GroupProblem) -> None:
        data, n_freq = problem.data, len(problem.data.measured)
        chance = float(special.gammainccinv(float(np.median(problem.equations())), _BY_CHANCE / n_freq))
        if n_freq < _NOT_SMOOTHED and np.allclose(data.measured, data.smooth, rtol=1e-9, atol=0):
            chance *= _LEVEL
        self.farthest = max(FAR * problem.joint.n**2, chance)
        self.least = max(problem.joint.lower.size, n_freq // 4)
        self.last = np.ones(n_freq, np.bool_)

    def near(self, on: OnManifold, step: int) -> NDArray[np.bool_]:
        """Return the lines used in a step of the search."""
        near = np.asarray(on.squares <= self.farthest)
        if len(near) <= self.least:
            near = np.ones_like(near)
        elif np.count_nonzero(near) < self.least:
            near = on.squares <= np.quantile(on.squares, 0.5)
        both = near & self.last
        self.last = both if step > 2 * PATIENCE and both.any() else near
        return self.last


class _ChoiceOfM:
    """Choice of M: expected, or of the nearest FRFs, which overstates the information on a stiff joint.

    The first step uses the expected M. It shows whether a compliance is poorly determined, and in this case the choice
    is kept to the end. A fit with M of the nearest FRFs that finds a poorly determined compliance continues.
    """

    def __init__(self, problem: GroupProblem) -> None:
        self._prior = prior_of_m(problem.data) if problem.joint.is_compliance.any() else None
        self.prior = self._prior

    def holds_for(self, minimum: FormMinimum, step: int) -> bool:
        """Return whether a minimum agrees with the choice made for its step; choose for the next step."""
        error = np.sqrt(np.maximum(np.diagonal(minimum.covariance), 1e-300))
        poorly = bool((error > _POORLY * abs(minimum.x))[minimum.joint.is_compliance & (self._prior is not None)].any())
        holds = self.prior is not None or not poorly
        self.prior = self._prior if poorly or (self.prior is not None and step > 1) else None
        return holds


class _StepLength:
    """Length of a step, as a share of the full step.

    Full steps, unless steps oscillate and hardly shrink. If the full last step would have made the next step -r times
    as long, 1/(1 + r) of it would have ended at the fixed point. From then on the length does not grow, because the
    iteration would alternate between two minima of nearly equal height.
    """

    def __init__(self, p: int) -> None:
        self.share, self.last = 1.0, np.zeros(p)

    @property
    def is_spent(self) -> bool:
        """Whether even the least length is too long."""
        return self.share <= _LEAST_SHARE

    def of(self, step: FloatArray, information: FloatArray, *, is_lost: bool) -> float:
        """Return the length of a step; a full step far from the data."""
        last, self.last = self.last, step
        own, before = float(step @ information @ step), float(last @ information @ last)
        if is_lost:
            self.share = 1.0
        elif own > 0 and before > 0:
            along = float(step @ information @ last) / before
            shrinks = own < _SHRUNK**2 * before or along > _REVERSED * np.sqrt(own / before)
            if self.share < 1 or not shrinks:
                self.share = max(self.share / max(1 - along, 1.0), _LEAST_SHARE)
        return self.share


def _first_points(data: LineData, c: ComplexArray) -> OnManifold:
    """Return initial points on every line, in chunks of lines."""
    return OnManifold(*in_pieces(len(c), lambda own: starts_on_manifold(data.on_lines(own), c[own], _FIRST_STEPS)))


def _linearised(
    problem: GroupProblem, c: ComplexArray, on: OnManifold, used: NDArray[np.bool_], prior: PriorOfM | None
) -> tuple[LineForms, ComplexArray | None]:
    """Return forms of the coordinates, zero on lines that are not used, and the unknown entries; in chunks."""
    found = np.zeros_like(c) if problem.unknown.any() else None

    def of_lines(own: slice) -> Sequence[NDArray[Any]]:
        here = problem._replace(data=problem.data.on_lines(own), unknown=problem.unknown[own])
        point = OnManifold(on.h[own], on.q[own], on.squares[own])
        if prior is not None:
            point = expected_m(here.data, c[own], point, prior.on_lines(own))
        targets = (here.data.measured, here.data.smooth) if here.unknown.any() else (here.data.measured,)
        of_targets = normal_forms(here.data, c[own], point, targets)
        (forms, *_), inverse = _of_coordinates(here, of_targets)
        if found is not None and inverse is not None:
            step = (inverse @ of_targets[-1].gradient[..., None])[..., 0]
            found[own] = np.where(here.unknown.reshape(c[own].shape), c[own], 0)
            found[own] += np.tensordot(step, here.data.entries.units, 1)
        return forms.scaled(used[own].astype(float))

    return LineForms(*in_pieces(len(c), of_lines)), found


def _unit_places(data: LineData) -> NDArray[np.intp]:
    """Return the numbers of the free entries of C among all, row by row."""
    a, b = data.entries.free
    return a * data.entries.n + b


def _restarted(data: LineData, c: ComplexArray, on: OnManifold) -> OnManifold:
    """Return points with new initial values on lines far from the manifold."""
    far = np.flatnonzero(~(on.squares <= FAR * data.entries.n**2))
    if far.size == 0 or far.size == len(c):
        return on
    pieces = in_pieces(far.size, lambda own: starts_on_manifold(data.on_lines(far[own]), c[far[own]], _OTHER_STEPS))
    other = OnManifold(*pieces)
    squares = on.squares.copy()
    h, q = on.h.copy(), on.q.copy()
    nearer = other.squares < squares[far]
    h[far[nearer]], q[far[nearer]], squares[far[nearer]] = (x[nearer] for x in other)
    return OnManifold(h, q, squares)


def _of_coordinates(problem: GroupProblem, several: Sequence[LineForms]) -> tuple[list[LineForms], ComplexArray | None]:
    """Return the forms of one linearisation in the entries of C that the coordinates change.

    Entries of C that are unknown on a line are eliminated; the function also returns the inverse of their weights, zero
    elsewhere, if there are any. All further entries that the coordinates do not change are zero.
    """
    n, places, joint = problem.data.entries.n, _unit_places(problem.data), problem.joint
    unknown, inverse = problem.unknown[:, places], None
    if unknown.any():
        several, inverse = _eliminated(several, unknown)
    compliance, weight = several[0].compliance, several[0].weight
    gradients = [forms.gradient for forms in several]
    upper, lower = joint.rows * n + joint.columns, joint.columns * n + joint.rows
    if places.size == n * n > len(upper) > n:
        # C is symmetric, and all its entries are present.
        fold = (places[:, None] == upper).astype(float) + ((places[:, None] == lower) & (upper != lower))
        compliance, weight = compliance[:, upper], fold.T @ weight @ fold
        gradients = [gradient @ fold for gradient in gradients]
    elif len(upper) < places.size:
        changed = np.zeros(n * n, bool)
        changed[upper] = True
        kept = np.flatnonzero(changed[places])
        compliance, weight = compliance[:, kept], weight[:, kept[:, None], kept]
        gradients = [gradient[:, kept] for gradient in gradients]
    return [
        LineForms(compliance, weight, gradient, forms.squares)
        for gradient, forms in zip(gradients, several, strict=True)
    ], inverse


def _eliminated(several: Sequence[LineForms], unknown: NDArray[np.bool_]) -> tuple[list[LineForms], ComplexArray]:
    """Minimise forms of the same weights over their unknown entries; return also the inverse of these weights."""
    w = several[0].weight
    size = np.sqrt(np.maximum(np.einsum("lqq->lq", w).real, TINY))
    outer = size[:, :, None] * size[:, None, :]
    both = unknown[:, :, None] & unknown[:, None, :]
    masked = np.where(both, w / outer, 0) + (~unknown)[:, :, None] * np.eye(w.shape[1])
    inverse = np.where(both, np.linalg.pinv(masked, hermitian=True), 0) / outer
    across, known = w @ inverse, ~unknown
    weight = (w - across @ w) * known[:, :, None] * known[:, None, :]
    # All forms at once, shape (n_freq, q, n_forms).

    p = np.stack([forms.gradient for forms in several], axis=2)
    gradient = (p - across @ p) * known[:, :, None]
    taken = (p.conj() * (inverse @ p)).real.sum(axis=1)
    return [
        LineForms(forms.compliance, weight, gradient[:, :, i], forms.squares - taken[:, i])
        for i, forms in enumerate(several)
    ], inverse
