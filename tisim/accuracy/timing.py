"""Runs that are timed: compiled first, and again and again without."""

from __future__ import annotations

import math
import time
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tisim.backend import memory
from tisim.engine.batches import Progress
from tisim.engine.observer import Observer, Observing
from tisim.engine.result import Result
from tisim.engine.simulation import Simulation
from tisim.errors import RunError
from tisim.scene.scene import Scene

ResultCallback = Callable[[Result], None]
OBSERVATIONS = 127
"""A run is observed so many times on its way. The number is prime: of a motion of any whole number of
periods, but for multiples of it, no two observations are at the same part of the period."""
ROOM = 40
"""So many trees of fields must be free before a simulation is made, which takes two to some ten."""


@dataclass(frozen=True)
class Timed:
    """The results of a run of one or more starts, and its wall seconds without set-up and compilation."""

    results: list[Result]
    seconds: float

    @property
    def work(self) -> tuple[float, float, float]:
        """The number of steps, of force evaluations and of rejected steps, per particle and start."""
        steps, sums, rejections = 0.0, 0.0, 0.0
        for result in self.results:
            n, stepper = len(result.start["mass"]), result.scene.stepper
            independent, evaluations = stepper.independent(result.scene.effects), stepper.evaluations
            steps += result.work["particle_steps"] / n
            sums += evaluations(result.work, n, independent)
            # A rejected step counts as a force evaluation does: of one particle, or of all.
            rejections += evaluations(
                dict.fromkeys(result.work, result.work.get("rejections", 0)), n, independent
            )
        starts = len(self.results)
        return steps / starts, sums / starts, rejections / starts


class ResultObserver(Observer):
    """Lets the first world pause ``OBSERVATIONS`` times on its way, and hands on its result there."""

    def __init__(self, duration: float, on_result: ResultCallback) -> None:
        """duration : simulated time of the run, s."""
        self.times = np.append(duration / OBSERVATIONS * np.arange(OBSERVATIONS + 1), np.inf)
        self.on_result, self.due = on_result, 0.0

    def pause(self, simulation: Simulation) -> np.ndarray:
        return np.array([self.due, *[np.inf] * (len(simulation.scenes) - 1)])

    def observe(self, simulation: Simulation) -> None:
        (result,) = simulation.results([0])
        if result.time >= self.due:
            self.on_result(result)
            self.due = float(self.times[np.searchsorted(self.times, result.time, side="right")])


class SimulationCache:
    """Compiled simulations, one for each structure and number of worlds: idle worlds would be timed too.

    They are kept for as long as there is room for another. Those that were not used for longest go first.
    """

    def __init__(self) -> None:
        self.cached: dict[Any, Simulation] = {}
        self.warm: weakref.WeakSet[Simulation] = weakref.WeakSet()

    def compiled(self, scene: Scene, worlds: int) -> Simulation:
        """Return the simulation that is compiled for a scene of this structure and size."""
        key = scene.structure(), worlds, scene.capacity()
        simulation = self.cached.pop(key, None)
        if simulation is None:
            while self.cached and len(memory.in_use()) > memory.MAX_TREES - ROOM:
                self.cached.pop(next(iter(self.cached))).close()
            simulation = Simulation(scene, worlds)
        self.cached[key] = simulation
        return simulation

    def run(
        self,
        scenes: Sequence[Scene],
        progress: Progress | None = None,
        on_result: ResultCallback | None = None,
    ) -> Timed:
        """Run scenes of one structure at once, compiled before; RunError, with the reason, when one fails.

        progress : called about four times a second, first when all is compiled and the run begins.
        on_result : called with the first scene's result about ``OBSERVATIONS`` times, evenly in its simulated
        time.
        """
        simulation = self.compiled(scenes[0], len(scenes))
        simulation.load(scenes)
        if simulation not in self.warm:
            # What is only compiled when it is first used: steps, and all that reads their results.
            simulation.run(steps=1)
            simulation.results()
            simulation.load(scenes)
            self.warm.add(simulation)
        observers: list[Observing] = [ResultObserver(scenes[0].duration, on_result)] if on_result else []
        if progress:
            observers.append(lambda simulation: progress(simulation.fraction()))
        simulation.run(observers=observers)
        results = simulation.results()
        for result in results:
            if not result.status.ok:
                raise RunError(result.status.reason)
        return Timed(results, simulation.wall_s)

    def close(self) -> None:
        """Give the device memory of all simulations back."""
        for simulation in self.cached.values():
            simulation.close()
        self.cached.clear()
        self.warm.clear()


class OutOfTime(Exception):
    """Raised where a run is stopped because it takes too long."""


class Limit:
    """Progress that stops a run with OutOfTime, so many seconds after it has first been called."""

    def __init__(self, seconds: float, then: Progress) -> None:
        self.seconds, self.then, self.began = seconds, then, math.inf

    def __call__(self, fraction: float) -> None:
        self.began = min(self.began, time.monotonic())
        if fraction < 1.0 and self.spent > self.seconds:
            raise OutOfTime
        self.then(fraction)

    @property
    def spent(self) -> float:
        """Seconds since the first call; 0 before."""
        return max(0.0, time.monotonic() - self.began)
