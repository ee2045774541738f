"""Steps by kernel launches: each phase is one loop over all particles of all worlds."""

from tisim.backend import runtime
from tisim.backend.launcher import Launcher
from tisim.backend.mappings import require_mappings
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.errors import must
from tisim.program.launches import TASK, Plan, Planner, Visit
from tisim.program.phases import Item, Phase, Repeat
from tisim.program.program import NOWHERE, OVER, Fork, Program, StepRules, entry, launch_count
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

    def _launch(self, plan: Plan) -> None:
        """Make the launches without reading the progress."""
        for item in plan:
            if isinstance(item, Visit):
                item.launch.run(item.place)
            else:
                for _ in range(item.turns()):
                    self._launch(item.plan)

    def _launch_asking(self, plan: Plan, found: int) -> int:
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

    def _compile(self, plan: Plan) -> None:
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
