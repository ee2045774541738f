"""Observers look at a run between its steps: trajectory recorders, periodic checkpoints, progress bars,
functions of a script.

They are passed to ``Simulation.run`` and do not change its results.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tisim.data_frames import data_frame
from tisim.engine.assembly import measured
from tisim.errors import is_number, must
from tisim.state.status import WorldStatus

if TYPE_CHECKING:
    from pandas import DataFrame

    from tisim.engine.simulation import Simulation


EARLY_FRACTION = 1e-9
"""An observation may be early by this fraction of an interval, so that rounding of times costs no extra step.
"""


def next_due(time: float, interval: float) -> float:
    """Return the first multiple of an interval (s) after a time (s)."""
    due = (np.floor(time / interval + EARLY_FRACTION) + 1 - EARLY_FRACTION) * interval
    # If the interval is below the resolution of the time, the next observation is due at once.
    return float(due) if time < due < np.inf else float(np.nextafter(time, np.inf))


class Observer:
    """Base class of observers.

    1. ``observe`` is called before the first step of a run, then about four times a second, whenever a world
       has reached its pause, and after the last step; never within a step.
    2. ``pause`` is called after ``observe``. A world waits at the end of the first step at or after the
       earliest pause of all observers until all observers have been called. A time that the world has already
       reached causes no pause.
    3. An observer may read anything of the simulation, save a checkpoint, or raise an exception to stop the
       run between two steps. It must not run, load or restore the simulation.
    4. The wall time of observers is not part of ``wall_s`` of a result.
    """

    def pause(self, simulation: Simulation) -> float | np.ndarray:
        """Return the time (s) at which worlds next wait for this observer: one number for all worlds, or one
        for each loaded world; by default never."""
        return np.inf

    def observe(self, simulation: Simulation) -> None:
        """Look at a loaded simulation, which is between two steps."""
        raise NotImplementedError(f"{type(self).__name__} must define observe")


Observing = Observer | Callable[["Simulation"], object]
"""An observer, or a plain function of the simulation; worlds do not pause for a function."""


class Callback(Observer):
    """A callback makes an observer of a plain function."""

    def __init__(self, function: Callable[[Simulation], object]) -> None:
        self.function = function

    def observe(self, simulation: Simulation) -> None:
        self.function(simulation)


class Observers:
    """All observers of a run, called together."""

    def __init__(self, observers: Sequence[Observing]) -> None:
        """Raise InputError unless each of them is an Observer or a function."""
        must(isinstance(observers, Sequence), "observers", "a list of them", observers)
        for observer in observers:
            usable = isinstance(observer, Observer) or (callable(observer) and not isinstance(observer, type))
            must(usable, "an observer", "an Observer or a function of the simulation", observer)
        self.members = [one if isinstance(one, Observer) else Callback(one) for one in observers]

    def observe(self, simulation: Simulation) -> None:
        """Call all observers, in the order given."""
        for member in self.members:
            member.observe(simulation)

    def pauses(self, simulation: Simulation, until: float) -> np.ndarray:
        """Return the time (s) of the next pause of each world, shape (worlds,): ``until``, or earlier for an
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
    """A time series records the counters and measures of each world at the first step in each interval.

    ``series[w]`` are arrays by name for world w: ``time`` (s), ``particles``, each counter of a result's
    ``work``, such as ``outflow``, and each of its ``measures``, such as ``outflow_mass`` or ``lid_force_z``.
    """

    def __init__(self, interval: float) -> None:
        """interval : simulated time between entries, s."""
        must(is_number(interval) and interval > 0, "interval", "a number of s above 0", interval)
        self.interval = interval
        self._rows: list[list[dict[str, float]]] = []
        self._units: list[dict[str, str]] = []

    def pause(self, simulation: Simulation) -> np.ndarray:
        return np.array([self._due(rows) for rows in self._rows])

    def observe(self, simulation: Simulation) -> None:
        s = simulation.s
        self._rows = self._rows or [[] for _ in simulation.scenes]
        self._units = self._units or [measured(scene.effects) for scene in simulation.scenes]
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

    def to_frame(self, world: int = 0) -> DataFrame:
        """Return the series of a world as a pandas data frame, a row for each entry.

        ``frame.attrs["units"]`` has the unit of each column that has one. InputError if pandas is not
        installed, or if there is no such world.
        """
        must(0 <= world < len(self), "world", f"0 to {len(self) - 1}, after a run", world)
        return data_frame(self[world], {"time": "s"} | self._units[world])

    def _due(self, rows: list[dict[str, float]]) -> float:
        """Return the time (s) of the next entry."""
        if not rows:
            return 0.0
        return next_due(rows[-1]["time"], self.interval)


class PeriodicCheckpoint(Observer):
    """An observer that saves a checkpoint at intervals, so that a killed run can be resumed from the last
    one.

    seconds : wall time between two checkpoints, s.
    """

    def __init__(self, path: str | Path, seconds: float = 60.0) -> None:
        must(seconds >= 0, "seconds between checkpoints", "at least 0", seconds)
        self.path, self.seconds, self.last_saved = Path(path), seconds, time.monotonic()

    def observe(self, simulation: Simulation) -> None:
        if time.monotonic() - self.last_saved > self.seconds:
            simulation.checkpoint(self.path)
            self.last_saved = time.monotonic()
