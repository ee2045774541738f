"""Evaluation stages: each world stores the stage in which forces are summed, so that phases used several
times in a program are compiled once."""

from enum import IntEnum

from tisim.backend.taichi import ti
from tisim.program.phases import Phase
from tisim.state.state import State


class EvaluationStage(IntEnum):
    """The evaluation stage of a world: the reason why forces are summed and near pairs searched."""

    STEP = 0
    """The end of a step."""
    START = 1
    """Before the first step of a run, or after a world was written to: no time has passed."""
    AHEAD = 2
    """Before START, evaluated as if the first step were over. This detects overlaps so deep that the step is
    too long for them; after that step the particles would be far apart and the fault invisible."""
    AFTER_EVENTS = 3
    """After events have added, removed or changed particles: the contact history is up to date and stays."""
    NONE = 4
    """Events have changed nothing, so there is nothing to do."""


class Enter(Phase):
    """This phase sets the evaluation stage."""

    def __init__(self, s: State, evaluation_stage: EvaluationStage) -> None:
        self.s, self.evaluation_stage = s, evaluation_stage

    @property
    def name(self) -> str:
        return f"{super().name} {self.evaluation_stage.name}"

    @ti.func
    def run(self, w, _k):
        self.s.evaluation_stage[w] = self.evaluation_stage


class EnterAfterEvents(Phase):
    """This phase sets the evaluation stage after events: AFTER_EVENTS if there were any, else NONE."""

    def __init__(self, s: State) -> None:
        self.s = s

    @ti.func
    def run(self, w, _k):
        self.s.evaluation_stage[w] = ti.select(
            self.s.events[w] > 0, EvaluationStage.AFTER_EVENTS, EvaluationStage.NONE
        )


class AtStage(Phase):
    """This phase is skipped in the stage NONE."""

    conditional = True
    s: State

    @ti.func
    def when(self, w):
        return ti.cast(self.s.evaluation_stage[w] != EvaluationStage.NONE, ti.i32)
