"""Processes made by fork(), as multiprocessing makes them by default on Linux, after a call with several threads."""

import multiprocessing
import os
import subprocess
import sys

import pytest

_SCRIPT = """
import multiprocessing
import numpy as np
import jointfrf as jf

a = np.random.default_rng(0).standard_normal((4000, 12, 12)) + 4j * np.eye(12)
expected = jf.invert(a)  # on several threads

def differs(_):
    return bool((jf.invert(a) != expected).any())

with multiprocessing.get_context("fork").Pool(2) as pool:
    print(pool.map(differs, range(3)))
"""


@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="no fork() on this system")
def test_a_forked_process_computes():
    environment = os.environ | {"OMP_NUM_THREADS": "2"}
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT], capture_output=True, text=True, timeout=900, check=True, env=environment
    )
    assert done.stdout.strip() == "[False, False, False]", done.stderr
