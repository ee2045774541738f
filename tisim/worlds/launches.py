"""The launches of kernels that phases take where each is a loop over all worlds."""

from itertools import groupby
from typing import TYPE_CHECKING

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.worlds.phases import Item, Nest, Phase, Repeat

if TYPE_CHECKING:
    from tisim.worlds.program import Program

TASK = 512
"""Taichi and Quadrants hand so many iterations to a CPU thread at once, whatever block size is asked for
(measured: a loop of 512 runs on one thread, one of 1024 on two). With one world in each, worlds spread over
all threads."""

TASKS_PER_THREAD = 4
"""A loop has so many tasks for each thread of a CPU, so that a thread that comes late has less to do."""


@ti.data_oriented
class Launch:
    """A launch takes phases that follow each other: a loop over tasks of each, in every world that goes on.

    A task is a range of items. On a CPU there are not more than keep all threads busy, nor are they so small
    that waking a thread is not worth it. ``run`` returns how many worlds go on with what follows: a repeat in
    the nest ``following``, or the next step.
    """

    def __init__(self, program: "Program", phases: tuple[Phase, ...], nest: Nest, following: Nest) -> None:
        self.program, self.s, self.nest, self.following = program, program.s, nest, following
        settings = runtime.current()
        self.iterations = TASK if settings.device == "cpu" else 1
        most = TASKS_PER_THREAD * settings.threads
        self.loops: tuple[tuple[Phase, int, int], ...] = ()
        for phase in phases:
            tasks = phase.extent
            if settings.device == "cpu":
                tasks = max(1, min(most, phase.extent // (TASK if phase.light else 1)))
            self.loops += ((phase, tasks, -(-phase.extent // tasks)),)

    @ti.kernel
    def run(self) -> ti.i32:
        for loop in ti.static(self.loops):
            if ti.static(self.program.serial and self.s.worlds * loop[1] == 1):
                ti.loop_config(serialize=True)
            for w, q in ti.ndrange(self.s.worlds, loop[1] * self.iterations):
                if q % self.iterations == 0:
                    self.task(loop, w, q // self.iterations)
            if ti.static(self.program.serial):
                ti.loop_config(serialize=True)
            for w in range(self.s.worlds):
                self.program._stop_failed(w)
        n = 0
        if ti.static(self.program.serial):
            ti.loop_config(serialize=True)
        for w in range(self.s.worlds):
            n += self.program._goes_on(self.following, w)
        return n

    @ti.func
    def task(self, loop: ti.template(), w, task):  # type: ignore[valid-type]
        if self.program._active(self.nest, w) and loop[0].when(w) > 0:
            begin = task * loop[2]
            for k in range(begin, ti.min(begin + loop[2], loop[0].size(w))):
                loop[0].run(w, k)


@ti.data_oriented
class Loop:
    """A loop makes the launches of a repeat, again and again while any world is pending."""

    def __init__(self, program: "Program", items: "tuple[Item, ...]", nest: Nest) -> None:
        self.program, self.s, self.nest = program, program.s, nest
        self.plan = plan(program, items, nest, nest)

    @ti.kernel
    def count(self) -> ti.i32:
        n = 0
        if ti.static(self.program.serial):
            ti.loop_config(serialize=True)
        for w in range(self.s.worlds):
            n += self.program._goes_on(self.nest, w)
        return n


Plan = tuple[Launch | Loop, ...]


def plan(program: "Program", items: "tuple[Item, ...]", nest: Nest, last: Nest) -> Plan:
    """Return the launches that these items take; the last of them is followed by what ``last`` says."""
    launches: list[Launch | Loop] = []
    groups = [(repeated, tuple(group)) for repeated, group in groupby(items, lambda i: isinstance(i, Repeat))]
    for k, (repeated, group) in enumerate(groups):
        if repeated:
            launches += [Loop(program, r.items, nest.within(r)) for r in group if isinstance(r, Repeat)]
        else:
            next_repeats = [
                r for r in (groups[k + 1][1] if k + 1 < len(groups) else ()) if isinstance(r, Repeat)
            ]
            following = nest.within(next_repeats[0]) if next_repeats else last
            phases = tuple(item for item in group if isinstance(item, Phase))
            launches.append(Launch(program, phases, nest, following))
    return tuple(launches)
