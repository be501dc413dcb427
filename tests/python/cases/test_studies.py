"""Studies on every executor: the same numbers, stopped and gone on with, of any kind of case and any estimator."""

import json
import os
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from multiprocessing import active_children
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from msgspec import structs

import jointfrf as jf
from command import run_command
from jointfrf.workbench.cases.catalogue import find_case, read_case
from jointfrf.workbench.cases.known_joint.exact import exact_frfs
from jointfrf.workbench.studies.summary import ParameterSummary, study_figures
from studied_case import CASE, DESIGN, WORDS, N, broken_off, doubled, same
from thinned_cases import estimate_realisations


@pytest.fixture(scope="module")
def reference(tmp_path_factory) -> jf.StudyResult:
    return jf.study(CASE, tmp_path_factory.mktemp("study"), N, design=DESIGN, jobs=1)


def studied(folder, **how):
    return jf.study(CASE, folder, N, design=DESIGN, **how)


def test_estimates_are_those_of_the_case(reference):
    """Those that `jointfrf run` computes from the same noise numbers."""
    case = read_case(find_case(CASE))
    lines = np.round(0.01 + (9.99 / 99) * np.arange(100), 9)
    case = replace(case, freq_hz=lines, noises=(structs.replace(case.noises[0], methods=("ismm", "compliance")),))
    for group, one in enumerate(estimate_realisations(case, exact_frfs(case), N)):
        assert one.method == reference.groups[group].columns[0].estimator
        _, values, _, _ = reference.estimates(group)
        np.testing.assert_allclose(values, one.theta, rtol=1e-8)


def test_threads_give_the_same_numbers(reference, tmp_path):
    with ThreadPoolExecutor(2) as executor:
        assert same(studied(tmp_path, executor=executor), reference)


@pytest.mark.long
def test_processes_give_the_same_numbers_though_one_is_killed(reference, tmp_path):
    seen = []

    def progress(done, total):
        seen.append((done, total))
        if len(seen) == 1 and hasattr(signal, "SIGKILL"):
            os.kill(active_children()[0].pid, signal.SIGKILL)

    assert same(studied(tmp_path, jobs=2, progress=progress), reference)
    assert all(done <= total for done, total in seen)
    assert seen[-1][0] == seen[-1][1]


@pytest.mark.long
def test_loky_gives_the_same_numbers(reference, tmp_path):
    loky = pytest.importorskip("loky")
    made = lambda: loky.get_reusable_executor(max_workers=2)  # noqa: E731
    assert same(studied(tmp_path, executor=made), reference)


def mpiexec() -> str | None:
    return shutil.which("mpiexec", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))


@pytest.mark.long
@pytest.mark.skipif(mpiexec() is None, reason="mpiexec is not on PATH")
def test_two_processes_of_mpi_give_the_same_numbers(reference, tmp_path):
    pytest.importorskip("mpi4py")
    words = [mpiexec(), "-n", "2", sys.executable, "-m", "mpi4py.futures", "-m", "jointfrf", "study", *WORDS]
    words += ["--executor", "mpi", "--realisations", str(N), "--first", "0", "--count", str(N), "--out", str(tmp_path)]
    allowed = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    done = subprocess.run(
        words, env={**os.environ, **allowed}, capture_output=True, text=True, timeout=900, check=False
    )
    assert done.returncode == 0, done.stderr
    assert same(jf.read_study(tmp_path), reference)


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_killed_study_goes_on_without_loss(tmp_path):
    """Killed as soon as some chunks are there, and once more; what is there then is not computed again."""
    design = jf.StudyDesign({"lines": [100]}, noises=["5 %"], estimators=["compliance"])
    words = [sys.executable, "-m", "jointfrf", "study", "3.1", "--factor", "lines=100", "--noise", "5 %"]
    words += ["--estimator", "compliance", "--realisations", "4000", "--out", str(tmp_path / "a"), "--jobs", "1"]
    kept: set[tuple[str, int]] = set()
    for most in (1, 3):
        with subprocess.Popen(words, stderr=subprocess.DEVNULL) as process:
            for _ in range(90000):
                if len(list((tmp_path / "a" / "chunks").glob("[0-9]*.npz"))) >= most:
                    break
                time.sleep(0.01)
            process.send_signal(signal.SIGKILL)
        there = {(path.name, path.stat().st_mtime_ns) for path in (tmp_path / "a" / "chunks").glob("[0-9]*.npz")}
        assert kept <= there
        assert len(there) >= most
        kept = there
    found = jf.read_study(tmp_path / "a")
    assert 0 < found.missing < 4000
    numbers, values, low, high = found.estimates(0)
    for first, count in ((0, 2), (int(numbers[-1]) - 1, 2)):
        other = jf.study("3.1", tmp_path / f"b{first}", 4000, design=design, part=range(first, first + count), jobs=1)
        at = np.searchsorted(numbers, first)
        for x, y in zip(other.estimates(0)[1:], (values, low, high), strict=True):
            np.testing.assert_array_equal(x, y[at : at + count])
    end = int(numbers[-1]) + 1
    assert numbers.tolist() == list(range(end))
    whole = jf.study("3.1", tmp_path / "a", 4000, design=design, part=range(0, end + 3), jobs=1)
    assert kept <= {(path.name, path.stat().st_mtime_ns) for path in (tmp_path / "a" / "chunks").iterdir()}
    assert whole.estimates(0)[0].tolist() == list(range(end + 3))
    np.testing.assert_array_equal(whole.estimates(0)[1][:end], values)


def test_parts_are_merged(reference, tmp_path):
    parts = [tmp_path / name for name in "abc"]
    for folder, part in zip(parts, (range(0, 3), range(3, 8), range(6, N)), strict=True):
        jf.study(CASE, folder, N, design=DESIGN, part=part, jobs=1)
    merged = jf.merge_studies(parts[:2], tmp_path / "whole")
    assert merged.missing == 2 * (N - 8)
    merged = jf.merge_studies(parts[2:], tmp_path / "whole")
    assert merged.missing == 0
    assert same(merged, reference)
    assert str(merged) == str(reference)


def test_more_realisations_are_added_to_what_is_there(reference, tmp_path):
    shutil.copytree(reference.folder, tmp_path / "a")
    more = jf.study(CASE, tmp_path / "a", N + 3, design=DESIGN, jobs=1)
    assert more.missing == 0
    assert more.estimates(1)[0].tolist() == list(range(N + 3))
    np.testing.assert_array_equal(more.estimates(1)[1][:N], reference.estimates(1)[1])
    fewer = jf.study(CASE, tmp_path / "a", 2, design=DESIGN, jobs=1)
    assert (fewer.record.realisations, fewer.missing) == (2, 0)
    assert jf.study(CASE, tmp_path / "a", N + 3, design=DESIGN, jobs=1).estimates(1)[0].tolist() == list(range(N + 3))


def test_another_study_does_not_go_into_the_same_folder(reference):
    with pytest.raises(jf.FileContentError, match=r"contains another study, of 3\.1-discrete, whose factors differ"):
        jf.study(CASE, reference.folder, N, design=replace(DESIGN, factors={"lines": [50]}))
    with pytest.raises(jf.FileContentError, match="whose case differ"):
        jf.study("3.2", reference.folder, N)


def test_own_estimators_and_noises(tmp_path):
    design = jf.StudyDesign(
        {"lines": [50]}, estimators={"middle": broken_off, "inverse-substructuring": None},
        own_noises={"factor": doubled},
    )  # fmt: skip
    found = jf.study(CASE, tmp_path / "a", 4, design=design, jobs=1)
    assert [group.columns[0].estimator for group in found.groups] == ["inverse-substructuring", "middle"]
    # every FRF times 1 + 0.31 + k: K* over the same
    expected = 2000 / (1.31 + np.arange(4))
    for group in (0, 1):
        np.testing.assert_allclose(found.estimates(group)[1][:, 0], expected, rtol=1e-9)
    assert all(np.isnan(row.bound) for row in found.summary)
    with pytest.raises(ValueError, match=r"an estimator returned an array of shape \(1,\); return 2 numbers"):
        jf.study(CASE, tmp_path / "b", 2, design=jf.StudyDesign(estimators={"bad": lambda *_: [1.0]}), jobs=1)


class AnotherVersion(ThreadPoolExecutor):
    """Workers that return something else than ours."""

    def __init__(self, change):
        super().__init__(1)
        self.change = change

    def submit(self, fn, /, *args, **kwargs):
        return super().submit(lambda: self.change(fn(*args, **kwargs)))


#: What a worker may return for a result of ours, and what is said of it.
RETURNED = {
    "nothing": (lambda result: None, TypeError, "a worker returned None for realisations 0 to"),
    "a list": (lambda result: list(result), TypeError, "start workers with this version of jointfrf"),
    "estimates alone": (lambda result: result.estimates, TypeError, "start workers with this version"),
    "a text as time": (lambda result: result._replace(seconds="2"), TypeError, "start workers with this version"),
    "lists in estimates": (
        lambda result: result._replace(estimates=result.estimates._replace(values=[[1.0, 2.0]])),
        ValueError, "ismm: values must be float64, not list",
    ),
    "single precision": (
        lambda result: result._replace(estimates=result.estimates._replace(low=result.estimates.low.astype("f4"))),
        ValueError, "ismm: low must be float64, not float32",
    ),
    "a row less": (
        lambda result: result._replace(estimates=type(result.estimates)(*(part[1:] for part in result.estimates))),
        ValueError, r"of noise '5 %', ismm: values must be \d+ realisations x 2 columns, not \d+ x 2",
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", RETURNED)
def test_what_a_worker_returns_is_checked_before_it_is_kept(tmp_path, kind):
    change, error, message = RETURNED[kind]
    with AnotherVersion(change) as executor, pytest.raises(error, match=message):
        studied(tmp_path, executor=executor)
    assert not list((tmp_path / "chunks").iterdir())


def test_an_estimator_that_gives_infinity_is_named(tmp_path):
    design = jf.StudyDesign({"lines": [50]}, noises=["5 %"], estimators={"mine": lambda *_: [np.inf, 1.0]})
    with pytest.raises(ValueError, match="'5 %', mine: values must be finite, or NaN if a realisation failed"):
        jf.study(CASE, tmp_path, 4, design=design, jobs=1)


def test_a_realisation_without_a_joint_counts_as_failed(tmp_path):
    design = jf.StudyDesign(estimators=["compliance"], own_noises={"nothing": lambda h, seed, number: h * 0})
    found = jf.study(CASE, tmp_path, 2, design=design, jobs=1)
    assert {(row.count, row.failed) for row in found.summary} == {(2, 2)}
    assert "failed" in str(found)


def test_the_bound_is_that_of_the_variance_of_the_noise(tmp_path):
    """Noise of a standard deviation in each part is sqrt 2 times noise of that standard deviation in all."""
    kinds = ["complex", "complex-per-part", "real-normal"]
    design = jf.StudyDesign({"lines": [50], "noise.kind": kinds}, noises=["5 %"], estimators=["ismm"])
    found = jf.study(CASE, tmp_path, 1, design=design, jobs=1)
    whole, per_part, of_modulus = np.reshape([row.bound for row in found.summary], (3, -1))
    assert (whole > 0).all()
    np.testing.assert_allclose(per_part, np.sqrt(2) * whole)
    assert np.isnan(of_modulus).all()


def test_errors_at_the_bound_lie_in_the_band_beside_it():
    rng, rows, bound = np.random.default_rng(7), [], 0.02
    for level, count in ((1.0, 8), (2.0, 50)):
        errors = bound * rng.standard_normal((4000, count))
        shared = dict(noise="n", estimator="e", parameter="k_x", unit="N/m", actual=1.0, count=count + 3, failed=3,
                      mean=1.0, std=bound, median=1.0, low=0.9, high=1.1, bias=0.0, coverage=np.nan)  # fmt: skip
        rmse = np.sqrt((errors**2).mean(axis=1))
        rows.append((ParameterSummary({"noise": level}, rmse=float(rmse[0]), bound=bound, **shared), rmse))
    identity = {"factors": {"noise": [1.0, 2.0]}}
    figures = study_figures(SimpleNamespace(identity=identity), [row for row, _ in rows])
    (ribbon,) = next(one for one in figures if one.key.startswith("rmse")).panels[0].ribbons
    for low, high, (_, rmse) in zip(ribbon.low, ribbon.high, rows, strict=True):
        inside = np.mean((100 * rmse > low) & (100 * rmse < high))
        assert abs(inside - 0.95) < 0.015  # 4000 draws: four standard errors


def test_a_modelled_joint(tmp_path):
    found = jf.study("rubber-mount", tmp_path, 1, design=jf.StudyDesign({"noise": [0.005]}), jobs=1)
    rows = {row.parameter: row for row in found.summary}
    assert {"k_y", "alpha_y", "A/youngs_modulus"} <= set(rows)
    assert all(abs(row.bias) < 5 * row.bound for row in rows.values())
    with pytest.raises(ValueError, match="in a case of kind modelled-joint; use model-fit"):
        jf.study("rubber-mount", tmp_path / "b", 2, design=jf.StudyDesign(estimators=["ismm"]), jobs=1)


def test_command_says_what_the_study_holds(reference, tmp_path):
    out = tmp_path / "a"
    words = ("study", *WORDS, "--realisations", N, "--out", out, "--jobs", 1, "--values", "npz")
    done = run_command(*words, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    printed = json.loads(done.stdout)
    assert printed["summary"][0]["rmse"] == reference.summary[0].rmse
    assert printed["missing"] == 0
    page = Path(printed["report"]).read_text(encoding="utf-8")
    assert "Cramér-Rao" in page
    assert "data:image/svg" in page
    with np.load(printed["npz"]) as held:
        np.testing.assert_array_equal(held["values_1"], reference.estimates(1)[1])
    text = run_command(*words).stdout
    assert text.startswith(f"Estimates over {N} realisations, seed 31\n")
    merged = run_command("study", "merge", out, "--out", tmp_path / "b", "--quiet")
    assert (merged.returncode, merged.stdout) == (0, "")


@pytest.mark.parametrize(
    ("words", "status", "message"),
    [
        (["3.1", "--factor", "noise"], 2, "--factor: 'noise' is no factor; write NAME=VALUE,VALUE,..."),
        (["3.1", "--factor", "noise=1%"], 1, "level must be a number, at least 0, not '1%'"),
        (["3.1", "--factor", "nois=0.1"], 1, "unknown factor 'nois'; did you mean noise?"),
        (["3.1", "--first", "3"], 2, "only one of --first and --count is given"),
        (
            ["3.1", "--realisations", "5", "--first", "3", "--count", "3"],
            1,
            "part is range(3, 6); give at",
        ),
        (["3.1", "--realisations", "0"], 1, "realisations must be from 1 to 2147483647, not 0"),
        (["3.1", "3.2"], 2, "several cases are given, 3.1 and 3.2"),
        (["3.11"], 2, "unknown case '3.11'; name a folder"),
        (["merge", "somewhere"], 2, "folders of parts or --out are missing"),
        (["merge", "somewhere", "--out", "there"], 1, "somewhere contains no study.json"),
        (
            ["3.1", "--estimator", "compliances"],
            1,
            "'compliances' in a case of kind known-joint; did you mean compliance?",
        ),
        (["3.1", "--noise", "6 %"], 1, "unknown noise '6 %'; did you mean 5 %?"),
        (
            ["3.1", "--executor", "dusk"],
            2,
            "unknown value 'dusk'; use one of processes, threads, loky, mpi",
        ),
        (["3.1", "--values", "csv"], 2, "unknown value 'csv'; use one of parquet, npz"),
    ],
)
def test_wrong_words_are_one_sentence(words, status, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = run_command("study", *words, *([] if "--out" in words else ["--out", "out"] * (words[0] != "merge")))
    assert (done.returncode, done.stdout) == (status, "")
    assert message in done.stderr
    assert len([line for line in done.stderr.splitlines() if "error" in line]) == 1
    assert not (tmp_path / "out").exists()


def test_extras_of_the_page_are_there():
    extras = tomllib.loads((Path(__file__).resolve().parents[3] / "pyproject.toml").read_text(encoding="utf-8"))
    assert {"loky", "mpi", "parquet"} <= set(extras["project"]["optional-dependencies"])
