"""Readings of the words "5 % noise": the ways in which a number drawn at random pollutes an FRF."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from jointfrf.frf.noise import NoiseKind, realisations
from jointfrf.kernel.arguments import ComplexArray, FloatArray

Parts = Literal["real", "complex", "Re and Im apart"]
Law = Literal["normal", "uniform"]
LevelMeaning = Literal["deviation", "bound", "deviation of modulus"]
Sharing = Literal["FRF", "2 x 2", "block", "line"]
Reference = Literal["value", "line", "own spectrum", "spectrum"]

REFERENCES: tuple[Reference, ...] = ("value", "line", "own spectrum", "spectrum")
_SHARINGS: tuple[tuple[Sharing, bool], ...] = (
    ("FRF", False), ("FRF", True), ("2 x 2", False), ("2 x 2", True), ("block", False), ("block", True),
    ("line", False),
)  # fmt: skip
#: Distributions: parts, law, what the level means, and the deviation of a part at level 1.
_DISTRIBUTIONS: dict[tuple[Parts, Law, LevelMeaning], float] = {
    ("real", "normal", "deviation"): 1.0,
    ("real", "uniform", "deviation"): 1.0,
    ("real", "uniform", "bound"): 3**-0.5,
    ("complex", "normal", "deviation"): 1.0,
    ("complex", "normal", "deviation of modulus"): 2**-0.5,
    ("complex", "uniform", "deviation"): 1.0,
    ("complex", "uniform", "bound"): 3**-0.5,
    ("Re and Im apart", "normal", "deviation"): 1.0,
    ("Re and Im apart", "uniform", "deviation"): 1.0,
    ("Re and Im apart", "uniform", "bound"): 3**-0.5,
}
#: What is added to the seed for the imaginary part of uniform numbers.
_IMAGINARY = 2**63


@dataclass(frozen=True)
class Draw:
    """Numbers of mean 0, deviation 1 of each part: complex or real, normal or uniform, and which FRFs share one.

    `block` is the size of the square blocks whose entries share a number.
    """

    is_complex: bool
    law: Law
    block: int
    reciprocal: bool


@dataclass(frozen=True)
class NoiseScale:
    """What the numbers of a draw are multiplied with: a level, and the FRF or a largest modulus.

    Attributes
    ----------
    level : float
        Deviation of a part, 0.05 for 5 %.
    apart : bool
        Whether Re and Im of the FRF are multiplied each with a part of the number, instead of the FRF with the number.
    reference : str
    """

    level: float
    apart: bool
    reference: Reference

    def pollute(self, h: ComplexArray, moduli: FloatArray | None, numbers: ComplexArray) -> ComplexArray:
        """Pollute FRFs.

        Parameters
        ----------
        h : ndarray, shape (n_freq, n_out, n_in)
        moduli : ndarray that broadcasts with h, or None
            As `reference_moduli` returns them.
        numbers : ndarray, shape (count, n_freq, n_out, n_in)
            As `noise_numbers` returns them.

        Returns
        -------
        ndarray, shape (count, n_freq, n_out, n_in)
        """
        if self.apart:
            added = np.empty_like(numbers)
            added.real, added.imag = h.real * numbers.real, h.imag * numbers.imag
        else:
            added = (h if moduli is None else moduli) * numbers
        added *= self.level
        added += h
        return added


@dataclass(frozen=True)
class Reading:
    """One way to read "5 % noise".

    Attributes
    ----------
    parts : {"real", "complex", "Re and Im apart"}
        Whether the noise number is real, complex, or a real one each for Re and Im of the FRF.
    law : {"normal", "uniform"}
    level_means : {"deviation", "bound", "deviation of modulus"}
        What the printed level is: the standard deviation of a part, the bound of a part, or the standard deviation
        sqrt(E|e|^2) of a complex number.
    sharing : {"FRF", "2 x 2", "block", "line"}
        What shares a number on a line: nothing; the FRFs of two neighbouring DOFs at a pair of points; all FRFs of a
        pair of points; all FRFs.
    reciprocal : bool
        Whether H_pq and H_qp have the same number.
    reference : {"value", "line", "own spectrum", "spectrum"}
        What the level refers to: the FRF itself on that line; the largest modulus of all FRFs on that line; the largest
        of the FRF over all lines; the largest of all FRFs over all lines.
    """

    parts: Parts
    law: Law
    level_means: LevelMeaning
    sharing: Sharing
    reciprocal: bool
    reference: Reference

    def __str__(self) -> str:
        """Say the reading in a few words."""
        shared = "each FRF" if self.sharing == "FRF" else f"common to a {self.sharing}"
        return ", ".join((f"{self.parts} {self.law}", self.level_means, shared + " reciprocal" * self.reciprocal,
                          f"of {self.reference}"))  # fmt: skip

    def draw(self, n: int, size: int, mirrored: bool) -> Draw:
        """Return the numbers that the reading takes for matrices of `size` with n joint DOFs.

        Parameters
        ----------
        n : int
            Joint DOFs.
        size : int
            Rows of the matrix: 2 n at the joint, n between two internal points.
        mirrored : bool
            Whether the matrix holds H_pq together with H_qp: not where responses and forces are at different points.

        Returns
        -------
        Draw
            The same one for readings that do not differ in such a matrix.
        """
        block = {"FRF": 1, "2 x 2": 2 if n % 2 == 0 else 1, "block": n, "line": size}[self.sharing]
        reciprocal = self.reciprocal and mirrored and block < size
        return Draw(self.parts != "real", self.law, block, reciprocal)

    def scale(self, level: float) -> NoiseScale:
        """Return what the numbers are multiplied with at a printed level."""
        deviation = _DISTRIBUTIONS[self.parts, self.law, self.level_means]
        return NoiseScale(level * deviation, self.parts == "Re and Im apart", self.reference)


def every_reading() -> Iterator[Reading]:
    """All readings; Re and Im apart make sense only relative to themselves."""
    for distribution, sharing, reference in product(_DISTRIBUTIONS, _SHARINGS, REFERENCES):
        if distribution[0] != "Re and Im apart" or reference == "value":
            yield Reading(*distribution, *sharing, reference)


def noise_numbers(draw: Draw, shape: tuple[int, int, int], seed: int, first: int, count: int) -> ComplexArray:
    """Draw the numbers of realisations `first` to `first + count - 1`.

    Parameters
    ----------
    draw : Draw
    shape : (n_freq, n_out, n_in)
    seed, first, count : int
        As in `jointfrf.realisations`.

    Returns
    -------
    ndarray, shape (count, n_freq, n_out, n_in)
        Mean 0, deviation 1 of each part.
    """

    def drawn(kind: NoiseKind, own_seed: int) -> ComplexArray:
        numbers = realisations(
            np.ones(shape, complex), 1.0, kind, own_seed, reciprocal=draw.reciprocal, block=draw.block, first=first,
            count=count,
        )  # fmt: skip
        numbers -= 1
        return numbers

    if draw.law == "normal":
        return drawn("complex-per-part" if draw.is_complex else "real-normal", seed)
    numbers = drawn("real-uniform-std", seed)
    if draw.is_complex:
        numbers.imag = drawn("real-uniform-std", seed ^ _IMAGINARY).real
    return numbers


def reference_moduli(h: ComplexArray, reference: Reference) -> FloatArray | None:
    """Return the moduli that a level refers to, in a shape that broadcasts with h; None for h itself."""
    axes: dict[Reference, tuple[int, ...]] = {"line": (1, 2), "own spectrum": (0,), "spectrum": (0, 1, 2)}
    if reference == "value":
        return None
    largest: FloatArray = np.abs(h).max(axis=axes[reference], keepdims=True)
    return largest
