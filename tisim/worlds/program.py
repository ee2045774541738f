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

from collections.abc import Callable

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.worlds.launches import TASK, Launch, Plan, plan
from tisim.worlds.phases import Item, Nest, Repeat
from tisim.worlds.state import State
from tisim.worlds.status import NEVER, WorldStatus


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
