"""Structures that several tests share."""

from __future__ import annotations

import ctypes
import os
import pickle
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from filelock import FileLock

import jointfrf as jf
from installed_library import installed_library  # noqa: F401
from jointfrf.workbench.cases import run
from jointfrf.workbench.cases.known_joint.compute import KnownJointResult
from thinned_cases import DrawSome, compute_thinned


def pytest_configure(config: pytest.Config) -> None:
    """One thread in each of several processes: together they would start more threads than there are cores."""
    if getattr(config.option, "tx", None):
        os.environ.setdefault("OMP_NUM_THREADS", "1")


@cache
def openmp_library() -> ctypes.CDLL | None:
    """The OpenMP library of this process; None without one, or without /proc."""
    maps = Path("/proc/self/maps")
    lines = maps.read_text().splitlines() if maps.exists() else []
    paths = [line.split()[-1] for line in lines if "libgomp" in line]
    return ctypes.CDLL(paths[0]) if paths else None


@pytest.fixture
def threads() -> Iterator[Callable[[int], None] | None]:
    """One thread, and how to set another number; the number before comes back. None where OpenMP is not found."""
    library = openmp_library()
    if library is None:
        yield None
        return
    before = library.omp_get_max_threads()
    library.omp_set_num_threads(1)
    yield library.omp_set_num_threads
    library.omp_set_num_threads(before)


@dataclass(frozen=True)
class Assembly:
    """Two substructures, a joint, and their FRFs; DOFs of A: joint, then r; of B: joint, then s."""

    freq: np.ndarray
    a: jf.Model
    b: jf.Model
    joint: jf.Joint
    first: jf.Joint
    dofs_a: list[int]
    dofs_b: list[int]

    def __post_init__(self):
        object.__setattr__(self, "h_a", self.a.receptance(self.freq, self.dofs_a))
        object.__setattr__(self, "h_b", self.b.receptance(self.freq, self.dofs_b))

    @property
    def n(self) -> int:
        return len(self.joint.dofs)

    @property
    def at(self) -> list[int]:
        """Joint DOFs in either substructure."""
        return list(range(self.n))

    @property
    def inner(self) -> list[int]:
        return list(range(self.n, 2 * self.n))

    def coupled(self, joint: jf.Joint) -> np.ndarray:
        return jf.couple(self.h_a, self.h_b, joint.dynamic_stiffness(self.freq), self.at, self.at)

    def gamma(self, joint: jf.Joint) -> np.ndarray:
        dofs = self.at + [2 * self.n + i for i in self.at]
        return self.coupled(joint)[:, dofs][:, :, dofs]


@pytest.fixture(scope="session")
def chains() -> Assembly:
    """Table 3-1."""
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start")
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end")
    joint, first = jf.Joint([2000.0], [3.0], ["x"]), jf.Joint([1000.0], [1.5], ["x"])
    return Assembly(np.linspace(0.5, 10, 191), a, b, joint, first, [1, 0], [0, 1])


@pytest.fixture(scope="session")
def beams() -> Assembly:
    """Table 3-3 with a coarser mesh, Eqns (3.13), (3.14)."""
    section = dict(youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, loss_factor=0.01)
    a = jf.beam(0.3, 12, ends=("clamped", "free"), **section)
    b = jf.beam(0.225, 9, **section)
    joint = jf.Joint([6e5, 5e3], [20, 1.5], ["y", "theta"])
    first = jf.Joint([1e5, 1e3], [5, 0.5], ["y", "theta"])
    dofs_a = a.index("13:y", "13:theta", "7:y", "7:theta")
    dofs_b = b.index("1:y", "1:theta", "10:y", "10:theta")
    return Assembly(np.arange(15, 800.5, 5.0), a, b, joint, first, dofs_a, dofs_b)


@pytest.fixture(params=["chains", "beams"])
def assembly(request) -> Assembly:
    return request.getfixturevalue(request.param)


@pytest.fixture(scope="session")
def once(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, Callable[[], Any]], Any]:
    """Compute what several tests look at once a run: the process that asks first computes, the others read it."""
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent
    kept = {}

    def get(key: str, compute: Callable[[], Any]) -> Any:
        if key not in kept:
            path = folder / f"{key}.pickle"
            with FileLock(path.with_suffix(".lock")):
                if not path.exists():
                    path.write_bytes(pickle.dumps(compute()))
            kept[key] = pickle.loads(path.read_bytes())
        return kept[key]

    return get


@pytest.fixture(scope="session")
def thinned(once) -> Callable[[str], KnownJointResult]:
    """From the name of a case of a known joint to its results in a short form."""
    return lambda name: once(name, partial(compute_thinned, name))


@pytest.fixture
def without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the pictures of a case empty: to draw them takes most of the time of a short one."""
    monkeypatch.setattr(run, "draw", DrawSome())


@pytest.fixture
def random_lines():
    """Well-conditioned, non-symmetric complex matrices."""

    def make(n_freq: int, rows: int, columns: int | None = None, seed: int = 0) -> np.ndarray:
        rng = np.random.default_rng(seed)
        shape = (n_freq, rows, rows if columns is None else columns)
        matrices = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
        return matrices + (3 * np.eye(rows) if columns is None else 0)

    return make
