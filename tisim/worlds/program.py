"""A step as a list of loops, and the two ways to run it.

A ``Phase`` is one loop over the items of a world (its particles, its contacts, or the world itself) whose
items are independent of each other. A ``Program`` is the list of phases that make one step, some of them in
a ``Repeat``. The same phases run on two schedules, with the same bits:

"world"    - a thread takes a world through many steps in one launch. No launches and no barriers between
             phases, and a world stays in cache: the way for batches and small systems on a CPU.
"particle" - each phase is one launch over all particles of all worlds: the way for GPUs and for one
             large system on many cores.

That the bits agree needs no luck: phases only combine through sums in a fixed order, integer atomics and
floating-point minima and maxima, none of which depend on the order of parallel work.
"""

from collections.abc import Iterator
from typing import ClassVar

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.worlds.state import State
from tisim.worlds.status import WorldStatus

TASK = 512
"""Iterations that Taichi and Quadrants hand to a CPU thread at once, whatever block size is asked for
(measured: a loop of 512 runs on one thread, one of 1024 on two). With one world in each, worlds spread
over all threads."""


class Phase:
    """One loop. ``run(w, k)`` is called for k in 0..size(w)-1 when ``when(w)``; ``extent`` bounds size.

    ``long`` says that one item is work enough for a launch.
    """

    conditional: ClassVar[bool] = False
    long: bool = False
    extent: int = 1

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
    """A loop over the live particles of a world."""

    def __init__(self, s: State) -> None:
        self.s, self.extent = s, s.capacity

    @ti.func
    def size(self, w):
        return self.s.count[w]


class Repeat:
    """Items, in order, again and again while ``pending(w)`` is above zero.

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
    """Repeats within each other, from the outermost; a loop in them runs while all are pending."""

    def __init__(self, repeats: tuple[Repeat, ...] = ()) -> None:
        self.repeats = repeats
        self.inner: dict[Repeat, Nest] = {}

    def within(self, repeat: Repeat) -> "Nest":
        """This nest, and a repeat in it; the same object whenever asked, as kernels are compiled for each."""
        return self.inner.setdefault(repeat, Nest((*self.repeats, repeat)))

    def phases(self, items: tuple[Item, ...]) -> "Iterator[tuple[Phase, Nest]]":
        """Every phase among the items, in order, with the nest that it is in."""
        for item in items:
            if isinstance(item, Repeat):
                yield from self.within(item).phases(item.items)
            else:
                yield item, self


@ti.data_oriented
class Program:
    """One step of every running world, compiled for a state and a list of items."""

    def __init__(self, s: State, items: tuple[Item, ...], schedule: str) -> None:
        self.s, self.items, self.schedule = s, items, schedule
        self.outside = Nest()

    @in_taichi_thread
    def advance(self, steps: int) -> None:
        """At most ``steps`` steps of every running world; none goes on past its ``pause_time`` or its
        ``goal``, or after a launch that has left a step under way."""
        self.s.check()
        if self.schedule == "world":
            self._advance_worlds(steps)
            return
        self._allow(steps)
        for _ in range(steps):
            if not self._count_going_on():
                return
            self._launch(self.items, self.outside)

    def _launch(self, items: tuple[Item, ...], nest: Nest) -> None:
        for item in items:
            if isinstance(item, Repeat):
                while self._count_running(nest.within(item)):
                    self._launch(item.items, nest.within(item))
            else:
                self._sweep(item, nest)

    @in_taichi_thread
    def compile(self) -> None:
        """Compile what ``advance`` runs, and run nothing: no world may be running."""
        if self.schedule == "world":
            self._advance_worlds(0)
            return
        self._count_going_on()
        for phase, nest in self.outside.phases(self.items):
            self._count_running(nest)
            self._sweep(phase, nest)

    def names(self) -> list[str]:
        """What runs in a step, in order; repeated phases have a star for each repeat that they are in."""
        return [
            type(phase).__name__ + "*" * len(nest.repeats) for phase, nest in self.outside.phases(self.items)
        ]

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
        self.s.step_limit[w] = ti.min(self.s.steps[w] + steps, self.s.goal[w])

    @ti.func
    def _active(self, nest: ti.template(), w):  # type: ignore[valid-type]
        active = self.s.status[w] == WorldStatus.RUNNING and self.s.paused[w] == 0
        for repeat in ti.static(nest.repeats):
            active = active and repeat.pending(w) > 0
        return active

    @ti.kernel
    def _sweep(self, phase: ti.template(), nest: ti.template()):  # type: ignore[valid-type]
        for w, k in ti.ndrange(self.s.worlds, phase.extent):
            if self._active(nest, w) and k < phase.size(w) and phase.when(w) > 0:
                phase.run(w, k)
        for w in range(self.s.worlds):
            self._stop_failed(w)

    @ti.kernel
    def _count_going_on(self) -> ti.i32:
        """Between two steps: which worlds wait, and how many do not."""
        n = 0
        for w in range(self.s.worlds):
            self.s.paused[w] = ti.cast(self._waits(w), ti.i32)
            if self._active(self.outside, w):
                n += 1
        return n

    @ti.kernel
    def _count_running(self, nest: ti.template()) -> ti.i32:  # type: ignore[valid-type]
        n = 0
        for w in range(self.s.worlds):
            if self._active(nest, w):
                n += 1
        return n
