"""A step as a list of loops, and the two ways to run it.

A ``Phase`` is one loop over the items of a world (its particles, its contacts, or the world itself) whose
items are independent of each other. A ``Program`` is the list of phases that make one step. The same
phases run on two schedules, with the same bits:

"world"    - a thread takes a world through many steps in one launch. No launches and no barriers between
             phases, and a world stays in cache: the way for batches and small systems on a CPU.
"particle" - each phase is one launch over all particles of all worlds: the way for GPUs and for one
             large system on many cores.

That the bits agree needs no luck: phases only combine through sums in a fixed order, integer atomics and
floating-point minima and maxima, none of which depend on the order of parallel work.
"""

from typing import ClassVar

from tisim._taichi import ti
from tisim.state import RUNNING, State

TASK = 512
"""Iterations that Taichi and Quadrants hand to a CPU thread at once, whatever block size is asked for
(measured: a loop of 512 runs on one thread, one of 1024 on two). With one world in each, worlds spread
over all threads."""


class Phase:
    """One loop. ``run(w, k)`` is called for k in 0..size(w)-1 when ``when(w)``; ``extent`` bounds size."""

    conditional: ClassVar[bool] = False
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
    """Phases to be run again while ``pending(w)`` is above zero."""

    def __init__(self, phases: tuple[Phase, ...]) -> None:
        self.phases = phases

    @ti.func
    def pending(self, w):
        return 0


@ti.data_oriented
class Program:
    """One step of every running world, compiled for a state and a list of phases."""

    def __init__(self, s: State, items: tuple[Phase | Repeat, ...], schedule: str) -> None:
        self.s, self.items, self.schedule = s, items, schedule

    def advance(self, steps: int) -> None:
        """At most ``steps`` steps of every running world."""
        if self.schedule == "world":
            self._advance_worlds(steps)
            return
        for _ in range(steps):
            if not self._count_running():
                return
            for item in self.items:
                if not isinstance(item, Repeat):
                    self._sweep(item)
                    continue
                while self._count_pending(item):
                    for phase in item.phases:
                        self._sweep_pending(item, phase)

    def compile(self) -> None:
        """Compile what ``advance`` runs, and run nothing: no world may be running."""
        if self.schedule == "world":
            self._advance_worlds(0)
            return
        self._count_running()
        for item in self.items:
            if isinstance(item, Repeat):
                self._count_pending(item)
            for phase in item.phases if isinstance(item, Repeat) else (item,):
                self._sweep_pending(item, phase) if isinstance(item, Repeat) else self._sweep(phase)

    def names(self) -> list[str]:
        """What runs in a step, in order."""
        flat: list[str] = []
        for item in self.items:
            inner = item.phases if isinstance(item, Repeat) else (item,)
            flat.extend(type(phase).__name__ + ("*" if isinstance(item, Repeat) else "") for phase in inner)
        return flat

    @ti.kernel
    def _advance_worlds(self, steps: ti.i32):
        for k in range(self.s.worlds * TASK):
            if k % TASK == 0:
                w = k // TASK
                step = 0
                while self.s.status[w] == RUNNING and step < steps:
                    self._step(w)
                    step += 1

    @ti.func
    def _step(self, w):
        for item in ti.static(self.items):
            if self.s.status[w] == RUNNING:
                if ti.static(isinstance(item, Repeat)):
                    while item.pending(w) > 0:
                        for phase in ti.static(item.phases):
                            self._loop(phase, w)
                else:
                    self._loop(item, w)

    @ti.func
    def _loop(self, phase: ti.template(), w):  # type: ignore[valid-type]
        if ti.static(phase.conditional):
            if phase.when(w) > 0:
                for k in range(phase.size(w)):
                    phase.run(w, k)
        else:
            for k in range(phase.size(w)):
                phase.run(w, k)

    @ti.kernel
    def _sweep(self, phase: ti.template()):  # type: ignore[valid-type]
        for w, k in ti.ndrange(self.s.worlds, phase.extent):
            if self.s.status[w] == RUNNING and k < phase.size(w) and phase.when(w) > 0:
                phase.run(w, k)

    @ti.kernel
    def _sweep_pending(self, item: ti.template(), phase: ti.template()):  # type: ignore[valid-type]
        for w, k in ti.ndrange(self.s.worlds, phase.extent):
            if self.s.status[w] == RUNNING and item.pending(w) > 0 and k < phase.size(w):
                phase.run(w, k)

    @ti.kernel
    def _count_running(self) -> ti.i32:
        n = 0
        for w in range(self.s.worlds):
            if self.s.status[w] == RUNNING:
                n += 1
        return n

    @ti.kernel
    def _count_pending(self, item: ti.template()) -> ti.i32:  # type: ignore[valid-type]
        n = 0
        for w in range(self.s.worlds):
            if self.s.status[w] == RUNNING and item.pending(w) > 0:
                n += 1
        return n
