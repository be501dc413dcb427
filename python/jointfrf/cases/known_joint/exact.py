"""FRFs of a case without noise: of the substructures, and of the assembly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from jointfrf.cases.definitions import Observed
from jointfrf.cases.known_joint.read import KnownJointCase
from jointfrf.kernel.arguments import ComplexArray, FloatArray
from jointfrf.substructuring.coupling import couple

__all__ = ["Exact", "exact_frfs"]

_POINTS = "jrks"


@dataclass(frozen=True)
class Exact:
    """Noise-free FRFs of a case; DOFs in the order j, r of A, then k, s of B, n of each.

    Attributes
    ----------
    freq_hz : ndarray, shape (n_freq,)
        Hz.
    dofs : tuple of str
        Names of the n joint DOFs.
    h_a, h_b : ndarray, shape (n_freq, 2 n, 2 n)
        Receptances of the substructures, m/N.
    h_initial, h_c : ndarray, shape (n_freq, 4 n, 4 n)
        Receptances of the assembly with the first estimate and with the actual joint.
    k_initial : ndarray, shape (n_freq, n, n)
        First estimate of K*, N/m.
    """

    freq_hz: FloatArray
    dofs: tuple[str, ...]
    h_a: ComplexArray
    h_b: ComplexArray
    h_initial: ComplexArray
    h_c: ComplexArray
    k_initial: ComplexArray

    @property
    def n(self) -> int:
        """Number of joint DOFs."""
        return len(self.dofs)

    def where(self, point: str) -> slice:
        """Return the DOFs of a point of the assembly: "j", "r", "k" or "s"."""
        start = self._start(point)
        return slice(start, start + self.n)

    def _start(self, point: str) -> int:
        return _POINTS.index(point) * self.n

    def at(self, observed: Observed) -> int:
        """Return the DOF of an observed FRF in the assembly."""
        return self._start(observed.point) + observed.dof

    def interface(self, h: ComplexArray) -> ComplexArray:
        """Return the FRFs at the joint, DOFs j then k, shape (n_freq, 2 n, 2 n)."""
        at = np.r_[self.where("j"), self.where("k")]
        return np.ascontiguousarray(h[:, at[:, None], at])


def exact_frfs(case: KnownJointCase) -> Exact:
    """Receptances of the substructures (2.28)-(2.29) and of the assembly (2.26)."""
    freq, n = case.freq_hz, len(case.joint.dofs)
    h_a = case.a.receptance(freq, case.points["j"] + case.points["r"])
    h_b = case.b.receptance(freq, case.points["k"] + case.points["s"])
    first = list(range(n))
    initial = case.initial.dynamic_stiffness(freq)
    h_initial = couple(h_a, h_b, initial, first, first, freq_hz=freq)
    h_c = couple(h_a, h_b, case.joint.dynamic_stiffness(freq), first, first, freq_hz=freq)
    return Exact(freq, case.joint.dofs, h_a, h_b, h_initial, h_c, initial)
