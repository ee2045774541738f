"""Tasks: the parts into which loops over particles are divided for CPU threads."""

from tisim.backend import runtime
from tisim.program.phases import Phase

TASK = 512
"""Iterations that Taichi and Quadrants give to a CPU thread at once, for any block size (measured: a loop of
512 runs on one thread, a loop of 1024 on two). With one world per task, worlds spread over all threads."""

TASKS_PER_THREAD = 4
"""Tasks of a loop per CPU thread, so that a thread that starts late has less to do."""


def iterations_of_task() -> int:
    """Return the loop iterations of a task, so that each task may have its own thread."""
    return TASK if runtime.current().device == "cpu" else 1


def tasks_of(phase: Phase, worlds: int, threads: int) -> int:
    """Return the number of tasks that a phase of one world is divided into for CPU threads.

    It is a multiple of the number of threads if it exceeds it. Often only a few of the allocated worlds have
    work.
    """
    least = TASK if phase.light and not phase.long else 1
    wanted = max(-(-TASKS_PER_THREAD * threads // worlds), threads)
    tasks = max(1, min(wanted, phase.extent // least))
    return tasks - tasks % threads if tasks > threads else tasks
