"""The same small case from FORTRAN 77, C and Python through the same symbols."""

import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf

FREQ = np.array([1.0, 2.0, 4.0, 6.0, 8.0])
NAME = re.compile(r"(\w+)\((\d+),(\d+)\)")


def from_python() -> dict[str, np.ndarray]:
    a = jf.chain([5, 3], [2500, 3500], [3, 4], ground="start")
    b = jf.chain([4, 2], [2000, 2500], [2, 1], ground="end")
    h_a, h_b = a.receptance(FREQ), b.receptance(FREQ)
    k, k0 = (jf.Joint([s], [c]).dynamic_stiffness(FREQ) for s, c in ((2000.0, 3.0), (1000.0, 1.5)))
    h_c, h_c0 = (jf.couple(h_a, h_b, joint, [1], [0]) for joint in (k, k0))
    at = np.ix_(range(FREQ.size), [1, 2], [1, 2])
    return {
        "h_a": h_a,
        "h_b": h_b,
        "h_c": h_c,
        "h_c0": h_c0,
        "k_ismm": jf.ismm(h_c0[at], h_c[at], k0),
        "k_short": jf.inverse_substructuring(h_c[at]),
        "k_rr": jf.decouple("rr", h_a, h_b, h_c[:, :1, :1], [1], [0], dofs_r=[0]),
        "c_joint": jf.joint_compliance(h_c[at]),
    }


def from_program(path: Path) -> dict[tuple[str, int, int, int], complex]:
    printed = subprocess.run([path], capture_output=True, text=True, check=True, timeout=60).stdout
    values = {}
    for line in printed.split("\n"):
        if line.strip():
            name, frequency, real, imaginary = line.split()
            match = NAME.fullmatch(name)
            assert match, line
            values[match[1].lower(), int(frequency), int(match[2]), int(match[3])] = complex(
                float(real), float(imaginary)
            )
    return values


def programs() -> Path:
    folder = Path(
        os.environ.get("JOINTFRF_TEST_PROGRAMS", Path(__file__).resolve().parents[2] / "build" / "tests" / "tests")
    )
    if not (folder / "case_c").exists():
        pytest.skip("the test programs are not built: ./tests/run builds them, or set JOINTFRF_TEST_PROGRAMS")
    return folder


@pytest.mark.parametrize("program", ["case_f77", "case_c"])
def test_python_gives_what_the_program_gives(program):
    values = from_program(programs() / program)
    expected = from_python()
    assert {key[0] for key in values} == set(expected)
    assert len(values) == sum(array.size for array in expected.values())
    for (name, frequency, row, column), value in values.items():
        exact = expected[name][frequency - 1, row - 1, column - 1]
        assert abs(value - exact) <= 1e-12 * abs(expected[name][frequency - 1]).max(), (name, frequency, row, column)


def test_fortran_77_and_c_agree_to_the_last_bit():
    folder = programs()
    assert from_program(folder / "case_f77") == from_program(folder / "case_c")
