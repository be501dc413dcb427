"""Amplitude of a joint in a fit: motion and weight of each line, and dependence of the stiffness on amplitude."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple, Self, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.choices import MotionQuantity
from jointfrf.dofs import is_rotation
from jointfrf.identification.fit_data import FitData, ModelData
from jointfrf.identification.model.uncertainty import ModelLinearised
from jointfrf.identification.result import Fit
from jointfrf.kernel.arguments import ComplexArray, FloatArray, as_positive, check_choice, check_type, one_line
from jointfrf.laws.law import JointLaw, LawField
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.springs import SpringLaw
from jointfrf.spelling import did_you_mean

__all__ = ["Bend", "DofLines", "Drive", "lines_of_fit", "with_amplitude"]

#: Difference of ln a below which amplitudes are equal.
_HELD = 0.01
#: Complex degrees of freedom of the departures: number of classes of amplitude beyond the number of powers of ln a.
_CLASSES = 4
#: Least number of lines of a class.
_LINES = 3
#: Eigenvalues of an information below this share of the largest are rounding.
_RANK = 1e-10

Held = Literal["force", "response", "joint"]


@dataclass(frozen=True)
class Drive:
    """Quantity that a test controls to one level on all lines.

    Parameters
    ----------
    held : {"force", "response", "joint"}
        Controlled quantity: the force, the motion of a channel, or the relative motion in the joint.
    level : float
        Peak value of the quantity: N (N m), m, m/s or m/s^2, rad.
    channel : str
        Name of the controlled channel in the fit, or the joint DOF.
    quantity : {"displacement", "velocity", "acceleration"}
        Kind of motion of the channel.

    Examples
    --------
    >>> import jointfrf as jf
    >>> print(jf.Drive("force", 2.0)); print(jf.Drive("response", 9.81, "A/1:y", "acceleration"))
    force 2 N
    A/1:y 9.81 m/s^2
    """

    held: Held
    level: float
    channel: str = ""
    quantity: MotionQuantity = "displacement"

    def __post_init__(self) -> None:
        check_choice("held", self.held, get_args(Held))
        check_choice("quantity", self.quantity, get_args(MotionQuantity))
        object.__setattr__(self, "level", as_positive("level", self.level))
        check_type("channel", self.channel, str)
        if (self.held == "force") == bool(self.channel):
            what = (
                "a force has no channel; leave it out"
                if self.channel
                else "channel is empty; name the controlled channel"
            )
            raise ValueError(f"{what}: {one_line(self.channel)}")

    def __str__(self) -> str:
        unit = {"force": "N", "joint": "rad" if is_rotation(self.channel) else "m"}
        own = unit.get(self.held, ("m", "m/s", "m/s^2")[self.power])
        return f"{self.channel or 'force'} {self.level:g} {own}"

    @property
    def power(self) -> int:
        """Power of omega by which the quantity exceeds a displacement."""
        return get_args(MotionQuantity).index(self.quantity)


class AmplitudeSpring(JointLaw):
    """A spring whose K* is a polynomial of ln a, with a known amplitude on each line.

    Parameters
    ----------
    spring : SpringLaw
        Spring at the reference amplitude.
    omega : ndarray, shape (n_freq,)
        Angular frequency, rad/s, rising.
    x : ndarray, shape (n_freq,)
        Logarithm of the amplitude over the reference amplitude.
    terms : tuple of float
        Real and imaginary part of the factors of x, x^2/2, ...
    """

    def __init__(self, spring: SpringLaw, omega: FloatArray, x: FloatArray, terms: tuple[float, ...]) -> None:
        self.spring, self.omega, self.x, self.terms = spring, omega, x, terms

    @property
    def fields(self) -> tuple[LawField, ...]:
        """Fields of the spring, then ``k1``, ``h1``, ..."""
        names = [f"{part}{i}" for i in range(1, len(self.terms) // 2 + 1) for part in "kh"]
        return (*self.spring.fields, *(LawField(name, "stiffness") for name in names))

    @property
    def values(self) -> FloatArray:
        """Values of the parameters, shape (p,)."""
        return np.array([*self.spring.values, *self.terms])

    def with_values(self, values: ArrayLike) -> Self:
        """Return the same law with other values of its parameters, shape (p,)."""
        found, n = self.checked(values), len(self.spring.fields)
        return type(self)(self.spring.with_values(found[:n]), self.omega, self.x, tuple(found[n:].tolist()))

    def _powers(self, omega: FloatArray) -> list[FloatArray]:
        x = np.interp(omega, self.omega, self.x)
        return [np.asarray(x**i / math.factorial(i)) for i in range(1, len(self.terms) // 2 + 1)]

    def stiffness(self, omega: FloatArray) -> ComplexArray:
        """Return K*(w), shape (n_freq,)."""
        found = self.spring.stiffness(omega)
        for i, power in enumerate(self._powers(omega)):
            found = found + (self.terms[2 * i] + 1j * self.terms[2 * i + 1]) * power
        return found

    def slopes(self, omega: FloatArray) -> ComplexArray:
        """Return the derivatives of K*(w) by each parameter, shape (p, n_freq)."""
        own = [power * unit for power in self._powers(omega) for unit in (1.0, 1j)]
        return np.concatenate([self.spring.slopes(omega), np.asarray(own, np.complex128)])


class Bend(NamedTuple):
    """Dependence of K* on amplitude over the lines of one test.

    Attributes
    ----------
    slope : complex
        Coefficient of a power of ln a in K*.
    p_value : float
        p-value under the hypothesis that the joint does not depend on amplitude.
    """

    slope: complex
    p_value: float


class Excess(NamedTuple):
    """Uncertainty at one amplitude due to departures of K* from a polynomial of ln a.

    Attributes
    ----------
    variance : ndarray, shape (2,)
        Variance of real and imaginary part, (N/m)^2 or (N m/rad)^2.
    degrees : float
        Degrees of freedom of the variance.
    p_value : float
        p-value of the departures.
    expected : ndarray, shape (n,)
        Complex departures of the classes, given their variance.
    """

    variance: FloatArray
    degrees: float
    p_value: float
    expected: ComplexArray


@dataclass(frozen=True)
class Departures:
    """K* on n classes of amplitude less K* of the fit, estimated next to all other parameters of the fit.

    Attributes
    ----------
    information : ndarray, shape (2 n, 2 n)
        Information on the departures, real parts first, in units of the residual.
    score : ndarray, shape (2 n,)
        The departures are `information`^-1 `score`.
    x : ndarray, shape (n,)
        Mean of ln (a / centre).
    residual_degrees : int
        Degrees of freedom of the residual, in whose units the information is.
    """

    information: FloatArray
    score: FloatArray
    x: FloatArray
    residual_degrees: int

    @property
    def mean(self) -> tuple[complex, float]:
        """Mean departure by one step from the fit, and the standard error of its imaginary part."""
        columns = np.kron(np.eye(2), np.ones((self.x.size, 1)))
        inverse = _inverse(columns.T @ self.information @ columns)
        step = inverse @ columns.T @ self.score
        return complex(step[0], step[1]), math.sqrt(inverse[1, 1])

    def excess(self, order: int, x: float) -> Excess:
        """Return the uncertainty at the amplitude x due to departures from a polynomial of this order.

        K* of the classes is X beta + u, u ~ N(0, v). With the information W and the projection P on the complement of X
        in its metric, E(Q) = degrees + v trace(P) gives v (DerSimonian and Laird). Given v, the precision of K* of a
        class is W + M/v, where M, for u, is the projection on the complement of X in its metric. The result is the
        increase of the variance over v = 0, plus the square of the expected departure.
        """
        from scipy.special import fdtrc

        n, degrees = self.x.size, 2 * (self.x.size - order - 1)
        none = np.zeros(n, np.complex128)
        if degrees <= 0:
            return Excess(np.zeros(2), 1.0, 1.0, none)
        columns = np.kron(np.eye(2), np.vander(self.x, order + 1, increasing=True))
        w, of_powers = self.information, columns.T @ self.score
        inverse = _inverse(columns.T @ w @ columns)
        left = float(self.score @ _inverse(w) @ self.score - of_powers @ inverse @ of_powers)
        trace = float(np.trace(w) - np.trace(inverse @ columns.T @ w @ w @ columns))
        p_value = float(fdtrc(degrees, self.residual_degrees, max(left, 0.0) / degrees))
        if left <= degrees or trace <= 0:
            return Excess(np.zeros(2), float(degrees), p_value, none)
        basis = np.linalg.qr(columns)[0]
        variance = _inverse(w + (np.eye(2 * n) - basis @ basis.T) * trace / (left - degrees))
        more = np.diagonal(variance) - np.einsum("ij,jk,ik->i", columns, inverse, columns)
        step, own = variance @ self.score, int(np.argmin(abs(self.x - x))) + np.array([0, n])
        expected = step[:n] + 1j * step[n:]
        return Excess(np.maximum(more[own], 0.0) + step[own] ** 2, float(degrees), p_value, expected)


def _inverse(information: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.pinv(information, rcond=_RANK, hermitian=True))


@dataclass(frozen=True)
class DofLines:
    """A DOF of the joint on the lines of a fit.

    Attributes
    ----------
    amplitude : ndarray, shape (n_freq, n_i)
        Peak relative motion for each force alone, m or rad.
    weights : ndarray, shape (2, n_freq, n_i)
        Weights of K* of each line in the fitted stiffness, and of its imaginary part in the fitted damping; sums are 1.
    omega : float
        Angular frequency to which viscous damping belongs, rad/s.
    source : _ModelLines or _JointLines
        Residual and derivatives of the fit.
    """

    amplitude: FloatArray
    weights: FloatArray
    omega: float
    source: _ModelLines | _JointLines

    @property
    def mean_amplitude(self) -> float:
        """Amplitude to which the fitted stiffness belongs.

        A fit of a constant K* to a joint whose K* is linear in ln a gives the value of K* at this amplitude. If the
        models have unknowns, weights have both signs, and the amplitude may be outside the amplitudes of the lines.
        Then fit K* as a function of ln a about `centre`.
        """
        return float(np.exp(np.sum(self.weights[0] * np.log(self.amplitude))))

    @property
    def is_held(self) -> bool:
        """Whether the amplitude is the same on all lines within 1 %, so that K* changes by no more."""
        return float(np.ptp(np.log(self.amplitude))) < _HELD

    @property
    def centre(self) -> float:
        """Geometric mean of the amplitudes, weighted by the magnitude of each line's weight in the stiffness."""
        size = abs(self.weights[0])
        return float(np.exp(np.sum(size * np.log(self.amplitude)) / size.sum()))

    def range(self, share: float = 0.95) -> tuple[float, float]:
        """Return the limits of the amplitudes with this share of the weight in the stiffness."""
        size, order = abs(self.weights[0]).ravel(), np.argsort(self.amplitude, axis=None)
        part = np.cumsum(size[order]) / size.sum()
        a = self.amplitude.ravel()[order]
        low, high = (int(np.searchsorted(part, (1 + sign * share) / 2)) for sign in (-1, 1))
        return float(a[low]), float(a[min(high, a.size - 1)])

    def bend(self, power: int = 1) -> Bend:
        """Return the dependence of K* on a power of ln a, estimated together with all parameters of the fit."""
        x = np.log(self.amplitude / self.centre) ** power
        if self.is_held:
            return Bend(0j, 1.0)
        return self.source.bend(x)

    def classes(self, order: int) -> NDArray[np.intp]:
        """Return the class of amplitude of each line and force, by the mean of shares of information and of number.

        There is one class if the amplitude is constant or lines are few.
        """
        count = min(order + 1 + _CLASSES, len(self.amplitude) // _LINES)
        if self.is_held or count <= order + 1:
            return np.zeros(self.amplitude.shape, np.intp)
        size, rank = self.source.known().ravel(), np.argsort(self.amplitude, axis=None, kind="stable")
        part = np.empty(size.size)
        part[rank] = (np.cumsum(size[rank]) - size[rank] / 2) / size.sum()
        part[rank] = (part[rank] + (np.arange(size.size) + 0.5) / size.size) / 2
        found = np.minimum((count * part).astype(np.intp), count - 1)
        return np.unique(found, return_inverse=True)[1].reshape(self.amplitude.shape).astype(np.intp)

    def departures(self, order: int) -> Departures:
        """Return K* on classes of amplitude less K* of the fit."""
        return self.source.departures(np.log(self.amplitude / self.centre), self.classes(order))

    def excess(self, order: int) -> Excess:
        """Return the uncertainty at `mean_amplitude` due to departures of K* from a polynomial."""
        return self.departures(order).excess(order, math.log(self.mean_amplitude / self.centre))


def lines_of_fit(fit: Fit, drive: Drive) -> dict[str, DofLines]:
    """Return amplitudes and weights of the lines of a fit for each DOF that is a spring, by its name.

    Raises
    ------
    ValueError
        The fit has no FRFs, or the drive does not belong to it.
    """
    motion = _model_lines(fit, fit.data) if isinstance(fit.data, ModelData) else _joint_lines(fit)
    force = _force(fit, drive, motion)
    found = {}
    for dof, own in motion.sources.items():
        amplitude = abs(motion.per_force[:, fit.dofs.index(dof)]) * force
        if not (amplitude > 0).all():
            raise ValueError(f"{dof}: the drive does not move this joint DOF on all lines; use another drive or band")
        weights = own.weights()
        omega = float(np.sum(abs(weights[1]) * fit.freq_hz[:, None]) / abs(weights[1]).sum() * 2 * np.pi)
        found[dof] = DofLines(amplitude, weights, omega, own)
    return found


class _Motion(NamedTuple):
    """Relative motion per force (n_freq, n, n_i); FRFs as predicted, names of their rows; lines of DOFs."""

    per_force: ComplexArray
    predicted: ComplexArray
    names: tuple[str, ...]
    sources: dict[str, _ModelLines | _JointLines]


def _force(fit: Fit, drive: Drive, motion: _Motion) -> FloatArray:
    """Return the force on each line, shape (n_freq, n_i) or (1, 1)."""
    if drive.held == "force":
        return np.full((1, 1), drive.level)
    names = fit.dofs if drive.held == "joint" else motion.names
    if drive.channel not in names:
        hint = did_you_mean(drive.channel, names)
        raise ValueError(
            f"the fit has no {one_line(drive.channel)}, which was controlled; use one of {', '.join(names)}{hint}"
        )
    row = names.index(drive.channel)
    size = abs((motion.per_force if drive.held == "joint" else motion.predicted)[:, row])
    if not (size > 0).all():
        raise ValueError(f"{drive.channel} was controlled, but does not move on all lines; name another channel")
    power = 0 if drive.held == "joint" else drive.power
    found: FloatArray = drive.level / (2 * np.pi * fit.freq_hz[:, None]) ** power / size
    return found


def _parameters(fit: Fit, dof: str) -> tuple[int, int | None] | None:
    """Return the indices of stiffness and damping of a DOF, or None if it is not a spring of finite stiffness."""
    own = {
        one.kind: i for i, one in enumerate(fit.parameters) if one.origin == "joint" and one.row == one.column == dof
    }
    law = None if fit.laws is None else fit.laws.laws.get((dof, dof))
    if not isinstance(law, SpringLaw | AmplitudeSpring | None) or not np.isfinite(fit.estimate[own.get("k", 0)]):
        return None
    if "k" not in own:
        return None
    return own["k"], own.get("h", own.get("c"))


@dataclass(frozen=True)
class _ModelLines:
    """A DOF of a fit with models: derivatives of weighted FRFs by K* (`slopes`) and by coordinates; covariance."""

    slopes: ComplexArray
    of_fit: ComplexArray
    residual: ComplexArray
    covariance: FloatArray
    places: tuple[int, int | None]
    of_joint: tuple[int, ...]

    def departures(self, x: FloatArray, codes: NDArray[np.intp]) -> Departures:
        """Project the residual on dH/dK* of each class, less the part that parameters except this DOF's explain."""
        count = int(codes.max()) + 1
        rows = [(self.slopes * (codes == one)[:, None, :] * unit).ravel() for unit in (1.0, 1j) for one in range(count)]
        added = np.ascontiguousarray(rows).view(np.float64)
        others = np.setdiff1d(np.arange(len(self.of_fit)), self.of_joint)
        own = np.ascontiguousarray(self.of_fit[others]).reshape(others.size, self.residual.size).view(np.float64)
        residual = np.ascontiguousarray(self.residual).ravel().view(np.float64)
        known = np.linalg.inv(self.covariance)[np.ix_(others, others)]
        cross = added @ own.T
        information = added @ added.T - cross @ np.linalg.solve(known, cross.T)
        score = added @ residual
        gain = float(score @ _inverse(information) @ score)
        left = max(int(np.count_nonzero(residual)) - len(self.of_fit) - 2 * count, 1)
        level = (float(residual @ residual) - gain) / left
        means = np.array([x[codes == one].mean() for one in range(count)])
        return Departures(information / level, score / level, means, left)

    def known(self) -> FloatArray:
        """Return the information of each line and force on K*, shape (n_freq, n_i)."""
        size = np.abs(self.slopes) ** 2
        found: FloatArray = size.reshape(len(size), -1, size.shape[-1]).sum(axis=1)
        return found

    def weights(self) -> FloatArray:
        found = []
        for place, unit in zip(self.places, (1.0, 1j), strict=True):
            if place is None:
                continue
            influence = np.tensordot(self.covariance[place], self.of_fit, 1)
            own = np.sum((influence.conj() * self.slopes * unit).real, axis=1)
            found.append(own / own.sum())
        return np.array([found[0], found[-1]])

    def bend(self, x: FloatArray) -> Bend:
        """Test the score of K* in proportion to x, less the part that other parameters explain."""
        rows = [(self.slopes * x[:, None, :] * unit).ravel() for unit in (1.0, 1j)]
        added = np.ascontiguousarray(rows).view(np.float64)
        own = np.ascontiguousarray(self.of_fit).reshape(len(self.of_fit), -1).view(np.float64)
        residual = np.ascontiguousarray(self.residual).ravel().view(np.float64)
        cross = added @ own.T
        information = added @ added.T - cross @ self.covariance @ cross.T
        score = added @ residual
        seen = int(np.count_nonzero(residual))
        return _bend(information, score, float(residual @ residual), seen - len(own))


@dataclass(frozen=True)
class _JointLines:
    """A DOF of a fit at the joint: K* of each line less K* of the fit, and the line's share of the information."""

    difference: ComplexArray
    shares: FloatArray
    per_force: FloatArray

    def departures(self, x: FloatArray, codes: NDArray[np.intp]) -> Departures:
        """Average K* over the lines of each class; a line belongs to the class of the force that moves it most."""
        weight = self.weights()[0]
        line = np.arange(len(weight))
        force = np.argmax(self.per_force, axis=1)
        share, own, mean = weight.sum(axis=1), codes[line, force], x[line, force]
        good = (share > 0) & np.isfinite(self.difference)
        y, w = self.difference[good], share[good] * good.sum()
        level = float(np.median(w * abs(y) ** 2) / (2 * np.log(2)))
        count = int(own[good].max()) + 1 if good.any() else 1
        each = [own[good] == one for one in range(count)]
        information = np.array([w[one].sum() for one in each]) / level
        sums = np.array([(w[one] * y[one]).sum() for one in each]) / level
        means = np.array([mean[good][one].mean() if one.any() else 0.0 for one in each])
        score = np.concatenate([sums.real, sums.imag])
        return Departures(np.diag(np.tile(information, 2)), score, means, max(2 * int(good.sum()) - 2 * count, 1))

    def known(self) -> FloatArray:
        """Return the information of each line and force on K*, shape (n_freq, n_i)."""
        found: FloatArray = self.weights()[0]
        return found

    def weights(self) -> FloatArray:
        size = self.per_force**2
        by_force = size / size.sum(axis=1, keepdims=True)
        own = [share[:, None] * by_force for share in self.shares]
        return np.array([one / one.sum() for one in own])

    def bend(self, x: FloatArray) -> Bend:
        """Fit a straight line to K* of the lines over ln a."""
        weight = self.weights()[0]
        share = weight.sum(axis=1)
        mean = np.sum(weight * x, axis=1) / np.where(share > 0, share, 1)
        good = (share > 0) & np.isfinite(self.difference)
        n = int(good.sum())
        w, t, y = share[good] * n, mean[good], self.difference[good]
        if n < 3 or np.ptp(t) == 0:
            return Bend(0j, 1.0)
        t, y = t - np.sum(w * t) / w.sum(), y - np.sum(w * y) / w.sum()
        level = 1.0 / float(np.median(w * abs(y) ** 2) / (2 * np.log(2)))
        information, score = level * np.sum(w * t * t), level * np.sum(w * t * y)
        squares = level * float(np.sum(w * abs(y) ** 2))
        return _bend(np.eye(2) * information, np.array([score.real, score.imag]), squares, 2 * n - 2)


def _bend(information: FloatArray, score: FloatArray, squares: float, degrees: int) -> Bend:
    """Return slopes from information and score, tested against the remaining sum of squares."""
    from scipy.special import fdtrc

    slope = np.linalg.lstsq(information, score, rcond=1e-10)[0]
    gain, left = float(score @ slope), max(degrees - 2, 1)
    rest = max((squares - gain) / left, 1.0)
    return Bend(complex(slope[0], slope[1]), float(fdtrc(2, left, max(gain, 0.0) / 2 / rest)))


def _at_the_minimum(at: ModelLinearised) -> ComplexArray:
    """Return the residual one Newton step from the end of the search, where other parameters have no gradient left."""
    flat = at.slopes.reshape(len(at.slopes), -1)
    gradient = (flat.conj() @ at.residual.ravel()).real + at.priors.gradient.sum(axis=0)
    step = at.covariance @ gradient
    return np.asarray(at.residual - np.tensordot(step, at.slopes, 1))


def _model_lines(fit: Fit, data: ModelData) -> _Motion:
    found = data.joint_motion()
    residual = _at_the_minimum(found.gradient)
    gradient, sources = found.gradient, dict[str, _ModelLines | _JointLines]()
    for d, dof in enumerate(fit.dofs):
        places = _parameters(fit, dof)
        if places is not None:
            of_joint = tuple(
                i for i, one in enumerate(fit.parameters) if one.origin == "joint" and one.row == one.column == dof
            )
            sources[dof] = _ModelLines(
                found.slopes[d], gradient.slopes, residual, gradient.covariance, places, of_joint
            )
    return _Motion(found.per_force, found.predicted, fit.responses, sources)


def _joint_lines(fit: Fit) -> _Motion:
    data = fit.data
    if not isinstance(data, FitData):
        raise ValueError("the fit was loaded without its FRFs; fit the FRFs again")
    if data.modes is None:
        raise ValueError("the transform does not relate the channels to the joint; give positions or the joint DOFs")
    gamma, n = data.regenerated(slice(None)), len(fit.dofs)
    known = np.asarray(np.isfinite(gamma).all(axis=(1, 2)))
    gamma = np.where(known[:, None, None], gamma, np.nanmean(gamma, axis=0)) if not known.all() else gamma
    out, into = data.modes
    per_force: ComplexArray = (gamma[:, :n] - gamma[:, n:]) @ into.T
    shares, compliance = data.information() * known[:, None], data.line_compliance()
    k = fit.k_joint(fit.freq_hz)
    sources: dict[str, _ModelLines | _JointLines] = {}
    for d, dof in enumerate(fit.dofs):
        places = _parameters(fit, dof)
        if places is not None:
            own = shares[:, [places[0], places[0] if places[1] is None else places[1]]].T
            difference = k[:, d, d] - k[:, d, d] ** 2 * compliance[:, d]
            sources[dof] = _JointLines(difference, np.asarray(own), np.abs(per_force[:, d]))
    return _Motion(per_force, out @ gamma @ into.T, data.response_names, sources)


def with_amplitude(fit: Fit, lines: dict[str, DofLines], orders: dict[str, int]) -> Fit | None:
    """Return the fit with K* as polynomials of ln a of these orders, or None if the fit has no models."""
    if not isinstance(fit.data, ModelData) or fit.laws is None:
        return None
    omega, laws = 2 * np.pi * fit.freq_hz, dict(fit.laws.laws)
    order_of_lines = np.argsort(omega)
    for dof, order in orders.items():
        own, law = lines[dof], fit.laws.laws[dof, dof]
        weight = abs(own.weights[0])
        share = weight.sum(axis=1, keepdims=True)
        by_force = np.where(share > 0, weight / np.where(share > 0, share, 1), 1 / weight.shape[1])
        x = np.sum(by_force * np.log(own.amplitude), axis=1) - math.log(own.centre)
        known = (*law.terms, *[0.0] * (2 * order)) if isinstance(law, AmplitudeSpring) else (0.0,) * (2 * order)
        spring = law.spring if isinstance(law, AmplitudeSpring) else law
        assert isinstance(spring, SpringLaw)
        laws[dof, dof] = AmplitudeSpring(spring, omega[order_of_lines], x[order_of_lines], known[: 2 * order])
    joint = LawJoint(laws, fit.laws.rigid, fit.laws.mass, fit.laws.dofs)
    refitted: Fit = fit.data.joint_motion.refitted(joint)
    return refitted
