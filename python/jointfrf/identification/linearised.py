"""A likelihood about its minimum: normal equations, and the contributions of lines, channels and errors of FRFs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from jointfrf.frf.bands import in_pieces, line_slices
from jointfrf.identification.minimise import inverse_information
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["LineParts", "Linearised"]


class LineParts(NamedTuple):
    """Parts of the normal equations: of lines, of channels, or of groups of lines.

    Attributes
    ----------
    gradient : ndarray, shape (n_parts, p)
        Gradient of each part by the coordinates.
    information : ndarray, shape (n_parts, p, p)
        Information of each part on the coordinates.
    """

    gradient: FloatArray
    information: FloatArray


class Linearised(ABC):
    """A likelihood about its minimum, in p coordinates of the parameters.

    Real residuals are in units of their standard deviation. Unknowns that belong to one line have been eliminated.

    Attributes
    ----------
    n_freq : int
        Number of lines.
    information : ndarray, shape (p, p)
        Fisher information of the coordinates, priors included.
    determined : ndarray of bool, shape (p,)
        Coordinates that the FRFs determine; along any other coordinate only rounding scatters.
    slope : ndarray, shape (p, p)
        Derivatives of the parameters by the coordinates; a row of the unit matrix if a derivative is infinite.
    priors : LineParts
        One part for each prior; none by default.
    """

    n_freq: int
    information: FloatArray
    determined: NDArray[np.bool_]
    slope: FloatArray
    priors: LineParts

    @abstractmethod
    def lines(self, which: slice) -> LineParts:
        """Return the parts of some lines."""

    def channels(self) -> Iterable[LineParts]:
        """Return the parts of all responses, then the parts of all forces; nothing if channels are not separate."""
        return ()

    @abstractmethod
    def errors(self, masks: NDArray[np.bool_], lines: slice) -> Iterator[tuple[ComplexArray, FloatArray]]:
        """Yield the effect of a relative error of 1 of the FRFs in each mask, shape (n, n_responses, n_forces).

        Yields
        ------
        gradient : ndarray, shape (n_lines, p)
            Its real part is the change of the gradient; minus its imaginary part that by an error of 1j.
        squares : ndarray, shape (n_lines,)
            Squares of the complex residual that the error leaves.
        """

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of the coordinates for independent noise, shape (p, p)."""
        return inverse_information(self.information, open_ends=True)

    @cached_property
    def share(self) -> FloatArray:
        """Share of each line in the information on each coordinate, shape (n_freq, p)."""
        (own,) = in_pieces(self.n_freq, lambda which: [np.einsum("lpp->lp", self.lines(which).information)])
        return own / np.maximum(np.diagonal(self.information), np.finfo(float).tiny)

    def grouped(self, member: FloatArray) -> LineParts:
        """Return sums over groups of lines, then the priors; `member`, shape (n_groups, n_freq), weights the lines."""
        gradient, information = np.zeros((len(member), self.slope.shape[0])), np.zeros((len(member), *self.slope.shape))
        for which in line_slices(self.n_freq):
            part = self.lines(which)
            gradient += member[:, which] @ part.gradient
            information += np.tensordot(member[:, which], part.information, 1)
        return LineParts(
            np.concatenate([gradient, self.priors.gradient]), np.concatenate([information, self.priors.information])
        )
