"""An analyser and a structure for studies: two Timoshenko beams with a joint, impacts in the time domain, H1, H2, Hv.

Nothing here uses the package: elements, complex modes, records and estimators are written anew, so that the truth of a
trial does not come from the program under test.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy import linalg, signal

#: Aluminium, and a rectangular section, m: 0.63 kg in all.
E, NU, RHO, WIDTH, HEIGHT = 70e9, 0.33, 2700.0, 0.03, 0.015
#: Lengths of both beams, m, and elements of each.
LENGTHS, ELEMENTS = (0.30, 0.22), (30, 22)
#: Fixed-interface modes of each: up to 30 kHz.
MODES = 10
#: Damping ratio of each mode of a beam by itself, and damping in proportion to mass, 1/s: records of 2 s decay.
LOSS, AIR = 0.005, 8.0
K_TRUE, C_TRUE = (4e6, 8e3), (80.0, 2.0)
#: Samples per second, and how many times faster the structure is computed.
RATE, OVER = 4096.0, 16
#: Half the length of the filter before sampling, in samples: that of scipy.signal.decimate.
LENGTH = 10


def timoshenko(
    length: float, area: float, inertia: float, material: tuple[float, float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and consistent mass of a Timoshenko element of a material (E, nu, rho): y and slope at both ends."""
    e, nu, rho = material
    phi = 12 * e * inertia / (e / (2 * (1 + nu)) * area * 5 / 6 * length**2)
    k = np.array([
        [12, 6 * length, -12, 6 * length],
        [6 * length, (4 + phi) * length**2, -6 * length, (2 - phi) * length**2],
        [-12, -6 * length, 12, -6 * length],
        [6 * length, (2 - phi) * length**2, -6 * length, (4 + phi) * length**2],
    ]) * e * inertia / (length**3 * (1 + phi))  # fmt: skip
    m = np.array([
        [156, 22 * length, 54, -13 * length],
        [22 * length, 4 * length**2, 13 * length, -3 * length**2],
        [54, 13 * length, 156, -22 * length],
        [-13 * length, -3 * length**2, -22 * length, 4 * length**2],
    ]) * rho * area * length / 420  # fmt: skip
    m[np.ix_([1, 3], [1, 3])] += rho * inertia * length / 6 * np.array([[2, 1], [1, 2]])
    return k, m


def element(length: float, stiffer: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and mass of an element of the beams, whose bending stiffness may be larger."""
    k, m = timoshenko(length, WIDTH * HEIGHT, WIDTH * HEIGHT**3 / 12, (E, NU, RHO))
    return k * stiffer, m


def _beam(side: int) -> tuple[np.ndarray, np.ndarray]:
    """Return stiffness and mass of a beam whose last 20 mm at the joint are a block."""
    count = ELEMENTS[side]
    n = 2 * (count + 1)
    k, m = np.zeros((2, n, n))
    for i in range(count):
        near = count - i if side == 0 else i + 1
        own = element(LENGTHS[side] / count, 1e3 if near <= 2 else 1.0)
        at = slice(2 * i, 2 * i + 4)
        k[at, at] += own[0]
        m[at, at] += own[1]
    return k, m


@dataclass(frozen=True)
class Structure:
    """Complex modes of two beams with a joint between the end of one and the start of the other.

    Attributes
    ----------
    poles : ndarray, shape (n,)
        rad/s, on or above the real axis.
    shapes : ndarray, shape (n_dof, n)
        Scaled so that h is the sum of shapes shapes / (i w - pole) and its conjugate.
    """

    poles: np.ndarray
    shapes: np.ndarray

    def receptance(self, freq_hz: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Return FRFs between combinations of DOFs, shape (n_freq, n_rows, n_columns), m/N."""
        out, into = rows @ self.shapes, columns @ self.shapes
        s = 2j * np.pi * freq_hz[:, None]
        first = np.einsum("rk,lk,ck->lrc", out, 1 / (s - self.poles), into)
        return first + np.einsum("rk,lk,ck->lrc", out.conj(), 1 / (s - self.poles.conj()), into.conj())


def _part(side: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return stiffness, damping and mass of a part in y and theta of the joint and fixed-interface modes, and these."""
    k, m = _beam(side)
    n = len(k)
    joint = np.array([n - 2, n - 1]) if side == 0 else np.array([0, 1])
    inner = np.setdiff1d(np.arange(2 if side == 0 else 0, n), joint)
    squared, modes = linalg.eigh(k[np.ix_(inner, inner)], m[np.ix_(inner, inner)], subset_by_index=(0, MODES - 1))
    basis = np.zeros((n, 2 + MODES))
    basis[joint, [0, 1]] = 1
    basis[inner, :2] = -np.linalg.solve(k[np.ix_(inner, inner)], k[np.ix_(inner, joint)])
    basis[inner, 2:] = modes
    k, m = basis.T @ k @ basis, basis.T @ m @ basis
    squared, shapes = linalg.eigh(k, m)
    of_mass = m @ shapes
    c = (of_mass * 2 * LOSS * np.sqrt(np.maximum(squared, 0))) @ of_mass.T + AIR * m
    return k, c, m, basis


@lru_cache(maxsize=64)
def structure(masses: tuple[tuple[int, float], ...] = (), k: tuple[float, float] = K_TRUE) -> Structure:
    """Return the assembly, clamped at the far end of the first beam, with point masses (DOF, kg)."""
    parts = [_part(side) for side in (0, 1)]
    stiffness, damping, mass, basis = (linalg.block_diag(*one) for one in zip(*parts, strict=True))
    for i, (spring, dashpot) in enumerate(zip(k, C_TRUE, strict=True)):
        pair = np.zeros(len(mass))
        pair[i], pair[2 + MODES + i] = 1, -1
        stiffness += spring * np.outer(pair, pair)
        damping += dashpot * np.outer(pair, pair)
    for dof, kg in masses:
        mass += kg * np.outer(basis[dof], basis[dof])
    # Unit modal masses: the eigenvalue problem of the poles is then well conditioned.
    _, shapes = linalg.eigh(stiffness, mass)
    stiffness, damping = (shapes.T @ one @ shapes for one in (stiffness, damping))
    one, nothing = np.eye(len(mass)), np.zeros_like(mass)
    value, vector = linalg.eig(np.block([[nothing, one], [-stiffness, -damping]]))
    value.imag[abs(value.imag) < 1e-9 * abs(value)] = 0
    kept = value.imag >= 0
    value, vector = value[kept], vector[: len(mass), kept]
    # x = vector; scaled so that x^T (2 pole + damping) x = 1. Of a pair the first stands for both.
    scale = np.sqrt(np.einsum("dk,dk->k", vector, (2 * vector * value + damping @ vector)))
    scale = scale * np.where(value.imag == 0, np.sqrt(2), 1)
    return Structure(value, basis @ shapes @ (vector / scale))


def node(side: int, distance: float) -> int:
    """Return the translation nearest to a distance from the joint, m, on side 0 or 1."""
    step = LENGTHS[side] / ELEMENTS[side]
    away = round(distance / step)
    last = 2 * ELEMENTS[0]
    return last - 2 * away if side == 0 else last + 2 + 2 * away


@dataclass(frozen=True)
class Analyser:
    """How FRFs are measured.

    Attributes
    ----------
    seconds, averages : float, int
        Length of a record, impacts per FRF.
    window : {"none", "hann", "exponential"}
        The last one has `decay`, 1/s, and a force window.
    estimator : {"H1", "H2", "Hv"}
    floor : float
        Noise of the accelerometers, m/s^2, white, rms up to half the sampling rate.
    force_noise : float
        Noise of the hammer, N, likewise.
    bits : int
        Of the converter, over twice the largest value; 0 for none.
    jitter : float
        Standard deviation of the start of force records against motion, s.
    before : float
        Time before the impact, s.
    """

    seconds: float = 2.0
    averages: int = 3
    window: str = "none"
    decay: float = 0.0
    estimator: str = "H1"
    floor: float = 0.02
    force_noise: float = 0.01
    bits: int = 16
    jitter: float = 0.0
    before: float = 0.01


def _records(
    own: Structure, rows: np.ndarray, into: np.ndarray, analyser: Analyser, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return force (n_samples,) and accelerations (n_samples, n_rows) of one impact, filtered and sampled."""
    n = round(analyser.seconds * RATE)
    width, start = rng.uniform(0.9e-3, 1.4e-3), analyser.before + rng.uniform(0, 1e-3)
    peak = rng.uniform(60, 140)
    # Up to this sample the filter touches the pulse: samples of the structure are computed there. Then it decays.
    first = min(int(np.ceil((start + width) * RATE)) + LENGTH + 1, n)
    x = np.arange((first + LENGTH) * OVER) / (RATE * OVER) - start
    inside, after = (x >= 0) & (x < width), x >= width
    rate = 2 * np.pi / width
    force = np.where(inside, peak / 2 * (1 - np.cos(rate * x)), 0)
    # v is the rate of q, the integral of exp(pole (t - s)) force(s) over the pulse so far. The residues of all modes
    # add up to zero, so that accelerations are the sum of residue pole v.
    poles, pulse = own.poles, x[inside, None]
    square = poles**2 + rate**2
    of_cosine = rate**2 * np.cos(rate * pulse) + poles * rate * np.sin(rate * pulse) + poles**2 * np.exp(poles * pulse)
    end = peak / 2 * (np.exp(poles * width) - 1) * rate**2 / square
    v = np.zeros((x.size, poles.size), complex)
    v[inside] = peak / 2 * (np.exp(poles * pulse) - of_cosine / square)
    v[after] = end * np.exp(poles * (x[after, None] - width))
    residues = 2 * poles * (rows @ own.shapes) * (into @ own.shapes)
    force, near = (signal.decimate(one, OVER, ftype="fir", axis=0)[:first] for one in (force, (v @ residues.T).real))
    # The filter of `decimate` about the first sample of the decay, and about each one that follows.
    taps = np.arange(first - LENGTH, first + LENGTH + 0.5 / OVER, 1 / OVER) / RATE - start - width
    filtered = signal.firwin(taps.size, 1 / OVER, window="hamming") @ np.exp(poles * taps[:, None])
    step = int(np.sqrt(n)) + 1
    fine, coarse = (np.exp(poles * own[:, None] / RATE) for own in (np.arange(step), np.arange(0, n - first, step)))
    decay = ((end * filtered * coarse)[:, None] * fine).reshape(-1, poles.size)[: n - first]
    return np.append(force, np.zeros(n - first)), np.concatenate([near, (decay @ residues.T).real])


def measured(
    own: Structure,
    rows: np.ndarray,
    columns: np.ndarray,
    analyser: Analyser,
    rng: np.random.Generator,
    wrong: dict[int, tuple[int, int]] | None = None,
    each_row: tuple[Structure, ...] = (),
) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies and receptances by the analyser, shape (n_freq, n_rows, n_columns).

    `wrong` maps a column to (record, column struck instead); with `each_row` every row is a test of its own structure.
    """
    found = []
    for c, into in enumerate(columns):
        if each_row:
            parts = [
                _column(one, rows[r : r + 1], [into] * analyser.averages, analyser, rng)
                for r, one in enumerate(each_row)
            ]
            found.append(np.concatenate([h for _, h in parts], axis=1))
            freq = parts[0][0]
            continue
        struck = [into] * analyser.averages
        if wrong and c in wrong:
            number, other = wrong[c]
            struck[number] = columns[other]
        freq, h = _column(own, rows, struck, analyser, rng)
        found.append(h)
    return freq, np.stack(found, axis=2)


def _column(
    own: Structure, rows: np.ndarray, struck: list[np.ndarray], analyser: Analyser, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    ff, xf, xx = 0.0, 0.0, 0.0
    for into in struck:
        force, motion = _records(own, rows, into, analyser, rng)
        force = force + analyser.force_noise * rng.standard_normal(force.shape)
        motion = motion + analyser.floor * rng.standard_normal(motion.shape)
        if analyser.bits:
            for one in (force, motion):
                step = 4 * np.abs(one).max() / 2**analyser.bits
                one[:] = np.round(one / step) * step
        t = np.arange(len(force)) / RATE
        weight, of_force = np.ones_like(t), np.ones_like(t)
        if analyser.window == "hann":
            weight = of_force = np.hanning(len(t))
        elif analyser.window == "exponential":
            weight = np.exp(-analyser.decay * t)
            of_force = weight * (t < 0.03)
        f = np.fft.rfft(force * of_force)
        x = np.fft.rfft(motion * weight[:, None], axis=0)
        freq = np.fft.rfftfreq(len(t), 1 / RATE)
        if analyser.jitter:
            f = f * np.exp(-2j * np.pi * freq * analyser.jitter * rng.standard_normal())
        ff, xf, xx = ff + abs(f) ** 2, xf + x * f.conj()[:, None], xx + abs(x) ** 2
    h1, h2 = xf / ff[:, None], xx / xf.conj()
    h = {"H1": h1, "H2": h2, "Hv": np.sqrt(abs(h1) * abs(h2)) * np.exp(1j * np.angle(h1))}[analyser.estimator]
    with np.errstate(divide="ignore", invalid="ignore"):
        return freq, h / (2j * np.pi * freq[:, None] + analyser.decay) ** 2


def quieter(analyser: Analyser) -> Analyser:
    """Return an analyser without noise of its own, for tests of this module."""
    return replace(analyser, floor=0.0, force_noise=0.0, bits=0)
