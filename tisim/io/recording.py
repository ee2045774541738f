"""Recording of a run: the trajectory that a user requests, and the observer that writes its frames."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from tisim.engine.observer import Observer, next_due
from tisim.engine.simulation import Simulation
from tisim.errors import Words, is_number, is_whole, must
from tisim.files import regular_file
from tisim.io.reader import Frame
from tisim.io.trajectory import Trajectory
from tisim.scene.scene import Scene
from tisim.state.status import WorldStatus


@dataclass(frozen=True)
class Recording:
    """A trajectory to record: ``frames`` at equal intervals over the duration, or a frame ``every`` time
    interval (s).

    The start and the end are always recorded; the start is not counted in ``frames``. InputError is raised
    for ``frames`` of a run that ends by itself, such as a packing.
    """

    path: Path | str
    frames: int | None = None
    every: float | None = None

    def __post_init__(self) -> None:
        received = Words("both" if self.every is not None else "neither")
        must((self.frames is None) != (self.every is None), "recording", "given frames or every", received)
        must(
            self.frames is None or is_whole(self.frames, 1),
            "frames",
            "a whole number, at least 1",
            self.frames,
        )
        sound = self.every is None or (is_number(self.every) and 0 < self.every < np.inf)
        must(sound, "every", "above 0 s, and finite", self.every)

    def interval(self, scene: Scene) -> float:
        """Return the time between frames, s."""
        return self.every if self.every is not None else scene.duration / (self.frames or 1)

    def _check(self, scenes: Sequence[Scene]) -> None:
        for scene in scenes:
            check_frames(scene, self.frames, "frames", "every")

    @contextmanager
    def recorders(
        self, scenes: Sequence[Scene], real: str = "f64"
    ) -> Iterator[Callable[[Simulation, Sequence[int]], Recorder]]:
        """Create the file for these scenes, replacing an earlier one, and yield a function that returns the
        observer of a loaded simulation.

        Its arguments are the simulation, and for each of its worlds the index of its scene in the file.
        """
        self._check(scenes)
        with Trajectory(self.path, scenes, real) as trajectory:
            yield lambda simulation, indices: Recorder(trajectory, self.interval, simulation, indices)

    @contextmanager
    def observer(self, simulation: Simulation, resume: bool = False) -> Iterator[Recorder]:
        """Yield an observer, to be passed to each ``run``, that writes all worlds of a loaded simulation.

        The file is created, replacing an earlier one. resume : True to append to the file of a stopped run,
        for a simulation with one world.
        """
        scenes, real = simulation.scenes, simulation.runtime.precision
        self._check(scenes)
        if resume:
            time = float(simulation.monitor.last_good["time"][0])
            file = Trajectory.resume(self.path, scenes[0], time, real)
        else:
            file = Trajectory(self.path, scenes, real)
        with file as trajectory:
            yield Recorder(trajectory, self.interval, simulation, range(len(scenes)))


class Recorder(Observer):
    """An observer that writes a frame of each world when it is due, and pauses worlds at these times."""

    def __init__(
        self,
        trajectory: Trajectory,
        interval: Callable[[Scene], float],
        simulation: Simulation,
        indices: Sequence[int],
    ) -> None:
        """Record a trajectory.

        interval : returns the time between frames of a scene, s.
        indices : for each world of the loaded simulation, the index of its scene in the trajectory.
        """
        self.trajectory, self.indices = trajectory, list(indices)
        self.interval = [interval(scene) for scene in simulation.scenes]
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


def check_frames(scene: Scene, frames: int | None, name: str, other: str) -> None:
    """Raise InputError for a number of frames if a run ends by itself. name, other : of the settings in
    messages."""
    rule = (
        f"replaced by {other}, the time between frames, as this run ends by itself long before its duration"
    )
    rule += f" of {scene.duration:.3g} s"
    must(frames is None or not scene.stepper.ends, name, rule, frames)


def recording_from_options(
    path: Path, frames: int | None, every: float | None, resume: bool
) -> Recording | None:
    """Return the recording requested by the options of a command; None if there is none."""
    if frames is None and every is None:
        resumable = resume and regular_file.exists(path)
        rule = "given as before, to go on with trajectory.h5 (or give --fresh)"
        must(not resumable, "--frames or --every", rule, Words("neither"))
        return None
    return Recording(path, frames, every)
