"""The observer that notes, at equal times, what worlds count and measure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tisim.engine.observer import Observer, next_due
from tisim.errors import is_number, must
from tisim.state.status import WorldStatus

if TYPE_CHECKING:
    from tisim.engine.simulation import Simulation


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
