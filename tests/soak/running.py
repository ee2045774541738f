"""Runs of scenes with extreme numbers, some steps of each: to their end, or to a failure in words."""

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
"""Of a run, at most."""
COMPILING, PATIENCE = 900.0, 60.0
"""Wall time, s, after which compiling a scene, and a run, which takes some hundredths, count as hung."""
DRAWS = 1000
"""Scenes that are drawn for one that is accepted, at most; of three about two are."""
KEPT = 50
"""Scenes that stay compiled at once, those that were run last: Taichi has room for some more."""
REFUSED, FAILED, RAN = "refused", "failed", "ran"

Values = dict[extremes.Place, float]
"""What is changed in a scene."""
Call = tuple[str, Values | int | None]
"""A name among ``extremes.scenes()``, and what to do: run it with these numbers, run it with such drawn from
this seed as are accepted, or only compile it."""


def runner() -> Callable[[Call], str]:
    """In a process of its own: what has come of a run, in which nothing was wrong."""
    warnings.simplefilter("error")
    # Of numbers without sense grains may lie in each other: that is said, and no fault.
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
    """Scenes run in a process of their own, in which each is compiled once, and given time for that."""

    def __init__(self) -> None:
        self.apart = Apart(runner)
        self.compiled: list[str] = []

    def __call__(self, name: str, numbers: Values | int) -> Outcome:
        """What came of a scene with these numbers, or with those drawn from a seed."""
        if name not in self.compiled:
            outcome = self.apart.trial((name, None), COMPILING)
            if outcome[0]:
                return outcome
        self.compiled = [*(other for other in self.compiled if other != name), name][-KEPT:]
        outcome = self.apart.trial((name, numbers), PATIENCE)
        if outcome[0]:
            # Another process may have taken the place of the one that has compiled.
            self.compiled.clear()
        return outcome

    def end(self) -> None:
        """End the process."""
        self.apart.end()
