"""Steps by kernel launches: each phase is one loop over all particles of all worlds.

Each world has a ``place``, the next launch of the step that it takes, and does nothing in other launches.
Reading the outcome after every launch would force the device to finish all pending work first. Launches are
therefore queued for many steps in a row, and a world that needs another turn of a repeat which is not queued
waits there.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from tisim.backend import runtime
from tisim.backend.launcher import Launcher
from tisim.backend.mappings import require_mappings
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.errors import must
from tisim.program.phases import Item, Phase, Repeat
from tisim.program.program import (
    NOWHERE,
    OVER,
    Fork,
    Items,
    Program,
    Route,
    StepRules,
    entry,
    first_group,
    launch_count,
)
from tisim.program.tasks import TASK, iterations_of_task, tasks_of
from tisim.state.state import State
from tisim.state.status import NEVER, WorldStatus

PATIENCE = 8
"""Largest number of steps launched before the progress of the worlds is read."""
LOOK_COST = 2.0
"""Bound on the fraction of waiting worlds times the number of steps between two reads of their progress.

Beyond it the progress is read more often. At this value launches that find their worlds waiting cost as
much as a read: twice the launches of a step, during which on average half of the waiting worlds waited.
"""
LOOKS_PER_QUESTION = 4
"""Number of reads after which a device with mapped pages is checked for its limit; the check takes a fraction
of a ms."""
PLACES = 48
"""Largest number of launches in a step: worlds report their place as a bit of an integer."""
SHARES = 256
"""Resolution of the reported fraction of worlds that wait for a repeat."""


@ti.data_oriented
class LaunchedProgram(StepRules, Program):
    """This program launches one kernel for the phases between two repeats.

    once : whether worlds run the items once, independent of their steps.
    """

    def __init__(
        self, s: State, items: tuple[Item, ...], rest_every: int = NEVER, once: bool = False
    ) -> None:
        super().__init__(s, rest_every)
        self.items, self.once, self.patience = items, once, 1
        # On a CPU a launch has ended when it returns, so reading its result costs nothing.
        self.asks, self.maps_pages = (runtime.current().device == name for name in ("cpu", "vulkan"))
        # A single task runs faster without waking a thread.
        self.serial = runtime.current().device == "cpu" and s.worlds <= TASK
        # The first place belongs to worlds that do not wait.
        launched = (Phase(), *items) if isinstance(next(iter(items), None), Repeat) else items
        self.begin = entry(launched, 0, lambda _: OVER, 0)
        planner = Planner(self)
        self.plan: Plan = planner.step(launched)
        self.loops = tuple(planner.loops)
        self.allow, self.look = Launcher(self._allow), Launcher(self._look)
        count = launch_count(launched)
        must(count <= PLACES, "launches of a step", f"at most {PLACES}", count)

    @in_taichi_thread
    def advance(self, steps: int) -> None:
        self.s.check()
        found, looks = self.allow(steps), 0
        while found:
            if self.asks:
                found = self._launch_asking(self.plan, found)
                continue
            if self.maps_pages and looks % LOOKS_PER_QUESTION == 0:
                require_mappings()
            looks += 1
            for _ in range(min(self.patience, steps)):
                self._launch(self.plan)
            found = self.look()
            self._learn(found)

    def _launch(self, plan: "Plan") -> None:
        """Make the launches without reading the progress."""
        for item in plan:
            if isinstance(item, Visit):
                item.launch.run(item.place)
            else:
                for _ in range(item.turns()):
                    self._launch(item.plan)

    def _launch_asking(self, plan: "Plan", found: int) -> int:
        """Make the launches, each repeat while worlds are in it, and return the places of the worlds as
        ``_look`` does.

        found : the places of the worlds before.
        """
        for item in plan:
            if isinstance(item, Visit):
                found = item.launch.run_and_look(item.place)
            else:
                while found & item.bits:
                    found = self._launch_asking(item.plan, found)
        return found

    def _learn(self, found: int) -> None:
        """Adapt the number of steps and turns launched without a read to the places found after some steps.

        found : the result of ``_look``.
        """
        for loop in self.loops:
            loop.learn(found)
        few = (found >> PLACES) * self.patience <= LOOK_COST * SHARES
        self.patience = min(self.patience + 1, PATIENCE) if few else self.patience // 2

    @in_taichi_thread
    def compile(self) -> None:
        self.allow(0)
        if not self.asks:
            self.look()
        self._compile(self.plan)

    def _compile(self, plan: "Plan") -> None:
        for item in plan:
            if isinstance(item, Visit):
                launch = item.launch.run_and_look if self.asks else item.launch.run
                launch(item.place)
            else:
                self._compile(item.plan)

    @ti.kernel
    def _allow(self, steps: ti.i32) -> ti.i64:
        """Allow worlds to take steps, and return the places of the running worlds, one bit for each place."""
        places = ti.cast(0, ti.i64)
        if ti.static(self.serial):
            ti.loop_config(serialize=True)
        for w in range(self.s.worlds):
            self._allow_world(w, steps)
            self.s.place[w] = ti.select(steps > 0, self._next_step(w), NOWHERE)
            places |= self._bit(w)
        return places

    @ti.func
    def _follow(self, route: ti.template(), w, place):  # type: ignore[valid-type]
        """Return the next place of a world after this place."""
        there = NOWHERE
        if ti.static(isinstance(route, Fork)):
            ways = ti.static(route.ways)
            if route.repeat.pending(w) > 0:
                there = self._follow(ways[0], w, place)
            else:
                there = self._follow(ways[1], w, place)
        elif ti.static(route != OVER):
            there = place + route
        elif ti.static(not self.once):
            there = self._next_step(w)
        return there

    @ti.func
    def _next_step(self, w):
        """Return the first place of the next step of a world; NOWHERE if it waits."""
        return ti.select(self._waits(w), NOWHERE, self._follow(self.begin, w, 0))

    @ti.func
    def _goes_on(self, w):
        return self.s.place[w] != NOWHERE and self.s.status[w] == WorldStatus.RUNNING

    @ti.func
    def _bit(self, w):
        """Return the bit for the place of a world; 0 if it does not go on."""
        bit = ti.cast(1, ti.i64) << ti.max(self.s.place[w], 0)
        return ti.select(self._goes_on(w), bit, ti.cast(0, ti.i64))

    @ti.kernel
    def _look(self) -> ti.i64:
        """Return the places of the running worlds, one bit for each, and in the bits above the fraction of
        worlds within a step."""
        places, going, waiting = ti.cast(0, ti.i64), 0, 0
        if ti.static(self.serial):
            ti.loop_config(serialize=True)
        for w in range(self.s.worlds):
            places |= self._bit(w)
            going += ti.cast(self._goes_on(w), ti.i32)
            waiting += ti.cast(self._goes_on(w) and self.s.place[w] > 0, ti.i32)
        share = SHARES * ti.cast(waiting, ti.i64) // ti.max(going, 1)
        return places | share << PLACES


@ti.data_oriented
class Launch:
    """A launch runs consecutive phases: for each, a loop over tasks in every world at this place.

    A task is a range of items. On a CPU there are only enough tasks to keep all threads busy, and none is too
    small to be worth waking a thread.

    route : the next place of these worlds.
    """

    def __init__(self, program: LaunchedProgram, phases: tuple[Phase, ...], route: Route) -> None:
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

    def __init__(self, program: LaunchedProgram) -> None:
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
