"""Processes that share work end with the process that started them, however that ends."""

import os
import signal
import subprocess
import sys
import time
from collections import deque
from concurrent.futures import CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from threading import Event, Lock, Thread

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.parallel.pool import can_start_processes, opened_pool, started_processes
from jointfrf.workbench.cases.workers import RankedProcesses, Workers, started_workers

_PARENT = """
import os, sys, time
from jointfrf.workbench.cases.workers import started_workers

def nap(seconds):
    time.sleep(seconds)
    return os.getpid()

if __name__ == "__main__":
    with started_workers(2) as workers:
        found = set()
        while len(found) < 2:
            found |= set(workers.map(nap, [0.2] * 4))
        print(*found, flush=True)
        list(workers.map(nap, [600, 600]))
"""


def is_running(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_results_come_in_order():
    with started_workers(2) as workers:
        assert list(workers.map(abs, range(-5, 0))) == [5, 4, 3, 2, 1]


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_killed_parent_leaves_no_process(tmp_path):
    script = tmp_path / "parent.py"
    script.write_text(_PARENT)
    with subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, text=True) as parent:
        pids = [int(word) for word in parent.stdout.readline().split()]
        assert len(pids) == 2
        parent.send_signal(signal.SIGKILL)
    for _ in range(9000):
        if not any(map(is_running, pids)):
            return
        time.sleep(0.1)
    pytest.fail(f"processes {pids} outlive the process that started them")


_IN_A_FOLDER = """
import sys
from jointfrf.workbench.cases.workers import started_workers
from jointfrf.parallel.pool import opened_pool

if __name__ == "__main__":
    with started_workers(2) as workers:
        assert list(workers.map(abs, range(-5, 0))) == [5, 4, 3, 2, 1]
    with opened_pool(jobs=2) as pool:
        assert list(pool.completed(abs, iter([-3]))) == [(-3, 3)]
"""


def test_workers_run_no_module_of_the_working_directory(tmp_path):
    """Each process began with the modules beside the files that it worked on."""
    script, folder = tmp_path / "parent.py", tmp_path / "stranger"
    script.write_text(_IN_A_FOLDER)
    folder.mkdir()
    for name in ("numpy", "multiprocessing", "signal", "struct", "jointfrf", "_posixshmem", "socket"):
        (folder / f"{name}.py").write_text("open('ran', 'a').write(__name__)\nraise SystemExit\n")
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONSAFEPATH"}
    done = subprocess.run([sys.executable, script], cwd=folder, env=environment, stderr=subprocess.PIPE, text=True)
    assert not (folder / "ran").exists(), (folder / "ran").read_text()
    assert done.returncode == 0, done.stderr


def test_the_environment_is_as_it_was(monkeypatch):
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    before = dict(os.environ)
    with started_workers(2) as workers:
        assert list(workers.map(os.getenv, ["PYTHONSAFEPATH", "OMP_NUM_THREADS"])) == ["1", "1"]
        assert os.environ == before
    assert os.environ == before


@pytest.mark.parametrize("name", ["", None, "/bin/sh"])
def test_a_program_of_which_python_is_a_part_is_not_started_again(monkeypatch, name):
    """`sys.executable` is empty there, or names the program, which would run again for each worker."""
    if name == "/bin/sh" and not os.path.exists("/proc/self/exe"):
        pytest.skip("the system does not tell which program runs")
    monkeypatch.setattr(sys, "executable", name)
    monkeypatch.setattr("multiprocessing.spawn._python_exe", None if name is None else os.fsencode(name))
    monkeypatch.setattr(subprocess, "Popen", None)
    monkeypatch.setattr("multiprocessing.util.spawnv_passfds", None)
    assert not can_start_processes()
    with pytest.raises(ValueError, match=r"no process can be started: .* set jobs=1, give an executor of threads"):
        started_processes(2)
    with pytest.raises(ValueError, match="no process can be started"), started_workers(2):
        pass
    with opened_pool(None, None) as pool:
        assert not isinstance(pool.executor, ProcessPoolExecutor)
    a = np.arange(1.0, 4.0).reshape(-1, 1, 1)
    found = np.empty(a.shape, complex)
    jf.sweep(jf.invert, {"a": a}, found)
    np.testing.assert_allclose(found, 1 / a)


def test_a_python_that_the_host_names_is_started(monkeypatch):
    monkeypatch.setattr(sys, "executable", "/bin/sh")
    assert can_start_processes()


def test_python_m_jointfrf_runs_no_module_of_the_working_directory(tmp_path):
    (tmp_path / "json.py").write_text("open('ran', 'w')\n")
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONSAFEPATH"}
    done = subprocess.run(
        [sys.executable, "-m", "jointfrf", "cases"], cwd=tmp_path, env=environment, capture_output=True
    )
    assert done.returncode == 0, done.stderr
    assert not (tmp_path / "ran").exists()


def until(path):
    """Words of a call that ends when there is such a file."""
    return subprocess.call, ["sh", "-c", 'until [ -e "$0" ]; do sleep 0.05; done', str(path)]


def test_tasks_of_the_lowest_rank_are_done_first(tmp_path):
    processes, done = RankedProcesses(1), []
    try:
        futures = [processes.submit(5, *until(tmp_path / "go")), *(processes.submit(5, abs, -i) for i in (1, 2, 3))]
        futures += [processes.submit(0, abs, -4), processes.submit(7, abs, -6), processes.submit(5, abs, -5)]
        for future in futures:
            future.add_done_callback(lambda one: done.append(one.result()))
        (tmp_path / "go").touch()
        wait(futures)
    finally:
        processes.shutdown()
    assert done == [0, 1, 4, 2, 3, 5, 6]  # two were handed out when the others came


def test_errors_of_tasks_and_lost_processes_are_raised_where_results_are_read():
    processes = RankedProcesses(1)
    try:
        with pytest.raises(ValueError, match="invalid literal"):
            processes.submit(0, int, "x").result()
        assert processes.submit(0, int, "7").result() == 7
        lost = [processes.submit(0, os._exit, 1), *(processes.submit(0, abs, -1) for _ in range(5))]
        for future in lost:
            assert isinstance(future.exception(), BrokenProcessPool)
    finally:
        processes.shutdown()
    assert isinstance(processes.submit(0, abs, -1).exception(), RuntimeError)


def test_tasks_that_wait_are_cancelled_where_the_processes_are_shut_down(tmp_path):
    processes = RankedProcesses(1)
    at_work = processes.submit(0, *until(tmp_path / "go"))
    waiting = [processes.submit(0, abs, -1) for _ in range(6)]
    ending = Thread(target=processes.shutdown)
    ending.start()
    with pytest.raises(CancelledError):
        waiting[-1].result()
    (tmp_path / "go").touch()
    ending.join()
    assert at_work.result() == 0
    assert wait(waiting).not_done == set()


def test_a_thread_that_waits_for_processes_lets_another_compute(tmp_path):
    turn, found = Lock(), []
    with started_workers(2) as workers:
        at_work = replace(workers, turn=turn)
        has_begun = Event()

        def compute():
            with turn:
                results = at_work.map(*([one] if i else one for i, one in enumerate(until(tmp_path / "go"))))
                has_begun.set()
                found.append(next(results))

        thread = Thread(target=compute)
        thread.start()
        has_begun.wait()
        with turn:  # while the thread waits
            assert found == []
            (tmp_path / "go").touch()
        thread.join()
        assert found == [0]
        assert not turn.locked()


@pytest.mark.parametrize("jobs", [1, 2])
def test_what_is_begun_is_there_when_it_is_asked_for(jobs):
    with started_workers(jobs) as workers:
        assert [one() for one in [workers.begin(divmod, i, 3) for i in range(4)]] == [(0, 0), (0, 1), (0, 2), (1, 0)]


def test_what_nobody_waits_for_any_longer_is_not_computed():
    futures = [Future() for _ in range(3)]
    futures[0].set_result(1)
    results = Workers()._results(deque(futures))
    assert next(results) == 1
    results.close()
    assert [one.cancelled() for one in futures] == [False, True, True]
