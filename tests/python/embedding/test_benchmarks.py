"""The benchmark command: it runs, finds wrong results, compares, and fills the document."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock

from installed_library import run

TESTS = Path(__file__).resolve().parents[2]
BUILD = TESTS.parent / "build" / "benchmarks_plain"


def command(*arguments: str, module: str = "benchmarks") -> subprocess.CompletedProcess[str]:
    """The command on a kernel that is built without optimisation, for nothing here is about its speed."""
    BUILD.parent.mkdir(exist_ok=True)
    with FileLock(BUILD.with_suffix(".lock")):  # processes that test at once take turns
        if not (BUILD / "build.ninja").exists():
            run(["meson", "setup", BUILD, TESTS.parent, "-Dbuildtype=plain", "-Dlapack=scipy-openblas32"])
        path = os.pathsep.join([str(TESTS), *filter(None, [os.environ.get("PYTHONPATH")])])
        return subprocess.run(
            [sys.executable, "-m", module, *arguments],
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONPATH": path, "JOINTFRF_BENCHMARK_BUILD": str(BUILD)},
            timeout=300,
        )


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """One short run: (folder, what it printed, what it wrote)."""
    folder = tmp_path_factory.mktemp("speed")
    names = ("--operations", "invert,ismm,noise", "--orders", "2,3", "--lines", "64")
    done = command("--quick", *names, "--budget", "0", "--output", str(folder))
    assert done.returncode == 0, done.stdout + done.stderr
    return folder, done.stdout, json.loads((folder / "speed.json").read_text())


@pytest.fixture
def benchmarks(monkeypatch):
    """Import the package of the command; it sets variables of the environment."""
    monkeypatch.syspath_prepend(str(TESTS))
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.setenv(name, "1")
    import benchmarks.__main__

    return benchmarks


@pytest.mark.builds
def test_every_candidate_is_timed(result):
    _, printed, run = result
    one = {r["candidate"] for r in run["records"] if r["operation"] == "invert" and r["threads"] == 1}
    assert one >= {"jointfrf", "engine lapack", "numpy", "LAPACK loop"}
    assert {(r["operation"], r["n"]) for r in run["records"]} == {
        (name, n) for name in ("invert", "ismm", "noise") for n in (2, 3)
    }
    for r in run["records"]:
        assert 0 < r["least"] <= r["median"] < math.inf
        assert len(r["samples"]) == 3
        assert 0 < r["limit"] < math.inf
    for name in ("invert", "ismm", "noise"):
        assert f"\n{name}: ns a line (FRFs" in printed


@pytest.mark.builds
def test_limits_are_those_of_a_machine(result):
    one, *more = result[2]["limits"]
    assert 1e8 < one["best_peak"] < 1e13
    assert all(1e8 < rate < 1e13 for _, rate in one["bandwidth"])
    for limit in more:
        # Where other programs hold the second core, threads wait for each other.
        assert limit["best_peak"] > 0
        assert all(rate > 0 for _, rate in limit["bandwidth"])


@pytest.mark.builds
def test_figure_is_a_png(result):
    assert (result[0] / "speed.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.builds
def test_what_became_slower_is_told(result, benchmarks, tmp_path):
    folder, _, run = result
    same = benchmarks.results.load(folder / "speed.json")
    assert benchmarks.report.comparison(same, same)[1] is False
    for r in run["records"]:
        if r["operation"] == "invert" and r["candidate"] == "jointfrf" and r["n"] == 3:
            r["median"] /= 100
    old = tmp_path / "old.json"
    old.write_text(json.dumps(run))
    worse = command("--from", str(folder / "speed.json"), "--compare", str(old), "--output", str(tmp_path))
    assert worse.returncode == 1
    assert "invert, n = 3, FRFs" in worse.stdout
    assert "ismm, n" not in worse.stdout
    assert (tmp_path / "speed.png").exists()


@pytest.mark.builds
def test_document_is_rewritten_between_the_markers_only(result, benchmarks, tmp_path):
    document = tmp_path / "README.md"
    document.write_text("before\n<!-- speed: begin -->\nold\n<!-- speed: end -->\nafter\n")
    run = benchmarks.results.load(result[0] / "speed.json")
    benchmarks.report.write_document(run, document)
    text = document.read_text()
    assert text.startswith("before\n<!-- speed: begin -->\n")
    assert text.endswith("\n<!-- speed: end -->\nafter\n")
    assert "| `invert` | " in text
    assert "old" not in text
    document.write_text("no markers")
    with pytest.raises(ValueError, match="markers"):
        benchmarks.report.write_document(run, document)


def test_wrong_results_are_found(benchmarks):
    operations = benchmarks.operations
    for name, operation in operations.OPERATIONS.items():
        n = max(2, operation.smallest)
        for kind in operation.kinds:
            data = operation.make(kind, 100, n)
            reference = operations.Reference(operation, data)
            # The reference and the operation go different ways to the same result.
            good = operation.ours(data)
            assert reference.fault(good) == "", name
            bad = np.array(good)
            bad[37] *= 1 + (10.0 if name == "noise" else 1e-3)
            assert reference.fault(bad) != "", name


def test_limit_is_that_of_the_cache_which_holds_the_data(benchmarks):
    limits = benchmarks.machine.Limits(1, {"256": 1e9}, [(1024, 4e9), (4096, 1e9)])
    assert limits.seconds(10, 0, 1024) == pytest.approx(1e-8)
    assert limits.seconds(0, 4, 512) == pytest.approx(1e-9)
    assert limits.seconds(0, 4, 2048) == pytest.approx(2e-9)
    assert limits.seconds(0, 4, 1e9) == pytest.approx(4e-9)


def test_command_can_be_started():
    assert os.access(TESTS / "benchmarks" / "run", os.X_OK)


@pytest.mark.builds
def test_one_line_is_timed_three_ways(tmp_path):
    results = tmp_path / "lines.json"
    done = command("--orders", "1,3", "--output", str(results), module="benchmarks.line_calls")
    assert done.returncode == 0, done.stdout + done.stderr
    records = json.loads(results.read_text())
    assert [record["order"] for record in records] == [1, 3]
    assert all(0 < value < math.inf for record in records for value in record.values())
    assert [row.split()[0] for row in done.stdout.splitlines()[1:]] == ["couple"] * 2 + ["compliance"] * 2 + [
        "solve"
    ] * 2
    assert os.access(TESTS / "benchmarks" / "run-line-calls", os.X_OK)
