"""Workers of loky killed at work: studies and sweeps end with the same numbers."""

import re
import signal
from contextlib import contextmanager
from functools import partial

import numpy as np
import pytest

import jointfrf as jf
from deadly_tasks import MARKS, deadly_estimator, deadly_inverse
from jointfrf.parallel.sweep import SweepCost
from studied_case import same

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals of POSIX"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning"),
]
N = 40
DESIGN = jf.StudyDesign({"lines": [20, 30]}, noises=["5 %"], estimators={"deadly": deadly_estimator})


@pytest.fixture(scope="module")
def marks(tmp_path_factory):
    """The folder in which processes leave their marks; processes started from now on know it."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("marks")
        patch.setenv(MARKS, str(folder))
        yield folder


@pytest.fixture
def deaths(marks):
    """Nobody has died yet; afterwards, whether somebody did."""
    for mark in marks.iterdir():
        mark.unlink()
    return lambda: (marks / "3").exists()


@pytest.fixture(scope="module")
def reference(marks, tmp_path_factory):
    for call in "123":
        (marks / call).touch()
    return jf.study("3.1", tmp_path_factory.mktemp("study"), N, design=DESIGN, jobs=1)


@contextmanager
def loky_executor():
    loky = pytest.importorskip("loky")
    executor = loky.ProcessPoolExecutor(2)
    try:
        yield executor
    finally:
        executor.shutdown(kill_workers=True)


def loky_maker():
    return partial(pytest.importorskip("loky").get_reusable_executor, max_workers=2, kill_workers=True)


def chunks(folder):
    return {(path.name, path.stat().st_mtime_ns) for path in (folder / "chunks").iterdir()}


@pytest.fixture
def lines():
    rng = np.random.default_rng(4)
    return rng.standard_normal((3000, 3, 3)) + 1j * rng.standard_normal((3000, 3, 3)) + 4 * np.eye(3)


def sweep_of(lines, out, marks, **how):
    """A sweep of six chunks."""
    plan = jf.SweepPlan("deadly", {}, len(lines), 512, 2, 288, SweepCost(1e-6, 1e-7, 1e-3))
    jf.sweep(partial(deadly_inverse, marks=marks), {"a": lines}, out, plan=plan, **how)


def test_a_study_on_loky_goes_on_with_other_processes(reference, deaths, tmp_path):
    found = jf.study("3.1", tmp_path, N, design=DESIGN, executor=loky_maker())
    assert deaths()
    assert found.missing == 0
    assert same(found, reference)


def test_a_study_on_loky_of_the_caller_stops_with_a_sentence_and_goes_on_without_loss(reference, deaths, tmp_path):
    with loky_executor() as executor, pytest.raises(jf.BrokenPoolError, match="make the same call again") as raised:
        jf.study("3.1", tmp_path, N, design=DESIGN, executor=executor)
    assert deaths()
    assert "\n" not in str(raised.value)
    kept = chunks(tmp_path)
    with loky_executor() as executor:
        found = jf.study("3.1", tmp_path, N, design=DESIGN, executor=executor)
    assert kept <= chunks(tmp_path)
    assert same(found, reference)


def test_a_sweep_on_loky_goes_on_with_other_processes(lines, marks, deaths, tmp_path):
    result = np.memmap(tmp_path / "out", complex, "w+", shape=lines.shape)
    sweep_of(lines, result, marks, executor=loky_maker())
    assert deaths()
    assert (result == jf.invert(lines)).all()


def test_a_sweep_on_loky_of_the_caller_says_where_to_go_on(lines, marks, deaths):
    result = np.zeros(lines.shape, complex)
    with loky_executor() as executor, pytest.raises(jf.BrokenPoolError, match=r"first=\d+") as raised:
        sweep_of(lines, result, marks, executor=executor)
    assert deaths()
    first = int(re.search(r"first=(\d+)", str(raised.value))[1])
    assert (result[:first] == jf.invert(lines)[:first]).all()
    result[first:] = 0
    sweep_of(lines, result, marks, jobs=1, first=first)
    assert (result == jf.invert(lines)).all()
