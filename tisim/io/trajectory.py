"""Trajectories: a run's particles at many times, written to an H5MD file as it goes.

A frame is the state at the end of the first step at or after each wanted time; the steps are those of a run
without a trajectory. The file has a group of particles for each scene: ``all``, or ``world_0`` and so on.
Particles are in the order of their ids; a frame with fewer particles than another is filled up (see h5md.py).

The file can be read after every single write, by any reader, so also after the run was killed (see
growing_hdf5.py); one that comes in the midst of a write must come again, as reader.py does. ``step`` grows
last, so what it counts is whole. The file is made under another name, with room for frames and none in it,
and then put in its place.
"""

from __future__ import annotations

import errno
import io
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np

from tisim import version
from tisim.engine.assembly import needed_fields
from tisim.engine.simulation import Simulation
from tisim.errors import InputError, RunError, must
from tisim.files import regular_file
from tisim.files.atomic import replace_file, temporary_name
from tisim.files.growing_hdf5 import GrowingFile
from tisim.interrupt import defer_signals
from tisim.io import h5md
from tisim.io.reader import Frame, frames, worlds
from tisim.io.recorder import Recorder
from tisim.scene.scene import Scene
from tisim.worlds.fields import Field, resolve_fields

LIBRARY = ("v110", "v110")
"""The versions of HDF5 that can read the file; earlier ones have no checksums of its structure."""
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


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

    def begun(self, scenes: Sequence[Scene], real: str = "f64") -> Trajectory:
        """The file, made anew, for these scenes."""
        return Trajectory(self, scenes, real)

    @contextmanager
    def observer(self, simulation: Simulation, resume: bool = False) -> Iterator[Recorder]:
        """The file, made anew, for all worlds of a loaded simulation while this lasts: what writes to it is
        an observer, to give to each ``run``.

        resume : of a simulation with one world, go on with the file that a stopped run has left.
        """
        scenes, real = simulation.scenes, simulation.runtime.precision
        if resume:
            time = float(simulation.monitor.good["time"][0])
            made = Trajectory.going_on(self, scenes[0], time, real)
        else:
            made = self.begun(scenes, real)
        with made as trajectory:
            yield trajectory.recorder(simulation, range(len(scenes)))


class Trajectory:
    """A file that frames are written to, for scenes that run one after another or side by side.

    A context manager: without ``with``, ``close`` must be called.
    """

    def __init__(self, recording: Recording, scenes: Sequence[Scene], real: str = "f64") -> None:
        """Make the file, in place of any before. real : "f64" or "f32".

        InputError when it cannot be made, RunError when the disk is full.
        """
        self.recording, self.scenes, self.path = recording, list(scenes), Path(recording.path)
        self.fields = [written(scene) for scene in scenes]
        _put(self.path, self._empty(np.float64 if real == "f64" else np.float32))
        self._opened = ExitStack()
        try:
            self._open()
        except BaseException:
            self._finish()
            raise

    # HDF5 calls Growing, in which no signal may be raised: the HDF5 library cannot close the file any more.
    @defer_signals()
    def _open(self) -> None:
        self.disk = self._opened.enter_context(GrowingFile(self.path))
        self.file = self._opened.enter_context(h5py.File(self.disk, "r+", libver=LIBRARY))
        # From here on nothing can be added but rows.
        self.file.swmr_mode = True
        names = h5md.names(len(self.scenes))
        self.groups = [self.file[f"particles/{name}"] for name in names]
        self.checksums = [self.file[f"{h5md.CHECKSUMS}/{name}"] for name in names]

    def _empty(self, real: Any) -> bytes:
        """The file without frames."""
        image = io.BytesIO()
        with h5py.File(image, "w", libver=LIBRARY) as file:
            h5md.metadata(file, version.__version__)
            names = h5md.names(len(self.scenes))
            for name, scene, fields in zip(names, self.scenes, self.fields, strict=True):
                group = file.create_group(f"particles/{name}")
                h5md.box(group, scene.domain)
                h5md.elements(group, fields, scene.capacity(), real)
                h5md.scene(file, name, scene.to_toml())
                h5md.checksums(file, name)
        return image.getvalue()

    @classmethod
    def going_on(cls, recording: Recording, scene: Scene, time: float, real: str = "f64") -> Self:
        """The file that a stopped run has left, less its frames after ``time`` (s); a new one if none is.

        InputError when the file is damaged, or of another scene; it is then as it was.
        """
        path = Path(recording.path)
        if not regular_file.exists(path):
            return cls(recording, [scene], real)
        new = path.with_name(temporary_name(path.name))
        with frames(path) as before, ExitStack() as given_up:
            same = worlds(path) == 1 and before.scene.digest() == scene.digest()
            must(same, "trajectory to go on with", "of the same scene", f"{path}, of another one")
            given_up.callback(new.unlink, missing_ok=True)
            made = cls(replace(recording, path=new), [scene], real)
            given_up.push(made)
            for frame in before:
                if frame.time <= time:
                    made.write(0, frame)
            new.replace(path)
            given_up.pop_all()
        made.path = path
        return made

    @defer_signals()
    def write(self, index: int, frame: Frame) -> None:
        """Add a frame of the scene of this index; RunError when the disk is full. Ctrl-C waits."""
        group, n = self.groups[index], len(frame.arrays["id"])
        order = np.argsort(frame.arrays["id"], kind="stable")
        row = group["position/step"].shape[0]
        arrays = {}
        for field in self.fields[index]:
            value = group[field.name]["value"]
            arrays[field.name] = frame.arrays[field.name][order].astype(value.dtype)
            value.resize((row + 1, max(n, value.shape[1]), *value.shape[2:]))
            value[row, :n] = arrays[field.name]
            self._flush(value)
        clock = h5md.clock_checksum(frame.step, frame.time)
        # The step comes last: it says that the row is whole.
        for column, entry in (
            (self.checksums[index], (clock, h5md.frame_checksum(clock, arrays))),
            (group["position/time"], frame.time),
            (group["position/step"], frame.step),
        ):
            column.resize(row + 1, axis=0)
            column[row] = entry
            self._flush(column)

    def _flush(self, dataset: h5py.Dataset) -> None:
        dataset.flush()
        self._check()

    def _check(self) -> None:
        if self.disk.failure is not None:
            why = self.disk.failure.strerror or self.disk.failure
            raise RunError(f"{self.path} could not be written: {why}; frames before are intact")

    @defer_signals()
    def _finish(self) -> None:
        self._opened.close()

    def close(self) -> None:
        """Finish the file; RunError when not all could be written."""
        self._finish()
        self._check()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._finish()
        if value is None:
            self._check()

    def recorder(self, simulation: Simulation, indices: Sequence[int]) -> Recorder:
        """What writes frames of a loaded simulation, whose worlds are the scenes of these indices: an
        observer, to give to its ``run``."""
        return Recorder(self, simulation, indices)


def asked(path: Path, frames: int | None, every: float | None, resume: bool) -> Recording | None:
    """What the options of a command ask for; None when that is nothing."""
    if frames is None and every is None:
        begun, rule = resume and regular_file.exists(path), "to go on with trajectory.h5 (or give --fresh)"
        must(not begun, "--frames or --every", f"given as before, {rule}", "neither")
        return None
    return Recording(path, frames, every)


def _put(path: Path, image: bytes) -> None:
    try:
        replace_file(path, image)
    except RunError as error:
        cause = error.__cause__
        if not isinstance(cause, OSError) or cause.errno in NO_ROOM:
            raise
        rule = "a file that can be written"
        raise InputError(f"trajectory must be {rule}; received {str(path)!r} ({cause})") from None


def written(scene: Scene) -> tuple[Field, ...]:
    """The quantities in a trajectory of a scene: all but what particles remember of each other."""
    fields = resolve_fields(needed_fields(scene.effects, scene.stepper))
    return tuple(field for field in fields if not (field.slots or field.scratch))
