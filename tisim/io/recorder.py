"""The observer that writes a trajectory while a simulation runs decides when frames are due."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import h5py
import numpy as np

from tisim.engine.observer import Observer, next_due
from tisim.io.reader import Frame
from tisim.state.status import WorldStatus

if TYPE_CHECKING:
    from tisim.engine.simulation import Simulation
    from tisim.io.trajectory import Trajectory


class Recorder(Observer):
    """This observer writes the frames that are due, and has worlds wait for those that come."""

    def __init__(self, trajectory: Trajectory, simulation: Simulation, indices: Sequence[int]) -> None:
        """Record a trajectory. indices : of the scenes of the trajectory, one for each world of the loaded
        simulation."""
        self.trajectory, self.indices = trajectory, list(indices)
        self.interval = [trajectory.recording.interval(scene) for scene in simulation.scenes]
        self.last = [_last_time(trajectory.groups[index]) for index in self.indices]
        # A run that goes on may owe the frame of the time where it goes on: the disk was full.
        self.due = np.array(
            [
                0.0 if last < 0 else next_due(last, interval)
                for last, interval in zip(self.last, self.interval, strict=True)
            ]
        )

    def pause(self, simulation: Simulation) -> np.ndarray:
        return self.due

    def observe(self, simulation: Simulation) -> None:
        s, good = simulation.s, simulation.monitor.last_good
        running = s.read("status") == WorldStatus.RUNNING
        steps, new = s.read("steps"), []
        for w, interval in enumerate(self.interval):
            time = float(good["time"][w])
            if time < self.due[w] and running[w]:
                continue
            self.due[w] = next_due(time, interval)
            if time > self.last[w]:
                new.append(w)
        for w, measures in zip(new, simulation.measures(new), strict=True):
            time, count = float(good["time"][w]), int(good["count"][w])
            arrays = {f.name: good[f.name][w, :count] for f in self.trajectory.fields[self.indices[w]]}
            self.trajectory.write(self.indices[w], Frame(time, int(steps[w]), arrays, measures))
            self.last[w] = time


def _last_time(group: h5py.Group) -> float:
    """Return the time of the last frame, s; below 0 when there is none."""
    times = group["position/time"]
    return float(times[-1]) if len(times) else -1.0
