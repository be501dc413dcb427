"""Tasks on executors: one thread each, a dead process costs its task only, a broken executor is made again."""

import signal
import threading
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from types import SimpleNamespace

import pytest
from threadpoolctl import threadpool_info

import jointfrf as jf
from deadly_tasks import kill_this_process, note
from jointfrf.parallel.cores import available_cores
from jointfrf.parallel.one_thread import one_thread
from jointfrf.parallel.pool import Pool, opened_pool


def numbers_of_threads() -> dict[str, int]:
    """Library to its number of threads in this thread."""
    assert jf.invert is not None  # the kernel and its libraries are loaded
    return {one["filepath"]: one["num_threads"] for one in threadpool_info()}


def most_threads() -> int:
    return max(numbers_of_threads().values())


def test_one_thread_inside_and_the_number_before_afterwards():
    before = numbers_of_threads()
    with one_thread():
        assert most_threads() == 1
        with one_thread():
            assert most_threads() == 1
        assert most_threads() == 1
    assert numbers_of_threads() == before


def test_tasks_that_overlap_in_threads_stay_on_one_thread():
    begun, ended, seen = threading.Event(), threading.Event(), []

    def first():
        with one_thread():
            begun.wait(10)

    def second():
        with one_thread():
            begun.set()
            ended.wait(10)
            seen.append(most_threads())

    before = numbers_of_threads()
    tasks = [threading.Thread(target=task) for task in (first, second)]
    for task in tasks:
        task.start()
    tasks[0].join()
    ended.set()
    tasks[1].join()
    assert seen == [1]
    assert numbers_of_threads() == before


@pytest.mark.long
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals of POSIX")
def test_a_process_that_dies_costs_its_task_only(tmp_path):
    with jf.SeparateProcesses(2) as pool:
        futures = [pool.submit(note, tmp_path, task, task == 2) for task in range(6)]
        found = [future.result() for future in futures]
        assert len(set(found)) in (2, 3)
        begun = [len(list(tmp_path.glob(f"{task}-*"))) for task in range(6)]
        assert begun == [1, 1, 2, 1, 1, 1]
        with pytest.raises(BrokenProcessPool):
            pool.submit(kill_this_process).result()
        assert pool.submit(abs, -3).result() == 3
        with pytest.raises(ZeroDivisionError):
            pool.submit(divmod, 1, 0).result()
    with pytest.raises(RuntimeError, match="shut down"):
        pool.submit(abs, 1)


def test_workers_are_counted_as_each_package_calls_them():
    def workers_of(**attributes):
        executor = Executor()
        vars(executor).update(attributes)
        with opened_pool(executor) as pool:
            return pool.workers

    assert workers_of(_max_workers=3) == 3
    assert workers_of(num_workers=5) == 5
    dask = SimpleNamespace(ncores=lambda: {"tcp://a": 300, "tcp://b": 400})
    assert workers_of(_client=dask) == 700
    assert workers_of(_client=SimpleNamespace(ncores=dict)) == 1  # none has come yet
    assert workers_of() == workers_of(_client=object()) == available_cores()


class Fragile(ThreadPoolExecutor):
    """Breaks at its third task, and with it those that wait."""

    made = 0

    def __init__(self):
        super().__init__(1)
        type(self).made += 1
        self.begun = 0

    def submit(self, fn, /, *args, **kwargs):
        self.begun += 1
        if self.begun < 3:
            return super().submit(fn, *args, **kwargs)
        broken = Future()
        broken.set_exception(BrokenExecutor("gone"))
        return broken


def test_a_broken_executor_is_made_again():
    Fragile.made = 0
    with opened_pool(Fragile) as pool:
        found = sorted(pool.completed(abs, iter(range(-7, 0))))
    assert found == [(-i, i) for i in range(7, 0, -1)]
    assert Fragile.made >= 3


def test_a_broken_executor_of_the_caller_is_said():
    done = []

    def do(pool):
        done.extend(task for task, _ in pool.completed(abs, iter(range(9))))

    with opened_pool(Fragile()) as pool, pytest.raises(jf.BrokenPoolError, match="the same call continues"):
        do(pool)
    assert set(done) <= {0, 1}


@pytest.mark.parametrize("name", ["KilledWorker", "ClosedClientError"])
def test_what_dask_says_of_lost_workers_is_said_alike(name):
    error = type(name, (Exception,), {"__module__": "distributed.scheduler"})

    class Lost(Fragile):
        def submit(self, fn, /, *args, **kwargs):
            future = super().submit(fn, *args, **kwargs)
            if self.begun == 2:
                raise error("first sentence. Second.")
            return future

    with opened_pool(Lost()) as pool, pytest.raises(jf.BrokenPoolError, match="the same call continues"):
        list(pool.completed(abs, iter(range(3))))
    with opened_pool(Lost) as pool:
        assert sorted(pool.completed(abs, iter(range(3)))) == [(0, 0), (1, 1), (2, 2)]


def test_what_an_executor_refuses_is_said_as_it_is():
    class Closed(Fragile):
        def submit(self, fn, /, *args, **kwargs):
            raise PermissionError("the queue is closed to you")

    with pytest.raises(PermissionError, match="the queue is closed to you"), opened_pool(Closed()) as pool:
        list(pool.completed(abs, iter(range(3))))


def test_an_executor_that_breaks_at_once_is_not_made_forever():
    class Dead(Fragile):
        def submit(self, fn, /, *args, **kwargs):
            raise BrokenExecutor("dead from the start")

    with pytest.raises((jf.BrokenPoolError, BrokenExecutor)), opened_pool(Dead) as pool:
        list(pool.completed(abs, iter(range(3))))


def test_few_tasks_are_submitted_at_the_same_time():
    asked = 0

    def tasks():
        nonlocal asked
        for number in range(100):
            asked += 1
            yield number

    with ThreadPoolExecutor(2) as executor:
        for done, _ in enumerate(Pool(executor, 2).completed(abs, tasks()), 1):
            assert asked <= done + 2 * 2
    assert asked == 100
