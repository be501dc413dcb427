"""What a kind of case is: the registry, a kind of one's own, and what a run keeps in memory."""

import json
import shutil
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.choices import CASE_KINDS
from jointfrf.dofs import Parameter
from jointfrf.errors import FileContentError
from jointfrf.toml.declared import NotNegative, Positive, key
from jointfrf.workbench.cases import catalogue
from jointfrf.workbench.cases.catalogue import find_case, kind_named, list_cases, read_case, read_case_and_kind
from jointfrf.workbench.cases.keys import Case, CaseKeys, ExpectedKeys
from jointfrf.workbench.cases.kind import CaseKind, EstimateColumn, EstimateGroup, Estimates
from jointfrf.workbench.cases.known_joint.exact import exact_frfs
from jointfrf.workbench.cases.known_joint.regenerate import regenerate, regenerate_all
from jointfrf.workbench.cases.run import run_case
from jointfrf.workbench.cases.workers import Workers
from jointfrf.workbench.report.figure import Curve, Figure, Panel
from jointfrf.workbench.report.table import Table
from thinned_cases import estimate_realisations


def test_every_case_names_a_kind_of_the_registry_or_none():
    assert [kind_named(name).name for name in CASE_KINDS] == ["known-joint", "bolted-lap", "modelled-joint"]
    kinds = {folder.name: read_case_and_kind(folder)[1].name for folder in list_cases()}
    assert kinds.pop("4.3.3-bolt") == "bolted-lap"
    assert kinds.pop("rubber-mount") == "modelled-joint"
    assert set(kinds.values()) == {"known-joint"}


def test_a_kind_may_be_named_where_it_is_the_first(tmp_path):
    text = (find_case("3.1") / "case.toml").read_text()
    (tmp_path / "case.toml").write_text('kind = "known-joint"\n' + text)
    assert read_case(tmp_path).joint.dofs == ("x",)


@dataclass(frozen=True, kw_only=True)
class Oscillator(Case):
    """A mass on a spring, whose stiffness is to be found from its noisy receptance."""

    mass: float
    stiffness: float
    expected: float | None


@dataclass(frozen=True)
class Weighed:
    """Stiffness by every realisation, and one FRF."""

    case: Oscillator
    stiffness: np.ndarray
    h: np.ndarray


class OscillatorKeys(CaseKeys, tag="oscillator"):
    """A mass on a spring."""

    mass: Annotated[Positive, key("Mass.", "kg", example=2.0)]
    stiffness: Annotated[NotNegative, key("Stiffness.", "N/m", example=500.0)]


class OscillatorExpected(ExpectedKeys):
    """What is known of it."""

    stiffness: Annotated[float | None, key("Stiffness.", "N/m")] = None


def read(common, keys, expected):
    return Oscillator(**vars(common), mass=keys.mass, stiffness=keys.stiffness, expected=expected.stiffness)


def frfs(case):
    return 1 / (case.stiffness - (2 * np.pi * case.freq_hz) ** 2 * case.mass + 0j)


def groups(case, h, choice):
    inertia = (2 * np.pi * case.freq_hz) ** 2 * case.mass

    def source(first, count):
        numbers = range(first, first + count)
        noisy = [jf.pollute(h[:, None, None], 0.01, "complex", case.seed, realisation=i) for i in numbers]
        return Estimates.without_intervals(np.array([[np.mean(1 / one[:, 0, 0] + inertia).real] for one in noisy]))

    column = EstimateColumn("mean", "k_x", "N/m", case.stiffness, np.nan)
    return [EstimateGroup("1 %", "mean", (column,), source)]


def result(computed):
    (found,) = computed.estimates()
    return Weighed(computed.case, found.estimates.values[:, 0], computed.frfs)


def tables(result):
    parameter = Parameter.of_dof("k", "x")
    row = (parameter, parameter.unit, result.case.stiffness, float(np.median(result.stiffness)))
    return [Table("found", "Stiffness", ("parameter", "unit", "actual", "median"), (row,))]


def figures(result):
    curve = Curve("exact", result.case.freq_hz, abs(result.h), "actual")
    return [Figure("frf", "Receptance", (Panel("", "frequency, Hz", "m/N", (curve,), log_y=True),))]


OSCILLATOR = CaseKind(
    keys=OscillatorKeys,
    expected_keys=OscillatorExpected,
    read=read,
    frfs=frfs,
    groups=groups,
    result=result,
    tables=tables,
    figures=figures,
    summary=lambda result, tables: [
        Table("short", "In short", ("tables", "realisations"), ((str(len(tables)), str(result.stiffness.size)),))
    ],
    numbers=lambda result: {"stiffness": result.stiffness.tolist()},
)
TEXT = """
kind = "oscillator"
title = "One mass"
section = "none"
mass = 2.0
stiffness = 500.0
[frequency]
first = 0.1
last = 2.0
step = 0.1
[study]
realisations = 40
seed = 5
"""


@pytest.fixture
def registered(monkeypatch):
    """The kind is registered: its line of the registry and its package."""
    monkeypatch.setattr(catalogue, "CASE_KINDS", (*CASE_KINDS, "oscillator"))
    monkeypatch.setitem(sys.modules, "jointfrf.workbench.cases.oscillator", SimpleNamespace(KIND=OSCILLATOR))


@pytest.fixture
def folder(tmp_path):
    own = tmp_path / "one-mass"
    own.mkdir()
    (own / "case.toml").write_text(TEXT)
    (own / "expected.toml").write_text('stiffness = 490.0\n[figures]\nfrf = "7-1"\n')
    return own


@pytest.mark.usefixtures("registered")
def test_a_kind_of_ones_own_goes_through_the_same_door(folder, tmp_path):
    reported = []
    workers = Workers(progress=lambda done, total: reported.append((done, total)))
    output = run_case(folder, tmp_path / "out", png=True, workers=workers)
    assert (output.case.mass, output.case.expected, output.case.realisations) == (2.0, 490.0, 40)
    assert output.result.stiffness == pytest.approx(500, rel=0.01)
    assert reported == [(i + 1, 40) for i in range(40)]
    written = tmp_path / "out" / "one-mass"
    content = json.loads((written / "results.json").read_text())
    assert (content["case"], content["seed"], content["frequency_hz"]["lines"]) == ("one-mass", 5, 20)
    assert content["stiffness"] == output.result.stiffness.tolist()
    assert content["tables"]["found"]["rows"][0][:3] == ["k_x", "N/m", 500.0]
    assert (written / "tables" / "found.csv").read_text().startswith("parameter,unit,actual,median\nk_x,N/m,500.0,")
    assert (written / "figures" / "frf.png").read_bytes().startswith(b"\x89PNG")
    report = output.report.read_text()
    for words in ("In short</h3>", "<span>40</span>", "<b>Figure 7-1.</b>", "<i>k</i><sub>x</sub>", "mass = 2.0"):
        assert words in report
    assert [table.key for table in output.printed] == ["found"]


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("case.toml", "mass = 2.0", "mass = 2.0\nm = 1", r"case\.toml: unknown key 'm'; use one of kind, title"),
        ("case.toml", "mass = 2.0", "", r"case\.toml: the key 'mass' is missing"),
        ("case.toml", "step = 0.1", "step = 0", r"\[frequency\]: step must be positive"),
        ("expected.toml", "[figures]", "mass = 1\n[figures]", r"expected\.toml: unknown key 'mass'; use one of"),
    ],
)
def test_a_kind_of_ones_own_gets_the_same_sentences(folder, file, old, new, message):
    path = folder / file
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(FileContentError, match=message):
        read_case(folder)


def test_a_kind_that_is_not_registered_is_told(folder):
    with pytest.raises(FileContentError, match=r"kind must be one of known-joint, .*, not 'oscillator'"):
        read_case(folder)


@pytest.fixture(scope="module")
def identified():
    """A few realisations of two beams, on some lines."""
    case = read_case(find_case("3.2"))
    case = replace(case, freq_hz=case.freq_hz[::4], noises=case.noises[1:])
    exact = exact_frfs(case)
    return case, exact, estimate_realisations(case, exact, 5)


def owner(array):
    """The array that holds the memory of another one."""
    return array if array.base is None else owner(array.base)


def test_regenerated_frfs_own_their_memory(identified, monkeypatch):
    """A view would keep the FRFs of all DOFs and realisations alive."""
    case, exact, found = identified
    h = regenerate(exact, found[0].theta, "s", 1)
    assert h.base is None
    assert h.shape == (5, case.freq_hz.size)
    for one in regenerate_all(exact, found, case.observed, Workers()):
        arrays = (one.percentiles, one.first, one.amplitude, one.frequency, one.identified.k_lines)
        assert sum(owner(array).nbytes for array in arrays) < 200 * case.freq_hz.size


def test_lines_that_are_kept_own_their_memory(identified):
    case, _, found = identified
    for one in found:
        assert owner(one.k_lines).nbytes == one.k_lines.nbytes == 5 * case.freq_hz.size * 2 * 16


def test_realisations_in_chunks_are_those_at_once(identified, monkeypatch):
    _, exact, found = identified
    whole = regenerate(exact, found[0].theta, "r")
    monkeypatch.setattr("jointfrf.workbench.cases.known_joint.regenerate.chunk_size", lambda n_freq, entries: 2)
    np.testing.assert_allclose(regenerate(exact, found[0].theta, "r"), whole, rtol=1e-13)


ADDED = '''
"""A kind of case that does nothing."""

from pathlib import Path
from typing import Annotated

from jointfrf.workbench.cases.keys import CaseKeys
from jointfrf.workbench.cases.kind import CaseKind
from jointfrf.workbench.report.table import Table
from jointfrf.toml.declared import Positive, key


class PendulumKeys(CaseKeys, tag="pendulum"):
    """A pendulum."""

    arm: Annotated[Positive, key("Length of its arm.", "m", example=1.5)]


KIND = CaseKind(
    keys=PendulumKeys,
    read=lambda common, keys, expected: common,
    frfs=lambda case: None,
    groups=lambda case, frfs, choice: [],
    result=lambda computed: computed.case,
    tables=lambda result: [Table("arm", "Arm", ("quantity",), (("seen",),))],
    figures=lambda result: [],
    summary=lambda result, tables: [],
    numbers=lambda result: {},
)
'''


def test_a_kind_is_added_by_a_folder_and_a_line(tmp_path):
    """In a copy of the package: the help, the template, the schema, the reference and the reader know it."""
    package = shutil.copytree(Path(jf.__file__).parent, tmp_path / "jointfrf", ignore=shutil.ignore_patterns("*.pyc"))
    (package / "workbench" / "cases" / "pendulum").mkdir()
    (package / "workbench" / "cases" / "pendulum" / "__init__.py").write_text(ADDED)
    words = package / "choices.py"
    last = '"modelled-joint")\n'
    text = words.read_text()
    assert text.count(last) == 1
    words.write_text(text.replace(last, '"modelled-joint", "pendulum")\n'))
    program = (
        "import importlib.util, sys; sys.path.insert(0, sys.argv.pop(1)); "
        "sys.meta_path = [one for one in sys.meta_path if 'editable' not in type(one).__module__]; "
        "spec = importlib.util.spec_from_file_location('jointfrf._kernel', sys.argv.pop(1)); "
        "kernel = importlib.util.module_from_spec(spec); sys.modules['jointfrf._kernel'] = kernel; "
        "spec.loader.exec_module(kernel); from jointfrf.workbench.cli.main import main\n"
        "for words in sys.argv[1:]:\n"
        "    try: status = main(words.split())\n"
        "    except SystemExit as stop: status = stop.code\n"
        "    if status: sys.exit(status)\n"
        "    print('\\f')\n"
    )
    words = ("new --help", "new pendulum own", "cases --keys", "run own --jobs 1")
    command = [sys.executable, "-c", program, str(tmp_path), sys.modules["jointfrf._kernel"].__file__, *words]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=True)
    help_of_new, _, keys, ran, _ = done.stdout.split("\f")
    assert "pendulum" in help_of_new
    assert "arm = 1.5" in (tmp_path / "own" / "case.toml").read_text()
    assert "Length of its arm." in (tmp_path / "own" / "case.schema.json").read_text()
    assert "## case.toml of kind pendulum" in keys
    assert "seen" in ran
