"""Trajectories: a run's particles at many times, written to an H5MD file as it goes.

A frame is the state at the end of the first step at or after each wanted time; the steps are those of a run
without a trajectory. The file has a group of particles for each scene: ``all``, or ``world_0`` and so on.
Particles are in the order of their ids; a frame with fewer particles than another is filled up (see h5md.py).

The file is written in HDF5's single-writer/multiple-reader mode, in which it can be read at every instant,
also while the run goes on and after it was killed: ``step`` grows last, so what it counts is whole. A killed
run leaves the mark of an open file, which ``frames.frames`` and h5py with ``swmr=True`` read through;
``h5clear -s`` or ``tisim export --format h5md`` take it away for readers that do not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Self

import h5py
import numpy as np

import tisim
from tisim import h5md
from tisim.composition import needed_fields
from tisim.errors import InputError, RunError, must
from tisim.frames import Frame, frames
from tisim.scene import Scene
from tisim.simulation import Simulation
from tisim.state import RUNNING, Field, resolve_fields

EARLY = 1e-9
"""Part of an interval by which a frame may come early, so that rounding of times costs no further step."""


@dataclass(frozen=True)
class Recording:
    """What to record: so many ``frames`` evenly over the duration, or one ``every`` so much time (s).

    The start and the end are recorded always; with ``frames`` the start is one more.
    """

    path: Path | str
    frames: int | None = None
    every: float | None = None

    def __post_init__(self) -> None:
        given = "both" if self.every is not None else "neither"
        must((self.frames is None) != (self.every is None), "recording", "given frames or every", given)
        must(self.frames is None or self.frames >= 1, "frames", "at least 1", self.frames)
        sound = self.every is None or 0 < self.every < np.inf
        must(sound, "every", "above 0 s, and finite", self.every)

    def interval(self, scene: Scene) -> float:
        """Between wanted times, s."""
        return self.every if self.every is not None else scene.duration / (self.frames or 1)


class Trajectory:
    """A file that frames are written to, for scenes that run one after another or side by side.

    A context manager: without ``with``, ``close`` must be called.
    """

    def __init__(self, recording: Recording, scenes: Sequence[Scene], real: str = "f64") -> None:
        """Make the file, in place of any before. real : "f64" or "f32". InputError when it cannot be made."""
        self.recording, self.scenes, self.path = recording, list(scenes), Path(recording.path)
        self.fields = [written(scene) for scene in scenes]
        try:
            self.file = h5py.File(self.path, "w", libver="latest", locking="best-effort")
        except OSError as error:
            raise InputError(
                f"trajectory must be a file that can be written; received {str(self.path)!r} ({error})"
            ) from None
        h5md.metadata(self.file, tisim.__version__)
        self.groups = [self.file.create_group(f"particles/{name}") for name in names(len(scenes))]
        for scene, fields, group in zip(self.scenes, self.fields, self.groups, strict=True):
            h5md.box(group, scene.domain)
            h5md.elements(group, fields, scene.capacity(), np.float64 if real == "f64" else np.float32)
            group.attrs["scene"] = scene.to_toml()
        # From here on nothing can be added but rows.
        self.file.swmr_mode = True

    @classmethod
    def going_on(cls, recording: Recording, scene: Scene, time: float, real: str = "f64") -> Self:
        """The file that a stopped run has left, less its frames after ``time`` (s); a new one if none is."""
        path = Path(recording.path)
        if not path.exists():
            return cls(recording, [scene], real)
        unfinished = path.with_name(path.name + ".new")
        made = cls(replace(recording, path=unfinished), [scene], real)
        with frames(path) as before:
            for frame in before:
                if frame.time <= time:
                    made.write(0, frame)
        unfinished.replace(path)
        made.path = path
        return made

    def write(self, index: int, frame: Frame) -> None:
        """Add a frame of the scene of this index; RunError when the disk is full."""
        group, n = self.groups[index], len(frame.arrays["id"])
        order = np.argsort(frame.arrays["id"], kind="stable")
        row = group["position/step"].shape[0]
        try:
            for field in self.fields[index]:
                value = group[field.name]["value"]
                value.resize((row + 1, max(n, value.shape[1]), *value.shape[2:]))
                value[row, :n] = frame.arrays[field.name][order]
                value.flush()
            # The step comes last: it says that the row is whole.
            for name, entry in (("time", frame.time), ("step", frame.step)):
                column = group["position"][name]
                column.resize((row + 1,))
                column[row] = entry
                column.flush()
        except OSError as error:
            raise RunError(f"{self.path} could not be written: {error}; frames before are intact") from error

    def close(self) -> None:
        """Finish the file."""
        self.file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def record(self, simulation: Simulation, indices: Sequence[int]) -> Recorder:
        """Write frames of a loaded simulation, whose worlds are the scenes of these indices, as it runs."""
        return Recorder(self, simulation, indices)


class Recorder:
    """Looks at a simulation between stretches of steps, and has its worlds wait where a frame is due."""

    def __init__(self, trajectory: Trajectory, simulation: Simulation, indices: Sequence[int]) -> None:
        self.trajectory, self.simulation, self.indices = trajectory, simulation, list(indices)
        self.interval = [trajectory.recording.interval(scene) for scene in simulation.scenes]
        self.last = [_last(trajectory.groups[index]) for index in self.indices]
        self.due = np.full(simulation.worlds, np.inf)
        times = simulation.watch.good["time"]
        for w, interval in enumerate(self.interval):
            # A run that goes on has its frame at the time where it goes on, if one was due.
            self.due[w] = 0.0 if self.last[w] < 0 else self._after(float(times[w]), interval)
        simulation.look = self.look
        self.look()

    @staticmethod
    def _after(time: float, interval: float) -> float:
        """The first time after this one at which a frame is due, s."""
        return float((np.floor(time / interval + EARLY) + 1 - EARLY) * interval)

    def look(self) -> None:
        """Write what is due, and say when each world is due next."""
        s, good = self.simulation.s, self.simulation.watch.good
        running = s.read("status") == RUNNING
        steps = s.read("steps")
        for w, interval in enumerate(self.interval):
            time = float(good["time"][w])
            if time < self.due[w] and running[w]:
                continue
            self.due[w] = self._after(time, interval)
            if time > self.last[w]:
                n = int(good["count"][w])
                arrays = {f.name: good[f.name][w, :n] for f in self.trajectory.fields[self.indices[w]]}
                self.trajectory.write(self.indices[w], Frame(time, int(steps[w]), arrays))
                self.last[w] = time
        s.write("hold", self.due)


def asked(path: Path, frames: int | None, every: float | None, resume: bool) -> Recording | None:
    """What the options of a command ask for; None when that is nothing."""
    if frames is None and every is None:
        begun = resume and path.exists()
        must(not begun, "--frames or --every", "given as before, to go on with trajectory.h5", "neither")
        return None
    return Recording(path, frames, every)


@contextmanager
def recorded(
    recording: Recording | None, path: Path, simulation: Simulation, resume: bool = False
) -> Iterator[None]:
    """While this lasts, record all worlds of a loaded simulation; where nothing is asked for, leave no file.

    resume : go on with the file that a stopped run has left at the path.
    """
    if recording is None:
        path.unlink(missing_ok=True)
        yield
        return
    real, scenes = simulation.runtime.precision, simulation.scenes
    if resume:
        time = float(simulation.watch.good["time"][0])
        trajectory = Trajectory.going_on(recording, scenes[0], time, real)
    else:
        trajectory = Trajectory(recording, scenes, real)
    with trajectory:
        trajectory.record(simulation, range(len(scenes)))
        yield
        simulation.look = None


def names(scenes: int) -> list[str]:
    """Of the groups of particles of so many scenes."""
    return ["all"] if scenes == 1 else [f"world_{index}" for index in range(scenes)]


def written(scene: Scene) -> tuple[Field, ...]:
    """The quantities in a trajectory of a scene: all but what particles remember of each other."""
    fields = resolve_fields(needed_fields(scene.effects, scene.stepper))
    return tuple(field for field in fields if not (field.slots or field.scratch))


def _last(group: h5py.Group) -> float:
    """Time of the last frame, s; below 0 when there is none."""
    times = group["position/time"]
    return float(times[-1]) if len(times) else -1.0
