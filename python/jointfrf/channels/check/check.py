"""The check of measured FRFs before a fit."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, cast, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.channels.check.amplitude import amplitude_findings
from jointfrf.channels.check.channel_ratios import (
    LEAST_GAIN,
    LEAST_PHASE,
    channel_ratios,
    delay_findings,
    gain_findings,
)
from jointfrf.channels.check.driving_points import (
    Sectors,
    convention_finding,
    passivity_findings,
    quantities,
    quantity_findings,
    sectors,
    sign_findings,
)
from jointfrf.channels.check.exchange import cause_findings, find_cause
from jointfrf.channels.check.pair_ratios import PairRatios, pair_ratios
from jointfrf.channels.check.representation import representation_finding
from jointfrf.channels.check.residues import (
    LEAST_MODES,
    driving_point_findings,
    resonances,
    signs_at,
    strength_exponent,
)
from jointfrf.channels.check.result import Correction, FrfCheck, FrfFix, corrected
from jointfrf.channels.check.rigid_findings import rigid_faults
from jointfrf.channels.check.rigid_motion import ChannelGroup, not_rigid
from jointfrf.channels.check.sides import reference_findings, side_findings
from jointfrf.channels.check.signals import (
    LEAST_LINES,
    LEAST_SMOOTHNESS,
    Measurement,
    as_channel_names,
    as_measurement,
    check_signals,
    find_bad_lines,
)
from jointfrf.channels.joint_channels import JointChannels
from jointfrf.errors import FileContentError, FrfCheckError
from jointfrf.frf.bands import spread_lines
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA, Channel, FrfSet
from jointfrf.frf.noise_parts import is_smooth
from jointfrf.kernel.arguments import (
    ComplexArray,
    FloatArray,
    as_frequency,
    as_lines,
    as_names,
    as_real,
    check_choice,
    check_type,
    one_line,
)
from jointfrf.messages.finding import Finding, as_warning, worst_first
from jointfrf.messages.of_data import FATAL_CODES
from jointfrf.spelling import some_of

__all__ = [
    "as_accepted",
    "check_frfs",
    "stop_at_errors",
    "warn_of_frfs",
    "warn_of_sets",
    "wrong_numbers",
    "wrong_numbers_of",
]

#: Errors that the message of a fit that stops repeats.
_STOPPED = 2
#: A channel disagrees with all others if its pairs scatter so many times as much as every pair without it.
_INCONSISTENT = 4.0
#: Exchanges and copies that are corrected or left out, one after the other.
_MOST_CAUSES = 3
#: Relative noise of channels that may hide small FRFs of joint DOFs, which are differences of large ones.
_HIDING = 0.05


def check_frfs(
    freq_hz: ArrayLike,
    h: ArrayLike,
    names: Sequence[str | Channel] | None = None,
    *,
    responses: Sequence[str | Channel] | None = None,
    forces: Sequence[str | Channel] | None = None,
    transform: tuple[ArrayLike, ArrayLike] | None = None,
    dofs: Sequence[str] | None = None,
    joint: JointChannels | None = None,
    read_as: str | None = None,
    fix: Sequence[FrfFix] = (),
    blame: Literal["responses", "forces"] = "responses",
) -> FrfCheck:
    """Check measured FRFs before a joint is identified: return each error with its channel and its remedy.

    Parameters
    ----------
    freq_hz : array_like, shape (n_freq,)
        Hz.
    h : array_like, shape (n_freq, n_responses, n_forces)
        Measured receptances, m/N, as `identify` takes them; or at measured points, before any transformation. An FRF
        that is NaN on all lines is missing: the check names it, and judges the remaining FRFs.
    names : sequence of str or Channel, optional
        Names of the channels where responses and forces are the same DOFs, in one order; by default their numbers,
        where `h` is square. Rotations are known by their names, such as ``"j:theta_x"`` or ``"102:rx"``.
    responses, forces : sequence of str or Channel, optional
        Names of rows and columns where they differ. A response and a force of one name are a driving point;
        ``102:-y`` is the opposite of ``102:+y``.
    transform : (array_like, array_like), shapes (2 n, n_responses), (2 n, n_forces), optional
        From responses and from forces to joint DOFs j, then k. If the channels share fewer than two DOFs, the FRFs of
        the joint DOFs are checked instead, and not corrected.
    dofs : sequence of str, optional
        Names of the n joint DOFs, with `transform`.
    joint : JointChannels, optional
        The channels about a joint, which `joint_channels` finds, instead of names, `transform` and `dofs`. The check
        then compares each channel with the rigid motion of its neighbours, and the places with the reference point.
    read_as : {"receptance", "mobility", "accelerance"}, optional
        The quantity that the FRFs were taken for when they were made receptances, for what to do about it.
    fix : sequence of str
        What to correct: "lines" (leave bad ones out), "time-convention", "exchanged", "quantity", "sign", "units",
        "gain", "delay". Nothing by default.
    blame : {"responses", "forces"}
        Which of the two is corrected where they cannot be distinguished: sign, units, gain, delay, exchange.

    Returns
    -------
    FrfCheck
        Findings, and the FRFs with the corrections asked for.

    Raises
    ------
    ValueError
        Wrong shapes, names that do not fit, an unknown option.

    Notes
    -----
    With r_p the response over the force of a DOF as measured, each relative to its true value, h_pq / h_qp = r_p / r_q
    for a reciprocal structure. Over frequency this ratio shows gain (size), sign, delay (phase falling with frequency)
    and quantity (power of i w) of each channel relative to most others, whatever the structure is. Driving points
    have Im h < 0 (receptance), Re h > 0 (mobility) or Im h > 0 (accelerance), and all FRFs of a causal system run
    clockwise through the complex plane.

    Channels of a virtual point are judged by the lines on which all channels but one, or all but one sensor, move most
    like one body. The deformation of the side grows with frequency, so it is small on these lines.

    Standard errors come from the scatter of the ratios over frequency with their correlation from line to line; a
    difference counts from 5 standard errors and 1 %. One cause that explains many symptoms is reported once.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> freq = np.linspace(0.5, 10, 400)
    >>> h = jf.pollute(jf.chain([4, 2, 3], [2000, 2500, 900], [3, 2, 2], ground="start").receptance(freq), 0.02)
    >>> jf.check_frfs(freq, h).ok
    True
    >>> h[:, 1] *= 1.1
    >>> check = jf.check_frfs(freq, h, ["a:x", "b:x", "c:x"], fix=["gain"])
    >>> [(finding.code, finding.about, round(finding.numbers["factor"], 2)) for finding in check.findings]
    [('channel-gain', ('b:x',), 1.1)]
    >>> check.changes[0][:22]
    'response b:x divided b'
    """
    lines = as_lines("h", h)
    freq = as_frequency(freq_hz, lines.shape[0])
    if joint is not None:
        check_type("joint", joint, JointChannels)
        if not all(other is None for other in (names, responses, forces, transform, dofs)):
            raise ValueError("joint has its own channels; leave out names, responses, forces, transform and dofs")
        responses, forces = joint.responses.channels, joint.forces.channels
    rows, columns = as_channel_names(lines.shape[1:], names, responses, forces)
    if read_as is not None:
        check_choice("read_as", read_as, tuple(POWER_OF_I_OMEGA))
    fix = cast("tuple[FrfFix, ...]", as_names("fix", fix))
    for word in fix:
        check_choice("fix", word, get_args(FrfFix))
    check_choice("blame", blame, ("responses", "forces"))
    labels = tuple(map(str, rows)), tuple(map(str, columns))
    missing: NDArray[np.bool_] = np.array(np.isnan(lines).all(axis=0) & (len(lines) > 0), bool)
    found, good = find_bad_lines(freq, np.where(missing, 0, lines) if missing.any() else lines, *labels)
    measurement = as_measurement(freq[good], lines[good], rows, columns, missing)
    state = _Progress(measurement, 1 if blame == "responses" else 2, read_as)
    state.findings.extend([*_missing_findings(missing, joint, *labels), *found])
    is_enough = measurement.freq_hz.size >= LEAST_LINES and measurement.h.size > 0
    wrong = representation_finding(measurement.freq_hz, measurement.h, missing, read_as) if is_enough else None
    if wrong is not None:
        state.findings.append(wrong)  # every other check would find consequences of it
    elif is_enough:
        _check_signals(state)
        unspoilt = None
        if joint is not None:
            state.findings.extend(reference_findings(joint, float(freq[-1])))
            unspoilt = _check_rigid_motion(state, joint)
        _check_channels(state)
        state.findings.extend(amplitude_findings(state.corrected(), state.bad_rows, state.bad_columns))
        if state.measurement.rows.size < 2:
            if joint is not None and unspoilt is not None:
                state.findings.extend(_findings_at_channels(state, unspoilt, joint))
            elif transform is not None:
                state.findings.extend(_findings_at_joint(state, transform, dofs))
    return _result(state, freq, lines, good, fix)


def warn_of_frfs(findings: Iterable[Finding], stacklevel: int = 2) -> None:
    """Issue a `FrfCheckWarning` for each error and warning."""
    for finding in findings:
        if finding.severity != "note":
            warnings.warn(as_warning(finding), stacklevel=stacklevel + 1)


def warn_of_sets(*sets: FrfSet, stacklevel: int = 2) -> None:
    """Check all channels of each set of FRFs, and issue a `FrfCheckWarning` for each error and warning."""
    for frfs in sets:
        some, lines = spread_lines(frfs.freq_hz.size), frfs.receptance()
        check = check_frfs(lines.freq_hz[some], lines.h[some], responses=lines.responses, forces=lines.excitations,
                           read_as=frfs.quantity)  # fmt: skip
        test = frfs.source if len(sets) > 1 else ""
        warn_of_frfs([replace(one, test=test) for one in check.findings], stacklevel + 1)


def wrong_numbers(frfs: FrfSet) -> Finding | None:
    """Report wrong magnitudes or phases of all FRFs of a set; None if they are right."""
    lines = frfs.receptance()
    return wrong_numbers_of(lines.freq_hz, lines.h, frfs.quantity)


def wrong_numbers_of(freq_hz: FloatArray, h: ComplexArray, read_as: str | None = None) -> Finding | None:
    """Report wrong magnitudes or phases of all receptances, which were read as some quantity."""
    missing = np.asarray(np.isnan(h).all(axis=0))
    good = (np.isfinite(h) | missing).all(axis=(1, 2)) & (freq_hz > 0)
    if np.count_nonzero(good) < LEAST_LINES:
        return None
    if not good.all():
        freq_hz, h = freq_hz[good], h[good]
    return representation_finding(freq_hz, h, missing, read_as)


def as_accepted(accept: Sequence[str]) -> tuple[str, ...]:
    """Check the codes of findings at which a fit does not stop."""
    codes = as_names("accept", accept)
    for code in codes:
        if code not in FATAL_CODES:
            raise ValueError(f"unknown code {one_line(code)} in accept; use one of {', '.join(FATAL_CODES)}")
    return codes


def stop_at_errors(findings: Iterable[Finding], accept: Sequence[str] = ()) -> None:
    """Raise FrfCheckError for errors with which no fit is meaningful, unless their codes are accepted."""
    fatal = [one for one in findings if one.severity == "error" and one.code in FATAL_CODES and one.code not in accept]
    if fatal:
        codes = list(dict.fromkeys(one.code for one in fatal))
        texts = some_of([one.text for one in fatal], _STOPPED, "; ")
        raise FrfCheckError(f"{texts}. To fit nevertheless, set accept={codes} [{', '.join(codes)}]")


@dataclass
class _Progress:
    """The FRFs still to be checked, and what has been found so far."""

    measurement: Measurement
    side: int
    read_as: str | None = None
    bad_rows: set[int] = field(default_factory=set)
    bad_columns: set[int] = field(default_factory=set)
    findings: list[Finding] = field(default_factory=list)
    corrections: list[Correction] = field(default_factory=list)

    def add(self, found: Iterable[Finding | Correction]) -> None:
        for one in found:
            if isinstance(one, Finding):
                self.findings.append(one)
            else:
                self.corrections.append(one)

    def corrected(self) -> Measurement:
        """Return the measurement with all corrections found so far."""
        one = self.measurement
        return replace(one, h=corrected(one.omega, one.h, self.corrections)) if self.corrections else one


def _missing_findings(
    missing: NDArray[np.bool_], joint: JointChannels | None, rows: Sequence[str], columns: Sequence[str]
) -> list[Finding]:
    """Name FRFs that are missing, and what a fit makes of it."""
    if not missing.any():
        return []
    pairs = tuple(f"{rows[i]} / {columns[j]}" for i, j in zip(*np.nonzero(missing), strict=True))
    numbers = {"count": len(pairs), "total": missing.size, "pairs": pairs}
    if joint is None:
        return [Finding("missing-frf", numbers, pairs)]
    try:
        left_out = joint.without_missing(~missing)[1]
    except FileContentError as error:
        return [Finding("missing-frf", numbers | {"reason": str(error)}, pairs, severity="error", variant="too-many")]
    names = [f"{one.kind} {one.channel} ({one.others} others on side {one.side})" for one in left_out]
    return [Finding("missing-frf", numbers | {"left_out": ", ".join(names)}, pairs, variant="left-out")]


def _check_signals(state: _Progress) -> None:
    """Find dead and doubled channels, which no other check judges."""
    findings, rows, columns = check_signals(state.measurement)
    state.findings.extend(findings)
    state.bad_rows.update(rows)
    state.bad_columns.update(columns)


def _check_rigid_motion(state: _Progress, joint: JointChannels) -> JointChannels | None:
    """Compare each channel with the motion of its neighbours; return the joint without the wrong channels."""
    m = state.measurement
    for group in _groups(state, joint):
        names, bad = (m.responses, state.bad_rows) if group.word == "response" else (m.forces, state.bad_columns)
        for finding, places in rigid_faults(group, m.freq_hz, [names[i] for i in group.places]):
            state.findings.append(finding)
            bad.update(places)
    try:
        good = joint.without(state.bad_rows, state.bad_columns)
        return good.without_missing(~m.hidden[np.ix_(*_places_of(good, joint))])[0]
    except ValueError:
        return None


def _places_of(some: JointChannels, joint: JointChannels) -> tuple[list[int], list[int]]:
    """Return the places of the responses and forces of a joint among those of another one."""
    pairs = (some.responses, joint.responses), (some.forces, joint.forces)
    rows, columns = ([every.channels.index(channel) for channel in own.channels] for own, every in pairs)
    return rows, columns


def _groups(state: _Progress, joint: JointChannels) -> Iterator[ChannelGroup]:
    """Yield the responses and the forces of both sides, without channels in which an error was found."""
    m = state.measurement
    words: tuple[tuple[Literal["response", "force"], str], ...] = (("response", "response"), ("force", "excitation"))
    for word, kind in words:
        bad, across, h, gone, interface = state.bad_rows, state.bad_columns, m.h, m.hidden, joint.responses
        if word == "force":
            bad, across, h, gone, interface = across, bad, h.swapaxes(1, 2), gone.T, joint.forces
        columns = np.setdiff1d(np.arange(h.shape[2]), [*across])
        first = 0
        for side in ("j", "k"):
            point, positions = joint.points[kind, side], joint.positions[kind, side]
            own = np.setdiff1d(np.flatnonzero(point.weights > 0), [i - first for i in bad])
            at = own + first
            first += len(positions)
            if own.size and columns.size:
                nodes = tuple(interface.channels[i].node for i in at)
                directions = point.motion[own, :3]
                group = ChannelGroup(word, at, nodes, positions[own], directions, h[:, at][:, :, columns])
                yield group.filled(gone[np.ix_(at, columns)])


def _findings_at_channels(state: _Progress, joint: JointChannels, every: JointChannels) -> list[Finding]:
    """Return findings at the joint DOFs, of virtual points without the channels that are wrong."""
    rows, columns = _places_of(joint, every)
    m = state.corrected()
    t_out, t_in = joint.responses.transform, joint.forces.transform
    h = m.h[:, rows][:, :, columns]
    share = np.max([not_rigid(group) for group in _groups(state, every)], axis=0)
    found = side_findings(m.freq_hz, t_out @ h @ t_in.T, share, _hidden(h, t_out, t_in), state.read_as)
    return _new_findings(state, found)


def _findings_at_joint(
    state: _Progress, transform: tuple[ArrayLike, ArrayLike], dofs: Sequence[str] | None
) -> list[Finding]:
    """Return findings at the joint DOFs, of kinds that the channels have not shown."""
    if not isinstance(transform, tuple | list) or len(transform) != 2:
        raise TypeError(f"transform must be a pair, for responses and forces, not {type(transform).__name__}")
    m = state.corrected()
    t_out = as_real("transform[0]", transform[0], (None, m.h.shape[1]))
    t_in = as_real("transform[1]", transform[1], (t_out.shape[0], m.h.shape[2]))
    names = [str(i) for i in range(t_out.shape[0] // 2)] if dofs is None else as_names("dofs", dofs)
    if 2 * len(names) != t_out.shape[0]:
        raise ValueError(
            f"dofs must name {t_out.shape[0] / 2:g} joint DOFs, half the rows of transform, not {len(names)}"
        )
    labels = [f"{side}:{name}" for side in "jk" for name in names]
    hidden = _hidden(m.h, t_out, t_in)
    joint = _Progress(
        as_measurement(m.freq_hz, t_out @ m.h @ t_in.T, labels, labels, hidden), state.side, state.read_as
    )
    _check_signals(joint)
    _check_channels(joint)
    return _new_findings(state, joint.findings)


def _new_findings(state: _Progress, found: Iterable[Finding]) -> list[Finding]:
    """Return the findings whose codes have not been reported."""
    known = {finding.code for finding in state.findings}
    return [finding for finding in found if finding.code not in known]


def _hidden(channels: ComplexArray, t_out: FloatArray, t_in: FloatArray) -> np.ndarray:
    """FRFs of joint DOFs that the noise of the channels may hide, which are differences of large numbers."""
    # the deviation of transformed FRFs where that of each channel is its size
    deviation = np.sqrt(t_out**2 @ abs(channels) ** 2 @ (t_in**2).T)
    hidden: np.ndarray = np.median(abs(t_out @ channels @ t_in.T), axis=0) < _HIDING * np.median(deviation, axis=0)
    return hidden


def _check_channels(state: _Progress) -> None:
    """Judge time convention, reciprocity, driving points, in this order: each cause is reported once."""
    rows, columns = sorted(state.bad_rows), sorted(state.bad_columns)
    m = state.measurement = state.measurement.without(rows, columns)
    smooth = m.smoothness.copy()
    smooth[rows], smooth[:, columns] = 0, 0
    conjugated = convention_finding(m.omega, m.h, smooth)
    if conjugated is not None:
        state.findings.append(conjugated)
        state.corrections.append(Correction("time-convention", "all FRFs conjugated", conjugate=True))
    if not m.rows.size:
        return
    m = state.corrected()
    pairs = pair_ratios(m.omega, m.square, m.square_smoothness)
    for _ in range(_MOST_CAUSES):
        cause = find_cause(m, pairs)
        if cause is None:
            break
        state.add(cause_findings(m, pairs, cause, state.side))
        if cause.kind == "pairs":
            break
        if cause.kind != "exchanged":
            at = list(cause.channels[-1:])
            state.measurement = state.measurement.without(m.rows[at].tolist(), m.columns[at].tolist())
        m = state.corrected()
        if not m.rows.size:
            return
        pairs = pair_ratios(m.omega, m.square, m.square_smoothness)
    _check_ratios(state, m, pairs)


def _check_ratios(state: _Progress, m: Measurement, pairs: PairRatios) -> None:
    ratios = channel_ratios(pairs, m.rows.size, least_gain=LEAST_GAIN, least_delay=LEAST_PHASE / m.omega[-1])
    sector, strength = sectors(m.driving, pairs.inflation), None
    if m.rows.size == 1:  # no reciprocity: the other responses of the column show the modes
        sector, strength = _of_column(state, m, sector)
    relative = ratios.group, ratios.power, ratios.sign
    found = quantities(m.omega, m.driving[..., None], *relative, sector, strength)
    if strength is None and (found.power.any() or (found.sign < 0).any()):
        # |h| between few resonances may rise with frequency as that of accelerances does; residues do not.
        strength = strength_exponent(resonances(m.freq_hz, m.driving))
        found = quantities(m.omega, m.driving[..., None], *relative, sector, strength)
    state.add(quantity_findings(m, found, sector, state.read_as))
    gains = list(gain_findings(m, ratios, state.side))
    is_else_reciprocal = not gains and not any(one.code == "reciprocity" for one in state.findings)
    state.add(sign_findings(m, found, sector, state.side, may_rotate=is_else_reciprocal))
    state.add(gains)
    state.add(delay_findings(m, ratios, state.side))
    state.findings.extend(inconsistent_findings(m, pairs))
    codes = {finding.code for finding in state.findings}
    if not codes & {"passivity", "driving-point-residues"}:
        # A copy that is left out may contain all pairs: the correlation between lines is then unknown.
        is_lost = not pairs.usable.any() and "doubled-channel" in codes
        inflation = np.inf if is_lost else pairs.inflation
        active = passivity_findings(state.corrected(), _noise(pairs, m.rows.size), inflation)
        # A delay of a force turns its driving point the other way than a delay of the response.
        delayed = {name for finding in state.findings if finding.code == "channel-delay" for name in finding.about}
        state.findings.extend(finding for finding in active if not delayed.issuperset(finding.about))


def _of_column(state: _Progress, m: Measurement, sector: Sectors) -> tuple[Sectors, float | None]:
    """Judge the only driving point by the resonances of its column; return its half plane and how residues grow."""
    row, column = int(m.rows[0]), int(m.columns[0])
    use = np.setdiff1d(np.flatnonzero(m.smoothness[:, column] > LEAST_SMOOTHNESS), [*state.bad_rows])
    if row not in use:
        return sector, None
    found = resonances(m.freq_hz, m.h[:, use, column] * m.signs[0])
    place = int(np.flatnonzero(use == row)[0])
    findings = list(driving_point_findings(found, place, [m.responses[i] for i in use]))
    state.findings.extend(findings)
    signs = signs_at(found)[:, place]
    if findings:
        sector = replace(sector, quarter=np.full(1, -1))
    elif np.count_nonzero(signs) >= LEAST_MODES:
        sector = replace(sector, quarter=np.full(1, 0 if signs.sum() > 0 else 2))
    return sector, strength_exponent(found)


def inconsistent_findings(m: Measurement, pairs: PairRatios) -> Iterator[Finding]:
    """Yield the channel that disagrees with all others by more than gain, delay and noise.

    All its pairs h_pq / h_qp scatter far more than every pair without it, and smoothly over frequency: noise does not.
    """
    n, used = m.rows.size, np.flatnonzero(pairs.usable)
    for channel in range(n) if n > 2 else ():
        own = (pairs.p[used] == channel) | (pairs.q[used] == channel)
        if not own.any() or own.all():
            continue
        scatter = pairs.scatter[used]
        if scatter[own].min() < _INCONSISTENT * scatter[~own].max():
            continue
        p, q = pairs.p[used][own], pairs.q[used][own]
        ratio = m.square[:, p, q] / m.square[:, q, p]
        apart = np.log(np.where(np.isfinite(ratio) & (ratio != 0), ratio, 1))
        apart = apart - np.median(apart.real, axis=0) - 1j * np.median(apart.imag, axis=0)
        if is_smooth(apart.T):
            numbers = {"scatter": float(np.median(scatter[own])), "others": float(scatter[~own].max())}
            yield Finding("channel-inconsistent", numbers, (m.dofs[channel],))


def _noise(pairs: PairRatios, n: int) -> FloatArray:
    """Return the deviation of the phase of an FRF of each channel, from the scatter of its ratios; 0 if unknown."""
    ends = np.concatenate([pairs.p[pairs.usable], pairs.q[pairs.usable]])
    scatter = np.tile(pairs.scatter[pairs.usable], 2)
    count = np.bincount(ends, minlength=n)
    return np.asarray(np.bincount(ends, scatter, n) / np.maximum(count, 1) / np.sqrt(4 * np.log(2)))


def _result(state: _Progress, freq: FloatArray, h: ComplexArray, good: np.ndarray, fix: Sequence[FrfFix]) -> FrfCheck:
    changes = []
    if "lines" in fix and not good.all():
        freq, h = freq[good], np.ascontiguousarray(h[good])
        changes.append(f"{(~good).sum()} lines left out")
    for correction in state.corrections:
        if correction.fix in fix:
            h = correction.apply(2 * np.pi * freq, h)
            changes.append(correction.text)
    return FrfCheck(worst_first(state.findings), freq, h, tuple(changes), _unseen(state.measurement))


def _unseen(measurement: Measurement) -> str:
    common = "a gain that all channels share: it changes stiffness and damping by the same factor"
    if measurement.rows.size < 2:
        return (
            f"{common}; fewer than two DOFs have both a response and a force, so gain, units and delay of channels are "
            "not compared"
        )
    return f"{common}; a delay that all share, unless it turns the phase of a driving point"
