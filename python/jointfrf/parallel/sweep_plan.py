"""What a sweep will take: time by line and by task as measured on a few lines, and the chunks that follow."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from jointfrf.kernel.arguments import CHUNK_BYTES

__all__ = ["SHARE", "SweepCost", "SweepPlan", "planned_sweep"]

#: Lines that the kernel takes as one share: chunks are multiples of it, so that they change no bit of a result.
SHARE = 512
#: Share of its time that a task may lose to being sent.
_OVERHEAD = 0.02
#: Memory of a task, unless it must be larger for the time it takes.
_USUAL_BYTES = 8 * 2**20
#: Tasks for each worker at least, so that all end together.
_TASKS = 4


@dataclass(frozen=True)
class SweepCost:
    """What was measured.

    Attributes
    ----------
    line : float
        Seconds of one worker for a line: reading and computing.
    write : float
        Seconds for writing a line.
    task : float
        Seconds for a task that does nothing: sending it, and its answer.
    """

    line: float
    write: float
    task: float


@dataclass(frozen=True)
class SweepPlan:
    """How a sweep is cut into tasks, and what it will take.

    Attributes
    ----------
    operation : str
    shapes : mapping of str to tuple
        Of the inputs and of the result.
    n_lines, chunk_lines : int
        Lines in all, and of a task.
    workers : int
    line_bytes : int
        Bytes of a line of all inputs and the result.
    cost : SweepCost
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
        """Time it will take, s: whole rounds of tasks on all workers."""
        each = min(self.chunk_lines, self.n_lines) * (self.cost.line + self.cost.write) + self.cost.task
        return math.ceil(self.n_tasks / self.workers) * each

    @property
    def task_bytes(self) -> int:
        """Memory of a task: its lines of all inputs and of the result."""
        return min(self.chunk_lines, self.n_lines) * self.line_bytes

    def chunks(self, first: int = 0) -> Iterator[slice]:
        """Give the lines of each task, from a line on."""
        for start in range(first, self.n_lines, self.chunk_lines):
            yield slice(start, min(start + self.chunk_lines, self.n_lines))

    def __str__(self) -> str:
        """Describe the plan for a reader."""
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
    operation: str, shapes: dict[str, tuple[int, ...]], n_lines: int, workers: int, step: int, cost: SweepCost
) -> SweepPlan:
    """Choose the lines of a task.

    Parameters
    ----------
    operation : str
    shapes : dict of str to tuple
        Of inputs and result.
    n_lines, workers : int
    step : int
        Lines that must be written together.
    cost : SweepCost

    Notes
    -----
    A task takes at least 50 times what it costs to send it, unless it would then take more memory than 64 MiB or leave
    workers without one. Tasks are multiples of 512 lines, which the kernel computes alike whatever stands around them.
    """
    line_bytes = sum(16 * math.prod(shape[1:]) for shape in shapes.values())
    lines = cost.task / _OVERHEAD / max(cost.line + cost.write, 1e-12)
    # Larger tasks than that lose nothing either, as long as all workers have some and their memory is small.
    lines = min(max(lines, _USUAL_BYTES / line_bytes), CHUNK_BYTES / line_bytes, n_lines / (_TASKS * workers))
    unit = math.lcm(SHARE, step)
    return SweepPlan(operation, shapes, n_lines, max(1, round(lines / unit)) * unit, workers, line_bytes, cost)
