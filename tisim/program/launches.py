"""The launches of kernels that phases take where each is a loop over all worlds.

Each world knows its ``place``, the launch of the step that it takes next, and has nothing to do in the
others. A device is not asked after a launch what has become of it, as it would have to end all that it was
given before it answers: launches are made in a row, many steps of them, and a world that comes to a repeat
that they do not have in them waits there.
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
"""Taichi and Quadrants hand so many iterations to a CPU thread at once, whatever block size is asked for
(measured: a loop of 512 runs on one thread, one of 1024 on two). With one world in each, worlds spread over
all threads."""

TASKS_PER_THREAD = 4
"""A loop has so many tasks for each thread of a CPU, so that a thread that comes late has less to do."""


def iterations_of_task() -> int:
    """Return how many iterations of a loop a task takes up, so that each may have a thread of its own."""
    return TASK if runtime.current().device == "cpu" else 1


def tasks_of(phase: Phase, worlds: int, threads: int) -> int:
    """Return into how many tasks a phase of a world is cut for threads of a CPU: a multiple of these, where
    there are more. Only few of the worlds that there is room for may have work."""
    least = TASK if phase.light and not phase.long else 1
    wanted = max(-(-TASKS_PER_THREAD * threads // worlds), threads)
    tasks = max(1, min(wanted, phase.extent // least))
    return tasks - tasks % threads if tasks > threads else tasks


@ti.data_oriented
class Launch:
    """A launch takes phases that follow each other: a loop over tasks of each, in every world whose turn it
    is; ``route`` says where these go on.

    A task is a range of items. On a CPU there are not more than keep all threads busy, nor are they so small
    that waking a thread is not worth it.
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
        """Take the phases, and return where worlds are then, as ``LaunchedProgram._look`` does."""
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
        """Return whether it is a world's turn; one that has come to its end keeps its place."""
        return self.s.place[w] == place and self.s.status[w] == WorldStatus.RUNNING

    @ti.func
    def task(self, loop: ti.template(), w, task, place):  # type: ignore[valid-type]
        if self._takes(w, place) and loop[0].when(w) > 0:
            begin = task * loop[2]
            for k in range(begin, ti.min(begin + loop[2], loop[0].size(w))):
                loop[0].run(w, k)


@dataclass(frozen=True)
class Visit:
    """A visit is a launch in its place."""

    launch: Launch
    place: int


class Loop:
    """A loop makes the launches of a repeat as often as a step usually takes them.

    bits : of the places of its launches, at the first of which worlds wait that are not through.
    """

    def __init__(self, plan: "Plan", usual: int, places: range) -> None:
        self.plan, self.usual, self.more = plan, usual, 0
        self.bits = sum(1 << place for place in places)

    def turns(self) -> int:
        """Return how many turns are to be made now, unasked."""
        turns, self.more = self.usual + self.more, 0
        return turns

    def learn(self, found: int) -> None:
        """Hear where worlds wait; where some are in this repeat, it has one turn more next time."""
        self.more = int(found & self.bits > 0)


Plan = tuple[Visit | Loop, ...]


class Planner:
    """A planner makes the launches of a program, and its loops; launches that are the same only once."""

    def __init__(self, program: "LaunchedProgram") -> None:
        self.program = program
        self.loops: list[Loop] = []
        self._launches: dict[tuple[tuple[Phase, ...], Route], Launch] = {}

    def step(self, items: Items) -> Plan:
        """Return the launches of a step."""
        return self._plan(items, 0, lambda _: OVER)

    def _plan(self, items: Items, place: int, after: Callable[[int], Route]) -> Plan:
        """Return the launches of items, the first of which has this place; ``after`` makes the route of a
        world that is through with them, from where it is."""
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
