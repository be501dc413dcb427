"""A FORTRAN 77 program with its own frequency loop and arena, on the installed library."""

from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from installed_library import InstalledLibrary, run

pytestmark = pytest.mark.builds

SOURCE = Path(__file__).resolve().parents[2] / "f77" / "loop.f"


def test_one_line_at_a_time(installed_library: InstalledLibrary, tmp_path):
    program = installed_library.compile(SOURCE, tmp_path / "loop")
    rows = np.array([line.split() for line in run([program]).splitlines()], float)
    freq_hz, found = rows[:, 0], rows[:, 3:]
    np.testing.assert_allclose(freq_hz, 0.2 * np.arange(1, 51))
    np.testing.assert_allclose(found, np.tile([500.0, 3.0], (50, 1)), rtol=1e-9)

    # both chains and the joint in one dynamic stiffness matrix
    k = 1000.0 * (1 + 0.01j) * np.array([[2, -1, 0, 0], [-1, 1, 0, 0], [0, 0, 2, -1], [0, 0, -1, 1]])
    between = np.array([0.0, 1.0, 0.0, -1.0])
    omega = 2 * np.pi * freq_hz[:, None, None]
    whole = k + (500 + 3j * omega) * np.outer(between, between) - omega**2 * 2.0 * np.eye(4)
    expected = np.linalg.inv(whole)[:, 1, 1]
    np.testing.assert_allclose(rows[:, 1] + 1j * rows[:, 2], expected, rtol=1e-12)


def test_the_loop_and_a_sweep_have_the_same_bits(installed_library: InstalledLibrary, tmp_path):
    """In the layout of Python, 'T', by the reference engine. The layout 'N' makes other calls of LAPACK."""
    transposed = tmp_path / "transposed.f"
    transposed.write_text(SOURCE.read_text().replace("_WORK('N'", "_WORK('T'"))
    texts = {}
    for name, source in (("N", SOURCE), ("T", transposed)):
        program = installed_library.compile(source, tmp_path / name)
        texts[name] = run([program], env={"JOINTFRF_ENGINE": "lapack"})
        assert texts[name] == run([program], env={"JOINTFRF_ENGINE": "plain"})
    found = {name: np.array([line.split() for line in text.splitlines()], float) for name, text in texts.items()}
    freq_hz = found["T"][:, 0]
    k, m = np.array([[2000.0, -1000.0], [-1000.0, 1000.0]]), 2.0 * np.eye(2)
    joint = jf.Joint([500.0], [3.0])
    with jf.use_engine("lapack"):
        h = jf.Model(k, m, ("1:x", "2:x"), loss_factor=0.01).receptance(freq_hz, method="dense")
        gamma = jf.couple(h, h, joint.dynamic_stiffness(freq_hz), [1], [1])[:, 1, 1]
    np.testing.assert_array_equal(gamma, found["T"][:, 1] + 1j * found["T"][:, 2])
    np.testing.assert_allclose(gamma, found["N"][:, 1] + 1j * found["N"][:, 2], rtol=1e-13)
