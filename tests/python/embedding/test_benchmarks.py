"""The benchmark command: it runs, finds wrong results, compares, and fills the document."""

import json
import math
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from filelock import FileLock

from installed_library import run

TESTS = Path(__file__).resolve().parents[2]
BUILD = TESTS.parent / "build" / "benchmarks_plain"


def command(
    *arguments: str,
    module: str = "benchmarks",
    environment: dict[str, str] | None = None,
    cores: set[int] | None = None,
) -> subprocess.CompletedProcess[str]:
    """The command on a kernel that is built without optimisation, for nothing here is about its speed."""
    BUILD.parent.mkdir(exist_ok=True)
    with FileLock(BUILD.with_suffix(".lock")):  # processes that test at once take turns
        if not (BUILD / "build.ninja").exists():
            quick = ["-Dbuildtype=plain", "-Dinstruction_sets=plain", "-Dlapack=scipy-openblas32"]
            run(["meson", "setup", BUILD, TESTS.parent, *quick])
        path = os.pathsep.join([str(TESTS), *filter(None, [os.environ.get("PYTHONPATH")])])
        return subprocess.run(
            [sys.executable, "-m", module, *arguments],
            capture_output=True,
            text=True,
            env={**os.environ, "PYTHONPATH": path, "JOINTFRF_BENCHMARK_BUILD": str(BUILD), **(environment or {})},
            preexec_fn=(lambda: os.sched_setaffinity(0, cores)) if cores else None,
            timeout=900,
        )


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """One short run: (folder, what it printed, what it wrote)."""
    folder = tmp_path_factory.mktemp("speed")
    names = ("--operations", "invert,ismm,noise", "--orders", "2,3", "--lines", "64")
    peers = ("--peers", "eigen", "--eigen", str(folder))  # which holds none
    done = command("--quick", *names, *peers, "--budget", "0", "--output", str(folder))
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
def test_noise_is_compared_with_its_generator(result):
    run = result[2]
    limit = next(limit for limit in run["limits"] if limit["threads"] == 1)
    assert 1e5 < limit["normals"] < 1e11
    for r in run["records"]:
        drawn = r["n"] ** 2 if r["operation"] == "noise" else 0
        assert r["normals"] == drawn
        if r["threads"] == 1:
            assert r["limit"] >= 1e9 * drawn / limit["normals"] * (1 - 1e-9)


@pytest.mark.builds
def test_peers_that_are_not_there_are_left_out_with_a_line(result):
    folder, printed, run = result
    assert f"left out: eigen: no Eigen/Dense in {folder} (Debian: apt-get install libeigen3-dev)" in printed
    assert "Eigen" not in {r["candidate"] for r in run["records"]}
    assert not (folder / "peers.png").exists()


@pytest.mark.builds
@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="processes cannot be pinned here")
def test_a_pinned_process_has_one_thread_and_blas_chooses_its_kernels(tmp_path):
    one = {min(os.sched_getaffinity(0))}
    names = ("--operations", "noise", "--orders", "2", "--lines", "64", "--threads", "1,2", "--peers", "none")
    reported = {"OPENBLAS_CORETYPE": "Nehalem", "JOINTFRF_ENGINE": "plain"}
    done = command("--quick", *names, "--budget", "0", "--output", str(tmp_path), environment=reported, cores=one)
    assert done.returncode == 0, done.stdout + done.stderr
    run = json.loads((tmp_path / "speed.json").read_text())
    assert {r["threads"] for r in run["records"]} == {1}
    assert "left out: 2 threads: this process may run on 1 of" in done.stdout
    assert "2 threads" not in done.stdout.replace("left out: 2 threads", "")
    ask = "import numpy, threadpoolctl as t; print(*(i.get('architecture') for i in t.threadpool_info()))"
    free = {name: value for name, value in os.environ.items() if name != "OPENBLAS_CORETYPE"}
    own = subprocess.run([sys.executable, "-c", ask], env=free, capture_output=True, text=True, check=True)
    assert run["machine"]["blas"]["numpy"].split()[-1] == own.stdout.split()[0]


@pytest.mark.builds
def test_figure_is_a_png(result):
    assert (result[0] / "speed.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.builds
def test_what_became_slower_is_told(result, benchmarks, tmp_path):
    folder = result[0]
    same = benchmarks.results.load(folder / "speed.json")
    assert benchmarks.report.comparison(same, same)[1] is False
    run = json.loads((folder / "speed.json").read_text())  # a copy of its own
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
    benchmarks.report.write_document(run, document, "speed")
    text = document.read_text()
    assert text.startswith("before\n<!-- speed: begin -->\n")
    assert text.endswith("\n<!-- speed: end -->\nafter\n")
    assert "| `invert` | " in text
    assert "old" not in text
    document.write_text("no markers")
    with pytest.raises(ValueError, match="markers"):
        benchmarks.report.write_document(run, document, "speed")


@pytest.fixture
def run_of_peers(benchmarks):
    """A run whose times are known: jointfrf 10 n ns, numpy 40 n, Eigen 5 n up to n = 3 and wrong above, JAX 200 n."""
    times = {"jointfrf": 10.0, "numpy": 40.0, "Eigen": 5.0, "JAX": 200.0}
    records = [
        benchmarks.results.Record(
            name, "frf", False, n, 500, candidate, 1, 3 * each * n, each * n, 0.1, 1.0, 1.0, 1.0, (each * n,)
        )
        for name in ("invert", "solve_n") for n in (1, 2, 3, 6) for candidate, each in times.items()
        if candidate != "Eigen" or n <= 3
    ]  # fmt: skip
    machine = {"processor": "P", "engine": "plain", "load": [], "blas": {"numpy": "openblas 1 Zen"},
               "peers": {"Eigen": "Eigen 3", "JAX": "JAX 1", "torch": "torch 1"}}  # fmt: skip
    return benchmarks.results.Run("2026-01-02T00:00:00", machine, [], records)


def test_the_table_of_peers_is_written_between_its_own_markers(benchmarks, run_of_peers, tmp_path):
    document = tmp_path / "README.md"
    document.write_text(
        "<!-- speed: begin -->\nleft\n<!-- speed: end -->\n<!-- peers: begin -->\n<!-- peers: end -->\n"
    )
    said = benchmarks.report.write_document(run_of_peers, document, "peers")
    assert said == "wrote the table 'peers' of README.md"
    text = document.read_text()
    assert text.startswith("<!-- speed: begin -->\nleft\n")
    assert text.endswith("\n<!-- peers: end -->\n")
    rows = text.splitlines()
    at = rows.index("| | | n = 1 | 2 | 3 | 6 |")
    assert rows[at + 2 : at + 6] == [
        "| `invert` | jointfrf | 10 ns | 20 ns | 30 ns | 60 ns |",
        "| | numpy | 4.0× | 4.0× | 4.0× | 4.0× |",
        "| | Eigen | 0.5× | 0.5× | 0.5× |  |",
        "| | JAX | 20× | 20× | 20× | 20× |",
    ]
    assert "- Eigen: Eigen 3\n- JAX: JAX 1\n- BLAS of numpy: openblas 1 Zen\n" in text
    assert "torch" not in text
    none = replace(run_of_peers, records=[r for r in run_of_peers.records if r.candidate in ("jointfrf", "numpy")])
    assert "stays as it is" in benchmarks.report.write_document(none, document, "peers")
    assert document.read_text() == text


def test_the_figure_of_peers_is_drawn_where_there_are_any(benchmarks, run_of_peers, tmp_path):
    pytest.importorskip("matplotlib")
    from benchmarks.plot import draw_peers

    assert draw_peers(run_of_peers, tmp_path / "peers.png")
    assert (tmp_path / "peers.png").read_bytes().startswith(b"\x89PNG")
    none = replace(run_of_peers, records=[r for r in run_of_peers.records if r.candidate == "jointfrf"])
    assert not draw_peers(none, tmp_path / "none.png")
    assert not (tmp_path / "none.png").exists()


@pytest.mark.builds
@pytest.mark.long
@pytest.mark.parametrize("name", ["eigen", "mkl", "torch", "jax"])
def test_a_peer_that_is_there_gives_the_right_results_on_one_core(benchmarks, name, tmp_path):
    with benchmarks.peers.client.PeerProcess([name], [2, 3], tmp_path) as peers:
        if not peers.versions:
            pytest.skip(f"{name}: {' '.join(peers.left_out.values())}")
        assert set(peers.versions) <= set(benchmarks.peers.client.PEER_NAMES)
        for operation, kind in (("invert", "frf"), ("solve_1", "random"), ("solve_n", "frf"), ("ismm", "frf")):
            ways, first, faults = peers.candidates((operation, kind, False, 3), 200, 2)
            assert {way.name for way in ways} | set(faults) <= set(peers.versions)
            # Without row exchanges a result may be far off.
            assert set(faults) <= {"MKL compact"}
            timings = benchmarks.measure.time_interleaved(ways, first, 0.0, fewest=3)
            assert all(len(timing.samples) == 3 and min(timing.samples) > 0 for timing in timings)


def test_peers_whose_process_ends_are_left_out_from_then_on(benchmarks, monkeypatch, tmp_path):
    client = benchmarks.peers.client
    fake = tmp_path / "python"
    fake.write_text(
        '#!/bin/sh\necho \'{"peers": {"JAX": "1"}, "left_out": {}, "blas": {}}\'\nread request\n'
        "echo '{\"JAX\": 0.001}'\nread request\nexit 3\n"
    )
    fake.chmod(0o755)
    monkeypatch.setattr(client.sys, "executable", str(fake))
    with client.PeerProcess(["jax"], [2], tmp_path) as peers:
        ways, first, faults = peers.candidates(("invert", "frf", False, 2), 10, 1)
        assert (first, faults) == ([0.001], {})
        (timing,) = benchmarks.measure.time_interleaved(ways, first, 0.0, fewest=3)
        assert timing.samples == ()
        assert peers.left_out == {"JAX": "their process ended with status 3"}
        assert peers.candidates(("invert", "frf", False, 3), 10, 1) == ([], [], {})


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
    slow = replace(limits, normals=1e8)
    assert slow.seconds(0, 4, 1e9, 3) == pytest.approx(3e-8)
    assert slow.seconds(50, 4, 1e9, 3) == pytest.approx(5e-8)


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
    rows = [row.strip("| ").split(" | ") for row in done.stdout.splitlines() if row.startswith("| ")]
    counted = ["joint DOFs", "1", "3"]
    assert [row[0] for row in rows] == [*counted, *counted, "order", "2", "6"]
    assert rows[-1][1:] == [
        f"{records[1][name]:.0f}" for name in ("solve_work", "solve_line", "solve_sweep", "solve_zgesv")
    ]
    assert os.access(TESTS / "benchmarks" / "run-line-calls", os.X_OK)
