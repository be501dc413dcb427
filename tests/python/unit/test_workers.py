"""Processes that share work end with the process that started them, however that ends."""

import os
import signal
import subprocess
import sys
import time

import pytest

from jointfrf.cases.workers import started_workers

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
