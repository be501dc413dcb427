"""The same small case from FORTRAN 77, modern Fortran, C and Python, on the installed library: the same text."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

import case
import jointfrf as jf
from installed_library import InstalledLibrary, run

pytestmark = pytest.mark.builds

TESTS = Path(__file__).resolve().parents[2]
SOURCES = {"FORTRAN 77": "f77/case.f", "Fortran": "fortran/case.f90", "C": "c/case.c"}
#: The fit of a joint, alike.
FITS = {"FORTRAN 77": "f77/identify.f", "Fortran": "fortran/identify.f90", "C": "c/identify.c"}
ENTRY = re.compile(r"(\w+)\((\d),(\d)\) *(\d+) +(\S+) +(\S+)")


@pytest.fixture(scope="module")
def programs(installed_library: InstalledLibrary, tmp_path_factory) -> dict[str, list[str | Path]]:
    folder = tmp_path_factory.mktemp("case")
    commands: dict[str, list[str | Path]] = {"Python": [sys.executable, TESTS / "python" / "support" / "case.py"]}
    for language, source in SOURCES.items():
        commands[language] = [installed_library.compile(TESTS / source, folder / Path(source).name.replace(".", "_"))]
    return commands


@pytest.fixture(scope="module")
def fits(installed_library: InstalledLibrary, tmp_path_factory) -> dict[str, str]:
    """What the programs that fit a joint print."""
    folder = tmp_path_factory.mktemp("identify")
    texts = {"Python": printed([sys.executable, TESTS / "python" / "support" / "identify_joint.py"], "auto")}
    for language, source in FITS.items():
        program = installed_library.compile(TESTS / source, folder / Path(source).name.replace(".", "_"))
        texts[language] = printed([program], "auto", 2)
    return texts


def printed(command: list[str | Path], engine: str, threads: int = 1) -> str:
    return run(command, env={"JOINTFRF_ENGINE": engine, "OMP_NUM_THREADS": str(threads)})


@pytest.fixture(scope="module")
def values(programs) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """What the FORTRAN 77 program prints: matrices by name, and the means as they follow each other."""
    text = printed(programs["FORTRAN 77"], "auto").splitlines()
    shapes = {"gamma": 4, "k_ismm": 2, "k_short": 2}
    matrices = {name: np.full((case.N_FREQ, n, n), np.nan, complex) for name, n in shapes.items()}
    for line in text[:-8]:
        match = ENTRY.fullmatch(line)
        assert match, line
        at = int(match[4]) - 1, int(match[2]) - 1, int(match[3]) - 1
        matrices[match[1]][at] = complex(float(match[5]), float(match[6]))
    return matrices, np.array([float(line.split()[1]) for line in text[-8:]])


@pytest.mark.parametrize("engine", ["lapack", "auto"])
def test_four_languages_print_the_same_text(programs, engine):
    texts = {language: printed(command, engine) for language, command in programs.items()}
    assert len(texts["Python"].splitlines()) == case.N_FREQ * (16 + 4 + 4) + 8
    for language in SOURCES:
        assert texts[language] == texts["Python"], language


def test_text_does_not_depend_on_threads(programs):
    assert printed(programs["C"], "auto", 1) == printed(programs["Fortran"], "auto", 2)


def test_assembly_is_that_of_one_model(values):
    """Joint and beams in one pair of matrices, by jf.beam."""
    section = dict(youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, loss_factor=0.01)
    a = jf.beam(0.3, 2, ends=("clamped", "free"), **section)
    b = jf.beam(0.225, 1, **section)
    joint = jf.Joint([6e6, 5e3], [50, 15], ["y", "theta"])
    whole = jf.assemble(a, b, joint, case.DOFS_A, case.DOFS_B).receptance(case.FREQ_HZ, case.DOFS_C)
    np.testing.assert_allclose(values[0]["gamma"], whole, rtol=1e-9, atol=1e-12 * abs(whole).max())


def test_joint_is_found(values):
    matrices, means = values
    k_joint = jf.Joint([6e6, 5e3], [50, 15]).dynamic_stiffness(case.FREQ_HZ)
    for name in ("k_ismm", "k_short"):
        assert abs(matrices[name] - k_joint).max() < 1e-9 * abs(k_joint).max()
    np.testing.assert_allclose(means, 2 * [6e6, 5e3, 50, 15], rtol=1e-9)


def test_means_are_those_of_the_package(values):
    matrices, means = values
    bands = {"Fy": (200.0, 900.0), "Mtheta": (15.0, 200.0)}
    for name, own in zip(("k_ismm", "k_short"), means.reshape(2, 4), strict=True):
        mean = jf.band_mean(case.FREQ_HZ, matrices[name], bands, list(bands))
        np.testing.assert_allclose(own, [*mean.stiffness, *mean.damping], rtol=1e-13)


def fitted(text: str) -> dict[str, tuple[float, float]]:
    """Values and standard errors by name."""
    return {name: (float(value), float(error)) for name, value, error in map(str.split, text.splitlines())}


def test_fits_of_four_languages_agree(fits):
    for language, text in fits.items():
        assert text.split()[::3] == fits["Python"].split()[::3], language
        for name, own in fitted(text).items():
            np.testing.assert_allclose(own, fitted(fits["Python"])[name], rtol=1e-4, err_msg=f"{language} {name}")


def test_fitted_joint_is_the_exact_one_within_its_errors(fits):
    exact = {"k_Fy": 6e5, "k_Mtheta": 5e3, "c_Fy": 20.0, "c_Mtheta": 1.5}
    for name, (value, error) in fitted(fits["C"]).items():
        assert abs(value - exact[name]) < 3 * error < 0.05 * exact[name]


def test_shown_fit_is_what_the_programs_print(fits):
    page = (TESTS.parent / "docs" / "embedding.md").read_text()
    (shown,) = re.findall(r"```text\n(k_Fy.*?)```", page, re.DOTALL)
    for name, own in fitted(shown).items():
        np.testing.assert_allclose(own, fitted(fits["FORTRAN 77"])[name], rtol=1e-4)
    (call,) = re.findall(r"```fortran\n( *CALL JF_FIT_JOINT.*?)```", page, re.DOTALL)
    assert call in (TESTS / FITS["FORTRAN 77"]).read_text()
