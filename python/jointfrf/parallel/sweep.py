"""Lines of one large sweep, distributed to the workers of an executor; results are written to their places."""

from __future__ import annotations

import math
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from statistics import median
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from jointfrf.errors import IllConditionedWarning, SingularLineError
from jointfrf.kernel.arguments import CHUNK_BYTES, as_integer, check_type
from jointfrf.parallel.line_arrays import Lines, lines_of
from jointfrf.parallel.pool import AnyExecutor, BrokenPoolError, Pool, check_progress, one_thread, opened_pool

__all__ = ["SweepCost", "SweepPlan", "plan_sweep", "planned_sweep", "sweep"]

#: Number of lines in one share of the kernel: chunks are multiples of it, so that they change no bit of a result.
_SHARE = 512
#: Share of its time that sending may cost a task: negligible.
_OVERHEAD = 0.02
#: Bytes of a task if its time allows: larger ones are not faster.
_USUAL_BYTES = 8 * 2**20
#: Least number of tasks for each worker: workers then end within a quarter of their time.
_TASKS = 4
#: Numbers of lines of two measurements, whose difference in time does not contain the cost of a call.
_SAMPLES = (512, 8192)
#: Number of empty tasks for each worker, and of places whose median is used, so that one disturbance has no effect.
_EMPTY, _REPEATED = 4, 3
#: An operation, line by line: takes arrays by name, and returns the result.
LineFunction = Callable[..., NDArray[Any]]


@dataclass(frozen=True)
class SweepCost:
    """Measured times of a sweep.

    Attributes
    ----------
    line : float
        Time of one worker for a line, s: reading and computing.
    write : float
        Time for writing a line, s.
    task : float
        Time for an empty task, s: sending it, and its answer.
    """

    line: float
    write: float
    task: float


@dataclass(frozen=True)
class SweepPlan:
    """Division of a sweep into tasks, and its expected time.

    Attributes
    ----------
    operation : str
        Name of the operation.
    shapes : mapping of str to tuple
        Shapes of the inputs and of the result.
    n_lines, chunk_lines : int
        Numbers of lines in all, and of a task.
    workers : int
        Number of workers.
    line_bytes : int
        Bytes of a line of all inputs and the result.
    cost : SweepCost
        Measured times.
    """

    operation: str
    shapes: dict[str, tuple[int, ...]]
    n_lines: int
    chunk_lines: int
    workers: int
    line_bytes: int
    cost: SweepCost

    @property
    def n_tasks(self) -> int:
        """Number of tasks."""
        return math.ceil(self.n_lines / self.chunk_lines)

    @property
    def seconds(self) -> float:
        """Expected time, s: whole rounds of tasks on all workers."""
        each = min(self.chunk_lines, self.n_lines) * (self.cost.line + self.cost.write) + self.cost.task
        return math.ceil(self.n_tasks / self.workers) * each

    @property
    def task_bytes(self) -> int:
        """Memory of a task, bytes: its lines of all inputs and of the result."""
        return min(self.chunk_lines, self.n_lines) * self.line_bytes

    def chunks(self, first: int = 0) -> Iterator[slice]:
        """Yield the lines of each task, from a line on."""
        for start in range(first, self.n_lines, self.chunk_lines):
            yield slice(start, min(start + self.chunk_lines, self.n_lines))

    def __str__(self) -> str:
        """Return a description of the plan."""
        orders = {name: " x ".join(map(str, shape[1:])) or "scalar" for name, shape in self.shapes.items()}
        shapes = ", ".join(f"{name} {order}" for name, order in orders.items())
        cost = self.cost
        return (
            f"{self.operation}: {self.n_lines:,} lines ({shapes}), {self.n_lines * self.line_bytes / 2**30:.3g} GiB\n"
            f"measured: {1e6 * cost.line:.3g} us a line read and computed, {1e6 * cost.write:.3g} us written, "
            f"{1e3 * cost.task:.3g} ms a task\n"
            f"{self.n_tasks} tasks of {self.chunk_lines:,} lines, {self.task_bytes / 2**20:.3g} MiB each, on "
            f"{self.workers} worker{'s' * (self.workers > 1)}: about {_duration(self.seconds)}"
        )


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.2g} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def planned_sweep(
    operation: str, shapes: dict[str, tuple[int, ...]], n_lines: int, workers: int, cost: SweepCost
) -> SweepPlan:
    """Return the plan of a sweep with the number of lines of a task.

    Parameters
    ----------
    operation : str
        Name of the operation.
    shapes : dict of str to tuple
        Shapes of inputs and result.
    n_lines, workers : int
        Numbers of lines and workers.
    cost : SweepCost
        Measured times.

    Notes
    -----
    A task takes at least 50 times the cost of sending it, unless it would need more memory than 64 MiB or leave workers
    without a task. Tasks are multiples of 512 lines, whose results do not depend on neighbouring lines.
    """
    line_bytes = sum(16 * math.prod(shape[1:]) for shape in shapes.values())
    lines = cost.task / _OVERHEAD / max(cost.line + cost.write, 1e-12)
    # Larger tasks lose nothing either, if all workers have some and their memory is small.
    lines = min(max(lines, _USUAL_BYTES / line_bytes), CHUNK_BYTES / line_bytes, n_lines / (_TASKS * workers))
    return SweepPlan(operation, shapes, n_lines, max(1, round(lines / _SHARE)) * _SHARE, workers, line_bytes, cost)


@dataclass(frozen=True)
class _SweepTask:
    """Some lines: their inputs, and the place of the result, None if it is sent back."""

    operation: LineFunction
    inputs: Mapping[str, Lines]
    result: Lines | None
    lines: slice


class _Done(NamedTuple):
    """Outcome of a task: its result if it is not written yet, a warning, and seconds."""

    values: NDArray[Any] | None
    warning: str
    seconds: float


def _do(task: _SweepTask) -> _Done:
    """Run a task on one thread."""
    with one_thread(), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", IllConditionedWarning)
        start = perf_counter()
        arrays = {name: own.read(task.lines) for name, own in task.inputs.items()}
        try:
            values = np.asarray(task.operation(**arrays))
        except SingularLineError as error:
            lines = error.lines + task.lines.start
            raise SingularLineError(f"{error} counted from line {task.lines.start}", lines, error.freq_hz) from error
        except (ValueError, ArithmeticError) as error:
            raise type(error)(f"lines {task.lines.start} to {task.lines.stop - 1}: {error}") from error
        if task.result is not None:
            task.result.write(task.lines, values)
        seconds = perf_counter() - start
    texts = [str(one.message) for one in caught if issubclass(one.category, IllConditionedWarning)]
    return _Done(None if task.result is not None else values, texts[0] if texts else "", seconds)


def _nothing(_: int) -> None:
    pass


@dataclass(frozen=True)
class _Sweep:
    """An operation with its checked arrays."""

    operation: LineFunction
    inputs: dict[str, Lines]
    out: Lines

    @property
    def name(self) -> str:
        whole = self.operation.func if isinstance(self.operation, partial) else self.operation
        return str(getattr(whole, "__name__", type(whole).__name__))

    @property
    def n_lines(self) -> int:
        return self.out.shape[0]

    def task(self, lines: slice, *, is_written: bool = True) -> _SweepTask:
        """Return the task of some lines."""
        result = self.out if is_written and self.out.is_written_by_tasks else None
        return _SweepTask(self.operation, {name: own.of(lines) for name, own in self.inputs.items()}, result, lines)


class _Finished:
    """Completed lines: all before `end`, and chunks beyond it."""

    def __init__(self, first: int) -> None:
        self.count = self.end = first
        self._beyond: dict[int, int] = {}

    def add(self, lines: slice) -> None:
        self.count += lines.stop - lines.start
        self._beyond[lines.start] = lines.stop
        while self.end in self._beyond:
            self.end = self._beyond.pop(self.end)

    def __str__(self) -> str:
        return f"lines 0 to {self.end - 1} of out are written" if self.end else "no lines of out are complete"


def _checked(operation: LineFunction, arrays: Mapping[str, ArrayLike], out: Any) -> _Sweep:
    if not callable(operation):
        raise TypeError(f"operation must be a function such as jointfrf.invert, not {type(operation).__name__}")
    if not isinstance(arrays, Mapping):
        raise TypeError(f"arrays must map names of arguments to arrays, not {type(arrays).__name__}")
    inputs = {name: lines_of(name, array) for name, array in arrays.items()}
    result = lines_of("out", out, is_result=True)
    for name, own in inputs.items():
        if own.shape[0] != result.shape[0]:
            raise ValueError(f"{name} has {own.shape[0]} lines and out {result.shape[0]}; give both the same number")
        same = own.place is not None and own.place == result.place
        if same or (isinstance(arrays[name], np.ndarray) and isinstance(out, np.ndarray)
                    and np.may_share_memory(arrays[name], out)):  # fmt: skip
            raise ValueError(f"out shares its memory or file with {name}; give out a separate one")
    if not inputs or not result.shape[0]:
        raise ValueError("arrays contains no lines; give at least one array with at least one line")
    return _Sweep(operation, inputs, result)


def sweep(
    operation: LineFunction,
    arrays: Mapping[str, ArrayLike],
    out: Any,
    *,
    executor: AnyExecutor | None = None,
    jobs: int | None = None,
    plan: SweepPlan | None = None,
    progress: Callable[[int, int], None] | None = None,
    first: int = 0,
) -> SweepPlan:
    """Compute the lines of a sweep larger than memory, or than one machine, in chunks, and return the plan.

    Parameters
    ----------
    operation : callable
        Function that computes each line by itself and takes the arrays by name, such as `invert` or
        `inverse_substructuring`. Fix arguments that are equal for all lines:
        ``functools.partial(jf.couple, dofs_a=[0], dofs_b=[0])``.
    arrays : mapping of str to array_like
        Arrays by the name of the argument, n_lines along their first axis. Workers read `numpy.memmap` and HDF5
        datasets of a file open for reading; other arrays are sent to them.
    out : ndarray, numpy.memmap or h5py.Dataset
        Array of results, n_lines along its first axis. Workers write a memory map themselves; this process writes
        their results into other arrays.
    executor, jobs
        Executor and number of workers; see `study`.
    plan : SweepPlan, optional
        Result of `plan_sweep`; by default costs are measured first.
    progress : callable, optional
        Function of the number of completed lines, including lines before `first`, and of the number of all lines.
    first : int
        First line to compute, default 0, a multiple of 512 and of the lines that `out` writes together.
        `BrokenPoolError` names it to continue a sweep that lost its workers.

    Returns
    -------
    SweepPlan
        Plan of the computation.

    Raises
    ------
    SingularLineError
        A line is singular; `lines` counts from the first line of the sweep. Other chunks may have been written.
    ValueError
        Wrong shapes; `out` shares memory with an input; an error of the operation, with the lines of the chunk.
    BrokenPoolError
        The executor has lost its workers, and no function makes another one. The message names the last written line,
        and the value of `first` for the rest.

    Warns
    -----
    IllConditionedWarning
        A warning for the first chunk with such lines, once.

    See Also
    --------
    plan_sweep : expected time and chunks.
    invert, couple : operations line by line.

    Notes
    -----
    Results are bit-identical on any number of workers, and to one call with all lines on the same engine: chunks are
    multiples of 512 lines. Each task computes on one thread.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> a = np.random.default_rng(1).standard_normal((5000, 2, 2)) + 3 * np.eye(2)
    >>> found = np.empty(a.shape, complex)
    >>> plan = jf.sweep(jf.invert, {"a": a}, found, jobs=1)
    >>> bool((found == jf.invert(a)).all())
    True
    """
    whole = _checked(operation, arrays, out)
    check_progress(progress)
    if plan is not None:
        check_type("plan", plan, SweepPlan)
    if not 0 <= as_integer("first", first) < whole.n_lines or first % _SHARE:
        raise ValueError(f"first must be a multiple of {_SHARE} from 0 to {whole.n_lines - 1}, not {first}")
    poor: list[tuple[int, str]] = []
    finished = _Finished(first)
    try:
        with opened_pool(executor, jobs) as pool:
            used = plan or _measured(whole, pool)
            if used.n_lines != whole.n_lines:
                raise ValueError(
                    f"plan is of {used.n_lines} lines, arrays have {whole.n_lines}; plan with these arrays"
                )
            for task, result in pool.completed(_do, _tasks(whole, used, first)):
                if result.values is not None:
                    whole.out.write(task.lines, result.values)
                if result.warning:
                    poor.append((task.lines.start, result.warning))
                finished.add(task.lines)
                if progress is not None:
                    progress(finished.count, whole.n_lines)
    except BrokenPoolError as error:
        raise BrokenPoolError(
            f"the workers of the executor have ended unexpectedly; {finished}: call sweep(..., first={finished.end})"
        ) from error
    if poor:
        start, text = min(poor)
        more = f"; {len(poor) - 1} other chunks have such lines, too" if len(poor) > 1 else ""
        warnings.warn(f"{text}, counted from line {start}{more}", IllConditionedWarning, stacklevel=2)
    return used


def plan_sweep(
    operation: LineFunction,
    arrays: Mapping[str, ArrayLike],
    out: Any,
    *,
    executor: AnyExecutor | None = None,
    jobs: int | None = None,
) -> SweepPlan:
    """Measure the cost of a sweep on a few of its lines, and return a plan; `out` is not changed.

    Parameters
    ----------
    operation, arrays, out, executor, jobs
        Operation, arrays and workers; see `sweep`.

    Returns
    -------
    SweepPlan
        Plan, which prints the expected time, and the numbers of tasks and of their lines.

    Raises
    ------
    SingularLineError, ValueError
        An error of `sweep`, in the lines that are measured.

    See Also
    --------
    sweep : the computation.

    Examples
    --------
    >>> import numpy as np, jointfrf as jf
    >>> a = np.random.default_rng(1).standard_normal((5000, 2, 2)) + 3 * np.eye(2)
    >>> plan = jf.plan_sweep(jf.invert, {"a": a}, np.empty(a.shape, complex), jobs=1)
    >>> plan.n_lines, plan.chunk_lines % 512, plan.seconds < 10
    (5000, 0, True)
    """
    whole = _checked(operation, arrays, out)
    with opened_pool(executor, jobs) as pool:
        return _measured(whole, pool)


def _tasks(whole: _Sweep, plan: SweepPlan, first: int) -> Iterator[_SweepTask]:
    return (whole.task(lines) for lines in plan.chunks(first))


def _measured(whole: _Sweep, pool: Pool[Any]) -> SweepPlan:
    """Measure the cost of lines and of tasks, and plan."""
    for _ in pool.completed(_nothing, iter(range(pool.workers))):  # starts the workers
        pass
    start = perf_counter()
    empty = sum(1 for _ in pool.completed(_nothing, iter(range(_EMPTY * pool.workers))))
    task = (perf_counter() - start) / empty * pool.workers
    seconds = []
    few, many = (min(sample, whole.n_lines) for sample in _SAMPLES)
    values = np.empty(0)
    for lines in (few, many):
        # At another place each time, whose lines have not been read before.
        places = [(whole.n_lines - lines) * place // _REPEATED for place in range(_REPEATED)]
        tried = [_one(pool, whole.task(slice(at, at + lines), is_written=False)) for at in places]
        seconds.append(median(one.seconds for one in tried))
        values = tried[-1].values if tried[-1].values is not None else values
    if values.shape != (many, *whole.out.shape[1:]):
        raise ValueError(f"out must have the shape {(whole.n_lines, *values.shape[1:])}, not {whole.out.shape}")
    rate = (seconds[1] - seconds[0]) / (many - few) if many > few else seconds[1] / many
    line = rate if rate > 0 else seconds[1] / many
    shapes = {name: own.shape for name, own in whole.inputs.items()} | {"out": whole.out.shape}
    cost = SweepCost(line, _write_seconds(whole.out, values) / many, task)
    return planned_sweep(whole.name, shapes, whole.n_lines, pool.workers, cost)


def _one(pool: Pool[Any], task: _SweepTask) -> _Done:
    ((_, done),) = pool.completed(_do, iter([task]))
    return done


def _write_seconds(out: Lines, values: NDArray[Any]) -> float:
    """Return the time for writing, into a file next to the results, or into memory."""
    start = perf_counter()
    if out.place is None:
        values.copy()
    else:
        with tempfile.TemporaryFile(dir=out.place.parent) as file:
            file.write(values.tobytes())
    return perf_counter() - start
