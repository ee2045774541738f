"""The trajectory that a user requests from a run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tisim.engine.simulation import Simulation
from tisim.errors import Words, is_number, is_whole, must
from tisim.files import regular_file
from tisim.io.recorder import Recorder
from tisim.io.trajectory import Trajectory
from tisim.scene.scene import Scene


@dataclass(frozen=True)
class Recording:
    """A trajectory to record: ``frames`` at equal intervals over the duration, or a frame ``every`` time
    interval (s).

    The start and the end are always recorded; the start is not counted in ``frames``.
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

    def create(self, scenes: Sequence[Scene], real: str = "f64") -> Trajectory:
        """Create the file for these scenes, replacing an earlier one."""
        return Trajectory(self, scenes, real)

    @contextmanager
    def observer(self, simulation: Simulation, resume: bool = False) -> Iterator[Recorder]:
        """Yield an observer, to be passed to each ``run``, that writes all worlds of a loaded simulation.

        The file is created, replacing an earlier one. resume : True to append to the file of a stopped run,
        for a simulation with one world.
        """
        scenes, real = simulation.scenes, simulation.runtime.precision
        if resume:
            time = float(simulation.monitor.last_good["time"][0])
            trajectory_file = Trajectory.resume(self, scenes[0], time, real)
        else:
            trajectory_file = self.create(scenes, real)
        with trajectory_file as trajectory:
            yield trajectory.recorder(simulation, range(len(scenes)))


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
