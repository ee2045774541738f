"""The observer that writes frames to a trajectory during a run."""

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
    """An observer that writes a frame of each world when it is due, and pauses worlds at these times."""

    def __init__(self, trajectory: Trajectory, simulation: Simulation, indices: Sequence[int]) -> None:
        """Record a trajectory.

        indices : for each world of the loaded simulation, the index of its scene in the trajectory.
        """
        self.trajectory, self.indices = trajectory, list(indices)
        self.interval = [trajectory.recording.interval(scene) for scene in simulation.scenes]
        self.last = [_last_time(trajectory.groups[index]) for index in self.indices]
        # A resumed run may lack the frame of the time at which it resumes, if the disk was full.
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
    """Return the time of the last frame, s; negative if there is none."""
    times = group["position/time"]
    return float(times[-1]) if len(times) else -1.0
