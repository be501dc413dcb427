"""Sweeps in chunks over executors: the bits of one call, from files of several formats, planned by their cost."""

import time
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from functools import partial
from unittest.mock import patch

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.parallel.sweep import SweepCost, planned_sweep

N = 2600
COST = SweepCost(1e-6, 1e-7, 1e-3)


@pytest.fixture
def lines():
    rng = np.random.default_rng(4)
    return rng.standard_normal((N, 3, 3)) + 1j * rng.standard_normal((N, 3, 3)) + 4 * np.eye(3)


def plan_of(chunk_lines, n_lines=N, workers=2):
    return jf.SweepPlan("invert", {}, n_lines, chunk_lines, workers, 288, COST)


def mapped(path, values):
    found = np.memmap(path, values.dtype, "w+", shape=values.shape)
    found[:] = values
    found.flush()
    return found


@pytest.fixture
def one_call(lines, threads):
    return jf.invert(lines)


def test_bits_are_those_of_one_call_whatever_the_chunks(lines, one_call, tmp_path):
    source = mapped(tmp_path / "a", np.concatenate([lines[:5], lines]))[5:]
    result = np.memmap(tmp_path / "out", complex, "w+", shape=lines.shape)
    with ThreadPoolExecutor(3) as executor:
        for how in ({"jobs": 1}, {"executor": executor}):
            for chunk in (512, 1024, 4096):
                result[:] = 0
                jf.sweep(jf.invert, {"a": source}, result, plan=plan_of(chunk), **how)
                assert (result == one_call).all()


def test_processes_write_a_memory_map_in_its_place(lines, one_call, tmp_path):
    source = mapped(tmp_path / "a", lines)
    result = np.memmap(tmp_path / "out", complex, "w+", shape=lines.shape)
    seen = []
    used = jf.sweep(jf.invert, {"a": source}, result, jobs=2, progress=lambda *done: seen.append(done))
    assert (np.fromfile(tmp_path / "out", complex).reshape(lines.shape) == one_call).all()
    assert seen[-1] == (N, N)
    assert used.workers == 2
    assert used.n_tasks == len(seen)


def test_a_sweep_begins_where_it_is_told(lines, one_call):
    result = np.zeros(lines.shape, complex)
    seen = []
    jf.sweep(jf.invert, {"a": lines}, result, plan=plan_of(512), jobs=1, first=1024, progress=lambda *n: seen.append(n))
    assert not result[:1024].any()
    assert (result[1024:] == one_call[1024:]).all()
    assert [done for done, _ in seen] == [1536, 2048, 2560, N]
    for first in (-512, 100, 5120):
        with pytest.raises(ValueError, match=f"first must be a multiple of 512 from 0 to {N - 1}, not {first}"):
            jf.sweep(jf.invert, {"a": lines}, result, plan=plan_of(512), jobs=1, first=first)
    with pytest.raises(TypeError, match=r"first must be a whole number, not 1.5"):
        jf.sweep(jf.invert, {"a": lines}, result, plan=plan_of(512), jobs=1, first=1.5)


class LosesAll(ThreadPoolExecutor):
    """Does the first and third task, and loses its workers."""

    def __init__(self):
        super().__init__(1)
        self.asked = 0

    def submit(self, fn, /, *args, **kwargs):
        self.asked += 1
        if self.asked in (1, 3):
            return super().submit(fn, *args, **kwargs)
        lost = Future()
        if self.asked == 2:
            super().submit(time.sleep, 0.3).add_done_callback(lambda _: lost.set_exception(CancelledError()))
        return lost


def test_a_sweep_that_lost_its_workers_says_where_to_go_on(lines, one_call):
    result = np.zeros(lines.shape, complex)
    with (
        LosesAll() as executor,
        pytest.raises(jf.BrokenPoolError, match=r"lines 0 to 511 of out .*call sweep\(..., first=512\)"),
    ):
        jf.sweep(jf.invert, {"a": lines}, result, plan=plan_of(512), executor=executor, jobs=2)
    assert (result[:512] == one_call[:512]).all()
    jf.sweep(jf.invert, {"a": lines}, result, plan=plan_of(512), jobs=1, first=512)
    assert (result == one_call).all()


def test_several_arrays_and_what_is_the_same_for_all_lines(lines):
    coupled = partial(jf.couple, dofs_a=[0], dofs_b=[1])
    k = np.full((N, 1, 1), 5.0 + 1j)
    result = np.empty((N, 6, 6), complex)
    jf.sweep(coupled, {"h_a": lines, "h_b": 2 * lines, "k_joint": k}, result, plan=plan_of(512), jobs=1)
    assert (result == coupled(h_a=lines, h_b=2 * lines, k_joint=k)).all()


def test_hdf5_datasets(lines, one_call, tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["a"] = lines
    with h5py.File(tmp_path / "a.h5", "r") as file, h5py.File(tmp_path / "out.h5", "w") as target:
        result = target.create_dataset("out", lines.shape, complex)
        jf.sweep(jf.invert, {"a": file["a"]}, result, plan=plan_of(512), jobs=1)
        assert (result[:] == one_call).all()


def test_a_singular_line_is_named_by_its_number_in_the_sweep(lines):
    lines[1300] = 0
    result = np.empty_like(lines)
    for how in ({"jobs": 1}, {"jobs": 2}):
        with pytest.raises(jf.SingularLineError, match="counted from line 1024") as caught:
            jf.sweep(jf.invert, {"a": lines}, result, plan=plan_of(512), **how)
        assert caught.value.lines.tolist() == [1300]
    jf.sweep(partial(jf.invert, on_singular="nan"), {"a": lines}, result, plan=plan_of(512), jobs=1)
    assert np.isnan(result).any(axis=(1, 2)).nonzero()[0].tolist() == [1300]


def test_ill_conditioned_lines_are_told_once(lines):
    lines[600:1300] = np.diag([1.0, 1e-15, 1.0])
    with pytest.warns(
        jf.IllConditionedWarning, match="counted from line 512; 1 other chunks have such lines, too"
    ) as reported:
        jf.sweep(jf.invert, {"a": lines}, np.empty_like(lines), plan=plan_of(512), jobs=1)
    assert len(reported) == 1


def test_what_does_not_fit_is_said_before_anything_is_computed(lines, tmp_path):
    source = mapped(tmp_path / "a", lines)
    with pytest.raises(ValueError, match="out shares its memory or file with a"):
        jf.sweep(jf.invert, {"a": source}, np.memmap(tmp_path / "a", complex, "r+", shape=lines.shape))
    with pytest.raises(ValueError, match="out shares its memory or file with a"):
        jf.sweep(jf.invert, {"a": lines}, lines)
    with pytest.raises(ValueError, match="a has 2600 lines and out 5"):
        jf.sweep(jf.invert, {"a": lines}, lines[:5].copy())
    with pytest.raises(ValueError, match=r"out must have the shape \(2600, 3, 3\), not \(2600, 2, 2\)"):
        jf.plan_sweep(jf.invert, {"a": lines}, np.empty((N, 2, 2), complex), jobs=1)
    with pytest.raises(ValueError, match="is open for reading only; open it"):
        jf.sweep(jf.invert, {"a": lines}, np.memmap(tmp_path / "a", complex, "r", shape=lines.shape))
    with pytest.raises(TypeError, match="give an array that results can be written into"):
        jf.sweep(jf.invert, {"a": lines}, (1, 2))
    with pytest.raises(TypeError, match="out is a list; give an array"):
        jf.sweep(jf.invert, {"a": lines}, lines.tolist())  # a copy would take the results
    masked = np.ma.masked_where(abs(lines) > np.median(abs(lines)), lines)
    with pytest.raises(ValueError, match="a has masked entries"):
        jf.sweep(jf.invert, {"a": masked}, np.empty_like(lines))
    with pytest.raises(ValueError, match="out has masked entries"):
        jf.sweep(jf.invert, {"a": lines}, masked)
    with pytest.raises(TypeError, match="arrays must map names"):
        jf.sweep(jf.invert, [lines], np.empty_like(lines))
    with pytest.raises(TypeError, match="operation must be a function"):
        jf.sweep("invert", {"a": lines}, np.empty_like(lines))
    with pytest.raises(ValueError, match="plan is of 7 lines"):
        jf.sweep(jf.invert, {"a": lines}, np.empty_like(lines), plan=plan_of(512, 7), jobs=1)


def test_chunks_follow_from_the_cost():
    def planned(cost, n_lines=10**8, workers=2):
        return planned_sweep("invert", {"a": (n_lines, 2, 2), "out": (n_lines, 2, 2)}, n_lines, workers, cost)

    cheap = planned(SweepCost(1e-7, 0.0, 1e-4))
    assert cheap.chunk_lines % 512 == 0
    # an expensive task is outweighed by its lines: 50 ms a task at 0.1 us a line need more memory than there is
    dear = planned(SweepCost(1e-7, 0.0, 5e-2))
    assert dear.chunk_lines == 2**26 // dear.line_bytes
    assert planned(SweepCost(1e-5, 0.0, 5e-3)).chunk_lines * 1e-5 * 1.01 >= 5e-3 * 50
    # every worker has tasks
    assert planned(SweepCost(1e-5, 0.0, 1.0), 10**5, 8).n_tasks >= 3 * 8
    assert dear.seconds == pytest.approx(10**8 * 1e-7 / 2 + dear.n_tasks / 2 * 5e-2, rel=0.01)
    assert [lines.stop - lines.start for lines in plan_of(1024).chunks()] == [1024, 1024, N - 2048]


def test_hundred_million_lines_are_planned_on_a_few_of_them(tmp_path):
    shape = (10**8, 1, 1)
    source = np.memmap(tmp_path / "a", complex, "w+", shape=shape)  # a file with holes: 1.6 GB that take no place
    source[:8192] = 2.0
    result = np.memmap(tmp_path / "out", complex, "w+", shape=shape)
    plan = jf.plan_sweep(partial(jf.invert, on_singular="nan"), {"a": source}, result, jobs=1)
    assert not result[:8192].any()
    assert plan.n_lines == 10**8
    assert plan.n_tasks * plan.chunk_lines >= 10**8
    assert plan.task_bytes <= 64 * 2**20
    assert 0.1 < plan.seconds < 10**4
    text = str(plan)
    assert text.startswith("invert: 100,000,000 lines (a 1 x 1, out 1 x 1), 2.98 GiB\nmeasured: ")
    assert f"{plan.n_tasks} tasks of {plan.chunk_lines:,} lines" in text


def test_the_cost_of_a_line_is_the_difference_of_few_and_many(lines):
    """A clock that runs by the lines read: 3 us each and 1 ms a call."""
    now, whole = [0.0], np.tile(lines, (2, 1, 1))

    def operation(a):
        now[0] += 1e-3 + 3e-6 * len(a)
        return jf.invert(a)

    with patch("jointfrf.parallel.sweep.perf_counter", lambda: now[0]):
        plan = jf.plan_sweep(operation, {"a": whole}, np.empty_like(whole), jobs=1)
    assert plan.cost.line == pytest.approx(3e-6)
