"""Processes that share work end with the process that started them, however that ends."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.cases.workers import started_workers
from jointfrf.parallel.pool import opened_pool
from jointfrf.parallel.processes import SeparateProcesses, can_start_processes

_PARENT = """
import os, sys, time
from jointfrf.cases.workers import started_workers

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
from jointfrf.cases.workers import started_workers
from jointfrf.parallel.processes import SeparateProcesses

if __name__ == "__main__":
    with started_workers(2) as workers:
        assert list(workers.map(abs, range(-5, 0))) == [5, 4, 3, 2, 1]
    with SeparateProcesses(1) as pool:
        assert pool.submit(abs, -3).result() == 3
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
    with pytest.raises(
        ValueError, match=r"no other process can be started: .* say jobs=1, give an executor of threads"
    ):
        SeparateProcesses(2)
    with pytest.raises(ValueError, match="no other process can be started"), started_workers(2):
        pass
    with opened_pool(None, None) as pool:
        assert not isinstance(pool.executor, SeparateProcesses)
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
