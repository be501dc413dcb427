"""Structures that are free, hinged, held and softly held; their receptances in 80 bits; and a run over many of them.

`python tests/python/support/supported_structures.py [BEAMS]` looks for free brick beams that are not recognised at
0 Hz, with every kernel of OpenBLAS.
"""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import linalg, sparse
from scipy.sparse import csgraph

import jointfrf as jf
from jointfrf.workbench.solids.solid import solid_model

EPS = np.finfo(float).eps
KERNELS = ("Prescott", "Nehalem", "Sandybridge", "Haswell", "SkylakeX", "Zen")
ALUMINIUM = jf.Material(70e9, 0.33, 2700.0)
STEEL = jf.Material(2.1e11, 0.3, 7850.0)
RUBBER = jf.Material(3e6, 0.49, 1100.0)


@dataclass(frozen=True)
class Structure:
    """K and M, the DOFs that are asked for, those that ground springs may hold, and the number of rigid-body modes."""

    stiffness: sparse.csr_array
    mass: sparse.csr_array
    at: list[int]
    translations: list[int]
    n_rigid: int

    def on_springs(self, share: float) -> Structure:
        """The same with equal springs from every translation to the ground; all of them a share of the largest K_ii."""
        springs = np.zeros(self.stiffness.shape[0])
        springs[self.translations] = share * self.stiffness.diagonal()[self.translations].max() / len(self.translations)
        k = sparse.csr_array(self.stiffness + sparse.diags_array(springs))
        return Structure(k, self.mass, self.at, self.translations, 0)

    def without(self, dofs: list[int], n_rigid: int) -> Structure:
        """The same with some DOFs held."""
        left = [i for i in range(self.stiffness.shape[0]) if i not in dofs]
        at, translations = ([left.index(i) for i in some if i not in dofs] for some in (self.at, self.translations))
        return Structure(self.stiffness[left][:, left], self.mass[left][:, left], at, translations, n_rigid)

    @cached_property
    def squared(self) -> np.ndarray:
        """w^2 of all modes; those as a rigid body have none."""
        found = linalg.eigh(self.stiffness.toarray(), self.mass.toarray(), eigvals_only=True)
        found[: self.n_rigid] = 0
        return found

    @cached_property
    def rounding(self) -> float:
        """What a relative change of all entries of K by the machine's precision may change w^2 of any mode by."""
        k, m = self.stiffness.toarray(), self.mass.toarray()
        return EPS * float(linalg.eigh(abs(k), m, eigvals_only=True, subset_by_index=[len(k) - 1, len(k) - 1])[0])

    def first_elastic(self) -> float:
        """Hz."""
        return float(np.sqrt(self.squared[self.n_rigid])) / (2 * np.pi)

    def relative_rounding(self, freq_hz: float) -> float:
        """The same of a receptance: condition times the machine's precision."""
        nearest = self.lowest if freq_hz == 0 else abs(self.squared - (2 * np.pi * freq_hz) ** 2).min()
        return float(self.rounding / nearest)

    @cached_property
    def lowest(self) -> float:
        """Smallest w^2 of a structure that is held, by inverse iteration in 80 bits."""
        x = np.random.default_rng(3).standard_normal((1, self.stiffness.shape[0]))
        for _ in range(3):
            before = x @ self.mass
            x = solved_in_long_double(self, [0.0], 0.0, before, np.eye(x.size))[0].real.T
            squared = ((before @ x.T) / (x @ self.mass @ x.T)).item()
            x = x / np.sqrt(x @ self.mass @ x.T)
        return squared


def of_model(model: jf.Model, at: list[int], n_rigid: int) -> Structure:
    names = [dof.split(":")[1] for dof in model.dofs]
    translations = [i for i, name in enumerate(names) if name in ("x", "y", "z")]
    return Structure(sparse.csr_array(model.stiffness), sparse.csr_array(model.mass), at, translations, n_rigid)


def brick_beam(size, divisions, material=ALUMINIUM, formulation="incompatible", sections=True, ends=("free", "free")):
    """Beam of bricks, seen at both ends: at plane sections, or at corners."""
    named = {"a": 0.0, "b": size[0]} if sections else {}
    if ends[0] == "clamped":
        named.pop("a", None)
    beam = jf.brick_beam(*size, material, ends=ends, sections=named, divisions=divisions)
    n = len(beam.dofs)
    at = [i for i in range(n - 6 * len(named), n)][::5] if named else [0, n // 2, n - 1]
    if not named and ends == ("free", "free"):
        beam = solid_model(beam.mesh, material, formulation=formulation)
    return of_model(beam, at, 6 if ends == ("free", "free") else 0)


def plane_beam(n, element="euler-bernoulli", ends=("free", "free")):
    beam = jf.beam(0.3, n, youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, element=element, ends=ends)
    last = len(beam.dofs) - 1
    return of_model(beam, [0, last // 2, last], 2 if ends == ("free", "free") else 0)


def chain(n, ground="none"):
    rng = np.random.default_rng(n)
    links = n - 1 + (ground == "start")
    model = jf.chain(rng.uniform(0.5, 2, n), rng.uniform(1e4, 1e6, links), ground=ground)
    return of_model(model, [0, n - 1], int(ground == "none"))


def hinged_beams():
    """Two plane beams that share the displacement of a node, not its rotation: three rigid-body modes."""
    one = plane_beam(20)
    n = one.stiffness.shape[0]
    join = sparse.lil_array((2 * n, 2 * n - 1))
    for i in range(2 * n):
        join[i, i if i < n else (n - 2 if i == n else i - 1)] = 1
    k, m = (sparse.csr_array(join.T @ sparse.block_diag([a, a]) @ join) for a in (one.stiffness, one.mass))
    return Structure(k, m, [0, n - 1, 2 * n - 2], [i for i in range(2 * n - 1) if i % 2 == (i >= n)], 3)


def three_bodies():
    """Three free bodies of different materials: 18 rigid-body modes."""
    parts = [brick_beam((0.1, 0.02, 0.01), (1, 1, d), m) for d, m in ((6, ALUMINIUM), (7, STEEL), (8, RUBBER))]
    k, m = (sparse.csr_array(sparse.block_diag([getattr(p, a) for p in parts])) for a in ("stiffness", "mass"))
    n = k.shape[0]
    return Structure(k, m, [0, n // 2, n - 1], [], 18)


FREE = {
    "flat beam": lambda: brick_beam((0.3, 0.025, 0.006), (2, 2, 9)),
    "one brick wide": lambda: brick_beam((0.3, 0.025, 0.006), (1, 1, 24)),
    "stocky, steel, reduced": lambda: brick_beam((0.08, 0.03, 0.02), (3, 2, 6), STEEL, "reduced", sections=False),
    "full": lambda: brick_beam((0.2, 0.02, 0.02), (2, 2, 10), ALUMINIUM, "full", sections=False),
    "rubber": lambda: brick_beam((0.2, 0.02, 0.01), (2, 1, 9), RUBBER, sections=False),
    "rubber between plates": lambda: brick_beam((0.05, 0.03, 0.01), (3, 3, 2), RUBBER),
    "five elements": lambda: plane_beam(5),
    "150 elements": lambda: plane_beam(150),
    "shear-flexible": lambda: plane_beam(40, "shear-flexible"),
    "two masses": lambda: chain(2),
    "chain": lambda: chain(60),
    "pinned beam": lambda: plane_beam(30).without([0], 1),
    "two beams and a hinge": hinged_beams,
    "three bodies": three_bodies,
}
HELD = {
    "clamped flat beam": lambda: brick_beam((0.3, 0.025, 0.006), (2, 2, 12), ends=("clamped", "free")),
    "clamped rubber": lambda: brick_beam(
        (0.2, 0.02, 0.01), (2, 2, 9), RUBBER, sections=False, ends=("clamped", "free")
    ),
    "clamped beam of 150 elements": lambda: plane_beam(150, ends=("clamped", "free")),
    "held at both ends": lambda: plane_beam(30).without([0, 60], 0),
    "held chain": lambda: chain(60, "start"),
}


def solved_in_long_double(structure, freq_hz, loss_factor, forces, seen):
    """Elimination in band storage without exchanging rows, shape (n_freq, n_out, n_in); rows of forces and seen."""
    pattern = sparse.csr_array(abs(structure.stiffness) + abs(structure.mass))
    order = csgraph.reverse_cuthill_mckee(sparse.csr_matrix(pattern), symmetric_mode=True)
    k, m = (a[order][:, order].toarray().astype(np.longdouble) for a in (structure.stiffness, structure.mass))
    entries = pattern[order][:, order].tocoo()
    band = int(abs(entries.col.astype(int) - entries.row).max())
    result = []
    for freq in freq_hz:
        z = k * np.clongdouble(1 + 1j * loss_factor) - np.longdouble(2 * np.pi * freq) ** 2 * m
        x = np.asarray(forces).T[order].astype(np.clongdouble)
        for p in range(len(k)):
            below = slice(p + 1, p + 1 + band)
            factor = z[below, p] / z[p, p]
            z[below, below] -= factor[:, None] * z[p, below]
            x[below] -= factor[:, None] * x[p]
        for p in range(len(k) - 1, -1, -1):
            x[p] = (x[p] - z[p, p + 1 : p + 1 + band] @ x[p + 1 : p + 1 + band]) / z[p, p]
        result.append(np.asarray(seen).astype(np.longdouble) @ x[np.argsort(order)])
    return np.array(result).astype(complex)


def exact(structure, freq_hz, loss_factor):
    unit = np.eye(structure.stiffness.shape[0])[structure.at]
    return solved_in_long_double(structure, freq_hz, loss_factor, unit, unit)


def calculated(structure, freq_hz, loss_factor, method):
    """Return receptances, or None where a line is singular, and whether a warning announces one as ill-conditioned."""
    given = dict(loss_factor=loss_factor, outputs=structure.at, inputs=structure.at, method=method)
    with warnings.catch_warnings(record=True) as reported:
        warnings.simplefilter("always")
        try:
            h = jf.receptance(freq_hz, structure.stiffness, structure.mass, **given)
        except jf.SingularLineError:
            return None, True
    return h, any(issubclass(t.category, jf.IllConditionedWarning) for t in reported)


def relative_error(h, reference):
    return float(abs(h - reference).max() / abs(reference).max())


def not_recognised(n_beams: int, seed: int = 0) -> list[str]:
    """Free brick beams of random sizes, meshes, elements and materials of which a method gives numbers at 0 Hz."""
    rng = np.random.default_rng(seed)
    found = []
    for i in range(n_beams):
        size = (rng.uniform(0.1, 0.6), rng.uniform(0.01, 0.05), rng.uniform(0.004, 0.02))
        divisions = tuple(int(d) for d in (rng.integers(1, 4), rng.integers(1, 4), rng.integers(6, 20)))
        material, preset = (ALUMINIUM, STEEL, RUBBER)[i % 3], ("accurate", "seed")[i // 3 % 2]
        beam = jf.brick_beam(*size, material, sections={"a": 0.0, "b": size[0]}, divisions=divisions, preset=preset)
        free = of_model(beam, list(beam.index("a:y", "b:y")), 6)
        lines = np.linspace(0, 400, 41) if material is not RUBBER else np.linspace(0, 4, 41)
        for method in ("krylov", "modal", "sparse"):
            if not calculated(free, lines if method == "krylov" else lines[:2], 0.01, method)[1]:
                found.append(f"beam {i}, {method}")
    return found


def main() -> None:
    n_beams = int(sys.argv[1]) if len(sys.argv) > 1 else 80
    if "OPENBLAS_CORETYPE" in os.environ:
        print(*not_recognised(n_beams), sep="\n", end="")
        return
    for kernel in KERNELS:
        environment = os.environ | {"OPENBLAS_CORETYPE": kernel, "OPENBLAS_NUM_THREADS": "1"}
        done = subprocess.run(
            [sys.executable, __file__, str(n_beams)], env=environment, capture_output=True, text=True, check=True
        )
        silent = done.stdout.split("\n") if done.stdout.strip() else []
        print(f"{kernel:12s} {len(silent)} of {n_beams} free beams not recognised at 0 Hz", *silent, sep="\n    ")


if __name__ == "__main__":
    main()
