"""Why what stands several times in a program is taken: a world says it, so that it is compiled once."""

from enum import IntEnum

from tisim.backend.taichi import ti
from tisim.program.phases import Phase
from tisim.state.state import State


class Occasion(IntEnum):
    """An occasion is when forces are summed, and near pairs looked at."""

    STEP = 0
    """At the end of a step."""
    START = 1
    """Before the first step, at the start or after a world was written to: no time has gone by."""
    AHEAD = 2
    """Before that, as if the first step were over: what lies so deep in each other that the step is too long
    for it would be far apart after it, and nobody would know."""
    AFTER_EVENTS = 3
    """After events have changed who is where: what is remembered is up to date, and stays."""
    NONE = 4
    """Events have changed nothing, and there is nothing to do."""


class Enter(Phase):
    """This phase begins an occasion."""

    def __init__(self, s: State, occasion: Occasion) -> None:
        self.s, self.occasion = s, occasion

    @property
    def name(self) -> str:
        return f"{super().name} {self.occasion.name}"

    @ti.func
    def run(self, w, _k):
        self.s.occasion[w] = self.occasion


class EnterAfterEvents(Phase):
    """This phase begins what follows events, where there were any."""

    def __init__(self, s: State) -> None:
        self.s = s

    @ti.func
    def run(self, w, _k):
        self.s.occasion[w] = ti.select(self.s.events[w] > 0, Occasion.AFTER_EVENTS, Occasion.NONE)


class OnOccasion(Phase):
    """This phase is taken unless there is nothing to do."""

    conditional = True
    s: State

    @ti.func
    def when(self, w):
        return ti.cast(self.s.occasion[w] != Occasion.NONE, ti.i32)
