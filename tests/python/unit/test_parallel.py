"""Tasks on executors: one thread each, a dead process costs no result, a broken executor is made again."""

import signal
import threading
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor

import pytest
from threadpoolctl import threadpool_info

import jointfrf as jf
from deadly_tasks import kill_this_process, note_each
from jointfrf.parallel.pool import (
    Pool,
    _SafeProcess,
    _uninterrupted,
    available_cores,
    one_thread,
    opened_pool,
    started_processes,
)


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
def test_a_process_that_dies_costs_no_result(tmp_path):
    """What was at work with it is done again, what was finished is not."""
    with opened_pool(jobs=2) as pool:
        first = pool.executor
        found = dict(pool.completed(note_each, ((tmp_path, task, task == 9) for task in range(20))))
        assert pool.executor is not first
        assert {task for _, task, _ in found} == set(range(20))
        begun = [len(list(tmp_path.glob(f"{task}-*"))) for task in range(20)]
        assert begun[9] == 2
        assert sum(begun) <= 20 + pool.at_once
        assert [result for _, result in pool.completed(abs, iter([-3]))] == [3]
        with pytest.raises(ZeroDivisionError):
            list(pool.completed((1).__truediv__, iter([0])))


@pytest.mark.long
@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="signals of POSIX")
def test_a_task_that_kills_every_process_is_said():
    with opened_pool(jobs=2) as pool, pytest.raises(jf.BrokenPoolError, match="have ended unexpectedly"):
        list(pool.completed(kill_this_process, iter(range(3))))


def test_workers_are_counted_as_each_package_calls_them():
    def workers_of(**attributes):
        executor = Executor()
        vars(executor).update(attributes)
        with opened_pool(executor) as pool:
            return pool.workers

    assert workers_of(_max_workers=3) == 3
    assert workers_of(num_workers=5) == 5
    assert workers_of() == available_cores()


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

    with opened_pool(Fragile()) as pool, pytest.raises(jf.BrokenPoolError, match="make the same call again"):
        do(pool)
    assert set(done) <= {0, 1}


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


@pytest.fixture
def usual_interrupts():
    """A shell starts what runs in its background with the signal ignored, and tests hand that on."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("usual_interrupts")
@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="Windows sends no signal to a thread")
def test_an_interrupt_that_another_thread_gets_waits_for_the_start():
    # As OpenBLAS's threads do: they were there before the signal was blocked here. What a thread sends itself has come
    # when it goes on.
    steps, may_send = [], threading.Event()

    def get_it():
        may_send.wait()
        signal.pthread_kill(threading.get_ident(), signal.SIGINT)

    other = threading.Thread(target=get_it, daemon=True)
    other.start()
    with pytest.raises(KeyboardInterrupt):  # noqa: PT012  # what follows the signal is what is tested
        with _uninterrupted():
            may_send.set()
            other.join()
            steps.append("written")
        steps.append("not interrupted")
    assert steps == ["written"]
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, ())


@pytest.mark.usefixtures("usual_interrupts")
@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="Windows sends no signal to a thread")
def test_an_interrupt_after_a_start_leaves_no_process_that_the_executor_does_not_know(monkeypatch):
    # Else it takes the sign to end that was meant for the other one, for which the executor then waits for ever.
    begin = _SafeProcess.start

    def start(process):
        begin(process)
        signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(_SafeProcess, "start", start)
    executor = started_processes(2)
    try:
        with pytest.raises(KeyboardInterrupt):
            executor.submit(abs, -1)
        assert len(executor._processes) == len(executor._started) == 1
    finally:
        executor.shutdown()
