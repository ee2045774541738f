"""Timed runs: simulations are compiled once and then reused."""

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
"""Number of observations of a run. It is prime, so that for a motion of any whole number of periods (except
multiples of this number) no two observations are at the same phase."""
FREE_TREES = 40
"""This many field trees must be free before a simulation is created, which takes two to about ten."""


@dataclass(frozen=True)
class Timed:
    """The results of a run of one or more starts, and its wall seconds without set-up and compilation."""

    results: list[Result]
    seconds: float

    @property
    def work(self) -> tuple[float, float, float]:
        """The number of steps, force evaluations and rejected steps, per particle and start."""
        steps, sums, rejections = 0.0, 0.0, 0.0
        for result in self.results:
            n, stepper = len(result.start["mass"]), result.scene.stepper
            independent, evaluations = stepper.independent(result.scene.effects), stepper.evaluations
            steps += result.work["particle_steps"] / n
            sums += evaluations(result.work, n, independent)
            # A rejected step is counted like a force evaluation: of one particle, or of all.
            rejections += evaluations(
                dict.fromkeys(result.work, result.work.get("rejections", 0)), n, independent
            )
        starts = len(self.results)
        return steps / starts, sums / starts, rejections / starts


class ResultObserver(Observer):
    """Pauses the first world ``OBSERVATIONS`` times during a run, and passes its result to a callback."""

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
    """Compiled simulations, one for each structure and number of worlds, because idle worlds would add to the
    time.

    Simulations are kept while enough field trees are free for another (FREE_TREES). The least recently used
    are closed first.
    """

    def __init__(self) -> None:
        self.cached: dict[Any, Simulation] = {}
        self.warm: weakref.WeakSet[Simulation] = weakref.WeakSet()

    def compiled(self, scene: Scene, worlds: int) -> Simulation:
        """Return the compiled simulation for a scene of this structure and size."""
        key = scene.structure(), worlds, scene.capacity()
        simulation = self.cached.pop(key, None)
        if simulation is None:
            while self.cached and len(memory.in_use()) > memory.MAX_TREES - FREE_TREES:
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
        """Run scenes of one structure together, after compiling; RunError with the reason if one fails.

        progress : called about four times a second, first when compiling is done and the run begins.
        on_result : called with the first scene's result about ``OBSERVATIONS`` times, at equal intervals of
            simulated time.
        """
        simulation = self.compiled(scenes[0], len(scenes))
        simulation.load(scenes)
        if simulation not in self.warm:
            # Steps, and kernels that read results, are compiled at first use.
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
        """Free the device memory of all simulations."""
        for simulation in self.cached.values():
            simulation.close()
        self.cached.clear()
        self.warm.clear()


class OutOfTime(Exception):
    """Raised when a run exceeds its time limit."""


class Limit:
    """A progress callback that stops a run with OutOfTime when ``seconds`` have passed since its first
    call."""

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
