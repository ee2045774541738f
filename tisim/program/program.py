"""A step as a list of loops, and the three ways to run it.

A ``Phase`` is one loop over the items of a world (its particles, its contacts, or the world itself) whose
items are independent of each other. A ``Program`` is the list of phases that make one step, some of them in
a ``Repeat``. The same phases run on three schedules, with the same bits:

"world"    - a thread takes a world through many steps in one launch. No launches and no barriers between
             phases, and a world stays in cache: the way for batches and small systems on a CPU.
"team"     - so does a team of threads: each takes a share of the items of a phase, and they wait for each
             other, awake, before the next (team.py): the way for large systems on many cores of a CPU, or
             smaller ones in which all feel each other. Where other programs want the cores, each thread
             takes a world alone meanwhile (team_trials.py).
"particle" - each phase is one loop of a launch over all particles of all worlds: the way for GPUs, and for
             phases of few long items on a CPU, where threads take tasks as they are done with others. What
             may be repeated begins a launch of its own. On a GPU many steps are launched in a row before
             anybody asks how far worlds have come.

That the bits agree needs no luck: phases only combine through sums in a fixed order, integer atomics and
floating-point minima and maxima, none of which depend on the order of parallel work.
"""

from abc import ABC, abstractmethod

from tisim.backend.taichi import ti
from tisim.program.phases import Item, nested
from tisim.program.routes import NOWHERE
from tisim.state.state import State
from tisim.state.status import NEVER


class StepRules:
    """These rules say, in kernels, which worlds go on, and how far.

    rest_every : worlds rest after a number of steps that is a multiple of this one, for what is done there.
    """

    def __init__(self, s: State, rest_every: int = NEVER) -> None:
        self.s, self.rest_every = s, rest_every

    @ti.func
    def _allow_world(self, w, steps):
        limit = ti.min(self.s.steps[w] + steps, self.s.goal[w])
        if ti.static(self.rest_every < NEVER):
            limit = ti.min(limit, (self.s.steps[w] // self.rest_every + 1) * self.rest_every)
        self.s.step_limit[w] = limit

    @ti.func
    def _waits(self, w):
        return self.s.time[w] >= self.s.pause_time[w] or self.s.steps[w] >= self.s.step_limit[w]

    @ti.func
    def _stop_failed(self, w):
        """Stop a world in which a phase has failed, once all of its items have been heard."""
        if self.s.failed[w] > 0:
            self.s.status[w], self.s.place[w] = self.s.failed[w], NOWHERE


class Program(ABC):
    """A program is one step of every running world, compiled for a state and a list of items."""

    items: tuple[Item, ...]

    @abstractmethod
    def advance(self, steps: int) -> None:
        """Take at most ``steps`` steps of every running world; none goes on past its ``pause_time`` or its
        ``goal``, or after a launch that has left a step under way."""

    @abstractmethod
    def compile(self) -> None:
        """Compile what ``advance`` runs, and run nothing: no world may be running."""

    def names(self) -> list[str]:
        """Return what runs in a step, in order; repeated phases have a star for each repeat that they are
        in."""
        return [phase.name + "*" * depth for phase, depth in nested(self.items)]
