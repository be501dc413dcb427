"""A number of a model that is known with an uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.kernel.arguments import as_limits, as_number

__all__ = ["Unknown"]


@dataclass(frozen=True)
class Unknown:
    """A number of a model that is not known exactly: it is fitted with the joint.

    Parameters
    ----------
    value : float
        What is believed before the measurement, in the unit of the number.
    std : float, optional
        Standard deviation of that belief, a normal prior; none by default: only the FRFs tell.
    lower, upper : float
        Limits.

    Raises
    ------
    ValueError
        A standard deviation that is not positive, a value outside its limits, NaN or Inf.

    Examples
    --------
    Young's modulus of aluminium, known to 2 %:

    >>> import jointfrf as jf
    >>> jf.Unknown(67e9, 0.02 * 67e9).std
    1340000000.0
    """

    value: float
    std: float | None = None
    lower: float = -np.inf
    upper: float = np.inf

    def __post_init__(self) -> None:
        object.__setattr__(self, "value", as_number("value", self.value))
        if self.std is not None:
            object.__setattr__(self, "std", as_number("std", self.std))
            if self.std <= 0:
                raise ValueError(f"std must be positive, not {self.std:g}")
        as_limits("bounds", self.lower, self.upper)
        if not self.lower <= self.value <= self.upper:
            raise ValueError(f"value must lie in {self.lower:g} to {self.upper:g}, not {self.value:g}")
