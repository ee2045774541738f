"""A step as a list of loops, and the two ways to run it.

A ``Phase`` is one loop over the items of a world (its particles, its contacts, or the world itself) whose
items are independent of each other. A ``Program`` is the list of phases that make one step, some of them in
a ``Repeat``. The same phases run on two schedules, with the same bits:

"world"    - a thread takes a world through many steps in one launch. No launches and no barriers between
             phases, and a world stays in cache: the way for batches and small systems on a CPU.
"particle" - each phase is one loop of a launch over all particles of all worlds: the way for GPUs and for one
             large system on many cores. What may be repeated begins a launch of its own.

That the bits agree needs no luck: phases only combine through sums in a fixed order, integer atomics and
floating-point minima and maxima, none of which depend on the order of parallel work.
"""

from collections.abc import Callable, Iterator
from itertools import groupby
from typing import ClassVar

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.worlds.state import State
from tisim.worlds.status import NEVER, WorldStatus

TASK = 512
"""Taichi and Quadrants hand so many iterations to a CPU thread at once, whatever block size is asked for
(measured: a loop of 512 runs on one thread, one of 1024 on two). With one world in each, worlds spread over
all threads."""

TASKS_PER_THREAD = 4
"""A loop has so many tasks for each thread of a CPU, so that a thread that comes late has less to do."""


class Phase:
    """A phase is one loop: ``run(w, k)`` is called for k in 0..size(w)-1 when ``when(w)``; ``extent`` bounds
    size.

    ``long`` says that one item is work enough for a launch, ``light`` that a task has many items, on a CPU.
    """

    conditional: ClassVar[bool] = False
    long: bool = False
    extent: int = 1
    light: bool = True

    @property
    def name(self) -> str:
        """Return what the phase is called where a step is explained."""
        return type(self).__name__

    @ti.func
    def when(self, w):
        return 1

    @ti.func
    def size(self, w):
        return 1

    @ti.func
    def run(self, w, k):
        pass


class PerParticle(Phase):
    """This phase is a loop over the live particles of a world.

    local : whether an item reads and writes nothing but its own particle and what its world had before, so
    that it may follow at once when the phase before is done with that particle.
    """

    local: ClassVar[bool] = False

    def __init__(self, s: State) -> None:
        self.s, self.extent = s, s.capacity

    @ti.func
    def size(self, w):
        return self.s.count[w]


class Repeat:
    """A repeat takes items in order, again and again while ``pending(w)`` is above zero.

    Items are phases, and further repeats. Only the last phase may change what ``pending`` says, and once it
    says 0, the items of that phase that are left must have nothing to do: they may be skipped.
    """

    def __init__(self, items: "tuple[Item, ...]") -> None:
        self.items = items

    @ti.func
    def pending(self, w):
        return 0


Item = Phase | Repeat


class Nest:
    """A nest is repeats within each other, from the outermost; a loop in them runs while all are pending."""

    def __init__(self, repeats: tuple[Repeat, ...] = ()) -> None:
        self.repeats = repeats
        self.inner: dict[Repeat, Nest] = {}

    def within(self, repeat: Repeat) -> "Nest":
        """Return this nest with a repeat in it; the same object whenever asked, as kernels are compiled for
        each."""
        return self.inner.setdefault(repeat, Nest((*self.repeats, repeat)))

    def phases(self, items: tuple[Item, ...]) -> "Iterator[tuple[Phase, Nest]]":
        """Yield every phase among the items, in order, with the nest that it is in."""
        for item in items:
            if isinstance(item, Repeat):
                yield from self.within(item).phases(item.items)
            else:
                yield item, self


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


@ti.data_oriented
class Program:
    """A program is one step of every running world, compiled for a state and a list of items.

    rest_every : worlds rest after a number of steps that is a multiple of this one, for what is done there.
    """

    def __init__(self, s: State, items: tuple[Item, ...], schedule: str, rest_every: int = NEVER) -> None:
        self.s, self.items, self.schedule, self.rest_every = s, items, schedule, rest_every
        self.outside = Nest()
        # One task has one thread, which is faster without waking it.
        self.serial = runtime.current().device == "cpu" and s.worlds <= TASK
        self.plan: Plan = plan(self, items, self.outside, self.outside) if schedule == "particle" else ()

    @in_taichi_thread
    def advance(self, steps: int) -> None:
        """Take at most ``steps`` steps of every running world; none goes on past its ``pause_time`` or its
        ``goal``, or after a launch that has left a step under way."""
        self.s.check()
        if self.schedule == "world":
            self._advance_worlds(steps)
            return
        self._allow(steps)
        pending = self._count()
        for _ in range(steps):
            if not pending:
                return
            pending = self._launch(self.plan, self._count)

    def _launch(self, launches: Plan, count: Callable[[], int]) -> int:
        """Make the launches, and return how many worlds go on with what follows them, which ``count``
        tells."""
        pending: int | None = None
        for launch in launches:
            if isinstance(launch, Launch):
                pending = launch.run()
            else:
                pending = launch.count() if pending is None else pending
                while pending:
                    pending = self._launch(launch.plan, launch.count)
                pending = None
        return count() if pending is None else pending

    @in_taichi_thread
    def compile(self) -> None:
        """Compile what ``advance`` runs, and run nothing: no world may be running."""
        if self.schedule == "world":
            self._advance_worlds(0)
            return
        self._count()
        self._compile(self.plan)

    def _compile(self, launches: Plan) -> None:
        for launch in launches:
            if isinstance(launch, Launch):
                launch.run()
            else:
                launch.count()
                self._compile(launch.plan)

    def names(self) -> list[str]:
        """Return what runs in a step, in order; repeated phases have a star for each repeat that they are
        in."""
        return [phase.name + "*" * len(nest.repeats) for phase, nest in self.outside.phases(self.items)]

    @ti.kernel
    def _advance_worlds(self, steps: ti.i32):
        for k in range(self.s.worlds * TASK):
            if k % TASK == 0:
                w = k // TASK
                self._allow_world(w, steps)
                step = 0
                while self.s.status[w] == WorldStatus.RUNNING and step < steps and not self._waits(w):
                    self._run(self.items, w)
                    step += 1

    @ti.func
    def _run(self, items: ti.template(), w):  # type: ignore[valid-type]
        for item in ti.static(items):
            if self.s.status[w] == WorldStatus.RUNNING:
                if ti.static(isinstance(item, Repeat)):
                    while self.s.status[w] == WorldStatus.RUNNING and item.pending(w) > 0:
                        self._run(item.items, w)
                else:
                    self._loop(item, w)
                    self._stop_failed(w)

    @ti.func
    def _loop(self, phase: ti.template(), w):  # type: ignore[valid-type]
        if ti.static(phase.conditional):
            if phase.when(w) > 0:
                for k in range(phase.size(w)):
                    phase.run(w, k)
        else:
            for k in range(phase.size(w)):
                phase.run(w, k)

    @ti.func
    def _stop_failed(self, w):
        """Stop a world in which a phase has failed, once all of its items have been heard."""
        if self.s.failed[w] > 0:
            self.s.status[w] = self.s.failed[w]

    @ti.func
    def _waits(self, w):
        return self.s.time[w] >= self.s.pause_time[w] or self.s.steps[w] >= self.s.step_limit[w]

    @ti.kernel
    def _allow(self, steps: ti.i32):
        for w in range(self.s.worlds):
            self._allow_world(w, steps)

    @ti.func
    def _allow_world(self, w, steps):
        limit = ti.min(self.s.steps[w] + steps, self.s.goal[w])
        if ti.static(self.rest_every < NEVER):
            limit = ti.min(limit, (self.s.steps[w] // self.rest_every + 1) * self.rest_every)
        self.s.step_limit[w] = limit

    @ti.func
    def _active(self, nest: ti.template(), w):  # type: ignore[valid-type]
        active = self.s.status[w] == WorldStatus.RUNNING and self.s.paused[w] == 0
        for repeat in ti.static(nest.repeats):
            active = active and repeat.pending(w) > 0
        return active

    @ti.func
    def _goes_on(self, nest: ti.template(), w):  # type: ignore[valid-type]
        """Return 1 for a world that goes on in a nest, else 0. Between two steps, note whether it waits."""
        if ti.static(len(nest.repeats) == 0):
            self.s.paused[w] = ti.cast(self._waits(w), ti.i32)
        return ti.cast(self._active(nest, w), ti.i32)

    @ti.kernel
    def _count(self) -> ti.i32:
        """Return how many worlds take the next step."""
        n = 0
        if ti.static(self.serial):
            ti.loop_config(serialize=True)
        for w in range(self.s.worlds):
            n += self._goes_on(self.outside, w)
        return n
