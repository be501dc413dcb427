"""A case of structures of one's own: by matrices and by FRFs in files, against the same case by its beams."""

import json
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from scipy import sparse

import jointfrf as jf
from jointfrf.workbench.cases.catalogue import read_case
from jointfrf.workbench.cases.known_joint import KIND
from jointfrf.workbench.cases.known_joint.exact import exact_frfs
from jointfrf.workbench.cases.known_joint.expected import identified_rows
from jointfrf.workbench.cases.known_joint.figures import build_figures
from jointfrf.workbench.cases.known_joint.tables import build_numbers, build_tables
from jointfrf.workbench.cases.run import compute_case
from own_case import BEAMS, RECEPTANCES, replace_tables, write_by_matrices, write_by_receptances, write_case

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def by_matrices(tmp_path):
    return write_by_matrices(tmp_path / "matrices")


@pytest.fixture
def by_receptances(tmp_path):
    return write_by_receptances(tmp_path / "receptances")


def same_frfs(found, wanted, signs=1.0):
    scale = abs(wanted).max(axis=(1, 2), keepdims=True)
    assert (abs(found - wanted * signs) / scale).max() < 1e-12


def test_matrices_give_the_case_of_the_beams(by_matrices):
    case = read_case(by_matrices)
    for mine, theirs in ((case.a.model, BEAMS.a.model), (case.b.model, BEAMS.b.model)):
        assert mine.dofs == theirs.dofs
        assert (sparse.csr_array(mine.stiffness) != sparse.csr_array(theirs.stiffness)).nnz == 0
    same_frfs(exact_frfs(case).h_c, exact_frfs(BEAMS).h_c)
    result, wanted = (compute_case(KIND, replace(one, noises=one.noises[:1]), 20) for one in (case, BEAMS))
    for joint in ("actual", "initial"):
        np.testing.assert_allclose(result.modes[joint].freq_hz, wanted.modes[joint].freq_hz, rtol=1e-9)
    for mine, theirs in zip(result.identified, wanted.identified, strict=True):
        np.testing.assert_allclose(mine.theta, theirs.theta, rtol=1e-6)


def test_receptances_give_the_case_of_the_beams(by_receptances):
    case = read_case(by_receptances)
    assert case.models is None
    turned = np.ones(8)
    turned[2] = -1  # r is named against y
    same_frfs(exact_frfs(case).h_c, exact_frfs(BEAMS).h_c, turned[:, None] * turned)
    result, wanted = (compute_case(KIND, replace(one, noises=one.noises[:1]), 20) for one in (case, BEAMS))
    assert result.modes == {}
    for mine, theirs in zip(result.identified, wanted.identified, strict=True):
        np.testing.assert_allclose(mine.theta, theirs.theta, rtol=1e-6)
    for key, sensitivity in wanted.sensitive["actual"].sensitivities.items():
        size = abs(sensitivity.change).max()
        assert (
            abs(abs(result.sensitive["actual"].sensitivities[key].change) - abs(sensitivity.change)).max() < 1e-9 * size
        )


def test_receptances_leave_out_modes_and_nothing_else(by_receptances):
    without, with_modes = (compute_case(KIND, one, 3) for one in (read_case(by_receptances), BEAMS))
    tables, all_tables = ([table.key for table in build_tables(one)] for one in (without, with_modes))
    of_source = {"table-3-2", "section-3-2-figures-3-11-and-3-12"}  # expected.toml has been left behind
    assert set(all_tables) - set(tables) == {"natural-frequencies"} | of_source
    figures, all_figures = ({figure.key for figure in build_figures(one)} for one in (without, with_modes))
    assert all_figures - figures == {"modes"}
    assert build_numbers(without)["natural_frequencies_hz"] == {}


@pytest.mark.long
def test_the_documented_case_runs(tmp_path, monkeypatch):
    text = (ROOT / "docs/cases.md").read_text(encoding="utf-8")
    (copy,), (python,), (tables,) = (
        re.findall(rf"```{language}\n(.*?)```", text.partition("## Structures of your own")[2], re.DOTALL)
        for language in ("sh", "python", "toml")
    )
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    monkeypatch.chdir(tmp_path)
    subprocess.run(["sh", "-ec", copy], check=True)
    exec(python, {})
    path = tmp_path / "my-case" / "case.toml"
    path.write_text(replace_tables(path.read_text(), tables))
    command = [sys.executable, "-m", "jointfrf", *shlex.split("run my-case --realisations 5 --jobs 1")]
    subprocess.run(command, check=True, capture_output=True)
    found = json.loads((tmp_path / "results/my-case/results.json").read_text())["identified"]
    wanted = identified_rows(compute_case(KIND, BEAMS, 5))
    beside = {(row.noise, row.method, row.parameter.name): row.median for row in wanted}
    assert {(row["noise"], row["method"], row["parameter"]) for row in found} == set(beside)
    for row in found:
        assert row["median"] == pytest.approx(beside[row["noise"], row["method"], row["parameter"]], rel=1e-6)


def test_lines_of_a_file_may_be_limited(by_receptances):
    folder = write_case(by_receptances, RECEPTANCES + '[frequency]\nfrom_file = "b.uff"\nfirst = 15.0\nlast = 900.0\n')
    np.testing.assert_allclose(read_case(folder).freq_hz, BEAMS.freq_hz, rtol=1e-12)


def test_receptances_may_stand_in_any_format(by_receptances):
    """What `jointfrf convert` writes gives the same case: NPZ and CSV instead of Universal Files."""
    path = by_receptances / "case.toml"
    points = [["3:y", "3:rz"], ["1:y", "1:rz"]]
    before = read_case(by_receptances)
    text = path.read_text()
    for old, new, write in (("a.uff", "a.npz", jf.io.write_npz), ("b.uff", "b.csv", jf.io.write_csv)):
        write(by_receptances / new, jf.io.read_frfs(by_receptances / old))
        (by_receptances / old).unlink()
        text = text.replace(f'"{old}"', f'"{new}"')
    path.write_text(text)
    after = read_case(by_receptances)
    for one, other, at in zip((before.a, before.b), (after.a, after.b), points, strict=True):
        same_frfs(one.receptance(BEAMS.freq_hz, at), other.receptance(BEAMS.freq_hz, at))


@pytest.mark.filterwarnings("ignore::jointfrf.FileContentWarning")
def test_a_quantity_may_be_said(by_receptances):
    """The file states accelerance: another quantity must be forced, and its unit stated."""
    path = by_receptances / "case.toml"
    text, power = path.read_text(), {"accelerance": 2, "mobility": 1, "receptance": 0}
    h = {}
    for quantity in power:
        said = f'file = "a.uff"\nquantity = "{quantity}"'
        if quantity != "accelerance":
            path.write_text(text.replace('file = "a.uff"', said))
            with pytest.raises(jf.FileContentError, match="states accelerance"):
                read_case(by_receptances)
            said += f'\nforce_quantity = true\nunit = "{"m/s/N" if quantity == "mobility" else "m/N"}"'
        path.write_text(text.replace('file = "a.uff"', said))
        h[quantity] = read_case(by_receptances).a.receptance(BEAMS.freq_hz, ["3:y", "3:rz"])
    i_omega = 2j * np.pi * BEAMS.freq_hz[:, None, None]
    for quantity, n in power.items():
        same_frfs(h["receptance"] / i_omega**n, h[quantity])
    same_frfs(h["accelerance"], BEAMS.a.receptance(BEAMS.freq_hz, ["3:y", "3:theta"]))


def test_large_matrices_are_reduced_or_factored_by_their_entries(by_matrices):
    """A membrane of 6400 DOFs: one full matrix would take 660 MB."""
    rows = columns = 80
    second = [sparse.diags_array([-1.0, 2.0, -1.0], offsets=(-1, 0, 1), shape=(n, n)) for n in (rows, columns)]
    k = 1e6 * sparse.kronsum(*second, format="csr")
    n = k.shape[0]
    scipy.io.mmwrite(by_matrices / "a_k.mtx", k, symmetry="symmetric")
    sparse.save_npz(by_matrices / "a_m.npz", 0.01 * sparse.eye_array(n, format="csr"))
    (by_matrices / "a_dofs.txt").write_text("\n".join(f"{i + 1}:z" for i in range(n)))
    text = (by_matrices / "case.toml").read_text()
    points = '[points]\nj = ["3:z", "99:z"]\nk = ["1:y", "1:theta"]\nr = ["6400:z", "5:z"]\ns = ["2:y", "2:theta"]\n'
    (by_matrices / "case.toml").write_text(replace_tables(text, points))
    case = read_case(by_matrices)
    model = case.a.model
    ports = model.ports("3:z", "99:z", "6400:z", "5:z")
    arguments = (BEAMS.freq_hz[:40], model.stiffness, model.mass, None, 0.01, None, ports, ports)
    h, info = jf.receptance(*arguments, full_output=True)
    assert info.method == "krylov"
    same_frfs(case.a.receptance(BEAMS.freq_hz[:40], ["3:z", "99:z", "6400:z", "5:z"]), h)


def test_some_modes_of_a_large_model_are_those_of_all_and_the_same_each_time():
    model = jf.beam(0.3, 40, ends=("clamped", "free"), density=2700.0, width=0.025, height=0.006, youngs_modulus=67e9)
    (first, shapes), (again, same_shapes) = model.modes(6), model.modes(6)
    np.testing.assert_allclose(first, model.modes()[0][:6], rtol=1e-6)
    np.testing.assert_array_equal(again, first)
    np.testing.assert_array_equal(same_shapes, shapes)


def test_dofs_without_mass_have_no_modes():
    """Two springs in a row with nothing between them: one mode, of half the stiffness."""
    k = np.array([[2.0, -1.0], [-1.0, 1.0]])
    model = jf.Model(k, np.diag([0.0, 1.0]), ("1:x", "2:x"))
    freq, shapes = model.modes()
    np.testing.assert_allclose(2 * np.pi * freq, [np.sqrt(0.5)], rtol=1e-6)
    np.testing.assert_allclose(abs(shapes[:, 0]), [0.5, 1.0], rtol=1e-6)
    with pytest.raises(ValueError, match="has no modes: a motion has no stiffness and no mass"):
        jf.Model(np.diag([0.0, 1.0]), np.diag([0.0, 1.0]), ("1:x", "2:x")).modes()


def test_bricks_of_a_beam_are_as_many_as_asked_for(tmp_path):
    text = (ROOT / "cases" / "4.3.2-six-dof-decoupling" / "case.toml").read_text(encoding="utf-8")
    asked = "\ndivisions = [8, {}, 57]\nlength = 0.3"
    (tmp_path / "case.toml").write_text(text.replace("\nlength = 0.3", asked.format(4), 1), encoding="utf-8")
    case = read_case(tmp_path)
    assert [len(one.model.mesh.elements) for one in (case.a, case.b)] == [2048, 1024]  # by default 8, 2, 57
    (tmp_path / "case.toml").write_text(text.replace("\nlength = 0.3", asked.format(0), 1), encoding="utf-8")
    with pytest.raises(ValueError, match=r"substructure_a.*divisions along y"):
        read_case(tmp_path)
