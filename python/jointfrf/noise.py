"""Pollution of FRFs: every kind of noise the source uses, and a physical default."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf._sweep import ComplexArray, FloatArray, as_lines, as_number, check_choice

__all__ = ["NoiseKind", "NoiseReference", "pollute", "realisations"]

NoiseKind = Literal["complex", "complex-per-part", "real-normal", "real-uniform", "real-uniform-std"]
NoiseReference = Literal["entry", "line", "spectrum"]


def pollute(
    h: ArrayLike,
    level: float,
    kind: NoiseKind = "complex",
    seed: int = 0,
    *,
    relative_to: NoiseReference = "entry",
    reciprocal: bool = False,
    block: int | None = None,
    realisation: int = 0,
) -> ComplexArray:
    """Add measurement noise to FRFs.

    Parameters
    ----------
    h : array_like, shape (n_freq, n_out, n_in)
        Exact FRFs.
    level : float
        Noise level, 0.05 for 5 %.
    kind : str
        Distribution of the noise number of an entry and a line:

        - "complex": circular complex normal, E|e|^2 = level^2. What averaged measurements show; the default.
        - "complex-per-part": circular complex normal, standard deviation `level` on each of Re and Im.
        - "real-normal": real normal, standard deviation `level`.
        - "real-uniform": real, uniform between -level and level.
        - "real-uniform-std": real, uniform with standard deviation `level`.

    seed : int
        Seed; the same seed gives the same noise on any machine and any number of threads.
    relative_to : {"entry", "line", "spectrum"}
        What the level refers to: the entry itself, H (1 + e) (a real kind then leaves all phases exact: the wording of
        section 3.2); the largest modulus at that line, H + e max|H| (the wording of section 3.1); or the largest over
        the whole spectrum.
    reciprocal : bool
        Whether entry (p, q) and entry (q, p) get the same noise.
    block : int, optional
        Size of square blocks whose entries share one noise number, for noise common to the FRFs of a pair of points.
    realisation : int
        Number of an independent repetition with this seed.

    Returns
    -------
    ndarray, shape (n_freq, n_out, n_in)

    Raises
    ------
    ValueError
        An unknown word, a negative level, blocks that do not fit, reciprocal noise on a matrix that is not square.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> h = np.ones((10000, 2, 2), complex)
    >>> polluted = jf.pollute(h, 0.05, seed=1)
    >>> round(float(np.sqrt((abs(polluted - h) ** 2).mean())), 3)
    0.05
    """
    polluted: ComplexArray = realisations(
        h, level, kind, seed, relative_to=relative_to, reciprocal=reciprocal, block=block, first=realisation, count=1
    )[0]
    return polluted


def realisations(
    h: ArrayLike,
    level: float,
    kind: NoiseKind = "complex",
    seed: int = 0,
    *,
    relative_to: NoiseReference = "entry",
    reciprocal: bool = False,
    block: int | None = None,
    first: int = 0,
    count: int = 1,
) -> ComplexArray:
    """Several repetitions of `pollute`, numbers `first` to `first + count - 1`.

    Parameters
    ----------
    h, level, kind, seed, relative_to, reciprocal, block
        As in `pollute`.
    first, count : int
        Number of the first repetition, and how many.

    Returns
    -------
    ndarray, shape (count, n_freq, n_out, n_in)

    Raises
    ------
    ValueError
        As in `pollute`.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> h = np.ones((5, 2, 2), complex)
    >>> some = jf.realisations(h, 0.05, seed=3, first=6, count=2)
    >>> bool((some[1] == jf.pollute(h, 0.05, seed=3, realisation=7)).all())
    True
    """
    lines = as_lines("h", h)
    n_freq, n_out, n_in = lines.shape
    check_choice("kind", kind, get_args(NoiseKind))
    check_choice("relative_to", relative_to, get_args(NoiseReference))
    if as_number("level", level) < 0:
        raise ValueError(f"level must be 0 or positive, not {level}")
    if reciprocal and n_out != n_in:
        raise ValueError(f"reciprocal noise needs square matrices, not {n_out} x {n_in}")
    size = 1 if block is None else block
    if size < 1 or n_out % size or n_in % size:
        raise ValueError(f"block {block} does not divide matrices of {n_out} x {n_in}")

    scale: FloatArray | ComplexArray = lines
    if relative_to != "entry":
        scale = abs(lines).max(axis=(1, 2) if relative_to == "line" else None, keepdims=True)
    polluted = np.empty((count, *lines.shape), np.complex128)
    for i in range(count):
        # A counter-based generator: the repetition is part of the counter, so no repetition depends on another.
        generator = np.random.Generator(np.random.Philox(key=seed, counter=[0, 0, 0, first + i]))
        noise = _noise(generator, kind, (n_freq, n_out // size, n_in // size))
        if reciprocal:
            upper = np.triu(np.ones(noise.shape[1:], bool))
            noise = np.where(upper, noise, noise.swapaxes(1, 2))
        if size > 1:
            noise = noise.repeat(size, axis=1).repeat(size, axis=2)
        polluted[i] = lines + scale * (level * noise)
    return polluted


def _noise(generator: np.random.Generator, kind: NoiseKind, shape: tuple[int, ...]) -> NDArray[np.complexfloating]:
    """Return noise numbers for level 1."""
    if kind in ("complex", "complex-per-part"):
        numbers = generator.standard_normal((*shape, 2)).view(np.complex128)[..., 0]
        return numbers / np.sqrt(2) if kind == "complex" else numbers
    if kind == "real-normal":
        return generator.standard_normal(shape).astype(np.complex128)
    width = np.sqrt(3) if kind == "real-uniform-std" else 1.0
    return generator.uniform(-width, width, shape).astype(np.complex128)
