"""Kernel launches of the phases, each a loop over all worlds.

Each world has a ``place``, the next launch of the step that it takes, and does nothing in other launches.
Reading the outcome after every launch would force the device to finish all pending work first. Launches are
therefore queued for many steps in a row, and a world that needs another turn of a repeat which is not queued
waits there.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from tisim.backend import runtime
from tisim.backend.launcher import Launcher
from tisim.backend.taichi import ti
from tisim.program.phases import Phase, Repeat
from tisim.program.program import OVER, Items, Route, entry, first_group, launch_count
from tisim.state.status import WorldStatus

if TYPE_CHECKING:
    from tisim.program.launched_program import LaunchedProgram

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


@ti.data_oriented
class Launch:
    """A launch runs consecutive phases: for each, a loop over tasks in every world at this place.

    A task is a range of items. On a CPU there are only enough tasks to keep all threads busy, and none is too
    small to be worth waking a thread.

    route : the next place of these worlds.
    """

    def __init__(self, program: "LaunchedProgram", phases: tuple[Phase, ...], route: Route) -> None:
        self.program, self.s, self.route = program, program.s, route
        settings = runtime.current()
        self.iterations = iterations_of_task()
        self.loops: tuple[tuple[Phase, int, int], ...] = ()
        for phase in phases:
            on_cpu = settings.device == "cpu"
            tasks = tasks_of(phase, self.s.worlds, settings.threads) if on_cpu else phase.extent
            self.loops += ((phase, tasks, -(-phase.extent // tasks)),)
        self.run, self.run_and_look = Launcher(self._run), Launcher(self._run_and_look)

    @ti.kernel
    def _run(self, place: ti.i32):
        self._take(place)

    @ti.kernel
    def _run_and_look(self, place: ti.i32) -> ti.i64:
        """Run the phases, and return the places of the worlds as ``LaunchedProgram._look`` does."""
        self._take(place)
        places = ti.cast(0, ti.i64)
        if ti.static(self.program.serial):
            ti.loop_config(serialize=True)
        for w in range(self.s.worlds):
            places |= self.program._bit(w)
        return places

    @ti.func
    def _take(self, place):
        for loop in ti.static(self.loops):
            if ti.static(self.program.serial and self.s.worlds * loop[1] == 1):
                ti.loop_config(serialize=True)
            for w, q in ti.ndrange(self.s.worlds, loop[1] * self.iterations):
                if q % self.iterations == 0:
                    self.task(loop, w, q // self.iterations, place)
            if ti.static(self.program.serial):
                ti.loop_config(serialize=True)
            for w in range(self.s.worlds):
                self.program._stop_failed(w)
        if ti.static(self.program.serial):
            ti.loop_config(serialize=True)
        for w in range(self.s.worlds):
            if self._takes(w, place):
                self.s.place[w] = self.program._follow(self.route, w, place)

    @ti.func
    def _takes(self, w, place):
        """Return whether a world takes this launch; a world that has ended keeps its place."""
        return self.s.place[w] == place and self.s.status[w] == WorldStatus.RUNNING

    @ti.func
    def task(self, loop: ti.template(), w, task, place):  # type: ignore[valid-type]
        if self._takes(w, place) and loop[0].when(w) > 0:
            begin = task * loop[2]
            for k in range(begin, ti.min(begin + loop[2], loop[0].size(w))):
                loop[0].run(w, k)


@dataclass(frozen=True)
class Visit:
    """A visit is a launch at a place of the step."""

    launch: Launch
    place: int


class Loop:
    """A loop makes the launches of a repeat as often as a step usually takes them.

    bits : the places of its launches; worlds that need more turns wait at the first of them.
    """

    def __init__(self, plan: "Plan", usual: int, places: range) -> None:
        self.plan, self.usual, self.more = plan, usual, 0
        self.bits = sum(1 << place for place in places)

    def turns(self) -> int:
        """Return the number of turns to launch now without a read."""
        turns, self.more = self.usual + self.more, 0
        return turns

    def learn(self, found: int) -> None:
        """Add one turn next time if worlds wait in this repeat, according to the places found."""
        self.more = int(found & self.bits > 0)


Plan = tuple[Visit | Loop, ...]


class Planner:
    """A planner makes the launches and loops of a program; equal launches are made only once."""

    def __init__(self, program: "LaunchedProgram") -> None:
        self.program = program
        self.loops: list[Loop] = []
        self._launches: dict[tuple[tuple[Phase, ...], Route], Launch] = {}

    def step(self, items: Items) -> Plan:
        """Return the launches of a step."""
        return self._plan(items, 0, lambda _: OVER)

    def _plan(self, items: Items, place: int, after: Callable[[int], Route]) -> Plan:
        """Return the launches of items that begin at a place.

        after : makes the route of a world that has finished the items, from its place.
        """
        plan: list[Visit | Loop] = []
        while items:
            first, rest = first_group(items)
            if isinstance(first, Repeat):
                again = partial(entry, items, place, after)
                end = place + launch_count(first.items)
                loop = Loop(self._plan(first.items, place, again), first.usual, range(place, end))
                self.loops.append(loop)
                plan.append(loop)
                place = end
            else:
                key = first, entry(rest, place + 1, after, place)
                if key not in self._launches:
                    self._launches[key] = Launch(self.program, *key)
                plan.append(Visit(self._launches[key], place))
                place += 1
            items = rest
        return tuple(plan)
