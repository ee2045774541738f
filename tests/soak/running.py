"""Some steps of scenes with extreme numbers, which must end normally or with a message."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from itertools import islice
from random import Random

from tests import extremes
from tests.judged import check_message, check_result
from tests.soak.apart import Apart, Outcome
from tisim import InputError, Scene, Simulation, StartWarning
from tisim.backend import runtime
from tisim.engine.monitor import REASONS
from tisim.state.status import WorldStatus

STEPS = 50
"""Largest number of steps in a run."""
COMPILING, PATIENCE = 900.0, 60.0
"""Wall time (s) after which a compilation, and a run, which takes a few hundredths of a second, count as
hung."""
DRAWS = 1000
"""Most draws for one accepted scene; about two thirds of the scenes are accepted."""
KEPT = 50
"""Number of scenes that stay compiled, the most recent ones; Taichi has room for some more."""
REFUSED, FAILED, RAN = "refused", "failed", "ran"

Values = dict[extremes.Place, float]
"""The changed numbers of a scene."""
Call = tuple[str, Values | int | None]
"""A name among ``extremes.scenes()``, and a task.

The task is a set of numbers to run with, a seed from which accepted numbers are drawn, or None to compile
only.
"""


def runner() -> Callable[[Call], str]:
    """The function of a separate process that returns the outcome of a run and raises if anything is
    wrong."""
    warnings.simplefilter("error")
    # With extreme numbers grains may overlap at the start; the warning about it is no fault.
    warnings.simplefilter("ignore", StartWarning)
    runtime.init(threads=1)
    compiled: dict[str, Simulation] = {}

    def run(call: Call) -> str:
        name, numbers = call
        if (simulation := compiled.pop(name, None)) is None:
            simulation = Simulation(Scene.from_dict(extremes.scenes()[name]))
        compiled[name] = simulation
        if len(compiled) > KEPT:
            compiled.pop(next(iter(compiled))).close()
        if numbers is None:
            return RAN
        tries: Iterable[Values] = (numbers,)
        if isinstance(numbers, int):
            random = Random(numbers)
            tries = islice(iter(lambda: extremes.draw_values(name, random), None), DRAWS)
        outcomes = (_run_values(simulation, name, values) for values in tries)
        return next((end for end in outcomes if end != REFUSED), REFUSED)

    return run


def _run_values(simulation: Simulation, name: str, values: Values) -> str:
    try:
        scene = Scene.from_dict(extremes.changed(extremes.scenes()[name], values))
        simulation.load([scene])
    except InputError as fault:
        check_message(str(fault))
        return REFUSED
    simulation.run(steps=STEPS)
    (result,) = simulation.results()
    check_result(result)
    good = result.status.ok or result.status.reason == REASONS[WorldStatus.RUNNING]
    return RAN if good else FAILED


class Runs:
    """Scenes run in a separate process, which compiles each one once and allows time for that."""

    def __init__(self) -> None:
        self.apart = Apart(runner)
        self.compiled: list[str] = []

    def __call__(self, name: str, numbers: Values | int) -> Outcome:
        """Outcome of a scene with these numbers, or with numbers drawn from a seed."""
        if name not in self.compiled:
            outcome = self.apart.trial((name, None), COMPILING)
            if outcome[0]:
                return outcome
        self.compiled = [*(other for other in self.compiled if other != name), name][-KEPT:]
        outcome = self.apart.trial((name, numbers), PATIENCE)
        if outcome[0]:
            # The process that compiled the scenes may have been replaced.
            self.compiled.clear()
        return outcome

    def end(self) -> None:
        """End the process."""
        self.apart.end()
