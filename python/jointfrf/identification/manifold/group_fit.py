"""The fit of one group of joint DOFs: project smooth FRFs, linearise there, minimise, until nothing moves."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.bands import in_pieces, is_long
from jointfrf.identification.manifold.coordinates import DiagonalJoint, JointCoordinates, terms_of
from jointfrf.identification.manifold.line_forms import FormMinimum, LineForms, lowest_minimum, within_reach
from jointfrf.identification.manifold.on_manifold import (
    LineData,
    OnManifold,
    PriorOfM,
    expected_m,
    normal_forms,
    prior_of_m,
    project,
    smooth_compliance,
    starts_on_manifold,
)
from jointfrf.identification.minimise import inverse_information
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["LITTLE_PATIENCE", "GroupFit", "GroupProblem", "Misfitting", "fit_dofs", "gradients_of"]

#: Linearisations at most.
_MOST = 25
#: The fit has converged when the coordinates move by less than this many standard errors, root mean square.
_MOVED = 0.02
#: Steps of the projection: of the first one, and of those that follow a small change of the joint.
_FIRST_STEPS, _NEXT_STEPS = 30, 8
#: A line that stays farther from the manifold than this, in squares per unknown and of the noise, is not trusted.
_FAR = 3.0
#: Linearisations of a fit that stays far from the data, from the first start and from others; after twice the first
#: number lines that are not trusted do not come back.
PATIENCE, LITTLE_PATIENCE = 8, 4
#: A fit is far from the data when the squares exceed their number by this factor.
_LOST = 9.0
#: Fits whose squares differ by less have ended at the same place.
_SAME = 1.0
#: A residual may be noise up to this mean square, for what is not known of the noise, and so many standard deviations.
_NOISE, _SIGMA = 1.03, 5.0
#: A compliance is barely seen when its standard error exceeds this share of it: the FRFs may then hardly show M.
_BARELY = 0.05
#: Steps that reverse, to this cosine, and shrink by less than this factor go to and fro between two points.
_REVERSED, _SHRUNK = -0.8, 0.5
#: Part of such a step that is gone at least; a fit for which that is too much ends where it is.
_LEAST_SHARE = 0.1
#: Targets whose gradients are found together.
_AT_ONCE = 8
#: Of a compliance with this relative error, damping is not known: its rate is taken below 1 where it is linearised.
_HARDLY = 0.3


class GroupProblem(NamedTuple):
    """The fit of one group.

    Attributes
    ----------
    data : LineData
        Its noise is known: a weighted residual has mean square 1.
    joint : JointCoordinates
    unknown : ndarray of bool, shape (n_freq, n * n)
        Entries of C, row by row, that may have any value on a line: cross terms that are not sought, and DOFs outside
        their bands.
    hidden : int
        Entries of M that no FRF shows: those between rigid DOFs.
    """

    data: LineData
    joint: JointCoordinates
    unknown: NDArray[np.bool_]
    hidden: int = 0

    @property
    def is_diagonal(self) -> bool:
        """Whether C is diagonal."""
        return isinstance(self.joint, DiagonalJoint)

    def of_joint(self, entries: ComplexArray) -> ComplexArray:
        """Return C, shape (n_freq, n, n), of the entries that the coordinates change."""
        n = self.data.entries.n
        c = np.zeros((len(entries), n, n), np.complex128)
        rows, columns = np.diag_indices(n) if self.is_diagonal else np.triu_indices(n)
        c[:, rows, columns] = c[:, columns, rows] = entries
        return c


class Misfitting(NamedTuple):
    """What lines say beside the joint where cross terms of C are unknown.

    Attributes
    ----------
    noise_squares : float
        Squares of the residual in units of the noise alone, at their own minimum.
    is_symmetric : bool
        Whether C is symmetric to noise; otherwise its symmetry was not used.
    scatter : ndarray, shape (n,), optional
        Standard deviation of the diagonal of C between lines, beside its noise, m/N; where it is more than noise.
    hidden : int
        Lines that count less than half because noise hides gamma_jk.
    """

    noise_squares: float
    is_symmetric: bool
    scatter: FloatArray | None
    hidden: int


class GroupFit(NamedTuple):
    """Result of the fit of one group.

    Attributes
    ----------
    minimum : FormMinimum
        Coordinates, squares, information, and what each line adds to them.
    forms : LineForms
        Quadratic forms of the last linearisation; lines that are not trusted weigh nothing.
    trusted : ndarray of bool, shape (n_freq,)
        Lines on which the FRFs can fit a joint near the one found.
    equations : float
        Complex equations used.
    possible : float
        Complex equations of all lines.
    iterations : int
    converged : bool
    beside : Misfitting, optional
        Where cross terms of C are unknown.
    on : OnManifold, optional
        Point of the last linearisation, from which other FRFs of the same structure are near; not of long sweeps.
    """

    minimum: FormMinimum
    forms: LineForms
    trusted: NDArray[np.bool_]
    equations: float
    possible: float
    iterations: int
    converged: bool
    beside: Misfitting | None = None
    on: OnManifold | None = None

    @property
    def noise_squares(self) -> float:
        """Squares of the residual in units of the noise."""
        return self.beside.noise_squares if self.beside else self.minimum.cost

    @property
    def squares(self) -> float:
        """Squares of the residual; a line that is not trusted counts as one that just is not."""
        return self.minimum.cost + _FAR * (self.possible - self.equations)

    @property
    def is_lost(self) -> bool:
        """Whether it ended far from the data."""
        return not self.converged and self.excess > _LOST

    @property
    def is_noise(self) -> bool:
        """Whether the residual is no larger than the noise, and hardly a line is not trusted."""
        possible = max(self.possible, 1.0)
        return bool(self.squares < (_NOISE + _SIGMA / np.sqrt(possible)) * possible)

    @property
    def is_good(self) -> bool:
        """Whether it converged, and the residual is that of the noise."""
        return self.converged and self.is_noise

    @property
    def excess(self) -> float:
        """Mean square of the residual in units of the noise."""
        return self.noise_squares / max(self.equations - self.minimum.x.size / 2, 1)


def fit_dofs(
    problem: GroupProblem, starts: Iterable[FloatArray], patience: int = PATIENCE, on: OnManifold | None = None
) -> GroupFit:
    """Fit from one start after the other until the residual is that of the noise; else keep the lowest.

    A fit may go to and fro without end at a residual that is noise; where two starts lead there, others do, too.

    Parameters
    ----------
    problem : GroupProblem
    starts : iterable of ndarray, shape (p,)
        Coordinates of the joint.
    patience : int
        Linearisations from the first start after which a fit far from the data ends.
    on : OnManifold, optional
        FRFs near the smooth ones that nearly fit the joint: where their projection begins.
    """
    best: GroupFit | None = None
    for start in starts:
        if not np.isfinite(start).all():
            continue
        found = _iterate(problem, start, patience if best is None else LITTLE_PATIENCE, on)
        again = best is not None and found.is_noise and abs(found.squares - best.squares) < _SAME
        if best is None or found.squares < best.squares:
            best = found
        if best.is_good or again:
            break
    if best is None:
        raise np.linalg.LinAlgError("no start of the fit is finite")
    return _from_softer(problem, best) if problem.is_diagonal and not (best.is_noise or best.is_lost) else best


def gradients_of(problem: GroupProblem, fit: GroupFit, changes: Iterable[ComplexArray]) -> FloatArray:
    """Return by how much changes of the measured FRFs change the gradient at the minimum, shape (number, p).

    Parameters
    ----------
    problem : GroupProblem
    fit : GroupFit
    changes : iterable of ndarray, shape (n_freq, q)
        Of the entries of gamma, m/N.
    """
    data, trusted = problem.data, fit.trusted.astype(float)
    if problem.unknown.any():
        # Where cross terms are unknown there is no point of the manifold.
        return np.zeros((len(list(changes)), fit.minimum.x.size))
    c = problem.of_joint(fit.forms.compliance)
    on = _rescued(data, c, _first_points(data, c))
    adjoint = problem.joint.slope(fit.minimum.x, problem.joint.compliance(fit.minimum.x)).conj()

    def gradients(targets: tuple[ComplexArray, ...]) -> list[FloatArray]:
        found = (_used(problem, forms, forms, c)[0].gradient for forms in normal_forms(data, c, on, targets))
        return [np.einsum("lqp,lq,l->p", adjoint, one, trusted).real for one in found]

    # Side by side, they share what is linearised: as many at once as take no more memory than the lines do.
    (base,), found, more = gradients((data.smooth,)), [], iter(changes)
    while some := tuple(data.smooth + change for change in itertools.islice(more, _AT_ONCE)):
        found += [one - base for one in gradients(some)]
    return np.array(found)


def _from_softer(problem: GroupProblem, best: GroupFit) -> GroupFit:
    """Start again from softer values of the DOFs that are barely seen: far too stiff, a fit may be caught.

    From a few times the compliance that the data can tell, up to that of the structure around the joint.
    """
    n = problem.data.entries.n
    softest = problem.data.own_size
    factor = 3.0
    while not best.is_noise:
        a = best.minimum.x[:n]
        error = np.sqrt(np.diagonal(best.minimum.covariance)[:n])
        softer = factor * np.maximum(a, error)
        barely = (error > _BARELY * a) & (softer < softest)
        if not barely.any():
            break
        start = best.minimum.x.copy()
        start[:n] = np.where(barely, softer, a)
        # A rate that belongs to another compliance says nothing here.
        start[n:] = np.where(barely[terms_of(problem.joint).pairs[n:, 0]], 0.0, start[n:])
        found = _iterate(problem, start)
        best, factor = (found, 3.0) if found.squares < best.squares else (best, 4 * factor)
    return best


def _iterate(
    problem: GroupProblem, start: FloatArray, patience: int = PATIENCE, on: OnManifold | None = None
) -> GroupFit:
    data, joint = problem.data, problem.joint
    free = _equations(problem)
    x: FloatArray = start
    linearised_at: FloatArray = start
    steps = _FIRST_STEPS
    if on is not None and on.h.shape != (len(data.measured), data.entries.n, data.entries.n):
        on = None
    unknown = smooth_compliance(data) if problem.unknown.any() else None
    trusted = np.ones(len(data.measured), np.bool_)
    prior: PriorOfM | None = prior_of_m(data) if problem.is_diagonal else None
    hidden = problem.is_diagonal
    step, share, last = 0, 1.0, np.zeros_like(start)
    while True:
        step += 1
        c = problem.of_joint(joint.compliance(linearised_at))
        if unknown is not None:
            c = np.where(problem.unknown.reshape(c.shape), unknown, c)
        on = project(data.smooth, data, c, on, steps) if on else _first_points(data, c)
        steps = _NEXT_STEPS
        on = _rescued(data, c, on)
        near = _trusted(on, data.entries.n, joint)
        trusted = near & trusted if step > 2 * PATIENCE and (near & trusted).any() else near
        # Unknown entries of C move on all lines: they may bring a line back to where it is trusted.
        forms, unknown = _linearised(problem, c, on, trusted, prior if hidden else None)
        minimum = lowest_minimum(forms, joint, x)
        error = np.sqrt(np.maximum(np.diagonal(minimum.covariance), 1e-300))
        # In standard errors along the direction of the step: what the data do not see may go anywhere.
        change = minimum.x - x
        moved = float(np.sqrt(abs(2 * (change @ minimum.information @ change))))
        equations = float(free[trusted].sum())
        converged = bool(moved < _MOVED * np.sqrt(x.size)) and step > 1
        barely = problem.is_diagonal and bool((error > _BARELY * abs(minimum.x))[: terms_of(joint).n].any())
        converged = converged and (hidden or not barely)
        # The first step tells, with M that cannot feign it; a joint barely seen once is treated so to the end.
        hidden = barely or (hidden and step > 1)
        is_endless = step == _MOST or share <= _LEAST_SHARE
        if converged or is_endless or (step > patience and minimum.cost > _LOST * equations):
            kept = None if is_long(len(data.measured)) else on
            return GroupFit(minimum, forms, trusted, equations, float(free.sum()), step, converged, on=kept)
        share = 1.0 if minimum.cost > _LOST * equations else _next_share(share, change, last, minimum.information)
        x, last = x + share * change, change
        linearised_at = _within_sight(forms, problem.joint, x, error) if problem.is_diagonal else x
        # Of a long sweep the forms of one step take as much memory as those of the next.
        del forms, minimum


def _next_share(share: float, step: FloatArray, last: FloatArray, information: FloatArray) -> float:
    """Return which part of a step is gone, `share` having been gone of the last one.

    All of it, unless steps lead to and fro and hardly shrink: where all of the last one would have made the next step
    -r times as long, 1/(1 + r) of it would have ended at the fixed point. From then on shares do not grow: of two
    minima that are nearly as low, now the one is taken and now the other.
    """
    own, before = float(step @ information @ step), float(last @ information @ last)
    if not (own > 0 and before > 0):
        return share
    along = float(step @ information @ last) / before
    if share == 1 and (own < _SHRUNK**2 * before or along > _REVERSED * np.sqrt(own / before)):
        return 1.0
    return max(share / max(1 - along, 1.0), _LEAST_SHARE)


def _first_points(data: LineData, c: ComplexArray) -> OnManifold:
    """Start on every line, a piece of the lines at a time."""
    return OnManifold(*in_pieces(len(c), lambda own: starts_on_manifold(data.on_slice(own), c[own], _FIRST_STEPS)))


def _linearised(
    problem: GroupProblem, c: ComplexArray, on: OnManifold, trusted: NDArray[np.bool_], prior: PriorOfM | None
) -> tuple[LineForms, ComplexArray | None]:
    """Return what `_used` does, lines that are not trusted weighing nothing, a piece of the lines at a time."""
    found = np.zeros_like(c) if problem.unknown.any() else None

    def of_lines(own: slice) -> Sequence[NDArray[Any]]:
        here = problem._replace(data=problem.data.on_slice(own), unknown=problem.unknown[own])
        point = OnManifold(on.h[own], on.m[own], on.squares[own])
        if prior is not None:
            point = expected_m(here.data, c[own], point, prior.on_lines(own))
        targets = (here.data.measured, here.data.smooth) if here.unknown.any() else (here.data.measured,)
        found_forms = normal_forms(here.data, c[own], point, targets)
        forms, some = _used(here, found_forms[0], found_forms[-1], c[own])
        if found is not None and some is not None:
            found[own] = some
        return forms.scaled(trusted[own].astype(float))

    return LineForms(*in_pieces(len(c), of_lines)), found


def _within_sight(forms: LineForms, joint: JointCoordinates, x: FloatArray, error: FloatArray) -> FloatArray:
    """Return where to linearise: not nearer to a rigid joint, nor at a larger rate of one, than the data can tell."""
    terms, n = terms_of(joint), terms_of(joint).n
    hardly = ~(error[:n] <= _HARDLY * x[:n])
    of_rate = hardly[terms.pairs[n:, 0]]
    at = x.copy()
    if hardly.any():
        # The size of C itself: of a DOF that is mostly damping, the compliance alone may be anything.
        size = abs(joint.compliance(x)).mean(axis=0)
        at[n:][of_rate] = 0.0
        slope = joint.slope(at, joint.compliance(at))
        known = np.r_[np.ones(n, bool), ~of_rate]
        information = (slope.conj().swapaxes(1, 2) @ forms.weight @ slope).real.sum(axis=0)[np.ix_(known, known)]
        error = np.sqrt(np.maximum(np.diagonal(inverse_information(2 * information)), 0))
        at[:n] = np.where(hardly, np.maximum(size, error[:n]), x[:n])
    at[:n] = np.maximum(at[:n], np.where(np.isfinite(error[:n]), error[:n], 0))
    reach = within_reach(joint)
    at[n:] = np.where(of_rate, np.clip(x[n:], -reach, reach), x[n:])
    return at


def _equations(problem: GroupProblem) -> FloatArray:
    """Return the complex equations of each line: entries used, less what is free and what is unknown."""
    entries = problem.data.entries
    places = np.array([np.flatnonzero(one.ravel())[0] for one in entries.units])
    unknown = np.count_nonzero(problem.unknown[:, places], axis=1)
    used = np.count_nonzero(problem.data.used, axis=1)
    equations: FloatArray = np.maximum(used - 2 * len(places) + problem.hidden - unknown, 0).astype(float)
    return equations


def _rescued(data: LineData, c: ComplexArray, on: OnManifold) -> OnManifold:
    """Give lines far from the manifold other starts."""
    far = np.flatnonzero(~(on.squares <= _FAR * data.entries.n**2))
    if far.size == 0 or far.size == len(c):
        return on
    other = starts_on_manifold(data.on_lines(far), c[far], 25)
    squares = on.squares.copy()
    h, m = on.h.copy(), on.m.copy()
    nearer = other.squares < squares[far]
    h[far[nearer]], m[far[nearer]], squares[far[nearer]] = (x[nearer] for x in other)
    return OnManifold(h, m, squares)


def _trusted(on: OnManifold, n: int, joint: JointCoordinates) -> NDArray[np.bool_]:
    """Return which lines are near enough to the manifold; half of them where few are."""
    trusted = np.asarray(on.squares <= _FAR * n**2)
    if np.count_nonzero(trusted) < max(joint.lower.size, len(trusted) // 4):
        trusted = on.squares <= np.quantile(on.squares, 0.5)
    return trusted


def _used(
    problem: GroupProblem, forms: LineForms, of_smooth: LineForms, c: ComplexArray
) -> tuple[LineForms, ComplexArray | None]:
    """Return the forms of the entries of C that the coordinates change, and the unknown ones of the smooth FRFs.

    Entries of C that are unknown on a line are eliminated from its form; all others that the coordinates do not change
    are zero.
    """
    n, unit = problem.data.entries.n, problem.data.entries.units
    places = np.array([np.flatnonzero(one.ravel())[0] for one in unit])
    unknown = problem.unknown[:, places]
    found = None
    if unknown.any():
        forms, step = _eliminated(forms, of_smooth, unknown)
        found = np.where(problem.unknown, c.reshape(len(c), -1), 0).reshape(c.shape) + np.tensordot(step, unit, 1)
    if problem.is_diagonal:
        kept = np.flatnonzero(places % (n + 1) == 0)
        weight = forms.weight[:, kept[:, None], kept]
        forms = LineForms(forms.compliance[:, kept], weight, forms.gradient[:, kept], forms.squares)
    elif len(unit) > n * (n + 1) // 2:
        forms = _symmetric(forms, n)
    return forms, found


def _eliminated(forms: LineForms, of_smooth: LineForms, unknown: NDArray[np.bool_]) -> tuple[LineForms, ComplexArray]:
    """Minimise each form over its unknown entries; return the forms left, and the step there of the smooth FRFs."""
    w, p = forms.weight, forms.gradient
    size = np.sqrt(np.maximum(np.einsum("lqq->lq", w).real, np.finfo(float).tiny))
    outer = size[:, :, None] * size[:, None, :]
    both = unknown[:, :, None] & unknown[:, None, :]
    masked = np.where(both, w / outer, 0) + (~unknown)[:, :, None] * np.eye(w.shape[1])
    inverse = np.where(both, np.linalg.pinv(masked, hermitian=True), 0) / outer
    across = w @ inverse
    known = ~unknown
    weight = (w - across @ w) * known[:, :, None] * known[:, None, :]
    gradient = (p - (across @ p[..., None])[..., 0]) * known
    squares = forms.squares - (p.conj() * (inverse @ p[..., None])[..., 0]).real.sum(axis=1)
    step = (inverse @ of_smooth.gradient[..., None])[..., 0]
    return LineForms(forms.compliance, weight, gradient, squares), step


def _symmetric(forms: LineForms, n: int) -> LineForms:
    """Return the forms of the upper triangle of a symmetric C from those of all its entries."""
    a, b = np.triu_indices(n)
    fold = np.zeros((n * n, a.size))
    fold[a * n + b, np.arange(a.size)] = 1
    fold[b * n + a, np.arange(a.size)] = 1
    return LineForms(forms.compliance[:, a * n + b], fold.T @ forms.weight @ fold, forms.gradient @ fold, forms.squares)
