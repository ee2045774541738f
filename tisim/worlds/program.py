"""A step as a list of loops, and the two ways to run it.

A ``Phase`` is one loop over the items of a world (its particles, its contacts, or the world itself) whose
items are independent of each other. A ``Program`` is the list of phases that make one step, some of them in
a ``Repeat``. The same phases run on two schedules, with the same bits:

"world"    - a thread takes a world through many steps in one launch. No launches and no barriers between
             phases, and a world stays in cache: the way for batches and small systems on a CPU.
"particle" - each phase is one loop of a launch over all particles of all worlds: the way for GPUs and for one
             large system on many cores. What may be repeated begins a launch of its own. On a GPU many
             steps are launched in a row before anybody asks how far worlds have come.

That the bits agree needs no luck: phases only combine through sums in a fixed order, integer atomics and
floating-point minima and maxima, none of which depend on the order of parallel work.
"""

from tisim.backend import runtime
from tisim.backend.launcher import Launcher
from tisim.backend.mappings import require_mappings
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.worlds.launches import TASK, Plan, Planner, Visit
from tisim.worlds.phases import Item, Phase, Repeat, nested
from tisim.worlds.routes import NOWHERE, OVER, Fork, entry, launch_count
from tisim.worlds.state import State
from tisim.worlds.status import NEVER, WorldStatus

PATIENCE = 8
"""At most so many steps are launched before worlds are asked where they are."""
LOOK_COST = 2.0
"""Worlds are asked that often that the launches which find them waiting cost as much as asking does: twice
what the launches of a step cost, in which a half of those that wait have waited."""
LOOKS_PER_QUESTION = 4
"""After so many looks a device that maps pages is asked whether it may go on: it takes a fraction of a ms."""
PLACES = 48
"""A step has at most so many places: worlds tell theirs by the bits of an integer."""
SHARES = 256
"""The share of worlds that wait for a repeat is told in this many parts."""


@ti.data_oriented
class Program:
    """A program is one step of every running world, compiled for a state and a list of items.

    rest_every : worlds rest after a number of steps that is a multiple of this one, for what is done there.
    once : whether worlds go through the items once, whatever steps they take.
    """

    def __init__(
        self,
        s: State,
        items: tuple[Item, ...],
        schedule: str,
        rest_every: int = NEVER,
        once: bool = False,
    ) -> None:
        self.s, self.items, self.schedule, self.rest_every = s, items, schedule, rest_every
        self.once, self.patience = once, 1
        # A CPU has ended a launch when it returns, so what it says of it costs nothing.
        self.asks, self.maps_pages = (runtime.current().device == name for name in ("cpu", "vulkan"))
        # One task has one thread, which is faster without waking it.
        self.serial = runtime.current().device == "cpu" and s.worlds <= TASK
        # The first place is that of worlds which wait for nothing.
        launched = (Phase(), *items) if isinstance(next(iter(items), None), Repeat) else items
        self.begin = entry(launched, 0, lambda _: OVER, 0)
        planner = Planner(self)
        self.plan: Plan = planner.step(launched) if schedule == "particle" else ()
        self.loops = tuple(planner.loops)
        self.allow, self.look = Launcher(self._allow), Launcher(self._look)
        if self.plan and launch_count(launched) > PLACES:
            raise TypeError(f"a step must have at most {PLACES} launches")

    @in_taichi_thread
    def advance(self, steps: int) -> None:
        """Take at most ``steps`` steps of every running world; none goes on past its ``pause_time`` or its
        ``goal``, or after a launch that has left a step under way."""
        self.s.check()
        if self.schedule == "world":
            self._advance_worlds(steps)
            return
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

    def _launch(self, plan: Plan) -> None:
        """Make the launches, unasked."""
        for item in plan:
            if isinstance(item, Visit):
                item.launch.run(item.place)
            else:
                for _ in range(item.turns()):
                    self._launch(item.plan)

    def _launch_asking(self, plan: Plan, found: int) -> int:
        """Make the launches, each repeat while there are worlds in it, and return where worlds are, as
        ``_look`` does; ``found`` says where they were."""
        for item in plan:
            if isinstance(item, Visit):
                found = item.launch.run_and_look(item.place)
            else:
                while found & item.bits:
                    found = self._launch_asking(item.plan, found)
        return found

    def _learn(self, found: int) -> None:
        """Learn from where worlds are after some steps, as ``_look`` tells it, how many steps and turns to
        launch unasked."""
        for loop in self.loops:
            loop.learn(found)
        few = (found >> PLACES) * self.patience <= LOOK_COST * SHARES
        self.patience = min(self.patience + 1, PATIENCE) if few else self.patience // 2

    @in_taichi_thread
    def compile(self) -> None:
        """Compile what ``advance`` runs, and run nothing: no world may be running."""
        if self.schedule == "world":
            self._advance_worlds(0)
            return
        self.allow(0)
        if not self.asks:
            self.look()
        self._compile(self.plan)

    def _compile(self, plan: Plan) -> None:
        for item in plan:
            if isinstance(item, Visit):
                launch = item.launch.run_and_look if self.asks else item.launch.run
                launch(item.place)
            else:
                self._compile(item.plan)

    def names(self) -> list[str]:
        """Return what runs in a step, in order; repeated phases have a star for each repeat that they are
        in."""
        return [phase.name + "*" * depth for phase, depth in nested(self.items)]

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
            self.s.status[w], self.s.place[w] = self.s.failed[w], NOWHERE

    @ti.func
    def _waits(self, w):
        return self.s.time[w] >= self.s.pause_time[w] or self.s.steps[w] >= self.s.step_limit[w]

    @ti.kernel
    def _allow(self, steps: ti.i32) -> ti.i64:
        """Let worlds take steps, and return the places of those that do, a bit for each."""
        places = ti.cast(0, ti.i64)
        if ti.static(self.serial):
            ti.loop_config(serialize=True)
        for w in range(self.s.worlds):
            self._allow_world(w, steps)
            self.s.place[w] = ti.select(steps > 0, self._next_step(w), NOWHERE)
            places |= self._bit(w)
        return places

    @ti.func
    def _allow_world(self, w, steps):
        limit = ti.min(self.s.steps[w] + steps, self.s.goal[w])
        if ti.static(self.rest_every < NEVER):
            limit = ti.min(limit, (self.s.steps[w] // self.rest_every + 1) * self.rest_every)
        self.s.step_limit[w] = limit

    @ti.func
    def _follow(self, route: ti.template(), w, place):  # type: ignore[valid-type]
        """Return where a world goes on, from this place."""
        there = NOWHERE
        if ti.static(isinstance(route, Fork)):
            # Names, one by one: Quadrants would look for attributes of attributes without end.
            inside = ti.static(route.inside)
            past = ti.static(route.past)
            if route.repeat.pending(w) > 0:
                there = self._follow(inside, w, place)
            else:
                there = self._follow(past, w, place)
        elif ti.static(route != OVER):
            there = place + route
        elif ti.static(not self.once):
            there = self._next_step(w)
        return there

    @ti.func
    def _next_step(self, w):
        """Return where a world begins its next step; nowhere, where it waits."""
        return ti.select(self._waits(w), NOWHERE, self._follow(self.begin, w, 0))

    @ti.func
    def _goes_on(self, w):
        return self.s.place[w] != NOWHERE and self.s.status[w] == WorldStatus.RUNNING

    @ti.func
    def _bit(self, w):
        """Return the bit of where a world is; 0 for one that does not go on."""
        bit = ti.cast(1, ti.i64) << ti.max(self.s.place[w], 0)
        return ti.select(self._goes_on(w), bit, ti.cast(0, ti.i64))

    @ti.kernel
    def _look(self) -> ti.i64:
        """Return the places at which there are worlds that go on, a bit for each, and which part of them is
        not between two steps, in the bits above."""
        places, going, waiting = ti.cast(0, ti.i64), 0, 0
        if ti.static(self.serial):
            ti.loop_config(serialize=True)
        for w in range(self.s.worlds):
            places |= self._bit(w)
            going += ti.cast(self._goes_on(w), ti.i32)
            waiting += ti.cast(self._goes_on(w) and self.s.place[w] > 0, ti.i32)
        share = SHARES * ti.cast(waiting, ti.i64) // ti.max(going, 1)
        return places | share << PLACES
