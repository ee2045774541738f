"""What looks at a run from outside, between its steps: the recorder of a trajectory, a checkpoint now and
then, a progress bar, a script's own function. Observers are given to ``Simulation.run``; they do not change a
result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from tisim.errors import is_number, must
from tisim.state.status import WorldStatus

if TYPE_CHECKING:
    from tisim.engine.simulation import Simulation


EARLY_FRACTION = 1e-9
"""What is due may come early by this fraction of an interval, so that rounding of times costs no step."""


def next_due(time: float, interval: float) -> float:
    """Return the first time (s) after this one, s, at which what comes at equal intervals (s) is due."""
    due = (np.floor(time / interval + EARLY_FRACTION) + 1 - EARLY_FRACTION) * interval
    # At intervals that numbers of this size do not resolve it is due at once.
    return float(due) if time < due < np.inf else float(np.nextafter(time, np.inf))


class Observer:
    """This is the contract of an observer.

    1. ``observe`` is called before the first step of a run, then about four times a second, whenever a world
       has come to its pause, and after the last step; never within a step.
    2. ``pause`` is asked after that. A world waits at the end of the first step at or after its pause, the
       earliest of all observers', until all have looked. A time that the world has reached is no pause.
    3. An observer may read whatever a simulation has, save a checkpoint, or raise to stop the run between two
       steps; it runs, loads and restores nothing.
    4. The wall time that it takes is no part of a result's ``wall_s``.
    """

    def pause(self, simulation: Simulation) -> float | np.ndarray:
        """Return when worlds are to wait for this observer next, s: one number for all, or one for each that
        is loaded; never by default."""
        return np.inf

    def observe(self, simulation: Simulation) -> None:
        """Look at a loaded simulation, which is between two steps."""
        raise NotImplementedError(f"{type(self).__name__} must define observe")


Observing = Observer | Callable[["Simulation"], object]
"""An observer, or a plain function of the simulation, may look at a run; no world waits for a function."""


class Callback(Observer):
    """A callback lets a plain function be an observer."""

    def __init__(self, function: Callable[[Simulation], object]) -> None:
        self.function = function

    def observe(self, simulation: Simulation) -> None:
        self.function(simulation)


class Observers:
    """These are all observers of a run, as one."""

    def __init__(self, observers: Sequence[Observing]) -> None:
        """Raise InputError unless each of them is an Observer or a function."""
        must(isinstance(observers, Sequence), "observers", "a list of them", observers)
        for observer in observers:
            usable = isinstance(observer, Observer) or (callable(observer) and not isinstance(observer, type))
            must(usable, "an observer", "an Observer or a function of the simulation", observer)
        self.members = [one if isinstance(one, Observer) else Callback(one) for one in observers]

    def observe(self, simulation: Simulation) -> None:
        """Have all look, in the order given."""
        for member in self.members:
            member.observe(simulation)

    def pauses(self, simulation: Simulation, until: float) -> np.ndarray:
        """Return when each world waits next, s, shape (worlds,): at ``until``, or before it for an
        observer."""
        pauses = np.full(simulation.worlds, until)
        n = len(simulation.scenes)
        if not self.members or n == 0:
            return pauses
        time = simulation.s.read("time")[:n]
        for member in self.members:
            own_pauses = np.broadcast_to(np.asarray(member.pause(simulation), float), n)
            ahead = np.where(own_pauses > time, own_pauses, np.inf)
            pauses[:n] = np.minimum(pauses[:n], ahead)
        return pauses


class MeasureSeries(Observer):
    """A time series holds what each world counts and measures, at the first step in each interval.

    ``series[w]`` are arrays by name for world w: ``time`` (s), ``particles``, each counter of a result's
    ``work``, such as ``outflow``, and each of its ``measures``, such as ``outflow_mass`` or ``lid_force_z``.
    """

    def __init__(self, interval: float) -> None:
        """interval : s of simulated time."""
        must(is_number(interval) and interval > 0, "interval", "a number of s above 0", interval)
        self.interval = interval
        self._rows: list[list[dict[str, float]]] = []

    def pause(self, simulation: Simulation) -> np.ndarray:
        return np.array([self._due(rows) for rows in self._rows])

    def observe(self, simulation: Simulation) -> None:
        s = simulation.s
        self._rows = self._rows or [[] for _ in simulation.scenes]
        now = s.snapshot(("time", "status", "count", *s.counters))
        new = []
        for w, rows in enumerate(self._rows):
            waits = now["time"][w] < self._due(rows) and now["status"][w] == WorldStatus.RUNNING
            if not waits and (not rows or now["time"][w] > rows[-1]["time"]):
                new.append(w)
        for w, measures in zip(new, simulation.measures(new), strict=True):
            counts = {name: float(now[name][w]) for name in s.counters}
            row = {"time": float(now["time"][w]), "particles": float(now["count"][w]), **counts, **measures}
            self._rows[w].append(row)

    def __getitem__(self, w: int) -> dict[str, np.ndarray]:
        rows = self._rows[w]
        return {name: np.array([row[name] for row in rows]) for name in rows[0]}

    def __len__(self) -> int:
        return len(self._rows)

    def _due(self, rows: list[dict[str, float]]) -> float:
        """Return the time (s) of the next entry."""
        if not rows:
            return 0.0
        return next_due(rows[-1]["time"], self.interval)
