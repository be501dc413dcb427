"""Pollution of FRFs: every kind of noise of the thesis, and a physical default."""

from __future__ import annotations

import operator
from typing import Final, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.kernel.arguments import ComplexArray, as_integer, as_lines, as_number, check_choice, one_line
from jointfrf.kernel.call import call

__all__ = [
    "MOST_REALISATIONS",
    "NOISE_KINDS",
    "NoiseKind",
    "NoiseReference",
    "noise_arguments",
    "pollute",
    "realisations",
]

NoiseKind = Literal["complex", "complex-per-part", "real-normal", "real-uniform", "real-uniform-std"]
NoiseReference = Literal["entry", "line", "spectrum"]
#: Number of realisations, which have 31 bits.
MOST_REALISATIONS: Final = 2**31 - 1


class NoiseNumbers(NamedTuple):
    """Numbers of a kind of noise.

    Attributes
    ----------
    letter : str
        Letter of the kind in the kernel.
    power : float
        Mean square modulus at level 1.
    is_circular : bool
        Whether all phases are equally likely.
    """

    letter: str
    power: float
    is_circular: bool


#: The kinds of noise. For a new kind, add its word above, its line here, and a letter in `noise.f90` of the kernel.
NOISE_KINDS: Final[dict[NoiseKind, NoiseNumbers]] = {
    "complex": NoiseNumbers("C", 1.0, True),
    "complex-per-part": NoiseNumbers("P", 2.0, True),
    "real-normal": NoiseNumbers("N", 1.0, False),
    "real-uniform": NoiseNumbers("U", 1 / 3, False),
    "real-uniform-std": NoiseNumbers("S", 1.0, False),
}


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
    rng: int | np.random.Generator | None = None,
) -> ComplexArray:
    """Return FRFs with added measurement noise.

    Parameters
    ----------
    h : array_like, shape (n_freq, n_out, n_in)
        Exact FRFs.
    level : float
        Noise level, 0.05 for 5 %.
    kind : str
        Distribution of the noise number of an entry and a line:

        - "complex": circular complex normal, E|e|^2 = level^2, as in averaged measurements; the default.
        - "complex-per-part": circular complex normal, standard deviation `level` on each of Re and Im.
        - "real-normal": real normal, standard deviation `level`.
        - "real-uniform": real, uniform between -level and level.
        - "real-uniform-std": real, uniform with standard deviation `level`.

    seed : int
        Seed, 0 to 2**64 - 1; the same seed gives the same noise on any machine and any number of threads.
    relative_to : {"entry", "line", "spectrum"}
        Reference of the level, default "entry":

        - "entry": the entry itself, H (1 + e), as in section 3.2; a real kind then leaves all phases exact
        - "line": the largest modulus at that line, H + e max|H|, as in section 3.1
        - "spectrum": the largest modulus over the whole spectrum
    reciprocal : bool
        Whether entry (p, q) and entry (q, p) get the same noise, default False.
    block : int, optional
        Size of square blocks whose entries share one noise number, for noise common to the FRFs of a pair of points.
    realisation : int
        Number of an independent repetition with this seed, default 0.
    rng : int or numpy.random.Generator, optional
        Random generator in place of `seed`, as in other scientific packages (SPEC 7): a seed, or a generator that draws
        one, so that the noise of each call is different. None is no random seed: `seed` then determines the noise.

    Returns
    -------
    ndarray, shape (n_freq, n_out, n_in)
        Polluted FRFs.

    Raises
    ------
    ValueError
        An unknown word, a negative level, blocks that do not fit, reciprocal noise on a matrix that is not square, a
        seed or a realisation out of range; both `seed` and `rng`.
    TypeError
        `rng` is not a whole number or a generator.

    See Also
    --------
    realisations : several repetitions at once.
    estimate_noise : noise of measured FRFs.

    Notes
    -----
    Numbers come from a counter-based generator (Threefry-2x64-20). The counter is made of entry, line and realisation,
    the key of the seed, so that the number of an entry depends on nothing else. Normal numbers follow Box and Muller.

    References
    ----------
    J. K. Salmon, M. A. Moraes, R. O. Dror, D. E. Shaw, Parallel random numbers: as easy as 1, 2, 3. SC11, 2011.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> h = np.ones((10000, 2, 2), complex)
    >>> polluted = jf.pollute(h, 0.05, seed=1)
    >>> round(float(np.sqrt((abs(polluted - h) ** 2).mean())), 3)
    0.05
    >>> rng = np.random.default_rng(1)
    >>> bool((jf.pollute(h, 0.05, rng=rng) == jf.pollute(h, 0.05, rng=rng)).any())
    False
    """
    return np.asarray(
        realisations(
            h,
            level,
            kind,
            seed,
            relative_to=relative_to,
            reciprocal=reciprocal,
            block=block,
            first=realisation,
            count=1,
            rng=rng,
        )[0]
    )


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
    rng: int | np.random.Generator | None = None,
) -> ComplexArray:
    """Return several repetitions of `pollute`, numbers `first` to `first + count - 1`.

    Parameters
    ----------
    h, level, kind, seed, relative_to, reciprocal, block, rng
        Exact FRFs and options of the noise; see `pollute`.
    first, count : int
        Number of the first repetition, and number of repetitions.

    Returns
    -------
    ndarray, shape (count, n_freq, n_out, n_in)
        Polluted FRFs.

    Raises
    ------
    ValueError, TypeError
        An error of `pollute`.

    See Also
    --------
    pollute : one repetition.
    identify_realisations : fit of each repetition.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> h = np.ones((5, 2, 2), complex)
    >>> some = jf.realisations(h, 0.05, seed=3, first=6, count=2)
    >>> bool((some[1] == jf.pollute(h, 0.05, seed=3, realisation=7)).all())
    True
    """
    lines = as_lines("h", h)
    noise = noise_arguments(level, kind, seed, rng, relative_to, reciprocal, block, first, count, lines.shape[1:])
    try:
        polluted = np.empty((count, *lines.shape), np.complex128)
    except MemoryError as error:
        size = count * lines.nbytes / 2**30
        raise MemoryError(
            f"count: {count} realisations of h take {size:.3g} GiB; draw them in parts with first and count"
        ) from error
    if polluted.size:
        n_freq, n_out, n_in = lines.shape
        call("pollute", (*noise, n_out, n_in, n_freq, first, count, lines, polluted))
    return polluted


def noise_arguments(
    level: float,
    kind: NoiseKind,
    seed: int,
    rng: int | np.random.Generator | None,
    relative_to: NoiseReference,
    reciprocal: bool,
    block: int | None,
    first: int,
    count: int,
    shape: tuple[int, ...],
) -> tuple[str, str, int, int, float, NDArray[np.int32]]:
    """Check the arguments of noise for matrices of `shape`, and return them as arguments of the kernel."""
    check_choice("kind", kind, tuple(NOISE_KINDS))
    check_choice("relative_to", relative_to, get_args(NoiseReference))
    number = as_number("level", level)
    if number < 0:
        raise ValueError(f"level must be 0 or positive, not {level}")
    n_out, n_in = shape
    if reciprocal and n_out != n_in:
        raise ValueError(f"reciprocal noise needs square matrices, not {n_out} x {n_in}")
    size = 1 if block is None else as_integer("block", block)
    if size < 1 or n_out % size or n_in % size:
        raise ValueError(f"block {block} does not divide matrices of {n_out} x {n_in}")
    if as_integer("first", first) < 0 or as_integer("count", count) < 0 or first + count > MOST_REALISATIONS:
        raise ValueError(f"realisations are counted from 0 to {MOST_REALISATIONS - 1}: not {count} from {first} on")
    whole = _whole_seed(seed, rng)
    words = np.array([whole & 0xFFFFFFFF, whole >> 32], np.uint32).view(np.int32)
    return NOISE_KINDS[kind].letter, relative_to[0].upper(), int(reciprocal), size, number, words


def _whole_seed(seed: int, rng: int | np.random.Generator | None) -> int:
    """Return the seed, or the seed that `rng` is or draws."""
    number, name = as_integer("seed", seed), "seed"
    if rng is not None:
        if number != 0:
            raise ValueError("seed and rng are both given; give one")
        if isinstance(rng, np.random.Generator):
            return int(rng.integers(2**64, dtype=np.uint64))
        try:
            number, name = operator.index(rng), "rng"
        except TypeError:
            raise TypeError(f"rng must be a whole number or a numpy.random.Generator, not {one_line(rng)}") from None
    if not 0 <= number < 2**64:
        raise ValueError(f"{name} must lie between 0 and 2**64 - 1, not {number}")
    return number
